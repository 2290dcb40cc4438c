"""Chains under wrong contact laws, against SciPy's DOP853."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hertzchain as hc
from hertzchain.arrays import Array, FloatArray
from hertzchain.errors import TooExpensive
from hertzchain.limits import Deadline
from hertzchain.verdict.other_laws import HERTZ, peaks
from tests.conftest import paper_scene

GRANULES = 6
STRETCH = 1.3


def by_dop853(scene: hc.Scene, exponent: float, damping: float, drag: float) -> FloatArray:
    """Highest elastic forces of each contact, natural units, as the laws are written."""
    unit = scene.units

    def elastic(u: Array) -> Array:
        return np.asarray(np.maximum(u[:-1] - u[1:], 0) ** exponent)

    def slope(time: float, state: FloatArray) -> FloatArray:
        u, v = state[:GRANULES], state[GRANULES:]
        pressed = np.maximum(u[:-1] - u[1:], 0)
        whole = elastic(u) + damping * pressed**0.5 * (v[:-1] - v[1:])
        applied = scene.applied_force(np.array([time * unit.time / STRETCH])) / unit.force
        a = np.append(applied, whole) - np.append(whole, 0.0) - drag * v
        return np.asarray(np.append(v, a), np.float64)

    end = scene.end_time / unit.time
    times = np.arange(0.0, end, 0.01)
    start = np.zeros(2 * GRANULES)
    found = solve_ivp(slope, (0.0, end), start, "DOP853", times, rtol=1e-7, atol=1e-8)
    return np.asarray(elastic(found.y[:GRANULES]).max(axis=1))


@pytest.mark.parametrize(
    ("exponent", "damping", "drag"),
    [*((one, 0.0, 0.0) for one in (1.0, 1.25, HERTZ, 2.0)), (HERTZ, 0.1, 0.0), (HERTZ, 0.0, 0.1)],
    ids=str,
)
def test_peaks_are_those_of_the_law(exponent: float, damping: float, drag: float) -> None:
    scene = paper_scene("cosine", 1.0, 2.0, GRANULES)
    scene = hc.Scene(scene.chain, scene.shock, hc.Run(end_time=20 * scene.units.time))
    (found,) = peaks(scene, exponent, Deadline(60), STRETCH, damping, drag)
    # Steps of 0.1, and parabolas: 1.5e-4 measured.
    np.testing.assert_allclose(
        found, by_dop853(scene, exponent, damping, drag), rtol=2.5e-4, atol=0
    )


def test_chains_do_not_know_of_one_another() -> None:
    scene, drag = paper_scene("triangular", 0.5, 3.0, 12), np.array([0.0, 0.1, 0.3])
    together = peaks(scene, HERTZ, Deadline(60), drag=drag)
    for measured, alone in zip(together, drag.tolist(), strict=True):
        np.testing.assert_array_equal(measured, peaks(scene, HERTZ, Deadline(60), drag=alone)[0])


def test_a_pulse_that_is_stretched_acts_to_its_end() -> None:
    # The force grows so slowly that granules are pressed hardest when it is largest.
    stretch = np.array([0.2, 1.0, 5.0])
    found = peaks(paper_scene("cosine", 20.0, 1.5, 6), HERTZ, Deadline(60), stretch)
    for times, measured in zip(stretch.tolist(), found, strict=True):
        scene = paper_scene("cosine", 20.0 * times, 1.5, 6)
        expected = hc.Native(rtol=1e-8, peaks_only=True).run(scene).peak_force / scene.units.force
        # Steps of 0.1, and parabolas: 1e-4 measured.
        np.testing.assert_allclose(measured, expected, rtol=2.5e-4, atol=0)


def test_a_motion_that_diverges_has_no_peaks() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, 6)
    one, other = peaks(scene, HERTZ, Deadline(60), damping=np.array([-20.0, 0.0]))
    assert not np.isfinite(one).all()
    assert np.isfinite(other).all()


def test_it_stops_at_the_deadline() -> None:
    with pytest.raises(TooExpensive):
        peaks(paper_scene("cosine", 1.0, 2.0), HERTZ, Deadline(-1.0))
