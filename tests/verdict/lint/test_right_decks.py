"""Lint on decks that are right: those shipped, and those generated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.decks.layout import KnownAnswer, Layout
from hertzchain.decks.standalone import standalone
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.verdict.lint.deck import Finding
from hertzchain.verdict.lint.rules import lint_file
from tests import scenes
from tests.conftest import STEEL
from tests.places import ROOT
from tests.verdict.lint.test_lint import CLEAN, ROOM, lint

SHIPPED = sorted((ROOT / "lammps_inputs").glob("in.*"))

MEANT = {
    "in.damped": ["damping"],
    "in.damped_striker_on_a_wall": ["damping"] * 4,
    "in.gapped": ["not-touching"],
}
"""Findings in shipped decks whose granules are apart, pressed or damped on purpose."""


@pytest.mark.lammps
@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.slow] * (p.name != "in.demo")) for p in SHIPPED],
    ids=lambda path: path.name,
)
def test_nothing_else_is_said_of_shipped_decks(path: Path) -> None:
    assert [finding.rule for finding in lint_file(path)] == MEANT.get(path.name, [])


def generated(scene: hc.Scene, watch_every: int, pair_style: str = "granular") -> str:
    """Return a deck of a scene; its expected peaks do not matter here."""
    layout = Layout(0.05, watch_every, pair_style, dump_every=20 * watch_every)
    ones = np.ones(scene.chain.granules - 1)
    known = KnownAnswer(ones, 1e-3 * ones) if watch_every else None
    return standalone(scene, layout, known)


@pytest.mark.parametrize("watch_every", [0, 2])
@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize(
    "name", ["demo", *(pytest.param(k, marks=pytest.mark.slow) for k in scenes.NAMES[::4])]
)
def test_nothing_is_said_of_generated_decks(name: str, pair_style: str, watch_every: int) -> None:
    assert lint(generated(scenes.load(name), watch_every, pair_style)) == []


@pytest.mark.parametrize(
    "radius", [1e-6, 50.0, *(pytest.param(r, marks=pytest.mark.slow) for r in (1e-4, 0.3))]
)
def test_nothing_is_said_of_generated_decks_of_any_size(radius: float) -> None:
    size = radius / STEEL["radius"]  # of similar scenes: as many steps
    times, forces = np.array([0.0, 1e-5, 2e-5, 5e-5]), np.array([10.0, 40.0, 100.0, 30.0])
    pulse = hc.PulseTable(tuple(size * times), tuple(size**2 * forces))
    scene = hc.Scene(hc.Chain(10, **{**STEEL, "radius": radius}), pulse)
    assert lint(generated(scene, 1)) == []


def test_a_chain_far_from_its_images_may_be_periodic() -> None:
    def in_a_box(x: float, y: float, flat: bool = False) -> list[Finding]:
        z = "-1e-4 1e-4" if flat else "-0.1 0.1"
        box = f"$(-{x}*v_R) $(2*v_R*v_N+{x}*v_R) $(-{y}*v_R) $({y}*v_R) {z}"
        text = CLEAN.replace("boundary f f f", "dimension 2\n" * flat + "boundary p p p")
        text = text.replace("lattice sc", "lattice sq") if flat else text
        return lint(text.replace(f"$(-2*v_R) $(2*v_R*(v_N+1)) {ROOM}", box))

    assert in_a_box(3, 3) == []
    assert [finding.text[:13] for finding in in_a_box(3, 2)] == ["y is periodic"]
    assert [finding.text[:13] for finding in in_a_box(1, 3)] == ["x is periodic"]
    # Of flat decks LAMMPS wants it in z.
    assert in_a_box(3, 3, flat=True) == []
    assert [finding.text[:13] for finding in in_a_box(3, 2, flat=True)] == ["y is periodic"]


@pytest.mark.slow
def test_a_deck_that_follows_a_long_table_is_read_in_seconds() -> None:
    times = np.linspace(0, 1e-4, 501)
    table = hc.PulseTable(tuple(times), tuple(100 * np.sin(np.pi * times / 1e-4) ** 2))
    scene = hc.Scene(hc.Chain(10, **STEEL), table)
    assert lint(generated(scene, 1)) == []


def test_a_wall_whose_stiffness_is_given_may_be_rigid() -> None:
    law = "hertz 2.8e11 0.0 tangential linear_nohistory 0.0 0.0"
    wall = f"fix motion all nve\nfix wall all wall/gran granular {law} xplane NULL $(2*v_R*v_N-v_R)"
    assert lint(CLEAN.replace("fix motion all nve", wall)) == []
