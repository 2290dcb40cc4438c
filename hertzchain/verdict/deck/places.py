"""Which line of a deck makes a number, and how that line would be right."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from hertzchain.engines.lammps.reading import Executed, FoundDeck

NUMBER = re.compile(r"(?<![\w.$])[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")

_SAME = 2e-3  # relative: a number that stands in a line is the one that was measured (chosen)

ROLES: dict[str, tuple[str, ...]] = {
    "granules": ("create_atoms", "read_data", "read_restart", "delete_atoms", "replicate"),
    "place": (
        "create_atoms", "read_data", "read_restart", r"set\b.*\s[xyz]\s", "displace_atoms",
        "lattice", "replicate",
    ),
    "radius": (r"set\b.*\sdiameter\s", "read_data", "read_restart", r"set\b.*\sradius\s"),
    "mass": (
        r"set\b.*\s(?:density|density/disc|mass)\s", r"mass\b", r"set\b.*\sdiameter\s",
        "read_data", "read_restart",
    ),
    "contacts": ("pair_coeff", "pair_style", "pair_modify"),
    "wall": (r"fix\s+\S+\s+\S+\s+wall/",),
    "constant force": (
        r"fix\s+\S+\s+\S+\s+gravity", r"fix\s+\S+\s+\S+\s+(?:addforce|setforce|aveforce|efield)",
    ),
    "gravity": (r"fix\s+\S+\s+\S+\s+gravity",),
    "drag": (r"fix\s+\S+\s+\S+\s+(?:viscous|langevin|drag|damping/cundall)",),
    "random": (
        r"fix\s+\S+\s+\S+\s+(?:langevin|brownian|temp)", r"velocity\s+\S+\s+create",
        r"displace_atoms\s+\S+\s+random", r"create_atoms\s+\S+\s+random",
    ),
    "velocity": (
        r"velocity\b", r"set\b.*\sv[xyz]\s", "read_data", "read_restart",
    ),
    "spin": (r"set\b.*\s(?:omega|angmom)\s", r"velocity\b", "read_data", "read_restart"),
    "shock": (r"fix\s+\S+\s+\S+\s+(?:addforce|setforce|aveforce|efield|move|smd|spring)",),
    "timestep": (r"timestep\b", r"fix\s+\S+\s+\S+\s+dt/reset", r"reset_timestep\b"),
    "run": (r"run\b",),
    "motion": (
        r"fix\s+\S+\s+\S+\s+(?:nve|nvt|npt|nph|rigid|setforce|freeze|momentum|recenter|move)",
        r"fix\s+\S+\s+\S+\s+(?:lineforce|planeforce|enforce2d|viscous|addforce)",
        r"unfix\b", r"neigh", r"comm_modify",
    ),
    "neighbours": ("neigh_modify", "neighbor", "comm_modify"),
    "piston": (r"fix\s+\S+\s+\S+\s+move",),
    "image": (r"boundary\b",),
}  # fmt: skip
"""Commands that can make each kind of number, as patterns of their beginnings."""

_CHANGES = re.compile(r"\b(?:time|step|elapsed|elaplong|ramp|swiggle|cwiggle|vdisplace|next)\b")
_FALLBACK = ("run",)  # where a command is missing: what started without it


@dataclass(frozen=True)
class Place:
    """A line of a deck.

    Parameters
    ----------
    file, line
        Where, as the deck names it, counted from 1.
    written
        The command as it stands there.
    index
        Of the command among those that were carried out.
    """

    file: str
    line: int
    written: str
    index: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


def numbers_in(text: str) -> list[float]:
    """Numbers that stand in a command."""
    return [float(found.group()) for found in NUMBER.finditer(text)]


def is_same(number: float, other: float) -> bool:
    """Whether a number of a deck is the one that was measured."""
    return math.isclose(number, other, rel_tol=_SAME)


def place(
    found: FoundDeck,
    role: str,
    numbers: Sequence[float] = (),
    word: str = "",
    until: int | None = None,
) -> Place | None:
    """The line that makes a number of a role; a missing command is where the first run starts.

    Parameters
    ----------
    found
        The deck.
    role
        A key of ``ROLES``.
    numbers
        The measured number in units of the deck, and what else it may stand as: the line where one
        of them stands, among the commands of the role and the variables that they use.
    word
        Text that the command should have, such as the identifier of a fix.
    until
        Commands before this one alone are looked at; all of them by default.
    """
    commands = found.commands if until is None else found.commands[:until]
    patterns = [re.compile(rf"\s*(?:{pattern})") for pattern in ROLES[role]]
    mains = [
        index
        for index, one in enumerate(commands)
        if one.carried_out and any(pattern.match(f"{one.text} ") for pattern in patterns)
    ]
    # In styles of the family gran, pair_coeff * * says nothing.
    empty = [index for index in mains if commands[index].text.split()[1:] == ["*", "*"]]
    mains = [index for index in mains if index not in empty] or mains
    worded = [index for index in mains if word and word in commands[index].text]
    mains = worded or mains
    if not mains:
        return None if role in _FALLBACK else place(found, "run", until=None)
    for index in reversed(mains):
        for at in (index, *_variables(commands, index)):
            if any(is_same(n, m) for n in numbers_in(commands[at].written) for m in numbers):
                return _place(commands, at)
    if numbers:  # a formula may make it: a command whose numbers are those, substituted
        for index in reversed(mains):
            if any(is_same(n, m) for n in numbers_in(commands[index].text) for m in numbers):
                return _place(commands, index)
    return _place(commands, mains[-1])


def formula_of(found: FoundDeck, where: Place) -> Place:
    """The variable that makes a force change in time, used at a place; else the place itself."""
    for at in reversed(_variables(found.commands, where.index)):
        if _CHANGES.search(found.commands[at].written):
            return _place(found.commands, at)
    return where


def group_of(found: FoundDeck, where: Place) -> Place:
    """The command that makes the group of a fix; the fix itself for ``all``."""
    name = found.commands[where.index].text.split()[2]
    for at in range(where.index - 1, -1, -1):
        words = found.commands[at].text.split()
        if words[:2] == ["group", name] and found.commands[at].carried_out:
            return _place(found.commands, at)
    return where


def place_at(found: FoundDeck, index: int) -> Place:
    """The line of a command."""
    return _place(found.commands, index)


def _place(commands: Sequence[Executed], index: int) -> Place:
    one = commands[index]
    return Place(one.file, one.line, one.written.strip(), index)


def _variables(commands: Sequence[Executed], index: int) -> list[int]:
    """Commands that define the variables which a command uses, directly or by others."""
    found: list[int] = []
    wanted, seen = _names(commands[index].written), set[str]()
    while wanted:
        name = wanted.pop()
        if name in seen:
            continue
        seen.add(name)
        definition = re.compile(rf"\s*variable\s+{re.escape(name)}\s")
        for at in range(len(commands) - 1, -1, -1):
            if commands[at].carried_out and definition.match(commands[at].written):
                found.append(at)
                wanted |= _names(commands[at].written)
                break
    return found


def _names(text: str) -> set[str]:
    """Names of the variables that a command uses."""
    found = re.findall(r"\$\{(\w+)\}|\$(\w)(?!\w)|\bv_(\w+)", text)
    return {next(name for name in names if name) for names in found}


def with_number(where: Place | None, old: Sequence[float], new: Sequence[float]) -> str | None:
    """The line with each old number replaced by its new one; None where none of them stands in it.

    ``old`` and ``new`` are in units of the deck and of one length; the first that fits counts.
    """
    if where is None:
        return None
    for before, after in zip(old, new, strict=True):
        for match in NUMBER.finditer(where.written):
            if is_same(float(match.group()), before):
                start, end = match.span()
                return f"{where.written[:start]}{after:.10g}{where.written[end:]}"
    return None
