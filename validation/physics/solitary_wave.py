"""What an equal striker sends down a chain, in the units of its own velocity.

The speed is that between two contacts by their first pulses; velocities are recorded.

The speed is that of the exact solitary wave as high as ``strikers`` has it, 0.9055158 times
0.63955423^(1/6), and the velocity one that simulations in the literature have. The kinetic share is
that of a virial theorem, (5/2) / (5/2 + 2), for forces that go as the overlap to the power 3/2.
"""

from __future__ import annotations

import numpy as np

import hertzchain as hc
from validation.physics.chains import steel
from validation.rows import Row, row
from validation.script import Script, rows_only

SPEED, FASTEST, SHARE = 0.84051, 0.68163, 5 / 9

_FROM, _TO = 50, 70
"""Contacts of a chain of 100 granules between which the wave is looked at; it is settled there."""

_DIGIT = "a unit of the last digit that is known"


def compare(quick: bool, with_lammps: bool) -> list[Row]:  # noqa: ARG001 - the same in every form
    """Rows for the settled wave."""
    scene, native = hc.Scene(steel(100), hc.Striker(1.0)), hc.Native(rtol=1e-9)
    result, chain = native.run(scene), scene.chain
    first, speed = result.first_pulses, result.wave(_FROM, _TO).speed
    assert first is not None
    unit = 2 * chain.radius * (chain.contact_stiffness / chain.granule_mass) ** 0.4
    # Whole periods: kinetic and potential energy change with the place within a granule.
    times = np.linspace(first.arrival[_FROM - 2], first.arrival[_TO - 2], 4001)
    seen = native.run(scene, record=times).history
    assert seen is not None
    behind = _FROM - 20  # far from granules that the striker left rattling
    kinetic = 0.5 * chain.granule_mass * np.sum(seen.velocity[:, behind:] ** 2, axis=1)
    force = seen.contact_force[:, behind:]
    potential = 0.4 * np.sum(force ** (5 / 3), axis=1) / chain.contact_stiffness ** (2 / 3)
    share = np.mean(kinetic[:-1]) / np.mean((kinetic + potential)[:-1])
    fastest = np.max(seen.velocity[:, (_FROM + _TO) // 2])
    recorded = "the mean of 4,000 times: 1e-12 seen"
    return [
        row("speed / (2 R (A/m)^0.4 v^0.2)", "native", speed / unit, SPEED, 1e-5, _DIGIT),
        row("largest velocity of a granule / v", "native", fastest, FASTEST, 1e-5, _DIGIT),
        row("kinetic share", "native", share, SHARE, 1e-9, recorded),
    ]


SCRIPT = Script(
    "The wave of an equal striker",
    "How fast is the wave that an equal striker sends, and how does it share its energy?",
    "native; the exact wave, the literature, a virial theorem",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
