"""Sweeps of scenes with terms: each row is a run of the scene that its file would describe."""

from __future__ import annotations

import copy
import itertools
import pickle
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import OutputError, SceneError
from hertzchain.scene.parts import key_named
from hertzchain.sweeps.columns import COLUMNS, PARAMETERS, TERMS, column_named, columns_of
from hertzchain.sweeps.design import design
from hertzchain.sweeps.drawing import draw
from hertzchain.sweeps.keys import names_of
from hertzchain.sweeps.numbers import of_result
from tests.command_line import Command, is_refused
from tests.conftest import STEEL
from tests.sweeps.test_sweeps import has_numbers

PTFE = {"radius": 4.75e-3, "young_modulus": 1.46e9, "poisson_ratio": 0.46, "density": 2200.0}
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
CHAIN = hc.Chain(6, **STEEL)
PLAIN = hc.Scene(CHAIN, PULSE)
STRIKER = hc.Scene(CHAIN, hc.Striker(1.0), wall=hc.Wall("rigid"))
LOADED = hc.Scene(CHAIN, PULSE, precompression=hc.Precompression(5.0))

CHAIN_SECTION = """
[chain]
granules = 6
radius = "4.75 mm"
young_modulus = "193 GPa"
poisson_ratio = 0.3
density = "7958 kg/m^3"
"""
SEGMENTS = """
[[chain.segments]]
granules = 4
cell = [{}, { young_modulus = "1.46 GPa", poisson_ratio = 0.46, density = "2.2 g/cm^3" }]
[[chain.segments]]
granules = 2
radius = "4 mm"
radius_ratio = 0.9
gap = "1 um"
"""
SHOCK = """
[shock]
profile = "cosine"
peak_force = "100 N"
duration_ratio = 2
momentum_ratio = 1.0
"""


@pytest.fixture
def segmented(tmp_path: Path) -> hc.Scene:
    """A dimer of steel and PTFE, and two smaller granules with gaps."""
    (tmp_path / "dimer.toml").write_text(CHAIN_SECTION + SEGMENTS + SHOCK)
    return hc.Scene.from_toml(tmp_path / "dimer.toml")


def chain_of(
    steel: Mapping[str, float] = STEEL,
    soft: Mapping[str, float] = PTFE,
    pairs: int = 2,
    ratio: float = 0.9,
) -> hc.Chain:
    """The chain of ``segmented`` granule by granule."""
    small = [{**steel, "radius": 4e-3 * ratio**k} for k in range(2)]
    granules = [steel, soft] * pairs + small
    values: dict[str, Any] = {key: [one[key] for one in granules] for key in STEEL}
    return hc.Chain(len(granules), **values, gap=[0.0] * 2 * pairs + [1e-6] * 2)


def are_rows_of(
    sweep: hc.Sweep, expected: Iterable[tuple[Mapping[str, Any], hc.Scene]], rtol: float = 1e-4
) -> None:
    """Assert that rows are single runs of scenes made by hand, in order, to the last digit."""
    table, peaks = sweep.to_frame(), sweep.peaks_to_frame()
    wanted = list(expected)
    assert len(table) == len(wanted)
    assert table["failure"].isna().all()
    for row, (values, scene) in zip(table.to_dict("records"), wanted, strict=True):
        assert {name: row[name] for name in values} == values
        result = hc.Native(rtol=rtol, peaks_only=True).run(scene)
        assert row["chain.granules"] == scene.chain.granules
        has_numbers(row, of_result(result))
        own = peaks[peaks["scene"] == row["scene"]]
        assert own["contact"].tolist() == result.contact.tolist()
        np.testing.assert_array_equal(own["peak_force_N"], result.peak_force)
        np.testing.assert_array_equal(own["peak_time_s"], result.peak_time)
        for name in ("first_peak_force_N", "arrival_time_s"):
            never = np.full(result.peak_force.size, np.nan)
            np.testing.assert_array_equal(own[name], result.first_columns.get(name, never))


def swept(scene: hc.Scene, vary: dict[str, Any], **more: Any) -> hc.Sweep:
    return hc.sweep(scene, vary, rtol=1e-4, peaks=True, **more)


# Measured columns


def test_a_striker_and_a_wall() -> None:
    """A wall that is not elastic has no modulus, though the scene has one for those that are."""
    scene = replace(STRIKER, wall=hc.Wall("elastic", 70e9, 0.33))
    sweep = swept(
        scene,
        {
            "striker.velocity": "0.1 m/s, 1 m/s",
            "wall.kind": "rigid,same,elastic",
            "chain.granules": [4, 6],
        },
    )
    walls = {
        "rigid": hc.Wall("rigid"),
        "same": hc.Wall("same"),
        "elastic": hc.Wall("elastic", 70e9, 0.33),
    }
    are_rows_of(
        sweep,
        (
            (
                {"striker.velocity": velocity, "wall.kind": kind},
                hc.Scene(hc.Chain(granules, **STEEL), hc.Striker(velocity), wall=walls[kind]),
            )
            for velocity, kind, granules in itertools.product((0.1, 1.0), walls, (4, 6))
        ),
    )
    table = sweep.to_frame()
    assert (table["wall.young_modulus"].notna() == (table["wall.kind"] == "elastic")).all()
    slow, fast = (table[table["striker.velocity"] == v] for v in (0.1, 1.0))
    for name in ("largest_peak_force_N", "wall_peak_force_N"):
        ratio = fast[name].to_numpy() / slow[name].to_numpy()
        # Hertz's law scales: F goes with v^(6/5). Both runs are the same in natural units.
        np.testing.assert_allclose(ratio, 10**1.2, rtol=1e-9)


def test_segments_do_what_the_file_would(segmented: hc.Scene) -> None:
    """Defaults reach segments and cells that do not name them."""
    sweep = swept(
        segmented,
        {
            "chain.young_modulus": "100 GPa,193 GPa",
            "chain.segments.1.granules": [2, 4],
            "segments.1.cell.2.density": [2200.0, 1000.0],
            "chain.segments.2.radius_ratio": [0.9, 0.8],
        },
    )
    choices = itertools.product((100e9, 193e9), (1, 2), (2200.0, 1000.0), (0.9, 0.8))
    are_rows_of(
        sweep,
        (
            (
                {
                    "chain.young_modulus": modulus,
                    "chain.segments.1.granules": 2 * pairs,
                    "chain.segments.1.cell.2.density": density,
                    "chain.segments.2.radius_ratio": ratio,
                },
                hc.Scene(
                    chain_of(
                        {**STEEL, "young_modulus": modulus},
                        {**PTFE, "density": density},
                        pairs,
                        ratio,
                    ),
                    PULSE,
                ),
            )
            for modulus, pairs, density, ratio in choices
        ),
    )


def test_loads() -> None:
    scene = replace(LOADED, wall=hc.Wall("same"))
    sweep = swept(
        scene, {"precompression.force": [5.0, 20.0], "gravity": [0.0, 9.81], "rise_time": ["30 us"]}
    )
    are_rows_of(
        sweep,
        (
            (
                {"precompression.force": force, "precompression.gravity": gravity},
                hc.Scene(
                    CHAIN,
                    hc.Pulse("cosine", 100.0, 2.0, rise_time=3e-5),
                    wall=hc.Wall("same"),
                    precompression=hc.Precompression(force, gravity),
                ),
            )
            for force, gravity in itertools.product((5.0, 20.0), (0.0, 9.81))
        ),
    )
    table = sweep.to_frame()
    assert (table["shock.rise_time"] == 3e-5).all()
    ratio = table["shock.momentum_ratio"].tolist()
    assert ratio == ratio[:1] * 4  # that of the shock alone


def test_gaps_of_a_plain_scene() -> None:
    """Without a gap there is a transition; with gaps there is no p."""
    chain = hc.Chain(20, **STEEL)
    sweep = swept(replace(PLAIN, chain=chain), {"gap": "0,1e-7"})
    scenes = [hc.Scene(hc.Chain(20, **STEEL, gap=gap), PULSE) for gap in (0.0, 1e-7)]
    are_rows_of(sweep, [({"chain.gap": scene.chain.gap}, scene) for scene in scenes])
    found = hc.Native(rtol=1e-4, peaks_only=True).run(scenes[0])
    table = sweep.to_frame()
    p, none = table["transition_granules"].tolist()
    assert p == found.transition_granules
    assert pd.isna(none)
    assert table["solitary_wave_force_N"][0] == found.solitary_wave.peak_force


def test_granules_listed_one_by_one_and_a_pulse_table() -> None:
    radii = [4.75e-3 * 0.97**k for k in range(6)]
    others = {key: value for key, value in STEEL.items() if key != "radius"}
    table = hc.PulseTable((0.0, 2e-5, 6e-5), (0.0, 100.0, 0.0))
    sweep = swept(
        hc.Scene(hc.Chain(6, radii, **others), table, wall=hc.Wall("same")),
        {"density": [1000.0, 7958.0], "wall.gap": ["0", "2 um"]},
    )
    scenes = [
        hc.Scene(
            hc.Chain(6, radii, **{**others, "density": density}),
            table,
            wall=hc.Wall("same", gap=gap),
        )
        for density, gap in itertools.product((1000.0, 7958.0), (0.0, 2e-6))
    ]
    are_rows_of(
        sweep,
        [({"chain.density": one.chain.density, "shock.profile": "table"}, one) for one in scenes],
    )
    found = sweep.to_frame()
    assert found["chain.radius"].isna().all()
    assert found["shock.momentum_ratio"].tolist() == [one.momentum_ratio for one in scenes]


@pytest.mark.lammps
def test_two_codes_agree(segmented: hc.Scene) -> None:
    lammps = hc.Lammps(rtol=1e-3, extrapolated=True)
    vary: dict[str, Any] = {"chain.segments.1.cell.2.young_modulus": "1 GPa,2 GPa"}
    sweep = hc.sweep(segmented, vary, backends=[hc.Native(rtol=1e-6), lammps], peaks=True)
    table, peaks = sweep.to_frame(), sweep.peaks_to_frame()
    assert table["failure"].isna().all()
    native, other = (peaks[peaks["backend"] == name] for name in ("native", "lammps"))
    bound = table[table["backend"] == "lammps"]["error_estimate"].max() + 1e-6
    off = np.abs(other["peak_force_N"].to_numpy() / native["peak_force_N"].to_numpy() - 1)
    assert off.max() <= bound
    alone = lammps.run(replace(segmented, chain=chain_of(soft={**PTFE, "young_modulus": 1e9})))
    # The same deck, and the same version of LAMMPS.
    np.testing.assert_array_equal(other["peak_force_N"][:5], alone.peak_force)


def test_what_fails_is_a_row_with_its_reason() -> None:
    """A load of nothing, where two values meet; an overlap above a radius."""
    scene = replace(LOADED, wall=hc.Wall("rigid"))
    vary: dict[str, Any] = {
        "precompression.force": [0.0, 5.0], "precompression.gravity": [0.0, 9.81]
    }  # fmt: skip
    table = swept(scene, vary).to_frame()
    assert "precompression.force and gravity: both are 0" in table["failure"][0]
    assert table["failure"].notna().tolist() == [True, False, False, False]
    deep = swept(STRIKER, {"velocity": [1.0, 5000.0]})
    assert deep.count().failed == 1
    assert "Hertz's law does not apply there" in str(deep.count().reason)


@pytest.mark.parametrize("force", [[0.0, 5.0], [5.0, 0.0]], ids=str)
@pytest.mark.parametrize("gravity", [[0.0, 9.81], [9.81, 0.0]], ids=str)
@pytest.mark.parametrize("load", [hc.Precompression(5.0), hc.Precompression(gravity=9.81)], ids=str)
def test_the_order_of_values_refuses_nothing(
    load: hc.Precompression, gravity: list[float], force: list[float]
) -> None:
    """Either load can be 0 where the other is not, wherever that is in its list."""
    scene = replace(LOADED, wall=hc.Wall("rigid"), precompression=load)
    vary = {"precompression.force": force, "precompression.gravity": gravity}
    assert design(scene, vary).scenes == 4


def test_runs_that_end_before_all_peaks_are_told(
    hertzchain: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    STRIKER.to_toml(tmp_path / "scene.toml")
    done = hertzchain("sweep", "scene.toml", "--vary", "end_time=50 us,1 ms", "-o", "out")
    assert done.status == 0
    assert "in 1 of 2 rows the run may have ended before the last peaks" in done.err
    table = hc.Sweep.load("out").to_frame()
    short = hc.Native(rtol=1e-6).run(replace(STRIKER, run=hc.Run(5e-5)))
    assert any("the run ended before" in text for text in short.warnings)
    assert table["contacts_cut_off"][0] == len(short.cut_off) > 0
    assert pd.isna(table["contacts_cut_off"][1])
    assert hc.sweep(PLAIN, {"end_time": [5e-5]}).count().cut_off == 0


# Columns of the table


def test_columns() -> None:
    table = swept(STRIKER, {"striker.velocity": [1.0]}).to_frame()
    assert list(table.columns) == [
        *("scene", "backend", "chain.granules", "chain.radius", "chain.young_modulus"),
        *("chain.poisson_ratio", "chain.density", "striker.velocity", "wall.kind", "run.end_time"),
        *("largest_peak_force_N", "largest_peak_contact", "last_peak_force_N"),
        *("wall_first_peak_force_N", "wall_arrival_time_s", "wall_peak_force_N"),
        *("wall_peak_time_s", "contacts_cut_off", "overlap_ratio"),
        *("error_estimate", "force_evaluations", "failure"),
    ]
    typed = hc.Scene(hc.Chain(6, 1, 10**9, 0, 7800), hc.Striker(1), wall=hc.Wall("rigid"))
    other = swept(typed, {"striker.velocity": [1]}).to_frame()
    assert other.dtypes.to_dict() == table.dtypes.to_dict()


def test_plain_scenes_have_the_columns_of_before() -> None:
    found = design(PLAIN, {"chain.radius": [1.0, 2.0]})
    assert tuple(column.name for column in found.columns) == COLUMNS
    manifest = found.to_dict()
    assert tuple(one.name for one in columns_of(manifest["scene"], ["chain.radius"])) == COLUMNS


def test_every_parameter_has_a_label_and_a_unit() -> None:
    segments = ("granules", "radius", "radius_ratio", "gap")
    names = [*TERMS, *(f"chain.segments.2.{key}" for key in segments)]
    for name in (*names, "chain.segments.1.cell.2.density"):
        column = column_named(name)
        assert column.label
        assert column.title.count("{") == 1
        key = key_named(name)
        assert key is not None
        assert not key.unit or f"[{key.unit}]".replace("^3", "³").replace("^2", "²") in column.label
    assert column_named("chain.segments.2.granules").label == "granules, segment 2"


# Parameters that cannot vary

REFUSED: list[tuple[hc.Scene, dict[str, Any], str]] = [
    (PLAIN, {"striker.velocity": "1,2"}, "the scene has no [striker]; add the section to its file"),
    (PLAIN, {"velocity": "1,2"}, "striker.velocity: cannot vary: the scene has no [striker]"),
    (PLAIN, {"wall.kind": "rigid,same"}, "wall.kind: cannot vary: the scene has no [wall]; add"),
    (PLAIN, {"precompression.force": "1,2"}, "the scene has no [precompression]; add the section"),
    (PLAIN, {"chain.segments.1.radius": "1,2"}, "the scene has no [[chain.segments]]; add some"),
    (PLAIN, {"wall": "1,2"}, "wall: cannot vary: the scene has no [wall]; add the section"),
    (STRIKER, {"shock.colour": "1,2"}, "cannot vary: the scene has a [striker] and no [shock]"),
    (STRIKER, {"wall.colour": "1,2"}, "what can vary: chain.granules, chain.radius, chain.y"),
    (STRIKER, {"shock.peak_force": "1,2"}, "cannot vary: the scene has a [striker] and no [shock]"),
    (STRIKER, {"radius": "1,2"}, "is in several sections: name one of chain.radius, striker.rad"),
    (STRIKER, {"striker.velocty": "1,2"}, "cannot vary; did you mean striker.velocity? What can"),
    (STRIKER, {"wall.kind": "rigid,soft"}, "wall.kind = 'soft': must be one of rigid, same, elas"),
    (STRIKER, {"wall.kind": "rigid:same:2"}, "has no range: name its values, rigid,same"),
    (STRIKER, {"wall.kind": [1, 2]}, "wall.kind = 1: must be the name of a wall"),
    (STRIKER, {"wall.kind": "rigid,elastic"}, "wall.young_modulus: missing, a wall of kind"),
    (STRIKER, {"wall.young_modulus": "1,2"}, 'only a wall of kind "elastic" has it, in all scenes'),
    (STRIKER, {"striker.velocity": "0,1"}, "striker.velocity = 0.0: must be a finite number above"),
    (STRIKER, {"striker.velocity": "1 m,2 m"}, "has the wrong dimension"),
    (STRIKER, {"striker.poisson_ratio": "0.1:0.6:3"}, "striker.poisson_ratio = 0.6: must be"),
    (STRIKER, {"chain.granules": "4,1000001"}, "must be at most 1,000,000 in a sweep"),
    (LOADED, {"precompression.force": [0.0, 1.0]}, "precompression.force and gravity: both are 0"),
    (LOADED, {"gravity": [0.0, 1.0]}, "precompression.gravity = 1.0: needs a [wall]"),
    (LOADED, {"chain.gap": [0.0, 1e-6]}, "chain.gap: must be 0 with [precompression]"),
    (
        replace(PLAIN, chain=chain_of()),
        {"chain.radius": "1,2"},
        "chain.radius: cannot vary: each granule has its own; describe them by [[chain.segments]]",
    ),
]


@pytest.mark.parametrize(("scene", "vary", "words"), REFUSED, ids=[one[2] for one in REFUSED])
def test_what_cannot_vary_is_refused_in_a_sentence(
    scene: hc.Scene, vary: dict[str, Any], words: str
) -> None:
    with pytest.raises(SceneError) as problem:
        design(scene, vary)
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)


OF_SEGMENTS = {
    "granules": "chain.granules: cannot vary: it is the sum over the segments",
    "chain.segments.3.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.0.radius": "cannot vary; did you mean chain.segments.",
    "chain.segments.1.radius_ratio": "did you mean chain.segments.2.radius_ratio?",
    "chain.segments.1.cell.3.density": "cannot vary; did you mean chain.segments.",
    "segments.2.cell.1.density": "cannot vary; did you mean chain.segments.",
    "chain.segments.1": "chain.segments.1: cannot vary; ",
    "chain.colour": "end_time, keys of segments, such as chain.segments.2.radius_ratio",
    "chain.segments.2.radius": "chain.segments.2.radius = 0.0: must be a finite number above 0 [m]",
    "chain.segments.2.radius_ratio": "chain.segments.2.radius_ratio = 0.0: must be a finite number",
    "chain.segments.2.granules": "chain.segments.2.granules = 0: must be an integer from 1",
}


@pytest.mark.parametrize("name", OF_SEGMENTS)
def test_what_segments_do_not_have_is_refused(segmented: hc.Scene, name: str) -> None:
    with pytest.raises(SceneError) as problem:
        design(segmented, {name: [0, 2]})
    assert OF_SEGMENTS[name] in str(problem.value)


def test_a_ratio_whose_radii_leave_floating_point_is_refused(tmp_path: Path) -> None:
    taper = "[[chain.segments]]\ngranules = 6\n"
    (tmp_path / "taper.toml").write_text(CHAIN_SECTION + taper + SHOCK)
    scene = hc.Scene.from_toml(tmp_path / "taper.toml")
    words = r"segments\.1\.radius_ratio = 1e-300: gives granule 3 chain\.radius = 0\.0, which"
    with pytest.raises(SceneError, match=words):
        design(scene, {"chain.segments.1.radius_ratio": [1e-300, 1.0]})


def test_a_chain_with_other_values_has_no_segments(segmented: hc.Scene) -> None:
    """The segments of the file would not describe it."""
    assert segmented.chain.section is not None
    assert pickle.loads(pickle.dumps(segmented)).chain.section == segmented.chain.section  # noqa: S301
    assert replace(segmented, shock=hc.Striker(1.0)).chain.section is not None
    other = replace(segmented.chain, density=1000.0)
    assert other.section is None
    with pytest.raises(SceneError, match="each granule has its own"):
        design(replace(segmented, chain=other), {"chain.radius": [1.0, 2.0]})


def test_formulas_are_refused() -> None:
    for scene, vary, words in (
        (STRIKER, {"striker.velocity": [1.0]}, "this sweep has striker, wall: leave them out"),
        (PLAIN, {"chain.gap": [0.0, 1e-6]}, "this sweep has chain.gap: leave them out"),
    ):
        with pytest.raises(SceneError) as problem:
            hc.sweep(scene, vary, backends=["native", "formulas"])
        assert words in str(problem.value)


# Stored sweeps


def test_a_segment_belongs_to_the_sweep(segmented: hc.Scene, tmp_path: Path) -> None:
    vary = {"chain.segments.2.gap": [0.0, 1e-6]}
    swept(segmented, vary, output=tmp_path / "out")
    (tmp_path / "other.toml").write_text((CHAIN_SECTION + SEGMENTS + SHOCK).replace("0.46", "0.45"))
    with pytest.raises(OutputError, match="belongs to another sweep"):
        swept(hc.Scene.from_toml(tmp_path / "other.toml"), vary, output=tmp_path / "out")


# Pictures


def test_a_result_over_a_term_with_walls_told_apart(tmp_path: Path, hertzchain: Command) -> None:
    vary = {"striker.velocity": "0.1:10:3:log", "wall.kind": "same,rigid"}
    sweep = swept(STRIKER, vary, output=tmp_path / "out")
    drawn = draw(sweep, "velocity", "wall_peak_force_N", "kind")
    (axes,) = drawn.figure.axes
    assert [text.get_text() for text in drawn.figure.legends[0].get_texts()] == ["same", "rigid"]
    assert axes.get_xlabel() == "velocity of the striker [m/s]"
    assert axes.get_ylabel() == "peak force on the wall [N]"
    assert axes.get_title() == "6 granules, native"
    assert axes.get_xscale() == "log"
    table = sweep.to_frame()
    for kind, line in zip(("same", "rigid"), axes.lines, strict=True):
        own = table[table["wall.kind"] == kind]
        np.testing.assert_array_equal(line.get_xdata(), own["striker.velocity"])
        np.testing.assert_array_equal(line.get_ydata(), own["wall_peak_force_N"])
    (only,) = draw(sweep, "velocity", "last_peak_force_N", where={"wall.kind": "rigid"}).figure.axes
    assert only.get_title() == "6 granules, rigid wall, native"
    done = hertzchain("plot", tmp_path / "out", "--x", "velocity", "--y", "largest_peak_force_N")
    assert done.status == 0
    assert "wall.kind varies, too" in done.err
    assert (tmp_path / "out" / "plot.png").exists()
    is_refused(
        hertzchain("plot", tmp_path / "out", "--x", "velocity", "--y", "transition_granules"),
        "is no column of a sweep, which has scene, backend, chain.granules",
    )


def test_a_map_over_segments(segmented: hc.Scene) -> None:
    vary: dict[str, Any] = {
        "chain.segments.1.granules": [2, 4, 6], "chain.segments.2.radius": "3 mm:4 mm:3"
    }  # fmt: skip
    x, y = vary
    drawn = draw(swept(segmented, vary), x, y, "last_peak_force_N")
    axes, bar = drawn.figure.axes
    assert axes.get_xlabel() == "granules, segment 1"
    assert axes.get_ylabel() == "radius R [mm], segment 2"
    assert bar.get_ylabel() == "peak force of contact N [N]"
    title = "cosine pulse, n = 2, LM_ratio = 1, F0 = 100 N, native"
    assert axes.get_title() == title  # without N, which varies
    assert drawn.remarks == ()


def test_a_title_names_a_segment_that_is_fixed(segmented: hc.Scene) -> None:
    vary: dict[str, Any] = {"chain.segments.2.radius": "3 mm:4 mm:3", "chain.density": [1e3, 8e3]}
    where = {"chain.segments.2.radius": "3 mm"}
    drawn = draw(swept(segmented, vary), "chain.density", "last_peak_force_N", where=where)
    title = drawn.figure.axes[0].get_title().replace("\n", " ")  # it is wrapped
    assert title.endswith("native, radius R, segment 2: 3 mm")


def test_parameters_of_plain_scenes_are_not_those_of_terms() -> None:
    assert not set(PARAMETERS) & set(TERMS)


# Any file


def files() -> st.SearchStrategy[dict[str, Any]]:
    """Scene files with terms, as mappings."""
    number = {
        "radius": st.sampled_from([4e-3, "5 mm"]),
        "young_modulus": st.sampled_from([1e11, "70 GPa"]),
        "poisson_ratio": st.sampled_from([0.2, 0.3]),
        "density": st.sampled_from([2000, "7.9 g/cm^3"]),
    }
    gap = {"gap": st.sampled_from([0, "1 um"])}
    different = st.fixed_dictionaries({}, optional=number | gap)
    count = st.integers(1, 4)
    segment = st.one_of(
        st.fixed_dictionaries(
            {"granules": count},
            optional={**number, **gap, "radius_ratio": st.sampled_from([0.9, 1.1])},
        ),
        st.fixed_dictionaries(
            {"granules": count, "cell": st.lists(different, min_size=1, max_size=3)},
            optional=number,
        ),
    )
    wall = st.one_of(
        st.fixed_dictionaries({"kind": st.sampled_from(["rigid", "same"])}, optional=gap),
        st.just({"kind": "elastic", "young_modulus": "200 GPa", "poisson_ratio": 0.3}),
    )
    pulse = st.fixed_dictionaries(
        {"profile": st.just("cosine"), "peak_force": st.just(100), "duration_ratio": st.just(2)}
    )
    measure = st.sampled_from([{"momentum_ratio": 1.5}, {"rise_time": "30 us"}])
    return st.fixed_dictionaries(
        {
            "chain": st.fixed_dictionaries(
                number, optional={**gap, "segments": st.lists(segment, min_size=2, max_size=3)}
            ),
            "push": st.one_of(
                st.tuples(st.just("shock"), pulse, measure),
                st.tuples(
                    st.just("striker"),
                    st.fixed_dictionaries({"velocity": st.just("1 m/s")}, optional=number),
                ),
            ),
        },
        optional={"wall": wall, "precompression": st.just({"force": "5 N"})},
    )


def text_of(document: dict[str, Any]) -> str:
    """The file of such a mapping."""
    document = copy.deepcopy(document)
    name, *parts = document.pop("push")
    document[name] = {key: value for part in parts for key, value in part.items()}
    segments = document["chain"].get("segments", [])
    counts = [segment["granules"] for segment in segments]
    document["chain"].setdefault("granules", sum(counts) or 7)
    return tomli_w.dumps(document)


VALUES: dict[str, list[Any]] = {
    "granules": [3, 5],
    "radius": [4.5e-3, 6e-3],
    "young_modulus": [8e10, 2e11],
    "poisson_ratio": [0.1, 0.4],
    "density": [3000.0, 9000.0],
    "gap": [0.0, 2e-6],
    "radius_ratio": [0.8, 1.0],
    "velocity": [0.5, 2.0],
    "kind": ["rigid", "same"],
    "force": [1.0, 10.0],
    "gravity": [0.0, 9.81],
    "peak_force": [10.0, 50.0],
    "momentum_ratio": [0.5, 2.0],
    "rise_time": [2e-5, 4e-5],
    "end_time": [1e-3, 2e-3],
    "duration_ratio": [3.0, 4.0],
    "profile": ["triangular", "cosine-triangular"],
}


@given(st.data())
@settings(max_examples=20)
def test_a_parameter_is_a_key_of_the_file(data: st.DataObject) -> None:
    """Each scene of a sweep equals a file with the keys changed by hand."""
    document = data.draw(files())
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"

        def read(changed: dict[str, Any]) -> hc.Scene:
            path.write_text(text_of(changed))
            return hc.Scene.from_toml(path)

        try:
            base = read(document)
        except SceneError:
            return
        names = data.draw(
            st.lists(st.sampled_from(names_of(base)), min_size=1, max_size=3, unique=True)
        )
        vary = {name: VALUES[name.rpartition(".")[2]] for name in names}
        try:
            found = design(base, vary)
        except SceneError:  # other tests are about these
            return
        parameters = found.parameters(np.arange(found.scenes))
        for k, values in enumerate(itertools.product(*vary.values())):
            wanted = copy.deepcopy(document)
            for name, value in zip(names, values, strict=True):
                type_in(wanted, name, value)
            try:
                expected = read(wanted)
            except SceneError as problem:
                with pytest.raises(SceneError, match=re.escape(problem.allowed)):
                    found.scene(parameters, k)
                continue
            assert found.scene(parameters, k) == expected
            assert parameters["chain.granules"][k] == expected.chain.granules


def type_in(document: dict[str, Any], name: str, value: Any) -> None:
    """Change a key of a scene file as a person would."""
    section, *path, key = name.split(".")
    if section in ("shock", "striker"):
        for part in document["push"][1:]:
            if key in part or {key, *part} <= {"momentum_ratio", "rise_time"}:
                if len(part) == 1:  # the other measure of the pulse
                    part.clear()
                part[key] = value
                return
        document["push"][1][key] = value
        return
    at: Any = document.setdefault(section, {})
    if (section, key) == ("wall", "kind"):
        at.pop("young_modulus", None)
        at.pop("poisson_ratio", None)
    for step in path:
        at = at[int(step) - 1] if step.isdigit() else at[step]
    at[key] = value


def test_gauges_have_columns() -> None:
    scene = hc.Scene(CHAIN, hc.Striker(1.0), gauges=(hc.Gauge(granule=3), hc.Gauge(contact=2)))
    table = hc.sweep(scene, vary={"striker.velocity": [0.5, 1.0]}).to_frame()
    for row, velocity in enumerate((0.5, 1.0)):
        read = hc.Native(rtol=1e-6).run(replace(scene, shock=hc.Striker(velocity))).gauges
        for number, one in enumerate(read, 1):
            names = f"gauge_{number}_first_peak_force_N", f"gauge_{number}_arrival_time_s"
            found = [table[name].iloc[row] for name in names]
            # The same run, but that it drops granules that change no peak.
            assert found == pytest.approx([one.force, one.arrival], rel=3e-6)
    plain = hc.Scene(
        CHAIN, hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0), gauges=(hc.Gauge(contact=3),)
    )
    table = hc.sweep(plain, vary={"shock.peak_force": [50.0, 100.0]}).to_frame()
    assert table["gauge_1_first_peak_force_N"].gt(0).all()
