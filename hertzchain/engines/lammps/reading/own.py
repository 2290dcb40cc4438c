"""Reads the deck that this project generates for a scene: the same probes, but without motion.

This is quick, as only the corners of the shock and some steps between them are examined.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps.binary import Program
from hertzchain.engines.lammps.reading.assembling import found_of
from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.engines.lammps.reading.prober import Sizes
from hertzchain.engines.lammps.reading.reading import Source, Start, probed, without_motion
from hertzchain.scene.scene import Scene

DEPTH = 0.01
"""Overlap at which contacts are pressed [smallest radius], and a third, a tenth, a hundredth and
three times of it: independent of the shock, so that forces have all digits even if it is weak."""

_SCHEDULED_STEP = 0.01  # natural time units; step of the schedule whose corners are examined
_STEPS_PER_LEG = 4  # readings of the applied force on a leg, besides its start


def examine_deck(folder: Path, scene: Scene, text: str, program: Program | None) -> FoundDeck:
    """Return what LAMMPS finds in the deck of a scene; the folder outlives the process."""
    path = folder / "in.generated"
    path.write_text(text)
    start, source = Start(folder, program, alone=False), Source("generated", path, folder)
    probes, _ = probed(start, source, replace(Sizes.of(scene), overlap=DEPTH))
    driven = np.zeros(probes.granules.count, bool)
    seen, applied = without_motion(start, source, probes, 0.0, driven)
    return found_of(probes, seen, applied, backwards=False)


def own_deck(scene: Scene, pair_style: str, version: str) -> str:
    """Return the generated deck, with a few steps on each leg of the shock."""
    legs = [
        leg.in_steps(_STEPS_PER_LEG) for leg in scene.schedule(_SCHEDULED_STEP * scene.units.time)
    ]
    lines = [deck.set_up(scene, pair_style, version)]
    for before, leg in zip((None, *legs[:-1]), legs, strict=True):
        lines += [*deck.leg_commands(scene, leg, before), f"run {leg.steps}"]
    return "\n".join(lines) + "\n"
