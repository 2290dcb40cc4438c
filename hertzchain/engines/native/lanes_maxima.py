"""Maxima of overlaps within a step of plain scenes side by side, compiled.

As ``elastic_maxima.keep_peaks``: contacts are pressed by their overlap to the power 3/2, so
overlaps are compared, not forces. Where the overlap of a lane turns once it is searched with those
of all lanes, where it turns more often by itself.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.elastic_maxima import DIP
from hertzchain.engines.native.interpolant import highest_place, value_at
from hertzchain.engines.native.lanes import (
    bits,
    load,
    magnitude,
    number_of,
    root,
    same_precision,
    store,
    where,
    zero_lanes,
)
from hertzchain.engines.native.lanes_motion import (
    BEGIN,
    STEP,
    applied_force_rate,
    larger,
)

_NEWTON = 50
"""Most changes in the search for a maximum, which also halves an interval."""


@compiled
def _jerk(x: Any, half: int, rows: int, i: int, behind: Any) -> Any:
    """Third derivative of the overlap of contact i, from the rate of the force behind it."""
    zero = zero_lanes(x)
    here, ahead, beyond = (
        load(x, half + i, zero), load(x, half + i + 1, zero), load(x, half + i + 2, zero),
    )  # fmt: skip
    v, v_ahead, v_beyond = (
        load(x, half + rows + i, zero),
        load(x, half + rows + i + 1, zero),
        load(x, half + rows + i + 2, zero),
    )
    own = root(larger(here - ahead, zero)) * (v - v_ahead)
    following = root(larger(ahead - beyond, zero)) * (v_ahead - v_beyond)
    return behind - 3.0 * own + 1.5 * following


@compiled
def _force_rate(x: Any, half: int, rows: int, i: int) -> Any:
    """The rate of the force of contact i."""
    zero = zero_lanes(x)
    r = larger(load(x, half + i, zero) - load(x, half + i + 1, zero), zero)
    v, ahead = load(x, half + rows + i, zero), load(x, half + rows + i + 1, zero)
    return 1.5 * root(r) * (v - ahead)


@compiled
def _keep_maximum(
    x: Any, clock: Any, curves: Any, highest: Any, highest_at: Any, old: int, new: int, rows: int,
    lo: int, i: int, found: Any, pushed: bool, close: float, b: Any,
) -> None:  # fmt: skip
    """The maximum of an overlap within a step, in the lanes that may have one: ``found``."""
    zero = zero_lanes(x)
    h, begin = load(clock, STEP, zero), load(clock, BEGIN, zero)
    step = same_precision(h, zero)
    r0 = load(x, old + i, zero) - load(x, old + i + 1, zero)
    r1 = load(x, new + i, zero) - load(x, new + i + 1, zero)
    best, at = load(highest, i, zero), load(highest_at, i, zero)
    # The ends too: where the maximum is at one of them, rounding may hide it.
    higher = found & (larger(r0, r1) > best)
    best = where(higher, larger(r0, r1), best)
    at = where(higher, where(r1 > r0, begin + h, begin), at)
    behind0, behind1 = zero, zero
    if i > lo:
        behind0, behind1 = _force_rate(x, old, rows, i - 1), _force_rate(x, new, rows, i - 1)
    elif pushed:
        behind0 = applied_force_rate(clock, begin, zero)
        behind1 = applied_force_rate(clock, begin + h, zero)
    place = rows + i
    p0 = step * (load(x, old + place, zero) - load(x, old + place + 1, zero))
    p1 = step * (load(x, new + place, zero) - load(x, new + place + 1, zero))
    place += rows
    half_square = step * step * 0.5
    q0 = half_square * (load(x, old + place, zero) - load(x, old + place + 1, zero))
    q1 = half_square * (load(x, new + place, zero) - load(x, new + place + 1, zero))
    sixth_cube = half_square * step * (1.0 / 3.0)
    c0 = sixth_cube * _jerk(x, old, rows, i, behind0)
    c1 = sixth_cube * _jerk(x, new, rows, i, behind1)
    # Bernstein coefficients of the slope, from what both ends say.
    b1, b2 = p0 + q0 * (1.0 / 3.0), p0 + q0 * (2.0 / 3.0) + c0 * 0.2
    b5, b4 = p1 - q1 * (1.0 / 3.0), p1 - q1 * (2.0 / 3.0) + c1 * 0.2
    b3 = 7.0 * (r1 - r0) - 3.0 * (p0 + p1) - (q0 - q1) - 0.2 * (c0 + c1)
    steepest = larger(larger(larger(p0, b1), larger(b2, b3)), larger(larger(b4, b5), p1))
    found = found & (r0 + larger(steepest, zero) > best)
    once = (p0 > zero) ^ (b1 > zero)
    change = (b1 > zero) ^ (b2 > zero)
    again = once & change
    once = once | change
    change = (b2 > zero) ^ (b3 > zero)
    again = again | (once & change)
    once = once | change
    change = (b3 > zero) ^ (b4 > zero)
    again = again | (once & change)
    once = once | change
    change = (b4 > zero) ^ (b5 > zero)
    again = again | (once & change)
    once = once | change
    change = (b5 > zero) ^ (p1 > zero)
    again = again | (once & change)
    once = once | change
    several = bits(found & again)
    found = found & once & (p0 > zero) & (p1 <= zero) & ~again
    # The polynomial of degree 7, and what the cubic from the start misses at the end.
    d = r1 - (r0 + p0 + q0 + c0)
    d1 = p1 - (p0 + 2.0 * q0 + 3.0 * c0)
    d2 = 2.0 * (q1 - (q0 + 3.0 * c0))
    d3 = 6.0 * (c1 - c0)
    e4 = 35.0 * d - 15.0 * d1 + 2.5 * d2 - d3 * (1.0 / 6.0)
    e5 = -84.0 * d + 39.0 * d1 - 7.0 * d2 + d3 * 0.5
    e6 = 70.0 * d - 34.0 * d1 + 6.5 * d2 - d3 * 0.5
    e7 = -20.0 * d + 10.0 * d1 - 2.0 * d2 + d3 * (1.0 / 6.0)
    if bits(found) != 0:
        low, high = zero, zero + 1.0
        s = p0 / (p0 - p1)
        s = where((s > low) & (s < high), s, zero + 0.5)
        searching = found
        for _ in range(_NEWTON):
            slope = p0 + s * (2.0 * q0 + s * (3.0 * c0 + s * (
                4.0 * e4 + s * (5.0 * e5 + s * (6.0 * e6 + s * (7.0 * e7)))
            )))  # fmt: skip
            bend = 2.0 * q0 + s * (6.0 * c0 + s * (
                12.0 * e4 + s * (20.0 * e5 + s * (30.0 * e6 + s * (42.0 * e7)))
            ))  # fmt: skip
            rises = slope > zero
            low, high = where(rises, s, low), where(rises, high, s)
            following = s - slope / bend
            following = where(
                (following >= low) & (following <= high), following, 0.5 * (low + high)
            )
            change_of_s = magnitude(following - s)
            s = where(searching, following, s)
            searching = searching & (change_of_s > close)
            if bits(searching) == 0:
                break
        value = r0 + s * (p0 + s * (q0 + s * (c0 + s * (e4 + s * (e5 + s * (e6 + s * e7))))))
        higher = found & (value > best)
        best = where(higher, value, best)
        at = where(higher, begin + same_precision(s, h) * h, at)
    store(highest, i, best)
    store(highest_at, i, at)
    if several != 0:
        store(curves, 0, r0)
        store(curves, 1, p0)
        store(curves, 2, q0)
        store(curves, 3, c0)
        store(curves, 4, e4)
        store(curves, 5, e5)
        store(curves, 6, e6)
        store(curves, 7, e7)
        for lane in range(number_of(zero)):
            if several >> np.uint64(lane) & np.uint64(1) == 0:
                continue
            c = (
                float(curves[0, lane]), float(curves[1, lane]), float(curves[2, lane]),
                float(curves[3, lane]), float(curves[4, lane]), float(curves[5, lane]),
                float(curves[6, lane]), float(curves[7, lane]),
            )  # fmt: skip
            known = float(highest[i, lane])
            where_highest = highest_place(c, known * math.sqrt(known), b)
            if where_highest >= 0:
                highest[i, lane] = value_at(c, where_highest)
                highest_at[i, lane] = clock[BEGIN, lane] + where_highest * clock[STEP, lane]


@compiled
def keep_maxima(
    x: Any, clock: Any, curves: Any, highest: Any, highest_at: Any, old: int, new: int, rows: int,
    lo: int, hi: int, taken: Any, pushed: bool, close: float, b: Any,
) -> None:  # fmt: skip
    """Maxima of overlaps within a step, in the lanes that took it."""
    zero = zero_lanes(x)
    step = same_precision(load(clock, STEP, zero), zero)
    dip = DIP * step
    v0, v1 = load(x, old + rows + lo, zero), load(x, new + rows + lo, zero)
    a0, a1 = load(x, old + 2 * rows + lo, zero), load(x, new + 2 * rows + lo, zero)
    for i in range(lo, min(hi, rows - 2)):
        v0_ahead, v1_ahead = load(x, old + rows + i + 1, zero), load(x, new + rows + i + 1, zero)
        a0_ahead, a1_ahead = (
            load(x, old + 2 * rows + i + 1, zero), load(x, new + 2 * rows + i + 1, zero),
        )  # fmt: skip
        w0, w1, g0, g1 = v0 - v0_ahead, v1 - v1_ahead, a0 - a0_ahead, a1 - a1_ahead
        both = w0 + w1
        towards, back = zero - both * g0, both * g1
        dips = (towards > zero) & (back > zero) & (dip * (towards + back) > both * both)
        found = taken & (((w0 > zero) & (w1 <= zero)) | dips)
        if bits(found) != 0:
            r0 = load(x, old + i, zero) - load(x, old + i + 1, zero)
            r1 = load(x, new + i, zero) - load(x, new + i + 1, zero)
            # As far as it can get, even if its rate changes by all that both ends say.
            bends = step * (magnitude(g0) + magnitude(g1))
            reach = larger(r0, r1) + step * (magnitude(w0) + magnitude(w1) + bends)
            found = found & (reach > load(highest, i, zero))
            if bits(found) != 0:
                _keep_maximum(
                    x, clock, curves, highest, highest_at, old, new, rows, lo, i, found, pushed,
                    close, b,
                )  # fmt: skip
        v0, v1, a0, a1 = v0_ahead, v1_ahead, a0_ahead, a1_ahead
