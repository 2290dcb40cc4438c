"""Checks of LAMMPS's numbers for a generated deck, one by one, against the scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hertzchain import theory
from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.lammps import Examination, Lammps
from hertzchain.engines.lammps.examination import Held
from hertzchain.errors import RunFailed
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.scene.piston import Piston
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.scene import Scene
from hertzchain.scene.sine import Sine
from hertzchain.verdict.check import Check, Kind, farthest, unmeasured, within

# relative tolerance of LAMMPS's numbers; measured 3e-15, R 1e-8 to 1e3 m, N to 1e4
EXAMINED = 1e-12

_ENGINE = "lammps"

_MEND = (
    "what LAMMPS made of the deck is not the scene: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it"
)

GRANULES = Kind("granules", _MEND)
POSITION = Kind("position at rest [m]", _MEND)
RADIUS = Kind("granule radius [m]", _MEND)
MASS = Kind("granule mass [kg]", _MEND)
STIFFNESS = Kind("contact stiffness [N m^(-3/2)]", _MEND)
EXPONENT = Kind("contact exponent", _MEND)
DAMPING = Kind("damping", _MEND)
TANGENTIAL = Kind("tangential force", _MEND)
APPLIED_FORCE = Kind("applied force [N]", _MEND)
CONSTANT_FORCE = Kind("constant force [N]", _MEND)
START_FORCE = Kind("net force at the start [N]", _MEND)
START_VELOCITY = Kind("velocity at the start [m/s]", _MEND)
WALL = Kind("wall position [m]", _MEND)
PISTON = Kind("displacement of the piston [m]", _MEND)
NOT_EXAMINED = Kind("not examined", _MEND)


def examined(scene: Scene, lammps: Lammps) -> list[Check]:
    """Examine the deck of a scene in LAMMPS, each number by itself."""
    try:
        return examination_checks(scene, lammps.examine(scene))
    except RunFailed as problem:
        return [unmeasured(NOT_EXAMINED, _ENGINE, str(problem))]


def examination_checks(scene: Scene, found: Examination) -> list[Check]:
    """Return checks of LAMMPS's numbers against the scene: only round-off may differ."""
    numbers = found.mass.size, scene.chain.granules, 0.0
    count = _check(GRANULES, numbers, "one more or less is another chain")
    if not count.passed:
        return [count]
    if found.held is not None:
        return [count, *_checks_with_terms(scene, found, found.held)]
    stiffness = np.full(scene.chain.granules - 1, scene.chain.contact_stiffness)
    return [
        count,
        *_granule_checks(scene, found),
        *_contact_checks(found, stiffness, np.full(stiffness.size, EXAMINED)),
        _applied_force_check(scene, found),
    ]


def _granule_checks(scene: Scene, found: Examination) -> list[Check]:
    chain = scene.chain
    sites = 2 * chain.radius * np.arange(chain.granules)
    site, granule = farthest(found.position, sites), farthest(found.mass, chain.granule_mass)
    mass, room = chain.granule_mass, EXAMINED * 2 * chain.radius * chain.granules
    return [
        _check(
            POSITION,
            (found.position[site], sites[site], room),
            "granules touch, the first is at 0: only round-off may differ, as a fraction of the"
            f" chain; largest at granule {site + 1}",
        ),
        _check(
            MASS,
            (found.mass[granule], mass, EXAMINED * mass),
            "LAMMPS makes it from diameter and density, 4/3 pi R^3 rho: only round-off may"
            f" differ; largest at granule {granule + 1}",
        ),
    ]


def _checks_with_terms(scene: Scene, found: Examination, held: Held) -> list[Check]:
    """Return the checks of a scene with terms, granule by granule and contact by contact."""
    granules, expected = scene.granules, _start(scene)
    mass = granules.mass
    if scene.piston is not None:  # the mass of a piston and the forces on it have no effect
        mass = mass[[1, *range(1, mass.size)]]
        found.mass[0] = mass[0]
        expected.constant_force[0] = held.constant_force[0]
        held.force[0] = 0.0
    length = float(np.sum(2 * granules.radius) + np.sum(granules.gap))
    # Error of an overlap: two coordinates and their difference are rounded.
    reach = granules.radius[:-1] + granules.radius[1:]
    if scene.wall is not None:
        reach = np.append(reach, length)  # also for the wall's place
    rounded = 4 * np.finfo(np.float64).eps * reach / found.overlap[0]
    room = np.maximum(EXAMINED, 1.5 * rounded)
    checks = [
        _each(POSITION, found.position, expected.position, EXAMINED * length,
            "granules touch, but for gaps and static overlaps: only round-off may differ, as a"
            " fraction of the chain"),
        _each(RADIUS, held.radius, granules.radius, EXAMINED * granules.radius,
            "half of the diameter: only round-off may differ"),
        _each(MASS, found.mass, mass, EXAMINED * mass,
            "LAMMPS makes it from diameter and density, 4/3 pi R^3 rho: only round-off may differ"),
    ]  # fmt: skip
    if held.wall is not None:
        place = float(expected.position[-1] + expected.beyond)
        checks.append(
            _check(
                WALL,
                (held.wall, place, EXAMINED * length),
                "where the force of the wall begins, by Hertz's law from two places of the last"
                " granule: only round-off may differ, as a fraction of the chain",
            )
        )
    law = None if scene.contact is None else DampedLaw.of(scene)
    checks += _contact_checks(found, granules.stiffness, room, scene.wall is not None, law)
    load = scene.units.force
    # A static overlap is the difference of two rounded coordinates.
    rounding = 4 * np.finfo(np.float64).eps * length
    pushed = granules.stiffness * (
        (granules.static_overlap + rounding) ** 1.5 - granules.static_overlap**1.5
    )
    both = (
        np.append(0.0, pushed)[: granules.mass.size] + np.append(pushed, 0.0)[: granules.mass.size]
    )
    checks += [
        _each(CONSTANT_FORCE, held.constant_force, expected.constant_force, EXAMINED * load,
            "gravity and precompression where nothing touches: only round-off may differ"),
        _each(START_FORCE, held.force, expected.force, EXAMINED * load + both,
            "contacts balance gravity and precompression at the start, and damping acts on a"
            " striker: none else but what rounded coordinates make"),
        _each(START_VELOCITY, held.velocity, expected.velocity, EXAMINED * scene.start_velocity,
            "of a striker or a piston, else 0: only round-off may differ"),
        _applied_force_check(scene, found) if scene.piston is None
        else _piston_check(scene, scene.piston, found.time, held.moved, length),
    ]  # fmt: skip
    return checks


@dataclass(frozen=True, eq=False)
class _Start:
    """A scene with terms at its start, in SI units, computed independently of ``Scene.granules``.

    ``beyond`` is the distance from the last centre to the wall.
    """

    position: FloatArray
    beyond: float
    constant_force: FloatArray
    velocity: FloatArray
    force: FloatArray


def _start(scene: Scene) -> _Start:
    """Compute the start from the parts of a scene: contact after contact, each in equilibrium."""
    chain, pressed, each = scene.chain, scene.precompression, scene.granules
    force, gravity = (0.0, 0.0) if pressed is None else (pressed.force, pressed.gravity)
    gaps = np.broadcast_to(chain.gap, chain.granules)
    carried, place, places, beyond = force, 0.0, [0.0], 0.0
    mass = [4 / 3 * math.pi * float(r) ** 3 * float(rho) for r, rho in
            zip(each.radius, each.density, strict=True)]  # fmt: skip
    for granule in range(chain.granules):
        radius = float(each.radius[granule])
        carried += gravity * mass[granule]
        if granule < each.stiffness.size:
            overlap = (carried / float(each.stiffness[granule])) ** (2 / 3)
        if granule + 1 < chain.granules:
            place += radius + float(gaps[granule + 1]) - overlap + float(each.radius[granule + 1])
            places.append(place)
        elif scene.wall is not None:
            beyond = radius + scene.wall.gap - overlap
    constant = [gravity * each_mass for each_mass in mass]
    constant[0] += force
    constant[-1] -= force if scene.wall is None else 0.0
    velocity = np.zeros(chain.granules)
    velocity[0] = scene.start_velocity
    net = np.zeros(chain.granules)
    if scene.contact is not None:
        deep, rate = float(each.static_overlap[0]), np.zeros(each.stiffness.size)
        rate[0] = velocity[0]
        # A contact that only touches has no damping yet.
        lost = DampedLaw.of(scene).damper(each.static_overlap, rate)[0] if deep > 0 else 0.0
        net[0], net[1] = -lost, lost
    return _Start(np.array(places), beyond, np.array(constant), velocity, net)


def _each(
    kind: Kind, measured: FloatArray, expected: FloatArray, room: FloatArray | float, reason: str
) -> Check:
    """Return a check of each granule's number, at the granule farthest from its tolerance."""
    allowed = np.broadcast_to(room, expected.shape)
    # Some tolerances are 0: then any difference fails.
    at = farthest((measured - expected) / np.maximum(allowed, np.finfo(np.float64).tiny), 0.0)
    numbers = measured[at], expected[at], allowed[at]
    return _check(kind, numbers, f"{reason}; largest at granule {at + 1}")


def _contact_checks(
    found: Examination,
    stiffness: FloatArray,
    room: FloatArray,
    has_wall: bool = False,
    law: DampedLaw | None = None,
) -> list[Check]:
    """Return checks of each contact's law; ``room`` has relative tolerances of forces, (contacts,).

    ``law`` is the law of damped contacts, None for elastic ones.
    """
    force = found.contact_force
    allowed, wall = np.broadcast_to(room * stiffness, force.shape), stiffness.size * has_wall
    expected = np.broadcast_to(stiffness, force.shape).ravel()
    measured = (force / found.overlap**1.5).ravel()
    # The contact farthest from its own tolerance.
    share = (allowed / np.max(allowed)).ravel()
    stiff = farthest((measured - expected) / share, 0.0)
    # Missing contacts have stiffness 0 and no exponent.
    there = np.all(np.abs(force) > 1e-6 * stiffness * found.overlap**1.5, axis=0)
    growth = np.where(there, np.abs(force[1] / np.where(there, force[0], 1.0)), np.nan)
    exponent = np.log(growth) / np.log(found.overlap[1] / found.overlap[0])
    worth = room / np.max(room)
    bent = farthest((np.where(there, exponent, 1.5) - 1.5) / worth, 0.0)
    unit = stiffness * found.overlap[1] ** 1.5
    spun = farthest(found.tangential_force, 0.0)
    # Forces at two overlaps that differ by a factor of 2: one more rounding of each.
    bending = room[bent] if room[bent] == EXAMINED else 3 * room[bent]
    missing = _missing(there, wall)

    def at(contact: int) -> str:
        return f"largest at {_named(contact % there.size, wall)}"

    return [
        _check(
            STIFFNESS,
            (measured[stiff], expected[stiff], allowed.ravel()[stiff]),
            "contact force over overlap^(3/2) is A at two known overlaps: only round-off may"
            f" differ; {missing or at(stiff)}",
        ),
        _check(
            EXPONENT,
            (exponent[bent], 1.5, bending),
            "the contact force goes as overlap^(3/2): only round-off may differ;"
            f" {missing or at(bent)}",
        ),
        _damping_check(found, stiffness, room, law, wall),
        _check(
            TANGENTIAL,
            (found.tangential_force[spun] / np.min(unit), 0.0, EXAMINED),
            "sideways force and torque over radius, as a fraction of the contact force, when"
            f" the granules spin: none; largest at granule {spun + 1}",
        ),
    ]


def _damping_check(
    found: Examination, stiffness: FloatArray, room: FloatArray, law: DampedLaw | None, wall: int
) -> Check:
    """Return a check of the change of contact forces when granules approach or part."""
    if law is None or found.closing is None:
        unit = stiffness * found.overlap[1] ** 1.5
        change = (found.damped_force - found.contact_force[1]) / unit
        damped = farthest((change / (room / np.max(room))).ravel(), 0.0)
        contact = damped % stiffness.size
        return _check(
            DAMPING,
            (change.ravel()[damped], 0.0, room[contact]),
            "change of a contact force, as a fraction, when its granules approach or part:"
            f" none; largest at {_named(contact, wall)}",
        )
    overlap = np.repeat(found.overlap, 2, axis=0)
    unit = stiffness * overlap**1.5
    change = (found.damped_force - np.repeat(found.contact_force, 2, axis=0)) / unit
    expected = law.damper(overlap, found.closing) / unit
    # Both forces are rounded, and damping may be many times the elastic force.
    allowed = room * np.maximum(1.0, np.abs(expected))
    at = farthest(((change - expected) / (allowed / np.max(allowed))).ravel(), 0.0)
    contact = at % stiffness.size
    return _check(
        DAMPING,
        (change.ravel()[at], expected.ravel()[at], allowed.ravel()[at]),
        "change of a contact force, as a fraction, when its granules approach or part at two"
        " overlaps: only round-off may differ from the law of damping; largest at"
        f" {_named(contact, wall)}",
    )


def _named(contact: int, wall: int) -> str:
    """Name a contact, counted from 0, by the paper's number; contact ``wall`` - 1 is a wall's."""
    return "the wall" if contact + 1 == wall else f"contact {contact + 2}"


def _check(kind: Kind, numbers: tuple[float, float, float], reason: str) -> Check:
    """Return a check of LAMMPS from measured and expected number and the tolerance."""
    measured, expected, tolerance = map(float, numbers)
    return within(kind, _ENGINE, measured, expected, tolerance, reason)


def _missing(there: Array, wall: int = 0) -> str:
    """Return words on contacts without a force, by the paper's numbers; empty if there are none."""
    contacts = np.flatnonzero(np.logical_not(there)).tolist()
    if wall and contacts == [wall - 1]:
        return "no force in the contact with the wall"
    missing = [_named(contact, wall).removeprefix("contact ") for contact in contacts]
    if not missing:
        return ""
    shown = ", ".join(missing[:5]) + (" and more" if len(missing) > 5 else "")
    return f"no force in contact {shown}"


def _applied_force_check(scene: Scene, found: Examination) -> Check:
    """Return a check of LAMMPS's applied force against F(t), at the corners from both sides."""
    expected = _applied_force(scene, found.time)
    leg, step = divmod(farthest(found.applied_force, expected), expected.shape[1])
    # LAMMPS adds up the time leg by leg; a steep ramp amplifies the rounding errors.
    late = len(expected) * math.ulp(scene.pulse_end)
    steepest = max(
        (
            math.pi / 2 * abs(ramp.end_force - ramp.start_force) / (ramp.end - ramp.start)
            for ramp in scene.ramps
        ),
        default=0.0,
    )
    tolerance = EXAMINED * scene.units.force + late * steepest
    return _check(
        APPLIED_FORCE,
        (found.applied_force[leg, step], expected[leg, step], tolerance),
        "the sum of all net forces is F(t), at the corners from both sides, and 0 after the"
        f" pulse: only round-off may differ; largest at {found.time[leg, step]:.6g} s",
    )


def _piston_check(
    scene: Scene, piston: Piston, time: FloatArray, moved: FloatArray, length: float
) -> Check:
    """Check of granule 1's displacement against the piston's, at corners from both sides."""
    if piston.velocity is not None:
        expected = piston.velocity * time
    else:
        assert piston.time is not None
        assert piston.displacement is not None
        expected = np.interp(time, piston.time, piston.displacement)
    leg, step = divmod(farthest(moved, expected), expected.shape[1])
    # Places are rounded, and times are sums.
    room = EXAMINED * (length + piston.distance(scene.end_time))
    return _check(
        PISTON,
        (moved[leg, step], expected[leg, step], room),
        "the displacement of granule 1 at the corners and between them: only round-off may differ,"
        f" as a fraction of the chain; largest at {time[leg, step]:.6g} s",
    )


def _applied_force(scene: Scene, time: FloatArray) -> FloatArray:
    """F(t) [N] by Table 1 or the pulse table, not by the schedule's ramps: (legs, readings)."""
    if isinstance(scene.shock, Pulse):
        assert scene.rise_time is not None
        return theory.applied_force(time, scene.shock, scene.rise_time)
    if scene.striker is not None:
        return np.zeros_like(time)
    if isinstance(scene.shock, Sine):
        shock = scene.shock
        force = shock.amplitude * np.sin(2 * math.pi * shock.frequency * time)
        return np.where(time < shock.cycles / shock.frequency, force, 0.0)
    table = scene.shock
    assert isinstance(table, PulseTable)
    force = np.interp(time, table.time, table.force, left=0.0, right=0.0)
    # The force may jump at a table's first and last row: legs end before a jump and start after it.
    force[:, 1:][time[:, 1:] <= table.time[0]] = 0.0
    force[:, 0][time[:, 0] >= table.time[-1]] = 0.0
    return force
