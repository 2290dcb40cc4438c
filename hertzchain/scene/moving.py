"""Granules that move at the start, where nothing else is the shock."""

from __future__ import annotations

from dataclasses import dataclass

from hertzchain.scene.keys import Positive
from hertzchain.scene.shock import Shock


@dataclass(frozen=True)
class Moving(Shock):
    """No force, striker or piston: granules of the chain itself move at the start."""

    profiles = ("moving granules",)
    noun = "moving granules"
    section = ""

    def stretched(self, time: Positive, length: Positive, modulus: Positive) -> Moving:
        """The shock of a similar scene; see ``Shock``."""
        return self

    def in_words(self, granules: int, momentum_ratio: float) -> str:
        """One line that describes the shock, with the number of granules."""
        return f"{granules} granules"
