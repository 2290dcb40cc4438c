"""Scripts run by hand: benchmarks, two commits, error bounds, extremes, a long run, a clone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.isolation import Child
from tests.command_line import python
from tests.conftest import paper_scene
from tests.places import ROOT
from validation import error_bounds, extremes, judging, long_run
from validation.bench_before import Compared, by_turns, judge, slower


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
