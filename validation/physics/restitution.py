"""Restitution that damping options of LAMMPS, LIGGGHTS and Yade give: formulas and simulations."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import hertzchain as hc
from hertzchain.engines.external.program import find_program, run_program, work_folder
from hertzchain.engines.lammps.dialect import NO_FRICTION, tsuji
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.theory.restitution import (
    DASHPOT,
    VISCOELASTIC,
    collision_of,
    damping_ratio,
    of_natural,
    of_ratio,
)
from validation.physics.chains import steel
from validation.script import Row, Script, row, rows_only

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


PARTED = {0.9: 0.9020261, 0.8: 0.8080993, 0.7: 0.7182014, 0.5: 0.5502832, 0.3: 0.3971405}
"""Restitution law, contacts do not pull: what is asked for, and what an independent integration
has."""

KUWABARA_KONO = {
    (0.01, True): 0.98287613, (0.01, False): 0.98288329,
    (0.1, True): 0.84333941, (0.1, False): 0.84514381,
}  # fmt: skip
"""The same of viscoelastic spheres, by A in natural units, and whether contacts pull."""

_DIGIT = "half a unit of the last digit that is known"

STEPS = {"LAMMPS": 2e-4, "LIGGGHTS": 1e-3, "Yade": 1e-3}
"""Steps in natural time units."""

_ENGINE = (
    "steps of 2e-4 natural time units (LIGGGHTS and Yade: 1e-3) are off by 2.4e-5 at most, as"
    " forces take the velocity of half a step before: an error of first order"
)


BETAN_PER_RATIO = math.sqrt(5 / 6)
"""Yade's ``betan``, of eta = 2 betan sqrt(3/2 m* k) d^(1/4), over the damping ratio alpha / sqrt(5)
of eta = alpha sqrt(m* k) d^(1/4)."""

_THORNTON = (
    *(-6.918798, -16.41105, 146.8049, -796.4559, 2928.711),
    *(-7206.864, 11494.29, -11342.18, 6276.757, -1489.915),
)
"""Coefficients of a fit for contacts that do not pull, first power first: Thornton, Cummins and
Cleary, Powder Technology 233 (2013) 30.
"""


def betan(en: float) -> float:
    """Return the ``betan`` that Yade computes from ``en``."""
    if en == 1:
        return 0.0
    fit = sum(c * en**power for power, c in enumerate(_THORNTON, start=1))
    return math.sqrt(max(0.0, 1 / (1 - (1 + en) ** 2 * math.exp(fit)) - 1))


def _ratios(option: Option) -> dict[float, float]:
    """Return alpha / sqrt(5) by the numbers of an option that takes a restitution."""
    asked = (0.8, 0.5)
    if "tsuji" in option.words:  # of LAMMPS before 2 Sep 2026
        return {e: tsuji(e, root_2=False) / 5**0.5 for e in asked}
    if option.words == "betan":
        return {number: number / BETAN_PER_RATIO for number in (0.0678766, 0.233034)}
    if option.words == "en":
        return {e: betan(e) / BETAN_PER_RATIO for e in asked}
    return {e: damping_ratio(e) for e in asked}


def _naturals(option: Option) -> tuple[float, dict[float, float]]:
    """Return the exponent q and c in natural units by the numbers of an option, a coefficient."""
    spheres = collision_of(SCENE)
    exponent = VISCOELASTIC if "viscoelastic" in option.words else DASHPOT
    unit = {
        "velocity": 1.0,
        "mass_velocity": spheres.mass,
        "viscoelastic": spheres.mass * float(SCENE.granules.contact_radius[0]) ** 0.5,
    }[option.words.split()[1]] / spheres.unit(exponent)
    return exponent, {number: number * unit for number in COEFFICIENTS[option.words]}


def restitutions(option: Option) -> dict[float, float]:
    """Return the restitutions that theory gives for two numbers of an option."""
    if option.words in COEFFICIENTS:
        exponent, naturals = _naturals(option)
        return {
            number: of_natural(natural, exponent, option.pulls)
            for number, natural in naturals.items()
        }
    return {number: of_ratio(ratio, option.pulls) for number, ratio in _ratios(option).items()}


COEFFICIENTS = {
    "damping velocity": (28.6674, 83.592),
    "damping velocity limit_damping": (31.521, 106.301),
    "damping mass_velocity": (12005.9, 35008.3),
    "damping mass_velocity limit_damping": (13201.0, 44518.7),
    "damping viscoelastic": (1.18515e8, 3.76433e8),
    "damping viscoelastic limit_damping": (1.20854e8, 4.19423e8),
}
"""Coefficients of LAMMPS with which the spheres of ``SCENE`` part with 0.8 and 0.5 [kg/s, 1/s,
1/(m s)]."""

OPTIONS = (
    Option("LAMMPS", "damping tsuji", True),
    Option("LAMMPS", "damping tsuji limit_damping", False),
    Option("LAMMPS", "damping coeff_restitution", True),
    Option("LAMMPS", "damping coeff_restitution limit_damping", False),
    Option("LIGGGHTS", "coefficientRestitution", True),
    Option("LIGGGHTS", "coefficientRestitution, limitForce on", False),
    Option("Yade", "en", False),
    Option("Yade", "betan", False),
    *(Option("LAMMPS", words, "limit" not in words) for words in COEFFICIENTS),
)


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows of closed forms and LAMMPS; in the whole form also of the other codes that are here."""
    rows = [
        row(f"{asked:g} asked for, contacts do not pull", "closed form",
            of_ratio(damping_ratio(asked), False), given, 5e-8, _DIGIT)
        for asked, given in PARTED.items()
    ]  # fmt: skip
    for (relaxation, pulls), given in KUWABARA_KONO.items():
        what = f"viscoelastic, A = {relaxation:g}, contacts {'' if pulls else 'do not '}pull"
        e = of_natural(1.5 * relaxation, 0.5, pulls)
        rows.append(row(what, "integral", e, given, 5e-9, _DIGIT))
    for option in OPTIONS:
        if option.code == "LAMMPS":
            if with_lammps:
                rows += measured(option, deck, by_lammps, quick)
        elif not quick and shutil.which(option.code.lower()):
            rows += measured(option, *OTHERS[option.code], quick)
    return rows


OTHERS: dict[str, tuple[Deck, Parted]] = {
    "LIGGGHTS": (liggghts_deck, by_liggghts),
    "Yade": (yade_script, by_yade),
}


def measured(option: Option, deck: Deck, parted: Parted, quick: bool) -> Iterator[Row]:
    """Yield rows of an option for two numbers; the quick form leaves one out."""
    for number, expected in list(restitutions(option).items())[: 1 if quick else 2]:
        measured = parted(deck(option, number, STEPS[option.code])) / SCENE.shock.start_velocity
        what = f"{option.words}, {number:.6g}"
        yield row(what, option.code.lower(), measured, expected, 1e-4, _ENGINE)


SCRIPT = Script(
    "Restitution",
    "Do two spheres part with the restitution that is foretold for a damping option?",
    "closed forms, SciPy; LAMMPS, LIGGGHTS, Yade",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
