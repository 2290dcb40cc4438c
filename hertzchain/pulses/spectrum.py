"""The amplitude spectrum of a recorded force, and the band edges of a pressed periodic chain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import require
from hertzchain.observables.gauges import force_over_time
from hertzchain.observables.result import Result, context_of
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Gauge

WINDOW = "hann"
"""Name of the window in SciPy (chosen): a sine between two bins loses at most 15 % of its
height."""

_MOST_SAMPLES = 1_000_000  # samples of a recorded force; chosen


class Edge(NamedTuple):
    """An edge of a band: frequency [Hz], and its formula."""

    name: str
    frequency: float
    formula: str


def band_edges(scene: Scene) -> tuple[Edge, ...]:
    """Return the edges of the bands in which small waves run, of a pressed periodic chain.

    Its granules are alike, or of two kinds in turn, the ends apart. Contacts under the static force
    F have the stiffness k = 3/2 A^(2/3) F^(1/3); w = 2 sqrt(k/m) |sin(q/2)| is at most 2 sqrt(k/m),
    and of masses m < M the lower band ends at sqrt(2k/M), the upper one lies between sqrt(2k/m) and
    sqrt(2k (1/m + 1/M)) (L. Brillouin, Wave Propagation in Periodic Structures, 1946, chapter 4).
    None for a chain without a static force, or without such a period.
    """
    granules = scene.granules
    mass, stiffness, force = granules.mass[1:-1], granules.stiffness[1:-1], granules.static_force
    is_long = mass.size >= 3  # granules without the ends, which show the period of a chain
    if not is_long or force[0] == 0 or not _equal(force) or not _equal(stiffness):
        return ()
    k = 1.5 * float(stiffness[0]) ** (2 / 3) * float(force[0]) ** (1 / 3)
    if not (_equal(mass[::2]) and _equal(mass[1::2])):
        return ()
    if _equal(mass):
        return (Edge("end of the band", _hertz(4 * k / float(mass[0])), "sqrt(k/m) / pi"),)
    light, heavy = sorted(mass[:2].tolist())
    return (
        Edge("end of the lower band", _hertz(2 * k / heavy), "sqrt(2k/M) / (2 pi)"),
        Edge("start of the upper band", _hertz(2 * k / light), "sqrt(2k/m) / (2 pi)"),
        Edge(
            "end of the upper band",
            _hertz(2 * k * (1 / light + 1 / heavy)),
            "sqrt(2k (1/m + 1/M)) / (2 pi)",
        ),
    )


def _equal(values: FloatArray) -> bool:
    return bool(np.ptp(values) <= 1e-9 * np.max(values))


def _hertz(square: float) -> float:
    """Return the frequency [Hz] of the square of an angular one."""
    return math.sqrt(square) / (2 * math.pi)


def times_of(scene: Scene) -> FloatArray:
    """Return equally spaced times of a run from which spectra are computed [s], shape (times,).

    SceneError if there would be too many.
    """
    # 16 samples in a natural time unit, and at least 8 in a period at the highest band edge
    steps = [scene.contact_time / 16]
    steps += [1 / (8 * edge.frequency) for edge in band_edges(scene)]
    count = math.ceil(scene.end_time / min(steps)) + 1
    allowed = f"needs {count:,} samples, more than {_MOST_SAMPLES:,}: give an earlier end_time"
    require(count <= _MOST_SAMPLES, "end_time", scene.end_time, allowed)
    return np.linspace(0.0, scene.end_time, count)


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum:
    """The amplitude spectrum of the force of a gauge, without its mean.

    Parameters
    ----------
    scene, gauge
        The scene that ran, and the gauge.
    frequency
        Equally spaced frequencies from 0 [Hz], shape (bins,).
    amplitude
        Amplitude of a sine that lasts as long as the run [N], shape (bins,).
    edges
        The band edges of the chain, if it has any.
    """

    scene: Scene
    gauge: Gauge
    frequency: FloatArray
    amplitude: FloatArray
    edges: tuple[Edge, ...]

    @property
    def largest(self) -> tuple[float, float]:
        """Frequency [Hz] and amplitude [N] of the highest bin above 0 Hz."""
        at = 1 + int(np.argmax(self.amplitude[1:]))
        return float(self.frequency[at]), float(self.amplitude[at])

    def to_dict(self) -> dict[str, Any]:
        """Return the spectrum as a JSON object."""
        return {
            "gauge": self.gauge.place,
            "window": WINDOW,
            "bin_Hz": float(self.frequency[1]),
            "frequency_Hz": self.frequency.tolist(),
            "amplitude_N": self.amplitude.tolist(),
            "band_edges": [
                {"name": edge.name, "frequency_Hz": edge.frequency, "formula": edge.formula}
                for edge in self.edges
            ],
            **context_of(self.scene),
        }


def spectrum_of(result: Result, gauge: Gauge) -> Spectrum:
    """Return the amplitude spectrum of a recorded force.

    Parameters
    ----------
    result
        A run with ``record``, at equally spaced times such as ``times_of`` its scene.
    gauge
        A gauge, which the scene need not have.

    Raises
    ------
    SceneError
        If nothing was recorded, at other times, or if the scene has no such gauge.
    """
    from scipy.signal import periodogram

    scene, history = result.scene, result.history
    gauge.check(scene.chain.granules, scene.wall is not None, scene.near_wall is not None)
    allowed = "must be a run with record = the equally spaced times of which a spectrum is wanted"
    is_even = history is not None and bool(np.allclose(np.diff(history.time, 2), 0, atol=1e-15))
    require(is_even, "result", None, allowed)
    assert history is not None
    rate = (history.time.size - 1) / float(history.time[-1] - history.time[0])
    force = force_over_time(scene, gauge, history)
    frequency, power = periodogram(force, rate, WINDOW, detrend="constant", scaling="spectrum")
    power[1 : (force.size + 1) // 2] *= 2  # 0 Hz and the highest bin have no second half
    return Spectrum(scene, gauge, frequency, np.sqrt(power), band_edges(scene))
