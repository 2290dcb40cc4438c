"""The rooms of the package and their import order."""

from __future__ import annotations

import ast
import functools
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import hertzchain as hc
from docs import code_map
from tests.test_public_names import modules_after

PACKAGE = Path(hc.__file__).parent

LEVELS = (
    ("errors", "arrays", "files", "limits", "progress", "shown"),
    ("contact",),
    ("scene",),
    ("observables",),
    ("engines.external",),
    ("engines.native", "engines.lammps", "engines.liggghts", "engines.yade", "theory"),
    ("pulses", "slips", "engines.registry"),
    ("examiner",),
    ("known", "verdict"),
    ("report",),
    ("sweeps",),
    ("lab",),
    ("cli", "pytest_plugin"),
    ("__main__",),
)
"""Levels of rooms, lowest first. A room imports none of its own level or above; rooms of the lowest
level may.
"""

ENGINES = LEVELS[5]
"""They never import one another: their independence is what a comparison is worth."""

THE_SAME_END = ("hertzchain.engines.external.engine", "hertzchain.engines.native.backend")
"""The one import between engines: a default end that quick runs find is that of every engine."""

SHOWN = "hertzchain.shown"
"""Its methods load ``report``, far above it, when they are called: how objects show themselves."""

OUTSIDE = ("hertzchain", "hertzchain.engines", "hertzchain.lammps")
"""Public names, from where outside scripts import them."""

NOT_ON_THE_MAP = {*LEVELS[0], *OUTSIDE, "pytest_plugin", "registry", "__init__", "__main__"}

CORE_LOOKS_OUT = {
    ("hertzchain.verdict.comparison", f"hertzchain.examiner.{module}")
    for module in ("examining", "probes")
}
"""The imports of the core from what stands around it: all decks are examined alike."""


FILES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in PACKAGE.rglob("*.py")
}


def imported_by(path: Path) -> set[str]:
    """The modules of this package that a source file imports anywhere, in functions too."""
    modules: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute here"
            assert node.module is not None
            names = {f"{node.module}.{name.name}" for name in node.names}
            modules |= {name if name in FILES else node.module for name in names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            # importlib.import_module and the like
            modules |= {node.value} if node.value.startswith("hertzchain.") else set()
    imported = {name for name in modules if name.startswith("hertzchain.")}
    if path == FILES[SHOWN]:
        imported = {name for name in imported if not name.startswith("hertzchain.report.")}
    return imported


@functools.cache
def imports() -> dict[str, set[str]]:
    """Return the imports of each module, by name; reading all sources takes half a second."""
    return {
        name: (imported_by(path) & FILES.keys()) - {name}
        for name, path in FILES.items()
        if name not in OUTSIDE
    }


def room_of(name: str) -> str:
    parts = name.split(".")[1:]
    return ".".join(parts[:2] if parts[0] == "engines" else parts[:1])


def test_the_files_are_found_and_every_module_has_a_room() -> None:
    assert "hertzchain.engines.native.equations" in FILES
    assert "hertzchain.scene.chain" in imports()["hertzchain.scene.scene"]
    assert "hertzchain.files" in imports()["hertzchain.scene.scene"]  # from within a function
    both = {"hertzchain.engines.native.backend", "hertzchain.engines.lammps.backend"}
    assert both <= imports()["hertzchain.verdict.comparison"]
    rooms = {room_of(name) for name in imports()}
    assert rooms == {room for level in LEVELS for room in level}


def test_imports_go_down_only() -> None:
    level = {room: k for k, rooms in enumerate(LEVELS) for room in rooms}
    wrong = []
    for name, imported in imports().items():
        room = room_of(name)
        for other in imported - set(OUTSIDE):
            there = room_of(other)
            ground = level[room] == level[there] == 0
            if (name, other) == THE_SAME_END:
                continue
            if room != there and level[there] >= level[room] and not ground:
                wrong.append((name, other))
    assert wrong == []


def test_the_core_imports_nothing_of_what_stands_around_it() -> None:
    """The core is what one must read first; the registry names engines and loads them when used."""
    around = {
        (name, other)
        for name, imported in imports().items()
        for other in imported
        if place_of(name) in code_map.CORE
        if place_of(other) not in {*code_map.CORE, *NOT_ON_THE_MAP}
    }
    assert around == CORE_LOOKS_OUT


def test_every_room_is_on_the_map() -> None:
    shown = {room for row in code_map.PLACES for room in row.split()}
    assert {place_of(name) for name in imports()} - NOT_ON_THE_MAP == shown


def place_of(name: str) -> str:
    """The room of a module on the map of the code."""
    return code_map.room_of(name.removeprefix("hertzchain."))


def test_every_room_is_in_the_table() -> None:
    text = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = re.findall(r"^\| (`.+?) \|", text, re.MULTILINE)
    named = {
        name.strip("/").replace("/", ".") for row in table for name in re.findall("`(.+?)`", row)
    }
    assert {room for level in LEVELS for room in level} <= named


def test_there_is_no_cycle_and_public_names_are_for_scripts_outside() -> None:
    """Through ``hertzchain.lammps`` an engine could be imported unseen."""
    assert [name for name, imported in imports().items() if imported & set(OUTSIDE[2:])] == []
    try:
        tuple(TopologicalSorter(imports()).static_order())
    except CycleError as cycle:
        pytest.fail(" -> ".join(cycle.args[1]))


@pytest.mark.parametrize("room", ENGINES)
def test_an_oracle_loads_no_other(room: str) -> None:
    loaded = modules_after(f"import hertzchain.{room}")
    assert f"hertzchain.{room}" in loaded
    assert {name for name in loaded if name.split(".")[:1] == ["lammps"]} == set()
    rooms = {room_of(name) for name in loaded if name in FILES and name not in OUTSIDE}
    assert rooms & set(ENGINES) == {room}
