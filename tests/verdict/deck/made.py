"""The numbers of LAMMPS for a right deck of a scene, into which tests put mistakes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import hertzchain as hc
from hertzchain.engines.lammps.reading.found import Executed, FoundDeck, FoundFix, FoundRun
from hertzchain.engines.lammps.reading.prober import DAMPED, DEPTHS
from hertzchain.limits import Deadline
from hertzchain.verdict.deck import DeckCheck, DeckExamination, compared

STIFFNESS = np.sqrt(2 * 4.75e-3) * 193e9 / (3 * (1 - 0.3**2))
"""A of the scene ``steel``, by Hertz's law."""

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

STEP, STEPS = 2e-7, 2500
DEPTH = 5e-6  # of the overlaps that are tried, as LAMMPS would be asked

Change = Callable[[FoundDeck], FoundDeck]


def found(scene: hc.Scene) -> FoundDeck:
    """Return the numbers of LAMMPS for ``COMMANDS``, with the motion of native velocity Verlet."""
    result = hc.Native("velocity-verlet", dt=STEP).run(scene)
    count = scene.chain.granules
    contacts, mass = count - 1, 4 / 3 * np.pi * 4.75e-3**3 * 7958.0
    overlap = np.outer(DEPTH * np.array(DEPTHS), np.ones(contacts))
    depth, closing = np.array(DAMPED).T
    damped = np.outer(DEPTH * depth, np.ones(contacts))
    time = np.linspace(0.0, STEP * STEPS, STEPS + 1)
    applied = np.zeros((time.size, count))
    applied[:, 0] = np.where(time < 60e-6, 100 * np.sin(np.pi * time / 60e-6) ** 2, 0.0)
    force = STIFFNESS * np.maximum(overlap, 0.0) ** 1.5
    still, place = np.zeros(count), np.arange(count) * np.float64(9.5e-3)
    everyone, first = np.ones(count, bool), np.arange(count) == 0
    return FoundDeck(
        version="20250722",
        commands=tuple(
            Executed(text.replace("${rho}", "7958"), "in.made", line, text)
            for line, text in enumerate(COMMANDS, start=1)
        ),
        first_run=len(COMMANDS) - 1,
        before=0.0,
        units="si",
        stopped="",
        is_chain=True,
        axis="x",
        direction=np.array([1.0, 0.0, 0.0]),
        origin=np.zeros(3),
        reversed=False,
        ids=np.arange(1, count + 1),
        types=np.ones(count, np.int64),
        position=place,
        sideways=np.zeros((count, 2)),
        radius=np.full(count, 4.75e-3),
        mass=np.full(count, mass),
        velocity=np.zeros((count, 3)),
        spin=np.zeros((count, 3)),
        overlap=overlap,
        contact_force=force,
        closing=np.outer(closing, np.ones(contacts)),
        damped_overlap=damped,
        damped_force=STIFFNESS * damped**1.5,
        tangential_force=still,
        constant_force=np.zeros((count, 3)),
        drag=still,
        walls=(),
        integrated=np.ones(count, np.int64),
        boundary="f f f",
        image_gap=None,
        image_force=0.0,
        fixes=(
            FoundFix("nve", 9, moves=True, granules=everyone, largest=np.zeros((count, 2)),
                     largest_in_motion=np.zeros((count, 2))),
            FoundFix("addforce", 10, moves=False, granules=first,
                     largest=np.outer(first * 100.0, [1.0, 0.0]),
                     largest_in_motion=np.outer(first * 100.0, [1.0, 0.0])),
        ),
        runs=(FoundRun(0.0, STEP, STEPS, len(COMMANDS) - 1),),
        applied_time=time,
        applied_force=applied,
        applied_sideways=0.0,
        peak_force=result.peak_force,
        peak_reading_error=0.0,
        missed_overlap=np.zeros(contacts),
        driven=np.zeros(count, bool),
        driven_time=np.zeros(0),
        driven_displacement=np.zeros(0),
        end_time=STEP * STEPS,
        final_position=place + result.displacement,
        final_velocity=result.velocity,
        remarks=(),
    )  # fmt: skip


def examined(scene: hc.Scene, deck: FoundDeck, tolerance: float = 1e-3) -> DeckExamination:
    """The examination of it."""
    return compared(scene, "in.made", deck, tolerance, Deadline(60.0))


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


def times(name: str, factor: float, index: Any = ...) -> Change:
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
