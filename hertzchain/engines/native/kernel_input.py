"""Input of the kernels: a scene, its legs and a method as arrays, in natural units."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.methods import SymplecticNystrom, Walker
from hertzchain.errors import RunFailed
from hertzchain.observables.history import Recorder
from hertzchain.scene.natural_units import NaturalUnits
from hertzchain.scene.ramp import SHAPES
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.elastic_state import Record, Steps

MOVING = 8
"""Number of granules in the window at the start of a run."""


def is_single_pulse(scene: Scene) -> bool:
    """Return whether a scene is one of the paper's: a plain chain and a pulse.

    Of such scenes granules behind the wave may be dropped: see ``elastic.left_behind``.
    """
    return scene.pulse is not None and scene.is_plain


def chain_of(scene: Scene) -> Chain | None:
    """Return the chain of a scene for the kernels of elastic contacts; None for a plain one."""
    return None if scene.is_plain else Chain.of(scene).padded()


def softest(scene: Scene) -> float:
    """Return stiffness over mass of contact 2, divided by the largest of all contacts."""
    ratio = scene.granules.stiffness / scene.granules.contact_mass
    return float(ratio[scene.first_granule] / np.max(ratio))


def start_of(scene: Scene) -> FloatArray:
    """Displacement and velocity at the start, natural units, shape (2, N); (0, 0) at rest."""
    if scene.striker is None and scene.piston is None and not scene.moves:
        return np.zeros((0, 0))
    start = np.zeros((2, scene.bodies))
    start[1] = scene.granules.velocity / scene.units.velocity
    return start


def code_of(shape: str) -> int:
    """Return the kernels' number of a shape of ramps; RunFailed for a shape without one."""
    code = SHAPES[shape].code
    if code is None:
        raise RunFailed(f"the kernels have no formula for a ramp of shape {shape}")
    return code


def leg_rows(legs: Sequence[Leg], units: NaturalUnits) -> FloatArray:
    """Return legs [s, N] for the kernels, in natural units, shape (legs, 8).

    A quarter of a sine is one half of a cosine ramp; no leg reaches the other half, which has half
    of the growth.
    """
    rows = []
    for leg in legs:
        row = [leg.start / units.time, leg.end / units.time, leg.steps, 0.0, 0.0, 0.0, 0.0, 0.0]
        if leg.ramp is not None:
            ramp = leg.ramp
            start, end = ramp.start / units.time, ramp.end / units.time
            first, last = ramp.start_force / units.force, ramp.end_force / units.force
            low, high = SHAPES[ramp.shape].part
            start, end = (start - low * end) / (1 - low), (end - (1 - high) * start) / high
            first, last = (first - low * last) / (1 - low), (last - (1 - high) * first) / high
            row[3:8] = code_of(ramp.shape), start, end, first, last
        if leg.stroke is not None:
            row[6] = leg.stroke.displacement_at(leg.start) / units.length
            row[7] = leg.stroke.velocity / units.velocity
        rows.append(row)
    return np.array(rows, np.float64)


@functools.cache
def _coefficients(stepper: SymplecticNystrom) -> tuple[FloatArray, FloatArray]:
    """Return the kicks and the drifts of a method for the kernels."""
    return np.array(stepper.kicks), np.array(stepper.drifts)


def steps_of(rows: FloatArray, walker: Walker, least: float = 1.0) -> Steps:
    """Return the steps of a walker on legs from ``kernel_input.leg_rows``.

    An opening contact costs in proportion to stiffness over mass: ``least`` is that of ``softest``.
    """
    from hertzchain.engines.native.elastic_state import Steps

    stepper = walker.stepper
    assert isinstance(stepper, SymplecticNystrom)  # NumPy integrates with other methods
    is_verlet, tolerance = stepper.order == 2, walker.tolerance * least
    return Steps(rows, *_coefficients(stepper), is_verlet, tolerance, walker.starting)


@functools.cache
def nothing_recorded() -> Record:
    """Return the arrays of a run without a history."""
    return room_for(None, 0)


def room_for(recorder: Recorder | None, granules: int) -> Record:
    """Return arrays for a history, all zero; empty without a recorder."""
    from hertzchain.engines.native.elastic_state import Record

    times = np.zeros(0) if recorder is None else np.asarray(recorder.time, np.float64)
    of_granules = times.size, granules if times.size else 0
    forces = (0, 0) if recorder is None else recorder.contact_force.shape
    return Record(times, np.zeros(of_granules), np.zeros(of_granules), np.zeros(forces))
