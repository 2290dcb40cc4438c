"""Reads text dumps of LAMMPS and codes derived from it: ``dump custom`` and ``write_dump``."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed

_HEADER = 9  # lines before the granules of a frame: step, count, box, names of columns


def read_frames(path: Path, columns: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Read a whole dump: steps, (frames,), and values, (frames, columns, granules)."""
    blocks = list(read_blocks(path, columns))
    return np.concatenate([steps for steps, _ in blocks]), np.concatenate(
        [values for _, values in blocks]
    )


def read_blocks(
    path: Path, columns: tuple[str, ...], frames: int = 256
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Read as ``read_frames`` in blocks of frames; the dump has an ``id`` besides the columns."""
    try:
        with path.open(encoding="ascii") as file:
            head = list(itertools.islice(file, _HEADER))
            if not head:
                raise RunFailed(f"{path.name}: the dump of the run is empty")
            lines = itertools.chain(head, file)
            length = frames * (_HEADER + int(head[3]))
            while block := list(itertools.islice(lines, length)):
                yield _frames(block, columns)
    except (OSError, UnicodeDecodeError) as problem:
        raise RunFailed(f"{path.name}: the run left no dump that can be read ({problem})") from None
    except (ValueError, IndexError):
        raise RunFailed(
            f"{path.name}: the dump of the run is cut off or has other columns: is the disk full?"
        ) from None


def _frames(lines: list[str], columns: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    steps, values = [], []
    at = 0
    while at < len(lines):
        step, granules = int(lines[at + 1]), int(lines[at + 3])
        names = lines[at + 8].split()[2:]
        rows = lines[at + _HEADER : at + _HEADER + granules]
        table = np.array([[float(number) for number in row.split()] for row in rows])
        if table.shape != (granules, len(names)):
            raise ValueError(table.shape)
        order = np.argsort(table[:, names.index("id")])
        steps.append(step)
        values.append([table[order, names.index(name)] for name in columns])
        at += _HEADER + granules
    return np.array(steps, np.float64), np.array(values, np.float64)
