"""The force of a deck's shock over time against the scene: its peak, its profile."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.verdict.deck.deck_check import ACTS, Case, Indices, values
from hertzchain.verdict.deck.expected import applied_force
from hertzchain.verdict.deck.measured import stretches_of
from hertzchain.verdict.deck.number import Difference, same
from hertzchain.verdict.deck.places import formula_of, place

_ALIKE = 1e-3  # fraction of the largest force: another size, but the same profile (chosen)


_ROUNDED = 8 * float(np.finfo(np.float64).eps)  # of a force from which a load is taken (chosen)


def pushing_changes(case: Case, pushed: Indices) -> dict[str, Any]:
    """The deck's applied forces on some granules in place of the scene's."""
    pushed = pushed[pushed < case.twin.mass.size]
    return {"pushed": pushed, "stretches": stretches_of(case.found, case.scene, case.start, pushed)}


def of_shock(case: Case, one: Difference) -> Difference:
    """Return a difference of the shock at its fix or, without a number in that, at its formula."""
    found, least = case.found, ACTS * case.scene.units.force
    shocks = [
        fix for fix in found.fixes
        if not fix.moves and float(np.max(fix.largest, initial=0.0)) > least
        and "wall" not in fix.style and fix.style != "gravity"
    ]  # fmt: skip
    at = shocks[-1].command if shocks else None
    if one.stands:
        return replace(one, at=at)
    where = place(found, "shock", (), at)
    if where is not None and not one.command:
        where = formula_of(found, where)
    return replace(one, at=None if where is None else where.index)


def pulse(case: Case) -> list[Difference]:
    """The force over time on the granule that the scene pushes."""
    found, scene = case.found, case.scene
    its = scene.pushed
    time, force = found.applied_time - case.start, found.applied_force[:, its]
    # Readings at a jump, or within rounding of a corner, are not compared.
    late = len(found.runs) * math.ulp(scene.pulse_end)  # times are sums of steps, leg by leg
    moved = 4 * len(found.runs) * math.ulp(scene.end_time)
    if not case.exact:
        moved = 1e-6 * found.runs[0].dt
    steepest = max(
        math.pi / 2 * abs(ramp.end_force - ramp.start_force) / (ramp.end - ramp.start)
        for ramp in scene.ramps
    )
    loads = float(np.max(np.abs(found.constant_force)))
    room = case.least(ACTS) * scene.peak_force + late * steepest + _ROUNDED * loads
    sides = np.array([applied_force(scene, time + shift) for shift in (-moved, 0.0, moved)])
    jumps, expected = np.ptp(sides, axis=0) > 100 * room + moved * steepest, sides[1]
    both = np.abs(np.where(jumps, sides, expected) - force)
    off, side = np.min(both, axis=0), np.argmin(both, axis=0)
    k = int(np.argmax(off))
    if off[k] <= room and case.exact:
        return [same(force[k], sides[side[k], k], room)]
    if off[k] <= room:
        return [same(float(np.max(force)), scene.peak_force, room)]
    changes = pushing_changes(case, case.twin.pushed)
    held = _held(case, time, force)
    # The impulse decides on digits: it changes as much as the duration of the pulse.
    given, wanted = (
        float(np.diff(time) @ (one[1:] + one[:-1])) for one in (force - expected, np.abs(expected))
    )
    relative = 0.0 if held > 1 or wanted == 0 else given / wanted
    share = float(force @ expected / (expected @ expected)) if np.any(expected) else 0.0
    alike = bool(np.max(np.abs(force - share * expected)) < _ALIKE * scene.peak_force)
    if held == 1 and alike and not case.exact:
        mine, right, unit = share * scene.peak_force, scene.peak_force, case.units.force
        return [of_shock(case, Difference(
            mine, right, "peak of the applied force", relative=relative, changes=changes,
            sentence=f"the largest applied force {values(mine, right, 'N')}",
            stands=[(mine * part / unit, right * part / unit) for part in (1.0, 0.5) if mine > 0],
        ))]  # fmt: skip
    at_time = f"at {time[k]:.4g} s"
    if held > 1:
        at_time = f"is held for {held} steps: {at_time} it"
    sentence = f"the applied force {at_time} {values(float(force[k]), float(expected[k]), 'N')}"
    one = Difference(force[k], expected[k], "applied force over time", relative=relative,
                     changes=changes, sentence=sentence, room=room)  # fmt: skip
    for fix in found.fixes:
        text = found.commands[fix.command].text
        if not fix.moves and " every " in text:
            return [replace(one, at=fix.command, command=re.sub(r"\s+every\s+\S+", "", text))]
    return [of_shock(case, one)]


def _held(case: Case, time: FloatArray, force: FloatArray) -> int:
    """Return for how many steps the force is held constant; 1 if it is not."""
    inside = (time > 0) & (time < case.scene.pulse_end)
    at, value = time[inside], force[inside]
    jumps = np.flatnonzero(np.abs(np.diff(value)) > 1e-9 * case.scene.peak_force)
    if jumps.size < 3 or jumps.size > 0.7 * (at.size - 1):
        return 1
    return max(1, round(float(np.median(np.diff(at[jumps + 1]))) / case.found.runs[0].dt))
