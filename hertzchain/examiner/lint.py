"""A deck in the form for the rules of lint: its commands in order, and what LAMMPS finds in it.

The commands are those that LAMMPS has carried out, with the values of variables. If LAMMPS did not
run, or has stopped, the rest is the text as written.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from hertzchain.engines.lammps import dialect
from hertzchain.engines.lammps.dialect import BEFORE_ROOT_2, DEFAULT_SKIN, NUMBERS_OF
from hertzchain.engines.lammps.reading.text import (
    closed,
    in_ascii,
    lines_of,
    number,
    without_comment,
    words_of,
)
from hertzchain.errors import HertzchainError, TooExpensive
from hertzchain.files import read_bytes

if TYPE_CHECKING:
    from hertzchain.arrays import FloatArray
    from hertzchain.engines.lammps.reading.deck import Executed
    from hertzchain.engines.lammps.reading.probing import Granules
    from hertzchain.engines.lammps.reading.reading import Look
    from hertzchain.engines.lammps.reading.watching import Applied


@dataclass(frozen=True)
class Command:
    """One command."""

    place: int  # its number among the commands
    line: int  # line of the deck, from 1, with it or with the ``include`` of its file
    inside: str  # where it stands in an included file, as ``name:line``; else empty
    words: tuple[str, ...]  # name and arguments, with values where they are known
    raw: tuple[str, ...]  # the same as written
    index: int | None = None  # among those that LAMMPS carried out; None for text

    @property
    def name(self) -> str:
        """Its first word."""
        return self.words[0]

    def word(self, k: int) -> str:
        """Its k-th word; empty if it has fewer."""
        return self.words[k] if k < len(self.words) else ""

    def after(self, keyword: str) -> str | None:
        """The word that follows a keyword among the arguments, if any."""
        return next((b for a, b in pairwise(self.words[1:]) if a == keyword), None)


def script_of(
    path: Path,
    text: str,
    carried_out: Sequence[Executed] = (),
    stopped: bool = True,
) -> list[Command]:
    """The commands of a deck: those carried out, and the text behind them if LAMMPS stopped."""
    commands: list[Command] = []
    line = 0
    for index, done in enumerate(carried_out):
        in_deck = Path(done.file) == path
        line = done.line if in_deck else line
        inside = "" if in_deck else f"{Path(done.file).name}:{done.line}"
        words = _split(done.text)
        raw = _split(done.written)
        raw = raw if raw[:1] == words[:1] else words  # of an if, or run every
        if words:
            commands.append(Command(len(commands), line, inside, words, raw, index))
    if stopped:
        for written_line in lines_of(in_ascii(text)):
            words = _split(without_comment(written_line.text))
            if words and written_line.number > line:
                commands.append(Command(len(commands), written_line.number, "", words, words))
    return commands


def _split(text: str) -> tuple[str, ...]:
    return tuple(word.value for word in words_of(_closed_up(text)))


def _closed_up(line: str) -> str:
    """Return a line without blanks in ``$(...)``, which LAMMPS evaluates before it splits words."""
    text, k = "", 0
    while (start := line.find("$(", k)) >= 0:
        end = closed(line, start + 1)
        if end is None:
            break
        text += line[k:start] + "".join(line[start:end].split())
        k = end
    return text + line[k:]


# ---- A deck

Severity = Literal["error", "warning", "note"]


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or worth knowing, in a deck."""

    line: int  # from 1
    rule: str
    severity: Severity  # wrong or stops; likely not intended; costs time, or is worth knowing
    text: str  # what is wrong, and what to write instead


Found = Iterator[tuple[Command | None, Severity, str]]  # command (None: line 1), severity, sentence

_NO_CHAIN = (
    ("fix", "(pour|deposit|insert)(/.*)?", "granules are poured"),
    ("fix", "rigid.*|multisphere.*|poems", "granules are rigid bodies of several spheres"),
    ("bond_style", "(?!none).+", "granules are bonded"),
    ("atom_style", "bpm/.*|bond|molecular|full", "granules are bonded"),
    ("atom_style", "(?!sphere|granular|hybrid|.*[$]).+", "its atoms are not spheres"),
    ("fix", "wall/gran/region|mesh/.*|wall/region", "granules lie in a vessel"),
    ("fix", "freeze", "granules are frozen"),
    ("dimension", "2", "it is two-dimensional"),
)
"""Signs of a deck that is not a chain, unless its granules are known to lie in one row: a command,
its style, and words for it."""

_OF_LIGGGHTS = re.compile("(property/global|particletemplate/|particledistribution/|mesh/).*")
"""Fixes that only LIGGGHTS has."""


CLASSIC = "gran/hooke", "gran/hooke/history", "gran/hertz/history"
"""The pair styles of granules whose numbers are Kn, Kt, gamma_n, gamma_t, friction, 0 or 1."""


@dataclass(frozen=True)
class Law:
    """A contact law as a deck states it."""

    command: Command
    normal: str  # its normal model
    numbers: tuple[str, ...]

    @property
    def damping(self) -> float | None:
        """The second number; None if it is not known."""
        return number(self.numbers[1])


class Deck:
    """The commands of a deck, and what LAMMPS finds in it (None if LAMMPS did not read it)."""

    def __init__(self, commands: Sequence[Command], look: Look | None = None) -> None:
        self.commands, self.look = commands, look

    def named(self, *names: str) -> list[Command]:
        """The commands of these names."""
        return [command for command in self.commands if command.name in names]

    def last(self, *names: str) -> Command | None:
        """The last command of these names that has a word."""
        return next((c for c in reversed(self.named(*names)) if c.word(1)), None)

    def fixes(self, *styles: str) -> list[Command]:
        """The fixes of these styles, or all."""
        fixes = [fix for fix in self.named("fix") if len(fix.words) > 3]
        return [fix for fix in fixes if not styles or fix.words[3] in styles]

    @cached_property
    def unread(self) -> list[Command]:
        """Commands that read files which lint has not read."""
        last = None if self.look is None or not self.look.stopped else len(self.look.commands) - 1
        readers = [c for c in self.named("include") if c.index is None or c.index == last]
        if self.look is None or self.look.stopped:
            readers += [jump for jump in self.named("jump") if jump.word(1) != "SELF"]
        return [*readers, *self.named("read_restart")]

    @cached_property
    def is_partial(self) -> bool:
        """Whether parts of the deck are elsewhere: unknown files, restarts, programs."""
        return bool(self.unread or self.named("python", "plugin"))

    @cached_property
    def units(self) -> str:
        """The units that it uses."""
        last = self.last("units")
        return "lj" if last is None else last.words[1]

    @cached_property
    def pair_style(self) -> Command | None:
        """The last pair style."""
        return self.last("pair_style")

    @cached_property
    def contact_style(self) -> tuple[str, ...]:
        """LAMMPS's pair style of granules and its numbers, also of a hybrid one; else empty."""
        words = () if self.pair_style is None else self.pair_style.words
        for k, word in enumerate(words):
            if word.split("/")[0] in ("granular", "gran"):
                return (re.sub("/(omp|kk.*)", "", word), *words[k + 1 :])
        return ()

    @cached_property
    def is_of_liggghts(self) -> bool:
        """Whether the deck is one of LIGGGHTS, which is like LAMMPS except for the contact laws."""
        return bool(
            self.named("hard_particles", "coarsegraining")
            or any(style.word(1) == "gran" for style in self.named("pair_style"))
            or any(_OF_LIGGGHTS.match(fix.word(3)) for fix in self.fixes())
        )

    @cached_property
    def laws(self) -> list[Law]:
        """The contact laws between granules, and those of granular walls."""
        laws: list[Law] = []
        style = self.contact_style
        if style[:1] and style[0] in CLASSIC and len(style) > 3 and self.pair_style is not None:
            laws.append(Law(self.pair_style, style[0], (style[1], style[3])))
        elif style:
            for command in self.named("pair_coeff"):
                rest = command.words[3:]
                laws += _law(command, rest[1:] if rest[:1] == ("granular",) else rest)
        walls = [w for w in self.fixes("wall/gran", "wall/gran/region") if w.word(4) == "granular"]
        return [*laws, *(law for wall in walls for law in _law(wall, wall.words[5:]))]

    def given(self, attribute: str) -> list[tuple[Command, str]]:
        """The ``set`` commands that give an attribute, and what they give."""
        each = ((command, command.after(attribute)) for command in self.named("set"))
        return [(command, value) for command, value in each if value is not None]

    @cached_property
    def runs(self) -> list[Command]:
        """The runs that take steps, or may."""
        return [
            command
            for command in self.named("run", "minimize", "rerun")
            if command.name != "run" or number(command.word(1)) != 0
        ]

    @cached_property
    def may_run(self) -> bool:
        """Whether the deck takes steps, or may: in files or conditions that are not known."""
        is_known = self.look is not None and not self.look.stopped
        unknown = [] if is_known else self.named("if", "include", "jump")
        return bool(self.runs or unknown or self.is_partial)

    @cached_property
    def granules(self) -> Granules | None:
        """The granules of a chain before the first run."""
        granules = None if self.look is None else self.look.granules
        is_row = granules is not None and granules.count > 1 and granules.is_chain
        return granules if is_row else None

    @cached_property
    def applied(self) -> Applied | None:
        """The forces of fixes during its runs; None where they are not known."""
        applied = None if self.look is None else self.look.applied
        return applied if applied is not None and applied.time.size else None

    @cached_property
    def pushes(self) -> dict[int, FloatArray]:
        """Largest force of each ``fix addforce``, (granules, 2): along and across, by command."""
        fixes = () if self.applied is None else self.applied.fixes
        return {fix.command: fix.largest for fix in fixes if fix.style == "addforce"}

    @cached_property
    def is_damped(self) -> bool:
        """Whether damping changes forces by more than round-off, as in ``examine``; or may."""
        probes = None if self.look is None else self.look.probes
        return probes is None or probes.is_damped

    @cached_property
    def no_chain(self) -> tuple[Command | None, str] | None:
        """Why it is no chain, and the command that shows it; None if it may be one."""
        if self.granules is not None:
            return None
        for command, (name, style, what) in itertools.product(self.commands, _NO_CHAIN):
            word = command.word(3 if name == "fix" else 1)
            if command.name == name and re.fullmatch(style, word):
                return command, what
        atoms = None if self.look is None else self.look.granules
        if atoms is None:
            return None
        rows = f"its {atoms.count} granules do not lie in one row"
        maker = next(iter(self.named("create_atoms", "read_data")), None)
        return maker, rows if atoms.count > 1 else "it has one granule"


def _law(command: Command, words: tuple[str, ...]) -> list[Law]:
    count = NUMBERS_OF.get(" ".join(words[:1]))
    if count is None or len(words) <= count:
        return []
    return [Law(command, words[0], words[1 : 1 + count])]


_HERTZ = f"pair_coeff * * {dialect.hertz('E', 'nu')} {dialect.NO_FRICTION}"

_HOOKE = (
    "{law} is a linear spring, not Hertz's law: there are no solitary waves in it (with a stiffness"
    " of 1e7 N/m the tenth peak is 88 instead of 158 N); take hertz/material, or gran/hertz/history"
)

_ZERO = r"[+-]?0*\.?0*(?:e\S*)?"
_FIX, _LAW = r"\S+ \S+ ", r"\S+ \S+ (?:granular )?"


@dataclass(frozen=True)
class Trap:
    """A trap in one command."""

    rule: str  # name of the finding
    severity: Severity
    command: str  # name of the command
    pattern: str  # of the beginning of its words, joined by single blanks
    sentence: str  # ``{names}`` stand for the groups of the pattern

    def found_in(self, deck: Deck) -> Found:
        """The commands of a deck with this trap."""
        for command in deck.named(self.command):
            match = re.match(self.pattern, f"{' '.join(command.words[1:])} ")
            if match is not None:
                yield command, self.severity, self.sentence.format(**match.groupdict())


TRAPS = (
    Trap("thermostat", "error", "fix",
         _FIX + r"(?P<style>(?:nvt|npt|nph|langevin|temp/|nve/limit|press/)\S*)",
         "fix {style} changes velocities by something else than forces, and the wave with them: fix"
         " nve is all that a chain needs"),
    Trap("random-velocities", "error", "velocity", r"(?P<group>\S+) create (?P<kelvin>\S+)",
         "granules of group {group} start with random velocities of temperature {kelvin}, in all"
         " directions: a chain starts at rest (leave the command out), a striker with velocity"
         " first set V 0 0 units box"),
    Trap("force-in-steps", "error", "fix",
         _FIX + r"addforce \S+ \S+ \S+ (?:.* )?every (?P<count>[2-9]|\d\d+)(?: |$)",
         "with every {count} the force is there at one of {count} steps only: the granule gets"
         " 1/{count} of the momentum; leave the words out"),
    Trap("not-hertz", "error", "pair_style", r"(?:hybrid\S* .*)?(?P<law>gran/hooke\S*)", _HOOKE),
    Trap("not-hertz", "error", "pair_coeff", _LAW + r"(?P<law>hooke) ", _HOOKE),
    Trap("not-hertz", "warning", "pair_coeff",
         _LAW + rf"(?P<law>jkr|dmt) \S+ \S+ \S+ (?!{_ZERO} )(?P<cohesion>\S+) ",
         "{law} adds cohesion to Hertz's law ({cohesion}; 0.1 J/m^2 moved peaks of about 150 N by"
         " 0.1 %): hertz/material has none"),
    Trap("not-hertz", "warning", "pair_coeff", _LAW + "mdr ",
         "mdr is an elastic-plastic law, not Hertz's: hertz/material is elastic"),
    Trap("tangential", "warning", "pair_style",
         rf"(?:hybrid\S* .*)?gran/h(?:ooke|ertz)/history\S* \S+ {_ZERO} ",
         "Kt = 0: where granules slide LAMMPS divides by it; write NULL (2/7 of Kn) and a friction"
         " of 0.0 as the fifth number, which takes the tangential force away"),
    Trap("wall", "error", "fix",
         _FIX + rf"wall/gran\S* (?P<law>hertz|hooke)/history \S+ \S+ {_ZERO} ",
         "wall/gran {law}/history with gamma_n = 0 makes positions NaN at the first touch"
         f" ({dialect.WALL_IS_NAN}): write wall/gran granular hertz K 0.0 {dialect.NO_FRICTION}"
         " with K = 4/3 E*"),
    Trap("wall", "warning", "fix", _FIX + r"wall/gran\S* granular hertz/material ",
         "this wall is an elastic half-space of its material, not a rigid wall, and LAMMPS of 2021"
         " and 2022 makes it 1 + nu times too stiff: give the stiffness itself, granular hertz K"
         " with K = 4/3 E*"),
)  # fmt: skip


def not_hertz(deck: Deck) -> Found:
    """Pair styles that are not for granules."""
    style = deck.pair_style
    if style is None:
        if deck.runs and not deck.is_partial:
            text = (
                "there is no pair style: granules do not feel one another; write pair_style"
                f" granular and {_HERTZ}"
            )
            yield deck.runs[0], "error", text
    elif not deck.contact_style and "$" not in style.word(1):
        text = (
            f"pair_style {style.word(1)} is not a contact of spheres: Hertz's law is pair_style"
            f" granular with {_HERTZ}"
        )
        yield style, "error", text


# ---- Damping

_UNDAMPED = "leave the damping out and give 0.0 there, which damps nothing"


def damping(deck: Deck) -> Found:
    """Hertz's law itself has no damping."""
    for law in deck.laws:
        kind, value = law.command.after("damping"), law.damping
        if law.normal == "mdr" or value is None:
            continue
        number_of = f"the second number of {law.normal}"
        if kind in ("tsuji", "coeff_restitution") and value == 0:
            what = "the tenth peak loses 73 %" if kind == "tsuji" else "positions become NaN"
            text = (
                f"with damping {kind} {number_of} is a coefficient of restitution: 0 damps the most"
                f" ({what}), it does not switch damping off; {_UNDAMPED}"
            )
            yield law.command, "error", text
        elif kind == "tsuji":
            text = (
                f"damping tsuji with {value:g} gives another restitution than that, and another in"
                f" LAMMPS {BEFORE_ROOT_2} than in later ones (1 lowers peaks by up to 0.2 %):"
                f" coeff_restitution gives its number since 29 Aug 2024; without any, {_UNDAMPED}"
            )
            yield law.command, "warning", text
        elif value != 0 and deck.is_damped and (kind, value) != ("coeff_restitution", 1):
            what = "gamma_n" if law.normal in CLASSIC else number_of
            text = (
                f"{what}, {law.numbers[1]}, damps the contacts: energy is lost, and peaks are lower"
                " than those of Hertz's law; 0.0 damps nothing"
            )
            yield law.command, "note", text


def attraction(deck: Deck) -> Found:
    """Without a limit, damping pulls as a contact opens."""
    text = (
        "damping without limit_damping makes contacts pull as they open, which dry granules cannot:"
        " write limit_damping at the end of this command (LAMMPS since 29 Sep 2021)"
    )
    for law in deck.laws:
        takes_damping = law.normal in ("hooke", "hertz", "hertz/material", *CLASSIC)
        damps = law.damping and deck.is_damped
        if takes_damping and damps and not {"none", "limit_damping"} & set(law.command.words):
            yield law.command, "warning", text


def poisson_ratio(deck: Deck) -> Found:
    """The order of the numbers is E, damping, Poisson's ratio."""
    for law in deck.laws:
        damping, poisson = law.damping, number(law.numbers[-1])
        if law.normal != "hertz/material" or poisson is None or damping is None:
            continue
        impossible = not -1 < poisson <= 0.5
        # A Poisson's ratio that no material of granules has (chosen)
        if impossible or (abs(poisson) < 1e-2 and 0 < damping <= 0.5):
            text = (
                f"the numbers of {law.normal} are E, damping, Poisson's ratio, in this order: here"
                f" the ratio is {poisson:g} and the damping {damping:g}"
            )
            yield law.command, "error" if impossible else "warning", text


# ---- Granules

_DENSITY = (
    "the density is set before the diameter, so that granules keep the mass that the old diameter"
    " made (1e6 times too large for a radius of 5 mm, and only the first one moves): set the"
    " diameter first, then the density"
)


def density_before_diameter(deck: Deck) -> Found:
    """The mass is made when the density is set, with the diameter of that moment."""
    last = max((command.place for command, _ in deck.given("density")), default=-1)
    first = min((command.place for command, _ in deck.given("diameter")), default=-1)
    pending: Command | None = None
    for command in deck.named("set"):
        words = command.words
        if "density" in words:
            both = "diameter" in words[words.index("density") :]
            if both:
                yield command, "error", _DENSITY
            pending = None if both or "diameter" in words else command
        elif "diameter" in words and pending is not None:
            covers = pending.words[1:3] == words[1:3] or "all" in (words[2], pending.words[2])
            if covers and last < command.place:
                if first < pending.place:
                    yield command, "warning", _DENSITY
                else:
                    yield pending, "error", _DENSITY
            pending = None


def diameter_missing(deck: Deck) -> Found:
    """Granules of ``create_atoms`` have diameter 1 and density 1 unless the deck sets them."""
    created = deck.named("create_atoms")
    brought = deck.named("read_data", "molecule") or deck.is_partial
    given = {word for command in deck.named("set") for word in command.words}
    lacks = "diameter" if "diameter" not in given else "density"
    if not created or brought or not deck.contact_style:
        return
    if not {"density", "mass"} & given or lacks == "diameter":
        text = (
            f"no {lacks} is set: granules that are created have diameter 1 and the mass 0.5236 of"
            " density 1, in the units of the deck; write set group all diameter ..., then set group"
            " all density ..."
        )
        yield created[0], "error", text


def unusual_density(deck: Deck) -> Found:
    """Densities that may have a wrong unit, by the usual range of scenes, which are in SI."""
    given = [(command, number(value)) for command, value in deck.given("density")]
    if deck.units != "si" or not given:
        return
    from hertzchain.scene.scene import unusual

    for command, density in given:
        remark = unusual("chain.density", density)
        # Granules of a larger density [kg/m^3] are heavy to stay in place (chosen)
        if remark and density is not None and density < 1e15:
            yield command, "note", f"perhaps a wrong unit: {remark.removeprefix('chain.')}"


def ghost_velocity(deck: Deck) -> Found:
    """Contact laws of granules need the velocities of ghosts."""
    wanted = any(command.after("vel") == "yes" for command in deck.named("comm_modify"))
    if deck.contact_style and not wanted and not deck.is_partial:
        text = (
            "comm_modify vel yes is missing: pair styles of granules need the velocities of ghost"
            " granules, and LAMMPS stops at the first run; write it before the pair style"
        )
        yield deck.pair_style, "error", text


def periodic(deck: Deck) -> Found:
    """Images of a chain that meet it, or are ghosts that cost time."""
    granules, neighbor = deck.granules, deck.last("neighbor")
    # Distance beyond a contact within which neighbours are listed.
    skin = DEFAULT_SKIN.get(deck.units) if neighbor is None else number(neighbor.words[1])
    if granules is None or skin is None:
        return
    boxes = [c for c in deck.named("change_box") if "boundary" in c.words]
    makers = [*boxes[::-1], *deck.named("boundary")[::-1], *deck.named("create_box", "read_data")]
    where = next(iter(makers), None)
    room = 2 * (2 * float(granules.radius.max()) + skin)
    box, place = granules.high - granules.low, granules.position
    is_flat = any(command.word(1) == "2" for command in deck.named("dimension"))
    for k, (axis, side) in enumerate(zip(granules.axes, granules.boundary, strict=True)):
        name = "xyz"[axis]
        narrow = box[k] <= place[:, k].max() - place[:, k].min() + room
        wanted = is_flat and name == "z"  # by LAMMPS, in two dimensions
        if side == "p" and narrow and not wanted:
            what = (
                "every granule has images as ghosts, and a step takes twice as long" if k
                else "the chain has no free ends, the last granule meets the first"
            )  # fmt: skip
            text = (
                f"{name} is periodic, as all sides are by default, and the box is narrow: {what};"
                " write boundary f f f with room around the chain"
            )
            yield where, "warning", text


def not_touching(deck: Deck) -> Found:
    """Granules of a chain touch without force, unless gaps and loads are intended."""
    granules = deck.granules
    makers = deck.named("lattice", "create_atoms", "read_data", "displace_atoms")
    if granules is None or not deck.contact_style or not makers:
        return
    gap = (granules.position[1:, 0] - granules.position[:-1, 0]) / granules.reach - 1
    rounding = 1e-9  # relative, of a coordinate (chosen)
    # Forces that never change press the chain: gravity, or static loads.
    is_loaded = deck.applied is not None and bool(deck.applied.constant.any())
    is_meant = deck.fixes("gravity") or is_loaded or granules.velocity.any()
    text = "neighbours are {:.10g} times the sum of their radii apart: granules {}"
    if gap.max() > rounding:
        what = "do not touch (with gaps of 1e-3 peaks are off by 113 %)"
        yield makers[0], "warning", text.format(1 + gap.max(), what)
    if gap.min() < -rounding and not is_meant:
        what = "press one another from the start, and spring apart if nothing holds the ends"
        yield makers[0], "warning", text.format(1 + gap.min(), what)


# ---- What moves them

_MOVER = re.compile(r"(nve|nvt|npt|nph|rigid|move$|brownian|ehex|controller|python|freeze)")


def motion(deck: Deck) -> Found:
    """Exactly one fix has to move each granule."""
    movers = [fix for fix in deck.fixes() if _MOVER.match(fix.words[3])]
    is_whole = deck.pair_style is not None and not deck.is_partial
    if deck.runs and not movers and is_whole:
        text = "no fix moves the granules, nothing happens: write fix motion all nve"
        yield deck.runs[0], "error", text
    gone = {command.word(1): command.place for command in deck.named("unfix")}
    seen: dict[str, Command] = {}
    for fix in movers:
        other = seen.get(fix.words[2], fix)
        is_gone = other.place < gone.get(other.word(1), -1) < fix.place
        if other.word(1) != fix.word(1) and not is_gone:
            text = (
                f"granules of group {fix.words[2]} are moved twice each step, here and by fix"
                f" {other.word(1)} (peaks off by 20 %): keep one"
            )
            yield fix, "error", text
        seen[fix.words[2]] = fix


def lattice_units(deck: Deck) -> Found:
    """Velocities are in lattice spacings per unit of time, without ``units box`` or ``v_name``."""
    spacing: Command | None = None
    for command in deck.named("lattice", "velocity", "fix"):
        if command.name == "lattice":
            spacing = command
            continue
        given = {"set": command.words[3:6], "ramp": command.words[4:6]}.get(command.word(2), ())
        if command.name == "fix":
            given = command.words[5:8] if command.words[3:5] == ("move", "linear") else ()
        is_scaled = any(number(word) for word in given) and command.after("units") != "box"
        if is_scaled and spacing is not None and number(spacing.word(2)) != 1:
            text = (
                "without units box LAMMPS multiplies these velocities by the spacing of"
                f" {' '.join(spacing.words[:3])}: write units box at the end"
            )
            yield command, "warning", text


def force_frozen(deck: Deck) -> Found:
    """A formula that is evaluated only once is a constant."""
    formulas = {c.word(1): " ".join(c.words[3:]) for c in deck.named("variable")}
    for fix in deck.fixes("addforce", "setforce"):
        for word in fix.raw[4:7]:
            match = re.fullmatch(r"\$\{(\w+)\}|\$\(\s*v_(\w+)\s*(?::[^)]*)?\)", word)
            name = match and (match[1] or match[2])
            if name and re.search(r"\b(step|time|elapsed|elaplong)\b", formulas.get(name, "")):
                text = (
                    f"{word} is filled in once, when the line is read: the force stays at the"
                    f" value of that moment; write v_{name}, which follows the time"
                )
                yield fix, "error", text


def force_on_all(deck: Deck) -> Found:
    """A shock hits one end; an atom-style variable gives each granule a force of its own."""
    each = {
        f"v_{command.word(1)}" for command in deck.named("variable") if command.word(2) == "atom"
    }
    for fix in deck.fixes("addforce"):
        if each & {*fix.words[4:7]}:
            continue
        largest = None if fix.index is None else deck.pushes.get(fix.index)
        zero = all(number(word) == 0 or word == "NULL" for word in fix.words[4:7])
        many = "every granule" if fix.word(2) == "all" and not zero else None
        if largest is not None:
            count = int((largest.max(axis=1) > 0).sum())
            many = f"the {count} granules of group {fix.word(2)}" if count > 1 else None
        if many:
            text = (
                f"the force acts on {many}, on each in full: group first id 1, and fix"
                f" {fix.word(1)} first addforce, push one end"
            )
            yield fix, "warning", text


# ---- Steps


def step_length(deck: Deck) -> Found:
    """Compare the step with the stiffest contacts that the deck itself makes."""
    granules, look = deck.granules, deck.look
    law = None if look is None else look.law
    if granules is None or look is None or law is None:
        return
    if not look.runs or deck.fixes("dt/reset"):
        return
    import numpy as np
    from scipy.linalg import eigvalsh_tridiagonal

    from hertzchain.contact import hertz

    (stiffness, exponent), mass = law, granules.mass
    if not np.all(np.abs(exponent - 1.5) < 0.01) or np.any(mass <= 0):
        return
    pressing = max((push.max() for push in deck.pushes.values()), default=0.0)
    origin = "the largest force of this deck"
    speed = np.abs(np.diff(granules.velocity[:, 0]))
    reduced = mass[1:] * mass[:-1] / (mass[1:] + mass[:-1])
    hits = hertz.impact_force(stiffness, reduced, speed)
    if hits.max() > pressing:
        pressing = hits.max()
        origin = f"that of granules that collide at {speed[hits.argmax()]:g}"
    if not pressing:
        return
    spring = hertz.slope_of(stiffness, pressing)
    both = np.append(spring, 0) + np.append(0, spring)
    squares = eigvalsh_tridiagonal(
        both / mass, -spring / np.sqrt(mass[1:] * mass[:-1]),
        select="i", select_range=(len(mass) - 1, len(mass) - 1),
    )  # fmt: skip
    limit = 2 / math.sqrt(squares[0])
    # In natural units the largest frequency is 2 sqrt(3/2), and the limit 2 over that.
    unit, longest = limit / math.sqrt(2 / 3), max(look.runs, key=lambda run: run.dt)
    run = next((c for c in deck.commands if c.index == longest.command), None)
    steps = [c for c in deck.named("timestep") if run is not None and c.place < run.place]
    step, what = longest.dt / unit, f"contacts pressed by {pressing:.4g}, {origin}"
    text = f"{0.02 * unit:.1g} gives peaks right to about 1e-4"
    if longest.dt > limit:
        text = (
            f"the step {longest.dt:.3g} is above the limit of stability, {limit:.3g} for {what}:"
            f" granules fly apart; {text}"
        )
        yield steps[-1] if steps else run, "error", text
    # Natural time units; peaks are then off by 1 % (chosen)
    elif step > 0.2:
        text = (
            f"the step {longest.dt:.3g} is {step:.2g} of the natural time of {what}: peaks are"
            f" off by about {0.22 * step**2:.1%}, which goes with the square of it; {text}"
        )
        yield steps[-1] if steps else run, "warning", text


CHAIN_RULES = (
    not_hertz, damping, attraction, poisson_ratio, density_before_diameter, diameter_missing,
    unusual_density, ghost_velocity, periodic, not_touching, motion, lattice_units, force_frozen,
    force_on_all, step_length,
)  # fmt: skip


LINT_TIME_LIMIT = 60.0  # for LAMMPS to read a deck [s] (chosen)


_OF_DECKS = "units", "atom_style", "pair_style", "run", "include", "read_restart"


def _no_deck(deck: Deck) -> Found:
    """Text that is no LAMMPS deck."""
    if not deck.named(*_OF_DECKS):
        text = (
            "this does not look like a LAMMPS deck: none of units, atom_style, pair_style, run,"
            " include and read_restart is in it"
        )
        yield None, "error", text


def _no_run(deck: Deck) -> Found:
    """A note on a deck without a run."""
    if deck.named(*_OF_DECKS) and not deck.may_run:
        yield None, "note", "this deck takes no step: it has no run, or only run 0"


def _no_chain(deck: Deck) -> Found:
    """A note on a deck that is not a chain: what it is."""
    if deck.no_chain is not None:
        where, why = deck.no_chain
        yield where, "note", f"this deck is not a chain ({why}): rules for chains are left out"


_REFUSED = re.compile(
    "LAMMPS stopped: ERROR|needs at least|cannot be read|does not exist when"
    "|is not a number of steps"
)
"""Words of the reasons why LAMMPS itself refuses a deck."""


def _text_alone(deck: Deck) -> Found:
    """Errors from where LAMMPS stops: its own message, or a command that does not exist."""
    look = deck.look
    if look is None or not look.stopped:
        return
    where, why = _stop(deck, look)
    lacks = "is part of the" in why  # a package of LAMMPS that is not installed here
    refused = _REFUSED.search(why) and deck.may_run  # others may be fragments
    if refused and not lacks and deck.no_chain is None:
        yield where, "error", why
    elif "is not one of the commands" in why and deck.no_chain is None:
        yield where, "warning", f"{why}; if it is misspelt, LAMMPS stops here"
    else:
        text = f"LAMMPS read a part of the deck, the rest was read as text: {why}"
        yield where, "note", text


def _stop(deck: Deck, look: Look) -> tuple[Command | None, str]:
    """The command of the deck at which LAMMPS stops, and why; a place in another file is named."""
    commands = [command for command in deck.commands if not command.inside]
    place = re.match(r"(.*?):(\d+): ", look.stopped)
    if place and (not look.commands or place[1] == look.commands[0].file):
        at, why = [c for c in commands if c.line == int(place[2])], look.stopped[place.end() :]
    else:
        at, why = [c for c in commands if c.index is not None], look.stopped
    return (at[-1] if at else None), why


def _elsewhere(deck: Deck) -> Found:
    """Parts of a deck that are not examined."""
    for command in deck.unread:
        text = f"the commands behind this {command.name} are unknown: none is reported as missing"
        yield command, "note", text
    if deck.is_of_liggghts:
        text = "this deck is for LIGGGHTS: rules for chains in LAMMPS are left out"
        yield deck.pair_style, "note", text


RULES: dict[str, Callable[[Deck], Found]] = {
    rule.__name__.strip("_").replace("_", "-"): rule
    for rule in (_no_deck, _no_run, _no_chain, _text_alone, _elsewhere, *CHAIN_RULES)
}
"""Rules that are functions, by name; the others are those of ``TRAPS``."""


def findings(commands: Sequence[Command], look: Look | None = None) -> list[Finding]:
    """Return the findings in the commands of a deck, and in what LAMMPS finds in it, by line."""
    deck = Deck(commands, look)
    is_other = deck.no_chain or deck.is_of_liggghts
    said = [(name, rule(deck)) for name, rule in RULES.items()
            if not (is_other and rule in CHAIN_RULES)]  # fmt: skip
    said += [] if is_other else [(trap.rule, trap.found_in(deck)) for trap in TRAPS]
    reports: set[Finding] = set()
    for name, rows in said:
        with contextlib.suppress(ArithmeticError):  # numbers beyond the range of floating point
            for command, severity, sentence in rows:
                line = 1 if command is None else command.line
                inside = f"{command.inside}: " if command is not None and command.inside else ""
                reports.add(Finding(line, name, severity, f"{inside}{sentence}"))
    return sorted(reports, key=lambda finding: (finding.line, finding.rule, finding.text))


def lint_file(
    path: Path, variables: Mapping[str, str] | None = None, time_limit: float = LINT_TIME_LIMIT
) -> list[Finding]:
    """Return the findings in a deck and in included files, at the lines that include them.

    LAMMPS reads the deck, in a process of its own, and runs it without motion. If it cannot, a note
    says why, and only rules on the text are applied.

    ``variables`` are those of the command line, which take the place of the deck's own.
    """
    text, given = read(path), variables or {}
    commands = script_of(path, text)
    deck = Deck(commands)
    if deck.is_of_liggghts or not (deck.unread or deck.pair_style):
        return findings(commands)
    from hertzchain.engines.lammps.reading.reading import look

    try:
        seen = look(path, given, time_limit)
    except HertzchainError as problem:
        said = f"LAMMPS could not be asked, the deck was read as text: {problem}"
        if isinstance(problem, TooExpensive):
            limit = f"{time_limit:g} s: shorten its loops, or raise the limit"
            said = f"not read to its end in {limit}"
        return [Finding(1, "text-alone", "note", said), *findings(commands)]
    return findings(script_of(path, text, seen.commands, not seen.is_whole), seen)


def read(path: Path) -> str:
    """The text of a deck; HertzchainError where it cannot be read."""
    try:
        # Most bytes of a deck: more are not written by hand
        content = read_bytes(path, 5_000_000)
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise HertzchainError(f"{str(path)!r}: cannot be read ({reason})") from None
    # A comment may be in another encoding; no command has such letters.
    return content.decode("utf-8-sig", errors="replace").replace("\r\n", "\n")
