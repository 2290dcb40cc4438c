"""The page on the scene file against the reader: its keys, units, ranges, defaults and examples."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields
from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.file import KEYS, SECTIONS, key_named
from hertzchain.scene.keys import Key, keys_of
from tests.places import ROOT
from tests.scene.test_refused import text_of
from tests.scene.test_scene import scene_of

PAGE = (ROOT / "docs" / "scene-reference.md").read_text(encoding="utf-8")

PARTS: dict[str, type] = {
    "[chain]": hc.Chain,
    "[[chain.segments]]": hc.Chain,
    "[shock], a pulse": hc.Pulse,
    "[shock], a half sine": hc.HalfSine,
    "[shock], a saw tooth": hc.Sawtooth,
    "[shock], a trapezoid": hc.Trapezoid,
    "[shock], a measured pulse": hc.PulseTable,
    "[shock], a piston": hc.Piston,
    "[shock], a sine": hc.Sine,
    "[striker]": hc.Striker,
    "[wall]": hc.Wall,
    "[near_wall]": hc.Wall,
    "[precompression]": hc.Precompression,
    "[contact]": hc.Contact,
    "[[gauge]]": hc.Gauge,
    "[run]": hc.Run,
}
"""What each section of the page is read as."""

NOT_OF_PARTS = {"profile", "segments", "file", "radius_ratio", "cell"}
"""Keys that are not fields of every part that has them."""


@dataclass(frozen=True)
class Row:
    """A line of a table of the page: a key and what is said of it."""

    section: str
    key: str
    unit: str
    allowed: str
    default: str
    example: str

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


def test_every_section_of_scene_files_is_on_the_page() -> None:
    names = {row.name.strip("[") for row in ROWS}
    without_keys = {"uncertainty", "scatter"}  # theirs are those of the others
    assert names == {*SECTIONS, "chain.segments"} - without_keys
    assert "## [uncertainty] and [scatter]" in PAGE
    assert {row.section for row in ROWS} == PARTS.keys()


@pytest.mark.parametrize("section", PARTS)
def test_the_keys_are_those_that_the_reader_knows(section: str) -> None:
    page = {row.key for row in ROWS if row.section == section}
    assert page - NOT_OF_PARTS == {*keys_of(PARTS[section])} - NOT_OF_PARTS


def key_of(row: Row) -> Key | None:
    """What the code says of a key; None for one that is not a number of a part."""
    of_segment = row.section == "[[chain.segments]]"
    return key_named(f"{'chain.segments.1' if of_segment else row.name.strip('[')}.{row.key}")


@pytest.mark.parametrize("row", ROWS, ids=IDS)
def test_an_example_and_a_default_are_those_of_the_reader(row: Row) -> None:
    key, value = key_of(row), tomllib.loads(f"value = {row.example}")["value"]
    if key is None or row.key == "profile":
        assert row.key in ("segments", "file", "cell", "profile")
        return
    key.check(row.key, key.read(row.key, value))
    if row.unit:
        with pytest.raises(SceneError, match=re.escape(f"[{row.unit}]")):
            key.read(row.key, "1 mol")
    if isinstance(value, str) and value[0].isdigit():
        assert row.unit, "carries a unit where the page has none"
    if row.section != "[[chain.segments]]":
        default = {item.name: item.default for item in fields(PARTS[row.section])}[row.key]
        if row.default.startswith("`"):
            assert default == tomllib.loads(f"value = {row.default.strip('`')}")["value"]
        else:
            assert default is (MISSING if row.default == "required" else None)


def test_examples_of_segments_and_cells_are_scenes(tmp_path: Path) -> None:
    examples = {row.key: row.example for row in ROWS}
    cell = f"[{{granules = 60, cell = {examples['cell']}}}]"
    for segments in (examples["segments"], cell):
        scene_of(tmp_path, text_of(f"pulse chain.segments={segments}"))


@pytest.mark.parametrize("row", ROWS, ids=IDS)
def test_the_cells_of_a_key_are_its_own(row: Row) -> None:
    """Units, bounds and choices stand in the code once, and on the page."""
    key, of_segment = key_of(row), row.section == "[[chain.segments]]"
    if key is None or row.key in ("granule", "contact"):
        assert row.key in ("segments", "file", "cell", "granule", "contact")
        return
    assert row.unit == key.unit
    if row.key == "profile" or (of_segment and row.key == "granules"):
        return  # each shock has its own; the bounds of a segment are its own
    words = ["integer"] if key.kind == "int" else ["`true`, `false`"] if key.kind == "bool" else []
    words += [f"{words} {bound:g}" for words, bound in key.bounds.items() if bound < 1e6]
    words += [f"`{item}`" for item in key.choices]
    assert row.allowed.startswith(", ".join(words))


def test_the_usual_values_are_those_of_the_code() -> None:
    table = re.findall(r"^\| `([a-z_]+)` \| (\S+) [^|]+\| (\S+) [^|]+\|$", PAGE, re.MULTILINE)
    usual = {name.partition(".")[2]: key.usual for name, key in KEYS.items() if key.usual}
    assert {key: (float(low), float(high)) for key, low, high in table} == usual
