"""A taper with gaps: a row of collisions of two granules, independent of the force law."""

from __future__ import annotations

import itertools
import math

import hertzchain as hc
from validation.physics.chains import answers, steel
from validation.rows import Row, row
from validation.script import Script, rows_only

TAPERS = {(0.05, 12): 2.2564951245, (0.1, 6): None, (-0.05, 8): None}
"""By how much smaller each radius is than the one before, and by granules: the velocity of the last
over that of the first, where it is known from elsewhere."""

_CLOSED = "momentum and energy of every collision; native promises 1e-9"
_SECOND = "what velocity Verlet leaves of the energy in {} collisions with steps of 0.01"


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for every taper; the quick form leaves out the longest with LAMMPS."""
    rows = []
    for (taper, granules), known in TAPERS.items():
        radius = [5e-3 * (1 - taper) ** k for k in range(granules)]
        scene = hc.Scene(steel(granules, radius=radius, gap=1e-4), hc.Striker(1.0))
        expected = math.prod(2 * a**3 / (a**3 + b**3) for a, b in itertools.pairwise(radius))
        what = f"q {taper:g}, N {granules}"
        if known is not None:
            reason = "half a unit of its last digit"
            rows.append(row(f"{what}: product", "theory", expected, known, 5e-11, reason))
        found = answers(scene, with_lammps and not (quick and known is not None))
        for backend, result in found.items():
            native = backend == "native"
            reason = _CLOSED if native else _SECOND.format(granules - 1)
            limit = 1e-9 if native else 1e-5
            speed = result.velocity[-1]
            rows.append(row(f"{what}: last / first velocity", backend, speed, expected,
                            limit * expected, reason))  # fmt: skip
    return rows


SCRIPT = Script(
    "Tapers with gaps",
    "Is a taper with gaps a row of collisions of two granules?",
    "native, LAMMPS; a product of closed forms",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
