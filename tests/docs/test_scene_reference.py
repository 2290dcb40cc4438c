"""The page on the scene file against the reader: its keys, units, ranges, defaults and examples."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import tomli_w

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.parts import KEYS, SECTIONS, key_named
from tests.places import ROOT

PAGE = (ROOT / "docs" / "scene-reference.md").read_text(encoding="utf-8")

STEEL = {"radius": 4.75e-3, "young_modulus": 193e9, "poisson_ratio": 0.3, "density": 7958.0}
CHAIN = {"granules": 60, **STEEL}
PULSE = {"profile": "cosine", "peak_force": 100.0, "duration_ratio": 2, "momentum_ratio": 2.0}
PLAIN = {"chain": CHAIN, "shock": PULSE}
PRESSED = {"force": 20.0}
TABLES = {
    "granules.csv": "radius_m,young_modulus_Pa,poisson_ratio,density_kg_m3,gap_m\n"
    + "0.00475,193e9,0.3,7958,0\n" * 60,
    "pulse.csv": "time_s,force_N\n0,0\n1e-5,100\n2e-5,0\n",
    "motion.csv": "time_s,displacement_m\n0,0\n1e-5,1e-6\n",
}
"""Files that the examples name."""

SCENES: dict[str, dict[str, Any]] = {
    "[chain]": PLAIN,
    "[[chain.segments]]": {
        "chain": {**CHAIN, "yield_strength": 3e8, "segments": [{"granules": 60}]}, "shock": PULSE,
    },
    "[shock], a pulse": PLAIN,
    "[shock], a measured pulse": {
        "chain": CHAIN, "shock": {"profile": "table", "file": "pulse.csv"},
    },
    "[shock], a piston": {"chain": CHAIN, "shock": {"profile": "piston", "velocity": 0.1}},
    "[shock], a sine": {
        "chain": CHAIN,
        "shock": {"profile": "sine", "amplitude": 5.0, "frequency": 8e3, "cycles": 4},
        "precompression": PRESSED,
    },
    "[striker]": {"chain": CHAIN, "striker": {"velocity": 1.0}},
    "[wall]": {
        **PLAIN, "wall": {"kind": "elastic", "young_modulus": 70e9, "poisson_ratio": 0.3},
    },
    "[precompression]": {**PLAIN, "precompression": PRESSED, "wall": {"kind": "rigid"}},
    "[contact]": {**PLAIN, "contact": {"damping": "restitution", "restitution": 0.5}},
    "[[gauge]]": {**PLAIN, "gauge": [{"granule": 16}]},
    "[run]": {**PLAIN, "run": {"end_time": 1e-3}},
}  # fmt: skip
"""A scene that has each section of the page."""

INSTEAD: dict[str, dict[str, Any]] = {
    "rise_time": {"momentum_ratio": None},
    "relaxation_time": {"damping": "viscoelastic", "restitution": None},
    "coefficient": {"damping": "dashpot", "restitution": None},
}
"""What else changes where a key is given: other keys go."""

LAWS: dict[str, dict[str, Any]] = {
    "restitution": {"damping": "restitution", "restitution": 0.8},
    "relaxation_time": {"damping": "viscoelastic", "relaxation_time": 1e-6},
    "coefficient": {"damping": "dashpot", "coefficient": 1.0},
}
"""Sections [contact] that a wall needs for damping of its own."""


@dataclass(frozen=True)
class Row:
    """A line of a table of the page: a key and what is said of it."""

    section: str
    key: str
    unit: str
    allowed: str
    default: str
    example: str

    def document(self, value: object) -> dict[str, Any]:
        """The scene of the section with another value of the key."""
        if self.section == "[[gauge]]":
            return {**PLAIN, "gauge": [{self.key: value}]}
        scene = {name: dict(part) for name, part in SCENES[self.section].items()}
        if self.section == "[[chain.segments]]":
            scene["chain"]["segments"] = [{"granules": 60, self.key: value}]
            return scene
        part = scene[self.name]
        if self.key == "file":  # alone, but for the profile of a shock
            part = {key: part[key] for key in ("profile",) if key in part}
        if self.name == "wall" and self.key in LAWS:
            return {**scene, "contact": LAWS[self.key], "wall": {**part, self.key: value}}
        if self.key == "loaded":
            scene["precompression"] = {"force": 1.0}
        part |= {**INSTEAD.get(self.key, {}), self.key: value}
        scene[self.name] = {key: value for key, value in part.items() if value is not None}
        return scene

    @property
    def name(self) -> str:
        """Of the section in TOML."""
        return self.section[1 : self.section.index("]")]


def rows() -> Iterator[Row]:
    """Every line of the tables of keys."""
    for part in re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]:
        section, _, text = part.partition("\n")
        for line in re.findall(r"^\| (`[a-z_]+` \|.+) \|$", text, re.MULTILINE):
            cells = [cell.strip() for cell in line.split("|")]
            if len(cells) == 5:
                key, unit, allowed, default, example = cells
                yield Row(section, key.strip("`"), unit, allowed, default, example.strip("`"))


ROWS = list(rows())
IDS = [f"{row.section}.{row.key}" for row in ROWS]


def read(document: dict[str, Any], folder: Path) -> hc.Scene:
    """The scene of a document, with the tables that examples name next to it."""
    for name, text in TABLES.items():
        (folder / name).write_text(text, encoding="utf-8")
    file = folder / "scene.toml"
    file.write_text(tomli_w.dumps(document), encoding="utf-8")
    return hc.Scene.from_toml(file)


def test_every_section_of_scene_files_is_on_the_page() -> None:
    names = {row.name.strip("[") for row in ROWS}
    without_keys = {"uncertainty", "scatter"}  # theirs are those of the others
    assert names == {*SECTIONS, "chain.segments"} - without_keys
    assert "## [uncertainty] and [scatter]" in PAGE
    assert {row.section for row in ROWS} == SCENES.keys()


@pytest.mark.parametrize("section", SCENES)
def test_the_keys_are_those_that_the_reader_knows(section: str, tmp_path: Path) -> None:
    """An unknown key is answered with those that are known."""
    page = {row.key for row in ROWS if row.section == section}
    unknown = Row(section, "unknown", "", "", "", "")
    with pytest.raises(SceneError) as caught:
        read(unknown.document(1), tmp_path)
    if section == "[shock], a measured pulse":
        assert "takes only file" in str(caught.value)
        assert page == {"profile", "file", "granule"}
        return
    (known,) = re.findall(r"allowed are ([a-z_, ]+)", str(caught.value))
    assert page == set(known.split(", "))


@pytest.mark.parametrize("row", ROWS, ids=IDS)
def test_an_example_is_a_scene_and_has_the_unit(row: Row, tmp_path: Path) -> None:
    value = tomllib.loads(f"value = {row.example}")["value"]
    read(row.document(value), tmp_path)
    if row.unit:
        with pytest.raises(SceneError, match=re.escape(f"[{row.unit}]")):
            read(row.document("1 mol"), tmp_path)
    if isinstance(value, str) and value[0].isdigit():
        assert row.unit, "carries a unit where the page has none"


@pytest.mark.parametrize(
    "row", [row for row in ROWS if row.default == "required"], ids=lambda row: row.section + row.key
)
def test_what_is_required_is_missed(row: Row, tmp_path: Path) -> None:
    document = row.document(None)
    of_segments = row.section == "[[chain.segments]]"
    part = document["chain"]["segments"][0] if of_segments else document[row.name]
    part.pop(row.key, None)
    with pytest.raises(SceneError, match=row.key):
        read(document, tmp_path)


@pytest.mark.parametrize(
    "row", [row for row in ROWS if row.default.startswith("`")], ids=lambda row: row.section
)
def test_a_default_is_the_value_of_a_scene_without_the_key(row: Row, tmp_path: Path) -> None:
    value = tomllib.loads(f"value = {row.default.strip('`')}")["value"]
    if row.key in ("force", "gravity"):  # one of the two is above 0
        other = {"force": "gravity", "gravity": "force"}[row.key]
        document = SCENES[row.section] | {"precompression": {other: 1.0}}
    else:
        document = row.document(None)
        if row.section == "[[chain.segments]]":
            document["chain"]["segments"][0].pop(row.key)
        else:
            document[row.name].pop(row.key, None)
    without = read(document, tmp_path)
    if row.section == "[[chain.segments]]":
        document["chain"]["segments"][0][row.key] = value
    else:
        document[row.name][row.key] = value
    assert read(document, tmp_path) == without


@pytest.mark.parametrize("row", ROWS, ids=IDS)
def test_the_cells_of_a_key_are_its_own(row: Row) -> None:
    """Units, bounds and choices stand in the code once, and on the page."""
    of_segment = row.section == "[[chain.segments]]"
    key = key_named(f"{'chain.segments.1' if of_segment else row.name.strip('[')}.{row.key}")
    if key is None or row.key in ("granule", "contact"):
        assert row.key in ("segments", "file", "cell", "granule", "contact")
        return
    assert row.unit == key.unit
    if row.key == "profile" or (of_segment and row.key == "granules"):
        return  # each shock has its own; the bounds of a segment are its own
    words = ["integer"] if key.kind == "int" else ["`true`, `false`"] if key.kind == "bool" else []
    words += [f"{words} {bound:g}" for words, bound in key.bounds.items() if bound < 1e6]
    words += [f"`{one}`" for one in key.choices]
    assert row.allowed.startswith(", ".join(words))


def test_the_usual_values_are_those_of_the_code() -> None:
    table = re.findall(r"^\| `([a-z_]+)` \| (\S+) [^|]+\| (\S+) [^|]+\|$", PAGE, re.MULTILINE)
    usual = {name.partition(".")[2]: key.usual for name, key in KEYS.items() if key.usual}
    assert {key: (float(low), float(high)) for key, low, high in table} == usual
