"""Numbers of the generated deck, as LAMMPS has them, against the scene: only round-off may differ.

Each number is one entry. LAMMPS is asked as for anybody's deck; what it should have is worked out
here once more, as it must not share a mistake with what writes decks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from hertzchain import theory
from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.lammps import FoundDeck, Lammps
from hertzchain.engines.lammps.reading.prober import DAMPED, DEPTHS
from hertzchain.errors import RunFailed
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.scene.scene import Scene
from hertzchain.verdict.check import Check, Kind, farthest, unmeasured, within
from hertzchain.verdict.deck.measured import displacement, far_wall

# relative tolerance of LAMMPS's numbers; measured 3e-15, R 1e-8 to 1e3 m, N to 1e4
EXAMINED = 1e-12

_ENGINE = "lammps"
_EPS = float(np.finfo(np.float64).eps)
_ROUNDED = 6 * _EPS  # of a coordinate: two of them and their difference, half as much again
_DEEP = [DEPTHS.index(1.0), DEPTHS.index(3.0)]  # tries that tell the law
_NO_FORCE = 1e-6  # of Hertz's: a contact with less does not push (chosen)
_LATE = 1e-8  # of an overlap: by how much rounding may hide where a force begins (chosen)

_MEND = (
    "what LAMMPS made of the deck is not the scene: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it"
)
_ONLY = "only round-off may differ"

GRANULES = Kind("granules", _MEND)
DAMPING = Kind("damping", _MEND)
NOT_EXAMINED = Kind("not examined", _MEND)


@dataclass(frozen=True, eq=False)
class Number:
    """A number of a deck: its name with its unit, what LAMMPS and the scene have, and why.

    ``room`` is the largest difference that is round-off; ``where`` says what stands at an index:
    a granule, a contact or a time.
    """

    name: str
    measured: FloatArray
    expected: FloatArray
    room: FloatArray | float
    reason: str
    where: Callable[[int], str]

    def check(self) -> Check:
        """The check of the element that is off the most, in terms of what is allowed."""
        allowed = np.broadcast_to(self.room, self.expected.shape)
        # Some tolerances are 0: then any difference fails.
        off = (self.measured - self.expected) / np.maximum(allowed, np.finfo(np.float64).tiny)
        at = np.unravel_index(farthest(off.ravel(), 0.0), self.expected.shape)
        numbers = float(self.measured[at]), float(self.expected[at]), float(allowed[at])
        reason = f"{self.reason}; {self.where(int(at[-1]))}"
        return within(Kind(self.name, _MEND), _ENGINE, *numbers, reason)


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
    granules, contacts = _granules(scene, found), _contacts(scene, found)
    numbers = (*granules, *contacts, *_forces(scene, found))
    return [count, *(number.check() for number in numbers)]


# ---- Granules


def _places(scene: Scene) -> FloatArray:
    """Of granules and a wall [m]: contact after contact, each in equilibrium."""
    granules, count = scene.granules, scene.chain.granules
    pressed, carried = scene.precompression, np.zeros(granules.stiffness.size)
    load, weighs, weight = 0.0 if pressed is None else pressed.force, 0.0, _weight(scene)
    fixed = _fixed(scene)
    # A free striker presses nothing at the start, and a fixed granule passes nothing on.
    for k in range(scene.shock.loaded_granule, carried.size):
        weighs += weight[k]
        if fixed[k]:
            load = weighs = 0.0
        carried[k] = weighs + load
    overlap = (carried / granules.stiffness) ** (2 / 3)
    ahead = granules.radius[1:] + np.broadcast_to(scene.chain.gap, count)[1:]
    if scene.wall is not None:
        ahead = np.append(ahead, scene.wall.gap)
    return np.append(0.0, np.cumsum(granules.radius[: carried.size] + ahead - overlap))


def _weight(scene: Scene) -> FloatArray:
    """Of each granule along the chain [N], shape (granules,)."""
    gravity = 0.0 if scene.precompression is None else scene.precompression.gravity
    granules = scene.granules
    return np.asarray(gravity * 4 / 3 * math.pi * granules.radius**3 * granules.density)


def _fixed(scene: Scene) -> Array:
    return np.broadcast_to(scene.chain.fixed, scene.chain.granules)


def _length(scene: Scene) -> float:
    """Of the chain: coordinates are as large [m]."""
    return float(np.sum(2 * scene.granules.radius) + np.sum(scene.granules.gap))


def _at_granule(granule: int) -> str:
    return f"largest at granule {granule + 1}"


def _granules(scene: Scene, found: FoundDeck) -> Iterator[Number]:
    """Numbers of the granules at rest, and of the wall."""
    count, allowed = scene.chain.granules, EXAMINED * _length(scene)
    places, begin = _places(scene), float(found.origin @ found.direction)
    yield Number(
        "position at rest [m]", begin + found.position, places[:count], allowed,
        f"granules touch, but for gaps and static overlaps: {_ONLY}, as a fraction of the chain",
        _at_granule,
    )  # fmt: skip
    across = np.max(np.abs(found.sideways), axis=1)
    yield Number(
        "distance from the axis [m]", across, np.zeros_like(across), allowed,
        f"all centres lie on one line: {_ONLY}, as a fraction of the chain", _at_granule,
    )  # fmt: skip
    radius, mass = scene.granules.radius, scene.granules.mass
    yield Number("granule radius [m]", found.radius, radius, EXAMINED * radius,
                 f"half of the diameter: {_ONLY}", _at_granule)  # fmt: skip
    moved = np.flatnonzero(np.isfinite(mass))  # other masses have no effect
    yield Number(
        "granule mass [kg]", found.mass[moved], mass[moved], EXAMINED * mass[moved],
        f"LAMMPS makes it from diameter and density, 4/3 pi R^3 rho: {_ONLY}",
        lambda k: _at_granule(int(moved[k])),
    )  # fmt: skip
    if scene.holds:
        yield Number(
            "fixes that move a granule", found.integrated.astype(np.float64),
            np.where(_fixed(scene), 0.0, 1.0), 0.0, "one each, none of fixed granules", _at_granule,
        )  # fmt: skip
    if scene.wall is not None:
        wall = far_wall(found)
        place = (
            math.nan if wall is None else begin + wall.position - _late(wall.overlap, wall.force)
        )
        yield Number(
            "wall position [m]", np.array([place]), places[-1:], allowed,
            f"where the force of the wall begins: {_ONLY}, as a fraction of the chain",
            lambda _: "at the far end",
        )  # fmt: skip


def _late(overlap: FloatArray, force: FloatArray) -> float:
    """How much earlier a wall begins than its force shows among others, by Hertz's law [m]."""
    deep = force[-2:] ** (2 / 3)
    with np.errstate(all="ignore"):
        late = float(deep[1] * (overlap[-1] - overlap[-2]) / (deep[1] - deep[0]) - overlap[-1])
    return late if abs(late) < _LATE * overlap[-1] else 0.0


# ---- Contacts


def _tries(scene: Scene, found: FoundDeck) -> list[FloatArray]:
    """Overlap and force, then closing, overlap and force of damped tries, (tries, contacts).

    A wall's contact is the last.
    """
    tries = [found.overlap, found.contact_force,
             found.closing, found.damped_overlap, found.damped_force]  # fmt: skip
    if scene.wall is None:
        return tries
    wall = far_wall(found)
    if wall is None:
        last = [np.full(len(rows), np.nan) for rows in tries]
    else:
        late = _late(wall.overlap, wall.force)
        last = [np.append(np.nan, wall.overlap + late), np.append(np.nan, wall.force),
                wall.closing, wall.damped_overlap + late, wall.damped_force]  # fmt: skip
    return [np.column_stack(both) for both in zip(tries, last, strict=True)]


def _contacts(scene: Scene, found: FoundDeck) -> Iterator[Number]:
    """Numbers of the law of contacts, by known overlaps."""
    overlap, force, closing, damped_overlap, damped_force = _tries(scene, found)
    granules, stiffness = scene.granules, scene.granules.stiffness
    reach = granules.radius[:-1] + granules.radius[1:]
    if scene.wall is not None:
        reach = np.append(reach, _length(scene))

    def room(at: FloatArray) -> FloatArray:
        """Relative tolerance of forces at overlaps that are differences of rounded coordinates."""
        return np.asarray(np.maximum(EXAMINED, _ROUNDED * reach / at))

    deep, push = overlap[_DEEP], force[_DEEP]
    hertz = stiffness * deep**1.5
    pushes = np.abs(push) > _NO_FORCE * hertz

    def largest(contact: int) -> str:
        is_wall = scene.wall is not None and contact + 1 == stiffness.size
        return f"largest at {'the wall' if is_wall else f'contact {contact + 2}'}"

    expected = np.broadcast_to(stiffness, push.shape)
    yield Number(
        "contact stiffness [N m^(-3/2)]", push / deep**1.5, expected, room(deep) * expected,
        f"contact force over overlap^(3/2) is A at two known overlaps: {_ONLY}", largest,
    )  # fmt: skip
    both = np.all(pushes, axis=0)
    growth = np.where(both, np.abs(push[1] / np.where(both, push[0], 1.0)), np.nan)
    exponent = np.log(growth) / np.log(deep[1] / deep[0])
    exponent = np.where(both | np.isnan(push[0]), exponent, 1.5)  # its stiffness is 0
    yield Number(
        "contact exponent", exponent, np.full(exponent.shape, 1.5),
        3 * room(deep[0]),  # forces at two overlaps: one more rounding of each
        f"the contact force goes as overlap^(3/2): {_ONLY}", largest,
    )  # fmt: skip
    unit = stiffness * damped_overlap**1.5
    change = (damped_force - force[[DEPTHS.index(depth) for depth, _ in DAMPED]]) / unit
    added = np.zeros_like(change)
    if scene.contact is not None:
        added = DampedLaw.of(scene).damper(damped_overlap, closing) / unit
    yield Number(
        DAMPING.name, change, added,
        # Both forces are rounded, and damping may be many times the elastic force.
        2 * room(damped_overlap) * np.maximum(1.0, np.abs(added)),
        "change of a contact force, as a fraction, when its granules approach or part: only"
        " round-off may differ from the law of damping, if there is one", largest,
    )  # fmt: skip
    least = np.min(hertz[0])
    tangential = found.tangential_force / least
    for wall in found.walls:
        tangential[-1] = max(tangential[-1], wall.tangential_force / least)
    yield Number(
        "tangential force", tangential, np.zeros_like(tangential), EXAMINED,
        "sideways force and torque over radius, as a fraction of the contact force, when the"
        " granules spin: none", _at_granule,
    )  # fmt: skip


# ---- Forces and motion


def applied_force(scene: Scene, time: FloatArray) -> FloatArray:
    """F(t) [N] by Table 1 or the pulse table, not by the schedule's ramps; of the shape of time."""
    if scene.pulse is None:
        return scene.shock.by_formula(time)
    assert scene.rise_time is not None
    return theory.applied_force(time, scene.pulse, scene.rise_time)


def _forces(scene: Scene, found: FoundDeck) -> Iterator[Number]:
    """Numbers of loads, velocities and the shock."""
    load = _weight(scene)
    if scene.precompression is not None:
        load[scene.shock.loaded_granule] += scene.precompression.force
        load[-1] -= scene.precompression.force if scene.wall is None and not scene.holds else 0.0
    load[_fixed(scene)] = 0.0
    along = found.constant_force[:, 0].copy()
    pushed = scene.shock.granule - 1
    of_shock = load[pushed] == 0  # then a constant force on that granule belongs to the shock
    if of_shock or scene.piston is not None:
        along[pushed] = load[pushed]
    across = np.max(np.abs(found.constant_force[:, 1:]), axis=1)
    allowed = EXAMINED * scene.units.force
    yield Number(
        "constant force [N]", along + across, load, allowed,
        f"gravity and precompression where nothing touches: {_ONLY}", _at_granule,
    )  # fmt: skip
    velocity = scene.granules.velocity
    fastest = float(np.max(np.abs(velocity)))
    moving = found.velocity[:, 0] + np.max(np.abs(found.velocity[:, 1:]), axis=1)
    yield Number(
        "velocity at the start [m/s]", moving, velocity, EXAMINED * fastest,
        f"of a striker, a piston or as the scene states it, else 0: {_ONLY}", _at_granule,
    )  # fmt: skip
    if scene.piston is not None:
        time = found.driven_time
        yield Number(
            "displacement of the piston [m]", found.driven_displacement,
            displacement(scene.piston, time),
            EXAMINED * (_length(scene) + scene.piston.distance(scene.end_time)),
            "the displacement of granule 1 at the corners and between them: only round-off may"
            " differ, as a fraction of the chain", lambda k: f"largest at {time[k]:.6g} s",
        )  # fmt: skip
    elif found.applied_time.size:
        yield _applied(scene, found, float(found.constant_force[pushed, 0]) if of_shock else 0.0)


def _applied(scene: Scene, found: FoundDeck, constant: float) -> Number:
    """The force of the shock; one on any other granule is none of it."""
    time, force, pushed = found.applied_time, found.applied_force, scene.shock.granule - 1
    others = np.delete(force, pushed, axis=1)
    measured = force[:, pushed] + np.sum(np.abs(others), axis=1) + found.applied_sideways
    measured = measured + constant
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
    # At a corner a leg ends and the next begins: the force may jump there, to either side.
    moved = 4 * len(found.runs) * math.ulp(max(scene.end_time, 1e-300))
    sides = np.array([applied_force(scene, time + shift) for shift in (0.0, -moved, moved)])
    jumps = np.ptp(sides, axis=0) > 100 * room + moved * steepest
    nearest = np.where(jumps, np.argmin(np.abs(sides - measured), axis=0), 0)
    return Number(
        "applied force [N]", measured, sides[nearest, np.arange(time.size)],
        room,
        "the sum of all applied forces is F(t), at the corners from both sides, and 0 after the"
        f" pulse: {_ONLY}", lambda k: f"largest at {time[k]:.6g} s",
    )  # fmt: skip
