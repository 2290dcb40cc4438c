"""Maxima of overlaps within a step of scenes side by side, compiled: see ``lanes_loops``.

Steps in which an overlap may have had its highest maximum stand in a queue, until there are so many
that the compiler's vectors pay: a maximum alone is a long chain of operations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.elastic_chain import applied_force_rate
from hertzchain.engines.native.interpolant import (
    hertz_force,
    hertz_force_rate,
    highest_place,
    value_at,
)
from hertzchain.engines.native.lanes_loops import lanes_of, mark_maxima, place

SIZE = 64
"""Steps in the queue (chosen): a few vectors."""

(
    R0, P0, Q0, C0, R1, P1, Q1, C1, BEGIN, STEP, E4, E5, E6, E7, PLACE, CHANGES, MISSED, ROWS,
) = (np.uint64(row * SIZE) for row in range(18))  # fmt: skip
"""Rows of the queue. Of a step: overlap and its first three derivatives, as terms of a power series
in s = (t - begin) / step, at both ends; begin and step. What is found: the rest of the series, the
place of the maximum in it, how often the slope may change its sign, and Newton's last change."""

QUEUE = int(ROWS)
"""Numbers of the queue."""

_NEWTON = 5
"""Changes in the search for a maximum: 2 of 1,000 need more (measured) and are searched alone."""

_CLOSE = 1e-8
"""Newton's last change of s, whose square the next would be; a maximum is flat besides."""


@compiled
def _contact(motion: Any, leg: Any, i: int, k: int, behind: int, time: float) -> Any:
    """Overlap of the contact ahead of granule i of scene k, and its first three derivatives."""
    u, v, f, ahead = motion.u, motion.v, motion.force, lanes_of(motion.u)
    j = place(u, i, k)
    r, rate = float(u[j] - u[j + ahead]), float(v[j] - v[j + ahead])
    if i == behind:
        before = applied_force_rate(leg, time)
    else:
        before = hertz_force_rate(float(u[j - ahead] - u[j]), float(v[j - ahead] - v[j]))
    j += ahead
    after = hertz_force_rate(float(u[j] - u[j + ahead]), float(v[j] - v[j + ahead]))
    acceleration = float(f[j - ahead]) - 2.0 * f[j] + f[j + ahead]
    return r, rate, acceleration, before - 2 * hertz_force_rate(r, rate) + after


@compiled
def _search(q: Any) -> None:
    """Search all steps of the queue for a maximum."""
    for n in range(np.uint64(SIZE)):
        r0, p0, q0, c0 = q[R0 + n], q[P0 + n], q[Q0 + n], q[C0 + n]
        r1, p1, q1, c1 = q[R1 + n], q[P1 + n], q[Q1 + n], q[C1 + n]
        # The slope's Bernstein coefficients change their sign at least as often as the slope.
        b1, b2 = p0 + q0 / 3, p0 + q0 * (2 / 3) + c0 / 5
        b5, b4 = p1 - q1 / 3, p1 - q1 * (2 / 3) + c1 / 5
        b3 = 7 * (r1 - r0) - 3 * (p0 + p1) - (q0 - q1) - (c0 + c1) / 5
        changes = 1.0 if (p0 > 0) != (b1 > 0) else 0.0
        changes += 1.0 if (b1 > 0) != (b2 > 0) else 0.0
        changes += 1.0 if (b2 > 0) != (b3 > 0) else 0.0
        changes += 1.0 if (b3 > 0) != (b4 > 0) else 0.0
        changes += 1.0 if (b4 > 0) != (b5 > 0) else 0.0
        changes += 1.0 if (b5 > 0) != (p1 > 0) else 0.0
        # What the cubic from the start misses at the end.
        d, d1 = r1 - (r0 + p0 + q0 + c0), p1 - (p0 + 2 * q0 + 3 * c0)
        d2, d3 = 2 * (q1 - (q0 + 3 * c0)), 6 * (c1 - c0)
        e4 = 35 * d - 15 * d1 + 2.5 * d2 - d3 / 6
        e5 = -84 * d + 39 * d1 - 7 * d2 + d3 / 2
        e6 = 70 * d - 34 * d1 + 6.5 * d2 - d3 / 2
        e7 = -20 * d + 10 * d1 - 2 * d2 + d3 / 6
        q[E4 + n], q[E5 + n], q[E6 + n], q[E7 + n], q[CHANGES + n] = e4, e5, e6, e7, changes
        low, high, s, last = 0.0, 1.0, p0 / (p0 - p1), 0.0
        for _ in range(_NEWTON):
            s = s if (s >= low) & (s <= high) else 0.5 * (low + high)
            slope = p0 + s * (2 * q0 + s * (3 * c0 + s * (
                4 * e4 + s * (5 * e5 + s * (6 * e6 + s * (7 * e7)))
            )))  # fmt: skip
            curvature = 2 * q0 + s * (6 * c0 + s * (
                12 * e4 + s * (20 * e5 + s * (30 * e6 + s * (42 * e7)))
            ))  # fmt: skip
            low, high = s if slope > 0 else low, high if slope > 0 else s
            last = slope / curvature
            s -= last
        q[PLACE + n], q[MISSED + n] = s, abs(last)


@compiled
def empty_queue(lanes: Any, b: Any) -> None:
    """Search the steps of the queue, and keep their maxima."""
    q, highest, highest_at = lanes.queue, lanes.highest, lanes.highest_at
    _search(q)
    for n in range(np.uint64(lanes.places[SIZE])):
        j, begin, step = lanes.places[n], q[BEGIN + n], q[STEP + n]
        # The ends too: where the maximum is at one of them, rounding may hide it.
        r0, r1 = q[R0 + n], q[R1 + n]
        if max(r0, r1) > highest[j]:
            highest[j], highest_at[j] = max(r0, r1), begin + step if r1 > r0 else begin
        curve = (
            r0, q[P0 + n], q[Q0 + n], q[C0 + n], q[E4 + n], q[E5 + n], q[E6 + n], q[E7 + n],
        )  # fmt: skip
        s, turns_once = -1.0, q[CHANGES + n] == 1
        if turns_once and q[MISSED + n] <= _CLOSE and 0 <= q[PLACE + n] <= 1:
            s = q[PLACE + n] if q[P0 + n] > 0 else s
        elif q[CHANGES + n] > 0:
            s = highest_place(curve, hertz_force(float(highest[j])), b)
        if s >= 0:
            r = value_at(curve, s)
            if r > highest[j]:
                highest[j], highest_at[j] = r, begin + s * step
    lanes.places[SIZE] = 0


@compiled
def keep_maxima(old: Any, new: Any, lanes: Any, lo: int, hi: int, b: Any) -> None:
    """Queue the maxima of a step, in the scenes that took it."""
    q, places, h = lanes.queue, lanes.places, lanes.step
    mark_maxima(old, new, h, lanes.highest, lanes.marks, lo, hi)
    number, eight, one = lanes_of(h), np.uint64(8), np.uint64(1)
    for word in range(place(h, lo, 0) // eight, place(h, hi, 0) // eight):
        if lanes.words[word] == 0:
            continue
        for j in range(word * eight, (word + one) * eight):
            i, k = j // number, j % number
            scene = lanes.scenes[k]
            if not lanes.marks[j] or scene.refused:
                continue
            if places[SIZE] == SIZE:
                empty_queue(lanes, b)
            leg, step, begin = lanes.legs[k, scene.leg], scene.step, scene.begin
            n, half, sixth = np.uint64(places[SIZE]), step * step / 2, step * step * step / 6
            r, rate, second, third = _contact(old, leg, i, k, scene.behind, begin)
            q[R0 + n], q[P0 + n], q[Q0 + n], q[C0 + n] = (
                r,
                step * rate,
                half * second,
                sixth * third,
            )
            r, rate, second, third = _contact(new, leg, i, k, scene.behind, begin + step)
            q[R1 + n], q[P1 + n], q[Q1 + n], q[C1 + n] = (
                r,
                step * rate,
                half * second,
                sixth * third,
            )
            q[BEGIN + n], q[STEP + n], places[n] = begin, step, j
            places[SIZE] += 1
