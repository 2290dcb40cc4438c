"""The table of known mistakes: families of them, how each is made, how it is tried, its words.

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
from hertzchain.scene.ramp import Ramp
from hertzchain.scene.scene import Scene
from hertzchain.verdict.case import Case, Found, Mistake, fixed
from hertzchain.verdict.damping_mistakes import damping
from hertzchain.verdict.other_laws import late_forces, other_contacts
from hertzchain.verdict.slips import (
    force_in_words,
    scale_in_words,
    slips_of_stretch,
    stretch_in_words,
)
from hertzchain.verdict.step_mistakes import known_step, long_steps, round_steps, samples

FEWEST = 6  # least number of contacts: fewer fit a curve with one parameter too easily
_FAR = 3.0  # logarithms of the shortest and longest pulse tried over the scene's
_HELD = (*range(2, 21), 25, 30, 40, 50)  # steps in a pulse; more leave 1e-4 of the peaks

HALF_SINE, RECTANGLE = "half sine", "rectangle"

_AREAS = {HALF_SINE: 2 / np.pi, RECTANGLE: 1.0}
"""Impulses of pulses that no scene has over F0 times duration; 0.5 for those of the paper."""


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
    """Yield right peaks in another unit, or with other numbers of their contacts."""
    expected, unknown = case.reference.peak_force, [np.nan]
    # The least squares of relative residuals.
    factor = float(np.mean(case.given[case.judged] / expected[case.judged]))
    if factor > 0:
        yield fixed(scale_in_words(case.scene, factor), factor * expected)
    else:
        yield fixed("no contact was pressed, or none was read", 0 * expected)
    for text, peak_force in (
        ("contact i has the peak of contact i + 1", np.append(expected[1:], unknown)),
        ("contact i has the peak of contact i - 1", np.append(unknown, expected[:-1])),
        ("contacts are numbered from the far end", expected[::-1]),
    ):
        yield replace(fixed(text, peak_force), search=_where_known(peak_force))


def _granules(case: Case) -> Iterator[Mistake]:
    """Yield another number of granules."""
    expected, granules = case.reference.peak_force, case.scene.chain.granules
    scene = with_rise_time(case.scene)
    for extra in (-1, 1):
        peak_force = np.full(expected.size, np.nan)
        found = case.of(_made_of(scene, granules=granules + extra))[: expected.size]
        peak_force[: found.size] = found
        text = f"a chain of {granules + extra} granules, not {granules}"
        yield replace(fixed(text, peak_force), search=_where_known(peak_force))


def _where_known(peak_force: FloatArray) -> Callable[[Case], Found]:
    """Return the search for peaks that are unknown at one end."""

    def search(case: Case) -> Found:
        known = case.judged & np.isfinite(peak_force)
        if np.count_nonzero(known) < FEWEST:
            return Found(0.0, math.inf)
        return Found(0.0, replace(case, judged=known).residual(peak_force))

    return search


def _pulse(case: Case) -> Iterator[Mistake]:
    """Yield another profile, another duration ratio, and a force held constant in steps."""
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
    for profile, area in _AREAS.items():
        text = f"profile {profile} in place of {pulse.profile}"
        yield fixed(text, case.of(scene, _ramps(scene, profile)))
        shorter = _pulsed(scene, rise_time=rise_time * 0.5 / area)
        yield fixed(f"{text}, of the same impulse", case.of(shorter, _ramps(shorter, profile)))
    for steps in _HELD:
        text = f"force held constant in {steps} steps of the pulse"
        yield fixed(text, case.of(scene, _held(scene, steps)))


def _ramps(scene: Scene, profile: str) -> list[Ramp]:
    """Return the applied force [s, N] of a profile that no scene has."""
    top, rise, end = scene.peak_force, scene.ramps[0].end, scene.ramps[-1].end
    if profile == RECTANGLE:
        return [Ramp(0.0, end, top, top, "linear")]
    return [Ramp(0.0, rise, 0.0, top, "quarter-sine"), Ramp(rise, end, top, 0.0, "quarter-cosine")]


def _held(scene: Scene, steps: int) -> list[Ramp]:
    """Return the applied force [s, N], held in equal intervals at its value at their starts."""
    times = np.linspace(0.0, scene.ramps[-1].end, steps + 1)
    forces = scene.applied_force(times[:-1]).tolist()
    return [
        Ramp(start, stop, force, force, "linear")
        for start, stop, force in zip(times[:-1].tolist(), times[1:].tolist(), forces, strict=True)
    ]


@dataclass(frozen=True)
class Family:
    """Mistakes in one thing."""

    name: str  # what they are mistakes in
    mistakes: Callable[[Case], Iterator[Mistake]]  # raises TooExpensive at the case's deadline
    terms: tuple[str, ...] | None = ()  # that a scene may have; None for any
    is_costly: bool = False  # takes seconds: left out where another mistake explains everything


FAMILIES = (
    Family("stiffness, mass or duration", _stiffness, ("damping",)),
    Family("applied force", _force, ("damping",)),
    Family("units and numbers of the contacts", _written, None),
    Family("number of granules", _granules, ("damping",)),
    Family("the pulse", _pulse),
    Family("the step given", known_step),
    Family("steps too long", long_steps),
    Family("steps in round numbers", round_steps, is_costly=True),
    Family("samples", samples, is_costly=True),
    Family("damping", damping, None, is_costly=True),
    Family("drag and late forces", late_forces, is_costly=True),
    Family("the contact law", other_contacts, is_costly=True),
)
"""All families, in the order in which they are tried."""


def families_for(scene: Scene) -> list[Family]:
    """Return the families that can be tried in a scene."""
    terms = set(scene.terms)
    return [one for one in FAMILIES if one.terms is None or terms <= set(one.terms)]
