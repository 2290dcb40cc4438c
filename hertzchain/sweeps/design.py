"""The scenes of a sweep: grids, lists and samples, crossed; scene k follows from its number."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.arguments import checked
from hertzchain.scene.file import sections_of
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.sweeps.axes import (
    Axis,
    Span,
    Tabled,
    Value,
    axes_of_table,
    axis_of,
    check_granules,
    is_given,
    is_whole,
    key_of,
)
from hertzchain.sweeps.columns import (
    ALL,
    OTHER_MEASURE,
    PARAMETERS,
    Column,
    columns_of,
)
from hertzchain.sweeps.keys import WALLS, base_values, changed, full_name
from hertzchain.sweeps.points import sobol_points

if TYPE_CHECKING:
    import pandas

_OF_ELASTIC = {f"{wall}.{key}" for wall in WALLS for key in ("young_modulus", "poisson_ratio")}
_TRIED = 64  # scenes that are tried before a sweep, if the first are impossible, chosen
MOST_SCENES = 10**8  # most scenes of a sweep, chosen: a day of two cores at a millisecond a scene


@dataclass(frozen=True)
class Design:
    """The scenes of a sweep, numbered from 0: the last axis changes fastest, samples faster still.

    Axes without a count are sampled together, as points of one scrambled sequence; the others are
    crossed.
    """

    base: Scene
    axes: tuple[Axis, ...]
    samples: int | None = None
    seed: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that differ from the base."""
        return tuple(axis.name for axis in self.axes)

    @property
    def are_plain(self) -> bool:
        """True if no scene can have terms."""
        known = all(axis.name in PARAMETERS for axis in self.axes)
        free = self.base.is_plain and not self.base.gauges
        return known and free and self.base.chain.section is None

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the table."""
        if self.are_plain:
            return ALL
        return columns_of(sections_of(self.base), self.names)

    @property
    def grid(self) -> tuple[Axis, ...]:
        """The axes that are crossed."""
        return tuple(axis for axis in self.axes if axis.count is not None)

    @property
    def sampled(self) -> tuple[Span, ...]:
        """The axes that are sampled."""
        return tuple(axis for axis in self.axes if isinstance(axis, Span) and axis.count is None)

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of each axis that is crossed, then the number of samples."""
        if rows := [len(axis.cells) for axis in self.axes if isinstance(axis, Tabled)]:
            return (rows[0],)
        counts = [axis.count or 0 for axis in self.grid]
        return (*counts, self.samples) if self.samples is not None else tuple(counts)

    @property
    def scenes(self) -> int:
        """Number of scenes."""
        return math.prod(self.shape)

    def parameters(self, scenes: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """Return all parameters of scenes in SI, by name, shape (some,); NaN or "" for none."""
        names = [one.name for one in self.columns if "." in one.name]
        base = base_values(self.base, {*names, *self.names})
        found = {name: np.full(scenes.size, value) for name, value in base.items()}
        numbers = np.unravel_index(scenes, self.shape)
        for axis, number in zip(self.grid, numbers, strict=False):
            found[axis.name] = axis.at(number.astype(np.int64))
        if self.sampled:
            points = self._points(numbers[-1].astype(np.int64))
            for axis, fraction in zip(self.sampled, points.T, strict=True):
                found[axis.name] = axis.between(fraction)
        given = {name: np.ones(scenes.size, np.bool_) for name in self.names}
        for axis in self.axes:
            if isinstance(axis, Tabled):
                cells, values = axis.at(scenes), found[axis.name]
                given[axis.name] = is_given(cells)
                kind = cells.dtype if values.dtype.kind == "U" else values.dtype
                column = np.where(given[axis.name], cells, values)
                found[axis.name] = column if kind.kind == "U" else column.astype(kind)
        for name, other in OTHER_MEASURE.items():
            if name in given:
                found[other] = np.where(given[name], np.nan, found[other])
        return self._of_file(found)

    def _of_file(self, found: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Return parameters as in scene files: granules of all segments, materials of walls."""
        segments = (self.base.chain.section or {}).get("segments", [])
        if segments:
            counts = [
                found.get(f"chain.segments.{number}.granules", segment["granules"])
                for number, segment in enumerate(segments, start=1)
            ]
            found["chain.granules"] = found["chain.granules"] * 0 + sum(counts)
        for name in _OF_ELASTIC & found.keys():
            is_elastic = found[f"{name.partition('.')[0]}.kind"] == "elastic"
            found[name] = np.where(is_elastic, found[name], np.nan)
        return found

    def _points(self, samples: NDArray[np.int64]) -> FloatArray:
        """Return the points with these numbers in the unit cube, shape (some, sampled axes)."""
        return sobol_points(len(self.sampled), self.seed, samples)

    def scene(self, parameters: Mapping[str, NDArray[Any]], k: int) -> Scene:
        """Return the k-th scene of these parameters; a missing one is as in the base."""
        cells = {name: parameters[name][[k]] for name in self.names}
        given = {name: cell.item() for name, cell in cells.items() if is_given(cell).all()}
        return changed(self.base, given)

    def to_dict(self) -> dict[str, Any]:
        """Return all data that identify this design, as a JSON object."""
        drawn = {"count": self.samples, "seed": self.seed} if self.sampled else None
        vary = [
            {"name": axis.name, "rows": len(axis.cells), "sha256": _checksum(axis.cells)}
            if isinstance(axis, Tabled)
            else asdict(axis)
            for axis in self.axes
        ]
        return {"scene": sections_of(self.base), "vary": vary, "samples": drawn}


def axes_of(vary: Any, scene: Scene) -> tuple[Axis, ...]:
    """Return the axes of a table, or of values by parameters; arguments are those of ``design``."""
    if not isinstance(vary, Mapping) and hasattr(vary, "columns"):
        axes = axes_of_table(vary, lambda name: full_name(name, scene))
        require(len(axes) > 0 and len(vary) > 0, "table", None, "must have columns and rows")
        return axes
    allowed = "must be a mapping of at least one parameter to its values, or a table"
    require(isinstance(vary, Mapping) and len(vary) > 0, "vary", None, allowed)
    return tuple(axis_of(full_name(name, scene), given) for name, given in vary.items())


@checked
def design(
    scene: SceneLike,
    vary: Annotated[Mapping[str, str | Iterable[Value]] | pandas.DataFrame, axis_of],
    samples: Annotated[int | None, is_whole] = None,
    seed: Annotated[int, is_whole] = 0,
) -> Design:
    """Return the scenes of a sweep.

    Parameters
    ----------
    scene
        The scene that all others are derived from, or the path of its file.
    vary
        For each parameter, by its name in the scene file (the section may be left out), its values:
        a list, as text (``"A,B,C"``) or as numbers and names; a grid ``"LOW:HIGH:COUNT"`` or
        ``"LOW:HIGH:COUNT:log"``, including both ends; or ``"LOW:HIGH"`` and ``"LOW:HIGH:log"``,
        between which points are sampled. Text may have units (``"1 mm:10 mm:5"``).
        ``shock.momentum_ratio`` and ``shock.rise_time`` replace each other. Segments and the
        granules of their cells are counted from 1: ``chain.segments.2.cell.1.radius``. Or a pandas
        table with one row for each scene and these names as columns, also with a unit
        (``chain.radius [mm]``); an empty cell has the value of the scene.
    samples
        Number of points for all sampled ranges together, from a scrambled Sobol sequence. Every
        combination of the other parameters gets all of these points.
    seed
        Seed of the sequence: another number gives other points.

    Raises
    ------
    SceneError
        For a parameter that does not exist or cannot vary, an empty range, a value that a key
        does not allow, samples without ranges or ranges without samples, too many scenes, and
        where no scene is possible.
    """
    scene = to_scene(scene)
    axes = axes_of(vary, scene)
    allowed = "must be a whole number of at least 1"
    require(samples is None or is_whole(samples, 1), "samples", samples, allowed)
    within = is_whole(seed, 0) and seed < 2**32
    require(within, "seed", seed, "must be a whole number from 0 to 4294967295")
    found = Design(scene, axes, None if samples is None else int(samples), int(seed))
    if found.sampled and samples is None:
        allowed = (
            "has no count: give one (LOW:HIGH:COUNT), or say how many samples to draw with"
            " --samples (in Python: samples=)"
        )
        raise SceneError(found.sampled[0].name, None, allowed)
    if samples is not None and not found.sampled:
        allowed = "are drawn from ranges without a count (LOW:HIGH or LOW:HIGH:log): name one"
        raise SceneError("samples", samples, allowed)
    allowed = f"must be at most {MOST_SCENES:,}: take fewer values, or draw samples"
    require(found.scenes <= MOST_SCENES, "scenes", found.scenes, allowed)
    names = [axis.name for axis in axes]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    require(twice is None, str(twice), None, "given twice, with its section and without")
    both = "shock.momentum_ratio" in names and "shock.rise_time" in names
    allowed = "replaces shock.rise_time: only one of the two can vary"
    require(not both, "shock.momentum_ratio", None, allowed)
    check_granules("chain.granules", scene.chain.granules)
    kinds = {axis.name.partition(".")[0]: axis.ends for axis in axes if key_of(axis.name) == "kind"}
    for name in (name for name in names if name in _OF_ELASTIC):
        wall = name.partition(".")[0]
        own = kinds.get(wall, (getattr(scene, wall).kind,))
        allowed = 'cannot vary: only a wall of kind "elastic" has it, in all scenes'
        require({*own} == {"elastic"}, name, None, allowed)
    _refuse_impossible(found)
    return found


def scenes(
    scene: SceneLike,
    table: Annotated[Mapping[str, str | Iterable[Value]] | pandas.DataFrame, design],
    samples: Annotated[int | None, design] = None,
    seed: Annotated[int, design] = 0,
) -> list[Scene]:
    """Return the scenes of a table, one for each row, in the order of the rows.

    Parameters
    ----------
    scene, table, samples, seed
        As for ``design``: a pandas table, or the values of each parameter.

    Raises
    ------
    SceneError
        As ``design``, and for values that are impossible together.
    """
    every = design(scene, table, samples, seed)
    parameters = every.parameters(np.arange(every.scenes))
    return [every.scene(parameters, k) for k in range(every.scenes)]


def _checksum(values: NDArray[Any]) -> str:
    return hashlib.sha256(values.tobytes()).hexdigest()


def _refuse_impossible(found: Design) -> None:
    """Raise the reason of the first of evenly spaced scenes, if none of them is possible."""
    tried = np.unique(np.linspace(0, found.scenes - 1, _TRIED).astype(np.int64))
    parameters = found.parameters(tried)
    first = None
    for k in range(tried.size):
        try:
            found.scene(parameters, k)
        except SceneError as problem:
            first = first or problem
        else:
            return
    if first is not None:
        raise first
