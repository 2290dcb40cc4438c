"""Rules of lint on the chain that LAMMPS makes of a deck: gravity, and steps against stability."""

from __future__ import annotations

import math

from hertzchain.verdict.lint.deck import Deck, Found
from hertzchain.verdict.lint.script import Command, number

_UNSTABLE = math.sqrt(2 / 3)  # natural time units; 2 over the largest frequency, 2 sqrt(3/2)
_LONG = 0.2  # natural time units; peaks are then off by 1 % (chosen)
_FEEBLE = 1e-6  # of all gravity: an angle written with 6 digits leaves that across the chain


def _gravity(deck: Deck) -> Found:
    """Gravity across a row, which nothing holds, or along one that falls as a whole."""
    granules = deck.granules
    held = deck.fixes("lineforce", "planeforce", "setforce", "freeze", "enforce2d", "move")
    if granules is None or held:
        return
    axis = max(range(3), key=lambda k: abs(granules.frame[0][k]))
    walls = deck.fixes("wall/gran")
    planes = {word for wall in walls for word in wall.words if word.endswith("plane")}
    name = "xyz"[axis]
    for fix in deck.fixes("gravity"):
        vector = _of_gravity(fix)
        size = math.hypot(*vector)
        across = math.hypot(*(g for k, g in enumerate(vector) if k != axis))
        if across > _FEEBLE * size and not planes - {f"{name}plane"}:
            text = (
                f"gravity of {across:.4g} pulls across the chain, which lies along {name}, and"
                f" nothing holds the granules there: they fall out of the row; leave fix"
                f" {fix.word(1)} out, or let it point along {name}"
            )
            yield fix, "error", text
        elif size > 0 and across <= _FEEBLE * size and not walls:
            text = (
                f"gravity of {size:.4g} along {name} without a wall: the chain falls as a whole and"
                f" no contact feels it; leave fix {fix.word(1)} out, or give the chain a wall"
            )
            yield fix, "warning", text


def _of_gravity(fix: Command) -> tuple[float, float, float]:
    """The acceleration of a ``fix gravity`` along x, y and z; 0 where it is not known."""
    size = number(fix.word(4)) or 0.0
    given = [number(word) for word in fix.words[6:9]]
    known = [value for value in given if value is not None]
    if fix.word(5) == "vector" and len(known) == 3:
        length = math.hypot(*known) or 1.0
        return size * known[0] / length, size * known[1] / length, size * known[2] / length
    angles = {"chute": [0.0, 180 - known[0]], "spherical": known[:2]} if known else {}
    if len(angles.get(fix.word(5), [])) < 2:
        return 0.0, 0.0, 0.0
    phi, theta = map(math.radians, angles[fix.word(5)])
    across = size * math.sin(theta)
    return across * math.cos(phi), across * math.sin(phi), size * math.cos(theta)


def _step_length(deck: Deck) -> Found:
    """The step against the stiffest contacts that the deck itself makes."""
    granules, look = deck.granules, deck.look
    law = None if look is None else look.law
    if granules is None or look is None or law is None:
        return
    if not look.runs or deck.fixes("dt/reset"):
        return
    import numpy as np
    from scipy.linalg import eigvalsh_tridiagonal

    from hertzchain.contact import hertz

    (stiffness, exponent), mass = law, granules.mass
    is_linear, is_hertz = (np.abs(exponent - known) < 0.01 for known in (1, 1.5))
    if not np.all(is_linear | is_hertz) or np.any(mass <= 0):
        return
    pressing = max((push.max() for push in deck.pushes.values()), default=0.0)
    origin = "the largest force of this deck"
    speed = np.abs(np.diff(granules.velocity[:, 0]))
    reduced = mass[1:] * mass[:-1] / (mass[1:] + mass[:-1])
    hits = np.where(is_hertz, hertz.impact_force(stiffness, reduced, speed), 0.0)
    if hits.max() > pressing:
        pressing = hits.max()
        origin = f"that of granules that collide at {speed[hits.argmax()]:g}"
    if not np.all(is_linear) and not pressing:
        return
    spring = np.where(is_linear, stiffness, hertz.slope_of(stiffness, pressing))
    both = np.append(spring, 0) + np.append(0, spring)
    squares = eigvalsh_tridiagonal(
        both / mass, -spring / np.sqrt(mass[1:] * mass[:-1]),
        select="i", select_range=(len(mass) - 1, len(mass) - 1),
    )  # fmt: skip
    limit = 2 / math.sqrt(squares[0])
    unit, longest = limit / _UNSTABLE, max(look.runs, key=lambda run: run.dt)
    run = deck.carried_out(longest.command)
    steps = [c for c in deck.named("timestep") if run is not None and c.place < run.place]
    where, step = steps[-1] if steps else run, longest.dt / unit
    if np.all(is_linear):
        pressed, advice = "contacts of this deck, whatever presses them", ""
    else:
        pressed = f"contacts pressed by {pressing:.4g}, {origin}"
        advice = f"; {0.02 * unit:.1g} gives peaks right to about 1e-4"
    if longest.dt > limit:
        text = (
            f"the step {longest.dt:.3g} is above the limit of stability, {limit:.3g} for"
            f" {pressed} (2 over the largest frequency of masses from {mass.min():.3g} to"
            f" {mass.max():.3g} and springs up to {spring.max():.3g}): granules fly apart{advice}"
        )
        yield where, "error", text
    elif step > _LONG and advice:
        text = (
            f"the step {longest.dt:.3g} is {step:.2g} of the natural time of {pressed}: peaks are"
            f" off by about {0.22 * step**2:.1%}, which goes with the square of it{advice}"
        )
        yield where, "warning", text


RULES = (_gravity, _step_length)
