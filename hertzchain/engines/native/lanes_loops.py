"""Loops over granules of plain scenes side by side, compiled: the compiler makes vectors of them.

In every array the scenes stand side by side, granule by granule: entry ``LANES * i + k`` belongs to
granule i of scene k, and ``LANES`` numbers fill a vector of 512 bits. A loop runs over granules and
scenes at once. What it writes is read again ``LANES`` entries later or not at all, so that as many
may be computed together.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.elastic_maxima import DIP
from hertzchain.engines.native.elastic_state import LEAST

VECTOR = 64
"""Bytes of a vector, and of a cache line."""

LANES = np.uint64(8)
"""Numbers in a vector: a constant, as the compiler makes vectors only where it knows how far
entries are apart; and unsigned, as only indices that are make vectors."""


class Motion(NamedTuple):
    """Displacements, velocities, and the force on each granule from behind."""

    u: FloatArray
    v: FloatArray
    force: FloatArray


class Lanes(NamedTuple):
    """What else is known of scenes side by side."""

    step: FloatArray  # of each granule
    highest: FloatArray  # largest overlap so far of the contact ahead of each granule
    highest_at: FloatArray  # its time
    marks: Any  # whether that contact may have had a higher maximum in the last step
    words: Any  # the same, eight in one number
    scan: FloatArray  # fastest contacts and granules
    scenes: Any  # a record of each scene
    legs: FloatArray


@compiled
def place(i: Any, k: Any) -> Any:
    """Index of granule i of scene k."""
    return np.uint64(i) * LANES + np.uint64(k)


@compiled
def larger(a: float, b: float) -> float:
    """The larger of two numbers; of ``max``, which tells NaN, the compiler makes no vectors."""
    return a if a > b else b


@compiled
def begin_step(old: Any, new: Any, h: Any, kick: Any, drift: Any, lo: int, hi: int) -> None:
    """Kick by the known forces, and drift, from the old motion to the new one."""
    u0, v0, f0, u, v, ahead = old.u, old.v, old.force, new.u, new.v, LANES
    for j in range(place(lo, 0), place(hi, 0)):
        w = v0[j] + kick * h[j] * (f0[j] - f0[j + ahead])
        v[j] = w
        u[j] = u0[j] + drift * h[j] * w


@compiled
def take_stage(new: Any, h: Any, kick: Any, drift: Any, lo: int, hi: int) -> None:
    """Kick by the forces from behind and ahead, and drift."""
    u, v, f, ahead = new.u, new.v, new.force, LANES
    for j in range(place(lo, 0), place(hi, 0)):
        r = u[j] - u[j + ahead]
        r = r if r > LEAST else 0.0
        force = r * np.sqrt(r)
        f[j + ahead] = force
        w = v[j] + kick * h[j] * (f[j] - force)
        v[j] = w
        u[j] += drift * h[j] * w


@compiled
def any_pressed(force: Any, i: int) -> bool:
    """Whether granule i is pushed from behind in any scene."""
    total = 0.0
    for j in range(place(i, 0), place(i + 1, 0)):
        total += force[j]
    return total != 0


@compiled
def find_crossings(
    old: Any, new: Any, h: Any, fastest: Any, starting: bool, lo: int, hi: int
) -> None:
    """Fill in, for each granule and the end, the fastest contact behind that opens or closes.

    Which contacts do is said in ``elastic_maxima.scan``.
    """
    u0, v0, u, v, ahead = old.u, old.v, new.u, new.v, LANES
    for j in range(place(lo, 0), place(lo + 1, 0)):
        fastest[j] = 0.0
    for j in range(place(lo, 0), place(hi, 0)):
        r0, r1 = u0[j] - u0[j + ahead], u[j] - u[j + ahead]
        w0, w1 = v0[j] - v0[j + ahead], v[j] - v[j + ahead]
        rate, nearest = larger(abs(w0), abs(w1)), -larger(-abs(r0), -abs(r1))
        near = (nearest < rate * h[j]) & (((w0 > 0.0) != (w1 > 0.0)) | starting)
        crosses = ((r0 > 0.0) != (r1 > 0.0)) | near
        fastest[j + ahead] = larger(fastest[j], rate if crosses else 0.0)


@compiled
def find_speeds(v: Any, fastest: Any, lo: int, hi: int) -> None:
    """Fill in, for each granule and the end, the velocity of the fastest granule behind."""
    ahead = LANES
    for j in range(place(lo, 0), place(lo + 1, 0)):
        fastest[j] = 0.0
    for j in range(place(lo, 0), place(hi, 0)):
        fastest[j + ahead] = larger(fastest[j], abs(v[j]))


@compiled
def mark_maxima(old: Any, new: Any, h: Any, highest: Any, marks: Any, lo: int, hi: int) -> None:
    """Mark contacts whose overlap may have had its highest maximum in a step.

    Which turn is said in ``elastic_maxima.scan``. Those count that get as far even if
    their rate changes by all that both ends say.
    """
    u0, v0, f0, u, v, f, ahead = old.u, old.v, old.force, new.u, new.v, new.force, LANES
    for j in range(place(lo, 0), place(hi, 0)):
        r0, r1 = u0[j] - u0[j + ahead], u[j] - u[j + ahead]
        w0, w1 = v0[j] - v0[j + ahead], v[j] - v[j + ahead]
        g0 = f0[j] - f0[j + ahead] - (f0[j + ahead] - f0[j + ahead + ahead])
        g1 = f[j] - f[j + ahead] - (f[j + ahead] - f[j + ahead + ahead])
        both = w0 + w1
        towards, back = -both * g0, both * g1
        dips = (towards > 0.0) & (back > 0.0) & (DIP * h[j] * (towards + back) > both * both)
        reach = larger(r0, r1) + h[j] * (abs(w0) + abs(w1) + h[j] * (abs(g0) + abs(g1)))
        marks[j] = (((w0 > 0.0) & (w1 <= 0.0)) | dips) & (reach > highest[j])
