"""Corrections that may make a number of a deck the scene's, best guesses first; none is proven.

A correction is a set of edits: what stands in place of some lines, one command each.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence

import numpy as np

from hertzchain.engines.lammps.reading import FoundFix
from hertzchain.verdict.deck.changes import at, before_first_run, guessed, without
from hertzchain.verdict.deck.deck_check import Case, DeckCheck
from hertzchain.verdict.deck.group_names import fixes_of, unused
from hertzchain.verdict.deck.places import NUMBER, Changes, place_at
from hertzchain.verdict.deck.right_commands import (
    granule_commands,
    has_type,
    law_commands,
    load_commands,
    number,
    piston_commands,
    place_commands,
    shock_commands,
    velocity_commands,
    wall_command,
)

# ---- Granules


def granules(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """Diameters and densities of the scene."""
    yield before_first_run(case, granule_commands(case))


def places(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """All centres where the scene has them."""
    yield before_first_run(case, place_commands(case))


def room(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """A box with room at both ends, that is not periodic along the chain."""
    found, unit = case.found, case.units.length
    if found.axis not in "xyz":
        return
    k = "xyz".index(found.axis)
    # As LAMMPS has them: the chain may extend to smaller coordinates.
    ends = found.origin[k] + found.direction[k] * case.scene.granules.position[[0, -1]]
    widest = 4 * float(np.max(found.radius))
    low, high = (float(np.min(ends)) - widest) / unit, (float(np.max(ends)) + widest) / unit
    bounds = [*found.boundary.split(), "p", "p", "p"][:3]
    bounds[k] = "f"
    edits: Changes = {}
    box = [one.text.split()[2] for one in found.commands if one.text.startswith("create_box")]
    for one in found.commands:
        words = one.text.split()
        if words[:1] == ["boundary"] and bounds != found.boundary.split():
            edits[at(one)] = (f"boundary {' '.join(bounds)}",)
        is_box = words[:1] == ["region"] and words[1] in box and words[2:3] == ["block"]
        if is_box and ("units" in words or _unit_lattice(case)):
            words[3 + 2 * k : 5 + 2 * k] = number(low), number(high)
            edits[at(one)] = (" ".join(words),)
    yield edits


def _unit_lattice(case: Case) -> bool:
    """Whether lengths in regions are those of the box."""
    made = [one.text.split()[1:3] for one in case.found.commands if one.text.startswith("lattice")]
    return all(words[:1] == ["none"] or words[1:2] in (["1"], ["1.0"]) for words in made)


def velocities(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """Velocities at the start: none but that of a striker."""
    commands = velocity_commands(case)
    if check.place is not None and check.place.written.split()[0] == "velocity":
        yield without(case, check.place)
        yield {at(check.place): tuple(commands[:1] + commands[2:])}
    yield before_first_run(case, commands)


# ---- Contacts and walls


def _by_types(case: Case) -> Changes:
    """Moduli of materials in all lines that have others than those of their granules."""
    found, granules, unit = case.found, case.scene.granules, case.units
    edits: Changes = {}
    count = min(found.types.size, granules.young_modulus.size)
    for one in found.commands:
        words, written = one.text.split(), one.written.split()
        if words[:1] != ["pair_coeff"] or "hertz/material" not in words or len(words) < 7:
            continue
        law = words.index("hertz/material")
        kinds = [k for k in range(count) if has_type(words[1], int(found.types[k]))]
        materials = {(granules.young_modulus[k], granules.poisson_ratio[k]) for k in kinds}
        if len(materials) != 1 or words[1] != words[2] or len(words) != len(written):
            continue
        modulus, poisson = materials.pop()
        for place, right in ((law + 1, modulus / unit.pressure), (law + 3, poisson)):
            is_number = NUMBER.fullmatch(written[place]) is not None
            if is_number and abs(float(words[place]) - right) > 1e-9 * abs(right):
                written[place] = number(float(right))
        if written != one.written.split():
            edits[at(one)] = (" ".join(written),)
    return edits


def moduli(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """Moduli by types, then the whole law."""
    if "wall" not in check.name:
        yield _by_types(case)
    yield from laws(case, check)


def laws(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """The law of the scene in place of the deck's."""
    if "wall" in check.name:
        yield from wall(case, check)
        return
    lines = law_commands(case)
    own = [
        one
        for one in case.found.commands
        if one.carried_out and one.text.split()[0] in ("pair_style", "pair_coeff", "pair_modify")
    ]
    new = lines
    if not lines or not own:
        yield before_first_run(case, lines)
        return
    if own[0].text.split() == lines[0].split():  # the style stays
        own, new = own[1:], lines[1:]
    gone: Changes = {at(one): (f"# {one.written}",) for one in own}
    yield {**gone, at(own[0]): tuple(new)}


def wall(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """The wall of the scene, in place of the deck's or in front of the first run."""
    command = wall_command(case)
    if command is None:
        return
    where = check.place
    if where is not None and re.match(r"fix\s+\S+\s+\S+\s+wall/", where.written):
        words, new = where.written.split(), command.split()
        yield {at(where): (" ".join([*words[:3], *new[3:]]),)}
    yield before_first_run(case, [command])


# ---- Forces


def _pushing(case: Case, of_time: bool) -> list[FoundFix]:
    """Fixes that push along the chain, with a formula or without."""
    texts = case.found.commands
    return [
        fix
        for fix in case.found.fixes
        if not fix.moves and fix.style in ("gravity", "addforce", "setforce", "aveforce", "efield")
        and np.any(fix.largest > 0) and ("v_" in texts[fix.command].text) == of_time
    ]  # fmt: skip


def _in_place_of(case: Case, fixes: Sequence[FoundFix], lines: Sequence[str]) -> Changes:
    """Commands in place of the first of some fixes, without all of these."""
    places = [place_at(case.found, fix.command) for fix in fixes]
    gone: Changes = {}
    for place in places:
        gone |= without(case, place)
    return {**gone, at(places[0]): tuple(lines)} if places and lines else gone


def loads(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """Gravity and precompression of the scene in place of the deck's."""
    lines = load_commands(case)
    yield _in_place_of(case, _pushing(case, of_time=False), lines)
    yield before_first_run(case, lines)


def shock(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """The formula in place of the deck's; the whole shock in place of its forces."""
    made = shock_commands(case)
    lines = [] if made is None else [made.variable, *made.fix]
    if made is not None and check.place is not None and check.place.written.startswith("variable"):
        yield {at(check.place): (made.variable,)}
    pushing = _pushing(case, of_time=True) or _pushing(case, of_time=False)
    yield _in_place_of(case, pushing, lines) or before_first_run(case, lines)


def no_fix(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """The deck without a fix."""
    if check.place is not None and check.place.written.split()[0] == "fix":
        yield without(case, check.place)


def piston(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """The piston of the scene in place of what leads granules."""
    leading = [fix for fix in case.found.fixes if fix.style == "move"]
    lines = piston_commands(case)
    if lines:
        yield _in_place_of(case, leading, lines)


# ---- Steps


def step(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """A shorter time step, with as many more steps in each run; also without longer runs."""
    found, shorter = case.found, next(guessed(case, check), None)
    if shorter is None or not found.runs:
        return
    assert check.expected is not None
    old, new = max(run.dt for run in found.runs), check.expected
    edits = dict(shorter)
    last = min(found.end_time, case.start + case.scene.end_time)
    for run in found.runs:
        where = place_at(found, run.command)
        words = where.written.split()
        if run.dt == old and len(words) > 1 and words[0] == "run" and words[1].isdigit():
            end = min(run.start + run.steps * old, last)
            steps = max(1, math.ceil((end - run.start) / new * (1 - 1e-12)))
            edits[at(where)] = (" ".join([words[0], str(steps), *words[2:]]),)
    yield edits
    yield shorter


def run(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """As many steps more as are missing."""
    if not case.found.runs:
        return
    last = case.found.runs[-1]
    missing = case.scene.end_time + case.start - case.found.end_time
    more = math.ceil(missing / last.dt - 1e-6)
    where = place_at(case.found, last.command)
    yield {at(where): (where.written, f"run {more}")}


def movers(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """Each granule moved once."""
    found = case.found
    moving = [fix for fix in found.fixes if fix.moves]
    movers = [place_at(found, fix.command) for fix in moving]
    leads = [place_at(found, fix.command) for fix in moving if fix.style == "move"]
    if leads and movers[0] not in leads:  # the others are moved by their forces
        words, led = movers[0].written.split(), leads[0].written.split()[2]
        others = f"group others subtract all {led}"
        yield {at(movers[0]): (others, " ".join([*words[:2], "others", *words[3:]]))}
    whole = before_first_run(case, [f"fix {unused('motion', fixes_of(found))} all nve"])
    yield {**_in_place_of(case, moving, ()), **whole}


def neighbours(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """A search for neighbours in each step, far enough; velocities of all of them."""
    found = case.found
    skin = number(0.5 * float(np.min(case.scene.granules.radius)) / case.units.length)
    lines = [f"neighbor {skin} bin", "neigh_modify delay 0 every 1 check yes"]
    gone: Changes = {
        at(one): (f"# {one.written}",)
        for one in found.commands
        if one.text.split()[0] in ("neighbor", "neigh_modify", "comm_modify")
    }
    yield {**gone, **before_first_run(case, [*lines, "comm_modify mode single vel yes"])}


def motion(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """Without what is most likely to disturb the motion; with the scene's own force."""
    if check.place is not None and check.place.written.split()[:1] == ["fix"]:
        words = check.place.written.split()
        yield {at(check.place): (" ".join([*words[:3], "nve"]),)}
    if case.scene.ramps:
        yield from shock(case, check)
