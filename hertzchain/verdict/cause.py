"""The likely cause of wrong peaks, from the table of known mistakes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed, TooExpensive
from hertzchain.observables.transition import FREE_END
from hertzchain.verdict.case import Case, Found, Mistake, jumps_like_noise
from hertzchain.verdict.mistakes import FEWEST, families_for

EXPLAINED = 0.1  # largest part of the differences that a named mistake may leave, root mean square
_CERTAIN = 1e-4  # part of the differences: the search ends with a mistake that leaves no more
_FLOOR = 1e-7  # differences below this are comparable to the error of the trial runs, 1e-8
_KNOWN_TO = 1e-4  # accuracy of fits, as a part of the differences
_ALIKE = 3.0  # mistakes that leave at most this many times the least are named too
# Largest part of the differences that a hint may leave. In 60 random mixtures of three mistakes the
# nearest named one of them in 30 of 31 that left less, in 7 of 13 that left more (measured).
_HELPS = 0.07
_ALONE = 100.0  # ratio to the next largest difference (chosen): mistakes stay below it
_NOISY = 12  # least number of contacts that can look like noise (chosen)
_OUTLIER = 4.0  # largest difference of noise over its root mean square: once in 300 sets of 60
_BIAS = 3.0  # largest mean of noise, in its standard errors (chosen): samples are all too low
_MOST_NOISE = 0.1  # root mean square: peaks with more noise are not called the scene's (chosen)
_MOST_ROUNDED = 0.1  # largest difference by rounding; with more, peaks are not the scene's (chosen)
_DIGITS, _DECIMALS = range(2, 8), range(-2, 7)  # roundings that are tried (chosen)
_HALF = 0.5 + 1e-6  # of the last digit; the rest is the rounding of binary numbers


@dataclass(frozen=True)
class Explanation:
    """Sentences on the cause of wrong peaks; None where there is no such sentence."""

    cause: str | None = None  # the mistake that explains the differences
    hint: str | None = None  # else the nearest known one, or that the differences look like noise
    remark: str | None = None  # causes that were not tried


def likely_cause(case: Case, progress: Callable[[str], object] | None = None) -> Explanation:
    """Return the mistake that explains the differences best.

    ``progress`` is called with a line before each family of mistakes.
    """
    size = case.size
    if size < max(_FLOOR, 10 * case.reference.error_estimate):
        return Explanation()
    if np.count_nonzero(case.judged) < FEWEST:
        few = f"the cause is sought where at least {FEWEST} contacts are judged"
        return Explanation(remark=few)
    if (known := _rounded(case) or _one_contact(case)) is not None:
        return Explanation(known)
    found: list[tuple[Found, Mistake]] = []
    remark = None
    for family in families_for(case.scene):
        if family.is_costly and any(one.left <= _CERTAIN * size for one, _ in found):
            continue  # no other mistake can leave as little
        if progress is not None:
            progress(f"looking for the cause: {family.name}")
        try:
            found += [(one.tried(case), one) for one in family.mistakes(case)]
        except TooExpensive:
            remark = f"not everything was tried for the cause, it takes too long: {family.name}"
            break
        except RunFailed:
            pass  # the mistake is impossible in this scene
    found.sort(key=lambda one: one[0].left)
    least = found[0][0].left if found else math.inf
    if least > EXPLAINED * size or (least > _allowed(case) and not found[0][0].leaves_noise):
        return Explanation(hint=_hint(case, found, all_tried=remark is None), remark=remark)
    alike = _ALIKE * max(least, _KNOWN_TO * size)
    sentences = [mistake.words(one.value) for one, mistake in found if one.left <= alike]
    return Explanation(_joined(sentences, least / size), remark=remark)


def _allowed(case: Case) -> float:
    """Largest residual of a cause, root mean square; with more, it explains only a part."""
    return max(case.tolerance, _KNOWN_TO * case.size)


def _joined(sentences: Iterable[str], left: float) -> str:
    """Return causes with the same peaks as one sentence, with the part of the differences left."""
    named = "; or ".join(dict.fromkeys(sentences))
    return f"{named}; leaves {max(left, 1e-6):.1g} of the differences"


def _hint(case: Case, found: list[tuple[Found, Mistake]], all_tried: bool) -> str:
    """Return a sentence on the mistake nearest to the peaks, or on their noise."""
    several = "no single known mistake explains these peaks"
    if not all_tried or case.scene.terms:
        several = "no mistake that was tried explains these peaks"
    if _is_noise(case):
        rms, most = _rms(case.differences), float(np.max(np.abs(case.differences)))
        return (
            f"{several}: the differences look like noise of {100 * rms:.2g} % about the scene's"
            f" own peaks, with which they agree to {100 * most:.2g} %"
        )
    if not found or found[0][0].left > _HELPS * case.size:
        return f"{several}, and none leaves less than {100 * _HELPS:g} % of the differences"
    nearest, mistake = found[0]
    left = f"it leaves {100 * nearest.left / case.size:.2g} % of the differences"
    return f"{several}. The nearest is: {mistake.words(nearest.value)}; {left}"


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _is_noise(case: Case) -> bool:
    """Return whether the differences look like noise about 0, without a contact that stands out."""
    off = case.differences
    rms = _rms(off)
    even = np.max(np.abs(off)) <= _OUTLIER * rms <= _OUTLIER * _MOST_NOISE
    about_0 = abs(np.mean(off)) <= _BIAS * rms / np.sqrt(off.size)
    return bool(off.size >= _NOISY and even and about_0 and jumps_like_noise(off))


def _rounded(case: Case) -> str | None:
    """Return a sentence if the peaks are the scene's, rounded to a few digits or decimals."""
    given, expected = case.given[case.judged], case.reference.peak_force[case.judged]
    most = float(np.max(np.abs(case.differences)))
    if most > _MOST_ROUNDED:
        return None
    slack = case.reference.error_estimate * expected
    size = np.floor(np.log10(np.maximum(given, np.finfo(float).tiny)))
    last_digits = {f"{count} digits": 10.0 ** (size - count + 1) for count in _DIGITS}
    for count in _DECIMALS:
        place = f"{count} decimals" if count >= 0 else f"{10**-count} N"
        last_digits[place] = np.full_like(given, 10.0**-count)
    for place, unit in last_digits.items():
        is_round = np.allclose(given, unit * np.round(given / unit), rtol=1e-12, atol=0)
        if is_round and np.all(np.abs(given - expected) <= _HALF * unit + slack):
            return (
                f"rounding: these are the scene's own peaks to {place}, which moves them by"
                f" {100 * most:.2g} % at most; write more digits"
            )
    return None


def _one_contact(case: Case) -> str | None:
    """Return a sentence if one contact alone is wrong; mistakes do that only at the free end."""
    off = np.abs(case.differences)
    *_, next_to, most = np.sort(off)
    if most < _ALONE * next_to:
        return None
    contact = case.reference.contact[case.judged][int(np.argmax(off))]
    if contact > case.scene.chain.granules - FREE_END:
        return None
    others = f"within {next_to:.1g} of the reference" if next_to else "right"
    return f"contact {contact} alone, as if a number had slipped: the others are {others}"
