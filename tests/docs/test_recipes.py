"""What the recipes of docs/develop/recipes.md ask for."""

from __future__ import annotations

import re

import pytest

import hertzchain as hc
from hertzchain.engines.registry import ENGINES, Engine
from hertzchain.scene.file import OF_PROFILE
from hertzchain.sweeps.columns import FOUND_COLUMNS
from tests.docs.test_scene_reference import ROWS
from tests.places import ROOT
from validation.gallery import FOLDER, GALLERY, README, readme, table


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def test_every_pulse_has_a_table_of_keys() -> None:
    listed = {
        word for row in ROWS if row.key == "profile" for word in re.findall(r"`(.+?)`", row.allowed)
    }
    assert listed == {*OF_PROFILE}


@pytest.mark.parametrize("engine", ENGINES.values(), ids=list(ENGINES))
def test_every_engine_is_public_on_a_page_and_in_the_schema(engine: Engine) -> None:
    assert getattr(hc, engine.factory) is engine.load()
    assert engine.label in page("codes.md")
    assert f'"{engine.name}"' in page("schema/parts.json")
    assert f'"{engine.name}_N"' in page("schema/compare.json")
    assert engine.program is None or engine.load().INSTALL


def test_every_column_is_on_a_page() -> None:
    pages = page("sweeps.md") + page("scenes.md")
    assert [column.name for column in FOUND_COLUMNS if f"`{column.name}`" not in pages] == []


def test_every_check_of_the_demo_has_a_row() -> None:
    text = page("trust.md")
    printed = re.findall(r"^(?:native|lammps): (.+?)(?: \[.*)?$", text, re.MULTILINE)
    assert len(printed) > 20
    rows = re.findall(r"^\| ([^|]+) \| ", text.partition("| check |")[2], re.MULTILINE)
    assert set(printed) - {cell for row in rows for cell in row.split("; ")} == set()


def test_the_gallery_shows_what_its_decks_expect() -> None:
    texts = {entry.name: (FOLDER / entry.name).read_text(encoding="utf-8") for entry in GALLERY}
    assert README.read_text(encoding="utf-8") == readme(texts)
    assert table(texts).count("\n| `in.") == len(GALLERY)
