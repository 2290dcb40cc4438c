"""Chains with terms, integrated by SciPy in SI units: shares no line with the package.

Written from the equations of motion: m_i x_i'' = F_{i-1} - F_i + g m_i + constant forces, with
F = 4/3 E* sqrt(R*) overlap^(3/2) in each contact and at the wall.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, solve_ivp
from scipy.optimize import brentq

import hertzchain as hc

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Found:
    """Peak force of each contact [N], a wall's last, and the velocities at the end [m/s]."""

    peak_force: Floats
    velocity: Floats


@dataclass(frozen=True)
class Numbers:
    """Numbers of a scene, SI units; granules first, then contacts, a wall's last."""

    mass: Floats
    constant: Floats  # force on each granule
    stiffness: Floats
    gap: Floats
    start_overlap: Floats


def numbers_of(scene: hc.Scene) -> Numbers:
    """Masses, stiffnesses, gaps and loads from radii and materials."""
    size, chain = scene.chain.granules, scene.chain
    columns = {
        name: np.array(np.broadcast_to(getattr(chain, name), size), np.float64)
        for name in ("radius", "young_modulus", "poisson_ratio", "density")
    }
    if isinstance(scene.shock, hc.Striker):
        for name, values in columns.items():
            own = getattr(scene.shock, name)
            if own is not None:
                values[0] = own
    radius, modulus, nu, density = columns.values()
    mass = density * 4 * math.pi / 3 * radius**3
    soft = (1 - nu**2) / modulus
    stiffness = 4 / 3 / (soft[:-1] + soft[1:]) / np.sqrt(1 / radius[:-1] + 1 / radius[1:])
    gap = np.array(np.broadcast_to(chain.gap, size), np.float64)[1:]
    wall = scene.wall
    if wall is not None:
        other = {
            "rigid": 0.0,
            "same": soft[-1],
            "elastic": (1 - (wall.poisson_ratio or 0) ** 2) / (wall.young_modulus or 1),
        }[wall.kind]
        stiffness = np.append(stiffness, 4 / 3 / (soft[-1] + other) * math.sqrt(radius[-1]))
        gap = np.append(gap, wall.gap)
    pressed = scene.precompression
    force, gravity = (0.0, 0.0) if pressed is None else (pressed.force, pressed.gravity)
    static = np.array([force + gravity * sum(mass[: k + 1]) for k in range(stiffness.size)])
    constant = gravity * mass
    constant[0] += force
    if wall is None:
        constant[-1] -= force
    return Numbers(mass, constant, stiffness, gap, (static / stiffness) ** (2 / 3))


def peaks(  # noqa: PLR0915 - formula after formula
    scene: hc.Scene, rtol: float, most_steps: float = math.inf
) -> Found:
    """Peaks and velocities at the end, by DOP853; its steps end where contacts open or close.

    ArithmeticError where that takes more than ``most_steps``.
    """
    size, wall = scene.chain.granules, scene.wall
    each = numbers_of(scene)
    mass, constant, stiffness = each.mass, each.constant, each.stiffness
    gap, start_overlap = each.gap, each.start_overlap

    def overlaps(state: Floats) -> Floats:
        x = state[:size]
        ahead = x[1:] if wall is None else np.append(x[1:], 0.0)
        return np.asarray(x[: stiffness.size] - ahead - gap + start_overlap)

    def at(curve: Any, time: float) -> Floats:
        return overlaps(curve(time))

    def contact_forces(state: Floats) -> Floats:
        return np.asarray(stiffness * np.maximum(overlaps(state), 0.0) ** 1.5)

    def rates(t: float, y: Floats) -> Floats:
        contact = contact_forces(y)
        net = constant.copy()
        net[0] += _push(scene, t)
        net[: contact.size] -= contact
        net[1:] += contact[: size - 1]
        gained = net / mass
        if isinstance(scene.shock, hc.Piston):
            gained[0] = 0.0
        return np.concatenate([y[size:], gained])

    state: Any = np.zeros(2 * size)
    if isinstance(scene.shock, hc.Striker):
        state[size] = scene.shock.velocity
    highest = contact_forces(state)
    corners = sorted({0.0, *(r.start for r in scene.ramps), *(r.end for r in scene.ramps)})
    if isinstance(scene.shock, hc.Piston) and scene.shock.time is not None:
        corners = sorted({0.0, *scene.shock.time})
    corners = [corner for corner in corners if corner < scene.end_time] + [scene.end_time]
    scale = np.max(stiffness * start_overlap**1.5) + scene.peak_force
    length = (scale / float(np.max(stiffness))) ** (2 / 3)
    shortest = math.sqrt(float(np.min(mass)) * length / scale)
    tolerance = rtol * np.repeat([length, length / shortest], size)

    def note(curve: Any, left: float, right: float) -> None:
        """Keep forces at the ends, and at maxima of overlaps between them."""
        for t in (left, right):
            np.maximum(highest, contact_forces(curve(t)), out=highest)
        rising = closing(curve(left)) > 0
        for contact in np.flatnonzero(rising & (closing(curve(right)) <= 0)):
            top = root(lambda t: closing(curve(t)), int(contact), left, right)
            highest[contact] = max(highest[contact], contact_forces(curve(top))[contact])

    def closing(state: Floats) -> Floats:
        ahead = state[size + 1 :] if wall is None else np.append(state[size + 1 :], 0.0)
        return np.asarray(state[size : size + stiffness.size] - ahead)

    def root(of: Any, k: int, left: float, right: float) -> float:
        """Return the time at which the k-th value is 0."""
        return float(brentq(lambda t: of(t)[k], left, right, xtol=1e-30))

    how: dict[str, Any] = {"rtol": rtol, "atol": tolerance, "max_step": 0.2 * shortest}
    for begin, end in pairwise(corners):
        # Just inside the leg: F(t) may jump at its ends.
        inside = (end - begin) * 1e-15
        if isinstance(scene.shock, hc.Piston):
            state = state.copy()
            state[0], state[size] = _piston(scene.shock, begin, end)
        solver = DOP853(rates, begin + inside, state, end - inside, **how)
        while solver.t < solver.t_bound:
            most_steps -= 1
            if most_steps < 0:
                raise ArithmeticError("granules that collide over and over take too many steps")
            time, state = solver.t, solver.y.copy()
            assert solver.step() is None  # otherwise the message has the reason
            curve, before, after = solver.dense_output(), overlaps(state), overlaps(solver.y)
            crossed = (before > 0) != (after > 0)
            crossed &= np.minimum(np.abs(before), np.abs(after)) > 1e-13 * length
            if not crossed.any():
                note(curve, time, solver.t)
                continue
            # The step ends where a contact opens or closes: its force has no second derivative.
            now = partial(at, curve)
            opened = min(root(now, int(k), time, solver.t) for k in np.flatnonzero(crossed))
            part = solve_ivp(rates, (time, opened), state, "DOP853", dense_output=True, **how)
            note(part.sol, time, opened)
            solver = DOP853(rates, opened, part.y[:, -1], end - inside, **how)
        state = solver.y
    return Found(highest, state[size:])


def _push(scene: hc.Scene, time: float) -> float:
    """The applied force at a time [N]."""
    if isinstance(scene.shock, hc.Sine):
        shock = scene.shock
        phase = shock.frequency * time
        return shock.amplitude * math.sin(2 * math.pi * phase) if phase < shock.cycles else 0.0
    return float(scene.applied_force(np.array([time]))[0])


def _piston(piston: hc.Piston, begin: float, end: float) -> tuple[float, float]:
    """Displacement [m] at the start of an interval without corners, and velocity [m/s] in it."""
    if piston.velocity is not None:
        return piston.velocity * begin, piston.velocity
    assert piston.time is not None
    assert piston.displacement is not None
    place, later = np.interp([begin, end], piston.time, piston.displacement)
    return float(place), float((later - place) / (end - begin))
