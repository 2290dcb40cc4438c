"""The registry: a further engine is its folder and one line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from hertzchain.cli import diagnosis
from hertzchain.engines.registry import ENGINES, Engine
from hertzchain.report import style
from tests.command_line import process
from tests.conftest import paper_scene

DUMMY = """
from dataclasses import dataclass, replace

import hertzchain as hc


@dataclass(frozen=True)
class Dummy:
    dt: float | None = None
    rtol: float = 1e-6
    extrapolated: bool = False
    time_limit: float = 600.0

    def run(self, scene, record=None):
        found = hc.Native("velocity-verlet", self.dt or 0.01 * scene.units.time).run(scene, record)
        return replace(found, backend="dummy")
"""
"""An engine: its folder."""

START = """
from hertzchain.engines.registry import ENGINES, Engine

ENGINES["dummy"] = Engine(
    "dummy", "Dummy", "dummy", "Dummy", "#56B4E9", "D", "dot", program="dummy-program"
)

from hertzchain.cli import main

main()
"""
"""The line of the registry, and the command line."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a scene and the engine."""
    monkeypatch.chdir(tmp_path)
    paper_scene("cosine", 1.0, 2.0, granules=12).to_toml("scene.toml")
    (tmp_path / "dummy.py").write_text(DUMMY)
    return tmp_path


def test_a_further_engine_is_a_folder_and_a_line(folder: Path) -> None:
    done = process(
        "compare", "scene.toml", "--backend", "dummy", "--json",
        "--plot", "plot.svg", "--report", "page.html", "--junit", "junit.xml", code=START,
    )  # fmt: skip
    assert done.status == 0, done.err
    found = json.loads(done.out)
    assert {check["name"] for check in found["checks"]} >= {
        "dummy: displacement, same steps",
        "dummy: peaks against the reference",
        "dummy: energy [J]",
    }
    assert all(row["dummy_N"] > 0 for row in found["rows"])
    for file, wanted in (("page.html", "Dummy, error estimate"), ("junit.xml", "dummy: energy")):
        assert wanted in (folder / file).read_text(encoding="utf-8")
    assert "Dummy" in (folder / "plot.svg").read_text(encoding="utf-8")


@pytest.mark.usefixtures("folder")
def test_doctor_and_run_know_it(monkeypatch: pytest.MonkeyPatch) -> None:
    done = process("run", "scene.toml", "--backend", "dummy", "--dt", "100 ns", code=START)
    assert done.status == 0, done.err
    assert "velocity-verlet" in done.out
    monkeypatch.setitem(
        ENGINES, "dummy",
        Engine("dummy", "Dummy", "dummy", "Dummy", "#56B4E9", "D", "dot", program="no-such-one"),
    )  # fmt: skip
    (found,) = [one for one in diagnosis._other_codes() if one.name == "Dummy"]
    assert found.text == "only for --backend dummy; apt install no-such-one"


def test_entries_are_told_apart() -> None:
    for look in (style.LABELS, style.COLOURS, style.MARKERS, style.DASHES):
        assert len(set(look.values())) == len(look)  # formulas have looks, too
    assert all(name == engine.name for name, engine in ENGINES.items())


def test_a_marker_that_plotly_does_not_have_is_refused() -> None:
    with pytest.raises(ValueError, match="marker 'h' must be one of"):
        replace(ENGINES["yade"], marker="h")


def test_same_steps_are_for_velocity_verlet_alone(folder: Path) -> None:
    code = DUMMY.replace('"velocity-verlet"', '"rk4"')
    (folder / "dummy.py").write_text(code)
    done = process("compare", "scene.toml", "--backend", "dummy", "--json", code=START)
    assert done.status == 0, done.err
    names = [check["name"] for check in json.loads(done.out)["checks"]]
    assert [name for name in names if name.startswith("dummy")] == [
        "dummy: peaks against the reference",
        "dummy: momentum [N s]",
        "dummy: energy [J]",
    ]
