"""The force of a deck's shock over time against the scene: peak, duration, profile, steps."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.scene.pulse import PROFILES, Pulse
from hertzchain.scene.scene import Scene
from hertzchain.verdict.deck.deck_check import Case, DeckCheck, Indices, placed, same, values
from hertzchain.verdict.deck.measured import stretches_of
from hertzchain.verdict.deck.places import formula_of, numbers_in, place_at, with_number

ACTS = 1e-6  # of the largest force: granules with less are not pushed (chosen)
_TIME = 0.003  # of a pulse: 2000 readings of it tell when it rises and ends to about that (chosen)
_NOTHING = 1e-7  # of the largest force: a pulse has begun or ended with less (chosen)
_ALIKE = 0.02  # of the largest force: a pulse of another duration or profile fits as well (chosen)


def pushed_granules(case: Case) -> Indices:
    """Granules that some applied force acts on."""
    largest = np.max(np.abs(case.found.applied_force), axis=0, initial=0.0)
    pushed = np.flatnonzero(largest > 0)
    return pushed[pushed < case.twin.mass.size]


def effect_of_all(case: Case, only_first: bool = False) -> float | None:
    """What the deck's applied forces do to the peaks in place of the scene's."""
    pushed = np.zeros(1, np.intp) if only_first else pushed_granules(case)
    if pushed.size == 0:
        pushed = np.zeros(1, np.intp)
    return case.effect(
        pushed=pushed, stretches=stretches_of(case.found, case.scene, case.start, pushed)
    )


def of_shock(
    case: Case,
    check: DeckCheck,
    numbers: Sequence[tuple[float, float]],
    fallback: str = "",
) -> DeckCheck:
    """A check of the shock with the line of its fix, or of the variable that has the number."""
    found, scale = case.found, case.scene.units.force
    shocks = [
        fix for fix in found.fixes
        if not fix.moves and float(np.max(fix.largest, initial=0.0)) > ACTS * scale
        and "wall" not in fix.style and fix.style != "gravity"
    ]  # fmt: skip
    word = found.commands[shocks[-1].command].text if shocks else ""
    check = placed(check, found, "shock", numbers, fallback, word)
    if not numbers and not fallback and check.place is not None:
        return replace(check, place=formula_of(found, check.place))
    return check


def _every(case: Case, check: DeckCheck) -> DeckCheck:
    """A check of a force that comes and goes with the line of its fix, if that says ``every``."""
    for fix in case.found.fixes:
        text = case.found.commands[fix.command].text
        if not fix.moves and " every " in text:
            right = re.sub(r"\s+every\s+\S+", "", text)
            return replace(check, place=place_at(case.found, fix.command), command=right)
    return check


def pulse_checks(case: Case) -> list[DeckCheck]:
    """The force on granule 1 over time."""
    found, scene = case.found, case.scene
    time, force = found.applied_time - case.start, found.applied_force[:, 0]
    expected = scene.applied_force(time)
    scale = scene.peak_force
    off = np.abs(force - expected)
    # A reading at a jump, or a step's rounding at a corner, is none of the shape.
    steps = max((run.dt for run in found.runs), default=0.0)
    near = np.array([np.min(np.abs(scene.applied_force(t + steps * np.array([-1e-6, 0.0, 1e-6]))
                                   - f)) for t, f in zip(time, force, strict=True)])  # fmt: skip
    off = np.minimum(off, near)
    k = int(np.argmax(off))
    if off[k] <= 1e-6 * scale:
        return [same("applied force", "N", float(np.max(force)), scale, case.reason)]
    change = effect_of_all(case, only_first=True)
    passed, held = case.allowed(change, 0.0), _held(case, time, force)
    # Steps of a held force have no reading at the crest and end early.
    checks = [] if held > 1 and passed else _numbers(case, time, force, change)
    if any(not check.passed for check in checks):
        return checks
    if held > 1:
        sentence = (
            f"the applied force is held for {held} steps: at {time[k]:.4g} s it is"
            f" {force[k]:.4g} N, the scene has {expected[k]:.4g} N"
        )
    else:
        sentence = (
            f"the applied force at {time[k]:.4g} s"
            f" {values(float(force[k]), float(expected[k]), 'N')}{_profile(scene, time, force)}"
        )
    check = DeckCheck(
        "applied force over time", "N", float(force[k]), float(expected[k]), change, passed, True,
        sentence, f"allowed is what changes no peak by more than {case.tolerance:g}",
    )  # fmt: skip
    return [*checks, _every(case, of_shock(case, check, ()))]


def _numbers(
    case: Case, time: FloatArray, force: FloatArray, change: float | None
) -> list[DeckCheck]:
    """Peak force, rise time and end of the pulse by its readings."""
    scene, unit, checks = case.scene, case.units, []
    top = int(np.argmax(np.abs(force)))
    measured, expected = float(force[top]), scene.peak_force
    # The highest reading may lie next to the crest.
    spaced = np.max(np.abs(scene.applied_force(time)), initial=0.0) / expected - 1
    off = measured / (expected * (1 + spaced)) - 1 if spaced > -1 else 0.0
    longer = None
    if isinstance(scene.shock, Pulse) and measured > 0:
        longer = _stretched(scene, time, force / measured * expected)
    if abs(off) > 1e-6:
        stretches = tuple(
            replace(one, applied=one.applied * (1 + off)) for one in case.twin.stretches
        )
        own = case.effect(stretches=stretches)
        passed = case.allowed(own, off)
        check = DeckCheck(
            "peak of the applied force", "N", measured, expected, own, passed, True,
            f"the largest applied force {values(measured, expected, 'N')}", case.reason,
        )  # fmt: skip
        numbers = [(abs(measured) / unit.force, expected / unit.force)]
        numbers += [(abs(measured) / unit.force / 2, expected / unit.force / 2)]
        if isinstance(scene.shock, Pulse) and longer is None:
            numbers = []  # of another shape: one number does not mend it
        checks.append(of_shock(case, check, numbers))
    if not isinstance(scene.shock, Pulse) or measured <= 0:
        return checks
    if longer is not None:
        if abs(longer - 1) > 1e-4:
            checks.append(_duration(case, longer, change))
        return checks
    return [*checks, *_corners(case, time, force, change)]


def _corners(
    case: Case, time: FloatArray, force: FloatArray, change: float | None
) -> list[DeckCheck]:
    """When a pulse of another shape begins, is largest and ends."""
    scene, checks = case.scene, list[DeckCheck]()
    assert scene.rise_time is not None
    top = int(np.argmax(np.abs(force)))
    measured, expected = float(force[top]), scene.peak_force
    acting = np.flatnonzero(np.abs(force) > _NOTHING * abs(measured))
    seen = np.flatnonzero(np.abs(scene.applied_force(time)) > _NOTHING * expected)
    if acting.size == 0 or seen.size == 0:
        return checks
    within = time <= scene.pulse_end
    again = float(np.max(np.abs(force - scene.applied_force(time))[within], initial=0.0))
    if again < _ALIKE * expected and acting[-1] > seen[-1] + 1:
        check = DeckCheck(
            "force after the pulse", "s", float(time[acting[-1]]), scene.pulse_end, change, False,
            True, f"the applied force acts again after the pulse, until {time[acting[-1]]:.4g} s,"
            f" the scene's ends at {scene.pulse_end:.4g} s", "the scene has one pulse",
        )  # fmt: skip
        return [*checks, of_shock(case, check, ())]
    crest = float(time[top]), float(time[int(np.argmax(scene.applied_force(time)))])
    ends = float(time[acting[-1]]), float(time[seen[-1]])
    begins = float(time[acting[0]]), float(time[seen[0]])
    rises = ("rise time", crest, scene.rise_time)
    lasts = ("end of the pulse", ends, scene.pulse_end)
    for name, (mine, right), exact in (rises, lasts):
        gap = _spacing(time, right)
        if abs(mine - right) <= max(_TIME * scene.pulse_end, 1.5 * gap):
            continue
        own = exact * mine / right if right > 0 else mine
        if name != "rise time" and checks and checks[-1].name == "rise time":
            rise = checks[-1].measured or 0.0
            if abs(own - rise - (exact - scene.rise_time)) <= 3 * gap:
                continue  # the decay is right: it begins late, or early
        check = DeckCheck(
            name, "s", own, exact, change, case.allowed(change, own / exact - 1), True,
            f"the applied force {'is largest' if name == 'rise time' else 'ends'} at {own:.4g} s,"
            f" the scene has {exact:.4g} s", case.reason,
        )  # fmt: skip
        check = of_shock(case, check, _times(case, own, exact))
        checks.append(_by_run(case, check, own, exact, gap))
    late = abs(begins[0] - begins[1])
    if late > max(_TIME * scene.pulse_end, 1.5 * _spacing(time, begins[1])) and not checks:
        check = DeckCheck(
            "start of the pulse", "s", begins[0] - begins[1], 0.0, change,
            case.allowed(change, 1.0), True,
            f"the applied force starts {begins[0] - begins[1]:+.4g} s off", case.reason,
        )  # fmt: skip
        checks.append(of_shock(case, check, ()))
    return checks


def _by_run(case: Case, check: DeckCheck, own: float, exact: float, gap: float) -> DeckCheck:
    """A check of a corner with the line of the run that ends there, if one does."""
    for run in case.found.runs:
        end = run.start - case.start + run.steps * run.dt
        if abs(end - own) <= 2 * gap + run.dt:
            where = place_at(case.found, run.command)
            steps = round(run.steps + (exact - end) / run.dt)
            command = with_number(where, [run.steps], [steps]) or f"{steps} steps"
            return replace(check, place=where, command=command)
    return check


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


def _duration(case: Case, longer: float, change: float | None) -> DeckCheck:
    """A pulse of the right profile that is too long or too short."""
    scene, unit = case.scene, case.units.time
    assert scene.rise_time is not None
    exact = scene.pulse_end
    check = DeckCheck(
        "duration of the pulse", "s", longer * exact, exact, change,
        case.allowed(change, longer - 1), True,
        f"the duration of the pulse {values(longer * exact, exact, 's')}", case.reason,
    )  # fmt: skip
    times = [scene.rise_time, exact, exact - scene.rise_time, 2 * scene.rise_time]
    numbers = [(longer * one / unit, one / unit) for one in times]
    return of_shock(case, check, [*numbers, *((1 / old, 1 / new) for old, new in numbers)])


def _spacing(time: FloatArray, at: float) -> float:
    """Distance of readings around a time [s]."""
    k = int(np.clip(np.searchsorted(time, at), 1, time.size - 1))
    around = time[max(0, k - 2) : k + 2]
    return float(np.max(np.diff(around), initial=0.0))


def _times(case: Case, own: float, exact: float) -> list[tuple[float, float]]:
    """As what a time of a pulse may stand in a line: numbers near what readings tell."""
    unit = case.units.time
    stand = [
        number
        for one in case.found.commands
        if one.text.split()[:1] in (["variable"], ["run"], ["fix"])
        for number in numbers_in(one.written)
        if abs(number * unit / own - 1) < 3 * _TIME
    ]
    pairs = [(number, exact / unit) for number in (own / unit, *stand)]
    return sorted(pairs, key=lambda pair: abs(pair[0] * unit / own - 1))


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


def _profile(scene: Scene, time: FloatArray, force: FloatArray) -> str:
    """Which of the three profiles the readings have, if one of them fits better."""
    if not isinstance(scene.shock, Pulse):
        return ""
    for profile in PROFILES:
        if profile == scene.shock.profile:
            continue
        other = replace(scene, shock=replace(scene.shock, profile=profile))
        if scene.shock.rise_time is None:
            pulse = replace(
                scene.shock, profile=profile, momentum_ratio=None, rise_time=scene.rise_time
            )
            other = replace(scene, shock=pulse)
        if np.max(np.abs(other.applied_force(time) - force)) < _ALIKE * scene.peak_force:
            return f"; it has the profile {profile!r}, the scene {scene.shock.profile!r}"
    return ""
