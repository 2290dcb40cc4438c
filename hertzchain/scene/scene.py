"""A scene: a chain, its shock, its wall and loads, and the duration of its run."""

from __future__ import annotations

import copy
import functools
import itertools
import math
import os
import sys
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray, Quantity
from hertzchain.errors import OverlapTooLarge, RunFailed, SceneError, require
from hertzchain.scene import hertz
from hertzchain.scene.chain import (
    MATERIAL,
    MEASURED,
    MOMENTUM_IN_NATURAL_UNITS,
    MOST_UNLIKE_GRANULES,
    Chain,
    Granules,
    NaturalUnits,
    length_and_time,
    like_granules,
)
from hertzchain.scene.file import OTHERS, key_named, read_parts, texts_of
from hertzchain.scene.keys import Positive, keys_of
from hertzchain.scene.schedule import (
    Leg,
    Push,
    Run,
    lay_steps,
    squeezing_force,
    watched_time,
    watched_with_terms,
    weakest_push,
)
from hertzchain.scene.shocks import (
    Moving,
    Piston,
    Pulse,
    PulseTable,
    Ramp,
    Shock,
    Sine,
    Striker,
)
from hertzchain.scene.terms import (
    ALL_TERMS,
    DAMPING,
    WALLS,
    Contact,
    Gauge,
    Precompression,
    Uncertain,
    Wall,
    granules_of,
)
from hertzchain.shown import Shown


def _refusals(scene: Any) -> Iterator[tuple[Any, str, object, str]]:  # noqa: PLR0915 - a list
    """Yield reasons to refuse a scene: whether it applies, key, value, what is allowed.

    A later reason may assume that no earlier one applies.
    """
    chain: Chain = scene.chain
    shock: Shock = scene.shock
    pressed, contact, granules = scene.precompression, scene.contact, scene.chain.granules
    force = 0.0 if pressed is None else pressed.force
    both = {"wall": scene.wall, "near_wall": scene.near_wall}
    walls: dict[str, Wall] = {name: wall for name, wall in both.items() if wall is not None}
    allowed = "must be at least 2 without a wall: a single granule needs [wall] or [near_wall]"
    yield granules == 1 and not walls, "chain.granules", 1, allowed
    behind = shock.is_driven or (pressed is not None and shock.loaded_granule > 0)
    allowed = f"must be at least 2: the {shock.noun} is granule 1, and granule 2 is pressed"
    yield granules == 1 and behind, "chain.granules", 1, allowed

    for name, value in shock.material.items():
        allowed = "leave it out: [chain] or its first segment describes a measured granule 1"
        yield chain.is_measured, f"striker.{name}", value, allowed
    parts: dict[str, Any] = {"chain": chain, **walls} if scene.measures_contacts else {}
    for section, part in parts.items():
        strength = part.yield_strength
        allowed = "needs the pressure, which no measured stiffness tells: leave it out"
        yield strength is not None, f"{section}.yield_strength", strength, allowed
    for section, wall in walls.items():
        is_measured = chain.stiffness is not None
        allowed = "needs the granule's material, which chain.stiffness replaces: give stiffness"
        yield wall.kind is not None and is_measured, f"{section}.kind", wall.kind, allowed
        allowed = f"missing, must be one of {', '.join(WALLS)}; or give stiffness"
        is_known = wall.stiffness is not None or (is_measured and section == "near_wall")
        yield wall.kind is None and not is_known, f"{section}.kind", None, allowed

    for gauge in scene.gauges:
        gauge.check(granules, *(wall is not None for wall in both.values()))
        allowed = "has two gauges: leave one out"
        yield scene.gauges.count(gauge) > 1, f"gauge.{gauge.key}", gauge.number, allowed
    names = [entry.name for entry in scene.uncertain]
    for name in names:
        yield names.count(name) > 1, name, None, "is uncertain twice: delete one of them"
    for entry in scene.uncertain:
        absent = entry.each and getattr(chain, entry.key.partition(".")[2]) is None
        yield absent, entry.name, None, "has no value in [chain] that could scatter"
    for section, wall in walls.items():
        for name, value in wall.own_damping.items():
            law = next(law for law, parameter in DAMPING.items() if parameter == name)
            allowed = f'needs [contact] damping = "{law}", whose {name} is that of other contacts'
            differs = contact is None or contact.damping != law
            yield differs, f"{section}.{name}", value, allowed

    allowed = f"leave it out: granule 1 is the {shock.noun}, and nothing stands behind it"
    yield "near_wall" in walls and shock.impact_velocity is not None, "near_wall", None, allowed
    allowed = f"must be at most {granules}, the granules of the chain"
    yield shock.granule > granules, "shock.granule", shock.granule, allowed
    fixed = np.broadcast_to(chain.fixed, granules)
    velocity = np.broadcast_to(chain.velocity, granules)
    for k in [] if chain.fixed is False else np.flatnonzero(fixed).tolist():
        is_before = fixed[k + 1] if k + 1 < granules else "wall" in walls
        is_pushed = k == shock.granule - 1 and not isinstance(shock, Moving)
        is_loaded = k == shock.loaded_granule and force > 0 and "near_wall" not in walls
        for applies, allowed in (
            (k == 0 and "near_wall" in walls, "is next to the near wall: free it"),
            (is_before, "is next to what does not move either: free one of them"),
            (velocity[k] != 0, "has a velocity at the start: leave out one of both"),
            (is_pushed, f"must not be fixed: the {shock.noun} moves it"),
            (is_loaded, "must not be fixed: the static load presses it"),
        ):
            yield applies, f"fixed granule {k + 1}", None, allowed
    yield from _no_collisions(chain, shock, walls)
    load = 0.0 if fixed[: shock.granule].any() else force
    allowed = (
        f"must be at most the static load, [precompression] force = {load:g} N: an actuator"
        " pushes its granule, and cannot pull it"
    )
    amplitude = shock.amplitude if isinstance(shock, Sine) else 0.0
    yield amplitude > load, "shock.amplitude", amplitude, allowed
    is_loaded = isinstance(shock, Striker) and shock.loaded and pressed is None
    allowed = "needs [precompression]: leave it out for a striker in a chain without a static load"
    yield is_loaded, "striker.loaded", None, allowed

    if pressed is not None:
        carried = not pressed.gravity or "wall" in walls or fixed[-1]
        allowed = "needs a [wall], or a fixed last granule, which carries the weight of the chain"
        yield not carried, "precompression.gravity", pressed.gravity, allowed
        allowed = "must be 0 with [precompression], which presses all contacts from the start"
        yield chain.gap != 0, "chain.gap", None, allowed
        for section, wall in walls.items():
            yield wall.gap != 0, f"{section}.gap", wall.gap, allowed
    allowed = f"must be at most {MOST_UNLIKE_GRANULES} in a scene with {', '.join(scene.terms)}"
    too_many = not scene.is_plain and granules > MOST_UNLIKE_GRANULES
    yield too_many, "chain.granules", granules, allowed
    allowed = (
        "its mass, contact time or duration is too large or too small to be represented; check"
        " the units of chain and shock"
    )
    yield not _is_representable(scene), "scene", None, allowed


def _no_collisions(
    chain: Chain, shock: Shock, walls: Collection[str]
) -> Iterator[tuple[bool, str, None, str]]:
    """Yield reasons to refuse velocities at the start with which no granules collide.

    A load that would make them meet later is not enough: the first collision is the unit of force.
    """
    if not isinstance(shock, Moving | Striker):
        return
    along = chain.velocity if isinstance(chain.velocity, tuple) else (chain.velocity,) * 2
    allowed = (
        "missing section: give [shock], [striker] or a velocity of granules, in [chain],"
        " [[chain.segments]] or their table"
    )
    yield isinstance(shock, Moving) and not any(along), "[shock]", None, allowed
    if isinstance(shock, Striker):
        along = (shock.velocity, *along[1:])
    along = (*[0.0] * ("near_wall" in walls), *along, *[0.0] * ("wall" in walls))
    allowed = (
        "with these no granule meets another or a wall, which some must do, also under a load:"
        " a positive velocity is towards the far end"
    )
    never = not any(behind > ahead for behind, ahead in pairwise(along))
    yield never, "velocities at the start", None, allowed


def _are_normal(*values: Quantity) -> bool:
    """Return whether all numbers are positive and normal, so that they lose no digits."""
    edges = (
        (value,) if isinstance(value, float) else (np.min(value), np.max(value)) for value in values
    )
    return all(sys.float_info.min <= edge < math.inf for pair in edges for edge in pair)


def _is_representable(scene: Any) -> bool:
    """Return whether all quantities of a scene, and intermediate results, are normal numbers.

    Infinite masses, of a piston and of fixed granules, are allowed. Every divisor is checked before
    it is used.
    """
    with np.errstate(all="ignore"), suppress(OverflowError, ZeroDivisionError):
        force, spheres = scene.peak_force, scene.chain if scene.is_plain else scene.granules
        if scene.is_plain:
            masses, stiffness = [spheres.granule_mass], spheres.contact_stiffness
        else:
            masses = [spheres.mass[np.isfinite(spheres.mass)], spheres.contact_mass]
            stiffness = spheres.stiffness
        of_spheres = (spheres.radius**3, *masses, spheres.young_modulus / 3, stiffness, force)
        if not _are_normal(*of_spheres) or not _are_normal(force / stiffness):
            return False
        mass, units = scene.first_contact[1], scene.units
        of_units = (units.length, mass * units.length, units.time**2, units.velocity)
        if not _are_normal(*of_units, units.momentum, units.energy):
            return False
        times = [ramp.end for ramp in scene.ramps[:1]]
        return _are_normal(scene.momentum_ratio, *times, scene.end_time)
    return False


@dataclass(frozen=True, repr=False)
class Scene(Shown):
    """One shock on one chain.

    Parameters
    ----------
    chain
        The granules.
    shock
        Force on a granule, or the striker or piston that granule 1 is; left out where granules of
        the chain move at the start.
    run
        Duration of the run.
    wall, near_wall
        Walls at the far end and before granule 1; None for a free end.
    precompression
        Constant forces; None for a chain without static load.
    contact, gauges
        Damping in the contacts, None for elastic ones; sensors, which change nothing.
    uncertain
        Values that are not known exactly, and scatter; they change nothing in a single run.

    Raises
    ------
    SceneError
        If a part is of another type, or if its numbers together leave the range of floating point
        or lose digits there.
    """

    chain: Chain
    shock: Shock = Moving()  # noqa: RUF009 - it is frozen
    run: Run = Run()  # noqa: RUF009 - it is frozen
    wall: Wall | None = None
    precompression: Precompression | None = None
    contact: Contact | None = None
    gauges: tuple[Gauge, ...] = ()
    uncertain: tuple[Uncertain, ...] = ()
    near_wall: Wall | None = None

    def __post_init__(self) -> None:
        for applies, key, value, allowed in _refusals(self):
            require(not applies, key, value, allowed)

    @classmethod
    def from_toml(cls, path: Path | str) -> Scene:
        """Read a scene file.

        Parameters
        ----------
        path
            A TOML file: chain, shock or striker and, optionally, wall, near_wall, precompression,
            contact, gauge, uncertainty, scatter and run. Bare numbers are SI, strings carry units.

        Raises
        ------
        SceneError
            If the file cannot be read, is not TOML, or does not describe a possible scene; it
            names file, key, value and what is allowed.
        """
        try:
            return cls(**read_parts(Path(path)))
        except SceneError as problem:
            raise problem.in_file(Path(path)) from None

    def to_toml(self, path: Path | str) -> None:
        """Write a scene file that reads back as an equal scene, with its tables next to it.

        Parameters
        ----------
        path
            The TOML file. A pulse table is written next to it as ``<name>.csv``, unlike granules as
            ``<name>.granules.csv``. OutputError if a file cannot be written; then none is.
        """
        from hertzchain.files import write_texts

        write_texts(self.to_texts(path))

    def to_texts(self, path: Path | str) -> dict[Path, str]:
        """Texts that ``to_toml`` writes, by path: first tables, if any, then the TOML."""
        return texts_of(Path(path), self)

    @functools.cached_property
    def terms(self) -> tuple[str, ...]:
        """Names of all that the scene has beyond a uniform chain with free ends under one pulse."""
        chain, pressed = self.chain, self.precompression
        present = (
            chain.granules == 1,
            any(isinstance(getattr(chain, key), tuple) for key in (*MATERIAL, *MEASURED)),
            chain.is_measured or self.measures_contacts,
            isinstance(chain.gap, tuple) or chain.gap > 0,
            self.striker is not None,
            self.piston is not None,
            self.shock.granule > 1,
            self.moves,
            self.chain.fixed is not False,
            self.wall is not None,
            self.near_wall is not None,
            pressed is not None and pressed.force > 0,
            pressed is not None and pressed.gravity > 0,
            self.contact is not None,
        )
        return tuple(term for term, has in zip(ALL_TERMS, present, strict=True) if has)

    @property
    def first_granule(self) -> int:
        """Place of granule 1 in ``granules``: 0, or 1 behind a near wall."""
        return 0 if self.near_wall is None else 1

    @property
    def bodies(self) -> int:
        """Number of entries of ``granules``: N, or N + 1 with a near wall."""
        return self.chain.granules + (self.near_wall is not None)

    @property
    def unit_contact(self) -> int:
        """Place of contact 2 in arrays of contacts; of contact 1 where it is the only one."""
        return min(self.first_granule, len(self.contacts) - 1)

    @property
    def pushed(self) -> int:
        """Place in ``granules`` of the granule on which the force acts."""
        return self.shock.granule - 1 + self.first_granule

    @property
    def contacts(self) -> range:
        """Numbers of the contacts: from 2, or 1 with a near wall, to N, or N + 1 with a wall."""
        return range(2 - self.first_granule, self.chain.granules + 1 + (self.wall is not None))

    @property
    def last_contact(self) -> int:
        """Number of the last contact, N, or N + 1 with a wall."""
        return self.contacts[-1]

    def contact_label(self, contact: int) -> str:
        """Return what a table calls a contact: its number, or the wall."""
        name = self.contact_name(contact)
        return str(contact) if name.startswith("contact") else name.removeprefix("the ")

    def contact_name(self, contact: int) -> str:
        """Return what a sentence calls a contact."""
        if contact < 2:
            return "the near wall"
        return "the wall" if contact > self.chain.granules else f"contact {contact}"

    @property
    def measures_contacts(self) -> bool:
        """Whether the stiffness of a contact was measured, so that it has no known curvature."""
        parts = self.chain, self.wall, self.near_wall
        return any(part is not None and part.stiffness is not None for part in parts)

    @property
    def is_plain(self) -> bool:
        """True without terms; known error constants, the map and the paper hold only then."""
        return not self.terms

    @property
    def pulse(self) -> Pulse | None:
        """The pulse; None for a shock other than the paper's three pulses."""
        return self.shock if isinstance(self.shock, Pulse) else None

    @property
    def striker(self) -> Striker | None:
        """The striker, or None where a force pushes granule 1."""
        return self.shock if isinstance(self.shock, Striker) else None

    @property
    def moves(self) -> bool:
        """Whether granules of the chain move at the start, besides a striker or piston."""
        return isinstance(self.chain.velocity, tuple) or self.chain.velocity != 0

    @property
    def holds(self) -> bool:
        """Whether ``granules`` has fixed ones."""
        return self.chain.fixed is not False or self.near_wall is not None

    @property
    def piston(self) -> Piston | None:
        """The piston, or None where granule 1 is free."""
        return self.shock if isinstance(self.shock, Piston) else None

    @functools.cached_property
    def granules(self) -> Granules:
        """All granules and contacts, with striker or piston, walls, precompression and damping.

        A near wall is a fixed granule in front of granule 1: see ``first_granule``.
        """
        if self.is_plain:
            return like_granules(self.chain)
        return granules_of(
            self.chain, self.shock, self.wall, self.precompression, self.contact, self.near_wall
        )

    @property
    def held_load(self) -> float:
        """Force that holds a free last granule under a static load [N]; 0 where none does."""
        is_held = self.wall is not None or self.chain.fixed is not False
        return 0.0 if is_held or self.precompression is None else self.precompression.force

    @functools.cached_property
    def _shock_units(self) -> NaturalUnits:
        """Natural units of the contact ahead of the pushed granule, by the shock alone."""
        pushed = self.pushed
        stiffness, mass = self.granules.ahead_of(pushed) if pushed else self.first_contact
        return NaturalUnits(self.peak_force, *length_and_time(stiffness, mass, self.peak_force))

    @property
    def first_contact(self) -> tuple[float, float]:
        """A [N m^(-3/2)] and 2 m* [kg] of contact 2; A and m in a uniform chain."""
        if self.is_plain:  # without a list of all granules, which may be many
            return self.chain.contact_stiffness, self.chain.granule_mass
        return self.granules.ahead_of(self.first_granule)

    @functools.cached_property
    def peak_force(self) -> float:
        """Largest applied force [N]; for a striker or piston the peak of its first contact alone.

        For a piston this is the peak if it hits granule 2 with its largest speed; where only
        granules of the chain move, it is the largest peak force of their collisions.
        """
        shock: Any = self.shock
        if isinstance(shock, Moving):
            return self.force_at_start
        if shock.impact_velocity is None:
            return float(shock.peak_force)
        stiffness, mass = self.first_contact
        return float(hertz.impact_force(stiffness, mass / 2, shock.impact_velocity))

    @functools.cached_property
    def force_at_start(self) -> float:
        """Largest peak of contacts that close at the start, each alone [N]; 0 where none does."""
        return self.granules.force_at_start if self.moves else 0.0

    @functools.cached_property
    def units(self) -> NaturalUnits:
        """Natural units of the first contact under the largest force known before the run.

        This force is the shock's, the largest static force, that of a chain pressed against a wall
        by a piston, or that of granules that move at the start.
        """
        force = max(self.peak_force, self.force_at_start)
        if self.precompression is not None:
            force = max(force, float(np.max(self.granules.static_force)))
        if self.piston is not None and (self.wall is not None or self.holds):
            force = max(force, squeezing_force(self.granules, self.piston, self.end_time))
        if force == self.peak_force and self.shock.granule == 1:
            return self._shock_units
        stiffness, mass = self.first_contact
        return NaturalUnits(force, *length_and_time(stiffness, mass, force))

    @functools.cached_property
    def contact_time(self) -> float:
        """Natural unit of time of the fastest contact [s]; steps are given in this unit."""
        if self.is_plain:
            return self.units.time
        granules, force = self.granules, self.units.force
        fastest = np.min(hertz.slowness(granules.stiffness, granules.contact_mass))
        return float(fastest) * math.pow(force, -1 / 6)

    @property
    def rise_time(self) -> float | None:
        """Rise time t0 [s]; None for a shock other than the three pulses."""
        if (pulse := self.pulse) is None:
            return None
        if pulse.rise_time is not None:
            return pulse.rise_time
        assert pulse.momentum_ratio is not None
        return pulse.momentum_ratio * self._unit_rise_time(pulse)

    @property
    def momentum_ratio(self) -> float:
        """LM_ratio, the impulse over L_SW(F0), always with the paper's 139/32.

        Beyond a uniform chain L_SW is computed for a uniform chain of the contact ahead of the
        pushed granule, and F0 is the ``peak_force``. The impulse of a sine is that of half a cycle;
        the impulse of a piston is the momentum that a collision at its largest velocity gives
        granule 2; where only granules of the chain move, it is the sum of their momenta, all as
        positive.
        """
        if (pulse := self.pulse) is None:
            return self._shock_momentum / self._unit_momentum
        if pulse.momentum_ratio is not None:
            return pulse.momentum_ratio
        assert pulse.rise_time is not None
        return pulse.rise_time / self._unit_rise_time(pulse)

    def _unit_rise_time(self, pulse: Pulse) -> float:
        """t0_hat [s]: the rise time at which the impulse is L_SW(F0). The area is F0 n t0 / 2."""
        return 2 * self._unit_momentum / (pulse.duration_ratio * pulse.peak_force)

    @property
    def _unit_momentum(self) -> float:
        """L_SW of a solitary wave of height F0 [N s]: the momentum at LM_ratio = 1."""
        return MOMENTUM_IN_NATURAL_UNITS * self._shock_units.momentum

    @property
    def _shock_momentum(self) -> float:
        """Momentum of the shock in LM_ratio [N s]."""
        shock = self.shock
        if self.piston is not None:
            return self.first_contact[1] * self.piston.impact_velocity
        if shock.start_velocity > 0:  # a striker
            return self.pushed_mass * shock.start_velocity
        if isinstance(shock, Moving):
            return self._moved
        impulse = shock.compared_impulse
        return self.impulse if impulse is None else impulse

    @property
    def _moved(self) -> float:
        """Sum of the momenta of all granules at the start, all as positive [N s]."""
        return 0.0 if self.is_plain else float(np.sum(np.abs(self.granules.moved)))

    @functools.cached_property
    def ramps(self) -> tuple[Ramp, ...]:
        """The applied force as ramps between its corners [s, N]; empty for a striker or piston."""
        pulse = self.pulse
        return self.shock.ramps() if pulse is None else pulse.ramps(self.rise_time)

    @property
    def pulse_end(self) -> float:
        """End of the force, or of a piston's last change of velocity [s]; 0 for a striker."""
        if strokes := self.shock.strokes:
            return strokes[-1].start
        return self.ramps[-1].end if self.ramps else 0.0

    @property
    def impulse(self) -> float:
        """Integral of the whole applied force over time [N s]."""
        return math.fsum(ramp.impulse for ramp in self.ramps)

    @functools.cached_property
    def applied_impulse(self) -> float:
        """Integral of the applied force over time, up to the end of the run [N s]."""
        end = self.end_time  # asked for once: a table may have many rows
        return math.fsum(
            ramp.impulse if ramp.end <= end else ramp.impulse_until(end)
            for ramp in self.ramps
            if ramp.start < end
        )

    @property
    def pushed_mass(self) -> float:
        """Mass of the granule that the shock pushes or is [kg]; infinite for a piston."""
        return float(self.granules.mass[self.pushed])

    @property
    def _constant_force(self) -> FloatArray:
        return np.zeros(1) if self.precompression is None else self.granules.constant_force

    @property
    def largest_impulse(self) -> float:
        """Sum of all impulses forwards and of momenta at the start [N s]; no momentum is larger."""
        constant = float(np.sum(np.maximum(self._constant_force, 0.0)))
        if self.near_wall is not None and self.precompression is not None:
            constant += float(self.granules.static_force[0])
        return abs(self.applied_impulse) + self._moved + constant * self.end_time

    @property
    def given_impulse(self) -> float:
        """Momentum at the start and all impulses except those of wall and piston [N s]."""
        moved = 0.0 if self.is_plain else float(np.sum(self.granules.moved))
        constant = float(np.sum(self._constant_force))
        return self.applied_impulse + moved + constant * self.end_time

    @functools.cached_property
    def end_time(self) -> float:
        """End of the run [s], as given, or else the latest end that a run has by default."""
        if self.run.end_time is not None:
            return self.run.end_time
        if self.is_plain:
            watched = watched_time(self.chain.granules, self.momentum_ratio)
            return self.ramps[-1].end + float(watched) * self.units.time
        pushes = []
        if not isinstance(self.shock, Moving):
            ratio, momentum = self.momentum_ratio, self._shock_momentum
            if ratio < (least := self.shock.least_ratio):
                ratio, momentum = least, least * self._unit_momentum
            pushes = [Push(self._shock_units, ratio, momentum, self.pushed_mass)]
        if self.force_at_start > 0:
            pushes.append(weakest_push(self.granules, *self.first_contact, self.force_at_start))
        wall, each = self.wall is not None or self.holds, self.granules.as_if_free
        return self.pulse_end + max(watched_with_terms(each, push, wall) for push in pushes)

    def until(self, end_time: float) -> Scene:
        """Return the scene with another end of its run [s]; what was derived of it is kept."""
        scene = copy.copy(self)
        object.__setattr__(scene, "run", Run(end_time))
        depends = ["end_time", "applied_impulse"]
        if self.piston is not None:  # its unit of force is that at the end, before a wall
            depends += ["units", "contact_time"]
        for name in depends:
            scene.__dict__.pop(name, None)
        return scene

    def applied_force(self, time: FloatArray) -> FloatArray:
        """F(t) [N] at any times [s], also before and after the pulse; shape of ``time``."""
        shock = self.shock
        if isinstance(shock, PulseTable):  # fast also for many rows
            return np.interp(time, shock.time, shock.force, left=0.0, right=0.0)
        force = np.zeros_like(time, np.float64)
        for ramp in self.ramps:
            inside = (time >= ramp.start) & (time < ramp.end)
            force = np.where(inside, ramp.force(time), force)
        return force

    def schedule(self, dt: Positive) -> tuple[Leg, ...]:
        """Return a run's steps of at most ``dt`` [s]; steps end at the shock's corners."""
        return lay_steps(self.ramps, self.end_time, dt, self.shock.strokes)


SceneLike = Scene | str | os.PathLike[str]
"""A scene, or the path of a scene file."""


def to_scene(given: SceneLike) -> Scene:
    """Return the scene, read from its file where a path is given."""
    return given if isinstance(given, Scene) else Scene.from_toml(os.fspath(given))


def unusual_values(scene: Scene) -> list[str]:
    """Return values that may have a wrong unit, each with its key and the usual range."""
    parts: dict[str, Any] = {"chain": scene.chain, scene.shock.section: scene.shock}
    parts |= {name: getattr(scene, name) for name in OTHERS}
    values = {
        f"{name}.{key}": getattr(part, key)
        for name, part in parts.items()
        if part is not None
        for key in keys_of(type(part))
    }
    if scene.shock.rows and scene.ramps:  # the forces of a table are not keys
        values["shock.peak_force"] = scene.peak_force
    return [*filter(None, itertools.starmap(unusual, values.items()))]


def unusual(name: str, values: Any) -> str | None:
    """Return the first value of a parameter that may have a wrong unit, with the usual range.

    None where there is none: zero, None and keys without a usual range are never one.
    """
    key = key_named(name)
    if key is None or key.usual is None:
        return None
    low, high = key.usual
    given = np.atleast_1d(np.asarray(values, np.float64))
    size = np.abs(given[given != 0])  # None becomes NaN, which no range excludes
    outside = size[(size < low) | (size > high)]
    if not outside.size:
        return None
    unit = key.unit
    return f"{name} = {outside[0]:g} {unit} (usually {low:g} to {high:g} {unit})"


DOUBTFUL_OVERLAP = 0.01
"""Overlap over radius above which Hertz's law is no longer exact: it needs a contact radius a far
below R (Johnson, Contact Mechanics, 1985, section 4.2). With a^2 = R overlap / 2, a is 0.07 R here,
and corrections to the law are of the order of the overlap over the radius."""

IMPOSSIBLE_OVERLAP = 1.0
"""Overlap over radius above which results are meaningless."""


def overlap_ratio(chain: Chain, peak_force: float) -> float:
    """Overlap of a contact under a force [N], over the radius R (Eq. 1 solved for the overlap)."""
    return float(math.pow(peak_force / chain.contact_stiffness, 2 / 3) / chain.radius)


def largest_overlap_ratio(scene: Scene, peak_force: FloatArray) -> float:
    """Return the largest overlap under the peaks of all contacts [N], over the smaller radius.

    The forces have the shape (contacts,); a wall's is the last.
    """
    if scene.is_plain:
        return overlap_ratio(scene.chain, float(peak_force.max()))
    granules = scene.granules
    smaller = np.append(np.minimum(granules.radius[:-1], granules.radius[1:]), granules.radius[-1])
    overlap = hertz.overlap_of(granules.stiffness, peak_force)
    return float(np.max(overlap / smaller[: overlap.size]))


def refuse_deep_overlap(ratio: float, where: str = "") -> None:
    """Raise OverlapTooLarge for an overlap ratio at which Hertz's law does not apply."""
    if ratio > IMPOSSIBLE_OVERLAP:
        raise OverlapTooLarge(
            f"{where}the largest overlap would be {ratio:.3g} radii, above {IMPOSSIBLE_OVERLAP:g}:"
            " Hertz's law does not apply there; take a smaller force, larger granules or a stiffer"
            " material"
        )


def refuse_terms(scene: Scene, who: str, supported: Collection[str] = ()) -> None:
    """Raise RunFailed if the scene has terms that a backend does not support."""
    unknown = [term for term in scene.terms if term not in supported]
    if unknown:
        raise RunFailed(
            f"{who} does not support {', '.join(unknown)}: take a scene without, or run it with"
            " native, which has all terms"
        )


def overlap_warning(ratio: float) -> str | None:
    """Return the warning for an overlap ratio; None where no warning is due."""
    if ratio <= DOUBTFUL_OVERLAP:
        return None
    return (
        f"the largest overlap is {ratio:.2g} radii: Hertz's law, which is for overlaps below"
        f" {DOUBTFUL_OVERLAP:g}, is an extrapolation there (Johnson, Contact Mechanics, 1985,"
        " section 4.2)"
    )
