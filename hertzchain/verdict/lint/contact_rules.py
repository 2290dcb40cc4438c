"""Rules of lint on contact laws: between granules, and with walls."""

from __future__ import annotations

import math

from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.damping import BEFORE_ROOT_2, tsuji
from hertzchain.verdict.lint.deck import CLASSIC, Deck, Found, Law, Severity
from hertzchain.verdict.lint.script import number, types_of

_NO_DAMPING = 1e-100  # a number up to this stands for 0, in all units (chosen)


def _damping(deck: Deck) -> Found:
    """Hertz's law itself has no damping."""
    for law in deck.laws:
        damping, word = law.command.after("damping"), law.numbers[1]
        value = number(word)
        if law.normal == "mdr":
            continue
        if value is not None and damping in ("tsuji", "coeff_restitution"):
            yield from _restitution(deck, law, damping, value)
        elif _damps(value) and not deck.no_chain:
            what = "gamma_n" if law.normal in CLASSIC else f"the second number of {law.normal}"
            text = (
                f"{what}, {word}, damps the contacts: energy is lost, and peaks are lower than"
                " those of Hertz's law; 0.0 damps nothing"
            )
            yield law.command, "note", text


def _damps(value: float | None) -> bool:
    """Whether a number damps: some write 1e-300 for 0, where LAMMPS would divide by it."""
    return value is not None and abs(value) > _NO_DAMPING


def _restitution(deck: Deck, law: Law, damping: str, value: float) -> Found:
    """Damping laws whose number is a coefficient of restitution."""
    undamped = "leave the damping out and give 0.0 there, which damps nothing"
    if value == 0:
        what = "the tenth peak loses 73 %" if damping == "tsuji" else "positions become NaN"
        text = (
            f"with damping {damping} the second number of {law.normal} is a coefficient of"
            f" restitution: 0 damps the most ({what}), it does not switch damping off; {undamped}"
        )
        yield law.command, "error", text
    elif value == 1 and damping == "tsuji":
        text = (
            "damping tsuji with a restitution of 1 still damps: its fitted polynomial is not 0"
            f" there (peaks are lower by up to 0.2 %); {undamped}"
        )
        yield law.command, "warning", text
    elif value != 1:
        text = (
            f"damping {damping} with a restitution of {value:g}: energy is lost, and peaks are"
            " lower than those of Hertz's law"
        )
        if not deck.no_chain:
            yield law.command, "note", text
        if damping == "tsuji" and 0 < value < 1:
            from hertzchain.theory.restitution import of_ratio  # loads NumPy

            pulls = "limit_damping" not in law.command.words
            given = of_ratio(tsuji(value, root_2=False) / math.sqrt(5), pulls)
            text = (
                f"damping tsuji with {value:g} gives a restitution of {given:.3g} in LAMMPS"
                f" {BEFORE_ROOT_2}, and another in later ones: hertzchain restitution {value:g}"
                " lists what to write"
            )
            yield law.command, "note" if deck.no_chain else "warning", text


def _attraction(deck: Deck) -> Found:
    """Damping that is not limited pulls as a contact opens."""
    text = (
        "damping without limit_damping makes contacts pull as they open, which dry granules cannot:"
        " write limit_damping at the end of this command (LAMMPS since 29 Sep 2021)"
    )
    severity: Severity = "note" if deck.no_chain else "warning"
    for law in deck.laws:
        words = law.command.words
        known = law.normal in ("hooke", "hertz", "hertz/material", *CLASSIC)
        if known and _damps(number(law.numbers[1])) and not {"none", "limit_damping"} & set(words):
            yield law.command, severity, text


_SMALL = 1e-2  # a Poisson's ratio that no material of granules has (chosen)


def _poisson_ratio(deck: Deck) -> Found:
    """The order of the numbers is E, damping, Poisson's ratio."""
    for law in deck.laws:
        if law.normal not in ("hertz/material", "dmt", "jkr"):
            continue
        damping, poisson = number(law.numbers[1]), number(law.numbers[2])
        if poisson is None or damping is None:
            continue
        order = f"the numbers of {law.normal} are E, damping, Poisson's ratio, in this order"
        if not -1 < poisson <= 0.5:
            yield law.command, "error", f"{order}: a Poisson's ratio of {poisson:g} is impossible"
        elif abs(poisson) < _SMALL and 0 < damping <= 0.5:
            text = (
                f"{order}: here the ratio is {poisson:g} and the damping {damping:g}; if they are"
                " exchanged, contacts are too soft, by 9 % for a ratio of 0.3"
            )
            yield law.command, "warning", text


def _tangential(deck: Deck) -> Found:
    """The stiffness of a classic tangential law is divided by."""
    style = deck.contact_style
    if style[:1] and style[0] in CLASSIC[1:] and number("".join(style[2:3])) == 0:
        text = (
            "Kt = 0: where granules slide LAMMPS divides by it; write NULL (2/7 of Kn) and a"
            " friction of 0.0 as the fifth number, which takes the tangential force away"
        )
        yield deck.pair_style, "warning", text


def _mixed_pairs(deck: Deck) -> Found:
    """Pairs of two types that LAMMPS mixes by itself."""
    if deck.pair_style is None or deck.pair_style.word(1) != "granular" or deck.is_partial:
        return
    types = [number(box.word(1)) for box in deck.named("create_box")]
    if len(types) != 1 or types[0] is None or not 2 <= types[0] <= _MOST_TYPES:
        return
    count = int(types[0])
    given: set[tuple[int, int]] = set()
    for command in deck.named("pair_coeff"):
        first, second = types_of(command.word(1), count), types_of(command.word(2), count)
        if not first or not second:
            return
        given |= {(min(i, j), max(i, j)) for i in first for j in second}
    missing = [(i, j) for i in range(1, count + 1) for j in range(i, count + 1)]
    missing = [pair for pair in missing if pair not in given and pair[0] != pair[1]]
    laws = [law.command for law in deck.laws if law.command.name == "pair_coeff"]
    if missing and laws:
        i, j = missing[0]
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        text = (
            f"there is no pair_coeff {i} {j}{more}: LAMMPS mixes the laws of both types, and those"
            " of 2021 and 2022 leave out the contact radius (an overlap of 1 um of granules of 9.5"
            f" mm presses 20,000 times too hard); write pair_coeff {i} {j} ... as for one type"
        )
        yield laws[-1], "warning", text


_MOST_TYPES = 100  # a deck with more is not examined pair by pair


def _wall(deck: Deck) -> Found:
    """Walls of granules."""
    for wall in deck.fixes("wall/gran", "wall/gran/region"):
        law = wall.word(5)
        if wall.word(4) == "hertz/history" and number(wall.word(7)) == 0:
            text = (
                "wall/gran hertz/history with gamma_n = 0 makes positions NaN at the first touch"
                f" ({dialect.WALL_IS_NAN}): write wall/gran granular hertz K 0.0"
                f" {dialect.NO_FRICTION} with K = 4/3 E*"
            )
            yield wall, "error", text
        elif wall.word(4) == "granular" and law != "hertz" and not deck.no_chain:
            text = (
                "a wall of this law is an elastic half-space of the given material, no rigid wall:"
                " for a rigid one give it twice the Young's modulus, and the Poisson ratio, of the"
                " granule that touches it"
            )
            yield wall, "note", text
            if law == "hertz/material":
                yield wall, "warning", _WALL_OF_MATERIAL


_WALL_OF_MATERIAL = (
    "LAMMPS of 2021 and 2022 makes this wall 1 + nu times too stiff: give the stiffness itself,"
    " granular hertz K with K = 4/3 E*"
)


def _not_hertz(deck: Deck) -> Found:
    """Laws between granules that are not Hertz's."""
    style = deck.pair_style
    if style is None:
        if deck.runs and not (deck.is_partial or deck.no_chain):
            text = (
                "there is no pair style: granules do not feel one another; write pair_style"
                f" granular and {_HERTZ}"
            )
            yield deck.runs[0], "error", text
        return
    name = deck.contact_style[0] if deck.is_granular else style.word(1)
    if deck.no_chain:
        return
    if not deck.is_granular and "$" not in name:
        text = (
            f"pair_style {name} is no contact of spheres: Hertz's law is pair_style granular with"
            f" {_HERTZ}"
        )
        yield style, "error", text
    elif name.startswith("gran/hooke"):
        yield style, "error", _HOOKE.format(name)
    for law in deck.laws:
        if law.command.name != "pair_coeff":
            continue
        if law.normal == "hooke":
            yield law.command, "error", _HOOKE.format("hooke")
        elif law.normal in ("dmt", "jkr"):
            cohesion = law.numbers[3]
            if law.normal == "jkr" or number(cohesion) != 0:
                text = (
                    f"{law.normal} adds cohesion to Hertz's law ({cohesion}; 0.1 J/m^2 moved peaks"
                    " of about 150 N by 0.1 %): hertz/material has none"
                )
                yield law.command, "warning", text
        elif law.normal == "mdr":
            text = "mdr is an elastic-plastic law, not Hertz's: hertz/material is elastic"
            yield law.command, "warning", text


_HERTZ = f"pair_coeff * * {dialect.hertz('E', 'nu')} {dialect.NO_FRICTION}"


_HOOKE = (
    "{} is a linear spring, not Hertz's law: there are no solitary waves in it (with a stiffness"
    " of 1e7 N/m the tenth peak is 88 instead of 158 N); take hertz/material, or gran/hertz/history"
)


RULES = (
    _not_hertz, _damping, _attraction, _poisson_ratio, _tangential,
    _mixed_pairs, _wall,
)  # fmt: skip
