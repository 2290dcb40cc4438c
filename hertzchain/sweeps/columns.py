"""The columns of a sweep: one entry each, read by its tables, plots and files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.theory.peak_map import PEAK_ERROR

if TYPE_CHECKING:
    from hertzchain.engines.native import Batch
    from hertzchain.observables.result import Result
    from hertzchain.theory import Prediction


@dataclass(frozen=True, eq=False)
class BatchFound:
    """Similar scenes that were measured together, in SI; arrays of shape (scenes,)."""

    batch: Batch  # the same in natural units
    near: FloatArray  # F_SW [N]
    far: FloatArray  # far-field force [N]
    speed: FloatArray  # of the solitary wave [m/s]
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
    title: str = ""  # how a title says a value that is the same in all rows
    of_result: Callable[[Result], float | None] | None = None
    of_prediction: Callable[[Prediction], float | None] | None = None
    of_batch: Callable[[BatchFound], Any] | None = None


_PARAMETERS = (
    Column("chain.granules", "granules N", "int", "{} granules"),
    Column("chain.radius", "radius R [m]", title="R = {:.4g} m"),
    Column("chain.young_modulus", "Young's modulus E [Pa]", title="E = {:.4g} Pa"),
    Column("chain.poisson_ratio", "Poisson's ratio", title="Poisson's ratio {:.4g}"),
    Column("chain.density", "density [kg/m³]", title="{:.4g} kg/m³"),
    Column("shock.profile", "profile", "str", "{} pulse"),
    Column("shock.peak_force", "F0 [N]", title="F0 = {:.4g} N"),
    Column("shock.duration_ratio", "n", title="n = {:.4g}"),
    Column("shock.momentum_ratio", "LM_ratio", title="LM_ratio = {:.4g}"),
    Column("shock.rise_time", "rise time t0 [s]", title="t0 = {:.4g} s"),
    Column("run.end_time", "end of the run [s]", title="until {:.4g} s"),
)

PARAMETERS = tuple(column.name for column in _PARAMETERS)  # what can vary, as in scene files

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
        "speed_m_s",
        "wave speed [m/s]",
        of_result=lambda found: found.solitary_wave.speed,
        of_prediction=lambda found: None if found.speed is None else found.speed.exact,
        of_batch=lambda found: found.speed,
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
"""What is found, in the order of the table, behind the parameters."""

ALL = (
    Column("scene", "number of the scene", "int"),
    Column("backend", "backend", "str", "{}"),
    *_PARAMETERS,
    *FOUND_COLUMNS,
    Column("failure", "", "str"),
)

COLUMNS = tuple(column.name for column in ALL)  # of the table

COUNTS = tuple(column.name for column in FOUND_COLUMNS if column.kind == "int")  # 0: missing

WHOLE = tuple(column.name for column in ALL if column.kind == "int")
TEXT = tuple(column.name for column in ALL if column.kind == "str")

LABELS = {column.name: column.label for column in ALL if column.label}  # on an axis
PEAK_COLUMNS = ("scene", "backend", "contact", "peak_force_N", "peak_time_s")  # table of peaks

OTHER_MEASURE = {
    "shock.momentum_ratio": "shock.rise_time",
    "shock.rise_time": "shock.momentum_ratio",
}
"""Either says how long a pulse lasts, and follows from the other."""

IN_TITLES = (
    "shock.profile",
    "shock.duration_ratio",
    "shock.momentum_ratio",
    "shock.rise_time",
    "shock.peak_force",
    "chain.granules",
)
"""Parameters that a title names where they do not vary, in this order; others where fixed."""

_TITLES = {column.name: column.title for column in ALL if column.title}

TITLES = {name: _TITLES[name] for name in dict.fromkeys((*IN_TITLES, *PARAMETERS, "backend"))}
"""Words of a title for what is the same in all rows, in order."""
