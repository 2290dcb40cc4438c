"""Gauges: sensors in a chain, which change nothing in it."""

from __future__ import annotations

from dataclasses import dataclass, field

from hertzchain.errors import require, require_one
from hertzchain.scene.keys import check, key

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

    Raises
    ------
    SceneError
        If none or both are given, or if the given number is not whole.
    """

    granule: int | None = field(default=None, metadata=key(kind="int"))
    contact: int | None = field(default=None, metadata=key(kind="int"))

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
        """Raise a SceneError if a chain has no such granule or contact."""
        last = granules + (self.key == "contact" and has_wall)
        first = 1 if has_near_wall else 2
        allowed = f"must be a {self.key} from {first} to {last}"
        require(first <= self.number <= last, f"gauge.{self.key}", self.number, allowed)
