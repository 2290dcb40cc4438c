"""Scrambled Sobol points: those of ``scipy.stats.qmc``, which takes half a second to load."""

from __future__ import annotations

import warnings
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray

_BITS = 30
"""Binary digits of a point, as many as SciPy's have."""


def sobol_points(dimensions: int, seed: int, numbers: NDArray[np.int64]) -> FloatArray:
    """Return points of a scrambled Sobol sequence, from 0 to 1, shape (points, dimensions).

    They are the same as those of ``scipy.stats.qmc.Sobol``, which computes them in more dimensions
    than ``directions.txt`` has.

    Parameters
    ----------
    dimensions
        Number of coordinates, 1 to 21,201.
    seed
        Seed of the scrambling: linear matrices and a digital shift.
    numbers
        Which points, counted from 0, shape (points,).
    """
    if dimensions > len(_directions()):
        from scipy.stats import qmc

        with warnings.catch_warnings(action="ignore", category=UserWarning):  # not a power of two
            every = qmc.Sobol(dimensions, seed=seed).random(int(np.max(numbers)) + 1)
        return np.asarray(every[numbers])
    directions, shift = _scrambled(dimensions, seed)
    gray = numbers ^ numbers >> 1
    points = np.tile(shift, (numbers.size, 1))
    for bit in range(_BITS):
        points[(gray >> bit & 1) == 1] ^= directions[:, bit]
    return points / 2.0**_BITS


def _scrambled(dimensions: int, seed: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return scrambled direction numbers, (dimensions, bits), and the shifts, (dimensions,)."""
    random, places = np.random.default_rng(seed), np.arange(_BITS)

    def bits(*shape: int) -> NDArray[Any]:
        return random.integers(2, size=(dimensions, *shape), dtype=np.uint32).astype(np.int64)

    shift = bits(_BITS) @ (1 << places)
    matrix = np.tril(bits(_BITS, _BITS))
    matrix[:, places, places] = 1
    digits = np.array(_directions()[:dimensions])[..., np.newaxis] >> places[::-1] & 1
    return (digits @ matrix.transpose(0, 2, 1) & 1) @ (1 << places[::-1]), shift


@cache
def _directions() -> list[list[int]]:
    """Return the direction numbers of each dimension, by the recurrence of Bratley and Fox."""
    text = resources.files(__package__).joinpath("directions.txt").read_text("ascii")
    every = [[1] * _BITS]
    for line in text.splitlines()[3:]:
        polynomial, *numbers = map(int, line.split())
        degree = len(numbers)
        for _ in range(_BITS - degree):
            number = numbers[-degree]
            for k in range(1, degree + 1):
                if polynomial >> degree - k & 1:
                    number ^= numbers[-k] << k
            numbers.append(number)
        every.append(numbers)
    return [[number << _BITS - 1 - k for k, number in enumerate(row)] for row in every]
