"""An engine that steps by velocity Verlet in another code: what all of them have."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import backend as verlet
from hertzchain.engines.external import recorded
from hertzchain.engines.external.observation import Observation, Simulation
from hertzchain.engines.external.program import find_program, run_program, work_folder
from hertzchain.engines.external.readings import Granules
from hertzchain.engines.external.rescaling import softening
from hertzchain.limits import RTOL, TIME_LIMIT, Deadline, check_time_limit
from hertzchain.observables.history import wanted_times
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene, require_scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.validity import refuse_terms

Code = Callable[[Scene, Sequence[Leg], Sequence[int], Observation], tuple[str, float | None]]
"""Runs a scene with steps on each leg, and so many between two readings, which it gives to the
observation; returns its version, and the time spent on watching over that spent on steps, where it
is known."""


class ExternalEngine(ABC):
    """Scene in, result out; a subclass is a frozen dataclass with these fields and its own.

    It adds how one run with given steps is made and read.
    """

    LABEL: ClassVar[str]
    """Its name in messages; in small letters, the backend of a result."""

    FASTEST: ClassVar[tuple[float, float]]
    """Time of a step, and of each granule in it, on a fast machine [s]."""

    TERMS: ClassVar[tuple[str, ...]] = ()
    """Terms of a scene that it can simulate, by their names in ``Scene.terms``."""

    dt: float | None
    read_every: int | None
    rtol: float
    extrapolated: bool
    time_limit: float

    def __post_init__(self) -> None:
        """Refuse impossible parameters at once."""
        check_time_limit(self.time_limit)
        _ = self._steps

    @property
    def _steps(self) -> verlet.Steps:
        return verlet.Steps(self.dt, self.read_every, self.rtol, self.extrapolated)

    @abstractmethod
    def method_of(self, scene: Scene) -> str:
        """The method, as the result names it."""

    @abstractmethod
    def _code(self, scene: Scene, deadline: Deadline) -> Code:
        """What runs the scene, or a similar one; it is there, and can."""

    def _least_time(self, steps: int, granules: float) -> float:
        """Time of a run on a fast machine [s]."""
        return steps * (self.FASTEST[0] + granules * self.FASTEST[1])

    def _simulate(self, scene: Scene, deadline: Deadline) -> verlet.Simulate:
        refuse_terms(scene, self.LABEL, self.TERMS)
        code = self._code(scene, deadline)

        def simulate(
            legs: Sequence[Leg], strides: Sequence[int], times: FloatArray | None
        ) -> Simulation:
            steps = sum(leg.steps for leg in legs)
            # Where coordinates would cost too many digits the code gets a similar scene; what is
            # read is at once that of the true one again.
            made = softening(scene, steps)
            deadline.refuse(self._least_time(steps, scene.chain.granules))
            seen = Observation(scene, made, legs, times, self.LABEL)
            return seen.simulation(*code(made.scene(scene), seen.legs, strides, seen))

        return simulate

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
            For an object that is no scene, or impossible times.
        BackendMissing
            If the code is not there.
        StepUnstable
            If the step asked for is so long that the motion diverges.
        Unpredictable
            If rounding errors grow until no digit is left.
        OverlapTooLarge
            If granules would be pressed into one another by more than a radius.
        RunFailed
            If the code stops with an error or crashes, or cannot simulate this scene.
        TooExpensive
            If it takes longer than the time limit.
        """
        require_scene(scene)
        return self._run(scene, record)

    def _run(self, scene: Scene, record: ArrayLike | None) -> Result:
        begin = time.perf_counter()
        times = None if record is None else wanted_times(record, scene.end_time)
        simulate = self._simulate(scene, Deadline(self.time_limit))
        method = self.method_of(scene)
        result = verlet.run(scene, simulate, self._steps, times, self.LABEL, method)
        return replace(result, wall_time=time.perf_counter() - begin)


@dataclass(frozen=True, eq=False)
class Found:
    """What a program has left of a run: its version, granules at rest, and all readings.

    With a wall, the force on it at each reading too [N].
    """

    version: str
    rest: Granules
    readings: FloatArray
    wall_force: FloatArray | None = None


@dataclass(frozen=True)
class ProgramEngine(ExternalEngine):
    """A code that is a program: it gets one file, and leaves its readings in others."""

    FILE: ClassVar[str]
    """The deck, in the folder in which the program runs."""

    PACKAGE: ClassVar[str]
    """The package that brings the program, by ``apt install``."""

    ENVIRONMENT: ClassVar[dict[str, str]] = {}
    """Variables that the program is given."""

    dt: float | None = None
    read_every: int | None = None
    rtol: float = RTOL
    extrapolated: bool = False
    program: str = ""
    time_limit: float = TIME_LIMIT

    @abstractmethod
    def _deck(self, scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> str:
        """The file that makes the program run the scene and write its readings."""

    @abstractmethod
    def _command(self, program: str) -> list[str]:
        """The command that runs ``FILE``."""

    @abstractmethod
    def _found(self, folder: Path, scene: Scene) -> Found:
        """What the program has left in its folder of the scene that it was given."""

    def _refuse(self, scene: Scene) -> None:
        """Refuse a scene that the code cannot simulate; by default none."""

    def _code(self, scene: Scene, deadline: Deadline) -> Code:
        program = find_program(self.program, f"install it with: apt install {self.PACKAGE}")
        self._refuse(scene)

        def run(
            scene: Scene, legs: Sequence[Leg], strides: Sequence[int], seen: Observation
        ) -> tuple[str, None]:
            recorded.refuse_large(legs, strides, scene.chain.granules)
            text = self._deck(scene, legs, strides)
            with work_folder(self.LABEL) as folder:
                (folder / self.FILE).write_text(text, encoding="ascii")
                command = self._command(program)
                run_program(command, folder, deadline, self.LABEL, **self.ENVIRONMENT)
                found = self._found(folder, scene)
            recorded.observe(seen, found.rest, found.readings, strides, found.wall_force)
            return found.version, None

        return run
