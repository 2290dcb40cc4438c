"""The script of the extremes: its quick form, and that it can fail."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.isolation import Child
from tests.conftest import paper_scene
from validation import extremes, judging

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
    answered = table[(table["run"] == "native") & (table["outcome"] == judging.RIGHT)]
    assert len(answered) >= 3  # of 12: the others are refused, with a reason
    assert set(table["outcome"]) <= {judging.RIGHT, *judging.REASONS.values()}
    assert len(extremes.draw(table).axes) == 4
    late = table.assign(seconds=table["seconds"].where(table.index != table.index[-1], 30.0))
    assert any("slowest" in entry.what for entry in extremes.promises(late) if not entry.passed)


@pytest.mark.lammps
@pytest.mark.slow
def test_with_lammps() -> None:
    assert extremes.SCRIPT.run(["--quick"]) == 0


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
        judge = judging.Judge(0, paper_scene("cosine", 1.0, 2.0), child, rtol=1e-9)
        assert judge.native("native", hc.Native(peaks_only=True)).outcome == "wrong"
        assert judge.native("native", hc.Native(rtol=1e-6, peaks_only=True)).outcome == "right"
