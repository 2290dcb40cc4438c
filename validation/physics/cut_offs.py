"""Cut-off frequencies of a pressed chain of heavy and light granules in turn, from a spectrum.

A weak push makes all modes of the chain ring. Their frequencies lie in two bands, whose ends are
sqrt(2k'/M), sqrt(2k'/m) and sqrt(2k'(1/m + 1/M)), with the stiffness k' = 3/2 A^(2/3) F_pre^(1/3)
of a pressed contact (Brillouin, Wave Propagation in Periodic Structures).
"""

from __future__ import annotations

import math

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from validation.physics.chains import answers, history_of, steel
from validation.rows import Row, row
from validation.script import Script, rows_only
from validation.shipped import STEEL

RATIO = 0.4
"""Mass of a light granule over that of a heavy one."""

GRANULES = 31
"""Heavy ones at both ends: a light one there would have a mode of its own between the bands."""

FORCE = 10.0
"""Of the static load [N]."""

STRENGTH = 1e-4
"""Velocity of the push in units of the static overlap times (k'/M)^(1/2): Hertz's law is linear."""

PERIODS, SAMPLES = 800, 4096
"""Periods of the lowest cut-off that are recorded, and at how many instants. The two highest modes
are four lines of this spectrum apart."""

_LEAST = 1e-5
"""Power of a mode over that of the strongest, which is counted (chosen): the outermost modes hardly
move the end that is pushed, and side lobes of the window have a thousandth of what is next to
them."""

_RESOLUTION = "one line of the spectrum"


def scene(end: float) -> hc.Scene:
    """A chain of two masses under a static load; its first granule gets a weak push."""
    density = np.where(np.arange(GRANULES) % 2 == 0, 1.0, RATIO) * STEEL["density"]
    pressed = hc.Precompression(FORCE)
    velocity = STRENGTH * math.sqrt(linear_stiffness() / steel(2).granule_mass)
    velocity *= (FORCE / steel(2).contact_stiffness) ** (2 / 3)
    chain = steel(GRANULES, density=density)
    return hc.Scene(chain, hc.Striker(velocity, loaded=True), hc.Run(end), precompression=pressed)


def linear_stiffness() -> float:
    """Stiffness k' of a contact under the static load [N/m]."""
    return 1.5 * math.cbrt(steel(2).contact_stiffness ** 2 * FORCE)


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
    before, here, after = (np.log(power[at + k]) for k in (-1, 0, 1))
    places = at + 0.5 * (before - after) / (before - 2 * here + after)
    return np.asarray(line * places)


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """A row for each end of a band; the quick form asks native alone."""
    expected = cut_offs()
    end = PERIODS * 2 * math.pi / expected[0]
    time = np.linspace(0.0, end, SAMPLES)
    rows = []
    # Half of LAMMPS's usual steps are shifts of 1e-5 of a frequency.
    for backend, result in answers(scene(end), with_lammps and not quick, time, 0.02).items():
        found = modes(time, history_of(result).velocity)
        middle = math.sqrt(expected[0] * expected[1])
        lower, upper = found[found < middle], found[found > middle]
        ends = {
            "top of the lower band": _end(lower[-1], lower[-2]),
            "bottom of the upper band": _end(upper[0], upper[1]),
            "top of the upper band": _end(upper[-1], upper[-2]),
        }
        for (what, at), true in zip(ends.items(), expected, strict=True):
            line = expected[0] / PERIODS / true
            rows.append(row(f"{what} / cut-off", backend, at / true, 1.0, line, _RESOLUTION))
    return rows


def _end(outermost: float, following: float) -> float:
    """The end of a band of an infinite chain, from the two outermost modes of a finite one.

    They lie at phases of 1 and 2 times pi / N from the end, where the frequency is stationary: 1
    and 4 times as far from it.
    """
    return outermost + (outermost - following) / 3


SCRIPT = Script(
    "Cut-off frequencies of a pressed dimer",
    "Where do the bands of a pressed chain of two masses end?",
    "native, LAMMPS; the dispersion of a diatomic lattice",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
