"""The columns of a sweep: one entry each, read by its tables, plots and files."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.shock import Shock
from hertzchain.scene.shocks import OF_PROFILE, SHOCKS
from hertzchain.theory.peak_map import FAR_FIELD_ERROR, PEAK_ERROR

if TYPE_CHECKING:
    from hertzchain.engines.native import Batch
    from hertzchain.observables.gauges import Reading
    from hertzchain.observables.result import Result
    from hertzchain.theory import Prediction


@dataclass(frozen=True, eq=False)
class BatchFound:
    """Similar scenes that were measured together, in SI; arrays of shape (scenes,)."""

    batch: Batch  # results in natural units
    near: FloatArray  # F_SW [N]
    far: FloatArray  # far-field force [N]
    far_off: FloatArray  # error of the far-field force, relative
    speed: FloatArray  # of the solitary wave [m/s]
    speed_off: FloatArray  # its error, relative
    transition: Any  # p, 0 where there is none
    largest: FloatArray  # peak force [N]
    contact: Any  # the one with the largest peak
    overlap: FloatArray  # the largest, over the radius


@dataclass(frozen=True)
class Column:
    """A column of the table."""

    name: str  # with its unit
    label: str  # on an axis; empty: cannot be drawn
    kind: str = "float"  # float, int or str; missing: NaN, 0 or ""
    title: str = ""  # form in a title of a value that is the same in all rows
    of_result: Callable[[Result], float | None] | None = None
    of_prediction: Callable[[Prediction], float | None] | None = None
    of_batch: Callable[[BatchFound], Any] | None = None


def _of_shock(kind: type[Shock]) -> list[Column]:
    """Return the columns of the keys of a shock."""
    return [
        Column(f"{kind.section}.{name}", key.label, key.kind, key.title)
        for name, key in kind.own_keys().items()
    ]


_PARAMETERS = (
    Column("chain.granules", "granules N", "int", "{} granules"),
    Column("chain.radius", "radius R [m]", title="R = {:.4g} m"),
    Column("chain.young_modulus", "Young's modulus E [Pa]", title="E = {:.4g} Pa"),
    Column("chain.poisson_ratio", "Poisson's ratio", title="ν = {:.4g}"),  # noqa: RUF001
    Column("chain.density", "density [kg/m³]", title="{:.4g} kg/m³"),
    *_of_shock(Pulse),
    Column("run.end_time", "end of the run [s]", title="until {:.4g} s"),
)

PARAMETERS = tuple(column.name for column in _PARAMETERS)  # that can vary, by scene files

_TERMS = (
    Column("chain.gap", "gap before each granule [m]", title="gaps of {:.4g} m"),
    *(column for kind in SHOCKS for column in _of_shock(kind) if column.name not in PARAMETERS),
    Column("wall.kind", "wall", "str", "{} wall"),
    Column("wall.young_modulus", "Young's modulus of the wall [Pa]", title="wall E = {:.4g} Pa"),
    Column(
        "wall.poisson_ratio", "Poisson's ratio of the wall",
        title="wall ν = {:.4g}",  # noqa: RUF001
    ),
    Column("wall.gap", "gap before the wall [m]", title="{:.4g} m before the wall"),
    Column("precompression.force", "precompression [N]", title="precompression {:.4g} N"),
    Column("precompression.gravity", "gravity along the chain [m/s²]", title="gravity {:.4g} m/s²"),
    Column("contact.restitution", "coefficient of restitution e", title="e = {:.4g}"),
    Column(
        "contact.relaxation_time", "relaxation time of contacts [s]",
        title="relaxation time {:.4g} s",
    ),
    Column(
        "contact.coefficient", "coefficient of dashpots [kg/s]", title="dashpots of {:.4g} kg/s"
    ),
)  # fmt: skip

TERMS = tuple(column.name for column in _TERMS)  # further parameters of scenes with terms

_OF_EVERY_SHOCK = ("shock.profile", "shock.momentum_ratio")

_SEGMENT = re.compile(r"chain\.segments\.(\d+)\.(?:cell\.(\d+)\.)?(\w+)")

FOUND_COLUMNS = (
    Column(
        "transition_granules",
        "p, granules in the transition",
        "int",
        of_result=lambda found: found.transition_granules,
        of_prediction=lambda found: found.transition_granules,
        of_batch=lambda found: found.transition,
    ),
    Column(
        "solitary_wave_force_N",
        "F_SW [N]",
        of_result=lambda found: found.solitary_wave.peak_force,
        of_prediction=lambda found: found.wave_force,
        of_batch=lambda found: found.near,
    ),
    Column(
        "far_field_force_N",
        "peak force far from the shock [N]",
        of_result=lambda found: found.solitary_wave.far_field_force,
        of_prediction=lambda found: found.far_field_force,
        of_batch=lambda found: found.far,
    ),
    Column(
        "far_field_error",
        "largest further change of the wave, relative",
        of_result=lambda found: found.solitary_wave.far_field_error,
        of_prediction=lambda found: None if found.far_field_force is None else FAR_FIELD_ERROR,
        of_batch=lambda found: found.far_off,
    ),
    Column(
        "speed_m_s",
        "wave speed [m/s]",
        of_result=lambda found: found.solitary_wave.speed,
        of_prediction=lambda found: None if found.speed is None else found.speed.exact,
        of_batch=lambda found: found.speed,
    ),
    Column(
        "speed_error",
        "largest difference of the speed from that of the settled wave, relative",
        of_result=lambda found: found.solitary_wave.speed_error,
        of_batch=lambda found: found.speed_off,
    ),
    Column(
        "largest_peak_force_N",
        "largest peak force [N]",
        of_result=lambda found: float(np.max(found.peak_force)),
        of_prediction=lambda found: float(np.max(found.peak_force)),
        of_batch=lambda found: found.largest,
    ),
    Column(
        "largest_peak_contact",
        "contact of the largest peak",
        "int",
        of_result=lambda found: int(np.argmax(found.peak_force)) + 2,
        of_prediction=lambda found: int(np.argmax(found.peak_force)) + 2,
        of_batch=lambda found: found.contact,
    ),
    Column(
        "overlap_ratio",
        "largest overlap / R",
        of_result=lambda found: found.overlap_ratio,
        of_prediction=lambda found: found.overlap_ratio,
        of_batch=lambda found: found.overlap,
    ),
    Column(
        "eq3_transition_granules", "p by Eq. 3, granules", of_prediction=lambda found: found.eq3
    ),
    Column(
        "error_estimate",
        "error estimate of the peaks, relative",
        of_result=lambda found: found.error_estimate,
        of_prediction=lambda _: PEAK_ERROR,
        of_batch=lambda found: found.batch.error_estimate,
    ),
    Column(
        "force_evaluations",
        "force evaluations",
        "int",
        of_result=lambda found: found.force_evaluations,
        of_batch=lambda found: found.batch.force_evaluations,
    ),
)
"""Columns of results, in the order of the table, after the parameters."""

_OF_WAVES = (
    "transition_granules", "solitary_wave_force_N", "far_field_force_N", "far_field_error",
    "speed_m_s", "speed_error",
)  # fmt: skip

_LAST_PEAK = Column(
    "last_peak_force_N",
    "peak force of contact N [N]",
    of_result=lambda found: found.peak_at(found.scene.chain.granules),
)


def _of_wall(found: Result, values: FloatArray) -> float | None:
    """Return the value of the contact with the wall; None without one.

    It is None, too, where the run ended before the wall was pressed and let up, or no digit of the
    force is right.
    """
    scene = found.scene
    if scene.wall is None or scene.contact_name(scene.last_contact) in found.cut_off:
        return None
    return float(values[-1]) if found.peak_errors[-1] < 1 else None


def _first_of_wall(name: str, found: Result) -> float | None:
    """Return the value of the first pulse on the wall; None without one."""
    known = found.first_columns
    return float(known[name][-1]) if known and found.scene.wall is not None else None


_FOUND_WITH_WALL = (
    *(
        Column(f"wall_{name}", label, of_result=partial(_first_of_wall, name))
        for name, label in (
            ("first_peak_force_N", "first peak force on the wall [N]"),
            ("arrival_time_s", "arrival at the wall [s]"),
        )
    ),
    Column(
        "wall_peak_force_N",
        "peak force on the wall [N]",
        of_result=lambda found: _of_wall(found, found.peak_force),
    ),
    Column(
        "wall_peak_time_s",
        "time of the peak force on the wall [s]",
        of_result=lambda found: _of_wall(found, found.peak_time),
    ),
)
CUT_OFF = Column(
    "contacts_cut_off",
    "contacts whose peak may come after the end of the run",
    "int",
    of_result=lambda found: len(found.cut_off),
)
_OF_GAUGES: dict[str, tuple[str, Callable[[Reading], float]]] = {
    "first_peak_force_N": ("first peak of gauge {} [N]", lambda read: read.force),
    "arrival_time_s": ("arrival at gauge {} [s]", lambda read: read.arrival),
}
"""Labels of what is found of each gauge, and how to get it."""

_GAUGE = re.compile(rf"gauge_(\d+)_({'|'.join(_OF_GAUGES)})")


def _of_gauge(number: int, what: str) -> Column:
    """Return a column of a gauge, by its number in the scene from 1 on."""
    label, getter = _OF_GAUGES[what]
    return Column(
        f"gauge_{number}_{what}", label.format(number),
        of_result=lambda found: getter(found.gauges[number - 1]) if found.gauges else None,
    )  # fmt: skip


_FOUND_UNDER_LOAD = Column(
    "largest_dynamic_force_N",
    "largest peak force less the static force [N]",
    of_result=lambda found: (
        None if found.static_force is None else float(np.max(found.peak_force - found.static_force))
    ),
)

ALL = (
    Column("scene", "number of the scene", "int"),
    Column("backend", "backend", "str", "{}"),
    *_PARAMETERS,
    *FOUND_COLUMNS,
    Column("failure", "", "str"),
)

COLUMNS = tuple(column.name for column in ALL)  # of the table

_BY_NAME = {
    column.name: column
    for column in (*ALL, *_TERMS, _LAST_PEAK, CUT_OFF, *_FOUND_WITH_WALL, _FOUND_UNDER_LOAD)
}

_COUNTED = (*FOUND_COLUMNS, CUT_OFF)
COUNTS = tuple(column.name for column in _COUNTED if column.kind == "int")  # 0: missing
WHOLE = tuple(column.name for column in (*ALL, *_TERMS) if column.kind == "int")
TEXT = tuple(column.name for column in (*ALL, *_TERMS) if column.kind == "str")

FIRST_COLUMNS = ("first_peak_force_N", "arrival_time_s")


def peak_columns(columns: Sequence[Column]) -> tuple[str, ...]:
    """Return the columns of the table of peaks of a sweep; with terms they have first pulses."""
    known = ("scene", "backend", "contact", "peak_force_N", "peak_time_s")
    return known if columns is ALL else (*known, *FIRST_COLUMNS)


OTHER_MEASURE = {
    "shock.momentum_ratio": "shock.rise_time",
    "shock.rise_time": "shock.momentum_ratio",
}
"""Two measures of the length of a pulse; each follows from the other."""

IN_TITLES = (
    "shock.profile",
    "shock.duration_ratio",
    "shock.momentum_ratio",
    "shock.rise_time",
    "shock.peak_force",
    "chain.granules",
    *TERMS,
)
"""Parameters named in a title if they do not vary, in this order; others are named if fixed."""

_TITLES = {column.name: column.title for column in _BY_NAME.values() if column.title}

TITLES = {name: _TITLES[name] for name in dict.fromkeys((*IN_TITLES, *PARAMETERS, "backend"))}
"""Words of a title for values that are the same in all rows, in order."""


def column_named(name: str) -> Column:
    """Return the column of this name, also for segments of a chain."""
    if name in _BY_NAME:
        return _BY_NAME[name]
    if (gauge := _GAUGE.fullmatch(name)) is not None:
        return _of_gauge(int(gauge[1]), gauge[2])
    found = _SEGMENT.fullmatch(name)
    assert found is not None, name
    segment, place, key = found.groups()
    where = f"segment {segment}" + ("" if place is None else f", granule {place} of the cell")
    own = {"granules": "granules", "radius_ratio": "radius over that of the granule before"}
    label = own.get(key) or _BY_NAME[f"chain.{key}"].label
    kind = "int" if key == "granules" else "float"
    plain, _, unit = label.partition(" [")
    title = f"{plain}, {where}: {{:.4g}} {unit[:-1]}"
    return Column(name, f"{label}, {where}", kind, title.rstrip())


def is_whole(name: str) -> bool:
    """Return whether the values of a column are whole numbers."""
    return column_named(name).kind == "int"


def columns_of(
    scene: Mapping[str, Mapping[str, Any]], varied: Collection[str]
) -> tuple[Column, ...]:
    """Return the columns of the table of a sweep, from its scene and the varying parameters."""
    chain = scene["chain"]
    loaded, walled = "precompression" in scene, "wall" in scene
    unlike = "segments" in chain or any(isinstance(value, list) for value in chain.values())
    of_terms = any(name not in PARAMETERS for name in varied)
    held = any(section in scene for section in ("striker", "wall", "precompression", "contact"))
    profile = scene.get("shock", {}).get("profile", "")
    shock = OF_PROFILE.get(profile)
    held = held or (shock is not None and shock.is_driven)
    gauges = [
        _of_gauge(number, what)
        for number in range(1, len(scene.get("gauge", ())) + 1)
        for what in _OF_GAUGES
    ]
    if not (of_terms or unlike or "gap" in chain or held or gauges):
        return ALL
    kept = [name for name in PARAMETERS if name.partition(".")[0] in {*scene, "run"}]
    if shock is not None and shock.own_keys():
        own = {*_OF_EVERY_SHOCK, *(f"shock.{key}" for key in shock.own_keys())}
        kept = [name for name in kept if not name.startswith("shock.") or name in own]
    of_chain = [name for name in kept if name.startswith("chain.")]
    gap = ["chain.gap"] if isinstance(chain.get("gap"), float) or "chain.gap" in varied else []
    segments = [name for name in varied if _SEGMENT.fullmatch(name)]
    others = [
        name
        for name in TERMS
        if name in varied or (name != "chain.gap" and _has(scene, *name.split(".")))
    ]
    shock_and_run = [name for name in kept if name not in of_chain]
    parameters = (*of_chain, *gap, *segments, *shock_and_run[:-1], *others, shock_and_run[-1])
    return (
        *ALL[:2],
        *(column_named(name) for name in dict.fromkeys(parameters)),
        *_found(not (unlike or held), walled, loaded),
        *gauges,
        ALL[-1],
    )


def _has(scene: Mapping[str, Mapping[str, Any]], section: str, key: str) -> bool:
    return key in scene.get(section, {})


def _found(waves: bool, walled: bool, loaded: bool) -> tuple[Column, ...]:
    """Return result columns of scenes with terms; ``waves``: with those of uniform free chains."""
    found = [
        column
        for column in FOUND_COLUMNS
        if column.of_result is not None and (waves or column.name not in _OF_WAVES)
    ]
    at = [column.name for column in found].index("overlap_ratio")
    more = (_LAST_PEAK, *((_FOUND_UNDER_LOAD,) if loaded else ()))
    return (*found[:at], *more, *(_FOUND_WITH_WALL if walled else ()), CUT_OFF, *found[at:])
