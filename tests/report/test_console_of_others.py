"""Trade-offs and predictions on the terminal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain import theory
from hertzchain.report.console import print_prediction
from hertzchain.report.facts import describe
from hertzchain.report.figures import plot_tradeoff
from hertzchain.report.tradeoff import print_tradeoff
from hertzchain.verdict.tradeoff import Row, Tradeoff
from tests.conftest import paper_scene
from tests.report.test_console import console, line_of, rows_of, text_on
from tests.report.test_figures import lines_of


def measured(
    contender: str, engine: str, step: float | None, error: float, milliseconds: float
) -> Row:
    rtol = None if step is not None else 1e-6
    return Row(contender, engine, step, step, rtol, error, 1234, milliseconds / 1e3)


@pytest.fixture
def traded(native: hc.Comparison) -> Tradeoff:
    """Two methods, and one that is asked for an accuracy."""
    rows = (
        measured("rk4, compiled", "compiled", 0.2, 5e-3, 1.0),
        measured("rk4, compiled", "compiled", 0.1, 3e-4, 2.0),
        measured("velocity-verlet, compiled", "compiled", 0.1, 6e-3, 25.0),
        measured("DOP853, SciPy", "SciPy", None, 8e-7, 150.0),
    )
    return Tradeoff(native.scene, rows, 1e-12, False, ())


def tradeoff_text(*tradeoffs: Tradeoff) -> str:
    screen = console()
    print_tradeoff(screen, tradeoffs)
    return text_on(screen)


def test_a_tradeoff_says_who_is_cheapest(traded: Tradeoff) -> None:
    text = tradeoff_text(traded)
    assert text.startswith(describe(traded.scene))
    lines = [" ".join(line.split()) for line in text.splitlines()]
    assert "1e-2 rk4, compiled step 0.2 s 5.0e-03 1,234 1" in lines
    assert "1e-3 rk4, compiled step 0.1 s 3.0e-04 1,234 2" in lines
    assert "1e-6 DOP853, SciPy rtol 1e-6 8.0e-07 1,234 150" in lines
    # An accuracy that no contender reaches has no line.
    assert not any(line.startswith("1e-7") for line in lines)
    assert "The truth is known to 1e-12" in text


def test_a_plot_of_a_tradeoff_shows_every_contender(
    traded: Tradeoff, tmp_path: Path, drawn: list[Figure]
) -> None:
    for tradeoffs in ([traded], [traded, traded]):
        path = tmp_path / f"{len(tradeoffs)}.svg"
        plot_tradeoff(tradeoffs).write(path)
        ElementTree.parse(path)  # noqa: S314 - written here
        comments = path.read_text(encoding="utf-8")  # text is drawn, and kept as comments
        for words in (
            *("rk4, compiled", "velocity-verlet, compiled", "DOP853, SciPy"),
            *("frontier", "wall time [ms]", "error of the peaks"),
            describe(traded.scene) if len(tradeoffs) == 1 else "2 scenes",
        ):
            assert words in comments
        shown = lines_of(drawn[-1].axes[0])
        for name in {row.contender for row in traded.rows}:
            own = [row for row in traded.rows if row.contender == name]
            found = ([row.wall_time for row in own], [row.error for row in own])
            np.testing.assert_array_equal(shown[name], found)


def prediction_text(predicted: theory.Prediction) -> str:
    screen = console()
    print_prediction(screen, predicted)
    return text_on(screen)


def test_a_prediction_shows_the_transition_and_both_equations(demo: hc.Scene) -> None:
    predicted = theory.predict(demo)
    text = prediction_text(predicted)
    rows = rows_of(text)
    assert [int(row[0]) for row in rows] == list(range(2, 11))
    assert predicted.eq6 is not None
    # 5 digits are printed.
    assert [float(row[1]) for row in rows] == pytest.approx(predicted.peak_force[:9], rel=5e-5)
    assert [float(row[2]) for row in rows[:-1]] == pytest.approx(predicted.eq6, rel=5e-5)
    assert [float(row[3]) for row in rows[:-1]] == pytest.approx(predicted.eq9[:-1], rel=5e-5)
    # Contact 10, after the transition, is none of Eq. 6.
    assert rows[-1] == ["10", "149.59", "149.59", "+0.0%"]
    assert rows[0][4:] == ["-0.7%", "-0.7%"]
    assert "(50 more contacts, up to 60, are shown by --json)" in text
    assert line_of(text, "transition, p") == "9 granules"
    assert line_of(text, "p of Eq. 3") == "8.25"
    assert line_of(text, "solitary wave, F_SW") == "149.59 N"
    assert line_of(text, "error, at most") == "peaks 1%, far field 1e-05"
    assert line_of(text, "speed, V_SW").endswith("m/s: exact is closer")
    assert line_of(text, "V_SW, 7/10").split() == ["0.700000", "0.688673", "+1.64%"]


def test_a_prediction_without_p_shows_peaks_and_why() -> None:
    text = prediction_text(theory.predict(paper_scene("cosine", 4.0, 5.0, granules=13)))
    assert [len(row) for row in rows_of(text)] == [2] * 10
    assert line_of(text, "transition, p") == "none ends here"
    assert "F_SW" not in text.replace("no p, no F_SW.", "")
    assert "The transition does not end within this chain" in text
    assert "The paper's tables have LM_ratio 0.3 to 2.5 and n 2 to 10." in text


def test_a_prediction_of_nothing_shows_why(demo: hc.Scene) -> None:
    table = replace(demo, shock=hc.PulseTable((0.0, 1e-5, 3e-5), (0.0, 50.0, 0.0)))
    lines = prediction_text(theory.predict(table)).splitlines()
    assert lines[1:] == [
        "",
        "The shock is a pulse table: Eqs. 3 to 9 and the map are about Table 1's profiles.",
    ]
