"""The commands. Results go to stdout, progress and warnings to stderr."""

from hertzchain.cli.program import main

__all__ = ["main"]
