"""Numbers of a deck in SI units, by the scales of its own, and those of a deck in lj units."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from hertzchain.engines.lammps.reading import FoundDeck
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene
from hertzchain.verdict.lint.scale import SCALES, Scale

_POWERS: dict[str, tuple[str, ...]] = {
    "length": (
        "origin", "position", "sideways", "radius", "final_position", "overlap", "damped_overlap",
        "missed_overlap", "driven_displacement",
    ),
    "mass": ("mass",),
    "velocity": ("velocity", "closing", "final_velocity"),
    "force": (
        "contact_force", "damped_force", "tangential_force", "constant_force", "applied_force",
        "applied_sideways", "peak_force", "image_force", "force",
    ),
    "time": ("applied_time", "driven_time", "peak_time", "end_time", "start", "dt"),
}  # fmt: skip
"""Fields of what was found, by the unit that they are in."""


def in_si(found: FoundDeck, scene: Scene) -> tuple[FoundDeck, Scale]:
    """What was found in SI units, with the units of the deck.

    A deck in lj units gets those in which the median radius, mass and stiffness are the scene's:
    all other numbers are then judged as ratios.
    """
    if found.units != "lj":
        return found, SCALES[found.units]
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
    units = Scale(length, mass, float(np.sqrt(mass * length / force)))
    return _scaled(found, units), units


def _scaled(found: Any, units: Scale) -> Any:
    """Every number of a deck, of its walls and of its runs in SI units."""
    changed: dict[str, Any] = {
        name: getattr(found, name) * getattr(units, unit)
        for unit, names in _POWERS.items()
        for name in names
        if name in {field.name for field in fields(found)}
    }
    if isinstance(found, FoundDeck):
        changed["spin"] = found.spin / units.time
        changed["drag"] = found.drag * (units.mass / units.time)
        changed["walls"] = tuple(_scaled(wall, units) for wall in found.walls)
        changed["fixes"] = tuple(
            replace(
                fix,
                largest=fix.largest * units.force,
                largest_in_motion=fix.largest_in_motion * units.force,
            )
            for fix in found.fixes
        )
        if found.image_gap is not None:
            changed["image_gap"] = found.image_gap * units.length
        changed["runs"] = tuple(_scaled(run, units) for run in found.runs)
    return replace(found, **changed)
