"""A measured pulse as a pulse table with few rows, and the errors of its numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import require
from hertzchain.pulses.corners import corners_of, heights, impulse_of, largest_bow
from hertzchain.pulses.recording import Recording
from hertzchain.pulses.signal import Signal
from hertzchain.scene.pulse import PulseTable

MOST_ROWS = 80
"""Default of the most rows (chosen): codes begin a new step at each row, LAMMPS a new run."""

LEAST_ROWS = 3
_BEND = 1 / 3000
"""Bow of a line over F0 at which no further rows are added. Measured: peaks of 40 granules of
LM_ratio 0.1 to 10 under the three pulses changed by up to 2.9 bows, mostly by less than 1."""

_WIDER = 1.3  # ratio of bows that are tried until the rows suffice; chosen


@dataclass(frozen=True)
class Value:
    """A number with its standard deviation from noise and baseline."""

    value: float
    deviation: float


@dataclass(frozen=True, eq=False)
class MeasuredPulse:
    """A measured pulse with few rows.

    Parameters
    ----------
    recording, signal
        The recording, and the pulse found in it.
    table
        The pulse table; its impulse is that of the samples.
    bend
        Largest distance of the force from the lines of the table, apart from noise [N].
    """

    recording: Recording
    signal: Signal
    table: PulseTable
    bend: float

    @property
    def peak_force(self) -> Value:
        """F0 [N]: the highest row.

        Many lines of least squares of one length have the variance sqrt(3) density^2 / length at
        their corners, which follows from the inverse of their matrix, length / 6 (1, 4, 1). Lines
        about a parabola meet 2 / 3 of its bow above it; on average half of that, as bows are half
        of the largest allowed.
        """
        time, force = np.array(self.table.time), np.array(self.table.force)
        top = int(np.argmax(force))
        length = float(time[min(top + 1, time.size - 1)] - time[max(top - 1, 0)]) / 2
        of_corner = self.signal.noise.density * math.sqrt(math.sqrt(3) / length)
        bow = largest_bow(length, self.bend, self.signal.noise)
        return Value(float(force[top]), math.hypot(of_corner, bow / 3, self.signal.baseline_error))

    @property
    def impulse(self) -> Value:
        """The integral of the force [N s]."""
        duration = self.table.time[-1]
        noise = self.signal.noise.density * math.sqrt(duration)
        off = math.hypot(noise, self.signal.baseline_error * duration)
        return Value(impulse_of(np.array(self.table.time), np.array(self.table.force)), off)

    @property
    def rise_time(self) -> float:
        """The time in which the force first grows from 10 % to 90 % of F0 [s]."""
        force = np.maximum.accumulate(self.table.force)
        begin, end = np.interp(np.array([0.1, 0.9]) * force[-1], force, self.table.time)
        return float(end - begin)

    def to_text(self) -> str:
        """Return the table as CSV, with the header of pulse tables."""
        rows = zip(self.table.time, self.table.force, strict=True)
        return "time_s,force_N\n" + "".join(f"{time!r},{force!r}\n" for time, force in rows)

    def to_dict(self) -> dict[str, Any]:
        """Return everything except the samples, for JSON."""

        def both(value: Value) -> dict[str, float]:
            return {"value": value.value, "standard_deviation": value.deviation}

        signal = self.signal
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
            "bend_N": self.bend,
            "peak_force_N": both(self.peak_force),
            "impulse_N_s": both(self.impulse),
            "rise_time_s": self.rise_time or None,  # 0 where noise left no rise
        }


def measured_pulse(recording: Recording, signal: Signal, rows: int = MOST_ROWS) -> MeasuredPulse:
    """Reduce a measured pulse to at most so many rows; SceneError for fewer than 3."""
    require(rows >= LEAST_ROWS, "--rows", rows, f"must be at least {LEAST_ROWS}")
    bend = _BEND * float(signal.force.max())
    places = corners_of(signal.time, signal.force, bend, signal.noise)
    while places.size > rows:
        bend *= _WIDER
        places = corners_of(signal.time, signal.force, bend, signal.noise)
    return MeasuredPulse(recording, signal, _table(signal, places), bend)


def _table(signal: Signal, places: Any) -> PulseTable:
    force: FloatArray = heights(signal.time, signal.force, places)
    return PulseTable(tuple(signal.time[places].tolist()), tuple(force.tolist()))
