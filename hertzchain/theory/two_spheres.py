"""The fraction of their speed with which two spheres part under the damping of a scene."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from hertzchain.contact import hertz
from hertzchain.scene.chain import granule_mass, length_and_time
from hertzchain.scene.scene import Scene
from hertzchain.theory import restitution
from hertzchain.theory.solitary_wave import solitary_wave


@dataclass(frozen=True)
class Parting:
    """Two like spheres that meet head-on and part.

    Parameters
    ----------
    restitution
        Speed of parting over speed of closing.
    speed
        Speed of closing [m/s]; None where the restitution does not depend on it.
    whose
        Where the speed comes from; empty without one.
    """

    restitution: float
    speed: float | None = None
    whose: str = ""


def parting(scene: Scene) -> Parting | None:
    """Return the rebound of two spheres like granule 2; None in a scene without damping.

    They close with the velocity of the striker, the largest speed of the piston or, where a force
    pushes the chain, the largest velocity of a granule in a solitary wave of the largest applied
    force.
    """
    law, granules = scene.contact, scene.granules
    if law is None:
        return None
    if law.restitution is not None:
        ratio = restitution.damping_ratio(law.restitution)
        return Parting(restitution.of_ratio(ratio, law.attraction))
    properties = (granules.radius, granules.young_modulus, granules.poisson_ratio, granules.density)
    radius, modulus, poisson, density = (float(values[1]) for values in properties)
    stiffness = float(hertz.stiffness_of_equals(radius, modulus, poisson))
    mass = float(granule_mass(radius, density))
    shock = scene.shock
    if shock.impact_velocity is not None:
        speed = shock.impact_velocity
        whose = "the striker's" if scene.striker is not None else "the piston's largest"
    else:
        length, time = length_and_time(stiffness, mass, scene.peak_force)
        speed = float(wave_velocity() * length / time)
        whose = f"a granule's in a wave of {scene.peak_force:.3g} N"
    spheres = restitution.Collision(mass / 2, stiffness, speed)
    viscous = law.damping == "viscoelastic"
    to_restitution = restitution.viscoelastic if viscous else restitution.dashpot
    coefficient = to_restitution(law.parameter, spheres, law.attraction)
    return Parting(coefficient, speed, whose)


@functools.cache
def wave_velocity() -> float:
    """Return the largest velocity of a granule in a solitary wave of height 1, in natural units.

    A granule is fastest when the wave is between its two contacts. Its velocity is then the
    integral of the force from x = -1/2 to 1/2, divided by the wave speed c, because the
    difference of the two contact forces accelerates it.
    """
    from scipy.integrate import simpson

    wave = solitary_wave()
    inside = np.abs(wave.x) <= 0.5
    return float(simpson(wave.overlap[inside] ** 1.5, x=wave.x[inside]) / wave.speed)
