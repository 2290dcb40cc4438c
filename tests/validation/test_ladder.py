"""The ladder: a mistake fails at the rung that isolates it, and not below."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import pytest

import hertzchain.observables.transition
from hertzchain.engines.native.methods import RUNGE_KUTTA_4
from hertzchain.engines.native.named_methods import METHODS
from hertzchain.engines.native.refinement import Fixed
from hertzchain.errors import RunFailed
from validation import ladder, mistakes
from validation.ladder import RUNGS
from validation.planting import Plant


def test_a_rung_that_cannot_be_measured_fails_alone(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> list[ladder.Sample]:
        raise RunFailed("it cannot be")

    rungs = (RUNGS[0], replace(RUNGS[1], measure=stop))
    monkeypatch.setattr(ladder, "RUNGS", rungs)
    table = ladder.measure(True, False)
    rows = ladder.promises(table)
    (failed,) = [entry for entry in rows if not entry.passed]
    assert failed.what == "2 two-granule collision: it cannot be"
    monkeypatch.setattr("validation.script.why_no_lammps", lambda: None)
    script = replace(ladder.SCRIPT, measure=lambda *_: table)
    assert script.run([]) == 1
    assert "Mend the lowest failing rung first: 2 two-granule" in capsys.readouterr().out


# Known answers


# Planted mistakes


def wrong_runge_kutta() -> AbstractContextManager[Any]:
    """RK4 with a plain mean of its four slopes."""
    stepper = replace(RUNGE_KUTTA_4, velocity_weights=(0.25, 0.25, 0.25, 0.25))
    return patch.dict(METHODS, {"rk4": replace(METHODS["rk4"], walker=Fixed(stepper))})


@contextmanager
def far_contact_missing() -> Iterator[None]:
    """Contact 81 of the deck: shorter chains do not have it."""
    exclude = "group left id 80\ngroup right id 81\nneigh_modify exclude group left right\n"
    with mistakes.also(exclude)():
        yield


def transition_from_12() -> AbstractContextManager[Any]:
    """Another smallest p."""
    return patch.object(hertzchain.observables.transition, "SMALLEST", 12)


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("plant", "rung", "who"),
    [
        pytest.param(mistakes.stiffer("1.001"), 1, {"lammps"}, id="stiffness"),
        pytest.param(
            mistakes.of_the_chain("contact_stiffness", 1.001), 1, {"native"}, id="stiffness, native"
        ),
        pytest.param(mistakes.peaks_of_samples, 2, {"lammps"}, id="peaks of samples"),
        pytest.param(wrong_runge_kutta, 3, {"native"}, id="rk4"),
        pytest.param(lambda: mistakes.force_at("(time-dt)"), 4, {"lammps"}, id="force late"),
        pytest.param(
            mistakes.native_force_late, 4, {"native", "lammps"}, id="force late, native"
        ),
        pytest.param(
            lambda: mistakes.other_legs(mistakes.without_corners),
            4,
            {"native", "lammps"},
            id="corners",
        ),
        pytest.param(far_contact_missing, 5, {"lammps"}, id="far contact"),
        pytest.param(transition_from_12, 6, {"native", "lammps"}, id="transition"),
    ],
)  # fmt: skip
def test_a_mistake_fails_at_its_rung_and_not_below(
    plant: Plant, rung: int, who: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ladder, "RUNGS", RUNGS[:rung])
    with plant():
        rows = ladder.promises(ladder.measure(True, True))
    failed = [entry for entry in rows if not entry.passed]
    assert {int(entry.what[0]) for entry in failed} == {rung}
    assert {entry.backend for entry in failed} == who
