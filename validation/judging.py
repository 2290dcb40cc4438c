"""Judges runs of a scene: right within their error bounds, refused with a reason, or wrong.

Plain chains can be judged by tests/oracles/eighth_order.py, those with terms by
tests/oracles/extrapolation.py, both by a native run to an accuracy.
"""

from __future__ import annotations

import functools
import json
import math
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import run_in
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import (
    HertzchainError,
    OverlapTooLarge,
    SceneError,
    StepUnstable,
    TooExpensive,
    Unpredictable,
)
from hertzchain.observables.peaks import largest_difference
from tests.oracles import eighth_order, extrapolation

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
            solver = eighth_order if self.scene.is_plain else extrapolation
            truth = solver.solve(self.scene)
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
