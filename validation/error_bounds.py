"""Measure the safety factors of error bounds on random scenes, kind of run by kind.

A bound is a safety factor times an estimate, the largest weighted difference from other runs, plus
what no difference shows. For each row of ``error_bound.SAFETIES`` this script measures the largest
ratio to the estimate of what is left of an error: of forces (peaks, or first pulses where they are
wanted) and of times (arrivals and widths). The truth is a native run to 1e-10. A row fails where
the ratio is larger than its factor. Scenes are drawn to be hard on bounds (``random_scenes``,
``random_drives``).
"""

from __future__ import annotations

import argparse
import functools
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native.as_written import judging_peaks
from hertzchain.engines.native.duration import with_end
from hertzchain.engines.native.methods import METHODS
from hertzchain.limits import Deadline
from hertzchain.observables.contact_errors import ContactErrors
from hertzchain.observables.error_bound import SAFETIES, Safety, stable_step
from hertzchain.observables.peaks import judged_contacts
from validation.random_drives import random_hard_scene
from validation.random_scenes import KINDS
from validation.rows import Row, progress, row
from validation.script import Script

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


def scenes(first: int, last: int) -> Iterator[tuple[int, np.random.Generator, hc.Scene]]:
    """Scenes of all groups that the truth is known of, with their numbers and generators."""
    for number in range(3 * first, 3 * last):
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
    contacts = result.peak_force.size
    errors = errors.of_contacts(contacts)
    assert truth.errors is not None
    dynamic = np.ones(contacts) if errors.dynamic is None else errors.dynamic
    judged = judged_contacts(truth.peak_force)

    def needed(off: FloatArray, of_truth: Any, bound: Any, share: Any, factor: float) -> float:
        with np.errstate(all="ignore"):
            ratio = factor * (off - of_truth - rest / share) / (bound - rest / share)
        return float(np.nanmax(ratio[np.isfinite(bound) & np.isfinite(off)], initial=0.0))

    with np.errstate(all="ignore"):
        off = np.where(judged, np.abs(result.peak_force / truth.peak_force - 1), np.nan)
    bound = np.broadcast_to(errors.peak, contacts)
    forces = needed(off, truth.errors.peak, bound, 1.0, safety.factor)
    mine, true, of_truth = result.first_pulses, truth.first_pulses, truth.errors
    if mine is None or true is None or errors.first is None or of_truth.first is None:
        return {"forces": forces}
    clear = mine.is_clear & true.is_clear
    off = np.where(clear, np.abs(mine.force / true.force - 1), np.nan)
    first = needed(off, of_truth.first, errors.first, dynamic, safety.factor)
    times = []
    for name, some in (("arrival", clear), ("width", clear & mine.is_steady & true.is_steady)):
        stated, bound = getattr(result.errors, name), getattr(errors, name)
        known = np.isfinite(stated) & (stated > 0)
        if not known.any():
            continue
        unit = float(np.median(stated[known] / bound[known]))  # natural time unit [s]
        off = np.where(some, np.abs(getattr(mine, name) - getattr(true, name)) / unit, np.nan)
        factor = max(safety.factor, safety.of_times)
        times.append(needed(off, getattr(of_truth, name) / unit, bound, dynamic, factor))
    return {"forces": max(forces, first), "times": max(times, default=0.0)}


def judged_by_scipy(scene: hc.Scene, truth: hc.Result) -> float:
    """Return the factor that the peaks of ``judging_peaks`` needed."""
    assert truth.errors is not None
    with recorded_bounds() as calls:
        peaks = judging_peaks(scene, Deadline(LIMIT))[0] * scene.units.force
    safety, errors, _ = calls[-1]
    judged = judged_contacts(truth.peak_force)
    off = np.abs(peaks[judged] / truth.peak_force[judged] - 1) - truth.errors.largest
    return float(np.max(off, initial=0.0)) / max(errors.largest, TINY) * safety.factor


def measure(quick: bool, with_lammps: bool, count: int = SCENES) -> pandas.DataFrame:
    """Return one row per kind of run and quantity: runs, and the largest factor needed."""
    count = 4 if quick else count
    needed: dict[tuple[str, str, str], list[float]] = {}
    for number, rng, scene in progress(list(scenes(0, count)), "scenes"):
        with suppress(hc.HertzchainError):
            truth = hc.Native(rtol=TRUE, wanted="first", time_limit=LIMIT).run(scene)
            if number // 3 % LAMMPS_SHARE == 0:
                with suppress(hc.HertzchainError):
                    ratio = judged_by_scipy(scene, truth)
                    needed.setdefault(("SciPy, judging", "forces", "native"), []).append(ratio)
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
        factor = max(safety.factor, safety.of_times if entry["what"] == "times" else 0.0)
        what = f"{safety.kind}: {entry['what']}, {entry['runs']} runs"
        reason = f"the safety factor; {safety.measured:.2g} was measured before"
        rows.append(row(what, entry["backend"], entry["needed"], 0.0, factor, reason))
    return rows


SCRIPT = Script(
    "Safety factors of error bounds",
    "Is every safety factor at least what random scenes need?",
    "native, LAMMPS; native to 1e-10",
    measure, promises,
)  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """The command line of every script, and how many scenes."""
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--scenes", type=int, default=SCENES)
    chosen, others = parser.parse_known_args(arguments)
    return replace(SCRIPT, measure=functools.partial(measure, count=chosen.scenes)).run(others)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
