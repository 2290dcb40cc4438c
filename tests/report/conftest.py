"""A comparison that pages show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.report.contents import of_comparison
from hertzchain.report.figures import figure_of, plot_times
from hertzchain.verdict.check import Check, Kind
from tests.conftest import paper_scene

WELL = Check(Kind("all is well"), "native", 1.0, 1.0, 1e-9, True, "why not")


@pytest.fixture(scope="module")
def compared() -> hc.Comparison:
    """A chain of 12, p = 5, and as if LAMMPS had found peaks one part in a million higher."""
    scene = paper_scene("cosine-triangular", 1.0, 2.0, granules=12)
    comparison = hc.compare(scene, ["native"], record=plot_times(scene))
    return with_lammps(comparison, 1e-6)


def with_lammps(comparison: hc.Comparison, part: float) -> hc.Comparison:
    """As if LAMMPS had found peaks higher by a part of them."""
    native = comparison.native
    higher = replace(
        native,
        backend="lammps",
        method="velocity-verlet, granular",
        peak_force=native.peak_force * (1 + part),
        error_estimate=2 * part,
        steps=54321,
    )
    results = {**comparison.results, "lammps": higher}
    return replace(comparison, results=results, wanted=("native", "lammps"))


@pytest.fixture(scope="module")
def native() -> hc.Comparison:
    """A chain of 12, p = 5, by the reference and the formulas."""
    return hc.compare(paper_scene("cosine-triangular", 1.0, 2.0, granules=12), ["native"])


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are written, as they are when they are."""
    figures: list[Figure] = []
    write = Figure.savefig

    def kept(figure: Figure, *arguments: Any, **options: Any) -> None:
        figures.append(figure)
        write(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", kept)
    return figures


@pytest.fixture(scope="module")
def both(native: hc.Comparison) -> hc.Comparison:
    """The same, as if LAMMPS had found peaks one part in a thousand higher."""
    return replace(with_lammps(native, 1e-3), checks=(WELL,))


def plot_comparison(comparison: hc.Comparison, path: Path) -> None:
    figure_of(of_comparison(comparison)).write(path)


def lines_of(axes: Axes) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return x and y of each labelled line; a gap is NaN."""
    return {
        str(line.get_label()): (
            np.asarray(line.get_xdata(), np.float64),
            np.asarray(line.get_ydata(), np.float64),
        )
        for line in axes.get_lines()
    }
