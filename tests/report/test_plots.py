"""Plots of comparisons: a point for every number."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain.arrays import FloatArray
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


def test_a_plot_without_formulas_is_drawn(
    native: hc.Comparison, tmp_path: Path, drawn: list[Figure]
) -> None:
    nothing = np.full_like(native.formulas.eq6, np.nan)
    formulas = replace(native.formulas, applicable="none", eq6=nothing, eq9=nothing)
    plot_comparison(replace(native, formulas=formulas), tmp_path / "plot.png")
    (above,) = map(lines_of, drawn[0].axes)  # there is nothing to compare
    assert next(iter(above.values()))[1].tolist() == native.native.peak_force.tolist()
    assert not {"Eq. 6", "Eq. 9"} & above.keys()
