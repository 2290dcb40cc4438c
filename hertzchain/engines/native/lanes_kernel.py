"""Plain scenes side by side: lane k of every vector is one scene, compiled.

What is computed is that of ``elastic.march`` without terms, with symplectic methods. All lanes take
a step at once, each its own, from its own corners, halved and repeated as it needs. Three things
differ, so that no lane depends on the others:

- The window of a vector ends where the force of the front ends in all lanes: within a stage it
  grows granule by granule, as far as any contact is pressed. A lane whose front is elsewhere
  computes granules at rest there, which stay at rest exactly.
- A lane that leaves granules behind moves them to where they press nothing; the window closes when
  all lanes have left them.
- Times for a look at the energy, at what may be left behind and at what is settled are counted in
  steps of the lane.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import (
    elastic_chain,
    elastic_legs,
    elastic_maxima,
    elastic_state,
    elastic_window,
    interpolant,
    lanes,
    lanes_looks,
    lanes_maxima,
    lanes_motion,
)
from hertzchain.engines.native.compiling import compiled, compiled_and_kept_with
from hertzchain.engines.native.elastic_chain import (
    END,
    FORCE_END,
    FORCE_START,
    FREE_END,
    RAMP_END,
    RAMP_START,
    SHAPE,
    START,
    STEPS,
)
from hertzchain.engines.native.elastic_legs import pushed_legs
from hertzchain.engines.native.elastic_state import DOUBLE, SINGLE, TINY
from hertzchain.engines.native.lanes import bits, load, number_of, store, zero_lanes
from hertzchain.engines.native.lanes_looks import (
    end_lane,
    gains_energy,
    is_settled,
    leave,
    left_behind,
)
from hertzchain.engines.native.lanes_maxima import keep_maxima
from hertzchain.engines.native.lanes_motion import (
    ACTIVE,
    BEFORE,
    BEGIN,
    BEHIND,
    CHANGE,
    EVALUATIONS,
    FIRST,
    FORM,
    FULL,
    LEAVES,
    LEG,
    LEVEL,
    NUMBER,
    OVER,
    PART,
    RISE,
    RISES_FROM,
    ROWS,
    STEP,
    WHOLE,
    add_work,
    refuses,
    restore,
    take_step,
)

_LOOK = 6
"""Steps of a lane between two looks: about the four natural time units of single runs."""

_CLOSE = 1e-4
"""Last change in the search for a maximum, in steps, of float32; of float64 its square. A peak is
flat: Newton's next change would be the square of it, and that of the force its fourth power."""


@compiled
def _next_leg(x: Any, clock: Any, legs: Any, lane: int, half: int, rows: int) -> bool:
    """Begin the next leg of a lane; returns whether there is one."""
    number = int(clock[LEG, lane]) + 1
    while number < legs.shape[0] and legs[number, STEPS] == 0:
        number += 1
    if number == legs.shape[0]:
        return False
    start, steps = legs[number, START], legs[number, STEPS]
    clock[LEG, lane], clock[FIRST, lane], clock[NUMBER, lane] = number, start, steps
    clock[FULL, lane] = clock[STEP, lane] = (legs[number, END] - start) / steps
    clock[WHOLE, lane] = clock[PART, lane] = clock[LEVEL, lane] = 0.0
    clock[BEGIN, lane], clock[FORM, lane] = start, legs[number, SHAPE]
    clock[OVER, lane] = 1.0 if number >= pushed_legs(legs) else 0.0
    push, form = 0.0, legs[number, SHAPE]
    if form != 0:
        length = legs[number, RAMP_END] - legs[number, RAMP_START]
        change = legs[number, FORCE_END] - legs[number, FORCE_START]
        clock[RISES_FROM, lane], clock[RISE, lane] = legs[number, RAMP_START], 1 / length
        clock[BEFORE, lane], clock[CHANGE, lane] = legs[number, FORCE_START], change
        grown = (start - legs[number, RAMP_START]) / length
        if form == 2:
            grown = math.sin(math.pi / 2 * grown) ** 2
        push = clock[BEFORE, lane] + change * grown
    r = max(float(x[half, lane] - x[half + 1, lane]), 0.0)
    x[half + 2 * rows, lane] = push - r * math.sqrt(r)
    return True


@compiled
def _after_step(clock: Any, lane: int, refused: bool) -> bool:
    """Halve the step of a lane, or go on; returns whether its leg is done."""
    whole, part, level = int(clock[WHOLE, lane]), int(clock[PART, lane]), int(clock[LEVEL, lane])
    if refused:
        level, part = level + 1, 2 * part
    else:
        part += 1
        while level > 0 and part % 2 == 0:
            level, part = level - 1, part // 2
        if level == 0:
            whole, part = whole + part, 0
    step = clock[FULL, lane] / (1 << level)
    clock[WHOLE, lane], clock[PART, lane], clock[LEVEL, lane] = whole, part, level
    clock[STEP, lane] = step
    clock[BEGIN, lane] = clock[FIRST, lane] + whole * clock[FULL, lane] + part * step
    return whole >= clock[NUMBER, lane]


@compiled
def _whole_steps(clock: Any, zero: Any) -> Any:
    """Go on by a whole step in all lanes; returns those whose leg is done."""
    whole = load(clock, WHOLE, zero) + load(clock, ACTIVE, zero)
    store(clock, WHOLE, whole)
    store(clock, BEGIN, load(clock, FIRST, zero) + whole * load(clock, FULL, zero))
    return bits((whole >= load(clock, NUMBER, zero)) & (load(clock, ACTIVE, zero) > 0.5))


@compiled
def _march(
    x: Any, clock: Any, curves: Any, highest: Any, highest_at: Any, legs: Any, leaves: Any,
    kicks: Any, drifts: Any, tolerance: float, starting: float, granules: int, ends: Any, b: Any,
    control: Any,
) -> None:  # fmt: skip
    """Integrate as many scenes as there are legs, at most one in each lane."""
    zero = zero_lanes(x)
    rows, stages = granules + 1, drifts.size
    single = x.itemsize == 4
    least = math.sqrt(SINGLE[TINY] if single else DOUBLE[TINY])
    close = _CLOSE if single else _CLOSE**2
    old, new, lo, hi = 0, 3 * rows, 0, 1
    for k in range(x.shape[0]):
        store(x, k, zero)
    for half in (old, new):
        store(x, half + granules, zero + FREE_END)
    for k in range(granules - 1):
        store(highest, k, zero)
    for lane in range(number_of(zero)):
        for k in range(ROWS):
            clock[k, lane] = 0.0
    active = legs.shape[0]
    for lane in range(legs.shape[0]):
        clock[LEG, lane], clock[ACTIVE, lane] = -1, 1.0
        clock[LEAVES, lane] = 1.0 if leaves[lane] else 0.0
        _next_leg(x, clock, legs[lane], lane, old, rows)
    halved, pushed, count = 0, True, 0
    while active > 0:
        hi = take_step(x, clock, kicks, drifts, old, new, rows, lo, hi, pushed, least)
        running = load(clock, ACTIVE, zero)
        taken = running > 0.5
        store(clock, EVALUATIONS, load(clock, EVALUATIONS, zero) + running * float(stages))
        refusing = np.uint64(0)
        if tolerance > 0:
            refused = taken & refuses(x, clock, old, new, rows, lo, hi, tolerance, starting)
            refusing = bits(refused)
            taken = taken & ~refused
        keep_maxima(
            x, clock, curves, highest, highest_at, old, new, rows, lo, hi, taken, pushed, close, b,
        )  # fmt: skip
        if pushed:
            add_work(x, clock, old, new, taken)
        if refusing != 0:
            restore(x, refused, old, new, rows, lo, hi)
        old, new = new, old
        count += 1
        done = np.uint64(0)
        if halved == 0 and refusing == 0:
            done = _whole_steps(clock, zero)
        else:
            halved = 0
            for lane in range(legs.shape[0]):
                if clock[ACTIVE, lane] > 0:
                    bit = np.uint64(1) << np.uint64(lane)
                    if _after_step(clock, lane, refusing & bit != 0):
                        done |= bit
                    halved += clock[LEVEL, lane] > 0
        if done != 0:
            diverged = gains_energy(x, clock, old, rows, lo, hi)
            for lane in range(legs.shape[0]):
                bit = np.uint64(1) << np.uint64(lane)
                if done & bit == 0:
                    continue
                clock[BEGIN, lane] = legs[lane, int(clock[LEG, lane]), END]
                if not _next_leg(x, clock, legs[lane], lane, old, rows):
                    if diverged & bit != 0:
                        clock[EVALUATIONS, lane] = np.nan
                    end_lane(x, clock, highest, highest_at, lane, old, rows, lo, hi)
                    active -= 1
            pushed = bits(load(clock, FORM, zero) > 0.5) != 0
        if count % _LOOK == 0 and active > 0:
            if control[0] < 0:
                return
            control[2] += 1
            diverged = gains_energy(x, clock, old, rows, lo, hi)
            settled = np.uint64(0)
            if hi == granules:
                settled = is_settled(x, clock, highest, old, rows, lo, hi)
            cuts = left_behind(x, clock, highest, old, rows, lo, hi)
            cutting = bits(cuts > load(clock, BEHIND, zero))
            if diverged | settled | cutting != 0:
                store(ends, 1, cuts)
                before, lo = lo, granules - 1
                for lane in range(legs.shape[0]):
                    bit = np.uint64(1) << np.uint64(lane)
                    if diverged & bit != 0:
                        clock[EVALUATIONS, lane] = np.nan
                    if (diverged | settled) & bit != 0:
                        end_lane(x, clock, highest, highest_at, lane, old, rows, before, hi)
                        active -= 1
                    elif cutting & bit != 0:
                        leave(x, clock, lane, int(ends[1, lane]), old, rows)
                    if clock[ACTIVE, lane] > 0:
                        lo = min(lo, int(clock[BEHIND, lane]))
                pushed = bits(load(clock, FORM, zero) > 0.5) != 0
    store(ends, 0, load(clock, BEGIN, zero))


@compiled_and_kept_with(
    elastic_chain,
    elastic_legs,
    elastic_maxima,
    elastic_state,
    elastic_window,
    interpolant,
    lanes,
    lanes_looks,
    lanes_maxima,
    lanes_motion,
)
def march_lanes(
    legs: FloatArray,
    leaves: Any,
    kicks: FloatArray,
    drifts: FloatArray,
    state: Array,
    tolerance: float,
    starting: float,
    granules: int,
    peak_force: FloatArray,
    peak_time: FloatArray,
    end: FloatArray,
    evaluations: FloatArray,
    control: FloatArray,
) -> None:
    """Peaks of many scenes of one length, as ``elastic.march`` finds those of one.

    Parameters
    ----------
    legs
        Shape (scenes, legs, 8); a leg without steps is left out. Neighbours share a vector, which
        runs as long as the longest of them.
    leaves
        Whether granules of each scene may be left behind, shape (scenes,).
    kicks, drifts
        Of a symplectic method, shape (stages + 1,) and (stages,).
    state
        Room in the precision of the run, shape (6 (N + 1), lanes).
    tolerance, starting, granules, control
        As for ``elastic.march``.
    peak_force, peak_time
        Filled in, shape (scenes, N - 1).
    end, evaluations
        Filled in with the time reached by each and its force evaluations, NaN where the motion
        diverged, shape (scenes,).
    """
    count = state.shape[1]
    clock, ends = np.zeros((ROWS, count)), np.zeros((2, count))
    curves, highest = np.zeros((8, count), state.dtype), np.zeros((granules, count), state.dtype)
    highest_at, b = np.zeros((granules, count)), np.zeros(7)
    for first in range(0, legs.shape[0], count):
        some = min(count, legs.shape[0] - first)
        _march(
            state, clock, curves, highest, highest_at, legs[first : first + some],
            leaves[first : first + some], kicks, drifts, tolerance, starting, granules, ends, b,
            control,
        )  # fmt: skip
        if control[0] < 0:
            return
        for k in range(some):
            end[first + k], evaluations[first + k] = ends[0, k], clock[EVALUATIONS, k]
            for i in range(granules - 1):
                r = float(highest[i, k])
                peak_force[first + k, i] = r * math.sqrt(r)
                peak_time[first + k, i] = highest_at[i, k] if r > 0 else np.nan
