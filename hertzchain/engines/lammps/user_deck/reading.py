"""Reads somebody's deck: asks LAMMPS for its numbers, watches it run, replays it without motion."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.program import work_folder
from hertzchain.engines.lammps.engine import engine, version_of
from hertzchain.engines.lammps.isolation import Child
from hertzchain.engines.lammps.user_deck.found import (
    Executed,
    FoundDeck,
    FoundFix,
    FoundRun,
    FoundWall,
)
from hertzchain.engines.lammps.user_deck.frozen import Applied, Replay
from hertzchain.engines.lammps.user_deck.interpreter import Ended, Interpreter
from hertzchain.engines.lammps.user_deck.player import Stage
from hertzchain.engines.lammps.user_deck.probing import Probes, WallProbe, probe
from hertzchain.engines.lammps.user_deck.watching import Given, RunSeen, Watcher
from hertzchain.errors import RunFailed, SceneError, TooExpensive
from hertzchain.limits import TIME_LIMIT, Deadline, check_time_limit, in_words
from hertzchain.scene.scene import Scene

_READINGS = 2000
"""Readings of the applied force while the scene's shock lasts: a force that is held over more of
them is seen, and a line between two is right to 1e-6 of a pulse."""

_NEGLIGIBLE = 1e-9  # of the largest force or impulse: no shock


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
        A LAMMPS binary: refused, the module is needed.
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
    if lmp is not None:
        raise SceneError(
            "lmp", str(lmp), "must be left out: a deck is examined by LAMMPS's Python module"
        )
    deck, deadline = Path(path), Deadline(time_limit)
    given_variables = {name: str(value) for name, value in dict(variables).items()}
    say = progress or (lambda _: None)
    with work_folder("LAMMPS") as folder, Child() as child:
        where = str(folder), str(deck), str(deck.absolute()), given_variables
        try:
            say("asking LAMMPS what it makes of the deck")
            probes = child.call(_probe, *where, scene, time_limit=deadline.left)
            say("running the deck")
            seen = child.call(_watch, *where, probes, time_limit=deadline.left)
            say("reading the applied forces")
            steps = seen.given, probes, _between(scene, probes)
            applied = child.call(_freeze, str(folder), *steps, time_limit=deadline.left)
        except TooExpensive:
            raise TooExpensive(
                f"{deck}: not over after {in_words(time_limit)}: shorten the deck, if it is to end"
                " at all, or raise the limit"
            ) from None
    return _found(probes, seen, applied)


def _between(scene: Scene, probes: Probes) -> float:
    """Time between two readings of the applied force, in the deck's unit."""
    whole = scene.pulse_end if scene.pulse_end > 0 else scene.end_time
    if probes.granules.units.name == "lj":
        return whole / _READINGS * probes.contact_time / scene.contact_time
    return whole / _READINGS / probes.granules.units.time


# ---- In the process that runs LAMMPS


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


def _probe(folder: str, name: str, path: str, variables: Mapping[str, str], scene: Scene) -> Probes:
    os.chdir(folder)
    with engine() as lammps:
        first = _First(Stage(lammps), scene)
        Interpreter(lammps, name, Path(path), variables, first, _tell).play()
    if first.probes is None:
        raise RunFailed(f"{name}: the deck takes no step: it has no run, or ends before it")
    return first.probes


@dataclass(frozen=True, eq=False)
class _Watched:
    """What was seen of the deck as it is."""

    version: str
    commands: tuple[Executed, ...]
    given: tuple[Given, ...]
    runs: tuple[RunSeen, ...]
    first_run: int
    time: float
    read_every: int
    image_force: float
    peak_force: tuple[FloatArray, FloatArray]  # seen forwards and backwards
    peak_time: tuple[FloatArray, FloatArray]
    error: tuple[float, float]
    missed: tuple[FloatArray, FloatArray]
    driven: NDArray[np.bool_]
    driven_time: FloatArray
    driven_ends: FloatArray
    position: FloatArray
    velocity: FloatArray
    cleared: bool


def _watch(
    folder: str, name: str, path: str, variables: Mapping[str, str], probes: Probes
) -> _Watched:
    os.chdir(folder)
    with engine() as lammps:
        watcher = Watcher(Stage(lammps), probes)
        script = Interpreter(lammps, name, Path(path), variables, watcher, _tell)
        script.play()
        both = watcher.forward, watcher.backward
        return _Watched(
            version=version_of(lammps),
            commands=tuple(script.commands),
            given=tuple(watcher.given),
            runs=tuple(watcher.runs),
            first_run=watcher.first_run,
            time=watcher.time,
            read_every=watcher.read_every,
            image_force=watcher.image_force,
            peak_force=(both[0].all.force, both[1].all.force),
            peak_time=(both[0].all.time, both[1].all.time),
            error=(both[0].error, both[1].error),
            missed=(both[0].missed, both[1].missed),
            driven=watcher.driven,
            driven_time=np.concatenate([*watcher.driven_time, np.zeros(0)]),
            driven_ends=np.concatenate([*watcher.driven_ends, np.zeros((0, 2))]),
            position=watcher.position,
            velocity=watcher.velocity,
            cleared=watcher.cleared,
        )


def _freeze(folder: str, given: tuple[Given, ...], probes: Probes, between: float) -> Applied:
    os.chdir(folder)
    with engine() as lammps:
        return Replay(Stage(lammps), probes.granules, between).play(given)


# ---- What was found, in SI units and in the order from the shock


def _found(probes: Probes, seen: _Watched, applied: Applied) -> FoundDeck:
    granules = probes.granules
    units = granules.units
    backwards = _is_reversed(probes, applied, seen.driven)
    sign = -1.0 if backwards else 1.0

    def turned(values: Any, axis: int = -1) -> Any:
        return np.flip(values, axis) if backwards else values

    def vectors(values: FloatArray, unit: float) -> FloatArray:
        return np.asarray(turned(values, 0) * np.array([sign, 1.0, 1.0]) * unit)

    origin = granules.position[-1 if backwards else 0, 0]

    def places(values: FloatArray) -> FloatArray:
        return np.asarray(turned(sign * (values - origin)) * units.length)

    way = int(backwards)
    order = granules.order
    led = slice(None) if seen.driven[-1 if backwards else 0] else slice(0)
    return FoundDeck(
        version=seen.version,
        commands=seen.commands,
        first_run=seen.first_run,
        units=units.name,
        axis="xyz"[granules.axes[0]],
        reversed=backwards,
        ids=turned(granules.ids[order]),
        types=turned(granules.types),
        position=places(granules.position[:, 0]),
        sideways=turned(
            granules.position[:, 1:] - np.median(granules.position[:, 1:], axis=0), 0
        )
        * units.length,
        radius=turned(granules.radius) * units.length,
        mass=turned(granules.mass) * units.mass,
        velocity=vectors(granules.velocity, units.velocity),
        spin=vectors(granules.spin, 1 / units.time),
        overlap=turned(probes.overlap) * units.length,
        contact_force=turned(probes.contact_force) * units.force,
        closing=turned(probes.closing) * units.velocity,
        damped_overlap=turned(probes.damped_overlap) * units.length,
        damped_force=turned(probes.damped_force) * units.force,
        tangential_force=turned(probes.tangential_force) * units.force,
        constant_force=vectors(applied.constant, units.force),
        drag=turned(probes.drag) * units.drag,
        walls=tuple(_wall(wall, backwards, origin, probes) for wall in probes.walls),
        integrated=turned(probes.integrated),
        boundary=granules.boundary,
        image_gap=_image_gap(probes),
        image_force=seen.image_force * units.force,
        fixes=tuple(
            FoundFix(
                one.fix.style, one.fix.command, one.fix.moves, turned(one.granules),
                turned(one.largest, 0) * units.force,
            )
            for one in applied.fixes
        ),
        runs=tuple(
            FoundRun(run.start * units.time, run.dt * units.time, run.steps, run.command)
            for run in seen.runs
        ),
        applied_time=applied.time * units.time,
        applied_force=sign * turned(applied.force) * units.force,
        applied_every=applied.every,
        applied_sideways=applied.sideways * units.force,
        peak_force=seen.peak_force[way] * units.force,
        peak_time=seen.peak_time[way] * units.time,
        peak_reading_error=seen.error[way],
        read_every=seen.read_every,
        missed_overlap=seen.missed[way] * units.length,
        driven=turned(seen.driven),
        driven_time=seen.driven_time[led] * units.time,
        driven_displacement=sign
        * (seen.driven_ends[led, -1 if backwards else 0] - origin)
        * units.length,
        end_time=seen.time * units.time,
        final_position=places(seen.position),
        final_velocity=sign * turned(seen.velocity) * units.velocity,
        remarks=_remarks(seen),
    )  # fmt: skip


def _is_reversed(probes: Probes, applied: Applied, driven: NDArray[np.bool_]) -> bool:
    """Whether the shock acts on the granule at the largest coordinate."""
    if applied.time.size > 1:
        impulse = np.trapezoid(np.abs(applied.force), applied.time, axis=0)
        if impulse.max() > 0:
            where = _middle(impulse)
            if where != 0:
                return where > 0
    if _middle(driven) != 0:
        return _middle(driven) > 0
    speed = np.abs(probes.granules.velocity[:, 0])
    if speed.max() > 0 and _middle(speed) != 0:
        return _middle(speed) > 0
    walls = [wall.at_end for wall in probes.walls]
    return len(walls) == 1 and not walls[0]


def _middle(weight: FloatArray | NDArray[np.bool_]) -> float:
    """On which side of the middle of the chain most of it is: below 0 near the start."""
    place = np.linspace(-1, 1, weight.size) if weight.size > 1 else np.zeros(1)
    return float(np.sum(weight * place))


def _image_gap(probes: Probes) -> float | None:
    granules = probes.granules
    if not granules.periodic[0]:
        return None
    length = float(granules.high[0] - granules.low[0])
    extent = float(granules.position[-1, 0] - granules.position[0, 0])
    gap = length - extent - float(granules.radius[0] + granules.radius[-1])
    return gap * granules.units.length


def _wall(wall: WallProbe, backwards: bool, origin: float, probes: Probes) -> FoundWall:
    units = probes.granules.units
    sign = -1.0 if backwards else 1.0
    return FoundWall(
        end="last" if wall.at_end != backwards else "first",
        position=sign * (wall.position - origin) * units.length,
        overlap=wall.overlap * units.length,
        force=wall.force * units.force,
        closing=wall.closing * units.velocity,
        damped_overlap=wall.damped_overlap * units.length,
        damped_force=wall.damped_force * units.force,
        tangential_force=wall.tangential_force * units.force,
        command=wall.command,
    )


def _remarks(seen: _Watched) -> tuple[str, ...]:
    remarks = []
    if seen.cleared:
        remarks.append("what follows the clear after the first chain is another chain's")
    for done in seen.commands:
        words = done.text.split()
        if words[0] == "fix" and words[3:4] == ["langevin"] and done.carried_out:
            remarks.append(f"{done.file}:{done.line}: fix langevin pushes granules at random")
        if words[0] == "velocity" and words[2:3] == ["create"]:
            remarks.append(f"{done.file}:{done.line}: velocity create is random")
    return tuple(dict.fromkeys(remarks))
