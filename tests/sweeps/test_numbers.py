"""Rows of sweeps: columns of batches against those of single runs, and numbers of results."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError, SceneError
from hertzchain.scene.file import KEYS
from hertzchain.scene.keys import keys_of
from hertzchain.scene.shocks import PROFILES
from hertzchain.sweeps import loop
from hertzchain.sweeps.columns import (
    FOUND_COLUMNS,
    PARAMETERS,
    column_named,
    columns_of,
    is_result,
    is_whole,
    numbers_of,
)
from hertzchain.sweeps.design import design
from tests.conftest import STEEL, paper_scene
from tests.sweeps.conftest import GRID, LAMMPS, SHORT, all_scenes

SMALL = replace(
    paper_scene("cosine", 1.0, 2.0, granules=60), chain=hc.Chain(60, **STEEL | {"radius": 1e-3})
)
"""A scene whose natural units are far from 1 in SI, and others in each row of the sweep."""

VARY = {"shock.peak_force": "2:40:3", "shock.momentum_ratio": "0.5,2"}

COLUMNS = [column.name for column in columns_of(SHORT, [])]
IN_BATCHES = [name for name in COLUMNS if is_result(name)]


@pytest.fixture(scope="module")
def pairs() -> list[tuple[dict[str, Any], pd.DataFrame, hc.Result]]:
    """Each row of batches with its peaks, and the scene run by itself."""
    drawn: dict[str, Any] = {
        "shock.momentum_ratio": "0.5:2:log",
        "shock.profile": list(PROFILES),
        "chain.granules": "50:70",
        "chain.young_modulus": "1 MPa:400 GPa:log",
        "chain.radius": "10 um:1 m:log",
        "shock.peak_force": "1e-8:1e-6:log",
    }
    rows = []
    for vary, samples in ((VARY, None), (drawn, 3)):
        layout = design(SMALL, vary, samples)
        assert loop._is_batched(layout, hc.Native())
        swept = hc.sweep(SMALL, vary, samples=samples, rtol=1e-7, peaks=True)
        table, peaks = swept.to_frame(), swept.peaks_to_frame()
        assert list(table.columns) == COLUMNS
        assert table["failure"].isna().all()
        of_scene: list[Any] = [alike for _, alike in peaks.groupby("scene")]
        results = map(hc.Native(rtol=1e-7).run, all_scenes(layout))
        of_table: list[Any] = table.to_dict("records")
        rows += list(zip(of_table, of_scene, results, strict=True))
    return rows


@pytest.mark.parametrize("name", IN_BATCHES)
def test_a_column_of_a_batch_is_that_of_a_single_run(
    name: str, pairs: list[tuple[dict[str, Any], pd.DataFrame, hc.Result]]
) -> None:
    assert len(pairs) == 15
    for batch, _, run in pairs:
        single: Any = numbers_of(run)
        if name in ("error_estimate", "force_evaluations"):  # of another kernel
            assert 0 < batch[name] <= 3 * single[name] <= 30 * batch[name]
        elif name == "largest_peak_contact":  # settled waves have many alike
            assert run.peak_at(int(batch[name])) == pytest.approx(run.peak_force.max(), rel=1e-6)
        elif is_whole(name):
            assert batch[name] == single[name]
        elif name.endswith("error"):  # what is left of differences
            assert batch[name] == pytest.approx(single[name], rel=1e-3, abs=1e-7)
        else:
            assert batch[name] == pytest.approx(single[name], rel=1e-6)


def test_peaks_of_a_batch_are_those_of_single_runs(
    pairs: list[tuple[dict[str, Any], pd.DataFrame, hc.Result]],
) -> None:
    for row, peaks, run in pairs:
        force = peaks["peak_force_N"].to_numpy()
        assert peaks["contact"].tolist() == run.contact.tolist()
        counted = run.peak_force >= 1e-3 * run.peak_force.max()  # the estimate is of these
        bound = row["error_estimate"] + run.error_estimate
        assert np.abs(force / run.peak_force - 1)[counted].max() <= bound
        assert row["largest_peak_force_N"] == force.max() == force[row["largest_peak_contact"] - 2]
        for name in ("momentum_ratio", "rise_time"):
            expected = getattr(run.scene, name)
            assert row[f"shock.{name}"] == pytest.approx(expected, rel=1e-14, abs=0)  # roundings
        # Peaks are flat: a force within 1e-6 is within about 1e-3 natural time units.
        late = np.abs(peaks["peak_time_s"].to_numpy() - run.peak_time) / run.scene.units.time
        assert np.median(late) < 1e-3


def test_numbers_are_those_of_the_result() -> None:
    """In SI, from the arrays that every result has, and each of them is looked at."""
    scene = replace(
        SMALL, shock=hc.Striker(1.0), wall=hc.Wall("rigid"),
        precompression=hc.Precompression(2.0),
        gauges=(hc.Gauge(contact=9), hc.Gauge(granule=5)),
    )  # fmt: skip
    result = hc.Native().run(scene)
    force, wave, first = result.peak_force, result.solitary_wave, result.to_frame().iloc[-1]
    expected: dict[str, Any] = {
        "transition_granules": result.transition_granules,
        "solitary_wave_force_N": wave.peak_force,
        "far_field_force_N": wave.far_field_force,
        "far_field_error": wave.far_field_error,
        "speed_m_s": wave.speed,
        "speed_error": wave.speed_error,
        "largest_peak_force_N": force.max(),
        "largest_peak_contact": force.argmax() + 2,
        "last_peak_force_N": force[scene.chain.granules - 2] or None,
        "largest_dynamic_force_N": (force - result.static_force).max(),
        "wall_first_peak_force_N": first["first_peak_force_N"],
        "wall_arrival_time_s": first["arrival_time_s"],
        "wall_contact_time_s": pytest.approx(np.nan, nan_ok=True),  # pressed from the start
        "first_granule_restitution": None,
        "column_restitution": None,
        "wall_peak_force_N": force[-1],
        "wall_peak_time_s": result.peak_time[-1],
        "contacts_cut_off": len(result.cut_off),
        "overlap_ratio": result.overlap_ratio,
        "error_estimate": result.error_estimate,
        "wanted_error": result.wanted_error,
        "force_evaluations": result.force_evaluations,
    }
    for k, read in enumerate(result.gauges, start=1):
        expected[f"gauge_{k}_first_peak_force_N"] = read.force
        expected[f"gauge_{k}_arrival_time_s"] = read.arrival
    assert numbers_of(result) == expected
    assert all(map(is_result, expected))


TWELVE = hc.Chain(12, **STEEL)
LOAD, WALL = hc.Precompression(2.0), hc.Wall("rigid")
CUT_OFF: dict[str, hc.Scene] = {
    "pulse": replace(SHORT, contact=hc.Contact("restitution", restitution=0.9)),
    "gaps": replace(SHORT, chain=replace(TWELVE, gap=1e-6)),
    "load": replace(SHORT, precompression=LOAD),
    "load, wall": replace(SHORT, precompression=LOAD, wall=WALL),
    "gravity": replace(SHORT, precompression=hc.Precompression(gravity=9.81), wall=WALL),
    "striker": hc.Scene(TWELVE, hc.Striker(1.0), wall=WALL, gauges=(hc.Gauge(contact=13),)),
    "piston": hc.Scene(TWELVE, hc.Piston(1.0), gauges=(hc.Gauge(granule=12),)),
    "small beads": hc.Scene(hc.Chain(12, **STEEL | {"radius": (5e-3, 2e-3) * 6}), hc.Striker(1.0)),
}
"""Scenes with numbers of the last contact, of each way in which these are found."""


@pytest.mark.parametrize("kind", CUT_OFF)
@pytest.mark.parametrize(
    ("backend", "share"),
    [
        *((hc.Native(rtol=1e-4), share) for share in (0.1, 0.999)),
        pytest.param(LAMMPS, 0.5, marks=pytest.mark.lammps),
    ],
    ids=["native-0.1", "native-0.999", "lammps-0.5"],
)
def test_what_a_run_did_not_reach_is_empty(
    backend: Any, kind: str, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not 0, nor the static force, nor what the front of the wave brings: peaks, first pulses."""
    monkeypatch.setattr(loop, "_is_short", lambda _, backend: backend.name == "native")
    scene = CUT_OFF[kind]
    whole = hc.Native(rtol=1e-4).run(scene)
    end = share * float(whole.peak_time[-1 if scene.wall is None else -2])
    swept = hc.sweep(scene, {"run.end_time": [end]}, backends=[backend], peaks=True)
    row, last = swept.to_frame().iloc[0], swept.peaks_to_frame().iloc[-1]
    names = [name for name in row.index if name.startswith(("last_", "wall_", "gauge_"))]
    names = [name for name in names if is_result(name)]
    lacking = {name for name in names if pd.isna(numbers_of(whole)[name])}
    pressed = scene.wall is not None and scene.precompression is not None  # from the start
    assert lacking == ({"wall_contact_time_s"} if pressed else set())
    assert not [name for name in names if pd.notna(row[name])]
    assert last[[name for name in last.index if name.endswith(("_N", "_s"))]].isna().all()
    assert row["contacts_cut_off"] > 0


def test_a_contact_that_no_motion_reaches_has_no_force() -> None:
    fixed = tuple(k == 8 for k in range(12))
    scene = hc.Scene(hc.Chain(12, **STEEL, fixed=fixed), hc.Striker(1.0))
    numbers = numbers_of(hc.Native().run(scene))
    assert numbers["last_peak_force_N"] == numbers["contacts_cut_off"] == 0.0
    swept = hc.sweep(scene, {"run.end_time": [1e-9]}, peaks=True)
    row = swept.to_frame().iloc[0]
    assert row[["largest_peak_force_N", "largest_peak_contact"]].isna().all()
    assert swept.peaks_to_frame()["peak_force_N"].isna().tolist() == [True] * 8 + [False] * 3


def test_every_column_has_a_label_with_its_unit() -> None:
    varied = [name for name, key in KEYS.items() if key.label]
    assert set(varied) >= PARAMETERS
    for name in (*varied, *(column.name for column in FOUND_COLUMNS)):
        assert column_named(name).label
        unit = KEYS[name].unit if name in KEYS else ""
        assert f"[{unit}]".replace("^3", "³").replace("^2", "²") in column_named(name).label + "[]"
    assert keys_of(hc.Contact)["restitution"].allowed.endswith("no damping")


# Rows: what single runs and batches have


@pytest.mark.parametrize("room", [0.99, 1.01])
def test_scenes_that_take_long_are_measured_one_by_one(
    room: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    layout = design(SHORT, {"chain.granules": [6, 12]})
    longest = max(s.end_time / s.units.time * s.chain.granules for s in all_scenes(layout))
    monkeypatch.setattr(loop, "_SINGLE_SCENE_WORK", room * longest)
    given = layout.parameters(np.arange(2))
    rows = loop._batched(given, loop.natural(given), hc.Native(), 1)
    assert [*rows] == ([0] if room < 1 else [0, 1])


@pytest.mark.parametrize(
    ("error", "force", "seen", "is_lost"),
    [
        (1e-6, 100.0, 11, False),
        (1e-6, 100.0, 5, False),  # contacts p + 2 and on still pressed: no p
        *((error, 100.0, 11, True) for error in (1.0, np.nan)),
        (1e-6, 1e9, 11, True),  # too deep
    ],
)
def test_rows_of_a_batch(
    error: float, force: float, seen: int, is_lost: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    batch = hc.similar_peak_forces("cosine", 1.0, 2.0, 12, rtol=1e-6)
    batch.peak_passed[0, seen:] = False
    unsure = replace(batch, error_estimate=np.array([error]))
    monkeypatch.setattr("hertzchain.engines.native.batch.plain_peaks", lambda *_: unsure)
    given = design(SHORT, {"peak_force": [force]}).parameters(np.arange(1))
    rows = loop._batched(given, loop.natural(given), hc.Native(), 1)
    assert [*rows] == ([] if is_lost else [0])
    for row in rows.values():
        assert row["transition_granules"] == (5 if seen > 5 else 0)
        waves = [row[name] for name in ("solitary_wave_force_N", "far_field_force_N", "speed_m_s")]
        assert np.isnan(waves).any() == (seen == 5)


def test_a_scene_that_fails_is_a_row_with_the_reason_a_single_run_has() -> None:
    vary: dict[str, Any] = {
        "shock.peak_force": [1e-300, 100.0, 1e9, 1e300],
        "chain.radius": [1e-100, 4.75e-3],
        "shock.momentum_ratio": [1.0, 1e15, 1e260],
    }
    sweep = hc.sweep(SHORT, vary, backends=[hc.Native(rtol=1e-6, time_limit=5.0)])
    layout = design(SHORT, vary)
    given = layout.parameters(np.arange(layout.scenes))
    reasons: list[str | None] = []
    for k in range(layout.scenes):
        try:
            hc.Native(rtol=1e-6, peaks_only=True, time_limit=5.0).run(layout.scene(given, k))
            reasons.append(None)
        except HertzchainError as problem:
            reasons.append(str(problem))
    table = sweep.to_frame()
    assert [None if pd.isna(cell) else cell for cell in table["failure"]] == reasons
    assert reasons.count(None) == 1
    for kind in ("represented", "radii", "that a run may take"):
        assert any(reason and kind in reason for reason in reasons), kind
    failed = table[table["failure"].notna()]
    for name in ("largest_peak_force_N", "error_estimate", "transition_granules"):
        assert failed[name].isna().all()
    counts = sweep.count()
    assert (counts.done, counts.failed, counts.missed) == (24, len(failed), 0)
    assert counts.reason == failed["failure"].iloc[0]


def test_accuracy_that_is_missed_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Under a long pulse repeated collisions of a short chain amplify rounding errors."""
    monkeypatch.setattr("hertzchain.sweeps.loop._is_short", lambda *_: True)  # no processes
    knocked: dict[str, Any] = {"shock.momentum_ratio": [1.0, 300.0], "chain.granules": [4]}
    sweep = hc.sweep(SHORT, knocked, rtol=1e-9)
    counts, table = sweep.count(), sweep.to_frame()
    assert counts.missed == (table["error_estimate"] > 1e-9).sum()
    assert table["error_estimate"][0] <= 1e-9
    steps = hc.sweep(SHORT, knocked, backends=[hc.Native("velocity-verlet")])
    assert steps.to_frame()["error_estimate"].max() > 1e-6
    assert steps.count().missed == 0  # nothing was asked for but steps


@pytest.mark.parametrize(
    ("backends", "words"),
    [
        ((), "must be at least one backend"),
        (np.array("native"), "must be Native, Lammps or the name of a backend"),
        ("gromacs", "backends = 'gromacs': must be one of native, lammps"),
        (None, "must be Native, Lammps or the name"),
        (("native", hc.Native(rtol=1e-4)), "at least one backend, and none twice"),
        ((3,), "must be Native, Lammps or the name"),
    ],
)
def test_backends_that_cannot_be_are_refused(backends: Iterable[Any], words: str) -> None:
    with pytest.raises(SceneError) as problem:
        hc.sweep(SHORT, GRID, backends=backends)
    assert words in str(problem.value)


RATIOS, END = {"momentum_ratio": "0.5:2:1200"}, {"run.end_time": "0.1 ms,0.3 ms"}
MORE = {"momentum_ratio": "0.5:2:1300"}


@pytest.mark.parametrize(
    ("scene", "vary", "backend", "batched", "short"),
    [
        (SHORT, RATIOS, hc.Native(rtol=1e-4), True, True),
        (SHORT, MORE, hc.Native(rtol=1e-4), True, False),
        (SHORT, RATIOS, hc.Native("reference"), False, False),
        (SHORT, RATIOS, hc.Native(dt=1e-7), False, False),
        (SHORT, END, hc.Native(), False, True),
        (replace(SHORT, wall=hc.Wall("rigid")), RATIOS, hc.Native(), False, True),
        (CUT_OFF["pulse"], END, hc.Native(), False, False),  # damped
    ],
)
def test_few_scenes_start_no_process_and_only_plain_ones_are_a_batch(
    scene: hc.Scene, vary: Any, backend: Any, batched: bool, short: bool
) -> None:
    layout = design(scene, vary)
    assert (loop._is_batched(layout, backend), loop._is_short(layout, backend)) == (batched, short)


@pytest.mark.usefixtures("one_core")
def test_where_scenes_are_measured_changes_no_value(monkeypatch: pytest.MonkeyPatch) -> None:
    vary = {"run.end_time": "5e-5:2e-4:12"}  # not for the batch
    tables = []
    for most in (0, 10**9):
        monkeypatch.setattr(loop, "_SERIAL_WORK", most)
        swept = hc.sweep(SHORT, vary, peaks=True)
        tables.append((swept.to_frame(), swept.peaks_to_frame()))
    for frame, other in zip(*tables, strict=True):
        pd.testing.assert_frame_equal(frame, other, check_exact=True)
