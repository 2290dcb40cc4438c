"""Looks at plain scenes side by side every few steps, compiled.

Which lanes have diverged, which can change no peak any more, and what they may leave behind.
Contacts are pressed by their overlap to the power 3/2, so overlaps are compared, not forces.
"""

from __future__ import annotations

import math
from typing import Any

from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.elastic_chain import FREE_END
from hertzchain.engines.native.elastic_legs import DIVERGED_ENERGY
from hertzchain.engines.native.elastic_state import DOUBLE, EPS, SINGLE
from hertzchain.engines.native.lanes import (
    bits,
    load,
    magnitude,
    root,
    same_precision,
    where,
    zero_lanes,
)
from hertzchain.engines.native.lanes_motion import (
    ACTIVE,
    BEGIN,
    BEHIND,
    FIRST,
    FORM,
    FULL,
    LEAVES,
    LEVEL,
    OVER,
    STEP,
    WHOLE,
    WORK,
    larger,
    smaller,
)

_QUIET_GRANULES = 8
_QUIET = 1e4
"""Overlap and velocity of a quiet stretch, in rounding errors of those of the leading wave."""

_IMPACT = 1.3 ** (10 / 3)
"""F > 1.3 v^1.2 for overlaps r: r^5 > 1.3^(10/3) v^4. A granule running into a wall presses by
(5/4)^(3/5) v^1.2 = 1.14 v^1.2, a solitary wave by 1.01 of its fastest granule."""

_SLOWER = 0.95 ** (2 / 3)
"""What is left behind is pressed less than 0.95 of the leading wave; of overlaps."""


@compiled
def gains_energy(x: Any, clock: Any, half: int, rows: int, lo: int, hi: int) -> Any:
    """The lanes that have far more energy than they were given, as integer: they diverge."""
    zero = zero_lanes(x)
    energy, here = zero, load(x, half + lo, zero)
    for i in range(lo, hi):
        ahead, v = load(x, half + i + 1, zero), load(x, half + rows + i, zero)
        r = larger(here - ahead, zero)
        energy = energy + 0.5 * v * v + 0.4 * (r * r * root(r))
        here = ahead
    work = load(clock, WORK, zero)
    stays = same_precision(energy, work) <= DIVERGED_ENERGY * work
    return bits(~stays & (load(clock, ACTIVE, zero) > 0.5))


@compiled
def _stronger(overlap: Any, hardest: Any, fastest: Any) -> Any:
    """Whether overlaps are larger than any that granules so pressed and so fast can come to have.

    Not proved; measured for single runs, see ``elastic_window._strength``.
    """
    square, speed = overlap * overlap, fastest * fastest
    return (overlap > hardest) & (square * square * overlap > _IMPACT * (speed * speed))


@compiled
def _wide(a: Any, b: Any, c: Any, like: Any) -> Any:
    """Three numbers in double precision: their powers are small."""
    return same_precision(a, like), same_precision(b, like), same_precision(c, like)


@compiled
def is_settled(x: Any, clock: Any, highest: Any, half: int, rows: int, lo: int, hi: int) -> Any:
    """The lanes none of whose peaks can change any more, as integer.

    Granules that fly off at the free end never come back; of the others none can press a contact as
    hard as every contact has been pressed already.
    """
    zero = zero_lanes(x)
    behind = load(clock, BEHIND, zero)
    hardest, fastest, weakest = zero, zero, zero + FREE_END
    flies = zero > -1.0
    ahead, v_ahead = load(x, half + hi - 1, zero), load(x, half + rows + hi - 1, zero)
    for k in range(hi - 1 - lo):
        i = hi - 2 - k
        here, v = load(x, half + i, zero), load(x, half + rows + i, zero)
        flies = flies & (here < ahead) & (v < v_ahead)
        hardest = where(flies, hardest, larger(hardest, here - ahead))
        fastest = where(flies, fastest, larger(fastest, larger(v, v - v_ahead)))
        weakest = where(behind <= float(i), smaller(weakest, load(highest, i, zero)), weakest)
        ahead, v_ahead = here, v
    found = _stronger(*_wide(weakest, hardest, fastest, behind))
    can = (load(clock, OVER, zero) > 0.5) & (load(clock, LEAVES, zero) > 0.5)
    return bits(found & can & (load(clock, ACTIVE, zero) > 0.5))


@compiled
def left_behind(x: Any, clock: Any, highest: Any, half: int, rows: int, lo: int, hi: int) -> Any:
    """The first granule of each lane that may still matter to a peak.

    What lies behind it is left once the pulse is over, if eight quiet granules lie ahead of it,
    which only waves can cross, and if what is behind is weaker than the leading wave, so that it is
    slower, and than the peaks of all contacts left behind, which are final.
    """
    zero = zero_lanes(x)
    behind = load(clock, BEHIND, zero)
    going = (load(clock, OVER, zero) > 0.5) & (load(clock, LEAVES, zero) > 0.5)
    if bits(going) == 0:
        return behind
    crest, climbs = behind * 0.0 + float(hi - 1), zero > -1.0
    here = load(x, half + hi - 1, zero)
    leading = here - load(x, half + hi, zero)
    for k in range(hi - 1 - lo):
        i = hi - 2 - k  # whether the crest is at contact i or behind it
        before = load(x, half + i, zero)
        r = before - here
        climbs = climbs & (larger(r, zero) >= leading)
        leading, crest = where(climbs, r, leading), where(climbs, float(i), crest)
        here = before
    leading = larger(leading, zero)
    noise = _QUIET * (SINGLE[EPS] if x.itemsize == 4 else DOUBLE[EPS])
    quiet_overlap = noise * leading
    quiet_velocity = quiet_overlap * root(root(leading))
    hardest, fastest, weakest, quiet = zero, zero, leading, zero
    cut = behind
    here, v = load(x, half + lo, zero), load(x, half + rows + lo, zero)
    for i in range(lo, hi - 1):
        ahead, v_ahead = load(x, half + i + 1, zero), load(x, half + rows + i + 1, zero)
        going = going & (crest > float(i))
        if bits(going) == 0:
            break
        inside = behind <= float(i)
        r = here - ahead
        hardest = where(inside, larger(hardest, r), hardest)
        fastest = where(inside, larger(fastest, larger(v, v - v_ahead)), fastest)
        weakest = where(inside, smaller(weakest, load(highest, i, zero)), weakest)
        silent = inside & (r <= quiet_overlap) & (magnitude(v) <= quiet_velocity)
        quiet = where(silent, quiet + 1.0, zero)
        enough = going & (quiet > _QUIET_GRANULES - 0.5)
        if bits(enough) != 0:
            known = _stronger(*_wide(weakest * _SLOWER, hardest, fastest, behind))
            cut = where(enough & known, float(i + 1 - _QUIET_GRANULES), cut)
        here, v = ahead, v_ahead
    return cut


@compiled
def leave(x: Any, clock: Any, lane: int, cut: int, half: int, rows: int) -> None:
    """Move granules of a lane that are left behind to where they press nothing."""
    for i in range(int(clock[BEHIND, lane]), cut):
        x[half + i, lane] = -FREE_END
        x[half + rows + i, lane] = x[half + 2 * rows + i, lane] = 0.0
    r = max(float(x[half + cut, lane] - x[half + cut + 1, lane]), 0.0)
    x[half + 2 * rows + cut, lane] = -r * math.sqrt(r)
    clock[BEHIND, lane] = cut


@compiled
def end_lane(
    x: Any, clock: Any, highest: Any, highest_at: Any, lane: int, half: int, rows: int, lo: int,
    hi: int,
) -> None:  # fmt: skip
    """Take note of what is still pressed harder, and let a lane rest from now on."""
    for i in range(lo, hi):
        if i < rows - 2:
            r = x[half + i, lane] - x[half + i + 1, lane]
            if r > highest[i, lane]:
                highest[i, lane], highest_at[i, lane] = r, clock[BEGIN, lane]
        x[half + i, lane] = x[half + rows + i, lane] = x[half + 2 * rows + i, lane] = 0.0
    clock[ACTIVE, lane] = clock[STEP, lane] = clock[FULL, lane] = clock[LEVEL, lane] = 0.0
    clock[FORM, lane] = clock[WHOLE, lane] = 0.0
    clock[FIRST, lane] = clock[BEGIN, lane]  # its time stands still
