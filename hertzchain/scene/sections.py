"""The values of a scene by the sections and keys of its file, for JSON."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from hertzchain.scene.piston import Piston
from hertzchain.scene.pulse import PulseTable
from hertzchain.scene.reading import profile_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.shock import Shock
from hertzchain.scene.sine import Sine


def scene_as_json(scene: Scene) -> dict[str, dict[str, Any]]:
    """A scene as its file has it, in SI: a JSON object for each section, each a key for a value.

    Tables stand in it by their columns: those of a pulse or a piston as ``time_s`` and ``force_N``
    or ``displacement_m``, those of unlike granules as lists with one number for each.
    """
    sections = sections_of(scene)
    if isinstance(scene.shock, PulseTable):
        sections["shock"] = {"profile": profile_of(scene.shock), **sections["shock"]}
    return sections


def sections_of(scene: Scene) -> dict[str, dict[str, Any]]:
    """The values of a scene in SI by section and key, as JSON knows them.

    What is not given is left out. Unlike granules are lists, or the segments of the scene file.
    """
    chain, shock = scene.chain, scene.shock
    of_shock = _of_shock(shock)
    sections = {
        "chain": dict(_given(chain) if chain.section is None else chain.section),
        "striker" if scene.striker else "shock": of_shock,
        "wall": _given(scene.wall),
        "precompression": _given(scene.precompression),
        "contact": _given(scene.contact),
        "run": _given(scene.run),
    }
    for section in ("chain", "wall"):
        if sections[section].get("gap") == 0:
            del sections[section]["gap"]
    return {name: section for name, section in sections.items() if section}


def _of_shock(shock: Shock) -> dict[str, Any]:
    """The section of a shock; a table stands in it by its columns."""
    if isinstance(shock, PulseTable):
        return {"time_s": list(shock.time), "force_N": list(shock.force)}
    if isinstance(shock, Piston) and shock.velocity is None:
        time, displacement = (list(column) for column in zip(*shock.rows, strict=True))
        return {"profile": "piston", "time_s": time, "displacement_m": displacement}
    if isinstance(shock, Piston | Sine):
        return {"profile": profile_of(shock), **_given(shock)}
    return _given(shock)


def _given(part: Any) -> dict[str, Any]:
    """The fields of a frozen object that are given; none of None."""
    values = {} if part is None else {one.name: getattr(part, one.name) for one in fields(part)}
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in values.items()
        if value is not None and key != "file"
    }
