"""A check: one number against what it should be, and what to do where it is not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import Array


@dataclass(frozen=True)
class Kind:
    """What a check compares.

    Parameters
    ----------
    name
        With its unit, if it has one.
    advice
        What to do where such a check fails.
    """

    name: str
    advice: str = "do not use this result"


NOT_RUN, FAILED = Kind("not run"), Kind("failed")  # of an engine; the reason says why


@dataclass(frozen=True)
class Check:
    """One comparison of a number with what it should be.

    Parameters
    ----------
    kind
        What is compared.
    engine
        Whose number it is, by the name of the engine.
    measured, expected, tolerance
        The numbers; None where nothing could be measured.
    passed
        Whether abs(measured - expected) <= tolerance; False where nothing could be measured.
    reason
        Why this tolerance, or why there is no number and what to do.
    remark
        A sentence on what the check cannot show, if there is one; reports print it.
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
        """Engine and what is compared, as tables show them."""
        return f"{self.engine}: {self.kind.name}"

    def to_dict(self) -> dict[str, Any]:
        """The check as JSON knows it."""
        return {
            "name": self.name,
            "measured": self.measured,
            "expected": self.expected,
            "tolerance": self.tolerance,
            "passed": self.passed,
            "reason": self.reason,
        }


def unmeasured(kind: Kind, engine: str, reason: str) -> Check:
    """A check that could not be made, with the reason."""
    return Check(kind, engine, None, None, None, passed=False, reason=reason)


def within(
    kind: Kind, engine: str, measured: float, expected: float, tolerance: float, reason: str
) -> Check:
    """A check that passes where the difference is at most the tolerance."""
    passed = bool(abs(measured - expected) <= tolerance)
    # JSON has no word for what is not a number.
    known = measured if math.isfinite(measured) else None
    return Check(kind, engine, known, expected, tolerance, passed, reason)


def farthest(measured: Array, expected: Array | float) -> int:
    """Where the difference is largest, or there is no number."""
    return int(np.argmax(np.abs(measured - expected)))
