"""Validation can fail: numbers that are off, lost or wrong, in tables and in simulations."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from tests.validation.test_validation import RESULTS
from validation import constants, limits
from validation.physics import chains, known_numbers, precompression, published
from validation.run_all import SCRIPTS
from validation.script import Row

JUDGED = {
    "figure1": ("time", "force", "paper", "momentum"),
    "figure2": ("speed",),
    "figure3": ("contact", "peak_force_N", "p", "wave_force_N", "eq3"),
    "figure4": ("contact", "j", "normalized", "eq8"),
    "figure5": ("peak_force_N", "eq6_N", "eq9_N", "eq9_simulated_N"),
    "table2": ("p", "eq3", "paper_p", "paper_eq3"),
    "table3": ("error_percent", "paper_percent"),
    "table4": ("error_percent", "paper_percent"),
    "constants": ("x", "paper", "nesterenko", "exact", "native", "lammps"),
    "claims": ("momentum_ratio", "paper", "native", "lammps"),
    "corrections": ("score",),
    "limits": ("native", "lammps"),
    "damped_waves": ("x", "lost"),
    "damped_pulses": ("x", "y"),
}
"""Judged columns of kept tables: a row fails where all numbers of one are 2 % off."""

IF_LOST = {("table4", "paper_percent")}
"""Judged to more than 2 %: a row fails where the last number is lost."""


def failed(rows: Iterable[Row]) -> list[str]:
    return [entry.what for entry in rows if not entry.passed]


@pytest.mark.parametrize(
    ("name", "column"), [(name, column) for name, columns in JUDGED.items() for column in columns]
)
def test_numbers_that_are_off_or_lost_fail(name: str, column: str) -> None:
    table = pd.read_csv(RESULTS / f"{name}.csv", comment="#")
    numbers = table[column].astype(float)
    lost = numbers.where(numbers.index != numbers.last_valid_index())
    wrong = lost if (name, column) in IF_LOST else 1.02 * numbers
    assert failed(SCRIPTS[name].promises(table.assign(**{column: wrong})))


def test_maps_that_are_off_or_have_gaps_fail() -> None:
    maps = SCRIPTS["formula_maps"].measure(True, False)
    assert failed(SCRIPTS["formula_maps"].promises(maps)) == []
    for column in ("eq3_error", "eq6_error", "eq9_error"):
        wrong = maps.assign(**{column: maps[column] + 1})
        assert failed(SCRIPTS["formula_maps"].promises(wrong))
    wrong = maps.assign(p=maps["p"].where(maps.index != 100))
    assert failed(SCRIPTS["formula_maps"].promises(wrong)) == ["cosine: points without p"]


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


@pytest.mark.parametrize(
    ("compare", "doctor", "expected"),
    [
        (known_numbers.compare, harder,
         {"peak / F_max", "first contact", "peak", "F", "contact 2"}),
        (known_numbers.compare, faster,
         {"duration / closed form", "velocity 1 / v", "velocity 2 / v", "its velocity",
          "last / first velocity", "velocity"}),
        (precompression.compare, faster, {"speed / sound"}),
        (published.compare, harder, {"force [N]", "depth [m]"}),
        (published.compare, faster, {"time [s]", "restitution", "velocity 3"}),
    ],
)  # fmt: skip
def test_a_wrong_simulation_fails(
    compare: Callable[[bool, bool], Iterable[Row]],
    doctor: Doctor,
    expected: set[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def doctored(scene: hc.Scene, _: bool, *rest: Any) -> dict[str, hc.Result]:
        return {"native": doctor(answers(scene, False, *rest)["native"])}

    monkeypatch.setattr(chains, "answers", doctored)
    # What no doctor touches, and takes seconds.
    numbers = [item for item in published.NUMBERS if item.scene or "dimer" not in item.what]
    monkeypatch.setattr(published, "NUMBERS", numbers)
    wrong = failed(compare(True, False))
    assert {what.rpartition(": ")[2].split(" at ")[0] for what in wrong} == expected


def test_nesterenko_wave_solves_his_equation() -> None:
    """V^2 xi against xi^(3/2) + ((xi^(3/2))_xx - 3/8 xi^(-1/2) xi_x^2) / 12, by differences."""
    h = 1e-4
    x = np.linspace(-2.2, 2.2, 45)
    before, middle, after = (constants.nesterenko_overlap(x + k * h) for k in (-1, 0, 1))
    curvature = (before**1.5 - 2 * middle**1.5 + after**1.5) / h**2
    slope = (after - before) / (2 * h)
    stress = middle**1.5 + (curvature - 3 / 8 * slope**2 / np.sqrt(middle)) / 12
    # Second differences: h^2 / 12 of a fourth derivative of some tens, and round-off 1e-16 / h^2.
    assert stress == pytest.approx(constants.NESTERENKO_SPEED**2 * middle, rel=0, abs=1e-7)


def test_the_far_field_of_an_impulse() -> None:
    # Ten digits stand in the script; the peaks still change by 1e-12 there.
    expected = limits.IMPULSE_COEFFICIENT
    assert limits.impulse_coefficient() == pytest.approx(expected, rel=1e-10, abs=0)
    # The same from the native solver: short pulses, and their error of LM^3 taken out.
    coefficients = []
    for momentum_ratio in (0.02, 0.01):
        scene = limits.impulse_scene(momentum_ratio, granules=50)
        impulse = scene.impulse / scene.units.momentum
        peaks = hc.Native("reference").run(scene).peak_force / scene.units.force
        coefficients.append(peaks[40] / impulse**1.2)
    extrapolated = (8 * coefficients[1] - coefficients[0]) / 7
    # 1e-3 of the error of the better one: the next term is smaller by a power of LM.
    assert extrapolated == pytest.approx(expected, rel=2e-10, abs=0)
