"""Errors of the peaks of runs with equal or refined steps, by further runs with other steps."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.methods import Method
from hertzchain.engines.native.simulation import Prepared, Simulation
from hertzchain.observables.contact_errors import ContactErrors, bounds
from hertzchain.observables.error_bound import (
    SHORT,
    coarser_run,
    finer_run,
    second_order_safety,
    stable_step,
)
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.as_written import RungeKutta


def estimate(
    prepared: Prepared | RungeKutta,
    legs: Sequence[Leg],
    plan: plans.Plan,
    run: Simulation,
    twice: bool,
) -> ContactErrors:
    """Return upper bounds of the errors of a run, from one run or two with other steps.

    Two further runs are made where a contact is still pressed at the end: forces at one time vary
    erratically with the step, one difference may be small by chance, and none falls with a power of
    the step. The same holds for rounding errors that collisions amplify: two runs are made for
    pistons, and for scenes with terms whose plan before was not accurate enough. Without the third
    run the errors of two of 9,404 random runs were 2 and 3.5 times their bounds, when short legs
    had as many steps in the second run as in the third.
    """
    others = [tuple(leg.in_steps(plans.other_step(leg.steps)) for leg in legs)]
    if twice:
        others.append(_other_than(others[0], finer_run(legs).legs))
    differences = [run.peaks.differences(prepared.peaks(other, plan.coarser)) for other in others]

    def bound(*found: FloatArray, of_times: bool = False) -> FloatArray:
        largest = np.maximum.reduce(found)
        return np.asarray(plan.estimate(largest, run.evaluations, of_times))

    return bounds(bound, *differences, of_times=functools.partial(bound, of_times=True))


def _other_than(before: Sequence[Leg], legs: Sequence[Leg]) -> tuple[Leg, ...]:
    """Legs with one step more where they have as many as those before, so that runs differ."""
    return tuple(
        leg.in_steps(leg.steps + (leg.steps == other.steps))
        for other, leg in zip(before, legs, strict=True)
    )


def error_bound(
    prepared: Prepared | RungeKutta, legs: Sequence[Leg], method: Method, run: Simulation
) -> ContactErrors:
    """Return upper bounds of the errors of a run with a given method and step."""
    scene = prepared.scene
    # Errors at steps of 0.6 natural time units and more do not predict those at longer steps.
    others = [coarser_run(legs, min(stable_step(scene, method.interval), scene.contact_time))]
    longest = max(leg.dt for leg in legs) / scene.contact_time
    if not method.walker.tolerance or longest > SHORT or run.peaks.any_rising:
        others.append(finer_run(legs))
    walker = method.walker
    # If cut again, different legs could get the same steps.
    walker = replace(walker, cosine_steps=1)
    differences = [run.peaks.differences(prepared.peaks(other.legs, walker)) for other in others]
    safety = method.safety
    if walker.stepper.order == 2:
        safety = second_order_safety(scene, longest, run.peaks.any_rising)
    least = method.floor + plans.round_off(run.evaluations)

    def bound(*found: FloatArray) -> FloatArray:
        scaled = [other.factor * each for other, each in zip(others, found, strict=True)]
        return np.asarray(safety * np.maximum.reduce(scaled) + least)

    return bounds(bound, *differences)
