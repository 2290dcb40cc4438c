"""Changes of a deck, command by command."""

from __future__ import annotations

from collections.abc import Sequence

from hertzchain.engines.lammps.reading import Executed
from hertzchain.verdict.deck.deck_check import Case, Changes
from hertzchain.verdict.deck.places import Place


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
