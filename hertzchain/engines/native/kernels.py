"""Eq. 1 in natural units, compiled: the loops that cost time, for every method and precision.

What is computed is that of ``in_numpy`` and ``peaks``, which read like the formulas; tests hold the
two equal to round-off. Three things are done here only, because they only save time:

- Force, kick and drift of a stage are one loop, so that one square root per granule is what a
  stage costs.
- Granules ahead of the front are not touched. They rest until a force of more than the square root
  of the smallest number reaches them; as the front falls off double-exponentially, the omitted
  values are below round-off.
- Granules that cannot matter any more are left behind, where that is asked for: see
  ``_left_behind``.

``chain`` is an ``equations.Chain`` with an entry for the free end, or None for a plain scene, where
mass and contact stiffness are 1 and stand in no formula: the compiler drops what asks for them. The
force of an overlap r is r sqrt(r), written out in the loops (a function would round elsewhere).
Arrays hold a window of the chain: entry i is granule ``base + i``, and granules lo ... hi - 1 move.
Scenes with terms have no such window: base is 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import njit
from numba.core.caching import FunctionCache
from numba.core.options import DefaultOptions
from numba.core.runtime.nrt import rtsys
from numba.extending import intrinsic, register_jitable

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import equations

START, END, STEPS, SHAPE, RAMP_START, RAMP_END, FORCE_START, FORCE_END = range(8)
"""Columns of legs: times of leg and ramp, forces at the ends of the ramp, natural units.

The shape is 0 where no force acts, 1 on a linear and 2 on a cosine ramp. Where there is a piston
the last two are its displacement at the start of the leg, and its velocity: see PLACE.
"""

PLACE, VELOCITY = FORCE_START, FORCE_END

DONE, DIVERGED, STOPPED, NO_ROOM = range(4)
"""How a run ended. After NO_ROOM it goes on from where it was, in the state of ``with_room``."""

_AHEAD = 8
"""Granules that the window grows by; a whole number of vectors."""

_CHECK = 4.0
"""Natural time units between two looks at whether to go on and what to leave behind."""

_LOOK = 1_000_000
"""Granules times steps between two looks at whether the run is to be stopped: about 10 ms."""

_STEP_IN_GRANULES = 50
"""What a step costs besides its granules, in granules."""

_DIVERGED_ENERGY = 10.0
"""Energy over the work done by the applied force in a run that has diverged. Where steps are
stable, but so long that the work of a short pulse is wrong, 2 was seen."""

_QUIET_GRANULES = 8
_QUIET = 1e-3
"""Largest overlap and velocity of a quiet granule, over those of the leading wave. Derived in
``_left_behind``; the longest steps leave 8e-4 behind a wave by their errors, usual ones 1e-7."""

_AT_REST = 0.1
"""The same of a granule that may be put to rest, over those of a quiet one. Chosen."""

_QUIET_ROUNDING = 1e4
"""Least value of ``_QUIET``, in rounding errors; it counts in float32 alone."""

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

_WAVE_SLOWER = 0.99
"""A wave that is followed alone is lower than this fraction of the weakest peak ahead of it."""

_APART = 64
"""Granules at rest ahead of a wave that is followed alone. Chosen."""

_NEAR = 24
"""Granules between two parts of the window that become one; a part grows less in _CHECK."""

_MOST_LATE = 64
"""The most waves that are followed alone. Chosen."""

_FREE_END = 1e30
"""Where the granule beyond the free end lies: never reached, never pressed; see ``_end_chain``."""

ONE = np.uint64(1)

_EPS, _TINY = range(2)
_SINGLE = float(np.finfo(np.float32).eps), float(np.finfo(np.float32).tiny)
_DOUBLE = float(np.finfo(np.float64).eps), float(np.finfo(np.float64).tiny)
"""Rounding error and least number. Kernels that ask NumPy for them, or for ``np.all``, load Numba's
arraymath and SciPy's linear algebra with it, a fifth of the time that a short command takes."""

_DEEPEST = 60
"""Halvings of a step; below that time does not move."""

_DIP = 0.75
"""Over the step: see ``_turns``. A half would do if overlap rates were parabolas."""

_BINOMIAL = (1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0)

_OUTER, _INNER = 0.8611363115940526, 0.3399810435848563
_OUTER_WEIGHT, _INNER_WEIGHT = 0.17392742256872692, 0.32607257743127308
"""Four points of Gauss and Legendre from -1 to 1, and weights for a step of length 1."""

_DEEPEST_HALF = 12
"""Halvings of the interpolant of a step in the search for its maxima: two that lie closer than a
four-thousandth of a step are as high as each other, to round-off."""


class Record(NamedTuple):
    """Where to keep a history: times, shape (times,), and what is known then, (times, ...)."""

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    contact_force: FloatArray


class State(NamedTuple):
    """All that a run changes; made and held outside of the kernels, which then need no memory.

    Parameters
    ----------
    rows
        The motion, zero at the start, shape (6, columns), in the precision of the run:
        displacement, velocity and acceleration, then the same three at the start of the step. There
        are N + 1 columns, or, where the window moves along, at least ``least_columns``.
    numbers
        Further numbers of that precision, zero at the start, shape (5 + coefficients of the
        method,): see ``_ZERO``.
    counts, totals
        Zero at the start, shapes ``(COUNTS,)`` and ``(TOTALS,)``: see ``_LO``.
    """

    rows: Array
    numbers: Array
    counts: Array
    totals: FloatArray


class Outcome(NamedTuple):
    """What a run found besides its peaks.

    Parameters
    ----------
    status
        DONE, DIVERGED, STOPPED or NO_ROOM.
    steps, evaluations
        Steps taken, and force evaluations of the chain, those of refused steps too.
    granule_evaluations
        Force evaluations counted granule by granule.
    end
        Time reached.
    work
        Done by the applied force or the piston, and the energy at the start.
    momentum, energy
        Of all granules but a piston, those left behind too; the energy with that in constant
        forces.
    wall_impulse
        Integral of the force on the wall over time; 0 at a free end.
    piston_impulse
        Integral of the force of the piston on granule 2 over time; 0 without a piston.
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


# Multiplication and addition may become one instruction; nothing else is reordered.
_HOW: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cfunc_wrapper": True,
}

# What makes no arrays need not count references to them; counting costs a sixth of a run. Numba
# has no public name for that.
_UNCOUNTED = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}


def compiled(function: Any) -> Any:
    """A function that kernels call, compiled; it makes no arrays, and Python cannot call it."""
    return njit(**_HOW, **_UNCOUNTED, no_cpython_wrapper=True)(function)


def _part(function: Any) -> Any:
    """A function that is compiled only in the kernels that call it; elsewhere it is plain Python.

    All kernels compile in two thirds of the time that they take with ``compiled``. Not for the
    loops of a step: LLVM made them slower, by a tenth with velocity Verlet.
    """
    return register_jitable(**_HOW, **_UNCOUNTED)(function)


class _Kept(FunctionCache):
    """Compiled code on disk; whatever is wrong with that, it is compiled again.

    Numba itself lets every problem through: a disk that is full, an index that was cut off. And
    of two processes that keep different versions at the same moment, one can get the other's.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is kept for types of arguments, or None."""
        try:
            # Numba's own method first loads all that it compiles with, a quarter of the time that a
            # short command takes; what is compiled already needs its runtime alone.
            rtsys.initialize(target_context)
            found = None
            with self._guard_against_spurious_io_errors():  # Windows: another process writes
                found = self._load_overload(sig, target_context)
            if found is None or tuple(found.signature.args) == tuple(sig):
                return found
        except Exception:  # noqa: S110 - what was damaged can raise anything
            pass
        with suppress(Exception):
            self.flush()  # what cannot be read could not be replaced either
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep code, if that can be done."""
        with suppress(Exception):
            super().save_overload(sig, data)


def compiled_and_kept(function: Any, **how: Any) -> Any:
    """A kernel, called from Python: compiled once, and kept on disk with all that it calls."""
    kernel = njit(**_HOW, **how)(function)
    # njit(cache=True) fails where there is no place to keep it.
    with suppress(RuntimeError, OSError):  # no folder can be written
        kernel._cache = _Kept(function)
    return kernel


def compiled_and_kept_with(*parts: ModuleType, **how: Any) -> Callable[[Any], Any]:
    """As ``compiled_and_kept``, until the kernel's file or one of these modules changes.

    Numba sees changes in the kernel's own file alone: ``parts`` are all others with code that it
    calls, or with types that it takes.
    """

    def keep(function: Any) -> Any:
        kernel = compiled_and_kept(function, **how)
        with suppress(AttributeError, OSError):  # no folder can be written, so nothing is kept
            kept = kernel._cache._cache_file
            files = [Path(str(part.__file__)).stat() for part in parts]
            kept._source_stamp = (
                kept._source_stamp,
                *((file.st_mtime, file.st_size) for file in files),
            )
        return kernel

    return keep


def _compiled_without_nan(function: Any) -> Any:
    # Maxima are found by vector instructions only where NaN need not be told from numbers.
    return njit(
        **{**_HOW, "fastmath": {"contract", "nnan", "nsz"}}, **_UNCOUNTED, no_cpython_wrapper=True
    )(function)


@_part
def _applied_force(leg: Any, time: float) -> float:
    if leg[SHAPE] == 0:
        return 0.0
    growth = (time - leg[RAMP_START]) / (leg[RAMP_END] - leg[RAMP_START])
    if leg[SHAPE] == 2:
        growth = math.sin(math.pi / 2 * growth) ** 2  # (1 - cos) / 2 has no digits near the start
    return leg[FORCE_START] + (leg[FORCE_END] - leg[FORCE_START]) * growth


@_part
def _applied_force_rate(leg: Any, time: float) -> float:
    if leg[SHAPE] == 0:
        return 0.0
    length = leg[RAMP_END] - leg[RAMP_START]
    slope = (leg[FORCE_END] - leg[FORCE_START]) / length
    if leg[SHAPE] == 2:
        slope *= math.pi / 2 * math.sin(math.pi * (time - leg[RAMP_START]) / length)
    return slope


# Indices are unsigned in the loops that cost time: only when the compiler knows that none is
# negative it uses vectors. They get whole arrays, as slices and tuples of arrays cost more than a
# short loop.


@compiled
def _first_kick(u: Any, v: Any, g: Any, kick: Any, drift: Any, lo: int, hi: int) -> None:
    """Kick by the known accelerations g, and drift."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        v[i] += kick * g[i]
        u[i] += drift * v[i]


@compiled
def _kick_and_drift(
    u: Any, v: Any, left: Any, kick: Any, drift: Any, least: Any, lo: int, hi: int,
    chain: Any,
) -> Any:  # fmt: skip
    """Force, kick and drift in one pass; the force ahead of the last granule is returned."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        r = u[i] - u[i + ONE]
        if chain is not None:
            r -= chain.gap[i]
        r = r if r > least else least - least
        right = r * np.sqrt(r)
        if chain is not None:
            right *= chain.stiffness[i]
        net = left - right
        if chain is not None:
            net *= chain.inverse_mass[i]
            net += chain.constant[i]
        v[i] += kick * net
        u[i] += drift * v[i]
        left = right
    return left


@compiled
def _last_kick(
    u: Any, v: Any, g: Any, left: Any, kick: Any, least: Any, lo: int, hi: int,
    chain: Any,
) -> Any:  # fmt: skip
    """Force and kick; accelerations are kept, the force ahead of the last granule returned."""
    for i in range(np.uint64(lo), np.uint64(hi)):
        r = u[i] - u[i + ONE]
        if chain is not None:
            r -= chain.gap[i]
        r = r if r > least else least - least
        right = r * np.sqrt(r)
        if chain is not None:
            right *= chain.stiffness[i]
        net = left - right
        if chain is not None:
            net *= chain.inverse_mass[i]
            net += chain.constant[i]
        g[i] = net
        v[i] += kick * net
        left = right
    return left


@_part
def _accelerate_first(u: Any, g: Any, constants: Any, lo: int, chain: Any) -> None:
    """Acceleration of the first granule under the applied force of the moment."""
    r = u[lo] - u[lo + 1]
    if chain is not None:
        r -= chain.gap[lo]
    r = r if r > constants[_LEAST] else constants[_ZERO]
    right = r * np.sqrt(r)
    if chain is not None:
        right *= chain.stiffness[lo]
    net = constants[_PUSH] - right
    if chain is not None:
        net *= chain.inverse_mass[lo]
        net += chain.constant[lo]
    g[lo] = net


@compiled
def _keep_start(u: Any, v: Any, g: Any, u0: Any, v0: Any, a: Any, lo: int, hi: int) -> None:
    for i in range(np.uint64(lo), np.uint64(hi)):
        u0[i], v0[i], a[i] = u[i], v[i], g[i]


@compiled
def _back_to_the_start(
    u: Any, v: Any, g: Any, u0: Any, v0: Any, a: Any, lo: int, hi: int
) -> None:  # fmt: skip
    for i in range(np.uint64(lo), np.uint64(hi)):
        u[i], v[i], g[i] = u0[i], v0[i], a[i]


@compiled
def _end_step(
    u: Any, v: Any, g: Any, kick: Any, constants: Any, leg: Any, end: float, lo: int, hi: int,
    last: int, chain: Any,
) -> int:  # fmt: skip
    """Last kick of a step; returns where the window ends now."""
    if leg[SHAPE] != 0:
        constants[_PUSH] = _applied_force(leg, end)
    ahead = _last_kick(u, v, g, constants[_PUSH], kick, constants[_LEAST], lo, hi, chain)
    if ahead > 0 and hi < last:
        if chain is not None:
            ahead *= chain.inverse_mass[hi]
        g[hi] = ahead
        hi = min(hi + _AHEAD, last)
    return hi


@compiled
def _symplectic_step(
    u: Any, v: Any, g: Any, kicks: Any, drifts: Any, fractions: Any, constants: Any, leg: Any,
    begin: float, h: float, lo: int, hi: int, last: int,
    chain: Any,
) -> int:  # fmt: skip
    """Take one step of a symplectic Nystrom method; returns where the window ends now."""
    pushed, least = leg[SHAPE] != 0, constants[_LEAST]
    time, stages = begin, drifts.size
    _first_kick(u, v, g, kicks[0], drifts[0], lo, hi)
    for s in range(1, stages):
        if pushed:
            time += fractions[s - 1] * h
            constants[_PUSH] = _applied_force(leg, time)
        ahead = _kick_and_drift(
            u, v, constants[_PUSH], kicks[s], drifts[s], least, lo, hi, chain,
        )  # fmt: skip
        if ahead > 0:
            hi = min(hi + _AHEAD, last)
    return _end_step(
        u, v, g, kicks[stages], constants, leg, begin + h, lo, hi, last, chain,
    )  # fmt: skip


@_part
def _scale(h: float, numbers: Any, kicks: Any, drifts: Any) -> None:
    """Kicks, then drifts, times h, in the precision of the state."""
    for s in range(kicks.size):
        numbers[_COEFFICIENTS + s] = kicks[s] * h
    for s in range(drifts.size):
        numbers[_COEFFICIENTS + kicks.size + s] = drifts[s] * h


def _larger_of_two(_: Any, a: Any, b: Any) -> Any:
    """The larger of two numbers of one type, neither NaN.

    Of ``max`` LLVM makes vector instructions in some places and not in others.
    """

    def lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = context.get_value_type(signature.return_type)
        of_two = ir.FunctionType(kind, [kind, kind])
        maxnum = builder.module.declare_intrinsic("llvm.maxnum", [kind], of_two)
        return builder.call(maxnum, arguments, fastmath=("nnan", "nsz"))

    return (a(a, a), lowered) if a == b else None


_larger: Any = intrinsic(_larger_of_two)


@_compiled_without_nan
def _scan(
    u0: Any, v0: Any, a: Any, u: Any, v: Any, g: Any, h: Any, dip: Any, starting: bool, zero: Any,
    lo: int, hi: int, chain: Any,
) -> Any:  # fmt: skip
    """What a step met: contacts with a maximum, the fastest to open or close, the largest speed.

    Which contacts count is said in ``_turns`` and in ``refinement.Refined``.
    """
    turns, dips, fastest, speed = 0, 0, zero, zero
    for i in range(np.uint64(lo), np.uint64(hi)):
        r0, r1 = u0[i] - u0[i + ONE], u[i] - u[i + ONE]
        if chain is not None:
            r0 -= chain.gap[i]
            r1 -= chain.gap[i]
        w0, w1 = v0[i] - v0[i + ONE], v[i] - v[i + ONE]
        g0, g1 = a[i] - a[i + ONE], g[i] - g[i + ONE]
        both = w0 + w1
        turns += (w0 > zero) & (w1 <= zero)
        towards, back = -both * g0, both * g1
        dips += (towards > zero) & (back > zero) & (dip * (towards + back) > both * both)
        rate = max(abs(w0), abs(w1))
        turns_round = ((w0 > zero) != (w1 > zero)) | starting
        near = (min(abs(r0), abs(r1)) < rate * h) & turns_round
        crosses = ((r0 > zero) != (r1 > zero)) | near
        fastest = _larger(fastest, rate if crosses else zero)
        speed = _larger(speed, abs(v[i]))
    return turns, dips > 0, fastest, speed


@_compiled_without_nan
def _turns(v0: Any, a: Any, v: Any, g: Any, dip: Any, zero: Any, lo: int, hi: int) -> Any:
    """How many contacts have had a maximum within a step, and whether others may have had one.

    The former are those whose overlap rate w changes its sign. The others are those where it may do
    so twice: it keeps its sign at the ends, bends towards 0 at the start and back at the end, and
    bends enough. A parabola c (t - t')^2 - d, d >= 0, that reaches 0 within a step of length h has
    w0 + w1 <= h (w1' - w0') / 2; ``dip`` is h / 2 and a margin. Rates that change their sign three
    times in a step are not looked at.

    The contact ahead of the last granule is looked at too, though it is never pressed: a whole
    number of vectors is quicker than one contact less.
    """
    turns, dips = 0, 0
    for i in range(np.uint64(lo), np.uint64(hi)):
        w0, w1 = v0[i] - v0[i + ONE], v[i] - v[i + ONE]
        g0, g1 = a[i] - a[i + ONE], g[i] - g[i + ONE]
        both = w0 + w1
        turns += (w0 > zero) & (w1 <= zero)
        towards, back = -both * g0, both * g1
        dips += (towards > zero) & (back > zero) & (dip * (towards + back) > both * both)
    return turns, dips > 0


@compiled
def _turns_of_verlet(
    v0: Any, a: Any, v: Any, g: Any, h: Any, zero: Any, lo: int, hi: int
) -> int:  # fmt: skip
    """``_turns``, of velocity Verlet.

    Its rates are off by h^2 / 6 times the jerk, so those count that are nearly 0: by six times that
    while the jerk stays the same.
    """
    turns = 0
    for i in range(np.uint64(lo), np.uint64(hi)):
        w0, w1 = v0[i] - v0[i + ONE], v[i] - v[i + ONE]
        g0, g1 = a[i] - a[i + ONE], g[i] - g[i + ONE]
        near = h * abs(g1 - g0)
        turns += (w0 + near > zero) & (w1 - near <= zero)
    return turns


@_part
def _force(r: float) -> float:
    return r * math.sqrt(r) if r > 0 else 0.0


@_part
def _force_rate(r: float, rate: float) -> float:
    return 1.5 * math.sqrt(r) * rate if r > 0 else 0.0


@_part
def _overlap(u: Any, i: int, chain: Any) -> float:
    r = float(u[i] - u[i + 1])
    if chain is not None:
        r -= chain.gap[i]
    return r


@_part
def _of_contact(force: float, i: int, chain: Any) -> float:
    """A force, or its rate, of the contact ahead of a granule, from that at stiffness 1."""
    if chain is not None:
        force *= chain.stiffness[i]
    return force


@_part
def _has_piston(chain: Any) -> bool:
    return False if chain is None else chain.inverse_mass[0] == 0


@_part
def _mass(i: int, chain: Any) -> float:
    """Mass of a granule; 0 for a piston, whose momentum and energy are not the chain's."""
    if chain is None:
        return 1.0
    return 1.0 / chain.inverse_mass[i] if chain.inverse_mass[i] > 0 else 0.0


@_part
def _net(u: Any, v: Any, i: int, leg: Any, time: float, chain: Any) -> Any:
    """Acceleration and jerk of a granule of a scene with terms; 0 for the wall."""
    if i == chain.stiffness.size:
        return 0.0, 0.0
    net, rate = _applied_force(leg, time), _applied_force_rate(leg, time)
    if i > 0:
        r = _overlap(u, i - 1, chain)
        net = _of_contact(_force(r), i - 1, chain)
        rate = _of_contact(_force_rate(r, float(v[i - 1] - v[i])), i - 1, chain)
    r = _overlap(u, i, chain)
    net -= _of_contact(_force(r), i, chain)
    rate -= _of_contact(_force_rate(r, float(v[i] - v[i + 1])), i, chain)
    if chain is not None:
        net *= chain.inverse_mass[i]
        rate *= chain.inverse_mass[i]
        net += chain.constant[i]
    return net, rate


@_part
def _granule(
    u: Any, v: Any, i: int, lo: int, leg: Any, time: float, off: float,
    chain: Any,
) -> Any:  # fmt: skip
    """Displacement of a granule, its rate, acceleration and jerk (Eq. 1 and its derivative).

    The velocities of velocity Verlet are central differences of its displacements; the rates are
    ``off`` times the jerk less: h^2/6, and 0 for other methods.
    """
    if chain is not None:
        net, rate = _net(u, v, i, leg, time, chain)
        return float(u[i]), float(v[i]) - off * rate, net, rate
    if i == lo:
        pushed, pushed_rate = _applied_force(leg, time), _applied_force_rate(leg, time)
    else:
        r = float(u[i - 1] - u[i])
        pushed, pushed_rate = _force(r), _force_rate(r, float(v[i - 1] - v[i]))
    r = float(u[i] - u[i + 1])
    passed_on, passed_on_rate = _force(r), _force_rate(r, float(v[i] - v[i + 1]))
    jerk = pushed_rate - passed_on_rate
    return float(u[i]), float(v[i]) - off * jerk, pushed - passed_on, jerk


@_part
def _contact(
    u: Any, v: Any, i: int, lo: int, leg: Any, time: float, off: float,
    chain: Any,
) -> Any:  # fmt: skip
    """Overlap of granules i and i + 1, and its first three derivatives; see ``_granule``."""
    overlap, rate = _overlap(u, i, chain), float(v[i] - v[i + 1])
    if chain is not None:
        net, jerk = _net(u, v, i, leg, time, chain)
        net_ahead, jerk_ahead = _net(u, v, i + 1, leg, time, chain)
        jerk -= jerk_ahead
        return overlap, rate - off * jerk, net - net_ahead, jerk
    root = math.sqrt(max(overlap, 0.0))
    ahead = float(u[i + 1] - u[i + 2])
    root_ahead = math.sqrt(max(ahead, 0.0))
    if i == lo:
        behind, behind_rate = _applied_force(leg, time), _applied_force_rate(leg, time)
    else:
        r = float(u[i - 1] - u[i])
        behind, behind_rate = _force(r), _force_rate(r, float(v[i - 1] - v[i]))
    acceleration = behind - 2 * root * overlap + root_ahead * ahead
    rate_ahead = float(v[i + 1] - v[i + 2])
    jerk = behind_rate - 3 * root * rate + 1.5 * root_ahead * rate_ahead
    return overlap, rate - off * jerk, acceleration, jerk


@_part
def _hermite(start: Any, end: Any, h: float) -> Any:
    """Coefficients in s = (t - t_start) / h of the polynomial of degree 7 that meets both ends."""
    x, p, q, c = np.float64(start[0]), start[1] * h, start[2] * h * h / 2, start[3] * h**3 / 6
    # What the cubic from the start misses at the end, in value and three derivatives.
    d = end[0] - x - p - q - c
    d1 = end[1] * h - p - 2 * q - 3 * c
    d2 = end[2] * h * h - 2 * q - 6 * c
    d3 = end[3] * h**3 - 6 * c
    return (
        x, p, q, c,
        35 * d - 15 * d1 + 2.5 * d2 - d3 / 6,
        -84 * d + 39 * d1 - 7 * d2 + d3 / 2,
        70 * d - 34 * d1 + 6.5 * d2 - d3 / 2,
        -20 * d + 10 * d1 - 2 * d2 + d3 / 6,
    )  # fmt: skip


@_part
def _value(c: Any, s: float) -> float:
    return c[0] + s * (
        c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * (c[5] + s * (c[6] + s * c[7])))))
    )


@_part
def _slope(c: Any, s: float) -> float:
    return c[1] + s * (
        2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * (5 * c[5] + s * (6 * c[6] + s * 7 * c[7]))))
    )


@_part
def _curvature(c: Any, s: float) -> float:
    return 2 * c[2] + s * (
        6 * c[3] + s * (12 * c[4] + s * (20 * c[5] + s * (30 * c[6] + s * 42 * c[7])))
    )


@_part
def _maximum(c: Any, low: float, high: float) -> float:
    """Where between low and high a polynomial that rises at low and falls at high is highest."""
    at_low, at_high = _slope(c, low), _slope(c, high)
    s = low + (high - low) * at_low / (at_low - at_high)
    if not low < s < high:
        s = (low + high) / 2
    for _ in range(50):
        slope = _slope(c, s)
        if slope > 0:
            low = s
        else:
            high = s
        following = s - slope / _curvature(c, s)
        if not low <= following <= high:
            following = (low + high) / 2
        if abs(following - s) <= 1e-15:
            return following
        s = following
    return s


@_part
def _bernstein(c: Any, low: float, width: float, b: Any) -> None:
    """Bernstein coefficients of the slope from low to low + width, times width."""
    for k in range(7):
        b[k] = (k + 1) * c[k + 1]
    scale = width
    for k in range(7):
        for j in range(5, k - 1, -1):
            b[j] += low * b[j + 1]
        b[k] *= scale / _BINOMIAL[k]
        scale *= width
    for k in range(1, 7):
        for j in range(6, k - 1, -1):
            b[j] += b[j - 1]


@_part
def _highest(c: Any, known: float, b: Any) -> float:
    """Where in [0, 1] a polynomial of degree 7 is highest between its ends; -1 where nowhere.

    The slope has no more zeros in an interval than its Bernstein coefficients have changes of sign
    there (Descartes). Where they have more than one the interval is halved, and left out where they
    say that no force is above ``known``.

    Parameters
    ----------
    c
        The polynomial, an overlap.
    known
        A force that has to be exceeded.
    b
        Room for the coefficients, shape (7,).
    """
    at, level, place = -1.0, 0, 0
    while True:
        width = 1.0 / (1 << level)
        low = place * width
        _bernstein(c, low, width, b)
        changes, steepest = 0, max(b[0], 0.0)
        for k in range(1, 7):
            changes += (b[k - 1] > 0) != (b[k] > 0)
            steepest = max(steepest, b[k])
        if changes > 0 and _force(_value(c, low) + steepest) > known:
            if changes > 1 and level < _DEEPEST_HALF:
                level, place = level + 1, 2 * place
                continue
            if b[0] > 0 and b[6] <= 0:
                s = _maximum(c, low, low + width)
                force = _force(_value(c, s))
                if force > known:
                    at, known = s, force
        while place % 2 == 1:
            level, place = level - 1, place // 2
        if level == 0:
            return at
        place += 1


@_part
def _keep_peaks(
    peak_force: Any, peak_time: Any, base: int, u0: Any, v0: Any, a: Any, u: Any, v: Any, g: Any,
    lo: int, hi: int, leg: Any, begin: float, time: float, h: float, off: float, dips: bool,
    slack: float, b: Any, chain: Any,
) -> None:  # fmt: skip
    """The maxima of contact forces within a step, of the contacts that ``_turns`` found.

    ``time`` is that of the end of the step, to the last digit; ``slack`` is h for velocity Verlet
    (see ``_turns_of_verlet``) and 0 for other methods.
    """
    dip = _DIP * h
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
        r0, r1 = _overlap(u0, i, chain), _overlap(u, i, chain)
        # As far as it can get, even if its rate changes by all that both ends say.
        reach = max(r0, r1) + h * (abs(w0) + abs(w1) + h * (abs(g0) + abs(g1)))
        if _of_contact(_force(reach), i, chain) <= peak_force[base + i]:
            continue
        # The ends too: where the maximum is at one of them, rounding may hide it.
        ends = _of_contact(_force(max(r0, r1)), i, chain)
        if ends > peak_force[base + i]:
            peak_force[base + i] = ends
            peak_time[base + i] = time if r1 > r0 else begin
        start = _contact(u0, v0, i, lo, leg, begin, off, chain)
        end = _contact(u, v, i, lo, leg, begin + h, off, chain)
        curve = _hermite(start, end, h)
        known = peak_force[base + i]
        if chain is not None:
            known /= chain.stiffness[i]
        s = _highest(curve, known, b)
        if s >= 0:
            peak_force[base + i] = _of_contact(_force(_value(curve, s)), i, chain)
            peak_time[base + i] = begin + s * h


@_part
def _work(
    u0: Any, v0: Any, u: Any, v: Any, lo: int, leg: Any, begin: float, h: float, off: float,
    chain: Any,
) -> float:  # fmt: skip
    """Work done by the applied force in a step: four Gauss points, see ``work.work_done``."""
    start = _granule(u0, v0, lo, lo, leg, begin, off, chain)
    end = _granule(u, v, lo, lo, leg, begin + h, off, chain)
    curve = _hermite(start, end, h)
    total = 0.0
    for node in (-_OUTER, -_INNER, _INNER, _OUTER):
        weight = _OUTER_WEIGHT if abs(node) == _OUTER else _INNER_WEIGHT
        s = (1 + node) / 2
        total += weight * _applied_force(leg, begin + s * h) * _slope(curve, s)
    return total


@_part
def _impulse(
    contact: int, u0: Any, v0: Any, u: Any, v: Any, leg: Any, begin: float, h: float, off: float,
    chain: Any,
) -> float:  # fmt: skip
    """Integral of the force of a contact over a step, by the points of ``_work``."""
    start = _contact(u0, v0, contact, 0, leg, begin, off, chain)
    end = _contact(u, v, contact, 0, leg, begin + h, off, chain)
    if start[0] <= 0 and end[0] <= 0:
        return 0.0
    curve = _hermite(start, end, h)
    total = 0.0
    for node in (-_OUTER, -_INNER, _INNER, _OUTER):
        weight = _OUTER_WEIGHT if abs(node) == _OUTER else _INNER_WEIGHT
        total += weight * _of_contact(_force(_value(curve, (1 + node) / 2)), contact, chain)
    return total * h


@_part
def _keep_history(
    record: Any, kept: int, u0: Any, v0: Any, u: Any, v: Any, lo: int, hi: int,
    leg: Any, begin: float, end: float, off: float, chain: Any,
) -> int:  # fmt: skip
    """Fill in the wanted times up to the end of a step; returns how many are filled in now."""
    h = end - begin
    while kept < record.time.size and record.time[kept] <= end:
        s = (record.time[kept] - begin) / h
        for i in range(lo, hi):
            start = _granule(u0, v0, i, lo, leg, begin, off, chain)
            after = _granule(u, v, i, lo, leg, end, off, chain)
            curve = _hermite(start, after, h)
            record.displacement[kept, i] = _value(curve, s)
            record.velocity[kept, i] = _slope(curve, s) / h
            if i < record.contact_force.shape[1]:
                start = _contact(u0, v0, i, lo, leg, begin, off, chain)
                after = _contact(u, v, i, lo, leg, end, off, chain)
                force = _force(_value(_hermite(start, after, h), s))
                record.contact_force[kept, i] = _of_contact(force, i, chain)
        kept += 1
    return kept


@_part
def _strength(force: float, velocity: float, chain: Any) -> float:
    """How hard contacts can come to be pressed, after one pulse, by what has these largest values.

    Not proved; in 6,787 scenes with one pulse, N 2 to 41, LM_ratio 0.1 to 100, n 1.001 to 101, no
    peak was missed for it. With terms granules ahead are those at the far end, see
    ``kernel_input.can_leave_behind``.
    """
    impact = _IMPACT * max(velocity, 0.0) ** 1.2
    if chain is not None:
        last = chain.stiffness.size - 1
        impact *= chain.stiffness[last - 1] ** 0.4 / chain.inverse_mass[last] ** 0.6
    return max(force, impact)


@_part
def _fastest(v: Any, i: Any, chain: Any) -> float:
    """The velocity with which a granule may run into others, for ``_strength``.

    Through a contact a heavy first granule gives those ahead up to twice its own.
    """
    velocity = float(v[i])
    if chain is not None and i == 0:
        velocity *= 2
    return max(velocity, float(v[i] - v[i + ONE]))


@_part
def _height(
    momentum: float, energy: float, hardest: float, chain: Any
) -> float:  # fmt: skip
    """Height of the solitary wave that has this momentum and energy; 0 where they are not of one.

    All three numbers have to fit: of a given momentum, one wave has another energy than two, or
    than granules that fly.
    """
    mass, softness = 1.0, 1.0
    if chain is not None:
        last = chain.stiffness.size - 1
        mass, softness = 1.0 / chain.inverse_mass[last], chain.stiffness[last - 1] ** (-2 / 3)
    if momentum <= 0 or energy <= 0:
        return 0.0
    if abs(energy * mass / (_WAVE_RATIO * momentum**2) - 1) > _LIKE_A_WAVE:
        return 0.0
    height = (energy / (_WAVE_ENERGY * softness)) ** 0.6
    if not _LEAST_PRESSED * height <= hardest <= (1 + _LIKE_A_WAVE) * height:
        return 0.0
    return float(height)


@_part
def _quiet(u: Any, leading: float, chain: Any) -> Any:
    """Largest overlap and velocity of a quiet granule, behind a wave of this height."""
    noise = max(_QUIET, _QUIET_ROUNDING * (_SINGLE[_EPS] if u.itemsize == 4 else _DOUBLE[_EPS]))
    overlap, velocity = noise * leading ** (2 / 3), noise * leading ** (5 / 6)
    if chain is not None:
        last = chain.stiffness.size - 1
        overlap *= chain.stiffness[last - 1] ** (-2 / 3)
        velocity *= chain.stiffness[last - 1] ** (-1 / 3) * math.sqrt(chain.inverse_mass[last])
    return overlap, velocity


@_part
def _left_behind(
    u: Any, v: Any, peak_force: Any, base: int, lo: int, hi: int, parts: Any, most: int,
    chain: Any,
) -> int:  # fmt: skip
    """How far the window can be closed from behind once the pulse is over.

    The shock has to be one pulse or a striker (``kernel_input.can_leave_behind``). A cut needs all
    of this:

    - Ahead of it lies a quiet stretch: ``_QUIET_GRANULES`` granules whose overlaps and velocities
      are below ``_QUIET`` of those of the leading wave. Contacts that are hardly pressed are hardly
      stiff, k = 3/2 overlap^(1/2), and what crosses d contacts of stiffness k in a time t is
      smaller than what entered by (k t^2)^d / (2d)!. The waves ahead go on at their own speed
      meanwhile, about a granule in a unit of time, so that the stretch only grows: with d = 8 + t
      that factor is below 1e-24 for all t. Nothing passes but waves.
    - What lies behind, up to the quiet stretch before, is either weak, or one solitary wave. It is
      weak where it presses nothing as hard as any contact from there back has been pressed, nor as
      the leading wave does (``_strength``, with a margin). After a single pulse, which leaves its
      strongest waves ahead, no contact is pressed harder later than the hardest now, or than the
      fastest granule can press by running into one at rest. (After several pulses that is not so: a
      broad packet can break up into stronger waves.)
    - One solitary wave, told by momentum, energy and its hardest contact (``_height``), goes on as
      it is. It only meets contacts that lie ahead of it, which waves as strong as the leading one
      have passed: their peaks are compared with it, not those behind. While granules wait ahead it
      presses none harder than its height. At the free end it does: the leading wave throws off the
      last granules; a later wave finds the end loosened, throws granules against those that are
      slower, and presses contacts up to 1.17 times its height. A wave that stays below all
      peaks ahead even so is left behind for good. One that is below them by less is followed alone:
      it becomes a part of the window of its own, with granules at rest between, so that the run
      costs as many windows as there are such waves.

    Parameters
    ----------
    parts
        Number of parts of the window behind the last, and their ends: see ``_LATE``. Further ones
        are filled in.
    most
        How many parts there may be; 0 at the end of the chain, where no wave is followed alone.
    """
    crest = hi - 1
    while crest > lo and max(u[crest - 1] - u[crest], 0) >= u[crest] - u[crest + 1]:
        crest -= 1
    if crest == lo:
        return lo
    # The contact behind the hardest pressed one has just had its peak.
    leading = peak_force[base + crest - 1]
    quiet_overlap, quiet_velocity = _quiet(u, leading, chain)
    weakest_peak, weakest_ahead, strongest = leading, -1.0, 0.0
    begin, end, momentum, energy, hardest, fastest = lo, lo, 0.0, 0.0, 0.0, 0.0
    quiet, still, cut, moves, alone = 0, 0, lo, False, False
    for i in range(lo, crest):
        r, speed = float(u[i] - u[i + 1]), float(v[i])
        at_rest = r <= _AT_REST * quiet_overlap and abs(speed) <= _AT_REST * quiet_velocity
        still = still + 1 if at_rest else 0
        weakest_peak = min(weakest_peak, peak_force[base + i])
        if r <= quiet_overlap and abs(speed) <= quiet_velocity:
            quiet += 1
        else:
            if quiet >= _QUIET_GRANULES:
                if alone:  # the stretch is too short
                    break
                begin = i - _QUIET_GRANULES
                momentum, energy, hardest, fastest = 0.0, 0.0, 0.0, 0.0
            quiet, moves = 0, True
        force = _of_contact(_force(r), i, chain)
        mass = _mass(i, chain)
        hardest, fastest = max(hardest, force), max(fastest, _fastest(v, i, chain))
        momentum += mass * speed
        energy += 0.5 * mass * speed**2 + 0.4 * force * r
        if quiet == _QUIET_GRANULES:
            strength = _strength(hardest, fastest, chain)
            height = _height(momentum, energy, hardest, chain)
            strength = max(strength, height)
            if _LOOSENED * max(strongest, strength) < _SLOWER * weakest_peak:
                strongest = max(strongest, strength)
            else:
                if height == 0 or _LOOSENED * strongest >= _SLOWER * weakest_peak:
                    break
                if weakest_ahead < 0:
                    weakest_ahead = leading
                    for k in range(base + begin, base + crest):
                        weakest_ahead = min(weakest_ahead, peak_force[k])
                alone = _LOOSENED * height >= _SLOWER * weakest_ahead
                if alone and height >= _WAVE_SLOWER * weakest_ahead:
                    break
            # Nothing is taken out of the way of a wave that is followed.
            alone |= moves and parts[_LATE] > 0
            if alone and parts[_LATE] >= most:
                break
            end, moves = i + 1, False
        if alone and still == _APART:
            place = _LATE + 1 + 2 * parts[_LATE]
            parts[place], parts[place + 1] = begin, end
            parts[_LATE] += 1
            alone = False
        if quiet >= _QUIET_GRANULES and not alone:
            cut = i + 1 - _QUIET_GRANULES
    return cut


@_part
def _put_to_rest(
    u: Any, v: Any, g: Any, u0: Any, v0: Any, parts: Any, lo: int, cut: int
) -> None:  # fmt: skip
    """Put granules from lo to cut to rest, so that they just touch, except the parts there."""
    front = cut
    for s in range(parts[_LATE] - 1, -1, -1):
        place = _LATE + 1 + 2 * s
        for i in range(max(lo, parts[place + 1]), front):
            u[i] = u0[i] = u[front]
            v[i] = v0[i] = g[i] = 0
        front = parts[place]
        if front <= lo:
            break


@_part
def _follow(
    u: Any, v: Any, g: Any, u0: Any, v0: Any, parts: Any, lo: int, leading: float,
    chain: Any,
) -> int:  # fmt: skip
    """Close parts of the window from behind, join those that meet; returns where the last begins.

    ``leading`` is the height of the leading wave.
    """
    quiet_overlap, quiet_velocity = _quiet(u, leading, chain)
    for s in range(parts[_LATE]):
        place = _LATE + 1 + 2 * s
        begin, end = parts[place], parts[place + 1]
        i = begin
        while i < end and u[i] - u[i + 1] <= quiet_overlap and abs(v[i]) <= quiet_velocity:
            i += 1
        begin_now = max(begin, min(i, end) - _QUIET_GRANULES)
        for k in range(begin, begin_now):
            u[k] = u0[k] = u[begin_now]
            v[k] = v0[k] = g[k] = 0
        parts[place] = begin_now
    s = 0
    while s < parts[_LATE]:
        place = _LATE + 1 + 2 * s
        is_last = s + 1 == parts[_LATE]
        ahead = lo if is_last else parts[place + 2]
        if parts[place + 1] + _NEAR <= ahead:
            s += 1
            continue
        if is_last:
            lo = parts[place]
        else:
            parts[place + 2] = parts[place]
            for k in range(place, parts.size - 2):
                parts[k] = parts[k + 2]
        parts[_LATE] -= 1
    return lo


@_part
def _settled(u: Any, v: Any, peak_force: Any, base: int, lo: int, hi: int, chain: Any) -> bool:
    """Whether no peak can change any more, once the pulse is over and all granules were reached.

    Granules that fly off at the free end never come back; of the others none can press a contact
    as hard as every contact has been pressed already.
    """
    end = hi
    while end - 1 > lo and u[end - 2] < u[end - 1] and v[end - 2] < v[end - 1]:
        end -= 1
    hardest, fastest = 0.0, 0.0
    for i in range(np.uint64(lo), np.uint64(end - 1)):
        hardest = max(hardest, _of_contact(_force(float(u[i] - u[i + ONE])), i, chain))
        fastest = max(fastest, _fastest(v, i, chain))
    if end - 1 <= lo:
        return True
    strength = _LOOSENED * _strength(hardest, fastest, chain)
    for i in range(np.uint64(base + lo), np.uint64(peak_force.size)):
        if peak_force[i] <= strength:
            return False
    return True


@_part
def _momentum(v: Any, lo: int, hi: int, chain: Any) -> float:
    total = 0.0
    for i in range(np.uint64(lo), np.uint64(hi)):
        if chain is None:
            total += v[i]
        else:
            total += v[i] / chain.inverse_mass[i] if chain.inverse_mass[i] > 0 else 0.0
    return total


@_part
def _energy(u: Any, v: Any, lo: int, hi: int, chain: Any) -> float:
    """Of granules lo ... hi - 1, of the contact ahead of each, and in constant forces."""
    total = 0.0
    for i in range(lo, hi):
        r = _overlap(u, i, chain)
        if chain is None:
            total += 0.5 * float(v[i]) ** 2 + 0.4 * _force(r) * r
        else:
            mass = _mass(i, chain)
            total += 0.5 * mass * float(v[i]) ** 2 + 0.4 * _force(r) * r * chain.stiffness[i]
            total -= mass * chain.constant[i] * u[i]
    return total


@_part
def _end_chain(u: Any, base: int, granules: int, peak_force: Any) -> None:
    """Put the free end, or the wall, behind the last granule, where the window reaches it."""
    if granules - base < u.size:
        u[granules - base] = 0.0 if peak_force.size == granules else _FREE_END


@_part
def _is_stopped(control: Any) -> bool:
    return control[0] < 0 or 0 < control[0] <= control[2]


# What march keeps between two calls, by place in two arrays. _GIVEN is the energy at the start,
# _MOVED the work that a piston did and took, both counted as positive.
# _LATE is the number of parts of the window behind the last, and behind it stand where each of them
# begins and ends, from the rearmost on. _NUMBER is that of the leg, _BASE the granule of column 0,
# _ROOM where the seven numbers begin that ``_highest`` needs.
_LO, _HI, _WHOLE, _PART, _LEVEL, _KEPT, _STEPS, _EVALUATIONS, _GRANULE_EVALUATIONS, _LATE = range(
    10
)
_NUMBER, _BASE, _BEGUN = range(_LATE + 1 + 2 * _MOST_LATE, _LATE + 4 + 2 * _MOST_LATE)
_TIME, _NEXT_CHECK, _WORK, _MOMENTUM, _ENERGY, _GIVEN, _WALL, _PISTON, _MOVED, _ROOM = range(10)

COUNTS, TOTALS = _BEGUN + 1, _ROOM + 7
"""Lengths of both arrays."""

_ZERO, _LEAST, _PUSH, _H, _DIP_TIMES_H, _COEFFICIENTS = range(6)
"""Places among the numbers of a run that have the precision of its state: 0, the least overlap that
is one, the applied force of the moment, the step, ``_DIP`` times it, and where the coefficients of
the method begin, times the step or its square."""

_LEG_DONE, _AT_EDGE, _SETTLED, _DIVERGED, _STOPPED = range(5)
"""Why the steps of march end."""


@_part
def _is_diverged(energy: float, total: Any, chain: Any) -> bool:
    """Whether the chain has far more energy than it was given.

    A piston that goes back under a load takes more than it gave: constant forces do work then.
    """
    if _has_piston(chain):
        return not abs(energy) <= _DIVERGED_ENERGY * (total[_MOVED] + abs(total[_GIVEN]))
    return not energy <= _DIVERGED_ENERGY * (total[_WORK] + total[_GIVEN])


@_part
def _flies(chain: Any) -> bool:
    """Whether granules of a scene with terms move steadily where no contact presses."""
    if chain is None:
        return False
    loaded = 0
    for i in range(chain.constant.size):
        loaded += chain.constant[i] != 0
    return loaded == 0


@_part
def _flight(u: Any, v: Any, lo: int, hi: int, on_wall: int, wait: float, chain: Any) -> float:
    """How long all granules fly freely, at most ``wait``; 0 if a contact presses."""
    for i in range(lo, hi - 1 + on_wall):
        overlap, rate = _overlap(u, i, chain), float(v[i] - v[i + 1])
        if overlap > 0.0:
            return 0.0
        if rate > 0.0:
            wait = min(wait, -overlap / rate)
    return wait


@_part
def _drift(u: Any, v: Any, wait: float, lo: int, hi: int) -> None:
    """Let granules fly."""
    for i in range(lo, hi):
        u[i] += v[i] * wait


@_part
def _leave_behind(
    u: Any, v: Any, g: Any, u0: Any, v0: Any, peak_force: Any, base: int, lo: int, hi: int,
    at_the_end: bool, constants: Any, count: Any, total: Any,
    chain: Any,
) -> int:  # fmt: skip
    """Let go of granules that cannot matter any more; returns where the window begins now.

    ``at_the_end``: whether the window reaches the end of the chain. What is let go keeps its
    momentum and energy, which are counted.
    """
    if count[_LATE] > 0:
        back = _follow(u, v, g, u0, v0, count, lo, peak_force[base + lo], chain)
        total[_MOMENTUM] -= _momentum(v, back, lo, chain)
        total[_ENERGY] -= _energy(u, v, back, lo, chain)
        lo = back
    waits = count[_LATE] > 0 and at_the_end
    if waits:
        # Granules that drift back from the end meet those at rest.
        least = count[_LATE + 2 * count[_LATE]] + 1
        while lo > least and u[lo - 1] > u[lo]:
            lo = max(lo - _QUIET_GRANULES, least)
    most = 0 if at_the_end else _MOST_LATE
    cut = lo
    if not waits:
        cut = _left_behind(u, v, peak_force, base, lo, hi, count, most, chain)
    if cut > lo:
        total[_MOMENTUM] += _momentum(v, lo, cut, chain)
        total[_ENERGY] += _energy(u, v, lo, cut, chain)
        _put_to_rest(u, v, g, u0, v0, count, lo, cut)
        lo = cut
        if chain is not None and count[_LATE] == 0:
            # The formulas of terms ask for the granule behind.
            u[lo - 1] = u0[lo - 1] = u[lo] - 1
        _accelerate_first(u, g, constants, lo, chain)
    return lo


@_part
def _begin(
    u: Any, v: Any, g: Any, granules: int, peak_force: Any, peak_time: Any, total: Any,
    chain: Any,
) -> None:  # fmt: skip
    """Accelerations, energy and forces of contacts at the start; the first granule's come later."""
    total[_GIVEN] = _energy(u, v, 0, granules, chain)
    before = _of_contact(_force(_overlap(u, 0, chain)), 0, chain)
    for i in range(granules):
        force = _of_contact(_force(_overlap(u, i, chain)), i, chain)
        if i > 0:
            net = before - force
            if chain is not None:
                net *= chain.inverse_mass[i]
                net += chain.constant[i]
            g[i] = net
        before = force
        if i < peak_force.size and force > 0:
            peak_force[i], peak_time[i] = force, total[_TIME]


@_part
def _start_leg(
    leg: Any, u: Any, v: Any, g: Any, peak_force: Any, peak_time: Any, constants: Any, lo: int,
    chain: Any,
) -> None:  # fmt: skip
    """Change the applied force, or the motion of a piston, at the start of a leg.

    Doing this twice does no harm.
    """
    constants[_PUSH] = _applied_force(leg, leg[START])
    if _has_piston(chain):
        u[0], v[0] = leg[PLACE], leg[VELOCITY]
        # A piston that turns round makes a maximum, which lies in neither of the steps.
        force = _of_contact(_force(_overlap(u, 0, chain)), 0, chain)
        if force > peak_force[0]:
            peak_force[0], peak_time[0] = force, leg[START]
    _accelerate_first(u, g, constants, lo, chain)


@_part
def _pushed(legs: Any) -> int:
    """How many legs there are up to the last with a force."""
    found = 0
    for k in range(legs.shape[0]):
        if legs[k, SHAPE] != 0:
            found = k + 1
    return found


@_part
def _start_at(start: Any, u: Any, v: Any) -> None:
    for i in range(start.shape[1]):
        u[i], v[i] = start[0, i], start[1, i]


@_part
def _margin(stages: int) -> int:
    """Columns ahead of the window that a step may need."""
    return _AHEAD * (stages + 2)


def least_columns(stages: int) -> int:
    """Columns of a state whose window moves along."""
    return 1024 + 2 * _margin(stages)


def with_room(state: State, granules: int, stages: int) -> State:
    """Return a state after NO_ROOM with its window at the beginning of its columns.

    They are twice as many if the window and what a step may need fill more than half of them.
    """
    count, columns = state.counts, state.rows.shape[1]
    first = count[_LO] if count[_LATE] == 0 else count[_LATE + 1]
    width = count[_HI] - first
    if width + _margin(stages) > columns // 2:
        columns = min(2 * columns, granules + 1)
    rows = np.zeros((len(state.rows), columns), state.rows.dtype)
    rows[:3, :width] = state.rows[:3, first : first + width]
    rows[3, :width] = rows[0, :width]  # no step writes those of granules at rest
    count[_BASE] += first
    count[[_LO, _HI]] -= first
    count[_LATE + 1 : _LATE + 1 + 2 * count[_LATE]] -= first
    return state._replace(rows=rows)


@compiled_and_kept_with(equations, **_UNCOUNTED)  # an eighth less to compile
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
    chain: Any,
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
        Whether velocities are those of velocity Verlet: see ``_granule``.
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
    middle = _COEFFICIENTS + kicks.size
    kicks_h, drifts_h = constants[_COEFFICIENTS:middle], constants[middle:]
    bernstein = total[_ROOM:]
    base, size = count[_BASE], u.size
    _end_chain(u, base, granules, peak_force)
    if count[_BEGUN] == 0:
        count[_BEGUN] = 1
        constants[_LEAST] = math.sqrt(_SINGLE[_TINY] if u.itemsize == 4 else _DOUBLE[_TINY])
        count[_HI] = min(moving, granules)
        total[_TIME], total[_NEXT_CHECK] = legs[0, START], _CHECK
        if start.size > 0:
            _start_at(start, u, v)
        if start.size > 0 or chain is not None:
            _begin(u, v, g, granules, peak_force, peak_time, total, chain)
    zero = constants[_ZERO]
    stages = drifts.size
    margin = _margin(stages)
    grows = base + size <= granules
    last = min(granules - base, size - 1)
    lo, hi, kept = count[_LO], count[_HI], count[_KEPT]
    whole, part, level = count[_WHOLE], count[_PART], count[_LEVEL]
    steps, cost, spent = 0, 0, 0
    time, next_check = total[_TIME], total[_NEXT_CHECK]
    pushed, flies = _pushed(legs), _flies(chain)
    reason = _STOPPED if _is_stopped(control) else _LEG_DONE
    number = count[_NUMBER]
    while reason == _LEG_DONE and number < legs.shape[0]:
        leg, over = legs[number], number >= pushed
        if whole == 0 and part == 0 and level == 0:  # else it goes on after NO_ROOM
            _start_leg(leg, u, v, g, peak_force, peak_time, constants, lo, chain)
        in_leg = int(leg[STEPS])
        full = (leg[END] - leg[START]) / leg[STEPS]
        h = full / (1 << level)
        _scale(h, constants, kicks, drifts)
        while whole < in_leg:
            if grows and hi + margin > size:
                reason = _AT_EDGE
                break
            begin = leg[START] + whole * full + part * h
            constants[_H], constants[_DIP_TIMES_H] = h, _DIP * h
            _keep_start(u, v, g, u0, v0, a, lo, hi + 1)
            reached = hi
            hi = _symplectic_step(
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
                if _is_stopped(control):
                    reason = _STOPPED
                    break
            if tolerance > 0:
                turns, dips, fastest, speed = _scan(
                    u0, v0, a, u, v, g, h, constants[_DIP_TIMES_H], begin < starting, zero, lo, hi,
                    chain,
                )  # fmt: skip
            elif verlet:
                turns, dips = _turns_of_verlet(v0, a, v, g, constants[_H], zero, lo, hi), True
                fastest, speed = zero, zero
            else:
                turns, dips = _turns(v0, a, v, g, constants[_DIP_TIMES_H], zero, lo, hi)
                fastest, speed = zero, zero
            if tolerance > 0 and level < _DEEPEST:
                felt = float(fastest) ** 3 * h**5 > (tolerance * float(speed)) ** 2
                if felt:
                    _back_to_the_start(u, v, g, u0, v0, a, lo, hi + 1)
                    count[_EVALUATIONS] += stages
                    level, part, h = level + 1, 2 * part, h / 2
                    _scale(h, constants, kicks, drifts)
                    continue
            for s in range(count[_LATE]):
                place = _LATE + 1 + 2 * s
                from_, to = count[place], count[place + 1]
                ahead = lo if s + 1 == count[_LATE] else count[place + 2]
                count[place + 1] = _symplectic_step(
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
                _keep_peaks(
                    peak_force, peak_time, base, u0, v0, a, u, v, g, lo, hi + on_wall, leg, begin,
                    time, h, off, dips, h if verlet else 0.0, bernstein, chain,
                )  # fmt: skip
            if leg[SHAPE] != 0:
                total[_WORK] += _work(u0, v0, u, v, lo, leg, begin, h, off, chain)
            if chain is not None and on_wall == 1:
                total[_WALL] += _impulse(granules - 1, u0, v0, u, v, leg, begin, h, off, chain)
            if chain is not None and _has_piston(chain):
                given = _impulse(0, u0, v0, u, v, leg, begin, h, off, chain)
                total[_PISTON] += given
                total[_WORK] += given * leg[VELOCITY]
                total[_MOVED] += given * abs(leg[VELOCITY])
            if kept < record.time.size and record.time[kept] <= time:
                kept = _keep_history(
                    record, kept, u0, v0, u, v, lo, hi, leg, begin, time, off, chain,
                )  # fmt: skip
            if level == 0:
                whole, part = whole + 1, 0
            elif part % 2 == 0:
                while level > 0 and part % 2 == 0:
                    level, part, h = level - 1, part // 2, h * 2
                if level == 0:
                    whole, part = whole + part, 0
                _scale(h, constants, kicks, drifts)
            if time >= next_check:
                next_check = time + _CHECK
                control[1] = time
                energy = total[_ENERGY] + _energy(u, v, lo, hi, chain)
                if _is_diverged(energy, total, chain):
                    reason = _DIVERGED
                    break
                if leave_behind and over:
                    lo = _leave_behind(
                        u, v, g, u0, v0, peak_force, base, lo, hi, base + hi == granules, constants,
                        count, total, chain,
                    )  # fmt: skip
                    if (
                        count[_LATE] == 0
                        and base + hi == granules
                        and _settled(u, v, peak_force, base, lo, hi, chain)
                    ):
                        reason = _SETTLED
                        break
                if flies and leg[SHAPE] == 0 and level == 0:
                    wait = leg[END] - time
                    if kept < record.time.size:
                        wait = min(wait, record.time[kept] - time)
                    idle = int(_flight(u, v, lo, hi, on_wall, wait, chain) / full) - 1
                    if idle > 0:
                        _drift(u, v, idle * full, lo, hi)
                        whole, time = whole + idle, time + idle * full
                        count[_STEPS] += idle  # which no force was evaluated for
                        next_check = time + _CHECK
        if reason == _LEG_DONE:
            number, whole = number + 1, 0
    count[_LO], count[_HI], count[_KEPT], count[_NUMBER] = lo, hi, kept, number
    count[_WHOLE], count[_PART], count[_LEVEL] = whole, part, level
    count[_STEPS] += steps
    count[_EVALUATIONS] += stages * steps
    count[_GRANULE_EVALUATIONS] += stages * cost
    total[_TIME], total[_NEXT_CHECK] = time, next_check
    momentum = total[_MOMENTUM] + _momentum(v, lo, hi, chain)
    energy = total[_ENERGY] + _energy(u, v, lo, hi, chain)
    status = DONE
    if reason == _AT_EDGE:
        status = NO_ROOM
    elif reason == _DIVERGED or _is_diverged(energy, total, chain):
        status = DIVERGED
    elif reason == _STOPPED:
        status = STOPPED
    if status != NO_ROOM:
        on_wall = 1 if hi == granules and peak_force.size == granules else 0
        for i in range(lo, hi - 1 + on_wall):  # what is still being pressed harder at the end
            force = _of_contact(_force(_overlap(u, i, chain)), i, chain)
            if force > peak_force[base + i]:
                peak_force[base + i] = force
                peak_time[base + i] = total[_TIME]
    return Outcome(
        status,
        count[_STEPS],
        count[_EVALUATIONS],
        count[_GRANULE_EVALUATIONS],
        total[_TIME],
        total[_WORK] + total[_GIVEN],
        momentum,
        energy,
        total[_WALL],
        total[_PISTON],
    )
