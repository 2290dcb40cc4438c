"""Reads somebody's deck: asks LAMMPS for its numbers, watches it run, replays it without motion."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hertzchain.engines.external.program import work_folder
from hertzchain.engines.lammps.binary import Program
from hertzchain.engines.lammps.isolation import Child
from hertzchain.engines.lammps.user_deck.assembling import Watched, found_of
from hertzchain.engines.lammps.user_deck.found import FoundDeck
from hertzchain.engines.lammps.user_deck.frozen import Applied, Replay
from hertzchain.engines.lammps.user_deck.interpreter import Ended, Interpreter
from hertzchain.engines.lammps.user_deck.piped import piped
from hertzchain.engines.lammps.user_deck.player import Stage
from hertzchain.engines.lammps.user_deck.probing import Probes, probe
from hertzchain.engines.lammps.user_deck.session import Session, module
from hertzchain.engines.lammps.user_deck.watching import Given, Watcher
from hertzchain.errors import RunFailed, TooExpensive
from hertzchain.limits import TIME_LIMIT, Deadline, bound_memory, check_time_limit, in_words
from hertzchain.scene.scene import Scene

_READINGS = 2000
"""Readings of the applied force while the scene's shock lasts: a force that is held over more of
them is seen, and a line between two is right to 1e-6 of a pulse."""

_READ_EVERY = 0.2
"""Contact times between two readings: the interpolation between them is right to 1e-6 then."""

_SURE, _DENSER, _TRIES = 1e-5, 0.1, 3
"""Error of the peaks by the distance of readings above which the deck is run again with readings
that are so much denser, and how often at most: where the contacts are stiffer, or pressed harder,
than the scene's."""


def read_deck(
    path: Path | str,
    scene: Scene,
    variables: Mapping[str, object] | Iterable[tuple[str, object]] = (),
    time_limit: float = TIME_LIMIT,
    lmp: str | Path | None = None,
    progress: Callable[[str], object] | None = None,
) -> FoundDeck:
    """Have LAMMPS read a deck, ask it for every number, run it and watch it.

    Parameters
    ----------
    path
        The deck.
    scene
        The scene that the deck should be: it says at which overlaps, speeds and times LAMMPS is
        asked, and nothing else.
    variables
        Values of variables by name, as ``-var`` gives them.
    time_limit
        How long all of it may take [s].
    lmp
        A LAMMPS binary to be asked instead of the Python module, by path or name.
    progress
        Is told what is being done.

    Raises
    ------
    BackendMissing
        If the LAMMPS module is not there or too old.
    RunFailed
        If the deck cannot be read, stops with an error, crashes LAMMPS, needs what is not carried
        out here, or is not over in time.
    """
    check_time_limit(time_limit)
    deck, deadline = Path(path), Deadline(time_limit)
    given_variables = {name: str(value) for name, value in dict(variables).items()}
    say = progress or (lambda _: None)
    with work_folder("LAMMPS") as folder, Child() as child:
        program = None if lmp is None else Program.find(str(lmp), 1, deadline)
        lammps = _Start(folder, program)
        where = lammps, str(deck), deck.absolute(), given_variables
        try:
            say("asking LAMMPS what it makes of the deck")
            probes, restarts = child.call(_probe, *where, scene, time_limit=deadline.left)
            say("running the deck")
            between = _READ_EVERY * probes.contact_time
            for _ in range(_TRIES):
                if restarts:
                    child.end()
                seen = child.call(_watch, *where, probes, between, time_limit=deadline.left)
                if max(peaks.error for peaks in seen.peaks) < _SURE or seen.read_every == 1:
                    break
                between *= _DENSER
            say("reading the applied forces")
            if restarts:
                child.end()
            places = tuple(f"{done.file}:{done.line}" for done in seen.commands)
            steps = seen.given, probes, _between(scene, probes), places
            applied = child.call(_freeze, lammps, *steps, time_limit=deadline.left)
        except TooExpensive:
            raise TooExpensive(
                f"{deck}: not over after {in_words(time_limit)}: shorten the deck, if it is to end"
                " at all, or raise the limit"
            ) from None
    return found_of(probes, seen, applied)


def _between(scene: Scene, probes: Probes) -> float:
    """Time between two readings of the applied force, in the deck's unit."""
    whole = scene.pulse_end if scene.pulse_end > 0 else scene.end_time
    if probes.granules.units.name == "lj":
        return whole / _READINGS * probes.contact_time / scene.contact_time
    return whole / _READINGS / probes.granules.units.time


# ---- In the process that runs LAMMPS


@dataclass(frozen=True)
class _Start:
    """How LAMMPS is started, in a folder of its own: the Python module, or a binary."""

    folder: Path
    program: Program | None

    def session(self) -> AbstractContextManager[Session]:
        """A LAMMPS without a box."""
        os.chdir(self.folder)
        bound_memory()  # a lattice a hundred times too fine makes a million times the granules
        if self.program is None:
            return module()
        return piped(self.program.command[0], self.program.build.version, self.folder)


def _tell(place: str) -> None:
    """Say on standard error where the deck is: the last words of a process that crashes."""
    os.write(2, f"{place}\n".encode())


class _First:
    """Plays a deck up to its first run, and asks there."""

    def __init__(self, stage: Stage, scene: Scene) -> None:
        self._stage, self._scene = stage, scene
        self.probes: Probes | None = None

    def give(self, text: str, words: list[str], index: int) -> None:
        """Give LAMMPS a command."""
        self._stage.give(text, words, index)

    def run(self, steps: int, keywords: str, index: int) -> None:
        """Ask for all numbers, where steps are taken."""
        self._stage.ready()
        if steps == 0:
            self._stage.give(f"run 0 {keywords}", ["run"], index)
            return
        self.probes = probe(self._stage, self._scene)
        raise Ended

    def clear(self) -> bool:
        """Forget all."""
        self._stage.forget()
        return True


def _probe(
    start: _Start, name: str, path: Path, variables: Mapping[str, str], scene: Scene
) -> tuple[Probes, bool]:
    """What LAMMPS makes of the deck, and whether it starts from a restart file."""
    with start.session() as lammps:
        first = _First(Stage(lammps), scene)
        script = Interpreter(lammps, name, path, variables, first, _tell)
        script.play()
    if first.probes is None:
        raise RunFailed(f"{name}: the deck takes no step: it has no run, or ends before it")
    # Pair style granular leaves memory undefined where it comes from a restart file (seen in
    # 2025): in a process that has run LAMMPS before, the deck often stops.
    restarts = any(done.text.startswith("read_restart") for done in script.commands)
    return first.probes, restarts


def _watch(
    start: _Start,
    name: str,
    path: Path,
    variables: Mapping[str, str],
    probes: Probes,
    between: float,
) -> Watched:
    with start.session() as lammps:
        watcher = Watcher(Stage(lammps), probes, between)
        script = Interpreter(lammps, name, path, variables, watcher, _tell)
        script.play()
        return Watched(
            version=lammps.version,
            commands=tuple(script.commands),
            given=tuple(watcher.given),
            runs=tuple(watcher.runs),
            first_run=watcher.first_run,
            time=watcher.time,
            read_every=watcher.read_every,
            image_force=watcher.image_force,
            peaks=(watcher.peaks(mirrored=False), watcher.peaks(mirrored=True)),
            exerted=watcher.exerted,
            driven=watcher.driven,
            driven_time=np.concatenate([*watcher.driven_time, np.zeros(0)]),
            driven_ends=np.concatenate([*watcher.driven_ends, np.zeros((0, 2))]),
            position=watcher.position,
            velocity=watcher.velocity,
            cleared=watcher.cleared,
        )


def _freeze(
    start: _Start,
    given: tuple[Given, ...],
    probes: Probes,
    between: float,
    places: tuple[str, ...],
) -> Applied:
    with start.session() as lammps:
        return Replay(Stage(lammps), probes.granules, between, places).play(given)
