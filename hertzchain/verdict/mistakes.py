"""The table of known mistakes in families: their peaks, how they are tried, their words.

Mistakes with the same peaks are named together: a stiffer chain, a lighter one and a longer pulse
are similar.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.pulse import PROFILES
from hertzchain.scene.scene import Scene
from hertzchain.verdict.case import Case, Mistake, fixed
from hertzchain.verdict.damping_mistakes import damping
from hertzchain.verdict.slips import (
    force_in_words,
    scale_in_words,
    slips_of_stretch,
    stretch_in_words,
)
from hertzchain.verdict.step_mistakes import long_steps, steps_and_samples

FEWEST = 6  # least number of contacts: fewer fit a curve with one parameter too easily
_FAR = 3.0  # logarithms of the shortest and longest pulse tried over the scene's


def with_rise_time(scene: Scene) -> Scene:
    """Return the same scene with the rise time in seconds, which stays in another chain."""
    if scene.pulse is None:
        return scene
    return _pulsed(scene, momentum_ratio=None, rise_time=scene.rise_time)


def _pulsed(scene: Scene, **other: Any) -> Scene:
    return replace(scene, shock=replace(scene.shock, **other))


def _made_of(scene: Scene, **other: Any) -> Scene:
    return replace(scene, chain=replace(scene.chain, **other))


def _stiffer(scene: Scene, factor: float) -> Scene:
    return _made_of(scene, young_modulus=factor * scene.chain.young_modulus)


def _pushed(scene: Scene, factor: float) -> Scene:
    return replace(scene, shock=scene.shock.stronger(factor))


def _stiffness(case: Case) -> Iterator[Mistake]:
    """Yield stiffness, mass or duration wrong by a factor: each gives another LM_ratio."""
    scene = with_rise_time(case.scene)
    yield Mistake(
        lambda x: stretch_in_words(scene, math.exp(x)),
        lambda x: case.of(_stiffer(scene, math.exp(3 * x))),
        np.linspace(-_FAR, _FAR, 31).tolist(),
    )
    # Beyond the range of fits: the contact force as the paper prints it, sqrt(2 R E).
    text = "contact stiffness of Eq. 1 as printed, with E under the root"
    yield fixed(text, case.of(_stiffer(scene, scene.chain.young_modulus**-0.5)))
    for name, stretch in slips_of_stretch(scene).items():
        if abs(math.log(stretch)) <= _FAR:
            continue
        text = f"{name}, which makes the pulse {stretch:.3g} times as long in natural units"
        # Computed with another mass: granules of such a soft chain would pass each other.
        heavy = _made_of(scene, density=scene.chain.density * stretch**-2)
        whole = case.of(heavy)
        yield fixed(text, whole)
        ended = case.of(replace(heavy, run=replace(scene.run, end_time=case.scene.end_time)))
        if case.residual(ended) < case.residual(whole) / 2:  # otherwise the wave has passed by then
            yield fixed(f"{text}, in a run that ends with that of the scene", ended)


def _force(case: Case) -> Iterator[Mistake]:
    """Yield the applied force wrong by a factor."""
    scene = with_rise_time(case.scene)
    yield Mistake(
        lambda x: force_in_words(math.exp(x)),
        lambda x: case.of(_pushed(scene, math.exp(x))),
        np.linspace(-5.0, 5.0, 41).tolist(),
    )


def _written(case: Case) -> Iterator[Mistake]:
    """Yield right peaks in another unit, or with other contact numbers."""
    expected, unknown = case.reference.peak_force, [np.nan]
    # The least squares of relative residuals.
    factor = float(np.mean(case.given[case.judged] / expected[case.judged]))
    if factor > 0:
        yield fixed(scale_in_words(case.scene, factor), factor * expected)
    else:
        yield fixed("no contact was pressed, or none was read", 0 * expected)
    yield fixed("contact i has the peak of contact i + 1", np.append(expected[1:], unknown))
    yield fixed("contact i has the peak of contact i - 1", np.append(unknown, expected[:-1]))
    yield fixed("contacts are numbered from the far end", expected[::-1])


def _granules(case: Case) -> Iterator[Mistake]:
    """Yield another number of granules."""
    contacts, granules = case.given.size, case.scene.chain.granules
    for other in (granules - 1, granules + 1):
        found = case.of(_made_of(with_rise_time(case.scene), granules=other))
        peak_force = np.append(found, np.nan)[:contacts]
        yield fixed(f"a chain of {other} granules, not {granules}", peak_force)


def _pulse(case: Case) -> Iterator[Mistake]:
    """Yield another profile and another duration ratio."""
    scene, pulse = with_rise_time(case.scene), case.scene.pulse
    if pulse is None:
        return
    n, rise_time = pulse.duration_ratio, scene.rise_time
    assert rise_time is not None

    def ratio(x: float) -> float:
        return 1 + math.exp(x) * (n - 1)

    def longer(x: float, whole: bool) -> FloatArray:
        rise = rise_time * n / ratio(x) if whole else rise_time
        return case.of(_pulsed(scene, duration_ratio=ratio(x), rise_time=rise))

    def words(x: float, kept: str) -> str:
        return f"duration ratio {ratio(x):.4g} in place of {n:g}, {kept}"

    trials = np.linspace(-2.0, 2.0, 9).tolist()
    for whole, kept in ((False, "at the same rise time"), (True, "in a pulse that lasts as long")):
        yield Mistake(partial(words, kept=kept), partial(longer, whole=whole), trials)
    for other in PROFILES:
        if other != pulse.profile:
            text = f"profile {other} in place of {pulse.profile}"
            yield fixed(text, case.of(_pulsed(scene, profile=other)))


@dataclass(frozen=True)
class Family:
    """Mistakes in one thing."""

    name: str  # the quantity that is wrong
    mistakes: Callable[[Case], Iterator[Mistake]]  # raises TooExpensive at the case's deadline
    terms: tuple[str, ...] | None = ()  # terms that a scene may have; None for any
    is_costly: bool = False  # takes seconds: left out where another mistake explains everything


FAMILIES = (
    Family("stiffness, mass or duration", _stiffness, ("damping",)),
    Family("applied force", _force, ("damping",)),
    Family("units and numbers of the contacts", _written, None),
    Family("number of granules", _granules, ("damping",)),
    Family("the pulse", _pulse),
    Family("steps too long", long_steps),
    Family("steps and samples", steps_and_samples, is_costly=True),
    Family("damping", damping, None, is_costly=True),
)
"""All families, in the order in which they are tried."""


def families_for(scene: Scene) -> list[Family]:
    """Return the families that can be tried in a scene."""
    terms = set(scene.terms)
    return [one for one in FAMILIES if one.terms is None or terms <= set(one.terms)]
