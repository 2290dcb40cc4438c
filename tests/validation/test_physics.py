"""Scripts on terms: each fails where a simulation, or what it is compared with, is off a little."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import pytest

import hertzchain as hc
from validation.physics import (
    chains,
    known_numbers,
    precompression,
    published,
    restitution,
)
from validation.rows import Row

Doctor = Callable[[hc.Result], hc.Result]

answers = functools.cache(chains.answers)
"""What is simulated is so once, whatever it is doctored to."""


def harder(result: hc.Result) -> hc.Result:
    """Pressed 1e-4 too hard in the first contact and at the wall."""
    peaks = result.peak_force.copy()
    peaks[[0, -1] if result.scene.wall else [0]] *= 1 + 1e-4
    return replace(result, peak_force=peaks)


def faster(result: hc.Result) -> hc.Result:
    """Velocities at the end 1e-4 too large, and peaks 1e-4 too early."""
    more = 1 + 1e-4
    times, velocity = result.peak_time / more, result.velocity * more
    return replace(result, peak_time=times, velocity=velocity)


def failed(rows: list[Row]) -> set[str]:
    """What fails, without the scene it was measured on."""
    return {entry.what.rpartition(": ")[2].split(" at ")[0] for entry in rows if not entry.passed}


@pytest.mark.parametrize(
    ("script", "doctor", "expected"),
    [
        (known_numbers, harder, {"peak / F_max", "first contact", "peak", "F", "contact 2"}),
        (known_numbers, faster,
         {"duration / closed form", "velocity 1 / v", "velocity 2 / v", "its velocity",
          "last / first velocity", "velocity"}),
        (precompression, faster, {"speed / sound"}),
        (published, harder, {"force [N]", "depth [m]"}),
        (published, faster, {"time [s]", "restitution", "velocity 3"}),
    ],
)  # fmt: skip
def test_a_wrong_simulation_fails(
    script: ModuleType, doctor: Doctor, expected: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def doctored(scene: hc.Scene, _: bool, *rest: Any) -> dict[str, hc.Result]:
        return {"native": doctor(answers(scene, False, *rest)["native"])}

    monkeypatch.setattr(chains, "answers", doctored)
    assert failed(script.compare(True, False)) == expected


@pytest.mark.slow
@pytest.mark.parametrize(
    "code",
    [
        pytest.param("LIGGGHTS", marks=pytest.mark.liggghts),
        pytest.param("Yade", marks=pytest.mark.yade),
    ],
)
def test_damping_options_of_other_codes(code: str) -> None:
    for option in restitution.OPTIONS:
        if option.code == code:
            rows = list(restitution.measured(option, *restitution.OTHERS[code], False))
            assert [entry.what for entry in rows if not entry.passed] == []


def test_betan_of_yade_as_yade_was_seen_to_have_it() -> None:
    """Read from the contacts of Yade 2023.02a, all digits."""
    seen = {0.95: 0.015660519411185007, 0.8: 0.06790289004602458, 0.1: 1.1342510657848295}
    for en, found in seen.items():
        assert restitution.betan(en) == pytest.approx(found, rel=1e-12)  # 1 - x with x near 1
