"""The granules of a user's deck as LAMMPS has them, along any axis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import IntArray
from hertzchain.engines.lammps.reading.session import DeckFix, Readings, Session
from hertzchain.engines.lammps.reading.units import Units, units_of
from hertzchain.errors import RunFailed


@dataclass(frozen=True, eq=False)
class Granules:
    """Granules by increasing coordinate along the chain, in the deck's units.

    ``order`` sorts arrays from the order of ids into this order. Vectors have the component
    along the chain first, shape (granules, 3): ``frame`` has the directions of the components as
    its rows.
    """

    units: Units
    frame: FloatArray
    order: NDArray[np.intp]
    ids: IntArray  # in the order of ids, as readings have them
    types: IntArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    radius: FloatArray
    mass: FloatArray
    low: FloatArray  # the box in these directions; along a diagonal where the axis leaves it
    high: FloatArray
    boundary: str  # along x, y and z, as ``s f f`` or ``fs p p``
    periodic: list[bool]  # in these directions

    @property
    def count(self) -> int:
        """Number of granules."""
        return int(self.radius.size)

    @property
    def sides(self) -> str:
        """Boundary of the box at both ends of the axis that is nearest to the chain."""
        return self.boundary.split()[int(np.argmax(np.abs(self.frame[0])))]

    @property
    def reach(self) -> FloatArray:
        """Sum of the radii of each contact, shape (contacts,)."""
        return np.asarray(self.radius[:-1] + self.radius[1:])

    def along(self, vectors: FloatArray) -> FloatArray:
        """Vectors of granules by id, shape (..., granules, 3), in this order and these axes."""
        return np.asarray(vectors[..., self.order, :] @ self.frame.T)

    def by_id(self, vectors: FloatArray) -> FloatArray:
        """Vectors of granules in this order and these axes, (granules, 3), by id and x, y, z."""
        each = np.empty_like(vectors)
        each[self.order] = vectors @ self.frame
        return each

    @property
    def off_axis(self) -> FloatArray:
        """Distance of each granule from the axis, which runs through the middle of all [length]."""
        across = self.position[:, 1:]
        return np.asarray(np.linalg.norm(across - np.median(across, axis=0), axis=1))

    @property
    def is_chain(self) -> bool:
        """Whether at most a quarter of the granules lie off one axis; these count as misplaced."""
        return 4 * int(np.count_nonzero(self.off_axis > self.radius)) <= self.count

    def moved_from(self, place: FloatArray) -> FloatArray:
        """Coordinates, shape (..., granules, 3), nearest to the start across a periodic box."""
        span = np.where(self.periodic, self.high - self.low, np.inf)
        shift = place - self.position
        with np.errstate(invalid="ignore"):
            turns = np.where(np.isinf(span), 0.0, np.round(shift / span) * span)
        return np.asarray(place - turns)


_STATE = (
    "id", "type", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz", "radius", "mass",
)  # fmt: skip


def granules_of(lammps: Session) -> Granules:
    """Return the granules that LAMMPS has now; RunFailed if it has none, or points."""
    name, sides = lammps.system()
    units = units_of(name)
    if lammps.count() == 0:
        raise RunFailed("the deck has made no granules when it runs for the first time")
    ids, types, *vectors, radius, mass = lammps.dumped(*_STATE)
    place, velocity, spin = (np.column_stack(vectors[k : k + 3]) for k in (0, 3, 6))
    low, high = lammps.box()
    first = int(np.argmax(np.ptp(place, axis=0)))
    chosen = [first, *(k for k in range(3) if k != first)]
    made = Granules(
        units=units,
        frame=np.eye(3)[chosen],
        order=np.arange(len(place)),
        ids=ids.astype(np.int64),
        types=types.astype(np.int64),
        position=place,
        velocity=velocity,
        spin=spin,
        radius=radius,
        mass=mass,
        low=low[chosen],
        high=high[chosen],
        boundary=" ".join(sides),
        periodic=[sides[k] == "p" for k in chosen],
    )
    straight = _turned(made, made.frame)
    if straight.is_chain or len(place) < _FEWEST:
        return straight
    diagonal = _turned(made, _along(place))
    if not diagonal.is_chain:
        return straight
    along, ends = diagonal.frame[0], place[diagonal.order[[0, -1]]]
    room = []
    for end, way in ((ends[0], -along), (ends[1], along)):
        leaves = np.abs(way) > _PARALLEL  # through the sides of the box in that direction
        to_side = np.where(way > 0, high - end, low - end)
        room.append(float(np.min(to_side[leaves] / way[leaves])))
    inside = diagonal.position[[0, -1], 0] + np.array([-1, 1]) * room
    return replace(
        diagonal,
        low=np.append(inside[0], low[:2]),
        high=np.append(inside[1], high[:2]),
        periodic=[False] * 3,  # images of a diagonal are not its neighbours
    )


def by_fix(
    lammps: Session, readings: Readings, granules: Granules
) -> Iterator[tuple[DeckFix, FloatArray]]:
    """Force of each fix, in the order and along the axes of the chain, (readings, granules, 3)."""
    forces = np.moveaxis(readings.of_fixes, 1, 0)
    for source, force in zip([*lammps.hooks.values()][1:], forces, strict=True):
        assert source is not None
        yield lammps.fixes[source], granules.along(force)


def members(lammps: Session, group: str, granules: Granules) -> NDArray[np.bool_]:
    """Tell which granules are in a group now, by increasing coordinate, shape (granules,)."""
    return np.asarray(lammps.members(group)[granules.order])


_PARALLEL = 1e-9  # component of a direction that is round-off (chosen)
_FEWEST = 3  # least number of granules on a diagonal: two granules may also be misplaced


def _turned(made: Granules, frame: FloatArray) -> Granules:
    """Granules in LAMMPS's order and axes, in their order along the first direction of a frame."""
    place = made.position @ frame.T
    order = np.argsort(place[:, 0], kind="stable")
    each = {name: getattr(made, name)[order] for name in ("types", "radius", "mass")}
    vectors = {name: (getattr(made, name) @ frame.T)[order] for name in ("velocity", "spin")}
    return replace(made, frame=frame, order=order, position=place[order], **each, **vectors)


def _along(place: FloatArray) -> FloatArray:
    """Return directions; the places extend along the first, its largest component is positive."""
    frame = np.linalg.svd(place - np.mean(place, axis=0), full_matrices=False)[2]
    frame[0] *= np.sign(frame[0, int(np.argmax(np.abs(frame[0])))])
    return np.asarray(frame)
