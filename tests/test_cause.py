"""The rules by which a cause is named, on mistakes with given residuals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

import hertzchain as hc
from hertzchain import slips
from hertzchain.arrays import FloatArray
from hertzchain.limits import Deadline
from hertzchain.report.console import print_document
from hertzchain.report.contents import of_judgement
from hertzchain.slips import Case, Family, Fit, Mistake
from hertzchain.verdict import judgement
from tests.conftest import paper_scene

NOTHING = "no single known mistake explains these peaks"
FAR = f"{NOTHING}, and none leaves less than 7 % of the differences"


def case_of(truth: hc.Result, given: FloatArray, tolerance: float = 1e-3) -> Case:
    judged = judgement.judged_peaks(truth.peak_force, given)
    return Case(truth.scene, truth, given, judged, None, tolerance, Deadline(60.0), False)


def shared(truth: hc.Result, size: float, tolerance: float = 1e-3) -> Case:
    """Peaks that are too high or too low, all by the same: four of a sign, in turn, no noise."""
    signs = np.where(np.arange(59) % 8 < 4, 1.0, -1.0)
    return case_of(truth, truth.peak_force * np.exp(size * signs), tolerance)


Explain = Callable[..., tuple[slips.Explanation, list[str]]]


@pytest.fixture
def explain(monkeypatch: pytest.MonkeyPatch) -> Explain:
    """Explains a case by mistakes that leave given parts; also returns the list of those tried.

    Those whose name begins with ``costly`` are costly.
    """

    def explained(case: Case, noisy: bool = False, **left: float) -> object:
        tried: list[str] = []
        fits: dict[object, Fit] = {}
        noise = np.random.default_rng(0).standard_normal(case.judged.sum()) if noisy else None

        def family(name: str) -> Family:
            def mistakes(case: Case) -> Iterator[Mistake]:
                tried.append(name)
                mistake = Mistake(lambda _: name, lambda _: case.given)
                fits[mistake.peaks] = Fit(0.0, left[name] * case.size, noise)
                yield mistake

            return Family(name, mistakes, is_costly=name.startswith("costly"))

        monkeypatch.setattr(Case, "fit", lambda _, slip, __: fits[slip])
        monkeypatch.setattr(slips, "FAMILIES", tuple(map(family, left)))
        return slips.likely_cause(case), tried

    return explained  # type: ignore[return-value]


@pytest.fixture
def truth(demo_reference: hc.Result) -> hc.Result:
    return demo_reference


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
        # A hint names what is nearest, if it leaves little.
        (1e-6, False, {"this": 0.069}, f"{NOTHING}. The nearest is: this; it leaves 6.9 % of the"),
        (1e-6, False, {"this": 0.071}, FAR),
        (1e-6, False, {"this": 0.5}, FAR),
    ],
)
def test_a_cause_or_a_hint(
    truth: hc.Result,
    explain: Explain,
    tolerance: float,
    noisy: bool,
    left: dict[str, float],
    words: str | None,
) -> None:
    result, _ = explain(shared(truth, 0.01, tolerance), noisy, **left)
    is_cause = words is not None and not words.startswith(NOTHING)
    assert ((result.cause is None), (result.hint is None)) == (not is_cause, is_cause)
    assert (result.cause or result.hint or "").startswith(words or NOTHING)


@pytest.mark.parametrize(
    ("contacts", "error", "size", "sought"),
    [
        (5, 0.0, 0.01, False),
        (6, 0.0, 0.01, True),
        (59, 0.0, 0.98e-7, False),
        (59, 0.0, 1.02e-7, True),
        (59, 1e-5, 0.98e-4, False),
        (59, 1e-5, 1.02e-4, True),
    ],
)
def test_a_cause_is_sought_where_enough_contacts_are_off_enough(
    truth: hc.Result, explain: Explain, contacts: int, error: float, size: float, sought: bool
) -> None:
    truth = replace(truth, error_estimate=error) if error else truth
    few = replace(shared(truth, size), judged=np.arange(59) < contacts)
    result, tried = explain(few, this=0.5)
    assert bool(tried) is sought
    assert (result.remark is None) is (contacts > 5)


@pytest.mark.parametrize(
    ("times", "contact", "named"),
    # Mistakes move the last two contacts by themselves.
    [(98.0, 5, False), (102.0, 5, True), (1000.0, 58, True), (1000.0, 59, False)],
)
def test_a_contact_alone_is_a_hundred_times_as_far_off_as_the_others(
    truth: hc.Result, explain: Explain, times: float, contact: int, named: bool
) -> None:
    peaks = truth.peak_force * (1 + 1e-5)
    peaks[contact - 2] *= 1 + times * 1e-5 - 1e-5
    result, tried = explain(case_of(truth, peaks), this=0.5)
    assert (result.cause or "").startswith(f"contact {contact} alone") is named
    assert bool(tried) is not named
    exact = truth.peak_force.copy()
    exact[3] = 0.0
    others = explain(case_of(truth, exact), this=0.5)[0].cause or ""
    assert others.endswith("contact 5 alone, as after a typing error: the others are right")


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
    truth: hc.Result,
    explain: Explain,
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
    case = case_of(truth, truth.peak_force * (1 + off))
    case = replace(case, judged=np.arange(59) < count)
    result, _ = explain(case, this=0.5)
    assert ("look like noise" in (result.hint or "")) is named


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
    explain: Explain, rounded: Callable[[float], float], words: str | None
) -> None:
    truth = hc.Native("reference").run(paper_scene("cosine", 1.0, 2.0, 16))
    peaks = truth.peak_force * np.linspace(0.6, 1.4, 15)  # in more than one decade
    truth = replace(truth, peak_force=peaks)
    given = np.array([rounded(float(force)) for force in peaks], np.float64)
    cause = explain(case_of(truth, given), this=0.5)[0].cause
    if words is None:
        assert cause is None
    else:
        assert (cause or "").startswith(f"rounding: these are the scene's own peaks {words},")


def test_the_hint_of_a_scene_with_terms_says_what_was_tried() -> None:
    scene = replace(paper_scene("cosine", 1.0, 2.0, 16), wall=hc.Wall("rigid"))
    peaks = hc.Native("reference").run(scene).peak_force
    judged = hc.judge(scene, peaks * (1 + 0.01 * np.random.default_rng(0).standard_normal(16)))
    assert judged.cause is None
    assert (judged.hint or "").startswith("no mistake that was tried explains these peaks")
    assert judged.to_dict()["hint"] == judged.hint
    document = of_judgement(judged)
    failures = [(failure.name, failure.advice) for failure in document.verdict.failures]
    assert failures == [("Hint", judged.hint)]
    text = StringIO()
    print_document(Console(file=text, width=1000), document)
    assert "\nNo mistake that was tried explains these peaks" in text.getvalue()
    assert "Likely cause" not in text.getvalue()


# A case
