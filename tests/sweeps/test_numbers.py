"""Numbers of results: each column of a batch against the same column of a single run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.scene.keys import keys_of
from hertzchain.scene.parts import KEYS
from hertzchain.sweeps.columns import (
    ALL,
    FOUND_COLUMNS,
    PARAMETERS,
    TERMS,
    column_named,
    is_result,
    is_whole,
    numbers_of,
)
from hertzchain.sweeps.design import design
from hertzchain.sweeps.parts import is_batched
from tests.conftest import STEEL, paper_scene

SMALL = replace(
    paper_scene("cosine", 1.0, 2.0, granules=60), chain=hc.Chain(60, **STEEL | {"radius": 1e-3})
)
"""A scene whose natural units are far from 1 in SI, and others in each row of the sweep."""

VARY = {"shock.peak_force": "2:40:3", "shock.momentum_ratio": "0.5,2"}

IN_BATCHES = [one.name for one in ALL if is_result(one.name)]


@pytest.fixture(scope="module")
def pairs() -> list[tuple[dict[str, Any], hc.Result]]:
    """Each row of a batch, and the scene run by itself."""
    found = design(SMALL, VARY)
    assert is_batched(found, hc.Native())
    rows: list[Any] = hc.sweep(SMALL, VARY, rtol=1e-7).to_frame().to_dict("records")
    parameters = found.parameters(np.arange(found.scenes))
    scenes = [found.scene(parameters, k) for k in range(found.scenes)]
    return list(zip(rows, map(hc.Native(rtol=1e-7).run, scenes), strict=True))


@pytest.mark.parametrize("name", IN_BATCHES)
def test_a_column_of_a_batch_is_that_of_a_single_run(
    name: str, pairs: list[tuple[dict[str, Any], hc.Result]]
) -> None:
    assert len(pairs) == 6
    for batch, run in pairs:
        single: Any = numbers_of(run)
        if name in ("error_estimate", "force_evaluations"):  # of another kernel
            assert 0 < batch[name] <= 3 * single[name] <= 30 * batch[name]
        elif name == "largest_peak_contact":  # settled waves have many alike
            assert run.peak_at(int(batch[name])) == pytest.approx(run.peak_force.max(), rel=1e-6)
        elif is_whole(name):
            assert batch[name] == single[name]
        elif name.endswith("error"):  # what is left of differences
            assert batch[name] == pytest.approx(single[name], rel=1e-3, abs=1e-7)
        else:
            assert batch[name] == pytest.approx(single[name], rel=1e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {"run": hc.Run(1e-4)},
        {"shock": hc.Striker(1.0), "wall": hc.Wall("rigid"),
         "precompression": hc.Precompression(2.0),
         "gauges": (hc.Gauge(contact=9), hc.Gauge(granule=5))},
    ],
    ids=["plain", "with all terms"],
)  # fmt: skip
def test_numbers_are_those_of_the_result(changes: dict[str, Any]) -> None:
    """In SI, from the arrays that every result has, and each of them is looked at."""
    scene = replace(SMALL, **changes)
    result = hc.Native().run(scene)
    force, wave, n = result.peak_force, result.solitary_wave, scene.chain.granules
    expected: dict[str, Any] = {
        "transition_granules": result.transition_granules,
        "solitary_wave_force_N": wave.peak_force,
        "far_field_force_N": wave.far_field_force,
        "far_field_error": wave.far_field_error,
        "speed_m_s": wave.speed,
        "speed_error": wave.speed_error,
        "largest_peak_force_N": force.max(),
        "largest_peak_contact": force.argmax() + 2,
        "last_peak_force_N": force[n - 2],
        "contacts_cut_off": len(result.cut_off),
        "overlap_ratio": result.overlap_ratio,
        "error_estimate": result.error_estimate,
        "wanted_error": result.wanted_error,
        "force_evaluations": result.force_evaluations,
    }
    if scene.wall is not None:
        assert result.first_pulses is not None
        first = result.to_frame().iloc[-1]
        expected |= {
            "largest_dynamic_force_N": (force - result.static_force).max(),
            "wall_peak_force_N": force[-1],
            "wall_peak_time_s": result.peak_time[-1],
            "wall_first_peak_force_N": first["first_peak_force_N"],
            "wall_arrival_time_s": first["arrival_time_s"],
        }
    for k, read in enumerate(result.gauges, start=1):
        expected[f"gauge_{k}_first_peak_force_N"] = read.force
        expected[f"gauge_{k}_arrival_time_s"] = read.arrival
    assert numbers_of(result) == expected
    assert all(map(is_result, expected))


def test_a_wall_that_is_pressed_at_the_end_has_no_peak_yet() -> None:
    scene = replace(SMALL, shock=hc.Striker(1.0), wall=hc.Wall("rigid"))
    whole = hc.Native().run(scene)
    cut = hc.Native().run(replace(scene, run=hc.Run(float(whole.peak_time[-1]))))
    assert numbers_of(whole)["wall_peak_force_N"] is not None
    assert numbers_of(cut)["wall_peak_force_N"] is None
    assert numbers_of(cut)["contacts_cut_off"] == len(cut.cut_off) > 0


def test_every_key_with_a_label_can_vary_and_no_other() -> None:
    assert {*PARAMETERS, *TERMS} == {name for name, key in KEYS.items() if key.label}
    assert not {*PARAMETERS} & {*TERMS}
    for name in (*PARAMETERS, *TERMS, *(one.name for one in FOUND_COLUMNS)):
        assert column_named(name).label
        unit = KEYS[name].unit if name in KEYS else ""
        assert f"[{unit}]".replace("^3", "³").replace("^2", "²") in column_named(name).label + "[]"
    assert keys_of(hc.Contact)["restitution"].allowed.endswith("no damping")
