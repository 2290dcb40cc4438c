"""The commands. Results go to standard output, talk and progress to standard error."""

from hertzchain.cli.commands import app, main

__all__ = ["app", "main"]
