"""Gives LAMMPS the commands of a deck, with hooks between its fixes."""

from __future__ import annotations

from dataclasses import dataclass, field

from hertzchain.engines.lammps.reading.allowed import MOVES, QUIET
from hertzchain.engines.lammps.reading.session import Session


@dataclass(frozen=True)
class DeckFix:
    """A fix of the deck: its id, group, style, and the index of its command."""

    name: str
    group: str
    style: str
    command: int
    values: tuple[str, ...] = ()  # what stands behind its style

    @property
    def moves(self) -> bool:
        """Whether it moves granules."""
        return self.style in MOVES

    @property
    def is_wall(self) -> bool:
        """Whether its force is that of a wall."""
        return self.style.startswith("wall/")


@dataclass
class Stage:
    """A LAMMPS that gets the commands of a deck.

    ``fixes`` are all that the deck has made, by the index of their command; ``alive`` those that
    act now, by their id.
    """

    lammps: Session
    fixes: dict[int, DeckFix] = field(default_factory=dict)
    alive: dict[str, DeckFix] = field(default_factory=dict)
    boundary: str = "p p p"

    def __post_init__(self) -> None:
        self.hooks = self.lammps.hooks()

    def give(self, text: str, words: list[str], index: int) -> None:
        """Give LAMMPS a command."""
        name = words[0]
        if name == "fix" and not self.hooks.sources:
            self.hooks.add(None)
        self.lammps.give(text)
        if name == "boundary":
            self.boundary = " ".join(words[1:])
        elif name == "fix":
            made = DeckFix(words[1], words[2], words[3], index, tuple(words[4:]))
            again = self.alive.get(made.name)
            self.alive[made.name] = self.fixes[index] = made
            if made.style in QUIET:
                return
            if again is None or again.style in QUIET:
                self.hooks.add(index)
            else:  # it stands where the one before stood
                place = self.hooks.sources.index(again.command)
                self.hooks.sources[place] = index
        elif name == "unfix" and len(words) > 1:
            gone = self.alive.pop(words[1], None)
            if gone is not None:
                self.hooks.remove(gone.command)

    def ready(self) -> None:
        """Have a hook at least."""
        if not self.hooks.sources:
            self.hooks.add(None)

    def velocities_of_ghosts(self) -> None:
        """Have forces that need them, even where the deck leaves that out and LAMMPS would stop."""
        self.lammps.give("comm_modify vel yes")

    def forget(self) -> None:
        """All that ``clear`` takes away."""
        self.lammps.give("clear")
        self.hooks = self.lammps.hooks()
        self.fixes.clear()
        self.alive.clear()
        self.boundary = "p p p"
