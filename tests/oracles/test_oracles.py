"""The oracles that judge error bounds, against independently known answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.native import METHODS, simulate_in_numpy
from tests.conftest import STEEL, paper_scene
from tests.oracles import eighth_order, extrapolation
from tests.oracles.first_pulses import Trace


def test_two_granules_under_a_constant_force() -> None:
    # The peak is 5/4 F0, from the balance of energy. A rise of a hundred-thousandth of the time
    # of contact changes it by the square of that.
    unit = paper_scene("cosine", 1.0, 2.0, 2).units.time
    shock = hc.PulseTable((0.0, 1e-5 * unit, 50 * unit), (0.0, 100.0, 100.0))
    truth = eighth_order.solve(hc.Scene(hc.Chain(2, **STEEL), shock))
    assert truth.force[0] == pytest.approx(125.0, rel=1e-9, abs=0)
    assert truth.error < 1e-12  # 2e-13 seen


def test_vs_scipy_in_si() -> None:
    scene = paper_scene("triangular", 0.3, 4.0, 6)
    peak = Trace(scene).at_all(np.linspace(0.0, scene.end_time, 100_000)).max(axis=1)
    # The largest of samples a thousandth of a contact's time apart: 5e-8 was seen.
    assert eighth_order.solve(scene).error_of(peak) < 1e-7


@pytest.mark.parametrize("profile", ["cosine", "triangular", "cosine-triangular"])
def test_vs_long_double(profile: str) -> None:
    # 64 bits of mantissa where there are so many; the method, its steps and its interpolation are
    # the package's, so an error of either side would show.
    scene = paper_scene(profile, 2.0, 2.0, 8)
    legs = scene.schedule(0.02 * scene.units.time)
    run = simulate_in_numpy(scene, legs, METHODS["reference"].walker, dtype=np.longdouble)
    truth = eighth_order.solve(scene)
    # The error of the reference by its refinement; measured 2e-13.
    assert truth.error_of(np.asarray(run.peaks.force * 100, np.float64)) < 1e-12
    assert truth.error < 1e-13


COLLISIONS = {
    "restitution": (hc.Contact("restitution", restitution=0.5), 0.5502832),
    "weak restitution": (hc.Contact("restitution", restitution=0.9), 0.9020261),
    "with attraction": (hc.Contact("restitution", restitution=0.5, attraction=True), 0.5),
    # Of the series of Kuwabara and Kono's law, at a tenth of the time of the collision.
    "viscoelastic": (hc.Contact("viscoelastic", relaxation_time=0.1), 0.84514381),
    "viscoelastic with attraction": (
        hc.Contact("viscoelastic", relaxation_time=0.1, attraction=True), 0.84333941,
    ),
}  # fmt: skip
"""Laws, and the speed after a collision over that before."""


@pytest.mark.parametrize("name", COLLISIONS)
def test_speeds_after_a_collision(name: str) -> None:
    law, expected = COLLISIONS[name]
    scene = hc.Scene(hc.Chain(2, **STEEL), hc.Striker(0.1))
    each = scene.granules
    unit = float((each.contact_mass[0] / each.stiffness[0]) ** 0.4 * 0.1**-0.2)
    if law.relaxation_time is not None:
        law = replace(law, relaxation_time=law.relaxation_time * unit)
    before, after = extrapolation.peaks(replace(scene, contact=law)).velocity
    # All digits that are known; 1e-12 of 0.5.
    assert (after - before) / 0.1 == pytest.approx(expected, rel=1e-7, abs=0)


@pytest.mark.parametrize("end", [1.0, 0.1], ids=["whole", "ends while the force falls"])
def test_two_solvers_of_a_plain_chain(end: float) -> None:
    scene = paper_scene("cosine-triangular", 0.3, 3.0, 12)
    scene = replace(scene, run=hc.Run(end * scene.end_time))
    truth, other = eighth_order.solve(scene), extrapolation.solve(scene)
    assert truth.error_of(other.force) < 1e-12  # 3e-13 seen, in 53 bits against 80
    assert other.error < 1e-11


LAWS = {
    "restitution": hc.Contact("restitution", restitution=0.6),
    "viscoelastic": hc.Contact("viscoelastic", relaxation_time=2e-6),
    "dashpot": hc.Contact("dashpot", coefficient=20.0),
}


@pytest.mark.parametrize("law", LAWS)
def test_all_terms_vs_scipy(law: str) -> None:
    scene = hc.Scene(
        hc.Chain(4, gap=2e-7, **STEEL | {"radius": (6e-3, 5e-3, 4e-3, 3e-3)}),
        hc.Striker(0.1), hc.Run(4e-4), hc.Wall("rigid", gap=3e-7), None, LAWS[law],
    )  # fmt: skip
    truth, result = extrapolation.solve(scene), hc.Native("scipy", rtol=1e-6).run(scene)
    assert truth.error < extrapolation.SURE * 1e-10
    assert truth.error_of(result.peak_force) <= result.error_estimate


def test_a_run_cut_short_is_the_beginning_of_the_whole() -> None:
    scene = paper_scene("cosine", 1.0, 2.0, 12)
    whole, _ = eighth_order.peaks(scene)
    half = hc.Scene(scene.chain, scene.shock, hc.Run(scene.end_time / 3))
    part, rising = eighth_order.peaks(half)
    assert rising.any()
    assert not rising.all()
    passed = ~rising & (part > 0.5 * part.max())
    assert part[passed] == pytest.approx(whole[passed], rel=1e-13, abs=0)
    assert np.all(part[rising] < whole[rising])


def test_errors_are_told() -> None:
    truth = eighth_order.Truth(np.array([1.0, 2.0, 1e-4]), 0.0)
    assert truth.error_of(np.array([1.0, 2.0, 5.0])) == 0  # below a thousandth of the largest
    assert truth.error_of(np.array([1.0, 2.002, 0.0])) == pytest.approx(1e-3)
    nothing = eighth_order.Truth(np.zeros(3), 0.0)
    assert nothing.error_of(np.zeros(3)) == 0
    assert nothing.error_of(np.array([0.0, 1e-9, 0.0])) == 1
