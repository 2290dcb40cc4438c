"""Eq. 1 integrated by SciPy's ``solve_ivp`` (DOP853), in natural units, with any contacts.

Each call ends at a corner of the shock. Where contacts are damped, fly at one another or open under
a load, it also ends where one opens or closes: a dashpot's force jumps there, and no method of
order 8 keeps its order across a jump.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.damped_plan import accurate
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.sampled import (
    on_stroke,
    samples_of_states,
    simulation_of,
    state_at_start,
)
from hertzchain.engines.native.simulation import Simulation
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.observables.contact_errors import ContactErrors
from hertzchain.observables.first_pulse import Signals
from hertzchain.observables.history import Recorder
from hertzchain.observables.samples import Samples
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

LONGEST = 0.2
"""The longest step, natural time units of the fastest contact (chosen): a granule that flies at
another does not pass through its contact within a step."""

_PART, _LEAST = 0.01, 3e-14
"""Tolerance of SciPy over the wanted one; and the least relative tolerance that SciPy takes.
SciPy's error is a mean that includes resting granules, and scales with displacements of granules
that fly off: a part of 1 lost 1.4e-6 of the demo's energy at 2e-8, this one 7e-9."""

SAMPLES = 4
"""Samples of the dense output in the longest step (chosen): peaks between them are interpolated."""

_TOUCH = 10.0
"""Overlap or gap at which a contact has closed or opened, over the absolute tolerance (chosen):
granules ahead of the wave rest within errors of this size."""


def integrate(
    scene: Scene,
    chain: Chain,
    tolerance: float,
    longest: float,
    counted: list[int],
    samples: int = SAMPLES,
) -> Iterator[tuple[Leg, Samples]]:
    """Integrate a scene; yield each leg with successive samples, of which the first is known.

    ``tolerance`` is in natural units, ``longest`` the longest step, in which there are so many
    ``samples``; force evaluations are appended to ``counted``. RunFailed where SciPy fails.
    """
    units, granules = scene.units, scene.bodies
    u, v = state_at_start(scene)
    relative, absolute = max(_PART * tolerance, _LEAST), _PART * tolerance
    ends_at_contacts = not scene.is_plain

    for in_si in scene.schedule(scene.end_time):
        leg = in_si.in_units(units.time, units.force, units.length)
        if leg.stroke is not None:
            u, v = on_stroke(leg, u, v).values()

        def rates(time: float, state: FloatArray, leg: Leg = leg) -> FloatArray:
            u, v = state[:granules], state[granules:]
            applied = leg.ramp.force(time) if leg.ramp is not None else 0.0
            return np.concatenate([v, chain.acceleration(u, applied, v)])

        time = leg.start
        while time < leg.end:
            changes = _changes(chain, u, _TOUCH * absolute) if ends_at_contacts else None
            found = solve_ivp(
                rates, (time, leg.end), np.concatenate([u, v]), method="DOP853",
                rtol=relative, atol=absolute, max_step=longest, dense_output=True,
                events=changes,
            )  # fmt: skip
            counted.append(found.nfev)
            if not found.success or found.sol is None or not found.t[-1] > time:
                raise RunFailed(f"SciPy: {found.message}")
            begin, time = time, float(found.t[-1])
            count = max(1, math.ceil((time - begin) / longest * samples))
            seen = np.union1d(np.linspace(begin, time, count + 1), found.t)
            states = found.sol(seen).T
            u, v = np.split(found.y[:, -1], 2)
            yield leg, samples_of_states(chain, leg, seen, *np.split(states, 2, axis=1))


def _changes(chain: Chain, at_start: FloatArray, touch: float) -> Any:
    """Return an event of SciPy that ends a call where one contact opens or closes.

    A contact that is closed at the start opens at an overlap of ``-touch``, one that is open closes
    at ``touch``, so that a call which begins at an event does not end there.
    """
    granules = at_start.size
    closed = chain.overlap(at_start) > -touch / 2
    threshold = np.where(closed, -touch, touch)

    def event(_: float, state: FloatArray) -> float:
        beyond = chain.overlap(state[:granules]) - threshold
        changed = np.count_nonzero((beyond > 0) != closed)
        return float(np.min(np.abs(beyond))) * (-1.0) ** changed

    event.terminal = True  # type: ignore[attr-defined]
    return event


def longest_step(scene: Scene) -> float:
    """The longest step [s]."""
    return LONGEST * scene.contact_time


def simulate_in_scipy(
    scene: Scene,
    tolerance: float,
    deadline: Deadline,
    recorder: Recorder | None = None,
    longer: float = 1.0,
    first: bool = False,
    samples: int = SAMPLES,
) -> Simulation:
    """Integrate a scene once, with a tolerance; steps may be longer by a factor.

    ``first``: first pulses are wanted. ``samples``: of the longest step.
    """
    chain, counted = Chain.of(scene), list[int]()
    longest = longer * longest_step(scene) / scene.units.time
    blocks = integrate(scene, chain, tolerance, longest, counted, samples)
    signals = Signals.of(scene).in_units(scene.units) if first else None
    run = simulation_of(
        scene, chain, state_at_start(scene), blocks, deadline, recorder, signals=signals
    )
    return replace(run, evaluations=sum(counted))


def accurate_in_scipy(
    scene: Scene,
    rtol: float,
    deadline: Deadline,
    recorder: Recorder | None = None,
    first: bool = False,
) -> tuple[Simulation, ContactErrors]:
    """Integrate with three tolerances, until peaks have the wanted accuracy; the last is returned.

    The differences of the three bound the error, as for the compiled adaptive steps.
    """

    def integrated(tolerance: float, longer: float, is_wanted: bool) -> Simulation:
        kept = recorder if is_wanted else None
        return simulate_in_scipy(scene, tolerance, deadline, kept, longer, first)

    return accurate(integrated, rtol)
