"""Random scenes that mix all terms: LAMMPS against native velocity Verlet at the same steps."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import OverlapTooLarge, RunFailed, Unpredictable
from hertzchain.scene.terms import ALL_TERMS
from hertzchain.verdict.run_checks import same_steps_checks
from tests.conftest import STEEL
from validation.random_scenes import pushed_within, random_scene_with_terms, thrown, with_fixed

pytestmark = pytest.mark.lammps

STEP = 0.01
"""Step of all runs [natural time units of the fastest contact]; tolerances are for this step."""

READ_EVERY = 3
"""Steps: where granules collide after a flight, peaks interpolated between readings further apart
are off by up to 8e-7, more than round-off."""

QUICK, SLOW, MOVING, LOCAL = range(21, 27), range(100, 160), range(160, 190), range(190, 210)
FIXED = range(210, 240)
"""Numbers of random scenes; in the last three granules move at the start, any may be pushed, or
some are fixed."""

REFUSED = dict.fromkeys((130, 193, 205), "cannot resolve the overlaps")
REFUSED[221] = "push granules through one another"
"""Scenes whose overlaps are lost in the coordinates, so that LAMMPS refuses them, or in which a
heavy striker crushes small granules."""


def drawn(number: int) -> hc.Scene:
    """A random scene of 2 to 200 granules; the quick ones are short."""
    rng = np.random.default_rng([9, number])
    if number in MOVING:
        return thrown(rng, random_scene_with_terms(rng, 30, 100.0))
    if number in LOCAL:
        return pushed_within(rng, random_scene_with_terms(rng, 30, 100.0))
    if number in FIXED:
        return with_fixed(rng, random_scene_with_terms(rng, 30, 100.0))
    return random_scene_with_terms(rng, 200, 200.0 if number in QUICK else 1000.0)


@pytest.mark.parametrize(
    "number",
    [
        *(*QUICK, *MOVING[:2], *LOCAL[:2], *FIXED[:2]),
        *(
            pytest.param(number, marks=pytest.mark.slow)
            for number in (*SLOW, *MOVING[2:], *LOCAL[2:], *FIXED[2:])
        ),
    ],
)
def test_same_scheme_same_steps(number: int) -> None:
    """Only round-off differs, at the tolerances of ``same_steps_checks``."""
    scene = drawn(number)
    lammps = hc.Lammps(dt=STEP * scene.contact_time, read_every=READ_EVERY)
    if number in REFUSED:
        with pytest.raises((Unpredictable, OverlapTooLarge), match=REFUSED[number]):
            lammps.run(scene)
        return
    result = lammps.run(scene)
    checks = same_steps_checks(result)
    assert len(checks) == 3  # displacement, velocity and peaks
    for check in checks:
        assert check.passed, check


@pytest.mark.parametrize("wall", [None, hc.Wall("rigid")], ids=str)
def test_a_load_behind_a_free_striker(wall: hc.Wall | None) -> None:
    scene = hc.Scene(UNIFORM, hc.Striker(0.5), wall=wall, precompression=hc.Precompression(20.0))
    result = hc.Lammps(dt=STEP * scene.contact_time).run(scene)
    assert [check for check in same_steps_checks(result) if not check.passed] == []


def test_roundings_of_a_flight_add_up() -> None:
    """All roundings of granules in free flight have one sign: more than random ones add up to."""
    chain = hc.Chain(5, **STEEL, velocity=0.7)
    scene = hc.Scene(chain, wall=hc.Wall("rigid", gap=3e-3))
    checks = same_steps_checks(hc.Lammps(dt=0.002 * scene.contact_time).run(scene))
    assert [check for check in checks if not check.passed] == []


@pytest.mark.parametrize("numbers", [QUICK, SLOW])
def test_random_scenes_have_every_term(numbers: range) -> None:
    count = Counter(term for number in numbers for term in drawn(number).terms)
    # Pistons and damping are elsewhere: external/test_same_steps.py, test_damped.py.
    others = {"piston", "damping", "moving granules", "fixed granules", "local shock", "near wall"}
    assert set(count) == set(ALL_TERMS) - others


UNIFORM = hc.Chain(3, **STEEL)
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
WALL = hc.Wall("rigid")

ONE_TERM = {
    "unlike granules": hc.Scene(replace(UNIFORM, density=[1e3, 2e3, 3e3]), PULSE),
    "gaps": hc.Scene(replace(UNIFORM, gap=1e-6), PULSE),
    "striker": hc.Scene(UNIFORM, hc.Striker(1.0)),
    "piston": hc.Scene(UNIFORM, hc.Piston(1.0)),
    "local shock": hc.Scene(UNIFORM, replace(PULSE, granule=2)),
    "moving granules": hc.Scene(replace(UNIFORM, velocity=[0.0, 1.0, 0.0])),
    "fixed granules": hc.Scene(replace(UNIFORM, fixed=[False, False, True]), PULSE),
    "wall": hc.Scene(UNIFORM, PULSE, wall=WALL),
    "precompression": hc.Scene(UNIFORM, PULSE, precompression=hc.Precompression(1.0)),
    "gravity": hc.Scene(UNIFORM, PULSE, hc.Run(), WALL, hc.Precompression(gravity=9.81)),
}


@pytest.mark.parametrize("term", ONE_TERM)
def test_another_pair_style_is_refused(term: str) -> None:
    scene = ONE_TERM[term]
    assert term in scene.terms
    lammps = hc.Lammps(0.01 * scene.contact_time, "gran/hertz/history")
    named = " and ".join(scene.terms)
    said = f"one stiffness for all contacts: take granular for a scene with {named}$"
    with pytest.raises(RunFailed, match=said):
        lammps.run(scene)


@pytest.mark.parametrize("term", ONE_TERM)
def test_a_term_that_is_off_by_a_millionth_shows(term: str) -> None:
    scene, more = ONE_TERM[term], 1 + 1e-6
    chain, loads = scene.chain, scene.precompression
    heavy = [*[STEEL["density"]] * 2, 1e6 * STEEL["density"]]
    other: Any = {
        "unlike granules": {"chain": replace(chain, density=[1e3, 2e3 * more, 3e3])},
        "gaps": {"chain": replace(chain, gap=1e-6 * more)},
        "striker": {"shock": hc.Striker(1.0 * more)},
        "piston": {"shock": hc.Piston(1.0 * more)},
        "local shock": {"shock": replace(PULSE, peak_force=100.0 * more, granule=2)},
        "moving granules": {"chain": replace(chain, velocity=[0.0, 1.0 * more, 0.0])},
        "fixed granules": {"chain": replace(chain, density=heavy, fixed=False)},
        "wall": {"wall": hc.Wall("elastic", 1e6 * STEEL["young_modulus"], STEEL["poisson_ratio"])},
        "precompression": {"precompression": hc.Precompression(1.0 * more)},
        "gravity": {"precompression": loads and hc.Precompression(gravity=9.81 * more)},
    }[term]
    run = hc.Run(scene.end_time)  # the same for both, so that they differ by the term alone
    result = hc.Lammps(STEP * scene.contact_time).run(replace(scene, run=run))
    assert all(check.passed for check in same_steps_checks(result))
    mistaken = replace(result, scene=replace(scene, run=run, **other))
    assert not all(check.passed for check in same_steps_checks(mistaken))
