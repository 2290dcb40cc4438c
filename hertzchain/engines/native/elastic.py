"""The loop over time for elastic contacts, compiled: Eq. 1 in natural units by symplectic methods.

What is computed is that of ``in_numpy`` and ``peaks``, which read like the formulas; tests hold the
two equal to round-off. Two things are done here only, because they only save time:

- Granules ahead of the front are not touched. They rest until a force of more than the square root
  of the smallest number reaches them; as the front falls off double-exponentially, the omitted
  values are below round-off.
- Granules that cannot matter any more are left behind, where that is asked for: see
  ``elastic_window``.

Arrays hold a window of the chain: entry i is granule ``base + i``, and granules lo ... hi - 1 move.
Scenes with terms have no such window: base is 0.
"""

from __future__ import annotations

import math
from typing import Any

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native.compiling import compiled_and_kept, part
from hertzchain.engines.native.elastic_chain import (
    END,
    FREE_END,
    SHAPE,
    START,
    STEPS,
    VELOCITY,
    Record,
    energy_of,
    has_piston,
    impulse_in_step,
    keep_history,
    momentum_of,
    work_in_step,
)
from hertzchain.engines.native.elastic_legs import (
    begin_run,
    flies_freely,
    fly,
    free_flight,
    is_diverged,
    pushed_legs,
    start_at,
    start_leg,
)
from hertzchain.engines.native.elastic_maxima import (
    DIP,
    keep_ends,
    keep_peaks,
    scan,
    turning_contacts,
    turning_contacts_of_verlet,
)
from hertzchain.engines.native.elastic_state import (
    BASE,
    BEGUN,
    COEFFICIENTS,
    DEEPEST,
    DIP_TIMES_STEP,
    DIVERGED,
    DONE,
    DOUBLE,
    ENERGY,
    EVALUATIONS,
    GIVEN,
    GRANULE_EVALUATIONS,
    HI,
    KEPT,
    LATE,
    LEAST,
    LEVEL,
    LO,
    MOMENTUM,
    MOVED,
    NEXT_CHECK,
    NO_ROOM,
    NUMBER,
    PART,
    PISTON,
    ROOM,
    SINGLE,
    STEP,
    STEPS_TAKEN,
    STOPPED,
    TIME,
    TINY,
    WALL,
    WHOLE,
    WORK,
    ZERO,
    Outcome,
    State,
    is_stopped,
    margin_of,
)
from hertzchain.engines.native.elastic_step import (
    back_to_the_start,
    keep_start,
    scale_coefficients,
    symplectic_step,
)
from hertzchain.engines.native.elastic_window import is_settled, leave_behind_in
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.keeping import UNCOUNTED
from hertzchain.engines.native.notes import note_elastic

_CHECK = 4.0
"""Natural time units between two looks at whether to go on and what to leave behind."""

_LOOK = 1_000_000
"""Granules times steps between two looks at whether the run is to be stopped: about 10 ms."""

_STEP_IN_GRANULES = 50
"""What a step costs besides its granules, in granules."""


@part
def end_chain(u: Any, base: int, granules: int, peak_force: Any) -> None:
    """Put the free end, or the wall, behind the last granule, where the window reaches it."""
    if granules - base < u.size:
        u[granules - base] = 0.0 if peak_force.size == granules else FREE_END


_LEG_DONE, _AT_EDGE, _SETTLED, _DIVERGED, _STOPPED = range(5)
"""Why the steps of march end."""


@compiled_and_kept(**UNCOUNTED)  # an eighth less to compile
def march(
    legs: FloatArray,
    kicks: Array,
    drifts: Array,
    state: State,
    verlet: bool,
    tolerance: float,
    starting: float,
    granules: int,
    start: FloatArray,
    chain: Chain | None,
    moving: int,
    leave_behind: bool,
    peak_force: FloatArray,
    peak_time: FloatArray,
    record: Record,
    control: FloatArray,
) -> Outcome:
    """Integrate a chain.

    Parameters
    ----------
    legs
        The steps and the applied force, shape (legs, 8): see START and what follows.
    kicks, drifts
        The method: see ``methods.SymplecticNystrom``.
    state
        Filled in, displacement and velocity at the end too.
    verlet
        Whether velocities are those of velocity Verlet: see ``motion_of_granule``.
    tolerance, starting
        Of ``refinement.Refined``; 0 for steps as asked.
    granules
        N.
    start
        Displacement and velocity at the start, shape (2, N), with ``leave_behind`` only next to
        terms; shape (0, 0) for a chain at rest.
    chain
        What the scene has beyond a plain chain, float64; or None.
    moving
        Granules that may move at the start; N for a run without a front.
    leave_behind
        Whether granules that cannot matter to any peak are left behind, and the run ended when
        none can change. There is no final state then.
    peak_force, peak_time
        Filled in; zero and NaN at the start, shape (N - 1,), or (N,) with a wall, which is last.
    record
        Filled in at its times, increasing; zero at the start. None with ``leave_behind``.
    control
        Set to -1 at [0] from outside, it stops the run; a number there is that of looks at this
        array, one every million steps of a granule, until it stops by itself. At [1] the time
        reached is found, at [2] the number of looks so far.

    Returns
    -------
    What happened.
    """
    rows, count, total, constants = state.rows, state.counts, state.totals, state.numbers
    u, v, g, u0, v0, a = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    middle = COEFFICIENTS + kicks.size
    kicks_h, drifts_h = constants[COEFFICIENTS:middle], constants[middle:]
    bernstein = total[ROOM:]
    base, size = count[BASE], u.size
    end_chain(u, base, granules, peak_force)
    if count[BEGUN] == 0:
        count[BEGUN] = 1
        constants[LEAST] = math.sqrt(SINGLE[TINY] if u.itemsize == 4 else DOUBLE[TINY])
        count[HI] = min(moving, granules)
        total[TIME], total[NEXT_CHECK] = legs[0, START], _CHECK
        if start.size > 0:
            start_at(start, u, v)
        if start.size > 0 or chain is not None:
            begin_run(u, v, g, granules, peak_force, peak_time, total, chain)
    zero = constants[ZERO]
    stages = drifts.size
    margin = margin_of(stages)
    grows = base + size <= granules
    last = min(granules - base, size - 1)
    lo, hi, kept = count[LO], count[HI], count[KEPT]
    whole, part, level = count[WHOLE], count[PART], count[LEVEL]
    steps, cost, spent = 0, 0, 0
    time, next_check = total[TIME], total[NEXT_CHECK]
    pushed, flies = pushed_legs(legs), flies_freely(chain)
    reason = _STOPPED if is_stopped(control) else _LEG_DONE
    number = count[NUMBER]
    while reason == _LEG_DONE and number < legs.shape[0]:
        leg, over = legs[number], number >= pushed
        if whole == 0 and part == 0 and level == 0:  # else it goes on after NO_ROOM
            start_leg(leg, u, v, g, peak_force, peak_time, constants, lo, chain)
        in_leg = int(leg[STEPS])
        full = (leg[END] - leg[START]) / leg[STEPS]
        h = full / (1 << level)
        scale_coefficients(h, constants, kicks, drifts)
        while whole < in_leg:
            if grows and hi + margin > size:
                reason = _AT_EDGE
                break
            begin = leg[START] + whole * full + part * h
            constants[STEP], constants[DIP_TIMES_STEP] = h, DIP * h
            keep_start(u, v, g, u0, v0, a, lo, hi + 1)
            reached = hi
            hi = symplectic_step(
                u, v, g, kicks_h, drifts_h, drifts, constants, leg, begin, h, lo, hi, last,
                chain,
            )  # fmt: skip
            if hi > reached:
                # New granules were at rest before the step; what lies beyond the chain stays there.
                for i in range(reached + 1, hi + 1):
                    u0[i] = u[i] if i == last and base + last == granules else zero
                    v0[i] = zero
                    a[i] = zero
            cost += hi - lo
            spent += hi - lo + _STEP_IN_GRANULES
            if spent >= _LOOK:
                spent = 0
                control[2] += 1
                if is_stopped(control):
                    reason = _STOPPED
                    break
            if tolerance > 0:
                turns, dips, fastest, speed = scan(
                    u0, v0, a, u, v, g, h, constants[DIP_TIMES_STEP], begin < starting, zero, lo,
                    hi, chain,
                )  # fmt: skip
            elif verlet:
                turns, dips = (
                    turning_contacts_of_verlet(v0, a, v, g, constants[STEP], zero, lo, hi),
                    True,
                )
                fastest, speed = zero, zero
            else:
                turns, dips = turning_contacts(v0, a, v, g, constants[DIP_TIMES_STEP], zero, lo, hi)
                fastest, speed = zero, zero
            if tolerance > 0 and level < DEEPEST:
                felt = float(fastest) ** 3 * h**5 > (tolerance * float(speed)) ** 2
                if felt:
                    back_to_the_start(u, v, g, u0, v0, a, lo, hi + 1)
                    count[EVALUATIONS] += stages
                    level, part, h = level + 1, 2 * part, h / 2
                    scale_coefficients(h, constants, kicks, drifts)
                    continue
            for s in range(count[LATE]):
                place = LATE + 1 + 2 * s
                from_, to = count[place], count[place + 1]
                ahead = lo if s + 1 == count[LATE] else count[place + 2]
                count[place + 1] = symplectic_step(
                    u, v, g, kicks_h, drifts_h, drifts, constants, leg, begin, h, from_, to, ahead,
                    chain,
                )  # fmt: skip
                cost += to - from_
                spent += to - from_
            steps += 1
            part += 1
            time = begin + h
            if whole + 1 == in_leg and part == 1 << level:
                time = leg[END]
            off = h * h / 6 if verlet else 0.0
            on_wall = 1 if hi == granules and peak_force.size == granules else 0
            if turns > 0 or dips:
                keep_peaks(
                    peak_force, peak_time, base, u0, v0, a, u, v, g, lo, hi + on_wall, leg, begin,
                    time, h, off, dips, h if verlet else 0.0, bernstein, chain,
                )  # fmt: skip
            if chain is not None and record.notes.shape[0] > 0:
                note_elastic(
                    record, peak_force, peak_time, u0, v0, u, v, lo, hi + on_wall, leg, begin,
                    time, h, off, chain,
                )  # fmt: skip
            if leg[SHAPE] != 0:
                total[WORK] += work_in_step(u0, v0, u, v, lo, leg, begin, h, off, chain)
            if chain is not None and on_wall == 1:
                total[WALL] += impulse_in_step(
                    granules - 1, u0, v0, u, v, leg, begin, h, off, chain
                )
            if chain is not None and has_piston(chain):
                given = impulse_in_step(0, u0, v0, u, v, leg, begin, h, off, chain)
                total[PISTON] += given
                total[WORK] += given * leg[VELOCITY]
                total[MOVED] += given * abs(leg[VELOCITY])
            if kept < record.time.size and record.time[kept] <= time:
                kept = keep_history(
                    record, kept, u0, v0, u, v, lo, hi, leg, begin, time, off, chain,
                )  # fmt: skip
            if level == 0:
                whole, part = whole + 1, 0
            elif part % 2 == 0:
                while level > 0 and part % 2 == 0:
                    level, part, h = level - 1, part // 2, h * 2
                if level == 0:
                    whole, part = whole + part, 0
                scale_coefficients(h, constants, kicks, drifts)
            if time >= next_check:
                next_check = time + _CHECK
                control[1] = time
                energy = total[ENERGY] + energy_of(u, v, lo, hi, chain)
                if is_diverged(energy, total, chain):
                    reason = _DIVERGED
                    break
                if leave_behind and over:
                    lo = leave_behind_in(
                        u, v, g, u0, v0, peak_force, base, lo, hi, base + hi == granules, constants,
                        count, total, chain,
                    )  # fmt: skip
                    if (
                        count[LATE] == 0
                        and base + hi == granules
                        and is_settled(u, v, peak_force, base, lo, hi, chain)
                    ):
                        reason = _SETTLED
                        break
                if flies and leg[SHAPE] == 0 and level == 0:
                    wait = leg[END] - time
                    if kept < record.time.size:
                        wait = min(wait, record.time[kept] - time)
                    idle = int(free_flight(u, v, lo, hi, on_wall, wait, chain) / full) - 1
                    if idle > 0:
                        fly(u, v, idle * full, lo, hi)
                        whole, time = whole + idle, time + idle * full
                        count[STEPS_TAKEN] += idle  # which no force was evaluated for
                        next_check = time + _CHECK
        if reason == _LEG_DONE:
            number, whole = number + 1, 0
    count[LO], count[HI], count[KEPT], count[NUMBER] = lo, hi, kept, number
    count[WHOLE], count[PART], count[LEVEL] = whole, part, level
    count[STEPS_TAKEN] += steps
    count[EVALUATIONS] += stages * steps
    count[GRANULE_EVALUATIONS] += stages * cost
    total[TIME], total[NEXT_CHECK] = time, next_check
    momentum = total[MOMENTUM] + momentum_of(v, lo, hi, chain)
    energy = total[ENERGY] + energy_of(u, v, lo, hi, chain)
    status = DONE
    if reason == _AT_EDGE:
        status = NO_ROOM
    elif reason == _DIVERGED or is_diverged(energy, total, chain):
        status = DIVERGED
    elif reason == _STOPPED:
        status = STOPPED
    if status != NO_ROOM:
        on_wall = 1 if hi == granules and peak_force.size == granules else 0
        keep_ends(peak_force, peak_time, base, u, lo, hi + on_wall, total[TIME], chain)
    return Outcome(
        status,
        count[STEPS_TAKEN],
        count[EVALUATIONS],
        count[GRANULE_EVALUATIONS],
        total[TIME],
        total[WORK] + total[GIVEN],
        momentum,
        energy,
        total[WALL],
        total[PISTON],
    )
