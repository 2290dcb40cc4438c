"""The LAMMPS backend: runs a scene by the Python module or a binary, and returns its result."""

from __future__ import annotations

import itertools
import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import observation
from hertzchain.engines.external.engine import Code, ExternalEngine
from hertzchain.engines.external.observation import (
    BLOCK,
    Observation,
    read_blocks,
    read_frames,
    reading_times,
    stops,
)
from hertzchain.engines.external.program import work_folder
from hertzchain.engines.external.terms import OF_OTHER_CODES
from hertzchain.engines.lammps import deck, dialect, engine
from hertzchain.engines.lammps.engine import Child, Instance, Program, command
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.engines.lammps.reading.reading import examine_deck, examined_deck
from hertzchain.errors import RunFailed, SceneError, TooExpensive, require
from hertzchain.limits import RTOL, TIME_LIMIT, Deadline
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_COLUMNS = ("x", "vx", "fx")  # numbers for each granule in the dumps of a run
_AT_REST, _REST = ("x", "mass", "radius"), "rest.dump"  # those before the shock, and their file


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
    time_limit
        Time limit of a run [s], including the search for its step and its error. It is checked
        whenever the state is read; a binary is ended at once.
    lmp
        Path or name of a LAMMPS binary of any version, which is run instead of the module, in its
        own process: then a crash, a hang or missing memory is an error like any other. It gives the
        same numbers, and takes a few tenths of a second more for each of the runs that find step
        and error. The environment variable ``HERTZCHAIN_LMP`` is used by the command line only.
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
        above 0, readings less than one step apart, an error that is not between 0 and 1, or ranks
        without a binary.
    """

    LABEL: ClassVar[str] = "LAMMPS"
    FASTEST: ClassVar[tuple[float, float]] = (0.3e-6, 8e-9)  # 0.5e-6 and 2e-8 measured
    TERMS: ClassVar[tuple[str, ...]] = (
        *OF_OTHER_CODES, "single granule", "measured granules", "fixed granules", "near wall",
    )  # fmt: skip

    dt: float | None = None
    pair_style: str = "granular"
    read_every: int | None = None
    rtol: float = RTOL
    extrapolated: bool = False
    time_limit: float = TIME_LIMIT
    lmp: str | Path | None = None
    ranks: int = 1
    wanted: str | None = None

    def __post_init__(self) -> None:
        deck.check_pair_style(self.pair_style)
        require(self.ranks >= 1, "ranks", self.ranks, "must be at least 1")
        alone = "the lammps module runs on one process: name also a LAMMPS binary with lmp (--lmp)"
        require(self.ranks == 1 or self.lmp is not None, "ranks", self.ranks, alone)
        super().__post_init__()

    def method_of(self, scene: Scene) -> str:  # noqa: ARG002 - the same for all
        """Return the name of the method in the result."""
        return f"velocity-verlet, {self.pair_style}"

    def examine(self, scene: Scene) -> FoundDeck:
        """Read the numbers of a scene's deck from LAMMPS.

        Raises
        ------
        BackendMissing
            If LAMMPS is not installed.
        RunFailed
            If LAMMPS stops with an error.
        """
        deadline = Deadline(self.time_limit)
        with work_folder("LAMMPS") as folder, Child() as child:
            if self.lmp is None:
                build = engine.module_build()
                text = examined_deck(scene, self.pair_style, build.version)
                return examine_deck(folder, scene, text, None)
            # A binary is probed on one process, and read from another, which the limit can end.
            binary = Program.find(str(self.lmp), self.ranks, deadline)
            program = replace(binary, command=binary.command[-1:])
            text = examined_deck(scene, self.pair_style, binary.build.version)
            examined: FoundDeck = child.call(
                examine_deck, folder, scene, text, program, time_limit=deadline.left
            )
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


def run_in(child: Child, lammps: Lammps, scene: Scene, record: ArrayLike | None = None) -> Result:
    """Run a scene in a process; the wall time of the result is that of the whole call.

    If LAMMPS crashes, hangs or is killed there, that is an error like any other.
    """
    begin = time.perf_counter()
    result: Result = child.call(lammps.run, scene, record, time_limit=lammps.time_limit)
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
        with engine.engine() as lammps:
            version = engine.version_of(lammps)
            command(lammps, deck.set_up(scene, self.pair_style, version) + engine.COMMANDS)
            seen.begin(engine.granules(lammps))
            before = None
            for number, (leg, stride) in enumerate(zip(legs, strides, strict=True)):
                command(
                    lammps, "\n".join([*deck.leg_commands(scene, leg, before), dialect.NO_STEP])
                )
                before = leg
                for block in self._read(lammps, leg, stride, scene):
                    seen.update(number, *block)
            return version

    def _read(
        self, lammps: Instance, leg: Leg, stride: int, scene: Scene
    ) -> Iterator[tuple[FloatArray, FloatArray, FloatArray | None]]:
        """Run a leg; yield times, arrays and forces on a wall in blocks that share one reading."""
        steps, times = stops(leg, stride), reading_times(leg, stride)
        states, wall = [engine.read(lammps, scene.bodies)], [engine.wall_force(lammps, scene)]
        for first in range(0, times.size - 1, BLOCK):
            for done, stop in itertools.pairwise(steps[first : first + BLOCK + 1]):
                engine.one_command(lammps, dialect.go_on(stop - done))
                if self.deadline.left < 0:
                    raise self.deadline.passed()
                states.append(engine.read(lammps, scene.bodies))
                wall.append(engine.wall_force(lammps, scene))
            time = times[first : first + len(states)]
            yield time, np.array(states)[..., 0], None if scene.wall is None else np.array(wall)
            states, wall = states[-1:], wall[-1:]


@dataclass(frozen=True)
class Binary:
    """Runs scenes by a LAMMPS binary, which writes dumps with all digits."""

    pair_style: str
    deadline: Deadline
    program: Program

    def run(
        self, scene: Scene, legs: Sequence[Leg], strides: Sequence[int], seen: Observation
    ) -> str:
        """Run the deck of a scene, which dumps its state at the given interval of steps."""
        columns = _COLUMNS if scene.wall is None else (*_COLUMNS, dialect.WALL_FORCE)
        version = self.program.build.version
        lines = [deck.set_up(scene, self.pair_style, version) + engine.COMMANDS]
        lines.append(dialect.write_dump(_REST, _AT_REST))
        before = None
        for number, (leg, stride) in enumerate(zip(legs, strides, strict=True)):
            # Cut as for the module, so that times are the same sums.
            write = dialect.write_dump(f"{number}.dump", columns, append=True)
            go = f'{dialect.go_on(leg.steps)} every {stride} "{write}"'
            lines += [*deck.leg_commands(scene, leg, before), dialect.NO_STEP, write, go]
            before = leg
        with work_folder("LAMMPS") as folder:
            _refuse_dumps(observation.count_readings(legs, strides), scene.bodies, folder)
            self.program.run("\n".join(lines), folder, self.deadline)
            position, mass, radius = read_frames(folder / _REST, _AT_REST)[1][0]
            seen.begin(observation.Granules(position, mass, 2 * radius))
            for number, (leg, stride) in enumerate(zip(legs, strides, strict=True)):
                dump = folder / f"{number}.dump"
                for reached, arrays in self._read(dump, leg, stride, columns):
                    # The force of the wall on the last granule, not of the granule on the wall.
                    wall = None if scene.wall is None else -arrays[:, -1, -1]
                    seen.update(number, reached, arrays[:, : len(_COLUMNS)], wall)
        return version

    def _read(
        self, path: Path, leg: Leg, stride: int, columns: tuple[str, ...]
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Yield times and arrays of readings dumped on a leg, in blocks that share one reading."""
        steps, times = np.array(stops(leg, stride)), reading_times(leg, stride)
        first, at, last = None, 0, None
        for step, values in read_blocks(path, columns, BLOCK):
            if self.deadline.left < 0:
                raise self.deadline.passed()
            first = step[0] if first is None else first
            if not np.array_equal(step - first, steps[at : at + len(step)]):
                break
            arrays = values if last is None else np.concatenate([last[np.newaxis], values])
            begin, at, last = max(at - 1, 0), at + len(step), values[-1]
            if len(arrays) > 1:
                yield times[begin:at], arrays
        if at != len(steps):
            raise RunFailed(
                f"{path.name}: LAMMPS has left out states of the run: is the disk full?"
            )


def _refuse_dumps(frames: int, granules: int, folder: Path) -> None:
    """Refuse a run whose dumps would not fit."""
    # A number has 24 bytes with all digits in a dump, -1.2345678901234567e-05 and a space; the
    # other lines of a frame have 200 bytes
    needed = frames * (200.0 + 3.3 * 24.0 * granules)
    # Most bytes of all dumps (chosen), as they are in a temporary folder
    free, most = shutil.disk_usage(folder).free, 8e9
    if needed > min(most, free):
        raise TooExpensive(
            f"the states of this run would take about {needed / 1e9:.2g} GB in {folder.parent},"
            f" which has {free / 1e9:.2g} GB free, and {most / 1e9:.0f} GB is the most:"
            " shorten chain or end_time, ask for less accuracy, or take the lammps module, which"
            " needs no files"
        )
