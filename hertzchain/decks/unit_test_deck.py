"""The text of a unit test of LAMMPS itself; forces and motion are computed elsewhere.

The form is that of LAMMPS's own tests of granules (``unittest/granular/tests/demNN-*.yaml`` in its
sources of 2026, read by the keys of ``unittest/force-styles``). Their drivers compare relatively:
|a - b| / min(|a|, |b|) of each component has to be at most epsilon, and |a - b| where one is 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.decks.layout import plain
from hertzchain.engines.lammps.damping import damping_of
from hertzchain.engines.lammps.dialect import NO_FRICTION, hertz
from hertzchain.scene.chain import Chain
from hertzchain.scene.terms import Contact


@dataclass(frozen=True, eq=False)
class Moment:
    """Positions, velocities and forces along the chain, each of shape (granules,) [m, m/s, N]."""

    position: FloatArray
    velocity: FloatArray
    force: FloatArray


@dataclass(frozen=True, eq=False)
class KnownMotion:
    """A few granules that are released, and their motion under Hertz's law."""

    chain: Chain
    dt: float  # step of velocity Verlet [s]
    segments: tuple[int, ...]  # steps between snapshots
    start: Moment  # when they are released
    snapshots: tuple[Moment, ...]  # at the end of each segment
    epsilon: float  # largest relative difference from rounding
    contact: Contact | None = None  # damping of the contacts
    wall: tuple[float, float] | None = None  # its position [m] and 4/3 E* of its contact [Pa]


def unit_test(motion: KnownMotion, title: str, date: str) -> str:
    """Return the YAML file of a test; the title names its source in a few words."""
    chain, start = motion.chain, motion.start
    granules = start.position.size
    room = 4 * chain.radius
    low, high = float(start.position[0]) - room, float(start.position[-1]) + room
    places = zip(start.position.tolist(), start.velocity.tolist(), strict=True)
    build = [
        "units si",
        "dimension 3",
        "boundary f f f",
        "atom_style sphere",
        f"region box block {low!r} {high!r} {-room!r} {room!r} {-room!r} {room!r} units box",
        "create_box 1 box",
    ]
    moving: list[str] = []
    for i, (position, velocity) in enumerate(places, start=1):
        build.append(f"create_atoms 1 single {position!r} 0.0 0.0 units box")
        moving.append(f"set atom {i} vx {velocity!r}")
    build += [
        "set group all diameter ${diam}",
        "set group all density ${dens}",
        *moving,
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
    law, more = hertz("${emod}", "${poisson}"), []
    if motion.contact is not None:
        variables["damp"], words = _damping(motion.contact, chain)
        law = f"hertz/material ${{emod}} ${{damp}} ${{poisson}} {NO_FRICTION} {words}"
        q, c = motion.contact.exponent, _coefficient(motion.contact, chain)
        more = [
            "# Contacts are damped: c overlap^q rate more, with the rate of half a step before,",
            f"# q = {q:g}, c = {c!r} N s/m^{1 + q:g}.",
        ]
    else:
        law = f"{law} {NO_FRICTION}"
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
        "# displacements. To record them again with -u would take that away.",
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
        *_block("run_segments", [" ".join(map(str, motion.segments))]),
        *_block("init_forces", _rows(start.force)),
        *_block("run_forces", _rows(motion.snapshots[-1].force)),
        *_block("run_pos", _rows_of_segments([snapshot.position for snapshot in motion.snapshots])),
        *_block("run_vel", _rows_of_segments([snapshot.velocity for snapshot in motion.snapshots])),
        "...",
    ]
    return "\n".join(lines) + "\n"


def _damping(contact: Contact, chain: Chain) -> tuple[float, str]:
    """Return the second number of the normal law, and the words after the tangential law."""
    number, words = damping_of(contact)
    if contact.restitution is not None:
        return contact.restitution, words.replace("${damping}", "coeff_restitution")
    if contact.damping != "viscoelastic":
        return float(number), words
    # c = 3/2 A tau is g m* sqrt(R*), with m* half the mass and R* half the radius.
    mass, radius = chain.granule_mass / 2, chain.radius / 2
    return _coefficient(contact, chain) / (mass * math.sqrt(radius)), words


def _coefficient(contact: Contact, chain: Chain) -> float:
    """Return c of a contact [N s m^-(1+q)]."""
    stiffness, mass = (np.array([x]) for x in (chain.contact_stiffness, chain.granule_mass / 2))
    return float(contact.coefficients(stiffness, mass)[0])


def _block(key: str, lines: Iterable[str]) -> list[str]:
    return [f"{key}: |", *(f"  {line}" for line in lines)]


def _rows(values: FloatArray) -> list[str]:
    """Return rows with id, x, y and z of each granule; the chain lies along x."""
    return [f"{i} {value:.16e} 0.0 0.0" for i, value in enumerate(values.tolist(), start=1)]


def _rows_of_segments(values: Sequence[FloatArray]) -> list[str]:
    return [f"{segment} {row}" for segment, look in enumerate(values) for row in _rows(look)]
