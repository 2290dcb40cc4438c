"""The result: its text, table and JSON."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
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


def test_a_contact_that_was_never_pressed_may_have_its_peak_later(demo: hc.Scene) -> None:
    scene = replace(demo, chain=replace(demo.chain, gap=1e-6), run=hc.Run(1e-4))
    found = hc.Native().run(scene)
    unpressed = [f"contact {i}" for i in found.contact[found.peak_force == 0].tolist()]
    assert len(unpressed) > 40
    assert set(unpressed) <= set(found.cut_off)


# Table and JSON


def test_json_says_what_the_result_says(demo_reference: hc.Result) -> None:
    document = through_json(demo_reference)
    assert document["backend"] == "native"
    assert document["method"] == "reference"
    frame = demo_reference.to_frame()
    assert list(frame.columns) == ["contact", "peak_force_N", "peak_time_s"]
    assert frame["contact"].tolist() == list(range(2, 61))
    for key in ("peak_force_N", "peak_time_s"):
        assert document[key] == frame[key].tolist()
    assert document["peak_force_N"] == demo_reference.peak_force.tolist()
    assert document["peak_time_s"] == demo_reference.peak_time.tolist()
    assert document["transition_granules"] == 9
    assert document["solitary_wave"] == {
        "peak_force_N": demo_reference.solitary_wave.peak_force,
        "far_field_force_N": demo_reference.solitary_wave.far_field_force,
        "far_field_error": demo_reference.solitary_wave.far_field_error,
        "far_field_reason": None,
        "speed_m_s": demo_reference.solitary_wave.speed,
        "speed_error": demo_reference.solitary_wave.speed_error,
    }
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


@pytest.mark.parametrize("dt", [0.5, 0.65])
def test_a_few_right_digits_are_given_with_an_error_as_large(dt: float) -> None:
    scene = paper_scene("cosine-triangular", 1.0, 2.0, granules=8)
    document = through_json(hc.Native("rk4", dt=dt * scene.units.time).run(scene))
    assert 0.1 < document["error_estimate"] < 1
    assert min(document["peak_force_N"]) > 0


# Short runs


def test_a_run_that_ends_before_its_shock_begins() -> None:
    table = hc.PulseTable((1e-4, 2e-4), (100.0, 100.0))
    scene = hc.Scene(hc.Chain(3, **STEEL), table, hc.Run(5e-5))
    document = through_json(hc.Native("rk4").run(scene))
    assert document["rise_time_s"] is None
    assert document["peak_force_N"] == [0.0, 0.0]
    assert document["peak_time_s"] == [None, None]


# Warnings


@pytest.mark.parametrize(("lost", "more"), [(2, ""), (3, ""), (4, " and 1 more")])
def test_first_pulses_without_a_known_digit_are_named(lost: int, more: str) -> None:
    scene = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0))
    result = hc.Native(rtol=1e-3, wanted="first").run(scene)
    assert result.errors is not None
    first = np.where(np.arange(7) < lost, np.inf, 1e-3)
    (warning,) = replace(result, errors=replace(result.errors, first=first)).warnings
    named = ", ".join(f"contact {k + 2}" for k in range(min(lost, 3)))
    assert f"no digit is known of the first pulse of {named}{more}: with" in warning


@pytest.mark.parametrize("unsure", [0, 2])
def test_largest_forces_that_may_be_off_are_counted(unsure: int) -> None:
    scene = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0))
    result = hc.Native(rtol=1e-3, wanted="first").run(scene)
    assert result.errors is not None
    off = np.where(np.arange(7) < unsure, 0.0101, 0.0099)
    warnings = replace(result, errors=replace(result.errors, peak=off)).warnings
    assert [one[:41] for one in warnings] == [
        "the largest force of 2 of 7 contacts may be"[:41]
    ] * (unsure > 0)
