"""Peaks from anywhere, judged: verdicts, hostile tables, and mistakes that have to be named."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain import causes, judgement
from hertzchain.arrays import Array, FloatArray
from hertzchain.errors import SceneError
from hertzchain.judgement import read_peaks
from hertzchain.schedule import Leg
from tests.conftest import paper_scene
from validation.mistakes import in_set_up

SCENES = [
    ("cosine", 0.3, 2.0),
    pytest.param(("triangular", 1.0, 4.0), marks=pytest.mark.slow),
    ("cosine-triangular", 2.0, 2.0),
    pytest.param(("cosine", 2.5, 6.0), marks=pytest.mark.slow),
]


@pytest.fixture(scope="module", params=SCENES, ids=str)
def truth(request: pytest.FixtureRequest) -> hc.Result:
    return hc.Native("reference").run(paper_scene(*request.param))


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


@pytest.mark.parametrize("size", [2e-3, 0.05])
def test_noise_has_no_cause(truth: hc.Result, size: float) -> None:
    noise = np.random.default_rng(0).standard_normal(truth.peak_force.size)
    assert named(truth, truth.peak_force * (1 + size * noise)) == ""


def test_where_nothing_was_pressed_that_is_what_is_said(demo_reference: hc.Result) -> None:
    cause = named(demo_reference, 0 * demo_reference.peak_force)
    assert cause.startswith("no contact was pressed, or none was read")


def test_peaks_of_no_contact_are_refused(demo: hc.Scene) -> None:
    with pytest.raises(SceneError, match="must be given for a contact at least"):
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
    # In so short a run the wave has not got far.
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
    # Without the step, one that is as far off is told: the error is not quite of second order.
    like = hc.judge(scene, run.peak_force).like_steps
    assert like is not None
    assert like[0] == pytest.approx(dt, rel=0.05, abs=0)


def _ends(leg: Leg) -> FloatArray:
    return np.append(leg.start + leg.dt * np.arange(leg.steps), leg.end)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1.0, np.nan, np.inf, 1e-12])
def test_an_impossible_tolerance_is_refused(demo: hc.Scene, tolerance: float) -> None:
    with pytest.raises(SceneError, match="tolerance = "):
        hc.judge(demo, {2: 100.0}, tolerance=tolerance)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (np.ones(58), "array of 59"),
        ("no.csv", "no.csv: cannot be read"),
        ([[1.0], [2.0, 3.0]], "array of 59"),
        (np.full(59, -1.0), "at least 0"),
        (np.full(59, np.inf), "must be finite"),
        ({1: 3.0}, "contact = 1: must be a whole number from 2 to 60"),
        ({61: 3.0}, "contact = 61"),
        ({2.5: 3.0}, "contact = 2.5"),
        ({2: np.nan}, "peak_force_N = nan"),
    ],
    ids=str,
)
def test_impossible_peaks_are_refused(demo: hc.Scene, given: object, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        hc.judge(demo, given)  # type: ignore[arg-type]


# Causes


def test_another_stiffness_is_named(truth: hc.Result) -> None:
    # Far fields go as the stiffness to the power of 0.4 at most, 0.1 at LM_ratio 2.5.
    scene = causes.with_rise_time(truth.scene)
    for factor in (0.5, 1.03, 8.0):
        chain = replace(scene.chain, young_modulus=factor * scene.chain.young_modulus)
        found = named(truth, exact(replace(scene, chain=chain)))
        assert found.startswith(f"contact stiffness {factor:g} times"), found
    no_nu = exact(replace(scene, chain=replace(scene.chain, poisson_ratio=0.0)))
    assert "E in place of E/(1 - nu^2)" in named(truth, no_nu)


def test_a_diameter_in_place_of_the_radius_is_named(truth: hc.Result) -> None:
    scene = causes.with_rise_time(truth.scene)
    chain = replace(scene.chain, radius=2 * scene.chain.radius)
    assert "diameter taken for radius" in named(truth, exact(replace(scene, chain=chain)))


def test_another_force_or_unit_is_named(truth: hc.Result) -> None:
    scene = causes.with_rise_time(truth.scene)
    assert isinstance(scene.shock, hc.Pulse)
    pushed = replace(scene, shock=replace(scene.shock, peak_force=110.0))
    assert "applied force 1.1 times" in named(truth, exact(pushed))
    for factor, unit in ((1e-3, "kN"), (1e5, "dyn"), (0.01, "F0")):
        assert f"in units of {unit}" in named(truth, factor * truth.peak_force)


def test_other_numbers_are_named(truth: hc.Result) -> None:
    peak = truth.peak_force
    assert "peak of contact i + 1" in named(truth, np.append(peak[1:], np.nan))
    assert "from the far end" in named(truth, peak[::-1])
    longer = replace(truth.scene, chain=replace(truth.scene.chain, granules=61))
    assert "a chain of 61 granules" in named(truth, exact(longer)[:59])


@pytest.mark.parametrize("h", [0.06, 0.1, 0.3])
def test_samples_in_place_of_maxima_are_named(truth: hc.Result, h: float) -> None:
    step = h * truth.scene.units.time
    times = np.arange(0.0, truth.scene.end_time, step)
    history = hc.Native(rtol=1e-8).run(truth.scene, record=times).history
    assert history is not None
    found = named(truth, history.contact_force.max(axis=0), tolerance=5e-4)
    assert found.startswith("samples in place of maxima, ")
    # A thousandth of the step is a fraction of a step at the end of the run.
    assert float(found.split()[5]) == pytest.approx(step, rel=1e-3, abs=0)


def test_steps_too_long_are_named(truth: hc.Result) -> None:
    dt = 0.1 * truth.scene.units.time
    peaks = hc.Native("velocity-verlet", dt).run(truth.scene).peak_force
    assert "velocity Verlet with steps of some 1.4" in named(truth, peaks)
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


@pytest.mark.parametrize(
    ("damping", "words"),
    [
        (lambda _, rate: 0.02 * rate, "a dashpot in each contact"),
        (lambda pressed, rate: 0.1 * pressed**0.25 * rate, "Tsuji's"),
        (lambda pressed, rate: 0.1 * np.sqrt(pressed) * rate, "viscoelastic spheres"),
        (lambda pressed, rate: 0.002 * np.sqrt(pressed) * rate, "viscoelastic spheres"),
    ],
    ids=["dashpot", "Tsuji", "viscoelastic", "weak"],
)
def test_damping_is_named(truth: hc.Result, damping: Damping, words: str) -> None:
    found = named(truth, plain_code(truth.scene, 0.01, damping))
    assert found.startswith("damping on")
    assert words in found


def test_explicit_euler_is_named(truth: hc.Result) -> None:
    found = named(truth, plain_code(truth.scene, 0.01, lambda _, rate: 0 * rate, euler=True))
    assert found.startswith("contact forces 1.4")
    assert "explicit Euler" in found


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            ("hertz/material ${young_modulus} 0.0", "hertz/material $(2*v_young_modulus) 0.0"),
            "of half",
        ),
        (
            (
                "hertz/material ${young_modulus} 0.0 ${poisson_ratio}",
                "hertz/material ${young_modulus} 0.2 ${poisson_ratio} damping tsuji",
            ),
            "Tsuji's",
        ),
    ],
    ids=["stiffness", "damping"],
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


# The reader

TABLE = "contact,peak_force_N\n2,105.4\n3,116.2\n"


def test_columns_are_found_by_name_in_any_order(tmp_path: Path) -> None:
    path = tmp_path / "peaks.csv"
    path.write_text('\ufeffnote, peak_force_N ,contact\n"a,b",3.5,4\n,2e2,2\n\n,0,3.0\n')
    assert read_peaks(path, 6).tolist()[:3] == [200.0, 0.0, 3.5]
    assert np.isnan(read_peaks(path, 6)[3:]).all()
    path.write_text("contact,peak_force_N\n")
    assert np.isnan(read_peaks(path, 6)).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"", "first line = '': must name the columns contact and peak_force_N"),
        (b"i,F\n2,3\n", "first line = 'i,F'"),
        (b"contact,contact,peak_force_N\n2,2,3\n", "each once"),
        (b"contact,peak_force_N\n1,3\n", "contact in row 1 = 1.0: .* from 2 to 6: contact 2 lies"),
        (b"contact,peak_force_N\n2,3\n7,3\n", "contact in row 2 = 7.0"),
        (b"contact,peak_force_N\n2,3\n2,3\n", "contact in row 2 = 2.0: is there twice"),
        (b"contact,peak_force_N\n2,nan\n", "peak_force_N in row 1 = nan"),
        (b"contact,peak_force_N\n2,-3\n", "peak_force_N in row 1 = -3.0"),
        (b"contact,peak_force_N\n2,\n", "row 1 = '2,': must have two numbers"),
        (b"contact,peak_force_N\n2\n", "row 1 = '2': must have two numbers"),
        (b"contact,peak_force_N\n2,much\n", "row 1"),
        (b"contact,peak_force_N\n2,\xff\n", "not a text file"),
        (b"contact,peak_force_N\n" + b"2,3\n" * 1_500_000, "larger than 5 MB"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_bad_table_is_refused_in_one_sentence(tmp_path: Path, text: bytes, words: str) -> None:
    path = tmp_path / "peaks.csv"
    path.write_bytes(text)
    with pytest.raises(SceneError, match=words) as caught:
        read_peaks(path, 6)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("seed", range(20))
def test_hostile_tables_give_peaks_or_one_sentence(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)  # noqa: S311
    path = tmp_path / "peaks.csv"
    pieces = [
        "2",
        "nan",
        "1e999",
        "-1",
        "\x00",
        '"',
        ",",
        "\n",
        "\r",
        "contact",
        "\u202e",
        "1" * 400,
    ]
    for _ in range(50):
        text = list(TABLE)
        for _ in range(draw.randint(1, 6)):
            at = draw.randrange(len(text))
            text[at : at + draw.randint(0, 3)] = draw.choice(pieces)
        path.write_bytes("".join(text).encode()[: draw.randint(0, 600)])
        begin = time.perf_counter()
        try:
            found = read_peaks(path, 6)
        except SceneError as problem:
            assert str(problem).isprintable()  # noqa: PT017
            assert len(str(problem)) < 1000  # noqa: PT017
        else:
            assert found.shape == (5,)
            assert not np.any(found < 0)
            assert not np.any(np.isinf(found))
        assert time.perf_counter() - begin < 1.0


def test_the_best_factor_is_found_in_a_valley_that_is_not_the_deepest_trial() -> None:
    chain = hc.Chain(20, 4.75e-3, 193e9, 0.3, 7958.0)
    scene = hc.Scene(chain, hc.Pulse("cosine", 200.0, 2.0, rise_time=20e-6))
    wrong = replace(scene, chain=replace(chain, young_modulus=math.sqrt(2) * 193e9))
    judged = hc.judge(scene, hc.Native("reference").run(wrong).peak_force)
    assert judged.cause is not None
    assert judged.cause.startswith("contact stiffness 1.41421 times that of the scene")


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.1])
def test_one_contact_that_is_off_is_named(factor: float) -> None:
    scene = paper_scene("cosine-triangular", 2.0, 2.0, granules=20)
    peaks = hc.Native(rtol=1e-6).run(scene).peak_force.copy()
    peaks[3] *= factor
    judged = hc.judge(scene, peaks)
    assert judged.cause is not None
    assert judged.cause.startswith("contact 5 alone")
    assert judged.cause.endswith("of the truth")
    exact = judged.reference.peak_force.copy()
    exact[3] *= factor
    cause = hc.judge(scene, exact).cause
    assert cause is not None
    assert cause.endswith("the others are right")
