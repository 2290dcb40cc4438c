"""The start of a scene and its shock, computed apart from ``Scene.granules`` and its schedule.

What decks are held against must not share a mistake with what writes them.
"""

from __future__ import annotations

import math

import numpy as np

from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.scene.scene import Scene


def start_of(scene: Scene) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places, constant forces and velocities: contact after contact, each in equilibrium."""
    chain, pressed, each = scene.chain, scene.precompression, scene.granules
    force, gravity = (0.0, 0.0) if pressed is None else (pressed.force, pressed.gravity)
    gaps = np.broadcast_to(chain.gap, chain.granules)
    carried, place, places = force, 0.0, [0.0]
    mass = [4 / 3 * math.pi * float(r) ** 3 * float(rho) for r, rho in
            zip(each.radius, each.density, strict=True)]  # fmt: skip
    for granule in range(chain.granules):
        radius = float(each.radius[granule])
        carried += gravity * mass[granule]
        if granule < each.stiffness.size:
            overlap = (carried / float(each.stiffness[granule])) ** (2 / 3)
        if granule + 1 < chain.granules:
            place += radius + float(gaps[granule + 1]) - overlap + float(each.radius[granule + 1])
            places.append(place)
        elif scene.wall is not None:
            places.append(place + radius + scene.wall.gap - overlap)
    constant = [gravity * each_mass for each_mass in mass]
    constant[0] += force
    constant[-1] -= force if scene.wall is None else 0.0
    velocity = np.zeros(chain.granules)
    velocity[0] = scene.start_velocity
    return np.array(places), np.array(constant), velocity


def applied_force(scene: Scene, time: FloatArray) -> FloatArray:
    """F(t) [N] by Table 1 or the pulse table, not by the schedule's ramps; of the shape of time."""
    if scene.pulse is None:
        return scene.shock.by_formula(time)
    assert scene.rise_time is not None
    return theory.applied_force(time, scene.pulse, scene.rise_time)
