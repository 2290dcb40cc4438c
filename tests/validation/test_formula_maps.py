"""Maps of the formulas' errors: their numbers are those of the tables, and they can fail."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.scene.pulse import profile_named
from tests import scenes
from validation import formula_maps, peak_forces, table2
from validation.formula_maps import EQUATIONS, GRANULES, LARGEST, RULES, SHARES, SIDES, errors
from validation.rows import Row


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """The quick form without LAMMPS, which test_validation runs, and with it doctored."""
    found = formula_maps.measure(True, False)
    alone = found[found["backend"] == "native alone"]
    return pd.concat([found, alone.assign(backend="lammps")], ignore_index=True)


def failed(table: pd.DataFrame) -> list[Row]:
    return [entry for entry in formula_maps.promises(table) if not entry.passed]


def test_what_was_found_passes(table: pd.DataFrame) -> None:
    assert [entry.what for entry in failed(table)] == []
    rows = formula_maps.promises(table)
    assert sum("as in its table" in entry.what for entry in rows) == 24
    assert sum("share within" in entry.what for entry in rows) == 18
    assert len(formula_maps.draw(table).axes) == 10


def test_a_table_read_from_its_file_is_judged_alike(table: pd.DataFrame, tmp_path: object) -> None:
    path = f"{tmp_path}/maps.csv"
    table.to_csv(path, index=False)
    assert formula_maps.promises(pd.read_csv(path, comment="#")) == formula_maps.promises(table)


@pytest.mark.parametrize("name", EQUATIONS)
@pytest.mark.parametrize("side", SIDES)
def test_a_map_that_is_off_fails(table: pd.DataFrame, name: str, side: str) -> None:
    """A formula half as good: other shares, and another largest error."""
    wrong = table.copy()
    of_side = wrong["momentum_ratio"] < 1 if side == "below" else wrong["momentum_ratio"] > 1
    of_side &= (wrong["part"] == "map") & (wrong["profile"] == "triangular")
    wrong.loc[of_side, f"{name}_error"] *= 2
    what = f"triangular, {SIDES[side]}, {EQUATIONS[name]}"
    names = {entry.what for entry in failed(wrong)}
    assert {entry for entry in names if not entry.startswith("rule")} == {
        f"{what}: share within 5 % [%]",
        f"{what}: largest error [%]",
    }


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_a_rule_that_does_not_hold_fails(table: pd.DataFrame, rule: formula_maps.Rule) -> None:
    wrong = table.copy()
    inside = wrong["momentum_ratio"].between(*rule.ratios) & (wrong["part"] == "map")
    inside &= wrong["duration_ratio"].between(*rule.durations)
    wrong.loc[wrong.index[inside][-1], f"{rule.equations[-1]}_error"] = 5.1
    assert f"rule: {rule.name}: largest" in {entry.what for entry in failed(wrong)}


@pytest.mark.parametrize(
    ("part", "column", "off", "row"),
    [
        ("longer", "p", 1.0, "points with another p"),
        ("longer", "eq6_error", 0.01, "error of Eq. 6 [%], off"),
        ("paper", "eq3_error", 0.01, "error of Eq. 3 [%], as in its table"),
        ("paper", "eq6_error", 0.01, "error of Eq. 6 [%], as in its table"),
        ("sample", "p", 1.0, ": p"),
        ("sample", "peak_difference", 1e-4, ": peaks, off"),
        ("sample", "eq9_error", 0.02, ": error of Eq. 9 [%]"),
    ],
)
def test_a_number_that_is_off_fails_its_row(
    table: pd.DataFrame, part: str, column: str, off: float, row: str
) -> None:
    wrong = table.copy()
    place = wrong["part"] == part
    if part == "sample":
        place &= wrong["backend"] == "lammps"
    if part == "paper":
        place &= wrong[f"expected_{column.removesuffix('_error')}"].notna()
    wrong.loc[wrong.index[place][-1], column] += off
    (entry,) = failed(wrong)
    assert entry.what.endswith(row)
    assert entry.backend == ("lammps" if part == "sample" else "native")


def test_a_point_without_p_is_counted_and_shown(table: pd.DataFrame) -> None:
    wrong = table.copy()
    point = wrong.index[wrong["part"] == "map"][100]
    columns = ["p", "least_p", "eq3", *(f"{name}_error" for name in EQUATIONS)]
    wrong.loc[point, columns] = math.nan
    assert "cosine: points without p" in {entry.what for entry in failed(wrong)}
    assert len(formula_maps.draw(wrong).axes) == 10


def test_a_point_that_lammps_cannot_run_is_a_row(table: pd.DataFrame) -> None:
    wrong = table.copy()
    last = wrong.index[wrong["backend"] == "lammps"][-1]
    wrong.loc[last, "problem"] = "LAMMPS crashed (SIGSEGV)"
    (entry,) = failed(wrong)
    assert entry.what.endswith(": LAMMPS crashed (SIGSEGV)")


def test_peaks_that_are_off_are_seen_in_the_tables() -> None:
    """2 % on one contact of a transition, as a simulation could have it."""
    point = formula_maps.paper_errors()["triangular_LM1.6_n6"]
    profile = profile_named(point[0].profile)
    found = hc.similar_peak_forces(profile, point[0].ratio, point[0].n, GRANULES, 1e-5)
    peaks = found.peak_force[0]
    right = errors(point[0].profile, point[0].ratio, point[0].n, peaks)
    assert right["eq6_error"] == pytest.approx(point[2], abs=0.002)
    peaks[4] *= 1.02
    wrong = errors(point[0].profile, point[0].ratio, point[0].n, peaks)
    assert abs(wrong["eq6_error"] - point[2]) > 10 * formula_maps._ROUNDING


def test_errors_of_a_scene_of_table_4_and_of_table_2() -> None:
    entries = peak_forces.measure(4, True, False)
    name = str(entries["scene"].iloc[0])
    point, _, largest = formula_maps.paper_errors()[name]
    assert largest == entries.loc[entries["scene"] == name, "error_percent"].max()
    result = hc.Native("reference").run(scenes.load(name))
    found = errors(point.profile, point.ratio, point.n, result.peak_force / 100.0)
    # The same formulas on the same peaks; only units differ.
    assert found["eq6_error"] == pytest.approx(largest, rel=1e-10, abs=0)
    assert found["p"] == result.transition_granules
    of_table_2 = table2.measure(True, False).iloc[0]
    point, error, _ = formula_maps.paper_errors()[of_table_2["scene"]]
    profile = profile_named(point.profile)
    peaks = hc.similar_peak_forces(profile, point.ratio, point.n, 60, 1e-8).peak_force[0]
    found = errors(point.profile, point.ratio, point.n, peaks)
    assert found["eq3"] == pytest.approx(of_table_2["eq3"], rel=1e-8, abs=0)
    assert found["eq3_error"] == pytest.approx(error, abs=1e-6)


def test_a_scene_of_the_paper_that_is_missing_fails(table: pd.DataFrame) -> None:
    wrong = table[table["scene"] != "cosine_LM2.5_n8"]
    assert "the paper's 24 scenes: 23 are there" in {entry.what for entry in failed(wrong)}


def test_no_p_no_errors() -> None:
    growing = 1.02 ** np.arange(20)
    found = errors("cosine", 1.0, 2.0, np.asarray(growing, np.float64))
    assert all(math.isnan(value) for value in found.values())


def test_a_share_is_that_of_the_area() -> None:
    holds = np.zeros((5, 5), np.bool_)
    assert formula_maps.share(holds) == 0
    holds[:, :3] = True
    assert formula_maps.share(holds) == 2.5 / 4
    assert formula_maps.share(~holds) == 1.5 / 4
    assert set(SHARES) == set(LARGEST)
    assert len(SHARES) == 6
