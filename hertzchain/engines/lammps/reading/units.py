"""Units of LAMMPS decks in SI, and those of lj decks as they are."""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.errors import RunFailed


@dataclass(frozen=True)
class Units:
    """A deck's units of length, mass and time [m, kg, s]; 1 for lj, which has none."""

    name: str
    length: float
    mass: float
    time: float

    @property
    def velocity(self) -> float:
        """[m/s]."""
        return self.length / self.time

    @property
    def force(self) -> float:
        """[N]."""
        return self.mass * self.length / self.time**2

    @property
    def drag(self) -> float:
        """Force over velocity [N s/m]."""
        return self.mass / self.time


_KNOWN = {
    "si": (1.0, 1.0, 1.0),
    "cgs": (1e-2, 1e-3, 1.0),
    "micro": (1e-6, 1e-15, 1e-6),
    "nano": (1e-9, 1e-21, 1e-9),
    "lj": (1.0, 1.0, 1.0),
}


def units_of(name: str) -> Units:
    """The units of a deck by LAMMPS's name; RunFailed for those of atoms."""
    if name not in _KNOWN:
        raise RunFailed(
            f"units {name} are those of atoms: give the granules in si, cgs, micro, nano or lj"
        )
    return Units(name, *_KNOWN[name])
