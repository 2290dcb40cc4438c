"""One integration of a scene by the compiled kernels."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from contextvars import copy_context
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import (
    MOVING,
    chain_of,
    is_single_pulse,
    leg_rows,
    nothing_recorded,
    room_for,
    softest,
    start_of,
    steps_of,
)
from hertzchain.engines.native.methods import Walker
from hertzchain.limits import TIME_LIMIT, Deadline, refuse_memory
from hertzchain.observables.contact_errors import ContactErrors, Peaks
from hertzchain.observables.error_bound import diverged
from hertzchain.observables.first_pulse import LATEST, Signals, pulses_in
from hertzchain.observables.history import Recorder
from hertzchain.scene.natural_units import force_scale
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    from hertzchain.engines.native.elastic_state import Outcome

_LONG_RUN = 1e7
"""Granules times force evaluations of a short run: about 0.01 s."""

_STEP_IN_EVALUATIONS = 500
"""Additional cost of a step, in force evaluations of a granule."""

LOOKS = 10.0
"""Number of checks, each after a million steps times granules, after which a run is long: 0.1 s."""

_PEAKS_ALONE = "; peaks alone take less: Native(peaks_only=True), or hertzchain run"

_FASTEST = 0.5e-9
"""Time of a granule and force evaluation on a fast machine [s]; measured 1.1e-9 to 2e-9."""

_FASTEST_FRONT = 1.1
"""Upper bound of the speed of a front [granules per natural time unit] (chosen): that of a wave of
height 3; heights up to 2.2 were measured.
"""


@dataclass(frozen=True, eq=False)
class Simulation:
    """Results of one integration, in natural units."""

    displacement: Any  # at the end, shape (granules,); NaN where granules were dropped
    velocity: Any
    peaks: Peaks
    work: float  # work of the applied force or the piston, plus the energy at the start
    momentum: float  # of all granules except a piston at the end
    energy: float  # of the same granules at the end, with that of constant forces
    steps: int
    evaluations: int  # evaluations of the force; compiled runs include refused steps
    wall_impulse: float = 0.0  # integral of the force on the wall
    piston_impulse: float = 0.0  # integral of the force of the piston
    dissipated: float = 0.0  # energy lost by damping
    end: float = math.nan  # time reached; NaN where it is the end that was given
    status: int = 0  # of compiled runs: ``elastic_state.DONE`` or one of the next constants there

    @classmethod
    def of(cls, found: Outcome, displacement: Any, velocity: Any, peaks: Peaks) -> Simulation:
        """Return what a compiled run found."""
        return cls(
            displacement, velocity, peaks, found.work, found.momentum, found.energy, found.steps,
            found.evaluations, found.wall_impulse, found.piston_impulse, found.dissipated,
            found.end, found.status,
        )  # fmt: skip

    @property
    def peak_force(self) -> Any:
        """Peak force of each contact, shape (contacts,)."""
        return self.peaks.force


@dataclass(frozen=True, eq=False)
class Run:
    """A simulation, how it was made, and bounds of its errors, natural units."""

    method: str
    longest_step: float  # [s]
    simulation: Simulation
    errors: ContactErrors


def simulate(
    scene: Scene,
    legs: Sequence[Leg],
    walker: Walker,
    recorder: Recorder | None = None,
    leave_behind: bool = False,
    window: bool = True,
    deadline: Deadline | None = None,
    start: FloatArray | None = None,
) -> Simulation:
    """Integrate a scene once, on given legs [s, N], with the compiled kernels.

    With ``leave_behind`` granules that cannot change any peak are dropped, in scenes where this is
    certain; with ``window`` granules that the wave has not reached are not computed. The default
    deadline is an hour from now. ``start`` has displacement and
    velocity in natural units, shape (2, granules); by default the chain is at rest. Raises
    StepUnstable if the motion diverges, TooExpensive if the run would take, or has taken, too long.
    """
    prepared = Prepared.of(scene, deadline or Deadline(TIME_LIMIT), start, window)
    return prepared.simulate(walker.cut(legs), walker, recorder, leave_behind)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene in the form that the kernels take, for one run or several, on legs cut already."""

    scene: Scene
    deadline: Deadline
    own_start: bool  # whether the chain starts in its scene's own state
    chain: Chain | None  # None for a plain scene
    start: FloatArray  # displacement and velocity at the start, (2, N); (0, 0) at rest
    moving: int  # number of granules that may move at the start
    softest: float  # see ``kernel_input.softest``
    signals: Signals | None = None  # where first pulses are wanted

    @classmethod
    def of(
        cls,
        scene: Scene,
        deadline: Deadline,
        start: FloatArray | None = None,
        window: bool = True,
        first: bool = False,
    ) -> Prepared:
        """Prepare a scene; ``first``: first pulses are wanted. For the others see ``simulate``."""
        assert scene.contact is None  # damped contacts: see damped_runs
        own = start_of(scene)
        chain = Chain.of(scene).padded() if first else chain_of(scene)
        # The front of a wave moves granules smoothly, but not across a gap or under a static load.
        has_front = window and start is None and (chain is None or not chain.gap.any())
        has_front = has_front and not scene.moves and scene.pushed == 0
        return cls(
            scene,
            deadline,
            start is None,
            chain,
            own if start is None else start + own if own.size else start,
            MOVING if has_front else scene.bodies,
            1.0 if chain is None else softest(scene),
            Signals.of(scene).in_units(scene.units) if first else None,
        )

    def simulate(
        self,
        legs: Sequence[Leg],
        walker: Walker,
        recorder: Recorder | None = None,
        leave_behind: bool = False,
        usual: float = math.nan,
    ) -> Simulation:
        """Integrate the scene once: see the function ``simulate``.

        With ``usual``, a time in natural units, the run finds its end itself, on legs that go on
        until the latest possible one: see ``elastic.march``.
        """
        granules = self.scene.bodies
        leave_behind = leave_behind and self._can_leave_behind
        peaks, found = self._march(legs, walker, leave_behind, recorder, usual)
        outcome, displacement, velocity = found
        if leave_behind:
            displacement = velocity = np.full(granules, np.nan)
        else:  # copies, so that the memory of the run is freed
            displacement, velocity = displacement.copy(), velocity.copy()
        return Simulation.of(outcome, displacement, velocity, peaks)

    def peaks(self, legs: Sequence[Leg], walker: Walker) -> Peaks:
        """Return the peaks of a run alone, natural units: for an error.

        Granules that cannot change any peak are dropped where that is certain. Raises as
        ``simulate``.
        """
        leave_behind = self._can_leave_behind
        return self._march(legs, walker, leave_behind)[0]

    @property
    def _can_leave_behind(self) -> bool:
        """Whether granules may be dropped: a first pulse may not be over when peaks are."""
        return self.own_start and self.signals is None and is_single_pulse(self.scene)

    def _refuse(
        self,
        rows: FloatArray,
        work: float,
        stages: int,
        leave_behind: bool,
        recorder: Recorder | None,
    ) -> None:
        """Raise TooExpensive for a run that is certain to take too long, or too much memory."""
        scene, deadline = self.scene, self.deadline
        if _FASTEST * work > deadline.limit:
            least = [_least_time(scene, rows, stages, left) for left in (False, True)]
            can_leave = not leave_behind and recorder is None and self.own_start
            is_cheaper = can_leave and is_single_pulse(scene) and least[True] < deadline.limit
            deadline.refuse(least[leave_behind], _PEAKS_ALONE if is_cheaper else "")
        if deadline.left <= 0:
            raise deadline.passed()
        arrays = 8 + (0 if recorder is None else 3 * recorder.time.size)
        refuse_memory(8.0 * arrays * scene.bodies)

    def _march(
        self,
        legs: Sequence[Leg],
        walker: Walker,
        leave_behind: bool,
        recorder: Recorder | None = None,
        usual: float = math.nan,
    ) -> tuple[Peaks, tuple[Outcome, Any, Any]]:
        """Return the peaks, and what the kernels return; fill in a recorder."""
        from hertzchain.engines.native import elastic, elastic_state

        granules, stages = self.scene.bodies, walker.stepper.stages
        rows = leg_rows(legs, self.scene.units)
        work = work_of(self.scene, legs, stages) / (1.0 if math.isnan(usual) else LATEST)
        self._refuse(rows, work, stages, leave_behind, recorder)
        record = nothing_recorded() if recorder is None else room_for(recorder, granules)
        contacts = len(self.scene.contacts)
        force, time, control = np.zeros(contacts), np.full(contacts, np.nan), np.zeros(3)
        steps = steps_of(rows, walker, self.softest)
        seen = elastic_state.Seen(force, time, record)

        watch = None if self.signals is None else self.signals.watch()

        def run() -> Any:
            state = elastic_state.at_the_start(granules)
            outcome = elastic.march(
                steps, state, granules, self.start, self.chain, self.moving, leave_behind, seen,
                watch, usual, control,
            )  # fmt: skip
            return outcome, state.rows[0, :granules], state.rows[1, :granules]

        is_long = work >= _LONG_RUN
        if not is_long:
            control[0] = LOOKS
            found = run()
            # With many halved steps a short run becomes long.
            is_long = found[0].status == elastic_state.STOPPED
        if is_long:
            control[:], force[:], time[:] = 0.0, 0.0, np.nan
            watch = None if self.signals is None else self.signals.watch()
            found = stoppable(run, control, self.deadline)
        if found[0].status == elastic_state.DIVERGED:
            raise diverged("native")
        if recorder is not None:
            recorder.displacement[:] = record.displacement
            recorder.velocity[:] = record.velocity
            recorder.contact_force[:] = record.contact_force
        return Peaks(force, time, time < found[0].end, pulses_in(watch)), found


def work_of(scene: Scene, legs: Sequence[Leg], stages: int) -> float:
    """Force evaluations of a granule in a run without refinement, at most."""
    steps = float(sum(leg.steps for leg in legs))
    return steps * (stages * scene.bodies + _STEP_IN_EVALUATIONS)


def _least_time(scene: Scene, rows: FloatArray, stages: int, leave_behind: bool) -> float:
    """Lower bound of the time of a run [s]: granules that must move, times steps and stages.

    While the force acts no granule is dropped, and the front moves along the chain with at least
    half the speed of a wave as strong as the shock (measured). Under a pulse table, which may push
    late and weakly, only the first granule is certain to move. With terms but without constant
    forces steps cost nothing while all granules fly.
    """
    granules = scene.bodies
    single = is_single_pulse(scene)
    speed = 0.4 * math.pow(force_scale(scene.momentum_ratio), 1 / 6)
    may_fly = not single and not scene.granules.constant_force.any()
    evaluations = 0.0
    for row in rows:
        start, end, steps, shape = row[:4]
        moving = min(float(granules), speed * (start + end) / 2) if single else 1.0
        if shape == 0 and may_fly:
            moving = 0.0
        elif shape == 0 and leave_behind:
            # The run continues only until the front has reached the end.
            steps *= max(0.0, min(1.0, (granules / _FASTEST_FRONT - start) / (end - start)))
            moving = 1.0
        evaluations += steps * stages * moving
    return _FASTEST * evaluations


def stoppable(run: Callable[[], Any], control: FloatArray, deadline: Deadline) -> Any:
    """Run long compiled work in a thread, so that an interrupt or the deadline stops it.

    ``run`` releases the interpreter lock; -1 as the first entry of ``control`` ends it. Raises
    TooExpensive if the work is not done by the deadline.
    """
    found: list[Any] = []
    failed: list[BaseException] = []
    # On Python 3.11 an interrupted join makes a thread seem dead that is not.
    done = threading.Event()

    def work() -> None:
        try:
            found.append(run())
        except BaseException as problem:  # raised again below
            failed.append(problem)
        finally:
            done.set()

    thread = threading.Thread(target=copy_context().run, args=(work,))
    try:
        thread.start()
        _wait(done, deadline)
    except BaseException:
        control[0] = -1
        if thread.ident is not None:  # a thread that is about to start ends right after its start
            done.wait()
        raise
    if failed:
        raise failed[0]
    return found[0]


def _wait(done: threading.Event, deadline: Deadline) -> None:
    """Wait for a thread to be done, in a function of its own.

    The jump back of a ``while`` is outside the ``try`` around it on Python 3.13, so a signal that
    arrives there would leave the work running.
    """
    while not done.wait(max(0.0, min(0.1, deadline.left))):
        if deadline.left <= 0 and not done.is_set():
            raise deadline.passed()
