"""Similarity of many uniform chains at once: their natural units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.scene.chain import granule_mass
from hertzchain.scene.natural_units import MOMENTUM_IN_NATURAL_UNITS, length_and_time
from hertzchain.scene.schedule import watched_time

_PLAIN = 1e200  # numbers between it and its inverse are far from the limits of floating point


@dataclass(frozen=True, eq=False)
class Natural:
    """Similarity of scenes; arrays of shape (scenes,), NaN for pulse tables."""

    length: FloatArray  # natural unit [m]
    time: FloatArray  # natural unit [s]
    momentum_ratio: FloatArray  # LM_ratio, given or from t0
    rise_time: FloatArray  # t0 [s]
    duration: FloatArray  # until every contact has peaked [natural units]
    is_moderate: NDArray[np.bool_]  # derived numbers are far from the limits of floats


def natural(given: Mapping[str, NDArray[Any]]) -> Natural:
    """Return the natural units of scenes from the parameters that ``Design.parameters`` returns."""
    radius, force = given["chain.radius"], given["shock.peak_force"]
    ratio, rise = given["shock.momentum_ratio"], given["shock.rise_time"]
    n = given["shock.duration_ratio"]
    with np.errstate(all="ignore"):
        stiffness = hertz.stiffness_of_equals(
            radius, given["chain.young_modulus"], given["chain.poisson_ratio"]
        )
        mass = granule_mass(radius, given["chain.density"])
        length, time = length_and_time(stiffness, mass, force)
        unit = 2 * MOMENTUM_IN_NATURAL_UNITS * time / n  # the rise time at LM_ratio 1
        by_ratio = np.isnan(rise)
        ratio, rise = np.where(by_ratio, ratio, rise / unit), np.where(by_ratio, ratio * unit, rise)
        duration = n * rise / time + watched_time(given["chain.granules"], ratio)
        derived = (radius**3, stiffness, mass, force, length, time, time**2, mass * length, ratio)
        is_moderate = np.isfinite(duration)
        for values in (*derived, rise, length / time, force * time, force * length):
            is_moderate &= (values > 1 / _PLAIN) & (values < _PLAIN)
    return Natural(length, time, ratio, rise, duration, is_moderate)
