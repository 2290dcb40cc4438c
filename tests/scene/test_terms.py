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
from tests.scene.test_scene import CHAIN_TEXT, TEXT, scene_of

SHOCK = "[shock]" + TEXT.partition("[shock]")[2]
STRIKER = '[striker]\nvelocity = "1 m/s"\n'
PRESSED = '[precompression]\nforce = "20 N"\n'
WALL = '[wall]\nkind = "same"\n'


def segmented(*segments: str, granules: int = 60) -> str:
    """A chain of segments, each the lines after its header, under the shock of the demo."""
    chain = CHAIN_TEXT.replace("granules = 60", f"granules = {granules}")
    return chain + "".join(f"[[chain.segments]]\n{text}\n" for text in segments) + SHOCK


def test_kinds_of_walls_and_laws_of_damping_are_typed() -> None:
    assert set(get_args(WallKind)) == set(WALLS) == {"rigid", "same", "elastic"}
    assert set(get_args(DampingLaw)) == set(DAMPING)


def test_a_plain_scene_has_no_terms(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, TEXT)
    assert scene.is_plain
    assert scene.terms == ()


@pytest.mark.parametrize(
    ("text", "terms"),
    [
        (CHAIN_TEXT + STRIKER, ("striker",)),
        (TEXT + WALL, ("wall",)),
        (TEXT + PRESSED, ("precompression",)),
        (TEXT + WALL + "[precompression]\ngravity = 9.81\n", ("wall", "gravity")),
        (segmented("granules = 60\nradius_ratio = 0.99"), ("unlike granules",)),
        (segmented('granules = 60\ngap = "1 um"'), ("gaps",)),
        (TEXT + '[contact]\ndamping = "restitution"\nrestitution = 0.9\n', ("damping",)),
        (
            TEXT + WALL + '[contact]\ndamping = "viscoelastic"\nrelaxation_time = "1 us"\n'
            "attraction = true\n",
            ("wall", "damping"),
        ),
        (TEXT + '[contact]\ndamping = "dashpot"\ncoefficient = "2 g/s"\n', ("damping",)),
        (TEXT.replace("[shock]", 'gap = "1 um"\n[shock]'), ("gaps",)),
        (
            segmented("granules = 30", 'granules = 30\ndensity = "2 g/cm^3"')
            .replace(SHOCK, STRIKER + WALL + PRESSED),
            ("unlike granules", "striker", "wall", "precompression"),
        ),
    ],
)  # fmt: skip
def test_terms_are_named_and_written_and_read(
    tmp_path: Path, text: str, terms: tuple[str, ...]
) -> None:
    scene = scene_of(tmp_path, text)
    assert scene.terms == terms
    assert not scene.is_plain
    scene.to_toml(tmp_path / "copy.toml")
    assert hc.Scene.from_toml(tmp_path / "copy.toml") == scene


def test_segments_cells_and_tapers(tmp_path: Path) -> None:
    text = segmented(
        "granules = 1\nradius = 1e-2",
        "granules = 5\ncell = [{}, {density = 1000, gap = 1e-6}]",
        "granules = 3\nradius = 4e-3\nradius_ratio = 0.5",
        granules=9,
    )
    chain = scene_of(tmp_path, text).chain
    steel = STEEL["radius"]
    assert chain.radius == pytest.approx((1e-2, *[steel] * 5, 4e-3, 2e-3, 1e-3), rel=1e-15)
    iron = pytest.approx(STEEL["density"], rel=1e-15)
    assert chain.density == (iron, iron, 1000.0, iron, 1000.0, iron, iron, iron, iron)
    assert chain.gap == (0, 0, 1e-6, 0, 1e-6, 0, 0, 0, 0)
    assert isinstance(chain.young_modulus, float)


def test_segments_of_the_same_granules_are_one_chain(tmp_path: Path) -> None:
    text = segmented("granules = 20", 'granules = 40\nradius = "4.75 mm"')
    assert scene_of(tmp_path, text) == scene_of(tmp_path, TEXT)


def test_sequences_in_python() -> None:
    radius = np.array([1e-3, 2e-3, 3e-3])
    chain = hc.Chain(3, radius, [1e9, 1e9, 1e9], 0.3, (1.0, 2.0, 3.0))
    assert chain.radius == (1e-3, 2e-3, 3e-3)
    assert chain.young_modulus == 1e9
    assert hash(chain) == hash(hc.Chain(3, radius.tolist(), 1e9, 0.3, [1, 2, 3]))


TABLE = "radius_m,young_modulus_Pa,poisson_ratio,density_kg_m3,gap_m\n"
ROWS = "0.005,193e9,0.3,7958,0\n0.004,193e9,0.3,7958,1e-6\n"


def test_a_table_of_granules(tmp_path: Path) -> None:
    (tmp_path / "granules.csv").write_text(TABLE + ROWS)
    chain = scene_of(tmp_path, '[chain]\nfile = "granules.csv"\n' + SHOCK).chain
    assert (chain.granules, chain.radius, chain.gap) == (2, (0.005, 0.004), (0.0, 1e-6))
    assert chain.young_modulus == 193e9


def test_numbers_of_numpy_and_what_is_one_number_in_uniform_chains_alone() -> None:
    chain = hc.Chain(3, np.array(1e-3), np.float64(1e9), 0.3, 1000.0)
    assert chain == hc.Chain(3, 1e-3, 1e9, 0.3, 1000.0)
    unlike = hc.Chain(3, [1e-3, 2e-3, 1e-3], 1e9, 0.3, 1000.0)
    for what in ("granule_mass", "contact_stiffness"):
        with pytest.raises(SceneError, match=f"{what}: is a single number only in a chain"):
            getattr(unlike, what)


def test_strikers_walls_and_loads_of_another_type() -> None:
    chain = hc.Chain(5, **STEEL)
    with pytest.raises(SceneError, match="wall = 'same': must be a Wall or None"):
        hc.Scene(chain, hc.Striker(1.0), wall="same")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="precompression = 3: must be a Precompression or None"):
        hc.Scene(chain, hc.Striker(1.0), precompression=3)  # type: ignore[arg-type]


def test_numbers_that_leave_floating_point() -> None:
    chain = hc.Chain(3, [1e-3, 1e-3, 1e-150], 1e9, 0.3, 1000.0)
    with pytest.raises(SceneError, match="too large or too small to be represented"):
        hc.Scene(chain, hc.Striker(1.0))


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
    striker = STRIKER + "loaded = true\n"
    scene = scene_of(tmp_path, CHAIN_TEXT + striker + PRESSED)
    assert scene.granules.static_force == pytest.approx(20.0)
    scene.to_toml(tmp_path / "again.toml")
    assert hc.Scene.from_toml(tmp_path / "again.toml") == scene
