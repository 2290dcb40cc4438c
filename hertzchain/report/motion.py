"""The motion that a run recorded as files: CSV, Parquet or NumPy's npz, as the name says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.files import write_with
from hertzchain.observables.history import History
from hertzchain.observables.result import Result
from hertzchain.report.formats import check_format
from hertzchain.report.tables import write_frame

if TYPE_CHECKING:
    import pandas
    from numpy.typing import NDArray


def recorded(result: Result) -> History:
    """What a run recorded; a SceneError where that is nothing."""
    if result.history is None:
        raise SceneError("history", None, "there is none: run with record = the times to keep")
    return result.history


def at_times(result: Result, times: FloatArray) -> Result:
    """A result with the recorded times, of more, that are among these [s]."""
    history = recorded(result)
    kept = np.isin(history.time, times)
    return replace(
        result,
        history=History(
            history.time[kept],
            history.displacement[kept],
            history.velocity[kept],
            history.contact_force[kept],
        ),
    )


def motion_arrays(result: Result, numbers: Sequence[int] | None = None) -> dict[str, NDArray[Any]]:
    """Recorded motion as arrays by name: times are rows, granules are columns.

    ``time_s`` has shape (times,), ``granule`` (granules,), and ``displacement_m``,
    ``velocity_m_s``, ``contact_force_N`` (times, granules). The contact of granule i is contact i,
    between granules i - 1 and i; granule 1 has the applied force, or that of a near wall. A wall
    is one more granule, which does not move. ``numbers`` are the granules to keep, by default all.
    """
    history = recorded(result)
    applied = result.scene.applied_force(history.time)
    displacement, velocity = history.displacement, history.velocity
    behind = [] if result.scene.near_wall is not None else [applied]
    force = np.column_stack([*behind, history.contact_force])
    if result.scene.wall is not None:
        still = np.zeros(history.time.size)
        displacement = np.column_stack([displacement, still])
        velocity = np.column_stack([velocity, still])
    granule = np.arange(1, force.shape[1] + 1)
    kept = granule if numbers is None else np.asarray(numbers)
    return {
        "time_s": history.time,
        "granule": kept,
        "displacement_m": displacement[:, kept - 1],
        "velocity_m_s": velocity[:, kept - 1],
        "contact_force_N": force[:, kept - 1],
    }


def motion_frame(result: Result, numbers: Sequence[int] | None = None) -> pandas.DataFrame:
    """Recorded motion as a table with a row for each time and granule, time by time.

    Its columns are those of ``motion_arrays``. ``frame.pivot(index="time_s", columns="granule",
    values="contact_force_N")`` makes a column for each granule.
    """
    import pandas

    arrays = motion_arrays(result, numbers)
    times, granules = arrays.pop("time_s"), arrays.pop("granule")
    return pandas.DataFrame(
        {
            "time_s": np.repeat(times, granules.size),
            "granule": np.tile(granules, times.size),
            **{name: values.ravel() for name, values in arrays.items()},
        }
    )


def write_motion(result: Result, path: Path | str, numbers: Sequence[int] | None = None) -> None:
    """Write recorded motion, whole or not at all; else raise an OutputError.

    ``.csv`` and ``.parquet`` have the table of ``motion_frame``, ``.npz`` the arrays of
    ``motion_arrays``.
    """
    check_format(path, "motion")
    if Path(path).suffix.lower() == ".npz":
        write_with(path, partial(_write_arrays, motion_arrays(result, numbers)))
    else:
        write_frame(motion_frame(result, numbers), Path(path))


def write_traces(result: Result, path: Path | str) -> None:
    """Write ``Result.to_traces``, whole or not at all, as .csv or .parquet; else an OutputError."""
    check_format(path, "traces")
    write_frame(result.to_traces(), Path(path))


def _write_arrays(arrays: dict[str, NDArray[Any]], path: Path) -> None:
    # To a name that does not end in .npz, as .NPZ, NumPy would add that.
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type] # no array is allow_pickle
