"""Scripts on terms: each fails where a simulation, or what it is compared with, is off a little."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import pytest

import hertzchain as hc
from hertzchain.engines.lammps import damping
from validation.physics import (
    chains,
    cut_offs,
    dimers,
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


def later(true: Callable[..., Any], j: Any, time: Any, *more: Any) -> Any:
    """An answer at times 1 % too late."""
    return true(j, 1.01 * time, *more)


@pytest.mark.parametrize(
    ("script", "name", "wrong", "expected"),
    [
        (dimers, "decay", lambda true, x: true(x) + 2e-6, {"decay from contact 101 to 121"}),
        (precompression, "wave_speed", lambda true, x: true(x) * (1 + 1e-6), {"speed / sound"}),
        (
            *(cut_offs, "linear_stiffness", lambda true: true() * 1.005),
            {f"{band} band / cut-off" for band in
             ("top of the lower", "bottom of the upper", "top of the upper")},
        ),
        (drives, "passed_on", later, {"velocities - linear chain"}),
        (restitution, "of_ratio", lambda true, *given: true(*given) + 1e-6,
         {f"{e} asked for, contacts do not pull" for e in (0.3, 0.5, 0.7, 0.8, 0.9)}),
    ],
)  # fmt: skip
def test_another_theory_fails(
    script: ModuleType,
    name: str,
    wrong: Callable[..., Any],
    expected: set[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    true = getattr(script, name)
    monkeypatch.setattr(script, name, lambda *given: wrong(true, *given))
    assert failed(script.compare(True, False)) == expected


@pytest.mark.lammps
def test_another_damping_of_lammps_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the factor of later versions stood in the formula of those before."""
    monkeypatch.setattr(restitution, "OPTIONS", restitution.OPTIONS[:4])  # of restitutions
    monkeypatch.setattr(restitution, "tsuji", lambda asked, **_: damping.tsuji(asked, True))
    failed_rows = [entry.what for entry in restitution.compare(True, True) if not entry.passed]
    assert failed_rows == ["damping tsuji, 0.8", "damping tsuji limit_damping, 0.8"]


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


def test_a_wave_that_is_faster_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    true = hc.Result.wave

    def faster_wave(self: hc.Result, first: int, last: int) -> Any:
        found = true(self, first, last)
        return replace(found, speed=found.speed * (1 + 3e-5))

    monkeypatch.setattr(hc.Result, "wave", faster_wave)
    assert failed(published.compare(True, False)) == {"speed / (2 R (A/m)^0.4 v^0.2)"}
