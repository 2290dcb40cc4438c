"""Scenes that Hypothesis draws."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.scene.shocks import PROFILES


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers from 10^low to 10^high, of all sizes alike."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


@st.composite
def chains(draw: st.DrawFn, granules: st.SearchStrategy[int]) -> hc.Chain:
    return hc.Chain(
        draw(granules),
        radius=draw(powers_of_ten(-5, 0)),
        young_modulus=draw(powers_of_ten(6, 12)),
        poisson_ratio=draw(st.floats(-0.9, 0.5)),
        density=draw(powers_of_ten(2, 4)),
    )


lengths = st.integers(2, 40)
"""N; short enough for a run of milliseconds."""


@st.composite
def under_a_force(draw: st.DrawFn, granules: st.SearchStrategy[int]) -> tuple[hc.Chain, float]:
    """A chain and a force under which two granules overlap by 1e-8 to 1e-3 of a radius."""
    chain = draw(chains(granules))
    overlap = chain.radius * draw(powers_of_ten(-8, -3))
    return chain, chain.contact_stiffness * overlap**1.5


@st.composite
def pulsed(draw: st.DrawFn, granules: st.SearchStrategy[int] = lengths) -> hc.Scene:
    """A scene with one of the three profiles, LM_ratio 1e-3 to 1e3, n 1.001 to 1001."""
    chain, force = draw(under_a_force(granules))
    pulse = hc.Pulse(
        draw(st.sampled_from(sorted(PROFILES))),
        force,
        1 + draw(powers_of_ten(-3, 3)),
        momentum_ratio=draw(powers_of_ten(-3, 3)),
    )
    return hc.Scene(chain, pulse)


@st.composite
def tabled(draw: st.DrawFn, granules: st.SearchStrategy[int] = lengths) -> hc.Scene:
    """A scene with a pulse table of 2 to 8 rows that lasts 0.01 to 100 natural time units."""
    chain, force = draw(under_a_force(granules))
    unit = _unit_time(chain, force)
    apart = draw(st.lists(powers_of_ten(-3, 0), min_size=1, max_size=7))
    start, length = draw(st.sampled_from([0.0, 0.1])), draw(powers_of_ten(-2, 2))
    time = (start + np.cumsum([0.0, *apart]) / sum(apart)) * length * unit
    heights = st.one_of(st.sampled_from([0.0, 1.0]), st.floats(1e-9, 1.0))
    height = draw(st.lists(heights, min_size=time.size, max_size=time.size))
    height[draw(st.integers(0, time.size - 1))] = 1.0
    return hc.Scene(chain, hc.PulseTable(tuple(time), tuple(force * part for part in height)))


def _unit_time(chain: hc.Chain, force: float) -> float:
    return hc.Scene(chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0)).units.time


any_scene = st.one_of(pulsed(), pulsed(), tabled())
