"""Results as files: CSV, JSON or Parquet, chosen by the suffix."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hertzchain.files import write_text, write_with
from hertzchain.observables.result import Result
from hertzchain.report.formats import check_format
from hertzchain.theory.two_spheres import parting


def run_document(result: Any) -> dict[str, Any]:
    """Return the JSON document of a run: the result, and how two spheres part under its damping."""
    document: dict[str, Any] = result.to_dict()
    spheres = parting(result.scene) if isinstance(result, Result) else None
    if spheres is None:
        return document
    own = {"restitution": spheres.restitution, "speed_m_s": spheres.speed}
    return {**document, "two_spheres": own}


def _write_csv(result: Result, path: Path) -> None:
    write_text(path, result.to_frame().to_csv(index=False))


def _write_json(result: Result, path: Path) -> None:
    write_text(path, json.dumps(run_document(result), indent=2, allow_nan=False) + "\n")


def _write_parquet(result: Result, path: Path) -> None:
    frame = result.to_frame()
    write_with(path, lambda part: frame.to_parquet(part, engine="pyarrow", index=False))


_WRITERS: dict[str, Callable[[Result, Path], None]] = {
    "": _write_csv,  # pipes and devices have no suffix
    ".csv": _write_csv,
    ".json": _write_json,
    ".parquet": _write_parquet,
}


def write_result(result: Any, path: Path | str) -> None:
    """Write a result, completely or not at all; OutputError on failure.

    ``.csv`` and ``.parquet`` have a row for each contact, as ``Result.to_frame``; ``.json`` has the
    whole result, as ``Result.to_dict``. A spread has the same functions.
    """
    check_format(path, "result")
    _WRITERS[Path(path).suffix.lower()](result, Path(path))
