"""Gauges: the first pulse of a contact, or of the mean force on the two sides of a granule.

A sensor in the middle of a granule reads the mean of its two contacts, which is a pulse of its own:
lower than those of the contacts, and longer. The observer finds it as it finds those of contacts.
"""

from __future__ import annotations

import itertools
from dataclasses import astuple, dataclass, field, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray, or_none
from hertzchain.observables.contact_errors import COLUMNS, ContactErrors, columns
from hertzchain.observables.first_pulse import FirstPulses, contacts_of
from hertzchain.observables.samples import History
from hertzchain.observables.wave import NEAR_END, is_near_end, places, runs_forwards
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Gauge


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
        cells = zip((*COLUMNS, "speed_m_s", "speed_error"), or_none(values), strict=True)
        read = {self.gauge.key: self.gauge.number, **dict(cells), "speed_reason": self.speed_reason}
        if history is None:
            return read
        force = force_over_time(scene, self.gauge, history)
        return {**read, "time_s": history.time.tolist(), "force_N": force.tolist()}


def force_over_time(scene: Scene, gauge: Gauge, history: History) -> FloatArray:
    """Return the force of a gauge at the times of a history [N], (times,), without static forces.

    It has no error bound.
    """
    places = contacts_of(scene, gauge)
    dynamic = history.contact_force[:, places] - scene.granules.static_force[places]
    return np.asarray(dynamic.sum(axis=1) / (1 if gauge.granule is None else 2))


def readings(scene: Scene, first: FirstPulses | None, errors: ContactErrors) -> tuple[Reading, ...]:
    """Return what the gauges of a scene read.

    Parameters
    ----------
    scene
        The scene.
    first, errors
        First pulses of all signals, in SI units, and their errors; without first pulses nothing is
        read.
    """
    if first is None:
        return ()
    table = columns(first, errors)
    is_ended = table["clear"].astype(bool) | ~np.isnan(table["first_width_s"])
    read, next_granule = [], len(scene.contacts)
    for gauge in scene.gauges:
        place = next_granule
        if gauge.granule is None:
            place = scene.contacts.index(gauge.number)
        else:
            next_granule += 1
        values = (float(table[name][place]) if is_ended[place] else np.nan for name in COLUMNS)
        read.append(Reading(gauge, *values))
    return _with_speeds(scene, read, table["arrival_time_s"])


def _with_speeds(scene: Scene, readings: list[Reading], arrival: FloatArray) -> tuple[Reading, ...]:
    """Return readings with the speed from each to the next, or why there is none."""
    speeds = readings[:1]
    for pair in itertools.pairwise(readings):
        (before, _), (after, _) = (_place(scene, read.gauge) for read in pair)
        early, late = sorted(pair, key=lambda read: read.gauge.number)
        contacts = [*contacts_of(scene, early.gauge), *contacts_of(scene, late.gauge)]
        time, off = late.arrival - early.arrival, late.arrival_error + early.arrival_error
        reason = None
        if before != after:
            reason = f"no speed from {before} to {after}: their pulses differ in shape"
        elif is_near_end(scene, NEAR_END)[contacts].any():
            reason = "no speed so near an end: the wave and its reflection are one pulse"
        elif not (off < time and runs_forwards(arrival, contacts)):
            reason = "no speed: the arrivals show no wave from the gauge before"
        way = _place(scene, late.gauge)[1] - _place(scene, early.gauge)[1]
        speed, error = (np.nan, np.nan) if reason else (way / time, off / (time - off))
        speeds.append(replace(pair[1], speed=speed, speed_error=error, speed_reason=reason))
    return tuple(speeds)


def _place(scene: Scene, gauge: Gauge) -> tuple[str, float]:
    """Return what a gauge reads, and the place of that at rest [m]; of a granule its centre."""
    if gauge.granule is not None:
        return "a granule", float(scene.granules.place[gauge.number - 1 + scene.first_granule])
    is_wall = not 2 <= gauge.number <= scene.chain.granules
    place = float(places(scene)[scene.contacts.index(gauge.number)])
    return "a wall" if is_wall else "a contact", place
