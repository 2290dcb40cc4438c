"""The registry: a further engine is its folder and one line."""

from __future__ import annotations

import json
from importlib import metadata
from pathlib import Path

import pytest

from hertzchain.cli import doctor
from hertzchain.engines.registry import ENGINES, Engine
from hertzchain.report import style
from tests.command_line import process
from tests.conftest import paper_scene

DUMMY = """
from dataclasses import dataclass, replace

import hertzchain as hc


@dataclass(frozen=True)
class Dummy:
    name = "dummy"
    dt: float | None = None
    rtol: float = 1e-6
    extrapolated: bool = False
    time_limit: float = 600.0

    def run(self, scene, record=None):
        found = hc.Native("velocity-verlet", self.dt or 0.01 * scene.units.time).run(scene, record)
        return replace(found, backend=self.name)


class Other(Dummy):
    name = "other"

    def run(self, scene, record=None):
        found = hc.Native("rk4", self.dt or 0.05 * scene.units.time).run(scene, record)
        return replace(found, backend=self.name)
"""
"""Engines: their folder."""

START = """
import contextlib, dataclasses, json, sys
from hertzchain.engines.registry import ENGINES, Engine

dummy = Engine("dummy", "Dummy", "dummy", "Dummy", "#56B4E9", "D", program="dummy-program")
ENGINES["dummy"] = dummy
ENGINES["other"] = dataclasses.replace(dummy, name="other", label="Other", factory="Other")

from hertzchain.cli import main

for name, arguments in json.loads(sys.argv[1]).items():
    sys.argv[1:] = arguments
    with open(name, "w") as file, contextlib.redirect_stdout(file):
        try:
            main()
        except SystemExit as end:
            assert end.code == 0, (name, end.code)
"""
"""A line of the registry for each engine, and the command line; what it prints is kept in files."""

COMMANDS = {
    "compared.json": (
        *("compare", "scene.toml", "--backend", "dummy", "--json"),
        *("--plot", "plot.svg", "--report", "page.html", "--junit", "junit.xml"),
    ),
    "run.txt": ("run", "scene.toml", "--backend", "dummy", "--dt", "100 ns"),
    "other.json": ("compare", "scene.toml", "--backend", "other", "--json"),
}


def checks_of(file: Path) -> list[str]:
    """The names of the checks of a comparison that was kept."""
    return [check["name"] for check in json.loads(file.read_text(encoding="utf-8"))["checks"]]


def test_a_further_engine_is_a_folder_and_a_line(tmp_path: Path) -> None:
    """The same steps are asked of velocity Verlet alone."""
    paper_scene("cosine", 1.0, 2.0, granules=12).to_toml(tmp_path / "scene.toml")
    (tmp_path / "dummy.py").write_text(DUMMY)
    done = process(json.dumps(COMMANDS), code=START, cwd=tmp_path)
    assert done.status == 0, done.err
    assert set(checks_of(tmp_path / "compared.json")) >= {
        "dummy: displacement, same steps",
        "dummy: peaks against the reference",
        "dummy: energy [J]",
    }
    assert [name for name in checks_of(tmp_path / "other.json") if name.startswith("other")] == [
        "other: peaks against the reference",
        "other: momentum [N s]",
        "other: energy [J]",
    ]
    table = json.loads((tmp_path / "compared.json").read_text(encoding="utf-8"))
    assert all(row["dummy_N"] > 0 for row in table["rows"])
    for file, wanted in (("page.html", "Dummy, error estimate"), ("junit.xml", "dummy: energy")):
        assert wanted in (tmp_path / file).read_text(encoding="utf-8")
    assert "Dummy" in (tmp_path / "plot.svg").read_text(encoding="utf-8")
    assert "velocity-verlet" in (tmp_path / "run.txt").read_text(encoding="utf-8")


def test_doctor_knows_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(
        ENGINES, "dummy",
        Engine("dummy", "Dummy", __name__, "Installed", "#56B4E9", "D", program="none"),
    )  # fmt: skip
    (dummy,) = [entry for entry in doctor._other_codes() if entry.name == "Dummy"]
    assert dummy.text == "only for --backend dummy; brew install dummy"


class Installed:
    """An engine that says how to install it."""

    INSTALL = "brew install dummy"


def test_doctor_says_what_optional_packages_are_for(monkeypatch: pytest.MonkeyPatch) -> None:
    installed = metadata.version

    def version(name: str) -> str:
        if name == "distributed":
            raise metadata.PackageNotFoundError
        return installed(name)

    missing = doctor.Finding("LAMMPS", False, "not asked")
    for of_lammps in ("_lammps", "_binary"):
        monkeypatch.setattr(doctor, of_lammps, lambda *_, **__: missing)
    codes = {entry.name: entry for entry in doctor.diagnose()}
    assert (codes["distributed"].text, codes["distributed"].works) == (
        installed("distributed"),
        True,
    )
    monkeypatch.setattr(metadata, "version", version)
    codes = {entry.name: entry for entry in doctor.diagnose()}
    assert not codes["distributed"].works
    assert not codes["distributed"].needed
    assert codes["distributed"].text.endswith("; pip install 'hertzchain[cluster]'")


def test_entries_are_told_apart() -> None:
    for look in (style.LABELS, style.COLOURS, style.MARKERS):
        assert len(set(look.values())) == len(look)  # formulas have looks, too
    assert all(name == engine.name for name, engine in ENGINES.items())
