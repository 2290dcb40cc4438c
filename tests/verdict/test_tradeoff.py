"""Error against cost: measured numbers are the reported ones, and the frontier is right."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
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
    contenders,
    measured,
    tradeoff,
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


# Measuring


def test_a_setting_that_fails_has_no_row(scene: hc.Scene) -> None:
    def run(scene: hc.Scene, step: float) -> Outcome:
        if step > 0.3 * scene.units.time:
            raise RunFailed("too long a step")
        return Outcome(np.ones(5), 1)

    contender = Contender("one", "compiled", run, steps=(0.4, 0.2, 0.1))
    rows = [*measured(contender, scene, np.ones(5), 0.0)]
    assert [row.natural_step for row in rows] == [0.2, 0.1]
    with pytest.raises(RunFailed, match="too long a step"):
        [*measured(replace(contender, steps=(0.4,)), scene, np.ones(5), 0.0)]


@pytest.mark.parametrize("missing", [False, True])
def test_one_that_always_fails_is_a_remark(
    missing: bool, scene: hc.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a backend that is missing it is said once."""

    def run(_: hc.Scene, __: float) -> Outcome:
        raise (BackendMissing if missing else RunFailed)("it does not work")

    fixed = Contender("fixed", "compiled", lambda *_: Outcome(np.ones(5), 1), steps=(0.2,))
    broken = Contender("broken", "compiled", run, steps=(0.2, 0.1))
    monkeypatch.setattr(module, "contenders", lambda *_: (broken, fixed))
    measured = tradeoff(scene, ["compiled"], enough=0.0)
    said = "it does not work" if missing else "broken: it does not work"
    assert (measured.missing, measured.remarks) == (missing, (said,))
    assert [row.contender for row in measured.rows] == ["fixed"]


# The frontier

_few = st.sampled_from([1e-14, 1e-13, 1e-9, 1e-6, 1e-3, 0.1])
"""Few values, so that many are equal; two are below the error of the truth."""

ROWS = st.lists(
    st.builds(
        lambda time, error: Row("one", "compiled", 1.0, 1.0, None, error, 1, time),
        st.sampled_from([1e-3, 2e-3, 1e-2, 0.1, 1.0]), _few,
    ), max_size=12,
)  # fmt: skip


def points(rows: Sequence[Row]) -> list[tuple[float, float]]:
    """Times and errors that are known."""
    return [(row.wall_time, max(row.error, 1e-12)) for row in rows]


@given(rows=ROWS)
def test_the_frontier_is_what_nothing_beats(scene: hc.Scene, rows: list[Row]) -> None:
    tradeoff = Tradeoff(scene, tuple(rows), 1e-12)
    best, every = points(tradeoff.frontier), points(rows)
    for time, error in every:
        beaten = any(t <= time and e <= error and (t, e) != (time, error) for t, e in every)
        assert best.count((time, error)) == (0 if beaten else 1)
    assert set(tradeoff.frontier) <= set(rows)
    assert best == sorted(best)
    for accuracy in (1e-6, 1e-13):
        enough = [time for time, error in every if error <= accuracy]
        cheapest = tradeoff.cheapest(accuracy)
        assert (cheapest and cheapest.wall_time) == min(enough, default=None)


# Scenes with terms

STRIKER = hc.Scene(hc.Chain(8, **STEEL), hc.Striker(1.0, radius=6e-3), wall=hc.Wall("rigid"))


def test_native_methods_on_a_scene_with_terms() -> None:
    """Errors are those of single runs against the truth, the force on the wall among them."""
    measured = tradeoff(STRIKER, ["compiled"], enough=0.0)
    assert measured.remarks == ()
    assert tuple(dict.fromkeys(row.contender for row in measured.rows)) == (
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
