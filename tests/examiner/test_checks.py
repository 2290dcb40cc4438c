"""Checks of a deck by their thresholds, on either side, without LAMMPS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.deck import FoundDeck, FoundRun, FoundWall
from hertzchain.engines.lammps.reading.probing import DEPTHS
from hertzchain.engines.lammps.reading.text import Edits
from hertzchain.errors import RunFailed, SceneError
from hertzchain.examiner import measured, probes
from hertzchain.examiner.examining import case_of
from hertzchain.limits import Deadline
from tests.examiner.corpus import scene_of
from tests.examiner.made import (
    STEP,
    Change,
    both,
    by_name,
    changed,
    deck_of,
    examined,
    first_guess,
    found,
    in_texts,
    plus,
    stiffer,
    times,
)
from tests.examiner.test_corrections import in_wall

TOLERANCE = 1e-3


def deck_named(name: str) -> FoundDeck:
    """A right deck of a scene of the corpus."""
    return found(scene_of(name)) if name == "steel" else deck_of(name, scene_of(name))


def across_the_box(force: float) -> Change:
    return lambda deck: changed(deck, image_gap=1e-4, image_force=force)


PEAKS = np.asarray(hc.Native("reference").run(scene_of("steel")).peak_force)
DEEP = (PEAKS / scene_of("steel").chain.contact_stiffness) ** (2 / 3)
RADIUS, UNITS = 4.75e-3, scene_of("steel").units
# A contact that tilts by s / 2R loses s^2 / 4R of its overlap, its force half as much again.
SLOW, WEAK = 1e-9 * UNITS.velocity, 1e-9 * UNITS.force
TILT = TOLERANCE * float(np.max(DEEP)) * 4 * RADIUS / 1.5
ALLOWED: dict[str, tuple[str, Callable[[float], Change], float]] = {
    "mass": ("steel", lambda size: times("mass", 1 + size), -1e-4),
    "radius": ("steel", lambda size: times("radius", 1 + size, 5), -1e-7),
    "stiffness": ("steel", lambda size: stiffer(1 + size), -1e-4),
    "peak of the applied": ("steel", lambda size: times("applied_force", 1 + size), -1e-4),
    "distance of": ("steel", lambda size: plus("position", slice(5, None), size), -1e-9),
    "place of the wall": ("wall", lambda size: in_wall(position=lambda at: at + size), -1e-9),
    "velocity of granule 1": ("wall", lambda size: times("velocity", 1 + size, (0, 0)), -1e-5),
    "displacement of the piston": (
        "piston", lambda size: times("driven_displacement", 1 + size), -1e-5
    ),
    "constant force on all": ("column", lambda size: times("constant_force", 1 + size), -1e-4),
    "damping": ("viscoelastic", lambda size: times("damped_force", 1 + size), -1e-5),
    "distance from": ("steel", lambda s: plus("sideways", (3, 1), math.sqrt(s)), TILT),
    "velocity of granule 4": ("steel", lambda s: plus("velocity", (3, 0), s), SLOW),
    "velocity across": ("steel", lambda s: plus("velocity", (3, 1), s), SLOW),
    "spin": ("steel", lambda s: plus("spin", (3, 1), s), SLOW / RADIUS),
    "constant force on granule 4": ("steel", lambda s: plus("constant_force", (3, 0), s), WEAK),
    "constant force across": ("steel", lambda s: plus("constant_force", (3, 1), s), WEAK),
    "drag": (
        "steel",
        lambda s: both(plus("drag", 3, s), in_texts("group first id 1", "fix v all viscous")),
        WEAK / UNITS.velocity,
    ),
    "friction": ("steel", lambda s: plus("tangential_force", 3, s), 1e-7 * float(np.max(PEAKS))),
    "damping of contact 5": ("steel", lambda s: times("damped_force", 1 + s, (2, 3)), 1e-7),
    "neighbours": ("steel", lambda s: plus("missed_overlap", 3, s), 0.1 * float(DEEP[3])),
    "contacts across": ("steel", across_the_box, 1e-7 * UNITS.force),
}  # fmt: skip
"""By the start of a check's name: a scene, a difference of some size, and the size that is allowed;
below 0 a small size, to whose effect on the peaks the allowed one is proportional."""


@pytest.mark.parametrize("name", ALLOWED)
def test_both_sides_of_what_is_allowed(name: str) -> None:
    """A third of it passes; three times of it is to correct, and has a line."""
    of_scene, change, most = ALLOWED[name]
    scene, deck = scene_of(of_scene), deck_named(of_scene)
    if most < 0:
        effect = by_name(examined(scene, change(-most)(deck)), name).effect
        most = -most * TOLERANCE / effect
    little, much = (examined(scene, change(share * most)(deck)) for share in (1 / 3, 3.0))
    assert [check.sentence for check in little.checks[:-1] if not check.passed] == []
    check = by_name(much, name)
    assert not check.passed
    assert check.place.file == "in.made"
    assert check.corrections or name == "contacts across"


def with_wall(room: float, missed: float = 0.0) -> Change:
    """A wall at the far end, some way from the last granule, with an overlap without a force."""

    def change(deck: FoundDeck) -> FoundDeck:
        depth = np.array([1e-6, 5e-6])
        force, beyond = 2e10 * depth**1.5, float(deck.position[-1]) + RADIUS + room
        wall = FoundWall("last", beyond, depth, force, depth, depth, force, 0.0, 4)
        return changed(deck, walls=(wall,), missed_overlap=np.append(deck.missed_overlap, missed))

    return change


def in_motion(granule: int, column: int, at_rest: float, force: float, led: bool = False) -> Change:
    """The fix of the shock pushes a granule along or across, more in motion than at rest."""

    def change(deck: FoundDeck) -> FoundDeck:
        mover, shock = deck.fixes
        largest, moving = np.array(shock.largest), np.array(shock.largest_in_motion)
        largest[granule, column], moving[granule, column] = at_rest, force
        shock = replace(shock, largest=largest, largest_in_motion=moving)
        driven = led & (np.arange(deck.mass.size) == 0)
        return changed(deck, fixes=(mover, shock), driven=driven)

    return change


def halted(deck: FoundDeck) -> FoundDeck:
    return changed(deck, fixes=(*deck.fixes, replace(deck.fixes[0], style="halt")))


def at_rest(deck: FoundDeck) -> FoundDeck:
    """Nothing pushes, nothing moves."""
    return changed(
        deck, applied_force=0 * deck.applied_force, fixes=deck.fixes[:1],
        peak_force=0 * deck.peak_force, final_velocity=0 * deck.final_velocity,
    )  # fmt: skip


def another_force(deck: FoundDeck) -> FoundDeck:
    """Another force besides Hertz's, which counts where that is small."""
    least = 0.02 * deck.contact_force[1]
    return plus("damped_force", 6, least)(plus("contact_force", 1, least)(deck))


def damped_alone(more: float) -> Change:
    """A contact without an elastic force, but with damping; and more damping in another."""

    def change(deck: FoundDeck) -> FoundDeck:
        elastic, damped = deck.contact_force.copy(), deck.damped_force.copy()
        elastic[:, 1], damped[:, 1] = 0.0, 1e-3 * deck.closing[:, 1]
        damped[2, 5] += more * damped[2, 5]
        return changed(deck, contact_force=elastic, damped_force=damped)

    return change


def pulls(parting: float, approaching: float) -> Change:
    def change(deck: FoundDeck) -> FoundDeck:
        factor = np.where(deck.closing < -0.5, parting, approaching)
        return changed(deck, damped_force=deck.damped_force + 3.0 * deck.closing * factor)

    return change


def scaled(factor: float) -> Change:
    return both(times("radius", factor), times("position", factor))


def larger(factor: float) -> Change:
    """Granules of the scene's modulus: stiffnesses go as the root of the effective radius."""
    return both(times("radius", factor), times("mass", factor**3), stiffer(math.sqrt(factor)))


IN_MOTION, LATE, FAR = "force of fix addforce", "motion, by velocities at the end", "the far end"
SINGLE: list[tuple[Change, str, str]] = [
    (stiffer(1.02), "stiffness", "(1.02 times)"),
    (times("peak_force", 1 + 8e-4), "", ""),
    (times("peak_force", 1 + 2e-3), "motion, by the peaks", "the motion differs"),
    (plus("final_velocity", ..., -0.05), LATE, "the velocity of"),
    (both(plus("final_velocity", ..., -0.05), halted), "", ""),
    (with_wall(1e-2), "", ""),
    (with_wall(1e-5), "wall at the far end", "1e-05 m from the granule"),
    (with_wall(1e-2, 1e-8), "", ""),
    (with_wall(1e-2, 1e-6), "wall in motion", "up to 1e-06 m beyond"),
    # On either side of what counts as a force, and of readings at other times.
    (in_motion(5, 0, 0.0, 9e-5), "", ""),
    (in_motion(5, 1, 0.0, 1.2e-4), IN_MOTION, "granule 6 in motion, and none at rest"),
    (in_motion(5, 0, 50.0, 54.0), "", ""),
    (in_motion(5, 1, 50.0, 56.0), IN_MOTION, "granule 6 in motion, and 50 N at rest"),
    # A fix that drags is named as that, unless the drag is round-off.
    (both(in_motion(5, 1, 0.0, 1.0), plus("drag", 3, 0.9 * WEAK / UNITS.velocity)), IN_MOTION, ""),
    (both(in_motion(5, 1, 0.0, 1.0), plus("drag", 3, 1.1 * WEAK / UNITS.velocity)), "drag", ""),
    (at_rest, "applied force on granule 1", "is 0 N, the scene has 100 N"),
    (another_force, "force of", "a cutoff, a limit or another force acts"),
    # It has no size next to which it could be small, whatever the damping of another contact.
    (damped_alone(0.0), "damping of contact 3", "the elastic force is 0 N"),
    (damped_alone(1e9), "damping of contact 3", "the elastic force is 0 N"),
    # Granules that part faster than the contact pushes; else those that approach are shown.
    (pulls(1.0, 0.0), "damping", "where granules part with"),
    (pulls(2.0, 1.0), "damping", "where granules approach with"),
    (larger(1.02), "radius", "radius of all granules is"),
    (larger(0.97), "radius", "radius of all granules is"),
]  # fmt: skip
"""Changes of a right deck, the start of the name of what is to correct, and words on it."""


@pytest.mark.parametrize("row", range(len(SINGLE)))
def test_what_is_to_correct(row: int, scene: hc.Scene, right: FoundDeck) -> None:
    """A number that explains others is alone: radii explain masses and stiffnesses."""
    change, name, words = SINGLE[row]
    done = examined(scene, change(right))
    others = {"radius": "distance", "damping of contact 3": "force of contact 3"}.get(name, name)
    names = [check.name for check in done.to_correct]
    assert all(each.startswith((name, others)) for each in names)
    assert bool(names) == bool(name)
    if name:
        check = next(check for check in done.to_correct if check.name.startswith(name))
        assert words in check.sentence


def test_a_small_difference_is_not_one_times(scene: hc.Scene, right: FoundDeck) -> None:
    for off, words in ((-2e-5, "(2.0e-05 less)"), (2e-5, "(2.0e-05 more)")):
        assert words in by_name(examined(scene, stiffer(1 + off)(right)), "stiffness").sentence


@pytest.mark.parametrize(("granule", "column", "names"), [(0, 0, 0), (0, 1, 1), (5, 0, 1)])
def test_a_force_along_a_granule_that_is_led_changes_nothing(
    granule: int, column: int, names: int, scene: hc.Scene, right: FoundDeck
) -> None:
    done = examined(scene, in_motion(granule, column, 0.0, 1.0, led=True)(right))
    assert sum(check.name.startswith(IN_MOTION) for check in done.to_correct) == names


def test_a_deck_that_ends_early(scene: hc.Scene, right: FoundDeck) -> None:
    runs = (replace(right.runs[0], steps=1000),)
    commands = (*right.commands[:-1], replace(right.commands[-1], written="run 1000"))
    done = examined(scene, changed(right, runs=runs, commands=commands, end_time=1000 * STEP))
    check = by_name(done, "end of the run")
    assert (check.passed, first_guess(check)) == (False, ("run 2500",))
    assert (done.judged[0], done.judged[-1]) == (True, False)


def test_a_deck_that_ends_before_a_reflected_wave_is_back() -> None:
    scene = scene_of("wall")
    deck = deck_of("wall", scene, "run 3000", "run 1000")
    done = examined(scene, changed(deck, peak_force=hc.Native("reference").run(scene).peak_force))
    # Contacts 3 and 4 are pressed hardest at 0.31 and 0.29 ms, the deck ends at 0.2 ms.
    assert np.flatnonzero(~done.judged).tolist() == [1, 2]
    check = by_name(done, "end of the run")
    assert "2 contacts have not passed the peak by then" in check.sentence
    assert first_guess(check) == ("run 3000",)


def test_a_crest_between_readings_is_no_smaller_peak(scene: hc.Scene, right: FoundDeck) -> None:
    """The scene itself is as high at these readings; a peak that is off has digits that tell."""
    thin = changed(right, applied_time=right.applied_time[::7],
                   applied_force=right.applied_force[::7])  # fmt: skip
    check = by_name(examined(scene, thin), "applied force")
    assert check.passed
    assert check.measured == np.max(thin.applied_force) > 99.0
    check = by_name(examined(scene, times("applied_force", 1 + 1e-5)(thin)), "peak of the applied")
    assert check.sentence.startswith("peak of the applied force is 100.00")
    assert check.measured == pytest.approx(100.001, rel=1e-6)


def test_granules_that_settle_elsewhere_than_the_scene_has_them(
    scene: hc.Scene, right: FoundDeck
) -> None:
    """Their places stand in no text: the last run before the shock is to blame."""
    settles = replace(right.commands[-1], text="run 100", written="run 100")
    last = replace(right.commands[-1], line=14)
    deck = changed(plus("position", slice(5, None), 1e-6)(right), before=2e-5,
                   commands=(*right.commands[:-1], settles, last), first_run=13)  # fmt: skip
    deck = changed(deck, runs=(replace(deck.runs[0], command=13),))
    check = by_name(examined(scene, deck), "distance of")
    assert " when the shock begins is " in check.sentence
    assert str(check.place) == "in.made:13"
    assert not check.passed


def test_both_sides_of_the_digits_of_a_number(scene: hc.Scene, right: FoundDeck) -> None:
    """A hundredth of a number where no judged peak shows it: the mass of the last granule."""
    runs = (replace(right.runs[0], steps=1200),)
    for share, passed in ((1 / 3, True), (3.0, False)):
        deck = times("mass", 1 + share * 10 * TOLERANCE, -1)(right)
        check = by_name(examined(scene, changed(deck, runs=runs, end_time=1200 * STEP)), "mass")
        assert check.effect == pytest.approx(0.0, abs=1e-9)
        assert check.passed == passed


@pytest.mark.parametrize(("more", "is_bent"), [(0.009, False), (0.011, True)])
def test_both_sides_of_an_exponent(
    more: float, is_bent: bool, scene: hc.Scene, right: FoundDeck
) -> None:
    bent = times("contact_force", np.maximum(DEPTHS, 1e-9)[:, np.newaxis] ** more)(right)
    assert is_bent == ("exponent" in {check.kind for check in examined(scene, bent).to_correct})


def test_both_sides_of_a_time_step(scene: hc.Scene, right: FoundDeck) -> None:
    """Errors of velocity Verlet go as the square of its step; the step that is named is right."""

    def with_step(dt: float) -> hc.DeckCheck:
        steps = math.ceil(right.end_time / dt)
        runs = (replace(right.runs[0], dt=dt, steps=steps),)
        deck = changed(right, runs=runs, end_time=dt * steps)
        return by_name(examined(scene, deck), "time step")

    effect = with_step(3 * STEP).effect
    allowed = 3 * STEP * math.sqrt(TOLERANCE / effect)
    assert with_step(allowed * math.sqrt(1 / 3)).passed
    wrong = with_step(allowed * math.sqrt(3.0))
    assert not wrong.passed
    assert wrong.expected is not None
    named = with_step(wrong.expected)
    assert named.passed
    # 0.8 of the tolerance is aimed at; a step has two digits.
    assert named.effect > 0.5 * TOLERANCE
    unstable = with_step(100 * STEP)
    assert unstable.effect == math.inf
    assert "longest stable" in unstable.sentence
    # No error tells how much shorter it should be: that of a chain of equal granules does.
    aimed_at = 0.8 * math.sqrt(TOLERANCE / 0.5) * scene.units.time
    assert 0.9 * aimed_at < unstable.expected <= aimed_at


def test_both_sides_of_numbers_that_explain_the_peaks(scene: hc.Scene, right: FoundDeck) -> None:
    """By half of the error of the peaks: the rest is of how effects add up."""
    lighter = times("mass", 0.8)(right)
    (mass,) = examined(scene, lighter).to_correct
    for share, names in ((0.52, [mass.name]), (0.48, ["motion", mass.name])):
        peaks = right.peak_force * (1 + mass.effect / share)
        to_correct = examined(scene, changed(lighter, peak_force=peaks)).to_correct
        assert [check.name.split(",")[0] for check in to_correct] == names


def test_both_sides_of_the_motion_at_the_end(scene: hc.Scene, right: FoundDeck) -> None:
    """A fiftieth of the largest velocity, if by as much for all granules."""
    allowed = 0.02 * float(np.max(np.abs(right.final_velocity)))
    for share, names in ((1 / 3, []), (3.0, [LATE])):
        done = examined(scene, plus("final_velocity", ..., share * allowed)(right))
        assert [check.name for check in done.to_correct] == names


def test_equal_differences_are_one_finding(scene: hc.Scene, right: FoundDeck) -> None:
    """Equal to a hundredth; the rest of many different ones is one finding, too."""
    two = [times("mass", factor, k) for k, factor in ((3, 1.2), (4, 1.2006), (9, 1.206))]
    many = [times("mass", 1 + 0.1 * k, k) for k in range(1, 6)]
    for changes, whom in (
        (two, ["10", "s 4 to 5"]), (many, ["5", "6", "s 2 to 4"])
    ):  # fmt: skip
        checks = examined(scene, both(*changes)(right)).checks
        names = [check.name for check in checks if check.name.startswith("mass")]
        assert sorted(name.removeprefix("mass of granule").strip() for name in names) == whom


# Units, the start of the shock, loads


def test_units_of_lj(scene: hc.Scene, right: FoundDeck) -> None:
    """The same chain in arbitrary units: lengths of 2 mm, masses of 3 g, times of 5 us."""
    length, mass, time = 2e-3, 3e-3, 5e-6
    force = mass * length / time**2
    per = {
        length: ("position", "radius", "overlap", "damped_overlap"),
        mass: ("mass",),
        time: ("applied_time", "end_time"),
        force: ("contact_force", "damped_force", "applied_force", "peak_force"),
        length / time: ("closing", "final_velocity"),
    }
    numbers = {name: getattr(right, name) / unit for unit, names in per.items() for name in names}
    runs = (replace(right.runs[0], dt=STEP / time),)
    fixes = tuple(
        replace(fix, largest=fix.largest / force, largest_in_motion=fix.largest_in_motion / force)
        for fix in right.fixes
    )
    scaled = changed(right, units="lj", runs=runs, fixes=fixes, **numbers)
    done = examined(scene, scaled)
    assert [check.sentence for check in done.checks if not check.passed] == []
    assert any("one length is 0.002 m" in remark for remark in done.remarks)
    weaker = times("applied_force", 0.9)(scaled)
    assert not by_name(examined(scene, weaker), "peak of the applied").passed


def two_runs(deck: FoundDeck, start: float) -> FoundDeck:
    """A deck that runs before its shock: all that happens comes later."""
    (run,) = deck.runs
    before = FoundRun(0.0, run.dt, round(start / run.dt), run.command)
    return changed(
        deck, runs=(before, replace(run, start=start, command=run.command + 2)),
        applied_time=np.append(0.0, deck.applied_time + start),
        applied_force=np.vstack([0 * deck.applied_force[:1], deck.applied_force]),
        end_time=deck.end_time + start,
    )  # fmt: skip


# A start within a fiftieth of a step of one is that step.
@pytest.mark.parametrize("start", [0.0, 200 * STEP, 230 * STEP, 230.06 * STEP])
def test_a_shock_begins_with_the_run_that_fits(
    start: float, scene: hc.Scene, right: FoundDeck
) -> None:
    deck = two_runs(right, 200 * STEP)
    moved = scene.applied_force(deck.applied_time - start)
    force = np.where(np.arange(20) == 0, moved[:, np.newaxis], 0.0)
    begun = measured.start_of_shock(changed(deck, applied_force=force), scene)
    assert begun == pytest.approx(start, abs=3e-3 * STEP)
    # One of another shape begins at the nearest run.
    begun = measured.start_of_shock(changed(deck, applied_force=force**2 / 100), scene)
    assert begun == min(start, 200 * STEP)


@pytest.mark.parametrize(
    ("name", "until", "is_load"),
    [
        ("steel", 0.94, True),
        ("steel", 0.96, False),
        ("precompressed", 0.96, True),
        ("precompressed", 1.1, False),
    ],
)
def test_a_force_that_stays_is_a_load(name: str, until: float, is_load: bool) -> None:
    """For a twentieth of all time after the shock, unless the scene has static loads."""
    scene = scene_of(name)
    deck = deck_named(name)
    force = np.full(deck.applied_force.shape, 3.0)
    force[deck.applied_time < until * deck.end_time, 2] += 1.0
    force[0, 2] = 3.0
    loaded = measured.with_loads(changed(deck, applied_force=force), scene)
    load = 3.0 * np.ones(deck.mass.size)
    load[2] = 3.0 if is_load else 0.0
    assert loaded.constant_force[:, 0] == pytest.approx(deck.constant_force[:, 0] + load)
    assert loaded.applied_force == pytest.approx(force - load)


@pytest.mark.parametrize(("moved", "is_load"), [(0.9e-5, True), (1.1e-5, False)])
def test_a_held_end_is_one_under_load(moved: float, is_load: bool) -> None:
    """Where the shock moves it by less than 1e-5 of its overlap."""
    scene = scene_of("precompressed")
    deck = plus("integrated", -1, -1)(deck_of("precompressed", scene))
    deck = plus("constant_force", (-1, 0), 20.0)(deck)
    overlap = scene.granules.static_overlap[-1]
    laws = measured.laws(deck, scene, np.full(13, overlap))
    held = measured.with_held(deck, laws, moved * overlap)
    assert held.integrated[-1] == is_load
    assert held.constant_force[-1, 0] == pytest.approx(-20.0 * is_load)
    moving = plus("velocity", (-1, 0), 1.0)(deck)
    apart = plus("position", -1, 1e-5)(deck)
    for other in (moving, apart):
        assert measured.with_held(other, laws, 0.0) is other
    assert measured.with_held(deck, laws[:-1], 0.0) is deck


def test_a_piston_that_goes_astray_for_a_moment() -> None:
    """The displacement where it is off the most, not the largest one, is shown."""
    scene = scene_of("piston")
    deck = plus("driven_displacement", 600, 2e-6)(deck_of("piston", scene))
    check = by_name(examined(scene, deck), "displacement of the piston")
    assert check.sentence.endswith("is 2.6e-05 m, the scene has 2.4e-05 m at 0.00012 s")
    assert not check.passed
    none = np.zeros(0)
    still = changed(deck, stopped="no step", driven_time=none, driven_displacement=none)
    assert not any("piston" in check.name for check in examined(scene, still).checks)


def test_a_force_at_a_jump_is_that_of_either_side() -> None:
    """The pulse ends at the reading 200, up to less than a millionth of a step."""
    table = hc.PulseTable((0.0, 2e-5, 4e-5), (100.0, 80.0, 100.0))
    scene = replace(scene_of("steel"), shock=table)
    deck = found(scene)
    for late in (-1e-14, 1e-14):
        for more in (0.0, -100.0):
            change = both(plus("applied_time", 200, late), plus("applied_force", (200, 0), more))
            pulse = probes._pulse(case_of(scene, change(deck), 1e-3, Deadline(60.0), {})[0])
            assert pulse.measured == pulse.expected == 100.0


# The whole of an examination

DECK = "units si # of all\ninclude a.inc\ninclude b.inc\nset group all &\n density 1\nrun 5"
TEXTS = {"in.made": DECK, "a.inc": "pair_style none\ninclude b.inc\n", "b.inc": "fix 1 all nve\n"}


@pytest.mark.parametrize(
    ("edits", "fixed"),
    [
        ({}, f"{DECK}\n"),
        ({("in.made", 4): ("set group all density 2", "set group all diameter 3")},
         ("units si # of all\ninclude a.inc\ninclude b.inc\nset group all density 2\n"
         "set group all diameter 3\nrun 5\n")),
        ({("a.inc", 1): ("pair_style granular",), ("in.made", 6): ()},
         ("units si # of all\npair_style granular\ninclude b.inc\ninclude b.inc\n"
         "set group all &\n density 1\n")),
        ({("b.inc", 1): ("# fix 1 all nve",)},
         "units si # of all\ninclude a.inc\n# fix 1 all nve\nset group all &\n density 1\nrun 5\n"),
    ],
)  # fmt: skip
def test_the_fixed_deck(edits: Edits, fixed: str, scene: hc.Scene, right: FoundDeck) -> None:
    """Included files that change stand in it; all else is as it was."""
    done = replace(examined(scene, right), texts=tuple(TEXTS.items()), edits=edits)
    assert done.fix == fixed
    assert replace(done, texts=()).fix == ""


@pytest.mark.parametrize(
    ("sideways", "kind"),
    [
        (np.arange(20) % 4, "lie in 4 rows of 5, not in one"),
        (np.arange(20) % 19, "do not lie in one row along x, y or z"),
        (np.arange(20) // 16, "do not lie in one row along x, y or z"),
    ],
)
def test_rows(sideways: FloatArray, kind: str, scene: hc.Scene, right: FoundDeck) -> None:
    """Rows of as many granules each; nothing else is compared."""
    across = np.outer(sideways * 9.5e-3, [0.0, 1.0])
    done = examined(scene, changed(right, is_chain=False, sideways=across))
    (check,) = done.to_correct
    assert check.sentence == f"the deck is not a chain: its 20 granules {kind}"
    assert done.findings[0].checks == (check,)
    assert done.to_dict()["findings"][0]["correction"] is None
    assert (done.small, done.verdict, done.checks[-1].passed) == ((), "fail", False)
    assert done.judged.tolist() == [False] * 19


@pytest.mark.parametrize(
    ("name", "more"),
    [("steel", -1), ("wall", 1), ("precompressed", -1), ("precompressed", 1), ("column", -1)],
)
def test_another_number_of_granules(name: str, more: int) -> None:
    """The granules and contacts that both have are right, but for the load on the last one."""
    scene = scene_of(name)
    count = scene.chain.granules + more
    other = replace(scene, chain=replace(scene.chain, granules=count))
    deck = found(other) if name == "steel" else deck_of(name, other)
    decks = [deck] if name == "column" else [deck, changed(deck, units="lj")]
    for contents in decks:
        first, *rest = examined(scene, contents).to_correct
        assert (first.name, first.measured) == ("number of granules", count)
        assert first.expected == scene.chain.granules
        assert [check.kind for check in rest] == ["constant force"] * (name == "precompressed")


def test_a_deck_without_steps(scene: hc.Scene, right: FoundDeck) -> None:
    nothing = changed(right, runs=(), end_time=0.0, applied_time=np.zeros(0),
                      applied_force=np.zeros((0, 20)))  # fmt: skip
    with pytest.raises(RunFailed, match="it needs a run command"):
        examined(scene, nothing)


def test_a_deck_that_stops(scene: hc.Scene, right: FoundDeck) -> None:
    """Its numbers are judged, and nothing of its motion is."""
    stopped, none = "granules left the box", np.full(19, np.nan)
    wrong = times("mass", 0.5)(changed(right, stopped=stopped, end_time=1e-2, peak_force=none))
    refused = changed(wrong, applied_time=np.zeros(0), applied_force=np.zeros((0, 20)))
    for deck in (wrong, refused):
        done = examined(scene, deck)
        assert [check.name for check in done.to_correct] == ["mass of all granules"]
        assert done.checks[-1].sentence == f"the deck does not come to its end: {stopped}"
        assert not done.checks[-1].passed
    assert not any("applied" in check.name for check in done.checks)


def test_contacts_that_were_not_tried(scene: hc.Scene, right: FoundDeck) -> None:
    """They have no law, and no other check says that they are right."""
    unknown = {
        "contact_force": np.nan * right.contact_force,
        "damped_force": np.nan * right.closing,
    }
    done = examined(scene, changed(right, **unknown))
    check = by_name(done, "contacts")
    assert check.sentence == "LAMMPS stopped while the contacts were probed"
    assert done.to_correct == (check,)  # which explains any motion
    assert not any(check.name.startswith(("stiffness", "damping")) for check in done.checks)


@pytest.mark.parametrize(("factor", "is_unit"), [(1e2, True), (1.09e2, True), (1.3e2, False)])
def test_units_that_are_others(
    factor: float, is_unit: bool, scene: hc.Scene, right: FoundDeck
) -> None:
    """All lengths are those of cgs in metres, but for a tenth: the line of the units makes that."""
    check = by_name(examined(scene, scaled(factor)(right)), "radius")
    assert (str(check.place) == "in.made:1") == is_unit
    assert (first_guess(check) == ("units cgs",)) == is_unit


def test_a_pitch_that_is_a_factor_of_the_right_one(scene: hc.Scene, right: FoundDeck) -> None:
    wide = both(times("position", 1.01), in_texts("group first id 1", "lattice sc 1.01"))
    assert first_guess(by_name(examined(scene, wide(right)), "distance of")) == ("lattice sc 1",)


def test_what_cannot_be_examined(scene: hc.Scene) -> None:
    for limit in (0.0, np.nan):
        with pytest.raises(SceneError, match=f"time_limit = {limit}: must be"):
            hc.examine(scene, "in.none", time_limit=limit)
    with pytest.raises(SceneError, match=r"tolerance = 1\.0: must be a number above 0"):
        hc.examine(scene, "in.none", tolerance=1.0)
    with pytest.raises(SceneError, match="near_wall: cannot be in the scene of a deck"):
        hc.examine(replace(scene, near_wall=hc.Wall("rigid")), "in.none")


def test_the_document(scene: hc.Scene, right: FoundDeck) -> None:
    done = examined(scene, in_texts("7958", "3979")(times("mass", 0.5)(right)))
    numbers = done.to_dict()
    assert (numbers["verdict"], numbers["peak_reading_error"]) == ("fail", 0)
    assert numbers["peak_force_N"] == right.peak_force.tolist()
    first = next(check for check in numbers["checks"] if check["name"].startswith("mass"))
    # The variable that the density is; nothing is proven.
    assert (first["line"], first["command"]) == (2, None)
    assert first_guess(done.to_correct[0]) == ("variable rho equal 7958",)
    assert list(done.to_frame()["name"]) == [check.name for check in done.checks]
