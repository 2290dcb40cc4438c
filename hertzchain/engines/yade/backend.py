"""The Yade backend: scene in, result out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import backend as verlet
from hertzchain.engines.external import recorded
from hertzchain.engines.external.observation import Simulation
from hertzchain.engines.external.program import find_program, run_program, work_folder
from hertzchain.engines.external.readings import Granules
from hertzchain.engines.external.rescaling import softening
from hertzchain.engines.yade import deck
from hertzchain.limits import TIME_LIMIT, Deadline, check_time_limit
from hertzchain.observables.history import wanted_times
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene, require_scene
from hertzchain.scene.schedule import Leg

_FASTEST_STEP, _FASTEST_GRANULE = 3e-6, 1e-7
"""Time of a step, and of each granule in it, on a fast machine [s]; 4e-5 and 4e-7 measured."""

_TO_DO = "install it with: apt install yade"


@dataclass(frozen=True)
class Yade:
    """A generated script, run by the program ``yade``.

    Each run starts Yade, which takes 1.4 s. A step of 60 granules takes 5e-5 s, about half of it
    for the function in Python that is called at each step, as it applies the force and reads the
    state.
    While it runs, Yade listens on a port of this machine, behind a password; it has no option
    against that.

    Parameters
    ----------
    dt
        The largest step [s]; by default one whose estimated error is at most ``rtol``.
    read_every
        Steps between two readings of the state, of the coarsest run where ``extrapolated``; by
        default so many that 0.3 natural time units pass at most.
    rtol
        Wanted relative error of the peaks, where no step is asked for.
    extrapolated
        Whether peaks and their times are extrapolated from two runs, one with half the steps of the
        other (Richardson); see ``Lammps``.
    program
        Its path, or its name on the search path.
    time_limit
        How long a run may take [s], all that finds its step and its error included.

    Raises
    ------
    SceneError
        For a step or a time limit that is not a finite number above 0, readings less than one step
        apart, or an error that is not between 0 and 1.
    """

    dt: float | None = None
    read_every: int | None = None
    rtol: float = 1e-6
    extrapolated: bool = False
    program: str = "yade"
    time_limit: float = TIME_LIMIT

    def __post_init__(self) -> None:
        check_time_limit(self.time_limit)
        _ = self._steps  # what cannot be is said at once

    @property
    def _steps(self) -> verlet.Steps:
        return verlet.Steps(self.dt, self.read_every, self.rtol, self.extrapolated)

    def run(self, scene: Scene, record: ArrayLike | None = None) -> Result:
        """Simulate a scene.

        Parameters
        ----------
        scene
            What to simulate.
        record
            Increasing times [s] within the run at which to keep displacement, velocity and
            contact force.

        Raises
        ------
        SceneError
            For what is no scene, or times that cannot be.
        BackendMissing
            If Yade is not there.
        StepUnstable
            If the step asked for is so long that the motion diverges.
        OverlapTooLarge
            If granules would be pressed into one another by more than a radius.
        RunFailed
            If Yade stops with an error or crashes.
        TooExpensive
            If it takes longer than the time limit.
        """
        require_scene(scene)
        begin = time.perf_counter()
        times = None if record is None else wanted_times(record, scene.end_time)
        program = find_program(self.program, _TO_DO)
        result = verlet.run(
            scene,
            _Program(scene, program, Deadline(self.time_limit)).simulate,
            self._steps,
            times,
            code="Yade",
            method="velocity-verlet, MindlinPhys",
        )
        return replace(result, wall_time=time.perf_counter() - begin)


@dataclass(frozen=True)
class _Program:
    """A scene, run by a process of its own."""

    scene: Scene
    program: str
    deadline: Deadline

    def simulate(
        self, legs: Sequence[Leg], strides: Sequence[int], times: FloatArray | None
    ) -> Simulation:
        """Run the script of the scene once, reading it every so many steps of each leg.

        Where coordinates would cost too many digits, Yade gets a similar scene; what is read is
        at once that of the true one again.
        """
        scene, steps = self.scene, sum(leg.steps for leg in legs)
        granules = scene.chain.granules
        made = softening(scene, steps)
        self.deadline.refuse(steps * (_FASTEST_STEP + granules * _FASTEST_GRANULE))
        recorded.refuse_large(legs, strides, granules)
        text = deck.watched(made.scene(scene), [made.leg(leg) for leg in legs], strides)
        with work_folder("Yade") as folder:
            (folder / "chain.py").write_text(text, encoding="ascii")
            # Modules for this Python are not for that within Yade.
            command = [self.program, "-n", "-x", "-j1", "chain.py"]
            run_program(command, folder, self.deadline, "Yade", PYTHONPATH="")
            rest = recorded.read_array(folder / deck.AT_REST, (3, None), "Yade")
            readings = recorded.read_array(folder / deck.READINGS, (None, 3, granules), "Yade")
            version = (folder / deck.VERSION).read_text(encoding="utf-8")
        return recorded.observe(
            scene, made, Granules(*rest), readings, legs, strides, times, "Yade", version
        )
