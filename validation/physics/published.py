"""Numbers that others have published, found again: each by native, and where it can by LAMMPS.

Tolerances are half a unit of the last published digit, or what the steps cost. Not in the table, as
the scenes are not known well enough to be found again: the chain of 60 beads of MOOSE (0.67962 m/s,
3.96 diameters), the exponents in gravity of Hong, Ji and Kim (1999), the balance of Molinari and
Daraio (2009). A further ratio of dimers, 0.04537, comes out as 0.04536 here.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import hertzchain as hc
from hertzchain.theory.restitution import of_natural, of_ratio
from validation.physics.chains import (
    Number,
    compare_numbers,
    duration_of,
    peak_of,
    steel,
    velocity_of,
)
from validation.physics.restitution import BETAN_PER_RATIO, betan
from validation.script import Row, Script, table_of
from validation.shipped import STEEL

CHUNG = "Chung and Ooi, Granular Matter 13 (2011) 643, as Yade has it"
THORNTON = "Thornton, Cummins and Cleary, Powder Technology 233 (2013) 30"
KUWABARA = "Kuwabara and Kono, Jpn. J. Appl. Phys. 26 (1987) 1230"
UNITTEST = "LAMMPS, unittest/granular"
HERRMANN = "Herrmann and Seitz, Am. J. Phys. 50 (1982) 977"
NESTERENKO = "the wave of an equal striker, in the literature"
DIMERS = "Jayaprakash, Starosvetsky and Vakakis, Phys. Rev. E 83 (2011) 036606"
HERTZ = "Hertz (1882); 2.943 belongs to the depth over the velocity"
SCHWAGER = "Schwager and Poeschel, Phys. Rev. E 57 (1998) 650"

_DIGIT = "half a unit of the last digit; 1e-9 that native may err, or what LAMMPS's steps cost"
_FROM, _TO = 50, 70  # contacts between which the wave of a striker has settled


def _number(
    source: str, what: str, value: float, digit: float, scene: hc.Scene | None,
    measure: Callable[[Any], float], by_lammps: float = 1e-6,
) -> Number:  # fmt: skip
    """A published number: a unit of its last digit, two where digits were cut off.

    ``by_lammps`` is the relative error of LAMMPS besides, of steps of 0.01 natural time units.
    """
    limits = (0.5 * digit + besides * abs(value) for besides in (1e-9, by_lammps))
    return Number(f"{source}: {what}", value, scene, measure, _DIGIT, *limits)


def _of(radius: float, young: float, poisson: float, density: float) -> dict[str, float]:
    names = "radius", "young_modulus", "poisson_ratio", "density"
    return dict(zip(names, (radius, young, poisson, density), strict=True))


def _pair(speed: float, damping: float | None = None, **granule: float) -> hc.Scene:
    """Two alike spheres that close with a speed, perhaps viscoelastic ones that may pull."""
    law = None
    if damping is not None:
        law = hc.Contact("viscoelastic", relaxation_time=damping, attraction=True)
    return hc.Scene(hc.Chain(2, **granule), hc.Striker(speed), contact=law)


def _on_wall(speed: float, **granule: float) -> hc.Scene:
    """A sphere that meets a rigid wall, after an equal one has given it all its speed."""
    chain, wall = hc.Chain(2, **granule), hc.Wall("rigid", gap=0.1 * granule["radius"])
    return hc.Scene(chain, hc.Striker(speed), wall=wall)


def _depth(contact: int) -> Callable[[hc.Result], float]:
    def depth(result: hc.Result) -> float:
        stiffness = result.scene.granules.stiffness[contact]
        return float((result.peak_force[contact] / stiffness) ** (2 / 3))

    return depth


def _time_over_hertz(result: hc.Result) -> float:
    """Duration over (m*^2 / (R* E*^2 v))^(1/5), with 4/3 E* sqrt(R*) the stiffness."""
    granules, speed = result.scene.granules, float(result.scene.shock.start_velocity)
    stiffness, mass = 0.75 * float(granules.stiffness[0]), float(granules.contact_mass[0])
    return duration_of(float((mass**2 / (stiffness**2 * speed)) ** 0.2))(result)


def _restitution(result: hc.Result) -> float:
    return float((result.velocity[1] - result.velocity[0]) / result.scene.shock.start_velocity)


def _wave_speed(result: hc.Result) -> float:
    chain = result.scene.chain
    unit = 2 * chain.radius * (chain.contact_stiffness / chain.granule_mass) ** 0.4
    return float(result.wave(_FROM, _TO).speed / unit)


@functools.cache
def _passing() -> tuple[float, float]:
    """Largest velocity of a granule in the wave of a striker, over its, and the kinetic share."""
    scene, native = hc.Scene(steel(100), hc.Striker(1.0)), hc.Native(rtol=1e-9)
    first, chain = native.run(scene).first_pulses, scene.chain
    assert first is not None
    # Whole periods: kinetic and potential energy change with the place within a granule.
    times = np.linspace(first.arrival[_FROM - 2], first.arrival[_TO - 2], 4001)
    seen = native.run(scene, record=times).history
    assert seen is not None
    behind = _FROM - 20  # far from granules that the striker left rattling
    kinetic = 0.5 * chain.granule_mass * np.sum(seen.velocity[:, behind:] ** 2, axis=1)
    force = seen.contact_force[:, behind:]
    potential = 0.4 * np.sum(force ** (5 / 3), axis=1) / chain.contact_stiffness ** (2 / 3)
    share = np.mean(kinetic[:-1]) / np.mean((kinetic + potential)[:-1])
    return float(np.max(seen.velocity[:, (_FROM + _TO) // 2])), float(share)


def _dimer(ratio: float) -> hc.Scene:
    """A striker on a chain of heavy and light granules by turns, a heavy one first."""
    density = np.where(np.arange(150) % 2 == 0, 1.0, ratio) * STEEL["density"]
    return hc.Scene(steel(150, density=density), hc.Striker(1.0))


def _decay(result: hc.Result) -> float:
    """Return what a wave loses of its height from contact 101 to 121."""
    return float(1 - result.peak_force[120] / result.peak_force[100])


def _extremum(ratio: float, _: object) -> float:
    """Mass ratio near a given one at which a wave decays least, or most: that of a parabola."""
    step = 3e-4 * ratio
    scenes = (_dimer(ratio + k * step) for k in (-1, 0, 1))
    below, at, above = (_decay(hc.Native("reference").run(scene)) for scene in scenes)
    return float(ratio + 0.5 * step * (below - above) / (below - 2 * at + above))


def _of_en(asked: float, _: object) -> float:
    return of_ratio(betan(asked) / BETAN_PER_RATIO, False)


GLASS, LIMESTONE = _of(0.01, 48e9, 0.2, 2800.0), _of(0.01, 20e9, 0.25, 2500.0)
ALUMINIUM, MAGNESIUM = _of(0.1, 70e9, 0.3, 2699.0), _of(0.1, 40e9, 0.35, 1800.0)
SOFT, UNIT = _of(0.01, 1e8, 0.3, 2500.0), _of(2.5e-3, 5e10, 0.25, 7000.0)
THREE, LONG = hc.Scene(steel(3), hc.Striker(1.0)), hc.Scene(steel(100), hc.Striker(1.0))

NUMBERS = (
    _number(CHUNG, "glass: force [N]", 10696.88899, 1e-5, _pair(20.0, **GLASS), peak_of(0)),
    _number(CHUNG, "limestone: force [N]", 7108.241, 1e-3, _pair(20.0, **LIMESTONE), peak_of(0)),
    _number(CHUNG, "limestone: depth [m]", 368.304e-6, 1e-9, _pair(20.0, **LIMESTONE), _depth(0)),
    _number(CHUNG, "limestone: time [s]", 54.201e-6, 1e-9, _pair(20.0, **LIMESTONE), duration_of()),
    _number(CHUNG, "aluminium, wall: force [N]", 11369.858, 1e-3, _on_wall(0.2, **ALUMINIUM),
           peak_of(-1)),
    _number(CHUNG, "magnesium, wall: force [N]", 7232.681, 1e-3, _on_wall(0.2, **MAGNESIUM),
           peak_of(-1)),
    _number(UNITTEST, "wall: force [N]", 384.0524, 1e-4, _on_wall(3.9, **UNIT), peak_of(-1),
           1e-5),
    _number(UNITTEST, "wall: depth [m]", 22.6806e-6, 1e-10, _on_wall(3.9, **UNIT), _depth(-1),
            1e-5),
    _number(HERTZ, "time / (m*^2 / (R* E*^2 v))^(1/5)", 2.868, 1e-3, _pair(1.0, **STEEL),
           _time_over_hertz),
    *(_number(KUWABARA, f"restitution at {speed:g} m/s", e, 1e-5, _pair(speed, 5e-5, **SOFT),
             _restitution, 1e-3)
      for speed, e in ((0.1, 0.80865), (0.3, 0.76828), (1.0, 0.71617), (3.0, 0.66100))),
    *(_number(HERRMANN, f"three balls: velocity {k}", v, 1e-4, THREE, velocity_of(k), 1e-4)
      for k, v in ((1, -0.0710), (2, 0.0764), (3, 0.9945))),
    _number(NESTERENKO, "speed / (2 R (A/m)^0.4 v^0.2)", 0.84051, 1e-5, LONG, _wave_speed, 1e-4),
    _number(NESTERENKO, "largest velocity of a granule / v", 0.68163, 2e-5, None,
           lambda _: _passing()[0]),
    _number(NESTERENKO, "kinetic share", 5 / 9, 1e-9, None, lambda _: _passing()[1]),
    *(_number(THORNTON, f"restitution of Yade's en = {asked:g}", e, 1e-5, None,
             functools.partial(_of_en, asked))
      for asked, e in ((0.2, 0.20025), (0.5, 0.50001), (0.7, 0.69977), (0.8, 0.79993),
                       (0.9, 0.89992))),
    *(_number(DIMERS, f"dimer without decay near {ratio:g}", ratio, digit, None,
              functools.partial(_extremum, ratio))
      for ratio, digit in ((0.3428, 1e-4), (0.1548, 1e-4), (0.09013, 1e-5), (0.06150, 1e-5))),
    _number(DIMERS, "dimer with the strongest decay", 0.240, 1e-3, None,
            functools.partial(_extremum, 0.240)),
    Number("independent simulation: decay in a dimer of 0.36", 9.10e-4, _dimer(0.36), _decay,
           _DIGIT, 1e-6, 1e-6),
    _number(SCHWAGER, "viscoelastic: first coefficient of 1 - e", 1.15344, 2e-5, None,
           lambda _: _series()[0]),
    _number(SCHWAGER, "viscoelastic: second coefficient of 1 - e", 0.79826, 2e-5, None,
           lambda _: _series()[1]),
)  # fmt: skip


def _series() -> tuple[float, float]:
    """Coefficients of 1 - e = C1 x - C2 x^2 + ..., by a polynomial through small x."""
    x = np.linspace(1e-3, 1e-2, 6)
    lost = [(1 - of_natural(each, 0.5, True)) / each for each in x]
    fitted = np.polyfit(x, lost, 4)
    return float(fitted[-1]), float(-fitted[-2])


def compare(quick: bool, with_lammps: bool) -> Iterator[Row]:
    """Rows for every number; in the quick form LAMMPS runs short chains alone."""
    return compare_numbers(NUMBERS, quick, with_lammps)


SCRIPTS = {
    "published": Script(
        "Published numbers",
        "Are numbers that others have published found again?",
        table_of(compare),
    )
}  # fmt: skip
