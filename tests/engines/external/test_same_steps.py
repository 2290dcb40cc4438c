"""LAMMPS, LIGGGHTS and Yade against native velocity Verlet: only round-off differs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native.plan import METHODS
from hertzchain.errors import HertzchainError
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.terms import ALL_TERMS, DAMPING
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.oracles.bounds import lasting
from tests.scenes import DAMPED, EVERY, TABLE
from validation.random_scenes import (
    pushed_within,
    random_damped_scene,
    random_scene_with_piston,
    random_scene_with_sine,
    random_scene_with_terms,
    thrown,
    with_fixed,
)

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
    *(("liggghts", "damped", name) for name in DAMPED if not name.startswith("restitution")),
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
    run = runner.simulate(legs, runner.strides(legs))
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


# Random scenes by LAMMPS, at shorter steps, by the checks of a comparison


class Random(NamedTuple):
    """Scenes of one kind: the first seed, how one is drawn, and seeds of quick and slow ones."""

    kind: int
    draw: Callable[[np.random.Generator], hc.Scene]
    quick: Sequence[int]
    slow: Sequence[int]

    def scene(self, number: int) -> hc.Scene:
        """Return a scene."""
        return self.draw(np.random.default_rng([self.kind, number]))


def changed(
    change: Callable[[np.random.Generator, hc.Scene], hc.Scene],
) -> Callable[[np.random.Generator], hc.Scene]:
    """Return how a scene with terms is drawn and changed."""
    return lambda rng: change(rng, random_scene_with_terms(rng, 30, 100.0))


RANDOM = {
    "terms": Random(
        9, lambda rng: random_scene_with_terms(rng, 200, 200.0), range(21, 27), range(100, 130)
    ),
    "moving": Random(9, changed(thrown), range(160, 162), range(162, 180)),
    "local": Random(9, changed(pushed_within), range(190, 192), range(194, 204)),
    "fixed": Random(9, changed(with_fixed), range(210, 212), range(222, 240)),
    "damped": Random(
        11, lambda rng: random_damped_scene(rng, 100, 100.0), range(91, 97), range(100, 130)
    ),
    "damped, fixed": Random(
        9375, lambda rng: with_fixed(rng, random_damped_scene(rng, 20, 60.0)), range(3), ()
    ),  # one of each law
    "piston": Random(21, lambda rng: random_scene_with_piston(rng, 30, 300.0), (), range(20)),
    "sine": Random(21, lambda rng: random_scene_with_sine(rng, 30, 300.0), (), range(20)),
}


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("kind", "number"),
    [
        *((kind, number) for kind, drawn in RANDOM.items() for number in drawn.quick),
        *(
            pytest.param(kind, number, marks=pytest.mark.slow)
            for kind, drawn in RANDOM.items()
            for number in drawn.slow
        ),
    ],
)
def test_random_scenes_at_the_same_steps(kind: str, number: int) -> None:
    """Only round-off differs, at the tolerances of ``same_steps_checks``."""
    scene = RANDOM[kind].scene(number)
    # Where elastic granules collide after a flight, peaks interpolated between readings further
    # apart are off by up to 8e-7.
    lammps = hc.Lammps(0.01 * scene.contact_time, read_every=None if scene.contact else 3)
    try:
        result = lammps.run(scene)
    except HertzchainError:
        assert kind in ("piston", "sine")  # where a refusal is honest
        return
    checks = same_steps_checks(result)
    assert len(checks) == 3  # displacement, velocity and peaks
    assert [check for check in checks if not check.passed] == []
    if kind == "damped":
        # Both are read at the same steps, so peaks differ by round-off, too: 1.1e-9 where
        # coordinates cost 1.4e-9.
        assert checks[2].measured < max(checks[0].tolerance or 0.0, 1e-9)


def test_random_scenes_have_every_term_and_law() -> None:
    """The others have scenes of their own."""
    others = {"piston", "moving granules", "fixed granules", "local shock", "near wall"}
    terms = {*ALL_TERMS} - others - {"single granule", "measured granules"}
    elastic, damped = (
        [RANDOM[kind].scene(number) for number in RANDOM[kind].quick]
        for kind in ("terms", "damped")
    )
    assert {term for scene in elastic for term in scene.terms} == terms - {"damping"}
    assert {term for scene in damped for term in scene.terms} == terms
    contacts = [scene.contact for scene in damped if scene.contact]
    assert {contact.damping for contact in contacts} == {*DAMPING}
    assert {contact.attraction for contact in contacts} == {False, True}
