"""Models of a fit: the free keys, of scene and instruments, and differences of measurements."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native, motion_at
from hertzchain.engines.native.batch import on_cores
from hertzchain.errors import RunFailed, SceneError, require
from hertzchain.limits import TOLERANCE, Deadline
from hertzchain.observables.result import Result
from hertzchain.pulses.recording import MOST_EXTENT, noise_before, resolution_of
from hertzchain.scene.keys import to_si
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Run
from hertzchain.scene.terms import Gauge
from hertzchain.sweeps.columns import base_values, changed, full_key, is_whole, unit_of
from hertzchain.sweeps.design import axis_of
from hertzchain.verdict.traces import (
    ENOUGH_QUIET_SAMPLES,
    FEWEST_SAMPLES,
    Expected,
    Traces,
    column_of,
    drift_of,
    gauge_of,
    read_in,
)

GAIN = "gain"
"""A key that no scene has: ratio of measured to true force, the same for all gauges."""

_OF_INSTRUMENT = re.compile(r"((?:gauge|contact)_\d+|(?:near_)?wall)\.(gain|offset|drift)")
_OF_GAUGE = re.compile(r"(?:gauge|contact)_\d+\.")
_UNITS = {GAIN: "", "offset": "N", "drift": "N/s"}
_ADDED = "offset", "drift"
"""Kinds of what an instrument adds to a force: the order of the columns of ``Series``."""


def is_of_instrument(key: str) -> bool:
    """Return whether a key belongs to the instrument and not to the scene."""
    return key == GAIN or _OF_INSTRUMENT.fullmatch(key) is not None


def _kind_of(key: str) -> str:
    return key.rpartition(".")[2].partition("[")[0]


def place_of(key: str) -> str:
    """Return the gauge of a key of an instrument; empty for other keys."""
    match = _OF_INSTRUMENT.fullmatch(key)
    return match[1] if match else ""


def unit_of_key(key: str) -> str:
    """Return the unit of a key of scene or instrument; empty for a pure number."""
    kind = _kind_of(key)
    return _UNITS[kind] if kind in _UNITS else unit_of(key)


_MOST_FACTOR = 100.0
"""Largest factor by which a value may change if no range is given."""

_VALUE_RANGES = {"restitution": (1e-3, 0.9999), "poisson_ratio": (-0.999, 0.5)}
"""Ranges of values that have one."""


def limits_of(key: str) -> tuple[float, float]:
    """Return the range of the values of a key."""
    return _VALUE_RANGES.get(key.rpartition(".")[2], (-math.inf, math.inf))


def with_unit(key: str, value: float) -> str:
    """Return the value of a key in words, such as 1.93e+11 Pa."""
    return f"{value:g} {unit_of_key(key)}".rstrip()


@dataclass(frozen=True, eq=False)
class Free:
    """Keys that may change.

    Parameters
    ----------
    keys
        Their full names.
    start
        Their values in the scene, in SI units; the middle of the range if the scene has none, or 0.
    low, high
        Ends of their ranges over the start values, shape (keys,).
    is_given
        Whether the ends were given, of each key.
    added
        Keys of what instruments add to forces, which is solved for exactly and has no start.
    """

    keys: tuple[str, ...]
    start: tuple[float, ...]
    low: FloatArray
    high: FloatArray
    is_given: tuple[bool, ...]
    added: tuple[str, ...]

    def values(self, x: FloatArray) -> dict[str, float]:
        """Values of the keys by name, from those over the start values; x may have others after."""
        pairs = zip(self.keys, x, self.start, strict=False)
        return {key: float(at) * start for key, at, start in pairs}

    def said(self, x: FloatArray) -> str:
        """Return the values of the keys in words."""
        return ", ".join(f"{key} = {value:.6g}" for key, value in self.values(x).items())

    def scene(self, base: Scene, x: FloatArray) -> Scene:
        """Return a scene with these values."""
        values = {key: at for key, at in self.values(x).items() if not is_of_instrument(key)}
        return changed(base, values)


def free_of(scene: Scene, given: Sequence[str]) -> Free:
    """Return free keys, from their names or from ``"chain.radius=4 mm:6 mm"``."""
    is_list = isinstance(given, Sequence) and not isinstance(given, str) and len(given) > 0
    require(is_list, "free", given, "must be a list of keys, such as ['chain.young_modulus']")
    spans: dict[str, str] = {}
    for text in given:
        name, _, span = (part.strip() for part in str(text).partition("="))
        is_key = is_of_instrument(name) or not _OF_GAUGE.match(name)
        require(is_key, name, None, "is not a key of a gauge: it has gain, offset, drift")
        spans[name if is_of_instrument(name) else full_key(name, scene)] = span
    require(len(spans) == len(given), "free", given, "names a key twice")
    added = [key for key in spans if _kind_of(key) in _ADDED and place_of(key)]
    for key in added:
        allowed = "has no range: it is free from minus to plus infinity"
        require(not spans[key], key, spans.pop(key), allowed)
    allowed = "must have a key of the scene or a gain, too, besides what is only added"
    require(bool(spans), "free", given, allowed)
    starts = [_start_and_range(scene, key, text) for key, text in spans.items()]
    start, low, high = np.array(starts).T
    is_given = tuple(map(bool, spans.values()))
    return Free(tuple(spans), tuple(start.tolist()), low, high, is_given, tuple(added))


def _start_and_range(scene: Scene, key: str, text: str) -> tuple[float, float, float]:
    """Return the start value of a key, and the ends of its range over it."""
    span = _span(key, text) if text else None
    value: Any = 1.0 if is_of_instrument(key) else base_values(scene, [key])[key]
    is_open = is_of_instrument(key) or (isinstance(value, float) and not abs(value) > 0)  # 0, NaN
    if span is not None and is_open:
        value = sum(span) / 2
    is_number = isinstance(value, float) and (is_of_instrument(key) or not is_whole(key))
    allowed = (
        "cannot be fitted: the scene must have a number other than 0, and no whole number, from"
        " which the fit starts, or be given a range"
    )
    require(is_number and np.isfinite(value) and value != 0, key, value, allowed)
    least, most = limits_of(key)
    if span is not None:
        least, most = max(least, span[0]), min(most, span[1])
    lower, upper = sorted((least / value, most / value))
    within = f"{least:g} and {with_unit(key, most)}"
    allowed = f"is {with_unit(key, value)}, must be within {within}, to begin with"
    require(lower <= 1 <= upper, key, None, allowed)
    if span is None:
        lower, upper = max(lower, 1 / _MOST_FACTOR), min(upper, _MOST_FACTOR)
    return value, lower, upper


def _span(key: str, text: str) -> tuple[float, float]:
    """Return the ends of a range, LOW:HIGH."""
    ends = text.split(":")
    allowed = "must be the ends of its range, LOW:HIGH"
    require(len(ends) == 2, key, text, allowed)
    if not is_of_instrument(key):
        low, high = map(float, axis_of(key, text).values)
    else:
        low, high = (to_si(key, end, unit_of_key(key)) for end in ends)
        require(0 < low < high, key, text, allowed)
    return low, high


_SEARCH_STEP, _FINE_STEP = 1e-3, 1e-4
"""Relative changes of a value for slopes of the search, and of runs at ``SLOPE_RTOL``. With the
longer one the jump of a collision causes 1e-3 of a slope where two keys have the same effect
(measured)."""

SLOPE_RTOL = 1e-10
"""Accuracy of runs: 1e-6 of the differences from which slopes are computed."""

_LOOSEST_RTOL, _RTOL_OVER_NOISE = 3e-6, 1e-3
"""Accuracy of runs during a search: this part of the noise over the peak, and its loosest, at which
slopes are known to a part in 300."""

LEAST_NOISE = 1e-6
"""Least noise over the peak (chosen): digits of files, and the shift of a clock."""

_STILL_FORCE_RATIO = 0.01  # change of a force over its largest that is not a pulse; chosen

_END_TIME_RATIO = 1.25
"""End of runs over that of compared samples: values that make a wave slower move it."""


_LEAST_QUIET_VARIANCE = 0.5
"""Least variance of quiet samples over that of the noise (chosen): 1 where they have the noise, 0
where digits of the file, or the least noise of simulated forces, are larger than any."""


class AddedValues(NamedTuple):
    """Contributions of instruments to forces, by least squares for given variables [SI]."""

    keys: list[str]
    numbers: list[float]
    slopes: FloatArray  # derivatives by the variables, shape (keys, variables)
    covariance: FloatArray  # by noise of variance 1, if the variables were exact


class Model(ABC):
    """Differences of the measurement from a scene with other values, over the noise.

    The variables x are values of keys over their start values, then shifts of clocks, if any.
    """

    gauges: tuple[Gauge, ...] = ()
    remarks: tuple[str, ...] = ()  # on clipped recordings
    noise_is_known = True
    given = "traces"  # name of the measured quantity in refusals
    widths: tuple[float, ...] = ()  # over which a search may first smooth, the widest first

    def __init__(self, base: Scene, free: Free, deadline: Deadline, shifts: int = 0) -> None:
        self._base, self.free, self._deadline = base, free, deadline
        self._measured = np.zeros(0)
        self._keys = len(free.keys)
        self.begin = np.append(np.ones(self._keys), np.zeros(shifts))
        self.low = np.append(free.low, np.full(shifts, -np.inf))
        self.high = np.append(free.high, np.full(shifts, np.inf))
        self.runs = self.offsets = 0  # so far, and of gauges, which were subtracted

    @property
    def size(self) -> int:
        """Number of compared samples."""
        return self._measured.size

    def shifts(self, x: FloatArray) -> FloatArray:  # noqa: ARG002
        """Times on the measured clocks at which the run begins [s], shape (files,)."""
        return np.zeros(0)

    def allows(self, x: FloatArray) -> bool:
        """Whether all values are within their bounds, and the scene is possible."""
        if not np.all((x > self.low) & (x < self.high)):
            return False
        try:
            self.scene(x)
        except SceneError:
            return False
        return True

    def scene(self, x: FloatArray) -> Scene:
        """Return the scene with other values."""
        return self.free.scene(self._base, x)

    def differences(
        self, x: FloatArray, width: float = 0.0, rtol: float | None = None
    ) -> FloatArray:
        """Differences from the measurement over the noise, shape (samples,).

        They are smoothed over a ``width``, if any; ``rtol`` is the accuracy of the run, None for
        that of the search.
        """
        self.runs += 1
        return self._differences(x, width, rtol)

    def _differences(self, x: FloatArray, width: float, rtol: float | None) -> FloatArray:
        try:
            forces = self._read(x, rtol)
        except SceneError as problem:
            tried = f"with {self.free.said(x)}, which the fit tried"
            raise RunFailed(f"{tried}: {problem}") from None
        return self._smoothed(forces - self._measured, width)

    def slopes(self, x: FloatArray, width: float = 0.0, rtol: float | None = None) -> FloatArray:
        """Derivatives of the differences, shape (samples, varied), from central differences."""
        return self._slopes(lambda end: self._differences(end, width, rtol), x, rtol)

    def _slopes(
        self, of: Callable[[FloatArray], FloatArray], x: FloatArray, rtol: float | None
    ) -> FloatArray:
        """Derivatives of some values of runs, shape (values, varied), from central differences."""
        steps = np.full(x.size, _SEARCH_STEP if rtol is None else _FINE_STEP)
        steps[: self._keys] *= x[: self._keys]
        moves = np.diag(steps)
        before, after = (np.clip(x + sign * moves, self.low, self.high) for sign in (-1, 1))
        self.runs += 2 * x.size
        low, high = np.split(np.array(list(on_cores(of, [*before, *after]))), 2)
        return np.asarray((high - low).T / np.diag(after - before))

    @abstractmethod
    def _read(self, x: FloatArray, rtol: float | None) -> FloatArray:
        """Measured forces of the scene with other values over the noise, shape (samples,)."""

    def added(self, x: FloatArray) -> AddedValues:
        """Return what instruments add to forces, and its derivatives; nothing to peaks."""
        return AddedValues([], [], np.zeros((0, x.size)), np.zeros((0, 0)))

    def _smoothed(self, values: FloatArray, width: float) -> FloatArray:  # noqa: ARG002
        return values

    def drifts(self, differences: FloatArray) -> list[str]:  # noqa: ARG002
        """Return sentences on gauges that drift; a fit of peaks has none."""
        return []

    @abstractmethod
    def chance(self, differences: FloatArray) -> float:
        """Probability that noise causes differences that last as long as these."""


@dataclass(frozen=True, eq=False)
class Series:
    """The samples of a gauge in a file that are compared."""

    file: int  # its place
    gauge: int  # its place among those of the model
    time: FloatArray  # on the measured clock [s], shape (samples,)
    force: FloatArray  # over the noise, shape (samples,)
    noise: float  # standard deviation [N]
    quiet: int  # number of samples at the start before anything arrives
    block: int  # samples in half the width of the narrowest pulse
    columns: FloatArray  # 1 for an offset, the time for a free drift, shape (samples, 1 or 2)
    inverse: FloatArray  # gives these values by least squares, (values, samples)

    def without_added(self, values: FloatArray) -> FloatArray:
        """Return values less the offset, and what else is added, that is nearest to them."""
        return np.asarray(values - self.columns @ (self.inverse @ values))


class OfTraces(Model):
    """Differences of traces; the shifts of unknown clocks are variables, too, after the keys."""

    # In halves of a pulse: wide enough to meet the next pulse, then as wide as one (measured).
    widths = (4.0, 1.0)

    def __init__(
        self, base: Scene, free: Free, files: Sequence[tuple[Traces, float, Expected]],
        deadline: Deadline, *, is_shifted: bool,
    ) -> None:  # fmt: skip
        until = max(expected.until for *_, expected in files)
        base = replace(base, gauges=(), run=Run(_END_TIME_RATIO * until))
        super().__init__(base, free, deadline, len(files) if is_shifted else 0)
        self.gauges = tuple(dict.fromkeys(gauge for traces, *_ in files for gauge in traces.gauges))
        self.remarks = tuple(remark for traces, *_ in files for remark in traces.remarks)
        self._shifts = np.array([shift for _, shift, _ in files])
        self._added: dict[int, list[str]] = {}  # keys by places of gauges
        for key in free.added:
            self._added.setdefault(self._place(place_of(key)), []).append(key)
        self._gains = {self._place(place_of(key)): key for key in free.keys if place_of(key)}
        self._series = [
            series for k, file in enumerate(files) for series in self._compared(k, *file)
        ]
        self.offsets = sum(series.columns.shape[1] for series in self._series)
        self._measured = np.concatenate([s.without_added(s.force) for s in self._series])
        self._gauge = np.repeat(
            [series.gauge for series in self._series], [series.time.size for series in self._series]
        )
        noise = 1 / max(np.ptp(series.force) for series in self._series)
        self._rtol = float(np.clip(_RTOL_OVER_NOISE * noise, SLOPE_RTOL, _LOOSEST_RTOL))

    def _place(self, place: str) -> int:
        """Return the number of the gauge that a key names; SceneError if it was not measured."""
        gauge = gauge_of(place, self._base)
        names = ", ".join(column_of(each, self._base) for each in self.gauges)
        require(gauge in self.gauges, place, None, f"was not measured: the traces have {names}")
        return self.gauges.index(gauge)

    def _compared(self, at: int, traces: Traces, shift: float, expected: Expected) -> list[Series]:
        """Return the samples of a file while the scene is known.

        Samples before the run begins are only of use for what instruments add.
        """
        begin = traces.time[0] if self.free.added else shift
        during = (traces.time >= begin) & (traces.time - shift <= expected.until)
        time, compared = traces.time[during], []
        allowed = "have no samples while the scene is known: check clock and unit"
        require(time.size > FEWEST_SAMPLES, "traces", None, allowed)
        width = np.nanmin([read.width for read in expected.readings])
        block = max(int(0.5 * width / np.median(np.diff(time))), 1)
        for k, (gauge, read) in enumerate(zip(traces.gauges, expected.readings, strict=True)):
            place, force = self.gauges.index(gauge), traces.force[during, k]
            has_drift = any(_kind_of(key) == "drift" for key in self._added.get(place, []))
            columns = np.stack([np.ones_like(time), time][: 1 + has_drift], axis=1)
            quiet = int(np.searchsorted(time, shift + read.arrival - width))
            noise = float(traces.noise[k])
            if columns.shape[1] > 1 and quiet >= ENOUGH_QUIET_SAMPLES:
                before = columns[:quiet]
                left = force[:quiet] - before @ np.linalg.lstsq(before, force[:quiet])[0]
                noise = noise_before(left, 1.0, resolution_of(force)).deviation
            noise = max(noise, float(LEAST_NOISE * np.max(np.abs(expected.force[:, k]))))
            compared.append(Series(
                at, place, time, force / noise, noise, quiet, block, columns,
                np.linalg.pinv(columns).astype(np.float64),
            ))  # fmt: skip
        return compared

    def shifts(self, x: FloatArray) -> FloatArray:
        """Times on the measured clocks at which the run begins [s], shape (files,)."""
        later = x[self._keys :] if x.size > self._keys else 0.0
        return np.asarray(self._shifts + self._base.contact_time * later)

    def _parts(self, values: FloatArray) -> list[FloatArray]:
        """Return the values of each series."""
        return np.split(values, np.cumsum([series.time.size for series in self._series])[:-1])

    def _forces(self, x: FloatArray, rtol: float | None) -> list[FloatArray]:
        """Forces of each series over its noise, recorded at the very times of the samples.

        Where contacts begin with a collision, forces of dampers rise too steeply for splines.
        """
        shifts, scene = self.shifts(x), self.scene(x)
        places = np.concatenate([series.time - shifts[series.file] for series in self._series])
        clipped = np.clip(places, 0.0, scene.end_time)
        times, place = np.unique(clipped, return_inverse=True)
        history = motion_at(scene, times, rtol or self._rtol, self._deadline)
        force = read_in(scene, self.gauges, history)[place, self._gauge] * (places >= 0)
        values = self.free.values(x)

        def gain(gauge: int) -> float:
            return values.get(GAIN, 1.0) * values.get(self._gains.get(gauge, ""), 1.0)

        pairs = zip(self._series, self._parts(force), strict=True)
        return [gain(series.gauge) / series.noise * part for series, part in pairs]

    def _read(self, x: FloatArray, rtol: float | None) -> FloatArray:
        pairs = zip(self._series, self._forces(x, rtol), strict=True)
        return np.concatenate([series.without_added(part) for series, part in pairs])

    def _sums(self, x: FloatArray, rtol: float | None) -> FloatArray:
        """Return offsets, and all else that is added, by least squares [SI]."""
        pairs = zip(self._series, self._forces(x, rtol), strict=True)
        return np.concatenate([s.noise * s.inverse @ (s.force - part) for s, part in pairs])

    def added(self, x: FloatArray) -> AddedValues:
        """Return what instruments add to forces, and its derivatives."""
        if not self._added:
            return super().added(x)
        from scipy.linalg import block_diag

        self.runs += 1
        keys, places, start = [], [], 0
        for series in self._series:
            several = sum(other.gauge == series.gauge for other in self._series) > 1
            for key in self._added.get(series.gauge, []):
                keys.append(key + f"[{series.file + 1}]" * several)
                places.append(start + _ADDED.index(_kind_of(key)))
            start += series.columns.shape[1]
        sums = self._sums(x, SLOPE_RTOL)
        slopes = self._slopes(lambda end: self._sums(end, SLOPE_RTOL), x, SLOPE_RTOL)
        inverses = [series.noise * series.inverse for series in self._series]
        covariance = block_diag(*(inverse @ inverse.T for inverse in inverses))
        return AddedValues(
            keys, sums[places].tolist(), slopes[places], covariance[np.ix_(places, places)]
        )

    def drifts(self, differences: FloatArray) -> list[str]:
        """Sentences on gauges that follow a line between pulses, if no drift of theirs is free."""
        said = []
        for series, part in zip(self._series, self._parts(differences), strict=True):
            if series.columns.shape[1] > 1:  # its drift is free
                continue
            force = part + series.without_added(series.force)
            still = np.abs(force - force[0]) < _STILL_FORCE_RATIO * np.ptp(force)
            if np.count_nonzero(still) < ENOUGH_QUIET_SAMPLES:
                continue
            time, off = series.time[still], -series.noise * part[still]
            gauge = self.gauges[series.gauge]
            name = column_of(gauge, self._base)
            said += drift_of(time, off, series.noise, name, gauge.place)
        return said

    def _smoothed(self, values: FloatArray, width: float) -> FloatArray:
        """Smooth values along each series, so that pulses that meet wrong ones cause no minima."""
        from scipy.ndimage import gaussian_filter1d

        if not width:
            return values
        pairs = zip(self._series, self._parts(values), strict=True)
        return np.concatenate(
            [gaussian_filter1d(part, width * series.block) for series, part in pairs]
        )

    def chance(self, differences: FloatArray) -> float:
        """Probability that noise causes differences that last as long as these.

        Their sums over half a pulse are squared and summed; quiet samples show how long noise
        itself lasts. Gauges whose quiet samples have less than the noise are left out: errors of
        rounding last as long as a force hardly changes.
        """
        from scipy.special import chdtrc  # quicker to load than scipy.stats

        pairs = [
            (series, part)
            for series, part in zip(self._series, self._parts(differences), strict=True)
            if series.quiet < ENOUGH_QUIET_SAMPLES
            or np.var(part[: series.quiet]) > _LEAST_QUIET_VARIANCE
        ]
        if not pairs:
            return 1.0
        differences = np.concatenate([part for _, part in pairs])
        whole = [
            part[: part.size // series.block * series.block].reshape(-1, series.block)
            for series, part in pairs
        ]
        means = np.concatenate([np.sqrt(blocks.shape[1]) * blocks.mean(axis=1) for blocks in whole])
        before = np.concatenate([part[: series.quiet] for series, part in pairs])
        _, wider = lasting(before if before.size >= ENOUGH_QUIET_SAMPLES else differences)
        scale = float(np.mean(differences**2)) * wider
        squares = float(np.sum(means**2)) / max(scale, 1e-300)
        return float(chdtrc(means.size, squares))


def lasting(differences: FloatArray) -> tuple[float, float]:
    """Return the correlation with the next sample, and the variance of means that it multiplies."""
    centred = differences - differences.mean()
    along = float(np.sum(centred[1:] * centred[:-1]) / max(float(np.sum(centred**2)), 1e-300))
    is_white = abs(along) < 3 / np.sqrt(differences.size)
    return along, 1.0 if is_white else max((1 + along) / max(1 - along, 1e-3), 1.0)


class OfPeaks(Model):
    """Relative differences of peak forces.

    ``peaks`` are the forces of each file [N], shape (contacts,), NaN where none was measured;
    contacts without force, of which there is no relative difference, are left out.
    """

    noise_is_known = False
    given = "peaks"

    def __init__(
        self, base: Scene, free: Free, peaks: Sequence[FloatArray], deadline: Deadline
    ) -> None:
        super().__init__(base, free, deadline)
        of_gauges = [key for key in (*free.keys, *free.added) if place_of(key)]
        require(not of_gauges, " and ".join(of_gauges), None, "is of traces, and these are peaks")
        self._places = np.concatenate([np.flatnonzero(forces > 0) for forces in peaks])
        self._force = np.concatenate([forces[forces > 0] for forces in peaks])
        possible = bool(np.all((self._force > 1 / MOST_EXTENT) & (self._force < MOST_EXTENT)))
        allowed = f"must be from {1 / MOST_EXTENT:g} to {MOST_EXTENT:g} N: check their unit"
        require(possible, "peak forces", None, allowed)
        self._measured = np.ones(self._force.size)
        need = len(free.keys) + 1
        allowed = f"must be at least {need} for {len(free.keys)} free keys: measure more contacts"
        require(self.size >= need, "number of peaks", self.size, allowed)

    def _read(self, x: FloatArray, rtol: float | None) -> FloatArray:  # noqa: ARG002
        scene = self.scene(x)
        run: Result = self._deadline.spend(
            lambda left: Native(rtol=SLOPE_RTOL, time_limit=left, wanted="all").run(scene)
        )
        late = self._places[run.is_cut_off[self._places]]
        if late.size:
            contact = run.scene.contact_name(run.scene.contacts[late[0]])
            allowed = f"is before the peak of {contact}: give a later end_time in [run]"
            raise SceneError("end_time", run.scene.end_time, allowed)
        gain = self.free.values(x).get(GAIN, 1.0)
        return np.asarray(gain * run.peak_force[self._places] / self._force)

    def chance(self, differences: FloatArray) -> float:
        """Probability that noise changes its sign as rarely along the contacts, by the runs test.

        It is 1 if all differences are within the tolerance of ``judge``: another code may cause
        them.
        """
        centred = differences - differences.mean()
        if np.sqrt(np.mean(differences**2)) < TOLERANCE:
            return 1.0
        above = int(np.sum(centred > 0))
        mean = 1 + 2 * above * (centred.size - above) / centred.size
        variance = (mean - 1) * (mean - 2) / max(centred.size - 1, 1)
        runs = 1 + int(np.sum((centred[1:] > 0) != (centred[:-1] > 0)))
        # A normal distribution; half a run is the step of a whole number.
        return 0.5 * math.erfc((mean - runs - 0.5) / math.sqrt(2 * max(variance, 1e-12)))
