"""The default end of scenes in which waves are reflected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native import duration, preparation
from hertzchain.engines.native.duration import with_end
from tests.conftest import STEEL, paper_scene
from tests.oracles.first_pulses import Trace

WALLED = hc.Scene(hc.Chain(6, **STEEL), hc.Striker(1.0), wall=hc.Wall("rigid"))
SCENES = {
    "walled": WALLED,
    "taper": replace(WALLED, chain=hc.Chain(6, **{**STEEL, "radius": 5e-3 * 0.9 ** np.arange(6)})),
    "damped": replace(WALLED, contact=hc.Contact("restitution", restitution=0.8)),
    "pressed": replace(WALLED, precompression=hc.Precompression(force=2.0)),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_end_is_after_the_last_first_pulse(name: str) -> None:
    """An independent solver, up to the latest end, tells when the last first pulse is over."""
    scene = SCENES[name]
    longest = replace(scene, run=hc.Run(scene.end_time))
    seen = Trace(longest).first_pulses(scene.granules.static_force)
    over = max(one.end for one in seen if one is not None and one.end is not None)
    end = with_end(scene).end_time
    # Two digits, rounded up: at most a tenth later.
    wanted = min(2 * over + 3 * scene.units.time, scene.end_time)
    assert 0.999 * wanted <= end <= 1.1 * wanted
    assert end <= scene.end_time
    assert hc.Native(rtol=1e-3).run(scene).scene.end_time == end


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
    ends = {one.run(WALLED).scene.end_time for one in (hc.Native(), hc.Lammps(rtol=1e-4))}
    assert ends == {with_end(WALLED).end_time}


@pytest.mark.parametrize("contact", [None, hc.Contact("restitution", restitution=0.8)])
def test_the_end_does_not_depend_on_how_fast_the_machine_is(
    contact: hc.Contact | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Preparing kernels for an hour changes nothing; too much work does, and there is no time."""
    scene = replace(WALLED, contact=contact)
    end = with_end(scene).end_time
    with monkeypatch.context() as patch:
        patch.setattr(preparation.Watched, "time", property(lambda _: 3600.0))
        clock = iter(np.arange(0.0, 1e9, 3000.0))
        patch.setattr("hertzchain.limits.time.monotonic", lambda: next(clock))
        assert with_end(scene, time_limit=1e8).end_time == end
    monkeypatch.setattr(duration, "_MOST_WORK", 1.0)
    assert with_end(scene).end_time == scene.end_time > end


def test_similar_scenes_have_similar_ends() -> None:
    """With a tenfold velocity all times are as velocity to the power -1/5."""
    fast = replace(WALLED, shock=hc.Striker(10.0))
    ratio = with_end(fast).end_time / with_end(WALLED).end_time
    assert ratio == pytest.approx(10**-0.2, rel=1e-12)
