"""Errors of each contact, and bounds of the error of a run from runs that differ."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, Quantity
from hertzchain.errors import StepUnstable, Unpredictable, require
from hertzchain.observables.first_pulse import FirstPulses
from hertzchain.observables.peaks import ESTIMATED, judged_contacts, largest_difference
from hertzchain.scene import hertz
from hertzchain.scene.chain import force_scale
from hertzchain.scene.keys import keys_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.terms import DAMPING, Contact

OF_TIMES = ("arrival", "width", "contact_time")
"""Names of times of first pulses, and of their errors."""

COLUMNS = (
    "first_peak_force_N", "first_peak_time_s", "arrival_time_s", "first_width_s",
    "first_peak_error", "arrival_error_s", "first_width_error_s",
)  # fmt: skip
"""Numbers of a first pulse: those of a gauge, too."""


@dataclass(frozen=True, eq=False)
class ContactErrors:
    """Errors, or differences of two runs, of each contact, shape (contacts,).

    Parameters
    ----------
    peak
        Relative, of peak forces; NaN where a peak is too low to be judged. Without first pulses it
        is one number for all contacts.
    first
        Relative, of the forces of first pulses; NaN where there is none, infinite where another run
        has another pulse. None where first pulses were not wanted.
    arrival, width, contact_time
        Of their arrivals, widths and contact times, in the unit of the times.
    dynamic
        Dynamic over total force of first pulses: a relative error of the total force is divided by
        this.
    """

    peak: FloatArray
    first: FloatArray | None = None
    arrival: FloatArray | None = None
    width: FloatArray | None = None
    contact_time: FloatArray | None = None
    dynamic: FloatArray | None = None

    def in_units(self, time: float) -> ContactErrors:
        """Return the same errors with those of times multiplied by a unit of time."""
        if self.first is None:
            return self
        return replace(self, **{name: getattr(self, name) * time for name in OF_TIMES})

    def of_contacts(self, contacts: int) -> ContactErrors:
        """Return the errors of contacts alone, without those of gauges in granules."""
        if self.first is None:
            return self
        names = ("first", *OF_TIMES, "dynamic")
        return replace(self, **{name: getattr(self, name)[:contacts] for name in names})

    def plus(self, other: ContactErrors) -> ContactErrors:
        """Return differences from a run that has errors itself, ``other``, with those."""
        names = ("peak",) if self.first is None else ("peak", "first", *OF_TIMES)
        pairs = {name: (getattr(self, name), getattr(other, name)) for name in names}
        return replace(self, **{name: a + (1 + a) * b for name, (a, b) in pairs.items()})

    def alike(self, values: FloatArray) -> FloatArray:
        """Values of each contact; the largest of them where the errors of peaks are one number."""
        return values if self.peak.ndim else np.asarray(np.max(values, initial=0.0))

    def known(self, first: FirstPulses | None) -> FirstPulses | None:
        """Return first pulses without those that have no right digit: NaN for them."""
        if first is None or self.first is None:
            return None
        # Error of a force that has one right digit
        return first.only(self.first < 0.1)

    @property
    def largest(self) -> float:
        """The largest error of a peak."""
        return float(np.fmax.reduce(self.peak, initial=0.0) if self.peak.ndim else self.peak)

    @property
    def wanted(self) -> float:
        """The largest error of the wanted forces: first pulses, or peaks where there are none."""
        if self.first is None or not np.isfinite(self.first).any():
            return self.largest
        return float(np.max(self.first[np.isfinite(self.first)]))

    @property
    def share(self) -> float:
        """The smallest ratio of a first pulse to its total force; 1 without first pulses."""
        if self.dynamic is None:
            return 1.0
        return float(np.min(self.dynamic[~np.isnan(self.dynamic)], initial=1.0))

    @property
    def least(self) -> float:
        """The error that decides whether a run is of any use.

        With first pulses it is the smallest error of all first pulses and peaks, as each contact
        has its own error. Without first pulses it is the largest error of all peaks.
        """
        if self.first is None:
            return self.largest
        errors = np.append(self.peak, self.first)
        return float(np.min(errors[~np.isnan(errors)], initial=np.inf))


@dataclass(frozen=True, eq=False)
class Peaks:
    """Observations of the contacts in one run, (contacts,) each.

    Parameters
    ----------
    force, time
        Peak force and its time.
    passed
        Whether the force has fallen since.
    first
        First pulses, if they were wanted.
    """

    force: Any
    time: Any
    passed: NDArray[np.bool_]
    first: FirstPulses | None = None

    @property
    def any_rising(self) -> bool:
        """True if a judged contact had its largest force at the end of the run."""
        rising = ~self.passed
        return bool(rising.any() and np.any(judged_contacts(self.force, ESTIMATED) & rising))

    @property
    def wanted(self) -> FloatArray:
        """Forces of first pulses (0 for a contact without one); peak forces if none has one."""
        if self.first is None or not np.isfinite(self.first.force).any():
            return np.asarray(self.force)
        return np.nan_to_num(self.first.force)

    def differences(self, other: Peaks) -> ContactErrors:
        """Differences from another run, each at least those of peaks and pulses that came before.

        Peaks after a contact's first pulse come of waves that met more than once: they differ
        erratically, and each takes the largest difference of all contacts. Where they differ much,
        such a wave may as well be higher than the first pulse of any contact that is not far above.
        """
        pulses, others = self.first, other.first
        if pulses is None or others is None:
            return ContactErrors(np.asarray(largest_difference(other.force, self.force, ESTIMATED)))
        judged = judged_contacts(self.force, ESTIMATED)
        if not judged.any():  # no force in the whole run: then any is all wrong
            never = np.full(pulses.force.size, np.nan)
            wrong = np.where(other.force > 0, 1.0, 0.0)
            return ContactErrors(wrong, never, never, never, never, never)
        peak = _relative(other.force, self.force, judged)
        ended = np.where(pulses.is_ended, pulses.arrival + pulses.width, np.inf)[: peak.size]
        later = judged & (self.time > ended)
        # Relative difference of later peaks from which on a later wave may be a contact's peak; and
        # its most force over that of later peaks (chosen). In two of 1,410 random scenes a contact
        # had another peak, up to 5 % higher, than in both runs, which differed by 0.04 and 0.4.
        if np.any(peak[later] > 1e-3):
            later |= judged & (self.force < 1.5 * np.max(self.force[later]))
        peak = np.where(later, np.max(peak[judged]), peak)
        has = ~np.isnan(pulses.force)
        first = _relative(others.force, pulses.force, has)
        same = (pulses.is_ended == others.is_ended) & (pulses.is_front == others.is_front)
        first[has & ~(same & np.isfinite(others.force))] = np.inf
        arrival, width, contact_time = (
            np.where(np.isinf(first), np.inf, np.where(has, np.abs(difference), np.nan))
            for difference in (getattr(others, name) - getattr(pulses, name) for name in OF_TIMES)
        )
        # Both ends of a pulse may move alike.
        width, contact_time = np.maximum(width, arrival), np.maximum(contact_time, arrival)
        width[has & ~pulses.is_steady] = np.inf
        dynamic = pulses.force / (pulses.force + pulses.static)
        events = np.append(peak, first * dynamic), np.append(self.time, pulses.time)
        peak = causal(*events)[: peak.size]
        first, arrival, width, contact_time = (
            causal(each, pulses.time) for each in (first, arrival, width, contact_time)
        )
        return ContactErrors(peak, first, arrival, width, contact_time, dynamic)


def columns(first: FirstPulses | None, errors: ContactErrors | None) -> dict[str, NDArray[Any]]:
    """Return columns of first pulses and of errors, (contacts,) each; empty without first pulses.

    They are first_peak_force_N (dynamic: without the static force), first_peak_time_s,
    arrival_time_s, first_width_s, contact_time_s, kind (pulse, front, unended, or None), clear,
    peak_error, first_peak_error, arrival_error_s, first_width_error_s and contact_time_error_s. NaN
    stands where a contact has no first pulse, where its end did not come or has no right digit, or
    where a peak is too low to be judged. See ``first_pulse``.
    """
    if first is None or errors is None or errors.first is None:
        return {}
    has = np.isfinite(first.force)
    of_force, of_arrival, of_width, of_contact = (
        np.where(has, getattr(errors, name), np.nan) for name in ("first", *OF_TIMES)
    )
    for ends in (of_width, of_contact):
        ends[np.isinf(ends)] = np.nan
    return {
        "first_peak_force_N": first.force,
        "first_peak_time_s": first.time,
        "arrival_time_s": first.arrival,
        "first_width_s": np.where(np.isnan(of_width), np.nan, first.width),
        "contact_time_s": np.where(np.isnan(of_contact), np.nan, first.contact_time),
        "kind": first.kind,
        "clear": first.is_clear,
        "peak_error": errors.peak,
        "first_peak_error": of_force,
        "arrival_error_s": of_arrival,
        "first_width_error_s": of_width,
        "contact_time_error_s": of_contact,
    }


def _relative(values: FloatArray, expected: FloatArray, some: NDArray[np.bool_]) -> FloatArray:
    """Relative differences of some values; NaN for all others."""
    return np.asarray(np.abs(values / np.where(some, expected, np.nan) - 1.0), np.float64)


def causal(difference: FloatArray, time: FloatArray) -> FloatArray:
    """The largest finite difference so far along the last axis, by time; others as they are."""
    order = np.argsort(time, kind="stable")
    ordered = difference[..., order]
    is_finite = np.isfinite(ordered)
    so_far = np.maximum.accumulate(np.where(is_finite, ordered, 0.0), axis=-1)
    largest = np.empty_like(difference)
    largest[..., order] = np.where(is_finite, so_far, ordered)
    return largest


REST_OF_TIMES = 1.5  # rest of bounds over that of forces; 1.4 in the worst of 9,000 random runs

SHORT = 0.1  # natural time units; at shorter steps the error of every method is below round-off


def is_short(momentum_ratio: Quantity, granules: Quantity) -> Quantity:
    """Return whether a chain is short for its pulse; takes numbers or arrays."""
    # Granules over LM_ratio; collisions repeat below: 1.6 times the bound at 4.2
    return granules < 5.0 * momentum_ratio


def amplifies_errors(scene: Scene) -> bool:
    """Return whether contacts open and close repeatedly, so that errors are erratic.

    They do in chains that are short for their pulse, and under pulse tables, whose second push
    meets flying granules.
    """
    short = is_short(scene.momentum_ratio, scene.chain.granules)
    return not scene.is_plain or scene.pulse is None or bool(short)


@dataclass(frozen=True)
class Safety:
    """The safety factor of a kind of run: bound over estimate of an error.

    An estimate is the largest of the differences from other runs, each times its weight. Several
    differences are seldom all small by chance.

    Parameters
    ----------
    kind
        The kind of run.
    factor, measured
        The safety factor, and the largest ratio of an error to its estimate that was measured, in
        ``validation/error_bounds.py`` and in larger samples of random scenes.
    of_times, measured_of_times
        The same for arrivals and widths, whose errors add up along the chain, where these need
        another factor than forces.
    """

    kind: str
    factor: float
    measured: float
    of_times: float | None = None
    measured_of_times: float | None = None

    @property
    def factor_of_times(self) -> float:
        """The safety factor of arrivals and widths."""
        return self.factor if self.of_times is None else self.of_times

    def bounds(
        self, differences: Sequence[ContactErrors], weights: Sequence[float] = (),
        rest: float = 0.0, least: float = 0.0,
    ) -> ContactErrors:  # fmt: skip
        """Return bounds of the errors of each contact, from its differences from other runs.

        ``weights`` are the errors of the run over these differences where errors go as a power of
        the step (see ``SecondRun``), 1 by default; ``rest`` is an error that no difference shows,
        and is added; ``least`` is the least error by the steps.

        These errors are bounds of total forces, so a small pulse on a large static force has a
        larger relative error. Arrivals and widths [natural time units] are off by about the part
        of a unit that forces are of themselves.
        """
        weights, dynamic = weights or [1.0] * len(differences), differences[0].dynamic

        def bound(
            name: str, factor: float, share: FloatArray | float, rest: float = rest
        ) -> FloatArray:
            pairs = zip(weights, differences, strict=True)
            weighted = (weight * getattr(each, name) for weight, each in pairs)
            estimate = functools.reduce(np.maximum, weighted)
            return np.asarray((np.maximum(factor * estimate * share, least) + rest) / share)

        peak = bound("peak", self.factor, 1.0)
        if dynamic is None:
            return ContactErrors(peak)
        factor, of_times = self.factor_of_times, (dynamic, REST_OF_TIMES * rest)
        # Safety factor of contact times over that of other times (chosen): without it one of 4,600
        # contact times of 2,484 random scenes was off by 1.6 times its bound, long after the pulse
        opening = 4.0
        return ContactErrors(
            peak, bound("first", self.factor, dynamic), bound("arrival", factor, *of_times),
            bound("width", factor, *of_times),
            bound("contact_time", opening * factor, *of_times), dynamic,
        )  # fmt: skip


SAFETIES = {
    safety.kind: safety
    for safety in (
        Safety("planned", 0.15, 0.143, 2.0, 1.3),  # elastic, steps from the table of ``plan``
        Safety("extrapolated", 1.0, 0.84),  # smooth errors, without their first order
        Safety("smooth", 1.5, 1.3, 4.0, 3.1),  # second order, short steps, plain chains
        Safety("regular", 3.0, 2.3),  # errors that follow a power of the step in nearly all scenes
        Safety("erratic", 6.0, 5.3),  # few or long steps, and granules that collide repeatedly
        Safety("rising", 8.0, 6.8),  # long steps, of a run that ends while forces increase
        Safety("adaptive", 14.0, 11.9),  # steps that the run adapts
        Safety("tried first", 15.0, 12.0),  # plans that are tried first in hard scenes
    )
}
"""Safety factors by kind of run. At half of a factor random scenes have errors above the bound, as
the ratios that were measured show; with twice a factor bounds are twice as large as needed."""


def second_order_safety(scene: Scene, natural_step: float, rising: bool) -> Safety:
    """Return the safety of second-order methods; the step is in natural time units.

    Opening contacts add a term h^2.5 to h^2, and steps above 0.15 add a term h^4. ``rising``: the
    run ended while forces still increased.
    """
    if rising or natural_step > 0.15:
        return SAFETIES["rising" if rising and natural_step > 0.5 else "erratic"]
    return SAFETIES["smooth" if scene.is_plain else "regular"]


def first_order_safety(scene: Scene, rising: bool) -> Safety:
    """Return the safety of velocity Verlet with damped contacts."""
    return SAFETIES["erratic" if fly_at_others(scene) or rising else "regular"]


@dataclass(frozen=True)
class SecondRun:
    """A second run; ``weight`` times the difference of the peaks is the first run's error."""

    legs: tuple[Leg, ...]
    weight: float


def coarser_run(legs: Sequence[Leg], stable: float, order: int = 2) -> SecondRun:
    """Return the cheapest second run with other steps in every leg: 2/3 as many, or three times.

    Two thirds, not half: a method that halves steps could end on the same ones. There are three
    times as many where a leg has fewer than three steps, and where coarser steps come near
    ``stable`` [s]. The weight takes the leg whose step changes least, for errors that go as the
    step to the power ``order``.
    """
    longest = max(leg.dt for leg in legs)
    # Fraction of the longest stable step: contacts under 2.2 F0 are stiffer
    if min(leg.steps for leg in legs) < 3 or 1.5 * longest > 0.85 * stable:
        thrice = tuple(leg.in_steps(3 * leg.steps) for leg in legs)
        return SecondRun(thrice, 1 / (1 - 3**-order))
    coarse = tuple(leg.in_steps(2 * leg.steps // 3) for leg in legs)
    ratio = min(leg.steps / other.steps for leg, other in zip(legs, coarse, strict=True))
    return SecondRun(coarse, 1 / (ratio**order - 1))


def finer_run(legs: Sequence[Leg], order: int = 2) -> SecondRun:
    """Return a third run with 5/4 as many steps, where one difference may be small by chance.

    In 1,500 random scenes one difference was up to 120 times too small, the larger of two at most
    4.5 times.
    """
    finer = tuple(leg.in_steps(max(leg.steps + 1, 5 * leg.steps // 4)) for leg in legs)
    ratio = min(other.steps / leg.steps for leg, other in zip(legs, finer, strict=True))
    return SecondRun(finer, 1 / (1 - ratio**-order))


def fly_at_others(scene: Scene) -> bool:
    """Return whether granules fly towards others: a striker does, and granules before gaps."""
    flies = scene.striker is not None or scene.moves
    return flies or bool(np.any(scene.granules.gap > 0))


def stable_step(scene: Scene, interval: float) -> float:
    """Return the longest step with which a method is stable [s].

    Contacts pressed by F0 have the stiffness k = 3/2 in natural units, and neighbours among N
    granules swing against each other with at most the frequency 2 sqrt(k) cos(pi / 2N). Weak shocks
    make softer contacts. ``interval`` is the largest product of step and frequency with which the
    amplitude of an oscillation does not grow: 2 for velocity Verlet.
    """
    if scene.contact is not None:
        # No root of z^2 - (2 - r h - (w h)^2) z + 1 - r h may lie outside the unit circle. r is the
        # rate at which dampers alone would stop a motion; they act with a delay of half a step.
        frequency, rate = _highest_frequency(scene), highest_rate(scene)
        return 2 * interval / (rate + math.hypot(rate, 2 * frequency))
    if not scene.is_plain:
        return interval / _highest_frequency(scene)
    bound = math.cos(math.pi / (2 * scene.chain.granules))
    frequency = math.sqrt(6.0) * bound * math.pow(force_scale(scene.momentum_ratio), 1 / 6)
    return interval / frequency * scene.units.time


def _highest_frequency(scene: Scene) -> float:
    """Upper bound of the frequencies of a chain whose contacts all carry the unit of force [1/s].

    No eigenvalue is larger than the largest row sum of the matrix of stiffnesses over masses
    (Gershgorin). A row sum is twice the stiffness of a granule's contacts over its mass.
    """
    granules = scene.granules
    pressed = hertz.slope_of(granules.stiffness, scene.units.force)
    return math.sqrt(_largest_row(scene, pressed))


def highest_rate(scene: Scene) -> float:
    """Upper bound of the rates of dampers while all contacts carry the unit of force [1/s]."""
    granules, contact = scene.granules, scene.contact
    assert contact is not None
    assert granules.damping is not None
    overlap = hertz.overlap_of(granules.stiffness, scene.units.force)
    return _largest_row(scene, granules.damping * overlap**contact.exponent)


def refuse_strong_dampers(scene: Scene) -> None:
    """Raise a SceneError for dampers too strong for every method; it names the strongest allowed.

    Damping given as a restitution is never too strong: its dampers are about as fast as the contact
    itself. A wall's damper may be as strong as those of the chain.
    """
    contact = scene.contact
    if contact is None or contact.damping == "restitution":
        return
    key, unit = DAMPING[contact.damping], contact.with_parameter(1.0)
    walls = {"wall": scene.wall, "near_wall": scene.near_wall}
    damped = {name: wall for name, wall in walls.items() if wall and wall.own_damping}
    others: Any = {name: wall.damped(unit) for name, wall in damped.items()}
    # Rate of the dampers over that of contacts (chosen); at 1e4 many runs do not progress. That of
    # impossible dampers overflows, so it is computed for a parameter of 1.
    most = 1e6 / (highest_rate(replace(scene, contact=unit, **others)) * scene.contact_time)
    allowed = (
        f"must be at most {most:.2g} {keys_of(Contact)[key].unit} in this scene: stronger dampers"
        " are beyond what can be computed"
    )
    laws = {"contact": contact, **{name: contact.at(wall) for name, wall in damped.items()}}
    for section, law in laws.items():
        require(law.parameter <= most, f"{section}.{key}", law.parameter, allowed)


def _largest_row(scene: Scene, of_contact: FloatArray) -> float:
    """Largest row sum of a matrix of contact coefficients divided by masses."""
    around = np.zeros(scene.bodies + 1)
    around[1 : 1 + of_contact.size] = of_contact
    return float(np.max(2 * (around[:-1] + around[1:]) / scene.granules.mass))


def refuse_unstable(scene: Scene, legs: Sequence[Leg], interval: float, method: str) -> None:
    """Raise StepUnstable for steps longer than ``stable_step``: the motion would diverge."""
    longest, limit = max(leg.dt for leg in legs), stable_step(scene, interval)
    if longest > limit:
        raise StepUnstable(
            f"the step of {longest:.3g} s is unstable: {method} is stable up to {limit:.3g} s"
            f" ({limit / scene.contact_time:.3g} natural time units) in this scene, choose a"
            " smaller dt"
        )


SHORTER = "ask for a smaller dt, or for a smaller rtol in place of dt"
"""Advice on steps that are too long, whether or not a step was given."""


def diverged(backend: str) -> StepUnstable:
    """Return the error for a run whose energy grows without bound."""
    return StepUnstable(
        f"the {backend} run diverged: its step is too long for the method, {SHORTER}"
    )


def refuse_meaningless(backend: str, error: float, too_long: bool) -> None:
    """Refuse a run whose error bound is 1 or more; ``too_long``: shorter steps would help."""
    if error < 1:
        return
    if too_long:
        raise StepUnstable(
            f"the {backend} run has no right digit: its step is too long for the method, choose a"
            " smaller dt"
        )
    raise Unpredictable(
        f"the {backend} run has no right digit: repeated collisions amplify rounding errors to the"
        " size of the peaks; a shorter end_time or pulse helps"
    )


def step_for(
    peaks_at: Callable[[float], FloatArray], pilot: float, wanted: float, safety: Safety,
    order: int = 2,
) -> float:  # fmt: skip
    """Return the step [s] for a wanted relative error of peaks, by runs at ``pilot`` and half."""
    error = safety.factor * largest_difference(peaks_at(pilot), peaks_at(pilot / 2))
    if not error > 0:
        return pilot
    if order == 1:
        return pilot / 2 * min(0.7 * wanted / error, 8.0)
    return pilot / 2 * min(math.sqrt(0.9 * wanted / (error / 3)), 4.0)
