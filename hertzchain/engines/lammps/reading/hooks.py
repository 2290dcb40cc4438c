"""Forces before and after each fix of a deck, read while LAMMPS runs.

A fix of ours before all fixes of the deck reads the forces of contacts alone; one after each fix
reads the force that this fix has added.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.dialect import not_of_the_deck
from hertzchain.engines.lammps.engine import one_command
from hertzchain.errors import RunFailed

BLOCK = 256  # readings passed on together
_NEVER = 1_000_000_000  # steps between two additions of the fix's own force, which is none
_NOWHERE = 2**63  # above any step
_DOUBLES = ctypes.POINTER(ctypes.POINTER(ctypes.c_double))


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings of some steps, granules in the order of their ids, in the deck's units.

    ``ids`` is of shape (readings, granules), ``position``, ``velocity`` and ``torque`` (readings,
    granules, 3), ``force`` (readings, hooks, granules, 3): the sum of forces up to each hook. With
    ``half``, velocities are those of the half step before.
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


class Hooks(ABC):
    """Fixes of ours in a LAMMPS, between those of a deck.

    ``sources`` has the index of the deck's command before each hook, None for the first.
    ``stride`` is the number of steps between two readings; the function that takes readings may
    change it. ``twice`` also detects a force that comes and goes in step with the readings.
    """

    def __init__(self, give: Callable[[str], None], style: str) -> None:
        self._give, self._style = give, style
        self.sources: list[int | None] = []
        self._names: list[str] = []
        self._made = 0
        self.stride, self.twice = 1, False

    def add(self, source: int | None) -> str:
        """Read forces after the present fixes; return the name of the hook."""
        name = f"hertzchain{self._made}"
        self._made += 1
        with not_of_the_deck("fix style"):  # others are for want of a box, as the deck's own
            self._give(f"fix {name} all {self._style}")
        self._names.append(name)
        self.sources.append(source)
        return name

    def remove(self, source: int) -> None:
        """Stop reading forces after the fix of that command, if there is a hook."""
        if source in self.sources:
            place = self.sources.index(source)
            self.sources.pop(place)
            self._give(f"unfix {self._names.pop(place)}")

    @abstractmethod
    def run(self, text: str, steps: int, stride: int, take: Callable[[Readings], None]) -> None:
        """Give LAMMPS a ``run`` and read its start, every ``stride``-th step and its end."""


class Callbacks(Hooks):
    """Functions that ``fix external`` of the Python module calls where forces are summed.

    The deck's own ``run`` is unchanged, so that all its times and steps hold. With
    ``twice`` the step after each reading is read, too.
    """

    def __init__(self, lammps: Any) -> None:
        super().__init__(lambda text: one_command(lammps, text), f"external pf/callback 1 {_NEVER}")
        self._lammps = lammps
        self._functions: list[Any] = []  # kept, as LAMMPS only has their addresses
        self._extract = lammps.lib["lammps_extract_atom"]  # a function of its own: types stay
        self._extract.argtypes, self._extract.restype = [ctypes.c_void_p, ctypes.c_char_p], _DOUBLES
        self._problem: BaseException | None = None
        self._next, self._stop = _NOWHERE, 0  # nothing is read outside of ``run``
        self._reading = self._again = False
        self._take: Callable[[Readings], None] = lambda _: None

    def add(self, source: int | None) -> str:
        """Have a function called after the present fixes."""
        name = super().add(source)

        def call(_: Any, step: int, granules: int, ids: Any, place: Any, added: Any) -> None:
            self._call(self._names.index(name), step, granules, ids, place, added)

        function = self._lammps.FIX_EXTERNAL_CALLBACK_FUNC(call)
        self._lammps.lib.lammps_set_fix_external_callback(
            self._lammps.lmp, name.encode(), function, None
        )
        self._functions.append(function)
        return name

    def run(self, text: str, steps: int, stride: int, take: Callable[[Readings], None]) -> None:
        """Give LAMMPS a ``run`` and read its start, every ``stride``-th step and its end."""
        granules = int(self._lammps.extract_setting("nlocal"))
        rows, arrays = min(BLOCK, steps // stride + 3), 3 + len(self.sources)
        self._step = np.zeros(rows, np.int64)
        self._ids = np.zeros((rows, granules), np.int64 if self._wide else np.int32)
        # Position, velocity, torque, then forces.
        self._arrays, self._rows = np.zeros((rows, arrays, granules, 3)), 0
        self._first = self._next = int(self._lammps.extract_global("ntimestep"))
        self._stop, self.stride, self._take = self._first + steps, stride, take
        if "pre no" in text:  # no forces are computed at its start
            self._next = min(self._first + stride, self._stop)
        self._reading, self._again, self._problem = False, False, None
        try:
            self._give(text)
        except Exception:
            if self._problem is None:
                raise
        self._hand_on()
        self._next = _NOWHERE
        if self._problem is not None:
            raise self._problem

    @property
    def _wide(self) -> bool:
        return bool(self._lammps.extract_setting("tagint") == ctypes.sizeof(ctypes.c_int64))

    def _call(
        self, number: int, step: int, granules: int, ids: Any, place: Any, added: Any
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

    def _copy(self, number: int, step: int, granules: int, ids: Any, place: Any) -> None:
        row, size = self._arrays[self._rows], 24 * granules
        if size != row[0].nbytes:
            raise GranulesChanged
        if number == 0:
            self._reading = True
            self._step[self._rows] = step
            own = self._ids[self._rows]
            ctypes.memmove(own.ctypes.data, ids, own.nbytes)
            ctypes.memmove(row[0].ctypes.data, place[0], size)
            ctypes.memmove(row[1].ctypes.data, self._array(b"v"), size)
            ctypes.memmove(row[2].ctypes.data, self._array(b"torque"), size)
        ctypes.memmove(row[3 + number].ctypes.data, self._array(b"f"), size)
        if number == len(self.sources) - 1:
            self._reading = False
            pace = 1 if self.twice and not self._again else self.stride
            self._again = not self._again
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
        self._take(
            Readings(
                step=step,
                half=step != self._first,
                ids=np.take_along_axis(ids, order, axis=1).astype(np.int64),
                position=arrays[:, 0],
                velocity=arrays[:, 1],
                torque=arrays[:, 2],
                force=arrays[:, 3:],
            )
        )


class GranulesChanged(RunFailed):
    """The number of granules is not what it was when the run began."""

    def __init__(self, problem: str = "granules leave the box") -> None:
        super().__init__(problem)
