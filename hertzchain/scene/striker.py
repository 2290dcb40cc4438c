"""The striker: granule 1 flies into the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from hertzchain.scene.chain import DENSITY, MATERIAL, POISSON_RATIO, RADIUS, YOUNG_MODULUS
from hertzchain.scene.keys import Positive, check, key, of_granule
from hertzchain.scene.shock import Shock


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

    Raises
    ------
    SceneError
        For a value that is not possible.
    """

    profiles = ("striker",)
    noun = "striker"
    section = "striker"

    velocity: float = field(
        metadata=key("m/s", "velocity of the striker", above=0, usual=(1e-5, 1e3))
    )
    radius: float | None = of_granule(RADIUS, "radius of the striker")
    young_modulus: float | None = of_granule(YOUNG_MODULUS, "Young's modulus of the striker")
    poisson_ratio: float | None = of_granule(POISSON_RATIO, "Poisson's ratio of the striker")
    density: float | None = of_granule(DENSITY, "density of the striker")
    loaded: bool = field(default=False, metadata=key(kind="bool"))

    def __post_init__(self) -> None:
        check(self)

    @property
    def impact_velocity(self) -> float:
        """The velocity [m/s]."""
        return self.velocity

    @property
    def loaded_granule(self) -> int:
        """Index of the granule that a static load pushes."""
        return 0 if self.loaded else 1

    @property
    def start_velocity(self) -> float:
        """The velocity [m/s]."""
        return self.velocity

    @property
    def material(self) -> Mapping[str, float]:
        """Properties that differ from the chain's, by name."""
        own = {key: getattr(self, key) for key in MATERIAL}
        return {key: value for key, value in own.items() if value is not None}

    def stretched(self, time: Positive, length: Positive, modulus: Positive) -> Striker:
        """The striker of a similar scene; see ``Shock``."""
        own = None if self.young_modulus is None else modulus * self.young_modulus
        return replace(self, velocity=length / time * self.velocity, young_modulus=own)

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the striker, with the number of other granules."""
        return f"striker at {self.velocity:.6g} m/s on {granules - 1} granules"
