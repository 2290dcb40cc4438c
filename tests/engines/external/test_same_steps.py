"""LAMMPS, LIGGGHTS and Yade against native velocity Verlet: only round-off differs."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.native.plan import METHODS
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL, paper_scene
from tests.engines.native.test_shocks import PISTONS, SINES
from tests.engines.native.test_terms import SCENES as TERMS
from tests.oracles.bounds import lasting
from validation.random_scenes import random_damped_scene

STEP = 0.02
"""Step of the runs [natural time units of the fastest contact]."""

PULSE = paper_scene("cosine-triangular", 2.0, 2.0, granules=12)

PLAIN = {
    "pulse": PULSE,
    # Jumps at its first row, and legs of different steps.
    "table": hc.Scene(
        hc.Chain(6, **STEEL), hc.PulseTable((1e-5, 3e-5, 4e-5, 7e-5), (20.0, 100.0, 60.0, 0.0))
    ),
    # A softer chain is run instead; radius, density and Poisson's ratio are no steel's.
    "weak": hc.Scene(
        hc.Chain(5, 0.02, 3e9, 0.45, 1200.0), hc.Pulse("cosine", 1e-4, 3.0, momentum_ratio=0.6)
    ),
    # The run ends within the pulse.
    "short": hc.Scene(
        hc.Chain(3, **STEEL), hc.Pulse("triangular", 50.0, 2.0, rise_time=1e-4), hc.Run(1.5e-4)
    ),
}

RESTITUTION = hc.Contact("restitution", restitution=0.8)
VISCOELASTIC = hc.Contact("viscoelastic", relaxation_time=1e-6)
DASHPOT = hc.Contact("dashpot", coefficient=5.0, attraction=True)

LAWS = {
    "restitution": (RESTITUTION, "all at once"),
    "restitution, pulling": (replace(RESTITUTION, attraction=True), "gaps"),
    "viscoelastic": (VISCOELASTIC, "dimer, elastic wall"),
    "viscoelastic, pulling": (replace(VISCOELASTIC, attraction=True), "precompression"),
    "dashpot, pulling": (DASHPOT, "column"),
}
"""All laws that LIGGGHTS has, and scenes that have every term; Yade has the first."""

DRIVES = {**PISTONS, **SINES}
DAMPED = {law: replace(TERMS[name], contact=contact) for law, (contact, name) in LAWS.items()}
DAMPED_DRIVES = {
    f"{name}, damped": replace(DRIVES[name], contact=RESTITUTION)
    for name in ("forwards and backwards", "as strong as the load")
}
ALL = PLAIN | TERMS | DAMPED | DRIVES | DAMPED_DRIVES

QUICK = {
    "lammps": {"forwards and backwards", "as strong as the load", *DAMPED_DRIVES},
    # Others have their terms, too, or their drive.
    "liggghts": ALL.keys() - DRIVES.keys() - {"large striker", "dimer", "gaps", "column"},
    "yade": {"restitution"},  # it takes seconds to start
}
RUNS = {
    "lammps": DRIVES.keys() | DAMPED_DRIVES.keys(),  # others: tests/engines/lammps
    "liggghts": ALL.keys(),
    # A piston through gaps onto a wall takes three minutes.
    "yade": ALL.keys() - (DAMPED.keys() - {"restitution"}) - (PISTONS.keys() & {"gaps, wall"}),
}
ENGINES: dict[str, Any] = {"lammps": hc.Lammps, "liggghts": hc.Liggghts, "yade": hc.Yade}


def largest(measured: FloatArray, expected: FloatArray, least: float) -> float:
    """Largest difference as a fraction of the largest value expected, or of the least scale."""
    return float(np.max(np.abs(measured - expected)) / max(np.max(np.abs(expected)), least))


def refuse_other_motion(engine: Any, scene: hc.Scene) -> None:
    """Only round-off differs from native velocity Verlet at the same steps.

    Damping takes velocities of half a step before, in all of them.
    """
    scene, unit = lasting(scene), scene.units
    # Strong dampers want shorter steps.
    dt = min(STEP * scene.contact_time, stable_step(scene, METHODS["velocity-verlet"].interval) / 2)
    # Peaks interpolated between readings further apart are off by more where elastic contacts open.
    legs, other = scene.schedule(dt), engine(dt=dt, read_every=2 if scene.contact is None else None)
    runner = other.runner(scene, Deadline(60.0))
    # One run, without those that tell its error.
    run = runner.simulate(legs, [runner.stride(leg, recording=False) for leg in legs])
    native = hc.Native("velocity-verlet", dt).run(scene)
    # Absolute coordinates: a softer chain is run where they would cost more than 1e-9.
    allowed = 1e-9 + run.round_off(scene)
    assert largest(run.displacement, native.displacement, unit.length) < allowed
    assert largest(run.velocity, native.velocity, unit.velocity) < allowed
    # Native interpolates with velocities that are no slopes of its displacements: 0.05 dt^4, 8e-9.
    # Damped contacts are looked at after the same steps.
    between = 2e-8 if scene.contact is None else 0.0
    assert largest_difference(run.peaks.force, native.peak_force) < allowed + between


@pytest.mark.parametrize(
    ("engine", "name"),
    [
        pytest.param(
            engine,
            name,
            marks=[getattr(pytest.mark, engine)] + [pytest.mark.slow] * (name not in QUICK[engine]),
        )
        for engine, names in RUNS.items()
        for name in ALL
        if name in names
    ],
)
def test_native_velocity_verlet_at_the_same_steps(engine: str, name: str) -> None:
    refuse_other_motion(ENGINES[engine], ALL[name])


def drawn(engine: type[ProgramEngine], number: int) -> hc.Scene:
    """A random scene that the engine has, of 2 to 40 granules; those of Yade are shorter."""
    most, longest_time = (20, 100.0) if engine is hc.Yade else (40, 200.0)
    rng = np.random.default_rng([19, number])
    while True:
        scene = random_damped_scene(rng, most, longest_time)
        with suppress(RunFailed):
            engine()._refuse(scene)
            return scene


NUMBERS = {"liggghts": range(120), "yade": range(200, 240)}
"""Seeds of random scenes; together they have every term."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "number"),
    [
        pytest.param(engine, number, marks=getattr(pytest.mark, engine))
        for engine, numbers in NUMBERS.items()
        for number in numbers
    ],
)
def test_random_damped_scenes_at_the_same_steps(engine: str, number: int) -> None:
    refuse_other_motion(ENGINES[engine], drawn(ENGINES[engine], number))
