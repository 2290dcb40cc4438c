"""The scenes of sweeps: grids, lists and samples, and the parts they are cut into."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.shocks import PROFILES
from hertzchain.sweeps.columns import PARAMETERS
from hertzchain.sweeps.design import MOST_SCENES, design, sobol_points
from hertzchain.sweeps.loop import MOST_PEAKS, cut, part_size
from tests.sweeps.made import GRID, SHORT, all_scenes


@pytest.mark.parametrize("log", [False, True])
def test_a_grid_takes_both_ends_to_the_last_digit(log: bool) -> None:
    ends = 0.1, 0.7
    layout = design(SHORT, {"shock.momentum_ratio": f"0.1:0.7:7{':log' * log}"})
    ratios = layout.parameters(np.arange(7))["shock.momentum_ratio"]
    assert (ratios[0], ratios[-1]) == ends
    spaced = np.geomspace(*ends, 7) if log else np.linspace(*ends, 7)
    np.testing.assert_allclose(ratios, spaced, rtol=1e-14)  # some roundings


def test_values_may_be_those_of_numpy_and_pandas() -> None:
    for values in (
        np.array([1, 2], np.int8),
        np.array([1, 2], np.float32),
        pd.Series([1, 2]),
        (k for k in (1, 2)),
        ("1", "2"),
        "1, 2",
    ):
        given = {"shock.momentum_ratio": values}
        assert all_scenes(design(SHORT, given)) == all_scenes(
            design(SHORT, {"shock.momentum_ratio": [1.0, 2.0]})
        )
    drawn = {"shock.momentum_ratio": "1:2"}
    by_numpy = design(SHORT, drawn, samples=np.int64(4), seed=np.int32(3))  # type: ignore[arg-type]
    assert by_numpy.to_dict() == design(SHORT, drawn, samples=4, seed=3).to_dict()


def test_granules_are_whole_and_each_once_and_sections_may_be_left_out() -> None:
    layout = design(SHORT, {"chain.granules": "2:10:20:log"})
    assert [scene.chain.granules for scene in all_scenes(layout)] == list(range(2, 11))
    short = design(SHORT, {"radius": "1 mm:2 mm:1e1", "momentum_ratio": [1, 2]})
    full: Any = {"chain.radius": "1 mm:2 mm:10", "shock.momentum_ratio": [1, 2]}
    assert short.to_dict() == design(SHORT, full).to_dict()


@pytest.mark.parametrize("log", [False, True])
def test_drawn_granules_have_the_share_of_a_whole_number(log: bool) -> None:
    layout = design(SHORT, {"chain.granules": "2:20:log" if log else "2:20"}, samples=4096)
    drawn = layout.parameters(np.arange(4096))["chain.granules"]
    # From half a granule below a number to half a granule above it.
    edges = np.arange(1.5, 21.0)
    share = np.diff(np.log(edges) if log else edges)
    # A Sobol sequence fills each interval to a few points.
    expected = 4096 * share / share.sum()
    assert np.abs(np.bincount(drawn, minlength=21)[2:] - expected).max() <= 4
    assert (drawn.min(), drawn.max()) == (2, 20)


def test_samples_are_points_and_meet_every_combination() -> None:
    vary: dict[str, Any] = {
        "shock.momentum_ratio": "0.1:10:log",
        "shock.profile": ["cosine", "triangular"],
        "chain.granules": "8:12",
        "shock.duration_ratio": "1.5:6",
    }
    layout = design(SHORT, vary, samples=1000)
    assert layout.scenes == 2000
    given = layout.parameters(np.arange(2000))
    assert (given["shock.profile"] == np.repeat(["cosine", "triangular"], 1000)).all()
    points = sobol_points(3, 0, np.arange(1000))
    for half in (slice(1000), slice(1000, None)):
        ratio, granules, n = (given[name][half] for name in vary if name != "shock.profile")
        np.testing.assert_allclose(np.log10(ratio) / 2 + 0.5, points[:, 0], atol=1e-14)
        np.testing.assert_array_equal(granules, 8 + np.floor(5 * points[:, 1]))
        np.testing.assert_allclose((n - 1.5) / 4.5, points[:, 2], atol=1e-14)


@settings(deadline=None, max_examples=50)
@given(st.data())
def test_any_part_of_a_design_is_that_of_the_whole(data: st.DataObject) -> None:
    vary: dict[str, Any] = {"chain.radius": "1 mm:2 mm:3", "shock.peak_force": "1:100:log"}
    if data.draw(st.booleans()):
        vary["shock.profile"] = list(PROFILES)
    if data.draw(st.booleans()):
        vary["chain.poisson_ratio"] = "0:0.4"
    layout = design(SHORT, vary, samples=data.draw(st.integers(1, 40)), seed=3)
    start = data.draw(st.integers(0, layout.scenes - 1))
    stop = data.draw(st.integers(start + 1, layout.scenes))
    whole, part = (
        layout.parameters(np.arange(*ends)) for ends in ((0, layout.scenes), (start, stop))
    )
    for name in PARAMETERS:
        np.testing.assert_array_equal(part[name], whole[name][start:stop])


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({}, "vary: must be a mapping of at least"),
    ({"vary": {"shock.momentumratio": "1,2"}}, "did you mean shock.momentum_ratio? What can vary"),
    ({"vary": {"shock.radius": "1,2"}}, "did you mean chain.radius? What can vary: chain."),
    ({"vary": {"radius": "1,2", "chain.radius": "1,2"}}, "chain.radius: given twice"),
    ({"vary": {"chain.granules": "8,1000001"}}, "must be at most 1,000,000 in a sweep"),
    ({"vary": {"chain.granules": "2:9:100001"}}, "must take at most 100,000 values"),
    ({"vary": {"chain.radius": "1:2:2.5"}}, "COUNT a whole number of at least 2"),
    ({"vary": {"shock.momentum_ratio": "1:1:5"}}, "COUNT a whole number of at least 2"),
    ({"vary": {"shock.momentum_ratio": "1:2:1"}}, "COUNT a whole number of at least 2"),
    ({"vary": {"shock.momentum_ratio": "1:2:x"}}, "COUNT a whole number of at least 2"),
    ({"vary": {"shock.momentum_ratio": "1:2:3:4"}}, "must be A,B,C or LOW:HIGH:COUNT"),
    ({"vary": {"shock.momentum_ratio": "1:log"}}, "must be a number"),
    ({"vary": {"chain.gap": "0:2:5:log"}}, "COUNT a whole number of at least 2"),
    ({"vary": {"shock.momentum_ratio": "0:2:5"}}, "shock.momentum_ratio = 0.0: must be a finite"),
    ({"vary": {"shock.momentum_ratio": "nan:2:5"}}, "= nan: must be a finite number"),
    ({"vary": {"shock.momentum_ratio": ""}}, "must be a number"),
    ({"vary": {"shock.momentum_ratio": []}}, "must take 1 to 100,000 values"),
    ({"vary": {"shock.momentum_ratio": [1, 1.0]}}, "must not have a value twice"),
    ({"vary": {"shock.momentum_ratio": [1, True]}}, "must be a number"),
    ({"vary": {"shock.momentum_ratio": "1,-2"}}, "shock.momentum_ratio = -2.0: must be"),
    ({"vary": {"chain.radius": "1 kg,2 kg"}}, "has the wrong dimension"),
    ({"vary": {"chain.granules": "2.5,3"}}, "must be a whole number"),
    ({"vary": {"chain.granules": "0:9:4"}}, "chain.granules = 0: must be an integer from 1"),
    ({"vary": {"chain.poisson_ratio": "0:0.6:4"}}, "chain.poisson_ratio = 0.6: must be"),
    ({"vary": {"shock.profile": "cosine,square"}}, "shock.profile = 'square': must be"),
    ({"vary": {"shock.profile": "cosine:triangular:2"}}, "has no range: name its values"),
    (
        {"vary": {"shock.momentum_ratio": "1:2:3", "shock.rise_time": "1 us,2 us"}},
        "replaces shock.rise_time: only one of the two",
    ),
    ({"vary": {"shock.momentum_ratio": "1:2"}}, "draw with --samples (in Python: samples=)"),
    ({"vary": GRID, "samples": 5}, "are drawn from ranges without a count"),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 0}, "whole number of at least 1"),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 2.5}, "whole number of at least 1"),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 5, "seed": -1}, "whole number from 0"),
    (
        {"vary": {"shock.momentum_ratio": "1:2:1000000", "shock.duration_ratio": "2:3:1000000"}},
        "scenes = 1000000000000: must be at most 100,000,000",
    ),
    ({"vary": {"shock.momentum_ratio": "1:2"}, "samples": 10**12}, "must be at most 100,000,000"),
    ({"vary": {"shock.momentum_ratio": "1:2:" + "9" * 5000}}, "COUNT a whole number of at least 2"),
    ({"vary": [("shock.momentum_ratio", "1,2")]}, "vary: must be a mapping"),
    ({"vary": {3: "1,2"}}, "cannot vary; what can vary: "),
    ({"vary": {"shock.momentum_ratio": 1.0}}, "must be a list of values, or text"),
    ({"vary": {"shock.momentum_ratio": np.ones((2, 2))}}, "must be a list of values, or text"),
    ({"vary": {"shock.momentum_ratio": b"12"}}, "must be a list of values, or text"),
    ({"vary": {"shock.profile": [["cosine"]]}}, "must be the name of a profile"),
]


@pytest.mark.parametrize(("asked", "words"), REFUSED, ids=[words[:40] for _, words in REFUSED])
def test_a_design_that_cannot_be_is_refused_in_a_sentence(
    asked: dict[str, Any], words: str
) -> None:
    with pytest.raises(SceneError) as problem:
        design(SHORT, **{"vary": {}, **asked})
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)


def test_a_pulse_table_varies_with_its_chain_alone() -> None:
    shock = hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 100.0, 0.0))
    scene = replace(SHORT, shock=shock)
    assert design(scene, {"chain.granules": "8,12"}).scenes == 2
    with pytest.raises(SceneError, match=r"shock\.peak_force: cannot vary"):
        design(scene, {"shock.peak_force": "1,2"})


def test_a_design_of_many_scenes_costs_nothing_until_they_are_measured() -> None:
    layout = design(SHORT, {"shock.momentum_ratio": f"0.1:10:{MOST_SCENES}:log"})
    last = layout.parameters(np.arange(MOST_SCENES - 2, MOST_SCENES))["shock.momentum_ratio"]
    assert last[-1] == 10.0
    assert last[0] == pytest.approx(10.0 * (1 - np.log(100) / MOST_SCENES), rel=1e-12, abs=0)


# Parts


@pytest.mark.parametrize("granules", [2, 60, 4000, 1_000_000])
def test_parts_are_all_scenes_once_and_none_is_too_large(granules: int) -> None:
    layout = design(SHORT, {"chain.granules": [granules], "shock.momentum_ratio": "0.1:10:20011"})
    backends = (hc.Native(rtol=1e-4), hc.Lammps())
    parts = list(cut(layout, backends))
    for backend in backends:
        chunks = [part for part in parts if part.backend == backend]
        assert [part.name for part in chunks] == sorted({part.name for part in chunks})
        assert [part.start for part in chunks] == [0, *(part.stop for part in chunks[:-1])]
        assert chunks[-1].stop == 20011
        sizes = [part.stop - part.start for part in chunks]
        assert max(sizes) == part_size(layout, backend)
        assert max(sizes) * granules <= MOST_PEAKS or max(sizes) == 1


@pytest.mark.parametrize(("dimensions", "seed"), [(1, 0), (33, 1), (256, 5), (257, 5)])
def test_points_vs_those_of_scipy(dimensions: int, seed: int) -> None:
    """Any of them by its number, bit for bit; in more dimensions than the table has, too."""
    from scipy.stats import qmc

    points = sobol_points(dimensions, seed, np.array([17, 3, 30]))
    assert np.array_equal(points, qmc.Sobol(dimensions, seed=seed).random_base2(5)[[17, 3, 30]])
