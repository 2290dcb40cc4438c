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
from typing import TYPE_CHECKING

from hertzchain.engines.lammps.dialect import COEFF_RESTITUTION, TSUJI_AT_WALLS, WITHOUT_ATTRACTION
from hertzchain.errors import RunFailed

if TYPE_CHECKING:  # lint reads decks without NumPy
    from hertzchain.scene.scene import Scene
    from hertzchain.scene.terms import Contact

BEFORE_ROOT_2, WITH_ROOT_2 = "before 2 Sep 2026", "2 Sep 2026 or later"
"""Versions whose ``tsuji`` is without and with the factor sqrt(2) of the manual."""

_TSUJI = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
"""Polynomial in e for alpha, lowest power first, from the manual (after Marshall 2009)."""

_HIGHEST = 1.1
"""Upper end of the search, above 1, where alpha is negative: at 1 it is still 3e-4."""


def tsuji(restitution: float, root_2: bool) -> float:
    """Return alpha of ``damping tsuji`` for a nominal restitution."""
    alpha = sum(c * restitution**power for power, c in enumerate(_TSUJI))
    return alpha * math.sqrt(2) if root_2 else alpha


def asked_of_tsuji(restitution: float) -> float | None:
    """Return the number with which ``tsuji`` damps as ``coeff_restitution``; None if there is none.

    For ``restitution`` alpha has to be sqrt(5) beta. The polynomial falls from 1.2728 at 0, and
    LAMMPS takes no number below 0: a restitution below 0.113 has no such number.
    """
    log = math.log(restitution)
    alpha = -math.sqrt(5) * log / math.hypot(math.pi, log)
    low, high = 0.0, _HIGHEST
    if alpha > tsuji(low, root_2=False):
        return None
    for _ in range(60):  # bisections: to the last digit
        middle = (low + high) / 2
        low, high = (middle, high) if tsuji(middle, root_2=False) > alpha else (low, middle)
    return (low + high) / 2


def oldest(scene: Scene) -> tuple[str, str] | None:
    """Return the first LAMMPS with the damping of a scene, number and name; None if all have it."""
    asked = [asked_of_tsuji(value) for value in _restitutions(scene).values()]
    if not asked:
        return None
    if None in asked:
        return COEFF_RESTITUTION, "29 Aug 2024"
    return None if scene.wall is None else (TSUJI_AT_WALLS, "2 Aug 2023")


def _restitutions(scene: Scene) -> dict[str, float]:
    """Return restitutions by their variables in a deck; none without that damping."""
    contact = scene.contact
    if contact is None or contact.restitution is None:
        return {}
    found = {"restitution": contact.restitution}
    for name, wall in ("wall", scene.wall), ("near_wall", scene.near_wall):
        if wall is not None and wall.restitution is not None:
            found[f"{name}_restitution"] = wall.restitution
    return found


def refuse_old(scene: Scene, version: str) -> None:
    """Raise RunFailed for a LAMMPS, year month day, without the damping of a scene."""
    needed = oldest(scene)
    if needed is not None and version < needed[0]:
        raise RunFailed(
            f"LAMMPS of {version} does not have the damping of this scene: take LAMMPS of"
            f" {needed[1]} or later, another damping, or native"
        )


def by_version(scene: Scene) -> list[str]:
    """Return the commands by which a deck for any LAMMPS chooses the damping of a restitution.

    They set the variables that ``damping_of`` names; a LAMMPS without such damping stops there.
    """
    own = _restitutions(scene)
    if not own:
        return []
    lines, needed = [], oldest(scene)
    if needed is not None:
        version, name = needed
        lines = [
            f'if "$(version) < {version}" then &',
            f"""    "print 'This damping needs LAMMPS of {name} or later'" "quit 2\"""",
        ]
    newest = [
        "variable damping string coeff_restitution",
        *(f"variable {name} string {value!r}" for name, value in own.items()),
    ]
    asked = {name: asked_of_tsuji(value) for name, value in own.items()}
    if None in asked.values():
        return [*lines, *newest]
    *older, last = (f"variable {name} string {value!r}" for name, value in asked.items())
    return [
        *lines,
        "# Older versions have another damping, with a number of its own for as much of it.",
        f'if "$(version) >= {COEFF_RESTITUTION}" then &',
        *(f'    "{line}" &' for line in newest),
        'else "variable damping string tsuji" &',
        *(f'    "{line}" &' for line in older),
        f'    "{last}"',
    ]


def damping_of(contact: Contact, restitution: str = "restitution") -> tuple[str, str]:
    """Return the second number of a normal law, and the words after the tangential law.

    A restitution, whose variable is named, and its option are those of ``by_version``. In the
    number ``{k}`` and ``{mass}`` stand for the names of 4/3 E* and m* of the pair, where it depends
    on them.
    """
    limit = "" if contact.attraction else f" {WITHOUT_ATTRACTION}"
    if contact.restitution is not None:
        return f"${{{restitution}}}", f"damping ${{damping}}{limit}"
    if contact.damping == "viscoelastic":
        # c = 3/2 A tau sqrt(d) with A = 4/3 E* sqrt(R*) is g m* sqrt(R* d).
        return f"1.5*{contact.parameter!r}*{{k}}/({{mass}})", f"damping viscoelastic{limit}"
    return f"{contact.parameter!r}", f"damping velocity{limit}"
