"""The noise of a recording: its strength, and its correlation between neighbours."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray

LEAST = 16
"""Least number of samples without a pulse from which noise is measured (chosen)."""

_TO_DEVIATION = 1.4826  # standard deviation over median size of Gaussian noise


@dataclass(frozen=True)
class Noise:
    """Noise of the force.

    Parameters
    ----------
    deviation
        Standard deviation of a sample [N]; at least that of the digits of the recording.
    density
        Standard deviation of its integral over a time, over the root of that time [N s^(1/2)].
    """

    deviation: float
    density: float

    def of_mean(self, samples: int, step: float) -> float:
        """Return the standard deviation of a mean [N] of samples with a time between them [s]."""
        slow = self.density / math.sqrt(samples * step)
        return max(self.deviation / math.sqrt(samples), slow)


def noise_before(force: FloatArray, step: float, resolution: float) -> Noise:
    """Measure the noise of samples without a pulse, shape (samples,), at least ``LEAST`` [N].

    ``step`` is the time between samples [s], ``resolution`` the last digit [N].
    """
    samples = force - force.mean()
    # standard deviation of an error anywhere within a digit
    of_digits = resolution / math.sqrt(12.0)
    deviation = max(float(samples.std(ddof=1)), of_digits)
    block = math.isqrt(samples.size)
    blocks = samples[: samples.size // block * block].reshape(-1, block)
    of_blocks = float(blocks.mean(axis=1).std(ddof=1)) * math.sqrt(block * step)
    return Noise(deviation, max(of_blocks, of_digits * math.sqrt(step)))


def noise_within(force: FloatArray, step: float, resolution: float) -> Noise:
    """Return the noise of samples of a pulse [N], from their scatter about their neighbours.

    Second differences of white noise have sqrt(6) times its deviation; those of a smooth pulse are
    smaller.
    """
    second = np.diff(force, 2)
    scatter = float(np.median(np.abs(second))) * _TO_DEVIATION / math.sqrt(6.0)
    deviation = max(scatter, resolution / math.sqrt(12.0))
    return Noise(deviation, deviation * math.sqrt(step))


def resolution_of(force: FloatArray) -> float:
    """Return the last digit of recorded forces [N]; 0 if the samples do not show it.

    If at most a quarter of the samples have distinct values, it is the least difference of two
    values. Only two values mean a rectangle, whose height is not a digit.
    """
    values = np.unique(force)
    if values.size < 3 or values.size > force.size / 4:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-9 * np.abs(values).max()]  # equal products may differ by rounding
    return float(gaps.min()) if gaps.size else 0.0
