"""A deck with the files that it includes in place of the commands that include them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from hertzchain.files import read_bytes

_DEEPEST = 15  # files that include one another, as in LAMMPS itself
_MOST_FILES = 100  # of a deck, however often it includes them (chosen)

Line = tuple[str, int, str]
"""Text, the line of the deck that brings it, from 1, and where it stands in an included file."""


def whole(path: Path, text: str, most_bytes: int) -> list[Line]:
    """The lines of a deck and of all files that it includes; names are from its own folder on.

    A file that cannot be read, or is one too many, stays a command that includes it.
    """
    return [
        (written, line, place)
        for line, (written, place) in _Reader(path.parent, most_bytes).lines(text, 0)
    ]


class _Reader:
    def __init__(self, folder: Path, most_bytes: int) -> None:
        self._folder, self._bytes, self._files = folder, most_bytes, _MOST_FILES

    def lines(self, text: str, depth: int) -> Iterator[tuple[int, tuple[str, str]]]:
        """Lines by the number of that in the text which brings them."""
        goes_on = quoted = False
        for number, written in enumerate(text.splitlines(), start=1):
            words = written.partition("#")[0].split()
            brought = None
            if len(words) == 2 and words[0] == "include" and not goes_on and not quoted:
                brought = self._read(words[1].strip("\"'"), depth)
            goes_on = written.rstrip().endswith("&")
            quoted ^= written.count('"""') % 2 == 1
            if brought is None:
                yield number, (written, "")
                continue
            yield number, ("", "")  # what is said of the deck as a whole has its first line
            name = Path(words[1].strip("\"'")).name
            for line, (inner, place) in self.lines(brought, depth + 1):
                yield number, (inner, place or f"{name}:{line}")

    def _read(self, name: str, depth: int) -> str | None:
        """The text of a file; None where it is not looked at."""
        if depth >= _DEEPEST or self._files == 0:
            return None
        try:
            content = read_bytes(self._folder / name, self._bytes)
        except (OSError, ValueError):
            return None
        self._files -= 1
        self._bytes -= len(content)
        return content.decode("utf-8-sig", errors="replace")
