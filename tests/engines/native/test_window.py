"""The moving window: what may be left behind, and that no peak depends on it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native import elastic, elastic_chain
from hertzchain.engines.native.elastic_chain import Ending, Seen, Start, at_the_start
from hertzchain.engines.native.plan import SRKN_11B, Walker, cheapest
from hertzchain.engines.native.simulation import Prepared, leg_rows, room_for, simulate, steps_of
from hertzchain.limits import Deadline
from tests.conftest import STEEL, paper_scene


@pytest.mark.parametrize(
    ("ratio", "duration"),
    [*((0.05, n) for n in (1.1, 2.0, 50.0)), (1.0, 1.1), (10.0, 50.0), (100.0, 2.0), (1000.0, 1.1)],
)
@pytest.mark.parametrize(
    "walker", [Walker(SRKN_11B), cheapest(1e-6).walker], ids=["fixed", "refined"]
)
def test_peaks_in_a_window_are_bitwise_those_of_the_full_chain(
    ratio: float, duration: float, walker: Walker
) -> None:
    granules = {100.0: 800, 1000.0: 120}.get(ratio, 300)
    scene = paper_scene("cosine", ratio, duration, granules)
    legs = scene.schedule(0.4 * scene.units.time)
    prepared = Prepared.of(scene, Deadline(60.0))
    full = replace(prepared, moving=granules).simulate(walker.cut(legs), walker)
    ahead = simulate(scene, legs, walker)
    window = simulate(scene, legs, walker, leave_behind=True)
    for run in (ahead, window):
        assert np.array_equal(run.peaks.force, full.peaks.force)
        assert np.array_equal(run.peaks.time, full.peaks.time)
    assert np.array_equal(ahead.displacement, full.displacement)


def outcome(scene: hc.Scene, leave_behind: bool, step: float = 0.4, control: Any = None) -> Any:
    """Return the kernels' results of a run besides its peaks; ``step`` in natural time units."""
    contacts = scene.chain.granules - 1
    seen = Seen(np.zeros(contacts), np.full(contacts, np.nan), room_for())
    rows = leg_rows(scene.schedule(step * scene.units.time), scene.units)
    control = np.zeros(3) if control is None else control
    steps, at_rest = steps_of(rows, Walker(SRKN_11B)), Start(np.zeros((0, 0)), 8)
    state, ending = at_the_start(contacts + 1), Ending(math.nan, leave_behind)
    return elastic.march(steps, None, at_rest, state, seen, None, ending, control)


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


def test_later_waves_press_the_free_end_harder() -> None:
    """LM_ratio 20: the second wave is 0.89 of the first, and stays in the window."""
    scene = paper_scene("triangular", 20.0, 2.0, 4000)
    legs, walker = scene.schedule(0.4 * scene.units.time), Walker(SRKN_11B)
    full = simulate(scene, legs, walker)
    window = simulate(scene, legs, walker, leave_behind=True)
    first = full.peaks.force[-40]
    # The leading wave presses none of the last contacts harder than the others.
    assert full.peaks.force[-3] > 1.005 * first
    assert np.array_equal(window.peaks.force, full.peaks.force)
    assert np.array_equal(window.peaks.time, full.peaks.time)
    # Dropped granules are counted: nothing is lost.
    assert window.momentum == pytest.approx(full.momentum, rel=1e-11, abs=0)
    # In steps of 0.4 the contacts that open behind the train cost the full chain 1e-5 later on.
    assert window.energy == pytest.approx(full.energy, rel=1e-4, abs=0)


def test_under_a_long_pulse_nothing_is_left_behind() -> None:
    scene = paper_scene("cosine", 100.0, 2.0, 300)
    assert outcome(scene, True).granule_evaluations == outcome(scene, False).granule_evaluations


def test_a_stopped_run_says_so() -> None:
    stopped = outcome(paper_scene("cosine", 1.0, 2.0, 100), False, 0.1, np.array([-1.0, 0.0, 0.0]))
    assert stopped.status == elastic_chain.STOPPED
    assert stopped.end < 5  # looked at every four natural time units


def double_pulse() -> hc.Scene:
    """A second pulse long after the first: its waves break out of a packet near the free end."""
    rows = hc.PulseTable(
        (0.0, 2.5e-5, 5e-5, 1.115e-3, 1.15e-3, 1.184e-3), (0.0, 100.0, 0.0, 0.0, 78.6, 0.0)
    )
    return hc.Scene(hc.Chain(26, **STEEL), rows)


def test_after_two_pulses_nothing_is_left_behind() -> None:
    scene = double_pulse()
    legs = scene.schedule(0.1 * scene.units.time)
    full = simulate(scene, legs, Walker(SRKN_11B))
    peaks = simulate(scene, legs, Walker(SRKN_11B), leave_behind=True)
    assert np.array_equal(peaks.peaks.force, full.peaks.force)
    assert np.all(np.isfinite(peaks.displacement))
    true = hc.Native("reference").run(scene).peak_force
    for error in (
        hc.Native(rtol=1e-6, peaks_only=True).run(scene).peak_force / true - 1,
        hc.peak_forces([scene], 1e-6).peak_force[0] / true - 1,
    ):
        assert np.max(np.abs(error)) < 1e-6


def left_behind(u: Any, v: Any, peaks: Any, hi: int) -> int:
    return int(elastic.left_behind(u, v, peaks, 0, hi))


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
    assert left_behind(u, v, peaks, granules - 1) == (quiet - 7 if cuts else 0)


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
    u, v = np.arange(0.0, 10.0), np.zeros(10)
    v[0], v[-2:] = velocity, (1.5, 2.0)  # the last two fly off
    peaks = np.ones(9)
    peaks[5] = peak
    u = np.append(u, 1e30)
    assert elastic.is_settled(u, v, peaks, 0, 10) == settled
