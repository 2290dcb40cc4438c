"""Histories and work of the applied force, against analytic motion, integrals and SciPy."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, TooExpensive
from hertzchain.observables.samples import (
    MOST_FRAMES,
    DampedLaw,
    History,
    Recorder,
    Samples,
    wanted_times,
)
from hertzchain.observables.watch import PeakWatch
from tests.conftest import paper_scene
from tests.oracles.first_pulses import Trace

PHASE = np.array([0.0, 0.4, 1.1])

SIGNALS = PeakWatch(DampedLaw.of_elastic(np.ones(2)), np.ones(3)).signals


def motion(time: FloatArray, k: int) -> FloatArray:
    """The k-th derivative of the displacements, shape (times, 3)."""
    return np.asarray(np.sin(time[:, None] + PHASE + k * np.pi / 2))


def contact(time: FloatArray) -> FloatArray:
    overlap = motion(time, 0)[:, :-1] - motion(time, 0)[:, 1:]
    return np.asarray(7.0 * np.maximum(overlap, 0.0) ** 1.5)


def samples_of(
    time: FloatArray, jerk: bool = True, moves: Callable[[FloatArray, int], FloatArray] = motion
) -> Samples:
    """Samples of granules; ``moves`` is the k-th derivative of their displacements."""
    displacement = moves(time, 0)
    overlap = displacement[:, :-1] - displacement[:, 1:]
    return Samples(
        time=time,
        displacement=displacement,
        velocity=moves(time, 1),
        acceleration=moves(time, 2),
        overlap=overlap,
        contact_force=7.0 * np.maximum(overlap, 0.0) ** 1.5,
        jerk=moves(time, 3) if jerk else None,
    )


def recorded(wanted: FloatArray, *blocks: Samples) -> History:
    recorder = Recorder(wanted, 3)
    for block in blocks:
        recorder.update(block, SIGNALS)
    return recorder.history(np.asarray(wanted, np.float64))


@pytest.mark.parametrize(("jerk", "tolerance"), [(False, 2e-9), (True, 3e-12)])
def test_displacement_and_velocity_vs_analytic_motion(jerk: bool, tolerance: float) -> None:
    wanted = np.linspace(0.0, 4.0, 173)
    history = recorded(wanted, samples_of(np.linspace(0.0, 4.0, 41), jerk))
    # The remainder of the velocity at h = 0.1 is h^5 / 1e4 or h^7 / 2e6; roundings of the basis,
    # up to 84, over h leave 1e-12.
    assert history.displacement == pytest.approx(motion(wanted, 0), rel=0, abs=tolerance)
    assert history.velocity == pytest.approx(motion(wanted, 1), rel=0, abs=tolerance)


def test_contact_force_vs_analytic_motion_with_the_stiffness_of_the_samples() -> None:
    wanted = np.linspace(0.0, 4.0, 173)
    history = recorded(wanted, samples_of(np.linspace(0.0, 4.0, 41)))
    # In an interval in which a contact opens or closes it is pressed at one end at least here.
    # 3/2 * 7 * overlap^(1/2) times the remainder of the overlap, 1e-14.
    assert history.contact_force == pytest.approx(contact(wanted), rel=0, abs=1e-12)
    assert np.any(history.contact_force == 0)
    assert np.any(history.contact_force > 1)


@pytest.mark.parametrize("split", [1, 13, 20, 39])
def test_blocks_vs_one_block(split: int) -> None:
    time, wanted = np.linspace(0.0, 4.0, 41), np.linspace(0.0, 4.0, 101)
    whole = recorded(wanted, samples_of(time))
    parts = recorded(wanted, samples_of(time[: split + 1]), samples_of(time[split:]))
    # A wanted time on the seam may be interpolated from either side: round-off.
    assert parts.displacement == pytest.approx(whole.displacement, rel=0, abs=1e-15)
    assert parts.velocity == pytest.approx(whole.velocity, rel=0, abs=1e-13)
    assert parts.contact_force == pytest.approx(whole.contact_force, rel=0, abs=1e-14)


# Wanted times


@pytest.mark.parametrize(
    "record",
    [[], [0.2, 0.1], [-1e-9, 0.5], [0.5, 1.0000001], [0.1, math.nan], [[0.1, 0.2]], ["soon"]],
)
def test_impossible_times_are_refused(record: list[Any]) -> None:
    with pytest.raises(SceneError, match=r"record.*must be increasing times from 0 to the end"):
        wanted_times(record, 1.0)
    assert wanted_times([0, 0.5, 1.0], 1.0).tolist() == [0.0, 0.5, 1.0]
    assert wanted_times(0.25, 1.0).tolist() == [0.25]


def test_a_whole_number_is_so_many_frames_from_0_to_the_end() -> None:
    for count in (2, np.int32(5), MOST_FRAMES):
        time = wanted_times(count, 3.0)
        np.testing.assert_allclose(time, np.linspace(0.0, 3.0, count), rtol=1e-15)
    for count in (-1, 1, MOST_FRAMES + 1):
        with pytest.raises(SceneError, match=r"must be from 2 to 1,000,000 frames, or incr"):
            wanted_times(count, 1.0)


def test_a_history_that_does_not_fit_into_memory_is_refused() -> None:
    """As empty arrays it would be there, and fill the memory as the run goes on."""
    granules = 10**9  # 2.4e10 bytes for each time
    with pytest.raises(TooExpensive, match="GB of memory"):
        Recorder(np.arange(1000.0), granules)


# Runs

SCENE = paper_scene("cosine-triangular", 1.3, 2.5, granules=6)


@pytest.fixture(scope="module")
def scipy_history() -> History:
    """A chain of six by SciPy's DOP853, in SI units."""
    trace, time = Trace(SCENE), np.linspace(0.0, SCENE.end_time, 201)
    states = trace.states(time)
    return History(time, states[:6].T, states[6:].T, trace.force(states).T)


def largest_deviations(history: History, expected: History) -> list[float]:
    """Return the largest deviations of displacement, velocity and contact force, relative."""
    pairs = (
        (history.displacement, expected.displacement),
        (history.velocity, expected.velocity),
        (history.contact_force, expected.contact_force),
    )
    return [float(np.abs(a - b).max() / np.abs(b).max()) for a, b in pairs]


@pytest.mark.parametrize(
    ("method", "tolerance"),
    [
        # SciPy's own error; the septic of the velocity has a remainder of h^7 / 2e6 = 1e-15.
        ("reference", 1e-10),
        # A step across an opening contact leaves r'^(3/2) h^(5/2) = 2e-5 times a small factor; the
        # displacements of what is thrown back keep that. Measured 7e-8.
        ("rk4", 2e-7),
    ],
)
def test_native_run_vs_scipy(scipy_history: History, method: str, tolerance: float) -> None:
    history = hc.Native(method).run(SCENE, record=scipy_history.time).history
    assert history is not None
    assert np.array_equal(history.time, scipy_history.time)
    assert max(largest_deviations(history, scipy_history)) < tolerance


@pytest.mark.lammps
def test_lammps_run_vs_scipy(scipy_history: History) -> None:
    lammps = hc.Lammps(dt=0.005 * SCENE.units.time)
    history = lammps.run(SCENE, record=scipy_history.time).history
    assert history is not None
    # Velocity Verlet at 0.005 units: about dt^2 / 2 = 1.3e-5.
    assert max(largest_deviations(history, scipy_history)) < 2e-5


END_TIMES = np.linspace(0.5, 3.0, 26)
"""In rise times: among so many some end a rounding after their last sample."""


def _short(rise_times: float) -> hc.Scene:
    scene = paper_scene("triangular", 1.0, 2.0, granules=3)
    assert scene.rise_time is not None
    return replace(scene, run=hc.Run(float(rise_times) * scene.rise_time))


@pytest.mark.parametrize("rise_times", END_TIMES)
def test_the_end_of_a_native_run_can_be_recorded(rise_times: float) -> None:
    scene = _short(rise_times)
    native = hc.Native("srkn-11b", dt=0.05 * scene.units.time)
    result = native.run(scene, record=[0.0, scene.end_time])
    assert result.history is not None
    # The last sample is the end of the run, but for roundings: of the basis, up to 35, times
    # displacements of 8 units, and over steps of 0.05 for the velocity.
    displacement = result.history.displacement[-1] - result.displacement
    velocity = result.history.velocity[-1] - result.velocity
    assert np.abs(displacement).max() < 1e-13 * scene.units.length
    assert np.abs(velocity).max() < 2e-12 * scene.units.velocity


# Force over time by the paper's numbers


@pytest.fixture(scope="module")
def filmed() -> hc.Result:
    return hc.Native().run(SCENE, record=2000)


@pytest.mark.parametrize("contact", range(2, 7))
def test_force_over_time_is_that_of_the_contact(filmed: hc.Result, contact: int) -> None:
    """Peaks of neighbours differ by a hundredth and more."""
    force = filmed.force_at(contact)
    assert force.shape == (2000,)
    # Frames lie 0.0094 natural time units apart: maxima between them are higher by 2e-5 (measured).
    assert force.max() == pytest.approx(filmed.peak_force[contact - 2], rel=5e-5)
    assert filmed.history is not None
    at = filmed.history.time[np.argmax(force)]
    assert at == pytest.approx(filmed.peak_time[contact - 2], abs=filmed.history.time[1])


def test_force_over_time_needs_a_contact_and_a_record(filmed: hc.Result) -> None:
    for contact in (-2, 1, 7, 2.5, "2"):
        with pytest.raises(SceneError, match=r"contact.*must be a whole number from 2 to 6"):
            filmed.force_at(contact)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="run with record = a number of frames, or times"):
        hc.Native().run(SCENE).force_at(2)


@pytest.mark.parametrize("samples", [11, 12, 17, 31])
def test_impulse_of_a_bounce_off_a_wall(samples: int) -> None:
    """The wall is touched from 0.37 to 2.37, which are not times of samples."""
    time = np.linspace(0.0, 3.0, samples)
    passed = time - 1.37
    overlap = 1 - passed**2
    columns = overlap, -2 * passed, np.full_like(time, -2.0), np.zeros_like(time)
    still = np.zeros_like(time)
    displacement, velocity, acceleration, jerk = (np.stack([still, c], axis=1) for c in columns)
    seen = Samples(
        time=time,
        displacement=displacement,
        velocity=velocity,
        acceleration=acceleration,
        overlap=np.stack([np.full_like(time, -1.0), overlap], axis=1),
        contact_force=np.stack([still, np.maximum(overlap, 0.0) ** 1.5], axis=1),
        jerk=jerk,
    )
    # Integral of (1 - s^2)^(3/2) from -1 to 1. An opening just outside an interval leaves most:
    # 9e-7 of the whole.
    watch = PeakWatch(DampedLaw.of_elastic(np.ones(2)), np.ones(2), on_held=[0, 1])
    watch.update(seen)
    assert watch.wall_impulse == pytest.approx(3 * math.pi / 8, rel=1.5e-6, abs=0)
