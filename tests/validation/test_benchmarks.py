"""The benchmarks call the kernels as they are now."""

from __future__ import annotations

from pathlib import Path

import pandas
import pytest

import hertzchain as hc
from hertzchain.engines.native import elastic_state
from hertzchain.engines.native.kernel_input import leg_rows
from validation import benchmarks
from validation.benchmarks import TERMS, Measured, keep, march


def test_the_front_saves_evaluations(demo: hc.Scene) -> None:
    rows = leg_rows(demo.schedule(0.4 * demo.units.time), demo.units)
    front, whole = (march(rows, 60, moving) for moving in (8, 60))
    assert (front.status, whole.status) == (elastic_state.DONE, elastic_state.DONE)
    assert whole.granule_evaluations == 60 * whole.evaluations
    assert 0 < front.granule_evaluations < 0.8 * whole.granule_evaluations


@pytest.mark.parametrize("codes", [("native", "LAMMPS"), ("native", "LAMMPS", "LIGGGHTS")])
def test_figures_are_kept_with_the_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, codes: tuple[str, ...]
) -> None:
    measured = [Measured("A", "native, with error", 0.3, "ms"), Measured("B", "a ratio", 197.26)]
    for name in TERMS:
        measured += [Measured("K", f"{name}: {code} to 1e-4", 2.0, "ms") for code in codes]
    monkeypatch.setattr(benchmarks, "FIGURES", measured)
    keep(tmp_path)
    assert (
        "cores; hertzchain" in (tmp_path / "bench.csv").read_text(encoding="utf-8").split("\n")[0]
    )
    table = pandas.read_csv(tmp_path / "bench.csv", comment="#", keep_default_na=False)
    assert table.iloc[1].to_list() == ["B", "a ratio", 197.3, ""]
    assert len(table) == len(measured)
    drawn = (tmp_path / "bench.svg").read_text(encoding="utf-8")
    assert "Scenes with terms" in drawn
    assert all(f"{code} to 1e-" in drawn for code in codes)
    assert ("LIGGGHTS" in drawn) == ("LIGGGHTS" in codes)
