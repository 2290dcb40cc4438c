"""Candidates for corrections of a deck's number, best guesses first; none is proven.

A correction is a set of edits: commands that replace some lines, one command each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hertzchain.engines.lammps.reading.found import Executed
from hertzchain.verdict.deck.deck_check import Case, DeckCheck
from hertzchain.verdict.deck.measured import far_wall
from hertzchain.verdict.deck.places import (
    WITHOUT,
    Changes,
    Place,
    commands_of,
    is_of,
    place_at,
)
from hertzchain.verdict.deck.right_commands import (
    granule_commands,
    law_commands,
    load_commands,
    motion_commands,
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
    """Return changes that remove some commands, and the commands that name their fixes."""
    commands = case.found.commands
    fixes = {commands[k].text.split()[1] for k in indices if commands[k].text.startswith("fix ")}
    users = [[word, name] for word in ("unfix", "fix_modify") for name in fixes]
    gone = [*indices, *(k for k, one in enumerate(commands) if one.text.split()[:2] in users)]
    places = [place_at(case.found, k) for k in gone]
    return {_at(place): (f"# {place.written}",) for place in places}


def _whole(case: Case, lines: Sequence[str], old: Sequence[int]) -> Iterator[Changes]:
    """Yield changes that put lines in place of old commands, or before the deck's first run.

    New fixes keep the names of those that they replace.
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


def _kept(case: Case, check: DeckCheck, where: Place) -> tuple[str, ...]:
    """Return the run that is named for a missing command, which it then follows."""
    is_run = is_of(case.found, where.index, "run") and not check.command.startswith("run")
    return (where.written,) if is_run else ()


# ---- Changes of single lines


def _formula(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """Set the clock to 0, or replace the formula of the shock."""
    early = case.found.commands[: case.found.first_run]
    for one in [one for one in early if one.text.startswith("reset_timestep")][-1:]:
        yield {_at(one): ("reset_timestep 0",)}
    lines = shock_commands(case)
    if lines and check.place is not None and check.place.written.startswith("variable"):
        yield {_at(check.place): (lines[0],)}


def _as_many_steps(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """Shorten the time step, with more steps in each run accordingly."""
    found, where = case.found, check.place
    if where is None or check.expected is None or not found.runs:
        return
    old, new = max(run.dt for run in found.runs), check.expected
    blamed, kept = _at(where), _kept(case, check, where)
    runs: Changes = {}
    last = min(found.end_time, case.start + case.scene.end_time)
    for run in found.runs:
        where = place_at(found, run.command)
        words = where.written.split()
        if run.dt == old and len(words) > 1 and words[0] == "run" and words[1].isdigit():
            end = min(run.start + run.steps * old, last)
            steps = max(1, math.ceil((end - run.start) / new * (1 - 1e-12)))
            runs[_at(where)] = (" ".join([words[0], str(steps), *words[2:]]),)
    yield {blamed: (check.command, *runs.pop(blamed, kept)), **runs}


# ---- Commands that set a number


def _nothing(_: Case, __: DeckCheck) -> list[int]:
    return []


def _all_of(role: str) -> Callable[[Case, DeckCheck], list[int]]:
    """All commands of a role."""
    return lambda case, _: commands_of(case.found, role)


def _its_own(name: str) -> Callable[[Case, DeckCheck], list[int]]:
    """The command that is named, if it has this name."""

    def blamed(_: Case, check: DeckCheck) -> list[int]:
        place = check.place
        return [place.index] if place is not None and place.written.startswith(name) else []

    return blamed


def _wall(case: Case, check: DeckCheck) -> list[int]:
    """The wall at the far end; the command that is named if the wall meets no granule."""
    wall = far_wall(case.found)
    return _its_own("fix")(case, check) if wall is None else [wall.command]


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
    """Fixes that integrate the motion of granules."""
    return [fix.command for fix in case.found.fixes if fix.moves and fix.style != "move"]


_BY_LINE = {
    "shock": _formula,
    "timestep": _as_many_steps,
}
"""Changes of single lines, by the role of a number."""

_SETTINGS = {
    "radius": (granule_commands, _nothing),
    "mass": (granule_commands, _nothing),
    "place": (place_commands, _nothing),
    "velocity": (velocity_commands, _its_own("velocity")),
    "spin": (velocity_commands, _its_own("velocity")),
    "contacts": (law_commands, _all_of("contacts")),
    "wall": (wall_commands, _wall),
    "constant force": (load_commands, _loads),
    "gravity": (load_commands, _loads),
    "shock": (shock_commands, _shocks),
    "pushed": (shock_commands, _shocks),
    "motion": (motion_commands, _movers),
}
"""By the role of a number: the scene's commands that set it, and the commands to remove.

The former are None where no command can set it.
"""


def corrections(case: Case, check: DeckCheck, role: str) -> Iterator[Changes]:
    """Return the line of a check with its own number corrected, then changes by its role."""
    where = check.place
    if where is not None and check.command == WITHOUT:
        if not is_of(case.found, where.index, "run"):  # otherwise no command is known that sets it
            yield _without(case, [where.index])
    elif where is not None and check.command:
        yield {_at(where): (*check.command.split("\n"), *_kept(case, check, where))}
    if role in _BY_LINE:
        yield from _BY_LINE[role](case, check)
    if role in _SETTINGS:
        commands, replaced = _SETTINGS[role]
        lines = commands(case)
        if lines is not None:
            yield from _whole(case, lines, replaced(case, check))
