"""Restitution that damping options of LAMMPS, LIGGGHTS and Yade give: formulas and simulations."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator

from hertzchain.engines.lammps.dialect import tsuji
from hertzchain.theory.restitution import (
    DASHPOT,
    VISCOELASTIC,
    collision_of,
    damping_ratio,
    of_natural,
    of_ratio,
)
from validation.physics import collisions
from validation.physics.collisions import SCENE, Deck, Option, Parted
from validation.rows import Row, row
from validation.script import Script, rows_only

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
                rows += measured(option, collisions.deck, collisions.by_lammps, quick)
        elif not quick and shutil.which(option.code.lower()):
            rows += measured(option, *OTHERS[option.code], quick)
    return rows


OTHERS: dict[str, tuple[Deck, Parted]] = {
    "LIGGGHTS": (collisions.liggghts_deck, collisions.by_liggghts),
    "Yade": (collisions.yade_script, collisions.by_yade),
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
