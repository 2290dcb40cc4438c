"""Steps, runs and motion of a deck against the scene, and its peaks against the reference."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np

from hertzchain.engines.native import METHODS
from hertzchain.observables.error_bound import stable_step
from hertzchain.verdict.deck.deck_check import Case, DeckCheck, names, placed, same, values
from hertzchain.verdict.deck.measured import far_wall
from hertzchain.verdict.deck.places import ROLES, place_at
from hertzchain.verdict.deck.twin import change_of_peaks

_MISSED = 0.1  # of the largest overlap: contacts noticed later are missed (chosen)
_ERROR = 0.5  # of velocity Verlet with a step of 1 in natural units, by its order (chosen)
_MARGIN = 0.8  # of the longest step with the wanted accuracy: a rounder number fits below (chosen)


def step_checks(case: Case) -> list[DeckCheck]:
    """Time step, end, integrators and randomness."""
    return [_step(case), _end(case), *_integrators(case), *_neighbours(case), *_random(case)]


def _step(case: Case) -> DeckCheck:
    """The error of velocity Verlet at the deck's steps, with all numbers of the scene."""
    scene, found, unit = case.scene, case.found, case.units.time
    dt = max((run.dt for run in found.runs), default=0.0)
    longest = stable_step(scene, METHODS["velocity-verlet"].interval)
    error = change_of_peaks(case.expected.peak_force, case.truth.all_peaks, case.judged)
    name, reason = "time step", (
        "velocity Verlet with the numbers of the scene and the steps of the deck may be off by"
        f" {case.tolerance:g}"
    )  # fmt: skip
    if error <= case.tolerance and dt < longest:
        return replace(same(name, "s", dt, dt, reason), effect=error)
    right = wanted_step(dt, longest, error, case) / unit
    unstable = dt >= longest
    sentence = f"the time step is {dt:.4g} s, " + (
        f"above the longest stable one, {longest:.3g} s" if unstable
        else f"with which velocity Verlet is off by {error:.2g}"
    )  # fmt: skip
    check = DeckCheck(
        name, "s", dt, right * unit, math.inf if unstable else error, False, True, sentence, reason
    )
    return placed(check, found, "timestep", [(dt / unit, right)], f"timestep {right:.6g}")


def wanted_step(dt: float, longest: float, error: float, case: Case) -> float:
    """A step of two digits with the wanted accuracy, from one that is too long [s]."""
    order = 2 if case.scene.contact is None else 1
    wanted = min(longest / 4, dt / 2)
    if math.isfinite(error) and error < 0.5:
        wanted = min(wanted, _MARGIN * dt * (case.tolerance / error) ** (1 / order))
    else:
        natural = (_MARGIN * case.tolerance / _ERROR) ** (1 / order)
        wanted = min(wanted, natural * case.scene.units.time)
    unit = case.units.time
    digits = 10 ** math.floor(math.log10(wanted / unit))
    return float(math.floor(wanted / unit / digits * 10) / 10 * digits * unit)


def _end(case: Case) -> DeckCheck:
    """Whether the deck runs until the last peak of the scene."""
    scene, found = case.scene, case.found
    end, wanted = found.end_time - case.start, scene.end_time
    # The deck's last step may fall short of the end by a rounding error.
    if end >= wanted * (1 - 1e-9):
        return same("end of the run", "s", end, wanted, "the deck runs as long as the scene")
    late = int(np.count_nonzero(~case.judged))
    check = DeckCheck(
        "end of the run", "s", end, wanted, None, late == 0, True,
        f"the deck ends {end:.4g} s after the shock begins, the scene {wanted:.4g} s"
        + (f": {late} contacts have not passed their peaks by then" if late else
           ", after the last peak"),
        "peaks that come later than the deck's end cannot be judged",
    )  # fmt: skip
    if not found.runs:
        return placed(check, found, "run")
    last = found.runs[-1]
    more = math.ceil((wanted - end) / last.dt - 1e-6) + last.steps
    command = found.commands[last.command].text
    fallback = re.sub(r"run\s+\S+", f"run {more}", command)
    check = placed(check, found, "run", [(last.steps, more)], fallback)
    return (
        replace(check, place=place_at(found, last.command)) if check.command == fallback else check
    )


def _integrators(case: Case) -> list[DeckCheck]:
    """Each granule must be moved by exactly one fix."""
    moved = case.found.integrated
    wrong = np.flatnonzero(moved != 1)
    if wrong.size == 0:
        return [same("integrators", "", 1, 1, "counts must be equal")]
    k = int(wrong[0])
    who = names(wrong, moved.size, "granule", 1)
    check = DeckCheck(
        "integrators", "", int(moved[k]), 1, math.inf, False, True,
        f"{who} {'is' if wrong.size == 1 else 'are'} moved by {moved[k]} fixes, the scene lets each"
        " granule move once", "counts must be equal",
    )  # fmt: skip
    movers = [fix for fix in case.found.fixes if fix.moves and (moved[k] == 0 or fix.granules[k])]
    check = placed(check, case.found, "motion", (), "fix motion all nve")
    if movers:
        name = case.found.commands[movers[-1].command].text.split()[1]
        right = "without this fix: one integrator is enough"
        right = f"fix {name} all nve" if moved[k] == 0 else right
        check = replace(check, place=place_at(case.found, movers[-1].command), command=right)
    return [check]


def _neighbours(case: Case) -> list[DeckCheck]:
    """Contacts that a deck has missed, as it looks for neighbours too rarely."""
    missed = case.found.missed_overlap
    k = int(np.argmax(missed)) if missed.size else 0
    near = float(case.near[min(k, case.near.size - 1)])
    if missed.size == 0 or missed[k] <= _MISSED * near:
        return [same("neighbours", "m", 0.0, 0.0, "overlaps without a force while the deck ran")]
    wall = far_wall(case.found)
    if wall is not None and k == case.found.position.size - 1:
        check = DeckCheck(
            "wall in motion", "m", float(missed[k]), 0.0, case.whole_effect, False, True,
            f"the last granule is up to {missed[k]:.3g} m beyond the place of the wall without a"
            " force: the wall moves, or ends, while the deck runs",
            f"chosen: {_MISSED:g} of the overlap expected",
        )  # fmt: skip
        text = re.sub(r"\s(?:wiggle|shear)\s.*", "", case.found.commands[wall.command].text)
        return [replace(check, place=place_at(case.found, wall.command), command=text)]
    check = DeckCheck(
        "neighbours", "m", float(missed[k]), 0.0, math.inf, False, True,
        f"contact {k + 2} overlapped by up to {missed[k]:.3g} m without a force: neighbours are"
        " looked for too rarely, or not far enough", f"chosen: {_MISSED:g} of the overlap expected",
    )  # fmt: skip
    right = "neigh_modify delay 0 every 1 check yes"
    return [placed(check, case.found, "neighbours", (), right)]


def _random(case: Case) -> list[DeckCheck]:
    """Forces that are random: no run is like another."""
    patterns = [pattern for pattern in ROLES["random"] if pattern.startswith("fix")]
    for index, one in enumerate(case.found.commands):
        if one.carried_out and any(re.match(pattern, one.text) for pattern in patterns):
            check = DeckCheck(
                "random forces", "", 1, 0, case.whole_effect, False, True,
                f"{' '.join(one.text.split()[:4])} pushes granules at random, the scene is not"
                " random", "the scene has no random force",
            )  # fmt: skip
            return [replace(check, place=place_at(case.found, index), command="without this fix")]
    return []


def peaks_check(case: Case) -> DeckCheck:
    """The peaks of the deck against the reference: what all of it is for."""
    found, truth = case.found, case.truth.all_peaks
    reason = (
        f"asked for: {case.tolerance:g}; contacts that had not peaked by the deck's end are not"
        " judged"
    )
    size = min(found.peak_force.size, truth.size)
    contacts = np.flatnonzero(case.judged[:size])
    if found.stopped:
        return DeckCheck(
            "peaks", "N", None, None, None, False, True,
            f"the deck does not come to its end: {found.stopped}", reason,
        )  # fmt: skip
    if contacts.size == 0:
        return DeckCheck(
            "peaks", "N", None, None, None, False, True,
            "no contact had passed its peak when the deck ended", reason,
        )  # fmt: skip
    off = found.peak_force[contacts] / truth[contacts] - 1
    k = int(np.argmax(np.where(np.isfinite(off), np.abs(off), np.inf)))
    contact, change = int(contacts[k]), float(abs(off[k]))
    passed = bool(change <= case.tolerance)
    measured, expected = float(found.peak_force[contact]), float(truth[contact])
    return DeckCheck(
        "peaks", "N", measured, expected, change, passed, not passed,
        f"the peak of contact {contact + 2} {values(measured, expected, 'N')}", reason,
    )  # fmt: skip
