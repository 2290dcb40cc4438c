"""A measured pulse as a pulse table with few rows, and the effect of noise and of fewer rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import peak_forces
from hertzchain.errors import HertzchainError, is_finite, require
from hertzchain.observables.peaks import largest_difference
from hertzchain.pulses.corners import Corners, Crest, crest_of, impulse_of, reduce, with_crest
from hertzchain.pulses.recording import Recording
from hertzchain.pulses.signal import Signal, binned, pulse_of
from hertzchain.scene.pulse import PulseTable
from hertzchain.scene.scene import Scene

RTOL = 1e-3
"""Default of the largest change of the peaks by fewer rows (chosen)."""

TIGHTEST, LOOSEST = 1e-6, 0.1
"""Range of that change: below it all samples are corners; above it the pulse becomes a different
one.
"""

_BEND = 1 / 3
"""Bow of a line over F0 times the wanted accuracy of the peaks. Measured: peaks of 40 granules of
LM_ratio 0.1 to 10 under the three pulses changed by up to 2.9 bows, mostly by less than 1."""

_REPEATS = 32  # number of recordings with other noise: gives a standard deviation to 13 %
# approximate number of samples in each (chosen): 20 ms a recording
_SAMPLES, _SAMPLES_OF_PULSE = 2000, 200
_SEED = 0
_RUNS = 0.1  # error of a run over the change to be measured


@dataclass(frozen=True)
class Value:
    """A number with its standard deviation from noise, baseline and few rows."""

    value: float
    deviation: float


@dataclass(frozen=True, eq=False)
class InScene:
    """Results of a scene under a measured pulse.

    Parameters
    ----------
    scene
        The scene with the reduced pulse.
    momentum_ratio
        LM_ratio.
    peak_force
        Peak of each contact [N], shape (N - 1,).
    deviation
        Standard deviation of each peak, from noise and the baseline [N], shape (N - 1,).
    change
        Largest relative difference of a peak from the one under all samples.
    """

    scene: Scene
    momentum_ratio: Value
    peak_force: FloatArray
    deviation: FloatArray
    change: float


@dataclass(frozen=True, eq=False)
class MeasuredPulse:
    """A measured pulse, reduced.

    Parameters
    ----------
    recording, signal
        The recording, and the pulse found in it.
    table
        The pulse table with few rows.
    peak_force, impulse, rise_time
        F0 [N], the integral of the force [N s], and the time in which it grows from 10 % to 90 %
        of F0 [s].
    wanted
        Largest relative change of the peaks by fewer rows.
    in_scene
        Results in a scene; None without a scene.
    """

    recording: Recording
    signal: Signal
    table: PulseTable
    peak_force: Value
    impulse: Value
    rise_time: Value
    wanted: float
    in_scene: InScene | None

    def to_text(self) -> str:
        """Return the table as CSV, with the header of pulse tables."""
        rows = zip(self.table.time, self.table.force, strict=True)
        return "time_s,force_N\n" + "".join(f"{time!r},{force!r}\n" for time, force in rows)

    def to_dict(self) -> dict[str, Any]:
        """Return everything except the samples, for JSON."""

        def both(value: Value) -> dict[str, float]:
            return {"value": value.value, "standard_deviation": value.deviation}

        signal, scene = self.signal, self.in_scene
        return {
            "read": dict(self.recording.facts),
            "changed": dict(signal.remarks),
            "warnings": list(signal.warnings),
            "baseline_N": signal.baseline,
            "baseline_samples": signal.baseline_samples,
            "noise_N": signal.noise.deviation,
            "start_s": signal.start,
            "duration_s": self.table.time[-1],
            "impulse_before_N_s": signal.left_out[0],
            "impulse_after_N_s": signal.left_out[1],
            "samples": int(self.recording.time.size),
            "samples_of_pulse": int(signal.time.size),
            "rows": len(self.table.time),
            "peak_force_N": both(self.peak_force),
            "impulse_N_s": both(self.impulse),
            "rise_time_s": both(self.rise_time),
            "wanted": self.wanted,
            "scene": None
            if scene is None
            else {
                "momentum_ratio": both(scene.momentum_ratio),
                "peak_force_N": scene.peak_force.tolist(),
                "standard_deviation_N": scene.deviation.tolist(),
                "change_by_fewer_rows": scene.change,
            },
        }


def check_accuracy(rtol: float) -> None:
    """Raise a SceneError for an impossible accuracy."""
    right = is_finite(rtol) and TIGHTEST <= rtol <= LOOSEST
    require(right, "--rtol", rtol, f"must be a number from {TIGHTEST:g} to {LOOSEST:g}")


def measured_pulse(
    recording: Recording, signal: Signal, wanted: float = RTOL, scene: Scene | None = None
) -> MeasuredPulse:
    """Reduce a measured pulse to as few rows as the accuracy of the peaks allows.

    Parameters
    ----------
    recording, signal
        The recording, and the pulse found in it.
    wanted
        Largest relative change of the peaks by fewer rows.
    scene
        Scene for the pulse, which replaces its shock: what noise and fewer rows do to its peaks.
    """
    corners, crest = _reduced(signal, _BEND * wanted * float(signal.force.max()))
    others = _with_other_noise(recording, signal, corners, crest, _BEND * wanted)
    in_scene = None if scene is None else _in_scene(scene, signal, corners, others, wanted)
    force, impulse, rise = (_value(figure, corners, others) for figure in _FIGURES)
    table = table_of(corners)
    return MeasuredPulse(recording, signal, table, force, impulse, rise, wanted, in_scene)


def table_of(pulse: Signal | Corners) -> PulseTable:
    """Return all samples of a pulse, or its corners, as a pulse table."""
    return PulseTable(tuple(pulse.time.tolist()), tuple(pulse.force.tolist()))


def _reduced(signal: Signal, bend: float) -> tuple[Corners, Crest | None]:
    """Return few corners of a pulse, the largest of its crest where that was found."""
    corners = reduce(signal.time, signal.force, bend, signal.noise)
    finest = min(bend, _BEND * RTOL * float(signal.force.max()))
    crest = crest_of(signal.time, signal.force, corners, finest, signal.noise)
    return with_crest(corners, crest), crest


def _with_other_noise(
    recording: Recording, signal: Signal, corners: Corners, crest: Crest | None, bend: float
) -> list[Corners]:
    """Return the pulses found in copies of this recording with other noise.

    Baseline, start, end and corners are found again in each. Copies of long recordings have fewer
    samples, which are means.
    """
    if signal.noise.deviation == 0:
        return [corners]
    generator = np.random.default_rng(_SEED)
    total = recording.time.size
    many = max(1, min(total // _SAMPLES, signal.time.size // _SAMPLES_OF_PULSE))
    time = binned(recording.time, many)
    clock = time - signal.start
    pulse = np.interp(clock, corners.time, corners.force, 0.0, 0.0)
    if crest is not None:
        pulse = crest.smooth(clock, pulse)
    found, problems = [], []
    for _ in range(_REPEATS):
        other = binned(signal.noise.again(1, total, generator)[0], many)
        noisy = replace(recording, time=time, force=pulse + signal.baseline + other)
        try:
            again = pulse_of(noisy, signal.given)
        except HertzchainError as problem:  # by chance no pulse stands out of the noise
            problems.append(problem)
            continue
        found.append(_reduced(again, bend * float(again.force.max()))[0])
    if len(found) < _REPEATS / 2:
        raise HertzchainError(
            f"noise of {signal.noise.deviation:.2g} N hides where the pulse of"
            f" {signal.force.max():.3g} N is; with other noise of this kind {problems[0]}"
        )
    return found


def _value(
    figure: Callable[[FloatArray, FloatArray], float], corners: Corners, others: Sequence[Corners]
) -> Value:
    """Return a number of a pulse, and its deviation from those of pulses with other noise."""
    value = float(figure(corners.time, corners.force))
    of_others = [figure(other.time, other.force) for other in others]
    return Value(value, float(_deviation(of_others, value)))


def _deviation(others: Any, value: Any) -> Any:
    """Return the root mean square of the differences from a value, with the value's shape."""
    return np.sqrt(np.mean((np.asarray(others) - value) ** 2, axis=0))


def _rise_time(time: FloatArray, force: FloatArray) -> float:
    """Return the time in which a force first grows from 10 % to 90 % of its largest value [s]."""
    limits = np.array([0.1, 0.9]) * force.max()
    begin, end = np.interp(limits, np.maximum.accumulate(force), time)
    return float(end - begin)


def _largest(_: FloatArray, force: FloatArray) -> float:
    return float(force.max())


_FIGURES = (_largest, impulse_of, _rise_time)  # of a pulse, in the order of the fields


def _in_scene(
    scene: Scene, signal: Signal, corners: Corners, others: Sequence[Corners], wanted: float
) -> InScene:
    """Return peaks in a scene, their deviations under other noise, and their change by few rows."""
    tables = [table_of(corners), table_of(signal), *map(table_of, others)]
    scenes = [replace(scene, shock=table) for table in tables]
    peaks, truth, *noisy = _peaks(scenes, _RUNS * wanted)
    ratio, _, *ratios = (one.momentum_ratio for one in scenes)
    found = Value(ratio, float(_deviation(ratios, ratio)))
    change = largest_difference(peaks, truth)
    return InScene(scenes[0], found, peaks, _deviation(noisy, peaks), change)


def _peaks(scenes: Sequence[Scene], rtol: float) -> FloatArray:
    """Return peak forces [N], shape (scenes, contacts), of runs with a sufficient accuracy."""
    return peak_forces(scenes, float(np.clip(rtol, 1e-8, 1e-3))).peak_force
