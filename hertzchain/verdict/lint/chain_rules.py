"""Rules of lint on what a deck does to its chain: steps, forces, gravity, velocities, stiffness.

They need no scene: what is said follows from the deck's own numbers.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise

from hertzchain.verdict.lint import stability
from hertzchain.verdict.lint.arithmetic import number
from hertzchain.verdict.lint.chain import Chain, Pushed
from hertzchain.verdict.lint.finding import Found
from hertzchain.verdict.lint.pushing import Force, moving_runs
from hertzchain.verdict.lint.scale import SCALES

_UNSTABLE = math.sqrt(2 / 3)  # natural time units; 2 over the largest frequency, 2 sqrt(3/2)
_LEVELS = 3  # forces held in turn that are no pulse with corners: two are a rectangle and its end
_LOOKS = 4  # in a row at which a force is the same: a level, no part of a ramp
_HELD = 0.8  # of all looks at a force, at which a staircase is on a level; some meet its corners
_FEEBLE = 1e-6  # of all gravity: an angle written with 6 digits leaves that across the chain
_ALIKE = 2e-3  # relative; numbers of a comment have 3 digits (chosen)


def _step_length(chain: Chain) -> Found:
    """The step against the stiffest contacts that the deck itself makes."""
    if chain.units not in SCALES and chain.units != "lj":
        return
    masses, springs = chain.masses, chain.springs
    moving = [run for run in moving_runs(chain) if run.dt]
    longest = max(moving, key=lambda run: run.dt or 0, default=None)
    if not masses or springs is None or longest is None or longest.dt is None:
        return
    if min(masses) <= 0:
        return
    limit = stability.longest_step(masses, springs[0])
    unit, pressing = limit / _UNSTABLE, springs[1]
    steps = [c for c in chain.named("timestep") if c.place < longest.command.place]
    where = steps[-1] if steps else longest.command
    step = longest.dt / unit
    if pressing is None:
        pressed, advice = "contacts of this deck, whatever presses them", ""
    else:
        pressed = f"contacts pressed by {pressing.force:.4g}, {pressing.origin}"
        advice = f"; {0.02 * unit:.1g} gives peaks right to about 1e-4"
    if longest.dt > limit:
        text = (
            f"the step {longest.dt:.3g} is above the limit of stability, {limit:.3g} for"
            f" {pressed} (2 over the largest frequency of masses from {min(masses):.3g} to"
            f" {max(masses):.3g} and springs up to {max(springs[0]):.3g}): granules fly"
            f" apart{advice}"
        )
        yield where, "error", text
    elif step > 0.2 and pressing is not None:
        text = (
            f"the step {longest.dt:.3g} is {step:.2g} of the natural time of {pressed}: peaks are"
            f" off by about {0.22 * step**2:.1%}, which goes with the square of it{advice}"
        )
        yield where, "warning", text


def _random_velocities(chain: Chain) -> Found:
    """Granules of a chain start at rest, but for a striker."""
    if chain.is_heap or not chain.is_granular:
        return
    for command in chain.named("velocity"):
        if command.words[2:3] == ("create",):
            heat = " ".join(command.words[3:4])
            text = (
                f"granules of group {command.words[1]} start with random velocities of temperature"
                f" {heat}, in all directions: a chain starts at rest (leave the command out), a"
                " striker with velocity first set V 0 0 units box"
            )
            yield command, "error", text


def _force_on_all(chain: Chain) -> Found:
    """A shock hits one end."""
    if chain.is_heap or not chain.is_granular:
        return
    for force in chain.forces:
        if not any(word not in ("", "NULL", "0", "0.0") for word in force.words):
            continue
        members = None if chain.row is None else chain.row.members(force.group)
        many = "every granule" if force.group == "all" else None
        if many is None and members is not None and len(members) > 1:
            many = f"the {len(members)} granules of group {force.group}"
        if many:
            text = (
                f"the force acts on {many}, on each in full: group first id 1, and fix"
                f" {force.command.words[1]} first addforce, push one end"
            )
            yield force.command, "warning", text


def _force_in_steps(chain: Chain) -> Found:
    """A pulse follows the time; one in steps has another shape."""
    if chain.is_heap:
        return
    levels: dict[str, list[Force]] = {}
    for force in chain.forces:
        words = force.command.words
        count = number(force.command.after("every"))
        if "every" in words[7:] and count is not None and count > 1:
            text = (
                f"with every {count:g} the force is there at one of {count:g} steps only: the"
                f" granule gets 1/{count:g} of the momentum; leave the words out"
            )
            yield force.command, "error", text
        values = [chain.number(word, force.command) for word in force.words]
        if force.runs and any(values):
            levels.setdefault(force.group, []).append(force)
    for forces in levels.values():
        held = [f for f in forces if not any(word.startswith("v_") for word in f.words)]
        held = [f for f in held if not _lasts(chain, f)]
        changed = held[:1] + [b for a, b in pairwise(held) if a.words != b.words]
        if len(changed) >= _LEVELS:
            text = (
                f"the force on group {held[0].group} changes in {len(changed)} steps, "
                f"{', '.join(_size(f) for f in changed[:3])}, ..., each held for a while: a pulse"
                " is a formula of time, variable push equal ... and fix ... addforce v_push 0.0 0.0"
            )
            yield held[0].command, "warning", text
    for pushed in chain.pushes_over_time:
        yield from _stairs(pushed)
    yield from _set_again(chain)


def _size(force: Force) -> str:
    return next((word for word in force.words if number(word)), force.words[0])


def _lasts(chain: Chain, force: Force) -> bool:
    """Whether a force acts as long as the deck runs: a static load."""
    return [r for r in force.runs if r.steps != 0] == moving_runs(chain)


def _stairs(pushed: Pushed) -> Found:
    """A formula with several values, each held for a while."""
    values = pushed.values or ()
    largest = max(map(abs, values), default=0.0)
    held: list[list[float]] = []  # neighbours that are the same
    for value in values:
        if held and abs(value - held[-1][0]) <= 1e-9 * largest:
            held[-1].append(value)
        else:
            held.append([value])
    levels = [group for group in held if group[0] and len(group) >= _LOOKS]
    looks = sum(len(group) for group in held if group[0])
    if len(levels) >= _LEVELS and sum(map(len, levels)) >= _HELD * looks:
        text = (
            f"the formula of {pushed.force.words[pushed.axis][2:]} has {len(levels)} levels up to"
            f" {largest:.4g}, each held for a while: the pulse is a staircase, whose corners make"
            " waves of their own; write a formula that follows time without floor, round, ceil or"
            " ternary"
        )
        yield pushed.force.command, "warning", text


def _set_again(chain: Chain) -> Found:
    """A force that is filled in again and again, between runs or every so many steps."""
    for command in chain.script.commands:
        is_push = command.conditional and command.words[3:4] == ("addforce",)
        if is_push and command.name == "fix" and any("$" in word for word in command.raw[4:7]):
            text = (
                "the force is filled in again and again and held in between: the pulse is a"
                " staircase; write v_NAME in place of the number, which follows the time"
            )
            yield command, "warning", text


def _gravity(chain: Chain) -> Found:
    """Gravity across a row, which nothing holds, or along one that falls as a whole."""
    if chain.is_heap or chain.along is None or not chain.gravities:
        return
    walls = chain.fixes("wall/gran", "wall/gran/region")
    held = chain.fixes("lineforce", "planeforce", "setforce", "freeze", "enforce2d", "move")
    planes = {word for wall in walls for word in wall.words if word.endswith("plane")}
    along = f"{'xyz'[chain.along]}plane"
    for gravity in chain.gravities:
        size = math.hypot(*gravity.along)
        across = math.hypot(*(g for k, g in enumerate(gravity.along) if k != chain.along))
        if held or size == 0:
            continue
        name, x = gravity.command.words[1], "xyz"[chain.along]
        if across > _FEEBLE * size and not planes - {along}:
            text = (
                f"gravity of {across:.4g} pulls across the chain, which lies along {x}, and nothing"
                f" holds the granules there: they fall out of the row; leave fix {name} out, or let"
                f" it point along {x}"
            )
            yield gravity.command, "error", text
        elif across <= _FEEBLE * size and not walls:
            text = (
                f"gravity of {size:.4g} along {x} without a wall: the chain falls as a whole and no"
                f" contact feels it; leave fix {name} out, or give the chain a wall"
            )
            yield gravity.command, "warning", text


_YOUNG = re.compile(r"\b(?:E|E0|[Yy]oung\w*(?:'s)?(?:[ _]modulus)?|[Yy]mod|[Ee]mod\w*)\b", re.ASCII)
_POISSON = re.compile(r"\b(?:nu|pr|[Pp]oisson\w*(?:'s)?(?:[ _]ratio)?|prat)\b", re.ASCII)
_VALUE = re.compile(r"\s*(?:=|:|of|is)?\s*([0-9.]+(?:[eE][-+]?\d+)?)\s*([GMk]?)(?:Pa\b)?")
_PREFIX = {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
_WRONG = (
    (3 / 2, "the factor 2/3 is missing"),
    (2.0, "4/3 E/(1 - nu^2) takes E of one granule for E*, which is E/(2 (1 - nu^2))"),
    (1 / 2, "half of it"),
    (2 / 3, "2/3 stands in it twice"),
)


def _stiffness_of_material(chain: Chain) -> Found:
    """Kn against what the deck says of the material, in variables and comments."""
    style = chain.pair_style
    given: list[tuple[object, str | None]] = []
    if style is not None and style.words[1] == "gran/hertz/history":
        given = [(style, " ".join(style.words[2:3]))]
    for law in chain.laws:
        if law.normal == "hertz" and law.command.name == "pair_coeff":
            given.append((law.command, law.numbers[0]))
    moduli, ratios = _said(chain, _YOUNG), _said(chain, _POISSON)
    if len(given) != 1 or len(moduli) != 1 or len(ratios) != 1:
        return
    (modulus,), (ratio,) = moduli, ratios
    kn = number(given[0][1])
    if kn is None or not modulus > 0 or not 0 < ratio <= 0.5:
        return
    plane = 1 - ratio**2
    right = 2 * modulus / (3 * plane)
    for factor, why in (*_WRONG, (plane, "1/(1 - nu^2) is missing"), (1.5 * plane, "it is E")):
        if abs(kn / right / factor - 1) < _ALIKE and abs(kn / right - 1) > _ALIKE:
            text = (
                f"Kn = {kn:.6g} is {factor:.3g} times that of the material which this deck names,"
                f" E = {modulus:.4g} and nu = {ratio:.3g} ({why}): write 2 E/(3 (1 - nu^2)) ="
                f" {right:.6g}"
            )
            command = style if given[0][0] is style else chain.laws[0].command
            yield command, "error", text
            return


def _said(chain: Chain, name: re.Pattern[str]) -> set[float]:
    """The values that variables and comments give a quantity."""
    found: set[float] = set()
    for command in chain.named("variable"):
        if len(command.words) > 3 and name.fullmatch(command.words[1]):
            value = chain.script.value(f"v_{command.words[1]}", command.place + 1)
            found |= {value} if value else set()
    for _, comment in chain.script.comments:
        for match in name.finditer(comment):
            value_match = _VALUE.match(comment, match.end())
            value = number(value_match[1]) if value_match else None
            if value_match and value:
                found.add(value * _PREFIX[value_match[2]])
    return found


CHAIN_RULES = {
    rule.__name__[1:].replace("_", "-"): rule
    for rule in (
        _step_length, _random_velocities, _force_on_all, _force_in_steps, _gravity,
        _stiffness_of_material,
    )
}  # fmt: skip
"""Rules on chains by name."""
