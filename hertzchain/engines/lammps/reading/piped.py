"""A LAMMPS binary that gets the commands of a deck through a pipe."""

from __future__ import annotations

import os
import pty
import secrets
import subprocess
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.dumps import read_blocks
from hertzchain.engines.lammps.dialect import is_out_of_memory, not_enough_memory, write_dump
from hertzchain.engines.lammps.engine import forget_shared_memory
from hertzchain.engines.lammps.reading.hooks import (
    BLOCK,
    GranulesChanged,
    Hooks,
    Readings,
    not_of_the_deck,
)
from hertzchain.engines.lammps.reading.session import Session
from hertzchain.errors import BackendMissing, RunFailed

_NEXT = "hertzchain_next"  # the dump of a run, and the variable that says when it is written
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
        super().__init__(folder, version)
        self._done = secrets.token_hex()  # what it prints after a command; no deck can know it
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

    def close(self) -> None:
        """Kill the program."""
        self._process.kill()
        self._process.wait()
        forget_shared_memory(self._process.pid)
        for stream in (self._process.stdin, self._lines):
            assert stream is not None
            with suppress(OSError):
                stream.close()

    def give(self, *commands: str) -> None:
        """Give it commands, each of which is one line."""
        process = self._process
        assert process.stdin is not None
        said = ""
        with suppress(OSError):  # it has ended: its output has the reason
            process.stdin.write("\n".join([*commands, f"print {self._done}\n"]))
            process.stdin.flush()
        with suppress(OSError):  # a terminal reports in this way that the program is gone
            for line in self._lines:
                if line.rstrip() == self._done:
                    return
                said = (said + line)[-_KEPT:]
        raise _failure(said, process.wait())

    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""
        parts = {"x": ("x", "y", "z"), "v": ("vx", "vy", "vz")}
        lines = []
        for k, number in enumerate(self.dumped("id")[0]):
            words = [f"set atom {number:.0f}"]
            for name, values in arrays.items():
                row = [f"{value!r}" for value in values[k].tolist()]
                if name == "omega":
                    words.append(" ".join(["omega", *row]))
                else:
                    words += map(" ".join, zip(parts[name], row, strict=True))
            lines.append(" ".join(words))
        self.give(*lines)

    def hooks(self) -> Hooks:
        """Return hooks, without any sources yet."""
        return StoredForces(self)


_KEPT = 4096  # characters of its output that are kept


def _failure(said: str, status: int) -> RunFailed:
    """Return why LAMMPS has ended, from its last output."""
    if is_out_of_memory(said):
        return not_enough_memory()
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    errors = [line for line in lines if "ERROR" in line]
    reason = (errors or lines or [f"it ended with status {status}"])[0 if errors else -1]
    return RunFailed(f"LAMMPS stopped: {reason}")


class StoredForces(Hooks):
    """Forces that ``fix store/force`` keeps, in a dump that is written during the deck's own runs.

    With ``twice`` readings are a prime number of steps apart, as the period of an intermittent
    force is usually a round number.
    """

    def __init__(self, lammps: Piped) -> None:
        super().__init__(lammps.give, "store/force")
        self._lammps = lammps

    def run(self, text: str, steps: int, stride: int, take: Callable[[Readings], None]) -> None:
        """Give LAMMPS a ``run`` and read its start, every ``stride``-th step and its end."""
        lammps = self._lammps
        stride = _prime(stride) if self.twice else stride
        count, first = lammps.count(), lammps.step()
        columns = (*_READ, *(f"f_{name}[{k}]" for name in self._names for k in (1, 2, 3)))
        path = lammps.folder / "hertzchain.run"
        path.unlink(missing_ok=True)
        # LAMMPS of 2021 needs a next step after the last one, too.
        steps_of_dump = f"stride({first},{first + steps + stride},{stride})"
        with not_of_the_deck():
            lammps.give(f"variable {_NEXT} equal {steps_of_dump}")
            lammps.give(f"dump {_NEXT} all custom 1 {path.name} id {' '.join(columns)}")
            lammps.give(f"dump_modify {_NEXT} every v_{_NEXT} first yes sort id format float %.17g")
        with not_of_the_deck(" dump "):  # a deck's own dumps are left out
            lammps.give(text.replace(" pre no", ""))  # a dump is set up before a run
        lammps.give(f"undump {_NEXT}")
        if (lammps.step() - first) % stride:
            lammps.give(write_dump(path.name, columns, append=True))
        ids = lammps.dumped("id")[0].astype(np.int64)
        if ids.size != count:
            raise GranulesChanged
        for step, values in read_blocks(path, columns, BLOCK):
            if values.shape[2] != count:
                raise GranulesChanged
            parts = np.moveaxis(values.reshape(len(step), -1, 3, count), 3, 2)
            take(
                Readings(
                    step=step.astype(np.int64),
                    half=np.zeros(len(step), bool),
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
