"""A deck against the scene that it is meant to be, as far as its text says what it does.

Numbers of the deck are taken to SI, and those of the scene to the deck's units for what is said.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

from hertzchain.decks.lint.chain import Chain
from hertzchain.decks.lint.contacts import Contact
from hertzchain.decks.lint.finding import Finding, Severity
from hertzchain.decks.lint.granules import Number, Row
from hertzchain.decks.lint.scale import SCALES, Scale, similar
from hertzchain.decks.lint.script import Command

if TYPE_CHECKING:
    from hertzchain.scene.scene import Scene

CLOSE = 1e-3
"""Relative difference of numbers that are the same: people write 3 to 6 digits, and peaks move by
at most 1.6e-3 with one of these numbers (measured in tests/decks/test_lint_scene.py)."""

_SAME_FACTOR = 1e-6  # relative; contacts of a chain that was softened on purpose (chosen)
_SOFTER = 1.1  # factor of stiffness above which times tell a similar chain from a mistake (chosen)


@dataclass
class Against:
    """A deck held against a scene; findings and what is not known are collected."""

    chain: Chain
    scene: Scene
    row: Row | None
    scale: Scale
    softer: float = 1.0  # stiffness of a similar, softer chain over the scene's
    findings: list[Finding] = field(default_factory=list)
    unknown: dict[str, None] = field(default_factory=dict)

    @property
    def time(self) -> float:
        """What the deck's unit of time is worth in the scene [s]."""
        return float(self.scale.time * self.softer ** (1 / 3))

    @property
    def depth(self) -> float:
        """What the deck's unit of overlaps and gaps is worth in the scene [m]."""
        return float(self.scale.length * self.softer ** (2 / 3))

    @property
    def velocity(self) -> float:
        """What the deck's unit of velocity is worth in the scene [m/s]."""
        return self.depth / self.time

    def say(
        self,
        rule: str,
        command: Command | None,
        text: str,
        found: float | None = None,
        expected: float | None = None,
        severity: Severity = "error",
    ) -> None:
        """Note a finding; ``found`` and ``expected`` are in the units of the deck."""
        line = 1 if command is None else command.line
        self.findings.append(Finding(line, f"scene-{rule}", severity, text, found, expected))

    def not_known(self, what: str) -> None:
        """Note what the text does not say."""
        self.unknown[what] = None

    def by(self, attribute: str, k: int) -> Command | None:
        """The command that gave an attribute to the granule at a place in the row."""
        commands = () if self.row is None else self.row.by.get(attribute, ())
        return commands[k] if commands else None


Check = Callable[[Against], None]


def against(chain: Chain, scene: Scene, checks: Sequence[Check]) -> list[Finding]:
    """What differs between a deck and a scene, and in one note what is not known of the deck."""
    row = towards_far_end(chain)
    scale = _scale(chain, row, scene)
    if scale is None:
        return [_unknown_of([f"anything, as the sizes of units {chain.units} are not known"])]
    made = Against(chain, scene, row, scale)
    for check in checks:
        _carry_out(check, made)
    softer = _softer(made)
    if softer is not None:
        other = Against(chain, scene, row, scale, softer)
        for check in checks:
            _carry_out(check, other)
        if not other.findings:  # the same peaks, as all else is scaled with the stiffness
            made = other
    return [*made.findings, *([_unknown_of(list(made.unknown))] if made.unknown else [])]


def _carry_out(check: Check, made: Against) -> None:
    try:
        check(made)
    except ArithmeticError:
        made.not_known("numbers beyond the range of floating point")


def _unknown_of(what: list[str]) -> Finding:
    text = f"not known from the text: {', '.join(what)}; compare --deck asks LAMMPS"
    return Finding(1, "scene", "note", text)


def towards_far_end(chain: Chain) -> Row | None:
    """The granules from the one that is pushed, or that strikes, on."""
    row = chain.row
    if row is None:
        return None
    moved = {k for k, velocity in zip(row.ids, row.velocity, strict=True) if velocity[row.axis]}
    for force in chain.forces:
        if force.unfix is not None or any(word.startswith("v_") for word in force.words):
            moved |= row.members(force.group) or frozenset()
    return row.backwards() if row.ids[-1] in moved and row.ids[0] not in moved else row


def _scale(chain: Chain, row: Row | None, scene: Scene) -> Scale | None:
    if chain.units != "lj":
        return SCALES.get(chain.units)
    if row is None or not chain.contacts:
        return None
    diameter, mass, stiffness = row.diameter[0], row.mass[0], chain.contacts[0].stiffness
    if not diameter or not mass or not stiffness or min(diameter, mass, stiffness) <= 0:
        return None
    granules = scene.granules
    scene_mass = granules.mass.tolist()[0]
    return similar(
        (diameter, 2 * float(granules.radius[0])),
        (mass, scene_mass),
        (stiffness, float(granules.stiffness[0])),
    )


def _softer(made: Against) -> float | None:
    """The stiffness of all contacts over the scene's, where it is the same factor, and not 1."""
    contacts = contacts_in_order(made)
    if contacts is None:
        return None
    own = [contact.stiffness for contact in contacts]
    expected = made.scene.granules.stiffness.tolist()
    own += [wall.contact.stiffness for wall in made.chain.walls or ()]
    if None in own or len(own) != len(expected):
        return None
    unit = made.scale.stiffness
    factors = [a * unit / b for a, b in zip(own, expected, strict=True) if a is not None]
    low, high = min(factors), max(factors)
    known = low > 0 and high / low - 1 < _SAME_FACTOR
    return low if known and not 1 / _SOFTER < low < _SOFTER else None


def contacts_in_order(made: Against) -> list[Contact] | None:
    """The contacts between granules, from the end that is pushed on."""
    contacts, row = made.chain.contacts, made.chain.row
    if contacts is None or row is None or made.row is None:
        return None
    return contacts if made.row.ids == row.ids else contacts[::-1]


def differs(found: float, expected: float) -> bool:
    """Whether two numbers are not the same, as people write them."""
    return abs(found - expected) > CLOSE * abs(expected)


def granules(made: Against) -> None:
    """Number, sizes and masses of the granules."""
    row, scene = made.row, made.scene
    if row is None:
        made.not_known("granules and their places")
        return
    count = scene.chain.granules
    if len(row.ids) != count:
        text = f"the deck has {len(row.ids)} granules, the scene {count}: make {count}"
        made.say("granules", made.by("place", len(row.ids) - 1), text, len(row.ids), count)
        return
    unit = made.scale
    sizes = [2 * radius / unit.length for radius in scene.granules.radius.tolist()]
    named = "write set group all diameter {0:.9g} (twice the radius), then the density"
    wrong = _each(made, "diameter", row.diameter, sizes, named)
    masses = [mass / unit.mass for mass in scene.granules.mass.tolist()]
    densities = [density / unit.density for density in scene.granules.density.tolist()]
    if scene.piston is not None:
        masses[0] = math.nan  # whatever it is
    made_of: list[Number] = []
    for k, (mass, diameter) in enumerate(zip(row.mass, row.diameter, strict=True)):
        if k in wrong and mass is not None and diameter:  # a mass by another size is no finding
            made_of.append(mass * (sizes[k] / diameter) ** 3)
        else:
            made_of.append(mass)
    named = "write set group all density {1:.9g} after the diameter"
    _each(made, "mass", made_of, masses, named, densities)


def _each(
    made: Against,
    what: str,
    found: Sequence[Number],
    expected: Sequence[float],
    write: str,
    other: Sequence[float] | None = None,
) -> set[int]:
    """Compare an attribute of all granules, one finding for each command that is wrong."""
    if None in found:
        made.not_known(f"the {what} of granules")
    wrong = {
        k
        for k, (a, b) in enumerate(zip(found, expected, strict=True))
        if a is not None and differs(a, b)
    }
    said: dict[tuple[int, str], list[int]] = {}
    for k in sorted(wrong):
        command = made.by(what, k)
        alike = f"{found[k]:.6g} {expected[k]:.6g}"
        said.setdefault((-1 if command is None else command.line, alike), []).append(k)
    for places in list(said.values())[:10]:
        k = places[0]
        assert made.row is not None
        name = f"granule {made.row.ids[k]}" + (
            f" and {len(places) - 1} more" if len(places) > 1 else ""
        )
        advice = write.format(expected[k], (other or expected)[k])
        text = (
            f"the {what} of {name} is {found[k]:.6g}, in the scene it is {expected[k]:.6g}:"
            f" {advice}"
        )
        made.say(what, made.by(what, k), text, found[k], expected[k])
    return wrong


def places(made: Against) -> None:
    """Gaps and overlaps before the first step."""
    row, scene = made.row, made.scene
    if row is None or len(row.ids) != scene.chain.granules or None in row.diameter:
        return
    if None in row.place:
        made.not_known("places of the granules")
        return
    granules = scene.granules
    overlaps = granules.static_overlap.tolist()
    gaps = [gap - overlap for gap, overlap in zip(granules.gap.tolist(), overlaps, strict=True)]
    close = CLOSE * scene.units.length
    wrong = []
    diameters = [d for d in row.diameter if d is not None]
    sizes = [2 * radius / made.scale.length for radius in granules.radius.tolist()]
    for k, (one, other) in enumerate(pairwise([p for p in row.place if p is not None])):
        apart = abs(other - one)
        # A wrong size is a finding of its own: right is a gap by the sizes of deck or scene.
        reaches = [sum(diameters[k : k + 2]) / 2]
        if any(differs(diameters[j], sizes[j]) for j in (k, k + 1)):
            reaches.append(sum(sizes[k : k + 2]) / 2)
        off = min(abs((apart - reach) * made.depth - gaps[k]) for reach in reaches)
        if off > close + 1e-15 * apart * made.depth:
            wrong.append((k, apart, reaches[-1] + gaps[k] / made.depth))
    if wrong:
        k, apart, expected = wrong[0]
        more = f" (and {len(wrong) - 1} more pairs)" if len(wrong) > 1 else ""
        text = (
            f"granules {row.ids[k]} and {row.ids[k + 1]} are {apart:.10g} apart{more}, in the scene"
            f" {expected:.10g}: put granule {row.ids[k + 1]} there"
        )
        made.say("places", made.by("place", k + 1), text, apart, expected)
