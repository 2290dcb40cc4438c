"""Numbers of a deck in SI units, those that a scene expects, and what they do to the peaks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.deck import UNITS, FoundDeck, FoundWall, Units, scaled
from hertzchain.engines.lammps.reading.probing import AT_REST, QUIET
from hertzchain.engines.native.equations import Chain
from hertzchain.engines.native.verlet import Walk, states_of
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from hertzchain.observables.samples import DampedLaw
from hertzchain.scene.scene import Scene
from hertzchain.scene.shocks import Piston


@dataclass(frozen=True, eq=False)
class Stretch:
    """A run of a deck in equal steps [s].

    ``applied`` is the force on the granules that are pushed at the start and after each step [N],
    shape (steps + 1, pushed granules); ``driven`` the displacement of a piston at these times [m],
    else of shape (0,).
    """

    dt: float
    applied: FloatArray
    driven: FloatArray


class Twin(NamedTuple):
    """A chain with any numbers, which velocity Verlet integrates at the steps of a deck.

    Arrays have the shape (granules,) or (contacts,); a wall at the far end is the last contact.
    """

    mass: FloatArray  # [kg]
    velocity: FloatArray  # [m/s]
    constant_force: FloatArray  # [N]
    drag: FloatArray  # [N s/m]
    stiffness: FloatArray  # k and p in F = k overlap^p
    exponent: FloatArray
    opening: FloatArray  # gap at the start [m], below 0 for an overlap
    damping: FloatArray  # c in c overlap^q d'
    damping_exponent: float  # q of all contacts
    attraction: bool  # whether contacts may pull
    pushed: NDArray[np.intp]  # granules on which the shock acts, counted from 0


@dataclass(frozen=True, eq=False)
class TwinRun:
    """Peaks of a twin [N], and how far its ends move against and along the chain [m]."""

    peak_force: FloatArray  # (contacts,)
    backwards: float
    forwards: float
    velocity: FloatArray  # (granules,), at the end


def twin_of(scene: Scene) -> Twin:
    """Return the twin of the scene itself."""
    granules, count = scene.granules, scene.bodies
    contacts = granules.stiffness.size
    contact = scene.contact
    return Twin(
        mass=granules.mass,
        velocity=granules.velocity,
        constant_force=granules.constant_force,
        drag=np.zeros(count),
        stiffness=granules.stiffness,
        exponent=np.full(contacts, 1.5),
        opening=granules.gap - granules.static_overlap,
        damping=np.zeros(contacts) if granules.damping is None else granules.damping,
        damping_exponent=0.0 if contact is None else contact.exponent,
        attraction=contact is not None and contact.attraction,
        pushed=np.array([scene.pushed]),
    )


def run_twin(twin: Twin, stretches: Iterable[Stretch], deadline: Deadline) -> TwinRun:
    """Integrate a twin; peaks are not finite where the motion diverges. Raises TooExpensive."""
    contacts, granules = twin.stiffness.size, twin.mass.size
    stretches = tuple(stretches)
    inverse_mass = 1 / twin.mass
    if stretches and stretches[0].driven.size:  # as in all others
        inverse_mass[0] = 0.0
    chain = Chain(
        twin.stiffness, inverse_mass, twin.opening, twin.constant_force * inverse_mass,
        twin.damping, twin.damping_exponent, twin.attraction,
    )  # fmt: skip
    walk = Walk.of(chain, np.zeros(granules), twin.velocity, twin.pushed, twin.exponent, twin.drag)
    force, backwards, forwards = np.zeros(contacts), 0.0, 0.0
    for stretch in stretches:
        before = np.full((1, contacts), np.inf)
        steps, force_at, led = len(stretch.applied) - 1, stretch.applied.__getitem__, stretch.driven
        # States that are processed together: with 20 granules fewer would cost as much as the steps
        run = states_of(walk, stretch.dt, steps, force_at, deadline, led=led, block=2048)
        for _, states in run:
            if not np.all(np.isfinite(states[:, -1])):
                none = np.full(contacts, np.nan)
                return TwinRun(none, backwards, forwards, walk.v[:-1])
            seen = np.concatenate([before, states[3, :, :contacts]])
            force, before = np.maximum(force, _highest(seen)), seen[-2:-1]
            backwards = max(backwards, float(-np.min(states[0, :, 0])))
            forwards = max(forwards, float(np.max(states[0, :, -1])))
    return TwinRun(force, backwards, forwards, walk.v[:-1])


def _highest(force: FloatArray) -> FloatArray:
    """The highest of forces (samples, contacts) by parabolas; the first is only a neighbour."""
    before, now, after = force[:-2], force[1:-1], force[2:]
    top = force[1:].max(axis=0)
    at = np.nonzero((now >= before) & (now > after))
    slope, bend = after[at] - before[at], before[at] - 2 * now[at] + after[at]
    np.maximum.at(top, at[1], now[at] - slope**2 / (8 * bend))
    return np.asarray(top)


def change_of_peaks(peaks: FloatArray, expected: FloatArray, judged: NDArray[np.bool_]) -> float:
    """Largest relative difference of the peaks that are judged; infinite without a number.

    All of shape (contacts,); ``peaks`` may lack the contact of a wall, or have one too many.
    """
    size = min(peaks.size, expected.size)
    peaks, expected, judged = peaks[:size], expected[:size], judged[:size]
    if not judged.any():
        return 0.0
    change = np.abs(peaks[judged] / expected[judged] - 1)
    return float(np.max(change)) if np.all(np.isfinite(change)) else float("inf")


def length(scene: Scene) -> float:
    """Length of the chain, the size of coordinates [m]."""
    return float(np.sum(2 * scene.granules.radius) + np.sum(scene.granules.gap))


def places(scene: Scene) -> FloatArray:
    """Places of granules and a wall [m]: contact after contact, each in equilibrium."""
    granules, weight = scene.granules, _weight(scene)
    carried = np.zeros(granules.stiffness.size)
    load, weighs = 0.0 if scene.precompression is None else scene.precompression.force, 0.0
    fixed = set(granules.fixed[scene.first_granule :].tolist())
    # A free striker presses nothing at the start, and a fixed granule passes nothing on but a near
    # wall, which presses the chain.
    for k in range(scene.shock.loaded_granule, carried.size):
        weighs += weight[k]
        if k in fixed:
            load = weighs = 0.0
        carried[k] = weighs + load
    overlap = (carried / granules.stiffness) ** (2 / 3)
    gap = np.broadcast_to(scene.chain.gap, scene.chain.granules)[1:]
    if scene.near_wall is not None:
        gap = np.append(scene.near_wall.gap, gap)
    ahead = granules.radius[1:] + gap
    if scene.wall is not None:
        ahead = np.append(ahead, scene.wall.gap)
    return np.append(0.0, np.cumsum(granules.radius[: carried.size] + ahead - overlap))


def _weight(scene: Scene) -> FloatArray:
    """Weight of each granule along the chain [N], shape (granules,)."""
    gravity = 0.0 if scene.precompression is None else scene.precompression.gravity
    granules = scene.granules
    weight = np.asarray(gravity * 4 / 3 * math.pi * granules.radius**3 * granules.density)
    weight[: scene.first_granule] = 0.0  # a near wall has none
    return weight


def constant_force(scene: Scene) -> FloatArray:
    """Weight and static loads on each granule [N], shape (granules,); fixed ones bear any."""
    load = _weight(scene)
    if scene.precompression is not None:
        load[scene.shock.loaded_granule] += scene.precompression.force
        load[-1] -= scene.held_load
    return load


def applied_force(scene: Scene, time: FloatArray) -> FloatArray:
    """F(t) [N] of the shape of time; a pulse by Table 1, not by the schedule's ramps."""
    if scene.pulse is None:
        return scene.applied_force(time)
    assert scene.rise_time is not None
    return theory.applied_force(time, scene.pulse, scene.rise_time)


EXPONENT = 0.01  # of 3/2: two tries of a law of Hertz are within 1e-9, Hooke's is 0.5 off (chosen)
ROUND_OFF = 1e-9  # relative: decks with 17 digits have less, 1e-12 is usual (chosen)


def in_si(deck: FoundDeck, scene: Scene) -> tuple[FoundDeck, Units]:
    """Return the found deck in SI units, and the units of the deck.

    A deck in lj units gets those in which the median radius, mass and stiffness are the scene's:
    all other numbers are then judged as ratios.
    """
    if deck.units != "lj":
        return deck, UNITS[deck.units]
    granules = scene.granules
    count = min(deck.radius.size, granules.radius.size)
    pressed = deck.contact_force > 0
    per_overlap = (
        np.where(pressed, deck.contact_force, np.nan) / np.where(pressed, deck.overlap, 1.0) ** 1.5
    )
    if not pressed.any() or count < 2:
        raise RunFailed(
            "no contact of this deck pushes, so that its lj units of length, mass and time cannot"
            " be found: look at its pair_style and pair_coeff"
        )
    contacts = min(per_overlap.shape[1], granules.stiffness.size)
    ratio = granules.stiffness[:contacts] / per_overlap[:, :contacts]
    length = float(np.median(granules.radius[:count] / deck.radius[:count]))
    mass = float(np.median(granules.mass[:count] / deck.mass[:count]))
    force = float(np.nanmedian(ratio)) * length**1.5
    units = Units("lj", length, mass, float(np.sqrt(mass * length / force)))
    return scaled(deck, units), units


@dataclass(frozen=True, eq=False)
class Law:
    """The force of one contact by its probes: ``stiffness`` overlap^``exponent`` near an overlap.

    ``ratios`` is the force over Hertz's with the scene's stiffness at each ``overlap`` tried,
    ``ratio`` that by the law at the overlap that matters: a law of another exponent has a stiffness
    in another unit.
    """

    stiffness: float
    exponent: float
    overlap: FloatArray
    ratios: FloatArray
    ratio: float

    @property
    def is_missing(self) -> bool:
        """Whether there is no force."""
        # Fraction of Hertz's force: a contact with less does not push (chosen)
        return not self.ratio > 1e-6

    @property
    def is_bent(self) -> bool:
        """Whether the force does not follow Hertz's law."""
        return not self.is_missing and abs(self.exponent - 1.5) > EXPONENT


def law_of(overlap: FloatArray, force: FloatArray, stiffness: float, near: float) -> Law:
    """The law of a contact from its forces at some overlaps, shape (tries,).

    ``stiffness`` is what the scene has, ``near`` the overlap at which it matters most [m].
    """
    tried = np.isfinite(force) & (overlap > 0)
    order = np.argsort(overlap[tried])
    depth, push = overlap[tried][order], force[tried][order]
    tries = depth, push / (stiffness * depth**1.5)
    depth, push = depth[push > 0], push[push > 0]
    if depth.size == 0:
        return Law(0.0, 1.5, *tries, 0.0)
    exponent, at = 1.5, 0
    if depth.size > 1:
        at = int(np.clip(np.searchsorted(depth, near), 1, depth.size - 1))
        exponent = float(np.log(push[at] / push[at - 1]) / np.log(depth[at] / depth[at - 1]))
    factor = float(push[at] / depth[at] ** exponent)
    return Law(factor, exponent, *tries, factor * near ** (exponent - 1.5) / stiffness)


def _tries(deck: FoundDeck, scene: Scene) -> list[list[FloatArray]]:
    """Overlaps and forces of each contact, a wall's last; then overlaps, speeds and forces."""
    count, wall = scene.bodies, far_wall(deck)
    between = min(count - 1, deck.contact_force.shape[1])
    columns = (deck.overlap, deck.contact_force,
               deck.damped_overlap, deck.closing, deck.damped_force)  # fmt: skip
    probes = [[column[:, k] for column in columns] for k in range(between)]
    if scene.wall is not None and wall is not None and between == count - 1:
        # A gap is not probed there.
        probes.append([np.append(np.nan, wall.overlap), np.append(np.nan, wall.force),
                     wall.damped_overlap, wall.closing, wall.damped_force])  # fmt: skip
    return probes


def laws(deck: FoundDeck, scene: Scene, near: FloatArray) -> list[Law]:
    """The law of each contact of a scene that the deck has, a wall's last."""
    stiffness = scene.granules.stiffness
    return [
        law_of(overlap, force, float(stiffness[k]), float(near[k]))
        for k, (overlap, force, *_) in enumerate(_tries(deck, scene))
    ]


def far_wall(deck: FoundDeck) -> FoundWall | None:
    """The wall at the far end, if the deck has one, from where its force begins.

    By Hertz's law the force may begin a little before it is noticed among others.
    """
    wall = next((wall for wall in deck.walls if wall.end == "last"), None)
    if wall is None:
        return None
    deep, overlap = wall.force[-2:] ** (2 / 3), wall.overlap
    with np.errstate(all="ignore"):
        late = float(deep[1] * (overlap[-1] - overlap[-2]) / (deep[1] - deep[0]) - overlap[-1])
    # Fraction of an overlap: uncertainty of where a force begins (chosen)
    if not abs(late) < 1e-8 * overlap[-1]:
        return wall
    return replace(wall, position=wall.position - late, overlap=overlap + late,
                   damped_overlap=wall.damped_overlap + late)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Damper:
    """Force of damping in one contact at each try [N], in the deck and in the scene."""

    added: FloatArray
    expected: FloatArray
    elastic: FloatArray
    closing: FloatArray  # m/s
    overlap: FloatArray  # m


def dampers(deck: FoundDeck, scene: Scene) -> list[Damper]:
    """Damping of each contact, the wall's last: force in motion less force at rest."""
    law = None if scene.contact is None else DampedLaw.of(scene)
    dampings = []
    for k, (_, force, *tries) in enumerate(_tries(deck, scene)):
        tried = np.isfinite(tries[2]) & (tries[0] > 0)
        overlap, closing, damped = (values[tried] for values in tries)
        elastic, expected = force[AT_REST][tried], np.zeros_like(overlap)
        if law is not None:
            added = law.damper(overlap[:, None], closing[:, None], np.array([k]))[:, 0]
            expected = np.asarray(added, np.float64)
        dampings.append(Damper(damped - elastic, expected, elastic, closing, overlap))
    return dampings


def with_loads(deck: FoundDeck, scene: Scene) -> FoundDeck:
    """Return the deck with constant forces of its formulas before and after the shock as loads.

    Such a force counts only if the scene has static loads, or if it keeps its value for a while.
    """
    force, time = deck.applied_force, deck.applied_time
    if force.shape[0] < 2:
        return deck
    least = ROUND_OFF * float(np.max(np.abs(force), initial=0.0))
    rests = np.abs(force - force[0]) <= least
    # Start of the load on each granule: after the last reading without it.
    since = np.max(np.where(rests, -np.inf, time[:, np.newaxis]), axis=0, initial=-np.inf)
    # Fraction of the whole time: a static load acts for longer after the shock (chosen)
    stays = rests[-1] & (since < deck.end_time - 0.05 * (deck.end_time - time[0]))
    if np.any(scene.granules.constant_force):
        stays = rests[-1]
    load = np.where(stays, force[0], 0.0)
    constant = deck.constant_force + load[:, np.newaxis] * np.array([1.0, 0.0, 0.0])
    return replace(deck, applied_force=force - load, constant_force=constant)


def with_held(deck: FoundDeck, contact_laws: Sequence[Law], moved: float) -> FoundDeck:
    """Return the deck with a static load in place of a held last granule.

    Both are the same if the shock does not reach it: ``moved`` is its displacement in the scene
    [m].
    """
    last = deck.radius.size - 1
    if deck.integrated[last] != 0 or np.any(deck.velocity[last]) or len(contact_laws) != last:
        return deck
    overlap = deck.radius[-2] + deck.radius[-1] - deck.position[-1] + deck.position[-2]
    # A granule that moves less may also be held (chosen)
    if overlap <= 0 or moved > 1e-5 * overlap:
        return deck
    constant, integrated = deck.constant_force.copy(), deck.integrated.copy()
    constant[last, 0] = -contact_laws[-1].stiffness * overlap ** contact_laws[-1].exponent
    integrated[last] = 1
    return replace(deck, constant_force=constant, integrated=integrated)


def start_of_shock(deck: FoundDeck, scene: Scene) -> float:
    """Time at which the shock begins in the deck [s]: 0, or the start of one of its runs.

    A deck may let the chain settle first. It is the start at which the forces agree best with those
    of the scene; without forces, the time when granules get their velocities, or granule 1 begins
    its prescribed motion.
    """
    starts = [0.0, *(run.start for run in deck.runs if run.start > 0)]
    if not scene.ramps:
        return _start_of_motion(deck)
    force = np.sum(deck.applied_force, axis=1)
    acts = np.flatnonzero(np.abs(force) > ROUND_OFF * scene.peak_force)
    if acts.size == 0:
        return 0.0
    first = deck.applied_time[acts[0]]
    starts = [start for start in starts if start <= first]

    def misfit(start: float) -> float:
        expected = scene.applied_force(deck.applied_time - start)
        return float(np.sum((force - expected) ** 2))

    begun = min(starts, key=misfit)
    # A formula may begin at any time: then that start fits, and no start of a run.
    tried = first + scene.pulse_end * np.linspace(-0.05, 0.05, 41)
    for _ in range(4):
        best = float(min(tried, key=misfit))
        tried = best + (tried[1] - tried[0]) * np.linspace(-1, 1, 21)
    exact = np.max(np.abs(force - scene.applied_force(deck.applied_time - best)))
    step = deck.runs[0].dt
    # Fraction of a step: a measured start so near to a step is that step (chosen)
    if abs(best / step - round(best / step)) < 0.02:
        best = round(best / step) * step
    # Fraction of the largest force: a shock that begins at another time fits as well (chosen)
    if best > 0 and exact < 1e-2 * scene.peak_force and misfit(best) < 0.25 * misfit(begun):
        return best
    return begun


def _start_of_motion(deck: FoundDeck) -> float:
    """Time at which granules of a deck without a pushing force begin to move [s]."""
    if deck.driven_time.size:
        return float(deck.driven_time[0])
    given = [k for k, command in enumerate(deck.commands) if command.text.split()[0] == "velocity"]
    if np.any(deck.velocity) or not given:
        return 0.0
    return next((run.start for run in deck.runs if run.command > given[-1]), 0.0)


def readings_of_runs(deck: FoundDeck) -> list[tuple[FloatArray, FloatArray]]:
    """Times [s] and applied forces [N] of each run; two readings where one follows another."""
    time, force = deck.applied_time, deck.applied_force
    pieces, first = [], 0
    for run in deck.runs:
        end, room = run.start + run.steps * run.dt, 1e-6 * run.dt + 1e-12 * abs(run.start)
        last = int(np.searchsorted(time, end + room, side="right"))
        ends = int(np.searchsorted(time, end - room))  # of two readings there the first
        last = min(last, ends + 1) if run is not deck.runs[-1] else last
        pieces.append((time[first:last], force[first:last]))
        first = last
    return pieces


def stretches_of(
    deck: FoundDeck,
    scene: Scene,
    start: float,
    pushed: NDArray[np.intp] | None = None,
    use_driven: bool = False,
) -> tuple[Stretch, ...]:
    """The runs of a deck with the scene's shock or, if granules are ``pushed``, the deck's.

    With ``use_driven`` granule 1 has its prescribed motion of the deck.
    """
    stretches = []
    for run, (at, force) in zip(deck.runs, readings_of_runs(deck), strict=True):
        steps = run.steps
        if deck.stopped:  # no peak is judged, and the run may be of any length
            steps = min(steps, max(0, math.ceil((start + scene.end_time - run.start) / run.dt)))
        time = np.asarray(run.start - start + run.dt * np.arange(steps + 1), np.float64)
        if pushed is None:  # a sum of steps may end before a corner by a rounding error
            applied = np.asarray(scene.applied_force(time + 1e-9 * run.dt))[:, np.newaxis]
        else:  # between two readings the force is that of the line between them
            applied = np.zeros((time.size, pushed.size))
            for column, granule in enumerate(pushed if at.size else ()):
                applied[:, column] = np.interp(time, at - start, force[:, granule])
        driven = np.zeros(0)
        if use_driven:
            driven = np.interp(time + start, deck.driven_time, deck.driven_displacement)
        elif scene.piston is not None:
            driven = displacement(scene.piston, time)
        stretches.append(Stretch(run.dt, applied, driven))
    return tuple(stretches)


def displacement(piston: Piston, time: FloatArray) -> FloatArray:
    """Displacement of a piston at times from the start of the shock [m]."""
    if piston.velocity is not None:
        return np.asarray(piston.velocity * np.maximum(time, 0.0), np.float64)
    assert piston.time is not None
    assert piston.displacement is not None
    return np.interp(time, piston.time, piston.displacement)


def damping_of(deck: FoundDeck, scene: Scene) -> dict[str, Any]:
    """Numbers of a twin with the damping of the deck: c overlap^q d' from the largest tries."""
    # Round-off has no exponent.
    each = [
        replace(d, added=np.where(np.abs(d.added) > QUIET * d.elastic, d.added, 0.0))
        for d in dampers(deck, scene)
    ]
    twin = twin_of(scene)
    power = _power_of(each, 0.5 if scene.contact is None else twin.damping_exponent)
    damping, pulls = np.array(twin.damping), False
    for k, damper in enumerate(each):
        if np.any(closing := damper.closing > 0):
            deep = int(np.argmax(np.where(closing, damper.overlap, 0.0)))
            damping[k] = damper.added[deep] / (damper.overlap[deep] ** power * damper.closing[deep])
            pulls |= bool(np.any(damper.elastic + damper.added < -QUIET * damper.elastic))
    return {"damping": damping, "damping_exponent": power, "attraction": pulls}


def _power_of(each: Sequence[Damper], default: float) -> float:
    """Exponent q of the damping of a deck, from the smallest and the largest overlap."""
    for damper in each:
        closing = (damper.closing > 0) & (np.abs(damper.added) > 0)
        if np.count_nonzero(closing) >= 2:
            overlap, rate = damper.overlap[closing], damper.added[closing] / damper.closing[closing]
            low, high = int(np.argmin(overlap)), int(np.argmax(overlap))
            if overlap[high] > overlap[low] and rate[high] * rate[low] > 0:
                power = np.log(rate[high] / rate[low]) / np.log(overlap[high] / overlap[low])
                return float(round(4 * float(power)) / 4)
    return default
