"""Well-known slips by name, with their factors on the pulse in natural units or on the force."""

from __future__ import annotations

from hertzchain.scene.scene import Scene

NEAR = 0.003  # largest relative distance of a fitted factor from a known one that is named
_CLEAR = 3.0  # times the distance of the nearest factor: factors beyond it are not named (chosen)
_FITTED = 1e-4  # relative error of a fitted factor (measured with velocity Verlet)

KILOGRAM_FORCE, POUND_FORCE = 9.80665, 4.4482216  # N


def stretch_in_words(scene: Scene, stretch: float) -> str:
    """Return words for mistakes that stretch the pulse by a factor in natural units."""
    names = near(slips_of_stretch(scene), stretch)
    text = (
        f"contact stiffness {stretch**3:.6g} times that of the scene, or mass {stretch**-2:.6g}"
        f" times, or pulse {stretch:.6g} times as long (peaks cannot tell these apart)"
    )
    return f"{text}: {' or '.join(names)}" if names else text


def near(known: dict[str, float], factor: float) -> list[str]:
    """Return the names of the known factors near a fitted one, if they are not near 1, too.

    A factor that is clearly farther away than the nearest one is left out.
    """
    far = {name: abs(factor / q - 1) for name, q in known.items() if abs(q - 1) > NEAR}
    least = _CLEAR * max(min(far.values(), default=0.0), _FITTED)
    return [
        name for name, off in far.items()
        if off < min(NEAR, 0.1 * abs(known[name] - 1), least)
    ]  # fmt: skip


def slips_of_stiffness(scene: Scene) -> dict[str, float]:
    """Return factors of slips on the stiffness of a contact."""
    nu = float(scene.granules.poisson_ratio[0])
    return {
        "effective modulus E/(1 - nu^2) in place of half of it": 2.0,
        "effective modulus E in place of E/(2 (1 - nu^2))": 2 * (1 - nu**2),
        "effective modulus halved twice": 0.5,
        "E in place of E/(1 - nu^2)": 1 - nu**2,
        "1 - nu in place of 1 - nu^2": 1 + nu,
        "shear modulus in place of E": 0.5 / (1 + nu),
        "the factor 2/3 is missing": 1.5,
        "the factor 4/3 is missing": 0.75,
        "R in place of the effective radius R/2": 2**0.5,
        "E in dyn/cm^2 taken for Pa": 10.0,
        "E in GPa taken for Pa": 1e-9,
        "E in MPa taken for Pa": 1e-6,
    }


def slips_of_stretch(scene: Scene) -> dict[str, float]:
    """Return factors of slips in chain and pulse on the length of the pulse in natural units.

    The length goes as the cube root of the stiffness, and inversely as the root of the mass.
    """
    known = {name: factor ** (1 / 3) for name, factor in slips_of_stiffness(scene).items()} | {
        "diameter taken for radius": 2 ** (-4 / 3),
        "radius taken for diameter": 2 ** (4 / 3),
        "diameter taken for radius in the mass": 8**-0.5,
        "radius taken for diameter in the mass": 8**0.5,
        "half the mass": 2**0.5,
        "twice the mass": 0.5**0.5,
        "density in g/cm^3 taken for kg/m^3": 1e3**0.5,
        "radius in cm taken for m": 100 ** (-4 / 3),
        "radius in mm taken for m": 1000 ** (-4 / 3),
        # Spheres have the diameter 1 of LAMMPS when they get their mass.
        "density set before the diameter": (2 * scene.chain.radius) ** 1.5,
    }
    if scene.pulse is not None:
        n = scene.pulse.duration_ratio
        known |= {"duration taken for rise time": n, "rise time taken for duration": 1 / n}
    return known


SLIPS_OF_FORCE = {
    "F0 in kgf taken for N": 1 / KILOGRAM_FORCE,
    "F0 in N taken for kgf": KILOGRAM_FORCE,
    "F0 in lbf taken for N": 1 / POUND_FORCE,
    "F0 in N taken for lbf": POUND_FORCE,
    "F0 in dyn taken for N": 1e5,
    "F0 in kN taken for N": 1e-3,
    "half of F0": 0.5,
    "twice F0": 2.0,
}
"""Slips in the applied force, with their factors."""

UNITS_OF_PEAKS = {
    "kN": 1e-3, "MN": 1e-6, "mN": 1e3, "uN": 1e6, "dyn": 1e5, "kgf": 1 / KILOGRAM_FORCE,
    "lbf": 1 / POUND_FORCE,
}  # fmt: skip
"""Units of force, with the factor of peaks in them over peaks in N."""


def force_in_words(factor: float) -> str:
    """Return words for an applied force that is wrong by a factor."""
    names = near(SLIPS_OF_FORCE, factor)
    text = f"applied force {factor:.6g} times that of the scene"
    return f"{text}: {' or '.join(names)}" if names else text


def scale_in_words(scene: Scene, factor: float) -> str:
    """Return words for peaks that are all wrong by the same factor."""
    units = UNITS_OF_PEAKS | {"F0": 1 / scene.units.force}
    names = [f"in units of {unit}" for unit in near(units, factor)]
    another = "another unit"
    if scene.pulse is not None:
        another += ", or another applied force at the same LM_ratio"
    why = " or ".join(names) or another
    return f"every peak {factor:.6g} times the true one: {why}"
