"""Compiling is told from running: its seconds stand by themselves."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, copy_context
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numba.core.caching import NullCache

import hertzchain as hc
from hertzchain.cli import main
from hertzchain.engines.native import elastic, simulation
from hertzchain.engines.native.compiling import compiled_and_kept
from hertzchain.engines.native.preparation import Watched, begins, ends
from hertzchain.engines.native.simulation import Prepared
from tests.command_line import PATIENCE
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


def test_what_is_compiled_already_takes_no_time() -> None:
    square, told = a_new_function(), []
    square(2.0)
    with Watched(lambda: told.append("compiling")) as preparation:
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


SKIPPING = """
import sys, time
clock, skipped = time.perf_counter, 0.0
time.perf_counter = lambda: clock() + skipped

from hertzchain.engines.native import Native, elastic, keeping
load = keeping.Kept._found

def long_load(*given):
    global skipped
    skipped += float(sys.argv[2])
    return load(*given)

keeping.Kept._found = long_load
result = Native().run(sys.argv[1])
print(skipped, result.wall_time)
"""
"""A run in a process whose clock skips time whenever a kernel is loaded."""


def test_the_time_of_a_run_is_without_loading() -> None:
    """The skip is longer than any test lasts: a run is shorter, on however busy a machine."""
    skip = 10 * PATIENCE
    done = subprocess.run(
        [sys.executable, "-c", SKIPPING, str(DEMO), str(skip)],
        capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    skipped, wall_time = map(float, done.stdout.split())
    assert skipped >= skip
    assert 0 < wall_time < skip


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


@pytest.mark.usefixtures("native_that_compiles")
def test_the_command_line_says_where_no_folder_can_keep_what_it_compiles(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(elastic.march, "_cache", NullCache())
    monkeypatch.setattr(sys, "argv", ["hertzchain", "run", str(DEMO)])
    with pytest.raises(SystemExit):
        main()
    why = "in every process because no folder can keep them (see hertzchain doctor)"
    what = re.escape(f"compiling kernels, as {why}")
    assert re.fullmatch(rf"hertzchain: {what}: \S+ s\n", capsys.readouterr().err)


def test_a_run_with_kernels_that_are_there_says_nothing_of_compiling(
    demo: hc.Scene, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    hc.Native(peaks_only=True).run(demo)
    monkeypatch.setattr(sys, "argv", ["hertzchain", "run", str(DEMO)])
    with pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().err == ""


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


def test_threads_of_the_run_count_once() -> None:
    begin = time.perf_counter()
    with Watched() as preparation, ThreadPoolExecutor(4) as pool:
        contexts = [copy_context() for _ in range(8)]
        list(pool.map(Context.run, contexts, [prepare] * 8, [0.01] * 8))
    elapsed = time.perf_counter() - begin
    assert 0.02 <= preparation.time <= elapsed  # 8 in 4 threads


def test_runs_in_many_threads_have_times_of_their_own(demo: hc.Scene) -> None:
    ends: list[hc.Result] = []

    def run(_: int) -> None:
        prepare(0.002)
        ends.append(hc.Native(peaks_only=True).run(demo))

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(run, range(30)))
    assert len(ends) == 30
    assert all(result.wall_time > 0 for result in ends)


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


def test_an_end_without_a_beginning_does_not_count() -> None:
    begins()
    preparation = Watched().__enter__()
    ends()
    assert preparation.time == 0
    prepare(0.01)
    preparation.__exit__()
    assert preparation.time >= 0.01


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


def test_an_event_that_goes_on_counts_so_far() -> None:
    seen = []
    with Watched(lambda: seen.append((preparation.compile_time, preparation.time))) as preparation:
        a_new_function()(2.0)
    (compiled, prepared) = seen[0]
    assert 0 < compiled < preparation.compile_time
    assert 0 < prepared < preparation.time
