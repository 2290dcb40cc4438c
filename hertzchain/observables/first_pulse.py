"""The first pulse of each contact: what an experiment sees before anything is reflected.

f is the dynamic force of a contact (total less static; a pull is negative), M the largest so far.
The first pulse ends the first time that f falls to M / 2, once M is at least a hundredth of the
largest dynamic force of the run. Where the drive still acts at the end of the run, it also ends
where f exceeds an M that has stood for ten time units of its contact by more than 1 %: a front.

A run notes those intervals in which a contact is pressed harder than ever before, or falls through
a level of ``FALLS``: see ``notes``. The first pulses follow from these notes, for every engine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array, FloatArray
from hertzchain.contact import hertz
from hertzchain.errors import require
from hertzchain.observables.curves import Curves
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.observables.peaks import SIGNIFICANT
from hertzchain.scene.natural_units import NaturalUnits
from hertzchain.scene.scene import Scene

FALLS = (0.6, 0.5, 0.4)
"""Fractions of the largest force so far: a pulse ends at the middle one, and is clear where the
others give the same force."""

FLOOR, _FLOORS = 0.01, (0.003, 0.03)
"""Least force of a first pulse over the largest of the run, and two other choices to compare."""

_SAME = 0.01
"""Difference of forces up to which two choices give the same pulse."""

_STEADY = 2.0
"""How long a steady fall from the first of ``FALLS`` to the last takes at most, over what it would
take at its steepest slope (exponential: 1.2). Otherwise the force may dip to a half and rise again,
and the end has no right digit.
"""

_STANDS, _EXCEEDS = 10.0, 1.01
"""A front: time without a larger force [time units of the contact], and the ratio that ends it."""

LEAST = 1e-9
"""Dynamic forces that are not noted, over the natural unit plus the static force: no pulse that
counts is so weak."""

COLUMNS = 15
(CONTACT, BEGIN, LENGTH, START, END, FORCE, LARGEST, WHEN) = (0, 1, 2, 3, 7, 11, 13, 14)
"""Columns of notes: contact, begin and length of the interval, then overlap and its first three
derivatives at the start and at the end (the third NaN where it is not known), force at both, the
largest force so far and its time, those within the interval included."""

WANTED = ("first", "all")
"""Choices of the forces for which the accuracy holds: first pulses, or the largest of a run."""

_Mask = NDArray[np.bool_]
_Places = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class FirstPulses:
    """First pulses of all contacts, (contacts,) each, in the units of the run; NaN where none is.

    Parameters
    ----------
    force, time
        Dynamic force of the pulse, and its time.
    arrival
        When the force first reaches half of that.
    width
        From the arrival to the end of the pulse.
    static
        Force of the contacts before it.
    is_front, is_clear
        Whether the pulse ends as a front does; whether it has ended, and is the same for other
        levels at which it ends and from which it counts.
    is_steady
        Whether the force falls steadily at the end, so that the width is well defined.
    """

    force: FloatArray
    time: FloatArray
    arrival: FloatArray
    width: FloatArray
    static: FloatArray
    is_front: _Mask
    is_clear: _Mask
    is_steady: _Mask

    @property
    def is_ended(self) -> _Mask:
        """Whether the run saw the end of the pulse."""
        return ~np.isnan(self.width)

    @property
    def kind(self) -> NDArray[np.object_]:
        """``pulse``, ``front`` or, where no end was seen, ``unended``; None without a pulse."""
        is_ended = np.where(self.is_ended, "pulse", "unended")
        kind = np.where(self.is_front, "front", is_ended).astype(object)
        kind[np.isnan(self.force)] = None
        return kind

    def only(self, some: _Mask) -> FirstPulses:
        """Return the pulses of some contacts, and none for all others."""
        force, time, arrival, width = (
            np.where(some, values, np.nan)
            for values in (self.force, self.time, self.arrival, self.width)
        )
        return replace(
            self, force=force, time=time, arrival=arrival, width=width,
            is_front=self.is_front & some, is_clear=self.is_clear & some,
            is_steady=self.is_steady & some,
        )  # fmt: skip

    def in_units(self, force: float, time: float) -> FirstPulses:
        """Return the same pulses with forces and times multiplied by units."""
        return replace(
            self, force=self.force * force, time=self.time * time, arrival=self.arrival * time,
            width=self.width * time, static=self.static * force,
        )  # fmt: skip


def is_driven_to_the_end(scene: Scene) -> bool:
    """Return whether a force or a moving piston still acts at the end of a run."""
    if strokes := scene.shock.strokes:
        return strokes[-1].velocity != 0 or strokes[-1].start > scene.end_time
    return bool(scene.ramps) and scene.ramps[-1].end > scene.end_time


@dataclass(frozen=True, eq=False)
class Contacts:
    """Data of the contacts that are needed to find first pulses, in the units of a run."""

    law: DampedLaw
    static: FloatArray  # force at the start, (contacts,)
    slowness: FloatArray | None  # time unit times F^(1/6); None where the drive has ended

    @classmethod
    def of(cls, scene: Scene) -> Contacts:
        """Return the data of a scene's contacts in SI units."""
        granules = scene.granules
        time = hertz.slowness(granules.stiffness, granules.contact_mass)
        acts = is_driven_to_the_end(scene)
        return cls(DampedLaw.of(scene), granules.static_force, time if acts else None)

    def in_units(self, units: NaturalUnits) -> Contacts:
        """Return the same with all quantities in other units."""
        slowness = self.slowness
        if slowness is not None:
            slowness = slowness / (units.time * units.force ** (1 / 6))
        return Contacts(self.law.in_units(units), self.static / units.force, slowness)


def first_pulses(notes: FloatArray, contacts: Contacts, largest: Array) -> FirstPulses:
    """Return the first pulses that follow from the notes of a run.

    Parameters
    ----------
    notes
        In the order of time, shape (n, ``COLUMNS``).
    contacts
        The contacts in the units of the notes.
    largest
        Largest force of each contact in the whole run, static force included, shape (contacts,).
    """
    if not notes.size:
        never, no = np.full(largest.size, np.nan), np.zeros(largest.size, bool)
        return FirstPulses(never, never, never, never, contacts.static, no, no, no)
    notes = notes[np.argsort(notes[:, CONTACT], kind="stable")]
    here = notes[:, CONTACT].astype(np.intp)
    static, count = contacts.static[here], largest.size
    top, of_run = notes[:, LARGEST] - static, largest - contacts.static
    counts = of_run >= SIGNIFICANT * np.max(of_run)
    after = notes[:, FORCE + 1] - static

    def ends(fall: float, floor: float) -> _Places:
        """The first note of each contact in which its pulse ends; their number where none does."""
        is_end = (after <= fall * top) & (top >= floor * of_run[here])
        return _first(is_end, here, count)

    falls = [ends(fall, FLOOR) for fall in FALLS]
    end = falls[1]
    fronts, stood = _fronts(notes, here, contacts, of_run)
    is_front = fronts < end
    last = np.append(np.flatnonzero(np.diff(here, append=count)), -1)
    last_of = np.full(count, -1)
    last_of[here[last[:-1]]] = last[:-1]

    def force_at(end: _Places) -> Array:
        """The force of each pulse that ends in these notes, with the last note, or as a front."""
        return np.where(fronts < end, stood[0], top[np.where(end < here.size, end, last_of)])

    counts &= last_of >= 0
    force = np.where(counts, force_at(end), np.nan)
    seen = notes[np.where(end < here.size, end, last_of), WHEN]
    time = np.where(counts, np.where(is_front, stood[1], seen), np.nan)
    is_clear = counts.copy()
    for other in (falls[0], falls[2], *(ends(FALLS[1], floor) for floor in _FLOORS)):
        with np.errstate(invalid="ignore"):
            is_clear &= np.abs(force_at(other) - force) <= _SAME * force
    is_steady = is_front | _falls_steadily(notes, force, falls)
    end = np.minimum(end, fronts)
    is_clear &= end < here.size
    arrival, over = np.full(count, np.nan), np.full(count, np.nan)
    felt = _first_felt(notes, here, force / 2 + contacts.static, time)
    came, went = np.flatnonzero(felt < here.size), np.flatnonzero(counts & (end < here.size))
    rise, down = notes[felt[came]], notes[end[went]]
    leaves = np.where(is_front, _EXCEEDS, FALLS[1])[went] * force[went] + contacts.static[went]
    # Where the pulse is highest within its first interval, it arrives before that.
    until = np.where(rise[:, WHEN] > rise[:, BEGIN], rise[:, WHEN], np.inf)
    found = curves_of(np.concatenate([rise, down]), contacts.law).crossing(
        np.concatenate([force[came] / 2 + contacts.static[came], leaves]),
        np.concatenate([rise[:, BEGIN], time[went]]),
        np.concatenate([until, np.full(went.size, np.inf)]),
        np.concatenate([np.ones(came.size, bool), is_front[went]]),
    )
    arrival[came], over[went] = found[: came.size], found[came.size :]
    width = over - arrival
    return FirstPulses(
        force, time, arrival, width, contacts.static, is_front & counts, is_clear,
        is_steady & counts,
    )  # fmt: skip


def _falls_steadily(notes: FloatArray, force: Array, ends: list[_Places]) -> _Mask:
    """Whether each pulse falls from level to level about as fast as it falls at its end.

    ``ends`` has the notes in which it falls through each of ``FALLS``.
    """
    is_whole = ends[-1] < len(notes)
    falls = [notes[np.where(is_whole, one, 0)] for one in ends]
    slope = np.max([(one[:, FORCE] - one[:, FORCE + 1]) / one[:, LENGTH] for one in falls], axis=0)
    lasts = falls[-1][:, BEGIN] - falls[0][:, BEGIN] - falls[0][:, LENGTH]
    with np.errstate(invalid="ignore"):
        is_quick = lasts * slope <= _STEADY * (FALLS[0] - FALLS[-1]) * force
    return np.asarray(is_whole & is_quick, bool)


def _first(chosen: _Mask, here: _Places, count: int) -> _Places:
    """Number of the first chosen note of each contact; that of all notes where there is none."""
    found = np.full(count, here.size)
    which = np.flatnonzero(chosen)
    np.minimum.at(found, here[which], which)
    return found


def _fronts(
    notes: FloatArray, here: _Places, contacts: Contacts, of_run: Array
) -> tuple[_Places, tuple[Array, Array]]:
    """Each contact's first note that exceeds a steady front; the front's force and its time."""
    count, static = of_run.size, contacts.static[here]
    if contacts.slowness is None:
        never = np.full(count, np.nan)
        return np.full(count, here.size), (never, never)
    before, since = np.roll(notes[:, LARGEST], 1) - static, np.roll(notes[:, WHEN], 1)
    same = (np.roll(here, 1) == here) & (np.arange(here.size) > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        unit = contacts.slowness[here] * (before + static) ** (-1 / 6)
        stood = same & (notes[:, BEGIN] - since > _STANDS * unit)
    first = _first(stood & (before >= FLOOR * of_run[here]), here, count)
    is_known = first < here.size
    force, time = (
        np.where(is_known, values[np.where(is_known, first, 0)], np.nan)
        for values in (before, since)
    )
    later = np.arange(here.size) >= first[here]
    with np.errstate(invalid="ignore"):
        exceeds = later & (notes[:, LARGEST] - static > _EXCEEDS * force[here])
    return _first(exceeds, here, count), (force, time)


def _first_felt(notes: FloatArray, here: _Places, level: Array, time: Array) -> _Places:
    """The first note of each contact in which the force reaches a level, or the pulse its height.

    It is the number of notes where there is no pulse.
    """
    with np.errstate(invalid="ignore"):
        reached = (notes[:, FORCE + 1] >= level[here]) | (
            notes[:, BEGIN] + notes[:, LENGTH] >= time[here]
        )
    return _first(reached, here, level.size)


def curves_of(notes: FloatArray, law: DampedLaw) -> Curves:
    """Return the forces within the intervals of notes."""
    start, end = ([notes[:, first + k] for k in range(4)] for first in (START, END))
    ends = notes[:, FORCE], notes[:, FORCE + 1]
    contact = notes[:, CONTACT].astype(np.intp)
    return Curves.of(start, end, notes[:, BEGIN], notes[:, LENGTH], ends, contact, law)


def check_wanted(wanted: str | None) -> None:
    """Raise a SceneError for what is neither None nor in ``WANTED``."""
    allowed = f"must be one of {', '.join(WANTED)}, or left out"
    require(wanted is None or wanted in WANTED, "wanted", wanted, allowed)


def usually_wanted(scene: Scene) -> str:
    """Return the default of ``wanted`` for a scene.

    It is first pulses where waves are reflected within the chain, and for gauges; elsewhere it is
    the largest forces.
    """
    return "first" if reflects(scene) or scene.gauges else "all"


def reflects(scene: Scene) -> bool:
    """Return whether a striker, a wall or unlike granules reflect waves within the chain.

    Granules that move at the start, or a shock within the chain, may send several waves.
    """
    has_end = scene.striker is not None or scene.wall is not None or scene.moves or scene.holds
    return has_end or not {"unlike granules", "local shock"}.isdisjoint(scene.terms)
