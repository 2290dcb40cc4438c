"""The result of a fit: values with their intervals, and the residual."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.fits.free import limits_of
from hertzchain.observables.definitions import context_of
from hertzchain.scene.scene import Scene

NOISE_KNOWN = 1.35
"""Mean square of differences over the noise above which they are not noise: noise is known to 5 %
from 200 samples, and enters squared."""

LARGEST_OF_PEAKS = 0.1
"""Relative residual of peaks above which it is not their noise (chosen)."""

RARE = 1e-2
"""Probability of lasting differences below which they are not noise (chosen): with 1e-3 a tenth of
the wrong models that differed by more than 3 u_val were not detected (measured)."""

NORMAL_95 = 1.959964
"""Standard deviations of a normal distribution with 95 % on both sides."""


@dataclass(frozen=True)
class Parameter:
    """A fitted value.

    Parameters
    ----------
    key
        Its key in the scene file, or ``gain``.
    value, start
        The fitted value, and that of the given scene, in SI units.
    deviation
        Its standard deviation.
    unit
        The unit, as text; empty for a pure number.
    """

    key: str
    value: float
    start: float
    deviation: float
    unit: str

    @property
    def interval_95(self) -> tuple[float, float]:
        """Ends of the interval that holds the true value in 95 of 100 experiments."""
        half, (least, most) = NORMAL_95 * self.deviation, limits_of(self.key)
        return max(self.value - half, least), min(self.value + half, most)

    def to_dict(self) -> dict[str, Any]:
        """Return the parameter as a JSON object."""
        return {
            "key": self.key,
            "value": self.value,
            "interval_95": list(self.interval_95),
            "unit": self.unit,
            "start": self.start,
        }


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """A scene fitted to traces.

    Parameters
    ----------
    scene
        The scene with the fitted values, which are ``uncertain`` in it.
    parameters
        The values, with deviations.
    correlation
        Correlations of the values, shape (parameters, parameters).
    shifts
        Time on the clock of each file at which the run begins [s].
    mean_square
        Mean square of the differences over the noise: 1 if they are noise and nothing else.
    autocorrelation
        Correlation of differences with those of the next sample: 0 for white noise.
    samples, runs
        Number of compared samples, and of runs.
    chance
        Probability that noise causes differences that last as long as these.
    noise_is_known
        False for peaks, whose relative noise is that of the differences.
    of_recordings
        Sentences on clipped recordings; usually none.
    """

    scene: Scene
    parameters: tuple[Parameter, ...]
    correlation: FloatArray
    shifts: tuple[float, ...]
    mean_square: float
    autocorrelation: float
    samples: int
    runs: int
    chance: float
    noise_is_known: bool = True
    of_recordings: tuple[str, ...] = ()

    @property
    def is_noise(self) -> bool:
        """Whether the scene differs from the measurement by no more than noise."""
        return not self._is_large and self.chance >= RARE

    @property
    def _is_large(self) -> bool:
        return self.mean_square > (NOISE_KNOWN if self.noise_is_known else LARGEST_OF_PEAKS**2)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on the residual and on clipped recordings; usually none."""
        residual = math.sqrt(self.mean_square)
        of_peaks = f"{residual:.0%} of the peaks, more than measuring explains"
        large = f"{residual:.2g} times the noise" if self.noise_is_known else of_peaks
        left = (
            f"the residual is {large}: something other than the fitted values differs from the"
            " scene, and the intervals are widened by that"
        )
        lasts = (
            "the residual is no larger than the noise, but lasts for half a pulse or several"
            f" contacts, as noise does in less than one of {1 / RARE:,.0f} fits:"
            " something other than the fitted values differs from the scene, and the intervals do"
            " not count it"
        )
        if self.is_noise:
            return self.of_recordings
        return (left if self._is_large else lasts, *self.of_recordings)

    def to_dict(self) -> dict[str, Any]:
        """Return the fit as a JSON object."""
        return {
            "parameters": [one.to_dict() for one in self.parameters],
            "correlation": self.correlation.tolist(),
            "shift_s": list(self.shifts),
            "residuals": {
                f"mean_square_over_{'noise' if self.noise_is_known else 'peaks'}": self.mean_square,
                "autocorrelation": self.autocorrelation,
                "chance": self.chance,
                "samples": self.samples,
            },
            "runs": self.runs,
            "remarks": list(self.remarks),
            **context_of(self.scene),
        }

    def __repr__(self) -> str:
        from hertzchain.report.cards import card

        facts = []
        for one in self.parameters:
            # Two digits more than are known, so that value and interval belong together.
            digits = max(3, 2 - math.floor(math.log10(one.deviation / abs(one.value))))
            low, high = (f"{end:.{digits}g}" for end in one.interval_95)
            value = f"{one.value:.{digits}g} {one.unit}".rstrip()
            facts.append((one.key, f"{value}, 95 % within {low} to {high}"))
        if len(self.parameters) > 1:
            size = np.abs(np.tril(self.correlation, -1))
            places = np.unravel_index(size.argmax(), size.shape)
            both = " and ".join(self.parameters[int(k)].key for k in places)
            facts.append(("strongest correlation", f"{size.max():.3f}, {both}"))
        residual = ("residual over the noise", f"{self.mean_square**0.5:.3g}")
        if not self.noise_is_known:
            residual = ("residual over the peaks", f"{self.mean_square**0.5:.2g}")
        shifts = ", ".join(f"{shift:.6g}" for shift in self.shifts)
        facts += [("the run begins at", f"{shifts} s of the measured clock")] if shifts else []
        facts += [
            residual,
            ("samples, runs", f"{self.samples:,}, {self.runs:,}"),
            *(("remark", remark) for remark in self.remarks),
        ]
        return card("Fit", facts)
