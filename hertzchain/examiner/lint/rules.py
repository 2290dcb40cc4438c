"""Known traps in a user's LAMMPS deck of a chain, named by line: a function for each in `RULES`.

Rules that need numbers of the deck report nothing if LAMMPS could not read it. The numbers in the
sentences were measured on 30 steel spheres, pushed by 100 N for 100 us (LAMMPS 22 Jul 2025), as
`tests/examiner/lint/test_lint.py` does again.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hertzchain.errors import HertzchainError, TooExpensive
from hertzchain.examiner.lint import chain_rules, traps
from hertzchain.examiner.lint.deck import MOST_BYTES, Command, Deck, Finding, Found, script_of
from hertzchain.files import read_bytes

if TYPE_CHECKING:
    from hertzchain.engines.lammps.reading.reading import Look

LINT_TIME_LIMIT = 60.0  # for LAMMPS to read a deck [s] (chosen)


_OF_DECKS = "units", "atom_style", "pair_style", "run", "include", "read_restart"


def _no_deck(deck: Deck) -> Found:
    """Text that is no LAMMPS deck."""
    if not deck.named(*_OF_DECKS):
        text = (
            "this does not look like a LAMMPS deck: none of units, atom_style, pair_style, run,"
            " include and read_restart is in it"
        )
        yield None, "error", text


def _no_run(deck: Deck) -> Found:
    """A note on a deck without a run."""
    if deck.named(*_OF_DECKS) and not deck.may_run:
        yield None, "note", "this deck takes no step: it has no run, or only run 0"


def _no_chain(deck: Deck) -> Found:
    """A note on a deck that is no chain: what it is."""
    if deck.no_chain is not None:
        where, why = deck.no_chain
        yield where, "note", f"this deck is no chain ({why}): rules for chains are left out"


_REFUSED = re.compile(
    "LAMMPS stopped: ERROR|needs at least|cannot be read|does not exist when|is no number of steps"
)
"""Words of the reasons why LAMMPS itself refuses a deck."""


def _text_alone(deck: Deck) -> Found:
    """Errors from where LAMMPS stops: its own message, or a command that does not exist."""
    look = deck.look
    if look is None or not look.stopped or deck.is_other is not None:
        return
    where, why = _stop(deck, look)
    lacks = "is part of the" in why  # a package of LAMMPS that is not installed here
    refused = _REFUSED.search(why) and deck.may_run  # others may be fragments
    if refused and not lacks and deck.no_chain is None:
        yield where, "error", why
    elif "is none of the commands" in why and deck.no_chain is None:
        yield where, "warning", f"{why}; if it is misspelt, LAMMPS stops here"
    else:
        text = f"LAMMPS read a part of the deck, the rest was read as text: {why}"
        yield where, "note", text


def _stop(deck: Deck, look: Look) -> tuple[Command | None, str]:
    """The command of the deck at which LAMMPS stops, and why; a place in another file is named."""
    own = [command for command in deck.commands if not command.inside]
    place = re.match(r"(.*?):(\d+): ", look.stopped)
    if place and (not look.commands or place[1] == look.commands[0].file):
        at, why = [c for c in own if c.line == int(place[2])], look.stopped[place.end() :]
    else:
        at, why = [c for c in own if c.index is not None], look.stopped
    return (at[-1] if at else None), why


def _elsewhere(deck: Deck) -> Found:
    """Parts of a deck that are not examined."""
    for command in deck.unread:
        text = f"the commands behind this {command.name} are unknown: none is reported as missing"
        yield command, "note", text
    if deck.is_of_liggghts:
        text = "this deck is for LIGGGHTS: its contact laws and integrators are not examined"
        yield deck.pair_style, "note", text


RULES: dict[str, Callable[[Deck], Found]] = {
    rule.__name__.strip("_").replace("_", "-"): rule
    for rule in (
        _no_deck, _no_run, _no_chain, _text_alone, _elsewhere, *traps.RULES, *chain_rules.RULES,
    )
}  # fmt: skip
"""Rules that are functions, by name; the others are those of ``traps.TRAPS``."""

OF_CHAINS = {
    "not-hertz", "unusual-density", "not-touching", "periodic", "lattice-units", "force-on-all",
    "step-length",
}  # fmt: skip
"""Rules that apply only to chains; each entry of ``TRAPS`` has its own ``of_any``."""


def findings(commands: Sequence[Command], look: Look | None = None) -> list[Finding]:
    """Return the findings in the commands of a deck, and in what LAMMPS finds in it, by line."""
    deck = Deck(commands, look)
    made = [(trap.rule, trap.found_in(deck)) for trap in traps.TRAPS]
    rules = {
        name: rule for name, rule in RULES.items() if not (deck.no_chain and name in OF_CHAINS)
    }
    found: set[Finding] = set()
    for name, said in (*made, *((name, rule(deck)) for name, rule in rules.items())):
        with contextlib.suppress(ArithmeticError):  # numbers beyond the range of floating point
            for command, severity, sentence in said:
                line = 1 if command is None else command.line
                inside = f"{command.inside}: " if command is not None and command.inside else ""
                found.add(Finding(line, name, severity, f"{inside}{sentence}"))
    return sorted(found, key=lambda finding: (finding.line, finding.rule, finding.text))


def lint_file(
    path: Path, variables: Mapping[str, str] | None = None, time_limit: float = LINT_TIME_LIMIT
) -> list[Finding]:
    """Return the findings in a deck and in included files, at the lines that include them.

    LAMMPS reads the deck, in a process of its own, and runs it without motion. If it cannot, a note
    says why, and only rules on the text are applied.

    ``variables`` are those of the command line, which take the place of the deck's own.
    """
    text, given = read(path), variables or {}
    commands = script_of(path, text)
    deck = Deck(commands)
    if deck.is_of_liggghts or not (deck.unread or deck.pair_style):
        return findings(commands)
    from hertzchain.engines.lammps.reading.reading import look

    try:
        seen = look(path, given, time_limit)
    except TooExpensive:
        said = f"not read to its end in {time_limit:g} s: shorten its loops, or raise the limit"
        return [Finding(1, "text-alone", "note", said), *findings(commands)]
    except HertzchainError as problem:
        said = f"LAMMPS could not be asked, the deck was read as text: {problem}"
        return [Finding(1, "text-alone", "note", said), *findings(commands)]
    return findings(script_of(path, text, seen.commands, not seen.is_whole), seen)


def read(path: Path) -> str:
    """The text of a deck; HertzchainError where it cannot be read."""
    try:
        content = read_bytes(path, MOST_BYTES)
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise HertzchainError(f"{str(path)!r}: cannot be read ({reason})") from None
    # A comment may be in another encoding; no command has such letters.
    return content.decode("utf-8-sig", errors="replace").replace("\r\n", "\n")
