"""Mistakes in the contact law, and the chains with such laws, which run in natural units."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene
from hertzchain.scene.watching import watched_time
from hertzchain.verdict.case import Case, Found, Mistake

_STEP = 0.1  # natural time units: error 1e-5 of the peaks, mostly the same as with Eq. 1


HERTZ = 1.5  # exponent of the overlap


def _power(values: FloatArray, exponent: float) -> FloatArray:
    """Return a power, 1/4 or 1/2 above a whole one by roots, which take a tenth of the time."""
    found = np.asarray(values ** int(exponent), np.float64)
    if exponent % 1:
        root = np.sqrt(values)
        found = found * (root if exponent % 1 == 0.5 else np.sqrt(root))
    return found


class _Highest:
    """The highest force of each contact; a peak is that of the parabola through three samples."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self.force = np.zeros(shape)
        self._before = np.zeros(shape)
        self._now = self._before

    def update(self, after: FloatArray) -> None:
        """Take note of the next sample."""
        before, now = self._before, self._now
        bend, slope = before - 2 * now + after, after - before
        crest = (now >= before) & (now > after) & (bend < 0)
        above = np.where(crest, slope * slope / np.where(crest, -8 * bend, 1.0), 0.0)
        self.force = np.maximum(self.force, np.maximum(now + above, after))
        self._before, self._now = now, after


def peaks(
    scene: Scene,
    exponent: float,
    deadline: Deadline,
    stretched: FloatArray | float = 1.0,
    damping: FloatArray | float = 0.0,
    drag: FloatArray | float = 0.0,
) -> FloatArray:
    """Return peaks of overlap^exponent in many chains over F0, (chains, contacts).

    They are not finite where a motion diverged. Each chain has a factor of the pulse's duration, a
    damping of its contacts, which goes as overlap^(1/2) times the rate, and a drag, which goes as
    the velocity of each granule, in natural units with stiffness 1: shape (chains,). All advance
    side by side by RK4. Raises TooExpensive if they are not done by the deadline.
    """
    stretched, damping, drag = np.broadcast_arrays(np.atleast_1d(stretched), damping, drag)
    granules, unit = scene.chain.granules, scene.units.time
    pulse_end = scene.ramps[-1].end / unit * float(np.max(stretched))
    end = pulse_end + float(watched_time(granules, scene.momentum_ratio * np.min(stretched)))
    if scene.run.end_time is not None:
        end = scene.end_time / unit
    steps = int(np.ceil(end / _STEP))
    h = end / steps
    half = np.arange(2 * steps + 1)[:, np.newaxis] * h / 2
    applied = scene.applied_force(half * unit / stretched) / scene.units.force
    highest = _Highest((granules - 1, stretched.size))

    def acceleration(u: FloatArray, v: FloatArray, pushed: FloatArray) -> tuple[FloatArray, ...]:
        overlap = u[:-1] - u[1:]
        elastic = whole = _power(np.maximum(overlap, 0.0), exponent)
        if damping.any():
            whole = elastic + damping * np.sqrt(np.maximum(overlap, 0.0)) * (v[:-1] - v[1:])
        a = np.concatenate([pushed[np.newaxis], whole]) - drag * v
        a[:-1] -= whole
        return a, elastic

    u, v = np.zeros((2, granules, stretched.size))
    with np.errstate(over="ignore", invalid="ignore"):  # motions that diverge
        for k in range(steps):
            if deadline.left < 0:
                raise deadline.passed()
            first, middle, last = applied[2 * k : 2 * k + 3]
            a1, elastic = acceleration(u, v, first)
            highest.update(elastic)
            v2 = v + h / 2 * a1
            a2, _ = acceleration(u + h / 2 * v, v2, middle)
            v3 = v + h / 2 * a2
            a3, _ = acceleration(u + h / 2 * v2, v3, middle)
            v4 = v + h * a3
            a4, _ = acceleration(u + h * v3, v4, last)
            u = u + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return highest.force.T


_OTHERS = {
    "contact force linear in the overlap": 1.0,
    "contact force that goes as overlap^(5/4)": 1.25,
    "contact force that goes as overlap^2": 2.0,
}

# trial coefficients of damping, natural units: dense near 0
_FORWARD = np.linspace(0.0, 1.25, 14) ** 2
_BACKWARD = -(np.linspace(0.6, 0.0, 10)[:-1] ** 2)

_OF_DRAG = 0.2  # fraction of these coefficients for a drag, which acts on a granule for long
_HOPEFUL = 0.3  # most a curve may leave, of the differences, to be refined (chosen)


def other_contacts(case: Case) -> Iterator[Mistake]:
    """Yield another exponent, with any stiffness."""
    for text, exponent in _OTHERS.items():

        def made(logs: FloatArray, exponent: float = exponent) -> FloatArray:
            found = peaks(case.scene, exponent, case.deadline, np.exp(logs))
            return found * case.scene.units.force

        def words(log: float, text: str = text, exponent: float = exponent) -> str:
            times = math.exp(2 * exponent * log)
            return f"{text}, with {times:.3g} times the stiffness at F0"

        yield Mistake(words, search=_by_curve(np.linspace(-2.0, 2.0, 17), made))


def late_forces(case: Case) -> Iterator[Mistake]:
    """Yield late or early forces, which act like damping, and a drag."""
    units = case.scene.units

    def made(trials: FloatArray, acting: str) -> FloatArray:
        found = peaks(case.scene, HERTZ, case.deadline, **{acting: np.append(trials, 0.0)})
        return _corrected(case, found[:-1], found[-1])

    def drag(x: float) -> str:
        coefficient = x * units.force * units.time / units.length
        return f"damping on, a drag on each granule, coefficient {coefficient:.3g} N s/m"

    def late(x: float) -> str:
        # F(t - dt) = F - 3/2 dt overlap^(1/2) overlap': negative damping.
        dt = -x / 1.5 * units.time
        if dt > 0:
            return (
                f"contact forces {dt:.3g} s late, a step: explicit Euler, or forces from positions"
                " of the step before"
            )
        return (
            f"contact forces {-dt:.3g} s early: implicit Euler, or damping as of viscoelastic"
            " spheres that the peaks leave out"
        )

    yield Mistake(drag, search=_by_curve(_OF_DRAG * _FORWARD, lambda x: made(x, "drag")))
    both = np.concatenate([_BACKWARD, _FORWARD])
    yield Mistake(late, search=_by_curve(both, lambda x: made(x, "damping")))


def _corrected(case: Case, found: FloatArray, by_hertz: FloatArray) -> FloatArray:
    """Return peaks [N] corrected by RK4's error for Eq. 1, shape (..., contacts)."""
    pressed = by_hertz > 0
    ratio = found / np.where(pressed, by_hertz, 1.0)
    return np.asarray(np.where(pressed, ratio, 0.0) * case.reference.peak_force)


def _by_curve(
    trials: FloatArray, made: Callable[[FloatArray], FloatArray]
) -> Callable[[Case], Found]:
    """Return a search on curves through many trials at once, then again close to the best."""

    def search(case: Case) -> Found:
        from scipy.interpolate import Akima1DInterpolator

        best, values = Found(0.0, math.inf), trials
        for _ in range(2):
            found = made(values)
            there = np.all(np.isfinite(found) & (found > 0), axis=1)
            if np.count_nonzero(there) < 4:
                break
            # Contact by contact: waves that die out, or arrive after the end, must not affect the
            # others.
            curve = Akima1DInterpolator(values[there], np.log(found[there]), method="makima")
            fitted = case.fit(lambda x, curve=curve: np.exp(curve(x)), values[there].tolist())  # type: ignore[misc]
            if fitted.left < best.left:
                best = fitted
            if best.left > _HOPEFUL * case.size:
                break
            k = min(max(int(np.searchsorted(values, best.value)), 1), values.size - 1)
            values = best.value + 0.3 * (values[k] - values[k - 1]) * np.linspace(-1, 1, 7)
        return best

    return search
