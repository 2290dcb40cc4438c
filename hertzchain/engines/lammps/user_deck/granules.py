"""The granules of somebody's deck as LAMMPS has them, along whichever axis they lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.user_deck.found import IntArray
from hertzchain.engines.lammps.user_deck.session import Session
from hertzchain.engines.lammps.user_deck.units import Units, units_of
from hertzchain.errors import RunFailed


@dataclass(frozen=True, eq=False)
class Granules:
    """Granules by increasing coordinate along the chain, in the deck's units.

    ``order`` takes what stands in the order of ids into this order. Vectors have the component
    along the chain first, shape (granules, 3), as ``axes`` says.
    """

    units: Units
    axes: tuple[int, int, int]
    order: NDArray[np.intp]
    ids: IntArray  # in the order of ids, as readings have them
    types: IntArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    radius: FloatArray
    mass: FloatArray
    low: FloatArray  # the box, along the axes
    high: FloatArray
    boundary: str  # as the deck gives it, along x, y and z
    periodic: tuple[bool, bool, bool]  # along the axes

    @property
    def count(self) -> int:
        """Number of granules."""
        return int(self.radius.size)

    @property
    def reach(self) -> FloatArray:
        """Sum of the radii of each contact, shape (contacts,)."""
        return np.asarray(self.radius[:-1] + self.radius[1:])

    def along(self, vectors: FloatArray) -> FloatArray:
        """Vectors of granules by id, shape (..., granules, 3), in this order and these axes."""
        return np.asarray(vectors[..., self.order, :][..., list(self.axes)])

    def by_id(self, vectors: FloatArray) -> FloatArray:
        """Vectors of granules in this order and these axes, (granules, 3), by id and x, y, z."""
        found = np.empty_like(vectors)
        found[self.order[:, np.newaxis], list(self.axes)] = vectors
        return found

    def moved_from(self, place: FloatArray) -> FloatArray:
        """Coordinates, shape (..., granules, 3), nearest to the start across a periodic box."""
        span = np.where(self.periodic, self.high - self.low, np.inf)
        shift = place - self.position
        with np.errstate(invalid="ignore"):
            turns = np.where(np.isinf(span), 0.0, np.round(shift / span) * span)
        return np.asarray(place - turns)


def granules_of(lammps: Session, boundary: str) -> Granules:
    """The granules that LAMMPS has now; RunFailed where it has none, or points."""
    units = units_of(lammps.units())
    if lammps.count() == 0:
        raise RunFailed("the deck has made no granules when it runs for the first time")
    each = lammps.atoms()
    low, high, periodic = lammps.box()
    place = each["x"]
    first = int(np.argmax(np.ptp(place, axis=0)))
    second, third = (k for k in range(3) if k != first)
    chosen = [first, second, third]
    order = np.argsort(place[:, first], kind="stable")
    return Granules(
        units=units,
        axes=(first, second, third),
        order=order,
        ids=each["id"],
        types=each["type"][order],
        position=place[order][:, chosen],
        velocity=each["v"][order][:, chosen],
        spin=each["omega"][order][:, chosen],
        radius=each["radius"][order],
        mass=each["mass"][order],
        low=low[chosen],
        high=high[chosen],
        boundary=_sure(boundary, periodic),
        periodic=(periodic[first], periodic[second], periodic[third]),
    )


def _sure(boundary: str, periodic: list[bool]) -> str:
    """The boundary as the deck gives it, or as the box says where that came from a restart file."""
    words = boundary.split()
    if [word == "p" for word in words] == periodic:
        return boundary
    return " ".join("p" if flag else "f" for flag in periodic)
