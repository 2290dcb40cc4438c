"""What LAMMPS makes of somebody's deck without taking a step: granules, forces over time, contacts.

Runs are skipped: the clock is set on, so that formulas of forces have the values that they will
have. No scene is needed.
"""

from __future__ import annotations

import contextlib
import ctypes
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.program import work_folder
from hertzchain.engines.lammps.isolation import Child
from hertzchain.engines.lammps.reading.found import Executed, FoundRun
from hertzchain.engines.lammps.reading.granules import Granules, granules_of
from hertzchain.engines.lammps.reading.interpreter import Interpreter
from hertzchain.engines.lammps.reading.prober import Sizes
from hertzchain.engines.lammps.reading.probing import Probes
from hertzchain.engines.lammps.reading.reading import Source, Start, probed
from hertzchain.engines.lammps.reading.session import Module, Stage
from hertzchain.errors import HertzchainError, RunFailed

_READINGS, _ALL_READINGS = 400, 4000
"""Readings of a force in one run, and in all runs (chosen: a pulse of three levels shows)."""

_MOST_GRANULES = 2000  # whose contacts are asked (chosen)


@dataclass(eq=False)
class Pushing:
    """A ``fix addforce``, in the deck's units."""

    command: int  # index of that which made it
    granules: int  # how many it pushes
    components: tuple[str, ...]  # as the command has them
    unfix: int | None = None  # index of the command that ended it; None where none did
    runs: list[int] = field(default_factory=list)  # numbers of those during which it acted
    readings: list[list[float | None]] = field(default_factory=list)
    """Components during these runs; None for one that is not known without a step."""

    @property
    def force(self) -> FloatArray | None:
        """The force at all readings, shape (readings, 3); None where it is not known."""
        force = np.array(self.readings, np.float64).reshape(-1, 3)  # NaN for None
        return None if np.any(np.isnan(force)) else force


@dataclass(frozen=True, eq=False)
class Look:
    """What LAMMPS makes of a deck."""

    commands: tuple[Executed, ...]  # as they were carried out, up to where LAMMPS stopped
    stopped: str  # why it did; empty where the deck was read to its end
    granules: Granules | None  # before the first run; None where there are none
    runs: tuple[FoundRun, ...]  # of at least one step, which were skipped
    pushes: tuple[Pushing, ...]
    stiffness: FloatArray | None = None  # A in F = A d^p of each contact, shape (contacts,)
    exponent: FloatArray | None = None  # p; None where they are not known


def look(path: Path, variables: Mapping[str, str], time_limit: float) -> Look:
    """Have LAMMPS look at a deck in a process of its own.

    Raises BackendMissing without a LAMMPS module, RunFailed if it crashes, TooExpensive if it is
    not done in time [s].
    """
    with work_folder("LAMMPS") as folder, Child() as child:
        found: Look = child.call(
            looked, Start(folder, None), path, Path.cwd(), dict(variables), time_limit=time_limit
        )
    return found


def looked(start: Start, path: Path, folder: Path, variables: Mapping[str, str]) -> Look:
    """The same in this process."""
    whole = path if path.is_absolute() else folder / path
    with start.session() as lammps:
        assert isinstance(lammps, Module)
        looker = _Looker(Stage(lammps), lammps)
        script = Interpreter(lammps, str(path), whole, variables, looker, folder=folder)
        stopped = ""
        try:
            script.play()
        except HertzchainError as problem:
            stopped = str(problem)
        found = Look(
            tuple(script.commands),
            stopped,
            looker.granules,
            tuple(looker.runs),
            tuple(looker.pushes),
        )
    granules = found.granules
    if granules is None or not 1 < granules.count <= _MOST_GRANULES or not granules.is_chain:
        return found
    with contextlib.suppress(RunFailed):
        probes, _ = probed(start, Source(str(path), whole, folder, variables), Sizes())
        if probes.why_not is None:
            stiffness, exponent = _law(probes)
            return replace(found, stiffness=stiffness, exponent=exponent)
    return found


def _law(probes: Probes) -> tuple[FloatArray, FloatArray]:
    """A and p in F = A d^p of each contact, by its two largest overlaps."""
    with np.errstate(all="ignore"):  # NaN where a contact has no force
        force, overlap = (np.log(each[-2:]) for each in (probes.contact_force, probes.overlap))
        exponent = np.diff(force, axis=0)[0] / np.diff(overlap, axis=0)[0]
        return np.exp(force[-1] - exponent * overlap[-1]), exponent


class _Looker:
    """Plays a deck without its runs."""

    def __init__(self, stage: Stage, lammps: Module) -> None:
        self._stage, self._lammps = stage, lammps
        self.granules: Granules | None = None
        self.runs: list[FoundRun] = []
        self.pushes: list[Pushing] = []
        self._acting: dict[str, Pushing] = {}  # by the names of fixes
        self._left = _ALL_READINGS
        self._texts: dict[str, str] = {}  # of the formulas of variables

    def give(self, text: str, words: list[str], index: int) -> None:
        """Give LAMMPS a command, but for one that moves granules."""
        if words[0] == "minimize":
            return
        self._stage.give(text, words, index)
        if words[0] == "variable" and len(words) > 3:
            self._texts[words[1]] = " ".join(words[3:])
        elif words[0] in ("fix", "unfix") and len(words) > 1:
            if (ended := self._acting.pop(words[1], None)) is not None:
                ended.unfix = index
            if words[3:4] == ["addforce"]:
                group, components = words[2], tuple(words[4:7])
                pushed = self._lammps.members(group)
                for word in components:
                    each = self._each(word, group)
                    pushed = pushed if each is None else pushed & (each != 0)
                push = Pushing(index, int(np.count_nonzero(pushed)), components)
                self.pushes.append(push)
                self._acting[words[1]] = push

    def _each(self, word: str, group: str) -> FloatArray | None:
        """Values of an atom-style variable; None for any other word."""
        name = word[2:]
        if not word.startswith("v_") or self._style(name) != "atom":
            return None
        value = self._lammps.lammps.extract_variable(name, group)
        return None if value is None else np.asarray(value)[np.argsort(self._ids())]

    def _ids(self) -> FloatArray:
        return np.asarray(self._lammps.lammps.numpy.extract_atom("id")[: self._lammps.count()])

    def _style(self, name: str) -> str:
        """The style of a variable, of those that forces may follow."""
        lammps = self._lammps.lammps
        if name not in lammps.available_ids("variable"):
            return ""  # it may be made before the run
        kind = lammps.lib.lammps_extract_variable_datatype(lammps.lmp, name.encode())
        return {0: "equal", 1: "atom"}.get(int(kind), "")

    def run(self, steps: int, keywords: str, index: int) -> None:
        """Set the clock on over a run, and read the forces."""
        if not steps:
            self._lammps.give(f"run 0 {keywords}".strip())
            return
        if self.granules is None:
            self.granules = granules_of(self._lammps, self._stage.boundary)
        first, dt = self._lammps.step(), self._lammps.dt()
        began = self._time(dt)
        self.runs.append(FoundRun(began, dt, steps, index))
        count = min(steps, _READINGS, max(2, self._left))
        self._left -= count
        for push in self._acting.values():
            push.runs.append(len(self.runs) - 1)
        for step in np.unique(np.linspace(0, steps, count + 1).astype(int)).tolist():
            self._set_clock(first + step, began + step * dt)
            for push in self._acting.values():
                push.readings.append([self._value(word) for word in push.components])

    def _time(self, dt: float) -> float:
        """What ``time`` is now, whatever the deck has done to its clock."""
        step, then, time = self._clock()
        return float(time.value + (step.value - then.value) * dt)

    def _set_clock(self, step: int, time: float) -> None:
        """Set ``step`` and ``time``; ``reset_timestep`` refuses where a fix follows them."""
        for place, value in zip(self._clock(), (step, step, time), strict=True):
            place.value = value

    def _clock(self) -> tuple[Any, Any, Any]:
        """LAMMPS's step, and a step with its time, from which ``time`` is counted."""
        lammps = self._lammps.lammps
        extract = lammps.lib["lammps_extract_global"]  # a function of its own: types stay
        extract.argtypes, extract.restype = [ctypes.c_void_p, ctypes.c_char_p], ctypes.c_void_p
        step, then = (
            ctypes.c_int64.from_address(extract(lammps.lmp, name))
            for name in (b"ntimestep", b"atimestep")
        )
        return step, then, ctypes.c_double.from_address(extract(lammps.lmp, b"atime"))

    def _value(self, word: str) -> float | None:
        """A component of a force now; None where it is not known without a step."""
        if word == "NULL":
            return 0.0
        if not word.startswith("v_"):
            return float(word)
        if word[2:] not in self._lammps.lammps.available_ids("variable"):
            raise RunFailed(f"variable {word[2:]} of a force does not exist when the run begins")
        if self._style(word[2:]) != "equal" or self._follows_runs(word, 0):
            return None
        try:
            return float(self._lammps.lammps.extract_variable(word[2:]))
        except Exception as problem:  # a formula that LAMMPS cannot evaluate here
            if "Invalid variable reference" in str(problem):
                raise RunFailed(f"LAMMPS stopped: {problem}") from None
            return None

    def _follows_runs(self, text: str, depth: int) -> bool:
        """Whether a formula asks for what is counted while LAMMPS runs."""
        if re.search(r"\b(elapsed|elaplong|[cf]_\w+)", text):
            return True
        names = re.findall(r"\bv_(\w+)", text)
        return depth > 10 or any(
            self._follows_runs(self._texts.get(name, ""), depth + 1) for name in names
        )

    def clear(self) -> bool:
        """Forget all before the first run; the deck ends here after it."""
        if not self.runs:
            self._stage.forget()
        return not self.runs
