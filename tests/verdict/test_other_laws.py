"""Chains under wrong contact laws, against SciPy's DOP853."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hertzchain as hc
from hertzchain.arrays import Array, FloatArray
from hertzchain.errors import TooExpensive
from hertzchain.limits import Deadline
from hertzchain.verdict.other_laws import HERTZ, Law, peaks
from tests.conftest import paper_scene

LAWS = [
    HERTZ,
    *(Law(exponent=exponent) for exponent in (1.0, 1.25, 1.75, 2.0)),
    *(Law(exponent=exponent, pulls=True) for exponent in (1.0, 1.5)),
    *(Law(damped_by="contact", damping_exponent=exponent) for exponent in (0.0, 0.25, 0.5)),
    Law(damped_by="drag"),
]
GRANULES = 6
DAMPING, STRETCH = 0.1, 1.3


def by_dop853(scene: hc.Scene, law: Law) -> tuple[FloatArray, FloatArray]:
    """Highest elastic and whole forces of each contact, natural units, as the laws are written."""
    unit = scene.units
    damping = 0.0 if law.damped_by == "nothing" else DAMPING

    def forces(u: Array, v: Array) -> tuple[Array, Array]:
        overlap = u[:-1] - u[1:]
        elastic = np.maximum(overlap, 0) ** law.exponent
        if law.pulls:
            elastic = elastic - np.maximum(-overlap, 0) ** law.exponent
        if law.damped_by != "contact":
            return elastic, elastic
        rate = np.where(overlap > 0, v[:-1] - v[1:], 0.0)
        return elastic, elastic + damping * np.maximum(overlap, 0) ** law.damping_exponent * rate

    def slope(time: float, state: FloatArray) -> FloatArray:
        u, v = state[:GRANULES], state[GRANULES:]
        _, whole = forces(u, v)
        applied = scene.applied_force(np.array([time * unit.time / STRETCH])) / unit.force
        a = np.append(applied, whole) - np.append(whole, 0.0)
        slopes = np.append(v, a - damping * v if law.damped_by == "drag" else a)
        return np.asarray(slopes, np.float64)

    end = scene.end_time / unit.time
    times = np.arange(0.0, end, 0.01)
    start = np.zeros(2 * GRANULES)
    found = solve_ivp(slope, (0.0, end), start, "DOP853", times, rtol=1e-7, atol=1e-8)
    elastic, whole = forces(found.y[:GRANULES], found.y[GRANULES:])
    return elastic.max(axis=1), whole.max(axis=1)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_peaks_are_those_of_the_law(law: Law) -> None:
    scene = paper_scene("cosine", 1.0, 2.0, GRANULES)
    scene = hc.Scene(scene.chain, scene.shock, hc.Run(end_time=20 * scene.units.time))
    one = np.ones(1)
    found = peaks(scene, law, DAMPING * one, STRETCH * one, Deadline(60))
    # Steps of 0.1, and parabolas: 2e-4 measured where contacts pull, 1.5e-4 elsewhere.
    for measured, expected in zip(found, by_dop853(scene, law), strict=True):
        np.testing.assert_allclose(measured[0], expected, rtol=2.5e-4, atol=0)


def test_chains_do_not_know_of_one_another() -> None:
    scene = paper_scene("triangular", 0.5, 3.0, 12)
    law = Law(damped_by="drag")
    damping, stretch = np.array([0.0, 0.1, 0.3]), np.ones(3)
    together = peaks(scene, law, damping, stretch, Deadline(60))
    for k in range(3):
        alone = peaks(scene, law, damping[[k]], stretch[[k]], Deadline(60))
        for measured, expected in zip(together, alone, strict=True):
            np.testing.assert_array_equal(measured[k], expected[0])


def test_a_pulse_that_is_stretched_acts_to_its_end() -> None:
    # The force grows so slowly that granules are pressed hardest when it is largest.
    stretch = np.array([0.2, 1.0, 5.0])
    found, _ = peaks(paper_scene("cosine", 20.0, 1.5, 6), HERTZ, 0 * stretch, stretch, Deadline(60))
    for times, measured in zip(stretch.tolist(), found, strict=True):
        scene = paper_scene("cosine", 20.0 * times, 1.5, 6)
        expected = hc.Native(rtol=1e-8, peaks_only=True).run(scene).peak_force / scene.units.force
        # Steps of 0.1, and parabolas: 1e-4 measured.
        np.testing.assert_allclose(measured, expected, rtol=2.5e-4, atol=0)


def test_a_motion_that_diverges_has_no_peaks() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, 6)
    law = Law(damped_by="contact")
    found = peaks(scene, law, np.array([-20.0, 0.0]), np.ones(2), Deadline(60))
    for one in found:
        assert not np.isfinite(one[0]).all()
        assert np.isfinite(one[1]).all()


def test_it_stops_at_the_deadline() -> None:
    with pytest.raises(TooExpensive):
        peaks(paper_scene("cosine", 1.0, 2.0), HERTZ, np.zeros(1), np.ones(1), Deadline(-1.0))
