"""A LAMMPS input file as text: its commands and their words, split as LAMMPS does."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

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
"""Commands that replace the one at a line of a file, as the deck names it; none removes it."""


@dataclass(frozen=True)
class Word:
    """A word of a command, and how it is written there, with its quotes."""

    value: str
    raw: str


def lines_of(text: str) -> list[Line]:
    """The commands of a file: lines that ``&`` or triple quotes continue are joined.

    LAMMPS looks for ``&`` before it looks for comments: a comment that ends with it goes on, too.
    """
    found: list[Line] = []
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
            found.append(Line("".join([*pieces, piece]), start, number))
            pieces, quotes, start = [], 0, None
    if "".join(pieces).strip():
        found.append(Line("".join(pieces), start or 1, text.count("\n") + 1))
    return found


def edited(text: str, name: str, edits: Edits) -> list[Line]:
    """The commands of a file with edits; what replaces a line keeps its number."""
    lines: list[Line] = []
    for line in lines_of(text):
        own = edits.get((name, line.number))
        lines += [line] if own is None else [replace(line, text=one) for one in own]
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
    found: list[Word] = []
    k = 0
    while k < len(text):
        if text[k].isspace():
            k += 1
            continue
        end = k
        if text[k] in "\"'":
            end = after_quotes(text, k)
            width = 3 if text.startswith(_TRIPLE, k) else 1
            found.append(Word(text[k + width : end - width], text[k:end]))
        else:
            while end < len(text) and not text[end].isspace():
                end += 1
            found.append(Word(text[k:end], text[k:end]))
        k = end
    return found


_BARE = re.compile(r"[^\s\"'$&#]+")
"""Words that need no quotes: LAMMPS reads nothing but their letters in them."""

_LETTERS = frozenset(("Lu", "Ll", "Lt", "Lo", "Mn", "Mc", "Nd"))
"""Unicode categories that LAMMPS leaves as they are; it reads others as quotes, for example."""


def quoted(text: str) -> str:
    """A text as one word of a command; RunFailed if no quotes of LAMMPS can hold it."""
    if any(not " " <= one <= "~" and unicodedata.category(one) not in _LETTERS for one in text):
        raise RunFailed(f"{text!a} has a character that is no letter: leave it out")
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
        raise RunFailed(f"{text} is no format of a number, as %g or %20.15g is")


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
