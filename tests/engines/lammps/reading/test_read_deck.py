"""LAMMPS's numbers of a deck: in SI units, counted from the end where the shock acts."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.deck import leg_commands, set_up
from hertzchain.engines.lammps.reading import FoundDeck, read_deck
from tests.engines.lammps.reading.chains import SCENE, STEP, Deck
from tests.places import ROOT

pytestmark = pytest.mark.lammps

slow = pytest.mark.slow

DIGITS = 1e-12
"""Relative: some operations in double precision, and numbers of 17 digits in the deck."""

MASS = 4 / 3 * math.pi * 4e-3**3 * 2500.0
STIFFNESS = 70e9 * math.sqrt(2 * 4e-3) / (3 * (1 - 0.25**2))


def pulse(time: np.ndarray) -> np.ndarray:
    """The force of ``SCENE``, typed again [N]."""
    inside = (time >= 0) & (time < 4e-5)
    return np.where(inside, 20.0 * np.sin(math.pi * time / 4e-5) ** 2, 0.0)


def command_of(found: FoundDeck, index: int) -> str:
    """A command, as the deck has it."""
    return found.commands[index].written


@pytest.mark.parametrize(
    "deck",
    [
        Deck("cgs", "y", reversed=True),
        pytest.param(Deck("micro", "z", pair="history"), marks=slow),
        pytest.param(Deck("si", "z", reversed=True), marks=slow),
        pytest.param(Deck("nano", "x"), marks=slow),
        pytest.param(Deck("micro", "x", reversed=True), marks=slow),
    ],
    ids=str,
)
def test_every_number_is_found(deck: Deck, tmp_path: Path) -> None:
    found = read_deck(deck.write(tmp_path), SCENE)
    assert (found.units, found.axis, found.reversed) == (deck.units, deck.axis, deck.reversed)
    assert command_of(found, found.first_run) == "run 1000"
    np.testing.assert_allclose(found.radius, 4e-3, rtol=DIGITS)
    np.testing.assert_allclose(found.mass, MASS, rtol=DIGITS)
    np.testing.assert_allclose(found.position, 8e-3 * np.arange(6), rtol=DIGITS, atol=1e-18)
    assert found.ids.tolist() == [1, 2, 3, 4, 5, 6]
    assert set(found.types.tolist()) == {1}
    assert not np.any(found.velocity)
    assert not np.any(found.spin)
    assert not np.any(found.sideways)
    assert found.integrated.tolist() == [1] * 6
    assert found.boundary == "f f f"
    assert found.image_gap is None
    # The law, and no force in a gap.
    assert np.all(found.contact_force[0] == 0)
    assert np.all(found.overlap[0] < 0)
    np.testing.assert_allclose(
        found.contact_force[1:], STIFFNESS * found.overlap[1:] ** 1.5, rtol=1e-11
    )
    np.testing.assert_allclose(
        found.damped_force, STIFFNESS * found.damped_overlap**1.5, rtol=1e-11
    )
    assert np.all(np.abs(found.closing) > 0)
    assert not np.any(found.tangential_force)
    assert not np.any(found.constant_force)
    assert not np.any(found.drag)
    assert found.walls == ()
    # The applied force, at each step of the pulse.
    assert found.applied_every == 1
    np.testing.assert_allclose(
        found.applied_force[:, 0], pulse(found.applied_time), rtol=0, atol=20 * 1e-11
    )
    assert not np.any(found.applied_force[:, 1:])
    assert found.applied_sideways == 0
    assert np.max(np.diff(found.applied_time[found.applied_time < 4e-5])) < 1.01 * STEP
    # The runs, and the peaks of these steps by other code.
    (run,) = found.runs
    assert (run.start, run.steps, run.command) == (0.0, 1000, found.first_run)
    np.testing.assert_allclose([run.dt, found.end_time], [STEP, 1e-4], rtol=DIGITS)
    same = hc.Native(method="velocity-verlet", dt=STEP).run(SCENE)
    np.testing.assert_allclose(found.peak_force, same.peak_force, rtol=1e-6)  # of interpolation
    np.testing.assert_allclose(found.peak_time, same.peak_time, rtol=1e-6)
    assert found.peak_reading_error < 1e-5
    start = 8e-3 * np.arange(6)
    np.testing.assert_allclose(found.final_position - start, same.displacement, rtol=1e-6)
    np.testing.assert_allclose(found.final_velocity, same.velocity, atol=1e-6)
    assert found.image_force < 1e-9
    assert found.remarks == ()
    assert not found.driven.any()
    assert not found.missed_overlap.any()


@pytest.mark.parametrize("units", ["cgs", pytest.param("nano", marks=slow)])
def test_a_deck_is_read_without_a_scene(units: str, tmp_path: Path) -> None:
    path = Deck(units, "y").write(tmp_path)
    found, with_scene = read_deck(path), read_deck(path, SCENE)
    for name in ("radius", "mass", "position", "velocity", "integrated"):
        assert np.array_equal(getattr(found, name), getattr(with_scene, name))
    pressed = found.overlap > 0
    np.testing.assert_allclose(
        found.contact_force[pressed], STIFFNESS * found.overlap[pressed] ** 1.5, rtol=1e-11
    )
    # Pressed by a thousandth of the radius and what DEPTHS makes of it.
    np.testing.assert_allclose(found.overlap[4], 4e-6, rtol=1e-9)
    np.testing.assert_allclose(found.applied_force[:, 0], pulse(found.applied_time), atol=20e-11)
    # Steps between readings follow from contacts at another overlap than the scene's.
    np.testing.assert_allclose(found.peak_force, with_scene.peak_force, rtol=1e-6)
    assert found.stopped == ""


def whole_deck(scene: hc.Scene, dt: float) -> str:
    """Return the commands of the backend as a deck."""
    lines, before = [set_up(scene)], None
    for leg in scene.schedule(dt):
        lines += [*leg_commands(leg, before), f"run {leg.steps}"]
        before = leg
    return "\n".join(lines) + "\n"


CHAIN = SCENE.chain
TERMS = {
    "wall and gravity": hc.Scene(
        replace(CHAIN, granules=5),
        hc.Striker(velocity=0.4),
        hc.Run(end_time=2e-4),
        wall=hc.Wall("rigid"),
        precompression=hc.Precompression(gravity=9.81),
    ),
    "damped, on a wall": hc.Scene(
        replace(CHAIN, granules=4, radius=(4e-3, 3e-3, 4e-3, 5e-3)),
        SCENE.shock,
        hc.Run(end_time=1.5e-4),
        wall=hc.Wall("same"),
        contact=hc.Contact("restitution", restitution=0.7),
    ),
    "squeezed": hc.Scene(
        replace(CHAIN, granules=5),
        SCENE.shock,
        hc.Run(end_time=1e-4),
        precompression=hc.Precompression(force=4.0),
    ),
    "piston": hc.Scene(replace(CHAIN, granules=4), hc.Piston(velocity=0.3), hc.Run(end_time=1e-4)),
}


@pytest.mark.parametrize(
    "name", ["damped, on a wall", *(pytest.param(name, marks=slow) for name in TERMS)]
)
def test_terms_are_found(name: str, tmp_path: Path) -> None:
    scene = TERMS[name]
    deck = tmp_path / "in.mine"
    dt = 0.01 * scene.contact_time
    deck.write_text(whole_deck(scene, dt))
    found = read_deck(deck, scene)
    each = scene.granules
    contacts = len(each.mass) - 1
    first = slice(1 if scene.piston else 0, None)  # a piston's mass is infinite, LAMMPS's is not
    np.testing.assert_allclose(found.mass[first], each.mass[first], rtol=DIGITS)
    np.testing.assert_allclose(found.radius, each.radius, rtol=DIGITS)
    np.testing.assert_allclose(found.position, each.position, rtol=DIGITS, atol=1e-17)
    np.testing.assert_allclose(
        found.contact_force[1:],
        each.stiffness[:contacts] * found.overlap[1:] ** 1.5,
        rtol=1e-10,  # overlaps of 1e-6 radii have so many digits
    )
    np.testing.assert_allclose(
        found.constant_force[first, 0], each.constant_force[first], rtol=DIGITS
    )
    np.testing.assert_allclose(found.velocity[0, 0], scene.start_velocity, rtol=DIGITS)
    assert [wall.end for wall in found.walls] == (["last"] if scene.wall else [])
    if scene.wall:
        (wall,) = found.walls
        touching = each.position[-1] + each.radius[-1] + each.static_overlap[-1] * -1
        np.testing.assert_allclose(wall.position, touching, rtol=DIGITS)
        np.testing.assert_allclose(wall.force, each.stiffness[-1] * wall.overlap**1.5, rtol=1e-9)
        assert found.commands[wall.command].text.startswith("fix wall last wall/gran")
    if scene.contact:
        assert each.damping is not None
        added = (
            found.damped_force
            - each.stiffness[:contacts] * np.maximum(found.damped_overlap, 0) ** 1.5
        )
        law = each.damping[:contacts] * found.damped_overlap**scene.contact.exponent * found.closing
        approach = found.closing > 0
        np.testing.assert_allclose(added[approach], law[approach], rtol=1e-8)
        assert np.all(found.damped_force[-1] == 0)  # no attraction
    same = hc.Lammps(dt=dt).run(scene)
    peaks = [*same.peak_force, *([same.wall_peak_force] if scene.wall else [])]
    np.testing.assert_allclose(found.peak_force, peaks, rtol=2e-5)
    np.testing.assert_allclose(
        found.final_position - found.position, same.displacement, atol=1e-9 * each.radius[0]
    )
    if scene.piston:
        assert found.driven.tolist() == [True, False, False, False]
        np.testing.assert_allclose(
            found.driven_displacement, 0.3 * found.driven_time, rtol=0, atol=1e-15
        )


def applied(more: str, tmp_path: Path, run: str = "run 1000") -> FoundDeck:
    """What is found of a deck with other commands before its run."""
    return read_deck(Deck(more=more, run=run).write(tmp_path), SCENE)


def test_forces_of_all_kinds(tmp_path: Path) -> None:
    found = applied(
        """group last id 6
fix load last addforce -0.5 0 0
fix weight all gravity 10 vector 0 -1 0
fix air all viscous 0.01
unfix push
""",
        tmp_path,
        """run 100
fix push hit addforce v_force 0 0 every 3
run 200
unfix push
variable ramp equal ramp(0,2)
fix sine hit addforce v_ramp 0 0
timestep 2e-7
run 100
unfix sine
run 50""",
    )
    np.testing.assert_allclose(found.constant_force[:, 0], [0, 0, 0, 0, 0, -0.5])
    np.testing.assert_allclose(found.constant_force[:, 1], -10 * MASS, rtol=DIGITS)
    np.testing.assert_allclose(found.drag, 0.01, rtol=1e-9)
    assert [(run.steps, round(run.dt * 1e9), round(run.start * 1e9)) for run in found.runs] == [
        (100, 100, 0), (200, 100, 10_000), (100, 200, 30_000), (50, 200, 50_000),
    ]  # fmt: skip
    time, force = found.applied_time, found.applied_force[:, 0]
    assert np.all(np.diff(time) >= 0)
    assert np.all(force[time < 1e-5] == 0)
    # Every third step alone.
    second = (time > 1.001e-5) & (time < 2.999e-5)
    step = np.round(time[second] / STEP).astype(int)
    assert step.size == 199
    np.testing.assert_allclose(
        force[second], np.where(step % 3 == 0, pulse(step * STEP), 0), rtol=0, atol=1e-9
    )
    third = (time > 3.001e-5) & (time < 4.999e-5)
    np.testing.assert_allclose(force[third], 2 * (time[third] - 3e-5) / 2e-5, rtol=0, atol=1e-9)
    assert np.all(force[time > 5.001e-5] == 0)
    assert time[-1] == pytest.approx(6e-5)
    by_style = {(fix.style, command_of(found, fix.command)[:8]): fix for fix in found.fixes}
    assert {style for style, _ in by_style} == {"nve", "addforce", "gravity", "viscous"}
    load = by_style["addforce", "fix load"]
    assert load.granules.tolist() == [False] * 5 + [True]
    assert load.largest[-1].tolist() == [0.5, 0.0]
    assert not load.moves


@slow
def test_friction_damping_and_gaps_show(tmp_path: Path) -> None:
    rough = "pair_coeff * * hertz/material 1e9 0.2 0.25 tangential mindlin NULL 1.0 0.5"
    found = read_deck(Deck(more=f"{rough}\nset atom 3 x 0.01601").write(tmp_path), SCENE)
    assert np.all(found.tangential_force > 0)
    np.testing.assert_allclose(found.position[2], 0.01601, rtol=DIGITS)
    closing = found.closing > 0
    elastic = STIFFNESS / 70 * found.damped_overlap**1.5
    assert np.all(found.damped_force[closing] > elastic[closing])
    pulled = read_deck(Deck(more=rough.replace("1e9 0.2", "1e9 1e8")).write(tmp_path), SCENE)
    assert np.all(pulled.damped_force[-1] < 0)


@slow
@pytest.mark.parametrize(
    "motion", ["fix a all nve\nfix b hit nve", "group some id 2:6\nfix a some nve"]
)
def test_how_often_granules_are_moved(motion: str, tmp_path: Path) -> None:
    found = read_deck(Deck(motion=motion, steps=10).write(tmp_path), SCENE)
    assert found.integrated.tolist() == [2 if "hit" in motion else 0, 1, 1, 1, 1, 1]


@pytest.mark.parametrize("velocity", ["0", pytest.param("0.1", marks=slow)])
def test_a_granule_from_which_all_forces_are_taken_is_held_or_driven(
    velocity: str, tmp_path: Path
) -> None:
    more = f"group last id 6\nfix hold last setforce 0 0 0\nvelocity last set {velocity} 0 0"
    found = read_deck(Deck(more=more, steps=500).write(tmp_path), SCENE)
    held = velocity == "0"
    assert found.integrated.tolist() == [1, 1, 1, 1, 1, 1 - held]
    assert found.driven.tolist() == [False] * 5 + [not held]


@pytest.mark.parametrize("run", ["run 20", pytest.param("run 0\nrun 20", marks=slow)])
def test_numbers_are_found_where_velocities_of_ghosts_are_missing(run: str, tmp_path: Path) -> None:
    path = tmp_path / "in.mine"
    path.write_text(Deck(run=run).text().replace("comm_modify vel yes\n", ""))
    found = read_deck(path, SCENE)
    assert "velocit" in found.stopped
    np.testing.assert_allclose(
        found.contact_force[1:], STIFFNESS * found.overlap[1:] ** 1.5, rtol=1e-11
    )
    (after,) = found.runs
    assert (after.steps, command_of(found, after.command)) == (20, "run 20")
    np.testing.assert_allclose(
        found.applied_force[:, 0], pulse(found.applied_time), rtol=0, atol=20 * 1e-11
    )
    assert np.all(np.isnan(found.peak_force))


@slow
def test_a_fix_that_replaces_another_needs_no_preparation(tmp_path: Path) -> None:
    """A force that is set again and again, as in a loop over a table."""
    again = "fix push hit addforce {} 0 0\nrun 10 pre no\n"
    deck = Deck(run="run 10\n" + again.format(2.0) + again.format(3.0))
    found = read_deck(deck.write(tmp_path), SCENE)
    later = found.applied_time > 1.001e-6
    assert set(found.applied_force[later, 0].tolist()) == {2.0, 3.0}


@slow
def test_neighbours_that_are_missed_are_found(tmp_path: Path) -> None:
    missed = "set atom 2 x 0.0086\nneighbor 1e-6 bin\nneigh_modify every 5000 delay 5000 check no"
    found = read_deck(Deck(more=missed).write(tmp_path), SCENE)
    assert found.missed_overlap[0] > 1e-6
    assert found.contact_force[-1, 0] > 0


@slow
def test_an_image_across_the_boundary_is_found(tmp_path: Path) -> None:
    deck = Deck().text().replace("boundary f f f", "boundary p f f")
    deck = deck.replace("region box block -0.064 0.064", "region box block -0.004 0.044")
    assert "-0.004 0.044" in deck
    (tmp_path / "in.mine").write_text(deck)
    found = read_deck(tmp_path / "in.mine", SCENE)
    assert found.boundary == "p f f"
    assert found.image_gap == pytest.approx(0, abs=1e-15)
    assert found.image_force > 0.1


NO_PUSH = "unfix push\n"
LAW = "granular hertz 1e9 0 tangential linear_nohistory 0 0"
WALL = f"{NO_PUSH}fix wall all wall/gran {LAW} xplane -0.0041 NULL\n"


@pytest.mark.parametrize(
    ("more", "is_reversed"),
    [
        (f"{WALL}velocity hit set 0.1 0 0", False),
        pytest.param(NO_PUSH, False, marks=slow),
        pytest.param(f"{NO_PUSH}group last id 6\nvelocity last set -1 0 0", True, marks=slow),
        pytest.param(
            f"{NO_PUSH}group last id 6\nfix push last addforce -1 0 0 every 2", True, marks=slow
        ),
        pytest.param(WALL, True, marks=slow),
    ],
)
def test_the_shock_may_be_at_either_end(more: str, is_reversed: bool, tmp_path: Path) -> None:
    """By the force, by the speed of a striker, by the only wall; else granule 1 is the lowest."""
    found = read_deck(Deck(more=more, steps=20).write(tmp_path), SCENE)
    assert found.reversed == is_reversed
    assert found.position[0] == 0
    assert found.position[-1] == pytest.approx(0.04)
    if "velocity" in more:
        assert found.velocity[0, 0] > 0
    assert len(found.walls) == ("wall" in more)
    for wall in found.walls:
        assert wall.end == ("last" if is_reversed else "first")
        place = 0.04 + 4.1e-3 if is_reversed else -4.1e-3
        assert wall.position == pytest.approx(place, rel=1e-9)


@slow
def test_reduced_units_stay_as_they_are(tmp_path: Path) -> None:
    """Diameter 1, mass 1 and a stiffness of 1e6."""
    path = tmp_path / "in.mine"
    path.write_text(
        """units lj
atom_style sphere
comm_modify vel yes
boundary f f f
region box block -2 8 -2 2 -2 2
create_box 1 box
lattice sc 1.0
region beads block 0 5 0 0 0 0 units box
create_atoms 1 region beads
set group all diameter 1.0 density $(6/PI:%.17g)
pair_style granular
pair_coeff * * hertz 1e6 0 tangential linear_nohistory 0 0
fix motion all nve
timestep 1e-4
run 10
"""
    )
    found = read_deck(path, SCENE)
    assert found.units == "lj"
    np.testing.assert_allclose(found.position, np.arange(6), rtol=DIGITS)
    np.testing.assert_allclose(found.mass, 1.0, rtol=DIGITS)
    stiffness = 1e6 * math.sqrt(0.25)
    np.testing.assert_allclose(
        found.contact_force[1:], stiffness * found.overlap[1:] ** 1.5, rtol=1e-11
    )
    # The overlaps are those of the scene, in radii; a coordinate of 5 has so many digits.
    expected = 0.5 * SCENE.units.length / 4e-3
    np.testing.assert_allclose(found.overlap[DEPTH_ONE], expected, rtol=1e-10)


DEPTH_ONE = 4
"""Row of the overlap that is the scene's natural unit of length."""


@slow
@pytest.mark.parametrize(
    "name", ["demo", "terms/striker_on_a_wall", "terms/upright_column", "terms/precompressed"]
)
def test_decks_that_are_written_here(name: str) -> None:
    scene = hc.Scene.from_toml(ROOT / "validation" / "scenes" / f"{name}.toml")
    found = read_deck(ROOT / "lammps_inputs" / f"in.{name.rsplit('/', maxsplit=1)[-1]}", scene)
    each = scene.granules
    contacts = len(each.mass) - 1
    np.testing.assert_allclose(found.mass, each.mass, rtol=DIGITS)
    np.testing.assert_allclose(found.position, each.position, rtol=DIGITS, atol=1e-17)
    np.testing.assert_allclose(
        found.contact_force[1:], each.stiffness[:contacts] * found.overlap[1:] ** 1.5, rtol=1e-10
    )
    exact = hc.Native(rtol=1e-8).run(scene)
    peaks = [*exact.peak_force, *([exact.wall_peak_force] if scene.wall else [])]
    np.testing.assert_allclose(found.peak_force, peaks, rtol=6e-6)  # as the decks say
