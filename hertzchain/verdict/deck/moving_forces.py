"""Forces of a deck's fixes that show while granules move alone: springs, drag, setforce."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from hertzchain.engines.lammps.reading import FoundFix
from hertzchain.verdict.deck.deck_check import Case, DeckCheck, Indices, names
from hertzchain.verdict.deck.places import ROLES, place_at
from hertzchain.verdict.deck.pulse_checks import ACTS

_MORE = 1.1  # times the force at rest: readings of one force at other times differ by less (chosen)


def shows_in_motion(case: Case, fix: FoundFix) -> tuple[Indices, Indices]:
    """Granules on which a fix exerts a force in motion that it does not at rest, along and across.

    A granule that is led moves whatever the forces.
    """
    least = _MORE * fix.largest + ACTS * case.scene.units.force
    more = fix.largest_in_motion > least
    more[:, 0] &= ~case.found.driven
    return np.flatnonzero(more[:, 0]), np.flatnonzero(more[:, 1])


def drags(case: Case, fix: FoundFix) -> bool:
    """Whether a fix may be what drags granules: one made for it, or a formula of velocities."""
    return fix.style == "addforce" or _is(case, fix, "drag")


def moving_force_checks(case: Case, others: Sequence[DeckCheck]) -> list[DeckCheck]:
    """Fixes that push in motion and at rest do not, each with its line; effects are not known.

    ``others`` are checks of all that is found otherwise: walls at the ends, drag, random forces.
    """
    found, checks = case.found, []
    walls = {wall.command for wall in found.walls}
    dragged = any(check.name == "drag" and check.differs for check in others)
    for fix in found.fixes:
        is_told = fix.command in walls or _is(case, fix, "random")
        if fix.moves or is_told or (dragged and drags(case, fix)) or _has_ended(case, fix):
            continue
        along, across = shows_in_motion(case, fix)
        for granules, column, way in ((along, 0, "along"), (across, 1, "across")):
            if granules.size == 0:
                continue
            k = int(granules[np.argmax(fix.largest_in_motion[granules, column])])
            force, at_rest = fix.largest_in_motion[k, column], fix.largest[k, column]
            before = f"{at_rest:.3g} N" if at_rest > ACTS * case.scene.units.force else "none"
            # Of walls nothing is kept at rest.
            still = "" if fix.style.startswith("wall") else f", and {before} at rest"
            checks.append(DeckCheck(
                f"force of fix {fix.style} {way} the chain", "N", float(force), 0.0, None, False,
                True, f"fix {fix.style} exerts up to {force:.3g} N {way} the chain on"
                f" {names(granules, found.mass.size, 'granule', 1)} in motion{still}; the"
                " scene has no such force", "the scene has no force of the motion",
                place_at(found, fix.command), "without this fix",
            ))  # fmt: skip
    return checks


def _is(case: Case, fix: FoundFix, role: str) -> bool:
    text = case.found.commands[fix.command].text
    return any(re.match(pattern, text) for pattern in ROLES[role])


def _has_ended(case: Case, fix: FoundFix) -> bool:
    """Whether a fix is gone before the shock begins, as a chain settles."""
    found = case.found
    later = [run.command for run in found.runs if run.start > case.start * (1 - 1e-9)]
    if case.start <= 0 or not later:
        return False
    name = found.commands[fix.command].text.split()[1]
    between = found.commands[fix.command : later[0]]
    return any(one.carried_out and one.text.split()[:2] == ["unfix", name] for one in between)
