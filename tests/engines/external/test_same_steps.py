"""LAMMPS, LIGGGHTS and Yade against native velocity Verlet: only round-off differs."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
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
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.oracles.bounds import lasting
from tests.scenes import DAMPED, EVERY, TABLE
from validation.random_scenes import random_damped_scene

STEP = 0.02
"""Step of the runs [natural time units of the fastest contact]."""

BY_PROGRAMS = ("plain", "terms", "damped", "piston", "sine", "drives, damped")
"""Kinds of scenes that LIGGGHTS and Yade have."""

KINDS = {
    "lammps": tuple(kind for kind in TABLE if kind != "near wall"),
    "lammps, history": ("plain",),
    "liggghts": BY_PROGRAMS,
    "yade": BY_PROGRAMS,
}
QUICK = {
    "lammps, history": {each for each in EVERY if each[0] == "plain"},
    "lammps": {
        *(("piston", "forwards and backwards"), ("sine", "as strong as the load")),
        *(each for each in EVERY if each[0] in ("plain", "drives, damped", "fixed")),
        *(("local", "free"), ("local", "damped"), ("terms", "all at once")),
    },
    # Others have their terms, too, or their drive.
    "liggghts": {each for each in EVERY if each[0] not in ("piston", "sine")}
    - {("terms", name) for name in ("large striker", "dimer", "gaps", "column")},
    "yade": {("damped", "restitution")},  # it takes seconds to start
}
LEFT_OUT = {
    # It has one damping; a piston through gaps onto a wall takes three minutes.
    *(("yade", "damped", name) for name in DAMPED if name != "restitution"),
    ("yade", "piston", "gaps, wall"),
}
ENGINES: dict[str, Any] = {
    "lammps": hc.Lammps,
    "lammps, history": partial(hc.Lammps, pair_style="gran/hertz/history"),
    "liggghts": hc.Liggghts,
    "yade": hc.Yade,
}


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
    # Native interpolates with velocities that are not slopes of its displacements: 0.05 dt^4, 8e-9.
    # Damped contacts are looked at after the same steps.
    between = 2e-8 if scene.contact is None else 0.0
    assert largest_difference(run.peaks.force, native.peak_force) < allowed + between


@pytest.mark.parametrize(
    ("engine", "kind", "name"),
    [
        pytest.param(
            *(engine, kind, name),
            marks=[getattr(pytest.mark, engine.partition(",")[0])]
            + [pytest.mark.slow] * ((kind, name) not in QUICK[engine]),
        )
        for engine, kinds in KINDS.items()
        for kind, name in EVERY
        if kind in kinds and (engine, kind, name) not in LEFT_OUT
    ],
)
def test_native_velocity_verlet_at_the_same_steps(engine: str, kind: str, name: str) -> None:
    refuse_other_motion(ENGINES[engine], TABLE[kind][name])


@pytest.mark.lammps
@pytest.mark.parametrize("name", TABLE["near wall"])
def test_a_near_wall_at_the_same_steps(name: str) -> None:
    """The deck has it as a granule more: the results are compared, without it."""
    walled = TABLE["near wall"][name]
    dt = STEP * walled.contact_time
    result = hc.Lammps(dt=dt, wanted="all").run(walled)
    other = hc.Native("velocity-verlet", dt=dt, wanted="all").run(walled)
    assert all(check.passed for check in [*same_steps_checks(result), *balance_checks(result)])
    # Round-off, and what lies between readings: measured 5e-8; behind a pulse 6e-11 N.
    assert result.peak_force == pytest.approx(other.peak_force, rel=1e-7, abs=1e-9)


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
