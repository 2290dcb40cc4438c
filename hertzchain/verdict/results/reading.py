"""Files of results, whatever they are, as peaks of a scene's contacts."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.scene import Scene
from hertzchain.verdict.results import tables
from hertzchain.verdict.results.motion import Motion, Sampled, along_the_chain, peaks_of
from hertzchain.verdict.results.roles import SEVERAL, Asked, asked_for, columns_of, listed

_VECTORS = {
    "position": (("x", "y", "z"), ("xu", "yu", "zu")),
    "velocity": (("vx", "vy", "vz"),),
    "net_force": (("fx", "fy", "fz"),),
}
_ACROSS = 1e-3  # fraction of the length of a chain by which places across it may differ (chosen)


def read(
    scene: Scene,
    results: Any,
    columns: Mapping[str, str],
    units: str,
    dt: float | None,
) -> Sampled:
    """Return the peaks of files, of a table, or as they are; see ``hertzchain.judge``.

    A SceneError says what cannot be used, and why.
    """
    asked = asked_for(columns, units)
    if isinstance(results, str | os.PathLike):
        results = [results]
    if hasattr(results, "select_dtypes"):
        words = results.astype(object).where(results.notna(), "")
        rows = [[str(word) for word in row] for row in words.to_numpy().tolist()]
        places = [f"row {row}" for row in range(1, len(rows) + 1)]
        table = tables.Table(tuple(map(str, results.columns)), rows, places, "the table")
        return _of_table(scene, table, asked, dt)
    is_list = isinstance(results, Sequence) and len(results) > 0
    if not is_list or not all(isinstance(path, str | os.PathLike) for path in results):
        allowed = "is for files and tables: leave it out, and give forces in N"
        require(not columns, "columns", columns, allowed)
        require(units == "si", "units", units, allowed)
        peaks = of_mapping(results, scene) if isinstance(results, Mapping) else results
        return Sampled(peaks, np.zeros(0), "")
    file = " ... ".join(dict.fromkeys((str(results[0]), str(results[-1]))))
    frames: list[tables.Frame] = []
    left = tables.MOST_BYTES
    for path in map(Path, results):
        content = tables.content_of(path, left)
        left -= len(content)
        text = tables.text_of(content, path)
        if tables.is_dump(content):
            frames += tables.frames_of(text, path)
        elif len(results) == 1:
            return _of_table(scene, tables.table_of(text, path), asked, dt)
        else:
            allowed = "is no dump of LAMMPS: several files must be the frames of one dump"
            raise SceneError("", None, allowed, file=path)
    frames = tables.same_columns(frames, file)
    motion = _of_dump(scene, frames, asked, dt, file)
    return _sampled(scene, motion, "the dump of granules", file)


def _of_table(scene: Scene, table: tables.Table, asked: Asked, dt: float | None) -> Sampled:
    """Return peaks of contacts row by row, or of series of forces or positions in columns."""
    file = table.file
    found = columns_of(table.names, asked, scene, file)

    def numbers(role: str) -> FloatArray:
        return table.numbers(found[role].where) * found[role].factor

    if {"contact", "peak_force"} <= found.keys():
        contacts, forces = numbers("contact")[:, 0], numbers("peak_force")[:, 0]
        peaks = by_contact(contacts, forces, scene, file)
        return Sampled(peaks, np.zeros_like(peaks), "")
    series = [role for role in ("contact_force", "net_force", "position") if role in found]
    if not series:
        allowed = (
            f"has the columns {listed(table.names)}: say which are what, such as --column"
            " contact=NAME --column peak_force='NAME [kN]' for peaks (contact 2 is that of"
            " granules 1 and 2), or --column time=NAME --column contact_force='NAME*' for series"
            " (net_force, position, velocity of granules)"
        )
        raise SceneError("", None, allowed, file=file)
    if "time" in found:
        time, is_clock = numbers("time")[:, 0], True
    elif "step" in found:
        time, is_clock = _times_of(numbers("step")[:, 0], dt)
    else:
        time, is_clock = np.arange(len(table.rows), dtype=np.float64), False
    arrays = {role: table.numbers(found[role].where) for role in SEVERAL if role in found}
    factors = {role: found[role].factor for role in arrays}
    motion = Motion.read(time, is_clock, arrays, factors)
    if "contact_force" not in found:
        motion = along_the_chain(motion)
    return _sampled(scene, motion, f"columns {', '.join(series)}", file)


def _times_of(steps: FloatArray, dt: float | None) -> tuple[FloatArray, bool]:
    """Return the times of steps, and whether they are seconds."""
    return (steps, False) if dt is None else (steps * dt, True)


def _of_dump(
    scene: Scene, frames: Sequence[tables.Frame], asked: Asked, dt: float | None, file: str
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
    values = {}
    for role, names in _columns(frames[0].table.names, asked, file).items():
        values[role] = np.zeros((len(frames), scene.chain.granules, 3))
        for axis, name in enumerate(names):
            if name in frames[0].table.names:
                values[role][:, :, axis] = [
                    _column(f, name)[o, 0] for f, o in zip(frames, order, strict=True)
                ]
    factors = {role: asked.factor(role, file) for role in values}
    axis = _axis(values, factors, file)
    steps, times = (np.array([getattr(f, kind) for f in frames]) for kind in ("step", "time"))
    time, is_clock = _times_of(steps, dt)
    if all(frame.time is not None for frame in frames):
        time, is_clock = times.astype(np.float64) * asked.factor("time", file), True
    along = {role: array[:, :, axis] for role, array in values.items()}
    return along_the_chain(Motion.read(time, is_clock, along, factors))


def _column(frame: tables.Frame, name: str) -> FloatArray:
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


def _axis(values: Mapping[str, FloatArray], factors: Mapping[str, float], file: str) -> int:
    """Return the axis that granules lie along, or along which forces act."""
    if "position" not in values:
        return int(np.argmax(np.abs(values["net_force"]).max(axis=(0, 1))))
    extent = np.ptp(values["position"][0], axis=0)
    across, along = np.sort(extent)[1:] * factors["position"]
    if across > _ACROSS * along:
        allowed = (
            f"has granules that are not in a row along x, y or z: they differ by {across:.3g} m"
            " across it"
        )
        raise SceneError("", None, allowed, file=file)
    return int(np.argmax(extent))


def of_mapping(given: Mapping[int, float], scene: Scene) -> FloatArray:
    """Return the peaks of a mapping from contacts to forces [N]."""
    try:
        contacts, forces = np.array([*given.items()], np.float64).reshape(-1, 2).T
    except (TypeError, ValueError):
        raise SceneError("peak_force", None, "must map contacts to forces [N]") from None
    return by_contact(contacts, forces, scene, None)


def by_contact(
    contacts: FloatArray, forces: FloatArray, scene: Scene, file: str | None
) -> FloatArray:
    """Return peaks [N], (contacts,), NaN for missing ones, of forces with numbers of contacts."""
    last = scene.last_contact
    peaks = np.full(last - 1, np.nan)
    for row, (contact, force) in enumerate(zip(contacts.tolist(), forces.tolist(), strict=True), 1):
        key: str
        wrong: Any
        if contact not in range(2, last + 1):
            key, wrong = "contact", int(contact) if contact.is_integer() else contact
            allowed = (
                f"must be a whole number from 2 to {last}: contact 2 lies between granules 1"
                f" and 2{_other_numbers(contacts, last)}"
            )
        elif not np.isnan(peaks[int(contact) - 2]):
            key, wrong, allowed = "contact", int(contact), "is given twice"
        elif not 0 <= force < np.inf:
            key, wrong = "peak_force", force
            allowed = (
                "must be finite and at least 0 [N]: turn the sign where forces that press are"
                " negative, leave out contacts without a peak"
            )
        else:
            peaks[int(contact) - 2] = force
            continue
        raise SceneError(key if file is None else f"{key} in row {row}", wrong, allowed, file=file)
    return peaks


def _other_numbers(contacts: FloatArray, last: int) -> str:
    """Return a hint for contacts that are numbered from 0 or 1; empty for others."""
    least = float(np.min(contacts))
    fits = least in (0, 1) and bool(np.all(contacts == np.round(contacts)))
    if not fits or np.max(contacts) + 2 - least > last:
        return ""
    return f", and these numbers begin with {least:g}: add {2 - least:g} to each"


def _sampled(scene: Scene, motion: Motion, source: str, file: str) -> Sampled:
    """Return the peaks of a motion, with a sentence on their sampling."""
    found = peaks_of(scene, motion, file)
    apart = float(np.median(np.diff(motion.time)))
    distance = f"{apart:.3g} s" if motion.is_clock else f"{apart:.3g} steps"
    how = (
        f"peaks are from {found.how} ({source}), {motion.time.size} samples {distance} apart; they"
        f" may be off by up to {found.largest_error:.1e} for that"
    )
    # Motion of granules says nothing of the force on a wall.
    unknown = np.full(scene.last_contact - 1 - found.peak_force.size, np.nan)
    return replace(
        found,
        peak_force=np.append(found.peak_force, unknown),
        error=np.append(found.error, np.zeros_like(unknown)),
        how=how,
    )
