"""The force of a deck's shock over time against the scene: its peak, its profile."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.verdict.deck.deck_check import ACTS, Case, Indices, values
from hertzchain.verdict.deck.measured import stretches_of
from hertzchain.verdict.deck.number import Difference, same
from hertzchain.verdict.deck.places import formula_of, place

_ALIKE = 1e-3  # of the largest force: a force of another size, but of this profile (chosen)


def pushing_changes(case: Case, pushed: Indices) -> dict[str, Any]:
    """The deck's applied forces on some granules in place of the scene's."""
    pushed = pushed[pushed < case.twin.mass.size]
    return {"pushed": pushed, "stretches": stretches_of(case.found, case.scene, case.start, pushed)}


def of_shock(case: Case, one: Difference) -> Difference:
    """A difference of the shock with its fix; without a number in it, with its formula."""
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
    its = scene.shock.granule - 1
    time, force = found.applied_time - case.start, found.applied_force[:, its]
    # A reading at a jump, or a step's rounding at a corner, is none of the shape.
    moved = 1e-6 * max((run.dt for run in found.runs), default=0.0)
    near = [scene.applied_force(time + shift) for shift in (-moved, 0.0, moved)]
    off, expected = np.min(np.abs(near - force), axis=0), near[1]
    k = int(np.argmax(off))
    if off[k] <= 1e-6 * scene.peak_force:
        return [same(float(np.max(force)), scene.peak_force)]
    effect = case.effect(**pushing_changes(case, case.twin.pushed))
    held = _held(case, time, force)
    # Digits are those of the impulse: another duration of the pulse changes it as much.
    given, wanted = (
        float(np.diff(time) @ (one[1:] + one[:-1])) for one in (force - expected, np.abs(expected))
    )
    relative = 0.0 if held > 1 or wanted == 0 else given / wanted
    share = float(force @ expected / (expected @ expected)) if np.any(expected) else 0.0
    if held == 1 and np.max(np.abs(force - share * expected)) < _ALIKE * scene.peak_force:
        mine, right, unit = share * scene.peak_force, scene.peak_force, case.units.force
        return [of_shock(case, Difference(
            mine, right, "peak of the applied force", relative=relative, effect=effect,
            sentence=f"the largest applied force {values(mine, right, 'N')}",
            stands=[(mine * part / unit, right * part / unit) for part in (1.0, 0.5) if mine > 0],
        ))]  # fmt: skip
    at_time = f"at {time[k]:.4g} s"
    if held > 1:
        at_time = f"is held for {held} steps: {at_time} it"
    sentence = f"the applied force {at_time} {values(float(force[k]), float(expected[k]), 'N')}"
    one = Difference(force[k], expected[k], "applied force over time", relative=relative,
                     effect=effect, sentence=sentence)  # fmt: skip
    for fix in found.fixes:
        text = found.commands[fix.command].text
        if not fix.moves and " every " in text:
            return [replace(one, at=fix.command, command=re.sub(r"\s+every\s+\S+", "", text))]
    return [of_shock(case, one)]


def _held(case: Case, time: FloatArray, force: FloatArray) -> int:
    """For how many steps the force is held constant; 1 where it is not."""
    steps = [run.dt for run in case.found.runs]
    inside = (time > 0) & (time < case.scene.pulse_end)
    at, value = time[inside], force[inside]
    if at.size < 4 or not steps:
        return 1
    jumps = np.flatnonzero(np.abs(np.diff(value)) > 1e-9 * case.scene.peak_force)
    if jumps.size < 3 or jumps.size > 0.7 * (at.size - 1):
        return 1
    return max(1, round(float(np.median(np.diff(at[jumps + 1]))) / steps[0]))
