"""Many scenes at once, on all cores: peaks of plain ones, and whole results of any.

In natural units a plain scene is given by its profile, LM_ratio, n and N; a batch has arrays of
these. Other scenes run one by one.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, field, replace
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.plan import Walker
from hertzchain.engines.native.simulation import (
    MOVING,
    code_of,
    room_for,
    steps_of,
)
from hertzchain.errors import POSITIVE, HertzchainError, SceneError, require
from hertzchain.limits import (
    RTOL,
    TIME_LIMIT,
    Deadline,
    check_time_limit,
    refuse_memory,
    usable_cores,
)
from hertzchain.observables.first_pulse import (
    WANTED,
    check_wanted,
    usually_wanted,
)
from hertzchain.observables.peaks import times_of_peaks
from hertzchain.observables.result import Result
from hertzchain.scene.chain import MOMENTUM_IN_NATURAL_UNITS, MOST_GRANULES, Chain
from hertzchain.scene.keys import Count
from hertzchain.scene.scene import (
    Scene,
    SceneLike,
    overlap_ratio,
    refuse_deep_overlap,
    to_scene,
)
from hertzchain.scene.schedule import watched_time
from hertzchain.scene.shocks import PROFILES, SHAPES, Profile, Pulse, profile_named
from hertzchain.shown import Shown

if TYPE_CHECKING:
    import pandas

    from hertzchain.engines.native.elastic import Each


_ANY = {"radius": 1.0, "young_modulus": 1e9, "poisson_ratio": 0.0, "density": 1000.0}
_WEAK = 1e-6
"""Material [SI units] and peak force [N] of scenes that are given by numbers alone: any values with
small overlaps will do, as results are in natural units."""

AT_ONCE = 256
"""Scenes that wait together for a free core (chosen)."""

_PARTS_PER_CORE = 8
"""Number of parts of a batch (chosen), so that all cores end at about the same time."""


@dataclass(frozen=True, eq=False, repr=False)
class Batch(Shown):
    """Peaks of many scenes.

    Parameters
    ----------
    peak_force, peak_time
        Peaks of all contacts and their times, shape (scenes, contacts), with walls the last that
        with the wall: [N] and [s], or natural units where the scenes were given as numbers. The
        time is NaN where a contact was never pressed.
    error_estimate
        Upper bound of the relative error of the peaks of each scene, shape (scenes,). Where it is
        above the wanted accuracy, the motion amplifies rounding errors; from 1 on the peaks have no
        right digit.
    peak_passed
        Whether the force of a contact fell again before the run ended, shape (scenes, contacts).
    force_evaluations
        Cost of the run itself, without the runs that estimate its error, shape (scenes,).
    first_columns
        First pulses and errors of each contact by name, shape (scenes, contacts) each, as those of
        a ``Result``; none where they were not wanted.
    first_contact
        Number of the first contact: 2, or 1 with near walls.
    """

    peak_force: FloatArray
    peak_time: FloatArray
    error_estimate: FloatArray
    peak_passed: NDArray[np.bool_]
    force_evaluations: NDArray[np.int64]
    first_columns: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    first_contact: int = 2

    def to_frame(self) -> pandas.DataFrame:
        """Return one row per scene and contact: scene, contact, peak_force_N, peak_time_s.

        With first pulses, the further columns are those of ``first_columns``.
        """
        import pandas

        scenes, contacts = self.peak_force.shape
        numbers = self.first_contact + np.arange(contacts)
        return pandas.DataFrame(
            {
                "scene": np.repeat(np.arange(scenes), contacts),
                "contact": np.tile(numbers, scenes),
                "peak_force_N": self.peak_force.ravel(),
                "peak_time_s": self.peak_time.ravel(),
                **{name: values.ravel() for name, values in self.first_columns.items()},
            }
        )


def peak_forces(
    scenes: Sequence[SceneLike],
    rtol: float = RTOL,
    time_limit: float = TIME_LIMIT,
    wanted: str | None = None,
) -> Batch:
    """Compute peak forces of scenes whose chains have the same number of granules.

    Parameters
    ----------
    scenes
        At least one; scenes, or paths of their files.
    rtol
        Wanted relative accuracy of the peaks, from 1e-10 to 0.01.
    time_limit
        Time limit of all scenes together [s].
    wanted
        The forces for which ``rtol`` holds, as for ``Native``; by default ``first`` if that is the
        default of any of the scenes. First pulses of plain scenes, whose largest forces are the
        same in all but the last contacts, take as long as single runs.

    Returns
    -------
    Batch
        Peaks in SI units.

    Raises
    ------
    SceneError
        If there is no scene, if chains have different lengths, or for an impossible accuracy.
    OverlapTooLarge
        If granules of a scene would be pressed into one another by more than a radius.
    TooExpensive
        If they have taken longer than the time limit.
    """
    listed = isinstance(scenes, Iterable) and not isinstance(scenes, str | os.PathLike)
    require(listed, "scenes", None, "must be a list of scenes, or of paths of their files")
    check_wanted(wanted)
    given = [to_scene(scene) for scene in scenes]
    require(len(given) > 0, "scenes", len(given), "must be at least one")
    lengths = sorted({scene.chain.granules for scene in given})
    allowed = "must be the same in all scenes: one batch for each length"
    require(len(lengths) == 1, "granules", lengths, allowed)
    allowed = "must be in all scenes or in none: one batch with walls, one without"
    require(len({scene.contacts for scene in given}) == 1, "wall", None, allowed)
    wanted = wanted or min(map(usually_wanted, given), key=WANTED.index)
    if wanted == "first" or not all(scene.is_plain for scene in given):
        return _one_by_one(given, rtol, time_limit, wanted)
    pulses = [(scene.pulse, scene.momentum_ratio) for scene in given]
    numbers = [(pulse.profile, ratio, pulse.duration_ratio) if pulse else ("", 1.0, 2.0)
               for pulse, ratio in pulses]  # fmt: skip
    profiles, ratio, n = map(np.array, zip(*numbers, strict=True))
    batch = plain_peaks(profiles, ratio, n, lengths[0], rtol, time_limit, scenes=given)
    force, time = (np.array([[getattr(scene.units, name)] for scene in given])
                   for name in ("force", "time"))  # fmt: skip
    peak_force = batch.peak_force * force
    for k, (scene, largest) in enumerate(zip(given, peak_force.max(axis=1), strict=True)):
        refuse_deep_overlap(overlap_ratio(scene.chain, float(largest)), f"scene {k}: ")
    peak_time = times_of_peaks(peak_force, batch.peak_time * time)
    return replace(batch, peak_force=peak_force, peak_time=peak_time)


def _one_by_one(scenes: Sequence[Scene], rtol: float, time_limit: float, wanted: str) -> Batch:
    """Return the peaks of scenes whose results are made one by one."""
    results = list(run_each(scenes, Native(rtol=rtol, wanted=wanted), Deadline(time_limit)))
    of_first = [result.first_columns for result in results]
    return Batch(
        np.array([result.peak_force for result in results]),
        np.array([result.peak_time for result in results]),
        np.array([result.error_estimate for result in results]),
        np.array([result.peak_passed for result in results]),
        np.array([result.force_evaluations for result in results]),
        {name: np.array([columns[name] for columns in of_first]) for name in of_first[0]},
        scenes[0].contacts[0],
    )


def run_each(scenes: Iterable[Scene], native: Native, deadline: Deadline) -> Iterator[Result]:
    """Yield the results of scenes in their order, on all cores; the first that fails raises."""
    for result in results_of(scenes, native, deadline):
        if isinstance(result, Exception):
            raise result
        yield result


def results_of(
    scenes: Iterable[Scene], native: Native, deadline: Deadline, cores: int | None = None
) -> Iterator[Result | HertzchainError | MemoryError]:
    """Yield the result of each scene, as of a run by itself, or why it has none."""

    def run(scene: Scene) -> Result | HertzchainError | MemoryError:
        try:
            return deadline.spend(  # type: ignore[no-any-return]
                lambda left: (
                    native if left > native.time_limit else replace(native, time_limit=left)
                ).run(scene)
            )
        except (HertzchainError, MemoryError) as problem:
            return problem

    waiting = iter(scenes)
    while some := list(itertools.islice(waiting, AT_ONCE)):
        yield from on_cores(run, some, cores)


def on_cores(run: Callable[[Any], Any], items: Iterable[Any], cores: int | None = None) -> Any:
    """Yield what a function returns for each item, in their order; it runs in several threads."""
    with ThreadPoolExecutor(cores or usable_cores()) as pool:
        yield from pool.map(_run_in_context(run), items)


def similar_peak_forces(
    profile: Profile,
    momentum_ratio: ArrayLike,
    duration_ratio: ArrayLike,
    granules: int,
    rtol: float = RTOL,
    time_limit: float = TIME_LIMIT,
    cores: Count | None = None,
) -> Batch:
    """Compute peak forces over F0 of uniform chains of any material, from LM_ratio, n and N.

    Parameters
    ----------
    profile
        ``cosine``, ``triangular`` or ``cosine-triangular``.
    momentum_ratio, duration_ratio
        LM_ratio and n, broadcast against each other to shape (scenes,).
    granules
        N, the same for all.
    rtol
        Wanted relative accuracy of the peaks, from 1e-10 to 0.01.
    time_limit
        Time limit of all scenes together [s].
    cores
        Number of cores; by default all that this process may use.

    Returns
    -------
    Batch
        Peaks in natural units: forces over F0.

    Raises
    ------
    SceneError
        For a value that is not possible.
    TooExpensive
        If they have taken longer than the time limit.
    """
    require(profile in PROFILES, "profile", profile, f"must be one of {', '.join(PROFILES)}")
    allowed = f"must be an integer from 2 to {MOST_GRANULES}"
    whole = isinstance(granules, Integral) and 2 <= granules <= MOST_GRANULES
    require(whole, "granules", granules, allowed)
    allowed = "must be numbers, or lists of as many"
    try:
        ratio, n = np.broadcast_arrays(
            np.atleast_1d(np.asarray(momentum_ratio, np.float64)),
            np.asarray(duration_ratio, np.float64),
        )
    except (TypeError, ValueError):
        raise SceneError("momentum_ratio and duration_ratio", None, allowed) from None
    require(ratio.ndim == 1 and ratio.size > 0, "momentum_ratio", ratio.shape, allowed)
    require(bool(np.all(np.isfinite(ratio) & (ratio > 0))), "momentum_ratio", None, POSITIVE)
    possible = bool(np.all(np.isfinite(n) & (n > 1)))
    require(possible, "duration_ratio", None, "must be finite numbers above 1")
    return plain_peaks(np.full(ratio.size, profile), ratio, n, granules, rtol, time_limit, cores)


def plain_peaks(
    profiles: NDArray[Any], ratio: FloatArray, n: FloatArray, granules: int, rtol: float,
    time_limit: float, cores: int | None = None, scenes: Sequence[Scene] = (),
) -> Batch:  # fmt: skip
    """Return the peaks of plain scenes in natural units: as ``similar_peak_forces``, unchecked.

    Scenes whose largest error is known run once. The others run as single scenes do, with an
    estimate of the error; they are made from their numbers unless ``scenes`` are given.
    """
    import hertzchain.engines.native.elastic  # noqa: F401 - loaded before any clock starts
    from hertzchain.observables.compiling import Watched

    plans.check(rtol)
    check_time_limit(time_limit)
    calibrated = plans.is_known(ratio, n, granules)
    if scenes:
        calibrated = np.array([plans.is_calibrated(scene) for scene in scenes])
    chain, cores = Chain(granules, **_ANY), cores or usable_cores()

    def scene_of(k: int) -> Scene:
        if scenes:
            return scenes[k]
        profile = profile_named(profiles[k])
        return Scene(chain, Pulse(profile, _WEAK, float(n[k]), momentum_ratio=float(ratio[k])))

    with Watched() as preparation:
        deadline = Deadline(time_limit, lambda: preparation.time)
        shape, indices = (ratio.size, granules - 1), np.flatnonzero(calibrated)
        refuse_memory(8.0 * 3 * ratio.size * granules)
        force, time = np.zeros(shape), np.full(shape, np.nan)
        error, evaluations = np.ones(ratio.size), np.zeros(ratio.size, np.int64)
        passed = np.zeros(force.shape, np.bool_)
        if indices.size:
            plan = plans.cheapest(rtol, checked=False)
            rows = _pulse_rows(profiles[indices], ratio[indices], n[indices], granules, plan)
            runs = _march_all(rows, plan.walker, granules, deadline, cores)
            force[indices], time[indices] = runs.force, runs.time
            # A motion that diverged has no meaningful number of evaluations.
            evaluations[indices] = np.nan_to_num(runs.evaluations)
            lost = np.isnan(runs.evaluations)
            error[indices] = np.where(lost, np.inf, plan.least(runs.evaluations))
            passed[indices] = runs.time < runs.end[:, None]
        native = Native(rtol=rtol, peaks_only=True, wanted="all")

        def march_one(k: int) -> None:
            if deadline.left <= 0:
                raise deadline.passed()
            single = native.accurate_enough(scene_of(k), None, deadline, rtol)
            run, errors = single.simulation, single.errors
            force[k], time[k], passed[k] = run.peaks.force, run.peaks.time, run.peaks.passed
            error[k], evaluations[k] = errors.largest, run.evaluations

        list(on_cores(march_one, np.flatnonzero(~(error <= rtol)).tolist(), cores))
        return Batch(force, time, error, passed, evaluations)


def _pulse_rows(
    profiles: NDArray[Any], ratio: FloatArray, n: FloatArray, granules: int, plan: plans.Plan
) -> FloatArray:
    """Return the legs of pulses in the form of the kernels, shape (scenes, 3, 8)."""
    rise = 2 * MOMENTUM_IN_NATURAL_UNITS * ratio / n
    corners = np.stack([np.zeros_like(rise), rise, n * rise, n * rise], 1)
    corners[:, 3] += watched_time(granules, ratio)
    rows = np.zeros((rise.size, 3, 8))
    rows[:, :, 0], rows[:, :, 1] = corners[:, :-1], corners[:, 1:]
    rows[:, :, 2] = np.ceil(np.diff(corners) / plan.step)
    rows[:, :2, 4:6] = rows[:, :2, :2]
    rows[:, 0, 7] = rows[:, 1, 6] = 1.0
    for profile in np.unique(profiles):
        some = profiles == profile
        for k, shape in enumerate(PROFILES[profile]):
            rows[some, k, 3] = code_of(shape)
            if SHAPES[shape].is_curved:
                rows[some, k, 2] *= np.ceil(plan.walker.cosine_steps / rows[some, k, 2])
    return rows


def _march_all(
    rows: FloatArray, walker: Walker, granules: int, deadline: Deadline, cores: int
) -> Each:
    """Run scenes of one pulse each; ``rows`` has the legs for the kernels, (scenes, legs, 8)."""
    from hertzchain.engines.native import elastic, elastic_chain

    shape = len(rows), granules - 1
    runs = elastic.Each(
        np.zeros(shape), np.full(shape, np.nan), room_for(), *np.zeros((2, len(rows)))
    )
    steps, at_rest = steps_of(rows[0], walker), elastic_chain.Start(np.zeros((0, 0)), MOVING)

    def part(some: slice, control: FloatArray) -> None:
        state, blank = (elastic_chain.at_the_start(granules) for _ in range(2))
        of_part = elastic.Each(
            runs.force[some], runs.time[some], runs.record, runs.end[some], runs.evaluations[some]
        )
        elastic.march_each(rows[some], steps, at_rest, state, blank, of_part, control)

    _in_parts(part, len(rows), deadline, cores)
    return runs


def _in_parts(
    part: Callable[[slice, FloatArray], None], scenes: int, deadline: Deadline, cores: int
) -> None:
    """Call a function of a slice of scenes and ``control`` of a kernel, on all cores."""
    size = max(1, -(-scenes // (cores * _PARTS_PER_CORE)))
    parts = [slice(start, start + size) for start in range(0, scenes, size)]
    control = np.zeros((len(parts), 3))
    limit = min(max(0.0, deadline.left), threading.TIMEOUT_MAX)
    with ThreadPoolExecutor(cores) as pool:
        try:
            list(pool.map(_run_in_context(part), parts, control, timeout=limit))
        except BaseException as problem:
            control[:, 0] = -1
            pool.shutdown(cancel_futures=True)
            if isinstance(problem, TimeoutError):
                raise deadline.passed() from None
            raise


def _run_in_context(part: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function for other threads, whose time for compiling counts for the run here."""
    context = copy_context()
    # One context cannot be entered twice at once.
    return lambda *some: context.copy().run(part, *some)
