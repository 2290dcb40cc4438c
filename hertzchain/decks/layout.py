"""What a deck that stands alone is made from: its answer, its layout and its steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.deck import check_pair_style
from hertzchain.errors import require
from hertzchain.observables.peaks import judged_contacts
from hertzchain.scene.scene import Scene

ATOMS = ("create", "data")  # granules made in the deck, or read from a data file next to it
WANTED = 1e-6  # of the peaks, lost to absolute coordinates: up to here a deck has the true scene
ROOM = 1.1  # tolerance over the measured error: other steps and intervals put looks elsewhere
ROUNDING = 3  # times the estimate of round-off, which is no bound; 0.2 measured in the gallery
UNCLEAR = 1e-3  # room for round-off from which on a comparison says nothing
_BORDER = 1e-9  # so close to a whole step, LAMMPS and native might count different numbers of them


@dataclass(frozen=True, eq=False)
class KnownAnswer:
    """What a deck has to find, and how well it can with its step and interval."""

    force_ratio: FloatArray  # true peak forces over F0, shape (contacts,)
    error: FloatArray  # relative, of velocity Verlet with the deck's step and interval, (contacts,)

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Contacts that are pressed enough, and as well known as most: not at a sudden end."""
        pressed = judged_contacts(self.force_ratio)
        most = max(UNCLEAR, 10 * float(np.median(self.error[pressed])))
        return np.logical_and(pressed, self.error <= most)

    @property
    def largest_error(self) -> float:
        """Of the contacts that are judged."""
        return float(np.max(self.error[self.judged]))


@dataclass(frozen=True)
class Layout:
    """How a deck is written, without a change to the motion. A SceneError names what cannot be."""

    step: float  # the largest, natural time units; from whole_step
    watch_every: int  # steps between two looks at the overlaps; 0: a lean deck
    pair_style: str = "granular"  # or gran/hertz/history
    atoms: str = "create"  # or data
    data_file: str = "chain.data"  # as the deck names it
    dump_every: int = 0  # steps between two states for OVITO; 0: none
    title: str = "a scene"  # what the deck says it is
    name: str = "THIS_FILE"  # its own, in example commands

    def __post_init__(self) -> None:
        check_pair_style(self.pair_style)
        require(self.atoms in ATOMS, "atoms", self.atoms, f"must be one of {', '.join(ATOMS)}")
        for key, value in (("watch_every", self.watch_every), ("dump_every", self.dump_every)):
            require(value >= 0, key, value, "must be a number of steps, 0 for never")


def whole_step(scene: Scene, step: float) -> float:
    """The step [natural time units], or a little less: deck and native count the same steps."""
    while any(
        round(steps) > 0 and abs(steps - round(steps)) <= max(_BORDER, 1e-14 * steps)
        for steps in (
            (leg.end - leg.start) / (step * scene.units.time)
            for leg in scene.schedule(step * scene.units.time)
        )
    ):
        step = float(f"{step * (1 - 1e-5):.8g}")
    return step
