"""Decks for LAMMPS need all of their lines; errors of its runs are within their bounds.

What is true comes from an independent solver: order 8, steps that end at contacts, 80 bits.
"""

from __future__ import annotations

import functools
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
from hertzchain.observables.peaks import largest_difference
from tests import scenes
from tests.conftest import STEEL, paper_scene
from tests.oracles.bounds import lasting
from validation.random_scenes import random_hard_scene

pytestmark = pytest.mark.lammps

GAPS = hc.Scene(
    hc.Chain(5, gap=1e-6, **STEEL),
    hc.Striker(1.0),
    contact=hc.Contact("dashpot", coefficient=500.0),
)
TRUE = np.array([500.0, 185.783452, 119.598186, 90.111754])  # each to 5e-9
LATE_BLOW = hc.Scene(
    hc.Chain(
        4,
        radius=(0.003314703394290296, *[0.0024408153634609014] * 2, 0.006359322660300662),
        young_modulus=(1329227108153.9133, *[163518955910.85895] * 2, 281952189320.8835),
        poisson_ratio=-0.337842832621993,
        density=(1009.6438934095372, *[7490.333982665544] * 2, 13764.554246927562),
        gap=(0.0, *[3.416938455569586e-07] * 3),
    ),
    hc.Pulse("triangular", 0.3216736092781682, 4.290700253765737, rise_time=0.0001785312076816918),
    hc.Run(0.004585358584143651),
    hc.Wall("elastic", 3507151349.8010793, 0.1870779367935715, gap=5.798022907763981e-09),
)
"""The first contact is pressed hardest by a blow that long steps make lower than the first."""


@functools.cache
def truth(scene: hc.Scene) -> hc.Result:
    return hc.Native(rtol=1e-9).run(scene)


TWO_GAPS = hc.Scene(
    hc.Chain(3, gap=3e-7, **STEEL),
    hc.Striker(1.0),
    contact=hc.Contact("dashpot", coefficient=100.0),
)
FLYING = random_hard_scene(np.random.default_rng([7, 1, 20047]), 30, 200.0, is_damped=True)
EXTRAPOLATED = hc.Lammps(rtol=3e-3, extrapolated=True, wanted="all")


@pytest.mark.parametrize(
    ("scene", "lammps", "least"),
    [
        *((GAPS, hc.Lammps(rtol=rtol), 0.0) for rtol in (1e-2, 3e-3)),
        (GAPS, hc.Lammps(rtol=1e-2, extrapolated=True), 0.0),
        *(
            pytest.param(GAPS, hc.Lammps(rtol=1e-3, extrapolated=e), 0.0, marks=pytest.mark.slow)
            for e in (False, True)
        ),
        # The error of a contact that closes within a step does not follow a power of the step.
        (lasting(TWO_GAPS), EXTRAPOLATED, 1e-4),
        # Three extrapolations within a fifth of the error of the last, 1.0014 of the bound once.
        (FLYING, hc.Lammps(rtol=3.35e-3, extrapolated=True), 7e-4),
        *(
            (LATE_BLOW, hc.Lammps(dt, rtol=1 - 1e-9, extrapolated=extrapolated), 5e-3)
            for dt in (6.346564384108137e-07, 4.2e-7)
            for extrapolated in (False, True)
        ),
    ],
)
def test_errors_are_within_their_bounds(scene: hc.Scene, lammps: hc.Lammps, least: float) -> None:
    """Errors of which runs by chance say little are large, and stated."""
    result = lammps.run(scene)
    error = largest_difference(result.peak_force, truth(scene).peak_force)
    assert least < error < result.error_estimate < lammps.rtol


HUMPS = paper_scene("cosine-triangular", 5.425196514608131, 1.3663508430610825, 29)
"""Contact 4 is pressed nearly as hard twice, and its half is reached where the force is flat."""


@pytest.mark.parametrize(
    "backend",
    [
        *(
            hc.Native("velocity-verlet", step * HUMPS.contact_time, wanted="first")
            for step in (0.0907, 0.12)
        ),
        # All runs take the one hump for the higher one, which it is not without errors by steps.
        hc.Lammps(rtol=5.4e-3, extrapolated=True, wanted="first"),
    ],
)
def test_first_pulses_are_within_their_bounds(backend: hc.Native | hc.Lammps) -> None:
    first, true = (each.run(HUMPS) for each in (backend, hc.Native(rtol=1e-9, wanted="first")))
    clear = first.first_pulses.is_clear & true.first_pulses.is_clear
    assert clear.sum() > 20
    for name, relative in (("force", True), ("arrival", False), ("width", False)):
        values, truth = (getattr(each.first_pulses, name)[clear] for each in (first, true))
        off = np.abs(values - truth) / (truth if relative else 1.0)
        error = getattr(first.errors, "first" if relative else name)[clear]
        steady = np.isfinite(error)
        assert np.all(off[steady] < error[steady])


def test_the_truth_is_that_of_another_solver() -> None:
    assert truth(GAPS).peak_force == pytest.approx(TRUE, rel=1e-8)


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
