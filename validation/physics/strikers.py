"""Strikers of half to ten times the mass of a granule: the first contact, and the wave far away.

Expected numbers are those of independent simulations in natural units; SciPy confirms the first
contacts.
"""

from __future__ import annotations

import hertzchain as hc
from validation.physics.chains import EXTRAPOLATED, answers, steel, units_of
from validation.rows import Row, row
from validation.script import Script, rows_only
from validation.shipped import STEEL

STRIKERS = {
    0.5: (0.59256, 0.38824, 5e-6),
    1.0: (0.758420, 0.63955423, 5e-7),
    2.0: (0.906747, 0.95025646, 5e-7),
    10.0: (1.108796, 1.65379, 5e-6),
}
"""By mass over a granule's: first contact, far field, and half a unit of the last digit of both."""

_FAR = 60
"""Contact of the far field, in a chain of 80 granules."""

_DIGIT = "half a unit of the last digit that is known"


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for every mass; the quick form has LAMMPS for one of them."""
    rows, unit = [], units_of(1.0)
    for mass, (first, far, tolerance) in STRIKERS.items():
        scene = hc.Scene(steel(80), hc.Striker(1.0, density=mass * STEEL["density"]))
        found = answers(scene, with_lammps and (not quick or mass == 2.0))
        for backend, result in found.items():
            reason = _DIGIT if backend == "native" else f"{_DIGIT}; {EXTRAPOLATED}"
            peaks = result.peak_force / unit.force
            what = f"mass {mass:g}"
            rows += [
                row(f"{what}: first contact", backend, peaks[0], first, tolerance, reason),
                row(f"{what}: far field", backend, peaks[_FAR], far, tolerance, reason),
            ]
            if mass == 1.0:
                end = result.velocity[0]
                reason = f"{_DIGIT}; of LAMMPS, its finer steps, of second order"
                limit = 5e-8 if backend == "native" else 1e-5
                what = f"{what}: velocity of the striker at the end"
                rows.append(row(what, backend, end, -0.0710850, limit, reason))
    return rows


SCRIPT = Script(
    "Strikers",
    "How hard does a striker press the first contact, and what wave does it send?",
    "native, LAMMPS; independent simulations, SciPy's DOP853",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
