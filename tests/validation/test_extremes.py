"""The script of the extremes: its quick form, and that it can fail."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.isolation import Child
from tests.conftest import paper_scene
from validation import extremes

pytestmark = pytest.mark.slow  # seconds, for a script that is run by hand


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """The quick form on half as many scenes, by native, at shorter time limits."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(extremes, "CHUNK", 12)
        patch.setattr(extremes, "NATIVE_LIMIT", 0.2)
        return extremes.measure(True, False)


def test_every_run_is_right_or_refused(table: pd.DataFrame) -> None:
    # How long a run takes is the machine's matter here.
    rows = [entry for entry in extremes.promises(table) if "slowest" not in entry.what]
    assert [entry.what for entry in rows if not entry.passed] == []
    answered = table[(table["run"] == "native") & (table["outcome"] == extremes.RIGHT)]
    assert len(answered) >= 3  # of 12: the others are refused, with a reason
    assert set(table["outcome"]) <= {extremes.RIGHT, *extremes.REASONS.values()}


@pytest.mark.lammps
@pytest.mark.slow
def test_with_lammps() -> None:
    assert [entry for entry in extremes.SCRIPT.compare(quick=True) if not entry.passed] == []


@pytest.mark.parametrize("outcome", ["wrong", "traceback: ValueError", "RunFailed: lost"])
def test_a_third_kind_fails(table: pd.DataFrame, outcome: str) -> None:
    table = table.copy()
    table.loc[table.index[-1], "outcome"] = outcome
    run = table["run"].iloc[-1]
    failed = [entry.what for entry in extremes.promises(table) if not entry.passed]
    assert failed == [f"{run}: {(table['run'] == run).sum()} runs, neither"]


def test_a_run_above_its_limit_fails(table: pd.DataFrame) -> None:
    table = table.copy()
    table.loc[table.index[-1], "seconds"] = 30.0
    assert not all(entry.passed for entry in extremes.promises(table))


def test_a_silent_error_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Peaks that are off by twice what they say are wrong."""
    original = hc.Native.run

    def off(self: hc.Native, scene: hc.Scene, record: Any = None) -> hc.Result:
        result = original(self, scene, record)
        if self.rtol is None:
            result.peak_force[:] *= 1 + 2 * result.error_estimate
        return result

    monkeypatch.setattr(hc.Native, "run", off)
    with Child() as child:
        judge = extremes.Judge(0, paper_scene("cosine", 1.0, 2.0), child, rtol=1e-9)
        assert judge.native("native", hc.Native(peaks_only=True)).outcome == "wrong"
        assert judge.native("native", hc.Native(rtol=1e-6, peaks_only=True)).outcome == "right"


def test_random_scenes_span_the_ranges() -> None:
    scenes = [extremes.random_scene(np.random.default_rng([4, k])) for k in range(300)]
    for name, (low, high) in (("granules", (5, 5e4)), ("radius", (1e-8, 10))):
        values = [getattr(scene.chain, name) for scene in scenes]
        assert min(values) < low
        assert max(values) > high


def numbers(data: Any) -> list[float]:
    return [float(number) for number in data]


def test_the_figure_has_every_run(table: pd.DataFrame) -> None:
    figure = extremes.draw(table)
    figure.draw_without_rendering()
    outcomes, depths, errors, steps = figure.axes
    random = table[table["step"].isna() & (table["run"] == "native")]
    for axes, column in ((outcomes, "momentum_ratio"), (depths, "overlap_ratio")):
        dots = [line for line in axes.get_lines() if line.get_marker() == "."]
        shown = {str(line.get_label()): sorted(numbers(line.get_xdata())) for line in dots}
        wanted = random.groupby("outcome")[column].apply(sorted).to_dict()
        assert {name: found for name, found in shown.items() if found} == wanted
    right = random[random["outcome"] == extremes.RIGHT]
    (points,) = (line for line in errors.get_lines() if line.get_label() == "native")
    assert numbers(points.get_xdata()) == right["bound"].tolist()
    assert numbers(points.get_ydata()) == np.maximum(right["measured"], 1e-16).tolist()
    stepped = table[table["step"].notna()]
    labels = {str(line.get_label()) for line in steps.get_lines()}
    assert set(stepped["run"]) <= labels
    for run, group in stepped[stepped["outcome"] == extremes.RIGHT].groupby("run"):
        (line,) = (line for line in steps.get_lines() if line.get_label() == run)
        assert numbers(line.get_ydata()) == group.groupby("step")["measured"].max().tolist()
