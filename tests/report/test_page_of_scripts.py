"""The page of all validation scripts."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas

import validation.page
from tests.report.test_page import Reader, lines_of
from validation.rows import row
from validation.run_all import Outcome, to_dict
from validation.script import Script, rows_only


def outcomes() -> list[Outcome]:
    """One whose rows pass but for one, and one that raised."""
    entries = [
        row(f"number {k}", "native", 1.0 + 1e-4 * k, 1.0, 1e-2, "because") for k in range(20)
    ]
    entries += [row("<b>one</b> & all", "lammps", 2.0, 1.0, 0.1, "reason <i>")]
    script = Script("Title", "Is it?", "native", **rows_only(lambda *_: entries))
    table = script.measure(True, True)
    well = Outcome("well", script, table, tuple(script.promises(table)), 0.5)
    nan = float("nan")
    raised = replace(entries[0], what="gone", measured=nan, expected=nan, passed=False)
    return [well, Outcome("gone", script, None, (raised,), 0.1)]


def test_a_report_of_all_scripts(tmp_path: Path) -> None:
    found = outcomes()
    folder = tmp_path / "there" / "report"
    validation.page.make_folder(folder)
    sections = [validation.page.write_outcome(folder, outcome) for outcome in found]
    validation.page.write_report(folder, sections, to_dict(found))
    assert {path.name for path in folder.iterdir()} == {"index.html", "well.csv", "well.svg"}
    table = pandas.read_csv(folder / "well.csv", comment="#")
    assert len(table) == len(found[0].rows)
    page = (folder / "index.html").read_text("utf-8")
    read = Reader(page)
    assert read.data["numbers"] == json.loads(json.dumps(to_dict(found)))
    assert "✗ FAIL" in read.text
    drawn = lines_of(validation.page._overview(found).axes[0])
    points = [len(np.asarray(drawn[name].get_xdata())) for name in ("passes", "fails")]
    assert points == [20, 2]
    assert "20 rows that pass" in read.text
    images = [source for source in read.loaded if source.startswith("data:image/svg+xml;base64,")]
    assert len(images) == 1
    assert not any(source.startswith("http") for source in read.loaded)
    assert "<b>one</b>" not in page
    assert "<b>one</b> & all (lammps)" in read.text
    assert "20 of 22 rows pass" in read.text
    assert "it could not be measured" in read.text
    assert page.index("Rows that fail") < page.index("rows that pass</summary>")
