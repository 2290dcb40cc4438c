"""Granules that cannot change a peak any more: when they are left behind, and a run ends early.

``left_behind`` has the conditions. Compiled.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hertzchain.engines.native.elastic_chain import energy_of, momentum_of
from hertzchain.engines.native.elastic_step import accelerate_pushed
from hertzchain.observables.compiling import ONE, part
from hertzchain.observables.interpolant import hertz_force

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
    """Largest force that a part of the chain with these largest values can cause after one pulse.

    This is not proved. In 6,787 scenes with one pulse, N 2 to 41, LM_ratio 0.1 to 100, n 1.001 to
    101, no peak was missed because of it.
    """
    return max(force, _IMPACT * max(velocity, 0.0) ** 1.2)


@part
def _fastest(v: Any, i: Any) -> float:
    """The velocity with which a granule may run into others, for ``_strength``."""
    return max(float(v[i]), float(v[i] - v[i + ONE]))


@part
def _height(momentum: float, energy: float, hardest: float) -> float:
    """Height of the solitary wave with this momentum and energy; 0 if they are not those of one.

    All three numbers have to fit: for the same momentum one wave has another energy than two waves,
    or than flying granules.
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
    """Return where the window can begin, once the pulse is over.

    The shock has to be one pulse, in a plain chain: after a second push a broad packet can break
    up into waves stronger than any before, and unlike granules, gaps and walls reflect waves. A cut
    needs all of this:

    - Ahead of it lies a quiet stretch: ``_QUIET_GRANULES`` granules whose overlaps and velocities
      are below ``_QUIET`` of those of the leading wave. Contacts that are hardly pressed are hardly
      stiff, k = 3/2 overlap^(1/2), and a signal that crosses d contacts of stiffness k in a time t
      is reduced by the factor (k t^2)^d / (2d)!. Meanwhile the waves ahead move on at about one
      granule in a unit of time, so that the stretch only grows: with d = 8 + t that factor is below
      1e-24 for all t. Only waves can pass.
    - What lies behind, up to the quiet stretch before, is either weak, or one solitary wave. It is
      weak if it cannot reach the peak of any contact from there back, nor the force of the leading
      wave (``_strength``, with a margin). After a single pulse, which leaves its strongest waves
      ahead, no contact is pressed harder later than the hardest now, or than the fastest granule
      can press by running into one at rest. (After several pulses it can be: a broad packet can
      break up into stronger waves.)
    - One solitary wave, recognised by momentum, energy and its hardest contact (``_height``), does
      not change. It only meets contacts that lie ahead of it, which waves as strong as the leading
      one have passed: their peaks are compared with it, not those behind. While granules ahead are
      at rest it presses no contact harder than its height. At the free end it can: the leading wave
      throws off the last granules, and a later wave throws granules against these slower ones, with
      forces of up to 1.17 times its height. Even these forces have to be below all peaks ahead.
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

    Granules that fly off at the free end never come back, and the others cannot press any contact
    as hard as the least of all peaks so far.
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
    """Leave behind granules that cannot change a peak; returns where the window begins now.

    The momentum and the energy of the granules left behind are added to ``run``.
    """
    cut = left_behind(u, v, peak_force, lo, hi)
    if cut > lo:
        run.momentum += momentum_of(v, lo, cut, None)
        run.energy += energy_of(u, v, lo, cut, None)
        accelerate_pushed(u, g, run.push, cut, None)
    return cut
