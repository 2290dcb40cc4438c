"""The sine: an actuator adds an oscillating force to the static load."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import require
from hertzchain.scene.keys import Positive, check, key
from hertzchain.scene.ramp import Ramp
from hertzchain.scene.shock import GRANULE, Shock

_MOST_CYCLES = 50_000
"""Most cycles (chosen): as many corners as a pulse table can have rows, about 200,000."""

_QUARTERS = (
    ("quarter-sine", 0.0, 1.0),
    ("quarter-cosine", 1.0, 0.0),
    ("quarter-sine", 0.0, -1.0),
    ("quarter-cosine", -1.0, 0.0),
)
"""Shape, and the force at both ends over the amplitude, of each quarter of a cycle."""


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

    Raises
    ------
    SceneError
        For a value outside what is stated above.
    """

    profiles = ("sine",)
    noun = "sine"
    # The load is at least the amplitude, so for any number of cycles it sets the speed of waves.
    least_ratio = 1.0

    amplitude: float = field(
        metadata=key("N", "amplitude of the force", above=0, usual=(1e-6, 1e7))
    )
    frequency: float = field(metadata=key("Hz", "frequency", above=0, usual=(0.1, 1e8)))
    cycles: int = field(metadata=key("", "cycles", least=1, most=_MOST_CYCLES, kind="int"))
    granule: int = field(default=1, metadata=GRANULE)

    def __post_init__(self) -> None:
        check(self)

    @property
    def peak_force(self) -> float:
        """The largest force [N], without the static load."""
        return self.amplitude

    def ramps(self) -> tuple[Ramp, ...]:
        """Four quarters for each cycle."""
        ramps = []
        for quarter in range(4 * self.cycles):
            shape, start, end = _QUARTERS[quarter % 4]
            begin, stop = (number / (4 * self.frequency) for number in (quarter, quarter + 1))
            forces = start * self.amplitude, end * self.amplitude
            ramps.append(Ramp(begin, stop, *forces, shape))
        return tuple(ramps)

    def by_formula(self, time: FloatArray) -> FloatArray:
        """The force at any times from 0 on [N]."""
        force = self.amplitude * np.sin(2 * math.pi * self.frequency * time)
        return np.where(time < self.cycles / self.frequency, force, 0.0)

    @property
    def compared_impulse(self) -> float:
        """Integral of the force over the first half of a cycle [N s]; 0 over a whole cycle."""
        return self.amplitude / (math.pi * self.frequency)

    def check_load(self, load: float) -> None:
        """Refuse an amplitude above the static load [N]."""
        allowed = (
            f"must be at most the static load, [precompression] force = {load:g} N: an actuator"
            " pushes its granule, and cannot pull it"
        )
        require(self.amplitude <= load, "shock.amplitude", self.amplitude, allowed)

    def stretched(self, time: Positive, length: Positive, modulus: Positive) -> Sine:
        """The sine of a similar scene; see ``Shock``."""
        return replace(self, frequency=self.frequency / time)

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the sine, with the number of granules."""
        return (
            f"sine of {self.amplitude:.6g} N, {self.cycles} cycles at {self.frequency:.6g} Hz,"
            f" on {granules} granules"
        )
