"""The table of scenes, of every kind, that all contracts are tried on; and those of the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.scene.shocks import Shock
from tests.conftest import STEEL, paper_scene
from validation.random_scenes import random_scene_with_piston

FOLDER = Path(__file__).parent.parent / "validation" / "scenes"

NAMES = sorted(path.stem for path in FOLDER.glob("*_LM*.toml"))
"""All 24 scenes of Tables 2, 3 and 4."""


def load(name: str) -> hc.Scene:
    return hc.Scene.from_toml(FOLDER / f"{name}.toml")


PTFE = {"radius": 4.75e-3, "young_modulus": 1.46e9, "poisson_ratio": 0.46, "density": 2200.0}


def row(*granules: dict[str, float]) -> hc.Chain:
    return hc.Chain(len(granules), **{key: [g[key] for g in granules] for key in STEEL})


UNIFORM, EIGHT, DIMER = hc.Chain(12, **STEEL), hc.Chain(8, **STEEL), row(*[STEEL, PTFE] * 6)
PULSE = hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0)
LOAD, PRESSED = hc.Precompression(20.0), hc.Precompression(10.0)
RIGID, SAME, ELASTIC = hc.Wall("rigid"), hc.Wall("same"), hc.Wall("elastic", 70e9, 0.33)

PLAIN = {
    "pulse": paper_scene("cosine-triangular", 2.0, 2.0, granules=12),
    # Jumps at its first row, and legs of different steps.
    "table": hc.Scene(
        hc.Chain(6, **STEEL), hc.PulseTable((1e-5, 3e-5, 4e-5, 7e-5), (20.0, 100.0, 60.0, 0.0))
    ),
    # A softer chain is run instead; radius, density and Poisson's ratio are not those of steel.
    "weak": hc.Scene(
        hc.Chain(5, 0.02, 3e9, 0.45, 1200.0), hc.Pulse("cosine", 1e-4, 3.0, momentum_ratio=0.6)
    ),
    # The run ends within the pulse.
    "short": hc.Scene(
        hc.Chain(3, **STEEL), hc.Pulse("triangular", 50.0, 2.0, rise_time=1e-4), hc.Run(1.5e-4)
    ),
}

TERMS = {
    "large striker": hc.Scene(UNIFORM, hc.Striker(1.0, radius=8e-3)),
    "striker, rigid wall": hc.Scene(UNIFORM, hc.Striker(1.0), wall=RIGID),
    "dimer": hc.Scene(DIMER, PULSE),
    "dimer, elastic wall": hc.Scene(DIMER, PULSE, wall=ELASTIC),
    "gaps": hc.Scene(replace(UNIFORM, gap=1e-5), PULSE),
    "gaps, wall": hc.Scene(replace(UNIFORM, gap=1e-5), PULSE, wall=hc.Wall("same", gap=2e-5)),
    "precompression": hc.Scene(UNIFORM, PULSE, precompression=LOAD),
    "column": hc.Scene(
        DIMER, hc.Striker(0.5), wall=SAME, precompression=hc.Precompression(gravity=9.81)
    ),
    "all at once": hc.Scene(
        DIMER, hc.Striker(0.5, radius=6e-3), wall=ELASTIC,
        precompression=hc.Precompression(3.0, 9.81),
    ),
}  # fmt: skip

FLIGHTS = {
    "a pulse through gaps, which collide in several places": hc.Scene(
        hc.Chain(12, gap=1e-6, **STEEL), PULSE, hc.Run(5e-4)
    ),
    "beside a gap, contacts at rest": hc.Scene(
        hc.Chain(6, gap=(0.0, 0.0, 0.0, 2e-7, 0.0, 0.0), **STEEL), hc.Striker(0.1), hc.Run(4e-4)
    ),
    "a wall beyond the last gap": hc.Scene(
        hc.Chain(4, gap=(0.0, 1e-7, 3e-7, 1e-7), **STEEL), hc.Striker(0.1), hc.Run(4e-4),
        hc.Wall("rigid", gap=2e-7),
    ),
    "falling on a wall": hc.Scene(
        hc.Chain(3, **STEEL), replace(PULSE, peak_force=1.0), hc.Run(2e-3), SAME,
        hc.Precompression(gravity=9.81),
    ),
}  # fmt: skip

# Damped contacts

RESTITUTION = hc.Contact("restitution", restitution=0.8)
VISCOELASTIC = hc.Contact("viscoelastic", relaxation_time=1e-6)
DASHPOT = hc.Contact("dashpot", coefficient=5.0)
PULLING = replace(RESTITUTION, attraction=True)
LAWS = {
    "restitution": RESTITUTION,
    "viscoelastic": VISCOELASTIC,
    "dashpot": DASHPOT,
    "restitution, pulling": PULLING,
}


def scene_with(law: hc.Contact) -> hc.Scene:
    """All terms at once, in nine granules of three kinds."""
    kinds = [STEEL, STEEL | {"density": 3000.0}, STEEL | {"radius": 4e-3}] * 3
    load = hc.Precompression(2.0, 9.81)
    striker = hc.Striker(0.5, radius=6e-3)
    return hc.Scene(row(*kinds), striker, wall=ELASTIC, precompression=load, contact=law)


ALL_TERMS = {name: scene_with(law) for name, law in LAWS.items()}
DAMPED = {
    "restitution": replace(TERMS["all at once"], contact=RESTITUTION),
    "restitution, pulling": replace(TERMS["gaps"], contact=PULLING),
    "viscoelastic": replace(TERMS["dimer, elastic wall"], contact=VISCOELASTIC),
    "viscoelastic, pulling": replace(
        TERMS["precompression"], contact=replace(VISCOELASTIC, attraction=True)
    ),
    "dashpot, pulling": replace(TERMS["column"], contact=replace(DASHPOT, attraction=True)),
}
"""All laws, and scenes that have every term; LIGGGHTS has the first two, Yade only the first."""

# Drives

MOTION = hc.Piston(None, (1e-5, 5e-5, 9e-5, 2e-4), (0.0, 4e-6, 1e-6, 2e-6))
PISTONS = {
    "constant velocity": hc.Scene(EIGHT, hc.Piston(0.1)),
    "forwards and backwards": hc.Scene(EIGHT, MOTION, precompression=PRESSED),
    "backwards alone": hc.Scene(
        EIGHT, hc.Piston(None, (0.0, 1e-4), (0.0, -1e-5)), precompression=PRESSED
    ),
    "gaps, wall": hc.Scene(
        hc.Chain(4, **STEEL, gap=1e-6), hc.Piston(0.1), wall=hc.Wall("same", gap=2e-6)
    ),
    "column": hc.Scene(
        hc.Chain(6, **STEEL | {"radius": [5e-3, 4e-3] * 3}), MOTION, wall=ELASTIC,
        precompression=hc.Precompression(3.0, 9.81),
    ),
}  # fmt: skip
SINES = {
    "slow": hc.Scene(EIGHT, hc.Sine(3.0, 2000.0, 2), precompression=PRESSED),
    "as strong as the load": hc.Scene(EIGHT, hc.Sine(10.0, 8000.0, 3), precompression=PRESSED),
    "above the cut-off, wall": hc.Scene(
        hc.Chain(5, **STEEL), hc.Sine(5.0, 3e4, 2), wall=RIGID,
        precompression=hc.Precompression(10.0, 9.81),
    ),
}  # fmt: skip
DAMPED_PISTONS = {
    # Three strokes of one step: the second run and the third had the same, 3.5 bounds off.
    "short strokes": random_scene_with_piston(np.random.default_rng([7001, 2653]), 12, 250.0),
    # Its contact would pull at once, and presses again before a step is over.
    "stops before a strong damper": hc.Scene(
        hc.Chain(4, **STEEL), hc.Piston(None, (1e-5, 1.5e-5), (0.0, 1e-6)), hc.Run(1e-4),
        precompression=PRESSED, contact=hc.Contact("restitution", restitution=0.01),
    ),
    # It is not a single step, both of a run and of that which tells its error.
    "a stroke shorter than a step": hc.Scene(
        hc.Chain(4, **STEEL), hc.Piston(None, (1e-5, 1.2e-5, 3e-5), (0.0, 1e-7, -3e-7)),
        hc.Run(1.5e-4), precompression=hc.Precompression(0.01),
        contact=hc.Contact("dashpot", coefficient=10.0),
    ),
}  # fmt: skip
DAMPED_DRIVES = {
    "forwards and backwards, damped": replace(
        PISTONS["forwards and backwards"], contact=RESTITUTION
    ),
    "as strong as the load, damped": replace(SINES["as strong as the load"], contact=RESTITUTION),
}

# Local shocks, fixed granules, near walls

WITHIN = hc.Pulse("cosine", 100.0, 2.0, rise_time=2e-5, granule=5)


def local(shock: Any = WITHIN, **more: Any) -> hc.Scene:
    """A chain of twelve, of which a granule within is pushed."""
    return hc.Scene(UNIFORM, shock, hc.Run(4e-4), **more)


LOCAL = {
    "free": local(),
    "pressed": local(precompression=LOAD),
    "gaps": local(wall=hc.Wall("rigid", gap=1e-6)),
    "damped": local(contact=hc.Contact("restitution", restitution=0.9)),
    "sine": local(hc.Sine(10.0, 5000.0, 2, granule=3), precompression=LOAD),
}


FIRST_PUSHED = replace(WITHIN, granule=1)


def held(*numbers: int, granules: int = 8, shock: Any = FIRST_PUSHED, **more: Any) -> hc.Scene:
    """A chain of steel whose granules of these numbers are fixed."""
    fixed = [number in numbers for number in range(1, granules + 1)]
    return hc.Scene(hc.Chain(granules, **STEEL, fixed=fixed), shock, hc.Run(4e-4), **more)


FIXED = {
    "free": held(4),
    "pressed": held(4, 8, precompression=LOAD),
    "piston": held(4, shock=hc.Piston(0.5)),
    "striker": held(4, 8, shock=hc.Striker(0.5), precompression=LOAD),
    "damped": held(4, contact=hc.Contact("restitution", restitution=0.9)),
}
"""One granule is fixed, and two are, in turn."""

RADII, THROWN = [4e-3, 5e-3, 3e-3, 6e-3, 5e-3, 4e-3], [-1.0, -1.0, 0.0, 0.0, 0.0, 0.0]
FOURTH_PUSHED = replace(WITHIN, granule=4)


def at_near_wall(near: hc.Wall | None = RIGID, shock: Any = None, **more: Any) -> hc.Scene:
    """Six spheres; without a shock the first two fly towards the near end."""
    chain = {**STEEL, "velocity": THROWN if shock is None else 0.0, **more.pop("chain", {})}
    shock = hc.Moving() if shock is None else shock
    return hc.Scene(hc.Chain(6, **chain), shock, hc.Run(2e-4), near_wall=near, **more)


def damped_at_walls(law: hc.Contact, parameter: float) -> hc.Scene:
    """A chain of unlike spheres between two walls; the near one has a damping of its own."""
    near = RIGID.damped(law.with_parameter(parameter))
    return at_near_wall(near, contact=law, wall=ELASTIC, chain={"radius": RADII})


NEAR_WALL = {
    "both ends": at_near_wall(SAME, wall=ELASTIC, chain={"radius": RADII}),
    "gaps": at_near_wall(replace(ELASTIC, gap=1e-7), chain={"gap": 1e-7}),
    "pressed": at_near_wall(SAME, precompression=LOAD),
    "restitution": damped_at_walls(hc.Contact("restitution", restitution=0.9), 0.5),
    "viscoelastic": damped_at_walls(VISCOELASTIC, 2e-6),
    "pulse": at_near_wall(RIGID, FIRST_PUSHED),
    "sine": at_near_wall(SAME, hc.Sine(10.0, 2e4, 2, granule=2), precompression=LOAD),
    "weight": at_near_wall(
        SAME, FOURTH_PUSHED, precompression=hc.Precompression(20, 9.8), wall=RIGID
    ),
    "fixed": at_near_wall(
        SAME, FOURTH_PUSHED, precompression=LOAD, chain={"fixed": [False] * 5 + [True]}
    ),
}

STRONGER = hc.Contact("dashpot", coefficient=20.0)


def with_law(scenes: dict[str, hc.Scene], law: hc.Contact, *names: str) -> dict[str, hc.Scene]:
    """Scenes with damped contacts: those of these names, by default all."""
    return {name: replace(scenes[name], contact=law) for name in names or scenes}


FORMULAS: dict[type[Shock], Callable[[Any, FloatArray], FloatArray]] = {
    hc.HalfSine: lambda shock, t: np.sin(np.pi / shock.duration * t),
    hc.Sawtooth: lambda shock, t: t / shock.duration,
    hc.Trapezoid: lambda shock, t: np.clip(
        np.minimum(t / shock.rise_time, (shock.duration - t) / shock.fall_time), 0, 1
    ),
    hc.Sine: lambda shock, t: np.sin(2 * np.pi * shock.frequency * t),
}
"""Force over the largest one at times [s] of a shock, which shares nothing with its ramps."""


def force_of(shock: Any, time: FloatArray) -> FloatArray:
    """The force of a shock [N] by its formula, 0 after its end."""
    if isinstance(shock, hc.PulseTable):
        return np.interp(time, shock.time, shock.force, left=0.0, right=0.0)
    if type(shock) in (hc.Striker, hc.Piston, hc.Moving):
        return np.zeros_like(time)
    force = shock.peak_force * FORMULAS[type(shock)](shock, time)
    return np.where(time < shock.ramps()[-1].end, force, 0.0)


TABLE: dict[str, dict[str, hc.Scene]] = {
    "plain": PLAIN,
    "terms": TERMS,
    "damped": DAMPED,
    "all terms": ALL_TERMS,
    "flights": FLIGHTS,
    "flights, damped": with_law(FLIGHTS, STRONGER),
    "local": LOCAL,
    "fixed": FIXED,
    "near wall": NEAR_WALL,
    "piston": PISTONS,
    "piston, damped": DAMPED_PISTONS | with_law(
        PISTONS, RESTITUTION, "constant velocity", "backwards alone", "gaps, wall"
    ),
    "piston, pulling": with_law(
        PISTONS, hc.Contact("dashpot", coefficient=2.0, attraction=True),
        "forwards and backwards", "column",
    ),
    "sine": SINES,
    "sine, damped": with_law(
        SINES, VISCOELASTIC, "as strong as the load", "above the cut-off, wall"
    ),
    "drives, damped": DAMPED_DRIVES,
}  # fmt: skip
"""By kind and name. A test on them is named by kind, name and engine."""

EVERY = [(kind, name) for kind, scenes in TABLE.items() for name in scenes]
