"""Measure the safety factors of error bounds on random scenes, kind of run by kind.

A bound is a safety factor times an estimate, the largest weighted difference from other runs, plus
what no difference shows. For each row of ``error_bound.SAFETIES`` this script measures the largest
ratio to the estimate of what is left of an error: of forces (peaks, or first pulses where they are
wanted) and of times (arrivals and widths). The truth is a native run to 1e-10. A row fails where
the ratio is larger than its factor. Scenes are drawn to be hard on bounds (``random_scenes``).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native.as_written import judging_peaks
from hertzchain.engines.native.backend import with_end
from hertzchain.engines.native.plan import METHODS
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import (
    REST_OF_TIMES,
    SAFETIES,
    ContactErrors,
    Safety,
    stable_step,
)
from hertzchain.observables.peaks import judged_contacts
from validation.random_scenes import KINDS, random_hard_scene
from validation.script import Row, Script, progress, row

SCENES = 100
"""Scenes of each group: plain, elastic with terms, damped."""

GRANULES, TIME = 16, 120.0
"""Most granules and natural time units of the fastest contact (chosen): a second for all runs."""

LAMMPS_SHARE = 5
"""Interval of scenes that are run with LAMMPS, too."""

LIMIT = 20.0
"""Time limit of a run [s]."""

ACCURACIES = (1e-3, 1e-5, 1e-7)
TRUE = 1e-10
"""Relative accuracies of the runs that are judged, and of the truth."""

TINY = 1e-100
"""Error that counts as none."""

Call = tuple[Safety, ContactErrors, float]
"""Safety, bounds, and their part that no difference shows."""

Backend = hc.Native | hc.Lammps


@contextmanager
def recorded_bounds() -> Iterator[list[Call]]:
    """Keep the bounds that runs within this block compute, as they do."""
    calls, original = list[Call](), Safety.bounds

    def bounds(
        self: Safety, differences: Any, weights: Any = (), rest: float = 0.0, least: float = 0.0
    ) -> ContactErrors:
        errors = original(self, differences, weights, rest, least)
        calls.append((self, errors, rest))
        return errors

    with patch.object(Safety, "bounds", bounds):
        yield calls


def scenes(count: int) -> Iterator[tuple[int, np.random.Generator, hc.Scene]]:
    """Scenes of all groups whose end is known, with their numbers and generators."""
    for number in range(3 * count):
        rng = np.random.default_rng([8, number])
        with suppress(hc.HertzchainError):
            if number % 3 == 0:
                scene = list(KINDS.values())[number // 3 % len(KINDS)](rng, 40)
            else:
                scene = random_hard_scene(rng, GRANULES, TIME, is_damped=number % 3 == 2)
            yield number, rng, with_end(scene)


def backends(
    number: int, rng: np.random.Generator, scene: hc.Scene, with_lammps: bool
) -> Iterator[Backend]:
    """Backends that use every row of the table."""
    wanted = str(rng.choice(["first", "all"]))
    for rtol in ACCURACIES:
        yield hc.Native(rtol=rtol, wanted=wanted, time_limit=LIMIT)
    for name, method in METHODS.items() if scene.contact is None else ():
        step = 10 ** rng.uniform(-2, 0) * stable_step(scene, method.interval)
        dt = max(step, scene.end_time / 2e4)
        yield hc.Native(name, dt, wanted=wanted, time_limit=LIMIT)
    if with_lammps and number // 3 % LAMMPS_SHARE == 0:
        rtol = float(10 ** rng.uniform(-4, -2))
        for extrapolated in (False, True):
            backend = hc.Lammps(
                rtol=rtol, extrapolated=extrapolated, wanted=wanted, time_limit=LIMIT
            )
            yield backend
            dt = 10 ** rng.uniform(-2, -0.5) * stable_step(scene, 2.0)
            yield replace(backend, dt=max(dt, scene.end_time / 2e4))


def needed_factors(call: Call, result: hc.Result, truth: hc.Result) -> dict[str, float]:
    """Factors of forces and of times that the bounds of a result needed at least."""
    safety, errors, rest = call
    stated, of_truth, contacts = result.errors, truth.errors, result.peak_force.size
    assert stated is not None
    assert of_truth is not None
    errors = errors.of_contacts(contacts)
    dynamic = np.ones(contacts) if errors.dynamic is None else errors.dynamic

    def needed(off: FloatArray, name: str, share: Any, factor: float, unit: float = 1.0) -> float:
        """The factor of one number; ``off`` in the unit of the result, NaN where not judged."""
        of_times = REST_OF_TIMES if name in ("arrival", "width") else 1.0
        with np.errstate(all="ignore"):
            estimate = getattr(errors, name) - of_times * rest / share  # times the factor
            others = getattr(stated, name) / unit - estimate  # by readings, and by other maxima
            ratio = factor * ((off - getattr(of_truth, name)) / unit - others) / estimate
        some = np.isfinite(off) & np.isfinite(others)
        return float(np.nanmax(ratio[some], initial=0.0))

    with np.errstate(all="ignore"):
        off = np.abs(result.peak_force / truth.peak_force - 1)
    off = np.where(judged_contacts(truth.peak_force), off, np.nan)
    forces = needed(off, "peak", 1.0, safety.factor)
    first, true = result.first_pulses, truth.first_pulses
    if first is None or true is None or errors.first is None:
        return {"forces": forces}
    clear = first.is_clear & true.is_clear
    off = np.where(clear, np.abs(first.force / true.force - 1), np.nan)
    forces = max(forces, needed(off, "first", dynamic, safety.factor))
    # Errors are computed in natural time units.
    unit = result.scene.units.time if result.backend == "native" else result.scene.contact_time
    times = []
    for name, some in (("arrival", clear), ("width", clear & first.is_steady & true.is_steady)):
        off = np.where(some, np.abs(getattr(first, name) - getattr(true, name)), np.nan)
        times.append(needed(off, name, dynamic, safety.factor_of_times, unit))
    return {"forces": forces, "times": max(times)}


def judged_by_scipy(scene: hc.Scene, truth: hc.Result) -> float:
    """Return the factor that the peaks of ``judging_peaks`` needed."""
    assert truth.errors is not None
    with recorded_bounds() as calls:
        peaks = judging_peaks(scene, Deadline(LIMIT))[0] * scene.units.force
    safety, errors, _ = calls[-1]
    judged = judged_contacts(truth.peak_force)
    off = np.abs(peaks[judged] / truth.peak_force[judged] - 1) - truth.errors.largest
    return float(np.max(off, initial=0.0)) / max(errors.largest, TINY) * safety.factor


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Return one row per kind of run and quantity: runs, and the largest factor needed."""
    needed: dict[tuple[str, str, str], list[float]] = {}
    for number, rng, scene in progress(list(scenes(4 if quick else SCENES)), "scenes"):
        with suppress(hc.HertzchainError):
            truth = hc.Native(rtol=TRUE, wanted="first", time_limit=LIMIT).run(scene)
            if number // 3 % LAMMPS_SHARE == 0:
                with suppress(hc.HertzchainError):
                    ratio = judged_by_scipy(scene, truth)
                    needed.setdefault(("erratic", "forces", "SciPy"), []).append(ratio)
            for backend in backends(number, rng, scene, with_lammps):
                with suppress(hc.HertzchainError), recorded_bounds() as calls:
                    result = backend.run(scene)
                    assert result.errors is not None
                    last = calls[-1:]
                    if isinstance(backend, hc.Native):  # without the bounds of other runs
                        last = [call for call in calls if call[1].peak is result.errors.peak]
                    for call in last:
                        for what, ratio in needed_factors(call, result, truth).items():
                            key = call[0].kind, what, backend.name
                            needed.setdefault(key, []).append(ratio)
    facts = [(*key, len(ratios), max(ratios)) for key, ratios in needed.items()]
    return pandas.DataFrame(facts, columns=["kind", "what", "backend", "runs", "needed"])


def promises(table: pandas.DataFrame) -> list[Row]:
    """No kind of run needs a larger safety factor than it has."""
    rows = []
    for entry in table.sort_values(["kind", "what"]).to_dict("records"):
        safety = SAFETIES[entry["kind"]]
        factor = safety.factor if entry["what"] == "forces" else safety.factor_of_times
        what = f"{safety.kind}: {entry['what']}, {entry['runs']} runs"
        reason = "the safety factor in error_bound.SAFETIES, with what was measured before"
        rows.append(row(what, entry["backend"], entry["needed"], 0.0, factor, reason))
    return rows


SCRIPTS = {
    "error_bounds": Script(
        "Safety factors of error bounds",
        "Is every safety factor at least what random scenes need?",
        measure, promises,
    )
}  # fmt: skip
