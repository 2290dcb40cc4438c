"""Chains under other contact laws, compiled: the loop of ``other_laws``, one chain at a time."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.kernels import compiled, compiled_and_kept

DAMPED_BY = ("nothing", "contact", "drag")
_, CONTACT, DRAG = range(len(DAMPED_BY))  # what the motion is damped by

DISPLACEMENT, VELOCITY, ELASTIC, WHOLE = 0, 1, 2, 5
"""Rows of the state; from ELASTIC and from WHOLE on the highest force of each contact, and the last
two samples of it. Row WHOLE and those after it are kept only where contacts are damped."""

ROWS = 8


@compiled
def _power(value: float, quarters: int) -> float:
    """A power that is a multiple of 1/4, by roots, which take a tenth of the time."""
    found = 1.0
    for _ in range(quarters // 4):
        found *= value
    if quarters % 4 == 0:
        return found
    root = np.sqrt(value)
    if quarters % 4 != 1:
        found *= root
    if quarters % 4 != 2:
        found *= np.sqrt(root)
    return found


@compiled
def _acceleration(
    u: Any, v: Any, applied: float, law: Any, a: Any, elastic: Any, whole: Any
) -> None:
    """Accelerations, and both forces of each contact, filled in. What is not a number stays so."""
    quarters, pulls, damped_by, damping_quarters, damping = law
    left = applied
    last = u.size - 1
    for i in range(last):
        overlap = u[i] - u[i + 1]
        pressed = 0.0 if overlap <= 0 else overlap
        force = _power(pressed, quarters)
        if pulls and overlap < 0:
            force = -_power(-overlap, quarters)
        elastic[i] = force
        if damped_by == CONTACT and not overlap <= 0:
            force += damping * _power(pressed, damping_quarters) * (v[i] - v[i + 1])
        whole[i] = force
        a[i] = left - force
        left = force
    a[last] = left
    if damped_by == DRAG:
        for i in range(u.size):
            a[i] -= damping * v[i]


@compiled
def _show(highest: Any, before: Any, now: Any, after: Any) -> None:
    """Take note of the next samples: a peak is that of the parabola through three of them."""
    for i in range(after.size):
        top = after[i]
        if now[i] >= before[i] and now[i] > after[i]:
            top = now[i]
            bend, slope = before[i] - 2 * now[i] + after[i], after[i] - before[i]
            if bend < 0:
                top -= slope * slope / (8 * bend)
        if not top <= highest[i]:
            highest[i] = top
        before[i] = now[i]
        now[i] = after[i]


@compiled_and_kept
def advance(
    state: FloatArray,
    applied: FloatArray,
    h: float,
    quarters: int,
    pulls: bool,
    damped_by: int,
    damping_quarters: int,
    damping: float,
) -> None:
    """Advance one chain by RK4 with steps h, in natural units: ``state``, shape (ROWS, N).

    ``applied`` is the force at the ends and in the middle of each step, shape (2 steps + 1,).
    Exponents, of the elastic force and of what damps, are given times four.
    """
    law = (quarters, pulls, damped_by, damping_quarters, damping)
    u, v = state[DISPLACEMENT], state[VELOCITY]
    contacts = u.size - 1
    u2, v2, v3, v4 = np.empty_like(u), np.empty_like(u), np.empty_like(u), np.empty_like(u)
    a1, a2, a3, a4 = np.empty_like(u), np.empty_like(u), np.empty_like(u), np.empty_like(u)
    elastic, whole, unseen = np.empty(contacts), np.empty(contacts), np.empty(contacts)
    for k in range(applied.size // 2):
        first, middle, last = applied[2 * k], applied[2 * k + 1], applied[2 * k + 2]
        _acceleration(u, v, first, law, a1, elastic, whole)
        row = state[:, :contacts]
        _show(row[ELASTIC], row[ELASTIC + 1], row[ELASTIC + 2], elastic)
        if damped_by == CONTACT:
            _show(row[WHOLE], row[WHOLE + 1], row[WHOLE + 2], whole)
        for i in range(u.size):
            v2[i] = v[i] + h / 2 * a1[i]
            u2[i] = u[i] + h / 2 * v[i]
        _acceleration(u2, v2, middle, law, a2, unseen, whole)
        for i in range(u.size):
            v3[i] = v[i] + h / 2 * a2[i]
            u2[i] = u[i] + h / 2 * v2[i]
        _acceleration(u2, v3, middle, law, a3, unseen, whole)
        for i in range(u.size):
            v4[i] = v[i] + h * a3[i]
            u2[i] = u[i] + h * v3[i]
        _acceleration(u2, v4, last, law, a4, unseen, whole)
        for i in range(u.size):
            u[i] += h / 6 * (v[i] + 2 * v2[i] + 2 * v3[i] + v4[i])
            v[i] += h / 6 * (a1[i] + 2 * a2[i] + 2 * a3[i] + a4[i])
