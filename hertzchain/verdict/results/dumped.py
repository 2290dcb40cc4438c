"""Dumps of granules by LAMMPS."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.verdict.results.motion import Motion, along_the_chain, last_digit
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
