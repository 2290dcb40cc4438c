"""Chains of damped contacts, integrated by SciPy in natural units: shares no line with the package.

Written from the equations of motion: m_i u_i'' = F_{i-1} - F_i + m_i pull_i, with
F = k d^(3/2) + c d^q d' where d > 0, and never below 0 without attraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import minimize_scalar

import hertzchain as hc
from tests.oracles.terms_in_si import numbers_of

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Found:
    """Peak force of each contact, and displacement and velocity at the end, natural units."""

    peak_force: Floats
    displacement: Floats
    velocity: Floats


def peaks(
    chain: Any,
    push: Callable[[float], float],
    corners: list[float],
    start: Floats,
    rtol: float = 1e-12,
    longest: float = 0.05,
    piston: Callable[[float, float], tuple[float, float]] | None = None,
) -> Found:
    """Peaks and the end by DOP853 with a small tolerance and short steps.

    It knows nothing of contacts that begin and end: its control of errors makes steps there as
    short as they have to be. ``push`` is the applied force, smooth between ``corners``. ``piston``
    tells displacement at the start and velocity between two corners of granule 1, whose inertia is
    0 then.
    """
    k, c, gap, inertia = chain.stiffness, chain.damping, chain.gap, chain.inverse_mass
    size, contacts = inertia.size, chain.stiffness.size

    def contact_forces(y: Floats) -> Floats:
        u, v = np.append(y[:size], 0.0), np.append(y[size:], 0.0)
        d = u[:contacts] - u[1 : contacts + 1] - gap
        w = v[:contacts] - v[1 : contacts + 1]
        pressed = np.maximum(d, 0.0)
        force = k * pressed**1.5 + c * pressed**chain.exponent * w
        force = np.where(d > 0, force, 0.0)
        return np.asarray(force if chain.attraction else np.maximum(force, 0.0))

    def rates(t: float, y: Floats) -> Floats:
        net = np.zeros(size)
        force = contact_forces(y)
        net[:contacts] -= force
        net[1:] += force[: size - 1]
        net[0] += push(t)
        return np.concatenate([y[size:], net * inertia + chain.constant])

    def below(curve: Any, contact: int, time: float) -> float:
        """The force of a contact, with the other sign."""
        return -float(contact_forces(curve(time))[contact])

    state: Any = np.concatenate([start[0], start[1]])
    highest = contact_forces(state)
    share = np.linspace(0.0, 1.0, 9)
    for begin, end in pairwise(corners):
        inside = (end - begin) * 1e-15
        if piston is not None:
            state = state.copy()
            state[0], state[size] = piston(begin, end)
        solver = DOP853(
            rates, begin + inside, state, end - inside, rtol=rtol, atol=rtol, max_step=longest
        )
        while solver.t < solver.t_bound:
            before = solver.t
            assert solver.step() is None  # otherwise the message has the reason
            curve, h = solver.dense_output(), solver.t - before
            seen = np.array([contact_forces(curve(before + s * h)) for s in share])
            # A maximum may lie between the last sample of a step and the first of the next.
            for contact in np.flatnonzero(seen.max(axis=0) >= 0.99 * highest):
                top = int(np.argmax(seen[:, contact]))
                best = max(highest[contact], seen[top, contact])
                if h > 1e-6:
                    ahead = min(top + 1, share.size - 1)
                    around = before + h * share[max(top - 1, 0)], before + h * share[ahead]
                    found = minimize_scalar(
                        partial(below, curve, int(contact)),
                        bounds=around,
                        method="bounded",
                        options={"xatol": 1e-8 * h},
                    )
                    best = max(best, -found.fun)
                highest[contact] = best
        state = solver.y
    return Found(highest, state[:size], state[size:])


@dataclass(frozen=True)
class Chain:
    """A chain as ``peaks`` takes it, natural units."""

    stiffness: Floats
    damping: Floats
    gap: Floats
    inverse_mass: Floats
    constant: Floats
    exponent: float
    attraction: bool


def peaks_of_scene(scene: hc.Scene, rtol: float) -> Floats:
    """Peak force of each contact of a damped scene [N], a wall's last."""
    each, law = numbers_of(scene), scene.contact
    assert law is not None
    mass, stiffness = each.mass, each.stiffness
    pairs = mass[:-1] * mass[1:] / (mass[:-1] + mass[1:])
    contact_mass = np.append(pairs, mass[-1:])[: stiffness.size]
    exponent, damping = 0.0, (law.coefficient or 0.0) * np.ones(stiffness.size)
    if law.restitution is not None:
        log = math.log(law.restitution)
        alpha = -math.sqrt(5) * log / math.hypot(math.pi, log)
        exponent, damping = 0.25, alpha * np.sqrt(contact_mass * stiffness)
    elif law.relaxation_time is not None:
        exponent, damping = 0.5, 1.5 * law.relaxation_time * stiffness
    force = max(scene.peak_force, float(np.max(stiffness * each.start_overlap**1.5)))
    length = (force / stiffness[0]) ** (2 / 3)
    time = math.sqrt(2 * contact_mass[0] * length / force)
    chain = Chain(
        stiffness=stiffness * length**1.5 / force,
        damping=damping * length ** (exponent + 1) / time / force,
        gap=(each.gap - each.start_overlap) / length,
        inverse_mass=force * time**2 / length / mass,
        constant=each.constant / mass * time**2 / length,
        exponent=exponent,
        attraction=law.attraction,
    )
    start = np.zeros((2, mass.size))
    if isinstance(scene.shock, hc.Striker):
        start[1, 0] = scene.shock.velocity * time / length

    def push(t: float) -> float:
        return float(scene.applied_force(np.array([t * time]))[0]) / force

    corners = sorted({0.0, *(r.start for r in scene.ramps), *(r.end for r in scene.ramps)})
    corners = [corner for corner in corners if corner < scene.end_time] + [scene.end_time]
    natural = [corner / time for corner in corners]
    return peaks(chain, push, natural, start, rtol, longest=0.1).peak_force * force
