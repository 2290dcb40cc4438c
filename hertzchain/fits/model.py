"""The comparison of a fit: measured samples with those of scenes with other values, and slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native.motion import motion_at
from hertzchain.errors import RunFailed, SceneError, require
from hertzchain.limits import Deadline
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.run import Run
from hertzchain.scene.scene import Scene
from hertzchain.sweeps.keys import changed
from hertzchain.verdict.traces.matching import FEWEST, Expected, read_in
from hertzchain.verdict.traces.traces import ENOUGH, Traces

GAIN = "gain"
"""A key that no scene has: the measured over the true force, the same for all gauges."""

_STEP = 1e-3
"""Relative change of a value for a slope: its error by curvature and by that of runs are both some
1e-6 of a curve that bends as a power of the value."""

ACCURATE = 1e-8
"""Accuracy of runs: 1e-5 of the differences that slopes are made of."""

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
        self._unit = base.contact_time
        self._shifts = np.array([shift for _, shift in files])
        self._samples = [self._compared(traces, shift, known) for traces, shift in files]
        largest = known.result.peak_force.max()
        noise = min(float(one.noise.min()) for one in self._samples) / largest
        self._rtol = float(np.clip(_OF_NOISE * noise, ACCURATE, _LOOSEST))
        self.runs = 0

    def _compared(self, traces: Traces, shift: float, known: Expected) -> Samples:
        places = tuple(self._gauges.index(gauge) for gauge in traces.gauges)
        during = (traces.time >= shift) & (traces.time - shift <= known.until)
        least = _LEAST_NOISE * np.max(np.abs(known.force[:, list(places)]), axis=0)
        noise = np.maximum(traces.noise, least)
        allowed = "have no samples while the scene is known: check clock and unit"
        require(int(np.count_nonzero(during)) > FEWEST, "traces", None, allowed)
        time, read = traces.time[during], [known.readings[place] for place in places]
        width = min(known.result.gauges[k].width for k in range(len(self._gauges)))
        quiet = np.searchsorted(time, [shift + one.arrival - width for one in read])
        block = max(int(0.5 * width / np.median(np.diff(time))), 1)
        return Samples(time, traces.force[during], noise, places, tuple(quiet.tolist()), block)

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

    def allows(self, x: Array) -> bool:
        """Whether all values are within their bounds, and the scene is possible."""
        own, (low, high) = x[: len(self._keys)], self._bounds
        if not np.all((own > low) & (own < high)):
            return False
        try:
            self.scene(x)
        except SceneError:
            return False
        return True

    def scene(self, x: Array) -> Scene:
        """The scene with other values."""
        values = {key: value for key, value in self.values(x).items() if key != GAIN}
        return changed(self._base, values)

    def _read(self, x: Array, later: float = 0.0, rtol: float | None = None) -> FloatArray:
        """What a scene with other values reads at the samples over the noise, shape (samples,).

        It is recorded at just these times, ``later`` time units later: where contacts begin with
        a collision, forces of dampers rise too steeply for splines.
        """
        ends = self._base.end_time
        places = [
            np.clip(one.time - shift + later * self._unit, 0.0, ends)
            for one, shift in zip(self._samples, self.shifts(x), strict=True)
        ]
        times, place = np.unique(np.concatenate(places), return_inverse=True)
        self.runs += 1
        try:
            scene = self.scene(x)
            history = motion_at(scene, times, rtol or self._rtol, self._deadline)
            force = read_in(scene, self._gauges, history)[place]
        except SceneError as problem:
            tried = ", ".join(f"{key} = {value:.6g}" for key, value in self.values(x).items())
            raise RunFailed(f"with {tried}, which the fit tried: {problem}") from None
        force = force * self.values(x).get(GAIN, 1.0)
        of_files = np.split(force, np.cumsum([one.size for one in places])[:-1])
        return np.concatenate(
            [
                _centred(own[:, list(one.gauges)] / one.noise)
                for own, one in zip(of_files, self._samples, strict=True)
            ]
        )

    def differences(self, x: Array) -> FloatArray:
        """Differences from the measured samples over the noise, shape (samples,)."""
        measured = [_centred(one.force / one.noise) for one in self._samples]
        return np.asarray(self._read(x) - np.concatenate(measured))

    def chance(self, differences: FloatArray) -> float:
        """Probability that noise makes differences which last as long as these.

        Their sums over half a pulse are squared and summed; how far noise itself lasts is known
        from quiet samples.
        """
        from scipy.stats import chi2

        sums, quiet, begin = [], [], 0
        for one in self._samples:
            size, block = one.time.size, one.block
            for count in one.quiet:
                own = differences[begin : begin + size]
                begin += size
                whole = own[: size // block * block].reshape(-1, block)
                sums.append(whole.sum(axis=1) / np.sqrt(block))
                quiet.append(own[:count])
        before = np.concatenate(quiet)
        _, wider = lasting(before if before.size >= ENOUGH else differences)
        blocks = np.concatenate(sums)
        scale = float(np.mean(differences**2)) * wider
        return float(chi2.sf(float(np.sum(blocks**2)) / max(scale, 1e-300), blocks.size))

    def slopes(self, x: Array, rtol: float | None = None) -> FloatArray:
        """Derivatives of the differences, shape (samples, keys and shifts).

        ``rtol`` is the accuracy of their runs, None for that of the search.
        """
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
                ends.append(self._read(moved, rtol=rtol))
            columns.append((ends[1] - ends[0]) / (high - low))
        if self._is_shifted:
            slope = (self._read(x, -_STEP, rtol) - self._read(x, _STEP, rtol)) / (2 * _STEP)
            sizes = np.cumsum([0, *(one.force.size for one in self._samples)])
            for begin, end in pairwise(sizes):
                column = np.zeros(slope.size)
                column[begin:end] = slope[begin:end]
                columns.append(column)
        return np.stack(columns, axis=1)


def lasting(differences: FloatArray) -> tuple[float, float]:
    """Return the correlation with the next sample, and the variance of means that it multiplies."""
    centred = differences - differences.mean()
    along = float(np.sum(centred[1:] * centred[:-1]) / max(float(np.sum(centred**2)), 1e-300))
    is_white = abs(along) < 3 / np.sqrt(differences.size)
    return along, 1.0 if is_white else max((1 + along) / max(1 - along, 1e-3), 1.0)


def _centred(values: FloatArray) -> FloatArray:
    """Values of gauges less their mean, gauge by gauge: an offset of a gauge changes nothing."""
    return np.asarray((values - values.mean(axis=0)).T.ravel())
