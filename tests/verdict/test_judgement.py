"""Peaks from anywhere, judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.verdict import judgement
from tests.conftest import STEEL, paper_scene

# Verdict


def test_true_peaks_pass_without_a_cause(demo_reference: hc.Result) -> None:
    scene, peaks = demo_reference.scene, demo_reference.peak_force
    ruling = hc.judge(scene, peaks, tolerance=1e-8)
    assert (ruling.verdict, ruling.cause, ruling.remarks) == ("pass", None, ())
    assert ruling.largest_difference == 0
    assert [row["passed"] for row in ruling.rows] == [True] * 59
    assert ruling.to_dict()["verdict"] == "pass"
    columns = ["contact", "given_N", "reference_N", "difference", "passed"]
    assert ruling.to_frame().columns.tolist() == columns
    # So that ``assert hc.judge(...)`` is a test.
    assert ruling
    assert not hc.judge(scene, 1.01 * peaks)


def test_where_nothing_can_be_judged(demo_reference: hc.Result) -> None:
    ruling = hc.judge(demo_reference.scene, demo_reference.peak_force)
    none = replace(ruling, given=np.full_like(ruling.given, np.nan))
    assert (none.verdict, none.largest_difference, none.missing) == ("fail", None, none.given.size)
    assert none.summary == "no contact that was given is pressed enough to be judged"
    sampled = replace(ruling, sampling=np.full_like(ruling.given, 2 * ruling.tolerance))
    assert sampled.summary.endswith("is pressed enough and sampled often enough to be judged")
    assert (sampled.sampling_error, sampled.sampled_too_rarely) == (None, sampled.given.size)
    often = replace(ruling, sampling=np.linspace(0, ruling.tolerance / 2, ruling.given.size))
    assert often.sampling_error == ruling.tolerance / 2
    assert (often.sampled_too_rarely, often.verdict) == (0, "pass")


def test_peaks_of_no_contact_are_refused(demo: hc.Scene) -> None:
    with pytest.raises(SceneError, match="has no peak, must have one of a contact"):
        hc.judge(demo, {})


def test_the_verdict_is_over_what_was_given(demo_reference: hc.Result) -> None:
    scene, peak = demo_reference.scene, demo_reference.peak_force
    ruling = hc.judge(scene, {2: peak[0], 4: 1.002 * peak[2]})
    assert ruling.verdict == "fail"
    assert ruling.missing == 57
    assert ruling.summary.startswith(
        "1 of 2 contacts differ by more than 1.0e-03 from the reference"
    )
    assert ruling.summary.endswith("the largest difference is 2.0e-03")
    assert [row["passed"] for row in ruling.rows[:4]] == [True, None, False, None]
    assert ruling.remarks == ("a cause is named only if at least 6 contacts are judged",)
    assert hc.judge(scene, {2: peak[0], 4: 1.002 * peak[2]}, tolerance=0.01).verdict == "pass"


@pytest.mark.parametrize("dt", [None, 1e-7])
def test_peaks_before_a_wall_are_judged(dt: float | None) -> None:
    chain = paper_scene("cosine", 1.0, 2.0, 8).chain
    scene = hc.Scene(chain, hc.Striker(1.0), wall=hc.Wall("rigid"))
    true = hc.Native("reference").run(scene).peak_force
    ruling = hc.judge(scene, 1.01 * true, dt=dt)
    # The reference is right to 1e-9 here.
    assert ruling.largest_difference == pytest.approx(0.01, rel=1e-6, abs=0)
    assert (ruling.verdict, ruling.passed.tolist()) == ("fail", [False] * 8)
    assert (ruling.expected is None) == (dt is None)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1.0, np.nan, np.inf, 1e-12])
def test_an_impossible_tolerance_is_refused(demo: hc.Scene, tolerance: float) -> None:
    with pytest.raises(SceneError, match="tolerance = "):
        hc.judge(demo, {2: 100.0}, tolerance=tolerance)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (np.ones(58), "^number of peak_force = 58: must be a file, a mapping from contacts, or an"),
        ([1.0], "^number of peak_force = 1: must be .* an array of 59 forces$"),
        (
            np.ones((2, 59)),
            "^number of peak_force = 118: must be a file, .* or an array of 59 forces$",
        ),
        ([[1.0], [2.0, 3.0]], "array of 59"),
        (
            {2: -78.0},
            "peak_force_N in row 1 = -78.0: must be finite and at least 0 .N.: turn the sign",
        ),
        (np.where(np.arange(59) == 7, -1e-9, 100.0), "must be finite and at least 0"),
        (np.where(np.arange(59) == 7, np.inf, np.nan), "must be finite and at least 0"),
        ({1: 3.0}, "contact in row 1 = 1: must be a whole .* from 2 to 60: .* granules 1 and 2$"),
        ({61: 3.0}, "contact in row 1 = 61: .* granules 1 and 2$"),
        ({2.5: 3.0}, "contact in row 1 = 2.5"),
        ({"two": 3.0}, "contact in row 1 = 'two': must be a finite number"),
        ({2: 100 + 1j}, r"peak_force_N in row 1 = '\(100\+1j\)': must be a finite number"),
        ({2: 10**400}, "peak_force_N in row 1 = '1000.*': must be a finite number"),
    ],
    ids=lambda given: str(given)[:40],
)
def test_impossible_peaks_are_refused(demo: hc.Scene, given: object, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        hc.judge(demo, given)  # type: ignore[arg-type]


def test_incident_peaks_are_judged_as_first_pulses() -> None:
    """Contacts 3 to 10 of a walled chain: the incident wave, as a chain that is longer has it."""
    walled, long = (
        hc.Scene(hc.Chain(granules, **STEEL), hc.Striker(1.0), hc.Run(1e-3), wall=wall)
        for granules, wall in ((31, hc.Wall("rigid")), (90, None))
    )
    incident = hc.Native(rtol=1e-9).run(long).first_pulses
    given = np.full(walled.last_contact - 1, np.nan)
    given[1:9] = incident.force[1:9]
    ruling = hc.judge(walled, given, tolerance=1e-6)
    assert (ruling.verdict, ruling.compared_with) == ("pass", "first pulses")
    assert ruling.to_dict()["compared_with"] == "first pulses"
    assert ruling.summary.startswith(
        "0 of 8 contacts differ by more than 1.0e-06 from the first pulses of the reference, the"
    )
    # A tenth of them would fail against the largest forces, most of which are reflected.
    largest = hc.Native(rtol=1e-9).run(walled).peak_force
    assert np.all(np.abs(given[1:9] / largest[1:9] - 1) > 1e-3)
    of_largest = hc.judge(walled, largest, tolerance=1e-6)
    assert (of_largest.verdict, of_largest.compared_with) == ("pass", "largest forces")
    wrong = hc.judge(walled, 1.003 * given, tolerance=1e-3)
    assert wrong.verdict == "fail"


@pytest.mark.parametrize(("share", "what"), [(1 / 3, "first pulses"), (3.0, "largest forces")])
def test_a_spread_ten_times_smaller_tells_what_was_given(share: float, what: str) -> None:
    """Peaks of another force, none of which agrees with either."""
    walled = hc.Scene(hc.Chain(31, **STEEL), hc.Striker(1.0), hc.Run(1e-3), wall=hc.Wall("rigid"))
    run = hc.Native("reference").run(walled)
    assert run.first_pulses is not None
    first, some = run.first_pulses.force, slice(1, 9)
    spread = float(np.std(np.log(first[some] / run.peak_force[some])))
    noise = share * 0.1 * spread * np.array([1, -1, -1, 1, 1, -1, -1, 1])
    given = np.full(walled.last_contact - 1, np.nan)
    given[some] = 1.5 * first[some] * np.exp(noise)
    assert judgement._truth(run, given, 1e-3)[1] == (what == "first pulses")
    given[-1] = 1.5 * run.peak_force[-1]  # a contact without a clear pulse does not count
    unclear = np.where(np.arange(first.size) < first.size - 1, first, np.nan)
    seen = replace(run, first_pulses=replace(run.first_pulses, force=unclear))
    assert judgement._truth(seen, given, 1e-3)[1] == (what == "first pulses")


def test_a_mistake_is_found_by_first_pulses() -> None:
    """A deck whose peaks before reflections are those of another modulus."""
    scene = hc.Scene(hc.Chain(12, **STEEL), hc.Striker(1.0), hc.Run(4e-4), wall=hc.Wall("rigid"))
    soft = replace(scene, chain=replace(scene.chain, young_modulus=0.9 * STEEL["young_modulus"]))
    first = hc.Native(rtol=1e-9).run(soft).first_pulses
    ruling = hc.judge(scene, first.force, tolerance=1e-4)
    assert ruling.verdict == "fail"
    assert ruling.compared_with == "first pulses"
    assert "0.9" in str(ruling.cause)
