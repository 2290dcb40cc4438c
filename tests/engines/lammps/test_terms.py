"""Scenes with all terms by LAMMPS: native velocity Verlet at the same steps, and accuracy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.deck import set_up
from hertzchain.errors import RunFailed
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.conftest import STEEL
from tests.scenes import LAWS, PULSE
from validation.random_scenes import (
    random_damped_scene,
    with_wall_of_its_own,
)

STEP = 0.01
"""Step of all runs [natural time units of the fastest contact]; tolerances are for this step."""


@pytest.mark.lammps
def test_roundings_of_a_flight_add_up() -> None:
    """All roundings of granules in free flight have one sign: more than random ones add up to."""
    chain = hc.Chain(5, **STEEL, velocity=0.7)
    scene = hc.Scene(chain, wall=hc.Wall("rigid", gap=3e-3))
    checks = same_steps_checks(hc.Lammps(dt=0.002 * scene.contact_time).run(scene))
    assert [check for check in checks if not check.passed] == []


THREE = hc.Chain(3, **STEEL)
WALL = hc.Wall("rigid")

ONE_TERM = {
    "unlike granules": hc.Scene(replace(THREE, density=[1e3, 2e3, 3e3]), PULSE),
    "gaps": hc.Scene(replace(THREE, gap=1e-6), PULSE),
    "striker": hc.Scene(THREE, hc.Striker(1.0)),
    "piston": hc.Scene(THREE, hc.Piston(1.0)),
    "local shock": hc.Scene(THREE, replace(PULSE, granule=2)),
    "moving granules": hc.Scene(replace(THREE, velocity=[0.0, 1.0, 0.0])),
    "fixed granules": hc.Scene(replace(THREE, fixed=[False, False, True]), PULSE),
    "wall": hc.Scene(THREE, PULSE, wall=WALL),
    "precompression": hc.Scene(THREE, PULSE, precompression=hc.Precompression(1.0)),
    "gravity": hc.Scene(THREE, PULSE, hc.Run(), WALL, hc.Precompression(gravity=9.81)),
}


ONE_LAW = ONE_TERM | {"large striker": hc.Scene(THREE, hc.Striker(1.0, radius=8e-3))}


@pytest.mark.lammps
@pytest.mark.parametrize("name", ONE_LAW)
def test_a_pair_style_with_one_law_for_all_pairs_gives_the_same(name: str) -> None:
    scene = ONE_LAW[name]
    closed, granular = (
        hc.Lammps(0.01 * scene.contact_time, style).run(scene)
        for style in ("gran/hertz/history", "granular")
    )
    # Both compute one law; roundings differ.
    assert closed.peak_force == pytest.approx(granular.peak_force, rel=1e-11, abs=0)


@pytest.mark.parametrize(
    "other",
    [
        {"chain": replace(THREE, poisson_ratio=[0.3, 0.3, 0.2])},
        {"near_wall": WALL},
        {"contact": LAWS["viscoelastic"]},
        {"chain": hc.Chain(3, radius=4e-3, density=8e3, stiffness=1e9)},
    ],
    ids=["materials", "near wall", "damping", "measured"],
)
def test_a_pair_style_with_one_law_is_refused_where_there_are_two(other: dict[str, Any]) -> None:
    scene = replace(ONE_TERM["gaps"], **other)
    with pytest.raises(RunFailed, match=r"^pair style gran/hertz/history has one law for all"):
        set_up(scene, "gran/hertz/history")


def refuse_another(scene: hc.Scene, **other: Any) -> None:
    """Only of the scene itself are the motion and the peaks of a run."""
    run = hc.Run(scene.end_time)  # the same for both, so that they differ by the term alone
    result = hc.Lammps(STEP * scene.contact_time).run(replace(scene, run=run))
    assert all(check.passed for check in same_steps_checks(result))
    mistaken = replace(result, scene=replace(scene, run=run, **other))
    assert not all(check.passed for check in same_steps_checks(mistaken))


@pytest.mark.lammps
@pytest.mark.parametrize("number", [22, 32, 41])  # one of each law
def test_walls_with_damping_of_their_own(number: int) -> None:
    rng = np.random.default_rng([39, number])
    scene = with_wall_of_its_own(rng, random_damped_scene(rng, 12, 200.0))
    refuse_another(scene, wall=scene.wall and scene.wall.damped(None))


ONE_EACH = {
    "restitution": hc.Scene(
        hc.Chain(3, **STEEL), PULSE, wall=hc.Wall("same"), contact=LAWS["restitution"]
    ),
    "viscoelastic": hc.Scene(
        hc.Chain(3, **STEEL | {"radius": [4e-3, 5e-3, 6e-3]}), PULSE, contact=LAWS["viscoelastic"]
    ),
    "dashpot": hc.Scene(
        hc.Chain(6, gap=2e-6, **STEEL),
        hc.Striker(1.0),
        wall=hc.Wall("same"),
        contact=LAWS["dashpot"],
    ),
}


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("law", "extrapolated"),
    [
        *(("restitution", False), ("viscoelastic", True)),
        *(("dashpot", False), ("restitution, pulling", True)),
    ],
)
def test_peaks_are_as_right_as_asked(law: str, extrapolated: bool) -> None:
    scene = hc.Scene(hc.Chain(6, **STEEL), PULSE, contact=LAWS[law])
    rtol = 1e-5 if extrapolated else 1e-3
    lammps = hc.Lammps(rtol=rtol, extrapolated=extrapolated)
    result, exact = lammps.run(scene), hc.Native(rtol=1e-9).run(scene)
    error = largest_difference(result.peak_force, exact.peak_force)
    assert error <= result.error_estimate <= rtol
    assert [check for check in balance_checks(result) if not check.passed] == []
    assert result.balance.dissipated > 0


@pytest.mark.parametrize(
    ("law", "before", "since", "named"),
    [
        (LAWS["restitution"], "20240828", "20240829", "29 Aug 2024"),
        (LAWS["viscoelastic"], "20210928", "20210929", "29 Sep 2021"),
    ],
)
def test_a_lammps_that_is_too_old_is_refused(
    law: hc.Contact, before: str, since: str, named: str
) -> None:
    scene = hc.Scene(hc.Chain(2, **STEEL), hc.Striker(1.0), wall=hc.Wall("same"), contact=law)
    set_up(scene, version=since)
    with pytest.raises(RunFailed, match=rf"LAMMPS of {before} cannot .* of {named} or later"):
        set_up(scene, version=before)


def test_too_many_kinds_of_granules_for_viscoelastic_damping() -> None:
    radius = np.linspace(4e-3, 5e-3, 101)
    shock, law = hc.Striker(1.0), LAWS["viscoelastic"]
    scenes = [
        hc.Scene(hc.Chain(n, **STEEL | {"radius": radius[:n]}), shock, contact=law)
        for n in (100, 101)
    ]
    assert "pair_coeff 100 100 " in set_up(scenes[0])
    with pytest.raises(RunFailed, match="101 kinds, and with viscoelastic damping"):
        set_up(scenes[1])
    assert "pair_coeff 2 2 " not in set_up(replace(scenes[1], contact=LAWS["dashpot"]))


@pytest.mark.parametrize("attraction", [False, True])
def test_contacts_pull_only_where_they_may(attraction: bool) -> None:
    law = replace(LAWS["dashpot"], attraction=attraction)
    text = set_up(replace(ONE_EACH["restitution"], contact=law))
    assert text.count("damping velocity") == 2  # of the pair and of the wall
    assert text.count("limit_damping") == (0 if attraction else 2)


@pytest.mark.lammps
@pytest.mark.slow
@pytest.mark.parametrize("number", [7, 75, 78, 109, 125, *range(200, 220)])
def test_error_estimates_of_extrapolations_are_bounds(number: int) -> None:
    """The first were above it when three runs told the error, or dashpots counted as smooth."""
    scene = random_damped_scene(np.random.default_rng([91, number]), 30, 80.0)
    reference = hc.Native(rtol=1e-8).run(scene)
    result = hc.Lammps(dt=1e-3 * scene.contact_time, extrapolated=True).run(scene)
    error = largest_difference(result.peak_force, reference.peak_force)
    assert error <= result.error_estimate + reference.error_estimate


@pytest.mark.lammps
@pytest.mark.slow
def test_collisions_that_leave_peaks_no_digit_are_said() -> None:
    """First pulses are right all the same, so that there is a result."""
    scene = random_damped_scene(np.random.default_rng([11, 109]), 100, 500.0)
    result = hc.Lammps(dt=STEP * scene.contact_time).run(scene)
    assert result.error_estimate > 1
    *pulses, warning = result.warnings
    assert "repeated collisions amplify errors, but not those of first pulses" in warning
    assert all("with other steps it is another" in pulse for pulse in pulses)
