"""Expected numbers of a deck, computed independently from the scene: places, loads, shock.

This code must not share a mistake with the code that writes decks.
"""

from __future__ import annotations

import math

import numpy as np

from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.scene.scene import Scene


def length(scene: Scene) -> float:
    """Length of the chain, the size of coordinates [m]."""
    return float(np.sum(2 * scene.granules.radius) + np.sum(scene.granules.gap))


def places(scene: Scene) -> FloatArray:
    """Places of granules and a wall [m]: contact after contact, each in equilibrium."""
    granules = scene.granules
    pressed, carried = scene.precompression, np.zeros(granules.stiffness.size)
    load, weighs, weight = 0.0 if pressed is None else pressed.force, 0.0, _weight(scene)
    fixed = set(granules.fixed[scene.first_granule :].tolist())
    # A free striker presses nothing at the start, and a fixed granule passes nothing on but a near
    # wall, which presses the chain.
    for k in range(scene.shock.loaded_granule, carried.size):
        weighs += weight[k]
        if k in fixed:
            load = weighs = 0.0
        carried[k] = weighs + load
    overlap = (carried / granules.stiffness) ** (2 / 3)
    ahead = np.broadcast_to(scene.chain.gap, scene.chain.granules)[1:]
    if scene.near_wall is not None:
        ahead = np.append(scene.near_wall.gap, ahead)
    ahead = granules.radius[1:] + ahead
    if scene.wall is not None:
        ahead = np.append(ahead, scene.wall.gap)
    return np.append(0.0, np.cumsum(granules.radius[: carried.size] + ahead - overlap))


def _weight(scene: Scene) -> FloatArray:
    """Weight of each granule along the chain [N], shape (granules,)."""
    gravity = 0.0 if scene.precompression is None else scene.precompression.gravity
    granules = scene.granules
    weight = np.asarray(gravity * 4 / 3 * math.pi * granules.radius**3 * granules.density)
    weight[: scene.first_granule] = 0.0  # a near wall has none
    return weight


def constant_force(scene: Scene) -> FloatArray:
    """Weight and static loads on each granule [N], shape (granules,); fixed ones bear any."""
    load = _weight(scene)
    if scene.precompression is not None:
        load[scene.shock.loaded_granule] += scene.precompression.force
        load[-1] -= scene.held_load
    return load


def applied_force(scene: Scene, time: FloatArray) -> FloatArray:
    """F(t) [N] by Table 1 or the pulse table, not by the schedule's ramps; of the shape of time."""
    if scene.pulse is None:
        return scene.shock.by_formula(time)
    assert scene.rise_time is not None
    return theory.applied_force(time, scene.pulse, scene.rise_time)
