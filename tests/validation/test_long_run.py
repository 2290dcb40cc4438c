"""One wave down 90,000 granules: the quick form, and that what drifts would be seen."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hertzchain.engines.native import METHODS
from hertzchain.theory.solitary_wave import solitary_wave
from validation import long_run

KEPT = Path(long_run.__file__).parent / "results" / "long_run.csv"


@pytest.fixture
def kept() -> pd.DataFrame:
    """Return the measured table kept in the repository."""
    return pd.read_csv(KEPT, comment="#")


@pytest.mark.slow
@pytest.mark.lammps
def test_the_quick_form_passes_and_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    csv, figure = tmp_path / "long_run.csv", tmp_path / "long_run.png"
    assert long_run.SCRIPT.run(["--quick", "-o", str(csv), "--plot", str(figure)]) == 0
    assert "35 of 35 rows pass" in capsys.readouterr().out
    assert all(entry.passed for entry in long_run.promises(pd.read_csv(csv, comment="#")))
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_what_is_kept_is_whole_and_keeps_its_promises(kept: pd.DataFrame) -> None:
    everyone = long_run.contenders(quick=False)
    for contender in everyone:
        own = kept[kept["contender"] == contender.name]
        assert own["granule"].tolist() == list(contender.marks)
    assert {one.method for one in everyone} == {*METHODS, "LAMMPS"}
    rows = long_run.promises(kept)
    assert len(rows) == 35
    assert [entry for entry in rows if not entry.passed] == []
    assert KEPT.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("contender", "quantity", "factor", "broken"),
    [
        ("srkn-6b", "energy", 1 + 1e-10, "srkn-6b: energy"),
        ("velocity-verlet", "amplitude", 1 - 1e-9, "velocity-verlet: amplitude"),
        ("rk4", "relation", 2.0, "rk4: speed of its height"),
        ("dprkn-6, twice the step", "loss", 0.5, "dprkn-6: loss a granule, step doubled"),
        ("LAMMPS", "speed", 1 + 1e-5, "LAMMPS: speed over native's"),
    ],
)
def test_a_drift_fails(
    contender: str, quantity: str, factor: float, broken: str, kept: pd.DataFrame
) -> None:
    row = kept.index[kept["contender"] == contender][-1]
    kept.loc[row, quantity] *= factor
    failed = [entry.what for entry in long_run.promises(kept) if not entry.passed]
    assert failed == [broken]


def test_momentum_that_is_not_kept_fails(kept: pd.DataFrame) -> None:
    kept["momentum"] = 1e-11
    failed = [entry.what for entry in long_run.promises(kept) if not entry.passed]
    assert failed == [f"{one.name}: momentum" for one in long_run.contenders(quick=False)]


def test_without_lammps_the_native_waves_are_judged(kept: pd.DataFrame) -> None:
    rows = long_run.promises(kept[kept["contender"] != "LAMMPS"])
    assert {entry.backend for entry in rows} == {"native"}
    assert len(rows) == 32


def test_a_wave_that_is_known_is_found() -> None:
    # A wave of height 2 that loses 1e-6 at each contact and goes at its own speed.
    contender = long_run.Contender("known", "rk4", 0.1, (1_000, 2_000))
    force = 2 * np.exp(-1e-6 * np.arange(2_098))
    speed = solitary_wave().speed * force ** (1 / 6)
    table = long_run.wave_at(contender, force, np.cumsum(1 / speed))
    assert table["loss"].to_numpy() == pytest.approx([1e-6, 1e-6], rel=1e-6, abs=0)
    # Speeds are means over contacts here and over time there: (1e-6 1000 / 6)^2 / 12 apart.
    assert table["relation"].abs().max() < 1e-6
    assert table["amplitude"].to_numpy() == pytest.approx([force[98], force[1_098]], rel=1e-15)


def test_what_is_lost_goes_on(kept: pd.DataFrame) -> None:
    own = kept[kept["contender"] == "rk4"]
    expected = long_run.drift(kept, "rk4", "amplitude")
    found = long_run.lost_by(kept, "rk4", own["granule"].to_numpy(np.float64))
    # Of 0.3 %; the loss is that of the mean over the first 1,000 granules.
    assert found == pytest.approx(expected, rel=2e-3, abs=1e-15)
    assert math.isclose(long_run.lost_by(kept, "rk4", np.array([90_000.0]))[0], -0.08, rel_tol=0.05)
