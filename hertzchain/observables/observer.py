"""First pulses of contacts and of gauges in granules, from any sequence of steps, compiled.

A signal is the dynamic force of a contact, or the mean of those of a granule's two contacts: total
force less static. M is its largest value so far. The observer keeps each maximum after which the
signal fell through one of ``FALLS``, with the times of these falls: the largest force of a run, on
which the floor of a first pulse depends, is known only at its end. ``read_off`` has the definition.

Within a step the overlap is the polynomial that meets it and its derivatives at both ends. Where
the rate of the force changes its sign within the step, the force is followed from one extremum to
the next, so that neither a dip nor a hump between the ends of a step is missed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.observables.compiling import Record, Records, compiled, compiled_and_kept, part
from hertzchain.observables.peaks import SIGNIFICANT

State = tuple[float, float, float, float]
"""Overlap of a contact and its first three derivatives; the third is NaN where it is not known."""

Polynomial = tuple[float, float, float, float, float, float, float, float]
"""Coefficients of an overlap in a step over the place s in it, from 0 to 1; s^7 is the last."""


_BINOMIAL = (1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0)


@part
def hertz_force(r: float) -> float:
    """Force of an overlap, at stiffness 1."""
    return r * math.sqrt(r) if r > 0 else 0.0


@part
def hertz_force_rate(r: float, rate: float) -> float:
    """Rate of that force."""
    return 1.5 * math.sqrt(r) * rate if r > 0 else 0.0


@part
def hermite(start: State, end: State, h: float) -> Polynomial:
    """Coefficients in s = (t - t_start) / h of the polynomial of degree 7 that meets both ends."""
    x, p, q, c = np.float64(start[0]), start[1] * h, start[2] * h * h / 2, start[3] * h**3 / 6
    # Differences at the end from the cubic of the start, in value and three derivatives.
    d = end[0] - x - p - q - c
    d1 = end[1] * h - p - 2 * q - 3 * c
    d2 = end[2] * h * h - 2 * q - 6 * c
    d3 = end[3] * h**3 - 6 * c
    return (
        x, p, q, c,
        35 * d - 15 * d1 + 2.5 * d2 - d3 / 6,
        -84 * d + 39 * d1 - 7 * d2 + d3 / 2,
        70 * d - 34 * d1 + 6.5 * d2 - d3 / 2,
        -20 * d + 10 * d1 - 2 * d2 + d3 / 6,
    )  # fmt: skip


@part
def quintic(
    u0: float, v0: float, a0: float, u1: float, v1: float, a1: float, h: float
) -> Polynomial:
    """Coefficients of the polynomial of degree 5 that meets value and two derivatives."""
    p, b = v0 * h, a0 * h * h / 2
    d = u1 - u0 - p - b
    d1 = v1 * h - p - 2 * b
    d2 = a1 * h * h - 2 * b
    return (
        u0, p, b,
        10 * d - 4 * d1 + d2 / 2,
        -15 * d + 7 * d1 - d2,
        6 * d - 3 * d1 + d2 / 2,
        0.0, 0.0,
    )  # fmt: skip


@part
def value_at(c: Polynomial, s: float) -> float:
    """Value of a polynomial of degree 7 at s."""
    return c[0] + s * (
        c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * (c[5] + s * (c[6] + s * c[7])))))
    )


@part
def slope_at(c: Polynomial, s: float) -> float:
    """Its first derivative with respect to s."""
    return c[1] + s * (
        2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * (5 * c[5] + s * (6 * c[6] + s * 7 * c[7]))))
    )


@part
def curvature_at(c: Polynomial, s: float) -> float:
    """Its second derivative with respect to s."""
    return 2 * c[2] + s * (
        6 * c[3] + s * (12 * c[4] + s * (20 * c[5] + s * (30 * c[6] + s * 42 * c[7])))
    )


@part
def _bernstein(c: Polynomial, low: float, width: float, b: FloatArray) -> None:
    """Bernstein coefficients of the slope from low to low + width, times width."""
    for k in range(7):
        b[k] = (k + 1) * c[k + 1]
    scale = width
    for k in range(7):
        for j in range(5, k - 1, -1):
            b[j] += low * b[j + 1]
        b[k] *= scale / _BINOMIAL[k]
        scale *= width
    for k in range(1, 7):
        for j in range(6, k - 1, -1):
            b[j] += b[j - 1]


@part
def is_monotone(c: Polynomial, b: FloatArray) -> bool:
    """Whether a polynomial of degree 7 surely rises or falls all the way from 0 to 1.

    ``b`` is room for coefficients, shape (7,).
    """
    _bernstein(c, 0.0, 1.0, b)
    rises = falls = True
    for k in range(7):
        rises, falls = rises and b[k] >= 0.0, falls and b[k] <= 0.0
    return rises or falls


FALLS = (0.6, 0.5, 0.4)
"""Fractions of M: a pulse ends at the middle one, and is clear where the others give the same
force."""

FLOOR, _OTHER_FLOORS = 0.01, (0.003, 0.03)
"""Least force of a first pulse over the largest of the run, and two other choices to compare."""


LEAST = 1e-9
"""Dynamic forces that are not observed, over the natural unit plus the static force: no pulse that
counts is so weak."""

_END_TIME_RATIO, _PARTING_TIME = 2.0, 3.0
"""Factor on the time at which the last first pulse is over, so that a run has a first reflection,
too; and natural time units after that, in which two spheres part."""

_SLOW_TIME, _SLOW_RATIO = 10.0, 0.25
"""A force that is not over so many time units after its half was reached, or such a part of that
time, if it is longer, is not a wave: loads that settle grow as slowly (chosen). Waves past light
beads
lasted a sixth of the time of their half."""

PULSES = 64
"""Maxima that are kept of a signal, each larger than all before (chosen)."""

PIECES = 128
"""Parts of steps that are kept of a rise, from half of its height on (chosen). If there are more,
neighbours are joined."""


PARTS = 8
"""Parts of a step in which extrema of a force are searched."""

ROOM = PARTS + 10
"""Room for places of extrema and both ends, and for the coefficients of a slope."""


_OPEN_OVERLAP = 1e-6
"""Overlap of an open contact without a force, over its deepest one, by rounding (chosen)."""

_SLOW_OPENING = 0.1
"""Way of the opening granules in a contact time over the deepest overlap (chosen): those that part
more slowly may as well not part, and their contact time has no right digit. Elastic spheres have
2.9."""


_PLACE_ERROR = 1e-13
"""Tolerance of a crossing or an extremum, as a fraction of a step, or of the force."""

SIGNAL = np.dtype(
    [
        (name, np.int64)
        for name in ("contact", "other", "fallen", "pulses", "oldest", "pieces", "crowded")
    ]
    + [
        (name, np.float64)
        for name in (
            "weight", "static", "least", "slowness", "stiffness", "damping", "other_stiffness",
            "other_damping", "damping_exponent", "attracts", "above", "below", "lost",
        )
    ],
    align=True,
)  # fmt: skip
"""A signal: its contact, the other one of a gauge in a granule (-1: none); number of ``FALLS``
passed since the largest force; number of maxima and of pieces, the oldest piece; whether maxima had
to be given up. Then the weight of each force (1, or 1/2 in a granule) and the weighted
static force; the least dynamic force that counts; time unit times F^(1/6), 0 where the drive has
ended; the laws of the contacts; the total forces above and below which a step has something new."""

MAXIMUM = np.dtype(
    [
        (name, np.float64)
        for name in ("force", "time", "arrival", "slope", "exceeded", "closed", "opened")
    ]
)
"""A maximum of a signal, its time, and when the signal first reached half of it; the steepest slope
where it then fell through ``FALLS``; when it was exceeded if it had stood as a front (infinite
while it is not, NaN if it had not); when the force began and when it was over, NaN where the
contact was pressed from the start, had opened before, or has not opened; infinite where it opened
too slowly to say when."""

PULSE = np.dtype(
    [(name, np.float64) for name in ("force", "time", "arrival", "width", "contact_time")]
    + [(name, np.bool_) for name in ("is_clear", "is_front", "is_steady")],
    align=True,
)
"""A first pulse: dynamic force and its time, when the signal first reached half of it, how long
after that the pulse was over (NaN where its end was not seen), and from the closing of the contact
to its opening (NaN where one of both was not seen); and what it is: see
``first_pulse.FirstPulses``."""

RISE = np.dtype(
    [
        (name, np.float64)
        for name in ("begin", "h", "low", "high", "before", "top", "scale", "other_scale")
    ]
    + [(name, np.float64, 4) for name in ("start", "end", "other_start", "other_end")]
)
"""A part of a step in which a signal rises: begin and length of the step; the part, from 0 to 1,
and the forces at its ends; forces over those of the law; overlap and three derivatives of both
contacts at the ends of the step. In joined pieces the scale is 0, and start and end begin with the
rate of the signal."""


class Watch(NamedTuple):
    """Signals observed in a run, and their results so far; ``watch_of`` makes one.

    Parameters
    ----------
    signals
        See ``SIGNAL``, shape (signals,): first those of all contacts, then gauges in granules.
    maxima, falls
        See ``MAXIMUM``, shape (signals, ``PULSES``); when the signal then fell through each of
        ``FALLS``, NaN where it did not, shape (signals, ``PULSES``, 3).
    pieces
        The last rise of each signal, see ``RISE``, shape (signals, ``PIECES``).
    room
        Room for places in a step, and coefficients, shape (``ROOM``,).
    contacts
        Number of contacts, shape (1,).
    pulses
        What was read off at the end, shape (signals,): see ``PULSE``.
    """

    signals: Records
    maxima: Records
    falls: FloatArray
    pieces: Records
    room: FloatArray
    contacts: NDArray[np.int64]
    pulses: Records


class Law(NamedTuple):
    """The law of one contact, with the names that a signal has."""

    stiffness: float
    damping: float
    damping_exponent: float
    attracts: float
    other_stiffness: float
    other_damping: float
    weight: float
    static: float


class Piece(NamedTuple):
    """The force of a signal in a step: begin, length, overlaps of both contacts, and scales."""

    begin: float
    h: float
    a: Polynomial
    b: Polynomial
    scale: float
    other_scale: float


class Step(NamedTuple):
    """A step that a signal is looked at in.

    Parameters
    ----------
    begin, h
        Begin and length of the step.
    start, end, other_start, other_end
        Overlap and its first three derivatives of both contacts at both ends; the third is NaN
        where it is not known.
    scale, other_scale
        Forces of the run over those of the law.
    """

    begin: float
    h: float
    start: State
    end: State
    other_start: State
    other_end: State
    scale: float
    other_scale: float


class Stretch(NamedTuple):
    """A part of a step, its ends from 0 to 1, and the dynamic forces there."""

    low: float
    high: float
    before: float
    top: float


def watch_of(signals: Records, contacts: int) -> Watch:
    """Return a watch on signals, the first of which are those of all contacts."""
    count = signals.size
    pulses = np.zeros(count, PULSE)
    for name in ("force", "time", "arrival", "width", "contact_time"):
        pulses[name] = np.nan
    return Watch(
        signals, np.zeros((count, PULSES), MAXIMUM), np.zeros((count, PULSES, len(FALLS))),
        np.zeros((count, PIECES), RISE), np.zeros(ROOM), np.array([contacts]), pulses,
    )  # fmt: skip


# ---- The force of a signal within a step


@part
def power_of(d: float, damping_exponent: float) -> float:
    """Power of an overlap; roots are quicker than powers."""
    if damping_exponent == 0.0:
        return 1.0
    if damping_exponent == 0.5:
        return math.sqrt(d)
    return math.sqrt(math.sqrt(d)) if damping_exponent == 0.25 else d**damping_exponent


@part
def acting_force(
    d: float, w: float, stiffness: float, damping: float, damping_exponent: float
) -> float:
    """Force of a contact at an overlap and its rate, without a limit."""
    if d <= 0.0:
        return 0.0
    force = stiffness * d * math.sqrt(d)
    if damping != 0.0:
        force += damping * power_of(d, damping_exponent) * w
    return force


@part
def acting_rate(
    d: float, w: float, bend: float, stiffness: float, damping: float, damping_exponent: float
) -> float:
    """Rate of that force.

    That of an open contact is almost 0, with the sign of the overlap's rate: so an extremum is
    found next to the place where a contact closes or opens.
    """
    if d <= 0.0:
        # Rate of the force of an open contact over the rate of its overlap
        return 1e-200 * w
    rate = 1.5 * stiffness * math.sqrt(d) * w
    if damping != 0.0:
        rate += damping * power_of(d, damping_exponent) * (damping_exponent * w * w / d + bend)
    return rate


@part
def law_of(d: float, w: float, stiffness: float, damping: float, s: Record) -> float:
    """Force of a contact of a signal; 0 or more where contacts do not attract."""
    force = acting_force(d, w, stiffness, damping, s.damping_exponent)
    return force if s.attracts != 0.0 else max(force, 0.0)


@part
def force_at(p: Piece, place: float, s: Record) -> float:
    """Dynamic force of a signal at a place of a step, from 0 to 1."""
    w = slope_at(p.a, place) / p.h
    force = p.scale * law_of(value_at(p.a, place), w, s.stiffness, s.damping, s)
    if s.other_stiffness > 0.0:
        w = slope_at(p.b, place) / p.h
        force += p.other_scale * law_of(
            value_at(p.b, place), w, s.other_stiffness, s.other_damping, s
        )
    return s.weight * force - s.static


@part
def rate_at(p: Piece, place: float, s: Record) -> float:
    """Rate of the force of a signal at a place of a step."""
    w, bend = slope_at(p.a, place) / p.h, curvature_at(p.a, place) / (p.h * p.h)
    rate = p.scale * acting_rate(
        value_at(p.a, place), w, bend, s.stiffness, s.damping, s.damping_exponent
    )
    if s.other_stiffness > 0.0:
        w, bend = slope_at(p.b, place) / p.h, curvature_at(p.b, place) / (p.h * p.h)
        rate += p.other_scale * acting_rate(
            value_at(p.b, place), w, bend, s.other_stiffness, s.other_damping, s.damping_exponent
        )
    return s.weight * rate


@part
def curve_of(start: State, end: State, h: float) -> Polynomial:
    """The overlap in a step; of lower degree where a third derivative is not known."""
    if start[3] != start[3] or end[3] != end[3]:
        return quintic(start[0], start[1], start[2], end[0], end[1], end[2], h)
    return hermite(start, end, h)


@compiled
def _place(
    p: Piece, level: float, low: float, high: float, at_low: float, at_high: float, of_rate: bool,
    s: Record,
) -> float:  # fmt: skip
    """Place between low and high where a force or its rate crosses a level (Illinois method).

    ``at_low`` and ``at_high`` are its values there: at a jump they are not those of the law.
    """
    rises = at_high > at_low
    if (at_low >= level) == rises:
        return low
    if (at_high >= level) != rises:
        return high
    enough = _PLACE_ERROR * max(abs(level), max(abs(at_low), abs(at_high)) if of_rate else 0.0)
    at_low, at_high = at_low - level, at_high - level
    side, place = 0, low
    for _ in range(60):
        place = (low * at_high - high * at_low) / (at_high - at_low)
        if not low < place < high:
            place = (low + high) / 2
        value = (rate_at(p, place, s) if of_rate else force_at(p, place, s)) - level
        if (value >= 0.0) == rises:
            at_low = at_low / 2 if side == 1 else at_low
            high, at_high, side = place, value, 1
        else:
            at_high = at_high / 2 if side == -1 else at_high
            low, at_low, side = place, value, -1
        if high - low <= _PLACE_ERROR or abs(value) <= enough:
            break
    return place


@compiled
def extrema(p: Piece, edge: float, places: FloatArray, s: Record) -> int:
    """Fill in where in a step a force has extrema, from [1] on, and return how many.

    Maxima and minima take turns. An ``edge`` at both ends of the step is left out.
    """
    count = 0
    before = rate_at(p, edge, s)
    for n in range(1, PARTS + 1):
        rate = rate_at(p, n / PARTS, s)
        if (before > 0.0) != (rate > 0.0):
            since = max((n - 1) / PARTS, edge)
            place = _place(p, 0.0, since, n / PARTS, before, rate, True, s)
            if edge <= place <= 1.0 - edge:
                count += 1
                places[count] = place
        before = rate
    return count


@compiled
def highest(
    start: State, end: State, h: float, stiffness: float, damping: float, damping_exponent: float,
    attracts: float,
) -> tuple[float, float]:  # fmt: skip
    """The highest maximum of the force of a contact within a step, and its place from 0 to 1.

    Twice 0 where there is none. Arguments are as for ``look``.
    """
    nothing = (0.0, 0.0, 0.0, 0.0)
    s = Law(stiffness, damping, damping_exponent, attracts, 0.0, 0.0, 1.0, 0.0)
    p = Piece(0.0, h, curve_of(start, end, h), curve_of(nothing, nothing, h), 1.0, 1.0)
    force, place = 0.0, 0.0
    rate = rate_at(p, 0.0, s)
    for n in range(1, PARTS + 1):
        before, rate = rate, rate_at(p, n / PARTS, s)
        if before > 0.0 and not rate > 0.0:
            at = _place(p, 0.0, (n - 1) / PARTS, n / PARTS, before, rate, True, s)
            top = force_at(p, at, s)
            if top > force:
                force, place = top, at
    return force, place


# ---- What is kept


@part
def _row(s: Record, n: int) -> int:
    """Row of the n-th piece of a signal, from the oldest one on."""
    return (s.oldest + n) % PIECES


@part
def _piece_of(row: Step | Record) -> Piece:
    """The force of a signal in a step, or in a kept piece."""
    a = curve_of(row.start, row.end, row.h)
    b = curve_of(row.other_start, row.other_end, row.h)
    return Piece(row.begin, row.h, a, b, row.scale, row.other_scale)


@part
def _cubic(s: float, f0: float, f1: float, rise0: float, rise1: float) -> float:
    """The cubic with given values and slopes at 0 and 1."""
    rest = 1.0 - s
    blend = s * s * (3.0 - 2.0 * s)
    return f0 + (f1 - f0) * blend + s * rest * (rise0 * rest - rise1 * s)


@compiled
def _reached(w: Watch, k: int, level: float) -> float:
    """When a signal first reached a level, at least half of its largest force so far.

    NaN where such low pieces had to be dropped.
    """
    s = w.signals[k]
    for n in range(s.pieces):
        row = w.pieces[k, _row(s, n)]
        if not row.top >= level > s.lost:
            continue
        low, high = row.low, row.high
        if row.scale == 0.0:
            rise, rise_at_end = row.h * row.start[0], row.h * row.end[0]
            for _ in range(53):  # bisections: to the last digit
                place = (low + high) / 2
                if _cubic(place, row.before, row.top, rise, rise_at_end) < level:
                    low = place
                else:
                    high = place
        else:
            high = _place(_piece_of(row), level, low, high, row.before, row.top, False, s)
        return float(row.begin + row.h * high)
    return math.nan


@part
def _rate_of_piece(row: Record, place: float, s: Record) -> float:
    """Rate of the force at an end of a kept piece."""
    if row.scale == 0.0:
        return float(row.start[0] if place == 0.0 else row.end[0])
    return rate_at(_piece_of(row), place, s)


@part
def _joins(row: Record, later: Record, to: Record, s: Record) -> bool:
    """Join two pieces into the cubic through both ends, if it is right where they meet."""
    begin, middle = row.begin + row.low * row.h, row.begin + row.high * row.h
    since, end = later.begin + later.low * later.h, later.begin + later.high * later.h
    h = end - begin
    if abs(since - middle) > 1e-9 * h or middle == begin or since == end:
        return False
    before, after = _rate_of_piece(row, row.low, s), _rate_of_piece(later, later.high, s)
    first, last, met = row.before, later.top, row.top
    off = _cubic((middle - begin) / h, first, last, h * before, h * after) - met
    # How far the cubic over two pieces may be off where they meet, over the force there (chosen)
    if abs(off) > 1e-9 * (met + s.static):
        return False
    to.begin, to.h, to.low, to.high, to.before, to.top = begin, h, 0.0, 1.0, first, last
    to.start[0], to.end[0], to.scale = before, after, 0.0
    return True


@compiled
def _join(w: Watch, k: int) -> None:
    """Join neighbouring pieces two by two; give up the oldest where none can be joined."""
    s = w.signals[k]
    kept, n = 0, 0
    while n < s.pieces:
        row, later = w.pieces[k, _row(s, n)], w.pieces[k, _row(s, n + 1)]
        to = w.pieces[k, _row(s, kept)]
        if n + 1 < s.pieces and _joins(row, later, to, s):
            n += 1
        else:
            w.pieces[k, _row(s, kept)] = row
        kept, n = kept + 1, n + 1
    if kept == s.pieces:
        s.lost = w.pieces[k, s.oldest].top
        s.oldest, kept = (s.oldest + 1) % PIECES, kept - 1
    s.pieces = kept


@compiled
def _keep_piece(w: Watch, k: int, step: Step, part: Stretch) -> None:
    """Keep a part of a step in which a signal rises above all before; forget lower halves."""
    s = w.signals[k]
    while s.pieces > 0 and w.pieces[k, s.oldest].top < part.top / 2:
        s.oldest, s.pieces = (s.oldest + 1) % PIECES, s.pieces - 1
    if s.pieces == PIECES:
        _join(w, k)
    row = w.pieces[k, _row(s, s.pieces)]
    s.pieces += 1
    row.begin, row.h, row.scale, row.other_scale = step.begin, step.h, step.scale, step.other_scale
    row.low, row.high, row.before, row.top = part.low, part.high, part.before, part.top
    for n in range(4):
        row.start[n], row.other_start[n] = step.start[n], step.other_start[n]
        row.end[n], row.other_end[n] = step.end[n], step.other_end[n]


@compiled
def _begin_maximum(w: Watch, k: int, force: float) -> None:
    """Make room for a new maximum, larger than all before.

    Those below the lowest floor go first, as no pulse can be so weak any more; then, never the
    first one, that which exceeds the one before it least.
    """
    s, maxima, falls = w.signals[k], w.maxima[k], w.falls[k]
    if s.pulses == PULSES:
        gone, least = 0, math.inf
        if maxima[0].force >= _OTHER_FLOORS[0] * force:
            s.crowded = 1
            for n in range(1, PULSES):
                if maxima[n].force / maxima[n - 1].force < least:
                    gone, least = n, maxima[n].force / maxima[n - 1].force
        for n in range(gone, PULSES - 1):
            maxima[n] = maxima[n + 1]
            for m in range(len(FALLS)):
                falls[n, m] = falls[n + 1, m]
        s.pulses -= 1
    n, s.pulses, s.fallen = s.pulses, s.pulses + 1, 0
    maxima[n].arrival = maxima[n].exceeded = maxima[n].closed = maxima[n].opened = math.nan
    maxima[n].slope = 0.0
    falls[n, 0] = falls[n, 1] = falls[n, 2] = math.nan


@part
def _set_levels(s: Record, maximum: Record) -> None:
    """Set the total forces above and below which a step has something new."""
    s.above = s.static + maximum.force
    s.below = -math.inf
    if s.fallen < 3:
        s.below = s.static + FALLS[s.fallen] * maximum.force
    elif math.isnan(maximum.opened) and not math.isnan(maximum.closed):
        s.below = 0.0


@compiled
def _touch(p: Piece, low: float, high: float, closes: bool) -> float:
    """Return the place in a part of a step where the overlap of a contact begins, or ends."""
    for _ in range(53):  # bisections: to the last digit
        place = (low + high) / 2
        if (value_at(p.a, place) > 0.0) == closes:
            high = place
        else:
            low = place
    return high


@compiled
def _closed(p: Piece, part: Stretch, s: Record) -> float:
    """When the contact of a signal closed within a part of a step; NaN under a static load.

    Granules that touch at rest have overlaps that grow from 0 without a begin: their contact counts
    as closed from the least force on that is observed.
    """
    if s.static > 0.0:
        return math.nan
    overlap, rate = value_at(p.a, 0.0), slope_at(p.a, 0.0)
    if overlap < 0.0 or (overlap == 0.0 and rate > 0.0):
        place = _touch(p, part.low, part.high, True)
    else:
        place = _place(
            p, s.least, part.low, part.high, force_at(p, part.low, s), part.top, False, s
        )
    return float(p.begin + p.h * place)


@compiled
def _rise(w: Watch, k: int, p: Piece, step: Step, part: Stretch) -> None:
    """A signal rises within a part of a step to a dynamic force that is larger than all before."""
    s, maxima = w.signals[k], w.maxima[k]
    last = s.pulses - 1
    stood = False
    if last >= 0 and s.slowness > 0.0:
        stands, since = maxima[last].force, maxima[last].time
        unit = s.slowness * (stands + s.static) ** (-1 / 6)
        # A front: time without a larger force [time units of the contact], and the ratio that ends
        # it
        stood = p.begin - since > 10.0 * unit
        if stood and math.isnan(maxima[last].exceeded):
            maxima[last].arrival = _reached(w, k, stands / 2)
            maxima[last].exceeded = math.inf
    if last < 0 or s.fallen > 0 or stood:
        closed = _closed(p, part, s)
        if last >= 0:
            closed = maxima[last].closed if math.isnan(maxima[last].opened) else math.nan
        _begin_maximum(w, k, part.top)
        maxima[s.pulses - 1].closed = closed
    _keep_piece(w, k, step, part)
    maximum = maxima[s.pulses - 1]
    maximum.force, maximum.time = part.top, p.begin + part.high * p.h
    if s.slowness > 0.0:
        for n in range(s.pulses - 1):
            level = 1.01 * maxima[n].force
            if maxima[n].exceeded == math.inf and part.top > level:
                place = _place(p, level, part.low, part.high, part.before, part.top, False, s)
                maxima[n].exceeded = p.begin + p.h * place
    s.fallen = 0
    _set_levels(s, maximum)


@compiled
def _fall(w: Watch, k: int, p: Piece, part: Stretch) -> None:
    """A signal falls within a part of a step through one of ``FALLS``, or several."""
    s = w.signals[k]
    last = s.pulses - 1
    maximum = w.maxima[k, last]
    while s.fallen < 3 and part.top <= FALLS[s.fallen] * maximum.force:
        place = part.low
        if part.high > part.low:
            level = FALLS[s.fallen] * maximum.force
            place = _place(p, level, part.low, part.high, part.before, part.top, False, s)
        w.falls[k, last, s.fallen] = p.begin + place * p.h
        maximum.slope = max(maximum.slope, abs(rate_at(p, place, s)))
        if s.fallen == 1:
            maximum.arrival = _reached(w, k, maximum.force / 2)
        s.fallen += 1
    # A damper may take the whole force of a contact that is still closed; a step that ends where
    # the contact opens does so within rounding.
    deepest = (maximum.force / s.stiffness) ** (2 / 3)
    is_open = s.static + part.top <= 0.0 and value_at(p.a, part.high) <= _OPEN_OVERLAP * deepest
    if is_open and math.isnan(maximum.opened):
        place = _touch(p, part.low, part.high, False)
        maximum.opened = p.begin + p.h * place
        speed = -slope_at(p.a, place) / p.h
        if speed * (maximum.opened - maximum.closed) < _SLOW_OPENING * deepest:
            maximum.opened = math.inf
    _set_levels(s, maximum)


@part
def has_news(s: Record, least: float, most: float) -> bool:
    """Whether a step matters in which the total force of a signal lies between two bounds."""
    return most > s.above or least <= s.below


@compiled
def look(w: Watch, k: int, step: Step, f0: float, f1: float, smooth: bool) -> None:
    """Look at a signal, by its number, within a step.

    Parameters
    ----------
    f0, f1
        Total force at both ends. They may differ from those of the law where the force jumps.
    smooth
        Whether the force is smooth from the start on; if not, as where a dashpot closes, no
        extrema are searched: no polynomial has the force right after it.
    """
    s = w.signals[k]
    p = _piece_of(step)
    places, count = w.room, 1
    places[0] = 0.0
    is_elastic = s.damping == 0.0 and s.other_stiffness == 0.0
    if smooth and not (is_elastic and is_monotone(p.a, w.room[PARTS + 2 :])):
        # Part of a step at its ends in which no extrema are searched (chosen): where a contact
        # closes, rounding decides whether it is open at the very start
        count += extrema(p, 1e-6, places, s)
    places[count] = 1.0
    force = f0 - s.static
    if s.pulses > 0 and f0 <= s.below:  # the force jumps
        _fall(w, k, p, Stretch(0.0, 0.0, force, force))
    elif f0 > s.above:
        _rise(w, k, p, step, Stretch(0.0, 0.0, force, force))
    for n in range(1, count + 1):
        before = force
        force = f1 - s.static if n == count else force_at(p, places[n], s)
        part = Stretch(places[n - 1], places[n], before, force)
        if force > before and s.static + force > s.above:
            _rise(w, k, p, step, part)
        elif s.static + force <= s.below and s.pulses > 0:
            _fall(w, k, p, part)


# ---- What is read off


@part
def _end_of(w: Watch, k: int, fall: int, floor: float) -> int:
    """The first maximum of a signal that ends a pulse; the number of maxima where none does."""
    s, maxima = w.signals[k], w.maxima[k]
    least = floor * maxima[s.pulses - 1].force
    for n in range(s.pulses):
        if maxima[n].force >= least and not math.isnan(w.falls[k, n, fall]):
            return n
    return int(s.pulses)


@part
def _largest(w: Watch) -> float:
    """The largest dynamic force of all contacts so far."""
    most = 0.0
    for k in range(w.contacts[0]):
        if w.signals[k].pulses > 0:
            most = max(most, w.maxima[k, w.signals[k].pulses - 1].force)
    return most


@part
def _rounded_up(time: float) -> float:
    """A time with two digits."""
    unit = 10.0 ** (math.floor(math.log10(time)) - 1)
    return math.ceil(time / unit * (1 - 1e-12)) * unit


@compiled
def usual_end(w: Watch, otherwise: float, at: float, before: float) -> float:
    """The default end of a run, as it is known at a time ``at``, natural units.

    ``at`` is the time that the run was to reach: its last step may end up to a unit later.
    ``before`` is the end that was returned before; if it is returned again, the run is over.

    It is twice the time at which the last first pulse was over, plus three: but no later than
    ``otherwise``, if that is three units after this time. A first pulse that is not over is waited
    for; if it grows slowly (``_SLOW_TIME``), only until ``otherwise``.
    While a contact has not been pressed the end is ``otherwise``, or twice the time at which the
    last one of the others was first pressed, and three units. It is rounded up to two digits, so
    that rounding errors do not show.
    """
    least, latest, newest, are_all_pressed = SIGNIFICANT * _largest(w), 0.0, 0.0, True
    over, are_all_over = 0.0, True
    for k in range(w.contacts[0]):
        count = w.signals[k].pulses
        if count == 0 or not w.maxima[k, count - 1].force >= least:
            are_all_pressed = False
            continue
        n, last = _end_of(w, k, 1, FLOOR), w.maxima[k, count - 1]
        time = w.falls[k, n, 1] if n < count else min(last.time, at)
        latest, newest = max(latest, time), max(newest, w.maxima[k, 0].time)
        if n < count:
            over = max(over, time)
        else:
            half = _reached(w, k, last.force / 2)
            are_all_over = are_all_over and at - half > max(_SLOW_TIME, _SLOW_RATIO * half)
    if are_all_pressed:
        end = _rounded_up(_END_TIME_RATIO * latest + _PARTING_TIME)
        if not are_all_over:
            end = min(end, max(otherwise, at + 1.0))
        elif over + _PARTING_TIME > otherwise:
            end = min(end, _rounded_up(over + _PARTING_TIME))
        else:
            end = min(end, otherwise)
    else:
        end = max(_rounded_up(_END_TIME_RATIO * newest + _PARTING_TIME), otherwise)
    if at == before:
        return max(end, at)
    return max(end, _rounded_up(at + 1.0))


@part
def _force_of(w: Watch, k: int, n: int, front: int) -> float:
    """The force of the pulse that ends at a maximum, with the last one, or before as a front."""
    s, maxima = w.signals[k], w.maxima[k]
    if front >= 0 and (n == s.pulses or maxima[front].exceeded < w.falls[k, n, 1]):
        return float(maxima[front].force)
    return float(maxima[min(n, s.pulses - 1)].force)


@compiled_and_kept()
def read_off(w: Watch) -> None:
    """Fill in the first pulse of each signal at the end of a run.

    A first pulse ends the first time that the signal falls to M / 2, once M is at least ``FLOOR``
    times the largest value of the run. Where the drive acts until the end, it also ends where the
    signal exceeds an M that has stood for ten time units of its contact by more than 1 %: a front.
    """
    most = _largest(w)
    for k in range(w.signals.size):
        s, maxima, pulse = w.signals[k], w.maxima[k], w.pulses[k]
        count = s.pulses
        if count == 0 or not maxima[count - 1].force >= SIGNIFICANT * most:
            continue
        n, front = _end_of(w, k, 1, FLOOR), -1
        for m in range(count):
            stood = not math.isnan(maxima[m].exceeded)
            if stood and maxima[m].force >= FLOOR * maxima[count - 1].force:
                front = m
                break
        if front >= 0 and not maxima[front].exceeded < math.inf:
            front = -1
        is_front = front >= 0 and (n == count or maxima[front].exceeded < w.falls[k, n, 1])
        chosen = front if is_front else min(n, count - 1)
        force = maxima[chosen].force
        pulse.force, pulse.time = force, maxima[chosen].time
        is_ended = is_front or n < count
        over = math.nan
        if is_ended:
            over = maxima[front].exceeded if is_front else w.falls[k, n, 1]
        pulse.arrival = maxima[chosen].arrival if is_ended else _reached(w, k, force / 2)
        pulse.width = over - pulse.arrival
        if maxima[chosen].opened < math.inf:
            pulse.contact_time = maxima[chosen].opened - maxima[chosen].closed
        first, last = _end_of(w, k, 0, FLOOR), _end_of(w, k, 2, FLOOR)
        is_clear = not math.isnan(pulse.width) and (s.crowded == 0 or chosen == 0)
        for other in (
            first, last, _end_of(w, k, 1, _OTHER_FLOORS[0]), _end_of(w, k, 1, _OTHER_FLOORS[1]),
        ):  # fmt: skip
            # Difference of forces up to which two choices give the same pulse
            is_clear = is_clear and abs(_force_of(w, k, other, front) - force) <= 0.01 * force
        pulse.is_clear, pulse.is_front = is_clear, is_front
        pulse.is_steady = is_front
        if not is_front and last < count:
            slope = max(maxima[first].slope, maxima[last].slope, maxima[n].slope)
            lasts = w.falls[k, last, 2] - w.falls[k, first, 0]
            # How long a steady fall from the first of ``FALLS`` to the last takes at most, over
            # what it would take at its steepest slope (exponential: 1.2). Otherwise the force may
            # dip to a half and rise again, and the end has no right digit.
            pulse.is_steady = lasts * slope <= 2.0 * (FALLS[0] - FALLS[2]) * force
