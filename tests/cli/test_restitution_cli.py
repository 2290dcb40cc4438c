"""``hertzchain restitution`` as people and scripts meet it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command_line import Command

STRIKER = """
[chain]
granules = 2
radius = "4.75 mm"
young_modulus = "193 GPa"
poisson_ratio = 0.3
density = "7958 kg/m^3"

[striker]
velocity = "1 m/s"
radius = "6 mm"
"""


@pytest.fixture
def striker(tmp_path: Path) -> Path:
    path = tmp_path / "striker.toml"
    path.write_text(STRIKER, encoding="utf-8")
    return path


def test_the_table(hertzchain: Command) -> None:
    done = hertzchain("restitution", 0.8)
    assert (done.status, done.err) == (0, "")
    assert max(map(len, done.out.splitlines())) <= 120
    words = [line.split() for line in done.out.splitlines()]
    assert [line[-3:] for line in words if "tsuji" in line][:2] == [
        ["yes", "0.8534", "0.729231"],
        ["no", "0.8577", "0.717637"],
    ]
    assert "kg/s" not in done.out


def test_a_table_of_what_cannot_be(hertzchain: Command) -> None:
    done = hertzchain("restitution", 0.03)
    assert done.status == 0
    assert "none below 0.263" in done.out
    assert done.out.count("refused") == 2
    assert "none above 0.9846" in hertzchain("restitution", 0.99).out


def test_coefficients_for_the_spheres_of_a_scene(hertzchain: Command, striker: Path) -> None:
    done = hertzchain("restitution", 0.8, "--scene", striker, "--coefficient", 28.6674)
    assert done.status == 0
    (velocity,) = (line for line in done.out.splitlines() if "damping velocity  " in line)
    assert velocity.split()[-4:] == ["yes", "0.8000", "28.6674", "kg/s"]


def test_json(hertzchain: Command, striker: Path) -> None:
    document = hertzchain("restitution", 0.1, "--scene", striker, "--json").json()
    assert document["restitution"] == 0.1
    entries = {(one["option"], one["versions"]): one for one in document["options"]}
    assert len(entries) == len(document["options"]) == 16
    tsuji = entries["damping tsuji", "before 2 Sep 2026"]
    assert tsuji["gives"] == pytest.approx(0.235010, abs=1e-6)  # as tests/decks has it
    assert tsuji["write"] is None
    assert tsuji["why_none"].startswith("restitution = 0.1: is impossible with damping tsuji")
    velocity = entries["damping velocity", "29 Sep 2021 or later"]
    assert velocity["number_is"] == "kg/s"
    assert velocity["gives"] is None
    assert velocity["write"] == pytest.approx(204.9397, rel=1e-6)
