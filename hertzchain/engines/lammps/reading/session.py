"""A LAMMPS that gets the commands of a deck one by one, with hooks between its fixes.

It is the Python module, or a binary (``piped``), and is queried between commands.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.dumps import read_frames
from hertzchain.engines.lammps.dialect import write_dump
from hertzchain.engines.lammps.engine import one_command, version_of
from hertzchain.engines.lammps.reading.allowed import MOVES, QUIET
from hertzchain.engines.lammps.reading.hooks import Callbacks, Hooks
from hertzchain.engines.lammps.reading.text import after_quotes, closed, command_of
from hertzchain.errors import RunFailed

_CONDITION = "hertzchain_holds"  # the variable that says whether a condition holds
_INSIDE = "hertzchain_inside"  # the variable that says which granules are in a group
_STATE = (
    "id", "type", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz", "radius", "mass",
)  # fmt: skip
_VALUE = re.compile(r"\$(?:(?P<name>\w|\{\w+\})|(?=\())")


class Granular(NamedTuple):
    """Granules in the order of their ids, in the deck's units."""

    ids: NDArray[np.int64]
    types: NDArray[np.int64]
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    radius: FloatArray
    mass: FloatArray


class Session(ABC):
    """A LAMMPS that is queried while it reads a deck; arrays are in the order of ids.

    LAMMPS prints the values of variables and formulas: most queries read such a text. The answers
    are files in a folder.
    """

    def __init__(self, folder: Path, version: str) -> None:
        self.folder, self.version = folder, version

    @abstractmethod
    def give(self, text: str) -> None:
        """Give it a command, which is one line."""

    @abstractmethod
    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""

    @abstractmethod
    def hooks(self) -> Hooks:
        """Return hooks, without any sources yet."""

    def printed(self, text: str) -> str:
        """Return a text as LAMMPS prints it."""
        said = self.folder / "hertzchain.said"
        self.give(command_of(("print", text, "file", str(said))))
        return said.read_text(errors="replace").rstrip("\n")

    def system(self) -> tuple[str, list[str]]:
        """The name of the units, and the boundary along each axis."""
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
        """Columns of all granules."""
        path = self.folder / "hertzchain.dump"
        self.give(write_dump(command_of([str(path)]), columns))
        return list(read_frames(path, columns)[1][0])

    def atoms(self) -> Granular:
        """Return the present granules."""
        numbers, types, *found, radius, mass = self.dumped(*_STATE)
        place, velocity, spin = (np.column_stack(found[k : k + 3]) for k in (0, 3, 6))
        return Granular(
            numbers.astype(np.int64), types.astype(np.int64), place, velocity, spin, radius, mass
        )

    def members(self, group: str) -> NDArray[np.bool_]:
        """Tell which granules are in a group."""
        self.give(command_of(("variable", _INSIDE, "atom", f"gmask({group})")))
        return np.asarray(self.dumped(f"v_{_INSIDE}")[0] != 0)

    def expanded(self, text: str) -> str:
        """Return a command with the values of variables outside quotes."""
        found, k = "", 0
        while k < len(text):
            match, end = _VALUE.match(text, k), k + 1
            if text[k] in "\"'":
                end = after_quotes(text, k)
            elif match is not None:
                over = match.end() if match["name"] else closed(text, end)
                if over is None:
                    raise RunFailed(f"a bracket is not closed: {text[k:]}")
                end = over
            found += text[k:end] if match is None else self.printed(text[k:end])
            k = end
        return found

    def holds(self, condition: str) -> bool:
        """Whether the condition of an ``if`` holds."""
        yes, no = (f"variable {_CONDITION} string {value}" for value in ("yes", "no"))
        self.give(command_of(("if", condition, "then", yes, "else", no)))
        return self.printed(f"${{{_CONDITION}}}") == "yes"

    def has_variable(self, name: str) -> bool:
        """Whether there is a variable."""
        return self.printed(f"$(is_defined(variable,{name}))") == "1"

    def step(self) -> int:
        """The number of the step."""
        return int(self._number("step"))

    def dt(self) -> float:
        """The time step."""
        return self._number("dt")

    def count(self) -> int:
        """The number of granules."""
        return int(self._number("count(all)"))

    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the box."""
        low, high = (np.array([self._number(axis + end) for axis in "xyz"]) for end in ("lo", "hi"))
        return low, high

    def _number(self, formula: str) -> float:
        return float(self.printed(f"$({formula}:%.17g)"))


class Module(Session):
    """LAMMPS's Python module in this process."""

    def __init__(self, lammps: Any, folder: Path) -> None:
        super().__init__(folder, version_of(lammps))
        self.lammps = lammps

    def give(self, text: str) -> None:
        """Give it a command."""
        one_command(self.lammps, text)

    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""
        extract = self.lammps.numpy.extract_atom
        order = np.argsort(extract("id")[: int(self.lammps.extract_setting("nlocal"))])
        for name, values in arrays.items():
            extract(name)[order] = values

    def hooks(self) -> Hooks:
        """Return hooks, without any sources yet."""
        return Callbacks(self.lammps)


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
        """Whether it moves granules."""
        return self.style in MOVES

    @property
    def is_wall(self) -> bool:
        """Whether its force is that of a wall."""
        return self.style.startswith("wall/")


@dataclass
class Stage:
    """A LAMMPS that gets the commands of a deck.

    ``fixes`` are all that the deck has made, by the index of their command; ``alive`` those that
    act now, by their id.
    """

    lammps: Session
    fixes: dict[int, DeckFix] = field(default_factory=dict)
    alive: dict[str, DeckFix] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.hooks = self.lammps.hooks()

    def give(self, words: list[str], index: int) -> None:
        """Give LAMMPS a command, by its words."""
        name = words[0]
        if name == "fix" and not self.hooks.sources:
            self.hooks.add(None)
        self.lammps.give(command_of(words))
        if name == "fix":
            made = DeckFix(words[1], words[2], words[3], index, tuple(words[4:]))
            again = self.alive.get(made.name)
            self.alive[made.name] = self.fixes[index] = made
            if made.style in QUIET:
                return
            if again is None or again.style in QUIET:
                self.hooks.add(index)
            else:  # it takes the place of the earlier one
                place = self.hooks.sources.index(again.command)
                self.hooks.sources[place] = index
        elif name == "unfix" and len(words) > 1:
            gone = self.alive.pop(words[1], None)
            if gone is not None:
                self.hooks.remove(gone.command)

    def ready(self) -> None:
        """Make a hook, unless there is one."""
        if not self.hooks.sources:
            self.hooks.add(None)

    def velocities_of_ghosts(self) -> None:
        """Switch on velocities of ghosts, which damping needs: without them LAMMPS would stop."""
        self.lammps.give("comm_modify vel yes")

    def forget(self) -> None:
        """Forget all that ``clear`` deletes."""
        self.lammps.give("clear")
        self.hooks = self.lammps.hooks()
        self.fixes.clear()
        self.alive.clear()
