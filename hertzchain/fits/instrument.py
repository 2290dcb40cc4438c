"""Effects of instruments on forces: gain, droop, offset, drift and hum of a gauge, as free keys."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import is_positive, require
from hertzchain.scene.keys import to_si
from hertzchain.sweeps.columns import unit_of

GAIN = "gain"
"""A key that no scene has: ratio of measured to true force, the same for all gauges."""

_KEY = re.compile(
    r"(?P<place>(?:gauge|contact)_\d+|(?:near_)?wall)\."
    r"(?P<kind>gain|droop|offset|drift|hum)"
)
_GAUGE = re.compile(r"(?:gauge|contact)_\d+\.")
_UNITS = {GAIN: "", "droop": "s", "offset": "N", "drift": "N/s", "hum": "N", "hum_phase": "rad"}

_DROOP_START = 0.01
"""Time constant of a charge amplifier from which a fit starts, if no range is given [s]; chosen."""


def is_of_instrument(key: str) -> bool:
    """Return whether a key belongs to the instrument and not to the scene."""
    return key == GAIN or _KEY.fullmatch(key) is not None


def unit_of_key(key: str) -> str:
    """Return the unit of a key of scene or instrument; empty for a pure number."""
    kind = key.rpartition(".")[2].partition("[")[0]
    return _UNITS[kind] if kind in _UNITS else unit_of(key)


def start_of(key: str) -> float:
    """Return the value of a gain or a droop [s] from which a fit starts."""
    return _DROOP_START if key.endswith(".droop") else 1.0


class Added(NamedTuple):
    """A free offset, drift or hum: what an instrument adds to a force.

    ``place`` is a gauge as in the name of a column, ``kind`` one of the three, and ``frequency``
    that of the hum [Hz], 0 for others.
    """

    place: str
    kind: str
    frequency: float

    @property
    def key(self) -> str:
        """The key, such as ``gauge_6.drift``."""
        return f"{self.place}.{self.kind}"

    def shown(self, sums: FloatArray) -> list[tuple[str, float, FloatArray]]:
        """Return name, value and derivatives of each number, from factors of ``columns_of`` [SI].

        A hum has two: its height and its phase, of height cos(2 pi frequency t + phase).
        """
        unit = np.eye(sums.size)
        if self.kind != "hum":
            at = ("offset", "drift").index(self.kind)
            return [(self.kind, sums[at], unit[at])]
        cosine, sine = sums[-2:]
        height = math.hypot(cosine, sine)
        of_height = (cosine * unit[-2] + sine * unit[-1]) / height
        of_phase = (sine * unit[-2] - cosine * unit[-1]) / height**2
        return [("hum", height, of_height), ("hum_phase", math.atan2(-sine, cosine), of_phase)]


def is_hum(key: str) -> bool:
    """Return whether a key is the height of a hum."""
    return key.partition("[")[0].endswith(".hum")


def added_of(key: str, text: str) -> Added | None:
    """Return what is added by a free key with this text behind its ``=``; None for other keys."""
    match = _KEY.fullmatch(key)
    is_known = match is not None or not _GAUGE.match(key)
    require(is_known, key, None, "is not a key of a gauge: it has gain, droop, offset, drift, hum")
    if match is None or match["kind"] in ("gain", "droop"):
        return None
    if match["kind"] != "hum":
        require(not text, key, text, "has no range: it is free from minus to plus infinity")
        return Added(match["place"], match["kind"], 0.0)
    allowed = "needs the frequency of the hum: --hum 50, or in Python 'gauge_6.hum=50 Hz'"
    require(bool(text), key, None, allowed)
    frequency = to_si(key, text, "Hz")
    require(is_positive(frequency), key, text, allowed)
    return Added(match["place"], match["kind"], frequency)


def place_of(key: str) -> str:
    """Return the gauge of a key of an instrument; empty for other keys."""
    match = _KEY.fullmatch(key)
    return match["place"] if match else ""


def columns_of(added: list[Added], time: FloatArray) -> FloatArray:
    """Return what is added by an offset, and by each of some others, for each unit of it.

    Its columns are 1 for the offset, the time [s] for a drift, cosine and sine for a hum; times are
    those of the file, whose 0 is the trigger; shape (samples, columns).
    """
    columns = [np.ones_like(time)]
    if any(each.kind == "drift" for each in added):
        columns.append(time)
    for each in added:
        if each.kind == "hum":
            phase = 2 * np.pi * each.frequency * time
            columns += [np.cos(phase), np.sin(phase)]
    return np.stack(columns, axis=1)


def drooped(time: FloatArray, force: FloatArray, constant: float) -> FloatArray:
    """Return a force as a charge amplifier with a time constant [s] shows it.

    The shown force y follows from dy/dt = dF/dt - y / constant, from 0 at the first sample, here
    solved exactly for a force F that is linear between samples a median step apart.
    """
    from scipy.signal import lfilter

    step = float(np.median(np.diff(time)))
    even = time[0] + step * np.arange(int(np.ceil((time[-1] - time[0]) / step - 1e-6)) + 1)
    decay = np.exp(-step / constant)
    # y[k] = decay y[k - 1] + gain (F[k] - F[k - 1]), a gain of mean exp(-s / constant) over a step
    gain = -np.expm1(-step / constant) * constant / step
    shown = lfilter([gain, -gain], [1.0, -decay], np.interp(even, time, force - force[0]))
    return np.asarray(np.interp(time, even, shown))
