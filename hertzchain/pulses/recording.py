"""A recording: time and force of a measured pulse from its file, in SI units."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import HertzchainError, SceneError, is_finite, require
from hertzchain.pulses.layout import (
    UNITS_OF_FORCE,
    UNITS_OF_TIME,
    Layout,
    is_comment,
    layout_of,
    read_lines,
)
from hertzchain.scene.quantities import to_si

LEAST_SAMPLES = 8  # least number of samples of a recording; chosen
_MOST = 1e60  # largest s or N: its square, and sums of squares, can be represented
_SHOWN = 3  # most wrong lines that are named


@dataclass(frozen=True, eq=False)
class Recording:
    """A measured signal.

    Parameters
    ----------
    time
        Increasing times as in the file [s], shape (samples,).
    force
        Forces with the baseline [N], shape (samples,).
    newtons
        N for each unit of the column of forces.
    facts
        Layout and units of the file, as labels and texts.
    """

    time: FloatArray
    force: FloatArray
    newtons: float
    facts: tuple[tuple[str, str], ...]


def read_recording(
    path: Path,
    time: str | None = None,
    force: str | None = None,
    time_unit: str | None = None,
    force_unit: str | None = None,
    scale: float | None = None,
) -> Recording:
    """Read a text file with columns of time and force in any layout.

    Parameters
    ----------
    path
        The file.
    time, force
        Names or numbers, from 1, of the columns; by default the first two that hold numbers.
    time_unit, force_unit
        Units of the columns; by default those of the header, or s and N.
    scale
        Factor of the forces, such as N for each volt.

    Raises
    ------
    HertzchainError
        With all wrong lines of the file, or for an impossible column or unit.
    """
    lines = read_lines(path)
    layout = layout_of(path, lines)
    numeric = iter(layout.numeric)
    first = layout.find("--time", time) if time is not None else next(numeric, -1)
    second = (
        layout.find("--force", force)
        if force is not None
        else next((column for column in numeric if column != first), -1)
    )
    if -1 in (first, second) or first == second:
        raise HertzchainError(
            f"{path}: time and force must be two columns of numbers; name them with --time and"
            " --force"
        )
    seconds, unit_of_time = _unit("--time-unit", time_unit, layout.units[first], UNITS_OF_TIME, "s")
    newtons, unit_of_force = _unit_of_force(layout, second, force_unit, scale)
    begin, values = _read(path, lines, layout, (first, second))
    counts = any(name.lower().startswith("increment") for name in layout.names)
    if counts and bool(np.all(np.diff(values[:, 0]) == 1)):
        raise HertzchainError(
            f"{path}: column {layout.name(first)} counts samples: write their times in its place,"
            " from Start by Increment"
        )
    texts = sum(bool(line.strip()) for line in lines[:begin])
    facts = (
        ("file", f"{path}: {len(values):,} samples, {layout.describe()}"),
        *((("text before the numbers", f"{texts} line{'s' * (texts != 1)}"),) if texts else ()),
        ("time", f"column {layout.name(first)}, {unit_of_time}"),
        ("force", f"column {layout.name(second)}, {unit_of_force}"),
    )
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        clock, forces = values[:, 0] * seconds, values[:, 1] * newtons
        extents = {"times": np.ptp(clock), "forces": np.ptp(forces)}
    for name, extent in extents.items():
        possible = bool(extent == 0 or 1 / _MOST < extent < _MOST)
        allowed = f"span {extent:g}, must be from {1 / _MOST:g} to {_MOST:g}: check unit and scale"
        require(possible, name, None, allowed)
    return Recording(clock, forces, newtons, facts)


def _unit(
    option: str, given: str | None, of_header: str, known: dict[str, str], unit: str
) -> tuple[float, str]:
    """Return the value of a unit in SI units, and words for it."""
    if given is not None:
        worth = to_si(option, f"1 {given}", unit)
        require(is_finite(worth) and worth > 0, option, given, f"must be a unit such as {unit}")
        return worth, f"in {given}"
    if of_header in known.values():
        return to_si(option, f"1 {of_header}", unit), f"in {of_header} (header)"
    return 1.0, f"taken as {unit}"


def _unit_of_force(
    layout: Layout, column: int, given: str | None, scale: float | None
) -> tuple[float, str]:
    of_header = layout.units[column]
    if scale is None:
        if given is None and of_header and of_header not in UNITS_OF_FORCE.values():
            raise HertzchainError(
                f"column {layout.name(column)} is in {of_header}: say with --scale how many N one"
                f" {of_header} is"
            )
        return _unit("--force-unit", given, of_header, UNITS_OF_FORCE, "N")
    right = is_finite(scale) and scale != 0
    require(right, "--scale", scale, "must be a finite number other than 0")
    worth, _ = _unit("--force-unit", given, "", UNITS_OF_FORCE, "N")
    return worth * scale, f"times {scale:g} {given or 'N'}"


def _read(
    path: Path, lines: list[str], layout: Layout, columns: tuple[int, int]
) -> tuple[int, FloatArray]:
    """Return the index of the first line of numbers, and times and forces, shape (samples, 2)."""
    cells: list[tuple[int, list[str]]] = []
    begin = None
    for number, line in enumerate(lines):
        if is_comment(line):
            continue
        row = layout.split(line)
        if begin is None:
            if not all(column < len(row) and layout.is_number(row[column]) for column in columns):
                continue
            begin = number
        if not (line.lstrip().startswith(";") and not _holds(row, columns)):
            cells.append((number + 1, row))
    if begin is None or len(cells) < LEAST_SAMPLES:
        named = " and ".join(layout.name(column) for column in columns)
        raise HertzchainError(
            f"{path}: {len(cells)} lines have numbers in the columns {named}, must be at least"
            f" {LEAST_SAMPLES}; name the columns with --time and --force"
        )
    values = np.array(
        [
            [_number(row[k], layout) if k < len(row) else math.nan for k in columns]
            for _, row in cells
        ]
    )
    wrong = [f"line {cells[k][0]}" for k in np.flatnonzero(~np.isfinite(values).all(axis=1))]
    if wrong:
        more = f" and {len(wrong) - _SHOWN:,} more" if len(wrong) > _SHOWN else ""
        allowed = "has no finite time and force: correct it or delete it"
        raise SceneError("", None, f"{', '.join(wrong[:_SHOWN])}{more}: {allowed}", path)
    back = np.flatnonzero(np.diff(values[:, 0]) <= 0)
    if back.size:
        (before, _), (number, _) = cells[back[0]], cells[back[0] + 1]
        allowed = f"line {number}: the time is not above that of line {before}"
        advice = "export times with more digits, or name another column"
        raise SceneError("", None, f"{allowed}; {advice}", path)
    return begin, values


def _number(cell: str, layout: Layout) -> float:
    return layout.to_float(cell) if layout.is_number(cell) else math.nan


def _holds(row: list[str], columns: Iterable[int]) -> bool:
    return all(column < len(row) and row[column] for column in columns)
