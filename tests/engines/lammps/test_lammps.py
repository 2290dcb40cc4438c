"""The LAMMPS oracle against the native one, and against known answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.external.observation import contact_forces
from hertzchain.engines.lammps.deck import set_up
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.lammps.engine import command, engine, granules
from hertzchain.engines.native.plan import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.errors import SceneError
from hertzchain.observables.peaks import largest_difference
from tests import scenes
from tests.conftest import STEEL, paper_scene
from tests.engines.native.test_native import slope

pytestmark = pytest.mark.lammps

VERLET = METHODS["velocity-verlet"].walker


def largest(measured: FloatArray, expected: FloatArray) -> float:
    """Largest difference as a fraction of the largest value expected."""
    return float(np.max(np.abs(measured - expected)) / np.max(np.abs(expected)))


def slopes(displacement: FloatArray, dt: float) -> FloatArray:
    """Slopes by differences over five points, of fourth order."""
    u, slope = displacement, np.empty_like(displacement)
    slope[2:-2] = (8 * (u[3:-1] - u[1:-3]) - (u[4:] - u[:-4])) / 12
    for sign, k in ((1, np.arange(5)), (-1, np.arange(-1, -6, -1))):
        slope[k[0]] = sign * np.array([-25, 48, -36, 16, -3]) @ u[k] / 12
        slope[k[1]] = sign * np.array([-3, -10, 18, -6, 1]) @ u[k] / 12
    return slope / dt


@pytest.mark.parametrize(
    ("extrapolated", "steps", "tolerance"),
    # Readings and opening contacts are not of fourth order, but small here.
    [(False, [0.08, 0.04, 0.02, 0.01], 0.02), (True, [0.08, 0.04, 0.02], 0.1)],
)
def test_order_of_peaks(
    demo: hc.Scene,
    demo_reference: hc.Result,
    extrapolated: bool,
    steps: list[float],
    tolerance: float,
) -> None:
    errors = []
    for step in steps:
        result = hc.Lammps(step * demo.units.time, extrapolated=extrapolated).run(demo)
        errors.append(largest_difference(result.peak_force, demo_reference.peak_force))
        assert errors[-1] < result.error_estimate
    assert slope(steps, errors) == pytest.approx(4.0 if extrapolated else 2.0, abs=tolerance)


@pytest.mark.parametrize(
    ("name", "lammps"),
    [
        # The last needs a second try: where the trials ask for, the estimate is 1.01e-6.
        *(
            (name, hc.Lammps())
            for name in ("demo", "cosine_LM0.3_n2", "cosine-triangular_LM0.4_n2")
        ),
        *(
            ("demo", hc.Lammps(rtol=rtol, extrapolated=e))
            for rtol in (1e-3, 1e-5)
            for e in (False, True)
        ),
        *(
            pytest.param(
                name, hc.Lammps(extrapolated=True), marks=[] if k % 4 == 1 else pytest.mark.slow
            )
            for k, name in enumerate(scenes.NAMES)
        ),
    ],
)
def test_the_wanted_error(name: str, lammps: hc.Lammps) -> None:
    scene = scenes.load(name)
    result = lammps.run(scene)
    error = largest_difference(result.peak_force, hc.Native("reference").run(scene).peak_force)
    assert error < result.error_estimate <= lammps.rtol
    # No better than asked for by more than steps of a sixteenth would be.
    assert result.error_estimate > lammps.rtol / 300
    if lammps.extrapolated:
        assert result.steps < 20_000  # velocity Verlet alone takes 66,000 or more


def test_mass_and_force_are_those_of_equation_1() -> None:
    # LAMMPS is given E, nu, R and rho only; a wrong mass or stiffness on either side shows.
    scene = paper_scene("cosine", 1.0, 2.0, granules=3)
    for pair_style in PAIR_STYLES:
        with engine() as lammps:
            command(lammps, set_up(scene, pair_style))
            assert granules(lammps).mass == pytest.approx(
                [scene.chain.granule_mass] * 3, rel=1e-14, abs=0
            )
            overlap = 3e-6
            command(lammps, f"displace_atoms first move {overlap!r} 0 0 units box\nrun 0 post no")
            force = contact_forces(lammps.numpy.extract_atom("f")[:, 0])
        # The position at 2R = 9.5 mm is known to 1e-18 m: 4e-13 of the overlap.
        expected = scene.chain.contact_stiffness * overlap**1.5
        assert force == pytest.approx([expected, 0.0], rel=1e-11, abs=0)


def test_derivatives_are_those_of_the_displacements(demo: hc.Scene) -> None:
    # Velocity Verlet's own are off by dt^2 / 6 times the third and dt^2 / 12 times the fourth.
    dt = 0.02 * demo.units.time
    times = np.arange(1000, 1400) * dt
    often = hc.Lammps(dt, read_every=1).run(demo, record=times)
    seldom = hc.Lammps(dt, read_every=10).run(demo, record=times)
    expected, measured = slopes(often.history.displacement, dt), seldom.history.velocity
    # The differences are off by dt^4 / 30 times the fifth derivative, 3e-7 of the velocity;
    # uncorrected velocities are off by 1e-4.
    assert largest(measured, expected) < 1e-6


def test_the_work_of_a_pulse_shorter_than_the_readings_are_apart() -> None:
    # Half a natural time unit to rise: with one reading at its end the work is off by 6e-6.
    result = hc.Lammps().run(paper_scene("cosine", 0.3, 2.0, granules=5))
    energy = 2 * result.error_estimate
    assert result.balance.energy == pytest.approx(result.balance.work, rel=energy, abs=0)


def test_granules_thrown_far_are_not_lost() -> None:
    # The chain flies apart by several diameters: the box has to follow.
    pulse = hc.Pulse("cosine", 1e5, 2.0, momentum_ratio=0.5)
    scene = hc.Scene(hc.Chain(5, **STEEL), pulse)
    scene = replace(scene, run=hc.Run(150 * scene.units.time))
    result = hc.Lammps(dt=0.05 * scene.units.time).run(scene)
    assert result.displacement[-1] > 6 * scene.chain.radius
    twin = simulate(scene, scene.schedule(result.dt), VERLET)
    assert largest(result.velocity / scene.units.velocity, twin.velocity) < 1e-11


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"dt": 0.0}, "dt"),
        ({"pair_style": "lj/cut"}, "pair_style"),
        ({"read_every": 0}, "read_every"),
        *(({"rtol": rtol}, "rtol") for rtol in (0.0, -1e-6, 1.0, float("nan"))),
        ({"ranks": 2}, "ranks = 2: the lammps module runs on one process"),
        ({"ranks": 0, "lmp": "lmp"}, "ranks = 0: must be at least 1"),
    ],
)
def test_impossible_parameters_are_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(SceneError, match=f"^{words}"):
        hc.Lammps(**arguments)  # type: ignore[arg-type]


def test_a_reading_too_seldom_is_in_the_error_estimate() -> None:
    scene = paper_scene("cosine-triangular", 2.0, 2.0, granules=12)
    result = hc.Lammps(dt=0.002 * scene.units.time, read_every=400).run(scene)
    error = largest_difference(result.peak_force, hc.Native("reference").run(scene).peak_force)
    # 1e-4 h^8 = 1.7e-5 from 0.8 time units between readings; the steps cost 1e-6.
    assert 4e-6 < error < result.error_estimate < 1e-4


# Extrapolation


# Cost of watching


@pytest.mark.parametrize("extrapolated", [False, True])
def test_peaks_alone_and_a_record_change_nothing(extrapolated: bool) -> None:
    scene = paper_scene("triangular", 1.5, 3.0, granules=8)
    backend = hc.Lammps(rtol=1e-4, extrapolated=extrapolated)
    whole, recorded = backend.run(scene), backend.run(scene, np.linspace(0, scene.end_time, 20))
    peaks, steps = replace(backend, dt=whole.dt).peaks_alone(scene)
    assert recorded.history is not None
    for name in ("peak_force", "peak_time", "displacement", "velocity"):
        assert np.array_equal(getattr(whole, name), getattr(recorded, name)), name
    assert (whole.error_estimate, whole.steps) == (recorded.error_estimate, recorded.steps)
    if extrapolated:
        # The legs are cut from coarser ones, so a step may differ by one in a hundred.
        assert largest_difference(peaks, whole.peak_force) < whole.error_estimate
        assert steps == pytest.approx(whole.steps, rel=0.02)
    else:
        assert peaks.tolist() == whole.peak_force.tolist()
        assert steps == whole.steps
