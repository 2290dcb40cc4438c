"""The default end of runs in which waves are reflected: a run finds it while it goes on."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.errors import HertzchainError
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import refuse_strong_dampers
from hertzchain.observables.first_pulse import LATEST, finds_end, usual_end
from hertzchain.scene.scene import Scene

_END_RTOL, _MOST_WORK = 1e-6, 1e9
"""Accuracy of a run for the end alone, which has no bound of its error, and its largest work, in
force evaluations of a granule: half a minute on a fast machine, and the same end on any."""


def with_end(scene: Scene, record: ArrayLike | None = None, time_limit: float = math.inf) -> Scene:
    """Return a scene with the end of its run [s], the same for every engine.

    An end that is given stays. By default, scenes with a striker, a wall or unlike granules end at
    twice the time at which the first pulse of every contact is over, plus three natural time units;
    at latest at ``Scene.end_time`` where pulses are over by then. All other scenes end there.

    Parameters
    ----------
    scene
        What to simulate.
    record
        Times at which the motion is recorded [s], if any: the end is not before them, but at latest
        at ``Scene.end_time``.
    time_limit
        Time limit of the run that finds the end [s], without compiling; beyond it, or with too much
        work, the end is ``Scene.end_time``.
    """
    if not finds_end(scene):
        return scene
    end = _end_of(scene, time_limit)
    if record is not None and np.ndim(record) == 1:
        with suppress(TypeError, ValueError):  # no times: the engine refuses them in words
            last = float(np.max(np.asarray(record, np.float64), initial=0.0))
            end = max(end, min(last, scene.end_time))
    return scene.until(end)


def _end_of(scene: Scene, time_limit: float) -> float:
    """The end that one run finds."""
    from hertzchain.engines.native import damped_runs, plan
    from hertzchain.engines.native.simulation import Prepared, work_of
    from hertzchain.observables.preparation import Watched

    with Watched() as preparation:
        deadline = Deadline(time_limit, lambda: preparation.time)
        try:
            if scene.contact is not None:
                refuse_strong_dampers(scene)
                run = damped_runs.simulate_damped(
                    scene, _END_RTOL, deadline, most_work=_MOST_WORK, first=True
                )
            else:
                cheapest = plan.cheapest(_END_RTOL, checked=False)
                step = cheapest.step * scene.contact_time
                usual_legs = cheapest.walker.cut(scene.schedule(step))
                if work_of(scene, usual_legs, cheapest.walker.stepper.stages) > _MOST_WORK:
                    return scene.end_time
                run = Prepared.of(scene, deadline, first=True).simulate(
                    cheapest.walker.cut(scene.until(LATEST * scene.end_time).schedule(step)),
                    cheapest.walker,
                    usual=usual_end(scene),
                )
        except HertzchainError:  # the wanted run itself reports the reason
            return scene.end_time
    return run.end * scene.units.time
