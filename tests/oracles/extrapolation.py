"""Chains with any terms by extrapolated midpoints: judges the package's results.

Nothing here is the package's: neither method, events, applied force nor search for maxima. Only the
numbers of a scene are read. With the units of these numbers,

    m_i u_i'' = F_{i-1} - F_i + m_i constant_i,    F = k d^(3/2) + c d^q d'    where granules touch

and, without attraction, never below 0.

- A step is the modified midpoint rule with 2, 4, ... 12 parts, extrapolated to order 12 (Gragg;
  Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.9).
- The law of each contact is kept over a step, whichever way it goes; a step in which one opens or
  closes, or in which a damper begins or ends to pull, is taken again and ends there. Where a
  damper's force has no derivative, just after it closed, the error estimate shortens steps.
- A maximum is found by steps of the method itself, to where the force does not grow any more.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import hertzchain as hc
from tests.oracles.scene_in_si import Numbers, numbers_of, pieces_of, start_of, strokes_of

Floats = NDArray[np.float64]

TOLERANCE = 1e-14
"""Of the error estimate of a step, over the largest overlap and velocity so far."""

CAP = 0.1
"""The longest step, in time units of the fastest contact."""

SURE = 10.0
"""How many times the difference of two runs may be the error of the finer one: 6.4 where a contact
pressed by 2 % of the largest force follows a flight (the largest seen), as finer steps and three
other codes say."""

TOUCH = 1e-13
"""Gap up to which a contact that has closed has not opened, over the length of the scene."""

MOST_STEPS = 500_000
"""Some ten seconds for 30 granules (chosen); granules that collide over and over take more."""

_COLUMNS = 6

_OPEN, _PRESSED, _CUT = 0, 1, 2
"""What a contact is: apart, pressed, or closed with a damper that would pull."""


class Start(NamedTuple):
    """A step's start: displacements and velocities, their slope, the drive, what contacts are."""

    y: Floats
    slope: Floats
    piece: Floats
    time: float
    is_at: Any


class End(NamedTuple):
    """A step's end: displacements and velocities, their slope, columns of increments, scratch."""

    y: Floats
    slope: Floats
    columns: Floats
    before: Floats
    now: Floats


@dataclass(frozen=True, eq=False)
class Found:
    """Peak force of each contact, a wall's last, and displacement and velocity at the end."""

    peak_force: Floats
    displacement: Floats
    velocity: Floats


@dataclass(frozen=True, eq=False)
class Truth:
    """Peaks of Eq. 1.

    Parameters
    ----------
    force
        The largest force of each contact from 0 to the end of the run [N], a wall's last.
    error
        Largest relative difference of the peaks of at least 1e-3 of the largest to those of a run
        with other steps and a wider tolerance.
    """

    force: Floats
    error: float

    def error_of(self, force: Floats) -> float:
        """Largest relative error of peaks of at least 1e-3 of the largest; see ``Truth.error``."""
        if not self.force.max() > 0:
            return float(np.any(force != 0))
        judged = self.force >= 1e-3 * self.force.max()
        return float(np.max(np.abs(force[judged] / self.force[judged] - 1)))


def solve(scene: hc.Scene) -> Truth:
    """Peaks of a scene [N], and how far they can be trusted.

    Raises ArithmeticError where granules collide over and over.
    """
    fine = peaks(scene).peak_force
    rough = peaks(scene, 10 * TOLERANCE, 0.8 * CAP).peak_force
    return Truth(fine, SURE * Truth(fine, 0.0).error_of(rough))


@functools.lru_cache(maxsize=2)
def peaks(scene: hc.Scene, tolerance: float = TOLERANCE, cap: float = CAP) -> Found:
    """Peaks [N] and the end [m, m/s] of a scene."""
    chain, start, pieces = numbers_of(scene), start_of(scene), pieces_of(scene)
    return integrate(
        chain, pieces, strokes_of(scene, pieces), start, scene.end_time, tolerance, cap
    )


def integrate(
    chain: Numbers,
    pieces: Floats,
    strokes: Floats,
    start: Floats,
    end: float,
    tolerance: float = TOLERANCE,
    cap: float = CAP,
) -> Found:
    """Integrate a chain from a displacement and velocity of each granule, shape (2, granules)."""
    state = start.ravel().copy()
    highest, is_done = _march(chain, pieces, strokes, state, end, tolerance, cap * chain.time)
    if not is_done:
        raise ArithmeticError(f"more than {MOST_STEPS} steps")
    return Found(highest, *np.split(state, 2))


def compiled(function: Any) -> Any:
    """A function that only kernels call: Python calling it crashes."""
    how: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return njit(error_model="numpy", **how)(function)


_kernel = njit(cache=True, error_model="numpy")


@_kernel
def push_of(piece: Any, time: float) -> float:
    if piece[4] == 0:
        return 0.0
    if piece[4] == 3:
        return float(piece[1] * math.sin(2 * math.pi * piece[3] * (time - piece[0])))
    passed = (time - piece[0]) / (piece[2] - piece[0])
    if piece[4] == 2:
        passed = math.sin(0.5 * math.pi * passed) ** 2
    return float(piece[1] + (piece[3] - piece[1]) * passed)


@compiled
def _overlap(chain: Any, y: Any, i: int) -> float:
    size = chain.inverse_mass.size
    return float(y[i] - (y[i + 1] if i + 1 < size else 0.0) - chain.gap[i])


@compiled
def _closing(chain: Any, y: Any, i: int) -> float:
    size = chain.inverse_mass.size
    return float(y[size + i] - (y[size + i + 1] if i + 1 < size else 0.0))


@compiled
def _law(chain: Any, y: Any, i: int) -> float:
    """Force of a contact that is pressed."""
    d = max(_overlap(chain, y, i), 0.0)
    force = chain.stiffness[i] * d * math.sqrt(d)
    if chain.damping[i] > 0:
        force += chain.damping[i] * d**chain.exponent * _closing(chain, y, i)
    return float(force)


@compiled
def _law_rate(chain: Any, y: Any, slope: Any, i: int) -> float:
    d, w = max(_overlap(chain, y, i), 0.0), _closing(chain, y, i)
    rate = 1.5 * chain.stiffness[i] * math.sqrt(d) * w
    if chain.damping[i] > 0:
        rate += chain.damping[i] * d**chain.exponent * _closing(chain, slope, i)
        if chain.exponent > 0 and d > 0:
            rate += chain.damping[i] * chain.exponent * d ** (chain.exponent - 1) * w * w
    return float(rate)


@compiled
def _slope(chain: Any, y: Any, push: float, is_at: Any, slope: Any) -> None:
    """Fill in velocities and accelerations."""
    size, behind = chain.inverse_mass.size, 0.0
    for i in range(size):
        ahead = 0.0
        if i == chain.pushed:
            behind += push
        if i < chain.stiffness.size and is_at[i] == _PRESSED:
            ahead = _law(chain, y, i)
        slope[i] = y[size + i]
        slope[size + i] = (behind - ahead) * chain.inverse_mass[i] + chain.constant[i]
        behind = ahead


@compiled
def _step(chain: Any, start: Any, h: float, end: Any) -> None:
    """Fill in state and slope after a step, and ``before`` with its error."""
    columns, before, now = end.columns, end.before, end.now
    for column in range(_COLUMNS):
        parts = 2 * (column + 1)
        part = h / parts
        for i in range(now.size):
            before[i], now[i] = 0.0, part * start.slope[i]
        for m in range(1, parts):
            for i in range(now.size):
                end.y[i] = start.y[i] + now[i]
            push = push_of(start.piece, start.time + m * part)
            _slope(chain, end.y, push, start.is_at, end.slope)
            for i in range(now.size):
                before[i], now[i] = now[i], before[i] + 2 * part * end.slope[i]
        for i in range(now.size):
            columns[column, i] = now[i]
        for other in range(column - 1, -1, -1):
            weight = 1 / (((column + 1) / (other + 1)) ** 2 - 1)
            for i in range(now.size):
                higher = columns[other + 1, i]
                columns[other, i] = higher + weight * (higher - columns[other, i])
    for i in range(now.size):
        end.y[i] = start.y[i] + columns[0, i]
        before[i] = abs(columns[0, i] - columns[1, i])
    _slope(chain, end.y, push_of(start.piece, start.time + h), start.is_at, end.slope)


@compiled
def _rate(chain: Any, state: Any, i: int, is_of_force: bool) -> float:
    """How fast the force of a contact grows, or its overlap."""
    if is_of_force:
        return float(_law_rate(chain, state.y, state.slope, i))
    return float(_closing(chain, state.y, i))


@compiled
def _turn(chain: Any, start: Any, h: float, probe: Any, i: int, is_of_force: bool) -> float:
    """Step to where the force of a contact, or its overlap, is largest or smallest within h."""
    is_growing = _rate(chain, start, i, is_of_force) >= 0
    low, high = 0.0, h
    while high - low > 1e-8 * h:
        x = 0.5 * (low + high)
        _step(chain, start, x, probe)
        if (_rate(chain, probe, i, is_of_force) >= 0) == is_growing:
            low = x
        else:
            high = x
    return high


@compiled
def _beyond(chain: Any, y: Any, i: int, is_at: Any) -> float:
    """How far a contact has left what it is, as a length; negative before it has."""
    d, touch = _overlap(chain, y, i), TOUCH * chain.length
    if is_at[i] == _OPEN:
        return float(d)
    if chain.attraction or chain.damping[i] == 0:
        return float(-d - touch)
    force = _law(chain, y, i) / (chain.stiffness[i] * math.sqrt(chain.length))
    return float(max(-d - touch, force if is_at[i] == _CUT else -force - touch))


@compiled
def _farthest(chain: Any, y: Any, is_at: Any) -> float:
    farthest = -math.inf
    for i in range(chain.stiffness.size):
        farthest = max(farthest, _beyond(chain, y, i, is_at))
    return farthest


@compiled
def _change(chain: Any, y: Any, is_at: Any) -> None:
    """What contacts are that have left what they were."""
    for i in range(chain.stiffness.size):
        if _beyond(chain, y, i, is_at) > 0:
            if is_at[i] != _OPEN and _overlap(chain, y, i) < -TOUCH * chain.length:
                is_at[i] = _OPEN
            else:
                is_at[i] = _CUT if is_at[i] == _PRESSED else _PRESSED


@compiled
def _seen_beyond(chain: Any, start: Any, h: float, end: Any, probe: Any) -> float:
    """Return where in a step a contact is seen to have left what it is; or infinity.

    That is at its end, or in between if the contact comes back.
    """
    seen = h if _farthest(chain, end.y, start.is_at) > 0 else math.inf
    for i in range(chain.stiffness.size):
        near = h * (abs(_closing(chain, start.y, i)) + abs(_closing(chain, end.y, i)))
        if _beyond(chain, start.y, i, start.is_at) + near < 0:
            continue
        may_pull = chain.damping[i] > 0 and not chain.attraction and start.is_at[i] != _OPEN
        for is_of_force in (False, True):
            if is_of_force and not may_pull:
                continue
            if (_rate(chain, start, i, is_of_force) > 0) != (_rate(chain, end, i, is_of_force) > 0):
                x = _turn(chain, start, h, probe, i, is_of_force)
                if _farthest(chain, probe.y, start.is_at) > 0:
                    seen = min(seen, x)
    return seen


@compiled
def _until_change(chain: Any, start: Any, high: float, end: Any) -> float:
    """Step to where the first contact leaves what it is, which one has done after ``high``."""
    low, side = 0.0, 0
    _step(chain, start, high, end)
    at_low = _farthest(chain, start.y, start.is_at)
    at_high = _farthest(chain, end.y, start.is_at)
    # Regula falsi; the value at an end that stays is halved (Illinois).
    while high - low > 1e-15 * high and at_high > 1e-17 * chain.length:
        x = high - at_high * (high - low) / (at_high - at_low)
        if not low < x < high:
            x = 0.5 * (low + high)
            if not low < x < high:
                break
        _step(chain, start, x, end)
        value = _farthest(chain, end.y, start.is_at)
        if value > 0:
            high, at_high = x, value
            at_low *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            low, at_low = x, value
            at_high *= 0.5 if side < 0 else 1.0
            side = -1
    _step(chain, start, high, end)
    return high


@compiled
def _read(chain: Any, y: Any, is_at: Any, highest: Any) -> None:
    for i in range(chain.stiffness.size):
        if is_at[i] == _PRESSED:
            highest[i] = max(highest[i], _law(chain, y, i))


@compiled
def _read_within(chain: Any, start: Any, h: float, end: Any, probe: Any, highest: Any) -> None:
    for i in range(chain.stiffness.size):
        if (
            start.is_at[i] == _PRESSED
            and max(_law(chain, start.y, i), _law(chain, end.y, i)) > 0.5 * highest[i]
            and _rate(chain, start, i, True) >= 0 > _rate(chain, end, i, True)
        ):
            _turn(chain, start, h, probe, i, True)
            highest[i] = max(highest[i], _law(chain, probe.y, i))


@compiled
def _end(width: int) -> Any:
    return End(
        np.zeros(width), np.zeros(width), np.zeros((_COLUMNS, width)), np.zeros(width),
        np.zeros(width),
    )  # fmt: skip


@_kernel
def _march(
    chain: Any, pieces: Any, strokes: Any, y: Any, stop: float, tolerance: float, cap: float
) -> Any:
    """The largest force of each contact, and whether ``stop`` was reached; y is the state then."""
    size, contacts = chain.inverse_mass.size, chain.stiffness.size
    highest, slope, is_at = np.zeros(contacts), np.zeros(2 * size), np.full(contacts, _OPEN)
    end, probe = _end(2 * size), _end(2 * size)
    for i in range(contacts):
        if _overlap(chain, y, i) >= -TOUCH * chain.length:
            is_at[i] = _PRESSED
    deepest, fastest, steps = chain.length, chain.length / chain.time, 0
    for p in range(pieces.shape[0]):
        piece = pieces[p]
        time, until = piece[0], min(piece[2], stop)
        if strokes.shape[0]:
            y[0], y[size] = strokes[p]
        h = min(cap, (until - time) / 16)
        while time < until:
            steps += 1
            if steps > MOST_STEPS:
                return highest, False
            _change(chain, y, is_at)
            _read(chain, y, is_at, highest)
            for i in range(contacts):
                deepest = max(deepest, _overlap(chain, y, i))
            for i in range(size):
                fastest = max(fastest, abs(y[size + i]))
            _slope(chain, y, push_of(piece, time), is_at, slope)
            start = Start(y, slope, piece, time, is_at)
            is_last = time + 1.01 * h >= until
            if is_last:
                h = until - time
            _step(chain, start, h, end)
            error = max(np.max(end.before[:size]) / deepest, np.max(end.before[size:]) / fastest)
            error /= tolerance
            if error > 1 and h > 1e-12 * cap and h > 4e-16 * time:
                h *= max(0.1, 0.8 * error ** (-1 / 11))
                continue
            grown = min(cap, h * min(4.0, 0.8 * max(error, 1e-20) ** (-1 / 11)))
            seen = _seen_beyond(chain, start, h, end, probe)
            if seen <= h:
                x = _until_change(chain, start, seen, end)
                h, is_last = x, is_last and x == h
            _read_within(chain, start, h, end, probe, highest)
            _read(chain, end.y, is_at, highest)
            for i in range(2 * size):
                y[i] = end.y[i]
            time = until if is_last else time + h
            h = grown
    return highest, True
