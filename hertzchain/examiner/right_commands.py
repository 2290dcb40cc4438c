"""The commands of a scene in the units, types and directions of a user's deck."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.deck import force_formula
from hertzchain.engines.lammps.dialect import (
    NO_FRICTION,
    WITHOUT_ATTRACTION,
    damping_number,
    damping_of,
)
from hertzchain.engines.lammps.reading.contents import FoundDeck
from hertzchain.examiner.examined import Case
from hertzchain.scene.ramp import Ramp

_MOST_LINES = 64  # commands that a correction may add, one for each granule (chosen)
_MOST_ROWS = 40  # most rows of a table that are written as one formula (chosen)
_LIMITED_SINCE = "20220804"  # first version whose damping the scene's corrections limit
_MODULUS_DIFFERENCE = 1e-9  # relative difference of moduli up to which granules are of one material


def in_text(value: float) -> str:
    """Return a number as text for a command."""
    return f"{value:.10g}"


# ---- Names of the deck, or new ones


def _unused(deck: FoundDeck, kind: str, name: str) -> str:
    """Return a name that no command of a kind uses: this one, or with a number added."""
    taken, new, number = {"all", *(words[1] for words in _made(deck, kind))}, name, 2
    while new in taken:
        new, number = f"{name}_{number}", number + 1
    return new


def _made(deck: FoundDeck, kind: str) -> list[list[str]]:
    """The words of the commands of a kind that were carried out."""
    lines = [command.text.split() for command in deck.commands if command.carried_out]
    return [words for words in lines if words[:1] == [kind] and len(words) > 1]


def _on_granule(deck: FoundDeck, granule: int, command: str) -> list[str]:
    """Return a command for a single granule, in which ``{group}`` stands for its group.

    It is a group of the deck; if there is none, the command that makes one is added before.
    """
    groups = [words[1:] for words in _made(deck, "group")]
    names, alone = [name for name, *_ in groups], ["id", str(int(deck.ids[granule]))]
    for name, *rest in groups:
        if rest == alone and names.count(name) == 1:
            return [command.replace("{group}", name)]
    new = _unused(deck, "group", f"granule{granule + 1}")
    return [f"group {new} {' '.join(alone)}", command.replace("{group}", new)]


# ---- Commands


def vector(case: Case, value: str) -> str:
    """Three components of a value along the chain, from granule 1 on."""
    parts = []
    for share in case.deck.direction.tolist():
        if share == 0:
            parts.append("0.0")
        elif abs(share) == 1:
            parts.append(value if share > 0 else f"-{value}".replace("--", ""))
        else:
            parts.append(in_text(float(value) * share))
    return " ".join(parts)


def _each(case: Case, keyword: Callable[[float], str], values: FloatArray) -> list[str]:
    """Commands ``set`` that give each granule its number."""
    deck = case.deck
    if values.size != deck.ids.size:
        return []
    if np.ptp(values) == 0:
        return [f"set group all {keyword(values[0])}"]
    of_types = {int(kind): values[deck.types == kind] for kind in deck.types}
    if all(np.ptp(part) == 0 for part in of_types.values()):
        return [f"set type {kind} {keyword(part[0])}" for kind, part in sorted(of_types.items())]
    lines = [f"set atom {int(k)} {keyword(v)}" for k, v in zip(deck.ids, values, strict=True)]
    return lines if len(lines) <= _MOST_LINES else []


def granule_commands(case: Case) -> list[str]:
    """Return diameters, then densities: LAMMPS computes masses from both."""
    granules, unit = case.scene.granules, case.units
    density = granules.density / unit.density
    return [
        *_each(case, lambda v: f"diameter {in_text(v)}", 2 * granules.radius / unit.length),
        *_each(case, lambda v: f"density {in_text(v)}", density),
    ]


def place_commands(case: Case) -> list[str] | None:
    """Return commands for all centres of the scene, from granule 1 on; None for too many."""
    deck, place = case.deck, case.scene.granules.position
    if place.size != deck.ids.size or place.size > _MOST_LINES:
        return None
    where = (deck.origin + np.outer(place, deck.direction)) / case.units.length
    return [
        f"set atom {int(k)} x {x:.17g} y {y:.17g} z {z:.17g}"
        for k, (x, y, z) in zip(deck.ids, where.tolist(), strict=True)
    ]


def velocity_commands(case: Case) -> list[str]:
    """Return commands for velocities and spins at the start: 0 except those of the scene."""
    commands = ["velocity all set 0.0 0.0 0.0 units box"]
    if np.any(case.deck.spin):
        commands.append("set group all omega 0.0 0.0 0.0")
    velocity = case.scene.granules.velocity
    for k in np.flatnonzero(velocity).tolist():
        if k == 0 and case.scene.piston is not None:
            continue
        speed = in_text(float(velocity[k]) / case.units.velocity)
        moving = f"velocity {{group}} set {vector(case, speed)} units box"
        commands += _on_granule(case.deck, k, moving)
    return commands


def damping_words(case: Case, k: int, version: str) -> tuple[str, str]:
    """Return the number of a contact's damping in a deck, and the words after its friction."""
    contact, granules, unit = case.scene.contact, case.scene.granules, case.units
    if contact is None:
        return "0.0", ""
    if k == granules.mass.size - 1:
        contact = contact.at(case.scene.wall)
    normal, masses = 4 / 3 * case.reduced_modulus(k), granules.contact_mass
    number = damping_number(contact, normal, float(masses[min(k, masses.size - 1)]))
    units = {"viscoelastic": unit.length * unit.time, "dashpot": unit.time / unit.mass}
    words = damping_of(contact)[1].replace("${damping}", "coeff_restitution")
    if version < _LIMITED_SINCE:
        words = words.removesuffix(f" {WITHOUT_ATTRACTION}")
    return in_text(number * units.get(contact.damping, 1.0)), f" {words}"


def law_commands(case: Case) -> list[str] | None:
    """Return style and coefficients of the scene's contacts; None if types do not allow them."""
    deck, granules = case.deck, case.scene.granules
    count = min(deck.types.size, granules.mass.size)
    between = granules.mass.size - 1
    coefficients: dict[tuple[int, int], tuple[float, str, str]] = {}
    for k in range(min(between, count - 1)):
        low, high = sorted((int(deck.types[k]), int(deck.types[k + 1])))
        normal = 4 / 3 * case.reduced_modulus(k) / case.units.pressure
        eta, words = damping_words(case, k, deck.version)
        first = coefficients.setdefault((low, high), (normal, eta, words))
        if abs(first[0] / normal - 1) > _MODULUS_DIFFERENCE or first[1:] != (eta, words):
            return None
    if not coefficients:
        return None
    if len(set(coefficients.values())) == 1:
        normal, eta, words = next(iter(coefficients.values()))
        law = f"hertz {in_text(normal)} {eta}"
        return ["pair_style granular", f"pair_coeff * * {law} {NO_FRICTION}{words}"]
    lines = ["pair_style granular"]
    kinds = range(1, max(high for _, high in coefficients) + 1)
    # Pairs that never touch need coefficients, too.
    others = next(iter(coefficients.values()))
    for pair in itertools.combinations_with_replacement(kinds, 2):
        normal, eta, words = coefficients.get(pair, others)
        lines.append(
            f"pair_coeff {pair[0]} {pair[1]} hertz {in_text(normal)} {eta} {NO_FRICTION}{words}"
        )
    return lines


def wall_plane(case: Case) -> float:
    """Return the place of the scene's wall along an axis of a deck, in the deck's units."""
    granules, deck = case.scene.granules, case.deck
    k = "xyz".index(deck.axis)
    far = float(granules.position[-1] + granules.radius[-1] + case.twin.opening[-1])
    return round(float(deck.origin[k] + deck.direction[k] * far) / case.units.length, 15)


def wall_commands(case: Case) -> list[str] | None:
    """Return the wall of the scene as a fix; None without a wall, or along a diagonal."""
    scene, deck, unit = case.scene, case.deck, case.units
    if scene.wall is None or deck.axis not in "xyz":
        return None
    k = "xyz".index(deck.axis)
    where = f"{wall_plane(case):.15g}"
    side = f"NULL {where}" if deck.direction[k] > 0 else f"{where} NULL"
    normal = in_text(4 / 3 * case.reduced_modulus(case.near.size - 1) / unit.pressure)
    eta, words = damping_words(case, case.near.size - 1, deck.version)
    if scene.contact is None:  # a wall without damping needs a number for it in some versions
        eta, words = "1e-300", " damping velocity"
    name = _unused(deck, "fix", "wall")
    law = f"hertz {normal} {eta} {NO_FRICTION}{words}"
    return [f"fix {name} all wall/gran granular {law} {deck.axis}plane {side}"]


def load_commands(case: Case) -> list[str]:
    """Gravity and precompression of a scene."""
    pressed, deck, unit = case.scene.precompression, case.deck, case.units
    if pressed is None:
        return []
    commands = []
    if pressed.gravity:
        size = in_text(pressed.gravity / (unit.length / unit.time**2))
        name = _unused(deck, "fix", "gravity")
        commands.append(f"fix {name} all gravity {size} vector {vector(case, '1')}")
    if pressed.force:
        size = in_text(pressed.force / unit.force)
        ends = [(case.scene.shock.loaded_granule, size)]
        if not case.scene.wall and not case.scene.holds:
            ends.append((deck.ids.size - 1, f"-{size}"))
        for granule, value in ends:
            name = _unused(deck, "fix", f"load{granule + 1}")
            load = f"fix {name} {{group}} addforce {vector(case, value)}"
            commands += _on_granule(deck, granule, load)
    return commands


def motion_commands(case: Case) -> list[str]:
    """Return velocity Verlet of all granules except fixed ones and those that a fix leads."""
    deck, commands = case.deck, []
    name = _unused(deck, "fix", "motion")
    led = [deck.commands[fix.command] for fix in deck.fixes if fix.style == "move"]
    groups = [*dict.fromkeys(command.text.split()[2] for command in led)]
    if case.scene.holds:
        groups.append(_unused(deck, "group", "fixed"))
        fixed = case.scene.granules.fixed
        numbers = " ".join(map(str, deck.ids[fixed[fixed < deck.ids.size]].tolist()))
        commands = [f"group {groups[-1]} id {numbers}"]
    if not groups:
        return [f"fix {name} all nve"]
    others = _unused(deck, "group", "others")
    subtracted = f"group {others} subtract all {' '.join(groups)}"
    return [*commands, subtracted, f"fix {name} {others} nve"]


def freeze_commands(case: Case) -> list[str]:
    """Return fix freeze of fixed granules, with which LAMMPS takes their mass as infinite."""
    fixed, ids = case.scene.granules.fixed, case.deck.ids
    numbers = ids[fixed[fixed < ids.size]].tolist()
    if case.scene.contact is None or not numbers:
        return []
    group = _unused(case.deck, "group", "fixed")
    name = _unused(case.deck, "fix", "freeze")
    return [f"group {group} id {' '.join(map(str, numbers))}", f"fix {name} {group} freeze"]


def piston_commands(case: Case) -> list[str] | None:
    """Return the scene's piston as a fix, empty without one; None for a table."""
    piston = case.scene.piston
    if piston is None or piston.velocity is None:
        return [] if piston is None else None
    speed = in_text(piston.velocity / case.units.velocity)
    name = _unused(case.deck, "fix", "piston")
    moving = f"fix {name} {{group}} move linear {vector(case, speed)} units box"
    return _on_granule(case.deck, 0, moving)


def shock_commands(case: Case) -> list[str] | None:
    """Return the variable of the scene's shock and its fix; None for a table of many rows.

    It is empty without a force.
    """
    if not case.scene.ramps:
        return []
    formula = _formula(case)
    if formula is None or case.deck.axis not in "xyz":
        return None
    variable = _variable(case)
    if float(case.deck.direction.sum()) < 0:
        formula = f"-({formula})"
    parts = ["0.0"] * 3
    parts["xyz".index(case.deck.axis)] = f"v_{variable}"
    fix = f"fix {_unused(case.deck, 'fix', 'shock')} {{group}} addforce {' '.join(parts)}"
    text = f'variable {variable} equal "{formula}"'
    return [text, *_on_granule(case.deck, 0, fix)]


def _formula(case: Case) -> str | None:
    """Return the scene's force over the deck's time, in its units; None for a long table."""
    unit = case.units
    pieces = []
    for ramp in case.scene.ramps:
        begin, end = (in_text((case.start + time) / unit.time) for time in (ramp.start, ramp.end))
        low, high = (float(in_text(f / unit.force)) for f in (ramp.start_force, ramp.end_force))
        force = force_formula(Ramp(float(begin), float(end), low, high, ramp.shape))
        pieces.append(f"(time>={begin})*(time<{end})*({force.removeprefix('0.0+')})")
    return "+".join(pieces) if len(pieces) < _MOST_ROWS else None


def _variable(case: Case) -> str:
    """Return the name of the variable of a deck's shock, or else an unused name."""
    deck = case.deck
    along = 4 + "xyz".index(deck.axis)
    names = [words[1] for words in _made(deck, "variable")]
    for words in reversed(_made(deck, "fix")):
        name = "".join(words[along : along + 1]).removeprefix("v_")
        if words[3:4] == ["addforce"] and name in names:
            return name
    return _unused(deck, "variable", "F")
