"""Rules of lint on what moves granules: fixes, forces over time, gravity, velocities, steps."""

from __future__ import annotations

import math
import re
from itertools import pairwise

from hertzchain.verdict.lint.deck import Deck, Found
from hertzchain.verdict.lint.script import Command, names_in, number

_MOVER = re.compile(r"(nve|nvt|npt|nph|rigid|move$|brownian|ehex|controller|python|freeze)")


def _motion(deck: Deck) -> Found:
    """One fix has to move each granule, and only one."""
    movers = [fix for fix in deck.fixes() if _MOVER.match(fix.words[3])]
    first = next(iter(deck.runs), None)
    is_whole = deck.pair_style is not None and not deck.is_partial and not deck.no_chain
    if first is not None and not movers and is_whole:
        text = "no fix moves the granules, nothing happens: write fix motion all nve"
        yield first, "error", text
    gone = {command.word(1): command.place for command in deck.named("unfix")}
    seen: dict[str, Command] = {}
    for fix in movers:
        other = seen.get(fix.words[2], fix)
        is_gone = other.place < gone.get(other.word(1), -1) < fix.place
        if other.word(1) != fix.word(1) and not is_gone:
            text = (
                f"granules of group {fix.words[2]} are moved twice each step, here and by fix"
                f" {other.word(1)} (peaks off by 20 %): keep one"
            )
            yield fix, "error", text
        seen[fix.words[2]] = fix


def _thermostat(deck: Deck) -> Found:
    """Fixes that take motion from the granules or give some."""
    for fix in deck.fixes():
        style = fix.words[3]
        if re.match(r"(nvt|npt|nph|langevin|temp/|nve/limit|press/)", style):
            text = (
                f"fix {style} changes velocities by something else than forces, and the wave with"
                " them: fix nve is all that a chain needs"
            )
            yield fix, "error", text


_TIME_WORDS = {"step", "time", "elapsed", "elaplong"}


def _acting(deck: Deck, fix: Command) -> tuple[list[Command], Command | None]:
    """The runs during which a fix acts, and the command that ends it."""
    later = [c for c in deck.commands if c.place > fix.place]
    end = next((c for c in later if c.name in ("fix", "unfix") and c.word(1) == fix.word(1)), None)
    last = math.inf if end is None else end.place
    return [run for run in deck.runs if fix.place < run.place < last], end


def _formulas(deck: Deck) -> list[tuple[Command, str]]:
    """Forces that follow a variable, and its name."""
    fixes = deck.fixes("addforce")
    each = ((fix, word) for fix in fixes for word in fix.words[4:7])
    return [(fix, word[2:]) for fix, word in each if word.startswith("v_")]


def _force_clock(deck: Deck) -> Found:
    """Forces follow the time; LAMMPS's other clocks jump, or start again."""
    for fix, variable in _formulas(deck):
        runs, _ = _acting(deck, fix)
        if not runs:
            continue
        names = names_in(f"v_{variable}", deck.commands, runs[-1].place)
        made = [c.place for c in deck.named("variable") if c.word(1) == variable]
        if {"step", "dt"} <= names:
            changed = [run for run in runs if _has_new_step(deck, run)]
            if changed:
                text = (
                    "the force follows step*dt, and timestep has been changed after steps were"
                    " taken: its clock jumps there; write time instead"
                )
                yield changed[0], "error", text
        elif "elapsed" in names:
            again = [
                after
                for before, after in pairwise(runs)
                if not any(before.place < place < after.place for place in made)
            ]
            if again:
                text = (
                    "the force follows elapsed, which starts at 0 again with each run; write time"
                    " instead"
                )
                yield again[0], "error", text


def _has_new_step(deck: Deck, run: Command) -> bool:
    """Whether a run goes on with another step after steps of another length."""
    first = deck.runs[0].place
    changes = [c for c in deck.named("timestep") if c.place < run.place]
    before = [c for c in changes if c.place < first]
    return (
        bool(changes)
        and changes[-1].place > first
        and (not before or before[-1].word(1) != changes[-1].word(1))
    )


def _force_frozen(deck: Deck) -> Found:
    """A formula that is filled in once is a number."""
    for fix in deck.fixes("addforce", "setforce"):
        for word in fix.raw[4:7]:
            match = re.fullmatch(r"\$\{(\w+)\}|\$\(\s*v_(\w+)\s*(?::[^)]*)?\)", word)
            name = match and (match[1] or match[2])
            if name and _TIME_WORDS & names_in(f"v_{name}", deck.commands, fix.place):
                text = (
                    f"{word} is filled in once, when the line is read: the force stays at the"
                    f" value of that moment; write v_{name}, which follows the time"
                )
                yield fix, "error", text


def _force_on_all(deck: Deck) -> Found:
    """A shock hits one end."""
    for fix in deck.fixes("addforce"):
        largest = None if fix.index is None else deck.pushes.get(fix.index)
        zero = all(number(word) == 0 or word == "NULL" for word in fix.words[4:7])
        many = "every granule" if fix.word(2) == "all" and not zero else None
        if largest is not None:
            count = int((largest.max(axis=1) > 0).sum())
            many = f"the {count} granules of group {fix.word(2)}" if count > 1 else None
        if many:
            text = (
                f"the force acts on {many}, on each in full: group first id 1, and fix"
                f" {fix.word(1)} first addforce, push one end"
            )
            yield fix, "warning", text


def _force_in_steps(deck: Deck) -> Found:
    """A force that acts at some steps only."""
    for fix in deck.fixes("addforce"):
        count = number(fix.after("every"))
        if "every" in fix.words[7:] and count is not None and count > 1:
            text = (
                f"with every {count:g} the force is there at one of {count:g} steps only: the"
                f" granule gets 1/{count:g} of the momentum; leave the words out"
            )
            yield fix, "error", text


def _random_velocities(deck: Deck) -> Found:
    """Granules of a chain start at rest, but for a striker."""
    for command in deck.named("velocity") if deck.is_granular else ():
        if command.word(2) == "create":
            text = (
                f"granules of group {command.word(1)} start with random velocities of temperature"
                f" {command.raw[3] if len(command.raw) > 3 else ''}, in all directions: a chain"
                " starts at rest (leave the command out), a striker with velocity first set V 0 0"
                " units box"
            )
            yield command, "error", text


RULES = (
    _motion, _thermostat, _force_clock, _force_frozen, _force_on_all, _force_in_steps,
    _random_velocities,
)  # fmt: skip
