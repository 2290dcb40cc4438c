"""Test that every scene gets a right answer or is refused with a reason.

Scenes are drawn at random over ranges that reach far beyond what is physical (RANGES of
``random_scenes``), and run with both backends; every method is run with steps from a thousandth of
the stable one to three times that, and batches. Each run must be right (its peaks differ from those
of a converged run by no more than both error bounds) or refused, with a reason from a closed list
(REASONS).
"""

from __future__ import annotations

import functools
import json
import math
import sys
import time
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import run_in
from hertzchain.engines.lammps.engine import Child
from hertzchain.engines.native.plan import METHODS
from hertzchain.errors import (
    HertzchainError,
    OverlapTooLarge,
    SceneError,
    StepUnstable,
    TooExpensive,
    Unpredictable,
)
from hertzchain.limits import usable_cores
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.peaks import largest_difference
from validation.random_scenes import extreme_scene, moderate_scene
from validation.script import Row, Script, new_figure, progress, row
from validation.shipped import STEEL

REASONS: dict[type[HertzchainError], str] = {
    OverlapTooLarge: "overlap too large",
    StepUnstable: "requested step unstable",
    TooExpensive: "cost above the limit",
    SceneError: "impossible value",
    Unpredictable: "no digit is sure",
}
"""Reasons for refusing a run."""

RIGHT = "right"

STEPS = (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95, 1.05, 1.5, 3.0)
"""Steps as fractions of the longest stable step."""

SCENES, STEP_SCENES = 13_300, 20
"""Scenes at the extremes, 5,000 of which native answers, and scenes that run with every step."""

LAMMPS_SHARE = 10
"""Interval of scenes that are run with LAMMPS, too."""

CHUNK = 25
"""Scenes that a thread takes at a time; those with LAMMPS share a process of its own."""

NATIVE_LIMIT, LAMMPS_LIMIT, JUDGE_LIMIT = 0.5, 3.0, 300.0
"""Time limits of a run, and of the converged run [s]; the default elsewhere is an hour."""


@dataclass(frozen=True)
class Outcome:
    """One run."""

    scene: int  # its number
    profile: str
    momentum_ratio: float
    duration_ratio: float
    granules: int
    overlap_ratio: float  # its scale under F0, over R
    run: str  # which backend or method
    step: float  # given step over the longest stable one; NaN where an accuracy was given
    outcome: str  # ``right``, a reason, or what went wrong
    stated: float = math.nan  # error estimate of the run; NaN where refused, as the next two
    measured: float = math.nan  # difference to the converged run
    bound: float = math.nan  # largest difference allowed: sum of both error estimates
    seconds: float = math.nan  # wall time


class Judge:
    """Runs a scene in several ways and compares each run with one to the accuracy ``rtol``.

    LAMMPS runs in the process ``child``.
    """

    def __init__(self, number: int, scene: hc.Scene, child: Child, rtol: float) -> None:
        self.scene, self.child, self.rtol = scene, child, rtol
        assert isinstance(scene.shock, hc.Pulse)
        self.facts: dict[str, Any] = {
            "scene": number,
            "profile": scene.shock.profile,
            "momentum_ratio": scene.momentum_ratio,
            "duration_ratio": scene.shock.duration_ratio,
            "granules": scene.chain.granules,
            "overlap_ratio": scene.units.length / float(scene.granules.radius[0]),
        }

    @functools.cached_property
    def converged(self) -> tuple[FloatArray, float]:
        """Return much more accurate peaks [N], and their own error."""
        backend = hc.Native(rtol=self.rtol, peaks_only=True, time_limit=JUDGE_LIMIT)
        result = backend.run(self.scene)
        return result.peak_force, result.error_estimate

    def native(self, name: str, backend: hc.Native, step: float = math.nan) -> Outcome:
        """Run the native backend and compare with the converged run."""
        return self._judge(name, lambda: backend.run(self.scene), step)

    def lammps(self, backend: hc.Lammps, step: float = math.nan) -> Outcome:
        """Run LAMMPS, in its own process, and compare with the converged run."""
        return self._judge("lammps", lambda: run_in(self.child, backend, self.scene), step)

    def batch(self, rtol: float) -> Outcome:
        """Run a batch, and compare."""
        batch = hc.peak_forces([self.scene], rtol)
        outcome = functools.partial(Outcome, **self.facts, run=f"batch {rtol:g}", step=math.nan)
        return self._compared(outcome, batch.peak_force[0], float(batch.error_estimate[0]))

    def _judge(self, name: str, run: Callable[[], hc.Result], step: float) -> Outcome:
        outcome = functools.partial(Outcome, **self.facts, run=name, step=step)
        begin = time.perf_counter()
        try:
            result = run()
        except HertzchainError as problem:
            seconds = time.perf_counter() - begin
            reason = REASONS.get(type(problem), f"{type(problem).__name__}: {problem}")
            return outcome(outcome=reason, seconds=seconds)
        except Exception:
            last = traceback.format_exc().strip().splitlines()[-1]
            return outcome(outcome=f"traceback: {last}")
        outcome = functools.partial(outcome, seconds=time.perf_counter() - begin)
        json.dumps(result.to_dict(), allow_nan=False)
        try:
            return self._compared(outcome, result.peak_force, result.error_estimate)
        except HertzchainError as problem:
            return outcome(outcome=f"not judged: {problem}")

    def _compared(
        self, outcome: functools.partial[Outcome], peaks: FloatArray, stated: float
    ) -> Outcome:
        expected, error = self.converged
        measured, bound = largest_difference(peaks, expected), stated + error
        right = bool(np.all(np.isfinite(peaks))) and measured <= bound
        said = RIGHT if right else "wrong"
        return outcome(outcome=said, stated=stated, measured=measured, bound=bound)


def random_outcomes(first: int, with_lammps: bool) -> list[Outcome]:
    """The runs of CHUNK random scenes."""
    outcomes = []
    with Child() as child:
        for number in range(first, first + CHUNK):
            try:
                scene = extreme_scene(np.random.default_rng([4, number]))
            except SceneError:
                nothing = (math.nan, math.nan, 0, math.nan)
                reason = REASONS[SceneError]
                outcomes.append(Outcome(number, "", *nothing, "native", math.nan, reason))
                continue
            judge = Judge(number, scene, child, rtol=1e-9)
            native = hc.Native(peaks_only=True, time_limit=NATIVE_LIMIT)
            outcomes.append(judge.native("native", native))
            if with_lammps and number % LAMMPS_SHARE == 0:
                outcomes.append(judge.lammps(hc.Lammps(rtol=1e-5, time_limit=LAMMPS_LIMIT)))
    return outcomes


def step_outcomes(number: int, with_lammps: bool) -> list[Outcome]:
    """Every method with every step, and batches, on one scene of moderate length."""
    rng = np.random.default_rng([5, number])
    scene = moderate_scene(rng)
    outcomes = []
    with Child() as child:
        judge = Judge(number, scene, child, rtol=1e-10)
        for name, method in METHODS.items():
            for step in STEPS:
                dt = step * stable_step(scene, method.interval)
                native = hc.Native(name, dt, peaks_only=True, time_limit=NATIVE_LIMIT)
                outcomes.append(judge.native(name, native, step))
        for step in STEPS if with_lammps else ():
            dt = step * stable_step(scene, METHODS["velocity-verlet"].interval)
            outcomes.append(judge.lammps(hc.Lammps(dt, time_limit=LAMMPS_LIMIT), step))
        outcomes += [judge.batch(rtol) for rtol in (1e-2, 1e-3, 1e-4)]
    return outcomes


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Return the table of all runs: columns are the fields of Outcome."""
    # Measured times exclude the loading and compiling of kernels.
    small = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 1.0, 2.0, momentum_ratio=1.0))
    hc.Native().run(small)
    first = range(0, CHUNK if quick else SCENES, CHUNK)
    with ThreadPoolExecutor(usable_cores()) as pool:
        tasks = [
            pool.submit(step_outcomes, k, with_lammps) for k in range(1 if quick else STEP_SCENES)
        ]
        tasks += [pool.submit(random_outcomes, number, with_lammps) for number in first]
        outcomes = [each for task in progress(tasks, "extremes") for each in task.result()]
    return pandas.DataFrame([asdict(outcome) for outcome in outcomes])


def promises(table: pandas.DataFrame) -> list[Row]:
    """Return the conditions on every run."""
    allowed = {RIGHT, *REASONS.values()}
    rows = []
    for run, group in table.groupby("run", sort=False):
        bad = group[~group["outcome"].isin(allowed)]
        for outcome in bad["outcome"].unique()[:3]:
            print(f"{run}: {outcome}", file=sys.stderr)
        reason = "each run is right within what it says of its error, or refused with a reason"
        rows.append(row(f"{run}: {len(group)} runs, neither", str(run), len(bad), 0, 0, reason))
        limit = LAMMPS_LIMIT if run == "lammps" else NATIVE_LIMIT
        slowest = float(group["seconds"].max())
        if not math.isnan(slowest):
            reason = "a run is stopped at its time limit; two seconds for the start of a process"
            rows.append(row(f"{run}: slowest [s]", str(run), slowest, 0, limit + 2, reason))
    return rows


COLOURS = ("tab:green", "tab:red", "tab:purple", "tab:orange", "black", "tab:blue")
"""Of RIGHT and REASONS."""


def draw(table: pandas.DataFrame) -> Figure:
    """Draw outcomes over the ranges, errors against what was stated, and errors over the step."""
    figure = new_figure(12, 9)
    (over_ratio, over_overlap), (errors, over_step) = figure.subplots(2, 2)
    random = table[table["step"].isna() & table["run"].isin(["native", "lammps"])]
    for axes, column, label in (
        (over_ratio, "momentum_ratio", "LM_ratio"),
        (over_overlap, "overlap_ratio", "overlap under F0 / R"),
    ):
        for outcome, colour in zip((RIGHT, *REASONS.values()), COLOURS, strict=True):
            frame = random[random["outcome"] == outcome]
            some, circled = (frame[frame["run"] == run] for run in ("native", "lammps"))
            axes.loglog(some[column], some["granules"], ".", ms=2, color=colour, label=outcome)
            axes.loglog(circled[column], circled["granules"], "o", ms=4, mfc="none", color=colour)
        axes.set(xlabel=label, ylabel="N", title="Native (dots), LAMMPS (circles)")
    for run, group in random[random["outcome"] == RIGHT].groupby("run", sort=False):
        seen = group["measured"].clip(lower=1e-16)  # none is smaller than round-off
        errors.loglog(group["bound"], seen, ".", ms=3, label=str(run))
    errors.plot([1e-8, 1], [1e-8, 1], "k-", lw=0.8)
    errors.set(xlabel="stated error", ylabel="error", title="Random scenes")
    for run, group in table[table["step"].notna()].groupby("run", sort=False):
        answered = group[group["outcome"] == RIGHT].groupby("step")
        (line,) = over_step.loglog(answered["measured"].max(), "o-", ms=3, label=str(run))
        over_step.loglog(answered["stated"].max(), "--", lw=0.8, color=line.get_color())
    over_step.axvline(1.0, color="k", lw=0.8)
    over_step.set(
        xlabel="step / longest stable step", ylabel="largest error; dashed: stated",
        title="Every method; refused right of the line",
    )  # fmt: skip
    for axes in figure.axes:
        axes.legend(fontsize="small")
    return figure


SCRIPTS = {
    "extremes": Script(
        "Scenes at the extremes",
        "Is every scene that can be typed answered, with an error that holds, or refused?",
        measure, promises, draw, suffix=".png",
    )
}  # fmt: skip
