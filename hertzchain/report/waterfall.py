"""Times at which the wave is recorded to be drawn, and the contacts that are drawn of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.report.motion import recorded
from hertzchain.report.trajectory import frame_times
from hertzchain.scene.natural_units import force_scale
from hertzchain.scene.scene import Scene

_TIMES = 500  # recorded times of a history
READINGS = 4_000_000  # times and granules recorded at once: 100 MB for each simulation

_EVEN, _DENSE, _BURST = 0.4, 0.25, 0.5
"""Intervals between recorded times [units of time of a contact]: the longest even one; the one
where the wave forms in a long chain; the one in later bursts.
"""

# recorded times of a burst; the wave passes a contact in six units of time, of these ten
_OF_A_BURST = 20
_OWN, AROUND = 2.5, 8.0  # contacts' units of time around a peak: recorded closely at least; drawn
_FINE = 0.2  # wave's units of time between recorded times of a run: half of what is close
_CLOSE = 0.4  # and at most, for a map that shows 95 % of each peak: measured on the demo scene
CURVES = 20  # most contacts whose forces are drawn one above the other


def record_times(scene: Scene) -> FloatArray:
    """Return increasing times at which to record a scene for a plot of its wave [s].

    They are even if about 500 follow the wave all the way. Otherwise they are close while the wave
    forms, and then in bursts, geometrically apart, in each of which it passes a few contacts.
    """
    count = int(np.clip(READINGS // scene.chain.granules, 2, _TIMES))
    unit = wave_time(scene)
    end = scene.end_time
    if end <= _EVEN * unit * (count - 1):
        return np.linspace(0.0, end, count)
    dense = _DENSE * unit * np.arange(count * 5 // 8)
    burst = _BURST * unit * np.arange(_OF_A_BURST)
    bursts = (count - dense.size) // _OF_A_BURST
    starts = np.geomspace(dense[-1] + burst[-1], end - burst[-1], bursts)
    times = np.concatenate([dense, (starts[:, None] + burst).ravel()])
    return np.unique(times[times <= end])


def plot_times(scene: Scene) -> FloatArray:
    """Equally spaced times at which to record a run so that its wave can be drawn [s]."""
    wanted = int(np.ceil(scene.end_time / (_FINE * wave_time(scene)))) + 1
    return frame_times(scene, int(np.clip(wanted, 2, max(2, READINGS // scene.chain.granules))))


def coarse_times(result: Result) -> str | None:
    """A sentence where recorded times are too far apart to draw the wave, else None."""
    time = recorded(result).time
    unit = wave_time(result.scene)
    step = float(np.max(np.diff(time)))
    if step <= _CLOSE * unit:
        return None
    enough = int(np.ceil(result.scene.end_time / (_CLOSE * unit))) + 1
    return (
        f"recorded times are {step:.2g} s apart, which cuts the tops of the wave off: --record"
        f" {enough} shows it"
    )


def wave_time(scene: Scene) -> float:
    """The unit of time of the contacts of a scene [s]: it goes as their force to the power -1/6."""
    return float(scene.units.time * force_scale(scene.momentum_ratio) ** (-1 / 6))


def _followed(result: Result) -> NDArray[np.int_]:
    """Return contacts whose peak lies well within closely recorded times."""
    assert result.history is not None
    time = result.history.time
    of_segment = np.concatenate([[0], np.cumsum(gaps(time))])
    contact = result.contact[np.isfinite(result.peak_time)]
    peak_time = result.peak_time[contact - 2]
    before = np.clip(np.searchsorted(time, peak_time, "right") - 1, 0, time.size - 2)
    same = of_segment[before] == of_segment[before + 1]
    first = np.searchsorted(of_segment, of_segment[before], "left")
    last = np.searchsorted(of_segment, of_segment[before], "right") - 1
    from_start = np.where(time[first] > 0, peak_time - time[first], np.inf)
    to_end = np.where(last < time.size - 1, time[last] - peak_time, np.inf)
    close = np.minimum(from_start, to_end) > _OWN * wave_time(result.scene)
    return np.asarray(contact[same & close])


def gaps(time: FloatArray) -> NDArray[np.bool_]:
    """Return the places where recorded times are too far apart to connect them."""
    steps = np.diff(time)
    return np.asarray(steps > 3 * np.min(steps))


def drawn_contacts(result: Result, most: int = CURVES) -> list[int]:
    """Paper's numbers of the drawn contacts, which are closer together near the shock."""
    if result.history is None or result.history.time.size < 2:
        return []
    followed = _followed(result)
    if followed.size <= most:
        return [int(contact) for contact in followed]
    wanted = np.geomspace(followed[0], followed[-1], most)
    nearest = np.argmin(np.abs(np.log(followed[:, None] / wanted)), axis=0)
    return [int(contact) for contact in np.unique(followed[nearest])]


def why_no_waterfall(native: Result) -> str:
    """Return why forces over time cannot be drawn one above the other, without a full stop."""
    if native.history is None:
        return (
            "no motion was recorded; hertzchain compare SCENE --report records what it runs itself"
        )
    return "no contact has its peak within closely recorded times"


def shock_times(scene: Scene) -> FloatArray:
    """Times at which the applied force is drawn [s]: corners, times between them, end."""
    corners = [ramp.start for ramp in scene.ramps] + [scene.ramps[-1].end]
    even = np.linspace(corners[0], corners[-1], 200)
    if len(corners) > even.size:  # a table may have thousands of rows
        corners = [corners[0], corners[-1]]
    time = np.unique(np.concatenate([[0.0, scene.end_time], even, corners]))
    return time[time <= scene.end_time]


def with_peak(result: Result, contact: int) -> tuple[FloatArray, FloatArray]:
    """Times [s] and contact forces [N] of a contact, with its peak if it lies between them."""
    assert result.history is not None
    time, force = result.history.time, result.force_at(contact)
    peak_time = result.peak_time[contact - 2]
    if not time[0] < peak_time < time[-1] or peak_time in time:
        return time, force
    at = int(np.searchsorted(time, peak_time))
    return np.insert(time, at, peak_time), np.insert(force, at, result.peak_at(contact))
