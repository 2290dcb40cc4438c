"""Tables 3 and 4: the error of Eq. 6 for each peak force of the transition."""

from __future__ import annotations

import numpy as np

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from validation.rows import Row, did_not_run, paper_table, row, scene_name, simulate

ENTRY = (
    "percentage points; the paper prints one decimal of a difference of forces that it integrated"
    " with an RK4 of unknown step: 0.18 at most is seen"
)
LENGTH = "the paper prints one column for each contact of the transition"


def compare_table(number: int, quick: bool) -> list[Row]:
    """Error of Eq. 6 [%] for each entry of Table 3 or 4, with both backends as the exact one.

    Parameters
    ----------
    number
        3 (LM_ratio below 1, Eq. 6b) or 4 (above 1, Eq. 6a).
    quick
        Take one scene of each profile instead of three.
    """
    printed: dict[str, list[float]] = {}
    for entry in paper_table(number):
        printed.setdefault(scene_name(entry), []).append(float(entry["error_percent"]))
    names = list(printed)[::3] if quick else list(printed)
    results = simulate(names, f"Table {number}")
    rows = []
    for backend in ("native", "lammps"):
        for name in names:
            result, expected = results[name, backend], printed[name]
            if isinstance(result, hc.HertzchainError):
                rows.append(did_not_run(name, backend, result))
                continue
            p = result.transition_granules
            length = float("nan") if p is None else float(p - 1)
            rows.append(row(f"{name}, entries", backend, length, len(expected), 0.0, LENGTH))
            if not rows[-1].passed:
                continue
            for contact, error, value in zip(
                result.contact, _errors_percent(result), expected, strict=False
            ):
                rows.append(row(f"{name}, F_{contact}", backend, error, value, 0.2, ENTRY))
    return rows


def _errors_percent(result: hc.Result) -> FloatArray:
    """Error of Eq. 6 at contacts 2 ... p, with p and F_SW of the simulation [%]."""
    scene, p, wave_force = (
        result.scene,
        result.transition_granules,
        result.solitary_wave.peak_force,
    )
    assert isinstance(scene.shock, hc.Pulse)
    assert scene.rise_time is not None
    assert p is not None
    assert wave_force is not None
    ratio = theory.effective_momentum_ratio(scene.chain, scene.shock, scene.rise_time)
    contact = np.arange(2, p + 1)
    formula = theory.peak_force(contact, p, wave_force, scene.shock.duration_ratio, ratio)
    return 100 * np.abs(formula / result.peak_force[: p - 1] - 1)
