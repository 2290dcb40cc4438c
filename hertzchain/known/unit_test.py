"""A unit test of LAMMPS itself, from the wave or the impact of a scene, with its motion by Eq. 1.

The form is that of LAMMPS's own tests of granules (``unittest/granular/tests/demNN-*.yaml`` in its
sources of 2026, read by the keys of ``unittest/force-styles``). Their drivers compare relatively:
|a - b| / min(|a|, |b|) of each component has to be at most epsilon, and |a - b| where one is 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from importlib.metadata import version

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.terms import wall_position
from hertzchain.engines.lammps.dialect import NO_FRICTION, damping_number, damping_of
from hertzchain.engines.lammps.dialect import hertz as hertz_law
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.equations import hertz, net_force
from hertzchain.errors import RunFailed, SceneError
from hertzchain.known.answer import plain
from hertzchain.limits import RTOL
from hertzchain.observables.samples import DampedLaw
from hertzchain.scene.scene import Scene, refuse_terms
from hertzchain.scene.shocks import Striker

STEP = 0.05  # natural time units: a wave passes a granule in about fifty steps

# steps between snapshots: first as in LAMMPS's own tests, then two granules further
SEGMENTS = (4, 16, 20)

MOST_GRANULES = 200  # most granules (chosen): people read the test, and it has to be quick
ROOM = 30  # tolerance over the error by rounding measured here; LAMMPS had 6 in 75 scenes


@dataclass(frozen=True, eq=False)
class Moment:
    """Positions, velocities and forces along the chain, each of shape (granules,) [m, m/s, N]."""

    position: FloatArray
    velocity: FloatArray
    force: FloatArray


@dataclass(frozen=True, eq=False)
class KnownMotion:
    """A few granules that are released, and their motion under Hertz's law."""

    scene: Scene
    dt: float  # step of velocity Verlet [s]
    start: Moment  # when they are released
    snapshots: tuple[Moment, ...]  # at the end of each segment
    epsilon: float  # largest relative difference from rounding
    wall: tuple[float, float] | None = None  # its position [m] and 4/3 E* of its contact [Pa]


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
        # Natural time units before the peak of an impact, in which it rises to half; chosen
        times = np.linspace(max(then - 2.0 * scene.units.time, 0.0), then, 100)
    history = native.run(scene, record=times).history
    assert history is not None
    rising = history.contact_force[:, impact]
    frame = int(np.argmax(rising >= 0.5 * rising[-1]))
    # The well pressed contacts around the strongest one lie between two weak ones.
    force = history.contact_force[frame]
    # Fraction of the strongest contact: weaker contacts lose all digits in coordinates
    weak = np.concatenate([[-1], np.flatnonzero(force < 1e-3 * np.max(force)), [force.size]])
    after = int(np.searchsorted(weak, np.argmax(force)))
    first, last = int(weak[after - 1]) + 1, min(int(weak[after]), scene.chain.granules - 1)
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
    terms = ("striker", "wall" if scene.contact is None else "damping")
    refuse_terms(scene, "a unit test for LAMMPS", terms)
    if scene.striker is not None and scene.striker != Striker(scene.striker.velocity):
        raise RunFailed("a unit test for LAMMPS does not support strikers unlike the chain")


def let_go(
    scene: Scene, position: FloatArray, velocity: FloatArray, wall: float | None = None
) -> KnownMotion:
    """Motion by Eq. 1 from positions [m] and velocities [m/s], shape (granules,) each.

    ``wall`` is the position of the scene's wall [m], None where it is out of reach.
    """
    units, diameter = scene.units, 2 * scene.chain.radius
    # The wall is one more place: half a diameter beyond the last granule when that touches it.
    far = position[-1] + diameter if wall is None else wall + diameter / 2
    exact, beyond = np.split(_displacement(np.append(position, far), diameter), [-1])
    stiffness = 0.0 if wall is None else float(scene.granules.stiffness[-1])
    hardness = stiffness / scene.chain.contact_stiffness

    def moments(
        places: FloatArray, behind: float, apart: float, origin: FloatArray
    ) -> list[Moment]:
        law = None if scene.contact is None else DampedLaw.of(scene).in_units(units)
        along, speed = places / units.length, velocity / units.velocity
        states = _walk(along, speed, apart / units.length, law, (behind / units.length, hardness))
        factors = units.length, units.velocity, units.force
        return [
            Moment(origin + x, v, force)
            for x, v, force in (np.asarray(factors)[:, np.newaxis] * state for state in states)
        ]

    exactly = moments(exact, float(beyond[0]), 0.0, position - exact)
    in_coordinates = moments(position, far, diameter, np.zeros_like(position))
    worst = max(
        _difference(getattr(moment, name), getattr(other, name))
        for moment, other in zip(exactly, in_coordinates, strict=True)
        for name in ("position", "velocity", "force")
    )
    epsilon = 10.0 ** math.ceil(math.log10(ROOM * max(worst, 1e-16)))
    # A test with a larger tolerance has no value
    if epsilon > 1e-6:
        allowed = (
            f"rounding of coordinates would change the motion by {worst:.1g}, too much for a test:"
            " take a harder shock, or a softer material"
        )
        raise SceneError("", None, allowed)
    start = Moment(position, velocity, exactly[0].force)
    at = None if wall is None else (wall, stiffness / math.sqrt(scene.chain.radius))
    return KnownMotion(scene, STEP * units.time, start, tuple(exactly[1:]), epsilon, at)


def _walk(
    place: FloatArray,
    velocity: FloatArray,
    diameter: float,
    law: DampedLaw | None,
    wall: tuple[float, float],
) -> list[FloatArray]:
    """States by velocity Verlet in natural units, from displacements or, with a diameter, places.

    A state is place, velocity and force, (3, granules). The wall has a place, as granules have, and
    a stiffness; 0: there is no wall.

    Damping uses the velocities half a step earlier; at the start of each segment, where LAMMPS
    computes forces again, it uses those of that time.
    """
    stiffness = np.append(np.ones(place.size - 1), wall[1])

    def force(place: FloatArray, velocity: FloatArray) -> FloatArray:
        overlap = diameter - np.diff(np.append(place, wall[0]))
        passed_on = stiffness * hertz(overlap)
        if law is not None:
            passed_on[:-1] = law.force(overlap[:-1], -np.diff(velocity), slice(0, place.size - 1))
        return np.asarray(net_force(passed_on, 0.0, place.size), np.float64)

    states = [np.array([place, velocity, force(place, velocity)])]
    for steps in SEGMENTS:
        pushed = force(place, velocity)
        for _ in range(steps):
            half = velocity + STEP / 2 * pushed
            place = place + STEP * half
            pushed = force(place, half)
            velocity = half + STEP / 2 * pushed
        states.append(np.array([place, velocity, pushed]))
    return states


def _displacement(position: FloatArray, diameter: float) -> FloatArray:
    """Return displacements with the overlaps of the positions as written [m]."""
    places = [Fraction(place) for place in position.tolist()]
    sites = [places[0] + Fraction(diameter) * i for i in range(len(places))]
    return np.array([float(place - site) for place, site in zip(places, sites, strict=True)])


def _difference(measured: FloatArray, expected: FloatArray) -> float:
    """Return a relative difference as LAMMPS's test drivers measure it."""
    smaller = np.minimum(np.abs(measured), np.abs(expected))
    return float(np.max(np.abs(measured - expected) / np.where(smaller == 0, 1.0, smaller)))


# ---- The text


def unit_test(motion: KnownMotion, title: str, date: str) -> str:
    """Return the YAML file of a test; the title names its source in a few words."""
    chain, contact, start = motion.scene.chain, motion.scene.contact, motion.start
    damping = motion.scene.granules.damping
    granules, room = start.position.size, 4 * chain.radius
    low, high = float(start.position[0]) - room, float(start.position[-1]) + room
    build = [
        "units si",
        "dimension 3",
        "boundary f f f",
        "atom_style sphere",
        f"region box block {low!r} {high!r} {-room!r} {room!r} {-room!r} {room!r} units box",
        "create_box 1 box",
        *(f"create_atoms 1 single {x!r} 0.0 0.0 units box" for x in start.position.tolist()),
        "set group all diameter ${diam}",
        "set group all density ${dens}",
        *(f"set atom {i} vx {v!r}" for i, v in enumerate(start.velocity.tolist(), start=1)),
        "comm_modify vel yes",
        "neighbor ${skin} bin",
        "neigh_modify delay 0 every 1 check yes",
        "timestep ${dt}",
    ]
    variables = {
        "diam": 2 * chain.radius,
        "dens": chain.density,
        "emod": chain.young_modulus,
        "poisson": chain.poisson_ratio,
        "skin": chain.radius / 2,
        "dt": motion.dt,
    }
    law, more = f"{hertz_law('${emod}', '${poisson}')} {NO_FRICTION}", []
    if contact is not None and damping is not None:
        modulus = 2 * chain.young_modulus / (3 * (1 - chain.poisson_ratio**2))
        variables["damp"] = damping_number(contact, modulus, chain.granule_mass / 2)
        words = damping_of(contact)[1]
        law = f"hertz/material ${{emod}} ${{damp}} ${{poisson}} {NO_FRICTION} {words}"
        q, c = contact.exponent, float(damping[0])
        more = [
            "# Contacts are damped: c overlap^q rate more, with the rate of half a step before,",
            f"# q = {q:g}, c = {c!r} N s/m^{1 + q:g}.",
        ]
    styles, moved = ["atom sphere", "pair granular"], ["fix motion all nve"]
    if motion.wall is not None:
        place, variables["kwall"] = motion.wall
        styles.append("fix wall/gran")
        moved.append(
            f"fix wall all wall/gran granular hertz ${{kwall}} 0.0 {NO_FRICTION}"
            f" xplane NULL {place!r}"
        )
        more = ["# At the wall A = kwall sqrt(R)."]
    lines = [
        "---",
        f"# {plain(title)}.",
        "# Neither forces nor motion are LAMMPS's own: F = A overlap^(3/2) where spheres touch,",
        "# A = sqrt(2R) E / (3 (1 - nu^2)), nothing where they are apart, by velocity Verlet in",
        "# displacements. Recording them again with -u would remove this check.",
        *more,
        "# epsilon: at least thirty times what rounding makes of these steps in coordinates.",
        "# init_forces (run 0) and run_forces (the end) are read but not compared by test_dem_NN.",
        f"lammps_version: none, by hertzchain {version('hertzchain')}",
        "tags: granular",
        f"date_generated: {date}",
        f"epsilon: {motion.epsilon:g}",
        "skip_tests:",
        *_block("prerequisites", styles),
        *_block("pre_commands", build),
        *_block("post_commands", moved),
        "input_file:",
        f"natoms: {granules}",
        *_block("variables", [f"{name} {value!r}" for name, value in variables.items()]),
        "pair_style: granular",
        *_block("pair_coeff", [f"* * {law}"]),
        *_block("run_segments", [" ".join(map(str, SEGMENTS))]),
        *_block("init_forces", _rows(start.force)),
        *_block("run_forces", _rows(motion.snapshots[-1].force)),
        *_block("run_pos", _rows_of_segments([snapshot.position for snapshot in motion.snapshots])),
        *_block("run_vel", _rows_of_segments([snapshot.velocity for snapshot in motion.snapshots])),
        "...",
    ]
    return "\n".join(lines) + "\n"


def _block(key: str, lines: Iterable[str]) -> list[str]:
    return [f"{key}: |", *(f"  {line}" for line in lines)]


def _rows(values: FloatArray) -> list[str]:
    """Return rows with id, x, y and z of each granule; the chain lies along x."""
    return [f"{i} {value:.16e} 0.0 0.0" for i, value in enumerate(values.tolist(), start=1)]


def _rows_of_segments(values: Sequence[FloatArray]) -> list[str]:
    return [f"{segment} {row}" for segment, look in enumerate(values) for row in _rows(look)]
