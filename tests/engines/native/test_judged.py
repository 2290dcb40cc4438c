"""Scenes with every term, judged by another solver, and by momentum and energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.verdict.run_checks import balance_checks
from tests.conftest import STEEL
from tests.engines.native.test_damped_scenes import LAWS, scene_with
from tests.engines.native.test_fixed import SCENES as FIXED
from tests.engines.native.test_flights import SCENES as FLIGHTS
from tests.engines.native.test_local_shock import SCENES as LOCAL
from tests.engines.native.test_near_wall import SCENES as NEAR_WALL
from tests.engines.native.test_pistons import DAMPED
from tests.engines.native.test_pistons import SCENES as PISTONS
from tests.engines.native.test_terms import SCENES as TERMS
from tests.oracles import extrapolation
from tests.oracles.bounds import at_three_accuracies, by_methods, check_answers, lasting

UNIFORM = hc.Chain(12, **STEEL)
PRESSED = hc.Precompression(10.0)
DASHPOT = hc.Contact("dashpot", coefficient=20.0)
PULLING = hc.Contact("dashpot", coefficient=2.0, attraction=True)

SINES = {
    "slow": hc.Scene(UNIFORM, hc.Sine(3.0, 2000.0, 2), precompression=PRESSED),
    "as strong as the load": hc.Scene(UNIFORM, hc.Sine(10.0, 8000.0, 3), precompression=PRESSED),
    "above the cut-off, wall": hc.Scene(
        hc.Chain(5, **STEEL), hc.Sine(5.0, 3e4, 2), wall=hc.Wall("rigid"),
        precompression=hc.Precompression(10.0, 9.81),
    ),
}  # fmt: skip


def with_law(scenes: dict[str, hc.Scene], law: hc.Contact) -> dict[str, hc.Scene]:
    """The scenes with damped contacts."""
    return {name: replace(scene, contact=law) for name, scene in scenes.items()}


KINDS = {
    "terms": TERMS,
    "flights": FLIGHTS,
    "flights, damped": with_law(FLIGHTS, DASHPOT),
    "local": LOCAL,
    "fixed": FIXED,
    "near wall": NEAR_WALL,
    "all terms": {name: scene_with(law) for name, law in LAWS.items()},
    "piston, damped": with_law(PISTONS, LAWS["restitution"]) | DAMPED,
    "piston, pulling": with_law(PISTONS, PULLING),
    "sine, damped": with_law(SINES, LAWS["viscoelastic"]),
}
DRIVES = {"piston": PISTONS, "sine": SINES}
"""Judged by every method, too."""

ALL = [(kind, name) for kind, scenes in (KINDS | DRIVES).items() for name in scenes]


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_peaks_and_velocities(kind: str, name: str) -> None:
    scene = lasting((KINDS | DRIVES)[kind][name])
    asked: list[Any] = at_three_accuracies()
    if kind in DRIVES:
        asked += by_methods(scene)
    found = check_answers(scene, asked)
    assert len(found) == len(asked)
    true = extrapolation.peaks(scene).velocity[scene.first_granule :]
    # After many collisions; 3e-9 seen.
    largest = np.max(np.abs(true))
    assert found[2].velocity == pytest.approx(true, rel=0, abs=1e-8 * largest)
    # Those that a comparison has: the velocities of other runs have errors of their own.
    balances = balance_checks(hc.Native("reference").run(scene))
    assert [check for check in balances if not check.passed] == []
