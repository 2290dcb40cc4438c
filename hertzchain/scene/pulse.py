"""The shock: the force on the first granule over time (Eq. 2), as ramps between corners.

Every pulse here is a sequence of ramps: the rise and the decay of the three profiles of Table 1,
or the lines between the rows of a table.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, cast

from hertzchain.errors import POSITIVE, SceneError, is_finite, is_positive, require
from hertzchain.files import read_rows
from hertzchain.scene.chain import short_repr, to_plain_numbers
from hertzchain.scene.ramp import Ramp

Profile = Literal["cosine", "triangular", "cosine-triangular"]
"""Names of the profiles of Table 1."""

PROFILES: dict[Profile, tuple[str, str]] = {
    "cosine": ("cosine", "cosine"),
    "triangular": ("linear", "linear"),
    "cosine-triangular": ("cosine", "linear"),
}
"""Shapes of the rise and the decay for each profile of Table 1."""

_IN_FILES = ", or table, sine or piston in a scene file"

_MOST_BYTES = 5_000_000
"""Largest size of a pulse table [bytes], chosen: about 200,000 rows, read in a second and run in a
minute.
"""


def profile_named(name: object, key: str = "profile") -> Profile:
    """Return the name of a profile of Table 1; a SceneError about the key for any other."""
    known = isinstance(name, str) and name in PROFILES
    require(known, key, name, f"must be one of {', '.join(PROFILES)}{_IN_FILES}")
    return cast(Profile, name)


@dataclass(frozen=True)
class Pulse:
    """One of the paper's three pulses (Table 1), in SI units.

    Parameters
    ----------
    profile
        ``cosine``, ``triangular`` or ``cosine-triangular``.
    peak_force
        F0 [N].
    duration_ratio
        n > 1: the pulse lasts n rise times.
    momentum_ratio, rise_time
        LM_ratio = t0 / t0_hat (with the paper's 139/32), or t0 [s]: exactly one of the two.

    Raises
    ------
    SceneError
        For a value outside what is stated above.
    """

    profile: Profile
    peak_force: float
    duration_ratio: float
    momentum_ratio: float | None = None
    rise_time: float | None = None

    def __post_init__(self) -> None:
        profile_named(self.profile)
        require(is_positive(self.peak_force), "peak_force", self.peak_force, f"{POSITIVE} [N]")
        require(
            is_finite(self.duration_ratio) and self.duration_ratio > 1,
            "duration_ratio",
            self.duration_ratio,
            "must be a finite number above 1",
        )
        if (self.momentum_ratio is None) == (self.rise_time is None):
            both = self.rise_time is not None
            raise SceneError(
                "momentum_ratio and rise_time" if both else "momentum_ratio or rise_time",
                None,
                "both are given, exactly one is allowed"
                if both
                else "missing, exactly one of the two must be given",
            )
        if self.momentum_ratio is not None:
            value = self.momentum_ratio
            require(is_positive(value), "momentum_ratio", value, POSITIVE)
        if self.rise_time is not None:
            require(is_positive(self.rise_time), "rise_time", self.rise_time, f"{POSITIVE} [s]")
        to_plain_numbers(self)

    def ramps(self, rise_time: float) -> tuple[Ramp, Ramp]:
        """Rise and decay for a rise time t0 [s] (Eq. 2 with Table 1)."""
        rise, decay = PROFILES[self.profile]
        end = self.duration_ratio * rise_time
        return (
            Ramp(0.0, rise_time, 0.0, self.peak_force, rise),
            Ramp(rise_time, end, self.peak_force, 0.0, decay),
        )


@dataclass(frozen=True, repr=False)
class PulseTable:
    """A measured pulse: force linear between rows, zero before the first and after the last.

    Parameters
    ----------
    time
        At least two increasing times [s], the first at least 0.
    force
        As many forces [N], finite, none negative, at least one positive.
    file
        The name of the CSV file it came from, relative to the scene file, if any; two tables are
        equal without regard to it.

    Raises
    ------
    SceneError
        For a table outside what is stated above; the row is named.
    """

    time: tuple[float, ...]
    force: tuple[float, ...]
    file: str | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        check_times(self.time, self.force, "force_N")
        for row, force in enumerate(self.force, start=1):
            require(
                is_finite(force) and force >= 0,
                f"force_N in row {row}",
                force,
                "must be a finite number of at least 0 [N]",
            )
        require(any(self.force), "force_N", None, "must be positive in at least one row")
        for name in ("time", "force"):
            object.__setattr__(self, name, tuple(float(value) for value in getattr(self, name)))

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def peak_force(self) -> float:
        """The largest force of the table [N]."""
        return max(self.force)

    def ramps(self) -> tuple[Ramp, ...]:
        """The lines between the rows."""
        rows = list(zip(self.time, self.force, strict=True))
        return tuple(
            Ramp(t0, t1, f0, f1, "linear") for (t0, f0), (t1, f1) in itertools.pairwise(rows)
        )


def check_times(times: Sequence[float], values: Sequence[float], column: str) -> None:
    """Raise a SceneError for times of a table that do not increase, or too few of them or values.

    ``column`` is the name of the values; they are not looked at themselves.
    """
    rows = len(times)
    require(rows >= 2, "rows", rows, f"must be at least 2 rows of time_s and {column}")
    allowed = f"must be {rows}, as those of time_s"
    require(rows == len(values), f"rows of {column}", len(values), allowed)
    earliest = None
    for row, time in enumerate(times, start=1):
        key = f"time_s in row {row}"
        require(is_finite(time), key, time, "must be a finite number [s]")
        require(
            time >= 0 if earliest is None else time > earliest,
            key,
            time,
            "must be at least 0" if earliest is None else f"must be above {earliest}",
        )
        earliest = time


def read_pulse_table(path: Path, name: str | None = None) -> PulseTable:
    """Read a pulse table: CSV, header ``time_s,force_N``. A SceneError says what is wrong."""
    time, force = read_table(path, name, "force_N")
    try:
        return PulseTable(time, force, name or str(path))
    except SceneError as problem:
        raise SceneError(problem.key, problem.value, problem.allowed, file=path) from None


def read_table(
    path: Path, name: str | None, column: str
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times and values of a CSV file with the header ``time_s`` and ``column``.

    A SceneError says what is wrong; ``name`` is that of the file in a scene file.
    """
    try:
        header, rows = read_rows(path, _MOST_BYTES)
    except ValueError as problem:
        allowed = f"cannot be read ({problem}); must be a CSV file"
        raise SceneError("shock.file", name, allowed, None if name else path) from None
    expected = f"time_s,{column}"
    if ",".join(header) != expected:
        raise SceneError("first line", ",".join(header), f"must be {expected}", file=path)
    columns: tuple[list[float], list[float]] = ([], [])
    for number, row in enumerate(rows, start=1):
        try:
            time, value = (float(cell) for cell in row)
        except ValueError:
            allowed = f"must be two numbers, {expected}"
            raise SceneError(f"row {number}", ",".join(row), allowed, file=path) from None
        columns[0].append(time)
        columns[1].append(value)
    return tuple(columns[0]), tuple(columns[1])
