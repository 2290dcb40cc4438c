"""Trajectories that ASE reads, which is loaded for them alone."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.verdict.results.granules import Recorded, last_digit
from hertzchain.verdict.results.roles import Asked

_ARRAYS = {
    "velocity": ("velocity", "velo", "velocities", "vel"),
    "net_force": ("forces", "force", "net_force"),
}
_GRAINED = ("position", "net_force")
_INFO = {"position": "length_unit_m", "velocity": "velocity_unit_m_s", "net_force": "force_unit_N"}
"""Units that hertzchain's own trajectories carry."""


def frames_of_trajectory(path: Path, asked: Asked) -> Recorded:
    """The frames of a trajectory, SI units; numbers are taken as they stand in the file."""
    import ase.io

    try:
        logging.disable(logging.WARNING)
        with warnings.catch_warnings():
            # ASE 3.29 does so, which says nothing of the file.
            warnings.filterwarnings("ignore", "Setting the shape on a NumPy", DeprecationWarning)
            frames: list[Any] = ase.io.read(path, index=":")
    except Exception as problem:  # ASE raises many kinds for a broken file
        said = " ".join(str(problem).split())[:100] or type(problem).__name__
        allowed = f"is no trajectory that ASE can read ({said}): is the file cut off?"
        raise SceneError("", None, allowed, file=path) from None
    finally:
        logging.disable(logging.NOTSET)
    counts = {len(frame) for frame in frames}
    if len(counts) != 1 or counts == {0}:
        raise SceneError("", None, "must have frames of the same granules", file=path)
    values: dict[str, FloatArray] = {}
    for role in ("position", "velocity", "net_force"):
        found = [_array(frame, role, asked.names.get(role)) for frame in frames]
        known = [array for array in found if array is not None]
        if len(known) == len(frames):
            own = frames[0].info.get(_INFO[role])
            factor = float(own) if own is not None else asked.factor(role, path)
            values[role] = np.array(known, np.float64) * factor
    if not all(np.all(np.isfinite(array)) for array in values.values()):
        raise SceneError("", None, "has numbers that are not finite", file=path)
    if frames[0].info.get("length_unit_m") is not None and "velocity" in values:
        values.pop("net_force", None)
    steps = np.arange(len(frames), dtype=np.float64)
    grains = [last_digit(values[role]) if role in values else 0.0 for role in _GRAINED]
    time = _times(frames, asked, path)
    return Recorded(steps, time, values, grains[0], grains[1], "the trajectory")


def _array(frame: Any, role: str, named: str | None) -> Any:
    """An array of a frame, (granules, 3); None where there is none."""
    if role == "position":
        return frame.arrays.get(named) if named else frame.get_positions()
    for name in (named,) if named else _ARRAYS[role]:
        if name in frame.arrays and frame.arrays[name].ndim == 2:
            return frame.arrays[name]
    if role == "net_force" and frame.calc is not None:
        return frame.calc.results.get("forces")
    return None


def _times(frames: list[Any], asked: Asked, path: Path) -> FloatArray | None:
    """Times of the frames [s], where they carry them."""
    for name in ("time_s", asked.names.get("time", "time"), "Time"):
        found = [frame.info.get(name) for frame in frames]
        if all(isinstance(one, int | float | np.number) for one in found):
            factor = 1.0 if name == "time_s" else asked.factor("time", path)
            return np.array(found, np.float64) * factor
    return None
