"""Damping options of LAMMPS's ``pair_style granular``: versions, and the meaning of their numbers.

Each option takes the second number of the normal law, g, and adds eta d' to the elastic force F_el
at an overlap d:

===================== ================================= =============================
option                eta                               g
===================== ================================= =============================
``velocity``          g                                 [kg/s]
``mass_velocity``     g m*                              [1/s]
``viscoelastic``      g m* sqrt(R* d)                   [1/(m s)]
``tsuji``             alpha(g) sqrt(m* F_el / d)        nominal restitution
``coeff_restitution`` sqrt(5) beta(g) sqrt(m* F_el / d) nominal restitution
===================== ================================= =============================

``limit_damping`` forbids contacts to pull, F = max(F, 0).
"""

from __future__ import annotations

import math

SINCE_2021 = "29 Sep 2021 or later"
WITH_COEFF_RESTITUTION = "29 Aug 2024 or later"
BEFORE_ROOT_2, WITH_ROOT_2 = "before 2 Sep 2026", "2 Sep 2026 or later"
"""Versions whose ``tsuji`` is without and with the factor sqrt(2) of the manual."""

_TSUJI = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
"""Polynomial in e for alpha, lowest power first, from the manual (after Marshall 2009)."""


def tsuji(restitution: float, root_2: bool) -> float:
    """Return alpha of ``damping tsuji`` for a nominal restitution."""
    alpha = sum(c * restitution**power for power, c in enumerate(_TSUJI))
    return alpha * math.sqrt(2) if root_2 else alpha
