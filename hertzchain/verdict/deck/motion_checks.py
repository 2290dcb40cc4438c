"""Motion of a deck against the one that its own numbers should make."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hertzchain.observables.peaks import judged_contacts
from hertzchain.verdict.deck.damping_checks import damping_numbers
from hertzchain.verdict.deck.deck_check import ROUND_OFF, Case, DeckCheck, placed, same
from hertzchain.verdict.deck.measured import stretches_of
from hertzchain.verdict.deck.moving_forces import moving_force_checks
from hertzchain.verdict.deck.places import formula_of, place_at
from hertzchain.verdict.deck.twin import Twin, TwinRun, run_twin

_FITTED = 1e-2  # of the largest effect of a failed check: what fitting its law misses (chosen)
_LATE = 0.02  # of the largest: late collisions multiply what digits make of it (chosen)

_EXPLAINS = (
    "contacts", "force of", "constant force across", "applied force across", "neighbours",
    "granules that are led", "number of granules", "integrators", "contacts across",
    "distance from", "random", "spin", "velocity across", "wall at",
    "wall in motion",
)  # fmt: skip
"""Checks of what no chain of velocity Verlet along a line can have: these explain its motion."""


def motion_checks(case: Case, others: Sequence[DeckCheck]) -> list[DeckCheck]:
    """The deck's own peaks against those which all its numbers should make."""
    found = case.found
    forces = moving_force_checks(case, others)
    failed = [check for check in others if not check.passed and check.effect != 0]
    if any(check.name.startswith(_EXPLAINS) for check in failed):
        return forces
    twin = found_twin(case)
    run = run_twin(twin, case.deadline)
    measured, expected = found.peak_force, run.peak_force
    size = min(measured.size, expected.size)
    if not np.all(np.isfinite(expected)):
        return forces
    pressed = expected[:size] > ROUND_OFF * np.max(case.truth.all_peaks)  # else it is round-off
    contacts = np.flatnonzero(judged_contacts(expected[:size]) & pressed & case.judged[:size])
    if contacts.size == 0:
        return [*forces, *([] if forces else _end_of_motion(case, run))]
    off = measured[contacts] / expected[contacts] - 1
    k = int(np.argmax(np.where(np.isfinite(off), np.abs(off), np.inf)))
    contact, change = int(contacts[k]), float(np.abs(off[k]))
    effects = [check.effect or 0.0 for check in others if not check.passed]
    allowed = case.tolerance + found.peak_reading_error + _FITTED * max(effects, default=0.0)
    reason = (
        "velocity Verlet with the deck's own numbers and steps, forces and shock; allowed is the"
        " tolerance and what the readings cost"
    )
    if forces:  # these are what the numbers do not have
        return [replace(check, effect=change) for check in forces]
    name = f"motion, by the peak of contact {contact + 2}"
    if change <= allowed:
        check = same("motion", "N", float(measured[contact]), float(expected[contact]), reason)
        return [replace(check, effect=change), *_end_of_motion(case, run)]
    check = DeckCheck(
        name, "N", float(measured[contact]), float(expected[contact]), change, False, True,
        f"the peak of contact {contact + 2} is {measured[contact]:.5g} N, the numbers of the deck"
        f" make {expected[contact]:.5g} N: something else acts on the granules while it runs, or"
        " moves them otherwise", reason,
    )  # fmt: skip
    return [_moved(case, check)]


def _end_of_motion(case: Case, run: TwinRun) -> list[DeckCheck]:
    """Places and velocities at the end: what shifts all granules alike leaves the peaks."""
    found = case.found
    if any(fix.style == "halt" for fix in found.fixes):
        return []  # a run that is ended is not read at its end
    for name, unit, measured, expected in (
        ("velocities at the end", "m/s", found.final_velocity, run.velocity),
        ("places at the end", "m", found.final_position - found.position, run.displacement),
    ):
        natural = case.scene.units.velocity if unit == "m/s" else case.scene.units.length
        most = max(float(np.max(np.abs(expected))), ROUND_OFF * natural)  # rounded places move it
        off = np.abs(measured - expected)
        k = int(np.argmax(np.where(np.isfinite(off), off, np.inf)))
        if off[k] > _LATE * most:
            what = "velocity" if unit == "m/s" else "displacement"
            check = DeckCheck(
                f"motion, by {name}", unit, float(measured[k]), float(expected[k]), 0.0, False,
                True, f"the {what} of granule {k + 1} at the end is {measured[k]:.4g} {unit}, the"
                f" numbers of the deck make {expected[k]:.4g} {unit}",
                f"velocity Verlet with the deck's own numbers; allowed is {_LATE:g} of the largest",
            )  # fmt: skip
            return [_moved(case, check)]
    return []


_CHANGES = re.compile(
    r"(?:pair_coeff|pair_style|set|velocity|displace_atoms|change_box|delete_atoms|create_atoms"
    r"|unfix|fix)\s"
)
"""Commands that change a chain between two runs."""

_USUAL = re.compile(r"fix\s+\S+\s+\S+\s+(?:nve|nve/sphere|addforce|gravity|wall/\S+|move)\s")


def _moved(case: Case, check: DeckCheck) -> DeckCheck:
    """A check of the motion with the line that is most likely to disturb it.

    That is a change after the first run, but for forces of the shock; else a fix that is neither an
    integrator nor a force; else the force of the shock, which may depend on the motion or act
    between two readings; else the last command on motion.
    """
    found = case.found
    words = [one.text.split() for one in found.commands]
    shock = {words[fix.command][1] for fix in found.fixes if fix.style == "addforce"}

    def disturbs(k: int) -> bool:
        if not found.commands[k].carried_out or not _CHANGES.match(found.commands[k].text):
            return False
        is_shock = words[k][0] in ("fix", "unfix") and words[k][1] in shock
        return not is_shock and words[k][3:4] != ["addforce"]

    later = [k for k in range(found.first_run + 1, len(words)) if disturbs(k)]
    odd = [
        k
        for k, one in enumerate(found.commands)
        if one.carried_out and one.text.startswith("fix ") and not _USUAL.match(f"{one.text} ")
    ]
    for suspects in (later, odd):
        if suspects:
            where = place_at(found, suspects[0])
            return replace(check, place=where, command="without this command")
    pushing = [fix for fix in found.fixes if fix.style == "addforce"]
    if pushing and case.scene.ramps:
        where = formula_of(found, place_at(found, pushing[-1].command))
        return replace(check, place=where)
    return placed(check, found, "motion")


def found_twin(case: Case) -> Twin:
    """The chain with all numbers of the deck; laws and shock by their readings."""
    found, twin = case.found, case.twin
    stiffness, exponent = np.array(twin.stiffness), np.array(twin.exponent)
    for k, law in enumerate(case.laws):
        stiffness[k], exponent[k] = law.stiffness, law.exponent
    opening = np.array(twin.opening)
    # Where contacts begin: radii may differ from the scene's, and contacts then do, too.
    touching = found.radius[:-1] + found.radius[1:]
    opening[: touching.size] = np.diff(found.position) - touching
    wall = next((wall for wall in found.walls if wall.end == "last"), None)
    if case.scene.wall is not None and wall is not None:
        opening[-1] = wall.position - float(found.position[-1]) - float(found.radius[-1])
    elif case.scene.wall is not None:
        stiffness[-1] = 0.0
    pushed = np.flatnonzero(np.max(np.abs(found.applied_force), axis=0, initial=0.0) > 0)
    pushed = pushed if pushed.size else np.zeros(1, np.intp)
    return replace(
        twin,
        mass=np.append(math.inf, found.mass[1:]) if found.driven[0] else found.mass,
        velocity=found.velocity[:, 0],
        constant_force=found.constant_force[:, 0],
        drag=np.zeros_like(found.drag) if case.settles else np.nan_to_num(found.drag),
        stiffness=stiffness,
        exponent=exponent,
        opening=opening,
        pushed=pushed,
        stretches=stretches_of(
            found, case.scene, case.start, pushed, use_driven=bool(found.driven[0])
        ),
        **damping_numbers(case),  # type: ignore[arg-type]
    )
