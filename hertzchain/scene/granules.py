"""Granules and contacts of a scene one by one, with the constant forces on them; their numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.scene.chain import MATERIAL, Chain, equal_modulus, granule_mass
from hertzchain.scene.shocks import Shock
from hertzchain.scene.terms import Contact, Precompression, Wall


@dataclass(frozen=True, eq=False)
class Granules:
    """Every granule and every contact of a scene, in SI units.

    The first contact is that between granules 1 and 2; where there is a wall, its contact is the
    last. A near wall is one more body, in front of the N granules: fixed, as large as granule 1, of
    the wall's material. It makes the first contact, with the stiffness of a plane.

    Parameters
    ----------
    radius, young_modulus, poisson_ratio, density
        Properties of each granule [m], [Pa], 1, [kg/m^3], shape (bodies,). For a measured stiffness
        or mass they are those of a sphere that has it next to an equal one.
    mass
        Mass of each granule [kg], shape (bodies,); infinite for a piston and fixed ones.
    velocity
        Velocity of each granule at the start [m/s], shape (bodies,).
    stiffness
        A in F = A overlap^(3/2) of each contact [N m^(-3/2)], shape (contacts,).
    gap
        Gap of each contact at the start [m], shape (contacts,).
    constant_force
        Gravity and precompression on each granule, along the chain [N], shape (bodies,); 0 for a
        piston.
    static_force
        Force in each contact at the start [N], shape (contacts,).
    damping
        c of each contact [N s m^-(1+q)], shape (contacts,), see ``Contact``; None without damping.
    length
        Length of each granule between its contacts [m], shape (bodies,); None for the diameter.
    """

    radius: FloatArray
    young_modulus: FloatArray
    poisson_ratio: FloatArray
    density: FloatArray
    mass: FloatArray
    velocity: FloatArray
    stiffness: FloatArray
    gap: FloatArray
    constant_force: FloatArray
    static_force: FloatArray
    damping: FloatArray | None = None
    is_fixed: Any = False
    has_near_wall: bool = False
    length: FloatArray | None = None

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
        return _contact_mass(self.mass, self.stiffness.size)

    def reached_from(self, sources: Any) -> NDArray[np.bool_]:
        """Tell which contacts no fixed granule separates from all of some granules, (contacts,).

        ``sources`` is true for these granules, shape (granules,).
        """
        part = np.cumsum(np.broadcast_to(self.is_fixed, self.mass.size))
        return np.isin(part[: self.stiffness.size], part[sources])

    @property
    def contact_radius(self) -> FloatArray:
        """R* of each contact [m], shape (contacts,); at a wall R of its granule."""
        radius = np.append(_together(self.radius), self.radius[-1])[: self.stiffness.size]
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


def granules_of(
    chain: Chain,
    shock: Shock | None,
    wall: Wall | None,
    pressed: Precompression | None,
    contact: Contact | None,
    near_wall: Wall | None = None,
) -> Granules:
    """Return the granules of a chain with its shock, walls, loads and damping."""
    values = _materials(chain, shock)
    length = (
        None
        if chain.length is None
        else np.array(np.broadcast_to(chain.length, chain.granules), np.float64)
    )
    velocity = np.array(np.broadcast_to(chain.velocity, chain.granules), np.float64)
    if shock is not None and shock.impact_velocity is not None:
        velocity[0] = shock.start_velocity
    gap = np.array(np.broadcast_to(chain.gap, chain.granules)[1:], np.float64)
    is_fixed = np.broadcast_to(chain.fixed, chain.granules)
    if near_wall is not None:
        first_wall = {key: float(value[0]) for key, value in values.items()}
        first_wall |= near_wall.material(first_wall["young_modulus"], first_wall["poisson_ratio"])
        values = {key: np.append(first_wall[key], value) for key, value in values.items()}
        velocity, gap = np.append(0.0, velocity), np.append(near_wall.gap, gap)
        is_fixed = np.append(True, is_fixed)
        length = None if length is None else np.append(length[0], length)
    radius, density = values["radius"], values["density"]
    mass = np.asarray(granule_mass(radius, density), np.float64)
    plane = hertz.plane_modulus(values["young_modulus"], values["poisson_ratio"])
    stiffness = hertz.stiffness_of(_together(radius), _together(plane))
    if chain.stiffness is not None:
        measured = np.broadcast_to(chain.stiffness, chain.granules)
        stiffness = np.array(measured[1 - (near_wall is not None) :], np.float64)
    if near_wall is not None and (chain.stiffness is None or near_wall.stiffness is not None):
        stiffness[0] = _wall_stiffness(near_wall, radius[1], plane[1])
    if wall is not None:
        stiffness = np.append(stiffness, _wall_stiffness(wall, radius[-1], plane[-1]))
        gap = np.append(gap, wall.gap)
    constant, static = np.zeros(radius.size), np.zeros(stiffness.size)
    fixed = np.flatnonzero(is_fixed)
    if pressed is not None:
        loaded = 0 if shock is None else shock.loaded_granule
        stops = fixed if near_wall is None else fixed[1:]  # a near wall presses the chain
        constant = pressed.gravity * mass
        constant[: near_wall is not None] = 0.0
        static = _static_forces(constant, pressed.force, loaded, stops)[: stiffness.size]
        constant[loaded] += pressed.force
        if wall is None and not stops.size:
            constant[-1] -= pressed.force
    if fixed.size:
        mass, constant[fixed] = np.where(is_fixed, math.inf, mass), 0.0
    if shock is not None and shock.is_driven:  # at rest the same static load holds it
        mass, constant[0] = np.append(math.inf, mass[1:]), 0.0
    damping = None
    if contact is not None:
        of_contacts = stiffness, _contact_mass(mass, stiffness.size)
        damping = contact.coefficients(*of_contacts)
        for end_wall, k in (wall, -1), (near_wall, 0):
            if end_wall is not None and end_wall.own_damping:
                damping[k] = contact.at(end_wall).coefficients(*of_contacts)[k]
    return Granules(
        **values, mass=mass, velocity=velocity, stiffness=stiffness, gap=gap,
        constant_force=constant, static_force=static, damping=damping,
        is_fixed=is_fixed if fixed.size else False, has_near_wall=near_wall is not None,
        length=length,
    )  # fmt: skip


def _materials(chain: Chain, shock: Shock | None) -> dict[str, FloatArray]:
    """Return the properties of each granule by name, (granules,), those of a striker among them."""
    properties: Any = {key: getattr(chain, key) for key in MATERIAL}
    radius = np.asarray(chain.radius, np.float64)
    if chain.stiffness is not None:
        modulus = equal_modulus(np.asarray(chain.stiffness), radius)
        properties |= {"young_modulus": modulus, "poisson_ratio": 0.0}
    if chain.mass is not None:
        properties["density"] = np.asarray(chain.mass) / granule_mass(radius, 1.0)
    values = {key: np.broadcast_to(value, chain.granules) for key, value in properties.items()}
    if shock is not None and shock.material:
        values = {key: np.array(value, np.float64) for key, value in values.items()}
        for key, value in shock.material.items():
            values[key][0] = value
    return values


def _static_forces(
    weight: FloatArray, load: float, loaded: int, stops: NDArray[np.intp]
) -> FloatArray:
    """Return the static force ahead of each granule [N], (granules,), by weights and a load [N].

    ``loaded`` is the place of the granule with the load, ``stops`` those of fixed granules.
    """
    static = np.zeros(weight.size)
    for begin, end in zip([loaded, *(stops + 1)], [*stops, weight.size], strict=True):
        static[begin:end] += load + np.cumsum(weight[begin:end])
        load = 0.0  # a fixed granule takes the whole load
    return static


def _contact_mass(mass: FloatArray, contacts: int) -> FloatArray:
    with np.errstate(invalid="ignore"):
        pairs = _together(mass)
    held = np.isinf(mass)
    pairs = np.where(held[:-1], mass[1:], np.where(held[1:], mass[:-1], pairs))
    return np.concatenate([pairs, mass[-1:]])[:contacts]


def _together(values: FloatArray) -> FloatArray:
    """1 / (1/a + 1/b) of neighbours a and b, shape (granules - 1,)."""
    return values[:-1] * values[1:] / (values[:-1] + values[1:])


def _wall_stiffness(wall: Wall, radius: float, plane: float) -> float:
    """A of a sphere on a plane: R* is the radius, and a rigid wall does not deform."""
    if wall.stiffness is not None:
        return wall.stiffness
    if wall.kind == "rigid":
        reduced = plane
    elif wall.kind == "same":
        reduced = plane / 2
    else:
        other = hertz.plane_modulus(wall.young_modulus, wall.poisson_ratio)
        reduced = plane * other / (plane + other)
    return float(hertz.stiffness_of(radius, reduced))
