"""What LAMMPS makes of a deck, asked before any of its motion is believed.

The commands are those of a run; only the granules are put where the answer is plain. Two runs that
agree on a motion can still mean another law: friction does nothing in one dimension, and a force
that is off by a thousandth says nothing of where the thousandth is. Here every number of the deck
is asked for by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.lammps import deck, reading
from hertzchain.lammps.engine import command, engine, run
from hertzchain.scene import Scene
from hertzchain.verlet.readings import contact_forces

OVERLAPS = (0.01, 0.02)
"""Radii; two, so that the exponent of the contact law shows too.

Its own overlaps, not those of the shock: they have all digits, however weak the shock is. LAMMPS
takes the difference of two positions without loss, and the positions are read back as they were
rounded."""

_SCHEDULED_STEP = 0.01
"""Natural time units; what the corners of the schedule are asked for."""

_STEPS_PER_LEG = 4
"""At which the applied force is read, besides the start of the leg."""


@dataclass(frozen=True, eq=False)
class Examination:
    """What LAMMPS makes of a scene, in SI units.

    Parameters
    ----------
    position, mass
        Of each granule, at rest [m, kg], shape (granules,).
    overlap, contact_force
        Two overlaps of each contact [m] and the forces there [N], shape (2, contacts).
    damped_force
        The forces at the larger overlap with granules that approach, and with granules that part,
        by turns [N], shape (2, contacts).
    tangential_force
        On each granule at the larger overlap with spins, sideways, or torque over radius if that is
        larger [N], shape (granules,).
    time, applied_force
        Times of the pulse [s] and the force on the whole chain then [N], shape (legs, readings):
        the first of each leg just after its corner, the last just before the next.
    """

    position: FloatArray
    mass: FloatArray
    overlap: FloatArray
    contact_force: FloatArray
    damped_force: FloatArray
    tangential_force: FloatArray
    time: FloatArray
    applied_force: FloatArray


def examine(scene: Scene, pair_style: str = "granular") -> Examination:
    """Ask LAMMPS what it makes of the deck of a scene.

    Parameters
    ----------
    scene
        The scene.
    pair_style
        ``granular`` (with hertz/material) or ``gran/hertz/history``.

    Raises
    ------
    BackendMissing
        If LAMMPS is not there.
    RunFailed
        If LAMMPS stops with an error.
    """
    with engine() as lammps:
        command(lammps, deck.set_up(scene, pair_style) + reading.COMMANDS)
        at_rest = reading.granules(lammps)
        # Without a motion LAMMPS counts time and computes forces, and granules stay where they are.
        command(lammps, "unfix motion")
        time, applied_force = _pulse(lammps, scene)
        overlap, contact_force = np.array(
            [_press(lammps, scene, depth * scene.chain.radius) for depth in OVERLAPS]
        ).swapaxes(0, 1)
        return Examination(
            position=at_rest.position,
            mass=at_rest.mass,
            overlap=overlap,
            contact_force=contact_force,
            damped_force=_move(lammps, scene),
            tangential_force=_spin(lammps, scene),
            time=time,
            applied_force=applied_force,
        )


def _pulse(lammps: Any, scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Times and forces on the whole chain, which stays at rest, leg by leg."""
    legs = [
        replace(leg, steps=_STEPS_PER_LEG)
        for leg in scene.schedule(_SCHEDULED_STEP * scene.units.time)
    ]
    time = np.array([leg.start + leg.dt * np.arange(leg.steps + 1) for leg in legs])
    time[:, -1] = [leg.end for leg in legs]  # to the last digit
    force = np.zeros_like(time)
    for row, before, leg in zip(force, (None, *legs[:-1]), legs, strict=True):
        command(lammps, "\n".join([*deck.leg_commands(leg, before), "run 0 post no"]))
        for k in range(leg.steps + 1):
            if k > 0:
                run(lammps, 1)
            row[k] = np.sum(_array(lammps, "f")[:, 0])
    return time, force


def _press(lammps: Any, scene: Scene, depth: float) -> tuple[FloatArray, FloatArray]:
    """Overlaps of about a depth [m], as LAMMPS has rounded them, and the contact forces [N]."""
    diameter, position = 2 * scene.chain.radius, _array(lammps, "x")
    position[:, 0] = (diameter - depth) * np.arange(len(position))
    run(lammps, 1)
    return diameter - np.diff(_array(lammps, "x")[:, 0]), _contact_forces(lammps)


def _move(lammps: Any, scene: Scene) -> FloatArray:
    """Contact forces with granules in motion along the chain, every other contact closing."""
    speed = _contact_time_and_speed(scene)[1]
    forces = []
    for sign in (1, -1):
        velocity = _array(lammps, "v")
        velocity[:, 0] = sign * speed / 2 * (-1.0) ** np.arange(len(velocity))
        run(lammps, 1)
        forces.append(_contact_forces(lammps))
    _array(lammps, "v")[:] = 0.0
    return np.array(forces)


def _spin(lammps: Any, scene: Scene) -> FloatArray:
    """Sideways forces where the surfaces slide, roll and twist on one another.

    Spins do it all, and leave the normals along the chain. Friction that has a memory needs a step
    to gain it.
    """
    time, speed = _contact_time_and_speed(scene)
    radius, spin = scene.chain.radius, _array(lammps, "omega")
    granule = np.arange(len(spin))
    for axis in range(3):
        # Neither alike nor opposite from one granule to the next, about any axis.
        spin[:, axis] = speed / radius * (1 + 0.5 * np.cos(granule + axis))
    command(lammps, f"timestep {0.1 * time!r}\nrun 0 post no")
    run(lammps, 2)
    sideways = np.max(np.abs(_array(lammps, "f")[:, 1:]), axis=1)
    torque = np.max(np.abs(_array(lammps, "torque")), axis=1)
    larger: FloatArray = np.maximum(sideways, torque / radius)
    return larger


def _contact_time_and_speed(scene: Scene) -> tuple[float, float]:
    """Of two granules with the larger overlap, about [s, m/s]: only the size of what is tried."""
    chain, depth = scene.chain, OVERLAPS[1] * scene.chain.radius
    time = math.sqrt(chain.granule_mass / (chain.contact_stiffness * math.sqrt(depth)))
    return time, depth / time


def _contact_forces(lammps: Any) -> FloatArray:
    return contact_forces(_array(lammps, "f")[:, 0])


def _array(lammps: Any, name: str) -> FloatArray:
    """What LAMMPS holds, itself and not a copy, in the order of the ids, shape (granules, 3)."""
    return np.asarray(lammps.numpy.extract_atom(name), np.float64)
