"""Velocity Verlet on a scene, also with a given force at each step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import METHODS, simulate
from hertzchain.limits import Deadline
from hertzchain.observables.history import Recorder
from hertzchain.scene.pulse import Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


@dataclass(frozen=True, eq=False)
class Verlet:
    """Peaks of velocity Verlet [N]: interpolated maxima, and the highest samples."""

    interpolated: FloatArray
    sampled: FloatArray


def velocity_verlet(scene: Scene, legs: Sequence[Leg], deadline: Deadline) -> Verlet:
    """Return peaks by velocity Verlet on given steps, with and without interpolation."""
    unit, walker = scene.units, METHODS["velocity-verlet"].walker
    run = simulate(scene, legs, walker, deadline=deadline)
    starts = np.concatenate([leg.start + leg.dt * np.arange(leg.steps) for leg in legs])
    nodes = np.append(starts, legs[-1].end) / unit.time
    # The highest sample is next to the peak: a second, equal run is sampled only there.
    after = np.searchsorted(nodes, run.peaks.time[np.isfinite(run.peaks.time)])
    beside = np.clip(np.concatenate([after - 1, after, after + 1]), 0, nodes.size - 1)
    granules = scene.chain.granules
    recorder = Recorder(np.unique(nodes[beside]), granules, scene.wall is not None)
    simulate(scene, legs, walker, recorder, deadline=deadline)
    sampled = np.max(recorder.contact_force, axis=0, initial=0.0)
    between = slice(granules - 1)  # a wall's contact is the last
    return Verlet(run.peaks.force[between] * unit.force, sampled[between] * unit.force)


MOST_LEGS = 100_000  # most legs of one step (chosen): half a second


def steps_with_force(nodes: FloatArray, force: FloatArray, steps_after: int) -> list[Leg]:
    """Legs of one step with given forces [N] at given times [s], then steps without force."""
    legs = [
        Leg(t0, t1, 1, Ramp(t0, t1, f0, f1, "linear"))
        for t0, t1, f0, f1 in zip(nodes, nodes[1:], force, force[1:], strict=False)
    ]
    if steps_after > 0:
        end = nodes[-1] + steps_after * (nodes[-1] - nodes[-2])
        legs.append(Leg(float(nodes[-1]), float(end), steps_after, None))
    return legs
