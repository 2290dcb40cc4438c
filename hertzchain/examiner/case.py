"""A number of a deck against the scene: its difference, the effect on peaks, and its line."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, apart
from hertzchain.engines.lammps.reading.found import FoundDeck, FoundFix
from hertzchain.engines.lammps.reading.units import Units
from hertzchain.examiner.expected import length
from hertzchain.examiner.measured import Law, damping_of, far_wall, stretches_of
from hertzchain.examiner.places import Changes, Place, changes_in_time
from hertzchain.examiner.twin import Stretch, Twin, TwinRun, change_of_peaks, run_twin
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import judged_contacts
from hertzchain.scene.scene import Scene

Indices = NDArray[np.intp]

EXAMINED = 1e-12
"""Relative rounding error of LAMMPS's numbers in generated decks. Measured 3e-15, R 1e-8 to 1e3 m,
N to 1e4."""

ROUND_OFF = 1e-9  # relative: decks with 17 digits have less; not worth a remark (chosen)
PLACES = 1e-7  # fraction of an overlap: smaller gaps are rounded coordinates (chosen)
ACTS = 1e-6  # fraction of the largest force: granules with less are not pushed (chosen)
_WHICH = re.compile(r"(?: of| on| at)? (?:all |the )?(?:granules?|contacts?)\b.*| \d+.*")

_EPS = float(np.finfo(np.float64).eps)
_ROUNDED = 6 * _EPS  # relative to a coordinate: two of them and their difference, times 1.5

_MOST_GROUPS = 3  # most groups of equally wrong numbers with a remark each (chosen)
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
    differs: bool  #: whether the difference is above round-off: it gets a remark if it passed
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
        return {
            "name": self.name,
            "unit": self.unit,
            "measured": _finite(self.measured),
            "expected": _finite(self.expected),
            "effect_on_peaks": _finite(self.effect),
            "passed": bool(self.passed),
            "differs": bool(self.differs),
            "sentence": self.sentence,
            "reason": self.reason,
            "file": None if self.place is None else self.place.file,
            "line": None if self.place is None else self.place.line,
            "written": None if self.place is None else self.place.written,
            "command": self.command or None,
        }


def _finite(value: float | None) -> float | None:
    """A number for JSON: None if not finite, Python's own type."""
    if value is None or not math.isfinite(value):
        return None
    return value if isinstance(value, int) else float(value)


@dataclass(frozen=True, eq=False)
class Case:
    """Data that the checks of a deck share.

    ``deck`` is in SI units, ``units`` are those of the deck, ``start`` is when the shock begins in
    the deck's time, ``peaks`` are those of the reference [N], ``passed`` tells whether its run has
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

    def least(self, of_others: float) -> float:
        """Relative difference from which on one counts; smaller in an exact deck."""
        return EXAMINED if self.exact else of_others

    @property
    def rounded(self) -> float:
        """Largest rounding error of a distance between coordinates [m]."""
        return _ROUNDED * length(self.scene)

    def rounding(self, k: int, overlap: FloatArray) -> FloatArray:
        """Relative rounding error of contact forces at overlaps, which are such distances."""
        radius = self.scene.granules.radius
        reach = length(self.scene) if k + 1 == radius.size else radius[k] + radius[k + 1]
        return np.asarray(np.maximum(self.least(ROUND_OFF), _ROUNDED * reach / overlap))

    def effect(self, stretches: Sequence[Stretch] = (), **numbers: Any) -> float:
        """Largest change of the peaks if numbers of the deck take the place of the scene's."""
        run = run_twin(self.twin._replace(**numbers), stretches or self.stretches, self.deadline)
        return change_of_peaks(run.peak_force, self.expected.peak_force, self.judged)

    @cached_property
    def judged(self) -> NDArray[np.bool_]:
        """Judged contacts that peaked within the deck's run; a wall's is the last."""
        return np.logical_and(self.passed, judged_contacts(self.peaks))

    @cached_property
    def motion(self) -> TwinRun:
        """The motion that follows from all numbers of the deck that a twin can have."""
        deck, twin = self.deck, self.twin
        stiffness, exponent, opening = (
            np.array(numbers) for numbers in (twin.stiffness, twin.exponent, twin.opening)
        )
        for k, law in enumerate(self.laws):
            stiffness[k], exponent[k] = law.stiffness, law.exponent
        # The start of contacts depends on the radii, which may differ from the scene's.
        touching = deck.radius[:-1] + deck.radius[1:]
        size = min(opening.size, touching.size)
        opening[:size] = (np.diff(deck.position) - touching)[:size]
        wall = far_wall(deck)
        if self.scene.wall is not None and wall is not None:
            opening[-1] = wall.position - float(deck.position[-1]) - float(deck.radius[-1])
        elif self.scene.wall is not None:
            stiffness[-1] = 0.0
        pushed = np.flatnonzero(np.max(np.abs(deck.applied_force), axis=0, initial=0.0) > 0)
        pushed = pushed if pushed.size else np.zeros(1, np.intp)
        whole = twin._replace(
            mass=np.where(deck.integrated == 0, math.inf, deck.mass),
            velocity=np.ascontiguousarray(deck.velocity[:, 0]),
            constant_force=np.ascontiguousarray(deck.constant_force[:, 0]),
            drag=np.nan_to_num(deck.drag),
            stiffness=stiffness,
            exponent=exponent,
            opening=opening,
            pushed=pushed,
            **damping_of(deck, self.scene),
        )
        driven = bool(deck.driven[0]) and deck.driven_time.size > 0
        stretches = stretches_of(deck, self.scene, self.start, pushed, driven)
        return run_twin(whole, stretches, self.deadline)

    @cached_property
    def followed(self) -> NDArray[np.bool_]:
        """Judged contacts whose force in that motion is above round-off."""
        force = self.motion.peak_force
        pressed = force > ROUND_OFF * np.max(self.peaks)  # NaN is not
        size = min(self.deck.peak_force.size, force.size)
        both = judged_contacts(force) & pressed & self.judged
        return np.asarray(both & (np.arange(both.size) < size))

    @cached_property
    def residual(self) -> float:
        """Change of the deck's peaks by all that no twin (velocity Verlet on a line) can have."""
        alike = self.deck.mass.size == self.twin.mass.size
        if self.exact or self.deck.stopped or not alike or not np.any(self.followed):
            return self.whole_effect
        return change_of_peaks(self.deck.peak_force, self.motion.peak_force, self.followed)

    @property
    def whole_effect(self) -> float:
        """Error of the deck's own peaks."""
        return change_of_peaks(self.deck.peak_force, self.peaks, self.judged)

    def reason(self, relative: float) -> str:
        """The reason for the allowed difference of a number."""
        digits = f", and {DIGITS * self.tolerance:g} of the number" if relative else ""
        return f"allowed is what changes no peak by more than {self.tolerance:g}{digits}"

    def pushing(self, granules: Indices) -> list[FoundFix]:
        """Fixes other than walls that push one of some granules along the chain."""
        least = ACTS * self.scene.units.force
        return [
            fix for fix in self.deck.fixes
            if not fix.moves and not fix.style.startswith("wall")
            and float(np.max(fix.largest[granules, 0], initial=0.0)) > least
        ]  # fmt: skip

    def is_of_time(self, index: int) -> bool:
        """Whether a command has a variable that changes in time."""
        return changes_in_time(self.deck, index)

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
        """Whether a contact is that of the wall."""
        return self.scene.wall is not None and int(indices[0]) + 1 == self.near.size

    def reduced_modulus(self, k: int) -> float:
        """E* of a contact of the scene [Pa]."""
        granules = self.scene.granules
        return float(0.75 * granules.stiffness[k] / math.sqrt(granules.contact_radius[k]))


def values(measured: float, expected: float, unit: str) -> str:
    """Two numbers in words, with enough digits to see their difference."""
    number, wanted = apart(measured, expected)
    end = f" {unit}" if unit else ""
    return f"is {number}{end}, the scene has {wanted}{end}"


def groups(relative: FloatArray, room: FloatArray | float) -> list[Indices]:
    """Indices of numbers that differ by the same, the largest difference first.

    ``relative`` is the difference of each number; those of round-off, ``room``, are left out.
    """
    left = np.flatnonzero(~(np.abs(relative) <= room))
    made: list[Indices] = []
    while left.size and len(made) < _MOST_GROUPS - 1:
        order = np.nan_to_num(np.abs(relative[left]), nan=np.inf)
        first = relative[left[int(np.argmax(order))]]
        alike = np.isclose(relative[left], first, rtol=1e-2, atol=0) | ~np.isfinite(relative[left])
        made.append(left[alike])
        left = left[~alike]
    return [*made, left] if left.size else made


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
