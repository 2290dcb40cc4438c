"""Deliberate mistakes: the comparison must fail, and name each of them.

Each is planted where it would be made: in the text that LAMMPS gets, or in the code that both
backends share. Nothing on disk is changed. ``tests/verdict/test_seeded_mistakes.py`` plants them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from typing import Any
from unittest.mock import patch

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps.dialect import NO_FRICTION
from hertzchain.engines.native import backend, simulation
from hertzchain.engines.native.simulation import Prepared
from hertzchain.observables.samples import Samples
from hertzchain.observables.watch import PeakWatch
from hertzchain.scene import schedule
from hertzchain.scene.chain import Granules
from hertzchain.scene.schedule import Leg
from hertzchain.scene.shocks import Pulse, Ramp, Stroke
from tests.oracles.in_numpy import simulate_in_numpy
from validation.shipped import load

POSITION = "lammps: place of granules [m]"
STIFFNESS = "lammps: stiffness of the contacts [N m^-1.5]"
DAMPING = "lammps: damping [N]"

Plant = Callable[[], AbstractContextManager[Any]]
"""A context with a mistake in it."""


@dataclass(frozen=True)
class Mistake:
    """A mistake to plant."""

    what: str
    plant: Plant
    check: str  # the check of the comparison that has to name it
    pair_style: str = "granular"  # context that makes it
    read_every: int | None = None  # steps between two readings of LAMMPS; None for its own choice
    made_in: Callable[[], hc.Scene] | None = None  # the scene; None for that of ``small_scene``


def in_set_up(*changes: tuple[str, str]) -> Plant:
    """Replace text in the commands that create the chain."""

    def planted() -> AbstractContextManager[Any]:
        original = deck.set_up

        def altered(*arguments: Any) -> str:
            text = original(*arguments)
            for old, new in changes:
                if old not in text:
                    raise ValueError(f"there is no {old!r} to get wrong")
                text = text.replace(old, new)
            return text

        return patch.object(deck, "set_up", altered)

    return planted


RADIUS = "lammps: radius [m]"
WALL = "lammps: place of the wall [m]"
CONSTANT = "lammps: constant force [N]"
START_VELOCITY = "lammps: velocity at the start [m/s]"


def without_a_gap(scene: hc.Scene) -> hc.Scene:
    """The gap before granule 3 is closed, and all granules behind it move up."""
    gaps = np.full(scene.chain.granules, scene.chain.gap)
    gaps[2] = 0.0
    return replace(scene, chain=replace(scene.chain, gap=gaps))


def gap_lost() -> AbstractContextManager[Any]:
    """The deck is that of a scene without one of its gaps."""
    original = deck.set_up
    return patch.object(
        deck, "set_up", lambda scene, *style: original(without_a_gap(scene), *style)
    )


def half_the_overlaps() -> AbstractContextManager[Any]:
    """Granules have the overlaps of half the precompression, which acts in full."""
    original = deck.granules

    def pressed_less(scene: hc.Scene, *style: str) -> list[str]:
        assert scene.precompression is not None
        half = replace(scene.precompression, force=scene.precompression.force / 2)
        return original(replace(scene, precompression=half), *style)

    return patch.object(deck, "granules", pressed_less)


def wall_too_far() -> AbstractContextManager[Any]:
    """The wall is a micrometre too far from the last granule."""
    original = deck.held

    def farther(scene: hc.Scene) -> list[str]:
        assert scene.wall is not None
        lines = "\n".join(original(scene))
        place = re.search(r"xplane NULL (\S+)", lines)
        assert place is not None
        return lines.replace(place[1], repr(float(place[1]) + 1e-6)).split("\n")

    return patch.object(deck, "held", farther)


def overlaps_of_the_contact_before() -> AbstractContextManager[Any]:
    """Every simulation starts from the static force of the contact before, of the first none."""

    def shifted(granules: Granules) -> FloatArray:
        force = np.append(0.0, granules.static_force[:-1])
        return np.asarray((force / granules.stiffness) ** (2 / 3))

    return patch.object(Granules, "static_overlap", property(shifted))


def scene_with_gaps() -> hc.Scene:
    """The demo scene with 6 granules, gaps of 10 um and a wall."""
    scene = load("demo")
    chain = replace(scene.chain, granules=6, gap=1e-5)
    return replace(scene, chain=chain, wall=hc.Wall("elastic", 70e9, 0.33))


def column() -> hc.Scene:
    """A striker on a pressed column of 6 granules of two sizes and materials, and a wall."""
    unlike = {"radius": (4.75e-3, 3e-3), "young_modulus": (193e9, 70e9)}
    cells = {key: values * 3 for key, values in unlike.items()}
    chain = hc.Chain(6, **cells, poisson_ratio=0.3, density=7958.0)
    wall, pressed = hc.Wall("elastic", 70e9, 0.33), hc.Precompression(10.0, 9.81)
    return hc.Scene(chain, hc.Striker(0.5), wall=wall, precompression=pressed)


_PAIR = f"pair_coeff 1 2 hertz ${{k1_2}} 0.0 {NO_FRICTION}\n"

MISTAKES_WITH_TERMS = (
    Mistake("wall twice as stiff",
        in_set_up(("k_wall equal 4/3/", "k_wall equal 8/3/")), STIFFNESS, made_in=column),
    Mistake("wall damped",
        in_set_up(("${k_wall} 0.0", "${k_wall} 10.0")), DAMPING, made_in=column),
    Mistake("wall a micrometre too far", wall_too_far, WALL, made_in=column),
    Mistake("radius of the neighbour",
        in_set_up(("set atom 2 diameter 0.006\n", "set atom 2 diameter 0.0095\n")), RADIUS,
        made_in=column),
    Mistake("pair of materials left to LAMMPS to mix",
        in_set_up((_PAIR, "")), STIFFNESS, made_in=column),
    Mistake("gap lost", gap_lost, POSITION, made_in=scene_with_gaps),
    Mistake("gravity the wrong way",
        in_set_up(("vector 1 0 0", "vector -1 0 0")), CONSTANT, made_in=column),
    Mistake("precompression on the last granule",
        in_set_up(("fix press loaded", "fix press last")), CONSTANT, made_in=column),
    Mistake("static overlaps of half the load", half_the_overlaps, POSITION, made_in=column),
    Mistake("static overlap of the contact before, everywhere",
        overlaps_of_the_contact_before, POSITION, made_in=column),
    Mistake("velocity of the striker on the last granule",
        in_set_up(("velocity first set", "velocity last set")), START_VELOCITY, made_in=column),
)  # fmt: skip
"""The mistakes: place of each, and the check of the examination that fails first."""


def force_at(time: str) -> AbstractContextManager[Any]:
    """Another time in the formula of the applied force."""
    original = deck.force_formula
    return patch.object(
        deck, "force_formula", lambda ramp: re.sub(r"\btime\b", time, original(ramp))
    )


def force_that_stays() -> AbstractContextManager[Any]:
    """The force is not dropped after the pulse."""
    original = deck.leg_commands

    def without_unfix(scene: hc.Scene, leg: Leg, before: Leg | None) -> list[str]:
        return [line for line in original(scene, leg, before) if line != "unfix shock"]

    return patch.object(deck, "leg_commands", without_unfix)


def peaks_of_samples() -> AbstractContextManager[Any]:
    """Peaks are the largest samples, in the watch that LAMMPS and NumPy share."""

    def of_samples(watch: PeakWatch, samples: Samples, late: float = 0.0) -> None:
        at = np.argmax(samples.contact_force, axis=0)
        forces = np.max(samples.contact_force, axis=0)
        before = watch.force.copy(), watch.time.copy()
        update(watch, samples, late)
        larger = forces > before[0]
        watch.force[:] = np.where(larger, forces, before[0])
        watch.time[:] = np.where(larger, samples.time[at], before[1])

    update = PeakWatch.update
    return patch.object(PeakWatch, "update", of_samples)


@contextmanager
def peaks_of_samples_everywhere() -> Iterator[None]:
    """The same in every simulation: compiled ones follow the shared watch."""

    def in_numpy(*arguments: Any, **options: Any) -> simulation.Simulation:
        for option in ("leave_behind", "window", "deadline"):
            options.pop(option, None)
        return simulate_in_numpy(*arguments, **options)

    def of_prepared(prepared: Prepared, *arguments: Any, **options: Any) -> simulation.Simulation:
        return in_numpy(prepared.scene, *arguments, **options)

    with (
        peaks_of_samples(),
        patch.object(backend, "simulate", in_numpy),
        patch.object(Prepared, "simulate", of_prepared),
    ):
        yield


def other_legs(
    change: Callable[[tuple[Leg, ...], float], Sequence[Leg]],
) -> AbstractContextManager[Any]:
    """Another schedule, for all backends: ``change`` gets the right legs and the step."""
    original = schedule.lay_steps

    def changed(
        ramps: Sequence[Ramp], end_time: float, dt: float, strokes: Sequence[Stroke]
    ) -> tuple[Leg, ...]:
        return tuple(change(original(ramps, end_time, dt, strokes), dt))

    return patch("hertzchain.scene.scene.lay_steps", changed)


def without_corners(legs: tuple[Leg, ...], dt: float) -> list[Leg]:
    """All steps equal: a corner is met at the end of the step that it lies in."""
    bounds = [math.ceil(leg.end / dt * (1 - 1e-12)) * dt for leg in legs]
    return [
        replace(leg, start=start, end=end, steps=max(1, round((end - start) / dt)))
        for leg, start, end in zip(legs, [0.0, *bounds[:-1]], bounds, strict=True)
        if end > start
    ]


def first_corner_late(legs: tuple[Leg, ...], _: float) -> list[Leg]:
    """The step to the first corner ends a thousandth of the rise late."""
    rise, decay, *rest = legs
    corner = rise.start + 1.001 * (rise.end - rise.start)
    return [replace(rise, end=corner), replace(decay, start=corner), *rest]


def corner_of_the_pulse_late() -> AbstractContextManager[Any]:
    """The pulse itself has its first corner a thousandth late, and the same impulse."""
    original = Pulse.ramps

    def late(pulse: Pulse, rise_time: float) -> tuple[Ramp, Ramp]:
        rise, decay = original(pulse, rise_time)
        corner = 1.001 * rise.end
        return replace(rise, end=corner), replace(decay, start=corner)

    return patch.object(Pulse, "ramps", late)


def native_force_late() -> AbstractContextManager[Any]:
    """The compiled kernels are given the force one step late."""
    original = simulation.leg_rows

    def late(legs: Sequence[Leg], units: Any) -> FloatArray:
        rows = original(legs, units)
        rows[:, 4:6] += ((rows[:, 1] - rows[:, 0]) / rows[:, 2])[:, np.newaxis]
        return rows

    return patch.object(simulation, "leg_rows", late)


def of_the_chain(name: str, factor: float) -> Plant:
    """Another contact stiffness or mass everywhere except in LAMMPS, which computes its own."""
    original = getattr(hc.Chain, name).func
    changed = property(lambda chain: factor * original(chain))
    return lambda: patch.object(hc.Chain, name, changed)


_HERTZ = "hertz/material ${E1} 0.0 ${nu1}"
_NO_FRICTION = "tangential linear_nohistory 0.0 0.0"
_DIAMETER = "set atom 1*12 diameter 0.0095\n"
_DENSITY = "set atom 1*12 density 7958.0\n"
_FIRST = "group first id 1\n"
_CLOSED = "gran/hertz/history"

GRANULE_MASS = "lammps: mass [kg]"
MISSING = "lammps: force of the contacts [N m^-1.5]"
EXPONENT = "lammps: exponent of the contact law"
TANGENTIAL = "lammps: friction [N]"
APPLIED = "lammps: applied force [N]"
SAME_PEAKS = "lammps: peaks, same steps"
MOMENTUM = "lammps: momentum [N s]"
REFERENCE = "native: error of the reference"


def stiffer(factor: str) -> Plant:
    """Young's modulus times a factor, in the deck."""
    return in_set_up((_HERTZ, _HERTZ.replace("${E1}", f"$({factor}*v_E1)")))


def with_friction(law: str) -> Plant:
    """Another tangential force between granules."""
    return in_set_up((_NO_FRICTION, f"tangential {law}"))


def also(commands: str) -> Plant:
    """More commands at the end of what makes the chain."""
    return in_set_up((_FIRST, _FIRST + commands))


MISTAKES = (
    Mistake("stiffness times 1.001", stiffer("1.001"), STIFFNESS),
    Mistake("stiffness times 1 + 1e-9", stiffer("1.000000001"), STIFFNESS),
    Mistake("stiffness times 1.001, gran/hertz/history",
        in_set_up(("${stiffness}", "$(1.001*v_stiffness)")), STIFFNESS, _CLOSED),
    Mistake("stiffness without 1 - nu^2",
        in_set_up((_HERTZ, _HERTZ.replace("${nu1}", "0.0"))), STIFFNESS),
    Mistake("contact law linear", in_set_up((_HERTZ, "hooke 1e7 0.0")), EXPONENT),
    Mistake("mass times 1 + 1e-9",
        in_set_up((_DENSITY, _DENSITY.replace("7958.0", "$(1.000000001*7958.0)"))), GRANULE_MASS),
    Mistake("density set before diameter",
        in_set_up((_DIAMETER + _DENSITY, _DENSITY + _DIAMETER)), GRANULE_MASS),
    Mistake("sites a millionth too far apart",
        in_set_up(("lattice sc 0.0095", "lattice sc 0.0095000095")), POSITION),
    Mistake("force one step late", lambda: force_at("(time-dt)"), APPLIED),
    Mistake("force not dropped after the pulse", force_that_stays, APPLIED),
    Mistake("friction, Mindlin", with_friction("mindlin NULL 1.0 0.5"), TANGENTIAL),
    Mistake("friction, linear", with_friction("linear_history 1e6 1.0 0.5"), TANGENTIAL),
    Mistake("friction, gran/hertz/history",
        in_set_up(("NULL 0.0 0.0 0.0 0", "NULL 0.0 0.0 0.5 0")), TANGENTIAL, _CLOSED),
    Mistake("damping tsuji with e = 1",
        in_set_up((_HERTZ, _HERTZ.replace(" 0.0 ", " 1.0 ") + " damping tsuji")), DAMPING),
    Mistake("damping, gran/hertz/history",
        in_set_up(("NULL 0.0 0.0 0.0 0", "NULL 1.0 0.0 0.0 0")), DAMPING, _CLOSED),
    Mistake("contact 7 missing",
        also("group left id 6\ngroup right id 7\nneigh_modify exclude group left right\n"),
        MISSING),
    Mistake("contacts missing in the skin",
        also("neighbor 0.0 bin\nneigh_modify once yes\n"), SAME_PEAKS),
    Mistake("peaks of samples only, LAMMPS", peaks_of_samples, SAME_PEAKS, read_every=1),
    Mistake("peaks of samples only, everywhere",
        peaks_of_samples_everywhere, REFERENCE, read_every=1),
    Mistake("steps that pass over the corners", lambda: other_legs(without_corners), MOMENTUM),
    Mistake("step to the first corner a thousandth late",
        lambda: other_legs(first_corner_late), APPLIED),
    Mistake("first corner of the pulse a thousandth late", corner_of_the_pulse_late, APPLIED),
    Mistake("force one step late, native", native_force_late, "native: momentum [N s]"),
    Mistake("A of Eq. 1 times 1.001, native", of_the_chain("contact_stiffness", 1.001), STIFFNESS),
    Mistake("m of Eq. 1 times 1.001, native", of_the_chain("granule_mass", 1.001), GRANULE_MASS),
)  # fmt: skip
"""The mistakes: place of each, and the check that names it."""


def small_scene() -> hc.Scene:
    """The demo scene with 12 granules."""
    scene = load("demo")
    return replace(scene, chain=replace(scene.chain, granules=12))


def compared(mistake: Mistake) -> hc.Comparison:
    """Return the comparison under a mistake, with steps of 0.01 natural time units.

    The scene is made under the mistake, because it caches its numbers.
    """
    with mistake.plant():
        scene = (mistake.made_in or small_scene)()
        dt, read_every = 0.01 * scene.contact_time, mistake.read_every
        lammps = hc.Lammps(dt, pair_style=mistake.pair_style, read_every=read_every)
        return hc.compare(scene, [lammps])
