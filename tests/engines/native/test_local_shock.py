"""Forces that act on another granule than the first."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from tests.conftest import STEEL
from tests.oracles.bounds import lasting

PULSE = hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5, granule=5)


def local(shock: Any = PULSE, **more: Any) -> hc.Scene:
    return hc.Scene(hc.Chain(12, **STEEL), shock, hc.Run(4e-4), **more)


LOAD = hc.Precompression(20.0)

SCENES = {
    "free": local(),
    "pressed": local(precompression=LOAD),
    "gaps": local(wall=hc.Wall("rigid", gap=1e-6)),
    "damped": local(contact=hc.Contact("restitution", restitution=0.9)),
    "sine": local(hc.Sine(10.0, 5000.0, 2, granule=3), precompression=LOAD),
}


def test_a_granule_that_the_chain_does_not_have_is_refused() -> None:
    wrong: tuple[Any, ...] = (0, 13, 2.5)
    for granule in wrong:
        with pytest.raises(SceneError, match=r"granule"):
            hc.Scene(hc.Chain(12, **STEEL), replace(PULSE, granule=granule))


def test_all_of_the_chain_is_watched() -> None:
    """The default end lets the wave pass every contact."""
    scene = replace(local(), run=hc.Run())
    assert hc.Native().run(lasting(scene)).peak_passed[4:].all()


def test_the_unit_of_a_local_shock_is_that_of_the_contact_ahead() -> None:
    """Granules behind, which touch nothing that moves, change neither pulse nor wave."""
    sizes = np.full(12, STEEL["radius"])
    pulse = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0, granule=5)
    scenes = []
    for behind in (1.0, 0.4):
        sizes[:2] = behind * STEEL["radius"]
        chain = hc.Chain(12, **{**STEEL, "radius": sizes.tolist()})
        scenes.append(hc.Scene(chain, pulse))
    like, unlike = scenes
    assert unlike.rise_time == pytest.approx(like.rise_time, rel=1e-14)
    uniform = hc.Scene(hc.Chain(12, **STEEL), replace(pulse, granule=1))
    assert like.rise_time == pytest.approx(uniform.rise_time, rel=1e-14)
    last = [replace(one, shock=replace(pulse, granule=12)).rise_time for one in scenes]
    assert last == pytest.approx([uniform.rise_time] * 2, rel=1e-14)
    peaks = [hc.Native(rtol=1e-9).run(one).peak_force[4:] for one in scenes]
    assert peaks[1] == pytest.approx(peaks[0], rel=3e-9)
