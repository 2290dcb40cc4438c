"""The numbers of a deck against those of a scene: one table of probes, and one rule for all."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray, Quantity, apart
from hertzchain.engines.lammps.reading.deck import UNITS, FoundFix
from hertzchain.engines.lammps.reading.probing import QUIET
from hertzchain.engines.native.plan import METHODS
from hertzchain.examiner.correct import wall_plane
from hertzchain.examiner.examined import (
    ACTS,
    DIGITS,
    EXAMINED,
    NUMBER,
    SAME,
    Case,
    DeckCheck,
    Indices,
    Pairs,
    commands_of,
    formula_of,
    is_of,
    key_of,
    place,
    place_at,
    values,
    with_numbers,
)
from hertzchain.examiner.measured import (
    EXPONENT,
    ROUND_OFF,
    applied_force,
    change_of_peaks,
    constant_force,
    dampers,
    damping_of,
    displacement,
    far_wall,
    law_of,
    length,
    places,
    stretches_of,
)
from hertzchain.observables.error_bound import stable_step
from hertzchain.scene.chain import granule_mass
from hertzchain.slips import near, slips_of

HARMLESS = 0.1  # of the tolerance: what changes no peak by more gets a remark (chosen)
_PROFILE_MISFIT = 1e-3  # fraction of the largest force: another size, but the same profile (chosen)
_BENT = 0.01  # of the force at other overlaps than the largest expected (chosen)
_LATE = 0.02  # fraction of the largest: late collisions amplify differences of digits (chosen)
_MISSED = 0.1  # fraction of the largest overlap: contacts that act later are missed (chosen)
_UNMIXED_SINCE = "2023"  # older LAMMPS mixes E and nu of a wall with themselves (measured: 2022)


@dataclass(frozen=True, eq=False)
class Number:
    """A number of a deck, that of the scene, and explanations of a difference."""

    measured: float  # of the deck
    expected: float  # of the scene
    room: float = 0.0  # largest difference of round-off, in the unit; negative if all differ
    # Relative difference that counts as one of digits; None if it must be harmless.
    digits: float | None = None
    # Numbers of the twin that the deck's replace: the change of its peaks is the effect.
    twin: Mapping[str, Any] | None = None
    effect: float | None = None  # without such numbers; by default that of all
    # Pairs of the wrong and the right number as a line may contain them, in the deck's units.
    stands: Pairs = ()
    at: int | None = None  # the command that LAMMPS shows to act
    guess: int | None = None  # one of several that may act
    command: str = ""  # the right command, if it contains no number
    name: str = ""  # these five: if not those of the probe
    unit: str | None = None
    role: str = ""
    reason: str = ""
    sentence: str = ""
    note: str = ""  # words behind both numbers

    @property
    def differs(self) -> bool:
        """Whether the difference is above round-off."""
        is_same = self.measured == self.expected and self.room >= 0
        return not (is_same or abs(self.measured - self.expected) <= self.room)


@dataclass(frozen=True)
class Probe:
    """One number of a deck."""

    name: str  # what is compared
    unit: str
    role: str  # commands that set and correct it: a key of ``ROLES``
    compare: Callable[[Case], Iterable[Number]]  # empty if it does not apply
    reason: str = ""  # why no difference is allowed, or what is compared


def checks_of(case: Case, probe: Probe) -> list[DeckCheck]:
    """The checks of a probe: one for each difference, or one if there is none."""
    numbers = [*probe.compare(case)]
    differing = [number for number in numbers if number.differs]
    return [_check(case, probe, number) for number in differing or numbers[:1]]


def _check(case: Case, probe: Probe, number: Number) -> DeckCheck:
    measured, expected = (_plain(each) for each in (number.measured, number.expected))
    room = None if math.isinf(number.room) else float(max(number.room, 0.0))
    if not number.differs:
        return DeckCheck(probe.name, probe.unit, measured, expected, number.effect or 0.0, True,
                         False, f"{probe.name} is as in the scene",
                         probe.reason or case.reason(1.0), room=room)  # fmt: skip
    effect, digits, role = number.effect, number.digits, number.role or probe.role
    if number.twin is not None:
        effect = 0.0 if case.exact else case.effect(**number.twin)
    elif effect is None:
        effect = case.whole_effect
    reason = number.reason or (probe.reason if digits is None else case.reason(digits))
    if digits is None:
        passed = effect <= HARMLESS * case.tolerance and not case.exact and not case.strict
    else:
        passed = effect <= case.tolerance and abs(digits) <= DIGITS * case.tolerance
    name, unit = number.name or probe.name, probe.unit if number.unit is None else number.unit
    at = number.guess if number.at is None else number.at
    lines = with_numbers(case.deck, role, number.stands, at)
    return DeckCheck(
        name, unit, measured, expected, effect, bool(passed), True,
        number.sentence or f"{name} {values(measured, expected, unit)}{number.note}", reason,
        lines[0][0] if lines else place(case.deck, role, at), "" if lines else number.command,
        role=role, room=room,
        is_sure=bool(lines) or number.at is not None or _is_only(case, role),
        corrections=tuple({key_of(line): (right,)} for line, right in lines),
    )  # fmt: skip


def _is_only(case: Case, role: str) -> bool:
    """Whether one line of a deck alone can set a number; any command can disturb the motion."""
    commands = [case.deck.commands[k] for k in commands_of(case.deck, role)]
    return role != "motion" and len({(command.file, command.line) for command in commands}) == 1


def _plain(number: Any) -> Any:
    """Return a Python number from NumPy's."""
    return number.item() if isinstance(number, np.generic) else number


def _off(measured: FloatArray, expected: FloatArray, scale: Quantity) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(measured == expected, 0.0, (measured - expected) / scale)


def _most(
    measured: FloatArray, expected: FloatArray, scale: Quantity = 1.0, room: Quantity = 0.0
) -> tuple[int, Indices]:
    """The index of the largest difference over a scale, and those of all above round-off."""
    off = np.nan_to_num(np.abs(_off(measured, expected, scale)), nan=np.inf)
    differs = np.flatnonzero(off > room)
    k = int(differs[np.argmax(off[differs])]) if differs.size else int(np.argmax(off))
    return k, differs if differs.size else np.array([k])


def _groups(
    measured: FloatArray, expected: FloatArray, scale: Quantity, room: Quantity
) -> Iterator[tuple[int, Indices]]:
    """Equal differences over a scale: the index of the first of them, and the indices of all."""
    off = _off(measured, expected, scale)
    size = np.nan_to_num(np.abs(off), nan=np.inf)
    left, count = np.flatnonzero(size > room), 0
    if off.size and not left.size:
        yield int(np.argmax(size)), left
    while left.size:
        most = off[left[np.argmax(size[left])]]
        alike = np.isclose(off[left], most, rtol=1e-2, atol=0) | ~np.isfinite(off[left])
        count += 1
        # Most groups of equal differences with a remark each (chosen)
        part = left[alike] if count < 3 else left
        # Relative difference up to which the first of equal differences is shown (chosen)
        k = part[np.argmax(size[part] >= (1 - 1e-6) * np.max(size[part]))]
        yield int(k), part
        left = left[~alike] if count < 3 else left[:0]


def _both(measured: FloatArray, expected: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The granules or contacts that deck and scene both have."""
    count = min(len(measured), len(expected))
    return measured[:count], expected[:count]


def _with(numbers: FloatArray, at: slice | int | Indices, new: Quantity) -> FloatArray:
    """Return a copy of numbers with other values at some places."""
    changed = np.array(numbers)
    changed[at] = new
    return changed


# ---- Granules before anything moves


def _count(case: Case) -> Iterator[Number]:
    walls, size, wanted = case.scene.first_granule, case.deck.radius.size, case.scene.bodies
    pairs = [(size, wanted), *[(size - 1, wanted - 1)] * (size - 1 != wanted)]
    yield Number(size - walls, wanted - walls, effect=math.inf, stands=pairs)


def _radius(case: Case) -> Iterator[Number]:
    measured, expected = _both(case.deck.radius, case.scene.granules.radius)
    unit, room, (line, right) = case.units.length, case.least(ROUND_OFF), _other_units(case)
    differs = np.flatnonzero(measured != expected)
    mass = _with(case.twin.mass, differs, case.deck.mass[differs])
    for k, alike in _groups(measured, expected, expected, room):
        opening = np.array(case.twin.opening)
        for granule in alike:  # smaller granules no longer touch
            opening[max(granule - 1, 0) : granule + 1] += expected[granule] - measured[granule]
        old, new = measured[k] / unit, expected[k] / unit
        yield Number(
            measured[k], expected[k], room * expected[k], measured[k] / expected[k] - 1,
            {"mass": mass, "opening": opening}, at=line, command=right,
            stands=[(2 * old, 2 * new), (old, new)] if line is None else (),
            name=f"radius of {case.granule_name(alike)}",
        )  # fmt: skip


def _other_units(case: Case) -> tuple[int | None, str]:
    """The command of the units and the right one, if all lengths are in another unit."""
    both = [_both(case.deck.radius, case.scene.granules.radius),
            _both(case.deck.position, case.scene.granules.position)]  # fmt: skip
    for index, command in enumerate(case.deck.commands):
        words = command.text.split()
        for name, other in UNITS.items() if words[:1] == ["units"] and words[1] in UNITS else ():
            factor = other.length / case.units.length
            # Lengths in other units are off by 100 or more (chosen).
            fits = [np.allclose(measured * factor, right, 0.1, 0.1 * right[-1])
                    for measured, right in both]  # fmt: skip
            if factor != 1 and all(fits):
                return index, f"units {name}"
    return None, ""


def _mass(case: Case) -> Iterator[Number]:
    """Masses, where a wrong radius does not explain them."""
    granules, units, room = case.scene.granules, case.units, case.least(ROUND_OFF)
    measured, expected = _both(case.deck.mass, granules.mass)
    held = np.isinf(expected)  # what nothing moves weighs nothing
    free = granule_mass(granules.radius, granules.density)[: held.size]
    measured, expected = (np.where(held, free, mass) for mass in (measured, expected))
    radius, of_scene = _both(case.deck.radius, granules.radius)
    fitting = expected * (radius / of_scene) ** 3
    explained = np.abs(measured / fitting - 1) <= case.least(1e-6)
    measured = np.where(explained, expected, measured)
    for k, alike in _groups(measured, expected, expected, room):
        old, new = float(measured[k]), float(expected[k])
        volume = 4 / 3 * math.pi * float(of_scene[k]) ** 3 * units.density
        early = old / units.mass / (math.pi / 6)  # LAMMPS makes granules with a diameter of 1
        yield Number(
            old, new, room * new, old / new - 1,
            {"mass": _with(case.twin.mass, alike, measured[alike])},
            stands=[(early, new / volume), (old / volume, new / volume),
                    (old / units.mass, new / units.mass)],
            name=f"mass of {case.granule_name(alike)}",
        )  # fmt: skip


def _place(case: Case) -> Iterator[Number]:
    """Places of granules: a generated chain begins at 0, others may begin anywhere."""
    if case.exact:
        begin = float(case.deck.origin @ case.deck.direction)
        measured, expected = _both(begin + case.deck.position, places(case.scene))
        k, _ = _most(measured, expected)
        yield Number(measured[k], expected[k], EXAMINED * length(case.scene))


def _distance(case: Case) -> Iterator[Number]:
    """Gaps and overlaps at the start, from the distance of neighbours."""
    position, of_scene = _both(case.deck.position, places(case.scene)[: case.scene.bodies])
    measured, expected = np.diff(position), np.diff(of_scene)
    size, unit, settles = measured.size, case.units.length, case.deck.before > 0
    if not size:
        return
    off, opening = measured - expected, np.array(case.twin.opening)
    opening[:size] += off
    room = QUIET * case.near[:size] + case.rounded
    k, alike = _most(measured, expected, room=room)
    most = alike[np.abs(off[alike]) >= 0.5 * np.max(np.abs(off[alike]))]
    kind, when = "a gap" if opening[k] > 0 else "an overlap", " when the shock begins" * settles
    first = 1 + int(np.argmax(np.abs(off) >= max(0.5 * abs(off[k]), case.rounded)))
    times = float(measured[k] / expected[k])  # not one that any 1 in a line may be
    pairs = [(measured[k] / unit, expected[k] / unit),
             (abs(float(position[first])) / unit, float(of_scene[first]) / unit),
             *[(times, 1.0)] * (abs(times - 1) > 2 * SAME)]  # fmt: skip
    yield Number(
        measured[k], expected[k], room[k], 0.0, {"opening": opening},
        name=f"distance of granules at {case.contact_name(most, size)}",
        sentence=f"distance of granules at {case.contact_name(k, size)}{when}"
        f" {values(measured[k], expected[k], 'm')}: {kind} of {abs(opening[k]):.3g} m,"
        f" which the shock presses by {case.near[k]:.2g} m",
        stands=() if settles else pairs,  # then the places stand in no line
        role="run" if settles else "", at=_settling(case) if settles else None,
    )  # fmt: skip


def _settling(case: Case) -> int:
    """The last run before the shock."""
    return max(k for k in commands_of(case.deck, "run") if k < case.deck.first_run)


_FROM_LAST = ", from the centre of the last granule"


def _wall_place(case: Case) -> Iterator[Number]:
    wall, scene = far_wall(case.deck), case.scene
    if scene.wall is None or wall is None or case.deck.position.size != scene.bodies:
        return
    expected = float(np.diff(places(scene))[-1])
    measured = wall.position - float(case.deck.position[-1])
    opening = _with(case.twin.opening, -1, case.twin.opening[-1] + measured - expected)
    plane, further = wall_plane(case), (measured - expected) / case.units.length
    room = case.least(QUIET) * case.near[-1] + case.rounded
    pairs = [(plane + case.sign * further, plane)]
    yield Number(measured, expected, room, 0.0, {"opening": opening}, stands=pairs,
                 at=wall.command, note=_FROM_LAST)  # fmt: skip


def _tilt(case: Case, sideways: float) -> float:
    """Effect of granules off the axis on a peak: a contact that tilts by s / 2R loses overlap."""
    radius = float(np.min(case.scene.granules.radius))
    return 1.5 * sideways**2 / (4 * radius) / float(np.max(case.near))


def _off_axis(case: Case) -> Iterator[Number]:
    off = np.max(np.abs(case.deck.sideways - case.deck.sideways[0]), axis=1)
    k = int(np.argmax(off))
    room = case.least(ROUND_OFF) * case.scene.granules.radius[0]
    yield Number(
        off[k], 0.0, room, 0.0, effect=_tilt(case, float(off[k])),
        stands=[(off[k] / case.units.length, 0.0)], note=f", at {case.granule_name(k)}",
        reason="a contact that tilts by s / 2R loses s^2 / 4R of its overlap",
    )  # fmt: skip


def _fastest(case: Case) -> float:
    """Return the scale for differences of velocity [m/s]; 0 if an exact deck starts at rest."""
    largest = float(np.max(np.abs(case.twin.velocity)))
    return largest if case.exact else case.scene.units.velocity


def _velocity(case: Case) -> Iterator[Number]:
    """Velocities at the start: those of moving granules or a striker, otherwise 0."""
    measured, expected = _both(case.deck.velocity[:, 0], case.twin.velocity)
    if case.scene.piston is not None:  # a fix prescribes its motion
        expected = np.append(measured[:1], expected[1:])
    unit, (k, _) = case.units.velocity, _most(measured, expected)
    settles = case.deck.before > 0 and not np.any(expected)
    yield Number(
        measured[k], expected[k], case.least(ROUND_OFF) * _fastest(case),
        measured[k] / expected[k] - 1 if expected[k] != 0 else None,
        {"velocity": np.append(measured, case.twin.velocity[measured.size :])},
        stands=[(abs(measured[k]) / unit, abs(expected[k]) / unit)],
        name=f"velocity of {case.granule_name(k)} at the start",
        role="run" if settles else "", at=_settling(case) if settles else None,
    )  # fmt: skip


def _velocity_across(case: Case) -> Iterator[Number]:
    side = float(np.max(np.abs(case.deck.velocity[:, 1:]), initial=0.0))
    radius = float(np.min(case.scene.granules.radius))
    tilt = _tilt(case, min(side * case.deck.end_time, radius))  # at the end: peaks come before
    yield Number(side, 0.0, case.least(ROUND_OFF) * _fastest(case),
                 effect=min(tilt, case.whole_effect),
                 stands=[(side / case.units.velocity, 0.0)])  # fmt: skip


def _spin(case: Case) -> Iterator[Number]:
    spin = float(np.max(np.abs(case.deck.spin), initial=0.0))
    room = case.least(ROUND_OFF) * _fastest(case) / float(np.max(case.scene.granules.radius))
    yield Number(spin, 0.0, room, stands=[(spin * case.units.time, 0.0)])


# ---- Contacts


def is_tried(case: Case) -> bool:
    """Whether any contact of a deck was probed."""
    deck = case.deck
    if case.exact:
        tried = np.isfinite([*deck.contact_force, *deck.damped_force])
        return bool(np.all(tried) and np.all(np.isfinite(deck.tangential_force)))
    is_alone = deck.contact_force.size == 0  # a single granule, whose walls are probed
    return bool(case.laws) and (is_alone or bool(np.any(np.isfinite(deck.contact_force))))


def _untried(case: Case) -> Iterator[Number]:
    if case.laws:
        yield Number(math.nan, math.nan, effect=case.whole_effect,
                     sentence="LAMMPS stopped while the contacts were probed")  # fmt: skip


def _role(case: Case, k: int) -> str:
    """The commands that set the force of a contact, as a key of ``ROLES``."""
    return "wall" if case.is_wall(np.array([k])) else "contacts"


def _rounding(case: Case) -> FloatArray:
    """Return the relative rounding error of each contact force at its largest overlap."""
    return np.array([float(case.rounding(k, case.near[k])) for k in range(len(case.laws))])


def _missing(case: Case) -> Iterator[Number]:
    missing = np.flatnonzero([law.is_missing for law in case.laws])
    if missing.size:
        yield Number(
            0.0, case.scene.granules.stiffness[missing[0]], role=_role(case, missing[0]),
            twin={"stiffness": _with(case.twin.stiffness, missing, 0.0)},
            name=f"force of {case.contact_name(missing)}",
        )  # fmt: skip


def _exponent(case: Case) -> Iterator[Number]:
    exponent = np.array([1.5 if law.is_missing else law.exponent for law in case.laws])
    stiffness = np.array([law.stiffness for law in case.laws])
    room = 3 * _rounding(case) if case.exact else np.full(exponent.size, EXPONENT)
    for k, alike in _groups(exponent, np.full(exponent.size, 1.5), 1.0, room):
        yield Number(
            exponent[k], 1.5, room[k], role=_role(case, k),
            twin={"exponent": _with(case.twin.exponent, alike, exponent[alike]),
                  "stiffness": _with(case.twin.stiffness, alike, stiffness[alike])},
            name=f"exponent of {case.contact_name(alike)}",
        )  # fmt: skip


def _stiffness(case: Case) -> Iterator[Number]:
    expected = case.scene.granules.stiffness[: len(case.laws)]
    ratio, room = np.array([law.ratio for law in case.laws]), _rounding(case)
    wrong = np.array([law.is_missing or law.is_bent for law in case.laws])
    right = wrong | (np.abs(ratio * _by_radius(case) - 1) <= room)
    measured = np.where(right, expected, ratio * expected)
    for k, alike in _groups(measured, expected, expected, room):
        times = f"{ratio[k]:.4g} times"
        if times == "1 times":
            times = f"{abs(ratio[k] - 1):.1e} {'less' if ratio[k] < 1 else 'more'}"
        slip = _slip(case, case.contact_name(k), float(ratio[k]))
        yield Number(
            measured[k], expected[k], room[k] * expected[k], ratio[k] - 1,
            {"stiffness": _with(case.twin.stiffness, alike, (expected * ratio)[alike])},
            stands=_moduli(case, k, float(ratio[k])), role=_role(case, k),
            name=f"stiffness of {case.contact_name(alike)}", note=f" ({times}{slip})",
        )  # fmt: skip


def _moduli(case: Case, k: int, ratio: float) -> Pairs:
    """Numbers that alone make a contact so many times too stiff: its modulus, E or nu."""
    granules, unit = case.scene.granules, case.units.pressure
    softness = 1 / case.reduced_modulus(k)
    pairs = [(4 / 3 * ratio / softness / unit, 4 / 3 / softness / unit)] if ratio > 0 else []
    for granule in range(k, min(k + 2, granules.mass.size)) if ratio > 0 else ():
        modulus = float(granules.young_modulus[granule])
        poisson = float(granules.poisson_ratio[granule])
        of_granule = (1 - poisson**2) / modulus
        # Of all like granules, or of this one.
        for wrong in (of_granule / ratio, of_granule + softness / ratio - softness):
            if wrong > 0:
                pairs.append(((1 - poisson**2) / wrong / unit, modulus / unit))
            if 0 < wrong * modulus < 1:
                pairs.append((math.sqrt(1 - wrong * modulus), poisson))
    return pairs


def _by_radius(case: Case) -> FloatArray:
    """Factors that remove wrong radii from stiffnesses, as radii have checks of their own."""

    def effective(radius: FloatArray) -> FloatArray:
        return np.asarray(radius[:-1] * radius[1:] / (radius[:-1] + radius[1:]))

    right, measured = _both(effective(case.scene.granules.radius), effective(case.deck.radius))
    factor = np.ones(len(case.laws))
    count = min(factor.size, right.size)
    factor[:count] = np.sqrt(right / measured)[:count]
    fits = [law.ratios.size > 0 and abs(law.ratios[0] * f - 1) < 1e-6
            for law, f in zip(case.laws, factor, strict=True)]  # fmt: skip
    return np.where(fits, factor, 1.0)


def _slip(case: Case, who: str, ratio: float) -> str:
    """The usual slip that makes a stiffness too large by a ratio, in words."""
    slips = slips_of(case.scene, "stiffness")
    if who == "the wall" and case.deck.version < _UNMIXED_SINCE:
        text = "for a wall of hertz/material: give hertz and 4/3 of its effective modulus"
        nu = float(case.scene.granules.poisson_ratio[0])
        slips = {f"LAMMPS of {case.deck.version[:4]} takes E/(2(1-nu)) {text}": 1 + nu}
    names = near(slips, ratio)
    return f": {' or '.join(names)}" if names else ""


def _elsewhere(case: Case) -> Iterator[Number]:
    """Forces that follow Hertz's law at the largest overlap, but not at all others."""
    laws, count = case.laws, len(case.laws)
    room = _rounding(case) if case.exact else np.full(count, DIGITS * case.tolerance)
    ratio = np.array([law.ratio for law in laws])
    bent = [law.is_missing or law.is_bent for law in laws]
    if np.any(bent | (np.abs(ratio * _by_radius(case) - 1) > room)):
        return
    farthest, allowed = np.ones(count), np.full(count, _BENT)
    for k, law in enumerate(laws):
        if law.ratios.size:
            forces = law.ratios / (1.0 if case.exact else law.ratio)
            each = case.rounding(k, law.overlap) if case.exact else np.full(forces.size, _BENT)
            worst = int(np.argmax(np.abs(forces - 1) / each))
            farthest[k], allowed[k] = forces[worst], each[worst]
    if np.all(np.abs(farthest - 1) <= allowed):
        return
    k, alike = _most(farthest, np.ones(count), room=allowed)
    yield Number(
        farthest[k], 1.0, allowed[k], role=_role(case, k),
        name=f"force of {case.contact_name(alike[:1])} at other overlaps",
        sentence=f"the force of {case.contact_name(k)} is {farthest[k]:.3g} times"
        " Hertz's at one of the overlaps that were tried, and Hertz's at another: a cutoff, a limit"
        " or another force acts", reason=f"chosen: {_BENT:g} of the force",
    )  # fmt: skip


def _image(case: Case) -> Iterator[Number]:
    """Granules at the ends that touch through a periodic boundary."""
    if case.deck.image_gap is not None:  # the motion shows the effect of an image that is not near
        room = case.least(QUIET) * case.scene.units.force
        yield Number(case.deck.image_force, 0.0, room, effect=math.inf)


_PLANE = re.compile(r"fix\s+\S+\s+\S+\s+wall/.*\s([xyz])plane\s+(\S+)\s+(\S+)")


def _wall(case: Case) -> Iterator[Number]:
    """A wall that is missing, or that the last granule does not meet when it is pushed."""
    scene, deck, is_there = case.scene, case.deck, far_wall(case.deck) is not None
    if scene.wall is None:
        return
    kind = f"the scene has one of the kind {scene.wall.kind!r}"
    missing = Number(
        int(is_there), 1, twin={"stiffness": _with(case.twin.stiffness, -1, 0.0)},
        sentence=f"the deck has no wall that pushes the last granule, {kind}",
    )  # fmt: skip
    for index, command in enumerate(() if is_there else deck.commands):
        plane = _PLANE.match(command.text)
        if not command.carried_out or plane is None or plane[1] != deck.axis:
            continue
        origin, last = deck.origin[case.along], float(scene.granules.position[-1])
        expected = float(scene.granules.radius[-1] + case.twin.opening[-1])
        surfaces = [
            (float(word) * case.units.length - origin) * case.sign - last
            for word in plane.groups()[1:] if NUMBER.fullmatch(word)
        ]  # fmt: skip
        measured = min(surfaces, key=lambda surface: abs(surface - expected), default=math.nan)
        missing = replace(missing, at=index)
        if abs(measured - expected) > QUIET * case.near[-1] + case.rounded:
            missing = Number(measured, expected, name="place of the wall", unit="m", at=index,
                             reason=case.reason(0.0), note=_FROM_LAST)  # fmt: skip
        if math.isfinite(measured):
            break
    yield missing


def _extra_walls(case: Case) -> Iterator[Number]:
    """Walls that the scene does not have: they count if a granule reaches them."""
    deck, twin = case.deck, case.twin
    for wall in deck.walls:
        is_last = wall.end == "last"
        if is_last and case.scene.wall is not None:
            continue
        end, way = (-1, case.expected.forwards) if is_last else (0, case.expected.backwards)
        gap = abs(wall.position - float(deck.position[end])) - float(deck.radius[end])
        changes: dict[str, Any] = {}
        if is_last:
            law = law_of(wall.overlap, wall.force, float(twin.stiffness[-1]), float(case.near[-1]))
            more = {"stiffness": law.stiffness, "exponent": law.exponent, "opening": gap,
                    "damping": 0}  # fmt: skip
            changes = {name: np.append(getattr(twin, name), new) for name, new in more.items()}
        side = "far end" if is_last else "end where the shock acts"
        yield Number(
            int(way >= gap), 0, twin=changes, at=wall.command, name=f"wall at the {side}",
            sentence=f"the deck has a wall at the {side}, {gap:.3g} m from the granule, which moves"
            f" {way:.3g} m towards it; the scene has none",
        )  # fmt: skip


# ---- Damping and friction


def _damping(case: Case) -> Iterator[Number]:
    """Damping of approaching and parting granules: the force added to a law of one power."""
    each = dampers(case.deck, case.scene)
    if [*_elsewhere(case)] or not any(damper.added.size for damper in each):
        return
    contact = np.concatenate([np.full(damper.added.size, k) for k, damper in enumerate(each)])
    added, expected, elastic, closing = (
        np.concatenate([getattr(damper, name) for damper in each])
        for name in ("added", "expected", "elastic", "closing")
    )
    share = [2 * case.rounding(k, damper.overlap) if case.exact else 0 * damper.added + QUIET
             for k, damper in enumerate(each)]  # fmt: skip
    room = np.concatenate(share) * np.maximum(elastic, np.abs(expected))
    with np.errstate(divide="ignore", invalid="ignore"):
        times = np.nan_to_num(np.abs(added - expected) / room, nan=0.0, posinf=np.inf)
    approach = np.where(closing > 0, times, 0.0)
    # Parting granules also show limits.
    # Rounding errors above which damping is wrong (chosen)
    k = int(np.argmax(approach if np.max(approach) > 1e4 else times))
    how, pulls = "approach" if closing[k] > 0 else "part", added[k] < -elastic[k]
    digits = (added[k] - expected[k]) / max(abs(expected[k]), 1e-300)
    yield Number(
        added[k], expected[k], room[k], None if case.scene.contact is None else digits,
        damping_of(case.deck, case.scene), role=_role(case, int(contact[k])),
        name=f"damping of {case.contact_name(int(contact[k]))}",
        note=f", where granules {how} with {abs(closing[k]):.3g} m/s and the elastic force is"
        f" {elastic[k]:.3g} N{': the contact pulls' * bool(pulls)}",
    )  # fmt: skip


def _friction(case: Case) -> Iterator[Number]:
    """Sideways forces and torques over radius when granules spin: the scene has none."""
    sideways = float(np.nanmax(np.abs(case.deck.tangential_force), initial=0.0))
    force, at, role = float(np.min(case.twin.stiffness * case.near**1.5)), None, ""
    for wall in case.deck.walls:
        if wall.tangential_force > sideways:
            sideways, at, role = wall.tangential_force, wall.command, "wall"
    yield Number(sideways, 0.0, case.least(QUIET) * force, at=at, role=role,
                 note=", sideways, where granules spin")  # fmt: skip


# ---- Loads and other forces


def _least_force(case: Case) -> float:
    """Least force that is not round-off [N]."""
    return case.least(ROUND_OFF) * case.scene.units.force


def _last_fix(case: Case, wanted: Callable[[FoundFix], bool]) -> int | None:
    """The command of the last of the wanted fixes that pushes."""
    fixes = [fix.command for fix in case.deck.fixes if not fix.moves and wanted(fix)]
    return fixes[-1] if fixes else None


def _constant(case: Case) -> Iterator[Number]:
    """Gravity and static loads."""
    deck, units = case.deck, case.units
    count = min(deck.mass.size, case.twin.mass.size)
    measured = deck.constant_force[:count, 0] + 0.0  # no -0
    expected, least = constant_force(case.scene)[:count], _least_force(case)
    held = np.isinf(case.scene.granules.mass[:count])  # no force moves these granules
    expected[held] = measured[held]
    k, alike = _most(measured, expected, room=least)
    largest, per_mass = float(np.max(np.abs(expected))), measured / deck.mass[:count]
    falls = 0.0 if case.scene.precompression is None else case.scene.precompression.gravity
    is_right = math.isclose(per_mass[0], falls, rel_tol=1e-6)  # then a load is missing
    gravity = bool(np.allclose(per_mass, per_mass[0], rtol=1e-6) and not is_right)
    missing = not np.any(measured) or (falls and is_right)
    pairs, at = [(abs(measured[k]) / units.force, abs(expected[k]) / units.force)], None
    if gravity:
        pairs.insert(0, (abs(float(per_mass[0])) / units.acceleration, falls / units.acceleration))
    falling = commands_of(deck, "gravity")
    if missing:
        at = deck.first_run
    elif gravity and falling and measured[k]:
        at = falling[-1]
    elif measured[k]:
        at = _last_fix(case, lambda fix: bool(fix.largest[k, 0] > least)
                       and not case.is_of_time(fix.command))  # fmt: skip
    yield Number(
        measured[k], expected[k], least, (measured - expected)[k] / largest if largest else None,
        {"constant_force": _with(case.twin.constant_force, slice(count), measured)},
        stands=() if missing or not largest else pairs, guess=at,
        name=f"constant force on {case.granule_name(alike)}",
    )  # fmt: skip


def _constant_across(case: Case) -> Iterator[Number]:
    across, least = case.deck.constant_force[:, 1:], _least_force(case)
    at = _last_fix(case, lambda fix: bool(np.max(fix.largest[:, 1]) > least))
    yield Number(float(np.max(np.abs(across), initial=0.0)), 0.0, least, guess=at)


def _shows_in_motion(case: Case, fix: FoundFix) -> tuple[Indices, Indices]:
    """Granules on which a fix exerts a force only in motion, along and across the chain."""
    # Readings of one force at other times differ by less (chosen)
    more = fix.largest_in_motion > 1.1 * fix.largest + ACTS * case.scene.units.force
    more[:, 0] &= ~case.deck.driven  # a force does not move these, nor fixed ones
    fixed = case.scene.granules.fixed
    more[fixed[fixed < len(more)], 0] = False
    return np.flatnonzero(more[:, 0]), np.flatnonzero(more[:, 1])


def _drags(case: Case, fix: FoundFix) -> bool:
    """Whether a fix may drag granules: a fix for drag, or a formula of velocities."""
    return fix.style == "addforce" or is_of(case.deck, fix.command, "drag")


def _drag(case: Case) -> Iterator[Number]:
    drag = np.nan_to_num(case.deck.drag) + 0.0  # no -0
    count = case.twin.drag.size
    whole = np.append(drag[:count], np.zeros(max(0, count - drag.size)))
    at = _last_fix(case, lambda fix: _drags(case, fix) and _shows_in_motion(case, fix)[0].size > 0)
    room = _least_force(case) / case.scene.units.velocity
    yield Number(drag[np.argmax(np.abs(drag))], 0.0, room, twin={"drag": whole}, guess=at)


def _random(case: Case) -> Iterator[Number]:
    """Random forces: no run repeats another."""
    fixes = [k for k in commands_of(case.deck, "random")
             if case.deck.commands[k].text.startswith("fix")]  # fmt: skip
    if fixes:
        what = " ".join(case.deck.commands[fixes[0]].text.split()[:4])
        sentence = f"{what} changes velocities by more than the forces of the scene"
        yield Number(len(fixes), 0, effect=case.whole_effect, at=fixes[0], sentence=sentence)


def _in_motion(case: Case) -> Iterator[Number]:
    """Fixes that push only in motion, not at rest."""
    walls, least = {wall.command for wall in case.deck.walls}, ACTS * case.scene.units.force
    drag = np.max(np.abs(np.nan_to_num(case.deck.drag)))
    dragged = drag > _least_force(case) / case.scene.units.velocity
    for fix in case.deck.fixes:
        is_reported = fix.command in walls or is_of(case.deck, fix.command, "random")
        if fix.moves or is_reported or (dragged and _drags(case, fix)):
            continue
        ways = zip(("along", "across"), _shows_in_motion(case, fix), strict=True)
        for column, (way, granules) in enumerate(ways):
            if not granules.size:
                continue
            most = int(granules[np.argmax(fix.largest_in_motion[granules, column])])
            force, at_rest = fix.largest_in_motion[most, column], fix.largest[most, column]
            # Forces of walls at rest are not kept.
            rest = f", and {f'{at_rest:.3g} N' if at_rest > least else 'none'} at rest"
            yield Number(
                force, 0.0, at=fix.command, name=f"force of fix {fix.style} {way} the chain",
                sentence=f"fix {fix.style} exerts up to {force:.3g} N {way} the chain on"
                f" {case.granule_name(most)} in motion{rest * (fix.style[:4] != 'wall')}; the"
                " scene has no such force",
            )  # fmt: skip


# ---- The shock


def _of_shock(case: Case, number: Number) -> Number:
    """Return a number of the shock at its fix or, without a number in that, at its formula."""
    deck, least = case.deck, ACTS * case.scene.units.force
    at = _last_fix(case, lambda fix: float(np.max(fix.largest, initial=0.0)) > least
                   and "wall" not in fix.style and fix.style != "gravity")  # fmt: skip
    if not number.stands:
        where = place(deck, "shock", at)
        at = None if where is None else formula_of(deck, where).index
    return replace(number, guess=at)


def _across(case: Case) -> Iterator[Number]:
    room = case.least(ACTS) * case.scene.units.force
    if case.deck.applied_sideways > room:
        yield _of_shock(case, Number(case.deck.applied_sideways, 0.0, room))


def _pushed(case: Case) -> tuple[FloatArray, Indices, float]:
    """Largest force on each granule [N], pushed ones other than the scene's, and the least."""
    largest = np.max(np.abs(case.deck.applied_force), axis=0, initial=0.0)
    least = case.least(ACTS) * case.scene.units.force
    at = np.flatnonzero(largest > least)
    return largest, at[at != case.scene.pushed], least


def _others(case: Case) -> Iterator[Number]:
    """Forces on granules that the scene does not push."""
    largest, others, least = _pushed(case)
    if not case.scene.ramps or not others.size:
        return
    who, right = case.granule_name(others), case.granule_name(case.scene.pushed)
    too = largest.size > case.scene.pushed and largest[case.scene.pushed] > least
    sentence = f"the applied force acts on {who} and not on {right}, the scene's"
    twin: dict[str, Any] | None = None
    if too:
        sentence = (f"the applied force acts on {right} and on {who}, too, with up to"
                    f" {np.max(largest[others]):.4g} N; the scene pushes {right}")  # fmt: skip
        extra = _pushing(case, others)
        both = tuple(
            replace(stretch, applied=np.hstack([stretch.applied, more.applied]))
            for stretch, more in zip(case.stretches, extra["stretches"], strict=True)
        )
        twin = {"pushed": np.append(case.twin.pushed, extra["pushed"]), "stretches": both}
    at = _last_fix(case, lambda fix: not fix.style.startswith("wall") and bool(
        np.max(fix.largest[others, 0], initial=0.0) > ACTS * case.scene.units.force))  # fmt: skip
    yield Number(int(others.size) + too, 1, -1.0, effect=1.0, sentence=sentence, role="pushed",
                 twin=twin, at=at)  # fmt: skip


def _pushing(case: Case, pushed: Indices) -> dict[str, Any]:
    """The deck's applied forces on some granules in place of the scene's."""
    pushed = pushed[pushed < case.twin.mass.size]
    return {"pushed": pushed, "stretches": stretches_of(case.deck, case.scene, case.start, pushed)}


def _shock(case: Case) -> Iterator[Number]:
    """The applied force over time on its granule; also if it is missing, or not in the scene."""
    scene, (largest, others, least) = case.scene, _pushed(case)
    top = float(np.max(largest, initial=0.0))
    if scene.ramps and largest.size > scene.pushed and largest[scene.pushed] > least:
        yield _pulse(case)
    elif scene.ramps and not others.size and case.deck.applied_sideways <= least:
        name = f"applied force on {case.granule_name(scene.pushed)}"
        yield _of_shock(case, Number(top, scene.peak_force, -1.0, effect=1.0, name=name))
    elif not scene.ramps and (top > least or case.exact):
        changes = _pushing(case, np.flatnonzero(largest > 0))
        yield _of_shock(case, Number(top, 0.0, least, twin=changes))


def _pulse(case: Case) -> Number:
    """The force over time on the granule that the scene pushes."""
    deck, scene = case.deck, case.scene
    time, force = deck.applied_time - case.start, deck.applied_force[:, scene.pushed]
    # Readings at a jump, or within rounding of a corner, are not compared.
    late = len(deck.runs) * math.ulp(scene.pulse_end)  # times are sums of steps, leg by leg
    moved = 4 * len(deck.runs) * math.ulp(scene.end_time)
    if not case.exact:
        moved = 1e-6 * deck.runs[0].dt
    steepest = max(
        math.pi / 2 * abs(ramp.end_force - ramp.start_force) / (ramp.end - ramp.start)
        for ramp in scene.ramps
    )
    loads = float(np.max(np.abs(deck.constant_force)))
    # A force less a load is rounded by some units of the last digit (chosen).
    loads *= 8 * float(np.finfo(np.float64).eps)
    room = case.least(ACTS) * scene.peak_force + late * steepest + loads
    sides = np.array([applied_force(scene, time + shift) for shift in (-moved, 0.0, moved)])
    jumps, expected = np.ptp(sides, axis=0) > 100 * room + moved * steepest, sides[1]
    nearest = np.take_along_axis(sides, np.argmin(np.abs(sides - force), axis=0)[None], 0)[0]
    side = np.where(jumps, nearest, expected)
    k = int(np.argmax(np.abs(side - force)))
    if abs(side[k] - force[k]) <= room:
        return (Number(force[k], side[k], room) if case.exact
                else Number(float(np.max(force)), scene.peak_force, math.inf))  # fmt: skip
    held = _held(case, time, force)
    # The impulse decides on digits: it changes as much as the duration of the pulse.
    extra, whole = (
        float(np.diff(time) @ (each[1:] + each[:-1]))
        for each in (force - expected, np.abs(expected))
    )
    number = Number(
        force[k], expected[k], -1.0, 0.0 if held > 1 or whole == 0 else extra / whole,
        _pushing(case, case.twin.pushed), name="applied force over time",
        note=f" at {time[k]:.4g} s{f', held for {held} steps' * (held > 1)}",
    )  # fmt: skip
    share = float(force @ expected / (expected @ expected)) if np.any(expected) else 0.0
    alike = bool(np.max(np.abs(force - share * expected)) < _PROFILE_MISFIT * scene.peak_force)
    if held == 1 and alike and not case.exact:
        measured, right, unit = share * scene.peak_force, scene.peak_force, case.units.force
        pairs = [(measured * part / unit, right * part / unit)
                 for part in (1.0, 0.5) if measured > 0]  # fmt: skip
        number = replace(number, measured=measured, expected=right, stands=pairs, note="",
                         name="peak of the applied force")  # fmt: skip
    elif held == 1 and not case.exact and (stretch := _stretch(case, time, force)):
        times = [part * whole / case.units.time for whole in (scene.pulse_end, scene.rise_time)
                 if whole for part in (1.0, 0.5, 2.0)]  # fmt: skip
        pairs = [(stretch * each, each) for each in times]
        pairs += [(1 / wrong, 1 / right) for wrong, right in pairs]
        number = replace(number, stands=pairs)
    return _of_shock(case, number)


def _stretch(case: Case, time: FloatArray, force: FloatArray) -> float | None:
    """Return the duration of the deck's pulse over the scene's; None if it is another pulse."""

    def misfit(stretch: float) -> float:
        return float(np.max(np.abs(applied_force(case.scene, time / stretch) - force)))

    tried, best = np.geomspace(0.2, 5.0, 129), 1.0
    for _ in range(5):
        best = float(min(tried, key=misfit))
        tried = best * (tried[1] / tried[0]) ** np.linspace(-1, 1, 21)
    return best if misfit(best) < _PROFILE_MISFIT * case.scene.peak_force else None


def _held(case: Case, time: FloatArray, force: FloatArray) -> int:
    """Return for how many steps the force is held constant; 1 if it is not."""
    inside = (time > 0) & (time < case.scene.pulse_end)
    at, value = time[inside], force[inside]
    jumps = np.flatnonzero(np.abs(np.diff(value)) > 1e-9 * case.scene.peak_force)
    if jumps.size < 3 or jumps.size > 0.7 * (at.size - 1):
        return 1
    return max(1, round(float(np.median(np.diff(at[jumps + 1]))) / case.deck.runs[0].dt))


# ---- The piston


def _driven(case: Case) -> Iterator[Number]:
    """Granules with prescribed motion: only granule 1, and only in a scene with a piston."""
    led, wanted = np.flatnonzero(case.deck.driven), int(case.scene.piston is not None)
    right = "granule 1 alone" if wanted else "no granule"
    yield Number(
        led.size, wanted, 0.0 if np.array_equal(led, np.arange(wanted)) else -1.0, effect=math.inf,
        sentence=f"a fix drives {case.granule_name(led)}, whatever presses them; the scene drives"
        f" {right}", at=_leading(case) if led.size else None,
    )  # fmt: skip


def _leading(case: Case) -> int | None:
    """The command that prescribes the motion, or the command of its formula."""
    moving = [fix.command for fix in case.deck.fixes if fix.moves and "move" in fix.style]
    return formula_of(case.deck, place_at(case.deck, moving[-1])).index if moving else None


def _piston(case: Case) -> Iterator[Number]:
    deck, piston = case.deck, case.scene.piston
    only = np.array_equal(np.flatnonzero(deck.driven), [0])
    if piston is None or not deck.driven_time.size or not only:
        return
    time, measured = deck.driven_time - case.start, deck.driven_displacement
    expected, way = displacement(piston, time), piston.distance(case.scene.end_time)
    # A piston by fix setforce has its velocity from another command.
    moves = any(fix.style == "move" for fix in deck.fixes)
    room = case.least(ROUND_OFF) * (way + float(case.near[0])) + case.rounded
    k, _ = _most(measured, expected, room=room)
    pairs, by_table = [], piston.velocity is None
    if piston.velocity is not None and time[k] > 0:
        speed = float(measured[k] / time[k])
        pairs = [(speed / case.units.velocity, piston.velocity / case.units.velocity)]
    yield Number(
        measured[k], expected[k], room, (measured - expected)[k] / way, stands=pairs,
        twin={"stretches": stretches_of(deck, case.scene, case.start, use_driven=True)},
        note=f" at {time[k]:.4g} s", role="piston" if moves else "velocity",
        at=_leading(case) if by_table and moves else None,
    )  # fmt: skip


# ---- Steps, runs and motion


def _step(case: Case) -> Iterator[Number]:
    """The error of velocity Verlet at the deck's steps, with all numbers of the scene."""
    unit = case.units.time
    dt = max((run.dt for run in case.deck.runs), default=0.0)
    longest = stable_step(case.scene, METHODS["velocity-verlet"].interval)
    error = change_of_peaks(case.expected.peak_force, case.peaks, case.judged)
    unstable = dt >= longest
    right = _wanted_step(dt, longest, error, case)
    how = (
        f"above the longest stable one, {longest:.3g} s" if unstable
        else f"with which velocity Verlet is off by {error:.2g}"
    )  # fmt: skip
    yield Number(
        dt, right if unstable or error > case.tolerance else dt,
        effect=math.inf if unstable else error, stands=[(dt / unit, right / unit)],
        sentence=f"the time step is {dt:.4g} s, {how}", command=f"timestep {right / unit:.6g}",
    )  # fmt: skip


def _wanted_step(dt: float, longest: float, error: float, case: Case) -> float:
    """A step of two digits with the wanted accuracy, from one that is too long [s]."""
    order = 2 if case.scene.contact is None else 1
    if 0 < error < 0.5:  # none where no contact is judged, infinite where the motion diverges
        accurate = dt * (case.tolerance / error) ** (1 / order)
    else:
        # Error of velocity Verlet with a step of 1 in natural units, by its order (chosen)
        accurate = case.scene.units.time * (case.tolerance / 0.5) ** (1 / order)
    unit = case.units.time
    # Fraction of the longest step with the wanted accuracy: a rounder number fits below (chosen)
    wanted = min(longest / 4, dt / 2, 0.8 * accurate) / unit
    digits = 10 ** math.floor(math.log10(wanted))
    return float(math.floor(wanted / digits * 10) / 10 * digits * unit)


_SEEN = "peaks that come later than the deck's end cannot be judged"


def _end(case: Case) -> Iterator[Number]:
    """Whether the deck runs until the last peak of the scene."""
    deck = case.deck
    end, wanted = deck.end_time - case.start, case.scene.end_time
    late, ends = int(np.count_nonzero(~case.judged)), apart(end, wanted)
    have = "contact has" if late == 1 else "contacts have"
    which = f": {late} {have} not passed the peak by then" if late else ", after the last peak"
    last = deck.runs[-1] if deck.runs else None
    steps = [] if last is None else [
        (last.steps, math.ceil((wanted - end) / last.dt - 1e-6) + last.steps)
    ]  # fmt: skip
    yield Number(
        end, wanted, -1.0 if end < wanted * (1 - 1e-9) else math.inf,  # a step may miss by rounding
        None if late else 0.0, reason=_SEEN, effect=math.inf if late else 0.0,
        sentence=f"the deck ends {ends[0]} s after the shock begins, the scene {ends[1]} s{which}",
        at=None if last is None else last.command, stands=steps,
    )  # fmt: skip


def _integrators(case: Case) -> Iterator[Number]:
    """Each granule must be moved by exactly one fix, and fixed ones by none."""
    deck, fixed = case.deck, case.scene.granules.fixed
    moved = deck.integrated.astype(float)
    expected = np.ones(moved.size)
    expected[fixed[fixed < moved.size]] = 0
    k, wrong = _most(moved, expected)
    movers = [fix for fix in deck.fixes if fix.moves and (moved[k] == 0 or fix.granules[k])]
    by = "no fix" if moved[k] == 0 else "a fix" if moved[k] == 1 else f"{moved[k]:g} fixes"
    lets = "moves each granule by one fix" if expected[k] else f"fixes {case.granule_name(k)}"
    are = "is" if wrong.size == 1 else "are"
    yield Number(
        int(moved[k]), int(expected[k]), effect=math.inf,
        at=movers[-1].command if movers else deck.first_run,
        sentence=f"{case.granule_name(wrong)} {are} moved by {by}, the scene {lets}",
    )  # fmt: skip


def _missed(case: Case) -> Iterator[Number]:
    """A contact that overlapped without a force: neighbours not listed, or a removed wall."""
    overlaps, wall = case.deck.missed_overlap, far_wall(case.deck)
    if not overlaps.size:
        return
    k = int(np.argmax(overlaps))
    missed, room = float(overlaps[k]), _MISSED * float(case.near[min(k, case.near.size - 1)])
    if missed > room and wall is not None and k == case.deck.position.size - 1:
        yield Number(
            missed, 0.0, name="wall in motion", effect=case.whole_effect, at=wall.command,
            role="wall in motion",
            sentence=f"the last granule is up to {missed:.3g} m beyond the place of the wall"
            " without a force: the wall moves, or ends, while the deck runs",
        )  # fmt: skip
        return
    yield Number(
        missed, 0.0, room, effect=math.inf, command="neigh_modify delay 0 every 1 check yes",
        sentence=f"{case.contact_name(k)} overlapped by up to {missed:.3g} m without a force:"
        " neighbours are looked for too rarely, or not far enough",
    )  # fmt: skip


def _motion(case: Case) -> Iterator[Number]:
    """The deck's peaks against the scene's, which its other numbers do not explain."""
    contacts = np.flatnonzero(case.judged[: case.deck.peak_force.size])
    measured, expected = case.deck.peak_force[contacts], case.peaks[contacts]
    if contacts.size == 0:
        return
    k, _ = _most(measured, expected, expected)
    who = case.contact_name(int(contacts[k]))
    yield Number(
        measured[k], expected[k],
        (case.tolerance + case.deck.peak_reading_error) * expected[k], name="motion, by the peaks",
        sentence=f"the peak of {who} {values(measured[k], expected[k], 'N')}:"
        " the motion differs from that of the forces read at its start",
    )  # fmt: skip


def _final(case: Case) -> Iterator[Number]:
    """Velocities at the end: an equal change of all granules changes no peak."""
    expected, measured = case.expected.velocity, case.deck.final_velocity
    halted = any(fix.style == "halt" for fix in case.deck.fixes)  # a reading at its end is missing
    if halted or not np.all(np.isfinite(expected)):
        return
    fastest = max(float(np.max(np.abs(expected))), ROUND_OFF * case.scene.units.velocity)
    k, _ = _most(measured, expected)
    yield Number(
        measured[k], expected[k], _LATE * fastest, sentence=f"the velocity of"
        f" {case.granule_name(k)} at the end {values(measured[k], expected[k], 'm/s')}",
    )  # fmt: skip


# ---- The table

_NONE = "the scene has no such force"
_COUNTS = "counts must be equal"
_STRIKER = "a striker alone moves at the start"
_GRANULES = (
    Probe("number of granules", "", "granules", _count, _COUNTS),
    Probe("radius", "m", "radius", _radius),
    Probe("mass", "kg", "mass", _mass),
    Probe("place of granules", "m", "place", _place),
    Probe("distance of neighbours", "m", "place", _distance),
    Probe("place of the wall", "m", "wall", _wall_place),
    Probe("distance from the axis", "m", "place", _off_axis),
    Probe("velocity at the start", "m/s", "velocity", _velocity, _STRIKER),
    Probe("velocity across the chain", "m/s", "velocity", _velocity_across, _STRIKER),
    Probe("spin at the start", "1/s", "spin", _spin,
          "the scene has no spin; with friction it pushes granules off the axis"),
)  # fmt: skip
_CONTACTS = (
    Probe("force of the contacts", "N m^-1.5", "contacts", _missing,
          "contacts must push by Hertz's law"),
    Probe("exponent of the contact law", "", "contacts", _exponent,
          f"chosen: an exponent may be off by {EXPONENT}, no other law is as close"),
    Probe("stiffness of the contacts", "N m^-1.5", "contacts", _stiffness),
    Probe("force at other overlaps", "", "contacts", _elsewhere),
    Probe("contacts across the box", "N", "image", _image, "the chain of the scene has two ends"),
    Probe("wall", "", "wall", _wall, _COUNTS),
    Probe("wall at an end", "", "wall", _extra_walls),
    Probe("damping", "N", "contacts", _damping,
          "forces of approaching and parting granules; a scene without damping has none"),
    Probe("friction", "N", "contacts", _friction,
          "sideways forces and torques over radius when granules spin, of the contact force"),
)  # fmt: skip
_FORCES = (
    Probe("constant force", "N", "constant force", _constant, "the scene has no constant force"),
    Probe("constant force across the chain", "N", "constant force", _constant_across,
          "the scene has no force across the chain"),
    Probe("drag", "N s/m", "drag", _drag, "a force against a velocity: the scene has none"),
    Probe("random forces", "", "random", _random, _NONE),
    Probe("applied force across the chain", "N", "shock", _across,
          "the scene pushes along the chain"),
    Probe("granules that are pushed", "", "shock", _others,
          "granule 1 is the first of the chain, and the scene pushes one granule"),
    Probe("applied force", "N", "shock", _shock, "the shock of the scene"),
    Probe("driven granules", "", "piston", _driven, _COUNTS),
    Probe("displacement of the piston", "m", "piston", _piston),
)  # fmt: skip
_INTEGRATORS = Probe("integrators", "", "motion", _integrators, _COUNTS)
_RUNS = (
    Probe("time step", "s", "timestep", _step,
          "the error of velocity Verlet with the numbers of the scene and the steps of the deck"
          " must be within the tolerance"),
    Probe("end of the run", "s", "run", _end, _SEEN),
    _INTEGRATORS,
    Probe("neighbours", "m", "neighbours", _missed,
          f"overlaps without a force while the deck ran; chosen: {_MISSED:g} of those expected"),
)  # fmt: skip
_IN_MOTION = Probe("force of the motion", "N", "motion", _in_motion, _NONE)
_MOTION = Probe("motion", "N", "motion", _motion,
                "allowed is the tolerance and what the readings cost")  # fmt: skip
_AT_END = Probe("motion, by velocities at the end", "m/s", "motion", _final,
                f"allowed is {_LATE:g} of the largest, with the deck's steps")  # fmt: skip
_UNTRIED = Probe("contacts", "", "granules", _untried, "its granules are in no row")
"""The probe in place of all of contacts if no contact was probed."""


def probes_of(case: Case) -> tuple[Probe, ...]:
    """The probes that apply to a deck, in the order in which they are shown."""
    at_rest = (*_GRANULES, *(_CONTACTS if is_tried(case) else (_UNTRIED,)))
    if case.exact:
        return (*at_rest, *_FORCES, *([_INTEGRATORS] if case.scene.holds else []))
    if case.deck.stopped and not case.deck.applied_time.size:
        return at_rest  # LAMMPS refuses to run these granules even at rest
    return (*at_rest, *_FORCES, *_RUNS)


def all_checks(case: Case) -> list[DeckCheck]:
    """The checks of all probes, and of the motion where these do not explain the peaks."""
    probes = [*probes_of(case), *[_IN_MOTION] * (not case.deck.stopped)]
    checks = [check for probe in probes for check in checks_of(case, probe)]
    explained = sum(check.effect or 0.0 for check in checks if check.differs)
    # Fraction of the peaks' error: numbers that change them by as much explain it (chosen)
    if case.deck.stopped or explained >= 0.5 * case.whole_effect > 0:
        return checks
    checks += checks_of(case, _MOTION)
    if any(check.differs for check in checks):
        return checks
    return [*checks, *(check for check in checks_of(case, _AT_END) if check.differs)]


def peaks_check(case: Case) -> DeckCheck:
    """Compare the peaks of the deck with the reference: the final check."""
    deck, truth = case.deck, case.peaks
    contacts = np.flatnonzero(case.judged[: min(deck.peak_force.size, truth.size)])
    measured = expected = change = None
    if deck.stopped:
        sentence = f"the deck does not come to its end: {deck.stopped}"
    elif contacts.size == 0:
        sentence = "no contact had passed its peak when the deck ended"
    else:
        off = np.abs(deck.peak_force[contacts] / truth[contacts] - 1)
        k = int(np.argmax(np.where(np.isfinite(off), off, np.inf)))
        contact, change = int(contacts[k]), float(off[k])
        measured, expected = float(deck.peak_force[contact]), float(truth[contact])
        sentence = f"the peak of {case.contact_name(contact)} {values(measured, expected, 'N')}"
    passed = change is not None and change <= case.tolerance
    return DeckCheck(
        "peaks", "N", measured, expected, change, passed, not passed, sentence,
        f"asked for: {case.tolerance:g}; contacts that had not peaked by the deck's end are not"
        " judged",
    )  # fmt: skip
