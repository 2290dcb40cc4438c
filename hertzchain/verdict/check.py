"""A check: one number against its expected value, and advice where it fails."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray


@dataclass(frozen=True)
class Kind:
    """The quantity that a check compares.

    Parameters
    ----------
    name
        Name of the quantity, with its unit, if any.
    advice
        What to do if such a check fails.
    """

    name: str
    advice: str = "do not use this result"


NOT_RUN, FAILED = Kind("not run"), Kind("failed")  # an engine that did not run; the reason says why


@dataclass(frozen=True)
class Check:
    """One comparison of a number with its expected value.

    Parameters
    ----------
    kind
        What is compared.
    engine
        Name of the engine that computed the number.
    measured, expected, tolerance
        The numbers; None where nothing could be measured.
    passed
        Whether abs(measured - expected) <= tolerance; False where nothing could be measured.
    reason
        Reason of the tolerance, or why there is no number and what to do.
    remark
        A sentence on the limits of the check, if any; reports print it.
    """

    kind: Kind
    engine: str
    measured: float | None
    expected: float | None
    tolerance: float | None
    passed: bool
    reason: str
    remark: str = ""

    @property
    def name(self) -> str:
        """Engine and quantity, as tables show them."""
        return f"{self.engine}: {self.kind.name}"

    def to_dict(self) -> dict[str, Any]:
        """Return the check as a JSON object."""
        return {
            "name": self.name,
            "measured": self.measured,
            "expected": self.expected,
            "tolerance": self.tolerance,
            "passed": self.passed,
            "reason": self.reason,
        }


def unmeasured(kind: Kind, engine: str, reason: str) -> Check:
    """Return a check that could not be made, with the reason."""
    return Check(kind, engine, None, None, None, passed=False, reason=reason)


def within(
    kind: Kind, engine: str, measured: float, expected: float, tolerance: float, reason: str
) -> Check:
    """Return a check that passes if the difference is at most the tolerance."""
    passed = bool(abs(measured - expected) <= tolerance)
    # JSON has no NaN.
    known = measured if math.isfinite(measured) else None
    return Check(kind, engine, known, expected, tolerance, passed, reason)


def farthest(measured: FloatArray, expected: FloatArray | float) -> int:
    """Return the index of the largest difference, or of a missing number."""
    return int(np.argmax(np.abs(measured - expected)))
