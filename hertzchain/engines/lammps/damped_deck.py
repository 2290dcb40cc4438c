"""Damping of a scene as options of LAMMPS's ``pair_style granular``; see ``damping``."""

from __future__ import annotations

import math

from hertzchain.engines.lammps.damping import WITH_COEFF_RESTITUTION, tsuji
from hertzchain.engines.lammps.dialect import COEFF_RESTITUTION, TSUJI_AT_WALLS, WITHOUT_ATTRACTION
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Contact

_HIGHEST = 1.1
"""Upper end of the search, above 1, where alpha is negative: at 1 it is still 3e-4."""


def asked_of_tsuji(restitution: float) -> float | None:
    """Return the number with which ``damping tsuji`` damps as ``coeff_restitution``; None for none.

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


def refuse_wall(contact: Contact | None, version: str | None) -> None:
    """Raise RunFailed for a LAMMPS that cannot damp a wall's contact like the others."""
    if contact is None or contact.restitution is None:
        return
    if version is None or version >= TSUJI_AT_WALLS:  # None: the deck itself checks the version
        return
    raise RunFailed(
        f"LAMMPS of {version} changes the restitution at a wall with every run: take LAMMPS of"
        " 2 Aug 2023 or later, another damping, a scene without a wall, or native"
    )


def oldest(scene: Scene) -> tuple[str, str] | None:
    """Return the first LAMMPS with the damping of a scene, number and name; None if all have it."""
    contact = scene.contact
    if contact is None or contact.restitution is None:
        return None
    if asked_of_tsuji(contact.restitution) is None:
        return COEFF_RESTITUTION, "29 Aug 2024"
    return None if scene.wall is None else (TSUJI_AT_WALLS, "2 Aug 2023")


def by_version(scene: Scene) -> list[str]:
    """Return the commands by which a deck for any LAMMPS chooses the damping of a restitution.

    They set the variables that ``damping_of`` names; a LAMMPS without such damping stops there.
    """
    contact = scene.contact
    if contact is None or contact.restitution is None:
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
        f"variable restitution string {contact.restitution!r}",
    ]
    asked = asked_of_tsuji(contact.restitution)
    if asked is None:
        return [*lines, *newest]
    return [
        *lines,
        "# Older versions have another damping, with a number of its own for as much of it.",
        f'if "$(version) >= {COEFF_RESTITUTION}" then &',
        *(f'    "{line}" &' for line in newest),
        'else "variable damping string tsuji" &',
        f'    "variable restitution string {asked!r}"',
    ]


def damping_of(contact: Contact, version: str | None) -> tuple[str, str]:
    """Return the second number of a normal law, and the words after the tangential law.

    In the number ``{k}`` and ``{mass}`` stand for the names of 4/3 E* and m* of the pair, where it
    depends on them. ``version`` is LAMMPS's, year month day; None if the deck chooses. RunFailed
    for a restitution that this version does not have.
    """
    limit = "" if contact.attraction else f" {WITHOUT_ATTRACTION}"
    if contact.restitution is not None:
        if version is None:
            return "${restitution}", f"damping ${{damping}}{limit}"
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
