"""Errors of a result over what it states, observable by observable, by independent solvers."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.observables.peaks import judged_contacts
from hertzchain.verdict.run_checks import balance_checks
from tests.oracles import extrapolation
from tests.oracles.first_pulses import Seen, Trace

Shares = Iterator[tuple[str, float]]
"""Observables by name, and their errors over what was stated: a result is wrong above 1."""

TRACED = 5e-9
"""Error of a trace, over the force and the time unit: with a fifth of its longest step an arrival
in random scene 99 of tests/observables changes by 3.3e-9, the most of all seen."""

IN_TRAINS = 1e-8
"""The same for all pulses, of which later ones follow many collisions."""

solved = lru_cache(maxsize=4)(extrapolation.solve)
traced = lru_cache(maxsize=4)(Trace)
"""The peaks and the motion of a scene, by which several engines are judged."""


def share(error: float, bound: float) -> float:
    """Return an error over its bound; 0 for none, which a bound of 0 allows; NaN for NaN."""
    return 0.0 if error <= 0 else float(error / bound)


def of_peaks(result: hc.Result) -> Shares:
    """Yield peaks by the bound of all, and of each contact where first pulses were wanted."""
    truth = solved(result.scene)
    judged = judged_contacts(truth.force)
    off = np.abs(result.peak_force[judged] / truth.force[judged] - 1) - truth.error
    yield "largest forces", share(np.max(off, initial=0.0), result.error_estimate)
    if result.first_pulses is not None:
        for contact, error, bound in zip(
            result.contact[judged], off, result.errors.peak[judged], strict=True
        ):
            yield f"largest force of contact {contact}", share(error, bound)


def of_transition(result: hc.Result) -> Shares:
    """Yield p of a plain scene: from i on, changes to the next peak are below 1 % of that."""
    if not result.scene.is_plain:
        return
    force, last = solved(result.scene).force, result.scene.chain.granules
    passed = dict(zip(result.contact.tolist(), result.peak_passed, strict=True))
    changes = {k: abs(1 - force[k - 2] / force[k - 1]) for k in range(2, last - 1)}
    steady = (i for i in range(5, last - 1) if max(changes[k] for k in range(i, last - 1)) < 0.01)
    p = next(steady, None)
    if p is not None and not all(passed[k] for k in (p + 1, p + 2)):
        p = None
    yield "p", 0.0 if result.transition_granules == p else np.inf


def of_velocities(result: hc.Result) -> Shares:
    """Yield velocities at the end of a run to 1e-9 over 2e-8 of the largest.

    After many collisions they are off by 1.1e-8, the most of all seen.
    """
    true = extrapolation.peaks(result.scene).velocity[result.scene.first_granule :]
    off = np.max(np.abs(result.velocity - true))
    yield "velocities at the end", share(off, 2e-8 * np.max(np.abs(true)))


def of_balances(result: hc.Result) -> Shares:
    """Yield momentum and energy; those that a comparison has are those of the reference."""
    for check in balance_checks(result):
        yield check.name, 0.0 if check.passed else np.inf


def of_first_pulses(result: hc.Result, watched: hc.Scene | None = None) -> Shares:
    """Yield first pulses, arrivals and widths of the contacts whose pulse is clear.

    Elsewhere its end is a choice. ``watched`` is the scene of the trace, with an end after that of
    the result; by default that of the result.
    """
    scene, first, errors = result.scene, result.first_pulses, result.errors
    late = TRACED * scene.contact_time
    truth = traced(watched or scene).first_pulses(scene.granules.static_force)
    for k in np.flatnonzero(first.is_clear & first.is_ended & ~first.is_front):
        name, true = f"contact {result.contact[k]}", truth[k]
        assert true is not None, name
        assert true.end is not None, name
        off = abs(first.force[k] / true.force - 1) - TRACED
        yield f"first pulse of {name}", share(off, errors.first[k])
        off = abs(first.arrival[k] - true.arrival) - late
        yield f"arrival in {name}", share(off, errors.arrival[k])
        if first.is_steady[k]:
            off = abs(first.width[k] - (true.end - true.arrival)) - late
            yield f"width in {name}", share(off, errors.width[k])


def of_gauges(result: hc.Result) -> Shares:
    """Yield force, arrival and width of the gauges in granules."""
    scene, late = result.scene, TRACED * result.scene.contact_time
    for reading in result.gauges:
        granule = reading.gauge.granule
        if granule is None:
            continue  # a contact
        if np.isnan(reading.force) and result.method.startswith("velocity-verlet"):
            continue  # unknown at these steps
        true = traced(scene).gauge(granule, scene.granules.static_force)
        name = f"gauge in granule {granule}"
        if not true.force > 0:  # fixed granules keep it from any motion
            yield f"silence of the {name}", np.inf if reading.force > 0 else 0.0
            continue
        if true.end is None and np.isnan(reading.force):
            continue  # the run ended before the pulse did
        off = abs(reading.force / true.force - 1) - TRACED
        yield f"force of the {name}", share(off, reading.force_error)
        off = abs(reading.arrival - true.arrival) - late
        yield f"arrival at the {name}", share(off, reading.arrival_error)
        if true.end is not None and np.isfinite(reading.width_error):
            off = abs(reading.width - (true.end - true.arrival)) - late
            yield f"width at the {name}", share(off, reading.width_error)


def of_wave(result: hc.Result, first: int, last: int) -> Shares:
    """Yield the speed of the wave from contact to contact, in chains of one radius without gaps."""
    scene, each = result.scene, result.scene.granules
    if np.ptp(each.radius) or np.any(each.gap):
        return
    try:
        wave = result.wave(first, last)
    except SceneError:
        return  # no clear first pulses of one wave
    truth = traced(scene).first_pulses(each.static_force)
    behind, ahead = (scene.contacts.index(contact) for contact in (first, last))
    # Granules under a load stand nearer to one another.
    overlap = each.static_overlap[behind : ahead + 1]
    apart = (last - first) * 2 * scene.chain.radius - np.sum(overlap[1:] + overlap[:-1]) / 2
    time = truth[ahead].arrival - truth[behind].arrival
    late = 2 * TRACED * scene.contact_time / time
    yield "speed of the wave", share(abs(wave.speed * time / apart - 1) - late, wave.speed_error)


def of_trains(result: hc.Result) -> Shares:
    """Yield all pulses of each contact, and ``inf`` for pulses that are missed.

    A pulse is missed if it is apart from the others by more than its width. The error of the judge
    is the difference from a trace with a hundredth of its accuracy, if it is above its least.
    """
    scene = result.scene
    trains, roughly = (
        traced(scene, tolerance).trains(scene.granules.static_force) for tolerance in (3e-14, 3e-12)
    )
    for contact, pulses, rough in zip(result.contact.tolist(), trains, roughly, strict=True):
        train = result.pulses(contact=contact)
        times = np.array([pulse.time for pulse in pulses])
        largest = max((pulse.force for pulse in pulses), default=0.0)
        is_sure = largest > 1e-8 * (scene.units.force + result.peak_at(contact))
        matched = np.zeros(len(pulses), bool)
        rows: list[Any] = list(train[train["force_error"] < 0.1].itertuples())
        for number, row in enumerate(rows, 1):
            k = int(np.argmin(np.abs(times - row.time_s)))
            other = min(rough, key=lambda pulse, k=k: abs(pulse.time - times[k]))  # type: ignore[misc]
            matched[k] = True
            for what, part in _of_pulse(row, pulses[k], other, scene.contact_time):
                yield f"{what} of pulse {number} of contact {contact}", part
        for k, pulse in enumerate(pulses):
            apart = np.min(np.abs(np.delete(times, k) - pulse.time), initial=np.inf)
            wide = np.inf if pulse.end is None else pulse.end - pulse.arrival
            is_whole = is_sure and len(rows) == len(train) and pulse.force > 0.0101 * largest
            if not matched[k] and apart > wide and is_whole:
                yield f"a pulse of contact {contact} at {pulse.time} s, missed", np.inf


def _of_pulse(row: Any, true: Seen, rough: Seen, unit: float) -> Shares:
    """Yield force, time, arrival and width of a pulse."""
    late = max(IN_TRAINS * unit, abs(true.arrival - rough.arrival))
    off = abs(row.force_N / true.force - 1) - max(IN_TRAINS, abs(true.force / rough.force - 1))
    yield "force", share(off, row.force_error)
    off = abs(row.time_s - true.time) - max(1e-6 * unit, abs(true.time - rough.time))
    yield "time", share(off, row.time_error_s)
    yield "arrival", share(abs(row.arrival_time_s - true.arrival) - late, row.arrival_error_s)
    if true.end is not None and rough.end is not None and np.isfinite(row.width_error_s):
        late = max(late, abs(true.end - rough.end))
        off = abs(row.width_s - (true.end - true.arrival)) - 2 * late
        yield "width", share(off, row.width_error_s)
