"""Chains whose contacts follow other laws than Eq. 1: damped, of another exponent, or pulling.

Nothing here is a result of hertzchain. It is what codes compute by mistake, so that their peaks can
be recognised. Natural units; many chains at once, in NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.cost import Deadline
from hertzchain.scene import Scene, watched_time

_STEP = 0.1
"""Natural time units. RK4 and a parabola through the highest samples leave some 1e-5 of the peaks,
most of which goes out against the chain of Eq. 1 that runs beside."""


@dataclass(frozen=True)
class Law:
    """A force between granules: overlap^exponent, and what hinders their motion.

    Parameters
    ----------
    exponent
        3/2 for Hertz; a multiple of 1/4.
    pulls
        Whether contacts pull as hard as they push.
    damped_by
        ``nothing``, ``contact`` (coefficient overlap^damping_exponent times the overlap rate, while
        granules touch) or ``drag`` (coefficient times the velocity of each granule).
    damping_exponent
        0 for a dashpot, 1/4 for Tsuji's damping, 1/2 for that of viscoelastic spheres.
    """

    exponent: float = 1.5
    pulls: bool = False
    damped_by: str = "nothing"
    damping_exponent: float = 0.0

    def forces(self, overlap: Array, rate: Array, damping: Array) -> tuple[Array, Array]:
        """Elastic force, and all of the force, in each contact."""
        pressed = np.maximum(overlap, 0.0)
        elastic = _power(pressed, self.exponent)
        if self.pulls:
            elastic = elastic - _power(np.maximum(-overlap, 0.0), self.exponent)
        if self.damped_by != "contact":
            return elastic, elastic
        scale = damping * _power(pressed, self.damping_exponent)
        return elastic, elastic + np.where(overlap > 0, scale, 0.0) * rate


HERTZ = Law()


def peaks(
    scene: Scene, law: Law, damping: FloatArray, stretched: FloatArray, deadline: Deadline
) -> tuple[FloatArray, FloatArray]:
    """Peaks of many chains under one law, elastic ones and those of the whole force, over F0.

    Parameters
    ----------
    scene
        Pulse and chain.
    law
        The force between granules; its stiffness is 1 in natural units.
    damping
        Coefficient of each chain, natural units, shape (chains,).
    stretched
        How many times as long the pulse of each chain is, shape (chains,).
    deadline
        When to give up.

    Returns
    -------
    Two of shape (chains, contacts); not finite where a motion diverged.

    Raises
    ------
    TooExpensive
        If that was not done by the deadline.
    """
    granules, unit = scene.chain.granules, scene.units.time
    pulse_end = scene.ramps[-1].end / unit * float(np.max(stretched))
    end = pulse_end + float(watched_time(granules, scene.momentum_ratio * np.min(stretched)))
    if scene.run.end_time is not None:
        end = scene.end_time / unit
    steps = int(np.ceil(end / _STEP))
    h = end / steps
    half = np.arange(2 * steps + 1)[:, np.newaxis] * h / 2
    applied = scene.applied_force(half * unit / stretched) / scene.units.force
    damping = damping[:, np.newaxis]
    drag = damping if law.damped_by == "drag" else 0.0

    def acceleration(u: Array, v: Array, force: Array) -> tuple[Array, tuple[Array, Array]]:
        known = law.forces(u[:, :-1] - u[:, 1:], v[:, :-1] - v[:, 1:], damping)
        net = np.empty_like(u)
        net[:, 0] = force
        net[:, 1:] = known[1]
        net[:, :-1] -= known[1]
        return net - drag * v, known

    u = np.zeros((stretched.size, granules))
    v = np.zeros_like(u)
    # The whole force is the elastic one where contacts are not damped.
    watches = [_Highest(u[:, 1:]) for _ in range(2 if law.damped_by == "contact" else 1)]
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(steps):
            if k % 100 == 0 and deadline.left < 0:
                raise deadline.passed()
            first, middle, last = applied[2 * k], applied[2 * k + 1], applied[2 * k + 2]
            a1, forces = acceleration(u, v, first)
            for watch, force in zip(watches, forces, strict=False):
                watch.show(force)
            v2 = v + h / 2 * a1
            a2, _ = acceleration(u + h / 2 * v, v2, middle)
            v3 = v + h / 2 * a2
            a3, _ = acceleration(u + h / 2 * v2, v3, middle)
            v4 = v + h * a3
            a4, _ = acceleration(u + h * v3, v4, last)
            u = u + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return np.asarray(watches[0].highest), np.asarray(watches[-1].highest)


class _Highest:
    """The highest value of each contact: of parabolas through three samples."""

    def __init__(self, like: Array) -> None:
        self.highest = np.zeros_like(like)
        self._before = self._now = self.highest

    def show(self, after: Array) -> None:
        """Take note of the next samples."""
        before, now = self._before, self._now
        bend, slope = before - 2 * now + after, after - before
        top = now - np.where(bend < 0, slope * slope / np.where(bend < 0, 8 * bend, 1.0), 0.0)
        turns = (now >= before) & (now > after)
        self.highest = np.maximum(self.highest, np.where(turns, top, after))
        self._before, self._now = now, after


def _power(value: Array, exponent: float) -> Array:
    """A power that is a multiple of 1/4, by roots, which take a tenth of the time."""
    whole, quarters = divmod(exponent, 1.0)
    found = np.ones_like(value)
    for _ in range(int(whole)):
        found = found * value
    if quarters in (0.5, 0.75):
        found = found * np.sqrt(value)
    return found * np.sqrt(np.sqrt(value)) if quarters in (0.25, 0.75) else found
