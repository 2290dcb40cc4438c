"""A LAMMPS binary that gets the commands of a deck through a pipe and answers in files."""

from __future__ import annotations

import os
import pty
import re
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.dumps import read_blocks, read_frames
from hertzchain.engines.lammps.dialect import is_out_of_memory, not_enough_memory, write_dump
from hertzchain.engines.lammps.engine import forget_shared_memory
from hertzchain.engines.lammps.reading.hooks import BLOCK, GranulesChanged, Hooks, Readings
from hertzchain.engines.lammps.reading.session import Session
from hertzchain.errors import BackendMissing, RunFailed

_MARK = "hertzchain:"  # begins a line of answers
_MASK = "hertzchain_inside"
_DUMP = "hertzchain.dump"
_STATE = ("type", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz", "radius", "mass")
_READ = ("x", "y", "z", "vx", "vy", "vz", "tqx", "tqy", "tqz")


class Piped(Session):
    """A LAMMPS binary.

    Parameters
    ----------
    program
        The binary.
    version
        Its version, year month day.
    folder
        Where it runs and leaves its files.
    """

    def __init__(self, program: str, version: str, folder: Path) -> None:
        self.version, self.folder = version, folder
        self._said = ""  # all that it said before its last answer
        # A terminal: LAMMPS of 2021 to 2023 keeps what it says until a pipe is full, and later ones
        # have an option for that.
        terminal, its_end = pty.openpty()
        try:
            self._process = subprocess.Popen(  # noqa: S603 - the user's
                [program, "-log", "none", "-nocite"],
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=its_end,
                stderr=its_end,
                text=True,
            )
        except OSError as problem:
            os.close(terminal)
            raise BackendMissing(f"{program} cannot be started ({problem.strerror})") from None
        finally:
            os.close(its_end)
        self._lines = os.fdopen(terminal, errors="replace")

    def end(self) -> None:
        """Kill it."""
        self._process.kill()
        self._process.wait()
        forget_shared_memory(self._process.pid)
        for stream in (self._process.stdin, self._lines):
            assert stream is not None
            with suppress(OSError):
                stream.close()

    def give(self, text: str) -> None:
        """Give it a command."""
        self._ask(text, "done")

    def printed(self, text: str) -> str:
        """How it prints a text."""
        return self._ask(None, text)

    def units(self) -> str:
        """The name of the units."""
        return self._system(r"Units\s*=\s*(\S+)")

    def periodic(self) -> list[bool]:
        """Along which axes the box is periodic."""
        sides = self._system(r"Boundaries\s*=\s*(\S+ \S+ \S+)").split()
        return [side == "p,p" for side in sides]

    def atoms(self) -> Mapping[str, Any]:
        """Arrays of granules in the order of their ids."""
        found = self._dump(("id", *_STATE))
        whole = {name: found[name].astype(np.int64) for name in ("id", "type")}
        vectors = {
            name: np.column_stack([found[part] for part in parts])
            for name, parts in (("x", _STATE[1:4]), ("v", _STATE[4:7]), ("omega", _STATE[7:10]))
        }
        return {**whole, **vectors, "radius": found["radius"], "mass": found["mass"]}

    def members(self, group: str) -> NDArray[np.bool_]:
        """Which granules are in a group."""
        self._ask(f"variable {_MASK} atom gmask({group})", "done")
        return np.asarray(self._dump((f"v_{_MASK}",))[f"v_{_MASK}"] != 0)

    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""
        ids = self._dump(("id",))["id"].astype(np.int64)
        parts = {"x": ("x", "y", "z"), "v": ("vx", "vy", "vz")}
        lines = []
        for k, number in enumerate(ids):
            words = [f"set atom {number}"]
            for name, values in arrays.items():
                row = [f"{value!r}" for value in values[k].tolist()]
                if name == "omega":
                    words.append(" ".join(["omega", *row]))
                else:
                    words += map(" ".join, zip(parts[name], row, strict=True))
            lines.append(" ".join(words))
        self._ask("\n".join(lines), "done")

    def hooks(self) -> Hooks:
        """Hooks, of which there are none yet."""
        return StoredForces(self)

    def _system(self, pattern: str) -> str:
        """What it says of its system, as a restart file may have it."""
        self._ask("info system", "done")
        found = re.search(pattern, self._said)
        if found is None:
            raise RunFailed("LAMMPS does not say what its system is: take another version")
        return found[1]

    def _dump(self, columns: tuple[str, ...]) -> dict[str, FloatArray]:
        """Columns of all granules, in the order of their ids."""
        path = self.folder / _DUMP
        self._ask(write_dump(str(path), columns), "done")
        values = read_frames(path, columns)[1][0]
        return dict(zip(columns, values, strict=True))

    def _ask(self, commands: str | None, answer: str) -> str:
        """Give it commands; how it prints a text then."""
        process = self._process
        assert process.stdin is not None
        lines = [commands] if commands else []
        self._said = ""
        with suppress(OSError):  # it has ended: what it said says why
            process.stdin.write("\n".join([*lines, f'print "{_MARK}{answer}"', ""]))
            process.stdin.flush()
        with suppress(OSError):  # how a terminal says that nobody is there any more
            for line in self._lines:
                if line.startswith(_MARK):
                    return line[len(_MARK) :].rstrip("\r\n")
                self._said = (self._said + line)[-_KEPT:]
        raise _failure(self._said, process.wait())


_KEPT = 4096  # characters of what it says that are kept


def _failure(said: str, status: int) -> RunFailed:
    """Why LAMMPS has ended, from what it said last."""
    if is_out_of_memory(said):
        return not_enough_memory()
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    errors = [line for line in lines if "ERROR" in line]
    reason = (errors or lines or [f"it ended with status {status}"])[0 if errors else -1]
    return RunFailed(f"LAMMPS stopped: {reason}")


class StoredForces(Hooks):
    """Forces that ``fix store/force`` keeps; the deck's runs are cut where they are read.

    With ``twice`` readings are a prime number of steps apart: the period of a force that comes and
    goes is a round one.
    """

    def __init__(self, lammps: Piped) -> None:
        super().__init__(lammps.give, "store/force")
        self._lammps = lammps

    def run(self, text: str, steps: int, stride: int, take: Callable[[Readings], None]) -> None:
        """Give LAMMPS a ``run`` and read its start, every ``stride``-th step and its end."""
        lammps = self._lammps
        stride = _prime(stride) if self.twice else stride
        keywords = text.split()[2:]
        kept = " ".join(
            f"{name} {value}"
            for name, value in zip(keywords[::2], keywords[1::2], strict=True)
            if name in ("start", "stop")
        )
        count, first = lammps.count(), lammps.step()
        columns = (*_READ, *(f"f_{name}[{k}]" for name in self._names for k in (1, 2, 3)))
        path = lammps.folder / "hertzchain.run"
        path.unlink(missing_ok=True)
        write = write_dump(str(path), columns, append=True)
        ahead = kept or f"start {first} stop {first + steps}"
        lammps.give(f"run 0 {' '.join(keywords)}".strip())
        lammps.give(write)
        if steps:
            lammps.give(f'run {steps} pre no post no {ahead} every {stride} "{write}"')
        ids = np.sort(lammps.atoms()["id"])
        if ids.size != count:
            raise GranulesChanged
        for step, values in read_blocks(path, columns, BLOCK):
            if values.shape[2] != count:
                raise GranulesChanged
            parts = np.moveaxis(values.reshape(len(step), -1, 3, count), 3, 2)
            late = step != first
            take(
                Readings(
                    step=step.astype(np.int64),
                    half=np.zeros(len(step), bool),
                    late=late,
                    ids=np.broadcast_to(ids, (len(step), count)),
                    position=parts[:, 0],
                    velocity=parts[:, 1],
                    torque=parts[:, 2],
                    force=parts[:, 3:],
                )
            )


def _prime(number: int) -> int:
    """The largest prime from 7 on that is not above a number, else 1."""
    for candidate in range(number, 6, -1):
        if all(candidate % k for k in range(2, int(candidate**0.5) + 1)):
            return candidate
    return 1


@contextmanager
def piped(program: str, version: str, folder: Path) -> Iterator[Piped]:
    """A session with a LAMMPS binary."""
    session = Piped(program, version, folder)
    try:
        yield session
    finally:
        session.end()
