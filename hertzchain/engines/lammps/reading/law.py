"""The law of damped contacts as LAMMPS's answers show it, to interpolate between readings."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundWall
from hertzchain.engines.lammps.reading.prober import DEPTHS
from hertzchain.engines.lammps.reading.probing import Probes
from hertzchain.observables.damped_law import DampedLaw

_DAMPS = 1e-9  # of a force: above what is lost in the difference of two
_EXPONENTS = (0.0, 0.25, 0.5)
_SURE = 1e-3  # by which an exponent found is one of these: rounding, and Hooke's contacts


def law_of(probes: Probes, wall: FoundWall | None) -> DampedLaw | None:
    """The law of all contacts, that with a wall the last, in the deck's units; None if elastic."""
    at = DEPTHS.index(1.0)
    overlap, elastic = probes.overlap[at], probes.contact_force[at]
    damped = probes.closing, probes.damped_overlap, probes.damped_force
    if wall is not None:
        on_wall = at - 1  # no gap is tried there
        overlap = np.append(overlap, wall.overlap[on_wall])
        elastic = np.append(elastic, wall.force[on_wall])
        columns = wall.closing, wall.damped_overlap, wall.damped_force
        damped = tuple(  # type: ignore[assignment]
            np.column_stack([known, own]) for known, own in zip(damped, columns, strict=True)
        )
    closing, deep, force = damped
    if overlap.size == 0:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        stiffness = np.nan_to_num(elastic / overlap**1.5)
        # Approaching with one speed, at the larger and at the smaller overlap.
        added = [force[k] - stiffness * deep[k] ** 1.5 for k in (0, 2)]
        is_damped = added[0] > _DAMPS * elastic
        if not np.any(is_damped):
            return None
        found = np.log(added[0] / added[1]) / np.log(deep[0] / deep[2])
        exponent = float(np.median(found[is_damped & np.isfinite(found)]))
    exponent = next((known for known in _EXPONENTS if abs(known - exponent) < _SURE), exponent)
    coefficient = np.where(is_damped, added[0] / (closing[0] * deep[0] ** exponent), 0.0)
    return DampedLaw(stiffness, _finite(coefficient), exponent, bool(np.any(force < 0)))


def _finite(values: FloatArray) -> FloatArray:
    return np.asarray(np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0))
