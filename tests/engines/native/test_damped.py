"""The kernel of damped contacts: closed forms, balances, and another solver on random chains."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from hertzchain.engines.native import damped_advance, elastic, elastic_state
from hertzchain.engines.native.damped_plan import accurate, first_tolerance
from hertzchain.engines.native.damped_runs import integrate_damped
from hertzchain.engines.native.elastic_state import Seen, at_the_start
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import nothing_recorded, room_for, steps_of
from hertzchain.engines.native.methods import SRKN_11B, Walker
from hertzchain.observables.history import Recorder
from tests.oracles import extrapolation
from tests.oracles.scene_in_si import numbers_of_chain

Floats = NDArray[np.float64]

DASHPOT, RESTITUTION, VISCOELASTIC = 0.0, 0.25, 0.5

FREE = np.array([[0.0, 12.0, 1, 0, 0, 0, 0, 0]])
"""One leg without an applied force."""


def uniform(granules: int, exponent: float, damping: float, attraction: bool = False) -> Chain:
    """A chain of equal granules that just touch, k = m = 1."""
    return Chain(
        stiffness=np.ones(granules - 1),
        inverse_mass=np.ones(granules),
        gap=np.zeros(granules - 1),
        constant=np.zeros(granules),
        damping=np.full(granules - 1, damping),
        exponent=exponent,
        attraction=attraction,
    )


def pulse(rise: float, fall: float, end: float, shape: int = 2) -> Floats:
    """Legs of a force that rises to 1 and falls to 0."""
    over = rise + fall
    return np.array(
        [
            [0.0, rise, 1, shape, 0.0, rise, 0.0, 1.0],
            [rise, over, 1, shape, rise, over, 1.0, 0.0],
            [over, end, 1, 0, 0, 0, 0, 0],
        ]
    )


AT_REST = np.zeros((0, 0))


def error_of(found: Floats, true: Floats) -> float:
    """Largest relative error of peaks of at least a thousandth of the largest."""
    judged = true >= 1e-3 * true.max()
    return float(np.max(np.abs(found[judged] / true[judged] - 1)))


@pytest.mark.parametrize("exponent", [DASHPOT, RESTITUTION, VISCOELASTIC])
def test_order_over_a_run(exponent: float) -> None:
    """Errors fall with the eighth power of the steps, with contacts that begin and end.

    Without attraction: where contacts pull, their end is singular, and orders of 6 to 7 were found.
    """
    chain, rows = uniform(12, exponent, 0.1), pulse(1.5, 2.5, 25.0)
    true = integrate_damped(chain, rows, AT_REST, 1e-14, 0.1)
    tolerances = 10.0 ** -np.arange(5.0, 13.1, 0.25)
    runs = [integrate_damped(chain, rows, AT_REST, each, 10.0) for each in tolerances]
    errors = np.array([error_of(run.peak_force, true.peak_force) for run in runs])
    order = -np.polyfit(np.log([run.steps for run in runs]), np.log(errors), 1)[0]
    # 7.9 to 8.4 were found, and an order less would be told.
    assert order == pytest.approx(8.0, rel=0, abs=0.5)
    above_rounding = tolerances > 2e-12
    assert np.max((errors / tolerances)[above_rounding]) < 3.0  # 1 was found
    assert errors[-1] < 1e-11


def test_without_damping_it_is_the_other_kernel() -> None:
    """A chain whose contacts are damped by nothing, as ``elastic.march`` integrates it."""
    chain, rows = uniform(10, RESTITUTION, 0.0), pulse(1.5, 2.5, 20.0)
    ours = integrate_damped(chain, rows, AT_REST, 1e-11, 0.8)
    fine = rows.copy()
    fine[:, 2] = np.ceil((rows[:, 1] - rows[:, 0]) / 0.02)
    force, time = np.zeros(9), np.full(9, np.nan)
    seen = Seen(force, time, nothing_recorded())
    steps = steps_of(fine, Walker(SRKN_11B, 1e-9, 32, math.inf))
    state = at_the_start(10)
    elastic.march(steps, state, 10, np.zeros((0, 0)), None, 10, False, seen, np.zeros(3))
    # What is left of both tolerances.
    assert ours.peak_force == pytest.approx(force, rel=1e-9)
    assert ours.peaks.time == pytest.approx(time, rel=0, abs=1e-4)


def random_chain(seed: int, most: int) -> tuple[Chain, Floats, Floats]:
    """A random damped chain with its legs and its start: at rest under a pulse, or a striker."""
    draw = np.random.default_rng(seed)
    granules, wall = int(draw.integers(2, most + 1)), bool(draw.random() < 0.4)
    contacts = granules if wall else granules - 1
    spread = 0.5 * (draw.random() < 0.5)  # of unlike granules
    mass = np.exp(spread * draw.normal(0, 1.4, granules))
    stiffness = np.exp(spread * draw.normal(0, 1, contacts))
    strength = math.exp(draw.uniform(math.log(0.003), math.log(1.5)))
    damping = strength * np.exp(spread * draw.normal(0, 0.6, contacts))
    gap, pull = np.zeros(contacts), np.zeros(granules)
    kind = draw.choice(["touching", "gaps", "some gaps", "pressed"], p=[0.4, 0.25, 0.15, 0.2])
    if kind == "gaps":
        gap[:] = draw.uniform(0.01, 1.0)
    elif kind == "some gaps":
        gap = np.where(draw.random(contacts) < 0.3, draw.uniform(0.01, 1.0, contacts), 0.0)
    elif kind == "pressed":
        force = draw.uniform(0.02, 0.5)
        gap = -((force / stiffness) ** (2 / 3))
        pull[0] = force / mass[0]
        if not wall:
            pull[-1] -= force / mass[-1]
    exponent = float(draw.choice([DASHPOT, RESTITUTION, VISCOELASTIC]))
    chain = Chain(stiffness, 1 / mass, gap, pull, damping, exponent, bool(draw.random() < 0.4))
    end = float(draw.uniform(1.0, 1.8) * granules + 5)
    if draw.random() < 0.5:
        start = np.zeros((2, granules))
        start[1, 0] = 1.0
        return chain, np.array([[0.0, end, 1, 0, 0, 0, 0, 0]]), start
    rise, fall = draw.uniform(0.5, 6.0, 2)
    return chain, pulse(rise, fall, rise + fall + end, int(draw.integers(1, 3))), AT_REST


def truth_of(chain: Chain, rows: Floats, start: Floats) -> extrapolation.Found:
    numbers = numbers_of_chain(chain, longest_of(chain) / 0.8)
    at = start if start.size else np.zeros((2, chain.inverse_mass.size))
    # Start and end of a leg, shape, and forces there.
    pieces = np.ascontiguousarray(rows[:, [0, 6, 1, 7, 3]])
    return extrapolation.integrate(numbers, pieces, np.zeros((0, 2)), at, rows[-1, 1])


def longest_of(chain: Chain) -> float:
    """0.8 of the time unit of the fastest contact."""
    lightest = chain.inverse_mass + np.append(chain.inverse_mass[1:], 0.0)
    fastest = np.max(chain.stiffness * lightest[: chain.stiffness.size] / 2)
    return float(0.8 / math.sqrt(fastest))


@pytest.mark.parametrize(
    "seed", [*range(30), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(30, 120))]
)
def test_random_chains(seed: int) -> None:
    chain, rows, start = random_chain(seed, 12)
    true = truth_of(chain, rows, start)
    run = integrate_damped(chain, rows, start, 1e-11, longest_of(chain))
    assert run.status == elastic_state.DONE
    # A tolerance of 1e-11 a step; 1e-10 seen.
    assert error_of(run.peak_force, true.peak_force) < 2e-10
    assert run.velocity == pytest.approx(true.velocity, rel=0, abs=2e-10)
    assert run.energy + run.dissipated == pytest.approx(run.work, rel=1e-9)


def test_history() -> None:
    """The history at any time equals the end of a run that stops there."""
    gap = np.array([0.0, 0.2, 0.0, 0.1, 0.0])
    chain = uniform(6, RESTITUTION, 0.3)._replace(gap=gap, attraction=True)
    start = np.zeros((2, 6))
    start[1, 0] = 1.0
    times = np.array([0.0, 0.05, 1.0, 1.3, 2.5, 4.0, 9.0, 12.0])
    record = room_for(Recorder(times, 6), 6)
    integrate_damped(chain, FREE, start, 1e-10, 0.8, record)
    for k in range(1, times.size):
        rows = FREE.copy()
        rows[0, 1] = times[k]
        run = integrate_damped(chain, rows, start, 1e-12, 0.8)
        # Interpolants are as accurate as steps, within a factor of a hundred.
        assert record.displacement[k] == pytest.approx(run.displacement, rel=0, abs=1e-8)
        assert record.velocity[k] == pytest.approx(run.velocity, rel=0, abs=1e-8)
        overlap = -np.diff(run.displacement) - chain.gap
        rate, pressed = -np.diff(run.velocity), np.maximum(overlap, 0.0)
        force = pressed**1.5 + 0.3 * pressed**0.25 * rate
        assert record.contact_force[k] == pytest.approx(force, rel=0, abs=1e-8)


@pytest.mark.parametrize("exponent", [DASHPOT, RESTITUTION, VISCOELASTIC])
def test_granules_ahead_of_the_front_are_left_out(exponent: float) -> None:
    chain, rows = uniform(60, exponent, 0.2), pulse(1.5, 2.5, 30.0)
    front = integrate_damped(chain, rows, AT_REST, 1e-9, 0.8)
    whole = integrate_damped(chain, rows, np.zeros((2, 60)), 1e-9, 0.8)
    # The same steps: round-off.
    assert front.steps == whole.steps
    assert error_of(front.peak_force, whole.peak_force) < 1e-13


@pytest.mark.parametrize(
    ("exponent", "damping"), [(DASHPOT, 100.0), (DASHPOT, 1000.0), (VISCOELASTIC, 10000.0)]
)
def test_strong_dampers(exponent: float, damping: float) -> None:
    """Contacts that creep, with forces near 0, neither hold a run up nor cost it its accuracy."""
    chain, rows = uniform(6, exponent, damping), pulse(1.5, 2.5, 30.0)
    true = integrate_damped(chain, rows, AT_REST, 1e-11, 0.8, most_work=1e8)
    for tolerance in (3e-5, 1e-6, 3e-9):
        # 383 to 3,929 steps were measured, 2.3e6; a run that stood still took what it was given.
        found = integrate_damped(chain, rows, AT_REST, tolerance, 0.8, most_work=5e6)
        assert found.status == elastic_state.DONE
        # At most 0.3 of the tolerance was measured, and 2e-10.
        assert error_of(found.peak_force, true.peak_force) < max(tolerance, 1e-9)


def test_steps_that_do_not_advance_end() -> None:
    """No step is accurate enough for this tolerance, so that all are as short as times resolve."""
    chain, rows = uniform(6, RESTITUTION, 0.2), pulse(1.5, 2.5, 30.0)
    found = integrate_damped(chain, rows, AT_REST, 1e-30, 0.8)
    assert found.status == elastic_state.STUCK
    assert found.steps < 20_000


def test_stop_and_most_work() -> None:
    chain, rows = uniform(6, RESTITUTION, 0.2), pulse(1.5, 2.5, 30.0)
    stopped = integrate_damped(chain, rows, AT_REST, 1e-9, 0.8, control=np.array([-1.0, 0.0, 0.0]))
    assert stopped.status == elastic_state.STOPPED
    per_step = damped_advance.STEP + 12 * 6  # stages, granules
    few = integrate_damped(chain, rows, AT_REST, 1e-9, 0.8, most_work=2.5 * per_step)
    assert (few.status, few.steps) == (elastic_state.TOO_MUCH, 3)


def test_runs_that_agree_by_chance_state_an_error() -> None:
    """With the least tolerance an error of 1.5e-11 was measured that no difference showed."""
    chain, rows = uniform(4, RESTITUTION, 0.2), pulse(1.5, 2.5, 10.0)
    same = integrate_damped(chain, rows, AT_REST, 1e-12, 0.8)
    assert accurate(lambda *_: same, 1e-10)[1].wanted > 1.5e-11


@pytest.mark.parametrize(("rtol", "tolerance"), [(1e-3, 1e-7), (1e-6, 2e-8), (1e-12, 1e-12)])
def test_the_first_tolerance_is_a_part_of_what_is_wanted(rtol: float, tolerance: float) -> None:
    assert first_tolerance(rtol) == pytest.approx(tolerance)
