"""Other programs: found, run, timed out, killed; and the dumps that they leave."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from hertzchain.engines.external import program as programs
from hertzchain.engines.external.observation import read_frames
from hertzchain.engines.external.program import find_program, run_program
from hertzchain.errors import BackendMissing, RunFailed, TooExpensive
from hertzchain.limits import Deadline
from tests.processes import linux, posix, runs, wait_for


def python(code: str, folder: Path) -> str:
    return run_program([sys.executable, "-c", code], folder, Deadline(60.0), "the code")


class OnceThere(Deadline):
    """Is over as soon as a program has written a file, however long it takes to start."""

    def __init__(self, file: Path) -> None:
        super().__init__(60.0)
        self._file = file

    @property
    def left(self) -> float:
        """None as soon as the file is there [s]."""
        return 0.0 if self._file.exists() else super().left


def stopped(code: str, folder: Path) -> None:
    """Run a program that is stopped at the time limit: when it has written the file ``ready``."""
    ready = "\nopen('ready', 'w').close()\n"
    command = [sys.executable, "-c", code.replace("\nREADY\n", ready)]
    with pytest.raises(TooExpensive, match="stopped at the time limit of 60 s"):
        run_program(command, folder, OnceThere(folder / "ready"), "the code")


def test_what_it_says_is_returned(tmp_path: Path) -> None:
    code = "import os, sys; print(os.getcwd(), flush=True); print('two', file=sys.stderr)"
    assert python(code, tmp_path).splitlines() == [str(tmp_path.resolve()), "two"]


@linux
def test_at_the_deadline_all_that_it_started_is_gone(tmp_path: Path) -> None:
    code = (
        "import subprocess\n"
        "child = subprocess.Popen(['sleep', '1000'])\n"
        "with open('pid', 'w') as file:\n"
        "    file.write(str(child.pid))"
        "\nREADY\n"
        "child.wait()"
    )
    stopped(code, tmp_path)
    pid = int((tmp_path / "pid").read_text())
    wait_for(lambda: not runs(pid))


@posix
@pytest.mark.parametrize("ends", [True, False])
def test_a_program_is_asked_to_end_before_it_is_killed(
    tmp_path: Path, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(programs, "_GRACE", 0.5 if not ends else 60.0)
    # mpiexec then ends the ranks, which it may have put into groups of their own.
    code = (
        "import signal, sys, time\n"
        "def asked(*_):\n"
        "    open('asked', 'w').close()\n"
        f"    {'sys.exit()' if ends else 'pass'}\n"
        "signal.signal(signal.SIGTERM, asked)"
        "\nREADY\n"
        "end = time.monotonic() + 50\n"
        "while time.monotonic() < end:\n"
        "    time.sleep(0.1)\n"
        "open('survived', 'w').close()"
    )
    stopped(code, tmp_path)
    assert (tmp_path / "asked").exists()
    assert not (tmp_path / "survived").exists()


def test_programs_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(BackendMissing, match=r"^no-such-program is missing.*: install it$"):
        find_program("no-such-program", "install it")
    assert Path(find_program(sys.executable, "install it")).is_absolute()
    with pytest.raises(BackendMissing, match="the code cannot be started"):
        run_program([str(tmp_path / "nothing")], tmp_path, Deadline(1), "the code")


FRAME = """ITEM: TIMESTEP
{step}
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS ss ff ff
0 1
0 1
0 1
ITEM: ATOMS x id vx
0.25 2 -1e-300
{x:.17g} 1 2
0.75 3 3
"""


def test_frames_in_the_order_of_the_ids(tmp_path: Path) -> None:
    path = tmp_path / "a.dump"
    path.write_text(FRAME.format(step=0, x=0.1) + FRAME.format(step=20, x=1 / 3))
    steps, values = read_frames(path, ("vx", "x"))
    assert steps.tolist() == [0, 20]
    assert values[1].tolist() == [[2, -1e-300, 3], [1 / 3, 0.25, 0.75]]
    assert values.shape == (2, 2, 3)
    assert np.array_equal(values[0, 1], [0.1, 0.25, 0.75])


@pytest.mark.parametrize("lost", ["0.75 3 3\n", "id vx\n0.25", "ITEM"])
def test_a_damaged_dump_is_one_sentence(tmp_path: Path, lost: str) -> None:
    path = tmp_path / "a.dump"
    path.write_text(FRAME.format(step=0, x=0.1).partition(lost)[0])
    with pytest.raises(RunFailed, match=r"^a\.dump: "):
        read_frames(path, ("x",))


def test_a_dump_that_is_not_there_or_has_other_columns(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="no dump"):
        read_frames(tmp_path / "b.dump", ("x",))
    path = tmp_path / "a.dump"
    path.write_text(FRAME.format(step=0, x=0.1))
    with pytest.raises(RunFailed, match="other columns"):
        read_frames(path, ("fx",))
