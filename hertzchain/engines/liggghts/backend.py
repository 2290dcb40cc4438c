"""The LIGGGHTS backend: runs a scene and returns its result."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np

from hertzchain.engines.external.engine import Found, ProgramEngine
from hertzchain.engines.external.readings import Granules, read_frames
from hertzchain.engines.external.terms import OF_OTHER_CODES, refuse_damping_of_wall
from hertzchain.engines.liggghts import deck
from hertzchain.engines.liggghts.deck import models, refuse_damping
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene

_LOG = "log.liggghts"


@dataclass(frozen=True)
class Liggghts(ProgramEngine):
    """A generated deck, run by the program ``liggghts``, a fork of LAMMPS.

    Each run starts the program, which takes half a second. It accepts Poisson's ratios from 0 to
    0.5, restitutions above 0.05, and dashpots in contacts that may pull.

    Parameters
    ----------
    program
        Path of the program, or its name on the search path.
    dt, read_every, rtol, extrapolated, time_limit, wanted
        As for ``Lammps``; impossible ones raise a SceneError.
    """

    LABEL: ClassVar[str] = "LIGGGHTS"
    FILE: ClassVar[str] = "in.chain"
    INSTALL: ClassVar[str] = "apt install liggghts"
    FASTEST: ClassVar[tuple[float, float]] = (0.3e-6, 8e-9)  # 4e-6 measured with 60 granules
    TERMS: ClassVar[tuple[str, ...]] = OF_OTHER_CODES
    ENVIRONMENT: ClassVar[dict[str, str]] = {"OMP_NUM_THREADS": "1"}

    WRITER: ClassVar[ModuleType] = deck

    program: str = "liggghts"

    def method_of(self, scene: Scene) -> str:
        """Return the name of the method in the result."""
        used = " + ".join(model for model, _ in models(scene.contact))
        return f"velocity-verlet, gran model {used}"

    def _refuse(self, scene: Scene) -> None:
        refuse_damping(scene.contact)
        refuse_damping_of_wall("LIGGGHTS", scene)
        for whose, ratio in _poisson_ratios(scene):
            if ratio < 0:
                raise RunFailed(
                    f"LIGGGHTS has no Poisson's ratio below 0, this {whose} has {ratio:g}: take"
                    " another backend"
                )

    def _command(self, program: str) -> list[str]:
        return [program, "-in", self.FILE, "-log", _LOG, "-echo", "none"]

    def _found(self, folder: Path, scene: Scene) -> Found:
        _, rest = read_frames(folder / deck.AT_REST, deck.GRANULES)
        _, frames = read_frames(folder / deck.READINGS, deck.columns_of(scene))
        # The force on the wall is opposite to that on the last granule.
        count = len(deck.COLUMNS)
        wall_force = None if scene.wall is None else -np.sum(frames[:, count:, -1], axis=1)
        readings = frames[:, :count]
        return Found(_version(folder / _LOG), Granules(*rest[0]), readings, wall_force)


def _poisson_ratios(scene: Scene) -> list[tuple[str, float]]:
    """Yield the lowest Poisson's ratio of the chain, and that of an elastic wall."""
    ratios = [("chain", float(np.min(scene.granules.poisson_ratio)))]
    if scene.wall is not None and scene.wall.poisson_ratio is not None:
        ratios.append(("wall", scene.wall.poisson_ratio))
    return ratios


def _version(log: Path) -> str:
    """Return the version, from the first line of a log."""
    with log.open(encoding="utf-8", errors="replace") as lines:
        first = lines.readline()
    match = re.search(r"LIGGGHTS\S* \d\S*\d", first)
    return match.group() if match else "unknown"
