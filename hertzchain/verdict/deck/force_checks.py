"""Forces that act on a deck's granules against the scene: the shock, gravity, drag."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hertzchain.engines.lammps.reading import FoundFix
from hertzchain.verdict.deck.deck_check import (
    ROUND_OFF,
    Case,
    DeckCheck,
    Indices,
    names,
    placed,
    same,
    values,
)
from hertzchain.verdict.deck.group_names import first_alone
from hertzchain.verdict.deck.measured import stretches_of
from hertzchain.verdict.deck.moving_forces import drags, shows_in_motion
from hertzchain.verdict.deck.places import Place, place_at
from hertzchain.verdict.deck.pulse_checks import ACTS, effect_of_all, of_shock, pulse_checks


def force_checks(case: Case) -> list[DeckCheck]:
    """All forces but those of contacts and walls."""
    return [*_constant(case), *_drag(case), *_shock(case)]


def _fix(case: Case, wanted: Callable[[FoundFix], bool]) -> Place | None:
    """The last fix that does something."""
    fixes = [fix for fix in case.found.fixes if not fix.moves and wanted(fix)]
    return place_at(case.found, fixes[-1].command) if fixes else None


def _constant(case: Case) -> list[DeckCheck]:
    """Gravity and static loads."""
    found, checks = case.found, []
    count = min(found.mass.size, case.twin.mass.size)
    measured, expected = found.constant_force[:count, 0], case.twin.constant_force[:count]
    scale = case.scene.units.force
    measured = measured + 0.0  # no -0
    off = measured - expected
    if scene_is_led(case):  # forces on a piston do not matter
        off[0] = 0.0
    k = int(np.argmax(np.abs(off)))
    if abs(off[k]) <= ROUND_OFF * scale:
        checks.append(same("constant force", "N", measured[k], expected[k], case.reason))
    else:
        constant = np.array(case.twin.constant_force)
        constant[:count] = measured
        change = case.effect(constant_force=constant)
        wanted = bool(np.any(expected))
        relative = off[k] / np.max(np.abs(expected)) if wanted else math.inf
        alike = np.flatnonzero(np.abs(off) > ROUND_OFF * scale)
        who = names(alike, count, "granule", 1)
        per_mass = measured / found.mass[:count]
        gravity = np.allclose(per_mass, per_mass[0], rtol=1e-6) and per_mass[0] != 0
        kind = f" (gravity of {per_mass[0]:.4g} m/s^2 along the chain)" if gravity else ""
        check = DeckCheck(
            f"constant force on {who}", "N", float(measured[k]), float(expected[k]), change,
            wanted and case.allowed(change, relative), True,
            f"the constant force on granule {k + 1} {values(measured[k], expected[k], 'N')}{kind}",
            case.reason if wanted else "the scene has no constant force",
        )  # fmt: skip
        old, new = abs(measured[k]) / case.units.force, abs(expected[k]) / case.units.force
        numbers = [(old, new)]
        unit = case.units.length / case.units.time**2
        pressed = case.scene.precompression
        right_gravity = 0.0 if pressed is None else pressed.gravity / unit
        if gravity:
            numbers.insert(0, (abs(float(per_mass[0])) / unit, right_gravity))
        fallback = "" if wanted else "without this fix"
        check = placed(check, found, "gravity" if gravity else "constant force", numbers, fallback)
        check = check if wanted else replace(check, command=fallback)
        if not np.any(measured):  # no command makes it
            check = replace(placed(check, found, "run", (), fallback), command=fallback)
        acts = _fix(case, lambda fix: bool(fix.largest[k, 0] > ROUND_OFF * scale))
        if (
            np.any(measured)
            and acts is not None
            and check.place is not None
            and _is_run(check.place)
        ):
            check = replace(check, place=acts)
        checks.append(check)
    across = found.constant_force[:, 1:]
    side = float(np.max(np.abs(across), initial=0.0))
    if side > ROUND_OFF * scale:
        falls = across / found.mass[:, np.newaxis]
        as_one = bool(np.allclose(falls, falls[0], rtol=1e-6, atol=1e-6 * np.max(np.abs(falls))))
        check = DeckCheck(
            "constant force across the chain", "N", side, 0.0,
            0.0 if as_one else case.whole_effect, False, True,
            f"a constant force of {side:.3g} N acts across the chain, the scene has none",
            "the scene has no force across the chain; one that moves all alike leaves the peaks",
        )  # fmt: skip
        check = placed(check, found, "constant force", (), "without this fix")
        acts = _fix(case, lambda fix: bool(np.max(fix.largest[:, 1]) > ROUND_OFF * scale))
        checks.append(check if acts is None else replace(check, place=acts))
    return checks


def scene_is_led(case: Case) -> bool:
    """Whether granule 1 of the scene is a piston."""
    return case.scene.piston is not None


def _is_run(where: Place) -> bool:
    return where.written.split()[:1] == ["run"]


def _drag(case: Case) -> list[DeckCheck]:
    found = case.found
    drag = np.where(np.isfinite(found.drag), found.drag, 0.0)
    scale = case.scene.units.force / case.scene.units.velocity
    k = int(np.argmax(np.abs(drag)))
    if abs(drag[k]) <= ROUND_OFF * scale:
        return [same("drag", "N s/m", float(drag[k]), 0.0, "a force against a velocity")]
    whole = np.zeros_like(case.twin.drag)
    count = min(drag.size, whole.size)
    whole[:count] = drag[:count]
    settles = case.settles
    until = ", until the shock begins" if settles else ""
    check = DeckCheck(
        "drag", "N s/m", float(drag[k]), 0.0, 0.0 if settles else case.effect(drag=whole), settles,
        True, f"a drag of {drag[k]:.3g} N s/m acts on granule {k + 1}{until}, the scene has none",
        "the scene has no drag" + (" while the shock runs" if settles else ""),
    )  # fmt: skip
    check = placed(check, found, "drag", (), "without this fix")
    acting = [fix for fix in found.fixes if drags(case, fix) and shows_in_motion(case, fix)[0].size]
    return [replace(check, place=place_at(found, acting[-1].command)) if acting else check]


def _shock(case: Case) -> list[DeckCheck]:
    """The applied force: on which granules, how large, how long, of which profile."""
    found, scene, checks = case.found, case.scene, []
    largest = np.max(np.abs(found.applied_force), axis=0, initial=0.0)
    top = float(np.max(largest, initial=0.0))
    scale = scene.units.force
    if found.applied_sideways > ACTS * scale:
        side = found.applied_sideways
        check = DeckCheck(
            "applied force across the chain", "N", side, 0.0, case.whole_effect, False, True,
            f"an applied force of up to {side:.4g} N acts across the chain, which lies along"
            f" {found.axis}", "the scene pushes along the chain",
        )  # fmt: skip
        checks.append(_turned(case, check))
    if not scene.ramps:
        if top > ACTS * scale:
            check = DeckCheck(
                "applied force", "N", top, 0.0, effect_of_all(case), False, True,
                f"an applied force of up to {top:.4g} N acts, the scene has none",
                "the scene has no such force",
            )  # fmt: skip
            checks.append(of_shock(case, check, (), "without this fix"))
        return checks
    if checks and (largest.size == 0 or top <= ACTS * scale):
        return checks  # all of it acts across
    others = np.flatnonzero(largest[1:] > ACTS * scale) + 1
    if others.size and largest[0] <= ACTS * scale:
        who = names(others, largest.size, "granule", 1)
        check = DeckCheck(
            "granules that are pushed", "", int(others.size), 1, 1.0, False, True,
            f"the applied force acts on {who} and not on granule 1, which the scene pushes",
            "granule 1 is the first of the chain",
        )  # fmt: skip
        return [*checks, _of_others(case, of_shock(case, check, (), "without this fix"), others)]
    if largest.size == 0 or largest[0] <= ACTS * scale:
        check = DeckCheck(
            "applied force on granule 1", "N", float(largest[0]) if largest.size else 0.0,
            scene.peak_force, 1.0, False, True,
            "no applied force acts along the chain on granule 1, the scene pushes it with up to"
            f" {scene.peak_force:.4g} N", "the shock of the scene",
        )  # fmt: skip
        return [*checks, of_shock(case, check, ())]
    if others.size:
        who = names(others, largest.size, "granule", 1)
        check = DeckCheck(
            "granules that are pushed", "", int(others.size) + 1, 1, _effect_of(case, others),
            False, True, f"the applied force acts on granule 1 and on {who}, too, with up to"
            f" {np.max(largest[others]):.4g} N; the scene pushes granule 1 alone",
            "counts must be equal",
        )  # fmt: skip
        checks.append(_of_others(case, of_shock(case, check, (), "without this fix"), others))
    return [*checks, *pulse_checks(case)]


def _turned(case: Case, check: DeckCheck) -> DeckCheck:
    """A check of a force across the chain with its fix, and the same with the force along it."""
    found, scale = case.found, ACTS * case.scene.units.force
    for fix in found.fixes:
        words = found.commands[fix.command].text.split()
        if fix.moves or float(np.max(fix.largest[:, 1])) <= scale or fix.style != "addforce":
            continue
        acting = [word for word in words[4:7] if word not in ("0", "0.0", "NULL")]
        vector = ["0.0"] * 3
        vector["xyz".index(found.axis)] = acting[0] if acting else "0.0"
        right = " ".join([*words[:4], *vector, *words[7:]])
        return replace(check, place=place_at(found, fix.command), command=right)
    return of_shock(case, check, ())


def _of_others(case: Case, check: DeckCheck, others: Indices) -> DeckCheck:
    """A check of forces on other granules with the line of their fix, or of its group."""
    found, scale = case.found, ACTS * case.scene.units.force
    pushing = [
        fix
        for fix in found.fixes
        if not fix.moves
        and not fix.style.startswith("wall")
        and float(np.max(fix.largest[others, 0])) > scale
    ]
    alone = check.measured == others.size  # none acts on granule 1
    if (
        pushing
        and not alone
        and (pushing[-1].style == "gravity" or pushing[-1].largest[0, 0] <= scale)
    ):
        where = place_at(found, pushing[-1].command)
        return replace(check, place=where, command="without this fix")
    assert check.place is not None
    where, right = first_alone(found, check.place)
    return replace(check, place=where, command=right)


def _effect_of(case: Case, granules: Indices) -> float | None:
    """What forces on some granules, besides the scene's own on granule 1, do to the peaks."""
    granules = granules[granules < case.twin.mass.size]
    extra = stretches_of(case.found, case.scene, case.start, granules)
    own = case.twin.stretches
    both = tuple(
        replace(one, applied=np.hstack([one.applied, more.applied]))
        for one, more in zip(own, extra, strict=True)
    )
    return case.effect(pushed=np.append(0, granules), stretches=both)
