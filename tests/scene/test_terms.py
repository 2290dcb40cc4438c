"""Scene files with terms: grammar, refusals, and there and back."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.terms import DAMPING, WALLS, DampingLaw, WallKind
from tests.conftest import STEEL
from tests.scene.test_refused import text_of
from tests.scene.test_scene import TEXT, scene_of


def test_kinds_of_walls_and_laws_of_damping_are_typed() -> None:
    assert set(get_args(WallKind)) == set(WALLS) == {"rigid", "same", "elastic"}
    assert set(get_args(DampingLaw)) == set(DAMPING)


TERMS = """
striker => striker
pulse wall.kind="same" => wall
pulse precompression.force="20 N" => precompression
pulse wall.kind="same"; precompression.gravity=9.81 => wall, gravity
pulse chain.segments=[{granules=60, radius_ratio=0.99}] => unlike granules
pulse chain.segments=[{granules=60, gap="1 um"}] => gaps
pulse contact={damping="restitution", restitution=0.9} => damping
pulse wall.kind="same"; contact={damping="viscoelastic", relaxation_time="1 us"} => wall, damping
piston shock.velocity="20 cm/s" => piston
sine => precompression
"""
"""Scenes of ``test_refused``, and their terms."""


@pytest.mark.parametrize("case", TERMS.strip().splitlines())
def test_terms_are_named(tmp_path: Path, case: str) -> None:
    text, _, terms = case.partition(" => ")
    scene = scene_of(tmp_path, text_of(text))
    assert ", ".join(scene.terms) == terms
    assert not scene.is_plain


def test_segments_cells_and_tapers(tmp_path: Path) -> None:
    text = (
        "pulse chain.granules=9; chain.segments=[{granules=1, radius=1e-2},"
        " {granules=5, cell=[{}, {density=1000, gap=1e-6}]},"
        " {granules=3, radius=4e-3, radius_ratio=0.5}]"
    )
    chain = scene_of(tmp_path, text_of(text)).chain
    steel = STEEL["radius"]
    assert chain.radius == pytest.approx((1e-2, *[steel] * 5, 4e-3, 2e-3, 1e-3), rel=1e-15)
    iron = pytest.approx(STEEL["density"], rel=1e-15)
    assert chain.density == (iron, iron, 1000.0, iron, 1000.0, iron, iron, iron, iron)
    assert chain.gap == (0, 0, 1e-6, 0, 1e-6, 0, 0, 0, 0)
    assert isinstance(chain.young_modulus, float)
    cells = 'chain.segments=[{granules=60, cell=[{}, {yield_strength="20 MPa"}]}]'
    text = text_of(f'pulse chain.yield_strength="300 MPa"; {cells}')
    assert scene_of(tmp_path, text).chain.yield_strength == (3e8, 2e7) * 30


def test_segments_of_the_same_granules_are_one_chain(tmp_path: Path) -> None:
    text = text_of('pulse chain.segments=[{granules=20}, {granules=40, radius="4.75 mm"}]')
    assert scene_of(tmp_path, text) == scene_of(tmp_path, TEXT)


def test_sequences_and_numbers_of_numpy_in_python() -> None:
    radius = np.array([1e-3, 2e-3, 3e-3])
    chain = hc.Chain(3, radius, [1e9, 1e9, 1e9], 0.3, (1.0, 2.0, 3.0))
    assert chain.radius == (1e-3, 2e-3, 3e-3)
    assert chain.young_modulus == 1e9
    assert hash(chain) == hash(hc.Chain(3, radius.tolist(), 1e9, 0.3, [1, 2, 3]))
    chain = hc.Chain(3, np.array(1e-3), np.float64(1e9), 0.3, 1000.0)
    assert chain == hc.Chain(3, 1e-3, 1e9, 0.3, 1000.0)
    unlike = hc.Chain(3, [1e-3, 2e-3, 1e-3], 1e9, 0.3, 1000.0)
    for what in ("granule_mass", "contact_stiffness"):
        with pytest.raises(SceneError, match=f"{what}: is a single number only in a chain"):
            getattr(unlike, what)


@pytest.mark.parametrize("wall", [None, hc.Wall("rigid")], ids=str)
def test_a_free_striker_touches_a_chain_that_is_pressed_without_it(wall: hc.Wall | None) -> None:
    gravity = 0.0 if wall is None else 9.81
    load, chain = hc.Precompression(2.0, gravity), hc.Chain(4, **STEEL)
    scene = hc.Scene(chain, hc.Striker(0.1), wall=wall, precompression=load)
    shorter = hc.Scene(
        hc.Chain(3, **STEEL), hc.Striker(0.1, loaded=True), wall=wall, precompression=load
    )
    own, others = scene.granules, shorter.granules
    assert own.static_force.tolist() == [0.0, *others.static_force]
    assert own.constant_force.tolist() == [own.mass[0] * gravity, *others.constant_force]
    assert own.position[1] == 2 * chain.radius
    assert own.position[1:] - own.position[1] == pytest.approx(others.position)


def test_a_loaded_striker_needs_a_load(tmp_path: Path) -> None:
    text = text_of("striker striker.loaded=true; precompression.force=20")
    assert scene_of(tmp_path, text).granules.static_force == pytest.approx(20.0)
