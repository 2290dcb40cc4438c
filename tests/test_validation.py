"""The validation scripts: each in its quick form, and that they can fail."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

import hertzchain as hc
from tests import scenes
from validation import rows, run_all, table2, table3, table4
from validation.rows import paper_table, scene_name

SCRIPTS = (table2, table3, table4)


@pytest.mark.lammps
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.__name__)
def test_the_quick_form_passes(script: ModuleType) -> None:
    measured = script.compare(quick=True)
    assert {entry.backend for entry in measured} == {"native", "lammps"}
    assert [entry for entry in measured if not entry.passed] == []


@pytest.mark.slow
@pytest.mark.lammps
def test_every_row_of_every_script_passes() -> None:
    assert all(entry.passed for entry in run_all.compare(quick=False))
    # 92 entries, 18 rows of the tables and a mean for each table and backend.
    assert sum(len(paper_table(number)) for number in (3, 4)) == 92


@pytest.mark.lammps
@pytest.mark.parametrize("script", [table2, table3], ids=lambda script: script.__name__)
def test_a_wrong_simulation_fails(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    def doctored(names: list[str], _: str) -> dict[tuple[str, str], hc.Result]:
        # The last contact of each transition 2 % high: p moves, and F_SW with it.
        results = {}
        for name in names:
            result = hc.Native("reference").run(scenes.load(name))
            peaks = result.peak_force.copy()
            peaks[4] *= 1.02
            for backend in ("native", "lammps"):
                results[name, backend] = replace(result, peak_force=peaks, backend=backend)
        return results

    home = script if hasattr(script, "simulate") else sys.modules["validation.peak_forces"]
    monkeypatch.setattr(home, "simulate", doctored)
    assert any(not entry.passed for entry in script.compare(quick=True))


@pytest.mark.parametrize(("passed", "status"), [(True, 0), (False, 1)])
def test_a_script_exits_1_when_a_row_is_off(
    passed: bool, status: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    entry = rows.row("a number", "native", 1.0 if passed else 2.0, 1.0, 0.5, "because")
    monkeypatch.setattr(sys, "argv", ["script.py"])
    with pytest.raises(SystemExit) as stop:
        rows.run_script("A title", lambda _: [entry])
    assert stop.value.code == status
    assert ("FAIL" in capsys.readouterr().out) is not passed


@pytest.mark.lammps
def test_a_script_runs_as_a_user_would_run_it(tmp_path: Path) -> None:
    script = Path(rows.__file__).parent / "table2.py"
    arguments = [sys.executable, str(script), "--quick", "-o", str(tmp_path / "rows.csv")]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "12 of 12 rows pass" in done.stdout
    assert (tmp_path / "rows.csv").read_text(encoding="utf-8").count("\n") == 13


def test_each_row_of_the_tables_has_its_scene() -> None:
    entries = [entry for number in (2, 3, 4) for entry in paper_table(number)]
    assert sorted({scene_name(entry) for entry in entries}) == scenes.NAMES
    assert len(scenes.NAMES) == 24
    for entry in entries:
        scene = scenes.load(scene_name(entry))
        assert isinstance(scene.shock, hc.Pulse)
        assert scene.shock.profile == entry["profile"]
        assert scene.shock.momentum_ratio == float(entry["momentum_ratio"])
        assert scene.shock.duration_ratio == float(entry["duration_ratio"])
        assert scene.shock.peak_force == 100.0


def test_the_demo_scene_is_a_row_of_table_2() -> None:
    assert scenes.load("demo") == scenes.load("cosine-triangular_LM2.0_n2")
