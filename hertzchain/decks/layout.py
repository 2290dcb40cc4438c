"""Parameters of a standalone deck: its answer, its layout and its steps."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.rescaling import NONE, Softening, predicted_loss, softening
from hertzchain.engines.lammps.deck import check_pair_style
from hertzchain.errors import require
from hertzchain.observables.peaks import judged_contacts
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

WANTED = 1e-6  # relative error by absolute coordinates up to which a deck has the true chain
ROOM = 1.1  # tolerance over the measured error: other intervals shift the samples
ROUNDING = 3  # factor on the estimate of round-off, which is no bound; measured in the gallery: 0.2
UNCLEAR = 1e-3  # error of a contact above which it is not judged, if others have less


@dataclass(frozen=True, eq=False)
class KnownAnswer:
    """The peaks that a deck has to find, and their errors with its step and interval."""

    force_ratio: FloatArray  # true peak forces over F0, shape (contacts,)
    # relative error of velocity Verlet with the deck's step and interval, (contacts,)
    error: FloatArray
    lost: float = 0.0  # estimated relative error of the peaks by coordinates

    @property
    def allowed(self) -> FloatArray:
        """Tolerance of each peak, a relative error, shape (contacts,)."""
        return ROOM * self.error + ROUNDING * self.lost

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Contacts that are judged: pressed enough, and not affected by the end of the run."""
        pressed = judged_contacts(self.force_ratio)
        most = max(UNCLEAR, 10 * float(np.median(self.error[pressed])))
        return np.logical_and(pressed, self.error <= most)

    @property
    def largest_error(self) -> float:
        """Largest error of the judged contacts."""
        return float(np.max(self.error[self.judged]))


@dataclass(frozen=True)
class Layout:
    """Options of a deck that do not change the motion. A SceneError names an impossible one."""

    step: float  # the largest, natural time units
    watch_every: int  # steps between two samples of the overlaps; 0: a lean deck
    pair_style: str = "granular"  # or gran/hertz/history
    dump_every: int = 0  # steps between two states for OVITO; 0: none
    title: str = "a scene"  # title in the deck
    name: str = "THIS_FILE"  # name of the deck in its example commands

    def __post_init__(self) -> None:
        check_pair_style(self.pair_style)
        for key, value in (("watch_every", self.watch_every), ("dump_every", self.dump_every)):
            require(value >= 0, key, value, "must be a number of steps, 0 for never")


def plain(title: str) -> str:
    """Return a title without signs that could end a comment of LAMMPS, Python or YAML."""
    return re.sub(r"[^\w .,:()+=-]", "_", title)


def similar(scene: Scene, step: float) -> tuple[list[Leg], Softening]:
    """Return the legs of a deck, and its relation to the scene: softer if that saves many digits.

    The step is in natural time units; the legs are those of the similar scene.
    """
    legs = scene.schedule(step * scene.units.time)
    steps = sum(leg.steps for leg in legs)
    made = softening(scene, steps)
    if made.power >= 0 and predicted_loss(scene, steps) <= WANTED:
        made = NONE
    return [made.leg(leg) for leg in legs], made


def what_is_softer(made: Softening) -> str:
    """Return the difference of a deck's chain from that of its scene, in words."""
    return (
        "Coordinates of whole granules leave few digits to overlaps as small as those of this"
        f" scene. The deck has E / 8^{made.power}: overlaps and displacements are 4^{made.power}"
        f" times and all times 2^{made.power} times those of the scene; forces are the same."
    )
