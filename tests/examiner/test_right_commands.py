"""Commands of a scene in the units, the directions, the types and the names of somebody's deck."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from hertzchain.engines.lammps.reading.deck import UNITS
from hertzchain.examiner import correct
from hertzchain.examiner.examined import Case
from hertzchain.examiner.examining import case_of
from hertzchain.limits import Deadline
from tests.examiner.corpus import scene_of
from tests.examiner.made import assert_alike, changed, deck_of

FRICTION = "tangential linear_nohistory 0.0 0.0"
DOWN: dict[str, Any] = {
    "axis": "z",
    "direction": np.array([0, 0, -1.0]),
    "origin": np.array([0.01, 0, 0.3]),
}


@cache
def right_case(name: str) -> Case:
    """What checks share of a right deck."""
    scene = scene_of(name)
    return case_of(scene, deck_of(name, scene), 1e-3, Deadline(60.0), {})[0]


def case(name: str, units: str = "si", **numbers: Any) -> Case:
    """The same with other units or numbers of its granules."""
    example = right_case(name)
    return replace(example, units=UNITS[units], deck=changed(example.deck, **numbers))


def later(name: str, units: str = "si", **numbers: Any) -> Callable[[], Case]:
    """The same, which is computed when a test wants it."""
    return partial(case, name, units, **numbers)


def modulus(young: float, poisson: float) -> float:
    """Of a contact of two granules of one material: E* = E / (2 (1 - nu^2)) [Pa]."""
    return young / (2 * (1 - poisson**2))


STEEL = 4 / 3 * modulus(193e9, 0.3)
RUBBER = 4 / 3 * modulus(5e6, 0.45)
MIXED = 4 / 3 / ((1 - 0.3**2) / 200e9 + (1 - 0.34**2) / 70e9)

Commands = Callable[[Case], list[str] | None]

TABLE: list[tuple[Commands, Callable[[], Case], list[str] | None]] = [
    (correct.granule_commands, later("dimer", "micro"),
     ["set type 1 diameter 12000", "set type 2 diameter 6000",
      "set type 1 density 7.8", "set type 2 density 2.7"]),
    (correct.granule_commands, later("dimer", types=np.ones(16, np.int64)),
     [*(f"set atom {k} diameter {(0.006, 0.012)[k % 2]}" for k in range(1, 17)),
      *(f"set atom {k} density {(2700, 7800)[k % 2]}" for k in range(1, 17))]),
    (correct.granule_commands, later("piston", ids=np.arange(11)), []),
    (correct.velocity_commands, later("wall", "cgs"),
     ["velocity all set 0.0 0.0 0.0 units box", "velocity first set 50 0.0 0.0 units box"]),
    (correct.velocity_commands, later("piston", spin=np.ones((12, 3))),
     ["velocity all set 0.0 0.0 0.0 units box", "set group all omega 0.0 0.0 0.0"]),
    (correct.law_commands, later("dimer", "micro"),
     ["pair_style granular", f"pair_coeff * * hertz {MIXED / 1e3:.10g} 0.0 {FRICTION}"]),
    (correct.law_commands, later("viscoelastic"),
     ["pair_style granular", (f"pair_coeff * * hertz {STEEL:.10g}"
      # eta m* a v with a = sqrt(R* d) is tau times dF/dt = 3/2 A d^1/2 v, A = 4/3 E* sqrt(R*).
      f" {0.5e-6 * 2 * modulus(193e9, 0.3) / (2 / 3 * np.pi * 4.75e-3**3 * 7958):.10g}"
      f" {FRICTION} damping viscoelastic")]),
    (correct.wall_commands, later("piston"), None),
    (correct.wall_commands, later("column", "cgs", **DOWN),
     [(f"fix wall all wall/gran granular hertz {20 * RUBBER:.10g} 1e-300 {FRICTION}"
      " damping velocity zplane 11.0792756751313 NULL")]),
    (correct.load_commands, later("piston"), []),
    (correct.load_commands, later("column", "cgs", **DOWN),
     ["fix gravity all gravity 981 vector 0.0 0.0 -1"]),
    (correct.load_commands, later("precompressed", **DOWN, ids=np.arange(14) + 3),
     ["group granule1 id 3", "fix load1 granule1 addforce 0.0 0.0 -20",
      "group granule14 id 16", "fix load14 granule14 addforce 0.0 0.0 20"]),
    (correct.load_commands, later("fixed"),  # its striker is not pressed; the fixed one holds
     ["group granule2 id 2", "fix load2 granule2 addforce 5 0.0 0.0"]),
    (correct.motion_commands, later("wall"), ["fix motion all nve"]),
    (correct.motion_commands, later("piston"),
     ["group others subtract all first", "fix motion others nve"]),
    (correct.motion_commands, later("fixed"),
     ["group fixed id 9", "group others subtract all fixed", "fix motion others nve"]),
    (correct.piston_commands, later("wall"), []),
    (correct.piston_commands, later("piston", "cgs"),
     ["fix piston first move linear 20 0.0 0.0 units box"]),
    (correct.shock_commands, later("wall"), []),
    (correct.shock_commands, later("column", "cgs", **DOWN),
     [('variable F_2 equal "-((time>=0)*(time<0.002)*(200000.0*time/0.002)+(time>=0.002)*'
      '(time<0.004)*(200000.0-200000.0*(time-0.002)/0.002))"'),
      "fix shock first addforce 0.0 0.0 v_F_2"]),
    (correct.shock_commands, later("dimer", "micro"),
     [('variable F equal "(time>=0)*(time<25)*(150000000000.0*time/25.0)+(time>=25)*'
      '(time<50)*(150000000000.0-150000000000.0*(time-25.0)/25.0)"'),
      "fix shock first addforce v_F 0.0 0.0"]),
]  # fmt: skip


@pytest.mark.parametrize("row", range(len(TABLE)))
def test_commands_of_a_scene(row: int) -> None:
    commands, example_of, expected = TABLE[row]
    lines = commands(example_of())
    assert (lines is None) == (expected is None)
    assert_alike(lines or [], expected or [])
