"""Numbers that are known from elsewhere, found again by native and by LAMMPS."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import hertzchain as hc
from validation.physics import chains
from validation.rows import Row, row

SHORT = 50
"""Granules of the longest chain that LAMMPS runs in the quick form of a script."""


@dataclass(frozen=True)
class Number:
    """A known number, and how it is found in a result; formulas have no scene."""

    what: str
    value: float
    scene: hc.Scene | None
    measure: Callable[[Any], float]  # takes a result; None where there is no scene
    reason: str  # reason of the tolerances
    native: float  # tolerance
    lammps: float | None = None  # tolerance; None where LAMMPS is not asked


def peak_of(place: int, unit: float = 1.0) -> Callable[[hc.Result], float]:
    """The peak of the contact at a place, over a unit."""
    return lambda result: float(result.peak_force[place]) / unit


def velocity_of(granule: int, unit: float = 1.0) -> Callable[[hc.Result], float]:
    """The velocity of a granule at the end, over a unit."""
    return lambda result: float(result.velocity[granule - 1]) / unit


def duration_of(unit: float = 1.0) -> Callable[[hc.Result], float]:
    """The duration of a collision of two granules, over a unit: its peak is in the middle."""
    return lambda result: 2 * float(result.peak_time[0]) / unit


def compare_numbers(numbers: Iterable[Number], quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for numbers; in the quick form LAMMPS runs chains of at most SHORT granules."""

    @functools.cache
    def found(scene: hc.Scene) -> dict[str, hc.Result]:
        return chains.answers(scene, with_lammps and not (quick and scene.chain.granules > SHORT))

    rows = []
    for number in numbers:
        results: dict[str, Any] = {"native": None}
        if number.scene is not None:
            results = found(number.scene)
        for backend, result in results.items():
            limit = number.native if backend == "native" else number.lammps
            if limit is not None:
                measured = number.measure(result)
                rows.append(row(number.what, backend, measured, number.value, limit, number.reason))
    return rows
