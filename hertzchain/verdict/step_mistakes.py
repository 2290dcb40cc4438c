"""Mistakes by steps that are too long, and by peaks that are samples at those steps."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import METHODS, simulate
from hertzchain.errors import RunFailed, StepUnstable, TooExpensive
from hertzchain.observables.error_bound import stable_step
from hertzchain.verdict.case import Case, Mistake, fixed
from hertzchain.verdict.twin import MOST_LEGS, steps_with_force, velocity_verlet

_ROUND = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.5, 8.0)
"""Usual steps, over a power of ten of seconds (chosen)."""

_SHORTEST = 0.01
"""Fraction of the longest step: shorter ones change the peaks by 1e-5 or less."""


def known_step(case: Case) -> Iterator[Mistake]:
    """Yield effects of the given step: samples in place of maxima, steps across corners."""
    if case.dt is not None:
        yield from _with_step(case, case.dt)


def round_steps(case: Case) -> Iterator[Mistake]:
    """Yield the same effects for usual steps, if none is given."""
    if case.dt is not None:
        return
    longest = stable_step(case.scene, METHODS["velocity-verlet"].interval)
    decades = range(math.floor(math.log10(_SHORTEST * longest)), math.ceil(math.log10(longest)))
    for decade, digits in itertools.product(decades, _ROUND):
        dt = float(f"{digits}e{decade}")
        if _SHORTEST * longest <= dt <= longest:
            with contextlib.suppress(StepUnstable):
                yield from _with_step(case, dt)


def _with_step(case: Case, dt: float) -> Iterator[Mistake]:
    """Yield the effects of one step."""
    scene = case.scene
    found = velocity_verlet(scene, scene.schedule(dt), case.deadline)
    step = f"velocity Verlet with steps of {dt:.3g} s"
    yield fixed(f"samples in place of maxima, {step}", found.sampled)
    yield fixed(f"what {step} has", found.interpolated)
    in_pulse = math.ceil(min(scene.ramps[-1].end, scene.end_time) / dt) + 1
    if in_pulse > MOST_LEGS:
        return
    nodes = np.asarray(dt * np.arange(in_pulse + 1), np.float64)
    after = max(0, math.ceil(scene.end_time / dt) - in_pulse)
    legs = steps_with_force(nodes, scene.applied_force(nodes), after)
    passing = velocity_verlet(scene, legs, case.deadline)
    step += ", past the corners of the pulse"
    yield fixed(f"what {step} has", passing.interpolated)
    yield fixed(f"samples in place of maxima, {step}", passing.sampled)


def long_steps(case: Case) -> Iterator[Mistake]:
    """Yield velocity Verlet with too long steps, whose length is fitted."""
    scene = case.scene
    longest = 0.8 * stable_step(scene, METHODS["velocity-verlet"].interval)

    def made(dt: float) -> FloatArray:
        try:
            run = simulate(
                scene, scene.schedule(dt), METHODS["velocity-verlet"].walker,
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
