"""Traps that one command shows: a table of patterns; laws of damping by their numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass

from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.damping import BEFORE_ROOT_2
from hertzchain.engines.lammps.reading.text import number
from hertzchain.examiner.lint.deck import CLASSIC, Deck, Found, Severity

_HERTZ = f"pair_coeff * * {dialect.hertz('E', 'nu')} {dialect.NO_FRICTION}"

_HOOKE = (
    "{law} is a linear spring, not Hertz's law: there are no solitary waves in it (with a stiffness"
    " of 1e7 N/m the tenth peak is 88 instead of 158 N); take hertz/material, or gran/hertz/history"
)

_ZERO = r"[+-]?0*\.?0*(?:e\S*)?"
_FIX, _LAW = r"\S+ \S+ ", r"\S+ \S+ (?:granular )?"


@dataclass(frozen=True)
class Trap:
    """A trap in one command."""

    rule: str  # name of the finding
    severity: Severity
    command: str  # name of the command
    pattern: str  # of the beginning of its words, joined by single blanks
    sentence: str  # ``{names}`` stand for the groups of the pattern
    of_any: bool = False  # whether it also applies to decks that are no chains

    def found_in(self, deck: Deck) -> Found:
        """The commands of a deck with this trap; laws of LIGGGHTS have other numbers."""
        if (deck.no_chain and not self.of_any) or (deck.is_of_liggghts and self.rule in _OF_LAWS):
            return
        for command in deck.named(self.command):
            found = re.match(self.pattern, f"{' '.join(command.words[1:])} ")
            if found is not None:
                yield command, self.severity, self.sentence.format(**found.groupdict())


_OF_LAWS = {"not-hertz", "wall", "tangential"}

TRAPS = (
    Trap("thermostat", "error", "fix",
         _FIX + r"(?P<style>(?:nvt|npt|nph|langevin|temp/|nve/limit|press/)\S*)",
         "fix {style} changes velocities by something else than forces, and the wave with them: fix"
         " nve is all that a chain needs"),
    Trap("random-velocities", "error", "velocity", r"(?P<group>\S+) create (?P<kelvin>\S+)",
         "granules of group {group} start with random velocities of temperature {kelvin}, in all"
         " directions: a chain starts at rest (leave the command out), a striker with velocity"
         " first set V 0 0 units box"),
    Trap("force-in-steps", "error", "fix",
         _FIX + r"addforce \S+ \S+ \S+ (?:.* )?every (?P<count>[2-9]|\d\d+)(?: |$)",
         "with every {count} the force is there at one of {count} steps only: the granule gets"
         " 1/{count} of the momentum; leave the words out", of_any=True),
    Trap("not-hertz", "error", "pair_style", r"(?:hybrid\S* .*)?(?P<law>gran/hooke\S*)", _HOOKE),
    Trap("not-hertz", "error", "pair_coeff", _LAW + r"(?P<law>hooke) ", _HOOKE),
    Trap("not-hertz", "warning", "pair_coeff",
         _LAW + rf"(?P<law>jkr|dmt) \S+ \S+ \S+ (?!{_ZERO} )(?P<cohesion>\S+) ",
         "{law} adds cohesion to Hertz's law ({cohesion}; 0.1 J/m^2 moved peaks of about 150 N by"
         " 0.1 %): hertz/material has none"),
    Trap("not-hertz", "warning", "pair_coeff", _LAW + "mdr ",
         "mdr is an elastic-plastic law, not Hertz's: hertz/material is elastic"),
    Trap("tangential", "warning", "pair_style",
         rf"(?:hybrid\S* .*)?gran/h(?:ooke|ertz)/history\S* \S+ {_ZERO} ",
         "Kt = 0: where granules slide LAMMPS divides by it; write NULL (2/7 of Kn) and a friction"
         " of 0.0 as the fifth number, which takes the tangential force away", of_any=True),
    Trap("wall", "error", "fix",
         _FIX + rf"wall/gran\S* (?P<law>hertz|hooke)/history \S+ \S+ {_ZERO} ",
         "wall/gran {law}/history with gamma_n = 0 makes positions NaN at the first touch"
         f" ({dialect.WALL_IS_NAN}): write wall/gran granular hertz K 0.0 {dialect.NO_FRICTION}"
         " with K = 4/3 E*", of_any=True),
    Trap("wall", "warning", "fix", _FIX + r"wall/gran\S* granular hertz/material ",
         "this wall is an elastic half-space of its material, no rigid wall, and LAMMPS of 2021 and"
         " 2022 makes it 1 + nu times too stiff: give the stiffness itself, granular hertz K with"
         " K = 4/3 E*"),
)  # fmt: skip


def not_hertz(deck: Deck) -> Found:
    """Pair styles that are not for granules."""
    style = deck.pair_style
    if style is None:
        if deck.runs and not deck.is_partial:
            text = (
                "there is no pair style: granules do not feel one another; write pair_style"
                f" granular and {_HERTZ}"
            )
            yield deck.runs[0], "error", text
    elif not (deck.is_granular or deck.is_of_liggghts) and "$" not in style.word(1):
        text = (
            f"pair_style {style.word(1)} is no contact of spheres: Hertz's law is pair_style"
            f" granular with {_HERTZ}"
        )
        yield style, "error", text


# ---- Damping

_NO_DAMPING = 1e-100  # numbers up to this count as 0, in all units (chosen)
_UNDAMPED = "leave the damping out and give 0.0 there, which damps nothing"


def damping(deck: Deck) -> Found:
    """Hertz's law itself has no damping."""
    for law in deck.laws:
        kind, value = law.command.after("damping"), number(law.numbers[1])
        if law.normal == "mdr" or value is None:
            continue
        number_of = f"the second number of {law.normal}"
        if kind in ("tsuji", "coeff_restitution") and value == 0:
            what = "the tenth peak loses 73 %" if kind == "tsuji" else "positions become NaN"
            text = (
                f"with damping {kind} {number_of} is a coefficient of restitution: 0 damps the most"
                f" ({what}), it does not switch damping off; {_UNDAMPED}"
            )
            yield law.command, "error", text
        elif kind == "tsuji":
            text = (
                f"damping tsuji with {value:g} gives another restitution than that, and another in"
                f" LAMMPS {BEFORE_ROOT_2} than in later ones (1 lowers peaks by up to 0.2 %):"
                f" coeff_restitution gives its number since 29 Aug 2024; without any, {_UNDAMPED}"
            )
            yield law.command, "note" if deck.no_chain else "warning", text
        elif abs(value) > _NO_DAMPING and (kind, value) != ("coeff_restitution", 1):
            if deck.no_chain:
                continue
            what = "gamma_n" if law.normal in CLASSIC else number_of
            text = (
                f"{what}, {law.numbers[1]}, damps the contacts: energy is lost, and peaks are lower"
                " than those of Hertz's law; 0.0 damps nothing"
            )
            yield law.command, "note", text


def attraction(deck: Deck) -> Found:
    """Without a limit, damping pulls as a contact opens."""
    text = (
        "damping without limit_damping makes contacts pull as they open, which dry granules cannot:"
        " write limit_damping at the end of this command (LAMMPS since 29 Sep 2021)"
    )
    for law in deck.laws:
        value = number(law.numbers[1])
        known = law.normal in ("hooke", "hertz", "hertz/material", *CLASSIC)
        damps = value is not None and abs(value) > _NO_DAMPING
        if known and damps and not {"none", "limit_damping"} & set(law.command.words):
            yield law.command, "note" if deck.no_chain else "warning", text


_SMALL = 1e-2  # a Poisson's ratio that no material of granules has (chosen)


def poisson_ratio(deck: Deck) -> Found:
    """The order of the numbers is E, damping, Poisson's ratio."""
    for law in deck.laws:
        damping, poisson = number(law.numbers[1]), number(law.numbers[-1])
        if law.normal != "hertz/material" or poisson is None or damping is None:
            continue
        impossible = not -1 < poisson <= 0.5
        if impossible or (abs(poisson) < _SMALL and 0 < damping <= 0.5):
            text = (
                f"the numbers of {law.normal} are E, damping, Poisson's ratio, in this order: here"
                f" the ratio is {poisson:g} and the damping {damping:g}"
            )
            yield law.command, "error" if impossible else "warning", text


RULES = not_hertz, damping, attraction, poisson_ratio
