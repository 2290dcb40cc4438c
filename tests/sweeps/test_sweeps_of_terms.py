"""Sweeps of scenes with terms: each row is a run of the scene that its file would describe."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.sweeps.columns import COLUMNS, column_named, columns_of, numbers_of
from hertzchain.sweeps.design import design
from tests.command_line import Command
from tests.conftest import STEEL
from tests.sweeps.made import has_numbers

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
    values: dict[str, Any] = {key: [one[key] for one in granules] for key in STEEL}
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
        *("error_estimate", "wanted_error", "force_evaluations", "failure"),
    ]


def test_plain_scenes_have_the_columns_of_before() -> None:
    found = design(PLAIN, {"chain.radius": [1.0, 2.0]})
    assert tuple(column.name for column in found.columns) == COLUMNS
    manifest = found.to_dict()
    assert tuple(one.name for one in columns_of(manifest["scene"], ["chain.radius"])) == COLUMNS


def test_a_key_of_a_segment_has_a_label_with_its_unit() -> None:
    assert column_named("chain.segments.2.granules").label == "granules, segment 2"
    density = column_named("chain.segments.1.cell.2.density")
    assert density.label == "density [kg/m³], segment 1, granule 2 of the cell"


# Pictures


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


def test_a_row_whose_granules_meet_nothing_has_the_reason() -> None:
    thrown = hc.Scene(hc.Chain(3, **STEEL, velocity=1.0), wall=hc.Wall("rigid"))
    table = hc.sweep(thrown, {"chain.velocity": [-1.0, 0.0, 1.0]}).to_frame()
    assert table["failure"].str.partition(":")[0].fillna("").tolist() == [
        "velocities at the start", "[shock]", ""
    ]  # fmt: skip
    assert table["wall_peak_force_N"].notna().tolist() == [False, False, True]


def test_a_scene_without_memory_is_a_row_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*_: object) -> hc.Result:
        raise MemoryError

    monkeypatch.setattr(hc.Native, "run", run)
    rows = hc.sweep(STRIKER, {"striker.velocity": "0.5,1"}).to_frame()
    assert rows["failure"].tolist() == ["there is not enough memory for this scene"] * 2
