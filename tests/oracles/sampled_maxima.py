"""Peaks in samples of native velocity Verlet, which decks on LAMMPS have to find."""

from __future__ import annotations

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.decks.known_answer import looks_at_damped
from hertzchain.engines.native.methods import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.observables.history import Recorder


def sampled_maxima(scene: hc.Scene, step: float, watch_every: int) -> FloatArray:
    """Largest contact forces over F0 at every so many steps of native velocity Verlet.

    The step is in natural time units; shape (contacts,), that on a wall the last.
    """
    legs = scene.schedule(step * scene.units.time)
    if scene.contact is not None:
        return np.asarray(looks_at_damped(scene, legs, 1, watch_every)[0])
    every = [leg.start + leg.dt * np.arange(leg.steps) for leg in legs]
    times = np.append(np.concatenate(every), legs[-1].end)[::watch_every]
    recorder = Recorder(times / scene.units.time, scene.chain.granules, scene.wall is not None)
    simulate(scene, legs, METHODS["velocity-verlet"].walker, recorder)
    return np.asarray(recorder.contact_force.max(axis=0))
