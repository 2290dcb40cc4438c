"""The description of the package: the README without pictures and links that are files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_PICTURE = re.compile(r"!\[[^\]]*\]\((?![a-z]+:)[^)]+\)\n\n?")
"""From a file, with the empty line after it."""

_LINK = re.compile(r"\[([^\]]+)\]\((?![a-z]+:|#)([^)]+)\)")
"""To a file: neither an address nor a heading."""


def description(readme: str) -> str:
    """The README where no other file is: links to files become their names, pictures are left out.

    Parameters
    ----------
    readme
        Markdown, with links to files as they lie in the source distribution.
    """
    return _LINK.sub(lambda link: _named(*link.groups()), _PICTURE.sub("", readme))


def _named(text: str, file: str) -> str:
    return f"`{file}`" if text == file else f"{text} (`{file}`)"


class Description(MetadataHookInterface):
    """Gives builds their ``readme``."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Called by hatchling."""
        readme = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": description(readme)}
