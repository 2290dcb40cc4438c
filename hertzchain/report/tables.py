"""Results as files: CSV, JSON or Parquet, chosen by the suffix."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hertzchain.files import write_text, write_with
from hertzchain.observables.result import Result
from hertzchain.report.formats import check_format
from hertzchain.theory.two_spheres import parting

if TYPE_CHECKING:
    import pandas


def run_document(result: Any) -> dict[str, Any]:
    """Return the JSON document of a run: the result, and how two spheres part under its damping."""
    document: dict[str, Any] = result.to_dict()
    spheres = parting(result.scene) if isinstance(result, Result) else None
    if spheres is None:
        return document
    own = {"restitution": spheres.restitution, "speed_m_s": spheres.speed}
    return {**document, "two_spheres": own}


def write_result(result: Any, path: Path | str) -> None:
    """Write a result, completely or not at all; OutputError on failure.

    ``.csv`` and ``.parquet`` have a row for each contact, as ``Result.to_frame``; ``.json`` has the
    whole result, as ``Result.to_dict``. A spread has the same functions.
    """
    check_format(path, "result")
    if Path(path).suffix.lower() == ".json":
        write_text(path, json.dumps(run_document(result), indent=2, allow_nan=False) + "\n")
    else:
        write_frame(result.to_frame(), Path(path))


def write_frame(frame: pandas.DataFrame, path: Path) -> None:
    """Write a table as Parquet or, to any other name, pipes among them, as CSV."""
    if path.suffix.lower() == ".parquet":
        write_with(path, lambda part: frame.to_parquet(part, engine="pyarrow", index=False))
    else:
        write_text(path, frame.to_csv(index=False))
