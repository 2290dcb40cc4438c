"""Runs with deliberate mistakes, one or two at once, as a code with these mistakes would give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import METHODS, plan, simulate
from hertzchain.engines.native.damped_runs import simulate_damped
from hertzchain.engines.native.kernel_input import leg_rows
from hertzchain.errors import RunFailed, SceneError, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.damped_law import DampedLaw
from hertzchain.scene.pulse import PROFILES, Pulse, PulseTable, Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg, lay_steps
from hertzchain.scene.terms import DampingLaw
from hertzchain.verdict.damping_causes import contact_of

_RTOL = 1e-7  # wanted accuracy of a run; smaller differences get no cause
_DAMPED_TOLERANCE = 1e-7  # tolerance of a step, damped contacts: peaks are right to 2e-7

_SAMPLED = 0.1  # natural time units between samples of damped velocity Verlet
_WEAK = 1e-12  # coefficient of damping without effect, natural units

HALF_SINE, RECTANGLE = "half sine", "rectangle"
OTHER_PROFILES = (*PROFILES, HALF_SINE, RECTANGLE)

AREAS = {HALF_SINE: 2 / np.pi, RECTANGLE: 1.0}
"""Impulses of pulses over F0 times duration; 0.5 for those of the paper."""


@dataclass(frozen=True)
class Mistakes:
    """Mistakes in a computation; the defaults mean none.

    Parameters
    ----------
    stretch
        Factor of the duration of the pulse in natural units, as from another stiffness.
    force
        Factor of the applied force, at the same rise time.
    profile
        A wrong profile of the pulse.
    duration
        Factor of the duration ratio less 1, at the same rise time.
    held
        Number of equal intervals in which the force is held at its value at the start; 0 for none.
    granules
        Number of additional granules.
    law, strength, pulls
        Damping of contacts with its coefficient in natural units, and whether contacts pull.
    dt
        The step of velocity Verlet [natural time units], 0 for an accurate run.
    """

    stretch: float = 1.0
    force: float = 1.0
    profile: str = ""
    duration: float = 1.0
    held: int = 0
    granules: int = 0
    law: DampingLaw | Literal[""] = ""
    strength: float = 0.0
    pulls: bool = False
    dt: float = 0.0


def with_rise_time(scene: Scene) -> Scene:
    """Return the same scene with the rise time in seconds, which stays in another chain."""
    pulse = scene.shock
    if not isinstance(pulse, Pulse):
        return scene
    return replace(scene, shock=replace(pulse, momentum_ratio=None, rise_time=scene.rise_time))


def stiffer(scene: Scene, factor: float) -> Scene:
    """Return the same scene with a multiple of the stiffness."""
    return replace(
        scene, chain=replace(scene.chain, young_modulus=factor * scene.chain.young_modulus)
    )


def pushed(scene: Scene, factor: float) -> Scene:
    """Return the same scene with a multiple of the applied force."""
    shock = scene.shock
    if isinstance(shock, Pulse):
        return replace(scene, shock=replace(shock, peak_force=factor * shock.peak_force))
    assert isinstance(shock, PulseTable)
    force = tuple(factor * value for value in shock.force)
    return replace(scene, shock=PulseTable(shock.time, force, shock.file))


def mistaken_scene(scene: Scene, mistakes: Mistakes) -> Scene:
    """Scene with its mistakes, except for steps and for pulses that no scene can have."""
    scene = with_rise_time(scene)
    shock = scene.shock
    if isinstance(shock, Pulse):
        ratio = 1 + mistakes.duration * (shock.duration_ratio - 1)
        shock = replace(shock, duration_ratio=ratio)
        if mistakes.profile in PROFILES:
            shock = replace(shock, profile=mistakes.profile)
        scene = replace(scene, shock=shock)
    if mistakes.granules:
        chain = scene.chain
        scene = replace(scene, chain=replace(chain, granules=chain.granules + mistakes.granules))
    if mistakes.force != 1:
        scene = pushed(scene, mistakes.force)
    if mistakes.stretch != 1:
        scene = stiffer(scene, mistakes.stretch**3)
    if mistakes.law:
        contact = contact_of(scene, mistakes.law, mistakes.strength, mistakes.pulls)
        scene = replace(scene, contact=contact)
    return scene


def _ramps(scene: Scene, mistakes: Mistakes) -> Sequence[Ramp]:
    """Return the applied force [s, N] of a scene with its mistakes, also for impossible pulses."""
    ramps = scene.ramps
    top, end = scene.peak_force, ramps[-1].end
    if mistakes.profile == HALF_SINE:
        rise = ramps[0].end
        ramps = (
            Ramp(0.0, rise, 0.0, top, "quarter-sine"),
            Ramp(rise, end, top, 0.0, "quarter-cosine"),
        )
    elif mistakes.profile == RECTANGLE:
        ramps = (Ramp(0.0, end, top, top, "linear"),)
    if mistakes.held:
        times = np.linspace(0.0, end, mistakes.held + 1)
        forces = scene.applied_force(times)
        ramps = tuple(
            Ramp(start, stop, force, force, "linear")
            for start, stop, force in zip(
                times[:-1].tolist(), times[1:].tolist(), forces[:-1].tolist(), strict=True
            )
        )
    return ramps


def damped_verlet_peaks(scene: Scene, legs: Sequence[Leg]) -> FloatArray:
    """Return highest forces of damped contacts by velocity Verlet, natural units, shape (N - 1,).

    They are tops of parabolas through samples 0.1 natural time units apart, with relative errors of
    2e-4, which mostly cancel in ratios at the same steps. ``simulate_damped_verlet`` takes ten
    times as long, because it also measures work and bounds.
    """
    from hertzchain.engines.native.damped_verlet import verlet_contacts
    from hertzchain.engines.native.damped_verlet_kernel import take_steps

    chain = verlet_contacts(scene)
    granules, unit = scene.chain.granules, scene.units
    law = DampedLaw.of(scene).in_units(unit)
    u, v, f, a = (np.zeros(granules + 1) for _ in range(4))
    times, forces = [], []
    for leg, row in zip(legs, leg_rows(legs, unit), strict=True):
        dt = leg.dt / unit.time
        stride = max(1, min(int(_SAMPLED / dt), leg.steps // 8))
        kept = np.array([*range(0, leg.steps, stride), leg.steps])
        states = np.zeros((kept.size, 4, granules))
        take_steps(row, 0, leg.steps, stride, chain, u, v, f, a, states)
        times.append(leg.start / unit.time + dt * kept[1:])
        overlap, rate = (-np.diff(states[1:, part]) for part in (0, 1))
        forces.append(law.force(overlap, rate))
    return _tops(np.concatenate(times), np.concatenate(forces))


def _tops(time: FloatArray, force: FloatArray) -> FloatArray:
    """Return tops of parabolas through the highest samples and their neighbours, (contacts,)."""
    k = np.clip(np.argmax(force, axis=0), 1, time.size - 2)
    here = np.arange(force.shape[1])
    before, top, after = force[k - 1, here], force[k, here], force[k + 1, here]
    left, right = time[k] - time[k - 1], time[k + 1] - time[k]
    rise, fall = (top - before) / left, (after - top) / right
    bend = (fall - rise) / (left + right)
    slope = (rise * right + fall * left) / (left + right)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = top - slope**2 / (4 * bend)
    return np.asarray(np.where(bend < 0, np.maximum(found, top), np.max(force, axis=0)))


@dataclass(frozen=True, eq=False)
class Runs:
    """A cache of peaks of a scene with mistakes."""

    scene: Scene
    deadline: Deadline
    kept: dict[Mistakes, FloatArray] = field(default_factory=dict)

    def peaks(self, mistakes: Mistakes) -> FloatArray:
        """Return peak forces [N], shape (N - 1,); NaN for a missing contact or an impossible run.

        Raises TooExpensive if the run is not done by the deadline.
        """
        if mistakes not in self.kept:
            contacts = self.scene.chain.granules - 1
            found = np.full(contacts, np.nan)
            try:
                peaks = self._run(mistakes)
                found[: min(contacts, peaks.size)] = peaks[:contacts]
            except TooExpensive:
                raise
            except (RunFailed, SceneError):
                pass
            self.kept[mistakes] = found
        return self.kept[mistakes]

    def _run(self, mistakes: Mistakes) -> FloatArray:
        scene = mistaken_scene(self.scene, mistakes)
        ramps = _ramps(scene, mistakes)
        unit = scene.units
        if mistakes.dt:
            legs: tuple[Leg, ...] = lay_steps(ramps, scene.end_time, mistakes.dt * unit.time)
            if mistakes.law:
                elastic = replace(mistakes, law="", strength=0.0, pulls=False)
                weak = replace(scene, contact=contact_of(scene, mistakes.law, _WEAK, True))
                ratio = damped_verlet_peaks(scene, legs) / damped_verlet_peaks(weak, legs)
                return np.asarray(ratio * self._run(elastic))
            walker = METHODS["velocity-verlet"].walker
            run = simulate(scene, legs, walker, deadline=self.deadline)
            return np.asarray(run.peaks.force * unit.force)
        if mistakes.law:
            legs = lay_steps(ramps, scene.end_time, scene.end_time)
            damped = simulate_damped(scene, _DAMPED_TOLERANCE, self.deadline, legs=legs)
            return np.asarray(damped.peak_force * unit.force)
        chosen = plan.cheapest(_RTOL, checked=False)
        legs = chosen.walker.cut(lay_steps(ramps, scene.end_time, chosen.step * unit.time))
        # Granules may be dropped behind the wave only after single pushes.
        single = not mistakes.held
        run = simulate(scene, legs, chosen.walker, leave_behind=single, deadline=self.deadline)
        return np.asarray(run.peaks.force * unit.force)
