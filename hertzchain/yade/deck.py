"""A scene as a Yade script: pure text, nothing is run here.

The script is Python for the interpreter within Yade, which has Yade's names. It gets the raw E, nu,
R and rho, never the contact stiffness or the mass computed here, so that a mistake in either shows
when backends are compared.

Yade leaps: it holds positions at t_n and velocities at t_n - dt/2. Between contact forces and
motion the velocity at t_n is therefore that half step before, and the net force over the mass times
dt/2. At a corner of the pulse, velocities are set back from t_n by half a step of the leg that
begins, with its force. So the motion is that of velocity Verlet, to the last step of each leg.
"""

from __future__ import annotations

from collections.abc import Sequence

from hertzchain.scene import Scene
from hertzchain.schedule import Leg

AT_REST, READINGS, VERSION = "at_rest.npy", "readings.npy", "version.txt"
"""What a run leaves behind: positions, masses and diameters of the granules before the shock,
shape (3, granules); positions, velocities and net forces, shape (readings, 3, granules)."""


def motion(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> str:
    """The part of a script that makes the chain, at rest, and the function ``step`` that pushes it.

    ``step`` runs between contact forces and motion. It hands the state on to ``see(leg, step,
    positions, velocities, net forces)`` every so many steps of each leg, and at both of its ends.

    Parameters
    ----------
    scene
        What to simulate.
    legs, strides
        The steps, and how many of them lie between two readings on each leg.
    """
    chain = scene.chain
    rows = "\n".join(f"    {_row(leg, stride)}," for leg, stride in zip(legs, strides, strict=True))
    return f"""\
import numpy as np

granules = {chain.granules}
radius = {chain.radius!r}  # m
young_modulus = {chain.young_modulus!r}  # Pa
poisson_ratio = {chain.poisson_ratio!r}
density = {chain.density!r}  # kg/m^3

# Legs from one corner of the pulse to the next: number of steps, length of a step [s], steps between
# two readings, and the force [N]: its shape, how much it is at the start and how much it grows over
# the whole ramp, of which a step is a fraction.
legs = [
{rows}
]
{_MOTION}"""


def _row(leg: Leg, stride: int) -> tuple[int, float, int, str, float, float, float]:
    if (ramp := leg.ramp) is None:
        return leg.steps, leg.dt, stride, "none", 0.0, 0.0, 0.0
    # A leg starts where its ramp starts.
    assert ramp.start == leg.start
    growth, fraction = ramp.end_force - ramp.start_force, leg.dt / (ramp.end - ramp.start)
    return leg.steps, leg.dt, stride, ramp.shape, ramp.start_force, growth, fraction


_MOTION = '''
steel = FrictMat(
    young=young_modulus, poisson=poisson_ratio, density=density, frictionAngle=0.0
)
O.bodies.append([sphere((2 * radius * k, 0, 0), radius, material=steel) for k in range(granules)])
states = [body.state for body in O.bodies]
for state in states:
    state.blockedDOFs = "yzXYZ"  # one dimension
mass = np.array([state.mass for state in states])

leg, done = 0, 0  # which leg, and how many steps of it


def applied_force():
    """The force on the first granule at this step of this leg [N]."""
    shape, start, growth, fraction = legs[leg][3:]
    part = done * fraction
    return start + growth * (part if shape == "linear" else (1 - np.cos(np.pi * part)) / 2)


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
        start_leg(np.zeros(granules))
    elif done == steps:
        position, half, force = along_the_chain()
        force[0] += applied_force()
        velocity = half + force * dt / (2 * mass)
        see(position, velocity, force)
        leg, done = leg + 1, 0
        if leg == len(legs):
            return
        start_leg(velocity)
    elif done % stride == 0:
        position, half, force = along_the_chain()
        force[0] += applied_force()
        see(position, half + force * dt / (2 * mass), force)
    O.forces.addF(0, (applied_force(), 0, 0))
    done += 1


def start_leg(velocity):
    """Set velocities back by half a step of a leg, with its force."""
    position, _, force = along_the_chain()
    force[0] += applied_force()
    see(position, velocity, force)
    O.dt = legs[leg][1]
    for state, half in zip(states, velocity - force * O.dt / (2 * mass)):
        state.vel = (half, 0, 0)


O.dt = legs[0][1]
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys()],
        [Law2_ScGeom_MindlinPhys_Mindlin()],  # Hertz; no friction, no damping
    ),
    PyRunner(command="push()", iterPeriod=1, initRun=True),
    NewtonIntegrator(damping=0),
]
'''


def watched(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> str:
    """A whole script that leaves the granules at rest and readings of them behind.

    Parameters
    ----------
    scene
        What to simulate.
    legs, strides
        The steps, and how many of them lie between two readings on each leg.
    """
    return f"""\
import numpy as np
from yade import config

{motion(scene, legs, strides)}
np.save({AT_REST!r}, [[state.pos[0] for state in states], mass, [2 * b.shape.radius for b in O.bodies]])
with open({VERSION!r}, "w") as file:
    file.write(config.version)

readings = []


def see(position, velocity, force):
    readings.append((position, velocity, force))


O.run(sum(row[0] for row in legs) + 1, wait=True)
np.save({READINGS!r}, readings)
"""
