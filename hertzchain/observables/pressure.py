"""The largest Hertz pressure of a run, and the contacts in which a metal yields.

A sphere of a metal yields below the surface where p0 exceeds 1.60 Y, by von Mises for a Poisson's
ratio of 0.3; of two materials the weaker one yields (K. L. Johnson, Contact Mechanics, 1985,
chapter 6). Y is the yield strength in simple tension.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.scene.scene import Scene

YIELDS_AT = 1.60
"""p0 over Y at which a sphere begins to yield (Johnson, chapter 6)."""


@dataclass(frozen=True)
class LargestPressure:
    """The largest p0 of all contacts, and when.

    Parameters
    ----------
    pressure
        p0, the pressure in the middle of the contact at its peak force [Pa].
    contact
        Number of the contact.
    time
        Time of the peak [s]; None if no contact was pressed.
    """

    pressure: float
    contact: int
    time: float | None

    @property
    def needed_strength(self) -> float:
        """Yield strength below which a metal yields under this pressure, p0 / 1.60 [Pa]."""
        return self.pressure / YIELDS_AT

    def to_dict(self) -> dict[str, Any]:
        """Return the keys of a JSON document; null for the time where no contact was pressed."""
        return {
            "largest_pressure_Pa": self.pressure,
            "largest_pressure_contact": self.contact,
            "largest_pressure_time_s": self.time,
            "needed_yield_strength_Pa": self.needed_strength,
        }


def largest_pressure(
    scene: Scene, peak_force: FloatArray, peak_time: FloatArray
) -> LargestPressure:
    """Return the largest pressure under the peaks [N] at their times [s], (contacts,) each."""
    pressure = pressures(scene, peak_force)
    k = int(np.argmax(pressure))
    time = float(peak_time[k])
    return LargestPressure(
        float(pressure[k]), scene.contacts[k], None if math.isnan(time) else time
    )


def pressures(scene: Scene, force: FloatArray) -> FloatArray:
    """Return p0 of every contact under its force [N]; [Pa], shape (contacts,).

    The force of a damped contact has the part of its damper, so that p0 is above that of the
    overlap: by 0.06 % for two spheres of restitution 0.9, by 3 % for 0.5 (measured).
    """
    each = scene.granules
    return np.asarray(hertz.pressure_of(each.stiffness, each.contact_radius, force))


def yield_warning(scene: Scene, peak_force: FloatArray) -> str | None:
    """Return the warning where p0 exceeds 1.60 Y; None where it does not or no Y is known."""
    walls = (one for one in (scene.wall, scene.near_wall) if one is not None)
    if scene.chain.yield_strength is None and not any(one.yield_strength for one in walls):
        return None
    weaker = _weaker(scene, peak_force.size)
    load = pressures(scene, peak_force) / (YIELDS_AT * weaker)
    k, beyond = int(np.argmax(load)), int(np.count_nonzero(load > 1))
    if not beyond:
        return None
    most = scene.contact_name(scene.contacts[k])
    return (
        f"{beyond} of {load.size} contacts yield, {most} most: the pressure is"
        f" {load[k]:.3g} times the {YIELDS_AT * weaker[k]:.3g} Pa at which a yield_strength of"
        f" {weaker[k]:.3g} Pa is reached below the surface (von Mises; Johnson, Contact Mechanics,"
        " 1985, chapter 6), and the contacts here stay elastic"
    )


def _weaker(scene: Scene, contacts: int) -> FloatArray:
    """Return Y of the weaker body of each contact [Pa], shape (contacts,); inf where none is known.

    A striker with a material of its own and a rigid wall have no known Y.
    """
    known = scene.chain.yield_strength
    of = np.full(scene.chain.granules, math.inf)
    if known is not None:
        of[:] = known
    if set(scene.shock.material) - {"radius"}:
        of[0] = math.inf
    wall, near = scene.wall, scene.near_wall
    if near is not None:
        of = np.append(near.yield_strength or math.inf, of)
    behind = math.inf if wall is None or wall.yield_strength is None else wall.yield_strength
    return np.append(np.minimum(of[:-1], of[1:]), min(float(of[-1]), behind))[:contacts]
