"""The scenes of a sweep: grids, lists and samples, crossed; scene k follows from its number."""

from __future__ import annotations

import hashlib
import math
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.file import key_named, sections_of
from hertzchain.scene.keys import Key, checked, to_si
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.sweeps.columns import (
    OTHER_MEASURE,
    WALLS,
    Column,
    are_plain,
    base_values,
    changed,
    columns_of,
    full_key,
)

if TYPE_CHECKING:
    import pandas


_MOST_VALUES = 100_000  # most values of a list or a grid (chosen); kept in memory

_FORMS = "A,B,C or LOW:HIGH:COUNT, LOW:HIGH:COUNT:log, or to be sampled LOW:HIGH, LOW:HIGH:log"

Value = float | int | str


def _key(name: str) -> Key:
    key = key_named(name)
    assert key is not None, name
    return key


Form = Literal["list", "linear", "log", "column"]


@dataclass(frozen=True, eq=False)
class Axis:
    """A parameter that varies, by its name in the scene file, and its values in SI or as text.

    The values are a list or a grid, crossed with those of other axes; both ends of a range that is
    sampled; or a column of a table, whose columns vary together: an empty cell is NaN or "", and
    the row has the value of the base.
    """

    name: str
    values: NDArray[Any]
    form: Form
    is_sampled: bool = False

    @property
    def is_crossed(self) -> bool:
        """Whether each value is combined with those of other axes."""
        return self.form != "column" and not self.is_sampled

    def to_dict(self) -> dict[str, Any]:
        """Return the axis as a JSON object, a column by its checksum."""
        if self.form == "list":
            return {"name": self.name, "values": self.values.tolist()}
        if self.form == "column":
            checksum = hashlib.sha256(self.values.tobytes()).hexdigest()
            return {"name": self.name, "rows": self.values.size, "sha256": checksum}
        low, high = map(float, self.values[[0, -1]])
        count = None if self.is_sampled else self.values.size
        return {
            "name": self.name, "low": low, "high": high, "count": count, "log": self.form == "log"
        }  # fmt: skip

    @property
    def ends(self) -> tuple[Value, ...]:
        """Values to check: if these are possible, all are."""
        values = self.values if self.form in ("list", "column") else self.values[[0, -1]]
        return tuple(dict.fromkeys(values[is_given(values)].tolist()))

    def __len__(self) -> int:
        return self.values.size

    def at(self, numbers: NDArray[np.int64]) -> NDArray[Any]:
        """Return the values of the given numbers, from 0."""
        return np.asarray(self.values[numbers])

    def between(self, fraction: FloatArray) -> NDArray[Any]:
        """Return the values of a sampled range at fractions, 0 to 1, of the way between its ends.

        Each whole number has the same share.
        """
        low, high = self.values.tolist()
        if _key(self.name).kind != "int":
            return _between(low, high, fraction, self.form)
        whole = np.floor(_between(low - 0.5, high + 0.5, fraction, self.form) + 0.5)
        return np.clip(whole, low, high).astype(np.int64)


def _between(low: float, high: float, fraction: FloatArray, form: Form) -> FloatArray:
    """Return values between two others, both ends exact to the last digit."""
    if form == "log":
        inside = low ** (1 - fraction) * high**fraction
    else:
        inside = low + fraction * (high - low)
    return np.asarray(np.where(fraction == 0, low, np.where(fraction == 1, high, inside)))


_WITH_UNIT = re.compile(r"(.+?)\s*\[(.+)\]\s*")
"""The head of a column with a unit, such as ``chain.radius [mm]``."""


def is_given(cells: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which cells of a table are not empty."""
    return np.asarray(cells != "" if cells.dtype.kind == "U" else ~np.isnan(cells))


def _axis_of_column(name: str, cells: pandas.Series[Any], unit: str) -> Axis:
    """Return the axis of a column of a table; a SceneError has the number of the row."""
    values = dict[Any, Value]()
    try:
        for cell in cells.dropna().unique().tolist():
            values[cell] = _value(name, cell, unit)
    except TypeError:  # lists and other things
        raise SceneError(name, None, "must have numbers or texts in its cells") from None
    except SceneError as problem:
        rows = 1 + np.flatnonzero((cells == cell).fillna(False))
        more = f" and {rows.size - 1:,} more" if rows.size > 1 else ""
        allowed = f"{problem.allowed} (row {rows[0]}{more} of the table)"
        raise SceneError(problem.key, problem.value, allowed) from None
    empty, kind = ("", str) if _key(name).kind == "str" else (np.nan, float)
    column = cells.map(values).astype(object).where(cells.notna(), empty)
    return Axis(name, column.to_numpy().astype(kind), "column")


def axis_of(name: str, given: str | Iterable[Value]) -> Axis:
    """Return the axis of a parameter, from a list or from text in the form of the command line."""
    if isinstance(given, str) and ":" in given:
        return _range(name, given)
    several = isinstance(given, Iterable) and not isinstance(given, bytes | Mapping)
    several = several and getattr(given, "ndim", 1) == 1  # NumPy's numbers look iterable
    require(several, name, given, f"must be a list of values, or text: {_FORMS}")
    pieces: list[Any] = given.split(",") if isinstance(given, str) else list(given)
    require(0 < len(pieces) <= _MOST_VALUES, name, None, f"must take 1 to {_MOST_VALUES:,} values")
    values = tuple(_value(name, piece) for piece in pieces)
    require(len(set(values)) == len(values), name, None, "must not have a value twice")
    return Axis(name, np.array(values), "list")


def _range(name: str, given: str) -> Axis:
    """Return the axis of ``LOW:HIGH``, with ``:COUNT`` a grid, both also with ``:log``."""
    key, parts = _key(name), [part.strip() for part in given.split(":")]
    if key.kind == "str":
        raise SceneError(name, given, f"has no range: name its values, {','.join(key.choices)}")
    form: Form = "log" if parts[-1] == "log" else "linear"
    numbers = parts[: len(parts) - (form == "log")]
    require(2 <= len(numbers) <= 3, name, given, f"must be {_FORMS}")
    low, high = (float(_value(name, text)) for text in numbers[:2])
    require(low < high, name, given, "LOW must be below HIGH")
    require(form == "linear" or low > 0, name, given, "LOW must be above 0 with :log")
    if len(numbers) == 2:
        return Axis(name, np.array([low, high]), form, is_sampled=True)
    count = int(numbers[2]) if re.fullmatch(r"\d{1,9}", numbers[2]) else 0
    allowed = f"COUNT must be a whole number from 2 to {_MOST_VALUES:,}"
    require(2 <= count <= _MOST_VALUES, name, given, allowed)
    values = _between(low, high, np.arange(count) / (count - 1), form)
    if key.kind != "int":
        return Axis(name, values, form)
    return axis_of(name, [*dict.fromkeys(np.rint(values).astype(np.int64).tolist())])


def _value(name: str, given: Any, unit: str = "") -> Value:
    """Return one value, in SI, of a column with a unit if it is not ""."""
    key = _key(name)
    plain = given.item() if isinstance(given, np.generic) else given
    plain = plain.strip() if isinstance(plain, str) else plain
    if key.kind == "str":
        require(isinstance(plain, str), name, given, f"must be the name of a {key.label}")
        key.check(name, plain)
        return str(plain)
    if unit:
        try:
            plain = f"{float(plain)!r} {unit}"
        except (TypeError, ValueError):
            allowed = f"must be a number without a unit: the unit of its column is {unit}"
            raise SceneError(name, given, allowed) from None
    value: Value = to_si(name, plain, key.unit)
    if key.kind == "int":
        require(float(value).is_integer(), name, given, "must be a whole number")
        value = int(value)
    key.check(name, value)
    if name.endswith("granules"):  # a part of a sweep may hold the peaks several times
        allowed = "must be at most 1,000,000 in a sweep: run a longer chain by itself"
        require(int(value) <= 1_000_000, name, given, allowed)
    return value


def sobol_points(dimensions: int, seed: int, numbers: NDArray[np.int64]) -> FloatArray:
    """Return points of a scrambled Sobol sequence of SciPy, shape (points, dimensions).

    Parameters
    ----------
    dimensions
        Number of coordinates, from 0 to 1 each; 1 to 21,201.
    seed
        Seed of the scrambling.
    numbers
        Which points, counted from 0, shape (points,).
    """
    from scipy.stats import qmc

    engine, points = qmc.Sobol(dimensions, seed=seed), []
    places, order = np.unique(numbers, return_inverse=True)
    for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
        if left_out := int(run[0]) - engine.num_generated:
            engine.fast_forward(left_out)
        with warnings.catch_warnings(action="ignore", category=UserWarning):  # not a power of two
            points.append(engine.random(run.size))
    return np.concatenate(points)[order]


_OF_ELASTIC = {f"{wall}.{key}" for wall in WALLS for key in ("young_modulus", "poisson_ratio")}
MOST_SCENES = 10**8  # most scenes of a sweep, chosen: a day of two cores at a millisecond a scene


@dataclass(frozen=True)
class Design:
    """The scenes of a sweep, numbered from 0: the last axis changes fastest, samples faster still.

    Sampled axes are points of one scrambled sequence; the others are crossed.
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
        return are_plain(self.base, self.names)

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of the table."""
        return columns_of(self.base, self.names)

    @property
    def sampled(self) -> tuple[Axis, ...]:
        """The axes that are sampled."""
        return tuple(axis for axis in self.axes if axis.is_sampled)

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of each axis that is crossed, then the number of samples; or rows of a table."""
        if self.axes[0].form == "column":
            return (len(self.axes[0]),)
        counts = [len(axis) for axis in self.axes if axis.is_crossed]
        return (*counts, *([] if self.samples is None else [self.samples]))

    @property
    def scenes(self) -> int:
        """Number of scenes."""
        return math.prod(self.shape)

    def parameters(self, scenes: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """Return all parameters of some scenes in SI, by name; NaN or "" where one is missing."""
        names = [column.name for column in self.columns if "." in column.name]
        base = base_values(self.base, {*names, *self.names})
        parameters = {name: np.full(scenes.size, value) for name, value in base.items()}
        numbers = np.unravel_index(scenes, self.shape)
        crossed = (axis for axis in self.axes if axis.is_crossed)
        for axis, number in zip(crossed, numbers, strict=False):
            parameters[axis.name] = axis.at(number)
        if self.sampled:
            points = sobol_points(len(self.sampled), self.seed, numbers[-1].astype(np.int64))
            for axis, fraction in zip(self.sampled, points.T, strict=True):
                parameters[axis.name] = axis.between(fraction)
        given = dict.fromkeys(self.names, np.ones(scenes.size, np.bool_))
        for axis in self.axes:
            if axis.form == "column":
                cells, values = axis.at(scenes), parameters[axis.name]
                given[axis.name] = is_given(cells)
                chosen = np.where(given[axis.name], cells, values)
                is_text = chosen.dtype.kind == "U"
                parameters[axis.name] = chosen if is_text else chosen.astype(values.dtype)
        for name, other in OTHER_MEASURE.items():
            if name in given:
                parameters[other] = np.where(given[name], np.nan, parameters[other])
        if segments := (self.base.chain.section or {}).get("segments", []):
            counts = [
                parameters.get(f"chain.segments.{number}.granules", segment["granules"])
                for number, segment in enumerate(segments, start=1)
            ]
            parameters["chain.granules"] = parameters["chain.granules"] * 0 + sum(counts)
        for name in _OF_ELASTIC & parameters.keys():
            is_elastic = parameters[f"{name.partition('.')[0]}.kind"] == "elastic"
            parameters[name] = np.where(is_elastic, parameters[name], np.nan)
        return parameters

    @property
    def some_parameters(self) -> dict[str, NDArray[Any]]:
        """All parameters of evenly spaced scenes, at most 500, which take 0.1 s."""
        some = np.linspace(0, self.scenes - 1, min(self.scenes, 500))
        return self.parameters(some.astype(np.int64))

    def scene(self, parameters: Mapping[str, NDArray[Any]], k: int) -> Scene:
        """Return the k-th scene of these parameters; a missing one is as in the base."""
        cells = {name: parameters[name][[k]] for name in self.names}
        given = {name: cell.item() for name, cell in cells.items() if is_given(cell).all()}
        return changed(self.base, given)

    def to_dict(self) -> dict[str, Any]:
        """Return all data that identify this design, as a JSON object."""
        drawn = {"count": self.samples, "seed": self.seed} if self.sampled else None
        vary = [axis.to_dict() for axis in self.axes]
        return {"scene": sections_of(self.base), "vary": vary, "samples": drawn}


def axes_of(vary: Any, scene: Scene) -> tuple[Axis, ...]:
    """Return the axes of a table, or of values by parameters; for arguments see ``design``."""
    if not isinstance(vary, Mapping) and hasattr(vary, "columns"):
        require(vary.size > 0, "table", None, "must have columns and rows")
        heads = [_WITH_UNIT.fullmatch(str(head)) or str(head).strip() for head in vary.columns]
        named = [(head, "") if isinstance(head, str) else (head[1], head[2]) for head in heads]
        return tuple(
            _axis_of_column(full_key(name, scene), vary.iloc[:, place], unit)
            for place, (name, unit) in enumerate(named)
        )
    allowed = "must be a mapping of at least one parameter to its values, or a table"
    require(isinstance(vary, Mapping) and len(vary) > 0, "vary", None, allowed)
    return tuple(axis_of(full_key(name, scene), given) for name, given in vary.items())


@checked
def design(
    scene: SceneLike,
    vary: Annotated[Mapping[str, str | Iterable[Value]] | pandas.DataFrame, axis_of],
    samples: Annotated[int | None, Key] = None,
    seed: Annotated[int, Key] = 0,
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
    if samples is not None:
        Key(least=1, kind="int").check("samples", samples)
    Key(least=0, most=2**32 - 1, kind="int").check("seed", seed)
    layout = Design(scene, axes, None if samples is None else int(samples), int(seed))
    if layout.sampled and samples is None:
        allowed = (
            "has no count: give one (LOW:HIGH:COUNT), or say how many samples to draw with"
            " --samples (in Python: samples=)"
        )
        raise SceneError(layout.sampled[0].name, None, allowed)
    if samples is not None and not layout.sampled:
        allowed = "are drawn from ranges without a count (LOW:HIGH or LOW:HIGH:log): name one"
        raise SceneError("samples", samples, allowed)
    allowed = f"must be at most {MOST_SCENES:,}: take fewer values, or draw samples"
    require(layout.scenes <= MOST_SCENES, "scenes", layout.scenes, allowed)
    names = [axis.name for axis in axes]
    for k, name in enumerate(names):
        require(name not in names[:k], name, None, "given twice, with its section and without")
        allowed = f"replaces {OTHER_MEASURE.get(name)}: only one of the two can vary"
        require(OTHER_MEASURE.get(name) not in names, name, None, allowed)
    kinds = {axis.name: axis.ends for axis in axes if axis.name.endswith(".kind")}
    for name in _OF_ELASTIC.intersection(names):
        wall = name.partition(".")[0]
        allowed = 'cannot vary: only a wall of kind "elastic" has it, in all scenes'
        wall_kinds = kinds.get(f"{wall}.kind", (getattr(scene, wall).kind,))
        require({*wall_kinds} == {"elastic"}, name, None, allowed)
    parameters, problems = layout.some_parameters, list[SceneError]()
    for k in range(parameters["chain.granules"].size):
        try:
            layout.scene(parameters, k)
        except SceneError as problem:
            problems.append(problem)
        else:
            return layout
    raise problems[0]


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
