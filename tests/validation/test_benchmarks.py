"""The benchmarks call the kernels, and cut them, as they are now."""

from __future__ import annotations

import ast

import pytest

import hertzchain as hc
from hertzchain.engines.native import kernels
from hertzchain.engines.native.simulation import leg_rows
from validation.benchmarks import FEATURES, march, sources


@pytest.mark.parametrize("feature", FEATURES)
def test_each_feature_can_be_cut_out_of_the_kernels(feature: str) -> None:
    source, cut = sources(feature)
    assert ast.dump(ast.parse(cut)) != ast.dump(ast.parse(source))


def test_the_front_saves_evaluations(demo: hc.Scene) -> None:
    rows = leg_rows(demo.schedule(0.4 * demo.units.time), demo.units)
    front, whole = (march(vars(kernels), rows, 60, moving) for moving in (8, 60))
    assert (front.status, whole.status) == (kernels.DONE, kernels.DONE)
    assert whole.granule_evaluations == 60 * whole.evaluations
    assert 0 < front.granule_evaluations < 0.8 * whole.granule_evaluations
