"""Forces that a deck puts on granules, over simulated time, in its units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from hertzchain.verdict.lint.deck import Deck, Run
from hertzchain.verdict.lint.script import Command

_POINTS = 1200  # of time in all runs together, at which forces are looked at (chosen: 0.1 s)


@dataclass(frozen=True)
class Force:
    """A ``fix addforce``, and the runs during which it acts."""

    command: Command
    runs: tuple[Run, ...]
    unfix: Command | None

    @property
    def group(self) -> str:
        """Whose granules it pushes."""
        return self.command.words[2]

    @property
    def words(self) -> tuple[str, ...]:
        """Its three components, as they are written."""
        return (*self.command.words[4:7], "", "", "")[:3]

    def at(self, deck: Deck, axis: int, run: Run, time: float) -> float | None:
        """A component at a simulated time of a run; None where it is not known."""
        word = self.words[axis]
        if not word.startswith("v_"):
            return deck.number(word, self.command)
        clock = {"time": time}
        if run.dt and run.start is not None:
            elapsed = (time - run.start) / run.dt
            clock |= {"dt": run.dt, "elapsed": elapsed, "since": time - run.start}
            if run.steps:
                clock["part"] = elapsed / run.steps
            if run.steps_before is not None:
                clock["step"] = run.steps_before + elapsed
        return deck.script.value(word, run.command.place, clock)


def forces_of(deck: Deck) -> list[Force]:
    """All ``fix addforce`` of a deck, in the order in which they end."""
    runs = {run.command.place: run for run in deck.runs}
    acting: dict[str, tuple[Command, list[Run]]] = {}
    found: list[Force] = []

    def end(name: str, unfix: Command | None) -> None:
        command, during = acting.pop(name)
        found.append(Force(command, tuple(during), unfix))

    for command in deck.script.commands:
        if command.never:
            continue
        name = " ".join(command.words[1:2])
        if command.place in runs:
            for _, during in acting.values():
                during.append(runs[command.place])
        elif command.name in ("fix", "unfix"):
            if name in acting:
                end(name, command)
            if command.name == "fix" and command.words[3:4] == ("addforce",):
                acting[name] = (command, [])
    for name in list(acting):
        end(name, None)
    return found


def moving_runs(deck: Deck) -> list[Run]:
    """The runs that take steps, or may."""
    return [run for run in deck.runs if run.steps != 0 and not run.command.never]


def times_of(runs: list[Run], among: int) -> Iterator[tuple[Run, float]]:
    """Times in some runs, out of so many runs that share the points; at least both ends of each."""
    parts = max(2, _POINTS // max(among, 1))
    for run in runs:
        if run.start is not None and run.end is not None:
            for k in range(parts + 1):
                yield run, run.start + (run.end - run.start) * k / parts
