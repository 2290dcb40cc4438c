"""What a LAMMPS deck has to find, and how well it can: measured by the native backend.

``lammps`` must not know ``native``; here the one is asked and the other told.
"""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.history import Recorder
from hertzchain.lammps.standalone import KnownAnswer
from hertzchain.native import METHODS, Native, simulate
from hertzchain.peaks import largest_difference
from hertzchain.scene import Scene

_READINGS = 2_000_000
"""Times and granules recorded at once: 50 MB."""


def known_answer(scene: Scene, step: float, watch_every: int) -> KnownAnswer:
    """The true peaks of a scene, and what a step and an interval cost them.

    Parameters
    ----------
    scene
        What to simulate.
    step
        The largest step, natural time units.
    watch_every
        Steps between two looks, at least 1.

    Raises
    ------
    HertzchainError
        If the scene cannot be simulated, or no digit of its peaks is sure.
    """
    truth = Native("reference", peaks_only=True).run(scene)
    peaks, least = looked_at(scene, step, watch_every)
    ratio = truth.peak_force / scene.units.force
    error = max(largest_difference(peaks, ratio), largest_difference(least, ratio))
    return KnownAnswer(ratio, error + truth.error_estimate)


def looked_at(scene: Scene, step: float, watch_every: int) -> tuple[FloatArray, FloatArray]:
    """Peaks of velocity Verlet over F0, and the least that looks now and then can find of them.

    The least is found where the peak lies in the middle between two looks.

    Parameters
    ----------
    scene, step, watch_every
        As for ``known_answer``.

    Returns
    -------
    The largest contact force and the smaller of those half an interval before and after it, shape
    (contacts,) each.
    """
    unit, granules = scene.units.time, scene.chain.granules
    legs = scene.schedule(step * unit)
    walker = METHODS["velocity-verlet"].walker
    peaks = simulate(scene, legs, walker, leave_behind=True).peaks
    least = np.array(peaks.force)
    pressed = np.nonzero(np.isfinite(peaks.time))[0]
    half = watch_every * max(leg.dt for leg in legs) / unit / 2
    end = scene.end_time / unit
    looks = np.concatenate([peaks.time[pressed] - half, peaks.time[pressed] + half])
    contacts = np.concatenate([pressed, pressed])
    order = np.argsort(looks)
    for some in np.array_split(order, -(-order.size * granules // _READINGS) or 1):
        recorder = Recorder(np.clip(looks[some], 0.0, end), granules)
        simulate(scene, legs, walker, recorder)
        found = recorder.contact_force[np.arange(some.size), contacts[some]]
        np.minimum.at(least, contacts[some], found)
    return peaks.force, least
