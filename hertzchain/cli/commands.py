"""The command line: which commands there are, and what becomes of a stop and of errors."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Annotated

import typer

from hertzchain.cli.compare import compare
from hertzchain.cli.deck import deck, lint, unit_test
from hertzchain.cli.doctor import doctor
from hertzchain.cli.output import UNUSABLE
from hertzchain.cli.plot import plot
from hertzchain.cli.predict import predict
from hertzchain.cli.run import run
from hertzchain.cli.sweep import sweep
from hertzchain.cli.tradeoff import tradeoff
from hertzchain.errors import HertzchainError

app = typer.Typer(
    name="hertzchain",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="How hard each contact of a shocked chain of spheres is pressed, and how sure that is.",
    epilog="Exit status: 0 done and within tolerance, 1 out of tolerance, 2 unusable input, a"
    " refusal or a missing backend, 130 interrupted, 143 terminated.",
)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"hertzchain {version('hertzchain')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


# A command is a function with options; --help lists them in this order.
app.command()(run)
app.command()(compare)
app.command()(tradeoff)
app.command()(sweep)
app.command()(plot)
app.command()(predict)
app.command()(deck)
app.command()(lint)
app.command()(unit_test)
app.command()(doctor)


class _Stopped(BaseException):
    """By Ctrl-C or SIGTERM; no Exception, as KeyboardInterrupt is none, which Typer keeps."""


@contextmanager
def _stoppable() -> Iterator[None]:
    """Let both raise, so that what is begun is cleaned up: at SIGTERM Python would end at once."""

    def stop(number: int, _: object) -> None:
        raise _Stopped(number)

    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def main() -> None:
    """Run the command line; a user's mistake is one sentence and status 2."""
    try:
        with _stoppable():
            app(prog_name="hertzchain")
    except _Stopped as stop:
        number = stop.args[0]
        how = "interrupted" if number == signal.SIGINT else "terminated"
        typer.echo(f"hertzchain: {how}", err=True)
        sys.exit(128 + number)  # as shells have it
    except HertzchainError as problem:
        typer.echo(f"hertzchain: {problem}", err=True)
        sys.exit(UNUSABLE)
    except MemoryError:
        typer.echo("hertzchain: there is not enough memory for this scene", err=True)
        sys.exit(UNUSABLE)
    except OSError as problem:  # standard output is full or gone
        # What is left in its buffer must not fail again when Python ends.
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        typer.echo(f"hertzchain: {problem}", err=True)
        sys.exit(UNUSABLE)
