"""Steel chains, their simulation and natural units; known numbers and how they are measured."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import hertzchain as hc
from hertzchain.observables.samples import History
from validation.script import Row, row
from validation.shipped import STEEL

EXTRAPOLATED = "LAMMPS: two runs with steps of 0.01 natural time units and half of it, extrapolated"


def answers(
    scene: hc.Scene, with_lammps: bool, record: ArrayLike | None = None, step: float = 0.01
) -> dict[str, hc.Result]:
    """The result of each backend for a scene: native to 1e-9, LAMMPS extrapolated.

    With steps of 0.01 natural time units of the fastest contact, extrapolated peaks are right to
    about 1e-8.
    """
    results = {"native": hc.Native(rtol=1e-9).run(scene, record)}
    if with_lammps:
        lammps = hc.Lammps(step * scene.contact_time, extrapolated=record is None)
        results["lammps"] = lammps.run(scene, record)
    return results


def steel(granules: int, **different: Any) -> hc.Chain:
    """Return a chain of the paper's granules, or of different ones."""
    return hc.Chain(granules, **STEEL | different)


class Units(NamedTuple):
    """Units in which mass and contact stiffness of the steel granules, and a velocity, are 1."""

    force: float
    time: float


def units_of(velocity: float) -> Units:
    """The units of a velocity [m/s]."""
    chain = steel(2)
    mass, stiffness = chain.granule_mass, chain.contact_stiffness
    length = (mass * velocity**2 / stiffness) ** 0.4
    return Units(stiffness * length**1.5, length / velocity)


def crest(history: History, contact: int) -> float:
    """Height [N] of the largest force of a contact that was recorded.

    A parabola through the logarithms of the largest sample and its neighbours.
    """
    force = history.contact_force[:, contact]
    k = int(np.argmax(force))
    before, at, after = np.log(force[k - 1 : k + 2])
    shift = 0.5 * (before - after) / (before - 2 * at + after)
    return float(np.exp(at - 0.25 * (before - after) * shift))


# Known numbers

SHORT = 50
"""Granules of the longest chain that LAMMPS runs in the quick form of a script."""


@dataclass(frozen=True)
class Number:
    """A known number, and how it is measured in a result; formulas have no scene."""

    what: str
    value: float
    scene: hc.Scene | None
    measure: Callable[[Any], float]  # takes a result; None where there is no scene
    reason: str  # reason of the tolerances
    native: float  # tolerance
    lammps: float | None = None  # tolerance; None where LAMMPS does not run


def peak_of(place: int, unit: float = 1.0) -> Callable[[hc.Result], float]:
    """The peak of the contact at a place, over a unit."""
    return lambda result: float(result.peak_force[place]) / unit


def velocity_of(granule: int, unit: float = 1.0) -> Callable[[hc.Result], float]:
    """The velocity of a granule at the end, over a unit."""
    return lambda result: float(result.velocity[granule - 1]) / unit


def duration_of(unit: float = 1.0) -> Callable[[hc.Result], float]:
    """The duration of a collision of two granules, over a unit: its peak is in the middle."""
    return lambda result: 2 * float(result.peak_time[0]) / unit


def compare_numbers(numbers: Iterable[Number], quick: bool, with_lammps: bool) -> Iterator[Row]:
    """Yield rows for numbers; in the quick form LAMMPS runs chains of at most SHORT granules."""

    @functools.cache
    def simulated(scene: hc.Scene | None) -> dict[str, Any]:
        if scene is None:
            return {"native": None}
        return answers(scene, with_lammps and not (quick and scene.chain.granules > SHORT))

    for number in numbers:
        for backend, result in simulated(number.scene).items():
            limit = number.native if backend == "native" else number.lammps
            if limit is not None:
                measured = number.measure(result)
                yield row(number.what, backend, measured, number.value, limit, number.reason)
