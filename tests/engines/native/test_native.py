"""The native oracle: convergence, conservation, scaling, and answers known otherwise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.in_numpy import simulate_in_numpy
from hertzchain.engines.native.methods import METHODS, SRKN_11B, Walker
from hertzchain.engines.native.simulation import simulate
from hertzchain.errors import RunFailed
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.schedule import Leg
from hertzchain.theory import solitary_wave as exact
from tests import scenes
from tests.conftest import STEEL, paper_scene

REFERENCE = METHODS["reference"].walker
WIDER = np.finfo(np.longdouble).eps < np.finfo(np.float64).eps


def natural_peaks(
    scene: hc.Scene, step: float, walker: Any = REFERENCE, dtype: Any = np.float64
) -> Any:
    """Peaks in natural units of one run with a step in natural units."""
    legs = scene.schedule(step * scene.units.time)
    if dtype is np.longdouble:  # which the kernels cannot
        return simulate_in_numpy(scene, legs, walker, dtype=dtype).peaks.force
    return simulate(scene, legs, walker).peaks.force


def test_forces_are_those_of_equation_1() -> None:
    displacement = np.array([3.0, 1.0, 0.75, 1.0])  # overlaps 2, 1/4 and a gap
    chain = Chain.plain(4)
    assert chain.overlap(displacement).tolist() == [2.0, 0.25, -0.25]
    assert chain.contact_force(chain.overlap(displacement)) == pytest.approx(
        [2**1.5, 0.125, 0.0], rel=1e-15, abs=0
    )
    expected = [7 - 2**1.5, 2**1.5 - 0.125, 0.125, 0.0]
    assert chain.acceleration(displacement, 7.0) == pytest.approx(expected, rel=1e-15, abs=0)


def test_the_first_peaks_of_the_demo_scene(demo_reference: hc.Result) -> None:
    # Found by two solvers that are not part of this project, printed to 1e-6 N.
    known = [
        *(105.407030, 116.244387, 125.615554, 133.058614, 138.729185),
        *(142.923076, 145.953014, 148.097936, 149.587218, 150.601174),
    ]
    assert demo_reference.peak_force[:10] == pytest.approx(known, abs=5.1e-7)


@pytest.mark.parametrize("name", scenes.NAMES)
def test_reference_stays_when_its_step_is_quartered(name: str) -> None:
    scene, step = scenes.load(name), METHODS["reference"].step
    moved = largest_difference(natural_peaks(scene, step), natural_peaks(scene, step / 4))
    assert moved < 1e-10  # measured: at most 2e-13


def test_without_refinement_opening_contacts_spoil_the_reference() -> None:
    scene = paper_scene("cosine", 0.5, 6.0)
    true = natural_peaks(scene, 0.05)
    plain = largest_difference(natural_peaks(scene, 0.05, Walker(SRKN_11B)), true)
    refined = largest_difference(natural_peaks(scene, 0.1), true)
    assert plain > 1e-9  # measured 1.1e-8
    assert refined < 1e-11  # measured 6e-12, at twice the step


@pytest.mark.skipif(not WIDER, reason="long double is no wider than float64 on this machine")
@pytest.mark.parametrize(
    ("scene", "tolerance"),
    [(("cosine-triangular", 2.0, 2.0), 1e-12), (("cosine", 0.5, 6.0), 1e-10)],
)
def test_long_double_confirms_the_reference(
    scene: tuple[str, float, float], tolerance: float
) -> None:
    # Half the step and a thousandth of the refinement tolerance leave round-off as the difference.
    finer = Walker(SRKN_11B, 1e-13, 32, math.inf)
    chosen = paper_scene(*scene, granules=24)
    true = natural_peaks(chosen, 0.025, finer, np.longdouble)
    assert true.dtype == np.longdouble
    step = METHODS["reference"].step
    assert largest_difference(natural_peaks(chosen, step), true) < tolerance


def slope(steps: list[float], errors: list[float]) -> float:
    """Order of convergence: slope of the error over the step, both logarithmic."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def test_the_far_field_wave_has_the_exact_speed() -> None:
    scene = paper_scene("cosine", 0.5, 6.0, granules=400)
    legs = scene.schedule(METHODS["reference"].step * scene.units.time)
    peaks = simulate(scene, legs, REFERENCE).peaks
    speed = 100 / (peaks.time[298] - peaks.time[198])
    assert exact.solitary_wave().speed == pytest.approx(0.9055157764, abs=5e-11)
    # Measured 1e-13; the transition has died away by contact 200.
    assert speed / peaks.force[248] ** (1 / 6) == pytest.approx(0.9055157764, rel=1e-9, abs=0)


def constant_force(granules: int = 2) -> hc.Scene:
    """Return a constant force of 100 N as a pulse table."""
    chain = hc.Chain(granules, **STEEL)
    table = hc.PulseTable((0.0, 1e-3), (100.0, 100.0))
    return hc.Scene(chain, table, hc.Run(end_time=2e-4))


def test_two_granules_under_a_constant_force_peak_at_five_quarters() -> None:
    result = hc.Native("reference").run(constant_force())
    # r'' = 1 - 2 r^(3/2) in natural units has r'^2 = 2 (r - 4/5 r^(5/2)), 0 at r^(3/2) = 5/4.
    assert result.peak_force == pytest.approx([125.0], rel=1e-12, abs=0)


def test_a_peak_at_the_very_end_of_a_step_has_its_time() -> None:
    scene = constant_force()
    unit = scene.units.time

    def peak_time(end: float, steps: int) -> float:
        legs = (Leg(0.0, end * unit, steps, scene.ramps[0]),)
        return float(simulate(scene, legs, METHODS["reference"].walker).peaks.time[0])

    between = peak_time(4.0, 37)
    # Now the peak is where a step ends and the next begins; rounding decides in which it is found.
    for steps in (20, 30, 40, 50):
        # A peak is flat: its time is known to the root of rounding, and a step is 0.08 at least.
        assert peak_time(2 * between, steps) == pytest.approx(between, rel=1e-7, abs=0)


def test_a_step_that_is_too_large_is_said() -> None:
    scene = paper_scene("cosine", 1.0, 2.0)
    with pytest.raises(RunFailed, match="smaller dt"):
        hc.Native("rk4", dt=5 * scene.units.time).run(scene)
