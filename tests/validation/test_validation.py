"""The validation scripts: each in its quick form, its kept table judged again, its exit status."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.engine import Child
from hertzchain.errors import RunFailed
from hertzchain.verdict.tradeoff import WAYS
from tests import scenes
from tests.places import ROOT
from validation import run_all
from validation.run_all import LONG, SCRIPTS, run, run_script
from validation.script import Script, new_figure, row, rows_of, table_of
from validation.shipped import paper_table, scene_name

RESULTS = ROOT / "validation" / "results"
EXPENSIVE = {
    *("claims", "constants", "damped_waves", "figure2", "formula_maps"),
    *("known_numbers", "limits", "linear_chain", "precompression", "published"),
    *("table2", "table3", "table4"),
}
"""Scripts whose quick form takes most of a second or more: slow tests, which CI runs every time."""

KEPT_ROWS = {
    "figure1": 48, "figure2": 41, "figure3": 79, "figure4": 31, "figure5": 75, "table2": 24,
    "table3": 92, "table4": 132, "constants": 41, "claims": 90,
    "corrections": 41, "limits": 25, "damped_waves": 14, "damped_pulses": 10, "tradeoff": 11,
    "engines": 75,
}  # fmt: skip
"""How many rows the kept tables have. That of ``formula_maps`` is too large to be kept."""


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
    outcome = run_script(name, SCRIPTS[name], True, True)
    assert outcome.rows
    assert [entry for entry in outcome.rows if not entry.passed] == []
    assert outcome.table is not None
    if outcome.script.draw is not None:
        assert len(outcome.script.draw(outcome.table).axes) > 0


@pytest.mark.parametrize("name", ["claims", "constants", "figure2", "table2", "table3", "table4"])
def test_native_alone_passes_and_is_judged_alike_from_a_file(name: str) -> None:
    """In their quick form, of those whose quick form is slow with LAMMPS."""
    table = SCRIPTS[name].measure(True, False)
    judged = SCRIPTS[name].promises(table)
    assert [entry for entry in judged if not entry.passed] == []
    assert "lammps" not in {entry.backend for entry in judged}
    read = pd.read_csv(io.StringIO(table.to_csv(index=False)))
    assert [entry.what for entry in SCRIPTS[name].promises(read) if entry.passed] == [
        entry.what for entry in judged
    ]


@pytest.mark.slow
@pytest.mark.lammps
@pytest.mark.parametrize("name", SCRIPTS)
def test_every_row_of_every_script_passes(name: str) -> None:
    outcome = run_script(name, SCRIPTS[name], False, True)
    assert [entry for entry in outcome.rows if not entry.passed] == []


@pytest.mark.parametrize("name", KEPT_ROWS)
def test_a_kept_table_keeps_its_promises(name: str) -> None:
    path = RESULTS / f"{name}.csv"
    judged = (SCRIPTS | LONG)[name].promises(pd.read_csv(path, comment="#"))
    # What the whole form judges, with LAMMPS: a table made with less of it has fewer rows.
    assert len(judged) == KEPT_ROWS[name]
    assert [entry for entry in judged if not entry.passed] == []
    head = path.read_text(encoding="utf-8").splitlines()[0]
    assert all(code in head for code in ("hertzchain", "lammps"))


def test_pages_show_each_kept_figure_and_name_each_script() -> None:
    pages = [path.read_text(encoding="utf-8") for path in (ROOT / "docs").rglob("*.md")]
    shown = set(re.findall(r"validation/results/([\w.]+(?:svg|png))", "\n".join(pages)))
    kept = {path.name for path in RESULTS.iterdir() if path.suffix != ".csv"}
    assert kept == shown
    drawn = {f"{name}{it.suffix}" for name, it in (SCRIPTS | LONG).items() if it.draw is not None}
    assert kept == {*drawn, "bench.svg"}
    assert {path.stem for path in RESULTS.glob("*.csv")} == {*KEPT_ROWS, "bench"}


def small_script(passed: bool) -> Script:
    entry = row("a number", "native", 1.0 if passed else 2.0, 1.0, 0.5, "because")
    measure = table_of(lambda *_: [entry])
    return Script("A title", "Is it?", measure, draw=lambda _: new_figure(1.0, 1.0, "A title"))


def impossible(*_: object) -> pd.DataFrame:
    raise RunFailed("it cannot be")


@pytest.mark.parametrize(
    ("small", "missing", "status"),
    [
        (small_script(True), None, 0),
        (small_script(False), None, 1),
        (small_script(True), "no LAMMPS", 2),
        (small_script(False), "no LAMMPS", 1),
        (Script("A title", "Is it?", impossible), None, 1),
    ],
)
def test_the_exit_status(
    small: Script,
    missing: str | None,
    status: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(run_all, "why_no_lammps", lambda: missing)
    monkeypatch.setattr(run_all, "SCRIPTS", {"right": small_script(True), "small": small})
    assert run([]) == status
    out, err = capsys.readouterr()
    assert ("FAIL" in out) == (status == 1)
    assert ("it cannot be" in out) == (small.measure is impossible)
    assert err == ("no LAMMPS; everything else is measured\n" if missing else "")
    assert run(["right", "-o", "/dev/null/folder"]) == 2
    with pytest.raises(SystemExit, match="2"):
        run(["none"])
    assert "unknown script none; there are right, small, engines" in capsys.readouterr().err


def test_a_script_writes_what_it_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_all, "why_no_lammps", lambda: None)
    monkeypatch.setattr(run_all, "SCRIPTS", {"small": small_script(True)})
    assert run(["-o", str(tmp_path)]) == 0
    table = small_script(True).measure(False, True)
    assert rows_of(pd.read_csv(tmp_path / "small.csv", comment="#")) == rows_of(table)
    first = (tmp_path / "small.svg").read_bytes()
    small_script(True).write(tmp_path, "small", table)
    assert (tmp_path / "small.svg").read_bytes() == first


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


def test_every_scene_of_the_tradeoff_has_every_contender_at_every_setting() -> None:
    kept = pd.read_csv(RESULTS / "tradeoff.csv", comment="#")
    assert sorted(kept["scene"].unique()) == scenes.NAMES
    assert set(kept["engine"]) == set(WAYS)
    counts = kept.groupby(["contender", "natural_step", "rtol"], dropna=False).size()
    assert set(counts) == {24}
