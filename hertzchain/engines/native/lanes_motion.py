"""A step of plain scenes side by side, lane k of every vector one scene, compiled.

The state is one array of rows of lanes: displacement, velocity and acceleration of each granule,
twice, as steps lead from one half to the other. With the granule beyond the free end ``rows`` is
N + 1. What lanes need besides stands in clocks, an array of rows of float64.
"""

from __future__ import annotations

import math
from typing import Any

from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.elastic import DEEPEST
from hertzchain.engines.native.lanes import (
    bits,
    load,
    magnitude,
    root,
    same_precision,
    store,
    where,
    zero_lanes,
)

(
    LEG, FIRST, FULL, NUMBER, WHOLE, PART, LEVEL, STEP, BEGIN,
    RISES_FROM, RISE, BEFORE, CHANGE, FORM,
    OVER, LEAVES, WORK, BEHIND, EVALUATIONS, ACTIVE, ROWS,
) = range(21)  # fmt: skip
"""Rows of the clocks, one lane each: the leg, its start, its step, how many steps it has, steps
done, parts of a halved one done, how often it is halved; length and start of the present step;
start of the ramp, 1 / its length, force at its start and change of force, its shape; 1 when the
pulse is over; 1 where granules may be left behind; work done, first granule not left behind, force
evaluations, and 1 for a scene that runs."""


@compiled
def larger(a: Any, b: Any) -> Any:
    """The larger of two numbers in each lane."""
    return where(a > b, a, b)


@compiled
def smaller(a: Any, b: Any) -> Any:
    """The smaller of two numbers in each lane."""
    return where(a < b, a, b)


@compiled
def _sine(x: Any) -> Any:
    """Sines of 0 to pi / 4: the Taylor series, whose next term is below 1e-18 of it."""
    y = x * x
    rest = 1.0 - y * (1.0 / 210.0) * (1.0 - y * (1.0 / 272.0))
    rest = 1.0 - y * (1.0 / 110.0) * (1.0 - y * (1.0 / 156.0) * rest)
    rest = 1.0 - y * (1.0 / 42.0) * (1.0 - y * (1.0 / 72.0) * rest)
    return x * (1.0 - y * (1.0 / 6.0) * (1.0 - y * (1.0 / 20.0) * rest))


@compiled
def _growth(clock: Any, time: Any, zero: Any) -> Any:
    """How far a ramp has come at a time, 0 to 1; the same or what is left; its half sine."""
    grown = (time - load(clock, RISES_FROM, zero)) * load(clock, RISE, zero)
    late = grown > 0.5
    near = same_precision(where(late, 1.0 - grown, grown), zero)
    return same_precision(grown, zero), late, _sine(near * (math.pi / 2))


@compiled
def applied_force(clock: Any, time: Any, zero: Any) -> Any:
    """The applied force at a time of each lane, in the precision of ``zero``."""
    form = same_precision(load(clock, FORM, zero), zero)
    grown, late, sine = _growth(clock, time, zero)
    curved = where(late, 1.0 - sine * sine, sine * sine)
    grown = where(form > 1.5, curved, grown)
    before = same_precision(load(clock, BEFORE, zero), zero)
    change = same_precision(load(clock, CHANGE, zero), zero)
    return where(form > 0.5, before + change * grown, zero)


@compiled
def applied_force_rate(clock: Any, time: Any, zero: Any) -> Any:
    """The rate of the applied force at a time of each lane."""
    form = same_precision(load(clock, FORM, zero), zero)
    _, _, sine = _growth(clock, time, zero)
    slope = same_precision(load(clock, CHANGE, zero) * load(clock, RISE, zero), zero)
    curved = slope * sine * root(1.0 - sine * sine) * math.pi
    return where(form > 1.5, curved, where(form > 0.5, slope, zero))


@compiled
def take_step(
    x: Any, clock: Any, kicks: Any, drifts: Any, old: int, new: int, rows: int, lo: int, hi: int,
    pushed: bool, least: float,
) -> int:  # fmt: skip
    """Take one step of all lanes from the old half of the state; returns where the window ends."""
    zero = zero_lanes(x)
    h, time = load(clock, STEP, zero), load(clock, BEGIN, zero)
    step = same_precision(h, zero)
    stages, last = drifts.size, rows - 1
    kick, drift = step * kicks[0], step * drifts[0]
    for i in range(lo, hi):
        v = load(x, old + rows + i, zero) + kick * load(x, old + 2 * rows + i, zero)
        store(x, new + rows + i, v)
        store(x, new + i, load(x, old + i, zero) + drift * v)
    for s in range(1, stages + 1):
        time = time + drifts[s - 1] * h
        left = applied_force(clock, time, zero) if pushed else zero
        here = load(x, new + lo, zero)
        kick = step * kicks[s]
        drift = step * drifts[s] if s < stages else zero
        i = lo
        while i < hi or (i < last and bits(left > zero) != 0):
            ahead = load(x, new + i + 1, zero)
            r = here - ahead
            r = where(r > least, r, zero)
            right = r * root(r)
            net = left - right
            v = load(x, new + rows + i, zero) + kick * net
            store(x, new + rows + i, v)
            if s < stages:
                store(x, new + i, here + drift * v)
            else:
                store(x, new + 2 * rows + i, net)
            left, here = right, ahead
            i += 1
        hi = i
    return hi


@compiled
def refuses(
    x: Any, clock: Any, old: int, new: int, rows: int, lo: int, hi: int, tolerance: float,
    starting: float,
) -> Any:  # fmt: skip
    """The lanes whose step has to be halved: see ``refinement.Refined``."""
    zero = zero_lanes(x)
    h = load(clock, STEP, zero)
    step = same_precision(h, zero)
    begins = load(clock, BEGIN, zero) < starting
    fastest, speed = zero, zero
    u0, u1 = load(x, old + lo, zero), load(x, new + lo, zero)
    v0, v1 = load(x, old + rows + lo, zero), load(x, new + rows + lo, zero)
    for i in range(lo, hi):
        u0_ahead, u1_ahead = load(x, old + i + 1, zero), load(x, new + i + 1, zero)
        v0_ahead, v1_ahead = load(x, old + rows + i + 1, zero), load(x, new + rows + i + 1, zero)
        r0, r1 = u0 - u0_ahead, u1 - u1_ahead
        w0, w1 = v0 - v0_ahead, v1 - v1_ahead
        rate = larger(magnitude(w0), magnitude(w1))
        near = smaller(magnitude(r0), magnitude(r1)) < rate * step
        near = near & (((w0 > zero) ^ (w1 > zero)) | begins)
        crosses = ((r0 > zero) ^ (r1 > zero)) | near
        fastest = larger(fastest, where(crosses, rate, zero))
        speed = larger(speed, magnitude(v1))
        u0, u1, v0, v1 = u0_ahead, u1_ahead, v0_ahead, v1_ahead
    fast, felt = same_precision(fastest, h), same_precision(speed, h) * tolerance
    halved = load(clock, LEVEL, zero)
    return (fast * fast * fast * (h * h * h * h * h) > felt * felt) & (halved < float(DEEPEST))


@compiled
def restore(x: Any, refused: Any, old: int, new: int, rows: int, lo: int, hi: int) -> None:
    """Put lanes that refused a step back to its start."""
    zero = zero_lanes(x)
    for k in range(3):
        for i in range(k * rows + lo, k * rows + hi):
            store(x, new + i, where(refused, load(x, old + i, zero), load(x, new + i, zero)))


@compiled
def add_work(x: Any, clock: Any, old: int, new: int, taken: Any) -> None:
    """Work of the applied force in a step, about: only a motion that diverges is told by it."""
    zero = zero_lanes(x)
    h, begin, work = load(clock, STEP, zero), load(clock, BEGIN, zero), load(clock, WORK, zero)
    force = applied_force(clock, begin, zero) + applied_force(clock, begin + h, zero)
    moved = load(x, new, zero) - load(x, old, zero)
    store(clock, WORK, where(taken, work + same_precision(force * moved, h) * 0.5, work))
