"""Changes of a deck, command by command."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from hertzchain.engines.lammps.reading import Executed
from hertzchain.verdict.deck.deck_check import Case, DeckCheck
from hertzchain.verdict.deck.places import Changes, Place

WITHOUT = "without this command"
"""What a command should be that makes what the scene has not."""

_COMMAND = re.compile(
    r"(?:boundary|change_box|comm_modify|create_atoms|fix|group|lattice|neigh_modify|neighbor"
    r"|pair_coeff|pair_modify|pair_style|region|run|set|timestep|units|variable|velocity|if"
    r"|displace_atoms|delete_atoms|mass|newton)\s"
)


def guessed(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """The line of a check as its own number says, or without what should not be there."""
    if check.place is not None and _COMMAND.match(check.command):
        yield {at(check.place): tuple(check.command.split("\n"))}
    elif check.place is not None and check.command == WITHOUT:
        yield without(case, check.place)


def at(place: Place | Executed) -> tuple[str, int, str]:
    """The key of a command in changes."""
    return place.file, place.line, place.written


def without(case: Case, place: Place) -> Changes:
    """A deck without a command, and without what names the fix that it makes."""
    words = case.found.commands[place.index].text.split()
    gone: Changes = {at(place): (f"# {place.written}",)}
    if words[:1] == ["fix"]:
        for one in case.found.commands:
            if one.text.split()[:2] in (["unfix", words[1]], ["fix_modify", words[1]]):
                gone[at(one)] = (f"# {one.written}",)
    return gone


def before_first_run(case: Case, commands: Sequence[str]) -> Changes:
    """A deck with commands in front of its first run."""
    run = case.found.commands[case.found.first_run]
    return {at(run): (*commands, run.written)} if commands else {}
