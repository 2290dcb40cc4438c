"""The piston: granule 1 moves as prescribed, independent of the force on it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

from hertzchain.errors import POSITIVE, SceneError, is_finite, is_positive, require
from hertzchain.scene.chain import short_repr, to_plain_numbers
from hertzchain.scene.pulse import check_times, read_table


@dataclass(frozen=True)
class Stroke:
    """A stroke: the piston moves at one velocity until its next stroke begins.

    Parameters
    ----------
    start
        Time at which the stroke begins [s].
    displacement
        Displacement of the piston at that time [m].
    velocity
        Velocity from then on [m/s].
    """

    start: float
    displacement: float
    velocity: float

    def displacement_at(self, time: float) -> float:
        """Displacement at a time of the stroke [m]."""
        return self.displacement + self.velocity * (time - self.start)


@dataclass(frozen=True, repr=False)
class Piston:
    """A piston: granule 1 moves at a constant velocity or along a measured displacement.

    Its mass has no effect; it collides like a granule of infinite mass.

    Parameters
    ----------
    velocity
        Constant velocity from the start to the end of the run [m/s]; None with a table.
    time
        At least two increasing times [s], the first at least 0; None with a velocity.
    displacement
        As many displacements [m], the first 0, not all 0. Linear between rows; the piston rests
        before the first row and after the last.
    file
        Name of its CSV file, relative to the scene file, if any; ignored when two pistons are
        compared.

    Raises
    ------
    SceneError
        For a value outside what is stated above; the row of a table is named.
    """

    velocity: float | None = None
    time: tuple[float, ...] | None = None
    displacement: tuple[float, ...] | None = None
    file: str | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return short_repr(self)

    def __post_init__(self) -> None:
        has_table = self.time is not None or self.displacement is not None
        if (self.velocity is None) != has_table:
            raise SceneError(
                "velocity and file" if has_table else "velocity or file",
                None,
                "both are given, exactly one is allowed"
                if has_table
                else "missing, a piston needs exactly one of the two",
            )
        if self.velocity is not None:
            require(is_positive(self.velocity), "velocity", self.velocity, f"{POSITIVE} [m/s]")
            to_plain_numbers(self)
            return
        time, displacement = self.time or (), self.displacement or ()
        check_times(time, displacement, "displacement_m")
        for row, place in enumerate(displacement, start=1):
            key = f"displacement_m in row {row}"
            require(is_finite(place), key, place, "must be a finite number [m]")
        allowed = "must be 0: displacements count from where the piston rests"
        require(displacement[0] == 0, "displacement_m in row 1", displacement[0], allowed)
        allowed = "must not be 0 in all rows: the piston never moves"
        require(any(displacement), "displacement_m", None, allowed)
        for name, values in (("time", time), ("displacement", displacement)):
            object.__setattr__(self, name, tuple(float(value) for value in values))
        for row, stroke in enumerate(self.strokes[:-1], start=1):
            allowed = "is reached in a time too short to be represented as a velocity"
            key = f"displacement_m in row {row + 1}"
            require(is_finite(stroke.velocity), key, None, allowed)

    @property
    def rows(self) -> tuple[tuple[float, float], ...]:
        """Time [s] and displacement [m] of each row of the table."""
        columns = cast("tuple[float, ...]", self.time), cast("tuple[float, ...]", self.displacement)
        return tuple(zip(*columns, strict=True))

    @property
    def strokes(self) -> tuple[Stroke, ...]:
        """Strokes of the motion; the first starts at time 0, the last has no end."""
        if self.velocity is not None:
            return (Stroke(0.0, 0.0, self.velocity),)
        rows = self.rows
        resting = [] if rows[0][0] == 0 else [Stroke(0.0, 0.0, 0.0)]
        moving = [Stroke(t0, x0, (x1 - x0) / (t1 - t0))
                  for (t0, x0), (t1, x1) in itertools.pairwise(rows)]  # fmt: skip
        return (*resting, *moving, Stroke(*rows[-1], 0.0))

    @property
    def fastest(self) -> float:
        """The largest speed [m/s]."""
        return max(abs(stroke.velocity) for stroke in self.strokes)

    def distance(self, time: float) -> float:
        """Return the distance moved up to a time, forwards and backwards added [m]."""
        strokes = self.strokes
        ends = [*(min(stroke.start, time) for stroke in strokes[1:]), time]
        return sum(
            abs(stroke.velocity) * max(end - stroke.start, 0.0)
            for stroke, end in zip(strokes, ends, strict=True)
        )

    @property
    def end(self) -> float:
        """Time of the last change of the velocity [s]; 0 where it is constant."""
        return self.strokes[-1].start


def read_piston_table(path: Path, name: str | None = None) -> Piston:
    """Read a table: CSV, header ``time_s,displacement_m``. A SceneError says what is wrong."""
    time, displacement = read_table(path, name, "displacement_m")
    try:
        return Piston(None, time, displacement, name or str(path))
    except SceneError as problem:
        raise SceneError(problem.key, problem.value, problem.allowed, file=path) from None
