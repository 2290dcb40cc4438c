"""Corrections of a user's deck: the right commands, each proven by a trial."""

from __future__ import annotations

import itertools
import math
import re
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.deck import force_formula
from hertzchain.engines.lammps.dialect import (
    NO_FRICTION,
    WITHOUT_ATTRACTION,
    damping_number,
    damping_of,
)
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.engines.lammps.reading.text import Edits
from hertzchain.errors import RunFailed
from hertzchain.examiner.examined import (
    ACTS,
    Case,
    Changes,
    Correction,
    DeckCheck,
    DeckExamination,
    Finding,
    Place,
    by_command,
    commands_of,
    formula_of,
    is_of,
    key_of,
    place_at,
)
from hertzchain.examiner.measured import far_wall
from hertzchain.scene.shocks import Ramp

_MOST_LINES = 64  # commands that a correction may add, one for each granule (chosen)
_LIMITED_SINCE = "20220804"  # first version whose damping the scene's corrections limit


def in_text(value: float) -> str:
    """Return a number as text for a command."""
    return f"{value:.10g}"


# ---- Names of the deck, or new ones


def _unused(deck: FoundDeck, kind: str, name: str) -> str:
    """Return a name that no command of a kind uses: this one, or with a number added."""
    taken, new, number = {"all", *(words[1] for words in _words_of(deck, kind))}, name, 2
    while new in taken:
        new, number = f"{name}_{number}", number + 1
    return new


def _words_of(deck: FoundDeck, kind: str) -> list[list[str]]:
    """The words of the commands of a kind that were carried out."""
    lines = (command.text.split() for command in deck.commands if command.carried_out)
    return [words for words in lines if words[:1] == [kind] and len(words) > 1]


def _on_granule(deck: FoundDeck, granule: int, command: str) -> list[str]:
    """Return a command with the group of a granule as ``{group}``; a new group comes first."""
    groups = [words[1:] for words in _words_of(deck, "group")]
    names, alone = [name for name, *_ in groups], ["id", str(int(deck.ids[granule]))]
    for name, *rest in groups:
        if rest == alone and names.count(name) == 1:
            return [command.replace("{group}", name)]
    new = _unused(deck, "group", f"granule{granule + 1}")
    return [f"group {new} {' '.join(alone)}", command.replace("{group}", new)]


# ---- Commands


def vector(case: Case, value: str) -> str:
    """Three components of a value along the chain, from granule 1 on."""
    parts = ["0.0"] * 3
    parts[case.along] = value if case.sign > 0 else f"-{value}".replace("--", "")
    return " ".join(parts)


def _each(case: Case, keyword: str, values: FloatArray) -> list[str]:
    """Commands ``set`` that give each granule its number."""
    deck = case.deck
    if values.size != deck.ids.size:
        return []
    for what, names in (
        ("group", np.full(values.size, "all")),
        ("type", deck.types),
        ("atom", deck.ids),
    ):
        parts = {name: values[names == name] for name in sorted(set(names.tolist()))}
        if all(np.ptp(part) == 0 for part in parts.values()) and len(parts) <= _MOST_LINES:
            return [
                f"set {what} {name} {keyword} {in_text(part[0])}" for name, part in parts.items()
            ]
    return []


def granule_commands(case: Case) -> list[str]:
    """Return diameters, then densities: LAMMPS computes masses from both."""
    granules, unit = case.scene.granules, case.units
    return [
        *_each(case, "diameter", 2 * granules.radius / unit.length),
        *_each(case, "density", granules.density / unit.density),
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


def _law(case: Case, k: int) -> str:
    """Return the law of a contact of the scene, or of its wall, in the words of LAMMPS."""
    contact, granules, unit = case.scene.contact, case.scene.granules, case.units
    normal, is_wall = 4 / 3 * case.reduced_modulus(k), k == granules.mass.size - 1
    # A wall without damping needs a number for it in some versions.
    eta, words = ("1e-300", " damping velocity") if is_wall else ("0.0", "")
    if contact is not None:
        contact = contact.at(case.scene.wall) if is_wall else contact
        masses = granules.contact_mass
        number = damping_number(contact, normal, float(masses[min(k, masses.size - 1)]))
        units = {"viscoelastic": unit.length * unit.time, "dashpot": unit.time / unit.mass}
        eta = in_text(number * units.get(contact.damping, 1.0))
        words = f" {damping_of(contact)[1]}"
        if case.deck.version < _LIMITED_SINCE:
            words = words.removesuffix(f" {WITHOUT_ATTRACTION}")
    return f"hertz {in_text(normal / unit.pressure)} {eta} {NO_FRICTION}{words}"


def law_commands(case: Case) -> list[str] | None:
    """Return style and coefficients of the scene's contacts; None if types do not allow them."""
    types, laws = case.deck.types.tolist(), dict[tuple[int, int], str]()
    for k in range(min(len(types), case.scene.granules.mass.size) - 1):
        low, high = sorted(types[k : k + 2])
        if laws.setdefault((low, high), _law(case, k)) != _law(case, k):
            return None
    if not laws:
        return None
    law, style = next(iter(laws.values())), "pair_style granular"
    if len(set(laws.values())) == 1:
        return [style, f"pair_coeff * * {law}"]
    kinds = range(1, max(high for _, high in laws) + 1)
    # Pairs that never touch need coefficients, too.
    pairs = itertools.combinations_with_replacement(kinds, 2)
    return [style, *(f"pair_coeff {i} {j} {laws.get((i, j), law)}" for i, j in pairs)]


def wall_plane(case: Case) -> float:
    """Return the place of the scene's wall along the axis of a deck, in the deck's units."""
    granules = case.scene.granules
    far = float(granules.position[-1] + granules.radius[-1] + case.twin.opening[-1])
    return round(float(case.deck.origin[case.along] + case.sign * far) / case.units.length, 15)


def wall_commands(case: Case) -> list[str] | None:
    """Return the wall of the scene as a fix; None without a wall."""
    if case.scene.wall is None:
        return None
    where, law = f"{wall_plane(case):.15g}", _law(case, case.near.size - 1)
    side = f"NULL {where}" if case.sign > 0 else f"{where} NULL"
    name = _unused(case.deck, "fix", "wall")
    return [f"fix {name} all wall/gran granular {law} {case.deck.axis}plane {side}"]


def load_commands(case: Case) -> list[str]:
    """Return the commands for the gravity and the precompression of a scene."""
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
    """Return the variable of the scene's shock and its fix, if any; None for many rows."""
    if not case.scene.ramps:
        return []
    # Most rows of a table that are written as one formula (chosen)
    if len(case.scene.ramps) >= 40:
        return None
    unit, pieces, variable = case.units, list[str](), _variable(case)
    for ramp in case.scene.ramps:
        begin, end = (in_text((case.start + time) / unit.time) for time in (ramp.start, ramp.end))
        low, high = (float(in_text(f / unit.force)) for f in (ramp.start_force, ramp.end_force))
        force = force_formula(Ramp(float(begin), float(end), low, high, ramp.shape))
        pieces.append(f"(time>={begin})*(time<{end})*({force.removeprefix('0.0+')})")
    formula = "+".join(pieces) if case.sign > 0 else f"-({'+'.join(pieces)})"
    parts = ["0.0"] * 3
    parts[case.along] = f"v_{variable}"
    fix = f"fix {_unused(case.deck, 'fix', 'shock')} {{group}} addforce {' '.join(parts)}"
    return [f'variable {variable} equal "{formula}"', *_on_granule(case.deck, 0, fix)]


def _variable(case: Case) -> str:
    """Return the name of the variable of a deck's shock, or else an unused name."""
    deck, along = case.deck, 4 + case.along
    names = [words[1] for words in _words_of(deck, "variable")]
    for words in reversed(_words_of(deck, "fix")):
        name = "".join(words[along : along + 1]).removeprefix("v_")
        if words[3:4] == ["addforce"] and name in names:
            return name
    return _unused(deck, "variable", "F")


# ---- Edits


def _without(case: Case, indices: Iterable[int]) -> Changes:
    """Return changes that remove some commands, and the commands that name their fixes."""
    commands, gone = case.deck.commands, list(indices)
    fixes = {commands[k].text.split()[1] for k in gone if commands[k].text.startswith("fix ")}
    users = [[word, name] for word in ("unfix", "fix_modify") for name in fixes]
    gone += [k for k, command in enumerate(commands) if command.text.split()[:2] in users]
    places = [place_at(case.deck, k) for k in gone]
    return {key_of(place): (f"# {place.written}",) for place in places}


def _whole(case: Case, lines: Sequence[str], old: Sequence[int]) -> Iterator[Changes]:
    """Yield changes that put lines in place of old commands, or before the deck's first run."""
    commands, lines = case.deck.commands, list(lines)
    while old and lines and commands[old[0]].text.split() == lines[0].split():
        old, lines = old[1:], lines[1:]
    fixes = (commands[k].text.split()[1] for k in old if commands[k].text.startswith("fix "))
    for k, line in enumerate(lines):
        words = line.split()
        if words[0] == "fix":  # a new one keeps the name of the one that it replaces
            lines[k] = " ".join(["fix", next(fixes, words[1]), *words[2:]])
    gone = _without(case, old)
    if old:
        yield {**gone, key_of(place_at(case.deck, old[0])): tuple(lines)} if lines else gone
    if lines:
        run = commands[case.deck.first_run]
        yield {**gone, key_of(run): (*lines, run.written)}


# ---- Trials with a single command


_CHANGES = re.compile(
    r"(?:pair_coeff|pair_style|set|velocity|displace_atoms|change_box|delete_atoms|create_atoms"
    r"|unfix|fix|reset_timestep)\s"
)
"""Commands that change a chain between two runs."""

_USUAL = re.compile(r"fix\s+\S+\s+\S+\s+(?:nve|nve/sphere|addforce|gravity|wall/gran\S*|move)\s")

_DAMPED = r"(?:pair_coeff|fix\s+\S+\s+\S+\s+wall/gran)\s(?=.*\sdamping\s)"
_UNDAMPED = r"(\s(?:hertz|hertz/material)\s+\S+)\s+(?!0*\.?0*\s|\S+e-\d{3})\S+"
"""A normal law, its stiffness, and a damping above 0, which is wrong in a scene without any."""

_WORDS = (
    (r"fix\s+\S+\s+\S+\s+wall/", r"\s(?:wiggle|shear)\s.*$", ""),
    (r"fix\s+\S+\s+\S+\s+addforce", r"\s+(?:every|region)\s+\S+", ""),
    (r"(?:velocity|fix\s+\S+\s+\S+\s+move)\s(?!.*units\s)", r"\s*$", " units box"),
    (r"(?:pair_coeff|fix\s+\S+\s+\S+\s+wall/gran)\s", _UNDAMPED, r"\1 0.0"),
    (rf"{_DAMPED}(?!.*limit_damping)", r"(\sdamping\s+\S+)", r"\1 limit_damping"),
    (rf"{_DAMPED}.*\slimit_damping", r"\s+limit_damping", ""),
)
"""Commands, and words in them whose absence or presence is tried: pattern and replacement."""


def suspects(deck: FoundDeck) -> list[int]:
    """Commands that may disturb a motion: changes after the first run, then unusual fixes."""
    texts = [command.text for command in deck.commands]
    done = [k for k, command in enumerate(deck.commands) if command.carried_out]
    shock = {texts[fix.command].split()[1] for fix in deck.fixes if fix.style == "addforce"}

    def is_of_shock(k: int) -> bool:
        words = texts[k].split()
        return (words[0] in ("fix", "unfix") and words[1] in shock) or words[3:4] == ["addforce"]

    later = [k for k in done if k > deck.first_run and _CHANGES.match(texts[k])]
    odd = [
        k for k in done if texts[k].startswith("fix ")
        and (not _USUAL.match(f"{texts[k]} ") or re.search(r"\s(?:wiggle|shear)\s", texts[k]))
    ]  # fmt: skip
    return [*(k for k in later if not is_of_shock(k)), *(k for k in odd if k not in later)]


def _words(case: Case, candidates: Sequence[int], undamped: bool) -> Iterator[Changes]:
    """Yield corrections of words: in all commands that may have them wrong, then in each alone."""
    for command, words, right in _WORDS:
        if words == _UNDAMPED and not undamped:
            continue
        whole: Changes = {}
        for where in (place_at(case.deck, k) for k in candidates):
            text = re.sub(words, right, where.written, count=1)
            if re.match(command, where.written) and text != where.written:
                whole[key_of(where)] = (text,)
        yield whole
        yield from ({key: lines} for key, lines in whole.items())


# ---- Changes of single lines


def _formula(case: Case, _: DeckCheck) -> Iterator[Changes]:
    """Set the clock to 0, or replace the formula of the shock."""
    early = case.deck.commands[: case.deck.first_run]
    for command in [each for each in early if each.text.startswith("reset_timestep")][-1:]:
        yield {key_of(command): ("reset_timestep 0",)}
    lines = shock_commands(case)
    for k in _pushing(case, of_time=True) if lines else ():
        yield {key_of(formula_of(case.deck, place_at(case.deck, k))): tuple(lines or ())[:1]}


def _as_many_steps(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """Shorten the time step, with more steps in each run accordingly."""
    deck, where = case.deck, check.place
    if where is None or check.expected is None or not deck.runs:
        return
    old, new = max(run.dt for run in deck.runs), check.expected
    blamed, kept = key_of(where), _kept(case, where)
    command = check.corrections[0][blamed] if check.corrections else (check.command,)
    runs: Changes = {}
    last = min(deck.end_time, case.start + case.scene.end_time)
    for run in deck.runs:
        where = place_at(deck, run.command)
        words = where.written.split()
        if run.dt == old and len(words) > 1 and words[0] == "run" and words[1].isdigit():
            end = min(run.start + run.steps * old, last)
            steps = max(1, math.ceil((end - run.start) / new * (1 - 1e-12)))
            runs[key_of(where)] = (" ".join([words[0], str(steps), *words[2:]]),)
    yield {blamed: (*command, *runs.pop(blamed, kept)), **runs}


def _kept(case: Case, where: Place) -> tuple[str, ...]:
    """Return the run that is named for a missing command, which it then follows."""
    is_run = is_of(case.deck, where.index, "run")
    return (where.written,) if is_run else ()


# ---- Commands that set a number


def _of_role(case: Case, check: DeckCheck) -> list[int]:
    """All commands of a role."""
    return commands_of(case.deck, check.role)


def _named(_: Case, check: DeckCheck, name: str = "velocity") -> list[int]:
    """The command that is named, if it has this name."""
    place = check.place
    return [place.index] if place is not None and place.written.startswith(name) else []


def _wall(case: Case, check: DeckCheck) -> list[int]:
    """The wall at the far end; the command that is named if the wall meets no granule."""
    wall = far_wall(case.deck)
    return _named(case, check, "fix") if wall is None else [wall.command]


def _pushing(case: Case, of_time: bool) -> list[int]:
    """Fixes that push along the chain, by a force that changes in time or does not."""
    styles = ("gravity", "addforce", "setforce", "aveforce", "efield")
    return [
        fix.command
        for fix in case.deck.fixes
        if not fix.moves and fix.style in styles and not np.all(fix.largest == 0)
        and case.is_of_time(fix.command) == of_time
    ]  # fmt: skip


def _loads(case: Case, _: DeckCheck) -> list[int]:
    return _pushing(case, of_time=False)


def _shocks(case: Case, _: DeckCheck) -> list[int]:
    return _pushing(case, of_time=True) or _pushing(case, of_time=False)


def _movers(case: Case, _: DeckCheck) -> list[int]:
    """Fixes that integrate the motion of granules."""
    return [fix.command for fix in case.deck.fixes if fix.moves and fix.style != "move"]


class _Role(NamedTuple):
    """How a number is corrected that commands of a role set; empty where no command can do that."""

    commands: Callable[[Case], list[str] | None] = lambda _: None  # the scene's
    replaced: Callable[[Case, DeckCheck], list[int]] = lambda *_: []  # commands in their place
    removed: str = ""  # role of commands whose removal is tried
    is_of_forces: bool = False  # whether fixes that exert forces are suspected
    by_line: Callable[[Case, DeckCheck], Iterator[Changes]] = lambda *_: iter(())


_ROLES = {
    "granules": _Role(removed="displaced"),
    "radius": _Role(granule_commands),
    "mass": _Role(granule_commands),
    "place": _Role(place_commands, removed="displaced"),
    "velocity": _Role(velocity_commands, _named, "velocities"),
    "spin": _Role(velocity_commands, _named, "velocities"),
    "contacts": _Role(law_commands, _of_role, "excludes"),
    "wall": _Role(wall_commands, _wall),
    "wall in motion": _Role(wall_commands, _wall, "wall in motion"),
    "neighbours": _Role(removed="neighbours"),
    "constant force": _Role(load_commands, _loads, is_of_forces=True),
    "drag": _Role(is_of_forces=True),
    "random": _Role(removed="random", is_of_forces=True),
    "shock": _Role(shock_commands, _shocks, "", True, _formula),
    "pushed": _Role(shock_commands, _shocks, is_of_forces=True),
    "motion": _Role(motion_commands, _movers, "integrators", True, _formula),
    "piston": _Role(piston_commands, _of_role, "piston", True),
    "timestep": _Role(by_line=_as_many_steps),
    "run": _Role(removed="ends"),
    "image": _Role(),
}


def _acting(case: Case) -> list[int]:
    """Fixes that exert forces other than those of walls."""
    least = ACTS * case.scene.units.force
    return [
        fix.command for fix in case.deck.fixes
        if not fix.moves and not fix.style.startswith("wall")
        and not np.max(np.append(fix.largest, fix.largest_in_motion)) <= least
    ]  # fmt: skip


def _candidates(case: Case, check: DeckCheck) -> list[int]:
    """Commands without which a number may be right, the most likely first."""
    deck, role = case.deck, _ROLES[check.role]
    blamed = [check.place.index] if check.place is not None and check.is_sure else []
    of_role = commands_of(deck, role.removed) if role.removed else []
    of_role = [] if check.role == "motion" and len(of_role) == 1 else of_role
    acting = _acting(case)
    forces: list[int] = []
    if role.is_of_forces:
        shocks = [k for k in acting if case.is_of_time(k)]
        kept = shocks if check.role == "motion" or len(shocks) == 1 else []
        forces = [*suspects(deck), *(k for k in reversed(acting) if k not in kept)]
    each = dict.fromkeys((*blamed, *forces, *reversed(of_role)))
    return [k for k in each if not is_of(deck, k, "needed")]


_MOST_REMOVALS = 6  # commands whose removal is tried for one check (chosen)


def with_trials(case: Case, check: DeckCheck) -> DeckCheck:
    """Return a failed check with the trials that may make it pass, without repetitions."""
    distinct: list[Changes] = []
    for edits in () if check.passed else trials(case, check):
        changes = any(lines != (where[2],) for where, lines in edits.items())
        if changes and edits not in distinct:
            distinct.append(edits)
    return replace(check, command="", corrections=tuple(distinct))


def trials(case: Case, check: DeckCheck) -> Iterator[Changes]:
    """Yield trials for a check: the right number or command, single ones, the scene's commands."""
    where, candidates = check.place, _candidates(case, check)
    role = _ROLES[check.role]
    lines, old = role.commands(case), role.replaced(case, check)
    shocks = _pushing(case, of_time=True) if check.role == "shock" else []
    yield from (_without(case, [k]) for k in reversed(shocks) if len(shocks) > 1)
    yield from check.corrections[:_MOST_REMOVALS]
    if where is not None and check.command:
        yield {key_of(where): (check.command, *_kept(case, where))}
    roles = ("contacts", "wall") if check.kind == "damping" else (check.role,)
    of_role = [k for name in roles for k in reversed(commands_of(case.deck, name))]
    removed = [k for k in candidates[:_MOST_REMOVALS] if not lines or [k] != old]
    undamped = check.kind == "damping" and case.scene.contact is None
    singles = [
        *_words(case, [*dict.fromkeys((*candidates, *of_role))], undamped),
        *(_without(case, [k]) for k in removed),
    ]
    is_formula = where is not None and where.written.startswith("variable")
    by_line = [*role.by_line(case, check)]
    first, then = (
        (by_line, singles) if is_formula and len(_acting(case)) < 2 else (singles, by_line)
    )
    yield from (*first, *then)
    if lines is not None:
        yield from _whole(case, lines, old)


# ---- Proofs

_NOT_ALL = (
    "not all corrections were tried in the time for that, sixteen readings of the deck or 8 s:"
    " correct what is shown, and examine the deck again"
)

Try = Callable[[Edits, float], DeckExamination]
Proof = tuple[Edits, DeckExamination]


@dataclass
class Prover:
    """Tries edits of a deck and keeps the results."""

    first: DeckExamination
    attempt: Try
    seconds: float  # time of the first examination
    cut_short: bool = False  # whether the time was over before all were tried
    # By kind of check, the first changes that make it right, and something else wrong.
    causes: dict[str, Changes] = field(default_factory=dict)
    _tried: dict[object, DeckExamination | None] = field(default_factory=dict)
    _begun: float = field(default_factory=time.monotonic)

    @property
    def left(self) -> float:
        """Time for further proofs [s]."""
        # For all proofs: readings of the deck, or seconds (chosen)
        return max(16.0 * self.seconds, 8.0) - (time.monotonic() - self._begun)

    def examined(self, edits: Edits) -> DeckExamination | None:
        """Return the examination of the deck with edits; None if LAMMPS stops, or time is over."""
        if not edits:
            return self.first
        key = frozenset(edits.items())
        if key not in self._tried:
            if self.left <= 0:
                self.cut_short = True
                return None
            try:
                self._tried[key] = self.attempt(edits, self.left)
            except RunFailed:  # LAMMPS stops with an error, or takes too long
                self._tried[key] = None
        return self._tried[key]

    def proof(
        self, base: Edits, before: DeckExamination, checks: Sequence[DeckCheck], peaks: bool = True
    ) -> Proof | None:
        """Return edits by which some checks pass, if nothing else fails and no peak is worse."""
        kinds = kinds_of(checks)
        for changes in (changes for check in checks for changes in check.corrections):
            whole = combined(base, changes)
            after = None if whole is None else self.examined(whole)
            if whole is None or after is None:
                continue
            left = [failed for failed in after.to_correct if failed.kind in kinds]
            if not left and is_no_worse(before, after, peaks):
                return whole, after
            if not left and not after.contents.stopped:
                for kind in kinds:
                    self.causes.setdefault(kind, changes)
            if 0 < len(left) < len(checks):  # others on that line
                proof = self.proof(whole, before, left, peaks)
                if proof is not None:
                    return proof
        return None


class Step(NamedTuple):
    """One of the corrections in succession."""

    checks: Sequence[DeckCheck]  # that it makes right
    edits: Edits  # that it adds
    after: DeckExamination


def kinds_of(checks: Iterable[DeckCheck]) -> set[str]:
    """The kinds of some checks."""
    return {check.kind for check in checks}


def with_findings(prover: Prover) -> DeckExamination:
    """Return the first examination with findings by command, and proven corrections."""
    first, (whole, steps) = prover.first, _together(prover)
    at_first, groups = kinds_of(first.to_correct), by_command(first.to_correct)
    of_steps: list[tuple[int, Step]] = []  # with the finding that each corrects
    for step in steps:
        if not kinds_of(step.checks) & at_first and step.checks[0].role == "motion":
            groups.append(list(step.checks))  # something else acts, too
        # Another check that fails only then belongs to the same number, such as the stiffness of
        # the wall.
        owned = (k for k, checks in enumerate(groups) if kinds_of(checks) & kinds_of(step.checks))
        of_steps.append((next(owned, of_steps[-1][0] if of_steps else 0), step))
    later = [check for checks in groups for check in checks if check.kind not in at_first]
    findings: list[Finding] = []
    causes: list[int] = []  # of each finding, itself or another one whose correction makes it right
    for k, checks in enumerate(groups):
        edits = {at: lines for owner, step in of_steps if owner == k
                 for at, lines in step.edits.items()}  # fmt: skip
        cause = next((owner for owner, step in of_steps if not edits
                      and not kinds_of(checks) & kinds_of(step.after.to_correct)), k)  # fmt: skip
        after = prover.examined(edits)
        alone = (after is not None and is_no_worse(first, after)
                 and not kinds_of(checks) & kinds_of(after.to_correct))  # fmt: skip
        lines = first.corrections_of(edits)
        blamed = tuple(_blamed(prover, check, lines) for check in checks)
        findings.append(Finding(blamed, lines, with_others=bool(edits) and not alone))
        causes.append(cause)
    # Findings that follow from another one are listed after it.
    order = sorted(range(len(groups)), key=lambda k: (causes[k], causes[k] != k))
    right = {
        id(check): blamed
        for checks, finding in zip(groups, findings, strict=True)
        for check, blamed in zip(checks, finding.checks, strict=True)
    }
    shown = (*first.checks[:-1], *later, first.checks[-1])
    return replace(
        first, checks=tuple(right.get(id(check), check) for check in shown), edits=whole,
        findings=tuple(
            replace(findings[k], follows=None if causes[k] == k else order.index(causes[k]))
            for k in order
        ),
        remarks=(*first.remarks, *[_NOT_ALL] * prover.cut_short),
    )  # fmt: skip


def _blamed(prover: Prover, check: DeckCheck, lines: Sequence[Correction]) -> DeckCheck:
    """Return a check with its correction, at the line that a trial has shown to be the cause."""
    at, commands = check.place, prover.first.contents.commands

    def place_of(key: tuple[str, int, str]) -> Place | None:
        index = next((k for k, command in enumerate(commands) if key_of(command) == key), None)
        return at if index is None else place_at(prover.first.contents, index)

    fitting = next((line for line in lines if at and (line.file, line.line) == (at.file, at.line)),
                   None)  # fmt: skip
    changed = [line for line in lines if line.written not in line.commands]
    if fitting is None and changed:
        fitting = changed[0]
        at = place_of((fitting.file, fitting.line, fitting.written))
    if fitting is not None:
        return replace(check, command="\n".join(fitting.commands), place=at)
    changes = prover.causes.get(check.kind, {})
    gone = next((key for key, new in changes.items() if key[2] not in new), None)
    if gone is not None:
        return replace(check, place=place_of(gone))
    return check if check.is_sure else replace(check, place=None)


def is_no_worse(before: DeckExamination, after: DeckExamination, peaks: bool = True) -> bool:
    """Whether all checks that passed before still pass, and no peak is worse."""
    if after.contents.stopped and not before.contents.stopped:
        return False
    passed = {check.kind for check in before.checks if check.passed}
    passed -= {check.kind for check in before.to_correct}
    if any(check.kind in passed for check in after.to_correct):
        return False
    if not peaks or before.contents.stopped:
        return True
    count = min(before.judged.size, after.judged.size)
    both = before.judged[:count] & after.judged[:count]
    was, now = (examination.error_of_peaks(both) for examination in (before, after))
    # Readings are at other times, and the error of the steps changes with any number (chosen).
    return bool(now <= was * (1 + 1e-2) + 1e-5)


def _together(prover: Prover) -> tuple[Edits, list[Step]]:
    """Combine corrections in succession until none helps; return what each of them adds."""
    edits: Edits = {}
    done, steps = prover.first, list[Step]()
    for peaks in (True, False):  # errors that make up for one another: only all of them help
        tried, state, new_steps, stuck = edits, done, list[Step](), set[str]()
        # Most corrections in succession (chosen)
        while len(new_steps) < 30:
            groups = (g for g in by_command(state.to_correct) if not kinds_of(g) & stuck)
            checks = next(groups, None)
            if checks is None:
                break
            proof = prover.proof(tried, state, checks, peaks)
            if proof is None:
                stuck |= kinds_of(checks)
                continue
            added = {at: lines for at, lines in proof[0].items() if tried.get(at) != lines}
            tried, state = proof
            new_steps.append(Step(checks, added, state))
        if peaks or is_no_worse(done, state):
            edits, done = tried, state
            steps += new_steps
        if done.passed:
            break
    return edits, steps


def combined(base: Edits, changes: Changes) -> Edits | None:
    """Return edits with further changes; None if a command that these change is gone."""
    whole = dict(base)
    for (file, line, written), lines in changes.items():
        commands = whole.get((file, line), (written,))
        if written not in commands:
            return None
        k = commands.index(written)
        whole[file, line] = (*commands[:k], *lines, *commands[k + 1 :])
    return whole
