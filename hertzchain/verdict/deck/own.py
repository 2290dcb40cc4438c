"""The generated deck of a scene, as LAMMPS has it before it runs: only round-off may differ.

LAMMPS is queried as for a user's deck, and the same numbers are compared.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.engines.lammps.reading.own import DEPTH
from hertzchain.engines.lammps.reading.units import UNITS
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene
from hertzchain.verdict.check import Check, Kind, unmeasured, within
from hertzchain.verdict.deck.deck_check import EXAMINED, Case
from hertzchain.verdict.deck.examining import numbers_of
from hertzchain.verdict.deck.expected import constant_force
from hertzchain.verdict.deck.measured import laws, stretches_of
from hertzchain.verdict.deck.number import Difference, Number, differences
from hertzchain.verdict.deck.twin import TwinRun, twin_of

_ENGINE = "lammps"
_MATTERS = 1.01  # times the probed overlap: the law follows from the two tries next to it (chosen)
_MEND = (
    "what LAMMPS made of the deck is not the scene: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it"
)
NOT_EXAMINED = Kind("not examined", _MEND)


def examined(scene: Scene, lammps: Lammps) -> list[Check]:
    """Examine the deck of a scene in LAMMPS, each number by itself."""
    try:
        return number_checks(scene, lammps.examine(scene), lammps.time_limit)
    except RunFailed as problem:
        return [unmeasured(NOT_EXAMINED, _ENGINE, str(problem))]


def number_checks(scene: Scene, found: FoundDeck, time_limit: float = 60.0) -> list[Check]:
    """Return a check of each number that applies to a scene."""
    case = _case(scene, found, Deadline(time_limit))
    checks: list[Check] = []
    for number in numbers_of(case):
        several = differences(case, number)
        if several:
            worst = next((one for one in several if one.differs), several[0])
            checks.append(_check(number, worst))
        if len(checks) == 1 and not checks[0].passed:  # of another chain the rest tells nothing
            return checks
    return checks


def _case(scene: Scene, found: FoundDeck, deadline: Deadline) -> Case:
    """Data that the numbers of a deck share before it runs: no peak is judged."""
    pushed, twin = scene.pushed, twin_of(scene)
    if scene.piston is None and pushed < found.mass.size and constant_force(scene)[pushed] == 0:
        # A constant force on that granule belongs to the shock.
        constant, applied = found.constant_force.copy(), found.applied_force.copy()
        applied[:, pushed] += constant[pushed, 0]
        constant[pushed, 0] = 0.0
        found = replace(found, constant_force=constant, applied_force=applied)
    none, size = np.zeros(twin.mass.size), twin.stiffness.size
    near = np.full(size, _MATTERS * DEPTH * float(np.min(scene.granules.radius)))
    return Case(
        scene, found, UNITS["si"], 0.0, np.zeros(size), np.zeros(size, bool), near,
        laws(found, scene, near), twin, stretches_of(found, scene, 0.0),
        TwinRun(np.zeros(size), np.inf, np.inf, none, none), EXAMINED, deadline, exact=True,
    )  # fmt: skip


def _check(number: Number, one: Difference) -> Check:
    """The check of one number of an exact deck."""
    kind = Kind(f"{number.name} [{number.unit}]" if number.unit else number.name, _MEND)
    reason = "only round-off may differ"
    if one.differs:
        reason += f"; {one.sentence or one.name or number.name}"
    if one.measured is None or one.expected is None:
        return unmeasured(kind, _ENGINE, reason)
    numbers = float(one.measured), float(one.expected), float(max(one.room, 0.0))
    check = within(kind, _ENGINE, *numbers, reason)
    return replace(check, passed=not one.differs)
