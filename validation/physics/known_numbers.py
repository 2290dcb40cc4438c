"""Numbers of scenes beyond the plain chain that closed forms or other simulations know.

Two spheres that meet are Hertz's (1882); a taper with gaps is a row of such collisions, whatever
the force law. Numbers of strikers, walls and pistons are those of independent simulations, whose
digits SciPy's DOP853 confirms.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

import hertzchain as hc
from validation.physics.chains import (
    EXTRAPOLATED,
    Number,
    compare_numbers,
    crest,
    duration_of,
    peak_of,
    steel,
    units_of,
    velocity_of,
)
from validation.script import Row, Script, table_of
from validation.shipped import STEEL, history_of

PAIRS: dict[str, dict[str, Any]] = {
    "alike": {},
    "radii 1:5": {"radius": [2e-3, 1e-2]},
    "steel on PTFE": {
        "young_modulus": [193e9, 1.46e9],
        "poisson_ratio": [0.3, 0.46],
        "density": [7958.0, 2200.0],
    },
    "100 times the modulus and the mass": {
        "young_modulus": [193e10, 193e8],
        "density": [795.8e2, 795.8],
    },
}

STRIKERS = {
    0.5: (0.59256, 0.38824, 5e-6, 5e-6),
    1.0: (0.758420, 0.63955423, 5e-7, 5e-9),
    2.0: (0.906747, 0.95025646, 5e-7, 5e-9),
    10.0: (1.108796, 1.65379, 5e-7, 5e-6),
}
"""By mass over a granule's: first contact, far field, half a unit of the last digit of each."""

_OF_LAMMPS = 5e-7
"""Least tolerance of LAMMPS's peaks, whose steps are for an error of 1e-6 (chosen)."""

_FAR = 60
"""Place of the contact of the far field, in a chain of 80 granules."""

TAPERS = {(0.05, 12): 2.2564951245, (0.1, 6): None, (-0.05, 8): None}
"""By how much smaller each radius is than the one before, and by granules: the velocity of the last
over that of the first, where it is known from elsewhere."""

WALLS = {
    "rigid wall": (hc.Wall("rigid"), 2 * math.sqrt(2), 2.238376, 1.053925, 0.998222),
    "wall of the same material": (hc.Wall("same"), math.sqrt(2), 1.943903, 1.011928, 0.998337),
    "wall like a frozen sphere": (
        hc.Wall("elastic", STEEL["young_modulus"] / (2 * math.sqrt(2) - 1), STEEL["poisson_ratio"]),
        1.0, 1.750403, 1.000862, 0.999732,
    ),
}  # fmt: skip
"""Stiffness over that of two granules; peaks at the wall and at the last contact, and the height of
what comes back, over the wave's, the same for 200, 400 and 800 granules.

An elastic wall of E / (2 sqrt 2 - 1) has the contact stiffness of two granules: E* sqrt R is the
same, as a sphere that is held fast would have it.
"""

_BACK = 41
"""Contacts before the wall where the wave is looked at, out of reach of what happens there."""

PISTON = {2: 1.18402354, 11: 1.93713472, 21: 2.14055010}
"""Peak force of contacts of 30 granules at rest under a piston; m = A = v = 1."""

_CLOSED = "a closed form: native promises 1e-9; a step across the first touch costs LAMMPS h^2.5"
_TIME = "twice the time of the peak, which is flat: the root of what its height is right to"
_BINARY = "momentum and energy: what steps leave of the energy, of second order with LAMMPS"
_DIGIT = f"half a unit of the last digit that is known; {EXTRAPOLATED}"
_DIGIT_OF_MOTION = "half a unit of the last digit; of LAMMPS, its finer steps, of second order"
_SETTLED = f"half a unit of the sixth digit, and what is left of the transition; {EXTRAPOLATED}"
_BETWEEN = "the same; the height of what comes back is between samples 0.06 of a shift apart"
_STIFFNESS = "a formula: what is left is round-off"


def _two_spheres(name: str, velocity: float) -> Iterator[Number]:
    """Force, duration and velocities of a collision.

    F_max = 1.143262630 m*^(3/5) v^(6/5) A^(2/5), and the duration is 2.943275184 d_max / v.
    """
    scene = hc.Scene(steel(2, **PAIRS[name]), hc.Striker(velocity))
    (first, other), what = scene.granules.mass.tolist(), f"{name}, {velocity:g} m/s"
    mass, stiffness = scene.granules.contact_mass[0], scene.granules.stiffness[0]
    force = float(1.1432626298 * mass**0.6 * velocity**1.2 * stiffness**0.4)
    time = float(2.943275184 * (force / stiffness) ** (2 / 3) / velocity)
    after = (first - other) / (first + other), 2 * first / (first + other)
    yield Number(f"{what}: peak / F_max", 1, scene, peak_of(0, force), _CLOSED, 1e-9, 1e-6)
    yield Number(f"{what}: duration / closed form", 1, scene, duration_of(time), _TIME, 1e-7, 1e-7)
    for k, part in enumerate(after, 1):
        speed = velocity_of(k, velocity)
        yield Number(f"{what}: velocity {k} / v", part, scene, speed, _BINARY, 1e-9, 1e-5)


def _striker(mass: float) -> Iterator[Number]:
    """First contact and far field of a chain of 80 granules, natural units of the striker."""
    (*forces, of_first, of_far), unit = STRIKERS[mass], units_of(1.0)
    scene = hc.Scene(steel(80), hc.Striker(1.0, density=mass * STEEL["density"]))
    places, limits = (("first contact", 0), ("far field", _FAR)), (of_first, of_far)
    for (what, place), force, limit in zip(places, forces, limits, strict=True):
        name, peak = f"striker of mass {mass:g}: {what}", peak_of(place, unit.force)
        yield Number(name, force, scene, peak, _DIGIT, limit, max(limit, _OF_LAMMPS))
    if mass == 1.0:
        name = "striker of mass 1: its velocity at the end"
        yield Number(name, -0.0710850, scene, velocity_of(1), _DIGIT_OF_MOTION, 5e-8, 1e-5)


def _taper(taper: float, granules: int) -> Iterator[Number]:
    """Velocity of the last granule over that of the first: a row of collisions of two."""
    radius = [5e-3 * (1 - taper) ** k for k in range(granules)]
    scene = hc.Scene(steel(granules, radius=radius, gap=1e-4), hc.Striker(1.0))
    expected = math.prod(2 * a**3 / (a**3 + b**3) for a, b in itertools.pairwise(radius))
    what, product = f"taper of {taper:g} with gaps, N {granules}", TAPERS[taper, granules]
    if product is not None:
        yield Number(f"{what}: product", product, None, lambda _: expected, _DIGIT, 5e-11)
    name, limits = f"{what}: last / first velocity", (1e-9 * expected, 1e-5 * expected)
    yield Number(name, expected, scene, velocity_of(granules), _BINARY, *limits)


def _wall(name: str) -> Iterator[Number]:
    """Forces of a solitary wave at a wall, and what comes back, over its own force."""
    wall, stiffness, at_wall, at_last, back = WALLS[name]
    scene = hc.Scene(steel(200), hc.Striker(1.0), wall=wall)
    ratio = float(scene.granules.stiffness[-1] / scene.granules.stiffness[0])
    what = f"{name}: stiffness over that of two granules"
    yield Number(what, stiffness, None, lambda _: ratio, _STIFFNESS, 4e-15)
    for what, place, force in (("peak at the wall", -1, at_wall), ("last contact", -2, at_last)):

        def over_the_wave(result: hc.Result, place: int = place) -> float:
            return float(result.peak_force[place] / result.peak_force[-_BACK])

        yield Number(f"{name}: {what}", force, scene, over_the_wave, _SETTLED, 1e-6, 1e-6)
    yield Number(f"{name}: reflected", back, scene, _reflected, _BETWEEN, 1e-6)


def _reflected(result: hc.Result) -> float:
    """Height of a wave on its way back, at the contact where it was looked at before, over its."""
    first, second = result.peak_time[[-_BACK - 10, -_BACK]]
    shift = (second - first) / 10
    passes = result.peak_time[-1] + (_BACK - 2) * shift
    times = passes + 3 * shift * np.linspace(-1, 1, 101)
    history = history_of(hc.Native(rtol=1e-9).run(result.scene, times))
    return crest(history, -_BACK) / float(result.peak_force[-_BACK])


def _piston() -> Iterator[Number]:
    """A granule that a piston hits, and the train of waves ahead of one in a chain at rest."""
    unit, scene = units_of(1.0), hc.Scene(steel(2), hc.Piston(1.0))
    what, peak = "piston on a granule", peak_of(0, unit.force)
    yield Number(f"{what}: F", 1.25**0.6, scene, peak, _CLOSED, 1e-9, 1e-6)
    yield Number(f"{what}: velocity", 2.0, scene, velocity_of(2), _BINARY, 1e-8, 1e-5)
    scene = hc.Scene(steel(30), hc.Piston(1.0))
    for contact, force in PISTON.items():
        what, peak = (
            f"piston on a chain at rest: contact {contact}",
            peak_of(contact - 2, unit.force),
        )
        yield Number(what, force, scene, peak, _DIGIT, 5.1e-9, 5e-7)


def compare(quick: bool, with_lammps: bool) -> Iterator[Row]:
    """Rows for every number; in the quick form LAMMPS runs short chains alone."""
    numbers = itertools.chain(
        *(_two_spheres(name, 0.5) for name in PAIRS),
        _two_spheres("alike", 1e-3),
        *(_striker(mass) for mass in STRIKERS),
        *(_taper(*taper) for taper in TAPERS),
        *(_wall(wall) for wall in WALLS),
        _piston(),
    )
    return compare_numbers(numbers, quick, with_lammps)


SCRIPTS = {
    "known_numbers": Script(
        "Known numbers",
        "Are collisions, strikers, tapers, walls and pistons what closed forms and others say?",
        table_of(compare),
    )
}  # fmt: skip
