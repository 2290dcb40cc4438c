"""Dumps of LAMMPS: granules, or pairs with the force of their contact."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.verdict.results.motion import Motion, along_the_chain, begins_at_the_end, last_digit
from hertzchain.verdict.results.roles import Asked, listed
from hertzchain.verdict.results.tables import Frame

_VECTORS = {
    "position": (("x", "y", "z"), ("xu", "yu", "zu")),
    "velocity": (("vx", "vy", "vz"),),
    "net_force": (("fx", "fy", "fz"),),
}
_ACROSS = 1e-3  # fraction of the length of a chain by which places across it may differ (chosen)


def granules_of(
    scene: Scene, frames: Sequence[Frame], asked: Asked, dt: float | None, file: str
) -> Motion:
    """Return the motion in a dump of granules, along any axis, from the pushed end on."""
    counts = {len(frame.table.rows) for frame in frames}
    if counts != {scene.chain.granules}:
        allowed = (
            f"has frames of {listed([str(count) for count in sorted(counts)])} granules, the scene"
            f" {scene.chain.granules}: dump those of the chain alone, all of them"
        )
        raise SceneError("", None, allowed, file=file)
    order = [np.argsort(_column(frame, asked.names.get("id", "id"))[:, 0]) for frame in frames]
    values: dict[str, FloatArray] = {}
    grains = {}
    for role, names in _columns(frames[0].table.names, asked, file).items():
        raw = np.zeros((len(frames), scene.chain.granules, 3))
        for axis, name in enumerate(names):
            if name in frames[0].table.names:
                raw[:, :, axis] = [
                    _column(f, name)[o, 0] for f, o in zip(frames, order, strict=True)
                ]
        grains[role] = last_digit(raw) * asked.factor(role, file)
        values[role] = raw * asked.factor(role, file)
    axis = _axis(values, file)
    steps, times = (np.array([getattr(f, kind) for f in frames]) for kind in ("step", "time"))
    time, is_clock = steps, False
    if all(frame.time is not None for frame in frames):
        time, is_clock = times.astype(np.float64) * asked.factor("time", file), True
    elif dt is not None:
        time, is_clock = steps * dt, True
    motion = Motion(
        time,
        is_clock,
        grain=grains.get("position", 0.0),
        force_grain=grains.get("net_force", 0.0),
    )
    values = {role: array[:, :, axis] for role, array in values.items()}
    return along_the_chain(motion.with_values(values))


def _column(frame: Frame, name: str) -> FloatArray:
    return frame.table.numbers([frame.table.names.index(name)])


def _columns(names: Sequence[str], asked: Asked, file: str) -> dict[str, tuple[str, ...]]:
    """Return the columns of places, velocities and forces: three, or the one along the chain."""
    found: dict[str, tuple[str, ...]] = {}
    for role, vectors in _VECTORS.items():
        if role in asked.names:
            found[role] = (asked.names[role],)
            if asked.names[role] not in names:
                allowed = "is no column of the dump"
                raise SceneError(f"column {role}", asked.names[role], allowed, file=file)
        elif any(set(three) & set(names) for three in vectors):
            found[role] = next(three for three in vectors if set(three) & set(names))
    if asked.names.get("id", "id") not in names or not {"position", "net_force"} & found.keys():
        allowed = (
            f"has {listed(names)}, must have id, and x, vx, fx (or xu, or y, z) of granules; dump"
            " atom writes x after dump_modify scale no"
        )
        raise SceneError("", None, allowed, file=file)
    return found


def _axis(values: dict[str, FloatArray], file: str) -> int:
    """Return the axis that granules lie along, or along which forces act."""
    if "position" not in values:
        return int(np.argmax(np.abs(values["net_force"]).max(axis=(0, 1))))
    extent = np.ptp(values["position"][0], axis=0)
    across, along = np.sort(extent)[1:]
    if across > _ACROSS * along:
        allowed = (
            f"has granules that are not in a row along x, y or z: they differ by {across:.3g} m"
            " across it"
        )
        raise SceneError("", None, allowed, file=file)
    return int(np.argmax(extent))


def pairs_of(
    scene: Scene, frames: Sequence[Frame], asked: Asked, dt: float | None, file: str
) -> Motion:
    """Return contact forces of a dump of pairs: two ids, and the force of their contact."""
    names, count = frames[0].table.names, scene.chain.granules
    rows = [frame.table.numbers(range(len(names))) for frame in frames]
    wanted = [asked.names.get(role, "") for role in ("id1", "id2", "contact_force")]
    if not any(wanted):  # two columns of whole numbers, and one of others
        known = np.concatenate(rows)
        whole = np.all(known == np.round(known), axis=0) & np.any(known > 0, axis=0)
        wanted = [names[k] for k in np.argsort(~whole, kind="stable")]
        wanted = wanted if np.count_nonzero(whole) == 2 and len(names) == 3 else []
    if not wanted or not set(wanted) <= set(names):
        allowed = (
            f"is a dump of pairs with {listed(names)}: say which are what with --column"
            " id1=NAME --column id2=NAME --column contact_force=NAME (compute property/local"
            " patom1 patom2, and compute pair/local force)"
        )
        raise SceneError("", None, allowed, file=file)
    force = np.zeros((len(frames), count - 1))
    for frame, values in zip(force, rows, strict=True):
        *ids, given = values[:, [names.index(name) for name in wanted]].T
        first, last = (ends.astype(np.int64) for ends in (np.minimum(*ids), np.maximum(*ids)))
        inside = (first >= 1) & (last <= count) & (last - first == 1)
        for k in np.flatnonzero(~inside & (given != 0))[:1]:
            allowed = (
                f"granules {first[k]} and {last[k]} press one another: contacts of the scene are"
                f" between granules 1 to {count} that follow one another"
            )
            raise SceneError("", None, allowed, file=file)
        frame[first[inside] - 1] = given[inside]
    if np.all(force <= 0):  # a code that counts pushes as negative
        force = -force
    if begins_at_the_end(force):
        force = force[:, ::-1]
    steps = np.array([frame.step for frame in frames])
    time, is_clock = (steps, False) if dt is None else (steps * dt, True)
    unit = asked.factor("contact_force", file)
    return Motion(time, is_clock, contact_force=force * unit, force_grain=last_digit(force) * unit)
