"""Damping options of Yade's ``Ip2_FrictMat_FrictMat_MindlinPhys``: meaning of their numbers.

``betan`` adds eta d' with eta = 2 betan sqrt(3/2 m* k) d^(1/4) to the force of Hertz's law; ``en``
is converted to a ``betan``. Contacts never pull.
"""

from __future__ import annotations

import math

from hertzchain.errors import RunFailed
from hertzchain.scene.terms import Contact

VERSION = "2023.02a"

BETAN_PER_RATIO = math.sqrt(5 / 6)
"""Ratio of ``betan`` to the damping ratio alpha / sqrt(5) of eta = alpha sqrt(m* k) d^(1/4)."""

_THORNTON = (
    *(-6.918798, -16.41105, 146.8049, -796.4559, 2928.711),
    *(-7206.864, 11494.29, -11342.18, 6276.757, -1489.915),
)
"""Coefficients of a fit for contacts that do not pull, first power first: Thornton, Cummins and
Cleary, Powder Technology 233 (2013) 30.
"""


def betan(en: float) -> float:
    """Return the ``betan`` that Yade computes from ``en``."""
    if en == 1:
        return 0.0
    fit = sum(c * en**power for power, c in enumerate(_THORNTON, start=1))
    return math.sqrt(max(0.0, 1 / (1 - (1 + en) ** 2 * math.exp(fit)) - 1))


def refuse_damping(contact: Contact | None) -> None:
    """Raise RunFailed for damping that Yade does not have."""
    if contact is None:
        return
    if contact.restitution is None:
        raise RunFailed(
            f"Yade has no {contact.damping} damping with Hertz's law: take damping ="
            ' "restitution", or another backend'
        )
    if contact.attraction:
        raise RunFailed(
            "contacts never pull in Yade: leave out attraction, or take another backend"
        )
