"""The scripts on constants, claims and corrections: their numbers, and rows that can fail."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain import theory
from tests import scenes
from validation import claims, constants, corrections, mistakes
from validation.rows import Row
from validation.shipped import STEEL, Found, effective_ratio

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


# Claims


def test_momentum_thrown_back_of_a_hand_made_state() -> None:
    assert claims.thrown_back(np.array([-0.5, -0.25, 0.0, 1.0, 2.0])) == 0.75
    assert claims.thrown_back(np.array([0.0, 1.0])) == 0.0


def test_first_contact_near_the_far_field() -> None:
    # Contacts 2 ... 8; the last two are those at the free end.
    peaks = np.array([1.5, 0.995, 1.05, 1.005, 1.0, 0.99, 0.5])
    assert claims.first_within(peaks, 0.01) == 5
    assert claims.first_within(peaks, 0.1) == 3
    assert claims.first_within(np.ones(6), 0.01) == 2


def test_p_without_its_floor() -> None:
    assert claims.first_steady(np.array([1.5, 1.2, 1.199, 1.198, 1.197])) == 3
    assert claims.first_steady(np.ones(6)) == 2


def test_half_width_scales_with_the_height_of_a_wave() -> None:
    wave = claims.WAVE
    near = np.abs(wave.x) < 3
    time, force = wave.x[near] * wave.shift, wave.overlap[near] ** 1.5
    one = claims.half_width(time, force)
    # Twice as high, a wave lasts 2^(-1/6) as long.
    assert claims.half_width(time * 2 ** (-1 / 6), 2 * force) == pytest.approx(one, rel=1e-9, abs=0)


def test_momentum_ahead_of_each_contact() -> None:
    assert list(claims.handed_on(np.array([-1.0, 0.5, 2.0]))) == [2.5, 2.0]


def test_integral_until_the_first_minimum() -> None:
    """Of a pulse that opens the contact, and of one that the next wave overtakes."""
    time = np.linspace(0, 1.4, 281)
    alone = np.where(time < 1, np.sin(np.pi * time) ** 2, 0.0)
    assert claims.until_first_minimum(time, alone) == pytest.approx(0.5, rel=1e-6, abs=0)
    overtaken = 0.6 - 0.4 * np.cos(2 * np.pi * time)
    assert claims.until_first_minimum(time, overtaken) == pytest.approx(0.6, rel=1e-9, abs=0)


# Corrections


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


# Rows that fail when they should


@pytest.fixture(scope="module")
def measured() -> dict[ModuleType, pd.DataFrame]:
    """Return the tables of each script in its quick form, without LAMMPS."""
    return {
        script: script.SCRIPT.measure(True, False) for script in (constants, claims, corrections)
    }


def failing(script: ModuleType, table: pd.DataFrame) -> list[Row]:
    return [entry for entry in script.SCRIPT.promises(table) if not entry.passed]


@pytest.mark.parametrize("script", [constants, claims, corrections])
def test_a_table_from_its_file_is_as_good(
    script: ModuleType, measured: dict[ModuleType, pd.DataFrame], tmp_path: Path
) -> None:
    table = measured[script]
    assert failing(script, table) == []
    path = tmp_path / "table.csv"
    table.to_csv(path, index=False)
    again = pd.read_csv(path, comment="#")
    assert failing(script, again) == []
    assert len(script.SCRIPT.promises(again)) == len(script.SCRIPT.promises(table))
    assert script.SCRIPT.draw(again).axes


Doctor = Callable[[pd.DataFrame], "pd.Series[bool]"]


@pytest.mark.parametrize(
    ("script", "which", "column", "factor", "named"),
    [
        (constants, lambda t: t["what"] == "V_SW, 7/10", "native", 1 + 1e-8, "V_SW, 7/10"),
        (constants, lambda t: t["kind"] == "si", "exact", 1 + 1e-8, "speed [m/s]"),
        (constants, lambda t: t["kind"] == "si", "exact", 1 + 1e-8, "momentum [N s]"),
        (constants, lambda t: t["kind"] == "force", "paper", 1.001, "S, shift 1.077"),
        (constants, lambda t: t["what"] == "Eq. 4b, 1.077", "paper", 1.001, "1.077: off by"),
        (constants, lambda t: t["kind"] == "shift", "native", 1.01, "Eq. 4b, LM_ratio below 1"),
        (
            claims,
            lambda t: t["what"] == claims.AT_ONCE,
            "native",
            1.01,
            "a. LM_ratio 1: far field / F0",
        ),
        (claims, lambda t: t["what"] == claims.THROWN, "paper", 10.0, "Delta L / momentum"),
        (claims, lambda t: t["what"] == claims.SHARE, "native", 0.99, "c. LM_ratio 1"),
        (claims, lambda t: t["what"] == claims.DISTANCE, "native", 2.0, "d. impulse"),
        (claims, lambda t: t["what"] == claims.DECAY_RISE, "quadrature", 1.01, "e. cosine"),
        (claims, lambda t: t["what"] == claims.BALANCE, "native", 1e3, "L_SW - L_Applied"),
        (claims, lambda t: t["what"] == claims.HEIGHT, "native", 1.01, "g. LM_ratio 0.3 to 0.8"),
        (claims, lambda t: t["what"] == claims.HANDED_ON, "native", 1.1, claims.HANDED_ON),
        (claims, lambda t: t["what"] == claims.FIRST_PULSE, "native", 1.1, claims.FIRST_PULSE),
        (claims, lambda t: t["what"] == claims.SHAPE, "native", 1.1, claims.SHAPE),
        (
            corrections,
            lambda t: t["reading"].str.startswith("15 (i - p) / (8 i p", na=False),
            "score",
            1000.0,
            "#3 15",
        ),
        (corrections, lambda t: t["what"] == corrections.CRITERION, "score", 0.9, "#6 every"),
    ],
)
def test_a_doctored_table_fails(
    script: ModuleType,
    which: Doctor,
    column: str,
    factor: float,
    named: str,
    measured: dict[ModuleType, pd.DataFrame],
) -> None:
    table = measured[script].copy()
    rows = which(table)
    assert rows.any()
    table.loc[rows, column] *= factor
    failed = failing(script, table)
    assert failed
    assert any(named in entry.what for entry in failed)


@pytest.mark.parametrize("script", [constants, claims, corrections])
def test_a_scene_that_did_not_run_is_a_row_that_fails(
    script: ModuleType, measured: dict[ModuleType, pd.DataFrame]
) -> None:
    table = measured[script].astype({"problem": object})
    table.loc[len(table) - 1, "problem"] = "LAMMPS crashed (SIGSEGV)"
    assert any("SIGSEGV" in entry.what for entry in failing(script, table))


COORDINATES = "given: it says which case a number belongs to"

NOT_JUDGED: dict[ModuleType, dict[str, str]] = {
    claims: {"n": COORDINATES, "momentum_ratio": COORDINATES, "contact": COORDINATES},
    constants: {"x": COORDINATES},
    corrections: {"number": COORDINATES, "contact": COORDINATES},
}
"""Columns of numbers that no row judges, and why."""


def judged(script: ModuleType, table: pd.DataFrame) -> list[tuple[int, str]]:
    """Cells (index, column) with a number that some row depends on."""
    if script is corrections:  # entries are drawn: their mean and largest are scores
        table = table[table["kind"] == "score"]
    columns = set(table.select_dtypes("number").columns) - set(NOT_JUDGED[script])
    return [(k, column) for column in sorted(columns) for k in table.index[table[column].notna()]]


@pytest.mark.parametrize("script", [constants, claims, corrections])
def test_a_number_that_is_missing_fails(
    script: ModuleType, measured: dict[ModuleType, pd.DataFrame]
) -> None:
    """One cell is lost: of each kind one, up to 30, and no row may leave it out."""
    table = measured[script]
    cells = judged(script, table)
    shuffled = [cells[k] for k in np.random.default_rng(7).permutation(len(cells))]
    of_each = {(table["what"][k], column): (k, column) for k, column in shuffled}
    assert len(of_each) > 10
    for k, column in list(of_each.values())[:30]:
        doctored = table.copy()
        doctored.loc[k, column] = math.nan
        assert failing(script, doctored), f"{table.loc[k].to_dict()} without {column}"


def test_what_lammps_did_not_find_fails(measured: dict[ModuleType, pd.DataFrame]) -> None:
    """If a scene of LAMMPS is missing, each row of LAMMPS shows it."""
    for script, what in ((claims, claims.HEIGHT), (constants, "cosine_LM0.3_n2")):
        table = measured[script].assign(lammps=measured[script]["native"])
        table.loc[table.index[table["what"] == what][0], "lammps"] = math.nan
        if script is claims:
            table.loc[table["scene"].str.endswith(claims.LONG), "lammps"] = math.nan
        failed = [entry for entry in failing(script, table) if entry.backend == "lammps"]
        assert any("LAMMPS" in entry.what for entry in failed)


def test_a_chain_too_short_for_p_is_a_row_that_fails(
    monkeypatch: pytest.MonkeyPatch, measured: dict[ModuleType, pd.DataFrame]
) -> None:
    short = hc.Scene(hc.Chain(6, **STEEL), hc.Pulse("cosine", 100.0, 2.0, 2.0))
    for script in (constants, claims):
        with monkeypatch.context() as patch:
            patch.setattr(script, "load", lambda _: short)
            patch.setattr(script, "QUICK", ("cosine_LM2.0_n2",))
            if script is constants:
                table = pd.DataFrame(constants._shifts(True, False), columns=constants.COLUMNS)
            else:
                named = {"cosine_LM2.0_n2": short}
                found: Found = {("cosine_LM2.0_n2", "native"): hc.Native().run(short)}
                table = pd.DataFrame(
                    claims._table_scenes(named, found), columns=list(claims.COLUMNS)
                )
        table = pd.concat([measured[script].astype({"problem": object}), table], ignore_index=True)
        assert any("transition does not end" in entry.what for entry in failing(script, table))


def test_the_printed_exponent_is_in_one_place() -> None:
    assert mistakes.printed_peak_force in corrections.EXPONENTS.values()


def test_the_constants_of_the_page_are_those_that_are_kept() -> None:
    root = Path(constants.__file__).parents[1]
    kept = pd.read_csv(root / "validation" / "results" / "constants.csv", comment="#")
    lines = (root / "docs" / "validation.md").read_text(encoding="utf-8").splitlines()
    for entry in kept[kept["kind"] == "constant"].to_dict("records"):
        (line,) = [line for line in lines if line.startswith(f"| {entry['what']} | ")]
        _, _, exact, *others, _ = (cell.strip() for cell in line.split("|"))
        assert exact == f"{entry['exact']:.6f}"
        for shown, key in zip(others, ("paper", "nesterenko"), strict=True):
            value, off = entry[key], entry[key] / entry["exact"] - 1
            assert shown == ("" if math.isnan(value) else f"{value:.6f} ({off:+.2%})")
