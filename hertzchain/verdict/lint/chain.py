"""A deck with its granules, contacts, walls and forces one by one, as rules on chains ask."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from hertzchain.verdict.lint import stability
from hertzchain.verdict.lint.contacts import Contact, Wall, contacts_of, walls_of
from hertzchain.verdict.lint.deck import Deck
from hertzchain.verdict.lint.granules import Row, row_of
from hertzchain.verdict.lint.pushing import Force, forces_of, moving_runs, times_of
from hertzchain.verdict.lint.script import Command

_SIMILAR = (
    60  # granules of a chain whose number is not known: its limit is 1.0003 of an endless one
)


@dataclass(frozen=True)
class Pressing:
    """A force that contacts of a deck are pressed by, and the words that say whence it is."""

    force: float
    origin: str


@dataclass(frozen=True)
class Gravity:
    """A ``fix gravity``: the acceleration along x, y and z."""

    command: Command
    along: tuple[float, float, float]


@dataclass(frozen=True)
class Pushed:
    """A component of a force that is a formula, over time; None where that is not known."""

    force: Force
    axis: int
    values: tuple[float, ...] | None


class Chain(Deck):
    """A deck, with what can be known of its chain; None where it cannot be known."""

    @cached_property
    def row(self) -> Row | None:
        """The granules before the first step."""
        return row_of(self)

    @cached_property
    def contacts(self) -> list[Contact] | None:
        """The contact of each granule with the next."""
        return None if self.row is None else contacts_of(self, self.row)

    @cached_property
    def walls(self) -> list[Wall] | None:
        """The walls across the chain."""
        return None if self.row is None else walls_of(self, self.row)

    @cached_property
    def forces(self) -> list[Force]:
        """All ``fix addforce``."""
        return forces_of(self)

    @cached_property
    def along(self) -> int | None:
        """The axis that the granules lie along: 0, 1, 2 for x, y, z."""
        return self.axis if self.row is None else self.row.axis

    @cached_property
    def gravities(self) -> list[Gravity] | None:
        """All ``fix gravity``; None where one is not known."""
        found = []
        for fix in self.fixes("gravity"):
            size = self.number(" ".join(fix.words[4:5]), fix)
            numbers = [self.number(word, fix) for word in fix.words[6:9]]
            known = [one for one in numbers if one is not None]
            style = " ".join(fix.words[5:6])
            count = {"vector": 3, "chute": 1, "spherical": 2}.get(style, 4)
            if size is None or len(known) < count:
                return None
            if style == "vector":
                length = math.hypot(*known) or 1.0
                x, y, z = (size * one / length for one in known)
            else:
                phi, theta = (0.0, 180 - known[0]) if style == "chute" else (known[0], known[1])
                phi, theta = math.radians(phi), math.radians(theta)
                x, y = (size * math.sin(theta) * f(phi) for f in (math.cos, math.sin))
                z = size * math.cos(theta)
            found.append(Gravity(fix, (x, y, z)))
        return found

    @cached_property
    def pushes_over_time(self) -> list[Pushed]:
        """Every component of a force that is a formula, at times at which it acts."""
        runs = moving_runs(self)
        found = []
        for force in self.forces:
            acting = [run for run in force.runs if run.steps != 0]
            for axis, word in enumerate(force.words):
                if word.startswith("v_") and acting:
                    times = list(times_of(acting, len(runs)))
                    values = [force.at(self, axis, run, time) for run, time in times]
                    known = [value for value in values if value is not None]
                    whole = len(known) == len(values) and all(r.end is not None for r in acting)
                    found.append(Pushed(force, axis, tuple(known) if whole else None))
        return found

    @cached_property
    def largest_push(self) -> float | None:
        """The largest force of all ``fix addforce``, any component; None where one is not known."""
        largest = 0.0
        for force in self.forces:
            for word in force.words:
                if not word.startswith("v_") and word not in ("", "NULL"):
                    value = self.number(word, force.command)
                    if value is None:
                        return None
                    largest = max(largest, abs(value))
        for pushed in self.pushes_over_time:
            if pushed.values is None:
                return None
            largest = max([largest, *map(abs, pushed.values)])
        return largest

    @cached_property
    def pressing(self) -> Pressing | None:
        """The largest force known to press a contact: by a force of the deck, or by a striker."""
        found = [Pressing(self.largest_push or 0.0, "the largest force of this deck")]
        if self.row is not None and self.contacts is not None:
            axis = self.row.axis
            for k, contact in enumerate(self.contacts):
                one, other = self.row.velocity[k][axis], self.row.velocity[k + 1][axis]
                masses = self.row.mass[k], self.row.mass[k + 1]
                if None in (one, other, *masses, contact.stiffness) or contact.exponent != 1.5:
                    continue
                hit = abs(one - other)  # type: ignore[operator]
                if hit and min(masses) > 0 and contact.stiffness > 0:  # type: ignore[operator, type-var]
                    force = stability.impact_force(contact.stiffness, *masses, hit)  # type: ignore[arg-type]
                    found.append(Pressing(force, f"what granules that collide at {hit:g} make"))
        largest = max(found, key=lambda pressing: pressing.force)
        return largest if largest.force > 0 else None

    @cached_property
    def masses(self) -> list[float] | None:
        """Of all granules along the chain, or those of a long chain of equal ones; all above 0."""
        if self.row is not None:
            known = [mass for mass in self.row.mass if mass is not None and mass > 0]
            return known if len(known) == len(self.row.mass) else None
        if self.diameter is None or self.density is None:
            return None
        mass = math.pi / 6 * self.diameter**3 * self.density
        return [mass] * _SIMILAR if mass > 0 else None

    @cached_property
    def springs(self) -> tuple[list[float], Pressing | None] | None:
        """The stiffness of all contacts, and the force that presses those of Hertz so hard."""
        if self.row is not None and self.contacts is not None:
            laws = [(contact.stiffness, contact.exponent) for contact in self.contacts]
        elif self.masses is not None:
            laws = [(self.stiffness, 1.5)] * (len(self.masses) - 1)
        else:
            return None
        pressing = None
        if any(exponent != 1 for _, exponent in laws):
            pressing = self.pressing
            if pressing is None:
                return None
        springs = []
        for stiffness, exponent in laws:
            if stiffness is None or stiffness <= 0:
                return None
            force = 0.0 if pressing is None else pressing.force
            springs.append(stiffness if exponent == 1 else stability.spring(stiffness, force))
        return springs, pressing
