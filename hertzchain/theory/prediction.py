"""A scene without a simulation: peaks from the map, the paper's equations, the exact wave."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray, or_none
from hertzchain.observables.transition import STEADY, transition_granules
from hertzchain.scene.chain import Chain
from hertzchain.scene.natural_units import PAPER_MOMENTUM
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.scene import Scene
from hertzchain.scene.validity import overlap_ratio, overlap_warning, refuse_deep_overlap
from hertzchain.theory import paper, peak_map
from hertzchain.theory import solitary_wave as exact

FREE_END = 0.97597  # peak of contact N over that in a longer chain, once the wave has formed

LAST_PEAK_ERROR = 0.02
"""Relative error of the peak of contact N, at most. Measured 0.016 in chains of 6 granules, where
the wave has not formed yet, and below 0.01 from 10 granules on."""


@dataclass(frozen=True)
class Constant:
    """A constant of the paper and its exact value.

    Parameters
    ----------
    name
        Where it stands and what it is.
    paper, exact
        The values.
    """

    name: str
    paper: float
    exact: float

    @property
    def difference(self) -> float:
        """Of the paper's value from the exact one, relative."""
        return self.paper / self.exact - 1


@dataclass(frozen=True)
class Estimate:
    """A property of the solitary wave: as the paper has it, and as it is.

    Parameters
    ----------
    paper, exact
        With the paper's constant and with the exact one, both of a wave of height F_SW.
    far_field
        What it tends to: the exact one of a wave as high as the far field.
    """

    paper: float
    exact: float
    far_field: float

    @property
    def closer(self) -> str:
        """Whose constant, at F_SW, is closer to the far field, ``paper`` or ``exact``.

        F_SW is below the far field after long pulses, and a constant that is too large makes up for
        it there.
        """
        off = abs(self.paper - self.far_field), abs(self.exact - self.far_field)
        return "paper" if off[0] < off[1] else "exact"

    def to_dict(self) -> dict[str, float | str]:
        """The estimate as JSON knows it."""
        return {**asdict(self), "closer": self.closer}


@dataclass(frozen=True, eq=False)
class Prediction:
    """What can be said of a scene without a simulation; None and NaN where nothing can.

    It is about a chain that is watched until every contact has peaked: ``run.end_time`` of a scene
    changes nothing.

    Parameters
    ----------
    scene
        The scene.
    missing
        Why numbers are missing, or None where none are.
    note
        Where the scene lies outside what the paper covers; None inside.
    peak_force
        Of contacts 2 ... min(N, 80), from the map [N], shape (min(N, 80) - 1,). Right to
        peak_map.PEAK_ERROR; contact N, at the free end, to LAST_PEAK_ERROR.
    transition_granules
        p of these peaks, by the same function as for runs.
    candidates
        What p can be, as the peaks are known only to some accuracy: p alone, or p and its rival;
        None among them where the transition may not end in this chain.
    far_field_force
        What the peaks of an endless chain tend to [N]. Right to peak_map.FAR_FIELD_ERROR.
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
        """The largest overlap over the radius R; Hertz's law is for small ones."""
        if np.isnan(self.peak_force).any():
            return None
        return overlap_ratio(self.scene.chain, float(np.max(self.peak_force)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on where the model is stretched; none, as a rule."""
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
        """Eq. 3's p, not rounded, with the F_SW of the map."""
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
        size = self.peak_force.size
        columns = (
            range(2, size + 2),
            *(_padded(values, size) for values in (self.peak_force, self.eq6, self.eq9)),
        )
        names = ("contact", "map_N", "eq6_N", "eq9_N")
        return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]

    def to_dict(self) -> dict[str, Any]:
        """The prediction as JSON knows it; null stands for what is not there."""
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
            "constants": [asdict(one) for one in constants()] if self.scene.is_plain else [],
            "map_error": {
                "peak_force": peak_map.PEAK_ERROR,
                "last_peak_force": LAST_PEAK_ERROR,
                "far_field_force": peak_map.FAR_FIELD_ERROR,
            },
            "provenance": {"hertzchain": version("hertzchain"), "numpy": version("numpy")},
        }


def predict(scene: Scene) -> Prediction:
    """All that the map, the paper's equations and the exact wave say of a scene.

    Some 0.1 ms once the map of the profile is loaded, and as much again for what is computed when
    it is asked for.

    Parameters
    ----------
    scene
        Any scene; of terms, of a pulse table and outside of the map nothing is said.

    Raises
    ------
    OverlapTooLarge
        If granules would be pressed into one another by more than a radius.
    """
    chain, pulse = scene.chain, scene.shock
    nothing = np.full(min(chain.granules, peak_map.LAST_CONTACT) - 1, np.nan)
    if not scene.is_plain:
        has = ", ".join(scene.terms)
        missing = (
            "Eqs. 3 to 9, their constants and the map are about uniform free chains, this one has"
            f" {has}"
        )
        return Prediction(scene, missing, None, nothing)
    if not isinstance(pulse, Pulse):
        missing = "the shock is a pulse table: Eqs. 3 to 9 and the map are about Table 1's profiles"
        return Prediction(scene, missing, None, nothing)
    ratio, n = scene.momentum_ratio, pulse.duration_ratio
    note = paper.outside_range(ratio, n)
    reason = _outside_map(chain, ratio, n)
    if reason is not None:
        return Prediction(scene, reason, note, nothing)
    mapped = peak_map.peaks(pulse.profile, ratio, n)
    peak_force = pulse.peak_force * mapped.peak_force[: nothing.size]
    if chain.granules <= peak_map.LAST_CONTACT:
        peak_force[-1] *= FREE_END
    refuse_deep_overlap(overlap_ratio(chain, float(np.max(peak_force))))
    p, candidates = _transition(peak_force, mapped.change_error)
    if p is None:
        reason = "the transition does not end within this chain: no p, no F_SW"
    far_field_force = pulse.peak_force * mapped.far_field_force
    return Prediction(scene, reason, note, peak_force, p, candidates, far_field_force)


def least_granules(momentum_ratio: float, duration_ratio: float) -> int:
    """So long has a chain to be for the map to hold for all contacts but the last.

    In shorter ones the free end is felt before the early contacts have peaked, which is at the end
    of a long rise. Measured on 750 random scenes with every length to 60: from this length on,
    peaks are those of a long chain to 1e-4; with one granule fewer, 7e-4 was seen.
    """
    return max(6, math.ceil(9 * momentum_ratio / duration_ratio - 4))


def transition_peaks(scene: Scene, p: int, wave_force: float) -> tuple[FloatArray, FloatArray]:
    """Peaks by Eq. 6 and by Eq. 9, with F_2 of Eq. 6, given p and F_SW [N]: (p - 1,) and (p,)."""
    pulse, rise_time = _shock(scene)
    ratio = paper.effective_momentum_ratio(scene.chain, pulse, rise_time)
    eq6 = paper.peak_force(np.arange(2, p + 1), p, wave_force, pulse.duration_ratio, ratio)
    return eq6, paper.peak_force_cubic(np.arange(2, p + 2), p, float(eq6[0]), wave_force)


def _shock(scene: Scene) -> tuple[Pulse, float]:
    """Pulse and rise time [s] of a scene that has them."""
    assert isinstance(scene.shock, Pulse)
    assert scene.rise_time is not None
    return scene.shock, scene.rise_time


@functools.cache
def constants() -> tuple[Constant, ...]:
    """The constants of the paper beside the exact ones."""
    wave = exact.solitary_wave()
    return (
        Constant("V_SW, 7/10", paper.SPEED, exact.speed_coefficient()),
        Constant("L_SW, 139/32", PAPER_MOMENTUM, exact.momentum_coefficient()),
        Constant("Eq. 4b, shift 1.077", paper.SHIFT, wave.shift),
        Constant("Eq. 5, force integral 1.543", paper.FORCE_INTEGRAL, wave.force_integral),
        Constant("Eq. 5, momentum 53/32", paper.WAVE_MOMENTUM, wave.momentum),
    )


def _outside_map(chain: Chain, ratio: float, n: float) -> str | None:
    outside = peak_map.outside(ratio, n)
    if outside is not None:
        return f"{outside}: here they are {ratio:.6g} and {n:.6g}; a run needs no map"
    least = least_granules(ratio, n)
    if chain.granules < least:
        return (
            f"the free end lowers early peaks in a chain of {chain.granules} granules: the map is"
            f" for at least {least} under this pulse; a run needs no map"
        )
    return None


def _transition(
    peak_force: FloatArray, change_error: FloatArray
) -> tuple[int | None, tuple[int | None, ...]]:
    """The p of interpolated peaks, and what it can be with the error of their changes."""
    passed = np.ones(peak_force.size, np.bool_)
    error = change_error[: peak_force.size - 2]
    least = transition_granules(peak_force, passed, STEADY + error)
    most = transition_granules(peak_force, passed, STEADY - error)
    if least == most:
        return least, (least,)
    p = transition_granules(peak_force, passed)
    return p, tuple(dict.fromkeys((least, p, most)))


def _padded(values: FloatArray | None, size: int) -> list[float | None]:
    """Values as JSON knows them, to a given length."""
    known = [] if values is None else or_none(values)
    return known + [None] * (size - len(known))
