"""Notes of first pulses, taken by the compiled loops: see ``observables.first_pulse``."""

from __future__ import annotations

import math
from typing import Any

from hertzchain.engines.native.compiling import compiled, part
from hertzchain.engines.native.damped_contacts import end_of_septic
from hertzchain.engines.native.elastic_chain import motion_of_contact, overlap_of, with_stiffness
from hertzchain.engines.native.interpolant import hertz_force
from hertzchain.observables.first_pulse import FALLS, LEAST


@part
def is_worth_a_note(
    record: Any, contact: int, f1: float, begin: float, largest: float, when: float
) -> bool:
    """Whether a force is larger than ever in an interval, or falls through a level after that.

    The levels are those of ``first_pulse.FALLS``; f1 is the force at the end.
    """
    static = record.static[contact]
    top = largest - static
    if not top > LEAST * (1.0 + static):
        return False
    worth = when >= begin
    if worth:
        record.fallen[contact] = 0
    while record.fallen[contact] < 3 and f1 - static <= FALLS[record.fallen[contact]] * top:
        record.fallen[contact] += 1
        worth = True
    return worth


@part
def note(
    record: Any, contact: int, begin: float, h: float, start: Any, end: Any, f0: float, f1: float,
    largest: float, when: float,
) -> None:  # fmt: skip
    """Write a note where there is room for it, and count it."""
    row = record.noted[0]
    record.noted[0] += 1
    if row >= record.notes.shape[0]:
        return
    notes = record.notes[row]
    notes[0], notes[1], notes[2] = contact, begin, h
    for k in range(4):
        notes[3 + k], notes[7 + k] = start[k], end[k]
    notes[11], notes[12], notes[13], notes[14] = f0, f1, largest, when


@part
def note_elastic(
    seen: Any, u0: Any, v0: Any, u: Any, v: Any, lo: int, hi: int, leg: Any, begin: float,
    time: float, h: float, off: float, chain: Any,
) -> None:  # fmt: skip
    """Take the notes of a step, after its maxima are known."""
    for i in range(lo, hi - 1):
        r0, r1 = overlap_of(u0, i, chain), overlap_of(u, i, chain)
        if r0 <= 0 and r1 <= 0:
            continue
        f0 = with_stiffness(hertz_force(r0), i, chain)
        f1 = with_stiffness(hertz_force(r1), i, chain)
        largest, when = seen.force[i], seen.time[i]
        if f1 > largest:
            largest, when = f1, time
        if is_worth_a_note(seen.record, i, f1, begin, largest, when):
            start = motion_of_contact(u0, v0, i, lo, leg, begin, off, chain)
            end = motion_of_contact(u, v, i, lo, leg, begin + h, off, chain)
            note(seen.record, i, begin, h, start, end, f0, f1, largest, when)


@compiled
def note_damped(
    seen: Any, start: Any, end: Any, begin: float, h: float, fresh: bool, hi: int, c: Any,
    chosen: Any,
) -> None:  # fmt: skip
    """The same for damped contacts; a step that is ``fresh`` has no jerk at its start."""
    record = seen.record
    for i in range(min(hi, seen.force.size)):
        largest, when, contact = seen.force[i], seen.time[i], chosen[i]
        if contact >= record.static.size:  # the free end
            continue
        if is_worth_a_note(record, contact, end.f[i + 1], begin, largest, when):
            first, last = end_of_septic(start, i, c), end_of_septic(end, i, c)
            if fresh:
                first = first[0], first[1], first[2], math.nan
            f0, f1 = start.f[i + 1], end.f[i + 1]
            note(record, contact, begin, h, first, last, f0, f1, largest, when)
