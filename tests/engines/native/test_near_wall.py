"""A wall at the near end: it is a far wall seen in a mirror, and a fixed sphere of no curvature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import HertzchainError
from hertzchain.verdict.run_checks import balance_checks, same_steps_checks
from tests.conftest import STEEL

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


SCENES: dict[str, Callable[[], hc.Scene]] = {
    "both ends": lambda: scene(SAME, wall=ELASTIC, chain={"radius": RADII}),
    "gaps": lambda: scene(replace(ELASTIC, gap=1e-7), chain={"gap": 1e-7}),
    "pressed": lambda: scene(SAME, precompression=LOAD),
    "restitution": lambda: damped(hc.Contact("restitution", restitution=0.9), 0.5),
    "viscoelastic": lambda: damped(hc.Contact("viscoelastic", relaxation_time=1e-6), 2e-6),
    "pulse": lambda: scene(RIGID, replace(PULSE, granule=1)),
    "sine": lambda: scene(SAME, hc.Sine(10.0, 2e4, 2, granule=2), precompression=LOAD),
    "weight": lambda: scene(SAME, PULSE, precompression=hc.Precompression(20, 9.8), wall=RIGID),
    "fixed": lambda: scene(SAME, PULSE, precompression=LOAD, chain={"fixed": [False] * 5 + [True]}),
}


@pytest.mark.parametrize("kind", ["both ends", "gaps", "pressed", "restitution", "viscoelastic"])
def test_mirrored(kind: str) -> None:
    """Granules that fly to a far wall do the same, with the same steps to round-off."""
    made = SCENES[kind]()
    radius, velocity = (np.broadcast_to(x, 6)[::-1] for x in (made.chain.radius, THROWN))
    chain = replace(made.chain, radius=radius, velocity=-velocity)
    seen = replace(made, chain=chain, wall=made.near_wall, near_wall=made.wall)
    native = hc.Native("velocity-verlet", dt=0.02 * made.contact_time, wanted="all")
    found, other = native.run(made), native.run(seen)
    # The same sums in another order; measured 0 to 2e-13, and of places of 1e-5 m to 1e-18.
    assert found.peak_force == pytest.approx(other.peak_force[::-1], rel=1e-12)
    assert found.displacement == pytest.approx(-other.displacement[::-1], abs=1e-17)


def test_a_fixed_sphere_of_enormous_radius() -> None:
    """With 1e9 of the radius R* is R less 1e-9 of it, and so is the stiffness to its half."""
    unlike = {**STEEL, "radius": [1e9 * STEEL["radius"]] + [STEEL["radius"]] * 6}
    chain = hc.Chain(7, **unlike, velocity=[0, *THROWN], fixed=[True] + 6 * [False])
    native = hc.Native(rtol=1e-9, wanted="all")
    found, other = (native.run(one) for one in (scene(SAME), hc.Scene(chain, run=hc.Run(2e-4))))
    assert found.peak_force == pytest.approx(other.peak_force, rel=3e-9)


@pytest.mark.parametrize("kind", SCENES)
def test_balances(kind: str) -> None:
    balance = (found := hc.Native(rtol=1e-9, wanted="all").run(SCENES[kind]())).balance
    assert all(check.passed for check in balance_checks(found))
    # Measured 8e-11 of both at most.
    given = found.scene.largest_impulse
    assert balance.momentum == pytest.approx(balance.impulse, abs=3e-10 * given)
    assert balance.energy + balance.dissipated == pytest.approx(balance.work, rel=3e-10)


@pytest.mark.lammps
@pytest.mark.parametrize("kind", SCENES)
def test_lammps_at_the_same_steps(kind: str) -> None:
    made = SCENES[kind]()
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
    granules = SCENES["weight"]().granules
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
