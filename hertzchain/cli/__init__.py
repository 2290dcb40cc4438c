"""The commands. Results go to standard output, talk and progress to standard error."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hertzchain.cli.program import main

if TYPE_CHECKING:
    from hertzchain.cli.commands import app

__all__ = ["app", "main"]


def __getattr__(name: str) -> Any:
    """Load the commands when they are first asked for: ``main`` has to be there before them."""
    if name == "app":
        from hertzchain.cli.commands import app

        return app
    raise AttributeError(f"module 'hertzchain.cli' has no attribute {name!r}")
