"""Results as files: CSV, JSON or Parquet, chosen by the suffix."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.files import write_text, write_with
from hertzchain.observables.result import Result
from hertzchain.report.formats import check_format
from hertzchain.report.waterfall import recorded
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
    """Write a table as Parquet or, for any other name or a pipe, as CSV."""
    if path.suffix.lower() == ".parquet":
        write_with(path, lambda part: frame.to_parquet(part, engine="pyarrow", index=False))
    else:
        write_text(path, frame.to_csv(index=False))


def motion_frame(result: Result) -> pandas.DataFrame:
    """Recorded motion as a table with a row for each time and granule, time by time.

    Its columns are ``time_s``, ``granule``, ``displacement_m``, ``velocity_m_s`` and
    ``contact_force_N``. The contact of granule i is contact i, between granules i - 1 and i;
    granule 1 has the applied force, or that of a near wall. A wall is one more granule, which does
    not move. ``frame.pivot(index="time_s", columns="granule", values="contact_force_N")`` makes a
    column for each granule.
    """
    import pandas

    history = recorded(result)
    applied = result.scene.applied_force(history.time)
    displacement, velocity = history.displacement, history.velocity
    behind = [] if result.scene.near_wall is not None else [applied]
    force = np.column_stack([*behind, history.contact_force])
    if result.scene.wall is not None:
        still = np.zeros(history.time.size)
        displacement = np.column_stack([displacement, still])
        velocity = np.column_stack([velocity, still])
    times, granules = force.shape
    return pandas.DataFrame(
        {
            "time_s": np.repeat(history.time, granules),
            "granule": np.tile(np.arange(1, granules + 1), times),
            "displacement_m": displacement.ravel(),
            "velocity_m_s": velocity.ravel(),
            "contact_force_N": force.ravel(),
        }
    )
