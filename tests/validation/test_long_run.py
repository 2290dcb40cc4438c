"""One wave down 90,000 granules: the quick form, and that what drifts would be seen."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from hertzchain.engines.native.methods import METHODS
from validation import long_run

KEPT = Path(long_run.__file__).parent / "results" / "long_run.csv"


@pytest.fixture
def kept() -> pd.DataFrame:
    """Return the measured table kept in the repository."""
    return pd.read_csv(KEPT, comment="#")


@pytest.mark.slow
def test_the_quick_form_passes_and_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    csv, figure = tmp_path / "long_run.csv", tmp_path / "long_run.png"
    assert long_run.SCRIPT.run(["--quick", "-o", str(csv), "--plot", str(figure)]) == 0
    assert "18 of 18 rows pass" in capsys.readouterr().out
    assert all(entry.passed for entry in long_run.promises(pd.read_csv(csv, comment="#")))
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_what_is_kept_is_whole_and_keeps_its_promises(kept: pd.DataFrame) -> None:
    everyone = long_run.contenders(quick=False)
    for contender in everyone:
        own = kept[kept["contender"] == contender.method]
        assert own["granule"].tolist() == list(contender.marks)
    assert {one.method for one in everyone} == set(METHODS)
    rows = long_run.promises(kept)
    assert len(rows) == 18
    assert [entry for entry in rows if not entry.passed] == []
    assert KEPT.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
