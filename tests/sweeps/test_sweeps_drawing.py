"""Pictures of sweeps show the values of the tables, and report what they omit."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.sweeps import drawing
from hertzchain.sweeps.columns import columns_of, full_name
from hertzchain.sweeps.drawing import cell_edges, draw
from tests.command_line import Command
from tests.conftest import paper_scene
from tests.sweeps.conftest import BASE, F_SW, LAMMPS, PROFILES, RATIO, N, P, drawn_lines, legend

pytestmark = [pytest.mark.lammps, pytest.mark.usefixtures("one_core")]


def test_a_line_for_each_profile_is_what_the_table_has(both: hc.Sweep) -> None:
    drawn = draw(both, RATIO, F_SW, "shock.profile", {"backend": "native"})
    table = both.to_frame()
    table = table[table["backend"] == "native"]
    profiles = ["cosine", "triangular", "cosine-triangular"]
    assert legend(drawn.figure) == profiles
    handles = drawn.figure.legends[0].legend_handles
    colours = {
        str(handle.get_color()): name for handle, name in zip(handles, profiles, strict=True)
    }
    (axes,) = drawn.figure.axes
    assert len({*colours}) == len(axes.lines) == 3
    for line in axes.lines:
        rows = table[table["shock.profile"] == colours[line.get_color()]]
        np.testing.assert_array_equal(line.get_xdata(), rows[RATIO])
        np.testing.assert_array_equal(line.get_ydata(), rows[F_SW])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("LM_ratio", "F_SW [N]")
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    assert axes.get_title() == "backend native"
    assert drawn.remarks == []


def test_backends_are_told_apart_where_nothing_is_asked_for(both: hc.Sweep) -> None:
    drawn = draw(both, RATIO, F_SW)
    assert legend(drawn.figure) == ["lammps", "native"]
    assert len(drawn_lines(drawn.figure)) == 6
    assert drawn.remarks == ["shock.profile varies, too, and no colour tells the values apart"]
    assert len({str(line.get_color()) for line in drawn.figure.axes[0].lines}) == 2
    assert drawn.remarks[0] in drawn.figure.get_supxlabel().replace("\n", " ")


def test_too_many_lines_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    swept = hc.sweep(BASE, {RATIO: "0.1,1", N: "2:3:4"}, peaks=True)
    for x, y, lines in ((RATIO, "largest_peak_force_N", 4), ("contact", "peak_force_N", 8)):
        monkeypatch.setattr(drawing, "_MOST_MARKS", lines)
        assert len(draw(swept, x, y).figure.axes[0].lines) == lines
        monkeypatch.setattr(drawing, "_MOST_MARKS", lines - 1)
        with pytest.raises(hc.HertzchainError, match=f"lines = {lines}: must be .* fix values"):
            draw(swept, x, y)


def test_peaks_of_all_contacts_are_lines_along_the_chain(grid: hc.Sweep) -> None:
    swept = hc.sweep(BASE, {"chain.young_modulus": "1e11,1.46e11", N: "2,4"}, peaks=True)
    drawn = draw(swept, "contact", "peak_force_N", N, {"young_modulus": "146 GPa"})
    axes = drawn.figure.axes[0]
    table = swept.peaks_to_frame()
    for line, scene in zip(axes.lines, (2, 3), strict=True):
        rows = table[table["scene"] == scene]
        np.testing.assert_array_equal(line.get_ydata(), rows["peak_force_N"])
        np.testing.assert_array_equal(line.get_xdata(), rows["contact"])
    assert drawn.figure.axes[1].get_ylabel() == "n"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("contact", "peak force [N]")
    assert "Young's modulus E = 146 GPa" in axes.get_title().replace("\n", " ")
    drawn = draw(swept, "contact", "peak_force_N")
    assert drawn.figure.axes[1].get_ylabel() == "Young's modulus E [GPa]"
    assert drawn.remarks == [f"{N} varies, too, and no colour tells the values apart"]
    with pytest.raises(hc.HertzchainError, match="must be one of peak_force_N, peak_time_s"):
        draw(swept, "contact", F_SW)
    with pytest.raises(hc.HertzchainError, match="sweep again with --peaks"):
        draw(grid, "contact", "peak_force_N")


def test_rows_without_a_number_are_left_out_and_counted(failing: hc.Sweep) -> None:
    drawn = draw(failing, "shock.peak_force", F_SW)
    ((x, y),) = drawn_lines(drawn.figure)
    rows = failing.to_frame().dropna(subset=F_SW)
    np.testing.assert_array_equal(x, rows["shock.peak_force"])
    np.testing.assert_array_equal(y, rows[F_SW])
    without = "solitary_wave_force_N and are left out; 2 of them failed"
    assert drawn.remarks == [f"2 of 5 rows have no {without}"]


def test_a_sweep_that_is_not_complete_is_drawn_as_far_as_it_is(
    folder: Path, tmp_path: Path
) -> None:
    there = tmp_path / "begun"
    shutil.copytree(folder, there)
    lost = sorted((there / "scenes").glob("lammps-*"))[1]
    gone = pd.read_parquet(lost)
    lost.unlink()
    where = {"backend": "lammps", "shock.profile": gone["shock.profile"].iloc[0]}
    drawn = draw(hc.Sweep.load(there), RATIO, F_SW, where=where)
    ((x, _),) = drawn_lines(drawn.figure)
    assert not set(x) & set(gone[RATIO])
    assert drawn.remarks == [f"the sweep is not complete, {24 - len(gone)} of 24 rows are there"]


def test_nothing_to_draw_is_refused() -> None:
    swept = hc.sweep(paper_scene("cosine", 1.0, 4.0, granules=4), {RATIO: "1,2"})
    with pytest.raises(hc.HertzchainError, match="nothing to draw: no row has transition_gran"):
        draw(swept, RATIO, P)


def test_the_section_may_be_left_out() -> None:
    columns = [column.name for column in columns_of(BASE, [])]
    assert {full_name(name, columns, []) for name in ("momentum_ratio", "LM_ratio", RATIO)} == {
        RATIO
    }
    assert [
        full_name(name, columns, []) for name in ("speed_m_s", "p", "F_SW", "F0", "n", "N")
    ] == [
        *("speed_m_s", "transition_granules", "solitary_wave_force_N"),
        *("shock.peak_force", "shock.duration_ratio", "chain.granules"),
    ]
    both = ["chain.young_modulus", "wall.young_modulus"]
    assert full_name("young_modulus", both, ["wall.young_modulus"]) == both[1]
    for varied in ([], both):
        with pytest.raises(hc.HertzchainError, match="is in several sections: name one of"):
            full_name("young_modulus", both, varied)
    with pytest.raises(hc.HertzchainError, match=r"did you mean shock.momentum_ratio\?$"):
        full_name("shock.momentum_ration", columns, [])
    assert len({name.partition(".")[2] or name for name in columns}) == len(columns)


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ({RATIO: 0.2}, "is not in the sweep; the nearest there: 0.1 and 0.27144"),
        ({RATIO: "nan"}, "is not in the sweep"),
        ({"shock.profile": "sine"}, "is not in the sweep: cosine, triangular"),
        ({"backend": "yade"}, "is not in the sweep: lammps, native"),
        ({"chain.radius": "1 mm"}, "has no list or grid of values in this sweep, as have: "),
        ({"speed_m_s": 1}, "has no list or grid"),
        ({RATIO: 0.1, "momentum_ratio": 0.1}, "is fixed twice"),
    ],
)
def test_a_value_that_is_not_there_is_refused(
    both: hc.Sweep, where: dict[str, Any], words: str
) -> None:
    with pytest.raises(hc.HertzchainError, match=words):
        draw(both, N, F_SW, where=where)


# Maps


def test_the_cells_of_a_map_are_what_the_table_has(grid: hc.Sweep) -> None:
    drawn = draw(grid, RATIO, N, F_SW)
    axes, bar = drawn.figure.axes
    mesh: Any = axes.collections[0]
    cells = np.asarray(mesh.get_array()).reshape(3, 5)
    wanted = grid.to_frame().pivot_table(index=N, columns=RATIO, values=F_SW)
    np.testing.assert_array_equal(cells, wanted)
    x, y = mesh.get_coordinates()[0, :, 0], mesh.get_coordinates()[:, 0, 1]
    ratio = wanted.columns.to_numpy()
    np.testing.assert_allclose(x[1:-1], np.sqrt(ratio[1:] * ratio[:-1]), rtol=1e-14)
    np.testing.assert_array_equal(y, [1, 3, 6.5, 11.5])
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    assert (axes.get_xlabel(), axes.get_ylabel(), bar.get_ylabel()) == ("LM_ratio", "n", "F_SW [N]")
    assert drawn.remarks == []


def test_a_map_of_a_sample_is_points(sampled: hc.Sweep) -> None:
    assert legend(draw(sampled, RATIO, F_SW, "shock.profile").figure) == ["cosine", "triangular"]
    drawn = draw(sampled, RATIO, N, "overlap_ratio", {"shock.profile": "cosine"})
    axes, bar = drawn.figure.axes
    points: Any = axes.collections[0]
    table = sampled.to_frame()
    table = table[table["shock.profile"] == "cosine"]
    np.testing.assert_array_equal(points.get_offsets(), table[[RATIO, N]])
    brightness = points.get_facecolor()[:, 1]  # the green of viridis increases
    np.testing.assert_array_equal(np.argsort(table["overlap_ratio"]), np.argsort(brightness))
    assert bar.get_yscale() == "linear"
    assert axes.get_xscale() == "log"
    assert drawn.remarks == []


def test_several_values_in_one_place_of_a_map_are_refused(
    both: hc.Sweep, grid: hc.Sweep, sampled: hc.Sweep
) -> None:
    vary = {RATIO: "0.1,2", N: "4,2", "chain.radius": "1 mm,5 mm"}
    swept = hc.sweep(BASE, vary, backends=["native", LAMMPS])
    drawn = hc.sweep(BASE, vary | {RATIO: "0.1:2:log"}, samples=3)
    for sweep, y, hidden in (
        (sampled, N, "shock.profile varies"),
        (swept, N, "chain.radius and backend vary"),
        (drawn, "chain.radius", f"{N} varies"),
    ):
        with pytest.raises(hc.HertzchainError, match=f"{hidden}, too, and would share places"):
            draw(sweep, RATIO, y, F_SW)
    where = {"chain.radius": "1 mm", "backend": "native"}
    (mesh,) = draw(swept, RATIO, N, "speed_m_s", where).figure.axes[0].collections
    cells = np.asarray(mesh.get_array())
    table = swept.to_frame()
    rows = table[(table["backend"] == "native") & (table["chain.radius"] == 1e-3)]
    np.testing.assert_array_equal(np.sort(np.ravel(cells)), np.sort(rows["speed_m_s"]))
    with pytest.raises(hc.HertzchainError, match="varies, which makes a map: name the column"):
        draw(grid, RATIO, N)
    with pytest.raises(hc.HertzchainError, match="name the column of numbers"):
        draw(both, F_SW, RATIO, "backend")


@pytest.mark.parametrize(
    ("values", "log", "edges"),
    [
        ([1, 10, 100], True, [10**-0.5, 10**0.5, 10**1.5, 10**2.5]),
        ([1, 2, 4], False, [0.5, 1.5, 3, 5]),
        ([1, 5], False, [0, 3, 7]),  # nothing is below 0
        ([-1, 0, 1], False, [-1.5, -0.5, 0.5, 1.5]),
    ],
)
def test_edges_are_half_way(values: list[float], log: bool, edges: list[float]) -> None:
    np.testing.assert_allclose(cell_edges(np.array(values, float), log), edges, rtol=1e-14)


def test_the_command_writes_a_picture_beside_the_tables(hertzchain: Command, folder: Path) -> None:
    done = hertzchain("plot", folder, "--x", "momentum_ratio", "--y", F_SW)
    assert (done.status, done.out) == (0, "")
    assert done.err == (
        "hertzchain: shock.profile varies, too, and no colour tells the values apart\n"
        f"Plot written to {folder / 'plot.png'}\n"
    )
    assert (folder / "plot.png").read_bytes().startswith(b"\x89PNG")
    # The folder is as good as before: the same sweep goes on in it.
    resumed = hc.sweep(BASE, PROFILES, backends=("native", LAMMPS), output=folder)
    assert resumed.count().done == 24
