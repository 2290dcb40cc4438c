"""The comparison of a fit: measured samples or peaks with those of scenes with other values."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native, motion_at
from hertzchain.engines.native.batch import on_cores
from hertzchain.errors import RunFailed, SceneError, require
from hertzchain.fits.keys import GAIN, Free
from hertzchain.limits import TOLERANCE, Deadline
from hertzchain.observables.result import Result
from hertzchain.pulses.recording import MOST_EXTENT
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Run
from hertzchain.verdict.traces.judging import FEWEST_SAMPLES, Expected, read_in
from hertzchain.verdict.traces.traces import ENOUGH_QUIET_SAMPLES, Traces

_SEARCH_STEP, _FINE_STEP = 1e-3, 1e-4
"""Relative changes of a value for slopes of the search, and of runs at ``SLOPE_RTOL``. With the
longer one the jump of a collision causes 1e-3 of a slope where two keys have the same effect
(measured)."""

SLOPE_RTOL = 1e-10
"""Accuracy of runs: 1e-6 of the differences from which slopes are computed."""

_LOOSEST_RTOL, _RTOL_OVER_NOISE = 3e-6, 1e-3
"""Accuracy of runs during a search: this part of the noise over the peak, and its loosest, at which
slopes are known to a part in 300."""

_LEAST_NOISE = 1e-6
"""Least noise over the peak: the error by the digits of files and the shift of a clock (chosen)."""

_END_TIME_RATIO = 1.25
"""End of runs over that of compared samples: values that make a wave slower move it."""


_LEAST_QUIET_VARIANCE = 0.5
"""Least variance of quiet samples over that of the noise (chosen): 1 where they have the noise, 0
where digits of the file, or the least noise of simulated forces, are larger than any."""


class Model(ABC):
    """Differences of the measurement from a scene with other values, over the noise.

    The variables x are values of keys over their start values, then shifts of clocks, if any.
    """

    gauges: tuple[Gauge, ...] = ()
    remarks: tuple[str, ...] = ()
    """Sentences on clipped recordings."""
    noise_is_known = True
    given = "traces"
    """What was measured, as refusals name it."""
    widths: tuple[float, ...] = ()
    """Widths over which a search may first smooth, the widest first."""

    def __init__(self, base: Scene, free: Free, deadline: Deadline, shifts: int = 0) -> None:
        self._base, self._free, self._deadline = base, free, deadline
        self._measured = np.zeros(0)
        self._keys = len(free.keys)
        self.begin = np.append(np.ones(self._keys), np.zeros(shifts))
        """Where a search begins, and the bounds of what varies."""
        self.low = np.append(free.low, np.full(shifts, -np.inf))
        self.high = np.append(free.high, np.full(shifts, np.inf))
        self.runs = self.offsets = 0
        """Runs so far, and how many offsets of gauges were subtracted."""

    @property
    def size(self) -> int:
        """Number of compared samples."""
        return self._measured.size

    def shifts(self, x: FloatArray) -> FloatArray:  # noqa: ARG002
        """Times on the measured clocks at which the run begins [s], shape (files,)."""
        return np.zeros(0)

    def values(self, x: FloatArray) -> dict[str, float]:
        """Values of the keys, by name."""
        return self._free.values(x)

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
        return self._free.scene(self._base, x)

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
        values = self.values(x)
        try:
            forces = self._read(x, rtol)
        except SceneError as problem:
            raise RunFailed(f"with {said(values)}, which the fit tried: {problem}") from None
        return self._smoothed(values.get(GAIN, 1.0) * forces - self._measured, width)

    def slopes(self, x: FloatArray, width: float = 0.0, rtol: float | None = None) -> FloatArray:
        """Derivatives of the differences, shape (samples, varied), from central differences."""
        steps = np.full(x.size, _SEARCH_STEP if rtol is None else _FINE_STEP)
        steps[: self._keys] *= x[: self._keys]
        moves = np.diag(steps)
        before, after = (np.clip(x + sign * moves, self.low, self.high) for sign in (-1, 1))
        self.runs += 2 * x.size
        ends = [*before, *after]
        differences = list(on_cores(lambda end: self._differences(end, width, rtol), ends))
        changes = np.array(differences[x.size :]) - np.array(differences[: x.size])
        return np.asarray(changes.T / np.diag(after - before))

    @abstractmethod
    def _read(self, x: FloatArray, rtol: float | None) -> FloatArray:
        """Forces of the scene with other values over the noise, shape (samples,)."""

    def _smoothed(self, values: FloatArray, width: float) -> FloatArray:  # noqa: ARG002
        return values

    @abstractmethod
    def chance(self, differences: FloatArray) -> float:
        """Probability that noise causes differences that last as long as these."""


@dataclass(frozen=True, eq=False)
class Series:
    """The samples of a gauge in a file that are compared.

    Parameters
    ----------
    file, gauge
        Places of the file, and of the gauge among those of the model.
    time
        On the measured clock [s], shape (samples,).
    force
        Without offset, over the noise, shape (samples,).
    noise
        Standard deviation of the noise [N].
    quiet
        Number of samples at the start before anything arrives.
    block
        Samples in half the width of the narrowest pulse.
    """

    file: int
    gauge: int
    time: FloatArray
    force: FloatArray
    noise: float
    quiet: int
    block: int


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
        self._series = [
            series for k, file in enumerate(files) for series in self._compared(k, *file)
        ]
        self.offsets = len(self._series)
        self._measured = np.concatenate([series.force for series in self._series])
        self._gauge = np.repeat(
            [series.gauge for series in self._series], [series.time.size for series in self._series]
        )
        noise = 1 / max(np.ptp(series.force) for series in self._series)
        self._rtol = float(np.clip(_RTOL_OVER_NOISE * noise, SLOPE_RTOL, _LOOSEST_RTOL))

    def _compared(self, at: int, traces: Traces, shift: float, expected: Expected) -> list[Series]:
        """Return the samples of a file while the scene is known."""
        during = (traces.time >= shift) & (traces.time - shift <= expected.until)
        time, compared = traces.time[during], []
        allowed = "have no samples while the scene is known: check clock and unit"
        require(time.size > FEWEST_SAMPLES, "traces", None, allowed)
        width = np.nanmin([read.width for read in expected.readings])
        block = max(int(0.5 * width / np.median(np.diff(time))), 1)
        for k, (gauge, read) in enumerate(zip(traces.gauges, expected.readings, strict=True)):
            least = _LEAST_NOISE * np.max(np.abs(expected.force[:, k]))
            noise = max(float(traces.noise[k]), float(least))
            force = _centred(traces.force[during, k] / noise)
            quiet = int(np.searchsorted(time, shift + read.arrival - width))
            place = self.gauges.index(gauge)
            compared.append(Series(at, place, time, force, noise, quiet, block))
        return compared

    def shifts(self, x: FloatArray) -> FloatArray:
        """Times on the measured clocks at which the run begins [s], shape (files,)."""
        later = x[self._keys :] if x.size > self._keys else 0.0
        return np.asarray(self._shifts + self._base.contact_time * later)

    def _parts(self, values: FloatArray) -> list[FloatArray]:
        """Return the values of each series."""
        return np.split(values, np.cumsum([series.time.size for series in self._series])[:-1])

    def _read(self, x: FloatArray, rtol: float | None) -> FloatArray:
        """Forces over the noise, recorded at the very times of the samples.

        Where contacts begin with a collision, forces of dampers rise too steeply for splines.
        """
        shifts, scene = self.shifts(x), self.scene(x)
        places = [series.time - shifts[series.file] for series in self._series]
        clipped = np.clip(np.concatenate(places), 0.0, scene.end_time)
        times, place = np.unique(clipped, return_inverse=True)
        history = motion_at(scene, times, rtol or self._rtol, self._deadline)
        force = read_in(scene, self.gauges, history)[place, self._gauge]
        pairs = zip(self._series, self._parts(force), strict=True)
        return np.concatenate([_centred(part / series.noise) for series, part in pairs])

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


def said(values: dict[str, float]) -> str:
    """Return values of keys in words."""
    return ", ".join(f"{key} = {value:.6g}" for key, value in values.items())


def lasting(differences: FloatArray) -> tuple[float, float]:
    """Return the correlation with the next sample, and the variance of means that it multiplies."""
    centred = differences - differences.mean()
    along = float(np.sum(centred[1:] * centred[:-1]) / max(float(np.sum(centred**2)), 1e-300))
    is_white = abs(along) < 3 / np.sqrt(differences.size)
    return along, 1.0 if is_white else max((1 + along) / max(1 - along, 1e-3), 1.0)


def _centred(values: FloatArray) -> FloatArray:
    """Values of a gauge less their mean: an offset of a gauge changes nothing."""
    return np.asarray(values - values.mean())


_SEARCH_RTOL = 1e-8
"""Accuracy of runs of the search: a hundredth of the digits of files."""


class OfPeaks(Model):
    """Relative differences of peak forces.

    Parameters
    ----------
    peaks
        Forces of each file [N], shape (contacts,), NaN where none was measured; contacts without
        force, of which there is no relative difference, are left out.
    """

    noise_is_known = False
    given = "peaks"

    def __init__(
        self, base: Scene, free: Free, peaks: Sequence[FloatArray], deadline: Deadline
    ) -> None:
        super().__init__(base, free, deadline)
        self._places = np.concatenate([np.flatnonzero(forces > 0) for forces in peaks])
        self._force = np.concatenate([forces[forces > 0] for forces in peaks])
        possible = bool(np.all((self._force > 1 / MOST_EXTENT) & (self._force < MOST_EXTENT)))
        allowed = f"must be from {1 / MOST_EXTENT:g} to {MOST_EXTENT:g} N: check their unit"
        require(possible, "peak forces", None, allowed)
        self._measured = np.ones(self._force.size)
        need = len(free.keys) + 1
        allowed = f"must be at least {need} for {len(free.keys)} free keys: measure more contacts"
        require(self.size >= need, "number of peaks", self.size, allowed)

    def _read(self, x: FloatArray, rtol: float | None) -> FloatArray:
        rtol, scene = rtol or _SEARCH_RTOL, self.scene(x)
        run: Result = self._deadline.spend(
            lambda left: Native(rtol=rtol, time_limit=left, wanted="all").run(scene)
        )
        late = self._places[run.is_cut_off[self._places]]
        if late.size:
            contact = run.scene.contact_name(run.scene.contacts[late[0]])
            allowed = f"is before the peak of {contact}: give a later end_time in [run]"
            raise SceneError("end_time", run.scene.end_time, allowed)
        return np.asarray(run.peak_force[self._places] / self._force)

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
