"""Files of results, whatever they are, as peaks of a scene's contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.verdict.results import tables
from hertzchain.verdict.results.dumped import granules_of, pairs_of
from hertzchain.verdict.results.granules import last_digit, motion_of
from hertzchain.verdict.results.motion import Motion, Sampled, peaks_of
from hertzchain.verdict.results.roles import (
    USUAL_OF_PEAKS,
    Asked,
    Columns,
    asked_for,
    columns_of,
    listed,
)

if TYPE_CHECKING:
    import pandas

_TRAJECTORIES = (".traj", ".extxyz", ".xyz")


def read(
    scene: Scene,
    results: Sequence[Path] | pandas.DataFrame,
    columns: Mapping[str, str],
    units: str,
    dt: float | None,
) -> Sampled:
    """The peaks of a file, of the files of a dump, or of a table.

    A SceneError says what cannot be used, and why.
    """
    asked = asked_for(columns, units)
    if hasattr(results, "select_dtypes"):
        return _of_frame(scene, results, asked, dt)
    if len(results) > 1:
        return _of_dump(scene, results, asked, dt)
    (path,) = results
    content = tables.content_of(path, tables.MOST_BYTES)
    is_dump = tables.is_dump(content)
    name = Path(path.stem) if path.suffix.lower() == ".gz" else path
    if name.suffix.lower() in _TRAJECTORIES and not is_dump:
        if name is not path:
            raise SceneError("", None, "is a packed trajectory: unpack it first", file=path)
        from hertzchain.verdict.results.trajectory import frames_of_trajectory  # loads ASE

        recorded = frames_of_trajectory(path, asked)
        return _sampled(scene, motion_of(scene, recorded, dt, path), recorded.names, path)
    if is_dump:
        return _of_dump(scene, results, asked, dt)
    text = tables.text_of(content, path)
    table = tables.table_of(text, path, () if asked.names else USUAL_OF_PEAKS)
    return _of_table(scene, table, asked, dt, path)


def as_such(peak_force: FloatArray) -> Sampled:
    """Peaks that are not from samples."""
    return Sampled(peak_force, np.zeros_like(peak_force), "")


def _of_dump(scene: Scene, paths: Sequence[Path], asked: Asked, dt: float | None) -> Sampled:
    """The peaks of a dump in one file or several."""
    frames: list[tables.Frame] = []
    left = tables.MOST_BYTES
    for path in paths:
        content = tables.content_of(path, left)
        left -= len(content)
        if not tables.is_dump(content):
            allowed = "is no dump of LAMMPS: several files must be the frames of one dump"
            raise SceneError("", None, allowed, file=path)
        frames += tables.frames_of(tables.text_of(content, path), path)
    file = " ... ".join(dict.fromkeys((str(paths[0]), str(paths[-1]))))
    frames = tables.same_columns(frames, file)
    if "id" in frames[0].names or "id" in asked.names:
        recorded = granules_of(frames, asked, file)
        return _sampled(scene, motion_of(scene, recorded, dt, file), recorded.names, file)
    return _sampled(scene, pairs_of(scene, frames, asked, file), "the dump", file)


def _of_frame(scene: Scene, frame: Any, asked: Asked, dt: float | None) -> Sampled:
    """The peaks of a pandas table."""
    numeric = frame.select_dtypes("number")
    names = tuple(str(name) for name in numeric.columns)
    table = tables.Table(names, np.asarray(numeric.to_numpy(), np.float64))
    if not np.all(np.isfinite(table.rows)):
        raise SceneError("results", None, "must have finite numbers alone: drop rows without")
    return _of_table(scene, table, asked, dt, "the table")


def _of_table(
    scene: Scene, table: tables.Table, asked: Asked, dt: float | None, file: object
) -> Sampled:
    """Peaks of contacts row by row, or series of forces or positions in columns."""
    count = scene.chain.granules
    if len(table.names) == 1:
        allowed = (
            "has one column alone: must have one with the numbers of contacts (2 for that of"
            " granules 1 and 2) and one with their peaks, or series of each granule or contact"
        )
        raise SceneError("", None, allowed, file=str(file))
    found = columns_of(table.names, asked, count, file)
    where = found.where
    if "peak_force" in where:
        return as_such(_rows(table, found, count, file))
    series = [role for role in ("contact_force", "net_force", "position") if role in where]
    if not series:
        allowed = (
            f"has the columns {listed(table.names)}: say which are what, such as --column"
            " contact=NAME --column peak_force='NAME [kN]' for peaks, or --column time=NAME"
            " --column contact_force='NAME*' for series (net_force, position, velocity of"
            " granules)"
        )
        raise SceneError("", None, allowed, file=str(file))
    values: dict[str, FloatArray] = {}
    grains: dict[str, float] = {}
    for role in ("contact_force", "net_force", "position", "velocity"):
        if role not in where:
            continue
        wanted = count - 1 if role == "contact_force" else count
        if len(where[role]) != wanted:
            allowed = (
                f"{role} has {len(where[role])} columns, must have {wanted}: one for each"
                f" {'contact' if role == 'contact_force' else 'granule'} of the scene"
            )
            raise SceneError("", None, allowed, file=str(file))
        raw = table.rows[:, where[role]]
        values[role] = raw * found.factor[role]
        grains[role] = last_digit(raw) * found.factor[role]
    time, is_clock = _times(table, found, dt)
    position = values.get("position")
    if position is not None:
        position = position - position[0, 0]
        if position[0, -1] < position[0, 0]:  # along a negative axis
            position = -position
            for role in ("velocity", "net_force"):
                if role in values:
                    values[role] = -values[role]
    motion = Motion(
        time, is_clock, position, values.get("velocity"), values.get("net_force"),
        values.get("contact_force"), grains.get("position", 0.0), grains.get(series[0], 0.0),
    )  # fmt: skip
    return _sampled(scene, motion, f"columns {', '.join(series)}", file)


def _times(table: tables.Table, found: Columns, dt: float | None) -> tuple[FloatArray, bool]:
    """Times of the rows, and whether they are seconds."""
    if "time" in found.where:
        return table.rows[:, found.where["time"][0]] * found.factor["time"], True
    rows = np.arange(len(table.rows), dtype=np.float64)
    steps = table.rows[:, found.where["step"][0]] if "step" in found.where else rows
    return (steps, False) if dt is None or "step" not in found.where else (steps * dt, True)


def _rows(table: tables.Table, found: Columns, granules: int, file: object) -> FloatArray:
    """Peaks of a table with a row for each contact."""
    if "contact" not in found.where:
        allowed = "has peaks without numbers of contacts: name their column with --column contact="
        raise SceneError("", None, allowed, file=str(file))
    contacts = table.rows[:, found.where["contact"][0]]
    forces = table.rows[:, found.where["peak_force"][0]] * found.factor["peak_force"]
    return _by_contact(contacts, forces, granules, file)


def of_mapping(given: Mapping[int, float], scene: Scene) -> FloatArray:
    """Peaks of a mapping from contacts to forces [N]."""
    try:
        contacts, forces = np.array([*given.items()], np.float64).reshape(-1, 2).T
    except (TypeError, ValueError):
        raise SceneError("peak_force", None, "must map contacts to forces [N]") from None
    return _by_contact(contacts, forces, scene.chain.granules, None)


def _by_contact(
    contacts: FloatArray, forces: FloatArray, granules: int, file: object
) -> FloatArray:
    """Peaks [N], (N - 1,), NaN for missing ones, of forces with the numbers of their contacts."""
    peaks = np.full(granules - 1, np.nan)
    for row, (contact, force) in enumerate(zip(contacts.tolist(), forces.tolist(), strict=True), 1):
        k = int(contact) - 2 if contact.is_integer() else -1
        wrong = "contact", k + 2 if k + 2 == contact else contact
        if not 0 <= k < peaks.size:
            allowed = (
                f"must be a whole number from 2 to {granules}: contact 2 lies between granules 1"
                f" and 2{_other_numbers(contacts, granules)}"
            )
        elif not math.isnan(peaks[k]):
            allowed = "is given twice"
        elif not 0 <= force < math.inf:
            wrong = "peak_force", force
            allowed = (
                "must be finite and at least 0 [N]: turn the sign where forces that press are"
                " negative, leave out contacts without a peak"
            )
        else:
            peaks[k] = force
            continue
        key, value = wrong
        where = "" if file is None else f" in row {row}"
        raise SceneError(key + where, value, allowed, None if file is None else str(file))
    return peaks


def _other_numbers(contacts: FloatArray, granules: int) -> str:
    """A hint for contacts that are numbered from 0 or 1; empty for others."""
    least = float(np.min(contacts))
    fits = least in (0, 1) and bool(np.all(contacts == np.round(contacts)))
    if not fits or np.max(contacts) + 2 - least > granules:
        return ""
    return f", and these numbers begin with {least:g}: add {2 - least:g} to each"


def _sampled(scene: Scene, motion: Motion, source: str, file: object) -> Sampled:
    """The peaks of a motion, with a sentence on their sampling."""
    found = peaks_of(scene, motion, file)
    apart = float(np.median(np.diff(motion.time)))
    distance = f"{apart:.3g} s" if motion.is_clock else f"{apart:.3g} steps"
    counts = found.peak_force > 1e-3 * np.max(found.peak_force)
    off = float(np.max(found.error[counts], initial=0.0))
    how = (
        f"peaks are from {found.how} ({source}), {motion.time.size} samples {distance} apart; they"
        f" may be off by up to {off:.1e} for that"
    )
    return replace(found, how=how)
