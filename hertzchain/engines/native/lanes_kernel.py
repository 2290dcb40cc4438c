"""Plain scenes side by side, compiled: see ``lanes_loops`` for how they stand in arrays.

What is computed is that of ``elastic.march`` without terms, with symplectic methods. All scenes
take a step at once, each its own, from its own corners, halved and repeated as it needs. Two things
differ, so that no scene depends on the others:

- The window ends where the front ends in all scenes: with each stage it grows as far as any scene
  presses the next granule. A scene whose front is elsewhere computes granules at rest there, which
  stay at rest exactly.
- A scene that leaves granules behind moves them to where they press nothing; the window closes when
  all scenes have left them.

Overlaps are compared, not forces, as a contact is pressed by its overlap to the power 3/2.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.compiling import compiled, compiled_and_kept
from hertzchain.engines.native.elastic_chain import (
    END,
    FREE_END,
    START,
    STEPS,
    applied_force,
    energy_of,
)
from hertzchain.engines.native.elastic_legs import DIVERGED_ENERGY, pushed_legs
from hertzchain.engines.native.elastic_state import DEEPEST
from hertzchain.engines.native.elastic_window import is_settled, left_behind
from hertzchain.engines.native.interpolant import hertz_force
from hertzchain.engines.native.lanes_loops import (
    LANES,
    Lanes,
    Motion,
    any_pressed,
    begin_step,
    find_crossings,
    find_speeds,
    place,
    take_stage,
)
from hertzchain.engines.native.lanes_maxima import keep_maxima

_CHECK_EVERY = 16
"""Steps between two looks at what may be left behind: fewer cost more than they save (measured)."""

ROWS = 11
"""Rows of ``state``: both motions, steps, largest overlaps of contacts, and what a scan finds."""

_SCENE = np.dtype(
    [(name, np.int64) for name in ("leg", "whole", "part", "level", "behind", "evaluations")]
    + [(name, np.float64) for name in ("begin", "step", "work")]
    + [(name, np.bool_) for name in ("runs", "refused", "diverged")],
    align=True,
)
"""What is known of a scene: its leg; steps of that which are done, parts of a halved one that are
done, and how often it is halved; the first granule that is not left behind; force evaluations;
start and length of the present step; work done."""


@compiled
def _take_step(
    old: Any, new: Any, lanes: Any, kicks: Any, drifts: Any, lo: int, hi: int, pushed: bool
) -> int:
    """Take one step of all scenes; returns where the window ends."""
    h, time, drifted = lanes.step, 0.0, drifts.size
    begin_step(old, new, h, kicks[0], drifts[0], lo, hi)
    for s in range(1, drifted + 1):
        time += drifts[s - 1]
        for k in range(lanes.legs.shape[0]):
            scene, push = lanes.scenes[k], 0.0
            if pushed and scene.runs:
                push = applied_force(lanes.legs[k, scene.leg], scene.begin + time * scene.step)
            new.force[place(lo, k)] = push
        drift, first, end = drifts[s] if s < drifted else 0.0, lo, hi
        while first < end:
            take_stage(new, h, kicks[s], drift, first, end)
            first = end
            if end < h.size // LANES - 2 and any_pressed(new.force, end):
                end += 1
        hi = end
    return hi


@compiled
def _refuse(
    old: Any, new: Any, lanes: Any, tolerance: float, starting: float, lo: int, hi: int
) -> None:
    """Find the scenes whose step has to be halved: see ``refinement.Refined``."""
    early, scenes, h = 0, lanes.legs.shape[0], lanes.step
    for k in range(scenes):
        early += lanes.scenes[k].begin < starting
    if early < scenes:
        find_crossings(old, new, h, lanes.scan[0], False, lo, hi)
    if early > 0:
        find_crossings(old, new, h, lanes.scan[1], True, lo, hi)
    find_speeds(new.v, lanes.scan[2], lo, hi)
    for k in range(scenes):
        scene, j = lanes.scenes[k], place(hi, k)
        fastest = float(lanes.scan[1 if scene.begin < starting else 0, j])
        felt = fastest**3 * scene.step**5 > (tolerance * float(lanes.scan[2, j])) ** 2
        scene.refused = felt and scene.runs and scene.level < DEEPEST


@compiled
def _set_step(lanes: Any, k: int, step: float) -> None:
    """Set the step of a scene, which all its granules take."""
    scene, h = lanes.scenes[k], lanes.step
    if step != scene.step:
        scene.step = step
        for i in range(h.size // LANES):
            h[place(i, k)] = step


@compiled
def _go_on(old: Any, new: Any, lanes: Any, k: int, hi: int) -> bool:
    """Go on after a step, or back to its start to halve it; returns whether the leg is done."""
    scene = lanes.scenes[k]
    leg = lanes.legs[k, scene.leg]
    full = (leg[END] - leg[START]) / leg[STEPS]
    if scene.refused:
        for i in range(scene.behind, hi + 1):
            j = place(i, k)
            new.u[j], new.v[j], new.force[j] = old.u[j], old.v[j], old.force[j]
        scene.level, scene.part = scene.level + 1, 2 * scene.part
    else:
        moved = float(new.u[k]) - float(old.u[k])
        scene.work += 0.5 * (float(old.force[k]) + float(new.force[k])) * moved
        scene.part += 1
        while scene.level > 0 and scene.part % 2 == 0:
            scene.level, scene.part = scene.level - 1, scene.part // 2
        if scene.level == 0:
            scene.whole, scene.part = scene.whole + scene.part, 0
    step = full / (1 << scene.level)
    _set_step(lanes, k, step)
    scene.begin = leg[START] + scene.whole * full + scene.part * step
    return scene.whole >= leg[STEPS]


@compiled
def _next_leg(new: Any, lanes: Any, k: int) -> bool:
    """Begin the next leg of a scene; returns whether there is one."""
    scene, legs = lanes.scenes[k], lanes.legs[k]
    scene.begin = legs[scene.leg, END]  # where the run ends if this was the last leg
    scene.leg += 1
    while scene.leg < legs.shape[0] and legs[scene.leg, STEPS] == 0:
        scene.leg += 1
    if scene.leg == legs.shape[0]:
        return False
    leg = legs[scene.leg]
    scene.whole = scene.part = scene.level = 0
    scene.begin = leg[START]
    _set_step(lanes, k, (leg[END] - leg[START]) / leg[STEPS])
    if scene.behind == 0:
        new.force[k] = applied_force(leg, leg[START])
    return True


@compiled
def _look(new: Any, lanes: Any, k: int, leaves: bool, hi: int, one: Any) -> bool:
    """Leave behind what can change no peak of a scene; returns whether the scene is at its end.

    That is where no peak can change, or where it has far more energy than it was given.
    """
    scene, granules = lanes.scenes[k], one.shape[1] - 1
    u, v, peak_force, behind = one[0], one[1], one[2, : granules - 1], scene.behind
    for i in range(behind, hi + 1):
        u[i], v[i] = new.u[place(i, k)], new.v[place(i, k)]
    scene.diverged = not energy_of(u, v, behind, hi, None) <= DIVERGED_ENERGY * scene.work
    if scene.diverged:
        return True
    if not leaves or scene.leg < pushed_legs(lanes.legs[k]):
        return False
    for i in range(behind, min(hi, granules - 1)):
        peak_force[i] = hertz_force(float(lanes.highest[place(i, k)]))
    if hi == granules and is_settled(u, v, peak_force, 0, behind, hi, None):
        return True
    cut = left_behind(u, v, peak_force, 0, behind, hi, None)
    if cut > behind:
        for i in range(behind, cut):
            j = place(i, k)
            new.u[j], new.v[j], new.force[j] = -FREE_END, 0.0, 0.0
        new.force[place(cut, k)] = 0.0
        scene.behind = cut
    return False


@compiled
def _end_scene(new: Any, lanes: Any, k: int, hi: int) -> None:
    """Take note of what is still pressed harder, and let a scene rest from now on."""
    scene, highest = lanes.scenes[k], lanes.highest
    for i in range(hi):
        j = place(i, k)
        r = new.u[j] - new.u[j + LANES]
        if r > highest[j]:
            highest[j], lanes.highest_at[j] = r, scene.begin
        new.u[j] = new.v[j] = new.force[j] = 0.0
    scene.runs = scene.refused = False
    _set_step(lanes, k, 0.0)


@compiled
def _march(
    state: Any, lanes: Any, leaves: Any, kicks: Any, drifts: Any, tolerance: float,
    starting: float, one: Any, b: Any, control: Any,
) -> None:  # fmt: skip
    """Integrate as many scenes as there are legs, at most as many as stand side by side."""
    granules, scenes = one.shape[1] - 1, lanes.legs.shape[0]
    old, new = Motion(state[0], state[1], state[2]), Motion(state[3], state[4], state[5])
    state[:] = 0.0
    for k in range(LANES):
        j = place(granules, k)
        old.u[j] = new.u[j] = FREE_END
    active, lo, hi, count, pushed = scenes, 0, 1, 0, True
    for k in range(scenes):
        scene = lanes.scenes[k]
        scene.leg, scene.behind, scene.evaluations = -1, 0, 0
        scene.work = scene.step = 0.0
        scene.runs, scene.refused, scene.diverged = True, False, False
        _next_leg(new, lanes, k)
    while active > 0:
        old, new = new, old
        hi = _take_step(old, new, lanes, kicks, drifts, lo, hi, pushed)
        if tolerance > 0:
            _refuse(old, new, lanes, tolerance, starting, lo, hi)
        keep_maxima(old, new, lanes, lo, hi, b)
        count += 1
        looks = count % _CHECK_EVERY == 0
        if looks:
            if control[0] < 0:
                return
            control[2] += 1
        lo, pushed = granules, False
        for k in range(scenes):
            scene = lanes.scenes[k]
            if not scene.runs:
                continue
            scene.evaluations += drifts.size
            ends = _go_on(old, new, lanes, k, hi) and not _next_leg(new, lanes, k)
            if looks or ends:
                ends |= _look(new, lanes, k, leaves[k] and not ends, hi, one)
            if ends:
                _end_scene(new, lanes, k, hi)
                active -= 1
            else:
                lo = min(lo, scene.behind)
                pushed |= scene.leg < pushed_legs(lanes.legs[k])


@compiled_and_kept()
def march_lanes(
    legs: FloatArray,
    leaves: Any,
    kicks: FloatArray,
    drifts: FloatArray,
    state: FloatArray,
    tolerance: float,
    starting: float,
    peak_force: FloatArray,
    peak_time: FloatArray,
    end: FloatArray,
    evaluations: FloatArray,
    control: FloatArray,
) -> None:
    """Peaks of many scenes of one length, as ``elastic.march`` finds those of one.

    Parameters
    ----------
    legs
        Shape (scenes, legs, 8); a leg without steps is left out. Neighbours run together, as long
        as the longest of them.
    leaves
        Whether granules of each scene may be left behind, shape (scenes,).
    kicks, drifts
        Of a symplectic method, shape (stages + 1,) and (stages,).
    state
        Room, shape (ROWS, LANES (N + 2)).
    tolerance, starting, control
        As for ``elastic.march``.
    peak_force, peak_time
        Filled in, shape (scenes, N - 1).
    end, evaluations
        Filled in with the time reached by each and its force evaluations, NaN where the motion
        diverged, shape (scenes,).
    """
    size = state.shape[1]
    granules, scenes = size // LANES - 2, np.zeros(LANES, _SCENE)
    highest, highest_at, marks = state[7], np.zeros(size), np.zeros(size, np.uint8)
    one, b = np.zeros((3, granules + 1)), np.zeros(7)
    for first in range(0, legs.shape[0], LANES):
        some = slice(first, min(first + LANES, legs.shape[0]))
        lanes = Lanes(
            state[6], highest, highest_at, marks, marks.view(np.uint64), state[8:], scenes,
            legs[some],
        )  # fmt: skip
        _march(state, lanes, leaves[some], kicks, drifts, tolerance, starting, one, b, control)
        if control[0] < 0:
            return
        for n in range(some.start, some.stop):
            scene = scenes[n - first]
            end[n] = scene.begin
            evaluations[n] = np.nan if scene.diverged else scene.evaluations
            for i in range(granules - 1):
                j = place(i, n - first)
                peak_force[n, i] = hertz_force(float(highest[j]))
                peak_time[n, i] = highest_at[j] if peak_force[n, i] > 0 else np.nan
