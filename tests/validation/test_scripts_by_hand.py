"""Scripts run by hand: benchmarks, two commits, error bounds, extremes, a long run, a clone."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import RunFailed
from tests.command_line import python
from tests.conftest import paper_scene
from tests.places import ROOT
from validation import bench_before, error_bounds, extremes, long_run
from validation.bench_before import Compared, compared, slower, times_of
from validation.benchmarks import TERMS, Measured, keep


def test_the_ratio_is_the_median_of_turns() -> None:
    # A load that slows two turns, in both trees alike.
    turns = [({"demo": old}, {"demo": new}) for old, new in ((1.0, 1.2), (5.0, 6.0), (10.0, 9.0))]
    each, left_out = compared(turns)
    assert each == {"demo": Compared(5.0, 6.0, 1.2)}
    assert left_out == {}
    assert slower(each, 1.15) == ["demo"]
    assert slower(each, 1.2) == []
    assert slower({"demo": Compared(1.0, 1.0, float("nan"))}) == ["demo"]


def test_what_does_not_run_in_this_tree_is_an_error_and_elsewhere_left_out() -> None:
    why = "AttributeError: no such function"
    assert compared([({"batch": why}, {"batch": 1.0})]) == ({}, {"batch": why})
    assert compared([({}, {"batch": 1.0})]) == ({}, {"batch": "missing"})
    with pytest.raises(RunFailed, match="batch does not run: AttributeError"):
        compared([({"batch": 1.0}, {"batch": why})])


@pytest.mark.parametrize("ratio", [1.15, 1.3])
def test_the_last_line_is_the_verdict(
    ratio: float, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench_before, "find_commit", lambda _: None)
    monkeypatch.setattr(bench_before, "is_same", lambda _: False)
    monkeypatch.setattr(bench_before, "checked_out", contextlib.nullcontext)
    old, new = (
        {"demo": 1.0, "batch": "AttributeError: no such function"},
        {"demo": ratio, "batch": 1.0},
    )
    monkeypatch.setattr(bench_before, "measure", lambda _: [(old, new)])
    is_slower = ratio > 1.2
    assert bench_before.run(["--revision", "v0.1.0", "--limit", "1.2"]) == is_slower
    out, err = capsys.readouterr()
    assert "new / old: the median of the ratios of paired turns" in out
    begin = "measuring, about two minutes\n"
    slow = "slower than v0.1.0: demo: 1.30 times\n"
    assert err == begin + slow * is_slower
    verdict = "no workload is more than 1.2 times slower than v0.1.0"
    assert (out.splitlines()[-1] == verdict) != is_slower


def test_what_cannot_be_compared_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.setattr(bench_before, "ROOT", ROOT / "hertzchain")
    assert bench_before.run([]) == 2
    assert "git" in capsys.readouterr().err
    monkeypatch.setenv("PATH", str(tmp_path))
    assert bench_before.run([]) == 2
    err = capsys.readouterr().err
    assert err.endswith("install git to compare commits\n")
    assert err.count("\n") == 1


def test_a_tree_that_cannot_be_measured_is_reported(tmp_path: Path) -> None:
    package = tmp_path / "hertzchain"
    package.mkdir()
    (package / "__init__.py").write_text("raise SystemExit(3)", encoding="utf-8")
    with pytest.raises(RunFailed, match="ended with status 3"):
        times_of(tmp_path)


@pytest.mark.parametrize("codes", [("native", "LAMMPS"), ("native", "LAMMPS", "LIGGGHTS")])
def test_figures_are_kept_with_the_machine(tmp_path: Path, codes: tuple[str, ...]) -> None:
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
    assert "Scenes with terms" in drawn
    assert all(f"{code} to 1e-" in drawn for code in codes)
    assert ("LIGGGHTS" in drawn) == ("LIGGGHTS" in codes)


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """The quick form on half as many scenes, by native, at shorter time limits."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(extremes, "CHUNK", 12)
        patch.setattr(extremes, "NATIVE_LIMIT", 0.2)
        return extremes.measure(True, False)


@pytest.mark.slow
def test_every_run_is_right_or_refused(table: pd.DataFrame) -> None:
    # How long a run takes is the machine's matter here.
    rows = [entry for entry in extremes.promises(table) if "slowest" not in entry.what]
    assert [entry.what for entry in rows if not entry.passed] == []
    answered = table[(table["run"] == "native") & (table["outcome"] == extremes.RIGHT)]
    assert len(answered) >= 3  # of 12: the others are refused, with a reason
    assert set(table["outcome"]) <= {extremes.RIGHT, *extremes.REASONS.values()}
    assert len(extremes.draw(table).axes) == 4
    late = table.assign(seconds=table["seconds"].where(table.index != table.index[-1], 30.0))
    assert any("slowest" in entry.what for entry in extremes.promises(late) if not entry.passed)


@pytest.mark.lammps
@pytest.mark.slow
def test_extremes_with_lammps() -> None:
    assert extremes.SCRIPT.run(["--quick"]) == 0


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
    assert {"plan", "adaptive", "equal steps", "second order"} <= set(table["kind"])
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
        entry.what for entry in rows if "forces" in entry.what and "SciPy" not in entry.what
    }


@pytest.mark.slow
def test_the_quick_form_passes_and_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    csv, figure = tmp_path / "long_run.csv", tmp_path / "long_run.png"
    assert long_run.SCRIPT.run(["--quick", "-o", str(csv), "--plot", str(figure)]) == 0
    assert "14 of 14 rows pass" in capsys.readouterr().out
    assert all(entry.passed for entry in long_run.promises(pd.read_csv(csv, comment="#")))
    assert figure.read_bytes().startswith(b"\x89PNG")


_AS_A_SCRIPT = """
import runpy, sys
script, root, site = sys.argv[1:]
own = [path for path in sys.path if path not in ("", root)]  # an editable install adds the clone
sys.path[:] = [script.rpartition("/")[0], site, *own]
sys.argv = [script, "--help"]
runpy.run_path(script, run_name="__main__")
"""
"""What ``python SCRIPT --help`` does where hertzchain alone is installed, in a folder."""


@pytest.mark.slow
@pytest.mark.parametrize("script", ["table2.py", "physics/published.py", "run_all.py"])
def test_a_script_needs_the_package_alone(script: str, tmp_path: Path) -> None:
    (tmp_path / "hertzchain").symlink_to(ROOT / "hertzchain")
    path = ROOT / "validation" / script
    # -P and -E: neither this folder nor what the tests have set leads to the clone.
    done = python("-P", "-E", "-c", _AS_A_SCRIPT, path, ROOT, tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("usage: ")
