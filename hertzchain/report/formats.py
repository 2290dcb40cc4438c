"""Suffixes of files that can be written; others are refused before any work is done."""

from __future__ import annotations

from pathlib import Path

from hertzchain.errors import OutputError

_KNOWN = {
    "plot": ("cannot be drawn, the name", (".pdf", ".png", ".svg")),
    "page": ("a report is a page, the name", (".html", ".htm")),
    "trajectory": ("a trajectory's name", (".xyz", ".extxyz")),
    "motion": ("with --record the motion is written, the name", (".csv", ".parquet")),
    "traces": ("traces are a table, the name", (".csv", ".parquet")),
    "result": ("cannot be written, the name", (".csv", ".json", ".parquet")),
}
"""Words on each kind of file, and the suffixes of its formats."""


def check_format(path: Path | str | None, kind: str) -> None:
    """Raise an OutputError for a file, if one is wanted, whose suffix is no format of its kind."""
    words, known = _KNOWN[kind]
    suffix = "" if path is None else Path(path).suffix.lower()
    is_pipe = kind == "result" and not suffix  # pipes and devices have none
    if path is None or is_pipe:
        return
    if suffix not in known:
        listed = (" or " if kind in ("page", "trajectory") else ", ").join(known)
        raise OutputError(f"{path}: {words} must end in {listed}")
