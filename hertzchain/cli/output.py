"""The end of a command: what it prints and writes, and its exit status."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, NoReturn

import typer

from hertzchain.progress import say

if TYPE_CHECKING:
    from rich.console import Console


DONE, OUT_OF_TOLERANCE, UNUSABLE = 0, 1, 2
"""Exit statuses."""


class Written(NamedTuple):
    """A file that a command writes, if its path is given."""

    what: str  # in the line that says where it is
    path: Path | None
    write: Callable[[Path], object]


@dataclass(frozen=True)
class Answer:
    """What a command prints, then writes, and its exit status."""

    numbers: Callable[[], object]  # the object of --json
    text: Callable[[Console], object]  # prints the same for a person
    files: Sequence[Written] = ()
    remarks: Sequence[str] = ()  # lines on stderr
    status: int = DONE

    def give(self, as_json: bool) -> NoReturn:
        """Print the result, write the files, whose disk may be full, and end the command.

        Tables have the width of the terminal, on a pipe at least 120 columns.
        """
        if as_json:
            typer.echo(json.dumps(self.numbers(), indent=2, allow_nan=False))
        else:
            from rich.console import Console

            console = Console(highlight=False, markup=False, emoji=False)
            if not console.is_terminal:  # a pipe has no width to fit a table into
                console.width = max(console.width, 120)
            self.text(console)
        for remark in self.remarks:
            say(remark)
        write_files(self.files)
        raise typer.Exit(self.status)


def write_files(files: Sequence[Written]) -> None:
    """Write those files that are wanted, and say where they are."""
    for what, path, write in files:
        if path is not None:
            with working(is_native=False) as report_progress:
                report_progress(f"writing {path}")
                write(path)
            say(f"{what} written to {path}", "")


@contextmanager
def working(is_native: bool = True) -> Iterator[Callable[[str], None]]:
    """Show the present work and its time on stderr; yield the function that says what it is.

    Where native compiles kernels, a line says so when it begins.
    """
    from hertzchain import progress

    with progress.shown_progress() as report_progress:
        if not is_native:  # other work needs nothing of Numba, which takes long to load
            yield report_progress
            return
        from hertzchain.engines.native import elastic
        from hertzchain.observables.compiling import Watched

        often = "once for each kind of run, up to a minute"
        if elastic.march.stats.cache_path is None:
            often = "in every process: no folder can keep them, see hertzchain doctor"

        @cache
        def say_once() -> None:
            say(f"compiling kernels for this kind of scene ({often})")

        with Watched(say_once):
            yield report_progress
