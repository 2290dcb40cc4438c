"""Random scenes of moderate length, drawn to be hard on error bounds: a function for each kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import hertzchain as hc
from hertzchain.scene.pulse import PROFILES
from validation.shipped import STEEL, pulse_of

Draw = Callable[[np.random.Generator, int], hc.Scene]


def _spread(rng: np.random.Generator, low: float, high: float) -> float:
    """Drawn with equal chance in each decade."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _material(rng: np.random.Generator) -> tuple[dict[str, Any], float]:
    """What a chain is of, and F0 [N]: the paper's half of the time."""
    if rng.random() < 0.5:
        return STEEL, 100.0
    of_chain = {
        "radius": _spread(rng, 1e-4, 0.1),
        "young_modulus": _spread(rng, 1e8, 1e12),
        "poisson_ratio": float(rng.uniform(-0.9, 0.5)),
        "density": _spread(rng, 300.0, 2e4),
    }
    return of_chain, _spread(rng, 1e-8, 100.0)


def _pulse(rng: np.random.Generator, granules: int, n: float, ratio: float) -> hc.Scene:
    material, force = _material(rng)
    profile = str(rng.choice(list(PROFILES)))
    shock = hc.Pulse(profile, force, n, momentum_ratio=ratio)
    return hc.Scene(hc.Chain(granules, **material), shock)


def any_pulse(rng: np.random.Generator, longest: int) -> hc.Scene:
    """LM_ratio 0.03 to 50, n 1.03 to 41, chains of 2 to ``longest`` granules."""
    n, ratio = 1 + _spread(rng, 0.03, 40.0), _spread(rng, 0.03, 50.0)
    return _pulse(rng, round(_spread(rng, 2.0, longest)), n, ratio)


def two_maxima(rng: np.random.Generator, longest: int) -> hc.Scene:
    """Where two maxima of one contact change places: LM_ratio 1.5 to 7, short decays."""
    n, ratio = float(rng.uniform(1.02, 4.0)), float(rng.uniform(1.5, 7.0))
    return _pulse(rng, int(rng.integers(4, min(40, longest))), n, ratio)


def sharp_decay(rng: np.random.Generator, longest: int) -> hc.Scene:
    """A force that ends within a thousandth to twice the rise time."""
    n, ratio = 1 + _spread(rng, 1e-3, 2.0), _spread(rng, 0.5, 30.0)
    return _pulse(rng, int(rng.integers(3, min(40, longest))), n, ratio)


def ends_early(rng: np.random.Generator, longest: int) -> hc.Scene:
    """An end time anywhere in the run."""
    scene = any_pulse(rng, longest)
    end = scene.end_time * float(rng.uniform(0.0, 1.0))
    return hc.Scene(scene.chain, scene.shock, hc.Run(end))


def first_instants(rng: np.random.Generator, longest: int) -> hc.Scene:
    """An end time of 1e-10 to twice the rise time."""
    scene = any_pulse(rng, longest)
    end = pulse_of(scene)[1] * _spread(rng, 1e-10, 2.0)
    return hc.Scene(scene.chain, scene.shock, hc.Run(end))


def pulse_table(rng: np.random.Generator, longest: int) -> hc.Scene:
    """Spikes, gaps and plateaus, 0.03 to 20 natural time units apart; a third ends early."""
    material, force = _material(rng)
    chain = hc.Chain(round(_spread(rng, 2.0, min(80, longest))), **material)
    unit = hc.Scene(chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0)).units.time
    rows, kind = int(rng.integers(2, 14)), int(rng.integers(3))
    apart = np.array([_spread(rng, 0.03, 20.0) for _ in range(rows)])
    height = rng.random(rows) * (rng.random(rows) < 0.6)
    if kind == 1:
        apart = np.array([_spread(rng, 0.3, 3.0) for _ in range(rows)])
    elif kind == 2:
        height = rng.random(rows) * (np.arange(rows) % 2)
    if not height.any():
        height[rng.integers(rows)] = 1.0
    time = (np.cumsum(apart) - apart[0] * (rng.random() < 0.5)) * unit
    shock = hc.PulseTable(tuple(time.tolist()), tuple((force * height / height.max()).tolist()))
    scene = hc.Scene(chain, shock)
    if rng.random() < 0.3:
        return hc.Scene(chain, shock, hc.Run(scene.end_time * float(rng.uniform(0.01, 1.0))))
    return scene


KINDS: dict[str, Draw] = {
    kind.__name__.replace("_", " "): kind
    for kind in (any_pulse, two_maxima, sharp_decay, ends_early, first_instants, pulse_table)
}
