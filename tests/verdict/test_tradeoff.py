"""Error against cost: measured numbers are the reported ones, and the frontier is right."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.errors import BackendMissing, RunFailed
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict import tradeoff as module
from hertzchain.verdict.tradeoff import (
    WAYS,
    Contender,
    Outcome,
    Row,
    Tradeoff,
    cheapest,
    contenders,
    frontier,
    measured,
    tradeoff,
    typical,
)
from tests.conftest import STEEL, paper_scene


@pytest.fixture(scope="module")
def scene() -> Iterator[hc.Scene]:
    """A chain that is done in a moment; no setting is left out where the machine is busy."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_LONGEST_RUN_SECONDS", math.inf)
        yield paper_scene("cosine-triangular", 1.0, 2.0, granules=6)


@pytest.fixture(scope="module")
def whole(scene: hc.Scene) -> Tradeoff:
    """Everything but LAMMPS, each run once in a round."""
    said: list[str] = []
    engines = [name for name in WAYS if name != "LAMMPS"]
    result = tradeoff(scene, engines, said.append, enough=0.0)
    names = [contender.name for contender in contenders(scene) if contender.engine in engines]
    assert said == ["the truth: the reference method with short steps", *names, *names]
    return result


def rows_of(result: Tradeoff, contender: str) -> list[Row]:
    rows = [row for row in result.rows if row.contender == contender]
    assert rows, contender
    return rows


def test_all_settings_of_all_contenders_are_measured(whole: Tradeoff) -> None:
    assert (whole.missing, whole.remarks) == (False, ())
    assert whole.truth_error == module.TRUTH_ERROR  # its step moves it by less here
    for contender in contenders(whole.scene):
        if contender.engine == "LAMMPS":
            continue
        rows = rows_of(whole, contender.name)
        assert [row.natural_step for row in rows if row.natural_step] == list(contender.steps)
        assert [row.rtol for row in rows if row.rtol] == list(contender.rtols)
        assert {row.engine for row in rows} == {contender.engine}
        for row in rows:
            assert row.wall_time > 0
            if row.step is not None and row.natural_step is not None:
                assert row.step == row.natural_step * whole.scene.units.time


# LAMMPS


@pytest.mark.lammps
def test_lammps_is_measured_plain_and_extrapolated(scene: hc.Scene) -> None:
    measured = tradeoff(scene, ["LAMMPS"], enough=0.0)
    for row in rows_of(measured, "LAMMPS"):
        assert row.step is not None
        assert row.force_evaluations == sum(leg.steps for leg in scene.schedule(row.step))
    for row in rows_of(measured, "LAMMPS, extrapolated"):
        assert row.step is not None
        assert row.force_evaluations == 3 * sum(leg.steps for leg in scene.schedule(2 * row.step))
    plain = {row.natural_step: row.error for row in rows_of(measured, "LAMMPS")}
    better = {row.natural_step: row.error for row in rows_of(measured, "LAMMPS, extrapolated")}
    for step in (0.05, 0.025, 0.0125):
        assert better[step] < plain[step] / 50


# Measuring


def fixed(outcomes: dict[float, Outcome]) -> Contender:
    """A contender that knows its answers."""

    def run(scene: hc.Scene, step: float) -> Outcome:
        return outcomes[min(outcomes, key=lambda key: abs(key - step / scene.units.time))]

    return Contender("fixed", "compiled", run, steps=tuple(outcomes))


def test_a_setting_that_fails_has_no_row(scene: hc.Scene) -> None:
    def run(scene: hc.Scene, step: float) -> Outcome:
        if step > 0.3 * scene.units.time:
            raise RunFailed("too long a step")
        return Outcome(np.ones(5), 1)

    contender = Contender("one", "compiled", run, steps=(0.4, 0.2, 0.1))
    rows = measured(contender, scene, np.ones(5), 0.0)
    assert [row.natural_step for row in rows] == [0.2, 0.1]
    with pytest.raises(RunFailed, match="too long a step"):
        measured(replace(contender, steps=(0.4,)), scene, np.ones(5), 0.0)


@pytest.mark.parametrize("missing", [False, True])
def test_one_that_always_fails_is_a_remark(
    missing: bool, scene: hc.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a backend that is missing it is said once."""

    def run(_: hc.Scene, __: float) -> Outcome:
        raise (BackendMissing if missing else RunFailed)("it does not work")

    broken = Contender("broken", "compiled", run, steps=(0.2, 0.1))
    monkeypatch.setattr(module, "contenders", lambda *_: (broken, fixed({0.2: ONES})))
    measured = tradeoff(scene, ["compiled"], enough=0.0)
    said = "it does not work" if missing else "broken: it does not work"
    assert (measured.missing, measured.remarks) == (missing, (said,))
    assert [row.contender for row in measured.rows] == ["fixed"]


ONES = Outcome(np.ones(5), 1)


# The frontier


def a_row(time: float, error: float, contender: str = "one") -> Row:
    return Row(contender, "compiled", 1.0, 1.0, None, error, 1, time)


_few = st.sampled_from([1e-14, 1e-13, 1e-9, 1e-6, 1e-3, 0.1])
"""Few values, so that many are equal; two are below the error of the truth."""

ROWS = st.lists(st.builds(a_row, st.sampled_from([1e-3, 2e-3, 1e-2, 0.1, 1.0]), _few), max_size=12)


def known(row: Row) -> float:
    return max(row.error, 1e-12)


def beats(row: Row, other: Row) -> bool:
    as_good = row.wall_time <= other.wall_time and known(row) <= known(other)
    return as_good and (row.wall_time < other.wall_time or known(row) < known(other))


@given(ROWS)
def test_the_frontier_is_what_nothing_beats(rows: list[Row]) -> None:
    best = frontier(rows, 1e-12)
    for row in rows:
        beaten = any(beats(other, row) for other in rows)
        points = [(point.wall_time, known(point)) for point in best]
        assert points.count((row.wall_time, known(row))) == (0 if beaten else 1)
    assert all(point in rows for point in best)
    for before, after in itertools.pairwise(best):
        assert before.wall_time < after.wall_time
        assert known(before) > known(after)


def test_a_typical_setting_has_the_range_of_its_errors(scene: hc.Scene) -> None:
    each = [Tradeoff(scene, (a_row(time, 1e-3 * time),), 1e-12, False, ()) for time in (1, 2, 6)]
    (point,) = typical(each)
    assert (point.row.wall_time, point.row.error) == (2, 2e-3)
    assert (point.lowest, point.highest) == (1e-3, 6e-3)
    (alone,) = typical(each[:1])
    assert alone.row == each[0].rows[0]


@given(ROWS)
def test_the_cheapest_is_right_to_what_is_wanted(rows: list[Row]) -> None:
    best = cheapest(rows, 1e-6, 1e-12)
    enough = [row.wall_time for row in rows if row.error <= 1e-6]
    assert [row.wall_time for row in best.values()] == ([min(enough)] if enough else [])
    assert cheapest(rows, 1e-13, 1e-12) == {}


# Scenes with terms

STRIKER = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0, radius=6e-3), wall=hc.Wall("rigid"))


def test_native_methods_on_a_scene_with_terms() -> None:
    """Errors are those of single runs against the truth, the force on the wall among them."""
    measured = tradeoff(STRIKER, ["compiled"], enough=0.0)
    assert measured.remarks == ()
    assert measured.contenders == (
        *(f"{name}, compiled" for name in ("velocity-verlet", "srkn-11b", "reference")),
        *("rtol, with estimate", "rtol, without estimate"),
    )
    truth = hc.Native("reference", module.TRUTH_STEP * STRIKER.contact_time).run(STRIKER)
    for row in rows_of(measured, "srkn-11b, compiled"):
        assert row.step == row.natural_step * STRIKER.contact_time
        if row.natural_step < 0.1:  # longer steps cost more runs for their estimate
            continue
        alone = hc.Native("srkn-11b", row.step).run(STRIKER)
        assert row.error == largest_difference(alone.peak_force, truth.peak_force)
        assert row.force_evaluations == alone.force_evaluations
    for row in rows_of(measured, "rtol, with estimate"):
        assert row.error <= row.rtol
    # Steps 22 times as short: above second order, although contacts open.
    errors = [row.error for row in rows_of(measured, "srkn-11b, compiled")]
    assert errors[0] / errors[-1] > 1e3
