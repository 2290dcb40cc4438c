"""Terms: additions of a scene to a uniform chain with free ends, at rest under one pulse.

A term that is absent is None: nothing of it is computed, stored or written. Differing granules and
gaps belong to the chain itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import POSITIVE, SceneError, is_finite, is_positive, require
from hertzchain.scene.chain import check_material, to_plain_numbers

ALL_TERMS = (
    "unlike granules", "gaps", "striker", "piston", "wall", "precompression", "gravity", "damping",
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

NOT_NEGATIVE = "must be a finite number of at least 0"


@dataclass(frozen=True)
class Wall:
    """A plane wall at the far end, across the chain.

    Parameters
    ----------
    kind
        ``rigid``, ``same`` (the material of the last granule) or ``elastic``.
    young_modulus, poisson_ratio
        Material of an elastic wall [Pa], [1]; None for the other kinds.
    yield_strength
        Yield strength of an elastic wall [Pa]; None where it is unknown.
    gap
        Gap between the last granule and the wall at the start [m].

    Raises
    ------
    SceneError
        For a value that is not possible.
    """

    kind: WallKind
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    gap: float = 0.0
    yield_strength: float | None = None

    def __post_init__(self) -> None:
        known = isinstance(self.kind, str) and self.kind in WALLS
        require(known, "kind", self.kind, f"must be one of {', '.join(WALLS)}")
        for key in ("young_modulus", "poisson_ratio", "yield_strength"):
            value = getattr(self, key)
            if self.kind == "elastic":
                given = value is not None or key == "yield_strength"
                require(given, key, None, 'missing, a wall of kind "elastic" needs it')
            else:
                allowed = f'only a wall of kind "elastic" has it, not "{self.kind}"'
                require(value is None, key, value, allowed)
        check_material(self, optional=True)
        require(is_finite(self.gap) and self.gap >= 0, "gap", self.gap, f"{NOT_NEGATIVE} [m]")
        to_plain_numbers(self)


@dataclass(frozen=True)
class Precompression:
    """Constant forces on the chain; the run starts from equilibrium under them.

    Parameters
    ----------
    force
        Force that pushes granule 1 towards the far end [N]. Without a wall an equal force holds the
        last granule.
    gravity
        Acceleration along the chain, towards the far end [m/s^2]; needs a wall.

    Raises
    ------
    SceneError
        For a value below 0, or where both are 0.
    """

    force: float = 0.0
    gravity: float = 0.0

    def __post_init__(self) -> None:
        for key, unit in (("force", "N"), ("gravity", "m/s^2")):
            value = getattr(self, key)
            require(is_finite(value) and value >= 0, key, value, f"{NOT_NEGATIVE} [{unit}]")
        if not (self.force or self.gravity):
            allowed = "both are 0: give one of them, or leave the section out"
            raise SceneError("force and gravity", None, allowed)
        to_plain_numbers(self)


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

    Raises
    ------
    SceneError
        For a value that is not possible, or a parameter of another law.
    """

    damping: DampingLaw
    restitution: float | None = None
    relaxation_time: float | None = None
    coefficient: float | None = None
    attraction: bool = False

    def __post_init__(self) -> None:
        known = isinstance(self.damping, str) and self.damping in DAMPING
        require(known, "damping", self.damping, f"must be one of {', '.join(DAMPING)}")
        needed = DAMPING[self.damping]
        for key in DAMPING.values():
            value = getattr(self, key)
            if key == needed:
                require(
                    value is not None, key, None, f'missing, damping = "{self.damping}" needs it'
                )
            else:
                allowed = f'not allowed with damping = "{self.damping}", which takes {needed}'
                require(value is None, key, value, allowed)
        allowed = "must be a number above 0 and below 1; leave out [contact] for no damping"
        e = self.restitution
        require(e is None or (is_finite(e) and 0 < e < 1), "restitution", e, allowed)
        for key, unit in (("relaxation_time", "s"), ("coefficient", "kg/s")):
            value = getattr(self, key)
            require(value is None or is_positive(value), key, value, f"{POSITIVE} [{unit}]")
        known = isinstance(self.attraction, bool)
        require(known, "attraction", self.attraction, "must be true or false")
        to_plain_numbers(self)

    @property
    def exponent(self) -> float:
        """Exponent q in the damping force c d^q d'."""
        return {"restitution": 0.25, "viscoelastic": 0.5, "dashpot": 0.0}[self.damping]

    def coefficients(self, stiffness: FloatArray, contact_mass: FloatArray) -> FloatArray:
        """Return c of contacts [N s m^-(1+q)] from their A and m*, all of shape (contacts,)."""
        if self.restitution is not None:
            log = math.log(self.restitution)
            alpha = -math.sqrt(5) * log / math.hypot(math.pi, log)
            return np.asarray(alpha * np.sqrt(contact_mass * stiffness))
        if self.relaxation_time is not None:
            return np.asarray(1.5 * self.relaxation_time * stiffness)
        assert self.coefficient is not None
        return np.full(stiffness.shape, self.coefficient)
