"""Peaks from samples of a run by another code, and how far off they may be.

Where positions, velocities and forces are known the overlap is interpolated between samples as for
engines; else a polynomial goes through the samples around the highest one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import Array, FloatArray
from hertzchain.contact import hertz
from hertzchain.errors import SceneError
from hertzchain.observables.peaks import PeakWatch, judged_contacts
from hertzchain.observables.samples import Samples
from hertzchain.scene.scene import Scene

_OF_GRANULES = ("position", "velocity", "net_force")
_MOVED = 0.05  # fraction of the largest value from which an end of the chain has moved (chosen)
_LOOKED_AT = 2000  # numbers of a file whose digits are counted (chosen)
_FEWEST = 7  # samples: a curve of sixth degree goes through so many
_SIXTH = 4.0
"""Times the difference of curves of sixth and fourth degree: the error of the former is at most 3.2
times it for samples up to 0.8 natural time units apart, 0.1 times at 0.2 (measured, see there). In
random scenes with samples 0.02 to 1 unit apart, 45 of 9,932 peaks were off by more than is said,
nearly all with more than 0.6 between samples."""
_COARSE, _TELLS_LITTLE = 0.02, 10.0
"""Difference of curves of fourth and second degree from which samples are too far apart to tell,
and what the error is then at most, in such differences (measured, up to 1.2 units apart)."""
_PULLS = 0.1  # times as many forces of the other sign as leave no doubt which is a push (chosen)
_MOST_CRESTS = 8  # humps that are looked at for each contact (chosen)
_DIGITS = 2.0  # last digits that rounded forces cost a peak at most: sums of a few (chosen)
_HERMITE = 1 / 4
"""Of what twice the distance of samples changes peaks by: where the error goes with its sixth power
it is 1/63 of that. In random scenes with samples 0.02 to 1 natural time units apart, 4 of 10,022
peaks were off by more than this, by 1.8 times at most."""


@dataclass(frozen=True, eq=False)
class Motion:
    """What a file says of a run, in SI units; arrays that are not known are None.

    Granules stand from the pushed end on, samples in their order.
    """

    time: FloatArray  # increasing, shape (samples,): [s], or steps
    is_clock: bool  # whether times are seconds
    position: FloatArray | None = None  # along the chain [m], shape (samples, granules)
    velocity: FloatArray | None = None  # the same [m/s]
    net_force: FloatArray | None = None  # the same [N]
    contact_force: FloatArray | None = None  # [N], shape (samples, contacts)
    grain: float = 0.0  # the last digit of positions [m]
    force_grain: float = 0.0  # the last digit of forces [N]

    @classmethod
    def read(
        cls,
        time: FloatArray,
        is_clock: bool,
        numbers: Mapping[str, FloatArray],
        factors: Mapping[str, float],
    ) -> Motion:
        """The motion by arrays as a file has them, and by what their numbers are worth in SI."""
        values: dict[str, Any] = {name: array * factors[name] for name, array in numbers.items()}
        grains = {name: last_digit(array) * factors[name] for name, array in numbers.items()}
        force_grain = grains.get("contact_force", grains.get("net_force", 0.0))
        grain = grains.get("position", 0.0)
        return cls(time, is_clock, **values, grain=grain, force_grain=force_grain)

    def each(self, change: Callable[[FloatArray], FloatArray], *names: str) -> Motion:
        """Return the motion with some of its arrays changed, as far as they are known."""
        known = [name for name in names if getattr(self, name) is not None]
        changed: dict[str, Any] = {name: change(getattr(self, name)) for name in known}
        return replace(self, **changed)


def along_the_chain(motion: Motion) -> Motion:
    """Return the motion of granules in the order of a scene: along the chain, from the pushed end.

    Granules stand in any order, along a negative axis, or are pushed at the last one.
    """
    if motion.position is not None:
        order = np.argsort(motion.position[0], kind="stable")
        motion = motion.each(lambda array: array[:, order], *_OF_GRANULES)
    moved = motion.net_force if motion.net_force is not None else motion.velocity
    if moved is None and motion.position is not None:
        moved = motion.position - motion.position[0]
    if moved is not None and begins_at_the_end(moved):
        motion = motion.each(lambda array: -array[:, ::-1], *_OF_GRANULES)
    return motion.each(lambda array: array - array[0, 0], "position")


def begins_at_the_end(values: FloatArray) -> bool:
    """Return whether the last column changes before the first, shape (samples, columns)."""
    counts = np.abs(values) > _MOVED * np.max(np.abs(values))
    first, last = (np.flatnonzero(counts[:, k]) for k in (0, -1))
    return bool(last.size and (not first.size or last[0] < first[0]))


def last_digit(values: FloatArray) -> float:
    """Return the unit of the last digit that the largest of some numbers have; 0 for 15 digits.

    The numbers have equally many significant digits, or decimals.
    """
    some = np.abs(values[values != 0])
    if not some.size:
        return 0.0
    words = [f"{value:.14e}" for value in some[:: max(1, some.size // _LOOKED_AT)]]
    digits = max(len(word.partition("e")[0].rstrip("0").replace(".", "")) for word in words)
    exponent = math.floor(math.log10(float(np.max(some))))
    return 0.0 if digits >= 15 else float(10.0 ** (exponent - digits + 1))


@dataclass(frozen=True, eq=False)
class Sampled:
    """Peaks that somebody brings, most from samples.

    ``error`` is how far off each may be, as a fraction, by the distance of the samples and the
    digits of positions; 0 for peaks that are given as such.
    """

    peak_force: FloatArray  # of all contacts [N], shape (contacts,), NaN where there is none
    error: FloatArray  # shape (contacts,)
    how: str  # where they come from; empty for peaks that are given as such

    @property
    def largest_error(self) -> float:
        """The error of the contacts that count."""
        return float(np.max(self.error[judged_contacts(self.peak_force)], initial=0.0))


def peaks_of(scene: Scene, motion: Motion, file: object) -> Sampled:
    """The peaks of a run, by whichever way is known to be nearer."""
    if motion.time.size < _FEWEST:
        allowed = (
            f"has {motion.time.size} samples of the run, must have at least {_FEWEST}: name all"
            " files of a dump that has one for each frame"
        )
        raise SceneError("", None, allowed, file=str(file))
    # A code writes a sample twice, at the end of a run and at the start of the next.
    once = np.append(True, np.diff(motion.time) != 0)
    motion = motion.each(lambda array: array[once], "time", *_OF_GRANULES, "contact_force")
    if not np.all(np.diff(motion.time) > 0):
        allowed = "has times or steps that do not increase: give the samples of one run, in order"
        raise SceneError("", None, allowed, file=str(file))
    found: list[Sampled] = []
    forces = _contact_forces(scene, motion, file)
    if forces is not None:
        how = "contact forces" if motion.contact_force is not None else "net forces, added up"
        peaks = _through_samples(motion.time, forces, f"samples of {how}")
        found.append(_with_digits(peaks, _DIGITS * motion.force_grain, peaks.peak_force))
    # Overlaps under which dampers and pistons press are not known from places.
    if motion.position is not None and scene.contact is None and scene.piston is None:
        if motion.velocity is not None and motion.net_force is not None and motion.is_clock:
            assert forces is not None
            peaks = _between_samples(scene, motion, forces)
        else:
            how = "samples of positions, by Hertz's law of the scene"
            peaks = _through_samples(motion.time, _by_hertz(scene, motion.position), how)
        stiffness = scene.granules.stiffness[: peaks.peak_force.size]
        overlap = hertz.overlap_of(stiffness, np.maximum(peaks.peak_force, 0.0))
        # Force goes as overlap^(3/2); both positions are off by half a digit at most.
        found.append(_with_digits(peaks, 1.5 * motion.grain, overlap))
    if not found:
        allowed = (
            "says nothing of contact forces in such a scene: it must have forces of contacts, or"
            " net forces on all granules, or for elastic contacts without a piston their positions"
        )
        raise SceneError("", None, allowed, file=str(file))
    return min(found, key=lambda one: one.largest_error)


def _with_digits(peaks: Sampled, lost: float, size: FloatArray) -> Sampled:
    """Return peaks with the error by the digits that numbers of a size are written with."""
    return replace(peaks, error=peaks.error + lost / np.where(size > 0, size, np.inf))


def _contact_forces(scene: Scene, motion: Motion, file: object) -> FloatArray | None:
    """Force in each contact [N], (samples, contacts), as given or from net forces."""
    if motion.contact_force is not None:
        force = motion.contact_force
        pushes, pulls = np.count_nonzero(force < 0), np.count_nonzero(force > 0)
        if -np.min(force) > np.max(force) and pulls <= _PULLS * pushes:
            allowed = (
                "has contact forces that are negative where granules press (the largest is"
                f" {np.min(force):.4g} N): turn their sign"
            )
            raise SceneError("", None, allowed, file=str(file))
        return force
    if motion.net_force is None:
        return None
    own = motion.net_force - scene.granules.constant_force
    if scene.wall is None:
        return np.ascontiguousarray(np.cumsum(own[:, :0:-1], axis=1)[:, ::-1])
    if scene.piston is not None:
        allowed = (
            "has net forces, which do not tell contact forces between a piston and a wall: give"
            " contact forces"
        )
        raise SceneError("", None, allowed, file=str(file))
    applied = np.zeros(motion.time.size)
    if scene.ramps:
        if not motion.is_clock:
            raise SceneError("", None, "has steps and no times: give --dt", file=str(file))
        applied = scene.applied_force(motion.time)
    return applied[:, np.newaxis] - np.cumsum(own[:, :-1], axis=1)


def _by_hertz(scene: Scene, position: FloatArray) -> FloatArray:
    """Contact forces of overlaps by the law of the scene [N], (samples, contacts)."""
    overlap = _overlaps(scene, position)
    return np.asarray(hertz.force_of(scene.granules.stiffness[: overlap.shape[1]], overlap))


def _overlaps(scene: Scene, position: FloatArray) -> FloatArray:
    radius = scene.granules.radius
    return np.asarray(radius[:-1] + radius[1:] - np.diff(position, axis=1))


def _between_samples(scene: Scene, motion: Motion, forces: FloatArray) -> Sampled:
    """Return peaks by the interpolation of engines, from positions, velocities and net forces."""
    assert motion.position is not None
    assert motion.velocity is not None
    assert motion.net_force is not None
    overlap = _overlaps(scene, motion.position)
    pressed = overlap > 2 * motion.grain
    samples = (
        motion.time,
        motion.position - scene.granules.position,
        motion.velocity,
        motion.net_force / scene.granules.mass,
        overlap,
        np.where(pressed, np.maximum(forces, 0.0), 0.0),
    )
    peaks, *fewer = (
        _watched(Samples(*(array[first::apart] for array in samples)))
        for first, apart in ((0, 1), (0, 2), (1, 2))
    )
    highest = np.where(peaks > 0, peaks, 1.0)
    change = np.max([np.abs(other / highest - 1) for other in fewer], axis=0)
    error = np.where(peaks > 0, _HERMITE * change, 0.0)
    how = "positions, velocities and net forces between the samples"
    return Sampled(peaks, _robust(peaks, error), how)


def _watched(samples: Samples) -> FloatArray:
    watch = PeakWatch(samples.overlap.shape[1])
    watch.update(samples)
    return np.asarray(watch.force, np.float64)


def _through_samples(time: FloatArray, force: FloatArray, how: str) -> Sampled:
    """Peaks of a curve of sixth degree through the seven samples around the highest.

    It goes through the forces to the power 2/3, as overlaps are smooth where contacts open. How
    far off it may be follows from its difference from curves through five and three of them.
    Samples of other humps are looked at, too, where their maximum may be as high.
    """
    smooth = np.cbrt(np.maximum(force, 0.0)) ** 2
    contacts = force.shape[1]
    peaks, error = np.zeros(contacts), np.zeros(contacts)
    for contact in range(contacts):
        values = smooth[:, contact]
        if not np.any(values > 0):
            continue
        found = [_maximum(time, values, at) for at in _crests(values)]
        highest = max(value for value, _ in found)
        off = max(value + error for value, error in found) - highest
        peaks[contact], error[contact] = highest**1.5, 1.5 * off / highest
    return Sampled(peaks, _robust(peaks, error), how)


def _crests(values: FloatArray) -> NDArray[np.intp]:
    """Return samples near which the maximum may be: the highest, and those of other humps."""
    from scipy.signal import find_peaks

    humps = find_peaks(values)[0]
    return np.union1d(humps[np.argsort(values[humps])[-_MOST_CRESTS:]], np.argmax(values))


def _maximum(time: FloatArray, values: FloatArray, at: int) -> tuple[float, float]:
    """The maximum of a curve near a sample, and how far off it may be."""
    sixth, fourth, second = (_highest(time, values, at, beside) for beside in (3, 2, 1))
    off = _SIXTH * abs(sixth - fourth)
    if abs(fourth - second) > _COARSE * fourth:
        off = max(off, _TELLS_LITTLE * abs(fourth - second))
    if at in (0, time.size - 1):  # cut off: nobody knows how much higher it went
        off = max(off, abs(values[at] - values[min(max(at, 1), time.size - 2)]))
    return sixth, off


def _highest(time: FloatArray, values: FloatArray, at: int, beside: int) -> float:
    """The maximum of a polynomial through samples around one, near it, and at least its value."""
    first = min(max(at - beside, 0), time.size - 2 * beside - 1)
    here = slice(first, first + 2 * beside + 1)
    scale = float(time[here.stop - 1] - time[here.start]) / (2 * beside)
    s = (time[here] - time[at]) / scale
    curve = np.polynomial.polynomial.Polynomial.fit(s, values[here], 2 * beside, domain=[-1, 1])
    near = np.clip(curve.deriv().roots().real, max(s[0], -1.0), min(s[-1], 1.0))
    return float(max([values[at], *curve(near)]))


def _robust(peaks: Array, error: FloatArray) -> FloatArray:
    """Errors, none below the median of the contacts that count: one may be small by chance."""
    counts = judged_contacts(peaks)
    usual = float(np.median(error[counts])) if counts.any() else 0.0
    return np.maximum(error, usual)
