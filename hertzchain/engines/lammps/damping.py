"""Damping options of LAMMPS's ``pair_style granular``: versions, and what their numbers mean.

Each option takes the second number of the normal law, g, and adds eta d' to the elastic force F_el
at an overlap d:

===================== ================================= =============================
option                eta                               g
===================== ================================= =============================
``velocity``          g                                 [kg/s]
``mass_velocity``     g m*                              [1/s]
``viscoelastic``      g m* sqrt(R* d)                   [1/(m s)]
``tsuji``             alpha(g) sqrt(m* F_el / d)        restitution that is asked for
``coeff_restitution`` sqrt(5) beta(g) sqrt(m* F_el / d) restitution that is asked for
===================== ================================= =============================

``limit_damping`` forbids contacts to pull, F = max(F, 0).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hertzchain.engines.lammps.dialect import COEFF_RESTITUTION, TSUJI_AT_WALLS, WITHOUT_ATTRACTION
from hertzchain.errors import RunFailed

if TYPE_CHECKING:  # lint takes numbers from here, and loads no NumPy
    from hertzchain.scene.terms import Contact

SINCE_2021 = "29 Sep 2021 or later"
WITH_COEFF_RESTITUTION = "29 Aug 2024 or later"
BEFORE_ROOT_2, WITH_ROOT_2 = "before 2 Sep 2026", "2 Sep 2026 or later"
"""Versions whose ``tsuji`` is without and with the factor sqrt(2), as the manual has it."""

_TSUJI = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
"""Polynomial in e for alpha, lowest power first, as the manual has it (after Marshall 2009)."""


def tsuji(restitution: float, root_2: bool) -> float:
    """Return alpha of ``damping tsuji`` for the restitution that is asked for."""
    alpha = sum(c * restitution**power for power, c in enumerate(_TSUJI))
    return alpha * math.sqrt(2) if root_2 else alpha


_HIGHEST = 1.1
"""Above 1, where alpha is below 0 already: at 1 it is 3e-4 still."""


def asked_of_tsuji(restitution: float) -> float | None:
    """The number that makes ``damping tsuji`` damp as ``coeff_restitution`` does; None for none.

    For ``restitution`` alpha is to be sqrt(5) beta. The polynomial falls from 1.2728 at 0, and
    LAMMPS takes no number below 0: there is none for a restitution below 0.113.
    """
    log = math.log(restitution)
    alpha = -math.sqrt(5) * log / math.hypot(math.pi, log)
    low, high = 0.0, _HIGHEST
    if alpha > tsuji(low, root_2=False):
        return None
    for _ in range(60):  # halves: to the last digit
        middle = (low + high) / 2
        low, high = (middle, high) if tsuji(middle, root_2=False) > alpha else (low, middle)
    return (low + high) / 2


def refuse_wall(contact: Contact | None, version: str) -> None:
    """Raise RunFailed where a LAMMPS cannot damp the contact with a wall as the others."""
    if contact is None or contact.restitution is None or version >= TSUJI_AT_WALLS:
        return
    raise RunFailed(
        f"LAMMPS of {version} changes the restitution at a wall with every run: take LAMMPS of"
        " 2 Aug 2023 or later, another damping, a scene without a wall, or native"
    )


def damping_of(contact: Contact, version: str) -> tuple[str, str]:
    """The second number of a normal law, and the words that follow the tangential law.

    In the number ``{k}`` and ``{mass}`` stand for the names of 4/3 E* and m* of the pair, where it
    depends on them. RunFailed for a restitution that this version, year month day, does not have.
    """
    limit = "" if contact.attraction else f" {WITHOUT_ATTRACTION}"
    if contact.restitution is not None:
        if version >= COEFF_RESTITUTION:
            return f"{contact.restitution!r}", f"damping coeff_restitution{limit}"
        asked = asked_of_tsuji(contact.restitution)
        if asked is None:
            raise RunFailed(
                f"LAMMPS of {version} has no damping for a restitution of {contact.restitution:g}:"
                f" take one above 0.114, or LAMMPS of {WITH_COEFF_RESTITUTION}, or native"
            )
        return f"{asked!r}", f"damping tsuji{limit}"
    if contact.relaxation_time is not None:
        # c = 3/2 A tau sqrt(d) with A = 4/3 E* sqrt(R*) is g m* sqrt(R* d).
        return f"1.5*{contact.relaxation_time!r}*{{k}}/({{mass}})", f"damping viscoelastic{limit}"
    return f"{contact.coefficient!r}", f"damping velocity{limit}"
