"""The piston: granule 1 moves as prescribed, independent of the force on it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

from hertzchain.errors import is_finite, require, require_one
from hertzchain.scene.chain import short_repr
from hertzchain.scene.keys import Positive, check, key
from hertzchain.scene.shock import Shock, Stroke
from hertzchain.scene.tables import Rows, check_table


@dataclass(frozen=True, repr=False)
class Piston(Shock):
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

    profiles = ("piston",)
    noun = "piston"
    column = ("displacement", "displacement_m")
    is_driven = True

    velocity: float | None = field(
        default=None,
        metadata=key("m/s", "velocity of the piston", above=0, usual=(1e-5, 1e3)),
    )
    time: Rows | None = None
    displacement: Rows | None = None
    file: str | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return short_repr(self)

    def __post_init__(self) -> None:
        table = self.displacement if self.time is None else self.time
        require_one(velocity=self.velocity, file=table)
        if self.velocity is not None:
            check(self)
            return
        check_table(self)
        displacement = self.displacement or ()
        allowed = "must be 0: displacements count from where the piston rests"
        require(displacement[0] == 0, "displacement_m in row 1", displacement[0], allowed)
        allowed = "must not be 0 in all rows: the piston never moves"
        require(any(displacement), "displacement_m", None, allowed)
        for row, stroke in enumerate(self.strokes[:-1], start=1):
            allowed = "is reached in a time too short to be represented as a velocity"
            key = f"displacement_m in row {row + 1}"
            require(is_finite(stroke.velocity), key, None, allowed)

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

    def distance(self, time: float) -> float:
        """Return the distance moved up to a time, forwards and backwards added [m]."""
        strokes = self.strokes
        ends = [*(min(stroke.start, time) for stroke in strokes[1:]), time]
        return sum(
            abs(stroke.velocity) * max(end - stroke.start, 0.0)
            for stroke, end in zip(strokes, ends, strict=True)
        )

    @property
    def impact_velocity(self) -> float:
        """The largest speed [m/s]."""
        return max(abs(stroke.velocity) for stroke in self.strokes)

    @property
    def start_velocity(self) -> float:
        """Velocity at the start [m/s]."""
        return self.strokes[0].velocity

    def stretched(self, time: Positive, length: Positive, modulus: Positive) -> Piston:
        """The piston of a similar scene; see ``Shock``."""
        if self.velocity is not None:
            return replace(self, velocity=length / time * self.velocity)
        return replace(
            self,
            time=tuple(time * row for row, _ in self.rows),
            displacement=tuple(length * place for _, place in self.rows),
        )

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the piston, with the number of granules."""
        how = f"table of {len(self.rows)} rows, up to {self.impact_velocity:.6g} m/s,"
        if self.velocity is not None:
            how = f"at {self.velocity:.6g} m/s"
        return f"piston {how} on {granules - 1} granules"
