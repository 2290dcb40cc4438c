"""Scenes written and read again are equal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import OutputError, SceneError
from tests.conftest import STEEL, paper_scene
from tests.scene.test_scene import CHAIN

# Writing

factor = st.floats(1e-9, 1e9)
chains = st.builds(
    hc.Chain,
    granules=st.integers(2, 10_000),
    radius=factor,
    young_modulus=factor,
    poisson_ratio=st.floats(-1.0, 0.5, exclude_min=True).filter(lambda nu: 1 - nu * nu > 1e-9),
    density=factor,
)


@st.composite
def pulses(draw: st.DrawFn) -> hc.Pulse:
    length = draw(st.sampled_from(["momentum_ratio", "rise_time"]))
    return hc.Pulse(
        draw(st.sampled_from(["cosine", "triangular", "cosine-triangular"])),
        draw(factor),
        draw(st.floats(1.0, 100.0, exclude_min=True)),
        **{length: draw(factor)},
    )


@st.composite
def tables(draw: st.DrawFn) -> hc.PulseTable:
    time = sorted(draw(st.lists(st.floats(0.0, 1e3), min_size=2, max_size=6, unique=True)))
    force = draw(st.lists(st.floats(0.0, 1e6), min_size=len(time), max_size=len(time)))
    force[draw(st.integers(0, len(time) - 1))] = draw(factor)
    return hc.PulseTable(tuple(time), tuple(force))


runs = st.builds(hc.Run, st.none() | factor)


def there_and_back(scene: hc.Scene, folder: Path) -> hc.Scene:
    path = folder / "written.toml"
    scene.to_toml(path)
    return hc.Scene.from_toml(path)


@pytest.mark.parametrize(
    "scene",
    [
        paper_scene("cosine", 2.0, 2.0),
        hc.Scene(CHAIN, hc.Pulse("triangular", 100.0, 3.0, rise_time=70e-6)),
        hc.Scene(CHAIN, hc.Pulse("cosine-triangular", 1, 2, momentum_ratio=1), hc.Run(1.2e-3)),
        hc.Scene(CHAIN, hc.PulseTable((1e-5, 3e-5), (1.0, 2.5))),
        hc.Scene(CHAIN, hc.PulseTable((0.0, 1 / 3), (0.1 + 0.2, 1e150), "mine.csv"), hc.Run(1.0)),
    ],
    ids=["momentum ratio", "rise time", "end time", "table", "table with a name"],
)
def test_a_scene_written_and_read_is_equal(tmp_path: Path, scene: hc.Scene) -> None:
    assert there_and_back(scene, tmp_path) == scene


@given(chain=chains, pulse=pulses(), run=runs)
def test_any_scene_written_and_read_is_equal(
    tmp_path_factory: pytest.TempPathFactory, chain: hc.Chain, pulse: hc.Pulse, run: hc.Run
) -> None:
    scene = hc.Scene(chain, pulse, run)
    assert there_and_back(scene, tmp_path_factory.getbasetemp()) == scene


@given(chain=chains, table=tables(), run=runs)
def test_any_table_written_and_read_is_equal(
    tmp_path_factory: pytest.TempPathFactory, chain: hc.Chain, table: hc.PulseTable, run: hc.Run
) -> None:
    try:
        scene = hc.Scene(chain, table, run)
    except SceneError:  # a pulse as short as 1e-300 s
        return
    read = there_and_back(scene, tmp_path_factory.getbasetemp())
    assert (read.chain, read.run, read.ramps) == (scene.chain, scene.run, scene.ramps)


def test_a_written_table_lies_beside_the_scene(tmp_path: Path) -> None:
    hc.Scene(CHAIN, hc.PulseTable((0.0, 1e-5), (1.0, 2.0))).to_toml(tmp_path / "mine.toml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.csv", "mine.toml"]
    assert (tmp_path / "mine.csv").read_text() == "time_s,force_N\n0.0,1.0\n1e-05,2.0\n"


def test_a_scene_that_cannot_be_written_is_an_error(tmp_path: Path, demo: hc.Scene) -> None:
    for path in (tmp_path, tmp_path / "no" / "scene.toml"):
        with pytest.raises(OutputError):
            demo.to_toml(path)
    assert list(tmp_path.iterdir()) == []


def test_a_scene_of_numpy_numbers_vs_one_of_plain_numbers(tmp_path: Path) -> None:
    """Arrays are accepted, and texts for TOML, CSV and LAMMPS do not depend on them."""
    from hertzchain.engines.lammps.deck import leg_commands, set_up

    steel = {key: np.float64(value) for key, value in STEEL.items()}
    row = np.array([0.0, 1e-5, 100.0])
    for plain, numpy in (
        (
            hc.Scene(CHAIN, hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1e-5), hc.Run(1e-5)),
            hc.Scene(
                hc.Chain(60, **steel),
                hc.Pulse("cosine", row[2], np.float64(2.0), momentum_ratio=row[1]),
                hc.Run(row[1]),
            ),
        ),
        (
            hc.Scene(CHAIN, hc.PulseTable((0.0, 1e-5), (0.0, 100.0))),
            hc.Scene(hc.Chain(60, **steel), hc.PulseTable(tuple(row[:2]), tuple(row[::2]))),
        ),
    ):
        assert there_and_back(numpy, tmp_path).ramps == plain.ramps
        assert set_up(numpy) == set_up(plain)
        legs, expected = numpy.schedule(1e-7), plain.schedule(1e-7)
        assert leg_commands(legs[0], None) == leg_commands(expected[0], None)
