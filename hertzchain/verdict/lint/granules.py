"""The granules that a deck makes, one by one, before it takes its first step."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from hertzchain.verdict.lint.arithmetic import number
from hertzchain.verdict.lint.deck import Deck
from hertzchain.verdict.lint.groups import MOST, listed, span
from hertzchain.verdict.lint.script import Command

_MOST_CHANGES = 500_000  # of attributes, all granules together (chosen: a second)
_ACROSS = 1e-6  # diameters by which the places of a row may differ across it (chosen)

# A term of a formula that gives granules numbers of their own, as decks of this package have them.
_BY_GRANULE = re.compile(r"\+\(id(?:==(\d{1,9})|>=(\d{1,9})\)\*\(id<=(\d{1,9}))\)\*(\S+)")

_PLACES, _SPEEDS = ("x", "y", "z"), ("vx", "vy", "vz")  # keywords of ``set``

Number = float | None


@dataclass(frozen=True)
class Row:
    """Granules in a row, in their order along it, in the deck's units; None: not known.

    Parameters
    ----------
    axis
        Along which they lie: 0, 1, 2 for x, y, z.
    ids
        Their numbers in the deck, from 1.
    place, diameter, mass, kind
        Centre along the axis, diameter, mass and type of each.
    velocity
        Of each, its three components.
    groups
        Numbers of the granules in each group; None where they are not known.
    """

    axis: int
    ids: tuple[int, ...]
    place: tuple[Number, ...]
    diameter: tuple[Number, ...]
    mass: tuple[Number, ...]
    kind: tuple[int | None, ...]
    velocity: tuple[tuple[Number, Number, Number], ...]
    groups: dict[str, frozenset[int] | None]

    def members(self, group: str) -> frozenset[int] | None:
        """The granules of a group; None where they are not known."""
        return frozenset(self.ids) if group == "all" else self.groups.get(group)


def row_of(deck: Deck) -> Row | None:
    """The granules of a deck, if it is known which there are and that they lie in a row."""
    if deck.is_partial or deck.named("read_data", "molecule", "replicate", "delete_atoms"):
        return None
    if deck.fixes("pour", "deposit", "rigid", "rigid/small"):
        return None
    maker = _Maker(deck)
    try:
        for command in deck.script.commands:
            if command.never:
                continue
            if command.name in ("run", "minimize", "rerun") and command.words[1:2] != ("0",):
                break
            maker.carry_out(command)
    except _Unknown:
        return None
    return maker.row()


class _Unknown(Exception):
    """It is not known which granules there are."""


class _Maker:
    """Carries out the commands that make and change granules."""

    def __init__(self, deck: Deck) -> None:
        self.deck = deck
        self.places: list[list[Number]] = []
        self.values: dict[str, list[Number]] = {"diameter": [], "mass": [], "kind": []}
        self.velocities: list[list[Number]] = []
        self.groups: dict[str, frozenset[int] | None] = {}
        self.stored: dict[str, list[dict[int, Number]]] = {}  # columns of fixes store/state
        self.formulas: dict[str, str] = {}  # of variables of style atom
        self.left = _MOST_CHANGES
        self.does: dict[str, Callable[[Command], None]] = {
            "create_atoms": self.create, "set": self.set, "group": self.group,
            "velocity": self.move, "displace_atoms": self.displace, "fix": self.fix,
            "variable": self.variable,
        }  # fmt: skip

    def carry_out(self, command: Command) -> None:
        """Take note of what a command does to granules."""
        does = self.does.get(command.name)
        if does is None:
            return
        if command.conditional and command.name == "create_atoms":
            raise _Unknown
        does(command)

    @cached_property
    def scale(self) -> float | None:
        """The spacing of a simple cubic lattice, in which unmarked lengths are."""
        lattices = self.deck.named("lattice")
        if not lattices:
            return 1.0
        scale = number(" ".join(lattices[0].words[2:3]))
        simple = len(lattices) == 1 and len(lattices[0].words) == 3
        if not simple or scale is None or scale <= 0 or lattices[0].words[1] != "sc":
            return None
        return scale ** (-1 / 3) if self.deck.units == "lj" else scale

    def create(self, command: Command) -> None:
        """``create_atoms``: one granule, or a row of lattice sites."""
        words = command.words
        kind = number(" ".join(words[1:2]))
        if words[2:3] == ("single",):
            unit = 1.0 if command.after("units") == "box" else self.scale
            point = [number(word) for word in words[3:6]]
            if len(point) != 3:
                raise _Unknown
            self.add(
                kind,
                [None if x is None or unit is None else x * unit for x in point],
            )
            return
        if words[2:3] not in (("region",), ("box",)) or command.after("subset"):
            raise _Unknown
        boxes = self.deck.named("create_box")
        region = words[3:4] if words[2] == "region" else boxes[-1].words[2:3] if boxes else ()
        for site in self.sites(" ".join(region)):
            self.add(kind, list(site))

    def sites(self, region: str) -> list[tuple[float, float, float]]:
        """The sites of a simple cubic lattice in a block, which has a row of them."""
        unit, scale = self.deck.unit_of(region), self.scale
        ends = self.deck.extent(region)
        if not self.deck.named("lattice") or unit is None or scale is None or None in ends:
            raise _Unknown
        ranges = [
            range(math.ceil(e[0] * unit / scale - 1e-6), math.floor(e[1] * unit / scale + 1e-6) + 1)
            for e in ends
            if e is not None and abs(e[0]) + abs(e[1]) < 1e9 * scale / unit
        ]
        if len(ranges) != 3 or sorted(len(r) for r in ranges)[:2] != [1, 1]:
            raise _Unknown
        if max(len(r) for r in ranges) > MOST:
            raise _Unknown
        x, y, z = ranges
        return [(i * scale, j * scale, k * scale) for k in z for j in y for i in x]

    def add(self, kind: Number, point: list[Number]) -> None:
        """One more granule, as LAMMPS makes it."""
        if len(self.places) >= MOST:
            raise _Unknown
        self.places.append(point)
        self.velocities.append([0.0, 0.0, 0.0])
        for name, value in (("diameter", 1.0), ("mass", math.pi / 6), ("kind", kind)):
            self.values[name].append(value)
        self.count_change()

    def count_change(self) -> None:
        """One more change of a granule: too many are not followed."""
        self.left -= 1
        if self.left < 0:
            raise _Unknown

    def selected(self, style: str, which: str) -> frozenset[int] | None:
        """The granules that ``set`` changes."""
        count = len(self.places)
        if style == "group":
            return self.members(which)
        chosen = span(which, count if style == "atom" else 1_000)
        if chosen is None or style not in ("atom", "type"):
            return None
        if style == "atom":
            return frozenset(chosen) & frozenset(range(1, count + 1))
        kinds = [int(kind) for kind in self.values["kind"] if kind is not None]
        if len(kinds) != count:
            return None
        return frozenset(k for k, kind in enumerate(kinds, start=1) if kind in chosen)

    def members(self, group: str) -> frozenset[int] | None:
        """The granules of a group."""
        if group == "all":
            return frozenset(range(1, len(self.places) + 1))
        return self.groups.get(group)

    def set(self, command: Command) -> None:
        """``set``: size, mass, type and place, in the order in which they are written."""
        words = command.words
        found = self.selected(*words[1:3]) if len(words) > 4 else frozenset()
        unsure = found is None or command.conditional
        chosen = self.members("all") if found is None else found
        for keyword, word in pairwise(words[3:]):
            if keyword in ("diameter", "density", "mass", "type", *_PLACES, *_SPEEDS):
                for k in chosen or ():
                    value = None if unsure else self.value(word, command, k)
                    self.change(keyword, k, value)

    def value(self, word: str, command: Command, granule: int) -> Number:
        """What ``set`` and ``velocity`` give one granule."""
        if not word.startswith("v_") or word[2:] not in self.formulas:
            return self.deck.number(word, command)
        kept = re.fullmatch(r"f_(\w+?)(?:\[(\d+)\])?", self.formulas[word[2:]])
        columns = self.stored.get(kept[1], []) if kept else []
        column = int(kept[2] or 1) if kept else 0
        return columns[column - 1].get(granule) if 1 <= column <= len(columns) else None

    def change(self, keyword: str, k: int, value: Number) -> None:
        """Give one granule an attribute; a density makes a mass with the diameter of now."""
        self.count_change()
        if keyword in _PLACES:
            self.places[k - 1][_PLACES.index(keyword)] = value
        elif keyword in _SPEEDS:
            self.velocities[k - 1][_SPEEDS.index(keyword)] = value
        elif keyword == "density":
            diameter = self.values["diameter"][k - 1]
            mass = None
            if value is not None and diameter is not None:
                mass = math.pi / 6 * diameter * diameter * diameter * value
            self.values["mass"][k - 1] = mass
        else:
            name = "kind" if keyword == "type" else keyword
            self.values[name][k - 1] = value

    def group(self, command: Command) -> None:
        """``group``: by numbers, types, and other groups."""
        name, style, *rest = (*command.words[1:], "", "")
        rest = [word for word in rest if word]
        members: frozenset[int] | None = None
        if style in ("id", "type"):
            members = self.listed(style, rest)
        elif style == "region" and rest:
            members = self.within(rest[0])
        elif style in ("subtract", "union", "intersect") and rest:
            sets = [self.members(other) for other in rest]
            known = [one for one in sets if one is not None]
            if len(known) == len(sets):
                join = {"subtract": frozenset.difference, "union": frozenset.union}
                members = join.get(style, frozenset.intersection)(*known)
        before = self.groups.get(name, frozenset())
        both = None if members is None or before is None else before | members
        self.groups[name] = None if command.conditional else both

    def within(self, region: str) -> frozenset[int] | None:
        """The granules whose centres are in a block."""
        blocks = [r for r in self.deck.named("region") if r.words[1:3] == (region, "block")]
        unit = self.deck.unit_of(region)
        if len(blocks) != 1 or unit is None or blocks[0].after("side") == "out":
            return None
        far = {"INF": math.inf, "EDGE": math.inf}
        ends = [far.get(word, number(word)) for word in blocks[0].words[3:9]]
        known = [end * unit for end in ends if end is not None]
        if len(known) != 6 or any(None in place for place in self.places):
            return None
        low = [-abs(x) if math.isinf(x) else x for x in known[::2]]
        return frozenset(
            k
            for k, place in enumerate(self.places, start=1)
            if all(a <= (x or 0.0) <= b for a, x, b in zip(low, place, known[1::2], strict=True))
        )

    def listed(self, style: str, words: Sequence[str]) -> frozenset[int] | None:
        """The granules of the numbers, or types, that ``group`` lists."""
        count = len(self.places)
        numbers = list(range(1, count + 1)) if style == "id" else self.values["kind"]
        return listed(numbers, words)

    def move(self, command: Command) -> None:
        """``velocity``: set to known numbers, or unknown."""
        words = command.words
        members = self.members(words[1]) if len(words) > 2 else frozenset()
        if len(words) < 3 or words[2] in ("scale", "zero"):
            return
        unit = 1.0 if command.after("units") == "box" else self.scale
        chosen = self.members("all") if members is None else members
        for k in chosen or ():
            for axis, word in enumerate((*words[3:6], "", "", "")[:3]):
                if words[2] == "set" and word == "NULL":
                    continue
                given = self.value(word, command, k) if words[2] == "set" else None
                sure = members is not None and not command.conditional and unit is not None
                self.velocities[k - 1][axis] = (
                    given * unit if sure and given is not None and unit is not None else None
                )
            self.count_change()

    def displace(self, command: Command) -> None:
        """``displace_atoms``: by a known length, or to unknown places."""
        words = command.words
        members = self.members(words[1]) if len(words) > 2 else None
        unit = 1.0 if command.after("units") == "box" else self.scale
        for k in (self.members("all") if members is None else members) or ():
            for axis, word in enumerate((*words[3:6], "", "", "")[:3]):
                by, place = self.deck.number(word, command), self.places[k - 1][axis]
                sure = words[2:3] == ("move",) and members is not None and not command.conditional
                moved = None
                if sure and by is not None and place is not None and unit is not None:
                    moved = place + by * unit
                self.places[k - 1][axis] = moved

    def fix(self, command: Command) -> None:
        """``fix store/state``: what is kept of granules."""
        words = command.words
        if words[2:5] == ("all", "store/state", "0") and not command.conditional:
            self.stored[words[1]] = [self.attribute(word) for word in words[5:]]

    def attribute(self, name: str) -> dict[int, Number]:
        """An attribute of granules as it is now, by their numbers; empty where it is not known."""
        if name in _SPEEDS:
            axis = _SPEEDS.index(name)
            return {k: velocity[axis] for k, velocity in enumerate(self.velocities, start=1)}
        return self.by_granule(self.formulas.get(name.removeprefix("v_"), ""))

    def by_granule(self, formula: str) -> dict[int, Number]:
        """The numbers that a formula gives granules one by one; empty for any other formula."""
        found: dict[int, Number] = {}
        for term in formula.split()[1:] if formula.startswith("0 ") else ():
            match = _BY_GRANULE.fullmatch(term)
            if match is None:
                return {}
            only, first, last, value = match.groups()
            granules = range(int(only or first), min(int(only or last), len(self.places)) + 1)
            self.left -= len(granules)
            if self.left < 0:
                raise _Unknown
            found.update(dict.fromkeys(granules, number(value)))
        return found

    def variable(self, command: Command) -> None:
        """``variable`` of style atom."""
        if len(command.words) > 3 and command.words[2] == "atom":
            self.formulas[command.words[1]] = " ".join(command.words[3:])

    def row(self) -> Row | None:
        """The granules, if they lie in a row."""
        axis = self.axis()
        if axis is None or len(self.places) < 2:
            return None
        along = [place[axis] for place in self.places]
        order = list(range(len(along)))
        if None not in along:
            order.sort(key=lambda k: along[k] or 0.0)

        def in_order(values: Sequence[Number]) -> tuple[Number, ...]:
            return tuple(values[k] for k in order)

        kinds = [None if kind is None else int(kind) for kind in self.values["kind"]]
        velocity = tuple((v[0], v[1], v[2]) for v in (self.velocities[k] for k in order))
        return Row(
            axis=axis, ids=tuple(k + 1 for k in order), place=in_order(along),
            diameter=in_order(self.values["diameter"]), mass=in_order(self.values["mass"]),
            kind=tuple(kinds[k] for k in order), velocity=velocity, groups=self.groups,
        )  # fmt: skip

    def axis(self) -> int | None:
        """The axis along which places differ, if it is one."""
        size = min((d for d in self.values["diameter"] if d), default=1.0)
        same = []
        for k in range(3):
            known = [x for place in self.places if (x := place[k]) is not None]
            spread = max(known) - min(known) if known else math.inf
            same.append(len(known) == len(self.places) and spread <= _ACROSS * size)
        return same.index(False) if same.count(False) == 1 else None
