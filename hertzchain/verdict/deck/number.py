"""A number of a deck as an entry of a table, and its check."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.verdict.deck.corrections import corrections
from hertzchain.verdict.deck.deck_check import Case, DeckCheck, values
from hertzchain.verdict.deck.places import Changes, Pairs, place, with_number

_MOST = 6  # corrections that are tried for one check (chosen)


@dataclass(frozen=True)
class Difference:
    """A number of a deck and of the scene.

    Parameters
    ----------
    measured, expected
        Numbers of the granule or contact where they matter; None where there is no such number.
    name, unit
        Name and unit, if they are not those of the table's entry.
    relative
        Relative difference, if digits of the number may differ; 0 if only the peaks decide; None if
        no difference is allowed.
    changes
        Numbers of the deck that replace those of the twin: the change of its peaks is the effect.
    effect
        The effect, if no twin can show it.
    sentence, reason
        The difference in words, and why it is too large; by default both numbers and the allowed
        difference.
    stands
        Pairs of the wrong and the right number as a line may contain them, in units of the deck.
    role
        Commands that can set it, if not those of the entry.
    at
        Index of the command that sets it, directly or by its variables, if known.
    command
        The right command, if it contains no number; ``WITHOUT`` to remove it.
    room
        The largest difference that is round-off; negative if they always differ.
    """

    measured: float | None
    expected: float | None
    name: str = ""
    unit: str | None = None
    relative: float | None = None
    changes: Mapping[str, Any] | None = None
    effect: float | None = None
    sentence: str = ""
    reason: str = ""
    stands: Pairs = ()
    role: str = ""
    at: int | None = None
    command: str = ""
    room: float = -math.inf

    @property
    def differs(self) -> bool:
        """Whether there is a difference above round-off."""
        if self.measured is None or self.expected is None:
            return True
        return not abs(self.measured - self.expected) <= self.room


def same(measured: float, expected: float, room: float) -> Difference:
    """Return no difference: one above ``room`` has its cause in another number."""
    return Difference(measured, expected, room=max(room, abs(measured - expected)))


def changed(numbers: FloatArray, at: Any, values: Any) -> FloatArray:
    """Return a copy of numbers with other values at some places."""
    made = np.array(numbers)
    made[at] = values
    return made


@dataclass(frozen=True)
class Number:
    """One number of a deck.

    Parameters
    ----------
    name, unit
        What is compared.
    role
        Commands that set and correct it: a key of ``ROLES``.
    compared
        Function that returns the difference of a deck, or several; none if the number does not
        apply.
    reason
        Why no difference is allowed, or what is compared.
    explains
        Whether no twin (velocity Verlet along a line) can include it if it is wrong: it then
        explains any motion of the deck.
    """

    name: str
    unit: str
    role: str
    compared: Callable[[Case], Difference | list[Difference]]
    reason: str = ""
    explains: bool = False


def differences(case: Case, number: Number) -> list[Difference]:
    """Return the differences of a deck in one number; one of them may be zero."""
    found = number.compared(case)
    return [found] if isinstance(found, Difference) else found


def checks_of(case: Case, number: Number) -> list[DeckCheck]:
    """The checks of one number."""
    return [check_of(case, number, one) for one in differences(case, number)]


def check_of(case: Case, number: Number, one: Difference) -> DeckCheck:
    """Return the check of a difference: its effect on the peaks, its line, its corrections."""
    name = number.name if not one.differs else one.name or number.name
    unit = number.unit if one.unit is None else one.unit
    measured, expected = _plain(one.measured), _plain(one.expected)
    if not one.differs:
        return DeckCheck(
            name, unit, measured, expected, one.effect or 0.0, True, False,
            f"{name} is as in the scene", number.reason or case.reason(1.0),
        )  # fmt: skip
    effect = one.effect if one.changes is None else case.effect(**one.changes)
    passed = one.relative is not None and case.allowed(effect, one.relative)
    sentence = one.sentence
    if not sentence and measured is not None and expected is not None:
        sentence = f"{name} {values(measured, expected, unit)}"
    reason = number.reason if one.relative is None else case.reason(one.relative)
    role = one.role or number.role
    where = place(case.found, role, one.stands, one.at)
    command = (None if where is None else with_number(case.found, where, one.stands)) or one.command
    check = DeckCheck(
        name, unit, measured, expected, effect, passed, True, sentence, one.reason or reason, where,
        command,
    )  # fmt: skip
    tried = () if passed else _tried(case, check, role)
    return replace(check, command="", corrections=tried)


def _plain(number: float | None) -> float | None:
    """Return a Python number from NumPy's; integers stay integers."""
    return number if number is None or isinstance(number, int) else float(number)


def _tried(case: Case, check: DeckCheck, role: str) -> tuple[Changes, ...]:
    """Return corrections to try for a failed check, without repetitions."""
    tried: list[Changes] = []
    for edits in corrections(case, check, role):
        changes = any(lines != (where[2],) for where, lines in edits.items())
        if edits and changes and edits not in tried:
            tried.append(edits)
    return tuple(tried[:_MOST])
