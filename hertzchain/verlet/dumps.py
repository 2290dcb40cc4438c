"""Text dumps of LAMMPS and of codes that have it from there: ``dump custom`` and ``write_dump``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed

_HEADER = 9
"""Lines before the granules of a frame: step, number of granules, box, names of the columns."""


def read_frames(path: Path, columns: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """The frames of a dump file, granules in the order of their ids.

    Parameters
    ----------
    path
        The file.
    columns
        Names of the columns wanted; the dump has an ``id`` besides.

    Returns
    -------
    Steps, shape (frames,), and values, shape (frames, columns, granules).

    Raises
    ------
    RunFailed
        If the file is not there, is no dump, ends early or has other columns.
    """
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise RunFailed(f"{path.name}: the run left no dump that can be read ({problem})") from None
    steps, values = [], []
    at = 0
    try:
        while at < len(lines):
            step, granules = int(lines[at + 1]), int(lines[at + 3])
            names = lines[at + 8].split()[2:]
            rows = lines[at + _HEADER : at + _HEADER + granules]
            table = np.array([row.split() for row in rows], np.float64)
            if table.shape != (granules, len(names)):
                raise ValueError(table.shape)  # noqa: TRY301 - as for numbers that are cut off
            order = np.argsort(table[:, names.index("id")])
            steps.append(step)
            values.append([table[order, names.index(name)] for name in columns])
            at += _HEADER + granules
    except (ValueError, IndexError):
        raise RunFailed(
            f"{path.name}: the dump of the run is not whole or has other columns: is the disk full?"
        ) from None
    if not steps:
        raise RunFailed(f"{path.name}: the dump of the run is empty")
    return np.array(steps, np.float64), np.array(values, np.float64)
