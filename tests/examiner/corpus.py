"""Decks as users write them: right ones, and ones with mistakes in them.

The deck ``in.SCENE`` or ``in.SCENE_STYLE`` computes the scene ``SCENE.toml``.
"""

from __future__ import annotations

import re
import shutil
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hertzchain as hc
from tests.places import ROOT

FOLDER = ROOT / "tests" / "decks" / "user"


@dataclass(frozen=True)
class Mistake:
    """A deck, texts in it and what stands in their place.

    ``check`` is the start of the name of a check that must fail, ``line`` part of the line that
    must be blamed for it.
    """

    deck: str
    check: str
    line: str
    changes: tuple[str, ...]


def _table(name: str) -> dict[str, Any]:
    return tomllib.loads((FOLDER / name).read_text(encoding="utf-8"))


DECKS: dict[str, list[str]] = {
    **{file.name[3:]: [file.name[3:]] for file in sorted(FOLDER.glob("in.*"))},
    **_table("right.toml"),
}
"""Right decks by name: the file, old text, new text, and so on."""

VARIABLES = {"steel_variables": {"n": "20", "F0": "100", "dt": "2e-7"}}
"""What decks need as ``-var`` of LAMMPS, by file."""

_PLANTED = _table("mistakes.toml")

MISTAKES = {
    name: Mistake(deck, check, line, tuple(changes))
    for name, (deck, check, line, *changes) in _PLANTED["one"].items()
}

UNFIXED: list[str] = _PLANTED["unfixed"]
"""Mistakes that are found, but that no proven correction makes right."""

HARMLESS: list[str] = _PLANTED["harmless"]
"""Mistakes that change no peak: they fail only if differences are judged strictly."""

PAIRS: list[list[str]] = _PLANTED["pairs"]
"""Mistakes that are planted together."""


def scene_of(deck: str) -> hc.Scene:
    """A scene of the folder, by its name or that of a deck."""
    return hc.Scene.from_toml(FOLDER / f"{deck.split('_', maxsplit=1)[0]}.toml")


def copied(folder: Path, deck: str, changes: Sequence[str] = ()) -> Path:
    """A deck in a folder of its own, with all that it reads, and with changes.

    A text is changed in the first of these files that has it, the deck before what it reads.
    """
    path = folder / f"in.{deck}"
    text = (FOLDER / path.name).read_text(encoding="utf-8")
    read = re.findall(r"\S+\.(?:data|inc|txt)\b", text)
    files = [path.name, *(name for name in read if (FOLDER / name).exists())]
    for name in files:
        shutil.copy(FOLDER / name, folder)
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        texts = {name: (folder / name).read_bytes().decode() for name in files}
        name = next((name for name, text in texts.items() if old in text), None)
        assert name is not None, old
        (folder / name).write_bytes(texts[name].replace(old, new).encode())
    return path
