"""The scripts of the paper's figures: that their rows fail when they should."""

from __future__ import annotations

import functools
import io
import math
from collections.abc import Sequence
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain import theory
from validation import figure1, figure2, figure3, figure4, figure5, transition_scenes
from validation.transition_scenes import MOMENTUM_RATIOS

FIGURES = {"1": figure1, "2": figure2, "3": figure3, "4": figure4, "5": figure5}


@functools.cache
def measured(figure: str) -> pd.DataFrame:
    """Return native's tables, with identical rows for LAMMPS."""
    table: pd.DataFrame = FIGURES[figure].SCRIPT.measure(True, False)
    who = "source" if figure == "1" else "backend"
    same = table[table[who] == "native"].assign(**{who: "lammps"})
    both: pd.DataFrame = pd.concat([table, same], ignore_index=True)
    return both


def table_of(figure: str) -> pd.DataFrame:
    return measured(figure).copy()


def failed(figure: str, table: pd.DataFrame) -> set[tuple[str, str]]:
    """The rows that fail, and who fails them; the same of the table read back from its file."""
    script = FIGURES[figure].SCRIPT
    here = {(entry.backend, entry.what) for entry in script.promises(table) if not entry.passed}
    kept = pd.read_csv(io.StringIO(table.to_csv(index=False)))
    assert {
        (entry.backend, entry.what) for entry in script.promises(kept) if not entry.passed
    } == here
    return here


@pytest.mark.parametrize("figure", FIGURES)
def test_what_agrees_passes(figure: str) -> None:
    assert failed(figure, table_of(figure)) == set()


@pytest.mark.parametrize("figure", FIGURES)
def test_a_scene_that_did_not_run_is_a_row_and_the_rest_is_judged(figure: str) -> None:
    table = table_of(figure)
    who = "source" if figure == "1" else "backend"
    keys = {"1": ["profile"], "2": ["wave"]}.get(figure, ["profile", "momentum_ratio"])
    first = table[table[who] == "lammps"].iloc[0]
    gone = (table[[who, *keys]] == first[[who, *keys]]).all(axis=1)
    said = pd.DataFrame([{who: "lammps", **first[keys], "problem": "LAMMPS crashed"}])
    broken = pd.concat([table[~gone], said], ignore_index=True)
    ((backend, what),) = failed(figure, broken)
    assert backend == "lammps"
    assert what.endswith(": LAMMPS crashed")
    assert len(FIGURES[figure].SCRIPT.draw(broken).axes) >= 2


# Figure 1


def test_a_force_that_is_off_fails() -> None:
    table = table_of("1")
    lammps = (table["source"] == "lammps") & (table["profile"] == "triangular")
    table.loc[lammps, "force"] *= 1.001
    assert failed("1", table) == {
        ("lammps", "triangular: F(t) less Eq. 2, largest"),
        ("lammps", "triangular: area, n / 2"),
        ("lammps", "triangular: F(t0)"),
    }


def test_a_jump_fails() -> None:
    table = table_of("1")
    after = (table["source"] == "native") & (table["ramp"] == 2)
    table.loc[after & (table["profile"] == "cosine"), ["force", "paper"]] = 1e-3
    assert failed("1", table) == {("native", "cosine: largest jump at a corner")}


def test_momentum_that_is_lost_fails() -> None:
    table = table_of("1")
    table.loc[table["source"] == "native", "momentum"] *= 1 - 1e-9
    assert {what.split(": ")[1] for _, what in failed("1", table)} == {
        "momentum that the chain has gained, over F0 n t0 / 2, less 1"
    }


# Figure 2


@pytest.mark.parametrize("fraction", [0.5, 0.1, 0.01])
def test_widths_of_a_known_profile(fraction: float) -> None:
    x = np.linspace(-5, 6, 221)  # 20 points per granule, as in the figure
    bell = 7.0 * np.exp(-((x - 0.3) ** 2))
    expected = 2 * math.sqrt(-math.log(fraction))
    assert figure2.width(x, bell, fraction) == pytest.approx(expected, rel=2e-6, abs=0)


def test_no_width_where_the_profile_does_not_end() -> None:
    x = np.linspace(-1, 1, 41)
    assert math.isnan(figure2.width(x, np.exp(-(x**2)), 0.1))


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


def test_a_wider_wave_fails() -> None:
    table = table_of("2")
    wave = (table["backend"] == "native") & (table["wave"] == "(c) small")
    table.loc[wave, "x"] *= 1.001
    assert failed("2", table) == {
        ("native", "(c) small: less the exact wave, largest"),
        ("native", "(c) small: width above 50 % of the peak"),
        ("native", "(c) small: width above 1 % of the peak"),
        ("native", "width above 50 %, widest less narrowest of the waves"),
        ("native", "width above 1 %, widest less narrowest of the waves"),
    }


# Figures 3, 4 and 5


def one_scene(table: pd.DataFrame, backend: str) -> pd.Series[bool]:
    return (
        (table["backend"] == backend)
        & (table["profile"] == "triangular")
        & (table["momentum_ratio"] == 2.0)
    )


@pytest.mark.parametrize("figure", ["3", "4", "5"])
def test_a_peak_of_lammps_that_is_off_fails(figure: str) -> None:
    table = table_of(figure)
    wrong = one_scene(table, "lammps") & (table["contact"] == 4)
    for column in {"peak_force_N", "normalized"} & set(table.columns):
        table.loc[wrong, column] *= 1 + 1e-4
    ((backend, what),) = failed(figure, table)
    assert backend == "lammps"
    assert what.startswith("triangular, LM_ratio 2: ")


@pytest.mark.parametrize("figure", ["4", "5"])
def test_a_contact_that_only_one_has_in_the_transition_fails(figure: str) -> None:
    table = table_of(figure)
    wrong = one_scene(table, "lammps") & (
        table["contact"] == table["contact"].where(one_scene(table, "lammps")).max()
    )
    ((backend, _),) = failed(figure, table[~wrong])
    assert backend == "lammps"


def test_another_p_fails() -> None:
    table = table_of("3")
    table.loc[one_scene(table, "lammps"), "p"] += 1
    assert failed("3", table) == {("lammps", "triangular, LM_ratio 2: p, native's")}
    table = table_of("3")
    table.loc[table["momentum_ratio"] == 2.5, "p"] = 8
    assert {
        ("native", "cosine: steps of LM_ratio that do not raise p, above 1 (paper: 0)"),
        ("native", "triangular, LM_ratio 2.5: p by Eq. 3 less p simulated (paper: 0)"),
    } <= failed("3", table)


def test_a_wave_on_the_other_side_of_f0_fails() -> None:
    table = table_of("3")
    table.loc[one_scene(table, "native"), "wave_force_N"] = 99.0
    assert ("native", "LM_ratio 2.0: profiles of 3 with F_SW above F0") in failed("3", table)


def test_a_refit_finds_the_coefficients_of_a_cubic() -> None:
    rng = np.random.default_rng(4)
    j = rng.uniform(0, 1, 400)
    exact = theory.peak_force_fit(j)
    cubic = figure4.fit_cubic(j, exact)
    np.testing.assert_allclose(cubic.coefficients, figure4.PAPER, rtol=1e-12)
    np.testing.assert_allclose(cubic(j), exact, rtol=0, atol=1e-13)
    assert cubic.rms < 1e-14
    # With noise the errors of the coefficients are their standard errors.
    off = []
    for _ in range(200):
        noisy = figure4.fit_cubic(j, exact + rng.normal(0, 0.01, j.size))
        off.append((noisy.coefficients - figure4.PAPER) / noisy.standard_errors)
    np.testing.assert_allclose(np.std(off, axis=0), 1, atol=0.15)  # 3 sigma of 200 samples
    assert noisy.rms == pytest.approx(0.01, rel=0.11, abs=0)  # 3 sigma of 400


def test_other_normalized_peaks_fail() -> None:
    table = table_of("4")
    above = (table["momentum_ratio"] > 1) & (table["contact"] > 2)
    table.loc[above, "normalized"] = theory.peak_force_fit(table.loc[above, "j"]) + 0.02
    assert {what for _, what in failed("4", table)} >= {
        "LM_ratio > 1: rms of normalized peaks less Eq. 8",
        "LM_ratio > 1: rms of normalized peaks less refit",
    }


def test_a_formula_that_is_further_off_fails() -> None:
    table = table_of("5")
    table.loc[one_scene(table, "native") | one_scene(table, "lammps"), "eq6_N"] *= 1.02
    assert failed("5", table) == {
        ("native", "triangular, LM_ratio 2: Eq. 6, largest error [%]"),
        ("native", "scenes of 18 with an error of Eq. 6 above 3.9 % (paper: 0)"),
    }


@pytest.mark.parametrize("module", [figure3, figure4, figure5])
def test_all_scenes_are_measured(module: ModuleType) -> None:
    table = measured(module.__name__[-1])
    scenes = table[table["backend"] == "native"].groupby(["profile", "momentum_ratio"]).ngroups
    assert scenes == 3 * (len(MOMENTUM_RATIOS) - (module is not figure3))


def test_a_scene_that_fails_in_its_sweep_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    swept = functools.cache(transition_scenes._swept)  # figures have scenes in common

    def hasty(backend: hc.Native | hc.Lammps, ratios: Sequence[float]) -> pd.DataFrame:
        if isinstance(backend, hc.Native):
            return swept(backend, ratios)
        # Two LM_ratio of which one cannot be done in time, as if LAMMPS had measured both.
        late = swept(hc.Native("reference", time_limit=1e-9), ratios[:1])
        return pd.concat([late, swept(hc.Native("reference"), (2.0,))]).assign(backend="lammps")

    monkeypatch.setattr(transition_scenes, "_swept", hasty)
    for module in (figure3, figure4, figure5):
        table = module.SCRIPT.measure(True, True)
        failed = [entry for entry in module.SCRIPT.promises(table) if not entry.passed]
        assert len(failed) == 3
        assert all("time limit" in entry.what for entry in failed)
        assert len(module.SCRIPT.draw(table).axes) >= 2
