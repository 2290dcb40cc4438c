"""What LAMMPS makes of a generated deck, number by number, against the scene."""

from __future__ import annotations

import math

import numpy as np

from hertzchain import theory
from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.lammps import Examination, Lammps
from hertzchain.errors import RunFailed
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.scene import Scene
from hertzchain.verdict.check import Check, Kind, farthest, unmeasured, within

EXAMINED = 1e-12  # relative, of each number of LAMMPS; 3e-15 measured, R 1e-8 to 1e3 m, N to 1e4

_ENGINE = "lammps"

_MEND = (
    "what LAMMPS made of the deck is not the scene: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it"
)

GRANULES = Kind("granules", _MEND)
POSITION = Kind("position at rest [m]", _MEND)
MASS = Kind("granule mass [kg]", _MEND)
STIFFNESS = Kind("contact stiffness [N m^(-3/2)]", _MEND)
EXPONENT = Kind("contact exponent", _MEND)
DAMPING = Kind("damping", _MEND)
TANGENTIAL = Kind("tangential force", _MEND)
APPLIED_FORCE = Kind("applied force [N]", _MEND)
NOT_EXAMINED = Kind("not examined", _MEND)


def examined(scene: Scene, lammps: Lammps) -> list[Check]:
    """What LAMMPS makes of the deck of a scene, each number by itself."""
    try:
        return examination_checks(scene, lammps.examine(scene))
    except RunFailed as problem:
        return [unmeasured(NOT_EXAMINED, _ENGINE, str(problem))]


def examination_checks(scene: Scene, found: Examination) -> list[Check]:
    """What LAMMPS makes of the deck against the scene: only round-off may differ."""
    numbers = found.mass.size, scene.chain.granules, 0.0
    count = _check(GRANULES, numbers, "one more or less is another chain")
    if not count.passed:
        return [count]
    return [
        count,
        *_granule_checks(scene, found),
        *_contact_checks(scene, found),
        _applied_force_check(scene, found),
    ]


def _granule_checks(scene: Scene, found: Examination) -> list[Check]:
    chain = scene.chain
    sites = 2 * chain.radius * np.arange(chain.granules)
    site, granule = farthest(found.position, sites), farthest(found.mass, chain.granule_mass)
    mass, room = chain.granule_mass, EXAMINED * 2 * chain.radius * chain.granules
    return [
        _check(
            POSITION,
            (found.position[site], sites[site], room),
            "granules touch, the first is at 0: only round-off may differ, as a fraction of the"
            f" chain; largest at granule {site + 1}",
        ),
        _check(
            MASS,
            (found.mass[granule], mass, EXAMINED * mass),
            "LAMMPS makes it from diameter and density, 4/3 pi R^3 rho: only round-off may"
            f" differ; largest at granule {granule + 1}",
        ),
    ]


def _contact_checks(scene: Scene, found: Examination) -> list[Check]:
    stiffness = scene.chain.contact_stiffness
    force, larger = found.contact_force, found.contact_force[1]
    measured = (force / found.overlap**1.5).ravel()
    stiff = farthest(measured, stiffness)
    # Contacts that are missing are named by their stiffness, 0, and have no exponent.
    there = np.all(np.abs(force) > 1e-6 * stiffness * found.overlap**1.5, axis=0)
    growth = np.where(there, np.abs(force[1] / np.where(there, force[0], 1.0)), np.nan)
    exponent = np.log(growth) / np.log(found.overlap[1] / found.overlap[0])
    bent = farthest(np.where(there, exponent, 1.5), 1.5)
    unit = stiffness * found.overlap[1] ** 1.5
    change = (found.damped_force - larger) / unit
    damped = farthest(change.ravel(), 0.0)
    spun = farthest(found.tangential_force, 0.0)
    return [
        _check(
            STIFFNESS,
            (measured[stiff], stiffness, EXAMINED * stiffness),
            "contact force over overlap^(3/2) is A at two known overlaps: only round-off may"
            f" differ; {_missing(there) or f'largest at contact {stiff % there.size + 2}'}",
        ),
        _check(
            EXPONENT,
            (exponent[bent], 1.5, EXAMINED),
            "the contact force goes as overlap^(3/2): only round-off may differ;"
            f" {_missing(there) or f'largest at contact {bent + 2}'}",
        ),
        _check(
            DAMPING,
            (change.ravel()[damped], 0.0, EXAMINED),
            "change of a contact force, as a fraction, when its granules approach or part:"
            f" none; largest at contact {damped % there.size + 2}",
        ),
        _check(
            TANGENTIAL,
            (found.tangential_force[spun] / np.min(unit), 0.0, EXAMINED),
            "sideways force and torque over radius, as a fraction of the contact force, when"
            f" the granules spin: none; largest at granule {spun + 1}",
        ),
    ]


def _check(kind: Kind, numbers: tuple[float, float, float], reason: str) -> Check:
    """A check of LAMMPS, from what was measured and expected, and the tolerance."""
    measured, expected, tolerance = map(float, numbers)
    return within(kind, _ENGINE, measured, expected, tolerance, reason)


def _missing(there: Array) -> str:
    """The contacts without a force, by the paper's numbers; empty where there are none."""
    missing = [str(contact) for contact in np.flatnonzero(np.logical_not(there)) + 2]
    if not missing:
        return ""
    shown = ", ".join(missing[:5]) + (" and more" if len(missing) > 5 else "")
    return f"no force in contact {shown}"


def _applied_force_check(scene: Scene, found: Examination) -> Check:
    """The force that LAMMPS applies against F(t) of the scene, at the corners from both sides."""
    expected = _applied_force(scene, found.time)
    leg, step = divmod(farthest(found.applied_force, expected), expected.shape[1])
    # LAMMPS adds up the time leg by leg; a steep ramp makes more of what that loses.
    late = len(expected) * math.ulp(scene.ramps[-1].end)
    steepest = max(
        math.pi / 2 * abs(ramp.end_force - ramp.start_force) / (ramp.end - ramp.start)
        for ramp in scene.ramps
    )
    tolerance = EXAMINED * scene.units.force + late * steepest
    return _check(
        APPLIED_FORCE,
        (found.applied_force[leg, step], expected[leg, step], tolerance),
        "the sum of all net forces is F(t), at the corners from both sides, and 0 after the"
        f" pulse: only round-off may differ; largest at {found.time[leg, step]:.6g} s",
    )


def _applied_force(scene: Scene, time: FloatArray) -> FloatArray:
    """F(t) [N] by Table 1 or the pulse table, not the schedule's ramps: shape (legs, readings)."""
    if isinstance(scene.shock, Pulse):
        assert scene.rise_time is not None
        return theory.applied_force(time, scene.shock, scene.rise_time)
    table = scene.shock
    assert isinstance(table, PulseTable)
    force = np.interp(time, table.time, table.force, left=0.0, right=0.0)
    # It may jump at its first and last row: legs end before a jump and start after it.
    force[:, 1:][time[:, 1:] <= table.time[0]] = 0.0
    force[:, 0][time[:, 0] >= table.time[-1]] = 0.0
    return force
