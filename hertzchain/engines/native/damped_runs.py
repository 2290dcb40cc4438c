"""Scenes with terms by adaptive steps: one run, and runs of a wanted accuracy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hertzchain.engines.native.damped import integrate_damped
from hertzchain.engines.native.damped_plan import LONGEST, accurate
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import leg_rows, noted_pulses, room_for, start_of
from hertzchain.engines.native.simulation import Simulation, stoppable
from hertzchain.errors import RunFailed, TooExpensive
from hertzchain.limits import Deadline, refuse_memory
from hertzchain.observables.contact_errors import ContactErrors
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.first_pulse import Contacts
from hertzchain.observables.history import Recorder
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

METHOD = "dop853"
"""Name of the method in results: Dormand and Prince, order 8, steps of its own."""

_ARRAYS = 51
"""Numbers that a run keeps for each granule."""


class TooMuchWork(RunFailed):
    """A run takes more work than it may, or its steps do not advance."""


def longest_step(scene: Scene) -> float:
    """The longest step [s]."""
    return LONGEST * scene.contact_time


def simulate_damped(
    scene: Scene,
    tolerance: float,
    deadline: Deadline,
    recorder: Recorder | None = None,
    legs: Sequence[Leg] | None = None,
    longer: float = 1.0,
    most_work: float = math.inf,
    first: bool = False,
) -> Simulation:
    """Integrate a scene once; ``first``: first pulses are wanted.

    ``legs`` [s, N] tell the applied force, by default that of the scene; with ``longer`` steps may
    be longer by that factor. Raises StepUnstable if the motion diverges, TooExpensive if the run
    has taken too long, TooMuchWork after ``most_work`` force evaluations of a granule.
    """
    from hertzchain.engines.native import elastic_state

    granules = scene.chain.granules
    if deadline.left <= 0:
        raise deadline.passed()
    recorded = 0 if recorder is None else 3 * recorder.time.size
    try:
        refuse_memory(8.0 * granules * (_ARRAYS + recorded))
    except TooExpensive as problem:
        if most_work < math.inf:  # another method takes less
            raise TooMuchWork(str(problem)) from problem
        raise
    # Steps are cut by the integrator: of the legs only the corners count.
    rows = leg_rows(legs or scene.schedule(scene.end_time), scene.units)
    contacts = Contacts.of(scene).in_units(scene.units) if first else None
    record = room_for(recorder, granules, contacts)
    control, longest = np.zeros(3), longest_step(scene) / scene.units.time
    chain, start = Chain.of(scene), start_of(scene)
    found: Simulation = stoppable(
        lambda: integrate_damped(
            chain, rows, start, tolerance, longest, record, control, most_work, longer
        ),
        control,
        deadline,
    )
    if found.status == elastic_state.DIVERGED:
        raise diverged("native")
    if found.status == elastic_state.STUCK:
        raise TooMuchWork(
            "the native run does not advance: a contact opens and closes within"
            " rounding errors; ask for less accuracy, or for a shorter end_time"
        )
    if found.status == elastic_state.TOO_MUCH:
        raise TooMuchWork("the native run takes more work than it may")
    if recorder is not None:
        recorder.displacement[:] = record.displacement
        recorder.velocity[:] = record.velocity
        recorder.contact_force[:] = record.contact_force
    first_pulses = noted_pulses(record, contacts, found.peak_force)
    return replace(found, peaks=replace(found.peaks, first=first_pulses))


def accurate_enough(
    scene: Scene,
    rtol: float,
    deadline: Deadline,
    recorder: Recorder | None = None,
    most_work: float = math.inf,
    first: bool = False,
) -> tuple[Simulation, ContactErrors]:
    """A run of the wanted accuracy, if any has, and the bounds of its errors.

    What the recorder keeps is of that run, which is always the last. Raises TooMuchWork if the
    first and coarsest run takes more than ``most_work`` force evaluations of a granule, or another
    one more than five times as many.
    """
    allowed = iter((most_work,))

    def integrate(tolerance: float, longer: float, may_be_last: bool) -> Simulation:
        kept, most = recorder if may_be_last else None, next(allowed, 5 * most_work)
        return simulate_damped(
            scene, tolerance, deadline, kept, longer=longer, most_work=most, first=first
        )

    return accurate(integrate, rtol)
