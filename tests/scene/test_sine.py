"""Sines in scene files and in Python: allowed and refused values, and their force."""

from __future__ import annotations

import numpy as np
import pytest

import hertzchain as hc
from tests.conftest import STEEL


def test_the_force_is_a_sine() -> None:
    shock = hc.Sine(5.0, 8000.0, 3)
    scene = hc.Scene(hc.Chain(5, **STEEL), shock, precompression=hc.Precompression(5.0))
    time = np.linspace(-1e-4, 5e-4, 1201)
    within = (time >= 0) & (time < 3 / 8000)
    expected = np.where(within, 5 * np.sin(2 * np.pi * 8000 * time), 0.0)
    # The force changes by 1e-14 N while the time changes by its last digit.
    assert scene.applied_force(time) == pytest.approx(expected, rel=0, abs=3e-14)
    # Whole cycles leave nothing; half of one is what LM_ratio is measured by.
    assert scene.impulse == pytest.approx(0.0, abs=1e-15 * shock.compared_impulse)
    half = hc.Scene(scene.chain, shock, hc.Run(0.5 / 8000), precompression=scene.precompression)
    assert half.applied_impulse == pytest.approx(shock.compared_impulse, rel=1e-14)
    assert half.momentum_ratio > 0
    assert [ramp.start for ramp in scene.ramps] == [k / 32000 for k in range(12)]


def test_waves_of_short_cycles_are_as_fast_as_those_of_long_ones() -> None:
    chain, load = hc.Chain(20, **STEEL), hc.Precompression(10.0)

    def watched(frequency: float, wall: hc.Wall | None) -> float:
        """Return the default time between the ends of sine and run."""
        sine = hc.Sine(5.0, frequency, 4)
        scene = hc.Scene(chain, sine, wall=wall, precompression=load)
        return scene.end_time - 4 / frequency

    for wall in (None, hc.Wall("rigid")):
        # LM_ratio is 1 at 7.9 kHz.
        assert watched(1e12, wall) == pytest.approx(watched(8e3, wall), rel=0.02)
        assert watched(1e30, wall) == pytest.approx(watched(1e12, wall), rel=1e-9)
