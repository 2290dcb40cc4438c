"""The contenders of a trade-off: all methods that find peaks, each a function of a setting."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.native import plan as plans
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.damped_plan import first_tolerance
from hertzchain.engines.native.damped_runs import simulate_damped
from hertzchain.engines.native.damped_verlet import simulate_damped_verlet
from hertzchain.engines.native.methods import METHODS, Walker
from hertzchain.engines.native.simulation import Simulation, simulate
from hertzchain.engines.registry import label_of
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.scene.scene import Scene

COMPILED, NUMPY, SCIPY, LAMMPS = "compiled", "NumPy", "SciPy", label_of("lammps")
WAYS = (COMPILED, NUMPY, SCIPY, LAMMPS)  # names of the ways to compute


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of one run of a contender."""

    peak_force: FloatArray  # peaks of all contacts, a wall's the last [N]
    force_evaluations: int  # evaluations of Eq. 1 for the whole chain


@dataclass(frozen=True)
class Contender:
    """One method to find peaks, with its name."""

    name: str
    engine: str  # one of WAYS
    run: Callable[[Scene, float], Outcome]  # runs with a step [s] or rtol; NaN for neither
    steps: tuple[float, ...] = ()  # largest steps, natural time units, from cheap to expensive
    rtols: tuple[float, ...] = ()  # relative accuracies, from cheap to expensive


def contenders(scene: Scene) -> tuple[Contender, ...]:
    """Return all contenders of a scene, in the order of the report.

    A further contender is an entry here, a further way is a name in ``WAYS`` and ``report.style``.
    """
    steps = {name: _halvings(*ends) for name, ends in _STEPS.items()}
    steps["reference"] = steps["reference"][::2]
    compiled = {name: _compiled(METHODS[name].walker) for name in steps}
    if scene.contact is not None:  # LAMMPS's scheme alone
        compiled = {"velocity-verlet": partial(_with_steps, simulate_damped_verlet)}
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
"""Steps of the method in NumPy, natural time units: the last takes seconds."""

_LONGER, _SAMPLES_OF_DAMPERS = 10.0, 40
"""Longest step of SciPy over that of ``Native("scipy")``, and samples of it for damped contacts.

With 1 in place of 10 the demo costs as much at 1e-4 as at 1e-8; with 10 no shipped scene with terms
misses a collision. Damped forces between fewer samples are off by 2e-7 at 1e-8 (measured).
"""


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
    return Outcome(run.peak_force * scene.units.force, run.evaluations)


def _rk4(scene: Scene, step: float) -> Outcome:
    """Run the paper's own method with given steps, without an error estimate."""
    from hertzchain.engines.native.as_written import RungeKutta

    run = RungeKutta(scene, Deadline(TIME_LIMIT))
    walker = METHODS["rk4"].walker
    return _with_steps(lambda _, legs: run.simulate(legs, walker), scene, step)


def _scipy(scene: Scene, rtol: float) -> Outcome:
    """Run SciPy's DOP853 from corner to corner of the pulse, without an error estimate.

    With terms it ends at each contact that opens or closes, too.
    """
    from hertzchain.engines.native.as_written import SAMPLES, simulate_in_scipy

    samples, limit = SAMPLES if scene.contact is None else _SAMPLES_OF_DAMPERS, Deadline(TIME_LIMIT)
    run = simulate_in_scipy(scene, rtol, limit, longer=_LONGER, samples=samples)
    return Outcome(run.peaks.force * scene.units.force, run.evaluations)


def _lammps(scene: Scene, step: float, extrapolated: bool = False) -> Outcome:
    """Run LAMMPS, including its start; if extrapolated, ``step`` is the finer run's."""
    peaks, steps = Lammps(dt=step, extrapolated=extrapolated).peaks_alone(scene)
    return Outcome(peaks, steps)
