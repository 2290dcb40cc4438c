"""Decks of LAMMPS and LIGGGHTS, and a script for Yade, with two spheres in a damped contact.

Each prints the speed at which they part.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import hertzchain as hc
from hertzchain.engines.external.program import find_program, run_program, work_folder
from hertzchain.engines.lammps.dialect import NO_FRICTION
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.theory.restitution import collision_of
from validation.physics.chains import steel

SCENE = hc.Scene(steel(2), hc.Striker(1.0, radius=6e-3))
"""Spheres of two sizes, so that m* and R* count."""

_LONGEST = 8.0
"""Natural time units after which the spheres have parted, for restitutions above 0.3; 2.9 of an
undamped collision, 4.4 measured."""

_SAID = "parting at "
_PATIENCE = 300.0  # seconds that a program may take


@dataclass(frozen=True)
class Option:
    """A damping option: the code, its words in a deck, and whether contacts pull as they open."""

    code: str
    words: str
    pulls: bool


Parted = Callable[[str], float]
"""Runs a deck; returns the speed at which the spheres part [m/s]."""

Deck = Callable[[Option, float, float], str]
"""Writes a deck of an option, its number and a step in natural time units."""


def steps_of(step: float) -> tuple[float, int]:
    """A step in natural time units as seconds, and the number of steps until the spheres parted."""
    collision = collision_of(SCENE)
    return step * collision.length / collision.velocity, round(_LONGEST / step)


def deck(option: Option, number: float, step: float) -> str:
    """Deck for any LAMMPS."""
    dt, steps = steps_of(step)
    each = SCENE.granules
    (first, other), widest = each.radius.tolist(), 4 * float(each.radius.max())
    modulus, poisson = float(each.young_modulus[0]), float(each.poisson_ratio[0])
    law = f"hertz/material {modulus!r} {number!r} {poisson!r} {NO_FRICTION} {option.words}"
    return f"""\
units si
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
region box block {-widest!r} {2 * widest!r} {-widest!r} {widest!r} {-widest!r} {widest!r}
create_box 1 box
create_atoms 1 single 0.0 0.0 0.0
create_atoms 1 single {first + other!r} 0.0 0.0
set atom 1 diameter {2 * first!r}
set atom 2 diameter {2 * other!r}
set group all density {float(each.density[0])!r}
pair_style granular
pair_coeff * * {law}
neighbor {first / 2!r} bin
neigh_modify delay 0 every 1 check yes
group first id 1
velocity first set {SCENE.shock.start_velocity!r} 0.0 0.0
fix motion all nve
thermo 1000000000
timestep {dt!r}
run {steps}
variable parting equal vx[2]-vx[1]
print "{_SAID}$(v_parting:%.17g)"
"""


def by_lammps(deck: str) -> float:
    """Run a deck by the module of LAMMPS."""
    with engine() as instance:
        command(instance, deck)
        return float(instance.extract_variable("parting"))


def liggghts_deck(option: Option, number: float, step: float) -> str:
    """Deck for LIGGGHTS."""
    dt, steps = steps_of(step)
    each = SCENE.granules
    (first, other), widest = each.radius.tolist(), 4 * float(each.radius.max())
    density, limit = float(each.density[0]), "off" if option.pulls else "on"
    return f"""\
units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
hard_particles yes
region box block {-widest!r} {2 * widest!r} {-widest!r} {widest!r} {-widest!r} {widest!r} units box
create_box 1 box
create_atoms 1 single 0.0 0.0 0.0 units box
create_atoms 1 single {first + other!r} 0.0 0.0 units box
set atom 1 diameter {2 * first!r} density {density!r}
set atom 2 diameter {2 * other!r} density {density!r}
neighbor {first / 2!r} bin
neigh_modify delay 0
fix modulus all property/global youngsModulus peratomtype {float(each.young_modulus[0])!r}
fix poisson all property/global poissonsRatio peratomtype {float(each.poisson_ratio[0])!r}
fix restitution all property/global coefficientRestitution peratomtypepair 1 {number!r}
pair_style gran model hertz tangential off limitForce {limit}
pair_coeff * *
group first id 1
velocity first set {SCENE.shock.start_velocity!r} 0.0 0.0
fix motion all nve
thermo 1000000000
timestep {dt!r}
run {steps}
variable parting equal vx[2]-vx[1]
print "{_SAID}${{parting}}"
"""


def yade_script(option: Option, number: float, step: float) -> str:
    """Script for Yade."""
    dt, steps = steps_of(step)
    each = SCENE.granules
    first, other = each.radius.tolist()
    modulus, poisson = float(each.young_modulus[0]), float(each.poisson_ratio[0])
    return f"""\
material = FrictMat(
    young={modulus!r}, poisson={poisson!r}, density={float(each.density[0])!r}, frictionAngle=0.0
)
O.bodies.append(sphere((0, 0, 0), {first!r}, material=material))
O.bodies.append(sphere(({first + other!r}, 0, 0), {other!r}, material=material))
O.bodies[0].state.vel = ({SCENE.shock.start_velocity!r}, 0, 0)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys({option.words}={number!r})],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    NewtonIntegrator(damping=0),
]
O.dt = {dt!r}
O.run({steps}, True)
one, other = (body.state.vel[0] for body in O.bodies)
print("{_SAID}%.17g" % (other - one))
"""


def by_program(program: str, *arguments: str) -> Parted:
    """Run a deck by a program: how it is started, without the name of the deck."""

    def parted(deck: str) -> float:
        deadline = Deadline(_PATIENCE)
        with work_folder(program) as folder:
            file = "in.py" if "yade" in program else "in.deck"
            (folder / file).write_text(deck, encoding="utf-8")
            path = find_program(program, "install it")
            # Yade's own Python cannot use the modules of this one.
            said = run_program(
                [path, *arguments, file], Path(folder), deadline, program, PYTHONPATH=""
            )
        values = re.findall(rf"^{_SAID}(\S+)", said, re.MULTILINE)
        if len(values) != 1:
            raise RunFailed(f"{program} printed no speed: {said[-300:]}")
        return float(values[0])

    return parted


by_liggghts = by_program("liggghts", "-in")
by_yade = by_program("yade", "-n", "-x")
