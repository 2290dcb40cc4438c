"""Two spheres that meet: force, duration and velocities in closed form (Hertz, 1882)."""

from __future__ import annotations

from typing import Any

import hertzchain as hc
from validation.physics.chains import EXTRAPOLATED, answers, steel
from validation.rows import Row, row
from validation.script import Script, rows_only

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

_CLOSED = "a closed form: native promises 1e-9; a step across the first touch costs LAMMPS h^2.5"
_BINARY = "momentum and energy: what steps leave of the energy, of second order with LAMMPS"
_TIME = "twice the time of the peak, which is flat: the root of what its height is right to"


def compare(quick: bool, with_lammps: bool) -> list[Row]:
    """Rows for every pair; the quick form leaves one out, and a slow collision."""
    rows = []
    for name, different in PAIRS.items():
        if quick and name == "radii 1:5":
            continue
        for velocity in (1e-3, 0.5) if name == "alike" and not quick else (0.5,):
            scene = hc.Scene(steel(2, **different), hc.Striker(velocity))
            force, duration = collision(scene, velocity)
            one, other = scene.granules.mass
            after = velocity * (one - other) / (one + other), velocity * 2 * one / (one + other)
            for backend, result in answers(scene, with_lammps).items():
                native = backend == "native"
                what, by = f"{name}, {velocity:g} m/s", "" if native else f"; {EXTRAPOLATED}"
                rows += [
                    row(f"{what}: peak / F_max - 1", backend, result.peak_force[0] / force - 1, 0.0,
                        1e-9 if native else 1e-6, _CLOSED + by),
                    row(f"{what}: duration / closed form - 1", backend,
                        2 * result.peak_time[0] / duration - 1, 0.0, 1e-7, _TIME + by),
                    *(row(f"{what}: velocity {k + 1} / v", backend, result.velocity[k] / velocity,
                          after[k] / velocity, 1e-9 if native else 1e-5, _BINARY)
                      for k in range(2)),
                ]  # fmt: skip
    return rows


def collision(scene: hc.Scene, velocity: float) -> tuple[float, float]:
    """Peak force [N] and duration [s] of the collision of two granules.

    F_max = 1.143262630 m*^(3/5) v^(6/5) A^(2/5), and the duration is 2.943275184 d_max / v.
    """
    granules = scene.granules
    mass, stiffness = float(granules.contact_mass[0]), float(granules.stiffness[0])
    force = 1.1432626298 * mass**0.6 * velocity**1.2 * stiffness**0.4
    return force, 2.943275184 * (force / stiffness) ** (2 / 3) / velocity


SCRIPT = Script(
    "Two spheres that meet",
    "Do collisions of two spheres have the force and the duration of Hertz's formulas?",
    "native, LAMMPS; closed forms",
    **rows_only(compare),
)

if __name__ == "__main__":
    SCRIPT.main()
