"""The loop over time for elastic contacts, compiled: Eq. 1 in natural units by symplectic methods.

Results are those of ``equations``, which read like the formulas: tests and ``compare`` check that.
Two things are done only here, to save time:

- Granules ahead of the front are not touched. They rest until a force of more than the square root
  of the smallest number reaches them; as the front falls off double-exponentially, the omitted
  values are below round-off.
- Granules that cannot change any peak are left behind, where that is wanted: see
  ``elastic_window``.

Granules lo ... hi - 1 move, the window of the chain that is computed.
"""

from __future__ import annotations

import math

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.elastic_chain import (
    END,
    FREE_END,
    SHAPE,
    START,
    STEPS,
    VELOCITY,
    energy_of,
    has_piston,
    impulse_in_step,
    impulse_on_fixed,
    keep_history,
    momentum_of,
    work_in_step,
)
from hertzchain.engines.native.elastic_legs import begin_run, is_diverged, pushed_legs, start_leg
from hertzchain.engines.native.elastic_maxima import keep_ends, keep_peaks, observe, scan
from hertzchain.engines.native.elastic_state import (
    DEEPEST,
    DIVERGED,
    DONE,
    STOPPED,
    Outcome,
    Record,
    Seen,
    State,
    Steps,
    is_stopped,
)
from hertzchain.engines.native.elastic_step import keep_start, symplectic_step
from hertzchain.engines.native.elastic_window import is_settled, leave_behind_in
from hertzchain.engines.native.equations import Chain
from hertzchain.observables.compiling import compiled_and_kept
from hertzchain.observables.keeping import UNCOUNTED
from hertzchain.observables.observer import Watch, usual_end

_CHECK = 4.0
"""Natural time units between two checks whether to go on and what to leave behind."""

_LOOK = 1_000_000
"""Granules times steps between two checks whether the run is to be stopped: about 10 ms."""

_STEP_IN_GRANULES = 50
"""Fixed cost of a step, expressed as a number of granules."""


_LEG_DONE, _SETTLED, _DIVERGED, _STOPPED = range(4)
"""Why the steps of march end."""


@compiled_and_kept(**UNCOUNTED)  # an eighth less to compile
def march(
    steps: Steps,
    state: State,
    granules: int,
    start: FloatArray,
    chain: Chain | None,
    moving: int,
    leave_behind: bool,
    seen: Seen,
    watch: Watch | None,
    usual: float,
    control: FloatArray,
) -> Outcome:
    """Integrate a chain.

    Parameters
    ----------
    steps
        Which steps are taken, and the applied force.
    state
        Filled in, displacement and velocity at the end too.
    granules
        N.
    start
        Displacement and velocity at the start, shape (2, N), not with ``leave_behind``; shape
        (0, 0) for a chain at rest.
    chain
        The chain of a scene with terms; None for a plain chain.
    moving
        Granules that may move at the start; N for a run without a front.
    leave_behind
        Whether granules that cannot change any peak are left behind, and the run ends when no peak
        can change. There is no final state then. Only in a plain chain.
    seen
        Filled in; nothing is recorded with ``leave_behind``.
    watch
        Filled in where first pulses are wanted; otherwise None. Only with a chain.
    usual
        If it is not NaN, the run ends by itself when its first pulses are over: see
        ``observer.usual_end``, which takes this as the end otherwise.
    control
        If [0] is set to -1 from outside, the run stops; a positive number there is the number of
        checks, one every million steps of a granule, after which the run stops by itself. [1] has
        the time reached, [2] the number of checks so far.

    Returns
    -------
    What happened.
    """
    run, rows, legs = state.progress[0], state.rows, steps.legs
    verlet, tolerance, stages = steps.verlet, steps.tolerance, steps.drifts.size
    record, has_wall = seen.record, seen.force.size == granules
    u, v, g, u0, v0, a = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    u[granules] = 0.0 if has_wall else FREE_END
    lo, hi, spent, time = 0, min(moving, granules), 0, legs[0, START]
    run.time, next_check, pushed = time, _CHECK, pushed_legs(legs)
    if start.size > 0 or chain is not None:
        begin_run(u, v, g, start, granules, seen, run, chain)
    reason = _STOPPED if is_stopped(control) else _LEG_DONE
    run_end, next_end = math.inf, math.inf if math.isnan(usual) else _CHECK
    for number in range(legs.shape[0]):
        if reason != _LEG_DONE or time >= run_end:
            break
        leg, over = legs[number], number >= pushed
        start_leg(leg, u, v, g, seen, run, lo, chain)
        since, until = leg[START], min(leg[END], run_end)
        usual_step = (leg[END] - since) / leg[STEPS]
        in_leg = int(leg[STEPS])
        if until < leg[END]:
            in_leg = math.ceil((until - since) / usual_step)
        full = (until - since) / in_leg
        h, whole, part, level = full, 0, 0, 0
        while whole < in_leg:
            begin = since + whole * full + part * h
            keep_start(u, v, g, u0, v0, a, lo, hi + 1)
            reached = hi
            hi = symplectic_step(u, v, g, run, steps, leg, begin, h, lo, hi, granules, chain)
            if hi > reached:
                # New granules were at rest before the step; the entry beyond the free end stays as
                # it is.
                for i in range(reached + 1, hi + 1):
                    u0[i] = u[i] if i == granules else 0.0
                    v0[i] = a[i] = 0.0
            run.granule_evaluations += stages * (hi - lo)
            spent += hi - lo + _STEP_IN_GRANULES
            if spent >= _LOOK:
                spent = 0
                control[2] += 1
                if is_stopped(control):
                    reason = _STOPPED
                    break
            run.evaluations += stages
            if verlet:
                turns, dips = 0, True
            else:
                turns, dips, fastest, speed = scan(
                    u0, v0, a, u, v, g, h, begin < steps.starting, lo, hi, chain
                )
                felt = fastest**3 * h**5 > (tolerance * speed) ** 2
                if tolerance > 0 and level < DEEPEST and felt:
                    keep_start(u0, v0, a, u, v, g, lo, hi + 1)  # undone
                    level, part, h = level + 1, 2 * part, h / 2
                    continue
            run.steps += 1
            part += 1
            time = begin + h
            if whole + 1 == in_leg and part == 1 << level:
                time = until
            off = h * h / 6 if verlet else 0.0
            on_wall = 1 if hi == granules and has_wall else 0
            if turns > 0 or dips:
                keep_peaks(
                    seen, u0, v0, a, u, v, g, lo, hi + on_wall, leg, begin, time, h, off,
                    dips, h if verlet else 0.0, chain,
                )  # fmt: skip
            if watch is not None:
                observe(
                    watch, u0, v0, a, u, v, g, lo, hi + on_wall, leg, begin, time, off, verlet,
                    chain,
                )  # fmt: skip
            if leg[SHAPE] != 0:
                run.work += work_in_step(u0, v0, u, v, lo, leg, begin, h, off, chain)
            if chain is not None and on_wall == 1:
                run.wall += impulse_in_step(granules - 1, u0, v0, u, v, leg, begin, h, off, chain)
            if chain is not None and chain.fixed.size > 0:
                run.wall += impulse_on_fixed(
                    u0, v0, u, v, leg, begin, h, off, chain, seen.force.size
                )
            if chain is not None and has_piston(chain):
                given = impulse_in_step(0, u0, v0, u, v, leg, begin, h, off, chain)
                run.piston += given
                run.work += given * leg[VELOCITY]
                run.moved += given * abs(leg[VELOCITY])
            if run.kept < record.time.size and record.time[run.kept] <= time:
                run.kept = keep_history(
                    record, run.kept, u0, v0, u, v, lo, hi, leg, begin, time, off, chain
                )
            if level == 0:
                whole, part = whole + 1, 0
            elif part % 2 == 0:
                while level > 0 and part % 2 == 0:
                    level, part, h = level - 1, part // 2, h * 2
                if level == 0:
                    whole, part = whole + part, 0
            if watch is not None and time >= next_end and level == 0:
                run_end = max(usual_end(watch, usual, next_end, run_end), time)
                next_end = min(next_end + _CHECK, run_end) if run_end > time else math.inf
                if min(run_end, leg[END]) != until:  # the rest is cut into equal steps again
                    whole, since, until = 0, time, min(run_end, leg[END])
                    in_leg = math.ceil((until - since) / usual_step)
                    h = full = (until - since) / max(in_leg, 1)
            if time >= next_check:
                next_check = time + _CHECK
                control[1] = time
                energy = run.energy + energy_of(u, v, lo, hi, chain)
                if is_diverged(energy, run.given, run.work, run.moved, chain):
                    reason = _DIVERGED
                    break
                if chain is None and leave_behind and over:
                    lo = leave_behind_in(u, v, g, seen.force, lo, hi, run)
                    if hi == granules and is_settled(u, v, seen.force, lo, hi):
                        reason = _SETTLED
                        break
    momentum = run.momentum + momentum_of(v, lo, hi, chain)
    energy = run.energy + energy_of(u, v, lo, hi, chain)
    status = DONE
    if reason == _DIVERGED or is_diverged(energy, run.given, run.work, run.moved, chain):
        status = DIVERGED
    elif reason == _STOPPED:
        status = STOPPED
    keep_ends(seen, u, lo, hi + (1 if hi == granules and has_wall else 0), time, chain)
    return Outcome(
        status,
        run.steps,
        run.evaluations,
        run.granule_evaluations,
        time,
        run.work + run.given,
        momentum,
        energy,
        run.wall,
        run.piston,
        0.0,
    )


@compiled_and_kept(**UNCOUNTED)
def march_each(
    rows: FloatArray,
    steps: Steps,
    state: State,
    blank: State,
    granules: int,
    start: FloatArray,
    moving: int,
    force: FloatArray,
    time: FloatArray,
    record: Record,
    end: FloatArray,
    evaluations: FloatArray,
    control: FloatArray,
) -> None:
    """Integrate plain chains under a pulse one after the other, as ``march`` does one of them.

    Granules that cannot change any peak are left behind.

    Parameters
    ----------
    rows
        Their legs, shape (scenes, legs, 8); a leg without steps is left out.
    steps
        As for ``march``, with any legs.
    state, blank
        A state with N + 1 columns that all scenes use, and a copy of it as it is at the start.
    granules, start, moving, control
        As for ``march``: they are at rest.
    force, time
        Filled in with peaks, shape (scenes, N - 1).
    record
        A record in which nothing is kept.
    end, evaluations
        Filled in with the time reached by each and its force evaluations, NaN where the motion
        diverged, shape (scenes,).
    """
    for n in range(rows.shape[0]):
        taken = 0
        while taken < rows.shape[1] and rows[n, taken, STEPS] > 0:
            taken += 1
        for row in range(state.rows.shape[0]):
            for i in range(state.rows.shape[1]):
                state.rows[row, i] = 0.0
        state.progress[0] = blank.progress[0]
        its = Steps(
            rows[n, :taken], steps.kicks, steps.drifts, steps.verlet, steps.tolerance,
            steps.starting,
        )  # fmt: skip
        seen = Seen(force[n], time[n], record)
        found = march(
            its, state, granules, start, None, moving, True, seen, None, math.nan, control
        )
        if found.status == STOPPED:
            return
        end[n] = found.end
        evaluations[n] = math.nan if found.status == DIVERGED else found.evaluations
