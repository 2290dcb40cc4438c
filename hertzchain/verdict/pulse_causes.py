"""Another pulse as a cause of wrong peaks: its profile, its duration ratio, a stepwise force."""

from __future__ import annotations

from collections.abc import Iterator

from hertzchain.arrays import FloatArray
from hertzchain.scene.pulse import Pulse
from hertzchain.verdict.case import Case, Cause
from hertzchain.verdict.families import Family, of_pulses, words_of
from hertzchain.verdict.mistaken import Mistakes, Runs


def other_pulse(case: Case) -> Iterator[Cause]:
    """Yield another profile, another duration ratio, and a force held constant in steps."""
    pulse = case.scene.shock
    if not isinstance(pulse, Pulse):
        return
    runs = Runs(case.scene, case.deadline)
    for family in of_pulses(pulse):

        def peaks(x: float, family: Family = family) -> FloatArray:
            return runs.peaks(family.make(Mistakes(), x))

        x, _ = case.fit(peaks, family.trials.tolist())
        yield case.cause(words_of(case.scene, family, family.make(Mistakes(), x)), peaks(x))
