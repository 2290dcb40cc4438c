"""Error against cost of every method for the peak forces of a scene."""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, NamedTuple

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.backend import Native, by_velocity_verlet, with_end
from hertzchain.engines.native.damped_runs import first_tolerance, simulate_damped
from hertzchain.engines.native.plan import METHODS, Walker
from hertzchain.engines.native.simulation import Simulation, simulate
from hertzchain.engines.registry import label_of
from hertzchain.errors import BackendMissing, RunFailed, require
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.scene import Scene

if TYPE_CHECKING:
    import pandas


COMPILED, NUMPY, SCIPY, LAMMPS = "compiled", "NumPy", "SciPy", label_of("lammps")
WAYS = (COMPILED, NUMPY, SCIPY, LAMMPS)  # names of the ways to compute


class Outcome(NamedTuple):
    """Result of one run of a contender."""

    peak_force: FloatArray  # peaks of all contacts, a wall's the last [N]
    force_evaluations: int  # evaluations of Eq. 1 for the whole chain


@dataclass(frozen=True)
class Contender:
    """One method to find peaks, with its name."""

    name: str
    engine: str  # one of WAYS
    run: Callable[[Scene, float], Outcome]  # runs with a step [s] or an rtol
    steps: tuple[float, ...] = ()  # largest steps, natural time units, from cheap to expensive
    rtols: tuple[float, ...] = ()  # relative accuracies, from cheap to expensive


def contenders(scene: Scene) -> tuple[Contender, ...]:
    """Return all contenders of a scene, in the order of the report.

    A new contender needs an entry here; a new way needs a name in ``WAYS`` and in ``report.style``.
    """
    steps = {name: _halvings(*ends) for name, ends in _STEPS.items()}
    steps["reference"] = steps["reference"][::2]
    compiled = {name: _compiled(METHODS[name].walker) for name in steps}
    if scene.contact is not None:  # LAMMPS's scheme alone
        compiled = {"velocity-verlet": partial(_with_steps, by_velocity_verlet)}
    by_steps = [
        Contender(f"{name}, compiled", COMPILED, run, steps[name]) for name, run in compiled.items()
    ]
    users = [
        Contender("rtol, with estimate", COMPILED, _with_estimate, rtols=_decades(2, 10)),
        Contender("rtol, without estimate", COMPILED, _without_estimate, rtols=_decades(2, 10)),
        *([] if scene.contact is not None else [Contender("rk4, NumPy", NUMPY, _rk4, _RK4_STEPS)]),
        Contender("DOP853, SciPy", SCIPY, _scipy, rtols=_decades(4, 12)),
    ]
    extrapolated = partial(_lammps, extrapolated=True)
    lammps = [
        Contender(LAMMPS, LAMMPS, _lammps, _halvings(0.4, 0.4 / 2**9)[::2]),
        Contender(f"{LAMMPS}, extrapolated", LAMMPS, extrapolated, _halvings(0.4, 0.4 / 2**7)[::2]),
    ]
    return (*by_steps, *users, *lammps)


def _halvings(first: float, last: float) -> tuple[float, ...]:
    """Return steps from one to another, each shorter by the square root of 2."""
    count = round(2 * math.log2(first / last))
    return tuple(first * 2 ** (-k / 2) for k in range(count + 1))


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e-{k}") for k in range(first, last + 1))


_STEPS = {
    "velocity-verlet": (0.4, 0.4 / 2**10),
    "srkn-11b": (1.2, 1.2 / 2**4.5),
    "reference": (0.8, 0.8 / 2**5),
}
"""First and last step of each native method, natural time units: errors from a few per cent to
1e-12, or to that of a run of 0.1 s. For the reference method the steps before they are halved.
"""

_RK4_STEPS = _halvings(0.4, 0.4 / 2**7)[::2]
"""Steps of the method in NumPy, natural time units: the last takes a second."""


def _with_steps(integrated: Callable[..., Simulation], scene: Scene, step: float) -> Outcome:
    """Run a method with given steps, without an error estimate."""
    run = integrated(scene, scene.schedule(step))
    return Outcome(run.peaks.force * scene.units.force, run.evaluations)


def _compiled(walker: Walker) -> Callable[[Scene, float], Outcome]:
    """Return the run of a compiled method with given steps."""
    return partial(_with_steps, partial(simulate, walker=walker, leave_behind=True))


def _with_estimate(scene: Scene, rtol: float) -> Outcome:
    """Run with a wanted accuracy as users do: method and step chosen, the error estimated."""
    result = Native(rtol=rtol, peaks_only=True, wanted="all").run(scene)
    return Outcome(result.peak_force, result.force_evaluations)


def _without_estimate(scene: Scene, rtol: float) -> Outcome:
    """Run only the first run for a wanted accuracy, without the error estimate."""
    if scene.contact is None:
        chosen = plans.cheapest(rtol)
        return _compiled(chosen.walker)(scene, chosen.step * scene.contact_time)
    run = simulate_damped(scene, first_tolerance(rtol), Deadline(TIME_LIMIT))
    return Outcome(run.peaks.force * scene.units.force, run.evaluations)


def _rk4(scene: Scene, step: float) -> Outcome:
    """Run the paper's own method with given steps, without an error estimate."""
    from hertzchain.engines.native.as_written import RungeKutta

    run = RungeKutta(scene, Deadline(TIME_LIMIT))
    walker = METHODS["rk4"].walker
    return _with_steps(lambda _, legs: run.simulate(legs, walker), scene, step)


def _scipy(scene: Scene, rtol: float) -> Outcome:
    """Run SciPy's DOP853 from corner to corner of the pulse, without an error estimate.

    Beyond a uniform chain it also ends where a contact opens or closes.
    """
    from hertzchain.engines.native.as_written import simulate_in_scipy

    # Longest step of SciPy over that of ``Native("scipy")``, and samples of it for damped contacts.
    # With 1 in place of 10 the demo costs as much at 1e-4 as at 1e-8; with 10 no shipped scene with
    # terms misses a collision. Damped forces between fewer samples are off by 2e-7 at 1e-8
    # (measured).
    limit, longer = Deadline(TIME_LIMIT), 10.0
    run = simulate_in_scipy(scene, rtol, limit, longer=longer, samples=40)
    return Outcome(run.peaks.force * scene.units.force, run.evaluations)


def _lammps(scene: Scene, step: float, extrapolated: bool = False) -> Outcome:
    """Run LAMMPS, including its start; if extrapolated, ``step`` is the finer run's."""
    peaks, steps = Lammps(dt=step, extrapolated=extrapolated).peaks_alone(scene)
    return Outcome(peaks, steps)


TRUTH_STEP = 1 / 80  # step of the truth [contact times], a quarter of the reference's own
TRUTH_ERROR = 1e-12  # least error of the truth: its peaks change by 2e-13 if its step is quartered
_LONGEST_RUN_SECONDS = 2.0  # after a longer run its contender is not run at costlier settings
_MOST_TIMED_RUNS, _ENOUGH_SECONDS = 20, 0.05  # in a round; of a round


@dataclass(frozen=True)
class Row:
    """One contender at one setting."""

    contender: str
    engine: str
    step: float | None  # largest step [s], or None
    natural_step: float | None  # the same step in natural time units
    rtol: float | None  # wanted accuracy, or None
    error: float  # largest relative difference of the peaks from the truth
    force_evaluations: int  # without those of a second run for the error
    wall_time: float  # least of several runs, with all that a user waits for [s]


@dataclass(frozen=True)
class Tradeoff:
    """Error against cost of every contender on one scene."""

    scene: Scene
    rows: tuple[Row, ...]  # by contender, from cheap to expensive; none for a setting that fails
    truth_error: float  # smaller errors have no known value
    missing: bool = False  # whether a backend is missing
    remarks: tuple[str, ...] = ()  # sentences on contenders without rows

    def known_error(self, row: Row) -> float:
        """Return the error of a row, at least that of the truth."""
        return max(row.error, self.truth_error)

    @cached_property
    def frontier(self) -> tuple[Row, ...]:
        """Rows for which no other is both cheaper and as accurate, from the cheapest on."""
        best: list[Row] = []
        for row in sorted(self.rows, key=lambda row: (row.wall_time, self.known_error(row))):
            if not best or self.known_error(row) < self.known_error(best[-1]):
                best.append(row)
        return tuple(best)

    def cheapest(self, accuracy: float) -> Row | None:
        """Return the cheapest row with an error of at most ``accuracy``; None if there is none."""
        enough = (row for row in self.rows if self.known_error(row) <= accuracy)
        return min(enough, key=lambda row: row.wall_time, default=None)

    def to_dict(self) -> dict[str, Any]:
        """Return the measurement as a JSON object; null stands for a missing value."""
        return {
            "truth_error": self.truth_error,
            "missing": self.missing,
            "remarks": list(self.remarks),
            "provenance": provenance(),
            "rows": [self._as_dict(row) for row in self.rows],
        }

    def to_frame(self) -> pandas.DataFrame:
        """Return the rows as a table with the keys of ``to_dict`` as columns."""
        import pandas

        table = pandas.DataFrame([self._as_dict(row) for row in self.rows])
        # Columns stay numeric even if all values are None.
        return table.astype(dict.fromkeys(("step_s", "natural_step", "rtol"), float))

    def _as_dict(self, row: Row) -> dict[str, Any]:
        names = {"step": "step_s", "wall_time": "wall_time_s"}
        document = {names.get(key, key): value for key, value in vars(row).items()}
        return {**document, "frontier": row in self.frontier}


def tradeoff(
    scene: Scene,
    engines: Sequence[str] = WAYS,
    progress: Callable[[str], object] | None = None,
    enough: float = _ENOUGH_SECONDS,
) -> Tradeoff:
    """Measure error and cost of every contender on a scene.

    ``engines`` has names of ``WAYS``. Each setting is repeated for ``enough`` seconds in each
    round; with 0 it runs once. RunFailed if the reference method fails.
    """
    for name in engines:
        require(name in WAYS, "engine", name, f"must be one of {', '.join(WAYS)}")
    report_progress = progress or (lambda _: None)
    report_progress("the truth: the reference method with short steps")
    scene = with_end(scene)
    truth, truth_error = _truth(scene)
    running = [contender for contender in contenders(scene) if contender.engine in engines]
    rows: dict[str, dict[tuple[float | None, float | None], Row]]
    rows = {contender.name: {} for contender in running}
    remarks: dict[str, None] = {}
    missing = False
    # Rounds of each setting: other work of the machine lasts for seconds
    for contender in running * 2:
        report_progress(contender.name)
        fastest = rows[contender.name]
        try:
            for row in measured(contender, scene, truth, enough):
                setting = row.natural_step, row.rtol
                before = fastest.get(setting, row)
                fastest[setting] = min(before, row, key=lambda row: row.wall_time)
        except BackendMissing as problem:
            missing = True
            remarks[str(problem)] = None
        except RunFailed as problem:
            remarks[f"{contender.name}: {problem}"] = None
    every = tuple(row for fastest in rows.values() for row in fastest.values())
    return Tradeoff(scene, every, truth_error, missing, tuple(remarks))


def _truth(scene: Scene) -> tuple[FloatArray, float]:
    """Return the peaks by the reference method [N], and their relative error."""
    ordinary = Native("reference", peaks_only=True, wanted="all")
    if scene.contact is not None:
        run = ordinary.run(scene)
        return run.peak_force, max(run.error_estimate, TRUTH_ERROR)
    truth = replace(ordinary, dt=TRUTH_STEP * scene.contact_time).run(scene).peak_force
    moved = largest_difference(ordinary.run(scene).peak_force, truth)
    return truth, max(moved, TRUTH_ERROR)


def measured(
    contender: Contender, scene: Scene, truth: FloatArray, enough: float = _ENOUGH_SECONDS
) -> Iterator[Row]:
    """Yield the rows of one contender, without settings that fail; raise if all of them fail."""
    settings = [*((step, None) for step in contender.steps), *((None, r) for r in contender.rtols)]
    problem, has_rows = None, False
    for natural_step, rtol in settings:
        step = None if natural_step is None else natural_step * scene.contact_time
        try:
            outcome, seconds = timed(
                partial(contender.run, scene, step or rtol or math.nan), enough
            )
        except RunFailed as failed:
            problem = failed
            continue
        has_rows = True
        yield Row(
            contender.name, contender.engine, step, natural_step, rtol,
            largest_difference(outcome.peak_force, truth), outcome.force_evaluations, seconds,
        )  # fmt: skip
        if seconds > _LONGEST_RUN_SECONDS:
            break
    if problem is not None and not has_rows:
        raise problem


def timed(run: Callable[[], Outcome], enough: float) -> tuple[Outcome, float]:
    """Outcome of a run, and the least wall time of runs within ``enough`` seconds [s]."""
    times: list[float] = []
    while not times or (sum(times) < enough and len(times) < _MOST_TIMED_RUNS):
        begin = time.perf_counter()
        outcome = run()
        times.append(time.perf_counter() - begin)
    return outcome, min(times)


def provenance() -> dict[str, str]:
    """Return the versions of all software involved, and the machine."""
    versions = {}
    for name in ("hertzchain", "numpy", "numba", "scipy", "lammps"):
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    platforms = f"{platform.system()} {platform.machine()}"
    return {**versions, "python": platform.python_version(), "platform": platforms}
