"""The line of a deck that sets a number, and its correction."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from hertzchain.engines.lammps.reading.contents import Executed, FoundDeck

Changes = dict[tuple[str, int, str], tuple[str, ...]]
"""Commands that replace those of a deck: by file, line and text of the command."""

Pairs = Sequence[tuple[float, float]]
"""Pairs of a wrong and the right number as a line may contain them, in units of the deck."""

_SIZE = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])"
NUMBER = re.compile(rf"[-+]?{_SIZE}")
SIZES = re.compile(rf"(?<![\w.$]){_SIZE}")

SAME = 2e-3  # relative difference up to which a number of a line is the measured one (chosen)

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
    "contacts": ("pair_coeff", "pair_style", "pair_modify", "read_restart"),
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
    "pushed": (r"fix\s+\S+\s+\S+\s+(?:addforce|setforce|aveforce|efield|gravity)",),
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
    "integrators": (r"fix\s+\S+\s+\S+\s+(?:nve|nvt|npt|nph)",),
    "velocities": (r"velocity\b", r"set\b.*\sv[xyz]\s", r"set\b.*\s(?:omega|angmom)\s"),
    "displaced": ("displace_atoms", "delete_atoms", "change_box"),
    "ends": (r"fix\s+\S+\s+\S+\s+halt",),
    "excludes": (r"neigh_modify\s.*\bexclude\s+(?!none)", r"pair_coeff\s+.*\slj/"),
    "restart": ("read_restart",),
    "needed": ("run", "variable", "read_", "create_", "units", "pair_style", "include", "timestep"),
    "wall in motion": (r"fix\s+\S+\s+\S+\s+wall/", "unfix"),
}  # fmt: skip
"""Commands that can set each kind of number, as patterns of their beginnings."""

_IN_TIME = re.compile(r"\b(?:time|step|elapsed|elaplong|ramp|swiggle|cwiggle|vdisplace|next)\b")


@dataclass(frozen=True)
class Place:
    """A line of a deck."""

    file: str  #: as the deck names it
    line: int  #: from 1
    written: str  #: the command as it stands there
    index: int  #: of the command among those that were carried out

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


def is_of(deck: FoundDeck, index: int, role: str) -> bool:
    """Whether a command can set a number of a role."""
    text = f"{deck.commands[index].text} "
    return any(re.match(rf"\s*(?:{pattern})", text) for pattern in ROLES[role])


def commands_of(deck: FoundDeck, role: str) -> list[int]:
    """Return the carried-out commands that can set a number of a role."""
    commands = enumerate(deck.commands)
    return [k for k, command in commands if command.carried_out and is_of(deck, k, role)]


def place(deck: FoundDeck, role: str, at: int | None = None) -> Place | None:
    """Return the last line that can set a number of a role, or that of a command, if it is known.

    For a missing command it is that of the first run; None if there is none either.
    """
    commands, mains = deck.commands, commands_of(deck, role)
    # In styles of the family gran, pair_coeff * * has no numbers.
    full = [index for index in mains if commands[index].text.split()[1:] != ["*", "*"]] or mains
    candidates = [at] if at is not None else full or commands_of(deck, "run")
    return place_at(deck, candidates[-1]) if candidates else None


def with_numbers(
    deck: FoundDeck, role: str, stands: Pairs, at: int | None = None
) -> list[tuple[Place, str]]:
    """Return lines with a wrong number, the most likely first, and the right commands for them.

    ``stands`` are pairs of the measured and the right number, in units of the deck. A line is a
    command of the role, the one at ``at`` first, or a variable that it uses. The values of
    variables stand in its place where no variable has the number, except in a loop.
    """
    fitting: dict[tuple[str, int], tuple[Place, str]] = {}
    commands = deck.commands
    mains = [*([] if at is None else [at]), *reversed(commands_of(deck, role))] if stands else []
    for index in dict.fromkeys(mains):
        once = [(command.file, command.line) for command in commands].count(
            (commands[index].file, commands[index].line)
        )
        texts = [(k, commands[k].written) for k in (index, *variables_of(commands, index))]
        texts += [(index, commands[index].text)] if once == 1 else []
        for k, text in texts:
            where, right = place_at(deck, k), with_number(text.strip(), stands)
            if right is not None:
                fitting.setdefault((where.file, where.line), (where, right))
    return [*fitting.values()]


def formula_of(deck: FoundDeck, where: Place) -> Place:
    """Return the variable at a place that makes a force change in time; else the place itself."""
    for at in reversed(variables_of(deck.commands, where.index)):
        if _IN_TIME.search(deck.commands[at].written):
            return place_at(deck, at)
    return where


def place_at(deck: FoundDeck, index: int) -> Place:
    """The line of a command."""
    command = deck.commands[index]
    return Place(command.file, command.line, command.written.strip(), index)


def key_of(command: Place | Executed) -> tuple[str, int, str]:
    """Return the key of a command in changes."""
    return command.file, command.line, command.written


def variables_of(commands: Sequence[Executed], index: int) -> list[int]:
    """Return commands that define the variables of a command, directly or through others."""
    definitions: list[int] = []
    wanted, seen = _names(commands[index].written), set[str]()
    while wanted:
        name = wanted.pop()
        if name in seen:
            continue
        seen.add(name)
        definition = re.compile(rf"\s*variable\s+{re.escape(name)}\s")
        for at in range(len(commands) - 1, -1, -1):
            if commands[at].carried_out and definition.match(commands[at].written):
                definitions.append(at)
                wanted |= _names(commands[at].written)
                break
    return definitions


def _names(text: str) -> set[str]:
    """Names of the variables that a command uses."""
    matches = re.findall(r"\$\{(\w+)\}|\$(\w)(?!\w)|\bv_(\w+)", text)
    return {next(name for name in names if name) for names in matches}


def with_number(text: str, stands: Pairs) -> str | None:
    """Return a command with its wrong number replaced by the right one; None without one.

    The first pair that fits counts; signs of numbers are those of the command.
    """
    for old, new in stands:
        for match in SIZES.finditer(text) if math.isfinite(old) and old != 0 else ():
            if math.isclose(float(match.group()), abs(old), rel_tol=SAME):
                start, end = match.span()
                return f"{text[:start]}{math.copysign(1.0, old) * new:.10g}{text[end:]}"
    return None
