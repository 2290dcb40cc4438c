"""Reads a user's deck as LAMMPS does, and gives LAMMPS one command after another.

Conditions, loops, jumps and includes are carried out here, so that the place of each command is
known, and no command that writes files or runs programs gets through. LAMMPS inserts the values of
variables, and evaluates conditions.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hertzchain.engines.lammps.reading.contents import Executed
from hertzchain.engines.lammps.reading.text import (
    CONTROL,
    Edits,
    Line,
    Rules,
    edited,
    in_ascii,
    shown,
    steps_of,
    without_comment,
    words_of,
)
from hertzchain.engines.lammps.reading.watching import Playing
from hertzchain.errors import HertzchainError, RunFailed
from hertzchain.files import read_bytes

_MOST_BYTES = 10_000_000  # of a deck or include; chosen, far above any deck written by hand
_MOST_COMMANDS = 200_000  # carried out; chosen: a deck with more seems to be endless
_MOST_STEPS = 2**31 - 1  # of one run of LAMMPS
_MOST_SHOWN_CHARS = 200  # characters of a command in messages
_VARIABLE = re.compile(r"ERROR: Variable (\w+):(?!.* before simulation box)")
"""Part of LAMMPS's message on a formula with a variable that it cannot evaluate yet."""

_BEFORE_NAMES = r"v_|py_|\$\{?|[Vv]ariable |name |reference "  # in commands and in LAMMPS's errors

_HIDDEN = "LAMMPS stops here; why is not shown, as it reads a file outside the deck's folder"

_MOST_NESTED_FILES = 15  # files that include one another, as in LAMMPS itself


class Ended(Exception):
    """The deck is over, or the rest of it is not wanted."""


@dataclass
class _Open:
    """A file that is read, and the next line."""

    name: str  # as the deck names it
    path: Path
    lines: list[Line]
    next: int = 0

    @functools.cached_property
    def labels(self) -> dict[str, int]:
        """Line of each label, the first one of that name."""
        labels: dict[str, int] = {}
        for k, line in enumerate(self.lines):
            words = words_of(without_comment(line.text))
            if len(words) > 1 and words[0].value == "label":
                labels.setdefault(words[1].value, k)
        return labels


class Interpreter:
    """Carries out a deck; ``commands`` grows with it.

    The deck has a name, as the user gives it, and a path. Variables replace those of style
    ``index``, as ``-var`` does. The player gives the commands to a LAMMPS that has no box. Files
    are searched in the working folder first, by default only in that of the deck. ``tell`` is
    called with the place of each command before it is carried out.
    """

    def __init__(
        self,
        name: str,
        path: Path,
        variables: Mapping[str, str],
        player: Playing,
        *,
        folder: Path | None = None,
        edits: Edits | None = None,
        tell: Callable[[str], object] = lambda _: None,
    ) -> None:
        self._lammps, self._player, self._tell = player.lammps, player, tell
        folders = [path.parent] if folder is None else [folder, path.parent]
        self._rules, self._edits = Rules(tuple(folders)), edits or {}
        self._name, self._deck, self._variables = name, path, variables
        self._files: list[_Open] = []
        self._skips_jump = self._ran = False
        self.commands: list[Executed] = []
        self.here: Executed | None = None

    def play(self) -> None:
        """Carry out the deck, up to its end."""
        for name, value in self._variables.items():
            # These are not the deck's: LAMMPS then skips a variable of this name and style in the
            # deck.
            self._player.give(["variable", name, "index", *in_ascii(value).split()], 0)
        try:
            self._read(self._name)
        except Ended:
            return
        except HertzchainError as problem:
            if self.here is None or str(problem).startswith(f"{self.here.file}:"):
                raise
            place = f"{self.here.file}:{self.here.line}"
            if self._is_outside or self._rules.reads_outside:
                raise type(problem)(f"{place}: {_HIDDEN}") from None
            if why := self._unset_in(f"{self.here.text} {problem}"):
                raise RunFailed(f"{place}: {why}") from None
            to_blame = self._variable_in(str(problem)) or self.here
            place = f"{to_blame.file}:{to_blame.line}"
            said = str(problem)
            if self.here.text.startswith("minimize"):  # which takes no steps in time
                said = said.split("; the step is too long", maxsplit=1)[0]
            raise type(problem)(f"{place}: {said}") from None

    @property
    def _is_outside(self) -> bool:
        """Whether the file that is read is not in the folder of the deck."""
        return bool(self._files) and self._rules.is_outside(self._files[-1].path)

    def _unset_in(self, said: str) -> str:
        """Return what to do about a variable in an error that has no value; empty for none."""
        for name, why in self._rules.unset.items():
            if re.search(rf"({_BEFORE_NAMES}){re.escape(name)}\b", said):
                return f"variable {name} was left out ({why}): give its value in the deck instead"
        return ""

    def _variable_in(self, said: str) -> Executed | None:
        """Return the last command that set the variable that LAMMPS names in its error, if any."""
        named = _VARIABLE.search(said)
        words = ["variable", named[1]] if named else []
        definitions = (c for c in reversed(self.commands) if c.text.split()[:2] == words)
        return next(definitions, None)

    def _read(self, name: str) -> None:
        """Carry out the commands of a file."""
        if len(self._files) >= _MOST_NESTED_FILES:
            raise RunFailed(f"more than {_MOST_NESTED_FILES} files include one another")
        self._files.append(self._opened(name))
        while True:
            file = self._files[-1]
            if file.next >= len(file.lines):
                break
            line = file.lines[file.next]
            file.next += 1
            written = shown(without_comment(line.text))
            self._one(line.text, Executed(written, file.name, line.number, written))
        self._files.pop()

    def _opened(self, name: str) -> _Open:
        path = self._deck if not self._files else self._rules.path(name)
        try:
            text = read_text(path)
        except (OSError, ValueError) as problem:
            reason = getattr(problem, "strerror", None) or problem
            raise RunFailed(f"{name}: cannot be read ({reason})") from None
        return _Open(name, path, edited(in_ascii(text), name, self._edits))

    def _one(self, text: str, where: Executed) -> None:
        """Carry out one command, which may stand in quotes within another one."""
        text = without_comment(text)
        if not text:
            return
        self.here = where
        said = "" if self._is_outside else shown(text)[:_MOST_SHOWN_CHARS]
        self._tell(f"{where.file}:{where.line}: {said}")
        if len(self.commands) >= _MOST_COMMANDS:
            raise RunFailed(
                f"the deck is not over after {_MOST_COMMANDS} commands: it seems to have no end"
            )
        if "$" in text and (why := self._why_left_out(text)):
            self._note(replace(where, carried_out=False, why_not=why))
            return
        if "$" in text:
            text = " ".join(in_ascii(self._lammps.expanded(text)).splitlines()).strip()
        words = words_of(text)
        if any("$" in word.raw and word.raw[0] not in "\"'" for word in words):
            # LAMMPS would insert values once more than in the deck itself.
            raise RunFailed(
                "the value of a variable has a $: give the value itself, without another variable"
            )
        if not words:
            return
        name, values = words[0].value, [word.value for word in words[1:]]
        if name in CONTROL:
            index = self._note(replace(where, text=shown(text)))
            getattr(self, f"_{name}")(values, index, where)
            return
        given, why_not = self._rules.decide([name, *values])
        if why_not is not None and self._is_outside:
            text, where = name, replace(where, written=name)
        index = self._note(
            replace(where, text=shown(text), carried_out=given is not None, why_not=why_not)
        )
        if given is not None:
            self._player.give(given, index)

    def _why_left_out(self, text: str) -> str | None:
        """Return why a command with a variable that was left out is left out itself, if it is."""
        name = text.split(maxsplit=1)[0]
        needs = any(re.search(rf"\$\{{?{re.escape(unset)}\b", text) for unset in self._rules.unset)
        if not needs or name in CONTROL or not name.isidentifier():
            return None
        given, why = self._rules.decide([name])
        return why if given is None else None

    def _note(self, done: Executed) -> int:
        """Record a command; return its index."""
        self.commands.append(done)
        return len(self.commands) - 1

    # ---- Commands that are carried out here: values are the words after the command's name.

    def _include(self, values: list[str], *_: Any) -> None:
        _need(values, 1, "include")
        self._read(values[0])

    def _label(self, *_: Any) -> None:
        """Do nothing: a jump searches the file for its label."""

    def _jump(self, values: list[str], *_: Any) -> None:
        _need(values, 1, "jump")
        if self._skips_jump:
            self._skips_jump = False
            return
        if values[0] == "SELF":
            file = self._files[-1]
            file.next = 0
        else:
            file = self._opened(values[0])
            self._files[-1] = file
        if len(values) > 1:
            if values[1] not in file.labels:
                raise RunFailed(f"jump finds no label {values[1]} in {file.name}")
            file.next = file.labels[values[1]] + 1

    def _next(self, values: list[str], index: int, _: Executed) -> None:
        _need(values, 1, "next")
        self._player.give(["next", *values], index)
        # LAMMPS deletes the variables that have no further value, and skips the next jump.
        if not all(self._lammps.has_variable(name) for name in values):
            self._skips_jump = True

    def _if(self, values: list[str], _: int, where: Executed) -> None:
        if len(values) < 3 or values[1] != "then":
            raise RunFailed("if needs a condition in quotes, then, and commands in quotes")
        body: list[str] = []
        k, commands = 0, 2  # "then" stands only after the first condition
        while k < len(values):
            is_else = k > 0 and values[k - 1] == "else"
            chosen = is_else or self._lammps.holds(values[k])
            k = k if is_else else k + commands
            end = k
            while end < len(values) and values[end] not in ("elif", "else"):
                end += 1
            if chosen:
                body = values[k:end]
                break
            k, commands = end + 1, 1
        for text in body:
            self._one(text, where)

    def _quit(self, *_: Any) -> None:
        raise Ended

    def _clear(self, *_: Any) -> None:
        if not self._player.clear():
            raise Ended
        self._ran = False
        self._rules.missing.clear()
        self._rules.restarted = False

    def _run(self, values: list[str], index: int, where: Executed) -> None:
        _need(values, 1, "run")
        steps = steps_of(values[0])
        now = self._lammps.step()
        kept: dict[str, str] = {}
        every: tuple[int, list[str]] | None = None
        k = 1
        while k < len(values):
            word = values[k]
            if word == "upto":
                steps = max(steps - now, 0)
                k += 1
            elif word in ("start", "stop", "pre", "post"):
                _need(values[k:], 2, f"run {word}")
                kept[word] = _value_of(word, values[k + 1])
                k += 2
            elif word == "every":
                _need(values[k:], 2, "run every")
                every = steps_of(values[k + 1]), values[k + 2 :]
                break
            else:
                raise RunFailed(f"run has no keyword {word}")
        if steps > _MOST_STEPS:
            raise RunFailed(f"run {values[0]} is no number of steps: at most {_MOST_STEPS}")
        if every is None or every[0] == 0:
            self._take(steps, kept, index)
            return
        kept = {"start": str(now), "stop": str(now + steps), **kept}
        pace, texts = every
        done = 0
        while done < steps or done == 0:
            part = min(pace, steps - done)
            self._take(part, kept, index)
            done += max(part, 1)
            for text in texts:
                if text != "NULL":
                    self._one(text, where)

    def _take(self, steps: int, keywords: dict[str, str], index: int) -> None:
        """Take steps; LAMMPS always prepares its first run, also with ``pre no``."""
        kept = [f"{word} {value}" for word, value in keywords.items() if self._ran or word != "pre"]
        self._player.take(steps, " ".join(kept), index)
        self._ran = True


def read_text(path: Path) -> str:
    """Return the text of a deck without a byte-order mark. Raises OSError, ValueError."""
    text = read_bytes(path, _MOST_BYTES).decode("utf-8-sig", errors="replace")
    return text.replace("\r\n", "\n")


def _value_of(keyword: str, value: str) -> str:
    """Return the value of a keyword of ``run`` as LAMMPS takes it; RunFailed for any other."""
    if keyword in ("start", "stop"):
        return str(steps_of(value))
    if value not in _YES_OR_NO:
        raise RunFailed(f"run {keyword} {value} is neither yes nor no")
    return _YES_OR_NO[value]


_YES_OR_NO = {
    **dict.fromkeys(("yes", "on", "true"), "yes"), **dict.fromkeys(("no", "off", "false"), "no"),
}  # fmt: skip


def _need(values: list[str], least: int, name: str) -> None:
    if len(values) < least:
        raise RunFailed(f"{name} needs at least {least} word{'s' * (least > 1)} more")
