"""The force of a deck's shock over time against the scene: peak, duration, profile."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.scene import Scene
from hertzchain.verdict.deck.deck_check import ACTS, Case, Indices, values
from hertzchain.verdict.deck.measured import stretches_of
from hertzchain.verdict.deck.number import Difference, same
from hertzchain.verdict.deck.places import Pairs, formula_of, place

_TIME = 0.003  # of a pulse: 2000 readings of it tell when it rises and ends to about that (chosen)
_NOTHING = 1e-7  # of the largest force: a pulse has begun or ended with less (chosen)
_ALIKE = 0.02  # of the largest force: a pulse of another duration or profile fits as well (chosen)


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
    """The force on granule 1 over time."""
    found, scene = case.found, case.scene
    time, force = found.applied_time - case.start, found.applied_force[:, 0]
    # A reading at a jump, or a step's rounding at a corner, is none of the shape.
    moved = 1e-6 * max((run.dt for run in found.runs), default=0.0)
    near = [scene.applied_force(time + shift) for shift in (-moved, 0.0, moved)]
    off, expected = np.min(np.abs(near - force), axis=0), near[1]
    k = int(np.argmax(off))
    if off[k] <= 1e-6 * scene.peak_force:
        return [same(float(np.max(force)), scene.peak_force)]
    changes = pushing_changes(case, np.zeros(1, np.intp))
    effect, held = case.effect(**changes), _held(case, time, force)
    # Steps of a held force have no reading at the crest and end early.
    is_held = held > 1 and case.allowed(effect, 0.0)
    parts = [] if is_held else _parts(case, time, force, effect)
    if any(one.relative is None or not case.allowed(one.effect, one.relative) for one in parts):
        return parts
    at_time = f"at {time[k]:.4g} s"
    if held > 1:
        at_time = f"is held for {held} steps: {at_time} it"
    sentence = f"the applied force {at_time} {values(float(force[k]), float(expected[k]), 'N')}"
    one = Difference(force[k], expected[k], "applied force over time", relative=0.0, effect=effect,
                     sentence=sentence)  # fmt: skip
    for fix in found.fixes:
        text = found.commands[fix.command].text
        if not fix.moves and " every " in text:
            command = re.sub(r"\s+every\s+\S+", "", text)
            return [*parts, replace(one, at=fix.command, command=command)]
    return [*parts, _with_run(case, of_shock(case, one), time, force)]


def _parts(
    case: Case, time: FloatArray, force: FloatArray, effect: float | None
) -> list[Difference]:
    """Numbers of the pulse that tell its difference: its peak and its duration."""
    scene, unit, made = case.scene, case.units, []
    measured = float(force[int(np.argmax(np.abs(force)))])
    is_pulse, longer = isinstance(scene.shock, Pulse), None
    if is_pulse and measured > 0:
        longer = _stretched(scene, time, force / measured * scene.peak_force)
    # The highest reading may lie next to the crest.
    seen = float(np.max(np.abs(scene.applied_force(time / (longer or 1.0))), initial=0.0))
    off = measured / seen - 1 if seen > 0 else 0.0
    if abs(off) > 1e-6 and (longer is not None or not is_pulse or measured <= 0):
        right, mine = scene.peak_force, scene.peak_force * (1 + off)
        stretches = [replace(one, applied=one.applied * (1 + off)) for one in case.stretches]
        made.append(of_shock(case, Difference(
            mine, right, "peak of the applied force", relative=off,
            effect=case.effect(stretches=stretches),
            sentence=f"the largest applied force {values(mine, right, 'N')}",
            stands=[(mine * share / unit.force, right * share / unit.force)
                    for share in (1.0, 0.5) if mine > 0],
        )))  # fmt: skip
    if longer is not None and abs(longer - 1) > 1e-4:
        made.append(_duration(case, longer, effect))
    return made


def _with_run(case: Case, one: Difference, time: FloatArray, force: FloatArray) -> Difference:
    """A difference with the run at whose end the force has a corner that the scene has not."""
    scene = case.scene
    if not isinstance(scene.shock, Pulse) or not np.any(force):
        return one
    assert scene.rise_time is not None
    acting = np.flatnonzero(np.abs(force) > _NOTHING * float(np.max(np.abs(force))))
    crest, end = float(time[int(np.argmax(np.abs(force)))]), float(time[acting[-1]])
    for mine, right in ((crest, scene.rise_time), (end, scene.pulse_end)):
        gap = float(np.max(np.diff(time[np.abs(time - mine) < 0.1 * scene.pulse_end]), initial=0.0))
        for run in case.found.runs:
            ends = run.start - case.start + run.steps * run.dt
            wrong = abs(mine - right) > max(_TIME * scene.pulse_end, 1.5 * gap)
            if wrong and ends < 2 * right and abs(ends - mine) <= 2 * gap + run.dt:
                steps = round(run.steps + (right - ends) / run.dt)
                return replace(one, at=run.command, stands=[(run.steps, steps)])
    return one


def _stretched(scene: Scene, time: FloatArray, force: FloatArray) -> float | None:
    """How many times as long as the scene's a pulse of the same profile is; None for another."""

    def misfit(longer: float) -> float:
        return float(np.max(np.abs(scene.applied_force(time / longer) - force)))

    tried = np.geomspace(0.1, 10.0, 401)
    for _ in range(4):
        at = int(np.argmin([misfit(one) for one in tried]))
        low, high = tried[max(at - 1, 0)], tried[min(at + 1, tried.size - 1)]
        tried = np.linspace(low, high, 21)
    best = float(tried[int(np.argmin([misfit(one) for one in tried]))])
    return best if misfit(best) < _ALIKE * scene.peak_force else None


def _duration(case: Case, longer: float, effect: float | None) -> Difference:
    """A pulse of the right profile that is too long or too short."""
    scene, unit = case.scene, case.units.time
    assert scene.rise_time is not None
    right = scene.pulse_end
    times = [scene.rise_time, right, right - scene.rise_time, 2 * scene.rise_time]
    pairs: Pairs = [(longer * one / unit, one / unit) for one in times]
    one = Difference(
        longer * right, right, "duration of the pulse", "s", relative=longer - 1, effect=effect,
        stands=[*pairs, *((1 / old, 1 / new) for old, new in pairs)],
        sentence=f"the duration of the pulse {values(longer * right, right, 's')}",
    )  # fmt: skip
    return of_shock(case, one)


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
