"""Plots of comparisons: a point for every number."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.report.formats import check_format
from hertzchain.report.picture import in_units
from hertzchain.report.style import COLOURS
from hertzchain.report.waterfall import while_moving
from tests.report.test_console import plot_comparison


def lines_of(axes: Axes) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return x and y of each labelled line; a gap is NaN."""
    return {
        str(line.get_label()): (
            np.asarray(line.get_xdata(), np.float64),
            np.asarray(line.get_ydata(), np.float64),
        )
        for line in axes.get_lines()
    }


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
    assert set(below["LAMMPS, error estimate"][1]) == {lammps.error_estimate}
    assert set(below["reference, error estimate"][1]) == {native.error_estimate}


@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("PDF", b"%PDF")])
def test_the_suffix_says_how_to_draw(
    native: hc.Comparison, tmp_path: Path, suffix: str, start: bytes
) -> None:
    path = tmp_path / f"plot.{suffix}"
    check_format(path, "plot")
    plot_comparison(native, path)
    assert path.read_bytes().startswith(start)


def picture(path: Path) -> Any:
    """Red, green and blue of a picture that can be read to its end, shape (rows, columns, 3)."""
    pixels = np.asarray(imread(path))
    assert pixels.ndim == 3
    return pixels[..., :3]


def colours(pixels: Any) -> set[tuple[int, ...]]:
    whole = np.rint(255 * pixels).astype(int).reshape(-1, 3)
    # One number a pixel is sorted ten times as fast as three.
    found = np.unique(whole @ [1 << 16, 1 << 8, 1]).tolist()
    return {(colour >> 16, colour >> 8 & 255, colour & 255) for colour in found}


def colour_of(name: str) -> tuple[int, ...]:
    return tuple(round(255 * part) for part in to_rgb(COLOURS[name]))


def test_a_plot_without_formulas_is_drawn(
    native: hc.Comparison, tmp_path: Path, drawn: list[Figure]
) -> None:
    nothing = np.full_like(native.formulas.eq6, np.nan)
    formulas = replace(native.formulas, applicable="none", eq6=nothing, eq9=nothing)
    plot_comparison(replace(native, formulas=formulas), tmp_path / "plot.png")
    (above,) = map(lines_of, drawn[0].axes)  # there is nothing to compare
    assert next(iter(above.values()))[1].tolist() == native.native.peak_force.tolist()
    assert not {"Eq. 6", "Eq. 9"} & above.keys()
    assert colour_of("native") in colours(picture(tmp_path / "plot.png"))


@pytest.mark.parametrize(
    ("ends", "label", "shown"),
    [
        ((1e-6, 5e-5), "time [µs]", ["1", "10", "", ""]),
        ((1e-12, 1e-3), "time [ns]", ["$10^{3}$", "$10^{4}$"]),
        ((2e-6, 9e-6), "time [µs]", ["1", "10", "2", "3"]),
    ],
)
def test_a_logarithmic_axis_has_its_unit(
    ends: tuple[float, float], label: str, shown: list[str]
) -> None:
    axis = Figure().subplots().xaxis
    axis.axes.set(xscale="log", xlim=ends)
    in_units(axis, "time [s]")
    assert axis.get_label_text() == label
    major, minor = axis.get_major_formatter(), axis.get_minor_formatter()
    texts = [*map(major, (1e-6, 1e-5)), *map(minor, (2e-6, 3e-6))]
    assert texts[: len(shown)] == shown


def test_forces_that_never_change_are_drawn_over_all_times() -> None:
    time = np.linspace(1.0, 3.0, 21)
    assert while_moving(time, np.zeros(21)) == (1.0, 3.0)
    off = np.where(np.abs(time - 2.0) < 0.25, 1.0, 0.0099)
    # One sample further, and 3 % of that.
    assert while_moving(time, off) == pytest.approx((1.7 - 0.03 * 0.6, 2.3 + 0.03 * 0.6))
