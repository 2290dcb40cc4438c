"""Scenes with terms by LAMMPS, LIGGGHTS and Yade: results, accuracy, decks, drives, refusals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines import liggghts, yade
from hertzchain.engines.lammps import deck as lammps_deck
from hertzchain.errors import RunFailed
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.conftest import STEEL
from tests.scenes import (
    DAMPED,
    DASHPOT,
    LAWS,
    PISTONS,
    PULLING,
    PULSE,
    RESTITUTION,
    RIGID,
    SINES,
    TERMS,
    VISCOELASTIC,
    load,
)
from validation.random_scenes import random_damped_scene, with_wall_of_its_own

COMPUTED = {law: DAMPED[law] for law in ("restitution", "viscoelastic")}
WRITTEN = {**TERMS, **COMPUTED, "plain": load("demo")}


@pytest.mark.parametrize("name", WRITTEN)
def test_decks_have_no_mass_no_stiffness_and_no_damping_computed_here(name: str) -> None:
    """Any of them would hide a mistake."""
    scene = WRITTEN[name]
    legs, each = scene.schedule(0.1 * scene.contact_time), scene.granules
    strides = [1] * len(legs)
    decks = [lammps_deck.set_up(scene)]
    if name != "viscoelastic":  # which the others do not have
        decks += [code.watched(scene, legs, strides) for code in (liggghts, yade)]
    computed = [each.stiffness, each.mass, *([] if each.damping is None else [each.damping])]
    for text in decks:
        assert scene.is_plain or all(repr(x) in text for x in each.position.tolist())
        for value in set(np.concatenate(computed).tolist()):
            assert f"{value:.6g}"[:6] not in text


@dataclass(frozen=True)
class Plain(hc.Liggghts):
    """An engine that can have no terms."""

    TERMS: ClassVar[tuple[str, ...]] = ()


def struck(granules: int, **terms: Any) -> hc.Scene:
    """A chain of steel that is struck; ``terms`` are of the scene, or else of the granules."""
    of_scene = {name: terms.pop(name) for name in ("wall", "contact") if name in terms}
    return hc.Scene(hc.Chain(granules, **STEEL | terms), hc.Striker(1.0), **of_scene)


HISTORY = partial(lammps_deck.set_up, pair_style="gran/hertz/history")
OF_ONE_LAW = r"^pair style gran/hertz/history has one law for all contacts"
LONG, RADII = struck(100_001), np.linspace(4e-3, 5e-3, 101)
SMALL = hc.Contact("restitution", restitution=0.05)
OWN_DAMPING = struck(3, wall=hc.Wall("rigid", restitution=0.5), contact=RESTITUTION)
ONE_DAMPING = "gets one damping for all contacts: take a wall without restitution"
REFUSED: list[tuple[Callable[[hc.Scene], object], hc.Scene, str]] = [
    *(
        (Plain(program="no-such").refuse, scene, f"does not support {', '.join(scene.terms)}")
        for scene in TERMS.values()
    ),
    (HISTORY, struck(3, poisson_ratio=[0.3, 0.3, 0.2]), OF_ONE_LAW),
    (HISTORY, hc.Scene(hc.Chain(3, **STEEL), PULSE, near_wall=RIGID), OF_ONE_LAW),
    (HISTORY, struck(3, contact=VISCOELASTIC), OF_ONE_LAW),
    (HISTORY, hc.Scene(hc.Chain(3, 4e-3, density=8e3, stiffness=1e9), PULSE), OF_ONE_LAW),
    (partial(lammps_deck.set_up, version="20240828"), struck(2, contact=RESTITUTION),
     "LAMMPS of 20240828 cannot run this scene with its restitution: take LAMMPS of 29 Aug 2024"),
    (partial(lammps_deck.set_up, version="20210928"), struck(2, contact=VISCOELASTIC),
     "take LAMMPS of 29 Sep 2021 or later"),
    (lammps_deck.set_up, struck(101, radius=RADII, contact=VISCOELASTIC),
     "101 kinds, and with viscoelastic damping"),
    (liggghts.set_up, struck(101, young_modulus=np.linspace(193e9, 194e9, 101)),
     "of 101 materials, a LIGGGHTS deck has at most 100"),
    (lammps_deck.set_up, LONG, "LAMMPS deck of 100001 granules would be too long"),
    (liggghts.set_up, LONG, "LIGGGHTS deck of 100001 granules would be too long"),
    (lambda scene: yade.watched(scene, [], []), LONG, "Yade with 100001 granules would be too"),
    (hc.Liggghts().refuse, struck(2, poisson_ratio=[0.3, -0.1]), "this chain has -0.1"),
    (hc.Liggghts().refuse, struck(2, wall=hc.Wall("elastic", 1e9, -0.2)), "this wall has -0.2"),
    *(
        (code.refuse, struck(2, contact=law), f"a {code.LABEL} deck has no {law.damping} damping")
        for code in (hc.Liggghts(), hc.Yade())
        for law in (DASHPOT, VISCOELASTIC)
    ),
    (hc.Liggghts().refuse, struck(2, contact=SMALL),
     "restitution above 0.05, this one is 0.05: take another"),
    (hc.Yade().refuse, struck(2, contact=PULLING), "never pull in Yade: leave out attraction"),
    (hc.Liggghts().refuse, OWN_DAMPING, ONE_DAMPING),
    (hc.Yade().refuse, OWN_DAMPING, ONE_DAMPING),
]  # fmt: skip


@pytest.mark.parametrize(("refuse", "scene", "words"), REFUSED, ids=[row[2] for row in REFUSED])
def test_what_a_code_does_not_have_is_refused(
    refuse: Callable[[hc.Scene], object], scene: hc.Scene, words: str
) -> None:
    with pytest.raises(RunFailed, match=words) as caught:
        refuse(scene)
    assert "\n" not in str(caught.value)


def test_what_a_code_has_is_not_refused() -> None:
    above = replace(SMALL, restitution=math.nextafter(0.05, 1))
    for law in (None, RESTITUTION, PULLING, above):
        hc.Liggghts().refuse(struck(2, contact=law, poisson_ratio=0.0))
    for law in (None, RESTITUTION):
        hc.Yade().refuse(struck(2, contact=law))
    for law, since in ((RESTITUTION, "20240829"), (VISCOELASTIC, "20210929")):
        lammps_deck.set_up(struck(2, contact=law), version=since)
    many = struck(100, radius=RADII[:100], contact=VISCOELASTIC)
    assert "pair_coeff 100 100 " in lammps_deck.set_up(many)
    # Other laws do not depend on the mass.
    dashpots = struck(101, radius=RADII, contact=DASHPOT)
    assert "pair_coeff 2 2 " not in lammps_deck.set_up(dashpots)


@pytest.mark.parametrize("attraction", [False, True])
def test_contacts_pull_only_where_they_may(attraction: bool) -> None:
    law = replace(DASHPOT, attraction=attraction)
    text = lammps_deck.set_up(struck(3, wall=hc.Wall("same"), contact=law))
    assert text.count("damping velocity") == 2  # of the pair and of the wall
    assert text.count("limit_damping") == (0 if attraction else 2)


# Results


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name", [pytest.param("column", marks=pytest.mark.slow), "above the cut-off, wall"]
)
def test_comparisons(name: str) -> None:
    compared = hc.compare((PISTONS | SINES)[name])
    assert [check for check in compared.checks if not check.passed] == []
    assert compared.verdict == "pass"


@pytest.mark.lammps
@pytest.mark.parametrize("name", ["large striker", "striker, rigid wall", "gaps, wall"])
def test_a_pair_style_with_one_law_for_all_pairs_gives_the_same(name: str) -> None:
    scene = TERMS[name]
    closed, granular = (
        hc.Lammps(0.01 * scene.contact_time, style).run(scene)
        for style in ("gran/hertz/history", "granular")
    )
    # Both compute one law; roundings differ.
    assert closed.peak_force == pytest.approx(granular.peak_force, rel=1e-11, abs=0)


@pytest.mark.lammps
def test_roundings_of_a_flight_add_up() -> None:
    """All roundings of granules in free flight have one sign: more than random ones add up to."""
    scene = hc.Scene(hc.Chain(5, **STEEL, velocity=0.7), wall=hc.Wall("rigid", gap=3e-3))
    checks = same_steps_checks(hc.Lammps(dt=0.002 * scene.contact_time).run(scene))
    assert [check for check in checks if not check.passed] == []


@pytest.mark.lammps
@pytest.mark.parametrize("number", [22, 32, 41])  # one of each law
def test_walls_with_damping_of_their_own(number: int) -> None:
    """Only of the scene itself are the motion and the peaks of a run."""
    rng = np.random.default_rng([39, number])
    scene = with_wall_of_its_own(rng, random_damped_scene(rng, 12, 200.0))
    scene = replace(scene, run=hc.Run(scene.end_time))
    result = hc.Lammps(0.01 * scene.contact_time).run(scene)
    assert all(check.passed for check in same_steps_checks(result))
    mistaken = replace(scene, wall=scene.wall and scene.wall.damped(None))
    assert not all(check.passed for check in same_steps_checks(replace(result, scene=mistaken)))


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


@pytest.mark.lammps
@pytest.mark.slow
@pytest.mark.parametrize("number", [7, 75, 78, 109, 125, *range(200, 210)])
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
    result = hc.Lammps(dt=0.01 * scene.contact_time).run(scene)
    assert result.error_estimate > 1
    *pulses, warning = result.warnings
    assert "repeated collisions amplify errors, but not those of first pulses" in warning
    assert all("with other steps it is another" in pulse for pulse in pulses)
