"""The two oracles that judge error bounds, against one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from tests.conftest import paper_scene
from tests.oracles import eighth_order, extrapolation


@pytest.mark.parametrize("end", [1.0, 0.1], ids=["whole", "ends while the force falls"])
def test_two_solvers_of_a_plain_chain(end: float) -> None:
    scene = paper_scene("cosine-triangular", 0.3, 3.0, 12)
    scene = replace(scene, run=hc.Run(end * scene.end_time))
    truth, other = eighth_order.solve(scene), extrapolation.solve(scene)
    assert truth.error_of(other.force) < 1e-12  # 3e-13 seen, in 53 bits against 80
    assert other.error < 1e-11


def test_errors_are_told() -> None:
    truth = eighth_order.Truth(np.array([1.0, 2.0, 1e-4]), 0.0)
    assert truth.error_of(np.array([1.0, 2.0, 5.0])) == 0  # below a thousandth of the largest
    assert truth.error_of(np.array([1.0, 2.002, 0.0])) == pytest.approx(1e-3)
    nothing = eighth_order.Truth(np.zeros(3), 0.0)
    assert nothing.error_of(np.zeros(3)) == 0
    assert nothing.error_of(np.array([0.0, 1e-9, 0.0])) == 1
