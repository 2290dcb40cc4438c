"""Public functions and classes with one wrong argument: a sentence, and no other exception."""

from __future__ import annotations

import decimal
import math
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain import theory
from hertzchain.sweeps.design import design
from tests.conftest import STEEL

CHAIN = hc.Chain(3, **STEEL)
PULSE = hc.Pulse("cosine", 100.0, 2.0, rise_time=1e-5)
SCENE = hc.Scene(CHAIN, PULSE)
RESULT = hc.Native(rtol=1e-4).run(SCENE)
VARY = {"shock.momentum_ratio": "1"}

CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Chain": (hc.Chain, {"granules": 3, **STEEL, "gap": 0.0, "velocity": 0.0, "fixed": False}),
    "Pulse": (
        hc.Pulse,
        {"profile": "cosine", "peak_force": 1.0, "duration_ratio": 2, "rise_time": 1.0},
    ),
    "PulseTable": (hc.PulseTable, {"time": (0.0, 1.0), "force": (1.0, 1.0), "granule": 1}),
    "Piston": (hc.Piston, {"time": (0.0, 1.0), "displacement": (0.0, 1.0)}),
    "Wall": (hc.Wall, {"kind": "rigid", "gap": 0.0}),
    "Contact": (hc.Contact, {"damping": "restitution", "restitution": 0.5, "attraction": False}),
    "Gauge": (hc.Gauge, {"granule": 3}),
    "Scene": (hc.Scene, {"chain": CHAIN, "shock": PULSE, "wall": None, "gauges": ()}),
    "Uncertain": (hc.Uncertain, {"key": "chain.radius", "size": 0.1, "relative": True}),
    "Native": (hc.Native, {"rtol": 1e-4, "peaks_only": False, "time_limit": 9.0, "wanted": "all"}),
    "Lammps": (hc.Lammps, {"read_every": 1, "extrapolated": False, "time_limit": 9.0}),
    "run": (hc.Native(rtol=1e-3).run, {"scene": SCENE, "record": 2}),
    "from_toml": (hc.Scene.from_toml, {"path": "no.toml"}),
    "schedule": (SCENE.schedule, {"dt": 1e-6}),
    "peak_forces": (hc.peak_forces, {"scenes": [SCENE], "rtol": 1e-3, "time_limit": 9.0}),
    "similar_peak_forces": (
        hc.similar_peak_forces,
        {
            "profile": "cosine",
            "momentum_ratio": 1,
            "duration_ratio": 2,
            "granules": 3,
            "rtol": 1e-3,
            "cores": 1,
        },
    ),
    "design": (design, {"scene": SCENE, "vary": VARY, "seed": 0}),
    "plot": (hc.plot, {"results": {"a": RESULT}, "draw": "peaks", "size": (7.0, 4.0)}),
    "peak_at": (RESULT.peak_at, {"contact": 2}),
    "wave": (RESULT.wave, {"first": 2, "last": 3}),
    "write_trajectory": (hc.write_trajectory, {"result": RESULT, "path": "a.xyz"}),
    "judge": (hc.judge, {"scene": SCENE, "results": [1.0, 1.0], "tolerance": 0.1, "dt": None}),
    "examine": (hc.examine, {"scene": SCENE, "deck": "no.in", "variables": {}, "lmp": None}),
    "fit": (hc.fit, {"scene": SCENE, "traces": "no.csv", "free": ["gain"], "clock": "own"}),
    "spread": (hc.spread, {"scene": SCENE, "realisations": 16, "seed": 1, "progress": None}),
    "speed": (theory.solitary_wave_speed, {"chain": CHAIN, "peak_force": 1.0}),
    "applied_force": (theory.applied_force, {"time": [0.0], "pulse": PULSE, "rise_time": 1.0}),
    "peak_force": (
        theory.peak_force,
        {"contact": [2], "p": 5, "wave_force": 1.0, "duration_ratio": 2.0, "effective_ratio": 1.0},
    ),
    "map": (theory.peak_map.peaks, {"profile": "cosine", "momentum_ratio": 1, "duration_ratio": 2}),
    "dashpot": (theory.restitution.damping_ratio, {"restitution": 0.5}),
}

WRONG = [
    None, "", "x", -1, math.nan, 10**400, -(10**400), np.bool_(1), (), {}, object(), b"x", 1j,
    [[1.0, 2.0], [3.0]], np.zeros((2, 2)), np.array(["a"]), np.array(1.0), Path("no"),
    decimal.Decimal(2), [None], math.floor, math,
]  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_is_refused_in_a_sentence(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    call, right = CALLS[name]
    refused = 0
    for argument in right:
        for wrong in WRONG:
            try:
                call(**{**right, argument: wrong})
            except hc.HertzchainError as problem:
                refused += str(problem).isprintable()
            except Exception as problem:
                problem.add_note(f"{argument} = {wrong!r}")
                raise
    assert refused >= len(right) * len(WRONG) // 2


@pytest.mark.parametrize("judge", [hc.judge, hc.judge_traces, hc.judge_trains, hc.examine])
def test_a_tolerance_is_between_0_and_1(judge: Callable[..., object]) -> None:
    for tolerance in (-1.0, 0.0, 1.0):
        with pytest.raises(hc.HertzchainError, match=f"tolerance = {tolerance}: must be"):
            judge(SCENE, [1.0, 1.0] if judge is hc.judge else "no.csv", tolerance=tolerance)


@pytest.mark.parametrize("number", [np.float32(90), np.int64(90), Fraction(90), np.float64(90), 90])
def test_numbers_of_other_types_are_numbers(number: Any) -> None:
    limit = hc.Native(time_limit=number).time_limit
    assert (limit, type(limit)) == (90.0, float)
    assert theory.solitary_wave_speed(CHAIN, number) == theory.solitary_wave_speed(CHAIN, 90.0)
    assert hc.Precompression(number) == hc.Precompression(90.0)
    assert hc.peak_forces([SCENE], time_limit=number).peak_force.shape == (1, 2)
    yes: Any = np.bool_(1)
    assert hc.Native(peaks_only=yes).peaks_only is True
