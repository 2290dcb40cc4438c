"""Forces on a deck's granules besides those of contacts: loads, drag, the shock, a piston."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundFix
from hertzchain.verdict.deck.deck_check import ACTS, ROUND_OFF, Case, Indices, values
from hertzchain.verdict.deck.expected import constant_force
from hertzchain.verdict.deck.measured import displacement, stretches_of
from hertzchain.verdict.deck.number import Difference, Number, changed, same
from hertzchain.verdict.deck.places import WITHOUT, commands_of, formula_of, is_of, place_at
from hertzchain.verdict.deck.pulse import of_shock, pulse, pushing_changes


def _last_fix(case: Case, wanted: Callable[[FoundFix], bool]) -> int | None:
    """The command of the last of the wanted fixes that pushes."""
    fixes = [fix.command for fix in case.found.fixes if not fix.moves and wanted(fix)]
    return fixes[-1] if fixes else None


# ---- Loads


def _least_force(case: Case) -> float:
    """Least force that is not round-off [N]."""
    return case.least(ROUND_OFF) * case.scene.units.force


def _constant(case: Case) -> Difference:
    """Gravity and static loads."""
    found, units = case.found, case.units
    count = min(found.mass.size, case.twin.mass.size)
    measured = found.constant_force[:count, 0] + 0.0  # no -0
    expected, least = constant_force(case.scene)[:count], _least_force(case)
    held = np.isinf(case.scene.granules.mass[:count])  # no force moves these granules
    expected[held] = measured[held]
    off = measured - expected
    k = int(np.argmax(np.abs(off)))
    largest = np.max(np.abs(expected))
    alike = np.flatnonzero(np.abs(off) > least)
    per_mass = measured / found.mass[:count]
    pressed = case.scene.precompression
    falls = 0.0 if pressed is None else pressed.gravity
    is_right = math.isclose(per_mass[0], falls, rel_tol=1e-6)  # then a load is missing
    gravity = bool(np.allclose(per_mass, per_mass[0], rtol=1e-6) and not is_right)
    kind = f" (gravity of {per_mass[0]:.4g} m/s^2 along the chain)" if gravity else ""
    role = "gravity" if gravity else "constant force"
    at = None
    if not np.any(measured) or (falls and is_right):
        at = found.first_run
    elif not commands_of(found, role):
        at = _last_fix(case, lambda fix: bool(fix.largest[k, 0] > least))
    stands = []
    if np.any(expected) and np.any(measured):
        stands = [(abs(measured[k]) / units.force, abs(expected[k]) / units.force)]
        if gravity and falls:
            right = falls / units.acceleration
            stands.insert(0, (abs(float(per_mass[0])) / units.acceleration, right))
    return Difference(
        measured[k], expected[k], f"constant force on {case.granule_name(alike)}",
        relative=float(off[k] / largest) if largest > 0 else None,
        changes={"constant_force": changed(case.twin.constant_force, slice(count), measured)},
        sentence=f"the constant force on {case.granule_name(k)}"
        f" {values(measured[k], expected[k], 'N')}{kind}",
        stands=stands, role=role, at=at, command="" if largest > 0 else WITHOUT,
        room=least,
    )  # fmt: skip


def _constant_across(case: Case) -> Difference:
    across, least = case.found.constant_force[:, 1:], _least_force(case)
    side = float(np.max(np.abs(across), initial=0.0))
    falls = across / case.found.mass[:, np.newaxis]
    as_one = bool(np.allclose(falls, falls[0], rtol=1e-6, atol=1e-6 * np.max(np.abs(falls))))
    return Difference(
        side, 0.0, effect=0.0 if as_one else case.whole_effect,
        sentence=f"a constant force of {side:.3g} N acts across the chain, the scene has none",
        at=_last_fix(case, lambda fix: bool(np.max(fix.largest[:, 1]) > least)),
        command=WITHOUT, room=least,
    )  # fmt: skip


# ---- Forces of the motion


_MORE = 1.1  # times the force at rest: readings of one force at other times differ by less (chosen)


def _shows_in_motion(case: Case, fix: FoundFix) -> tuple[Indices, Indices]:
    """Granules on which a fix exerts a force only in motion, along and across the chain.

    Granules with prescribed motion and fixed ones do not count, as forces do not move them.
    """
    least = _MORE * fix.largest + ACTS * case.scene.units.force
    more = fix.largest_in_motion > least
    more[:, 0] &= ~case.found.driven
    fixed = case.scene.granules.fixed
    more[fixed[fixed < len(more)], 0] = False
    return np.flatnonzero(more[:, 0]), np.flatnonzero(more[:, 1])


def _drags(case: Case, fix: FoundFix) -> bool:
    """Whether a fix may drag granules: a fix for drag, or a formula of velocities."""
    return fix.style == "addforce" or is_of(case.found, fix.command, "drag")


def _drag(case: Case) -> Difference:
    found = case.found
    drag = np.where(np.isfinite(found.drag), found.drag, 0.0) + 0.0  # no -0
    k, count = int(np.argmax(np.abs(drag))), case.twin.drag.size
    whole = np.append(drag[:count], np.zeros(max(0, count - drag.size)))
    return Difference(
        drag[k], 0.0, effect=0.0, changes={"drag": whole},
        sentence=f"a drag of {drag[k]:.3g} N s/m acts on {case.granule_name(k)}, the scene has"
        " none",
        at=_last_fix(
            case, lambda fix: _drags(case, fix) and _shows_in_motion(case, fix)[0].size > 0
        ), command=WITHOUT,
        room=_least_force(case) / case.scene.units.velocity,
    )  # fmt: skip


def _in_motion(case: Case) -> list[Difference]:
    """Fixes that push only in motion, not at rest; their effect on the peaks is not known."""
    found, made = case.found, []
    walls = {wall.command for wall in found.walls}
    dragged = _drag(case).differs
    for fix in found.fixes:
        is_told = fix.command in walls or is_of(found, fix.command, "random")
        if fix.moves or is_told or (dragged and _drags(case, fix)):
            continue
        both = _shows_in_motion(case, fix)
        for column, (granules, way) in enumerate(zip(both, ("along", "across"), strict=True)):
            if granules.size == 0:
                continue
            k = int(granules[np.argmax(fix.largest_in_motion[granules, column])])
            force, at_rest = fix.largest_in_motion[k, column], fix.largest[k, column]
            before = f"{at_rest:.3g} N" if at_rest > ACTS * case.scene.units.force else "none"
            # Forces of walls at rest are not kept.
            still = "" if fix.style.startswith("wall") else f", and {before} at rest"
            made.append(
                Difference(
                    force, 0.0, f"force of fix {fix.style} {way} the chain",
                    sentence=f"fix {fix.style} exerts up to {force:.3g} N {way} the chain on"
                    f" {case.granule_name(granules)} in motion{still}; the"
                    " scene has no such force", at=fix.command, command=WITHOUT,
                )
            )  # fmt: skip
    return made


def _random(case: Case) -> list[Difference]:
    """Random forces: no run repeats another."""
    for index in commands_of(case.found, "random"):
        words = case.found.commands[index].text.split()
        if words[0] == "fix":
            return [
                Difference(
                    1, 0, effect=case.whole_effect, at=index, command=WITHOUT,
                    sentence=f"{' '.join(words[:4])} pushes granules at random, the scene is not"
                    " random",
                )
            ]  # fmt: skip
    return []


# ---- The shock


def _across(case: Case) -> list[Difference]:
    found = case.found
    side, least = found.applied_sideways, case.least(ACTS) * case.scene.units.force
    if side <= least:
        return []
    return [
        of_shock(case, Difference(
            side, 0.0, effect=case.whole_effect, room=least,
            sentence=f"an applied force of up to {side:.4g} N acts across the chain, which lies"
            f" along {found.axis}",
        ))
    ]  # fmt: skip


def _pushed(case: Case) -> tuple[FloatArray, Indices, float]:
    """Largest applied force on each granule, pushed granules other than the scene's, and a limit.

    Forces are in N; those below the limit do not count.
    """
    largest = np.max(np.abs(case.found.applied_force), axis=0, initial=0.0)
    least = case.least(ACTS) * case.scene.units.force
    at = np.flatnonzero(largest > least)
    return largest, at[at != case.scene.pushed], least


def _others(case: Case) -> list[Difference]:
    """Forces on granules that the scene does not push."""
    largest, others, least = _pushed(case)
    if not case.scene.ramps or not others.size:
        return []
    who, mine = case.granule_name(others), case.granule_name(case.scene.pushed)
    too = largest.size > case.scene.pushed and largest[case.scene.pushed] > least
    if too:
        sentence = (
            f"the applied force acts on {mine} and on {who}, too, with up to"
            f" {np.max(largest[others]):.4g} N; the scene pushes {mine} alone"
        )
    else:
        sentence = f"the applied force acts on {who} and not on {mine}, the scene's"
    pushing = [fix.command for fix in case.pushing(others)]
    return [
        Difference(
            int(others.size) + too, 1, effect=1.0, sentence=sentence,
            changes=_with_others(case, others) if too else None, role="pushed",
            at=pushing[-1] if pushing else None,
        )
    ]  # fmt: skip


def _shock(case: Case) -> list[Difference]:
    """The applied force over time on its granule; also if it is missing, or not in the scene."""
    scene, (largest, others, least) = case.scene, _pushed(case)
    top, mine = float(np.max(largest, initial=0.0)), case.granule_name(scene.pushed)
    if scene.ramps and largest.size > scene.pushed and largest[scene.pushed] > least:
        return pulse(case)
    if scene.ramps and not others.size and case.found.applied_sideways <= least:
        one = Difference(
            top, scene.peak_force, f"applied force on {mine}", effect=1.0,
            sentence=f"no applied force acts along the chain on {mine}, the scene pushes it"
            f" with up to {scene.peak_force:.4g} N",
        )  # fmt: skip
        return [of_shock(case, one)]
    if scene.ramps or top <= least:
        return [same(top, 0.0, least)] if case.exact and not scene.ramps else []
    return [
        of_shock(case, Difference(
            top, 0.0, changes=pushing_changes(case, np.flatnonzero(largest > 0)),
            sentence=f"an applied force of up to {top:.4g} N acts, the scene has none",
            command=WITHOUT,
        ))
    ]  # fmt: skip


def _with_others(case: Case, granules: Indices) -> dict[str, Any]:
    """Forces on some granules besides the scene's own."""
    granules = granules[granules < case.twin.mass.size]
    extra = stretches_of(case.found, case.scene, case.start, granules)
    both = tuple(
        replace(one, applied=np.hstack([one.applied, more.applied]))
        for one, more in zip(case.stretches, extra, strict=True)
    )
    return {"pushed": np.append(case.twin.pushed, granules), "stretches": both}


# ---- The piston


def _driven(case: Case) -> Difference:
    """Granules with prescribed motion: only granule 1, and only in a scene with a piston."""
    found = case.found
    led, wanted = np.flatnonzero(found.driven), int(case.scene.piston is not None)
    who = case.granule_name(led)
    right = "granule 1 alone" if wanted else "no granule"
    return Difference(
        led.size, wanted, effect=math.inf,
        room=0.0 if np.array_equal(led, np.arange(wanted)) else -math.inf,
        sentence=f"a fix drives {who}, whatever presses them; the scene drives {right}",
        at=_leading(case) if led.size else None, command=WITHOUT if led.size else "",
    )  # fmt: skip


def _leading(case: Case) -> int | None:
    """The command that prescribes the motion, or that of its formula."""
    found = case.found
    moving = [fix.command for fix in found.fixes if fix.moves and "move" in fix.style]
    return formula_of(found, place_at(found, moving[-1])).index if moving else None


def _piston(case: Case) -> Difference | list[Difference]:
    found, piston = case.found, case.scene.piston
    if piston is None or not found.driven_time.size or _driven(case).differs:
        return []
    time = found.driven_time - case.start
    expected = displacement(piston, time)
    off = np.abs(found.driven_displacement - expected)
    way = piston.distance(case.scene.end_time)
    k = int(np.argmax(off))
    measured, should, unit = found.driven_displacement[k], expected[k], case.units.velocity
    # A piston by fix setforce has its velocity from another command.
    moves = any(fix.style == "move" for fix in found.fixes)
    stands = []
    if piston.velocity is not None and time[k] > 0:
        stands = [(float(measured / time[k]) / unit, piston.velocity / unit)]
    is_number = piston.velocity is not None or not moves
    return Difference(
        measured, should, relative=float((measured - should) / way),
        changes={"stretches": stretches_of(found, case.scene, case.start, use_driven=True)},
        sentence=f"the displacement of granule 1 at {time[k]:.4g} s"
        f" {values(float(measured), float(should), 'm')}", stands=stands,
        role="piston" if moves else "velocity", at=None if is_number else _leading(case),
        room=case.least(ROUND_OFF) * (way + float(case.near[0])) + case.rounded,
    )  # fmt: skip


FORCES = (
    Number("constant force", "N", "constant force", _constant,
           "the scene has no constant force"),
    Number("constant force across the chain", "N", "constant force", _constant_across,
           "the scene has no force across the chain; one that moves all alike"
           " leaves the peaks", explains=True),
    Number("drag", "N s/m", "drag", _drag,
           "a force against a velocity: the scene has none"),
    Number("random forces", "", "random", _random,
           "the scene has no random force", explains=True),
    Number("applied force across the chain", "N", "shock", _across,
           "the scene pushes along the chain", explains=True),
    Number("granules that are pushed", "", "shock", _others,
           "granule 1 is the first of the chain, and the scene pushes one granule"),
    Number("applied force", "N", "shock", _shock, "the shock of the scene"),
    Number("driven granules", "", "piston", _driven,
           "counts must be equal", explains=True),
    Number("displacement of the piston", "m", "piston", _piston),
)  # fmt: skip
"""Numbers of forces at rest and in motion, and of prescribed motion."""

IN_MOTION = Number("force of the motion", "N", "motion", _in_motion,
                   "the scene has no force of the motion", explains=True)  # fmt: skip
