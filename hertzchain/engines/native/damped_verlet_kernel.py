"""Velocity Verlet of damped contacts, compiled.

Forces are due before a step has its velocities: damping takes those of half a step, as LAMMPS forms
it, so that F is F(x(t), v(t - dt/2)).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.compiling import ONE, compiled, compiled_and_kept
from hertzchain.engines.native.elastic_chain import END, START, STEPS, applied_force
from hertzchain.engines.native.equations import Chain


@compiled
def _evaluate(u: Any, v: Any, f: Any, a: Any, c: Any, least: float) -> None:
    """Fill in the force of each contact, at least ``least``, and the accelerations."""
    granules = c.inverse_mass.size
    for i in range(np.uint64(0), np.uint64(granules)):
        d = u[i] - u[i + ONE] - c.gap[i]
        pressed = 1.0 if d > 0.0 else 0.0
        d = d if d > 0.0 else 0.0
        root = np.sqrt(d)
        factor = pressed
        if c.exponent == 0.5:
            factor = root
        elif c.exponent == 0.25:
            factor = np.sqrt(root)
        force = c.stiffness[i] * d * root + c.damping[i] * factor * (v[i] - v[i + ONE])
        f[i + ONE] = force if force > least else least
    for i in range(np.uint64(0), np.uint64(granules)):
        a[i] = (f[i] - f[i + ONE]) * c.inverse_mass[i] + c.constant[i]


@compiled_and_kept()
def take_steps(
    leg: FloatArray,
    done: int,
    last: int,
    stride: int,
    c: Chain,
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
        The chain, with an entry for the free end.
    u, v, f, a
        Displacement, velocity, force of contacts after the applied one, and acceleration now, shape
        (granules + 1,); changed. Forces are computed again at the start of a leg.
    into
        Filled with displacements, velocities, accelerations and forces of contacts: before the
        first step, after every ``stride``, and after the last; shape (states, 4, granules).
    """
    granules = c.inverse_mass.size
    begin, end = leg[START], leg[END]
    h = (end - begin) / leg[STEPS]
    least = -np.inf if c.attraction else 0.0
    if done == 0:
        f[0] = applied_force(leg, begin)
        _evaluate(u, v, f, a, c, least)
    kept = _keep(u, v, f, a, into, 0, granules)
    for step in range(done + 1, last + 1):
        for i in range(np.uint64(0), np.uint64(granules)):
            v[i] += h / 2 * a[i]
            u[i] += h * v[i]
        f[0] = applied_force(leg, begin + step * h if step < leg[STEPS] else end)
        _evaluate(u, v, f, a, c, least)
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
