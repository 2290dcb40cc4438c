"""The chain with some numbers of a deck in place of the scene's: what each costs the peaks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.compiling import compiled_and_kept
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene

_PIECE = 100_000  # steps between two looks at the clock: 0.1 s with 60 granules


@dataclass(frozen=True, eq=False)
class Stretch:
    """A run of a deck in equal steps [s].

    ``applied`` is the force on the granules that are pushed at the start and after each step [N],
    shape (steps + 1, pushed granules); ``driven`` the displacement of a piston at these times [m],
    else of shape (0,).
    """

    dt: float
    applied: FloatArray
    driven: FloatArray


class Twin(NamedTuple):
    """A chain with any numbers, which velocity Verlet integrates at the steps of a deck.

    Parameters
    ----------
    mass, velocity, constant_force, drag
        Of each granule [kg], [m/s], [N], [N s/m], shape (granules,).
    stiffness, exponent, opening
        k and p in F = k overlap^p of each contact, and the gap at the start [m], below 0 for an
        overlap; a wall at the far end is the last contact. Shape (contacts,).
    damping, damping_exponent, attraction
        c of each contact in c overlap^q d', q of all, and whether contacts may pull.
    pushed
        Granules on which the shock acts, counted from 0.
    """

    mass: FloatArray
    velocity: FloatArray
    constant_force: FloatArray
    drag: FloatArray
    stiffness: FloatArray
    exponent: FloatArray
    opening: FloatArray
    damping: FloatArray
    damping_exponent: float
    attraction: bool
    pushed: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TwinRun:
    """Peaks of a twin and how far its ends move against and along the chain [N, m]."""

    peak_force: FloatArray  # (contacts,)
    backwards: float
    forwards: float
    displacement: FloatArray  # (granules,), at the end
    velocity: FloatArray


def twin_of(scene: Scene) -> Twin:
    """The scene itself."""
    granules, count = scene.granules, scene.chain.granules
    contacts = granules.stiffness.size
    velocity = np.zeros(count)
    velocity[0] = scene.start_velocity
    contact = scene.contact
    return Twin(
        mass=granules.mass,
        velocity=velocity,
        constant_force=granules.constant_force,
        drag=np.zeros(count),
        stiffness=granules.stiffness,
        exponent=np.full(contacts, 1.5),
        opening=granules.gap - granules.static_overlap,
        damping=np.zeros(contacts) if granules.damping is None else granules.damping,
        damping_exponent=0.0 if contact is None else contact.exponent,
        attraction=contact is not None and contact.attraction,
        pushed=np.zeros(1, np.intp),
    )


def run_twin(twin: Twin, stretches: Iterable[Stretch], deadline: Deadline) -> TwinRun:
    """Integrate a twin; peaks are not finite where the motion diverges. Raises TooExpensive."""
    contacts = twin.stiffness.size
    force, reach = np.zeros(contacts), np.zeros(2)
    state = np.array([np.zeros_like(twin.velocity), twin.velocity])
    for stretch in stretches:
        steps = len(stretch.applied) - 1
        for first in range(0, max(steps, 1), _PIECE):
            if deadline.left <= 0:
                raise deadline.passed()
            _advance(
                twin, np.ascontiguousarray(stretch.applied[first : first + _PIECE + 1]),
                stretch.driven[first : first + _PIECE + 1],
                stretch.dt, state, force, reach,
            )  # fmt: skip
    if not np.all(np.isfinite(state)):
        force = np.full(contacts, np.nan)
    return TwinRun(force, float(-reach[0]), float(reach[1]), state[0], state[1])


@compiled_and_kept()
def _advance(  # noqa: PLR0912 - one loop over steps and contacts, as it is read
    twin: Twin,
    applied: FloatArray,
    driven: FloatArray,
    dt: float,
    state: FloatArray,
    force: FloatArray,
    reach: FloatArray,
) -> None:
    """Advance a twin by a stretch, or a piece of it.

    Changes ``state``, displacement and velocity of shape (2, granules), the largest ``force`` of
    each contact, and how far the first and last granule have moved against and along
    the chain (``reach``). Damping and drag take the velocity half a step before.
    """
    granules, contacts = twin.mass.size, twin.stiffness.size
    u, v = state[0], state[1]
    net = np.empty(granules)
    before, now = np.full(contacts, np.inf), np.full(contacts, np.inf)
    for step in range(applied.shape[0]):
        if step > 0:
            for i in range(granules):
                v[i] += 0.5 * dt * net[i] / twin.mass[i]
                u[i] += dt * v[i]
            if driven.size > 0:
                u[0], v[0] = driven[step], (driven[step] - driven[step - 1]) / dt
        for i in range(granules):
            net[i] = twin.constant_force[i] - twin.drag[i] * v[i]
        for k in range(twin.pushed.size):
            net[twin.pushed[k]] += applied[step, k]
        for i in range(contacts):
            free = i + 1 == granules  # the other side is a wall
            overlap = u[i] - twin.opening[i] - (0.0 if free else u[i + 1])
            pushed = 0.0
            if overlap > 0:
                pushed = twin.stiffness[i] * overlap ** twin.exponent[i]
                if twin.damping[i] != 0.0:
                    rate = v[i] - (0.0 if free else v[i + 1])
                    pushed += twin.damping[i] * overlap**twin.damping_exponent * rate
                    if pushed < 0 and not twin.attraction:
                        pushed = 0.0
                net[i] -= pushed
                if not free:
                    net[i + 1] += pushed
            top = pushed
            if now[i] >= before[i] and now[i] > pushed:  # of the parabola through three samples
                bend, slope = before[i] - 2 * now[i] + pushed, pushed - before[i]
                if bend < 0:
                    top = now[i] - slope * slope / (8 * bend)
            force[i] = max(force[i], top)
            before[i], now[i] = now[i], pushed
        if step > 0:
            for i in range(granules):
                if i > 0 or driven.size == 0:
                    v[i] += 0.5 * dt * net[i] / twin.mass[i]
        reach[0] = min(reach[0], u[0])
        reach[1] = max(reach[1], u[granules - 1])


def change_of_peaks(found: FloatArray, expected: FloatArray, judged: NDArray[np.bool_]) -> float:
    """Largest relative difference of the peaks that are judged; infinite without a number.

    All of shape (contacts,); ``found`` may lack the contact of a wall, or have one too many.
    """
    size = min(found.size, expected.size)
    found, expected, judged = found[:size], expected[:size], judged[:size]
    if not judged.any():
        return 0.0
    change = np.abs(found[judged] / expected[judged] - 1)
    return float(np.max(change)) if np.all(np.isfinite(change)) else float("inf")
