"""The compiled kernels against the equations as they are written, and the moving window."""

from __future__ import annotations

import ast
import math
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.interpolate import CubicSpline

import hertzchain as hc
from hertzchain.engines.native import (
    damped_kernel,
    damped_verlet_kernel,
    elastic,
    elastic_maxima,
    elastic_state,
    elastic_window,
    interpolant,
    lanes_kernel,
    simulate,
    simulate_in_numpy,
    simulation,
)
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import leg_rows, nothing_recorded
from hertzchain.engines.native.marching import march
from hertzchain.engines.native.methods import (
    DPRKN_6,
    RUNGE_KUTTA_4,
    SRKN_6B,
    SRKN_11B,
    VELOCITY_VERLET,
    Stepper,
    SymplecticNystrom,
)
from hertzchain.engines.native.plan import cheapest
from hertzchain.engines.native.refinement import Fixed, Refined, Walker
from hertzchain.engines.native.simulation import stoppable
from hertzchain.limits import Deadline
from hertzchain.observables import hermite
from hertzchain.observables.history import Recorder
from hertzchain.theory.solitary_wave import solitary_wave
from tests.conftest import STEEL, paper_scene
from tests.engines.native.test_native import slope


def pulse_table() -> hc.Scene:
    """A table that starts late, jumps at both ends and has a corner."""
    rows = hc.PulseTable((1e-5, 3e-5, 6e-5), (40.0, 100.0, 20.0))
    return hc.Scene(hc.Chain(9, **STEEL), rows)


@pytest.mark.parametrize("refined", [False, True], ids=["fixed", "refined"])
@pytest.mark.parametrize("stepper", [SRKN_6B, SRKN_11B], ids=["srkn-6b", "srkn-11b"])
@pytest.mark.parametrize(
    "scene",
    [
        paper_scene("cosine-triangular", 2.0, 2.0, 20),
        paper_scene("triangular", 0.3, 4.0, 12),
        pulse_table(),
    ],
    ids=["LM 2", "LM 0.3", "table"],
)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_compiled_vs_numpy(scene: hc.Scene, stepper: Stepper, refined: bool, dtype: Any) -> None:
    walker: Walker = Refined(stepper, 1e-5, starting=4.0) if refined else Fixed(stepper)
    agree(scene, walker, dtype)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_compiled_velocity_verlet_vs_numpy(dtype: Any) -> None:
    agree(paper_scene("cosine-triangular", 2.0, 2.0, 20), Fixed(VELOCITY_VERLET), dtype)


def agree(scene: hc.Scene, walker: Walker, dtype: Any) -> None:
    """Everything that a run finds, compiled and in NumPy: equal but for rounding."""
    legs, units = scene.schedule(0.1 * scene.units.time), scene.units
    # In float32 NumPy's times end a rounding early.
    times = np.linspace(0, 0.99999 * scene.end_time / units.time, 7)
    recorders = [Recorder(times, scene.chain.granules) for _ in range(2)]
    ours = simulate(scene, legs, walker, recorders[0], dtype)
    plain = simulate_in_numpy(scene, legs, walker, recorders[1], dtype)
    assert ours.steps == plain.steps
    # Rounding errors of about 5,000 force evaluations; displacements of granules that flew off are
    # up to 60 units, velocities of histories are divided by steps of 0.1 and less.
    eps = float(np.finfo(dtype).eps)
    pairs = [
        (ours.peaks.force, plain.peaks.force, 100),
        (ours.peaks.time, plain.peaks.time, 1000),
        (ours.state.displacement, plain.state.displacement, 5000),
        (ours.state.velocity, plain.state.velocity, 5000),
        (ours.work, plain.work, 100),
        (ours.momentum, plain.momentum, 100),
        (ours.energy, plain.energy, 200),
        (recorders[0].displacement, recorders[1].displacement, 5000),
        (recorders[0].velocity, recorders[1].velocity, 5000),
        (recorders[0].contact_force, recorders[1].contact_force, 200),
    ]
    for measured, expected, errors in pairs:
        assert measured == pytest.approx(expected, rel=0, abs=errors * eps)


def test_a_run_goes_on_from_the_state_of_another() -> None:
    scene = paper_scene("cosine-triangular", 2.0, 2.0, 20)
    walker, (*pulse, rest) = Fixed(SRKN_11B), scene.schedule(0.1 * scene.units.time)
    whole, begun = simulate(scene, [*pulse, rest], walker), simulate(scene, pulse, walker)
    start = np.array([begun.state.displacement, begun.state.velocity])
    # Overlaps of granules that wait ahead of the front are below round-off.
    ended = simulate(scene, [rest], walker, start=start, leave_behind=True)
    assert ended.steps == whole.steps - begun.steps
    assert ended.momentum == pytest.approx(whole.momentum, rel=1e-14, abs=0)
    assert ended.energy == pytest.approx(whole.energy, rel=1e-13, abs=0)
    for one, other in zip(vars(ended.state).values(), vars(whole.state).values(), strict=True):
        assert one == pytest.approx(other, rel=0, abs=1e-11)
    later = whole.peaks.time > rest.start / scene.units.time
    assert later.sum() > 10
    assert ended.peaks.force[later] == pytest.approx(whole.peaks.force[later], rel=1e-12, abs=0)


@pytest.mark.parametrize("stepper", [SRKN_11B, VELOCITY_VERLET], ids=["srkn-11b", "verlet"])
@pytest.mark.parametrize("window", [True, False])
def test_start_displacements_vs_numpy(demo: hc.Scene, stepper: Stepper, window: bool) -> None:
    legs = demo.schedule(0.1 * demo.units.time)
    start = np.random.default_rng(1).uniform(-1e-3, 1e-3, (2, demo.chain.granules))
    ours = simulate(demo, legs, Fixed(stepper), start=start, window=window)
    plain = simulate_in_numpy(demo, legs, Fixed(stepper), start=start)
    assert ours.peaks.force == pytest.approx(plain.peaks.force, rel=1e-11, abs=0)
    assert ours.state.velocity == pytest.approx(plain.state.velocity, rel=0, abs=1e-11)


@pytest.mark.parametrize(
    ("stepper", "steps"),
    [
        (VELOCITY_VERLET, [0.02, 0.01, 0.005]),
        (RUNGE_KUTTA_4, [0.025, 0.0125, 0.00625]),
        (SRKN_6B, [0.1, 0.05, 0.025]),
        (DPRKN_6, [0.2, 0.1, 0.05]),
        (SRKN_11B, [0.2, 0.14, 0.1]),
    ],
    ids=["velocity-verlet", "rk4", "srkn-6b", "dprkn-6", "srkn-11b"],
)
def test_order_of_the_displacement(demo: hc.Scene, stepper: Stepper, steps: list[float]) -> None:
    # Before a contact opens: that spoils any order.
    scene = replace(demo, run=hc.Run(9 * demo.units.time))

    run = simulate if isinstance(stepper, SymplecticNystrom) else simulate_in_numpy

    def displacement(step: float) -> Any:
        legs = scene.schedule(step * scene.units.time)
        return run(scene, legs, Fixed(stepper)).state.displacement

    expected = simulate(scene, scene.schedule(0.02 * scene.units.time), Fixed(SRKN_11B))
    errors = [
        float(np.max(np.abs(displacement(step) - expected.state.displacement))) for step in steps
    ]
    # The higher orders have terms of still higher order at such steps.
    assert stepper.order - 0.05 < slope(steps, errors) < stepper.order + 0.5


def test_interpolation_vs_hermite() -> None:
    rng = np.random.default_rng(1)
    start, end, h = rng.normal(size=4), rng.normal(size=4), 0.37
    ours = interpolant.hermite(tuple(start), tuple(end), h)
    columns = [np.array([[value]]) for value in start], [np.array([[value]]) for value in end]
    expected = hermite.coefficients(*columns, np.array([[h]]))
    # Coefficients of up to a few hundred that cancel.
    assert ours == pytest.approx(expected[:, 0, 0], rel=0, abs=1e-12)


RATIOS = [0.05, 1.0, 10.0, 100.0, 1000.0]
DURATIONS = [1.1, 2.0, 50.0]


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("duration", DURATIONS)
@pytest.mark.parametrize(
    "walker", [Fixed(SRKN_11B), cheapest(1e-6).walker], ids=["fixed", "refined"]
)
def test_peaks_in_a_window_are_bitwise_those_of_the_full_chain(
    ratio: float, duration: float, walker: Walker
) -> None:
    granules = {100.0: 800, 1000.0: 120}.get(ratio, 300)
    scene = paper_scene("cosine", ratio, duration, granules)
    legs = scene.schedule(0.4 * scene.units.time)
    full = simulate(scene, legs, walker, window=False)
    ahead = simulate(scene, legs, walker)
    window = simulate(scene, legs, walker, leave_behind=True)
    for run in (ahead, window):
        assert np.array_equal(run.peaks.force, full.peaks.force)
        assert np.array_equal(run.peaks.time, full.peaks.time)
    assert np.array_equal(ahead.state.displacement, full.state.displacement)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_long_train_of_waves_in_a_window(dtype: Any) -> None:
    # LM 10: a train of waves, each slower than the one ahead; all but the first are left behind.
    scene = paper_scene("triangular", 10.0, 2.0, 1500)
    legs, walker = scene.schedule(0.4 * scene.units.time), Fixed(SRKN_11B)
    full = simulate(scene, legs, walker, dtype=dtype)
    window = simulate(scene, legs, walker, dtype=dtype, leave_behind=True)
    assert np.array_equal(window.peaks.force, full.peaks.force)
    # Dropped granules are counted: nothing is lost. Rounding of the float32 run.
    error = 1e-11 if dtype is np.float64 else 2e-4
    assert window.momentum == pytest.approx(full.momentum, rel=error, abs=0)
    # In steps of 0.4 the contacts that open behind the train cost the full chain 1e-5 later on.
    assert window.energy == pytest.approx(full.energy, rel=1e-4, abs=0)


@pytest.mark.parametrize(("ratio", "grown"), [(0.5, [480]), (30.0, [480, 701])])
def test_a_window_has_more_room_when_it_needs_it(
    monkeypatch: pytest.MonkeyPatch, ratio: float, grown: list[int]
) -> None:
    scene = paper_scene("triangular", ratio, 2.0, 700)
    legs, walker = scene.schedule(0.4 * scene.units.time), Fixed(SRKN_11B)
    full = simulate(scene, legs, walker)
    march, columns = elastic.march, []

    def noted(*arguments: Any) -> Any:
        columns.append(arguments[3].rows.shape[1])
        return march(*arguments)

    monkeypatch.setattr(elastic, "march", noted)
    monkeypatch.setattr(elastic_state, "least_columns", lambda _: 480)
    window = simulate(scene, legs, walker, leave_behind=True)
    assert sorted(set(columns)) == grown
    assert np.array_equal(window.peaks.force, full.peaks.force)
    assert np.array_equal(window.peaks.time, full.peaks.time)


def test_waves_that_are_followed_alone_move_with_their_window(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = paper_scene("cosine", 8.0, 1.1, 2500)
    legs, walker = scene.schedule(0.4 * scene.units.time), Fixed(SRKN_11B)
    full = simulate(scene, legs, walker)
    with_room, followed = elastic_state.with_room, []

    def noted(state: elastic_state.State, granules: int, stages: int) -> elastic_state.State:
        followed.append(int(state.counts[elastic_state.LATE]))
        return with_room(state, granules, stages)

    monkeypatch.setattr(elastic_state, "with_room", noted)
    monkeypatch.setattr(elastic_state, "least_columns", lambda stages: 32 * (stages + 2) + 3)
    window = simulate(scene, legs, walker, leave_behind=True)
    assert any(followed)  # this is what is tested
    assert len(followed) > 5
    assert np.array_equal(window.peaks.force, full.peaks.force)
    assert np.array_equal(window.peaks.time, full.peaks.time)


def outcome(scene: hc.Scene, leave_behind: bool, step: float = 0.4) -> Any:
    """Return the kernels' results of a run besides its peaks; ``step`` in natural time units."""
    walker, contacts = Fixed(SRKN_11B), scene.chain.granules - 1
    nothing = np.zeros((0, 0))
    found, _, _ = march(
        leg_rows(walker.cut(scene.schedule(step * scene.units.time)), scene.units), SRKN_11B,
        np.float64, 0.0, 0.0, scene.chain.granules, nothing, None, 8, leave_behind,
        np.zeros(contacts), np.full(contacts, np.nan), nothing_recorded(), np.zeros(3),
    )  # fmt: skip
    return found


def test_the_window_is_as_wide_as_a_wave_however_long_the_chain() -> None:
    short, long = (
        outcome(paper_scene("cosine", 0.5, 6.0, granules), True) for granules in (500, 4000)
    )
    width = [run.granule_evaluations / run.evaluations for run in (short, long)]
    # Measured 27 twice: a wave of ten granules, eight quiet ones, and what waits for the next
    # look, every four time units.
    assert width[1] < 35
    assert width[1] < 1.1 * width[0]
    full = outcome(paper_scene("cosine", 0.5, 6.0, 500), False)
    assert short.granule_evaluations < full.granule_evaluations / 5


@pytest.mark.parametrize(("ratio", "width"), [(2.0, 35), (10.0, 70)])
def test_the_window_of_long_steps_and_of_trains(ratio: float, width: float) -> None:
    # Steps of 0.59 leave 1e-8 of a wave's velocity behind it. Measured 26 and 58: at LM_ratio 10
    # the second wave, 0.83 of the first, is followed alone.
    run = outcome(paper_scene("cosine-triangular", ratio, 2.0, 12_000), True, 0.59)
    assert run.granule_evaluations / run.evaluations < width


def test_later_waves_press_the_free_end_harder() -> None:
    """LM_ratio 20: the second wave is 0.89 of the first, and followed in its own window."""
    scene = paper_scene("triangular", 20.0, 2.0, 4000)
    legs, walker = scene.schedule(0.4 * scene.units.time), Fixed(SRKN_11B)
    full = simulate(scene, legs, walker).peaks
    window = simulate(scene, legs, walker, leave_behind=True).peaks
    first = full.force[-40]
    # The leading wave presses none of the last contacts harder than the others.
    assert full.force[-3] > 1.005 * first
    assert np.array_equal(window.force[:-10], full.force[:-10])
    # Granules between the waves are at rest; in the full chain they have rounding errors.
    assert window.force == pytest.approx(full.force, rel=1e-11, abs=0)
    assert window.time == pytest.approx(full.time, rel=1e-12, abs=0)
    run = outcome(scene, True)
    assert run.granule_evaluations / run.evaluations < 200


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.05, 0.3, 1.0, 2.0, 5.0, 10.0, 30.0, 1000.0])
@pytest.mark.parametrize("duration", [1.1, 6.0, 50.0])
@pytest.mark.parametrize("profile", ["cosine", "triangular", "cosine-triangular"])
def test_long_chains_in_a_window(profile: str, ratio: float, duration: float) -> None:
    scene = paper_scene(profile, ratio, duration, 5000 if ratio < 1000 else 300)
    for step in (0.4, 0.59):
        legs, walker = scene.schedule(step * scene.units.time), Fixed(SRKN_11B)
        full = simulate(scene, legs, walker).peaks
        window = simulate(scene, legs, walker, leave_behind=True).peaks
        assert np.array_equal(window.force[:-60], full.force[:-60])
        # Where later waves raise peaks at the free end, after granules between were put to rest.
        # Long steps leave errors of 1e-7 there.
        error = 1e-11 if step < 0.5 else 1e-6
        assert window.force == pytest.approx(full.force, rel=error, abs=0)


@pytest.mark.slow
@pytest.mark.parametrize("mass", [0.1, 1.0, 3.0, 10.0, 30.0])
def test_long_chains_behind_strikers_in_a_window(mass: float) -> None:
    chain, radius = hc.Chain(3000, **STEEL), STEEL["radius"] * math.cbrt(mass)
    scene = hc.Scene(chain, hc.Striker(1.0, radius=radius))
    legs, walker = scene.schedule(0.3 * scene.contact_time), Fixed(SRKN_11B)
    full = simulate(scene, legs, walker).peaks
    window = simulate(scene, legs, walker, leave_behind=True).peaks
    assert np.array_equal(window.force[:-60], full.force[:-60])
    assert window.force == pytest.approx(full.force, rel=1e-11, abs=0)


def test_a_fixed_width_would_be_wrong() -> None:
    # Under a long pulse nothing is left behind: the whole chain matters to its front.
    scene = paper_scene("cosine", 100.0, 2.0, 300)
    assert outcome(scene, True).granule_evaluations == outcome(scene, False).granule_evaluations


@pytest.mark.parametrize(("place", "moment"), [(threading.Thread, "start"), (simulation, "_wait")])
def test_an_interrupt_stops_a_run(place: Any, moment: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The interrupt comes while the thread starts, or while the main thread waits for it."""
    control = np.zeros(3)
    stopped = threading.Event()

    def work() -> None:
        while control[0] == 0:
            time.sleep(0.01)
        stopped.set()

    original = getattr(place, moment)

    def interrupted(*given: Any) -> None:
        monkeypatch.undo()
        if moment == "start":
            original(*given)
        raise KeyboardInterrupt

    monkeypatch.setattr(place, moment, interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            stoppable(work, control, Deadline(60.0))
        assert control[0] == -1
        assert stopped.is_set()
    finally:
        control[0] = -1


def test_a_failure_in_a_long_run_is_not_lost() -> None:
    def work() -> None:
        raise MemoryError("none left")

    with pytest.raises(MemoryError, match="none left"):
        stoppable(work, np.zeros(2), Deadline(60.0))


def test_a_stopped_run_says_so() -> None:
    control = np.array([-1.0, 0.0, 0.0])
    scene = paper_scene("cosine", 1.0, 2.0, 100)
    rows = leg_rows(scene.schedule(0.1 * scene.units.time), scene.units)
    nothing = np.zeros((0, 0))
    found, _, _ = march(
        rows, SRKN_11B, np.float64, 0.0, 0.0, 100, nothing, None, 8, False, np.zeros(99),
        np.full(99, np.nan), nothing_recorded(), control,
    )  # fmt: skip
    assert found.status == elastic_state.STOPPED
    assert found.end < 5  # looked at every four natural time units


def double_pulse() -> hc.Scene:
    """A second pulse long after the first: its waves break out of a packet near the free end."""
    rows = hc.PulseTable(
        (0.0, 2.5e-5, 5e-5, 1.115e-3, 1.15e-3, 1.184e-3), (0.0, 100.0, 0.0, 0.0, 78.6, 0.0)
    )
    return hc.Scene(hc.Chain(26, **STEEL), rows)


def test_after_two_pulses_nothing_is_left_behind() -> None:
    scene = double_pulse()
    legs = scene.schedule(0.1 * scene.units.time)
    full = simulate(scene, legs, Fixed(SRKN_11B))
    peaks = simulate(scene, legs, Fixed(SRKN_11B), leave_behind=True)
    assert np.array_equal(peaks.peaks.force, full.peaks.force)
    assert np.all(np.isfinite(peaks.state.displacement))
    true = hc.Native("reference").run(scene).peak_force
    for error in (
        hc.Native(rtol=1e-6, peaks_only=True).run(scene).peak_force / true - 1,
        hc.peak_forces([scene], 1e-6).peak_force[0] / true - 1,
    ):
        assert np.max(np.abs(error)) < 1e-6


def touching(stiffness: Any, inverse_mass: Any) -> Chain:
    """Return a chain for the kernels whose granules just touch."""
    none = np.zeros(stiffness.size)
    return Chain(stiffness, inverse_mass, none, none, none)


def left_behind(u: Any, v: Any, peaks: Any, hi: int, chain: Chain | None = None) -> Any:
    """Return the cut of ``left_behind``, and the ends of waves to follow in their own windows."""
    parts = np.zeros(elastic_state.LATE + 1 + 2 * elastic_state.MOST_LATE, np.int64)
    most = elastic_state.MOST_LATE
    cut = elastic_window.left_behind(u, v, peaks, 0, 0, hi, parts, most, chain)
    known = elastic_state.LATE + 1
    return cut, parts[known : known + 2 * parts[elastic_state.LATE]].tolist()


def quiet_chain(quiet: int, behind: float, noise: float = 0.0) -> Any:
    """A leading wave of force 1, granules at rest, and behind them one contact that is pressed.

    Parameters
    ----------
    quiet
        Contacts of granules at rest.
    behind
        Force in the contact behind them.
    noise
        Overlap of granules at rest.

    Returns
    -------
    u, v and the peaks, as ``left_behind`` takes them, and its granules.
    """
    rest = np.full(quiet, noise)
    overlaps = np.concatenate([[behind ** (2 / 3)], rest, [0.4, 1.0, 0.3], np.zeros(4)])
    u = np.append(np.cumsum(overlaps[::-1])[::-1], 0.0)
    return u, np.zeros(u.size), np.ones(u.size - 1), u.size


@pytest.mark.parametrize(
    ("quiet", "behind", "peak", "velocity", "cuts"),
    [
        (12, 0.5, 1.0, 0.0, True),
        (8, 0.5, 1.0, 0.0, True),
        (7, 0.5, 1.0, 0.0, False),  # too few granules at rest
        (12, 0.79, 1.0, 0.0, True),
        (12, 0.80, 1.0, 0.0, False),  # as strong as the leading wave, at a loosened end
        (12, 0.5, 0.64, 0.0, True),
        (12, 0.5, 0.63, 0.0, False),  # it may still raise the peak of a contact
        (12, 0.5, 1.0, 0.660, True),  # 1.2 times 1.3 v^1.2 is 0.9475
        (12, 0.5, 1.0, 0.663, False),  # a granule flies that would press as hard
        (12, 0.0, 0.01, -2.0, True),  # away from the leading wave
    ],
)
def test_what_may_be_left_behind(
    quiet: int, behind: float, peak: float, velocity: float, cuts: bool
) -> None:
    u, v, peaks, granules = quiet_chain(quiet, behind)
    peaks[0], v[0] = peak, velocity
    assert left_behind(u, v, peaks, granules - 1)[0] == (quiet - 7 if cuts else 0)


@pytest.mark.parametrize("leading", [1.0, 1e-6])
@pytest.mark.parametrize(
    ("overlap", "velocity", "cuts"),
    [(0.9, 0.0, True), (1.1, 0.0, False), (0.0, 0.9, True), (0.0, -1.1, False)],
)
def test_which_granules_are_at_rest(
    leading: float, overlap: float, velocity: float, cuts: bool
) -> None:
    """Granules count as quiet up to a thousandth of the leading wave's F^(2/3) and F^(5/6)."""
    noise = 1e-3
    u, v, peaks, granules = quiet_chain(12, 0.5, overlap * noise)
    v[1:14] = velocity * noise
    u, v, peaks = u * leading ** (2 / 3), v * leading ** (5 / 6), peaks * leading
    assert (left_behind(u, v, peaks, granules - 1)[0] > 0) == cuts


@pytest.fixture(scope="module")
def wave() -> Any:
    """Displacement and velocity of 17 granules in the middle of a solitary wave of force 1."""
    scene = paper_scene("cosine", 0.5, 6.0, 200)
    scene = replace(scene, run=hc.Run(100 * scene.units.time))
    run = simulate(scene, scene.schedule(0.1 * scene.units.time), Fixed(SRKN_11B))
    u, v, force = run.state.displacement, run.state.velocity, run.peaks.force[60]
    crest = int(np.argmax(v))
    here = slice(crest - 8, crest + 9)
    return (u[here] - u[crest + 10]) / force ** (2 / 3), v[here] / force ** (5 / 6)


def two_waves(wave: Any, height: float, distance: int, granules: int) -> Any:
    """A wave of force 1, and behind it another one: displacement and velocity."""
    start = np.zeros((2, granules))
    for force, at in ((1.0, granules - 30), (height, granules - 30 - distance)):
        start[0, : at + 17] += np.append(np.full(at, wave[0][0]), wave[0]) * force ** (2 / 3)
        start[1, at : at + 17] += wave[1] * force ** (5 / 6)
    return start


@pytest.mark.parametrize(
    ("height", "distance", "peak", "fate"),
    [
        (0.78, 100, 1.0, "left"),
        (0.80, 100, 1.0, "followed"),  # it presses up to 0.938 at a loosened end
        (0.98, 100, 1.0, "followed"),
        (0.995, 100, 1.0, "kept"),  # too near to the leading wave
        (0.80, 50, 1.0, "kept"),  # too few granules at rest
        (0.78, 50, 1.0, "left"),
        (0.80, 100, 0.79, "kept"),  # it still raises a peak ahead of it
    ],
)
def test_what_becomes_of_a_wave_behind_another(
    wave: Any, height: float, distance: int, peak: float, fate: str
) -> None:
    u, v = two_waves(wave, height, distance, 200)
    peaks = np.ones(199)
    # Where the later wave was it need not be stronger than anything.
    peaks[:20] = 0.9
    peaks[100 + 40] = peak
    cut, parts = left_behind(np.append(u, 1e30), v, peaks, 199)
    begin = 170 - distance
    if fate == "kept":
        assert cut < begin
    else:
        assert cut > begin + 17
    if fate == "followed":
        assert len(parts) == 2
        assert begin - 8 <= parts[0] < parts[1] <= cut
    else:
        assert parts == []


def test_one_wave_is_told_from_others(wave: Any) -> None:
    height = elastic_window._height
    u, v = wave
    overlap = np.append(np.maximum(u[:-1] - u[1:], 0), 0)
    momentum, energy = float(np.sum(v)), float(np.sum(v**2) / 2 + 0.4 * np.sum(overlap**2.5))
    hardest = float(np.max(overlap) ** 1.5)
    assert height(momentum, energy, hardest, None) == pytest.approx(1.0, rel=1e-5, abs=0)
    # By its shape: momentum is the integral of force over time, energy that of force times
    # velocity, which is the integral of force over one granule's distance.
    shape = solitary_wave()
    x, force = shape.x, shape.overlap**1.5
    passed = CubicSpline(x, force).antiderivative()
    ahead, behind = np.minimum(x + 0.5, x[-1]), np.maximum(x - 0.5, x[0])
    velocity = (passed(ahead) - passed(behind)) / shape.speed
    contact = float(simpson(force, x=x)) / shape.speed
    given = float(simpson(velocity**2 / 2 + 0.4 * shape.overlap**2.5, x=x))
    assert height(contact, given, 1.0, None) == pytest.approx(1.0, rel=1e-4, abs=0)
    # Two waves, one that meets another one, a flying granule.
    assert height(2 * momentum, 2 * energy, hardest, None) == 0
    assert height(0.0, 2 * energy, hardest, None) == 0
    assert height(1.0, 0.5, 0.0, None) == 0
    # Momentum and energy alone could be those of flying granules.
    for pressed, expected in ((0.69, 0.0), (0.71, 1.0), (1.0005, 1.0), (1.002, 0.0)):
        found = height(momentum, energy, pressed, None)
        assert found == pytest.approx(expected, rel=1e-5, abs=0)
    for off, expected in ((9e-4, 1.0), (1.1e-3, 0.0)):
        found = height(momentum, energy * (1 + off), hardest, None)
        assert found == pytest.approx(expected, rel=1e-3, abs=0)
    # Of stiffness k and mass m: F is k overlap^(3/2).
    k, m = 3.0, 0.2
    chain = touching(np.array([1.0, k, 1.0]), np.array([1.0, 1 / m, 1 / m]))
    scaled = math.sqrt(k * m) * momentum, k * energy, k * hardest
    assert height(*scaled, chain) == pytest.approx(k, rel=1e-5, abs=0)


def test_an_impact_is_taken_to_press_harder_than_waves_and_walls_do() -> None:
    wave = solitary_wave()
    # A granule is pushed by the contact behind it and by the one ahead of it: its velocity is the
    # integral of the force over one granule's distance, over the speed.
    middle = np.abs(wave.x) <= 0.5
    velocity = simpson(wave.overlap[middle] ** 1.5, x=wave.x[middle]) / wave.speed
    # Into a wall: v^2 / 2 = 2/5 r^(5/2).
    for force, fastest in ((1.0, float(velocity)), (1.25**0.6, 1.0)):
        assert elastic_window._strength(0.0, fastest, None) > 1.1 * force
    # The wave and its fastest granule as they are in a chain, in whose far field it is right to
    # 1e-5; recorded times miss the fastest by as much.
    scene = paper_scene("cosine", 0.5, 6.0, 40)
    early, late = hc.Native().run(scene).peak_time[[25, 27]]
    found = hc.Native().run(scene, record=np.linspace(early, late, 40))
    assert found.history is not None
    fastest = np.max(found.history.velocity[:, 24:30]) / scene.units.velocity
    assert found.peak_force[26] / 100 == pytest.approx((fastest / velocity) ** 1.2, rel=1e-3, abs=0)


def test_how_hard_contacts_can_come_to_be_pressed() -> None:
    assert elastic_window._strength(1.31, 1.0, None) == 1.31
    assert elastic_window._strength(1.29, 1.0, None) == pytest.approx(1.3, rel=1e-15, abs=0)
    assert elastic_window._strength(0.0, -1.0, None) == 0
    # By similarity F / (k^(2/5) m^(3/5) v^(6/5)) is a number, here of the granules ahead.
    chain = touching(np.array([1.0, 2.0, 1.0]), np.array([1.0, 0.2, 0.2]))
    pressed = elastic_window._strength(0.0, 1.0, chain)
    assert pressed == pytest.approx(1.3 * 2**0.4 * 5**0.6, rel=1e-14, abs=0)


@pytest.mark.parametrize(
    ("behind", "peak", "velocity", "striking", "cuts"),
    [
        (0.79, 1.0, 0.0, 0.0, True),
        (0.80, 1.0, 0.0, 0.0, False),
        (0.5, 0.64, 0.0, 0.0, True),
        (0.5, 0.63, 0.0, 0.0, False),
        (0.5, 1.0, 0.660, 0.0, True),
        (0.5, 1.0, 0.663, 0.0, False),
        (0.5, 1.0, 0.0, 0.330, True),  # a striker gives twice its velocity
        (0.5, 1.0, 0.0, 0.332, False),
    ],
)
def test_what_a_striker_may_leave_behind(
    behind: float, peak: float, velocity: float, striking: float, cuts: bool
) -> None:
    """The same of stiffness k and mass m: forces are k times larger, velocities (k/m)^(1/2)."""
    k, m = 3.0, 0.2
    u, v, peaks, granules = quiet_chain(13, behind)
    u, v, peaks = np.append(u[0] + 10.0, u), np.append(striking, v), np.append(1.0, peaks)
    v[1], peaks[1] = velocity, peak
    chain = touching(np.full(granules + 1, k), np.full(granules + 1, 1 / m))
    chain.stiffness[0], chain.inverse_mass[0] = 7.0, 0.01
    u[0] = u[1] - 10.0  # the striker does not touch
    cut, _ = left_behind(u, v * math.sqrt(k / m), peaks * k, granules, chain)
    assert cut == (7 if cuts else 0)


@pytest.mark.parametrize(
    ("velocity", "peak", "settled"),
    [
        (0.3, 1.0, True),
        (0.69, 1.0, True),  # 1.2 times 1.3 v^1.2 is 0.9994
        (0.70, 1.0, False),
        (0.3, 0.37, True),  # 0.368
        (0.3, 0.36, False),
    ],
)
def test_when_no_peak_can_change(velocity: float, peak: float, settled: bool) -> None:
    # Granules apart from one another; the last has flown off.
    u, v = np.arange(0.0, 10.0), np.zeros(10)
    v[0], v[-1] = velocity, 2.0
    peaks = np.ones(9)
    peaks[5] = peak
    u = np.append(u, 1e30)
    assert elastic_window.is_settled(u, v, peaks, 0, 0, 10, None) == settled


@pytest.mark.parametrize(
    ("start", "end", "pushed"),
    [
        ((0.8373, 1.0318), (0.5468, 0.0005), (0.1221, 0.9665)),
        ((0.5837, -0.0885), (0.8343, -1.0891), (0.9775, 0.0347)),
    ],
    ids=["rises at both ends", "falls at both ends"],
)
def test_a_maximum_in_a_step_whose_rate_is_no_parabola(
    start: tuple[float, float],
    end: tuple[float, float],
    pushed: tuple[float, float],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two granules, a step of length 1: overlap and rate at its ends, and the applied force.

    If the rate were a parabola that reaches 0, the sum of both rates would be half of the change of
    acceleration at most. Here it is 0.658 and 0.748 of it.
    """
    for module in (elastic_maxima, interpolant):
        for name, function in vars(module).items():
            if hasattr(function, "py_func"):  # nothing is compiled for two steps
                monkeypatch.setattr(module, name, function.py_func)
    ends = []
    for (overlap, rate), force in zip((start, end), pushed, strict=True):
        contact = overlap**1.5
        accelerations = np.array([force - contact, contact, 0.0])
        ends.append((np.array([overlap, 0, 1e30]), np.array([rate, 0, 0]), accelerations))
    (u0, v0, a), (u, v, g) = ends
    leg = np.array([0.0, 1.0, 1.0, 1.0, 0.0, 1.0, *pushed])
    found, at = np.zeros(1), np.full(1, np.nan)
    elastic_maxima.keep_peaks(
        found, at, 0, u0, v0, a, u, v, g, 0, 2, leg, 0.0, 1.0, 1.0, 0.0, True, 0.0,
        np.zeros(7), None,
    )  # fmt: skip
    slope = pushed[1] - pushed[0]
    derivatives = [
        (overlap, rate, force - 2 * overlap**1.5, slope - 3 * np.sqrt(overlap) * rate)
        for (overlap, rate), force in zip((start, end), pushed, strict=True)
    ]
    before, after = ([np.array([[value]]) for value in known] for known in derivatives)
    coefficients = hermite.coefficients(before, after, np.ones((1, 1)))[:, 0, 0]
    curve = np.polynomial.Polynomial(coefficients)
    roots: Any = curve.deriv().roots()
    turns = [float(t.real) for t in roots if abs(t.imag) < 1e-9 and 0 < t.real < 1]
    highest = max(turns, key=lambda t: float(curve(t)))
    assert curve(highest) > 1.05 * max(start[0], end[0])
    assert len(turns) == 2
    assert found[0] == pytest.approx(curve(highest) ** 1.5, rel=1e-12, abs=0)
    assert at[0] == pytest.approx(highest, rel=1e-9, abs=0)


@pytest.mark.parametrize(
    "kernel",
    [elastic.march, damped_kernel.march, damped_verlet_kernel.take_steps, lanes_kernel.march_lanes],
    ids=lambda kernel: kernel.py_func.__module__,
)
def test_a_kept_kernel_is_forgotten_when_a_module_changes_that_it_calls(kernel: Any) -> None:
    """Also one that it imports by another; Numba itself sees changes in its own file alone."""
    home = kernel.py_func.__module__
    used, waiting = set[str](), [home]
    while waiting:
        used.add(name := waiting.pop())
        tree = ast.parse(Path(str(sys.modules[name].__file__)).read_text(encoding="utf-8"))
        here = {str(node.module) for node in tree.body if isinstance(node, ast.ImportFrom)}
        here = {name for name in here if name.startswith("hertzchain.engines.native.")}
        waiting += here - used
    assert {home, "hertzchain.engines.native.compiling"} < used
    stamp = kernel._cache._cache_file._source_stamp
    for name in used:
        path = Path(str(sys.modules[name].__file__))
        file = path.stat()
        assert (path.name, file.st_mtime, file.st_size) in stamp, name
