"""Numbers of a deck in SI units, by the scales of its own, and those of a deck in lj units."""

from __future__ import annotations

import numpy as np

from hertzchain.engines.lammps.reading.found import FoundDeck, scaled
from hertzchain.engines.lammps.reading.units import UNITS, Units
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene


def in_si(found: FoundDeck, scene: Scene) -> tuple[FoundDeck, Units]:
    """What was found in SI units, with the units of the deck.

    A deck in lj units gets those in which the median radius, mass and stiffness are the scene's:
    all other numbers are then judged as ratios.
    """
    if found.units != "lj":
        return found, UNITS[found.units]
    granules = scene.granules
    count = min(found.radius.size, granules.radius.size)
    pressed = found.contact_force > 0
    per_overlap = (
        np.where(pressed, found.contact_force, np.nan)
        / np.where(pressed, found.overlap, 1.0) ** 1.5
    )
    if not pressed.any() or count < 2:
        raise RunFailed(
            "no contact of this deck pushes, so that its lj units of length, mass and time cannot"
            " be found: look at its pair_style and pair_coeff"
        )
    contacts = min(per_overlap.shape[1], granules.stiffness.size)
    ratio = granules.stiffness[:contacts] / per_overlap[:, :contacts]
    length = float(np.median(granules.radius[:count] / found.radius[:count]))
    mass = float(np.median(granules.mass[:count] / found.mass[:count]))
    force = float(np.nanmedian(ratio)) * length**1.5
    units = Units("lj", length, mass, float(np.sqrt(mass * length / force)))
    return scaled(found, units), units
