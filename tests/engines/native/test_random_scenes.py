"""Random scenes of every kind: each answer is within its own bound, or refused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

import hertzchain as hc
from tests.oracles.bounds import at_three_accuracies, by_methods, check_answers, check_short
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


KINDS = {
    "terms": Kind(8, lambda rng, _: random_scene_with_terms(rng, 15, 600.0), (0, 5, 7, 9, 10), 300),
    "damped": Kind(13, lambda rng, _: random_damped_scene(rng, 12, 60.0), range(45, 60), 300),
    "wall": Kind(39, lambda rng, _: with_wall_of_its_own(rng, random_damped_scene(rng, 12, 200.0)),
                 range(7, 12), 0),
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
    kind = KINDS[name]
    scene = kind.draw(np.random.default_rng([kind.seed, number]), number)
    if name in ("moving", "local", "fixed", "near wall"):
        check_short(scene)
        return
    asked = at_three_accuracies()
    if name == "terms" and (number in kind.quick or number % 5 == 0):
        asked += by_methods(scene, ("velocity-verlet", "rk4", "reference"))
    check_answers(scene, asked)


@pytest.mark.parametrize(
    ("name", "number"), [(name, number) for name, kind in KINDS.items() for number in kind.quick]
)
def test_random_scenes(name: str, number: int) -> None:
    judge(name, number)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "first"),
    [(name, first) for name, kind in KINDS.items() for first in range(0, kind.count, 10)],
)
def test_many_random_scenes(name: str, first: int) -> None:
    for number in range(first, min(first + 10, KINDS[name].count)):
        judge(name, number)
