"""Chains of alternating heavy and light granules with equal contacts: ratios without decay.

At mass ratios 0.3428 and 0.1548 a wave keeps its height, and near 0.240 it decays fastest
(Jayaprakash, Starosvetsky and Vakakis, Phys. Rev. E 83 (2011) 036606).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hertzchain as hc
from validation.physics.chains import EXTRAPOLATED, LAMMPS_STEP, steel
from validation.rows import Row, row
from validation.script import Script, rows_only
from validation.shipped import STEEL

DECAYS = {0.3428: (6.90e-9, 1e-10), 0.1548: (1.46e-8, 1e-10), 0.36: (9.10e-4, 1e-6)}
"""What a wave loses of its height from contact 101 to 121 by mass ratio, and half a digit or more.

By an independent simulation 7e-9, 1.4e-8 and 9e-4.
"""

STRONGEST = 0.240
"""Mass ratio of the strongest decay."""

_FROM, _TO = 100, 120
"""Places of the contacts 101 and 121, counted from 0."""

_DIGITS = "the last digit of what is expected; the reference method is right to 1e-11"
_PEAKS = "peaks are right to 1e-8; {}"
_NEAR = "half a unit of its last digit"


def scene(ratio: float) -> hc.Scene:
    """A striker on a dimer, a heavy granule first."""
    density = np.where(np.arange(150) % 2 == 0, 1.0, ratio) * STEEL["density"]
    whole = hc.Scene(steel(150, density=density), hc.Striker(1.0))
    # The wave passes contact 121 before half of the default end time.
    return replace(whole, run=hc.Run(0.55 * whole.end_time))


def decay(peak_force: np.ndarray) -> float:
    """Return the relative loss of a wave's height from contact 101 to 121."""
    return float(1 - peak_force[_TO] / peak_force[_FROM])


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for every mass ratio; the quick form has LAMMPS for one of them."""
    rows = []
    for ratio, (expected, tolerance) in DECAYS.items():
        drawn, what = scene(ratio), f"mass ratio {ratio:g}: decay from contact 101 to 121"
        found = decay(hc.Native("reference").run(drawn).peak_force)
        rows.append(row(what, "native", found, expected, tolerance, _DIGITS))
        if with_lammps and (not quick or ratio == 0.36):
            lammps = hc.Lammps(LAMMPS_STEP * drawn.contact_time, extrapolated=True)
            found = decay(lammps.peaks_alone(drawn)[0])
            limit = max(tolerance, 2e-8)
            rows.append(row(what, "lammps", found, expected, limit, _PEAKS.format(EXTRAPOLATED)))
    ratios = np.linspace(0.236, 0.244, 3 if quick else 9)
    peaks = [hc.Native(rtol=1e-9).run(scene(float(ratio))).peak_force for ratio in ratios]
    curve = np.polyfit(ratios - STRONGEST, [decay(forces) for forces in peaks], 2)
    at = STRONGEST - curve[1] / (2 * curve[0])
    what = "mass ratio of the strongest decay: top of a parabola"
    rows.append(row(what, "native", at, STRONGEST, 5e-4, _NEAR))
    return rows


SCRIPT = Script(
    "Dimers",
    "At which mass ratios does a wave in a dimer keep its height, and where does it lose most?",
    "native, LAMMPS; independent simulations, Jayaprakash et al. 2011",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
