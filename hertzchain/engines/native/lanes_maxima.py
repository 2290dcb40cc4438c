"""Maxima of overlaps within a step of scenes side by side, compiled: see ``lanes_loops``."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.elastic_chain import applied_force_rate
from hertzchain.engines.native.interpolant import (
    hermite,
    hertz_force,
    hertz_force_rate,
    highest_place,
    value_at,
)
from hertzchain.engines.native.lanes_loops import LANES, mark_maxima, place


@compiled
def _contact(motion: Any, leg: Any, i: int, k: int, behind: int, time: float) -> Any:
    """Overlap of the contact ahead of granule i of scene k, and its first three derivatives."""
    u, v, f, ahead = motion.u, motion.v, motion.force, LANES
    j = place(i, k)
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
def keep_maxima(old: Any, new: Any, lanes: Any, lo: int, hi: int, b: Any) -> None:
    """Keep the maxima of a step, in the scenes that took it."""
    highest, highest_at, h = lanes.highest, lanes.highest_at, lanes.step
    mark_maxima(old, new, h, highest, lanes.marks, lo, hi)
    one = np.uint64(1)
    for word in range(place(lo, 0) // LANES, place(hi, 0) // LANES):
        if lanes.words[word] == 0:
            continue
        for j in range(word * LANES, (word + one) * LANES):
            i, k = j // LANES, j % LANES
            scene = lanes.scenes[k]
            if not lanes.marks[j] or scene.refused:
                continue
            leg, step, begin = lanes.legs[k, scene.leg], scene.step, scene.begin
            start = _contact(old, leg, i, k, scene.behind, begin)
            end = _contact(new, leg, i, k, scene.behind, begin + step)
            # The ends too: where the maximum is at one of them, rounding may hide it.
            if max(start[0], end[0]) > highest[j]:
                highest[j] = max(start[0], end[0])
                highest_at[j] = begin + step if end[0] > start[0] else begin
            curve = hermite(start, end, step)
            s = highest_place(curve, hertz_force(float(highest[j])), b)
            if s >= 0:
                highest[j], highest_at[j] = value_at(curve, s), begin + s * step
