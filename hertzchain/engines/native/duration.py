"""The default end of runs in which waves are reflected, from when the first pulses are over."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.errors import HertzchainError
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import refuse_strong_dampers
from hertzchain.observables.first_pulse import FirstPulses, reflects
from hertzchain.scene.scene import Scene

_PARTS = (4, 1)
"""Parts of the longest end after which first pulses may be over: one run each."""

_LONGER, _PARTING = 2.0, 3.0
"""Factor on the time at which the last first pulse is over, so that the run has a first reflection,
too; and natural time units after that, in which two spheres part."""

_ROUGHLY, _MOST_WORK = 1e-3, 1e9
"""Accuracy of these runs, which have no bound of their error, and their largest work, in force
evaluations of a granule: half a minute on a fast machine, and the same end on any."""


def with_end(scene: Scene, record: ArrayLike | None = None, time_limit: float = math.inf) -> Scene:
    """Return a scene with the end of its run [s], the same for every engine.

    An end that is given stays. By default, scenes with a striker, a wall or unlike granules end at
    twice the time at which the first pulse of every contact is over in quick runs, plus three
    natural time units; at latest at ``Scene.end_time``, where all other scenes end.

    Parameters
    ----------
    scene
        What to simulate.
    record
        Times at which the motion is recorded [s], if any: the end is not before them, but at latest
        at ``Scene.end_time``.
    time_limit
        Time limit of the quick runs [s], without compiling; beyond it, or with too much work, the
        end is ``Scene.end_time``.
    """
    if scene.run.end_time is not None or not reflects(scene):
        return scene
    until = 0.0
    if record is not None and np.ndim(record) == 1:
        with suppress(TypeError, ValueError):  # no times: the engine refuses them in words
            until = float(np.max(np.asarray(record, np.float64), initial=0.0))
    end = min(max(_end_of(scene, time_limit), until), scene.end_time)
    return replace(scene, run=replace(scene.run, end_time=end))


def _end_of(scene: Scene, time_limit: float) -> float:
    """The end from quick runs, each longer than the one before; the longest if pulses go on."""
    from hertzchain.engines.native.preparation import Watched

    longest = scene.end_time
    with Watched() as preparation:
        return _tried(scene, longest, Deadline(time_limit, lambda: preparation.time))


def _tried(scene: Scene, longest: float, deadline: Deadline) -> float:
    for part in _PARTS:
        tried = replace(scene, run=replace(scene.run, end_time=longest / part))
        try:
            first = _first_pulses(tried, deadline)
        except HertzchainError:  # the wanted run itself reports the reason
            return longest
        is_there = ~np.isnan(first.force)
        if not (first.is_ended[is_there].all() and (part == 1 or is_there.all())):
            continue
        if not is_there.any():
            return longest
        over = float(np.max((first.arrival + first.width)[is_there], initial=0.0))
        return _rounded_up(_LONGER * over + _PARTING) * scene.units.time
    return longest


def _first_pulses(scene: Scene, deadline: Deadline) -> FirstPulses:
    """First pulses of one run, natural units."""
    from hertzchain.engines.native import damped_runs, plan
    from hertzchain.engines.native.simulation import Prepared, work_of

    if scene.contact is not None:
        refuse_strong_dampers(scene)
        run = damped_runs.simulate_damped(
            scene, _ROUGHLY, deadline, most_work=_MOST_WORK, first=True
        )
        first = run.peaks.first
    else:
        cheapest = plan.cheapest(_ROUGHLY, checked=False)
        legs = cheapest.walker.cut(scene.schedule(cheapest.step * scene.contact_time))
        if work_of(scene, legs, cheapest.walker.stepper.stages) > _MOST_WORK:
            raise damped_runs.TooMuchWork("the quick run for the default end takes too much work")
        first = Prepared.of(scene, deadline, first=True).simulate(legs, cheapest.walker).peaks.first
    assert first is not None
    return first


def _rounded_up(time: float) -> float:
    """A time with two digits, so that rounding errors of quick runs do not show.

    In natural units: similar scenes have similar ends.
    """
    unit = 10.0 ** (math.floor(math.log10(time)) - 1)
    return float(f"{math.ceil(time / unit * (1 - 1e-12)) * unit:.2g}")
