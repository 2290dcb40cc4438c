"""Velocity Verlet of damped contacts, compiled.

Forces are due before a step has its velocities: damping takes those of half a step, as LAMMPS forms
it, so that F is F(x(t), v(t - dt/2)).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import kernels
from hertzchain.engines.native.kernels import (
    END,
    ONE,
    START,
    STEPS,
    _applied_force,
    compiled,
    compiled_and_kept_with,
)


class Contacts(NamedTuple):
    """A chain of damped contacts, natural units; every array has shape (granules,).

    Contact i lies ahead of granule i; at a free end stiffness and damping of the last are 0.
    ``gap`` is below 0 for a static overlap, ``inertia`` is 1 / mass, ``pull`` the acceleration by
    constant forces, ``quarters`` 4 q.
    """

    stiffness: FloatArray
    damping: FloatArray
    gap: FloatArray
    inertia: FloatArray
    pull: FloatArray
    quarters: int
    attraction: bool


@compiled
def _evaluate(
    u: Any, v: Any, f: Any, a: Any, stiffness: Any, damping: Any, gap: Any, inertia: Any, pull: Any,
    quarters: int, least: float, granules: int,
) -> None:  # fmt: skip
    """Fill in the force of each contact, at least ``least``, and the accelerations."""
    for i in range(np.uint64(0), np.uint64(granules)):
        d = u[i] - u[i + ONE] - gap[i]
        pressed = 1.0 if d > 0.0 else 0.0
        d = d if d > 0.0 else 0.0
        root = np.sqrt(d)
        factor = pressed
        if quarters == 2:
            factor = root
        elif quarters == 1:
            factor = np.sqrt(root)
        force = stiffness[i] * d * root + damping[i] * factor * (v[i] - v[i + ONE])
        f[i + ONE] = force if force > least else least
    for i in range(np.uint64(0), np.uint64(granules)):
        a[i] = (f[i] - f[i + ONE]) * inertia[i] + pull[i]


@compiled_and_kept_with(kernels)
def take_steps(
    leg: FloatArray,
    done: int,
    last: int,
    stride: int,
    c: Contacts,
    u: FloatArray,
    v: FloatArray,
    f: FloatArray,
    a: FloatArray,
    into: FloatArray,
) -> None:
    """Take the steps of a leg from ``done`` to ``last``, and keep states.

    Parameters
    ----------
    leg
        A row of ``kernel_input.leg_rows``.
    done, last, stride
        Steps taken before, steps taken afterwards, and how many between two states that are kept.
    c
        The chain.
    u, v, f, a
        Displacement, velocity, force of contacts after the applied one, and acceleration now, shape
        (granules + 1,); changed. Forces are computed again at the start of a leg.
    into
        Filled with displacements, velocities, accelerations and forces of contacts: before the
        first step, after every ``stride``, and after the last; shape (states, 4, granules).
    """
    granules = c.inertia.size
    begin, end = leg[START], leg[END]
    h = (end - begin) / leg[STEPS]
    least = -np.inf if c.attraction else 0.0
    if done == 0:
        f[0] = _applied_force(leg, begin)
        _evaluate(
            u, v, f, a, c.stiffness, c.damping, c.gap, c.inertia, c.pull, c.quarters, least,
            granules,
        )  # fmt: skip
    kept = _keep(u, v, f, a, into, 0, granules)
    for step in range(done + 1, last + 1):
        for i in range(np.uint64(0), np.uint64(granules)):
            v[i] += h / 2 * a[i]
            u[i] += h * v[i]
        f[0] = _applied_force(leg, begin + step * h if step < leg[STEPS] else end)
        _evaluate(
            u, v, f, a, c.stiffness, c.damping, c.gap, c.inertia, c.pull, c.quarters, least,
            granules,
        )  # fmt: skip
        for i in range(np.uint64(0), np.uint64(granules)):
            v[i] += h / 2 * a[i]
        if (step - done) % stride == 0 or step == last:
            kept = _keep(u, v, f, a, into, kept, granules)


@compiled
def _keep(u: Any, v: Any, f: Any, a: Any, into: Any, kept: int, granules: int) -> int:
    """Keep a state; returns how many are kept now."""
    for i in range(granules):
        into[kept, 0, i], into[kept, 1, i] = u[i], v[i]
        into[kept, 2, i], into[kept, 3, i] = a[i], f[i + 1]
    return kept + 1
