"""The shock: the force on a granule over time (Eq. 2), as ramps between corners.

Every pulse here is a sequence of ramps: the rise and the decay of the three profiles of Table 1,
or the lines between the rows of a table.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, cast

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import require, require_one
from hertzchain.scene.chain import short_repr
from hertzchain.scene.keys import Positive, check, key
from hertzchain.scene.ramp import Ramp
from hertzchain.scene.shock import GRANULE, Shock
from hertzchain.scene.tables import Rows, check_table

Profile = Literal["cosine", "triangular", "cosine-triangular"]
"""Names of the profiles of Table 1."""

PROFILES: dict[Profile, tuple[str, str]] = {
    "cosine": ("cosine", "cosine"),
    "triangular": ("linear", "linear"),
    "cosine-triangular": ("cosine", "linear"),
}
"""Shapes of the rise and the decay for each profile of Table 1."""


def profile_named(name: object) -> Profile:
    """Return the name of a profile of Table 1; a SceneError for any other."""
    known = isinstance(name, str) and name in PROFILES
    require(known, "profile", name, f"must be one of {', '.join(PROFILES)}")
    return cast(Profile, name)


@dataclass(frozen=True)
class Pulse(Shock):
    """One of the paper's three pulses (Table 1), in SI units.

    Parameters
    ----------
    profile
        ``cosine``, ``triangular`` or ``cosine-triangular``; a cosine is a raised one, 1 - cos.
    peak_force
        F0 [N].
    duration_ratio
        n > 1: the pulse lasts n rise times.
    momentum_ratio, rise_time
        LM_ratio = t0 / t0_hat (with the paper's 139/32), or t0 [s]: exactly one of the two.
    granule
        Number of the granule on which it acts, from 1.

    Raises
    ------
    SceneError
        For a value outside what is stated above.
    """

    profiles = tuple(PROFILES)
    noun = "pulse"

    profile: Profile = field(metadata=key("", "profile", kind="str", choices=tuple(PROFILES)))
    peak_force: float = field(metadata=key("N", "F0", above=0, usual=(1e-6, 1e7)))
    duration_ratio: float = field(metadata=key("", "n", above=1))
    momentum_ratio: float | None = field(default=None, metadata=key("", "LM_ratio", above=0))
    rise_time: float | None = field(default=None, metadata=key("s", "rise time t0", above=0))
    granule: int = field(default=1, metadata=GRANULE)

    def __post_init__(self) -> None:
        check(self)
        require_one(momentum_ratio=self.momentum_ratio, rise_time=self.rise_time)

    @property
    def profile_name(self) -> str:
        """The name in ``profile`` of a scene file."""
        return self.profile

    def ramps(self, rise_time: float | None = None) -> tuple[Ramp, Ramp]:
        """Rise and decay for a rise time t0 [s] (Eq. 2 with Table 1)."""
        rise_time = self.rise_time if rise_time is None else rise_time
        assert rise_time is not None
        rise, decay = PROFILES[self.profile]
        end = self.duration_ratio * rise_time
        return (
            Ramp(0.0, rise_time, 0.0, self.peak_force, rise),
            Ramp(rise_time, end, self.peak_force, 0.0, decay),
        )

    def stretched(self, time: Positive, length: Positive, modulus: Positive) -> Pulse:
        """The pulse of a similar scene; see ``Shock``."""
        return self if self.rise_time is None else replace(self, rise_time=time * self.rise_time)

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the pulse, with the number of granules."""
        force = of_force(self.peak_force, granules, momentum_ratio)
        return f"{self.profile} pulse, n = {self.duration_ratio:g}, {force}"


@dataclass(frozen=True, repr=False)
class PulseTable(Shock):
    """A measured pulse: force linear between rows, zero before the first and after the last.

    Parameters
    ----------
    time
        At least two increasing times [s], the first at least 0.
    force
        As many forces [N], finite, none negative, at least one positive.
    file
        The name of the CSV file it came from, relative to the scene file, if any; ignored when two
        tables are compared.
    granule
        Number of the granule on which it acts, from 1.

    Raises
    ------
    SceneError
        For a table outside what is stated above; the row is named.
    """

    profiles = ("table",)
    noun = "pulse table"
    column = ("force", "force_N")

    time: Rows
    force: Rows
    file: str | None = field(default=None, compare=False)
    granule: int = field(default=1, metadata=GRANULE)

    def __post_init__(self) -> None:
        check(self)
        check_table(self, least=0)
        require(any(self.force), "force_N", None, "must be positive in at least one row")

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def peak_force(self) -> float:
        """The largest force of the table [N]."""
        return max(self.force)

    def ramps(self) -> tuple[Ramp, ...]:
        """The lines between the rows."""
        return tuple(
            Ramp(t0, t1, f0, f1, "linear") for (t0, f0), (t1, f1) in itertools.pairwise(self.rows)
        )

    def force_at(self, time: FloatArray, ramps: Sequence[Ramp]) -> FloatArray:
        """The force at any times [N]; fast also for many rows."""
        return np.interp(time, self.time, self.force, left=0.0, right=0.0)

    def by_formula(self, time: FloatArray) -> FloatArray:
        """The force at any times [N]."""
        return self.force_at(time, ())

    def stretched(self, time: Positive, length: Positive, modulus: Positive) -> PulseTable:
        """The table of a similar scene; see ``Shock``."""
        return replace(self, time=tuple(time * row for row in self.time))

    def stronger(self, factor: Positive) -> PulseTable:
        """The table with another force, at the same times."""
        return replace(self, force=tuple(factor * value for value in self.force))

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the table, with the number of granules."""
        force = of_force(self.peak_force, granules, momentum_ratio)
        return f"pulse table of {len(self.time)} rows, {force}"


def of_force(peak_force: float, granules: int, momentum_ratio: float) -> str:
    """Return words for LM_ratio, largest force and number of granules."""
    return f"LM_ratio = {momentum_ratio:.6g}, {peak_force:.6g} N on {granules} granules"
