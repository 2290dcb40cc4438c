"""What gauges in an experiment wrote: forces over time on one clock, from files and tables."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError, require
from hertzchain.pulses.noise import LEAST, noise_within, resolution_of
from hertzchain.pulses.recording import read_columns, read_recording
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.quantities import to_si
from hertzchain.scene.scene import Scene

_SENSOR = re.compile(r"(gauge|contact)_(\d+)|wall")
_COLUMN = re.compile(rf"({_SENSOR.pattern})(?:[ _/([]*([a-zA-Z]+)[)\]]*)?")
_TIME = re.compile(r"(?:time|t)(?:[ _(/\[]+(s|ms|us|µs|ns)[)\]]*)?", re.IGNORECASE)
_SPEC = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<unit>[^\[\]]+)\])?\s*")

ENOUGH = 200
"""Quiet samples that tell the noise to 5 %; with fewer, second differences of all tell more."""


@dataclass(frozen=True, eq=False)
class Traces:
    """Forces over time of several gauges on one clock.

    Parameters
    ----------
    time
        Increasing times [s], shape (samples,); from where they count is not known.
    gauges
        What was measured.
    force
        Without static forces [N], shape (samples, gauges).
    noise
        Standard deviation of the noise of each gauge [N], shape (gauges,).
    """

    time: FloatArray
    gauges: tuple[Gauge, ...]
    force: FloatArray
    noise: FloatArray


def _noise(time: FloatArray, force: FloatArray) -> float:
    """Deviation of noise [N] from second differences, which have part of a pulse's curvature."""
    step = float(np.median(np.diff(time)))
    return noise_within(force, step, resolution_of(force)).deviation


def is_traces(names: list[str], columns: Mapping[str, str]) -> bool:
    """Return whether columns of these names, or with these roles, are traces of some gauges."""
    found = (_COLUMN.fullmatch(name) for name in names)
    return any(map(_SENSOR.fullmatch, columns)) or any(found)


def names_in(results: Any) -> list[str]:
    """Return the names of the columns of a file or table; none where it is neither."""
    if hasattr(results, "columns"):
        return [str(name) for name in results.columns]
    if isinstance(results, str | os.PathLike):
        try:
            return list(read_columns(Path(results)).names)
        except HertzchainError:
            return []
    return []


def read_traces(scene: Scene, results: Any, columns: Mapping[str, str]) -> Traces:
    """Return the traces of a file or a pandas table.

    Parameters
    ----------
    scene
        The scene, which says which gauges can be.
    results
        A text file in any layout, as oscilloscopes write it, or a table; with a column of times.
    columns
        Columns by ``time``, ``gauge_16``, ``contact_10``, ``wall``: names or numbers from 1, and
        what a unit of theirs is, ``"CH1 [25 N]"``. Without them columns of these names are taken.

    Raises
    ------
    SceneError
        For gauges that the scene cannot have, and samples that say nothing.
    HertzchainError
        For a file that cannot be read, or columns that it does not have.
    """
    named = {role: _spec(role, text) for role, text in columns.items()}
    names = names_in(results)
    if not names and not hasattr(results, "columns"):
        read_columns(Path(results))  # says what is wrong with the file
    time_name, time_unit = named.pop("time", ("", ""))
    is_table = hasattr(results, "columns")
    if not time_name:
        time_name, time_unit = next(
            ((m[0], m[1] or "") for name in names if (m := _TIME.fullmatch(name))), ("", "")
        )
        time_unit = f"1 {time_unit}" if time_unit and is_table else ""
    sensors = list(named.items())
    if not sensors:
        found = [match for name in names if (match := _COLUMN.fullmatch(name)) is not None]
        # Of files, the unit in a header is read with its column.
        sensors = [(m[1], (m[0], f"1 {m[4]}" if m[4] and is_table else "")) for m in found]
    allowed = (
        f"has the columns {', '.join(names[:8])}: name those of gauges, as by --column"
        " 'gauge_16=CH1 [25 N]'"
    )
    require(bool(sensors), "traces", None, allowed)
    for role, _ in sensors:
        allowed = "must be gauge_ and the number of a granule, contact_ and its number, or wall"
        require(_SENSOR.fullmatch(role) is not None, "column", role, allowed)
    gauges = tuple(_gauge(role, scene) for role, _ in sensors)
    require(len(set(gauges)) == len(gauges), "traces", None, "have a gauge twice")
    series = []
    for role, (name, unit) in sensors:
        if is_table:
            one = _of_table(results, time_name or "time_s", time_unit, name, unit)
        else:
            one = _of_file(Path(results), role, (time_name, time_unit), (name, unit))
        allowed = "is 0 throughout: nothing was measured"
        require(bool(np.any(one[1])), role, None, allowed)
        series.append(one)
    noise = np.array([_noise(*one) for one in series])
    return Traces(series[0][0], gauges, np.stack([force for _, force in series], axis=1), noise)


def _of_file(
    path: Path, role: str, time: tuple[str, str], force: tuple[str, str]
) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and forces [N] of a file, from names and units of its columns."""
    newtons = to_si(f"column {role}", force[1], "N") if force[1] else None
    unit = time[1].removeprefix("1 ") or None
    try:
        recording = read_recording(path, time[0] or None, force[0], unit, newtons)
    except HertzchainError as problem:  # options of the command pulse
        said = str(problem).replace("--time and --force", "--column time=NAME and gauge_16=NAME")
        said = said.replace("--scale", "--column 'gauge_16=NAME [25 N]'")
        raise HertzchainError(said) from None
    return recording.time, recording.force


def _spec(role: str, text: str) -> tuple[str, str]:
    """Return the name of a column and what a unit of it is, as a quantity; empty if not said."""
    match = _SPEC.fullmatch(str(text))
    assert match is not None  # of any text
    unit = match["unit"] or ""
    if unit and not unit[:1].isdigit() and unit[:1] not in "+-.":
        unit = f"1 {unit}"
    allowed = "must be the name or number of a column, and its unit: 'CH1 [25 N]'"
    require(bool(match["name"]), f"column {role}", text, allowed)
    return match["name"], unit


def _gauge(role: str, scene: Scene) -> Gauge:
    """Return the gauge of a column; SceneError if the scene cannot have it."""
    kind, _, number = role.partition("_")
    if role == "near_wall":
        allowed = "is no gauge of a scene without [near_wall]"
        require(scene.near_wall is not None, role, None, allowed)
        return Gauge(contact=1)
    if kind == "wall":
        allowed = "is no gauge of a scene without [wall]"
        require(scene.wall is not None, "wall", None, allowed)
        return Gauge(contact=scene.last_contact)
    gauge = Gauge(granule=int(number)) if kind == "gauge" else Gauge(contact=int(number))
    gauge.check(scene.chain.granules, scene.wall is not None, scene.near_wall is not None)
    return gauge


def _of_table(
    table: Any, time_name: str, time_unit: str, name: str, unit: str
) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and forces [N] of a pandas table."""
    known = [str(one) for one in table.columns]
    values = []
    for wanted, scale, default in ((time_name, time_unit, "s"), (name, unit, "N")):
        allowed = f"is not one column of the table, which has {', '.join(known)}"
        require(known.count(wanted) == 1, "column", wanted, allowed)
        try:
            column = np.asarray(table[table.columns[known.index(wanted)]], np.float64)
        except (TypeError, ValueError):
            raise SceneError("column", wanted, "must have numbers") from None
        values.append(column * (to_si(f"column {wanted}", scale, default) if scale else 1.0))
    time, force = values
    is_finite = bool(np.all(np.isfinite(time)))
    increases = is_finite and time.size > LEAST and bool(np.all(np.diff(time) > 0))
    require(increases, "time", None, f"must increase, with more than {LEAST} samples")
    require(bool(np.all(np.isfinite(force))), "force", None, "must be finite in each row")
    return time, force
