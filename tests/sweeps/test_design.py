"""The scenes of sweeps: grids, lists, samples and tables; what cannot vary; parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
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
from tests.command_line import Command
from tests.conftest import STEEL
from tests.sweeps.conftest import GRID, SHORT, all_scenes
from tests.sweeps.test_sweeps_of_files import LOADED, PISTON, PLAIN, SINE, STRIKER, TABLE, chain_of


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
    short = design(SHORT, {"radius": "1 mm:2 mm:10", "momentum_ratio": [1, 2]})
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


M = "shock.momentum_ratio"
VARY: list[tuple[hc.Scene, Any, str]] = [
    (SHORT, {}, "vary: must be a mapping of at least"),
    (SHORT, [(M, "1,2")], "vary: must be a mapping"),
    (SHORT, {3: "1,2"}, "cannot vary; what can vary: "),
    (SHORT, {"shock.momentumratio": "1,2"}, "did you mean shock.momentum_ratio? What can vary"),
    (SHORT, {"shock.radius": "1,2"}, "did you mean chain.radius? What can vary: chain."),
    (SHORT, {"radius": "1,2", "chain.radius": "1,2"}, "chain.radius: given twice"),
    (SHORT, {"chain.granules": "2:9:100001"}, "COUNT must be a whole number from 2 to 100,000"),
    *((SHORT, {M: f"1:2:{count}"}, "COUNT must be a whole number from 2 to 100,000")
      for count in ("2.5", "1", "x", "9" * 5000)),
    (SHORT, {M: "1:1:5"}, "= '1:1:5': LOW must be below HIGH"),
    (SHORT, {"chain.gap": "0:2:5:log"}, "LOW must be above 0 with :log"),
    (SHORT, {M: "1:2:3:4"}, "must be A,B,C or LOW:HIGH:COUNT"),
    (SHORT, {M: "1:log"}, "must be A,B,C or LOW:HIGH:COUNT"),
    (SHORT, {M: "0:2:5"}, "shock.momentum_ratio = 0.0: must be a finite"),
    (SHORT, {M: "nan:2:5"}, "= nan: must be a finite number"),
    (SHORT, {M: ""}, "must be a number"),
    (SHORT, {M: []}, "must take 1 to 100,000 values"),
    (SHORT, {M: [1, 1.0]}, "must not have a value twice"),
    (SHORT, {M: [1, True]}, "must be a number"),
    (SHORT, {M: "1,-2"}, "shock.momentum_ratio = -2.0: must be"),
    (SHORT, {"chain.radius": "1 kg,2 kg"}, "has the wrong dimension"),
    (SHORT, {"chain.granules": "2.5,3"}, "must be a whole number"),
    (SHORT, {"chain.granules": "0:9:4"}, "chain.granules = 0: must be an integer from 1"),
    (SHORT, {"chain.poisson_ratio": "0:0.6:4"}, "chain.poisson_ratio = 0.6: must be"),
    (SHORT, {"shock.profile": "cosine,square"}, "shock.profile = 'square': must be"),
    (SHORT, {"shock.profile": "cosine:triangular:2"}, "has no range: name its values"),
    (SHORT, {"shock.profile": [["cosine"]]}, "must be the name of a profile"),
    (SHORT, {M: "1:2:3", "shock.rise_time": "1 us,2 us"}, "only one of the two can vary"),
    (SHORT, {M: "1:2"}, "draw with --samples (in Python: samples=)"),
    *((SHORT, {M: values}, "must be a list of values, or text")
      for values in (1.0, np.ones((2, 2)), b"12")),
    (PLAIN, {"striker.velocity": "1,2"}, "the scene has no [striker]; add the section to its file"),
    (PLAIN, {"wall.kind": "rigid,same"}, "wall.kind: cannot vary: the scene has no [wall]; add"),
    (PLAIN, {"velocity": "1,2"}, "velocity: cannot vary; what can vary: chain.granules, chain.rad"),
    (STRIKER, {"shock.colour": "1,2"}, "cannot vary: the scene has no [shock]; add the section"),
    (STRIKER, {"radius": "1,2"}, "is in several sections: name one of chain.radius, striker.rad"),
    (STRIKER, {"striker.velocty": "1,2"}, "cannot vary; did you mean striker.velocity? What can"),
    (STRIKER, {"wall.kind": "rigid,soft"}, "wall.kind = 'soft': must be one of rigid, same, elas"),
    (STRIKER, {"wall.kind": [1, 2]}, "wall.kind = 1: must be the name of a wall"),
    (
        replace(STRIKER, wall=hc.Wall("elastic", 1e9, 0.3)),
        {"wall.kind": "elastic,rigid", "wall.young_modulus": "1e9,2e9"},
        'only a wall of kind "elastic" has it, in all scenes',
    ),
    (STRIKER, {"wall.young_modulus": "1,2"}, 'cannot vary: only a wall of kind "elastic" has it'),
    (STRIKER, {"striker.velocity": "0,1"}, "striker.velocity = 0.0: must be a finite number above"),
    (SINE, {"duration_ratio": "2,3"}, "duration_ratio: cannot vary; "),
    (TABLE, {"shock.velocity": "2,3"}, "shock.velocity: cannot vary; what can"),
    (PISTON, {"velocity": "0,1"}, "shock.velocity = 0"),
    (SINE, {"cycles": "0,1"}, "shock.cycles = 0: must be an integer"),
    (SINE, {"amplitude": "11,12"}, "shock.amplitude = 11.0: must be at most the static load"),
    (LOADED, {"chain.gap": [1e-6, 2e-6]}, "chain.gap: must be 0 with [precompression]"),
    (PLAIN, {"peek_force": "1,2"}, "cannot vary; did you mean peak_force?"),
    (replace(PLAIN, chain=chain_of()), {"chain.radius": "1,2"}, "chain.radius: cannot vary; "),
]  # fmt: skip
"""Scenes, values that cannot vary in them, and the reason."""

DRAWN: list[tuple[dict[str, Any], str]] = [
    ({"vary": GRID, "samples": 5}, "are drawn from ranges without a count"),
    ({"samples": 0}, "samples = 0: must be an integer of at least 1"),
    ({"samples": 2.5}, "samples = 2.5: must be an integer of at least 1"),
    ({"samples": 5, "seed": -1}, "seed = -1: must be an integer from 0 to 4294967295"),
    ({"samples": 10**12}, "scenes = 1000000000000: must be at most 100,000,000"),
]


@pytest.mark.parametrize(("scene", "vary", "words"), VARY, ids=[case[2][:40] for case in VARY])
def test_what_cannot_vary_is_refused_in_a_sentence(scene: hc.Scene, vary: Any, words: str) -> None:
    with pytest.raises(SceneError) as problem:
        design(scene, vary)
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(("drawn", "words"), DRAWN)
def test_what_cannot_be_drawn_is_refused(drawn: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as problem:
        design(SHORT, **{"vary": {M: "1:2"}, **drawn})
    assert words in str(problem.value)


def test_a_pulse_table_varies_with_its_chain_alone() -> None:
    shock = hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 100.0, 0.0))
    scene = replace(SHORT, shock=shock)
    assert design(scene, {"chain.granules": "8,12"}).scenes == 2
    with pytest.raises(SceneError, match=r"shock\.peak_force: cannot vary"):
        design(scene, {"shock.peak_force": "1,2"})


def test_a_design_of_many_scenes_costs_nothing_until_they_are_measured() -> None:
    layout = design(SHORT, {M: "0.1:10:10000:log", "chain.radius": "1 mm:2 mm:10000"})
    assert layout.scenes == MOST_SCENES
    last = layout.parameters(np.arange(MOST_SCENES - 2, MOST_SCENES))
    assert last[M].tolist() == [10.0, 10.0]
    assert np.diff(last["chain.radius"]) == pytest.approx(1e-3 / 9999)


# Parts


@pytest.mark.parametrize("granules", [2, 60, 4000, 1_000_000])
def test_parts_are_all_scenes_once_and_none_is_too_large(granules: int) -> None:
    layout = design(SHORT, {"chain.granules": [granules], M: "0.1:10:20011"})
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


# Segments, values that exclude one another, and tables


OF_SEGMENTS = {
    "granules": "granules: cannot vary; what can vary: chain.radius",
    "chain.segments.3.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.0.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.1.radius_ratio": "did you mean chain.segments.2.radius_ratio?",
    "chain.segments.1.cell.3.density": "cannot vary; did you mean chain.segments.",
    "segments.2.cell.1.density": "cannot vary; did you mean chain.segments.",
    "chain.segments.1": "chain.segments.1: cannot vary; ",
    "chain.colour": "run.end_time, keys of segments, such as chain.segments.2.radius_ratio",
    "chain.segments.2.radius": "chain.segments.2.radius = 0.0: must be a finite number above 0",
    "chain.segments.2.radius_ratio": "chain.segments.2.radius_ratio = 0.0: must be a finite number",
    "chain.segments.2.granules": "chain.segments.2.granules = 0: must be an integer from 1",
}


@pytest.mark.parametrize("name", OF_SEGMENTS)
def test_what_segments_do_not_have_is_refused(segmented: hc.Scene, name: str) -> None:
    with pytest.raises(SceneError) as problem:
        design(segmented, {name: [0, 2]})
    assert OF_SEGMENTS[name] in str(problem.value)


OF_ROWS: list[tuple[hc.Scene, dict[str, Any], str]] = [
    (STRIKER, {"wall.kind": "elastic,rigid"}, "wall.young_modulus: missing, a wall of kind"),
    (LOADED, {"precompression.force": [0.0, 1.0]}, "precompression.force and gravity: both are 0"),
    (SINE, {"amplitude": "11,5"}, "shock.amplitude = 11.0: must be at most the static load"),
    (LOADED, {"gravity": [1.0, 0.0]}, "precompression.gravity = 1.0: needs a [wall]"),
    (LOADED, {"chain.gap": [1e-6, 0.0]}, "chain.gap: must be 0 with [precompression]"),
    (hc.Scene(hc.Chain(3, **STEEL, velocity=1.0), wall=hc.Wall("rigid")),
     {"chain.velocity": [-1.0, 1.0]}, "velocities at the start: "),
]  # fmt: skip


@pytest.mark.parametrize(("scene", "vary", "words"), OF_ROWS, ids=[case[2] for case in OF_ROWS])
def test_what_only_the_rest_of_a_scene_excludes_is_the_reason_in_its_row(
    scene: hc.Scene, vary: dict[str, Any], words: str
) -> None:
    bad, good = hc.sweep(scene, vary, rtol=1e-4).to_frame()["failure"].tolist()
    assert words in bad
    assert pd.isna(good)


SCENE = hc.Scene(hc.Chain(20, **STEEL), hc.Striker(0.5))
PULSE = hc.Scene(SCENE.chain, hc.Pulse("cosine", 10.0, 3.0, rise_time=3e-5))


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_table_is_measured_row_by_row(tmp_path: Path, hertzchain: Command, suffix: str) -> None:
    """What follows from other keys is computed in pandas, here the granules of a fixed length."""
    SCENE.to_toml(tmp_path / "scene.toml")
    table = pd.DataFrame({"chain.radius [mm]": [5.0, 10.0, 4.0]})
    table["granules"] = (200 / (2 * table["chain.radius [mm]"])).where(lambda count: count < 25)
    table["chain.young_modulus"] = ["193 GPa", None, "70e9"]
    path = tmp_path / f"table.{suffix}"
    table.to_csv(path, index=False) if suffix == "csv" else table.to_parquet(path)
    done = hertzchain("sweep", tmp_path / "scene.toml", "--table", path, "-o", tmp_path / "out")
    assert done.status == 0, done.err
    rows = hc.Sweep.load(tmp_path / "out").to_frame()
    assert rows["chain.granules"].tolist() == [20, 10, 20]
    assert rows["chain.radius"].tolist() == [5e-3, 10e-3, 4e-3]
    assert rows["chain.young_modulus"].tolist() == [193e9, 193e9, 70e9]
    for scene, peak in zip(hc.scenes(SCENE, table), rows["largest_peak_force_N"], strict=True):
        chain = hc.Chain(scene.chain.granules, **{
            **STEEL, "radius": scene.chain.radius, "young_modulus": scene.chain.young_modulus,
        })  # fmt: skip
        assert scene == replace(SCENE, chain=chain)
        assert peak == pytest.approx(hc.Native().run(scene).peak_force.max(), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "radii", "words"),
    [
        ("chain.radius [mm],velocity\n5,1,\n4,1,\n", [5e-3, 4e-3], ""),  # as spreadsheets write it
        ("chain.radius [mm]\n4\n\n6\n\n", [4e-3, 4.75e-3, 6e-3], ""),  # a blank line is empty
        ("\ufeffchain.radius [mm]\n4\n", [4e-3], ""),
        ("chain.radius [mm];velocity\n4,5;1\n6,25;\n", [4.5e-3, 6.25e-3], ""),
        ("chain.radius [mm];velocity\n4.5;1\n", [4.5e-3], ""),
        ("velocity;chain.radius\n1;4,5 mm\n-2;\n", [], " above 0 [m/s] (row 2 of the table)\n"),
        ("velocity;chain.radius\n1;4,5 mm\n", [4.5e-3], ""),
        ("chain.radius [mm]\tvelocity\n4.5\t1\n", [4.5e-3], ""),
        ("chain.radius [mm],velocity\n5,1,3\n", [], "a row has more cells than the header"),
        ("chain.radius [mm]\nn/a\n", [], "= 'n/a': must be a number without a unit"),
    ],
)
def test_a_csv_table_is_read_cell_by_cell(
    tmp_path: Path, hertzchain: Command, text: str, radii: list[float], words: str
) -> None:
    SCENE.to_toml(tmp_path / "scene.toml")
    (tmp_path / "table.csv").write_text(text, encoding="utf-8")
    options = "--table", tmp_path / "table.csv", "-o", tmp_path / "out"
    done = hertzchain("sweep", tmp_path / "scene.toml", *options)
    assert words in done.err
    assert done.status == (2 if words else 0)
    if not words:
        assert hc.Sweep.load(tmp_path / "out").to_frame()["chain.radius"].tolist() == radii


def test_an_empty_cell_has_what_the_scene_has() -> None:
    """The rise time, where LM_ratio is empty; and the profile."""
    table = pd.DataFrame({"momentum_ratio": [2.0, None], "profile": [None, "triangular"]})
    first, second = hc.scenes(PULSE, table)
    assert (first.momentum_ratio, second.rise_time) == (2.0, PULSE.rise_time)
    assert [scene.shock.profile_name for scene in (first, second)] == ["cosine", "triangular"]
    rows = hc.sweep(PULSE, table).to_frame()
    assert rows["shock.rise_time"].tolist() == pytest.approx([first.rise_time, second.rise_time])
    for scene, peak in zip((first, second), rows["largest_peak_force_N"], strict=True):
        assert peak == pytest.approx(hc.Native().run(scene).peak_force.max(), rel=2e-6)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"chain.raduis": [1.0]}, "did you mean"),
        (
            {"chain.radius": [1e-3, -1.0, -1.0, 0.0]},
            "= -1.0: must be a finite number above 0 [m] (row 2 and 1 more of the table)",
        ),
        ({"velocity": [1.0, "x"]}, "striker.velocity = 'x': must be a number"),
        ({"granules": pd.array([9, None, -1], "Int64")}, "(row 3 of the table)"),
        ({"chain.radius [GPa]": [1.0]}, "wrong dimension"),
        ({"chain.radius [mm]": ["1 mm"]}, "must be a number"),
        ({"granules": [9], "chain.granules": [9]}, "given twice"),
        ({}, "must have columns and rows"),
        ({"chain.radius": []}, "must have columns and rows"),
        ({"chain.radius": [[1.0], [2.0]]}, "must have numbers or texts in its cells"),
    ],
)
def test_what_is_no_table_of_scenes(table: dict[str, list[Any]], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        hc.scenes(SCENE, pd.DataFrame(table))
    assert words in str(caught.value)


def test_values_that_exclude_one_another_are_a_row_with_the_reason(tmp_path: Path) -> None:
    base = hc.Scene(replace(SCENE.chain, gap=0.0), SCENE.shock, wall=hc.Wall("rigid"))
    table = pd.DataFrame({"chain.radius [mm]": [5.0, 5.0], "velocity": [0.5, 1e4]})
    swept = hc.sweep(base, table, output=tmp_path / "out")
    assert swept.to_frame()["failure"].isna().tolist() == [True, False]
    other = table.assign(velocity=[0.5, 1.0])
    with pytest.raises(hc.HertzchainError, match="another sweep, with another value of vary in"):
        hc.sweep(base, other, output=tmp_path / "out")


def test_a_scene_without_memory_is_a_row_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object) -> hc.Result:
        raise MemoryError

    monkeypatch.setattr(hc.Native, "run", run)
    rows = hc.sweep(STRIKER, {"striker.velocity": "0.5,1"}).to_frame()
    assert rows["failure"].tolist() == ["there is not enough memory for this scene"] * 2
