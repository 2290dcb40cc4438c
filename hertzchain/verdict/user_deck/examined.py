"""The examination of somebody's deck: its numbers, its peaks and a verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, or_none
from hertzchain.engines.lammps.user_deck import Executed, FoundDeck
from hertzchain.observables.definitions import context_of
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene
from hertzchain.showing import ShownVerdict
from hertzchain.verdict.user_deck.deck_check import DeckCheck

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False, repr=False)
class DeckExamination(ShownVerdict):
    """What LAMMPS makes of somebody's deck, number by number against a scene.

    It is true if the verdict is ``pass``.

    Parameters
    ----------
    scene
        What the deck should compute.
    deck
        Its name.
    found
        What LAMMPS made of it, in SI units.
    checks
        Every number against the scene's, what to mend first in front; the peaks are the last.
    reference
        The scene by the reference method, up to the end of the deck.
    judged
        Contacts whose peaks were judged, shape (contacts,), a wall's the last.
    tolerance
        Largest relative difference of the peaks that passes.
    remarks
        Sentences on what was not looked at.
    texts
        Name and text of each file of the deck, as its commands name them.
    """

    scene: Scene
    deck: str
    found: FoundDeck
    checks: tuple[DeckCheck, ...]
    reference: Result
    judged: NDArray[np.bool_]
    tolerance: float
    remarks: tuple[str, ...]
    texts: tuple[tuple[str, str], ...] = ()

    @property
    def passed(self) -> bool:
        """Whether all of the deck is the scene."""
        return all(check.passed for check in self.checks)

    @property
    def verdict(self) -> str:
        """``pass`` where all of the deck is the scene, else ``fail``."""
        return "pass" if self.passed else "fail"

    @property
    def peak_force(self) -> FloatArray:
        """Peak forces of the deck [N], shape (N - 1,), NaN where it has no such contact."""
        whole = np.full(self.reference.peak_force.size, np.nan)
        count = min(whole.size, self.found.radius.size - 1, self.found.peak_force.size)
        whole[:count] = self.found.peak_force[:count]
        return whole

    @property
    def to_mend(self) -> tuple[DeckCheck, ...]:
        """The checks that failed but for the peaks, the one with the largest effect first."""
        return tuple(check for check in self.checks[:-1] if not check.passed)

    @property
    def small(self) -> tuple[DeckCheck, ...]:
        """The checks that passed with a difference."""
        return tuple(check for check in self.checks if check.passed and check.differs)

    @property
    def left_out(self) -> tuple[Executed, ...]:
        """Commands that were not carried out, or not in full."""
        return tuple(one for one in self.found.commands if one.why_not is not None)

    def to_frame(self) -> pandas.DataFrame:
        """A table with one row for each check."""
        import pandas

        return pandas.DataFrame([check.to_dict() for check in self.checks])

    def to_dict(self) -> dict[str, Any]:
        """The examination as JSON knows it; null stands for what is not there."""
        found = self.found
        return {
            "verdict": self.verdict,
            "deck": self.deck,
            "tolerance": self.tolerance,
            "checks": [check.to_dict() for check in self.checks],
            "left_out": [
                {"file": one.file, "line": one.line, "command": one.written, "why": one.why_not}
                for one in self.left_out
            ],
            "remarks": list(self.remarks),
            "units": found.units,
            "axis": found.axis,
            "lammps": found.version,
            "end_time_s": found.end_time,
            "dt_s": max((run.dt for run in found.runs), default=None),
            "peak_force_N": or_none(self.peak_force),
            "peak_reading_error": (
                found.peak_reading_error if math.isfinite(found.peak_reading_error) else None
            ),
            "judged": self.judged.tolist(),
            "reference": self.reference.numbers(),
            **context_of(self.scene),
        }


def in_order(checks: Sequence[DeckCheck]) -> list[DeckCheck]:
    """What failed first, by its effect on the peaks; then what differs; then the rest."""

    def rank(check: DeckCheck) -> tuple[int, float]:
        group = 0 if not check.passed else 1 if check.differs else 2
        effect = -1.0 if check.effect is None else check.effect
        return group, -effect if group < 2 else 0.0

    return sorted(checks, key=rank)
