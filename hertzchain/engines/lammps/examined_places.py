"""Places of the granules in an examination of a scene with terms, and overlaps there."""

from __future__ import annotations

import numpy as np

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.external.terms import wall_position
from hertzchain.scene.scene import Scene


def set_places(place: FloatArray) -> str:
    """Return the commands that put each granule at its place [m]."""
    return "\n".join(f"set atom {k} x {x!r}" for k, x in enumerate(place.tolist(), start=1))


def smaller_radius(scene: Scene) -> FloatArray:
    """Return the smaller radius of each contact, at a wall the last granule's [m], (contacts,)."""
    radius = scene.granules.radius
    smaller = np.append(np.minimum(radius[:-1], radius[1:]), radius[-1])
    return np.asarray(smaller[: scene.granules.stiffness.size])


def apart(scene: Scene, fraction: float) -> FloatArray:
    """Return places without contacts [m]: at least a fraction of the smaller radius apart."""
    place, away = _loose(scene), fraction * smaller_radius(scene)
    between = away[: place.size - 1]
    left = np.append(np.cumsum(between[::-1])[::-1], 0.0)
    return np.asarray(place - left - (0.0 if scene.wall is None else away[-1]))


def pressed(scene: Scene, which: Array, fraction: float) -> FloatArray:
    """Return places at which some contacts, no two of them neighbours, are pressed [m].

    Their overlap is about a fraction of the smaller radius.
    """
    radius, depth, place = scene.granules.radius, fraction * smaller_radius(scene), _loose(scene)
    for contact in np.flatnonzero(which):
        if contact + 1 < place.size:
            reach = radius[contact] + radius[contact + 1]
            place[contact + 1] = place[contact] + reach - depth[contact]
        else:
            place[-1] = wall_position(scene) - radius[-1] + depth[-1]
    return place


def overlaps(scene: Scene, place: FloatArray) -> FloatArray:
    """Return the overlap of each contact at rounded places [m], shape (contacts,)."""
    radius = scene.granules.radius
    found = radius[:-1] + radius[1:] - np.diff(place)
    return (
        found
        if scene.wall is None
        else np.append(found, radius[-1] - (wall_position(scene) - place[-1]))
    )


def wall_place(place: FloatArray, force: FloatArray, radius: float) -> float:
    """Return the place of the wall by Hertz's law, from the forces at two places of a granule [m].

    NaN if there is no force.
    """
    with np.errstate(all="ignore"):
        deep = np.sign(force) * np.abs(force) ** (2 / 3)
        growth = (deep[1] - deep[0]) / (place[1] - place[0])
        return float(place[0] + radius - deep[0] / growth)


def _loose(scene: Scene) -> FloatArray:
    """Return the places of the granules without load [m]; a wall stays in place."""
    granules = scene.granules
    distance = granules.radius[:-1] + granules.radius[1:] + granules.gap[: granules.mass.size - 1]
    place = np.concatenate([[0.0], np.cumsum(distance)])
    if scene.wall is None:
        return place
    return np.asarray(
        place + (wall_position(scene) - scene.wall.gap - granules.radius[-1] - place[-1])
    )
