"""Ramps: stretches of an applied force between two corners, and the shapes that they can have.

Between two corners the force is smooth; at a corner it, or one of its derivatives, jumps.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.errors import SceneError


@dataclass(frozen=True)
class Shape:
    """Shape of a ramp: growth of the force from 0 to 1 over the part s of the ramp, from 0 to 1.

    Parameters
    ----------
    growth, rate
        The growth and its derivative at s, a number or an array.
    area
        The integral from 0 to 1.
    formula
        The growth in Python's words, {} for s.
    code
        Number of the formula in compiled loops, 1 linear and 2 cosine; None where they have none.
    part
        Where this shape starts and ends on the ramp of that formula.
    """

    growth: Callable[[Any], Any]
    rate: Callable[[Any], Any]
    area: float
    formula: str
    code: int | None = None
    part: tuple[float, float] = (0.0, 1.0)

    @property
    def is_curved(self) -> bool:
        """Whether the impulse needs several steps, however short the ramp."""
        return self.formula != "{}"

    def for_numpy(self, s: str) -> str:
        """Return the growth as an expression of NumPy, imported as np."""
        return re.sub(r"\b([a-z]+)\b", r"np.\1", self.formula).format(s)

    def for_lammps(self, s: str) -> str:
        """Return the growth as a formula of LAMMPS or LIGGGHTS."""
        compact = self.formula.replace(" ", "").replace("**", "^").replace("pi", "PI")
        return compact.format(s)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
"""Gauss's quadrature; 12 nodes integrate half a period of a cosine to round-off."""

SHAPES = {
    "linear": Shape(lambda s: s, np.ones_like, 0.5, "{}", 1),
    # (1 - cos) / 2 would lose all digits just after the start.
    "cosine": Shape(
        lambda s: np.sin(np.pi / 2 * s) ** 2,
        lambda s: np.pi / 2 * np.sin(np.pi * s),
        0.5,
        "sin(pi / 2 * {}) ** 2",
        2,
    ),
    "quarter-sine": Shape(
        lambda s: np.sin(np.pi / 2 * s),
        lambda s: np.pi / 2 * np.cos(np.pi / 2 * s),
        2 / math.pi,
        "sin(pi / 2 * {})",
        2,
        (0.5, 1.0),
    ),
    "quarter-cosine": Shape(
        lambda s: 2 * np.sin(np.pi / 4 * s) ** 2,
        lambda s: np.pi / 2 * np.sin(np.pi / 2 * s),
        1 - 2 / math.pi,
        "2 * sin(pi / 4 * {}) ** 2",
        2,
        (0.0, 0.5),
    ),
}
"""Shapes by name. ``cosine`` is half a period of 1 - cos; the two quarters are those of a sine,
from 0 to its crest and from the crest to 0.
"""


@dataclass(frozen=True)
class Ramp:
    """A ramp: the force goes from one value to another between two corners.

    Parameters
    ----------
    start, end
        Times of the corners [s], ``start < end``.
    start_force, end_force
        Force at each corner, on the side of this ramp [N].
    shape
        A name of ``SHAPES``.

    Raises
    ------
    SceneError
        For a shape that is not one of them.
    """

    start: float
    end: float
    start_force: float
    end_force: float
    shape: str

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise SceneError("shape", self.shape, f"must be one of {', '.join(SHAPES)}")

    def force(self, time: Any) -> Any:
        """The force at a time, or an array of times, between the corners [N] (Eq. 2)."""
        s = (time - self.start) / (self.end - self.start)
        growth = SHAPES[self.shape].growth(s)
        return self.start_force + (self.end_force - self.start_force) * growth

    def force_rate(self, time: Any) -> Any:
        """Time derivative of the force at a time, or an array of times [N/s]."""
        duration = self.end - self.start
        s = (time - self.start) / duration
        return (self.end_force - self.start_force) / duration * SHAPES[self.shape].rate(s)

    @property
    def impulse(self) -> float:
        """Integral of the force over the whole ramp [N s]."""
        area = SHAPES[self.shape].area
        mean = (1 - area) * self.start_force + area * self.end_force
        return mean * (self.end - self.start)

    def impulse_until(self, time: float) -> float:
        """Integral of the force from the start of the ramp to a time inside it [N s]."""
        duration = self.end - self.start
        s = (time - self.start) / duration
        growth = SHAPES[self.shape].growth(s / 2 * (1 + _NODES))
        grown = s / 2 * float(np.dot(_WEIGHTS, growth))
        return duration * (self.start_force * s + (self.end_force - self.start_force) * grown)


def impulse_until(ramps: Sequence[Ramp], end: float) -> float:
    """Integral of the force of successive ramps up to a time [N s]."""
    return math.fsum(
        ramp.impulse if ramp.end <= end else ramp.impulse_until(end)
        for ramp in ramps
        if ramp.start < end
    )
