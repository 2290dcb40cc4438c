"""Decks in which the chain settles before its shock are judged as they stand then."""

from __future__ import annotations

from pathlib import Path

import pytest

import hertzchain as hc
from tests.engines.lammps.reading.chains import SCENE, Deck

pytestmark = [pytest.mark.lammps, pytest.mark.slow]

LOADED = """group last id 6
fix load hit addforce 5 0 0
fix from last addforce -5 0 0
variable force equal 0
fix air all viscous 50
run {steps}
unfix air
velocity hit set 0.3 0 0
"""

LED = """variable force equal 0
run 100
unfix motion
group rest subtract all hit
fix m rest nve
fix lead hit move linear 0.3 0 0
"""

STRUCK = hc.Scene(
    SCENE.chain, hc.Striker(0.3, loaded=True), hc.Run(6e-5), precompression=hc.Precompression(5.0)
)


@pytest.mark.parametrize(
    ("scene", "more", "begins"),
    [
        (STRUCK, LOADED.format(steps=7000), "0.0007"),
        (hc.Scene(SCENE.chain, hc.Piston(velocity=0.3), hc.Run(6e-5)), LED, "1e-05"),
    ],
    ids=["striker", "piston"],
)
def test_the_shock_is_a_motion(scene: hc.Scene, more: str, begins: str, tmp_path: Path) -> None:
    examined = hc.examine(scene, Deck(more=more, steps=600).write(tmp_path))
    assert (examined.to_mend, examined.verdict) == ((), "pass")
    assert f"the shock begins {begins} s after" in examined.remarks[0]


def test_a_chain_that_had_no_time_to_settle(tmp_path: Path) -> None:
    """The run before the shock is the line to mend; granules that still move are named."""
    path = Deck(more=LOADED.format(steps=300), steps=600).write(tmp_path)
    place, velocity = hc.examine(STRUCK, path).to_mend
    assert "after the runs before the shock" in place.sentence
    assert place.place.written == "run 300"
    assert "velocity" in velocity.name
