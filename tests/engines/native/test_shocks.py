"""Drives and ends by native: pistons, local forces, moving and fixed granules, near walls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError
from hertzchain.observables.wave import usual_wave
from hertzchain.report.run import of_result
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.conftest import STEEL
from tests.oracles.bounds import lasting
from validation.random_drives import random_scene_with_piston

UNIFORM = hc.Chain(8, **STEEL)
TABLE = hc.Piston(None, (1e-5, 5e-5, 9e-5, 2e-4), (0.0, 4e-6, 1e-6, 2e-6))
PRESSED = hc.Precompression(10.0)

PISTONS = {
    "constant velocity": hc.Scene(UNIFORM, hc.Piston(0.1)),
    "forwards and backwards": hc.Scene(UNIFORM, TABLE, precompression=PRESSED),
    "backwards alone": hc.Scene(
        UNIFORM, hc.Piston(None, (0.0, 1e-4), (0.0, -1e-5)), precompression=PRESSED
    ),
    "gaps, wall": hc.Scene(
        hc.Chain(4, **STEEL, gap=1e-6), hc.Piston(0.1), wall=hc.Wall("same", gap=2e-6)
    ),
    "column": hc.Scene(
        hc.Chain(
            6, radius=[5e-3, 4e-3] * 3, young_modulus=193e9, poisson_ratio=0.3, density=7958.0
        ),
        TABLE,
        wall=hc.Wall("elastic", 70e9, 0.33),
        precompression=hc.Precompression(3.0, 9.81),
    ),
}

SINES = {
    "slow": hc.Scene(UNIFORM, hc.Sine(3.0, 2000.0, 2), precompression=PRESSED),
    "as strong as the load": hc.Scene(UNIFORM, hc.Sine(10.0, 8000.0, 3), precompression=PRESSED),
    "above the cut-off, wall": hc.Scene(
        hc.Chain(5, **STEEL), hc.Sine(5.0, 3e4, 2), wall=hc.Wall("rigid"),
        precompression=hc.Precompression(10.0, 9.81),
    ),
}  # fmt: skip

DAMPED_PISTONS = {
    # Three strokes of one step: the second run and the third had the same, 3.5 bounds off.
    "short strokes": random_scene_with_piston(np.random.default_rng([7001, 2653]), 12, 250.0),
    # Its contact would pull at once, and presses again before a step is over.
    "stops before a strong damper": hc.Scene(
        hc.Chain(4, **STEEL),
        hc.Piston(None, (1e-5, 1.5e-5), (0.0, 1e-6)),
        hc.Run(1e-4),
        precompression=PRESSED,
        contact=hc.Contact("restitution", restitution=0.01),
    ),
    # It is not a single step, both of a run and of that which tells its error.
    "a stroke shorter than a step": hc.Scene(
        hc.Chain(4, **STEEL),
        hc.Piston(None, (1e-5, 1.2e-5, 3e-5), (0.0, 1e-7, -3e-7)),
        hc.Run(1.5e-4),
        precompression=hc.Precompression(0.01),
        contact=hc.Contact("dashpot", coefficient=10.0),
    ),
}


def test_a_granule_hit_by_a_piston() -> None:
    """It leaves with twice the velocity; m v^2 / 2 = 2/5 A d^(5/2) at the peak."""
    chain = hc.Chain(2, radius=[3e-3, 5e-3], young_modulus=193e9, poisson_ratio=0.3, density=7958.0)
    scene = hc.Scene(chain, hc.Piston(0.2))
    result = hc.Native("reference").run(scene)
    stiffness, mass = float(scene.granules.stiffness[0]), float(scene.granules.mass[1])
    force = (1.25 * mass * 0.2**2) ** 0.6 * stiffness**0.4
    assert result.peak_force[0] == pytest.approx(force, rel=1e-11, abs=0)
    assert result.peak_force[0] == pytest.approx(scene.peak_force, rel=1e-11, abs=0)
    assert result.velocity == pytest.approx([0.2, 0.4], rel=1e-10, abs=0)
    assert result.balance.impulse == pytest.approx(2 * mass * 0.2, rel=1e-9)
    assert result.displacement[0] == pytest.approx(0.2 * result.scene.end_time, rel=1e-14)


def test_history_follows_the_table() -> None:
    scene = PISTONS["forwards and backwards"]
    time = np.linspace(0.0, scene.end_time, 41)
    for law in (None, hc.Contact("restitution", restitution=0.8)):
        history = hc.Native().run(replace(scene, contact=law), record=time).history
        expected = np.interp(time, TABLE.time or (), TABLE.displacement or ())
        assert history.displacement[:, 0] == pytest.approx(expected, rel=0, abs=1e-18)


def test_a_piston_that_turns_round_makes_a_peak() -> None:
    """The contact is pressed hardest at the instant at which the piston turns."""
    turn, law = 1e-5, hc.Contact("restitution", restitution=0.9)
    chain = hc.Chain(4, **STEEL)
    for contact in (None, law):
        back = hc.Piston(None, (0.0, turn, 2 * turn), (0.0, 2e-6, -2e-6))
        scene = hc.Scene(chain, back, contact=contact)
        result = hc.Native(rtol=1e-9).run(scene)
        assert result.peak_time[0] == pytest.approx(turn, rel=1e-12)
        until = hc.Scene(chain, hc.Piston(0.2), hc.Run(turn), contact=contact)
        at_turn = hc.Native(rtol=1e-9).run(until).peak_force[0]
        assert result.peak_force[0] == pytest.approx(at_turn, rel=1e-8)


PULSE = hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5, granule=5)


def local(shock: Any = PULSE, **more: Any) -> hc.Scene:
    return hc.Scene(hc.Chain(12, **STEEL), shock, hc.Run(4e-4), **more)


LOAD = hc.Precompression(20.0)

LOCAL = {
    "free": local(),
    "pressed": local(precompression=LOAD),
    "gaps": local(wall=hc.Wall("rigid", gap=1e-6)),
    "damped": local(contact=hc.Contact("restitution", restitution=0.9)),
    "sine": local(hc.Sine(10.0, 5000.0, 2, granule=3), precompression=LOAD),
}


def test_all_of_the_chain_is_watched() -> None:
    """The default end lets the wave pass every contact."""
    scene = replace(local(), run=hc.Run())
    assert hc.Native().run(lasting(scene)).peak_passed[4:].all()


def test_the_unit_of_a_local_shock_is_that_of_the_contact_ahead() -> None:
    """Granules behind, which touch nothing that moves, change neither pulse nor wave."""
    sizes = np.full(12, STEEL["radius"])
    pulse = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0, granule=5)
    scenes = []
    for behind in (1.0, 0.4):
        sizes[:2] = behind * STEEL["radius"]
        chain = hc.Chain(12, **{**STEEL, "radius": sizes.tolist()})
        scenes.append(hc.Scene(chain, pulse))
    like, unlike = scenes
    assert unlike.rise_time == pytest.approx(like.rise_time, rel=1e-14)
    uniform = hc.Scene(hc.Chain(12, **STEEL), replace(pulse, granule=1))
    assert like.rise_time == pytest.approx(uniform.rise_time, rel=1e-14)
    last = [replace(scene, shock=replace(pulse, granule=12)).rise_time for scene in scenes]
    assert last == pytest.approx([uniform.rise_time] * 2, rel=1e-14)
    peaks = [hc.Native(rtol=1e-9).run(scene).peak_force[4:] for scene in scenes]
    assert peaks[1] == pytest.approx(peaks[0], rel=3e-9)


BEADS = 5
"""Beads of Newton's cradle."""


def cradle(velocity: list[float], wall: hc.Wall | None = None) -> hc.Scene:
    """Steel beads that touch, with a velocity of each [m/s]."""
    return hc.Scene(hc.Chain(len(velocity), **STEEL, velocity=velocity), wall=wall)


def flying(many: int) -> list[float]:
    return [1.0] * many + [0.0] * (BEADS - many)


@pytest.mark.parametrize("many", range(1, BEADS))
def test_newtons_cradle(many: int) -> None:
    """Momentum and energy stay; seen by the beads that flew it is the cradle of the others."""
    scene = lasting(cradle(flying(many)))
    result, other = (
        hc.Native("reference", dt=0.002 * scene.contact_time).run(scene)
        for scene in (scene, replace(scene, chain=cradle(flying(BEADS - many)).chain))
    )
    mass = scene.granules.mass[0]
    # Rounding of some thousand steps; that of energy grows with them, of order 11 otherwise.
    assert np.sum(result.velocity) == pytest.approx(many, rel=1e-13)
    assert result.balance.momentum == pytest.approx(many * mass, rel=1e-13)
    assert np.sum(result.velocity**2) == pytest.approx(many, rel=1e-12)
    assert result.balance.energy == pytest.approx(many * mass / 2, rel=1e-12)
    assert result.velocity == pytest.approx(1.0 - other.velocity[::-1], abs=1e-12)
    assert result.peak_force == pytest.approx(other.peak_force[::-1], rel=1e-12)


def test_a_striker_is_the_short_form_for_granule_1() -> None:
    striker = hc.Scene(hc.Chain(BEADS, **STEEL), hc.Striker(1.0))
    thrown = cradle(flying(1))
    assert thrown.end_time == striker.end_time
    assert thrown.momentum_ratio == striker.momentum_ratio
    result, same = (hc.Native(rtol=1e-9).run(lasting(scene)) for scene in (striker, thrown))
    # A striker's wave may leave granules behind, which these do not.
    assert same.peak_force == pytest.approx(result.peak_force, rel=1e-9)


FIRST_PUSHED = replace(PULSE, granule=1)
LOADS: dict[str, Any] = {
    "free": {},
    "pressed": {"precompression": hc.Precompression(20.0)},
    "piston": {"shock": hc.Piston(0.5)},
    "striker": {"shock": hc.Striker(0.5), "precompression": hc.Precompression(20.0)},
    "damped": {"contact": hc.Contact("restitution", restitution=0.9)},
}


def held(*numbers: int, granules: int = 8, shock: Any = FIRST_PUSHED, **more: Any) -> hc.Scene:
    """A chain of steel whose granules of these numbers are fixed."""
    fixed = [number in numbers for number in range(1, granules + 1)]
    return hc.Scene(hc.Chain(granules, **STEEL, fixed=fixed), shock, hc.Run(4e-4), **more)


FIXED = {kind: held(4, *[8] * (k % 2), **more) for k, (kind, more) in enumerate(LOADS.items())}
"""One granule is fixed, and two are, in turn."""


def test_weight_is_carried_by_fixed_granules() -> None:
    scene = held(3, 6, granules=6, precompression=hc.Precompression(2.0, gravity=10.0))
    weight = 10.0 * scene.granules.mass[0]
    expected = [2 + weight, 2 + 2 * weight, 0, weight, 2 * weight]
    assert scene.granules.static_force.tolist() == pytest.approx(expected, rel=1e-14)


def test_no_wave_beyond_a_fixed_granule() -> None:
    """It is that of a chain that ends there, and of contacts behind nothing is awaited."""
    scene = held(9, granules=16)
    long, short = (
        hc.Native(rtol=1e-8, wanted="first").run(scene)
        for scene in (scene, replace(scene, chain=held(9, granules=9).chain))
    )
    waves = [usual_wave(result.scene, result.first_columns) for result in (long, short)]
    assert (waves[0].first, waves[0].last) == (waves[1].first, waves[1].last)
    assert waves[0].speed == pytest.approx(waves[1].speed, rel=1e-6)
    assert long.is_reached.tolist() == [True] * 8 + [False] * 7
    document = of_result(long)
    assert document.peaks.row(12)[-1] == ""


RADII = [4e-3, 5e-3, 3e-3, 6e-3, 5e-3, 4e-3]
THROWN = [-1.0, -1.0, 0.0, 0.0, 0.0, 0.0]
FOURTH_PUSHED = replace(PULSE, granule=4)
RIGID, SAME, ELASTIC = hc.Wall("rigid"), hc.Wall("same"), hc.Wall("elastic", 70e9, 0.33)


def scene(near: hc.Wall | None = RIGID, shock: Any = None, **more: Any) -> hc.Scene:
    """Six spheres; without a shock the first two fly towards the near end."""
    chain = {**STEEL, "velocity": THROWN if shock is None else 0.0, **more.pop("chain", {})}
    shock = hc.Moving() if shock is None else shock
    return hc.Scene(hc.Chain(6, **chain), shock, hc.Run(2e-4), near_wall=near, **more)


def damped(law: hc.Contact, parameter: float) -> hc.Scene:
    """A chain of unlike spheres between two walls; the near one has a damping of its own."""
    near = RIGID.damped(law.with_parameter(parameter))
    return scene(near, contact=law, wall=ELASTIC, chain={"radius": RADII})


NEAR_WALL = {
    "both ends": scene(SAME, wall=ELASTIC, chain={"radius": RADII}),
    "gaps": scene(replace(ELASTIC, gap=1e-7), chain={"gap": 1e-7}),
    "pressed": scene(SAME, precompression=LOAD),
    "restitution": damped(hc.Contact("restitution", restitution=0.9), 0.5),
    "viscoelastic": damped(hc.Contact("viscoelastic", relaxation_time=1e-6), 2e-6),
    "pulse": scene(RIGID, replace(FOURTH_PUSHED, granule=1)),
    "sine": scene(SAME, hc.Sine(10.0, 2e4, 2, granule=2), precompression=LOAD),
    "weight": scene(SAME, FOURTH_PUSHED, precompression=hc.Precompression(20, 9.8), wall=RIGID),
    "fixed": scene(SAME, FOURTH_PUSHED, precompression=LOAD, chain={"fixed": [False] * 5 + [True]}),
}


@pytest.mark.lammps
@pytest.mark.parametrize("kind", NEAR_WALL)
def test_lammps_at_the_same_steps(kind: str) -> None:
    walled = NEAR_WALL[kind]
    dt = 0.02 * walled.contact_time
    result = hc.Lammps(dt=dt, wanted="all").run(walled)
    other = hc.Native("velocity-verlet", dt=dt, wanted="all").run(walled)
    assert all(check.passed for check in [*same_steps_checks(result), *balance_checks(result)])
    # Round-off, and what lies between readings: measured 5e-8; a near wall behind a pulse: 6e-11 N.
    assert result.peak_force == pytest.approx(other.peak_force, rel=1e-7, abs=1e-9)


def test_numbers_and_names(tmp_path: Path) -> None:
    gauges = hc.Gauge(contact=1), hc.Gauge(granule=1), hc.Gauge(contact=7)
    walled, path = scene(SAME, wall=RIGID, gauges=gauges), tmp_path / "scene.toml"
    walled.to_toml(path)
    assert hc.Scene.from_toml(path) == walled
    assert [walled.contact_label(k) for k in (1, 2, 7)] == ["near wall", "2", "wall"]
    granules = NEAR_WALL["weight"].granules
    weight = 20 + 9.8 * granules.mass[1] * np.arange(7)
    assert granules.static_force == pytest.approx(weight, rel=1e-14)
    result = hc.Native(rtol=1e-6).run(walled, record=100)
    written = hc.Native("scipy", rtol=1e-6).run(walled)
    allowed = result.error_estimate + written.error_estimate
    assert written.peak_force == pytest.approx(result.peak_force, rel=allowed)
    assert result.to_dict()["contacts"] == result.contact.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert result.peak_at(1) == result.peak_force[0] > result.peak_at(3)
    traces = result.to_traces()
    history: Any = result.history
    assert result.displacement.shape == history.displacement[0].shape == (6,)
    assert list(traces) == ["time_s", "near_wall_N", "gauge_1_N", "wall_N"]
    mean = np.mean(history.contact_force[:, :2], axis=1)
    assert traces["gauge_1_N"].to_numpy() == pytest.approx(mean)
    traces.to_csv(tmp_path / "traces.csv", index=False)
    judged = hc.judge_traces(walled, tmp_path / "traces.csv")
    assert judged
    assert judged.traces.gauges == gauges


def test_steps_that_are_shorter_where_contacts_open_follow_contact_2() -> None:
    """The near wall's contact is as hard as steel, the others as rubber: measured 3e-11."""
    rubber = [193e9] + [1e6] * 5
    walled = replace(scene(chain={"young_modulus": rubber}), run=hc.Run(2e-2))
    assert hc.Native("reference", wanted="all").run(walled).error_estimate < 1e-10


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    **{
        f"granule {k}": (lambda k=k: local(replace(PULSE, granule=k)), "granule")  # type: ignore[misc]
        for k in (0, 13, 2.5)
    },
    "together": (lambda: cradle([1.0, 1.0, 1.0]), "no granule meets another or a wall"),
    "apart": (lambda: cradle([-1.0, 0.0, 1.0]), "no granule meets another or a wall"),
    "away": (lambda: cradle([-1.0] * 3, hc.Wall("rigid")), "no granule meets another or a wall"),
    "at rest": (lambda: cradle([0.0, 0.0]), r"missing section: give \[shock\], \[striker\] or"),
    "no faster": (
        lambda: hc.Scene(hc.Chain(2, **STEEL, velocity=2.0), hc.Striker(1.0)),
        "no granule meets another",
    ),
    "side by side": (lambda: held(3, 4), "is next to granule 4, which does not move either"),
    "beside a wall": (lambda: held(8, wall=hc.Wall("rigid")), "is next to the wall"),
    "all": (lambda: held(*range(1, 9)), "is next to granule 2"),
    "pushed": (lambda: held(1), "must not be fixed: the pulse moves it"),
    "piston": (lambda: held(1, shock=hc.Piston(1.0)), "must not be fixed: the piston moves it"),
    "loaded": (lambda: held(2, **LOADS["striker"]), "the static load presses it"),
    "gravity": (
        lambda: held(4, precompression=hc.Precompression(gravity=9.8)),
        "or a fixed last granule",
    ),
    "sine": (
        lambda: held(4, shock=hc.Sine(1.0, 5e3, 2, granule=6), **LOADS["pressed"]),
        "must be at most the static load",
    ),
    "moving": (
        lambda: hc.Scene(hc.Chain(2, **STEEL, velocity=[0.0, 1.0], fixed=[False, True])),
        "has a velocity at the start",
    ),
    "striker": (lambda: scene(shock=hc.Striker(1.0)), "granule 1 is the striker"),
    "fixed": (
        lambda: scene(shock=FOURTH_PUSHED, chain={"fixed": [True] + [False] * 5}),
        "the near wall",
    ),
    "gap": (lambda: scene(replace(SAME, gap=1e-6), precompression=LOAD), "near_wall.gap"),
    "damping": (lambda: scene(hc.Wall("rigid", restitution=0.5)), r"needs \[contact\]"),
    "liggghts": (lambda: hc.Liggghts().run(scene()), "does not support near wall"),
    "examine": (lambda: hc.examine(scene(), "in.mine"), "near_wall: cannot be in the scene"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(kind: str) -> None:
    make, words = REFUSED[kind]
    with pytest.raises(HertzchainError, match=words):
        make()


def test_a_fixed_granule_takes_the_load_of_the_near_wall() -> None:
    walled = scene(
        SAME, FOURTH_PUSHED, precompression=LOAD, chain={"fixed": [False, True] + [False] * 4}
    )
    assert walled.granules.static_force.tolist() == [20.0, 20.0, 0.0, 0.0, 0.0, 0.0]
