"""The ladder: a mistake fails at the rung that isolates it, and not below."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
import pytest

import hertzchain.observables.transition
from hertzchain.engines.native.methods import RUNGE_KUTTA_4
from hertzchain.engines.native.named_methods import METHODS
from hertzchain.engines.native.refinement import Fixed
from hertzchain.errors import RunFailed
from hertzchain.theory.solitary_wave import solitary_wave
from tests.conftest import STEEL
from validation import ladder, mistakes
from validation.ladder import POLYMER, RUNGS, Promise, Rung, hertz_force, lowest_failing, wave_at
from validation.limits import two_granules
from validation.planting import Plant


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """The quick form, measured once."""
    return ladder.measure(True, True)


PROMISES = [
    pytest.param(rung, promise, backend, id=f"{rung.number} {promise.what} {backend}")
    for rung in RUNGS
    for promise in rung.promises
    for backend in promise.tolerance
]


@pytest.mark.lammps
def test_every_rung_holds_from_the_lowest_up(table: pd.DataFrame) -> None:
    rows = ladder.promises(table)
    assert [entry.what for entry in rows if not entry.passed] == []
    assert lowest_failing(rows) is None
    numbers = [int(entry.what[0]) for entry in rows]
    assert numbers == sorted(numbers)
    assert set(numbers) == {1, 2, 3, 4, 5, 6}
    assert len(ladder.draw(table).axes) == 6


@pytest.mark.lammps
@pytest.mark.parametrize(("rung", "promise", "backend"), PROMISES)
def test_a_number_that_is_off_fails_its_row(
    table: pd.DataFrame,
    rung: Rung,
    promise: Promise,
    backend: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One number is wrong by three times the tolerance; an order by a fifth."""
    own = (table["rung"] == rung.number) & (table["backend"] == backend)
    own &= table["what"] == promise.what
    of = table.loc[own, "of"].iloc[-1]
    own &= table["of"] == of
    wrong = table[table["rung"] == rung.number].copy()
    monkeypatch.setattr(ladder, "RUNGS", (rung,))  # all the others hold
    if promise.order is not None:
        wrong.loc[table.index[own], "measured"] *= wrong.loc[table.index[own], "x"] ** 0.2
    else:
        largest = table.loc[own, "expected"].abs().max() or 1.0
        off = 3 * promise.tolerance[backend] * largest or 1.0
        last = table.index[own][-1]
        wrong.loc[last, "measured"] = wrong.loc[last, "expected"] + off
    rows = ladder.promises(wrong)
    (failed,) = [entry for entry in rows if not entry.passed]
    assert failed.backend == backend
    assert failed.what.startswith(f"{rung.title}: {promise.what}, {of}")
    assert lowest_failing(rows) == rung


@pytest.mark.lammps
def test_what_is_no_number_or_missing_fails(table: pd.DataFrame) -> None:
    place = (
        (table["rung"] == 2) & (table["backend"] == "lammps") & (table["what"] == ladder.HISTORY)
    )
    wrong = table.copy()
    wrong.loc[wrong.index[place][3], "measured"] = np.nan
    (failed,) = [entry for entry in ladder.promises(wrong) if not entry.passed]
    assert failed.what.startswith("2 two-granule collision: F(t) / F0")
    (failed,) = [entry for entry in ladder.promises(table[~place]) if not entry.passed]
    assert failed.what.endswith("nothing was measured")


@pytest.mark.lammps
def test_a_table_read_from_its_file_is_judged_alike(table: pd.DataFrame, tmp_path: Path) -> None:
    table.to_csv(tmp_path / "ladder.csv", index=False)
    read = pd.read_csv(tmp_path / "ladder.csv", comment="#")
    assert ladder.promises(read) == ladder.promises(table)
    assert len(ladder.draw(read).axes) == 6


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


def test_without_lammps_native_climbs_alone() -> None:
    rows = ladder.promises(ladder.measure(True, False))
    assert {entry.backend for entry in rows} == {"native"}
    assert all(entry.passed for entry in rows)
    assert {entry.what[0] for entry in rows} == set("123456")


# Known answers


def test_hertz_by_the_closed_form_of_the_chain() -> None:
    for material in (STEEL, POLYMER):
        chain = hertzchain.Chain(2, **material)
        overlap = np.array([1e-7, 1e-5])
        expected = chain.contact_stiffness * overlap**1.5
        assert hertz_force(material, overlap) == pytest.approx(expected, rel=1e-14, abs=0)
        assert ladder.sphere_mass(material) == pytest.approx(chain.granule_mass, rel=1e-14, abs=0)


def test_two_granules_part_when_their_force_is_gone() -> None:
    assert two_granules(ladder._PARTING) == pytest.approx(0.0, abs=1e-13)
    assert two_granules(ladder._PARTING - 0.1) > 1e-4


def test_the_wave_between_the_points_where_it_is_known() -> None:
    wave = solitary_wave()
    assert wave_at(wave.x[::7]) == pytest.approx(wave.overlap[::7] ** 1.5, abs=1e-13)
    # r = (Lambda conv r^(3/2)) / c^2 between the points: at 0.03, by the trapezoidal rule.
    x = np.arange(-2, 2, 1 / 64)
    kernel = np.clip(1 - np.abs(x), 0, None)
    overlap = np.sum(kernel * wave_at(0.03 - x)) / 64 / wave.speed**2
    assert wave_at(np.array([0.03])) == pytest.approx([overlap**1.5], rel=1e-4, abs=0)


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


@pytest.mark.lammps
def test_a_chain_that_is_wrong_far_down_fails_at_no_other_rung() -> None:
    with far_contact_missing():
        rows = ladder.promises(ladder.measure(True, True))
    assert {int(entry.what[0]) for entry in rows if not entry.passed} == {5}
