"""The paper's formulas next to a simulation, with its p and F_SW."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.observables.result import Result
from hertzchain.theory import solitary_wave as exact
from hertzchain.theory.prediction import not_about, transition_peaks


@dataclass(frozen=True)
class Formulas:
    """Values of the paper's formulas, given p and F_SW from a simulation.

    Parameters
    ----------
    applicable
        Reason why they do not apply; None where they do.
    note
        Why the scene lies outside the range of the paper; None inside it.
    transition_granules
        p of Eq. 3, not rounded.
    eq6, eq9
        Peak force of contacts 2 ... N [N], NaN where the formula gives none, shape (N - 1,).
    speed, exact_speed
        V_SW of the paper and of the exact solitary wave, both at F_SW [m/s].
    """

    applicable: str | None
    note: str | None
    transition_granules: float | None
    eq6: FloatArray
    eq9: FloatArray
    speed: float | None
    exact_speed: float | None

    def to_dict(self) -> dict[str, Any]:
        """Return the formulas as a JSON object; their peak forces are in the rows."""
        return {
            "not_applicable": self.applicable,
            "outside_range": self.note,
            "transition_granules": self.transition_granules,
            "speed_m_s": self.speed,
            "exact_speed_m_s": self.exact_speed,
        }


def formulas(reference: Result) -> Formulas:
    """Evaluate the formulas with p and F_SW of a simulation, and the exact solitary wave."""
    scene, p, wave = reference.scene, reference.transition_granules, reference.solitary_wave
    nothing = np.full(reference.contact.size, np.nan)
    reason = not_about(scene, "Eqs. 3 to 9")
    if reason is None and (p is None or wave.peak_force is None):
        reason = "the transition does not end within this chain and run: no p, no F_SW"
    if reason is not None:
        return Formulas(reason, None, None, nothing, nothing, None, None)
    pulse = scene.pulse
    assert pulse is not None
    assert p is not None
    assert wave.peak_force is not None
    chain, rise_time = scene.chain, scene.rise_time
    assert rise_time is not None
    eq6, eq9 = nothing.copy(), nothing.copy()
    eq6[: p - 1], eq9[:p] = transition_peaks(scene, p, wave.peak_force)
    return Formulas(
        applicable=None,
        note=theory.outside_range(scene.momentum_ratio, pulse.duration_ratio),
        transition_granules=theory.transition_granules(chain, pulse, rise_time, wave.peak_force),
        eq6=eq6,
        eq9=eq9,
        speed=theory.solitary_wave_speed(chain, wave.peak_force),
        exact_speed=exact.speed(chain, wave.peak_force),
    )
