"""Mistakes by steps of velocity Verlet: too long, past corners, or samples in place of maxima."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import METHODS, Native, simulate
from hertzchain.engines.native.named_methods import Method
from hertzchain.errors import RunFailed, StepUnstable, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.history import Recorder
from hertzchain.scene.ramp import Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.verdict.case import Case, Found, Mistake, fixed

_VERLET: Method = METHODS["velocity-verlet"]
_MOST_LEGS = 100_000  # most legs of one step (chosen): half a second

# usual steps, over a power of ten of seconds (chosen)
_ROUND = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.5, 8.0)
_SHORTEST = 0.01  # fraction of the longest step: shorter ones change the peaks by 1e-5 or less

# number of trial intervals, about 0.2 s; shorter ones change 1e-7 of the peaks
_MOST_TRIALS = 1_000_000
_AT_ONCE = 1000  # trial intervals that are computed at once, in the cache of the processor (chosen)
# least number of contacts; random numbers pass a million trial steps once in 1e5 cases
FEWEST_SAMPLED = 12


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
    recorder = Recorder(np.unique(nodes[near]), scene.chain.granules, scene.wall is not None)
    simulate(scene, legs, _VERLET.walker, recorder, deadline=deadline)
    sampled = np.max(recorder.contact_force, axis=0, initial=0.0)
    return run.peaks.force * unit.force, sampled * unit.force


def _past_corners(scene: Scene, dt: float) -> list[Leg] | None:
    """Return equal steps that ignore the corners of the pulse; None for too many of them."""
    in_pulse = math.ceil(min(scene.ramps[-1].end, scene.end_time) / dt) + 1
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


def known_step(case: Case) -> Iterator[Mistake]:
    """Yield effects of the given step: samples in place of maxima, steps across corners."""
    if case.dt is not None:
        yield from _with_step(case, case.dt)


def round_steps(case: Case) -> Iterator[Mistake]:
    """Yield the same effects for usual steps, if none is given."""
    if case.dt is not None:
        return
    longest = stable_step(case.scene, _VERLET.interval)
    decades = range(math.floor(math.log10(_SHORTEST * longest)), math.ceil(math.log10(longest)))
    for decade, digits in itertools.product(decades, _ROUND):
        dt = float(f"{digits}e{decade}")
        if _SHORTEST * longest <= dt <= longest:
            with contextlib.suppress(StepUnstable):
                yield from _with_step(case, dt)


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


def samples(case: Case) -> Iterator[Mistake]:
    """Yield peaks from the highest samples at equal intervals, whose length is fitted.

    Near its peak at t a contact force falls as the square of the time from t; the nearest sample is
    at the distance t - k h. So every h lowers the contacts in its own pattern.
    """
    lower = case.differences
    if np.mean(lower) >= 0 or lower.size < FEWEST_SAMPLED:
        return
    unit = case.scene.units.time
    time = case.reference.peak_time[case.judged] / unit
    bend = _shape(case, np.array([-0.02, 0.0, 0.02]), 2)[0]
    h = mean_interval(lower, bend)
    if not 1e-4 < h < 1.0:
        return
    shape = _shape(case, h * np.linspace(-0.7, 0.7, 5), 4)
    trials = np.arange(math.log(0.6 * h), math.log(1.7 * h), 0.1 * h / float(np.max(time)))
    if trials.size > _MOST_TRIALS:
        return

    powers = np.vstack([shape, np.zeros_like(lower)])  # the forces are relative to their peaks

    def left(logs: FloatArray) -> FloatArray:
        """Return the mean square that samples leave at intervals with these logarithms."""
        found = []
        for h in np.array_split(np.exp(logs)[:, np.newaxis], logs.size // _AT_ONCE + 1):
            away = h * np.round(time / h) - time
            found.append(np.mean((np.polyval(powers, away) - lower) ** 2, axis=1))
        return np.concatenate(found)

    def search(_: Case) -> Found:
        apart = trials[1] - trials[0]
        near = trials[np.argsort(left(trials))[:20], np.newaxis] + apart * np.linspace(-1, 1, 401)
        fine = left(near.ravel())
        best = int(np.argmin(fine))
        return Found(math.exp(near.ravel()[best]) * unit, math.sqrt(fine[best]))

    yield Mistake(
        lambda step: f"samples in place of maxima, {step:.6g} s apart, of an accurate run",
        search=search,
    )


def mean_interval(lower: FloatArray, bend: FloatArray) -> float:
    """Return the interval of samples that lower peaks by ``bend`` times the square of a distance.

    Distances are as often long as short, up to half of it: their mean square is h^2 / 12.
    """
    return math.sqrt(12 * max(float(np.mean(lower / bend)), 0.0))


def _shape(case: Case, offsets: FloatArray, degree: int) -> FloatArray:
    """Return relative contact forces around their peaks as polynomials of the time from the peak.

    They have the coefficients of the powers ``degree`` to 1, natural time units: shape (degree,
    judged contacts).
    """
    scene, unit = case.scene, case.scene.units.time
    peak_time = case.reference.peak_time[case.judged]
    wanted = peak_time + unit * offsets[:, np.newaxis]
    times, where = np.unique(np.clip(wanted, 0.0, scene.end_time), return_inverse=True)
    run = Native(rtol=1e-8, time_limit=max(case.deadline.left, 1e-3)).run(scene, record=times)
    assert run.history is not None
    contact = np.flatnonzero(case.judged)
    force = run.history.contact_force[where.reshape(wanted.shape), contact]
    relative = force / case.reference.peak_force[case.judged] - 1.0
    return np.asarray(np.polyfit(offsets, relative, degree)[:-1])
