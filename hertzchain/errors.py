"""Errors that a user can cause: each is one sentence that says what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Real
from pathlib import Path


class HertzchainError(Exception):
    """Base of every error that a user can cause; its text, on one line, is shown unchanged."""

    def __init__(self, text: object = "") -> None:
        super().__init__(on_one_line(str(text)))


class SceneError(HertzchainError, ValueError):
    """A scene, or its file, requires something impossible.

    Parameters
    ----------
    key
        Name of the wrong entry as in the scene file (``chain.radius``); "" for the file itself.
    value
        The value that was given; None where a key is missing or nothing was given.
    allowed
        Allowed values, as the end of a sentence ("must be ...").
    file
        The file it was read from, if any.
    """

    def __init__(
        self, key: str, value: object, allowed: str, file: Path | str | None = None
    ) -> None:
        self.key, self.value, self.allowed, self.file = key, value, allowed, file
        where = f"{file}: " if file is not None else ""
        shown = "" if value is None else f" = {_short(value)}"
        named = f"{_shortened(key)}{shown}: " if key else ""
        super().__init__(f"{where}{named}{allowed}")

    def in_file(self, file: Path) -> SceneError:
        """Return the same error with the file, unless it has one."""
        return SceneError(self.key, self.value, self.allowed, self.file or file)

    def __reduce__(self) -> tuple[type[SceneError], tuple[object, ...]]:
        """Support pickling."""
        return type(self), (self.key, self.value, self.allowed, self.file)


class BackendMissing(HertzchainError):
    """The backend that was asked for cannot run here."""


class RunFailed(HertzchainError):
    """A simulation failed before its end."""


class OverlapTooLarge(RunFailed):
    """Granules would be pressed so far into one another that Hertz's law does not apply."""


class StepUnstable(RunFailed):
    """The step asked for is too long for the method: the motion would diverge."""


class Unpredictable(RunFailed):
    """Peaks whose error is as large as the peaks, even with the shortest steps.

    Small errors grow to the size of the peaks, or coordinates do not resolve the overlaps.
    """


class TooExpensive(RunFailed):
    """A run would take, or has taken, longer than its time limit, or too much memory."""

    is_late = False  # whether time is the reason


class OutputError(HertzchainError):
    """A result could not be written to the given place."""


POSITIVE = "must be a finite number above 0"
"""The default for what is allowed."""


def require(condition: bool, key: str, value: object, allowed: str) -> None:
    """Raise a SceneError with key, value and what is allowed, unless the condition holds."""
    if not condition:
        raise SceneError(key, value, allowed)


def require_one(**given: object) -> None:
    """Raise a SceneError unless exactly one of some keys is given; None means not given."""
    there = [value for value in given.values() if value is not None]
    allowed = "both are given" if there else "missing"
    key = (" and " if there else " or ").join(given)
    require(len(there) == 1, key, None, f"{allowed}, give exactly one of them")


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """Return the end of a sentence on an unknown word: a similar known word, or nothing."""
    import difflib

    by_letters = {name.lower(): name for name in reversed(list(words))}
    # Least similarity of a misspelt word with a known one (chosen); friction and attraction: 0.67
    near = difflib.get_close_matches(word.lower(), by_letters, 1, 0.7)
    return f"; did you mean {by_letters[near[0]]}?" if near else ""


def is_finite(value: object) -> bool:
    """Return whether a value is a finite real number, Python's or NumPy's (booleans are not)."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond the range of floating point
        return False


def is_positive(value: object) -> bool:
    """Return whether a value is a finite real number above 0."""
    return is_finite(value) and value > 0  # type: ignore[operator]


def _short(value: object) -> str:
    try:
        return _shortened(repr(value) if isinstance(value, str) else str(value))
    except (ValueError, RecursionError):  # thousands of digits, or of levels
        return f"a {type(value).__name__} too long to be shown"


def _shortened(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."


def on_one_line(text: str) -> str:
    """Return text with escapes for all that is not printable, as names of files may have it."""
    return "".join(char if char.isprintable() else repr(char)[1:-1] for char in text)
