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


def known_motion(scene: Scene) -> KnownMotion:
    """Return the motion of the granules in the wave, released on their own when the pulse ends.

    Under a long pulse they are released when the wave is strongest in the middle of the chain;
    ahead of a striker, when its contact has half its largest force. The motion starts from the
    overlaps of the positions as written in the test.
    """
    refuse_terms(scene, "a unit test for LAMMPS", ("striker", "damping"))
    if scene.striker is not None and scene.striker != Striker(scene.striker.velocity):
        raise RunFailed("a unit test for LAMMPS does not support strikers unlike the chain")
    native = Native(rtol=RTOL, wanted="all")
    peak_time = native.run(scene).peak_time
    if scene.striker is None:
        middle = float(peak_time[scene.chain.granules // 2 - 1])
        times = np.array([min(scene.ramps[-1].end, middle, scene.end_time)])
    else:
        then = float(peak_time[0])
        # Natural time units before the peak of an impact, in which it rises to half; chosen
        times = np.linspace(max(then - 2.0 * scene.units.time, 0.0), then, 100)
    history = native.run(scene, record=times).history
    assert history is not None
    rising = history.contact_force[:, 0]
    frame = int(np.argmax(rising >= 0.5 * rising[-1]))
    # The well pressed contacts around the strongest one lie between two weak ones.
    force = history.contact_force[frame]
    # Fraction of the strongest contact: weaker contacts lose all digits in coordinates
    weak = np.concatenate([[-1], np.flatnonzero(force < 1e-3 * np.max(force)), [force.size]])
    after = int(np.searchsorted(weak, np.argmax(force)))
    piece = slice(int(weak[after - 1]) + 1, int(weak[after]) + 1)
    displacement, velocity = history.displacement[frame][piece], history.velocity[frame][piece]
    # Most granules (chosen): people read the test, and it has to be quick
    granules, most = displacement.size, 200
    if granules > most:
        allowed = (
            f"{granules} granules are pressed at once, a test may have {most}:"
            " take a shorter pulse or chain"
        )
        raise SceneError("", None, allowed)
    # The origin lies in the middle, where coordinates have most digits, but not at a granule: a
    # position near 0 has a large relative error.
    diameter, units = 2 * scene.chain.radius, scene.units
    sites = diameter * (np.arange(granules) - granules // 2 + 0.5)
    position = sites + (displacement - displacement[granules // 2])
    exact = _displacement(position, diameter)

    def moments(places: FloatArray, apart: float, origin: FloatArray) -> list[Moment]:
        law = None if scene.contact is None else DampedLaw.of(scene).in_units(units)
        along, speed = places / units.length, velocity / units.velocity
        factors = np.array([units.length, units.velocity, units.force])[:, np.newaxis]
        states = (factors * state for state in _walk(along, speed, apart / units.length, law))
        return [Moment(origin + x, v, force) for x, v, force in states]

    exactly = moments(exact, 0.0, position - exact)
    in_coordinates = moments(position, diameter, np.zeros_like(position))
    worst = max(
        _difference(getattr(moment, name), getattr(other, name))
        for moment, other in zip(exactly, in_coordinates, strict=True)
        for name in ("position", "velocity", "force")
    )
    # Tolerance over the error by rounding measured here; LAMMPS had 6 in 75 scenes
    epsilon = 10.0 ** math.ceil(math.log10(30 * max(worst, 1e-16)))
    # A test with a larger tolerance has no value
    if epsilon > 1e-6:
        allowed = (
            f"rounding of coordinates would change the motion by {worst:.1g}, too much for a test:"
            " take a harder shock, or a softer material"
        )
        raise SceneError("", None, allowed)
    start = Moment(position, velocity, exactly[0].force)
    return KnownMotion(scene, STEP * units.time, start, tuple(exactly[1:]), epsilon)


def _walk(
    place: FloatArray, velocity: FloatArray, diameter: float, law: DampedLaw | None
) -> list[FloatArray]:
    """States by velocity Verlet in natural units, from displacements or, with a diameter, places.

    A state is place, velocity and force, (3, granules). Damping uses the velocities half a step
    earlier; at the start of each segment, where LAMMPS computes forces again, those of that time.
    """

    def force(place: FloatArray, velocity: FloatArray) -> FloatArray:
        overlap = diameter - np.diff(place)
        contacts = slice(0, place.size - 1)
        passed_on = (
            hertz(overlap) if law is None else law.force(overlap, -np.diff(velocity), contacts)
        )
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
        *_block("prerequisites", ["atom sphere", "pair granular"]),
        *_block("pre_commands", build),
        *_block("post_commands", ["fix motion all nve"]),
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
