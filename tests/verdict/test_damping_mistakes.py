"""Peaks of chains that are damped otherwise than they should be, and the damping that is named."""

from __future__ import annotations

import math
import re
from contextlib import nullcontext
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.damping import tsuji
from hertzchain.limits import Deadline
from hertzchain.theory.restitution import damping_ratio, of_ratio
from hertzchain.verdict.case import Case, Mistake
from hertzchain.verdict.damping_mistakes import contact_of, damping, in_words
from hertzchain.verdict.mistakes import families_for
from tests.conftest import STEEL, paper_scene
from validation.mistakes_in_damping import (
    DASHPOT_LAW,
    MISTAKES_IN_DAMPING,
    RESTITUTION_LAW,
    TOLERANCE,
    VISCOELASTIC_LAW,
    DampingMistake,
    by_collision,
)

ELASTIC = paper_scene("cosine", 0.5, 2.0, 16)

ASKED = {
    "restitution": hc.Contact("restitution", restitution=0.8),
    "viscoelastic": hc.Contact("viscoelastic", relaxation_time=1e-6),
    "dashpot": hc.Contact("dashpot", coefficient=3.0),
}


def peaks_of(scene: hc.Scene) -> FloatArray:
    return hc.Native(rtol=1e-7).run(scene).peak_force


def with_ratio(factor: float) -> hc.Scene:
    """A restitution of 0.8 whose coefficient is off by a factor."""
    e = of_ratio(factor * damping_ratio(0.8), pulls=True)
    return replace(ELASTIC, contact=hc.Contact("restitution", restitution=e))


def pulling(law: str) -> hc.Contact:
    return replace(ASKED[law], attraction=True)


ROOT_2, SHORT = with_ratio(math.sqrt(2)).contact, "damping of restitution 0.8"
RELAXED = hc.Contact("viscoelastic", relaxation_time=1e-6 / 1.5)
ALPHA = math.sqrt(5) * damping_ratio(0.8)
ASKED_AND_MADE: list[tuple[hc.Contact | None, hc.Contact | None, str]] = [
    (None, hc.Contact("restitution", restitution=0.9), "damping of restitution 0.9$"),
    (None, hc.Contact("restitution", restitution=0.5432), "damping of restitution 0.543$"),
    (
        None,
        hc.Contact("viscoelastic", relaxation_time=1.234e-6),
        "damping of viscoelastic spheres with the relaxation time 1.23e-06 s$",
    ),
    (None, hc.Contact("dashpot", coefficient=3.456), "damping by dashpots of 3.46 kg/s$"),
    (None, pulling("dashpot"), "$"),
    (
        ASKED["restitution"],
        with_ratio(tsuji(0.8, False) / ALPHA).contact,
        "damping of restitution 0.853 in place of 0.8 .*: damping tsuji of LAMMPS before.* 0.8$",
    ),
    (
        ASKED["restitution"],
        with_ratio(tsuji(0.8, True) / ALPHA).contact,
        "damping of restitution 0.799 in place of 0.8 .*: damping tsuji of LAMMPS 2 Sep 2026 or",
    ),
    (ASKED["restitution"], None, "no damping$"),
    (ASKED["viscoelastic"], None, "no damping$"),
    (ASKED["dashpot"], None, "no damping$"),
    (ASKED["restitution"], pulling("restitution"), "contacts that pull as they open$"),
    (pulling("dashpot"), ASKED["dashpot"], "contacts that are kept from pulling$"),
    # Laws that leave a little more are named after it.
    (ASKED["dashpot"], ASKED["restitution"], f"{SHORT} in place of damping by dashpots of 3 kg/s"),
    (ASKED["restitution"], ROOT_2, r".*: m in place of m\*$"),
    (ASKED["restitution"], with_ratio(1.0029 * math.sqrt(2)).contact, r".*: m in place of m\*$"),
    (ASKED["restitution"], with_ratio(1.0031 * math.sqrt(2)).contact, r".*times the scene's\)$"),
    (ASKED["viscoelastic"], RELAXED, ".*: the factor 3/2 is missing$"),
]
QUICK = (0, 2, 3, 4, 5, 6, 7, 10, 17)


@pytest.mark.parametrize(
    ("asked", "made", "words"),
    [
        pytest.param(*case, marks=[] if k in QUICK else pytest.mark.slow)
        for k, case in enumerate(ASKED_AND_MADE)
    ],
)
def test_damping_is_named(asked: hc.Contact | None, made: hc.Contact | None, words: str) -> None:
    scene = replace(ELASTIC, contact=asked)
    found = hc.judge(scene, peaks_of(replace(ELASTIC, contact=made)), tolerance=1e-6)
    assert found.verdict == "fail"
    assert re.match(words, (found.cause or "").partition("; leaves")[0]), found.cause or found.hint


@pytest.mark.parametrize(
    ("law", "factor", "words"),
    [
        ("dashpot", 0.5, "1.5 kg/s in place of 3 kg/s (coefficient 0.5 times the scene's): half"),
        ("dashpot", 2.0, "6 kg/s in place of 3 kg/s (coefficient 2 times the scene's): twice the"),
        ("dashpot", 1.2, "3.6 kg/s in place of 3 kg/s (coefficient 1.2 times the scene's)"),
        ("viscoelastic", 2 / 3, "0.6667 times the scene's): the factor 3/2 is missing"),
        ("viscoelastic", 1.5, "(coefficient 1.5 times the scene's): the factor 3/2 is there twice"),
        ("restitution", 2**-0.5, "(coefficient 0.7071 times the scene's): m*/2 in place of m*"),
    ],
)
def test_factors_of_a_coefficient_in_words(law: str, factor: float, words: str) -> None:
    own = ASKED[law]
    contact = partial(contact_of, ELASTIC, own.damping, attraction=False)
    strength = ALPHA if law == "restitution" else own.parameter / contact(0.0).parameter
    found = in_words(replace(ELASTIC, contact=own), contact, math.log(strength * factor))
    assert words in found
    assert found.endswith("times the scene's)") == (factor == 1.2)


def test_unlike_granules_have_no_effective_mass_that_a_factor_tells() -> None:
    chain = replace(ELASTIC.chain, density=[8000.0, 2000.0] * 8)
    for scene, told in ((ELASTIC, True), (replace(ELASTIC, chain=chain), False)):
        contact = partial(contact_of, scene, "restitution", attraction=False)
        log = math.log(ALPHA * math.sqrt(0.5))
        found = in_words(replace(scene, contact=ASKED["restitution"]), contact, log)
        assert ("m*/2" in found) == told


def test_noise_does_not_look_like_weak_damping_or_pulling() -> None:
    noise = 1 + 1e-3 * np.random.default_rng(1).standard_normal(15)
    for asked, made in ((ASKED["restitution"], None), (None, ASKED["dashpot"])):
        peaks = peaks_of(replace(ELASTIC, contact=made)) * noise
        cause = hc.judge(replace(ELASTIC, contact=asked), peaks).cause or ""
        assert cause.startswith("no damping; leaves" if asked else "damping by dashpots of 3 kg/s")
        assert "contacts that pull" not in cause


def test_damping_is_named_where_it_leaves_a_third_of_what_none_does() -> None:
    truth = hc.Native("reference").run(ELASTIC)
    given, judged = truth.peak_force * np.linspace(0.9, 1.0, 15), np.ones(15, bool)
    case = Case(ELASTIC, truth, given, judged, None, 1e-3, Deadline(60.0), False)
    assert [one.most for one in damping(case)] == pytest.approx([case.size / 3] * 3)
    fitted = Mistake(lambda _: "", lambda _: truth.peak_force, most=case.size * 1.01)
    assert fitted.tried(case).left == case.size
    assert replace(fitted, most=case.size * 0.99).tried(case).left == math.inf


def test_with_other_terms_damping_is_tried() -> None:
    """Before a wall, behind a striker; elastic scenes with terms, too."""
    chain = hc.Chain(12, **STEEL)
    elastic = hc.Scene(chain, hc.Striker(1.0), wall=hc.Wall("rigid"))
    damped = replace(elastic, contact=hc.Contact("restitution", restitution=0.85))
    found = hc.judge(elastic, peaks_of(damped))
    assert (found.cause or "").startswith("damping of restitution 0.85; leaves")
    tried = "units and numbers of the contacts; damping"
    assert found.remarks == (f"causes that were tried in a scene with striker, wall: {tried}",)
    asked = replace(damped, contact=ASKED["restitution"])
    found = hc.judge(asked, peaks_of(damped))
    assert (found.cause or "").startswith("damping of restitution 0.85 in place of 0.8 ")


def test_units_and_numbers_are_tried_in_any_scene() -> None:
    scene = hc.Scene(hc.Chain(12, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid"))
    peaks = hc.Native().run(scene).peak_force
    for given, cause in ((peaks / 1000, "in units of kN"), (peaks[::-1], "from the far end")):
        found = hc.judge(scene, dict(enumerate(given.tolist(), 2)))
        assert cause in found.cause


def test_what_is_tried() -> None:
    damped = replace(ELASTIC, contact=ASKED["dashpot"])
    for scene, count in ((ELASTIC, 8), (damped, 5), (replace(damped, wall=hc.Wall("same")), 2)):
        names = [family.name for family in families_for(scene)]
        assert (len(names), "damping" in names) == (count, True)


def test_a_step_of_damped_contacts_is_only_remarked() -> None:
    scene = replace(ELASTIC, contact=ASKED["dashpot"])
    found = hc.judge(scene, peaks_of(scene), dt=1e-7)
    assert (found.verdict, found.expected) == ("pass", None)
    assert found.remarks == (
        "what velocity Verlet has at that step is not known of damped contacts",
    )


# In the code of damped contacts

NONE = [
    *(DampingMistake("none", nullcontext, law) for law in (RESTITUTION_LAW, DASHPOT_LAW)),
    DampingMistake("none", nullcontext, VISCOELASTIC_LAW),
    DampingMistake("none", nullcontext, RESTITUTION_LAW, at_wall=True),
]
"""A context without a mistake."""


def named(mistake: DampingMistake, cause: str) -> bool:
    """Whether a judgement of peaks to 1e-6 fails under a mistake, and names a cause first.

    The pulse is so short that contacts open while the wave is near. The scene is made under the
    mistake: it keeps what it has worked out.
    """
    with mistake.plant():
        scene = replace(paper_scene("cosine", 0.5, 2.0, 16), contact=mistake.law)
        peaks = hc.Native(rtol=1e-8).run(scene).peak_force
    judgement = hc.judge(replace(ELASTIC, contact=mistake.law), peaks, tolerance=1e-6)
    return judgement.verdict == "fail" and cause in (judgement.cause or "").split("; or ")[0]


@pytest.mark.parametrize("mistake", MISTAKES_IN_DAMPING, ids=lambda mistake: mistake.what)
def test_a_collision_sees_it(mistake: DampingMistake) -> None:
    found = by_collision(mistake)
    assert found.passed
    assert abs(found.measured - found.expected) > 1e4 * found.tolerance


@pytest.mark.slow
@pytest.mark.parametrize("mistake", MISTAKES_IN_DAMPING, ids=lambda mistake: mistake.what)
def test_a_judgement_names_it(mistake: DampingMistake) -> None:
    if mistake.cause is None:
        # The wave passes the last contact but the wall's before it meets the wall.
        assert mistake.at_wall
    else:
        assert named(mistake, mistake.cause)


@pytest.mark.parametrize("right", NONE, ids=lambda mistake: f"{mistake.law.damping}")
def test_right_contacts_are_not_seen(right: DampingMistake) -> None:
    found = by_collision(right)
    assert not found.passed
    # A thousandth of the tolerance.
    assert abs(found.measured - found.expected) < 1e-3 * TOLERANCE
    assert not named(right, "")
