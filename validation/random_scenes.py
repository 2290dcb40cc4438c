"""Random scenes of moderate length, drawn to be hard on error bounds: a function for each kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any, cast

import numpy as np

import hertzchain as hc
from hertzchain.contact import hertz
from hertzchain.errors import HertzchainError
from hertzchain.scene.chain import length_and_time
from hertzchain.scene.shocks import PROFILES, profile_named
from hertzchain.scene.terms import DAMPING, WALLS, DampingLaw, WallKind, granules_of
from validation.shipped import STEEL, pulse_of

Draw = Callable[[np.random.Generator, int], hc.Scene]


def spread(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number with equal chance in each decade."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _material(rng: np.random.Generator) -> tuple[dict[str, Any], float]:
    """Draw a material and F0 [N]; half of them are the paper's."""
    if rng.random() < 0.5:
        return STEEL, 100.0
    of_chain = {
        "radius": spread(rng, 1e-4, 0.1),
        "young_modulus": spread(rng, 1e8, 1e12),
        "poisson_ratio": float(rng.uniform(-0.9, 0.5)),
        "density": spread(rng, 300.0, 2e4),
    }
    return of_chain, spread(rng, 1e-8, 100.0)


def _pulse(rng: np.random.Generator, granules: int, n: float, ratio: float) -> hc.Scene:
    material, force = _material(rng)
    profile = profile_named(str(rng.choice(list(PROFILES))))
    shock = hc.Pulse(profile, force, n, momentum_ratio=ratio)
    return hc.Scene(hc.Chain(granules, **material), shock)


def any_pulse(rng: np.random.Generator, longest: int) -> hc.Scene:
    """LM_ratio 0.03 to 50, n 1.03 to 41, chains of 2 to ``longest`` granules."""
    n, ratio = 1 + spread(rng, 0.03, 40.0), spread(rng, 0.03, 50.0)
    return _pulse(rng, round(spread(rng, 2.0, longest)), n, ratio)


def two_maxima(rng: np.random.Generator, longest: int) -> hc.Scene:
    """Draw scenes with two nearly equal maxima of a contact: LM_ratio 1.5 to 7, short decays."""
    n, ratio = float(rng.uniform(1.02, 4.0)), float(rng.uniform(1.5, 7.0))
    return _pulse(rng, int(rng.integers(4, min(40, longest))), n, ratio)


def sharp_decay(rng: np.random.Generator, longest: int) -> hc.Scene:
    """A force that ends within a thousandth to twice the rise time."""
    n, ratio = 1 + spread(rng, 1e-3, 2.0), spread(rng, 0.5, 30.0)
    return _pulse(rng, int(rng.integers(3, min(40, longest))), n, ratio)


def ends_early(rng: np.random.Generator, longest: int) -> hc.Scene:
    """An end time anywhere in the run."""
    scene = any_pulse(rng, longest)
    end = scene.end_time * float(rng.uniform(0.0, 1.0))
    return hc.Scene(scene.chain, scene.shock, hc.Run(end))


def first_instants(rng: np.random.Generator, longest: int) -> hc.Scene:
    """An end time of 1e-10 to twice the rise time."""
    scene = any_pulse(rng, longest)
    end = pulse_of(scene)[1] * spread(rng, 1e-10, 2.0)
    return hc.Scene(scene.chain, scene.shock, hc.Run(end))


def pulse_table(rng: np.random.Generator, longest: int) -> hc.Scene:
    """Spikes, gaps and plateaus, 0.03 to 20 natural time units apart; a third ends early."""
    material, force = _material(rng)
    chain = hc.Chain(round(spread(rng, 2.0, min(80, longest))), **material)
    unit = hc.Scene(chain, hc.Pulse("cosine", force, 2.0, momentum_ratio=1.0)).units.time
    shock = _table(rng, force, unit)
    scene = hc.Scene(chain, shock)
    if rng.random() < 0.3:
        return hc.Scene(chain, shock, hc.Run(scene.end_time * float(rng.uniform(0.01, 1.0))))
    return scene


def _table(rng: np.random.Generator, force: float, unit: float) -> hc.PulseTable:
    """A pulse table whose largest force [N] and unit of time [s] are given."""
    rows, kind = int(rng.integers(2, 14)), int(rng.integers(3))
    apart = np.array([spread(rng, 0.03, 20.0) for _ in range(rows)])
    height = rng.random(rows) * (rng.random(rows) < 0.6)
    if kind == 1:
        apart = np.array([spread(rng, 0.3, 3.0) for _ in range(rows)])
    elif kind == 2:
        height = rng.random(rows) * (np.arange(rows) % 2)
    if not height.any():
        height[rng.integers(rows)] = 1.0
    time = (np.cumsum(apart) - apart[0] * (rng.random() < 0.5)) * unit
    return hc.PulseTable(tuple(time.tolist()), tuple((force * height / height.max()).tolist()))


KINDS: dict[str, Draw] = {
    kind.__name__.replace("_", " "): kind
    for kind in (any_pulse, two_maxima, sharp_decay, ends_early, first_instants, pulse_table)
}
"""Kinds of scenes with uniform chains and free ends."""


def random_scene_with_terms(
    rng: np.random.Generator, longest: int, longest_time: float = math.inf
) -> hc.Scene:
    """Granules of up to 100 times the size and modulus of others, and terms of all kinds.

    A scene has 2 to ``longest`` granules. One that would run for more than ``longest_time``
    [natural time units of the fastest contact] is drawn again.
    """
    while True:
        scene = _with_terms(rng, longest)
        if not scene.is_plain and scene.end_time <= longest_time * scene.contact_time:
            return scene


def random_damped_scene(
    rng: np.random.Generator, longest: int, longest_time: float = math.inf
) -> hc.Scene:
    """A chain of damped contacts: plain except for damping, or with terms of all kinds.

    See ``random_scene_with_terms`` for the arguments.
    """
    if rng.random() < 0.2:
        scene = any_pulse(rng, longest)
        while scene.end_time > longest_time * scene.contact_time:
            scene = any_pulse(rng, longest)
    else:
        scene = random_scene_with_terms(rng, longest, longest_time)
    return damped(rng, scene)


def damped(rng: np.random.Generator, scene: hc.Scene) -> hc.Scene:
    """Return the scene with damping, by any law.

    Restitution is 0.1 to 0.99; dampers of the other laws take 0.001 to 30 times the momentum of
    the first contact in its natural time unit: the strongest do not let granules rebound.
    """
    strength, attraction = spread(rng, 1e-3, 30.0), bool(rng.random() < 0.3)
    law, each = cast(DampingLaw, str(rng.choice(list(DAMPING)))), scene.granules
    if law == "restitution":
        contact = hc.Contact(law, restitution=float(rng.uniform(0.1, 0.99)), attraction=attraction)
    elif law == "viscoelastic":
        relaxation = strength * scene.contact_time
        contact = hc.Contact(law, relaxation_time=relaxation, attraction=attraction)
    else:
        mass = 2 * float(np.min(each.contact_mass))
        coefficient = strength * mass / scene.contact_time
        contact = hc.Contact(law, coefficient=coefficient, attraction=attraction)
    return replace(scene, contact=contact)


def with_wall_of_its_own(rng: np.random.Generator, scene: hc.Scene) -> hc.Scene:
    """Return a damped scene whose wall, if it has one, has another damping than the contacts."""
    law, wall = scene.contact, scene.wall
    if law is None or wall is None:
        return scene
    factor = spread(rng, 1e-3, 10.0)
    parameter = float(rng.uniform(0.1, 0.99)) if law.restitution else factor * law.parameter
    return replace(scene, wall=wall.damped(law.with_parameter(parameter)))


def thrown(rng: np.random.Generator, scene: hc.Scene) -> hc.Scene:
    """Return the scene with up to three rows of granules that move at the start, either way.

    They have 0.01 to 3 times the unit of velocity. In half of the scenes without a static load
    nothing else pushes, where these granules meet others.
    """
    velocity, unit = np.zeros(scene.chain.granules), scene.units.velocity
    for _ in range(int(rng.integers(1, 4))):
        first, last = np.sort(rng.choice(velocity.size + 1, size=2, replace=False))
        velocity[first:last] = rng.choice([-1, 1]) * spread(rng, 0.01, 3.0) * unit
    try:
        moving = replace(scene, chain=replace(scene.chain, velocity=tuple(velocity.tolist())))
    except HertzchainError:  # they take a striker's velocity, and meet nothing
        return scene
    alone = rng.random() < 0.5 and scene.precompression is None and scene.piston is None
    try:
        return replace(moving, shock=hc.Moving()) if alone else moving
    except HertzchainError:  # they meet nothing
        return moving


def pushed_within(rng: np.random.Generator, scene: hc.Scene) -> hc.Scene:
    """Return the scene with its force on any granule; one without an applied force as it is."""
    if not scene.ramps:
        return scene
    shock: Any = scene.shock
    granule = int(rng.integers(1, scene.chain.granules + 1))
    return replace(scene, shock=replace(shock, granule=granule))


def with_fixed(rng: np.random.Generator, scene: hc.Scene) -> hc.Scene:
    """Return the scene with up to three fixed granules, where that is possible."""
    size = scene.chain.granules
    for _ in range(20):
        fixed = np.isin(np.arange(size), rng.integers(size, size=int(rng.integers(1, 4))))
        velocity = np.where(fixed, 0.0, np.broadcast_to(scene.chain.velocity, size))
        chain = replace(scene.chain, velocity=velocity.tolist(), fixed=fixed.tolist())
        with suppress(HertzchainError):
            return replace(scene, chain=chain)
    return scene


def with_near_wall(rng: np.random.Generator, scene: hc.Scene) -> hc.Scene:
    """Return the scene with a near wall; a striker or piston becomes granules that move.

    The wall has a damping of its own in half of the damped scenes, and a gap of up to an overlap of
    the shock in half of those without a static load.
    """
    near, unit, law = _wall(rng, scene.chain), scene.units, scene.contact
    if scene.precompression is None and rng.random() < 0.5:
        near = replace(near, gap=unit.length * spread(rng, 0.01, 1.0))
    if law is not None and rng.random() < 0.5:
        factor = spread(rng, 0.1, 10.0)
        parameter = float(rng.uniform(0.1, 0.99)) if law.restitution else factor * law.parameter
        near = near.damped(law.with_parameter(parameter))
    if scene.shock.impact_velocity is None:
        with suppress(HertzchainError):  # granules next to both walls, or that meet nothing
            return replace(scene, near_wall=near)
    velocity = np.array(np.broadcast_to(scene.chain.velocity, scene.chain.granules))
    velocity[: int(rng.integers(1, velocity.size + 1))] = -spread(rng, 0.1, 1.0) * unit.velocity
    velocity[np.broadcast_to(scene.chain.fixed, velocity.size)] = 0.0
    chain = replace(scene.chain, velocity=tuple(velocity.tolist()))
    try:
        return replace(scene, chain=chain, shock=hc.Moving(), near_wall=near)
    except HertzchainError:  # granule 1 is fixed
        return scene


def with_measured(rng: np.random.Generator, scene: hc.Scene) -> hc.Scene:
    """Return the scene with contacts and masses as if measured, half to twice those that it had.

    A pulse becomes a half sine, a saw tooth or a trapezoid; a third of the scenes with a wall have
    a single granule, if nothing else needs more.
    """
    granules, shock, wall = scene.granules, scene.shock, scene.wall
    count = scene.chain.granules if wall is None or rng.random() < 2 / 3 else 1
    stiffness = granules.stiffness[:1].tolist() + granules.stiffness.tolist()

    def varied(values: Any) -> Any:
        return tuple(spread(rng, 0.5, 2.0) * float(value) for value in values[:count])

    fixed = scene.chain.fixed
    chain: dict[str, Any] = {
        name: value[:count] if isinstance(value, tuple) and count > 1 else np.ravel(value)[0].item()
        for name in ("radius", "gap", "velocity")
        for value in (getattr(scene.chain, name),)
    }
    chain |= {"stiffness": varied(stiffness), "mass": varied(granules.as_if_free.mass)}
    if isinstance(shock, hc.Striker):
        shock = hc.Striker(shock.velocity, loaded=shock.loaded)
    elif isinstance(shock, hc.Pulse | hc.PulseTable):
        rise, fall = rng.uniform(0.05, 0.5, 2) * scene.pulse_end
        given = scene.peak_force, scene.pulse_end
        shock = (
            hc.HalfSine(*given), hc.Sawtooth(*given), hc.Trapezoid(*given, float(rise), float(fall))
        )[int(rng.integers(3))]  # fmt: skip
    if wall is not None:
        stiff = spread(rng, 0.5, 2.0) * float(granules.stiffness[-1])
        wall = replace(wall, kind=None, young_modulus=None, poisson_ratio=None, stiffness=stiff)
    try:
        return replace(
            scene, chain=hc.Chain(count, fixed=fixed, **chain), shock=shock, wall=wall, gauges=()
        )
    except HertzchainError:  # a single granule that is fixed, or before a load
        return scene


def _with_terms(rng: np.random.Generator, longest: int) -> hc.Scene:
    """Static loads are 1e-3 to 1e3 of the shock."""
    granules = round(spread(rng, 2.0, longest))
    pressed, apart = bool(rng.random() < 0.4), bool(rng.random() < 0.5)
    chain = hc.Chain(granules, **_unlike(rng, granules))
    wall = _wall(rng, chain) if rng.random() < 0.5 else None
    first = chain.radius[0] if isinstance(chain.radius, tuple) else chain.radius
    striker_keys = {"radius": first * _around(rng, 3.0)} if rng.random() < 0.5 else {}
    striker = hc.Striker(1.0, **striker_keys) if rng.random() < 0.33 else None
    each = granules_of(chain, striker, wall, None, None)
    # The largest load presses the weakest contact into its smaller granule by this part of it.
    depth = spread(rng, 1e-6, 3e-3)
    smaller = np.minimum(each.radius, np.append(each.radius[1:], np.inf))
    largest = float(np.min(each.stiffness * (depth * smaller[: each.stiffness.size]) ** 1.5))
    ratio = spread(rng, 1e-3, 1e3) if pressed else 0.0
    force = largest / max(1.0, ratio)
    loads = None
    if pressed:
        kind = int(rng.integers(3)) if wall is not None else 0
        loads = hc.Precompression(
            force=0.0 if kind == 1 else ratio * force,
            gravity=0.0 if kind == 0 else ratio * force / float(np.sum(each.mass)),
        )
    elif apart:
        deep = hertz.overlap_of(float(np.min(each.stiffness)), force)
        chain, wall = _apart(rng, chain, wall, deep)
    stiffness, mass = float(each.stiffness[0]), float(each.contact_mass[0])
    shock: hc.Pulse | hc.PulseTable | hc.Striker
    if striker is not None:
        at_1_m_s = hertz.impact_force(stiffness, mass, 1.0)
        # By a digit that the scene has already: another draw would change all later scenes.
        loaded = loads is not None and bool(int(1e9 * force) % 2)
        shock = replace(striker, velocity=(force / at_1_m_s) ** (5 / 6), loaded=loaded)
    elif rng.random() < 0.6:
        n, impulse = 1 + spread(rng, 0.05, 10.0), spread(rng, 0.1, 10.0)
        profile = profile_named(str(rng.choice(list(PROFILES))))
        shock = hc.Pulse(profile, force, n, momentum_ratio=impulse)
    else:
        shock = _table(rng, force, length_and_time(stiffness, 2 * mass, force)[1])
    return hc.Scene(chain, shock, hc.Run(), wall, loads)


def _unlike(rng: np.random.Generator, granules: int) -> dict[str, Any]:
    """Draw granules: equal, in cells, tapered or at random; at most four materials."""
    base = _material(rng)[0]
    kind = int(rng.integers(4))
    if kind == 0:
        return base
    many = int(rng.integers(2, 5))
    of_each = np.arange(granules) % many if kind == 1 else rng.integers(many, size=granules)
    widest = spread(rng, 1.0, 10.0)  # of size and modulus each up and down
    columns: dict[str, Any] = {
        "young_modulus": base["young_modulus"]
        * np.array([_around(rng, 10.0) for _ in range(many)]),
        "poisson_ratio": rng.uniform(0.0, 0.5, many),
        "density": base["density"] * np.array([_around(rng, 3.0) for _ in range(many)]),
    }
    columns = {key: values[of_each] for key, values in columns.items()}
    radius = np.array([_around(rng, widest) for _ in range(many)])[of_each]
    if kind == 2:
        radius = widest ** np.linspace(1.0, -1.0, granules)
    elif kind == 3:
        radius = np.array([_around(rng, widest) for _ in range(granules)])
    return columns | {"radius": base["radius"] * radius}


def _around(rng: np.random.Generator, widest: float) -> float:
    """Draw a factor between 1 / widest and widest."""
    return spread(rng, 1 / widest, widest)


def _wall(rng: np.random.Generator, chain: hc.Chain) -> hc.Wall:
    kind = cast(WallKind, str(rng.choice(WALLS)))
    if kind != "elastic":
        return hc.Wall(kind)
    return hc.Wall(kind, chain.first_modulus * _around(rng, 10.0), float(rng.uniform(0.0, 0.5)))


def _apart(
    rng: np.random.Generator, chain: hc.Chain, wall: hc.Wall | None, overlap: float
) -> tuple[hc.Chain, hc.Wall | None]:
    """Gaps of 0.01 to 30 overlaps [m] before half of the granules, or the same before all."""
    gaps: Any = overlap * spread(rng, 0.01, 30.0)
    if rng.random() < 0.5:
        some = [overlap * spread(rng, 0.01, 30.0) for _ in range(chain.granules)]
        gaps = np.where(rng.random(chain.granules) < 0.5, some, 0.0)
    if wall is not None and rng.random() < 0.5:
        wall = replace(wall, gap=overlap * spread(rng, 0.01, 30.0))
    return replace(chain, gap=gaps), wall


def random_scene_with_piston(
    rng: np.random.Generator, longest: int, longest_time: float
) -> hc.Scene:
    """A chain with terms as in ``random_scene_with_terms``, and a piston instead of its shock.

    Half have a constant velocity, the others a table that goes forwards and backwards.
    """
    while True:
        scene = random_scene_with_terms(rng, longest, longest_time)
        velocity = scene.units.velocity * spread(rng, 0.01, 2.0)
        if rng.random() < 0.5:
            scene = replace(scene, shock=hc.Piston(velocity))
        else:
            rows = int(rng.integers(2, 9))
            apart = np.array([spread(rng, 0.1, 20.0) for _ in range(rows)])
            time = (np.cumsum(apart) - apart[0] * (rng.random() < 0.5)) * scene.contact_time
            slope = velocity * rng.uniform(-1.0, 1.0, rows - 1) * (rng.random(rows - 1) < 0.8)
            slope[0] = velocity
            place = np.append(0.0, np.cumsum(slope * np.diff(time)))
            scene = replace(scene, shock=hc.Piston(None, tuple(time), tuple(place)))
        if rng.random() < 0.2:
            scene = replace(scene, run=hc.Run(scene.end_time * float(rng.uniform(0.1, 1.0))))
        if scene.end_time <= longest_time * scene.contact_time:
            return scene


def random_scene_with_sine(rng: np.random.Generator, longest: int, longest_time: float) -> hc.Scene:
    """A pressed chain with terms, and a sine of 1e-3 of the load up to all of it.

    Its period is 0.5 to 100 natural time units of the fastest contact.
    """
    while True:
        scene = random_scene_with_terms(rng, longest, longest_time)
        if scene.precompression is None or not scene.precompression.force:
            continue
        amplitude = scene.precompression.force * spread(rng, 1e-3, 1.0)
        frequency = 1 / (scene.contact_time * spread(rng, 0.5, 100.0))
        scene = replace(scene, shock=hc.Sine(amplitude, frequency, int(rng.integers(1, 9))))
        if scene.end_time <= longest_time * scene.contact_time:
            return scene


def random_hard_scene(
    rng: np.random.Generator, longest: int, longest_time: float, is_damped: bool
) -> hc.Scene:
    """A scene with terms and any drive: a sixth has a piston, a sixth where it can a sine."""
    kind = int(rng.integers(6))
    if kind == 0:
        scene = random_scene_with_piston(rng, longest, longest_time)
    elif kind == 1:
        scene = random_scene_with_sine(rng, longest, longest_time)
    else:
        scene = random_scene_with_terms(rng, longest, longest_time)
    return damped(rng, scene) if is_damped else scene
