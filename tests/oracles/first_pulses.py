"""First pulses of chains with any terms, as their definition says, by SciPy: judges the package's.

Nothing here is the package's: SciPy integrates from corner to corner of the applied force, and
forces are looked at every hundredth of a time unit; maxima and crossings are then found between
these. Only the numbers of a scene are read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from scipy.signal import find_peaks, peak_prominences

import hertzchain as hc
from tests.oracles.extrapolation import push_of
from tests.oracles.scene_in_si import numbers_of, pieces_of, start_of, strokes_of

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Seen:
    """First pulse of a contact, None without one; its arrival and its end, None if not seen."""

    force: float
    time: float
    arrival: float
    end: float | None


class Trace:
    """Forces over time of a scene of elastic or damped contacts."""

    def __init__(self, scene: hc.Scene, tolerance: float = 3e-14, longest: float = 0.05) -> None:
        self.chain, pieces = numbers_of(scene), pieces_of(scene)
        c, count = self.chain, self.chain.inverse_mass.size
        self.granules, self.contacts = count, c.stiffness.size
        self.first_granule = scene.first_granule
        state, strokes = start_of(scene).ravel(), strokes_of(scene, pieces)
        corners = {0.0, scene.end_time, *pieces[:, 0], *pieces[:, 2]}
        ends = sorted(corner for corner in corners if 0 <= corner <= scene.end_time)
        self.parts: list[Any] = []
        for begin, end in pairwise(ends):
            acting = [p for p in pieces if p[0] <= begin < p[2] and p[4] != 0]
            if strokes.size:
                state[[0, count]] = strokes[np.searchsorted(pieces[:, 0], begin, "right") - 1]
                state[0] += state[count] * (begin - pieces[pieces[:, 0] <= begin, 0].max())

            def rates(time: float, y: Floats, acting: list[Floats] = acting) -> Floats:
                force = self.force(y)
                net = np.zeros(count)
                net[c.pushed] = sum(push_of(piece, time) for piece in acting)
                net[1:] += force[: count - 1]
                net[: self.contacts] -= force
                return np.concatenate([y[count:], net * c.inverse_mass + c.constant])

            scale = np.repeat([c.length, c.length / c.time], count)
            done = solve_ivp(
                rates, (begin, end), state, method="DOP853", rtol=tolerance,
                atol=tolerance * scale, max_step=longest * c.time, dense_output=True,
            )  # fmt: skip
            state = done.y[:, -1]
            self.parts.append((begin, end, done.sol))

    def force(self, y: Floats) -> Floats:
        """Forces of all contacts in a state, or in many, (2 granules, ...)."""
        c, n = self.chain, self.granules
        u, v = y[:n], y[n:]
        ahead = [np.concatenate([x[1:], np.zeros_like(x[:1])])[: self.contacts] for x in (u, v)]
        shape = (-1,) + (1,) * (y.ndim - 1)
        d = u[: self.contacts] - ahead[0] - c.gap.reshape(shape)
        w = v[: self.contacts] - ahead[1]
        pressed = np.maximum(d, 0.0)
        force = c.stiffness.reshape(shape) * pressed**1.5
        if c.damping.any():
            damper = c.damping.reshape(shape) * np.where(d > 0, pressed**c.exponent, 0.0) * w
            force = force + damper
            if not c.attraction:
                force = np.maximum(force, 0.0)
        return np.asarray(force)

    def at(self, contact: int, time: float) -> float:
        """Force of one contact at a time; where it jumps, that from then on, as in ``at_all``."""
        for begin, end, solution in reversed(self.parts):
            if begin <= time <= end:
                return float(self.force(solution(time))[contact])
        raise ValueError(time)

    @cached_property
    def sampled(self) -> tuple[Floats, Floats]:
        """A hundred times in each unit of time, and the forces then, (contacts, times)."""
        step = 0.01 * self.chain.time
        parts = [
            np.linspace(b, e, max(2, int((e - b) / step)), endpoint=False) for b, e, _ in self.parts
        ]
        times = np.concatenate([*parts, [self.parts[-1][1]]])
        return times, np.concatenate([self.at_all(t) for t in np.array_split(times, 50)], axis=1)

    def first_pulses(self, static: Floats) -> list[Seen | None]:
        """First pulses of all contacts of a scene whose drive has ended."""
        times, forces = self.sampled
        dynamic = forces - static[:, np.newaxis]
        of_run = dynamic.max(axis=1)
        return [
            seen(times, dynamic[i], partial(self._above, i, float(static[i])))
            if of_run[i] >= 1e-3 * of_run.max()
            else None
            for i in range(self.contacts)
        ]

    def trains(self, static: Floats) -> list[list[Seen]]:
        """All pulses of each contact."""
        times, forces = self.sampled
        dynamic = forces - static[:, np.newaxis]
        return [
            all_pulses(times, dynamic[i], partial(self._above, i, float(static[i])))
            for i in range(self.contacts)
        ]

    def _above(self, contact: int, static: float, time: float) -> float:
        return self.at(contact, time) - static

    def gauge(self, granule: int, static: Floats) -> Seen:
        """First pulse of the mean of the contacts of a granule from 2 on."""
        behind = granule - 2 + self.first_granule
        places = [k for k in (behind, behind + 1) if k < self.contacts]

        def read(time: float) -> float:
            return float(sum(self.at(k, time) - static[k] for k in places)) / 2

        times, forces = self.sampled
        read_then = (forces - static[:, np.newaxis])[places].sum(axis=0) / 2
        return seen(times, read_then, read)

    def at_all(self, times: Floats) -> Floats:
        """Forces of all contacts at increasing times, (contacts, times)."""
        return self.force(self.states(times))

    def states(self, times: Floats) -> Floats:
        """Displacements and velocities at increasing times, (2 granules, times)."""
        states = np.zeros((2 * self.granules, times.size))
        for begin, end, solution in self.parts:
            inside = (times >= begin) & (times <= end)
            if inside.any():
                states[:, inside] = solution(times[inside])
        return states


def seen(times: Floats, f: Floats, read: Callable[[float], float]) -> Seen:
    """The definition of a first pulse, step by step: forces at times, and at any time."""
    run, top, best = f.max(), 0.0, 0
    over = None
    for k, force in enumerate(f):
        if force > top:
            top, best = float(force), k
        elif force <= top / 2 and top >= 0.01 * run:
            over = k
            break
    low, high = times[max(best - 1, 0)], times[min(best + 1, times.size - 1)]
    # Within the interval: SciPy finds a place to 1e-8 of itself, and a dashpot that closes
    # jumps to its maximum.
    maximum = minimize_scalar(
        lambda s: -read(low + s * (high - low)), bounds=(0, 1), method="bounded",
        options={"xatol": 1e-9},
    )  # fmt: skip
    force = max(-float(maximum.fun), top)

    def excess(time: float) -> float:
        return read(time) - force / 2

    reached = int(np.argmax(f >= force / 2))
    if over is not None:  # of the maximum that is known now, which is a little higher
        over = best + int(np.argmax(f[best:] <= force / 2))
    arrival = float(times[0])  # where spheres that touch begin with a closing speed
    if reached:
        arrival = brentq(excess, times[reached - 1], times[reached], xtol=1e-18)
    end = None if over is None else brentq(excess, times[over - 1], times[over], xtol=1e-18)
    return Seen(force, float(low + maximum.x * (high - low)), arrival, end)


def all_pulses(times: Floats, f: Floats, read: Callable[[float], float]) -> list[Seen]:
    """All pulses of a signal: maxima of at least 0.9 % of the largest, a twentieth above dips."""
    padded = np.concatenate([[0.0], np.maximum(f, 0.0), [0.0]])  # at an end, too, is a maximum
    places = find_peaks(padded, height=0.009 * f.max())[0]
    stands = peak_prominences(padded, places)[0] >= 0.049 * padded[places]
    pulses = []
    for k in places[stands] - 1:
        low, high = times[max(k - 1, 0)], times[min(k + 1, times.size - 1)]
        top = minimize_scalar(
            lambda s, low=low, high=high: -read(low + s * (high - low)), bounds=(0, 1),
            method="bounded", options={"xatol": 1e-9},
        )  # fmt: skip
        force = max(-float(top.fun), float(f[k]))

        def excess(time: float, force: float = force) -> float:
            return read(time) - force / 2

        before, after = np.flatnonzero(f[:k] < force / 2), np.flatnonzero(f[k:] < force / 2)
        arrival, end = float(times[0]), None
        if before.size:
            arrival = brentq(excess, times[before[-1]], times[before[-1] + 1], xtol=1e-18)
        if after.size:
            end = brentq(excess, times[k + after[0] - 1], times[k + after[0]], xtol=1e-18)
        pulses.append(Seen(force, float(low + top.x * (high - low)), arrival, end))
    return pulses
