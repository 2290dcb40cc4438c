"""Readings of a code: as its dumps have them, and as samples in SI units."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import RunFailed
from hertzchain.observables.samples import DampedLaw, Samples, closing, true_forces
from hertzchain.scene.schedule import Leg

_HEADER = 9  # lines before the granules of a frame: step, count, box, names of columns


def read_frames(path: Path, columns: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Read a whole dump: steps, (frames,), and values, (frames, columns, granules)."""
    blocks = list(read_blocks(path, columns))
    return np.concatenate([steps for steps, _ in blocks]), np.concatenate(
        [values for _, values in blocks]
    )


def read_blocks(
    path: Path, columns: tuple[str, ...], frames: int = 256
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Read as ``read_frames`` in blocks of frames; the dump has an ``id`` besides the columns."""
    try:
        with path.open(encoding="ascii") as file:
            head = list(itertools.islice(file, _HEADER))
            if not head:
                raise RunFailed(f"{path.name}: the dump of the run is empty")
            lines = itertools.chain(head, file)
            length = frames * (_HEADER + int(head[3]))
            while block := list(itertools.islice(lines, length)):
                yield _frames(block, columns)
    except (OSError, UnicodeDecodeError) as problem:
        raise RunFailed(f"{path.name}: the run left no dump that can be read ({problem})") from None
    except (ValueError, IndexError):
        raise RunFailed(
            f"{path.name}: the dump of the run is cut off or has other columns: is the disk full?"
        ) from None


def _frames(lines: list[str], columns: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    steps, values = [], []
    at = 0
    while at < len(lines):
        step, granules = int(lines[at + 1]), int(lines[at + 3])
        names = lines[at + 8].split()[2:]
        rows = lines[at + _HEADER : at + _HEADER + granules]
        table = np.array([[float(number) for number in row.split()] for row in rows])
        if table.shape != (granules, len(names)):
            raise ValueError(table.shape)
        order = np.argsort(table[:, names.index("id")])
        steps.append(step)
        values.append([table[order, names.index(name)] for name in columns])
        at += _HEADER + granules
    return np.array(steps, np.float64), np.array(values, np.float64)


BLOCK = 256  # most readings passed on at a time


@dataclass(frozen=True, eq=False)
class Granules:
    """Granules of a code before the shock: [m], [kg], [m], shape (granules,) each.

    The mass of a piston is infinite.
    """

    position: FloatArray
    mass: FloatArray
    diameter: FloatArray

    @property
    def moving_mass(self) -> FloatArray:
        """Masses for momentum and energy of the chain [kg], shape (granules,); 0 for a piston."""
        return np.where(np.isinf(self.mass), 0.0, self.mass)


@dataclass(frozen=True, eq=False)
class Held:
    """Loads on the granules besides contacts and shock.

    Parameters
    ----------
    acceleration
        Acceleration of all granules by gravity [m/s^2].
    second_force
        Force on granule 2 behind a free striker, along the chain [N].
    last_force
        Force on the last granule, against the chain [N].
    wall
        Position of the wall [m]; None for a free end.
    pushed
        Granule on which the applied force acts, counted from 0.
    """

    acceleration: float = 0.0
    second_force: float = 0.0
    last_force: float = 0.0
    wall: float | None = None
    pushed: int = 0


FREE = Held()
"""No loads."""


def contact_forces(net_force: FloatArray) -> FloatArray:
    """Force in each contact [N], (..., granules - 1), from net forces, (..., granules).

    Each is the sum of the net forces beyond it, added from the free end, where they are small.
    """
    return np.cumsum(net_force[..., :0:-1], axis=-1)[..., ::-1]


def samples(
    time: FloatArray, arrays: FloatArray, at_rest: Granules, leg: Leg, held: Held = FREE,
    wall_force: FloatArray | None = None, law: DampedLaw | None = None,
) -> Samples:  # fmt: skip
    """Convert successive readings on a leg to samples with the derivatives of the positions.

    The readings, at least two: times [s], shape (readings,), and positions [m], velocities [m/s]
    and net forces [N] along the chain, shape (readings, 3, granules). ``law`` is the law of damped
    contacts, None for elastic ones.

    Velocity Verlet's own velocities and accelerations are central differences of its positions over
    a step: they differ from the derivatives by dt^2/6 times the third and dt^2/12 times the fourth
    derivative. These follow from the forces, with Hertz's exponent and without the stiffness.
    """
    position, velocity, force = (np.ascontiguousarray(arrays[:, k]) for k in range(3))
    reach = (at_rest.diameter[:-1] + at_rest.diameter[1:]) / 2
    overlap = reach - np.diff(position, axis=-1)
    if held.wall is not None:
        last = position[:, -1:] + at_rest.diameter[-1] / 2 - held.wall
        overlap = np.concatenate([overlap, last], axis=1)
    # Granules that only touch may overlap by rounding of their positions; this is no contact.
    pressed = overlap > np.finfo(np.float64).eps * np.max(np.abs(at_rest.position))
    net = force - held.acceleration * at_rest.moving_mass
    net[:, 1:2] -= held.second_force
    if held.pushed > 0 and leg.ramp is not None:
        net[:, held.pushed] -= leg.ramp.force(time)
    net[:, -1] += held.last_force
    net[:, -1] += 0.0 if wall_force is None else wall_force
    contact_force = contact_forces(net)
    if wall_force is not None:
        contact_force = np.concatenate([contact_force, wall_force[:, np.newaxis]], axis=1)
    contact_force = np.where(pressed, contact_force, 0.0)
    states = Samples(
        time=time, displacement=position - at_rest.position, velocity=velocity,
        acceleration=force / at_rest.mass, overlap=overlap, contact_force=contact_force,
    )  # fmt: skip
    if law is not None:
        return true_forces(states, law, leg)  # errors of the derivatives are of a higher order
    return _with_true_derivatives(states, at_rest.mass, leg, held.pushed)


def _with_true_derivatives(samples: Samples, mass: FloatArray, leg: Leg, pushed: int) -> Samples:
    """Return samples with the derivatives of the displacements, up to the third.

    A contact force F goes as r^(3/2), so with k = 3/2 F / r its derivatives are k r' and
    k (r'' + r'^2 / 2r). The jerk is right except for dt^2/12 times the fifth derivative.
    """
    dt = leg.dt
    velocity, acceleration = samples.velocity, samples.acceleration
    r = np.where(samples.contact_force > 0, samples.overlap, 1.0)
    rate, second = (closing(d, r.shape[1]) for d in (velocity, acceleration))
    stiffness = 1.5 * samples.contact_force / r
    # Within a step of the opening of a contact its force has no second derivative.
    growth = rate**2 / (2 * np.maximum(r, np.abs(rate) * dt))
    applied_rate, applied_second = _applied(samples.time, leg)
    jerk = _net(stiffness * rate, applied_rate, mass.size, pushed) / mass
    fourth = _net(stiffness * (second + growth), applied_second, mass.size, pushed) / mass
    true_rate = rate - dt**2 / 6 * closing(jerk, r.shape[1])
    return replace(
        samples,
        velocity=velocity - dt**2 / 6 * jerk,
        acceleration=acceleration - dt**2 / 12 * fourth,
        jerk=_net(stiffness * true_rate, applied_rate, mass.size, pushed) / mass,
    )


def _applied(time: FloatArray, leg: Leg) -> tuple[FloatArray, FloatArray]:
    """Return rate [N/s] and second derivative [N/s^2] of the applied force, shape (readings,)."""
    if leg.ramp is None:
        return np.zeros_like(time), np.zeros_like(time)
    rate = leg.ramp.force_rate
    return rate(time), (rate(time + leg.dt) - rate(time - leg.dt)) / (2 * leg.dt)


def _net(contact: FloatArray, applied: FloatArray, granules: int, pushed: int) -> FloatArray:
    """Net forces, or derivatives, from contact forces, (readings, contacts), and applied ones."""
    passed_on = np.zeros((contact.shape[0], granules + 1))
    passed_on[:, 1 : 1 + contact.shape[1]] = contact
    if pushed == 0:
        passed_on[:, 0] = applied
    net = passed_on[:, :-1] - passed_on[:, 1:]
    if pushed > 0:
        net[:, pushed] += applied
    return net


def stops(leg: Leg, stride: int) -> list[int]:
    """Return the steps of a leg with a reading: every ``stride``, the first and the last."""
    return [*range(0, leg.steps, stride), leg.steps]


def count_readings(legs: Sequence[Leg], strides: Sequence[int]) -> int:
    """Count the readings of a run without a list of them, which might not fit into memory."""
    return sum(len(range(0, leg.steps, n)) + 1 for leg, n in zip(legs, strides, strict=True))


def reading_times(leg: Leg, stride: int) -> FloatArray:
    """Return the times of the readings of a leg [s], shape (readings,)."""
    times = leg.start + leg.dt * np.array(stops(leg, stride))
    times[-1] = leg.end  # exact to the last digit, so that no time falls between legs
    return times
