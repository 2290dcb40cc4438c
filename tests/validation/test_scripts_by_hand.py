"""Scripts run by hand: benchmarks, two commits, error bounds, extremes, error against cost."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.engine import Child
from hertzchain.verdict.tradeoff import WAYS
from tests import scenes
from tests.conftest import paper_scene
from validation import bench_before, error_bounds, extremes
from validation.benchmarks import TERMS, Measured, keep
from validation.run_all import run


def test_the_median_ratio_of_paired_turns_counts(capsys: pytest.CaptureFixture[str]) -> None:
    # A load that slows two turns, in both trees alike; "batch" does not run in the other tree.
    each: bench_before.Times = dict.fromkeys(bench_before.WORKLOADS, 1.0)
    slow, batch, *_ = each
    turns: list[tuple[bench_before.Times, bench_before.Times]] = [
        (each | {slow: old, batch: "AttributeError"}, each | {slow: new})
        for old, new in ((1.0, 1.2), (5.0, 6.0), (10.0, 9.0))
    ]
    assert bench_before.judge(turns, 1.15) == [f"{slow}: 1.20 times"]
    assert bench_before.judge(turns, 1.2) == []
    out = capsys.readouterr().out
    assert f"{slow:36}{5e3:10.3g}{6e3:10.3g}{1.2:11.2f}" in out
    assert "left out: AttributeError" in out
    with pytest.raises(RuntimeError, match="does not run: AttributeError"):
        bench_before.judge([(new, old) for old, new in turns], 1.15)


def test_what_cannot_be_compared_is_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("CI", raising=False)
    assert bench_before.run(["--revision", "none_such"]) == 2
    assert capsys.readouterr().err.startswith("none_such is not a commit of a git clone in ")


@pytest.mark.parametrize("codes", [("native", "LAMMPS"), ("native", "LAMMPS", "LIGGGHTS")])
def test_benchmarks_are_kept_with_the_machine(tmp_path: Path, codes: tuple[str, ...]) -> None:
    measured = [Measured("A", "native, with error", 0.3, "ms"), Measured("B", "a ratio", 197.26)]
    for name in TERMS:
        measured += [Measured("K", f"{name}: {code} to 1e-4", 2.0, "ms") for code in codes]
    keep(tmp_path, measured)
    assert (
        "cores; hertzchain" in (tmp_path / "bench.csv").read_text(encoding="utf-8").split("\n")[0]
    )
    table = pd.read_csv(tmp_path / "bench.csv", comment="#", keep_default_na=False)
    assert table.iloc[1].to_list() == ["B", "a ratio", 197.3, ""]
    assert len(table) == len(measured)
    drawn = (tmp_path / "bench.svg").read_text(encoding="utf-8")
    assert all((f"{code} to 1e-" in drawn) == (code in codes) for code in ("LAMMPS", "LIGGGHTS"))


@pytest.mark.slow
@pytest.mark.lammps
def test_every_run_is_right_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extremes, "CHUNK", 12)
    table = extremes.measure(True, True)
    # How long a run takes is the machine's matter here.
    rows = [entry for entry in extremes.promises(table) if "slowest" not in entry.what]
    assert [entry.what for entry in rows if not entry.passed] == []
    answered = table[(table["run"] == "native") & (table["outcome"] == extremes.RIGHT)]
    assert len(answered) >= 3  # of 12: the others are refused, with a reason
    assert len(extremes.draw(table).axes) == 4
    late = table.assign(seconds=table["seconds"].where(table.index != table.index[-1], 30.0))
    assert any("slowest" in entry.what for entry in extremes.promises(late) if not entry.passed)


@pytest.mark.slow
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


@pytest.mark.slow
def test_safety_factors_suffice(monkeypatch: pytest.MonkeyPatch) -> None:
    """They do in random scenes, and not for peaks that are off by 50 times what was estimated."""
    table = error_bounds.measure(True, False)
    assert {"planned", "adaptive", "erratic", "smooth"} <= set(table["kind"])
    rows = error_bounds.promises(table)
    assert len(rows) == len(table)
    assert [entry.what for entry in rows if not entry.passed] == []
    original = hc.Native.run

    def off(self: hc.Native, scene: hc.Scene) -> hc.Result:
        result = original(self, scene)
        if self.rtol != error_bounds.TRUE:
            result.peak_force[:] *= 1 + 50 * result.error_estimate
        return result

    monkeypatch.setattr(hc.Native, "run", off)
    planted = error_bounds.promises(error_bounds.measure(True, False))
    assert {entry.what for entry in planted if not entry.passed} >= {
        entry.what for entry in rows if "forces" in entry.what and entry.backend != "SciPy"
    }


@pytest.mark.slow
@pytest.mark.lammps
def test_the_tradeoff_in_its_quick_form(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    small = replace(scenes.load("demo"), chain=replace(scenes.load("demo").chain, granules=12))
    monkeypatch.setattr(hc.Scene, "from_toml", lambda _: small)
    assert run(["tradeoff", "--quick", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "tradeoff.png").read_bytes().startswith(b"\x89PNG")
    table = pd.read_csv(tmp_path / "tradeoff.csv", comment="#")
    assert table["scene"].unique().tolist() == scenes.NAMES[:1]
    assert set(table["engine"]) == set(WAYS)
    assert "11 of 11 rows pass" in capsys.readouterr().out
