"""Restitution that damping options of LAMMPS, LIGGGHTS and Yade give: formulas and simulations.

The numbers of damping options that depend on the velocity are those that hertzchain would write.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator

from hertzchain.decks.restitution import OPTIONS, RESTITUTION, Option
from hertzchain.engines.lammps.damping import WITH_ROOT_2
from hertzchain.theory.restitution import collision_of, damping_ratio, of_natural, of_ratio
from validation.physics import collisions
from validation.physics.collisions import SCENE, Deck, Parted
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
            if with_lammps and option.versions != WITH_ROOT_2:
                rows += measured(option, collisions.lammps_deck, collisions.by_lammps, quick)
        elif not quick and shutil.which(option.code.lower()):
            rows += measured(option, *OTHERS[option.code], quick)
    return rows


OTHERS: dict[str, tuple[Deck, Parted]] = {
    "LIGGGHTS": (collisions.liggghts_deck, collisions.by_liggghts),
    "Yade": (collisions.yade_script, collisions.by_yade),
}


def measured(option: Option, deck: Deck, parted: Parted, quick: bool) -> Iterator[Row]:
    """Yield rows of an option for two numbers; the quick form leaves one out."""
    collision = collision_of(SCENE)
    for e in (0.8,) if quick else (0.8, 0.5):
        number = e if option.number == RESTITUTION else option.number_for(e, collision)
        expected = option.restitution(number, collision)
        found = parted(deck(option, number, STEPS[option.code])) / SCENE.shock.start_velocity
        what = f"{option.words}, {number:.6g}"
        yield row(what, option.code.lower(), found, expected, 1e-4, _ENGINE)


SCRIPT = Script(
    "Restitution",
    "Do two spheres part with the restitution that is foretold for a damping option?",
    "closed forms, SciPy; LAMMPS, LIGGGHTS, Yade",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
