"""Peaks of contacts and walls from readings of a deck's run, with the law that probes showed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.readings import contact_forces
from hertzchain.engines.lammps.reading.found import FoundWall
from hertzchain.engines.lammps.reading.probing import DEPTHS, Probes
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.samples import Samples
from hertzchain.observables.watch import PeakWatch

_SURE = 1e3  # rounding errors of a coordinate above which an overlap counts

_DAMPS = 1e-9  # fraction of a force that is above the rounding of a difference
_EXPONENTS = (0.0, 0.25, 0.5)
_NEAR = 1e-3  # by which an exponent found is one of these: rounding, and Hooke's contacts

_END = {"first": (0, -1.0), "last": (-1, 1.0)}
"""Place of the granule at an end of the chain, and the direction outwards."""


@dataclass(frozen=True, eq=False)
class PeaksSeen:
    """Peaks, overlaps without a force, shape (contacts,); relative error of the peaks."""

    force: FloatArray
    missed: FloatArray
    error: float

    @classmethod
    def unknown(cls, contacts: int) -> PeaksSeen:
        """Return the peaks of a deck that does not run: NaN."""
        nothing = np.full(contacts, np.nan)
        return cls(nothing, np.zeros(contacts), np.nan)


class ContactWatch:
    """Keeps the peaks of all contacts, from all readings and from every second.

    A wall across the chain counts as a granule at rest at that end: its contact is the first or the
    last.
    """

    def __init__(self, probes: Probes) -> None:
        granules = probes.granules
        self._radius, self._mass = granules.radius, granules.mass
        self._walls = probes.walls
        first = sum(wall.end == "first" for wall in probes.walls)
        self._ends = first, len(probes.walls) - first
        contacts = granules.count - 1 + sum(self._ends)
        self._law = law_of(probes, contacts)
        self._all, self._halved = (
            PeakWatch(self._law, self._padded(1 / self._mass)) for _ in range(2)
        )
        self._rest = np.finfo(np.float64).eps * float(np.max(np.abs(granules.position)))
        self._missed = np.zeros(contacts)  # largest overlap that grew without a force
        self._before: Samples | None = None

    def _padded(self, values: FloatArray) -> FloatArray:
        """Return values of granules, shape (..., granules), with 0 for walls."""
        return np.pad(values, (*[(0, 0)] * (values.ndim - 1), self._ends))

    def begin(self, free: NDArray[np.bool_]) -> None:
        """Begin a run, which may not continue the one before; its forces move ``free`` granules."""
        self._before = None
        for watch in (self._all, self._halved):
            watch.inverse_mass = self._padded(np.where(free, 1 / self._mass, 0.0))

    def take(
        self, time: FloatArray, late: FloatArray, place: FloatArray, velocity: FloatArray,
        acceleration: FloatArray, pairs: FloatArray, by_walls: FloatArray,
    ) -> float:  # fmt: skip
        """Add readings; return the largest force in open contacts.

        ``late`` is how long before it were the velocities that damped contacts then. Places have
        three components, all others that along the chain. A force of a wall at the first granule
        does not count.
        """
        along = place[..., 0]
        apart = np.linalg.norm(np.diff(place, axis=1), axis=-1)

        def deep(wall: FoundWall) -> FloatArray:
            at, sign = _END[wall.end]
            return np.asarray(self._radius[at] - sign * (wall.position - along[:, at]))

        def pushed(wall: FoundWall) -> FloatArray:
            at, sign = _END[wall.end]
            return np.asarray(-sign * by_walls[:, at])

        overlap = _columns(self._walls, self._radius[:-1] + self._radius[1:] - apart, deep)
        force = _columns(self._walls, contact_forces(pairs), pushed)
        touching = overlap > self._rest
        open_force = np.abs(np.where(touching, 0.0, force))[:, self._ends[0] :]
        force = np.where(touching, force, 0.0)
        samples = Samples(
            time=time,
            displacement=self._padded(along),
            velocity=self._padded(velocity),
            acceleration=self._padded(acceleration),
            overlap=overlap,
            contact_force=force,
        )
        _, rate, growth = samples.overlap_derivatives
        without = np.where((rate > 0) & (overlap > _SURE * self._rest) & (force <= 0), overlap, 0.0)
        self._missed = np.maximum(self._missed, without.max(axis=0, initial=0.0))
        if self._law.is_damped:
            felt = rate - late * growth
            known = self._law.with_rate(force, overlap, felt, rate)
            samples = replace(samples, contact_force=known)
        if self._before is not None:
            samples = _joined(self._before, samples)
        self._before = _part(samples, slice(-1, None))
        if samples.time.size > 1:
            self._all.update(samples)
            self._halved.update(_part(samples, _every_second(samples.time.size)))
        return float(np.max(open_force, initial=0.0))

    def seen(self, backwards: bool) -> PeaksSeen:
        """Return peaks for a chain that begins at either end; a wall's at the far end is last."""
        first, last = self._ends
        every = np.arange(self._missed.size)
        which = every[: every.size - last][::-1] if backwards else every[first:]
        force = self._all.force[which]
        error = self._all.reading_error
        counts = force > 1e-3 * np.max(force, initial=0.0)
        if np.any(counts):
            changes = np.abs(self._halved.force[which][counts] / force[counts] - 1)
            error = max(error, float(np.max(changes)))
        return PeaksSeen(force, self._missed[which], error)


def law_of(probes: Probes, contacts: int) -> DampedLaw:
    """Return the law of all contacts and walls in the deck's units; stiffness 1 if elastic."""
    elastic_law = DampedLaw.of_elastic(np.ones(contacts))
    at, walls = DEPTHS.index(1.0), probes.walls
    on_wall = at - 1  # no gap is probed there
    overlap = _columns(walls, probes.overlap[[at]], lambda wall: wall.overlap[[on_wall]])[0]
    elastic = _columns(walls, probes.contact_force[[at]], lambda wall: wall.force[[on_wall]])[0]
    closing = _columns(walls, probes.closing, lambda wall: wall.closing)
    deep = _columns(walls, probes.damped_overlap, lambda wall: wall.damped_overlap)
    force = _columns(walls, probes.damped_force, lambda wall: wall.damped_force)
    if overlap.size == 0:
        return elastic_law
    with np.errstate(divide="ignore", invalid="ignore"):
        stiffness = np.nan_to_num(elastic / overlap**1.5)
        # Approach at the same speed, with the larger and with the smaller overlap.
        added = [force[k] - stiffness * deep[k] ** 1.5 for k in (0, 2)]
        is_damped = added[0] > _DAMPS * elastic
        if not np.any(is_damped):
            return elastic_law
        found = np.log(added[0] / added[1]) / np.log(deep[0] / deep[2])
        exponent = float(np.median(found[is_damped & np.isfinite(found)]))
    exponent = next((known for known in _EXPONENTS if abs(known - exponent) < _NEAR), exponent)
    coefficient = np.where(is_damped, added[0] / (closing[0] * deep[0] ** exponent), 0.0)
    return DampedLaw(
        stiffness,
        np.nan_to_num(coefficient, posinf=0.0, neginf=0.0),
        exponent,
        bool(np.any(force < 0)),
    )


def _columns(
    walls: Sequence[FoundWall],
    of_contacts: FloatArray,
    of_wall: Callable[[FoundWall], FloatArray],
) -> FloatArray:
    """Return values of contacts, (n, contacts), between those of walls, (n,), at either end."""
    first, last = ([of_wall(wall) for wall in walls if wall.end == end] for end in _END)
    return np.column_stack([*first, of_contacts, *last])


def _every_second(count: int) -> list[int]:
    kept = list(range(0, count, 2))
    return kept if kept[-1] == count - 1 else [*kept, count - 1]


_ARRAYS = ("time", "displacement", "velocity", "acceleration", "overlap", "contact_force")


def _part(samples: Samples, which: slice | list[int]) -> Samples:
    return Samples(*(getattr(samples, name)[which] for name in _ARRAYS))


def _joined(*parts: Samples) -> Samples:
    return Samples(*(np.concatenate([getattr(p, name) for p in parts]) for name in _ARRAYS))
