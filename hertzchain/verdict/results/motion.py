"""Peaks of contacts from net forces of granules, and text dumps of LAMMPS that have them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.reading.contents import Units
from hertzchain.errors import SceneError
from hertzchain.observables.peaks import judged_contacts
from hertzchain.scene.scene import Scene

_MOST_COUNTED_NUMBERS = 2000  # numbers of a file whose digits are counted (chosen)
_FEWEST_SAMPLES = 7  # samples: a curve of sixth degree goes through so many
_SIXTH_DEGREE_FACTOR = 4.0
"""Factor on the difference of curves of sixth and fourth degree: the error of the former is at most
3.2 times this difference for samples up to 0.8 natural time units apart, 0.1 times at 0.2
(measured, see there). In random scenes with samples 0.02 to 1 unit apart, 45 of 9,932 peaks were
off by more than this bound, nearly all with more than 0.6 between samples."""
_COARSE_DIFFERENCE, _COARSE_FACTOR = 0.02, 10.0
"""Difference of curves of fourth and second degree from which on samples are too far apart for
this; and the largest error then, in such differences (measured, up to 1.2 units apart)."""
_REPEATED_FORCE_RATIO = 0.05
"""Largest difference of two samples of the same time, over the largest force: dampers act
with velocities half a step apart in them. On granule 1 a force may begin between them."""
_MOST_CRESTS = 8  # humps that are examined for each contact (chosen)
_ROUNDED_DIGITS = 2.0  # last digits that rounded forces cost a peak at most: sums of a few (chosen)


@dataclass(frozen=True, eq=False)
class Motion:
    """Net forces on the granules of a run, from the pushed end on."""

    time: FloatArray  # increasing, shape (samples,): [s], or steps
    is_clock: bool  # whether times are seconds
    net_force: FloatArray  # along the chain [N], shape (samples, granules)
    grain: float = 0.0  # the last digit of forces [N]


def last_digit(values: FloatArray) -> float:
    """Return the unit of the last digit that the largest of some numbers have; 0 for 15 digits.

    The numbers have equally many significant digits, or decimals.
    """
    some = np.abs(values[values != 0])
    if not some.size:
        return 0.0
    words = [f"{value:.14e}" for value in some[:: max(1, some.size // _MOST_COUNTED_NUMBERS)]]
    digits = max(len(word.partition("e")[0].rstrip("0").replace(".", "")) for word in words)
    exponent = math.floor(math.log10(float(np.max(some))))
    return 0.0 if digits >= 15 else float(10.0 ** (exponent - digits + 1))


@dataclass(frozen=True, eq=False)
class Sampled:
    """Given peaks, with errors by sampling.

    ``error`` is the relative error of each by the interval of the samples and the digits of forces;
    0 for peaks that are given as such.
    """

    peak_force: FloatArray  # of all contacts [N], shape (contacts,), NaN where there is none
    error: FloatArray  # shape (contacts,)
    how: str = ""  # how they were found; empty for peaks that are given as such


def peaks_of(scene: Scene, motion: Motion, file: object) -> Sampled:
    """Return the peaks of a run; a SceneError says why there are none."""
    if scene.near_wall is not None:
        allowed = "has no force of a near wall: give peaks with the numbers of contacts instead"
        raise SceneError("", None, allowed, file=str(file))
    # A code writes a sample twice, at the end of a run and at the start of the next.
    once = np.append(True, np.diff(motion.time) != 0)
    time = motion.time[once]
    repeated = np.abs(np.diff(motion.net_force[:, 1:], axis=0))[~once[1:]]
    if np.max(repeated, initial=0.0) > _REPEATED_FORCE_RATIO * np.max(np.abs(motion.net_force)):
        allowed = "has two different samples of one time: give the samples of one run"
        raise SceneError("", None, allowed, file=str(file))
    if time.size < _FEWEST_SAMPLES:
        allowed = (
            f"has {time.size} samples of the run, must have at least {_FEWEST_SAMPLES}: name all"
            " files of a dump that has one for each frame"
        )
        raise SceneError("", None, allowed, file=str(file))
    if not np.all(np.diff(time) > 0):
        allowed = "has times that do not increase: give the samples of one run"
        raise SceneError("", None, allowed, file=str(file))
    forces = _contact_forces(scene, time, motion, motion.net_force[once], file)
    peaks, error = _through_samples(time, forces)
    error = error + _ROUNDED_DIGITS * motion.grain / np.where(peaks > 0, peaks, np.inf)
    largest = float(np.max(error[judged_contacts(peaks)], initial=0.0))
    apart = f"{np.median(np.diff(time)):.3g} {'s' if motion.is_clock else 'steps'}"
    how = (
        f"peaks are from net forces in a dump, {time.size} samples {apart} apart; they may be off"
        f" by up to {largest:.1e} for that"
    )
    # The force on a wall is in no dump of granules.
    unknown = np.full(len(scene.contacts) - peaks.size, np.nan)
    return Sampled(np.append(peaks, unknown), np.append(error, np.zeros_like(unknown)), how)


def _contact_forces(
    scene: Scene, time: FloatArray, motion: Motion, net_force: FloatArray, file: object
) -> FloatArray:
    """Return the force in each contact between granules [N], (samples, contacts)."""
    from_contacts = net_force - scene.granules.constant_force
    if scene.wall is None:
        return np.ascontiguousarray(np.cumsum(from_contacts[:, :0:-1], axis=1)[:, ::-1])
    if scene.piston is not None:
        allowed = "has net forces, which do not tell contact forces between a piston and a wall"
        raise SceneError("", None, allowed, file=str(file))
    applied = np.zeros(time.size)
    if scene.ramps:
        if not motion.is_clock:
            raise SceneError("", None, "has steps and no times: give --dt", file=str(file))
        applied = scene.applied_force(time)
    return applied[:, np.newaxis] - np.cumsum(from_contacts[:, :-1], axis=1)


def _through_samples(time: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return peaks and their errors, by a curve of sixth degree around the highest sample.

    It goes through seven forces to the power 2/3, as overlaps are smooth where contacts open. Its
    error follows from its difference from curves through five and three of them. Samples of other
    humps are examined, too, if their maximum may be as high.
    """
    smooth = np.cbrt(np.maximum(force, 0.0)) ** 2
    contacts = force.shape[1]
    peaks, error = np.zeros(contacts), np.zeros(contacts)
    for contact in range(contacts):
        values = smooth[:, contact]
        if not np.any(values > 0):
            continue
        maxima = [_maximum(time, values, at) for at in _crests(values)]
        highest = max(value for value, _ in maxima)
        off = max(value + error for value, error in maxima) - highest
        peaks[contact], error[contact] = highest**1.5, 1.5 * off / highest
    counts = judged_contacts(peaks)
    usual = float(np.median(error[counts])) if counts.any() else 0.0
    return peaks, np.maximum(error, usual)  # one may be small by chance


def _crests(values: FloatArray) -> NDArray[np.intp]:
    """Return samples near which the maximum may be: the highest, and those of other humps."""
    from scipy.signal import find_peaks

    humps = find_peaks(values)[0]
    return np.union1d(humps[np.argsort(values[humps])[-_MOST_CRESTS:]], np.argmax(values))


def _maximum(time: FloatArray, values: FloatArray, at: int) -> tuple[float, float]:
    """Return the maximum of a curve near a sample, and its error."""
    sixth, fourth, second = (_highest(time, values, at, beside) for beside in (3, 2, 1))
    off = _SIXTH_DEGREE_FACTOR * abs(sixth - fourth)
    if abs(fourth - second) > _COARSE_DIFFERENCE * fourth:
        off = max(off, _COARSE_FACTOR * abs(fourth - second))
    if at in (0, time.size - 1):  # cut off: how much higher the force went is not known
        off = max(off, abs(values[at] - values[min(max(at, 1), time.size - 2)]))
    return sixth, off


def _highest(time: FloatArray, values: FloatArray, at: int, beside: int) -> float:
    """The maximum of a polynomial through samples around one, near it, and at least its value."""
    first = min(max(at - beside, 0), time.size - 2 * beside - 1)
    window = slice(first, first + 2 * beside + 1)
    scale = float(time[window.stop - 1] - time[window.start]) / (2 * beside)
    s = (time[window] - time[at]) / scale
    curve = np.polynomial.polynomial.Polynomial.fit(s, values[window], 2 * beside, domain=[-1, 1])
    near = np.clip(curve.deriv().roots().real, max(s[0], -1.0), min(s[-1], 1.0))
    return float(max([values[at], *curve(near)]))


_PLACES, _FORCES = (("x", "y", "z"), ("xu", "yu", "zu")), (("fx", "fy", "fz"),)
_MOST_WIDTH_RATIO = 1e-3  # of places across a chain over its length (chosen)
_PUSH_FORCE_RATIO = 0.05  # of the largest force, from which an end of the chain is pushed (chosen)


def is_dump(text: str) -> bool:
    """Return whether the text of a file is that of a dump of LAMMPS."""
    return text[:1000].lstrip()[:5] == "ITEM:"


@dataclass(frozen=True, eq=False)
class _Frame:
    """Places and forces of the granules, by id, as written, shape (granules, 3)."""

    step: float
    time: float | None
    place: FloatArray
    force: FloatArray


def motion_of(
    texts: Sequence[str], granules: int, units: Units, dt: float | None, file: str
) -> Motion:
    """Return the net forces in the frames of one dump, from the pushed end of the chain on.

    It may lie along any axis, be pushed at either end, and have its frames in many texts. A
    SceneError says what cannot be used.
    """
    frames = sorted(
        (frame for text in texts for frame in _frames_of(text, granules, file)),
        key=lambda frame: frame.step,
    )
    place, force = (np.array([getattr(f, name) for f in frames]) for name in ("place", "force"))
    axis = _axis(place[0] * units.length, file)
    order = np.argsort(place[0, :, axis], kind="stable")
    net = np.ascontiguousarray(force[:, order, axis])
    if pushed_at_the_end(net):
        net = -net[:, ::-1]
    time, is_clock = np.array([frame.step for frame in frames]), dt is not None
    if all(frame.time is not None for frame in frames):
        time, is_clock = np.array([frame.time for frame in frames]) * units.time, True
    elif dt is not None:
        time = time * dt
    return Motion(time, is_clock, net * units.force, last_digit(net) * units.force)


def _frames_of(text: str, granules: int, file: str) -> list[_Frame]:
    frames: list[_Frame] = []  # ASE's reader has no times, needs types, accepts half a frame
    items: dict[str, tuple[list[str], list[str]]] = {}
    for item in text.split("ITEM:")[1:]:
        head, *lines = item.splitlines() or [""]
        kind, *words = head.split() or [""]
        items[kind] = words, [line for line in lines if line.strip()]
        if kind in ("ATOMS", "ENTRIES"):
            frames.append(_frame(items, granules, f"{file}, frame {len(frames) + 1}"))
            items = {}
    if items:
        raise _cut_off(f"{file}, frame {len(frames) + 1}")
    return frames


def _cut_off(where: str) -> SceneError:
    allowed = "ends in the middle, or has other rows there: is the file cut off?"
    return SceneError("", None, allowed, file=where)


def _frame(items: dict[str, tuple[list[str], list[str]]], granules: int, where: str) -> _Frame:
    """Return a frame of its items, each with the words after its name and the lines below."""
    names, lines = items.get("ATOMS", ([], []))
    columns = [
        next((three for three in vectors if set(three) & set(names)), ())
        for vectors in (_PLACES, _FORCES)
    ]
    if "id" not in names or not all(columns):
        allowed = "must have the columns id, x (or xu), fx of granules, or those of y or z"
        raise SceneError("", None, allowed, file=where)
    rows = [line.split() for line in lines]
    step, time, count = (
        _number(items[name][1][:1]) if name in items else None
        for name in ("TIMESTEP", "TIME", "NUMBER")
    )
    is_whole = len(rows) == count and all(len(row) == len(names) for row in rows)
    if not is_whole or step is None or not math.isfinite(step + (time or 0.0)):
        raise _cut_off(where)
    if len(rows) != granules:
        allowed = (
            f"has {len(rows)} granules, the scene {granules}: dump those of the chain alone, all of"
            " them"
        )
        raise SceneError("", None, allowed, file=where)

    def numbers(*wanted: str) -> FloatArray:
        columns = [
            [_number([row[names.index(name)]]) if name in names else 0.0 for name in wanted]
            for row in rows
        ]
        values = np.array(columns)
        if not np.all(np.isfinite(values)):
            allowed = f"must have finite numbers in the columns {', '.join(wanted)}"
            raise SceneError("", None, allowed, file=where)
        return values

    order = np.argsort(numbers("id")[:, 0])
    place, force = (numbers(*three)[order] for three in columns)
    return _Frame(step, time, place, force)


def _number(words: Sequence[str]) -> float:
    """Return the only word as a number; NaN if it is not one."""
    try:
        return float(words[0]) if "_" not in words[0] else math.nan
    except (ValueError, IndexError):
        return math.nan


def _axis(place: FloatArray, file: str) -> int:
    """Return the axis that granules lie along."""
    extent = np.ptp(place, axis=0)
    across, along = np.sort(extent)[1:]
    if across > _MOST_WIDTH_RATIO * along:
        allowed = (
            f"has granules that are not in a row along x, y or z: they differ by {across:.3g} m"
            " across it"
        )
        raise SceneError("", None, allowed, file=file)
    return int(np.argmax(extent))


def pushed_at_the_end(force: FloatArray) -> bool:
    """Return whether the last granule feels a force before the first, (samples, granules)."""
    counts = np.abs(force) > _PUSH_FORCE_RATIO * np.max(np.abs(force))
    first, last = (np.flatnonzero(counts[:, k]) for k in (0, -1))
    return bool(last.size and (not first.size or last[0] < first[0]))
