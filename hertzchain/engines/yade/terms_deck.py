"""Parts of a script for Yade for a chain with terms: different granules, wall, static load.

Yade's Python gets E, nu, rho and R of each granule, and positions; Yade computes masses and contact
stiffnesses by itself.
"""

from __future__ import annotations

from collections.abc import Sequence

from hertzchain.engines.external.terms import positions, refuse_long, wall_material, wall_position
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


def parameters(scene: Scene) -> str:
    """Return the part for each granule at its start position: touching, apart or pressed.

    RunFailed for a scene whose script would be too long.
    """
    count, each = scene.chain.granules, scene.granules
    refuse_long("a script for Yade with", scene)
    columns = each.radius, each.young_modulus, each.poisson_ratio, each.density
    rows = zip(positions(scene), *(column.tolist() for column in columns), strict=True)
    lines = "\n".join(f"    {row!r}," for row in rows)
    law = "" if scene.contact is None else _RESTITUTION.format(scene.contact.restitution)
    return f"""\
granules = {count}
# Of each granule: position [m], radius [m], Young's modulus [Pa], Poisson's ratio, and density
# [kg/m^3].
rows = [
{lines}
]
start_velocity = np.zeros(granules)
start_velocity[0] = {scene.start_velocity!r}  # m/s{law}"""


_RESTITUTION = """
restitution = {!r}  # of two spheres whose contact pulls as it opens; this one does not
log_e = np.log(restitution)
betan = float(-np.sqrt(5 / 6) * log_e / np.hypot(np.pi, log_e))"""


BODIES = """
for x, radius, young_modulus, poisson_ratio, density in rows:
    material = FrictMat(
        young=young_modulus, poisson=poisson_ratio, density=density, frictionAngle=0.0
    )
    O.bodies.append(sphere((x, 0, 0), radius, material=material))
"""


def loops(scene: Scene) -> tuple[str, str, str, str]:
    """Return additions to Yade's engines for terms: bounds, geometry, law and constant forces.

    Each text follows the one for spheres.
    """
    bounds = geometry = law = loads = ""
    if scene.wall is not None:
        bounds, geometry = ", Bo1_Wall_Aabb()", ", Ig2_Wall_Sphere_ScGeom()"
        law = "neverErase=True"  # the contact with the wall exists from the start
    pressed = scene.precompression
    if pressed is not None and pressed.gravity:
        loads += f"    GravityEngine(gravity=({pressed.gravity!r}, 0, 0)),\n"
    if pressed is not None and pressed.force:
        loads += f"    ForceEngine(force=({pressed.force!r}, 0, 0), ids=[0]),\n"
        if scene.wall is None:
            loads += f"    ForceEngine(force=({-pressed.force!r}, 0, 0), ids=[granules - 1]),\n"
    return bounds, geometry, law, loads


def damping(scene: Scene) -> tuple[str, str]:
    """Return the arguments of Yade's contact physics, and a comment on them."""
    if scene.contact is None:
        return "", "no damping"
    return "betan=betan", "damped, and never pulling"


def piston(legs: Sequence[Leg], rows_each: int) -> tuple[str, str]:
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


def wall(scene: Scene) -> str:
    """Part that adds the wall and its contact with the last granule; needs the engines."""
    if scene.wall is None:
        return ""
    modulus, poisson = wall_material(scene)
    return f"""
plane = O.bodies.append(wall(
    {wall_position(scene)!r}, axis=0, sense=-1,
    material=FrictMat(young={modulus!r}, poisson={poisson!r}, density=1.0, frictionAngle=0.0),
))
contact = createInteraction(plane, granules - 1)
# Yade takes R/2 for 1/(1/R + 1/R), as if the wall were a sphere like the granule. It is a plane:
# R* is R, and the stiffness goes as the root of it.
contact.phys.kno *= 2**0.5
"""
