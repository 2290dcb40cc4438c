"""Chains with wrong contact laws instead of Eq. 1, in natural units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene
from hertzchain.scene.watching import watched_time

_STEP = 0.1  # natural time units: error 1e-5 of the peaks, mostly the same as with Eq. 1


@dataclass(frozen=True)
class Law:
    """A force between granules, overlap^exponent, with damping or drag."""

    exponent: float = 1.5  # 3/2 for Hertz; a multiple of 1/4
    pulls: bool = False  # whether contacts pull as hard as they push
    # damping of contacts: overlap^damping_exponent times the rate; drag: velocity
    damped_by: str = "nothing"
    damping_exponent: float = 0.0  # 0: dashpot, 1/4: Tsuji, 1/2: viscoelastic spheres


HERTZ = Law()

_LOOK = 1_000_000  # granules times steps between two checks of the deadline: about 20 ms


def peaks(
    scene: Scene, law: Law, damping: FloatArray, stretched: FloatArray, deadline: Deadline
) -> tuple[FloatArray, FloatArray]:
    """Peaks of many chains under one law over F0: of the elastic force and of the whole force.

    Both have the shape (chains, contacts), not finite where a motion diverged. ``damping`` and
    ``stretched`` have a coefficient, in natural units with stiffness 1, and a factor of the pulse's
    duration for each chain, shape (chains,). Raises TooExpensive if they are not done by the
    deadline.
    """
    from hertzchain.verdict import law_kernel

    granules, unit = scene.chain.granules, scene.units.time
    pulse_end = scene.ramps[-1].end / unit * float(np.max(stretched))
    end = pulse_end + float(watched_time(granules, scene.momentum_ratio * np.min(stretched)))
    if scene.run.end_time is not None:
        end = scene.end_time / unit
    steps = int(np.ceil(end / _STEP))
    h = end / steps
    half = np.arange(2 * steps + 1)[:, np.newaxis] * h / 2
    applied = scene.applied_force(half * unit / stretched) / scene.units.force
    damped_by = law_kernel.DAMPED_BY.index(law.damped_by)
    damping_quarters = round(4 * law.damping_exponent)
    state = np.zeros((stretched.size, law_kernel.ROWS, granules))
    piece = max(1, _LOOK // granules)
    for chain in range(stretched.size):
        force = np.ascontiguousarray(applied[:, chain])
        for k in range(0, steps, piece):
            if deadline.left < 0:
                raise deadline.passed()
            law_kernel.advance(
                state[chain], force[2 * k : 2 * min(k + piece, steps) + 1], h,
                round(4 * law.exponent), law.pulls, damped_by, damping_quarters, damping[chain],
            )  # fmt: skip
    # Without damping the whole force is the elastic one.
    whole = law_kernel.WHOLE if law.damped_by == "contact" else law_kernel.ELASTIC
    return state[:, law_kernel.ELASTIC, :-1], state[:, whole, :-1]
