"""Compiling is told from running: its seconds stand by themselves."""

from __future__ import annotations

import re
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.cli import main
from hertzchain.engines.native import elastic, simulation
from hertzchain.engines.native.compiling import compiled_and_kept
from hertzchain.engines.native.preparation import Watched, begins, ends
from hertzchain.engines.native.simulation import Prepared
from tests.places import ROOT

DEMO = ROOT / "validation" / "scenes" / "demo.toml"


def a_new_function() -> Callable[[float], float]:
    """A kernel that Numba has to compile at its first call, and keeps nowhere."""

    @compiled_and_kept()
    def square(x: float) -> float:
        return x * x

    square._cache.flush()
    return square  # type: ignore[no-any-return]


@pytest.fixture
def native_that_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of native's integrations begins with a function to compile."""
    once = Prepared.simulate

    def slowly(*given: Any, **named: Any) -> Any:
        a_new_function()(2.0)
        return once(*given, **named)

    monkeypatch.setattr(Prepared, "simulate", slowly)


def test_what_is_compiled_is_timed_and_told() -> None:
    square, told = a_new_function(), []
    begin = time.perf_counter()
    with Watched(lambda: told.append("compiling")) as preparation:
        assert preparation.compile_time == 0
        assert square(3.0) == 9.0
    elapsed = time.perf_counter() - begin
    assert told == ["compiling"]
    assert 0 < preparation.compile_time <= preparation.time <= elapsed
    with Watched(lambda: told.append("compiling")) as again:
        square(3.0)
    assert (again.compile_time, again.time, told) == (0, 0, ["compiling"])


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


def prepare(seconds: float) -> None:
    """Take a time as loading a kernel does."""
    begins()
    time.sleep(seconds)
    ends()


def test_threads_of_other_runs_do_not_count() -> None:
    with Watched() as preparation:
        other = threading.Thread(target=prepare, args=(0.05,))
        other.start()
        other.join()
        assert preparation.time == 0
        prepare(0.01)
    assert preparation.time >= 0.01


def test_a_long_run_counts_what_its_own_thread_prepares(
    demo: hc.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A long run is done by another thread; here every run counts as long."""
    march = elastic.march

    def slowly(*given: Any) -> Any:
        prepare(0.05)
        return march(*given)

    monkeypatch.setattr(elastic, "march", slowly)
    monkeypatch.setattr(simulation, "_LONG_RUN", 0.0)
    begin = time.perf_counter()
    result = hc.Native(peaks_only=True).run(demo)
    # Two runs at least, one of them for the error.
    assert result.wall_time <= time.perf_counter() - begin - 0.1


def test_compiling_does_not_count_against_the_time_limit(
    demo: hc.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = hc.Scene(replace(demo.chain, granules=2), demo.shock)
    strict = hc.Native(time_limit=2e-5)  # shorter than any run with its error
    with pytest.raises(hc.HertzchainError, match="stopped at the time limit"):
        strict.run(pair)
    monkeypatch.setattr(Watched, "time", property(lambda _: 3600.0))
    assert strict.run(pair).error_estimate <= 1e-6
    ratios = np.linspace(1.0, 2.0, 5)
    assert hc.similar_peak_forces("cosine", ratios, 2.0, 20, 1e-4, 1e-9).peak_force.all()
