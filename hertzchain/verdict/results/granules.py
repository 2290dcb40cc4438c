"""Frames of granules, in any order along any axis, as the motion of a scene's chain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.verdict.results.motion import Motion

_ACROSS = 1e-3  # of the length of a chain by which places across it may differ (chosen)
_LOOKED_AT = 2000  # numbers of a file whose digits are counted (chosen)
_SAME_STEP = 0.02  # relative; how well a step is known from places and velocities (chosen)


@dataclass(frozen=True, eq=False)
class Recorded:
    """Frames of granules in the order of their numbers, SI units.

    Parameters
    ----------
    steps, time
        Of the frames: steps, and times [s] where they are given, shape (frames,).
    values
        ``position``, ``velocity``, ``net_force`` as far as they are given, (frames, granules, 3).
    grain, force_grain
        The last digit of positions [m] and of forces [N].
    names
        What they are, in messages.
    """

    steps: FloatArray
    time: FloatArray | None
    values: Mapping[str, FloatArray]
    grain: float
    force_grain: float
    names: str


def motion_of(scene: Scene, recorded: Recorded, dt: float | None, file: object) -> Motion:
    """The motion along the chain, from the granule on that the wave starts at."""
    some = next(iter(recorded.values.values()))
    count, wanted = some.shape[1], scene.chain.granules
    if count != wanted:
        allowed = f"has {count} granules, the scene {wanted}: dump those of the chain alone"
        raise SceneError("", None, allowed, file=str(file))
    axis = _axis(recorded, file)
    values = {role: array[:, :, axis] for role, array in recorded.values.items()}
    if "position" in values:
        order = np.argsort(values["position"][0], kind="stable")
        values = {role: array[:, order] for role, array in values.items()}
    if _comes_from_the_end(values):
        values = {role: -array[:, ::-1] for role, array in values.items()}
    time, is_clock = recorded.steps, False
    if recorded.time is not None:
        time, is_clock = recorded.time, True
    elif dt is not None:
        time, is_clock = recorded.steps * dt, True
    elif "position" in values and "velocity" in values:
        mass = scene.granules.mass
        pushed = values.get("net_force", np.zeros_like(values["velocity"])) / mass
        step = _step(recorded.steps, values["position"], values["velocity"], pushed)
        if step is not None:
            time, is_clock = recorded.steps * step, True
    if "position" in values:
        values["position"] = values["position"] - values["position"][0, 0]
    return Motion(
        time, is_clock, values.get("position"), values.get("velocity"), values.get("net_force"),
        None, recorded.grain, recorded.force_grain,
    )  # fmt: skip


def _axis(recorded: Recorded, file: object) -> int:
    """The axis that granules lie along, or along which forces act."""
    if "position" in recorded.values:
        place = recorded.values["position"][0]
        extent = place.max(axis=0) - place.min(axis=0)
        axis = int(np.argmax(extent))
        across = np.delete(extent, axis)
        if np.any(across > _ACROSS * extent[axis]):
            allowed = (
                f"has granules that are not in a row along x, y or z: they differ by"
                f" {across.max():.3g} m across it"
            )
            raise SceneError("", None, allowed, file=str(file))
        return axis
    return int(np.argmax(np.abs(recorded.values["net_force"]).max(axis=(0, 1))))


def _comes_from_the_end(values: Mapping[str, FloatArray]) -> bool:
    """Whether the last granule is moved before the first."""
    for role in ("net_force", "velocity", "position"):
        if role in values:
            array = values[role]
            moved = np.abs(array - (array[0] if role == "position" else 0.0))
            counts = moved > 0.05 * moved.max()
            first, last = (np.flatnonzero(counts[:, k]) for k in (0, -1))
            return bool(last.size and (not first.size or last[0] < first[0]))
    return False


def _step(
    steps: FloatArray, position: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> float | None:
    """The step [s], from how far granules move at their velocities; None where it is not sure.

    Between two frames they move by h (v0 + v1) / 2 - h^2 (a1 - a0) / 12, but for the fifth order
    of the time h, which is the step times the steps between them.
    """
    moved, between = np.diff(position, axis=0), np.diff(steps)[:, np.newaxis]
    path = between * (velocity[1:] + velocity[:-1]) / 2
    bend = between**2 * np.diff(acceleration, axis=0) / 12
    whole = float(np.sum(path**2))
    if whole == 0:
        return None
    step = 0.0
    for _ in range(20):  # each brings some digits: the second term is small
        step = float(np.sum((moved + step**2 * bend) * path)) / whole
    off = moved - step * path + step**2 * bend
    known = float(np.sum(off**2)) < _SAME_STEP**2 * float(np.sum(moved**2))
    return step if step > 0 and known else None


def last_digit(values: FloatArray) -> float:
    """The unit of the last digit that the largest of some numbers have; 0 where they have 15.

    The numbers have equally many significant digits, or decimals.
    """
    some = values[values != 0].ravel()
    if not some.size:
        return 0.0
    words = [f"{value:.14e}" for value in np.abs(some[:: max(1, some.size // _LOOKED_AT)])]
    digits = max(len(word.partition("e")[0].rstrip("0").replace(".", "")) for word in words)
    exponent = math.floor(math.log10(float(np.max(np.abs(some)))))
    return 0.0 if digits >= 15 else float(10.0 ** (exponent - digits + 1))
