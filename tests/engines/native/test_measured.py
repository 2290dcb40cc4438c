"""What laboratories have: their pulses, a bead on a sensor, contacts and masses as measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.contact import hertz
from hertzchain.errors import RunFailed, SceneError
from hertzchain.known.answer import lammps_deck, program_deck
from tests.conftest import STEEL
from tests.known.test_deck import verdict
from tests.scenes import force_of

BEAD = {"radius": 4e-3, "young_modulus": 203e9, "poisson_ratio": 0.3, "density": 7780.0}
ON_SENSOR = hc.Scene(hc.Chain(1, **BEAD, velocity=0.31), wall=hc.Wall("same"))
STIFFNESS = (7e9, 1e10, 8e9, 1e10, 8e9, 1.2e10)
MASS = (4e-3, 9e-3) * 3
CYLINDERS = hc.Chain(6, 5e-3, stiffness=STIFFNESS, mass=MASS, length=(1e-2, 2e-2) * 3)
PULSES = [hc.HalfSine(50.0, 6e-5), hc.Sawtooth(50.0, 6e-5), hc.Trapezoid(50.0, 2e-4, 2e-5, 3e-5)]


@pytest.mark.parametrize("shock", PULSES, ids=lambda shock: shock.noun)
def test_a_pulse_is_its_table(shock: Any) -> None:
    time = np.linspace(0, shock.duration, 10_001)
    scene = hc.Scene(hc.Chain(12, **STEEL), shock)
    force = force_of(shock, time)
    force[-1] = shock.peak_force if isinstance(shock, hc.Sawtooth) else 0.0
    table = replace(
        scene, shock=hc.PulseTable(tuple(time), tuple(force)), run=hc.Run(scene.end_time)
    )
    peaks = hc.Native(rtol=1e-7).run(table).peak_force
    # A table of a half sine has 1e-8 less impulse; both runs are right to 1e-7.
    assert hc.Native(rtol=1e-7).run(scene).peak_force == pytest.approx(peaks, rel=3e-7)
    assert scene.momentum_ratio == pytest.approx(table.momentum_ratio, rel=1e-7)


def test_a_bead_on_a_sensor() -> None:
    """Force and contact time of two spheres, of which one has no end (Hertz)."""
    result = hc.Native(rtol=1e-9).run(ON_SENSOR)
    table, mass = result.to_frame().iloc[0], float(ON_SENSOR.granules.mass[0])
    stiffness = float(ON_SENSOR.granules.stiffness[0])
    force = hertz.impact_force(stiffness, mass, 0.31)
    assert force == pytest.approx(67.404, rel=1e-5)
    assert result.peak_force == pytest.approx([force], rel=1e-9)
    lasts = 2.943275184 * (force / stiffness) ** (2 / 3) / 0.31
    # The constant has ten digits; the end of the contact is found to its own bound.
    assert table["contact_time_s"] == pytest.approx(lasts, rel=1e-8)
    assert result.restitution == pytest.approx((1.0, 1.0), rel=1e-9)


def test_a_restitution_is_that_of_the_wall() -> None:
    law = hc.Contact("restitution", restitution=0.9)
    result = hc.Native(rtol=1e-8).run(replace(ON_SENSOR, contact=law))
    asked = hc.theory.restitution.of_ratio(hc.theory.restitution.damping_ratio(0.9), pulls=False)
    assert result.restitution == pytest.approx((asked, asked), rel=1e-7)
    assert hc.Native().run(hc.Scene(hc.Chain(4, **STEEL), PULSES[0])).restitution is None


DECKS = {
    "bead": ON_SENSOR,
    "cylinders": hc.Scene(CYLINDERS, PULSES[2], wall=hc.Wall(stiffness=2e10)),
    "near wall": hc.Scene(
        replace(CYLINDERS, velocity=(-1.0, *[0.0] * 5)), near_wall=hc.Wall(), run=hc.Run(2e-4)
    ),
    "damped": hc.Scene(
        CYLINDERS, hc.Striker(1.0), contact=hc.Contact("viscoelastic", relaxation_time=1e-7)
    ),
}


@pytest.mark.lammps
@pytest.mark.parametrize("name", DECKS)
def test_lammps_and_its_deck(name: str, tmp_path: Path) -> None:
    comparison = hc.compare(DECKS[name], record=20)
    assert [check for check in comparison.checks if not check.passed] == []
    path = tmp_path / "in.chain"
    path.write_text(lammps_deck(DECKS[name], None, 1e-3, "trial"), encoding="utf-8")
    assert verdict(path) == "PASS"


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
@pytest.mark.parametrize("name", ["bead", "cylinders"])
def test_other_codes_refuse(name: str, engine: str) -> None:
    with pytest.raises(RunFailed, match=r"not support .*(single granule|measured granules)"):
        program_deck(engine, DECKS[name], None, 1e-3, "trial")


def test_files(tmp_path: Path) -> None:
    scene = DECKS["cylinders"]
    scene.to_toml(tmp_path / "cylinders.toml")
    assert hc.Scene.from_toml(tmp_path / "cylinders.toml") == scene
    assert "stiffness_N_m-1.5,mass_kg,length_m" in (tmp_path / "cylinders.granules.csv").read_text()


WALL = hc.Wall("rigid")
REFUSED: dict[str, Any] = {
    "at least 2 without a wall": lambda: hc.Scene(hc.Chain(1, **BEAD), PULSES[0]),
    "at least 2: the piston is granule 1": lambda: hc.Scene(
        hc.Chain(1, **BEAD), hc.Piston(1.0), wall=WALL
    ),
    "not allowed with stiffness": lambda: hc.Chain(6, **BEAD, stiffness=1e10),
    "not allowed with mass": lambda: hc.Chain(6, **BEAD, mass=4e-3),
    "density.*missing": lambda: hc.Chain(6, 5e-3, stiffness=1e10),
    "chain.stiffness replaces": lambda: hc.Scene(CYLINDERS, PULSES[0], wall=WALL),
    "or give stiffness": lambda: hc.Scene(CYLINDERS, PULSES[0], wall=hc.Wall()),
    "first segment describes a measured granule 1": lambda: hc.Scene(
        CYLINDERS, hc.Striker(1.0, density=2e3)
    ),
    "no measured stiffness tells": lambda: hc.Scene(
        replace(CYLINDERS, yield_strength=1e9), PULSES[0]
    ),
    "at most duration - rise_time": lambda: hc.Trapezoid(1.0, 1e-4, 6e-5, 5e-5),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_a_refusal_says_what_is_allowed(sentence: str) -> None:
    with pytest.raises(SceneError, match=sentence):
        REFUSED[sentence]()


def test_a_momentum_ratio_of_a_half_sine_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    hc.Scene(hc.Chain(12, **STEEL), PULSES[0]).to_toml(path)
    path.write_text(path.read_text() + "momentum_ratio = 1.0\n")
    with pytest.raises(
        SceneError, match=r"shock.momentum_ratio = 1.0: unknown key, allowed are peak_force"
    ):
        hc.Scene.from_toml(path)
