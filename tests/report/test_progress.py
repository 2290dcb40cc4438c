"""``progress=True``: a line on stderr in a terminal, below a notebook's cell, none in a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest

import hertzchain as hc
from hertzchain.report.progress import shown_progress
from tests.conftest import paper_scene

SHORT = paper_scene("cosine", 1.0, 2.0, granules=8)

CALLS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "compare": (
        lambda how: hc.compare(SHORT, ["native"], progress=how),
        "native: the reference method",
    ),
    "judge": (
        lambda how: hc.judge(SHORT, {2: 100.0}, progress=how),
        "native: the reference method",
    ),
    "judge a table": (
        lambda how: hc.judge(SHORT, hc.Native().run(SHORT).to_frame(), progress=how),
        "reading results",
    ),
    "sweep": (
        lambda how: hc.sweep(
            SHORT, {"duration_ratio": [2.0, 3.0]}, backends="formulas", progress=how
        ),
        "sweep: 2 of 2 rows",
    ),
}


class Notebook:
    """Stands for IPython: keeps what is shown in the line below a cell."""

    def __init__(self) -> None:
        self.shown: list[str] = []

    def display(self, data: dict[str, str], *, raw: bool, display_id: bool) -> Notebook:
        """Begin a line."""
        assert raw
        assert display_id
        self.update(data, raw=raw)
        return self

    def update(self, data: dict[str, str], *, raw: bool) -> None:
        """Show another text in it."""
        assert raw
        self.shown.append(data["text/plain"])


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> Notebook:
    found = Notebook()
    module = ModuleType("IPython.display")
    module.display = found.display  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    return found


@pytest.mark.parametrize("name", CALLS)
def test_a_notebook_shows_one_line_which_is_empty_in_the_end(name: str, notebook: Notebook) -> None:
    call, said = CALLS[name]
    call(True)
    assert any(text.startswith(f"{said} (") and text.endswith(" s)") for text in notebook.shown)
    assert notebook.shown[0] == notebook.shown[-1] == ""


def test_the_line_is_empty_after_an_error_too(notebook: Notebook) -> None:
    with pytest.raises(hc.HertzchainError):
        hc.judge(SHORT, {2: 100.0}, time_limit=1e-9, progress=True)
    assert len(notebook.shown) == 4
    assert notebook.shown[-1] == ""


@pytest.mark.parametrize("name", CALLS)
def test_a_terminal_shows_a_line_on_stderr(
    name: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # Rich takes stderr for a terminal then
    call, said = CALLS[name]
    call(True)
    out, err = capfd.readouterr()
    # Rich draws ten times a second, so that of quick work only the last line is sure to be seen.
    last = {
        "judge a table": "native: the reference method",
        "compare": "native: Eq. 1 as it is written",
    }
    assert last.get(name, said) in err
    assert err.endswith("\x1b[1A\x1b[2K")  # up a line, and erase it
    assert out == ""


def test_brackets_in_the_name_of_a_file_are_shown(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    with shown_progress() as report_progress:
        report_progress("writing runs[/new].png")
    assert "writing runs[/new].png" in capfd.readouterr().err


@pytest.mark.parametrize("how", [True, False, None])
@pytest.mark.parametrize("name", CALLS)
def test_a_pipe_shows_nothing(
    name: str, how: bool | None, capfd: pytest.CaptureFixture[str]
) -> None:
    CALLS[name][0](how)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["compare", "judge", "judge a table"])
def test_a_function_is_called_with_lines(name: str) -> None:
    lines: list[str] = []
    call, said = CALLS[name]
    call(lines.append)
    assert said in lines
