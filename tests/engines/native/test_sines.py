"""Weak sines on a pressed chain: the linear chain."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

import hertzchain as hc
from tests.conftest import STEEL


@pytest.mark.parametrize("strength", [1e-3, 1e-4])
@pytest.mark.parametrize("above", [0.6, 1.2])
def test_a_weak_sine_is_that_of_the_linear_chain(strength: float, above: float) -> None:
    """The velocity after a blow P on a free end is (2j + 1) J_{2j+1}(2 w0 t) / (w0 t) P / m.

    A force is a row of blows. Frequencies are those over the cut-off 2 w0, w0^2 = k' / m.
    """
    press, chain = 100.0, hc.Chain(40, **STEEL)
    linear = 1.5 * press ** (1 / 3) * chain.contact_stiffness ** (2 / 3)
    w0 = math.sqrt(linear / chain.granule_mass)
    frequency, cycles = above * 2 * w0 / (2 * math.pi), 3
    sine, pressed = hc.Sine(strength * press, frequency, cycles), hc.Precompression(press)
    time = np.array([0.7, 1.6, 2.9]) * cycles / frequency
    scene = hc.Scene(chain, sine, hc.Run(float(time[-1])), precompression=pressed)
    history = hc.Native(rtol=1e-9).run(scene, record=time).history

    def velocity(j: int, t: float) -> float:
        def part(s: float) -> float:
            x = w0 * (t - s)
            after = (2 * j + 1) * jv(2 * j + 1, 2 * x) / x if x > 0 else float(j == 0)
            return float(after * math.sin(2 * math.pi * frequency * s))

        whole = quad(part, 0.0, min(t, cycles / frequency), limit=400, epsabs=1e-12 / w0)[0]
        return strength * press / chain.granule_mass * float(whole)

    scale = strength * press / (chain.granule_mass * w0)
    for k, t in enumerate(time):
        expected = [velocity(j, float(t)) for j in range(8)]
        # What the curvature of Hertz's law leaves is of first order in the push.
        assert np.max(np.abs(history.velocity[k, :8] - expected)) < 2 * strength * scale
