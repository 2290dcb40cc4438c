"""Numbers of a deck by its probes: units of lj, laws of contacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.verdict.deck.measured import law_of
from tests.verdict.deck.made import (
    STEP,
    by_name,
    changed,
    examined,
    times,
)


def test_units_of_lj(scene: hc.Scene, right: FoundDeck) -> None:
    """The same chain in arbitrary units: lengths of 2 mm, masses of 3 g, times of 5 us."""
    length, mass, time = 2e-3, 3e-3, 5e-6
    force = mass * length / time**2
    per = {
        length: ("position", "radius", "overlap", "damped_overlap", "final_position"),
        mass: ("mass",),
        time: ("applied_time", "end_time"),
        force: ("contact_force", "damped_force", "applied_force", "peak_force"),
        length / time: ("closing", "final_velocity"),
    }
    numbers = {name: getattr(right, name) / unit for unit, names in per.items() for name in names}
    runs = (replace(right.runs[0], dt=STEP / time),)
    fixes = tuple(
        replace(fix, largest=fix.largest / force, largest_in_motion=fix.largest_in_motion / force)
        for fix in right.fixes
    )
    scaled = changed(right, units="lj", runs=runs, fixes=fixes, **numbers)
    done = examined(scene, scaled)
    assert [check.sentence for check in done.checks if not check.passed] == []
    assert any("one length is 0.002 m" in remark for remark in done.remarks)
    weaker = times("applied_force", 0.9)(scaled)
    assert not by_name(examined(scene, weaker), "peak of the applied").passed


@pytest.mark.parametrize(
    ("force", "stiffness", "exponent"),
    [
        ([0.0, 0.0, 0.0], 0.0, 1.5),  # nothing pushes
        ([0.0, 0.0, 5.0 * 4**1.5], 5.0, 1.5),  # one overlap alone: Hertz's exponent is taken
        ([3.0, 6.0, 12.0], 3.0, 1.0),
        ([7.0, np.nan, 7.0 * 4**2], 7.0, 2.0),
    ],
)
def test_the_law_of_a_contact(force: list[float], stiffness: float, exponent: float) -> None:
    for order in (slice(None), slice(None, None, -1)):
        law = law_of(np.array([1.0, 2.0, 4.0])[order], np.array(force)[order], 2.0, 3.9)
        assert (law.stiffness, law.exponent) == pytest.approx((stiffness, exponent), rel=1e-14)
