"""The wave between two contacts: speed from arrivals, height and width from first pulses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import SceneError, require
from hertzchain.scene.scene import Scene

_APART, NEAR_END, _NEAR_END_IF_SLOW = 10, 2, 7
"""Contacts from the first to the last of the usual pair, and between that and the end: there the
incident and the reflected wave are one hump, the longer where contacts are damped or loaded. Speeds
in the last two are off by up to 7 %, before by 3e-4 (measured on 20 steel spheres)."""


@dataclass(frozen=True)
class Wave:
    """The wave from one contact to another; all errors are bounds, those of others relative.

    Parameters
    ----------
    first, last
        Numbers of the contacts.
    speed, speed_error
        Distance of the contacts at rest over the difference of the arrivals [m/s].
    height, height_error
        Dynamic force of the first pulse of the last contact [N].
    width, width_error
        How long that force is above its half [s]; NaN where that is not known.
    width_granules
        The width in granules: width times speed over the mean diameter at the last contact.
    """

    first: int
    last: int
    speed: float
    speed_error: float
    height: float
    height_error: float
    width: float
    width_error: float
    width_granules: float


def dict_of(wave: Wave | None) -> dict[str, float | None] | None:
    """Return a wave as a JSON object."""
    if wave is None:
        return None
    return {
        "first_contact": wave.first,
        "last_contact": wave.last,
        "speed_m_s": wave.speed,
        "speed_error": wave.speed_error,
        "height_N": wave.height,
        "height_error": wave.height_error,
        "width_s": _or_none(wave.width),
        "width_error": _or_none(wave.width_error),
        "width_granules": _or_none(wave.width_granules),
    }


def _or_none(value: float) -> float | None:
    return None if np.isnan(value) else value


def places(scene: Scene) -> FloatArray:
    """Places of contacts at rest, from the centre of the first body [m], shape (contacts,).

    It is the middle of a gap; two spheres that are pressed touch in the middle of their overlap.
    """
    granules = scene.granules
    ahead = granules.position + granules.radius
    size = granules.stiffness.size
    half = (granules.gap[:size] - granules.static_overlap[:size]) / 2
    return np.asarray(ahead[:size] + half)


def is_near_end(scene: Scene, if_slow: int = _NEAR_END_IF_SLOW) -> NDArray[np.bool_]:
    """Whether contacts are so near the last that two waves are one hump there, (contacts,).

    If a fixed granule stands ahead of the shock, its contact counts as the last: no wave passes it.
    ``if_slow`` contacts are near where contacts are damped or loaded.
    """
    is_slow = scene.contact is not None or scene.precompression is not None
    count = len(scene.contacts)
    fixed = scene.granules.fixed if scene.holds else np.zeros(0)
    last = np.min(fixed[fixed > scene.pushed], initial=count)
    near = np.arange(count) >= last - (if_slow if is_slow else NEAR_END)
    return np.asarray(near)


def runs_forwards(arrival: FloatArray, contacts: Sequence[int]) -> bool:
    """Whether one wave runs from the first to the last of some contacts, counted from 0.

    Two waves reach a contact between these before the first of them, or after the last.
    """
    between = arrival[min(contacts) : max(contacts) + 1]
    begin, end = between[0], between[-1]
    return bool(begin < end and not ((between < begin) | (between > end)).any())


def wave_between(scene: Scene, known: Mapping[str, NDArray[Any]], first: int, last: int) -> Wave:
    """Return the wave from one contact to another, from the columns of ``Result.first_columns``."""
    if not known:
        allowed = 'needs first pulses, which this run has not: ask for wanted="first"'
        raise SceneError("wave", None, allowed)
    most = scene.chain.granules
    allowed = f"must be two contacts from 2 to {most}, between granules, the later one last"
    require(2 <= first < last <= most, "contacts", (first, last), allowed)
    i, j = (scene.contacts.index(contact) for contact in (first, last))
    arrival, error = known["arrival_time_s"], known["arrival_error_s"]
    apart, time = np.diff(places(scene)[[i, j]])[0], arrival[j] - arrival[i]
    is_clear = known["clear"][[i, j]].all() and not is_near_end(scene, NEAR_END)[j]
    if not (is_clear and runs_forwards(arrival, (i, j))):
        allowed = "must have clear first pulses of one wave, before the last two ahead of an end"
        raise SceneError("contacts", (first, last), allowed)
    speed, off = apart / time, (error[i] + error[j]) / time
    # A front lasts until another wave comes, so it has no width.
    width = np.nan if known["kind"][j] == "front" else known["first_width_s"][j]
    radius = scene.granules.radius
    diameter = radius[j] + radius[min(j + 1, radius.size - 1)]
    return Wave(
        first, last, float(speed), float(off / max(1.0 - off, 1e-300)),
        float(known["first_peak_force_N"][j]), float(known["first_peak_error"][j]),
        float(width), float(known["first_width_error_s"][j] / width),
        float(width * speed / diameter),
    )  # fmt: skip


def usual_wave(scene: Scene, known: Mapping[str, NDArray[Any]]) -> Wave | None:
    """The wave over the last contacts that no end disturbs, at most ten; None without one."""
    if not known:
        return None
    last = int(np.count_nonzero(~is_near_end(scene))) + scene.contacts[0] - 1
    first = max(last - _APART, 2)
    if first >= last:
        return None
    pair = [scene.contacts.index(contact) for contact in (first, last)]
    if not (runs_forwards(known["arrival_time_s"], pair) and known["clear"][pair].all()):
        return None
    return wave_between(scene, known, first, last)
