"""``progress=True``: a line on stderr in a terminal, none in a pipe."""

from __future__ import annotations

from collections.abc import Callable
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
    "sweep": (
        lambda how: hc.sweep(SHORT, {"duration_ratio": [2.0, 3.0]}, progress=how),
        "sweep: 2 of 2 rows",
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_terminal_shows_a_line_on_stderr(
    name: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # Rich takes stderr for a terminal then
    call, said = CALLS[name]
    call(True)
    out, err = capfd.readouterr()
    # Rich draws ten times a second, so that of quick work only the last line is sure to be seen.
    assert (said if name != "compare" else "native: Eq. 1 as it is written") in err
    assert err.endswith("\x1b[1A\x1b[2K")  # up a line, and erase it
    assert out == ""


def test_brackets_in_the_name_of_a_file_are_shown(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    with shown_progress() as report_progress:
        report_progress("writing runs[/new].png")
    assert "writing runs[/new].png" in capfd.readouterr().err


@pytest.mark.parametrize("name", CALLS)
def test_a_pipe_shows_nothing(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    CALLS[name][0](True)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["compare", "judge"])
def test_a_function_is_called_with_lines(name: str) -> None:
    lines: list[str] = []
    call, said = CALLS[name]
    call(lines.append)
    assert said in lines
