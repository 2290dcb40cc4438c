"""Output of the commands: printing, files and exit status."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from hertzchain.cli.stderr import say as say  # noqa: PLC0414 - the commands import it

if TYPE_CHECKING:
    from rich.console import Console

DONE, OUT_OF_TOLERANCE, UNUSABLE = 0, 1, 2


def print_json(document: object) -> None:
    """Print one JSON object, without NaN and infinity."""
    typer.echo(json.dumps(document, indent=2, allow_nan=False))


def show(
    as_json: bool, to_dict: Callable[[], object], print_on: Callable[[Console], object]
) -> None:
    """Print one JSON object, or tables: on a terminal, or on a pipe at least 120 columns wide."""
    if as_json:
        print_json(to_dict())
        return
    from rich.console import Console

    console = Console(highlight=False, markup=False)
    if not console.is_terminal:  # a pipe has no width to fit a table into
        console.width = max(console.width, 120)
    print_on(console)


def progress() -> AbstractContextManager[Callable[[str], None]]:
    """Show the present work and its time on stderr until it is done."""
    from hertzchain.progress import shown_progress

    return shown_progress()


@contextmanager
def compiling(report_progress: Callable[[str], object], is_native: bool = True) -> Iterator[None]:
    """Show that native compiles kernels where it does, and say afterwards how long that took."""
    if not is_native:  # other engines need nothing of Numba, which takes long to load
        yield
        return
    from hertzchain.engines.native import elastic
    from hertzchain.observables.preparation import Watched

    what = "compiling kernels for this kind of scene, once"
    if elastic.march.stats.cache_path is None:
        why = "in every process because no folder can keep them (see hertzchain doctor)"
        what = f"compiling kernels, as {why}"
    with Watched(lambda: report_progress(what)) as preparation:
        yield
    if preparation.compile_time:
        say(f"{what}: {preparation.compile_time:.2g} s")


def check_files(
    given: Sequence[Path | None], others: Sequence[Path | None] = (), **files: Path | None
) -> None:
    """Refuse files that cannot be written, before any work is done.

    Keywords are files by the kinds of ``check_format``; ``others`` have no format, and no file may
    be one of those ``given``.
    """
    from hertzchain.files import check_outputs
    from hertzchain.report.files import check_format

    check_outputs(given, [*others, *files.values()])
    for kind, path in files.items():
        check_format(path, kind)


def write_file(what: str, path: Path | None, write: Callable[[Path], object]) -> None:
    """Write a file, if wanted, after the results are printed: the disk may be full."""
    if path is None:
        return
    with progress() as report_progress:
        report_progress(f"writing {path}")
        write(path)
    say(f"{what} written to {path}", "")
