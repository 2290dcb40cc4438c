"""The chain with some numbers of a deck in place of the scene's: what each costs the peaks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene

_PIECE = 100_000  # steps between two looks at the clock: 0.1 s with 60 granules


@dataclass(frozen=True, eq=False)
class Stretch:
    """A run of a deck: ``steps`` equal steps from a time of the scene on [s].

    ``applied`` is the force on the granules that are pushed at the start and after each step [N],
    shape (steps + 1, pushed granules); ``driven`` the displacement of a piston at these times [m],
    else of shape (0,).
    """

    start: float
    dt: float
    applied: FloatArray
    driven: FloatArray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, eq=False)
class Twin:
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
    stretches
        The runs, with the force of the shock.
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
    stretches: tuple[Stretch, ...]


@dataclass(frozen=True, eq=False)
class TwinRun:
    """Peaks of a twin and how far its ends move against and along the chain [N, s, m]."""

    peak_force: FloatArray  # (contacts,)
    peak_time: FloatArray
    backwards: float
    forwards: float
    displacement: FloatArray  # (granules,), at the end
    velocity: FloatArray


def twin_of(scene: Scene, stretches: tuple[Stretch, ...]) -> Twin:
    """The scene itself at the steps of a deck; the force of the shock stands in the stretches."""
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
        stretches=stretches,
    )


def run_twin(twin: Twin, deadline: Deadline) -> TwinRun:
    """Integrate a twin; peaks are not finite where the motion diverges. Raises TooExpensive."""
    from hertzchain.verdict.deck import twin_kernel

    contacts = twin.stiffness.size
    force, at, reach = np.zeros(contacts), np.full(contacts, np.nan), np.zeros(2)
    state = np.array([np.zeros_like(twin.velocity), twin.velocity])
    for stretch in twin.stretches:
        steps = len(stretch.applied) - 1
        for first in range(0, max(steps, 1), _PIECE):
            if deadline.left <= 0:
                raise deadline.passed()
            twin_kernel.advance(
                state, twin.opening, twin.mass, twin.stiffness, twin.exponent, twin.damping,
                twin.damping_exponent, twin.attraction, twin.constant_force, twin.drag, twin.pushed,
                np.ascontiguousarray(stretch.applied[first : first + _PIECE + 1]),
                stretch.driven[first : first + _PIECE + 1],
                stretch.start + first * stretch.dt, stretch.dt, force, at, reach,
            )  # fmt: skip
    if not np.all(np.isfinite(state)):
        force = np.full(contacts, np.nan)
    return TwinRun(force, at, float(-reach[0]), float(reach[1]), state[0], state[1])


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


def effect(
    twin: Twin,
    expected: TwinRun,
    judged: NDArray[np.bool_],
    deadline: Deadline,
    **numbers: object,
) -> float:
    """How much some numbers of a deck, in place of the scene's, change the peaks at most."""
    return change_of_peaks(
        run_twin(replace(twin, **numbers), deadline).peak_force,  # type: ignore[arg-type]
        expected.peak_force,
        judged,
    )
