"""The Yade backend: scene to script, the program, and its result."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.external.observation import Granules, Observation
from hertzchain.engines.external.terms import (
    OF_OTHER_CODES,
    positions,
    refuse_long,
    wall_material,
    wall_position,
)
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import SHAPES

AT_REST, READINGS, VERSION = "at_rest.npy", "readings.npy", "version.txt"
"""Files that a run writes: positions, masses and diameters of the granules before the shock,
shape (3, granules); positions, velocities and net forces, shape (readings, 3, granules)."""

WALL_FORCE = "wall_force.npy"
"""Further file of a run with a wall: the force on it, shape (readings,)."""


def motion(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> str:
    """Return the part of a script with the chain at rest, and the function ``push``.

    ``push`` runs between contact forces and motion. It passes positions, velocities and net forces
    to ``see`` at the given interval of steps, and at both ends of each leg.
    """
    damped = scene.contact is not None
    rows = "\n".join(f"    {row}," for row in _rows(legs, strides, damped))
    bounds, geometry, law, loads = _loops(scene)
    damping = "damped, and never pulling" if damped else "no damping"
    piston, stroke = _piston(legs, rows_each=2 if damped else 1)
    shapes = "\n".join(f'        "{k}": {shape.for_numpy("part")},' for k, shape in SHAPES.items())
    script = _MOTION.format(
        shapes=shapes, bounds=bounds, geometry=geometry, law=law, loads=loads,
        physics="betan=betan" if damped else "", damping=damping, piston=piston, stroke=stroke,
        pushed=scene.shock.granule - 1,
    )  # fmt: skip
    return f"""\
import numpy as np

{_parameters(scene)}

# Legs from one corner of the pulse to the next: number of steps, length of a step [s], steps
# between two readings, and the force [N]: its shape, how much it is at the start and how much it
# grows over the whole ramp, of which a step is a fraction.
legs = [
{rows}
]
{_BODIES}{script}"""


def _parameters(scene: Scene) -> str:
    """Return the part for each granule at its start position; RunFailed if it is too long."""
    count, each = scene.chain.granules, scene.granules
    refuse_long("a script for Yade with", scene)
    columns = each.radius, each.young_modulus, each.poisson_ratio, each.density
    rows = zip(positions(scene), *(column.tolist() for column in columns), strict=True)
    lines = "\n".join(f"    {row!r}," for row in rows)
    velocities = "\n".join(
        f"start_velocity[{k}] = {along!r}  # m/s"
        for k, along in enumerate(each.velocity.tolist())
        if along or k == 0
    )
    law = "" if scene.contact is None else _RESTITUTION.format(scene.contact.restitution)
    return f"""\
granules = {count}
# Of each granule: position [m], radius [m], Young's modulus [Pa], Poisson's ratio, and density
# [kg/m^3].
rows = [
{lines}
]
start_velocity = np.zeros(granules)
{velocities}{law}"""


_RESTITUTION = """
restitution = {!r}  # of two spheres whose contact pulls as it opens; this one does not
log_e = np.log(restitution)
betan = float(-np.sqrt(5 / 6) * log_e / np.hypot(np.pi, log_e))"""


_BODIES = """
for x, radius, young_modulus, poisson_ratio, density in rows:
    material = FrictMat(
        young=young_modulus, poisson=poisson_ratio, density=density, frictionAngle=0.0
    )
    O.bodies.append(sphere((x, 0, 0), radius, material=material))
"""


def _loops(scene: Scene) -> tuple[str, str, str, str]:
    """Return what terms add to Yade's engines: to bounds, geometry, law and constant forces."""
    bounds = geometry = law = loads = ""
    if scene.wall is not None:
        bounds, geometry = ", Bo1_Wall_Aabb()", ", Ig2_Wall_Sphere_ScGeom()"
        law = "neverErase=True"  # the contact with the wall exists from the start
    pressed = scene.precompression
    if pressed is not None and pressed.gravity:
        loads += f"    GravityEngine(gravity=({pressed.gravity!r}, 0, 0)),\n"
    if pressed is not None and pressed.force:
        first = scene.shock.loaded_granule
        loads += f"    ForceEngine(force=({pressed.force!r}, 0, 0), ids=[{first}]),\n"
        if scene.wall is None:
            loads += f"    ForceEngine(force=({-pressed.force!r}, 0, 0), ids=[granules - 1]),\n"
    return bounds, geometry, law, loads


def _piston(legs: Sequence[Leg], rows_each: int) -> tuple[str, str]:
    """Return the code that moves a piston: before the legs, and at the start of each leg.

    A leg has one row in the script, or two where a step of no length comes first.
    """
    strokes = [leg.stroke for leg in legs if leg.stroke is not None]
    if not strokes:
        return "", ""
    velocities = ", ".join(repr(stroke.velocity) for stroke in strokes for _ in range(rows_each))
    before = f"""\
states[0].blockedDOFs = "xyzXYZ"  # the piston, which nothing pushes
mass[0] = np.inf
piston_velocity = [{velocities}]  # in each row of legs [m/s]
"""
    return before, "    velocity = np.append(piston_velocity[leg], velocity[1:])\n"


def _wall(scene: Scene) -> str:
    """Part that adds the wall and its contact with the last granule; needs the engines."""
    if scene.wall is None:
        return ""
    modulus, poisson = wall_material(scene)
    return f"""
plane = O.bodies.append(wall(
    {wall_position(scene)!r}, axis=0, sense=-1,
    material=FrictMat(young={modulus!r}, poisson={poisson!r}, density=1.0, frictionAngle=0.0),
))
wall_contact = createInteraction(plane, granules - 1)
# Yade takes R/2 for 1/(1/R + 1/R), as if the wall were a sphere like the granule. It is a plane:
# R* is R, and the stiffness goes as the root of it.
wall_contact.phys.kno *= 2**0.5
"""


_Row = tuple[int, float, int, str, float, float, float]

_NO_TIME = 1e-100
"""Length of a step that moves nothing [s]; 0 makes Yade's velocities NaN (measured)."""


def _rows(legs: Sequence[Leg], strides: Sequence[int], damped: bool) -> Iterator[_Row]:
    """Yield the legs of a script, each after a step of no length if forces are computed again."""
    for leg, stride in zip(legs, strides, strict=True):
        if damped:
            yield 1, _NO_TIME, 1, "none", 0.0, 0.0, 0.0
        yield _row(leg, stride)


def _row(leg: Leg, stride: int) -> _Row:
    if (ramp := leg.ramp) is None:
        return leg.steps, leg.dt, stride, "none", 0.0, 0.0, 0.0
    # A leg starts where its ramp starts.
    assert ramp.start == leg.start
    growth, fraction = ramp.end_force - ramp.start_force, leg.dt / (ramp.end - ramp.start)
    return leg.steps, leg.dt, stride, ramp.shape, ramp.start_force, growth, fraction


_MOTION = '''\
states = [body.state for body in O.bodies]
for state in states:
    state.blockedDOFs = "yzXYZ"  # one dimension
mass = np.array([state.mass for state in states])
{piston}
leg, done = 0, 0  # which leg, and how many steps of it


def applied_force():
    """The applied force at this step of this leg [N]."""
    shape, start, growth, fraction = legs[leg][3:7]
    part = done * fraction
    grown = {{
        "none": 0.0,
{shapes}
    }}
    return start + growth * grown[shape]


def along_the_chain():
    """Positions, velocities half a step before, and contact forces."""
    position = np.array([state.pos[0] for state in states])
    velocity = np.array([state.vel[0] for state in states])
    return position, velocity, np.array([O.forces.f(k)[0] for k in range(granules)])


def push():
    """Between contact forces and motion: read the state, then apply the force."""
    global leg, done
    steps, dt, stride = legs[leg][:3]
    if O.iter == 0:
        start_leg(start_velocity)
    elif done == steps:
        position, half, force = along_the_chain()
        force[{pushed}] += applied_force()
        velocity = half + force * dt / (2 * mass)
        see(position, velocity, force)
        leg, done = leg + 1, 0
        if leg == len(legs):
            return
        start_leg(velocity)
    elif done % stride == 0:
        position, half, force = along_the_chain()
        force[{pushed}] += applied_force()
        see(position, half + force * dt / (2 * mass), force)
    if legs[leg][3] != "none":
        O.forces.addF({pushed}, (applied_force(), 0, 0))
    done += 1


def start_leg(velocity):
    """Set velocities back by half a step of a leg, with its force."""
{stroke}    position, _, force = along_the_chain()
    force[{pushed}] += applied_force()
    see(position, velocity, force)
    O.dt = legs[leg][1]
    for state, half in zip(states, velocity - force * O.dt / (2 * mass)):
        state.vel = (half, 0, 0)


O.dt = legs[0][1]
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(){bounds}]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(){geometry}],
        [Ip2_FrictMat_FrictMat_MindlinPhys({physics})],
        [Law2_ScGeom_MindlinPhys_Mindlin({law})],  # Hertz; no friction, {damping}
    ),
{loads}    PyRunner(command="push()", iterPeriod=1, initRun=True),
    NewtonIntegrator(damping=0),
]
'''


def watched(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> str:
    """Return a script that writes the granules at rest, and readings at intervals of steps."""
    wall, before, watch, after = _wall(scene), "", "", ""
    skip = "" if scene.contact is None else _SKIP
    if scene.wall is not None:
        before = "wall_force = []\n"
        watch = "    wall_force.append(abs(wall_contact.phys.normalForce[0]))\n"
        after = f"np.save({WALL_FORCE!r}, wall_force)\n"
    return f"""\
from yade import config

{motion(scene, legs, strides)}
position = [state.pos[0] for state in states]
np.save({AT_REST!r}, [position, mass, [2 * body.shape.radius for body in O.bodies]])
with open({VERSION!r}, "w") as file:
    file.write(config.version)
{wall}
readings = []
{before}

def see(position, velocity, force):
{skip}    readings.append((position, velocity, force))
{watch}

O.run(sum(row[0] for row in legs) + 1, wait=True)
np.save({READINGS!r}, readings)
{after}"""


_SKIP = f"""\
    if legs[leg][1] == {_NO_TIME!r}:
        return  # a step of no length
"""


def deck(scene: Scene, legs: Sequence[Leg], about: Sequence[str]) -> str:
    """Return a script for ``yade -n -x FILE.py`` that writes peaks.csv, below lines ``about``."""
    # Natural time units between readings; error of a parabola: 6e-8 of a peak
    strides = [max(1, int(0.01 * scene.units.time / leg.dt)) for leg in legs]
    lines, outside = "\n".join(about), []
    pressed, wall, loaded = scene.precompression, "", scene.shock.loaded_granule
    if pressed is not None and pressed.gravity:
        outside.append(f"force[1:] -= {pressed.gravity!r} * mass[1:]")
    if pressed is not None and loaded:
        outside.append(f"force[{loaded}] -= {pressed.force!r}")
    if scene.held_load:
        outside.append(f"force[-1] += {scene.held_load!r}")
    if scene.pushed:
        outside.append(f"force[{scene.pushed}] -= applied_force()")
    if scene.wall is not None:
        wall = "contact = np.append(contact, on_wall)"
        outside += ["on_wall = abs(wall_contact.phys.normalForce[0])", "force[-1] += on_wall"]
    peaks = _PEAKS.format(
        skip="" if scene.contact is None else _SKIP,
        first=0 if scene.contact is None else 1,
        outside="".join(f"    {line}\n" for line in outside and ["force = force.copy()", *outside]),
        wall=f"    {wall}\n" if wall else "",
        contacts="granules" if wall else "granules - 1",
    )
    return f'''\
"""{lines}

Run it with: yade -n -x THIS_FILE (its name must end in .py: Yade runs no other scripts)
"""

{motion(scene, legs, strides)}{_wall(scene)}
{peaks}'''


_PEAKS = '''
peaks = np.zeros({contacts})
last = []  # times and contact forces of up to three successive readings
begin = np.cumsum([0.0] + [row[0] * row[1] for row in legs])


def see(position, velocity, force):
    """Keep the largest force of each contact: the top of the parabola through three readings."""
{skip}    if leg > {first} and done == 0:
        return  # the end of the leg before
{outside}    # Nothing pushes the granules beyond a contact but that contact.
    contact = np.cumsum(force[:0:-1])[::-1]
{wall}    np.maximum(peaks, contact, out=peaks)
    last.append((begin[leg] + done * legs[leg][1], contact))
    if len(last) == 3:
        (t, a), (u, b), (w, c) = last
        rise, fall = (b - a) / (u - t), (c - b) / (w - u)
        top = (rise >= 0) & (fall < 0)
        bend = np.where(top, (fall - rise) / (w - t), -1.0)
        slope = rise + bend * (u - t)
        np.maximum(peaks, np.where(top, b - slope**2 / (4 * bend), 0.0), out=peaks)
        last.pop(0)


O.run(sum(row[0] for row in legs) + 1, wait=True)
rows = [f"{{contact}},{{force!r}}" for contact, force in enumerate(peaks.tolist(), start=2)]
table = "\\n".join(["contact,peak_force_N", *rows])
with open("peaks.csv", "w") as file:
    file.write(table + "\\n")
print(table)
'''


@dataclass(frozen=True)
class Yade(ProgramEngine):
    """A generated script, run by the program ``yade``.

    Each run starts Yade, which takes 1.4 s. A step of 60 granules takes 5e-5 s, about half of it
    for a Python function that applies the force and reads the state at each step. Yade has one law
    of damping, that with a restitution, in contacts that do not pull. While it runs, Yade listens
    on a port of this machine, protected by a password; no option turns this off.

    Parameters
    ----------
    program
        Path of the program, or its name on the search path.
    dt, read_every, rtol, extrapolated, time_limit, wanted
        As for ``Lammps``; impossible ones raise a SceneError.
    """

    LABEL: ClassVar[str] = "Yade"
    FILE: ClassVar[str] = "chain.py"
    INSTALL: ClassVar[str] = "apt install yade"
    FASTEST: ClassVar[tuple[float, float]] = (3e-6, 1e-7)  # 4e-5 and 4e-7 measured
    TERMS: ClassVar[tuple[str, ...]] = OF_OTHER_CODES
    # Yade's own Python cannot use the modules of this one.
    ENVIRONMENT: ClassVar[dict[str, str]] = {"PYTHONPATH": ""}

    WRITER: ClassVar[ModuleType] = sys.modules[__name__]

    program: str = "yade"

    def method_of(self, scene: Scene) -> str:  # noqa: ARG002 - the same for all
        """Return the name of the method in the result."""
        return "velocity-verlet, MindlinPhys"

    def refuse(self, scene: Scene) -> None:
        """Raise RunFailed for a scene that Yade cannot simulate."""
        super().refuse(scene)
        if scene.contact is not None and scene.contact.attraction:
            raise RunFailed(
                "contacts never pull in Yade: leave out attraction, or take another backend"
            )

    def command(self, program: str) -> list[str]:
        """Return the command that runs ``FILE``."""
        return [program, "-n", "-x", "-j1", self.FILE]

    def replay(self, folder: Path, scene: Scene, strides: Sequence[int], seen: Observation) -> str:
        """Pass the readings that Yade left to the observation; return its version."""
        rest = read_array(folder / AT_REST, (3, None))
        readings = read_array(folder / READINGS, (None, 3, scene.chain.granules))
        on_wall = None
        if scene.wall is not None:
            on_wall = read_array(folder / WALL_FORCE, (len(readings),))
        seen.replay(Granules(*rest), readings, strides, on_wall)
        return (folder / VERSION).read_text(encoding="utf-8")


def read_array(path: Path, shape: tuple[int | None, ...]) -> FloatArray:
    """Read an array that a run left in a file (.npy); in ``shape`` None stands for any length."""
    try:
        array = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as problem:
        raise RunFailed(f"Yade left no readings that can be read ({problem})") from None
    right = array.dtype == np.float64 and array.ndim == len(shape)
    if not right or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
        raise RunFailed("Yade left readings of another shape: is the disk full?")
    return np.asarray(array, np.float64)
