"""Work of the applied force, from samples; contacts of walls and fixed granules."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.samples import Samples
from hertzchain.scene.ramp import Ramp

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def work_done(samples: Samples, ramp: Ramp, pushed: int = 0) -> float:
    """Return the integral of force times velocity of a granule over a leg, in the ramp's units.

    ``pushed`` is the granule, counted from 0.
    """
    from hertzchain.observables.intervals import motion_at

    h = np.diff(samples.time)[:, np.newaxis]
    times = np.ravel(samples.time[:-1, np.newaxis] + (_NODES + 1) / 2 * h)
    displacement, velocity = np.zeros((2, times.size, 1))
    motion_at(times, *samples.of_granules(slice(pushed, pushed + 1)), displacement, velocity)
    return float(np.sum(np.ravel(_WEIGHTS / 2 * h) * ramp.force(times) * velocity[:, 0]))


def times_on_held(contacts: int, has_wall: bool, fixed: Any) -> FloatArray:
    """Return how often each contact force counts in the force on all held bodies, (contacts,).

    Held bodies are a wall, and the ``fixed`` granules, counted from 0.
    """
    times = np.zeros(contacts)
    times[-1] += has_wall
    times[fixed[fixed > 0] - 1] += 1
    times[fixed[fixed < contacts]] -= 1
    return times
