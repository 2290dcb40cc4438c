"""The state of a run, elastic or damped, and the motion of a chain within a step."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import WINDOW, Chain
from hertzchain.observables.compiling import ONE, compiled, part
from hertzchain.observables.compiling import Record as Fields
from hertzchain.observables.observer import (
    hermite,
    hertz_force,
    hertz_force_rate,
    slope_at,
    value_at,
)

Terms = Chain | None
"""The chain of a scene with terms; None for a plain chain, of which the compiler drops branches."""

Progress = Fields
"""A record of ``PROGRESS``, or of ``RUN`` of damped contacts."""

Array = FloatArray
"""Numbers of a run: of its granules or contacts, of a leg, or a control."""

DONE, DIVERGED, STOPPED, TOO_MUCH, STUCK = range(5)
"""Reasons why a run ended. Only adaptive steps have the last two: too much work, and steps that do
not advance."""

DEEPEST = 60
"""Most halvings of a step; with more, time would not advance."""

CHECK = 4.0
"""Natural time units between two checks whether a run goes on, and of what to leave behind."""

LOOK = 1_000_000
"""Work between two checks whether a run is to be stopped, in force evaluations of a granule: 4 to
10 ms."""

LEAST = math.sqrt(float(np.finfo(np.float64).tiny))
"""The least overlap, the smallest normal number. Kernels that take it from NumPy, or use
``np.all``, also load Numba's arraymath and SciPy's linear algebra: a fifth of the time of a short
command."""

PROGRESS = np.dtype(
    [
        (name, np.int64)
        for name in ("kept", "steps", "evaluations", "granule_evaluations")
    ]
    + [
        (name, np.float64)
        for name in (
            "time", "push", "given", "work", "wall", "piston", "moved", "momentum",
            "energy",
        )
    ],
    align=True,
)  # fmt: skip
"""Sums of a run: frames of a history, steps, force evaluations; time of its start,
applied force of the moment; energy at the start, work, impulses of wall and piston, work that a
piston did and took, both counted as positive; momentum and energy of what was left behind."""


class Steps(NamedTuple):
    """Rules for the choice of steps.

    ``legs``, shape (legs, 8), have the steps and the applied force: see ``elastic_chain.START``;
    ``kicks`` and ``drifts`` are the method: see ``methods.SymplecticNystrom``; ``verlet`` says
    whether velocities are those of velocity Verlet: see ``elastic_chain.motion_of_granule``;
    ``tolerance`` and ``starting`` are as in ``methods.Walker``, 0 for steps as given.
    """

    legs: FloatArray
    kicks: FloatArray
    drifts: FloatArray
    verlet: bool
    tolerance: float
    starting: float


class Record(NamedTuple):
    """History of a run: the wanted times, (times,), and the motion at these, (times, ...)."""

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    contact_force: FloatArray


class Seen(NamedTuple):
    """Results of a run for the contacts; the run fills them in.

    Peak forces and times are zero and NaN at the start, shape (N - 1,), or (N,) with a wall, which
    is last. The times of the record increase; the rest of it is zero at the start.
    """

    force: FloatArray
    time: FloatArray
    record: Record


class Motion(NamedTuple):
    """Displacement, velocity and acceleration of the granules, each of shape (N + 1,)."""

    u: FloatArray
    v: FloatArray
    a: FloatArray


class Span(NamedTuple):
    """A step in time: its leg, shape (8,), begin, end to the last digit, and length.

    For ``off`` see ``motion_of_granule``.
    """

    leg: FloatArray
    begin: float
    end: float
    h: float
    off: float


class Start(NamedTuple):
    """Initial state of a chain.

    ``motion`` has displacement and velocity, shape (2, N), or (0, 0) for a chain at rest;
    ``moving`` is the number of granules that may move at the start, N for a run without a front.
    """

    motion: FloatArray
    moving: int


class Ending(NamedTuple):
    """When a run ends before its last leg does.

    If ``usual`` is not NaN, the run ends by itself when its first pulses are over: see
    ``observer.usual_end``, which takes this as the end otherwise. With ``leave_behind`` granules
    that cannot change any peak are left behind, and the run ends when no peak can change: there is
    no final state then, and no record. Only in a plain chain.
    """

    usual: float
    leave_behind: bool


class State(NamedTuple):
    """All that a run changes; allocated outside of the kernels, which then need no memory.

    Parameters
    ----------
    rows
        The motion, zero at the start, shape (6, columns): displacement, velocity and acceleration,
        then the same three at the start of the step. There are N + 1 columns.
    progress
        Zero at the start, shape (1,): see ``PROGRESS``.
    """

    rows: FloatArray
    progress: Any


class Outcome(NamedTuple):
    """Results of a run besides its peaks.

    Parameters
    ----------
    status, end
        DONE or one of the next constants; time reached.
    steps, evaluations, granule_evaluations
        Steps taken; force evaluations of the whole chain, also those of refused steps, with
        adaptive steps those of single granules; force evaluations counted granule by granule.
    work
        Done by the applied force or the piston, and the energy at the start.
    momentum, energy
        Of all granules but a piston, those left behind too; the energy with that in constant
        forces.
    wall_impulse, piston_impulse, dissipated
        Integrals of the forces on the wall and of the piston on granule 2 over time, 0 without one;
        energy lost in dampers.
    """

    status: int
    steps: int
    evaluations: int
    granule_evaluations: int
    end: float
    work: float
    momentum: float
    energy: float
    wall_impulse: float
    piston_impulse: float
    dissipated: float


@part
def is_stopped(control: Array) -> bool:
    """Whether a run is to end: see ``control`` of ``elastic.march``."""
    return control[0] < 0 or 0 < control[0] <= control[2]


def at_the_start(granules: int) -> State:
    """Return a state for the start of a run."""
    return State(np.zeros((6, granules + 1)), np.zeros(1, PROGRESS))


START, END, STEPS, SHAPE, RAMP_START, RAMP_END, FORCE_START, FORCE_END = range(8)
"""Columns of legs: times of leg and ramp, forces at the ends of the ramp, natural units.

The shape is 0 where no force acts, 1 on a linear and 2 on a cosine ramp. Where there is a piston
the last two are its displacement at the start of the leg, and its velocity: see PLACE.
"""

PLACE, VELOCITY = FORCE_START, FORCE_END

FREE_END = 1e30
"""Place of the granule beyond the free end: never reached, never pressed; see ``overlap_of``."""

_GAUSS = (
    (0.06943184420297371, 0.17392742256872692), (0.33000947820757187, 0.3260725774312731),
    (0.6699905217924281, 0.3260725774312731), (0.9305681557970262, 0.17392742256872692),
)  # fmt: skip
"""Four points of Gauss and Legendre from 0 to 1, and their weights."""


@part
def applied_force(leg: Array, time: float) -> float:
    """Applied force of a leg at a time."""
    if leg[SHAPE] == 0:
        return 0.0
    growth = (time - leg[RAMP_START]) / (leg[RAMP_END] - leg[RAMP_START])
    if leg[SHAPE] == 2:
        growth = math.sin(math.pi / 2 * growth) ** 2  # (1 - cos) / 2 has no digits near the start
    return leg[FORCE_START] + (leg[FORCE_END] - leg[FORCE_START]) * growth


@part
def applied_force_rate(leg: Array, time: float) -> float:
    """Rate of the applied force of a leg at a time."""
    if leg[SHAPE] == 0:
        return 0.0
    length = leg[RAMP_END] - leg[RAMP_START]
    slope = (leg[FORCE_END] - leg[FORCE_START]) / length
    if leg[SHAPE] == 2:
        slope *= math.pi / 2 * math.sin(math.pi * (time - leg[RAMP_START]) / length)
    return slope


@part
def overlap_of(u: Array, i: int, chain: Terms) -> float:
    """Overlap of the contact ahead of a granule; negative where it is open."""
    r = float(u[i] - u[i + 1])
    if chain is not None:
        r -= chain.gap[i]
    return r


@part
def with_stiffness(force: float, i: int, chain: Terms) -> float:
    """A force, or its rate, of the contact ahead of a granule, from that at stiffness 1."""
    if chain is not None:
        force *= chain.stiffness[i]
    return force


@part
def has_piston(chain: Terms) -> bool:
    """Whether granule 1 is a piston."""
    if chain is None or chain.inverse_mass[0] > 0:
        return False
    return chain.fixed.size == 0 or chain.fixed[0] > 0


@part
def mass_of(i: int, chain: Terms) -> float:
    """Mass of a granule; 0 for a piston, whose momentum and energy are not the chain's."""
    if chain is None:
        return 1.0
    return 1.0 / chain.inverse_mass[i] if chain.inverse_mass[i] > 0 else 0.0


@part
def _net(u: Array, v: Array, i: int, lo: int, leg: Array, time: float, chain: Terms) -> Any:
    """Acceleration and jerk of a granule (Eq. 1 and its derivative); 0 for the wall."""
    if chain is not None and i == chain.stiffness.size:
        return 0.0, 0.0
    net = rate = 0.0
    if i == (lo if chain is None else chain.pushed):
        net, rate = applied_force(leg, time), applied_force_rate(leg, time)
    if i > lo:
        r = overlap_of(u, i - 1, chain)
        net += with_stiffness(hertz_force(r), i - 1, chain)
        rate += with_stiffness(hertz_force_rate(r, float(v[i - 1] - v[i])), i - 1, chain)
    r = overlap_of(u, i, chain)
    net -= with_stiffness(hertz_force(r), i, chain)
    rate -= with_stiffness(hertz_force_rate(r, float(v[i] - v[i + 1])), i, chain)
    if chain is not None:
        net *= chain.inverse_mass[i]
        rate *= chain.inverse_mass[i]
        net += chain.constant[i]
    return net, rate


@part
def motion_of_granule(
    u: Array, v: Array, i: int, lo: int, leg: Array, time: float, off: float, chain: Terms
) -> Any:
    """Displacement of a granule, its rate, acceleration and jerk.

    The velocities of velocity Verlet are central differences of its displacements. The rate is the
    velocity less ``off`` times the jerk; ``off`` is h^2/6, and 0 for other methods.
    """
    net, jerk = _net(u, v, i, lo, leg, time, chain)
    return float(u[i]), float(v[i]) - off * jerk, net, jerk


@part
def motion_of_contact(
    u: Array, v: Array, i: int, lo: int, leg: Array, time: float, off: float, chain: Terms
) -> Any:
    """Overlap of granules i and i + 1, and its first three derivatives."""
    net, jerk = _net(u, v, i, lo, leg, time, chain)
    net_ahead, jerk_ahead = _net(u, v, i + 1, lo, leg, time, chain)
    jerk -= jerk_ahead
    return overlap_of(u, i, chain), float(v[i] - v[i + 1]) - off * jerk, net - net_ahead, jerk


@part
def work_in_step(before: Motion, after: Motion, span: Span, lo: int, chain: Terms) -> float:
    """Work done by the applied force in a step: four Gauss points, see ``watch.work_done``."""
    i = lo if chain is None else chain.pushed
    leg, begin, h, off = span.leg, span.begin, span.h, span.off
    start = motion_of_granule(before.u, before.v, i, lo, leg, begin, off, chain)
    end = motion_of_granule(after.u, after.v, i, lo, leg, begin + h, off, chain)
    curve = hermite(start, end, h)
    total = 0.0
    for s, weight in _GAUSS:
        total += weight * applied_force(leg, begin + s * h) * slope_at(curve, s)
    return total


@part
def ends_of_contact(
    before: Motion, after: Motion, span: Span, i: int, lo: int, chain: Terms
) -> Any:
    """Motion of a contact at the begin and the end of a step: see ``motion_of_contact``."""
    return (
        motion_of_contact(before.u, before.v, i, lo, span.leg, span.begin, span.off, chain),
        motion_of_contact(after.u, after.v, i, lo, span.leg, span.begin + span.h, span.off, chain),
    )


@part
def impulse_in_step(contact: int, before: Motion, after: Motion, span: Span, chain: Terms) -> float:
    """Integral of the force of a contact over a step, by the points of ``work_in_step``."""
    start, end = ends_of_contact(before, after, span, contact, 0, chain)
    if start[0] <= 0 and end[0] <= 0:
        return 0.0
    h = span.h
    curve = hermite(start, end, h)
    total = 0.0
    for s, weight in _GAUSS:
        total += weight * with_stiffness(hertz_force(value_at(curve, s)), contact, chain)
    return total * h


@part
def impulse_on_fixed(
    before: Motion, after: Motion, span: Span, chain: Chain, contacts: int
) -> float:
    """Integral of the forces on all fixed granules over a step."""
    total = 0.0
    for k in range(chain.fixed.size):
        i = chain.fixed[k]
        if i > 0:
            total += impulse_in_step(i - 1, before, after, span, chain)
        if i < contacts:
            total -= impulse_in_step(i, before, after, span, chain)
    return total


@part
def keep_history(
    record: Record, kept: int, before: Motion, after: Motion, span: Span, lo: int, hi: int,
    chain: Terms,
) -> int:  # fmt: skip
    """Fill in the wanted times up to the end of a step; returns how many are filled in now."""
    leg, begin, end, off = span.leg, span.begin, span.end, span.off
    h = end - begin
    while kept < record.time.size and record.time[kept] <= end:
        s = (record.time[kept] - begin) / h
        for i in range(lo, hi):
            begun = motion_of_granule(before.u, before.v, i, lo, leg, begin, off, chain)
            ended = motion_of_granule(after.u, after.v, i, lo, leg, end, off, chain)
            curve = hermite(begun, ended, h)
            record.displacement[kept, i] = value_at(curve, s)
            record.velocity[kept, i] = slope_at(curve, s) / h
            if i < record.contact_force.shape[1]:
                begun = motion_of_contact(before.u, before.v, i, lo, leg, begin, off, chain)
                ended = motion_of_contact(after.u, after.v, i, lo, leg, end, off, chain)
                force = hertz_force(value_at(hermite(begun, ended, h), s))
                record.contact_force[kept, i] = with_stiffness(force, i, chain)
        kept += 1
    return kept


@part
def momentum_of(v: Array, lo: int, hi: int, chain: Terms) -> float:
    """Momentum of granules lo ... hi - 1, without a piston."""
    total = 0.0
    for i in range(np.uint64(lo), np.uint64(hi)):
        total += mass_of(i, chain) * v[i]
    return total


@part
def energy_of(u: Array, v: Array, lo: int, hi: int, chain: Terms) -> float:
    """Energy of granules lo ... hi - 1, of the contact ahead of each, and in constant forces."""
    total = 0.0
    for i in range(lo, hi):
        r = overlap_of(u, i, chain)
        mass = mass_of(i, chain)
        total += 0.5 * mass * float(v[i]) ** 2 + 0.4 * with_stiffness(hertz_force(r) * r, i, chain)
        if chain is not None:
            total -= mass * chain.constant[i] * u[i]
    return total


@compiled
def _first_kick(u: Array, v: Array, g: Array, kick: float, drift: float, lo: int, hi: int) -> None:
    """Kick by the known accelerations g, and drift."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        v[i] += kick * g[i]
        u[i] += drift * v[i]


@compiled
def _kick_and_drift(
    motion: Motion, g: Array | None, left: float, kick: float, drift: float, lo: int, hi: int,
    chain: Terms,
) -> Any:  # fmt: skip
    """Force, kick and drift in one pass; the force ahead of the last granule is returned.

    Accelerations are kept in ``g``, unless it is None.
    """
    u, v, _ = motion
    for i in range(np.uint64(lo), np.uint64(hi)):
        r = u[i] - u[i + ONE]
        if chain is not None:
            r -= chain.gap[i]
        r = r if r > LEAST else 0.0
        right = r * np.sqrt(r)
        if chain is not None:
            right *= chain.stiffness[i]
        net = left - right
        if chain is not None:
            net *= chain.inverse_mass[i]
            net += chain.constant[i]
        if g is not None:
            g[i] = net
        v[i] += kick * net
        u[i] += drift * v[i]
        left = right
    return left


@part
def accelerate_pushed(u: Array, g: Array, push: float, lo: int, chain: Terms) -> None:
    """Acceleration of the granule under the applied force of the moment."""
    if chain is not None and chain.pushed > 0:
        lo = chain.pushed
        r = u[lo - 1] - u[lo] - chain.gap[lo - 1]
        r = r if r > LEAST else 0.0
        push += r * np.sqrt(r) * chain.stiffness[lo - 1]
    r = u[lo] - u[lo + 1]
    if chain is not None:
        r -= chain.gap[lo]
    r = r if r > LEAST else 0.0
    right = r * np.sqrt(r)
    if chain is not None:
        right *= chain.stiffness[lo]
    net = push - right
    if chain is not None:
        net *= chain.inverse_mass[lo]
        net += chain.constant[lo]
    g[lo] = net


@compiled
def copy_motion(motion: Motion, copy: Motion, lo: int, hi: int) -> None:
    """Copy the motion of granules lo ... hi - 1."""
    u, v, g = motion
    u0, v0, a = copy
    for i in range(np.uint64(lo), np.uint64(hi)):
        u0[i], v0[i], a[i] = u[i], v[i], g[i]


@compiled
def symplectic_step(
    motion: Motion, run: Progress, steps: Steps, span: Span, lo: int, hi: int, granules: int,
    chain: Terms,
) -> int:  # fmt: skip
    """Take one step of a symplectic Nystrom method; returns where the window ends now."""
    u, v, g = motion
    leg, begin, h = span.leg, span.begin, span.h
    kicks, drifts = steps.kicks, steps.drifts
    pushed, push, time, stages = leg[SHAPE] != 0, run.push, begin, drifts.size
    first = chain is None or chain.pushed == 0
    _first_kick(u, v, g, h * kicks[0], h * drifts[0], lo, hi)
    for s in range(1, stages):
        if pushed:
            time += drifts[s - 1] * h
            push = applied_force(leg, time)
        behind = push if first else 0.0
        ahead = _kick_and_drift(motion, None, behind, h * kicks[s], h * drifts[s], lo, hi, chain)
        if chain is not None and not first:
            more = h * kicks[s] * push * chain.inverse_mass[chain.pushed]
            v[chain.pushed] += more
            u[chain.pushed] += h * drifts[s] * more
        if ahead > 0:
            hi = min(hi + WINDOW, granules)
    if pushed:
        push = applied_force(leg, begin + h)
    run.push = push
    behind = push if first else 0.0
    ahead = _kick_and_drift(motion, g, behind, h * kicks[stages], 0.0, lo, hi, chain)
    if chain is not None and not first:
        more = push * chain.inverse_mass[chain.pushed]
        g[chain.pushed] += more
        v[chain.pushed] += h * kicks[stages] * more
    if ahead > 0 and hi < granules:
        if chain is not None:
            ahead *= chain.inverse_mass[hi]
        g[hi] = ahead
        hi = min(hi + WINDOW, granules)
    return hi


DIVERGED_ENERGY = 10.0
"""Energy over the work done by the applied force in a run that has diverged. Stable steps that are
too long for the work of a short pulse gave up to 2 (measured)."""


@part
def is_diverged(energy: float, given: float, work: float, moved: float, chain: Terms) -> bool:
    """Whether the chain has far more energy than it was given, at the start and by work.

    A piston that goes back under a load takes more energy than it gave, as constant forces do work.
    ``moved`` is the work of the piston, with both signs counted as positive.
    """
    if has_piston(chain):
        return not abs(energy) <= DIVERGED_ENERGY * (moved + abs(given))
    return not energy <= DIVERGED_ENERGY * (work + given)


@part
def begin_run(
    motion: Motion, start: Array, granules: int, seen: Seen, run: Progress, chain: Terms
) -> None:
    """Accelerations, energy and contact forces at the start, without the applied force."""
    u, v, g = motion
    for i in range(start.shape[1]):
        u[i], v[i] = start[0, i], start[1, i]
    run.given = energy_of(u, v, 0, granules, chain)
    before = with_stiffness(hertz_force(overlap_of(u, 0, chain)), 0, chain)
    for i in range(granules):
        force = with_stiffness(hertz_force(overlap_of(u, i, chain)), i, chain)
        if i > 0:
            net = before - force
            if chain is not None:
                net *= chain.inverse_mass[i]
                net += chain.constant[i]
            g[i] = net
        before = force
        if i < seen.force.size and force > 0:
            seen.force[i], seen.time[i] = force, run.time


@part
def start_leg(leg: Array, motion: Motion, seen: Seen, run: Progress, lo: int, chain: Terms) -> None:
    """Change the applied force, or the motion of a piston, at the start of a leg.

    Doing this twice does no harm.
    """
    u, v, g = motion
    run.push = applied_force(leg, leg[START])
    if has_piston(chain):
        u[0], v[0] = leg[PLACE], leg[VELOCITY]
        # A piston that turns round causes a maximum between two steps.
        force = with_stiffness(hertz_force(overlap_of(u, 0, chain)), 0, chain)
        if force > seen.force[0]:
            seen.force[0], seen.time[0] = force, leg[START]
    accelerate_pushed(u, g, run.push, lo, chain)


@part
def pushed_legs(legs: Array) -> int:
    """Number of legs up to the last one with a force."""
    count = 0
    for k in range(legs.shape[0]):
        if legs[k, SHAPE] != 0:
            count = k + 1
    return count
