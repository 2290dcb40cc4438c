"""The loop over time for elastic contacts, compiled: Eq. 1 in natural units by symplectic methods.

Results are those of ``equations``, which read like the formulas: tests and ``compare`` check that.
Two things are done only here, to save time:

- Granules ahead of the front are not touched. They rest until a force of more than the square root
  of the smallest number reaches them; as the front falls off double-exponentially, the omitted
  values are below round-off.
- Granules that cannot change any peak are left behind, where that is wanted: see
  ``left_behind``.

Granules lo ... hi - 1 move, the window of the chain that is computed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

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
from hertzchain.engines.native.elastic_step import (
    accelerate_pushed,
    begin_run,
    is_diverged,
    keep_start,
    pushed_legs,
    start_leg,
    symplectic_step,
)
from hertzchain.engines.native.equations import Chain
from hertzchain.observables.compiling import ONE, compiled_and_kept, part
from hertzchain.observables.interpolant import hertz_force
from hertzchain.observables.keeping import UNCOUNTED
from hertzchain.observables.observer import Watch, usual_end

_QUIET_GRANULES = 8

_QUIET = 1e-3
"""Largest overlap and velocity of a quiet granule, over those of the leading wave. Derived in
``left_behind``; the longest steps leave 8e-4 behind a wave by their errors, usual ones 1e-7."""

_IMPACT = 1.3
"""F / v^1.2, above that of a granule running into a wall, (5/4)^(3/5) = 1.14, and of a solitary
wave and its fastest granule (1.01): see ``_strength``."""

_SLOWER = 0.95
"""What is left behind presses less than this fraction of the peaks that it could raise."""

_LOOSENED = 1.2
"""Largest force of a wave at an end whose last granules drift apart, over its height; 1.173
measured, with up to six such granules and gaps of 0.001 to 20 overlaps."""

_WAVE_ENERGY, _WAVE_RATIO = 1.0465162, 0.3834342
"""Energy over F^(5/3), and over the square of the momentum, of a solitary wave; measured in a chain
and derived from its shape."""

_LIKE_A_WAVE = 1e-3
"""Difference of a wave's ratio of energy to momentum squared from that; 1e-5 measured."""

_LEAST_PRESSED = 0.7
"""Hardest pressed contact of a solitary wave at any instant, over its height; 0.77 measured, where
two contacts are pressed alike."""


@part
def _strength(force: float, velocity: float) -> float:
    """Largest force that a part of the chain with these largest values can cause after one pulse.

    This is not proved. In 6,787 scenes with one pulse, N 2 to 41, LM_ratio 0.1 to 100, n 1.001 to
    101, no peak was missed because of it.
    """
    return max(force, _IMPACT * max(velocity, 0.0) ** 1.2)


@part
def _fastest(v: Any, i: Any) -> float:
    """The velocity with which a granule may run into others, for ``_strength``."""
    return max(float(v[i]), float(v[i] - v[i + ONE]))


@part
def _height(momentum: float, energy: float, hardest: float) -> float:
    """Height of the solitary wave with this momentum and energy; 0 if they are not those of one.

    All three numbers have to fit: for the same momentum one wave has another energy than two waves,
    or than flying granules.
    """
    if momentum <= 0 or energy <= 0:
        return 0.0
    if abs(energy / (_WAVE_RATIO * momentum**2) - 1) > _LIKE_A_WAVE:
        return 0.0
    height = (energy / _WAVE_ENERGY) ** 0.6
    if not _LEAST_PRESSED * height <= hardest <= (1 + _LIKE_A_WAVE) * height:
        return 0.0
    return float(height)


@part
def left_behind(u: Any, v: Any, peak_force: Any, lo: int, hi: int) -> int:
    """Return where the window can begin, once the pulse is over.

    The shock has to be one pulse, in a plain chain: after a second push a broad packet can break
    up into waves stronger than any before, and unlike granules, gaps and walls reflect waves. A cut
    needs all of this:

    - Ahead of it lies a quiet stretch: ``_QUIET_GRANULES`` granules whose overlaps and velocities
      are below ``_QUIET`` of those of the leading wave. Contacts that are hardly pressed are hardly
      stiff, k = 3/2 overlap^(1/2), and a signal that crosses d contacts of stiffness k in a time t
      is reduced by the factor (k t^2)^d / (2d)!. Meanwhile the waves ahead move on at about one
      granule in a unit of time, so that the stretch only grows: with d = 8 + t that factor is below
      1e-24 for all t. Only waves can pass.
    - What lies behind, up to the quiet stretch before, is either weak, or one solitary wave. It is
      weak if it cannot reach the peak of any contact from there back, nor the force of the leading
      wave (``_strength``, with a margin). After a single pulse, which leaves its strongest waves
      ahead, no contact is pressed harder later than the hardest now, or than the fastest granule
      can press by running into one at rest. (After several pulses it can be: a broad packet can
      break up into stronger waves.)
    - One solitary wave, recognised by momentum, energy and its hardest contact (``_height``), does
      not change. It only meets contacts that lie ahead of it, which waves as strong as the leading
      one have passed: their peaks are compared with it, not those behind. While granules ahead are
      at rest it presses no contact harder than its height. At the free end it can: the leading wave
      throws off the last granules, and a later wave throws granules against these slower ones, with
      forces of up to 1.17 times its height. Even these forces have to be below all peaks ahead.
    """
    crest = hi - 1
    while crest > lo and max(u[crest - 1] - u[crest], 0) >= u[crest] - u[crest + 1]:
        crest -= 1
    if crest == lo:
        return lo
    # The contact behind the hardest pressed one has just had its peak.
    leading = peak_force[crest - 1]
    quiet_overlap, quiet_velocity = _QUIET * leading ** (2 / 3), _QUIET * leading ** (5 / 6)
    weakest_peak, weakest_ahead, strongest = leading, -1.0, 0.0
    begin, momentum, energy, hardest, fastest = lo, 0.0, 0.0, 0.0, 0.0
    quiet, cut = 0, lo
    for i in range(lo, crest):
        r, speed = float(u[i] - u[i + 1]), float(v[i])
        weakest_peak = min(weakest_peak, peak_force[i])
        if r <= quiet_overlap and abs(speed) <= quiet_velocity:
            quiet += 1
        else:
            if quiet >= _QUIET_GRANULES:
                begin = i - _QUIET_GRANULES
                momentum, energy, hardest, fastest = 0.0, 0.0, 0.0, 0.0
            quiet = 0
        force = hertz_force(r)
        hardest, fastest = max(hardest, force), max(fastest, _fastest(v, i))
        momentum += speed
        energy += 0.5 * speed**2 + 0.4 * force * r
        if quiet == _QUIET_GRANULES:
            height = _height(momentum, energy, hardest)
            strength = max(_strength(hardest, fastest), height)
            if _LOOSENED * max(strongest, strength) < _SLOWER * weakest_peak:
                strongest = max(strongest, strength)
            else:
                if height == 0 or _LOOSENED * strongest >= _SLOWER * weakest_peak:
                    break
                if weakest_ahead < 0:
                    weakest_ahead = leading
                    for k in range(begin, crest):
                        weakest_ahead = min(weakest_ahead, peak_force[k])
                if _LOOSENED * height >= _SLOWER * weakest_ahead:
                    break
        if quiet >= _QUIET_GRANULES:
            cut = i + 1 - _QUIET_GRANULES
    return cut


@part
def is_settled(u: Any, v: Any, peak_force: Any, lo: int, hi: int) -> bool:
    """Whether no peak can change any more, once the pulse is over and all granules were reached.

    Granules that fly off at the free end never come back, and the others cannot press any contact
    as hard as the least of all peaks so far.
    """
    end = hi
    while end - 1 > lo and u[end - 2] < u[end - 1] and v[end - 2] < v[end - 1]:
        end -= 1
    hardest, fastest = 0.0, 0.0
    for i in range(np.uint64(lo), np.uint64(end - 1)):
        hardest = max(hardest, hertz_force(float(u[i] - u[i + ONE])))
        fastest = max(fastest, _fastest(v, i))
    if end - 1 <= lo:
        return True
    weakest_peak = math.inf
    for i in range(np.uint64(lo), np.uint64(peak_force.size)):
        weakest_peak = min(weakest_peak, peak_force[i])
    return weakest_peak > _LOOSENED * _strength(hardest, fastest)


@part
def leave_behind_in(u: Any, v: Any, g: Any, peak_force: Any, lo: int, hi: int, run: Any) -> int:
    """Leave behind granules that cannot change a peak; returns where the window begins now.

    The momentum and the energy of the granules left behind are added to ``run``.
    """
    cut = left_behind(u, v, peak_force, lo, hi)
    if cut > lo:
        run.momentum += momentum_of(v, lo, cut, None)
        run.energy += energy_of(u, v, lo, cut, None)
        accelerate_pushed(u, g, run.push, cut, None)
    return cut


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
