"""The script of the page on clusters, on commands that stand for Slurm's."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from pandas.testing import assert_frame_equal

import hertzchain as hc
from tests.command_line import python
from tests.places import ROOT
from tests.sweeps.test_sweeps_cluster import SCENE

SBATCH = """#!{python}
import subprocess, sys
job = subprocess.Popen(
    ["bash", sys.argv[-1]],
    stdin=subprocess.DEVNULL,
    stdout=open({log!r}, "ab"),
    stderr=subprocess.STDOUT,
    start_new_session=True,
)
open({jobs!r}, "a").write(str(job.pid) + "\\n")
print("Submitted batch job", job.pid)
"""
SCANCEL = """#!{python}
import os, signal, sys
os.killpg(int(sys.argv[-1]), signal.SIGTERM)
"""


@pytest.fixture
def slurm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Commands that stand for those of Slurm; what has been submitted is in this file."""
    jobs, commands = tmp_path / "jobs", tmp_path / "commands"
    commands.mkdir()
    log = str(tmp_path / "jobs.log")
    for name, code in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        text = code.format(python=sys.executable, jobs=str(jobs), log=log)
        (commands / name).write_text(text, encoding="utf-8")
        (commands / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(commands), prepend=os.pathsep)
    options = "{'host': '127.0.0.1', 'dashboard_address': '127.0.0.1:0'}"
    monkeypatch.setenv("DASK_JOBQUEUE__SLURM__SCHEDULER_OPTIONS", options)
    monkeypatch.setenv("DASK_JOBQUEUE__SLURM__LOCAL_DIRECTORY", str(tmp_path))
    try:
        yield jobs
    finally:
        for pid in jobs.read_text(encoding="utf-8").split() if jobs.exists() else ():
            with suppress(ProcessLookupError):
                os.killpg(int(pid), signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.lammps
def test_the_script_of_the_page_runs_on_what_stands_for_slurm(tmp_path: Path, slurm: Path) -> None:
    page = (ROOT / "docs" / "clusters.md").read_text(encoding="utf-8")
    script = page.partition("```python\n# sweep_on_slurm.py\n")[2].partition("```")[0]
    SCENE.to_toml(tmp_path / "chain.toml")
    for shown, smaller in {
        "validation/scenes/demo.toml": "chain.toml",
        "0.1:10:300:log": "0.5:4:6:log",
        "1.1:4:30": "1.5:2:2",
        "cores=32, processes=32": "cores=2, processes=2",
        "64 GB": "2 GB",
        "maximum_jobs=10": "maximum_jobs=1",
    }.items():
        assert shown in script
        script = script.replace(shown, smaller)
    (tmp_path / "sweep_on_slurm.py").write_text(script, encoding="utf-8")
    done = python("sweep_on_slurm.py", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Counts(done=24, failed=0, missed=0")
    assert slurm.read_text(encoding="utf-8").count("\n") >= 1
    alone = hc.sweep(
        SCENE,
        {"shock.momentum_ratio": "0.5:4:6:log", "shock.duration_ratio": "1.5:2:2"},
        backends=["native", "lammps"],
    )
    found = hc.Sweep.load(tmp_path / "out").to_frame()
    assert_frame_equal(found, alone.to_frame(), check_exact=True)
