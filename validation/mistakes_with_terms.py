"""Deliberate mistakes in scenes with terms: walls, different granules, gaps, strikers, loads."""

from __future__ import annotations

import re
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps.dialect import NO_FRICTION
from hertzchain.scene.granules import Granules
from validation.planting import DAMPING, POSITION, STIFFNESS, Mistake, in_set_up
from validation.shipped import load

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
