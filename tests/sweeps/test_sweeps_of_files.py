"""Sweeps of any scene: each scene equals a file with the keys typed in, and each row its run."""

from __future__ import annotations

import copy
import itertools
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import tomli_w

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.scene.starters import STARTERS, write_starter
from hertzchain.sweeps.columns import names_of, numbers_of
from hertzchain.sweeps.design import design
from tests.command_line import Command
from tests.conftest import STEEL
from tests.sweeps.conftest import has_numbers

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
    "amplitude": [0.5, 1.0],
    "frequency": [4e3, 9e3],
    "cycles": [1, 3],
    "granule": [2, 3],
    "momentum_ratio": [0.5, 2.0],
    "rise_time": [2e-5, 4e-5],
    "fall_time": [2e-5, 4e-5],
    "duration": [1e-4, 2e-4],
    "end_time": [1e-3, 2e-3],
    "duration_ratio": [3.0, 4.0],
    "profile": ["triangular", "cosine-triangular"],
    "restitution": [0.5, 0.9],
    "relaxation_time": [1e-7, 1e-6],
    "coefficient": [1.0, 5.0],
}
MEASURES = ("momentum_ratio", "rise_time")
"""Each replaces the other."""


@pytest.mark.parametrize("kind", STARTERS)
def test_a_parameter_is_a_key_of_the_file(kind: str, tmp_path: Path) -> None:
    """Each scene of a sweep over a key and the next one equals a file changed by hand."""
    path = write_starter(kind, tmp_path / "scene.toml")[0]
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    base = hc.Scene.from_toml(path)
    for varied in itertools.pairwise(names_of(base)):
        vary = {name: VALUES[name.rpartition(".")[2]] for name in varied}
        try:
            layout = design(base, vary)
        except SceneError as problem:
            if not re.search("replaces|cannot vary", str(problem)):  # no file has these values
                for values in itertools.product(*vary.values()):
                    path.write_text(typed_in(document, dict(zip(varied, values, strict=True))))
                    with pytest.raises(SceneError):
                        hc.Scene.from_toml(path)
            continue
        parameters = layout.parameters(np.arange(layout.scenes))
        for k, values in list(enumerate(itertools.product(*vary.values())))[1:3]:
            path.write_text(typed_in(document, dict(zip(varied, values, strict=True))))
            try:
                expected = hc.Scene.from_toml(path)
            except SceneError as problem:
                with pytest.raises(SceneError, match=re.escape(problem.allowed)):
                    layout.scene(parameters, k)
                continue
            assert layout.scene(parameters, k) == expected
            assert parameters["chain.granules"][k] == expected.chain.granules


def typed_in(document: dict[str, Any], values: dict[str, Any]) -> str:
    """Change keys of a scene file as a person would."""
    document = copy.deepcopy(document)
    for name, value in values.items():
        section, *path, key = name.split(".")
        at: Any = document.setdefault(section, {})
        gone = MEASURES if key in MEASURES else ()
        if key == "kind":
            gone = ("young_modulus", "poisson_ratio")
        for other in gone:
            at.pop(other, None)
        for step in path:
            at = at[int(step) - 1] if step.isdigit() else at[step]
        at[key] = value
    chain = document["chain"]
    if segments := chain.get("segments"):
        chain["granules"] = sum(segment["granules"] for segment in segments)
    return tomli_w.dumps(document)


# Rows


PTFE = {"radius": 4.75e-3, "young_modulus": 1.46e9, "poisson_ratio": 0.46, "density": 2200.0}
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
CHAIN = hc.Chain(6, **STEEL)
PLAIN = hc.Scene(CHAIN, PULSE)
STRIKER = hc.Scene(CHAIN, hc.Striker(1.0), wall=hc.Wall("rigid"))
LOADED = hc.Scene(CHAIN, PULSE, precompression=hc.Precompression(5.0))


def chain_of(soft: Mapping[str, float] = PTFE) -> hc.Chain:
    """The chain of ``segmented`` granule by granule."""
    small = [{**STEEL, "radius": 4e-3 * 0.9**k} for k in range(2)]
    granules = [STEEL, soft] * 2 + small
    values: dict[str, Any] = {key: [granule[key] for granule in granules] for key in STEEL}
    return hc.Chain(len(granules), **values, gap=[0.0] * 4 + [1e-6] * 2)


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
        has_numbers(row, numbers_of(result))
        rows = peaks[peaks["scene"] == row["scene"]]
        assert rows["contact"].tolist() == result.contact.tolist()
        np.testing.assert_array_equal(rows["peak_force_N"], result.peak_force)
        np.testing.assert_array_equal(rows["peak_time_s"], result.peak_time)
        for name in ("first_peak_force_N", "arrival_time_s"):
            never = np.full(result.peak_force.size, np.nan)
            np.testing.assert_array_equal(rows[name], result.first_columns.get(name, never))


def swept(scene: hc.Scene, vary: dict[str, Any], **more: Any) -> hc.Sweep:
    return hc.sweep(scene, vary, rtol=1e-4, peaks=True, **more)


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
    walls = {"rigid": hc.Wall("rigid"), "same": hc.Wall("same"), "elastic": scene.wall}
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


def test_a_chain_with_other_values_has_no_segments(segmented: hc.Scene) -> None:
    """The segments of the file would not describe it."""
    assert replace(segmented, shock=hc.Striker(1.0)).chain.section is not None
    other = replace(segmented, chain=replace(segmented.chain, density=1000.0))
    assert other.chain.section is None
    with pytest.raises(SceneError, match=r"segments\.1\.density: cannot vary"):
        design(other, {"chain.segments.1.density": [1e3, 2e3]})


def test_a_taper_whose_radii_leave_floating_point_is_the_reason_in_a_row(
    segmented: hc.Scene,
) -> None:
    scene = replace(segmented, run=hc.Run(1e-5))
    bad, good = hc.sweep(scene, {"chain.segments.2.radius_ratio": [1e-322, 0.9]}).to_frame()[
        "failure"
    ]
    assert "chain.radius of granule 6 = 0.0: must be" in bad
    assert pd.isna(good)


@pytest.mark.lammps
@pytest.mark.usefixtures("one_core")
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


# Pistons, walls and moving granules


PISTON = hc.Scene(CHAIN, hc.Piston(0.1))
TABLE = replace(PISTON, shock=hc.Piston(None, (0.0, 1e-5), (0.0, 1e-6)))
SINE = hc.Scene(CHAIN, hc.Sine(5.0, 8000.0, 2), precompression=hc.Precompression(10.0))


def test_both_walls_have_columns_and_accuracy_is_asked_of_first_pulses(tmp_path: Path) -> None:
    """Later peaks of granules between two walls are less accurate, as in a run of one scene."""
    scene = hc.Scene.from_toml(write_starter("two-walls", tmp_path / "walls.toml")[0])
    sweep = hc.sweep(scene, {"chain.density": [7000.0, 8000.0]})
    counts, row = sweep.count(), sweep.to_frame().iloc[0]
    assert (counts.done, counts.failed, counts.missed) == (2, 0, 0)
    assert row["wanted_error"] <= 1e-6 < row["error_estimate"]
    chain = replace(scene.chain, density=7000.0)
    run = hc.Native(peaks_only=True).run(replace(scene, chain=chain))
    for wall, k in (("near_wall", 0), ("wall", -1)):
        columns = {
            **run.first_columns,
            "peak_force_N": run.peak_force,
            "peak_time_s": run.peak_time,
        }
        for name in ("first_peak_force_N", "arrival_time_s", "peak_force_N", "peak_time_s"):
            assert row[f"{wall}_{name}"] == columns[name][k]
