"""Corrections that may make a number of a deck the scene's, best guesses first; none is proven.

A correction is a set of edits: what stands in place of some lines, one command each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hertzchain.engines.lammps.reading.found import Executed
from hertzchain.verdict.deck.deck_check import ACTS, Case, DeckCheck
from hertzchain.verdict.deck.places import (
    SIZES,
    WITHOUT,
    Changes,
    Place,
    commands_of,
    place_at,
    variables_of,
)
from hertzchain.verdict.deck.right_commands import (
    first_alone,
    granule_commands,
    in_text,
    law_commands,
    load_commands,
    motion_commands,
    neighbour_commands,
    piston_commands,
    place_commands,
    shock_commands,
    velocity_commands,
    wall_commands,
)

# ---- Edits


def _at(place: Place | Executed) -> tuple[str, int, str]:
    """The key of a command in changes."""
    return place.file, place.line, place.written


def _without(case: Case, indices: Sequence[int]) -> Changes:
    """A deck without some commands, and without what names the fixes that they make."""
    commands = case.found.commands
    fixes = {commands[k].text.split()[1] for k in indices if commands[k].text.startswith("fix ")}
    users = [[word, name] for word in ("unfix", "fix_modify") for name in fixes]
    gone = [*indices, *(k for k, one in enumerate(commands) if one.text.split()[:2] in users)]
    places = [place_at(case.found, k) for k in gone]
    return {_at(place): (f"# {place.written}",) for place in places}


def _whole(case: Case, lines: Sequence[str], old: Sequence[int]) -> Iterator[Changes]:
    """Commands in place of the first of some of the deck, or of all these before its first run.

    Fixes keep the names of those in whose place they stand.
    """
    commands, lines = case.found.commands, list(lines)
    while old and lines and commands[old[0]].text.split() == lines[0].split():
        old, lines = old[1:], lines[1:]
    fixes = (commands[k].text.split()[1] for k in old if commands[k].text.startswith("fix "))
    for k, line in enumerate(lines):
        words = line.split()
        if words[0] == "fix":
            lines[k] = " ".join(["fix", next(fixes, words[1]), *words[2:]])
    gone = _without(case, old)
    if old:
        yield {**gone, _at(place_at(case.found, old[0])): tuple(lines)} if lines else gone
    if lines:
        run = commands[case.found.first_run]
        yield {**gone, _at(run): (*lines, run.written)}


# ---- Lines that change in a way of their own


def _ends(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """A box that is not periodic along the chain."""
    found = case.found
    if found.axis in "xyz":
        bounds = [*found.boundary.split(), "p", "p", "p"][:3]
        bounds["xyz".index(found.axis)] = "f"
        made = [one for one in found.commands if one.text.startswith("boundary")]
        yield {_at(one): (f"boundary {' '.join(bounds)}",) for one in made}


def _formula(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """A clock that begins at 0, or the formula of the shock in place of the deck's."""
    early = case.found.commands[: case.found.first_run]
    for one in [one for one in early if one.text.startswith("reset_timestep")][-1:]:
        yield {_at(one): ("reset_timestep 0",)}
    lines = shock_commands(case)
    if lines and check.place is not None and check.place.written.startswith("variable"):
        yield {_at(check.place): (lines[0],)}


def _as_many_steps(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """A shorter time step, with as many more steps in each run."""
    found, where = case.found, check.place
    if where is None or check.expected is None or not found.runs:
        return
    old, new = max(run.dt for run in found.runs), check.expected
    edits: Changes = {_at(where): (check.command,)}
    last = min(found.end_time, case.start + case.scene.end_time)
    for run in found.runs:
        where = place_at(found, run.command)
        words = where.written.split()
        if run.dt == old and len(words) > 1 and words[0] == "run" and words[1].isdigit():
            end = min(run.start + run.steps * old, last)
            steps = max(1, math.ceil((end - run.start) / new * (1 - 1e-12)))
            edits[_at(where)] = (" ".join([words[0], str(steps), *words[2:]]),)
    yield edits


def pushed_alone(case: Case) -> dict[int, tuple[str, ...]]:
    """By command, what stands there so that the shock pushes granule 1 alone."""
    found, texts = case.found, case.found.commands
    first = [fix.command for fix in case.pushing(np.zeros(1, np.intp))]
    pushing = case.pushing(np.arange(1, found.ids.size))
    # Loads push others, too; the shock has a formula, where any force has one.
    pushing = (
        [fix for fix in pushing if "v_" in texts[fix.command].text]
        or [fix for fix in pushing if fix.style != "gravity"]
        or pushing
        or [fix for fix in found.fixes if fix.style == "addforce" and not fix.granules.any()]
    )
    acts = np.any(np.abs(found.applied_force[:, 0]) > ACTS * case.scene.units.force)
    extra = [fix.command for fix in pushing if acts and fix.command not in first]
    extra += [fix.command for fix in pushing if fix.style == "gravity"]
    right = first_alone(found, [fix for fix in pushing if fix.command not in extra])
    gone = {k: (f"# {texts[k].written}",) for k in extra}
    return {**{k: tuple(lines) for k, lines in right.items()}, **gone}


def _pushed_alone(case: Case, _: DeckCheck) -> Iterator[Changes]:
    yield {_at(case.found.commands[k]): lines for k, lines in pushed_alone(case).items()}


def _place(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """A number of a variable from which a place follows: in proportion, or with a difference."""
    texts, mine, right = case.found.commands, check.measured, check.expected
    if not mine or not right:
        return
    used = {at for k in commands_of(case.found, "place") for at in variables_of(texts, k)}
    for at in sorted(used, key=lambda k: (len(texts[k].written.split()[-1]), k)):
        text = texts[at].written
        if "loop" in text.split():
            continue
        for match in SIZES.finditer(text):
            old, (start, end) = float(match.group()), match.span()
            tried = [old * right / mine]
            if text.split()[-1] == match.group():
                tried.append(old + (right - mine) / case.units.length)
            for new in tried:
                if new != old:
                    yield {_at(texts[at]): (f"{text[:start]}{in_text(new)}{text[end:]}",)}


# ---- What a number is set by


def _nothing(_: Case, __: DeckCheck) -> list[int]:
    return []


def _all_of(role: str) -> Callable[[Case, DeckCheck], list[int]]:
    """All commands of a role."""
    return lambda case, _: commands_of(case.found, role)


def _its_own(name: str) -> Callable[[Case, DeckCheck], list[int]]:
    """The command that is blamed, if it begins so."""

    def blamed(_: Case, check: DeckCheck) -> list[int]:
        place = check.place
        return [place.index] if place is not None and place.written.startswith(name) else []

    return blamed


def _pushing(case: Case, of_time: bool) -> list[int]:
    """Fixes that push along the chain, with a formula or without."""
    texts = case.found.commands
    return [
        fix.command
        for fix in case.found.fixes
        if not fix.moves and fix.style in ("gravity", "addforce", "setforce", "aveforce", "efield")
        and np.any(fix.largest > 0) and ("v_" in texts[fix.command].text) == of_time
    ]  # fmt: skip


def _loads(case: Case, _: DeckCheck) -> list[int]:
    return _pushing(case, of_time=False)


def _shocks(case: Case, _: DeckCheck) -> list[int]:
    return _pushing(case, of_time=True) or _pushing(case, of_time=False)


def _movers(case: Case, _: DeckCheck) -> list[int]:
    """Fixes that let granules move by their forces."""
    return [fix.command for fix in case.found.fixes if fix.moves and fix.style != "move"]


_BY_LINE = {
    "image": _ends,
    "shock": _formula,
    "pushed": _pushed_alone,
    "timestep": _as_many_steps,
    "place": _place,
}
"""Changes of single lines, by the role of a number."""

_SETTINGS = {
    "radius": (granule_commands, _nothing),
    "mass": (granule_commands, _nothing),
    "place": (place_commands, _nothing),
    "velocity": (velocity_commands, _its_own("velocity")),
    "spin": (velocity_commands, _its_own("velocity")),
    "contacts": (law_commands, _all_of("contacts")),
    "wall": (wall_commands, _its_own("fix")),
    "constant force": (load_commands, _loads),
    "gravity": (load_commands, _loads),
    "shock": (shock_commands, _shocks),
    "piston": (piston_commands, _all_of("piston")),
    "motion": (motion_commands, _movers),
    "neighbours": (neighbour_commands, _all_of("neighbours")),
}
"""By the role of a number: the scene's commands that set it, and those of the deck that go.

The former are None where commands cannot say it.
"""


def corrections(case: Case, check: DeckCheck, role: str) -> Iterator[Changes]:
    """The line of a check as its own number says, then changes by its role."""
    where = check.place
    if where is not None and check.command == WITHOUT:
        yield _without(case, [where.index])
    elif where is not None and check.command:
        yield {_at(where): tuple(check.command.split("\n"))}
    if role in _BY_LINE:
        yield from _BY_LINE[role](case, check)
    if role in _SETTINGS:
        commands, replaced = _SETTINGS[role]
        lines = commands(case)
        if lines is not None:
            yield from _whole(case, lines, replaced(case, check))
