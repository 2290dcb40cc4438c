"""Records of gauges: samples, and the trains of pulses that pass them."""

from __future__ import annotations

import itertools
from dataclasses import astuple, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from hertzchain.arrays import FloatArray, or_none
from hertzchain.observables.error_bound import COLUMNS as PULSE_COLUMNS
from hertzchain.observables.error_bound import ContactErrors, causal, columns
from hertzchain.observables.first_pulse import FirstPulses, contacts_of
from hertzchain.observables.samples import DampedLaw, History
from hertzchain.observables.wave import NEAR_END, is_near_end, places, runs_forwards
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Gauge

if TYPE_CHECKING:
    import pandas
    from numpy.typing import ArrayLike


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
        cells = zip((*PULSE_COLUMNS, "speed_m_s", "speed_error"), or_none(values), strict=True)
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
        values = (
            float(table[name][place]) if is_ended[place] else np.nan for name in PULSE_COLUMNS
        )
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


LEAST = 0.01
"""Least height of a pulse, over the largest dynamic force of its contact."""

_FRAME_TIMES = (0.05, 0.03)
"""Time units of the fastest contact between frames of the two runs (chosen). The overlap between
frames, a polynomial of fifth degree, is off by 1e-8 where it is smooth."""

_NEAR_FRAMES, _DOUBLINGS, _DOUBLING_STEPS = 4.0, 12, (2, 8)
"""No polynomial fits the motion where a contact opens or closes. Maxima and crossings so near to
that, over the distance of frames, get further frames up to there: their distances are doubled so
often, in so many steps each in the two runs (chosen)."""


_PARTS = 8
"""Parts of the time between two frames in which maxima are searched (chosen), and parts of the
brackets that close around maxima and crossings."""

_BRACKET_ROUNDS = 12
"""Number of cuts of a bracket: down to 1e-8 of a frame for maxima, 2e-12 for crossings."""


COLUMNS = (
    "time_s", "force_N", "arrival_time_s", "width_s", "time_error_s", "force_error",
    "arrival_error_s", "width_error_s",
)  # fmt: skip


class HasHistory(Protocol):
    """A result of a recorded run."""

    @property
    def history(self) -> History | None:
        """The history that was recorded."""


class Recorded(Protocol):
    """An engine that records runs."""

    def run(self, scene: Scene, record: ArrayLike | None = None) -> HasHistory:
        """Simulate a scene; see ``hertzchain.Native.run``."""


@dataclass(frozen=True, eq=False)
class Train:
    """The pulses of a contact, or of a gauge in a granule, in the order of time.

    Parameters
    ----------
    gauge
        The contact or the granule.
    columns
        By their names, shape (pulses,) each: time, dynamic force, arrival and width, and bounds of
        their errors, that of the force relative. A width is NaN where the run ended before; an
        error is infinite where the second run has no such pulse.
    """

    gauge: Gauge
    columns: dict[str, FloatArray]

    def to_frame(self) -> pandas.DataFrame:
        """Return a table with a row for each pulse."""
        import pandas

        return pandas.DataFrame(self.columns)

    def to_dict(self) -> dict[str, Any]:
        """Return the train as a JSON object; null stands for what is not known."""
        values = [or_none(self.columns[name]) for name in COLUMNS]
        pulses = [dict(zip(COLUMNS, row, strict=True)) for row in zip(*values, strict=True)]
        return {self.gauge.key: self.gauge.number, "pulses": pulses}


def trains_of(scene: Scene, engine: Recorded, other: Recorded) -> tuple[Train, ...]:
    """Return the trains of all contacts, then of gauges in granules, by an engine.

    The other engine takes other steps.
    """
    in_granules = [gauge for gauge in scene.gauges if gauge.granule is not None]
    gauges = [*(Gauge(contact=number) for number in scene.contacts), *in_granules]
    kinks = np.zeros(0)
    for recorder, k in ((engine, 0), (engine, 0), (other, 1)):
        frames = _frames(scene, kinks, _FRAME_TIMES[k], _DOUBLING_STEPS[k])
        near = _NEAR_FRAMES * _FRAME_TIMES[k] * scene.contact_time
        motion = _Motion.of(scene, recorder.run(scene, frames).history)
        read = [_Signal(motion, scene, gauge) for gauge in gauges]
        pulses = [signal.pulses() for signal in read]
        kinks = np.concatenate(
            [signal.kinks(each, near) for signal, each in zip(read, pulses, strict=True)]
        )
        if recorder is engine:
            signals, trains = read, pulses
    differences = [_differences(*pair) for pair in zip(trains, pulses, strict=True)]
    times = np.concatenate([train[0] for train in trains])
    units = np.array([[1.0], [scene.contact_time], [scene.contact_time]])
    # Bound of an error over the difference of two runs (chosen): of first-order steps and their
    # halves it is 2, of second-order ones 4/3
    differing = 3.0 * causal(np.concatenate(differences, axis=1), times)
    every, begin = [], 0
    for gauge, signal, train in zip(gauges, signals, trains, strict=True):
        # Least error that is stated, over total forces and the time unit: that of histories, which
        # two runs may share. In two of about 300 random scenes it was 1e-9 and 1.2e-8.
        least = 2e-8 * units * (1 + signal.static / train[1])
        force, arrival, width = differing[:, begin : begin + train.shape[1]] + least
        begin += train.shape[1]
        time = signal.doubt(train, force) + arrival
        values = (*train, time, force, arrival, width)
        every.append(Train(gauge, dict(zip(COLUMNS, values, strict=True))))
    return tuple(every)


def _frames(scene: Scene, kinks: FloatArray, apart: float, closer: int) -> FloatArray:
    """Return increasing times of frames [s], at all corners of the drive and on both sides.

    ``apart`` is the longest time between them, in natural time units of the fastest contact; near
    kinks their distance is doubled in ``closer`` steps.
    """
    step = apart * scene.contact_time
    # Distance of frames from a corner of the drive, whose force may jump there, over that of the
    # others (chosen)
    legs, aside = scene.schedule(step), 1e-5 * step
    usual = [np.linspace(leg.start + aside, leg.end - aside, leg.steps + 1) for leg in legs]
    offsets = _NEAR_FRAMES * step * 2.0 ** (np.arange(-_DOUBLINGS * closer, 1) / closer)
    near = kinks[:, np.newaxis] + np.concatenate([-offsets, [0.0], offsets])
    corners = [leg.start for leg in legs]
    every = [corners, [scene.end_time], *usual, near.ravel().clip(0.0, scene.end_time)]
    times = np.unique(np.concatenate(every))
    return np.asarray(times[np.append(True, np.diff(times) > aside / 10)])


def _differences(train: FloatArray, other: FloatArray) -> FloatArray:
    """Differences of forces (relative), arrivals and widths, (3, pulses); infinite without a match.

    A pulse matches the nearest of the other run, if that has no nearer one.
    """
    off = np.full((3, train.shape[1]), np.inf)
    if not other.shape[1]:
        return off
    apart = np.abs(train[0][:, np.newaxis] - other[0])
    nearest = np.argmin(apart, axis=1)
    is_match = np.argmin(apart, axis=0)[nearest] == np.arange(nearest.size)
    match = other[:, nearest]
    values = np.abs([match[1] / train[1] - 1, match[2] - train[2], match[3] - train[3]])
    values[2] = np.maximum(values[1], values[2])  # both ends of a pulse may move alike
    is_ended = ~np.isnan(train[3])
    values[2] = np.where(is_ended == ~np.isnan(match[3]), values[2], np.inf)
    off[:, is_match] = values[:, is_match]
    off[2, ~is_ended] = np.nan
    return off


@dataclass(frozen=True, eq=False)
class _Motion:
    """Times, overlaps with two derivatives, and forces of all contacts of a recorded run."""

    time: FloatArray
    overlap: FloatArray  # (3, times, contacts)
    force: FloatArray
    static: FloatArray
    law: DampedLaw

    @classmethod
    def of(cls, scene: Scene, history: History | None) -> _Motion:
        """Return the motion of the contacts in a history; accelerations are those of its forces."""
        assert history is not None
        granules, force = scene.granules, history.contact_force
        contacts = force.shape[1]
        net = np.tile(granules.constant_force, (history.time.size, 1))
        net[:, scene.pushed] += scene.applied_force(history.time)
        net[:, :contacts] -= force
        net[:, 1:] += force[:, : net.shape[1] - 1]
        behind = [(0, 0), (scene.first_granule, 0)]
        moves = np.pad(history.displacement, behind), np.pad(history.velocity, behind)
        bodies = np.pad([*moves, net / granules.mass], [(0, 0), (0, 0), (0, 1)])
        overlap = bodies[:, :, :contacts] - bodies[:, :, 1 : contacts + 1]
        overlap[0] += granules.static_overlap - granules.gap
        return cls(history.time, overlap, force, granules.static_force, DampedLaw.of(scene))


class _Signal:
    """The dynamic force of a contact, or the mean of those of a granule's contacts, over time."""

    def __init__(self, motion: _Motion, scene: Scene, gauge: Gauge) -> None:
        from hertzchain.observables import observer

        places = contacts_of(scene, gauge)
        self._weight = 1.0 if gauge.granule is None else 0.5
        self._time = motion.time
        starts = np.array([stroke.start for stroke in scene.shock.strokes])
        around = np.searchsorted(motion.time, starts)
        self._jumps = np.isin(np.arange(motion.time.size), np.append(around, around + 1))
        unknown = np.full((1, self._time.size, len(places)), np.nan)
        self._signals = motion.law.signals()[places]
        self._motion = np.concatenate([motion.overlap[:, :, places], unknown])
        self._force = np.ascontiguousarray(motion.force[:, places])
        self._static = motion.static[places]
        self.static = self._weight * float(np.sum(self._static))
        self._weakest = observer.LEAST * (scene.units.force + self.static)
        self._is_open = motion.overlap[0, :, max(places[0] - 1, 0) : places[-1] + 2] <= 0
        parts = np.arange(_PARTS) / _PARTS
        inner = self._time[:-1, np.newaxis] + parts * np.diff(self._time)[:, np.newaxis]
        self.grid = np.append(inner.ravel(), self._time[-1])
        self.values = self.at(self.grid)

    def at(self, times: FloatArray) -> FloatArray:
        """Return the force at any times within the run; 0 for a pull."""
        from hertzchain.observables.intervals import forces_at

        order = np.argsort(times, axis=None)
        forces = np.empty((times.size, self._static.size))
        forces_at(
            self._signals, times.ravel()[order], self._time, self._motion, self._force, forces
        )
        values = np.empty(times.size)
        values[order] = np.sum(forces - self._static, axis=1) * self._weight
        # A piston's velocity jumps between two frames: no polynomial has the force there.
        ends = np.sum(self._force - self._static, axis=1) * self._weight
        k = np.searchsorted(self._time, times.ravel(), "right").clip(1, self._time.size - 1)
        most = np.maximum(ends[k - 1], ends[k])
        values = np.where(self._jumps[k], np.minimum(values, most), values)
        return np.maximum(values, 0.0).reshape(times.shape)

    def pulses(self) -> FloatArray:
        """Return times, forces, arrivals and widths of all pulses, shape (4, pulses)."""
        places = np.array(_maxima(self.grid, self.values), np.intp)
        low, high = (self.grid[(places + aside).clip(0, self.grid.size - 1)] for aside in (-1, 1))
        each, parts = np.arange(places.size), np.arange(_PARTS + 1) / _PARTS
        for _ in range(_BRACKET_ROUNDS):
            times = low[:, np.newaxis] + parts * (high - low)[:, np.newaxis]
            values = self.at(times)
            best = np.argmax(values, axis=1)
            low, high = (times[each, (best + aside).clip(0, _PARTS)] for aside in (-1, 1))
        time, force = times[each, best], values[each, best]
        keep = force >= max(LEAST * np.max(force, initial=0.0), self._weakest)
        time, force = time[keep], force[keep]
        arrival, over = (self._crossing(time, force / 2, ahead) for ahead in (False, True))
        arrival = np.where(np.isnan(arrival), self.grid[0], arrival)
        return np.array([time, force, arrival, over - arrival])

    def kinks(self, train: FloatArray, near: float) -> FloatArray:
        """Return maxima and crossings so near to which this or a next contact opens or closes."""
        places = np.concatenate([train[0], train[2], train[2] + train[3]])
        places = places[~np.isnan(places)]
        before = np.searchsorted(self._time, places - near) - 1
        after = np.searchsorted(self._time, places + near).clip(max=self._time.size - 1)
        changes = self._is_open[before.clip(min=0)] != self._is_open[after]
        return np.asarray(places[changes.any(axis=1)])

    def doubt(self, train: FloatArray, error: FloatArray) -> FloatArray:
        """Return how far maxima may be from their times, as their forces have these errors."""
        time, force = train[:2]
        level = force * np.maximum(1 - 2 * np.minimum(error, 0.5) - 1e-15, 0.0)
        since, until = (self._crossing(time, level, ahead) for ahead in (False, True))
        since = np.where(np.isnan(since), self.grid[0], since)
        until = np.where(np.isnan(until), self.grid[-1], until)
        return np.asarray(np.where(np.isinf(error), np.inf, np.maximum(time - since, until - time)))

    def _crossing(self, time: FloatArray, level: FloatArray, ahead: bool) -> FloatArray:
        """Return when the force is last below levels before times, or first after; NaN if never."""
        low, high = np.full(time.size, np.nan), np.full(time.size, np.nan)
        for k, (at, least) in enumerate(zip(time, level, strict=True)):
            is_there = (self.grid > at) if ahead else (self.grid < at)
            below = np.flatnonzero(is_there & (self.values < least))
            if below.size:
                n, sign = (below[0], -1) if ahead else (below[-1], 1)
                low[k] = self.grid[n]  # below the level; towards ``high`` it is reached
                high[k] = (max if ahead else min)(self.grid[n + sign], at)
        rows = np.flatnonzero(~np.isnan(low))
        each, parts = np.arange(rows.size), np.arange(_PARTS + 1) / _PARTS
        for _ in range(_BRACKET_ROUNDS):
            times = low[rows][:, np.newaxis] + parts * (high - low)[rows][:, np.newaxis]
            is_below = self.at(times) < level[rows][:, np.newaxis]
            is_below[:, 0], is_below[:, -1] = True, False
            last = _PARTS - 1 - np.argmax(is_below[:, -2::-1], axis=1) if rows.size else each
            low[rows], high[rows] = times[each, last], times[each, last + 1]
        return high


def _maxima(time: FloatArray, values: FloatArray) -> list[int]:
    """Return the places of maxima before and after which the force is lower by a twentieth.

    Before the run there is no force. At its end a maximum counts where the force has stood near it
    for longer than it took to get there from a half.
    """
    # Least dip of the force between two pulses, over the height of the lower one (chosen): ripples
    # of a plateau are smaller
    dip = 0.05
    rises = np.diff(values) > 0
    turns = np.flatnonzero(rises[1:] != rises[:-1]) + 1
    maxima, top, low, since = [], -1, 0.0, 0
    for k in (0, *turns.tolist(), values.size - 1):
        if (top < 0 and low < (1 - dip) * values[k]) or (top >= 0 and values[k] > values[top]):
            top = k
        if top >= 0 and values[k] < (1 - dip) * values[top]:
            maxima.append(top)
            top, low, since = -1, values[k], k
        elif top < 0 and values[k] < low:
            low, since = values[k], k
    if top >= 0:
        near = since + int(np.argmax(values[since:] >= (1 - dip) * values[top]))
        half = np.flatnonzero(values[: near + 1] <= values[top] / 2)
        if time[-1] - time[near] > time[near] - time[half[-1] if half.size else 0]:
            maxima.append(top)
    return maxima
