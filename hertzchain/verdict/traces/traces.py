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
from hertzchain.pulses.layout import layout_of, read_lines
from hertzchain.pulses.noise import LEAST, noise_before, noise_within, resolution_of
from hertzchain.pulses.recording import read_recording
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.quantities import to_si
from hertzchain.scene.scene import Scene

_SENSOR = re.compile(r"(gauge|contact)_(\d+)|wall")
_COLUMN = re.compile(rf"({_SENSOR.pattern})(?:[ _/([]*([a-zA-Z]+)[)\]]*)?")
_SPEC = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<unit>[^\[\]]+)\])?\s*")

_ENOUGH = 200
"""Quiet samples that tell the noise to 5 %; with fewer, second differences of all tell more."""

_QUIET = 0.02
"""Part of the largest sample below which, before the first above it, there is no pulse: ten times
the weakest noise of which something can be told, 0.2 %."""


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
    """

    time: FloatArray
    gauges: tuple[Gauge, ...]
    force: FloatArray

    @property
    def noise(self) -> FloatArray:
        """Standard deviation of the noise of each gauge [N], shape (gauges,).

        It is that of the samples before anything arrives or, where these are few, from second
        differences, which have part of the curvature of a coarsely sampled pulse, too.
        """
        step = float(np.median(np.diff(self.time)))
        found = []
        for force in self.force.T:
            quiet = int(np.argmax(np.abs(force) > _QUIET * np.max(np.abs(force)))) // 2
            digit = resolution_of(force)
            measured = noise_within(force, step, digit)
            if quiet >= _ENOUGH:
                measured = noise_before(force[:quiet], step, digit)
            found.append(measured.deviation)
        return np.array(found)


def is_traces(names: list[str], scene: Scene, columns: Mapping[str, str]) -> bool:
    """Return whether columns of these names are traces of some gauges, and not of all contacts."""
    if any(_SENSOR.fullmatch(role) for role in columns):
        return True
    found = [match for name in names if (match := _COLUMN.fullmatch(name)) is not None]
    # Codes number contacts from 0, 1 or 2: all of them are as many as there are.
    contacts = sum(match[1].startswith("contact_") for match in found)
    return bool(found) and contacts < scene.chain.granules - 1


def names_in(results: Any) -> list[str]:
    """Return the names of the columns of a file or table; none where it is neither."""
    if hasattr(results, "columns"):
        return [str(name) for name in results.columns]
    if isinstance(results, str | os.PathLike):
        try:
            return list(layout_of(Path(results), read_lines(Path(results))).names)
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
    time_name, time_unit = named.pop("time", ("", ""))
    sensors = dict(named)
    if not sensors:
        matches = [_COLUMN.fullmatch(name) for name in names_in(results)]
        sensors = {m[1]: (m[0], "") for m in matches if m is not None}
    for role in sensors:
        allowed = "must be gauge_ and the number of a granule, contact_ and its number, or wall"
        require(_SENSOR.fullmatch(role) is not None, "column", role, allowed)
    gauges = tuple(_gauge(role, scene) for role in sensors)
    series = []
    for role, (name, unit) in sensors.items():
        if hasattr(results, "columns"):
            one = _of_table(results, time_name or "time_s", time_unit, name, unit)
        else:
            newtons = to_si(f"column {role}", unit, "N") if unit else None
            recording = read_recording(
                Path(results), time_name or None, name, time_unit.removeprefix("1 ") or None, None,
                newtons,
            )  # fmt: skip
            one = recording.time, recording.force
        allowed = "is 0 throughout: nothing was measured"
        require(bool(np.any(one[1])), role, None, allowed)
        series.append(one)
    return Traces(series[0][0], gauges, np.stack([force for _, force in series], axis=1))


def _spec(role: str, text: str) -> tuple[str, str]:
    """Return the name of a column and what a unit of it is, as a quantity; empty if not said."""
    match = _SPEC.fullmatch(str(text))
    assert match is not None  # of any text
    unit = match["unit"] or ""
    if unit and not unit[:1].isdigit():
        unit = f"1 {unit}"
    allowed = "must be the name or number of a column, and its unit: 'CH1 [25 N]'"
    require(bool(match["name"]), f"column {role}", text, allowed)
    return match["name"], unit


def _gauge(role: str, scene: Scene) -> Gauge:
    """Return the gauge of a column; SceneError if the scene cannot have it."""
    kind, _, number = role.partition("_")
    if kind == "wall":
        allowed = "is no gauge of a scene without [wall]"
        require(scene.wall is not None, "wall", None, allowed)
        return Gauge(contact=scene.last_contact)
    gauge = Gauge(granule=int(number)) if kind == "gauge" else Gauge(contact=int(number))
    gauge.check(scene.chain.granules, scene.wall is not None)
    return gauge


def _of_table(
    table: Any, time_name: str, time_unit: str, name: str, unit: str
) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and forces [N] of a pandas table."""
    known = [str(one) for one in table.columns]
    values = []
    for wanted, scale, default in ((time_name, time_unit, "s"), (name, unit, "N")):
        allowed = f"is no column of the table, which has {', '.join(known)}"
        require(wanted in known, "column", wanted, allowed)
        try:
            column = np.asarray(table[table.columns[known.index(wanted)]], np.float64)
        except (TypeError, ValueError):
            raise SceneError("column", wanted, "must have numbers") from None
        values.append(column * (to_si(f"column {wanted}", scale, default) if scale else 1.0))
    time, force = values
    increases = time.size > LEAST and bool(np.all(np.diff(time) > 0))
    require(increases, "time", None, f"must increase, with more than {LEAST} samples")
    require(bool(np.all(np.isfinite(force))), "force", None, "must be finite in each row")
    return time, force
