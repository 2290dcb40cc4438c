"""The Yade backend: runs a scene and returns its result."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.engine import Found, ProgramEngine
from hertzchain.engines.external.readings import Granules
from hertzchain.engines.external.terms import OF_OTHER_CODES, refuse_damping_of_wall
from hertzchain.engines.yade import deck
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene


@dataclass(frozen=True)
class Yade(ProgramEngine):
    """A generated script, run by the program ``yade``.

    Each run starts Yade, which takes 1.4 s. A step of 60 granules takes 5e-5 s, about half of it
    for a Python function that applies the force and reads the state at each step. Yade has one law
    of damping, that with a restitution, in contacts that do not pull. While it runs, Yade listens
    on a port of this machine, protected by a password; no option turns this off.

    Parameters
    ----------
    program
        Path of the program, or its name on the search path.
    dt, read_every, rtol, extrapolated, time_limit, wanted
        As for ``Lammps``; impossible ones raise a SceneError.
    """

    LABEL: ClassVar[str] = "Yade"
    FILE: ClassVar[str] = "chain.py"
    INSTALL: ClassVar[str] = "apt install yade"
    FASTEST: ClassVar[tuple[float, float]] = (3e-6, 1e-7)  # 4e-5 and 4e-7 measured
    TERMS: ClassVar[tuple[str, ...]] = OF_OTHER_CODES
    # Yade's own Python cannot use the modules of this one.
    ENVIRONMENT: ClassVar[dict[str, str]] = {"PYTHONPATH": ""}

    WRITER: ClassVar[ModuleType] = deck

    program: str = "yade"

    def method_of(self, scene: Scene) -> str:  # noqa: ARG002 - the same for all
        """Return the name of the method in the result."""
        return "velocity-verlet, MindlinPhys"

    def _refuse(self, scene: Scene) -> None:
        refuse_damping_of_wall("Yade", scene)
        contact = scene.contact
        if contact is not None and contact.restitution is None:
            raise RunFailed(
                f"Yade has no {contact.damping} damping with Hertz's law: take damping ="
                ' "restitution", or another backend'
            )
        if contact is not None and contact.attraction:
            raise RunFailed(
                "contacts never pull in Yade: leave out attraction, or take another backend"
            )

    def _command(self, program: str) -> list[str]:
        return [program, "-n", "-x", "-j1", self.FILE]

    def _found(self, folder: Path, scene: Scene) -> Found:
        granules = scene.chain.granules
        rest = read_array(folder / deck.AT_REST, (3, None))
        readings = read_array(folder / deck.READINGS, (None, 3, granules))
        wall_force = None
        if scene.wall is not None:
            path = folder / deck.WALL_FORCE
            wall_force = read_array(path, (len(readings),))
        version = (folder / deck.VERSION).read_text(encoding="utf-8")
        return Found(version, Granules(*rest), readings, wall_force)


def read_array(path: Path, shape: tuple[int | None, ...]) -> FloatArray:
    """Read an array that a run left in a file (.npy); in ``shape`` None stands for any length."""
    try:
        array = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as problem:
        raise RunFailed(f"Yade left no readings that can be read ({problem})") from None
    right = array.dtype == np.float64 and array.ndim == len(shape)
    if not right or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
        raise RunFailed("Yade left readings of another shape: is the disk full?")
    return np.asarray(array, np.float64)
