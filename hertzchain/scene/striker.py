"""The striker: granule 1 flies into the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from hertzchain.scene.chain import DENSITY, MATERIAL, POISSON_RATIO, RADIUS, YOUNG_MODULUS
from hertzchain.scene.keys import Key, check, key
from hertzchain.scene.shock import Shock


def _own(of_granule: Key, label: str, title: str) -> Any:
    """A key of a granule for the striker; None by default."""
    return field(default=None, metadata={"key": replace(of_granule, label=label, title=title)})


@dataclass(frozen=True)
class Striker(Shock):
    """A striker: granule 1 flies into the others, which are at rest; no force pushes it.

    Parameters
    ----------
    velocity
        Velocity of granule 1 at the start [m/s], above 0.
    radius, young_modulus, poisson_ratio, density
        Properties of granule 1 that differ from the chain's, as in ``Chain``; None for equal ones.

    Raises
    ------
    SceneError
        For a value that is not possible.
    """

    profiles = ("striker",)
    noun = "striker"
    section = "striker"

    velocity: float = field(
        metadata=key("m/s", "velocity of the striker", "striker at {}", above=0, usual=(1e-5, 1e3))
    )
    radius: float | None = _own(RADIUS, "radius of the striker", "striker of R = {}")
    young_modulus: float | None = _own(
        YOUNG_MODULUS, "Young's modulus of the striker", "striker of E = {}"
    )
    poisson_ratio: float | None = _own(
        POISSON_RATIO, "Poisson's ratio of the striker", "striker of Poisson's ratio {}"
    )
    density: float | None = _own(DENSITY, "density of the striker", "striker of {}")

    def __post_init__(self) -> None:
        check(self)

    @property
    def impact_velocity(self) -> float:
        """The velocity [m/s]."""
        return self.velocity

    @property
    def start_velocity(self) -> float:
        """The velocity [m/s]."""
        return self.velocity

    @property
    def material(self) -> Mapping[str, float]:
        """Properties that differ from the chain's, by name."""
        own = {key: getattr(self, key) for key in MATERIAL}
        return {key: value for key, value in own.items() if value is not None}

    def stretched(self, time: float, length: float, modulus: float) -> Striker:
        """The striker of a similar scene; see ``Shock``."""
        own = None if self.young_modulus is None else modulus * self.young_modulus
        return replace(self, velocity=length / time * self.velocity, young_modulus=own)

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the striker, with the number of other granules."""
        return f"striker at {self.velocity:.6g} m/s on {granules - 1} granules"
