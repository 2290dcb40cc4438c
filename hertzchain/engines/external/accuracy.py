"""Accuracy of another code's peaks: errors of steps, samples and coordinates, and what lowers them.

Codes compute overlaps from coordinates as large as 2 R N plus the flight of the chain, in which
small overlaps keep few digits. A similar scene with a softer chain loses fewer: if E is replaced by
s E, with all forces and everything else unchanged, overlaps and displacements grow by s^(-2/3) and
times by s^(-1/3): with s = 8^(-k) by 4^k and 2^k, without rounding. Neither contact stiffness nor
mass is used, so that a mistake in either remains visible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray, Quantity
from hertzchain.contact import hertz
from hertzchain.limits import RTOL
from hertzchain.observables import error_bound
from hertzchain.observables.error_bound import OF_TIMES, ContactErrors, Peaks
from hertzchain.observables.peaks import ESTIMATED, SIGNIFICANT, judged_contacts
from hertzchain.observables.samples import Samples
from hertzchain.observables.watch import PeakWatch
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.terms import Contact, Wall

# ---- Steps and samples

INTERPOLATION = 3e-4  # relative error of a peak over interval^8 [natural units]; measured 1e-4
KINK = 1.5e-3  # relative error over interval^3.5 [natural units]: an opening neighbour leaves 6e-4
DAMPED_INTERPOLATION = 0.1  # relative error over interval^5 [natural units]
DAMPED_ONSET = 0.01  # relative error over (interval times rate of the dampers)^3; measured 0.005
# relative error over dt^2 [natural units, or over the dampers' time], with readings at each step
DAMPED_READINGS = 0.2
# bound of the error by a reading before a dashpot closes, over (interval times rate)^2; measured
TOUCH = 0.1
DASHPOT = 0.6  # relative error over dt times the rate of the dampers: see ``touch_error``


def extrapolate(coarse: Peaks, fine: Peaks, order: int, longest: float) -> Peaks:
    """Extrapolate peaks and first pulses to steps of length 0, from n and 2n steps.

    Errors go as the step to the power ``order``: 2, or 1 where contacts are damped. If two maxima
    have nearly the same height, each run may have found a different one: those are more than the
    ``longest`` step of the coarse run apart, and their times are not extrapolated.
    """
    gain = 2**order - 1

    def later(before: FloatArray, other: FloatArray) -> FloatArray:
        change = other - before
        return np.where(np.abs(change) < longest, other + change / gain, other)

    def stronger(before: FloatArray, other: FloatArray) -> FloatArray:
        return np.asarray((2**order * other - before) / gain)

    first, before = fine.first, coarse.first
    if first is not None and before is not None:
        first = replace(
            first, force=stronger(before.force, first.force), time=later(before.time, first.time),
            arrival=later(before.arrival, first.arrival), width=later(before.width, first.width),
            contact_time=later(before.contact_time, first.contact_time),
        )  # fmt: skip
    force = stronger(coarse.force, fine.force)
    return Peaks(force, later(coarse.time, fine.time), fine.passed, first)


def extrapolation_safety(
    scene: Scene, legs: Sequence[Leg], peaks: PeakWatch, rising: bool
) -> tuple[error_bound.Safety, float]:
    """Return the safety of extrapolated peaks, and an error that differences may hide by chance.

    Legs and peaks are those of the finer steps; ``rising``: a force still grows at the end.

    The error is 1/15 of the difference where errors go as dt^2 and dt^4. Contacts that open leave a
    term dt^2.5 in natural units, erratic from one step to the next, so that two extrapolations can
    agree by chance: 0.0055 dt^2.5 was measured where they did. In hard scenes, and for contacts
    whose force still grows at the end, both are erratic; the more so where the finest run has few
    steps.

    With damped contacts the remaining error goes as dt^2; for contacts whose force still grows at
    the end, 0.04 dt was measured. Where granules fly towards others, it goes as dt^1.5 and less,
    and is erratic.
    """
    dt = max(leg.dt for leg in legs) / scene.contact_time
    if scene.contact is not None:
        by_chance = 0.1 * dt if rising else 0.0
        # Factor for extrapolated peaks: twice the error of the finer run, plus the other's
        by_chance += 4.0 * touch_error(scene, legs, peaks)
        return error_bound.SAFETIES["erratic"], by_chance
    if error_bound.amplifies_errors(scene) or rising:
        # Steps of a leg in the finest of three runs: with fewer, errors follow no power of dt
        few = max(leg.steps for leg in legs) < 16
        return error_bound.SAFETIES["erratic" if few else "regular"], 0.05 * math.pow(dt, 2.5)
    return error_bound.SAFETIES["extrapolated"], 0.005 * math.pow(dt, 2.5)


def least_gain(scene: Scene) -> float:
    """Return by how much halving the steps at least reduces the error of extrapolated peaks."""
    return 2.0 if scene.contact is not None and error_bound.fly_at_others(scene) else 4.0


def touch_error(scene: Scene, legs: Sequence[Leg], peaks: PeakWatch) -> float:
    """Bound of the relative error of the peaks by dashpots that close at a speed.

    Their force jumps when a contact closes, anywhere within a step: this leaves an erratic error of
    the motion that follows, of half the step times the rate of the dampers at most for each contact
    that closes (measured 0.54).
    """
    if not peaks.touch_share:
        return 0.0
    return (
        DASHPOT * error_bound.highest_rate(scene) * max(leg.dt for leg in legs) * peaks.touch_share
    )


def touches_at_a_speed(scene: Scene) -> bool:
    """Return whether dashpots may close at a speed, so that their force jumps."""
    contact = scene.contact
    return contact is not None and contact.exponent == 0 and error_bound.fly_at_others(scene)


def usual_accuracy(scene: Scene) -> float:
    """Return the default accuracy of ``compare``: 1e-6, or 1e-4 where dashpots close at a speed.

    Errors are of first order there: 1e-4 takes 5 s for 5 granules, 1e-6 minutes.
    """
    return 1e-4 if touches_at_a_speed(scene) else RTOL


def rival_errors(
    peaks: PeakWatch, highest: FloatArray, other: PeakWatch | None = None, factor: float = 0.0
) -> FloatArray:
    """Bounds of the relative heights by which another maximum may exceed the highest, (contacts,).

    Parameters
    ----------
    peaks
        The peaks of a run.
    highest
        The same extrapolated, or as they are [N], shape (contacts,). The error by steps differs
        between maxima: one that is lower in every run may be the highest.
    other, factor
        Peaks of a run with other steps: so many times the difference of the second maxima bounds
        the error of the second maximum. In one chain with a wall a later blow was the highest in
        the exact solution, but in neither run, because its error was ten times that of the first.
    """
    judged, rival = judged_contacts(highest, ESTIMATED), peaks.rival
    reached = 2 * np.abs(peaks.force - highest)
    if other is not None:
        in_both = (rival > 0) & (other.rival > 0)
        reached = np.maximum(reached, np.where(in_both, factor * np.abs(other.rival - rival), 0.0))
    above = (rival + reached - highest) / np.where(judged, highest, 1.0)
    return np.where(judged, np.maximum(above, 0.0), 0.0)


def with_rivals(
    errors: ContactErrors, rivals: FloatArray, seen: Peaks, joined: np.ufunc
) -> ContactErrors:
    """Return errors joined with those of ``rival_errors``, of first pulses that are the highest."""
    peak, first = joined(errors.peak, errors.alike(rivals)), seen.first
    if first is None or errors.first is None or errors.dynamic is None:
        return replace(errors, peak=peak)
    of_first = np.zeros(first.force.size)
    # Least force of a first pulse over the highest, if it is that (rounding)
    is_highest = (first.force + first.static)[: rivals.size] > (1 - 1e-9) * seen.force
    of_first[: rivals.size] = np.where(is_highest, rivals, 0.0)
    of_first /= errors.dynamic
    of_times = {name: joined(getattr(errors, name), of_first) for name in OF_TIMES}
    first_error = joined(errors.first, of_first)
    return replace(errors, peak=peak, first=first_error, **of_times)


def interpolation_error(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> float:
    """Upper bound of the relative error of the peaks by the interval between readings.

    In natural units it is 1e-4 h^8, plus 0.005 h^4 dt^2 and 0.4 h^2 dt^4 (measured) for the
    remaining error of the derivatives, and in hard scenes the error by opening contacts: see
    ``KINK``. Overlaps of damped contacts bend as they close and open: in 80 random scenes readings
    0.2, 0.1 and 0.05 units apart cost up to 2.6e-5, 7e-7 and 4e-7 of the peaks, the last as much as
    readings at each step of 0.002. Strong dampers let a force decay within 1 / rate of the closing:
    see ``DAMPED_ONSET``. What readings before a jump cost is known after the run: see
    ``PeakWatch.reading_error``.
    """
    unit = scene.contact_time
    apart = [min(n, leg.steps) * leg.dt / unit for n, leg in zip(strides, legs, strict=True)]
    dt, h = max(leg.dt for leg in legs) / unit, max(apart)
    if scene.contact is not None:
        rate = error_bound.highest_rate(scene) * unit
        by_steps = DAMPED_READINGS * (dt * max(1.0, rate)) ** 2
        return DAMPED_INTERPOLATION * h**5 + DAMPED_ONSET * (h * rate) ** 3 + by_steps
    kinks = KINK * h**3.5 if error_bound.amplifies_errors(scene) else 0.0
    return INTERPOLATION * h**8 + 0.01 * h**4 * dt**2 + h**2 * dt**4 + kinks


def damped_interval(scene: Scene, smooth: float, touch: float) -> float:
    """Return the longest interval between readings of damped contacts [s]; it may be below a step.

    ``smooth`` is the relative error of the peaks that it may cost while forces are smooth,
    ``touch`` that where a dashpot closes at a speed.
    """
    # Longest interval between readings of damped contacts [natural units]
    within = min(0.1, math.pow(smooth / DAMPED_INTERPOLATION, 1 / 5))
    most = math.pow(smooth / DAMPED_ONSET, 1 / 3)
    if scene.contact is not None and scene.contact.exponent == 0:
        most = min(most, math.sqrt(touch / TOUCH))
    return min(within * scene.contact_time, most / error_bound.highest_rate(scene))


def damped_interval_at(scene: Scene, dt: float) -> float:
    """Return the interval between readings [s] that costs little next to the error of steps dt."""
    by_steps = dt * max(1 / scene.contact_time, error_bound.highest_rate(scene))
    return damped_interval(scene, 0.01 * by_steps, 0.1 * by_steps)


# ---- Coordinates

TOLERABLE = 1e-9  # predicted relative error of the peaks up to which a scene is computed unchanged


@dataclass(frozen=True)
class Softening:
    """Relation between the scene given to a code and the true one: E is divided by 8^k."""

    power: int  # k: the motion is 4^k times as long, times are 2^k times; below 0 a stiffer chain

    @property
    def length(self) -> float:
        """Ratio of a displacement or overlap to the true one."""
        return 4.0**self.power

    @property
    def time(self) -> float:
        """Ratio of a time, and of a velocity, to the true one."""
        return 2.0**self.power

    def scene(self, scene: Scene) -> Scene:
        """Return the similar scene, with another Young's modulus and scaled times."""
        shock, run = scene.shock, scene.run
        shock = shock.stretched(self.time, self.length, 1 / 8.0**self.power)
        if run.end_time is not None:
            run = replace(run, end_time=self.time * run.end_time)
        gap = _times(self.length, scene.chain.gap)
        modulus = self._modulus(scene.chain.young_modulus)
        velocity = _times(self.length / self.time, scene.chain.velocity)
        stiffness = self._modulus(scene.chain.stiffness)
        chain = replace(
            scene.chain, young_modulus=modulus, gap=gap, velocity=velocity, stiffness=stiffness
        )
        return Scene(
            chain, shock, run, self._wall(scene.wall, scene.contact), scene.precompression,
            self._contact(scene.contact), scene.gauges,
            near_wall=self._wall(scene.near_wall, scene.contact),
        )  # fmt: skip

    def _wall(self, wall: Wall | None, contact: Contact | None) -> Wall | None:
        if wall is None:
            return None
        modulus = self._modulus(wall.young_modulus)
        softer_wall = replace(
            wall, young_modulus=modulus, gap=self.length * wall.gap,
            stiffness=self._modulus(wall.stiffness),
        )  # fmt: skip
        if contact is None or not wall.own_damping:
            return softer_wall
        return softer_wall.damped(self._contact(contact.at(wall)))

    def _contact(self, contact: Contact | None) -> Contact | None:
        """Return the similar damping; a restitution, a ratio of velocities, stays the same.

        A relaxation time scales as times do. A dashpot's coefficient is a force over a velocity,
        and forces stay the same.
        """
        if contact is None or contact.damping == "restitution":
            return contact
        is_time = contact.damping == "viscoelastic"
        value = contact.parameter
        return contact.with_parameter(self.time * value if is_time else value / self.time)

    def _modulus(self, young_modulus: Quantity) -> Quantity:
        return None if young_modulus is None else _times(1 / 8.0**self.power, young_modulus)

    def leg(self, leg: Leg) -> Leg:
        """Return a leg in the time of the similar scene."""
        return leg.in_units(1 / self.time, 1.0, 1 / self.length)

    def true(self, samples: Samples) -> Samples:
        """Return samples of the similar scene scaled to the true one."""
        return replace(
            samples, time=samples.time / self.time, displacement=samples.displacement / self.length,
            velocity=samples.velocity / self.time, overlap=samples.overlap / self.length,
            jerk=None if samples.jerk is None else samples.jerk * self.time,
        )  # fmt: skip


def _times(factor: float, values: Quantity) -> Quantity:
    """Multiply a number, or a tuple of numbers, by a power of 2, without rounding."""
    if isinstance(values, tuple):
        return tuple(factor * value for value in values)
    return factor * values


NONE = Softening(0)  # the true scene


def softening(scene: Scene, steps: int) -> Softening:
    """Return the relation to the scene to compute, which is the true one where that loses little.

    Otherwise overlaps become as deep as is allowed and useful: where the chain flies farther than
    its own length, coordinates grow with the overlaps, and deeper ones gain nothing.
    """
    length, smallest = scene.units.length, float(np.min(scene.granules.radius))
    overlap, _, flight = _expected(scene)
    # Deepest overlap expected [radii]: second neighbours touch where two add up to 2
    deepest = 0.8 * smallest / overlap
    if length <= deepest and predicted_loss(scene, steps) <= TOLERABLE:
        return NONE
    # Longest flight of a similar chain [chain lengths]; 2 would lose half as much again
    useful = 8 * _length(scene) / flight
    wanted = math.log(min(deepest, useful)) - math.log(length)
    # Largest k: overlaps grow by 1e60, and all numbers stay in the range of floating point
    return Softening(min(math.floor(wanted / math.log(4)), 100))


def predicted_loss(scene: Scene, steps: int, scaling: Softening = NONE) -> float:
    """Estimate the error of the peaks by coordinates before a run: see ``round_off``."""
    _, shallowest, flight = _expected(scene)
    reach = _length(scene) / (scene.units.length * scaling.length) + flight
    return _loss(scene, reach, shallowest, steps)


def round_off(
    scene: Scene, scaling: Softening, steps: int, peak_force: FloatArray, displacement: FloatArray
) -> float:
    """Upper bound of the relative error of the peaks by absolute coordinates.

    The arguments are the peak forces of all contacts [N], with the wall's contact last, and the
    displacements at the end of the true scene [m], shape (granules,). The smallest judged peak
    loses most. The last granule of a plain scene is only pushed forwards, so that it moves
    farthest.
    """
    judged = judged_contacts(peak_force)
    overlaps = hertz.overlap_of(scene.granules.stiffness, peak_force)
    overlap = np.min(overlaps[judged]) if judged.any() else 0.0
    if overlap == 0:
        # 0 is right if the run ends before a table pushes; otherwise overlaps are lost in
        # coordinates.
        return 0.0 if scene.applied_impulse == 0 else math.inf
    flight = float(np.max(np.abs(displacement))) * scaling.length
    reach = _length(scene) + flight
    return _loss(scene, reach, float(overlap) * scaling.length, steps)


def _loss(scene: Scene, reach: float, overlap: float, steps: int) -> float:
    """Error of an overlap by the rounding of coordinates up to ``reach`` at each step.

    Roundings are random, but all those of a granule in free flight are the same: half a digit.
    """
    times = steps / 2 if scene.moves else math.sqrt(steps)
    return float(np.finfo(np.float64).eps) * reach / overlap * times


# Estimates for a scene before its run, in natural units. The factors were measured on random scenes
# (LM_ratio 1e-4 to 1e4, n 1.001 to 1e4, N 2 to 500) in test_rescaling.py.


def _overlap(peak_force: float) -> float:
    return math.pow(peak_force, 2 / 3)


def _length(scene: Scene) -> float:
    """Length of the chain from end to end [m]."""
    return float(2 * np.sum(scene.granules.radius) + np.sum(scene.granules.gap))


def _expected(scene: Scene) -> tuple[float, float, float]:
    """Estimated deepest overlap, shallowest that is judged, and way of the last granule."""
    if scene.is_plain:
        # Granules thrown ahead meet again (measured: 2.04 and 4.05 times the peak of the wave).
        highest = (2.0 if _impulse(scene) <= 10 else 5.0) * _peak_force(scene)
        return _overlap(highest), _overlap(_lowest_peak(scene)), _flight(scene)
    stiffness, first = scene.granules.stiffness, scene.unit_contact
    # At all times as fast as a granule that the shock throws ahead, or that moves at the start.
    others = np.abs(scene.granules.velocity[1:])
    thrown = float(np.max(others, initial=0.0)) / scene.units.velocity
    flight = max(2.0 * min(1.0, scene.momentum_ratio), thrown) * scene.end_time / scene.units.time
    # Largest force and smallest peak expected beyond a uniform chain [units of force] (chosen): a
    # wall doubles a wave
    return (
        _overlap(3.0 * float(stiffness[first] / np.min(stiffness))),
        _overlap(0.05 * float(stiffness[first] / np.max(stiffness))),
        flight,
    )


def _impulse(scene: Scene) -> float:
    return scene.applied_impulse / scene.units.momentum


def _peak_force(scene: Scene) -> float:
    """Estimated peak of the wave; the true one is between 0.5 and 4 times this."""
    until = scene.end_time
    highest = max(
        max(ramp.start_force, float(ramp.force(min(ramp.end, until)))) / scene.units.force
        for ramp in scene.ramps
        if ramp.start < until or ramp is scene.ramps[0]
    )
    # 0 where the run ends before a table starts to push; then any length will do.
    return min(float(highest), 0.64 * math.pow(_impulse(scene), 1.2)) or 1.0


def _lowest_peak(scene: Scene) -> float:
    """Estimated lowest peak: under a slow rise the force falls linearly towards the free end."""
    rise = max(scene.ramps, key=lambda ramp: ramp.end_force).end / scene.units.time
    granules = scene.chain.granules
    fraction = min(0.8, max(1 / granules, SIGNIFICANT, granules / rise))
    return fraction * _peak_force(scene)


def _flight(scene: Scene) -> float:
    """Estimate the displacement of the last granule, with the chain and ahead of it."""
    units, end = scene.units, scene.end_time
    chain = math.fsum(
        ramp.impulse * (end - (ramp.start + ramp.end) / 2)
        if ramp.end <= end
        else ramp.impulse_until(end) * (end - ramp.start) / 2
        for ramp in scene.ramps
        if ramp.start < end
    ) / (units.momentum * units.time * scene.chain.granules)
    alone = max(end / units.time - scene.chain.granules, 0.0) * min(_impulse(scene), 2.0)
    return chain + alone or 1.0  # nothing moves if the run ends before a table starts
