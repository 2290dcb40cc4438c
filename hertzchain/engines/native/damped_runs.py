"""Scenes with damped contacts: runs of a wanted accuracy."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped import Damped, integrate_damped
from hertzchain.engines.native.plan import round_off
from hertzchain.engines.native.simulation import (
    End,
    Peaks,
    Simulation,
    leg_rows,
    start_of,
    stoppable,
)
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline, refuse_memory
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.history import Recorder
from hertzchain.observables.peaks import ESTIMATED, largest_difference
from hertzchain.scene.scene import Scene

METHOD = "dop853"
"""Name of the method in results: Dormand and Prince, order 8, steps of its own."""

LONGEST = 0.8
"""Longest step, natural time units of the fastest contact."""

_TOLERANCE = 0.1
"""Tolerance of a step over the wanted accuracy of the peaks."""

_LOOSER = 8.0
"""Tolerance of the second run, which tells the error, over that of the first."""

_KNOWN, _SAFETY = 0.3, 1.5
"""Part of the wanted accuracy that a bound has at least, and error bound over the difference of two
runs."""

_TRIES, _TIGHTEST = 6, 1e-14
"""Runs until one is close enough, and the least tolerance."""


def damped_contacts(scene: Scene) -> Damped:
    """The granules and contacts of a scene as the integrator takes them, natural units."""
    granules, units, contact = scene.granules, scene.units, scene.contact
    assert contact is not None
    assert granules.damping is not None
    mass_unit = units.force * units.time**2 / units.length
    q = contact.exponent
    return Damped(
        stiffness=granules.stiffness * (units.length**1.5 / units.force),
        inertia=mass_unit / granules.mass,
        gap=(granules.gap - granules.static_overlap) / units.length,
        pull=granules.constant_force / granules.mass * (units.time**2 / units.length),
        damping=granules.damping * (units.length**q * units.velocity / units.force),
        exponent=q,
        attraction=contact.attraction,
        wall=scene.wall is not None,
    )


def simulate_damped(
    scene: Scene, tolerance: float, deadline: Deadline, recorder: Recorder | None = None
) -> Simulation:
    """Integrate a scene with damped contacts once.

    Raises StepUnstable if the motion diverges, TooExpensive if the run has taken too long.
    """
    from hertzchain.engines.native import damped_kernel, kernels

    granules = scene.chain.granules
    if deadline.left <= 0:
        raise deadline.passed()
    refuse_memory(8.0 * granules * (40 + (0 if recorder is None else 3 * recorder.time.size)))
    # Steps are cut by the integrator: of the legs only the corners count.
    rows = leg_rows(scene.schedule(scene.end_time), scene.units)
    longest = LONGEST * scene.contact_time / scene.units.time
    record = None
    if recorder is not None:
        times = np.asarray(recorder.time, np.float64)
        empty = np.zeros((times.size, granules))
        record = kernels.Record(times, empty, empty.copy(), np.zeros(recorder.contact_force.shape))
    control = np.zeros(3)
    chain, start = damped_contacts(scene), start_of(scene)
    found = stoppable(
        lambda: integrate_damped(chain, rows, start, tolerance, longest, record, control),
        control,
        deadline,
    )
    if found.status == damped_kernel.DIVERGED:
        raise diverged("native")
    if found.status != damped_kernel.DONE:
        raise RunFailed("the native run of damped contacts takes too many steps: ask for less")
    if recorder is not None and record is not None:
        recorder.displacement[:] = record.displacement
        recorder.velocity[:] = record.velocity
        recorder.contact_force[:] = record.contact_force
    return Simulation(
        End(found.displacement, found.velocity),
        Peaks(found.peak_force, found.peak_time, found.peak_time < found.end),
        found.work,
        found.momentum,
        found.energy,
        found.steps,
        found.evaluations,
        found.wall_impulse,
        found.dissipated,
    )


def accurate_enough(
    scene: Scene, rtol: float, deadline: Deadline, recorder: Recorder | None = None
) -> tuple[Simulation, float]:
    """A run whose peaks have the wanted accuracy, if any has, and the bound of their error."""
    tolerance, before = _TOLERANCE * rtol, np.inf
    for _ in range(_TRIES):
        run = simulate_damped(scene, tolerance, deadline, recorder)
        other = simulate_damped(scene, _LOOSER * tolerance, deadline)
        error = _bound(rtol, run.peaks.force, other.peaks.force, run.evaluations)
        if error <= rtol or tolerance <= _TIGHTEST or error > before:
            break
        factor = max(0.3 * rtol / error, 1e-3) if error < 1 else 1e-3
        tolerance, before = max(tolerance * factor, _TIGHTEST), error
    return run, error


def _bound(rtol: float, force: FloatArray, other: FloatArray, evaluations: int) -> float:
    """Upper bound of the error of peaks, from those of two runs."""
    difference = largest_difference(other, force, ESTIMATED)
    return float(_KNOWN * rtol + _SAFETY * difference + round_off(evaluations))
