"""Pistons and sines: allowed and refused values, their motion and force."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.scene.shock import Stroke
from tests.conftest import STEEL
from tests.scene.test_refused import text_of
from tests.scene.test_scene import scene_of


def test_a_velocity_and_a_table_are_read(tmp_path: Path) -> None:
    (tmp_path / "motion.csv").write_text("time_s,displacement_m\n1e-5,0\n3e-5,4e-6\n4e-5,1e-6\n")
    for text, piston in (
        ('velocity="20 cm/s"', hc.Piston(0.2)),
        ('file="motion.csv"', hc.Piston(None, (1e-5, 3e-5, 4e-5), (0, 4e-6, 1e-6))),
    ):
        assert scene_of(tmp_path, text_of(f"piston shock.{text}")).shock == piston


def test_strokes_follow_the_table() -> None:
    rows = (1.0, 3.0, 4.0), (0.0, 4.0, 1.0)
    piston = hc.Piston(None, *rows)
    assert piston.strokes == (
        Stroke(0.0, 0.0, 0.0), Stroke(1.0, 0.0, 2.0), Stroke(3.0, 4.0, -3.0), Stroke(4.0, 1.0, 0.0)
    )  # fmt: skip
    assert piston.impact_velocity == 3.0
    travelled = [piston.distance(t) for t in (0.5, 2.0, 3.5, 9.0)]
    assert travelled == pytest.approx([0.0, 2.0, 5.5, 7.0], rel=1e-14)
    times = np.linspace(0.0, 6.0, 25)
    place = [max((s for s in piston.strokes if s.start <= t), key=lambda s: s.start)
             .displacement_at(t) for t in times]  # fmt: skip
    assert place == pytest.approx(np.interp(times, *rows), abs=1e-15)
    # Without a row at 0 there is no rest before it.
    assert hc.Piston(None, (0.0, 1.0), (0.0, 1.0)).strokes[0] == Stroke(0.0, 0.0, 1.0)


def test_steps_end_where_the_velocity_changes() -> None:
    chain = hc.Chain(10, **STEEL)
    scene = hc.Scene(chain, hc.Piston(None, (1e-5, 3e-5, 4e-5), (0, 4e-6, 1e-6)), hc.Run(3.5e-5))
    legs = scene.schedule(3e-6)
    assert [(leg.start, leg.end, leg.steps) for leg in legs] == [
        (0.0, 1e-5, 4), (1e-5, 3e-5, 7), (3e-5, 3.5e-5, 2)
    ]  # fmt: skip
    velocities = [leg.stroke.velocity for leg in legs if leg.stroke is not None]
    assert velocities == pytest.approx([0.0, 0.2, -0.3], rel=1e-12)
    assert all(leg.ramp is None for leg in legs)
    scaled = legs[1].in_units(2.0, 1.0, 3.0).stroke
    assert (scaled.start, scaled.displacement) == (0.5e-5, 0.0)
    assert scaled.velocity == pytest.approx(0.2 / 3 * 2, rel=1e-12)


def test_the_mass_of_a_piston_is_infinite() -> None:
    chain, load = hc.Chain(6, **STEEL), hc.Precompression(2.0, 9.81)
    scene = hc.Scene(chain, hc.Piston(0.1), wall=hc.Wall("same"), precompression=load)
    granules = scene.granules
    assert math.isinf(granules.mass[0])
    assert granules.contact_mass[0] == granules.mass[1]
    assert granules.contact_mass[1:-1] == pytest.approx(granules.mass[2:] / 2)
    assert granules.constant_force[0] == 0
    # The static load is that of a free granule 1, whose weight is carried, too.
    free = replace(scene, shock=hc.Striker(0.1, loaded=True)).granules
    assert np.array_equal(granules.static_force, free.static_force)


def test_the_scale_is_a_collision_with_the_fastest_stroke() -> None:
    chain = hc.Chain(6, **STEEL)
    slow = hc.Scene(chain, hc.Piston(0.1))
    table = hc.Scene(chain, hc.Piston(None, (0.0, 1e-4, 2e-4), (0.0, 2e-6, -8e-6)))
    # Energy m v^2 / 2 = 2/5 A d^(5/2).
    force = (1.25 * chain.granule_mass * 0.1**2) ** 0.6 * chain.contact_stiffness**0.4
    for scene in (slow, table):
        assert scene.peak_force == pytest.approx(force, rel=1e-14)
    # A striker of the same mass gives m* v, with m* = m / 2, twice; a piston with m* = m.
    striker = hc.Scene(chain, hc.Striker(0.1))
    units = [s.units.momentum for s in (slow, striker)]
    assert slow.momentum_ratio == pytest.approx(striker.momentum_ratio, rel=1e-12)
    assert units[0] / units[1] == pytest.approx(2.0, rel=1e-12)


def test_a_chain_between_piston_and_wall_has_the_scale_of_its_rest() -> None:
    chain, far = hc.Chain(6, **STEEL), 1e-4
    table = hc.Piston(None, (0.0, 1.0), (0.0, far))
    scene = hc.Scene(chain, table, wall=hc.Wall("same"))
    overlaps = (scene.units.force / scene.granules.stiffness) ** (2 / 3)
    assert np.sum(overlaps) == pytest.approx(far, rel=1e-12)
    free = hc.Scene(chain, table)
    assert free.units.force == free.peak_force
    # A constant velocity goes as far as the run lasts.
    run = hc.Run(0.5)
    long = hc.Scene(chain, hc.Piston(2 * far), run, wall=hc.Wall("same"))
    assert long.units.force == pytest.approx(scene.units.force, rel=1e-12)
    # A run that ends before has another.
    half = hc.Scene(chain, table, hc.Run(0.5), wall=hc.Wall("same"))
    assert half.units.force == pytest.approx(scene.units.force / 2**1.5, rel=1e-12)


def test_the_default_end_counts_from_the_last_row() -> None:
    chain = hc.Chain(10, **STEEL)
    early, late = (
        hc.Scene(chain, hc.Piston(None, (t, t + 1e-5), (0.0, 1e-6))).end_time for t in (0.0, 1e-3)
    )
    assert late - early == pytest.approx(1e-3, rel=1e-12)


# Sines


def test_the_force_is_a_sine() -> None:
    shock = hc.Sine(5.0, 8000.0, 3)
    scene = hc.Scene(hc.Chain(5, **STEEL), shock, precompression=hc.Precompression(5.0))
    time = np.linspace(-1e-4, 5e-4, 1201)
    within = (time >= 0) & (time < 3 / 8000)
    expected = np.where(within, 5 * np.sin(2 * np.pi * 8000 * time), 0.0)
    # The force changes by 1e-14 N while the time changes by its last digit.
    assert scene.applied_force(time) == pytest.approx(expected, rel=0, abs=3e-14)
    # Whole cycles leave nothing; half of one is what LM_ratio is measured by.
    assert scene.impulse == pytest.approx(0.0, abs=1e-15 * shock.compared_impulse)
    half = hc.Scene(scene.chain, shock, hc.Run(0.5 / 8000), precompression=scene.precompression)
    assert half.applied_impulse == pytest.approx(shock.compared_impulse, rel=1e-14)
    assert half.momentum_ratio > 0
    assert [ramp.start for ramp in scene.ramps] == [k / 32000 for k in range(12)]


def test_waves_of_short_cycles_are_as_fast_as_those_of_long_ones() -> None:
    chain, load = hc.Chain(20, **STEEL), hc.Precompression(10.0)

    def watched(frequency: float, wall: hc.Wall | None) -> float:
        """Return the default time between the ends of sine and run."""
        sine = hc.Sine(5.0, frequency, 4)
        scene = hc.Scene(chain, sine, wall=wall, precompression=load)
        return scene.end_time - 4 / frequency

    for wall in (None, hc.Wall("rigid")):
        # LM_ratio is 1 at 7.9 kHz.
        assert watched(1e12, wall) == pytest.approx(watched(8e3, wall), rel=0.02)
        assert watched(1e30, wall) == pytest.approx(watched(1e12, wall), rel=1e-9)
