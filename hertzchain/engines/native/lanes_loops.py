"""Loops over granules of plain scenes side by side, compiled: the compiler makes vectors of them.

In every array the scenes stand side by side, granule by granule: entry ``lanes * i + k`` belongs to
granule i of scene k, and ``lanes`` numbers fill a vector of 512 bits. A loop runs over granules and
scenes at once. What it writes is read again ``lanes`` entries later or not at all, so that as many
may be computed together.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from hertzchain.arrays import Array, FloatArray
from hertzchain.engines.native.compiling import compiled
from hertzchain.engines.native.elastic_maxima import DIP

VECTOR = 64
"""Bytes of a vector, and of a cache line."""

_ZERO, _TURNS_TWICE = np.float32(0.0), np.float32(DIP)
"""Exact in single precision, which with numbers of double precision becomes that."""


class Motion(NamedTuple):
    """Displacements, velocities, and the force on each granule from behind."""

    u: Array
    v: Array
    force: Array


class Lanes(NamedTuple):
    """What else is known of scenes side by side."""

    step: Array  # of each granule, as the other arrays in the precision of the run
    highest: Array  # largest overlap so far of the contact ahead of each granule
    highest_at: FloatArray  # its time
    marks: Any  # whether that contact may have had a higher maximum in the last step
    words: Any  # the same, eight in one number
    scan: Array  # fastest contacts and granules
    scenes: Any  # a record of each scene
    legs: FloatArray


def lanes_of(x: Array) -> int:
    """Return how many scenes stand side by side in an array."""
    return VECTOR // x.itemsize


@overload(lanes_of)
def _compiled_lanes_of(x: Any) -> Any:
    # A constant, as the compiler makes vectors only where it knows how far entries are apart; and
    # unsigned, as only indices that are make vectors.
    lanes = np.uint64(8 * VECTOR // x.dtype.bitwidth)

    def constant(x: Any) -> Any:  # noqa: ARG001 - as ``lanes_of``
        return lanes

    return constant


@compiled
def place(x: Any, i: Any, k: Any) -> Any:
    """Index of granule i of scene k."""
    return np.uint64(i) * lanes_of(x) + np.uint64(k)


@compiled
def larger(a: float, b: float) -> float:
    """The larger of two numbers; of ``max``, which tells NaN, the compiler makes no vectors."""
    return a if a > b else b


@compiled
def begin_step(old: Any, new: Any, h: Any, kick: Any, drift: Any, lo: int, hi: int) -> None:
    """Kick by the known forces, and drift, from the old motion to the new one."""
    u0, v0, f0, u, v, ahead = old.u, old.v, old.force, new.u, new.v, lanes_of(h)
    for j in range(place(h, lo, 0), place(h, hi, 0)):
        w = v0[j] + kick * h[j] * (f0[j] - f0[j + ahead])
        v[j] = w
        u[j] = u0[j] + drift * h[j] * w


@compiled
def take_stage(new: Any, h: Any, kick: Any, drift: Any, least: Any, lo: int, hi: int) -> None:
    """Kick by the forces from behind and ahead, and drift."""
    u, v, f, ahead = new.u, new.v, new.force, lanes_of(h)
    for j in range(place(h, lo, 0), place(h, hi, 0)):
        r = u[j] - u[j + ahead]
        r = r if r > least else _ZERO
        force = r * np.sqrt(r)
        f[j + ahead] = force
        w = v[j] + kick * h[j] * (f[j] - force)
        v[j] = w
        u[j] += drift * h[j] * w


@compiled
def any_pressed(force: Any, i: int) -> bool:
    """Whether granule i is pushed from behind in any scene."""
    total = 0.0
    for j in range(place(force, i, 0), place(force, i + 1, 0)):
        total += force[j]
    return total != 0


@compiled
def find_crossings(
    old: Any, new: Any, h: Any, fastest: Any, starting: bool, lo: int, hi: int
) -> None:
    """Fill in, for each granule and the end, the fastest contact behind that opens or closes.

    Which contacts do is said in ``elastic_maxima.scan``.
    """
    u0, v0, u, v, ahead = old.u, old.v, new.u, new.v, lanes_of(h)
    for j in range(place(h, lo, 0), place(h, lo + 1, 0)):
        fastest[j] = 0.0
    for j in range(place(h, lo, 0), place(h, hi, 0)):
        r0, r1 = u0[j] - u0[j + ahead], u[j] - u[j + ahead]
        w0, w1 = v0[j] - v0[j + ahead], v[j] - v[j + ahead]
        rate, nearest = larger(abs(w0), abs(w1)), -larger(-abs(r0), -abs(r1))
        near = (nearest < rate * h[j]) & (((w0 > _ZERO) != (w1 > _ZERO)) | starting)
        crosses = ((r0 > _ZERO) != (r1 > _ZERO)) | near
        fastest[j + ahead] = larger(fastest[j], rate if crosses else _ZERO)


@compiled
def find_speeds(v: Any, fastest: Any, lo: int, hi: int) -> None:
    """Fill in, for each granule and the end, the velocity of the fastest granule behind."""
    ahead = lanes_of(v)
    for j in range(place(v, lo, 0), place(v, lo + 1, 0)):
        fastest[j] = 0.0
    for j in range(place(v, lo, 0), place(v, hi, 0)):
        fastest[j + ahead] = larger(fastest[j], abs(v[j]))


@compiled
def mark_maxima(old: Any, new: Any, h: Any, highest: Any, marks: Any, lo: int, hi: int) -> None:
    """Mark contacts whose overlap may have had its highest maximum in a step.

    Which turn is said in ``elastic_maxima.turning_contacts``. Those count that get as far even if
    their rate changes by all that both ends say.
    """
    u0, v0, f0, u, v, f, ahead = old.u, old.v, old.force, new.u, new.v, new.force, lanes_of(h)
    for j in range(place(h, lo, 0), place(h, hi, 0)):
        r0, r1 = u0[j] - u0[j + ahead], u[j] - u[j + ahead]
        w0, w1 = v0[j] - v0[j + ahead], v[j] - v[j + ahead]
        g0 = f0[j] - f0[j + ahead] - (f0[j + ahead] - f0[j + ahead + ahead])
        g1 = f[j] - f[j + ahead] - (f[j + ahead] - f[j + ahead + ahead])
        both = w0 + w1
        towards, back = -both * g0, both * g1
        dips = (
            (towards > _ZERO)
            & (back > _ZERO)
            & (_TURNS_TWICE * h[j] * (towards + back) > both * both)
        )
        reach = larger(r0, r1) + h[j] * (abs(w0) + abs(w1) + h[j] * (abs(g0) + abs(g1)))
        marks[j] = (((w0 > _ZERO) & (w1 <= _ZERO)) | dips) & (reach > highest[j])
