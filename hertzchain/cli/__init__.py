"""The commands. Results go to standard output, talk and progress to standard error."""

from hertzchain.cli.program import main

__all__ = ["main"]
