"""Columns of the tables of a sweep: results, and the keys that vary."""

from __future__ import annotations

import copy
import re
from collections import defaultdict
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, did_you_mean, require
from hertzchain.observables.result import Result
from hertzchain.scene.chain import MATERIAL, MEASURED, Chain
from hertzchain.scene.file import (
    KEYS,
    OTHERS,
    SECTIONS,
    SEGMENT,
    full_names,
    key_named,
    read_chain,
    sections_of,
)
from hertzchain.scene.keys import Section, keys_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.shocks import Pulse
from hertzchain.scene.terms import DAMPING

Read = Callable[[Result], float | None]


@dataclass(frozen=True)
class Column:
    """A column of the table."""

    name: str  # with its unit
    label: str  # on an axis; empty: cannot be drawn
    kind: str = "float"  # float, int or str; missing: NaN, 0 or ""
    of: str = ""  # kind of scenes that have it, see ``columns_of``; empty: all
    read: Read | None = None  # how it is read from a result; None for parameters


_OF_KEYS = {name: Column(name, key.axis, key.kind) for name, key in KEYS.items() if key.label}

PARAMETERS = {
    *(f"chain.{key}" for key in ("granules", *MATERIAL)),
    *(f"shock.{key}" for key in keys_of(Pulse) if key != "granule"),
    "run.end_time",
}
"""Parameters of uniform free chains under a single pulse."""

FIRST = ("first_peak_force_N", "arrival_time_s")
"""Columns of first pulses."""

_WITH_TIME = (*FIRST, "contact_time_s")
"""Columns of first pulses on walls."""


def _at(run: Result, name: str, k: int) -> float | None:
    """Return a number of the k-th contact; None where it is unknown."""
    if run.is_cut_off[k]:
        return None
    if name in _WITH_TIME:
        return run.first_columns[name][k] if run.first_columns else None
    values = run.peak_force if name == "peak_force_N" else run.peak_time
    return None if run.peak_errors[k] >= 1 else float(values[k])


def _of_wall(section: str, k: int) -> tuple[Column, ...]:
    """Return the columns of a wall with the k-th contact."""
    labels = ("first peak force on the {} [N]", "arrival at the {} [s]",
              "contact time with the {} [s]", "peak force on the {} [N]",
              "time of the peak force on the {} [s]")  # fmt: skip
    return tuple(
        Column(f"{section}_{name}", label.format(section.replace("_", " ")), of=section,
               read=partial(_at, name=name, k=k))
        for name, label in zip((*_WITH_TIME, "peak_force_N", "peak_time_s"), labels, strict=True)
    )  # fmt: skip


def _largest(
    run: Result, static: FloatArray | None = None
) -> tuple[float, int] | tuple[None, None]:
    """Return the largest peak force less a static one, and its contact; None if it is cut off."""
    force = run.peak_force - (0.0 if static is None else static)
    k = int(np.argmax(force))
    return (None, None) if run.is_cut_off[k] else (float(force[k]), int(run.contact[k]))


def _restitution(run: Result, name: str) -> float | None:
    return getattr(run.restitution, name, None)


def _of_contact_n(run: Result) -> float | None:
    """Return the peak force of contact N; None where it is cut off, or for a single granule."""
    number, contacts = run.scene.chain.granules, run.scene.contacts
    return _at(run, "peak_force_N", contacts.index(number)) if number in contacts else None


FOUND_COLUMNS = (
    Column("transition_granules", "p, granules in the transition", "int", "waves",
           attrgetter("transition_granules")),
    Column("solitary_wave_force_N", "F_SW [N]", of="waves",
           read=attrgetter("solitary_wave.peak_force")),
    Column("far_field_force_N", "peak force far from the shock [N]", of="waves",
           read=attrgetter("solitary_wave.far_field_force")),
    Column("far_field_error", "largest further change of the wave, relative", of="waves",
           read=attrgetter("solitary_wave.far_field_error")),
    Column("speed_m_s", "wave speed [m/s]", of="waves", read=attrgetter("solitary_wave.speed")),
    Column("speed_error", "largest difference of the speed from that of the settled wave, relative",
           of="waves", read=attrgetter("solitary_wave.speed_error")),
    Column("largest_peak_force_N", "largest peak force [N]",
           read=lambda run: _largest(run)[0]),
    Column("largest_peak_contact", "contact of the largest peak", "int",
           read=lambda run: _largest(run)[1]),
    Column("last_peak_force_N", "peak force of contact N [N]", of="terms",
           read=_of_contact_n),
    Column("largest_dynamic_force_N", "largest peak force less the static force [N]",
           of="precompression", read=lambda run: _largest(run, run.static_force)[0]),
    *_of_wall("near_wall", 0),
    *_of_wall("wall", -1),
    *(Column(f"{name}_restitution", f"momentum back over momentum in, {label}", of="terms",
             read=partial(_restitution, name=name))
      for name, label in (("first_granule", "granule 1"), ("column", "all granules"))),
    Column("contacts_cut_off", "contacts whose peak may come after the end of the run", "int",
           "terms", lambda run: len(run.cut_off)),
    Column("overlap_ratio", "largest overlap / R", read=attrgetter("overlap_ratio")),
    Column("error_estimate", "error estimate of the peaks, relative",
           read=attrgetter("error_estimate")),
    Column("wanted_error", "relative error of the wanted quantity", of="terms",
           read=attrgetter("wanted_error")),
    Column("force_evaluations", "force evaluations", "int", read=attrgetter("force_evaluations")),
)  # fmt: skip
"""Columns of results, in the order of the table, after the parameters."""

_GAUGE = {
    "first_peak_force_N": ("first peak of gauge {} [N]", attrgetter("force")),
    "arrival_time_s": ("arrival at gauge {} [s]", attrgetter("arrival")),
}
"""Label and value of the numbers of each gauge."""

_GAUGE_NAME = re.compile(rf"gauge_(\d+)_({'|'.join(_GAUGE)})")

_BEGIN = (Column("scene", "number of the scene", "int"), Column("backend", "backend", "str"))
_END = Column("failure", "", "str")

_ALONG = (
    Column("contact", "contact", "int"),
    Column("peak_force_N", "peak force [N]"),
    Column("peak_time_s", "time of the peak [s]"),
)
"""Columns of the table of all contacts."""

_BY_NAME = _OF_KEYS | {column.name: column for column in (*_BEGIN, *FOUND_COLUMNS, _END, *_ALONG)}

RESULTS = {column.name for column in FOUND_COLUMNS}
TEXT = tuple(name for name, column in _BY_NAME.items() if column.kind == "str")


def is_result(name: str) -> bool:
    """Return whether a column is a number of a result."""
    return name in RESULTS or _GAUGE_NAME.fullmatch(name) is not None


def peak_columns(columns: Sequence[str]) -> tuple[str, ...]:
    """Return the columns of the table of peaks, with first pulses where scenes have terms."""
    names = ("scene", "backend", "contact", "peak_force_N", "peak_time_s")
    return (*names, *FIRST) if "wanted_error" in columns else names


OTHER_MEASURE = {
    "shock.momentum_ratio": "shock.rise_time",
    "shock.rise_time": "shock.momentum_ratio",
}
"""Two measures of the length of a pulse; each follows from the other."""

PAPER_NAMES = {
    "p": "transition_granules",
    "F_SW": "solitary_wave_force_N",
    "LM_ratio": "momentum_ratio",
    "F0": "peak_force",
    "n": "duration_ratio",
    "N": "granules",
}
"""Columns by their names in the paper."""


def full_name(name: str, columns: Sequence[str], varied: Collection[str]) -> str:
    """Return the full name of a column, given with or without its section, or as in the paper.

    If several sections have it, the one that varies is taken.
    """
    names = full_names(PAPER_NAMES.get(name, name), columns, varied)
    allowed = f"is not a column of a sweep, which has {', '.join(columns)}"
    require(len(names) == 1, name, None, allowed + did_you_mean(name, columns))
    return names[0]


def column_named(name: str) -> Column:
    """Return the column of this name, also for segments of a chain and gauges."""
    if name in _BY_NAME:
        return _BY_NAME[name]
    if (gauge := _GAUGE_NAME.fullmatch(name)) is not None:
        label, value = _GAUGE[gauge[2]]
        return Column(
            name, label.format(gauge[1]), read=lambda run: value(run.gauges[int(gauge[1]) - 1])
        )
    match, key = SEGMENT.fullmatch(name), key_named(name)
    assert match is not None, name
    assert key is not None, name
    cell = "" if match[2] is None else f", granule {match[2]} of the cell"
    return Column(name, f"{key.axis}, segment {match[1]}{cell}", key.kind)


def is_whole(name: str) -> bool:
    """Return whether the values of a column are whole numbers."""
    return column_named(name).kind == "int"


def unit_of(name: str) -> str:
    """Return the unit of a column; empty for a pure number, and for no column."""
    match = re.search(r"\[(.*)\]", column_named(name).label) if "." in name else None
    return match[1] if match else ""


def are_plain(scene: Scene, varied: Collection[str]) -> bool:
    """Return whether no scene of a sweep can have terms."""
    of_shock = {f"shock.{key}" for key in keys_of(type(scene.shock)) if key != "granule"}
    is_plain = scene.is_plain and not scene.gauges and scene.chain.section is None
    return is_plain and {*of_shock, *varied} <= PARAMETERS


def columns_of(scene: Scene, varied: Collection[str]) -> tuple[Column, ...]:
    """Return the columns of the table of a sweep, from its scene and the varying parameters.

    Parameters stand in the order of the scene file.
    """
    sections, shock = sections_of(scene), scene.shock
    given = {
        f"{section}.{key}"
        for section, values in sections.items()
        if section != "gauge"
        for key, value in values.items()
        if not isinstance(value, list)
    }
    kept, kinds = PARAMETERS, {"", "waves"}
    if not are_plain(scene, varied):
        kept = {f"chain.{key}" for key in ("granules", *MATERIAL)} | {"run.end_time"}
        kept |= {*varied, *given}
        if shock.section == "shock":
            keys = {"profile", "momentum_ratio", *keys_of(type(shock))} - {"granule"}
            kept |= {f"shock.{key}" for key in keys}
        unlike = any(isinstance(value, list) for value in sections["chain"].values())
        held = not sections.keys().isdisjoint({"striker", *OTHERS} - {"run"}) or shock.is_driven
        kinds = {"", "terms", *sections}
        kinds |= set() if unlike or held or "shock.granule" in given else {"waves"}
    names = [name for name in _OF_KEYS if name in kept]
    rest = sum(name.startswith("chain.") for name in names)
    names[rest:rest] = filter(SEGMENT.fullmatch, varied)
    return (
        *_BEGIN,
        *map(column_named, names),
        *(column for column in FOUND_COLUMNS if column.of in kinds),
        *_of_gauges(len(scene.gauges)),
        _END,
    )


def _of_gauges(count: int) -> list[Column]:
    return [column_named(f"gauge_{k}_{what}") for k in range(1, count + 1) for what in _GAUGE]


def numbers_of(run: Result) -> dict[str, float | None]:
    """Return the numbers of a result by the names of their columns; None where there is none."""
    return {
        column.name: column.read(run)
        for column in (*FOUND_COLUMNS, *_of_gauges(len(run.gauges)))
        if column.read is not None and getattr(run.scene, column.of, "") is not None
    }


_Part = TypeVar("_Part")

_OF_GRANULE = (*MATERIAL, "gap", "velocity", *MEASURED)
_OF_ELASTIC_WALL = ("young_modulus", "poisson_ratio", "yield_strength")
WALLS = ("wall", "near_wall")
"""Sections of walls."""
_OF_WALLS = (f"{wall}.{key}" for wall in WALLS for key in DAMPING.values())
_IF_GIVEN = (
    "chain.velocity", "shock.granule", *_OF_WALLS,
    *(f"chain.{key}" for key in (*MATERIAL, *MEASURED)), *(f"{wall}.stiffness" for wall in WALLS),
)  # fmt: skip
"""Keys that vary only if the scene has them, because other keys have the same names."""


def names_of(scene: Scene) -> tuple[str, ...]:
    """Return the parameters of a scene that can vary."""
    sections = {"run": {}, **sections_of(scene)}
    chain, of_shock = sections["chain"], () if scene.shock.rows else keys_of(type(scene.shock))
    segments = chain.get("segments", [])
    unlike = "fixed" in chain or any(isinstance(chain.get(key), list) for key in _OF_GRANULE)
    names = []
    for name in _OF_KEYS:
        section, key = name.split(".")
        values = sections.get(section)
        if values is None or (section == "shock" and key not in of_shock):
            continue
        is_given = name not in _IF_GIVEN or key in values
        counts_alone = name != "chain.granules" or not (unlike or segments)
        if is_given and counts_alone and not isinstance(values.get(key), list):
            names.append(name)
    absent = {key for key in (*MATERIAL, *MEASURED) if getattr(scene.chain, key) is None}
    of_granule = [key for key in _OF_GRANULE if key not in absent]
    for number, segment in enumerate(segments, start=1):
        at, cell = f"chain.segments.{number}", segment.get("cell", [])
        keys = ("granules", *of_granule, *(() if cell else ("radius_ratio",)))
        names += [f"{at}.{key}" for key in keys]
        names += [f"{at}.cell.{k}.{key}" for k in range(1, len(cell) + 1) for key in of_granule]
    return tuple(names)


def full_key(name: object, scene: Scene) -> str:
    """Return the full name of a parameter that can vary, given with or without its section."""
    names, text = names_of(scene), str(name)
    if full := full_names(name, names):
        return full[0]
    section, key = text.partition(".")[0], text.rpartition(".")[2]
    if section in SECTIONS and section not in {*sections_of(scene), "run", "gauge"}:
        allowed = f"cannot vary: the scene has no [{section}]; add the section to its file"
        raise SceneError(text, None, allowed)
    of_segments = "segments." in text
    alike = [other for other in names if ("segments." in other) == of_segments]
    keys = {other.rpartition(".")[2]: other for other in reversed(alike)}
    hint = f"; did you mean {keys[key]}?" if key in keys else did_you_mean(text, [*names, *keys])
    listed = [other for other in names if not SEGMENT.fullmatch(other)]
    if len(listed) < len(names):  # segments may be thousands
        listed.append(f"keys of segments, such as {names[-1]}")
    what = f"{hint} What" if hint else "; what"
    raise SceneError(text, None, f"cannot vary{what} can vary: {', '.join(listed)}")


def changed(
    base: Scene,
    values: Section,
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
        if name in OTHER_MEASURE and base.pulse is not None:
            of[section][OTHER_MEASURE[name].partition(".")[2]] = None
    for wall in WALLS:
        if of[wall].get("kind", "elastic") != "elastic":
            of[wall] |= dict.fromkeys(_OF_ELASTIC_WALL)
    chain = base.chain
    if of["chain"] and chain.section is not None:
        chain = read_chain(_with_keys(chain.section, of["chain"]))
    else:
        chain = _replaced("chain", chain, of["chain"])
    section = base.shock.section
    shock = _replaced(section, base.shock, of[section])
    others = {name: _replaced(name, getattr(base, name), of[name]) for name in OTHERS}
    return Scene(scattered(chain), shock, **others, gauges=base.gauges)


def _replaced(section: str, part: _Part, values: Section) -> _Part:
    if not values:
        return part
    try:
        return replace(part, **values)  # type: ignore[type-var]
    except SceneError as problem:
        key = f"{section}.{problem.key}"
        raise SceneError(key, problem.value, problem.allowed) from None


def _with_keys(section: Section, values: Section) -> dict[str, Any]:
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
    chain, segments = sections["chain"], sections["chain"].get("segments", [])
    overrides: dict[str, Any] = {
        "chain.granules": scene.chain.granules,
        **{f"chain.{key}": chain.get(key, 0.0) for key in ("gap", "velocity")},
        **{f"{wall}.gap": sections.get(wall, {}).get("gap", 0.0) for wall in WALLS},
        "shock.profile": scene.shock.profile_name,
        "shock.peak_force": float(scene.peak_force),
    }
    values = {}
    for name in names:
        section, _, key = name.partition(".")
        value = overrides.get(name, sections.get(section, {}).get(key))
        if (at := SEGMENT.fullmatch(name)) is not None and int(at[1]) <= len(segments):
            segment = segments[int(at[1]) - 1]
            of_cell = segment["cell"][int(at[2]) - 1] if at[2] else {}
            value = {**chain, **segment, **of_cell}.get(at[3])
        if isinstance(value, float | int) and not is_whole(name):
            value = float(value)  # a column has one type, also where a file has 100 for 100.0
        values[name] = np.nan if value is None or isinstance(value, list) else value
    return values
