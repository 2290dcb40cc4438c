"""Work done on the chain by the applied force, and impulses of contacts, from samples."""

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


def contact_impulse(samples: Samples, contact: int) -> float:
    """Return the time integral of a contact's force: contact 0 is a piston's.

    Four Gauss points in each interval: the overlap is interpolated, and the force is that of the
    end with the larger overlap times the ratio of overlaps to the power 3/2. Where the contact
    opens or closes within an interval, the points lie in the touching part alone.
    """
    h = np.diff(samples.time)
    its = [values[:, contact] for values in samples.overlap_derivatives]
    curve = hermite.coefficients([d[:-1] for d in its], [d[1:] for d in its], h)
    overlap, force = its[0], samples.contact_force[:, contact]
    later = overlap[1:] > overlap[:-1]
    pressed = np.where(later, overlap[1:], overlap[:-1])
    known = np.where(later, force[1:], force[:-1])
    touching = (pressed > 0) & (known > 0)
    open_at = openings(curve, touching & (np.minimum(overlap[1:], overlap[:-1]) < 0), later)
    begin = np.where(later, open_at, 0.0)
    length = np.where(later, 1.0, open_at) - begin
    total = 0.0
    for node, weight in zip((_NODES + 1) / 2, _WEIGHTS / 2, strict=True):
        # Distances from the opening are squares of the node: the force, their power 3/2, is then
        # smooth in the node.
        whole = length == 1.0
        share = np.where(whole, node, node * node)
        place = begin + length * np.where(later, share, 1 - share)
        between = np.maximum(hermite.evaluate(curve, place), 0.0)
        ratio = np.where(touching, between, 0.0) / np.where(touching, pressed, 1.0)
        worth = weight * h * length * np.where(whole, 1.0, 2 * node)
        total += float(np.sum(worth * known * ratio * np.sqrt(ratio)))
    return total


def times_on_held(contacts: int, has_wall: bool, fixed: Any) -> FloatArray:
    """Return how often the force of each contact counts in that on all that is held, (contacts,).

    Held are a wall, and ``fixed`` granules, counted from 0.
    """
    times = np.zeros(contacts)
    times[-1] += has_wall
    times[fixed[fixed > 0] - 1] += 1
    times[fixed[fixed < contacts]] -= 1
    return times


def openings(curve: Any, crossing: Any, later: Any) -> Any:
    """Return the s in [0, 1] where overlaps that are ``crossing`` pass 0, shape (intervals,).

    For other intervals return 0 where the end has the larger overlap, and 1 where the start has it.
    """
    found = np.where(later, 0.0, 1.0)
    if not np.any(crossing):
        return found
    part, rising = curve[:, crossing], later[crossing]
    low, high = np.zeros(rising.size), np.ones(rising.size)
    for _ in range(53):  # bisections: to the last digit
        middle = (low + high) / 2
        before = (hermite.evaluate(part, middle) > 0) != rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    found[crossing] = (low + high) / 2
    return found
