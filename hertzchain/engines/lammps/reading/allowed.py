"""The commands of a user's deck that LAMMPS is given: no files are written, no programs run.

A command that is on no list here is refused: one that might change the motion must not be left out,
and one that might write must not be carried out.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from hertzchain.engines.lammps.reading.text import check_format, number
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

_RUNS_CODE = ("python", "mliap", "kim")
"""Computes that may run code from files, without what follows a slash."""

_PAIRS = ("gran", "hybrid", "none", "zero", "lj/", "soft", "morse", "colloid", "tracker")
"""Beginnings of pair styles that run no other program, write nothing and read no file."""

_WORDS_OF_PAIRS = ("NULL", "limit_damping")

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

_OF_MOLECULES = frozenset(("offset", "toff", "boff", "aoff", "doff", "ioff", "scale"))
"""Keywords of ``molecule`` after the names of its files."""

_COMPRESSED = (".gz", ".bz2", ".zst", ".xz", ".lzma", ".lz4", ".Z")
"""Ends of names of files that LAMMPS reads through a shell."""

Given = tuple[list[str] | None, str | None]
"""Words of the command that LAMMPS is given, None for none; and why it is another one."""


@dataclass
class Rules:
    """Decides which commands LAMMPS is given; remembers what was left out.

    Files to be read are searched in several folders, in order: LAMMPS itself only knows the working
    folder, but users also mean that of the deck, the last one.
    """

    folders: tuple[Path, ...]
    missing: set[str] = field(default_factory=set)  # fixes
    unset: dict[str, str] = field(default_factory=dict)  # variables, and why
    restarted: bool = False  # whether the pair style is one that a restart file names
    reads_outside: bool = False  # whether the last command reads a file that is not the deck's

    def decide(self, words: list[str]) -> Given:
        """Return the command to give (or None), and why it was changed; RunFailed to refuse it."""
        name, self.reads_outside = words[0], False
        if name in _LEFT_OUT:
            return None, _LEFT_OUT[name]
        if not name.replace("_", "").replace("/", "").isalnum():
            raise RunFailed("is no command of LAMMPS: must be an input script, as lmp -in reads it")
        if name not in _CARRIED_OUT:
            raise _refused(name, "commands")
        if name not in ("print", "variable") and any(word.endswith(_COMPRESSED) for word in words):
            raise _compressed(next(word for word in words if word.endswith(_COMPRESSED)))
        self.restarted = name == "read_restart" or (self.restarted and name != "pair_style")
        if name == "pair_coeff" and self.restarted:
            raise RunFailed(
                "pair_coeff follows read_restart, whose pair style is not known here: give the"
                " pair_style before it"
            )
        special = {
            "fix": self._fix,
            "compute": _compute,
            "create_atoms": _create_atoms,
            "unfix": self._fix_again,
            "fix_modify": self._fix_again,
            "variable": self._variable,
            "pair_style": _pair_style,
            "print": _without_files,
            "thermo_modify": _formatted,
            "timer": _timer,
            "molecule": self._molecule,
            "read_data": self._reads,
            "read_restart": self._reads,
        }
        return special[name](words) if name in special else (words, None)

    def path(self, name: str) -> Path:
        """Return the path of a file that the deck names."""
        # No error for a link that leads to itself, or for an unknown user.
        user = os.path.expanduser(name)  # noqa: PTH111
        paths = [Path(os.path.realpath(folder / user)) for folder in self.folders]
        return next((path for path in paths if path.is_file()), paths[-1])

    def is_outside(self, path: Path) -> bool:
        """Whether a file is not in the deck's folder, or in one below."""
        return not path.is_relative_to(os.path.realpath(self.folders[-1]))

    def _file(self, name: str) -> str:
        """Return the path of a file for LAMMPS; RunFailed if LAMMPS must not read it."""
        path = self.path(name)
        if not path.is_file():
            raise RunFailed(f"{name}: cannot be read (no such file)")
        if not str(path).translate(_OF_NAMES).isalnum():
            raise RunFailed(
                f"{name}: LAMMPS is given no file with {str(path)!r} as its name: letters, digits,"
                " blanks and . _ - + / are allowed, so rename it"
            )
        if path.name.endswith(_COMPRESSED):
            raise _compressed(name)
        self.reads_outside |= self.is_outside(path)
        return str(path)

    def _reads(self, words: list[str]) -> Given:
        return [words[0], *map(self._file, words[1:2]), *words[2:]], None

    def _molecule(self, words: list[str]) -> Given:
        end = next((k for k, word in enumerate(words) if word in _OF_MOLECULES), len(words))
        return [*words[:2], *map(self._file, words[2:end]), *words[end:]], None

    def _fix(self, words: list[str]) -> Given:
        if len(words) < _WORDS_OF_FIX:
            return words, None  # LAMMPS says what is wrong
        _, number, _, style, *_ = words
        self.missing.discard(number)
        if style in _USELESS:
            self.missing.add(number)
            return None, _USELESS[style]
        if style not in _FIXES:
            raise _refused(f"fix {style}", "fixes")
        if style in _TAKES_NOTE:
            _formatted(words)
            return _without_files(words)
        return words, None

    def _fix_again(self, words: list[str]) -> Given:
        if len(words) > 1 and words[1] in self.missing:
            return None, f"fix {words[1]} was left out"
        return words, None

    def _variable(self, words: list[str]) -> Given:
        if len(words) < 3:
            return words, None
        _, name, style, *values = words
        self.unset.pop(name, None)
        if style in _FROM_OUTSIDE:
            self.unset[name] = _FROM_OUTSIDE[style]
            return None, _FROM_OUTSIDE[style]
        if style not in _VARIABLES:
            raise _refused(f"a variable of style {style}", "variables")
        if style == "format":
            return _formatted(words)
        if style not in ("file", "atomfile"):
            return words, None
        files = [*map(self._file, values[:1])]
        if self.reads_outside:
            self.reads_outside = False  # this message may be shown
            raise RunFailed(f"{values[0]}: is not in the folder of the deck: copy it there")
        return [*words[:3], *files, *values[1:]], None


_OF_NAMES = dict.fromkeys(map(ord, "._-+/ "), "a")
"""Characters that names of files may have besides letters and digits."""


def _refused(what: str, of: str) -> RunFailed:
    return RunFailed(
        f"{what} is none of the {of} that are carried out here: leave it out of the deck, if the"
        " chain does not need it"
    )


def _compressed(name: str) -> RunFailed:
    return RunFailed(f"{name}: is compressed: LAMMPS would start a program to read it; unpack it")


def _pair_style(words: list[str]) -> Given:
    _, *names = words
    for name in names:
        allowed = name.startswith((*_PAIRS, "v_")) or name in _WORDS_OF_PAIRS
        if not allowed and (name == names[0] or number(name) is None):
            raise _refused(f"pair_style {name}", "pair styles")
    return words, None


def _compute(words: list[str]) -> Given:
    if len(words) >= _WORDS_OF_FIX and words[3].split("/")[0] in _RUNS_CODE:
        raise _refused(f"compute {words[3]}", "computes")
    return words, None


def _create_atoms(words: list[str]) -> Given:
    if "mesh" in words:
        raise _refused("create_atoms mesh", "commands")
    return words, None


def _timer(words: list[str]) -> Given:
    if "timeout" in words:
        return None, "the time limit is that of the command line"
    return words, None


def _formatted(words: list[str]) -> Given:
    for word in words:
        check_format(word)
    return words, None


def _without_files(words: list[str]) -> Given:
    """A command without the files that it would write."""
    kept: list[str] = []
    k = 0
    while k < len(words):
        if k >= 2 and words[k] in _FILE_KEYWORDS and k + 1 < len(words):
            k += 2
        else:
            kept.append(words[k])
            k += 1
    if len(kept) == len(words):
        return words, None
    return kept, "it would write a file: carried out without"


def shown(text: str) -> str:
    """Return a command on one line."""
    return " ".join(text.split())


def steps_of(value: str) -> int:
    """Return a number of steps as a deck gives it; RunFailed for other text."""
    steps = number(value)
    if steps is None or steps < 0 or not steps.is_integer():
        raise RunFailed(f"run {value} is no number of steps")
    return int(steps)
