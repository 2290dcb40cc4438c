"""Right decks as texts and the numbers of LAMMPS for them, into which tests put mistakes."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.deck import (
    Executed,
    FoundDeck,
    FoundFix,
    FoundRun,
    FoundWall,
)
from hertzchain.engines.lammps.reading.probing import DAMPED, DEPTHS
from hertzchain.examiner.examined import SIZES, DeckCheck, DeckExamination
from hertzchain.examiner.examining import compared
from hertzchain.limits import Deadline

COMMANDS = (
    "units si",
    "variable rho equal 7958",
    "set group all diameter 0.0095",
    "set group all density ${rho}",
    "pair_style granular",
    "pair_coeff * * hertz/material 193e9 0.0 0.3 tangential linear_nohistory 0.0 0.0",
    "variable F0 equal 100",
    "variable F equal v_F0*sin(PI*time/60e-6)^2*(time<60e-6)",
    "group first id 1",
    "fix 1 all nve",
    "fix 2 first addforce v_F 0 0",
    "timestep 2e-7",
    "run 2500",
)
"""A deck of that scene."""

STEP = 2e-7
DEPTH = 5e-6  # of the overlaps that are tried, as LAMMPS would be asked

Change = Callable[[FoundDeck], FoundDeck]


def found(scene: hc.Scene, commands: Sequence[str] = COMMANDS) -> FoundDeck:
    """Return the numbers of LAMMPS for a right deck, with the motion of native velocity Verlet.

    The commands end with ``timestep`` and ``run``; other numbers are those of the scene.
    """
    dt, steps = float(commands[-2].split()[1]), int(commands[-1].split()[1])
    result = hc.Native("velocity-verlet", dt=dt).run(scene)
    count, granules = scene.chain.granules, scene.granules
    between = count - 1
    everyone, first = np.ones(count, bool), np.arange(count) == 0
    time = np.linspace(0.0, dt * steps, steps + 1)
    applied, constant = np.zeros((time.size, count)), np.zeros((count, 3))
    applied[:, scene.shock.granule - 1] = scene.applied_force(time) if scene.ramps else 0.0
    constant[:, 0] = granules.constant_force
    still, place = np.zeros(count), granules.position
    velocity = np.outer(granules.velocity, [1.0, 0.0, 0.0])

    def tried(contacts: slice, depths: Sequence[float]) -> tuple[FloatArray, FloatArray]:
        overlap = DEPTH * np.outer(depths, np.ones(granules.stiffness[contacts].size))
        return overlap, granules.stiffness[contacts] * np.maximum(overlap, 0.0) ** 1.5

    depths, closing = np.array(DAMPED).T
    overlap, force = tried(slice(between), DEPTHS)
    damped_overlap, damped_force = tried(slice(between), depths)
    if scene.contact is not None and granules.damping is not None:
        power = scene.contact.exponent
        added = granules.damping * damped_overlap**power * closing[:, np.newaxis]
        damped_force = damped_force + added
    walls: tuple[FoundWall, ...] = ()
    if scene.wall is not None:
        behind = slice(between, None)
        pressed, held = (np.ravel(column) for column in tried(behind, DEPTHS[1:]))
        damped, push = (np.ravel(column) for column in tried(behind, depths))
        surface = place[-1] + granules.radius[-1] + scene.wall.gap - granules.static_overlap[-1]
        at = next(k for k, text in enumerate(commands) if " wall/" in text)
        walls = (FoundWall("last", surface, pressed, held, closing, damped, push, 0.0, at),)

    def fix(text: str, at: int) -> FoundFix:
        style, moves = text.split()[3], text.split()[3] in ("nve", "move")
        pushed = np.zeros((count, 2))
        if "v_" in text:
            pushed[:, 0] = np.max(np.abs(applied), axis=0)
        elif not moves and not style.startswith("wall"):
            pushed[:, 0] = np.abs(constant[:, 0])
        who = first if "first" in text or "v_" in text else everyone
        return FoundFix(style, at, moves, who, pushed, pushed)

    driven = first & (scene.piston is not None)
    driven_time = time if scene.piston is not None else np.zeros(0)
    moved = scene.piston.velocity if scene.piston is not None else 0.0
    return FoundDeck(
        version="20250722",
        commands=tuple(
            Executed(text.replace("${rho}", "7958"), "in.made", line, text)
            for line, text in enumerate(commands, start=1)
        ),
        first_run=len(commands) - 1, before=0.0, units="si", stopped="", is_chain=True, axis="x",
        direction=np.array([1.0, 0.0, 0.0]), origin=np.zeros(3), reversed=False,
        ids=np.arange(1, count + 1),
        types=1 + (granules.radius != granules.radius[0]).astype(np.int64), position=place,
        sideways=np.zeros((count, 2)), radius=granules.radius,
        mass=4 / 3 * np.pi * granules.radius**3 * granules.density, velocity=velocity,
        spin=np.zeros((count, 3)), overlap=overlap, contact_force=force,
        closing=np.outer(closing, np.ones(between)), damped_overlap=damped_overlap,
        damped_force=damped_force, tangential_force=still, constant_force=constant, drag=still,
        walls=walls, integrated=np.where(np.isin(np.arange(count), granules.fixed), 0, 1),
        image_gap=None, image_force=0.0,
        fixes=tuple(fix(text, at) for at, text in enumerate(commands) if text.startswith("fix ")),
        runs=(FoundRun(0.0, dt, steps, len(commands) - 1),), applied_time=time,
        applied_force=applied, applied_sideways=0.0, peak_force=result.peak_force,
        peak_reading_error=0.0, missed_overlap=np.zeros(granules.stiffness.size), driven=driven,
        driven_time=driven_time, driven_displacement=(moved or 0.0) * driven_time,
        end_time=dt * steps, final_velocity=result.velocity, remarks=(),
    )  # fmt: skip


def examined(
    scene: hc.Scene, deck: FoundDeck, tolerance: float = 1e-3, strict: bool = True
) -> DeckExamination:
    """The examination of it; a made deck moves as the scene does, whatever its numbers are."""
    return compared(scene, "in.made", deck, tolerance, Deadline(60.0), strict=strict)


def changed(deck: FoundDeck, **numbers: Any) -> FoundDeck:
    """A deck with other numbers."""
    return replace(deck, **numbers)


def by_name(done: DeckExamination, start: str) -> DeckCheck:
    """The check whose name starts so."""
    (check,) = (check for check in done.checks if check.name.startswith(start))
    return check


def first_guess(check: DeckCheck) -> tuple[str, ...]:
    """The commands of its first line in the first correction that would be tried."""
    return next(iter(check.corrections[0].values()))


def times(name: str, factor: float | FloatArray, index: Any = ...) -> Change:
    """Makes one number of a deck so many times as large."""

    def change(deck: FoundDeck) -> FoundDeck:
        values = np.array(getattr(deck, name))
        values[index] *= factor
        return changed(deck, **{name: values})

    return change


def plus(name: str, index: Any, value: Any) -> Change:
    """Adds to one number of a deck."""

    def change(deck: FoundDeck) -> FoundDeck:
        values = np.array(getattr(deck, name))
        values[index] += value
        return changed(deck, **{name: values})

    return change


def stiffer(factor: float) -> Change:
    """Multiply the stiffness of contacts, without a change of their granules."""
    still, moving = times("contact_force", factor), times("damped_force", factor)
    return lambda deck: moving(still(deck))


def both(*changes: Change) -> Change:
    """Makes several changes."""

    def change(deck: FoundDeck) -> FoundDeck:
        for change_numbers in changes:
            deck = change_numbers(deck)
        return deck

    return change


def in_texts(old: str, new: str) -> Change:
    """Puts another text into the commands of a deck."""

    def change(deck: FoundDeck) -> FoundDeck:
        commands = tuple(
            replace(c, text=c.text.replace(old, new), written=c.written.replace(old, new))
            for c in deck.commands
        )
        assert commands != deck.commands
        return changed(deck, commands=commands)

    return change


# Decks of scenes with terms

_TEXT = Path(__file__).with_name("made.toml").read_text(encoding="utf-8")
DECKS = {name: tuple(text.splitlines()) for name, text in tomllib.loads(_TEXT).items()}
"""By the name of the scene."""


def deck_of(name: str, scene: hc.Scene, old: str = "", new: str = "") -> FoundDeck:
    """The numbers of a scene in the deck of one, with another text in its commands."""
    texts = DECKS[name]
    if old:
        assert any(old in text for text in texts)
        texts = tuple(text.replace(old, new) for text in texts)
    return found(scene, texts)


def assert_alike(texts: Sequence[str], expected: Sequence[str]) -> None:
    """Assert that texts are equal but for the last digits of their numbers.

    Powers and roots may differ in their last digit from one C library to another, and sums of them
    by a few more: 2e-11 is what decks of ours are allowed, too.
    """
    ours, other = "\n".join(texts), "\n".join(expected)
    assert SIZES.sub("#", ours) == SIZES.sub("#", other), ours
    numbers, wanted = ([float(size) for size in SIZES.findall(text)] for text in (ours, other))
    assert numbers == pytest.approx(wanted, rel=2e-11, abs=0)
