"""Gauges: the first pulses that sensors read, judged by an independent solver."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.observables import gauges
from tests.command_line import Command
from tests.conftest import STEEL, paper_scene
from tests.observables.test_first_pulse import ORACLE
from tests.oracles.first_pulses import Trace

TAPER = hc.Chain(8, **{**STEEL, "radius": 5e-3 * 0.95 ** np.arange(8)})
SCENES = {
    "walled": hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid")),
    "taper": hc.Scene(TAPER, hc.Striker(1.0)),
    "damped": hc.Scene(
        hc.Chain(8, **STEEL), hc.Striker(1.0), contact=hc.Contact("restitution", restitution=0.8)
    ),
    "pressed": hc.Scene(
        hc.Chain(8, **STEEL), hc.Striker(1.0), precompression=hc.Precompression(force=20.0)
    ),
    "plain": paper_scene("cosine", 1.0, 2.0, 8),
}


SLOW = ("taper", "damped", "pressed")

traced = cache(Trace)
"""The motion of a scene, which several runs are held against."""


def shares(scene: hc.Scene, backend: hc.Native | hc.Lammps, granule: int) -> list[float]:
    """Errors of force, arrival and width over what is stated."""
    result = backend.run(replace(scene, gauges=(hc.Gauge(granule=granule),)))
    (found,) = result.gauges
    true = traced(scene).gauge(granule, scene.granules.static_force)
    unit = ORACLE * scene.contact_time
    return [
        (abs(found.force / true.force - 1) - ORACLE) / found.force_error,
        (abs(found.arrival - true.arrival) - unit) / found.arrival_error,
        (abs(found.width - (true.end - true.arrival)) - unit) / found.width_error,
    ]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in SCENES]
)
def test_errors_are_bounds(name: str) -> None:
    """At three accuracies in a granule within the chain, and at the free end or the wall."""
    for granule in (5, 8):
        for rtol in (1e-3, 1e-6, 1e-9):
            assert max(shares(SCENES[name], hc.Native(rtol=rtol), granule)) <= 1, (granule, rtol)


def test_lammps_reads_the_same() -> None:
    assert max(shares(SCENES["walled"], hc.Lammps(rtol=1e-4), 5)) <= 1


def test_a_contact_is_its_first_pulse() -> None:
    scene = replace(SCENES["walled"], gauges=(hc.Gauge(contact=4), hc.Gauge(contact=9)))
    result = hc.Native(rtol=1e-6).run(scene)
    first = result.first_pulses
    assert [one.force for one in result.gauges] == [first.force[2], first.force[7]]
    assert [one.arrival for one in result.gauges] == [first.arrival[2], first.arrival[7]]


def test_the_mean_of_a_solitary_wave() -> None:
    """0.7073 of the contact's peak far from the striker."""
    chain = hc.Chain(60, **STEEL)
    scene = hc.Scene(chain, hc.Striker(1.0), gauges=(hc.Gauge(granule=40), hc.Gauge(contact=40)))
    granule, contact = hc.Native(rtol=1e-8).run(scene).gauges
    assert granule.force / contact.force == pytest.approx(0.7073, abs=5e-5)


def test_gauges_are_in_files_and_results(tmp_path: Path) -> None:
    scene = replace(SCENES["plain"], gauges=(hc.Gauge(granule=3), hc.Gauge(contact=2)))
    scene.to_toml(tmp_path / "scene.toml")
    assert hc.Scene.from_toml(tmp_path / "scene.toml") == scene
    document = hc.Native().run(scene).to_dict()
    assert [set(one) & {"granule", "contact"} for one in document["gauges"]] == [
        {"granule"},
        {"contact"},
    ]
    assert document["scene"]["gauge"] == [{"granule": 3}, {"contact": 2}]
    without = hc.Native().run(replace(scene, gauges=()))
    assert without.first_pulses is None
    assert hc.Native(wanted="all").run(scene).gauges == ()
    assert scene.end_time == SCENES["plain"].end_time


TWO = replace(
    SCENES["walled"], gauges=(hc.Gauge(granule=3), hc.Gauge(granule=6), hc.Gauge(contact=9))
)


def test_forces_over_time() -> None:
    """Of the mean of two recorded contacts; in JSON, too; the static force is no part of it."""
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
    """Three granules over the difference of arrivals; the wall's contact is one radius further."""
    result = hc.Native().run(TWO, record=50)
    first, second, wall = result.gauges
    radius = STEEL["radius"]
    assert np.isnan(first.speed)
    expected = 6 * radius / (second.arrival - first.arrival)
    assert second.speed == pytest.approx(expected, rel=1e-12)
    assert wall.speed == pytest.approx(5 * radius / (wall.arrival - second.arrival), rel=1e-12)
    accurate = hc.Native(rtol=1e-9).run(TWO).gauges[1].speed
    assert abs(second.speed / accurate - 1) <= second.speed_error < 1e-4
    assert list(result.to_traces())[1:] == ["gauge_3_N", "gauge_6_N", "wall_N"]
    backwards = hc.Native().run(replace(TWO, gauges=TWO.gauges[1::-1])).gauges[1]
    assert backwards.speed == pytest.approx(second.speed, rel=1e-12)


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


@pytest.mark.parametrize("without", range(4))
def test_a_gauge_without_a_whole_pulse_reads_nothing(
    without: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The mean, its coarser samples and the forces on both sides have one each."""
    calls, pulse = iter(range(4)), gauges._pulse
    monkeypatch.setattr(
        gauges, "_pulse", lambda curve: None if next(calls) == without else pulse(curve)
    )
    scene = replace(SCENES["plain"], gauges=(hc.Gauge(granule=4),))
    (found,) = hc.Native(rtol=1e-4).run(scene).gauges
    assert np.isnan([found.force, found.arrival, found.width, found.force_error]).all()


def test_a_part_of_the_error_is_seen() -> None:
    """The bounds are not so wide that anything is within them: velocity Verlet is off by 1e-3."""
    assert max(shares(SCENES["taper"], hc.Native("velocity-verlet", 1e-6), 5)) > 1e-3
