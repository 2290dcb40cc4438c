"""Samples: the state of the chain at successive times, its contact forces, and its history."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.limits import refuse_memory
from hertzchain.scene import hertz
from hertzchain.scene.chain import NaturalUnits
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

Places = slice | NDArray[np.integer] | int
"""Some of the contacts."""


@dataclass(frozen=True, eq=False)
class Samples:
    """States of a chain at the ends of successive intervals on one leg, in the backend's own units.

    Overlaps are stored, because a backend knows them to more digits than differences of
    displacements.
    """

    time: FloatArray  # increasing, shape (samples,)
    displacement: FloatArray  # shape (samples, granules), as velocity and acceleration
    velocity: FloatArray
    acceleration: FloatArray
    overlap: FloatArray  # shape (samples, contacts), negative where there is a gap
    contact_force: FloatArray  # shape (samples, contacts); with a wall its contact is the last
    jerk: FloatArray | None = None  # rate of the acceleration, as it, where known

    @property
    def granule_derivatives(self) -> tuple[FloatArray, ...]:
        """Displacement and its time derivatives, as many as are known."""
        derivatives = (self.displacement, self.velocity, self.acceleration)
        return derivatives if self.jerk is None else (*derivatives, self.jerk)

    @property
    def overlap_derivatives(self) -> tuple[FloatArray, ...]:
        """Overlap and its time derivatives, as many as are known."""
        contacts = self.overlap.shape[1]
        return (self.overlap, *(closing(d, contacts) for d in self.granule_derivatives[1:]))

    @cached_property
    def of_contacts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times, overlaps and three derivatives, (4, samples, contacts), and forces: for kernels.

        Derivatives that are not known are NaN.
        """
        force = np.ascontiguousarray(self.contact_force)
        return self.time, _of_four(self.overlap_derivatives), force

    def of_granules(self, which: slice = slice(None)) -> tuple[FloatArray, FloatArray]:
        """Times, displacements and three derivatives of some granules, (4, samples, granules)."""
        return self.time, _of_four([values[:, which] for values in self.granule_derivatives])


def _of_four(derivatives: Sequence[FloatArray]) -> FloatArray:
    return np.array([*derivatives, np.full_like(derivatives[0], np.nan)][:4])


def closing(values: FloatArray, contacts: int) -> FloatArray:
    """Return the changes of overlaps from the motions of granules, shape (samples, contacts).

    The motions have the shape (samples, granules). If there are as many contacts as granules, the
    last contact is that with a wall, which does not move.
    """
    between = values[:, :-1] - values[:, 1:]
    if contacts == between.shape[1]:
        return between
    return np.concatenate([between, values[:, -1:]], axis=1)


@dataclass(frozen=True, eq=False)
class DampedLaw:
    """Force law F = k d^(3/2) + c d^q d' of contacts that overlap; 0 for open contacts.

    Parameters
    ----------
    stiffness, damping
        k and c of each contact, shape (contacts,).
    damping_exponent
        q of all contacts.
    attraction
        Whether F may be negative; if not, negative values are set to 0.
    """

    stiffness: FloatArray
    damping: FloatArray
    damping_exponent: float
    attraction: bool

    @classmethod
    def of(cls, scene: Scene) -> DampedLaw:
        """Return the law of the contacts of a scene, in SI units; elastic ones have c = 0."""
        granules, contact = scene.granules, scene.contact
        if contact is None:
            return cls.of_elastic(granules.stiffness)
        assert granules.damping is not None
        return cls(granules.stiffness, granules.damping, contact.exponent, contact.attraction)

    @classmethod
    def of_elastic(cls, stiffness: FloatArray) -> DampedLaw:
        """Return the law of elastic contacts."""
        return cls(stiffness, np.zeros_like(stiffness), 0.5, attraction=False)

    def in_units(self, units: NaturalUnits) -> DampedLaw:
        """Return the same law with all quantities in other units."""
        per_rate = units.velocity * units.length**self.damping_exponent / units.force
        return replace(
            self,
            stiffness=self.stiffness * (units.length**1.5 / units.force),
            damping=self.damping * per_rate,
        )

    def signals(
        self, static: FloatArray | None = None, pairs: Sequence[tuple[int, int]] = ()
    ) -> NDArray[np.void]:
        """Return the signals of all contacts, then of gauges in granules: see ``observer.SIGNAL``.

        ``static`` is the static force of each contact, 0 by default; ``pairs`` are the places of
        both contacts of each gauge; -1: it has one only. All is in the units of the law.
        """
        from hertzchain.observables.observer import FALLS, SIGNAL

        contacts = self.stiffness.size
        static = np.zeros(contacts) if static is None else static
        alone = np.stack([np.arange(contacts), np.full(contacts, -1)], axis=1)
        contact, other = np.concatenate([alone, np.reshape(np.array(pairs, np.int64), (-1, 2))]).T
        signals = np.zeros(contact.size, SIGNAL)
        has_other = other >= 0
        signals["contact"], signals["other"] = contact, other
        signals["weight"] = np.where(np.arange(contact.size) >= contacts, 0.5, 1.0)
        signals["fallen"] = len(FALLS)
        for name, values in (("stiffness", self.stiffness), ("damping", self.damping)):
            signals[name] = values[contact]
            signals[f"other_{name}"] = np.where(has_other, values[other], 0.0)
        held = static[contact] + np.where(has_other, static[other], 0.0)
        signals["static"] = signals["weight"] * held
        signals["damping_exponent"], signals["attracts"] = self.damping_exponent, self.attraction
        return signals

    def elastic(self, overlap: FloatArray, contacts: Places = slice(None)) -> FloatArray:
        """Elastic force without damping; the last axis of the overlaps has some or all contacts."""
        return np.asarray(hertz.force_of(self.stiffness[contacts], overlap))

    @cached_property
    def is_damped(self) -> bool:
        """Whether any contact loses energy."""
        return bool(self.damping.any())

    def damper(
        self, overlap: FloatArray, rate: FloatArray, contacts: Places = slice(None)
    ) -> FloatArray:
        """Force that damping adds to the elastic force; rates have the shape of the overlaps."""
        added = self.damping[contacts] * self._power(overlap) * rate
        if self.attraction:
            return np.asarray(added)
        return np.asarray(np.maximum(added, -self.elastic(overlap, contacts)))

    def _power(self, overlap: FloatArray) -> FloatArray:
        """Powers of overlaps with the exponent of damping; 0 for open contacts."""
        pressed = np.maximum(overlap, 0.0)
        if self.damping_exponent == 0:
            return np.where(overlap > 0, 1.0, 0.0)
        return (
            np.sqrt(np.sqrt(pressed))
            if self.damping_exponent == 0.25
            else pressed**self.damping_exponent
        )

    def force(
        self, overlap: FloatArray, rate: FloatArray, contacts: Places = slice(None)
    ) -> FloatArray:
        """Total force of contacts, limited to 0 where contacts do not attract."""
        return self.elastic(overlap, contacts) + self.damper(overlap, rate, contacts)

    def with_rate(
        self, force: FloatArray, overlap: FloatArray, felt: FloatArray, rate: FloatArray
    ) -> FloatArray:
        """Convert forces that a backend computed with the rate ``felt`` to the rate ``rate``.

        All arrays have the shape (samples, contacts). Velocity Verlet computes forces before it has
        the velocity of that time; codes use the velocity half a step earlier.
        """
        total = force + (self.force(overlap, rate) - self.force(overlap, felt))
        return total if self.attraction else np.maximum(total, 0.0)


def true_forces(samples: Samples, law: DampedLaw, leg: Leg) -> Samples:
    """Return samples of velocity Verlet whose forces use the velocities of the samples.

    The given samples have forces computed with the velocities half a step earlier, as in LAMMPS. At
    the start of a leg, where forces are computed again, the velocities of that time are used.
    """
    overlap, rate, growth = samples.overlap_derivatives[:3]
    late = np.where(samples.time > leg.start, leg.dt / 2, 0.0)[:, np.newaxis]
    force = law.with_rate(samples.contact_force, overlap, rate - late * growth, rate)
    return replace(samples, contact_force=force)


@dataclass(frozen=True, eq=False)
class History:
    """Histories that a run recorded, in SI units.

    Parameters
    ----------
    time
        Requested times [s], shape (times,).
    displacement, velocity
        Displacement [m] and its slope [m/s], shape (times, granules). The velocities of velocity
        Verlet itself are central differences; they differ from the slope by dt^2/6 times the jerk.
    contact_force
        Force of each contact [N], shape (times, contacts); that of a near wall is the first, that
        of a wall the last.
    """

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    contact_force: FloatArray


MOST_FRAMES = 1_000_000
"""Largest number of frames that can be asked for (chosen): 1.4 GB for 60 granules."""


def wanted_times(record: ArrayLike, end_time: float) -> FloatArray:
    """Return the times of a history [s], shape (times,), from a number of frames or from times.

    SceneError for fewer than two frames, or unless the times increase and lie within the run.
    """
    if isinstance(record, Integral) and not isinstance(record, bool):
        allowed = f"must be from 2 to {MOST_FRAMES:,} frames, or increasing times [s]"
        require(2 <= record <= MOST_FRAMES, "record", record, allowed)
        return np.linspace(0.0, end_time, int(record))
    allowed = f"must be increasing times from 0 to the end of the run, {end_time} s"
    allowed += ", or a whole number of frames"
    try:
        time = np.atleast_1d(np.asarray(record, np.float64))
    except (TypeError, ValueError):
        raise SceneError("record", record, allowed) from None
    require(time.ndim == 1 and time.size > 0, "record", record, allowed)
    increasing = bool(np.all(np.diff(time) > 0))
    require(increasing and time[0] >= 0 and time[-1] <= end_time, "record", record, allowed)
    return time


class Recorder:
    """Fills a history from samples, at wanted times that increase, in the units of the samples.

    Where there is a wall, the last contact is the one with the wall.
    """

    def __init__(self, time: FloatArray, granules: int, wall: bool = False) -> None:
        self.time = np.asarray(time)
        refuse_memory(8.0 * 3 * self.time.size * granules)
        self.displacement = np.full((self.time.size, granules), np.nan)
        self.velocity = np.full((self.time.size, granules), np.nan)
        self.contact_force = np.full((self.time.size, granules - 1 + wall), np.nan)

    def update(self, samples: Samples, signals: NDArray[np.void]) -> None:
        """Interpolate at the wanted times that lie within these samples.

        ``signals`` are those of the contacts: see ``DampedLaw.signals``.
        """
        from hertzchain.observables.intervals import forces_at, motion_at

        wanted = np.nonzero((self.time >= samples.time[0]) & (self.time <= samples.time[-1]))[0]
        if not wanted.size:
            return
        part = slice(wanted[0], wanted[-1] + 1)
        times, moved = self.time[part], (self.displacement[part], self.velocity[part])
        motion_at(times, *samples.of_granules(), *moved)
        forces_at(signals, times, *samples.of_contacts, self.contact_force[part])

    def history(
        self, time: FloatArray, length: float = 1.0, velocity: float = 1.0, force: float = 1.0,
        first: int = 0,
    ) -> History:  # fmt: skip
        """Return the history in SI units.

        Arguments are the units of the samples in SI, and the place of granule 1 in them.
        """
        motion = self.displacement[:, first:] * length, self.velocity[:, first:] * velocity
        return History(time, *motion, self.contact_force * force)
