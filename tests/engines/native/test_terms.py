"""Scenes with terms by the native backend: closed forms, identities, and linear chains.

Numbers without another source are those of independent simulations in natural units m = k = 1.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import jv

import hertzchain as hc
from hertzchain.engines.native.methods import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.observables.peaks import largest_difference
from hertzchain.scene.validity import refuse_hopeless_overlap
from tests.conftest import STEEL

Floats = NDArray[np.float64]

PTFE = {"radius": 4.75e-3, "young_modulus": 1.46e9, "poisson_ratio": 0.46, "density": 2200.0}
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
UNIFORM = hc.Chain(12, **STEEL)


def row(*granules: dict[str, float]) -> hc.Chain:
    return hc.Chain(len(granules), **{key: [g[key] for g in granules] for key in STEEL})


DIMER = row(*[STEEL, PTFE] * 6)

SCENES = {
    "large striker": hc.Scene(UNIFORM, hc.Striker(1.0, radius=8e-3)),
    "striker, rigid wall": hc.Scene(UNIFORM, hc.Striker(1.0), wall=hc.Wall("rigid")),
    "dimer": hc.Scene(DIMER, PULSE),
    "dimer, elastic wall": hc.Scene(DIMER, PULSE, wall=hc.Wall("elastic", 70e9, 0.33)),
    "gaps": hc.Scene(replace(UNIFORM, gap=1e-5), PULSE),
    "gaps, wall": hc.Scene(replace(UNIFORM, gap=1e-5), PULSE, wall=hc.Wall("same", gap=2e-5)),
    "precompression": hc.Scene(UNIFORM, PULSE, precompression=hc.Precompression(force=20.0)),
    "column": hc.Scene(
        DIMER, hc.Striker(0.5), wall=hc.Wall("same"), precompression=hc.Precompression(gravity=9.81)
    ),
    "all at once": hc.Scene(
        DIMER,
        hc.Striker(0.5, radius=6e-3),
        wall=hc.Wall("elastic", 70e9, 0.33),
        precompression=hc.Precompression(3.0, 9.81),
    ),
}


def test_two_spheres_that_meet() -> None:
    chain = row(STEEL, PTFE)
    scene = hc.Scene(chain, hc.Striker(2.0))
    result = hc.Native("reference").run(scene, record=None)
    stiffness, mass = scene.granules.stiffness[0], scene.granules.contact_mass[0]
    # Energy m* v^2 / 2 = 2/5 A d^(5/2).
    force = (1.25 * mass * 2.0**2) ** 0.6 * stiffness**0.4
    assert result.peak_force[0] == pytest.approx(force, rel=1e-11, abs=0)
    m1, m2 = scene.granules.mass
    assert result.velocity == pytest.approx(
        [2.0 * (m1 - m2) / (m1 + m2), 4.0 * m1 / (m1 + m2)], rel=1e-10, abs=0
    )


@pytest.mark.parametrize("name", ["striker, rigid wall", "gaps", "dimer", "column"])
def test_nothing_is_left_behind_with_terms(name: str) -> None:
    scene = SCENES[name]
    legs, walker = scene.schedule(0.2 * scene.contact_time), METHODS["srkn-11b"].walker
    run = simulate(scene, legs, walker, leave_behind=True)
    assert np.all(np.isfinite(run.displacement))


def test_a_static_load_stays_where_it_is() -> None:
    late = hc.PulseTable((1.0, 2.0), (0.0, 1.0))
    loads = hc.Precompression(force=5.0, gravity=9.81)
    wall = hc.Wall("same")
    scene = hc.Scene(DIMER, late, hc.Run(2e-4), wall, loads)
    result = hc.Native("reference").run(scene)
    # Rounding of forces and overlaps, added up over some hundred steps.
    assert np.max(np.abs(result.displacement)) < 1e-13 * scene.units.length
    assert result.static_force is not None
    assert result.peak_force == pytest.approx(result.static_force, rel=1e-14, abs=0)
    weight = 9.81 * np.cumsum(scene.granules.mass)
    assert result.static_force == pytest.approx(5.0 + weight, rel=1e-14, abs=0)


@pytest.mark.parametrize("strength", [1e-3, 1e-4])
def test_a_small_push_on_a_pressed_chain_vs_bessel_functions(strength: float) -> None:
    """v_j(t) = v0 (2j + 1) / (w0 t) J_{2j+1}(2 w0 t) on a free end, w0^2 = k' / m (Nesterenko)."""
    press = 100.0
    chain = hc.Chain(60, **STEEL)
    # As slow as the overlaps of the static load are deep: linear but for the fraction below.
    linear = 1.5 * press ** (1 / 3) * chain.contact_stiffness ** (2 / 3)
    frequency = math.sqrt(linear / chain.granule_mass)
    depth = (press / chain.contact_stiffness) ** (2 / 3)
    velocity = strength * depth * frequency
    time = np.linspace(2.0, 40.0, 20) / frequency
    scene = hc.Scene(
        chain,
        hc.Striker(velocity, loaded=True),
        hc.Run(float(time[-1])),
        precompression=hc.Precompression(press),
    )
    history = hc.Native(rtol=1e-9).run(scene, record=time).history
    j = np.arange(20)
    expected = np.array(
        [velocity * (2 * j + 1) / (frequency * t) * jv(2 * j + 1, 2 * frequency * t) for t in time]
    )
    # What the curvature of Hertz's law leaves is of first order in the push.
    assert np.max(np.abs(history.velocity[:, :20] - expected)) < 0.3 * strength * velocity


def test_unlike_granules_that_are_alike_are_a_uniform_chain() -> None:
    columns = {key: [value] * 12 for key, value in STEEL.items()}
    alike = hc.Chain(12, **columns, gap=[1.0] + [0.0] * 11)
    assert alike == UNIFORM
    scene = hc.Scene(alike, PULSE)
    assert scene.is_plain
    one, other = (hc.Native().run(s).peak_force for s in (scene, hc.Scene(UNIFORM, PULSE)))
    assert np.array_equal(one, other)


WATCHED = {
    "a light striker and wide gaps": hc.Scene(
        hc.Chain(3, [2e-3, 8e-3, 8e-3], 193e9, 0.3, 7958.0, gap=1e-3), hc.Striker(1.0)
    ),
    "a heavy striker on a wall": hc.Scene(
        hc.Chain(2, **STEEL), hc.Striker(1.0, density=7.958e6), wall=hc.Wall("rigid")
    ),
    "unlike granules": hc.Scene(DIMER, hc.Striker(0.1)),
}


@pytest.mark.parametrize("name", WATCHED)
def test_the_default_end_lets_every_contact_peak(name: str) -> None:
    scene = WATCHED[name]
    result = hc.Native().run(scene)
    longer = hc.Native().run(replace(scene, run=hc.Run(4 * scene.end_time)))
    bound = result.error_estimate + longer.error_estimate
    assert largest_difference(result.peak_force, longer.peak_force) <= bound
    assert not [warning for warning in result.warnings if "run ended" in warning]


def test_a_run_that_ends_too_early_says_so() -> None:
    scene = replace(SCENES["striker, rigid wall"], run=hc.Run(5e-5))
    (warning,) = hc.Native().run(scene).warnings
    assert "the run ended before contact" in warning
    assert "had been pressed and had let up: set end_time in" in warning
    result = hc.Native().run(SCENES["striker, rigid wall"])
    assert result.warnings == ()
    assert result.peak_passed[-1]
    early = replace(scene, run=hc.Run(0.999 * float(result.peak_time[-1])))
    (warning,) = hc.Native().run(early).warnings
    assert "the wall" in warning


def test_a_load_that_presses_too_deep_is_refused_before_a_run() -> None:
    scene = hc.Scene(UNIFORM, PULSE, precompression=hc.Precompression(1e9))
    with pytest.raises(hc.HertzchainError, match="radii, above 1"):
        refuse_hopeless_overlap(scene)


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
