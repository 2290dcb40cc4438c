"""Damped contacts, pistons and sines: LAMMPS decks that judge themselves."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.decks.known_answer import deck_step, known_answer, lay_out, looked_at
from hertzchain.decks.standalone import standalone
from hertzchain.engines.native.damped_verlet import simulate_damped_verlet
from hertzchain.observables.peaks import largest_difference
from tests.conftest import STEEL
from tests.decks.test_standalone_deck import peaks, run, verdict, written
from tests.decks.test_terms import slow_but
from tests.engines.native.test_terms import DIMER, PULSE
from tests.oracles.sampled_maxima import sampled_maxima

RTOL = 1e-3
"""What the steps of these decks may cost the peaks: two to ten thousand steps."""

CHAIN = hc.Chain(8, **STEEL)
RESTITUTION = hc.Contact("restitution", restitution=0.8)
VISCOELASTIC = hc.Contact("viscoelastic", relaxation_time=1e-6)
LOAD, RIGID = hc.Precompression(10.0), hc.Wall("rigid")

SCENES = {
    "restitution": hc.Scene(CHAIN, PULSE, contact=RESTITUTION),
    "restitution, wall": hc.Scene(CHAIN, hc.Striker(1.0), wall=RIGID, contact=RESTITUTION),
    "restitution that no old LAMMPS has": hc.Scene(
        CHAIN, PULSE, contact=hc.Contact("restitution", restitution=0.1)
    ),
    "attraction": hc.Scene(
        CHAIN, PULSE, contact=hc.Contact("restitution", restitution=0.6, attraction=True)
    ),
    "viscoelastic": hc.Scene(
        DIMER,
        hc.Striker(0.5, radius=6e-3),
        wall=hc.Wall("elastic", 70e9, 0.33),
        precompression=hc.Precompression(3.0, 9.81),
        contact=VISCOELASTIC,
    ),
    "dashpot": hc.Scene(
        replace(CHAIN, gap=1e-6),
        hc.Striker(1.0),
        wall=hc.Wall("same", gap=1e-6),
        contact=hc.Contact("dashpot", coefficient=5.0),
    ),
    "piston": hc.Scene(CHAIN, hc.Piston(0.1)),
    "piston by a table": hc.Scene(
        CHAIN, hc.Piston(None, (1e-5, 1e-4, 2e-4), (0.0, 1e-5, 5e-6)), wall=RIGID
    ),
    "damped piston": hc.Scene(
        CHAIN,
        hc.Piston(0.1),
        wall=hc.Wall("same"),
        precompression=hc.Precompression(5.0, 9.81),
        contact=VISCOELASTIC,
    ),
    "sine": hc.Scene(CHAIN, hc.Sine(5.0, 8e3, 2), precompression=LOAD),
    "damped sine": hc.Scene(CHAIN, hc.Sine(5.0, 8e3, 2), precompression=LOAD, contact=RESTITUTION),
}


@pytest.mark.lammps
@pytest.mark.parametrize("name", slow_but(("restitution", "damped piston"), SCENES))
def test_every_scene_passes(name: str, tmp_path: Path) -> None:
    scene = SCENES[name]
    path = written(scene, tmp_path, RTOL)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen
    assert "WARNING" not in screen
    layout = lay_out(scene, rtol=RTOL)
    expected = sampled_maxima(scene, layout.step, layout.watch_every) * scene.units.force
    found = peaks(tmp_path)
    # Round-off of absolute coordinates; 7e-11 measured with damping.
    assert largest_difference(found, expected) < 1e-8


# Peaks of steps for RTOL, 1e-3: mistakes are larger where they move peaks by less than that.
MISTAKES = {
    "another e": ("restitution", r'(variable restitution string 0\.8)"', r'\g<1>001"'),
    "another damping": ("restitution", r"coeff_restitution", "tsuji"),
    "no damping": ("restitution", r"damping \$\{damping\}", "damping velocity"),
    "coefficient": ("dashpot", r"(pair_coeff 1 1 hertz \S+ 5)\.0", r"\1.5"),
    "damping that grows with masses": ("dashpot", r"(pair_coeff .*) velocity", r"\1 mass_velocity"),
    "relaxation time": ("viscoelastic", r"(pair_coeff 1 2 \S+ \S+ \$\(1\.5\*1)e", r"\1.1e"),
    "a wall without damping": ("viscoelastic", r"(granular hertz \S+) \S+ (tan)", r"\1 0.0 \2"),
    "step": ("restitution", r"timestep (\S+)", r"timestep $(1.5*\1:%.17g)"),
    "wrong neighbour's velocity": ("restitution", r"(speed_ahead all global/atom v_)next", r"\1id"),
    "no true peak": (
        "restitution",
        r"(variable known_true atom \"[^\"]*\(id==3\)\*0\.\d)",
        r"\g<1>9",
    ),
    "velocity of the piston": ("piston", r"(move linear 0\.1)", r"\g<1>01"),
    "stroke": ("piston by a table", r"(fix piston first move linear )-", r"\1"),
    "amplitude": ("damped sine", r"(force equal 0\.0\+5)\.0", r"\1.05"),
}

QUICK_MISTAKES = ("coefficient", "step")


@pytest.mark.lammps
@pytest.mark.parametrize("mistake", slow_but(QUICK_MISTAKES, MISTAKES))
def test_a_mistake_in_a_deck_fails(mistake: str, tmp_path: Path) -> None:
    name, right, wrong = MISTAKES[mistake]
    path = written(SCENES[name], tmp_path, RTOL)
    text, count = re.subn(right, wrong, path.read_text())
    assert count >= 1
    path.write_text(text)
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (1, "FAIL"), screen


@pytest.mark.parametrize("name", ["restitution", "attraction"])
def test_contacts_pull_where_the_scene_says_so(name: str, tmp_path: Path) -> None:
    """Where they may not, every line with damping has the limit: peaks alone hardly show it."""
    lines = written(SCENES[name], tmp_path, RTOL).read_text().splitlines()
    damped = [line for line in lines if "damping ${damping}" in line]
    assert damped
    is_limited = SCENES[name].contact is RESTITUTION
    assert all(("limit_damping" in line) == is_limited for line in damped)


@pytest.mark.lammps
def test_the_damping_for_older_lammps_is_as_much(tmp_path: Path) -> None:
    path = written(SCENES["restitution"], tmp_path, RTOL)
    text = path.read_text()
    assert text.count('"$(version) >= 20240829"') == 1
    path.write_text(text.replace('"$(version) >= 20240829"', '"1 == 0"'))
    status, screen = run(path, tmp_path)
    assert (status, verdict(screen)) == (0, "PASS"), screen


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("name", "first", "since"),
    [
        ("restitution, wall", "20230802", "2 Aug 2023"),
        ("restitution that no old LAMMPS has", "20240829", "29 Aug 2024"),
    ],
)
def test_a_lammps_that_is_too_old_is_refused(
    name: str, first: str, since: str, tmp_path: Path
) -> None:
    scene = SCENES[name]
    text = standalone(scene, lay_out(scene, rtol=RTOL, watch_every=0))
    assert f"for LAMMPS of {since} and later" in " ".join(text.replace("\n#", "").split())
    path = tmp_path / "in.chain"
    path.write_text(text.replace(f"$(version) < {first}", f"$(version) < 99{first}"))
    status, screen = run(path, tmp_path)
    assert status == 2
    assert f"This damping needs LAMMPS of {since} or later" in screen


@pytest.mark.parametrize("name", ["restitution", "dashpot"])
def test_what_looks_can_find_is_what_they_do_find(name: str) -> None:
    # Wherever the looks fall, the maxima of samples lie between the peak and the least of it.
    # Readings 0.1 natural time units apart cost the peak 7e-7, in the worst of 80 random scenes.
    scene = SCENES[name]
    true = simulate_damped_verlet(scene, scene.schedule(0.005 * scene.units.time)).peaks.force
    for watch_every in (3, 20):
        peak, least = looked_at(scene, 0.005, watch_every)
        assert largest_difference(peak, true) < 1e-6
        for every in (1, watch_every - 1, watch_every):
            sampled = sampled_maxima(scene, 0.005, every)
            assert np.all(sampled <= peak * (1 + 1e-6))
            assert np.all(sampled >= least)


def test_steps_of_damped_contacts_are_by_default_for_a_smaller_accuracy() -> None:
    scene = SCENES["viscoelastic"]
    assert deck_step(scene) == deck_step(scene, rtol=1e-4)
    elastic = replace(scene, contact=None)
    assert deck_step(elastic) == deck_step(elastic, rtol=1e-6)


@pytest.mark.parametrize("rtol", [1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
def test_the_step_is_one_for_the_wanted_accuracy(rtol: float) -> None:
    # First-order errors are erratic where contacts begin at a speed; 0.3 to 0.9 measured.
    for name in ("restitution", "viscoelastic", "dashpot"):
        scene = SCENES[name]
        known = known_answer(scene, lay_out(scene, rtol=rtol))
        assert 0.2 * rtol < known.largest_error < 1.5 * rtol, name
