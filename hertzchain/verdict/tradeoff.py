"""Error against cost of every way to the peak forces of a scene: numbers in, numbers out.

A contender runs a scene at one setting after another, from cheap to dear; each run gives a row with
the error of its peaks and what it took. What a run costs is its least wall time on code that is
loaded and compiled: everything else in a timing is other work of the machine.
"""

from __future__ import annotations

import functools
import itertools
import math
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain import theory
from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.lammps import Lammps
from hertzchain.engines.native import METHODS, Native, choice, simulate, simulate_in_numpy
from hertzchain.engines.native.equations import acceleration, contact_force, net_force, overlap
from hertzchain.errors import BackendMissing, RunFailed, require
from hertzchain.observables.peaks import PeakWatch, largest_difference
from hertzchain.observables.result import Result
from hertzchain.observables.samples import Samples
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

if TYPE_CHECKING:
    import pandas

ENGINES = ("formulas", "map", "compiled", "NumPy", "SciPy", "LAMMPS")
"""What computes: the closed formulas, the map of peaks, the native kernels, and so on."""

TRUTH_STEP = 1 / 80
"""Natural time units, of the reference run that counts as the truth; a quarter of its own step."""

TRUTH_ERROR = 1e-12
"""What is known of the truth at best; in the paper's scenes its peaks move by 2e-13 at most when
its step is quartered."""

_LONGEST = 2.0
"""Seconds; after a run that takes longer its contender is not run at dearer settings."""

_ROUNDS = 2
"""Times that every contender runs at every setting: other work of the machine lasts for seconds."""

_MOST, _ENOUGH = 20, 0.05
"""Runs that are timed in a round, at most, and the seconds in all after which that is enough."""

_SCIPY_INTERVAL = 0.1
"""Natural time units between two samples of SciPy's dense output; peaks are off by 1e-12 for it."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one run of a contender found.

    Parameters
    ----------
    peak_force
        Of contacts 2 ... N [N], shape (contacts,), NaN where a contender says nothing.
    force_evaluations
        How often the right-hand side of Eq. 1 was evaluated for the whole chain; 0 for a formula.
    """

    peak_force: FloatArray
    force_evaluations: int


@dataclass(frozen=True)
class Contender:
    """One way to the peaks.

    Parameters
    ----------
    name
        What it is called; no two are called the same.
    engine
        One of ENGINES.
    steps
        Largest steps to run with, natural time units, from cheap to dear; empty where it has none.
    rtols
        Relative accuracies to ask for, from cheap to dear; empty where none is asked for.
    run
        Runs a scene with a step [s] or an accuracy; with NaN where the contender has neither.
    self_contained
        Whether it says the peaks of all contacts, knowing nothing but the scene.
    """

    name: str
    engine: str
    run: Callable[[Scene, float], Outcome]
    steps: tuple[float, ...] = ()
    rtols: tuple[float, ...] = ()
    self_contained: bool = True


@dataclass(frozen=True)
class Row:
    """One contender at one setting.

    Parameters
    ----------
    contender, engine
        Who.
    step
        The largest step [s], or None.
    natural_step
        The same in natural time units, alike for all scenes, or None.
    rtol
        The accuracy asked for, or None.
    error
        Largest relative difference of the peaks from the truth.
    force_evaluations
        Of the run; those of a second run that only tells the error are not counted.
    wall_time
        Least of some runs, everything included that a user waits for [s].
    self_contained
        Whether the contender needs nothing but the scene.
    """

    contender: str
    engine: str
    step: float | None
    natural_step: float | None
    rtol: float | None
    error: float
    force_evaluations: int
    wall_time: float
    self_contained: bool

    @property
    def setting(self) -> tuple[str, float | None, float | None]:
        """Contender, natural step and rtol: the same run in any scene."""
        return self.contender, self.natural_step, self.rtol


@dataclass(frozen=True)
class Tradeoff:
    """Error against cost of every contender on one scene.

    Parameters
    ----------
    scene
        The scene.
    rows
        One for each contender and setting, in the order of the contenders, from cheap to dear.
        There is none for a setting at which a run fails, as with steps too long for a method.
    truth_error
        What is known of the truth: errors below say no more than that they are below.
    missing
        Whether a backend is not there.
    remarks
        Sentences that say why contenders have no rows.
    """

    scene: Scene
    rows: tuple[Row, ...]
    truth_error: float
    missing: bool
    remarks: tuple[str, ...]

    @property
    def contenders(self) -> tuple[str, ...]:
        """Names of those that have rows, in their order."""
        return tuple(dict.fromkeys(row.contender for row in self.rows))

    @functools.cached_property
    def frontier(self) -> tuple[Row, ...]:
        """Rows that no other beats: from the cheapest to the most accurate.

        Only contenders that need nothing but the scene take part.
        """
        return frontier([row for row in self.rows if row.self_contained], self.truth_error)

    def to_dict(self) -> dict[str, Any]:
        """The measurement as JSON knows it; null stands for what is not there."""
        return {
            "truth_error": self.truth_error,
            "missing": self.missing,
            "remarks": list(self.remarks),
            "provenance": provenance(),
            "rows": [self._as_dict(row) for row in self.rows],
        }

    def to_frame(self) -> pandas.DataFrame:
        """The rows as a table, with the keys of those of ``to_dict`` as columns."""
        import pandas

        table = pandas.DataFrame([self._as_dict(row) for row in self.rows])
        # Numbers also where all are None.
        return table.astype(dict.fromkeys(("step_s", "natural_step", "rtol"), float))

    def _as_dict(self, row: Row) -> dict[str, Any]:
        return {
            "contender": row.contender,
            "engine": row.engine,
            "step_s": row.step,
            "natural_step": row.natural_step,
            "rtol": row.rtol,
            "error": row.error,
            "force_evaluations": row.force_evaluations,
            "wall_time_s": row.wall_time,
            "self_contained": row.self_contained,
            "frontier": row in self.frontier,
        }


def tradeoff(
    scene: Scene,
    engines: Sequence[str] = ENGINES,
    progress: Callable[[str], object] | None = None,
    enough: float = _ENOUGH,
) -> Tradeoff:
    """Measure error and cost of every contender on a scene.

    Parameters
    ----------
    scene
        What to simulate.
    engines
        Whose contenders to measure.
    progress
        Is called with a line of text before each part of the work.
    enough
        Seconds for which the run of a setting is repeated in each round; with 0 it runs once.

    Raises
    ------
    SceneError
        For an engine that does not exist.
    RunFailed
        If the reference method fails: there is no truth then.
    """
    for name in engines:
        require(name in ENGINES, "engine", name, f"must be one of {', '.join(ENGINES)}")
    tell = progress or (lambda _: None)
    tell("the truth: the reference method with short steps (the first run compiles, half a minute)")
    truth = Native("reference", TRUTH_STEP * scene.units.time, peaks_only=True).run(scene)
    ordinary = Native("reference", peaks_only=True).run(scene)
    moved = largest_difference(ordinary.peak_force, truth.peak_force)
    running = [one for one in contenders(scene, truth) if one.engine in engines]
    found: dict[tuple[str, float | None, float | None], Row] = {}
    remarks: dict[str, None] = {}
    missing = False
    for contender in running * _ROUNDS:
        tell(contender.name)
        try:
            for row in measured(contender, scene, truth.peak_force, enough):
                before = found.setdefault(row.setting, row)
                found[row.setting] = min(before, row, key=lambda row: row.wall_time)
        except BackendMissing as problem:
            missing = True
            remarks[str(problem)] = None
        except RunFailed as problem:
            remarks[f"{contender.name}: {problem}"] = None
    if "formulas" in engines and all(one.engine != "formulas" for one in running):
        remarks["the formulas do not apply: they need a pulse of Table 1 and a transition"] = None
    if "map" in engines and all(one.engine != "map" for one in running):
        remarks[f"the map does not apply: {theory.predict(scene).missing}"] = None
    order = [contender.name for contender in running]
    rows = tuple(sorted(found.values(), key=lambda row: order.index(row.contender)))
    return Tradeoff(scene, rows, max(moved, TRUTH_ERROR), missing, tuple(remarks))


def contenders(scene: Scene, truth: Result) -> tuple[Contender, ...]:
    """Everything that is measured, in the order in which it is shown.

    One more contender is one more entry here: a name, an engine, the settings and a function
    (scene, setting) -> Outcome. One more engine is one more name in ENGINES and a marker in
    ``report``.

    Parameters
    ----------
    scene
        What they will run.
    truth
        Where the formulas have p and F_SW from.
    """
    finer = {name: _halvings(*ends) for name, ends in _STEPS.items()}
    finer["reference"] = finer["reference"][::2]
    return (
        *_formulas(scene, truth),
        *_map(scene),
        *(
            Contender(f"{name}, compiled", "compiled", functools.partial(_compiled, name), steps)
            for name, steps in finer.items()
        ),
        Contender("srkn-6b, float32", "compiled", _compiled_float32, finer["srkn-6b"][:11]),
        Contender("rtol, with estimate", "compiled", _with_estimate, rtols=_decades(2, 10)),
        Contender("rtol, without estimate", "compiled", _without_estimate, rtols=_decades(2, 10)),
        *(
            Contender(f"{name}, NumPy", "NumPy", functools.partial(_numpy, name), steps[:9:2])
            for name, steps in finer.items()
            if name != "reference"
        ),
        # Its halved steps cost NumPy a second, whatever the step it starts from.
        Contender(
            "reference, NumPy",
            "NumPy",
            functools.partial(_numpy, "reference"),
            (METHODS["reference"].step,),
        ),
        Contender("DOP853, SciPy", "SciPy", _scipy, rtols=_decades(4, 12)),
        Contender("LAMMPS", "LAMMPS", _lammps, _halvings(0.4, 0.4 / 2**9)[::2]),
        Contender(
            "LAMMPS, extrapolated",
            "LAMMPS",
            functools.partial(_lammps, extrapolated=True),
            _halvings(0.4, 0.4 / 2**7)[::2],
        ),
    )


def measured(
    contender: Contender, scene: Scene, truth: FloatArray, enough: float = _ENOUGH
) -> list[Row]:
    """The rows of one contender; a setting at which it fails has none.

    Parameters
    ----------
    contender, scene
        Who runs what.
    truth
        Peak forces [N], shape (contacts,).
    enough
        Seconds for which each run is repeated.

    Raises
    ------
    BackendMissing
        If what it needs is not there.
    RunFailed
        If it fails at every setting.
    """
    settings: list[tuple[float | None, float | None]] = [
        *((step, None) for step in contender.steps),
        *((None, rtol) for rtol in contender.rtols),
    ]
    rows: list[Row] = []
    problem: RunFailed | None = None
    for natural_step, rtol in settings or [(None, None)]:
        step = None if natural_step is None else natural_step * scene.units.time
        setting = step or rtol or math.nan
        try:
            outcome, seconds = timed(functools.partial(contender.run, scene, setting), enough)
        except RunFailed as failed:
            problem = failed
            continue
        rows.append(
            Row(
                contender.name,
                contender.engine,
                step,
                natural_step,
                rtol,
                _error(outcome.peak_force, truth),
                outcome.force_evaluations,
                seconds,
                contender.self_contained,
            )
        )
        if seconds > _LONGEST:
            break
    if not rows and problem is not None:
        raise problem
    return rows


def timed(run: Callable[[], Outcome], enough: float = _ENOUGH) -> tuple[Outcome, float]:
    """What a run finds, and the least wall time of several within ``enough`` seconds [s]."""
    spent, least = 0.0, math.inf
    for _ in range(_MOST):
        begin = time.perf_counter()
        outcome = run()
        seconds = time.perf_counter() - begin
        spent, least = spent + seconds, min(least, seconds)
        if spent >= enough:
            break
    return outcome, least


def frontier(rows: Sequence[Row], truth_error: float) -> tuple[Row, ...]:
    """Rows than which none is both as cheap and more accurate, or as accurate and cheaper.

    Parameters
    ----------
    rows
        Of any contenders.
    truth_error
        Errors below it count as equal.

    Returns
    -------
    From the cheapest to the most accurate; of equal rows the first.
    """
    found: list[Row] = []
    for row in sorted(rows, key=lambda row: (row.wall_time, max(row.error, truth_error))):
        error = max(row.error, truth_error)
        if not found or error < max(found[-1].error, truth_error):
            found.append(row)
    return tuple(found)


def cheapest(rows: Sequence[Row], accuracy: float, truth_error: float) -> dict[str, Row]:
    """The cheapest row of each contender whose error is at most ``accuracy``, by its name."""
    found: dict[str, Row] = {}
    for row in sorted(rows, key=lambda row: row.wall_time):
        if max(row.error, truth_error) <= accuracy:
            found.setdefault(row.contender, row)
    return found


def provenance() -> dict[str, str]:
    """Versions of everything that takes part, and on what it runs."""
    names = ("hertzchain", "numpy", "numba", "scipy", "lammps")
    versions = {}
    for name in names:
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    platforms = f"{platform.system()} {platform.machine()}"
    return {**versions, "python": platform.python_version(), "platform": platforms}


@dataclass(frozen=True)
class Typical:
    """One contender at one setting, over several scenes.

    Parameters
    ----------
    row
        Medians of error, force evaluations and wall time; of several scenes it has no step [s].
    lowest, highest
        Errors in the scenes where they are least and largest.
    """

    row: Row
    lowest: float
    highest: float


def typical(tradeoffs: Sequence[Tradeoff]) -> tuple[Typical, ...]:
    """Medians over scenes of what all of them have, in the order of the contenders."""
    groups: dict[tuple[str, float | None, float | None], list[Row]] = {}
    for row in itertools.chain.from_iterable(one.rows for one in tradeoffs):
        groups.setdefault(row.setting, []).append(row)
    return tuple(
        Typical(
            replace(
                rows[0],
                step=rows[0].step if len(tradeoffs) == 1 else None,
                error=statistics.median(row.error for row in rows),
                force_evaluations=round(statistics.median(row.force_evaluations for row in rows)),
                wall_time=statistics.median(row.wall_time for row in rows),
            ),
            min(row.error for row in rows),
            max(row.error for row in rows),
        )
        for rows in groups.values()
        if len(rows) == len(tradeoffs)
    )


def _error(peak_force: FloatArray, truth: FloatArray) -> float:
    """Largest difference of the peaks that are spoken of."""
    said = np.isfinite(peak_force)
    return largest_difference(peak_force[said], truth[said])


def _halvings(first: float, last: float) -> tuple[float, ...]:
    """From one step to another, each shorter by the square root of 2."""
    count = round(2 * math.log2(first / last))
    return tuple(first * 2 ** (-k / 2) for k in range(count + 1))


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e-{k}") for k in range(first, last + 1))


_STEPS = {
    "velocity-verlet": (0.4, 0.4 / 2**10),
    "rk4": (0.4, 0.4 / 2**7.5),
    "dprkn-6": (0.8, 0.8 / 2**5.5),
    "srkn-6b": (1.2, 1.2 / 2**7),
    "srkn-11b": (1.2, 1.2 / 2**4.5),
    "reference": (0.8, 0.8 / 2**5),
}
"""First and last step of each native method, natural time units: errors from some per cent to
1e-12, or to what a tenth of a second buys. Of the reference method only the start of its halvings.
"""


# The contenders. Each is a function of scene and setting: a step [s], an accuracy, or NaN.


def _formulas(scene: Scene, truth: Result) -> tuple[Contender, ...]:
    """Eqs. 6 and 9 at the contacts that they speak of, given p and F_SW of the truth."""
    p, wave_force, pulse = truth.transition_granules, truth.solitary_wave.peak_force, scene.shock
    if p is None or wave_force is None or not isinstance(pulse, Pulse):
        return ()
    contacts, rise_time = truth.contact.size, scene.rise_time
    assert rise_time is not None

    def eq6(last: int) -> FloatArray:
        ratio = theory.effective_momentum_ratio(scene.chain, pulse, rise_time)
        transition = np.arange(2, last + 1)
        return theory.peak_force(transition, p, wave_force, pulse.duration_ratio, ratio)

    def eq9() -> FloatArray:
        return theory.peak_force_cubic(np.arange(2, p + 2), p, float(eq6(2)[0]), wave_force)

    def contender(name: str, forces: Callable[[], FloatArray]) -> Contender:
        def run(_: Scene, __: float) -> Outcome:
            said = forces()
            return Outcome(np.append(said, np.full(contacts - said.size, np.nan)), 0)

        return Contender(name, "formulas", run, self_contained=False)

    return (
        contender("Eq. 6, given p and F_SW", lambda: eq6(p)),
        contender("Eq. 9, given p and F_SW", eq9),
    )


def _map(scene: Scene) -> tuple[Contender, ...]:
    """The map of peaks, where it knows the scene."""
    contacts = scene.chain.granules - 1

    def run(scene: Scene, _: float) -> Outcome:
        said = theory.predict(scene).peak_force
        return Outcome(np.append(said, np.full(contacts - said.size, np.nan)), 0)

    known = theory.predict(scene).peak_force
    if not np.any(np.isfinite(known)):
        return ()
    return (Contender("map", "map", run, self_contained=known.size == contacts),)


def _compiled(
    method: str, scene: Scene, step: float, dtype: type[np.floating[Any]] = np.float64
) -> Outcome:
    """A native method with steps as asked, without what tells its error."""
    walker = METHODS[method].walker
    run = simulate(scene, scene.schedule(step), walker, dtype=dtype, leave_behind=True)
    return Outcome(run.peaks.force * scene.units.force, run.evaluations)


def _compiled_float32(scene: Scene, step: float) -> Outcome:
    """Single precision, by the method that is cheapest where that is enough."""
    return _compiled("srkn-6b", scene, step, np.float32)


def _with_estimate(scene: Scene, rtol: float) -> Outcome:
    """What a user gets who asks for an accuracy: method and step chosen, the error estimated."""
    result = Native(rtol=rtol, peaks_only=True).run(scene)
    return Outcome(result.peak_force, result.force_evaluations)


def _without_estimate(scene: Scene, rtol: float) -> Outcome:
    """The first run of that: what is left where nobody asks how sure the peaks are."""
    chosen = choice.plan(rtol)
    legs = scene.schedule(chosen.step * scene.units.time)
    run = simulate(scene, legs, chosen.walker, leave_behind=True)
    return Outcome(run.peaks.force * scene.units.force, run.evaluations)


def _numpy(method: str, scene: Scene, step: float) -> Outcome:
    """A native method as its equations are written."""
    run = simulate_in_numpy(scene, scene.schedule(step), METHODS[method].walker)
    return Outcome(run.peaks.force * scene.units.force, run.evaluations)


def _scipy(scene: Scene, rtol: float) -> Outcome:
    """SciPy's DOP853 from corner to corner of the pulse, peaks from its dense output."""
    from scipy.integrate import solve_ivp

    units, granules = scene.units, scene.chain.granules
    state, evaluations = np.zeros(2 * granules), 0
    watch = PeakWatch(granules - 1)
    for si in scene.schedule(math.inf):
        leg = si.in_units(units.time, units.force)

        def rates(time: float, state: Array, leg: Leg = leg) -> Array:
            pushed = 0.0 if leg.ramp is None else leg.ramp.force(time)
            return np.concatenate([state[granules:], acceleration(state[:granules], pushed)])

        # Overlaps ahead of the front are small: an absolute tolerance as large would leave noise.
        found = solve_ivp(
            rates,
            (leg.start, leg.end),
            state,
            method="DOP853",
            rtol=rtol,
            atol=1e-3 * rtol,
            dense_output=True,
        )
        if not found.success or found.sol is None:
            raise RunFailed(f"SciPy: {found.message}")
        state, evaluations = found.y[:, -1], evaluations + found.nfev
        count = math.ceil((leg.end - leg.start) / _SCIPY_INTERVAL) + 1
        time = np.linspace(leg.start, leg.end, max(count, 2))
        _show(watch, time, found.sol(time).T, leg)
    return Outcome(watch.force * units.force, evaluations)


def _show(watch: PeakWatch, time: FloatArray, states: FloatArray, leg: Leg) -> None:
    """Let the peaks be found between states, shape (samples, 2 granules), as everywhere else."""
    displacement, velocity = np.split(states, 2, axis=1)
    pressed = overlap(displacement)
    force, stiffness = contact_force(pressed), 1.5 * np.sqrt(np.maximum(pressed, 0))
    nothing = np.zeros_like(time)
    applied = nothing if leg.ramp is None else leg.ramp.force(time)
    applied_rate = nothing if leg.ramp is None else leg.ramp.force_rate(time)
    samples = Samples(
        time,
        displacement,
        velocity,
        acceleration=net_force(force, applied),
        overlap=pressed,
        contact_force=force,
        jerk=net_force(stiffness * overlap(velocity), applied_rate),
    )
    # Of a contact that does no more than touch a peak below 0 may be found, which is none.
    with np.errstate(invalid="ignore"):
        watch.show(samples)


def _lammps(scene: Scene, step: float, extrapolated: bool = False) -> Outcome:
    """The deck from the creation of its instance on, without what finds a step or tells an error.

    Where extrapolated, ``step`` is that of the finer run.
    """
    peaks, steps = Lammps(dt=step, extrapolated=extrapolated).peaks_alone(scene)
    return Outcome(peaks, steps)
