"""Commented scene files to start from: the folder ``starter_files``, by name."""

from __future__ import annotations

import json
from pathlib import Path

from hertzchain.errors import OutputError
from hertzchain.files import write_texts

NAMES = (
    *("pulse", "half-sine", "pulse-table", "striker", "wall", "dimer", "cradle", "precompressed"),
    *("free-striker", "damped", "piston", "sine", "local", "clamped", "two-walls"),
)

STARTERS = {name: Path(__file__).with_name("starter_files") / f"{name}.toml" for name in NAMES}
"""Scene files by name, in the order in which they are listed; a CSV file is the table of one."""


def title_of(name: str) -> str:
    """Return what a starter describes, the first line of its file."""
    return STARTERS[name].read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")


def write_starter(name: str, path: Path) -> list[Path]:
    """Write a scene file to start from and its pulse table, if any; return the files in order.

    The table is named as the scene file, with the suffix .csv. An OutputError says what cannot be
    written; then no file is.
    """
    files, sources = files_of(name, path), [STARTERS[name], STARTERS[name].with_suffix(".csv")]
    texts = [source.read_text(encoding="utf-8") for source in sources[: len(files)]]
    table_name = json.dumps(files[-1].name, ensure_ascii=False)
    texts[0] = texts[0].replace(f'"{sources[1].name}"', table_name)
    write_texts(dict(zip(files, texts, strict=True)))
    return files


def files_of(name: str, path: Path) -> list[Path]:
    """Return the files that ``write_starter`` writes; an OutputError if two have the same name."""
    if not STARTERS[name].with_suffix(".csv").exists():
        return [path]
    table = path.with_suffix(".csv")
    if table == path:
        raise OutputError(
            f"{path}: is the name of the pulse table, which is the scene's name with .csv: name"
            f" the scene {path.with_suffix('.toml')}"
        )
    return [path, table]
