"""Base classes of engines that step by velocity Verlet in another code."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import backend as verlet
from hertzchain.engines.external import recorded
from hertzchain.engines.external.observation import Observation, Simulation
from hertzchain.engines.external.program import find_program, run_program, work_folder
from hertzchain.engines.external.readings import Granules
from hertzchain.engines.external.rescaling import softening
from hertzchain.limits import RTOL, TIME_LIMIT, Deadline, check_time_limit
from hertzchain.observables.first_pulse import check_wanted, usually_wanted
from hertzchain.observables.result import Result
from hertzchain.observables.samples import wanted_times
from hertzchain.scene.scene import Scene, SceneLike, refuse_terms, to_scene
from hertzchain.scene.schedule import Leg

Code = Callable[[Scene, Sequence[Leg], Sequence[int], Observation], str]
"""Function that runs a scene with given steps and steps between readings on each leg, and passes
the readings to the observation. It returns the code's version.
"""


class ExternalEngine(ABC):
    """A backend that runs another code; a subclass is a frozen dataclass with further fields.

    The subclass defines how one run with given steps is started and read.
    """

    LABEL: ClassVar[str]
    """Name of the code in messages."""

    FASTEST: ClassVar[tuple[float, float]]
    """Time of a step, and additional time for each granule, on a fast machine [s]."""

    TERMS: ClassVar[tuple[str, ...]] = ()
    """Terms that the code can simulate, by their names in ``Scene.terms``."""

    dt: float | None
    read_every: int | None
    rtol: float
    extrapolated: bool
    time_limit: float
    wanted: str | None

    def __post_init__(self) -> None:
        """Refuse impossible parameters."""
        check_time_limit(self.time_limit)
        check_wanted(self.wanted)
        _ = self._steps

    @property
    def name(self) -> str:
        """Name of the code in options and columns, and the backend of a result."""
        return self.LABEL.lower()

    @property
    def _steps(self) -> verlet.Steps:
        return verlet.Steps(self.dt, self.read_every, self.rtol, self.extrapolated)

    @abstractmethod
    def method_of(self, scene: Scene) -> str:
        """Return the name of the method in the result."""

    @abstractmethod
    def _code(self, scene: Scene, deadline: Deadline) -> Code:
        """Function that runs the scene or a similar one, after checking that the code can."""

    def _least_time(self, steps: int, granules: float) -> float:
        """Return the time of a run on a fast machine [s]."""
        return steps * (self.FASTEST[0] + granules * self.FASTEST[1])

    def _simulate(self, scene: Scene, deadline: Deadline) -> verlet.Simulate:
        refuse_terms(scene, self.LABEL, self.TERMS)
        code = self._code(scene, deadline)
        first = (usually_wanted(scene) if self.wanted is None else self.wanted) == "first"

        def simulate(
            legs: Sequence[Leg], strides: Sequence[int], times: FloatArray | None
        ) -> Simulation:
            steps = sum(leg.steps for leg in legs)
            # Where coordinates would cost too many digits the code gets a similar scene; readings
            # are scaled back to the true scene at once.
            scaling = softening(scene, steps)
            deadline.refuse(self._least_time(steps, scene.chain.granules))
            seen = Observation(scene, scaling, legs, times, self.LABEL, first)
            return seen.simulation(code(scaling.scene(scene), seen.legs, strides, seen))

        return simulate

    def run(self, scene: SceneLike, record: ArrayLike | None = None) -> Result:
        """Simulate a scene.

        Parameters
        ----------
        scene
            What to simulate, or the path of its file.
        record
            When to keep displacement, velocity and contact force: increasing times [s] within the
            run, or a whole number of frames, equally spaced from 0 to the end.

        Raises
        ------
        SceneError
            If the argument is neither a scene nor the path of a scene file, or for impossible
            times.
        BackendMissing
            If the code is not installed.
        StepUnstable
            If the given step is so long that the motion diverges.
        Unpredictable
            If rounding errors grow until no digit is left.
        OverlapTooLarge
            If granules would be pressed into one another by more than a radius.
        RunFailed
            If the code stops with an error or crashes, or cannot simulate this scene.
        TooExpensive
            If it takes longer than the time limit.
        """
        return self._run(to_scene(scene), record)

    def _run(self, scene: Scene, record: ArrayLike | None) -> Result:
        from hertzchain.engines.native.duration import with_end

        begin = time.perf_counter()
        scene = with_end(scene, record, self.time_limit)
        times = None if record is None else wanted_times(record, scene.end_time)
        simulate = self._simulate(scene, Deadline(self.time_limit))
        method = self.method_of(scene)
        result = verlet.run(scene, simulate, self._steps, times, self.LABEL, method)
        engine: Any = self  # a dataclass
        engines = replace(engine, dt=result.dt), replace(engine, dt=result.dt / 2)
        return replace(result, wall_time=time.perf_counter() - begin, engines=engines)


@dataclass(frozen=True, eq=False)
class Found:
    """Results that a program left: its version, granules at rest, and all readings.

    With a wall they include the force on it at each reading [N].
    """

    version: str
    rest: Granules
    readings: FloatArray
    wall_force: FloatArray | None = None


@dataclass(frozen=True)
class ProgramEngine(ExternalEngine):
    """A code that is a program: it reads one file, and writes its readings to others."""

    FILE: ClassVar[str]
    """Name of the deck in the folder in which the program runs."""

    INSTALL: ClassVar[str]
    """Command that installs the program."""

    WRITER: ClassVar[ModuleType]
    """Module whose ``watched`` writes decks that print readings, and ``deck`` one with peaks."""

    ENVIRONMENT: ClassVar[dict[str, str]] = {}
    """Environment variables of the program."""

    dt: float | None = None
    read_every: int | None = None
    rtol: float = RTOL
    extrapolated: bool = False
    program: str = ""
    time_limit: float = TIME_LIMIT
    wanted: str | None = None

    @abstractmethod
    def _command(self, program: str) -> list[str]:
        """Return the command that runs ``FILE``."""

    @abstractmethod
    def _found(self, folder: Path, scene: Scene) -> Found:
        """Read the results that the program left in its folder."""

    def refuse(self, scene: Scene) -> None:
        """Raise RunFailed for a scene that the code cannot simulate."""
        refuse_terms(scene, self.LABEL, self.TERMS)
        self._refuse(scene)

    @abstractmethod
    def _refuse(self, scene: Scene) -> None:
        """Raise RunFailed for terms of a kind that the code does not have."""

    def _code(self, scene: Scene, deadline: Deadline) -> Code:
        return self.code_of(scene, deadline)

    def code_of(
        self, scene: Scene, deadline: Deadline, edit: Callable[[str], str] = lambda text: text
    ) -> Code:
        """Return the code of the program, which runs decks as ``edit`` returns them.

        RunFailed for a scene that it cannot simulate.
        """
        program = find_program(self.program, f"install it with: {self.INSTALL}")
        self.refuse(scene)

        def run(
            scene: Scene, legs: Sequence[Leg], strides: Sequence[int], seen: Observation
        ) -> str:
            recorded.refuse_large(legs, strides, scene.bodies)
            text = edit(self.WRITER.watched(scene, legs, strides))
            with work_folder(self.LABEL) as folder:
                (folder / self.FILE).write_text(text, encoding="ascii")
                command = self._command(program)
                run_program(command, folder, deadline, self.LABEL, **self.ENVIRONMENT)
                record = self._found(folder, scene)
            recorded.observe(seen, record.rest, record.readings, strides, record.wall_force)
            return record.version

        return run
