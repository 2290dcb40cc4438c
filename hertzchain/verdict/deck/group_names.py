"""Names of groups and fixes in commands that are shown as right: the deck's own, or new ones."""

from __future__ import annotations

import re

from hertzchain.engines.lammps.reading import FoundDeck
from hertzchain.verdict.deck.places import Place, group_of


def on_granule(found: FoundDeck, granule: int, name: str, command: str) -> list[str]:
    """A command for one granule alone, in which ``{group}`` stands for its group.

    That is a group of the deck; where it has none, ``name`` or what comes near it, and the command
    that makes it stands in front.
    """
    own = _group_of_granule(found, granule)
    if own is not None:
        return [command.replace("{group}", own)]
    new = unused(name, _groups(found))
    return [f"group {new} id {int(found.ids[granule])}", command.replace("{group}", new)]


def first_alone(found: FoundDeck, fix: Place) -> tuple[Place, str]:
    """The line by which a fix acts on granule 1 alone, and that line as it would be right.

    That is the group of the fix; the fix itself where that is ``all``.
    """
    words = found.commands[fix.index].text.split()
    if words[:1] != ["fix"]:
        return fix, ""
    where = group_of(found, fix)
    if where != fix:
        return where, f"group {words[2]} id {int(found.ids[0])}"
    alone = re.sub(r"^(\s*fix\s+\S+\s+)\S+", r"\1{group}", fix.written, count=1)
    return fix, "\n".join(on_granule(found, 0, "shock", alone))


def unused(name: str, taken: set[str]) -> str:
    """A name that is not taken: this one, or it with a number."""
    new, number = name, 2
    while new in taken:
        new, number = f"{name}{number}", number + 1
    return new


def fixes_of(found: FoundDeck) -> set[str]:
    """The names of all fixes of a deck."""
    return {words[1] for words in _commands(found, "fix") if len(words) > 1}


def _groups(found: FoundDeck) -> set[str]:
    return {words[1] for words in _commands(found, "group") if len(words) > 1} | {"all"}


def _commands(found: FoundDeck, name: str) -> list[list[str]]:
    """The words of the commands of a name that were carried out."""
    lines = [one.text.split() for one in found.commands if one.carried_out]
    return [words for words in lines if words[:1] == [name]]


def _group_of_granule(found: FoundDeck, granule: int) -> str | None:
    """A group of the deck with this granule alone."""
    made = [words[1:] for words in _commands(found, "group")]
    names = [words[0] for words in made]
    alone = ["id", str(int(found.ids[granule]))]
    return next((name for name, *rest in made if rest == alone and names.count(name) == 1), None)
