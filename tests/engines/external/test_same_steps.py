"""LAMMPS, LIGGGHTS and Yade against native velocity Verlet: only round-off differs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.native.plan import METHODS
from hertzchain.errors import HertzchainError, OverlapTooLarge, RunFailed, Unpredictable
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


# Random scenes by LAMMPS, at shorter steps, by the checks of a comparison


class Random(NamedTuple):
    """Scenes of one kind: how one is drawn, and the numbers of the quick and the slow ones."""

    draw: Callable[[int], hc.Scene]
    quick: Sequence[int]
    slow: Sequence[int]


QUICK_TERMS, QUICK_DAMPED = range(21, 27), range(91, 97)
AMPLIFIED = (109, 153)
"""Damped scenes whose collisions amplify rounding errors to the size of the peaks."""


def _terms(number: int) -> hc.Scene:
    longest_time = 200.0 if number in QUICK_TERMS else 1000.0
    return random_scene_with_terms(np.random.default_rng([9, number]), 200, longest_time)


def _changed(change: Callable[[np.random.Generator, hc.Scene], hc.Scene], number: int) -> hc.Scene:
    rng = np.random.default_rng([9, number])
    return change(rng, random_scene_with_terms(rng, 30, 100.0))


def _damped(number: int) -> hc.Scene:
    longest_time = 100.0 if number in QUICK_DAMPED else 500.0
    return random_damped_scene(np.random.default_rng([11, number]), 100, longest_time)


def _damped_fixed(number: int) -> hc.Scene:
    rng = np.random.default_rng([9375, number])
    return with_fixed(rng, random_damped_scene(rng, 20, 60.0))


def _driven(draw: Callable[..., hc.Scene], number: int) -> hc.Scene:
    return draw(np.random.default_rng([21, number]), 30, 300.0)


RANDOM = {
    "terms": Random(_terms, QUICK_TERMS, range(100, 160)),
    "moving": Random(partial(_changed, thrown), range(160, 162), range(162, 190)),
    "local": Random(partial(_changed, pushed_within), range(190, 192), range(192, 210)),
    "fixed": Random(partial(_changed, with_fixed), range(210, 212), range(212, 240)),
    "damped": Random(_damped, QUICK_DAMPED, sorted({*range(100, 160)} - {*AMPLIFIED})),
    "damped, fixed": Random(_damped_fixed, range(3), ()),  # one of each law
    "piston": Random(partial(_driven, random_scene_with_piston), (), range(20)),
    "sine": Random(partial(_driven, random_scene_with_sine), (), range(20)),
}
REFUSED = dict.fromkeys((("terms", 130), ("local", 193), ("local", 205)), "resolve the overlaps")
REFUSED["fixed", 221] = "push granules through one another"
"""Scenes whose overlaps are lost in the coordinates, so that LAMMPS refuses them, or in which a
heavy striker crushes small granules."""


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
    scene = RANDOM[kind].draw(number)
    # Where elastic granules collide after a flight, peaks interpolated between readings further
    # apart are off by up to 8e-7.
    lammps = hc.Lammps(0.01 * scene.contact_time, read_every=None if scene.contact else 3)
    if (kind, number) in REFUSED:
        with pytest.raises((Unpredictable, OverlapTooLarge), match=REFUSED[kind, number]):
            lammps.run(scene)
        return
    try:
        result = lammps.run(scene)
    except HertzchainError:
        assert kind in ("piston", "sine")  # where a refusal is honest
        return
    checks = same_steps_checks(result)
    assert len(checks) == 3  # displacement, velocity and peaks
    assert [check for check in checks if not check.passed] == []
    if kind == "damped":
        # Both are read at the same steps, so peaks differ by round-off, too.
        measured, state = checks[2].measured, checks[0].tolerance
        # 1.1e-9 where coordinates cost 1.4e-9; 2.5 times what states may differ by in scene 157.
        assert measured < max((3 if number == 157 else 1) * state, 1e-9)


def test_random_scenes_have_every_term_and_law() -> None:
    """The others have scenes of their own."""
    others = {"piston", "moving granules", "fixed granules", "local shock", "near wall"}
    terms = {*ALL_TERMS} - others - {"single granule", "measured granules"}
    for part in ("quick", "slow"):
        of_terms, scenes = (
            [RANDOM[kind].draw(number) for number in getattr(RANDOM[kind], part)]
            for kind in ("terms", "damped")
        )
        assert {term for scene in of_terms for term in scene.terms} == terms - {"damping"}
        assert {term for scene in scenes for term in scene.terms} == terms
        contacts = [scene.contact for scene in scenes if scene.contact]
        assert {contact.damping for contact in contacts} == {*DAMPING}
        assert {contact.attraction for contact in contacts} == {False, True}
