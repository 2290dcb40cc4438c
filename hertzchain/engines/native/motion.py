"""The motion of a scene at given times by a single run, for many scenes with small differences."""

from __future__ import annotations

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.damped_runs import first_tolerance, simulate_damped
from hertzchain.limits import Deadline
from hertzchain.observables.history import History, Recorder
from hertzchain.scene.scene import Scene


def motion_at(scene: Scene, time: FloatArray, rtol: float, deadline: Deadline) -> History:
    """Return the motion at some times [s] within the scene's run.

    For damped scenes it is the first run that ``Native`` tries for ``rtol``, without the runs that
    bound the error, which are two thirds of the work. Nothing is refused.
    """
    if scene.contact is None:
        history: History | None = deadline.spend(
            lambda left: Native(rtol=rtol, time_limit=left, wanted="first").run(scene, time)
        ).history
        assert history is not None
        return history
    units = scene.units
    recorder = Recorder(time / units.time, scene.bodies, scene.wall is not None)
    simulate_damped(scene, first_tolerance(rtol), deadline, recorder)
    in_si = units.length, units.velocity, units.force
    return recorder.history(time, *in_si, scene.first_granule)
