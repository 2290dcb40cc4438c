"""Contacts of a deck in words, and what their commands are about."""

from __future__ import annotations

import math

from hertzchain.verdict.deck.deck_check import Case, Indices, names


def contact_name(indices: Indices, case: Case) -> str:
    """Contacts by the paper's numbers; the wall by its name."""
    if case.scene.wall is not None and indices.size == 1 and indices[0] + 1 == case.near.size:
        return "the wall"
    return names(indices, len(case.laws), "contact", 2)


def role_of(indices: Indices, case: Case) -> str:
    """Which commands make the force of some contacts: a key of ``ROLES``."""
    is_wall = case.scene.wall is not None and int(indices[0]) + 1 == case.near.size
    return "wall" if is_wall else "contacts"


def reduced_modulus(case: Case, k: int) -> float:
    """E* of a contact of the scene [Pa]."""
    granules = case.scene.granules
    if k + 1 < granules.mass.size:
        reduced = 1 / (1 / granules.radius[k] + 1 / granules.radius[k + 1])
    else:
        reduced = granules.radius[-1]
    return float(0.75 * granules.stiffness[k] / math.sqrt(reduced))
