"""The linear chain: pressed chains that move so little that Hertz's law is one of linear springs.

A slow piston sends waves that are integrals of Bessel functions. Above the cut-off 2 w0 the motion
of a sine falls by exp(-kappa) from granule to granule. A weak push makes all modes of a chain of
heavy and light granules in turn ring; their frequencies lie in two bands, whose ends are
sqrt(2k'/M), sqrt(2k'/m) and sqrt(2k'(1/m + 1/M)), with the stiffness k' = 3/2 A^(2/3) F_pre^(1/3)
of a pressed contact (Brillouin, Wave Propagation in Periodic Structures).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from scipy.integrate import quad
from scipy.special import jv

import hertzchain as hc
from hertzchain.arrays import FloatArray
from validation.physics.chains import answers, steel
from validation.script import Row, Script, row, table_of
from validation.shipped import STEEL, history_of

FORCE = 10.0
"""Of the static load [N]."""

PRESSED = hc.Precompression(FORCE)

STRENGTH = 1e-3
"""Velocity of the piston over that of sound and the static overlap, and amplitude of the sine over
the load."""

CYCLES, LATE = 80, 30
"""Of a sine above the cut-off, and those at the end that are looked at."""

RATIO = 0.4
"""Mass of a light granule over that of a heavy one."""

GRANULES = 31
"""Heavy ones at both ends: a light one there would have a mode of its own between the bands."""

PUSH = 1e-4
"""Velocity of the push in units of the static overlap times (k'/M)^(1/2): Hertz's law is linear."""

PERIODS, SAMPLES = 800, 4096
"""Periods of the lowest cut-off that are recorded, and at how many instants. The two highest modes
are four lines of this spectrum apart."""

_LEAST = 1e-5
"""Power of a mode over that of the strongest, which is counted (chosen): the outermost modes hardly
move the end that is pushed, and side lobes of the window have a thousandth of what is next to
them."""

_RESOLUTION = "one line of the spectrum"
_LINEAR = "the curvature of Hertz's law leaves a part of the first order in the push"
_DELAYED = "steps of 0.01 natural time units delay the waves of LAMMPS: 1.2e-4 measured"


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for a piston, sines and bands; the quick form has no long sine, and bands by native."""
    rows = [*_slow_piston(with_lammps), *_bands(with_lammps and not quick)]
    return rows if quick else [*rows, *_evanescent()]


def linear_stiffness() -> float:
    """Stiffness k' of a contact under the static load [N/m]."""
    return 1.5 * math.cbrt(steel(2).contact_stiffness ** 2 * FORCE)


def frequency() -> float:
    """w0 of a linear chain of one mass, sqrt(k' / m) [1/s]."""
    return math.sqrt(linear_stiffness() / steel(2).granule_mass)


def static_overlap() -> float:
    """Overlap of a contact under the static load [m]."""
    return float((FORCE / steel(2).contact_stiffness) ** (2 / 3))


def passed_on(granule: int, time: float) -> float:
    """Velocity of a granule over that of a piston that starts at time 0; time in units of 1/w0."""
    if granule == 0:
        return 1.0
    order = 2 * granule
    return float(quad(lambda t: order * jv(order, 2 * t) / t, 0.0, time, limit=300)[0])


def _slow_piston(with_lammps: bool) -> list[Row]:
    """A slow piston on a pressed chain: velocities are integrals of Bessel functions."""
    w0, rows = frequency(), []
    velocity = STRENGTH * w0 * static_overlap()
    time = np.linspace(3.0, 25.0, 8)
    end = hc.Run(float(time[-1]) / w0)
    scene = hc.Scene(steel(40), hc.Piston(velocity), end, precompression=PRESSED)
    waves = np.array([[passed_on(j, float(t)) for j in range(12)] for t in time])
    for backend, result in answers(scene, with_lammps, time / w0).items():
        ratio = history_of(result).velocity[:, :12] / velocity
        off = float(np.max(np.abs(ratio - waves)))
        limit, reason = 2 * STRENGTH, _LINEAR
        if backend == "lammps":
            limit, reason = limit + 1.5e-4, f"{reason}; {_DELAYED}"
        what = "slow piston: velocities - linear chain"
        rows.append(row(what, backend, off, 0.0, limit, reason))
    return rows


def _evanescent() -> list[Row]:
    """Above the cut-off the motion falls by exp(-kappa) from granule to granule.

    The frequency over the cut-off is cosh(kappa / 2). The part of the frequency in the velocities
    is that of the last cycles, weighted with the square of a sine. The start of the sine makes the
    chain ring at the cut-off frequency; this lasts longer if the frequency of the sine is near the
    cut-off.
    """
    w0, rows = frequency(), []
    for ratio in (1.2, 1.5, 2.0):
        period = math.pi / (ratio * w0)
        sine, end = hc.Sine(STRENGTH * FORCE, 1 / period, CYCLES), hc.Run(CYCLES * period)
        scene = hc.Scene(steel(200), sine, end, precompression=PRESSED)
        share = np.linspace(0.0, 1.0, 24 * LATE + 1)
        time = (CYCLES - LATE + LATE * share) * period
        history = history_of(hc.Native(rtol=1e-9).run(scene, time))
        wave = np.exp(2j * ratio * w0 * time) * np.sin(np.pi * share) ** 2
        parts = np.abs(wave @ history.velocity[:, :3])
        rate = float(np.mean(np.log(parts[:-1] / parts[1:])))
        expected = 2 * math.acosh(ratio)
        reason = "what is left of the beginning, and of the curvature of Hertz's law"
        what = f"kappa at {ratio:g} cut-offs"
        rows.append(row(what, "native", rate, expected, 3e-5 * expected, reason))
    return rows


def cut_offs() -> FloatArray:
    """Ends of the bands of an infinite chain [rad/s]: of the lower one, and both of the upper."""
    heavy = steel(2).granule_mass
    light = RATIO * heavy
    return np.sqrt(2 * linear_stiffness() * np.array([1 / heavy, 1 / light, 1 / heavy + 1 / light]))


def modes(time: FloatArray, velocity: FloatArray) -> FloatArray:
    """Frequencies [rad/s] of the modes in a record of velocities, shape (times, granules).

    They are the maxima of the power of all granules, between lines by a parabola through the
    logarithms.
    """
    seen = (velocity - velocity.mean(axis=0)) * np.hanning(time.size)[:, None]
    power = np.sum(np.abs(np.fft.rfft(seen, axis=0)) ** 2, axis=1)
    line = 2 * math.pi / (time.size * (time[1] - time[0]))
    inner = power[1:-1]
    high = (inner > power[:-2]) & (inner > power[2:]) & (inner > _LEAST * np.max(power))
    at = np.nonzero(high)[0] + 1
    before, middle, after = (np.log(power[at + k]) for k in (-1, 0, 1))
    places = at + 0.5 * (before - after) / (before - 2 * middle + after)
    return np.asarray(line * places)


def _bands(with_lammps: bool) -> Iterator[Row]:
    """A row for each end of a band of a chain of two masses."""
    expected = cut_offs()
    end = PERIODS * 2 * math.pi / expected[0]
    time = np.linspace(0.0, end, SAMPLES)
    # Half of LAMMPS's usual steps are shifts of 1e-5 of a frequency.
    for backend, result in answers(_dimer(end), with_lammps, time, 0.02).items():
        rates = modes(time, history_of(result).velocity)
        middle = math.sqrt(expected[0] * expected[1])
        lower, upper = rates[rates < middle], rates[rates > middle]
        ends = {
            "top of the lower band": _end(lower[-1], lower[-2]),
            "bottom of the upper band": _end(upper[0], upper[1]),
            "top of the upper band": _end(upper[-1], upper[-2]),
        }
        for (what, at), true in zip(ends.items(), expected, strict=True):
            line = expected[0] / PERIODS / true
            yield row(f"{what} / cut-off", backend, at / true, 1.0, line, _RESOLUTION)


def _dimer(end: float) -> hc.Scene:
    """A pressed chain of two masses, whose first granule gets a weak push, until a time [s]."""
    density = np.where(np.arange(GRANULES) % 2 == 0, 1.0, RATIO) * STEEL["density"]
    push = hc.Striker(PUSH * frequency() * static_overlap(), loaded=True)
    return hc.Scene(steel(GRANULES, density=density), push, hc.Run(end), precompression=PRESSED)


def _end(outermost: float, following: float) -> float:
    """The end of a band of an infinite chain, from the two outermost modes of a finite one.

    They lie at phases of 1 and 2 times pi / N from the end, where the frequency is stationary: 1
    and 4 times as far from it.
    """
    return outermost + (outermost - following) / 3


SCRIPTS = {
    "linear_chain": Script(
        "The linear chain",
        "Does a pressed chain that hardly moves do what the linear chain does?",
        table_of(compare),
    )
}  # fmt: skip
