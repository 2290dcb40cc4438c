"""The validation scripts: each in its quick form, and that they can fail."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pandas as pd
import pytest

import hertzchain as hc
import validation.script
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import RunFailed
from hertzchain.verdict.tradeoff import WAYS
from tests import scenes
from validation import run_all, tradeoff
from validation.script import Script, row, rows_of, rows_only
from validation.shipped import paper_table, scene_name

SCRIPTS = {module.__name__.rpartition(".")[2]: module for module in run_all.MODULES}
EXPENSIVE = {
    *("claims", "constants", "damped_waves", "eqs_4b_and_5", "figure2", "formula_maps"),
    *("known_numbers", "limits", "linear_chain", "mistakes", "precompression", "published"),
    *("table2", "table3", "table4"),
}
"""Scripts whose quick form takes most of a second or more: slow tests, which CI runs every time."""

TOO_LARGE = {"formula_maps"}
"""5 MB: its table is not kept, its figure is."""

KEPT_ROWS = {
    "figure1": 48, "figure2": 41, "figure3": 79, "figure4": 31, "figure5": 75, "table2": 24,
    "table3": 92, "table4": 132, "constants": 41, "claims": 72, "eqs_4b_and_5": 30,
    "corrections": 41, "limits": 25, "mistakes": 51, "known_numbers": 93, "published": 50,
    "precompression": 26, "linear_chain": 11, "restitution": 37, "damped_waves": 14,
    "damped_pulses": 10,
}  # fmt: skip
"""How many rows the kept tables have."""

PAGE = Path(run_all.__file__).parents[1] / "docs" / "validation.md"


# Every script


def in_this_process(
    _: Child, function: Callable[..., object], *given: object, **__: object
) -> object:
    """What ``Child.call`` would; another process changes no number, see ``test_faults.py``."""
    return function(*given)


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in EXPENSIVE else ()) for name in SCRIPTS],
)
def test_the_quick_form_of_a_script_passes(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Child, "call", in_this_process)
    outcome = run_all.run_script(SCRIPTS[name], True, True)
    assert outcome.name == name
    assert outcome.rows
    assert [entry for entry in outcome.rows if not entry.passed] == []
    assert outcome.table is not None
    assert len(outcome.script.draw(outcome.table).axes) > 0


@pytest.mark.parametrize(
    "name", ["claims", "eqs_4b_and_5", "constants", "figure2", "table2", "table3", "table4"]
)
def test_native_alone_passes_and_is_judged_alike_from_a_file(name: str) -> None:
    """In their quick form, of those whose quick form is slow with LAMMPS."""
    script = SCRIPTS[name].SCRIPT
    table = script.measure(True, False)
    judged = script.promises(table)
    assert [entry for entry in judged if not entry.passed] == []
    assert "lammps" not in {entry.backend for entry in judged}
    read = pd.read_csv(io.StringIO(table.to_csv(index=False)))
    assert [entry.what for entry in script.promises(read) if entry.passed] == [
        entry.what for entry in judged
    ]
    assert len(script.draw(read).axes) > 0


@pytest.mark.slow
@pytest.mark.lammps
def test_every_row_of_every_script_passes() -> None:
    for outcome in run_all.run_scripts(False, True):
        assert [entry for entry in outcome.rows if not entry.passed] == []


def test_every_script_is_run() -> None:
    folder = Path(run_all.__file__).parent
    scripts = {
        path.stem for path in folder.rglob("*.py") if "\nSCRIPT = " in path.read_text("utf-8")
    }
    minutes = {"engines", "error_bounds", "extremes", "long_run", "tradeoff"}
    assert scripts == set(SCRIPTS) | minutes


RESULTS = Path(run_all.__file__).parent / "results"


@pytest.mark.parametrize("name", SCRIPTS)
def test_what_is_kept_of_a_script_keeps_its_promises(name: str) -> None:
    assert f"](../validation/results/{name}.svg)" in PAGE.read_text(encoding="utf-8")
    assert (RESULTS / f"{name}.svg").read_text(encoding="utf-8").rstrip().endswith("</svg>")
    kept_table = RESULTS / f"{name}.csv"
    assert kept_table.exists() == (name not in TOO_LARGE)
    if name not in TOO_LARGE:
        judged = SCRIPTS[name].SCRIPT.promises(pd.read_csv(kept_table, comment="#"))
        # What the whole form judges, with LAMMPS: a table made with less of it has fewer rows.
        assert len(judged) == KEPT_ROWS[name]
        assert [entry for entry in judged if not entry.passed] == []


def small_script(passed: bool) -> Script:
    entry = row("a number", "native", 1.0 if passed else 2.0, 1.0, 0.5, "because")
    return Script("A title", "Is it?", "nobody", **rows_only(lambda *_: [entry]))


@pytest.mark.parametrize(("passed", "status"), [(True, 0), (False, 1)])
def test_a_script_exits_1_when_a_row_is_off(
    passed: bool, status: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(validation.script, "why_no_lammps", lambda: "no LAMMPS")
    assert small_script(passed).run(["-o", "/dev/null/x.csv"]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert small_script(passed).run([]) == (2 if passed else 1)
    assert capsys.readouterr().err == "no LAMMPS; everything else is measured\n"
    monkeypatch.setattr(validation.script, "why_no_lammps", lambda: None)
    assert small_script(passed).run([]) == status
    assert ("FAIL" in capsys.readouterr().out) is not passed
    assert small_script(passed).run(["--json"]) == status
    (entry,) = json.loads(capsys.readouterr().out)["rows"]
    assert entry["passed"] is passed


def test_a_script_writes_what_it_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(validation.script, "why_no_lammps", lambda: None)
    csv, figure = tmp_path / "script.csv", tmp_path / "script.svg"
    assert small_script(True).run(["-o", str(csv), "--plot", str(figure)]) == 0
    first = figure.read_bytes()
    script = small_script(True)
    assert rows_of(pd.read_csv(csv, comment="#")) == script.promises(script.measure(False, True))
    assert small_script(True).run(["--plot", str(figure)]) == 0
    assert figure.read_bytes() == first
    assert small_script(True).run(["--plot", str(tmp_path / "script.txt")]) == 2


@pytest.mark.parametrize(("passed", "status"), [(True, 0), (False, 1)])
def test_one_row_that_is_off_fails_them_all(
    passed: bool, status: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def impossible(*_: object) -> pd.DataFrame:
        raise RunFailed("it cannot be")

    broken = replace(small_script(True), measure=impossible)
    modules = [ModuleType("validation.small"), ModuleType("validation.broken")]
    for module, script in zip(modules, (small_script(passed), broken), strict=True):
        vars(module)["SCRIPT"] = script
    monkeypatch.setattr(run_all, "why_no_lammps", lambda: None)
    monkeypatch.setattr(run_all, "MODULES", modules[:1])
    assert run_all.run([]) == status
    assert run_all.run(["--json"]) == status
    capsys.readouterr()
    monkeypatch.setattr(run_all, "MODULES", modules)
    assert run_all.run(["--json"]) == 1
    scripts = json.loads(capsys.readouterr().out)["scripts"]
    assert scripts[0]["rows"][0]["passed"] is passed
    assert scripts[1]["rows"][0]["what"] == "broken: it cannot be"
    assert scripts[1]["rows"][0]["measured"] is None


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


# Error against cost

KEPT = Path(tradeoff.__file__).parent / "results" / "tradeoff.csv"


def test_what_is_kept_is_whole_and_keeps_its_promises() -> None:
    kept = pd.read_csv(KEPT, comment="#")
    assert sorted(kept["scene"].unique()) == scenes.NAMES
    assert set(kept["engine"]) == set(WAYS)
    # Every scene has every contender at every setting.
    counts = kept.groupby(["contender", "natural_step", "rtol"], dropna=False).size()
    assert set(counts) == {24}
    assert [entry for entry in tradeoff.promises(kept) if not entry.passed] == []
    head = KEPT.read_text(encoding="utf-8").splitlines()[0]
    assert all(name in head for name in ("hertzchain", "numpy", "numba", "scipy", "lammps"))
    assert KEPT.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.lammps
def test_the_tradeoff_in_its_quick_form(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    small = replace(scenes.load("demo"), chain=replace(scenes.load("demo").chain, granules=12))
    monkeypatch.setattr(hc.Scene, "from_toml", lambda _: small)
    csv, png = tmp_path / "tradeoff.csv", tmp_path / "tradeoff.png"
    assert tradeoff.SCRIPT.run(["--quick", "-o", str(csv), "--plot", str(png)]) == 0
    assert png.read_bytes().startswith(b"\x89PNG")
    table = pd.read_csv(csv, comment="#")
    assert table["scene"].unique().tolist() == scenes.NAMES[:1]
    assert set(table["engine"]) == set(WAYS)
    assert "11 of 11 rows pass" in capsys.readouterr().out
