"""The files of hertzchain run: motion and plots, and what is refused."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hertzchain.cli.options import to_contacts
from hertzchain.cli.output import say
from hertzchain.errors import HertzchainError
from hertzchain.report import panels
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
    outcome = hertzchain(
        "run", SCENE, "--record", "20", "-o", "motion.csv", "--contacts", "10:20:5",
        "--plot", "run.svg", "--trajectory", "motion.xyz", "--report", "run.html",
    )  # fmt: skip
    assert outcome.status == 0, outcome
    for what, name in (("Motion", "motion.csv"), ("Plot", "run.svg")):
        assert f"{what} written to {name}\n" in outcome.err
    assert names() == ["motion.csv", "motion.xyz", "run.html", "run.svg"]
    frame = pd.read_csv("motion.csv")
    assert frame["granule"].unique().tolist() == [10, 15, 20]
    times = np.linspace(0, Scene.from_toml(SCENE).end_time, 20)
    assert frame["time_s"].unique().tolist() == times.tolist()
    assert Path("motion.xyz").read_text().count("time_s=") == 20
    # 20 times are too few for a picture.
    assert "recorded times are" in outcome.err
    outcome = hertzchain("run", SCENE, "-o", "peaks.csv")
    assert ", are in peaks.csv)" in outcome.out
    assert outcome.err == "Peaks written to peaks.csv\n"


def test_a_window_of_the_run(hertzchain: Command) -> None:
    outcome = hertzchain(
        "run", SCENE, "--record", "11", "--window", "20 us:0.03 ms", "--contacts", "5",
        "-o", "motion.csv",
    )  # fmt: skip
    assert outcome.status == 0, outcome
    frame = pd.read_csv("motion.csv")
    assert frame["time_s"].to_numpy() == pytest.approx(np.linspace(2e-5, 3e-5, 11), rel=1e-14)


def test_contacts_are_those_of_the_plot(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[object] = []
    monkeypatch.setitem(panels.DRAW, "forces", lambda *given: drawn.append(given[2]))
    assert hertzchain("run", SCENE, "--plot", "run.png", "--contacts", "5,9").status == 0
    assert drawn == [[5, 9]]


def test_a_picture_without_room_for_all_panels_says_so(hertzchain: Command) -> None:
    small = ("run", SCENE, "--plot", "run.png", "--size", "3.4x2.6")
    assert "run.png has no room for forces, map: take a higher --size" in hertzchain(*small).err
    assert "no room" not in hertzchain(*small, "--draw", "forces", "--contacts", "5,9").err


def test_a_page_of_a_run(hertzchain: Command) -> None:
    done = hertzchain("run", SCENE, "--json", "--report", "run.html")
    page = Path("run.html").read_text("utf-8")
    assert (done.status, done.err.splitlines()[-1]) == (0, "Report written to run.html")
    assert f"<title>{describe(Scene.from_toml(SCENE))}</title>" in page  # there is no verdict
    assert page.count("<svg") == 2
    assert embedded(page)["peak_force_N"] == done.json()["peak_force_N"]
    assert len(page) < 500_000


def test_lines_to_stderr_go_where_a_progress_bar_catches_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Rich puts something in the place of stderr, and prints what it gets above the bar."""
    monkeypatch.setattr("sys.stderr", caught := StringIO())
    say("compiled")
    assert caught.getvalue() == "hertzchain: compiled\n"


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("30", [30]),
        ("30, 10,20,10", [10, 20, 30]),
        ("10:30:5", [10, 15, 20, 25, 30]),
        ("2:4,59:60", [2, 3, 4, 59, 60]),
        ("10:14:3", [10, 13]),
    ],
)
def test_lists_of_contacts(given: str, found: list[int], demo: Scene) -> None:
    assert to_contacts(given, demo) == found


@pytest.mark.parametrize(
    "given", ["1", "99", "3,99", "5:4", "5:9:0", "5:9:1:1", "", "5,", "a", "-5", "2.5"]
)
def test_impossible_contacts_are_refused(given: str, demo: Scene) -> None:
    with pytest.raises(HertzchainError, match="--contacts") as refused:
        to_contacts(given, demo)
    assert ("a range counts up" in str(refused.value)) == (given in ("5:4", "5:9:0"))


def test_the_last_contact_of_a_chain_at_a_wall_is_that_of_the_wall() -> None:
    scene = Scene.from_toml(SCENES / "terms" / "striker_on_a_wall.toml")
    last = scene.chain.granules + 1
    assert to_contacts(f"{last}", scene) == [last]
    with pytest.raises(HertzchainError, match="with the wall"):
        to_contacts(f"{last + 1}", scene)
