"""Fixed granules and a wall at the near end: LAMMPS at the same steps, files, names, refusals."""

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

FIRST_PUSHED = hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5)
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


FIXED = {
    f"{kind}, {numbers}": held(*numbers, **more)
    for kind, more in LOADS.items()
    for numbers in ((4,), (4, 8))
}


def test_weight_is_carried_by_fixed_granules() -> None:
    scene = held(3, 6, granules=6, precompression=hc.Precompression(2.0, gravity=10.0))
    weight = 10.0 * scene.granules.mass[0]
    expected = [2 + weight, 2 + 2 * weight, 0, weight, 2 * weight]
    assert scene.granules.static_force.tolist() == pytest.approx(expected, rel=1e-14)


def test_files_and_tables(tmp_path: Path) -> None:
    scene = held(3, 8)
    unlike = {**STEEL, "radius": [1e-3, 2e-3] * 4}
    gapped = hc.Chain(8, **unlike, gap=1e-6, fixed=scene.chain.fixed)
    for one in (scene, replace(scene, chain=gapped)):
        path = tmp_path / "scene.toml"
        one.to_toml(path)
        assert hc.Scene.from_toml(path) == one


def test_no_wave_beyond_a_fixed_granule() -> None:
    """It is that of a chain that ends there, and of contacts behind nothing is awaited."""
    scene = held(9, granules=16)
    long, short = (
        hc.Native(rtol=1e-8, wanted="first").run(one)
        for one in (scene, replace(scene, chain=held(9, granules=9).chain))
    )
    waves = [usual_wave(one.scene, one.first_columns) for one in (long, short)]
    assert (waves[0].first, waves[0].last) == (waves[1].first, waves[1].last)
    assert waves[0].speed == pytest.approx(waves[1].speed, rel=1e-6)
    assert long.is_reached.tolist() == [True] * 8 + [False] * 7
    document = of_result(long)
    assert document.peaks.row(12)[-1] == ""


RADII = [4e-3, 5e-3, 3e-3, 6e-3, 5e-3, 4e-3]
THROWN = [-1.0, -1.0, 0.0, 0.0, 0.0, 0.0]
PULSE = hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5, granule=4)
LOAD = hc.Precompression(20.0)
RIGID, SAME, ELASTIC = hc.Wall("rigid"), hc.Wall("same"), hc.Wall("elastic", 70e9, 0.33)


def scene(near: hc.Wall | None = RIGID, shock: Any = None, **more: Any) -> hc.Scene:
    """Six spheres; without a shock the first two fly towards the near end."""
    chain = {**STEEL, "velocity": THROWN if shock is None else 0.0, **more.pop("chain", {})}
    shock = hc.Moving() if shock is None else shock
    return hc.Scene(hc.Chain(6, **chain), shock, hc.Run(2e-4), near_wall=near, **more)


def damped(law: hc.Contact, own: float) -> hc.Scene:
    """A chain of unlike spheres between two walls; the near one has a damping of its own."""
    near = RIGID.damped(law.with_parameter(own))
    return scene(near, contact=law, wall=ELASTIC, chain={"radius": RADII})


NEAR_WALL = {
    "both ends": scene(SAME, wall=ELASTIC, chain={"radius": RADII}),
    "gaps": scene(replace(ELASTIC, gap=1e-7), chain={"gap": 1e-7}),
    "pressed": scene(SAME, precompression=LOAD),
    "restitution": damped(hc.Contact("restitution", restitution=0.9), 0.5),
    "viscoelastic": damped(hc.Contact("viscoelastic", relaxation_time=1e-6), 2e-6),
    "pulse": scene(RIGID, replace(PULSE, granule=1)),
    "sine": scene(SAME, hc.Sine(10.0, 2e4, 2, granule=2), precompression=LOAD),
    "weight": scene(SAME, PULSE, precompression=hc.Precompression(20, 9.8), wall=RIGID),
    "fixed": scene(SAME, PULSE, precompression=LOAD, chain={"fixed": [False] * 5 + [True]}),
}


@pytest.mark.lammps
@pytest.mark.parametrize("kind", NEAR_WALL)
def test_lammps_at_the_same_steps(kind: str) -> None:
    made = NEAR_WALL[kind]
    dt = 0.02 * made.contact_time
    found = hc.Lammps(dt=dt, wanted="all").run(made)
    other = hc.Native("velocity-verlet", dt=dt, wanted="all").run(made)
    assert all(check.passed for check in [*same_steps_checks(found), *balance_checks(found)])
    # Round-off, and what lies between readings: measured 5e-8; a near wall behind a pulse: 6e-11 N.
    assert found.peak_force == pytest.approx(other.peak_force, rel=1e-7, abs=1e-9)


def test_numbers_and_names(tmp_path: Path) -> None:
    gauges = hc.Gauge(contact=1), hc.Gauge(granule=1), hc.Gauge(contact=7)
    made, path = scene(SAME, wall=RIGID, gauges=gauges), tmp_path / "scene.toml"
    made.to_toml(path)
    assert hc.Scene.from_toml(path) == made
    assert [made.contact_label(k) for k in (1, 2, 7)] == ["near wall", "2", "wall"]
    granules = NEAR_WALL["weight"].granules
    weight = 20 + 9.8 * granules.mass[1] * np.arange(7)
    assert granules.static_force == pytest.approx(weight, rel=1e-14)
    found = hc.Native(rtol=1e-6).run(made, record=100)
    written = hc.Native("scipy", rtol=1e-6).run(made)
    allowed = found.error_estimate + written.error_estimate
    assert written.peak_force == pytest.approx(found.peak_force, rel=allowed)
    assert found.to_dict()["contacts"] == found.contact.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert found.peak_at(1) == found.peak_force[0] > found.peak_at(3)
    traces = found.to_traces()
    history: Any = found.history
    assert found.displacement.shape == history.displacement[0].shape == (6,)
    assert list(traces) == ["time_s", "near_wall_N", "gauge_1_N", "wall_N"]
    mean = np.mean(history.contact_force[:, :2], axis=1)
    assert traces["gauge_1_N"].to_numpy() == pytest.approx(mean)
    traces.to_csv(tmp_path / "traces.csv", index=False)
    judged = hc.judge_traces(made, tmp_path / "traces.csv")
    assert judged
    assert judged.traces.gauges == gauges


def test_steps_that_are_shorter_where_contacts_open_follow_contact_2() -> None:
    """The near wall's contact is as hard as steel, the others as rubber: measured 3e-11."""
    rubber = [193e9] + [1e6] * 5
    made = replace(scene(chain={"young_modulus": rubber}), run=hc.Run(2e-2))
    assert hc.Native("reference", wanted="all").run(made).error_estimate < 1e-10


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
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
    "fixed": (lambda: scene(shock=PULSE, chain={"fixed": [True] + [False] * 5}), "the near wall"),
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
    made = scene(SAME, PULSE, precompression=LOAD, chain={"fixed": [False, True] + [False] * 4})
    assert made.granules.static_force.tolist() == [20.0, 20.0, 0.0, 0.0, 0.0, 0.0]
