"""The examination of a user's deck: its numbers, where they stand, its peaks and a verdict."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, apart, or_none
from hertzchain.engines.lammps.reading.deck import Executed, FoundDeck, Units
from hertzchain.engines.lammps.reading.text import Edits, lines_of
from hertzchain.examiner.measured import (
    ROUND_OFF,
    Law,
    Stretch,
    Twin,
    TwinRun,
    change_of_peaks,
    length,
    run_twin,
)
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import judged_contacts
from hertzchain.observables.result import Result, context_of
from hertzchain.scene.scene import Scene
from hertzchain.shown import ShownVerdict

if TYPE_CHECKING:
    import pandas


Changes = dict[tuple[str, int, str], tuple[str, ...]]
"""Commands that replace those of a deck: by file, line and text of the command."""

Pairs = Sequence[tuple[float, float]]
"""Pairs of a wrong and the right number as a line may contain them, in units of the deck."""

_SIZE = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])"
NUMBER = re.compile(rf"[-+]?{_SIZE}")
SIZES = re.compile(rf"(?<![\w.$]){_SIZE}")

SAME = 2e-3  # relative difference up to which a number of a line is the measured one (chosen)

_FIX = r"fix\s+\S+\s+\S+\s+"
_PUSH = "addforce|setforce|aveforce|efield"
ROLES = {
    "granules": r"create_atoms|read_data|delete_atoms|replicate",
    "place": r"create_atoms|read_data|set\b.*\s[xyz]\s|displace_atoms|lattice|replicate",
    "radius": r"set\b.*\s(?:diameter|radius)\s|read_data",
    "mass": r"set\b.*\s(?:density|density/disc|mass|diameter)\s|mass\b|read_data",
    "contacts": "pair_coeff|pair_style|pair_modify",
    "wall": rf"{_FIX}wall/",
    "constant force": rf"{_FIX}(?:gravity|{_PUSH})",
    "gravity": rf"{_FIX}gravity",
    "drag": rf"{_FIX}(?:viscous|langevin|drag|damping/cundall)",
    "random": rf"{_FIX}(?:langevin|brownian|temp)|velocity\s+\S+\s+create"
    r"|displace_atoms\s+\S+\s+random|create_atoms\s+\S+\s+random",
    "velocity": r"velocity\b|set\b.*\sv[xyz]\s|read_data",
    "spin": r"set\b.*\s(?:omega|angmom)\s|velocity\b|read_data",
    "shock": rf"{_FIX}(?:{_PUSH}|move|smd|spring)",
    "pushed": rf"{_FIX}(?:{_PUSH}|gravity)",
    "timestep": rf"timestep\b|{_FIX}dt/reset|reset_timestep\b",
    "run": r"run\b",
    "motion": rf"{_FIX}(?:nve|nvt|npt|nph|rigid|setforce|freeze|momentum|recenter|move|lineforce"
    r"|planeforce|enforce2d|viscous|addforce)|unfix\b|neigh|comm_modify",
    "neighbours": "neigh_modify|neighbor|comm_modify",
    "piston": rf"{_FIX}move",
    "image": r"boundary\b",
    "integrators": rf"{_FIX}(?:nve|nvt|npt|nph)",
    "velocities": r"velocity\b|set\b.*\s(?:v[xyz]|omega|angmom)\s",
    "displaced": "displace_atoms|delete_atoms|change_box",
    "ends": rf"{_FIX}halt",
    "excludes": r"neigh_modify\s.*\bexclude\s+(?!none)|pair_coeff\s+.*\slj/",
    "needed": "run|variable|read_|create_|units|pair_style|include|timestep",
    "wall in motion": rf"{_FIX}wall/|unfix",
}
"""Commands that can set each kind of number, as a pattern of their beginnings."""

_IN_TIME = re.compile(r"\b(?:time|step|elapsed|elaplong|ramp|swiggle|cwiggle|vdisplace|next)\b")


@dataclass(frozen=True)
class Place:
    """A line of a deck."""

    file: str  #: as the deck names it
    line: int  #: from 1
    written: str  #: the command as it stands there
    index: int  #: of the command among those that were carried out

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


def is_of(deck: FoundDeck, index: int, role: str) -> bool:
    """Whether a command can set a number of a role of ``ROLES``."""
    return re.match(rf"\s*(?:{ROLES[role]})", f"{deck.commands[index].text} ") is not None


def commands_of(deck: FoundDeck, role: str) -> list[int]:
    """Return the carried-out commands that can set a number of a role."""
    commands = enumerate(deck.commands)
    return [k for k, command in commands if command.carried_out and is_of(deck, k, role)]


def place(deck: FoundDeck, role: str, at: int | None = None) -> Place | None:
    """Return the last line that can set a number of a role, or that of a command, if it is known.

    For a missing command it is the place of the first run; None without a run.
    """
    commands, mains = deck.commands, commands_of(deck, role)
    # In styles of the family gran, pair_coeff * * has no numbers.
    full = [index for index in mains if commands[index].text.split()[1:] != ["*", "*"]] or mains
    candidates = [at] if at is not None else full or commands_of(deck, "run")
    return place_at(deck, candidates[-1]) if candidates else None


def with_numbers(
    deck: FoundDeck, role: str, stands: Pairs, at: int | None = None
) -> list[tuple[Place, str]]:
    """Return lines with a wrong number, the most likely first, and the right commands for them.

    ``stands`` are pairs of the measured and the right number, in units of the deck. A line is a
    command of the role, the one at ``at`` first, or a variable that it uses. The values of
    variables stand in its place where no variable has the number, except in a loop.
    """
    fitting: dict[tuple[str, int], tuple[Place, str]] = {}
    lines = [(command.file, command.line) for command in deck.commands]
    mains = [*([] if at is None else [at]), *reversed(commands_of(deck, role))] if stands else []
    for index in dict.fromkeys(mains):
        places = [place_at(deck, k) for k in (index, *variables_of(deck.commands, index))]
        texts = [(where, where.written) for where in places]
        if lines.count(lines[index]) == 1:
            texts.append((places[0], deck.commands[index].text.strip()))
        for where, text in texts:
            if (right := with_number(text, stands)) is not None:
                fitting.setdefault((where.file, where.line), (where, right))
    return [*fitting.values()]


def formula_of(deck: FoundDeck, where: Place) -> Place:
    """Return the variable at a place that makes a force change in time; else the place itself."""
    for at in reversed(variables_of(deck.commands, where.index)):
        if _IN_TIME.search(deck.commands[at].written):
            return place_at(deck, at)
    return where


def place_at(deck: FoundDeck, index: int) -> Place:
    """The line of a command."""
    command = deck.commands[index]
    return Place(command.file, command.line, command.written.strip(), index)


def key_of(command: Place | Executed) -> tuple[str, int, str]:
    """Return the key of a command in changes."""
    return command.file, command.line, command.written


def variables_of(commands: Sequence[Executed], index: int) -> list[int]:
    """Return commands that define the variables of a command, directly or through others."""
    definitions: list[int] = []
    wanted, names = list(_names(commands[index].written)), set[str]()
    while wanted:
        name = wanted.pop()
        definition = re.compile(rf"\s*variable\s+{re.escape(name)}\s")
        at = [k for k, command in enumerate(commands)
              if command.carried_out and definition.match(command.written)]  # fmt: skip
        if at and name not in names:
            definitions.append(at[-1])
            wanted += _names(commands[at[-1]].written)
        names.add(name)
    return definitions


def _names(text: str) -> set[str]:
    """Names of the variables that a command uses."""
    matches = re.findall(r"\$\{(\w+)\}|\$(\w)(?!\w)|\bv_(\w+)", text)
    return {next(name for name in names if name) for names in matches}


def with_number(text: str, stands: Pairs) -> str | None:
    """Return a command with its wrong number replaced by the right one; None without one.

    The first pair that fits counts; signs of numbers are those of the command.
    """
    for old, new in stands:
        for match in SIZES.finditer(text) if math.isfinite(old) and old != 0 else ():
            if math.isclose(float(match.group()), abs(old), rel_tol=SAME):
                start, end = match.span()
                return f"{text[:start]}{math.copysign(1.0, old) * new:.10g}{text[end:]}"
    return None


Indices = NDArray[np.intp]

EXAMINED = 1e-12
"""Relative rounding error of LAMMPS's numbers in generated decks. Measured 3e-15, R 1e-8 to 1e3 m,
N to 1e4."""

ACTS = 1e-6  # fraction of the largest force: granules with less are not pushed (chosen)
_WHICH = re.compile(r"(?: of| on| at)? (?:all |the )?(?:granules?|contacts?)\b.*| \d+.*")

_EPS = float(np.finfo(np.float64).eps)
_COORDINATE_ROUNDING = 6 * _EPS  # relative: two coordinates and their difference, times 1.5

DIGITS = 10.0  # times the tolerance: largest difference of a number by its digits (chosen)


@dataclass(frozen=True)
class DeckCheck:
    """One number of a deck against that of the scene."""

    name: str  #: what is compared, such as ``mass of granule 7``
    unit: str  #: of both numbers; "" for a ratio or a count
    measured: float | None  #: number of the deck; None if there is none
    expected: float | None  #: number of the scene
    effect: float | None  #: largest relative change of the peaks by this alone; None if unknown
    passed: bool
    differs: bool  #: whether the difference is above round-off; it gets a remark if it passed
    sentence: str  #: the number that was measured and the right one, in words
    reason: str  #: why this is too much, or not
    place: Place | None = None  #: line of the deck that sets it; None if nothing differs
    command: str = ""  #: proven correction of that line, one command per line; "" without one
    role: str = ""  #: kind of commands that set it
    room: float | None = None  #: largest difference of round-off, in the unit; None for any
    is_sure: bool = False  #: whether that line has the number, or LAMMPS shows that it acts
    #: Changes of the deck that may make it right, best guesses first.
    corrections: tuple[Changes, ...] = field(default=(), repr=False, compare=False)

    @property
    def kind(self) -> str:
        """The name without the numbers of granules or contacts."""
        return _WHICH.sub("", self.name)

    def to_dict(self) -> dict[str, Any]:
        """Return the check as a JSON object."""
        place = {"file": None, "line": None, "written": None}
        if self.place is not None:
            place = {name: getattr(self.place, name) for name in place}
        return {
            "name": self.name,
            "unit": self.unit,
            "measured": _finite(self.measured),
            "expected": _finite(self.expected),
            "effect_on_peaks": _finite(self.effect),
            **{name: getattr(self, name) for name in ("passed", "differs", "sentence", "reason")},
            **place,
            "command": self.command or None,
        }


def _finite(value: float | None) -> float | None:
    """A number for JSON: None if not finite."""
    return value if value is not None and math.isfinite(value) else None


@dataclass(frozen=True, eq=False)
class Case:
    """Data that the checks of a deck share.

    ``deck`` is in SI units, ``units`` are those of the deck, ``start`` is when the shock begins in
    the deck's time, ``peaks`` are those of the reference [N], ``passed`` is true if its run has
    passed them, and ``near`` is the largest overlap of each contact in it [m]. In an ``exact`` deck
    only round-off may differ; it is judged before it runs, without peaks. If ``strict``,
    differences that change no peak fail, too.
    """

    scene: Scene
    deck: FoundDeck
    units: Units
    start: float
    peaks: FloatArray
    passed: NDArray[np.bool_]
    near: FloatArray
    laws: Sequence[Law]
    twin: Twin
    stretches: Sequence[Stretch]
    expected: TwinRun
    tolerance: float
    deadline: Deadline
    exact: bool = False
    strict: bool = False

    @property
    def along(self) -> int:
        """Index of the axis of the chain: 0, 1 or 2."""
        return "xyz".index(self.deck.axis)

    @property
    def sign(self) -> float:
        """1 if the chain extends to larger coordinates in the deck, else -1."""
        return float(self.deck.direction[self.along])

    def least(self, of_others: float) -> float:
        """Return the smallest relative difference that counts; it is smaller in an exact deck."""
        return EXAMINED if self.exact else of_others

    @property
    def rounded(self) -> float:
        """Largest rounding error of a distance between coordinates [m]."""
        return _COORDINATE_ROUNDING * length(self.scene)

    def rounding(self, k: int, overlap: FloatArray) -> FloatArray:
        """Return the relative rounding error of contact forces, by that of such distances."""
        radius = self.scene.granules.radius
        reach = length(self.scene) if k + 1 == radius.size else radius[k] + radius[k + 1]
        return np.asarray(np.maximum(self.least(ROUND_OFF), _COORDINATE_ROUNDING * reach / overlap))

    def effect(self, stretches: Sequence[Stretch] = (), **numbers: Any) -> float:
        """Largest change of the peaks if numbers of the deck take the place of the scene's."""
        run = run_twin(self.twin._replace(**numbers), stretches or self.stretches, self.deadline)
        return change_of_peaks(run.peak_force, self.expected.peak_force, self.judged)

    @cached_property
    def judged(self) -> NDArray[np.bool_]:
        """Judged contacts that peaked within the deck's run; a wall's is the last."""
        return np.logical_and(self.passed, judged_contacts(self.peaks))

    @cached_property
    def whole_effect(self) -> float:
        """Error of the deck's own peaks."""
        return change_of_peaks(self.deck.peak_force, self.peaks, self.judged)

    def reason(self, relative: float) -> str:
        """The reason for the allowed difference of a number."""
        digits = f", and {DIGITS * self.tolerance:g} of the number" if relative else ""
        return f"allowed is what changes no peak by more than {self.tolerance:g}{digits}"

    def is_of_time(self, index: int) -> bool:
        """Whether a command has a variable that changes in time."""
        return formula_of(self.deck, place_at(self.deck, index)).index != index

    def contact_name(self, indices: Indices | int, size: int | None = None) -> str:
        """Contacts, counted from 0 in the deck, by the scene's numbers; a wall by its name.

        ``size`` is the number of all contacts, by default those that were probed.
        """
        numbers, contacts = np.atleast_1d(indices), self.scene.contacts
        if numbers.size == 1 and numbers[0] < len(contacts):
            return self.scene.contact_name(contacts[numbers[0]])
        return names(numbers, len(self.laws) if size is None else size, "contact", contacts[0])

    def granule_name(self, indices: Indices | int) -> str:
        """Granules, counted from 0 in the deck, by the scene's numbers; a near wall by its name."""
        numbers, first = np.atleast_1d(indices), self.scene.first_granule
        wall = numbers < first
        size = self.deck.mass.size - first
        granules = names(numbers[~wall], size, "granule", 1 - first)
        if not wall.any():
            return granules
        return "the near wall" if wall.all() else f"the near wall and {granules}"

    def is_wall(self, indices: Indices) -> bool:
        """Whether a contact is a wall's."""
        return self.scene.wall is not None and int(indices[0]) + 1 == self.near.size

    def reduced_modulus(self, k: int) -> float:
        """E* of a contact of the scene [Pa]."""
        granules = self.scene.granules
        return float(0.75 * granules.stiffness[k] / math.sqrt(granules.contact_radius[k]))


def values(measured: float, expected: float, unit: str) -> str:
    """Two numbers in words, with enough digits to show their difference."""
    number, wanted = apart(measured, expected)
    end = f" {unit}" if unit else ""
    return f"is {number}{end}, the scene has {wanted}{end}"


def names(indices: Indices, size: int, what: str, first: int) -> str:
    """Some granules or contacts in words, numbered from ``first``."""
    numbers = (indices + first).tolist()
    if not numbers:
        return f"no {what}"
    if len(numbers) == 1:
        return f"{what} {numbers[0]}"
    if len(numbers) == size:
        return f"all {what}s"
    if numbers[-1] - numbers[0] + 1 == len(numbers):
        return f"{what}s {numbers[0]} to {numbers[-1]}"
    shown = ", ".join(map(str, numbers[:4]))
    return f"{what}s {shown}" + (f" and {len(numbers) - 4} more" if len(numbers) > 4 else "")


@dataclass(frozen=True)
class Correction:
    """Commands that replace a line of a deck, proven to be right."""

    file: str  #: as the deck names it
    line: int
    written: str  #: the command that stands there
    commands: tuple[str, ...]  #: those in its place; a removed command has a ``#`` before it

    def to_dict(self) -> dict[str, Any]:
        """Return the correction as a JSON object."""
        return {"file": self.file, "line": self.line, "commands": list(self.commands)}


@dataclass(frozen=True)
class Finding:
    """The numbers that one command of a deck makes wrong."""

    checks: tuple[DeckCheck, ...]  #: that failed because of it, that of the largest effect first
    #: Lines with which all of these pass and no peak gets worse; empty if none was found.
    correction: tuple[Correction, ...] = ()
    with_others: bool = False  #: whether only together with the corrections of other findings
    follows: int | None = None  #: index of the finding whose correction makes these pass, too


@dataclass(frozen=True, eq=False, repr=False)
class DeckExamination(ShownVerdict):
    """A user's deck as LAMMPS reads it, compared with a scene number by number.

    It is true if the verdict is ``pass``.
    """

    scene: Scene  #: what the deck should compute
    deck: str  #: its name
    contents: FoundDeck  #: what LAMMPS found in it, in SI units
    checks: tuple[DeckCheck, ...]  #: the one to correct first in front; the peaks are the last
    reference: Result  #: the scene by the reference method, up to the end of the deck
    judged: NDArray[np.bool_]  #: contacts whose peaks were judged, (contacts,), a wall's the last
    tolerance: float  #: largest relative difference of the peaks that passes
    remarks: tuple[str, ...]  #: sentences on parts that were not examined
    texts: tuple[tuple[str, str], ...] = ()  #: name and text of each file, as its commands have it
    findings: tuple[Finding, ...] = ()  #: what to correct, command by command
    edits: Edits = field(default_factory=dict)  #: all proven corrections, by file and line

    @property
    def passed(self) -> bool:
        """Whether the whole deck agrees with the scene."""
        return all(check.passed for check in self.checks)

    @property
    def verdict(self) -> str:
        """``pass`` if the whole deck agrees with the scene, else ``fail``."""
        return "pass" if self.passed else "fail"

    @property
    def peak_force(self) -> FloatArray:
        """Peak forces of the deck [N], shape (contacts,), NaN where it has no such contact."""
        whole = np.full(self.reference.peak_force.size, np.nan)
        count = min(whole.size, self.contents.peak_force.size)
        whole[:count] = self.contents.peak_force[:count]
        return whole

    @property
    def to_correct(self) -> tuple[DeckCheck, ...]:
        """The failed checks except that of the peaks, the one with the largest effect first."""
        return tuple(check for check in self.checks[:-1] if not check.passed)

    @property
    def fix(self) -> str:
        """The text of the deck with all proven corrections; included files that change stand in it.

        It is the text of the deck itself if nothing could be corrected.
        """
        texts = dict(self.texts)
        return _edited(self.deck, texts, self.edits) if self.deck in texts else ""

    def corrections_of(self, edits: Edits) -> tuple[Correction, ...]:
        """Edits as corrections of this deck, line by line."""
        written = {(c.file, c.line): c.written for c in self.contents.commands}
        return tuple(
            Correction(file, line, written.get((file, line), ""), commands)
            for (file, line), commands in sorted(edits.items(), key=lambda item: item[0][1])
        )

    def error_of_peaks(self, which: NDArray[np.bool_]) -> float:
        """Largest relative difference from the reference of some contacts; infinite without one."""
        return change_of_peaks(self.contents.peak_force, self.reference.peak_force, which)

    @property
    def small(self) -> tuple[DeckCheck, ...]:
        """The checks that passed with a difference."""
        return tuple(check for check in self.checks if check.passed and check.differs)

    @property
    def left_out(self) -> tuple[Executed, ...]:
        """Commands that were not carried out, or not in full."""
        return tuple(command for command in self.contents.commands if command.why_not is not None)

    def to_frame(self) -> pandas.DataFrame:
        """A table with one row for each check."""
        import pandas

        return pandas.DataFrame([check.to_dict() for check in self.checks])

    def to_dict(self) -> dict[str, Any]:
        """Return the examination as a JSON object; null stands for a missing value."""
        contents = self.contents
        return {
            "verdict": self.verdict,
            "deck": self.deck,
            "tolerance": self.tolerance,
            "checks": [check.to_dict() for check in self.checks],
            "findings": [
                {
                    "checks": [check.name for check in finding.checks],
                    "correction": [line.to_dict() for line in finding.correction] or None,
                    "with_others": finding.with_others,
                    "follows": finding.follows,
                }
                for finding in self.findings
            ],
            "stopped": contents.stopped or None,
            "left_out": [
                {"file": c.file, "line": c.line, "command": c.written, "why": c.why_not}
                for c in self.left_out
            ],
            "remarks": list(self.remarks),
            "units": contents.units,
            "axis": contents.axis,
            "lammps": contents.version,
            "end_time_s": contents.end_time,
            "dt_s": max((run.dt for run in contents.runs), default=None),
            "peak_force_N": or_none(self.peak_force),
            "peak_reading_error": (
                contents.peak_reading_error if math.isfinite(contents.peak_reading_error) else None
            ),
            "judged": self.judged.tolist(),
            "reference": self.reference.numbers(),
            **context_of(self.scene),
        }


def _edited(name: str, texts: Mapping[str, str], edits: Edits) -> str:
    """Return a file of a deck with edits; included files with edits stand in it."""
    changed = {file for file, _ in edits}
    rows: list[str] = []
    text = texts[name]
    for line in lines_of(text):
        commands = edits.get((name, line.number))
        words = line.text.split()
        if commands is not None:
            rows += commands
        elif words[:1] == ["include"] and words[1] in changed & set(texts):
            rows.append(_edited(words[1], texts, edits).rstrip("\n"))
        else:
            rows += text.split("\n")[line.number - 1 : line.last]
    return "\n".join(rows) + ("\n" if not text.endswith("\n") else "")


def by_command(checks: Iterable[DeckCheck]) -> list[list[DeckCheck]]:
    """Failed checks by the command that causes them, in their order."""
    checks_at: dict[object, list[DeckCheck]] = {}
    for check in checks:
        if not check.passed:
            at = id(check) if check.place is None else (check.place.file, check.place.line)
            checks_at.setdefault(at, []).append(check)
    return list(checks_at.values())


def in_order(checks: Sequence[DeckCheck]) -> list[DeckCheck]:
    """Failed checks first, by their effect on the peaks; then those that differ; then the rest."""

    def rank(check: DeckCheck) -> tuple[int, float]:
        group = 0 if not check.passed else 1 if check.differs else 2
        effect = -math.inf if check.effect is None else check.effect
        return group, -effect if group < 2 else 0.0

    return sorted(checks, key=rank)
