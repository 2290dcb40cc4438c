"""Peaks in samples of native velocity Verlet, which decks on LAMMPS have to find."""

from __future__ import annotations

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.plan import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.known.answer import looks_at_damped
from hertzchain.observables.samples import Recorder
from tests.oracles.in_numpy import integrate


def sampled_maxima(scene: hc.Scene, step: float, watch_every: int) -> FloatArray:
    """Largest contact forces over F0 at every so many steps of native velocity Verlet.

    The step is in natural time units; shape (contacts,), that on a wall the last.
    """
    units, granules = scene.units, scene.chain.granules
    if not scene.is_plain:
        return _sampled_with_terms(scene, step, watch_every)
    largest, done = np.zeros(granules - 1), 0

    legs = [leg.in_units(units.time, units.force) for leg in scene.schedule(step * units.time)]
    walker, start = METHODS["velocity-verlet"].walker, np.zeros((2, granules))
    for _, samples in integrate(Chain.plain(granules), legs, walker, start):
        at = np.arange(done, done + samples.time.size) % watch_every == 0
        np.maximum(largest, samples.contact_force[at].max(axis=0, initial=0.0), out=largest)
        done += samples.time.size - 1
    return largest


def _sampled_with_terms(scene: hc.Scene, step: float, watch_every: int) -> FloatArray:
    """``sampled_maxima`` by the compiled kernels, which have terms, recorded at its steps."""
    legs = scene.schedule(step * scene.units.time)
    if scene.contact is not None:
        return np.asarray(looks_at_damped(scene, legs, 1, watch_every)[0])
    every = [leg.start + leg.dt * np.arange(leg.steps) for leg in legs]
    times = np.append(np.concatenate(every), legs[-1].end)[::watch_every]
    recorder = Recorder(times / scene.units.time, scene.chain.granules, scene.wall is not None)
    simulate(scene, legs, METHODS["velocity-verlet"].walker, recorder)
    return np.asarray(recorder.contact_force.max(axis=0))
