"""Keys that cannot vary, and tables of scenes."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.sweeps.design import design
from tests.command_line import Command
from tests.conftest import STEEL
from tests.sweeps.made import CHAIN_SECTION, SHOCK
from tests.sweeps.test_sweeps_of_files import LOADED, PISTON, PLAIN, SINE, STRIKER, TABLE, chain_of

REFUSED: list[tuple[hc.Scene, dict[str, Any], str]] = [
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
]


@pytest.mark.parametrize(("scene", "vary", "words"), REFUSED, ids=[case[2] for case in REFUSED])
def test_what_cannot_vary_is_refused_in_a_sentence(
    scene: hc.Scene, vary: dict[str, Any], words: str
) -> None:
    with pytest.raises(SceneError) as problem:
        design(scene, vary)
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)


OF_SEGMENTS = {
    "granules": "granules: cannot vary: segments, a file or lists say how many",
    "chain.segments.3.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.0.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.1.radius_ratio": "did you mean chain.segments.2.radius_ratio?",
    "chain.segments.1.cell.3.density": "cannot vary; did you mean chain.segments.",
    "segments.2.cell.1.density": "cannot vary; did you mean chain.segments.",
    "chain.segments.1": "chain.segments.1: cannot vary; ",
    "chain.colour": "chain.gap, keys of segments, such as chain.segments.2.radius_ratio",
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
]


@pytest.mark.parametrize(("scene", "vary", "words"), OF_ROWS, ids=[case[2] for case in OF_ROWS])
def test_what_only_the_rest_of_a_scene_excludes_is_the_reason_in_its_row(
    scene: hc.Scene, vary: dict[str, Any], words: str
) -> None:
    bad, good = hc.sweep(scene, vary, rtol=1e-4).to_frame()["failure"].tolist()
    assert words in bad
    assert pd.isna(good)


def test_a_ratio_whose_radii_leave_floating_point_is_the_reason_in_a_row(tmp_path: Path) -> None:
    taper = "[[chain.segments]]\ngranules = 6\n"
    (tmp_path / "taper.toml").write_text(CHAIN_SECTION + taper + SHOCK)
    table = hc.sweep(tmp_path / "taper.toml", {"chain.segments.1.radius_ratio": [1e-300, 1.0]})
    assert "chain.radius of granule 3 = 0.0: must be" in table.to_frame()["failure"][0]


def test_a_chain_with_other_values_has_no_segments(segmented: hc.Scene) -> None:
    """The segments of the file would not describe it."""
    assert segmented.chain.section is not None
    assert pickle.loads(pickle.dumps(segmented)).chain.section == segmented.chain.section  # noqa: S301
    assert replace(segmented, shock=hc.Striker(1.0)).chain.section is not None
    other = replace(segmented.chain, density=1000.0)
    assert other.section is None
    with pytest.raises(SceneError, match=r"chain\.radius: cannot vary"):
        design(replace(segmented, chain=other), {"chain.radius": [1.0, 2.0]})


# Tables


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


SEVERAL = (
    "chain.radius = -1.0: must be a finite number above 0 [m] (rows 2, 3 of the table);"
    " chain.radius = 0.0: must be a finite number above 0 [m] (row 4); striker.velocity = -3.0:"
    " must be a finite number above 0 [m/s] (row 3); striker.velocity = 'x': must be a number"
)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"chain.raduis": [1.0]}, "did you mean"),
        ({"chain.radius": [1e-3, -1.0, -1.0, 0.0], "velocity": [1.0, 2.0, -3.0, "x"]}, SEVERAL),
        (
            {"granules": [2.5] * 6},
            "must be a whole number (rows 1, 2, 3, 4 and 2 more of the table)",
        ),
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
    with pytest.raises(hc.HertzchainError, match=r"belongs to another sweep, vary\.2\.sha256 is "):
        hc.sweep(base, other, output=tmp_path / "out")


def test_a_scene_without_memory_is_a_row_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object) -> hc.Result:
        raise MemoryError

    monkeypatch.setattr(hc.Native, "run", run)
    rows = hc.sweep(STRIKER, {"striker.velocity": "0.5,1"}).to_frame()
    assert rows["failure"].tolist() == ["there is not enough memory for this scene"] * 2
