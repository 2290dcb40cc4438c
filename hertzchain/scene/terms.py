"""Terms beyond a uniform free chain: walls, loads, damping; gauges; uncertain values; granules."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.errors import SceneError, is_positive, require, require_one
from hertzchain.scene.chain import (
    MATERIAL,
    MEASURED,
    Chain,
    Granules,
    contact_mass,
    equal_modulus,
    granule_mass,
    together,
)
from hertzchain.scene.keys import alike, check, key, optional
from hertzchain.scene.shocks import Shock

ALL_TERMS = (
    "single granule", "unlike granules", "measured granules", "gaps", "striker", "piston",
    "local shock", "moving granules", "fixed granules", "wall", "near wall", "precompression",
    "gravity", "damping",
)  # fmt: skip
"""Names of all terms, in the order of ``Scene.terms``."""

WallKind = Literal["rigid", "same", "elastic"]
"""Names of the kinds of a wall."""

WALLS: tuple[WallKind, ...] = get_args(WallKind)
"""Kinds of a wall: rigid, of the last granule's material, or of its own material."""

DampingLaw = Literal["restitution", "viscoelastic", "dashpot"]
"""Names of the laws of damping."""

DAMPING: dict[DampingLaw, str] = {
    "restitution": "restitution",
    "viscoelastic": "relaxation_time",
    "dashpot": "coefficient",
}
"""Laws of damping, each with its parameter."""

RIGID_MODULUS_RATIO = 1e30
"""Young's modulus of a rigid wall over that of the granule next to it (chosen), for codes whose
walls all have one: its deformation is below round-off.
"""


@dataclass(frozen=True)
class Contact:
    """Damping in all contacts, the wall's too: F = A d^(3/2) + c d^q d' for an overlap d > 0.

    Parameters
    ----------
    damping
        ``restitution``: q = 1/4 and c = alpha sqrt(m* A) with
        alpha = sqrt(5) (-ln e) / sqrt(pi^2 + ln^2 e), so that two spheres part with e times the
        velocity of their approach if the contact may pull (Antypov and Elliott, EPL 94 (2011)
        50004). ``viscoelastic``: q = 1/2 and c = 3/2 A times the relaxation time (Kuwabara and
        Kono, Jpn. J. Appl. Phys. 26 (1987) 1230). ``dashpot``: q = 0 and c the coefficient.
    restitution
        e, above 0 and below 1.
    relaxation_time
        Relaxation time of Kuwabara and Kono [s].
    coefficient
        Coefficient of the dashpots [kg/s].
    attraction
        Whether damping may make a contact pull as it opens; if not, its force is 0 there.
    """

    damping: DampingLaw = field(metadata=key(kind="str", choices=tuple(DAMPING)))
    restitution: float | None = optional(
        "",
        "coefficient of restitution e",
        above=0,
        below=1,
        advice="; leave out [contact] for no damping",
    )
    relaxation_time: float | None = optional(
        "s", "relaxation time of contacts", above=0, usual=(1e-12, 1.0)
    )
    coefficient: float | None = optional("kg/s", "coefficient of dashpots", above=0)
    attraction: bool = field(default=False, metadata=key(kind="bool"))

    def __post_init__(self) -> None:
        check(self)
        needed = DAMPING[self.damping]
        allowed = f'missing, damping = "{self.damping}" needs it'
        require(getattr(self, needed) is not None, needed, None, allowed)
        for name in DAMPING.values():
            allowed = f'not allowed with damping = "{self.damping}", which takes {needed}'
            value = getattr(self, name)
            require(value is None or name == needed, name, value, allowed)

    @property
    def parameter(self) -> float:
        """The parameter of the law, which is e, a time [s] or a coefficient [kg/s]."""
        return float(getattr(self, DAMPING[self.damping]))

    def at(self, wall: Wall | None) -> Contact:
        """Return the law in the contact with a wall, which may have a parameter of its own."""
        wall_damping = wall.own_damping if wall is not None else {}
        return self.with_parameter(wall_damping[DAMPING[self.damping]]) if wall_damping else self

    def with_parameter(self, value: float) -> Contact:
        """Return the same law with another parameter."""
        changed: Any = {DAMPING[self.damping]: value}
        return replace(self, **changed)

    @property
    def exponent(self) -> float:
        """Exponent q in the damping force c d^q d'."""
        return {"restitution": 0.25, "viscoelastic": 0.5, "dashpot": 0.0}[self.damping]

    def coefficients(self, stiffness: FloatArray, contact_mass: FloatArray) -> FloatArray:
        """Return c of contacts [N s m^-(1+q)] from their A and m*, all of shape (contacts,)."""
        if self.damping == "restitution":
            log = math.log(self.parameter)
            alpha = -math.sqrt(5) * log / math.hypot(math.pi, log)
            return np.asarray(alpha * np.sqrt(contact_mass * stiffness))
        if self.damping == "viscoelastic":
            return np.asarray(1.5 * self.parameter * stiffness)
        return np.full(stiffness.shape, self.parameter)


@dataclass(frozen=True)
class Wall:
    """A plane wall at the far end, across the chain, or at the near end.

    Parameters
    ----------
    kind
        ``rigid``, ``same`` (the material of the granule next to it) or ``elastic``; None with
        ``stiffness``, and for a near wall whose stiffness is that of ``Chain``.
    young_modulus, poisson_ratio
        Material of an elastic wall [Pa], [1]; None for the other kinds.
    yield_strength
        Yield strength of an elastic wall [Pa]; None where it is unknown.
    gap
        Gap between the wall and the granule next to it at the start [m].
    restitution, relaxation_time, coefficient
        Parameter of the wall's contact in the law of ``Contact``, which the scene then has; None
        for that of all contacts.
    stiffness
        A of the wall's contact, as it was measured [N m^(-3/2)]; None where it follows.
    """

    kind: WallKind | None = optional("", "wall", kind="str", choices=WALLS)
    young_modulus: float | None = alike(Chain, "young_modulus", "Young's modulus of the wall")
    poisson_ratio: float | None = alike(Chain, "poisson_ratio", "Poisson's ratio of the wall")
    gap: float = field(default=0.0, metadata=key("m", "gap before the wall", least=0))
    yield_strength: float | None = alike(Chain, "yield_strength")
    restitution: float | None = alike(
        Contact, "restitution", "coefficient of restitution of the wall"
    )
    relaxation_time: float | None = alike(Contact, "relaxation_time", "relaxation time of the wall")
    coefficient: float | None = alike(Contact, "coefficient", "coefficient of the wall's dashpot")
    stiffness: float | None = alike(Chain, "stiffness", "stiffness A of the wall")

    def __post_init__(self) -> None:
        check(self)
        allowed = "not allowed with stiffness, which takes its place"
        require(self.kind is None or self.stiffness is None, "kind", self.kind, allowed)
        for name in ("young_modulus", "poisson_ratio", "yield_strength"):
            value = getattr(self, name)
            if self.kind == "elastic":
                given = value is not None or name == "yield_strength"
                require(given, name, None, 'missing, a wall of kind "elastic" needs it')
            else:
                other = "one with stiffness" if self.kind is None else f'"{self.kind}"'
                allowed = f'only a wall of kind "elastic" has it, not {other}'
                require(value is None, name, value, allowed)

    def material(self, young_modulus: float, poisson_ratio: float) -> dict[str, float]:
        """Return the wall's material, by names, from that of the granule next to it."""
        if self.kind == "elastic":
            assert self.young_modulus is not None
            assert self.poisson_ratio is not None
            young_modulus, poisson_ratio = self.young_modulus, self.poisson_ratio
        elif self.kind == "rigid":
            young_modulus, poisson_ratio = RIGID_MODULUS_RATIO * young_modulus, 0.0
        return {"young_modulus": young_modulus, "poisson_ratio": poisson_ratio}

    def stiffness_to(self, radius: float, plane: float) -> float:
        """A of a sphere on the wall [N m^(-3/2)]: R* is the radius, E* from plane moduli."""
        if self.stiffness is not None:
            return self.stiffness
        reduced = plane  # a rigid wall does not deform
        if self.kind == "same":
            reduced = plane / 2
        elif self.kind == "elastic":
            other = hertz.plane_modulus(self.young_modulus, self.poisson_ratio)
            reduced = plane * other / (plane + other)
        return float(hertz.stiffness_of(radius, reduced))

    def damped(self, contact: Contact | None) -> Wall:
        """Return the wall with its own parameter of a law, or without one."""
        names: Any = dict.fromkeys(DAMPING.values())
        if contact is not None:
            names[DAMPING[contact.damping]] = contact.parameter
        return replace(self, **names)

    @property
    def own_damping(self) -> dict[str, float]:
        """The wall's own damping parameters, by name; empty if all contacts share theirs."""
        values = {name: getattr(self, name) for name in DAMPING.values()}
        return {name: value for name, value in values.items() if value is not None}


@dataclass(frozen=True)
class Precompression:
    """Constant forces on the chain; the run starts from equilibrium under them.

    Parameters
    ----------
    force
        Force that pushes granule 1, or granule 2 where a free striker flies onto it, towards the
        far end [N]; a near wall presses granule 1 with it. Without a wall an equal force holds the
        last granule.
    gravity
        Acceleration along the chain, towards the far end [m/s^2]; needs a wall or a fixed last
        granule.
    """

    force: float = field(
        default=0.0,
        metadata=key("N", "precompression", least=0, usual=(1e-6, 1e7)),
    )
    gravity: float = field(
        default=0.0,
        metadata=key("m/s^2", "gravity along the chain", least=0, usual=(1e-6, 1e4)),
    )

    def __post_init__(self) -> None:
        check(self)
        if not (self.force or self.gravity):
            allowed = "both are 0: give one of them, or leave the section out"
            raise SceneError("force and gravity", None, allowed)


NO_GAUGE = "there is none: the scene needs a [[gauge]] with granule or contact"


@dataclass(frozen=True)
class Gauge:
    """A sensor within a granule, or the force of a contact; exactly one of the two.

    Parameters
    ----------
    granule
        A sensor in the middle of this granule reads the mean of the forces on its two sides.
    contact
        Number of a contact, between granules ``contact - 1`` and ``contact``; N + 1 is the contact
        of the wall, 1 that of a near wall.
    """

    granule: int | None = optional(kind="int")
    contact: int | None = optional(kind="int")

    def __post_init__(self) -> None:
        require_one(granule=self.granule, contact=self.contact)
        check(self)

    @property
    def key(self) -> str:
        """``granule`` or ``contact``."""
        return "contact" if self.granule is None else "granule"

    @property
    def place(self) -> str:
        """The place of the gauge, such as ``granule 16``."""
        return f"{self.key} {self.number}"

    def name(self, wall: int | None) -> str:
        """Name of the column of its forces [N]; ``wall`` is the number of the wall's contact."""
        if self.contact is not None and self.contact == wall:
            return "wall_N"
        if self.contact == 1:
            return "near_wall_N"
        return f"{'gauge' if self.granule is not None else 'contact'}_{self.number}_N"

    @property
    def number(self) -> int:
        """Number of the granule or the contact."""
        return int(self.contact if self.granule is None else self.granule)  # type: ignore[arg-type]

    def check(self, granules: int, has_wall: bool, has_near_wall: bool) -> None:
        """Raise a SceneError if a chain has no granule or contact for the gauge."""
        last = granules + (self.key == "contact" and has_wall)
        first = 1 if has_near_wall else 2
        allowed = f"must be a {self.key} from {first} to {last}"
        if first == last:
            allowed = f"must be {last}, the only {self.key} that can have a sensor"
        elif first > last:
            allowed = "granule 1 is pressed on one side only: give contact = 2, or a [near_wall]"
        require(first <= self.number <= last, f"gauge.{self.key}", self.number, allowed)


OF_GRANULES = tuple(f"chain.{key}" for key in (*MATERIAL, "gap", "velocity", *MEASURED))
"""Keys that can scatter among granules."""

SPREAD_ALLOWED = (
    "must be a standard deviation, such as '5 %' or one with a unit, or {half_width = ...}"
)


@dataclass(frozen=True)
class Uncertain:
    """Possible deviation of a value from that in the scene.

    Parameters
    ----------
    key
        The key in the scene file, such as ``chain.young_modulus``.
    size
        Standard deviation of a normal distribution, or half the width of a uniform one; SI units.
    relative
        Whether ``size`` is a fraction of the value of the scene.
    uniform
        Whether the distribution is uniform.
    each
        Whether it is scatter: each granule has a value of its own, all independent.
    """

    key: str
    size: float
    relative: bool = False
    uniform: bool = False
    each: bool = False

    def __post_init__(self) -> None:
        require(is_positive(self.size), self.key, self.size, SPREAD_ALLOWED)
        if self.each:
            require(self.key in OF_GRANULES, self.key, None, f"must be {', '.join(OF_GRANULES)}")

    @property
    def name(self) -> str:
        """The key, with a word for scatter."""
        return f"scatter of {self.key}" if self.each else self.key

    @property
    def written(self) -> Any:
        """The text of it in a scene file."""
        size = f"{100 * self.size:.15g} %" if self.relative else self.size
        return {"half_width": size} if self.uniform else size


def granules_of(
    chain: Chain,
    shock: Shock | None,
    wall: Wall | None,
    pressed: Precompression | None,
    contact: Contact | None,
    near_wall: Wall | None = None,
) -> Granules:
    """Return the granules of a chain with its shock, walls, loads and damping."""
    first = 0 if near_wall is None else 1  # place of granule 1

    def each(values: Any) -> FloatArray:
        return np.array(np.broadcast_to(values, chain.granules), np.float64)

    values = {name: each(value) for name, value in _material(chain).items()}
    length = None if chain.length is None else each(chain.length)
    velocity, gap, is_fixed = each(chain.velocity), each(chain.gap)[1:], each(chain.fixed) > 0
    if shock is not None:
        for name, value in shock.material.items():
            values[name][0] = value
        if shock.impact_velocity is not None:
            velocity[0] = shock.start_velocity
    if near_wall is not None:
        plate = {name: float(value[0]) for name, value in values.items()}
        plate |= near_wall.material(plate["young_modulus"], plate["poisson_ratio"])
        values = {name: np.append(plate[name], value) for name, value in values.items()}
        velocity, gap = np.append(0.0, velocity), np.append(near_wall.gap, gap)
        is_fixed = np.append(True, is_fixed)
        length = None if length is None else np.append(length[0], length)
    radius = values["radius"]
    mass = np.asarray(granule_mass(radius, values["density"]), np.float64)
    plane = hertz.plane_modulus(values["young_modulus"], values["poisson_ratio"])
    stiffness = hertz.stiffness_of(together(radius), together(plane))
    if chain.stiffness is not None:
        stiffness = each(chain.stiffness)[1 - first :]
    if near_wall is not None and (chain.stiffness is None or near_wall.stiffness is not None):
        stiffness[0] = near_wall.stiffness_to(radius[1], plane[1])
    if wall is not None:
        stiffness = np.append(stiffness, wall.stiffness_to(radius[-1], plane[-1]))
        gap = np.append(gap, wall.gap)
    constant, static = np.zeros(radius.size), np.zeros(stiffness.size)
    fixed = np.flatnonzero(is_fixed)
    if pressed is not None:
        loaded = 0 if shock is None else shock.loaded_granule
        stops = fixed[first:]  # a near wall presses the chain
        constant = pressed.gravity * mass
        constant[:first] = 0.0
        static = _static_forces(constant, pressed.force, loaded, stops)[: stiffness.size]
        constant[loaded] += pressed.force
        if wall is None and not stops.size:
            constant[-1] -= pressed.force
    mass[fixed], constant[fixed] = math.inf, 0.0
    if shock is not None and shock.is_driven:  # at rest the same static load holds it
        mass[0], constant[0] = math.inf, 0.0
    damping = None
    if contact is not None:
        of_contacts = stiffness, contact_mass(mass, stiffness.size)
        damping = contact.coefficients(*of_contacts)
        for end_wall, k in (wall, -1), (near_wall, 0):
            damping[k] = contact.at(end_wall).coefficients(*of_contacts)[k]
    return Granules(
        **values, mass=mass, velocity=velocity, stiffness=stiffness, gap=gap,
        constant_force=constant, static_force=static, damping=damping,
        is_fixed=is_fixed if fixed.size else False, has_near_wall=near_wall is not None,
        length=length,
    )  # fmt: skip


def _material(chain: Chain) -> dict[str, Any]:
    """Return the properties of granules by name, for measured ones those of equal spheres."""
    properties: dict[str, Any] = {name: getattr(chain, name) for name in MATERIAL}
    radius = np.asarray(chain.radius, np.float64)
    if chain.stiffness is not None:
        modulus = equal_modulus(np.asarray(chain.stiffness), radius)
        properties |= {"young_modulus": modulus, "poisson_ratio": 0.0}
    if chain.mass is not None:
        properties["density"] = np.asarray(chain.mass) / granule_mass(radius, 1.0)
    return properties


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
