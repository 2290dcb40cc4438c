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

LOADS: dict[str, Any] = {
    "free": {},
    "pressed": {"precompression": hc.Precompression(20.0)},
    "gaps": {"wall": hc.Wall("rigid", gap=1e-6)},
    "damped": {"contact": hc.Contact("restitution", restitution=0.9)},
}


def local(granules: int = 12, **more: Any) -> hc.Scene:
    return hc.Scene(hc.Chain(granules, **STEEL), PULSE, hc.Run(4e-4), **more)


def test_granules_behind_the_shock_rest() -> None:
    """Where nothing presses them, the others are a chain whose first granule is pushed."""
    whole = local()
    ahead = replace(whole, chain=replace(whole.chain, granules=8), shock=replace(PULSE, granule=1))
    found, other = (hc.Native(rtol=1e-9).run(scene) for scene in (whole, ahead))
    assert not found.peak_force[:4].any()
    # Each has an error of at most 1e-9.
    assert found.peak_force[4:] == pytest.approx(other.peak_force, rel=2e-9)


@pytest.mark.parametrize("kind", LOADS)
def test_momentum_and_energy(kind: str) -> None:
    balance = hc.Native(rtol=1e-9).run(local(**LOADS[kind])).balance
    # Measured 3e-12 and 2e-10 at most: the energy has the errors of the accuracy wanted.
    assert balance.momentum == pytest.approx(balance.impulse, rel=1e-10)
    assert balance.energy + balance.dissipated == pytest.approx(balance.work, rel=3e-9)


@pytest.mark.parametrize(
    ("kind", "method"), [("free", "numpy"), ("pressed", "scipy"), ("damped", "scipy")]
)
def test_as_it_is_written(kind: str, method: str) -> None:
    scene = replace(local(7, **LOADS[kind]), run=hc.Run(2e-4))
    compiled, written = (hc.Native(method=one, rtol=1e-6).run(scene) for one in (None, method))
    allowed = compiled.error_estimate + written.error_estimate
    assert written.peak_force == pytest.approx(compiled.peak_force, rel=allowed)


def test_a_sine_drives_a_granule_within_a_pressed_chain() -> None:
    """Two forces that share nothing: the mirror image pulls where this one pushes.

    A weak drive is linear, so the mirrored chain moves the other way.
    """
    drive = hc.Sine(1e-5, 5000.0, 2, granule=3)
    scene = hc.Scene(
        hc.Chain(8, **STEEL), drive, hc.Run(6e-4), precompression=hc.Precompression(20.0)
    )
    other = replace(scene, shock=replace(drive, granule=6))
    found, mirror = (hc.Native("reference").run(one) for one in (scene, other))
    largest = np.max(np.abs(found.displacement))
    # Quadratic terms are 1e-6 of the linear ones, as is the amplitude of the load.
    assert found.displacement == pytest.approx(mirror.displacement[::-1], abs=1e-4 * largest)


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
