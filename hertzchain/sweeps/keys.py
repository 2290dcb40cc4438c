"""Keys of a scene file that can vary: their values in a scene, and a scene with other values."""

from __future__ import annotations

import copy
import difflib
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from hertzchain.errors import SceneError
from hertzchain.scene.chain import MATERIAL
from hertzchain.scene.reading import read_chain
from hertzchain.scene.scene import Scene
from hertzchain.scene.sections import sections_of
from hertzchain.sweeps.columns import OTHER_MEASURE, PARAMETERS, TERMS, is_whole

_Part = TypeVar("_Part")

_OF_GRANULE = (*MATERIAL, "gap")
_OF_ELASTIC_WALL = ("young_modulus", "poisson_ratio", "yield_strength")
_KNOWN = (*PARAMETERS, *TERMS)


def names_of(scene: Scene) -> tuple[str, ...]:
    """Return the parameters of a scene that can vary."""
    sections = sections_of(scene)
    chain = sections["chain"]
    segments = chain.get("segments", [])
    numbers = [key for key in _OF_GRANULE if not isinstance(chain.get(key), list)]
    alike = len(numbers) == len(_OF_GRANULE) and not segments
    found = ["chain.granules"] if alike else []
    found += [f"chain.{key}" for key in numbers]
    for number, segment in enumerate(segments, start=1):
        cell = segment.get("cell", [])
        keys = ("granules", *_OF_GRANULE, *(() if cell else ("radius_ratio",)))
        found += [f"chain.segments.{number}.{key}" for key in keys]
        for place in range(1, len(cell) + 1):
            found += [f"chain.segments.{number}.cell.{place}.{key}" for key in _OF_GRANULE]
    shock = scene.shock
    of_shock = [f"shock.{key}" for key in shock.own_keys() if not shock.rows]
    others = [
        name
        for name in _KNOWN
        if not name.startswith("chain.") and (not name.startswith("shock.") or name in of_shock)
    ]
    return (*found, *(name for name in others if name.partition(".")[0] in {*sections, "run"}))


def full_name(name: object, scene: Scene) -> str:
    """Return the full name of a parameter that can vary, given with or without its section."""
    names = names_of(scene)
    full = [one for one in names if name in (one, one.partition(".")[2])]
    if len(full) > 1:
        allowed = f"is in several sections: name one of {', '.join(full)}"
        raise SceneError(str(name), None, allowed)
    if full:
        return full[0]
    key = str(name).rpartition(".")[2]
    known = [one for one in _KNOWN if name in (one, one.partition(".")[2])]
    if reason := _reason(known[0] if known else str(name), scene):
        raise SceneError(known[0] if known else str(name), None, f"cannot vary: {reason}")
    meant = [one for one in names if one.partition(".")[2] == key]
    meant = meant or difflib.get_close_matches(str(name), names, n=1)
    hint = f"did you mean {meant[0]}? What can vary" if meant else "what can vary"
    raise SceneError(str(name), None, f"cannot vary; {hint}: {_listed(names)}")


def _listed(names: Sequence[str]) -> str:
    """Return names for a sentence, with one example for segments, which may have thousands."""
    of_segments = [name for name in names if name.startswith("chain.segments.")]
    listed = [name for name in names if name not in of_segments]
    if of_segments:
        listed.append(f"keys of segments, such as {of_segments[-1]}")
    return ", ".join(listed)


def _reason(name: str, scene: Scene) -> str:
    """Return why a known parameter cannot vary in this scene; empty for an unknown name."""
    section = name.partition(".")[0]
    segments = (scene.chain.section or {}).get("segments", [])
    if name.startswith(("chain.segments.", "segments.")):
        return _reason_in_segments(name.partition("segments.")[2].split("."), segments)
    if section == "chain" and name in _KNOWN and segments:
        return "it is the sum over the segments; vary theirs, such as chain.segments.1.granules"
    sections = {one.partition(".")[0] for one in _KNOWN}
    is_missing = section in sections - {*sections_of(scene), "run"}
    if not (is_missing or name in _KNOWN):
        return ""
    more = " in place of [shock]" if section == "striker" else ""
    return {
        "chain": "each granule has its own; describe them by [[chain.segments]] in the scene file",
        "shock": "the scene has a [striker] and no [shock]"
        if scene.striker
        else f"a shock of profile {scene.shock.profile_name} has no such key, or has it in a file",
    }.get(section, f"the scene has no [{section}]; add the section to its file{more}")


def _reason_in_segments(path: Sequence[str], segments: Sequence[Mapping[str, Any]]) -> str:
    """Return why a key of a segment, as 1, cell, 2, radius, cannot vary; empty if unknown."""
    if not segments:
        return "the scene has no [[chain.segments]]; add some to its file"
    if not _counts(path[0], segments):
        return f"the last segment of the scene is {len(segments)}, the first is 1"
    cell = segments[int(path[0]) - 1].get("cell", [])
    if path[1:2] != ["cell"]:
        return ""
    if not cell:
        return f"segment {path[0]} has no cell; add one to the scene file"
    last = f"the last granule of the cell is {len(cell)}, the first is 1"
    return "" if _counts("".join(path[2:3]), cell) else last


def _counts(number: str, things: Sequence[object]) -> bool:
    """Return whether a text is a number from 1 to ``most``."""
    return number.isdecimal() and 1 <= int(number) <= len(things)


def changed(base: Scene, values: Mapping[str, Any]) -> Scene:
    """Return a scene with other values, by the names of parameters in its file.

    A wall that is not elastic gets no material of its own, even if the base has one. A SceneError
    names the key with its section.
    """
    of: dict[str, dict[str, Any]] = defaultdict(dict)
    for name, value in values.items():
        section, _, key = name.partition(".")
        of[section][key] = value
        if name in OTHER_MEASURE:
            of[section][OTHER_MEASURE[name].partition(".")[2]] = None
    if of["wall"].get("kind", "elastic") != "elastic":
        of["wall"] |= dict.fromkeys(_OF_ELASTIC_WALL)
    chain = base.chain
    if of["chain"] and chain.section is not None:
        chain = read_chain(_with_keys(chain.section, of["chain"]))
    else:
        chain = _replaced("chain", chain, of["chain"])
    shock = base.shock.section
    return Scene(
        chain,
        _replaced(shock, base.shock, of[shock]),
        _replaced("run", base.run, of["run"]),
        _replaced("wall", base.wall, of["wall"]),
        _replaced("precompression", base.precompression, of["precompression"]),
        _replaced("contact", base.contact, of["contact"]),
        base.gauges,
    )


def _replaced(section: str, part: _Part, values: Mapping[str, Any]) -> _Part:
    if not values:
        return part
    try:
        return replace(part, **values)  # type: ignore[type-var]
    except SceneError as problem:
        key = f"{section}.{problem.key}"
        raise SceneError(key, problem.value, problem.allowed) from None


def _with_keys(section: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a section [chain] with other values of keys such as ``segments.1.radius``."""
    found = copy.deepcopy(dict(section))
    for name, value in values.items():
        *path, key = name.split(".")
        at: Any = found
        for step in path:
            at = at[int(step) - 1] if step.isdigit() else at[step]
        at[key] = value
    found["granules"] = sum(segment["granules"] for segment in found["segments"])
    return found


def base_values(scene: Scene, names: Collection[str]) -> dict[str, Any]:
    """Return the values of a scene by the names of parameters; NaN for those it does not have."""
    sections = sections_of(scene)
    known: dict[str, Any] = {
        "chain.granules": scene.chain.granules,
        "chain.gap": sections["chain"].get("gap", 0.0),
        "wall.gap": sections.get("wall", {}).get("gap", 0.0),
        "shock.profile": scene.shock.profile_name,
        "shock.peak_force": float(scene.peak_force),
    }
    found = {}
    for name in names:
        section, _, key = name.partition(".")
        value = known.get(name, sections.get(section, {}).get(key))
        if isinstance(value, float | int) and not is_whole(name):
            value = float(value)  # a column has one type, also where a file has 100 for 100.0
        found[name] = np.nan if value is None or isinstance(value, list) else value
    return found
