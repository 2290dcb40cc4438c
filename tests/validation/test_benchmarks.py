"""The benchmarks call the kernels as they are now."""

from __future__ import annotations

from pathlib import Path

import pandas
import pytest

from validation.benchmarks import TERMS, Measured, keep


@pytest.mark.parametrize("codes", [("native", "LAMMPS"), ("native", "LAMMPS", "LIGGGHTS")])
def test_figures_are_kept_with_the_machine(tmp_path: Path, codes: tuple[str, ...]) -> None:
    measured = [Measured("A", "native, with error", 0.3, "ms"), Measured("B", "a ratio", 197.26)]
    for name in TERMS:
        measured += [Measured("K", f"{name}: {code} to 1e-4", 2.0, "ms") for code in codes]
    keep(tmp_path, measured)
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
