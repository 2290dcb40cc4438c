"""Noise of a recording: how strong it is, and more of the same kind."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray

LEAST = 16
"""Samples without a pulse from which noise is known; chosen."""

_TO_DEVIATION = 1.4826  # of Gaussian noise: its standard deviation over its median size


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of the force.

    Parameters
    ----------
    deviation
        Standard deviation of a sample [N]; at least that of the digits of the recording.
    density
        Standard deviation of its integral over a time, over the root of that time [N s^(1/2)].
    samples
        Measured without a pulse, of mean 0 [N]; empty where the recording has too few.
    """

    deviation: float
    density: float
    samples: FloatArray

    def again(self, count: int, length: int, generator: np.random.Generator) -> FloatArray:
        """Noise of the same kind, shape (count, length).

        It is pieced together from blocks of what was measured, which keeps how neighbouring
        samples hang together (Kunsch 1989), or Gaussian where too little was.
        """
        measured = self.samples.size
        if measured < LEAST or not np.any(self.samples):
            return generator.normal(0.0, self.deviation, (count, length))
        block = math.isqrt(measured)
        starts = generator.integers(0, measured - block + 1, (count, -(-length // block)))
        drawn: FloatArray = self.samples[starts[:, :, np.newaxis] + np.arange(block)]
        return drawn.reshape(count, -1)[:, :length]


def noise_before(force: FloatArray, step: float, resolution: float) -> Noise:
    """Noise of samples without a pulse, shape (samples,), at least ``LEAST`` [N].

    ``step`` is the time between samples [s], ``resolution`` the last digit [N].
    """
    samples = force - force.mean()
    of_digits = resolution / math.sqrt(12.0)  # of an error anywhere within a digit
    deviation = max(float(samples.std(ddof=1)), of_digits)
    block = math.isqrt(samples.size)
    blocks = samples[: samples.size // block * block].reshape(-1, block)
    of_blocks = float(blocks.mean(axis=1).std(ddof=1)) * math.sqrt(block * step)
    return Noise(deviation, max(of_blocks, of_digits * math.sqrt(step)), samples)


def noise_within(force: FloatArray, step: float, resolution: float) -> Noise:
    """Noise of samples of a pulse [N], from how they scatter about their neighbours.

    Second differences of white noise have sqrt(6) times its deviation; those of a smooth pulse are
    smaller.
    """
    second = np.diff(force, 2)
    scatter = float(np.median(np.abs(second))) * _TO_DEVIATION / math.sqrt(6.0)
    deviation = max(scatter, resolution / math.sqrt(12.0))
    return Noise(deviation, deviation * math.sqrt(step), np.zeros(0))


def resolution_of(force: FloatArray) -> float:
    """The digit in which forces are recorded [N]; 0 where it is finer than the samples show.

    Where a quarter of the samples, or fewer, have values of their own, it is the least difference
    of two values. Two values alone are a rectangle, whose height is no digit.
    """
    values = np.unique(force)
    if values.size < 3 or values.size > force.size / 4:
        return 0.0
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-9 * np.abs(values).max()]  # products of equal numbers, rounded
    return float(gaps.min()) if gaps.size else 0.0
