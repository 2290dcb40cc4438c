"""Numbers that validation computes: against closed forms, quadrature and small cases by hand."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain import theory
from tests.places import ROOT
from validation import constants, eqs_4b_and_5, figure4, limits


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
