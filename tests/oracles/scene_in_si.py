"""A scene as numbers in SI units, for solvers that share no line with the package.

Masses, stiffnesses, dampers, gaps, loads and drive come from radii, materials and the keys of the
scene; of a pulse, only the corners are the package's.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import hertzchain as hc

Floats = NDArray[np.float64]


class Numbers(NamedTuple):
    """A chain, in any units: granules first, then contacts, a wall's last.

    A near wall is a granule that never moves, in front of all, with the first contact.
    """

    inverse_mass: Floats  # 0 for a piston
    constant: Floats  # acceleration of each granule
    stiffness: Floats
    gap: Floats  # negative for a static overlap
    damping: Floats
    exponent: float  # q
    attraction: bool
    length: float  # what overlaps and errors are compared with
    time: float  # of the fastest contact
    pushed: int = 0  # granule on which the applied force acts, from 0


def numbers_of(scene: hc.Scene) -> Numbers:
    """Masses, stiffnesses, dampers, gaps and loads from radii and materials, SI units."""
    size, chain, wall, law = scene.chain.granules, scene.chain, scene.wall, scene.contact
    near = scene.near_wall
    radius, modulus, nu, density = _materials(scene)
    mass = density * 4 * math.pi / 3 * radius**3
    if chain.mass is not None:
        mass = np.array(np.broadcast_to(chain.mass, size), float)
    soft = (1 - nu**2) / modulus
    stiffness = 4 / 3 / (soft[:-1] + soft[1:]) / np.sqrt(1 / radius[:-1] + 1 / radius[1:])
    if chain.stiffness is not None:
        stiffness = np.array(np.broadcast_to(chain.stiffness, size), float)[1:]
    gap = np.array(np.broadcast_to(chain.gap, size), np.float64)[1:]
    is_held = np.array(np.broadcast_to(chain.fixed, size))
    fixed = is_held.copy()
    is_held[0] |= isinstance(scene.shock, hc.Piston)
    inverse_mass = np.where(is_held, 0.0, 1 / mass)
    contact_mass = 1 / (inverse_mass[:-1] + inverse_mass[1:])
    if wall is not None:
        stiffness = np.append(stiffness, _on_plane(wall, soft[-1], radius[-1]))
        gap, contact_mass = np.append(gap, wall.gap), np.append(contact_mass, mass[-1])
    pressed = scene.precompression
    force, gravity = (0.0, 0.0) if pressed is None else (pressed.force, pressed.gravity)
    flies = isinstance(scene.shock, hc.Striker) and not scene.shock.loaded
    carried, static = 0.0, np.zeros(stiffness.size)
    for k in range(int(flies), stiffness.size):
        carried += gravity * mass[k] + (force if k == flies else 0.0)
        if fixed[k]:
            carried = 0.0
        static[k] = carried
    constant = np.full(size, float(gravity))
    if force:
        constant[int(flies)] += force / mass[int(flies)]
    if wall is None and not fixed.any():
        constant[-1] -= force / mass[-1]
    constant[is_held] = 0.0
    if near is not None:  # it presses granule 1 as a load would
        constant[0] -= force / mass[0]
        inverse_mass, constant = np.append(0.0, inverse_mass), np.append(0.0, constant)
        stiffness = np.append(_on_plane(near, soft[0], radius[0]), stiffness)
        gap, contact_mass = np.append(near.gap, gap), np.append(mass[0], contact_mass)
        static = np.append(force, static)
    exponent, damping = _dampers(law, contact_mass, stiffness)
    if near is not None and (near.restitution or near.relaxation_time or near.coefficient):
        damping[0] = _dampers(near, contact_mass, stiffness)[1][0]
    if wall is not None and (wall.restitution or wall.relaxation_time or wall.coefficient):
        damping[-1] = _dampers(wall, contact_mass, stiffness)[1][-1]
    largest = max(float(np.max(static)), scene.peak_force, scene.force_at_start)
    length = (largest / float(np.max(stiffness))) ** (2 / 3)
    shortest = math.sqrt(float(np.min(contact_mass / stiffness)) / math.sqrt(length))
    return Numbers(
        inverse_mass, constant, stiffness, gap - (static / stiffness) ** (2 / 3),
        damping, exponent, law is not None and law.attraction, length, shortest,
        scene.shock.granule - 1 + (near is not None),
    )  # fmt: skip


def _materials(scene: hc.Scene) -> list[Floats]:
    """Radius, modulus, Poisson's ratio and density of each granule."""
    columns = {
        name: np.array(np.broadcast_to(getattr(scene.chain, name), scene.chain.granules), float)
        for name in ("radius", "young_modulus", "poisson_ratio", "density")
    }
    if isinstance(scene.shock, hc.Striker):
        for name, values in columns.items():
            value = getattr(scene.shock, name)
            if value is not None:
                values[0] = value
    return list(columns.values())


def _on_plane(wall: hc.Wall, soft: float, radius: float) -> float:
    """A of a granule on a wall; ``soft`` is its (1 - nu^2) / E."""
    if wall.stiffness is not None:
        return wall.stiffness
    other = {
        "rigid": 0.0,
        "same": soft,
        "elastic": (1 - (wall.poisson_ratio or 0) ** 2) / (wall.young_modulus or 1),
    }[wall.kind]
    return 4 / 3 / (soft + other) * math.sqrt(radius)


def _dampers(law: Any, contact_mass: Floats, stiffness: Floats) -> tuple[float, Floats]:
    """q, and c of each contact, from the numbers of [contact] or [wall]."""
    if law is not None and law.restitution is not None:
        log = math.log(law.restitution)
        alpha = -math.sqrt(5) * log / math.hypot(math.pi, log)
        return 0.25, alpha * np.sqrt(contact_mass * stiffness)
    if law is not None and law.relaxation_time is not None:
        return 0.5, 1.5 * law.relaxation_time * stiffness
    return 0.0, np.full(stiffness.size, 0.0 if law is None else law.coefficient)


def start_of(scene: hc.Scene) -> Floats:
    """Displacement and velocity at the start, shape (2, granules), those of a near wall first."""
    start = np.zeros((2, scene.chain.granules))
    start[1] = scene.chain.velocity
    if scene.near_wall is not None:
        return np.pad(start, ((0, 0), (1, 0)))
    if isinstance(scene.shock, hc.Striker | hc.Piston):
        start[1, 0] = scene.shock.start_velocity
    return start


def numbers_of_chain(chain: Any, time: float) -> Numbers:
    """The numbers of a chain in natural units; ``time`` is that of its fastest contact."""
    return Numbers(
        chain.inverse_mass, chain.constant, chain.stiffness, chain.gap, chain.damping,
        chain.damping_exponent, chain.attraction, 1.0, time,
    )  # fmt: skip


def pieces_of(scene: hc.Scene) -> Floats:
    """Start, force there, end and force there, and shape of each piece of the applied force.

    Shapes are 0 for none, 1 for a line, 2 for half a cosine (Eq. 2); 3 is a sine, with amplitude
    and frequency in place of the forces. Pieces of a piston are those of its strokes.
    """
    shock = scene.shock
    if isinstance(shock, hc.HalfSine):
        pieces = [(0.0, shock.peak_force, shock.duration, 0.5 / shock.duration, 3.0)]
    elif isinstance(shock, hc.Sine):
        pieces = [(0.0, shock.amplitude, shock.cycles / shock.frequency, shock.frequency, 3.0)]
    elif isinstance(shock, hc.Piston):
        corners = [0.0, *(time for time in shock.time or () if time > 0)]
        pieces = [(begin, 0.0, stop, 0.0, 0.0) for begin, stop in pairwise(corners)]
    else:
        shapes = {"linear": 1.0, "cosine": 2.0}
        pieces = [
            (ramp.start, ramp.start_force, ramp.end, ramp.end_force, shapes[ramp.shape])
            for ramp in scene.ramps
        ]
    if not pieces or pieces[0][0] > 0:
        pieces.insert(0, (0.0, 0.0, pieces[0][0] if pieces else 0.0, 0.0, 0.0))
    pieces.append((pieces[-1][2], 0.0, math.inf, 0.0, 0.0))
    return np.array([piece for piece in pieces if piece[0] < min(piece[2], scene.end_time)])


def strokes_of(scene: hc.Scene, pieces: Floats) -> Floats:
    """Displacement at the start of each piece and velocity in it, of a piston; else no rows."""
    shock = scene.shock
    if not isinstance(shock, hc.Piston):
        return np.zeros((0, 2))
    if shock.velocity is not None:
        return np.array([(shock.velocity * begin, shock.velocity) for begin in pieces[:, 0]])
    assert shock.time is not None
    assert shock.displacement is not None
    place = np.interp(pieces[:, 0], shock.time, shock.displacement)
    later = np.interp(pieces[:, 2], shock.time, shock.displacement)
    return np.column_stack([place, (later - place) / (pieces[:, 2] - pieces[:, 0])])
