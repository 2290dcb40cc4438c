"""Restitution that damping options of LAMMPS give: formulas and simulations."""

from __future__ import annotations

import math
from collections.abc import Iterator

import hertzchain as hc
from hertzchain.engines.lammps.dialect import NO_FRICTION, tsuji
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.theory.restitution import (
    DASHPOT,
    VISCOELASTIC,
    Collision,
    damping_ratio,
    of_natural,
    of_ratio,
)
from validation.physics.chains import steel
from validation.script import Row, Script, row, table_of

SCENE = hc.Scene(steel(2), hc.Striker(1.0, radius=6e-3))
"""Spheres of two sizes, so that m* and R* count."""

SPHERES = Collision(float(SCENE.granules.contact_mass[0]), float(SCENE.granules.stiffness[0]), 1.0)

_LONGEST = 8.0
"""Natural time units after which the spheres have parted, for restitutions above 0.3; 2.9 of an
undamped collision, 4.4 measured."""

_STEP = 2e-4
"""Step of LAMMPS in natural time units."""


def parted_by_lammps(option: str, number: float) -> float:
    """Speed at which the spheres part under a damping option and its number, by LAMMPS [m/s]."""
    collision, each = SPHERES, SCENE.granules
    (first, other), widest = each.radius.tolist(), 4 * float(each.radius.max())
    modulus, poisson = float(each.young_modulus[0]), float(each.poisson_ratio[0])
    law = f"hertz/material {modulus!r} {number!r} {poisson!r} {NO_FRICTION} {option}"
    deck = f"""\
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
timestep {_STEP * collision.length / collision.velocity!r}
run {round(_LONGEST / _STEP)}
variable parting equal vx[2]-vx[1]
"""
    with engine() as instance:
        command(instance, deck)
        return float(instance.extract_variable("parting"))


PARTED = {0.9: 0.9020261, 0.8: 0.8080993, 0.7: 0.7182014, 0.5: 0.5502832, 0.3: 0.3971405}
"""Restitution law, contacts do not pull: input, and restitution by an independent integration."""

KUWABARA_KONO = {
    (0.01, True): 0.98287613, (0.01, False): 0.98288329,
    (0.1, True): 0.84333941, (0.1, False): 0.84514381,
}  # fmt: skip
"""The same of viscoelastic spheres, by A in natural units, and whether contacts pull."""

_DIGIT = "half a unit of the last digit that is known"

_ENGINE = (
    "steps of 2e-4 natural time units are off by 2.4e-5 at most, as forces take the velocity of"
    " half a step before: an error of first order"
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
    fit = sum(c * en**power for power, c in enumerate(_THORNTON, start=1))
    return math.sqrt(max(0.0, 1 / (1 - (1 + en) ** 2 * math.exp(fit)) - 1))


COEFFICIENTS = {
    "damping velocity": (28.6674, 83.592),
    "damping velocity limit_damping": (31.521, 106.301),
    "damping mass_velocity": (12005.9, 35008.3),
    "damping mass_velocity limit_damping": (13201.0, 44518.7),
    "damping viscoelastic": (1.18515e8, 3.76433e8),
    "damping viscoelastic limit_damping": (1.20854e8, 4.19423e8),
}
"""Coefficients with which the spheres of ``SCENE`` part with 0.8 and 0.5 [kg/s, 1/s, 1/(m s)]."""

OPTIONS = (
    "damping tsuji",
    "damping tsuji limit_damping",
    "damping coeff_restitution",
    "damping coeff_restitution limit_damping",
    *COEFFICIENTS,
)


def restitutions(option: str) -> dict[float, float]:
    """Return the restitutions that theory gives for two numbers of an option."""
    pulls, spheres = "limit" not in option, SPHERES
    if "tsuji" in option:  # of LAMMPS before 2 Sep 2026
        return {e: of_ratio(tsuji(e, root_2=False) / 5**0.5, pulls) for e in (0.8, 0.5)}
    if option not in COEFFICIENTS:
        return {e: of_ratio(damping_ratio(e), pulls) for e in (0.8, 0.5)}
    exponent = VISCOELASTIC if "viscoelastic" in option else DASHPOT
    unit = {
        "velocity": 1.0,
        "mass_velocity": spheres.mass,
        "viscoelastic": spheres.mass * float(SCENE.granules.contact_radius[0]) ** 0.5,
    }[option.split()[1]] / spheres.unit(exponent)
    return {number: of_natural(number * unit, exponent, pulls) for number in COEFFICIENTS[option]}


def compare(quick: bool, with_lammps: bool) -> Iterator[Row]:
    """Yield rows of closed forms and LAMMPS; the quick form has one number of each option."""
    for input_, expected in PARTED.items():
        what, e = (
            f"{input_:g} asked for, contacts do not pull",
            of_ratio(damping_ratio(input_), False),
        )
        yield row(what, "closed form", e, expected, 5e-8, _DIGIT)
    for (relaxation, pulls), expected in KUWABARA_KONO.items():
        what = f"viscoelastic, A = {relaxation:g}, contacts {'' if pulls else 'do not '}pull"
        e = of_natural(1.5 * relaxation, 0.5, pulls)
        yield row(what, "integral", e, expected, 5e-9, _DIGIT)
    for option in OPTIONS if with_lammps else ():
        for number, expected in list(restitutions(option).items())[: 1 if quick else 2]:
            e = parted_by_lammps(option, number) / SCENE.shock.start_velocity
            yield row(f"{option}, {number:.6g}", "lammps", e, expected, 1e-4, _ENGINE)


SCRIPTS = {
    "restitution": Script(
        "Restitution",
        "Do two spheres part with the restitution that is foretold for a damping option?",
        table_of(compare),
    )
}
