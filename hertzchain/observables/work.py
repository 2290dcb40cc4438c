"""Work done on the chain by the applied force, from samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.observables import hermite
from hertzchain.observables.samples import Samples
from hertzchain.scene.pulse import Ramp

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def work_done(samples: Samples, ramp: Ramp) -> Any:
    """Integral of force times velocity of the first granule over a leg, in the ramp's units."""
    h = np.diff(samples.time)
    first = [values[:, 0] for values in samples.granule_derivatives]
    curve = hermite.coefficients([d[:-1] for d in first], [d[1:] for d in first], h)
    travelled = hermite.derivative(curve)  # velocity times h
    total = samples.time.dtype.type(0)
    for node, weight in zip((_NODES + 1) / 2, _WEIGHTS / 2, strict=True):
        force = ramp.force(samples.time[:-1] + node * h)
        total += weight * np.sum(force * hermite.evaluate(travelled, np.full_like(h, node)))
    return total
