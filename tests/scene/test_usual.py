"""Remarks on values that look as if they had a wrong unit."""

from __future__ import annotations

from dataclasses import replace

import pytest

import hertzchain as hc
from hertzchain.scene.usual import unusual_values
from tests.conftest import STEEL

CHAIN = hc.Chain(3, **STEEL)
PULSE = hc.Pulse("cosine", 1.0, 2.0, momentum_ratio=1.0)


def test_every_part_is_looked_at() -> None:
    striker = hc.Striker(velocity=2000.0)
    wall = hc.Wall("elastic", young_modulus=70.0, poisson_ratio=0.3)
    law = hc.Contact("viscoelastic", relaxation_time=2.0)
    granules = replace(CHAIN, radius=(1e-3, 1e-3, 2.5))
    found = unusual_values(hc.Scene(granules, striker, wall=wall, contact=law))
    assert [one.partition(" = ")[0] for one in found] == [
        *("chain.radius", "striker.velocity", "wall.young_modulus", "contact.relaxation_time")
    ]
    assert found[0] == "chain.radius = 2.5 m (usually 1e-06 to 0.5 m)"


@pytest.mark.parametrize(
    ("shock", "named"),
    [
        (replace(PULSE, peak_force=1e8), "shock.peak_force = 1e+08 N"),
        (hc.PulseTable((0.0, 1e-5, 2e-5), (0.0, 1e8, 0.0)), "shock.peak_force = 1e+08 N"),
        (hc.Piston(velocity=1e-6), "shock.velocity = 1e-06 m/s"),
    ],
)
def test_a_shock_is_looked_at(shock: hc.Pulse | hc.PulseTable | hc.Piston, named: str) -> None:
    (remark,) = unusual_values(hc.Scene(CHAIN, shock))
    assert remark.startswith(named)
