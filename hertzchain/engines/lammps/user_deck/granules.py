"""The granules of somebody's deck as LAMMPS has them, along whichever axis they lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.user_deck.found import IntArray
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

    def moved_from(self, place: FloatArray) -> FloatArray:
        """Coordinates, shape (..., granules, 3), nearest to the start across a periodic box."""
        span = np.where(self.periodic, self.high - self.low, np.inf)
        shift = place - self.position
        with np.errstate(invalid="ignore"):
            turns = np.where(np.isinf(span), 0.0, np.round(shift / span) * span)
        return np.asarray(place - turns)


def granules_of(lammps: Any, boundary: str) -> Granules:
    """The granules that LAMMPS has now; RunFailed where it has none, or points."""
    units = units_of(str(lammps.extract_global("units")))
    count = int(lammps.extract_setting("nlocal"))
    if count == 0:
        raise RunFailed("the deck has made no granules when it runs for the first time")
    if not lammps.extract_setting("radius_flag"):
        raise RunFailed("the granules have no radius: take atom_style sphere")
    arrays = lammps.numpy
    ids = np.array(arrays.extract_atom("id")[:count], dtype=np.int64)
    by_id = np.argsort(ids)

    def each(name: str) -> FloatArray:
        return np.array(arrays.extract_atom(name)[:count], dtype=np.float64)[by_id]

    types = np.array(arrays.extract_atom("type")[:count], dtype=np.int64)[by_id]
    place = each("x")
    mass = each("rmass") if lammps.extract_setting("rmass_flag") else _by_type(lammps, types)
    low, high, _, _, _, periodic, _ = lammps.extract_box()
    extent = np.ptp(place, axis=0)
    first = int(np.argmax(extent))
    axes = (first, *(k for k in range(3) if k != first))
    order = np.argsort(place[:, first], kind="stable")
    chosen = list(axes)
    return Granules(
        units=units,
        axes=(axes[0], axes[1], axes[2]),
        order=order,
        ids=ids[by_id],
        types=types[order],
        position=place[order][:, chosen],
        velocity=each("v")[order][:, chosen],
        spin=each("omega")[order][:, chosen],
        radius=each("radius")[order],
        mass=mass[order],
        low=np.array(low)[chosen],
        high=np.array(high)[chosen],
        boundary=boundary,
        periodic=tuple(bool(periodic[k]) for k in axes),  # type: ignore[arg-type]
    )


def _by_type(lammps: Any, types: IntArray) -> FloatArray:
    masses = lammps.numpy.extract_atom("mass")
    return np.array([float(np.ravel(masses)[number]) for number in types])
