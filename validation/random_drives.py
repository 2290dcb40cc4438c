"""Random scenes with pistons and sines, drawn to be hard on error bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hertzchain as hc
from validation.random_scenes import damped, random_scene_with_terms, spread


def random_scene_with_piston(
    rng: np.random.Generator, longest: int, longest_time: float
) -> hc.Scene:
    """A chain with terms as in ``random_scene_with_terms``, and a piston instead of its shock.

    Half have a constant velocity, the others a table that goes forwards and backwards.
    """
    while True:
        scene = random_scene_with_terms(rng, longest, longest_time)
        velocity = scene.units.velocity * spread(rng, 0.01, 2.0)
        if rng.random() < 0.5:
            scene = replace(scene, shock=hc.Piston(velocity))
        else:
            rows = int(rng.integers(2, 9))
            apart = np.array([spread(rng, 0.1, 20.0) for _ in range(rows)])
            time = (np.cumsum(apart) - apart[0] * (rng.random() < 0.5)) * scene.contact_time
            slope = velocity * rng.uniform(-1.0, 1.0, rows - 1) * (rng.random(rows - 1) < 0.8)
            slope[0] = velocity
            place = np.append(0.0, np.cumsum(slope * np.diff(time)))
            scene = replace(scene, shock=hc.Piston(None, tuple(time), tuple(place)))
        if rng.random() < 0.2:
            scene = replace(scene, run=hc.Run(scene.end_time * float(rng.uniform(0.1, 1.0))))
        if scene.end_time <= longest_time * scene.contact_time:
            return scene


def random_scene_with_sine(rng: np.random.Generator, longest: int, longest_time: float) -> hc.Scene:
    """A pressed chain with terms, and a sine of 1e-3 of the load up to all of it.

    Its period is 0.5 to 100 natural time units of the fastest contact.
    """
    while True:
        scene = random_scene_with_terms(rng, longest, longest_time)
        if scene.precompression is None or not scene.precompression.force:
            continue
        amplitude = scene.precompression.force * spread(rng, 1e-3, 1.0)
        frequency = 1 / (scene.contact_time * spread(rng, 0.5, 100.0))
        scene = replace(scene, shock=hc.Sine(amplitude, frequency, int(rng.integers(1, 9))))
        if scene.end_time <= longest_time * scene.contact_time:
            return scene


def random_hard_scene(
    rng: np.random.Generator, longest: int, longest_time: float, is_damped: bool
) -> hc.Scene:
    """A scene with terms and any drive: a sixth has a piston, a sixth where it can a sine."""
    kind = int(rng.integers(6))
    if kind == 0:
        scene = random_scene_with_piston(rng, longest, longest_time)
    elif kind == 1:
        scene = random_scene_with_sine(rng, longest, longest_time)
    else:
        scene = random_scene_with_terms(rng, longest, longest_time)
    return damped(rng, scene) if is_damped else scene
