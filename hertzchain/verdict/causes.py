"""Likely causes: which common mistake would have given these peaks.

Each mistake is simulated, and its one parameter is fitted to the peaks in question. Mistakes with
the same peaks are named together: a stiffer chain, a lighter one and a longer pulse are similar.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed, TooExpensive
from hertzchain.observables.transition import FREE_END
from hertzchain.scene.scene import Scene
from hertzchain.verdict.case import Case, Cause
from hertzchain.verdict.damping_causes import damping
from hertzchain.verdict.mistaken import pushed, stiffer, with_rise_time
from hertzchain.verdict.other_laws import HERTZ, Law, peaks
from hertzchain.verdict.pairs import Pair, can_be_paired, pairs
from hertzchain.verdict.pulse_causes import other_pulse
from hertzchain.verdict.sampling import samples
from hertzchain.verdict.slips import (
    force_in_words,
    scale_in_words,
    slips_of_stretch,
    stretch_in_words,
)
from hertzchain.verdict.step_causes import known_step, long_steps, round_steps

EXPLAINED = 0.1  # largest part of the differences that a named mistake may leave, root mean square
FEWEST = 6  # least number of contacts: fewer fit a curve with one parameter too easily
_CERTAIN = 1e-4  # part of the differences: the search ends with a mistake that leaves no more
_FLOOR = 1e-7  # differences below this are comparable to the error of the trial runs, 1e-8
_KNOWN_TO = 1e-4  # accuracy of fits, as a part of the differences
_ALIKE = 3.0  # mistakes that leave at most this many times the least are named too
_FAR = 3.0  # logarithms of the shortest and longest pulse tried over the scene's
_SINGLE = 1e-4  # part of the differences: if one mistake leaves no more, pairs are not searched
_TELLS = 2.0  # factor by which a pair must leave less then; of noise pairs leave more than half
PAIR_EXPLAINED = 3e-3  # largest part of the differences that a pair may leave
_BETTER_THAN_ONE = 10.0  # factor by which a pair has to leave less than one mistake
_APART = 10.0  # factor by which pairs that are not named have to leave more than the best
_SEEN = 1e-5  # accuracy assumed for trial runs and given peaks, as a part of the differences
_WORTH_TWO = 1e-4  # differences below are not searched for pairs: 1e3 times _FLOOR
_MOST_NAMES = 4  # most pairs that are named together
# Largest part of the differences that a hint may leave. In 60 random mixtures of three mistakes the
# nearest named one of them in 30 of 31 that left less, in 7 of 13 that left more (measured).
_HELPS = 0.07
_ALONE = 100.0  # ratio to the next largest difference (chosen): mistakes stay below it

Finder = Callable[[Case], Iterator[Cause]]


@dataclass(frozen=True)
class Explanation:
    """Sentences on the cause of wrong peaks; None where there is no such sentence.

    Parameters
    ----------
    cause
        The mistakes that explain the differences.
    hint
        The nearest known mistake, where none explains them.
    remark
        Causes that were not tried.
    """

    cause: str | None = None
    hint: str | None = None
    remark: str | None = None


def likely_cause(case: Case, progress: Callable[[str], object] | None = None) -> Explanation:
    """Return the mistake that explains the differences best, or a pair where no single one does.

    ``progress`` is called with a line before each part.
    """
    size = case.size
    if size < max(_FLOOR, 10 * case.reference.error_estimate):
        return Explanation()
    if np.count_nonzero(case.judged) < FEWEST:
        few = f"the cause is sought where at least {FEWEST} contacts are judged"
        return Explanation(remark=few)
    if (alone := _one_contact(case)) is not None:
        return Explanation(alone)
    found: list[Cause] = []
    two: list[Pair] = []
    remark = None

    def say(name: str) -> None:
        if progress is not None:
            progress(f"looking for the cause: {name}")

    for name, find in finders_for(case.scene).items():
        if name in DEAR and any(one.residual <= _CERTAIN * size for one in found):
            continue  # no other mistake could leave as little
        say(name)
        try:
            found += find(case)
        except TooExpensive:
            remark = _late(name)
            break
        except RunFailed:  # this mistake is impossible in this scene
            continue
    one_is_enough = any(one.residual <= _SINGLE * size for one in found)
    if remark is None and not one_is_enough and size > _WORTH_TWO and can_be_paired(case):
        say("two mistakes")
        try:
            two = pairs(case)
        except TooExpensive:
            remark = _late("two mistakes")
    found.sort(key=lambda cause: cause.residual)
    least = found[0].residual if found else math.inf
    if two and (several := _of_pairs(case, two, least)) is not None:
        return Explanation(several, remark=remark)
    partial = bool(two) and two[0].left < least / _TELLS
    partial |= bool(found) and not found[0].leaves_noise
    if least > EXPLAINED * size or (partial and least > _allowed(case)):
        return Explanation(hint=_hint(case, found, two, all_tried=remark is None), remark=remark)
    alike = _ALIKE * max(least, _KNOWN_TO * size)
    sentences = [one.sentence for one in found if one.residual <= alike]
    return Explanation(_joined(sentences, least / size), remark=remark)


def _late(name: str) -> str:
    return f"not everything was tried for the cause, it takes too long: {name}"


def _allowed(case: Case) -> float:
    """Most that a cause may leave, root mean square: what leaves more is a part of the mistake."""
    return max(case.tolerance, _KNOWN_TO * case.size)


def _joined(sentences: Iterable[str], left: float) -> str:
    """Return causes with the same peaks as one sentence, with the part of the differences left."""
    named = "; or ".join(dict.fromkeys(sentences))
    return f"{named}; leaves {max(left, 1e-6):.1g} of the differences"


def _of_pairs(case: Case, two: list[Pair], single: float) -> str | None:
    """Pairs that explain the differences if all others leave much more; None for none."""
    best, size = two[0].left, case.size
    if best > min(PAIR_EXPLAINED * size, _allowed(case)):
        return None
    if best > single / _BETTER_THAN_ONE:
        return None
    alike = [pair for pair in two if pair.left <= max(_ALIKE * best, _FLOOR)]
    others = [pair.left for pair in two[len(alike) :]]
    if len(alike) > _MOST_NAMES or min(others, default=math.inf) < _APART * max(
        best, _FLOOR, _SEEN * size
    ):
        return None
    return _joined((pair.words(case.scene) for pair in alike), best / size)


def _hint(case: Case, found: list[Cause], two: list[Pair], all_tried: bool) -> str:
    """Return a sentence on the mistake nearest to the peaks, and on what it leaves."""
    size = case.size
    several = "no single known mistake explains these peaks"
    if not all_tried or not case.scene.is_plain:
        several = "no mistake that was tried explains these peaks"
    if two and two[0].left <= min(PAIR_EXPLAINED * size, _allowed(case)):
        return (
            f"{several}. Several pairs of mistakes do, and peaks cannot tell them apart; one is:"
            f" {two[0].words(case.scene)}"
        )
    if not found or found[0].residual > _HELPS * size:
        return f"{several}, and none leaves less than {100 * _HELPS:g} % of the differences"
    left = f"it leaves {100 * found[0].residual / size:.2g} % of the differences"
    return f"{several}. The nearest is: {found[0].sentence}; {left}"


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


def other_stiffness(case: Case) -> Iterator[Cause]:
    """Yield stiffness, mass or duration wrong by a factor: each gives another LM_ratio."""
    scene = with_rise_time(case.scene)

    def stretched(x: float) -> FloatArray:
        return case.of(stiffer(scene, math.exp(3 * x)))

    log, _ = case.fit(stretched, list(np.linspace(-_FAR, _FAR, 31)))
    yield case.cause(stretch_in_words(scene, math.exp(log)), stretched(log))
    # Beyond the range of fits: the contact force as the paper prints it, sqrt(2 R E).
    printed = scene.chain.young_modulus**-0.5
    text = "contact stiffness of Eq. 1 as printed, with E under the root"
    yield case.cause(text, case.of(stiffer(scene, printed)))
    for name, stretch in slips_of_stretch(scene).items():
        if abs(math.log(stretch)) > _FAR:
            yield from _far_off(case, name, stretch)


def _far_off(case: Case, name: str, stretch: float) -> Iterator[Cause]:
    """Yield slips by orders of magnitude; the run may end long before the wave has passed."""
    scene = with_rise_time(case.scene)
    # Computed with another mass: granules of such a soft chain would pass each other.
    density = scene.chain.density * stretch**-2
    scene = replace(scene, chain=replace(scene.chain, density=density))
    text = f"{name}, which makes the pulse {stretch:.3g} times as long in natural units"
    whole = case.residual(case.of(scene))
    yield Cause(text, whole)
    ended = replace(scene, run=replace(scene.run, end_time=case.scene.end_time))
    cut_off = case.residual(case.of(ended))
    if cut_off < whole / 2:  # otherwise the wave has passed by then
        yield Cause(f"{text}, in a run that ends with that of the scene", cut_off)


def other_force(case: Case) -> Iterator[Cause]:
    """Yield the applied force, or the unit of the peaks, wrong by a factor."""
    scene = with_rise_time(case.scene)

    def harder(x: float) -> FloatArray:
        return case.of(pushed(scene, math.exp(x)))

    log, _ = case.fit(harder, list(np.linspace(-5.0, 5.0, 41)))
    yield case.cause(force_in_words(math.exp(log)), harder(log))
    expected, given = case.reference.peak_force, case.given[case.judged]
    ratio = expected[case.judged] / expected.max()
    weight = 1 / ratio**2  # residuals are relative
    factor = float(np.sum(weight * given * ratio) / np.sum(weight * ratio**2)) / expected.max()
    if not factor > 0:
        yield Cause("no contact was pressed, or none was read", case.residual(0 * expected))
        return
    yield case.cause(scale_in_words(scene, factor), factor * expected)


def other_numbers(case: Case) -> Iterator[Cause]:
    """Yield other numbers of the contacts, or another number of granules."""
    expected, unknown = case.reference.peak_force, [np.nan]
    for text, peak_force in (
        ("contact i has the peak of contact i + 1", np.append(expected[1:], unknown)),
        ("contact i has the peak of contact i - 1", np.append(unknown, expected[:-1])),
        ("contacts are numbered from the far end", expected[::-1]),
    ):
        yield Cause(text, _of_known(case, peak_force))
    chain = case.scene.chain
    for granules in (chain.granules - 1, chain.granules + 1):
        scene = with_rise_time(case.scene)
        peak_force = case.of(replace(scene, chain=replace(chain, granules=granules)))
        peak_force = np.append(peak_force, unknown)[: expected.size]
        text = f"a chain of {granules} granules, not {chain.granules}"
        yield Cause(text, _of_known(case, peak_force))


def _of_known(case: Case, peak_force: FloatArray) -> float:
    """Return the residual of peaks that are unknown at one end."""
    known = case.judged & np.isfinite(peak_force)
    if np.count_nonzero(known) < FEWEST:
        return math.inf
    return replace(case, judged=known).residual(peak_force)


def other_contacts(case: Case) -> Iterator[Cause]:
    """Yield another exponent, or contacts that pull; with any stiffness."""
    logs = np.linspace(-2.0, 2.0, 17)
    one = np.zeros(1)
    for text, law in (
        ("contact force linear in the overlap", Law(exponent=1.0)),
        ("springs that push and pull", Law(exponent=1.0, pulls=True)),
        ("contact force that goes as overlap^(5/4)", Law(exponent=1.25)),
        ("contact force that goes as overlap^2", Law(exponent=2.0)),
    ):

        def peaks_at(logs: FloatArray, law: Law = law) -> FloatArray:
            found, _ = peaks(case.scene, law, 0 * logs, np.exp(logs), case.deadline)
            return found * case.scene.units.force

        log, left = _fit_many(case, logs, peaks_at)
        yield Cause(
            f"{text}, with {math.exp(2 * law.exponent * log):.3g} times the stiffness at F0", left
        )
    beside, pulling = (
        peaks(case.scene, law, one, one + 1, case.deadline)[0][0]
        for law in (HERTZ, Law(pulls=True))
    )
    yield case.cause("contacts that pull", _against(case, pulling, beside))


def _against(case: Case, found: FloatArray, beside: FloatArray) -> FloatArray:
    """Return peaks [N] corrected by RK4's error for Eq. 1, shape (..., contacts)."""
    pressed = beside > 0
    ratio = found / np.where(pressed, beside, 1.0)
    return np.asarray(np.where(pressed, ratio, 0.0) * case.reference.peak_force)


_ROOTS = np.linspace(0.0, 1.25, 14)
_FORWARD = _ROOTS**2
# trial coefficients of damping, natural units: dense near 0
_BACKWARD = -(np.linspace(0.6, 0.0, 10)[:-1] ** 2)

_OF_DRAG = 0.2  # fraction of these coefficients for a drag, which acts on a granule for long


def late_forces(case: Case) -> Iterator[Cause]:
    """Yield late or early forces, which act like damping, and a drag."""
    units = case.scene.units
    drag = Law(damped_by="drag")
    x, left = _fit_damping(case, drag, _OF_DRAG * _FORWARD, whole=True)
    coefficient = x * units.force * units.time / units.length
    text = f"damping on, a drag on each granule, coefficient {coefficient:.3g} N s/m"
    yield Cause(text, left)
    # F(t - dt) = F - 3/2 dt overlap^(1/2) overlap': negative damping.
    law = Law(damped_by="contact", damping_exponent=0.5)
    x, left = _fit_damping(case, law, np.concatenate([_BACKWARD, _FORWARD]), whole=False)
    late = -x / 1.5 * units.time
    yield Cause(
        f"contact forces {late:.3g} s late, a step: explicit Euler, or forces from"
        " positions of the step before"
        if late > 0
        else f"contact forces {-late:.3g} s early: implicit Euler, or damping as of"
        " viscoelastic spheres that the peaks leave out",
        left,
    )


def _fit_damping(case: Case, law: Law, trials: FloatArray, whole: bool) -> tuple[float, float]:
    """Fit the coefficient; return it and the residual; ``whole``: of the force with damping."""

    def peaks_at(damping: FloatArray) -> FloatArray:
        tried = np.append(damping, 0.0)
        elastic, all_of_it = peaks(case.scene, law, tried, np.ones_like(tried), case.deadline)
        found = all_of_it if whole else elastic
        return _against(case, found[:-1], found[-1])

    return _fit_many(case, trials, peaks_at)


def _fit_many(
    case: Case, trials: FloatArray, peaks_at: Callable[[FloatArray], FloatArray]
) -> tuple[float, float]:
    """Fit as ``Case.fit`` with many parameters at once, then again close to the best."""
    from scipy.interpolate import Akima1DInterpolator

    best, least = 0.0, math.inf
    for _ in range(2):
        found = peaks_at(trials)
        there = np.all(np.isfinite(found) & (found > 0), axis=1)
        if np.count_nonzero(there) < 4:
            break
        # Contact by contact: waves that die out, or arrive after the end, must not affect the
        # others.
        curve = Akima1DInterpolator(trials[there], np.log(found[there]), method="makima")
        x, left = case.fit(lambda x, curve=curve: np.exp(curve(x)), trials[there].tolist())  # type: ignore[misc]
        if left < least:
            best, least = x, left
        if least > 3 * EXPLAINED * case.size:
            break
        k = min(max(int(np.searchsorted(trials, best)), 1), trials.size - 1)
        trials = best + 0.3 * (trials[k] - trials[k - 1]) * np.linspace(-1, 1, 7)
    return best, least


FINDERS: dict[str, Finder] = {
    "stiffness, mass or duration": other_stiffness,
    "applied force, units": other_force,
    "numbers of the contacts": other_numbers,
    "the pulse": other_pulse,
    "the step given": known_step,
    "steps too long": long_steps,
    "steps in round numbers": round_steps,
    "samples": samples,
    "damping": damping,
    "drag and late forces": late_forces,
    "the contact law": other_contacts,
}
"""Finders of causes, in the order in which they are tried."""

DEAR = (
    "steps in round numbers",
    "samples",
    "damping",
    "drag and late forces",
    "the contact law",
)  # finders that take seconds

_OF_DAMPED = ("stiffness, mass or duration", "applied force, units", "numbers of the contacts")
_OF_ALL = ("damping",)  # finders for scenes with any terms


def finders_for(scene: Scene) -> dict[str, Finder]:
    """Return the finders for a scene: all for a plain one, those of damping with terms."""
    if scene.is_plain:
        return FINDERS
    names = (*_OF_DAMPED, *_OF_ALL) if scene.terms == ("damping",) else _OF_ALL
    return {name: FINDERS[name] for name in names}
