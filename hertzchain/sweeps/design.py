"""Which scenes a sweep has: grids, lists and samples, crossed; scene k follows from its number."""

from __future__ import annotations

import difflib
import math
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.pulse import PulseTable
from hertzchain.scene.run import Run
from hertzchain.scene.scene import Scene, require_scene
from hertzchain.scene.validity import refuse_terms
from hertzchain.sweeps.axes import Axis, Span, Value, axis_of, is_whole
from hertzchain.sweeps.columns import OTHER_MEASURE, PARAMETERS, TEXT, WHOLE

MOST_SCENES = 10**8  # of a sweep, chosen: a day of two cores at a millisecond a scene
MOST_GRANULES = 1_000_000  # of a chain, chosen: a part may hold its peaks several times


@dataclass(frozen=True)
class Design:
    """The scenes of a sweep, numbered from 0: the last axis changes first, samples before it.

    Axes without a count are sampled together, as points of one scrambled sequence; the others are
    crossed.
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
        """Numbers of scenes all over the grid, the first samples of each: about so many."""
        drawn = self.samples or 1
        first = np.arange(min(drawn, math.isqrt(most)))
        combinations = self.scenes // drawn
        spread = np.linspace(0, combinations - 1, max(1, most // first.size)).astype(np.int64)
        return (np.unique(spread)[:, None] * drawn + first).ravel()

    def parameters(self, scenes: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """All parameters in SI of increasing scenes, by name, shape (some,), NaN or "" for none."""
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
        for given, other in OTHER_MEASURE.items():
            if given in names:
                found[other] = np.full(scenes.size, np.nan)
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
        """The k-th of the scenes that these parameters are of."""
        return _with(self.base, {name: values[k].item() for name, values in parameters.items()})

    def to_dict(self) -> dict[str, Any]:
        """What tells this design from others, as JSON knows it."""
        base = self.base
        shock: dict[str, Any] = (
            {"time_s": base.shock.time, "force_N": base.shock.force}
            if isinstance(base.shock, PulseTable)
            else asdict(base.shock)
        )
        chain = asdict(base.chain)
        del chain["gap"]  # 0, as sweeps have no terms; folders of before do not have it
        scene = {"chain": chain, "shock": shock, "run": asdict(base.run)}
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
    refuse_terms(scene, "a sweep")
    allowed = "must be a mapping that names at least one parameter and what it takes"
    require(isinstance(vary, Mapping) and len(vary) > 0, "vary", None, allowed)
    axes = tuple(axis_of(_full(name), given) for name, given in vary.items())
    allowed = "must be a whole number of at least 1"
    require(samples is None or is_whole(samples, 1), "samples", samples, allowed)
    within = is_whole(seed, 0) and seed < 2**32
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


def _check(scene: Scene, name: str, value: Value) -> None:
    """Refuse a value that no scene can have, whatever else varies."""
    section, _, key = name.partition(".")
    part: Any = {"chain": scene.chain, "shock": scene.shock, "run": scene.run}[section]
    is_table = section == "shock" and isinstance(part, PulseTable)
    require(not is_table, name, None, "cannot vary: the shock is a pulse table")
    if key == "granules" and isinstance(value, int):
        allowed = f"must be at most {MOST_GRANULES:,} in a sweep: run a longer chain by itself"
        require(value <= MOST_GRANULES, name, value, allowed)
    other = {OTHER_MEASURE[name].partition(".")[2]: None} if name in OTHER_MEASURE else {}
    try:
        replace(part, **{key: value}, **other)
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
    kept = (*TEXT, *WHOLE)
    return {name: value if name in kept else float(value) for name, value in given.items()}


def _with(base: Scene, flat: Mapping[str, Any]) -> Scene:
    """A scene with these parameters; NaN stands for one that is not given."""
    given = {name: None if value != value else value for name, value in flat.items()}  # noqa: PLR0124
    of: dict[str, dict[str, Any]] = {"chain": {}, "shock": {}, "run": {}}
    for name, value in given.items():
        section, _, key = name.partition(".")
        of[section][key] = value
    shock = base.shock if isinstance(base.shock, PulseTable) else replace(base.shock, **of["shock"])
    chain, run = replace(base.chain, **of["chain"]), Run(**of["run"])
    return replace(base, chain=chain, shock=shock, run=run)
