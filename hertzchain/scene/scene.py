"""A scene: a chain, its shock, its wall and loads, and the duration of the run."""

from __future__ import annotations

import copy
import functools
import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.contact import hertz
from hertzchain.errors import SceneError, require
from hertzchain.scene.chain import MATERIAL, MOST_UNLIKE, Chain
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.granules import Granules, granules_of, like_granules
from hertzchain.scene.keys import Positive
from hertzchain.scene.moving import Moving
from hertzchain.scene.natural_units import (
    MOMENTUM_IN_NATURAL_UNITS,
    NaturalUnits,
    length_and_time,
)
from hertzchain.scene.numbered import Numbered
from hertzchain.scene.piston import Piston
from hertzchain.scene.pulse import Pulse
from hertzchain.scene.ramp import Ramp, impulse_until
from hertzchain.scene.reading import read_parts, texts_of
from hertzchain.scene.run import Run
from hertzchain.scene.schedule import Leg, lay_steps, lay_strokes
from hertzchain.scene.shock import Shock
from hertzchain.scene.striker import Striker
from hertzchain.scene.terms import ALL_TERMS, Contact, Precompression, Wall
from hertzchain.scene.together import is_representable, refuse_impossible
from hertzchain.scene.uncertain import Uncertain
from hertzchain.scene.watching import (
    squeezing_force,
    watched_time,
    watched_with_terms,
    weakest_start,
)
from hertzchain.showing import Shown


@dataclass(frozen=True, repr=False)
class Scene(Numbered, Shown):
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
        refuse_impossible(self)
        allowed = f"must be at most {MOST_UNLIKE} in a scene with {', '.join(self.terms)}"
        possible = self.is_plain or self.chain.granules <= MOST_UNLIKE
        require(possible, "chain.granules", self.chain.granules, allowed)
        allowed = (
            "its mass, contact time or duration is too large or too small to be"
            " represented; check the units of chain and shock"
        )
        try:
            with np.errstate(all="ignore"):
                representable = is_representable(self)
        except (OverflowError, ZeroDivisionError):
            representable = False
        require(representable, "scene", None, allowed)

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
        path = Path(path)
        parts = read_parts(path)
        try:
            return cls(**parts)
        except SceneError as problem:
            raise SceneError(problem.key, problem.value, problem.allowed, path) from None

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
            any(isinstance(getattr(chain, key), tuple) for key in MATERIAL),
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
        return tuple(itertools.compress(ALL_TERMS, present))

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

        In a scene with terms L_SW is computed for a uniform chain of the contact ahead of the
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
        own = shock.compared_impulse
        return self.impulse if own is None else own

    @property
    def _moved(self) -> float:
        """Sum of the momenta of all granules at the start, all as positive [N s]."""
        return 0.0 if self.is_plain else float(np.sum(np.abs(self.granules.moved)))

    @functools.cached_property
    def ramps(self) -> tuple[Ramp, ...]:
        """The applied force as ramps between its corners [s, N]; none for a striker or piston."""
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
        return impulse_until(self.ramps, self.end_time)

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
            pushes = [(self._shock_units, ratio, momentum, self.pushed_mass)]
        if self.force_at_start > 0:
            pushes.append(weakest_start(self.granules, *self.first_contact, self.force_at_start))
        wall, each = self.wall is not None or self.holds, self.granules.as_if_free
        return self.pulse_end + max(watched_with_terms(each, *push, wall=wall) for push in pushes)

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
        return self.shock.force_at(time, self.ramps)

    def schedule(self, dt: Positive) -> tuple[Leg, ...]:
        """Return a run's steps of at most ``dt`` [s]; steps end at the shock's corners."""
        if strokes := self.shock.strokes:
            return lay_strokes(strokes, self.end_time, dt)
        return lay_steps(self.ramps, self.end_time, dt)
