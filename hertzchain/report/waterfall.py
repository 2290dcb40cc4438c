"""Times at which a wave is recorded for drawing, and the contacts that are drawn."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.observables.result import Result
from hertzchain.observables.samples import History
from hertzchain.scene.natural_units import force_scale
from hertzchain.scene.scene import Scene

MOST_READINGS = 4_000_000  # times and granules recorded at once: 100 MB for each simulation
_FRAME_TIME = 0.2  # in the wave's units of time: at 0.4 a map shows 95 % of each peak
_STILL_FORCE_RATIO, _MARGIN_SHARE = 0.01, 0.03
"""Change of a force over the largest that is too small to be visible; room before and after the
motion, over its duration (both chosen)."""


def recorded(result: Result) -> History:
    """Return the history of a run; a SceneError if nothing was recorded."""
    if result.history is None:
        raise SceneError("history", None, "there is none: run with record = the times to keep")
    return result.history


def frame_times(scene: Scene, count: int) -> FloatArray:
    """Return equally spaced times from 0 to the end of a run [s], shape (count,)."""
    return np.linspace(0.0, scene.end_time, count)


def plot_times(scene: Scene) -> FloatArray:
    """Equally spaced times at which to record a run so that its wave can be drawn [s]."""
    # A wave's time goes as its force to the power -1/6.
    wave_time = float(scene.units.time * force_scale(scene.momentum_ratio) ** (-1 / 6))
    wanted = int(np.ceil(scene.end_time / (_FRAME_TIME * wave_time))) + 1
    return frame_times(scene, max(2, min(wanted, MOST_READINGS // scene.chain.granules)))


def drawn_contacts(result: Result, most: int) -> list[int]:
    """Return numbers of contacts to draw, closer together near the shock."""
    time = recorded(result).time
    pressed = result.contact[(result.peak_time > time[0]) & (result.peak_time < time[-1])]
    if pressed.size <= most:  # the first contacts, if the wave has passed none
        return [int(contact) for contact in pressed] or [2]
    wanted = np.geomspace(pressed[0], pressed[-1], most)
    nearest = np.argmin(np.abs(np.log(pressed[:, None] / wanted)), axis=0)
    return [int(contact) for contact in np.unique(pressed[nearest])]


def with_peak(result: Result, contact: int) -> tuple[FloatArray, FloatArray]:
    """Times [s] and contact forces [N] of a contact, with its peak if it lies between them."""
    time, force = recorded(result).time, result.force_at(contact)
    peak_time = result.peak_time[result.scene.contacts.index(contact)]
    if not time[0] < peak_time < time[-1] or peak_time in time:
        return time, force
    at = int(np.searchsorted(time, peak_time))
    return np.insert(time, at, peak_time), np.insert(force, at, result.peak_at(contact))


def while_moving(time: FloatArray, off: FloatArray) -> tuple[float, float]:
    """Return start and end of changing forces [s], by their change at each time, with room."""
    at = np.flatnonzero(off > _STILL_FORCE_RATIO * np.max(off))
    if not at.size:
        return float(time[0]), float(time[-1])
    begin, end = time[max(at[0] - 1, 0)], time[min(at[-1] + 1, time.size - 1)]
    room = _MARGIN_SHARE * (end - begin)
    return float(max(begin - room, time[0])), float(min(end + room, time[-1]))
