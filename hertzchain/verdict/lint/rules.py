"""Known traps in somebody's LAMMPS deck of a chain, named by line: a function for each in `RULES`.

What cannot be known without running the deck is None, and no finding. The numbers in the sentences
were measured on 30 steel spheres, pushed by 100 N for 100 us (LAMMPS 22 Jul 2025), as
`tests/verdict/lint/test_lint.py` does again.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.damping import BEFORE_ROOT_2, tsuji
from hertzchain.errors import HertzchainError
from hertzchain.files import read_bytes
from hertzchain.verdict.lint.arithmetic import number
from hertzchain.verdict.lint.chain import Chain
from hertzchain.verdict.lint.chain_rules import CHAIN_RULES
from hertzchain.verdict.lint.contacts import NO_DAMPING
from hertzchain.verdict.lint.deck import TOUCHING, Deck, Law, Push, Run
from hertzchain.verdict.lint.finding import Finding, Found, Severity
from hertzchain.verdict.lint.included import whole
from hertzchain.verdict.lint.script import Command, parse

MOST_BYTES = 5_000_000  # of a deck: more are not written by hand


def _density_before_diameter(deck: Deck) -> Found:
    """The mass is made when the density is set, with the diameter of that moment."""
    pending: Command | None = None
    last = max((command.place for command, _ in deck.given("density")), default=-1)
    for command in deck.named("set"):
        density, diameter = command.after("density"), command.after("diameter")
        words = command.words
        if density is not None and (
            diameter is None or words.index("density") > words.index("diameter")
        ):
            pending = command if diameter is None else None
        elif density is not None:
            yield command, "error", _DENSITY
            pending = None
        elif diameter is not None and pending is not None:
            covers = pending.words[1:3] == words[1:3] or "all" in (words[2], pending.words[2])
            if covers and last < command.place:
                yield pending, "error", _DENSITY
            pending = None


_DENSITY = (
    "the density is set before the diameter, so that granules keep the mass that the old diameter"
    " made (1e6 times too large for a radius of 5 mm, and only the first one moves): set the"
    " diameter first, then the density"
)


def _diameter_missing(deck: Deck) -> Found:
    """Granules that are created have diameter 1 and density 1."""
    created = deck.named("create_atoms")
    brought = deck.named("read_data", "molecule") or deck.is_partial
    if not created or brought or not deck.is_granular:
        return
    given = {word for command in deck.named("set") for word in command.words}
    if "diameter" not in given:
        text = (
            "no diameter is set: granules that are created have diameter 1 in the units of the"
            " deck; write set group all diameter ..., then density ..."
        )
        yield created[0], "error", text
    elif not {"density", "mass"} & given:
        text = (
            "no density is set: granules keep the mass 0.5236 that diameter 1 and density 1 made,"
            " whatever their diameter is now; write set group all density ... after the diameter"
        )
        yield created[0], "error", text


def _mass_set(deck: Deck) -> Found:
    """A mass that is set takes the place of that of the density."""
    for command, _ in deck.given("mass"):
        text = "this mass takes the place of 4/3 pi R^3 density: leave it out, or the density"
        yield command, "warning", text


def _ghost_velocity(deck: Deck) -> Found:
    """Contact laws of granules ask for the velocities of ghosts."""
    wanted = [command.after("vel") == "yes" for command in deck.named("comm_modify")]
    wanted += [command.after("vel") == "yes" for command in deck.named("communicate")]
    if deck.is_granular and not any(wanted) and not deck.is_partial:
        text = (
            "comm_modify vel yes is missing: pair styles of granules need the velocities of ghost"
            " granules, and LAMMPS stops at the first run; write it before the pair style"
        )
        yield deck.pair_style, "error", text


def _skin(deck: Deck) -> Found:
    """The skin is a length, and its default belongs to the units, not to the granules."""
    if deck.diameter is None or deck.diameter <= 0 or not deck.is_granular or deck.is_partial:
        return
    given = [command for command in deck.named("neighbor") if len(command.words) > 1]
    skin = deck.skin
    where = given[-1] if given else deck.first_run
    if skin is None or where is None:
        return
    radius = deck.diameter / 2
    origin = "the skin is" if given else f"without a neighbor command the skin is {deck.units}'s"
    wanted = f"write neighbor {radius / 2:.3g} bin, half a radius"
    if skin >= 2 * radius:
        text = (
            f"{origin} {skin:g}, {skin / radius:.3g} radii: {1 + skin / deck.diameter:.4g} granules"
            " ahead count as neighbours instead of 1 (a chain with R = 50 um at the default of"
            f" 1 mm: steps take twice as long); {wanted}"
        )
        yield where, "warning", text
    elif skin < radius / 1000:
        text = (
            f"{origin} {skin:g}, {skin / radius:.1g} of a radius: neighbours are looked for again"
            f" nearly every step (steps take up to four times as long); {wanted}"
        )
        yield where, "warning", text


def _neighbours(deck: Deck) -> Found:
    """Neighbour lists that are built too often, or leave contacts out."""
    if not deck.is_granular:
        return
    for command in deck.named("neigh_modify"):
        if "exclude" in command.words:
            text = (
                "neigh_modify exclude takes contacts away: granules of the excluded pairs pass"
                " through one another; leave it out of a chain"
            )
            yield command, "warning", text
        if command.after("check") == "no":
            text = (
                "check no builds the neighbour list whether or not a granule has moved (every 10"
                " steps: they take up to three times as long), and misses contacts where one has"
                " moved further than half the skin; write neigh_modify delay 0 every 1 check yes"
            )
            yield command, "note", text


def _damping(deck: Deck) -> Found:
    """Hertz's law itself has no damping."""
    for law in deck.laws:
        damping, word = law.command.after("damping"), law.numbers[1]
        value = number(word)
        if law.normal == "mdr":
            continue
        if damping == "none":
            text = (
                f"damping none is an error in LAMMPS {dialect.NO_DAMPING_NONE}: leave the word out"
                f" and give 0.0 as the second number of {law.normal}, which damps nothing"
            )
            yield law.command, "error", text
        elif value is not None and damping in ("tsuji", "coeff_restitution"):
            yield from _restitution(law, damping, value, "note" if deck.is_heap else "warning")
        elif _damps(value):
            text = (
                f"the second number of {law.normal}, {word}, damps the contacts: energy is lost,"
                " and peaks are lower than those of Hertz's law; 0.0 damps nothing"
            )
            yield law.command, "note", text
    style = deck.pair_style
    classic = style is not None and style.words[1].startswith("gran/") and len(style.words) > 4
    if style is not None and classic and _damps(number(style.words[4])):
        text = (
            f"gamma_n = {style.words[4]} damps the contacts: energy is lost, and peaks are"
            " lower than those of Hertz's law; 0.0 damps nothing"
        )
        yield style, "note", text


def _damps(value: float | None) -> bool:
    """Whether a number damps: some write 1e-300 for 0, where LAMMPS would divide by it."""
    return value is not None and abs(value) > NO_DAMPING


def _restitution(law: Law, damping: str, value: float, other: Severity) -> Found:
    """Damping laws whose number is a coefficient of restitution; ``other``: it gives another."""
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
            "damping tsuji with a restitution of 1 is not zero: its fitted polynomial leaves some"
            f" (peaks are lower by up to 0.2 %); {undamped}"
        )
        yield law.command, "warning", text
    elif value != 1:
        text = (
            f"damping {damping} with a restitution of {value:g}: energy is lost, and peaks are"
            " lower than those of Hertz's law"
        )
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
            yield law.command, other, text


def _attraction(deck: Deck) -> Found:
    """Damping that is not limited pulls as a contact opens."""
    text = (
        "damping without limit_damping makes contacts pull as they open, which dry granules cannot:"
        " write limit_damping at the end of this command (LAMMPS since 29 Sep 2021)"
    )
    severity: Severity = "note" if deck.is_heap else "warning"
    for law in deck.laws:
        words = law.command.words
        known = law.normal in ("hooke", "hertz", "hertz/material")
        if known and _damps(number(law.numbers[1])) and not {"none", "limit_damping"} & set(words):
            yield law.command, severity, text
    style = deck.pair_style
    if style is None or not style.words[1].startswith("gran/") or len(style.words) < 5:
        return
    if _damps(number(style.words[4])) and "limit_damping" not in style.words:
        yield style, severity, text


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
            yield law.command, "error", f"{order}: a Poisson's ratio of {poisson:g} cannot be"
        elif poisson == 0 and 0 < damping <= 0.5:
            text = (
                f"{order}: here the ratio is 0 and the damping {damping:g}; if they are in each"
                " other's place, contacts are too soft, by 9 % for a ratio of 0.3"
            )
            yield law.command, "warning", text


def _tangential(deck: Deck) -> Found:
    """A tangential law has to be named, and its stiffness is divided by."""
    for law in deck.laws:
        if "tangential" not in law.command.words:
            text = (
                "the tangential law is missing, which is an error: without friction it is"
                f" {dialect.NO_FRICTION}"
            )
            yield law.command, "error", text
    style = deck.pair_style
    if style is not None and style.words[1] in ("gran/hertz/history", "gran/hooke/history"):
        given = style.words[3] if len(style.words) > 3 else None
        if number(given) == 0:
            text = (
                "Kt = 0: where granules slide LAMMPS divides by it; write NULL (2/7 of Kn) and a"
                " friction of 0.0 as the fifth number, which takes the tangential force away"
            )
            yield style, "warning", text


def _several_materials(deck: Deck) -> Found:
    """The gran styles have one stiffness for all granules."""
    style = deck.pair_style
    if style is None or not style.words[1].startswith("gran/"):
        return
    for box in deck.named("create_box"):
        types = number(" ".join(box.words[1:2]))
        if types is not None and types > 1:
            text = (
                f"{types:.0f} types of granules, but {style.words[1]} has one Kn for all of them:"
                " take pair_style granular with hertz/material for each pair of types, unless all"
                " are of one material"
            )
            yield style, "warning", text


def _mixed_pairs(deck: Deck) -> Found:
    """Pairs of two types that LAMMPS mixes by itself."""
    if deck.pair_style is None or deck.pair_style.words[1] != "granular" or deck.is_partial:
        return
    types = [number(" ".join(box.words[1:2])) for box in deck.named("create_box")]
    if len(types) != 1 or types[0] is None or not 2 <= types[0] <= _MOST_TYPES:
        return
    count = int(types[0])
    given: set[tuple[int, int]] = set()
    for command in deck.named("pair_coeff"):
        first, second = (_types_of(word, count) for word in (*command.words[1:3], "", "")[:2])
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


_MOST_TYPES = 100  # a deck with more is not looked at pair by pair


def _types_of(word: str, count: int) -> range | None:
    """The types of a word such as 2, *, 2*3; None for one that cannot be known."""
    match = re.fullmatch(r"(\d*)(\*?)(\d*)", word)
    if not word or match is None or (not match[2] and match[3]):
        return None
    first = int(match[1] or 1)
    last = first if not match[2] else int(match[3] or count)
    return range(first, last + 1)


_TIME_WORDS = {"step", "time", "elapsed", "elaplong"}


def _force_clock(deck: Deck) -> Found:
    """Which of LAMMPS's clocks a force follows."""
    for push in deck.pushes:
        before: Run | None = None
        found: tuple[Command, Severity, str] | None = None
        for run in push.runs:
            names = deck.script.names_in(f"v_{push.variable}", run.command.place)
            if {"step", "dt"} <= names and _has_new_step(deck, run):
                text = (
                    "the force follows step*dt, and timestep has been changed after steps were"
                    " taken: its clock jumps there (peaks off by 32 %); write time instead"
                )
                found = run.command, "error", text
            elif before and "elapsed" in names and not _made_anew(deck, push, before, run):
                text = (
                    "the force follows elapsed, which starts at 0 again with each run (peaks off"
                    " by 32 %); write time instead"
                )
                found = run.command, "error", text
            elif found is None and "elapsed" in names and run is not deck.runs[0]:
                text = (
                    "the force follows elapsed, which counts from the start of this run, not of"
                    " the simulation; time does not start again"
                )
                found = run.command, "note", text
            elif found is None and {"step", "dt"} <= names:
                changed = len(deck.named("timestep")) > 1
                text = (
                    "the force follows step*dt, which is the time only as long as timestep never"
                    f" changes{', as it does in this deck' if changed else ''}; write time instead"
                )
                found = push.command, "warning" if changed else "note", text
            before = run
        if found is not None:
            yield found


def _has_new_step(deck: Deck, run: Run) -> bool:
    """Whether a run goes on with another step after steps of another length."""
    taken = [r for r in deck.runs if r.command.place < run.command.place and r.steps != 0]
    changes = [c for c in deck.named("timestep") if c.place < run.command.place]
    if not taken or not changes or changes[-1].place < taken[0].command.place:
        return False
    return taken[0].dt is None or run.dt is None or taken[0].dt != run.dt


def _made_anew(deck: Deck, push: Push, before: Run, run: Run) -> bool:
    """Whether the formula was given again between two runs."""
    return any(
        before.command.place < c.place < run.command.place
        for c in deck.named("variable")
        if c.words[1:2] == (push.variable,)
    )


def _force_frozen(deck: Deck) -> Found:
    """A formula that is filled in once is a number."""
    for fix in deck.fixes("addforce", "setforce"):
        for word in fix.raw[4:7]:
            match = re.fullmatch(r"\$\{(\w+)\}|\$\(\s*v_(\w+)\s*(?::[^)]*)?\)", word)
            name = match and (match[1] or match[2])
            if name and _TIME_WORDS & deck.script.names_in(f"v_{name}", fix.place):
                text = (
                    f"{word} is filled in once, when the line is read: the force stays at the"
                    f" value of that moment; write v_{name}, which follows the time"
                )
                yield fix, "error", text


def _force_left_on(deck: Deck) -> Found:
    """A formula is evaluated every step, also when it gives 0."""
    for push in deck.pushes:
        if push.unfix is None and push.runs:
            text = (
                "LAMMPS evaluates the formula of the force at every step until the end, about 4 us"
                " each, and a periodic pulse begins again: end the run with the pulse, then unfix"
                f" {push.command.words[1]}"
            )
            yield push.command, "note", text


def _force_cut(deck: Deck) -> Found:
    """A force that is dropped while it pushes."""
    peak = deck.peak_force
    for push in deck.pushes:
        end = push.runs[-1].end if push.runs else None
        if push.unfix is None or not peak or end is None:
            continue
        before, during = push.command.place, push.runs[-1].command.place
        made = (
            deck.script.formula(push.variable, before),
            deck.script.formula(push.variable, during),
        )
        last = deck.force(push, during, end)
        # A ramp that ends as high as it goes, or a formula in pieces, may end with a jump.
        if made[0] == made[1] and last is not None and 1e-3 < abs(last) / peak < 0.999:
            text = (
                f"the force is dropped at {end:.6g} while it is {last:.4g}, {abs(last) / peak:.2g}"
                " of its largest value: let the runs before end with the pulse (steps times"
                " timestep)"
            )
            yield push.unfix, "warning", text


def _step_default(deck: Deck) -> Found:
    """A deck that leaves the step to LAMMPS."""
    default = dialect.DEFAULT_STEP.get(deck.units)
    first = deck.first_run
    if first is None or default is None or deck.is_partial or not deck.is_granular:
        return
    before = [c for c in deck.named("timestep") if c.place < first.place]
    if not before and not deck.fixes("dt/reset"):
        text = f"no timestep is given before this run: in units {deck.units} it is {default:g}"
        yield first, "note", text


def _periodic(deck: Deck) -> Found:
    """Images across the chain are ghosts that cost time."""
    if not deck.is_granular or deck.is_heap or deck.is_partial:
        return
    styles, command = deck.boundary
    where = command or next(iter(deck.named("create_box", "read_data")), None)
    said = "" if command else " (without a boundary command all are)"
    if deck.axis is None:
        if command is None and "p" in styles:
            text = (
                "without a boundary command the box is periodic: if the granules lie in a row,"
                " write boundary f f f and leave room around them"
            )
            yield where, "note", text
        elif styles[1:] == ("p", "p") or styles == ("p", "p", "p"):
            text = (
                "y and z are periodic: if the granules lie in a row along x, their images are"
                " ghosts that double the time of a step; write boundary f f f with room around them"
            )
            yield where, "note", text
        return
    across = [
        k for k in range(3) if k != deck.axis and styles[k].startswith("p") and not deck.has_room(k)
    ]
    if across:
        names = " and ".join("xyz"[k] for k in across)
        text = (
            f"{names} {'are' if len(across) > 1 else 'is'} periodic{said}: every granule has"
            " images as ghosts if the box is narrow, and a step takes twice as long (8.3 instead of"
            " 3.8 us for 30 granules); write boundary f f f with room around the chain"
        )
        yield where, "warning", text
    if styles[deck.axis].startswith("p") and not deck.has_room(deck.axis):
        text = (
            f"{'xyz'[deck.axis]} is periodic{said}: the chain has no free ends where the box is"
            " not longer than it, the last granule meets the first; write boundary f f f with"
            " room at both ends"
        )
        yield where, "warning", text


def _wall(deck: Deck) -> Found:
    """Walls of granules."""
    for wall in deck.fixes("wall/gran", "wall/gran/region"):
        words = wall.words
        if words[4:5] == ("hertz/history",) and number(" ".join(words[7:8])) == 0:
            text = (
                "wall/gran hertz/history with gamma_n = 0 makes positions NaN at the first touch"
                f" ({dialect.WALL_IS_NAN}): write wall/gran granular hertz K 0.0"
                f" {dialect.NO_FRICTION} with K = 4/3 E*"
            )
            yield wall, "error", text
        elif words[4:5] == ("granular",) and words[5:6] != ("hertz",) and not deck.is_heap:
            text = (
                "a wall of this law is an elastic half-space of the given material, no rigid wall:"
                " for a rigid one halve its compliance, that is give it twice E"
            )
            yield wall, "note", text
            if words[5:6] == ("hertz/material",):
                yield wall, "warning", _WALL_OF_MATERIAL
        ends = _planes(wall)
        if ends is not None and deck.diameter is not None and ends[1] - ends[0] <= deck.diameter:
            text = (
                "both planes of this wall can touch the same granule, which feels the nearer one"
                " alone: write a fix for each plane"
            )
            yield wall, "warning", text


_WALL_OF_MATERIAL = (
    "LAMMPS of 2021 and 2022 makes this wall 1 + nu times too stiff: give the stiffness itself,"
    " granular hertz K with K = 4/3 E*"
)


def _planes(wall: Command) -> tuple[float, float] | None:
    """Where both planes of a wall across an axis are; None unless there are two that are known."""
    for axis in ("xplane", "yplane", "zplane"):
        if axis in wall.words:
            at = wall.words.index(axis)
            low, high = (number(word) for word in (*wall.words[at + 1 : at + 3], "", "")[:2])
            return None if low is None or high is None else (low, high)
    return None


def _not_hertz(deck: Deck) -> Found:
    """Laws between granules that are not Hertz's."""
    style = deck.pair_style
    if style is None:
        if deck.first_run is not None and not deck.is_partial:
            text = (
                "there is no pair style: granules do not feel one another; write pair_style"
                f" granular and {_HERTZ}"
            )
            yield deck.first_run, "error", text
        return
    names = [word for word in style.words[1:] if re.match("[a-z]", word)]
    if deck.is_of_liggghts or names[:1] in (["hybrid"], ["hybrid/overlay"], ["hybrid/scaled"]):
        return
    if not deck.is_granular:
        text = (
            f"pair_style {style.words[1]} is no contact of spheres: Hertz's law is pair_style"
            f" granular with {_HERTZ}"
        )
        if "$" not in style.words[1]:
            yield style, "error", text
    elif style.words[1].startswith("gran/hooke"):
        yield style, "error", _HOOKE.format(style.words[1])
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


def _motion(deck: Deck) -> Found:
    """Somebody has to move the granules, and only one."""
    movers = [fix for fix in deck.fixes() if _MOVER.match(fix.words[3])]
    first = deck.first_run
    if first is not None and not movers and not deck.is_partial and deck.pair_style is not None:
        text = "no fix moves the granules, nothing happens: write fix motion all nve"
        yield first, "error", text
    gone = {command.words[1]: command.place for command in deck.named("unfix") if command.arguments}
    seen: dict[str, Command] = {}
    for fix in movers:
        other = seen.get(fix.words[2])
        if other is not None and other.words[1] != fix.words[1]:
            still = not other.place < gone.get(other.words[1], -1) < fix.place
            if still and not fix.conditional:
                text = (
                    f"granules of group {fix.words[2]} are moved twice each step, here and by fix"
                    f" {other.words[1]} (peaks off by 20 %): keep one"
                )
                yield fix, "error", text
        seen[fix.words[2]] = fix


def _no_run(deck: Deck) -> Found:
    """A deck with granules that never runs, perhaps as the command is misspelt."""
    granules = deck.named("create_atoms", "read_data")
    if granules and deck.pair_style is not None and not deck.runs and not deck.is_partial:
        text = "there is no run, so nothing happens: write timestep ... and run ..., so spelt"
        yield granules[-1], "warning", text


_MOVER = re.compile(r"(nve|nvt|npt|nph|rigid|move$|brownian|ehex|controller|python|freeze)")


def _thermostat(deck: Deck) -> Found:
    """Fixes that take motion from the granules or give some."""
    for fix in deck.fixes():
        style = fix.words[3]
        if re.match(r"(nvt|npt|langevin|temp/|nve/limit|press/)", style):
            text = (
                f"fix {style} changes velocities by something else than forces, and the wave with"
                " them: fix nve is all that a chain needs"
            )
            yield fix, "error", text
        elif style.startswith("viscous"):
            text = f"fix {style} damps every granule: peaks are lower than those of Hertz's law"
            yield fix, "note", text


def _not_touching(deck: Deck) -> Found:
    """Granules that touch without force have their sites one diameter apart."""
    if deck.spacing is None or deck.diameter is None or deck.diameter <= 0 or not deck.is_granular:
        return
    command, spacing = deck.spacing
    gap = spacing / deck.diameter - 1
    if gap > TOUCHING:
        text = (
            f"sites are {spacing:.10g} apart, the diameter is {deck.diameter:.10g}: granules do"
            f" not touch, gaps of {gap:.1e} of a diameter (with 1e-3 peaks are off by 113 %)"
        )
        yield command, "warning", text
    elif gap < -TOUCHING:
        text = (
            f"sites are {spacing:.10g} apart, the diameter is {deck.diameter:.10g}: granules"
            f" press one another from the start, overlaps of {-gap:.1e} of a diameter, and spring"
            " apart where nothing holds the ends (with 1e-3 peaks are off by 92 %)"
        )
        yield command, "warning", text


def _units(deck: Deck) -> Found:
    """Numbers that do not belong to the units."""
    if not deck.is_granular or deck.is_partial or deck.units != "lj":
        return
    moduli = [number(law.numbers[0]) for law in deck.laws if law.normal == "hertz/material"]
    real = [modulus for modulus in moduli if modulus is not None and modulus >= 1e8]
    small = deck.diameter is not None and deck.diameter < 0.2
    if real and small:
        command = next(iter(deck.named("units")), None)
        said = "units lj" if command else "without a units command they are lj"
        text = (
            f"{said}, but E = {real[0]:g} and the diameter look like SI: skin (0.3), step (0.005)"
            " and lattice (a density, not a spacing) mean something else there; write units si"
        )
        yield command, "error", text


def _atom_style(deck: Deck) -> Found:
    """Granules need radius and density of their own."""
    if not deck.is_granular or deck.is_partial or deck.named("read_restart"):
        return
    styles = deck.named("atom_style")
    if not any({"sphere", "bpm/sphere"} & set(style.words) for style in styles):
        text = "granules need atom_style sphere, which has a radius for each: LAMMPS stops without"
        yield (styles[-1] if styles else deck.pair_style), "error", text


def _dump_every_step(deck: Deck) -> Found:
    """Output that costs more than the simulation."""
    for command in deck.named("dump"):
        if number(" ".join(command.words[4:5])) == 1:
            text = (
                "a dump of every step costs about 50 us a step for 30 granules, which themselves"
                " take 4 to 8: write every 10 steps and interpolate, a contact lasts hundreds"
            )
            yield command, "note", text


def _elsewhere(deck: Deck) -> Found:
    """What is not looked at."""
    for command in deck.named("include", "read_restart"):
        text = f"what {command.name} brings is not looked at: missing commands are not reported"
        yield command, "note", text
    if deck.is_of_liggghts:
        text = "pair_style gran is of LIGGGHTS, whose contact laws are not looked at"
        yield deck.pair_style, "note", text


def _no_deck(deck: Deck) -> Found:
    """Text that is something else."""
    if not deck.named("units", "atom_style", "pair_style", "run", "include", "read_restart"):
        text = (
            "this does not look like a LAMMPS deck: none of units, atom_style, pair_style, run,"
            " include and read_restart is in it"
        )
        yield None, "error", text


_DECK_RULES: dict[str, Callable[[Chain], Found]] = {
    rule.__name__[1:].replace("_", "-"): rule
    for rule in (
        _no_deck, _elsewhere, _units, _atom_style, _density_before_diameter,
        _diameter_missing, _mass_set, _not_touching, _periodic, _ghost_velocity, _skin,
        _neighbours, _not_hertz, _damping, _attraction, _poisson_ratio, _tangential,
        _several_materials, _mixed_pairs, _wall, _motion, _no_run, _thermostat, _force_clock,
        _force_frozen, _force_left_on, _force_cut, _step_default, _dump_every_step,
    )
}  # fmt: skip

RULES: dict[str, Callable[[Chain], Found]] = {**_DECK_RULES, **CHAIN_RULES}
"""All rules by name."""


def lint(text: str, variables: Mapping[str, str] | None = None) -> list[Finding]:
    """The findings in a deck, in the order of its lines.

    ``variables`` are those of the command line, which take the place of the deck's own.
    """
    deck = Chain(parse(text, variables or {}))
    found: set[Finding] = set()
    for name, rule in RULES.items():
        with contextlib.suppress(ArithmeticError):  # numbers beyond the range of floating point
            for command, severity, sentence in rule(deck):
                line = 1 if command is None else command.line
                found.add(Finding(line, name, severity, sentence))
    return sorted(found, key=lambda finding: (finding.line, finding.rule, finding.text))


def lint_file(path: Path, variables: Mapping[str, str] | None = None) -> list[Finding]:
    """The findings in a file and what it includes, at the lines that include it; see ``lint``."""
    try:
        content = read_bytes(path, MOST_BYTES)
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise HertzchainError(f"{str(path)!r}: cannot be read ({reason})") from None
    # A comment may be in another encoding; no command has such letters.
    lines = whole(path, content.decode("utf-8-sig", errors="replace"), MOST_BYTES)
    found: list[Finding] = []
    for finding in lint("\n".join(written for written, _, _ in lines), variables):
        _, line, place = lines[finding.line - 1] if lines else ("", 1, "")
        text = f"{place}: {finding.text}" if place else finding.text
        found.append(replace(finding, line=line, text=text))
    return found
