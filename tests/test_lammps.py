"""The LAMMPS oracle against the native one, and against what is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import Array
from hertzchain.errors import RunFailed
from hertzchain.lammps import round_off
from hertzchain.lammps.deck import PAIR_STYLES
from hertzchain.lammps.engine import command, engine
from hertzchain.lammps.reading import contact_forces, masses
from hertzchain.native import METHODS, simulate
from hertzchain.peaks import largest_difference
from hertzchain.theory import solitary_wave as exact
from tests import scenes
from tests.conftest import STEEL, paper_scene
from tests.test_native import constant_force, slope

pytestmark = pytest.mark.lammps

VERLET = METHODS["velocity-verlet"].walker


def largest(measured: Array, expected: Array) -> float:
    """Largest difference as a fraction of the largest value expected."""
    return float(np.max(np.abs(measured - expected)) / np.max(np.abs(expected)))


@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize("name", scenes.NAMES)
def test_same_scheme_same_steps(name: str, pair_style: str) -> None:
    # Round-off from absolute coordinates is all that may differ: measured 3e-9 and 8e-10.
    scene = scenes.load(name)
    units, dt = scene.units, 0.01 * scene.units.time
    twin = simulate(scene, scene.schedule(dt), VERLET)
    result = hc.Lammps(dt, pair_style).run(scene)
    assert largest(result.displacement / units.length, twin.state.displacement) < 2e-8
    assert largest(result.velocity / units.velocity, twin.state.velocity) < 2e-8
    assert largest_difference(result.peak_force / units.force, twin.peaks.force) < 1e-8


def test_peaks_are_second_order(demo: hc.Scene, demo_reference: hc.Result) -> None:
    steps = [0.08, 0.04, 0.02, 0.01, 0.005]
    runs = [hc.Lammps(dt=step * demo.units.time).run(demo) for step in steps]
    errors = [largest_difference(run.peak_force, demo_reference.peak_force) for run in runs]
    assert slope(steps, errors) == pytest.approx(2.0, abs=0.02)
    for run, error in zip(runs, errors, strict=True):
        assert error < run.error_estimate


@pytest.mark.parametrize("name", ["demo", "cosine_LM0.3_n2", "triangular_LM0.4_n8"])
def test_the_default_step_gives_1e_6(name: str) -> None:
    scene = scenes.load(name)
    result = hc.Lammps().run(scene)
    error = largest_difference(result.peak_force, hc.Native().run(scene).peak_force)
    assert error < result.error_estimate <= 1e-6


def test_reading_now_and_then_loses_nothing() -> None:
    scene = paper_scene("cosine", 0.5, 2.0, granules=20)
    dt = 0.002 * scene.units.time
    often = hc.Lammps(dt, read_every=1).run(scene)
    seldom = hc.Lammps(dt).run(scene)
    # 0.03 h dt^2 is kept at 5e-9.
    assert largest_difference(seldom.peak_force, often.peak_force) < 1e-8
    # Only how LAMMPS adds up the time, and so the force, depends on where a run is cut.
    assert largest(seldom.velocity, often.velocity) < 1e-10


def test_mass_and_force_are_those_of_equation_1() -> None:
    # LAMMPS is given E, nu, R and rho only; a wrong mass or stiffness on either side shows.
    scene = paper_scene("cosine", 1.0, 2.0, granules=3)
    from hertzchain.lammps.deck import set_up

    for pair_style in PAIR_STYLES:
        with engine() as lammps:
            command(lammps, set_up(scene, pair_style))
            assert masses(lammps) == pytest.approx([scene.chain.granule_mass] * 3, rel=1e-14, abs=0)
            overlap = 3e-6
            command(lammps, f"displace_atoms first move {overlap!r} 0 0 units box\nrun 0 post no")
            force = contact_forces(lammps.numpy.extract_atom("f")[:, 0])
        # The position at 2R = 9.5 mm is known to 1e-18 m: 4e-13 of the overlap.
        expected = scene.chain.contact_stiffness * overlap**1.5
        assert force == pytest.approx([expected, 0.0], rel=1e-11, abs=0)


def test_contact_forces_from_net_forces() -> None:
    contact = np.array([5.0, 3.0, 0.0, 2.0])
    net = np.concatenate([[7.0], contact]) - np.concatenate([contact, [0.0]])
    assert contact_forces(net) == pytest.approx(contact, abs=1e-15)


@pytest.mark.parametrize("name", ["demo", "cosine_LM0.3_n2"])
def test_momentum_and_energy_balance(name: str) -> None:
    result = hc.Lammps().run(scenes.load(name))
    assert result.balance.momentum == pytest.approx(result.balance.impulse, rel=1e-12, abs=0)
    # The energy of a second-order run is off by what its forces are off.
    energy = 2 * result.error_estimate
    assert result.balance.energy == pytest.approx(result.balance.work, rel=energy, abs=0)


def test_the_far_field_wave_has_the_exact_speed() -> None:
    scene = paper_scene("cosine", 0.5, 6.0, granules=400)
    result = hc.Lammps(dt=0.02 * scene.units.time).run(scene)
    contacts = 100 / (result.peak_time[298] - result.peak_time[198]) * scene.units.time
    force = result.peak_force[248] / scene.units.force
    # Second order in the step: 1e-6 measured at 0.02.
    assert contacts / force ** (1 / 6) == pytest.approx(
        exact.solitary_wave().speed, rel=1e-5, abs=0
    )


@pytest.mark.parametrize(
    ("material", "peak_force"),
    [
        ({**STEEL, "radius": 0.02}, 2e4),
        ({"radius": 1e-3, "young_modulus": 3e9, "poisson_ratio": 0.45, "density": 1180.0}, 2.0),
        ({"radius": 0.3, "young_modulus": 70e9, "poisson_ratio": -0.2, "density": 2700.0}, 5e6),
    ],
)
def test_scaled_scenes_in_si(material: dict[str, float], peak_force: float) -> None:
    pulse = hc.Pulse("triangular", peak_force, 3.0, momentum_ratio=1.3)
    scene = hc.Scene(hc.Chain(12, **material), pulse)
    dt = 0.01 * scene.units.time
    natural = simulate(scene, scene.schedule(dt), VERLET).peaks.force
    result = hc.Lammps(dt).run(scene)
    assert largest_difference(result.peak_force / peak_force, natural) < 1e-7


def test_two_granules_under_a_constant_force() -> None:
    result = hc.Lammps().run(constant_force())
    assert result.peak_force == pytest.approx([125.0], rel=1e-6, abs=0)


def test_a_pulse_table_with_jumps_against_native() -> None:
    # It starts late and at a force, jumps to zero in between two rows' slopes and ends at a force.
    table = hc.PulseTable((1e-5, 2e-5, 5e-5, 6e-5), (40.0, 100.0, 0.0, 70.0))
    scene = hc.Scene(hc.Chain(12, **STEEL), table)
    dt = 0.01 * scene.units.time
    twin = simulate(scene, scene.schedule(dt), VERLET)
    result = hc.Lammps(dt).run(scene)
    assert largest_difference(result.peak_force / 100.0, twin.peaks.force) < 1e-8
    assert largest(result.velocity / scene.units.velocity, twin.state.velocity) < 2e-8
    assert result.balance.momentum == pytest.approx(scene.impulse, rel=1e-12, abs=0)


def test_granules_thrown_far_are_not_lost() -> None:
    # The chain flies apart by several diameters: the box has to follow.
    pulse = hc.Pulse("cosine", 1e5, 2.0, momentum_ratio=0.5)
    scene = hc.Scene(hc.Chain(5, **STEEL), pulse)
    scene = replace(scene, run=hc.Run(150 * scene.units.time))
    result = hc.Lammps(dt=0.05 * scene.units.time).run(scene)
    assert result.displacement[-1] > 6 * scene.chain.radius
    twin = simulate(scene, scene.schedule(result.dt), VERLET)
    assert largest(result.velocity / scene.units.velocity, twin.state.velocity) < 2e-8


def test_a_step_that_is_too_large_is_said() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, granules=5)
    with pytest.raises(RunFailed, match="smaller dt"):
        hc.Lammps(dt=50 * scene.units.time).run(scene)


def test_an_error_of_lammps_is_one_sentence() -> None:
    with (
        engine() as lammps,
        pytest.raises(RunFailed, match="pair_style nonsense"),
    ):
        command(
            lammps, "units si\nregion box block 0 1 0 1 0 1\ncreate_box 1 box\npair_style nonsense"
        )


@pytest.mark.parametrize("argument", [{"dt": 0.0}, {"pair_style": "lj/cut"}, {"read_every": 0}])
def test_impossible_parameters_are_refused(argument: dict[str, object]) -> None:
    with pytest.raises(hc.HertzchainError, match=next(iter(argument))):
        hc.Lammps(**argument)  # type: ignore[arg-type]


def test_a_reading_too_seldom_is_in_the_error_estimate() -> None:
    scene = paper_scene("cosine-triangular", 2.0, 2.0, granules=12)
    result = hc.Lammps(dt=0.002 * scene.units.time, read_every=200).run(scene)
    error = largest_difference(result.peak_force, hc.Native().run(scene).peak_force)
    assert 4e-6 < error < result.error_estimate  # 9e-6 from 0.4 time units between readings


def test_the_digits_lost_by_a_weak_shock_are_in_the_error_estimate() -> None:
    pulse = hc.Pulse("cosine-triangular", 1e-6, 2.0, momentum_ratio=2.0)
    scene = hc.Scene(hc.Chain(60, **STEEL), pulse)
    dt = 0.02 * scene.units.time
    result = hc.Lammps(dt).run(scene)
    twin = simulate(scene, scene.schedule(dt), VERLET).peaks.force
    lost = largest_difference(result.peak_force / 1e-6, twin)
    # Measured 3e-5; a bound, but not one without meaning.
    assert lost < round_off(scene, result.steps, result.peak_force) < 100 * lost


def test_an_overlap_of_half_a_radius_is_refused() -> None:
    pulse = hc.Pulse("cosine", 1e6, 2.0, momentum_ratio=1.0)
    with pytest.raises(RunFailed, match="half a radius"):
        hc.Lammps().run(hc.Scene(hc.Chain(5, **STEEL), pulse))
