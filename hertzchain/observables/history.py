"""History: displacement, velocity and contact force at wanted times, interpolated."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.limits import refuse_memory
from hertzchain.observables.samples import Samples


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

    def update(self, samples: Samples, signals: Any) -> None:
        """Interpolate at the wanted times that lie within these samples.

        ``signals`` are those of the contacts: see ``observer.signals_of``.
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
