"""The comparison: numbers of every oracle in, rows, checks and a verdict out.

Two kinds of disagreement are kept apart. LAMMPS against native velocity Verlet at the same steps
may differ by round-off only: that says whether the deck means Eq. 1. Each simulation against the
reference differs by its discretisation error: that says what its answer is worth. The formulas
never decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain import theory
from hertzchain.arrays import Array, FloatArray
from hertzchain.errors import BackendMissing, RunFailed, require
from hertzchain.lammps import Lammps
from hertzchain.native import METHODS, Native, Simulation, simulate, simulate_in_numpy
from hertzchain.peaks import largest_difference
from hertzchain.result import Result
from hertzchain.scene import Scene
from hertzchain.schedule import Leg
from hertzchain.shock import Pulse
from hertzchain.theory import solitary_wave as exact

if TYPE_CHECKING:
    import pandas

VELOCITY_VERLET = METHODS["velocity-verlet"].walker

BACKENDS = ("native", "lammps")

SAME_STEPS_STATE = 10.0
"""Of the largest displacement and velocity: times what absolute coordinates cost at most, as the
only difference at the same steps. That bound is one of the peaks; collisions make more of it
(measured: up to 1.7 times in the paper's scenes)."""

SAME_STEPS_PEAKS = 7e-9
"""Of the peaks, at steps of 0.01 natural units, beside what coordinates cost: LAMMPS is read now
and then, which costs that much at most. It grows as 1 / dt below that step."""

LONG_STEPS_PEAKS = 0.1
"""Of the peaks, times dt^4 in natural units: velocity Verlet's velocities are not the slopes of
its displacements, between which both interpolate."""

_ONE_OF_MANY = 3.0
"""Times what late collisions make of one small difference at the start, as another makes more."""

_ROUND_OFF = 1e-12
"""Of the states: what is left where coordinates cost nothing."""

MOMENTUM = 1e-12
"""Relative; steps end at the corners, so every method has the whole impulse."""

MOMENTUM_OF_A_STEP = 2e-17
"""Relative, times the number of steps: LAMMPS adds up the time, and so the force, from one reading
to the next (5e-18 to 1e-17 measured)."""


@dataclass(frozen=True)
class Check:
    """One comparison of a number with what it should be.

    Parameters
    ----------
    name
        What is compared.
    measured, expected, tolerance
        The numbers; None where nothing could be measured.
    passed
        Whether abs(measured - expected) <= tolerance; False where nothing could be measured.
    reason
        Why this tolerance, or why there is no number and what to do.
    """

    name: str
    measured: float | None
    expected: float | None
    tolerance: float | None
    passed: bool
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """The check as JSON knows it."""
        return {
            "name": self.name,
            "measured": self.measured,
            "expected": self.expected,
            "tolerance": self.tolerance,
            "passed": self.passed,
            "reason": self.reason,
        }


@dataclass(frozen=True)
class Formulas:
    """What the paper's formulas say, given p and F_SW from a simulation.

    Parameters
    ----------
    applicable
        Why they do not apply, or None where they do.
    note
        Where the scene lies outside what the paper covers; None inside.
    transition_granules
        p of Eq. 3, not rounded.
    eq6, eq9
        Peak force of contacts 2 ... N [N], NaN where the formula says nothing, shape (N - 1,).
    speed, exact_speed
        V_SW of the paper and of the exact solitary wave, both at F_SW [m/s].
    """

    applicable: str | None
    note: str | None
    transition_granules: float | None
    eq6: FloatArray
    eq9: FloatArray
    speed: float | None
    exact_speed: float | None

    def to_dict(self) -> dict[str, Any]:
        """The formulas as JSON knows them; their peak forces are in the rows."""
        return {
            "not_applicable": self.applicable,
            "outside_range": self.note,
            "transition_granules": self.transition_granules,
            "speed_m_s": self.speed,
            "exact_speed_m_s": self.exact_speed,
        }


@dataclass(frozen=True)
class Comparison:
    """Every oracle on one scene, side by side.

    Parameters
    ----------
    scene
        The scene.
    native
        The reference method.
    lammps
        LAMMPS, or None where it was not asked for or did not run.
    formulas
        The paper's formulas with p and F_SW of the reference.
    checks
        What the verdict rests on.
    missing
        Whether a backend that was asked for is not there.
    """

    scene: Scene
    native: Result
    lammps: Result | None
    formulas: Formulas
    checks: tuple[Check, ...]
    missing: bool

    @property
    def verdict(self) -> str:
        """``pass`` where every check passed, else ``fail``."""
        return "pass" if all(check.passed for check in self.checks) else "fail"

    @property
    def rows(self) -> list[dict[str, float | int | None]]:
        """One row per contact: contact, native_N, lammps_N, eq6_N, eq9_N; None where undefined."""
        nothing = [None] * self.native.contact.size
        columns = (
            self.native.contact.tolist(),
            self.native.peak_force.tolist(),
            nothing if self.lammps is None else self.lammps.peak_force.tolist(),
            _or_none(self.formulas.eq6),
            _or_none(self.formulas.eq9),
        )
        names = ("contact", "native_N", "lammps_N", "eq6_N", "eq9_N")
        return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]

    def to_frame(self) -> pandas.DataFrame:
        """The rows as a table."""
        import pandas

        return pandas.DataFrame(self.rows)

    def to_dict(self) -> dict[str, Any]:
        """The comparison as JSON knows it."""
        results = {"native": self.native.to_dict()}
        if self.lammps is not None:
            results["lammps"] = self.lammps.to_dict()
        return {
            "verdict": self.verdict,
            "rows": self.rows,
            "checks": [check.to_dict() for check in self.checks],
            "formulas": self.formulas.to_dict(),
            "results": results,
        }


def compare(
    scene: Scene,
    backends: Sequence[str] = BACKENDS,
    lammps: Lammps | None = None,
    progress: Callable[[str], object] | None = None,
) -> Comparison:
    """Run every oracle on a scene and judge.

    Parameters
    ----------
    scene
        What to simulate.
    backends
        Which simulations to compare; the native reference always runs.
    lammps
        How LAMMPS runs; by default with steps small enough for 1e-6.
    progress
        Is called with a line of text before each part of the work.

    Raises
    ------
    SceneError
        For a backend that does not exist.
    """
    for name in backends:
        require(name in BACKENDS, "backend", name, f"must be one of {', '.join(BACKENDS)}")
    tell = progress or (lambda _: None)
    tell("native: the reference method")
    native = Native("reference").run(scene)
    checks = balance_checks(native)
    result, missing = None, False
    if "lammps" in backends:
        try:
            tell("LAMMPS: the generated deck")
            result = (lammps or Lammps()).run(scene)
        except BackendMissing as problem:
            missing = True
            checks.append(Check("lammps: not run", None, None, None, False, str(problem)))
        except RunFailed as problem:
            checks.append(Check("lammps: failed", None, None, None, False, str(problem)))
    if result is not None:
        tell("native: velocity Verlet at the steps of LAMMPS")
        checks += [
            *same_steps_checks(result),
            reference_check(result, native),
            *balance_checks(result),
        ]
    return Comparison(scene, native, result, formulas(native), tuple(checks), missing)


def same_steps_checks(lammps: Result) -> list[Check]:
    """LAMMPS against native velocity Verlet at the same steps: only round-off may differ."""
    scene, units = lammps.scene, lammps.scene.units
    legs = scene.schedule(lammps.dt)
    twin = simulate(scene, legs, VELOCITY_VERLET)
    step = lammps.dt / units.time
    lost = lammps.lost_digits.bound if lammps.lost_digits is not None else 0.0
    between = SAME_STEPS_PEAKS * max(1.0, 0.01 / step) + LONG_STEPS_PEAKS * step**4
    state, peaks = _ROUND_OFF + SAME_STEPS_STATE * lost, between + lost
    measured = (
        _largest(lammps.displacement / units.length, twin.state.displacement),
        _largest(lammps.velocity / units.velocity, twin.state.velocity),
        largest_difference(lammps.peak_force / units.force, twin.peaks.force),
    )
    reason = "same scheme, same steps: only round-off may differ, and it adds up over the steps"
    if lost > 0 and not (max(measured[:2]) <= state and measured[2] <= peaks):
        grown = _grown(scene, legs, twin, lost)
        if max(grown) > lost:
            state = max(state, _ONE_OF_MANY * max(grown[:2]))
            peaks = max(peaks, between + _ONE_OF_MANY * grown[2])
            reason += f"; late collisions multiply any difference by {max(grown) / lost:.0f}"
    names = ("displacement", "velocity", "peaks")
    tolerances = (state, state, peaks)
    return [
        _within(f"lammps: {name}, same steps", difference, 0.0, tolerance, reason)
        for name, difference, tolerance in zip(names, measured, tolerances, strict=True)
    ]


def _grown(
    scene: Scene, legs: Sequence[Leg], twin: Simulation, lost: float
) -> tuple[float, float, float]:
    """What the motion makes of a small difference in where the granules start.

    Granules that are left behind collide again, late and slowly; in long chains under long pulses
    such collisions make any round-off grow.

    Parameters
    ----------
    scene, legs, twin
        The scene, the steps and what came of them.
    lost
        The difference, of the largest overlap.

    Returns
    -------
    Differences of displacement, velocity and peaks.
    """
    nudge = lost * float(np.max(twin.peaks.force)) ** (2 / 3)
    start = nudge * np.random.default_rng(0).uniform(-1, 1, scene.chain.granules)
    nudged = simulate_in_numpy(scene, legs, VELOCITY_VERLET, displacement=start)
    return (
        _largest(nudged.state.displacement, twin.state.displacement),
        _largest(nudged.state.velocity, twin.state.velocity),
        largest_difference(nudged.peaks.force, twin.peaks.force),
    )


def _largest(measured: Array, expected: Array) -> float:
    """Largest difference as a fraction of the largest value expected."""
    largest = float(np.max(np.abs(expected)))
    difference = float(np.max(np.abs(measured - expected)))
    return difference / largest if largest > 0 else difference


def reference_check(result: Result, reference: Result) -> Check:
    """Peaks of a simulation against the reference: within what both say of their own error."""
    return _within(
        f"{result.backend}: peaks against the reference",
        largest_difference(result.peak_force, reference.peak_force),
        0.0,
        result.error_estimate + reference.error_estimate,
        "its own error estimate plus that of the reference",
    )


def balance_checks(result: Result) -> list[Check]:
    """Momentum against the impulse, energy against the work done by the shock."""
    balance = result.balance
    energy = (2 * result.error_estimate + 1e-12) * balance.work
    if "velocity-verlet" in result.method:
        energy += _work_error(result)
    ends_inside = result.scene.end_time < result.scene.ramps[-1].end
    momentum = (
        MOMENTUM
        + MOMENTUM_OF_A_STEP * result.steps
        + (result.error_estimate if ends_inside else 0.0)
    )
    return [
        _within(
            f"{result.backend}: momentum [N s]",
            balance.momentum,
            balance.impulse,
            momentum * balance.impulse,
            "its own error estimate, as the run ends within the pulse"
            if ends_inside
            else "steps end at the corners of the pulse, so its impulse is exact",
        ),
        _within(
            f"{result.backend}: energy [J]",
            balance.energy,
            balance.work,
            energy,
            "energy goes as force to the power 5/3, so at most twice its own error estimate; and"
            " what velocity Verlet makes of the work of a short pulse",
        ),
    ]


def _work_error(result: Result) -> float:
    """Error of the work that velocity Verlet does on the ramps, at most [J].

    Its displacement over a step misses F' dt^3 / 6m, so the work over a ramp misses the change of
    F^2 dt^2 / 12m; twice that. It matters where the pulse is short and its work small.
    """
    legs, mass = result.scene.schedule(result.dt), result.scene.chain.granule_mass
    return math.fsum(
        leg.dt**2 / (6 * mass) * abs(leg.ramp.end_force**2 - leg.ramp.start_force**2)
        for leg in legs
        if leg.ramp is not None
    )


def formulas(reference: Result) -> Formulas:
    """The paper's formulas with p and F_SW of a simulation, and the exact solitary wave."""
    scene, p, wave = reference.scene, reference.transition_granules, reference.solitary_wave
    nothing = np.full(reference.contact.size, np.nan)
    if not isinstance(scene.shock, Pulse):
        reason = "the shock is a pulse table: Eqs. 3 to 9 are about the profiles of Table 1"
        return Formulas(reason, None, None, nothing, nothing, None, None)
    if p is None or wave.peak_force is None:
        reason = "the transition does not end within this chain and run: no p, no F_SW"
        return Formulas(reason, None, None, nothing, nothing, None, None)
    chain, pulse, rise_time = scene.chain, scene.shock, scene.rise_time
    assert rise_time is not None
    ratio = theory.effective_momentum_ratio(chain, pulse, rise_time)
    transition = np.arange(2, p + 1)
    eq6, eq9 = nothing.copy(), nothing.copy()
    eq6[: p - 1] = theory.peak_force(transition, p, wave.peak_force, pulse.duration_ratio, ratio)
    eq9[:p] = theory.peak_force_cubic(np.arange(2, p + 2), p, float(eq6[0]), wave.peak_force)
    return Formulas(
        applicable=None,
        note=theory.outside_range(scene.momentum_ratio, pulse.duration_ratio),
        transition_granules=theory.transition_granules(chain, pulse, rise_time, wave.peak_force),
        eq6=eq6,
        eq9=eq9,
        speed=theory.solitary_wave_speed(chain, wave.peak_force),
        exact_speed=exact.speed(chain, wave.peak_force),
    )


def _within(name: str, measured: float, expected: float, tolerance: float, reason: str) -> Check:
    passed = bool(abs(measured - expected) <= tolerance)
    return Check(name, measured, expected, tolerance, passed, reason)


def _or_none(values: FloatArray) -> list[float | None]:
    return [None if np.isnan(value) else value for value in values.tolist()]
