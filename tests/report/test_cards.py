"""What objects show of themselves: every value is that of the object, on few lines."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.image import imread

import hertzchain as hc
from hertzchain.report.card import MOST_FACTS, Card, first_of
from hertzchain.verdict.check import NOT_RUN, Check, Kind, unmeasured
from tests.conftest import paper_scene
from tests.verdict.deck.corpus import scene_of
from tests.verdict.deck.made import changed, examined, found

MOST_LINES = 15  # of the issue

SCENE = paper_scene("cosine-triangular", 1.0, 2.0, granules=12)


@pytest.fixture(scope="module")
def result() -> hc.Result:
    """A run that has recorded 80 frames."""
    return hc.Native().run(SCENE, record=80)


@pytest.fixture(scope="module")
def comparison(result: hc.Result) -> hc.Comparison:
    """Native and what is taken for LAMMPS, one part in a thousand higher."""
    native = hc.compare(SCENE, ["native"])
    odd = Check(Kind("one thing is odd"), "native", 1.5, 1.0, 0.25, False, "it should be 1")
    higher = replace(result, backend="lammps", peak_force=native.native.peak_force * 1.001)
    checks = (odd, *(unmeasured(NOT_RUN, "lammps", f"reason {k}") for k in range(9)))
    return replace(native, results={**native.results, "lammps": higher}, checks=checks)


@pytest.fixture(scope="module")
def judgement(comparison: hc.Comparison) -> hc.Judgement:
    """Peaks that are a hundredth too high."""
    return hc.judge(SCENE, comparison.native.peak_force * 1.01)


@pytest.fixture(scope="module")
def batch() -> hc.Batch:
    return hc.similar_peak_forces("cosine", np.linspace(0.5, 2.0, 20), 2.0, 10)


@pytest.fixture(scope="module")
def sweep() -> hc.Sweep:
    vary: dict[str, Any] = {
        "shock.momentum_ratio": "0.1:10:20:log",
        "shock.duration_ratio": [2.0, 3.0],
    }
    return hc.sweep(SCENE, vary, backends="formulas")


@pytest.fixture(scope="module")
def examination() -> hc.DeckExamination:
    """A deck whose granules are too heavy and whose first is too large."""
    scene = scene_of("steel")
    right = found(scene)
    radius = right.radius.copy()
    radius[0] *= 1.2
    return examined(scene, changed(right, mass=1.1 * right.mass, radius=radius))


NAMES = ("result", "comparison", "judgement", "batch", "sweep", "examination")


def fact(shown: object, label: str) -> str:
    """The value behind a label in the text of an object."""
    (value,) = re.findall(rf"^  {re.escape(label)} {{2,}}(.*)$", repr(shown), re.MULTILINE)
    return str(value)


def cells(shown: Any) -> tuple[ElementTree.Element, list[list[str]]]:
    """The HTML of an object, parsed, and the cells of its last table."""
    tree = ElementTree.fromstring(shown._repr_html_())  # noqa: S314 - our own
    rows = tree.findall("table")[-1].iter("tr")
    return tree, [["".join(cell.itertext()) for cell in row] for row in rows]


# Text


@pytest.mark.parametrize("name", NAMES)
def test_objects_print_on_few_lines(name: str, request: pytest.FixtureRequest) -> None:
    shown = request.getfixturevalue(name)
    text = repr(shown)
    assert 4 <= len(text.split("\n")) <= MOST_LINES
    assert text.startswith(("Result", "Comparison", "Judgement", "Batch", "Sweep", "Examination"))
    assert not re.search(r"array\(|nan|None| object at ", text)


def test_a_scene_prints_what_it_is() -> None:
    what = "cosine-triangular pulse, n = 2, LM_ratio = 1, 100 N on 12 granules"
    assert repr(SCENE).startswith(f"Scene: {what}\n")
    assert float(fact(SCENE, "radius").removesuffix(" m")) == SCENE.chain.radius
    assert float(fact(SCENE, "density").removesuffix(" kg/m^3")) == SCENE.chain.density
    end = float(fact(SCENE, "end of the run").removesuffix(" s"))
    assert end == pytest.approx(SCENE.end_time, rel=1e-5)  # six digits
    assert len(repr(SCENE).split("\n")) <= MOST_LINES


def test_a_scene_of_thousands_of_unlike_granules_prints_their_range() -> None:
    radius = np.linspace(1e-3, 3e-3, 5000)
    scene = replace(SCENE, chain=hc.Chain(5000, radius, 193e9, 0.3, 7958.0), wall=hc.Wall("rigid"))
    assert fact(scene, "radius") == "0.001 to 0.003 m"
    assert fact(scene, "terms") == "unlike granules, wall"
    assert len(repr(scene)) < 1500


def test_a_chain_prints_as_it_is_made() -> None:
    assert eval(repr(SCENE.chain), {"Chain": hc.Chain}) == SCENE.chain  # noqa: S307 - our own


@pytest.mark.parametrize("rows", [6, 7, 5000])
def test_long_tables_print_their_first_six_values(rows: int) -> None:
    values = tuple(float(k) for k in range(rows))
    more = ", ..." if rows > 6 else ""
    shown = f"(0.0, 1.0, 2.0, 3.0, 4.0, 5.0{more})"
    table, piston = hc.PulseTable(values, values), hc.Piston(time=values, displacement=values)
    chain = hc.Chain(rows, [k + 1.0 for k in values], 1.0, 0.3, 1.0)
    assert repr(table) == f"PulseTable(time={shown}, force={shown}, file=None)"
    assert f"time={shown}, displacement={shown}" in repr(piston)
    assert f"radius=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0{more}), young_modulus=1.0" in repr(chain)


class Mine(hc.Scene):
    """A scene of somebody's own."""


def test_a_subclass_prints_as_its_base_does() -> None:
    assert repr(Mine(SCENE.chain, SCENE.shock)) == repr(hc.Scene(SCENE.chain, SCENE.shock))


def test_a_result_prints_its_numbers(result: hc.Result) -> None:
    largest, contact = re.fullmatch(  # type: ignore[union-attr]
        r"([\d.]+) N in contact (\d+)", fact(result, "largest peak")
    ).groups()
    assert float(largest) == pytest.approx(result.peak_force.max(), rel=1e-8)  # nine digits
    assert int(contact) == result.contact[np.argmax(result.peak_force)]
    assert fact(result, "transition, p") == f"{result.transition_granules} granules"
    assert fact(result, "error of the peaks, at most") == f"{result.error_estimate:.1e}"
    assert fact(result, "recorded").startswith("80 times, 0 to ")


def test_a_result_of_terms_with_many_remarks_prints_on_few_lines() -> None:
    scene = replace(
        SCENE,
        shock=hc.Pulse("cosine", 5e5, 2.0, momentum_ratio=1.0),
        wall=hc.Wall("rigid"),
        precompression=hc.Precompression(force=10.0),
        run=hc.Run(2e-5),
    )
    shown = hc.Native("velocity-verlet", dt=2e-7).run(scene, record=5)
    assert len(shown.warnings) >= 2
    text = repr(shown)
    assert len(text.split("\n")) <= MOST_LINES
    assert shown.warnings[0][:60] in text
    assert "largest force on the wall" in text


def test_a_comparison_prints_its_verdict_and_what_failed(comparison: hc.Comparison) -> None:
    assert fact(comparison, "verdict") == "FAIL. 10 of 10 checks failed."
    for label, name in {"native": "native", "LAMMPS": "lammps"}.items():
        error = comparison.results[name].error_estimate
        assert fact(comparison, label).startswith(f"error at most {error:.1e}, ")
    text = repr(comparison)
    assert "native: one thing is odd: off by 5.0e-01, allowed is 2.5e-01 (it should be 1)" in text
    assert "reason 1" in text
    assert "reason 2" not in text
    assert text.endswith("and 7 more")


def test_a_comparison_that_passes_prints_that(comparison: hc.Comparison) -> None:
    passed = replace(
        comparison, checks=(), results={"native": comparison.native}, wanted=("native", "lammps")
    )
    assert fact(passed, "verdict").startswith("PASS. All 0 checks of native passed")
    assert fact(passed, "LAMMPS") == "did not run"


def test_verdicts_are_true_if_they_pass(
    comparison: hc.Comparison, judgement: hc.Judgement, examination: hc.DeckExamination
) -> None:
    assert not comparison
    assert not judgement
    assert not examination
    assert replace(comparison, checks=())
    assert replace(judgement, given=judgement.reference.peak_force)
    assert replace(examination, checks=())


def test_a_judgement_prints_its_cause(judgement: hc.Judgement) -> None:
    assert fact(judgement, "verdict").startswith("FAIL. 11 of 11 judged contacts are off")
    assert judgement.cause is not None
    assert fact(judgement, "likely cause").startswith(judgement.cause[:60])
    assert fact(judgement, "largest difference") == "1.0e-02"


def test_an_examination_prints_what_is_to_mend(examination: hc.DeckExamination) -> None:
    assert fact(examination, "verdict").startswith("FAIL. ")
    assert examination.to_mend[0].sentence[:60] in repr(examination)


def test_a_batch_prints_its_range(batch: hc.Batch) -> None:
    low, high = re.findall(r"\d\.\d+", fact(batch, "largest peaks"))
    largest = batch.peak_force.max(axis=1)
    found_range = [float(low), float(high)]
    assert found_range == pytest.approx([largest.min(), largest.max()], rel=1e-6)
    assert fact(batch, "scenes") == "20, of 10 granules each"
    assert fact(batch, "errors, at most") == f"{batch.error_estimate.max():.1e}"


def test_a_batch_says_what_has_not_peaked(batch: hc.Batch) -> None:
    assert "not peaked yet" not in repr(replace(batch, peak_passed=batch.peak_passed | True))
    late = batch.peak_passed | True
    late[3, :2] = False
    assert fact(replace(batch, peak_passed=late), "not peaked yet").startswith("2 contacts")


def test_a_sweep_prints_what_varies(sweep: hc.Sweep, tmp_path: Path) -> None:
    text = repr(sweep)
    assert "shock.momentum_ratio: 0.1 to 10, 20 values, by logarithms" in text
    assert "shock.duration_ratio: 2, 3" in text
    assert fact(sweep, "rows").startswith("40 when done")
    assert fact(sweep, "measured by") == "formulas"
    assert fact(sweep, "kept in") == "memory"
    vary = {"chain.radius": "1 mm:3 mm"}
    many = hc.sweep(SCENE, vary, samples=4, backends="formulas", output=tmp_path / "kept")
    assert fact(many, "kept in") == str(tmp_path / "kept")
    assert fact(many, "drawn") == "4 samples, seed 0"
    assert fact(hc.Sweep.load(tmp_path / "kept"), "varies") == "chain.radius: 0.001 to 0.003, drawn"


def test_values_of_a_list_are_named_up_to_six() -> None:
    kept = [hc.sweep(SCENE, {"chain.granules": range(5, 5 + n)}, backends="formulas")
            for n in (6, 7)]  # fmt: skip
    assert fact(kept[0], "varies") == "chain.granules: 5, 6, 7, 8, 9, 10"
    assert fact(kept[1], "varies") == "chain.granules: 5, 6, 7, 8, 9, 10 and 1 more"


def test_sentences_beyond_the_most_are_counted() -> None:
    assert first_of("x", ["a", "b", "c"], 3) == [("x", "a"), ("x", "b"), ("x", "c")]
    assert first_of("x", ["a", "b", "c", "d"], 3) == [("x", "a"), ("x", "b"), ("", "and 2 more")]
    with pytest.raises(AssertionError):
        _ = Card("too long", [("x", "y")] * (MOST_FACTS + 1)).text


# As the commands print


def test_a_result_is_printed_as_run_does(result: hc.Result) -> None:
    assert "Peak force of each contact" not in str(result)  # that heads a verdict's
    assert "to 12, are in to_frame())" in str(result)
    assert "Verdict" not in str(result)


def test_an_examination_is_printed_with_the_lines_to_mend(
    examination: hc.DeckExamination,
) -> None:
    assert f"1. {examination.to_mend[0].sentence[:60]}" in str(examination)
    assert "in to_frame()" not in str(examination)  # which has its checks


# HTML


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_shows_the_facts(name: str, request: pytest.FixtureRequest) -> None:
    shown = request.getfixturevalue(name)
    tree, _ = cells(shown)
    title, *facts = repr(shown).split("\n")
    assert "".join(tree.findall("p")[0].itertext()) == title
    rows = list(tree.findall("table")[0].iter("tr"))
    assert len(rows) == len(facts)


def test_a_notebook_shows_the_first_peaks(result: hc.Result) -> None:
    tree, (header, *rows) = cells(result)
    assert header == ["contact", "peak force [N]", "peak time [s]", ""]
    peaks = np.array([[float(cell) for cell in row[:3]] for row in rows])
    assert peaks[:, 0].tolist() == result.contact[: len(rows)].tolist()
    np.testing.assert_allclose(peaks[:, 1], result.peak_force[: len(rows)], rtol=1e-6)
    np.testing.assert_allclose(peaks[:, 2], result.peak_time[: len(rows)], rtol=1e-5)
    left = result.contact.size - len(rows)
    assert "".join(tree.findall("p")[-1].itertext()) == f"({left} more contacts in to_frame())"


def test_a_notebook_shows_given_peaks(judgement: hc.Judgement) -> None:
    _, (_, *rows) = cells(judgement)
    given = [float(row[1]) for row in rows]
    np.testing.assert_allclose(given, judgement.given[: len(rows)], rtol=1e-8)
    assert {row[-1] for row in rows} == {"FAIL"}


def test_a_notebook_shows_twelve_scenes_of_a_batch(batch: hc.Batch) -> None:
    tree, (_, *rows) = cells(batch)
    assert len(rows) == 12
    assert "".join(tree.findall("p")[-1].itertext()) == "(8 more scenes in to_frame())"


def test_what_html_could_take_for_its_own_is_escaped() -> None:
    card = Card("a < b", [("<b>", "x & y")], ("&",), (("<i>",),), "1 > 0")
    tree = ElementTree.fromstring(card.html)  # noqa: S314 - our own
    assert "".join(tree.itertext()) == "a < b<b>x & y&<i>(1 > 0)"


# Figures


def test_a_run_is_drawn(result: hc.Result) -> None:
    figure = result.plot()
    peaks, forces, space_time, *_ = figure.axes
    title = str(figure.get_suptitle())
    assert title.endswith(f", srkn-11b, peaks within {result.error_estimate:.1e}")
    line = peaks.lines[0]
    np.testing.assert_array_equal(line.get_xdata(), result.contact)
    np.testing.assert_array_equal(line.get_ydata(), result.peak_force)
    assert result.history is not None
    drawn = {one.get_label(): one for one in forces.lines}
    del drawn["applied force"]
    assert 2 <= len(drawn) <= 6
    for label, curve in drawn.items():
        contact = int(str(label).removeprefix("contact "))
        time, force = np.asarray(curve.get_xydata()).T
        assert force.max() == result.peak_force[contact - 2]
        kept = force != force.max()  # the exact peak stands between two frames
        np.testing.assert_array_equal(force[kept], result.force_at(contact))
        np.testing.assert_array_equal(time[kept], result.history.time)
    assert space_time.get_xlabel() == "time [µs]"


def test_a_run_that_recorded_nothing_has_no_forces_over_time(result: hc.Result) -> None:
    (peaks,) = replace(result, history=None).plot().axes
    assert peaks.get_ylabel() == "peak force [N]"


def test_a_run_of_a_backend_of_ones_own_is_drawn(result: hc.Result) -> None:
    (peaks,) = replace(result, backend="mine", history=None).plot().axes
    assert "\nmine, " in str(peaks.figure.get_suptitle())


def test_a_static_load_is_drawn_under_the_peaks() -> None:
    scene = replace(SCENE, precompression=hc.Precompression(force=10.0))
    found_static = hc.Native().run(scene)
    (line,) = (
        one for one in found_static.plot().axes[0].lines if one.get_label() == "static force"
    )
    np.testing.assert_array_equal(line.get_ydata(), found_static.static_force)


@pytest.mark.parametrize("name", ["comparison", "judgement", "examination"])
def test_a_verdict_is_drawn(name: str, request: pytest.FixtureRequest) -> None:
    shown = request.getfixturevalue(name)
    above, below = shown.plot().axes
    native = shown.native if name == "comparison" else shown.reference
    np.testing.assert_array_equal(above.lines[0].get_ydata(), native.peak_force)
    assert below.get_ylabel() == "relative difference"


def test_a_notebook_shows_a_figure_without_pyplot(result: hc.Result, sweep: hc.Sweep) -> None:
    for figure in (
        replace(result, history=None).plot(),
        sweep.plot("momentum_ratio", "eq3_transition_granules"),
    ):
        pixels = imread(io.BytesIO(figure._repr_png_()))  # type: ignore[attr-defined]
        width, height = (figure.get_size_inches() * figure.dpi).astype(int)
        assert pixels.shape[:2] == (height, width)
        assert pixels.min() < 0.5 < pixels.max()  # something is drawn
