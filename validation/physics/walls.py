"""A solitary wave at a wall: its force on the wall, and the reflected wave.

Expected numbers are those of a native simulation at 1e-9, the same for 200, 400 and 800 granules;
SciPy finds those of 90 granules to 1e-9.
"""

from __future__ import annotations

import math

import numpy as np

import hertzchain as hc
from validation.physics.chains import EXTRAPOLATED, answers, crest, history_of, steel
from validation.rows import Row, row
from validation.script import Script, rows_only
from validation.shipped import STEEL

WALLS = {
    "rigid": (hc.Wall("rigid"), 2.238376, 1.053925, 0.998222),
    "same material": (hc.Wall("same"), 1.943903, 1.011928, 0.998337),
    "frozen sphere": (
        hc.Wall("elastic", STEEL["young_modulus"] / (2 * math.sqrt(2) - 1), STEEL["poisson_ratio"]),
        1.750403, 1.000862, 0.999732,
    ),
}  # fmt: skip
"""Peaks at the wall and at the last contact, and the height of what comes back, over the wave's.

An elastic wall of E / (2 sqrt 2 - 1) has the contact stiffness of two granules: E* sqrt R is the
same, as a sphere that is held fast would have it.
"""

_DIGIT = "half a unit of the sixth digit, and what is left of the transition"
_BACK = 41
"""Contacts before the wall where the wave is looked at, out of reach of what happens there."""


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for every wall."""
    granules, rows = (90 if quick else 200), []
    tolerance = 3e-5 if quick else 1e-6
    for name, (wall, at_wall, at_last, back) in WALLS.items():
        scene = hc.Scene(steel(granules), hc.Striker(1.0), wall=wall)
        stiffness = scene.granules.stiffness
        kind = {"rigid": 2 * math.sqrt(2), "same material": math.sqrt(2), "frozen sphere": 1.0}
        what = f"{name}: stiffness over that of two granules"
        exact = "a formula: what is left is round-off"
        rows.append(row(what, "theory", stiffness[-1] / stiffness[0], kind[name], 1e-15 * 4, exact))
        for backend, result in answers(scene, with_lammps).items():
            wave = result.peak_force[-_BACK]
            of_wall, of_last = result.peak_force[-1] / wave, result.peak_force[-2] / wave
            reason = _DIGIT if backend == "native" else f"{_DIGIT}; {EXTRAPOLATED}"
            rows += [
                row(f"{name}: peak at the wall", backend, of_wall, at_wall, tolerance, reason),
                row(f"{name}: last contact", backend, of_last, at_last, tolerance, reason),
            ]
            if backend == "native":
                found = _reflected(scene, result) / wave
                reason = f"{_DIGIT}; its height is between samples 0.06 of a shift apart"
                rows.append(row(f"{name}: reflected", backend, found, back, tolerance, reason))
    return rows


def _reflected(scene: hc.Scene, result: hc.Result) -> float:
    """Height of the wave on its way back, at the contact where it was looked at before [N]."""
    first, second = result.peak_time[[-_BACK - 10, -_BACK]]
    shift = (second - first) / 10
    passes = result.peak_time[-1] + (_BACK - 2) * shift
    times = passes + 3 * shift * np.linspace(-1, 1, 101)
    return crest(history_of(hc.Native(rtol=1e-9).run(scene, times)), -_BACK)[1]


SCRIPT = Script(
    "A solitary wave on a wall",
    "How hard does a solitary wave press a wall, and what comes back?",
    "native, LAMMPS; converged simulations, SciPy's DOP853",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
