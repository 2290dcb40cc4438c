"""What is observed within the steps of elastic contacts, compiled: maxima and first pulses."""

from __future__ import annotations

from typing import Any

import numpy as np

from hertzchain.engines.native.elastic_chain import motion_of_contact, overlap_of, with_stiffness
from hertzchain.observables.compiling import (
    ONE,
    compiled,
    compiled_without_nan,
    larger,
    part,
)
from hertzchain.observables.interpolant import hertz_force
from hertzchain.observables.observer import has_news, highest, look

DIP = 0.75
"""Factor on the step: see ``scan``. A half would suffice if overlap rates were parabolas."""


@compiled_without_nan
def scan(
    u0: Any, v0: Any, a: Any, u: Any, v: Any, g: Any, h: float, starting: bool, lo: int, hi: int,
    chain: Any,
) -> Any:  # fmt: skip
    """Scan a step: contacts with a maximum, the fastest to open or close, the largest speed.

    A contact has had a maximum if its overlap rate w changes its sign. It may also have had one
    where w may change its sign twice: w has the same sign at both ends, bends towards 0 at the
    start and back at the end, and bends enough. A parabola c (t - t')^2 - d, d >= 0, that reaches 0
    within a step of length h has w0 + w1 <= h (w1' - w0') / 2; ``DIP`` is the half and a margin.
    Rates that change their sign three times in a step are not considered. ``methods.Walker``
    defines which contacts open or close. The contact ahead of the last granule is included, though
    it is never pressed: a whole number of vectors is quicker than one contact less.
    """
    turns, dips, fastest, speed, dip = 0, 0, 0.0, 0.0, DIP * h
    for i in range(np.uint64(lo), np.uint64(hi)):
        r0, r1 = u0[i] - u0[i + ONE], u[i] - u[i + ONE]
        if chain is not None:
            r0 -= chain.gap[i]
            r1 -= chain.gap[i]
        w0, w1 = v0[i] - v0[i + ONE], v[i] - v[i + ONE]
        g0, g1 = a[i] - a[i + ONE], g[i] - g[i + ONE]
        both = w0 + w1
        turns += (w0 > 0.0) & (w1 <= 0.0)
        towards, back = -both * g0, both * g1
        dips += (towards > 0.0) & (back > 0.0) & (dip * (towards + back) > both * both)
        rate = max(abs(w0), abs(w1))
        turns_round = ((w0 > 0.0) != (w1 > 0.0)) | starting
        near = (min(abs(r0), abs(r1)) < rate * h) & turns_round
        crosses = ((r0 > 0.0) != (r1 > 0.0)) | near
        fastest = larger(fastest, rate if crosses else 0.0)
        speed = larger(speed, abs(v[i]))
    return turns, dips > 0, fastest, speed


@part
def keep_peaks(
    seen: Any, u0: Any, v0: Any, a: Any, u: Any, v: Any, g: Any, lo: int, hi: int,
    leg: Any, begin: float, time: float, h: float, off: float, dips: bool, slack: float,
    chain: Any,
) -> None:  # fmt: skip
    """The maxima of contact forces within a step, of the contacts that ``scan`` finds.

    ``time`` is that of the end of the step, to the last digit. ``slack`` is 0, and h for velocity
    Verlet: its rates are off by h^2 / 6 times the jerk, so rates count as 0 up to six times that,
    if the jerk stays the same.
    """
    peak_force, peak_time, dip = seen.force, seen.time, DIP * h
    for i in range(lo, hi - 1):
        w0, w1 = v0[i] - v0[i + 1], v[i] - v[i + 1]
        if not dips and not (w0 > 0 and w1 <= 0):
            continue
        g0, g1 = a[i] - a[i + 1], g[i] - g[i + 1]
        near, both = slack * abs(g1 - g0), w0 + w1
        turns = w0 + near > 0 and w1 - near <= 0
        towards, back = -both * g0, both * g1
        dips_here = towards > 0 and back > 0 and dip * (towards + back) > both * both
        if not turns and not dips_here:
            continue
        r0, r1 = overlap_of(u0, i, chain), overlap_of(u, i, chain)
        # The largest overlap possible, with the largest change of rate that both ends allow.
        reach = max(r0, r1) + h * (abs(w0) + abs(w1) + h * (abs(g0) + abs(g1)))
        if with_stiffness(hertz_force(reach), i, chain) <= peak_force[i]:
            continue
        # The ends count, too: rounding may hide a maximum at one of them.
        ends = with_stiffness(hertz_force(max(r0, r1)), i, chain)
        if ends > peak_force[i]:
            peak_force[i] = ends
            peak_time[i] = time if r1 > r0 else begin
        start = motion_of_contact(u0, v0, i, lo, leg, begin, off, chain)
        end = motion_of_contact(u, v, i, lo, leg, begin + h, off, chain)
        force, s = highest(start, end, h, with_stiffness(1.0, i, chain), 0.0, 0.5, 0.0)
        if force > peak_force[i]:
            peak_force[i], peak_time[i] = force, begin + s * h


@part
def _range(
    u0: Any, v0: Any, a: Any, u: Any, v: Any, g: Any, i: int, h: float, slack: float, chain: Any
) -> Any:  # fmt: skip
    """Bounds of a contact force within a step; twice 0 for a contact that stays open."""
    r0, r1 = overlap_of(u0, i, chain), overlap_of(u, i, chain)
    w0, w1 = float(v0[i] - v0[i + 1]), float(v[i] - v[i + 1])
    least, most = min(r0, r1), max(r0, r1)
    if most <= 0.0 and not w0 > 0.0 > w1:
        return 0.0, 0.0
    g0, g1 = float(a[i] - a[i + 1]), float(g[i] - g[i + 1])
    near, both = slack * abs(g1 - g0), w0 + w1
    towards, back = -both * g0, both * g1
    turns = (w0 + near > 0.0) != (w1 - near > 0.0) or (w0 - near > 0.0) != (w1 + near > 0.0)
    if turns or (towards > 0.0 and back > 0.0 and DIP * h * (towards + back) > both * both):
        reach = h * (abs(w0) + abs(w1) + h * (abs(g0) + abs(g1)))
        least, most = least - reach, most + reach
    return (
        with_stiffness(hertz_force(least), i, chain), with_stiffness(hertz_force(most), i, chain)
    )  # fmt: skip


@part
def _ends(
    u0: Any, v0: Any, u: Any, v: Any, i: int, lo: int, leg: Any, begin: float, h: float,
    off: float, chain: Any,
) -> Any:  # fmt: skip
    """Motion of a contact at the start and the end of a step, and its force there."""
    start = motion_of_contact(u0, v0, i, lo, leg, begin, off, chain)
    end = motion_of_contact(u, v, i, lo, leg, begin + h, off, chain)
    f0 = with_stiffness(hertz_force(start[0]), i, chain)
    return start, end, f0, with_stiffness(hertz_force(end[0]), i, chain)


@compiled
def observe(
    watch: Any, u0: Any, v0: Any, a: Any, u: Any, v: Any, g: Any, lo: int, hi: int, leg: Any,
    begin: float, time: float, off: float, verlet: bool, chain: Any,
) -> None:  # fmt: skip
    """Look at the contacts of the window, and at gauges in granules, within a step.

    Rates of velocity Verlet count as 0 near 0: see ``keep_peaks``.
    """
    h, nothing = time - begin, (0.0, 0.0, 0.0, 0.0)
    slack = h if verlet else 0.0
    for i in range(lo, hi - 1):
        least, most = _range(u0, v0, a, u, v, g, i, h, slack, chain)
        if has_news(watch.signals[i], least, most):
            start, end, f0, f1 = _ends(u0, v0, u, v, i, lo, leg, begin, h, off, chain)
            look(watch, i, begin, h, start, end, nothing, nothing, 1.0, 1.0, f0, f1, True)
    for k in range(watch.contacts[0], watch.signals.size):
        s = watch.signals[k]
        i, j = s.contact, s.other
        least, most = _range(u0, v0, a, u, v, g, i, h, slack, chain)
        if j >= 0:
            other_least, other_most = _range(u0, v0, a, u, v, g, j, h, slack, chain)
            least, most = least + other_least, most + other_most
        if has_news(s, s.weight * least, s.weight * most):
            start, end, f0, f1 = _ends(u0, v0, u, v, i, lo, leg, begin, h, off, chain)
            before, after = nothing, nothing
            if j >= 0:
                before, after, g0, g1 = _ends(u0, v0, u, v, j, lo, leg, begin, h, off, chain)
                f0, f1 = f0 + g0, f1 + g1
            look(
                watch, k, begin, h, start, end, before, after, 1.0, 1.0, s.weight * f0,
                s.weight * f1, True,
            )  # fmt: skip


@part
def keep_ends(seen: Any, u: Any, lo: int, hi: int, time: float, chain: Any) -> None:
    """Keep forces of contacts that are pressed hardest at the end of a run."""
    for i in range(lo, hi - 1):
        force = with_stiffness(hertz_force(overlap_of(u, i, chain)), i, chain)
        if force > seen.force[i]:
            seen.force[i], seen.time[i] = force, time
