"""The piston of a deck against that of the scene."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hertzchain.verdict.deck.deck_check import (
    ROUND_OFF,
    Case,
    DeckCheck,
    names,
    placed,
    same,
    values,
)
from hertzchain.verdict.deck.measured import displacement, stretches_of
from hertzchain.verdict.deck.places import Place, formula_of, place_at


def piston_checks(case: Case) -> list[DeckCheck]:
    """Granules that are led, whatever presses them: granule 1 of a scene with a piston alone."""
    found, piston = case.found, case.scene.piston
    led = np.flatnonzero(found.driven)
    wanted = np.zeros(0 if piston is None else 1, np.intp)
    if not np.array_equal(led, wanted):
        who = names(led, found.driven.size, "granule", 1) if led.size else "no granule"
        right = "no granule" if piston is None else "granule 1 alone"
        check = DeckCheck(
            "granules that are led", "", led.size, wanted.size, math.inf, False, True,
            f"a fix leads {who}, whatever presses them; the scene leads {right}",
            "counts must be equal",
        )  # fmt: skip
        if led.size:
            return [_placed(case, check, "without this fix")]
        return [placed(check, found, "piston")]
    if piston is None:
        return []
    time = found.driven_time - case.start
    expected = displacement(piston, time)
    off = np.abs(found.driven_displacement - expected)
    way = piston.distance(case.scene.end_time)
    k = int(np.argmax(off)) if off.size else 0
    why = f"allowed is what changes no peak by more than {case.tolerance:g}"
    if off.size == 0 or off[k] <= ROUND_OFF * way + 1e-9 * float(case.near[0]):
        return [same("displacement of the piston", "m", way, way, why)]
    change = case.effect(stretches=stretches_of(found, case.scene, case.start, use_driven=True))
    measured, should = float(found.driven_displacement[k]), float(expected[k])
    check = DeckCheck(
        "displacement of the piston", "m", measured, should, change,
        case.allowed(change, (measured - should) / way), True,
        f"the displacement of granule 1 at {time[k]:.4g} s {values(measured, should, 'm')}", why,
    )  # fmt: skip
    numbers = []
    if piston.velocity is not None and time[k] > 0:
        unit = case.units.velocity
        numbers = [(measured / time[k] / unit, piston.velocity / unit)]
    # A piston by fix setforce has its velocity from another command.
    moves = any(fix.style == "move" for fix in found.fixes)
    by_number = placed(check, found, "piston" if moves else "velocity", numbers)
    return [by_number if by_number.command or not moves else _placed(case, check, "")]


def _placed(case: Case, check: DeckCheck, command: str) -> DeckCheck:
    """A check with the line of the fix that leads, or of its formula."""
    moving = [fix for fix in case.found.fixes if fix.moves and "move" in fix.style]
    if not moving:
        return placed(check, case.found, "piston", (), command)
    where: Place = place_at(case.found, moving[-1].command)
    return replace(check, place=formula_of(case.found, where), command=command)
