"""The engines: one entry each, read by ``run``, ``compare``, ``doctor`` and every report.

A further engine is a module or folder here and a line in ``_ALL``.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hertzchain.observables.result import Result
    from hertzchain.scene.scene import SceneLike


class Simulator(Protocol):
    """An engine with its numerical parameters."""

    @property
    def name(self) -> str:
        """Name of the engine in the registry."""

    @property
    def time_limit(self) -> float:
        """Time limit of a run [s]."""

    def run(self, scene: SceneLike, record: ArrayLike | None = None) -> Result:
        """Simulate a scene; see ``hertzchain.Native.run``."""


@dataclass(frozen=True)
class Engine:
    """Registry entry of an engine: everything that the rest of the package uses.

    The factory of one with a ``program`` says how to install it, as ``INSTALL``.
    """

    name: str  # name in options, JSON and columns
    label: str  # name in text and plots
    home: str  # module that has the factory, loaded when used
    factory: str  # takes the keywords dt, rtol, extrapolated, time_limit, and perhaps others
    colour: str
    marker: str  # Matplotlib's
    compared: bool = False  # compared by default
    swept: bool = False  # can measure the scenes of sweeps
    program: str | None = None  # program that a user has to install, if any
    writes_decks: bool = False  # whether there are decks for it to run elsewhere

    def make(self, **parameters: Any) -> Simulator:
        """Return the engine with numerical parameters: a frozen object with ``run``."""
        engine: Simulator = self.load()(**parameters)
        return engine

    def load(self) -> Any:
        """Return the factory."""
        return getattr(importlib.import_module(self.home), self.factory)


# Colours of Okabe and Ito, distinct for colour-blind readers.
_ALL = (
    Engine(
        "native", "native", "hertzchain.engines.native.backend", "Native",
        "#000000", ".", compared=True, swept=True,
    ),
    Engine(
        "lammps", "LAMMPS", "hertzchain.engines.lammps.backend", "Lammps",
        "#0072B2", "o", compared=True, swept=True, writes_decks=True,
    ),
    Engine(
        "liggghts", "LIGGGHTS", "hertzchain.engines.liggghts", "Liggghts",
        "#CC79A7", "x", program="liggghts", writes_decks=True,
    ),
    Engine(
        "yade", "Yade", "hertzchain.engines.yade", "Yade",
        "#E69F00", "+", program="yade", writes_decks=True,
    ),
)  # fmt: skip

ENGINES = {engine.name: engine for engine in _ALL}  # in table order; first the reference


def label_of(name: str) -> str:
    """Return the name of an engine in text and plots."""
    return ENGINES[name].label


def others() -> dict[str, Engine]:
    """Return the names of the engines that are compared with native."""
    return {name: engine for name, engine in ENGINES.items() if name != "native"}


def compared_by_default() -> tuple[str, ...]:
    """Return the names of engines compared by default; the others are installed by hand."""
    return tuple(name for name, engine in ENGINES.items() if engine.compared)
