"""Runs of codes that are watched only when they are over: what they left behind is read in turn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import Observation, Simulation
from hertzchain.engines.external.readings import Granules
from hertzchain.engines.external.rescaling import Softening
from hertzchain.errors import RunFailed
from hertzchain.limits import refuse_memory
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_BYTES = 180
"""Of memory for a granule in a reading, at least: 187 measured for a dump, as text and as numbers.
Yade's arrays take as much in its own process, while it makes them."""

_BLOCK = 256
"""Readings handed on at a time."""


def stops(leg: Leg, stride: int) -> list[int]:
    """Steps of a leg at which it is read: every ``stride``, and the first and the last."""
    return [*range(0, leg.steps, stride), leg.steps]


def refuse_large(legs: Sequence[Leg], strides: Sequence[int], granules: int) -> None:
    """Refuse a run whose readings do not fit into memory.

    Raises
    ------
    TooExpensive
        If they do not.
    """
    readings = sum(leg.steps // stride + 2 for leg, stride in zip(legs, strides, strict=True))
    refuse_memory(float(_BYTES) * readings * granules)


def observe(
    scene: Scene,
    made: Softening,
    at_rest: Granules,
    readings: FloatArray,
    legs: Sequence[Leg],
    strides: Sequence[int],
    times: FloatArray | None,
    code: str,
    version: str,
) -> Simulation:
    """What a run has found, from all its readings.

    Parameters
    ----------
    scene
        The true scene.
    made
        How that which the code was given differs from it.
    at_rest
        The granules that the code made, before the shock.
    readings
        In the scene that the code was given: positions [m], velocities [m/s] and net forces [N],
        shape (readings, 3, granules), leg by leg; at a corner twice, with the force before it and
        after it.
    legs, strides
        Of the true scene, and the steps between two readings on each.
    times
        Wanted times of a history [s], if any.
    code, version
        What it is called, and which one it is.

    Raises
    ------
    RunFailed
        If there are other readings than these, or other granules.
    StepUnstable, OverlapTooLarge
        See ``Observation``.
    """
    wanted = sum(len(stops(leg, stride)) for leg, stride in zip(legs, strides, strict=True))
    if len(readings) != wanted:
        raise RunFailed(f"{code} left {len(readings)} readings, not the {wanted} it was asked for")
    seen = Observation(scene, made, at_rest, times, code)
    at = 0
    for leg, stride in zip(legs, strides, strict=True):
        given, read = made.leg(leg), stops(leg, stride)
        time = given.start + given.dt * np.array(read)
        time[-1] = given.end  # to the last digit, so that nothing falls between legs
        arrays = readings[at : at + len(read)]
        for first in range(0, len(read) - 1, _BLOCK):
            block = slice(first, first + _BLOCK + 1)
            seen.show(time[block], arrays[block], leg)
        at += len(read)
    return seen.simulation(tuple(legs), version, watching_share=None)


def read_array(path: Path, shape: tuple[int | None, ...], code: str) -> FloatArray:
    """An array that a run has left in a file of NumPy's.

    Parameters
    ----------
    path
        The file (.npy).
    shape
        What it has to be, with None where any length will do.
    code
        Who left it.

    Raises
    ------
    RunFailed
        If it is not there or has another shape.
    """
    try:
        found = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as problem:
        raise RunFailed(f"{code} left no readings that can be read ({problem})") from None
    right = found.dtype == np.float64 and found.ndim == len(shape)
    if not right or any(n not in (None, m) for n, m in zip(shape, found.shape, strict=True)):
        raise RunFailed(f"{code} left readings of another shape: is the disk full?")
    return np.asarray(found, np.float64)
