"""What the recipes of docs/develop/recipes.md ask for, where no other test would miss it."""

from __future__ import annotations

import re

from hertzchain.engines.registry import ENGINES
from hertzchain.scene.shock import Shock
from hertzchain.sweeps.columns import FOUND_COLUMNS
from tests.docs.test_scene_reference import ROWS
from tests.places import ROOT
from validation.gallery import FOLDER, GALLERY, README, readme, table


def page(name: str) -> str:
    """The text of a page of docs/."""
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def test_every_pulse_has_a_table_of_keys() -> None:
    listed = {
        word for row in ROWS if row.key == "profile" for word in re.findall(r"`(.+?)`", row.allowed)
    }
    shocks = [shock for shock in Shock.__subclasses__() if shock.section == "shock"]
    assert listed == {name for shock in shocks for name in shock.profiles}


def test_every_engine_is_on_a_page() -> None:
    assert [one.label for one in ENGINES.values() if one.label not in page("codes.md")] == []


def test_every_column_is_on_a_page() -> None:
    pages = page("sweeps.md") + page("scenes.md")
    assert [one.name for one in FOUND_COLUMNS if f"`{one.name}`" not in pages] == []


def test_the_gallery_shows_what_its_decks_expect() -> None:
    texts = {entry.name: (FOLDER / entry.name).read_text(encoding="utf-8") for entry in GALLERY}
    assert README.read_text(encoding="utf-8") == readme(texts)
    assert table(texts).count("\n| `in.") == len(GALLERY)
