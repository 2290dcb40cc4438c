"""Sweeps: their scenes, results and stored tables."""

from __future__ import annotations

import itertools
import json
import math
import shutil
import weakref
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import polars
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain import theory
from hertzchain.engines.lammps import run_many
from hertzchain.engines.native import Batch
from hertzchain.errors import HertzchainError, OutputError, SceneError
from hertzchain.limits import usable_cores
from hertzchain.scene.pulse import PROFILES, profile_named
from hertzchain.sweeps import measuring
from hertzchain.sweeps import parts as parts_of_sweeps
from hertzchain.sweeps.columns import ALL, COLUMNS, COUNTS, PARAMETERS, is_result
from hertzchain.sweeps.design import MOST_SCENES, Design, design
from hertzchain.sweeps.measuring import Measured
from hertzchain.sweeps.numbers import of_prediction, of_result
from hertzchain.sweeps.parts import MOST_PEAKS, Formulas, Part, cut, is_short, part_size
from hertzchain.sweeps.store import Folder
from hertzchain.sweeps.table import Rows
from tests.command_line import MAIN, process
from tests.conftest import paper_scene

SHORT = paper_scene("cosine", 1.0, 2.0, granules=12)
GRID: dict[str, Any] = {
    "shock.momentum_ratio": "0.5:2:4:log",
    "shock.profile": ["cosine", "triangular"],
}


def all_scenes(found: Design) -> list[hc.Scene]:
    numbers = np.arange(found.scenes)
    parameters = found.parameters(numbers)
    return [found.scene(parameters, k) for k in numbers.tolist()]


def rows_of(sweep: hc.Sweep) -> tuple[list[dict[str, Any]]]:
    """The rows of a table, in the form that ``zip(*...)`` takes."""
    return (sweep.to_frame().to_dict("records"),)  # type: ignore[return-value]


def has_numbers(row: Mapping[Any, Any], numbers: Mapping[str, Any]) -> None:
    """Assert that a row has all these numbers, as far as it has their columns, and no others."""
    for name in filter(is_result, row):
        found, wanted = None if pd.isna(row[name]) else row[name], numbers.get(name)
        assert found == (wanted or None if name in COUNTS else wanted), name


# Scenes


def test_a_grid_is_every_combination_the_last_axis_first() -> None:
    vary: dict[str, Any] = {
        "chain.granules": [8, 9],
        "chain.radius": "1 mm:3 mm:3",
        "shock.profile": "cosine, triangular",
        "shock.momentum_ratio": "0.1:10:3:log",
    }
    found = design(SHORT, vary)
    expected = [
        hc.Scene(
            replace(SHORT.chain, granules=granules, radius=radius),
            hc.Pulse(profile_named(profile), 100.0, 2.0, momentum_ratio=ratio),
        )
        for granules, radius, profile, ratio in itertools.product(
            (8, 9), (0.001, 0.002, 0.003), ("cosine", "triangular"), (0.1, 1.0, 10.0)
        )
    ]
    assert found.scenes == len(expected) == 36
    scenes = all_scenes(found)
    for scene, wanted in zip(scenes, expected, strict=True):
        assert scene.chain == wanted.chain
        assert scene.momentum_ratio == pytest.approx(wanted.momentum_ratio, rel=1e-14, abs=0)
        given, expected_shock = asdict(scene.shock), asdict(wanted.shock)
        del given["momentum_ratio"], expected_shock["momentum_ratio"]
        assert given == expected_shock


@pytest.mark.parametrize("log", [False, True])
def test_a_grid_takes_both_ends_to_the_last_digit(log: bool) -> None:
    ends = 0.1, 0.7
    found = design(SHORT, {"shock.momentum_ratio": f"0.1:0.7:7{':log' * log}"})
    ratios = found.parameters(np.arange(7))["shock.momentum_ratio"]
    assert (ratios[0], ratios[-1]) == ends
    spaced = np.geomspace(*ends, 7) if log else np.linspace(*ends, 7)
    np.testing.assert_allclose(ratios, spaced, rtol=1e-14)  # some roundings


def test_a_range_may_span_all_of_floating_point() -> None:
    grid = design(SHORT, {"shock.momentum_ratio": "1e-200:1e200:5:log"})
    ratios = grid.parameters(np.arange(5))["shock.momentum_ratio"]
    np.testing.assert_allclose(ratios, [1e-200, 1e-100, 1.0, 1e100, 1e200], rtol=1e-13)  # roundings
    drawn = design(SHORT, {"shock.momentum_ratio": "1e-300:1e300:log"}, samples=50)
    assert np.isfinite(drawn.parameters(np.arange(50))["shock.momentum_ratio"]).all()


def test_values_may_be_those_of_numpy_and_pandas() -> None:
    for values in (
        np.array([1, 2], np.int8),
        np.array([1, 2], np.float32),
        pd.Series([1, 2]),
        (k for k in (1, 2)),
        ("1", "2"),
        "1, 2",
    ):
        given = {"shock.momentum_ratio": values}
        assert all_scenes(design(SHORT, given)) == all_scenes(
            design(SHORT, {"shock.momentum_ratio": [1.0, 2.0]})
        )
    drawn = {"shock.momentum_ratio": "1:2"}
    by_numpy = design(SHORT, drawn, samples=np.int64(4), seed=np.int32(3))  # type: ignore[arg-type]
    assert by_numpy == design(SHORT, drawn, samples=4, seed=3)


def test_columns_are_the_same_whoever_typed_the_scene() -> None:
    typed = hc.Scene(hc.Chain(12, 1, 10**20, 0, 7800), hc.Pulse("cosine", 100, 2, momentum_ratio=1))
    table = hc.sweep(typed, {"shock.momentum_ratio": [1, 2]}).to_frame()
    kinds = hc.sweep(SHORT, {"shock.momentum_ratio": [1.0, 2.0]}).to_frame().dtypes
    assert table.dtypes.to_dict() == kinds.to_dict()
    assert table["failure"].isna().all()


def test_a_scene_is_written_as_folders_of_before_have_it() -> None:
    """Another word in it would be another sweep, and such folders were not resumed."""
    found = design(SHORT, {"shock.momentum_ratio": [1.0, 2.0]}).to_dict()["scene"]
    of_pulse = ["profile", "peak_force", "duration_ratio", "momentum_ratio", "rise_time"]
    assert {section: list(keys) for section, keys in found.items()} == {
        "chain": ["granules", "radius", "young_modulus", "poisson_ratio", "density"],
        "shock": of_pulse,
        "run": ["end_time"],
    }


def test_sections_may_be_left_out_and_counts_may_be_written_as_powers_of_ten() -> None:
    short = design(SHORT, {"radius": "1 mm:2 mm:1e1", "momentum_ratio": [1, 2]})
    assert short == design(SHORT, {"chain.radius": "1 mm:2 mm:10", "shock.momentum_ratio": [1, 2]})


def test_granules_are_the_whole_numbers_of_a_grid_each_once() -> None:
    found = design(SHORT, {"chain.granules": "2:10:20:log"})
    assert [scene.chain.granules for scene in all_scenes(found)] == list(range(2, 11))


@pytest.mark.parametrize("log", [False, True])
def test_drawn_granules_have_the_share_of_a_whole_number(log: bool) -> None:
    found = design(SHORT, {"chain.granules": "2:20:log" if log else "2:20"}, samples=4096)
    drawn = found.parameters(np.arange(4096))["chain.granules"]
    # From half a granule below a number to half a granule above it.
    edges = np.arange(1.5, 21.0)
    share = np.diff(np.log(edges) if log else edges)
    # A Sobol sequence fills each interval to a few points.
    expected = 4096 * share / share.sum()
    assert np.abs(np.bincount(drawn, minlength=21)[2:] - expected).max() <= 4
    assert (drawn.min(), drawn.max()) == (2, 20)


def test_momentum_ratio_and_rise_time_take_each_others_place() -> None:
    found = design(SHORT, {"shock.rise_time": "10 us,20 us"})
    assert [scene.rise_time for scene in all_scenes(found)] == [1e-5, 2e-5]
    assert all(scene.pulse and scene.pulse.momentum_ratio is None for scene in all_scenes(found))
    by_time = replace(SHORT, shock=hc.Pulse("cosine", 100.0, 2.0, rise_time=1e-5))
    found = design(by_time, {"shock.momentum_ratio": [1, 2]})
    assert [scene.momentum_ratio for scene in all_scenes(found)] == [1.0, 2.0]


def test_samples_fill_their_ranges_evenly_and_meet_every_combination() -> None:
    vary: dict[str, Any] = {
        "shock.momentum_ratio": "0.1:10:log",
        "shock.profile": ["cosine", "triangular"],
        "chain.granules": "8:12",
        "shock.duration_ratio": "1.5:6",
    }
    found = design(SHORT, vary, samples=1000)
    assert found.scenes == 2000
    given = found.parameters(np.arange(2000))
    profile, ratio, granules, n = (given[f"{name}"] for name in (
        "shock.profile", "shock.momentum_ratio", "chain.granules", "shock.duration_ratio"
    ))  # fmt: skip
    assert (profile == np.repeat(["cosine", "triangular"], 1000)).all()
    for values in (ratio, granules, n):
        assert (values[:1000] == values[1000:]).all()
    # Of a thousand even points each fifth holds 200 to a few; of random ones, to 13 (one sigma).
    for values in (np.log10(ratio) / 2 + 0.5, (n - 1.5) / 4.5, (granules - 8 + 0.5) / 5):
        shares = np.histogram(values[:1000], bins=5, range=(0, 1))[0]
        assert np.abs(shares - 200).max() <= 6
    assert np.abs(np.corrcoef([np.log(ratio), n, granules])[np.triu_indices(3, 1)]).max() < 0.02


def test_a_sample_follows_from_its_number_and_the_seed() -> None:
    vary: dict[str, Any] = {"shock.momentum_ratio": "0.1:10:log", "shock.duration_ratio": "1.5:6"}
    whole = design(SHORT, vary, samples=500).parameters(np.arange(500))
    some = design(SHORT, vary, samples=500).parameters(np.arange(123, 130))
    other = design(SHORT, vary, samples=500, seed=1).parameters(np.arange(500))
    for name in vary:
        assert some[name].tolist() == whole[name][123:130].tolist()
        assert not set(other[name]) & set(whole[name])


@pytest.mark.parametrize("apart", [1, 2, 3, 7])
def test_samples_need_not_be_neighbours(apart: int) -> None:
    found = design(SHORT, {"shock.momentum_ratio": "0.1:10:log"}, samples=50)
    whole = found.parameters(np.arange(50))["shock.momentum_ratio"]
    some = found.parameters(np.arange(3, 50, apart))["shock.momentum_ratio"]
    assert some.tolist() == whole[3::apart].tolist()


@settings(deadline=None, max_examples=50)
@given(st.data())
def test_any_part_of_a_design_is_that_of_the_whole(data: st.DataObject) -> None:
    vary: dict[str, Any] = {"chain.radius": "1 mm:2 mm:3", "shock.peak_force": "1:100:log"}
    if data.draw(st.booleans()):
        vary["shock.profile"] = list(PROFILES)
    if data.draw(st.booleans()):
        vary["chain.poisson_ratio"] = "0:0.4"
    found = design(SHORT, vary, samples=data.draw(st.integers(1, 40)), seed=3)
    start = data.draw(st.integers(0, found.scenes - 1))
    stop = data.draw(st.integers(start + 1, found.scenes))
    whole, part = (
        found.parameters(np.arange(*ends)) for ends in ((0, found.scenes), (start, stop))
    )
    for name in PARAMETERS:
        np.testing.assert_array_equal(part[name], whole[name][start:stop])


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({}, "vary: must be a mapping of at least"),
    ({"vary": {"shock.momentumratio": "1,2"}}, "did you mean shock.momentum_ratio? What can vary"),
    ({"vary": {"shock.radius": "1,2"}}, "did you mean chain.radius?"),
    ({"vary": {"radius": "1,2", "chain.radius": "1,2"}}, "chain.radius: given twice"),
    ({"vary": {"chain.granules": "8,1000001"}}, "must be at most 1,000,000 in a sweep"),
    ({"vary": {"chain.radius": "1:2:2.5"}}, "must have at least 2 values"),
    ({"vary": {"shock.momentum_ratio": "2:1:5"}}, "is empty: the first end must be below"),
    ({"vary": {"shock.momentum_ratio": "1:1:5"}}, "is empty: the first end must be below"),
    ({"vary": {"shock.momentum_ratio": "1:2:0"}}, "must have at least 2 values"),
    ({"vary": {"shock.momentum_ratio": "1:2:1"}}, "must have at least 2 values"),
    ({"vary": {"shock.momentum_ratio": "1:2:x"}}, "must have at least 2 values"),
    ({"vary": {"shock.momentum_ratio": "1:2:3:4"}}, "must be A,B,C or LOW:HIGH:COUNT"),
    ({"vary": {"shock.momentum_ratio": "1:2:3:4:log"}}, "must be A,B,C or LOW:HIGH:COUNT"),
    ({"vary": {"shock.momentum_ratio": "1:log"}}, "must be a number"),
    ({"vary": {"shock.momentum_ratio": "0:2:5:log"}}, "above 0 at both ends to be logarithmic"),
    ({"vary": {"shock.momentum_ratio": "0:2:5"}}, "shock.momentum_ratio = 0.0: must be a finite"),
    ({"vary": {"shock.momentum_ratio": "nan:2:5"}}, "must be between finite numbers"),
    ({"vary": {"shock.momentum_ratio": "1:inf:5"}}, "must be between finite numbers"),
    ({"vary": {"shock.momentum_ratio": ""}}, "must be a number"),
    ({"vary": {"shock.momentum_ratio": []}}, "must take 1 to 100,000 values"),
    ({"vary": {"shock.momentum_ratio": [1, 1.0]}}, "must not have a value twice"),
    ({"vary": {"shock.momentum_ratio": [1, True]}}, "must be a number"),
    ({"vary": {"shock.momentum_ratio": "1,-2"}}, "shock.momentum_ratio = -2.0: must be"),
    ({"vary": {"chain.radius": "1 kg,2 kg"}}, "has the wrong dimension"),
    ({"vary": {"chain.granules": "2.5,3"}}, "must be a whole number"),
    ({"vary": {"chain.granules": "1:10:4"}}, "chain.granules = 1: must be an integer from 2"),
    ({"vary": {"chain.poisson_ratio": "0:0.6:4"}}, "chain.poisson_ratio = 0.6: must be"),
    ({"vary": {"shock.profile": "cosine,square"}}, "shock.profile = 'square': must be"),
    ({"vary": {"shock.profile": "cosine:triangular:2"}}, "has no range: name its values"),
    ({"vary": {"shock.momentum_ratio": "1:2:3", "shock.rise_time": "1 us,2 us"}}, "only one of"),
    ({"vary": {"shock.momentum_ratio": "1:2"}}, "draw with --samples (in Python: samples=)"),
    ({"vary": GRID, "samples": 5}, "are drawn from ranges without a count"),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 0}, "whole number of at least 1"),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 2.5}, "whole number of at least 1"),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 5, "seed": -1}, "whole number from 0"),
    (
        {"vary": {"shock.momentum_ratio": "1:2:1000000", "shock.duration_ratio": "2:3:1000000"}},
        "scenes = 1000000000000: must be at most 100,000,000",
    ),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 10**12}, "must be at most 100,000,000"),
    ({"vary": {"shock.momentum_ratio": "1:2:" + "9" * 5000}}, "must have at least 2 values"),
    ({"vary": [("shock.momentum_ratio", "1,2")]}, "vary: must be a mapping"),
    ({"vary": {3: "1,2"}}, "cannot vary; what can vary: "),
    ({"vary": {"shock.momentum_ratio": 1.0}}, "must be a list of values, or text"),
    ({"vary": {"shock.momentum_ratio": np.float64(1)}}, "must be a list of values, or text"),
    ({"vary": {"shock.momentum_ratio": np.array(1.0)}}, "must be a list of values, or text"),
    ({"vary": {"shock.momentum_ratio": np.ones((2, 2))}}, "must be a list of values, or text"),
    ({"vary": {"shock.momentum_ratio": b"12"}}, "must be a list of values, or text"),
    ({"vary": {"shock.momentum_ratio": {1.0: 2.0}}}, "must be a list of values, or text"),
    ({"vary": {"shock.profile": [["cosine"]]}}, "must be the name of a profile"),
]


@pytest.mark.parametrize(("asked", "words"), REFUSED, ids=[words[:40] for _, words in REFUSED])
def test_a_design_that_cannot_be_is_refused_in_a_sentence(
    asked: dict[str, Any], words: str
) -> None:
    with pytest.raises(SceneError) as problem:
        design(SHORT, **{"vary": {}, **asked})
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)


def test_a_pulse_table_varies_with_its_chain_alone() -> None:
    shock = hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 100.0, 0.0))
    scene = replace(SHORT, shock=shock)
    assert design(scene, {"chain.granules": "8,12"}).scenes == 2
    with pytest.raises(SceneError, match="a shock of profile table has no such key"):
        design(scene, {"shock.peak_force": "1,2"})


def test_a_design_of_many_scenes_costs_nothing_until_they_are_measured() -> None:
    found = design(SHORT, {"shock.momentum_ratio": f"0.1:10:{MOST_SCENES}:log"})
    last = found.parameters(np.arange(MOST_SCENES - 2, MOST_SCENES))["shock.momentum_ratio"]
    assert last[-1] == 10.0
    assert last[0] == pytest.approx(10.0 * (1 - np.log(100) / MOST_SCENES), rel=1e-12, abs=0)


# Parts


@pytest.mark.parametrize("granules", [2, 60, 4000, 1_000_000])
def test_parts_are_all_scenes_once_and_none_is_too_large(granules: int) -> None:
    found = design(SHORT, {"chain.granules": [granules], "shock.momentum_ratio": "0.1:10:20011"})
    backends = (hc.Native(rtol=1e-4), hc.Lammps(), Formulas())
    parts = list(cut(found, backends))
    for backend in backends:
        own = [part for part in parts if part.backend == backend]
        assert [part.name for part in own] == sorted({part.name for part in own})
        assert [part.start for part in own] == [0, *(part.stop for part in own[:-1])]
        assert own[-1].stop == 20011
        sizes = [part.stop - part.start for part in own]
        assert max(sizes) == part_size(found, backend)
        assert max(sizes) * granules <= MOST_PEAKS or max(sizes) == 1


def test_the_longest_chain_limits_what_a_part_has() -> None:
    found = design(SHORT, {"momentum_ratio": "0.1:10:5000", "granules": [2, 1000]})
    # Formulas cost the same for both: only the peaks that are kept count.
    assert part_size(found, Formulas()) == MOST_PEAKS // 1000


# Results


@pytest.mark.parametrize("room", [0.99, 1.01])
def test_scenes_that_take_long_are_measured_one_by_one(
    room: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = design(SHORT, {"chain.granules": [6, 12]})
    longest = max(one.end_time / one.units.time * one.chain.granules for one in all_scenes(found))
    monkeypatch.setattr(measuring, "_LONG", room * longest)
    told: list[int] = []
    measuring.measure(
        found, Part("native-0000", hc.Native(), 0, 2), peaks=False, report_progress=told.append
    )
    assert told == ([1, 1] if room < 1 else [2])


def test_rows_of_the_compiled_batch_are_those_of_single_runs() -> None:
    vary: dict[str, Any] = {
        "shock.momentum_ratio": "0.05:30:log",
        "shock.duration_ratio": "1.1:8",
        "shock.profile": list(PROFILES),
        "chain.granules": "5:70",
        "chain.young_modulus": "1 MPa:400 GPa:log",
        "chain.radius": "10 um:1 m:log",
        "shock.peak_force": "1e-8:1e-6:log",
    }
    sweep = hc.sweep(paper_scene("cosine", 1.0, 2.0), vary, samples=20, rtol=1e-6, peaks=True)
    table, peaks = sweep.to_frame(), sweep.peaks_to_frame()
    assert list(table.columns) == list(COLUMNS)
    scenes = all_scenes(design(paper_scene("cosine", 1.0, 2.0), vary, samples=20))
    assert table["failure"].isna().all()
    for row, scene in zip(table.to_dict("records"), scenes, strict=True):
        result = hc.Native(rtol=1e-9, peaks_only=True).run(scene)
        bound = row["error_estimate"] + result.error_estimate
        own = peaks[peaks["scene"] == row["scene"]]
        force = own["peak_force_N"].to_numpy()
        assert own["contact"].tolist() == result.contact.tolist()
        counted = result.peak_force >= 1e-3 * result.peak_force.max()  # the estimate is of these
        assert np.abs(force / result.peak_force - 1)[counted].max() <= bound
        assert row["largest_peak_force_N"] == force.max() == force[row["largest_peak_contact"] - 2]
        for name in ("momentum_ratio", "rise_time"):
            expected = getattr(scene, name)
            assert row[f"shock.{name}"] == pytest.approx(expected, rel=1e-14, abs=0)  # roundings
        # Peaks are flat: a force within 1e-6 is within about 1e-3 natural time units, and where two
        # maxima are as high as one another the later may be taken for the earlier.
        late = np.abs(own["peak_time_s"].to_numpy() - result.peak_time) / scene.units.time
        assert np.median(late) < 1e-3
        numbers, p = of_result(result), result.transition_granules
        # A change of one per cent may be met a digit earlier; all else follows from p.
        if (None if pd.isna(row["transition_granules"]) else row["transition_granules"]) != p:
            change = np.abs(np.diff(result.peak_force) / result.peak_force[1:])
            assert np.min(np.abs(change - 0.01)) < 2e-6
            continue
        for name, within in (
            ("solitary_wave_force_N", bound), ("far_field_force_N", bound),
            ("overlap_ratio", bound), ("speed_m_s", 1e-4),  # times are known less well
        ):  # fmt: skip
            wanted = np.nan if numbers[name] is None else numbers[name]
            assert row[name] == pytest.approx(wanted, rel=within, abs=0, nan_ok=True)


def test_what_a_run_of_the_batch_costs_is_counted() -> None:
    sweep = hc.sweep(SHORT, GRID, rtol=1e-6)
    for row in sweep.to_frame().to_dict("records"):
        ratio, profile = row["shock.momentum_ratio"], row["shock.profile"]
        alone = hc.similar_peak_forces(profile, ratio, 2.0, 12, rtol=1e-6)
        assert row["force_evaluations"] == alone.force_evaluations[0]


def filled(batch: Batch, force: float) -> tuple[pd.DataFrame, list[bool]]:
    """The row of a scene whose batch this is, and whether it was refused."""
    given = design(SHORT, {"shock.peak_force": [force]}).parameters(np.arange(1))
    rows = Rows(np.arange(1), "native", given, True)
    units = hc.Scene(SHORT.chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0)).units
    at = (np.array([value]) for value in (units.force, units.length, units.time))
    lost = rows.add_batch(np.arange(1), batch, *at)
    return rows.table(), lost.tolist()


def test_what_a_batch_did_not_see_the_end_of_has_no_p() -> None:
    batch = hc.similar_peak_forces("cosine", 1.0, 2.0, 12, rtol=1e-6)
    table, lost = filled(batch, 100.0)
    assert lost == [False]
    p = table["transition_granules"][0]
    assert p == 5
    passed = batch.peak_passed.copy()
    passed[0, p:] = False  # contacts p + 2 and on still pressed
    table, lost = filled(replace(batch, peak_passed=passed), 100.0)
    assert lost == [False]
    assert table["transition_granules"].isna().all()
    assert table[["solitary_wave_force_N", "far_field_force_N", "speed_m_s"]].isna().all(axis=None)


@pytest.mark.parametrize("error", [1.0, np.inf, np.nan])
def test_a_batch_without_a_sure_digit_fills_in_nothing(error: float) -> None:
    batch = hc.similar_peak_forces("cosine", 1.0, 2.0, 12, rtol=1e-6)
    table, lost = filled(replace(batch, error_estimate=np.array([error])), 100.0)
    assert lost == [True]
    found = [column.name for column in ALL if is_result(column.name)]
    assert table.loc[0, [*found, "failure"]].isna().all()
    assert filled(batch, 1e9)[1] == [True]  # too deep


def test_what_the_batch_does_not_take_is_run_scene_by_scene() -> None:
    table_shock = hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 100.0, 0.0))
    cases: list[tuple[hc.Scene, dict[str, Any]]] = [
        (SHORT, {"run.end_time": "0.1 ms,0.3 ms"}),
        (replace(SHORT, run=hc.Run(1e-4)), {"shock.momentum_ratio": "0.5,1"}),
        (replace(SHORT, shock=table_shock), {"chain.granules": "8,12"}),
    ]
    for scene, vary in cases:
        sweep = hc.sweep(scene, vary, peaks=True)
        scenes = all_scenes(design(scene, vary))
        for k, (row, one) in enumerate(zip(*rows_of(sweep), scenes, strict=True)):
            result = hc.Native(rtol=1e-6, peaks_only=True).run(one)
            own = sweep.peaks_to_frame().query(f"scene == {k}")
            assert own["peak_force_N"].tolist() == result.peak_force.tolist()
            assert own["peak_time_s"].dropna().tolist() == [t for t in result.peak_time if t == t]  # noqa: PLR0124
            assert row["shock.momentum_ratio"] == one.momentum_ratio
            has_numbers(row, of_result(result))


def test_a_scene_that_fails_is_a_row_with_the_reason_a_single_run_has() -> None:
    vary: dict[str, Any] = {
        "shock.peak_force": [1e-300, 100.0, 1e9, 1e300],
        "chain.radius": [1e-100, 4.75e-3],
        "shock.momentum_ratio": [1.0, 1e15, 1e260],
    }
    sweep = hc.sweep(SHORT, vary, backends=[hc.Native(rtol=1e-6, time_limit=5.0)])
    found = design(SHORT, vary)
    given = found.parameters(np.arange(found.scenes))
    reasons: list[str | None] = []
    for k in range(found.scenes):
        try:
            hc.Native(rtol=1e-6, peaks_only=True, time_limit=5.0).run(found.scene(given, k))
            reasons.append(None)
        except HertzchainError as problem:
            reasons.append(str(problem))
    table = sweep.to_frame()
    assert [None if pd.isna(one) else one for one in table["failure"]] == reasons
    assert reasons.count(None) == 1
    for kind in ("represented", "radii", "that a run may take"):
        assert any(reason and kind in reason for reason in reasons), kind
    failed = table[table["failure"].notna()]
    for name in ("largest_peak_force_N", "error_estimate", "transition_granules"):
        assert failed[name].isna().all()
    counts = sweep.count()
    assert (counts.done, counts.failed, counts.missed) == (24, len(failed), 0)
    assert counts.reason == failed["failure"].iloc[0]


def test_the_formulas_say_what_predict_says() -> None:
    scene = paper_scene("cosine", 1.0, 2.0)
    vary: dict[str, Any] = {
        "shock.momentum_ratio": [0.01, 0.5, 2.0],
        "shock.profile": list(PROFILES),
    }
    sweep = hc.sweep(scene, vary, backends=["formulas"], peaks=True)
    peaks = sweep.peaks_to_frame()
    for k, (row, one) in enumerate(
        zip(*rows_of(sweep), all_scenes(design(scene, vary)), strict=True)
    ):
        predicted, own = theory.predict(one), peaks.loc[peaks["scene"] == k, "peak_force_N"]
        if row["shock.momentum_ratio"] == 0.01:
            assert row["failure"] == predicted.missing
            assert own.empty
            continue
        assert own.tolist() == predicted.peak_force.tolist()
        has_numbers(row, of_prediction(predicted))


@pytest.mark.lammps
def test_rows_of_lammps_are_those_of_its_runs() -> None:
    vary: dict[str, Any] = {"shock.momentum_ratio": "0.5:2:3", "chain.granules": [6, 12]}
    lammps = hc.Lammps(rtol=1e-3)
    sweep = hc.sweep(SHORT, vary, backends=[lammps], peaks=True)
    peaks, table = sweep.peaks_to_frame(), sweep.to_frame()
    for k, result in enumerate(run_many(all_scenes(design(SHORT, vary)), lammps)):
        assert isinstance(result, hc.Result)
        own = peaks[peaks["scene"] == k]
        assert own["peak_force_N"].tolist() == result.peak_force.tolist()
        assert own["peak_time_s"].tolist() == result.peak_time.tolist()
        assert table["error_estimate"][k] == result.error_estimate
        assert table["force_evaluations"][k] == result.force_evaluations


def test_accuracy_that_is_missed_is_counted() -> None:
    """Under a long pulse repeated collisions of a short chain amplify rounding errors."""
    knocked: dict[str, Any] = {"shock.momentum_ratio": [1.0, 300.0], "chain.granules": [4]}
    sweep = hc.sweep(SHORT, knocked, rtol=1e-9)
    counts, table = sweep.count(), sweep.to_frame()
    assert counts.missed == (table["error_estimate"] > 1e-9).sum()
    assert table["error_estimate"][0] <= 1e-9
    formulas = hc.sweep(SHORT, {"chain.granules": [12, 60]}, backends=["native", "formulas"])
    assert formulas.to_frame()["error_estimate"].max() > 1e-6
    assert formulas.count().missed == 0  # of formulas no accuracy can be asked for
    steps = hc.sweep(SHORT, knocked, backends=[hc.Native("velocity-verlet")])
    assert steps.to_frame()["error_estimate"].max() > 1e-6
    assert steps.count().missed == 0  # nothing was asked for but steps


@pytest.mark.parametrize(
    ("backends", "words"),
    [
        ((), "must be at least one"),
        (("gromacs",), "backends = 'gromacs': must be one of native, lammps, formulas"),
        ("gromacs", "backends = 'gromacs': must be one of native, lammps, formulas"),
        (None, "must be Native, Lammps or the name"),
        (("native", hc.Native(rtol=1e-4)), "must not be given twice"),
        ((3,), "must be Native, Lammps or the name"),
    ],
)
def test_backends_that_cannot_be_are_refused(backends: Iterable[Any], words: str) -> None:
    with pytest.raises(SceneError) as problem:
        hc.sweep(SHORT, GRID, backends=backends)
    assert words in str(problem.value)


# Stored sweeps


def test_a_folder_has_what_memory_has_and_opens_in_pandas_polars_and_duckdb(tmp_path: Path) -> None:
    vary: dict[str, Any] = {**GRID, "shock.peak_force": [100.0, 1e9]}  # the second too deep
    backends = ["native", "formulas"]
    out = tmp_path / "out"
    kept = hc.sweep(SHORT, vary, backends=backends, peaks=True, output=out)
    memory = hc.sweep(SHORT, vary, backends=backends, peaks=True)
    table = memory.to_frame().sort_values(["backend", "scene"], ignore_index=True)
    for found in (kept.to_frame(), hc.Sweep.load(out).to_frame()):
        pd.testing.assert_frame_equal(found, table, check_exact=True)
    pd.testing.assert_frame_equal(kept.peaks_to_frame(), memory.peaks_to_frame(), check_exact=True)
    assert kept.count() == memory.count()
    for name, expected in (("scenes", table), ("peaks", kept.peaks_to_frame())):
        opened = {
            "pandas": pd.read_parquet(out / name),
            "polars": polars.read_parquet(out / name / "*.parquet").to_pandas(),
            "duckdb": duckdb.read_parquet(f"{out / name}/*.parquet").df(),
        }
        for who, frame in opened.items():
            assert list(frame.columns) == list(expected.columns), who
            whole = frame.sort_values(list(expected.columns[:3]), ignore_index=True)
            wanted = expected.sort_values(list(expected.columns[:3]), ignore_index=True)
            for column in expected.columns:
                there, here = (one[column].astype(object).tolist() for one in (whole, wanted))
                assert list(map(pd.isna, there)) == list(map(pd.isna, here)), (who, column)
                numbers = [(a, b) for a, b in zip(there, here, strict=True) if not pd.isna(a)]
                assert all(a == b for a, b in numbers), (who, column)


def test_csv_has_what_parquet_has_to_the_last_digit_and_is_there_in_one_piece(
    tmp_path: Path,
) -> None:
    vary: dict[str, Any] = {**GRID, "shock.peak_force": [100.0, 1e9]}
    found = {
        kind: hc.sweep(
            SHORT,
            vary,
            backends=["native", "formulas"],
            peaks=True,
            output=tmp_path / kind,
            file_format=kind,
        )
        for kind in ("parquet", "csv")
    }
    for table in ("to_frame", "peaks_to_frame"):
        parquet, csv = (getattr(found[kind], table)() for kind in ("parquet", "csv"))
        pd.testing.assert_frame_equal(csv, parquet, check_exact=True, check_dtype=False)
    whole = pd.read_csv(tmp_path / "csv" / "scenes.csv")
    assert len(whole) == 32
    expected = found["parquet"].to_frame()["largest_peak_force_N"].to_numpy()
    # To the last digit from pandas 3 on, to one before it in pandas 2.
    np.testing.assert_allclose(whole["largest_peak_force_N"], expected, rtol=1e-15)


def test_a_sweep_that_is_there_is_not_measured_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    first = hc.sweep(SHORT, GRID, output=out).to_frame()
    written = {path: path.stat().st_mtime_ns for path in out.rglob("*.parquet")}
    told: list[tuple[int, int]] = []
    again = hc.sweep(SHORT, GRID, output=out, progress=lambda *how_far: told.append(how_far))
    assert told == [(8, 8)]
    pd.testing.assert_frame_equal(again.to_frame(), first, check_exact=True)
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.parquet")} == written


def test_with_another_time_limit_a_sweep_goes_on(tmp_path: Path) -> None:
    """Whoever stopped it because it took too long may give it more time; no number changes."""
    out = tmp_path / "out"
    first, again = (
        hc.sweep(SHORT, GRID, backends=[hc.Native(rtol=1e-6, time_limit=limit)], output=out)
        for limit in (5.0, 50.0)
    )
    pd.testing.assert_frame_equal(again.to_frame(), first.to_frame(), check_exact=True)


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (hc.Lammps(), hc.Lammps(isolated=True), True),
        (hc.Lammps(), hc.Lammps(time_limit=7.0), True),
        (hc.Native(), hc.Native(peaks_only=True), True),
        (hc.Lammps(), hc.Lammps(extrapolated=True), False),
        (hc.Native(), hc.Native("rk4"), False),
    ],
)
def test_what_changes_no_number_does_not_make_another_sweep(
    one: hc.Native | hc.Lammps, other: hc.Native | hc.Lammps, same: bool
) -> None:
    first, second = map(parts_of_sweeps.settings, (one, other))
    assert (first == second) is same


@pytest.mark.parametrize("is_kept", [True, False])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("foo", ", which has scene, backend, "),
        ("radius", "; did you mean chain.radius? It has scene, backend, "),
        ("largest_peak_force", "; did you mean largest_peak_force_N? It has scene, backend, "),
    ],
)
def test_an_unknown_column_is_refused_with_what_there_is(
    tmp_path: Path, name: str, words: str, is_kept: bool
) -> None:
    swept = hc.sweep(SHORT, GRID, output=tmp_path / "out" if is_kept else None)
    with pytest.raises(SceneError) as refused:
        swept.to_frame(["scene", name])
    assert str(refused.value).startswith(f"{name}: is no column of this sweep{words}")
    assert all(str(column) in str(refused.value) for column in swept.to_frame())


OTHERS: dict[str, tuple[dict[str, Any], str]] = {
    "another scene": (
        {"scene": replace(SHORT, run=hc.Run(1.0))},
        "run.end_time is not given there and 1.0 here",
    ),
    "other values": (
        {"vary": {**GRID, "shock.momentum_ratio": "0.5:2:5:log"}},
        "count of shock.momentum_ratio is 4 there and 5 here",
    ),
    "another order": (
        {"vary": dict(reversed(GRID.items()))},
        f"vary is {', '.join(GRID)} there and {', '.join(reversed(GRID))} here",
    ),
    "another accuracy": ({"rtol": 1e-5}, "rtol of native is 1e-06 there and 1e-05 here"),
    "other steps": (
        {"backends": [hc.Native("rk4")]},
        ", ".join(
            [
                'method of native is not given there and "rk4" here',
                "rtol of native is 1e-06 there and not given here",
            ]
        ),
    ),
    "another backend": ({"backends": ["formulas"]}, "backends is native there and formulas here"),
    "one backend more": (
        {"backends": ["native", "formulas"]},
        "backends is native there and native, formulas here",
    ),
    "with peaks": ({"peaks": True}, "peaks is false there and true here"),
    "another format": ({"file_format": "csv"}, 'format is "parquet" there and "csv" here'),
}


@pytest.mark.parametrize("what", OTHERS)
def test_a_folder_of_another_sweep_is_left_as_it_is(tmp_path: Path, what: str) -> None:
    others, difference = OTHERS[what]
    out = tmp_path / "out"
    hc.sweep(SHORT, GRID, output=out)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    asked = {"scene": SHORT, "vary": GRID, **others}
    with pytest.raises(OutputError) as refused:
        hc.sweep(**asked, output=out)
    assert str(refused.value) == (
        f"{out}: belongs to another sweep, {difference}; name another folder"
    )
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_another_seed_or_version_is_another_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {"vary": {"shock.momentum_ratio": "1:2"}, "samples": 4}
    hc.sweep(SHORT, **asked, output=tmp_path)
    others: list[tuple[dict[str, Any], str]] = [
        ({"seed": 1}, "samples.seed is 0 there and 1 here"),
        ({"samples": 5}, "samples.count is 4 there and 5 here"),
    ]
    for other, words in others:
        with pytest.raises(OutputError, match=words):
            hc.sweep(SHORT, **{**asked, **other}, output=tmp_path)
    monkeypatch.setattr("hertzchain.sweeps.sweeping.version", lambda _: "999")
    with pytest.raises(OutputError, match=r'hertzchain is "0\.1\.0" there and "999" here'):
        hc.sweep(SHORT, **asked, output=tmp_path)


def test_a_part_is_there_whole_or_not_at_all_and_its_peaks_before_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    whole = pd.DataFrame.to_parquet
    written: list[str] = []

    def dies(frame: pd.DataFrame, path: Path, **options: Any) -> None:
        whole(frame, path, **options)
        written.append("contact" if "contact" in frame else "scene")
        if len(written) == 2:
            path.write_bytes(path.read_bytes()[:100])
            raise KeyboardInterrupt

    monkeypatch.setattr(pd.DataFrame, "to_parquet", dies)
    out.mkdir()  # or it would be gone with the rest: nothing is done
    with pytest.raises(KeyboardInterrupt):
        hc.sweep(SHORT, GRID, peaks=True, output=out)
    assert written == ["contact", "scene"]
    assert [path.name for path in out.rglob("*.parquet")] == ["native-0000.parquet"]
    assert (out / "peaks" / "native-0000.parquet").exists()
    again = hc.sweep(SHORT, GRID, peaks=True, output=out)
    there = hc.sweep(SHORT, GRID, peaks=True).to_frame()
    pd.testing.assert_frame_equal(again.to_frame(), there, check_exact=True)


@pytest.mark.parametrize("was_there", [False, True])
def test_a_folder_made_for_nothing_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, was_there: bool
) -> None:
    out = tmp_path / "out"
    if was_there:
        out.mkdir()

    def dies(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pd.DataFrame, "to_parquet", dies)
    with pytest.raises(KeyboardInterrupt):
        hc.sweep(SHORT, GRID, backends=["formulas"], output=out)
    assert out.exists() is was_there


def test_a_damaged_part_is_named(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for kind in ("parquet", "csv"):
        hc.sweep(SHORT, GRID, output=out, file_format=kind)
        part = out / "scenes" / f"native-0000.{kind}"
        part.write_bytes(b"nothing")
        with pytest.raises(OutputError, match="delete it, and the same sweep measures") as problem:
            hc.Sweep.load(out).to_frame()
        assert str(part) in str(problem.value)
        part.unlink()
        assert hc.sweep(SHORT, GRID, output=out, file_format=kind).count().done == 8
        shutil.rmtree(out)


def test_in_memory_a_sweep_needs_no_pyarrow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hertzchain.sweeps.store.importlib.util.find_spec", lambda _: None)
    assert hc.sweep(SHORT, GRID).count().done == 8


def test_a_format_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="file_format = 'feather': must be parquet or csv"):
        hc.sweep(SHORT, GRID, output=tmp_path / "out", file_format="feather")  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_a_sweep_inside_of_another_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    hc.sweep(SHORT, GRID, output=out)
    for inside in (out / "x", out / "scenes" / "x"):
        with pytest.raises(OutputError, match="is inside of the sweep"):
            hc.sweep(SHORT, GRID, output=inside)
        assert not inside.exists()
    assert len(pd.read_parquet(out / "scenes")) == 8


def test_a_folder_with_other_things_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match=r"is no sweep, thesis\.tex is in it"):
        hc.sweep(SHORT, GRID, output=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    for where, words in (
        (tmp_path / "thesis.tex", "is a file, must be a folder"),
        (tmp_path / "no" / "out", "does not exist, create it first"),
    ):
        with pytest.raises(OutputError, match=words):
            hc.sweep(SHORT, GRID, output=where)
    for where in (tmp_path, tmp_path / "nothing", tmp_path / "thesis.tex"):
        with pytest.raises(OutputError, match="is no sweep"):
            hc.Sweep.load(where)
    (tmp_path / "sweep.json").write_text('{"format": "parq')
    with pytest.raises(OutputError, match="cannot be read"):
        hc.sweep(SHORT, GRID, output=tmp_path)
    for nothing in ("[]", '{"format": "csv"}'):
        (tmp_path / "sweep.json").write_text(nothing)
        with pytest.raises(OutputError, match="describes no sweep"):
            hc.sweep(SHORT, GRID, output=tmp_path)


def test_two_processes_do_not_work_on_one_sweep(tmp_path: Path) -> None:
    out = tmp_path / "out"
    hc.sweep(SHORT, GRID, output=out)
    manifest = json.loads((out / "sweep.json").read_text())
    with Folder(out, manifest), pytest.raises(OutputError, match="another process is at work"):
        hc.sweep(SHORT, GRID, output=out)
    assert hc.sweep(SHORT, GRID, output=out).count().done == 8


def test_what_was_half_written_is_cleared_away_and_no_part_is_read_by_halves(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    first = hc.sweep(SHORT, GRID, output=out, peaks=True).to_frame()
    assert not list(out.rglob(".hertzchain-*"))
    killed = [out / name / ".hertzchain-killed" for name in ("", "scenes", "peaks")]
    for left in killed:
        left.mkdir()
        (left / "native-0000.parquet").write_bytes(b"PAR1 and no more")
    (out / "scenes" / "native-0000.parquet").unlink()  # its peaks are there: killed in between
    again = hc.sweep(SHORT, GRID, output=out, peaks=True)
    pd.testing.assert_frame_equal(again.to_frame(), first, check_exact=True)
    assert not list(out.rglob(".hertzchain-*"))


def test_a_full_disk_is_one_error_and_what_is_done_stays(full_disk: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        hc.sweep(SHORT, GRID, output=full_disk / "out")


def test_nothing_is_found_where_nothing_was_asked_for() -> None:
    with pytest.raises(OutputError, match="has no such rows"):
        hc.sweep(SHORT, GRID).peaks_to_frame()


def test_no_part_is_kept_in_memory_that_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hertzchain.sweeps.parts.MOST_ROWS", 20)
    kept: list[weakref.ref[Measured]] = []
    alive = []
    keep = Folder.keep

    def watch(self: Folder, part: Part, measured: Measured) -> None:
        keep(self, part, measured)
        kept.append(weakref.ref(measured))
        alive.append(sum(one() is not None for one in kept))

    monkeypatch.setattr(Folder, "keep", watch)
    vary: dict[str, Any] = {"shock.momentum_ratio": "0.5:2", "shock.duration_ratio": "1.5:4"}
    backends = ["native", "formulas"]
    hc.sweep(SHORT, vary, samples=400, backends=backends, peaks=True, output=tmp_path / "out")
    assert len(alive) == 40
    assert max(alive) <= 1 + usable_cores()  # one that is measured on each core


@pytest.mark.parametrize(
    ("backend", "scenes", "short"),
    [
        (Formulas(), 1300, True),  # 3e-4 s each
        (Formulas(), 1400, False),
        (hc.Native(rtol=1e-4), 100, True),
        (hc.Native("velocity-verlet"), 110, True),
        (hc.Native("velocity-verlet"), 130, False),
        (hc.Native("reference"), 500, True),
        (hc.Native("reference"), 700, False),
        (hc.Native(dt=1e-7), 2, False),
        (hc.Lammps(rtol=1e-2), 2, False),
    ],
)
def test_few_scenes_start_no_process(backend: Any, scenes: int, short: bool) -> None:
    found = design(SHORT, {"shock.momentum_ratio": f"0.5:2:{scenes}"})
    assert is_short(found, backend) == short


def test_where_scenes_are_measured_changes_no_value(monkeypatch: pytest.MonkeyPatch) -> None:
    vary = {"run.end_time": "5e-5:2e-4:12"}  # not for the batch
    found = []
    for start in (0.0, math.inf):
        monkeypatch.setattr(parts_of_sweeps, "_START", start)
        swept = hc.sweep(SHORT, vary, backends=["native", "formulas"], peaks=True)
        found.append((swept.to_frame(), swept.peaks_to_frame()))
    for one, other in zip(*found, strict=True):
        pd.testing.assert_frame_equal(one, other, check_exact=True)


@pytest.mark.slow
def test_a_hundred_thousand_scenes_take_less_than_500_mb(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    paper_scene("cosine", 1.0, 2.0).to_toml(tmp_path / "scene.toml")
    vary = ("--vary", "shock.momentum_ratio=0.1:10:log", "--vary", "shock.duration_ratio=1.5:6")
    command = ("sweep", tmp_path / "scene.toml", *vary, "--samples", "100000", "--rtol", "1e-4")
    # Kernels are compiled before: a process that compiles takes 620 MB.
    few = ("--samples", "100", "--rtol", "1e-4", "-o", tmp_path / "few")
    small = process("sweep", tmp_path / "scene.toml", *vary, *few)
    assert small.status == 0, small.err
    said = (
        "import atexit, resource;"
        "atexit.register(lambda: print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss));"
    )
    done = process(*command, "-o", tmp_path / "out", code=said + MAIN)
    assert done.status == 0, done.err
    assert int(done.out.split()[-1]) < 500_000  # [kB]
