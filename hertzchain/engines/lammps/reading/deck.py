"""The contents of a deck as LAMMPS has them, in SI units: commands, granules, forces, peaks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
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


IntArray = NDArray[np.signedinteger[Any]]

Length = Annotated[float, "length"]
Lengths = Annotated[FloatArray, "length"]
Masses = Annotated[FloatArray, "mass"]
Time = Annotated[float, "time"]
Times = Annotated[FloatArray, "time"]
Velocities = Annotated[FloatArray, "velocity"]
Spins = Annotated[FloatArray, "spin"]
Force = Annotated[float, "force"]
Forces = Annotated[FloatArray, "force"]
Drags = Annotated[FloatArray, "drag"]
"""Numbers, with the name of their unit in ``Units``."""

_Part = TypeVar("_Part", "FoundDeck", "FoundFix", "FoundRun", "FoundWall")


@dataclass(frozen=True)
class Executed:
    """One command of a deck, as often as it was carried out."""

    text: str  # on one line, with the values of variables
    file: str  # file of the command, as the user or an ``include`` names it
    line: int  # line of that file, from 1
    written: str  # the command as it stands there
    carried_out: bool = True
    why_not: str | None = None  # why the command, or the file that it would write, was left out


@dataclass(frozen=True)
class FoundRun:
    """One ``run`` of a deck."""

    start: Time  # counted from the start of the first run
    dt: Time
    steps: int  # number of steps taken
    command: int  # index of its command


@dataclass(frozen=True, eq=False)
class FoundFix:
    """One ``fix`` of a deck that acts on granules.

    The largest forces that it exerted on each granule, along and off the axis [N], shape (granules,
    2), are known twice: over the whole deck with all granules at rest, and at the readings of the
    deck's own run. If only one of the two is 0, the force depends on places or velocities. Both are
    0 for fixes that move granules.
    """

    style: str
    command: int  # index of its command
    moves: bool  # nve, move; others exert forces, or change the motion without (momentum)
    granules: NDArray[np.bool_]  # granules of its group, when last read, shape (granules,)
    largest: Forces
    largest_in_motion: Forces


@dataclass(frozen=True, eq=False)
class FoundWall:
    """A wall across the chain, as a granule at the end feels it."""

    end: str  # end of the chain: ``first`` (that of granule 1) or ``last``
    position: Length  # of its surface along the chain, the centre of granule 1 at 0
    overlap: Lengths  # of the granule at that end, shape (tries,), and the forces there
    force: Forces
    closing: Velocities  # of the approaching granule, with overlaps and forces then
    damped_overlap: Lengths
    damped_force: Forces
    tangential_force: Force  # on the granule if it has spin and sideways velocity
    command: int  # index of the command that made it


@dataclass(frozen=True, eq=False)
class FoundDeck:
    """What LAMMPS found in a deck, in SI units unless ``units`` is lj.

    Granules stand in their order along the chain, granule 1 where the shock acts, and the chain
    extends to larger coordinates. Contacts lie between granules; only peaks include that of a wall.
    NaN stands for values that were not measured.
    """

    version: str  # of LAMMPS, year month day
    # Commands in the order in which they were carried out or left out, to the end of the deck.
    commands: tuple[Executed, ...]
    first_run: int  # index of the first run that counts: numbers are those at its start
    before: Time  # duration of earlier runs; 0 if the chain does not settle first
    units: str
    # Why the deck did not reach its end; empty if it did. Otherwise peaks and the final state are
    # NaN, and the runs are those that the deck should have had.
    stopped: str
    is_chain: bool  # whether granules lie in one row; if not, nothing else was queried
    axis: str  # axis of the chain: ``x``, ``y`` or ``z``
    direction: FloatArray  # the same as a unit vector from granule 1 on, shape (3,)
    reversed: bool  # whether granule 1 lies at the largest coordinate
    ids: IntArray  # of LAMMPS, shape (granules,)
    types: IntArray
    origin: Lengths  # place of granule 1 in the deck, along x, y and z
    position: Lengths  # along the chain, granule 1 at 0, shape (granules,)
    sideways: Lengths  # off the axis, which runs through the middle of all, shape (granules, 2)
    radius: Lengths  # shape (granules,)
    mass: Masses
    velocity: Velocities  # along the chain and in the two other directions, shape (granules, 3)
    spin: Spins
    overlap: Lengths  # of each contact, probed alone, and its forces, shape (tries, contacts)
    contact_force: Forces
    # Speeds at which overlaps grow, with the overlaps and forces then, shape (tries, contacts).
    closing: Velocities
    damped_overlap: Lengths
    damped_force: Forces
    # Force off the axis, or torque over radius if that is larger, in contacts at the largest
    # overlap with spins and sideways velocities, shape (granules,).
    tangential_force: Forces
    # Constant force of all fixes except walls, with all granules at rest, shape (granules, 3).
    constant_force: Forces
    drag: Drags  # force against the motion over velocity, shape (granules,)
    walls: tuple[FoundWall, ...]  # across the chain
    # Number of fixes that move each granule in the first run, shape (granules,); 0 also for a
    # granule that rests because ``setforce`` removes all its forces.
    integrated: IntArray
    # Gap between the last granule and the next image of the first; None without such an image.
    image_gap: Annotated[float | None, "length"]
    # Largest force at an end of the chain during the run that is not from a neighbour: across a
    # periodic boundary, or from the next granule but one.
    image_force: Force
    fixes: tuple[FoundFix, ...]  # fixes that act on granules, in the order of their commands
    runs: tuple[FoundRun, ...]  # runs of at least one step
    # Times of readings from the start of the first run; twice where the force jumps between two.
    applied_time: Times
    # Force along the chain at these times, less ``constant_force``, with all granules at rest,
    # shape (readings, granules). It is linear between readings.
    applied_force: Forces
    applied_sideways: Force  # largest change of an applied force off the axis
    # Highest force of each contact of the deck as it is, shape (contacts,), with one more for a
    # wall at the last granule.
    peak_force: Forces
    # Relative error of the peaks by the interval of readings, estimated from every second reading.
    peak_reading_error: float
    # Largest overlap of each contact that grew without a force, because neighbour lists are built
    # too rarely, of the shape of the peaks; 0 where there was none.
    missed_overlap: Lengths
    # Whether a fix prescribes the motion of each granule, as of a piston, shape (granules,).
    driven: NDArray[np.bool_]
    # Prescribed displacement of granule 1 and its times, shape (readings,); empty without one.
    driven_time: Times
    driven_displacement: Lengths
    end_time: Time  # end of the last run
    final_velocity: Velocities  # at the end, along the chain, shape (granules,)
    remarks: tuple[str, ...]  # sentences on parts that were not queried or examined


def scaled(numbers: _Part, units: Units) -> _Part:
    """Return a found object with every number multiplied by its unit."""
    changed: dict[str, Any] = {}
    for name, kind in get_type_hints(type(numbers), include_extras=True).items():
        value = getattr(numbers, name)
        if name in ("walls", "fixes", "runs"):
            changed[name] = tuple(scaled(part, units) for part in value)
        elif hasattr(kind, "__metadata__") and value is not None:
            changed[name] = value * getattr(units, kind.__metadata__[0])
    return replace(numbers, **changed)
