"""Compiling is told from running: its seconds stand by themselves."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable
from typing import Any

import pytest
from numba import njit

import hertzchain as hc
from hertzchain.cli import main
from hertzchain.engines.native import simulate
from hertzchain.engines.native.preparation import watched
from tests.places import ROOT

DEMO = ROOT / "validation" / "scenes" / "demo.toml"


def a_new_function() -> Callable[[float], float]:
    """A function that Numba has to compile at its first call, and keeps nowhere."""

    @njit()
    def square(x: float) -> float:
        return x * x

    return square


@pytest.fixture
def native_that_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of native's integrations begins with a function to compile."""

    def slowly(*given: Any, **named: Any) -> Any:
        a_new_function()(2.0)
        return simulate(*given, **named)

    monkeypatch.setattr("hertzchain.engines.native.backend.simulate", slowly)


def test_what_is_compiled_is_timed_and_told() -> None:
    square, told = a_new_function(), []
    begin = time.perf_counter()
    with watched(lambda: told.append("compiling")) as preparation:
        assert preparation.compile_time == 0
        assert square(3.0) == 9.0
    elapsed = time.perf_counter() - begin
    assert told == ["compiling"]
    assert 0 < preparation.compile_time <= preparation.time <= elapsed


def test_what_is_compiled_already_takes_no_time() -> None:
    square, told = a_new_function(), []
    square(2.0)
    with watched(lambda: told.append("compiling")) as preparation:
        square(3.0)
    assert (preparation.compile_time, preparation.time, told) == (0, 0, [])


@pytest.mark.usefixtures("native_that_compiles")
def test_the_time_of_a_run_is_without_compiling(demo: hc.Scene) -> None:
    begin = time.perf_counter()
    result = hc.Native().run(demo)
    elapsed = time.perf_counter() - begin
    assert result.compile_time > 0
    assert result.wall_time > 0
    # Were compiling within the time of the run, the sum would be more than there was.
    assert result.wall_time + result.compile_time <= elapsed


@pytest.mark.usefixtures("native_that_compiles")
def test_the_command_line_says_how_long_it_compiled(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["hertzchain", "run", str(DEMO)])
    with pytest.raises(SystemExit):
        main()
    out, err = capsys.readouterr()
    what = "compiling kernels for this kind of scene, once"
    assert re.fullmatch(rf"hertzchain: {what}: \S+ s\n", err)
    assert "compil" not in out


def test_a_run_with_kernels_that_are_there_says_nothing_of_compiling(
    demo: hc.Scene, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    hc.Native(peaks_only=True).run(demo)
    monkeypatch.setattr(sys, "argv", ["hertzchain", "run", str(DEMO)])
    with pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().err == ""
