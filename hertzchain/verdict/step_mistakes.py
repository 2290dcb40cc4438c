"""Mistakes by steps of velocity Verlet: too long, past corners; samples in place of maxima."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.methods import METHODS, Method
from hertzchain.engines.native.simulation import simulate
from hertzchain.errors import RunFailed, StepUnstable, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.history import Recorder
from hertzchain.scene.ramp import Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.verdict.case import Case, Mistake, fixed

_VERLET: Method = METHODS["velocity-verlet"]
_MOST_LEGS = 100_000  # most legs of one step (chosen): half a second

# usual steps, over a power of ten of seconds (chosen)
_ROUND = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.5, 8.0)
_SHORTEST = 0.01  # fraction of the longest step: shorter ones change the peaks by 1e-5 or less

_RTOL = 1e-6  # of runs that are sampled: samples are off by 1e-5 or more


def velocity_verlet(
    scene: Scene, legs: Sequence[Leg], deadline: Deadline
) -> tuple[FloatArray, FloatArray]:
    """Return peaks by velocity Verlet [N]: interpolated maxima, and the highest samples."""
    unit = scene.units
    run = simulate(scene, legs, _VERLET.walker, deadline=deadline)
    starts = np.concatenate([leg.start + leg.dt * np.arange(leg.steps) for leg in legs])
    nodes = np.append(starts, legs[-1].end) / unit.time
    # The highest sample is next to the peak: a second, equal run is sampled only there.
    after = np.searchsorted(nodes, run.peaks.time[np.isfinite(run.peaks.time)])
    near = np.clip(np.concatenate([after - 1, after, after + 1]), 0, nodes.size - 1)
    recorder = Recorder(np.unique(nodes[near]), scene.bodies, scene.wall is not None)
    simulate(scene, legs, _VERLET.walker, recorder, deadline=deadline)
    sampled = np.max(recorder.contact_force, axis=0, initial=0.0)
    return run.peaks.force * unit.force, sampled * unit.force


def _past_corners(scene: Scene, dt: float) -> list[Leg] | None:
    """Return equal steps that ignore the corners of the pulse; None for too many of them."""
    in_pulse = math.ceil(min(scene.ramps[-1].end, scene.end_time) / dt)
    if in_pulse > _MOST_LEGS:
        return None
    nodes = dt * np.arange(in_pulse + 1, dtype=np.float64)
    force = scene.applied_force(nodes)
    legs = [
        Leg(t0, t1, 1, Ramp(t0, t1, f0, f1, "linear"))
        for t0, t1, f0, f1 in zip(nodes, nodes[1:], force, force[1:], strict=False)
    ]
    if (after := math.ceil(scene.end_time / dt) - in_pulse) > 0:
        legs.append(Leg(float(nodes[-1]), float(nodes[-1] + after * dt), after, None))
    return legs


def steps_and_samples(case: Case) -> Iterator[Mistake]:
    """Yield samples in place of maxima, and steps across corners, at the step given.

    If none is given they are tried at usual steps, and samples of an accurate run, too.
    """
    if case.dt is not None:
        yield from _with_step(case, case.dt)
        return
    longest = stable_step(case.scene, _VERLET.interval)
    decades = range(math.floor(math.log10(_SHORTEST * longest)), math.ceil(math.log10(longest)))
    for decade, digits in itertools.product(decades, _ROUND):
        dt = float(f"{digits}e{decade}")
        if _SHORTEST * longest <= dt <= longest:
            with contextlib.suppress(StepUnstable):
                yield from _with_step(case, dt)
            text = f"samples in place of maxima, {dt:.3g} s apart, of an accurate run"
            yield fixed(text, _accurate_samples(case, dt))


def _accurate_samples(case: Case, apart: float) -> FloatArray:
    """Return the highest samples of the true contact forces [N], at multiples of an interval."""
    scene = case.scene
    before = np.floor(case.reference.peak_time[case.judged] / apart)  # the highest is next to it
    times = np.unique(np.minimum(apart * np.append(before, before + 1), scene.end_time))
    native = Native(rtol=_RTOL, time_limit=max(case.deadline.left, 1e-3))
    history = native.run(scene, record=times).history
    assert history is not None
    return np.asarray(history.contact_force.max(axis=0))


def _with_step(case: Case, dt: float) -> Iterator[Mistake]:
    """Yield the effects of one step."""
    scene, step = case.scene, f"velocity Verlet with steps of {dt:.3g} s"
    for legs, how in (
        (scene.schedule(dt), step),
        (_past_corners(scene, dt), f"{step}, past the corners of the pulse"),
    ):
        if legs is not None:
            interpolated, sampled = velocity_verlet(scene, legs, case.deadline)
            yield fixed(f"samples in place of maxima, {how}", sampled)
            yield fixed(f"what {how} has", interpolated)


def long_steps(case: Case) -> Iterator[Mistake]:
    """Yield velocity Verlet with too long steps, whose length is fitted."""
    scene = case.scene
    longest = 0.8 * stable_step(scene, _VERLET.interval)

    def made(dt: float) -> FloatArray:
        try:
            run = simulate(
                scene, scene.schedule(dt), _VERLET.walker,
                leave_behind=True, deadline=case.deadline,
            )  # fmt: skip
        except TooExpensive:
            raise
        except RunFailed:
            return np.full_like(case.given, np.nan)
        return np.asarray(run.peaks.force * scene.units.force)

    yield Mistake(
        lambda dt: f"what velocity Verlet with steps of about {dt:.3g} s has",
        made,
        (longest * np.geomspace(0.02, 1.0, 14)).tolist(),
    )
