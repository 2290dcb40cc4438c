"""Pictures of sweeps: they show the values of the tables, and report what they omit."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.sweeps import drawing
from hertzchain.sweeps.columns import COLUMNS, full_name
from hertzchain.sweeps.drawing import draw
from tests.conftest import paper_scene
from tests.sweeps.drawn import BASE, F_SW, RATIO, N, P, drawn_lines, legend

pytestmark = pytest.mark.lammps  # sweeps by native and LAMMPS

# Lines


def test_a_line_for_each_profile_is_what_the_table_has(both: hc.Sweep) -> None:
    drawn = draw(both, RATIO, F_SW, "shock.profile", {"backend": "native"})
    table = both.to_frame()
    table = table[table["backend"] == "native"]
    lines = drawn_lines(drawn.figure)
    profiles = ["cosine", "triangular", "cosine-triangular"]
    assert legend(drawn.figure) == profiles
    assert len(lines) == 3
    for profile, (x, y) in zip(profiles, lines, strict=True):
        own = table[table["shock.profile"] == profile]
        np.testing.assert_array_equal(x, own[RATIO])
        np.testing.assert_array_equal(y, own[F_SW])
    (axes,) = drawn.figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("LM_ratio", "F_SW [N]")
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    assert axes.get_title() == "backend native"
    assert drawn.remarks == ()


def test_backends_are_told_apart_where_nothing_is_asked_for(both: hc.Sweep) -> None:
    drawn = draw(both, RATIO, F_SW)
    assert legend(drawn.figure) == ["lammps", "native"]
    assert len(drawn_lines(drawn.figure)) == 6
    assert drawn.remarks == (
        "shock.profile varies, too: all values are lines of one colour; --colour tells them apart",
    )
    assert len({str(line.get_color()) for line in drawn.figure.axes[0].lines}) == 2
    assert drawn.remarks[0] in drawn.figure.get_supxlabel().replace("\n", " ")


def test_one_line_where_nothing_else_varies(both: hc.Sweep) -> None:
    where = {"backend": "native", "profile": "triangular"}
    drawn = draw(both, RATIO, F_SW, where=where)
    assert len(drawn_lines(drawn.figure)) == 1
    assert drawn.figure.legends == []
    assert drawn.figure.axes[0].get_title() == "backend native, profile triangular"
    assert drawn.remarks == ()


def test_many_values_have_a_colour_bar() -> None:
    swept = hc.sweep(BASE, {RATIO: "0.1:2:3:log", N: "2:300:12:log"})
    figure = swept.plot(RATIO, "overlap_ratio", N)
    axes, bar = figure.axes
    assert len(axes.lines) == 12
    assert bar.get_ylabel() == "n"
    assert bar.get_yscale() == "log"
    assert figure.legends == []
    assert len({tuple(line.get_color()) for line in axes.lines}) == 12


@pytest.mark.parametrize(("y", "style"), [(P, "steps-mid"), (F_SW, "default")])
def test_p_is_drawn_as_steps(both: hc.Sweep, y: str, style: str) -> None:
    figure = draw(both, RATIO, y, where={"shock.profile": "cosine", "backend": "native"}).figure
    assert [line.get_drawstyle() for line in figure.axes[0].lines] == [style]


def test_too_many_lines_are_refused() -> None:
    vary = {RATIO: "0.1:1:2", N: "2:3:1001"}
    swept = hc.sweep(paper_scene("cosine", 1.0, 4.0, granules=3), vary)
    with pytest.raises(
        hc.HertzchainError, match=r"lines = 1001: .* fix shock.duration_ratio to one"
    ):
        draw(swept, RATIO, "largest_peak_force_N")


# Points


def test_a_sample_is_points(sampled: hc.Sweep) -> None:
    drawn = draw(sampled, RATIO, F_SW, "shock.profile")
    table = sampled.to_frame()
    assert legend(drawn.figure) == ["cosine", "triangular"]
    for profile, line in zip(("cosine", "triangular"), drawn.figure.axes[0].lines, strict=True):
        own = table[table["shock.profile"] == profile]
        np.testing.assert_array_equal(line.get_xdata(), own[RATIO])
        np.testing.assert_array_equal(line.get_ydata(), own[F_SW])
        assert line.get_linestyle() == "None"
    (remark,) = drawn.remarks
    assert remark == (
        "shock.duration_ratio varies, too: points of all values are drawn on top of one another"
    )


def test_a_result_over_a_result_is_points(grid: hc.Sweep) -> None:
    figure = grid.plot(F_SW, "speed_m_s", P)
    table = grid.to_frame()
    shown = np.concatenate([line.get_ydata() for line in figure.axes[0].lines])
    np.testing.assert_array_equal(np.sort(shown), np.sort(table["speed_m_s"].dropna()))
    assert all(line.get_linestyle() == "None" for line in figure.axes[0].lines)


# Along the chain


def test_peaks_of_all_contacts_are_lines_along_the_chain(monkeypatch: pytest.MonkeyPatch) -> None:
    swept = hc.sweep(BASE, {"chain.young_modulus": "1e11,1.46e11", N: "2,4"}, peaks=True)
    drawn = draw(swept, "contact", "peak_force_N", N, {"young_modulus": "146 GPa"})
    axes = drawn.figure.axes[0]
    table = swept.peaks_to_frame()
    for line, scene in zip(axes.lines, (2, 3), strict=True):
        own = table[table["scene"] == scene]
        np.testing.assert_array_equal(line.get_ydata(), own["peak_force_N"])
        np.testing.assert_array_equal(line.get_xdata(), own["contact"])
    assert legend(drawn.figure) == ["2", "4"]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("contact", "peak force [N]")
    assert "Young's modulus E = 146 GPa" in axes.get_title().replace("\n", " ")
    drawn = draw(swept, "contact", "peak_force_N")
    assert legend(drawn.figure) == ["100", "146"]
    assert drawn.figure.legends[0].get_title().get_text() == "Young's modulus E [GPa]"
    assert drawn.remarks == (f"{N} varies, too: lines of all values are drawn",)
    with pytest.raises(hc.HertzchainError, match="must be one of peak_force_N, peak_time_s"):
        draw(swept, "contact", F_SW)
    monkeypatch.setattr(drawing, "_MOST_LINES", 4)
    assert len(draw(swept, "contact", "peak_force_N").figure.axes[0].lines) == 4
    monkeypatch.setattr(drawing, "_MOST_LINES", 3)
    with pytest.raises(hc.HertzchainError, match="must leave 1,000 lines at most"):
        draw(swept, "contact", "peak_force_N")


def test_peaks_that_were_not_kept_are_not_drawn(grid: hc.Sweep) -> None:
    with pytest.raises(hc.HertzchainError, match="sweep again with --peaks"):
        draw(grid, "contact", "peak_force_N")


# Missing values


def test_rows_without_a_number_are_left_out_and_counted(failing: hc.Sweep) -> None:
    drawn = draw(failing, "shock.peak_force", F_SW)
    ((x, y),) = drawn_lines(drawn.figure)
    known = failing.to_frame().dropna(subset=F_SW)
    np.testing.assert_array_equal(x[np.isfinite(x)], known["shock.peak_force"])
    np.testing.assert_array_equal(y[np.isfinite(y)], known[F_SW])
    without = "solitary_wave_force_N and are left out; 2 of them failed"
    assert drawn.remarks == (f"2 of 5 rows have no {without}",)


def test_a_sweep_that_is_not_complete_is_drawn_with_its_gaps(folder: Path, tmp_path: Path) -> None:
    there = tmp_path / "begun"
    shutil.copytree(folder, there)
    lost = sorted((there / "scenes").glob("lammps-*"))[1]
    gone = pd.read_parquet(lost)
    lost.unlink()
    begun = hc.Sweep.load(there)
    where = {"backend": "lammps", "shock.profile": gone["shock.profile"].iloc[0]}
    drawn = draw(begun, RATIO, F_SW, where=where)
    ((x, _),) = drawn_lines(drawn.figure)
    assert np.isnan(x).sum() == (gone["shock.profile"] == where["shock.profile"]).sum() > 0
    assert np.isfinite(x).any()
    rows = len(begun.to_frame())
    assert drawn.remarks == (f"the sweep is not complete, {rows} of 42 rows are there",)


def test_nothing_to_draw_is_refused() -> None:
    swept = hc.sweep(paper_scene("cosine", 1.0, 4.0, granules=4), {RATIO: "1,2"})
    with pytest.raises(hc.HertzchainError, match="nothing to draw: no row has transition_gran"):
        draw(swept, RATIO, P)


# Names


def test_the_section_may_be_left_out() -> None:
    assert full_name("momentum_ratio") == full_name(RATIO) == RATIO
    assert full_name("speed_m_s") == "speed_m_s"
    assert full_name("LM_ratio") == RATIO
    assert full_name("p") == "transition_granules"
    assert full_name("F_SW") == "solitary_wave_force_N"
    assert [full_name(name) for name in ("F0", "n", "N")] == [
        *("shock.peak_force", "shock.duration_ratio", "chain.granules")
    ]
    both = ["chain.young_modulus", "wall.young_modulus"]
    assert full_name("young_modulus", both, ["wall.young_modulus"]) == both[1]
    for varied in ([], both):
        with pytest.raises(hc.HertzchainError, match="is in several sections: name one of"):
            full_name("young_modulus", both, varied)
    with pytest.raises(hc.HertzchainError, match=r"did you mean shock.momentum_ratio\?$"):
        full_name("shock.momentum_ration")
    assert len({name.partition(".")[2] or name for name in COLUMNS}) == len(COLUMNS)


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ({RATIO: 0.2}, "is not in the sweep; the nearest there: 0.16475 and 0.27144"),
        ({RATIO: "inf"}, "is not in the sweep"),
        ({RATIO: "nan"}, "is not in the sweep"),
        ({"shock.profile": "sine"}, "is not in the sweep: cosine, triangular"),
        ({"backend": "yade"}, "is not in the sweep: lammps, native"),
        ({"chain.radius": "1 mm"}, "does not vary in this sweep; what does: shock.profile"),
        ({"radius": "1 N"}, "does not vary"),
        ({"speed_m_s": 1}, "does not vary"),
        ({RATIO: 0.1, "momentum_ratio": 0.1}, "is fixed twice"),
    ],
)
def test_a_value_that_is_not_there_is_refused(
    both: hc.Sweep, where: dict[str, Any], words: str
) -> None:
    with pytest.raises(hc.HertzchainError, match=words):
        draw(both, N, F_SW, where=where)


def test_a_value_need_not_have_all_its_digits(both: hc.Sweep) -> None:
    value = sorted(set(both.to_frame()[RATIO]))[3]
    drawn = draw(both, "overlap_ratio", F_SW, "shock.profile", {RATIO: f"{value:.4g}"})
    assert f"LM_ratio = {value:.4g}" in drawn.figure.axes[0].get_title()
    assert sum(x.size for x, _ in drawn_lines(drawn.figure)) == 6
