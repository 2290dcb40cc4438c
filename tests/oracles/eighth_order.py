"""Eq. 1 in SI units by DOP853, with maxima found by stepping to them; judges the package's results.

Nothing here is the package's: neither units, steps, applied force, interpolation nor search for
maxima. Only the numbers of a scene are read.

- Coefficients and error estimate are those of SciPy's DOP853 (Hairer, Norsett, Wanner, Solving
  Ordinary Differential Equations I, section II.10). States are summed with compensation, so that
  rounding errors do not grow with the number of steps.
- Steps end at the corners of the pulse. They are at most CAP natural time units long, a fiftieth of
  the shortest period there is; where a contact opens or closes, the error estimate shortens them.
- A maximum is found by steps of the method itself: from the start of the step in which the overlap
  rate changes its sign, to where the rate is 0. There is no interpolation. Where the rate keeps its
  sign but has a dip, the dip is stepped to first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import DOP853

import hertzchain as hc

Floats = NDArray[np.float64]

CAP = 0.05
"""The longest step [natural time units]."""

TOLERANCE = 1e-16
"""Of an error estimate, over the largest overlap and velocity so far."""

MOST_STEPS = 2_000_000
"""Some ten seconds for 60 granules; a scene that needs more is chaotic."""

_NODES, _STAGES = np.array(DOP853.C, np.float64), np.array(DOP853.A, np.float64)
_WEIGHTS = np.array(DOP853.B, np.float64)
_THIRD, _FIFTH = np.array(DOP853.E3, np.float64), np.array(DOP853.E5, np.float64)
_RATE, _RATE_OF_RATE = 2, 3  # places in what _look finds


class Spheres(NamedTuple):
    """The chain: how many granules, mass [kg], stiffness [N m^-3/2], overlap that counts as 0."""

    granules: int
    mass: float
    stiffness: float
    touch: float


class Room(NamedTuple):
    """State at the start of a step, increments over it, slopes at its stages, and scratch."""

    u: Floats
    v: Floats
    du: Floats
    dv: Floats
    slopes_u: Floats
    slopes_v: Floats
    scratch: Floats


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
    """Peaks of a scene to about 1e-13, and how far that can be trusted.

    Raises
    ------
    ArithmeticError
        If it takes too many steps: a chaotic scene.
    """
    fine, rough = peaks(scene), peaks(scene, 0.8 * CAP, 10 * TOLERANCE)
    return Truth(fine, Truth(fine, 0.0).error_of(rough))


def peaks(scene: hc.Scene, cap: float = CAP, tolerance: float = TOLERANCE) -> Floats:
    """Force of one run, with other steps where asked."""
    chain, shock, end = scene.chain, scene.shock, scene.end_time
    mass = 4 / 3 * math.pi * chain.radius**3 * chain.density
    # Two equal spheres: 4/3 E* sqrt(R*), with E* = E / (2 (1 - nu^2)) and R* = R / 2.
    modulus = chain.young_modulus / (2 * (1 - chain.poisson_ratio**2))
    stiffness = 4 / 3 * modulus * math.sqrt(chain.radius / 2)
    assert isinstance(shock, hc.Pulse | hc.PulseTable)
    length = (shock.peak_force / stiffness) ** (2 / 3)
    unit = math.sqrt(mass * length / shock.peak_force)
    ramps = _ramps(shock, unit)
    first, last = ramps[0][0], ramps[-1][2]
    pieces = [(0.0, 0.0, first, 0.0, 0.0)] if first > 0 else []
    pieces += [*ramps, (last, 0.0, math.inf, 0.0, 0.0)]
    highest = np.zeros(chain.granules - 1)
    done = _march(
        np.array([piece for piece in pieces if piece[0] < end]), end,
        Spheres(chain.granules, mass, stiffness, 1e-60 * length), cap * unit, tolerance,
        highest,
    )  # fmt: skip
    if not done:
        raise ArithmeticError(f"more than {MOST_STEPS} steps")
    return np.asarray(stiffness * highest**1.5)


def _ramps(
    shock: hc.Pulse | hc.PulseTable, unit: float
) -> list[tuple[float, float, float, float, float]]:
    """Start [s] and force [N], end and force, and 1 for a line or 2 for half a cosine (Eq. 2)."""
    if isinstance(shock, hc.PulseTable):
        rows = list(zip(shock.time, shock.force, strict=True))
        return [(*rows[k], *rows[k + 1], 1.0) for k in range(len(rows) - 1)]
    top, n, rise = shock.peak_force, shock.duration_ratio, shock.rise_time
    if rise is None:
        # L_SW with the paper's 139/32 (section 4.1); the pulse carries F0 n t0 / 2.
        wave = 139 / 32 * math.sqrt(3 / (4 * math.pi)) * (math.sqrt(2) / 3) ** (1 / 3) * top * unit
        rise = shock.momentum_ratio * 2 * wave / (n * top)
    kinds = {"cosine": (2.0, 2.0), "triangular": (1.0, 1.0), "cosine-triangular": (2.0, 1.0)}
    up, down = kinds[shock.profile]
    return [(0.0, 0.0, rise, top, up), (rise, top, n * rise, 0.0, down)]


def compiled(function: Any) -> Any:
    """A function that only kernels call: Python calling it crashes."""
    how: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return njit(error_model="numpy", **how)(function)


@compiled
def _push(piece: Any, time: float) -> float:
    if piece[4] == 0.0:
        return 0.0
    passed = (time - piece[0]) / (piece[2] - piece[0])
    if piece[4] == 2.0:
        passed = math.sin(0.5 * math.pi * passed) ** 2
    return float(piece[1] + (piece[3] - piece[1]) * passed)


@compiled
def _accelerate(u: Any, a: Any, push: float, spheres: Any, reach: int) -> None:
    """Eq. 1, for as many granules from the first as can move."""
    behind = push
    for i in range(reach):
        ahead = 0.0
        if i + 1 < spheres.granules:
            overlap = u[i] - u[i + 1]
            overlap = overlap if overlap > spheres.touch else 0.0
            ahead = spheres.stiffness * overlap * math.sqrt(overlap)
        a[i] = (behind - ahead) / spheres.mass
        behind = ahead


@compiled
def _step(room: Any, piece: Any, time: float, h: float, spheres: Any, reach: int) -> None:
    """Increments over h, and the acceleration after it; slopes_v[0] is known."""
    u, v, du, dv, work = room.u, room.v, room.du, room.dv, room.scratch
    slopes_u, slopes_v = room.slopes_u, room.slopes_v
    for i in range(reach):
        slopes_u[0, i] = v[i]
    for s in range(1, 13):
        for i in range(reach):
            du[i], dv[i] = 0.0, 0.0
        for j in range(s):
            weight = h * (_STAGES[s, j] if s < 12 else _WEIGHTS[j])
            if weight != 0.0:
                for i in range(reach):
                    du[i] += weight * slopes_u[j, i]
                    dv[i] += weight * slopes_v[j, i]
        for i in range(reach):
            work[i] = u[i] + du[i]
            slopes_u[s, i] = v[i] + dv[i]
        push = _push(piece, time + (_NODES[s] if s < 12 else 1.0) * h)
        _accelerate(work, slopes_v[s], push, spheres, reach)


@compiled
def _error(room: Any, h: float, fastest: float, deepest: float, reach: int) -> float:
    """DOP853's error estimate of a step, over the largest velocity and overlap."""
    worst = 0.0
    for slopes, scale in ((room.slopes_u, deepest), (room.slopes_v, fastest)):
        for i in range(reach):
            fifth, third = 0.0, 0.0
            for s in range(13):
                fifth += _FIFTH[s] * slopes[s, i]
                third += _THIRD[s] * slopes[s, i]
            below = math.sqrt(fifth**2 + 0.01 * third**2)
            if below > 0 and scale > 0:
                worst = max(worst, h * fifth**2 / below / scale)
    return worst


@compiled
def _seek(
    place: int, i: int, low: float, high: float, at_low: float, at_high: float, room: Any,
    piece: Any, time: float, spheres: Any, reach: int, crest: Any,
) -> None:  # fmt: skip
    """Step from the start of a step to where the overlap rate of contact i, or its rate, is 0.

    ``found`` is filled with the time into the step, and overlap, rate and its rate there.
    """
    scale, side = max(abs(at_low), abs(at_high)), 0
    for _ in range(60):
        x = high - at_high * (high - low) / (at_high - at_low)
        if not low < x < high:
            x = 0.5 * (low + high)
        _step(room, piece, time, x, spheres, reach)
        crest[0] = x
        crest[1] = room.u[i] - room.u[i + 1] + (room.du[i] - room.du[i + 1])
        crest[_RATE] = room.slopes_u[12, i] - room.slopes_u[12, i + 1]
        crest[_RATE_OF_RATE] = room.slopes_v[12, i] - room.slopes_v[12, i + 1]
        value = crest[place]
        if abs(value) <= 1e-10 * scale or high - low <= 1e-14 * high:
            return
        # Regula falsi; the value at an end that stays is halved (Illinois).
        if (value > 0) == (at_low > 0):
            low, at_low = x, value
            at_high *= 0.5 if side < 0 else 1.0
            side = -1
        else:
            high, at_high = x, value
            at_low *= 0.5 if side > 0 else 1.0
            side = 1


@compiled
def _highest_within(
    i: int, h: float, w0: float, w1: float, g0: float, g1: float, room: Any, piece: Any,
    time: float, spheres: Any, reach: int, crest: Any,
) -> float:  # fmt: skip
    """The largest overlap of a contact between the ends of a step; -1 if it is at an end.

    w0, w1 are its rates at the ends, g0, g1 those of its rate.
    """
    low, high, at_low, at_high = 0.0, h, w0, w1
    if (w0 > 0) == (w1 > 0):
        if not (g0 * g1 < 0 and (g0 < 0) == (w0 > 0)):
            return -1.0
        _seek(_RATE_OF_RATE, i, 0.0, h, g0, g1, room, piece, time, spheres, reach, crest)
        if (crest[_RATE] > 0) == (w0 > 0):
            return -1.0
        if w0 > 0:
            high, at_high = crest[0], crest[_RATE]
        else:
            low, at_low = crest[0], crest[_RATE]
    elif w1 > 0:
        return -1.0
    _seek(_RATE, i, low, high, at_low, at_high, room, piece, time, spheres, reach, crest)
    return float(crest[1])


@compiled
def _add(total: Any, more: Any, lost: Any, reach: int) -> None:
    """Summation with compensation (Kahan): ``lost`` holds what rounding has left out."""
    for i in range(reach):
        y = more[i] + lost[i]
        new = total[i] + y
        lost[i] = y - (new - total[i])
        total[i] = new


@njit(cache=True, error_model="numpy")
def _march(
    pieces: Any, end: float, spheres: Any, cap: float, tolerance: float, highest: Any
) -> bool:
    """Fill in the largest overlap of each contact; whether the end was reached."""
    n = spheres.granules
    u, v = np.zeros(n), np.zeros(n)
    slopes_u, slopes_v = np.zeros((13, n)), np.zeros((13, n))
    room = Room(u, v, np.zeros(n), np.zeros(n), slopes_u, slopes_v, np.zeros(n))
    grown_u, grown_v, lost_u, lost_v = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    after = np.zeros((2, n))
    start = np.zeros(n)
    crest = np.zeros(4)
    fastest, deepest, moved, steps = 0.0, 0.0, 1, 0
    for p in range(pieces.shape[0]):
        piece = pieces[p]
        time, stop = piece[0], min(piece[2], end)
        h = min(cap, (stop - time) / 64)
        while time < stop:
            steps += 1
            if steps > MOST_STEPS:
                return False
            reach = min(n, moved + 14)  # a stage moves one granule more
            last = time + 1.01 * h >= stop
            if last:
                h = stop - time
            _accelerate(u, start, _push(piece, time), spheres, reach)
            for i in range(reach):
                slopes_v[0, i] = start[i]
            _step(room, piece, time, h, spheres, reach)
            for i in range(reach):
                fastest = max(fastest, abs(v[i]), abs(slopes_u[12, i]))
            for i in range(min(reach, n - 1)):
                deepest = max(deepest, u[i] - u[i + 1] + (room.du[i] - room.du[i + 1]))
            wrong = _error(room, h, fastest, deepest, reach) / tolerance
            if wrong > 1 and h > 1e-7 * cap and h > 1e-12 * time:
                h *= max(0.2, 0.9 * wrong ** (-1 / 8))
                continue
            grown = min(h * min(3.0, 0.9 * max(wrong, 1e-20) ** (-1 / 8)), cap)
            # The search for maxima takes steps of its own, so what this one found is kept.
            for i in range(reach):
                grown_u[i], grown_v[i] = room.du[i], room.dv[i]
                after[0, i], after[1, i] = slopes_u[12, i], slopes_v[12, i]
            for i in range(min(reach, n - 1)):
                r0 = u[i] - u[i + 1]
                r1 = r0 + (grown_u[i] - grown_u[i + 1])
                highest[i] = max(highest[i], r1)
                w0, w1 = v[i] - v[i + 1], after[0, i] - after[0, i + 1]
                g0, g1 = start[i] - start[i + 1], after[1, i] - after[1, i + 1]
                if max(r0, r1) + h * (abs(w0) + abs(w1) + h * (abs(g0) + abs(g1))) > highest[i]:
                    inside = _highest_within(
                        i, h, w0, w1, g0, g1, room, piece, time, spheres, reach, crest
                    )
                    highest[i] = max(highest[i], inside)
            _add(u, grown_u, lost_u, reach)
            _add(v, grown_v, lost_v, reach)
            while moved < n and u[moved] != 0:
                moved += 1
            time = stop if last else time + h
            h = grown
    return True
