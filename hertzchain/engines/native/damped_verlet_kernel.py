"""Velocity Verlet of any chain, compiled: the steps that LAMMPS takes.

Forces are due before a step has its velocities: damping and drag take those of half a step, as
LAMMPS forms them, so that F is F(x(t), v(t - dt/2)).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.observables.compiling import ONE, compiled, compiled_and_kept

_ROOTS = 0.0, 0.25, 0.5
"""Exponents of the dampers of scenes, for which no power has to be computed."""


class Walk(NamedTuple):
    """A chain that moves step by step, in any units.

    Parameters
    ----------
    chain
        The chain, with an entry for the free end.
    u, v, f, a, push
        Displacement, velocity, force of the contact behind, acceleration and applied force of each
        granule now, and an entry for the free end, shape (granules + 1,); changed by steps.
    pushed
        Granules on which forces are applied, counted from 0.
    power, drag
        The exponent of overlap in the law of each contact, with an entry for the free end, and the
        drag over velocity of each granule; both None for Hertz's contacts without drag, whose
        dampers have an exponent of a scene: the compiler makes vectors of their loops.
    """

    chain: Chain
    u: FloatArray
    v: FloatArray
    f: FloatArray
    a: FloatArray
    push: FloatArray
    pushed: NDArray[np.intp]
    power: FloatArray | None = None
    drag: FloatArray | None = None

    @classmethod
    def of(
        cls, chain: Chain, displacement: Any, velocity: Any, pushed: Any = (0,),
        power: FloatArray | None = None, drag: FloatArray | None = None,
    ) -> Walk:  # fmt: skip
        """Return a chain with all of its granules as they are at the start, (granules,) each."""
        u, v = (np.append(np.asarray(values, float), 0.0) for values in (displacement, velocity))
        if (
            power is None
            or drag is None
            or not (drag.any() or np.any(power != 1.5) or chain.exponent not in _ROOTS)
        ):
            power = drag = None
        else:
            power = np.append(power, np.full(v.size - 1 - power.size, 1.5))
        f, a, push = np.zeros((3, v.size))
        return cls(chain.padded(), u, v, f, a, push, np.array(pushed, np.intp), power, drag)


@compiled
def _evaluate(walk: Any, power: Any, drag: Any, least: float) -> None:
    """Fill in the force of each contact, at least ``least``, and the accelerations.

    ``power`` and ``drag`` are those of ``walk``: of an argument that is None the compiler drops the
    branches.
    """
    c, u, v, f, a = walk.chain, walk.u, walk.v, walk.f, walk.a
    granules = c.inverse_mass.size
    for i in range(np.uint64(0), np.uint64(granules)):
        d = u[i] - u[i + ONE] - c.gap[i]
        pressed = 1.0 if d > 0.0 else 0.0
        d = d if d > 0.0 else 0.0
        root = np.sqrt(d)
        elastic = c.stiffness[i] * d * root
        if power is not None and power[i] != 1.5:
            elastic = c.stiffness[i] * d ** power[i] if d > 0.0 else 0.0
        factor = pressed
        if c.exponent == 0.5:
            factor = root
        elif c.exponent == 0.25:
            factor = np.sqrt(root)
        elif power is not None and c.exponent != 0.0:
            factor = d**c.exponent if d > 0.0 else 0.0
        force = elastic + c.damping[i] * factor * (v[i] - v[i + ONE])
        f[i + ONE] = force if force > least else least
    for i in range(np.uint64(0), np.uint64(granules)):
        force = f[i] - f[i + ONE] + walk.push[i]
        if drag is not None:
            force -= drag[i] * v[i]
        a[i] = force * c.inverse_mass[i] + c.constant[i]


@compiled_and_kept()
def take_steps(
    walk: Walk, h: float, applied: FloatArray, led: FloatArray, stride: int, begins: bool,
    into: FloatArray,
) -> None:  # fmt: skip
    """Take equal steps, and keep states.

    ``h`` is the length of a step; ``applied`` are the forces on the pushed granules before the
    first step and after each, (steps + 1, pushed); ``led`` are displacements of a piston, shape
    (steps + 1,), or (0,) where they follow from its velocity, or without a piston. Where these
    steps ``begin`` a run, forces are computed before the first one. ``into`` is filled with
    displacements, velocities, accelerations and forces of contacts before the first step, after
    every ``stride``, and after the last; shape (4, states, granules).
    """
    u, v, a = walk.u, walk.v, walk.a
    granules, steps = walk.chain.inverse_mass.size, applied.shape[0] - 1
    least = -np.inf if walk.chain.attraction else 0.0
    kept = 0
    for step in range(steps + 1):
        if step > 0:
            for i in range(np.uint64(0), np.uint64(granules)):
                v[i] += h / 2 * a[i]
                u[i] += h * v[i]
            if led.size > 0:
                u[0], v[0] = led[step], (led[step] - led[step - 1]) / h
        if step > 0 or begins:
            for k in range(walk.pushed.size):
                walk.push[walk.pushed[k]] = applied[step, k]
            _evaluate(walk, walk.power, walk.drag, least)
        if step > 0:
            for i in range(np.uint64(0), np.uint64(granules)):
                v[i] += h / 2 * a[i]
        if step % stride == 0 or step == steps:
            for i in range(granules):
                into[0, kept, i], into[1, kept, i] = u[i], v[i]
                into[2, kept, i], into[3, kept, i] = a[i], walk.f[i + 1]
            kept += 1
