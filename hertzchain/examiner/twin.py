"""The chain with some numbers of a deck in place of the scene's: their effect on the peaks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped_verlet import states_of
from hertzchain.engines.native.damped_verlet_kernel import Walk
from hertzchain.engines.native.equations import Chain
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene

_BLOCK = 2048
"""States that are processed together: with 20 granules fewer would cost as much as the steps."""


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

    Arrays have the shape (granules,) or (contacts,); a wall at the far end is the last contact.
    """

    mass: FloatArray  # [kg]
    velocity: FloatArray  # [m/s]
    constant_force: FloatArray  # [N]
    drag: FloatArray  # [N s/m]
    stiffness: FloatArray  # k and p in F = k overlap^p
    exponent: FloatArray
    opening: FloatArray  # gap at the start [m], below 0 for an overlap
    damping: FloatArray  # c in c overlap^q d'
    damping_exponent: float  # q of all contacts
    attraction: bool  # whether contacts may pull
    pushed: NDArray[np.intp]  # granules on which the shock acts, counted from 0


@dataclass(frozen=True, eq=False)
class TwinRun:
    """Peaks of a twin [N], and how far its ends move against and along the chain [m]."""

    peak_force: FloatArray  # (contacts,)
    backwards: float
    forwards: float
    displacement: FloatArray  # (granules,), at the end
    velocity: FloatArray


def twin_of(scene: Scene) -> Twin:
    """Return the twin of the scene itself."""
    granules, count = scene.granules, scene.bodies
    contacts = granules.stiffness.size
    contact = scene.contact
    return Twin(
        mass=granules.mass,
        velocity=granules.velocity,
        constant_force=granules.constant_force,
        drag=np.zeros(count),
        stiffness=granules.stiffness,
        exponent=np.full(contacts, 1.5),
        opening=granules.gap - granules.static_overlap,
        damping=np.zeros(contacts) if granules.damping is None else granules.damping,
        damping_exponent=0.0 if contact is None else contact.exponent,
        attraction=contact is not None and contact.attraction,
        pushed=np.array([scene.pushed]),
    )


def run_twin(twin: Twin, stretches: Iterable[Stretch], deadline: Deadline) -> TwinRun:
    """Integrate a twin; peaks are not finite where the motion diverges. Raises TooExpensive."""
    contacts, granules = twin.stiffness.size, twin.mass.size
    stretches = tuple(stretches)
    inverse_mass = 1 / twin.mass
    if stretches and stretches[0].driven.size:  # as in all others
        inverse_mass[0] = 0.0
    chain = Chain(
        twin.stiffness, inverse_mass, twin.opening, twin.constant_force * inverse_mass,
        twin.damping, twin.damping_exponent, twin.attraction,
    )  # fmt: skip
    walk = Walk.of(chain, np.zeros(granules), twin.velocity, twin.pushed, twin.exponent, twin.drag)
    force, backwards, forwards = np.zeros(contacts), 0.0, 0.0
    for one in stretches:
        before = np.full((1, contacts), np.inf)
        steps, force_at = len(one.applied) - 1, one.applied.__getitem__
        run = states_of(walk, one.dt, steps, force_at, deadline, led=one.driven, block=_BLOCK)
        for _, states in run:
            if not np.all(np.isfinite(states[:, -1])):
                none = np.full(contacts, np.nan)
                return TwinRun(none, backwards, forwards, walk.u[:-1], walk.v[:-1])
            seen = np.concatenate([before, states[3, :, :contacts]])
            force, before = np.maximum(force, _highest(seen)), seen[-2:-1]
            backwards = max(backwards, float(-np.min(states[0, :, 0])))
            forwards = max(forwards, float(np.max(states[0, :, -1])))
    return TwinRun(force, backwards, forwards, walk.u[:-1], walk.v[:-1])


def _highest(force: FloatArray) -> FloatArray:
    """The highest force of each contact, by a parabola where one lies between its neighbours.

    Forces have the shape (samples, contacts); the first sample, which may be infinite, is only a
    neighbour.
    """
    before, now, after = force[:-2], force[1:-1], force[2:]
    top = force[1:].max(axis=0)
    at = np.nonzero((now >= before) & (now > after))
    slope, bend = after[at] - before[at], before[at] - 2 * now[at] + after[at]
    np.maximum.at(top, at[1], now[at] - slope**2 / (8 * bend))
    return np.asarray(top)


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
