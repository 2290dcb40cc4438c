"""The engines: one entry each, read by ``run``, ``compare``, ``doctor`` and every report.

A further engine is a folder here and a line in ``_ALL``.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hertzchain.observables.result import Result
    from hertzchain.scene.scene import Scene


class Simulator(Protocol):
    """An engine with its numerical parameters."""

    @property
    def time_limit(self) -> float:
        """How long a run may take [s]."""

    def run(self, scene: Scene, record: ArrayLike | None = None) -> Result:
        """Simulate a scene; see ``hertzchain.Native.run``."""


MARKERS = {
    ".": "circle",
    "o": "circle-open",
    "x": "x-thin-open",
    "+": "cross-thin-open",
    "s": "square-open",
    "^": "triangle-up-open",
    "v": "triangle-down-open",
    "D": "diamond-open",
    "*": "star-open",
}
"""Markers of Matplotlib, and what Plotly calls them."""


@dataclass(frozen=True)
class Engine:
    """What the rest of the package knows of an engine."""

    name: str  # in options, JSON and columns
    label: str  # in text and plots
    home: str  # module that has the factory, loaded when used
    factory: str  # takes dt, rtol, extrapolated, time_limit as keywords, and may take others
    colour: str
    marker: str  # of Matplotlib, one of ``MARKERS``
    dash: str  # of Plotly
    compared: bool = False  # where nothing is asked for
    swept: bool = False  # measures the scenes of sweeps
    program: str | None = None  # that a user has to install, if there is one

    def __post_init__(self) -> None:
        if self.marker not in MARKERS:
            raise ValueError(f"marker {self.marker!r} must be one of {' '.join(MARKERS)}")

    def make(self, **parameters: Any) -> Simulator:
        """The engine with numerical parameters: a frozen object with ``run``."""
        factory = getattr(importlib.import_module(self.home), self.factory)
        made: Simulator = factory(**parameters)
        return made


# Okabe and Ito's colours, which the colour-blind tell apart.
_ALL = (
    Engine(
        "native", "native", "hertzchain.engines.native", "Native",
        "#000000", ".", "solid", compared=True, swept=True,
    ),
    Engine(
        "lammps", "LAMMPS", "hertzchain.engines.lammps", "Lammps",
        "#0072B2", "o", "dash", compared=True, swept=True,
    ),
    Engine(
        "liggghts", "LIGGGHTS", "hertzchain.engines.liggghts", "Liggghts",
        "#CC79A7", "x", "dot", program="liggghts",
    ),
    Engine(
        "yade", "Yade", "hertzchain.engines.yade", "Yade",
        "#E69F00", "+", "dashdot", program="yade",
    ),
)  # fmt: skip

ENGINES = {engine.name: engine for engine in _ALL}  # in table order; first the reference


def label_of(name: str) -> str:
    """What people call an engine."""
    return ENGINES[name].label


def others() -> dict[str, Engine]:
    """What is compared with native."""
    return {name: engine for name, engine in ENGINES.items() if name != "native"}


def compared_by_default() -> tuple[str, ...]:
    """Names of what is compared where nothing is asked for: all else is installed by hand."""
    return tuple(name for name, engine in ENGINES.items() if engine.compared)
