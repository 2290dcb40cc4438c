"""Files of results, whatever they are, as peaks of a scene's contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.verdict.judgement import read_peaks
from hertzchain.verdict.results import tables
from hertzchain.verdict.results.dumped import granules_of, pairs_of
from hertzchain.verdict.results.granules import last_digit, motion_of
from hertzchain.verdict.results.motion import Motion, Sampled, peaks_of
from hertzchain.verdict.results.roles import Asked, Columns, asked_for, columns_of

if TYPE_CHECKING:
    import pandas

_TRAJECTORIES = (".traj", ".extxyz", ".xyz")


@dataclass(frozen=True, eq=False)
class Given:
    """Peaks that somebody brings.

    Parameters
    ----------
    peak_force
        Of contacts 2 ... N [N], shape (N - 1,), NaN where there is none.
    sampling
        How far off each may be by the distance of samples, as a fraction, shape (N - 1,); None for
        peaks that are given as such.
    remark
        A sentence on where they come from; empty for peaks that are given as such.
    """

    peak_force: FloatArray
    sampling: FloatArray | None = None
    remark: str = ""


def read(
    scene: Scene,
    results: Path | pandas.DataFrame,
    columns: Mapping[str, str],
    units: str,
    dt: float | None,
) -> Given:
    """The peaks of a file, or of a table; a SceneError says what cannot be used, and why."""
    asked = asked_for(columns, units)
    if not isinstance(results, Path):
        return _of_frame(scene, results, asked, dt)
    if results.suffix.lower() in _TRAJECTORIES:
        from hertzchain.verdict.results.trajectory import frames_of_trajectory  # loads ASE

        recorded = frames_of_trajectory(results, asked)
        return _sampled(scene, motion_of(scene, recorded, dt, results), recorded.names, results)
    text = tables.text_of(results)
    if not asked.names and _is_of_peaks(text):
        peaks = read_peaks(results, scene.chain.granules)
        if np.all(np.isnan(peaks)):
            raise SceneError("", None, "has a header and no row of numbers", file=str(results))
        return Given(peaks)
    if not tables.is_dump(text):
        return _of_table(scene, tables.table_of(text, results), asked, dt, results)
    frames = tables.frames_of(text, results)
    if "id" in frames[0].names or "id" in asked.names:
        recorded = granules_of(frames, asked, results)
        return _sampled(scene, motion_of(scene, recorded, dt, results), recorded.names, results)
    return _sampled(scene, pairs_of(scene, frames, asked, results), "the dump", results)


def _is_of_peaks(text: str) -> bool:
    """Whether a text is CSV with the usual columns of peaks."""
    header = [cell.strip(' "\r') for cell in text.lstrip().partition("\n")[0].split(",")]
    return {"contact", "peak_force_N"} <= set(header)


def _of_frame(scene: Scene, frame: Any, asked: Asked, dt: float | None) -> Given:
    """The peaks of a pandas table."""
    if not hasattr(frame, "columns") or not hasattr(frame, "to_numpy"):
        allowed = "must be a file or a pandas DataFrame; hertzchain.judge takes arrays and mappings"
        raise SceneError("results", type(frame).__name__, allowed)
    numeric = frame.select_dtypes("number")
    names = tuple(str(name) for name in numeric.columns)
    table = tables.Table(names, np.asarray(numeric.to_numpy(), np.float64))
    if not np.all(np.isfinite(table.rows)):
        raise SceneError("results", None, "must have finite numbers alone: drop rows without")
    return _of_table(scene, table, asked, dt, "the table")


def _of_table(
    scene: Scene, table: tables.Table, asked: Asked, dt: float | None, file: object
) -> Given:
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
        return Given(_rows(table, found, count, file))
    series = [role for role in ("contact_force", "net_force", "position") if role in where]
    if not series:
        allowed = (
            f"has the columns {', '.join(table.names[:8])}"
            f"{', ...' if len(table.names) > 8 else ''}: say which are what, such as --column"
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
    peaks = np.full(granules - 1, np.nan)
    contacts = table.rows[:, found.where["contact"][0]]
    forces = table.rows[:, found.where["peak_force"][0]] * found.factor["peak_force"]
    for number, (contact, force) in enumerate(zip(contacts, forces, strict=True), start=1):
        allowed = f"must be a whole number from 2 to {granules}, each once"
        k = int(contact) - 2 if contact == int(contact) else -1
        if not 0 <= k < peaks.size or not math.isnan(peaks[k]):
            raise SceneError(f"contact in row {number}", float(contact), allowed, file=str(file))
        if force < 0:
            allowed = "must be at least 0: turn the sign where forces that press are negative"
            raise SceneError(f"peak_force in row {number}", float(force), allowed, file=str(file))
        peaks[k] = force
    return peaks


def _sampled(scene: Scene, motion: Motion, source: str, file: object) -> Given:
    """The peaks of a motion, with a sentence on their sampling."""
    found: Sampled = peaks_of(scene, motion, file)
    apart = float(np.median(np.diff(motion.time)))
    distance = f"{apart:.3g} s" if motion.is_clock else f"{apart:.3g} steps"
    counts = found.peak_force > 1e-3 * np.max(found.peak_force)
    off = float(np.max(found.error[counts], initial=0.0))
    remark = (
        f"peaks are from {found.how} ({source}), {motion.time.size} samples {distance} apart; they"
        f" may be off by up to {off:.1e} for that"
    )
    return Given(found.peak_force, found.error, remark)
