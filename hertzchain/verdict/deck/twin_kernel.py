"""Velocity Verlet of chains with any numbers, compiled: the loop of ``twin``."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.kernels import compiled_and_kept


@compiled_and_kept
def advance(  # noqa: PLR0912 - one loop over steps and contacts, as it is read
    state: FloatArray,
    opening: FloatArray,
    mass: FloatArray,
    stiffness: FloatArray,
    exponent: FloatArray,
    damping: FloatArray,
    damping_exponent: float,
    attraction: bool,
    constant: FloatArray,
    drag: FloatArray,
    sources: Any,
    applied: FloatArray,
    driven: FloatArray,
    time: float,
    dt: float,
    force: FloatArray,
    force_time: FloatArray,
    reach: FloatArray,
) -> None:
    """Advance a chain by one run of equal steps, SI units.

    ``state`` is displacement and velocity, shape (2, granules); ``opening`` that of each contact at
    the start [m], below 0 for an overlap, the last contact that of a wall where there are as many
    as granules. ``applied`` is the force on the granules ``sources`` at the start and after each
    step, shape (steps + 1, sources), ``driven`` the displacement of granule 1 then, if it is a
    piston, else of shape (0,). Damping and drag take the velocity half a step before. Fills
    in the largest ``force`` of each contact, its time, and how far the first and last granule have
    moved against and along the chain (``reach``).
    """
    granules, contacts = mass.size, stiffness.size
    u, v = state[0], state[1]
    net = np.empty(granules)
    before, now = np.full(contacts, np.inf), np.full(contacts, np.inf)
    for step in range(applied.shape[0]):
        if step > 0:
            for i in range(granules):
                v[i] += 0.5 * dt * net[i] / mass[i]
                u[i] += dt * v[i]
            if driven.size > 0:
                u[0], v[0] = driven[step], (driven[step] - driven[step - 1]) / dt
        for i in range(granules):
            net[i] = constant[i] - drag[i] * v[i]
        for k in range(sources.size):
            net[sources[k]] += applied[step, k]
        for i in range(contacts):
            free = i + 1 == granules  # the other side is a wall
            overlap = u[i] - opening[i] - (0.0 if free else u[i + 1])
            pushed = 0.0
            if overlap > 0:
                elastic = stiffness[i] * overlap ** exponent[i]
                pushed = elastic
                if damping[i] != 0.0:
                    rate = v[i] - (0.0 if free else v[i + 1])
                    pushed += damping[i] * overlap**damping_exponent * rate
                    if pushed < 0 and not attraction:
                        pushed = 0.0
                net[i] -= pushed
                if not free:
                    net[i + 1] += pushed
            top, at = pushed, time + step * dt
            if now[i] >= before[i] and now[i] > pushed:  # of the parabola through three samples
                bend, slope = before[i] - 2 * now[i] + pushed, pushed - before[i]
                if bend < 0:
                    top = now[i] - slope * slope / (8 * bend)
                    at -= dt * (1 + slope / (2 * bend))
            if top > force[i]:
                force[i], force_time[i] = top, at
            before[i], now[i] = now[i], pushed
        if step > 0:
            for i in range(granules):
                if i > 0 or driven.size == 0:
                    v[i] += 0.5 * dt * net[i] / mass[i]
        reach[0] = min(reach[0], u[0])
        reach[1] = max(reach[1], u[granules - 1])
