"""Files of results, whatever they are, as peaks of a scene's contacts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.verdict.results import tables
from hertzchain.verdict.results.dumped import granules_of
from hertzchain.verdict.results.motion import Motion, Sampled, along_the_chain, last_digit, peaks_of
from hertzchain.verdict.results.roles import SEVERAL, Asked, asked_for, columns_of, listed


def read(
    scene: Scene,
    results: Any,
    columns: Mapping[str, str],
    units: str,
    dt: float | None,
) -> Sampled:
    """Return the peaks of a file, of the files of a dump, or of a table.

    ``results`` are paths, or a pandas table. A SceneError says what cannot be used, and why.
    """
    asked = asked_for(columns, units)
    if hasattr(results, "select_dtypes"):
        words = results.astype(object).where(results.notna(), "")
        rows = [[str(word) for word in row] for row in words.to_numpy().tolist()]
        places = [f"row {row}" for row in range(1, len(rows) + 1)]
        table = tables.Table(tuple(map(str, results.columns)), rows, places, "the table")
        return _of_table(scene, table, asked, dt)
    file = " ... ".join(dict.fromkeys((str(results[0]), str(results[-1]))))
    frames: list[tables.Frame] = []
    left = tables.MOST_BYTES
    for path in results:
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
    motion = granules_of(scene, frames, asked, dt, file)
    return _sampled(scene, motion, "the dump of granules", file)


def _of_table(scene: Scene, table: tables.Table, asked: Asked, dt: float | None) -> Sampled:
    """Return peaks of contacts row by row, or of series of forces or positions in columns."""
    granules, file = scene.chain.granules, table.file
    found = columns_of(table.names, asked, granules, file)

    def numbers(role: str) -> FloatArray:
        return table.numbers(found[role].where) * found[role].factor

    if {"contact", "peak_force"} <= found.keys():
        contacts, forces = numbers("contact")[:, 0], numbers("peak_force")[:, 0]
        peaks = by_contact(contacts, forces, granules, file)
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
    grains = {
        role: last_digit(table.numbers(found[role].where)) * found[role].factor for role in series
    }
    if "time" in found:
        time, is_clock = numbers("time")[:, 0], True
    else:
        steps = np.arange(len(table.rows), dtype=np.float64)
        steps = numbers("step")[:, 0] if "step" in found else steps
        is_clock = dt is not None and "step" in found
        time = steps * (dt if dt is not None and is_clock else 1.0)
    motion = Motion(
        time, is_clock, grain=grains.get("position", 0.0), force_grain=grains[series[0]]
    )
    values = {role: numbers(role) for role in SEVERAL if role in found}
    motion = motion.with_values(values)
    if "contact_force" not in found:
        motion = along_the_chain(motion)
    return _sampled(scene, motion, f"columns {', '.join(series)}", file)


def of_mapping(given: Mapping[int, float], scene: Scene) -> FloatArray:
    """Return the peaks of a mapping from contacts to forces [N]."""
    try:
        contacts, forces = np.array([*given.items()], np.float64).reshape(-1, 2).T
    except (TypeError, ValueError):
        raise SceneError("peak_force", None, "must map contacts to forces [N]") from None
    return by_contact(contacts, forces, scene.chain.granules, None)


def by_contact(
    contacts: FloatArray, forces: FloatArray, granules: int, file: str | None
) -> FloatArray:
    """Return peaks [N], (N - 1,), NaN for missing ones, of forces with numbers of contacts."""
    peaks = np.full(granules - 1, np.nan)
    for row, (contact, force) in enumerate(zip(contacts.tolist(), forces.tolist(), strict=True), 1):
        key: str
        wrong: Any
        if contact not in range(2, granules + 1):
            key, wrong = "contact", int(contact) if contact.is_integer() else contact
            allowed = (
                f"must be a whole number from 2 to {granules}: contact 2 lies between granules 1"
                f" and 2{_other_numbers(contacts, granules)}"
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


def _other_numbers(contacts: FloatArray, granules: int) -> str:
    """Return a hint for contacts that are numbered from 0 or 1; empty for others."""
    least = float(np.min(contacts))
    fits = least in (0, 1) and bool(np.all(contacts == np.round(contacts)))
    if not fits or np.max(contacts) + 2 - least > granules:
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
    return replace(found, how=how)
