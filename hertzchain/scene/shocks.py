"""Drives of a chain: pulses, tables, sines, pistons, strikers; the ramps of its force."""

from __future__ import annotations

import itertools
import math
import re
from abc import ABC
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal, Self, cast

import numpy as np

from hertzchain.arrays import Quantity
from hertzchain.errors import SceneError, is_finite, require, require_one
from hertzchain.scene.chain import MATERIAL, Chain, short_repr
from hertzchain.scene.keys import Key, Positive, alike, check, key, keys_of, optional


@dataclass(frozen=True)
class Shape:
    """Shape of a ramp: how the force grows from 0 to 1 while s, the fraction of the ramp, does."""

    growth: Callable[[Any], Any]  # at s, a number or an array
    rate: Callable[[Any], Any]  # derivative of the growth at s
    area: float  # integral from 0 to 1
    formula: str  # the growth in Python's words, {} for s, which is a quotient without brackets
    code: int | None = None  # of the formula in compiled loops, 1 linear, 2 cosine; None: has none
    part: tuple[float, float] = (0.0, 1.0)  # where the shape lies on the ramp of that formula

    @property
    def is_curved(self) -> bool:
        """Whether the impulse needs several steps, however short the ramp."""
        return self.formula != "{}"

    def for_numpy(self, s: str) -> str:
        """Return the growth as an expression of NumPy, imported as np."""
        return re.sub(r"\b([a-z]+)\b", r"np.\1", self.formula).format(s)

    def for_lammps(self, s: str) -> str:
        """Return the growth as a formula of LAMMPS or LIGGGHTS."""
        compact = self.formula.replace(" ", "").replace("**", "^").replace("pi", "PI")
        return compact.format(s)


SHAPES = {
    "linear": Shape(lambda s: s, np.ones_like, 0.5, "{}", 1),
    # (1 - cos) / 2 would lose all digits just after the start.
    "cosine": Shape(
        lambda s: np.sin(np.pi / 2 * s) ** 2,
        lambda s: np.pi / 2 * np.sin(np.pi * s),
        0.5,
        "sin(pi / 2 * {}) ** 2",
        2,
    ),
    "quarter-sine": Shape(
        lambda s: np.sin(np.pi / 2 * s),
        lambda s: np.pi / 2 * np.cos(np.pi / 2 * s),
        2 / math.pi,
        "sin(pi / 2 * {})",
        2,
        (0.5, 1.0),
    ),
    "quarter-cosine": Shape(
        lambda s: 2 * np.sin(np.pi / 4 * s) ** 2,
        lambda s: np.pi / 2 * np.sin(np.pi / 2 * s),
        1 - 2 / math.pi,
        "2 * sin(pi / 4 * {}) ** 2",
        2,
        (0.0, 0.5),
    ),
}
"""Shapes by name. ``cosine`` is half a period of 1 - cos; the two quarters are those of a sine,
from 0 to its crest and from the crest to 0.
"""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
"""Gauss's quadrature; 12 nodes integrate half a period of a cosine to round-off."""


@dataclass(frozen=True)
class Ramp:
    """A ramp: the force goes from one value to another between two corners.

    Parameters
    ----------
    start, end
        Times of the corners [s], ``start < end``.
    start_force, end_force
        Force at each corner, on the side of this ramp [N].
    shape
        A name of ``SHAPES``; a SceneError for any other.
    """

    start: float
    end: float
    start_force: float
    end_force: float
    shape: str

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise SceneError("shape", self.shape, f"must be one of {', '.join(SHAPES)}")

    def force(self, time: Quantity) -> Any:
        """The force at a time, or an array of times, between the corners [N] (Eq. 2)."""
        s = (time - self.start) / (self.end - self.start)
        growth = SHAPES[self.shape].growth(s)
        return self.start_force + (self.end_force - self.start_force) * growth

    def force_rate(self, time: Quantity) -> Any:
        """Time derivative of the force at a time, or an array of times [N/s]."""
        duration = self.end - self.start
        s = (time - self.start) / duration
        return (self.end_force - self.start_force) / duration * SHAPES[self.shape].rate(s)

    @property
    def impulse(self) -> float:
        """Integral of the force over the whole ramp [N s]."""
        area = SHAPES[self.shape].area
        mean = (1 - area) * self.start_force + area * self.end_force
        return mean * (self.end - self.start)

    def impulse_until(self, time: float) -> float:
        """Integral of the force from the start of the ramp to a time inside it [N s]."""
        duration = self.end - self.start
        s = (time - self.start) / duration
        growth = SHAPES[self.shape].growth(s / 2 * (1 + _NODES))
        grown = s / 2 * float(np.dot(_WEIGHTS, growth))
        return duration * (self.start_force * s + (self.end_force - self.start_force) * grown)


@dataclass(frozen=True)
class Stroke:
    """A stroke: the piston moves at one velocity until its next stroke begins."""

    start: float  # [s]
    displacement: float  # at that time [m]
    velocity: float  # from then on [m/s]

    def displacement_at(self, time: float) -> float:
        """Displacement at a time of the stroke [m]."""
        return self.displacement + self.velocity * (time - self.start)


FORCE = key("N", "F0", above=0, usual=(1e-6, 1e7))
GRANULE = key("", "granule that is pushed", least=1, kind="int")
SPEED = Key("m/s", above=0, usual=(1e-5, 1e3))
"""Keys that several shocks have: largest force, granule on which it acts, velocity."""


def _counted(granules: int) -> str:
    return "1 granule" if granules == 1 else f"{granules} granules"


_OF_FORCE = "LM_ratio = {ratio:.6g}, {shock.peak_force:.6g} N on {granules}"
"""Words of a shock for LM_ratio, largest force and number of granules."""


@dataclass(frozen=True)
class Shock(ABC):
    """A shock: an applied force, or a motion of granule 1.

    A force has its largest value as ``peak_force`` [N]. The defaults here are those of a force
    without a table, with granule 1 at rest at the start; a shock overrides what differs.
    """

    profiles: ClassVar[tuple[str, ...]]
    """Names in ``profile`` of a scene file; the first is the class's own."""
    noun: ClassVar[str]
    """Words for the shock in a sentence."""
    words: ClassVar[str]
    """Words of ``in_words``: a format of shock, ratio (LM_ratio), granules, others and rows."""
    section: ClassVar[str] = "shock"
    """Section in a scene file."""
    column: ClassVar[tuple[str, str] | None] = None
    """Field of a table's values, and their column in a CSV file; None for a shock without one."""
    is_driven: ClassVar[bool] = False
    """Whether granule 1 moves as prescribed, so that no force changes its motion."""
    least_ratio: ClassVar[float] = 0.0
    """Least LM_ratio that the default end of a run counts with."""

    def __post_init__(self) -> None:
        check(self)

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def loaded_granule(self) -> int:
        """Index of the granule that a static load pushes: 0, or 1 behind a striker that is free."""
        return 0

    @property
    def granule(self) -> int:
        """Number of the granule on which the force acts, from 1."""
        return 1

    @property
    def profile_name(self) -> str:
        """The name in ``profile`` of a scene file."""
        return str(getattr(self, "profile", self.profiles[0]))

    @property
    def rows(self) -> tuple[tuple[float, float], ...]:
        """Time [s] and value of each row of the table; empty without a table."""
        shock: Any = self
        if self.column is None or shock.time is None:
            return ()
        return tuple(zip(shock.time, getattr(self, self.column[0]), strict=True))

    @property
    def impact_velocity(self) -> float | None:
        """Largest velocity with which granule 1 hits granule 2 [m/s]; None for a force."""
        return None

    @property
    def start_velocity(self) -> float:
        """Velocity of granule 1 at the start [m/s]."""
        return 0.0

    @property
    def strokes(self) -> tuple[Stroke, ...]:
        """Strokes of a driven granule 1; the first starts at time 0, the last has no end."""
        return ()

    @property
    def material(self) -> Mapping[str, float]:
        """Properties of granule 1 that differ from the chain's, by their names in ``Chain``."""
        return {}

    @property
    def compared_impulse(self) -> float | None:
        """The impulse in its LM_ratio [N s]; None for the whole impulse."""
        return None

    def ramps(self) -> tuple[Ramp, ...]:
        """The force as ramps."""
        return ()

    def stretched(
        self,
        time: Positive = 1.0,
        length: Positive = 1.0,
        modulus: Positive = 1.0,
        force: Positive = 1.0,
    ) -> Self:
        """The shock of a similar scene; a radius stays.

        Arguments are the ratios of its times, lengths, Young's moduli and forces to the true ones.
        """
        factors = {"s": time, "Hz": 1 / time, "m/s": length / time, "Pa": modulus, "N": force}
        values = {
            name: (getattr(self, name), key.unit) for name, key in keys_of(type(self)).items()
        }
        changed: dict[str, Any] = {
            name: factors[unit] * value
            for name, (value, unit) in values.items()
            if unit in factors and value is not None
        }
        if self.column is not None and (rows := self.rows):
            factor = length if self.is_driven else force
            changed["time"] = tuple(time * start for start, _ in rows)
            changed[self.column[0]] = tuple(factor * value for _, value in rows)
        return replace(self, **changed)

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the shock of a scene, with the number of granules."""
        others = f" on {_counted(granules - 1)}" if granules > 1 else ""
        return self.words.format(
            shock=self, ratio=momentum_ratio, granules=_counted(granules), others=others,
            rows=len(self.rows),
        )  # fmt: skip


def _check_table(shock: Any, least: float | None = None) -> None:
    """Check the table of a shock, and make its numbers Python's own.

    A SceneError names the row of a time that is not above the one before it, or of a value that is
    not finite or below ``least``.
    """
    field, column = shock.column
    times, values = (
        numbers if isinstance(numbers, Sequence) or getattr(numbers, "shape", None) else ()
        for numbers in (shock.time, getattr(shock, field))
    )
    rows = len(times)
    require(rows >= 2, "rows", rows, f"must be at least 2 rows of time_s and {column}")
    allowed = f"must be {rows}, as those of time_s"
    require(rows == len(values), f"rows of {column}", len(values), allowed)
    possible = Key(column.rpartition("_")[2], least=least)
    for row, (time, value) in enumerate(zip(times, values, strict=True), start=1):
        bound = f"above {times[row - 2]}" if row > 1 else "of at least 0"
        is_later = is_finite(time) and (time > times[row - 2] if row > 1 else time >= 0)
        require(is_later, f"time_s in row {row}", time, f"must be a finite number {bound} [s]")
        possible.check(f"{column} in row {row}", value)
    for name, column_values in (("time", times), (field, values)):
        object.__setattr__(shock, name, tuple(map(float, column_values)))


Rows = Annotated[tuple[float, ...], _check_table]
"""A column of the table of a shock, which ``_check_table`` checks row by row."""


@dataclass(frozen=True)
class Moving(Shock):
    """No force, striker or piston: granules of the chain itself move at the start."""

    profiles = ("moving granules",)
    noun = "moving granules"
    words = "{granules}"
    section = ""


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
    """

    profiles = ("piston",)
    noun = "piston"
    words = "piston {shock.motion}{others}"
    column = ("displacement", "displacement_m")
    is_driven = True

    velocity: float | None = field(
        default=None, metadata={"key": replace(SPEED, label="velocity of the piston")}
    )
    time: Rows | None = None
    displacement: Rows | None = None
    file: str | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        table = self.displacement if self.time is None else self.time
        require_one(velocity=self.velocity, file=table)
        if self.velocity is not None:
            check(self)
            return
        _check_table(self)
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
    def motion(self) -> str:
        """Words for the motion."""
        if self.velocity is not None:
            return f"at {self.velocity:.6g} m/s"
        return f"table of {len(self.rows)} rows, up to {self.impact_velocity:.6g} m/s,"

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
    is_profile = isinstance(name, str) and name in PROFILES
    require(is_profile, "profile", name, f"must be one of {', '.join(PROFILES)}")
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
    """

    profiles = tuple(PROFILES)
    noun = "pulse"
    words = "{shock.profile} pulse, n = {shock.duration_ratio:g}, " + _OF_FORCE

    profile: Profile = field(metadata=key("", "profile", kind="str", choices=tuple(PROFILES)))
    peak_force: float = field(metadata=FORCE)
    duration_ratio: float = field(metadata=key("", "n", above=1))
    momentum_ratio: float | None = optional("", "LM_ratio", above=0)
    rise_time: float | None = optional("s", "rise time t0", above=0)
    granule: int = field(default=1, metadata=GRANULE)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_one(momentum_ratio=self.momentum_ratio, rise_time=self.rise_time)

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
    """

    profiles = ("table",)
    noun = "pulse table"
    words = "pulse table of {rows} rows, " + _OF_FORCE
    column = ("force", "force_N")

    time: Rows
    force: Rows
    file: str | None = field(default=None, compare=False)
    granule: int = field(default=1, metadata=GRANULE)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_table(self, least=0)
        require(any(self.force), "force_N", None, "must be positive in at least one row")

    @property
    def peak_force(self) -> float:
        """The largest force of the table [N]."""
        return max(self.force)

    def ramps(self) -> tuple[Ramp, ...]:
        """The lines between the rows."""
        return tuple(
            Ramp(t0, t1, f0, f1, "linear") for (t0, f0), (t1, f1) in itertools.pairwise(self.rows)
        )


_QUARTERS = (
    ("quarter-sine", 0.0, 1.0),
    ("quarter-cosine", 1.0, 0.0),
    ("quarter-sine", 0.0, -1.0),
    ("quarter-cosine", -1.0, 0.0),
)
"""Shape, and the force at both ends over the amplitude, of each quarter of a cycle."""


def _sine(corners: Sequence[float], amplitude: float) -> tuple[Ramp, ...]:
    """Return the quarters of a sine between their corners [s]."""
    quarters = zip(itertools.pairwise(corners), itertools.cycle(_QUARTERS), strict=False)
    return tuple(
        Ramp(*times, first * amplitude, last * amplitude, shape)
        for times, (shape, first, last) in quarters
    )


@dataclass(frozen=True)
class Sine(Shock):
    """The force amplitude * sin(2 pi frequency t) on a granule, for some cycles, in SI units.

    It comes on top of the static load, which must be at least the amplitude: an actuator pushes
    its granule, and cannot pull it.

    Parameters
    ----------
    amplitude
        Amplitude of the force [N].
    frequency
        Cycles per second [Hz].
    cycles
        Number of cycles, a whole number from 1 to 50,000.
    granule
        Number of the granule on which it acts, from 1.
    """

    profiles = ("sine",)
    noun = "sine"
    words = (
        "sine of {shock.amplitude:.6g} N, {shock.cycles} cycles at {shock.frequency:.6g} Hz,"
        " on {granules}"
    )
    # The load is at least the amplitude, so for any number of cycles it sets the speed of waves.
    least_ratio = 1.0

    amplitude: float = field(
        metadata=key("N", "amplitude of the force", above=0, usual=(1e-6, 1e7))
    )
    frequency: float = field(metadata=key("Hz", "frequency", above=0, usual=(0.1, 1e8)))
    # Most cycles (chosen): as many corners as a pulse table can have rows, about 200,000
    cycles: int = field(metadata=key("", "cycles", least=1, most=50_000, kind="int"))
    granule: int = field(default=1, metadata=GRANULE)

    @property
    def peak_force(self) -> float:
        """The largest force [N], without the static load."""
        return self.amplitude

    def ramps(self) -> tuple[Ramp, ...]:
        """Four quarters for each cycle."""
        corners = [quarter / (4 * self.frequency) for quarter in range(4 * self.cycles + 1)]
        return _sine(corners, self.amplitude)

    @property
    def compared_impulse(self) -> float:
        """Integral of the force over the first half of a cycle [N s]; 0 over a whole cycle."""
        return self.amplitude / (math.pi * self.frequency)


@dataclass(frozen=True)
class LabPulse(Shock, ABC):
    """A pulse of shock tests, by its largest force and its whole duration, in SI units.

    The shapes are those of IEC 60068-2-27 and MIL-STD-810, method 516.

    Parameters
    ----------
    peak_force
        Largest force [N].
    duration
        Time from the start of the force to its end [s].
    granule
        Number of the granule on which it acts, from 1.
    """

    words = "{shock.noun} of {shock.duration:.6g} s, " + _OF_FORCE

    peak_force: float = field(metadata=FORCE)
    duration: float = field(metadata=key("s", "duration of the pulse", above=0))
    granule: int = field(default=1, kw_only=True, metadata=GRANULE)


@dataclass(frozen=True)
class HalfSine(LabPulse):
    """A half sine: the force peak_force * sin(pi t / duration); see ``LabPulse``."""

    profiles = ("half-sine",)
    noun = "half sine"

    def ramps(self) -> tuple[Ramp, ...]:
        """Rise to the crest, and decay."""
        return _sine([0.0, self.duration / 2, self.duration], self.peak_force)


@dataclass(frozen=True)
class Sawtooth(LabPulse):
    """A saw tooth with terminal peak: rises in a line, ends at its peak; see ``LabPulse``."""

    profiles = ("sawtooth",)
    noun = "saw tooth"

    def ramps(self) -> tuple[Ramp, ...]:
        """The rise, which ends in a jump to 0."""
        return (Ramp(0.0, self.duration, 0.0, self.peak_force, "linear"),)


_SLACK = 1e-12
"""Rounding of sums of times over the duration of a pulse (chosen): 0.3 + 0.7 ms may exceed 1 ms."""


@dataclass(frozen=True)
class Trapezoid(LabPulse):
    """A trapezoid: a linear rise, a constant force and a linear decay; see ``LabPulse``.

    Parameters
    ----------
    rise_time, fall_time
        Durations of rise and decay, at most ``duration`` together [s].
    """

    profiles = ("trapezoid",)
    noun = "trapezoid"

    rise_time: float = field(metadata=key("s", "rise time t0", above=0))
    fall_time: float = field(metadata=key("s", "decay time", above=0))

    def __post_init__(self) -> None:
        super().__post_init__()
        least = _SLACK * self.duration
        for name, slope in ("rise_time", self.rise_time), ("fall_time", self.fall_time):
            require(slope > least, name, slope, f"must be above {least:g} s, the rounding of times")
        allowed = f"must be below duration = {self.duration:g} s"
        require(self.rise_time < self.duration, "rise_time", self.rise_time, allowed)
        allowed = f"must be at most duration - rise_time = {self.duration - self.rise_time:g} s"
        sloping = self.rise_time + self.fall_time
        require(sloping <= self.duration * (1 + _SLACK), "fall_time", self.fall_time, allowed)

    def ramps(self) -> tuple[Ramp, ...]:
        """Return rise, constant force (unless it has no duration) and decay."""
        begin, end, force = self.rise_time, self.duration - self.fall_time, self.peak_force
        if end - begin <= _SLACK * self.duration:
            end = begin
        hold = (Ramp(begin, end, force, force, "linear"),) if end > begin else ()
        rise = Ramp(0.0, begin, 0.0, force, "linear")
        return (rise, *hold, Ramp(end, self.duration, force, 0.0, "linear"))


@dataclass(frozen=True)
class Striker(Shock):
    """A striker: granule 1 flies into the others; no force but gravity pushes it.

    Where the chain is pressed from the start, the striker only touches granule 2, which the load
    then pushes.

    Parameters
    ----------
    velocity
        Velocity of granule 1 at the start [m/s], above 0.
    radius, young_modulus, poisson_ratio, density
        Properties of granule 1 that differ from the chain's, as in ``Chain``; None for equal ones.
    loaded
        True for a striker that the load pushes like any first granule: its contact then has the
        static force from the start, and the striker also has its velocity.
    """

    profiles = ("striker",)
    noun = "striker"
    words = "striker at {shock.velocity:.6g} m/s{others}"
    section = "striker"

    velocity: float = field(metadata={"key": replace(SPEED, label="velocity of the striker")})
    radius: float | None = alike(Chain, "radius", "radius of the striker")
    young_modulus: float | None = alike(Chain, "young_modulus", "Young's modulus of the striker")
    poisson_ratio: float | None = alike(Chain, "poisson_ratio", "Poisson's ratio of the striker")
    density: float | None = alike(Chain, "density", "density of the striker")
    loaded: bool = field(default=False, metadata=key(kind="bool"))

    @property
    def impact_velocity(self) -> float:
        """The velocity [m/s]."""
        return self.velocity

    @property
    def start_velocity(self) -> float:
        """The velocity [m/s]."""
        return self.velocity

    @property
    def loaded_granule(self) -> int:
        """Index of the granule that a static load pushes."""
        return 0 if self.loaded else 1

    @property
    def material(self) -> Mapping[str, float]:
        """Properties that differ from the chain's, by name."""
        material = {key: getattr(self, key) for key in MATERIAL}
        return {key: value for key, value in material.items() if value is not None}
