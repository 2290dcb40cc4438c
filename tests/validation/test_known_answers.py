"""Numbers that validation computes: against closed forms, quadrature and small cases by hand."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain import theory
from hertzchain.theory.solitary_wave import solitary_wave
from tests import scenes
from tests.places import ROOT
from validation import (
    claims,
    constants,
    corrections,
    figure2,
    figure4,
    formula_maps,
    limits,
    long_run,
    mistakes,
    peak_forces,
)
from validation.shipped import effective_ratio, eq3, pulse_of

# Nesterenko's wave


def test_nesterenko_constants_are_those_of_the_literature() -> None:
    # sqrt(10) pi R, with granules 2R apart; V = (2 / sqrt(5)) c xi^(1/4).
    assert pytest.approx(4.967, rel=0, abs=1e-3) == constants.NESTERENKO_WIDTH
    coefficient = constants.NESTERENKO_SPEED * constants.SPEED_UNIT
    assert coefficient == pytest.approx(0.6802, rel=0, abs=5e-5)


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


def test_nesterenko_integrals() -> None:
    x = np.linspace(-3, 3, 6001)
    overlap = constants.nesterenko_overlap(x)
    force, momentum = (float(np.trapezoid(y, x)) for y in (overlap**1.5, overlap))
    assert constants.nesterenko_force_integral() == pytest.approx(force, rel=1e-9, abs=0)
    momentum *= constants.NESTERENKO_SPEED
    assert constants.nesterenko_momentum() == pytest.approx(momentum, rel=1e-9, abs=0)


def test_width_and_share_of_a_known_force() -> None:
    force = np.exp(-(constants.X**2))
    half = constants.width(force, 0.5)
    assert half == pytest.approx(2 * math.sqrt(math.log(2)), rel=1e-8, abs=0)
    share = math.erf(constants.NESTERENKO_WIDTH / 2)
    assert constants.share_within(force) == pytest.approx(share, rel=1e-8, abs=0)


# Claims and corrections


def test_momentum_thrown_back_of_a_hand_made_state() -> None:
    assert claims.thrown_back(np.array([-0.5, -0.25, 0.0, 1.0, 2.0])) == 0.75
    assert claims.thrown_back(np.array([0.0, 1.0])) == 0.0


def test_first_contact_near_the_far_field() -> None:
    # Contacts 2 ... 8; the last two are those at the free end.
    peaks = np.array([1.5, 0.995, 1.05, 1.005, 1.0, 0.99, 0.5])
    assert claims.first_within(peaks, 0.01) == 5
    assert claims.first_within(peaks, 0.1) == 3
    assert claims.first_within(np.ones(6), 0.01) == 2


def test_integral_until_the_first_minimum() -> None:
    """Of a pulse that opens the contact, and of one that the next wave overtakes."""
    time = np.linspace(0, 1.4, 281)
    alone = np.where(time < 1, np.sin(np.pi * time) ** 2, 0.0)
    assert claims.until_first_minimum(time, alone) == pytest.approx(0.5, rel=1e-6, abs=0)
    overtaken = 0.6 - 0.4 * np.cos(2 * np.pi * time)
    assert claims.until_first_minimum(time, overtaken) == pytest.approx(0.6, rel=1e-9, abs=0)


def test_eq_6_is_that_of_the_theory() -> None:
    contact = np.arange(2, 10)
    expected = theory.peak_force(contact, 9, 1.4, 2.0, 2.0)
    found = corrections.corrected_peak_force(contact.astype(np.float64), 9, 1.4, 2.0, 2.0)
    assert found == pytest.approx(expected, rel=1e-15, abs=0)


def test_the_criterion_for_p_is_that_of_the_transition() -> None:
    result = hc.Native(rtol=1e-6).run(scenes.load("demo"))
    for criterion in list(corrections.CRITERIA.values())[:2]:
        assert criterion(result.peak_force) == result.transition_granules == 9


def test_every_later_change_counts_or_only_the_first() -> None:
    plateau = np.array([1.0, 1.0, 1.0, 1.0, 1.001, 1.2, 1.4, 1.4, 1.4, 1.4])
    assert corrections.by_changes(every=False)(plateau) == 5
    assert corrections.by_changes()(plateau) == 8


def test_delta_l_read_as_the_theory_reads_it() -> None:
    case = corrections.simulated(hc.Native(rtol=1e-3).run(scenes.load("cosine_LM0.3_n2")))
    first = next(iter(corrections.delta_l(case).values()))
    expected = effective_ratio(case.scene) - case.scene.momentum_ratio
    assert first == pytest.approx(expected, rel=1e-8, abs=0)


def test_the_printed_exponent_is_in_one_place() -> None:
    assert mistakes.printed_peak_force in corrections.EXPONENTS.values()


# Figures and maps


@pytest.mark.parametrize("fraction", [0.5, 0.1, 0.01])
def test_widths_of_a_known_profile(fraction: float) -> None:
    x = np.linspace(-5, 6, 221)  # 20 points per granule, as in the figure
    bell = 7.0 * np.exp(-((x - 0.3) ** 2))
    expected = 2 * math.sqrt(-math.log(fraction))
    assert figure2.width(x, bell, fraction) == pytest.approx(expected, rel=2e-6, abs=0)


@pytest.mark.parametrize("fraction", [0.5, 0.01])
def test_the_compact_wave_spans_its_own_length(fraction: float) -> None:
    x = np.linspace(-2.5, 2.5, 2001)
    found = figure2.width(x, np.cos(np.pi * x / 5) ** 4, fraction)
    assert figure2.span(found, fraction) == pytest.approx(5, rel=1e-6, abs=0)


def test_the_exact_profile_carries_the_momentum_of_the_wave() -> None:
    x = np.arange(-10, 10, 1 / 16)
    momentum = np.sum(figure2.exact_profile().velocity(x)) / 16  # granules of mass 1
    wave = theory.solitary_wave.solitary_wave()
    assert momentum == pytest.approx(wave.momentum, rel=1e-13, abs=0)


def test_a_refit_finds_the_coefficients_of_a_cubic() -> None:
    rng = np.random.default_rng(4)
    j = rng.uniform(0, 1, 400)
    exact = theory.peak_force_fit(j)
    cubic = figure4.fit_cubic(j, exact)
    np.testing.assert_allclose(cubic.coefficients, figure4.PAPER, rtol=1e-12)
    np.testing.assert_allclose(cubic(j), exact, rtol=0, atol=1e-13)
    assert cubic.rms < 1e-14
    noisy = figure4.fit_cubic(j, exact + rng.normal(0, 0.01, j.size))
    assert noisy.rms == pytest.approx(0.01, rel=0.11, abs=0)  # 3 sigma of 400


def test_errors_of_a_scene_of_table_4_are_those_of_its_script() -> None:
    entries = peak_forces.measure(4, True, False)
    name = str(entries["scene"].iloc[0])
    result = hc.Native("reference").run(scenes.load(name))
    pulse, ratio = pulse_of(result.scene)[0], result.scene.momentum_ratio
    peaks = result.peak_force / 100.0
    found = formula_maps.errors(pulse.profile, ratio, pulse.duration_ratio, peaks)
    # The same formulas on the same peaks; only units differ.
    largest = entries.loc[entries["scene"] == name, "error_percent"].max()
    assert found["eq6_error"] == pytest.approx(largest, rel=1e-10, abs=0)
    assert found["p"] == result.transition_granules
    expected = eq3(result.scene, 100.0 * found["wave_force"])
    assert found["eq3"] == pytest.approx(expected, rel=1e-10, abs=0)
    assert found["eq3_error"] == pytest.approx(100 * abs(expected / found["p"] - 1), rel=1e-9)


def test_no_p_no_errors() -> None:
    growing = 1.02 ** np.arange(20)
    found = formula_maps.errors("cosine", 1.0, 2.0, np.asarray(growing, np.float64))
    assert all(math.isnan(value) for value in found.values())


def test_a_share_is_that_of_the_area() -> None:
    holds = np.zeros((5, 5), np.bool_)
    assert formula_maps.share(holds) == 0
    holds[:, :3] = True
    assert formula_maps.share(holds) == 2.5 / 4
    assert formula_maps.share(~holds) == 1.5 / 4
    assert set(formula_maps.SHARES) == set(formula_maps.LARGEST)
    assert len(formula_maps.SHARES) == 6


# Limits and long runs


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


def test_ten_granules_pushed_slowly_are_pushed_as_one() -> None:
    # LM 1e4, cosine: 12.7 LM^(-9/8), the most that five granules showed, is 4e-4 of a force; of F0
    # half as much was seen here.
    scene = limits.slow_scene("cosine", 10, 1e-4)
    peaks = hc.Native("reference").run(scene).peak_force / scene.units.force
    assert np.max(np.abs(peaks - np.arange(9, 0, -1) / 10)) < 4e-4


def test_a_wave_that_is_known_is_found() -> None:
    # A wave of height 2 that loses 1e-6 at each contact and goes at its own speed.
    contender = long_run.Contender("known", "rk4", (1_000, 2_000))
    force = 2 * np.exp(-1e-6 * np.arange(2_098))
    speed = solitary_wave().speed * force ** (1 / 6)
    table = long_run.wave_at(contender, force, np.cumsum(1 / speed))
    # Speeds are means over contacts here and over time there: (1e-6 1000 / 6)^2 / 12 apart.
    assert table["relation"].abs().max() < 1e-6
    assert table["amplitude"].to_numpy() == pytest.approx([force[98], force[1_098]], rel=1e-15)


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
