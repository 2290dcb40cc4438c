"""The numbers of a deck that are compared with a scene: the table of all, and their checks."""

from __future__ import annotations

from dataclasses import replace

from hertzchain.errors import RunFailed
from hertzchain.verdict.deck.contact_numbers import CONTACTS, UNTRIED, is_tried
from hertzchain.verdict.deck.damping_numbers import DAMPING
from hertzchain.verdict.deck.deck_check import Case, DeckCheck
from hertzchain.verdict.deck.force_numbers import FORCES, IN_MOTION
from hertzchain.verdict.deck.granule_numbers import GRANULES
from hertzchain.verdict.deck.number import Number, check_of, checks_of
from hertzchain.verdict.deck.run_numbers import MOTION, RUNS, motion


def numbers_of(case: Case) -> tuple[Number, ...]:
    """All numbers of a deck that are compared, in the order in which they are shown."""
    contacts = (*CONTACTS, *DAMPING) if is_tried(case) else (UNTRIED,)
    if case.found.stopped and not case.found.applied_time.size:
        return (*GRANULES, *contacts)  # LAMMPS refuses to run these granules even at rest
    return (*GRANULES, *contacts, *FORCES, *RUNS)


def all_checks(case: Case, deck: str) -> list[DeckCheck]:
    """A check of each number, then of the motion that all of them make."""
    made = [(number, check) for number in numbers_of(case) for check in checks_of(case, number)]
    checks = [check for _, check in made]
    if case.settles and any(
        number.name == "distance of neighbours" and not check.passed for number, check in made
    ):
        raise RunFailed(
            f"{deck}: its chain settles before the shock begins, and is examined as it stands"
            " before its first run: have it settle in a deck of its own, and read what that"
            " has written"
        )
    if case.found.stopped:
        return checks
    acting = checks_of(case, IN_MOTION)
    if any(number.explains and not check.passed and check.effect != 0 for number, check in made):
        return [*checks, *acting]
    failed = [check for check in checks if not check.passed]
    moved = [check_of(case, MOTION, one) for one in motion(case, failed)]
    if acting:  # these are what the numbers do not have
        effect = next((one.effect for one in moved if not one.name.endswith("at the end")), None)
        return [*checks, *(replace(one, effect=effect) for one in acting)]
    return [*checks, *moved]
