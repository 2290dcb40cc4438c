"""The kernel of damped contacts: closed forms, balances, and another solver on random chains."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from hertzchain.engines.native import damped_advance, elastic_state
from hertzchain.engines.native.damped_plan import accurate, first_tolerance
from hertzchain.engines.native.damped_runs import integrate_damped
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.kernel_input import room_for
from hertzchain.observables.history import Recorder

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
