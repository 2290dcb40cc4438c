"""What moves the granules of a deck, against a scene: forces, velocities, gravity, steps, end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hertzchain.decks.lint import stability
from hertzchain.decks.lint.against import (
    CLOSE,
    Against,
    Check,
    against,
    differs,
    granules,
    places,
)
from hertzchain.decks.lint.against_contacts import contacts
from hertzchain.decks.lint.chain import Chain
from hertzchain.decks.lint.deck import Run
from hertzchain.decks.lint.finding import Finding
from hertzchain.decks.lint.pushing import Force, moving_runs

if TYPE_CHECKING:
    from hertzchain.scene.scene import Scene

_POINTS, _AFTER = 600, 100  # times during the pulse and after it at which forces are compared
_SHAPE = 5e-3
"""Of F0, by which two pulses may differ: one whose times are off by 1e-3 does by up to 3.2e-3, at
the steepest place of a cosine of n = 2 (derived: pi/2 1e-3 t/t0)."""
_STABLE, _ACCURATE = math.sqrt(2 / 3), 0.2  # natural time units, as in the rule ``step-length``


def _forces(made: Against) -> None:
    """The force on each granule over time, against that of the scene."""
    chain, scene, row = made.chain, made.scene, made.row
    if row is None or scene.piston is not None or chain.fixes("setforce", "move"):
        _not_pushed(made)
        return
    runs = moving_runs(chain)
    if not runs or any(run.end is None for run in runs):
        made.not_known("applied force over time")
        return
    pressed = scene.precompression
    static = 0.0 if pressed is None else pressed.force
    on_last = 0.0 if scene.wall is not None else -static
    pushed: dict[int, list[Force]] = {}
    for force in chain.forces:
        members = row.members(force.group)
        if members is None:
            made.not_known(f"granules of group {force.group}")
            return
        if not any(word not in ("", "NULL", "0", "0.0") for word in force.words):
            continue
        for granule in members:
            pushed.setdefault(granule, []).append(force)
    first, last = row.ids[0], row.ids[-1]
    others = [k for k in pushed if k not in (first, last) or (k == last and on_last == 0)]
    if others:
        command = pushed[others[0]][0].command
        text = f"a force acts on granule {others[0]}"
        text += f" and {len(others) - 1} more" if len(others) > 1 else ""
        made.say("force", command, f"{text}, in the scene it pushes granule {first} alone")
        if first not in pushed:
            return
    times = _times(made, runs)
    if times is None:
        made.not_known("applied force over time")
        return
    _compare_force(made, pushed.get(first, []), times, static)
    if on_last:
        own = [_sum(made, pushed.get(last, []), run, time) for run, time in times[:1]]
        if own[0] is None:
            made.not_known("force on the last granule")
        elif differs(own[0] * made.scale.force, on_last):
            text = (
                f"the last granule is held by {-own[0]:.6g}, in the scene by"
                f" {static / made.scale.force:.6g}"
            )
            command = pushed[last][0].command if last in pushed else None  # type: ignore[assignment]
            made.say("force", command, text, -own[0], static / made.scale.force)


def _not_pushed(made: Against) -> None:
    """Say what is known of a shock that is no force, or that a fix replaces."""
    row, piston = made.row, made.scene.piston
    if piston is None:
        made.not_known("applied force")
    elif row is None or made.chain.fixes("setforce", "move", "nve/noforce"):
        made.not_known("motion of the piston")
    else:
        text = f"nothing moves granule {row.ids[0]} as the scene's piston does: write a fix move"
        made.say("piston", None, text)


def _times(made: Against, runs: list[Run]) -> list[tuple[Run, float]] | None:
    """Times of the deck during the pulse of the scene and after it, each with its run."""
    pulse, end = made.scene.pulse_end / made.time, runs[-1].end or 0.0
    times = [pulse * (k + 0.5) / _POINTS for k in range(_POINTS)] if pulse else []
    later = max(end - pulse, 0.0)
    times += [pulse + later * (k + 0.5) / _AFTER for k in range(_AFTER)]
    found, at = [], 0
    for time in times:
        if time >= end:
            break
        while time > (runs[at].end or 0.0):
            at += 1
        found.append((runs[at], time))
    return found or None


def _sum(made: Against, forces: list[Force], run: Run, time: float) -> float | None:
    """All forces on a granule at a time, towards the far end, in units of the deck."""
    row = made.row
    assert row is not None
    backwards = made.chain.row is not None and made.chain.row.ids != row.ids
    total = 0.0
    for force in forces:
        if run in force.runs and force.words[row.axis] != "NULL":
            value = force.at(made.chain, row.axis, run, time)
            if value is None:
                return None
            total += value
    return -total if backwards else total


def _compare_force(
    made: Against, forces: list[Force], times: list[tuple[Run, float]], static: float
) -> None:
    """Compare the force on the first granule over time."""
    import numpy as np  # the scene has loaded it

    scene, unit = made.scene, made.scale.force
    command = next((force.command for force in [*forces, *made.chain.forces]), None)
    values = [_sum(made, forces, run, time) for run, time in times]
    known = [value for value in values if value is not None]
    if len(known) != len(values):
        made.not_known("applied force over time")
        return
    at = np.array([time for _, time in times])
    own = np.array(known) - static / unit
    if scene.striker is not None:
        wanted = np.zeros_like(own)
        highest = max(static, scene.units.force) / unit
    else:
        wanted = scene.applied_force(at * made.time) / unit
        highest = scene.peak_force / unit
    off = np.abs(own - wanted)
    worst = int(np.argmax(off))
    if off[worst] <= _SHAPE * highest:
        if scene.striker is None and differs(float(own.max()), float(wanted.max())):
            _say_peak(made, forces, float(own.max() / wanted.max()))
        return
    if scene.striker is not None or not np.any(own):
        text = (
            f"the force on granule 1 is {own[worst] + static / unit:.6g} at {at[worst]:.4g}, in the"
            f" scene {wanted[worst] + static / unit:.6g}"
        )
        made.say("force", command, text, float(own[worst]), float(wanted[worst]))
        return
    ratio = float(own.max() / wanted.max()) if own.max() > 0 else -1.0
    if ratio < 0:
        text = (
            "the force pulls granule 1 away from the chain, in the scene it pushes: change its sign"
        )
        made.say("force", command, text, float(own[worst]), float(wanted[worst]))
        return
    if np.max(np.abs(own / ratio - wanted)) <= _SHAPE * highest:  # at the same times
        _say_peak(made, forces, ratio)
        return
    # Over other times: of the whole pulses.
    ratio = max(float(own.max()), (made.chain.largest_push or 0.0) - static / unit) / highest
    if differs(ratio, 1.0):
        _say_peak(made, forces, ratio)
    scaled = own / ratio
    mine, theirs = _crossings(at, scaled), _crossings(at, wanted)
    names = ("rises to half of its peak at", "falls to half of its peak at")
    for name, one, other in zip(names, mine, theirs, strict=True):
        if one is not None and other is not None and differs(one, other):
            text = (
                f"the force {name} {one:.5g}, in the scene at {other:.5g}, {one / other:.4g} times:"
                f" the rise time is {_rise(made)} and the pulse ends at"
                f" {scene.pulse_end / made.time:.6g} there"
            )
            made.say("force", command, text, one, other)
            return
    worst = int(np.argmax(np.abs(scaled - wanted)))
    text = (
        f"the pulse has another shape: at {at[worst]:.5g} the force is {own[worst]:.5g}, in the"
        f" scene {wanted[worst]:.5g} (the pulse ends at {scene.pulse_end / made.time:.6g} there)"
    )
    made.say("force", command, text, float(own[worst]), float(wanted[worst]))


def _rise(made: Against) -> str:
    rise = made.scene.rise_time
    return "that of a table" if rise is None else f"{rise / made.time:.6g}"


def _say_peak(made: Against, forces: list[Force], ratio: float) -> None:
    expected = made.scene.peak_force / made.scale.force
    text = (
        f"the largest force is {ratio * expected:.6g}, in the scene it is {expected:.6g}:"
        f" multiply it by {1 / ratio:.6g}"
    )
    made.say("force", forces[0].command, text, ratio * expected, expected)


def _crossings(time: object, force: object) -> tuple[float | None, float | None]:
    """When a force first rises above half of its largest, and last falls below."""
    import numpy as np

    t, f = np.asarray(time), np.asarray(force)
    above = np.flatnonzero(f > f.max() / 2)
    half = f.max() / 2
    found: list[float | None] = []
    for k, step in ((int(above[0]), -1), (int(above[-1]), 1)):
        other = k + step
        if not 0 <= other < t.size:
            found.append(None)
            continue
        part = (f[k] - half) / (f[k] - f[other])
        found.append(float(t[k] + part * (t[other] - t[k])))
    return found[0], found[1]


def _velocities(made: Against) -> None:
    """The velocities at the start: those of a striker alone."""
    row, scene = made.row, made.scene
    if scene.piston is not None:
        return  # its motion is not known from the text
    if row is None:
        made.not_known("velocities at the start")
        return
    backwards = made.chain.row is not None and made.chain.row.ids != row.ids
    sign = -1 if backwards else 1
    for k, velocity in enumerate(row.velocity):
        along = velocity[row.axis]
        expected = scene.start_velocity / made.velocity if k == 0 else 0.0
        if along is None:
            made.not_known("velocities at the start")
            return
        if differs(sign * along, expected):
            name = f"granule {row.ids[k]}"
            text = (
                f"{name} starts at {sign * along:.6g} towards the far end, in the scene at"
                f" {expected:.6g}"
            )
            made.say("velocity", made.by("velocity", k), text, sign * along, expected)
            return


def _gravity(made: Against) -> None:
    """Gravity along the chain."""
    chain, row, scene = made.chain, made.row, made.scene
    gravities = chain.gravities
    if gravities is None or row is None:
        made.not_known("gravity")
        return
    backwards = chain.row is not None and chain.row.ids != row.ids
    found = sum(one.along[row.axis] for one in gravities) * (-1 if backwards else 1)
    pressed = scene.precompression
    expected = (0.0 if pressed is None else pressed.gravity) / made.scale.acceleration
    if abs(found - expected) > CLOSE * max(abs(found), abs(expected)):
        command = gravities[0].command if gravities else None
        text = f"gravity is {found:.6g} towards the far end, in the scene it is {expected:.6g}"
        made.say("gravity", command, text, found, expected)


def _steps(made: Against) -> None:
    """The step against the contacts of the scene, and the end of the last run."""
    chain, scene = made.chain, made.scene
    runs = moving_runs(chain)
    known = [run for run in runs if run.dt is not None]
    if len(known) != len(runs) or not runs:
        made.not_known("time step")
    else:
        longest = max(known, key=lambda run: run.dt or 0.0)
        steps = [c for c in chain.named("timestep") if c.place < longest.command.place]
        step, unit = (longest.dt or 0.0) * made.time, scene.contact_time
        springs = chain.springs
        of_deck = None
        if springs is not None and chain.masses:
            of_deck = stability.longest_step(chain.masses, springs[0])
        if step > _ACCURATE * unit and of_deck is None:
            # Where the deck's own numbers say how long a step may be, ``step-length`` has said it.
            text = (
                f"the step {longest.dt:.3g} is {step / unit:.2g} natural time units of the scene"
                f" ({unit / made.time:.3g}): above {_STABLE:.2f} granules fly apart, 0.02 gives"
                " peaks right to about 1e-4"
            )
            where = steps[-1] if steps else longest.command
            severity = "error" if step > _STABLE * unit else "warning"
            made.say("step", where, text, longest.dt, 0.02 * unit / made.time, severity)  # type: ignore[arg-type]
    end = runs[-1].end if runs else None
    if end is None:
        made.not_known("end time")
    elif end * made.time < (1 - CLOSE) * scene.end_time:
        expected = scene.end_time / made.time
        text = (
            f"the last run ends at {end:.6g}, the scene at {expected:.6g}: peaks that come later"
            " are missing; take more steps"
        )
        made.say("end", runs[-1].command, text, end, expected, "warning")


CHECKS: tuple[Check, ...] = (
    granules, places, contacts, _forces, _velocities, _gravity, _steps,
)  # fmt: skip


def against_scene(chain: Chain, scene: Scene) -> list[Finding]:
    """What differs between a deck and a scene; one note says what is not known."""
    return against(chain, scene, CHECKS)
