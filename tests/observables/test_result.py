"""The result: its text, table, JSON, and the largest pressure, worked out by hand."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.observables.result import yield_warning
from tests.conftest import STEEL, paper_scene


def through_json(result: hc.Result) -> Any:
    """Return the result as read from its JSON; NaN and infinity are not JSON."""
    return json.loads(json.dumps(result.to_dict(), allow_nan=False))


def ending_at(scene: hc.Scene, end_time: float) -> hc.Scene:
    return replace(scene, run=hc.Run(end_time))


# Contents


def test_a_run_that_ends_before_its_shock_says_so() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, granules=6)
    (said,) = hc.Native().run(ending_at(scene, 0.4 * scene.pulse_end)).warnings
    assert "before its shock did" in said
    sine, load = hc.Sine(5.0, 8e3, 10), hc.Precompression(10.0)
    long = replace(scene, shock=sine, precompression=load, wall=hc.Wall("same"))
    (said,) = hc.Native(wanted="first").run(long).warnings
    assert said.endswith("set a later end_time in [run]")  # the default ends earlier, too
    assert hc.Native().run(ending_at(scene, 1.1 * scene.pulse_end)).warnings == ()


def test_transition_and_wave_of_the_demo(demo_reference: hc.Result) -> None:
    assert demo_reference.transition_granules == 9
    wave = demo_reference.solitary_wave
    # Known peaks of contact 10, to nine digits, from two independent solvers.
    assert wave.peak_force == pytest.approx(149.587218, rel=0, abs=5e-7)
    time = dict(zip(demo_reference.contact.tolist(), demo_reference.peak_time, strict=True))
    assert wave.speed == pytest.approx(10 * 9.5e-3 / (time[20] - time[10]), rel=1e-14, abs=0)


def test_balance_vs_the_state_at_the_end(demo_reference: hc.Result) -> None:
    """Momentum, kinetic energy and 2/5 A r^(5/2) of each contact, by hand in SI."""
    mass = 4 / 3 * math.pi * 4.75e-3**3 * 7958.0
    stiffness = 4 / 3 * 193e9 / (2 * 0.91) * math.sqrt(4.75e-3 / 2)
    u, v = demo_reference.displacement, demo_reference.velocity
    overlap = np.maximum(u[:-1] - u[1:], 0.0)
    energy = mass / 2 * np.sum(v**2) + 0.4 * stiffness * np.sum(overlap**2.5)
    # Sums of 60 terms.
    assert demo_reference.balance.momentum == pytest.approx(mass * v.sum(), rel=1e-14, abs=0)
    assert demo_reference.balance.energy == pytest.approx(energy, rel=1e-14, abs=0)


# Table and JSON


def test_json_says_what_the_result_says(demo_reference: hc.Result) -> None:
    document = through_json(demo_reference)
    assert document["backend"] == "native"
    assert document["method"] == "reference"
    frame = demo_reference.to_frame()
    assert list(frame.columns) == ["contact", "peak_force_N", "peak_time_s"]
    assert frame["contact"].tolist() == list(range(2, 61))
    for key, values in (
        ("peak_force_N", demo_reference.peak_force), ("peak_time_s", demo_reference.peak_time)
    ):  # fmt: skip
        assert document[key] == frame[key].tolist() == values.tolist()
    assert document["transition_granules"] == 9
    wave = demo_reference.solitary_wave
    assert list(document["solitary_wave"].values()) == [
        wave.peak_force, wave.far_field_force, wave.far_field_error, None, wave.speed,
        wave.speed_error,
    ]  # fmt: skip
    assert document["error_estimate"] == demo_reference.error_estimate
    assert document["end_time_s"] == demo_reference.scene.end_time
    assert document["rise_time_s"] == demo_reference.scene.rise_time
    # Given as 2 and never computed.
    assert document["momentum_ratio"] == 2.0
    assert {"hertzchain", "numpy", "python", "platform"} <= document["provenance"].keys()


def test_contacts_that_were_never_pressed_are_null() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, granules=60)
    result = hc.Native("rk4").run(ending_at(scene, scene.rise_time / 100))
    document = through_json(result)
    force, time = document["peak_force_N"], document["peak_time_s"]
    assert force[0] > 0
    assert time[0] is not None
    assert force[-1] == 0
    assert time[-1] is None
    assert [t is None for t in time] == [f == 0 for f in force]
    assert document["transition_granules"] is None
    assert "no transition ends" in document["solitary_wave"].pop("far_field_reason")
    assert set(document["solitary_wave"].values()) == {None}


# Warnings


@pytest.fixture(scope="module")
def struck() -> hc.Result:
    """First pulses of a chain with a striker."""
    scene = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0))
    return hc.Native(rtol=1e-3, wanted="first").run(scene)


@pytest.mark.parametrize(("lost", "more"), [(2, ""), (3, ""), (4, " and 1 more")])
def test_first_pulses_without_a_known_digit_are_named(
    struck: hc.Result, lost: int, more: str
) -> None:
    assert struck.errors is not None
    first = np.where(np.arange(7) < lost, np.inf, 1e-3)
    (warning,) = replace(struck, errors=replace(struck.errors, first=first)).warnings
    named = ", ".join(f"contact {k + 2}" for k in range(min(lost, 3)))
    assert f"no digit is known of the first pulse of {named}{more}: with" in warning


@pytest.mark.parametrize("unsure", [0, 2])
def test_largest_forces_that_may_be_off_are_counted(struck: hc.Result, unsure: int) -> None:
    assert struck.errors is not None
    off = np.where(np.arange(7) < unsure, 0.0101, 0.0099)
    warnings = replace(struck, errors=replace(struck.errors, peak=off)).warnings
    assert [warning[:41] for warning in warnings] == [
        "the largest force of 2 of 7 contacts may be"[:41]
    ] * (unsure > 0)


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
    pressure = p0(result.peak_at(contact), curvature, compliance)
    others = [2 / 4.75e-3, 2 * STEEL_COMPLIANCE]
    largest = max(pressure, p0(result.peak_at(2), *others)) if scene.wall else pressure
    shown = result.to_dict()
    # Round-off of a few products and roots.
    assert result.largest_pressure.pressure == pytest.approx(largest, rel=1e-13)
    assert shown["largest_pressure_Pa"] == result.largest_pressure.pressure
    where = contact if largest == pressure else 2
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
    assert any("yield_strength" in warning for warning in warnings) == yields


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
