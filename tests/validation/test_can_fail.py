"""Validation can fail: numbers of the kept tables that are off, lost or were not measured."""

from __future__ import annotations

import functools
import io
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pandas as pd
import pytest

from tests.places import ROOT
from validation import (
    claims,
    constants,
    corrections,
    eqs_4b_and_5,
    figure1,
    figure2,
    figure3,
    figure4,
    figure5,
    formula_maps,
    limits,
    long_run,
    table2,
    table3,
    table4,
    tradeoff,
)
from validation.limits import LIMITS, Limit
from validation.physics import damped_pulses, damped_waves

FAILING: dict[ModuleType, dict[str, tuple[int, int, int]]] = {
    figure1: {"time": (18, 18, 0), "force": (33, 33, 1), "paper": (6, 6, 1), "momentum": (6, 6, 1)},
    figure2: {"speed": (5, 6, 0)},
    figure3: {
        "contact": (7, 7, 0), "peak_force_N": (0, 1, 0), "p": (0, 21, 0),
        "wave_force_N": (0, 4, 0), "eq3": (0, 21, 0),
    },
    figure4: {"contact": (4, 4, 1), "j": (0, 8, 0), "normalized": (0, 12, 1), "eq8": (0, 2, 0)},
    figure5: {
        "peak_force_N": (0, 55, 1), "eq6_N": (0, 19, 1), "eq9_N": (0, 19, 1),
        "eq9_simulated_N": (0, 18, 1),
    },
    table2: {"p": (12, 12, 1), "eq3": (0, 12, 1), "paper_p": (12, 12, 1), "paper_eq3": (0, 12, 1)},
    table3: {"error_percent": (0, 2, 2), "paper_percent": (0, 2, 2)},
    table4: {"error_percent": (0, 2, 1), "paper_percent": (0, 0, 1)},
    constants: {
        "x": (0, 4, 1), "paper": (4, 12, 1), "nesterenko": (1, 8, 1), "exact": (16, 32, 5),
        "native": (8, 8, 1), "lammps": (8, 8, 1),
    },
    claims: {
        "momentum_ratio": (24, 24, 0), "paper": (0, 2, 4), "native": (10, 44, 6),
        "lammps": (10, 22, 6),
    },
    eqs_4b_and_5: {
        "shift": (0, 0, 1), eqs_4b_and_5.AFTER: (0, 6, 2), eqs_4b_and_5.BEFORE: (0, 8, 2),
        eqs_4b_and_5.WHOLE: (0, 4, 3), eqs_4b_and_5.FIRST_PULSE: (0, 1, 2),
    },
    corrections: {"score": (4, 12, 1)},
    limits: {"native": (0, 7, 1), "lammps": (0, 7, 1)},
    damped_waves: {"x": (6, 9, 0), "lost": (6, 9, 0)},
    damped_pulses: {"x": (0, 5, 0), "y": (0, 5, 0)},
    long_run: {"relation": (0, 0, 1), "momentum": (0, 0, 1), "kicks": (0, 0, 1)},
    tradeoff: {"error": (0, 0, 0)},
}  # fmt: skip
"""Judged columns: how many rows fail if all is off by 1e-5, by 2 %, if the last number is lost."""


@functools.cache
def kept(script: ModuleType) -> pd.DataFrame:
    """Return the table kept in the repository."""
    name = script.__name__.rpartition(".")[2]
    return pd.read_csv(ROOT / "validation" / "results" / f"{name}.csv", comment="#")


def failed(script: ModuleType, table: pd.DataFrame) -> list[str]:
    """Return the names of the rows that fail."""
    promises = getattr(script, "SCRIPT", script).promises
    return [entry.what for entry in promises(table) if not entry.passed]


@pytest.mark.parametrize(
    "script",
    [
        pytest.param(one, marks=[pytest.mark.slow] * (one in (constants, figure5)))
        for one in FAILING
    ],
    ids=lambda script: script.__name__,
)
def test_numbers_that_are_off_or_lost_fail(script: ModuleType) -> None:
    found = {}
    for column in FAILING[script]:
        true = kept(script)[column].astype(float)
        lost = true.where(true.index != true.last_valid_index())
        found[column] = tuple(
            len(failed(script, kept(script).assign(**{column: numbers})))
            for numbers in (true * 1.00001, true * 1.02, lost)
        )
    assert found == FAILING[script]


ONE = "profile == 'triangular' and momentum_ratio == 2 and backend == "
LAMMPS, NATIVE = f"{ONE}'lammps'", f"{ONE}'native'"

Change = float | Callable[[pd.DataFrame], Any] | None

DOCTORED: list[tuple[ModuleType, str, str, Change, int, str]] = [
    (figure1, "source == 'lammps' and profile == 'triangular'", "force", 1.001, 4, "F(t)"),
    (figure2, "backend == 'native' and wave == '(c) small'", "x", 1.001, 5, "(c) small: less"),
    (figure3, "momentum_ratio == 2.5", "p", lambda _: 8, 6, "by Eq. 3 less p simulated"),
    (figure4, f"{LAMMPS} and contact == 7", "", None, 1, "less native's, largest"),
    (figure5, ONE.rpartition(" and")[0], "eq6_N", 1.02, 2, "Eq. 6, largest error"),
    (damped_waves, "lost > 0", "lost", 1 - 2e-4, 9, "G without damping"),
    (damped_pulses, "x > 0", "x", 1 + 2e-3, 5, "speed / F0^(1/6)"),
    (tradeoff, "contender == 'DOP853, SciPy'", "error", lambda _: 1e-8, 1, "the truth by DOP853"),
    (long_run, "granule == 89900", "amplitude", 1 + 1e-9, 4, "velocity-verlet: amplitude"),
]  # fmt: skip
"""Rows and a column; a factor, a function or None to leave the rows out; what fails, how many."""


@pytest.mark.parametrize(("script", "which", "column", "change", "number", "named"), DOCTORED)
def test_a_doctored_table_fails(
    script: ModuleType, which: str, column: str, change: Change, number: int, named: str
) -> None:
    table = kept(script).copy()
    rows = table.query(which).index
    assert len(rows) > 0
    if change is None:
        table = table.drop(index=rows)
    elif callable(change):
        table.loc[rows, column] = change(table.loc[rows])
    else:
        table.loc[rows, column] *= change
    names = failed(script, table)
    assert len(names) == number, names
    assert named in names[0]


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.name)
@pytest.mark.parametrize("backend", ["native", "lammps"])
def test_another_rate_fails(limit: Limit, backend: str) -> None:
    table = kept(limits).copy()
    own = (table["limit"] == limit.name) & (table["value"] > 0)
    table.loc[own, backend] *= table.loc[own, "value"] ** 0.2
    # With it one backend is no longer where the other is.
    expected = {f"rate in {limit.parameter}", "distance / native's - 1"}
    assert set(failed(limits, table)) == {f"{limit.name}: {what}" for what in expected}


# Maps, whose table is not kept


@pytest.fixture(scope="module")
def maps() -> pd.DataFrame:
    return formula_maps.measure(True, False)


MAPS = {"eq3_error": (3, 8, 0), "eq6_error": (7, 12, 1), "eq9_error": (6, 11, 1)}
"""As ``FAILING``: off by 2 %, off by 1, the last lost."""


def test_maps_that_are_off_or_have_gaps_fail(maps: pd.DataFrame) -> None:
    assert failed(formula_maps, maps) == []
    read = pd.read_csv(io.StringIO(maps.to_csv(index=False)))
    assert formula_maps.promises(read) == formula_maps.promises(maps)
    found = {}
    for column in MAPS:
        lost = maps[column].where(maps.index != maps[column].last_valid_index())
        found[column] = tuple(
            len(failed(formula_maps, maps.assign(**{column: numbers})))
            for numbers in (maps[column] * 1.02, maps[column] + 1, lost)
        )
    assert found == MAPS
    wrong = maps.copy()
    wrong.loc[100, ["p", "eq3", *(f"{name}_error" for name in formula_maps.EQUATIONS)]] = math.nan
    assert "cosine: points without p" in failed(formula_maps, wrong)
    assert len(formula_maps.draw(wrong).axes) == 10


@pytest.mark.parametrize("name", formula_maps.EQUATIONS)
@pytest.mark.parametrize("side", formula_maps.SIDES)
def test_a_formula_half_as_good_fails(maps: pd.DataFrame, name: str, side: str) -> None:
    wrong = maps.copy()
    of_side = wrong["momentum_ratio"] < 1 if side == "below" else wrong["momentum_ratio"] > 1
    of_side &= (wrong["part"] == "map") & (wrong["profile"] == "triangular")
    wrong.loc[of_side, f"{name}_error"] *= 2
    what = f"triangular, {formula_maps.SIDES[side]}, {formula_maps.EQUATIONS[name]}"
    names = [entry for entry in failed(formula_maps, wrong) if not entry.startswith("rule")]
    assert names == [f"{what}: share within 5 % [%]", f"{what}: largest error [%]"]
