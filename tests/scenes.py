"""The scene files of the paper's tables."""

from __future__ import annotations

from pathlib import Path

import hertzchain as hc

FOLDER = Path(__file__).parent.parent / "validation" / "scenes"

NAMES = sorted(path.stem for path in FOLDER.glob("*_LM*.toml"))
"""All 24 scenes of Tables 2, 3 and 4."""


def load(name: str) -> hc.Scene:
    return hc.Scene.from_toml(FOLDER / f"{name}.toml")
