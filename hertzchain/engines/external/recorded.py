"""Observes codes after their run, from the readings that they left in files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import Observation
from hertzchain.engines.external.readings import BLOCK, Granules, count_readings, reading_times
from hertzchain.errors import RunFailed
from hertzchain.limits import refuse_memory
from hertzchain.scene.schedule import Leg

_BYTES = 180  # least bytes of memory for a granule in a reading; measured for a dump: 187


def refuse_large(legs: Sequence[Leg], strides: Sequence[int], granules: int) -> None:
    """Refuse a run whose readings do not fit into memory."""
    refuse_memory(float(_BYTES) * count_readings(legs, strides) * granules)


def observe(
    seen: Observation, at_rest: Granules, readings: FloatArray, strides: Sequence[int],
    wall_force: FloatArray | None = None,
) -> None:  # fmt: skip
    """Add all readings of a run to an observation.

    They are positions [m], velocities [m/s] and net forces [N], shape (readings, 3, granules), leg
    by leg at the given steps; a corner has two readings, with the force before and after it. With a
    wall there is the force on it [N], shape (readings,). Other numbers of readings raise RunFailed;
    for further errors see ``Observation``.
    """
    wanted = count_readings(seen.legs, strides)
    if len(readings) != wanted:
        raise RunFailed(
            f"{seen.code} left {len(readings)} readings, not the {wanted} it was asked for"
        )
    seen.begin(at_rest)
    at = 0
    for number, (leg, stride) in enumerate(zip(seen.legs, strides, strict=True)):
        time = reading_times(leg, stride)
        for first in range(0, time.size - 1, BLOCK):
            span = slice(first, min(first + BLOCK + 1, time.size))
            block = slice(at + span.start, at + span.stop)
            on_wall = None if wall_force is None else wall_force[block]
            seen.update(number, time[span], readings[block], on_wall)
        at += time.size


def read_array(path: Path, shape: tuple[int | None, ...], code: str) -> FloatArray:
    """Read an array that a run left in a file (.npy); in ``shape`` None stands for any length."""
    try:
        array = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as problem:
        raise RunFailed(f"{code} left no readings that can be read ({problem})") from None
    right = array.dtype == np.float64 and array.ndim == len(shape)
    if not right or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
        raise RunFailed(f"{code} left readings of another shape: is the disk full?")
    return np.asarray(array, np.float64)
