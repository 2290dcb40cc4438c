"""Words of a deck's own commands that are not the scene's, and numbers that make them so."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading import FoundDeck
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.sine import Sine
from hertzchain.verdict.deck.deck_check import Case
from hertzchain.verdict.deck.formula import EXACT, Formula, Span, in_text
from hertzchain.verdict.deck.measured import far_wall
from hertzchain.verdict.deck.places import Changes, commands_of
from hertzchain.verdict.deck.right_commands import damping_words, wall_plane
from hertzchain.verdict.lint.script import number, types_of

_LAW = re.compile(r"hertz/material|hertz|jkr|dmt")
_FORCE = 1e-6  # of the peak force: formulas of forces have rounded numbers, too (chosen)
_JUMPS = 4  # readings at which a formula may jump the other way (chosen)
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


# ---- Numbers of the deck


def _known(case: Case) -> list[float]:
    """Moduli, Poisson ratios and radii of the scene, as decks have them."""
    granules, unit, made = case.scene.granules, case.units, list[float]()
    for values, size in (
        (granules.young_modulus, unit.pressure), (granules.poisson_ratio, 1.0),
        (granules.radius, unit.length), (2 * granules.radius, unit.length),
    ):  # fmt: skip
        made += np.unique(values / size).tolist()
    return made


def _known_of_shock(case: Case) -> list[float]:
    """Force, times and frequencies of the scene's shock, as decks have them."""
    scene, unit = case.scene, case.units
    made = [scene.peak_force / unit.force]
    if isinstance(scene.shock, Pulse) and scene.rise_time is not None:
        times = (scene.rise_time, scene.pulse_end, scene.pulse_end - scene.rise_time)
        made += [one / unit.time for one in (*times, 2 * scene.rise_time)]
    if isinstance(scene.shock, Sine):
        frequency = scene.shock.frequency * unit.time
        made += [frequency, 1 / frequency, scene.shock.cycles / frequency, 2 * math.pi * frequency]
    return made


def _words(text: str) -> list[tuple[int, int]]:
    """Where the words of a command stand; a ``$(...)`` or quoted text is one of them."""
    return [
        match.span() for match in re.finditer(r'(?:"[^"]*"|\$\([^)]*(?:\)[^\s)]*)*\)|\S)+', text)
    ]


def _right_word(case: Case, index: int, target: Target) -> list[Span]:
    """What may stand in place of a number so that a word is right, the likeliest first."""
    one, (k, value) = case.found.commands[index], target
    spans, words = _words(one.written), one.text.split()
    if len(spans) != len(words):
        return []
    formula = Formula(case.found.commands, index, *spans[k], {})
    known = {*_known(case), value}
    return [
        *formula.right_numbers(np.array(value), known),
        Span(index, *spans[k], in_text(value)),
    ]


def _with(case: Case, spans: Sequence[Span]) -> Changes:
    """Commands with other numbers in their places."""
    texts: dict[int, str] = {}
    for span in sorted(set(spans), key=lambda one: -one.start):
        text = texts.get(span.command, case.found.commands[span.command].written)
        texts[span.command] = text[: span.start] + span.text + text[span.end :]
    commands = case.found.commands
    return {
        (commands[k].file, commands[k].line, commands[k].written): (text,)
        for k, text in texts.items()
    }


def right_law(case: Case, k: int) -> tuple[int | None, tuple[Changes, ...]]:
    """The command that is to blame for the law of a contact, and its own corrections.

    None where all of its words are the scene's, or cannot be judged.
    """
    wall = far_wall(case.found)
    if k + 1 < case.near.size or case.scene.wall is None:
        return _right(case, laws_of(case.found, k), _law_targets)
    return _right(case, [] if wall is None else [wall.command], _wall_targets)


def right_plane(case: Case) -> tuple[int | None, tuple[Changes, ...]]:
    """The command that is to blame for the place of the wall, and its own corrections."""
    wall = far_wall(case.found)
    return _right(case, [] if wall is None else [wall.command], _plane_target)


def _right(
    case: Case, lines: Sequence[int], targets: Callable[[Case, int], Iterator[Target]]
) -> tuple[int | None, tuple[Changes, ...]]:
    """The first of some commands with a wrong word, and corrections of all of them."""
    wrong = []
    for index in lines:
        words = case.found.commands[index].text.split()
        for at, value in targets(case, index):
            own = number(words[at]) if at < len(words) else None
            least = max(EXACT * abs(value), _TINY)
            if own is not None and abs(own - value) > least:
                wrong.append(_right_word(case, index, (at, value)))
    if not all(wrong) or not wrong:
        return None, ()
    tried = [
        _with(case, [spans[min(n, len(spans) - 1)] for spans in wrong])
        for n in range(max(map(len, wrong)))
    ]
    return wrong[0][0].command, tuple(tried)


# ---- The force of the shock


def right_force(
    case: Case, time: FloatArray, force: FloatArray, expected: FloatArray
) -> tuple[int | None, tuple[Changes, ...]]:
    """The command that is to blame for the applied force, and its own corrections.

    ``time`` is that of the scene [s], ``force`` what the deck and ``expected`` what the scene has
    then [N]. None where no formula makes that force.
    """
    found, unit = case.found, case.units
    if found.axis not in "xyz":
        return None, ()
    axis, scale = "xyz".index(found.axis), _FORCE * case.scene.peak_force
    size = float(found.direction[axis]) * unit.force
    time = (time + case.start) / unit.time
    for index, one in enumerate(found.commands):
        spans, words = _words(one.written), one.text.split()
        if words[:1] != ["fix"] or words[3:4] != ["addforce"] or len(spans) != len(words):
            continue
        for late, reset in [*_reset(case), (0.0, None)]:
            formula = Formula(found.commands, index, *spans[4 + axis], {"time": time + late})
            value = formula.value()
            if value is None:
                continue
            rest = force - size * value  # other fixes may add what is constant
            constant = float(np.median(rest))
            sure = np.abs(rest - constant) <= scale
            if np.count_nonzero(~sure) <= _JUMPS and reset is not None:
                return reset, (
                    _with(case, [Span(reset, *_words(found.commands[reset].written)[1], "0")]),
                )
            if np.count_nonzero(~sure) <= _JUMPS and np.any(force):
                formula = replace(formula, given={"time": (time + late)[sure]})
                target = (expected[sure] - constant) / size
                right = formula.right_numbers(target, _known_of_shock(case), _FORCE)
                if right:
                    return right[0].command, tuple(_with(case, [span]) for span in right)
            elif not np.any(force) and np.all(np.abs(size * value - expected) <= scale):
                return _nobody(case, words[2])
    return None, ()


def _nobody(case: Case, name: str) -> tuple[int | None, tuple[Changes, ...]]:
    """The command that makes a group in which granule 1 is not, and how it would be."""
    for index, one in reversed([*enumerate(case.found.commands)]):
        if one.text.split()[:2] == ["group", name]:
            at = one.file, one.line, one.written
            return index, ({at: (f"group {name} id {int(case.found.ids[0])}",)},)
    return None, ()


def _reset(case: Case) -> list[tuple[float, int]]:
    """By how much the deck's time is ahead at its first run, in its units, and the command."""
    found = case.found
    early = enumerate(found.commands[: found.first_run])
    resets = [(one.text.split(), k) for k, one in early if one.text.startswith("reset_timestep")]
    late = [(float(words[1]) * found.runs[0].dt / case.units.time, k) for words, k in resets[-1:]]
    return [(ahead, k) for ahead, k in late if ahead > 0]
