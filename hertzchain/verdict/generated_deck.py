"""The generated deck of a scene, as LAMMPS has it before it runs: only round-off may differ.

LAMMPS is queried as for a user's deck, and the same probes judge the numbers.
"""

from __future__ import annotations

from dataclasses import replace

from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.errors import RunFailed
from hertzchain.examiner.examined import DeckCheck
from hertzchain.examiner.examining import case_of_generated
from hertzchain.examiner.probes import checks_of, probes_of
from hertzchain.limits import Deadline
from hertzchain.scene.scene import Scene
from hertzchain.verdict.check import Check, Kind, unmeasured, within

_ENGINE = "lammps"
_ADVICE = (
    "LAMMPS built something other than the scene from the deck: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it"
)
NOT_EXAMINED = Kind("not examined", _ADVICE)


def examined(scene: Scene, lammps: Lammps) -> list[Check]:
    """Examine the deck of a scene in LAMMPS, each number by itself."""
    try:
        return number_checks(scene, lammps.examine(scene), lammps.time_limit)
    except RunFailed as problem:
        return [unmeasured(NOT_EXAMINED, _ENGINE, str(problem))]


def number_checks(scene: Scene, deck: FoundDeck, time_limit: float = 60.0) -> list[Check]:
    """Return a check of each number that applies to a scene."""
    case = case_of_generated(scene, deck, Deadline(time_limit))
    checks: list[Check] = []
    for probe in probes_of(case):
        several = checks_of(case, probe)
        if several:
            worst = next((check for check in several if check.differs), several[0])
            name = f"{probe.name} [{probe.unit}]" if probe.unit else probe.name
            checks.append(_check(Kind(name, _ADVICE), worst))
        if len(checks) == 1 and not checks[0].passed:  # of another chain the rest tells nothing
            return checks
    return checks


def _check(kind: Kind, number: DeckCheck) -> Check:
    """The check of one number of an exact deck."""
    reason = "only round-off may differ"
    if number.differs:
        reason += f"; {number.sentence}"
    if number.measured is None or number.expected is None:
        return unmeasured(kind, _ENGINE, reason)
    numbers = float(number.measured), float(number.expected), number.room or 0.0
    return replace(within(kind, _ENGINE, *numbers, reason), passed=not number.differs)
