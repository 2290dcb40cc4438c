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
    CHECK,
    DEEPEST,
    DIVERGED,
    DONE,
    END,
    FREE_END,
    LOOK,
    SHAPE,
    START,
    STEPS,
    STOPPED,
    VELOCITY,
    Array,
    Ending,
    Motion,
    Outcome,
    Progress,
    Seen,
    Span,
    Start,
    State,
    Steps,
    Terms,
    accelerate_pushed,
    begin_run,
    copy_motion,
    ends_of_contact,
    energy_of,
    has_piston,
    impulse_in_step,
    impulse_on_fixed,
    is_diverged,
    is_stopped,
    keep_history,
    momentum_of,
    motion_of_contact,
    overlap_of,
    pushed_legs,
    start_leg,
    symplectic_step,
    with_stiffness,
    work_in_step,
)
from hertzchain.engines.native.equations import Chain
from hertzchain.observables.compiling import (
    ONE,
    UNCOUNTED,
    compiled,
    compiled_and_kept,
    compiled_without_nan,
    larger,
    part,
)
from hertzchain.observables.observer import (
    Step,
    Watch,
    has_news,
    hertz_force,
    highest,
    look,
    usual_end,
)

DIP = 0.75
"""Factor on the step: see ``scan``. A half would suffice if overlap rates were parabolas."""


@compiled_without_nan
def scan(
    before: Motion, after: Motion, h: float, starting: bool, lo: int, hi: int, chain: Terms
) -> Any:
    """Scan a step: contacts with a maximum, the fastest to open or close, the largest speed.

    A contact has had a maximum if its overlap rate w changes its sign. It may also have had one
    where w may change its sign twice: w has the same sign at both ends, bends towards 0 at the
    start and back at the end, and bends enough. A parabola c (t - t')^2 - d, d >= 0, that reaches 0
    within a step of length h has w0 + w1 <= h (w1' - w0') / 2; ``DIP`` is the half and a margin.
    Rates that change their sign three times in a step are not considered. ``methods.Walker``
    defines which contacts open or close. The contact ahead of the last granule is included, though
    it is never pressed: a whole number of vectors is quicker than one contact less.
    """
    u0, v0, a = before
    u, v, g = after
    turns, dips, fastest, speed, dip = 0, 0, 0.0, 0.0, DIP * h
    for i in range(np.uint64(lo), np.uint64(hi)):
        r0, r1 = u0[i] - u0[i + ONE], u[i] - u[i + ONE]
        if chain is not None:
            r0 -= chain.gap[i]
            r1 -= chain.gap[i]
        w0, w1 = v0[i] - v0[i + ONE], v[i] - v[i + ONE]
        g0, g1 = a[i] - a[i + ONE], g[i] - g[i + ONE]
        both = w0 + w1
        turns += (w0 > 0.0) & (w1 <= 0.0)
        towards, back = -both * g0, both * g1
        dips += (towards > 0.0) & (back > 0.0) & (dip * (towards + back) > both * both)
        rate = max(abs(w0), abs(w1))
        turns_round = ((w0 > 0.0) != (w1 > 0.0)) | starting
        near = (min(abs(r0), abs(r1)) < rate * h) & turns_round
        crosses = ((r0 > 0.0) != (r1 > 0.0)) | near
        fastest = larger(fastest, rate if crosses else 0.0)
        speed = larger(speed, abs(v[i]))
    return turns, dips > 0, fastest, speed


@part
def _slack_of(span: Span) -> float:
    """The step of velocity Verlet, whose rates count as 0 near 0: see ``keep_peaks``; else 0."""
    return float(span.h) if span.off > 0.0 else 0.0


@part
def keep_peaks(
    seen: Seen, before: Motion, after: Motion, span: Span, lo: int, hi: int, dips: bool,
    chain: Terms,
) -> None:  # fmt: skip
    """The maxima of contact forces within a step, of the contacts that ``scan`` finds.

    ``slack`` is 0, and h for velocity
    Verlet: its rates are off by h^2 / 6 times the jerk, so rates count as 0 up to six times that,
    if the jerk stays the same.
    """
    begin, time, h, slack = span.begin, span.end, span.h, _slack_of(span)
    u0, v0, a = before
    u, v, g = after
    peak_force, peak_time, dip = seen.force, seen.time, DIP * h
    for i in range(lo, hi - 1):
        w0, w1 = v0[i] - v0[i + 1], v[i] - v[i + 1]
        if not dips and not (w0 > 0 and w1 <= 0):
            continue
        g0, g1 = a[i] - a[i + 1], g[i] - g[i + 1]
        near, both = slack * abs(g1 - g0), w0 + w1
        turns = w0 + near > 0 and w1 - near <= 0
        towards, back = -both * g0, both * g1
        dips_here = towards > 0 and back > 0 and dip * (towards + back) > both * both
        if not turns and not dips_here:
            continue
        r0, r1 = overlap_of(u0, i, chain), overlap_of(u, i, chain)
        # The largest overlap possible, with the largest change of rate that both ends allow.
        reach = max(r0, r1) + h * (abs(w0) + abs(w1) + h * (abs(g0) + abs(g1)))
        if with_stiffness(hertz_force(reach), i, chain) <= peak_force[i]:
            continue
        # The ends count, too: rounding may hide a maximum at one of them.
        ends = with_stiffness(hertz_force(max(r0, r1)), i, chain)
        if ends > peak_force[i]:
            peak_force[i] = ends
            peak_time[i] = time if r1 > r0 else begin
        start, end = ends_of_contact(before, after, span, i, lo, chain)
        force, s = highest(start, end, h, with_stiffness(1.0, i, chain), 0.0, 0.5, 0.0)
        if force > peak_force[i]:
            peak_force[i], peak_time[i] = force, begin + s * h


@part
def _range(before: Motion, after: Motion, i: int, h: float, slack: float, chain: Terms) -> Any:
    """Bounds of a contact force within a step; twice 0 for a contact that stays open."""
    u0, v0, a = before
    u, v, g = after
    r0, r1 = overlap_of(u0, i, chain), overlap_of(u, i, chain)
    w0, w1 = float(v0[i] - v0[i + 1]), float(v[i] - v[i + 1])
    least, most = min(r0, r1), max(r0, r1)
    if most <= 0.0 and not w0 > 0.0 > w1:
        return 0.0, 0.0
    g0, g1 = float(a[i] - a[i + 1]), float(g[i] - g[i + 1])
    near, both = slack * abs(g1 - g0), w0 + w1
    towards, back = -both * g0, both * g1
    turns = (w0 + near > 0.0) != (w1 - near > 0.0) or (w0 - near > 0.0) != (w1 + near > 0.0)
    if turns or (towards > 0.0 and back > 0.0 and DIP * h * (towards + back) > both * both):
        reach = h * (abs(w0) + abs(w1) + h * (abs(g0) + abs(g1)))
        least, most = least - reach, most + reach
    return (
        with_stiffness(hertz_force(least), i, chain), with_stiffness(hertz_force(most), i, chain)
    )  # fmt: skip


@part
def _ends(before: Motion, after: Motion, span: Span, i: int, lo: int, chain: Terms) -> Any:
    """Motion of a contact at the start and the end of a step, and its force there."""
    # By ``ends_of_contact`` runs that observe first pulses took 1.17 times as long (measured).
    leg, begin, off = span.leg, span.begin, span.off
    start = motion_of_contact(before.u, before.v, i, lo, leg, begin, off, chain)
    end = motion_of_contact(after.u, after.v, i, lo, leg, begin + span.h, off, chain)
    f0 = with_stiffness(hertz_force(start[0]), i, chain)
    return start, end, f0, with_stiffness(hertz_force(end[0]), i, chain)


@compiled
def observe(
    watch: Watch, before: Motion, after: Motion, step: Span, lo: int, hi: int, chain: Terms
) -> None:
    """Look at the contacts of the window, and at gauges in granules, within a step."""
    begin, h, nothing = step.begin, step.end - step.begin, (0.0, 0.0, 0.0, 0.0)
    slack = h if step.off > 0.0 else 0.0
    span = Span(step.leg, begin, step.end, h, step.off)
    for i in range(lo, hi - 1):
        least, most = _range(before, after, i, h, slack, chain)
        if has_news(watch.signals[i], least, most):
            start, end, f0, f1 = _ends(before, after, span, i, lo, chain)
            motion = Step(begin, h, start, end, nothing, nothing, 1.0, 1.0)
            look(watch, i, motion, f0, f1, True)
    for k in range(watch.contacts[0], watch.signals.size):
        s = watch.signals[k]
        i, j = s.contact, s.other
        least, most = _range(before, after, i, h, slack, chain)
        if j >= 0:
            other_least, other_most = _range(before, after, j, h, slack, chain)
            least, most = least + other_least, most + other_most
        if has_news(s, s.weight * least, s.weight * most):
            start, end, f0, f1 = _ends(before, after, span, i, lo, chain)
            other_start, other_end = nothing, nothing
            if j >= 0:
                other_start, other_end, g0, g1 = _ends(before, after, span, j, lo, chain)
                f0, f1 = f0 + g0, f1 + g1
            motion = Step(begin, h, start, end, other_start, other_end, 1.0, 1.0)
            look(watch, k, motion, s.weight * f0, s.weight * f1, True)


@part
def keep_ends(seen: Seen, u: Array, lo: int, hi: int, time: float, chain: Terms) -> None:
    """Keep forces of contacts that are pressed hardest at the end of a run."""
    for i in range(lo, hi - 1):
        force = with_stiffness(hertz_force(overlap_of(u, i, chain)), i, chain)
        if force > seen.force[i]:
            seen.force[i], seen.time[i] = force, time


_QUIET_GRANULES = 8

_QUIET = 1e-3
"""Largest overlap and velocity of a quiet granule, over those of the leading wave. Derived in
``left_behind``; the longest steps leave 8e-4 behind a wave by their errors, usual ones 1e-7."""

_IMPACT = 1.3
"""F / v^1.2, above that of a granule running into a wall, (5/4)^(3/5) = 1.14, and of a solitary
wave and its fastest granule (1.01): see ``_strength``."""

_SLOWER = 0.95
"""Granules left behind press less than this fraction of the peaks that they could raise."""

_LOOSENED = 1.2
"""Largest force of a wave at an end whose last granules drift apart, over its height; 1.173
measured, with up to six such granules and gaps of 0.001 to 20 overlaps."""


@part
def _strength(force: float, velocity: float) -> float:
    """Largest force that a part of the chain with these largest values can cause after one pulse.

    This is not proved. In 6,787 scenes with one pulse, N 2 to 41, LM_ratio 0.1 to 100, n 1.001 to
    101, no peak was missed because of it.
    """
    return max(force, _IMPACT * max(velocity, 0.0) ** 1.2)


@part
def _fastest(v: Array, i: int) -> float:
    """The velocity with which a granule may run into others, for ``_strength``."""
    return max(float(v[i]), float(v[i] - v[i + ONE]))


@part
def left_behind(u: Array, v: Array, peak_force: Array, lo: int, hi: int) -> int:
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
    - What lies behind is weak: it cannot reach the peak of any contact from there back, nor the
      force of the leading wave (``_strength``, with margins). After a single pulse, which leaves
      its strongest waves ahead, no contact is pressed harder later than the hardest now, or than
      the fastest granule can press by running into one at rest. (After several pulses it can be: a
      broad packet can break up into stronger waves.) At the free end the leading wave throws off
      the last granules, and a later wave throws granules against these slower ones, with forces of
      up to 1.17 times its height (``_LOOSENED``).
    """
    crest = hi - 1
    while crest > lo and max(u[crest - 1] - u[crest], 0) >= u[crest] - u[crest + 1]:
        crest -= 1
    if crest == lo:
        return lo
    # The contact behind the hardest pressed one has just had its peak.
    leading = peak_force[crest - 1]
    quiet_overlap, quiet_velocity = _QUIET * leading ** (2 / 3), _QUIET * leading ** (5 / 6)
    weakest_peak, hardest, fastest, quiet, cut = leading, 0.0, 0.0, 0, lo
    for i in range(lo, crest):
        r, speed = float(u[i] - u[i + 1]), float(v[i])
        weakest_peak = min(weakest_peak, peak_force[i])
        hardest, fastest = max(hardest, hertz_force(r)), max(fastest, _fastest(v, i))
        is_quiet = r <= quiet_overlap and abs(speed) <= quiet_velocity
        quiet = quiet + 1 if is_quiet else 0
        if quiet >= _QUIET_GRANULES:
            if _LOOSENED * _strength(hardest, fastest) >= _SLOWER * weakest_peak:
                break
            cut = i + 1 - _QUIET_GRANULES
    return cut


@part
def is_settled(u: Array, v: Array, peak_force: Array, lo: int, hi: int) -> bool:
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
def leave_behind_in(
    u: Array, v: Array, g: Array, peak_force: Array, lo: int, hi: int, run: Progress
) -> int:
    """Leave behind granules that cannot change a peak; returns where the window begins now.

    The momentum and the energy of the granules left behind are added to ``run``.
    """
    cut = left_behind(u, v, peak_force, lo, hi)
    if cut > lo:
        run.momentum += momentum_of(v, lo, cut, None)
        run.energy += energy_of(u, v, lo, cut, None)
        accelerate_pushed(u, g, run.push, cut, None)
    return cut


@compiled_and_kept(**UNCOUNTED)  # an eighth less to compile
def march(
    steps: Steps, chain: Chain | None, start: Start, state: State, seen: Seen, watch: Watch | None,
    ending: Ending, control: FloatArray,
) -> Outcome:  # fmt: skip
    """Integrate a chain; return what happened.

    Parameters
    ----------
    steps, chain, start, ending
        The rules for steps, and the applied force; the chain, None if it is uniform; its
        initial state; the end of the run.
    state, seen, watch
        Filled in, displacement and velocity at the end too, without ``leave_behind``; ``watch``,
        where first pulses are wanted, only with a chain. The state has N + 1 columns.
    control
        If [0] is set to -1 from outside, the run stops; a positive number there is the number of
        checks, one every million steps of a granule, after which the run stops by itself. [1] has
        the time reached, [2] the number of checks so far.
    """
    run, rows, legs = state.progress[0], state.rows, steps.legs
    verlet, tolerance, stages = steps.verlet, steps.tolerance, steps.drifts.size
    granules, usual = rows.shape[1] - 1, ending.usual
    record, has_wall = seen.record, seen.force.size == granules
    after, before = Motion(rows[0], rows[1], rows[2]), Motion(rows[3], rows[4], rows[5])
    u, v, g = after
    u[granules] = 0.0 if has_wall else FREE_END
    lo, hi, spent, time = 0, min(start.moving, granules), 0, legs[0, START]
    run.time, next_check, pushed = time, CHECK, pushed_legs(legs)
    if start.motion.size > 0 or chain is not None:
        begin_run(after, start.motion, granules, seen, run, chain)
    status = STOPPED if is_stopped(control) else DONE
    run_end, next_end = math.inf, math.inf if math.isnan(usual) else CHECK
    for number in range(legs.shape[0]):
        if status != DONE or time >= run_end:
            break
        leg, over = legs[number], number >= pushed
        start_leg(leg, after, seen, run, lo, chain)
        since, until = leg[START], min(leg[END], run_end)
        usual_step = (leg[END] - since) / leg[STEPS]
        in_leg = int(leg[STEPS])
        if until < leg[END]:
            in_leg = math.ceil((until - since) / usual_step)
        full = (until - since) / in_leg
        h, whole, part, level = full, 0, 0, 0
        while whole < in_leg:
            begin = since + whole * full + part * h
            is_last = whole + 1 == in_leg and part + 1 == 1 << level
            span = Span(
                leg, begin, until if is_last else begin + h, h, h * h / 6 if verlet else 0.0
            )
            copy_motion(after, before, lo, hi + 1)
            reached = hi
            hi = symplectic_step(after, run, steps, span, lo, hi, granules, chain)
            if hi > reached:
                # New granules were at rest before the step; the entry beyond the free end stays as
                # it is.
                for i in range(reached + 1, hi + 1):
                    before.u[i] = u[i] if i == granules else 0.0
                    before.v[i] = before.a[i] = 0.0
            run.granule_evaluations += stages * (hi - lo)
            spent += hi - lo + 50  # granules that cost as much as a step by itself
            if spent >= LOOK:
                spent = 0
                control[2] += 1
                if is_stopped(control):
                    status = STOPPED
                    break
            run.evaluations += stages
            if verlet:
                turns, dips = 0, True
            else:
                turns, dips, fastest, speed = scan(
                    before, after, h, begin < steps.starting, lo, hi, chain
                )
                felt = fastest**3 * h**5 > (tolerance * speed) ** 2
                if tolerance > 0 and level < DEEPEST and felt:
                    copy_motion(before, after, lo, hi + 1)  # undone
                    level, part, h = level + 1, 2 * part, h / 2
                    continue
            run.steps += 1
            part += 1
            time = span.end
            on_wall = 1 if hi == granules and has_wall else 0
            if turns > 0 or dips:
                keep_peaks(seen, before, after, span, lo, hi + on_wall, dips, chain)
            if watch is not None:
                observe(watch, before, after, span, lo, hi + on_wall, chain)
            if leg[SHAPE] != 0:
                run.work += work_in_step(before, after, span, lo, chain)
            if chain is not None and on_wall == 1:
                run.wall += impulse_in_step(granules - 1, before, after, span, chain)
            if chain is not None and chain.fixed.size > 0:
                run.wall += impulse_on_fixed(before, after, span, chain, seen.force.size)
            if chain is not None and has_piston(chain):
                given = impulse_in_step(0, before, after, span, chain)
                run.piston += given
                run.work += given * leg[VELOCITY]
                run.moved += given * abs(leg[VELOCITY])
            if run.kept < record.time.size and record.time[run.kept] <= time:
                run.kept = keep_history(record, run.kept, before, after, span, lo, hi, chain)
            if level == 0:
                whole, part = whole + 1, 0
            elif part % 2 == 0:
                while level > 0 and part % 2 == 0:
                    level, part, h = level - 1, part // 2, h * 2
                if level == 0:
                    whole, part = whole + part, 0
            if watch is not None and time >= next_end and level == 0:
                run_end = max(usual_end(watch, usual, next_end, run_end), time)
                next_end = min(next_end + CHECK, run_end) if run_end > time else math.inf
                if min(run_end, leg[END]) != until:  # the rest is cut into equal steps again
                    whole, since, until = 0, time, min(run_end, leg[END])
                    in_leg = math.ceil((until - since) / usual_step)
                    h = full = (until - since) / max(in_leg, 1)
            if time >= next_check:
                next_check = time + CHECK
                control[1] = time
                energy = run.energy + energy_of(u, v, lo, hi, chain)
                if is_diverged(energy, run.given, run.work, run.moved, chain):
                    status = DIVERGED
                    break
                if chain is None and ending.leave_behind and over:
                    lo = leave_behind_in(u, v, g, seen.force, lo, hi, run)
                    if hi == granules and is_settled(u, v, seen.force, lo, hi):
                        run_end = time
                        break
    momentum = run.momentum + momentum_of(v, lo, hi, chain)
    energy = run.energy + energy_of(u, v, lo, hi, chain)
    if is_diverged(energy, run.given, run.work, run.moved, chain):
        status = DIVERGED
    keep_ends(seen, u, lo, hi + (1 if hi == granules and has_wall else 0), time, chain)
    return Outcome(
        status, run.steps, run.evaluations, run.granule_evaluations, time, run.work + run.given,
        momentum, energy, run.wall, run.piston, 0.0,
    )  # fmt: skip
