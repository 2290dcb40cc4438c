"""A similar scene with a softer chain, which loses fewer digits to absolute coordinates.

Codes compute overlaps from coordinates as large as 2 R N plus the flight of the chain, in which
small overlaps keep few digits. If E is replaced by s E, with all forces and everything else
unchanged, overlaps and displacements grow by s^(-2/3) and times by s^(-1/3): with s = 8^(-k) by 4^k
and 2^k, without rounding. Neither contact stiffness nor mass is used, so that a mistake in either
remains visible.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.arrays import FloatArray, Quantity
from hertzchain.contact import hertz
from hertzchain.observables.peaks import SIGNIFICANT, judged_contacts
from hertzchain.observables.samples import Samples
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.terms import Contact, Wall

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
        return _overlap(_highest_peak(scene)), _overlap(_lowest_peak(scene)), _flight(scene)
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


def _highest_peak(scene: Scene) -> float:
    """Estimated highest peak; granules thrown ahead meet again (measured: 2.04 and 4.05 times)."""
    return (2.0 if _impulse(scene) <= 10 else 5.0) * _peak_force(scene)


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
