"""hertzchain init: a commented scene file to start from."""

from __future__ import annotations

import shlex
from enum import StrEnum
from pathlib import Path

import typer

from hertzchain.errors import OutputError
from hertzchain.files import check_outputs
from hertzchain.scene.starters import STARTERS, files_of, write_starter

Kind = StrEnum("Kind", {name.upper(): name for name in STARTERS})  # type: ignore[misc]
"""The scenes to start from, as choices of an option."""

PULSE = Kind("pulse")


def init(
    path: Path = typer.Argument(
        Path("scene.toml"), metavar="FILE", help="The scene file to write (TOML)."
    ),
    kind: Kind = typer.Option(PULSE, "--from", help="Kind of the scene."),
) -> None:
    """Write a commented scene file to start from.

    The command also says what to do next. "pulse-table" also writes a table next to it, to be
    replaced with a measured pulse.
    """
    files = files_of(kind.value, path)
    check_outputs([], files)
    if there := [file for file in files if file.exists()]:
        raise OutputError(f"{there[0]}: exists; name another file, or delete it")
    written = write_starter(kind.value, path)
    typer.echo(f"{' and '.join(map(str, written))}: {STARTERS[kind.value].title}")
    typer.echo(f"Change it in an editor, then: hertzchain compare {shlex.quote(str(path))}")
