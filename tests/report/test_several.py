"""Pictures of several results: lines are their numbers, bands their errors."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from tests.conftest import paper_scene

SCENE = replace(paper_scene("cosine", 1.0, 2.0, granules=12), gauges=(hc.Gauge(contact=5),))


@pytest.fixture(scope="module")
def runs() -> list[hc.Result]:
    """Runs of three largest forces, the one in the middle last."""
    assert SCENE.pulse is not None
    shocks = [replace(SCENE.pulse, peak_force=force) for force in (90.0, 110.0, 100.0)]
    return [hc.Native(rtol=1e-4).run(replace(SCENE, shock=one), record=300) for one in shocks]


def axes_of(*given: Any) -> Any:
    return hc.plot(*given).axes


def test_peaks_have_the_band_of_their_error(runs: list[hc.Result]) -> None:
    (axes,) = axes_of({"low": runs[0], "high": runs[1]})
    for line, result in zip(axes.lines, runs, strict=False):
        np.testing.assert_array_equal(line.get_ydata(), result.peak_force)
        np.testing.assert_array_equal(line.get_xdata(), result.contact)
    (low, _) = axes.collections
    heights = low.get_paths()[0].vertices[:, 1]
    assert heights.max() == pytest.approx(np.max(runs[0].peak_force * (1 + runs[0].peak_errors)))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["low", "high"]
    assert len({(line.get_linestyle(), line.get_marker()) for line in axes.lines}) == 2  # in grey


def test_several_of_one_name_are_a_band_about_their_median(runs: list[hc.Result]) -> None:
    (axes,) = axes_of({"all": runs})
    np.testing.assert_allclose(axes.lines[0].get_ydata(), runs[2].peak_force, rtol=1e-9)
    edges = np.percentile([run.peak_force for run in runs], (5, 95), axis=0)
    heights = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert (heights.min(), heights.max()) == pytest.approx((edges[0].min(), edges[1].max()))


def test_forces_stand_one_above_the_other_or_in_one_panel(runs: list[hc.Result]) -> None:
    above, below = axes_of({"a": runs[0], "b": runs[1]}, "forces", [3, 8], (3.4, 2.6))
    assert (above.get_ylabel(), below.get_ylabel()) == ("contact 3 [N]", "contact 8 [N]")
    assert max(below.lines[1].get_ydata()) == runs[1].peak_at(8)  # the exact peak is on the line
    (axes,) = axes_of({"a": runs[0]}, "forces", [3, 8])
    assert [line.get_label() for line in axes.lines] == ["contact 3", "contact 8"]
    begin, end = axes.get_xlim()
    assert begin < runs[0].peak_time[1] < runs[0].peak_time[6] < end < runs[0].history.time[-1]


def test_gauges_are_what_traces_have(runs: list[hc.Result]) -> None:
    (axes,) = axes_of({"a": runs[0]}, "gauges")
    traces = runs[0].to_traces()
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), traces[traces.columns[1]])


def test_what_cannot_be_drawn_is_refused(runs: list[hc.Result]) -> None:
    with pytest.raises(hc.HertzchainError, match="must be one of peaks, forces, gauges"):
        axes_of({"a": runs[0]}, "speed")
    with pytest.raises(hc.HertzchainError, match="record"):
        axes_of({"a": runs[0], "b": replace(runs[0], history=None)}, "forces")
    with pytest.raises(hc.HertzchainError, match="must be results by name"):
        axes_of(runs[0])
    with pytest.raises(hc.HertzchainError, match="a result, or a list of them, for each name"):
        axes_of({"a": []})
    with pytest.raises(hc.HertzchainError, match="must be numbers from 2 to 12, which all"):
        axes_of({"a": runs[0]}, "forces", [13])


def test_results_of_other_chains_and_ends(runs: list[hc.Result]) -> None:
    """Default contacts are there in all; a band ends where the first of its results does."""
    other = replace(SCENE, chain=replace(SCENE.chain, granules=8), gauges=())
    short = hc.Native(rtol=1e-4).run(other, record=300)
    for axes in axes_of({"long": runs[0], "short": short}, "forces"):
        assert len(axes.lines) == 2
        assert int(axes.get_ylabel().split()[1]) <= 8
    with pytest.raises(hc.HertzchainError, match="must have chains of one length"):
        axes_of({"a": [runs[0], short]})
    half = np.linspace(0, runs[0].history.time[-1] / 2, 150)
    ended = hc.Native(rtol=1e-4).run(SCENE, record=half)
    (axes,) = axes_of({"both": [runs[0], ended]}, "forces", [5])
    assert max(axes.lines[0].get_xdata()) <= half[-1]


def test_a_gauge_without_a_first_pulse_is_drawn_without_a_band(runs: list[hc.Result]) -> None:
    early = replace(SCENE, run=hc.Run(float(runs[0].gauges[0].arrival) / 2))
    none = hc.Native(rtol=1e-4).run(early, record=300)
    (axes,) = axes_of({"early": none, "whole": runs[0]}, "gauges")
    assert len(axes.lines) == 2
