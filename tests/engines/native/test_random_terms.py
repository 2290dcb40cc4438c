"""Random scenes that mix further terms with all others: each answer is within its own bound."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import hertzchain as hc
from tests.oracles.bounds import check_short
from validation.random_scenes import (
    pushed_within,
    random_damped_scene,
    random_scene_with_terms,
    thrown,
    with_fixed,
    with_near_wall,
)

Change = Callable[[np.random.Generator, hc.Scene, int], hc.Scene]


def _local(rng: np.random.Generator, scene: hc.Scene, number: int) -> hc.Scene:
    scene = pushed_within(rng, scene)
    return thrown(rng, scene) if number % 4 == 0 else scene


def _fixed(rng: np.random.Generator, scene: hc.Scene, number: int) -> hc.Scene:
    if number % 4 == 0:
        scene = thrown(rng, scene)
    return with_fixed(rng, pushed_within(rng, scene) if number % 4 == 1 else scene)


def _near_wall(rng: np.random.Generator, scene: hc.Scene, number: int) -> hc.Scene:
    changed = (with_fixed, pushed_within, thrown, lambda _, same: same)[number % 4]
    return with_near_wall(rng, changed(rng, scene))


KINDS: dict[str, tuple[int, int, Change]] = {
    "moving": (37, 96, lambda rng, scene, _: thrown(rng, scene)),
    "local": (376, 156, _local),
    "fixed": (375, 156, _fixed),
    "near wall": (373, 156, _near_wall),
}
"""Seed, how many scenes, and the change of a random one."""


def judge(kind: str, number: int) -> None:
    seed, _, changed = KINDS[kind]
    rng = np.random.default_rng([seed, number])
    draw = random_damped_scene if number % 3 == 0 else random_scene_with_terms
    check_short(changed(rng, draw(rng, 12, 200.0), number))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("number", range(4))
def test_random_scenes(kind: str, number: int) -> None:
    judge(kind, number)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "first"),
    [(kind, first) for kind, (_, end, _) in KINDS.items() for first in range(4, end, 10)],
)
def test_many_random_scenes(kind: str, first: int) -> None:
    for number in range(first, first + 10):
        judge(kind, number)
