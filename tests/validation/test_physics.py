"""Numbers that validation computes, and that its scripts on terms find what is off a little."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain import theory
from tests.places import ROOT
from validation import constants, eqs_4b_and_5, figure4, limits
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


def test_nesterenko_wave_solves_his_equation() -> None:
    """V^2 xi against xi^(3/2) + ((xi^(3/2))_xx - 3/8 xi^(-1/2) xi_x^2) / 12, by differences."""
    h = 1e-4
    x = np.linspace(-2.2, 2.2, 45)
    before, here, after = (constants.nesterenko_overlap(x + k * h) for k in (-1, 0, 1))
    curvature = (before**1.5 - 2 * here**1.5 + after**1.5) / h**2
    slope = (after - before) / (2 * h)
    stress = here**1.5 + (curvature - 3 / 8 * slope**2 / np.sqrt(here)) / 12
    # Second differences: h^2 / 12 of a fourth derivative of some tens, and round-off 1e-16 / h^2.
    assert stress == pytest.approx(constants.NESTERENKO_SPEED**2 * here, rel=0, abs=1e-7)


def test_integral_until_the_first_minimum() -> None:
    """Of a pulse that opens the contact, and of one that the next wave overtakes."""
    time = np.linspace(0, 1.4, 281)
    alone = np.where(time < 1, np.sin(np.pi * time) ** 2, 0.0)
    assert eqs_4b_and_5.until_first_minimum(time, alone) == pytest.approx(0.5, rel=1e-6, abs=0)
    overtaken = 0.6 - 0.4 * np.cos(2 * np.pi * time)
    assert eqs_4b_and_5.until_first_minimum(time, overtaken) == pytest.approx(0.6, rel=1e-9, abs=0)


def test_a_refit_finds_the_coefficients_of_a_cubic() -> None:
    rng = np.random.default_rng(4)
    j = rng.uniform(0, 1, 400)
    exact = theory.peak_force_fit(j)
    found = figure4.refit(j, exact)
    np.testing.assert_allclose(found, figure4.PAPER, rtol=1e-12)
    np.testing.assert_allclose(figure4.cubic(found, j), exact, rtol=0, atol=1e-13)
    noisy = exact + rng.normal(0, 0.01, j.size)
    left = figure4.rms(noisy - figure4.cubic(figure4.refit(j, noisy), j))
    assert left == pytest.approx(0.01, rel=0.11, abs=0)  # 3 sigma of 400


def test_the_far_field_of_an_impulse() -> None:
    # Ten digits stand in the script; the peaks still change by 1e-12 there.
    expected = limits.IMPULSE_COEFFICIENT
    assert limits.impulse_coefficient() == pytest.approx(expected, rel=1e-10, abs=0)
    # The same from the native solver: short pulses, and their error of LM^3 taken out.
    found = []
    for momentum_ratio in (0.02, 0.01):
        scene = limits.impulse_scene(momentum_ratio, granules=50)
        impulse = scene.impulse / scene.units.momentum
        peaks = hc.Native("reference").run(scene).peak_force / scene.units.force
        found.append(peaks[40] / impulse**1.2)
    extrapolated = (8 * found[1] - found[0]) / 7
    # 1e-3 of the error of the better one: the next term is smaller by a power of LM.
    assert extrapolated == pytest.approx(expected, rel=2e-10, abs=0)


def test_the_constants_of_the_page_are_those_that_are_kept() -> None:
    kept = pd.read_csv(ROOT / "validation" / "results" / "constants.csv", comment="#")
    lines = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8").splitlines()
    for entry in kept[kept["kind"] == "constant"].to_dict("records"):
        (line,) = [line for line in lines if line.startswith(f"| {entry['what']} | ")]
        _, _, exact, *others, _ = (cell.strip() for cell in line.split("|"))
        assert exact == f"{entry['exact']:.6f}"
        for shown, key in zip(others, ("paper", "nesterenko"), strict=True):
            value, off = entry[key], entry[key] / entry["exact"] - 1
            assert shown == ("" if math.isnan(value) else f"{value:.6f} ({off:+.2%})")
