"""The one result of every backend, in SI units, with the definitions of its numbers."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from numbers import Integral
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray, or_none
from hertzchain.contact import hertz
from hertzchain.errors import SceneError, require
from hertzchain.observables.error_bound import SHORTER, ContactErrors, columns
from hertzchain.observables.first_pulse import FirstPulses
from hertzchain.observables.gauges import Reading, Recorded, Train, force_over_time, trains_of
from hertzchain.observables.samples import History
from hertzchain.observables.wave import (
    SolitaryWave,
    Wave,
    is_near_end,
    solitary_wave,
    transition_granules,
    usual_wave,
    wave_between,
)
from hertzchain.scene.file import sections_of
from hertzchain.scene.scene import Scene, largest_overlap_ratio, overlap_warning
from hertzchain.scene.shocks import Moving
from hertzchain.scene.terms import NO_GAUGE
from hertzchain.shown import ShownRun

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Balance:
    """Momentum and energy given to the chain, and those that it has at the end of a run.

    Parameters
    ----------
    impulse
        Integral of the applied force over time, from the scene [N s]; with a striker its momentum,
        with a piston the integral of its force on granule 2, with constant forces their impulse,
        less that on a wall.
    momentum
        Momentum of all granules except a piston at the end [N s].
    work
        Work of the applied force, or of a piston on granule 2, plus the energy at the start [J].
    energy
        Energy at the end [J]: kinetic energy of all granules except a piston, plus 2/5 F overlap
        for each contact, less the work of constant forces.
    dissipated
        Energy that damping of contacts took [J].
    """

    impulse: float
    momentum: float
    work: float
    energy: float
    dissipated: float = 0.0


@dataclass(frozen=True)
class LostDigits:
    """Digits that a code loses to absolute coordinates, and the modulus used to limit the loss.

    Parameters
    ----------
    young_modulus
        Modulus passed to the code [Pa]: the scene's own, or that of a similar scene which loses
        fewer digits and whose results are scaled back.
    predicted
        Relative error of the peaks with the scene's own modulus, estimated before the run.
    bound
        Upper bound of the relative error of the peaks with the modulus used; part of the error
        estimate.
    """

    young_modulus: float
    predicted: float
    bound: float


DEFINITIONS = 2
"""Raised when the definition of a number changes; not when its digits improve."""


def provenance(versions: Mapping[str, str]) -> dict[str, str]:
    """Return versions with those of hertzchain and Python, and the machine."""
    return {
        "hertzchain": version("hertzchain"),
        **versions,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def context_of(scene: Scene) -> dict[str, Any]:
    """Return the scene, contacts and versions that a JSON document contains besides its numbers."""
    return {
        "scene": sections_of(scene),
        "contacts": list(scene.contacts),
        "definitions": DEFINITIONS,
        "hertzchain": version("hertzchain"),
    }


YIELDS_AT = 1.60
"""p0 over Y at which a sphere begins to yield (Johnson, chapter 6)."""


@dataclass(frozen=True)
class LargestPressure:
    """The largest p0 of all contacts, and when.

    Parameters
    ----------
    pressure
        p0, the pressure in the middle of the contact at its peak force [Pa]; NaN where contacts
        were measured.
    contact
        Number of the contact.
    time
        Time of the peak [s]; None if no contact was pressed.
    """

    pressure: float
    contact: int
    time: float | None

    @property
    def needed_strength(self) -> float:
        """Yield strength below which a metal yields under this pressure, p0 / 1.60 [Pa]."""
        return self.pressure / YIELDS_AT

    def to_dict(self) -> dict[str, Any]:
        """Return the keys of a JSON document; null for the time where no contact was pressed.

        All are null where contacts were measured.
        """
        numbers = {
            "largest_pressure_Pa": self.pressure,
            "largest_pressure_contact": self.contact,
            "largest_pressure_time_s": self.time,
            "needed_yield_strength_Pa": self.needed_strength,
        }
        return dict.fromkeys(numbers) if math.isnan(self.pressure) else numbers


def pressures(scene: Scene, force: FloatArray) -> FloatArray:
    """Return p0 of every contact under its force [N]; [Pa], shape (contacts,).

    The force of a damped contact has the part of its damper, so that p0 is above that of the
    overlap: by 0.06 % for two spheres of restitution 0.9, by 3 % for 0.5 (measured). NaN where
    contacts were measured: their curvature is not known.
    """
    if scene.measures_contacts:
        return np.full(force.shape, np.nan)
    each = scene.granules
    return np.asarray(hertz.pressure_of(each.stiffness, each.contact_radius, force))


def yield_warning(scene: Scene, peak_force: FloatArray) -> str | None:
    """Return the warning where p0 exceeds 1.60 Y; None where it does not or no Y is known."""
    walls = (wall for wall in (scene.wall, scene.near_wall) if wall is not None)
    if scene.chain.yield_strength is None and not any(wall.yield_strength for wall in walls):
        return None
    weaker = _weaker(scene, peak_force.size)
    load = pressures(scene, peak_force) / (YIELDS_AT * weaker)
    k, beyond = int(np.argmax(load)), int(np.count_nonzero(load > 1))
    if not beyond:
        return None
    most = scene.contact_name(scene.contacts[k])
    return (
        f"{beyond} of {load.size} contacts yield, {most} most: the pressure is"
        f" {load[k]:.3g} times the {YIELDS_AT * weaker[k]:.3g} Pa at which a yield_strength of"
        f" {weaker[k]:.3g} Pa is reached below the surface (von Mises; Johnson, Contact Mechanics,"
        " 1985, chapter 6), and the contacts here stay elastic"
    )


def _weaker(scene: Scene, contacts: int) -> FloatArray:
    """Return Y of the weaker body of each contact [Pa], shape (contacts,); inf where none is known.

    A striker with a material of its own and a rigid wall have no known Y.
    """
    wall, near, unknown = scene.wall, scene.near_wall, math.inf
    strength = np.full(scene.chain.granules, unknown)
    if scene.chain.yield_strength is not None:
        strength[:] = scene.chain.yield_strength
    if set(scene.shock.material) - {"radius"}:
        strength[0] = unknown
    before = [] if near is None else [near.yield_strength or unknown]
    behind = unknown if wall is None else wall.yield_strength or unknown
    every = np.array([*before, *strength, behind])
    return np.asarray(np.minimum(every[:-1], every[1:])[:contacts])


ROUGH = 0.01  # error of the peaks above which p means nothing: p depends on changes of 1 %


_MIXED = 1e-6
"""Sum of the momenta at the start over that of their sizes below which they cancel (chosen)."""


class Restitution(NamedTuple):
    """Momentum back over momentum in, at the end of a run.

    Parameters
    ----------
    first_granule
        That of granule 1; None where nothing gives it momentum, or where it is pressed.
    column
        That of all granules; None without a wall, and where they press it.
    """

    first_granule: float | None
    column: float | None


@dataclass(frozen=True, eq=False, repr=False)
class Result(ShownRun):
    """Result of one backend for one scene.

    Contacts have the paper's numbers, 2 ... N; with a wall there is one more, contact N + 1,
    between granule N and the wall, and with a near wall contact 1 between that and granule 1.

    Parameters
    ----------
    scene
        The scene.
    backend, method
        Names of the backend and of its method.
    dt
        The largest step [s].
    steps, force_evaluations
        Cost of the run itself, without the runs that estimate its error.
    peak_force, peak_time
        Peaks of all contacts [N] and their times [s], shape (contacts,). True maxima, not the
        largest samples; the time is NaN where a contact was never pressed.
    peak_passed
        Whether the force of a contact fell again before the run ended, shape (contacts,).
    error_estimate
        Upper bound of the relative error of every peak of at least 1e-3 of the largest, against
        the exact solution of Eq. 1: steps, interpolation and round-off.
    displacement, velocity
        Displacements [m] and velocities [m/s] at the end of the run, shape (N,).
    balance
        Momentum and energy.
    history
        Recorded histories; None without ``record``.
    wall_time
        Time of the whole call, including the estimate of the error, without compiling [s].
    versions
        Versions of the software that computed the result.
    lost_digits
        Digits lost to absolute coordinates; None for a backend without them.
    scheme
        Integration scheme, by the name of native's methods; empty for any other. Velocity Verlet's
        work on the ramps has a known error.
    compile_time
        Time spent compiling kernels [s]; 0 where an earlier run has kept them.
    first_pulses
        First pulse of each contact [N, s]; None where first pulses were not wanted.
    errors
        Bounds of the errors of each contact, those of arrivals [s]; None if there is only
        ``error_estimate``.
    gauges
        Readings of the scene's gauges.
    engines
        Engines that record this run and one with other steps, for ``pulses``.
    """

    scene: Scene
    backend: str
    method: str
    dt: float
    steps: int
    force_evaluations: int
    peak_force: FloatArray
    peak_time: FloatArray
    peak_passed: NDArray[np.bool_]
    error_estimate: float
    displacement: FloatArray
    velocity: FloatArray
    balance: Balance
    history: History | None
    wall_time: float
    versions: Mapping[str, str]
    lost_digits: LostDigits | None = None
    scheme: str = ""
    compile_time: float = 0.0
    first_pulses: FirstPulses | None = None
    errors: ContactErrors | None = None
    gauges: tuple[Reading, ...] = ()
    engines: tuple[Recorded, Recorded] | None = None

    @property
    def static_force(self) -> FloatArray | None:
        """Force of each contact at the start [N], shape (contacts,); None without a static load."""
        if self.scene.precompression is None:
            return None
        return self.scene.granules.static_force

    @cached_property
    def transition_granules(self) -> int | None:
        """p; None if the transition does not end in this chain or run, or there are terms."""
        if not self.scene.is_plain:
            return None
        return transition_granules(self.peak_force, self.peak_passed)

    @cached_property
    def solitary_wave(self) -> SolitaryWave:
        """The wave after the transition."""
        p = self.transition_granules
        if p is None:
            return SolitaryWave(None, None, None)
        chain = self.scene.chain
        wave = solitary_wave(
            self.peak_force, self.peak_time, self.peak_passed, p, 2 * chain.radius,
            hertz.slowness(chain.contact_stiffness, chain.granule_mass / 2),
        )  # fmt: skip
        return wave.without_errors() if self.scene.pulse is None else wave

    @cached_property
    def restitution(self) -> Restitution | None:
        """Momentum at the end over that at the start, with the opposite sign.

        None for plain scenes and pistons, under static loads, and between two walls.
        """
        scene = self.scene
        loaded = scene.precompression is not None or scene.piston is not None
        walls = (scene.wall is not None) + (scene.near_wall is not None)
        if scene.is_plain or loaded or walls == 2:
            return None
        granules, first = scene.granules, scene.first_granule
        mass, contacts = granules.mass[first:], granules.stiffness.size
        place = np.zeros(granules.radius.size + 1)
        place[first:-1] = self.displacement
        is_open = (place[:-1] - place[1:])[:contacts] <= granules.gap
        momentum = np.where(np.isinf(mass), 0.0, mass) * self.velocity
        at_start = granules.moved[first:]
        at_start[scene.shock.granule - 1] += scene.applied_impulse
        whole, striker = float(np.sum(at_start)), float(at_start[0])
        by_wall = is_open[0 if scene.near_wall is not None else -1]
        is_column = walls > 0 and by_wall and abs(whole) > _MIXED * np.sum(np.abs(at_start))
        is_first = bool(striker) and bool(np.all(is_open[: first + 1]))
        return Restitution(
            -float(momentum[0]) / striker if is_first else None,
            -float(np.sum(momentum)) / whole if is_column else None,
        )

    @property
    def overlap_ratio(self) -> float:
        """Largest overlap over the radius R; Hertz's law holds for small overlaps."""
        return largest_overlap_ratio(self.scene, self.peak_force)

    @property
    def largest_pressure(self) -> LargestPressure:
        """Largest Hertz pressure of all contacts, the wall's too."""
        pressure = pressures(self.scene, self.peak_force)
        k = int(np.argmax(pressure))
        time = or_none(self.peak_time)[k]
        return LargestPressure(float(pressure[k]), self.scene.contacts[k], time)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Validity warnings; usually empty."""
        validity = overlap_warning(self.overlap_ratio), yield_warning(self.scene, self.peak_force)
        warnings = [warning for warning in validity if warning is not None]
        if self.first_pulses is not None and self.errors is not None:
            of_first = self.errors.first
            if of_first is not None and (lost := np.flatnonzero(np.isinf(of_first))).size:
                names = [self.scene.contact_name(self.scene.contacts[k]) for k in lost[:3].tolist()]
                more = f" and {lost.size - 3} more" if lost.size > 3 else ""
                warnings.append(
                    f"no digit is known of the first pulse of {', '.join(names)}{more}: with other"
                    " steps it is another"
                )
            unsure = int(np.count_nonzero(self.errors.peak > ROUGH))
            if unsure:
                warnings.append(
                    f"the largest force of {unsure} of {self.contact.size} contacts may be off by"
                    " more than 1 %, as peak_error tells: repeated collisions amplify errors, but"
                    " not those of first pulses"
                )
        elif self.error_estimate > ROUGH:
            warnings.append(
                f"the peaks may be off by {self.error_estimate:.0%}, and p and all that follows"
                f" from them may be wrong: {SHORTER}"
            )
        end, of_shock = self.scene.end_time, self.scene.pulse_end
        if end < of_shock:
            warnings.append(
                f"the run ended at {end:.6g} s, before its shock did, at {of_shock:.6g} s: set a"
                " later end_time in [run]"
            )
        if late := self.cut_off:
            more = f" and {len(late) - 3} more" if len(late) > 3 else ""
            warnings.append(
                f"the run ended before {', '.join(late[:3])}{more} had been pressed and had let up:"
                f" set end_time in [run] to watch longer than {self.scene.end_time:.3g} s"
            )
        return tuple(warnings)

    @property
    def cut_off(self) -> tuple[str, ...]:
        """Names of the contacts whose peak, or first pulse, may come after the end of the run.

        Plain scenes without gauges have none: there p is undefined where the run ended too early.
        """
        if self.scene.is_plain and self.first_pulses is None:
            return ()
        return tuple(self.scene.contact_name(k) for k in self.contact[self.is_cut_off].tolist())

    @cached_property
    def is_cut_off(self) -> NDArray[np.bool_]:
        """Whether peaks may come after the end, or are only the force at the start, (contacts,)."""
        late, first = ~self.peak_passed, self.first_pulses
        if first is not None:
            late = np.where(np.isnan(first.force), late, ~first.is_ended)
        if self.static_force is not None:
            # Increase of a static force that is round-off, relative (chosen)
            late |= self.peak_force <= (1 + 1e-6) * self.static_force
        return late & self.is_reached

    @property
    def is_reached(self) -> NDArray[np.bool_]:
        """False for contacts that fixed granules keep from any motion, shape (contacts,)."""
        if not self.scene.holds:  # without a list of all granules, which may be many
            return np.ones(self.peak_force.size, bool)
        each, shock = self.scene.granules, self.scene.shock
        moves = each.velocity != 0
        moves[self.scene.pushed] |= not isinstance(shock, Moving)
        return each.reached_from(moves)

    @property
    def contact(self) -> NDArray[np.int_]:
        """Numbers of the contacts, 2 ... N, to N + 1 with a wall, from 1 with a near wall."""
        return np.array(self.scene.contacts)

    def peak_at(self, contact: Annotated[int, "_place_of"]) -> float:
        """Peak force of one contact [N], by its number as in ``contact``.

        Raises
        ------
        SceneError
            If there is no such contact.
        """
        return float(self.peak_force[self._place_of(contact)])

    def force_at(self, contact: Annotated[int, "_place_of"]) -> FloatArray:
        """Force over time in one contact [N], shape (times,), at the times ``history.time``.

        This is F(t) as recorded, without an error bound. Where the peak lies between two recorded
        times, the maximum of F(t) is below ``peak_force``, the largest force of the whole run:
        often by some per cent with ``record`` = 500, and less with more.

        Parameters
        ----------
        contact
            Its number as in ``contact``: contact i lies between granules i - 1 and i, contact
            N + 1 between granule N and the wall, contact 1 between a near wall and granule 1.

        Raises
        ------
        SceneError
            If nothing was recorded, or there is no such contact.
        """
        return self._recorded.contact_force[:, self._place_of(contact)]

    @property
    def _recorded(self) -> History:
        if self.history is None:
            allowed = "there is none: run with record = a number of frames, or times"
            raise SceneError("history", None, allowed)
        return self.history

    def to_traces(self) -> pandas.DataFrame:
        """Return the readings of the scene's gauges over time, without static forces.

        Its columns are time_s and one for each gauge, as gauge_16_N of granule 16, contact_10_N, or
        wall_N or near_wall_N for contacts with walls. SceneError without gauges, or without
        ``record``.
        """
        import pandas

        history, scene = self._recorded, self.scene
        require(bool(scene.gauges), "gauge", None, NO_GAUGE)
        names = [gauge.name(scene.last_contact if scene.wall else None) for gauge in scene.gauges]
        forces = [force_over_time(scene, gauge, history) for gauge in scene.gauges]
        return pandas.DataFrame({"time_s": history.time, **dict(zip(names, forces, strict=True))})

    def _place_of(self, contact: int) -> int:
        """Return the place of a contact in arrays; a SceneError where there is no such contact."""
        first, last = self.scene.contacts[0], self.scene.last_contact
        is_there = isinstance(contact, Integral) and first <= contact <= last
        allowed = (
            f"must be a whole number from {first} to {last}: contact 2 lies between granules 1 and"
            " 2"
        )
        if self.scene.wall is not None:
            allowed += f", contact {last} at the wall"
        require(is_there, "contact", contact, allowed)
        return self.scene.contacts.index(contact)

    def to_frame(self) -> pandas.DataFrame:
        """Return a table with one row per contact: contact, peak_force_N, peak_time_s.

        With a static load, the further columns are static_force_N and dynamic_force_N (peak less
        static force); with first pulses, those of ``first_columns``.
        """
        import pandas

        columns = {
            "contact": self.contact,
            "peak_force_N": self.peak_force,
            "peak_time_s": self.peak_time,
        }
        if self.static_force is not None:
            columns["static_force_N"] = self.static_force
            columns["dynamic_force_N"] = self.peak_force - self.static_force
        return pandas.DataFrame({**columns, **self.first_columns})

    @cached_property
    def trains(self) -> tuple[Train, ...]:
        """All pulses of each contact, then of each gauge in a granule.

        Three further runs are recorded for them, when they are first wanted.
        """
        if self.engines is None:
            raise SceneError("pulses", None, "are found for results of hertzchain's own backends")
        return trains_of(self.scene, *self.engines)

    def pulses(self, contact: int | None = None, granule: int | None = None) -> pandas.DataFrame:
        """Return all pulses, incident and reflected, of a contact or a gauge, in order of time.

        A pulse is a maximum of the dynamic force (without the static load) of at least 1 % of the
        largest of its contact. Three further runs are made for the first call.

        Parameters
        ----------
        contact, granule
            Its number: of a contact, or of a granule with a gauge; pulses of all with neither.

        Returns
        -------
        A table with a row for each pulse, as ``judge_trains`` takes it: ``contact`` or ``granule``,
        ``time_s``, ``force_N``, ``arrival_time_s`` (when half of the force is reached), ``width_s``
        (at half of the force; NaN where the run ended before), and bounds of their errors,
        ``time_error_s``, ``force_error`` (relative), ``arrival_error_s``, ``width_error_s``;
        infinite where a run with other steps has no such pulse.

        Raises
        ------
        SceneError
            If there is no such contact or gauge.
        """
        import pandas

        require(contact is None or granule is None, "granule", granule, "must not have a contact")
        trains = self.trains
        if contact is not None:
            trains = (trains[self._place_of(contact)],)
        if granule is not None:
            trains = tuple(train for train in trains if train.gauge.granule == granule)
            require(bool(trains), "granule", granule, "must have a [[gauge]] of the scene")
        each = [
            train.to_frame().assign(**{train.gauge.key: train.gauge.number}) for train in trains
        ]
        table = pandas.concat(each, ignore_index=True)
        first = [name for name in ("contact", "granule") if name in table]
        table = table.astype(dict.fromkeys(first, "Int64"))
        return table[[*first, *(name for name in table if name not in first)]]

    @property
    def peak_errors(self) -> FloatArray:
        """Bounds of the relative errors of peaks, shape (contacts,).

        Contacts without an error of their own have ``error_estimate``.
        """
        errors = self.first_columns.get("peak_error", np.full(self.peak_force.size, np.nan))
        return np.where(np.isnan(errors), self.error_estimate, errors)

    @property
    def wanted_error(self) -> float:
        """The largest error of the forces for which the wanted accuracy holds (see ``wanted``)."""
        has_errors = self.first_pulses is not None and self.errors is not None
        return self.errors.wanted if has_errors else self.error_estimate  # type: ignore[union-attr]

    @cached_property
    def first_columns(self) -> dict[str, NDArray[Any]]:
        """Columns of first pulses and errors, as ``error_bound.columns`` has them, and near_end.

        ``near_end`` is true for the last contacts, where incident and reflected wave are one hump:
        two, or seven if contacts are damped or loaded.
        """
        table = columns(self.first_pulses, self.errors)
        return {**table, "near_end": is_near_end(self.scene)} if table else {}

    def wave(self, first: int, last: int) -> Wave:
        """Return the wave from one contact to a later one; SceneError without first pulses."""
        return wave_between(self.scene, self.first_columns, first, last)

    @property
    def usual_wave(self) -> Wave | None:
        """The wave over the last contacts that no end disturbs, at most ten; None without one."""
        return usual_wave(self.scene, self.first_columns)

    def to_dict(self, pulses: bool = False) -> dict[str, Any]:
        """Return the result and its scene as a JSON object; null stands for a missing value.

        With ``pulses`` it has those of all contacts.
        """
        trains = {"pulses": [train.to_dict() for train in self.trains]} if pulses else {}
        return {**self.numbers(), **trains, **context_of(self.scene)}

    def numbers(self) -> dict[str, Any]:
        """Return the object of ``to_dict`` without the scene, its contacts and the versions."""
        wave, wave_over, static = self.solitary_wave, self.usual_wave, self.static_force
        scene, history, gauges = self.scene, self.history, self.gauges
        return {
            "backend": self.backend,
            "method": self.method,
            "dt_s": self.dt,
            "steps": self.steps,
            "force_evaluations": self.force_evaluations,
            "end_time_s": scene.end_time,
            "rise_time_s": scene.rise_time,
            "momentum_ratio": scene.momentum_ratio,
            "peak_force_N": self.peak_force.tolist(),
            "peak_time_s": or_none(self.peak_time),
            **({} if static is None else {"static_force_N": static.tolist()}),
            **{name: or_none(values) for name, values in self.first_columns.items()},
            **({} if self.first_pulses is None else {"wave": wave_over and wave_over.to_dict()}),
            **({"gauges": [gauge.to_dict(scene, history) for gauge in gauges]} if gauges else {}),
            **({} if self.restitution is None else {"restitution": self.restitution._asdict()}),
            "transition_granules": self.transition_granules,
            "solitary_wave": {
                "peak_force_N": wave.peak_force,
                "far_field_force_N": wave.far_field_force,
                "far_field_error": wave.far_field_error,
                "far_field_reason": wave.reason,
                "speed_m_s": wave.speed,
                "speed_error": wave.speed_error,
            },
            "error_estimate": self.error_estimate,
            "overlap_ratio": self.overlap_ratio,
            **self.largest_pressure.to_dict(),
            "warnings": list(self.warnings),
            "balance": {
                "impulse_N_s": self.balance.impulse,
                "momentum_N_s": self.balance.momentum,
                "work_J": self.balance.work,
                "energy_J": self.balance.energy,
                **({"dissipated_J": self.balance.dissipated} if self.scene.contact else {}),
            },
            "wall_time_s": self.wall_time,
            "compile_time_s": self.compile_time,
            "lost_digits": self.lost_digits
            and {
                "young_modulus_Pa": self.lost_digits.young_modulus,
                "predicted": self.lost_digits.predicted,
                "bound": self.lost_digits.bound,
            },
            "provenance": provenance(self.versions),
        }
