"""First pulses of contacts and gauges, judged by an independent solver, and what they are for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError, SceneError
from hertzchain.observables import first_pulse
from hertzchain.observables.intervals import observe_samples
from hertzchain.observables.samples import DampedLaw
from tests.command_line import Command
from tests.conftest import STEEL, paper_scene
from tests.oracles import judge
from validation.random_scenes import random_damped_scene, random_scene_with_terms

LONGEST, LONGEST_TIME = 10, 150.0
"""Granules and natural time units of a random scene."""


def random_scene(number: int) -> hc.Scene:
    rng = np.random.default_rng([35, number])
    draw = random_damped_scene if number % 3 == 0 else random_scene_with_terms
    while True:
        scene = draw(rng, LONGEST, LONGEST_TIME)
        if scene.piston is None and not first_pulse.is_driven_to_the_end(scene):
            return scene


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(number, marks=[] if number in (0, 1, 4) else pytest.mark.slow)
        for number in range(300)
    ],
)
def test_random_scenes(number: int) -> None:
    """No first pulse is off by more than what is stated."""
    scene = random_scene(number)
    for rtol in (1e-3, 1e-6, 1e-9):
        try:
            result = hc.Native(rtol=rtol, wanted="first").run(scene)
        except HertzchainError:
            continue  # a refusal is honest
        watched = max(scene, result.scene, key=lambda scene: scene.end_time)
        off = dict(judge.of_first_pulses(result, watched))
        assert {name: part for name, part in off.items() if not part <= 1} == {}, (number, rtol)


TAPER = hc.Scene(
    hc.Chain(
        32, radius=4.76e-3 * 0.9 ** np.arange(32.0), young_modulus=193e9, poisson_ratio=0.3,
        density=8000.0,
    ),
    hc.Striker(0.5),
    hc.Run(1.5e-4),
    wall=hc.Wall("same"),
)  # fmt: skip


def test_chaos_at_the_end_does_not_hide_the_first_pulses() -> None:
    """A taper that ends in granules of 0.2 mm: after 0.9 ms no digit of most peaks is left."""
    short = hc.Native(rtol=1e-8, wanted="first").run(TAPER).first_pulses
    late = replace(TAPER, run=hc.Run(9e-4))
    with pytest.raises(HertzchainError, match="no right digit"):
        hc.Native(rtol=1e-6, wanted="all").run(late)
    result = hc.Native(rtol=1e-6, wanted="first").run(late)
    assert result.errors.wanted <= 1e-6
    assert np.nanmax(result.peak_errors) > 0.01
    assert np.any(result.peak_errors < 1e-6)
    assert result.first_pulses.force == pytest.approx(short.force, rel=1e-6)
    assert "repeated collisions" in result.warnings[-1]


def test_the_incident_wave_not_the_reflected_one() -> None:
    """Near the free end of a long chain nothing is reflected yet when the wave comes by."""
    short, long = (
        hc.Scene(hc.Chain(granules, **STEEL), hc.Striker(1.0), hc.Run(1e-3), wall=wall)
        for granules, wall in ((31, hc.Wall("rigid")), (90, None))
    )
    runs = [hc.Native(rtol=1e-8, wanted="first").run(scene) for scene in (short, long)]
    reflected, incident = (run.first_pulses for run in runs)
    some = slice(0, 28)  # the last two contacts before the wall are pressed by both waves at once
    assert reflected.force[some] == pytest.approx(incident.force[some], rel=1e-7)
    assert reflected.arrival[some] == pytest.approx(incident.arrival[some], rel=1e-7)
    assert np.any(runs[0].peak_force[some] > 1.01 * reflected.force[some])


@pytest.mark.parametrize("contact", [None, hc.Contact("restitution", restitution=0.8)])
def test_without_a_force_a_gauge_reads_nothing(contact: hc.Contact | None) -> None:
    """The striker flies until the end of the run."""
    scene = hc.Scene(
        hc.Chain(4, gap=1e-3, **STEEL), hc.Striker(1.0), hc.Run(1e-5), contact=contact,
        gauges=(hc.Gauge(granule=3),),
    )  # fmt: skip
    result = hc.Native(wanted="first").run(scene)
    assert not result.peak_force.any()
    assert np.isnan(result.gauges[0].force)


@pytest.mark.parametrize("apart", [0.02, 0.5])
def test_a_front_that_rises_slowly(apart: float) -> None:
    """What stood for ten units is the pulse, in however many steps it is exceeded.

    The overlap of a contact with k = 1 rises to 1 within a unit, stays, and grows from 20 on.
    """
    time = np.arange(0.0, 25.0 + apart / 2, apart)
    rise, later = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6]), np.maximum(time - 20, 0)
    motion = np.array([rise(time), *(rise.deriv(n)(time) for n in (1, 2, 3))])[:, :, np.newaxis]
    motion[:, time > 1] = np.array([1.0, 0.0, 0.0, 0.0])[:, np.newaxis, np.newaxis]
    motion[:3, :, 0] += 0.01 * np.array([later**3, 3 * later**2, 6 * later])
    motion[3] = np.nan
    law = DampedLaw(np.ones(1), np.zeros(1), 0.5, False)
    for drives in (True, False):
        watch = first_pulse.Signals(law, np.zeros(1), np.full(1, float(drives)), ()).watch()
        observe_samples(watch, time, motion, motion[0] ** 1.5, np.zeros(2), 0.0)
        pulse = first_pulse.pulses_in(watch)
        assert pulse.is_front[0] == pulse.is_clear[0] == drives
        if drives:
            assert pulse.force[0] == 1.0
            assert rise(pulse.arrival[0]) ** 1.5 == pytest.approx(0.5, abs=1e-3)
            # 1.01 of the force is 1.01^(2/3) of the overlap.
            exceeded = 20 + np.cbrt((1.01 ** (2 / 3) - 1) / 0.01)
            assert pulse.arrival[0] + pulse.width[0] == pytest.approx(exceeded, abs=1e-9)
        else:
            assert pulse.force[0] == pytest.approx(2.25**1.5)


@pytest.mark.parametrize(("duration", "kind"), [(1.0, "front"), (3e-4, "pulse")])
def test_a_force_that_outlasts_the_run_sends_a_front(duration: float, kind: str) -> None:
    shock = hc.Trapezoid(50.0, duration, 2e-5, 2e-5)
    scene = hc.Scene(hc.Chain(8, **STEEL), shock, hc.Run(6e-4), wall=hc.Wall("rigid"))
    assert hc.Native(rtol=1e-6, wanted="first").run(scene).first_columns["kind"][0] == kind


SCENES = {
    "walled": hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid")),
    "pressed": hc.Scene(
        hc.Chain(8, **STEEL), hc.Striker(1.0), precompression=hc.Precompression(force=20.0)
    ),
    "plain": paper_scene("cosine", 1.0, 2.0, 8),
}


TWO = replace(
    SCENES["walled"], gauges=(hc.Gauge(granule=3), hc.Gauge(granule=6), hc.Gauge(contact=9))
)


def test_forces_over_time() -> None:
    """Of the mean of two recorded contacts; in JSON, too; the static force is not part of it."""
    scene = replace(SCENES["pressed"], gauges=(hc.Gauge(granule=5), hc.Gauge(contact=4)))
    result = hc.Native().run(scene, record=400)
    traces = result.to_traces()
    assert list(traces.columns) == ["time_s", "gauge_5_N", "contact_4_N"]
    mean = (result.force_at(5) + result.force_at(6)) / 2 - 20.0
    np.testing.assert_allclose(traces["gauge_5_N"], mean, atol=1e-9)
    np.testing.assert_allclose(traces["contact_4_N"], result.force_at(4) - 20.0, atol=1e-9)
    document = result.to_dict()["gauges"]
    assert document[0]["force_N"] == traces["gauge_5_N"].tolist()
    assert document[1]["time_s"] == traces["time_s"].tolist()
    # 400 times see the crest of a pulse of some twenty of them to less than a per cent.
    first = result.gauges[0]
    during = traces["time_s"] < first.time + first.width
    assert traces["gauge_5_N"][during].max() == pytest.approx(first.force, rel=1e-2)
    with pytest.raises(SceneError, match="run with record"):
        hc.Native().run(scene).to_traces()
    with pytest.raises(SceneError, match=r"the scene needs a \[\[gauge\]\]"):
        hc.Native().run(SCENES["plain"], record=10).to_traces()


def test_speed_from_gauge_to_gauge() -> None:
    """Three granules over the difference of arrivals, whichever gauge stands first."""
    result = hc.Native().run(TWO, record=50)
    first, second, _ = result.gauges
    assert np.isnan(first.speed)
    expected = 6 * STEEL["radius"] / (second.arrival - first.arrival)
    assert second.speed == pytest.approx(expected, rel=1e-12)
    accurate = hc.Native(rtol=1e-9).run(TWO).gauges[1].speed
    assert abs(second.speed / accurate - 1) <= second.speed_error < 1e-4
    assert list(result.to_traces())[1:] == ["gauge_3_N", "gauge_6_N", "wall_N"]
    other_way = replace(TWO, gauges=TWO.gauges[1::-1])
    backwards = hc.Native().run(other_way, record=50).gauges[1]
    assert backwards.speed == pytest.approx(second.speed, rel=1e-12)


WALLED = replace(SCENES["walled"], chain=hc.Chain(20, **STEEL))
FREE = replace(WALLED, wall=None)
AT_10 = replace(
    FREE, shock=hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5, granule=10),
    precompression=hc.Precompression(force=20.0),
)  # fmt: skip
TWO_WAVES = hc.Scene(hc.Chain(20, **STEEL, velocity=(1.0, *[0.0] * 18, -1.0)))


@pytest.mark.parametrize(
    ("scene", "places", "reason"),
    [
        (WALLED, "granule 12, granule 17", None),
        (AT_10, "contact 12, contact 17", None),
        (WALLED, "granule 12, contact 17", "no speed from a granule to a contact: their pulses"),
        (WALLED, "granule 17, contact 21", "no speed from a granule to a wall: their pulses"),
        (WALLED, "contact 17, contact 21", "no speed from a contact to a wall: their pulses"),
        (WALLED, "contact 12, contact 20", "no speed so near an end"),
        (FREE, "granule 12, granule 20", "no speed so near an end"),
        (AT_10, "granule 8, granule 17", "no speed: the arrivals show no wave"),
        (TWO_WAVES, "contact 5, contact 14", "no speed: the arrivals show no wave"),
    ],
)
def test_speed_is_that_of_one_wave_in_like_gauges(
    scene: hc.Scene, places: str, reason: str | None
) -> None:
    """It is that between contacts within 3 %; where there is none, all outputs say why."""
    pairs = [place.split() for place in places.split(", ")]
    given = tuple(hc.Gauge(**{key: int(number)}) for key, number in pairs)
    result = hc.Native().run(replace(scene, gauges=given))
    *_, read = result.to_dict()["gauges"]
    shown = " ".join(str(result).split())
    if reason is None:
        assert read["speed_m_s"] == pytest.approx(result.wave(12, 17).speed, rel=0.03)
    else:
        assert (read["speed_m_s"], read["speed_error"]) == (None, None)
        assert read["speed_reason"].startswith(reason)
    assert (reason or "m/s from the gauge before") in shown


def test_traces_are_written(tmp_path: Path, hertzchain: Command) -> None:
    TWO.to_toml(tmp_path / "scene.toml")
    written = tmp_path / "traces.csv"
    done = hertzchain("run", tmp_path / "scene.toml", "--traces", written, "--record", "60")
    assert done.status == 0, done.err
    frame = pd.read_csv(written)
    assert frame.shape == (60, 4)
    np.testing.assert_allclose(frame, hc.Native(rtol=1e-6).run(TWO, record=60).to_traces())
    SCENES["plain"].to_toml(tmp_path / "plain.toml")
    refused = hertzchain("run", tmp_path / "plain.toml", "--traces", written)
    assert refused.status == 2
    assert "the scene needs a [[gauge]]" in refused.err
