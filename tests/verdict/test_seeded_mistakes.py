"""The comparison can fail: mistakes are planted, and have to be caught and named."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps import deck, examine
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.errors import RunFailed
from hertzchain.verdict.check import Check
from hertzchain.verdict.deck_numbers import EXAMINED, number_checks
from tests.conftest import STEEL, paper_scene
from validation import mistakes, table3, table4
from validation.mistakes import (
    APPLIED,
    GRANULE_MASS,
    MISTAKES,
    SAME_PEAKS,
    TANGENTIAL,
    compared,
    small_scene,
)
from validation.planting import DAMPING, STIFFNESS, Mistake, Plant, in_set_up
from validation.rows import Row
from validation.script import Script

EXAMINATION = {
    "lammps: granules",
    "lammps: position at rest [m]",
    "lammps: granule mass [kg]",
    "lammps: contact stiffness [N m^(-3/2)]",
    "lammps: contact exponent",
    "lammps: damping",
    "lammps: tangential force",
    "lammps: applied force [N]",
}
"""The checks that name a mistake in a deck."""

NONE = Mistake("nothing", contextlib.nullcontext, STIFFNESS)


def failed(checks: tuple[Check, ...]) -> set[str]:
    return {check.name for check in checks if not check.passed}


def seen(plant: Plant, name: str, pair_style: str = "granular") -> Check:
    """A check of the examination under a mistake."""
    with plant():
        scene = small_scene()
        checks = number_checks(scene, examine(scene, pair_style))
    return next(check for check in checks if check.name == name)


def planted(what: str) -> Mistake:
    return next(mistake for mistake in MISTAKES if mistake.what == what)


def size(check: Check) -> float:
    assert check.measured is not None
    assert check.expected is not None
    return check.measured - check.expected


# Every mistake


@pytest.mark.lammps
@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.what)
def test_a_mistake_is_caught_and_named(mistake: Mistake) -> None:
    comparison = compared(mistake)
    assert comparison.verdict == "fail"
    wrong = failed(comparison.checks)
    assert mistake.check in wrong
    # Right numbers of a deck pass; another law has another stiffness, too.
    innocent = EXAMINATION - {mistake.check}
    if mistake.what == "contact law linear":
        innocent -= {STIFFNESS}
    if mistake.what == "steps that pass over the corners":
        innocent -= {APPLIED}
    assert wrong & innocent == set()


@pytest.mark.lammps
@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize("read_every", [None, 1])
def test_without_a_mistake_nothing_is_caught(pair_style: str, read_every: int | None) -> None:
    comparison = compared(replace(NONE, pair_style=pair_style, read_every=read_every))
    assert failed(comparison.checks) == set()
    assert {check.name for check in comparison.checks} > EXAMINATION
    assert comparison.verdict == "pass"


def test_a_plant_that_finds_no_place_says_so() -> None:
    plant = in_set_up(("gran/none", "gran/other"))
    with plant(), pytest.raises(ValueError, match="there is no 'gran/none'"):
        deck.set_up(small_scene(), "granular")


# By how much


@pytest.mark.lammps
@pytest.mark.parametrize("factor", ["1.001", "0.999", "1.000000001", "1.00000000001"])
@pytest.mark.parametrize(
    ("plant", "name"), [(mistakes.stiffer, STIFFNESS), (mistakes.heavier, GRANULE_MASS)]
)
def test_a_factor_is_measured(plant: object, name: str, factor: str) -> None:
    assert callable(plant)
    check = seen(plant(factor), name)
    assert not check.passed
    assert check.measured is not None
    assert check.expected is not None
    # Round-off of 3e-15 is allowed 1e-14 here.
    assert check.measured / check.expected == pytest.approx(float(factor), rel=1e-14, abs=0)


@pytest.mark.lammps
def test_what_is_below_the_tolerance_is_not_seen() -> None:
    """The limit: 1e-12, where round-off is 3e-15."""
    assert seen(mistakes.stiffer("1.0000000000001"), STIFFNESS).passed
    assert seen(mistakes.heavier("1.0000000000001"), GRANULE_MASS).passed


@pytest.mark.lammps
def test_density_before_diameter_is_the_mass_of_a_unit_diameter() -> None:
    check = seen(planted("density set before diameter").plant, GRANULE_MASS)
    # LAMMPS gives every granule the diameter 1 at first.
    assert check.measured == pytest.approx(math.pi / 6 * STEEL["density"], rel=1e-14, abs=0)


@pytest.mark.lammps
def test_missing_contacts_are_named() -> None:
    check = seen(planted("contact 7 missing").plant, STIFFNESS)
    assert check.reason.endswith("no force in contact 7")
    assert check.measured == pytest.approx(
        0.0, abs=EXAMINED * small_scene().chain.contact_stiffness
    )


@pytest.mark.lammps
@pytest.mark.parametrize("contact", [2, 7])
def test_the_contact_that_is_off_is_named(contact: int) -> None:
    scene = small_scene()
    right = examine(scene)
    for name, row, array in (
        (STIFFNESS, -1, "contact_force"),
        (STIFFNESS, -2, "contact_force"),
        ("lammps: contact exponent", -1, "contact_force"),
        (DAMPING, 0, "damped_force"),
        (DAMPING, 1, "damped_force"),
    ):
        force = getattr(right, array).copy()
        force[row, contact - 2] *= 1.001
        checks = number_checks(scene, replace(right, **{array: force}))
        check = next(check for check in checks if check.name == name)
        assert not check.passed
        assert check.reason.endswith(f"largest at contact {contact}")


@pytest.mark.lammps
def test_the_motion_names_the_missing_contact_too() -> None:
    comparison = compared(planted("contact 7 missing"))
    peaks = next(check for check in comparison.checks if check.name == SAME_PEAKS)
    assert peaks.reason.endswith("largest at contact 7")
    assert peaks.measured == 1.0
    displacement = next(check for check in comparison.checks if "displacement" in check.name)
    # Granule 6 flies on alone.
    assert displacement.reason.endswith("largest at granule 6")


@pytest.mark.lammps
@pytest.mark.parametrize("steps", [1, -1])
def test_a_late_force_is_off_by_what_it_grows_in_a_step(steps: int) -> None:
    what = "force one step late" if steps > 0 else "force one step early"
    check = seen(planted(what).plant, APPLIED)
    # Four steps a leg: over the cosine rise the largest growth in one is sin(45 degrees) / 2 of F0.
    assert abs(size(check)) == pytest.approx(100 * math.sqrt(0.5) / 2, rel=1e-9, abs=0)


@pytest.mark.lammps
def test_a_late_corner_is_off_by_the_slope_of_the_ramp() -> None:
    late = planted("step to the first corner a thousandth late")
    # Where the leg ends the linear decay has lost 0.001 F0, and the cosine its second order.
    expected = 100 * (1e-3 - (math.pi / 2 * 1e-3) ** 2)
    assert size(seen(late.plant, APPLIED)) == pytest.approx(expected, rel=1e-5, abs=0)
    pulse = planted("first corner of the pulse a thousandth late")
    # The rise is that much too slow: pi / 4 * 0.001 F0 halfway, where it is steepest.
    assert size(seen(pulse.plant, APPLIED)) == pytest.approx(0.1, rel=0.01, abs=0)


@pytest.mark.lammps
def test_tsuji_damps_even_with_restitution_1() -> None:
    """Its polynomial is 3e-4 at e = 1; the force it adds is linear in the velocity."""
    check = seen(planted("damping tsuji with e = 1").plant, DAMPING)
    coefficients = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
    damping = sum(coefficients)
    # alpha sqrt(m* F / overlap) v over F, largest at a hundredth of the overlap u, with u over the
    # contact time at 3 u as the velocity.
    expected = damping * 100**1.25 * 3**0.25
    # A sum of terms of 27 that cancel to 3e-4.
    assert abs(size(check)) == pytest.approx(expected, rel=1e-9, abs=0)


@pytest.mark.lammps
def test_friction_that_does_nothing_is_no_mistake() -> None:
    """``linear_nohistory 1.0 0.5`` takes its damping from the normal one, which is 0.

    A deck with it gives the same forces in any motion at all, so nothing can tell it apart.
    """
    check = seen(mistakes.with_friction("linear_nohistory 1.0 0.5"), TANGENTIAL)
    assert check.measured == 0.0
    # With damping in the base deck the mistake is seen at once.
    damped = in_set_up(
        ("${young_modulus} 0.0 ", "${young_modulus} 1e-3 "),
        ("linear_nohistory 0.0 0.0", "linear_nohistory 1.0 0.5"),
    )
    assert not seen(damped, TANGENTIAL).passed


# Mistakes outside of decks


@pytest.mark.lammps
def test_peaks_of_samples_everywhere_are_seen_by_the_reference_alone() -> None:
    """Both backends agree then; the reference is no yardstick any more."""
    everywhere = planted("peaks of samples only, everywhere")
    assert failed(compared(everywhere).checks) == {everywhere.check}


@pytest.mark.parametrize("profile", ["cosine", "triangular", "cosine-triangular"])
@pytest.mark.parametrize("change", [mistakes.without_corners, mistakes.first_corner_late])
def test_native_alone_sees_wrong_corners(profile: str, change: object) -> None:
    assert callable(change)
    with mistakes.other_legs(change):
        comparison = hc.compare(paper_scene(profile, 2.0, 2.5, granules=6), ["native"])
    assert "native: momentum [N s]" in failed(comparison.checks)


@pytest.mark.parametrize("script", [table3, table4], ids=lambda script: script.__name__)
def test_eq6_as_printed_fails_the_tables(script: ModuleType) -> None:
    """It is wrong by 20 percentage points or more in every scene, where 0.2 are allowed."""

    def rows() -> list[Row]:
        of_table: Script = script.SCRIPT
        return of_table.promises(of_table.measure(True, False))

    assert all(entry.passed for entry in rows())
    with mistakes.printed_formula():
        found = rows()
    names = {entry.what.partition(",")[0] for entry in found if ", F_" in entry.what}
    assert len(names) == 3
    for name in names:
        off = [abs(e.measured - e.expected) for e in found if f"{name}, F_" in e.what]
        assert max(off) > 20


def test_eq6_as_printed_does_not_decide_the_verdict() -> None:
    with mistakes.printed_formula():
        assert hc.compare(small_scene(), ["native"]).verdict == "pass"


# The number of granules


@pytest.mark.lammps
@pytest.mark.parametrize("granules", [2, 4999, 5000, 20_000])
def test_the_deck_makes_as_many_granules_as_asked_for(granules: int) -> None:
    """LAMMPS makes its box a ten-thousandth longer at both ends; granules must not fill that."""
    scene = paper_scene("cosine", 1.0, 2.0, granules=granules)
    with engine() as lammps:
        command(lammps, deck.set_up(scene))
        assert lammps.get_natoms() == granules
    checks = number_checks(scene, examine(scene))
    assert failed(tuple(checks)) == set()


@pytest.mark.lammps
def test_one_granule_more_is_refused_and_named() -> None:
    plant = in_set_up(("$(v_granules-0.5)", "$(v_granules+0.5)"))
    check = seen(plant, "lammps: granules")
    assert (check.measured, check.expected, check.passed) == (13.0, 12.0, False)
    with plant(), pytest.raises(RunFailed, match="made 13 granules of a chain of 12"):
        hc.Lammps().run(small_scene())
    comparison = compared(replace(NONE, plant=plant))
    assert failed(comparison.checks) == {"lammps: failed", "lammps: granules"}


# Examined numbers


@pytest.mark.lammps
@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize(
    "scene",
    [
        hc.Scene(
            hc.Chain(8, **STEEL),
            hc.PulseTable((1e-5, 3e-5, 4e-5, 7e-5), (20.0, 100.0, 60.0, 10.0)),
        ),
        hc.Scene(
            hc.Chain(8, **STEEL),
            hc.PulseTable((0.0, 3e-5, 7e-5), (20.0, 100.0, 60.0)),
            hc.Run(5e-5),
        ),
        hc.Scene(
            hc.Chain(60, **STEEL), hc.Pulse("cosine", 1e-9, 2.0, momentum_ratio=1.0)
        ),  # a shock too weak for LAMMPS to follow
        hc.Scene(
            hc.Chain(30, **{**STEEL, "radius": 1e-7}),
            hc.Pulse("triangular", 1e-12, 10.0, momentum_ratio=1e-3),
        ),
        hc.Scene(
            hc.Chain(30, **{**STEEL, "radius": 100.0, "young_modulus": 1e5}),
            hc.Pulse("cosine-triangular", 1.0, 1.01, momentum_ratio=50.0),
        ),
    ],
    ids=["table with jumps", "ends in the pulse", "weak", "small", "large"],
)
def test_any_scene_passes_its_examination(scene: hc.Scene, pair_style: str) -> None:
    assert failed(tuple(number_checks(scene, examine(scene, pair_style)))) == set()


@pytest.mark.lammps
def test_what_is_examined_is_not_trivial() -> None:
    """Two overlaps, forces that grow between them, and the corners of the pulse from both sides."""
    scene = small_scene()
    found = examine(scene)
    radius = scene.chain.radius
    for overlap, fraction in zip(found.overlap[-2:], (0.01, 0.03), strict=True):
        assert overlap == pytest.approx(fraction * radius, rel=1e-12, abs=0)
    assert np.all(found.contact_force[-1] > 2 * found.contact_force[-2])
    first, second = scene.ramps
    time = found.applied_time
    assert [float(time[k]) for k in (0, 4, 5, 9)] == pytest.approx(
        [0.0, first.end, first.end, second.end], rel=1e-14, abs=0
    )
    # The corner from both sides; the end of the pulse; nothing after it.
    force = found.applied_force[:, 0]
    assert force[[4, 5]] == pytest.approx(100.0, rel=1e-14, abs=0)
    assert force[9] == pytest.approx(0.0, abs=1e-10)
    assert np.max(np.abs(force[10:])) < 1e-10


@pytest.mark.lammps
def test_forces_that_are_no_numbers_fail() -> None:
    scene = small_scene()
    found = examine(scene)
    nothing = np.full_like(found.contact_force, np.nan)
    wrong = replace(
        found,
        contact_force=nothing,
        damped_force=np.nan * found.damped_force,
        applied_force=found.applied_force * np.nan,
    )
    checks = number_checks(scene, wrong)
    bad = {STIFFNESS, "lammps: contact exponent", DAMPING, APPLIED}
    assert failed(tuple(checks)) == bad
    assert all(check.measured is None for check in checks if check.name in bad)


@pytest.mark.lammps
def test_a_deck_that_lammps_refuses_is_a_failed_check() -> None:
    plant = in_set_up(("units si", "units none_such"))
    comparison = compared(replace(NONE, plant=plant))
    assert comparison.verdict == "fail"
    assert failed(comparison.checks) == {"lammps: failed", "lammps: not examined"}


# The script


@pytest.mark.lammps
def test_the_script_fails_where_a_mistake_goes_unnoticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mistakes, "MISTAKES", (MISTAKES[0], NONE))
    monkeypatch.setattr(mistakes, "MISTAKES_WITH_TERMS", ())
    monkeypatch.setattr(mistakes, "plant_in_damping", lambda _: ())
    rows = mistakes.SCRIPT.compare()
    assert [entry.passed for entry in rows] == [True, False, True, True]
    assert [entry.backend for entry in rows[:2]] == [STIFFNESS, STIFFNESS]
    assert all(abs(e.measured - e.expected) > 100 * e.tolerance for e in rows[2:])
