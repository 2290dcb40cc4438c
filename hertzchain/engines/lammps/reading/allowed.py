"""The commands of a user's deck that LAMMPS is given: no files are written, no programs run.

A command that is on no list here is refused: one that might change the motion must not be left out,
and one that might write must not be carried out.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hertzchain.engines.lammps.reading.text import Word, quoted
from hertzchain.errors import RunFailed

CONTROL = ("include", "jump", "label", "next", "if", "quit", "clear", "run")
"""Commands that the interpreter carries out itself."""

_CARRIED_OUT = frozenset(
    ("angle_coeff", "angle_style", "atom_modify", "atom_style", "bond_coeff",
     "bond_style", "boundary", "box", "change_box", "comm_modify", "comm_style", "compute",
     "compute_modify", "create_atoms", "create_bonds", "create_box", "delete_atoms",
     "delete_bonds", "dielectric", "dimension", "displace_atoms", "echo", "fix", "fix_modify",
     "group", "lattice", "mass", "min_modify", "min_style",
     "minimize", "molecule", "neigh_modify", "neighbor", "newton", "pair_coeff", "pair_modify",
     "pair_style", "print", "read_data", "read_restart", "region", "replicate", "reset_atom_ids",
     "reset_atoms", "reset_ids", "reset_timestep", "set", "special_bonds", "thermo",
     "thermo_modify", "thermo_style", "timer", "timestep", "uncompute", "unfix", "units",
     "variable", "velocity")
)  # fmt: skip

_WRITES, _OUTSIDE = "it would write files", "it would run other programs"
_ONE_PROCESS = "LAMMPS runs on one process here"

_LEFT_OUT = {
    **dict.fromkeys(
        ("dump", "dump_modify", "undump", "write_data", "write_dump", "write_restart", "restart",
         "write_coeff", "log", "pair_write", "bond_write", "angle_write", "dihedral_write",
         "group2ndx", "region2vmd", "info"),
        _WRITES,
    ),
    **dict.fromkeys(("shell", "python", "plugin", "geturl", "message", "server"), _OUTSIDE),
    **dict.fromkeys(("package", "suffix"), "LAMMPS runs without accelerators here"),
    **dict.fromkeys(("balance", "processors", "partition"), _ONE_PROCESS),
}  # fmt: skip

MOVES = frozenset(
    ("nve", "nve/sphere", "nve/limit", "nve/noforce", "nve/asphere", "move", "nvt", "nvt/sphere",
     "nph", "nph/sphere", "npt", "npt/sphere")
)  # fmt: skip
"""Fixes that move granules."""

LEADS = "move"
"""The one of them that prescribes the motion of granules, whatever the forces."""

IGNORES_FORCES = "nve/noforce"
"""The one of them that keeps the velocities of granules."""

_FORCES = frozenset(
    ("addforce", "addtorque", "aveforce", "setforce", "freeze", "gravity", "viscous",
     "viscous/sphere", "damping/cundall", "drag", "spring", "spring/self", "lineforce",
     "planeforce", "enforce2d", "langevin", "indent", "wall/gran", "wall/gran/region",
     "wall/harmonic", "wall/lj93", "wall/lj126", "wall/lj1043", "wall/morse", "wall/colloid",
     "wall/region", "efield", "propel/self", "restrain", "oneway")
)  # fmt: skip
"""Fixes that exert forces."""

OF_MOTION = frozenset(
    ("momentum", "recenter", "temp/rescale", "temp/berendsen", "temp/csvr", "wall/reflect", "halt")
)
"""Fixes that change the motion without a force, or end it."""

_CHANGES = frozenset(("adapt", "set", "deform", "heat/flow"))
"""Fixes that change granules or box."""

_TAKES_NOTE = frozenset(
    ("property/atom", "store/state", "store/force", "vector", "ave/atom", "ave/chunk",
     "ave/correlate", "ave/correlate/long", "ave/histo", "ave/histo/weight", "ave/time",
     "ave/moments", "controller", "pair")
)  # fmt: skip
"""Fixes that only record."""

_FIXES = MOVES | _FORCES | OF_MOTION | _CHANGES | _TAKES_NOTE

_USELESS = {"print": "it only prints", "balance": _ONE_PROCESS}
"""Fixes that are left out."""

_RUNS_CODE = frozenset(("python", "mliap", "kim"))
"""Pair styles and computes that may run code from files."""

_PAIRS = ("gran", "hybrid", "none", "zero", "lj/", "soft", "morse", "colloid", "tracker")
"""Beginnings of pair styles that run no other program and write nothing."""

QUIET = MOVES | OF_MOTION | _TAKES_NOTE
"""Fixes that exert no force."""

_VARIABLES = frozenset(
    ("delete", "index", "loop", "string", "format", "equal", "atom", "vector", "atomfile", "file",
     "internal", "timer")
)  # fmt: skip

_FROM_OUTSIDE = {"python": _OUTSIDE, "getenv": "the environment is not the deck's"}
"""Variables that are left out."""

_FILE_KEYWORDS = ("file", "append")
"""Keywords before the name of a file, of ``print`` and of fixes that only record."""

_WORDS_OF_FIX = 4  # fix, id, group, style


@dataclass
class Rules:
    """Decides which commands LAMMPS is given; remembers which fixes were left out.

    Files to be read are searched in several folders, in order: LAMMPS itself only knows the working
    folder, but users also mean that of the deck.
    """

    folders: tuple[Path, ...]
    missing: set[str] = field(default_factory=set)

    def decide(self, words: Sequence[Word], text: str) -> tuple[str | None, str | None]:
        """Return the command to give (or None), and why it was changed; RunFailed to refuse it."""
        name = words[0].value
        if name in _LEFT_OUT:
            return None, _LEFT_OUT[name]
        if not name.replace("_", "").replace("/", "").isalnum():
            raise RunFailed("is no command of LAMMPS: must be an input script, as lmp -in reads it")
        if name not in _CARRIED_OUT:
            raise _refused(name, "commands")
        special = {
            "fix": self._fix,
            "compute": _compute,
            "unfix": self._fix_again,
            "fix_modify": self._fix_again,
            "variable": self._variable,
            "pair_style": _pair_style,
            "print": _without_files,
            "timer": _timer,
            "molecule": self._with_paths,
            "read_data": self._with_paths,
            "read_restart": self._with_paths,
        }
        return special[name](words, text) if name in special else (text, None)

    def path(self, name: str) -> Path:
        """Return the path of a file that the deck names."""
        # No error for a link that leads to itself, or for an unknown user.
        user = os.path.expanduser(name)  # noqa: PTH111
        paths = [Path(os.path.realpath(folder / user)) for folder in self.folders]
        return next((path for path in paths if path.is_file()), paths[-1])

    def _fix(self, words: Sequence[Word], text: str) -> tuple[str | None, str | None]:
        if len(words) < _WORDS_OF_FIX:
            return text, None  # LAMMPS says what is wrong
        number, style = words[1].value, words[3].value
        self.missing.discard(number)
        if style in _USELESS:
            self.missing.add(number)
            return None, _USELESS[style]
        if style not in _FIXES:
            raise _refused(f"fix {style}", "fixes")
        if style in _TAKES_NOTE:
            return _without_files(words, text)
        return text, None

    def _fix_again(self, words: Sequence[Word], text: str) -> tuple[str | None, str | None]:
        if len(words) > 1 and words[1].value in self.missing:
            return None, f"fix {words[1].value} was left out"
        return text, None

    def _variable(self, words: Sequence[Word], text: str) -> tuple[str | None, str | None]:
        if len(words) < 3:
            return text, None
        style = words[2].value
        if style in _FROM_OUTSIDE:
            return None, _FROM_OUTSIDE[style]
        if style not in _VARIABLES:
            raise _refused(f"a variable of style {style}", "variables")
        return self._with_paths(words, text) if style in ("file", "atomfile") else (text, None)

    def _with_paths(self, words: Sequence[Word], _: str) -> tuple[str, None]:
        """Return the words, with the whole path of each file that exists."""
        named = [
            Word(str(path), quoted(str(path)))
            if (path := self.path(word.value)).is_file()
            else word
            for word in words[1:]
        ]
        return _joined([words[0], *named]), None


def _refused(what: str, of: str) -> RunFailed:
    return RunFailed(
        f"{what} is none of the {of} that are carried out here: leave it out of the deck, if the"
        " chain does not need it"
    )


def _pair_style(words: Sequence[Word], text: str) -> tuple[str, None]:
    names = [word.value for word in words[1:]]
    if names and (not names[0].startswith(_PAIRS) or not _RUNS_CODE.isdisjoint(names)):
        raise _refused(f"pair_style {names[0]}", "pair styles")
    return text, None


def _compute(words: Sequence[Word], text: str) -> tuple[str, None]:
    if len(words) >= _WORDS_OF_FIX and words[3].value in _RUNS_CODE:
        raise _refused(f"compute {words[3].value}", "computes")
    return text, None


def _timer(words: Sequence[Word], text: str) -> tuple[str | None, str | None]:
    if "timeout" in [word.value for word in words]:
        return None, "the time limit is that of the command line"
    return text, None


def _without_files(words: Sequence[Word], text: str) -> tuple[str, str | None]:
    """A command without the files that it would write."""
    kept: list[Word] = []
    k = 0
    while k < len(words):
        if k >= 2 and words[k].value in _FILE_KEYWORDS and k + 1 < len(words):
            k += 2
        else:
            kept.append(words[k])
            k += 1
    if len(kept) == len(words):
        return text, None
    return _joined(kept), "it would write a file: carried out without"


def _joined(words: Sequence[Word]) -> str:
    return " ".join(word.raw for word in words)


def shown(text: str) -> str:
    """Return a command on one line."""
    return " ".join(text.split())


def steps_of(value: str) -> int:
    """Return a number of steps as a deck gives it; RunFailed for other text."""
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not (number >= 0 and number == math.floor(number)):
        raise RunFailed(f"run {value} is no number of steps")
    return int(number)
