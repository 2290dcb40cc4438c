"""The first pulse of each contact, which an experiment measures before any reflection.

``observer`` reads first pulses off a run and has their definition.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.errors import require
from hertzchain.observables.samples import DampedLaw
from hertzchain.scene import hertz
from hertzchain.scene.chain import NaturalUnits
from hertzchain.scene.scene import Scene
from hertzchain.scene.terms import Gauge

if TYPE_CHECKING:
    from hertzchain.observables.observer import Watch

LATEST = 8.0
"""The latest end over ``Scene.end_time`` (chosen): three times what light granules between heavy
ones were seen to need."""

WANTED = ("first", "all")
"""Choices of the forces for which the accuracy holds: first pulses, or the largest of a run."""

_Mask = NDArray[np.bool_]
_TIMES = ("time", "arrival", "width", "contact_time")


@dataclass(frozen=True, eq=False)
class FirstPulses:
    """First pulses of signals, (signals,) each, in the units of the run; NaN where none is.

    The signals are all contacts and then, in the results of a run, gauges in granules.

    Parameters
    ----------
    force, time
        Dynamic force of the pulse, and its time.
    arrival
        When the force first reaches half of that.
    width
        From the arrival to the end of the pulse.
    contact_time
        From the closing of the contact to its opening, where both were seen.
    static
        Force of the contacts before it.
    is_front, is_clear
        Whether the pulse ends as a front does; whether it has ended, and is the same for other
        levels at which it ends and from which it counts.
    is_steady
        Whether the force falls steadily at the end, so that the width is well defined.
    """

    force: FloatArray
    time: FloatArray
    arrival: FloatArray
    width: FloatArray
    contact_time: FloatArray
    static: FloatArray
    is_front: _Mask
    is_clear: _Mask
    is_steady: _Mask

    def part(self, some: slice) -> FirstPulses:
        """Return the first pulses of some signals."""
        return FirstPulses(*(getattr(self, field.name)[some] for field in fields(self)))

    @property
    def is_ended(self) -> _Mask:
        """Whether the pulse ended before the run did."""
        return ~np.isnan(self.width)

    @property
    def kind(self) -> NDArray[np.object_]:
        """``pulse``, ``front`` or, where no end was seen, ``unended``; None without a pulse."""
        is_ended = np.where(self.is_ended, "pulse", "unended")
        kind = np.where(self.is_front, "front", is_ended).astype(object)
        kind[np.isnan(self.force)] = None
        return kind

    def only(self, some: _Mask) -> FirstPulses:
        """Return the pulses of some contacts, and none for all others."""
        numbers = {name: np.where(some, getattr(self, name), np.nan) for name in ("force", *_TIMES)}
        masks = {name: getattr(self, name) & some for name in ("is_front", "is_clear", "is_steady")}
        return replace(self, **numbers, **masks)

    def in_units(self, force: float, time: float) -> FirstPulses:
        """Return the same pulses with forces and times multiplied by units."""
        times = {name: getattr(self, name) * time for name in _TIMES}
        return replace(self, force=self.force * force, static=self.static * force, **times)


def pulses_in(watch: Watch | None) -> FirstPulses | None:
    """Return the first pulses at the end of a run that was watched; None where it was not."""
    if watch is None:
        return None
    from hertzchain.observables.observer import read_off

    read_off(watch)
    columns = {name: watch.pulses[name].copy() for name in watch.pulses.dtype.fields or ()}
    return FirstPulses(static=watch.signals["static"].copy(), **columns)


def is_driven_to_the_end(scene: Scene) -> bool:
    """Return whether a force or a moving piston still acts at the end of a run."""
    if strokes := scene.shock.strokes:
        return strokes[-1].velocity != 0 or strokes[-1].start > scene.end_time
    return bool(scene.ramps) and scene.ramps[-1].end > scene.end_time


def contacts_of(scene: Scene, gauge: Gauge) -> list[int]:
    """Place of a gauge's contact, or of both contacts of its granule (one at a free end)."""
    numbers = (gauge.number, *([] if gauge.granule is None else [gauge.number + 1]))
    return [scene.contacts.index(number) for number in numbers if number in scene.contacts]


@dataclass(frozen=True, eq=False)
class Signals:
    """The signals of a scene: its contacts, then gauges in granules, in the units of a run."""

    law: DampedLaw
    static: FloatArray  # force of each contact at the start, (contacts,)
    slowness: FloatArray  # time unit times F^(1/6) of each contact; 0 where the drive has ended
    places: tuple[tuple[int, int], ...]  # the two contacts of each gauge in a granule, -1 for none

    @classmethod
    def of(cls, scene: Scene) -> Signals:
        """Return the signals of a scene in SI units."""
        granules = scene.granules
        time = hertz.slowness(granules.stiffness, granules.contact_mass)
        if not is_driven_to_the_end(scene):
            time = np.zeros_like(time)
        in_granules = (gauge for gauge in scene.gauges if gauge.granule is not None)
        pairs = ((*contacts_of(scene, gauge), -1) for gauge in in_granules)
        places = tuple((pair[0], pair[1]) for pair in pairs)
        return cls(DampedLaw.of(scene), granules.static_force, time, places)

    def in_units(self, units: NaturalUnits) -> Signals:
        """Return the same with all quantities in other units."""
        slowness = self.slowness / (units.time * units.force ** (1 / 6))
        law, static = self.law.in_units(units), self.static / units.force
        return replace(self, law=law, static=static, slowness=slowness)

    def watch(self, unit: float = 1.0) -> Watch:
        """Return a watch for a run in these units; ``unit`` is the natural unit of force."""
        from hertzchain.observables.observer import LEAST, watch_of

        signals = self.law.signals(self.static, self.places)
        signals["least"] = LEAST * (unit + signals["static"])
        signals["slowness"][: self.slowness.size] = self.slowness
        signals["above"] = signals["static"] + signals["least"]
        signals["below"] = -np.inf
        return watch_of(signals, self.static.size)


def check_wanted(wanted: str | None) -> None:
    """Raise a SceneError for what is neither None nor in ``WANTED``."""
    allowed = f"must be one of {', '.join(WANTED)}, or left out"
    require(wanted is None or wanted in WANTED, "wanted", wanted, allowed)


def usually_wanted(scene: Scene) -> str:
    """Return the default of ``wanted`` for a scene.

    It is first pulses where waves are reflected within the chain, and for gauges; elsewhere it is
    the largest forces.
    """
    return "first" if reflects(scene) or scene.gauges else "all"


def reflects(scene: Scene) -> bool:
    """Return whether a striker, a wall or unlike granules reflect waves within the chain.

    Granules that move at the start, or a shock within the chain, may send several waves.
    """
    has_end = scene.striker is not None or scene.wall is not None or scene.moves or scene.holds
    return has_end or not {"unlike granules", "local shock"}.isdisjoint(scene.terms)


def finds_end(scene: Scene) -> bool:
    """Return whether a run of a scene finds its end itself: by default, where waves are reflected.

    Where the drive acts as long as a run goes on, pulses may not end: it ends at
    ``Scene.end_time``.
    """
    return scene.run.end_time is None and reflects(scene) and not is_driven_to_the_end(scene)


def usual_end(scene: Scene) -> float:
    """Return the end of a run if contacts are never pressed, natural units.

    NaN where the scene gives its end.
    """
    return scene.end_time / scene.units.time if finds_end(scene) else math.nan
