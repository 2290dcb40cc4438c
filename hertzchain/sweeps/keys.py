"""Keys of a scene file that can vary: their values in a scene, and a scene with other values."""

from __future__ import annotations

import copy
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from hertzchain.errors import SceneError, did_you_mean
from hertzchain.scene.chain import MATERIAL, Chain
from hertzchain.scene.file import OTHERS, SECTIONS, SEGMENT, full_names, read_chain, sections_of
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import DAMPING
from hertzchain.sweeps.columns import OTHER_MEASURE, PARAMETERS, TERMS, is_whole

_Part = TypeVar("_Part")

_OF_GRANULE = (*MATERIAL, "gap", "velocity")
_OF_ELASTIC_WALL = ("young_modulus", "poisson_ratio", "yield_strength")
WALLS = ("wall", "near_wall")
"""Sections of walls."""
_OF_WALLS = (f"{wall}.{key}" for wall in WALLS for key in DAMPING.values())
_IF_GIVEN = ("chain.velocity", "shock.granule", *_OF_WALLS)
"""Keys that vary only if the scene has them, because other keys have the same names."""


def names_of(scene: Scene) -> tuple[str, ...]:
    """Return the parameters of a scene that can vary."""
    sections = sections_of(scene)
    chain = sections["chain"]
    segments = chain.get("segments", [])
    unlike = "fixed" in chain or any(isinstance(chain.get(key), list) for key in _OF_GRANULE)
    of_shock = () if scene.shock.rows else keys_of(type(scene.shock))
    there, names = {"run": {}, **sections}, []
    for name in (*PARAMETERS, *TERMS):
        section, key = name.split(".")
        values = there.get(section)
        if values is None or (section == "shock" and key not in of_shock):
            continue
        is_given = name not in _IF_GIVEN or key in values
        counts_alone = name != "chain.granules" or not (unlike or segments)
        if is_given and counts_alone and not isinstance(values.get(key), list):
            names.append(name)
    for number, segment in enumerate(segments, start=1):
        cell = segment.get("cell", [])
        keys = ("granules", *_OF_GRANULE, *(() if cell else ("radius_ratio",)))
        names += [f"chain.segments.{number}.{key}" for key in keys]
        for place in range(1, len(cell) + 1):
            names += [f"chain.segments.{number}.cell.{place}.{key}" for key in _OF_GRANULE]
    return tuple(names)


def full_name(name: object, scene: Scene) -> str:
    """Return the full name of a parameter that can vary, given with or without its section."""
    names = names_of(scene)
    if full := full_names(name, names):
        return full[0]
    section = str(name).partition(".")[0]
    if section in SECTIONS and section not in {*sections_of(scene), "run", "gauge"}:
        allowed = f"cannot vary: the scene has no [{section}]; add the section to its file"
        raise SceneError(str(name), None, allowed)
    if str(name) in ("granules", "chain.granules"):
        allowed = "cannot vary: segments, a file or lists say how many there are"
        raise SceneError(str(name), None, allowed)
    of_segments = "segments." in str(name)
    alike = [parameter for parameter in names if ("segments." in parameter) == of_segments]
    keys = [parameter.rpartition(".")[2] for parameter in alike]
    key = str(name).rpartition(".")[2]
    same = f"; did you mean {alike[keys.index(key)]}?" if key in keys else ""
    hint = same or did_you_mean(str(name), [*names, *keys])
    # One example for segments, which may have thousands.
    listed = [parameter for parameter in names if not SEGMENT.fullmatch(parameter)]
    if len(listed) < len(names):
        last = next(parameter for parameter in reversed(names) if SEGMENT.fullmatch(parameter))
        listed.append(f"keys of segments, such as {last}")
    what = f"{hint} What" if hint else "; what"
    raise SceneError(str(name), None, f"cannot vary{what} can vary: {', '.join(listed)}")


def changed(
    base: Scene,
    values: Mapping[str, Any],
    scattered: Callable[[Chain], Chain] = lambda chain: chain,
) -> Scene:
    """Return a scene with other values, by the names of parameters in its file.

    ``scattered`` changes its chain further. A wall that is not elastic gets no material of its own,
    even if the base has one. A SceneError names the key with its section.
    """
    of: dict[str, dict[str, Any]] = defaultdict(dict)
    for name, value in values.items():
        section, _, key = name.partition(".")
        of[section][key] = value
        if name in OTHER_MEASURE:
            of[section][OTHER_MEASURE[name].partition(".")[2]] = None
    for wall in WALLS:
        if of[wall].get("kind", "elastic") != "elastic":
            of[wall] |= dict.fromkeys(_OF_ELASTIC_WALL)
    chain = base.chain
    if of["chain"] and chain.section is not None:
        chain = read_chain(_with_keys(chain.section, of["chain"]))
    else:
        chain = _replaced("chain", chain, of["chain"])
    shock = base.shock.section
    others = {name: _replaced(name, getattr(base, name), of[name]) for name in OTHERS}
    chain = scattered(chain)
    return Scene(chain, _replaced(shock, base.shock, of[shock]), **others, gauges=base.gauges)


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
    chain = copy.deepcopy(dict(section))
    for name, value in values.items():
        *path, key = name.split(".")
        at: Any = chain
        for step in path:
            at = at[int(step) - 1] if step.isdigit() else at[step]
        at[key] = value
    chain["granules"] = sum(segment["granules"] for segment in chain["segments"])
    return chain


def base_values(scene: Scene, names: Collection[str]) -> dict[str, Any]:
    """Return the values of a scene by the names of parameters; NaN for those it does not have."""
    sections = sections_of(scene)
    overrides: dict[str, Any] = {
        "chain.granules": scene.chain.granules,
        "chain.gap": sections["chain"].get("gap", 0.0),
        "chain.velocity": sections["chain"].get("velocity", 0.0),
        **{f"{wall}.gap": sections.get(wall, {}).get("gap", 0.0) for wall in WALLS},
        "shock.profile": scene.shock.profile_name,
        "shock.peak_force": float(scene.peak_force),
    }
    values = {}
    for name in names:
        section, _, key = name.partition(".")
        value = overrides.get(name, sections.get(section, {}).get(key))
        if (at := SEGMENT.fullmatch(name)) is not None:
            value = _of_segment(sections["chain"], *at.groups())
        if isinstance(value, float | int) and not is_whole(name):
            value = float(value)  # a column has one type, also where a file has 100 for 100.0
        values[name] = np.nan if value is None or isinstance(value, list) else value
    return values


def _of_segment(chain: Mapping[str, Any], number: str, place: str | None, key: str) -> Any:
    """Return the value of a key of a segment, or of a granule of its cell, or the chain's."""
    segments = chain.get("segments", [])
    if int(number) > len(segments):
        return None
    segment = segments[int(number) - 1]
    granules = segment if place is None else {**segment, **segment["cell"][int(place) - 1]}
    return granules.get(key, chain.get(key))
