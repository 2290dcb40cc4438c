"""Steps, runs and motion of a deck against the scene, and its peaks against the reference."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from hertzchain.engines.native.methods import METHODS
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.peaks import judged_contacts
from hertzchain.verdict.check import apart
from hertzchain.verdict.deck.damping_numbers import damping_of_twin
from hertzchain.verdict.deck.deck_check import ROUND_OFF, Case, DeckCheck, values
from hertzchain.verdict.deck.measured import far_wall, stretches_of
from hertzchain.verdict.deck.number import Difference, Number, same
from hertzchain.verdict.deck.places import WITHOUT, formula_of, place_at
from hertzchain.verdict.deck.twin import Stretch, Twin, TwinRun, change_of_peaks, run_twin

_MISSED = 0.1  # fraction of the largest overlap: contacts that act later are missed (chosen)
_ERROR = 0.5  # of velocity Verlet with a step of 1 in natural units, by its order (chosen)
_MARGIN = 0.8  # of the longest step with the wanted accuracy: a rounder number fits below (chosen)
_FITTED = 1e-2  # of the largest effect of a failed check: what fitting its law misses (chosen)
_LATE = 0.02  # fraction of the largest: late collisions amplify differences of digits (chosen)


def _step(case: Case) -> Difference:
    """The error of velocity Verlet at the deck's steps, with all numbers of the scene."""
    unit = case.units.time
    dt = max((run.dt for run in case.found.runs), default=0.0)
    longest = stable_step(case.scene, METHODS["velocity-verlet"].interval)
    error = change_of_peaks(case.expected.peak_force, case.peaks, case.judged)
    unstable = dt >= longest
    right = _wanted_step(dt, longest, error, case)
    how = (
        f"above the longest stable one, {longest:.3g} s" if unstable
        else f"with which velocity Verlet is off by {error:.2g}"
    )  # fmt: skip
    wrong = unstable or error > case.tolerance
    return Difference(
        dt, right if wrong else dt, effect=math.inf if unstable else error, room=0.0,
        sentence=f"the time step is {dt:.4g} s, {how}", stands=[(dt / unit, right / unit)],
        command=f"timestep {right / unit:.6g}",
    )  # fmt: skip


def _wanted_step(dt: float, longest: float, error: float, case: Case) -> float:
    """A step of two digits with the wanted accuracy, from one that is too long [s]."""
    order = 2 if case.scene.contact is None else 1
    if 0 < error < 0.5:  # none where no contact is judged, infinite where the motion diverges
        accurate = dt * (case.tolerance / error) ** (1 / order)
    else:
        accurate = case.scene.units.time * (case.tolerance / _ERROR) ** (1 / order)
    unit = case.units.time
    wanted = min(longest / 4, dt / 2, _MARGIN * accurate) / unit
    digits = 10 ** math.floor(math.log10(wanted))
    return float(math.floor(wanted / digits * 10) / 10 * digits * unit)


def _end(case: Case) -> Difference:
    """Whether the deck runs until the last peak of the scene."""
    found = case.found
    end, wanted = found.end_time - case.start, case.scene.end_time
    late = int(np.count_nonzero(~case.judged))
    have = "contact has" if late == 1 else "contacts have"
    which = f": {late} {have} not passed the peak by then" if late else ", after the last peak"
    ends = apart(end, wanted)
    one = Difference(
        end, wanted, relative=None if late else 0.0, reason=_SEEN,
        sentence=f"the deck ends {ends[0]} s after the shock begins, the scene {ends[1]} s{which}",
        room=-math.inf if end < wanted * (1 - 1e-9) else math.inf,  # a step may miss it by rounding
    )  # fmt: skip
    if not found.runs:
        return one
    last = found.runs[-1]
    more = math.ceil((wanted - end) / last.dt - 1e-6) + last.steps
    return replace(one, at=last.command, stands=[(last.steps, more)])


_SEEN = "peaks that come later than the deck's end cannot be judged"


def _integrators(case: Case) -> Difference:
    """Each granule must be moved by exactly one fix, and fixed ones by none."""
    moved, found = case.found.integrated, case.found
    expected = np.ones(moved.size)
    fixed = case.scene.granules.fixed
    expected[fixed[fixed < moved.size]] = 0
    wrong = np.flatnonzero(moved != expected)
    if wrong.size == 0:
        return same(1, 1, 0.0)
    k = int(wrong[0])
    wanted = int(expected[k])
    lets = "lets each granule move once" if wanted else f"fixes {case.granule_name(k)}"
    movers = [fix for fix in found.fixes if fix.moves and (moved[k] == 0 or fix.granules[k])]
    return Difference(
        int(moved[k]), wanted, effect=math.inf,
        sentence=f"{case.granule_name(wrong)}"
        f" {'is' if wrong.size == 1 else 'are'} moved by {moved[k]}"
        f" fix{'' if moved[k] == 1 else 'es'}, the scene {lets}",
        at=movers[-1].command if movers else found.first_run,
        command=WITHOUT if moved[k] > 1 else "",
    )  # fmt: skip


def _missed(case: Case) -> Difference:
    """A contact that overlapped without a force: neighbours not listed, or a removed wall."""
    overlaps, wall = case.found.missed_overlap, far_wall(case.found)
    k = int(np.argmax(overlaps)) if overlaps.size else 0
    missed = float(overlaps[k]) if overlaps.size else 0.0
    room = _MISSED * float(case.near[min(k, case.near.size - 1)])
    if missed > room and wall is not None and k == case.found.position.size - 1:
        text = re.sub(r"\s(?:wiggle|shear)\s.*", "", case.found.commands[wall.command].text)
        return Difference(
            missed, 0.0, "wall in motion", effect=case.whole_effect, at=wall.command, command=text,
            sentence=f"the last granule is up to {missed:.3g} m beyond the place of the wall"
            " without a force: the wall moves, or ends, while the deck runs",
        )  # fmt: skip
    return Difference(
        missed, 0.0, effect=math.inf, room=room,
        sentence=f"{case.contact_name(k)} overlapped by up to {missed:.3g} m without a force:"
        " neighbours are looked for too rarely, or not far enough",
        command="neigh_modify delay 0 every 1 check yes",
    )  # fmt: skip


_CHOSEN = f"overlaps without a force while the deck ran; chosen: {_MISSED:g} of those expected"

INTEGRATORS = Number("integrators", "", "motion", _integrators, "counts must be equal",
                     explains=True)  # fmt: skip

RUNS = (
    Number("time step", "s", "timestep", _step,
           "the error of velocity Verlet with the numbers of the scene and the steps of the deck"
           " must be within the tolerance"),
    Number("end of the run", "s", "run", _end, _SEEN),
    INTEGRATORS,
    Number("neighbours", "m", "neighbours", _missed, _CHOSEN,
           explains=True),
)  # fmt: skip


# ---- The motion that follows from all numbers of the deck


def motion(case: Case, failed: Iterable[DeckCheck]) -> list[Difference]:
    """Compare the deck's peaks, then its final state, with those that all its numbers give."""
    found, run = case.found, run_twin(*_found_twin(case), case.deadline)
    measured, expected = found.peak_force, run.peak_force
    size = min(measured.size, expected.size)
    if not np.all(np.isfinite(expected)):
        return []
    pressed = expected[:size] > ROUND_OFF * np.max(case.peaks)  # else it is round-off
    contacts = np.flatnonzero(judged_contacts(expected[:size]) & pressed & case.judged[:size])
    if contacts.size == 0:
        return _end_of_motion(case, run)
    off = measured[contacts] / expected[contacts] - 1
    k = int(np.argmax(np.where(np.isfinite(off), np.abs(off), np.inf)))
    contact, change = int(contacts[k]), float(np.abs(off[k]))
    effects = max((check.effect or 0.0 for check in failed), default=0.0)
    mine, own, who = float(measured[contact]), float(expected[contact]), case.contact_name(contact)
    if change <= case.tolerance + found.peak_reading_error + _FITTED * effects:
        return [replace(same(mine, own, math.inf), effect=change), *_end_of_motion(case, run)]
    return [
        _moved(case, Difference(
            mine, own, f"motion, by the peak of {who}", effect=change,
            sentence=f"the peak of {who} is {mine:.5g} N, the numbers of the deck"
            f" make {own:.5g} N: something else acts on the granules while it runs, or moves them"
            " otherwise",
        ))
    ]  # fmt: skip


def _end_of_motion(case: Case, run: TwinRun) -> list[Difference]:
    """Places and velocities at the end: an equal shift of all granules changes no peak."""
    found, units = case.found, case.scene.units
    if any(fix.style == "halt" for fix in found.fixes):
        return []  # a run that was stopped has no reading at its end
    moved = found.final_position - found.position
    for name, what, unit, measured, expected, natural in (
        ("velocities", "velocity", "m/s", found.final_velocity, run.velocity, units.velocity),
        ("places", "displacement", "m", moved, run.displacement, units.length),
    ):
        most = max(float(np.max(np.abs(expected))), ROUND_OFF * natural)  # rounded places move it
        off = np.abs(measured - expected)
        k = int(np.argmax(np.where(np.isfinite(off), off, np.inf)))
        if off[k] > _LATE * most:
            both = apart(float(measured[k]), float(expected[k]))
            return [
                _moved(case, Difference(
                    measured[k], expected[k], f"motion, by {name} at the end", unit, effect=0.0,
                    sentence=f"the {what} of {case.granule_name(k)} at the end is"
                    f" {f' {unit}, the numbers of the deck make '.join(both)} {unit}",
                    reason="velocity Verlet with the deck's own numbers; allowed is"
                    f" {_LATE:g} of the largest",
                ))
            ]  # fmt: skip
    return []


_CHANGES = re.compile(
    r"(?:pair_coeff|pair_style|set|velocity|displace_atoms|change_box|delete_atoms|create_atoms"
    r"|unfix|fix)\s"
)
"""Commands that change a chain between two runs."""

_USUAL = re.compile(r"fix\s+\S+\s+\S+\s+(?:nve|nve/sphere|addforce|gravity|wall/\S+|move)\s")


def _moved(case: Case, one: Difference) -> Difference:
    """A difference of the motion with the line that is most likely to disturb it.

    This is a change after the first run, except of the shock; else a fix that is neither an
    integrator nor a force; else the force of the shock, which may depend on the motion or act
    between two readings; else the last command on motion.
    """
    found = case.found
    words = [command.text.split() for command in found.commands]
    shock = {words[fix.command][1] for fix in found.fixes if fix.style == "addforce"}

    def is_of_shock(k: int) -> bool:
        is_fix = words[k][0] in ("fix", "unfix") and words[k][1] in shock
        return is_fix or words[k][3:4] == ["addforce"]

    done = [k for k, command in enumerate(found.commands) if command.carried_out]
    later = [k for k in done if k > found.first_run and _CHANGES.match(found.commands[k].text)]
    odd = [k for k in done if words[k][0] == "fix" and not _USUAL.match(" ".join(words[k]) + " ")]
    suspects = [k for k in later if not is_of_shock(k)] or odd
    if suspects:
        return replace(one, at=suspects[0], command=WITHOUT)
    pushing = [fix for fix in found.fixes if fix.style == "addforce"]
    if pushing and case.scene.ramps:
        where = formula_of(found, place_at(found, pushing[-1].command))
        return replace(one, at=where.index, role="shock")
    return one


MOTION = Number("motion", "N", "motion", lambda _: [],
                "velocity Verlet with the deck's own numbers and steps; allowed is the tolerance"
                " and what the readings cost")  # fmt: skip


def _found_twin(case: Case) -> tuple[Twin, tuple[Stretch, ...]]:
    """The chain with all numbers of the deck, and its runs; laws and shock from readings."""
    found, twin = case.found, case.twin
    stiffness, exponent, opening = (
        np.array(numbers) for numbers in (twin.stiffness, twin.exponent, twin.opening)
    )
    held = found.integrated == 0
    for k, law in enumerate(case.laws):
        stiffness[k], exponent[k] = law.stiffness, law.exponent
    # The start of contacts depends on the radii, which may differ from the scene's.
    touching = found.radius[:-1] + found.radius[1:]
    opening[: touching.size] = np.diff(found.position) - touching
    wall = far_wall(found)
    if case.scene.wall is not None and wall is not None:
        opening[-1] = wall.position - float(found.position[-1]) - float(found.radius[-1])
    elif case.scene.wall is not None:
        stiffness[-1] = 0.0
    pushed = np.flatnonzero(np.max(np.abs(found.applied_force), axis=0, initial=0.0) > 0)
    pushed = pushed if pushed.size else np.zeros(1, np.intp)
    whole = twin._replace(
        mass=np.where(held, math.inf, found.mass),
        velocity=np.ascontiguousarray(found.velocity[:, 0]),
        constant_force=np.ascontiguousarray(found.constant_force[:, 0]),
        drag=np.nan_to_num(found.drag),
        stiffness=stiffness,
        exponent=exponent,
        opening=opening,
        pushed=pushed,
        **damping_of_twin(case),
    )
    return whole, stretches_of(found, case.scene, case.start, pushed, bool(found.driven[0]))


# ---- Its peaks


def peaks_check(case: Case) -> DeckCheck:
    """Compare the peaks of the deck with the reference: the final check."""
    found, truth = case.found, case.peaks
    size = min(found.peak_force.size, truth.size)
    contacts = np.flatnonzero(case.judged[:size])
    measured = expected = change = None
    if found.stopped:
        sentence = f"the deck does not come to its end: {found.stopped}"
    elif contacts.size == 0:
        sentence = "no contact had passed its peak when the deck ended"
    else:
        off = np.abs(found.peak_force[contacts] / truth[contacts] - 1)
        k = int(np.argmax(np.where(np.isfinite(off), off, np.inf)))
        contact, change = int(contacts[k]), float(off[k])
        measured, expected = float(found.peak_force[contact]), float(truth[contact])
        sentence = f"the peak of {case.contact_name(contact)} {values(measured, expected, 'N')}"
    passed = change is not None and change <= case.tolerance
    return DeckCheck(
        "peaks", "N", measured, expected, change, passed, not passed, sentence,
        f"asked for: {case.tolerance:g}; contacts that had not peaked by the deck's end are not"
        " judged",
    )  # fmt: skip
