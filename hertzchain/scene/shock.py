"""What all shocks have in common: a force on a granule, or granule 1 as striker or piston.

A shock is a frozen dataclass, derived from ``Shock``, and an entry in ``parts.SHOCKS``. No other
code depends on the kind of shock, except for what holds for one kind alone (see ``Scene.pulse``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.keys import Positive, key
from hertzchain.scene.ramp import Ramp

GRANULE = key("", "granule that is pushed", least=1, kind="int")
"""Key of the granule on which a force acts."""


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
    section: ClassVar[str] = "shock"
    """Section in a scene file."""
    column: ClassVar[tuple[str, str] | None] = None
    """Field of a table's values, and their column in a CSV file; None for a shock without one."""
    is_driven: ClassVar[bool] = False
    """Whether granule 1 moves as prescribed, so that no force changes its motion."""
    least_ratio: ClassVar[float] = 0.0
    """Least LM_ratio that the default end of a run counts with."""

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
        return self.profiles[0]

    @property
    def rows(self) -> tuple[tuple[float, float], ...]:
        """Time [s] and value of each row of the table; none where there is no table."""
        own: Any = self
        if self.column is None or own.time is None:
            return ()
        return tuple(zip(own.time, getattr(self, self.column[0]), strict=True))

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

    def ramps(self) -> tuple[Ramp, ...]:
        """The force as ramps."""
        return ()

    def force_at(self, time: FloatArray, ramps: Sequence[Ramp]) -> FloatArray:
        """The force at any times, also outside of its ramps [N], of the shape of ``time``."""
        force = np.zeros_like(time, np.float64)
        for ramp in ramps:
            inside = (time >= ramp.start) & (time < ramp.end)
            force = np.where(inside, ramp.force(time), force)
        return force

    def by_formula(self, time: FloatArray) -> FloatArray:
        """The force at any times from 0 on [N], by a formula that is independent of the ramps."""
        return np.zeros_like(time, np.float64)

    @property
    def compared_impulse(self) -> float | None:
        """The impulse in its LM_ratio [N s]; None for the whole impulse."""
        return None

    def check_load(self, load: float) -> None:  # noqa: B027 - for most shocks any load will do
        """Raise a SceneError if a static load [N] on granule 1 is too small."""

    @abstractmethod
    def stretched(self, time: Positive, length: Positive, modulus: Positive) -> Self:
        """The shock of a similar scene with the same forces.

        Arguments are the ratios of its times, lengths and Young's moduli to the true ones.
        """

    def stronger(self, factor: Positive) -> Self:
        """The shock with another force; called only in scenes without loads."""
        own: Any = self
        stronger: Self = replace(own, peak_force=factor * own.peak_force)
        return stronger

    @abstractmethod
    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the shock of a scene, with the number of granules."""
