"""The comparison of a fit: measured samples with those of scenes with other values, and slopes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native.motion import motion_at
from hertzchain.errors import RunFailed, SceneError, require
from hertzchain.fits.fitted import Overlaid
from hertzchain.fits.free import GAIN, Free
from hertzchain.limits import Deadline
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.run import Run
from hertzchain.scene.scene import Scene
from hertzchain.sweeps.keys import changed
from hertzchain.sweeps.ties import tied
from hertzchain.verdict.traces.matching import FEWEST, Expected, read_in
from hertzchain.verdict.traces.traces import ENOUGH, Traces

_STEP, _FINE_STEP = 1e-3, 1e-4
"""Relative changes of a value for a slope, of the search and of ``ACCURATE`` ones. By the longer
one a collision's jump makes 1e-3 of a slope where two keys have the same effect (measured)."""

ACCURATE = 1e-10
"""Accuracy of runs: 1e-6 of the differences that slopes are made of."""


def _step(rtol: float | None) -> float:
    return _STEP if rtol is None else _FINE_STEP


_LOOSEST, _OF_NOISE = 3e-6, 1e-3
"""Accuracy of runs during a search: this part of the noise over the peak, and its loosest, at which
slopes are known to a part in 300."""

_LEAST_NOISE = 1e-6
"""Least noise, over the peak: what the digits of files and the shift of a clock leave (chosen)."""

_BEYOND = 1.25
"""End of runs over that of compared samples: values that make a wave slower move it."""


@dataclass(frozen=True, eq=False)
class Samples:
    """The samples of a file that are compared.

    Parameters
    ----------
    time
        On the measured clock [s], shape (samples,).
    force
        Without offsets [N], shape (samples, gauges).
    noise
        Standard deviation of each gauge [N], shape (gauges,).
    gauges
        Columns of the model that the gauges are, shape (gauges,).
    quiet
        How many first samples of each gauge are before anything arrives, shape (gauges,).
    block
        Samples in half the width of the narrowest pulse.
    """

    time: FloatArray
    force: FloatArray
    noise: FloatArray
    gauges: tuple[int, ...]
    quiet: tuple[int, ...]
    block: int


class Model(ABC):
    """Differences of what was measured from a scene with other values, over the noise.

    What varies are values of keys over their start values, (keys,), and then others, if any.
    """

    gauges: tuple[Gauge, ...] = ()
    noise_is_known = True
    widths: tuple[float, ...] = ()
    """Widths over which a search may first smooth, the widest first."""

    def __init__(self, base: Scene, free: Free, deadline: Deadline) -> None:
        self._base, self._free, self._deadline = base, free, deadline
        self._measured = np.zeros(0)
        self.begin: FloatArray = np.ones(len(free.keys))
        """Where a search begins: the start values, and the shifts that were found."""
        self.runs = self.series = 0
        """Runs so far, and series of samples; each has an offset of its own."""

    @property
    def size(self) -> int:
        """Number of compared samples."""
        return self._measured.size

    def shifts(self, x: Array) -> FloatArray:  # noqa: ARG002
        """Times on the measured clocks at which the run begins [s], shape (files,)."""
        return np.zeros(0)

    def values(self, x: Array) -> dict[str, float]:
        """Values of the keys, by name."""
        free = self._free
        return {key: float(x[k]) * free.start[k] for k, key in enumerate(free.keys)}

    def allows(self, x: Array) -> bool:
        """Whether all values are within their bounds, and the scene is possible."""
        own = x[: len(self._free.keys)]
        if not np.all((own > self._free.low) & (own < self._free.high)):
            return False
        try:
            self.scene(x)
        except SceneError:
            return False
        return True

    def scene(self, x: Array) -> Scene:
        """The scene with other values."""
        values = {key: value for key, value in self.values(x).items() if key != GAIN}
        return changed(self._base, tied(self._base, self._free.ties, values))

    def read(self, x: Array, rtol: float | None = None, later: float = 0.0) -> FloatArray:
        """Return what a scene with other values gives over the noise, shape (samples,).

        ``rtol`` is the accuracy of the run, None for that of the search; ``later`` is in units of
        time.
        """
        self.runs += 1
        try:
            found = self._run(x, rtol, later)
        except SceneError as problem:
            tried = ", ".join(f"{key} = {value:.6g}" for key, value in self.values(x).items())
            raise RunFailed(f"with {tried}, which the fit tried: {problem}") from None
        return self._over_noise(found * self.values(x).get(GAIN, 1.0))

    @abstractmethod
    def _run(self, x: Array, rtol: float | None, later: float) -> FloatArray:
        """Forces of a scene with other values [N], shape (samples,)."""

    @abstractmethod
    def _over_noise(self, force: FloatArray) -> FloatArray:
        """The same over the noise."""

    @abstractmethod
    def chance(self, differences: FloatArray) -> float:
        """Probability that noise makes differences which last as long as these."""

    @abstractmethod
    def overlays(self, x: Array) -> tuple[Overlaid, ...]:
        """What was measured and what a scene with other values gives."""

    def _smoothed(self, values: FloatArray, width: float) -> FloatArray:  # noqa: ARG002
        return values

    def differences(self, x: Array, width: float = 0.0) -> FloatArray:
        """Differences from what was measured over the noise, shape (samples,), or smoothed."""
        return self._smoothed(np.asarray(self.read(x) - self._measured), width)

    def slopes(self, x: Array, width: float = 0.0, rtol: float | None = None) -> FloatArray:
        """Derivatives of the differences, shape (samples, varied)."""
        return self._smoothed(self._slopes(x, rtol), width)

    def _slopes(self, x: Array, rtol: float | None) -> FloatArray:
        columns = []
        for k, (least, most) in enumerate(zip(self._free.low, self._free.high, strict=True)):
            low, high = (np.clip(x[k] * (1 + side * _step(rtol)), least, most) for side in (-1, 1))
            ends = []
            for value in (low, high):
                moved = x.copy()
                moved[k] = value
                ends.append(self.read(moved, rtol))
            columns.append((ends[1] - ends[0]) / (high - low))
        return np.stack(columns, axis=1)


class OfTraces(Model):
    """Differences of traces; after the keys vary the shifts of all clocks, if they are unknown."""

    # In halves of a pulse: wide enough to meet the next pulse, then as wide as one (measured).
    widths = (4.0, 1.0)

    def __init__(
        self, base: Scene, free: Free, known: Expected, files: Sequence[tuple[Traces, float]],
        deadline: Deadline, *, is_shifted: bool,
    ) -> None:  # fmt: skip
        super().__init__(replace(base, gauges=(), run=Run(_BEYOND * known.until)), free, deadline)
        self.gauges = known.result.scene.gauges
        self._is_shifted = is_shifted
        self._unit = base.contact_time
        self._shifts = np.array([shift for _, shift in files])
        self._samples = [self._compared(traces, shift, known) for traces, shift in files]
        self.series = sum(one.force.shape[1] for one in self._samples)
        if is_shifted:
            self.begin = np.append(self.begin, self._shifts / self._unit)
        measured = [_centred(one.force / one.noise) for one in self._samples]
        self._measured = np.concatenate(measured)
        largest = known.result.peak_force.max()
        noise = min(float(one.noise.min()) for one in self._samples) / largest
        self._rtol = float(np.clip(_OF_NOISE * noise, ACCURATE, _LOOSEST))

    def _compared(self, traces: Traces, shift: float, known: Expected) -> Samples:
        places = tuple(self.gauges.index(gauge) for gauge in traces.gauges)
        during = (traces.time >= shift) & (traces.time - shift <= known.until)
        least = _LEAST_NOISE * np.max(np.abs(known.force[:, list(places)]), axis=0)
        noise = np.maximum(traces.noise, least)
        allowed = "have no samples while the scene is known: check clock and unit"
        require(int(np.count_nonzero(during)) > FEWEST, "traces", None, allowed)
        time, read = traces.time[during], [known.readings[place] for place in places]
        width = min(known.result.gauges[k].width for k in range(len(self.gauges)))
        quiet = np.searchsorted(time, [shift + one.arrival - width for one in read])
        block = max(int(0.5 * width / np.median(np.diff(time))), 1)
        return Samples(time, traces.force[during], noise, places, tuple(quiet.tolist()), block)

    def _series(self) -> Iterator[tuple[Samples, int, slice]]:
        """Yield file, place in it, and samples of each gauge."""
        end = 0
        for one in self._samples:
            for k in range(len(one.gauges)):
                yield one, k, slice(end, end := end + one.time.size)

    def shifts(self, x: Array) -> FloatArray:
        """Times on the measured clocks at which the run begins [s], shape (files,)."""
        return (
            np.asarray(x[len(self._free.keys) :] * self._unit) if self._is_shifted else self._shifts
        )

    def _run(self, x: Array, rtol: float | None, later: float) -> FloatArray:
        """Forces at the samples, shape (times, gauges), recorded at just these times.

        Where contacts begin with a collision, forces of dampers rise too steeply for splines.
        """
        ends = self._base.end_time
        places = [
            np.clip(one.time - shift + later * self._unit, 0.0, ends)
            for one, shift in zip(self._samples, self.shifts(x), strict=True)
        ]
        times, place = np.unique(np.concatenate(places), return_inverse=True)
        scene = self.scene(x)
        history = motion_at(scene, times, rtol or self._rtol, self._deadline)
        return read_in(scene, self.gauges, history)[place]

    def _over_noise(self, force: FloatArray) -> FloatArray:
        of_files = np.split(force, np.cumsum([one.time.size for one in self._samples])[:-1])
        return np.concatenate(
            [
                _centred(own[:, list(one.gauges)] / one.noise)
                for own, one in zip(of_files, self._samples, strict=True)
            ]
        )

    def _smoothed(self, values: FloatArray, width: float) -> FloatArray:
        """Values along the samples of each series without minima where pulses meet others."""
        from scipy.ndimage import gaussian_filter1d

        if not width:
            return values
        found = np.empty_like(values)
        for one, _, own in self._series():
            found[own] = gaussian_filter1d(values[own], width * one.block, axis=0)
        return found

    def chance(self, differences: FloatArray) -> float:
        """Probability that noise makes differences which last as long as these.

        Their sums over half a pulse are squared and summed; how far noise itself lasts is known
        from quiet samples.
        """
        from scipy.stats import chi2

        sums, quiet = [], []
        for one, k, part in self._series():
            own, block = differences[part], one.block
            whole = own[: own.size // block * block].reshape(-1, block)
            sums.append(whole.sum(axis=1) / np.sqrt(block))
            quiet.append(own[: one.quiet[k]])
        before = np.concatenate(quiet)
        _, wider = lasting(before if before.size >= ENOUGH else differences)
        blocks = np.concatenate(sums)
        scale = float(np.mean(differences**2)) * wider
        return float(chi2.sf(float(np.sum(blocks**2)) / max(scale, 1e-300), blocks.size))

    def overlays(self, x: Array) -> tuple[Overlaid, ...]:
        """Return them for each gauge of each file."""
        found, fitted = [], self.read(x)
        shifts = dict(zip(map(id, self._samples), self.shifts(x), strict=True))
        for one, k, own in self._series():
            gauge, noise = self.gauges[one.gauges[k]], np.asarray(one.noise[k])
            offset = np.median(fitted[own])  # that of the mean, which lies within the pulse
            measured, curve = (
                np.asarray((force[own] - offset) * noise) for force in (self._measured, fitted)
            )
            name, time = f"{gauge.key} {gauge.number}", np.asarray(one.time - shifts[id(one)])
            found.append(Overlaid(name, "time [s]", time, measured, curve, noise))
        return tuple(found)

    def _slopes(self, x: Array, rtol: float | None) -> FloatArray:
        """As of any model, and by the shifts."""
        own = super()._slopes(x, rtol)
        if not self._is_shifted:
            return own
        step = _step(rtol)
        slope = (self.read(x, rtol, -step) - self.read(x, rtol, step)) / (2 * step)
        ends = np.cumsum([one.force.size for one in self._samples])
        file = np.searchsorted(ends, np.arange(slope.size), side="right")
        return np.column_stack(
            [own, np.where(file[:, None] == np.arange(ends.size), slope[:, None], 0.0)]
        )


def lasting(differences: FloatArray) -> tuple[float, float]:
    """Return the correlation with the next sample, and the variance of means that it multiplies."""
    centred = differences - differences.mean()
    along = float(np.sum(centred[1:] * centred[:-1]) / max(float(np.sum(centred**2)), 1e-300))
    is_white = abs(along) < 3 / np.sqrt(differences.size)
    return along, 1.0 if is_white else max((1 + along) / max(1 - along, 1e-3), 1.0)


def _centred(values: FloatArray) -> FloatArray:
    """Values of gauges less their mean, gauge by gauge: an offset of a gauge changes nothing."""
    return np.asarray((values - values.mean(axis=0)).T.ravel())
