"""Numbers of the generated deck, as LAMMPS has them, against the scene: only round-off may differ.

``NUMBERS`` is the table: one entry a number. LAMMPS is asked as for anybody's deck.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps import FoundDeck, Lammps
from hertzchain.engines.lammps.reading.prober import DAMPED, DEPTHS
from hertzchain.errors import RunFailed
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.scene.scene import Scene
from hertzchain.verdict.apart import applied_force, start_of
from hertzchain.verdict.check import Check, Kind, farthest, unmeasured, within

# relative tolerance of LAMMPS's numbers; measured 3e-15, R 1e-8 to 1e3 m, N to 1e4
EXAMINED = 1e-12

_ENGINE = "lammps"
_EPS = float(np.finfo(np.float64).eps)
_ROUNDED = 6 * _EPS  # of a coordinate: two of them and their difference, half as much again
_DEEP = (DEPTHS.index(1.0), DEPTHS.index(3.0))  # tries that tell the law
_NO_FORCE = 1e-6  # of Hertz's: a contact with less does not push (chosen)

_MEND = (
    "what LAMMPS made of the deck is not the scene: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it"
)

GRANULES = Kind("granules", _MEND)
DAMPING = Kind("damping", _MEND)
NOT_EXAMINED = Kind("not examined", _MEND)


@dataclass(frozen=True, eq=False)
class Case:
    """A scene, what LAMMPS has, and the scene's start, computed independently of its granules.

    A wall's contact is the last; ``overlap`` and ``force`` are of shape (tries, contacts).
    """

    scene: Scene
    found: FoundDeck
    position: FloatArray  # of each granule, and of a wall, if there is one [m]
    constant: FloatArray  # force on each granule [N]
    velocity: FloatArray
    length: float
    wall: float  # place of the wall as LAMMPS has it [m]
    overlap: FloatArray
    force: FloatArray
    closing: FloatArray
    damped_overlap: FloatArray
    damped_force: FloatArray

    @property
    def stiffness(self) -> FloatArray:
        """A of each contact, of a plain chain by its own formula, shape (contacts,)."""
        chain = self.scene.chain
        if not self.scene.is_plain:
            return self.scene.granules.stiffness
        return np.full(chain.granules - 1, chain.contact_stiffness)

    @property
    def reach(self) -> FloatArray:
        """What coordinates of a contact are as large as [m], shape (contacts,)."""
        radius = self.scene.granules.radius
        reach = radius[:-1] + radius[1:]
        return reach if self.scene.wall is None else np.append(reach, self.length)

    def room(self, overlap: FloatArray) -> FloatArray:
        """Relative tolerance of forces at overlaps that are differences of rounded coordinates."""
        return np.asarray(np.maximum(EXAMINED, _ROUNDED * self.reach / overlap))


Values = tuple[FloatArray, FloatArray, FloatArray | float]
"""What LAMMPS has, what the scene has, and the largest difference that is round-off."""


@dataclass(frozen=True)
class Number:
    """A number of a deck: its name with its unit, how both are found, why they may differ.

    ``each`` says what stands at an index: a granule, a contact or a time.
    """

    kind: Kind
    values: Callable[[Case], Values | None]
    reason: str
    each: Callable[[Case, int], str]


def examined(scene: Scene, lammps: Lammps) -> list[Check]:
    """Examine the deck of a scene in LAMMPS, each number by itself."""
    try:
        return number_checks(scene, lammps.examine(scene))
    except RunFailed as problem:
        return [unmeasured(NOT_EXAMINED, _ENGINE, str(problem))]


def number_checks(scene: Scene, found: FoundDeck) -> list[Check]:
    """Return a check of each number that applies to a scene."""
    size, wanted = float(found.mass.size), float(scene.chain.granules)
    reason = "one more or less is another chain"
    count = within(GRANULES, _ENGINE, size, wanted, 0.0, reason)
    if not count.passed:
        return [count]
    case = _case(scene, found)
    checks = [count]
    for number in NUMBERS:
        values = number.values(case)
        if values is None:
            continue
        measured, expected, room = values
        allowed = np.broadcast_to(room, expected.shape)
        # Some tolerances are 0: then any difference fails.
        off = (measured - expected) / np.maximum(allowed, np.finfo(np.float64).tiny)
        at = np.unravel_index(farthest(off.ravel(), 0.0), expected.shape)
        where = number.each(case, int(at[-1]))
        numbers = float(measured[at]), float(expected[at]), float(allowed[at])
        checks.append(within(number.kind, _ENGINE, *numbers, f"{number.reason}; {where}"))
    return checks


def _case(scene: Scene, found: FoundDeck) -> Case:
    position, constant, velocity = start_of(scene)
    tries = found.overlap, found.contact_force
    damped = found.closing, found.damped_overlap, found.damped_force
    place = math.nan
    if scene.wall is not None:
        wall = next((one for one in found.walls if one.end == "last"), None)
        if wall is None:
            own = [np.full(len(rows), np.nan) for rows in (*tries, *damped)]
        else:
            late = _late(wall.overlap, wall.force)
            place = float(found.origin @ found.direction) + wall.position - late
            own = [np.append(np.nan, wall.overlap + late), np.append(np.nan, wall.force),
                   wall.closing, wall.damped_overlap + late, wall.damped_force]  # fmt: skip
        columns = [
            np.column_stack([rows, one]) for rows, one in zip((*tries, *damped), own, strict=True)
        ]
        tries, damped = (columns[0], columns[1]), (columns[2], columns[3], columns[4])
    granules = scene.granules
    length = float(np.sum(2 * granules.radius) + np.sum(granules.gap))
    return Case(scene, found, position, constant, velocity, length, place, *tries, *damped)


# ---- Granules


def _position(case: Case) -> Values:
    count = case.scene.chain.granules
    measured = float(case.found.origin @ case.found.direction) + case.found.position
    return measured, case.position[:count], EXAMINED * case.length


def _across(case: Case) -> Values:
    size = np.max(np.abs(case.found.sideways), axis=1)
    return size, np.zeros_like(size), EXAMINED * case.length


def _radius(case: Case) -> Values:
    expected = case.scene.granules.radius
    return case.found.radius, expected, EXAMINED * expected


def _mass(case: Case) -> Values:
    measured, expected = case.found.mass, case.scene.granules.mass
    if case.scene.is_plain:
        expected = np.full(measured.size, case.scene.chain.granule_mass)
    if case.scene.piston is not None:  # its mass has no effect
        expected = np.append(measured[:1], expected[1:])
    return measured, expected, EXAMINED * expected


def _velocity(case: Case) -> Values:
    largest = np.max(np.abs(case.found.velocity[:, 1:]), axis=1)
    return case.found.velocity[:, 0] + largest, case.velocity, EXAMINED * case.scene.start_velocity


def _wall(case: Case) -> Values | None:
    if case.scene.wall is None:
        return None
    return np.array([case.wall]), case.position[-1:], EXAMINED * case.length


_LATE = 1e-8  # of an overlap: by how much rounding may hide where a force begins (chosen)


def _late(overlap: FloatArray, force: FloatArray) -> float:
    """How much earlier a wall begins than its force shows among others, by Hertz's law [m]."""
    deep = force[-2:] ** (2 / 3)
    with np.errstate(all="ignore"):
        late = float(deep[1] * (overlap[-1] - overlap[-2]) / (deep[1] - deep[0]) - overlap[-1])
    return late if abs(late) < _LATE * overlap[-1] else 0.0


# ---- Contacts


def _unit(case: Case, overlap: FloatArray) -> FloatArray:
    return np.asarray(case.stiffness * overlap**1.5)


def _stiffness(case: Case) -> Values:
    overlap, force = case.overlap[list(_DEEP)], case.force[list(_DEEP)]
    expected = np.broadcast_to(case.stiffness, force.shape)
    return force / overlap**1.5, expected, case.room(overlap) * expected


def _exponent(case: Case) -> Values:
    overlap, force = case.overlap[list(_DEEP)], case.force[list(_DEEP)]
    pushes = np.all(np.abs(force) > _NO_FORCE * _unit(case, overlap), axis=0)
    growth = np.where(pushes, np.abs(force[1] / np.where(pushes, force[0], 1.0)), np.nan)
    found = np.log(growth) / np.log(overlap[1] / overlap[0])
    found = np.where(pushes | np.isnan(force[0]), found, 1.5)  # its stiffness is 0
    # Forces at two overlaps: one more rounding of each.
    return found, np.full(found.shape, 1.5), 3 * case.room(overlap[0])


def _damping(case: Case) -> Values:
    rows = [DEPTHS.index(depth) for depth, _ in DAMPED]
    overlap, closing = case.damped_overlap, case.closing
    unit = _unit(case, overlap)
    change = (case.damped_force - case.force[rows]) / unit
    expected = np.zeros_like(change)
    if case.scene.contact is not None:
        expected = DampedLaw.of(case.scene).damper(overlap, closing) / unit
    # Both forces are rounded, and damping may be many times the elastic force.
    return change, expected, 2 * case.room(overlap) * np.maximum(1.0, np.abs(expected))


def _tangential(case: Case) -> Values:
    unit = np.min(_unit(case, case.overlap[_DEEP[0]]))
    found = case.found.tangential_force / unit
    for wall in case.found.walls:
        found[-1] = max(found[-1], wall.tangential_force / unit)
    return found, np.zeros_like(found), EXAMINED


def _at_contact(case: Case, contact: int) -> str:
    """Words on a contact that is off the most, and on all that do not push."""
    size = case.scene.granules.stiffness.size
    overlap, force = case.overlap[_DEEP[1]], case.force[_DEEP[1]]
    missing = np.flatnonzero(~(np.abs(force) > _NO_FORCE * _unit(case, overlap)))
    is_wall = case.scene.wall is not None
    if missing.size and np.all(np.isfinite(force)):
        if is_wall and missing.tolist() == [size - 1]:
            return "no force in the contact with the wall"
        shown = ", ".join(str(k + 2) for k in missing[:5]) + " and more" * (missing.size > 5)
        return f"no force in contact {shown}"
    return _largest_at_contact(case, contact)


def _largest_at_contact(case: Case, contact: int) -> str:
    is_wall = case.scene.wall is not None and contact + 1 == case.scene.granules.stiffness.size
    return f"largest at {'the wall' if is_wall else f'contact {contact + 2}'}"


def _at_granule(_: Case, granule: int) -> str:
    return f"largest at granule {granule + 1}"


# ---- Forces and motion


def _constant(case: Case) -> Values:
    """At rest and apart; a force on granule 1 in a scene without one belongs to the shock."""
    measured = case.found.constant_force[:, 0].copy()
    if case.constant[0] == 0 or case.scene.piston is not None:
        measured[0] = case.constant[0]
    across = np.max(np.abs(case.found.constant_force[:, 1:]), axis=1)
    return measured + across, case.constant, EXAMINED * case.scene.units.force


def _applied(case: Case) -> Values | None:
    """The force of the shock; one on any other granule is none of it."""
    scene, found = case.scene, case.found
    if scene.piston is not None or found.applied_time.size == 0:
        return None
    force = found.applied_force
    measured = force[:, 0] + np.sum(np.abs(force[:, 1:]), axis=1) + found.applied_sideways
    if case.constant[0] == 0:
        measured = measured + found.constant_force[0, 0]
    expected = applied_force(scene, found.applied_time)
    # LAMMPS adds up the time leg by leg; a steep ramp amplifies the rounding errors.
    late = len(found.runs) * math.ulp(scene.pulse_end)
    steepest = max(
        (
            math.pi / 2 * abs(ramp.end_force - ramp.start_force) / (ramp.end - ramp.start)
            for ramp in scene.ramps
        ),
        default=0.0,
    )
    room = EXAMINED * scene.units.force + late * steepest
    # At a corner a leg ends and the next begins: the force may jump there.
    time, moved = found.applied_time, 4 * len(found.runs) * math.ulp(max(scene.end_time, 1e-300))
    sides = np.array([applied_force(scene, time + shift) for shift in (-moved, 0.0, moved)])
    jumps = np.ptp(sides, axis=0) > 100 * room + moved * steepest
    nearest = np.take_along_axis(sides, np.argmin(np.abs(sides - measured), axis=0)[None], axis=0)[
        0
    ]
    return measured, np.where(jumps, nearest, expected), room


def _at_time(case: Case, reading: int) -> str:
    return f"largest at {case.found.applied_time[reading]:.6g} s"


def _piston(case: Case) -> Values | None:
    piston, found = case.scene.piston, case.found
    if piston is None:
        return None
    time = found.driven_time
    if piston.velocity is not None:
        expected = piston.velocity * time
    else:
        assert piston.time is not None
        assert piston.displacement is not None
        expected = np.interp(time, piston.time, piston.displacement)
    room = EXAMINED * (case.length + piston.distance(case.scene.end_time))
    return found.driven_displacement, expected, room


def _at_driven(case: Case, reading: int) -> str:
    return f"largest at {case.found.driven_time[reading]:.6g} s"


_ONLY = "only round-off may differ"

NUMBERS: tuple[Number, ...] = (
    Number(Kind("position at rest [m]", _MEND), _position,
           f"granules touch, but for gaps and static overlaps: {_ONLY}, as a fraction of the chain",
           _at_granule),
    Number(Kind("distance from the axis [m]", _MEND), _across,
           f"all centres lie on one line: {_ONLY}, as a fraction of the chain", _at_granule),
    Number(Kind("granule radius [m]", _MEND), _radius, f"half of the diameter: {_ONLY}",
           _at_granule),
    Number(Kind("granule mass [kg]", _MEND), _mass,
           f"LAMMPS makes it from diameter and density, 4/3 pi R^3 rho: {_ONLY}", _at_granule),
    Number(Kind("wall position [m]", _MEND), _wall,
           f"where the force of the wall begins: {_ONLY}, as a fraction of the chain",
           lambda *_: "at the far end"),
    Number(Kind("contact stiffness [N m^(-3/2)]", _MEND), _stiffness,
           f"contact force over overlap^(3/2) is A at two known overlaps: {_ONLY}", _at_contact),
    Number(Kind("contact exponent", _MEND), _exponent,
           f"the contact force goes as overlap^(3/2): {_ONLY}", _at_contact),
    Number(DAMPING, _damping,
           "change of a contact force, as a fraction, when its granules approach or part: only"
           " round-off may differ from the law of damping, if there is one", _largest_at_contact),
    Number(Kind("tangential force", _MEND), _tangential,
           "sideways force and torque over radius, as a fraction of the contact force, when the"
           " granules spin: none", _at_granule),
    Number(Kind("constant force [N]", _MEND), _constant,
           f"gravity and precompression where nothing touches: {_ONLY}", _at_granule),
    Number(Kind("velocity at the start [m/s]", _MEND), _velocity,
           f"of a striker or a piston, else 0: {_ONLY}", _at_granule),
    Number(Kind("applied force [N]", _MEND), _applied,
           "the sum of all applied forces is F(t), at the corners from both sides, and 0 after the"
           f" pulse: {_ONLY}", _at_time),
    Number(Kind("displacement of the piston [m]", _MEND), _piston,
           "the displacement of granule 1 at the corners and between them: only round-off may"
           " differ, as a fraction of the chain", _at_driven),
)  # fmt: skip
"""What is compared, in the order in which it is shown; None where a scene has no such number."""
