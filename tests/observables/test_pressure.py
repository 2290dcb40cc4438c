"""The largest pressure of runs, and warnings of yield, worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.observables.pressure import yield_warning
from tests.conftest import STEEL

STRIKER = hc.Striker(1.0)
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
LIKE = hc.Chain(2, **STEEL)
UNLIKE = hc.Chain(2, [4.75e-3, 2e-3], [193e9, 1.46e9], [0.3, 0.46], [7958.0, 2200.0])
ON_WALL = hc.Wall("elastic", 70e9, 0.33)


def p0(force: float, curvature: float, compliance: float) -> float:
    """(6 F E*^2 / (pi^3 R*^2))^(1/3), Johnson (4.24), from 1/R* and 1/E*."""
    return float((6 * force * curvature**2 / (math.pi**3 * compliance**2)) ** (1 / 3))


STEEL_COMPLIANCE = (1 - 0.3**2) / 193e9
SCENES = {
    "like spheres": (hc.Scene(LIKE, STRIKER), 2, 2 / 4.75e-3, 2 * STEEL_COMPLIANCE),
    "plain": (hc.Scene(LIKE, PULSE), 2, 2 / 4.75e-3, 2 * STEEL_COMPLIANCE),
    "unlike spheres": (
        hc.Scene(UNLIKE, STRIKER), 2, 1 / 4.75e-3 + 1 / 2e-3,
        STEEL_COMPLIANCE + (1 - 0.46**2) / 1.46e9,
    ),
    "sphere on a wall": (
        hc.Scene(LIKE, STRIKER, wall=ON_WALL), 3, 1 / 4.75e-3,
        STEEL_COMPLIANCE + (1 - 0.33**2) / 70e9,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_the_pressure_is_that_of_hertz(name: str) -> None:
    scene, contact, curvature, compliance = SCENES[name]
    result = hc.Native().run(scene)
    found = p0(result.peak_at(contact), curvature, compliance)
    others = [2 / 4.75e-3, 2 * STEEL_COMPLIANCE]
    largest = max(found, p0(result.peak_at(2), *others)) if scene.wall else found
    shown = result.to_dict()
    # Round-off of a few products and roots.
    assert result.largest_pressure.pressure == pytest.approx(largest, rel=1e-13)
    assert shown["largest_pressure_Pa"] == result.largest_pressure.pressure
    where = contact if largest == found else 2
    assert shown["largest_pressure_contact"] == where
    assert shown["largest_pressure_time_s"] == result.peak_time[where - 2]
    assert shown["needed_yield_strength_Pa"] == pytest.approx(largest / 1.6, rel=1e-13)


@pytest.mark.parametrize(("part", "yields"), [(0.999, True), (1.001, False)])
@pytest.mark.parametrize("name", SCENES)
def test_the_weaker_body_yields(name: str, part: float, yields: bool) -> None:
    scene, contact, curvature, compliance = SCENES[name]
    pressure = p0(hc.Native().run(scene).peak_at(contact), curvature, compliance)
    strong, weak = 1e12, part * pressure / 1.6
    if scene.wall is not None:
        wall = replace(ON_WALL, yield_strength=weak)
        scene = replace(scene, chain=replace(LIKE, yield_strength=strong), wall=wall)
    else:
        scene = replace(scene, chain=replace(scene.chain, yield_strength=[strong, weak]))
    warnings = hc.Native().run(scene).warnings
    assert any("yield_strength" in one for one in warnings) == yields


@pytest.mark.parametrize(
    ("shock", "yields"),
    [(hc.Striker(1.0, radius=4e-3), True), (hc.Striker(1.0, density=7e3), False)],
)
def test_a_striker_of_another_material_has_no_known_strength(
    shock: hc.Striker, yields: bool
) -> None:
    chain = replace(LIKE, yield_strength=[1e6, 1e12])
    assert (yield_warning(hc.Scene(chain, shock), np.array([100.0])) is not None) is yields


@pytest.mark.parametrize(("strength", "yields"), [(1e6, True), (1e12, False), (None, False)])
def test_a_near_wall_yields(strength: float | None, yields: bool) -> None:
    pulse = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0, granule=2)
    wall = replace(ON_WALL, yield_strength=strength)
    scene = hc.Scene(LIKE, pulse, wall=replace(ON_WALL, yield_strength=1e12), near_wall=wall)
    warning = yield_warning(scene, np.full(3, 100.0))
    assert (warning is not None) is yields
    assert warning is None or warning.startswith("1 of 3 contacts yield, the near wall most")
