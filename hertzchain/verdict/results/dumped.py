"""Dumps of LAMMPS: granules, or pairs with the force of their contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.verdict.results.granules import Recorded, last_digit
from hertzchain.verdict.results.motion import Motion
from hertzchain.verdict.results.roles import Asked, listed
from hertzchain.verdict.results.tables import Frame

_VECTORS = (
    ("position", ("x", "y", "z")),
    ("position", ("xu", "yu", "zu")),
    ("position", ("xs", "ys", "zs")),
    ("position", ("xsu", "ysu", "zsu")),
    ("velocity", ("vx", "vy", "vz")),
    ("net_force", ("fx", "fy", "fz")),
)
_SCALED = {name: k % 3 for k, name in enumerate(("xs", "ys", "zs", "xsu", "ysu", "zsu"))}
"""Columns of places in units of the box, with their axes."""


def granules_of(frames: Sequence[Frame], asked: Asked, file: object) -> Recorded:
    """What a dump of granules has, in the order of their ids, SI units."""
    names = frames[0].names
    ids = asked.names.get("id", "id")
    if ids not in names:
        raise SceneError("column id", ids, "is no column of the dump", file=str(file))
    order = [np.argsort(frame.rows[:, names.index(ids)]) for frame in frames]
    sizes = {len(frame.rows) for frame in frames}
    if len(sizes) > 1:
        allowed = f"has frames of {min(sizes)} to {max(sizes)} granules: some were lost"
        raise SceneError("", None, allowed, file=str(file))
    columns = _vectors(names, asked, file)
    values: dict[str, FloatArray] = {}
    grains = {"position": 0.0, "net_force": 0.0}
    for role, three in columns.items():
        factor = asked.factor(role, file)
        raw = np.zeros((len(frames), max(sizes), 3))
        for axis, name in enumerate(three):
            if name in names:
                k = names.index(name)
                raw[:, :, axis] = [f.rows[o, k] for f, o in zip(frames, order, strict=True)]
            elif len(three) == 1:
                raise SceneError(f"column {role}", name, "is no column of the dump", file=str(file))
        if role in grains:
            grains[role] = last_digit(raw) * factor
        if set(three) & _SCALED.keys():
            bounds = _bounds(frames, file)[:, [_SCALED[name] for name in three]]
            extent = bounds[:, :, 1] - bounds[:, :, 0]
            grains[role] *= float(extent.max())
            raw = bounds[:, np.newaxis, :, 0] + raw * extent[:, np.newaxis]
        values[role] = raw * factor
    time = None
    if all(frame.time is not None for frame in frames):
        scale = asked.factor("time", file)
        time = np.array([frame.time for frame in frames], np.float64) * scale
    steps = np.array([frame.step for frame in frames])
    grain, force_grain = grains["position"], grains["net_force"]
    return Recorded(steps, time, values, grain, force_grain, "the dump of granules")


def _vectors(names: Sequence[str], asked: Asked, file: object) -> dict[str, tuple[str, ...]]:
    """The columns of places, velocities and forces: three, or the one along the chain."""
    found: dict[str, tuple[str, ...]] = {}
    for role, three in _VECTORS:
        if set(three) & set(names):
            found.setdefault(role, three)
    for role in ("position", "velocity", "net_force"):
        if role in asked.names:
            found[role] = (asked.names[role],)
    if not {"position", "net_force"} & found.keys():
        allowed = f"has {listed(names)}, must have x, vx, fx (or xu, or y, z) of granules"
        raise SceneError("", None, allowed, file=str(file))
    return found


def _bounds(frames: Sequence[Frame], file: object) -> FloatArray:
    """Bounds of the box of each frame, shape (frames, 3, 2)."""
    boxes = [frame.box for frame in frames if frame.box is not None]
    if len(boxes) < len(frames):
        allowed = "has scaled places (xs) and no upright box: dump x or xu instead"
        raise SceneError("", None, allowed, file=str(file))
    return np.array(boxes)


def pairs_of(scene: Scene, frames: Sequence[Frame], asked: Asked, file: object) -> Motion:
    """Contact forces of a dump of pairs: two ids, and the force of their contact."""
    names, count = frames[0].names, scene.chain.granules
    roles = {
        role: asked.names[role] for role in ("id1", "id2", "contact_force") if role in asked.names
    }
    if not roles:
        whole = [
            name
            for k, name in enumerate(names)
            if all(np.array_equal(f.rows[:, k], np.round(f.rows[:, k])) for f in frames)
            and any(np.any(f.rows[:, k] > 0) for f in frames)
        ]
        others = [name for name in names if name not in whole]
        if len(whole) == 2 and len(others) == 1:
            roles = {"id1": whole[0], "id2": whole[1], "contact_force": others[0]}
    if set(roles) != {"id1", "id2", "contact_force"} or not set(roles.values()) <= set(names):
        allowed = (
            f"is a dump of pairs with {listed(names)}: say which are what with --column"
            " id1=NAME --column id2=NAME --column contact_force=NAME (compute property/local"
            " patom1 patom2, and compute pair/local force)"
        )
        raise SceneError("", None, allowed, file=str(file))
    k1, k2, kf = (names.index(roles[role]) for role in ("id1", "id2", "contact_force"))
    force = np.zeros((len(frames), count - 1))
    for row, frame in zip(force, frames, strict=True):
        first = np.minimum(frame.rows[:, k1], frame.rows[:, k2]).astype(np.int64)
        last = np.maximum(frame.rows[:, k1], frame.rows[:, k2]).astype(np.int64)
        beyond = (first < 1) | (last > count) | (last - first != 1)
        pressed = np.abs(frame.rows[:, kf]) > 0
        if np.any(beyond & pressed):
            k = int(np.flatnonzero(beyond & pressed)[0])
            allowed = (
                f"granules {first[k]} and {last[k]} press one another: contacts of the scene are"
                f" between granules 1 to {count} that follow one another"
            )
            raise SceneError("", None, allowed, file=str(file))
        row[first[~beyond] - 1] = frame.rows[~beyond, kf]
    if np.all(force <= 0):  # a code that counts pushes as negative
        force = -force
    steps = np.array([frame.step for frame in frames])
    factor = asked.factor("contact_force", file)
    grain = last_digit(force) * factor
    motion = Motion(steps, False, contact_force=force * factor, force_grain=grain)
    first_peak, last_peak = (int(np.argmax(force[:, k])) for k in (0, -1))
    if last_peak < first_peak:  # the wave comes from the other end
        assert motion.contact_force is not None
        return replace(motion, contact_force=motion.contact_force[:, ::-1])
    return motion
