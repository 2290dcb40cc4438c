"""Scenes with every term, shipped here and random: each answer is within its bound, or refused.

Another solver is the judge, and momentum and energy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.verdict.run_checks import balance_checks
from tests.engines.native.test_damped import LAWS, scene_with
from tests.engines.native.test_shocks import (
    DAMPED_PISTONS,
    FIXED,
    LOCAL,
    NEAR_WALL,
    PISTONS,
    SINES,
)
from tests.engines.native.test_terms import FLIGHTS
from tests.engines.native.test_terms import SCENES as TERMS
from tests.oracles import extrapolation
from tests.oracles.bounds import (
    at_three_accuracies,
    by_methods,
    check_answers,
    check_short,
    lasting,
)
from validation.random_drives import random_scene_with_piston, random_scene_with_sine
from validation.random_scenes import (
    damped,
    pushed_within,
    random_damped_scene,
    random_scene_with_terms,
    thrown,
    with_fixed,
    with_near_wall,
    with_wall_of_its_own,
)

DASHPOT = hc.Contact("dashpot", coefficient=20.0)
PULLING = hc.Contact("dashpot", coefficient=2.0, attraction=True)


def with_law(scenes: dict[str, hc.Scene], law: hc.Contact, *names: str) -> dict[str, hc.Scene]:
    """Scenes with damped contacts: those of these names, by default all."""
    return {name: replace(scenes[name], contact=law) for name in names or scenes}


KINDS = {
    # Others have the terms of these.
    "terms": {name: TERMS[name] for name in TERMS if name not in ("dimer", "gaps")},
    "flights": FLIGHTS,
    "flights, damped": with_law(FLIGHTS, DASHPOT),
    "local": LOCAL,
    "fixed": FIXED,
    "near wall": NEAR_WALL,
    "all terms": {name: scene_with(law) for name, law in LAWS.items()},
    "piston": PISTONS,
    "piston, damped": with_law(
        PISTONS, LAWS["restitution"], "constant velocity", "backwards alone", "gaps, wall"
    ) | DAMPED_PISTONS,
    "piston, pulling": with_law(PISTONS, PULLING, "forwards and backwards", "column"),
    "sine": SINES,
    "sine, damped": with_law(
        SINES, LAWS["viscoelastic"], "as strong as the load", "above the cut-off, wall"
    ),
}  # fmt: skip
BY_METHODS = [
    *(("piston", name) for name in ("forwards and backwards", "gaps, wall")),
    ("sine", "as strong as the load"),
]
"""Drives that are judged by every method, too."""


@pytest.mark.parametrize(
    ("kind", "name"), [(kind, name) for kind, scenes in KINDS.items() for name in scenes]
)
def test_peaks_and_velocities(kind: str, name: str) -> None:
    scene = lasting(KINDS[kind][name])
    asked = at_three_accuracies()
    if (kind, name) in BY_METHODS:
        asked += by_methods(scene)
    found = check_answers(scene, asked)
    assert len(found) == len(asked)
    true = extrapolation.peaks(scene).velocity[scene.first_granule :]
    # After many collisions; 3e-9 seen.
    largest = np.max(np.abs(true))
    assert found[2].velocity == pytest.approx(true, rel=0, abs=1e-8 * largest)
    # Those that a comparison has: the velocities of other runs have errors of their own.
    balances = balance_checks(hc.Native("reference").run(scene))
    assert [check for check in balances if not check.passed] == []


Draw = Callable[[np.random.Generator, int], hc.Scene]


def _mixed(rng: np.random.Generator, number: int) -> hc.Scene:
    draw = random_damped_scene if number % 3 == 0 else random_scene_with_terms
    return draw(rng, 12, 200.0)


def _local(rng: np.random.Generator, number: int) -> hc.Scene:
    scene = pushed_within(rng, _mixed(rng, number))
    return thrown(rng, scene) if number % 4 == 0 else scene


def _fixed(rng: np.random.Generator, number: int) -> hc.Scene:
    scene = _mixed(rng, number)
    if number % 4 < 2:
        scene = (thrown, pushed_within)[number % 4](rng, scene)
    return with_fixed(rng, scene)


def _near_wall(rng: np.random.Generator, number: int) -> hc.Scene:
    changed = (with_fixed, pushed_within, thrown, lambda _, same: same)[number % 4]
    return with_near_wall(rng, changed(rng, _mixed(rng, number)))


def _piston(rng: np.random.Generator, _: int) -> hc.Scene:
    return random_scene_with_piston(rng, 12, 250.0)


def _sine(rng: np.random.Generator, _: int) -> hc.Scene:
    return random_scene_with_sine(rng, 12, 250.0)


@dataclass(frozen=True)
class Kind:
    """Scenes of one kind: their seed, how they are drawn, the quick ones, how many there are."""

    seed: int
    draw: Draw
    quick: Sequence[int]
    count: int


RANDOM = {
    "terms": Kind(8, lambda rng, _: random_scene_with_terms(rng, 15, 600.0), (0, 7, 9), 300),
    "damped": Kind(13, lambda rng, _: random_damped_scene(rng, 12, 60.0), range(45, 53), 300),
    "wall": Kind(39, lambda rng, _: with_wall_of_its_own(rng, random_damped_scene(rng, 12, 200.0)),
                 range(7, 10), 0),
    "piston": Kind(19, _piston, (1, 2), 200),
    "piston, damped": Kind(19, lambda rng, n: damped(rng, _piston(rng, n)), (1, 2), 200),
    "sine": Kind(19, _sine, (1, 2), 200),
    "sine, damped": Kind(19, lambda rng, n: damped(rng, _sine(rng, n)), (1, 2), 200),
    "moving": Kind(37, lambda rng, n: thrown(rng, _mixed(rng, n)), range(4), 96),
    "local": Kind(376, _local, range(4), 156),
    "fixed": Kind(375, _fixed, range(4), 156),
    "near wall": Kind(373, _near_wall, range(4), 156),
}  # fmt: skip


def judge(name: str, number: int) -> None:
    kind = RANDOM[name]
    scene = kind.draw(np.random.default_rng([kind.seed, number]), number)
    if name in ("moving", "local", "fixed", "near wall"):
        check_short(scene)
        return
    asked = at_three_accuracies()
    if name == "terms" and (number in kind.quick or number % 5 == 0):
        asked += by_methods(scene, ("velocity-verlet", "rk4", "reference"))
    check_answers(scene, asked)


@pytest.mark.parametrize(
    ("name", "number"), [(name, number) for name, kind in RANDOM.items() for number in kind.quick]
)
def test_random_scenes(name: str, number: int) -> None:
    judge(name, number)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "first"),
    [(name, first) for name, kind in RANDOM.items() for first in range(0, kind.count, 10)],
)
def test_many_random_scenes(name: str, first: int) -> None:
    for number in range(first, min(first + 10, RANDOM[name].count)):
        judge(name, number)
