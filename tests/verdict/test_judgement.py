"""Peaks from anywhere, judged: verdicts, and mistakes that have to be named."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native import METHODS
from hertzchain.errors import SceneError
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.scene.schedule import Leg
from hertzchain.verdict import causes, judgement, sampling
from hertzchain.verdict.case import Case, Cause
from hertzchain.verdict.mistaken import with_rise_time
from hertzchain.verdict.slips import stretch_in_words
from tests.conftest import paper_scene
from validation.planting import in_set_up

if TYPE_CHECKING:
    import pint

QUICK = ("cosine", 0.3, 2.0), ("cosine-triangular", 2.0, 2.0)
MORE = ("triangular", 1.0, 4.0), ("cosine", 2.5, 6.0)
SCENES = [*QUICK, *(pytest.param(scene, marks=pytest.mark.slow) for scene in MORE)]


@pytest.fixture(scope="module", params=SCENES, ids=str)
def truth(request: pytest.FixtureRequest) -> hc.Result:
    return hc.Native("reference").run(paper_scene(*request.param))


def in_turn(
    names: str, cases: dict[str, tuple[object, ...]], slow: Collection[str] = ()
) -> pytest.MarkDecorator:
    """Cases by their names, on all scenes; the quick scenes take turns where tests are not slow."""
    marked = [
        pytest.param(
            scene,
            *case,
            id=f"{scene}-{name}",
            marks=[] if scene == QUICK[k % 2] and name not in slow else pytest.mark.slow,
        )
        for k, (name, case) in enumerate(cases.items())
        for scene in (*QUICK, *MORE)
    ]
    return pytest.mark.parametrize(f"truth, {names}", marked, indirect=["truth"])


def on(quick: tuple[str, float, float]) -> pytest.MarkDecorator:
    """All scenes, one of which is quick; tests take the two quick scenes in turn."""
    scenes = [
        pytest.param(scene, id=str(scene), marks=[] if scene == quick else pytest.mark.slow)
        for scene in (*QUICK, *MORE)
    ]
    return pytest.mark.parametrize("truth", scenes, indirect=True)


def exact(scene: hc.Scene) -> FloatArray:
    return hc.Native(rtol=1e-8, peaks_only=True).run(scene).peak_force


def named(
    truth: hc.Result, peak_force: Array, tolerance: float = 1e-3, dt: float | None = None
) -> str:
    """The cause that is found; empty where there is none."""
    found = hc.judge(truth.scene, peak_force, tolerance=tolerance, dt=dt)
    assert found.verdict == "fail"
    assert found.remarks == ()
    return found.cause or ""


# Verdict


def test_true_peaks_pass_without_a_cause(truth: hc.Result) -> None:
    found = hc.judge(truth.scene, truth.peak_force, tolerance=1e-8)
    assert (found.verdict, found.cause, found.remarks) == ("pass", None, ())
    assert found.largest_difference is not None
    assert found.largest_difference == 0
    assert [row["passed"] for row in found.rows] == [True] * 59
    assert found.to_dict()["verdict"] == "pass"
    columns = ["contact", "given_N", "reference_N", "difference", "passed"]
    assert found.to_frame().columns.tolist() == columns


def test_a_judgement_is_true_if_it_passes(truth: hc.Result) -> None:
    """So that ``assert hc.judge(...)`` is a test."""
    assert hc.judge(truth.scene, truth.peak_force)
    assert not hc.judge(truth.scene, 1.01 * truth.peak_force)


@in_turn("size", {"weak": (2e-3,), "strong": (0.05,)})
def test_noise_has_no_cause(truth: hc.Result, size: float) -> None:
    noise = np.random.default_rng(0).standard_normal(truth.peak_force.size)
    assert named(truth, truth.peak_force * (1 + size * noise)) == ""


def test_where_nothing_was_pressed_that_is_what_is_said(demo_reference: hc.Result) -> None:
    cause = named(demo_reference, 0 * demo_reference.peak_force)
    assert cause.startswith("no contact was pressed, or none was read")


def test_peaks_of_no_contact_are_refused(demo: hc.Scene) -> None:
    with pytest.raises(SceneError, match="must be given for at least one contact"):
        hc.judge(demo, {})


def test_the_verdict_is_over_what_was_given(demo_reference: hc.Result) -> None:
    scene, peak = demo_reference.scene, demo_reference.peak_force
    found = hc.judge(scene, {2: peak[0], 4: 1.002 * peak[2]})
    assert found.verdict == "fail"
    assert found.missing == 57
    assert [row["passed"] for row in found.rows[:4]] == [True, None, False, None]
    assert found.remarks == ("the cause is sought where at least 6 contacts are judged",)
    assert hc.judge(scene, {2: peak[0], 4: 1.002 * peak[2]}, tolerance=0.01).verdict == "pass"


def test_weak_contacts_are_not_judged() -> None:
    # In such a short run the wave covers only a few contacts.
    scene = replace(paper_scene("cosine", 2.0, 2.0), run=hc.Run(end_time=1e-4))
    truth = hc.Native("reference").run(scene)
    wrong = np.where(truth.peak_force < 1e-3 * truth.peak_force.max(), 1.0, truth.peak_force)
    found = hc.judge(scene, wrong)
    assert found.verdict == "pass"
    assert {row["passed"] for row in found.rows} == {True, None}


def test_the_accuracy_that_a_step_should_have(demo_reference: hc.Result) -> None:
    scene = demo_reference.scene
    dt = 0.05 * scene.units.time
    run = hc.Native("velocity-verlet", dt).run(scene)
    found = hc.judge(scene, run.peak_force, dt=dt)
    assert found.expected is not None
    assert found.largest_difference == pytest.approx(found.expected.interpolated, rel=1e-6, abs=0)
    times = np.unique(np.concatenate([_ends(leg) for leg in scene.schedule(dt)]))
    force = hc.Native("velocity-verlet", dt).run(scene, record=times).history
    assert force is not None
    off = np.max(np.abs(force.contact_force.max(axis=0) / demo_reference.peak_force - 1))
    assert found.expected.sampled == pytest.approx(float(off), rel=1e-6, abs=0)
    # Without the step, a step with this error is reported: the error is not quite of second order.
    like = hc.judge(scene, run.peak_force).like_steps
    assert like is not None
    assert like[0] == pytest.approx(dt, rel=0.05, abs=0)
    # Highest samples are as far off there as where they fall lets them be.
    there = hc.judge(scene, run.peak_force, dt=like[1]).expected
    assert there is not None
    assert there.sampled == pytest.approx(found.largest_difference, rel=0.5, abs=0)


@pytest.mark.parametrize("dt", [None, 1e-7])
def test_peaks_before_a_wall_are_judged(dt: float | None) -> None:
    chain = paper_scene("cosine", 1.0, 2.0, 8).chain
    scene = hc.Scene(chain, hc.Striker(1.0), wall=hc.Wall("rigid"))
    true = hc.Native("reference").run(scene).peak_force
    found = hc.judge(scene, 1.01 * true, dt=dt)
    # The reference is right to 1e-9 here.
    assert found.largest_difference == pytest.approx(0.01, rel=1e-6, abs=0)
    assert (found.verdict, found.passed.tolist()) == ("fail", [False] * 7)
    assert (found.expected is None) == (dt is None)


def test_no_step_is_named_where_nothing_is_off_or_no_step_is_as_bad() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, granules=20)
    truth = hc.Native("reference").run(scene)

    def like(difference: float) -> tuple[float, float] | None:
        return hc.judge(scene, (1 + difference) * truth.peak_force, tolerance=0.9).like_steps

    # Below ten times its own error the reference does not know whether anything is off.
    known = 10 * truth.error_estimate
    assert like(0.9 * known) is None
    assert like(1.1 * known) is not None
    some = like(1e-3)
    assert some is not None
    # The steps go as the root of the difference, up to the longest that is stable.
    stable = stable_step(scene, METHODS["velocity-verlet"].interval)
    most = 1e-3 * (stable / max(some)) ** 2
    assert like(0.98 * most) is not None
    assert like(1.02 * most) is None


def _ends(leg: Leg) -> FloatArray:
    return np.append(leg.start + leg.dt * np.arange(leg.steps), leg.end)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1.0, np.nan, np.inf, 1e-12])
def test_an_impossible_tolerance_is_refused(demo: hc.Scene, tolerance: float) -> None:
    with pytest.raises(SceneError, match="tolerance = "):
        hc.judge(demo, {2: 100.0}, tolerance=tolerance)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            np.ones(58),
            "^number of peak_force = 58: must be a file, a mapping from contacts, or an",
        ),
        ([1.0], "^number of peak_force = 1: must be .* an array of 59 forces$"),
        (
            np.ones((2, 59)),
            "^number of peak_force = 118: must be a file, .* or an array of 59 forces$",
        ),
        ("no.csv", "no.csv: cannot be read"),
        ([[1.0], [2.0, 3.0]], "array of 59"),
        (np.full(59, -1.0), "must be finite and at least 0 .N., which presses"),
        ({2: -78.0}, "^peak_force = -78.0: must be finite and at least 0 .N.: turn the sign"),
        (np.full(59, np.inf), "must be finite"),
        ({1: 3.0}, "contact = 1: must be a whole .* from 2 to 60: .* begin with 1: add 1 to each"),
        ({61: 3.0}, "contact = 61"),
        ({2.5: 3.0}, "contact = 2.5"),
        ({2: np.nan}, "peak_force = nan"),
        ({"two": 3.0}, "must map contacts to forces"),
    ],
    ids=str,
)
def test_impossible_peaks_are_refused(demo: hc.Scene, given: object, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        hc.judge(demo, given)  # type: ignore[arg-type]


# Causes


@on(QUICK[0])
def test_another_stiffness_is_named(truth: hc.Result) -> None:
    # Far fields go as the stiffness to the power of 0.4 at most, 0.1 at LM_ratio 2.5.
    scene = with_rise_time(truth.scene)
    for factor in (0.5, 1.03, 8.0):
        chain = replace(scene.chain, young_modulus=factor * scene.chain.young_modulus)
        found = named(truth, exact(replace(scene, chain=chain)))
        assert found.startswith(f"contact stiffness {factor:g} times"), found
    no_nu = exact(replace(scene, chain=replace(scene.chain, poisson_ratio=0.0)))
    assert "E in place of E/(1 - nu^2)" in named(truth, no_nu)


@on(QUICK[1])
def test_a_diameter_in_place_of_the_radius_is_named(truth: hc.Result) -> None:
    scene = with_rise_time(truth.scene)
    chain = replace(scene.chain, radius=2 * scene.chain.radius)
    assert "diameter taken for radius" in named(truth, exact(replace(scene, chain=chain)))


@on(QUICK[0])
def test_another_force_or_unit_is_named(truth: hc.Result) -> None:
    scene = with_rise_time(truth.scene)
    assert isinstance(scene.shock, hc.Pulse)
    pushed = replace(scene, shock=replace(scene.shock, peak_force=110.0))
    assert "applied force 1.1 times" in named(truth, exact(pushed))
    for factor, unit in ((1e-3, "kN"), (1e5, "dyn"), (0.01, "F0")):
        assert f"in units of {unit}" in named(truth, factor * truth.peak_force)


@functools.cache
def units() -> pint.UnitRegistry[float]:
    """Units by Pint, which takes half a second to load and to read them."""
    import pint

    return pint.UnitRegistry()


@pytest.mark.parametrize(
    ("shown", "unit"),
    [
        ("MN", "meganewton"),
        ("mN", "millinewton"),
        ("uN", "micronewton"),
        ("kgf", "kilogram_force"),
        ("lbf", "pound_force"),
    ],
)
def test_every_unit_of_force_is_named(shown: str, unit: str) -> None:
    short = hc.Native("reference").run(paper_scene("cosine", 1.0, 2.0, granules=8))
    newton: float = units().Quantity(1.0, "newton").to(unit).magnitude
    assert f"in units of {shown}" in named(short, newton * short.peak_force)


@on(QUICK[0])
def test_other_numbers_are_named(truth: hc.Result) -> None:
    peak = truth.peak_force
    assert "peak of contact i + 1" in named(truth, np.append(peak[1:], np.nan))
    assert "from the far end" in named(truth, peak[::-1])
    longer = replace(truth.scene, chain=replace(truth.scene.chain, granules=61))
    assert "a chain of 61 granules" in named(truth, exact(longer)[:59])


@in_turn("h", {"0.06": (0.06,), "0.1": (0.1,), "0.3": (0.3,)}, slow=["0.1"])
def test_samples_in_place_of_maxima_are_named(truth: hc.Result, h: float) -> None:
    step = h * truth.scene.units.time
    times = np.arange(0.0, truth.scene.end_time, step)
    history = hc.Native(rtol=1e-8).run(truth.scene, record=times).history
    assert history is not None
    found = named(truth, history.contact_force.max(axis=0), tolerance=5e-4)
    assert found.startswith("samples in place of maxima, ")
    # A thousandth of the step is a fraction of a step at the end of the run.
    assert float(found.split()[5]) == pytest.approx(step, rel=1e-3, abs=0)


@on(QUICK[1])
def test_steps_too_long_are_named(truth: hc.Result) -> None:
    dt = 0.1 * truth.scene.units.time
    peaks = hc.Native("velocity-verlet", dt).run(truth.scene).peak_force
    assert "velocity Verlet with steps of about 1.4" in named(truth, peaks)
    assert f"velocity Verlet with steps of {dt:.3g} s has" in named(truth, peaks, dt=dt)


Damping = Callable[[Array, Array], Array]


def plain_code(scene: hc.Scene, dt: float, damping: Damping, euler: bool = False) -> FloatArray:
    """Another code, in natural units: equal steps, parabolas through samples; no test of itself."""
    granules, unit = scene.chain.granules, scene.units
    u: Array = np.zeros(granules)
    v: Array = np.zeros(granules)
    highest: Array = np.zeros(granules - 1)
    before = now = highest
    times = np.linspace(0.0, scene.end_time, round(scene.end_time / unit.time / dt)) / unit.time
    dt = float(times[1])
    applied = scene.applied_force(times * unit.time) / unit.force

    def forces(k: int, u: Array, v: Array) -> tuple[Array, Array]:
        overlap, rate = u[:-1] - u[1:], v[:-1] - v[1:]
        pressed = np.maximum(overlap, 0)
        contact = pressed**1.5 + np.where(overlap > 0, damping(pressed, rate), 0)
        return np.append(applied[k], contact) - np.append(contact, 0), contact

    a, _ = forces(0, u, v)
    for k in range(1, times.size):
        if euler:
            u, v = u + dt * v, v + dt * a
            a, after = forces(k, u, v)
        else:
            half = v + dt / 2 * a
            u = u + dt * half
            a, after = forces(k, u, half)
            v = half + dt / 2 * a
        bend = np.minimum(before - 2 * now + after, -1e-300)
        turns = (now >= before) & (now > after)
        top = np.where(turns, now - (after - before) ** 2 / (8 * bend), after)
        highest, before, now = np.maximum(highest, top), now, after
    return np.asarray(highest * unit.force)


@in_turn(
    "damping, words",
    {
        "dashpot": (lambda _, rate: 0.02 * rate, "by dashpots of 4.9 kg/s"),
        "Tsuji": (lambda pressed, rate: 0.1 * pressed**0.25 * rate, "of restitution 0.819"),
        "viscoelastic": (
            lambda over, rate: 0.1 * np.sqrt(over) * rate,
            "of viscoelastic spheres with the relaxation time 9.7e-07 s",
        ),
        "weak": (
            lambda over, rate: 0.002 * np.sqrt(over) * rate,
            "of viscoelastic spheres with the relaxation time 1.9e-08 s",
        ),
    },
    # test_damping_causes has all three laws, too, with native's damping as the other code.
    slow=["dashpot", "viscoelastic", "weak"],
)
def test_damping_is_named(truth: hc.Result, damping: Damping, words: str) -> None:
    found = named(truth, plain_code(truth.scene, 0.01, damping))
    # The coefficient in SI units, and alpha = 0.1 sqrt(2) as a restitution: 0.8195.
    assert found.startswith(f"damping {words}")


@on(QUICK[1])
def test_explicit_euler_is_named(truth: hc.Result) -> None:
    found = named(truth, plain_code(truth.scene, 0.01, lambda _, rate: 0 * rate, euler=True))
    assert found.startswith("contact forces 1.4")
    assert "explicit Euler" in found


@pytest.mark.lammps
@in_turn(
    "change, words",
    {
        "stiffness": (
            ("hertz/material ${young_modulus} 0.0", "hertz/material $(2*v_young_modulus) 0.0"),
            "of half",
        ),
        "damping": (
            (
                "hertz/material ${young_modulus} 0.0 ${poisson_ratio}",
                "hertz/material ${young_modulus} 0.2 ${poisson_ratio} damping tsuji",
            ),
            "damping of restitution 0.34",  # 0.3433 is what tsuji gives for 0.2
        ),
    },
)
def test_a_wrong_deck_of_lammps_is_named(
    truth: hc.Result, change: tuple[str, str], words: str
) -> None:
    dt = 0.02 * truth.scene.units.time
    with in_set_up(change)():
        wrong = hc.Lammps(dt=dt).run(truth.scene).peak_force
    assert words in named(truth, wrong)


def test_a_minute_is_not_spent_on_the_cause(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judgement, "PATIENCE", 1e-3)
    found = hc.judge(demo_reference.scene, 1.1 * demo_reference.peak_force[::-1])
    assert found.cause is None
    (remark,) = found.remarks
    assert "not everything was tried" in remark


def test_the_best_factor_is_found_in_a_valley_that_is_not_the_deepest_trial() -> None:
    chain = hc.Chain(20, 4.75e-3, 193e9, 0.3, 7958.0)
    scene = hc.Scene(chain, hc.Pulse("cosine", 200.0, 2.0, rise_time=20e-6))
    wrong = replace(scene, chain=replace(chain, young_modulus=math.sqrt(2) * 193e9))
    judged = hc.judge(scene, hc.Native("reference").run(wrong).peak_force)
    assert judged.cause is not None
    assert judged.cause.startswith("contact stiffness 1.41421 times that of the scene")


def case_of(truth: hc.Result, given: FloatArray) -> Case:
    judged = judgement.judged_peaks(truth, given)
    return Case(truth.scene, truth, given, judged, None, 1e-3, Deadline(60.0))


def shared(truth: hc.Result, size: float) -> Case:
    """Peaks of which every other one is too high, the others too low, by the same."""
    signs = np.where(np.arange(truth.peak_force.size) % 2, 1.0, -1.0)
    return case_of(truth, truth.peak_force * np.exp(size * signs))


def found_by(
    monkeypatch: pytest.MonkeyPatch, case: Case, **left: float
) -> tuple[str | None, str | None, list[str]]:
    """Return cause and remark for given residuals of mistakes, and the list of those tried."""
    tried: list[str] = []

    def finder(name: str, part: float) -> causes.Finder:
        def find(case: Case) -> Iterator[Cause]:
            tried.append(name)
            yield Cause(name, part * case.size)

        return find

    monkeypatch.setattr(causes, "pairs", lambda _: [])
    monkeypatch.setattr(causes, "FINDERS", {name: finder(name, left[name]) for name in left})
    found = causes.likely_cause(case)
    return found.cause, found.remark, tried


def test_a_mistake_is_named_that_leaves_a_tenth(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = shared(demo_reference, 0.01)
    assert found_by(monkeypatch, case, this=0.098)[0] == "this; leaves 0.1 of the differences"
    assert found_by(monkeypatch, case, this=0.102)[0] is None


def test_mistakes_are_named_together_up_to_three_times_what_the_best_one_leaves(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = shared(demo_reference, 0.01)
    # A residual of 0 counts as 1e-4, the accuracy of fits.
    for best, others in ((0.01, 0.03), (0.0, 0.0003)):
        cause, *_ = found_by(monkeypatch, case, this=best, that=0.98 * others)
        assert cause is not None
        assert cause.startswith("this; or that; leaves")
        cause, *_ = found_by(monkeypatch, case, this=best, that=1.02 * others)
        assert cause is not None
        assert cause.startswith("this; leaves")


def test_what_takes_seconds_is_tried_unless_a_mistake_leaves_a_ten_thousandth(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = shared(demo_reference, 0.01)
    assert found_by(monkeypatch, case, this=0.98e-4, damping=0.5)[2] == ["this"]
    assert found_by(monkeypatch, case, this=1.02e-4, damping=0.5)[2] == ["this", "damping"]


def test_a_cause_is_sought_where_enough_contacts_are_off_enough(
    demo_reference: hc.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = shared(demo_reference, 0.01)
    for contacts, sought in ((5, False), (6, True)):
        few = replace(case, judged=np.arange(59) < contacts)
        _, remark, tried = found_by(monkeypatch, few, this=0.5)
        assert bool(tried) is sought
        assert (remark is None) is sought
    for size, sought in ((0.98e-7, False), (1.02e-7, True)):
        case = shared(demo_reference, size)
        assert bool(found_by(monkeypatch, case, this=0.5)[2]) is sought
    rough = replace(demo_reference, error_estimate=1e-5)
    for size, sought in ((0.98e-4, False), (1.02e-4, True)):
        assert bool(found_by(monkeypatch, shared(rough, size), this=0.5)[2]) is sought


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
    cause, _, tried = found_by(monkeypatch, case_of(demo_reference, peaks), this=0.5)
    assert (cause is not None and cause.startswith(f"contact {contact} alone")) is named
    assert bool(tried) is not named


def test_a_known_factor_is_named_within_three_thousandths(truth: hc.Result) -> None:
    scene = with_rise_time(truth.scene)
    stiffer = replace(scene, chain=replace(scene.chain, poisson_ratio=0.0))
    for off, named in ((0.0028, True), (0.0032, False)):
        for stretch in (2**0.5 * (1 + off), 2**0.5 * (1 - off)):
            assert stretch_in_words(stiffer, stretch).endswith(": half the mass") is named


@pytest.mark.parametrize(("off", "named"), [(0.0, True), (3e-4, True), (4e-4, False)])
def test_a_known_factor_near_1_is_named_within_a_tenth_of_what_it_changes(
    off: float, named: bool, demo: hc.Scene
) -> None:
    """With nu = 0.1 the factor 1 - nu^2 changes the length of the pulse by 3.3e-3."""
    scene = replace(demo, chain=replace(demo.chain, poisson_ratio=0.1))
    for sign in (-1, 1):
        words = stretch_in_words(scene, 0.99 ** (1 / 3) * (1 + sign * off))
        assert ("E in place of E/(1 - nu^2)" in words) is named


def test_peaks_below_a_billionth_are_as_good_as_none(demo_reference: hc.Result) -> None:
    expected = demo_reference.peak_force
    for part in (0.0, 0.5e-9, 1e-9):
        left = case_of(demo_reference, part * expected).residual(expected)
        assert left == pytest.approx(math.log(1e9), rel=1e-12, abs=0)
    left = case_of(demo_reference, 2e-9 * expected).residual(expected)
    assert left == pytest.approx(math.log(0.5e9), rel=1e-12, abs=0)


def test_samples_are_sought_in_twelve_contacts(demo_reference: hc.Result) -> None:
    scene = demo_reference.scene
    times = np.arange(0.0, scene.end_time, 0.3 * scene.units.time)
    history = hc.Native(rtol=1e-8).run(scene, record=times).history
    assert history is not None
    case = case_of(demo_reference, history.contact_force.max(axis=0))
    for contacts, sought in ((11, False), (12, True)):
        few = replace(case, judged=np.arange(59) < contacts)
        assert bool(next(sampling.samples(few), None)) is sought


@pytest.mark.parametrize(("interval", "ways"), [(0.38, 2), (0.42, 1), (0.9, 1)])
def test_samples_far_apart_are_not_steps_of_velocity_verlet(
    interval: float, ways: int, demo_reference: hc.Result
) -> None:
    scene = demo_reference.scene
    times = np.arange(0.0, scene.end_time, interval * scene.units.time)
    history = hc.Native(rtol=1e-8).run(scene, record=times).history
    assert history is not None
    found = list(sampling.samples(case_of(demo_reference, history.contact_force.max(axis=0))))
    assert len(found) == ways
    assert "of an accurate run" in found[0].sentence


def test_a_parameter_half_way_between_two_trials_is_fitted(demo_reference: hc.Result) -> None:
    """Both trials leave the same, to the last digit."""
    truth = demo_reference.peak_force
    case = case_of(demo_reference, truth)
    found, left = case.fit(lambda x: truth * np.exp(x * x), [-1.5, -0.5, 0.5, 1.5])
    # x is known to a billionth of the distance of two trials, or where x^2 is below round-off.
    assert found == pytest.approx(0.0, abs=1e-7)
    assert left < 1e-14


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.1])
def test_one_contact_that_is_off_is_named(factor: float) -> None:
    scene = paper_scene("cosine-triangular", 2.0, 2.0, granules=20)
    peaks = hc.Native(rtol=1e-6).run(scene).peak_force.copy()
    peaks[3] *= factor
    judged = hc.judge(scene, peaks)
    assert judged.cause is not None
    assert judged.cause.startswith("contact 5 alone")
    assert judged.cause.endswith("of the reference")
    exact = judged.reference.peak_force.copy()
    exact[3] *= factor
    cause = hc.judge(scene, exact).cause
    assert cause is not None
    assert cause.endswith("the others are right")
