"""The commands of the backend: their text, and the need for each of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.deck import leg_commands, set_up
from hertzchain.engines.lammps.dialect import PAIR_STYLES
from hertzchain.engines.lammps.engine import command, engine
from tests import scenes
from tests.conftest import STEEL


def whole_deck(scene: hc.Scene, dt: float, pair_style: str = "granular") -> str:
    """All that the backend gives LAMMPS, and the final state in a file."""
    lines, before = [set_up(scene, pair_style)], None
    for leg in scene.schedule(dt):
        lines += [*leg_commands(scene, leg, before), f"run {leg.steps}"]
        before = leg
    final = "write_dump all custom chain.final id x vx fx modify sort id format float %.17g"
    return "\n".join([*lines, final]) + "\n"


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
@pytest.mark.parametrize(
    "pair_style",
    [
        "granular",
        *(pytest.param(s, marks=pytest.mark.slow) for s in PAIR_STYLES if s != "granular"),
    ],
)
def test_every_line_of_the_deck_is_needed(
    pair_style: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Removing any line gives an error, a warning, another motion or no output.

    Without the skin, which saves time, LAMMPS takes its own.
    """
    monkeypatch.chdir(tmp_path)
    # Few granules: those of 1 m, which come of a missing line, all touch and take half a minute.
    demo = scenes.load("demo")
    scene = replace(demo, chain=replace(demo.chain, granules=12))
    lines = logical_lines(whole_deck(scene, 0.05 * scene.units.time, pair_style))
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
    assert idle == [line for line in lines if line.startswith("neighbor ")]


@pytest.mark.lammps
def test_small_granules_have_one_neighbour_ahead(tmp_path: Path) -> None:
    # The skin of LAMMPS in SI units, 1 mm, would give them nine more.
    pulse = hc.Pulse("cosine", 1e-3, 2.0, momentum_ratio=1.0)
    scene = hc.Scene(hc.Chain(20, **{**STEEL, "radius": 5e-5}), pulse)
    log = tmp_path / "log.lammps"
    with engine() as lammps:
        command(lammps, f"log {log}\n{whole_deck(scene, scene.end_time / 100)}log none")
    assert set(re.findall(r"Total # of neighbors = (\d+)", log.read_text())) == {"19"}
