"""Units of LAMMPS decks in SI; those of lj decks are 1."""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.errors import RunFailed


@dataclass(frozen=True)
class Units:
    """A deck's units of length, mass and time [m, kg, s], whose force is mass x acceleration."""

    name: str
    length: float
    mass: float
    time: float

    @property
    def velocity(self) -> float:
        """Unit of velocity [m/s]."""
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        """Unit of acceleration [m/s^2]."""
        return self.velocity / self.time

    @property
    def spin(self) -> float:
        """Unit of angular velocity [1/s]."""
        return 1 / self.time

    @property
    def force(self) -> float:
        """Unit of force [N]."""
        return self.mass * self.acceleration

    @property
    def drag(self) -> float:
        """Unit of force over velocity [N s/m]."""
        return self.mass / self.time

    @property
    def pressure(self) -> float:
        """Unit of Young's modulus [Pa]."""
        return self.force / self.length**2

    @property
    def density(self) -> float:
        """Unit of density [kg/m^3]."""
        return self.mass / self.length**3


UNITS = {
    "si": Units("si", 1.0, 1.0, 1.0),
    "cgs": Units("cgs", 1e-2, 1e-3, 1.0),
    "micro": Units("micro", 1e-6, 1e-15, 1e-6),
    "nano": Units("nano", 1e-9, 1e-21, 1e-9),
}
"""LAMMPS's styles of units with a scale; ``lj`` can have any scale, styles for atoms have further
factors."""


def units_of(name: str) -> Units:
    """The units of a deck by LAMMPS's name, 1 for lj; RunFailed for those of atoms."""
    if name == "lj":
        return Units(name, 1.0, 1.0, 1.0)
    if name not in UNITS:
        raise RunFailed(
            f"units {name} are those of atoms: give the granules in si, cgs, micro, nano or lj"
        )
    return UNITS[name]
