"""Figures and tables of motion show the numbers of results and comparisons."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain.report.contents import of_result
from hertzchain.report.document import describe
from hertzchain.report.figures import drawn_contacts, figure_of, plot_times
from hertzchain.report.files import motion_frame, write_frame
from hertzchain.report.style import force_limits
from tests.conftest import paper_scene
from tests.places import ROOT
from tests.report.conftest import lines_of, plot_comparison

# Comparisons


def test_a_plot_has_a_point_for_every_number(
    both: hc.Comparison, tmp_path: Path, drawn: list[Figure]
) -> None:
    plot_comparison(both, tmp_path / "plot.svg")
    assert [path.name for path in tmp_path.iterdir()] == ["plot.svg"]
    text = (tmp_path / "plot.svg").read_text()
    ElementTree.fromstring(text)  # noqa: S314 - it is our own
    for label in ("peak force [N]", "native, reference", "LAMMPS", "Eq. 6", "p = 5"):
        assert label in text
    (figure,) = drawn
    above, below = map(lines_of, figure.axes)
    native, lammps, formulas = both.native, both.lammps, both.formulas
    np.testing.assert_array_equal(above["native, reference"], (native.contact, native.peak_force))
    values = {"LAMMPS": lammps.peak_force, "Eq. 6": formulas.eq6, "Eq. 9": formulas.eq9}
    for label, peaks in values.items():
        np.testing.assert_array_equal(above[label], (native.contact, peaks))
        off = np.abs(peaks / native.peak_force - 1)
        off[off == 0] = np.nan  # of which a logarithmic axis has none
        np.testing.assert_array_equal(below[label], (native.contact, off))
    styles = {line.get_label(): line.get_linestyle() for line in figure.axes[1].lines}
    assert styles["LAMMPS, error estimate"] == "--" != styles["reference, error estimate"]
    assert set(below["LAMMPS, error estimate"][1]) == {lammps.error_estimate}
    assert set(below["reference, error estimate"][1]) == {native.error_estimate}


def test_a_plot_without_formulas_is_drawn(
    native: hc.Comparison, tmp_path: Path, drawn: list[Figure]
) -> None:
    nothing = np.full_like(native.formulas.eq6, np.nan)
    formulas = replace(native.formulas, applicable="none", eq6=nothing, eq9=nothing)
    plot_comparison(replace(native, formulas=formulas), tmp_path / "plot.png")
    (above,) = map(lines_of, drawn[0].axes)  # there is nothing to compare
    assert next(iter(above.values()))[1].tolist() == native.native.peak_force.tolist()
    assert not {"Eq. 6", "Eq. 9"} & above.keys()


# Runs


SCENES = ROOT / "validation" / "scenes"

WITH_A_WALL = hc.Scene.from_toml(SCENES / "terms" / "striker_on_a_wall.toml")


@pytest.fixture(scope="module")
def result(demo: hc.Scene) -> hc.Result:
    """The demo scene, recorded as its plot wants it."""
    return hc.Native(rtol=1e-6).run(demo, plot_times(demo))


@pytest.fixture(scope="module")
def on_a_wall() -> hc.Result:
    """A striker on a chain at a wall, at 40 times."""
    return hc.Native(rtol=1e-6).run(WITH_A_WALL, np.linspace(0, WITH_A_WALL.end_time, 40))


def test_the_table_has_a_row_for_each_time_and_granule(result: hc.Result) -> None:
    frame, history = motion_frame(result), result.history
    assert len(frame) == history.time.size * 60
    for name, values in (
        ("displacement_m", history.displacement),
        ("velocity_m_s", history.velocity),
    ):
        wide = frame.pivot_table(index="time_s", columns="granule", values=name)
        assert np.array_equal(wide.columns, range(1, 61))
        assert wide.index.tolist() == history.time.tolist()
        assert np.array_equal(wide.to_numpy(), values)
    wide = frame.pivot_table(index="time_s", columns="granule", values="contact_force_N")
    assert np.array_equal(wide[list(range(2, 61))].to_numpy(), history.contact_force)
    assert np.array_equal(wide[1], result.scene.applied_force(history.time))


def test_a_wall_is_one_more_granule_that_stands_still(on_a_wall: hc.Result) -> None:
    """It is marked among the peaks."""
    frame, history = motion_frame(on_a_wall), on_a_wall.history
    assert np.max(history.contact_force[:, -1]) > 0
    count = WITH_A_WALL.chain.granules
    lines = figure_of(of_result(on_a_wall)).axes[0].lines
    (marked,) = (line for line in lines if line.get_label() == "wall")
    assert np.array_equal(marked.get_xydata(), [[count + 1, on_a_wall.peak_at(count + 1)]])
    assert frame["granule"].unique().tolist() == list(range(1, count + 2))
    force = frame["contact_force_N"].to_numpy().reshape(40, -1)
    assert np.array_equal(force[:, 1:], history.contact_force)
    assert not frame.loc[frame["granule"] == count + 1, "displacement_m"].any()


def test_a_single_contact_has_a_map(demo: hc.Scene) -> None:
    bead = replace(demo, chain=replace(demo.chain, granules=1), wall=hc.Wall("same"))
    run = hc.Native().run(bead, plot_times(bead))
    *_, space_time, _ = figure_of(of_result(run)).axes
    (colours,) = space_time.collections
    assert isinstance(colours, QuadMesh)
    assert np.ptp(np.asarray(colours.get_coordinates())[..., 1]) == 1.0
    assert describe(bead).endswith("1 granule, with wall")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_files_read_back(tmp_path: Path, on_a_wall: hc.Result, suffix: str) -> None:
    path = tmp_path / f"motion{suffix}"
    write_frame(motion_frame(on_a_wall), path)
    frame = pd.read_csv(path) if suffix == ".csv" else pd.read_parquet(path)
    pd.testing.assert_frame_equal(frame, motion_frame(on_a_wall), check_exact=True)
    assert [frame.loc[k, "contact_force_N"] for k in (0, 1)] == [0, 0]


def test_the_figure_draws_the_result(result: hc.Result) -> None:
    figure = figure_of(of_result(result))
    contacts = drawn_contacts(result, 6)
    assert figure.get_suptitle() == describe(result.scene)
    peaks, forces, space_time, *_ = figure.axes
    assert np.array_equal(peaks.lines[0].get_ydata(), result.peak_force)
    assert peaks.lines[0].get_marker() == "."
    is_band(peaks.collections[0], result)
    for axes in (peaks, forces):
        largest = max(np.max(line.get_ydata()) for line in axes.lines)
        assert axes.get_ylim() == pytest.approx((0.0, 1.08 * largest))
    assert (legend := forces.get_legend()) is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        "applied force",
        *(f"contact {contact}" for contact in contacts),
    ]
    for line, contact in zip(forces.lines[1:], contacts, strict=True):
        # Each curve has its exact peak, not the largest recorded force.
        assert np.max(line.get_ydata()) == result.peak_force[contact - 2]
    (colours,) = space_time.collections
    assert isinstance(colours, QuadMesh)
    edges = np.asarray(colours.get_coordinates())[0, :, 0]
    begin, end = space_time.get_xlim()
    shown = (result.history.time >= begin) & (result.history.time <= end)
    force, time = result.history.contact_force, result.history.time[shown]
    assert np.all((edges[:-1] <= time) & (time <= edges[1:]))  # each column is at its time
    assert (edges[0], edges[-1]) == (time[0], time[-1])
    assert np.all(np.max(force, axis=0) > 0.95 * result.peak_force)  # times keep the height
    assert np.array_equal(np.asarray(colours.get_array()), force[shown].T)
    assert np.max(force[~shown], initial=0.0) < 0.01 * np.max(force)  # nothing to see
    assert (space_time.get_xlabel(), space_time.get_ylabel()) == ("time [ms]", "contact")


def test_a_run_that_no_wave_has_passed_draws_its_first_contact() -> None:
    plain = paper_scene("cosine", 1.0, 2.0, granules=5)
    early = replace(plain, run=hc.Run(plain.pulse_end / 10))
    assert drawn_contacts(hc.Native().run(early, record=9), 3) == [2]


def test_gauges_of_a_scene_are_what_is_drawn() -> None:
    """With enough samples of a short run that straight lines between them keep a crest."""
    scene = paper_scene("cosine", 2.0, 2.0, granules=9)
    scene = replace(scene, gauges=(hc.Gauge(granule=4), hc.Gauge(contact=7)))
    result = hc.Native(wanted="all").run(scene, plot_times(scene))
    _, forces, _, *_ = figure_of(of_result(result)).axes
    assert [line.get_label() for line in forces.lines] == ["gauge 4", "contact 7"]
    assert forces.get_ylabel() == "force on a gauge [N]"
    readings = hc.Native(wanted="first").run(scene).gauges
    for line, reading in zip(forces.lines, readings, strict=True):
        assert np.max(line.get_ydata()) == pytest.approx(reading.force, rel=1e-3)


def test_first_pulses_are_drawn_where_they_were_asked_for() -> None:
    """Contacts without one are a gap."""
    plain = paper_scene("cosine", 1.0, 2.0, granules=9)
    short = replace(plain, run=hc.Run(6e-5))  # ends before the wave is at the last contacts
    result = hc.Native(rtol=1e-4, wanted="first").run(short)
    force = result.first_columns["first_peak_force_N"]
    lacks = np.flatnonzero(np.isnan(force)) + 2
    assert 0 < lacks.size < result.contact.size
    (axes,) = figure_of(of_result(result)).axes
    line = axes.lines[0]
    np.testing.assert_array_equal(line.get_ydata(), force)
    assert line.get_marker() == "."  # a contact between two gaps has no line
    assert line.get_label() == "first pulse"
    assert axes.get_ylabel() == "first pulse [N]"
    all_peaks = hc.Native(rtol=1e-4, wanted="all").run(plain)
    (axes,) = figure_of(of_result(all_peaks)).axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), all_peaks.peak_force)
    assert axes.get_ylabel() == "peak force [N]"
    assert axes.get_legend() is None


def test_peaks_are_named_beside_a_static_force() -> None:
    plain = paper_scene("cosine", 1.0, 2.0, granules=9)
    result = hc.Native(rtol=1e-4).run(replace(plain, precompression=hc.Precompression(20.0)))
    (axes,) = figure_of(of_result(result)).axes
    labels = [line.get_label() for line in axes.lines[:2]]
    assert labels == ["peak force", "static force"]
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), result.static_force)


# Several results: lines are their numbers, bands their errors


SCENE = replace(paper_scene("cosine", 1.0, 2.0, granules=12), gauges=(hc.Gauge(contact=5),))


@pytest.fixture(scope="module")
def runs() -> list[hc.Result]:
    """Runs of three largest forces, the one in the middle last."""
    assert SCENE.pulse is not None
    shocks = [replace(SCENE.pulse, peak_force=force) for force in (90.0, 110.0, 100.0)]
    return [hc.Native(rtol=1e-4).run(replace(SCENE, shock=shock), record=300) for shock in shocks]


def axes_of(*given: Any) -> Any:
    return hc.plot(*given).axes


def edges_of(band: Any) -> list[list[float]]:
    """Return the lower and the upper edge of a band, at each x."""
    x, y = band.get_paths()[0].vertices.T
    return [[edge(y[x == at]) for at in np.unique(x)] for edge in (np.min, np.max)]


def is_band(band: Any, result: hc.Result) -> None:
    edges = [result.peak_force * (1 + sign * result.peak_errors) for sign in (-1, 1)]
    np.testing.assert_allclose(edges_of(band), edges, rtol=1e-14)


def test_peaks_have_bands_of_their_error_or_about_their_median(runs: list[hc.Result]) -> None:
    (axes,) = axes_of({"low": runs[0], "high": runs[1]})
    for line, result in zip(axes.lines, runs, strict=False):
        np.testing.assert_array_equal(line.get_ydata(), result.peak_force)
        np.testing.assert_array_equal(line.get_xdata(), result.contact)
    for band, result in zip(axes.collections, runs, strict=False):
        is_band(band, result)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["low", "high"]
    assert len({(line.get_linestyle(), line.get_marker()) for line in axes.lines}) == 2  # in grey
    (axes,) = axes_of({"all": runs})
    np.testing.assert_allclose(axes.lines[0].get_ydata(), runs[2].peak_force, rtol=1e-9)
    edges = np.percentile([run.peak_force for run in runs], (5, 95), axis=0)
    np.testing.assert_allclose(edges_of(axes.collections[0]), edges, rtol=1e-12)
    assert axes.get_ylim() == force_limits(np.min(edges), np.max(edges))


def test_forces_stand_one_above_the_other_or_in_one_panel(runs: list[hc.Result]) -> None:
    above, below = axes_of({"a": runs[0], "b": runs[1]}, "forces", [3, 8], (3.4, 2.6))
    assert (above.get_ylabel(), below.get_ylabel()) == ("contact 3 [N]", "contact 8 [N]")
    assert max(below.lines[1].get_ydata()) == runs[1].peak_at(8)  # the exact peak is on the line
    (axes,) = axes_of({"a": runs[0]}, "forces", [3, 8])
    assert [line.get_label() for line in axes.lines] == ["contact 3", "contact 8"]
    begin, end = axes.get_xlim()
    assert begin < runs[0].peak_time[1] < runs[0].peak_time[6] < end < runs[0].history.time[-1]


def test_gauges_are_what_traces_have_and_bands_need_a_pulse(runs: list[hc.Result]) -> None:
    (axes,) = axes_of({"a": runs[0]}, "gauges")
    traces = runs[0].to_traces()
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), traces[traces.columns[1]])
    early = replace(SCENE, run=hc.Run(float(runs[0].gauges[0].arrival) / 2))
    none = hc.Native(rtol=1e-4).run(early, record=300)
    (axes,) = axes_of({"early": none, "whole": runs[0]}, "gauges")
    assert len(axes.lines) == 2


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
    for size in (3, (3.4, 0.0), (1.0, 2.0, 3.0)):
        with pytest.raises(
            hc.HertzchainError, match=r"must be (2 values, each|a width and a height)"
        ):
            axes_of({"a": runs[0]}, "peaks", None, size)
        with pytest.raises(
            hc.HertzchainError, match=r"must be (2 values, each|a width and a height)"
        ):
            runs[0].plot(size)  # type: ignore[arg-type]


def test_times_of_a_plot_fit_into_memory(demo: hc.Scene) -> None:
    """Four million forces at most, and never fewer than two times."""
    for granules, times in ((8_000, 500), (4_000_000, 2)):
        long = replace(demo, chain=replace(demo.chain, granules=granules))
        assert plot_times(long).tolist() == [*np.linspace(0.0, long.end_time, times)]
