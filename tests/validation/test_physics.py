"""Scripts on terms: each fails where a simulation is off by a little."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import pandas
import pytest
from scipy.special import jv

import hertzchain as hc
from hertzchain.decks.restitution import OPTIONS
from hertzchain.engines.lammps import damping
from hertzchain.theory.restitution import of_ratio
from validation.physics import (
    chains,
    cut_offs,
    damped_pulses,
    damped_similarity,
    damped_waves,
    dimers,
    drives,
    gapped_taper,
    precompression,
    restitution,
    solitary_wave,
    strikers,
    two_spheres,
    walls,
)
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


def test_a_wave_that_decays_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    true = dimers.decay
    monkeypatch.setattr(dimers, "decay", lambda peaks: true(peaks) + 2e-6)
    assert failed(dimers.compare(True, False)) == {"decay from contact 101 to 121"}


def test_another_wave_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    true = precompression.wave_speed
    monkeypatch.setattr(precompression, "wave_speed", lambda ratio: true(ratio) * (1 + 1e-6))
    assert failed(precompression.compare(True, False)) == {"speed / sound"}


def test_other_cut_offs_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    true = cut_offs.linear_stiffness
    monkeypatch.setattr(cut_offs, "linear_stiffness", lambda: 1.005 * true())
    assert failed(cut_offs.compare(True, False)) == {
        "top of the lower band / cut-off",
        "bottom of the upper band / cut-off",
        "top of the upper band / cut-off",
    }


def test_another_dispersion_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(precompression, "jv", lambda n, x: jv(n, x * (1 + 1e-4)))
    assert failed(precompression.compare(True, False)) == {"velocities - Bessel functions"}


@pytest.mark.parametrize(
    ("name", "expected"), [("passed_on", "slow piston"), ("shaken", "sine of")]
)
def test_another_linear_chain_fails(
    name: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = getattr(drives, name)
    monkeypatch.setattr(drives, name, lambda j, t, *more: true(j, 1.01 * t, *more))
    wrong = [entry.what for entry in drives.compare(True, False) if not entry.passed]
    assert wrong
    assert all(what.startswith(expected) for what in wrong)


def test_another_closed_form_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    true = of_ratio
    monkeypatch.setattr(restitution, "of_ratio", lambda *given: true(*given) + 1e-6)
    assert {entry.backend for entry in restitution.compare(True, False) if not entry.passed} == {
        "closed form"
    }


@pytest.fixture(scope="module")
def lost() -> pandas.DataFrame:
    """What waves lose in damped contacts, in the quick form."""
    return damped_waves.measure(True, False)


def test_a_wave_that_loses_otherwise_fails(lost: pandas.DataFrame) -> None:
    assert failed(damped_waves.promises(lost)) == set()
    for change, what in (
        (2e-6, "G without damping"),
        (2e-4, "G with the weakest damping"),
    ):  # twice allowed
        for factor in (1 - change, 1 + change):
            rows = damped_waves.promises(lost.assign(lost=factor * lost["lost"]))
            assert what in failed(rows)


def test_a_wave_that_is_not_similar_fails(lost: pandas.DataFrame) -> None:
    table = lost.copy()
    table.loc[table["contact"] == 90, "lost"] *= 1 + 2e-5
    names = failed(damped_waves.promises(table))
    assert names == {"lost"}


def test_a_law_of_another_power_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    laws = {
        law: (contact, power + 1e-3) for law, (contact, power) in damped_similarity.LAWS.items()
    }
    monkeypatch.setattr(damped_similarity, "LAWS", laws)
    found = damped_similarity.compare(True, False)
    # A restitution has no coefficient that could be another.
    assert [entry.passed for entry in found] == [True, True, False, *[False] * 6]


def test_a_front_that_is_off_fails() -> None:
    table = damped_pulses.measure(True, False)
    assert failed(damped_pulses.promises(table)) == set()
    table[["x", "y"]] *= 1 + 2e-3
    assert failed(damped_pulses.promises(table)) == {"speed / F0^(1/6)", "dissipated / work"}


@pytest.mark.lammps
def test_another_damping_of_lammps_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the factor of later versions stood in the formula of those before."""
    monkeypatch.setattr(restitution, "OPTIONS", OPTIONS[:6])  # tsuji and coeff_restitution
    true = damping.tsuji
    monkeypatch.setattr(damping, "tsuji", lambda asked, _: true(asked, True))
    failed_rows = [entry.what for entry in restitution.compare(True, True) if not entry.passed]
    assert failed_rows == ["damping tsuji, 0.8", "damping tsuji limit_damping, 0.8"]


def test_a_wave_that_is_faster_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    true = hc.Result.wave

    def faster_wave(self: hc.Result, first: int, last: int) -> Any:
        found = true(self, first, last)
        return replace(found, speed=found.speed * (1 + 3e-5))

    monkeypatch.setattr(hc.Result, "wave", faster_wave)
    wrong = [entry.what for entry in solitary_wave.compare(True, False) if not entry.passed]
    assert [what.split()[0] for what in wrong] == ["speed"]
