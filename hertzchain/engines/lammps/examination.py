"""Reads from LAMMPS each number of a deck by itself: motions may agree with another law.

The commands are those of a run; only the positions of the granules are chosen for each test.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.readings import contact_forces
from hertzchain.engines.external.terms import LET_GO_PISTON
from hertzchain.engines.lammps import deck, examined_places, reading
from hertzchain.engines.lammps.dialect import NO_STEP, go_on
from hertzchain.engines.lammps.engine import command, engine, look
from hertzchain.engines.lammps.examined_places import set_places
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

OVERLAPS = (0.01, 0.02)
"""Overlaps of the tests [radii]; two, so that the exponent of the contact law shows too.

They are independent of the shock, so that they have all digits even if the shock is weak. LAMMPS
computes the difference of two positions without loss, and the expected overlaps come from the
rounded positions.
"""

_SCHEDULED_STEP = 0.01  # natural time units; step of the schedule whose corners are examined
_STEPS_PER_LEG = 4  # readings of the applied force on a leg, besides its start
_STEP = go_on(1)  # continues a run with its neighbours: a new search would find the same ones


@dataclass(frozen=True, eq=False)
class Held:
    """Terms of a scene as LAMMPS has them, in SI units.

    Parameters
    ----------
    radius, velocity, force
        Radius [m] and velocity [m/s] of each granule at the start, and the net force on it [N],
        shape (granules,).
    constant_force
        Force on each granule without contacts and shock [N], shape (granules,).
    wall
        Position of the wall [m], from the forces at two places of the last granule; None without a
        wall.
    moved
        Displacement of granule 1 at the times of the shock [m], shape (legs, readings): only a
        piston moves there.
    """

    radius: FloatArray
    velocity: FloatArray
    force: FloatArray
    constant_force: FloatArray
    wall: float | None
    moved: FloatArray


@dataclass(frozen=True, eq=False)
class Examination:
    """Numbers of a scene in LAMMPS, in SI units.

    Parameters
    ----------
    position, mass
        Position [m] and mass [kg] of each granule at rest, shape (granules,).
    overlap, contact_force
        Two overlaps of each contact [m] and the forces there [N], shape (2, contacts).
    damped_force
        Forces at the larger overlap in granules that approach and in granules that part,
        alternately [N], shape (2, contacts). With damping those at the smaller overlap come first,
        shape (4, contacts).
    tangential_force
        Sideways force on each granule at the larger overlap with spins, or torque over radius if
        that is larger [N], shape (granules,).
    time, applied_force
        Times of the pulse [s] and the force on the whole chain then [N], shape (legs, readings):
        the first of each leg just after its corner, the last just before the next.
    held
        Further numbers of a scene with terms; None for a plain scene. A wall is the last contact.
    closing
        Speeds at which overlaps grow under the damped forces [m/s], of their shape; None without
        damping.
    """

    position: FloatArray
    mass: FloatArray
    overlap: FloatArray
    contact_force: FloatArray
    damped_force: FloatArray
    tangential_force: FloatArray
    time: FloatArray
    applied_force: FloatArray
    held: Held | None = None
    closing: FloatArray | None = None


@dataclass(frozen=True)
class Stage:
    """Commands, and the numbers that are read after them."""

    commands: str  # one command a line
    columns: tuple[str, ...]  # names in ``dump custom``


Snapshot = Mapping[str, FloatArray]  # columns of LAMMPS, each of shape (granules,), by id

Ask = Callable[[Sequence[Stage]], Iterator[Snapshot]]
"""Function that gives LAMMPS the commands of one stage after another; yields a snapshot after each.
"""


def examine(
    scene: Scene,
    pair_style: str = "granular",
    ask: Ask | None = None,
    version: str | None = None,
) -> Examination:
    """Read from LAMMPS the numbers that it has for the deck of a scene.

    Parameters
    ----------
    scene
        The scene.
    pair_style
        ``granular`` (with hertz/material) or ``gran/hertz/history``.
    ask
        Function that gives LAMMPS the commands; by default its Python module.
    version
        Version of that LAMMPS, year month day; by default that of the module.

    Raises
    ------
    BackendMissing
        If LAMMPS is not installed.
    RunFailed
        If LAMMPS stops with an error.
    """
    legs = [
        leg.in_steps(_STEPS_PER_LEG) for leg in scene.schedule(_SCHEDULED_STEP * scene.units.time)
    ]
    if not scene.is_plain:
        set_up = deck.set_up(scene, pair_style, *_version_for(scene, version))
        return _examine_terms(scene, legs, set_up, ask or _ask_module)
    snapshots = (ask or _ask_module)(
        [
            Stage(deck.set_up(scene, pair_style) + reading.COMMANDS, ("x", "mass")),
            # Without a motion LAMMPS counts time and computes forces, granules stay where they are.
            Stage("unfix motion", ()),
            *_pulse(legs),
            *(_press(scene, depth * scene.chain.radius) for depth in OVERLAPS),
            *(_move(scene, sign) for sign in (1, -1)),
            _spin(scene),
        ]
    )
    at_rest, _ = next(snapshots), next(snapshots)
    force = [np.sum(next(snapshots)["fx"]) for _ in range(len(legs) * (_STEPS_PER_LEG + 1))]
    pressed = [next(snapshots) for _ in OVERLAPS]
    moving = [next(snapshots) for _ in (1, -1)]
    (spinning,) = snapshots  # exhaust the generator, so that LAMMPS is closed
    sideways = np.maximum(abs(spinning["fy"]), abs(spinning["fz"]))
    torque = np.max([abs(spinning[name]) for name in ("tqx", "tqy", "tqz")], axis=0)
    return Examination(
        position=at_rest["x"],
        mass=at_rest["mass"],
        overlap=np.array([2 * scene.chain.radius - np.diff(snapshot["x"]) for snapshot in pressed]),
        contact_force=np.array([contact_forces(snapshot["fx"]) for snapshot in pressed]),
        damped_force=np.array([contact_forces(snapshot["fx"]) for snapshot in moving]),
        tangential_force=np.maximum(sideways, torque / scene.chain.radius),
        time=_times(legs),
        applied_force=np.reshape(force, (len(legs), -1)),
    )


def _times(legs: Sequence[Leg]) -> FloatArray:
    """Return the times at which the applied force is read [s], shape (legs, readings)."""
    time = np.array([leg.start + leg.dt * np.arange(leg.steps + 1) for leg in legs])
    time[:, -1] = [leg.end for leg in legs]  # exact to the last digit
    return time


def _version_for(scene: Scene, version: str | None) -> tuple[str, ...]:
    """Return the version of LAMMPS if the deck of a scene depends on it."""
    if scene.contact is None:
        return ()
    return (version or look()[0],)


def _examine_terms(scene: Scene, legs: Sequence[Leg], set_up: str, ask: Ask) -> Examination:
    """Examine a scene with terms.

    Every second contact is pressed at a time: then only one contact acts on a granule, and a soft
    contact loses no digits next to a stiff one.
    """
    granules, start = scene.granules, ("x", "mass", "radius", "vx", "fx")
    contacts = np.arange(granules.stiffness.size)
    turns = [contacts % 2 == turn for turn in (0, 1) if np.any(contacts % 2 == turn)]
    stages = [
        Stage(set_up + reading.COMMANDS, start),
        Stage("unfix motion\nvelocity all set 0.0 0.0 0.0 units box", ()),
        Stage(f"{set_places(examined_places.apart(scene, OVERLAPS[0]))}\n{NO_STEP}", ("fx",)),
        *_pulse(legs),
        *([] if scene.piston is None else [Stage(f"{LET_GO_PISTON}\n{NO_STEP}", ())]),
    ]
    for turn in turns:
        for fraction in OVERLAPS:
            places = set_places(examined_places.pressed(scene, turn, fraction))
            rest = "velocity all set 0.0 0.0 0.0 units box\nset group all omega 0.0 0.0 0.0"
            stages.append(Stage(f"{places}\n{rest}\n{_STEP}", ("x", "fx")))
            if fraction == OVERLAPS[-1] or scene.contact is not None:
                stages += [_move(scene, sign) for sign in (1, -1)]
        stages.append(_spin(scene))
    snapshots = ask(stages)
    at_start = next(snapshots)
    if at_start["mass"].size != granules.mass.size:
        return _of_another_number(at_start)
    _, alone = next(snapshots), next(snapshots)["fx"]
    readings = len(legs) * (_STEPS_PER_LEG + 1)
    pushed = [next(snapshots) for _ in range(readings)]
    if scene.piston is not None:
        next(snapshots)
    shape = (2, contacts.size)
    moved = (0, 1) if scene.contact is not None else (1,)  # overlaps at which granules move
    overlap, force = np.zeros(shape), np.zeros(shape)
    damped, closing = (np.zeros((2 * len(moved), contacts.size)) for _ in range(2))
    sideways, last = np.zeros(granules.mass.size), np.zeros(2)
    for turn in turns:
        for k in range(2):
            found = next(snapshots)
            overlap[k, turn] = examined_places.overlaps(scene, found["x"])[turn]
            force[k, turn] = _forces_of_contacts(found["fx"] - alone, contacts.size)[turn]
            last[k] = found["x"][-1] if turn[-1] else last[k]
            for row in range(2 * moved.index(k), 2 * moved.index(k) + 2) if k in moved else ():
                moving = next(snapshots)
                net = moving["fx"] - alone
                damped[row, turn] = _forces_of_contacts(net, contacts.size)[turn]
                if scene.contact is not None:
                    speed = np.append(moving["vx"], 0.0)
                    closing[row, turn] = (speed[:-1] - speed[1:])[: contacts.size][turn]
        spinning = next(snapshots)
        torque = np.max([abs(spinning[name]) for name in ("tqx", "tqy", "tqz")], axis=0)
        found_sideways = [abs(spinning["fy"]), abs(spinning["fz"]), torque / granules.radius]
        sideways = np.max([sideways, *found_sideways], axis=0)
    assert next(snapshots, None) is None  # exhaust the generator, so that LAMMPS is closed
    radius = at_start["radius"]
    wall = None
    if scene.wall is not None:
        wall = examined_places.wall_place(last, force[:, -1], float(radius[-1]))
    held = Held(radius, at_start["vx"], at_start["fx"], alone, wall, _moved(pushed, len(legs)))
    return Examination(
        position=at_start["x"],
        mass=at_start["mass"],
        overlap=overlap,
        contact_force=force,
        damped_force=damped,
        tangential_force=sideways,
        time=_times(legs),
        # A force on any other granule is none of the shock's.
        applied_force=_applied(scene, pushed, alone, len(legs)),
        held=held,
        closing=None if scene.contact is None else closing,
    )


def _applied(scene: Scene, pushed: Sequence[Snapshot], alone: FloatArray, legs: int) -> FloatArray:
    """Return the force of the shock on the chain [N], shape (legs, readings); 0 for a piston.

    A force on any other granule is none of the shock's. A piston may touch the others meanwhile.
    """
    if scene.piston is not None:
        return np.zeros((legs, len(pushed) // legs))
    nets = [snapshot["fx"] - alone for snapshot in pushed]
    return np.reshape([net[0] + np.sum(np.abs(net[1:])) for net in nets], (legs, -1))


def _moved(pushed: Sequence[Snapshot], legs: int) -> FloatArray:
    """Displacement of granule 1 at the readings of the shock [m], shape (legs, readings)."""
    place = np.array([snapshot["x"][0] for snapshot in pushed])
    return np.reshape(place - place[0], (legs, -1))


def _of_another_number(at_start: Snapshot) -> Examination:
    """Return an examination with a wrong number of granules, where other numbers mean nothing."""
    contacts, nothing = np.zeros((2, 0)), np.zeros(0)
    held = Held(at_start["radius"], at_start["vx"], at_start["fx"], nothing, None, contacts)
    return Examination(
        position=at_start["x"],
        mass=at_start["mass"],
        overlap=contacts,
        contact_force=contacts,
        damped_force=contacts,
        tangential_force=nothing,
        time=contacts,
        applied_force=contacts,
        held=held,
    )


def _forces_of_contacts(net_force: FloatArray, contacts: int) -> FloatArray:
    """Force of each contact that acts alone on the granule behind it [N]; not a wall's."""
    return np.append(net_force[1:], -net_force[-1])[:contacts]


def _ask_module(stages: Sequence[Stage]) -> Iterator[Snapshot]:
    """Give the commands to LAMMPS's Python module, which has granules in the order of their ids."""
    with engine() as lammps:
        for stage in stages:
            command(lammps, stage.commands)
            yield {name: reading.column(lammps, name) for name in stage.columns}


def _pulse(legs: Sequence[Leg]) -> Iterator[Stage]:
    """Stages that read the applied force leg by leg, on a chain at rest except for a piston."""
    for before, leg in zip((None, *legs[:-1]), legs, strict=True):
        yield Stage("\n".join([*deck.leg_commands(leg, before), NO_STEP]), ("x", "fx"))
        for _ in range(leg.steps):
            yield Stage(_STEP, ("x", "fx"))


def _press(scene: Scene, depth: float) -> Stage:
    """Stage with overlaps of about ``depth`` [m]."""
    return Stage(
        f"variable place atom (id-1)*{2 * scene.chain.radius - depth!r}\n"
        f"set group all x v_place\n{_STEP}",
        ("x", "fx"),
    )


def _move(scene: Scene, sign: int) -> Stage:
    """Stage with granules in motion along the chain; every second contact closes."""
    speed = sign * _contact_time_and_speed(scene)[1] / 2
    return Stage(
        f"variable speed atom {speed!r}*(1-2*((id-1)%2))\n"
        f"velocity all set v_speed 0.0 0.0 units box\n{_STEP}",
        ("fx",) if scene.contact is None else ("fx", "vx"),
    )


def _spin(scene: Scene) -> Stage:
    """Stage with spins: surfaces slide, roll and twist; friction with a memory needs a step."""
    time, speed = _contact_time_and_speed(scene)
    radius = scene.chain.radius if scene.is_plain else float(np.min(scene.granules.radius))
    spin = speed / radius
    # Spins of neighbours are neither equal nor opposite, about any axis.
    spins = [f"variable spin{axis} atom {spin!r}*(1+0.5*cos(id-1+{axis}))" for axis in range(3)]
    rest = ["velocity all set 0.0 0.0 0.0 units box", "set group all omega v_spin0 v_spin1 v_spin2"]
    go = [f"timestep {0.1 * time!r}", NO_STEP, go_on(2)]
    return Stage("\n".join([*spins, *rest, *go]), ("fy", "fz", "tqx", "tqy", "tqz"))


def _contact_time_and_speed(scene: Scene) -> tuple[float, float]:
    """Approximate contact time [s] and speed [m/s] at the larger overlap, scales of the tests."""
    if not scene.is_plain:
        granules = scene.granules
        deep = OVERLAPS[1] * examined_places.smaller_radius(scene)
        times = np.sqrt(granules.contact_mass / (granules.stiffness * np.sqrt(deep)))
        return float(np.min(times)), float(np.max(deep / times))
    chain, depth = scene.chain, OVERLAPS[1] * scene.chain.radius
    time = math.sqrt(chain.granule_mass / (chain.contact_stiffness * math.sqrt(depth)))
    return time, depth / time
