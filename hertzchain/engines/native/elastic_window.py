"""Granules that cannot matter any more, compiled: when they are left behind, and a run ends early.

``left_behind`` says when.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.engines.native.compiling import ONE, part
from hertzchain.engines.native.elastic_chain import energy_of, momentum_of
from hertzchain.engines.native.elastic_step import accelerate_pushed
from hertzchain.engines.native.interpolant import hertz_force

_QUIET_GRANULES = 8

_QUIET = 1e-3
"""Largest overlap and velocity of a quiet granule, over those of the leading wave. Derived in
``left_behind``; the longest steps leave 8e-4 behind a wave by their errors, usual ones 1e-7."""

_IMPACT = 1.3
"""F / v^1.2, above that of a granule running into a wall, (5/4)^(3/5) = 1.14, and of a solitary
wave and its fastest granule (1.01): see ``_strength``."""

_SLOWER = 0.95
"""What is left behind presses less than this fraction of the peaks that it could raise."""

_LOOSENED = 1.2
"""Largest force of a wave at an end whose last granules drift apart, over its height; 1.173
measured, with up to six such granules and gaps of 0.001 to 20 overlaps."""

_WAVE_ENERGY, _WAVE_RATIO = 1.0465162, 0.3834342
"""Energy over F^(5/3), and over the square of the momentum, of a solitary wave; measured in a chain
and derived from its shape."""

_LIKE_A_WAVE = 1e-3
"""Difference of a wave's ratio of energy to momentum squared from that; 1e-5 measured."""

_LEAST_PRESSED = 0.7
"""Hardest pressed contact of a solitary wave at any instant, over its height; 0.77 measured, where
two contacts are pressed alike."""


@part
def _strength(force: float, velocity: float) -> float:
    """How hard contacts can come to be pressed, after one pulse, by what has these largest values.

    Not proved; in 6,787 scenes with one pulse, N 2 to 41, LM_ratio 0.1 to 100, n 1.001 to 101, no
    peak was missed for it.
    """
    return max(force, _IMPACT * max(velocity, 0.0) ** 1.2)


@part
def _fastest(v: Any, i: Any) -> float:
    """The velocity with which a granule may run into others, for ``_strength``."""
    return max(float(v[i]), float(v[i] - v[i + ONE]))


@part
def _height(momentum: float, energy: float, hardest: float) -> float:
    """Height of the solitary wave that has this momentum and energy; 0 where they are not of one.

    All three numbers have to fit: of a given momentum, one wave has another energy than two, or
    than granules that fly.
    """
    if momentum <= 0 or energy <= 0:
        return 0.0
    if abs(energy / (_WAVE_RATIO * momentum**2) - 1) > _LIKE_A_WAVE:
        return 0.0
    height = (energy / _WAVE_ENERGY) ** 0.6
    if not _LEAST_PRESSED * height <= hardest <= (1 + _LIKE_A_WAVE) * height:
        return 0.0
    return float(height)


@part
def left_behind(u: Any, v: Any, peak_force: Any, lo: int, hi: int) -> int:
    """How far the window can be closed from behind once the pulse is over.

    The shock has to be one pulse, in a plain chain: after a second push a broad packet can break
    up into waves stronger than any before, and unlike granules, gaps and walls reflect waves. A cut
    needs all of this:

    - Ahead of it lies a quiet stretch: ``_QUIET_GRANULES`` granules whose overlaps and velocities
      are below ``_QUIET`` of those of the leading wave. Contacts that are hardly pressed are hardly
      stiff, k = 3/2 overlap^(1/2), and what crosses d contacts of stiffness k in a time t is
      smaller than what entered by (k t^2)^d / (2d)!. The waves ahead go on at their own speed
      meanwhile, about a granule in a unit of time, so that the stretch only grows: with d = 8 + t
      that factor is below 1e-24 for all t. Nothing passes but waves.
    - What lies behind, up to the quiet stretch before, is either weak, or one solitary wave. It is
      weak where it presses nothing as hard as any contact from there back has been pressed, nor as
      the leading wave does (``_strength``, with a margin). After a single pulse, which leaves its
      strongest waves ahead, no contact is pressed harder later than the hardest now, or than the
      fastest granule can press by running into one at rest. (After several pulses that is not so: a
      broad packet can break up into stronger waves.)
    - One solitary wave, told by momentum, energy and its hardest contact (``_height``), goes on as
      it is. It only meets contacts that lie ahead of it, which waves as strong as the leading one
      have passed: their peaks are compared with it, not those behind. While granules wait ahead it
      presses none harder than its height. At the free end it does: the leading wave throws off the
      last granules; a later wave finds the end loosened, throws granules against those that are
      slower, and presses contacts up to 1.17 times its height. It has to stay below all peaks ahead
      even so.
    """
    crest = hi - 1
    while crest > lo and max(u[crest - 1] - u[crest], 0) >= u[crest] - u[crest + 1]:
        crest -= 1
    if crest == lo:
        return lo
    # The contact behind the hardest pressed one has just had its peak.
    leading = peak_force[crest - 1]
    quiet_overlap, quiet_velocity = _QUIET * leading ** (2 / 3), _QUIET * leading ** (5 / 6)
    weakest_peak, weakest_ahead, strongest = leading, -1.0, 0.0
    begin, momentum, energy, hardest, fastest = lo, 0.0, 0.0, 0.0, 0.0
    quiet, cut = 0, lo
    for i in range(lo, crest):
        r, speed = float(u[i] - u[i + 1]), float(v[i])
        weakest_peak = min(weakest_peak, peak_force[i])
        if r <= quiet_overlap and abs(speed) <= quiet_velocity:
            quiet += 1
        else:
            if quiet >= _QUIET_GRANULES:
                begin = i - _QUIET_GRANULES
                momentum, energy, hardest, fastest = 0.0, 0.0, 0.0, 0.0
            quiet = 0
        force = hertz_force(r)
        hardest, fastest = max(hardest, force), max(fastest, _fastest(v, i))
        momentum += speed
        energy += 0.5 * speed**2 + 0.4 * force * r
        if quiet == _QUIET_GRANULES:
            height = _height(momentum, energy, hardest)
            strength = max(_strength(hardest, fastest), height)
            if _LOOSENED * max(strongest, strength) < _SLOWER * weakest_peak:
                strongest = max(strongest, strength)
            else:
                if height == 0 or _LOOSENED * strongest >= _SLOWER * weakest_peak:
                    break
                if weakest_ahead < 0:
                    weakest_ahead = leading
                    for k in range(begin, crest):
                        weakest_ahead = min(weakest_ahead, peak_force[k])
                if _LOOSENED * height >= _SLOWER * weakest_ahead:
                    break
        if quiet >= _QUIET_GRANULES:
            cut = i + 1 - _QUIET_GRANULES
    return cut


@part
def is_settled(u: Any, v: Any, peak_force: Any, lo: int, hi: int) -> bool:
    """Whether no peak can change any more, once the pulse is over and all granules were reached.

    Granules that fly off at the free end never come back; of the others none can press a contact
    as hard as every contact has been pressed already.
    """
    end = hi
    while end - 1 > lo and u[end - 2] < u[end - 1] and v[end - 2] < v[end - 1]:
        end -= 1
    hardest, fastest = 0.0, 0.0
    for i in range(np.uint64(lo), np.uint64(end - 1)):
        hardest = max(hardest, hertz_force(float(u[i] - u[i + ONE])))
        fastest = max(fastest, _fastest(v, i))
    if end - 1 <= lo:
        return True
    weakest_peak = math.inf
    for i in range(np.uint64(lo), np.uint64(peak_force.size)):
        weakest_peak = min(weakest_peak, peak_force[i])
    return weakest_peak > _LOOSENED * _strength(hardest, fastest)


@part
def leave_behind_in(u: Any, v: Any, g: Any, peak_force: Any, lo: int, hi: int, run: Any) -> int:
    """Let go of granules that cannot matter any more; returns where the window begins now.

    What is let go keeps its momentum and energy, which are counted.
    """
    cut = left_behind(u, v, peak_force, lo, hi)
    if cut > lo:
        run.momentum += momentum_of(v, lo, cut, None)
        run.energy += energy_of(u, v, lo, cut, None)
        accelerate_pushed(u, g, run.push, cut, None)
    return cut
