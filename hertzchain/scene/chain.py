"""The chain of granules, its natural units, and its granules and contacts one by one."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, Quantity
from hertzchain.contact import hertz
from hertzchain.errors import require
from hertzchain.scene.keys import Key, check, key, keys_of, optional

MOST_UNLIKE_GRANULES = 1_000_000
"""Most granules of a chain that is not uniform: a dozen numbers are stored for each (chosen)."""

MOST_GRANULES = 2**31 - 1
"""Largest number of granules: LAMMPS's ids are 32-bit integers."""


PerGranule = Any
"""One number for all granules, or a sequence with one for each (kept as a tuple)."""

MATERIAL = ("radius", "young_modulus", "poisson_ratio", "density")
"""Names of the properties of a granule."""

MEASURED = ("stiffness", "mass", "length")
"""Names of properties that were measured, which take the place of others."""

REPLACED_BY = {"young_modulus": "stiffness", "poisson_ratio": "stiffness", "density": "mass"}
"""Properties of a material, each with the measured one that takes its place."""


@dataclass(frozen=True, repr=False)
class Chain:
    """A row of spheres, in SI units.

    Except ``granules`` each is a number, or a sequence of N numbers where granules differ.

    Parameters
    ----------
    granules
        N, from 1 to 2^31 - 1; a single one needs a wall.
    radius
        R [m].
    young_modulus
        E [Pa]; None with ``stiffness``.
    poisson_ratio
        nu, in (-1, 0.5]; None with ``stiffness``.
    density
        rho [kg/m^3]; None with ``mass``.
    gap
        Gap in front of each granule at the start, at least 0 [m]; the first granule has none.
    yield_strength
        Yield strength Y in tension [Pa], for a warning; None where it is unknown.
    velocity
        Velocity at the start [m/s], negative towards granule 1; a striker or piston has its own
        velocity instead.
    fixed
        Whether a granule never moves; its contacts are pressed all the same.
    stiffness
        A in F = A overlap^(3/2) of the contact before each granule, as it was measured
        [N m^(-3/2)]; granule 1's is that of a near wall. None where it follows from E, nu and R.
    mass
        Mass of each granule, as it was weighed [kg]; None where it follows from R and density.
    length
        Length of each granule between its contacts [m], for places and speeds; None for 2 R.
    """

    # Usual ranges, here and elsewhere, are chosen: a thousand times beyond steel, glass and
    # polymers of 1 mm to 5 cm under 1 mN to 10 kN, or the range of real materials: powder to
    # boulders, foams to osmium, gels to diamond.
    granules: int = field(metadata=key("", "granules N", least=1, most=MOST_GRANULES, kind="int"))
    radius: PerGranule = field(metadata=key("m", "radius R", above=0, usual=(1e-6, 0.5)))
    young_modulus: PerGranule = optional("Pa", "Young's modulus E", above=0, usual=(1e5, 2e12))
    poisson_ratio: PerGranule = optional("", "Poisson's ratio", above=-1, most=0.5)
    density: PerGranule = optional("kg/m^3", "density", above=0, usual=(10.0, 3e4))
    gap: PerGranule = field(default=0.0, metadata=key("m", "gap before each granule", least=0))
    yield_strength: PerGranule | None = optional("Pa", above=0, usual=(1e4, 1e12))
    velocity: PerGranule = field(
        default=0.0, metadata=key("m/s", "velocity at the start", usual=(1e-5, 1e3))
    )
    fixed: PerGranule = field(default=False, metadata=key(kind="bool"))
    stiffness: PerGranule = optional("N m^-1.5", "stiffness A", above=0, usual=(1.0, 1e14))
    mass: PerGranule = optional("kg", "mass", above=0, usual=(1e-15, 1e4))
    length: PerGranule = optional("m", "length", above=0, usual=(1e-6, 1.0))

    def __post_init__(self) -> None:
        keys = keys_of(Chain)
        keys["granules"].check("granules", self.granules)
        for name in keys:
            value = getattr(self, name)
            if isinstance(value, np.ndarray):
                value = value.tolist()
            if isinstance(value, list | tuple):
                value = _for_each(name, value, self.granules, keys[name])
            object.__setattr__(self, name, value)
        check(self)
        for name, other in REPLACED_BY.items():
            value, instead = getattr(self, name), getattr(self, other)
            missing = f"missing, or give {other}"
            require(value is not None or instead is not None, name, None, missing)
            allowed = f"not allowed with {other}, which takes its place"
            require(value is None or instead is None, name, value, allowed)

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def is_measured(self) -> bool:
        """Whether a stiffness, a mass or a length was measured."""
        return any(getattr(self, name) is not None for name in MEASURED)

    @property
    def section(self) -> Mapping[str, Any] | None:
        """The section [chain] with its segments, in SI; None if the scene file has no segments.

        A copy with other values, by ``dataclasses.replace``, has no section.
        """
        return self.__dict__.get("_section")

    @property
    def first_modulus(self) -> float:
        """E of granule 1 [Pa]; with a measured stiffness that of equal spheres of nu = 0."""
        if self.stiffness is not None:
            return float(equal_modulus(*(np.ravel(x)[0] for x in (self.stiffness, self.radius))))
        modulus: Any = self.young_modulus
        return float(modulus[0] if isinstance(modulus, tuple) else modulus)

    def require_uniform(self, what: str) -> None:
        """Raise a SceneError for unlike or measured granules; ``what`` needs like spheres."""
        unlike = any(isinstance(getattr(self, key), tuple) for key in MATERIAL) or self.is_measured
        allowed = "is a single number only in a chain of like granules: see Scene.granules"
        require(not unlike, what, None, allowed)

    @cached_property
    def granule_mass(self) -> float:
        """Mass m = 4/3 pi R^3 rho of each granule of a uniform chain [kg]."""
        self.require_uniform("granule_mass")
        return granule_mass(self.radius, self.density)  # type: ignore[no-any-return]

    @cached_property
    def contact_stiffness(self) -> float:
        """A in F = A overlap^(3/2) of a uniform chain [N m^(-3/2)]."""
        self.require_uniform("contact_stiffness")
        return hertz.stiffness_of_equals(  # type: ignore[no-any-return]
            self.radius, self.young_modulus, self.poisson_ratio
        )


def _for_each(name: str, values: Any, granules: int, key: Key) -> Any:
    """Return checked numbers, one for each granule, or a single number where all are the same."""
    values = list(values)
    allowed = f"must be a number, or {granules} numbers, one for each granule"
    require(len(values) == granules, f"number of values of {name}", len(values), allowed)
    for number, value in enumerate(values, start=1):
        key.check(f"{name} of granule {number}", value)
    if name == "gap":  # the first granule has none before it
        values[0] = values[1] if len({*values[1:]}) == 1 else 0.0
    kind = bool if key.kind == "bool" else float
    if len(set(values)) == 1:
        return kind(values[0])
    return tuple(kind(value) for value in values)


def granule_mass(radius: Quantity, density: Quantity) -> Any:
    """Mass m = 4/3 pi R^3 rho [kg] of granules, numbers or arrays."""
    return 4.0 / 3.0 * math.pi * radius**3 * density


def equal_modulus(stiffness: Quantity, radius: Quantity) -> Any:
    """E of equal spheres of nu = 0 whose contact has a stiffness [Pa]; numbers or arrays."""
    return 3 * stiffness / np.sqrt(2 * radius)


def contact_mass(mass: FloatArray, contacts: int) -> FloatArray:
    """m* of contacts [kg], (contacts,), from the masses of granules, some perhaps infinite."""
    with np.errstate(invalid="ignore"):
        pairs = together(mass)
    held = np.isinf(mass)
    pairs = np.where(held[:-1], mass[1:], np.where(held[1:], mass[:-1], pairs))
    return np.concatenate([pairs, mass[-1:]])[:contacts]


def together(values: FloatArray) -> FloatArray:
    """1 / (1/a + 1/b) of neighbours a and b, shape (granules - 1,)."""
    return values[:-1] * values[1:] / (values[:-1] + values[1:])


@dataclass(frozen=True, eq=False)
class Granules:
    """Every granule and every contact of a scene, in SI units.

    The first contact is that between granules 1 and 2; where there is a wall, its contact is the
    last. A near wall is one more body, in front of the N granules: fixed, as large as granule 1, of
    the wall's material. It makes the first contact, with the stiffness of a plane. Where a
    stiffness or mass was measured, the material is that of a sphere that has it next to an equal
    one.
    """

    # Of each body, shape (bodies,)
    radius: FloatArray  # [m]
    young_modulus: FloatArray  # [Pa]
    poisson_ratio: FloatArray
    density: FloatArray  # [kg/m^3]
    mass: FloatArray  # [kg], infinite for a piston and fixed granules
    velocity: FloatArray  # at the start [m/s]
    # Of each contact, shape (contacts,)
    stiffness: FloatArray  # A in F = A overlap^(3/2) [N m^(-3/2)]
    gap: FloatArray  # at the start [m]
    constant_force: FloatArray  # gravity and precompression on each body [N]; 0 for a piston
    static_force: FloatArray  # in each contact at the start [N]
    damping: FloatArray | None = None  # c of each contact [N s m^-(1+q)], see ``Contact``
    is_fixed: Any = False
    has_near_wall: bool = False
    length: FloatArray | None = None  # of each body between its contacts [m]; None for the diameter

    @property
    def fixed(self) -> NDArray[np.intp]:
        """Granules that never move, counted from 0."""
        return np.flatnonzero(self.is_fixed)

    @cached_property
    def static_overlap(self) -> FloatArray:
        """Overlap of each contact at the start [m], shape (contacts,)."""
        return np.asarray(hertz.overlap_of(self.stiffness, self.static_force))

    @cached_property
    def position(self) -> FloatArray:
        """Centre of each body at the start, the first at 0 [m], shape (bodies,)."""
        return self._centres(self.radius)

    @property
    def place(self) -> FloatArray:
        """The same by the lengths of the granules, where these are not their diameters."""
        return self.position if self.length is None else self._centres(self.reach)

    @property
    def reach(self) -> FloatArray:
        """Distance from the centre of each granule to its contacts [m], shape (bodies,)."""
        return self.radius if self.length is None else self.length / 2

    def _centres(self, reach: FloatArray) -> FloatArray:
        apart = reach[:-1] + reach[1:]
        contacts = apart.size
        apart = apart + self.gap[:contacts] - self.static_overlap[:contacts]
        return np.concatenate([[0.0], np.cumsum(apart)])

    @property
    def closing(self) -> FloatArray:
        """Speed with which each contact closes at the start [m/s], shape (contacts,); 0 if not."""
        velocity = np.append(self.velocity, 0.0)
        return np.asarray(np.maximum(velocity[:-1] - velocity[1:], 0)[: self.stiffness.size])

    @property
    def force_at_start(self) -> float:
        """Largest peak of contacts that close at the start, each alone [N]; 0 where none does."""
        return float(np.max(hertz.impact_force(self.stiffness, self.contact_mass, self.closing)))

    @property
    def as_if_free(self) -> Granules:
        """Return the same granules with finite masses of fixed ones, as if these were free."""
        mass = granule_mass(self.radius, self.density)
        return replace(self, mass=np.where(self.is_fixed, mass, self.mass))

    @property
    def moved(self) -> FloatArray:
        """Momentum of each granule at the start [N s], shape (granules,); 0 for a piston."""
        held = np.isinf(self.mass)
        return np.asarray(np.where(held, 0.0, self.mass) * np.where(held, 0.0, self.velocity))

    @cached_property
    def contact_mass(self) -> FloatArray:
        """m* = m1 m2 / (m1 + m2) of each contact [kg], shape (contacts,).

        At a wall it is the mass of the last granule, at a piston that of granule 2.
        """
        return contact_mass(self.mass, self.stiffness.size)

    def reached_from(self, sources: Any) -> NDArray[np.bool_]:
        """Tell which contacts no fixed granule separates from all of some granules, (contacts,).

        ``sources`` is true for these granules, shape (granules,).
        """
        part = np.cumsum(np.broadcast_to(self.is_fixed, self.mass.size))
        return np.isin(part[: self.stiffness.size], part[sources])

    @property
    def contact_radius(self) -> FloatArray:
        """R* of each contact [m], shape (contacts,); at a wall R of its granule."""
        radius = np.append(together(self.radius), self.radius[-1])[: self.stiffness.size]
        if self.has_near_wall:
            radius[0] = self.radius[1]
        return radius

    def ahead_of(self, place: int) -> tuple[float, float]:
        """A [N m^(-3/2)] and 2 m* [kg] of the contact ahead of a granule; the last: behind it."""
        k = min(place, self.stiffness.size - 1)
        return float(self.stiffness[k]), 2 * float(self.contact_mass[k])


def like_granules(chain: Chain) -> Granules:
    """Return the granules of a uniform free chain, whose numbers are exactly the chain's own."""
    count = chain.granules
    values: Any = {key: np.full(count, getattr(chain, key)) for key in MATERIAL}
    stiffness, none = np.full(count - 1, chain.contact_stiffness), np.zeros(count)
    mass = np.full(count, chain.granule_mass)
    return Granules(**values, mass=mass, velocity=none, stiffness=stiffness, gap=none[1:],
                    constant_force=none, static_force=none[1:])  # fmt: skip


def short_repr(part: Any) -> str:
    """The repr of a frozen object, with only the first six values of long tuples."""
    values = (f"{field.name}={reprlib.repr(getattr(part, field.name))}" for field in fields(part))
    return f"{type(part).__name__}({', '.join(values)})"


PAPER_MOMENTUM = 139 / 32
"""The paper's coefficient of L_SW (section 4.1); the exact one is in hertzchain.theory."""

MOMENTUM_IN_NATURAL_UNITS = PAPER_MOMENTUM / (
    math.sqrt(4 * math.pi / 3) * math.cbrt(3 / math.sqrt(2))
)
"""L_SW of a wave of height 1, in natural units, with the paper's 139/32: 1.651778333."""


@dataclass(frozen=True)
class NaturalUnits:
    """Units in which scenes of uniform chains no longer depend on E, R, rho, nu and F0.

    Parameters
    ----------
    force
        F0, the largest applied force [N].
    length
        (F0 / A)^(2/3), the overlap of two granules pressed by F0 [m].
    time
        sqrt(m length / F0) [s].
    """

    force: float
    length: float
    time: float

    @property
    def velocity(self) -> float:
        """Unit of velocity [m/s]."""
        return self.length / self.time

    @property
    def momentum(self) -> float:
        """Unit of momentum [N s]."""
        return self.force * self.time

    @property
    def energy(self) -> float:
        """Unit of energy [J]."""
        return self.force * self.length


def natural_units(chain: Chain, peak_force: float) -> NaturalUnits:
    """The natural units of a chain under a shock whose largest force is ``peak_force`` [N]."""
    return NaturalUnits(
        peak_force, *length_and_time(chain.contact_stiffness, chain.granule_mass, peak_force)
    )


def length_and_time(
    contact_stiffness: Quantity, granule_mass: Quantity, peak_force: Quantity
) -> tuple[Any, Any]:
    """The natural units of length [m] and time [s], from A [N m^(-3/2)], m [kg] and F0 [N].

    All are numbers, or arrays of one shape.
    """
    is_one = isinstance(peak_force, float)
    power, root = (math.pow, math.sqrt) if is_one else (np.power, np.sqrt)
    length = power(peak_force / contact_stiffness, 2 / 3)
    return length, root(granule_mass * length / peak_force)


def force_scale(momentum_ratio: float) -> float:
    """Approximate force of contacts under a shock, over F0.

    Long pulses press contacts with about F0. A short pulse only gives its impulse I to the first
    granule, which presses the second with 0.754 I^1.2.
    """
    # Peak force of a collision with velocity 1, both masses 1, one at rest: the energy 1/4 equals
    # 2/5 r^(5/2), so the force is (5/8)^(3/5)
    impact = 0.754272
    short = min(1.0, momentum_ratio)  # above 1 the result is 1; this avoids an overflow
    return min(1.0, impact * math.pow(MOMENTUM_IN_NATURAL_UNITS * short, 1.2))
