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
    """Highest forces of each contact, natural units, as the laws are written."""
    unit = scene.units

    def force(u: Array, v: Array) -> Array:
        pressed = np.maximum(u[:-1] - u[1:], 0)
        return np.asarray(pressed**exponent + damping * pressed**0.5 * (v[:-1] - v[1:]))

    def slope(time: float, state: FloatArray) -> FloatArray:
        u, v = state[:GRANULES], state[GRANULES:]
        whole = force(u, v)
        applied = scene.applied_force(np.array([time * unit.time / STRETCH])) / unit.force
        a = np.append(applied, whole) - np.append(whole, 0.0) - drag * v
        return np.asarray(np.append(v, a), np.float64)

    end = scene.end_time / unit.time
    times = np.arange(0.0, end, 0.01)
    start = np.zeros(2 * GRANULES)
    found = solve_ivp(slope, (0.0, end), start, "DOP853", times, rtol=1e-7, atol=1e-8)
    return np.asarray(force(found.y[:GRANULES], found.y[GRANULES:]).max(axis=1))


@pytest.mark.parametrize(
    ("exponent", "damping", "drag"),
    [*((one, 0.0, 0.0) for one in (1.0, 1.25, HERTZ, 2.0)), (HERTZ, 0.1, 0.0), (HERTZ, 0.0, 0.1)],
    ids=str,
)
def test_peaks_are_those_of_the_law(exponent: float, damping: float, drag: float) -> None:
    scene = paper_scene("cosine", 1.0, 2.0, GRANULES)
    scene = hc.Scene(scene.chain, scene.shock, hc.Run(end_time=20 * scene.units.time))
    found = peaks(scene, Deadline(60), exponent, STRETCH, damping, drag)
    expected = by_dop853(scene, exponent, damping, drag)
    # Parabolas through samples; damping takes the velocity half a step before (1e-3 measured).
    rtol = 1.5e-3 if damping or drag else 1e-4
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=0)


@pytest.mark.parametrize("stretch", [0.2, 1.0, 5.0])
def test_a_pulse_that_is_stretched_acts_to_its_end(stretch: float) -> None:
    # The force grows so slowly that granules are pressed hardest when it is largest.
    found = peaks(paper_scene("cosine", 20.0, 1.5, 6), Deadline(60), HERTZ, stretch)
    scene = paper_scene("cosine", 20.0 * stretch, 1.5, 6)
    expected = hc.Native(rtol=1e-8, peaks_only=True).run(scene).peak_force / scene.units.force
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=0)


def test_a_motion_that_diverges_has_no_peaks() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, 6)
    assert not np.isfinite(peaks(scene, Deadline(60), damping=-20.0)).all()


def test_it_stops_at_the_deadline() -> None:
    with pytest.raises(TooExpensive):
        peaks(paper_scene("cosine", 1.0, 2.0), Deadline(-1.0))
