"""Shared parts of the scripts in this folder: steel chains, their simulation, natural units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.observables.samples import History
from validation.shipped import STEEL, history_of

LAMMPS_STEP = 0.01
"""Natural time units of the fastest contact; extrapolated peaks are right to about 1e-8 then."""

EXTRAPOLATED = "LAMMPS: two runs with steps of 0.01 natural time units and half of it, extrapolated"


def answers(
    scene: hc.Scene, with_lammps: bool, record: ArrayLike | None = None, step: float = LAMMPS_STEP
) -> dict[str, hc.Result]:
    """The result of each backend for a scene: native to 1e-9, LAMMPS extrapolated."""
    results = {"native": hc.Native(rtol=1e-9).run(scene, record)}
    if with_lammps:
        lammps = hc.Lammps(step * scene.contact_time, extrapolated=record is None)
        results["lammps"] = lammps.run(scene, record)
    return results


def steel(granules: int, **different: Any) -> hc.Chain:
    """Return a chain of the paper's granules, or of different ones."""
    return hc.Chain(granules, **STEEL | different)


@dataclass(frozen=True)
class Units:
    """Units in which mass and contact stiffness of the steel granules, and a velocity, are 1."""

    force: float
    velocity: float
    time: float


def units_of(velocity: float) -> Units:
    """The units of a velocity [m/s]."""
    chain = steel(2)
    mass, stiffness = chain.granule_mass, chain.contact_stiffness
    length = (mass * velocity**2 / stiffness) ** 0.4
    return Units(stiffness * length**1.5, velocity, length / velocity)


def crest(history: History, contact: int) -> tuple[float, float]:
    """Time [s] and height [N] of the largest force of a contact that was recorded.

    A parabola through the logarithms of the largest sample and its neighbours.
    """
    force = history.contact_force[:, contact]
    k = int(np.argmax(force))
    return _vertex(history.time[k - 1 : k + 2], np.log(force[k - 1 : k + 2]))


def _vertex(time: FloatArray, logarithm: FloatArray) -> tuple[float, float]:
    before, at, after = logarithm
    shift = 0.5 * (before - after) / (before - 2 * at + after)
    top = at - 0.25 * (before - after) * shift
    return float(time[1] + shift * (time[1] - time[0])), float(np.exp(top))


__all__ = ["EXTRAPOLATED", "Units", "answers", "crest", "history_of", "steel", "units_of"]
