"""Combines the answers of LAMMPS into a ``FoundDeck``, in SI units, in the order from the shock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.found import FoundDeck, FoundWall, scaled
from hertzchain.engines.lammps.reading.frozen import Applied
from hertzchain.engines.lammps.reading.granules import Granules
from hertzchain.engines.lammps.reading.probing import Probes
from hertzchain.engines.lammps.reading.watching import Watched
from hertzchain.scene.scene import Scene


def found_of(
    probes: Probes,
    seen: Watched,
    applied: Applied,
    scene: Scene | None = None,
    backwards: bool | None = None,
) -> FoundDeck:
    """Return the ``FoundDeck`` from probes, the watched run, and applied forces.

    Whether granule 1 lies at the largest coordinate follows from these, unless it is given; a scene
    shows the order of its granules.
    """
    granules = probes.granules
    if backwards is None:
        backwards = _is_reversed(probes, seen, applied, scene)
    sign = -1.0 if backwards else 1.0

    def turned(values: Any, axis: int = -1) -> Any:
        return np.flip(values, axis) if backwards else values

    def vectors(values: FloatArray) -> FloatArray:
        return np.asarray(turned(values, 0) * np.array([sign, 1.0, 1.0]))

    origin = granules.position[-1 if backwards else 0, 0]

    def places(values: FloatArray) -> FloatArray:
        return np.asarray(turned(sign * (values - origin)))

    peaks = seen.peaks[int(backwards)]
    order = granules.order
    led = slice(None) if seen.driven[-1 if backwards else 0] else slice(0)
    found = FoundDeck(
        version=seen.version,
        commands=seen.commands,
        first_run=seen.first_run,
        before=seen.before,
        units=granules.units.name,
        stopped=seen.stopped,
        is_chain=granules.is_chain,
        axis=_axis(granules.frame[0]),
        direction=sign * granules.frame[0],
        reversed=backwards,
        ids=turned(granules.ids[order]),
        types=turned(granules.types),
        origin=granules.position[-1 if backwards else 0] @ granules.frame,
        position=places(granules.position[:, 0]),
        sideways=turned(
            granules.position[:, 1:] - np.median(granules.position[:, 1:], axis=0), 0
        ),
        radius=turned(granules.radius),
        mass=turned(granules.mass),
        velocity=vectors(granules.velocity),
        spin=vectors(granules.spin),
        overlap=turned(probes.overlap),
        contact_force=turned(probes.contact_force),
        closing=turned(probes.closing),
        damped_overlap=turned(probes.damped_overlap),
        damped_force=turned(probes.damped_force),
        tangential_force=turned(probes.tangential_force),
        constant_force=vectors(applied.constant),
        drag=turned(probes.drag),
        walls=tuple(_wall(wall, backwards, origin) for wall in probes.walls),
        integrated=turned(np.where(seen.held, 0, probes.integrated)),
        image_gap=_image_gap(probes),
        image_force=seen.image_force,
        fixes=tuple(
            replace(
                fix,
                granules=turned(fix.granules),
                largest=turned(fix.largest, 0),
                largest_in_motion=turned(seen.exerted.get(fix.command, 0 * fix.largest), 0),
            )
            for fix in applied.fixes
        ),
        runs=tuple(seen.runs),
        applied_time=applied.time,
        applied_force=sign * turned(applied.force),
        applied_sideways=applied.sideways,
        peak_force=peaks.force,
        peak_reading_error=peaks.error,
        missed_overlap=peaks.missed,
        driven=turned(seen.driven),
        driven_time=seen.driven_time[led],
        driven_displacement=sign
        * (seen.driven_ends[led, -1 if backwards else 0] - origin),
        end_time=seen.time,
        final_position=places(seen.position),
        final_velocity=sign * turned(seen.velocity),
        remarks=_remarks(seen, probes),
    )  # fmt: skip
    return scaled(found, granules.units)


def _axis(direction: FloatArray) -> str:
    """Return the name of an axis."""
    first = int(np.argmax(np.abs(direction)))
    return "xyz"[first] if abs(direction[first]) == 1 else "a diagonal"


def _is_reversed(probes: Probes, seen: Watched, applied: Applied, scene: Scene | None) -> bool:
    """Whether granule 1 lies at the largest coordinate, by most signs of the shocked end.

    A deck may have one of the signs wrong. In a tie, granule 1 has the lowest id.
    """
    granules = probes.granules
    is_pushed = scene is None or bool(scene.ramps)
    shocked, pushed = _shocked(probes, seen, applied, is_pushed)
    half = 1.0  # a shock on another granule than the first may be in the far half
    if scene is not None and scene.shock.granule > 1:
        half = float(np.sign((scene.chain.granules + 1) / 2 - scene.shock.granule))
    walls = [wall.end for wall in probes.walls]
    signs = [
        half * _middle(shocked), -pushed, float(walls == ["first"]) - float(walls == ["last"]),
        0.0 if scene is None else _misfit(granules, scene, 1) - _misfit(granules, scene, -1),
        # Weight and loads push towards the far end.
        0.0 if scene is None or scene.precompression is None else -np.sum(applied.constant[:, 0]),
    ]  # fmt: skip
    first, last = granules.ids[granules.order[[0, -1]]]
    return bool(np.sum(np.sign(signs)) + 0.5 * np.sign(float(first - last)) > 0)


def _shocked(
    probes: Probes, seen: Watched, applied: Applied, is_pushed: bool
) -> tuple[FloatArray, float]:
    """Return the weight of the shock on each granule, shape (granules,), and its sign.

    If no force pushes the chain in its scene, the shock is where granules move, if any do.
    """
    acts, velocity = np.abs(applied.force), probes.granules.velocity[:, 0]
    if np.any(acts) and applied.time.size > 1 and (is_pushed or not np.any(velocity)):
        impulse = np.diff(applied.time) @ (acts[1:] + acts[:-1])
        begun = int(np.argmax(acts.max(axis=1) > _BEGUN * acts.max()))
        return impulse, float(np.sum(applied.force[begun]))
    if np.any(seen.driven) and seen.driven_time.size:
        way = seen.driven_ends[:, 0 if seen.driven[0] else -1]
        return seen.driven.astype(np.float64), float(np.mean(way - way[0]))
    return np.abs(velocity), float(np.sum(velocity))


_BEGUN = 1e-3  # fraction of the largest force that is above round-off (chosen)


def _middle(weight: FloatArray) -> float:
    """Return on which side of the chain's middle most of a weight is: below 0 near the start."""
    place = np.linspace(-1, 1, weight.size) if weight.size > 1 else np.zeros(1)
    middle = float(np.sum(weight * place))
    return middle if abs(middle) > _EVEN * float(np.sum(np.abs(weight))) else 0.0


_EVEN = 1e-6  # of all weight: a middle within round-off and equal granules (chosen)


def _misfit(granules: Granules, scene: Scene, step: int) -> float:
    """Misfit of the deck's granules with the scene's, relative to a median, from either end on."""
    if granules.count != scene.chain.granules:
        return 0.0
    return sum(
        float(np.sum(np.abs(found[::step] / np.median(found) - own / np.nanmedian(own)) > _UNLIKE))
        for found, own in (
            (granules.radius, scene.granules.radius),
            (granules.mass, np.where(np.isinf(scene.granules.mass), np.nan, scene.granules.mass)),
        )
    )  # fmt: skip


_UNLIKE = 1e-2  # relative: granules that differ by less are of one kind (chosen)


def _image_gap(probes: Probes) -> float | None:
    granules = probes.granules
    if not granules.periodic[0]:
        return None
    length = float(granules.high[0] - granules.low[0])
    extent = float(granules.position[-1, 0] - granules.position[0, 0])
    return length - extent - float(granules.radius[0] + granules.radius[-1])


def _wall(wall: FoundWall, backwards: bool, origin: float) -> FoundWall:
    end = {"first": "last", "last": "first"}[wall.end] if backwards else wall.end
    return replace(wall, end=end, position=(-1.0 if backwards else 1.0) * (wall.position - origin))


def _remarks(seen: Watched, probes: Probes) -> tuple[str, ...]:
    remarks = []
    if probes.why_not is not None:
        remarks.append(f"the contacts of the granules were not asked: {probes.why_not}")
    if seen.cleared:
        remarks.append("what follows the clear after the first chain is another chain's")
    return tuple(remarks)
