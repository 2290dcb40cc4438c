"""Numbers of a deck by its probes: units of lj, laws of contacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import FoundDeck, FoundRun
from hertzchain.examiner import measured, probes
from hertzchain.examiner.examined import Case
from hertzchain.examiner.examining import case_of
from hertzchain.limits import Deadline
from tests.examiner.corpus import scene_of
from tests.examiner.made import (
    STEP,
    both,
    by_name,
    changed,
    deck_of,
    examined,
    plus,
    times,
)
from tests.examiner.made import found as made_found


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
    deck = deck_of(name, scene) if name in ("precompressed",) else made_found(scene)
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


# What a case is, what it expects and what room it has


def given(scene: hc.Scene, deck: FoundDeck) -> Case:
    """What checks of a deck share."""
    return case_of(scene, deck, 1e-3, Deadline(60.0), {})[0]


def test_a_force_at_a_jump_is_that_of_either_side() -> None:
    """The pulse ends at the reading 200, up to less than a millionth of a step."""
    table = hc.PulseTable((0.0, 2e-5, 4e-5), (100.0, 80.0, 100.0))
    scene = replace(scene_of("steel"), shock=table)
    deck = made_found(scene)
    for late in (-1e-14, 1e-14):
        for more in (0.0, -100.0):
            change = both(plus("applied_time", 200, late), plus("applied_force", (200, 0), more))
            pulse = probes._pulse(given(scene, change(deck)))
            assert pulse.measured == pulse.expected == 100.0
