"""``progress=True``: a line on stderr in a terminal, none in a pipe."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import hertzchain as hc
from hertzchain.report import progress
from hertzchain.report.progress import shown_progress
from tests.command_line import Command
from tests.conftest import paper_scene
from tests.recordings import write_scope

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


COMMANDS: dict[str, list[str]] = {
    "run scene.toml --plot a.svg": ["native: running", "writing a.svg"],
    "timestep scene.toml": ["trying steps"],
    "deck scene.toml -o in.chain": [
        "native: the step, and what the deck has to find",
        "writing in.chain",
    ],
    "unit-test scene.toml": ["native: looking for the wave"],
    "pulse scope.csv --scale 25": ["looking for few rows that keep the pulse"],
    "sweep scene.toml --vary duration_ratio=2,3 -o a": ["0 of 2 rows", "2 of 2 rows"],
    "plot a --x duration_ratio --y peak_force": ["drawing a", "writing a/plot.png"],
}


def test_commands_say_what_they_do(
    hertzchain: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines: list[str] = []

    @contextmanager
    def kept() -> Iterator[Callable[[str], None]]:
        yield lines.append

    monkeypatch.setattr(progress, "shown_progress", kept)
    monkeypatch.chdir(tmp_path)
    write_scope(tmp_path / "scope.csv", 1000)
    SHORT.to_toml(tmp_path / "scene.toml")
    for command, said in COMMANDS.items():
        lines.clear()
        done = hertzchain(*command.split())
        assert done.status == 0, done.err
        assert [line for line in lines if not line.startswith("compiling")] == said, command
