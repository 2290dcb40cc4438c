"""What LAMMPS made of somebody's deck: its commands, its granules, its forces, its peaks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.units import Units

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
"""Numbers, with the unit of a deck that they are in (``Units``)."""

_Found = TypeVar("_Found", "FoundDeck", "FoundFix", "FoundRun", "FoundWall")


@dataclass(frozen=True)
class Executed:
    """One command of a deck, as often as it was carried out.

    Parameters
    ----------
    text
        The command, on one line, after LAMMPS has put in the values of variables.
    file, line
        Where it stands: the file as the user or an ``include`` names it, and the line from 1.
    written
        The command as it stands in the file.
    carried_out
        Whether LAMMPS was given it.
    why_not
        Why it, or the file that it would write, was left out; None where nothing was.
    """

    text: str
    file: str
    line: int
    written: str
    carried_out: bool = True
    why_not: str | None = None


@dataclass(frozen=True)
class FoundRun:
    """One ``run`` of a deck.

    Parameters
    ----------
    start, dt
        When it starts, from the start of the first run, and its time step [s].
    steps
        How many were taken.
    command
        Index of its command.
    """

    start: Time
    dt: Time
    steps: int
    command: int


@dataclass(frozen=True, eq=False)
class FoundFix:
    """One ``fix`` of a deck that acts on granules.

    Parameters
    ----------
    style, command
        Its style, and the index of its command.
    moves
        Whether it moves granules (``nve``, ``move``); the others exert forces, or change the motion
        without (``momentum``, ``temp/rescale``).
    granules
        Which granules it was given, shape (granules,), when it was last seen.
    largest
        Largest force that it exerted on each granule, along and off the axis, over the whole deck
        with granules that stay where they are [N], shape (granules, 2); 0 for what moves them.
    largest_in_motion
        The same at the readings while the deck ran as it is: where it is 0 in one of them alone,
        the force depends on places or velocities.
    """

    style: str
    command: int
    moves: bool
    granules: NDArray[np.bool_]
    largest: Forces
    largest_in_motion: Forces


@dataclass(frozen=True, eq=False)
class FoundWall:
    """A wall across the chain, as a granule at the end feels it.

    Parameters
    ----------
    end
        Which end it stands at: ``first`` (that of granule 1) or ``last``.
    position
        Place of its surface along the chain, the centre of granule 1 at 0 [m].
    overlap, force
        Overlaps of the granule at that end and the forces there [m, N], shape (tries,).
    closing, damped_overlap, damped_force
        Speeds at which the granule approaches, overlaps and forces then [m/s, m, N].
    tangential_force
        Of the wall on the granule with spin and sideways velocity [N].
    command
        Index of the command that made it.
    """

    end: str
    position: Length
    overlap: Lengths
    force: Forces
    closing: Velocities
    damped_overlap: Lengths
    damped_force: Forces
    tangential_force: Force
    command: int


@dataclass(frozen=True, eq=False)
class FoundDeck:
    """What LAMMPS made of a deck, in SI units unless ``units`` is lj.

    Granules stand in their order along the chain, granule 1 where the shock acts, and the chain
    extends to larger coordinates. Contacts lie between granules; a wall's is none of them, but for
    peaks. NaN stands for what was not tried.

    Parameters
    ----------
    version
        Of LAMMPS, year month day.
    is_chain
        Whether the granules lie in one row; where they do not, nothing else was asked.
    commands
        In the order in which they were carried out or left out, up to the end of the deck.
    first_run
        Index of the first ``run`` that takes a step: granules are as they were then.
    units
        The deck's.
    stopped
        Why the deck did not come to its end; empty where it did. Peaks and what is read at the end
        are then not numbers, and the runs are those that it should have had.
    axis
        Along which granules lie: ``x``, ``y`` or ``z``, or ``a diagonal``.
    direction
        The same as a unit vector from granule 1 on, shape (3,).
    reversed
        Whether granule 1 lies at the largest coordinate.
    ids, types
        LAMMPS's, shape (granules,).
    origin
        Where granule 1 is in the deck, along x, y and z [m], shape (3,).
    position
        Along the chain, granule 1 at 0 [m], shape (granules,).
    sideways
        Off the axis, which runs through the middle of all granules [m], shape (granules, 2).
    radius, mass
        [m], [kg], shape (granules,).
    velocity, spin
        Along the chain and in the two other directions [m/s], [1/s], shape (granules, 3).
    overlap, contact_force
        Overlaps of each contact, alone, and the forces there [m, N], shape (tries, contacts).
    closing, damped_overlap, damped_force
        Speeds at which overlaps grow, the overlaps and the forces then [m/s, m, N], shape (tries,
        contacts).
    tangential_force
        In contacts at the largest overlap with spins and sideways velocities: off the axis, or
        torque over radius if that is larger [N], shape (granules,).
    constant_force
        What fixes but walls exert all the time, all granules at rest [N], shape (granules, 3).
    drag
        Force against the motion over velocity [N s/m], shape (granules,).
    walls
        Across the chain.
    integrated
        How many fixes move each granule in the first run, shape (granules,); 0 also for one that
        rests as ``setforce`` takes all forces from it.
    boundary
        The deck's, as ``f f f``.
    image_gap
        Between the last granule and the next image of the first [m]; None without such an image.
    image_force
        Largest force [N] that is none of a contact between neighbours, seen at an end of the chain
        while it ran: across a periodic boundary, or from the next granule but one.
    fixes
        That act on granules, in the order in which they were made.
    runs
        With at least one step, in their order.
    applied_time
        Times of readings from the start of the first run [s], shape (readings,). A time stands
        twice where the force jumps between two runs.
    applied_force
        Along the chain then, without ``constant_force``, all granules at rest [N], shape (readings,
        granules). Between readings it is that of the line between them.
    applied_sideways
        Largest change of such a force off the axis [N].
    peak_force, peak_time
        Highest force of each contact of the deck as it is, and when [N, s], shape (contacts,), with
        one more for a wall at the last granule.
    peak_reading_error
        Relative error of the peaks that readings are some steps apart, from every second reading.
    read_every
        Steps between these readings, the largest number.
    missed_overlap
        Largest overlap of each contact that grew without a force, as neighbours are looked for too
        rarely [m], of the shape of the peaks; 0 where there was none.
    driven
        Whether a fix leads each granule whatever the forces, as a piston, shape (granules,).
    driven_time, driven_displacement
        How far granule 1 was led, and when [s, m], shape (readings,); empty where it is not.
    end_time
        When the last run ends [s].
    final_position, final_velocity
        At the end, as ``position`` and ``velocity`` along the chain [m, m/s], shape (granules,).
    remarks
        What could not be asked or was not looked at, in sentences.
    """

    version: str
    commands: tuple[Executed, ...]
    first_run: int
    units: str
    stopped: str
    is_chain: bool
    axis: str
    direction: FloatArray
    reversed: bool
    ids: IntArray
    types: IntArray
    origin: Lengths
    position: Lengths
    sideways: Lengths
    radius: Lengths
    mass: Masses
    velocity: Velocities
    spin: Spins
    overlap: Lengths
    contact_force: Forces
    closing: Velocities
    damped_overlap: Lengths
    damped_force: Forces
    tangential_force: Forces
    constant_force: Forces
    drag: Drags
    walls: tuple[FoundWall, ...]
    integrated: IntArray
    boundary: str
    image_gap: Annotated[float | None, "length"]
    image_force: Force
    fixes: tuple[FoundFix, ...]
    runs: tuple[FoundRun, ...]
    applied_time: Times
    applied_force: Forces
    applied_sideways: Force
    peak_force: Forces
    peak_time: Times
    peak_reading_error: float
    read_every: int
    missed_overlap: Lengths
    driven: NDArray[np.bool_]
    driven_time: Times
    driven_displacement: Lengths
    end_time: Time
    final_position: Lengths
    final_velocity: Velocities
    remarks: tuple[str, ...]


def scaled(found: _Found, units: Units) -> _Found:
    """What was found, of which every number is multiplied by its unit."""
    changed: dict[str, Any] = {}
    for name, kind in get_type_hints(type(found), include_extras=True).items():
        value = getattr(found, name)
        if name in ("walls", "fixes", "runs"):
            changed[name] = tuple(scaled(part, units) for part in value)
        elif hasattr(kind, "__metadata__") and value is not None:
            changed[name] = value * getattr(units, kind.__metadata__[0])
    return replace(found, **changed)
