"""The default end of scenes in which waves are reflected; compiling is told from running."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.cli import main
from hertzchain.engines.native import backend
from hertzchain.engines.native.backend import with_end
from hertzchain.engines.native.simulation import Prepared
from hertzchain.observables.compiling import Watched, compiled_and_kept
from tests.conftest import STEEL, paper_scene
from tests.oracles.first_pulses import Trace
from tests.places import ROOT

WALLED = hc.Scene(hc.Chain(5, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid"))
SCENES = {
    "walled": WALLED,
    "taper": replace(WALLED, chain=hc.Chain(5, **{**STEEL, "radius": 5e-3 * 0.9 ** np.arange(5)})),
    "damped": replace(WALLED, contact=hc.Contact("restitution", restitution=0.8)),
    "pressed": replace(WALLED, precompression=hc.Precompression(force=2.0)),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_end_is_after_the_last_first_pulse(name: str) -> None:
    """An independent solver, up to the latest end, tells when the last first pulse is over."""
    scene = SCENES[name]
    longest = replace(scene, run=hc.Run(scene.end_time))
    seen = Trace(longest).first_pulses(scene.granules.static_force)
    over = max(pulse.end for pulse in seen if pulse is not None and pulse.end is not None)
    end = with_end(scene).end_time
    # Two digits, rounded up: at most a tenth later.
    wanted = min(2 * over + 3 * scene.units.time, scene.end_time)
    assert 0.999 * wanted <= end <= 1.1 * wanted
    assert end <= scene.end_time
    assert hc.Native(rtol=1e-3).run(scene).scene.end_time == end


@pytest.mark.parametrize("small", [0.3e-3, 0.62e-3, 1.33e-3])
def test_a_slow_wave_past_light_beads_is_waited_for(small: float) -> None:
    """It takes up to five times as long as the usual end; no step decides when the run ends."""
    radius = np.where(np.arange(15) % 2 == 0, 5e-3, small)
    scene = replace(WALLED, chain=hc.Chain(15, **{**STEEL, "radius": radius}), wall=None)
    runs = [hc.Native(rtol=rtol).run(scene) for rtol in (1e-3, 1e-5, 1e-7)]
    assert len({run.scene.end_time for run in runs} | {with_end(scene).end_time}) == 1
    assert runs[0].cut_off == ()


def test_a_load_that_settles_slowly_does_not_keep_a_run_going() -> None:
    """Strong viscoelastic damping: forces creep to those of the load long after the pulse."""
    scene = replace(
        WALLED, contact=hc.Contact("dashpot", coefficient=3000.0),
        precompression=hc.Precompression(force=0.1),
    )  # fmt: skip
    assert with_end(scene).end_time <= 2 * scene.end_time


def test_an_end_that_is_given_stays_and_so_do_plain_scenes() -> None:
    given = replace(WALLED, run=hc.Run(1e-4))
    plain = paper_scene("cosine", 1.0, 2.0, 8)
    pressed = replace(plain, precompression=hc.Precompression(force=2.0))
    for scene in (given, plain, pressed):
        assert with_end(scene) is scene


def test_a_drive_that_goes_on_is_watched_as_long_as_ever() -> None:
    """Behind a piston that moves on no force ever falls to a half."""
    scene = hc.Scene(hc.Chain(6, **STEEL), hc.Piston(0.1), wall=hc.Wall("rigid"))
    assert with_end(scene).end_time == scene.end_time


def test_times_to_record_are_within_the_run() -> None:
    end = with_end(WALLED).end_time
    later = (end + WALLED.end_time) / 2
    result = hc.Native(rtol=1e-3).run(WALLED, record=[1e-5, later])
    assert result.scene.end_time == later
    assert with_end(WALLED, 20).end_time == end


def test_every_engine_ends_as_native_does() -> None:
    ends = {engine.run(WALLED).scene.end_time for engine in (hc.Native(), hc.Lammps(rtol=1e-4))}
    assert ends == {with_end(WALLED).end_time}


@pytest.mark.parametrize("contact", [None, hc.Contact("restitution", restitution=0.8)])
def test_the_end_does_not_depend_on_how_fast_the_machine_is(
    contact: hc.Contact | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Preparing kernels for an hour changes nothing; too much work does, and there is no time."""
    scene = replace(WALLED, contact=contact)
    end = with_end(scene).end_time
    with monkeypatch.context() as patch:
        patch.setattr(Watched, "time", property(lambda _: 3600.0))
        clock = iter(np.arange(0.0, 1e9, 3000.0))
        patch.setattr("hertzchain.limits.time.monotonic", lambda: next(clock))
        assert with_end(scene, time_limit=1e8).end_time == end
    monkeypatch.setattr(backend, "_MOST_END_WORK", 1.0)
    assert with_end(scene).end_time == scene.end_time > end


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
def test_the_command_line_says_that_it_compiles(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["hertzchain", "run", str(DEMO)])
    with pytest.raises(SystemExit):
        main()
    out, err = capsys.readouterr()
    assert re.fullmatch(r"hertzchain: compiling kernels for this kind of scene \(once .+\)\n", err)
    assert "compil" not in out


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
