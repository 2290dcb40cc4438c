"""Likely causes: which common mistake would have given these peaks.

Each mistake is simulated, and its one parameter fitted to the peaks in question. What peaks cannot
tell apart is named together: a stiffer chain, a lighter one and a longer pulse are similar.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed, TooExpensive
from hertzchain.observables.transition import FREE_END
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.scene import Scene
from hertzchain.verdict.case import Case, Cause
from hertzchain.verdict.damping_causes import damping
from hertzchain.verdict.other_laws import HERTZ, Law, peaks
from hertzchain.verdict.sampling import samples
from hertzchain.verdict.step_causes import known_step, long_steps

EXPLAINED = 0.1  # of the differences, root mean square: most that a named mistake may leave
FEWEST = 6  # contacts: fewer are on a curve with one parameter too easily
_CERTAIN = 1e-4  # of the differences: a mistake that leaves no more is not looked past
_FLOOR = 1e-7  # differences below are beside what the trial runs are known to, 1e-8
_ALIKE = 3.0  # times what the best mistake leaves: others that leave no more are named beside it
_NEAR = 0.003  # relative; how near a fitted factor has to be to a known one for that to be named
_ALONE = 100.0  # times as far off as any other contact; chosen: what mistakes make stays below

Finder = Callable[[Case], Iterator[Cause]]


def likely_cause(
    case: Case, progress: Callable[[str], object] | None = None
) -> tuple[str | None, str | None]:
    """The mistakes that explain the differences best, as a sentence, and what was not tried.

    Either is None where there is none. ``progress`` is called with a line before each part.
    """
    size = case.size
    if size < max(_FLOOR, 10 * case.reference.error_estimate):
        return None, None
    if np.count_nonzero(case.judged) < FEWEST:
        return None, f"the cause is sought where at least {FEWEST} contacts are judged"
    if (alone := _one_contact(case)) is not None:
        return alone, None
    found: list[Cause] = []
    remark = None
    for name, find in finders_for(case.scene).items():
        if name in DEAR and any(one.residual <= _CERTAIN * size for one in found):
            continue  # nothing else could leave as little
        if progress is not None:
            progress(f"looking for the cause: {name}")
        try:
            found += find(case)
        except TooExpensive:
            remark = f"not everything was tried for the cause, it takes too long: {name}"
            break
        except RunFailed:  # this mistake cannot be made in this scene
            continue
    found = [one for one in found if one.residual <= EXPLAINED * size]
    found.sort(key=lambda cause: cause.residual)
    if not found:
        return None, remark
    alike = _ALIKE * max(found[0].residual, 1e-3 * size)
    sentences = [one.sentence for one in found if one.residual <= alike]
    left = f"; leaves {max(found[0].residual / size, 1e-6):.1g} of the differences"
    return "; or ".join(dict.fromkeys(sentences)) + left, remark


def _one_contact(case: Case) -> str | None:
    """The contact that alone is off; mistakes do that at the free end only."""
    off = np.abs(case.differences)
    *_, next_to, most = np.sort(off)
    if most < _ALONE * next_to:
        return None
    contact = case.reference.contact[case.judged][int(np.argmax(off))]
    if contact > case.scene.chain.granules - FREE_END:
        return None
    others = f"within {next_to:.1g} of the truth" if next_to else "right"
    return f"contact {contact} alone, as if a number had slipped: the others are {others}"


def other_stiffness(case: Case) -> Iterator[Cause]:
    """Stiffness, mass or duration off by a factor: all of them are another LM_ratio."""
    scene = with_rise_time(case.scene)
    log, left = case.fit(
        lambda x: case.of(_stiffer(scene, math.exp(3 * x))), list(np.linspace(-3.0, 3.0, 31))
    )
    yield Cause(_in_words(scene, math.exp(log)), left)
    # Further away than any fit goes: the contact force as the paper prints it, sqrt(2 R E).
    printed = scene.chain.young_modulus**-0.5
    left = case.residual(case.of(_stiffer(scene, printed)))
    yield Cause("contact stiffness of Eq. 1 as printed, with E under the root", left)


def _stiffer(scene: Scene, factor: float) -> Scene:
    return replace(
        scene, chain=replace(scene.chain, young_modulus=factor * scene.chain.young_modulus)
    )


def with_rise_time(scene: Scene) -> Scene:
    """The same scene, its pulse measured in seconds, which stay if the chain becomes another."""
    pulse = scene.shock
    if not isinstance(pulse, Pulse):
        return scene
    return replace(scene, shock=replace(pulse, momentum_ratio=None, rise_time=scene.rise_time))


def _in_words(scene: Scene, stretch: float) -> str:
    """What makes the pulse so many times as long in natural units."""
    nu = scene.chain.poisson_ratio
    known = {
        "effective modulus E/(1 - nu^2) in place of half of it": 2 ** (1 / 3),
        "effective modulus E in place of E/(2 (1 - nu^2))": (2 * (1 - nu**2)) ** (1 / 3),
        "effective modulus halved twice": 0.5 ** (1 / 3),
        "E in place of E/(1 - nu^2)": (1 - nu**2) ** (1 / 3),
        "1 - nu in place of 1 - nu^2": (1 + nu) ** (1 / 3),
        "R in place of the effective radius R/2": 2 ** (1 / 6),
        "diameter taken for radius": 2 ** (-4 / 3),
        "radius taken for diameter": 2 ** (4 / 3),
        "diameter taken for radius in the mass": 8**-0.5,
        "radius taken for diameter in the mass": 8**0.5,
        "half the mass": 2**0.5,
        "twice the mass": 0.5**0.5,
    }
    if isinstance(scene.shock, Pulse):
        n = scene.shock.duration_ratio
        known |= {"duration taken for rise time": n, "rise time taken for duration": 1 / n}
    # 1 - nu^2 is 1 where nu is 0; then there is nothing to mistake.
    names = [
        name for name, q in known.items() if abs(stretch / q - 1) < min(_NEAR, 0.1 * abs(q - 1))
    ]
    text = (
        f"contact stiffness {stretch**3:.6g} times that of the scene, or mass {stretch**-2:.6g}"
        f" times, or pulse {stretch:.6g} times as long (peaks cannot tell these apart)"
    )
    return f"{text}: {' or '.join(names)}" if names else text


def other_force(case: Case) -> Iterator[Cause]:
    """The applied force, or the unit of the peaks, off by a factor."""
    scene = with_rise_time(case.scene)
    log, left = case.fit(
        lambda x: case.of(_pushed(scene, math.exp(x))), list(np.linspace(-5.0, 5.0, 41))
    )
    yield Cause(f"applied force {math.exp(log):.6g} times that of the scene", left)
    expected, given = case.reference.peak_force, case.given[case.judged]
    ratio = expected[case.judged] / expected.max()
    weight = 1 / ratio**2  # as residuals are relative
    factor = float(np.sum(weight * given * ratio) / np.sum(weight * ratio**2)) / expected.max()
    units = {
        "kN": 1e-3, "MN": 1e-6, "mN": 1e3, "uN": 1e6, "dyn": 1e5, "kgf": 1 / 9.80665,
        "lbf": 1 / 4.4482216, "F0": 1 / case.scene.units.force,
    }  # fmt: skip
    names = [f"in units of {unit}" for unit, q in units.items() if abs(factor / q - 1) < _NEAR]
    if not factor > 0:
        yield Cause("no contact was pressed, or none was read", case.residual(0 * expected))
        return
    text = f"every peak {factor:.6g} times the true one: "
    why = " or ".join(names) or "another unit, or another applied force at the same LM_ratio"
    yield Cause(text + why, case.residual(factor * expected))


def _pushed(scene: Scene, factor: float) -> Scene:
    shock = scene.shock
    if isinstance(shock, Pulse):
        return replace(scene, shock=replace(shock, peak_force=factor * shock.peak_force))
    assert isinstance(shock, PulseTable)
    force = tuple(factor * value for value in shock.force)
    return replace(scene, shock=PulseTable(shock.time, force, shock.file))


def other_numbers(case: Case) -> Iterator[Cause]:
    """Contacts numbered otherwise, or another number of granules."""
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
    """What peaks leave of the differences where they are known: everywhere but at one end."""
    known = case.judged & np.isfinite(peak_force)
    if np.count_nonzero(known) < FEWEST:
        return math.inf
    return replace(case, judged=known).residual(peak_force)


def other_contacts(case: Case) -> Iterator[Cause]:
    """Another exponent, or contacts that pull; the stiffness may be any."""
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
    yield Cause("contacts that pull", case.residual(_against(case, pulling, beside)))


def _against(case: Case, found: FloatArray, beside: FloatArray) -> FloatArray:
    """Peaks [N], without what RK4 makes of Eq. 1: shape (..., contacts)."""
    pressed = beside > 0
    ratio = found / np.where(pressed, beside, 1.0)
    return np.asarray(np.where(pressed, ratio, 0.0) * case.reference.peak_force)


_ROOTS = np.linspace(0.0, 1.25, 14)
_FORWARD = _ROOTS**2
_BACKWARD = -(np.linspace(0.6, 0.0, 10)[:-1] ** 2)  # of damping, natural units: dense near 0

_OF_DRAG = 0.2  # share of these coefficients for a drag, which acts on a granule for long


def late_forces(case: Case) -> Iterator[Cause]:
    """Forces that are late or early, which acts like damping; and a drag."""
    units = case.scene.units
    drag = Law(damped_by="drag")
    x, left = _fit_damping(case, drag, _OF_DRAG * _FORWARD, whole=True)
    coefficient = x * units.force * units.time / units.length
    text = f"damping on, a drag on each granule, coefficient {coefficient:.3g} N s/m"
    yield Cause(text, left)
    # F(t - dt) = F - 3/2 dt overlap^(1/2) overlap': damping that gives energy.
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
    """The coefficient that leaves the least, and what; ``whole``: of the force, damping and all."""

    def peaks_at(damping: FloatArray) -> FloatArray:
        tried = np.append(damping, 0.0)
        elastic, all_of_it = peaks(case.scene, law, tried, np.ones_like(tried), case.deadline)
        found = all_of_it if whole else elastic
        return _against(case, found[:-1], found[-1])

    return _fit_many(case, trials, peaks_at)


def _fit_many(
    case: Case, trials: FloatArray, peaks_at: Callable[[FloatArray], FloatArray]
) -> tuple[float, float]:
    """``Case.fit`` where many parameters cost little more than one; and once more, close to it."""
    from scipy.interpolate import Akima1DInterpolator

    best, least = 0.0, math.inf
    for _ in range(2):
        found = peaks_at(trials)
        there = np.all(np.isfinite(found) & (found > 0), axis=1)
        if np.count_nonzero(there) < 4:
            break
        # Local: where waves die out, or arrive after the end, must not matter elsewhere.
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
    "the step given": known_step,
    "steps too long": long_steps,
    "samples": samples,
    "damping": damping,
    "drag and late forces": late_forces,
    "the contact law": other_contacts,
}
"""In the order in which they are tried."""

DEAR = ("samples", "damping", "drag and late forces", "the contact law")  # those that take seconds

_OF_DAMPED = ("stiffness, mass or duration", "applied force, units", "numbers of the contacts")
_OF_ALL = ("damping",)  # what is tried whatever the terms of the scene


def finders_for(scene: Scene) -> dict[str, Finder]:
    """Causes that can be tried in a scene: all in a plain one, with terms those of damping."""
    if scene.is_plain:
        return FINDERS
    names = (*_OF_DAMPED, *_OF_ALL) if scene.terms == ("damping",) else _OF_ALL
    return {name: FINDERS[name] for name in names}
