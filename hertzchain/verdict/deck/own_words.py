"""Words of a deck's own commands that are not the scene's, and what they should be."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundDeck
from hertzchain.verdict.deck.deck_check import Case
from hertzchain.verdict.deck.measured import far_wall
from hertzchain.verdict.deck.places import Changes, commands_of, place, with_number
from hertzchain.verdict.deck.right_commands import damping_words, in_text, wall_plane
from hertzchain.verdict.lint.script import number, types_of

_LAW = re.compile(r"hertz/material|hertz|jkr|dmt")
_WORD = re.compile(r'(?:"[^"]*"|\$\([^)]*(?:\)[^\s)]*)*\)|\S)+')  # a ``$(...)`` is one of them
_EXACT = 1e-9  # relative: a word with rounded digits is off by more (chosen)
_ALIKE = 1e-9  # relative: numbers of granules that are of one kind (chosen)

_TINY = 1e-290  # what LAMMPS of some versions needs in place of no damping, 1e-300, is none

Target = tuple[int, float]
"""Which word of a command should have which value, in units of the deck."""


# ---- What words of commands should be


def laws_of(found: FoundDeck, k: int) -> list[int]:
    """The commands that make the law of a contact between granules."""
    coefficients = commands_of(found, "contacts")
    low, high = sorted((int(found.types[k]), int(found.types[k + 1])))

    def last(one: int, other: int) -> list[int]:
        own = [
            index for index in coefficients
            if (words := found.commands[index].text.split())[0] == "pair_coeff"
            and len(words) > 3 and _covers(words[1], words[2], one, other)
        ]  # fmt: skip
        return own[-1:]

    mixed = [] if low == high else [*last(low, low), *last(high, high)]
    styles = [
        at for at in coefficients if found.commands[at].text.split()[1].startswith("gran/hertz")
    ]
    return last(low, high) or mixed or styles[-1:]


def _covers(first: str, second: str, low: int, high: int) -> bool:
    """Whether the types of a pair_coeff are these."""
    one, other = types_of(first, high) or (), types_of(second, high) or ()
    return (low in one and high in other) or (high in one and low in other)


def _only(values: Sequence[float] | FloatArray) -> float | None:
    """The value that all of some have; None where they differ, or there is none."""
    if not len(values) or max(values) - min(values) > _ALIKE * abs(max(values)):
        return None
    return float(values[0])


def _law_targets(case: Case, index: int) -> Iterator[Target]:
    """Stiffness or modulus, Poisson ratio and damping of a law between granules."""
    found, granules, unit = case.found, case.scene.granules, case.units.pressure
    words, count = (
        found.commands[index].text.split(),
        min(case.found.types.size, len(granules.mass)),
    )
    kinds, styles = found.types[:count], words[0] == "pair_style"
    covered = [
        k for k in range(count - 1)
        if styles or _covers(words[1], words[2], int(kinds[k]), int(kinds[k + 1]))
    ]  # fmt: skip
    at = next((k for k, word in enumerate(words) if _LAW.fullmatch(word)), None)
    if styles:
        at = 1
    if at is None:
        return
    if words[at] in ("hertz/material", "jkr", "dmt"):
        own = [k for k in range(count) if _covers(words[1], words[2], *[int(kinds[k])] * 2)]
        both = (granules.young_modulus[own] / unit, 1), (granules.poisson_ratio[own], 3)
        for values, further in both:
            if (value := _only(values)) is not None:
                yield at + further, value
    elif (normal := _only([4 / 3 * case.reduced_modulus(k) / unit for k in covered])) is not None:
        yield at + 1, normal
    if not styles and covered and words[at] in ("hertz/material", "hertz"):
        yield from _damping_target(case, covered[0], words, at + 2)


def _damping_target(case: Case, k: int, words: list[str], at: int) -> Iterator[Target]:
    """The number of damping, where the kind of damping is the scene's."""
    kind = words[words.index("damping") + 1] if "damping" in words[:-1] else "viscoelastic"
    value, behind = damping_words(case, k, case.found.version)
    # Without damping a restitution is 1, or it has another meaning.
    if kind in (behind.split() or ("velocity", "mass_velocity", "viscoelastic")):
        yield at, float(value)


def _wall_targets(case: Case, index: int) -> Iterator[Target]:
    """Stiffness and damping of the wall."""
    scene, words, unit = case.scene, case.found.commands[index].text.split(), case.units.pressure
    at = next((k for k, word in enumerate(words) if re.fullmatch(r"hertz(/\w+)?", word)), None)
    if at is None or scene.wall is None:
        return
    last = case.near.size - 1
    if words[at] != "hertz/material":
        yield at + 1, 4 / 3 * case.reduced_modulus(last) / unit
    elif scene.wall.kind == "same":
        yield at + 1, float(scene.granules.young_modulus[-1]) / unit
        yield at + 3, float(scene.granules.poisson_ratio[-1])
    if scene.contact is not None:
        yield from _damping_target(case, last, words, at + 2)


def _plane_target(case: Case, index: int) -> Iterator[Target]:
    """The place of the wall."""
    words, plane = case.found.commands[index].text.split(), f"{case.found.axis}plane"
    if plane in words:
        yield words.index(plane) + (2 if case.found.direction.sum() > 0 else 1), wall_plane(case)


# ---- Corrections


def right_law(case: Case, k: int) -> tuple[int | None, tuple[Changes, ...]]:
    """The command that is to blame for the law of a contact, and its own corrections.

    None where all of its words are the scene's, or cannot be judged.
    """
    wall = far_wall(case.found)
    if k + 1 < case.near.size or case.scene.wall is None:
        return _right(case, "contacts", laws_of(case.found, k), _law_targets)
    return _right(case, "wall", [] if wall is None else [wall.command], _wall_targets)


def right_plane(case: Case) -> tuple[int | None, tuple[Changes, ...]]:
    """The command that is to blame for the place of the wall, and its own corrections."""
    wall = far_wall(case.found)
    return _right(case, "wall", [] if wall is None else [wall.command], _plane_target)


def _right(
    case: Case, role: str, lines: Sequence[int],
    targets: Callable[[Case, int], Iterator[Target]],
) -> tuple[int | None, tuple[Changes, ...]]:  # fmt: skip
    """The first line with a wrong word, and corrections of all: of variables, or of the words."""
    blamed, of_variables, of_words = list[int](), Changes(), Changes()
    for index in lines:
        one = case.found.commands[index]
        words, written = one.text.split(), _WORD.findall(one.written)
        if len(written) != len(words):
            return None, ()
        for at, value in targets(case, index):
            own = number(words[at]) if at < len(words) else None
            if own is None or abs(own - value) <= max(_EXACT * abs(value), _TINY):
                continue
            pairs = [(own, value)]
            where = place(case.found, role, pairs, index)
            right = where and with_number(case.found, where, pairs)
            if where is not None and where.index != index and right:
                of_variables[where.file, where.line, where.written] = (right,)
            written[at] = in_text(value)
            of_words[one.file, one.line, one.written] = (" ".join(written),)
            blamed.append(where.index if where is not None else index)
    if not blamed:
        return None, ()
    return blamed[0], (of_variables, of_words) if of_variables else (of_words,)
