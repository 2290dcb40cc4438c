"""The LAMMPS backend: runs a scene by the Python module or a binary, and returns its result."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.engine import Code, ExternalEngine
from hertzchain.engines.external.observation import BLOCK, Observation, reading_times, stops
from hertzchain.engines.external.program import work_folder
from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps import engine as state
from hertzchain.engines.lammps.binary import Binary, Program
from hertzchain.engines.lammps.dialect import NO_STEP
from hertzchain.engines.lammps.engine import (
    Child,
    Instance,
    Task,
    command,
    engine,
    look,
    run,
    version_of,
)
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.engines.lammps.reading.reading import examine_deck, examined_deck
from hertzchain.errors import HertzchainError, SceneError, require
from hertzchain.limits import RTOL, TIME_LIMIT, Deadline
from hertzchain.observables.result import Result
from hertzchain.scene.arguments import checked
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.terms import ALL_TERMS


@dataclass(frozen=True)
class Lammps(ExternalEngine):
    """A generated deck, run through the ``lammps`` Python module or by a LAMMPS binary.

    Parameters
    ----------
    dt
        The largest step [s]; by default one whose estimated error is at most ``rtol``.
    pair_style
        ``granular`` (with hertz/material) or ``gran/hertz/history``.
    read_every
        Steps between two readings of the state, in the coarsest run where ``extrapolated``; the
        default gives intervals of at most 0.3 natural time units.
    rtol
        Wanted relative error of the peaks, where no step is given: whether p is 9 or 10 can depend
        on 2e-5. Where round-off makes a larger error, the run continues and its ``error_estimate``
        has that error.
    extrapolated
        Whether peaks and their times are extrapolated from two runs, one with half the steps of the
        other (Richardson): right to 1e-6 in an eighth of the steps. Everything else in the result,
        from displacement to balance and history, is that of the finer run, whose step is ``dt``;
        its error is that of velocity Verlet at this step, about 0.1 dt^2 in natural units. With
        damped contacts errors are proportional to dt: then peaks are also extrapolated if no step
        is given and ``rtol`` is below 1e-4.
    isolated
        Whether LAMMPS runs in its own process: then a crash, a hang or missing memory is an error
        like any other. It costs a second for each run; in ``run_many`` many runs share one process.
    time_limit
        Time limit of a run [s], including the search for its step and its error. It is checked
        whenever the state is read; an isolated run, or a binary, is ended at once.
    lmp
        Path or name of a LAMMPS binary of any version, which is run instead of the module, in its
        own process. It gives the same numbers, and takes a few tenths of a second more for each of
        the runs that find step and error. The environment variable ``HERTZCHAIN_LMP`` is used by
        the command line only.
    ranks
        MPI ranks of the binary, started by the ``mpiexec`` in its folder or else on the search
        path.
    wanted
        The forces for which ``rtol`` holds: ``all`` for the largest forces, or ``first`` for first
        pulses. The default is that of ``Native``.

    Raises
    ------
    SceneError
        For a pair style that does not exist, a step or a time limit that is not a finite number
        above 0, readings less than one step apart, an error that is not between 0 and 1,
        ``isolated`` with a binary, or ranks without a binary.
    """

    LABEL: ClassVar[str] = "LAMMPS"
    FASTEST: ClassVar[tuple[float, float]] = (0.3e-6, 8e-9)  # 0.5e-6 and 2e-8 measured
    TERMS: ClassVar[tuple[str, ...]] = ALL_TERMS

    dt: float | None = None
    pair_style: str = "granular"
    read_every: int | None = None
    rtol: float = RTOL
    extrapolated: bool = False
    isolated: bool = False
    time_limit: float = TIME_LIMIT
    lmp: str | Path | None = None
    ranks: int = 1
    wanted: str | None = None

    def __post_init__(self) -> None:
        deck.check_pair_style(self.pair_style)
        require(self.ranks >= 1, "ranks", self.ranks, "must be at least 1")
        alone = "the lammps module runs on one process: name also a LAMMPS binary with lmp"
        require(self.ranks == 1 or self.lmp is not None, "ranks", self.ranks, alone)
        apart = "a LAMMPS binary always has its own process: leave out isolated, or lmp"
        require(not self.isolated or self.lmp is None, "isolated", self.isolated, apart)
        super().__post_init__()

    def method_of(self, scene: Scene) -> str:  # noqa: ARG002 - the same for all
        """Return the name of the method in the result."""
        return f"velocity-verlet, {self.pair_style}"

    def _run(self, scene: Scene, record: ArrayLike | None) -> Result:
        if not self.isolated:
            return super()._run(scene, record)
        with Child() as child:
            return run_in(child, self, scene, record)

    def examine(self, scene: Scene) -> FoundDeck:
        """Read the numbers of a scene's deck from LAMMPS; see ``reading.own``.

        Raises
        ------
        BackendMissing
            If LAMMPS is not installed.
        RunFailed
            If LAMMPS stops with an error or, in its own process, crashes.
        """
        deadline, program = Deadline(self.time_limit), None
        with work_folder("LAMMPS") as folder, Child() as child:

            def ask(function: Task, *arguments: object) -> Any:
                if self.isolated or program is not None:
                    return child.call(function, *arguments, time_limit=deadline.left)
                return function(*arguments)

            if self.lmp is None:
                version = ask(look)[0]
            else:  # a binary is probed on one process
                binary = Program.find(str(self.lmp), self.ranks, deadline)
                version = binary.build.version
                program = replace(binary, command=binary.command[-1:])
            text = examined_deck(scene, self.pair_style, version)
            examined: FoundDeck = ask(examine_deck, folder, scene, text, program)
            return examined

    def peaks_alone(self, scene: Scene) -> tuple[FloatArray, int]:
        """Simulate with the given step and without any further runs: the cost of the peaks alone.

        There are no runs to find a step or an error: only one run of the deck, or the two that are
        extrapolated.

        Returns
        -------
        tuple
            Peak forces [N], shape (contacts,), and the number of steps taken.

        Raises
        ------
        SceneError
            If no step is given. Further errors as for ``run``.
        """
        if self.dt is None:
            raise SceneError("dt", None, "missing, a run without estimates needs it")
        if self.isolated:
            within = replace(self, isolated=False).peaks_alone
            with Child() as child:
                peaks_and_steps: tuple[FloatArray, int] = child.call(
                    within, scene, time_limit=self.time_limit
                )
                return peaks_and_steps
        return self.runner(scene, Deadline(self.time_limit)).peaks_alone(self.dt)

    def code_of(self, scene: Scene, deadline: Deadline) -> Code:  # noqa: ARG002 - it can run all
        """Return LAMMPS, as the module or the binary."""
        if self.lmp is None:
            return _Module(self.pair_style, deadline).run
        program = Program.find(str(self.lmp), self.ranks, deadline)
        return Binary(self.pair_style, deadline, program).run

    def least_time(self, steps: int, granules: float) -> float:
        """Return the time of a run on a fast machine [s], with the granules shared by ranks."""
        return super().least_time(steps, granules / self.ranks)


@checked
def run_many(
    scenes: Iterable[Scene], lammps: Lammps | None = None
) -> Iterator[Result | HertzchainError]:
    """Run scenes with LAMMPS, one after another, in one child process.

    If LAMMPS crashes, hangs or is killed, that scene gets an error, and the next scene a new
    process.

    Parameters
    ----------
    scenes
        Scenes to simulate.
    lammps
        Backend; by default with steps for an error of 1e-6. Its ``time_limit`` is for each scene.

    Yields
    ------
    Result or HertzchainError
        For each scene its result, or the error that it ended with.
    """
    with Child() as child:
        for scene in scenes:
            outcome: Result | HertzchainError
            try:
                outcome = run_in(child, lammps or Lammps(), scene)
            except HertzchainError as problem:
                outcome = problem
            yield outcome


def run_in(child: Child, lammps: Lammps, scene: Scene, record: ArrayLike | None = None) -> Result:
    """Run a scene in a process; the wall time of the result is that of the whole call."""
    begin = time.perf_counter()
    within = replace(lammps, isolated=False)
    result: Result = child.call(within.run, scene, record, time_limit=lammps.time_limit)
    return replace(result, wall_time=time.perf_counter() - begin)


@dataclass(frozen=True)
class _Module:
    """Runs scenes in this process, through LAMMPS's own Python module."""

    pair_style: str
    deadline: Deadline

    def run(
        self, scene: Scene, legs: Sequence[Leg], strides: Sequence[int], seen: Observation
    ) -> str:
        """Run the deck of a scene, and read the state at the given interval of steps."""
        with engine() as lammps:
            start = deck.set_up(scene, self.pair_style, version_of(lammps))
            command(lammps, start + state.COMMANDS)
            seen.begin(state.granules(lammps))
            before = None
            for number, (leg, stride) in enumerate(zip(legs, strides, strict=True)):
                command(lammps, "\n".join([*deck.leg_commands(scene, leg, before), NO_STEP]))
                before = leg
                wall = None if scene.wall is None else np.zeros(BLOCK + 1)
                shape = (len(state.ARRAYS), scene.bodies, 3)
                for reached, arrays in _read(lammps, leg, stride, shape, self.deadline, wall):
                    of_wall = None if wall is None else wall[: reached.size].copy()
                    seen.update(number, reached, arrays[..., 0], of_wall)
            return version_of(lammps)


def _read(
    lammps: Instance, leg: Leg, stride: int, shape: tuple[int, int, int], deadline: Deadline, wall:
    FloatArray | None,
) -> Iterator[tuple[FloatArray, FloatArray]]:  # fmt: skip
    """Run a leg; yield times and arrays of readings in blocks that share one reading.

    The force on the wall is kept in ``wall``, if there is one.
    """
    steps, times = stops(leg, stride), reading_times(leg, stride)
    arrays = np.zeros((min(times.size, BLOCK + 1), *shape))
    state.read(lammps, arrays[0])
    if wall is not None:
        wall[0] = state.wall_force(lammps)
    for first in range(0, times.size - 1, BLOCK):
        block = steps[first : first + BLOCK + 1]
        for k, (done, stop) in enumerate(itertools.pairwise(block), start=1):
            run(lammps, stop - done)
            if deadline.left < 0:
                raise deadline.passed()
            state.read(lammps, arrays[k])
            if wall is not None:
                wall[k] = state.wall_force(lammps)
        yield times[first : first + len(block)], arrays[: len(block)]
        arrays[0] = arrays[len(block) - 1]
        if wall is not None:
            wall[0] = wall[len(block) - 1]
