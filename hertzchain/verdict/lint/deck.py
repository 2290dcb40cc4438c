"""What can be known of a deck of a chain without running it; None where it cannot be known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from hertzchain.engines.lammps.dialect import DEFAULT_SKIN, DEFAULT_STEP, NUMBERS_OF
from hertzchain.verdict.lint.arithmetic import number
from hertzchain.verdict.lint.script import Command, Script

TOUCHING = 1e-9  # relative; sites that differ by less from a diameter differ by rounding as written


@dataclass(frozen=True)
class Run:
    """A run, with what can be known of it: steps, their length, and the simulated time before."""

    command: Command
    steps: float | None
    dt: float | None
    start: float | None
    steps_before: float | None = None  # of LAMMPS's own count

    @property
    def end(self) -> float | None:
        """Simulated time when it ends, if it can be known."""
        if self.start is None or self.dt is None or self.steps is None:
            return None
        return self.start + self.steps * self.dt


@dataclass(frozen=True)
class Push:
    """A ``fix addforce`` whose x component is a formula, and the runs that it acts in."""

    command: Command
    variable: str
    runs: tuple[Run, ...]
    unfix: Command | None


@dataclass(frozen=True)
class Law:
    """A contact law as a deck states it: the command, its normal model and its numbers."""

    command: Command
    normal: str
    numbers: tuple[str, ...]


class Deck:
    """A parsed deck, with what rules ask of it."""

    def __init__(self, script: Script) -> None:
        self.script = script

    def named(self, *names: str) -> list[Command]:
        """The commands of these names."""
        return self.script.named(*names)

    def fixes(self, *styles: str) -> list[Command]:
        """The fixes of these styles, or all."""
        found = [fix for fix in self.named("fix") if len(fix.words) > 3]
        return [fix for fix in found if not styles or fix.words[3] in styles]

    def number(self, word: str | None, command: Command) -> float | None:
        """The value of a word of a command, a number or ``v_name``."""
        if word is not None and word.startswith("v_"):
            return self.script.value(word, command.place)
        return number(word)

    @cached_property
    def is_partial(self) -> bool:
        """Whether parts of it are elsewhere: included files, restarts."""
        return bool(self.named("include", "read_restart", "python", "plugin")) or any(
            jump.words[1:2] != ("SELF",) for jump in self.named("jump")
        )

    @cached_property
    def units(self) -> str:
        """The units that it uses."""
        given = [command.words[1] for command in self.named("units") if len(command.words) > 1]
        return given[-1] if given else "lj"

    @cached_property
    def pair_style(self) -> Command | None:
        """The last pair style."""
        found = [command for command in self.named("pair_style") if len(command.words) > 1]
        return found[-1] if found else None

    @cached_property
    def is_granular(self) -> bool:
        """Whether its pair style is one of granules."""
        words = () if self.pair_style is None else self.pair_style.words[1:]
        return any(word.split("/")[0] in ("granular", "gran") for word in words if word != "gran")

    @cached_property
    def is_of_liggghts(self) -> bool:
        """Whether it is a deck of LIGGGHTS, which is like LAMMPS but for the contact laws."""
        return self.pair_style is not None and self.pair_style.words[1] == "gran"

    @cached_property
    def laws(self) -> list[Law]:
        """The contact laws of ``pair_style granular``, between granules and with walls."""
        found: list[Law] = []
        if self.is_granular:
            for command in self.named("pair_coeff"):
                found += _law(command, command.words[3:])
        for wall in self.fixes("wall/gran", "wall/gran/region"):
            if len(wall.words) > 5 and wall.words[4] == "granular":
                found += _law(wall, wall.words[5:])
        return found

    @cached_property
    def diameter(self) -> float | None:
        """Of all granules, if they have one and the same [length]."""
        values = {self.number(word, command) for command, word in self.given("diameter")}
        return values.pop() if len(values) == 1 else None

    def given(self, attribute: str) -> list[tuple[Command, str]]:
        """The ``set`` commands that give an attribute, and what they give."""
        return [
            (command, value)
            for command in self.named("set")
            if (value := command.after(attribute)) is not None
        ]

    @cached_property
    def density(self) -> float | None:
        """Of all granules, if they have one and the same."""
        values = {self.number(word, command) for command, word in self.given("density")}
        return values.pop() if len(values) == 1 else None

    @cached_property
    def stiffness(self) -> float | None:
        """A in F = A overlap^(3/2) of two granules, if it can be known (Eq. 1)."""
        if self.diameter is None or self.diameter <= 0 or self.pair_style is None:
            return None
        normal: float | None = None
        style = self.pair_style.words[1]
        if style == "gran/hertz/history":
            normal = number(self.pair_style.words[2]) if len(self.pair_style.words) > 2 else None
        elif style == "granular":
            laws = [law for law in self.laws if law.command.name == "pair_coeff"]
            if len(laws) == 1:
                values = [number(word) for word in laws[0].numbers]
                if laws[0].normal == "hertz":
                    normal = values[0]
                elif laws[0].normal == "hertz/material":
                    modulus, _, poisson = values
                    if modulus is not None and poisson is not None and abs(poisson) < 1:
                        normal = 2 * modulus / (3 * (1 - poisson**2))
        if normal is None or normal <= 0:
            return None
        return normal * math.sqrt(self.diameter / 4)

    @cached_property
    def runs(self) -> list[Run]:
        """The runs, with step and start where they can be known."""
        dt = DEFAULT_STEP.get(self.units)
        clock: float | None = 0.0
        taken: float | None = 0.0
        changing = bool(self.fixes("dt/reset", "adapt"))
        found: list[Run] = []
        for command in self.script.commands:
            if command.never:
                continue
            if command.name == "timestep":
                dt = None if command.conditional else number(" ".join(command.words[1:2]))
            elif command.name == "reset_timestep":
                clock = taken = None
            elif command.name in ("run", "minimize", "rerun"):
                word = command.words[1] if len(command.words) > 1 else None
                plain = command.name == "run" and not command.conditional
                plain = plain and not {"upto", "start", "stop"} & set(command.words)
                steps = number(word) if plain else None
                found.append(Run(command, steps, None if changing else dt, clock, taken))
                clock = found[-1].end
                taken = None if taken is None or steps is None else taken + steps
        return found

    @cached_property
    def pushes(self) -> list[Push]:
        """The forces on granules that follow a formula."""
        forces = {fix.place for fix in self.fixes("addforce")}
        runs = {run.command.place: run for run in self.runs}
        found: list[Push] = []
        acting: dict[str, tuple[Command, list[Run]]] = {}

        def end(name: str, unfix: Command | None) -> None:
            fix, during = acting.pop(name)
            found.append(Push(fix, fix.words[4][2:], tuple(during), unfix))

        for command in self.script.commands:
            name = " ".join(command.words[1:2])
            if command.place in runs:
                for _, during in acting.values():
                    during.append(runs[command.place])
            elif command.name in ("fix", "unfix"):
                if name in acting:
                    end(name, command)
                if command.place in forces and " ".join(command.words[4:5]).startswith("v_"):
                    acting[name] = (command, [])
        for name in list(acting):
            end(name, None)
        return found

    def force(self, push: Push, place: int, time: float) -> float | None:
        """The force of a push at a simulated time, with the variables of a command."""
        return self.script.value(f"v_{push.variable}", place, {"time": time})

    @cached_property
    def peak_force(self) -> float | None:
        """The largest force that pushes, if it can be known."""
        forces: list[float] = []
        for push in self.pushes:
            for run in push.runs:
                if run.start is None or run.end is None:
                    return None
                # At least both ends; a deck that follows a table has thousands of runs.
                parts = max(1, 640 // len(push.runs))
                for k in range(parts + 1):
                    time = run.start + (run.end - run.start) * k / parts
                    force = self.force(push, run.command.place, time)
                    if force is None:
                        return None
                    forces.append(abs(force))
        return max(forces, default=None)

    @cached_property
    def spacing(self) -> tuple[Command, float] | None:
        """How far apart the sites of the chain are, and the command that says so."""
        created = self.named("create_atoms")
        singles = [command for command in created if command.words[2:3] == ("single",)]
        if singles and len(singles) == len(created):
            points = [self._point(command) for command in singles]
            axis = self.axis
            if axis is None or len(points) < 2 or any(None in point for point in points):
                return None
            along = sorted(point[axis] or 0.0 for point in points)
            gaps = [after - before for before, after in pairwise(along)]
            if max(gaps) - min(gaps) > TOUCHING * max(gaps):
                return None
            return singles[1], gaps[0]
        lattices = self.named("lattice")
        if len(created) != 1 or len(lattices) != 1 or self.axis is None or self.units == "lj":
            return None
        if lattices[0].words[1:2] != ("sc",) or len(lattices[0].words) != 3:
            return None
        scale = number(lattices[0].words[2])
        return None if scale is None or scale <= 0 else (lattices[0], scale)

    @cached_property
    def axis(self) -> int | None:
        """The axis that the granules lie along, if they are known to lie in a row."""
        created = self.named("create_atoms")
        others = self.fixes("pour", "deposit", "rigid", "rigid/small")
        if not created or self.named("read_data", "molecule") or others:
            return None
        singles = [command for command in created if command.words[2:3] == ("single",)]
        if len(singles) == len(created):
            if len(singles) == 1 and not singles[0].conditional:
                return None
            across = [
                k
                for k in range(3)
                if len({command.words[3 + k : 4 + k] for command in singles}) == 1
                and number(" ".join(singles[0].words[3 + k : 4 + k])) is not None
            ]
            return next(iter({0, 1, 2} - set(across)), None) if len(across) == 2 else None
        if singles or len(created) != 1 or created[0].words[2:3] != ("region",):
            return None
        sites = self._sites_across(" ".join(created[0].words[3:4]))
        rows = [k for k, count in enumerate(sites) if count is None or count > 1]
        return rows[0] if len(rows) == 1 and None not in (sites[k] for k in rows) else None

    def _point(self, command: Command) -> tuple[float | None, ...]:
        return tuple(number(" ".join(command.words[3 + k : 4 + k])) for k in range(3))

    def extent(self, region: str) -> list[tuple[float, float] | None]:
        """Lower and upper end of a block, each axis, as it is written."""
        blocks = [r for r in self.named("region") if r.words[1:3] == (region, "block")]
        if len(blocks) != 1 or len(blocks[0].words) < 9:
            return [None, None, None]
        ends = [number(word) for word in blocks[0].words[3:9]]
        pairs = ((ends[0], ends[1]), (ends[2], ends[3]), (ends[4], ends[5]))
        return [None if a is None or b is None else (a, b) for a, b in pairs]

    def unit_of(self, region: str) -> float | None:
        """How long a unit of a region's numbers is."""
        blocks = [r for r in self.named("region") if r.words[1:3] == (region, "block")]
        lattices = self.named("lattice")
        in_box = bool(blocks) and blocks[0].after("units") == "box"
        if in_box or not lattices:
            return 1.0
        simple = len(lattices) == 1 and len(lattices[0].words) == 3 and self.units != "lj"
        return number(lattices[0].words[2]) if simple else None

    def _sites_across(self, region: str) -> list[float | None]:
        """How many sites of a cubic lattice a block has along each axis; one where it is thin."""
        unit = self.unit_of(region)
        lattices = self.named("lattice")
        cubic = len(lattices) == 1 and lattices[0].words[1:2] == ("sc",)
        scale = number(" ".join(lattices[0].words[2:3])) if cubic else None
        if unit is None or scale is None or scale <= 0:
            return [None, None, None]
        counts: list[float | None] = []
        for ends in self.extent(region):
            if ends is None:
                counts.append(None)
            else:
                low, high = ends[0] * unit / scale, ends[1] * unit / scale
                counts.append(math.floor(high + 1e-6) - math.ceil(low - 1e-6) + 1.0)
        return counts

    def has_room(self, axis: int) -> bool:
        """Whether the box is known to be so long that images do not matter to the chain."""
        boxes = self.named("create_box")
        region = " ".join(boxes[0].words[2:3]) if len(boxes) == 1 else ""
        ends, unit = self.extent(region)[axis], self.unit_of(region)
        if ends is None or unit is None or self.diameter is None or self.skin is None:
            return False
        span: float | None = 0.0
        if axis == self.axis:
            created = self.named("create_atoms")
            if created[0].words[2:3] == ("single",):
                along = [self._point(command)[axis] for command in created]
                known = [place for place in along if place is not None]
                span = max(known) - min(known) if len(known) == len(along) else None
            else:
                count = self._sites_across(created[0].words[3])[axis]
                scale = self.spacing
                span = None if count is None or scale is None else (count - 1) * scale[1]
        if span is None:
            return False
        return (ends[1] - ends[0]) * unit > span + 2 * (self.diameter + self.skin)

    @cached_property
    def skin(self) -> float | None:
        """How much wider than a contact neighbours are looked for."""
        given = [command for command in self.named("neighbor") if len(command.words) > 1]
        return number(given[-1].words[1]) if given else DEFAULT_SKIN.get(self.units)

    @cached_property
    def is_heap(self) -> bool:
        """Whether it surely is no chain: granules are poured, rest under gravity, or are many."""
        heap = ("pour", "deposit", "wall/gran/region", "rigid", "rigid/small")
        fallen = self.axis is None and bool(self.fixes("gravity"))
        return (
            fallen
            or bool(self.fixes(*heap))
            or any(command.words[1:2] == ("2",) for command in self.named("dimension"))
        )

    @cached_property
    def boundary(self) -> tuple[tuple[str, str, str], Command | None]:
        """The boundary of each axis, and the command that sets it."""
        given = [command for command in self.named("boundary") if len(command.words) > 3]
        changed = [c for c in self.named("change_box") if "boundary" in c.words]
        if changed:
            words = changed[-1].words
            styles = words[words.index("boundary") + 1 :][:3]
            command: Command | None = changed[-1]
        else:
            styles = given[-1].words[1:4] if given else ("p", "p", "p")
            command = given[-1] if given else None
        if len(styles) < 3:
            return ("p", "p", "p"), command
        return (styles[0], styles[1], styles[2]), command

    @cached_property
    def first_run(self) -> Command | None:
        """The first run that takes steps, or may take some."""
        return next((run.command for run in self.runs if run.steps != 0), None)


def _law(command: Command, words: tuple[str, ...]) -> list[Law]:
    if not words or words[0] not in NUMBERS_OF:
        return []
    count = NUMBERS_OF[words[0]]
    return [Law(command, words[0], words[1 : 1 + count])] if len(words) > count else []
