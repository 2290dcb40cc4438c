"""A number of a deck as an entry of a table, and the check that becomes of it."""

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
    """What a deck has of a number, and what the scene has.

    Parameters
    ----------
    measured, expected
        Of the granule or contact where it matters; None where there is no such number.
    name, unit
        Where they are not those of the table's entry.
    relative
        The difference as a share of the number, where digits of it are allowed; 0 where the peaks
        alone decide; None where no difference is allowed.
    changes
        Numbers of the deck that take the place of the twin's: what they do to the peaks is the
        effect of the difference.
    effect
        The effect where no twin can tell it.
    sentence, reason
        What was found, and why it is too much; both numbers and what is allowed by default.
    stands
        As what the wrong and the right number may stand in a line, in units of the deck.
    role
        Which commands can make it, where not those of the entry.
    at
        Index of the command that makes it, itself or by its variables, where that is known.
    command
        What that command should be where no number stands in it; ``WITHOUT`` for none.
    room
        The largest difference that is round-off; below 0 where the two differ whatever the numbers
        are.
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
    """No difference above round-off; what is more than ``room`` has its reason elsewhere."""
    return Difference(measured, expected, room=max(room, abs(measured - expected)))


def changed(numbers: FloatArray, at: Any, values: Any) -> FloatArray:
    """A copy of numbers with others in some places."""
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
        Commands that make it, and by which it is corrected: a key of ``ROLES``.
    compared
        The difference of a deck, or several of them; none where the number does not apply.
    reason
        Why no difference is allowed, or what is compared.
    explains
        Whether no chain of velocity Verlet along a line has it if it is wrong: then it explains any
        motion of the deck.
    """

    name: str
    unit: str
    role: str
    compared: Callable[[Case], Difference | list[Difference]]
    reason: str = ""
    explains: bool = False


def differences(case: Case, number: Number) -> list[Difference]:
    """What a deck has of one number: several differences, or one that may be none."""
    found = number.compared(case)
    return [found] if isinstance(found, Difference) else found


def checks_of(case: Case, number: Number) -> list[DeckCheck]:
    """The checks of one number."""
    return [check_of(case, number, one) for one in differences(case, number)]


def check_of(case: Case, number: Number, one: Difference) -> DeckCheck:
    """What a difference is worth: its effect on the peaks, its line, what may make it right."""
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
    """A number that is none of NumPy's; counts stay counts."""
    return number if number is None or isinstance(number, int) else float(number)


def _tried(case: Case, check: DeckCheck, role: str) -> tuple[Changes, ...]:
    """Corrections that may help a failed check, without repetitions."""
    tried: list[Changes] = []
    for edits in corrections(case, check, role):
        changes = any(lines != (where[2],) for where, lines in edits.items())
        if edits and changes and edits not in tried:
            tried.append(edits)
    return tuple(tried[:_MOST])
