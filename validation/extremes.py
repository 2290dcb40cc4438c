"""Test that every scene gets a right answer or is refused with a reason.

Scenes are drawn at random over ranges that reach far beyond what is physical (see RANGES), and run
with both backends; every method is run with steps from a thousandth of the stable one to three
times that, and batches. Each run must be right (its peaks differ from those of a converged run by
no more than both error bounds) or refused, with a reason from a closed list (REASONS). Error bounds
are also compared with other solvers, on scenes of moderate length that are drawn to be difficult
(validation/random_scenes.py): end times anywhere, pulse tables, maxima that
change places, terms, dampers, pistons and sines, steps of one's own.
"""

from __future__ import annotations

import functools
import json
import math
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress

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
from hertzchain.scene.shocks import PROFILES, profile_named
from tests.oracles import extrapolation
from validation.random_scenes import KINDS, random_hard_scene
from validation.script import Row, Script, new_figure, row
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

JUDGE_LIMIT = 300.0
"""Time limit of the converged run that judges the others [s]."""

ORACLE_ERROR = 1e-13
"""Error of these solvers that the difference of two of their runs may not show."""


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
    """Runs a scene in several ways and judges each run.

    ``rtol`` is the accuracy of the converged run; None for another solver. LAMMPS runs in the
    process ``child``.
    """

    def __init__(self, number: int, scene: hc.Scene, child: Child, rtol: float | None) -> None:
        if not scene.is_plain:  # the other solver ends there, an engine may end before
            scene = replace(scene, run=hc.Run(scene.end_time))
        self.scene, self.child, self.rtol = scene, child, rtol
        pulse = scene.shock if isinstance(scene.shock, hc.Pulse) else None
        self.facts: dict[str, Any] = {
            "scene": number,
            "profile": "table" if pulse is None else pulse.profile,
            "momentum_ratio": math.nan if scene.piston else scene.momentum_ratio,
            "duration_ratio": math.nan if pulse is None else pulse.duration_ratio,
            "granules": scene.chain.granules,
            "overlap_ratio": scene.units.length / float(scene.granules.radius[0]),
        }

    @functools.cached_property
    def converged(self) -> tuple[FloatArray, float]:
        """Return much more accurate peaks [N], and their own error."""
        if self.rtol is None:
            truth = extrapolation.solve(self.scene)
            return truth.force, truth.error + ORACLE_ERROR
        backend = hc.Native(rtol=self.rtol, peaks_only=True, time_limit=JUDGE_LIMIT)
        result = backend.run(self.scene)
        return result.peak_force, result.error_estimate

    def native(self, name: str, backend: hc.Native, step: float = math.nan) -> Outcome:
        """Run the native backend and compare with the converged run."""
        return self._judge(name, lambda: backend.run(self.scene), step)

    def lammps(self, backend: hc.Lammps, step: float = math.nan, name: str = "lammps") -> Outcome:
        """Run LAMMPS, in its own process, and compare with the converged run."""
        return self._judge(name, lambda: run_in(self.child, backend, self.scene), step)

    def batch(self, rtol: float, name: str = "") -> Outcome:
        """Run a batch, and compare."""
        batch = hc.peak_forces([self.scene], rtol)
        peaks, stated = batch.peak_force[0], float(batch.error_estimate[0])
        outcome = functools.partial(Outcome, **self.facts, run=name or f"batch {rtol:g}")
        return self._compared(functools.partial(outcome, step=math.nan), peaks, stated)

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


RANGES = {
    "young_modulus": (1e3, 1e13),
    "radius": (1e-9, 1e2),
    "density": (1.0, 1e5),
    "peak_force": (1e-15, 1e15),
    "momentum_ratio": (1e-4, 1e4),
    "duration_ratio": (1e-3, 1e4),  # of n - 1
    "granules": (2, 1e5),
}
"""Ranges drawn with equal chance in each decade [Pa, m, kg/m^3, N, -, -, -]."""

NATIVE_LIMIT, LAMMPS_LIMIT = 0.5, 3.0
"""Time limit of a run here [s]; the default elsewhere is an hour."""

LAMMPS_BOUNDS_LIMIT = 60.0
"""Time limit of LAMMPS on scenes that are hard on bounds [s]."""

LAMMPS_SHARE = 10
"""Interval of scenes that are run with LAMMPS, too."""

SCENES, ANSWERED = 10_000, 5_000
"""Least number of scenes, and of those answered by the native backend."""

BOUNDS = 5_000
"""Plain scenes of each kind on which error bounds are compared with another solver."""

WITH_TERMS = {"elastic terms": False, "damped terms": True}
"""Kinds of scenes with terms, and whether contacts are damped."""

HARD = 10_000
"""Scenes of each of these kinds."""

HARD_GRANULES, HARD_TIME = 30, 200.0
"""Most granules and natural time units of the fastest contact (chosen): a second each."""

CHUNK = 25
"""Scenes that a thread takes at a time; those with LAMMPS share a process of its own."""

STEPS = (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95, 1.05, 1.5, 3.0)
"""Steps as fractions of the longest stable step."""


def random_scene(rng: np.random.Generator) -> hc.Scene:
    """A scene from RANGES."""
    drawn = {name: float(10 ** rng.uniform(*np.log10(ends))) for name, ends in RANGES.items()}
    granules, poisson_ratio = round(drawn.pop("granules")), float(rng.uniform(-0.99, 0.5))
    shock: dict[str, Any] = {name: drawn.pop(name) for name in ("peak_force", "momentum_ratio")}
    n = 1 + drawn.pop("duration_ratio")
    chain = hc.Chain(granules, poisson_ratio=poisson_ratio, **drawn)
    profile = profile_named(str(rng.choice(list(PROFILES))))
    return hc.Scene(chain, hc.Pulse(profile, duration_ratio=n, **shock))


def random_outcomes(first: int, with_lammps: bool) -> list[Outcome]:
    """The runs of CHUNK random scenes."""
    outcomes = []
    with Child() as child:
        for number in range(first, first + CHUNK):
            try:
                scene = random_scene(np.random.default_rng([4, number]))
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
    n, ratio = 1 + 10 ** rng.uniform(-1, 2), 10 ** rng.uniform(-2, 1)
    profile = profile_named(str(rng.choice(list(PROFILES))))
    pulse = hc.Pulse(profile, 100.0, n, momentum_ratio=ratio)
    scene = hc.Scene(hc.Chain(round(10 ** rng.uniform(0.3, 1.8)), **STEEL), pulse)
    outcomes = []
    with Child() as child:
        judge = Judge(number, scene, child, rtol=1e-10)
        for name, method in METHODS.items():
            for step in STEPS:
                dt = step * stable_step(scene, method.interval)
                native = hc.Native(name, dt, peaks_only=True, time_limit=NATIVE_LIMIT)
                outcomes.append(judge.native(name, native, step))
        if with_lammps:
            for step in STEPS:
                dt = step * stable_step(scene, METHODS["velocity-verlet"].interval)
                outcomes.append(judge.lammps(hc.Lammps(dt, time_limit=LAMMPS_LIMIT), step))
        outcomes += [judge.batch(rtol) for rtol in (1e-2, 1e-3, 1e-4)]
    return outcomes


def _judges(
    seed: tuple[int, ...],
    first: int,
    draw: Callable[[np.random.Generator, int], hc.Scene],
    child: Child,
) -> Iterator[tuple[int, np.random.Generator, Judge]]:
    """CHUNK scenes that another solver has judged: number, generator and judge of each.

    Scenes that are refused are left out, and those in which granules collide again and again, as no
    solver can judge these.
    """
    for number in range(first, first + CHUNK):
        rng = np.random.default_rng([*seed, number])
        try:
            scene = draw(rng, number)
        except SceneError:
            continue
        judge = Judge(number, scene, child, rtol=None)
        try:
            judge.converged  # noqa: B018 - works it out
        except ArithmeticError:
            continue
        yield number, rng, judge


def bound_outcomes(kind: str, first: int, with_lammps: bool) -> list[Outcome]:
    """The runs of CHUNK scenes of a kind, judged by the other solver."""
    outcomes = []

    def draw(rng: np.random.Generator, number: int) -> hc.Scene:
        for_lammps = with_lammps and number % LAMMPS_SHARE == 0
        return KINDS[kind](rng, 40 if for_lammps else 200)

    with Child() as child:
        for number, rng, judge in _judges((6, list(KINDS).index(kind)), first, draw, child):
            for_lammps = with_lammps and number % LAMMPS_SHARE == 0
            rtol = float(10 ** rng.uniform(-10, -2))
            native = hc.Native(rtol=rtol, peaks_only=bool(number % 2), time_limit=JUDGE_LIMIT)
            outcomes.append(judge.native(f"{kind}: native", native))
            if outcomes[-1].outcome != RIGHT:
                continue  # refused: so it is in other ways
            if number % 3 == 0:
                outcomes.append(judge.batch(rtol, f"{kind}: batch"))
            if number % 5 == 0:
                outcomes.append(_with_own_step(judge, kind, rng))
            if for_lammps:
                for extrapolated in (False, True):
                    wanted = max(rtol, 1e-7 if extrapolated else 1e-6)
                    lammps = hc.Lammps(rtol=wanted, extrapolated=extrapolated)
                    name = f"{kind}: lammps{', extrapolated' if extrapolated else ''}"
                    outcomes.append(judge.lammps(lammps, name=name))
    return outcomes


def term_outcomes(kind: str, first: int, with_lammps: bool) -> list[Outcome]:
    """The runs of CHUNK scenes with terms of a kind, judged by the other solver for those."""
    outcomes, is_damped = [], WITH_TERMS[kind]

    def draw(rng: np.random.Generator, _: int) -> hc.Scene:
        return random_hard_scene(rng, HARD_GRANULES, HARD_TIME, is_damped)

    with Child() as child:
        for number, rng, judge in _judges((7, is_damped), first, draw, child):
            rtol = float(10 ** rng.uniform(-10, -2))
            native = hc.Native(rtol=rtol, peaks_only=bool(number % 2), time_limit=JUDGE_LIMIT)
            outcomes += [judge.native(f"{kind}: native", native), _with_own_step(judge, kind, rng)]
            if with_lammps and number % LAMMPS_SHARE == 0:
                outcomes.append(judge.lammps(_any_lammps(rng, judge.scene), name=f"{kind}: lammps"))
    return outcomes


def _any_lammps(rng: np.random.Generator, scene: hc.Scene) -> hc.Lammps:
    """LAMMPS to an accuracy, extrapolated or not, or with steps and readings of one's own."""
    rtol = float(10 ** rng.uniform(-4, -2))
    if rng.random() < 0.6:
        extrapolated = bool(rng.random() < 0.3)
        return hc.Lammps(rtol=rtol, extrapolated=extrapolated, time_limit=LAMMPS_BOUNDS_LIMIT)
    dt = float(10 ** rng.uniform(-2, -0.3)) * stable_step(
        scene, METHODS["velocity-verlet"].interval
    )
    dt = max(dt, scene.end_time / 2e5)
    read_every = int(rng.choice([1, 2, 5, 20])) if rng.random() < 0.5 else None
    return hc.Lammps(dt, read_every=read_every, time_limit=LAMMPS_BOUNDS_LIMIT)


def _with_own_step(judge: Judge, kind: str, rng: np.random.Generator) -> Outcome:
    """A run of any method with any step, of at most 200,000 steps."""
    scene = judge.scene
    method = str(rng.choice(list(METHODS) if scene.contact is None else ["velocity-verlet"]))
    step = float(10 ** rng.uniform(-2, 0))
    dt = max(step * stable_step(scene, METHODS[method].interval), scene.end_time / 2e5)
    native = hc.Native(method, dt, time_limit=JUDGE_LIMIT)
    # Not in the plots of steps, which show every method on the same scenes.
    return judge.native(f"{kind}: own step", native)


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Run everything: one row per run, with the fields of Outcome."""
    records: list[Outcome] = []
    # Measured times exclude the loading and compiling of kernels.
    small = hc.Scene(hc.Chain(3, **STEEL), hc.Pulse("cosine", 1.0, 2.0, momentum_ratio=1.0))
    hc.Native().run(small)
    console = Console(stderr=True)
    with (
        ThreadPoolExecutor(usable_cores()) as pool,
        Progress(console=console, transient=True, disable=not console.is_terminal) as bar,
    ):

        def collect(label: str, task: Callable[[int], list[Outcome]], numbers: range) -> None:
            for outcomes in bar.track(pool.map(task, numbers), len(numbers), description=label):
                records.extend(outcomes)

        kinds = [(kind, bound_outcomes, BOUNDS) for kind in KINDS]
        kinds += [(kind, term_outcomes, HARD) for kind in WITH_TERMS]
        for kind, outcomes, number in kinds:
            task = functools.partial(outcomes, kind, with_lammps=with_lammps)
            collect(kind, task, range(0, CHUNK if quick else number, CHUNK))
        collect("steps", lambda k: step_outcomes(k, with_lammps), range(1 if quick else 20))
        drawn, wanted = 0, CHUNK if quick else SCENES
        while drawn < wanted or (not quick and _answered(records) < ANSWERED):
            block = range(drawn, max(wanted, drawn + CHUNK), CHUNK)
            collect("random scenes", lambda first: random_outcomes(first, with_lammps), block)
            drawn = block.stop
    return pandas.DataFrame([asdict(outcome) for outcome in records])


def _answered(outcomes: list[Outcome]) -> int:
    return sum(outcome.run == "native" and outcome.outcome == RIGHT for outcome in outcomes)


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
        if ": " in str(run):
            continue  # not timed: the first run of a process loads kernels
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


SCRIPT = Script(
    "Scenes at the extremes",
    "Is every scene that can be typed answered, with an error that holds, or refused?",
    "native, LAMMPS; native to 1e-9",
    measure, promises, draw,
)  # fmt: skip

if __name__ == "__main__":
    SCRIPT.main()
