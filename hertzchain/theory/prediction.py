"""A scene without a simulation: peaks from the map, the paper's equations, the exact wave."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from itertools import zip_longest
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray, or_none
from hertzchain.observables.wave import STEADY, transition_granules
from hertzchain.scene.chain import PAPER_MOMENTUM, Chain
from hertzchain.scene.scene import (
    Scene,
    SceneLike,
    overlap_ratio,
    overlap_warning,
    refuse_deep_overlap,
    to_scene,
)
from hertzchain.scene.shocks import Pulse
from hertzchain.theory import paper, peak_map
from hertzchain.theory import solitary_wave as exact

FREE_END = 0.97597  # peak of contact N over its peak in a longer chain, once the wave has formed

LAST_PEAK_ERROR = 0.02
"""Upper bound of the relative error of the peak of contact N (chosen).

Measured were 0.016 in chains of 6 granules, where the wave has not formed yet, and below 0.01 from
10 granules on.
"""


@dataclass(frozen=True)
class Constant:
    """A constant of the paper and its exact value."""

    name: str  # its equation in the paper and its meaning
    paper: float
    exact: float

    @property
    def difference(self) -> float:
        """Relative difference of the paper's value from the exact one."""
        return self.paper / self.exact - 1


@dataclass(frozen=True)
class Estimate:
    """A property of the solitary wave of height F_SW: the paper's value and the exact one."""

    paper: float  # with the paper's constant
    exact: float  # with the exact constant
    far_field: float  # exact value for a wave as high as the far field

    @property
    def closer(self) -> str:
        """The value closer to the far field, ``paper`` or ``exact``.

        After long pulses F_SW is below the far field, and a constant that is too large compensates
        for that.
        """
        off = abs(self.paper - self.far_field), abs(self.exact - self.far_field)
        return "paper" if off[0] < off[1] else "exact"

    def to_dict(self) -> dict[str, float | str]:
        """Return the estimate as a JSON object."""
        return {**asdict(self), "closer": self.closer}


@dataclass(frozen=True, eq=False)
class Prediction:
    """Prediction for a scene without a simulation; None and NaN stand for unknown values.

    It holds for a run that lasts until every contact has peaked: ``run.end_time`` of a scene has no
    effect.

    Parameters
    ----------
    scene
        The scene.
    missing
        Why numbers are missing, or None where none are.
    note
        Why the scene lies outside the range of the paper; None inside it.
    peak_force
        Peaks of contacts 2 ... min(N, 80), from the map [N], shape (min(N, 80) - 1,). Relative
        error peak_map.PEAK_ERROR; LAST_PEAK_ERROR for contact N, at the free end.
    transition_granules
        p of these peaks, by the same function as for runs.
    candidates
        Possible values of p within the accuracy of the peaks: p alone, or p and a second one; None
        among them where the transition may not end in this chain.
    far_field_force
        Limit of the peaks of an endless chain [N]; relative error peak_map.FAR_FIELD_ERROR.
    """

    scene: Scene
    missing: str | None
    note: str | None
    peak_force: FloatArray
    transition_granules: int | None = None
    candidates: tuple[int | None, ...] = ()
    far_field_force: float | None = None

    @property
    def overlap_ratio(self) -> float | None:
        """Largest overlap over the radius R; Hertz's law holds for small overlaps."""
        if not self.peak_force.size or np.isnan(self.peak_force).any():
            return None
        return overlap_ratio(self.scene.chain, float(np.max(self.peak_force)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Validity warnings; usually empty."""
        ratio = self.overlap_ratio
        warning = None if ratio is None else overlap_warning(ratio)
        return () if warning is None else (warning,)

    @property
    def wave_force(self) -> float | None:
        """F_SW, the peak of contact p + 1 [N]."""
        p = self.transition_granules
        return None if p is None else float(self.peak_force[p - 1])

    @functools.cached_property
    def eq3(self) -> float | None:
        """Value of p by Eq. 3, not rounded, with the F_SW of the map."""
        if self.wave_force is None:
            return None
        return paper.transition_granules(self.scene.chain, *_shock(self.scene), self.wave_force)

    @property
    def eq6(self) -> FloatArray | None:
        """Peaks of contacts 2 ... p by Eq. 6, with p and F_SW of the map [N], shape (p - 1,)."""
        return self._by_equations[0]

    @property
    def eq9(self) -> FloatArray | None:
        """Peaks of contacts 2 ... p + 1 by Eq. 9, with F_2 of Eq. 6 [N], shape (p,)."""
        return self._by_equations[1]

    @functools.cached_property
    def _by_equations(self) -> tuple[FloatArray, FloatArray] | tuple[None, None]:
        p, wave_force = self.transition_granules, self.wave_force
        if p is None or wave_force is None:
            return None, None
        return transition_peaks(self.scene, p, wave_force)

    @functools.cached_property
    def speed(self) -> Estimate | None:
        """V_SW [m/s]."""
        return self._estimate(paper.solitary_wave_speed, exact.speed)

    @functools.cached_property
    def momentum(self) -> Estimate | None:
        """L_SW [N s]."""
        return self._estimate(paper.solitary_wave_momentum, exact.momentum)

    def _estimate(
        self, of_paper: Callable[[Chain, float], float], truth: Callable[[Chain, float], float]
    ) -> Estimate | None:
        near, far, chain = self.wave_force, self.far_field_force, self.scene.chain
        if near is None or far is None:
            return None
        return Estimate(of_paper(chain, near), truth(chain, near), truth(chain, far))

    @property
    def rows(self) -> list[dict[str, float | int | None]]:
        """One row per contact, with contact, map_N, eq6_N and eq9_N; None where undefined."""
        values = (self.peak_force, self.eq6, self.eq9)
        columns = ([] if column is None else or_none(column) for column in values)
        contacts, names = range(2, self.peak_force.size + 2), ("contact", "map_N", "eq6_N", "eq9_N")
        return [dict(zip(names, row, strict=True)) for row in zip_longest(contacts, *columns)]

    @property
    def constants(self) -> tuple[Constant, ...]:
        """The paper's constants with the exact ones, if they apply to this scene's chain."""
        return constants() if self.scene.is_plain else ()

    def to_dict(self) -> dict[str, Any]:
        """Return the prediction as a JSON object; null stands for a missing value."""
        return {
            "missing": self.missing,
            "outside_range": self.note,
            "rise_time_s": self.scene.rise_time,
            "momentum_ratio": self.scene.momentum_ratio,
            "overlap_ratio": self.overlap_ratio,
            "warnings": list(self.warnings),
            "rows": self.rows,
            "transition_granules": self.transition_granules,
            "transition_candidates": list(self.candidates),
            "solitary_wave": {
                "peak_force_N": self.wave_force,
                "far_field_force_N": self.far_field_force,
            },
            "eq3_transition_granules": self.eq3,
            "speed_m_s": None if self.speed is None else self.speed.to_dict(),
            "momentum_N_s": None if self.momentum is None else self.momentum.to_dict(),
            "constants": [asdict(constant) for constant in self.constants],
            "map_error": {
                "peak_force": peak_map.PEAK_ERROR,
                "last_peak_force": LAST_PEAK_ERROR,
                "far_field_force": peak_map.FAR_FIELD_ERROR,
            },
            "provenance": {"hertzchain": version("hertzchain"), "numpy": version("numpy")},
        }


def not_about(scene: Scene, what: str) -> str | None:
    """Return why formulas do not apply to a scene, a sentence; None for the paper's own scenes."""
    if not scene.is_plain:
        return f"{what} are about uniform free chains, this one has {', '.join(scene.terms)}"
    if scene.pulse is None:
        return f"the shock is a {scene.shock.noun}: {what} are about Table 1's profiles"
    return None


def predict(scene: SceneLike) -> Prediction:
    """Predict a scene by the map of peaks, the paper's equations and the exact wave.

    This takes about 0.1 ms once the map of the profile is loaded, and as much again for properties
    that are computed on demand.

    Parameters
    ----------
    scene
        Any scene, or the path of its file. Numbers are missing beyond a uniform chain, under a
        pulse table and outside of the map.

    Raises
    ------
    SceneError
        If the argument is not a scene.
    OverlapTooLarge
        If granules would be pressed into one another by more than a radius.
    """
    scene = to_scene(scene)
    chain, pulse = scene.chain, scene.pulse
    nothing = np.full(min(chain.granules, peak_map.LAST_CONTACT) - 1, np.nan)
    if (missing := not_about(scene, "Eqs. 3 to 9 and the map")) is not None:
        return Prediction(scene, missing, None, nothing)
    assert pulse is not None
    ratio, n = scene.momentum_ratio, pulse.duration_ratio
    note = paper.outside_range(ratio, n)
    if (outside := peak_map.outside(ratio, n)) is not None:
        reason = f"{outside}: here they are {ratio:.6g} and {n:.6g}; hertzchain run simulates it"
        return Prediction(scene, reason, note, nothing)
    if chain.granules < (least := least_granules(ratio, n)):
        reason = (
            f"the free end lowers early peaks in a chain of {chain.granules} granules: the map is"
            f" for at least {least} under this pulse; hertzchain run simulates it"
        )
        return Prediction(scene, reason, note, nothing)
    mapped = peak_map.peaks(pulse.profile, ratio, n)
    peak_force = pulse.peak_force * mapped.peak_force[: nothing.size]
    if chain.granules <= peak_map.LAST_CONTACT:
        peak_force[-1] *= FREE_END
    refuse_deep_overlap(overlap_ratio(chain, float(np.max(peak_force))))
    p, candidates = _transition(peak_force, mapped.change_error)
    endless = "the transition does not end within this chain: no p, no F_SW"
    far_field_force = pulse.peak_force * mapped.far_field_force
    missing = endless if p is None else None
    return Prediction(scene, missing, note, peak_force, p, candidates, far_field_force)


def least_granules(momentum_ratio: float, duration_ratio: float) -> int:
    """Return the least number of granules for which the map holds for all contacts but the last.

    In shorter chains the free end acts on early contacts before their peak, which comes at the end
    of a long rise. Measured on 750 random scenes with every length to 60: from this length on,
    peaks are those of a long chain to 1e-4; with one granule fewer, 7e-4 was measured.
    """
    return max(6, math.ceil(9 * momentum_ratio / duration_ratio - 4))


def transition_peaks(scene: Scene, p: int, wave_force: float) -> tuple[FloatArray, FloatArray]:
    """Return peaks by Eq. 6 and by Eq. 9 (F_2 from Eq. 6) for p and F_SW [N]: (p - 1,) and (p,)."""
    pulse, rise_time = _shock(scene)
    ratio = paper.effective_momentum_ratio(scene.chain, pulse, rise_time)
    eq6 = paper.peak_force(np.arange(2, p + 1), p, wave_force, pulse.duration_ratio, ratio)
    return eq6, paper.peak_force_cubic(np.arange(2, p + 2), p, float(eq6[0]), wave_force)


def _shock(scene: Scene) -> tuple[Pulse, float]:
    """Return pulse and rise time [s] of a scene that has them."""
    assert scene.pulse is not None
    assert scene.rise_time is not None
    return scene.pulse, scene.rise_time


@functools.cache
def constants() -> tuple[Constant, ...]:
    """Return the constants of the paper next to the exact ones."""
    wave = exact.solitary_wave()
    return (
        Constant("V_SW, 7/10", paper.SPEED, exact.speed_coefficient()),
        Constant("L_SW, 139/32", PAPER_MOMENTUM, exact.momentum_coefficient()),
        Constant("Eq. 4b, shift 1.077", paper.SHIFT, wave.shift),
        Constant("Eq. 5, force integral 1.543", paper.FORCE_INTEGRAL, wave.force_integral),
        Constant("Eq. 5, momentum 53/32", paper.WAVE_MOMENTUM, wave.momentum),
    )


def _transition(
    peak_force: FloatArray, change_error: FloatArray
) -> tuple[int | None, tuple[int | None, ...]]:
    """Return p of interpolated peaks, and its possible values within the error of their changes."""
    passed = np.ones(peak_force.size, np.bool_)
    error = change_error[: peak_force.size - 2]
    least = transition_granules(peak_force, passed, STEADY + error)
    most = transition_granules(peak_force, passed, STEADY - error)
    if least == most:
        return least, (least,)
    p = transition_granules(peak_force, passed)
    return p, tuple(dict.fromkeys((least, p, most)))
