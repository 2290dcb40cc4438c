"""The files of hertzchain run: motion and plots, and what is refused."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hertzchain.cli.output import say
from hertzchain.report.facts import describe
from hertzchain.scene.scene import Scene
from tests.cli.short_chain import embedded
from tests.command_line import Command
from tests.places import ROOT
from tests.processes import names

SCENES = ROOT / "validation" / "scenes"

SCENE = SCENES / "weak_shock.toml"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test has a folder of its own."""
    monkeypatch.chdir(tmp_path)


def test_all_files_of_one_run(hertzchain: Command) -> None:
    files = ("-o", "motion.csv", "--plot", "run.svg", "--report", "run.html")
    done = hertzchain("run", SCENE, "--json", "--record", "20", *files)
    assert done.status == 0, done
    for what, name in (("Motion", "motion.csv"), ("Plot", "run.svg"), ("Report", "run.html")):
        assert f"{what} written to {name}\n" in done.err
    assert names() == ["motion.csv", "run.html", "run.svg"]
    frame = pd.read_csv("motion.csv")
    assert frame["granule"].unique().tolist() == list(range(1, 61))
    times = np.linspace(0, Scene.from_toml(SCENE).end_time, 20)
    assert frame["time_s"].unique().tolist() == times.tolist()
    page = Path("run.html").read_text("utf-8")
    assert f"<title>{describe(Scene.from_toml(SCENE))}</title>" in page  # there is no verdict
    assert page.count("<svg") == 2
    assert embedded(page)["peak_force_N"] == done.json()["peak_force_N"]
    assert len(page) < 500_000
    done = hertzchain("run", SCENE, "-o", "peaks.csv")
    assert ", are in peaks.csv)" in done.out
    assert done.err == "Peaks written to peaks.csv\n"


def test_lines_to_stderr_go_where_a_progress_bar_catches_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Rich puts something in the place of stderr, and prints what it gets above the bar."""
    monkeypatch.setattr("sys.stderr", caught := StringIO())
    say("compiled")
    assert caught.getvalue() == "hertzchain: compiled\n"
