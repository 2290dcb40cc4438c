"""Which scenes a sweep has: grids, lists and samples of parameters, crossed with one another.

No scene is made before it is needed: what varies is kept as it was given, and scene k follows from
its number.
"""

from __future__ import annotations

import difflib
import math
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, is_finite, require
from hertzchain.scene.pulse import PulseTable
from hertzchain.scene.quantities import to_si
from hertzchain.scene.scene import UNITS, Run, Scene, require_scene

PARAMETERS = (
    "chain.granules",
    "chain.radius",
    "chain.young_modulus",
    "chain.poisson_ratio",
    "chain.density",
    "shock.profile",
    "shock.peak_force",
    "shock.duration_ratio",
    "shock.momentum_ratio",
    "shock.rise_time",
    "run.end_time",
)
"""What can vary, as the scene file names it."""

MOST_SCENES = 10**8
"""Of a sweep: a day of two cores where a scene takes a millisecond. Chosen."""

MOST_GRANULES = 1_000_000
"""Of a chain in a sweep: a part may have its peaks in memory several times. Chosen."""

_MOST_LISTED = 100_000
"""Values of one list; they are kept in memory and with the sweep."""

_FORMS = "A,B,C or LOW:HIGH:COUNT, LOW:HIGH:COUNT:log, or to be sampled LOW:HIGH, LOW:HIGH:log"

Value = float | int | str


@dataclass(frozen=True)
class Listed:
    """A parameter that takes values one by one.

    Parameters
    ----------
    name
        Of the parameter, as the scene file has it.
    values
        In SI; text for profiles.
    """

    name: str
    values: tuple[Value, ...]

    @property
    def count(self) -> int:
        """How many values there are."""
        return len(self.values)

    @property
    def ends(self) -> tuple[Value, ...]:
        """Values that have to be possible for all to be."""
        return self.values

    def at(self, index: NDArray[np.int64]) -> NDArray[Any]:
        """The values of these numbers."""
        return np.asarray(self.values)[index]


@dataclass(frozen=True)
class Span:
    """A parameter that takes values between two, equally spaced or drawn.

    Parameters
    ----------
    name
        Of the parameter, as the scene file has it.
    low, high
        The ends, in SI; both are taken by a grid.
    count
        Of values on a grid; None for one that is sampled.
    log
        Whether logarithms are equally spaced, or drawn.
    """

    name: str
    low: float
    high: float
    count: int | None
    log: bool

    @property
    def ends(self) -> tuple[Value, ...]:
        """Values that have to be possible for all to be."""
        ends = self.low, self.high
        return tuple(map(int, ends)) if self.name == "chain.granules" else ends

    def at(self, index: NDArray[np.int64]) -> NDArray[Any]:
        """The values of these numbers on the grid."""
        assert self.count is not None
        return self.between(index / max(self.count - 1, 1))

    def between(self, fraction: FloatArray) -> NDArray[Any]:
        """The values at fractions of the way from one end to the other, 0 to 1."""
        if self.name == "chain.granules":  # each whole number has the same share
            if self.log:
                edges = self.low - 0.5, self.high + 0.5
                drawn = edges[0] * (edges[1] / edges[0]) ** fraction
                return np.clip(np.rint(drawn), self.low, self.high).astype(np.int64)
            share = np.floor(self.low + fraction * (self.high - self.low + 1))
            return np.clip(share, self.low, self.high).astype(np.int64)
        if self.log:
            inside = self.low ** (1 - fraction) * self.high**fraction
        else:
            inside = self.low + fraction * (self.high - self.low)
        # Both ends to the last digit.
        return np.where(fraction == 0, self.low, np.where(fraction == 1, self.high, inside))


Axis = Listed | Span


@dataclass(frozen=True)
class Design:
    """The scenes of a sweep, numbered from 0: the last axis changes first, samples before it.

    Parameters
    ----------
    base
        What all of them have in common.
    axes
        What varies. Those without a count are sampled together, all others crossed.
    samples
        Points that are drawn in the space of all axes without a count; None where there are none.
    seed
        Of the drawn points.
    """

    base: Scene
    axes: tuple[Axis, ...]
    samples: int | None = None
    seed: int = 0

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
        counts = [axis.count or 0 for axis in self.grid]
        return (*counts, self.samples) if self.samples is not None else tuple(counts)

    @property
    def scenes(self) -> int:
        """How many scenes there are."""
        return math.prod(self.shape)

    def some(self, most: int) -> NDArray[np.int64]:
        """The numbers of scenes that show what all are like, not many more than so many.

        The first samples of combinations all over the grid: to draw a sample those before it have
        to be passed.
        """
        drawn = self.samples or 1
        first = np.arange(min(drawn, math.isqrt(most)))
        combinations = self.scenes // drawn
        spread = np.linspace(0, combinations - 1, max(1, most // first.size)).astype(np.int64)
        return (np.unique(spread)[:, None] * drawn + first).ravel()

    def parameters(self, scenes: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """The parameters of scenes, by name: all of them, NaN or "" where a scene has none.

        Parameters
        ----------
        scenes
            Their numbers, increasing, shape (some,).

        Returns
        -------
        dict
            Arrays of that shape, in SI; ``shock.momentum_ratio`` and ``shock.rise_time`` as given.
        """
        base = _flat(self.base)
        found = {name: np.full(scenes.size, base[name]) for name in PARAMETERS}
        numbers = np.unravel_index(scenes, self.shape)
        for axis, number in zip(self.grid, numbers, strict=False):
            found[axis.name] = axis.at(number.astype(np.int64))
        if self.sampled:
            points = self._points(numbers[-1].astype(np.int64))
            for axis, fraction in zip(self.sampled, points.T, strict=True):
                found[axis.name] = axis.between(fraction)
        names = {axis.name for axis in self.axes}
        for given, other in (("momentum_ratio", "rise_time"), ("rise_time", "momentum_ratio")):
            if f"shock.{given}" in names:
                found[f"shock.{other}"] = np.full(scenes.size, np.nan)
        return found

    def _points(self, samples: NDArray[np.int64]) -> FloatArray:
        """Points of these numbers in the unit cube, shape (some, sampled axes)."""
        from scipy.stats import qmc

        sequence = qmc.Sobol(len(self.sampled), scramble=True, seed=self.seed)
        wanted, place = np.unique(samples, return_inverse=True)
        drawn = []
        # A part that ends with one combination's last samples has the next one's first.
        for run in np.split(wanted, np.nonzero(np.diff(wanted) > 1)[0] + 1):
            if skipped := int(run[0]) - sequence.num_generated:
                sequence.fast_forward(skipped)
            with warnings.catch_warnings():
                # Only powers of two are balanced to the last point; others are but for a few.
                warnings.simplefilter("ignore", UserWarning)
                drawn.append(sequence.random(run.size))
        points: FloatArray = np.concatenate(drawn)[place]
        return points

    def scene(self, parameters: Mapping[str, NDArray[Any]], k: int) -> Scene:
        """The k-th of the scenes that these parameters are of.

        Raises
        ------
        SceneError
            If its values, each possible in itself, are not possible together.
        """
        return _with(self.base, {name: values[k].item() for name, values in parameters.items()})

    def to_dict(self) -> dict[str, Any]:
        """What tells this design from others, as JSON knows it."""
        base = self.base
        shock: dict[str, Any] = (
            {"time_s": base.shock.time, "force_N": base.shock.force}
            if isinstance(base.shock, PulseTable)
            else asdict(base.shock)
        )
        scene = {"chain": asdict(base.chain), "shock": shock, "run": asdict(base.run)}
        drawn = None
        if self.sampled:
            from importlib.metadata import version

            drawn = {"count": self.samples, "seed": self.seed, "scipy": version("scipy")}
        return {"scene": scene, "vary": [asdict(axis) for axis in self.axes], "samples": drawn}


def design(
    scene: Scene,
    vary: Mapping[str, str | Iterable[Value]],
    samples: int | None = None,
    seed: int = 0,
) -> Design:
    """The scenes that a sweep is about.

    Parameters
    ----------
    scene
        What all of them have in common.
    vary
        By the name of a parameter, as ``PARAMETERS`` has them (the section may be left out), what
        it takes: values, as text
        (``"A,B,C"``) or as numbers and names; a grid of ``"LOW:HIGH:COUNT"`` or
        ``"LOW:HIGH:COUNT:log"``, both ends taken; or ``"LOW:HIGH"`` and ``"LOW:HIGH:log"``, between
        which points are drawn. Text may have units (``"1 mm:10 mm:5"``). ``shock.momentum_ratio``
        and ``shock.rise_time`` take each other's place.
    samples
        How many points are drawn, for all such ranges together. They are those of a scrambled
        Sobol sequence, and met by every combination of all that does not range.
    seed
        Other points for another number.

    Raises
    ------
    SceneError
        For a parameter that does not exist or cannot vary, a range that is empty, a value that is
        not possible, samples without ranges or ranges without samples, and too many scenes.
    """
    require_scene(scene)
    allowed = "must be a mapping that names at least one parameter and what it takes"
    require(isinstance(vary, Mapping) and len(vary) > 0, "vary", None, allowed)
    axes = tuple(_axis(_full(name), given) for name, given in vary.items())
    allowed = "must be a whole number of at least 1"
    require(samples is None or _is_whole(samples, 1), "samples", samples, allowed)
    within = _is_whole(seed, 0) and seed < 2**32
    require(within, "seed", seed, "must be a whole number from 0 to 4294967295")
    found = Design(scene, axes, None if samples is None else int(samples), int(seed))
    if found.sampled and samples is None:
        allowed = "has no count: give one (LOW:HIGH:COUNT), or say how many samples to draw"
        raise SceneError(found.sampled[0].name, None, allowed)
    if samples is not None and not found.sampled:
        allowed = "are drawn from ranges without a count (LOW:HIGH or LOW:HIGH:log): name one"
        raise SceneError("samples", samples, allowed)
    allowed = f"must be at most {MOST_SCENES:,}: take fewer values, or draw samples"
    require(found.scenes <= MOST_SCENES, "scenes", found.scenes, allowed)
    names = [axis.name for axis in axes]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    require(twice is None, str(twice), None, "is there twice, with its section and without")
    both = "shock.momentum_ratio" in names and "shock.rise_time" in names
    allowed = "takes the place of shock.rise_time: only one of the two can vary"
    require(not both, "shock.momentum_ratio", None, allowed)
    _check(scene, "chain.granules", scene.chain.granules)
    for axis in axes:
        for value in axis.ends:
            _check(scene, axis.name, value)
    return found


def _full(name: object) -> str:
    """The name of a parameter, whose section may have been left out."""
    full = [one for one in PARAMETERS if name in (one, one.partition(".")[2])]
    key = str(name).rpartition(".")[2]
    meant = [one for one in PARAMETERS if one.partition(".")[2] == key]
    meant = meant or difflib.get_close_matches(str(name), PARAMETERS, n=1)
    hint = f"did you mean {meant[0]}? What can is" if meant else "what can is"
    allowed = f"cannot vary; {hint} {', '.join(PARAMETERS)}"
    require(len(full) == 1, str(name), None, allowed)
    return full[0]


def _axis(name: str, given: str | Iterable[Value]) -> Axis:
    if isinstance(given, str) and ":" in given:
        return _range(name, given)
    several = isinstance(given, Iterable) and not isinstance(given, bytes | Mapping)
    several = several and getattr(given, "ndim", 1) == 1  # NumPy's numbers look iterable
    require(several, name, given, f"must be a list of values, or text: {_FORMS}")
    pieces: list[Any] = given.split(",") if isinstance(given, str) else list(given)
    require(0 < len(pieces) <= _MOST_LISTED, name, None, f"must take 1 to {_MOST_LISTED:,} values")
    values = tuple(_value(name, piece) for piece in pieces)
    require(len(set(values)) == len(values), name, None, "must not take a value twice")
    return Listed(name, values)


def _range(name: str, given: str) -> Axis:
    numeric = name != "shock.profile"
    require(numeric, name, given, "has no range: name its values, cosine,triangular")
    low_text, high_text, *rest = (piece.strip() for piece in given.split(":"))
    log = bool(rest) and rest[-1] == "log"
    rest = rest[: len(rest) - log]
    require(len(rest) <= 1, name, given, f"must be {_FORMS}")
    low, high = float(_value(name, low_text)), float(_value(name, high_text))
    require(is_finite(low) and is_finite(high), name, given, "must be between finite numbers")
    require(low < high, name, given, "is empty: the first end must be below the second")
    require(not log or low > 0, name, given, "must be above 0 at both ends to be logarithmic")
    if not rest:
        return Span(name, low, high, None, log)
    allowed = "must have at least 2 values, a whole number: LOW:HIGH:COUNT"
    count = _count(rest[0])
    require(count >= 2, name, given, allowed)
    span = Span(name, low, high, count, log)
    if name != "chain.granules":
        return span
    # Whole numbers as near to the grid as there are, each of them once.
    require(count <= _MOST_LISTED, name, given, f"must take at most {_MOST_LISTED:,} values")
    spaced = np.geomspace if log else np.linspace
    whole = np.rint(spaced(low, high, count)).astype(np.int64)
    return Listed(name, tuple(dict.fromkeys(whole.tolist())))


def _count(text: str) -> int:
    """A whole number, 1e3 too; 0 for what is none."""
    try:
        number = float(text)
    except ValueError:
        return 0
    return int(number) if number.is_integer() else 0


def _is_whole(value: object, least: int) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool) and int(value) >= least


def _value(name: str, given: Any) -> Value:
    """One value, in SI."""
    key = name.partition(".")[2]
    if key == "profile":
        require(isinstance(given, str), name, given, "must be the name of a profile")
        return str(given).strip()
    number = given.item() if isinstance(given, np.generic) else given
    number = to_si(name, number.strip() if isinstance(number, str) else number, UNITS.get(key, ""))
    if key == "granules":
        require(number.is_integer(), name, given, "must be a whole number")
        return int(number)
    return number


def _check(scene: Scene, name: str, value: Value) -> None:
    """Refuse a value that no scene can have, whatever else varies."""
    section, _, key = name.partition(".")
    part: Any = {"chain": scene.chain, "shock": scene.shock, "run": scene.run}[section]
    is_table = section == "shock" and isinstance(part, PulseTable)
    require(not is_table, name, None, "cannot vary: the shock is a pulse table")
    if key == "granules" and isinstance(value, int):
        allowed = f"must be at most {MOST_GRANULES:,} in a sweep: run a longer chain by itself"
        require(value <= MOST_GRANULES, name, value, allowed)
    others = {"momentum_ratio": {"rise_time": None}, "rise_time": {"momentum_ratio": None}}
    try:
        replace(part, **{key: value}, **others.get(key, {}))
    except SceneError as problem:
        raise SceneError(name, problem.value, problem.allowed) from None


def _flat(scene: Scene) -> dict[str, Any]:
    """The parameters of a scene by name; NaN for those that it has not."""
    chain, shock = scene.chain, scene.shock
    flat: dict[str, Any] = {f"chain.{key}": value for key, value in asdict(chain).items()}
    if isinstance(shock, PulseTable):
        pulse: dict[str, Any] = {"profile": "table", "peak_force": shock.peak_force}
    else:
        pulse = asdict(shock)
    flat |= {f"shock.{key}": value for key, value in pulse.items()}
    flat["run.end_time"] = scene.run.end_time
    # What is typed as 100 is 100.0: a column has one type, whoever wrote the scene.
    given = {name: np.nan if flat.get(name) is None else flat[name] for name in PARAMETERS}
    texts_and_counts = ("shock.profile", "chain.granules")
    return {
        name: value if name in texts_and_counts else float(value) for name, value in given.items()
    }


def _with(base: Scene, flat: Mapping[str, Any]) -> Scene:
    """A scene with these parameters; NaN stands for one that is not given."""
    given = {name: None if value != value else value for name, value in flat.items()}  # noqa: PLR0124
    of: dict[str, dict[str, Any]] = {"chain": {}, "shock": {}, "run": {}}
    for name, value in given.items():
        section, _, key = name.partition(".")
        of[section][key] = value
    shock = base.shock if isinstance(base.shock, PulseTable) else replace(base.shock, **of["shock"])
    return Scene(replace(base.chain, **of["chain"]), shock, Run(**of["run"]))
