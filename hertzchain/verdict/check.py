"""A check: one number against its expected value, with advice; and the values of the formulas."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result, context_of
from hertzchain.shown import ShownVerdict
from hertzchain.theory import solitary_wave as exact
from hertzchain.theory.prediction import not_about, transition_peaks


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


@dataclass(frozen=True, eq=False, repr=False)
class CheckedVerdict(ShownVerdict):
    """A verdict that rests on checks; true if it is ``pass``.

    Parameters
    ----------
    reference
        Result of the native reference method.
    tolerance
        Largest relative difference that passes.
    checks
        Each number that could be judged.
    """

    reference: Result
    tolerance: float
    checks: tuple[Check, ...]

    @property
    def verdict(self) -> str:
        """``pass`` if something was judged and all of it passed, otherwise ``fail``."""
        passed = bool(self.checks) and all(check.passed for check in self.checks)
        return "pass" if passed else "fail"

    def to_dict(self) -> dict[str, Any]:
        """Return the verdict as a JSON object."""
        return {
            "verdict": self.verdict,
            "tolerance": self.tolerance,
            "checks": [check.to_dict() for check in self.checks],
            "reference": self.reference.numbers(),
            **context_of(self.reference.scene),
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
    finite = measured if math.isfinite(measured) else None
    return Check(kind, engine, finite, expected, tolerance, passed, reason)


def farthest(measured: FloatArray, expected: FloatArray | float) -> int:
    """Return the index of the largest difference, or of a missing number."""
    return int(np.argmax(np.abs(measured - expected)))


@dataclass(frozen=True)
class Formulas:
    """Values of the paper's formulas, given p and F_SW from a simulation.

    Parameters
    ----------
    applicable
        Reason why they do not apply; None where they do.
    note
        Why the scene lies outside the range of the paper; None inside it.
    transition_granules
        p of Eq. 3, not rounded.
    eq6, eq9
        Peak force of contacts 2 ... N [N], NaN where the formula gives none, shape (N - 1,).
    speed, exact_speed
        V_SW of the paper and of the exact solitary wave, both at F_SW [m/s].
    """

    applicable: str | None
    note: str | None
    transition_granules: float | None
    eq6: FloatArray
    eq9: FloatArray
    speed: float | None
    exact_speed: float | None

    def to_dict(self) -> dict[str, Any]:
        """Return the formulas as a JSON object; their peak forces are in the rows."""
        return {
            "not_applicable": self.applicable,
            "outside_range": self.note,
            "transition_granules": self.transition_granules,
            "speed_m_s": self.speed,
            "exact_speed_m_s": self.exact_speed,
        }


def formulas(reference: Result) -> Formulas:
    """Evaluate the formulas with p and F_SW of a simulation, and the exact solitary wave."""
    scene, p, wave = reference.scene, reference.transition_granules, reference.solitary_wave
    nothing = np.full(reference.contact.size, np.nan)
    reason = not_about(scene, "Eqs. 3 to 9")
    if reason is None and (p is None or wave.peak_force is None):
        reason = "the transition does not end within this chain and run: no p, no F_SW"
    if reason is not None:
        return Formulas(reason, None, None, nothing, nothing, None, None)
    pulse = scene.pulse
    assert pulse is not None
    assert p is not None
    assert wave.peak_force is not None
    chain, rise_time = scene.chain, scene.rise_time
    assert rise_time is not None
    eq6, eq9 = nothing.copy(), nothing.copy()
    eq6[: p - 1], eq9[:p] = transition_peaks(scene, p, wave.peak_force)
    return Formulas(
        applicable=None,
        note=theory.outside_range(scene.momentum_ratio, pulse.duration_ratio),
        transition_granules=theory.transition_granules(chain, pulse, rise_time, wave.peak_force),
        eq6=eq6,
        eq9=eq9,
        speed=theory.solitary_wave_speed(chain, wave.peak_force),
        exact_speed=exact.speed(chain, wave.peak_force),
    )
