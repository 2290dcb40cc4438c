"""Contacts in the intervals between samples of a run, compiled: what ``Watch`` and others keep.

The overlap in an interval is the polynomial that meets all known derivatives at both ends. The
force is that of the law times a ratio, the force of the run over that of the law, at the end where
the contact is pressed harder: so a wrong stiffness or damping in a code still shows in its peaks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.observables.compiling import Record, Records, compiled_and_kept, part
from hertzchain.observables.observer import (
    Piece,
    Polynomial,
    State,
    Step,
    Watch,
    acting_rate,
    curvature_at,
    curve_of,
    extrema,
    force_at,
    has_news,
    law_of,
    look,
    rate_at,
    slope_at,
    value_at,
)

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
"""Points of Gauss and Legendre from -1 to 1, and their weights."""


class Loads(NamedTuple):
    """Results from samples of contacts so far; (contacts,) each, unless stated otherwise.

    Parameters
    ----------
    force, time, scale
        Peaks, in time order so far; force of the run over that of the law, at the largest sample.
    maxima, at_most, at_least
        The two highest maxima between samples, shape (2, contacts); the peaks if errors of the
        forces at first touch are added or subtracted.
    at_touch, fastest
        Largest closing speeds: as a dashpot begins to act, and of all samples.
    on_held, is_integrated, sums
        How often a force counts in that on a wall and fixed granules; whether the integrals need
        the contact; energy lost in dampers, impulse on held bodies, impulse of contact 1, (3,).
    room
        Room for ``extrema``.
    """

    force: FloatArray
    time: FloatArray
    scale: FloatArray
    maxima: FloatArray
    at_most: FloatArray
    at_least: FloatArray
    at_touch: FloatArray
    fastest: FloatArray
    on_held: FloatArray
    is_integrated: NDArray[np.bool_]
    sums: FloatArray
    room: FloatArray


@part
def touch(
    start: State,
    end: State,
    h: float,
    force: float,
    damping: float,
    inverse_mass: float,
    late: float,
) -> tuple[float, State, float]:  # fmt: skip
    """When a dashpot closes within an interval, at whose end it is pressed, and how.

    No polynomial crosses the jump of its force, so that the interval begins there. Before that
    time, the motion is as if the contact did not exist.

    ``start`` and ``end`` are overlap and its derivatives at both ends of the interval of length h;
    ``damping`` is the coefficient of the dashpot, ``inverse_mass`` the sum of 1 / mass of both
    granules, ``late`` the delay of the velocities that damped the motion. Returns the time from the
    start; overlap, rate and two derivatives right after that; and a bound of the error of the rate:
    it holds while the acceleration lies between those of both ends.
    """
    after = end[2] + inverse_mass * (force - late * damping * end[2])
    growth, bend = start[2], (after - start[2]) / h
    low, high = 0.0, h if start[0] < 0.0 else 0.0
    for _ in range(53):  # bisections: to the last digit
        middle = (low + high) / 2
        rise = middle * (start[1] + middle * (growth / 2 + middle * bend / 6))
        low, high = (middle, high) if start[0] + rise < 0.0 else (low, middle)
    speed = start[1] + high * (growth + high * bend / 2)
    change = growth + high * bend - inverse_mass * damping * speed
    doubt = high * abs(after - growth)
    # Shortest time of contact in an interval, over the interval (chosen): lengths divide rates
    return min(high, h * (1.0 - 1e-9)), (0.0, speed, change, np.nan), doubt


@part
def _state(motion: FloatArray, n: int, i: int) -> State:
    """Value and derivatives of one of some motions, shape (4, samples, ...), at a sample."""
    return motion[0, n, i], motion[1, n, i], motion[2, n, i], motion[3, n, i]


@part
def _ratio(
    start: State, end: State, f0: float, f1: float, stiffness: float, damping: float, s: Record,
    otherwise: float,
) -> float:  # fmt: skip
    """Force of the run over that of the law at the end with the larger force, or pull."""
    at, force = (end, f1) if abs(f1) > abs(f0) else (start, f0)
    law = law_of(at[0], at[1], stiffness, damping, s)
    return force / law if force * law > 0.0 else otherwise


@part
def _jumps(start: State, end: State, s: Record) -> bool:
    """Whether the force of a dashpot jumps as it closes within an interval."""
    return bool(s.damping > 0.0 and s.damping_exponent == 0.0 and start[0] <= 0.0 < end[0])


@part
def _opening(curve: Polynomial, first: float, last: float) -> float:
    """Return the place where an overlap passes 0, else the end (0 or 1) with less overlap."""
    rises = last > first
    if min(first, last) >= 0.0:
        return 0.0 if rises else 1.0
    low, high = 0.0, 1.0
    for _ in range(53):  # bisections: to the last digit
        middle = (low + high) / 2
        before = (value_at(curve, middle) > 0.0) != rises
        low, high = (middle, high) if before else (low, middle)
    return (low + high) / 2


@part
def _integrate(
    loads: Loads, p: Piece, k: int, first: float, last: float, late: float, s: Record
) -> None:
    """Add the energy lost in a damper, and the impulse of the force.

    Forces near an opening are smooth in the square root of the distance from there.
    """
    rises, crosses = last > first, min(first, last) <= 0.0
    opening = _opening(p.a, first, last)
    begin = opening if rises else 0.0
    length = (1.0 if rises else opening) - begin
    for n in range(_NODES.size):
        node, worth = (_NODES[n] + 1) / 2, _WEIGHTS[n] / 2 * p.h * length
        if crosses:
            worth, node = 2 * node * worth, node * node
        place = begin + length * (node if rises else 1.0 - node)
        overlap, rate = value_at(p.a, place), slope_at(p.a, place) / p.h
        felt = rate - late * curvature_at(p.a, place) / (p.h * p.h)
        force = law_of(overlap, felt, s.stiffness, s.damping, s)
        damper = force - law_of(overlap, felt, s.stiffness, 0.0, s)
        loads.sums[0] += worth * damper * rate
        loads.sums[1] += worth * p.scale * force * loads.on_held[k]
        if k == 0:
            loads.sums[2] += worth * p.scale * force


@part
def _keep(loads: Loads, k: int, force: float, time: float, error: float) -> None:
    """Keep a maximum between samples, whose force may have an error."""
    loads.at_most[k] = max(loads.at_most[k], force + error)
    loads.at_least[k] = max(loads.at_least[k], force - error)
    if force > loads.maxima[0, k]:
        loads.maxima[1, k], loads.maxima[0, k] = loads.maxima[0, k], force
    elif force > loads.maxima[1, k]:
        loads.maxima[1, k] = force
    if force > loads.force[k]:
        loads.force[k], loads.time[k] = force, time


@part
def _keep_samples(
    signals: Records, loads: Loads, time: FloatArray, motion: FloatArray, force: FloatArray
) -> None:
    """Keep the largest samples, and the ratio of their forces to those of the law."""
    for k in range(signals.size):
        s, best = signals[k], 0
        for n in range(time.size):
            if motion[0, n, k] > 0.0:
                loads.fastest[k] = max(loads.fastest[k], motion[1, n, k])
            if force[n, k] > force[best, k]:
                best = n
        largest = force[best, k]
        loads.at_least[k] = max(loads.at_least[k], largest)
        if largest > loads.force[k]:
            state = _state(motion, best, k)
            loads.scale[k] = _ratio(
                state, state, largest, largest, s.stiffness, s.damping, s, loads.scale[k]
            )
            loads.force[k], loads.time[k] = largest, time[best]


@compiled_and_kept()
def keep_loads(
    signals: Records, loads: Loads, time: FloatArray, motion: FloatArray, force: FloatArray,
    inverse_mass: FloatArray, late: float,
) -> None:  # fmt: skip
    """Add samples, and the intervals between them, to what contacts have shown.

    Parameters
    ----------
    signals, loads
        See ``DampedLaw.signals``: those of contacts alone, with static forces of 0; changed.
    time, motion, force
        Increasing, shape (samples,); overlaps and their first three derivatives, shape
        (4, samples, contacts), the third NaN where it is not known; contact forces of the run,
        shape (samples, contacts).
    inverse_mass
        1 / mass of each granule, and 0 after the last, shape (granules + 1,).
    late
        Delay of the velocities that damped the motion. The energy lost is computed with these
        velocities, because they moved the granules; peaks are computed with the true ones.
    """
    _keep_samples(signals, loads, time, motion, force)
    counts = 0.0
    for k in range(signals.size):
        # Fraction of the largest force below which a maximum between samples does not count: the
        # front of a wave grows by powers of ten within an interval, which may seem a maximum
        counts = max(counts, 1e-4 * loads.force[k])
    nothing = (0.0, 0.0, 0.0, 0.0)
    for k in range(signals.size):
        s = signals[k]
        for n in range(time.size - 1):
            begin, h = time[n], time[n + 1] - time[n]
            start, end = _state(motion, n, k), _state(motion, n + 1, k)
            # Upper bounds of overlap and rate, with the largest changes that both ends allow.
            change = h * (abs(start[2]) + abs(end[2]))
            speed = abs(start[1]) + abs(end[1])
            reach = max(start[0], end[0]) + h * (speed + change)
            most = loads.scale[k] * law_of(reach, speed + change, s.stiffness, s.damping, s)
            is_integrated = loads.is_integrated[k] and (start[0] > 0.0 or end[0] > 0.0)
            if not (most > max(loads.maxima[1, k], counts) or is_integrated):
                continue
            f0, f1 = force[n, k], force[n + 1, k]
            jumps, doubt = _jumps(start, end, s), 0.0
            if jumps:
                shift, start, doubt = touch(
                    start, end, h, f1, s.damping, inverse_mass[k] + inverse_mass[k + 1], late
                )
                begin, h = begin + shift, h - shift
            scale = _ratio(start, end, f0, f1, s.stiffness, s.damping, s, loads.scale[k])
            p = Piece(begin, h, curve_of(start, end, h), curve_of(nothing, nothing, h), scale, 1.0)
            if is_integrated:
                _integrate(loads, p, k, start[0], end[0], late, s)
            count = extrema(p, 0.0, loads.room, s)
            is_maximum = rate_at(p, 0.0, s) > 0.0
            highest = max(force_at(p, 0.0, s), force_at(p, 1.0, s))
            for m in range(1, count + 1):
                if is_maximum:
                    top = force_at(p, loads.room[m], s)
                    highest = max(highest, top)
                    if top > counts and not jumps:
                        _keep(loads, k, top, begin + loads.room[m] * h, 0.0)
                is_maximum = not is_maximum
            if jumps:
                closing = max(start[1], 0.0)
                damper = scale * s.damping
                # Right after a jump velocity Verlet is of first order: maxima there are not sure.
                error = max(damper * doubt, highest - damper * closing)
                _keep(loads, k, damper * closing, begin, error)
                loads.at_touch[k] = max(loads.at_touch[k], closing)
                loads.fastest[k] = max(loads.fastest[k], closing)


@part
def _place_of(at: float, time: FloatArray, n: int) -> tuple[int, float]:
    """The interval of a time, from the n-th on, and the place in it."""
    while n < time.size - 2 and time[n + 1] <= at:
        n += 1
    return n, (at - time[n]) / (time[n + 1] - time[n])


@compiled_and_kept()
def motion_at(
    times: FloatArray, time: FloatArray, granules: FloatArray, displacement: FloatArray,
    velocity: FloatArray,
) -> None:  # fmt: skip
    """Fill in displacements and velocities at times within samples.

    ``times`` increase, shape (times,), as ``time`` of the samples, shape (samples,). ``granules``
    are displacements and their first three derivatives, shape (4, samples, granules), the third NaN
    where it is not known. ``displacement`` and ``velocity`` have the shape (times, granules).
    """
    n = 0
    for m in range(times.size):
        n, place = _place_of(times[m], time, n)
        h = time[n + 1] - time[n]
        for i in range(displacement.shape[1]):
            curve = curve_of(_state(granules, n, i), _state(granules, n + 1, i), h)
            displacement[m, i], velocity[m, i] = value_at(curve, place), slope_at(curve, place) / h


@compiled_and_kept()
def forces_at(
    signals: Records, times: FloatArray, time: FloatArray, motion: FloatArray, force: FloatArray,
    contact_force: FloatArray,
) -> None:  # fmt: skip
    """Fill in contact forces at times within samples, shape (times, contacts).

    Arguments are those of ``motion_at`` and ``keep_loads``.
    """
    nothing, n = (0.0, 0.0, 0.0, 0.0), 0
    for m in range(times.size):
        n, place = _place_of(times[m], time, n)
        h = time[n + 1] - time[n]
        for k in range(signals.size):
            s, start, end = signals[k], _state(motion, n, k), _state(motion, n + 1, k)
            f0, f1 = force[n, k], force[n + 1, k]
            scale = _ratio(start, end, f0, f1, s.stiffness, s.damping, s, 1.0)
            curve = curve_of(start, end, h)
            p = Piece(time[n], h, curve, curve_of(nothing, nothing, h), scale, 1.0)
            contact_force[m, k] = force_at(p, place, s)


@part
def _rate_of(state: State, scale: float, stiffness: float, damping: float, s: Record) -> float:
    """Rate of the force of a contact of a signal at an end of a step."""
    overlap, damping_exponent = max(state[0], 0.0), s.damping_exponent
    return float(
        scale * acting_rate(overlap, state[1], state[2], stiffness, damping, damping_exponent)
    )


@compiled_and_kept()
def observe_samples(
    w: Watch, time: FloatArray, motion: FloatArray, force: FloatArray, inverse_mass: FloatArray,
    late: float,
) -> None:  # fmt: skip
    """Look at all signals in the intervals between samples; arguments as for ``keep_loads``."""
    nothing = (0.0, 0.0, 0.0, 0.0)
    for n in range(time.size - 1):
        for k in range(w.signals.size):
            s = w.signals[k]
            i, j = s.contact, s.other
            is_apart = motion[0, n, i] <= 0.0 and motion[0, n + 1, i] <= 0.0
            if is_apart and (j < 0 or (motion[0, n, j] <= 0.0 and motion[0, n + 1, j] <= 0.0)):
                continue
            begin, h = time[n], time[n + 1] - time[n]
            start, end = _state(motion, n, i), _state(motion, n + 1, i)
            f0, f1, smooth = force[n, i], force[n + 1, i], True
            if j < 0 and _jumps(start, end, s):
                shift, start, _ = touch(
                    start, end, h, f1, s.damping, inverse_mass[i] + inverse_mass[i + 1], late
                )
                begin, h = begin + shift, h - shift
                f0, smooth = s.damping * max(start[1], 0.0), False
            scale = _ratio(start, end, f0, f1, s.stiffness, s.damping, s, 1.0)
            other_start, other_end, other_scale = nothing, nothing, 1.0
            rate0 = _rate_of(start, scale, s.stiffness, s.damping, s)
            rate1 = _rate_of(end, scale, s.stiffness, s.damping, s)
            if j >= 0:
                g0, g1 = force[n, j], force[n + 1, j]
                other_start, other_end = _state(motion, n, j), _state(motion, n + 1, j)
                stiffness, damping = s.other_stiffness, s.other_damping
                other_scale = _ratio(other_start, other_end, g0, g1, stiffness, damping, s, 1.0)
                rate0 += _rate_of(other_start, other_scale, stiffness, damping, s)
                rate1 += _rate_of(other_end, other_scale, stiffness, damping, s)
                f0, f1 = f0 + g0, f1 + g1
            f0, f1 = s.weight * f0, s.weight * f1
            spread = s.weight * h * (abs(rate0) + abs(rate1))
            if has_news(s, min(f0, f1) - spread, max(f0, f1) + spread):
                step = Step(begin, h, start, end, other_start, other_end, scale, other_scale)
                look(w, k, step, f0, f1, smooth)
