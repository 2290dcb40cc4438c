"""Pistons and sines: collisions, trains of waves, and the linear chain below and above its cut-off.

Forces of a piston in a chain at rest are those of SciPy's DOP853 with tolerances of 1e-12 and
1e-13, whose digits agree.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad
from scipy.special import jv

import hertzchain as hc
from validation.physics.chains import EXTRAPOLATED, answers, history_of, steel, units_of
from validation.rows import Row, row
from validation.script import Script, rows_only

PISTON = {2: 1.18402354, 11: 1.93713472, 21: 2.14055010}
"""Peak force of contacts of 30 granules under a piston; m = A = v = 1."""

FORCE, STRENGTH = 10.0, 1e-3
"""Static load [N]; velocity of the piston over that of sound and the static overlap, and amplitude
of the sine over the load."""

CYCLES, LATE = 80, 30
"""Of a sine above the cut-off, and those at the end that are looked at."""

_DIGIT = "half a unit of the last digit that is known"
_LINEAR = "the curvature of Hertz's law leaves a part of the first order in the push"
_DELAYED = "steps of 0.01 natural time units delay the waves of LAMMPS: 1.2e-4 measured"


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for pistons and sines; the quick form has no long sine."""
    rows = [*_collision(with_lammps), *_train(with_lammps), *_slow_piston(with_lammps)]
    return rows if quick else [*rows, *_evanescent()]


def frequency() -> float:
    """w0 of a linear chain, sqrt(k' / m) with k' = 3/2 F^(1/3) A^(2/3) [1/s]."""
    chain = steel(2)
    linear = 1.5 * math.cbrt(FORCE * chain.contact_stiffness**2)
    return math.sqrt(linear / chain.granule_mass)


def passed_on(granule: int, time: float) -> float:
    """Velocity of a granule over that of a piston that starts at time 0; time in units of 1/w0."""
    if granule == 0:
        return 1.0
    order = 2 * granule
    return float(quad(lambda t: order * jv(order, 2 * t) / t, 0.0, time, limit=300)[0])


def _collision(with_lammps: bool) -> list[Row]:
    """A granule that a piston hits leaves with twice its velocity."""
    scene, unit, rows = hc.Scene(steel(2), hc.Piston(1.0)), units_of(1.0), []
    for backend, result in answers(scene, with_lammps).items():
        limit, reason = (1e-9, "asked for") if backend == "native" else (1e-6, EXTRAPOLATED)
        force, speed = result.peak_force[0] / unit.force, result.velocity[1]
        rows += [
            row("granule 2 alone: F", backend, force, 1.25**0.6, limit, reason),
            row("granule 2 alone: velocity", backend, speed, 2.0, 10 * limit, reason),
        ]
    return rows


def _train(with_lammps: bool) -> list[Row]:
    """The train of waves ahead of a piston in a chain at rest."""
    scene, unit, rows = hc.Scene(steel(30), hc.Piston(1.0)), units_of(1.0), []
    for backend, result in answers(scene, with_lammps).items():
        for contact, force in PISTON.items():
            reason = _DIGIT if backend == "native" else f"{_DIGIT}; {EXTRAPOLATED}"
            limit = 5.1e-9 if backend == "native" else 5e-7
            found = result.peak_force[contact - 2] / unit.force
            rows.append(
                row(f"chain at rest: contact {contact}", backend, found, force, limit, reason)
            )
    return rows


def _slow_piston(with_lammps: bool) -> list[Row]:
    """A slow piston on a pressed chain: velocities are integrals of Bessel functions."""
    chain, w0, rows = steel(40), frequency(), []
    velocity = STRENGTH * w0 * (FORCE / chain.contact_stiffness) ** (2 / 3)
    time = np.linspace(3.0, 25.0, 8)
    end, pressed = hc.Run(float(time[-1]) / w0), hc.Precompression(FORCE)
    scene = hc.Scene(chain, hc.Piston(velocity), end, precompression=pressed)
    waves = np.array([[passed_on(j, float(t)) for j in range(12)] for t in time])
    for backend, result in answers(scene, with_lammps, time / w0).items():
        found = history_of(result).velocity[:, :12] / velocity
        off = float(np.max(np.abs(found - waves)))
        limit, reason = 2 * STRENGTH, _LINEAR
        if backend == "lammps":
            limit, reason = limit + 1.5e-4, f"{reason}; {_DELAYED}"
        what = "slow piston: velocities - linear chain"
        rows.append(row(what, backend, off, 0.0, limit, reason))
    return rows


def _evanescent() -> list[Row]:
    """Above the cut-off the motion falls by exp(-kappa) from granule to granule.

    The frequency over the cut-off is cosh(kappa / 2). The part of the frequency in the velocities
    is that of the last cycles, weighted with the square of a sine. The beginning rings at the
    cut-off, for longer the nearer the sine is.
    """
    w0, rows, pressed = frequency(), [], hc.Precompression(FORCE)
    for ratio in (1.2, 1.5, 2.0):
        period = math.pi / (ratio * w0)
        sine, end = hc.Sine(STRENGTH * FORCE, 1 / period, CYCLES), hc.Run(CYCLES * period)
        scene = hc.Scene(steel(200), sine, end, precompression=pressed)
        share = np.linspace(0.0, 1.0, 24 * LATE + 1)
        time = (CYCLES - LATE + LATE * share) * period
        history = history_of(hc.Native(rtol=1e-9).run(scene, time))
        wave = np.exp(2j * ratio * w0 * time) * np.sin(np.pi * share) ** 2
        parts = np.abs(wave @ history.velocity[:, :3])
        found = float(np.mean(np.log(parts[:-1] / parts[1:])))
        expected = 2 * math.acosh(ratio)
        reason = "what is left of the beginning, and of the curvature of Hertz's law"
        what = f"kappa at {ratio:g} cut-offs"
        rows.append(row(what, "native", found, expected, 3e-5 * expected, reason))
    return rows


SCRIPT = Script(
    "Pistons and sines",
    "What does a chain do whose end is moved, or shaken?",
    "native, LAMMPS; closed forms, SciPy's DOP853, Bessel functions",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
