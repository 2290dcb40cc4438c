"""The comparison of a fit: measured samples with those of scenes with other values, and slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import Native
from hertzchain.errors import RunFailed, SceneError, require
from hertzchain.limits import Deadline
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.run import Run
from hertzchain.scene.scene import Scene
from hertzchain.sweeps.keys import changed
from hertzchain.verdict.traces.matching import FEWEST, Expected, recorded
from hertzchain.verdict.traces.traces import Traces

GAIN = "gain"
"""A key that no scene has: the measured over the true force, the same for all gauges."""

_STEP = 1e-3
"""Relative change of a value for a slope: its error by curvature and by that of runs are both some
1e-6 of a curve that bends as a power of the value."""

_RTOL = 1e-8
"""Accuracy of runs: 1e-5 of the differences that slopes are made of."""

_LEAST_NOISE = 1e-6
"""Least noise, over the peak: that of the splines between recorded times."""

_BEYOND = 1.25
"""End of recorded times over that of compared ones: values that make a wave slower move it."""


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
    """

    time: FloatArray
    force: FloatArray
    noise: FloatArray
    gauges: tuple[int, ...]


class Model:
    """Differences of measured samples from those of a scene, over the noise, and their slopes.

    What varies are values of keys over their start values, (keys,), and then shifts of the clocks
    of all files over a time unit, (files,), if they are not known.
    """

    def __init__(
        self,
        base: Scene,
        keys: Sequence[str],
        start: Sequence[float],
        bounds: tuple[FloatArray, FloatArray],
        known: Expected,
        files: Sequence[tuple[Traces, float]],
        deadline: Deadline,
        *,
        is_shifted: bool,
    ) -> None:
        self._base = replace(base, gauges=(), run=Run(_BEYOND * known.until))
        self._keys, self._start, self._bounds = tuple(keys), tuple(start), bounds
        self._gauges = known.result.scene.gauges
        self._deadline, self._is_shifted = deadline, is_shifted
        step = known.time[1] - known.time[0]
        self._time = np.linspace(0, _BEYOND * known.until, int(_BEYOND * known.until / step) + 2)
        self._unit = base.contact_time
        self._shifts = np.array([shift for _, shift in files])
        self._samples = [self._compared(traces, shift, known) for traces, shift in files]
        self.runs = 0
        self._last: tuple[Array, FloatArray] = np.zeros(0), np.zeros((0, 0))

    def _compared(self, traces: Traces, shift: float, known: Expected) -> Samples:
        places = tuple(self._gauges.index(gauge) for gauge in traces.gauges)
        during = (traces.time >= shift) & (traces.time - shift <= known.until)
        least = _LEAST_NOISE * np.max(np.abs(known.force[:, list(places)]), axis=0)
        noise = np.maximum(traces.noise, least)
        allowed = "have no samples while the scene is known: check clock and unit"
        require(int(np.count_nonzero(during)) > FEWEST, "traces", None, allowed)
        return Samples(traces.time[during], traces.force[during], noise, places)

    @property
    def gauges(self) -> tuple[Gauge, ...]:
        """The gauges of all files."""
        return self._gauges

    @property
    def size(self) -> int:
        """Number of compared samples."""
        return sum(one.force.size for one in self._samples)

    @property
    def series(self) -> int:
        """Number of series of samples; each has an offset of its own."""
        return sum(one.force.shape[1] for one in self._samples)

    @property
    def begin(self) -> FloatArray:
        """Return the start of a search: the start values, and the shifts that were found."""
        shifts = self._shifts / self._unit if self._is_shifted else np.zeros(0)
        return np.concatenate([np.ones(len(self._keys)), shifts])

    def shifts(self, x: Array) -> FloatArray:
        """Times on the measured clocks at which the run begins [s], shape (files,)."""
        return np.asarray(x[len(self._keys) :] * self._unit) if self._is_shifted else self._shifts

    def values(self, x: Array) -> dict[str, float]:
        """Values of the keys, by name."""
        return {key: float(x[k]) * self._start[k] for k, key in enumerate(self._keys)}

    def scene(self, x: Array) -> Scene:
        """The scene with other values."""
        values = {key: value for key, value in self.values(x).items() if key != GAIN}
        return changed(self._base, values)

    def _curves(self, x: Array) -> FloatArray:
        """Return the forces of the gauges in a scene with other values [N], (times, gauges)."""
        if np.array_equal(x[: len(self._keys)], self._last[0]):
            return self._last[1]
        self.runs += 1
        native = Native(rtol=_RTOL, wanted="all", time_limit=max(self._deadline.left, 1e-3))
        try:
            force = recorded(self.scene(x), self._gauges, native, self._time)
        except SceneError as problem:
            tried = ", ".join(f"{key} = {value:.6g}" for key, value in self.values(x).items())
            raise RunFailed(f"with {tried}, which the fit tried: {problem}") from None
        self._last = x[: len(self._keys)].copy(), force * self.values(x).get(GAIN, 1.0)
        return self._last[1]

    def _read(self, curves: FloatArray, x: Array, derivative: int = 0) -> FloatArray:
        """Curves, or their slopes, at the samples over the noise, shape (samples,)."""
        from scipy.interpolate import CubicSpline

        found = []
        for one, shift in zip(self._samples, self.shifts(x), strict=True):
            time = np.clip(one.time - shift, 0.0, self._time[-1])
            spline = CubicSpline(self._time, curves[:, list(one.gauges)])
            found.append(_centred(spline(time, derivative) / one.noise))
        return np.concatenate(found)

    def differences(self, x: Array) -> FloatArray:
        """Differences from the measured samples over the noise, shape (samples,)."""
        measured = [_centred(one.force / one.noise) for one in self._samples]
        return np.asarray(self._read(self._curves(x), x) - np.concatenate(measured))

    def slopes(self, x: Array) -> FloatArray:
        """Derivatives of the differences, shape (samples, keys and shifts)."""
        of_shifts = []
        if self._is_shifted:
            slope = -self._read(self._curves(x), x, derivative=1) * self._unit
            sizes = np.cumsum([0, *(one.force.size for one in self._samples)])
            for begin, end in pairwise(sizes):
                column = np.zeros(slope.size)
                column[begin:end] = slope[begin:end]
                of_shifts.append(column)
        columns = []
        for k in range(len(self._keys)):
            low, high = (
                np.clip(x[k] * (1 + side * _STEP), self._bounds[0][k], self._bounds[1][k])
                for side in (-1, 1)
            )
            ends = []
            for value in (low, high):
                moved = x.copy()
                moved[k] = value
                ends.append(self._read(self._curves(moved), x))
            columns.append((ends[1] - ends[0]) / (high - low))
        return np.stack([*columns, *of_shifts], axis=1)


def _centred(values: FloatArray) -> FloatArray:
    """Values of gauges less their mean, gauge by gauge: an offset of a gauge changes nothing."""
    return np.asarray((values - values.mean(axis=0)).T.ravel())
