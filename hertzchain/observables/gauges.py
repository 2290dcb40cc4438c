"""Gauges: the first pulse of a contact, or of the mean force on the two sides of a granule.

A sensor in the middle of a granule reads the mean of its two contacts, which is a pulse of its own:
lower than those of the contacts, and longer. A second run records both forces during the pulse; the
gauge's pulse is found from their splines as first pulses are.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import astuple, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, or_none
from hertzchain.observables.first_pulse import FALLS, FLOOR
from hertzchain.observables.history import History
from hertzchain.observables.wave import NEAR_END, is_near_end, places, runs_forwards
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_SAMPLES, _LOOKS = 500, 8
"""Recorded times for each granule, and samples of their spline per recorded time."""

_DEGREE = 5

_COLUMNS = (
    "first_peak_force_N", "first_peak_time_s", "arrival_time_s", "first_width_s",
    "first_peak_error", "arrival_error_s", "first_width_error_s",
)  # fmt: skip
"""Columns of first pulses that a gauge has, too, in the order of ``Reading``."""

_SAFETY = 2.0
"""Factor on the errors of the two contacts at recorded times, which first pulses give."""


@dataclass(frozen=True)
class Reading:
    """The first pulse that a gauge reads; NaN where there is none.

    Parameters
    ----------
    gauge
        The gauge.
    force, time, arrival, width
        Largest dynamic force of the pulse [N] and its time [s], when half of it is reached, and how
        long the force is above that, as for ``FirstPulses``.
    force_error, arrival_error, width_error
        Bounds: relative, [s] and [s].
    speed, speed_error
        From the gauge before it in the scene [m/s], by their places at rest and arrivals, and its
        relative bound; NaN for the first gauge, and where there is a ``speed_reason``.
    speed_reason
        Why there is no speed from the gauge before; None where there is one, or no such gauge.
    """

    gauge: Gauge
    force: float
    time: float
    arrival: float
    width: float
    force_error: float
    arrival_error: float
    width_error: float
    speed: float = np.nan
    speed_error: float = np.nan
    speed_reason: str | None = field(default=None, kw_only=True)

    def to_dict(self, scene: Scene, history: History | None) -> dict[str, Any]:
        """Return the reading as a JSON object; null where there is no pulse.

        With a history it has ``time_s`` and ``force_N``, what the gauge reads over time.
        """
        values = np.array(astuple(self)[1:-1])  # all but gauge and reason
        known = zip((*_COLUMNS, "speed_m_s", "speed_error"), or_none(values), strict=True)
        read = {self.gauge.key: self.gauge.number, **dict(known), "speed_reason": self.speed_reason}
        if history is None:
            return read
        force = force_over_time(scene, self.gauge, history)
        return {**read, "time_s": history.time.tolist(), "force_N": force.tolist()}


def force_over_time(scene: Scene, gauge: Gauge, history: History) -> FloatArray:
    """Return the force of a gauge at the times of a history [N], (times,), without static forces.

    It has no error bound.
    """
    places = _contacts(scene, gauge)
    dynamic = history.contact_force[:, places] - scene.granules.static_force[places]
    return np.asarray(dynamic.sum(axis=1) / (1 if gauge.granule is None else 2))


def readings(
    scene: Scene, known: dict[str, NDArray[Any]], run: Callable[[Scene, FloatArray], Any]
) -> tuple[Reading, ...]:
    """Return what the gauges of a scene read.

    Parameters
    ----------
    scene
        The scene, with the end of its run.
    known
        Columns of first pulses: see ``contact_errors.columns``; without these nothing is read.
    run
        Function that runs a scene again and records it at given times [s]; returns a ``Result``.
    """
    if not known:
        return ()
    windows = {
        gauge: window
        for gauge in scene.gauges
        if gauge.granule is not None and (window := _window(scene, gauge, known)) is not None
    }
    history = None
    if windows:
        times = np.unique(np.concatenate(list(windows.values())))
        history = run(replace(scene, gauges=()), times).history
    found = []
    for gauge in scene.gauges:
        if gauge.contact is not None:
            found.append(_of_contact(gauge, known, _contacts(scene, gauge)[0]))
        elif gauge in windows and history is not None:
            found.append(_of_granule(scene, gauge, known, history, windows[gauge]))
        else:
            found.append(Reading(gauge, *[np.nan] * 7))
    return _with_speeds(scene, found, known)


def _with_speeds(
    scene: Scene, readings: list[Reading], known: dict[str, NDArray[Any]]
) -> tuple[Reading, ...]:
    """Return readings with the speed from each to the next, or why there is none."""
    speeds = readings[:1]
    for pair in itertools.pairwise(readings):
        (before, _), (after, _) = (_place(scene, read.gauge) for read in pair)
        early, late = sorted(pair, key=lambda read: read.gauge.number)
        contacts = [*_contacts(scene, early.gauge), *_contacts(scene, late.gauge)]
        time, off = late.arrival - early.arrival, late.arrival_error + early.arrival_error
        reason = None
        if before != after:
            reason = f"no speed from {before} to {after}: their pulses differ in shape"
        elif is_near_end(scene, NEAR_END)[contacts].any():
            reason = "no speed so near an end: the wave and its reflection are one pulse"
        elif not (off < time and runs_forwards(known["arrival_time_s"], contacts)):
            reason = "no speed: the arrivals show no wave from the gauge before"
        way = _place(scene, late.gauge)[1] - _place(scene, early.gauge)[1]
        speed, error = (np.nan, np.nan) if reason else (way / time, off / (time - off))
        speeds.append(replace(pair[1], speed=speed, speed_error=error, speed_reason=reason))
    return tuple(speeds)


def _place(scene: Scene, gauge: Gauge) -> tuple[str, float]:
    """Return what a gauge reads, and the place of that at rest [m]; of a granule its centre."""
    if gauge.granule is not None:
        return "a granule", float(scene.granules.position[gauge.number - 1 + scene.first_granule])
    is_wall = not 2 <= gauge.number <= scene.chain.granules
    place = float(places(scene)[scene.contacts.index(gauge.number)])
    return "a wall" if is_wall else "a contact", place


def _of_contact(gauge: Gauge, known: dict[str, NDArray[Any]], place: int) -> Reading:
    if not known["clear"][place] and np.isnan(known["first_width_s"][place]):
        return Reading(gauge, *[np.nan] * 7)  # it has not ended
    return Reading(gauge, *(float(known[name][place]) for name in _COLUMNS))


def _contacts(scene: Scene, gauge: Gauge) -> list[int]:
    """Place of a gauge's contact, or of both contacts of its granule (one at a free end)."""
    numbers = (gauge.number, *([] if gauge.granule is None else [gauge.number + 1]))
    return [scene.contacts.index(number) for number in numbers if number in scene.contacts]


def _window(scene: Scene, gauge: Gauge, known: dict[str, NDArray[Any]]) -> FloatArray | None:
    """Times at which the forces on a granule are recorded [s]; None without a whole pulse."""
    places = _contacts(scene, gauge)
    arrival, width = known["arrival_time_s"][places], known["first_width_s"][places]
    if np.isnan(arrival).any() or np.isnan(width).any():
        return None
    longest = float(np.max(width))
    begin, end = float(np.min(arrival)) - longest, float(np.max(arrival + width)) + longest
    return np.linspace(max(begin, 0.0), min(end, scene.end_time), _SAMPLES)


def _of_granule(
    scene: Scene, gauge: Gauge, known: dict[str, NDArray[Any]], history: History, times: FloatArray
) -> Reading:
    from scipy.interpolate import make_interp_spline

    at, places = np.isin(history.time, times), _contacts(scene, gauge)
    time = history.time[at]
    forces = history.contact_force[at][:, places] - scene.granules.static_force[places]
    mean = force_over_time(scene, gauge, history)[at]
    found = _pulse(make_interp_spline(time, mean, _DEGREE))
    coarse = _pulse(make_interp_spline(time[::2], mean[::2], _DEGREE))
    if found is None or coarse is None:
        return Reading(gauge, *[np.nan] * 7)
    off = late = wide = 0.0
    for k, place in enumerate(places):
        one = _pulse(make_interp_spline(time, forces[:, k], _DEGREE))
        if one is None:
            return Reading(gauge, *[np.nan] * 7)
        force, arrival, width = (
            float(known[name][place])
            for name in ("first_peak_force_N", "arrival_time_s", "first_width_s")
        )
        steepest = float(np.max(np.abs(np.gradient(forces[:, k], time))))
        late_here = float(known["arrival_error_s"][place]) + abs(one[2] - arrival)
        off += force * (float(known["first_peak_error"][place]) + abs(one[0] / force - 1))
        off += steepest * late_here
        late += late_here
        wide += float(known["first_width_error_s"][place]) + abs(one[3] - width)
    # At the crossings the slope of the mean is below the steepest slope of the contacts.
    half = _SAFETY * off / 2
    slope = found[0] / found[3]
    return Reading(
        gauge, *found,
        half / found[0] + abs(coarse[0] / found[0] - 1),
        _SAFETY * late + half / slope + abs(coarse[2] - found[2]),
        _SAFETY * wide + 2 * half / slope + abs(coarse[3] - found[3]),
    )  # fmt: skip


def _pulse(curve: BSpline) -> tuple[float, float, float, float] | None:
    """Force, time, arrival and width of the first pulse of a curve; None where it has no end."""
    from scipy.optimize import brentq, minimize_scalar

    begin, end = curve.t[0], curve.t[-1]
    looks = np.linspace(begin, end, _LOOKS * curve.c.size)
    values = curve(looks)
    top = np.maximum.accumulate(values)
    over = np.flatnonzero((values <= FALLS[1] * top) & (top >= FLOOR * top[-1]) & (top > 0))
    if not over.size:
        return None
    best = int(np.argmax(values[: over[0]]))
    low, high = looks[max(best - 1, 0)], looks[min(best + 1, looks.size - 1)]
    place = minimize_scalar(
        lambda s: -float(curve(low + s * (high - low))), bounds=(0, 1), method="bounded"
    )
    force, time = -float(place.fun), float(low + place.x * (high - low))
    above = values >= force / 2
    first = int(np.argmax(above))
    last = best + int(np.argmax(~above[best:]))
    if first == 0 or last == best:
        return None

    def excess(t: float) -> float:
        return float(curve(t)) - force / 2

    arrival, falls = (brentq(excess, looks[k - 1], looks[k], xtol=1e-20) for k in (first, last))
    return force, time, float(arrival), float(falls - arrival)
