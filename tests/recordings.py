"""Files as oscilloscopes write them, of pulses that are known exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray

FORCE = 100.0  # F0 [N]
DURATION = 70e-6  # [s]
START = -2e-6  # of the pulse in the file [s]
GAIN = 25.0  # N for each volt
OFFSET = 0.012  # of the signal [V]

PREAMBLE = """\
# Recorded with an oscilloscope; trigger at 0
Model;DPO 2014
Sample interval;9,0E-08
Time;CH1
us;V
"""


def sine_squared(time: FloatArray) -> FloatArray:
    """The force at times of a file [N]: a cosine pulse with n = 2."""
    part = np.clip((time - START) / DURATION, 0, 1)
    return FORCE * np.sin(np.pi * part) ** 2


def times(samples: int) -> FloatArray:
    """Times of a file [s], from a trigger 20 us before 0."""
    return np.linspace(-20e-6, 160e-6, samples)


def volts(samples: int, noise: float = 0.0, seed: int = 3) -> FloatArray:
    """The signal of a file [V]; the noise is a part of F0."""
    deviation = noise * FORCE / GAIN
    generator = np.random.default_rng(seed)
    signal = sine_squared(times(samples)) / GAIN + OFFSET
    voltage: FloatArray = signal + generator.normal(0, deviation, samples)
    return voltage


def write_scope(path: Path, samples: int = 2000, noise: float = 0.01, seed: int = 3) -> Path:
    """Write a file with comments, semicolons and decimal commas, times in us and volts."""
    rows = zip(times(samples) * 1e6, volts(samples, noise, seed), strict=True)
    lines = (f"{time:.4f};{value:.4f}\n".replace(".", ",") for time, value in rows)
    path.write_text(PREAMBLE + "".join(lines), encoding="utf-8")
    return path
