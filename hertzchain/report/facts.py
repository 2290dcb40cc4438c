"""Numbers and sentences as every report shows them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.report.document import Failure, Peaks
from hertzchain.scene.scene import Scene
from hertzchain.theory.two_spheres import parting

if TYPE_CHECKING:
    from hertzchain.verdict.check import Check

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
MULTIPLES = {"N": 6, "Pa": 9, "m": 0, "s": 0, "m/s": 0, "N s": 0, "J": 3}
"""Units with multiples, and the largest power of ten in use for each."""

_LONG = (1e-2, 1e5)  # beyond these, numbers at an axis are long (chosen)


def describe(scene: Scene) -> str:
    """Return one line that describes a scene."""
    kind = scene.shock.in_words(scene.chain.granules, scene.momentum_ratio)
    others = [term for term in scene.terms if term not in ("striker", "piston")]
    return f"{kind}, with {', '.join(others)}" if others else kind


def facts_of_terms(result: Result) -> list[tuple[str, str]]:
    """Return facts of a scene with terms: force on the wall, velocities, damping, end."""
    facts = []
    for wall, k in (result.scene.near_wall, 0), (result.scene.wall, -1):
        if wall is None:
            continue
        name = result.scene.contact_name(result.scene.contacts[k])
        force, time = result.peak_force[k], result.peak_time[k]
        known = known_digits(force, result.peak_errors[k])
        at = " N" if np.isnan(time) else f" N at {time:.6g} s"
        facts.append((f"largest force on {name}", known if known == NO_DIGIT else known + at))
    first, last = (f"{v:.3g} m/s" for v in (result.velocity[0], result.velocity[-1]))
    if np.isfinite(result.velocity[0]):
        facts.append(("velocity at the end", f"granule 1 {first}, the last granule {last}"))
    if (spheres := parting(result.scene)) is not None:
        at = "" if spheres.speed is None else f" of {spheres.speed:.3g} m/s, {spheres.whose}"
        part = f"{spheres.restitution:.4f} of their speed{at}"
        facts.append(("two like spheres part with", part))
    facts.append(("end of the run", f"{result.scene.end_time:.6g} s"))
    return facts


def shown_contacts(result: Result) -> list[int]:
    """Return the contacts up to p + 1; without p the first few contacts."""
    p = result.transition_granules
    last = 11 if p is None else p + 1
    return [int(contact) for contact in result.contact if contact <= last]


def cost(result: Result) -> str:
    """Return words for wall time and steps of a run."""
    return (
        f"{duration(result.wall_time)}, {result.steps:,} steps of at most {result.dt:.3g} s"
        f" ({result.backend}, {result.method})"
    )


def duration(seconds: float) -> str:
    """Return a time with three digits, in ms below a second."""
    return f"{seconds:.3g} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def prefixed(largest: float, unit: str) -> tuple[str, float]:
    """Return a multiple of a unit in which a number is 1 to 1000, and its value in the unit.

    Units that have no multiples in use stand after a power of ten, where numbers are long.
    """
    if not 0 < largest < np.inf or (unit not in MULTIPLES and _LONG[0] <= largest < _LONG[1]):
        return unit, 1.0
    power = 3 * int(np.floor(np.log10(largest * (1 + 1e-9)) / 3))
    if unit in MULTIPLES:
        power = min(max(power, -12), MULTIPLES[unit])
        return _PREFIXES[power] + unit, float(f"1e{power}")
    return f"$10^{{{power}}}$ {unit}".rstrip(), float(f"1e{power}")


def in_prefixed(value: float, unit: str) -> str:
    """Return a number of four digits with a suitable multiple of its unit."""
    name, scale = prefixed(abs(value), unit)
    return f"{value / scale:.4g} {name}".rstrip()


def similar_scene(result: Result) -> str | None:
    """Return words for the similar scene that a code was given; None for the scene itself."""
    lost = result.lost_digits
    if lost is None or lost.young_modulus == result.scene.chain.first_modulus:
        return None
    return (
        f"a similar chain of E = {lost.young_modulus:.3g} Pa, scaled back: absolute coordinates"
        f" would have cost the peaks {lost.predicted:.0e}, and now cost at most {lost.bound:.0e}"
    )


def number(value: float | None, digits: int) -> str:
    """Return a number with the given significant digits; empty for a missing number."""
    return "" if value is None or np.isnan(value) else f"{value:#.{digits}g}"


NO_DIGIT = "no digit"
"""Text in place of a number without a right digit."""


def known_digits(value: float | None, error: float, most: int = 9) -> str:
    """Return a number with the digits that its relative error leaves, the last one uncertain."""
    if error >= 1:
        return NO_DIGIT
    if value is None or np.isnan(value) or value == 0:
        return number(value, most)
    digits = int(np.clip(1 - np.ceil(np.log10(max(error, 1e-16))), 1, most))
    place = digits - 1 - int(np.floor(np.log10(abs(value))))
    if abs(value) < 1e-4:  # as the format g does
        return f"{value:#.{digits}g}"
    return f"{round(value, place):.{max(place, 0)}f}"


def with_unit(value: float | None, unit: str, error: float = 1e-6) -> str:
    """Return a number with its unit, to its relative error, or words where it is missing."""
    if value is None:
        return "unknown: the chain or the run is too short"
    if np.isnan(value):
        return "unknown"
    return f"{known_digits(value, error)} {unit}"


def difference(check: Check) -> tuple[str, str, str]:
    """Return difference, tolerance and their ratio; empty for numbers that were not measured."""
    if check.measured is None or check.expected is None or check.tolerance is None:
        return "", "", ""
    off = abs(check.measured - check.expected)
    share = off / check.tolerance if check.tolerance else math.inf if off else 0.0
    words = f"{share:.2g}" if 0.01 <= share < 100 else f"{share:,.0f}"
    return f"{off:.1e}", f"{check.tolerance:.1e}", "< 0.01" if 0 < share < 0.01 else words


def failure_of(check: Check) -> Failure:
    """Return a failed check with its difference and advice, as a page shows it."""
    off, tolerance, _ = difference(check)
    if not off:
        return Failure(check.name, "", check.reason)
    found = f"off by {off}, allowed is {tolerance} ({check.reason})"
    return Failure(check.name, found, check.kind.advice)


_MOST_FAILED = 10  # most failed contacts outside the transition on a terminal


def given_peaks(
    native: Result,
    what: str,
    label: str,
    given: FloatArray,
    reference: FloatArray,
    words: Sequence[str],
) -> Peaks:
    """Return given peaks next to those of the reference, with a word on each contact."""

    def row(k: int) -> list[str]:
        is_known = np.isfinite(given[k]) and reference[k] > 0
        off = f"{given[k] / reference[k] - 1:+.1e}" if is_known else ""
        name = native.scene.contact_label(native.scene.contacts[k])
        return [name, number(given[k], 9), number(reference[k], 9), off, words[k]]

    failed = [k for k, word in enumerate(words) if word == "FAIL"]
    return Peaks(
        f"{what}, and by the reference method",
        [("contact", ""), (label, "[N]"), ("native", "[N]"), ("difference", ""), ("", "")],
        row,
        sorted({*range(len(shown_contacts(native))), *failed[:_MOST_FAILED]}),
    )
