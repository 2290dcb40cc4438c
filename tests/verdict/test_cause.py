"""The rules by which a cause is named, on mistakes with given residuals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

import hertzchain as hc
from hertzchain.arrays import Array, FloatArray
from hertzchain.limits import Deadline
from hertzchain.report.console import print_document
from hertzchain.report.judgement import of_judgement
from hertzchain.verdict import judgement, slips
from hertzchain.verdict.case import Case, Found, Mistake, jumps_like_noise
from hertzchain.verdict.slips import Family
from tests.conftest import paper_scene

NOTHING = "no single known mistake explains these peaks"
FAR = f"{NOTHING}, and none leaves less than 7 % of the differences"


def case_of(truth: hc.Result, given: FloatArray, tolerance: float = 1e-3) -> Case:
    judged = judgement.judged_peaks(truth.peak_force, given)
    return Case(truth.scene, truth, given, judged, None, tolerance, Deadline(60.0), False)


def signs(count: int = 59) -> Array:
    """Differences that are no noise: four of a sign, in turn."""
    return np.where(np.arange(count) % 8 < 4, 1.0, -1.0)


def shared(truth: hc.Result, size: float, tolerance: float = 1e-3) -> Case:
    """Peaks that are too high or too low, all by the same."""
    return case_of(truth, truth.peak_force * np.exp(size * signs()), tolerance)


def explained(
    monkeypatch: pytest.MonkeyPatch, case: Case, noisy: bool = False, **left: float
) -> tuple[slips.Explanation, list[str]]:
    """Return the explanation by mistakes that leave given parts, and the list of those tried.

    Those whose name begins with ``costly`` are costly.
    """
    tried: list[str] = []
    known: dict[object, Found] = {}
    noise = np.random.default_rng(0).standard_normal(case.judged.sum()) if noisy else None

    def family(name: str, part: float) -> Family:
        def mistakes(case: Case) -> Iterator[Mistake]:
            tried.append(name)
            found = Found(0.0, part * case.size, noise)
            mistake = Mistake(lambda _: name, lambda _: case.given)
            monkeypatch.setattr(Case, "fit", lambda _, made, __: known[made])
            known[mistake.made] = found
            yield mistake

        return Family(name, mistakes, is_costly=name.startswith("costly"))

    made = tuple(family(name, left[name]) for name in left)
    monkeypatch.setattr("hertzchain.verdict.slips.FAMILIES", made)
    return slips.likely_cause(case), tried


@pytest.mark.parametrize(
    ("tolerance", "noisy", "left", "words"),
    [
        # A tenth of the differences, where that is allowed.
        (1e-3, False, {"this": 0.098}, "this; leaves 0.1 of the differences"),
        (1e-3, False, {"this": 0.102}, None),
        # What leaves more than is allowed is a part of the mistake, unless it is noise.
        (5.1e-4, False, {"this": 0.05}, "this; leaves 0.05"),
        (4.9e-4, False, {"this": 0.05}, None),
        (1e-6, True, {"this": 0.05}, "this; leaves 0.05"),
        (1e-6, True, {"this": 0.102}, None),
        # Fits are known to 1e-4 of the differences.
        (1e-9, False, {"this": 0.98e-4}, "this; leaves 0.0001"),
        (1e-9, False, {"this": 1.02e-4}, None),
        # Mistakes are named together up to three times what the best leaves.
        (1e-3, False, {"this": 0.01, "that": 0.0294}, "this; or that; leaves 0.01"),
        (1e-3, False, {"this": 0.01, "that": 0.0306}, "this; leaves 0.01"),
        # A residual of 0 counts as 1e-4.
        (1e-3, False, {"this": 0.0, "that": 2.94e-4}, "this; or that; leaves 1e-06"),
        (1e-3, False, {"this": 0.0, "that": 3.06e-4}, "this; leaves 1e-06"),
    ],
)
def test_a_cause_is_named(
    demo_reference: hc.Result,
    monkeypatch: pytest.MonkeyPatch,
    tolerance: float,
    noisy: bool,
    left: dict[str, float],
    words: str | None,
) -> None:
    case = shared(demo_reference, 0.01, tolerance)
    found, _ = explained(monkeypatch, case, noisy, **left)
    assert (found.hint is None) is (words is not None)
    assert found.cause is None if words is None else (found.cause or "").startswith(words)


@pytest.mark.parametrize(("left", "tried"), [(0.98e-4, ["this"]), (1.02e-4, ["this", "costly"])])
def test_costly_mistakes_are_tried_unless_one_leaves_a_ten_thousandth(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch, left: float, tried: list[str]
) -> None:
    case = shared(demo_reference, 0.01)
    assert explained(monkeypatch, case, this=left, costly=0.5)[1] == tried


def test_a_cause_is_sought_where_enough_contacts_are_off_enough(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = shared(demo_reference, 0.01)
    for contacts, sought in ((5, False), (6, True)):
        few = replace(case, judged=np.arange(59) < contacts)
        found, tried = explained(monkeypatch, few, this=0.5)
        assert bool(tried) is sought
        assert (found.remark is None) is sought
    rough = replace(demo_reference, error_estimate=1e-5)
    for truth, size, sought in (
        (demo_reference, 0.98e-7, False),
        (demo_reference, 1.02e-7, True),
        (rough, 0.98e-4, False),
        (rough, 1.02e-4, True),
    ):
        _, tried = explained(monkeypatch, shared(truth, size), this=0.5)
        assert bool(tried) is sought


@pytest.mark.parametrize(
    ("times", "contact", "named"),
    [
        (98.0, 5, False),
        (102.0, 5, True),
        # Mistakes move the last two contacts by themselves.
        (1000.0, 58, True),
        (1000.0, 59, False),
    ],
)
def test_a_contact_alone_is_a_hundred_times_as_far_off_as_the_others(
    demo_reference: hc.Result,
    monkeypatch: pytest.MonkeyPatch,
    times: float,
    contact: int,
    named: bool,
) -> None:
    peaks = demo_reference.peak_force * (1 + 1e-5)
    peaks[contact - 2] *= 1 + times * 1e-5 - 1e-5
    found, tried = explained(monkeypatch, case_of(demo_reference, peaks), this=0.5)
    alone = (found.cause or "").startswith(f"contact {contact} alone")
    assert alone is named
    assert bool(tried) is not named
    exact = demo_reference.peak_force.copy()
    exact[3] = 0.0
    others = explained(monkeypatch, case_of(demo_reference, exact), this=0.5)[0].cause or ""
    assert others.endswith("contact 5 alone, as if a number had slipped: the others are right")


@pytest.mark.parametrize(
    ("left", "hint"),
    [
        (0.069, f"{NOTHING}. The nearest is: this; it leaves 6.9 % of the differences"),
        (0.071, FAR),
        (0.5, FAR),
    ],
)
def test_the_hint_says_what_is_nearest_and_what_it_leaves(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch, left: float, hint: str
) -> None:
    found, _ = explained(monkeypatch, shared(demo_reference, 0.01, 1e-6), this=left)
    assert found.hint == hint


@pytest.mark.parametrize(
    ("count", "rms", "largest", "shift", "named"),
    [
        (59, 0.01, 2.5, 0.0, True),
        (11, 0.01, 2.0, 0.0, False),  # too few
        (12, 0.01, 2.0, 0.0, True),
        (59, 0.11, 2.5, 0.0, False),  # too much
        (59, 0.09, 2.5, 0.0, True),
        (59, 0.01, 4.2, 0.0, False),  # one that stands out
        (59, 0.01, 3.8, 0.0, True),
        (59, 0.01, 2.5, 1.0, False),  # not about 0
    ],
)
def test_differences_look_like_noise(
    demo_reference: hc.Result,
    monkeypatch: pytest.MonkeyPatch,
    count: int,
    rms: float,
    largest: float,
    shift: float,
    named: bool,
) -> None:
    off = np.random.default_rng(3).uniform(-1, 1, 59) + shift
    off[8] = 0.0
    rest = np.sqrt(np.sum(off[:count] ** 2))
    # The size of one that makes it ``largest`` times the root mean square of all.
    off[8] = largest * rest / math.sqrt(count - largest**2)
    off *= rms / np.sqrt(np.mean(off[:count] ** 2))
    case = case_of(demo_reference, demo_reference.peak_force * (1 + off))
    case = replace(case, judged=np.arange(59) < count)
    found, _ = explained(monkeypatch, case, this=0.5)
    assert ("look like noise" in (found.hint or "")) is named


@pytest.mark.parametrize(
    ("rounded", "words"),
    [
        (lambda force: float(f"{force:.2g}"), "to 2 digits"),
        (lambda force: float(f"{force:.4g}"), "to 4 digits"),
        (lambda force: round(force, 1), "to 1 decimals"),
        (lambda force: round(force, -1), "to 10 N"),
        (lambda force: float(f"{force:.1g}"), None),
        (lambda force: max(round(force, -2), 100), None),
        (lambda force: float(f"{1.02 * force:.3g}"), None),
        (math.floor, None),
    ],
)
def test_rounding_is_named(
    monkeypatch: pytest.MonkeyPatch, rounded: object, words: str | None
) -> None:
    assert callable(rounded)
    truth = hc.Native("reference").run(paper_scene("cosine", 1.0, 2.0, 16))
    peaks = truth.peak_force.copy()
    peaks *= np.linspace(0.6, 1.4, 15)  # peaks in more than one decade
    truth = replace(truth, peak_force=peaks)
    given = np.array([rounded(float(force)) for force in peaks], np.float64)
    found, _ = explained(monkeypatch, case_of(truth, given), this=0.5)
    start = "rounding: these are the scene's own peaks"
    assert found.cause is None if words is None else (found.cause or "").startswith(start)
    assert words is None or words in (found.cause or "")


def test_the_hint_of_a_scene_with_terms_says_what_was_tried() -> None:
    scene = replace(paper_scene("cosine", 1.0, 2.0, 16), wall=hc.Wall("rigid"))
    peaks = hc.Native("reference").run(scene).peak_force
    found = hc.judge(scene, peaks * (1 + 0.01 * np.random.default_rng(0).standard_normal(16)))
    assert found.cause is None
    assert (found.hint or "").startswith("no mistake that was tried explains these peaks")
    assert found.to_dict()["hint"] == found.hint
    document = of_judgement(found)
    assert [(one.name, one.advice) for one in document.verdict.failures] == [("Hint", found.hint)]
    text = StringIO()
    print_document(Console(file=text, width=1000), document)
    assert "\nNo mistake that was tried explains these peaks" in text.getvalue()
    assert "Likely cause" not in text.getvalue()


def test_a_minute_is_not_spent_on_the_cause(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judgement, "PATIENCE", 1e-3)
    found = hc.judge(demo_reference.scene, 1.1 * demo_reference.peak_force[::-1])
    assert found.cause is None
    (remark,) = found.remarks
    assert "not everything was tried" in remark


# A case


def test_noise_jumps() -> None:
    assert jumps_like_noise(np.random.default_rng(0).standard_normal(59))
    assert not jumps_like_noise(np.cos(np.linspace(0, 6, 59)))
    assert not Found(0.0, 0.0).leaves_noise  # as far as is known
    last_alone = np.append(1e-3 * np.random.default_rng(0).standard_normal(58), 1.0)
    assert not jumps_like_noise(last_alone)
    # The square of jumps over that of values, of values 1 and x in turn: 2 (1 - x)^2 / (1 + x^2).
    for x, is_noise in ((0.2, True), (0.22, False)):
        assert jumps_like_noise(np.where(np.arange(1000) % 2, 1.0, x)) is is_noise


@pytest.mark.parametrize(("part", "as_if"), [(0.0, 1e-9), (0.5e-9, 1e-9), (2e-9, 2e-9)])
def test_peaks_below_a_billionth_are_as_good_as_none(
    demo_reference: hc.Result, part: float, as_if: float
) -> None:
    expected = demo_reference.peak_force
    left = case_of(demo_reference, part * expected).residual(expected)
    assert left == pytest.approx(-math.log(as_if), rel=1e-12, abs=0)


def test_a_parameter_half_way_between_two_trials_is_fitted(demo_reference: hc.Result) -> None:
    """Both trials leave the same, to the last digit."""
    truth = demo_reference.peak_force
    case = case_of(demo_reference, truth)
    found = case.fit(lambda x: truth * np.exp(x * x), [-1.5, -0.5, 0.5, 1.5])
    # x is known to a billionth of the distance of two trials, or where x^2 is below round-off.
    assert found.value == pytest.approx(0.0, abs=1e-7)
    assert found.left < 1e-14


def test_the_best_factor_is_found_in_a_valley_that_is_not_the_deepest_trial() -> None:
    chain = hc.Chain(20, 4.75e-3, 193e9, 0.3, 7958.0)
    scene = hc.Scene(chain, hc.Pulse("cosine", 200.0, 2.0, rise_time=20e-6))
    wrong = replace(scene, chain=replace(chain, young_modulus=math.sqrt(2) * 193e9))
    judged = hc.judge(scene, hc.Native("reference").run(wrong).peak_force)
    assert (judged.cause or "").startswith("contact stiffness 1.41421 times that of the scene")
