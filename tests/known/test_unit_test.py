"""Unit tests for LAMMPS's own suite: LAMMPS passes them, and another law does not."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.errors import HertzchainError
from hertzchain.known.unit_test import known_motion, unit_test
from tests import scenes
from tests.command_line import Command
from tests.conftest import STEEL, paper_scene

DATE = "Sat Nov 21 12:00:00 2026"


NAMES = ("demo", *scenes.NAMES[::5])
IMPACTS = {
    "striker": hc.Scene(scenes.UNIFORM, hc.Striker(1.0)),
    "two spheres": hc.Scene(hc.Chain(2, **STEEL), hc.Striker(1.0), contact=scenes.RESTITUTION),
}
SCENES = {
    **{name: scenes.load(name) for name in NAMES},
    **{law: replace(paper_scene("cosine", 1.0, 2.0, 20), contact=contact)
       for law, contact in scenes.LAWS.items()},
    **IMPACTS,
}  # fmt: skip


@cache
def text_of(name: str) -> str:
    return unit_test(known_motion(SCENES[name]), name, DATE)


def read(text: str) -> dict[str, str]:
    """Keys and values of the file, as LAMMPS's drivers read them: all of them text."""
    entries = yaml.load(text, yaml.BaseLoader)  # noqa: S506 - nothing but scalars can come of it
    keys = re.findall(r"^(\w+):", text, re.MULTILINE)
    assert keys == [*entries]  # of a key twice PyYAML takes the last
    assert all(isinstance(value, str) for value in entries.values())
    return dict(entries)


def rows(block: str) -> FloatArray:
    return np.array([[float(word) for word in line.split()] for line in block.splitlines()])


def difference(measured: FloatArray, expected: FloatArray) -> float:
    """As the macro EXPECT_FP_LE_WITH_EPS of LAMMPS's tests has it, the largest."""
    smaller = np.minimum(np.abs(measured), np.abs(expected))
    return float(np.max(np.abs(measured - expected) / np.where(smaller == 0, 1.0, smaller)))


def drive(text: str, newton: str) -> float:
    """Run a file as LAMMPS's test driver does; return its largest difference."""
    config = read(text)
    differences = []
    with engine() as lammps:
        for line in config["prerequisites"].splitlines():
            kind, style = line.split()
            assert style in lammps.available_styles(kind)

        def state(name: str) -> FloatArray:
            order = np.argsort(lammps.numpy.extract_atom("id")[: lammps.get_natoms()])
            return np.array(lammps.numpy.extract_atom(name))[order]

        command(lammps, f"newton {newton}\nvariable input_dir index .")
        for line in config["variables"].splitlines():
            name, value = line.split(None, 1)
            command(lammps, f"variable {name} index {value}")
        command(lammps, config["pre_commands"])
        command(lammps, f"pair_style {config['pair_style']}")
        for line in config["pair_coeff"].splitlines():
            command(lammps, f"pair_coeff {line}")
        command(lammps, config["post_commands"])
        command(lammps, "run 0 post no")
        assert lammps.get_natoms() == int(config["natoms"])
        differences.append(difference(state("f"), rows(config["init_forces"])[:, 1:]))
        for segment, steps in enumerate(config["run_segments"].split()):
            command(lammps, f"run {steps} post no")
            for name, key in (("x", "run_pos"), ("v", "run_vel")):
                expected = rows(config[key])
                expected = expected[expected[:, 0] == segment]
                assert expected[:, 1].tolist() == list(range(1, int(config["natoms"]) + 1))
                differences.append(difference(state(name), expected[:, 2:]))
        differences.append(difference(state("f"), rows(config["run_forces"])[:, 1:]))
    return max(differences)


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("name", "newton"),
    [*((name, "on") for name in SCENES), *((name, "off") for name in NAMES)],
)
def test_lammps_passes(name: str, newton: str) -> None:
    """Impacts are cut down to what collides."""
    text = text_of(name)
    config = read(text)
    # Half of it is left for machines that round otherwise.
    assert drive(text, newton) <= 0.5 * float(config["epsilon"])
    if name in IMPACTS:
        assert int(config["natoms"]) == (3, 2)[list(IMPACTS).index(name)]


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("demo", "poisson 0.3", "poisson 0.3000001"),
        ("demo", "emod 193000000000.0", "emod 193000010000.0"),
        ("demo", "dens 7958.0", "dens 7958.001"),
        ("demo", " 0.0 ${poisson}", " 1.0 ${poisson}"),
        ("demo", "0.0 0.0\nrun_segments", "0.0 0.0 damping tsuji\nrun_segments"),
        ("demo", "hertz/material ${emod} 0.0 ${poisson}", "hooke 1e7 0.0"),
        ("demo", "hertz/material ${emod} 0.0 ${poisson}", "jkr ${emod} 0.0 ${poisson} 1e-3"),
        ("restitution", "damp 0.8", "damp 0.80001"),
        ("restitution", "coeff_restitution", "tsuji"),
        ("dashpot", "damp 5.0", "damp 5.0001"),
        ("dashpot", "damping velocity", "damping mass_velocity"),
        ("striker", "dens 7958.0", "dens 7958.001"),
        ("two spheres", "damp 0.8", "damp 0.80001"),
    ],
)
def test_another_law_fails(name: str, right: str, wrong: str) -> None:
    text = text_of(name)
    assert right in text
    assert drive(text.replace(right, wrong), "on") > float(read(text)["epsilon"])


def pushed(granules: int, force: float, momentum_ratio: float) -> hc.Scene:
    pulse = hc.Pulse("cosine", force, 2.0, momentum_ratio=momentum_ratio)
    return hc.Scene(hc.Chain(granules, **STEEL), pulse)


EIGHT, UNSUPPORTED = scenes.EIGHT, "a unit test for LAMMPS does not support "


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (hc.Scene(EIGHT, hc.Piston(0.1)), UNSUPPORTED),
        (hc.Scene(EIGHT, hc.Striker(1.0, radius=8e-3)), UNSUPPORTED),
        (hc.Scene(EIGHT, hc.Striker(1.0), wall=scenes.RIGID), UNSUPPORTED),
        (pushed(60, 1e-9, 1.0), "harder shock"),  # too weak for coordinates
        (pushed(600, 100.0, 300.0), "granules are pressed at once"),
    ],
)
def test_what_no_test_can_have_is_refused(scene: hc.Scene, said: str) -> None:
    with pytest.raises(HertzchainError, match=said):
        known_motion(scene)


def test_the_file_gives_raw_material_and_full_digits() -> None:
    chain, text = scenes.load("demo").chain, text_of("demo")
    assert repr(chain.contact_stiffness) not in text
    assert repr(chain.granule_mass) not in text
    start = known_motion(scenes.load("demo")).start
    for pattern, values in (
        (r"create_atoms 1 single (\S+) 0.0 0.0 units box", start.position),
        (r"set atom \d+ vx (\S+)", start.velocity),
    ):
        assert [float(number) for number in re.findall(pattern, text)] == values.tolist()


def test_the_command(tmp_path: Path, hertzchain: Command) -> None:
    file, out = scenes.FOLDER / "demo.toml", tmp_path / "dem02-chain.yaml"
    printed = hertzchain("unit-test", file).out
    assert hertzchain("unit-test", file, "-o", out).status == 0
    texts = [re.sub("date_generated: .*", "", text) for text in (printed, out.read_text())]
    assert texts[0] == texts[1]
    assert read(texts[1])["natoms"] == read(text_of("demo"))["natoms"]
