"""Scripts on terms: each fails where a simulation, or what it is compared with, is off a little."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import pytest

import hertzchain as hc
from validation.physics import (
    chains,
    drives,
    gapped_taper,
    precompression,
    restitution,
    strikers,
    two_spheres,
    walls,
)
from validation.published import published
from validation.rows import Row

Doctor = Callable[[hc.Result], hc.Result]


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
        (two_spheres, harder, {"peak / F_max - 1"}),
        (two_spheres, faster, {"duration / closed form - 1", "velocity 1 / v", "velocity 2 / v"}),
        (strikers, harder, {"first contact"}),
        (strikers, faster, {"velocity of the striker"}),
        (gapped_taper, faster, {"last / first velocity"}),
        (walls, harder, {"peak"}),
        (precompression, faster, {"speed / sound"}),
        (drives, harder, {"F", "contact 2"}),
        (published, harder, {"force [N]", "depth [m]"}),
        (published, faster, {"time [s]", "restitution", "velocity 3"}),
        (drives, faster, {"velocity"}),
    ],
)  # fmt: skip
def test_a_wrong_simulation_fails(
    script: ModuleType, doctor: Doctor, expected: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def doctored(scene: hc.Scene, _: bool, *rest: Any) -> dict[str, hc.Result]:
        return {"native": doctor(chains.answers(scene, False, *rest)["native"])}

    monkeypatch.setattr(script, "answers", doctored)
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
