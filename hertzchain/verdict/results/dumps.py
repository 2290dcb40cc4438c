"""Text dumps of granules by LAMMPS, frame by frame: net forces along the chain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.units import Units
from hertzchain.errors import SceneError
from hertzchain.verdict.results.motion import Motion, last_digit

_PLACES, _FORCES = (("x", "y", "z"), ("xu", "yu", "zu")), (("fx", "fy", "fz"),)
_ACROSS = 1e-3  # fraction of the length of a chain by which places across it may differ (chosen)
_MOVED = 0.05  # fraction of the largest force from which an end of the chain is pushed (chosen)


def is_dump(text: str) -> bool:
    """Return whether the text of a file is that of a dump of LAMMPS."""
    return text[:1000].lstrip()[:5] == "ITEM:"


@dataclass(frozen=True, eq=False)
class _Frame:
    """Places and forces of the granules, by id, as written, shape (granules, 3)."""

    step: float
    time: float | None
    place: FloatArray
    force: FloatArray


def motion_of(
    texts: Sequence[str], granules: int, units: Units, dt: float | None, file: str
) -> Motion:
    """Return the net forces in the frames of one dump, from the pushed end of the chain on.

    It may lie along any axis, be pushed at either end, and have its frames in many texts. A
    SceneError says what cannot be used.
    """
    frames = sorted(
        (frame for text in texts for frame in _frames_of(text, granules, file)),
        key=lambda frame: frame.step,
    )
    place, force = (np.array([getattr(f, name) for f in frames]) for name in ("place", "force"))
    axis = _axis(place[0] * units.length, file)
    order = np.argsort(place[0, :, axis], kind="stable")
    net = np.ascontiguousarray(force[:, order, axis])
    if pushed_at_the_end(net):
        net = -net[:, ::-1]
    time, is_clock = np.array([frame.step for frame in frames]), dt is not None
    if all(frame.time is not None for frame in frames):
        time, is_clock = np.array([frame.time for frame in frames]) * units.time, True
    elif dt is not None:
        time = time * dt
    return Motion(time, is_clock, net * units.force, last_digit(net) * units.force)


def _frames_of(text: str, granules: int, file: str) -> list[_Frame]:
    found: list[_Frame] = []
    items: dict[str, tuple[list[str], list[str]]] = {}
    for item in text.split("ITEM:")[1:]:
        head, *lines = item.splitlines() or [""]
        kind, *words = head.split() or [""]
        items[kind] = words, [line for line in lines if line.strip()]
        if kind in ("ATOMS", "ENTRIES"):
            found.append(_frame(items, granules, f"{file}, frame {len(found) + 1}"))
            items = {}
    if items:
        raise _cut_off(f"{file}, frame {len(found) + 1}")
    return found


def _cut_off(where: str) -> SceneError:
    allowed = "ends in the middle, or has other rows there: is the file cut off?"
    return SceneError("", None, allowed, file=where)


def _frame(items: dict[str, tuple[list[str], list[str]]], granules: int, where: str) -> _Frame:
    """Return a frame of its items, each with the words after its name and the lines below."""
    names, lines = items.get("ATOMS", ([], []))
    columns = [
        next((three for three in vectors if set(three) & set(names)), ())
        for vectors in (_PLACES, _FORCES)
    ]
    if "id" not in names or not all(columns):
        allowed = "must have the columns id, x (or xu), fx of granules, or those of y or z"
        raise SceneError("", None, allowed, file=where)
    rows = [line.split() for line in lines]
    step, time, count = (
        _number(items[name][1][:1]) if name in items else None
        for name in ("TIMESTEP", "TIME", "NUMBER")
    )
    is_whole = len(rows) == count and all(len(row) == len(names) for row in rows)
    if not is_whole or step is None or not math.isfinite(step + (time or 0.0)):
        raise _cut_off(where)
    if len(rows) != granules:
        allowed = (
            f"has {len(rows)} granules, the scene {granules}: dump those of the chain alone, all of"
            " them"
        )
        raise SceneError("", None, allowed, file=where)

    def numbers(*wanted: str) -> FloatArray:
        found = [
            [_number([row[names.index(name)]]) if name in names else 0.0 for name in wanted]
            for row in rows
        ]
        values = np.array(found)
        if not np.all(np.isfinite(values)):
            allowed = f"must have finite numbers in the columns {', '.join(wanted)}"
            raise SceneError("", None, allowed, file=where)
        return values

    order = np.argsort(numbers("id")[:, 0])
    place, force = (numbers(*three)[order] for three in columns)
    return _Frame(step, time, place, force)


def _number(words: Sequence[str]) -> float:
    """Return the only word as a number; NaN if it is not one."""
    try:
        return float(words[0]) if "_" not in words[0] else math.nan
    except (ValueError, IndexError):
        return math.nan


def _axis(place: FloatArray, file: str) -> int:
    """Return the axis that granules lie along."""
    extent = np.ptp(place, axis=0)
    across, along = np.sort(extent)[1:]
    if across > _ACROSS * along:
        allowed = (
            f"has granules that are not in a row along x, y or z: they differ by {across:.3g} m"
            " across it"
        )
        raise SceneError("", None, allowed, file=file)
    return int(np.argmax(extent))


def pushed_at_the_end(force: FloatArray) -> bool:
    """Return whether the last granule feels a force before the first, (samples, granules)."""
    counts = np.abs(force) > _MOVED * np.max(np.abs(force))
    first, last = (np.flatnonzero(counts[:, k]) for k in (0, -1))
    return bool(last.size and (not first.size or last[0] < first[0]))
