"""The command line as a program: errors and signals, handled before much is loaded."""

from __future__ import annotations

import atexit
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from hertzchain.errors import HertzchainError
from hertzchain.progress import discard, say

if TYPE_CHECKING:
    from sys import UnraisableHookArgs


class _Stopped(BaseException):
    """Raised by Ctrl-C or SIGTERM; not an Exception, because Typer would catch that."""


@contextmanager
def _stoppable() -> Iterator[None]:
    """Let both signals raise, so that cleaning up happens: at SIGTERM Python would end at once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _: object) -> None:
        raise _Stopped(number)

    def unraisable(lost: UnraisableHookArgs) -> None:
        """Repeat a stop lost in a callback of C: LLVM calls back after each compilation."""
        if not isinstance(lost.exc_value, _Stopped):
            hook(lost)
            return
        # Seconds until a lost stop is tried again
        timer = threading.Timer(0.02, signal.raise_signal, lost.exc_value.args)
        timer.daemon = True
        timer.start()

    before = {}
    hook, sys.unraisablehook = sys.unraisablehook, unraisable
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
        yield
    finally:
        atexit.unregister(_ignore)
        atexit.register(_ignore, tuple(before))
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook


def _ignore(numbers: tuple[int, ...]) -> None:
    """Ignore both signals: Python ends with the status of the finished work."""
    for number in numbers:
        signal.signal(number, signal.SIG_IGN)


def main() -> None:
    """Run the command line; a user's mistake is one sentence and status 2."""
    os.environ.pop("MPLBACKEND", None)  # figures have no window; Matplotlib refuses unknown names
    try:
        Path.cwd()
    except OSError:  # modules that are loaded later fail in many ways
        _refuse("the current folder was deleted: change to another one")
    try:
        with _stoppable():
            from hertzchain.cli.commands import app
            from hertzchain.cli.options import with_variables

            words = with_variables(sys.argv[1:]) or ["--help"]
            sys.exit(app(words, prog_name="hertzchain", standalone_mode=False) or 0)
    except _Stopped as stop:
        number = stop.args[0]
        say("interrupted" if number == signal.SIGINT else "terminated")
        sys.exit(128 + number)  # as in shells
    except HertzchainError as problem:
        _refuse(problem)
    except MemoryError:
        _refuse("there is not enough memory for this scene")
    except SystemExit as end:
        # Typer gives it the status 1, which says here that a check failed.
        if not isinstance(end.__context__, BrokenPipeError):
            raise
        # Status of programs that SIGPIPE ends, in shells
        sys.exit(141)
    except OSError as problem:
        if problem.filename is not None:
            _refuse(f"{problem.filename}: {problem.strerror}")
        discard(sys.stdout)
        _refuse(f"standard output cannot be written ({problem.strerror or problem})")
    except Exception as problem:
        if not hasattr(problem, "format_message"):  # Typer's errors, whose class is private, do
            raise
        _refuse(_on_words(problem.format_message()))


def _on_words(message: str) -> str:
    """Return Typer's message on the words of a command line as other messages are worded."""
    match = re.fullmatch(r"Invalid value for '(?:.* / )?(.+?)': (?:Value error, )?(.+)", message)
    if match is None:
        return message[:1].lower() + message[1:]
    name, why = match[1], match[2]
    for kind in ("a number", "an integer"):
        if f"valid {kind.split()[1]}" in why:
            why = f"must be {kind}"
    if name in sys.argv[:-1]:
        name += f" {sys.argv[sys.argv.index(name) + 1]}"
    return f"{name}: {why}"


def _refuse(why: object) -> NoReturn:
    from hertzchain.cli.output import UNUSABLE

    say(why)
    sys.exit(UNUSABLE)
