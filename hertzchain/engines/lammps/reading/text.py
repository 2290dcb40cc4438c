"""A LAMMPS input file as text: its commands, and those that a user's deck may give."""

from __future__ import annotations

import math
import os
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from hertzchain.errors import RunFailed

_TRIPLE = '"""'

_ALIKE = {
    **dict.fromkeys("\u2018\u2019\u201b\u2032", "'"),
    **dict.fromkeys("\u201c\u201d\u201f\u2033", '"'),
    **dict.fromkeys("\u02d7\u2010\u2011\u2012\u2013\u2014\u2212", "-"),
    "\u02d6": "+", "\u2044": "/", "\u2215": "/", "\u2217": "*",
}  # fmt: skip
"""Characters that LAMMPS reads as an ASCII character."""


@dataclass(frozen=True)
class Line:
    """A command that may stand on several lines, with the number of the first, from 1."""

    text: str
    number: int
    last: int = 0  # number of its last line


Edits = Mapping[tuple[str, int], tuple[str, ...]]
"""Commands that replace the command at a line of a file, as the deck names it; an empty list
removes it."""


@dataclass(frozen=True)
class Word:
    """A word of a command, and how it is written there, with its quotes."""

    value: str
    raw: str


def lines_of(text: str) -> list[Line]:
    """The commands of a file: lines that ``&`` or triple quotes continue are joined.

    LAMMPS looks for ``&`` before it looks for comments: a comment that ends with it goes on, too.
    """
    lines: list[Line] = []
    pieces: list[str] = []
    quotes, start = 0, None
    for number, line in enumerate(text.split("\n"), start=1):
        start = number if start is None else start
        piece = line.rstrip()
        quotes += piece.count(_TRIPLE)
        if piece.endswith("&"):
            pieces.append(piece[:-1])
        elif quotes % 2:
            pieces.append(f"{piece} ")  # LAMMPS takes the end of a line in quotes as a blank
        else:
            lines.append(Line("".join([*pieces, piece]), start, number))
            pieces, quotes, start = [], 0, None
    if "".join(pieces).strip():
        lines.append(Line("".join(pieces), start or 1, text.count("\n") + 1))
    return lines


def edited(text: str, name: str, edits: Edits) -> list[Line]:
    """The commands of a file with edits; what replaces a line keeps its number."""
    lines: list[Line] = []
    for line in lines_of(text):
        commands = edits.get((name, line.number))
        lines += [line] if commands is None else [replace(line, text=text) for text in commands]
    return lines


def in_ascii(text: str) -> str:
    """The text in ASCII: quotes, dashes and blanks as LAMMPS takes them, ``?`` for all others.

    LAMMPS changes or drops other characters before it splits words: the text that it is given must
    have the same words as here.
    """
    return "".join(_plain(character) for character in text)


def _plain(character: str) -> str:
    if character in _ALIKE:
        return _ALIKE[character]
    if character == "\n" or " " <= character <= "~":
        return character
    is_blank = character.isspace() or unicodedata.category(character) == "Cf"
    return " " if is_blank else "?"


def without_comment(text: str) -> str:
    """Return a command without the text from the first ``#`` outside quotes on."""
    if "#" not in text:
        return text.strip()
    k = 0
    while k < len(text):
        if text[k] == "#":
            return text[:k].strip()
        k = after_quotes(text, k) if text[k] in "\"'" else k + 1
    return text.strip()


def words_of(text: str) -> list[Word]:
    """The words of a command without comment; a quoted text is one word."""
    if '"' not in text and "'" not in text:
        return [Word(word, word) for word in text.split()]
    words: list[Word] = []
    k = 0
    while k < len(text):
        if text[k].isspace():
            k += 1
            continue
        end = k
        if text[k] in "\"'":
            end = after_quotes(text, k)
            width = 3 if text.startswith(_TRIPLE, k) else 1
            words.append(Word(text[k + width : end - width], text[k:end]))
        else:
            while end < len(text) and not text[end].isspace():
                end += 1
            words.append(Word(text[k:end], text[k:end]))
        k = end
    return words


_BARE = re.compile(r"[^\s\"'$&#]+")
"""Words that need no quotes: LAMMPS reads nothing but their letters in them."""

_LETTERS = frozenset(("Lu", "Ll", "Lt", "Lo", "Mn", "Mc", "Nd"))
"""Unicode categories that LAMMPS leaves as they are; it reads others as quotes, for example."""


def quoted(text: str) -> str:
    """A text as one word of a command; RunFailed if no quotes of LAMMPS can hold it."""
    if any(not " " <= char <= "~" and unicodedata.category(char) not in _LETTERS for char in text):
        raise RunFailed(f"{text!a} has a character that is not a letter: leave it out")
    if _BARE.fullmatch(text):
        return text
    # LAMMPS evaluates formulas in texts that it prints, and in conditions.
    for formula in re.finditer(r"\$\(", text):
        inner = text[formula.end() : closed(text, formula.end() - 1)]
        check_format(inner[inner.find(":%") :] if ":%" in inner else "")
    # LAMMPS counts triple quotes, in other quotes too, to know whether the next line belongs here.
    for mark in ('"', "'", _TRIPLE) if _TRIPLE not in text else ():
        if mark not in text and mark[0] not in text[:1] + text[-1:]:
            return f"{mark}{text}{mark}"
    raise RunFailed(f"{text} has quotes in quotes that LAMMPS cannot tell apart: leave them out")


def command_of(words: Iterable[str]) -> str:
    """One command on one line, in which LAMMPS reads these words and nothing else.

    All that reaches LAMMPS from a deck goes through here. RunFailed for words that need other
    quotes than there are.
    """
    return " ".join(map(quoted, words))


_NUMBER_FORMAT = r"[-+ 0#]*\d{0,2}(\.\d{0,2})?l{0,2}[diuefgEFG]"


def check_format(text: str) -> None:
    """Raise RunFailed for a format of C that LAMMPS prints anything but a number with."""
    if re.search(f"%(?!{_NUMBER_FORMAT})", text):
        raise RunFailed(f"{text} is not a format of a number, as %g or %20.15g is")


def after_quotes(text: str, k: int) -> int:
    """Return the place after a quoted text that starts at k; the end if it is not closed."""
    mark = _TRIPLE if text.startswith(_TRIPLE, k) else text[k]
    end = text.find(mark, k + len(mark))
    return len(text) if end < 0 else end + len(mark)


def closed(text: str, k: int) -> int | None:
    """Return the place after the bracket that closes the one at k; None if it stays open."""
    depth = 0
    for end in range(k, len(text)):
        depth += (text[end] == "(") - (text[end] == ")")
        if depth == 0:
            return end + 1
    return None


def number(word: str | None) -> float | None:
    """The finite number that a word is, or None."""
    if word is None or "_" in word:
        return None
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


CONTROL = ("include", "jump", "label", "next", "if", "quit", "run")
"""Commands that the interpreter carries out itself."""

_CARRIED_OUT = frozenset(
    ("angle_coeff", "angle_style", "atom_modify", "atom_style", "bond_coeff",
     "bond_style", "boundary", "box", "change_box", "clear", "comm_modify", "comm_style", "compute",
     "compute_modify", "create_atoms", "create_bonds", "create_box", "delete_atoms",
     "delete_bonds", "dielectric", "dimension", "displace_atoms", "echo", "fix", "fix_modify",
     "group", "lattice", "mass", "min_modify", "min_style",
     "minimize", "molecule", "neigh_modify", "neighbor", "newton", "pair_coeff", "pair_modify",
     "pair_style", "print", "read_data", "region", "replicate", "reset_atom_ids",
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
"""Style of fix that prescribes the motion of granules independently of the forces."""

IGNORES_FORCES = "nve/noforce"
"""Style of fix that keeps the velocities of granules."""

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

_FILE_KEYWORDS = ("file", "append")
"""Keywords before the name of a file, of ``print`` and of fixes that only record."""

_OF_MOLECULES = frozenset(("offset", "toff", "boff", "aoff", "doff", "ioff", "scale"))
"""Keywords of ``molecule`` after the names of its files."""

_COMPRESSED = (".gz", ".bz2", ".zst", ".xz", ".lzma", ".lz4", ".Z")
"""Ends of names of files that LAMMPS reads through a shell."""

_ENVIRONMENT = "ValueOfTheEnvironment"
"""Text in place of a value that the environment would give."""

Given = tuple[list[str] | None, str | None]
"""Words of the command for LAMMPS, or None; and the reason for a change."""


@dataclass
class Rules:
    """Decides which commands LAMMPS is given; remembers what was left out.

    Files to be read are searched in several folders, in order, and nowhere else, so that no message
    shows text from outside: LAMMPS searches the working folder only, but users also mean the folder
    of the deck.
    """

    folders: tuple[Path, ...]
    missing: set[str] = field(default_factory=set)  # fixes
    environment: set[str] = field(default_factory=set)  # variables

    def decide(self, words: list[str]) -> Given:
        """Return the command to give (or None), and why it was changed; RunFailed to refuse it."""
        name = words[0]
        if name in _LEFT_OUT:
            return None, _LEFT_OUT[name]
        self.refuse_environment(words)
        if not name.replace("_", "").replace("/", "").isalnum():
            raise RunFailed("is not a LAMMPS command: must be an input script, as lmp -in reads it")
        if name not in _CARRIED_OUT:
            raise _refused(name, "commands")
        if name not in ("print", "variable") and any(word.endswith(_COMPRESSED) for word in words):
            raise _compressed(next(word for word in words if word.endswith(_COMPRESSED)))
        _check(words)
        changes = {
            "fix": self._fix, "unfix": self._fix_again, "fix_modify": self._fix_again,
            "variable": self._variable, "print": _without_files, "timer": _timer,
            "read_data": self._reads, "molecule": self._reads,
        }  # fmt: skip
        return changes[name](words) if name in changes else (words, None)

    def refuse_environment(self, words: list[str]) -> None:
        """Raise RunFailed for words with a variable of the environment, or with its value."""
        names = "|".join(map(re.escape, self.environment)) or "(?!)"
        if any(_ENVIRONMENT in word or re.search(rf"\$\{{?({names})\b", word) for word in words):
            raise RunFailed("uses a variable of the environment: give its value in the deck")

    def path(self, name: str) -> Path:
        """Return the path of a file that the deck names; RunFailed if it may not be read."""
        # No error for a link that leads to itself, or for an unknown user.
        user = os.path.expanduser(name)  # noqa: PTH111
        paths = [Path(os.path.realpath(folder / user)) for folder in self.folders]
        path = next((path for path in paths if path.is_file()), None)
        if path is None:
            raise RunFailed(f"{name}: cannot be read (no such file)")
        if not any(path.is_relative_to(os.path.realpath(folder)) for folder in self.folders):
            raise RunFailed(f"{name}: is not in the folder of the deck: copy it there")
        return path

    def _file(self, name: str) -> str:
        """Return the path of a file for LAMMPS; RunFailed if LAMMPS must not read it."""
        path = self.path(name)
        if not str(path).translate(_OF_NAMES).isalnum():
            raise RunFailed(
                f"{name}: LAMMPS is given no file with {str(path)!r} as its name: letters, digits,"
                " blanks and . _ - + / are allowed, so rename it"
            )
        if path.name.endswith(_COMPRESSED):
            raise _compressed(name)
        return str(path)

    def _reads(self, words: list[str]) -> Given:
        first, end = 1, 2
        if words[0] == "molecule":
            ends = (k for k, word in enumerate(words) if word in _OF_MOLECULES)
            first, end = 2, next(ends, len(words))
        return [*words[:first], *map(self._file, words[first:end]), *words[end:]], None

    def _fix(self, words: list[str]) -> Given:
        if len(words) < 4:  # id, group or style is missing: LAMMPS says so
            return words, None
        _, number, _, style, *_ = words
        self.missing.discard(number)
        if style in _USELESS:
            self.missing.add(number)
            return None, _USELESS[style]
        if style not in _FIXES:
            raise _refused(f"fix {style}", "fixes")
        if style in _TAKES_NOTE:
            _check_formats(words)
            return _without_files(words)
        return words, None

    def _fix_again(self, words: list[str]) -> Given:
        if words[1:] and words[1] in self.missing:
            return None, f"fix {words[1]} was left out"
        return words, None

    def _variable(self, words: list[str]) -> Given:
        if len(words) < 3:
            return words, None
        _, name, style, *values = words
        self.environment.discard(name)
        if style == "getenv":  # a word, which commands that are left out may use
            self.environment.add(name)
            return ["variable", name, "string", _ENVIRONMENT], "the environment is not the deck's"
        if style not in _VARIABLES:
            raise _refused(f"a variable of style {style}", "variables")
        if style == "format":
            _check_formats(words)
        if style in ("file", "atomfile"):
            return [*words[:3], *map(self._file, values[:1]), *values[1:]], None
        return words, None


_OF_NAMES = dict.fromkeys(map(ord, "._-+/ "), "a")
"""Characters that names of files may have besides letters and digits."""


def _refused(what: str, of: str) -> RunFailed:
    return RunFailed(
        f"{what} is not one of the {of} that are carried out here: leave it out of the deck, if the"
        " chain does not need it"
    )


def _compressed(name: str) -> RunFailed:
    return RunFailed(f"{name}: is compressed: LAMMPS would start a program to read it; unpack it")


def _check(words: list[str]) -> None:
    """Raise RunFailed for words that might run a program, read a file or print no number."""
    name, values = words[0], words[1:]
    if name == "compute" and values[2:] and values[2].split("/")[0] in _RUNS_CODE:
        raise _refused(f"compute {values[2]}", "computes")
    if name == "create_atoms" and "mesh" in values:
        raise _refused("create_atoms mesh", "commands")
    if name == "thermo_modify":
        _check_formats(values)
    if name == "pair_style":
        for style in values:
            allowed = style.startswith((*_PAIRS, "v_")) or style in _WORDS_OF_PAIRS
            if not allowed and (style == values[0] or number(style) is None):
                raise _refused(f"pair_style {style}", "pair styles")


def _timer(words: list[str]) -> Given:
    if "timeout" in words:
        return None, "the time limit of the command line holds"
    return words, None


def _check_formats(words: list[str]) -> None:
    """Raise RunFailed for formats of anything but numbers."""
    for word in words:
        check_format(word)


def _without_files(words: list[str]) -> Given:
    """A command without the files that it would write."""
    kept = words[:2]
    rest = iter(words[2:])
    for word in rest:
        if word not in _FILE_KEYWORDS or next(rest, None) is None:
            kept.append(word)
    return kept, "it would write a file: carried out without" if kept != words else None


def shown(text: str) -> str:
    """Return a command on one line."""
    return " ".join(text.split())


def steps_of(value: str) -> int:
    """Return a number of steps as a deck gives it; RunFailed for other text."""
    steps = number(value)
    if steps is None or steps < 0 or not steps.is_integer():
        raise RunFailed(f"run {value} is not a number of steps")
    return int(steps)
