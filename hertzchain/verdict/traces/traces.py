"""Recordings of gauges in an experiment: forces over time on one clock, from files and tables."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, require
from hertzchain.pulses.recording import (
    Columns,
    columns_of,
    noise_within,
    read_columns,
    read_recording,
    resolution_of,
)
from hertzchain.scene.keys import to_si
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Gauge

_SENSOR = re.compile(r"(gauge|contact)_(\d+)|(?:near_)?wall")
_COLUMN = re.compile(rf"({_SENSOR.pattern})(?:[ _/([]*[a-zA-Z]+[)\]]*)?")
_TIME = re.compile(r"(?:time|t)(?:[ _(/\[]+(?:s|ms|us|µs|ns)[)\]]*)?", re.IGNORECASE)
_SPEC = re.compile(r"\s*(?P<name>.*?)\s*(?:\[(?P<unit>[^\[\]]+)\])?\s*")

_FLAT_SAMPLES = 4
"""Least samples with the largest value of a clipped trace (chosen)."""

_CREST_FALL_DIGITS = 16.0
"""Largest fall of a crest next to as many flat samples, in digits: a parabola falls by 9."""

_CLOCK_STEPS = 0.01
"""Largest difference of times of files of one record, over a sample: digits of files (chosen)."""

_LEAST_COMMON_SHARE = 0.9
"""Least share of a file's samples whose times all files of its record have (chosen): gaps are few,
and a file of half the rate has half of the times."""

ENOUGH_QUIET_SAMPLES = 200
"""Quiet samples that give the noise to 5 %; with fewer, second differences of all are better."""


@dataclass(frozen=True, eq=False)
class Traces:
    """Forces over time of several gauges on one clock.

    Parameters
    ----------
    time
        Increasing times [s], shape (samples,); their zero is not known.
    gauges
        The gauges that were measured.
    force
        Without static forces [N], shape (samples, gauges).
    noise
        Standard deviation of the noise of each gauge [N], shape (gauges,).
    clock
        A sentence on the clock of several files; empty for one.
    """

    time: FloatArray
    gauges: tuple[Gauge, ...]
    force: FloatArray
    noise: FloatArray
    clock: str = ""

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on the clock of several files, and on gauges that were clipped."""
        counts = [_clipped(force) for force in self.force.T]
        return (*filter(None, [self.clock]), *(
            f"{gauge.place}: {count} samples have the largest value, as those of a clipped"
            " recording: measure it again in a wider range of the instrument"
            for gauge, count in zip(self.gauges, counts, strict=True)
            if count
        ))  # fmt: skip


def _clipped(force: FloatArray) -> int:
    """Return how many samples have the largest value of a clipped trace; 0 for others.

    A crest is flat, too, by the digits of a recording, but falls by a few of these next to it.
    """
    largest = force.max()
    at = np.flatnonzero(force == largest)
    digit = np.min(np.diff(np.unique(force[force > largest / 2])), initial=largest)
    fall = largest - force[max(at[0] - at.size, 0)]
    return at.size if at.size >= _FLAT_SAMPLES and fall > _CREST_FALL_DIGITS * digit else 0


def is_traces(names: Sequence[str], columns: Mapping[str, str]) -> bool:
    """Return whether columns of these names, or with these roles, are traces of some gauges."""
    return any(map(_SENSOR.fullmatch, columns)) or any(map(_COLUMN.fullmatch, names))


def names_in(results: Any) -> Sequence[str]:
    """Return the names of the columns of a file or table; none where it is neither."""
    try:
        return _columns_of(results).names
    except (HertzchainError, TypeError):
        return ()


def _columns_of(results: Any) -> Columns:
    return columns_of(results) if hasattr(results, "columns") else read_columns(Path(results))


def read_records(
    scene: Scene, files: Sequence[Any], columns: Mapping[str, str], own_clocks: bool = False
) -> list[Traces]:
    """Return the traces of files or pandas tables, one for each clock.

    Files of different gauges are channels of one record and share its clock, unless ``own_clocks``;
    files with a gauge in common are several records. Columns and errors are those of
    ``read_traces``; in a shared record, each gauge's column is in one of the files.
    """
    read = [_columns_of(file) for file in files]
    parts = [_columns_in(each, columns) for each in read]
    for role in columns.keys() - {role for part in parts for role in part}:
        read[0].find("--column", _spec(role, columns[role])[0])  # raises: no file has it
    roles = [role for each in zip(read, parts, strict=True) for role, _ in _named(*each)]
    gauges = [gauge_of(role, scene) for role in roles]
    is_one = len(read) > 1 and not own_clocks and len({*gauges}) == len(gauges)
    if not is_one:
        records = [read_traces(scene, each, columns) for each in read]
        said = "each file has a clock of its own" if len(read) > 1 else ""
        return [replace(records[0], clock=said), *records[1:]]
    channels = [read_traces(scene, *each) for each in zip(read, parts, strict=True)]
    time = channels[0].time
    off = _CLOCK_STEPS * float(np.median(np.diff(time)))
    for each, other in zip(read[1:], channels[1:], strict=True):
        time = time[np.abs(time - other.time[_nearest(other.time, time)]) <= off]
        if time.size < _LEAST_COMMON_SHARE * max(other.time.size, channels[0].time.size):
            raise HertzchainError(
                f"{each.path}: has other times than {read[0].path}, and files of one record have"
                " the same: judge each record by itself, or fit them with --own-clocks"
            )
    forces = [channel.force[_nearest(channel.time, time)] for channel in channels]
    said = "the files are of one record, on one clock"
    if left := max(channel.time.size for channel in channels) - time.size:
        said += f"; {left:,} samples that not all of them have are left out"
    noise = np.concatenate([channel.noise for channel in channels])
    return [Traces(time, tuple(gauges), np.concatenate(forces, axis=1), noise, said)]


def _nearest(times: FloatArray, wanted: FloatArray) -> NDArray[np.intp]:
    """Return the places of the increasing times that are nearest to others."""
    after = np.clip(np.searchsorted(times, wanted), 1, times.size - 1)
    return np.where(wanted - times[after - 1] < times[after] - wanted, after - 1, after)


def _columns_in(read: Columns, columns: Mapping[str, str]) -> dict[str, str]:
    """Return those of some columns, by their roles, that a file has."""
    some = {}
    for role, text in columns.items():
        with suppress(HertzchainError):
            read.find("--column", _spec(role, text)[0])
            some[role] = text
    return some


def _named(read: Columns, columns: Mapping[str, str]) -> list[tuple[str, tuple[str, str]]]:
    """Return the columns of gauges: role, name and unit of each."""
    sensors = [(role, _spec(role, text)) for role, text in columns.items() if role != "time"]
    matches = filter(None, map(_COLUMN.fullmatch, read.names))
    return sensors or [(match[1], (match[0], "")) for match in matches]


def read_traces(scene: Scene, results: Any, columns: Mapping[str, str]) -> Traces:
    """Return the traces of a file or a pandas table.

    Parameters
    ----------
    scene
        The scene, which limits the possible gauges.
    results
        A text file in any layout, as oscilloscopes write it, or a table; with a column of times.
    columns
        Columns by ``time``, ``gauge_16``, ``contact_10``, ``wall``: names or numbers from 1, with
        the size of their unit, ``"CH1 [25 N]"``. Without them columns of these names are taken.

    Raises
    ------
    SceneError
        For gauges that the scene cannot have, and samples without information.
    HertzchainError
        For a file that cannot be read, or columns that it does not have.
    """
    read = results if isinstance(results, Columns) else _columns_of(results)
    of_times = [(name, "") for name in read.names if _TIME.fullmatch(name)]
    time, unit = next(iter(of_times), (None, ""))
    if "time" in columns:
        time, unit = _spec("time", columns["time"])
    named = _named(read, columns)
    allowed = (
        f"has the columns {', '.join(read.names[:8])}: name those of gauges, as by --column"
        " 'gauge_16=CH1 [25 N]'"
    )
    require(bool(named), "traces", None, allowed)
    gauges = tuple(gauge_of(role, scene) for role, _ in named)
    require(len(set(gauges)) == len(gauges), "traces", None, "have a gauge twice")
    read = read.without_gaps([read.find("--column", name) for _, (name, _) in named])
    forces, noise = [], []
    for role, (name, newtons) in named:
        scale = to_si(f"column {role}", newtons, "N") if newtons else None
        try:
            recording = read_recording(read, time, name, unit.removeprefix("1 ") or None, scale)
        except HertzchainError as problem:  # options of the command pulse
            said = str(problem).replace("--time and --force", "--column")
            said = said.replace("--force", "--column").replace("--time", "--column")
            said = said.replace("--scale", "--column 'gauge_16=NAME [25 N]'")
            raise HertzchainError(said) from None
        require(bool(np.any(recording.force)), role, None, "is 0 throughout: nothing was measured")
        forces.append(recording.force)
        # Second differences have part of a pulse's curvature.
        step = float(np.median(np.diff(recording.time)))
        noise.append(noise_within(recording.force, step, resolution_of(recording.force)).deviation)
    return Traces(recording.time, gauges, np.stack(forces, axis=1), np.array(noise))


def _spec(role: str, text: str) -> tuple[str, str]:
    """Return the name of a column and its unit as a quantity; empty if not given."""
    match = _SPEC.fullmatch(str(text))
    assert match is not None  # of any text
    unit = match["unit"] or ""
    if unit and not unit[:1].isdigit() and unit[:1] not in "+-.":
        unit = f"1 {unit}"
    allowed = "must be the name or number of a column, and its unit: 'CH1 [25 N]'"
    require(bool(match["name"]), f"column {role}", text, allowed)
    return match["name"], unit


def column_of(gauge: Gauge, scene: Scene) -> str:
    """Return the name of a gauge's column without its unit, such as ``gauge_16``."""
    return gauge.name(scene.last_contact if scene.wall else None).removesuffix("_N")


def gauge_of(role: str, scene: Scene) -> Gauge:
    """Return the gauge of a column; SceneError if the scene cannot have it."""
    allowed = "must be gauge_ and the number of a granule, contact_ and its number, wall, near_wall"
    require(_SENSOR.fullmatch(role) is not None, "column", role, allowed)
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
