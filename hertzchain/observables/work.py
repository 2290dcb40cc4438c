"""Work of the applied force, from samples; contacts of walls and fixed granules."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables import hermite
from hertzchain.observables.samples import Samples
from hertzchain.scene.ramp import Ramp

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def work_done(samples: Samples, ramp: Ramp, pushed: int = 0) -> Any:
    """Return the integral of force times velocity of a granule over a leg, in the ramp's units.

    ``pushed`` is the granule, counted from 0.
    """
    h = np.diff(samples.time)
    its = [values[:, pushed] for values in samples.granule_derivatives]
    curve = hermite.coefficients([d[:-1] for d in its], [d[1:] for d in its], h)
    travelled = hermite.derivative(curve)  # velocity times h
    total = samples.time.dtype.type(0)
    for node, weight in zip((_NODES + 1) / 2, _WEIGHTS / 2, strict=True):
        force = ramp.force(samples.time[:-1] + node * h)
        total += weight * np.sum(force * hermite.evaluate(travelled, np.full_like(h, node)))
    return total


def times_on_held(contacts: int, has_wall: bool, fixed: Any) -> FloatArray:
    """Return how often each contact force counts in the force on all held bodies, (contacts,).

    Held bodies are a wall, and the ``fixed`` granules, counted from 0.
    """
    times = np.zeros(contacts)
    times[-1] += has_wall
    times[fixed[fixed > 0] - 1] += 1
    times[fixed[fixed < contacts]] -= 1
    return times
