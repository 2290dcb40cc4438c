"""Limits as scenes: the limits themselves, and both backends approach them as in theory."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from validation import limits, script
from validation.limits import LIMITS, THEMSELVES


def law(limit: limits.Limit) -> pd.DataFrame:
    """Return a table that follows theory exactly."""
    distances = [(value, 0.1 * value**limit.rate) for value in limit.sequence]
    if limit.name in THEMSELVES:
        distances.append((0.0, 1e-13))
    columns = ["limit", "parameter", "value", "native", "lammps"]
    return pd.DataFrame(
        [(limit.name, limit.parameter, value, off, off) for value, off in distances],
        columns=columns,
    )


@pytest.fixture
def table() -> pd.DataFrame:
    return pd.concat([law(limit) for limit in LIMITS], ignore_index=True)


def test_a_table_that_goes_as_theory_says_passes(table: pd.DataFrame) -> None:
    assert all(entry.passed for entry in limits.promises(table))


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.name)
@pytest.mark.parametrize("backend", ["native", "lammps"])
def test_another_rate_fails(limit: limits.Limit, backend: str, table: pd.DataFrame) -> None:
    own = (table["limit"] == limit.name) & (table["value"] > 0)
    table.loc[own, backend] *= table.loc[own, "value"] ** 0.2
    failed = {entry.what for entry in limits.promises(table) if not entry.passed}
    # With it one backend is no longer where the other is.
    assert failed == {
        f"{limit.name}: rate in {limit.parameter}",
        f"{limit.name}: distance / native's - 1",
    }


@pytest.mark.parametrize("backend", ["native", "lammps"])
def test_a_limit_missed_fails(backend: str, table: pd.DataFrame) -> None:
    table.loc[table["value"] == 0, backend] = 1e-7
    failed = [entry for entry in limits.promises(table) if not entry.passed]
    assert [entry.backend for entry in failed] == [backend] * len(THEMSELVES)


def test_without_lammps_the_rest_is_measured(
    monkeypatch: pytest.MonkeyPatch, table: pd.DataFrame, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = []

    def measure(quick: bool, with_lammps: bool) -> pd.DataFrame:
        asked.append((quick, with_lammps))
        return table.assign(lammps=math.nan)

    monkeypatch.setattr(script, "why_no_lammps", lambda: "LAMMPS is not available")
    measured = replace(limits.SCRIPT, measure=measure)
    assert measured.run(["--quick"]) == 2
    said = capsys.readouterr()
    assert asked == [(True, False)]
    assert said.err == "LAMMPS is not available; everything else is measured\n"
    assert "15 of 15 rows pass" in said.out
    with pytest.raises(hc.errors.BackendMissing, match="LAMMPS is not available"):
        measured.compare(quick=True)


def test_what_cannot_be_written_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert limits.SCRIPT.run(["--quick", "-o", str(tmp_path / "no" / "x.csv")]) == 2
    assert "does not exist" in capsys.readouterr().err


# The limits themselves


def test_the_far_field_of_an_impulse() -> None:
    # Ten digits stand in the script; the peaks still change by 1e-12 there.
    expected = limits.IMPULSE_COEFFICIENT
    assert limits.impulse_coefficient() == pytest.approx(expected, rel=1e-10, abs=0)
    # The same from the native solver: short pulses, and their error of LM^3 taken out.
    found = []
    for momentum_ratio in (0.02, 0.01):
        scene = limits.impulse_scene(momentum_ratio, granules=50)
        impulse = scene.impulse / scene.units.momentum
        peaks = hc.Native("reference").run(scene).peak_force / scene.units.force
        found.append(peaks[40] / impulse**1.2)
    extrapolated = (8 * found[1] - found[0]) / 7
    # 1e-3 of the error of the better one: the next term is smaller by a power of LM.
    assert extrapolated == pytest.approx(expected, rel=2e-10, abs=0)


def test_two_granules_by_quadrature_and_by_scipy() -> None:
    forces = [limits.two_granules(time) for time in np.linspace(0, 4.27, 300)]
    assert max(forces) == pytest.approx(1.25, rel=1e-4)
    assert forces[0] == 0
    # r'' = 1 - 2 r^(3/2), to h^2 from differences.
    h = 0.01
    for time in (0.7, 2.1, 3.3):
        overlaps = [limits.two_granules(time + k * h) ** (2 / 3) for k in (-1, 0, 1)]
        second = (overlaps[0] - 2 * overlaps[1] + overlaps[2]) / h**2
        assert second == pytest.approx(1 - 2 * overlaps[1] ** 1.5, abs=1e-4)
    assert limits.pushed(limits.CONSTANT, 2)[0] == pytest.approx(1.25, rel=1e-11, abs=0)


def test_ten_granules_pushed_slowly_are_pushed_as_one() -> None:
    # LM 1e4, cosine: 12.7 LM^(-9/8), the most that five granules showed, is 4e-4 of a force; of F0
    # half as much was seen here.
    scene = limits.slow_scene("cosine", 10, 1e-4)
    peaks = hc.Native("reference").run(scene).peak_force / scene.units.force
    assert np.max(np.abs(peaks - np.arange(9, 0, -1) / 10)) < 4e-4
