"""The striker: granule 1 flies into the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from hertzchain.errors import POSITIVE, is_positive, require
from hertzchain.scene.chain import MATERIAL, check_material, to_plain_numbers
from hertzchain.scene.shock import Shock, key


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
        metadata=key("velocity of the striker [m/s]", "striker at {:.4g} m/s", "m/s", (1e-5, 1e3))
    )
    radius: float | None = field(
        default=None,
        metadata=key("radius of the striker [m]", "striker of R = {:.4g} m", "m", (1e-6, 0.5)),
    )
    young_modulus: float | None = field(
        default=None,
        metadata=key(
            "Young's modulus of the striker [Pa]", "striker of E = {:.4g} Pa", "Pa", (1e5, 2e12)
        ),
    )
    poisson_ratio: float | None = field(
        default=None,
        metadata=key("Poisson's ratio of the striker", "striker of Poisson's ratio {:.4g}"),
    )
    density: float | None = field(
        default=None,
        metadata=key(
            "density of the striker [kg/m³]", "striker of {:.4g} kg/m³", "kg/m^3", (10.0, 3e4)
        ),
    )

    def __post_init__(self) -> None:
        require(is_positive(self.velocity), "velocity", self.velocity, f"{POSITIVE} [m/s]")
        check_material(self, optional=True)
        to_plain_numbers(self)

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
