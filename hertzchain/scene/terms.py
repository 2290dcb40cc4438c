"""Terms: what a scene can have beyond a uniform chain with free ends, at rest under one pulse.

A term that is absent is None: nothing of it is computed, stored or written. Unlike granules and
gaps stand in the chain itself.
"""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.errors import POSITIVE, SceneError, is_finite, is_positive, require
from hertzchain.scene.chain import Chain, check_material, to_plain_numbers

ALL_TERMS = ("unlike granules", "gaps", "striker", "wall", "precompression", "gravity")
"""Names of all terms, in the order of ``Scene.terms``."""

WALLS = ("rigid", "same", "elastic")
"""Kinds of a wall: one that does not yield, one of the last granule's material, one of its own."""

NOT_NEGATIVE = "must be a finite number of at least 0"


@dataclass(frozen=True)
class Striker:
    """Granule 1 flies into the others, which are at rest, instead of a force that pushes it.

    Parameters
    ----------
    velocity
        Of granule 1 at the start [m/s], above 0.
    radius, young_modulus, poisson_ratio, density
        What differs in granule 1, as in ``Chain``; None for what does not.

    Raises
    ------
    SceneError
        For a value that is not possible.
    """

    velocity: float
    radius: float | None = None
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    density: float | None = None

    def __post_init__(self) -> None:
        require(is_positive(self.velocity), "velocity", self.velocity, f"{POSITIVE} [m/s]")
        check_material(self, optional=True)
        to_plain_numbers(self)


@dataclass(frozen=True)
class Wall:
    """A plane wall at the far end, across the chain.

    Parameters
    ----------
    kind
        ``rigid``, ``same`` (the material of the last granule) or ``elastic``.
    young_modulus, poisson_ratio
        Of an elastic wall [Pa]; None for the others.
    gap
        Between the last granule and the wall at the start [m].

    Raises
    ------
    SceneError
        For a value that is not possible.
    """

    kind: str
    young_modulus: float | None = None
    poisson_ratio: float | None = None
    gap: float = 0.0

    def __post_init__(self) -> None:
        known = isinstance(self.kind, str) and self.kind in WALLS
        require(known, "kind", self.kind, f"must be one of {', '.join(WALLS)}")
        for key in ("young_modulus", "poisson_ratio"):
            value = getattr(self, key)
            if self.kind == "elastic":
                require(value is not None, key, None, 'missing, a wall of kind "elastic" needs it')
            else:
                allowed = f'only a wall of kind "elastic" has it, not "{self.kind}"'
                require(value is None, key, value, allowed)
        check_material(self, optional=True)
        require(is_finite(self.gap) and self.gap >= 0, "gap", self.gap, f"{NOT_NEGATIVE} [m]")
        to_plain_numbers(self)


@dataclass(frozen=True)
class Precompression:
    """Forces that act on the chain all the time; the run starts from equilibrium under them.

    Parameters
    ----------
    force
        Pushes granule 1 towards the far end [N]. Where there is no wall, an equal force holds the
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


def refuse_unsupported(chain: Chain, wall: Wall | None, pressed: Precompression | None) -> None:
    """Raise a SceneError for a weight without a wall, and for a load on a chain with gaps."""
    if pressed is None:
        return
    if wall is None and pressed.gravity:
        allowed = "needs a [wall], which carries the weight of the chain"
        raise SceneError("precompression.gravity", pressed.gravity, allowed)
    closed = "must be 0 with [precompression], which presses all contacts from the start"
    require(not isinstance(chain.gap, tuple) and chain.gap == 0, "chain.gap", None, closed)
    require(wall is None or wall.gap == 0, "wall.gap", wall and wall.gap, closed)
