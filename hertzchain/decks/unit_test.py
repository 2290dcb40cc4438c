"""A unit test of LAMMPS from the wave or the impact of a scene, with its motion by Eq. 1."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.decks.unit_test_deck import KnownMotion, Moment
from hertzchain.engines.external.terms import wall_position
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.equations import hertz, net_force
from hertzchain.errors import RunFailed, SceneError
from hertzchain.limits import RTOL
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.scene.scene import Scene
from hertzchain.scene.striker import Striker
from hertzchain.scene.validity import refuse_terms

STEP = 0.05  # natural time units: a wave passes a granule in about fifty steps

# steps between snapshots: first as in LAMMPS's own tests, then two granules further
SEGMENTS = (4, 16, 20)

WEAKEST = 1e-3  # fraction of the strongest contact: weaker contacts lose all digits in coordinates
MOST_GRANULES = 200  # most granules (chosen): people read the test, and it has to be quick
ROOM = 30  # tolerance over the error by rounding measured here; LAMMPS had 6 in 75 scenes
_RISE = 2.0  # natural time units before the peak of an impact, in which it rises to half; chosen
LARGEST_EPSILON = 1e-6  # a test with a larger tolerance has no value


def known_motion(scene: Scene) -> KnownMotion:
    """Return the motion of the granules in the wave, released on their own when the pulse ends.

    Under a long pulse they are released when the wave is strongest in the middle of the chain; at a
    wall or ahead of a striker, when its contact has half its largest force. The motion starts from
    the overlaps of the positions as written in the test.
    """
    _refuse(scene)
    native = Native(rtol=RTOL, wanted="all")
    peak_time, impact = native.run(scene).peak_time, -1 if scene.wall is not None else 0
    if scene.wall is None and scene.striker is None:
        middle = float(peak_time[scene.chain.granules // 2 - 1])
        times = np.array([min(scene.ramps[-1].end, middle, scene.end_time)])
    else:
        then = float(peak_time[impact])
        times = np.linspace(max(then - _RISE * scene.units.time, 0.0), then, 100)
    history = native.run(scene, record=times).history
    assert history is not None
    rising = history.contact_force[:, impact]
    frame = int(np.argmax(rising >= 0.5 * rising[-1]))
    first, last = _pressed(history.contact_force[frame])
    last = min(last, scene.chain.granules - 1)
    granules = last - first + 1
    if granules > MOST_GRANULES:
        allowed = (
            f"{granules} granules are pressed at once, a test may have {MOST_GRANULES}:"
            " take a shorter pulse or chain"
        )
        raise SceneError("", None, allowed)
    piece = slice(first, last + 1)
    displacement = history.displacement[frame][piece]
    # The origin lies in the middle, where coordinates have most digits, but not at a granule: a
    # position near 0 has a large relative error.
    sites = 2 * scene.chain.radius * (np.arange(granules) - granules // 2 + 0.5)
    start = sites + (displacement - displacement[granules // 2])
    wall = None
    if scene.wall is not None and last == scene.chain.granules - 1:
        along = wall_position(scene) - 2 * scene.chain.radius * first
        wall = float(along + sites[0] - displacement[granules // 2])
    return let_go(scene, start, history.velocity[frame][piece], wall)


def _refuse(scene: Scene) -> None:
    """Refuse terms that a few separate granules cannot have; walls have no damping here."""
    known = ("striker", "wall" if scene.contact is None else "damping")
    refuse_terms(scene, "a unit test for LAMMPS", known)
    if scene.striker is not None and scene.striker != Striker(scene.striker.velocity):
        raise RunFailed("a unit test for LAMMPS does not support strikers unlike the chain")


def _pressed(force: FloatArray) -> tuple[int, int]:
    """Return first and last granule of the well pressed contacts around the strongest one."""
    strong = force >= WEAKEST * np.max(force)
    first = last = int(np.argmax(force))
    while first > 0 and strong[first - 1]:
        first -= 1
    while last < force.size - 1 and strong[last + 1]:
        last += 1
    return first, last + 1


def let_go(
    scene: Scene, position: FloatArray, velocity: FloatArray, wall: float | None = None
) -> KnownMotion:
    """Motion by Eq. 1 from positions [m] and velocities [m/s], shape (granules,) each.

    ``wall`` is the position of the scene's wall [m], None where it is out of reach.
    """
    _refuse(scene)
    units = scene.units
    dt = STEP * units.time
    diameter = 2 * scene.chain.radius
    # The wall is one more place: half a diameter beyond the last granule when that touches it.
    far = position[-1] + diameter if wall is None else wall + diameter / 2
    exact, beyond = np.split(_displacement(np.append(position, far), diameter), [-1])
    stiffness = 0.0 if wall is None else float(scene.granules.stiffness[-1])
    hardness = stiffness / scene.chain.contact_stiffness
    law = None if scene.contact is None else DampedLaw.of(scene).in_units(units)
    speed = velocity / units.velocity
    behind = float(beyond[0]) / units.length, hardness
    in_displacements = _walk(exact / units.length, speed, 0.0, law, behind)
    behind = far / units.length, hardness
    in_coordinates = _walk(position / units.length, speed, diameter / units.length, law, behind)

    def moments(states: list[Moment], origin: FloatArray) -> list[Moment]:
        return [
            Moment(
                origin + np.asarray(state.position, np.float64) * units.length,
                np.asarray(state.velocity, np.float64) * units.velocity,
                np.asarray(state.force, np.float64) * units.force,
            )
            for state in states
        ]

    found = moments(in_displacements, position - exact)
    others = moments(in_coordinates, np.zeros_like(position))
    worst = max(
        _difference(getattr(one, name), getattr(other, name))
        for one, other in zip(found, others, strict=True)
        for name in ("position", "velocity", "force")
    )
    epsilon = 10.0 ** math.ceil(math.log10(ROOM * max(worst, 1e-16)))
    if epsilon > LARGEST_EPSILON:
        allowed = (
            f"rounding of coordinates would change the motion by {worst:.1g}, too much for a test:"
            " take a harder shock, or a softer material"
        )
        raise SceneError("", None, allowed)
    start = Moment(position, velocity, found[0].force)
    snapshots = tuple(found[1:])
    at = None if wall is None else (wall, stiffness / math.sqrt(scene.chain.radius))
    return KnownMotion(scene.chain, dt, SEGMENTS, start, snapshots, epsilon, scene.contact, at)


def _walk(
    start: FloatArray,
    velocity: FloatArray,
    diameter: float,
    law: DampedLaw | None,
    wall: tuple[float, float],
) -> list[Moment]:
    """States by velocity Verlet in natural units, from displacements or, with a diameter, places.

    The wall is a place like those of granules, and a stiffness, 0 for none.

    Damping uses the velocities half a step earlier; at the start of each segment, where LAMMPS
    computes forces again, it uses those of that time.
    """
    stiffness = np.append(np.ones(start.size - 1), wall[1])

    def force(place: FloatArray, velocity: FloatArray) -> FloatArray:
        overlap = diameter - np.diff(np.append(place, wall[0]))
        passed_on = stiffness * hertz(overlap)
        if law is not None:
            passed_on[:-1] = law.force(overlap[:-1], -np.diff(velocity), slice(0, place.size - 1))
        return np.asarray(net_force(passed_on, 0.0, place.size), np.float64)

    place, pushed = start, force(start, velocity)
    found = [Moment(place, velocity, pushed)]
    for steps in SEGMENTS:
        pushed = force(place, velocity)
        for _ in range(steps):
            half = velocity + STEP / 2 * pushed
            place = place + STEP * half
            pushed = force(place, half)
            velocity = half + STEP / 2 * pushed
        found.append(Moment(place, velocity, pushed))
    return found


def _displacement(position: FloatArray, diameter: float) -> FloatArray:
    """Return displacements with the overlaps of the positions as written [m]."""
    places = [Fraction(place) for place in position.tolist()]
    sites = [places[0] + Fraction(diameter) * i for i in range(len(places))]
    return np.array([float(place - site) for place, site in zip(places, sites, strict=True)])


def _difference(one: FloatArray, other: FloatArray) -> float:
    """Return a relative difference as LAMMPS's test drivers measure it."""
    smaller = np.minimum(np.abs(one), np.abs(other))
    difference = np.abs(one - other)
    return float(np.max(difference / np.where(smaller == 0, 1.0, smaller)))
