"""Measured traces fitted to those of a scene: the shift of the clock, and each first pulse."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.errors import require
from hertzchain.observables.gauges import Reading, force_over_time
from hertzchain.observables.history import History
from hertzchain.observables.result import Result
from hertzchain.pulses.noise import noise_before, resolution_of
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.scene import Scene
from hertzchain.verdict.traces.traces import ENOUGH, Traces

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_FINE, _MOST_TIMES = 60, 20_000
"""Recorded times for each width of the narrowest pulse: a cubic spline is within 1e-6 of its force
(measured); and the most of them."""

_COARSE = 10
"""Steps of the search for the shift for each width; least squares find the rest."""

_UNSURE = 1e-4
"""Difference of two accurate runs, over the peak, from which on later forces are not known."""

_AFTER = 1.2
"""End of the fit of a first pulse, in widths from its arrival: a little after the end of the pulse,
where it has fallen to a half."""

_QUIET = 1e-4
"""Part of its largest force below which a gauge is quiet (chosen): that of most is far below two
widths before a pulse arrives."""

_SHARPEST = 1e-6
"""Least deviation of a delay, in widths, averaged over gauges: that of the splines."""

FEWEST = 8
"""Fewest samples of a first pulse that determine its height, time and width."""


@dataclass(frozen=True, eq=False)
class Expected:
    """Forces of the gauges of a scene over time.

    Parameters
    ----------
    result
        A run with these gauges.
    time
        Times [s], shape (times,).
    force
        Without static forces [N], shape (times, gauges).
    until
        From this time on the forces are not known [s]: collisions amplify errors.
    """

    result: Result
    time: FloatArray
    force: FloatArray
    until: float

    @property
    def readings(self) -> tuple[Reading, ...]:
        """The first pulse of each gauge."""
        return self.result.gauges

    @cached_property
    def _curves(self) -> list[CubicSpline]:
        from scipy.interpolate import CubicSpline

        return [CubicSpline(self.time, force) for force in self.force.T]

    def at(self, gauge: int, time: FloatArray) -> FloatArray:
        """Force of a gauge at times [N]; 0 before the start, that at the end after it."""
        force = self._curves[gauge](np.clip(time, 0.0, self.time[-1]))
        return np.where(time < 0, 0.0, force)


def expected(scene: Scene, gauges: tuple[Gauge, ...], native: Native) -> Expected:
    """Run a scene with gauges, and record their forces until its end.

    SceneError if no pulse arrives at any of them.
    """
    result = native.run(replace(scene, gauges=gauges))
    widths = np.array([one.width for one in result.gauges])
    allowed = "reads no whole first pulse in this scene: name others, or give a later end_time"
    require(bool(np.isfinite(widths).any()), "gauge", None, allowed)
    end = result.scene.end_time
    count = int(min(_FINE * end / np.nanmin(widths), _MOST_TIMES)) + 2
    time = np.linspace(0.0, end, count)
    rough = Native(rtol=1e-6, time_limit=native.time_limit)
    force, other = (_recorded(result.scene, gauges, one, time) for one in (native, rough))
    off = np.abs(other - force) > _UNSURE * np.max(np.abs(force), axis=0)
    unsure = np.flatnonzero(off.any(axis=1))
    last = np.nanmax([one.arrival + one.width for one in result.gauges])
    until = end if not unsure.size else max(float(time[unsure[0]]), float(last))
    return Expected(result, time, force, until)


def _recorded(
    scene: Scene, gauges: tuple[Gauge, ...], native: Native, time: FloatArray
) -> FloatArray:
    run = replace(native, peaks_only=False, wanted="first").run(replace(scene, gauges=()), time)
    assert run.history is not None
    return read_in(scene, gauges, run.history)


def read_in(scene: Scene, gauges: tuple[Gauge, ...], history: History) -> FloatArray:
    """Return the forces of gauges in a history [N], shape (times, gauges)."""
    return np.stack([force_over_time(scene, gauge, history) for gauge in gauges], axis=1)


def without_offset(traces: Traces, known: Expected, shift: float) -> Traces:
    """Return traces less their mean before anything arrived, if there are enough samples.

    Their noise is the deviation of these samples, if there are ``ENOUGH``.
    """
    force, noise = traces.force.copy(), traces.noise.copy()
    for k, read in enumerate(known.readings):
        width = read.width if np.isfinite(read.width) else 0.0
        arrival = min(read.arrival, known.until)  # the latter where nothing arrives
        # Where contacts are unloaded before they are pressed, the gauge is quiet until then.
        moves = np.abs(known.force[:, k]) > _QUIET * np.max(np.abs(known.force[:, k]))
        quiet = min(arrival - 2 * width, float(known.time[np.argmax(moves)]))
        before = force[traces.time - shift < quiet, k]
        if before.size >= FEWEST:
            force[:, k] -= before.mean()
        if before.size >= ENOUGH:
            step = float(np.median(np.diff(traces.time)))
            # Digits may show in the pulse alone: no sample before it need differ from another.
            digit = max(resolution_of(before), resolution_of(force[:, k]))
            noise[k] = noise_before(before, step, digit).deviation
    return replace(traces, force=force, noise=noise)


def shift_of(traces: Traces, known: Expected) -> float:
    """Time on the measured clock at which the run begins [s], to a fraction of a pulse's width.

    It is the time with the largest correlation of all gauges with the reference, independent of
    their gain. SceneError if the correlation is larger with the opposite sign.
    """
    from scipy.signal import correlate

    whole = [k for k, one in enumerate(known.readings) if np.isfinite(one.width)]
    step = float(min(known.readings[k].width for k in whole)) / _COARSE
    size = int((traces.time[-1] - traces.time[0]) / step) + 1
    allowed = f"last {np.ptp(traces.time):.3g} s, which is less than a first pulse: check the unit"
    require(size > _COARSE, "times", None, allowed)
    require(size < 100 * _MOST_TIMES, "times", None, "last far longer than the run: check the unit")
    grid = traces.time[0] + step * np.arange(size)
    own = step * np.arange(int(known.until / step) + 1, dtype=np.float64)
    product = np.zeros(size + own.size - 1)
    energy, total = np.zeros_like(product), 0.0
    for k in whole:
        force = traces.force[:, k] - np.median(traces.force[:, k])
        measured = np.interp(grid, traces.time, force)
        model = known.at(k, own)
        scale = np.max(np.abs(model)) ** 2
        energy += correlate(measured**2, np.ones(own.size), method="fft") / scale
        product += correlate(measured, model, method="fft") / scale
        total += float(np.sum(model**2)) / scale
    # With hardly any signal a correlation is by chance.
    least = 1e-6 * float(np.max(energy))
    correlation = product / np.sqrt(np.maximum(energy, least) * total)
    allowed = "are upside down: give a negative unit, such as 'gauge_16=CH1 [-25 N]'"
    require(bool(np.max(correlation) >= -np.min(correlation)), "forces", None, allowed)
    return float(traces.time[0] + step * (int(np.argmax(correlation)) - own.size + 1))


def matched(
    traces: Traces, known: Expected, shift: float, k: int
) -> tuple[FloatArray, FloatArray] | None:
    """Return a measured first pulse relative to the scene's, and deviations by noise, shape (3,).

    They are ratios of height and width, and a delay [s]. None if the pulse is not complete in scene
    or recording, or if its samples do not determine all three.
    """
    from scipy.optimize import least_squares

    read = known.readings[k]
    if not np.isfinite(read.width):
        return None
    begin, end = read.arrival - read.width, read.arrival + _AFTER * read.width
    during = (traces.time - shift >= begin) & (traces.time - shift <= end)
    time, force = traces.time[during] - shift, traces.force[during, k]
    if time.size < FEWEST or time[-1] < read.arrival + read.width * 0.9:
        return None

    def residuals(p: FloatArray) -> FloatArray:
        height, stretch, delay = p
        there = read.time + (time - read.time - delay * read.width) / stretch
        return np.asarray((height * known.at(k, there) - force) / read.force)

    found = least_squares(residuals, [1.0, 1.0, 0.0], bounds=([0, 0.2, -3], [np.inf, 5, 3]))
    slopes, unit = np.asarray(found.jac), np.array([1.0, 1.0, read.width])
    if np.linalg.matrix_rank(slopes) < unit.size:
        return None
    deviation = np.linalg.norm(np.linalg.pinv(slopes), axis=1)  # for samples with a deviation of 1
    return unit * found.x, unit * deviation * float(traces.noise[k]) / read.force


def aligned(traces: Traces, known: Expected, shift: float | None) -> tuple[Traces, float]:
    """Return traces without offsets, and the shift of their clock, found where it is not given."""
    at = shift_of(traces, known) if shift is None else shift
    for _ in range(2):  # the second time with offsets from quiet times, which are known then
        traces = without_offset(traces, known, at)
        if shift is not None:
            continue
        found = [matched(traces, known, at, k) for k in range(len(traces.gauges))]
        delays = np.array([(one[0][2], one[1][2]) for one in found if one is not None])
        allowed = "have no whole first pulse of this scene: check clock, unit and gauges"
        require(delays.size > 0, "traces", None, allowed)
        # Samples limit the accuracy of the shift even without noise.
        least = _SHARPEST * float(np.nanmin([one.width for one in known.readings]))
        at += float(np.average(delays[:, 0], weights=1 / (delays[:, 1] + least) ** 2))
    return traces, at
