"""Notes from which first pulses are computed: see ``first_pulse``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array, FloatArray
from hertzchain.observables.curves import begin_at_touch
from hertzchain.observables.first_pulse import (
    BEGIN,
    COLUMNS,
    CONTACT,
    END,
    FALLS,
    FORCE,
    LARGEST,
    LEAST,
    LENGTH,
    START,
    WHEN,
    Contacts,
    FirstPulses,
    curves_of,
    first_pulses,
)
from hertzchain.observables.samples import Samples

_NEAR = 0.98
"""Fraction of the largest force so far below which no maximum between samples is searched."""

_Places = NDArray[np.intp]


class NoteTaker:
    """Takes notes of the contacts of a run, in the units of its samples.

    ``inverse_mass`` is 1 / m of each granule, shape (granules,); ``unit`` is the natural unit of
    force. Weak forces are not noted: see ``LEAST``.
    """

    def __init__(self, contacts: Contacts, inverse_mass: Array, unit: float = 1.0) -> None:
        self._contacts, self._least = contacts, LEAST * (unit + contacts.static)
        self._law, self._static = contacts.law, contacts.static
        count = self._static.size
        self._inverse_mass = inverse_mass
        self._largest, self._when = self._static.copy(), np.zeros(count)
        self._fallen = np.full(count, len(FALLS))
        self._notes = [np.zeros((0, COLUMNS))]

    def first_pulses(self, largest: Array) -> FirstPulses:
        """Return the first pulses; ``largest`` has the peak force of each contact."""
        return first_pulses(np.concatenate(self._notes), self._contacts, largest)

    def update(self, samples: Samples, late: float = 0.0) -> None:
        """Add samples; ``late`` is the delay of the velocities that damped the motion."""
        force = samples.contact_force
        top = np.maximum(np.maximum.accumulate(force, axis=0), self._largest)
        harder = np.maximum(force[1:], force[:-1])
        static = self._static
        # Only contacts that may have a note: most are at rest, or their pulse is over.
        near = harder >= _NEAR * top[1:]
        for fall in FALLS:
            level = static + fall * (top[1:] - static)
            margin = (1 - _NEAR) * (top[1:] - static)
            near |= (harder >= level - margin) & (force[1:] <= level + margin)
        interval, contact = np.nonzero(near & (top[1:] - static > self._least))
        if not interval.size:
            return
        found = self._notes_of(samples, interval, contact, late)
        above, place = curves_of(found, self._law).highest()
        self._keep(found, contact, above, found[:, BEGIN] + place * found[:, LENGTH])

    def _notes_of(
        self, samples: Samples, interval: _Places, contact: _Places, late: float
    ) -> FloatArray:
        """Notes of intervals without the largest force so far."""
        derivatives = samples.overlap_derivatives
        notes = np.full((interval.size, COLUMNS), np.nan)
        notes[:, CONTACT], notes[:, BEGIN] = contact, samples.time[interval]
        notes[:, LENGTH] = np.diff(samples.time)[interval]
        for k, values in enumerate(derivatives[:4]):
            notes[:, START + k], notes[:, END + k] = (
                values[interval, contact],
                values[interval + 1, contact],
            )
        force = samples.contact_force
        notes[:, FORCE], notes[:, FORCE + 1] = (
            force[interval, contact],
            force[interval + 1, contact],
        )
        start = [notes[:, START + k] for k in range(3)]  # views: they change the notes
        jumps, _ = begin_at_touch(
            start, [notes[:, END + k] for k in range(3)], notes[:, BEGIN], notes[:, LENGTH],
            notes[:, FORCE + 1], self._inverse_mass, self._law, contact, late,
        )  # fmt: skip
        damping = self._law.damping[contact[jumps]]
        notes[jumps, FORCE] = damping * np.maximum(notes[jumps, START + 1], 0.0)
        return notes

    def _keep(self, notes: FloatArray, contact: _Places, above: Array, when: Array) -> None:
        """Keep the notes that first pulses need, with the largest force so far."""
        kept = np.zeros(contact.size, bool)
        for k, i in enumerate(contact):
            before = self._largest[i]
            for force, time in (
                (notes[k, FORCE], notes[k, BEGIN]),
                (above[k], when[k]),
                (notes[k, FORCE + 1], notes[k, BEGIN] + notes[k, LENGTH]),
            ):
                if force > self._largest[i]:
                    self._largest[i], self._when[i] = force, time
            kept[k] = self._largest[i] > before
            if kept[k]:
                self._fallen[i] = 0
            rest = (notes[k, FORCE + 1] - self._static[i]) / (
                self._largest[i] - self._static[i] or 1.0
            )
            while self._fallen[i] < len(FALLS) and rest <= FALLS[self._fallen[i]]:
                self._fallen[i] += 1
                kept[k] = True
            notes[k, LARGEST], notes[k, WHEN] = self._largest[i], self._when[i]
        kept &= notes[:, LARGEST] - self._static[contact] > self._least[contact]
        self._notes.append(notes[kept])
