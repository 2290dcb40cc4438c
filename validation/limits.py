"""Known limits, approached by scenes: both backends reach them at the rate of theory.

For each limit a sequence of scenes, the distance of their peaks from the limit with native and with
LAMMPS, and the exponent with which it falls. The limit itself is known without either: in
closed form, or from a solver of another kind (tests/oracles/extrapolation.py).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.scene.chain import MOMENTUM_IN_NATURAL_UNITS, natural_units
from hertzchain.scene.schedule import Run
from hertzchain.scene.shocks import profile_named
from tests.oracles import extrapolation
from validation.script import Row, Script, new_figure, progress, row
from validation.shipped import STEEL

TITLE = "Limits, approached by scenes"

IMPULSE_COEFFICIENT = 0.6395542321
"""F_SW / F0 = this (I / (F0 time unit))^1.2 far from an impulse I: see ``impulse_coefficient``."""

_DEPTH = 0.1
"""(F0 / A)^(2/3) in radii: so deep that LAMMPS loses few digits to its absolute coordinates."""

_DURATION = 2 * MOMENTUM_IN_NATURAL_UNITS
"""Of every pulse at LM_ratio = 1, natural time units: the area of all three is half of this."""

# Scenes


def _scene(
    granules: int, profile: str, n: float, rise_time: float, end_time: float | None = None
) -> hc.Scene:
    """A scene from times in natural units."""
    chain = hc.Chain(granules, **STEEL)
    force = chain.contact_stiffness * (_DEPTH * chain.radius) ** 1.5
    unit = natural_units(chain, force).time
    pulse = hc.Pulse(profile_named(profile), force, n, rise_time=rise_time * unit)
    return hc.Scene(chain, pulse, Run(None if end_time is None else end_time * unit))


def impulse_scene(momentum_ratio: float, granules: int = 12) -> hc.Scene:
    """A short pulse."""
    return _scene(granules, "cosine", 2.0, momentum_ratio * _DURATION / 2)


def slow_scene(profile: str, granules: int, slowness: float) -> hc.Scene:
    """A slow pulse, LM_ratio = 1 / slowness, watched until it has begun to fall."""
    rise_time = _DURATION / 2 / slowness
    return _scene(granules, profile, 2.0, rise_time, 1.2 * rise_time)


def uneven_scene(n: float) -> hc.Scene:
    """A linear rise and fall, LM_ratio = 1: a fast fall where n is near 1, a fast rise if large."""
    return _scene(10, "triangular", n, _DURATION / n)


def jump_scene(start: float, end: float) -> hc.Scene:
    """A pulse table from one force to another, in units of F0, that jumps where one is not 0."""
    like = _scene(10, "triangular", 2.0, 1.0)
    units = like.units
    times, forces = (0.0, _DURATION * units.time), (start * units.force, end * units.force)
    return hc.Scene(like.chain, hc.PulseTable(times, forces), Run((_DURATION + 20) * units.time))


# The limits themselves

RELEASE, START = (0.0, 1.0), (1.0, 0.0)
"""Forces that jump: at their end, and at their start."""


@functools.cache
def impulse_peaks(granules: int) -> FloatArray:
    """Peaks of a chain whose first granule is given the velocity 1, in natural units."""
    chain = hc.Chain(granules, **STEEL)
    unit = chain.contact_stiffness**0.4 * chain.granule_mass**0.6  # at 1 m/s
    return np.asarray(extrapolation.solve(hc.Scene(chain, hc.Striker(1.0))).force / unit)


def impulse_coefficient() -> float:
    """Far-field force of a chain whose first granule is given the velocity 1."""
    return float(np.median(impulse_peaks(50)[38:47]))


@functools.cache
def _pushed(ends: tuple[float, float]) -> FloatArray:
    scene = jump_scene(*ends)
    return np.asarray(extrapolation.solve(scene).force / scene.units.force)


def _far_field(scene: hc.Scene) -> FloatArray:
    return np.array([IMPULSE_COEFFICIENT * (scene.impulse / scene.units.momentum) ** 1.2])


def _impulse_limit(scene: hc.Scene) -> FloatArray:
    impulse = scene.impulse / scene.units.momentum
    # Without a push, force scales with the velocity V of the first granule as V^(6/5).
    return np.asarray(impulse_peaks(scene.chain.granules) * impulse**1.2)


def _quasi_static(scene: hc.Scene) -> FloatArray:
    """Of N granules pushed as one, N - i + 1 lie ahead of contact i."""
    granules = scene.chain.granules
    return 1 - np.arange(1, granules) / granules


@dataclass(frozen=True)
class Limit:
    """A limit, and the scenes that go there."""

    name: str
    parameter: str
    sequence: tuple[float, ...]  # values of the parameter, falling towards 0
    scene: Callable[[float], hc.Scene]  # of a value
    # Peak forces of a scene in the limit, natural units.
    expected: Callable[[hc.Scene], FloatArray]
    # rate, why: exponent with which the distance falls, and the reason.
    rate: float
    why: str
    # tolerance, why_tolerance: how far the measured exponent may be off, and the reason.
    tolerance: float
    why_tolerance: str
    step: Callable[[float], float]  # the step of LAMMPS at a value, natural time units
    # agreement, why_agreement: how far the two distances of a scene may differ, as a fraction, and
    # the reason.
    agreement: float
    why_agreement: str
    contact: int | None = None  # the place of the only contact that is compared; None for all


_IMPULSE = (
    "in a time t the first contact passes on t^(5/2) of momentum that a granule with a velocity"
    " would pass on differently; in times of that contact, ~ I^(-1/5), t ~ LM^(6/5)"
)
_START_UP = (
    "contacts are not stiff at first: a force a t^k sets them swinging by a^(6/(6+k)); as it grows"
    " to F0, slowly, the action of the swing stays, and with it 3/4 of the exponent; a ~ LM^(-k)"
)
_AREA = "the impulse being fixed, forces beside the corner change by the parameter"
_NEXT = "the next term is smaller by about the parameter, and bends the sequence by less than this"
_CORNER = (
    "the crest of the swing nearest to the corner of the force misses it by half a period at most;"
    " of 42 scenes between LM 10 and 2000 all lie between 0.61 and 0.95 LM^(-9/14)"
)
_TOP = (
    "the crest of the swing nearest to the top of the force misses it by half a period at most;"
    " of 41 scenes between LM 20 and 2000 all lie between 1.34 and 1.49 LM^(-9/8)"
)
_MODES = (
    "the crests of four swings fall together more or less; of 27 scenes between LM 60 and 2000 all"
    " lie between 8.6 and 12.7 LM^(-9/8)"
)
_STEPS = "the steps of LAMMPS are chosen to cost a distance so much at most"
_FAINT = "0.01 in overlap, where LAMMPS loses digits to coordinates up to 100 radii"
_SWINGS = "the steps of LAMMPS shift the last of a thousand swings by up to a tenth of a radian"


def _fine(value: float) -> float:
    return min(0.01, value * _DURATION / 4)


LIMITS = (
    Limit("impulse, N 12", "LM_ratio", (0.1, 0.05, 0.02, 0.01, 0.005),
        impulse_scene, _impulse_limit, 3.0, _IMPULSE,
        0.001, _NEXT, lambda value: value * _DURATION / 20, 5e-4, _STEPS),
    Limit("impulse, far field", "LM_ratio", (0.1, 0.05, 0.02, 0.01),
        functools.partial(impulse_scene, granules=50), _far_field, 3.0, _IMPULSE,
        0.001, _NEXT, lambda value: value * _DURATION / 20, 2e-3, _FAINT, contact=40),
    Limit("quasi-static, triangular, N 2", "1/LM_ratio", (0.1, 0.03, 0.01, 0.003, 0.001),
        functools.partial(slow_scene, "triangular", 2), _quasi_static, 9 / 14, _START_UP,
        0.1, _CORNER, lambda _: 0.02, 2e-3, _SWINGS),
    Limit("quasi-static, cosine, N 2", "1/LM_ratio", (0.03, 0.01, 0.003, 0.001),
        functools.partial(slow_scene, "cosine", 2), _quasi_static, 9 / 8, _START_UP,
        0.035, _TOP, lambda _: 0.02, 2e-3, _SWINGS),
    Limit("quasi-static, cosine, N 5", "1/LM_ratio", (0.03, 0.01, 0.003, 0.001),
        functools.partial(slow_scene, "cosine", 5), _quasi_static, 9 / 8, _START_UP,
        0.13, _MODES, lambda _: 0.02, 2e-3, _SWINGS),
    Limit("sudden release", "n - 1", (0.01, 0.003, 0.001, 0.0003),
        lambda excess: uneven_scene(1 + excess), lambda _: _pushed(RELEASE), 1.0, _AREA,
        0.01, _NEXT, _fine, 5e-4, _STEPS),
    Limit("sudden start, triangular", "1/n", (0.01, 0.003, 0.001, 0.0003),
        lambda share: uneven_scene(1 / share), lambda _: _pushed(START), 1.0, _AREA,
        0.01, _NEXT, _fine, 5e-4, _STEPS),
)  # fmt: skip

THEMSELVES = {"sudden release": RELEASE, "sudden start, triangular": START}
"""Limits that are scenes, by their forces."""


def distance(limit: Limit, scene: hc.Scene, code: hc.Native | hc.Lammps) -> float:
    """The largest relative difference of a peak from the limit."""
    if isinstance(code, hc.Lammps):
        force = code.peaks_alone(scene)[0] / scene.units.force
    else:
        force = code.run(scene).peak_force / scene.units.force
    if limit.contact is not None:
        force = force[[limit.contact]]
    return float(np.max(np.abs(force / limit.expected(scene) - 1)))


def measure(quick: bool = False, with_lammps: bool = True) -> pandas.DataFrame:
    """Distances from every limit; the quick form leaves the last scene of each sequence out.

    Columns limit, parameter, value (0 is the limit itself, as a scene), native, lammps (NaN
    without).
    """
    rows = []
    for limit in progress(LIMITS, TITLE):
        values = limit.sequence[:-1] if quick else limit.sequence
        work = [(value, limit.scene(value), limit.step(value)) for value in values]
        if limit.name in THEMSELVES:
            work.append((0.0, jump_scene(*THEMSELVES[limit.name]), 0.01))
        for value, scene, step in work:
            native, off = distance(limit, scene, hc.Native("reference")), math.nan
            if with_lammps:
                lammps = hc.Lammps(step * scene.units.time, extrapolated=True)
                off = distance(limit, scene, lammps)
            rows.append((limit.name, limit.parameter, value, native, off))
    return pandas.DataFrame(rows, columns=["limit", "parameter", "value", "native", "lammps"])


def rate(table: pandas.DataFrame, limit: Limit, backend: str) -> float:
    """The exponent with which the distance falls: a line through the logarithms."""
    frame = table[(table["limit"] == limit.name) & (table["value"] > 0)]
    return float(np.polyfit(np.log(frame["value"]), np.log(frame[backend]), 1)[0])


def promises(table: pandas.DataFrame) -> list[Row]:
    """Return checks of rates, of distances that agree, and of limits that are scenes themselves."""
    backends = [name for name in ("native", "lammps") if table[name].notna().any()]
    rows = []
    for limit in LIMITS:
        reason = f"{limit.why}; off by no more than that, as {limit.why_tolerance}"
        for backend in backends:
            measured = rate(table, limit, backend)
            what = f"{limit.name}: rate in {limit.parameter}"
            rows.append(row(what, backend, measured, limit.rate, limit.tolerance, reason))
        if "lammps" in backends:
            frame = table[(table["limit"] == limit.name) & (table["value"] > 0)]
            off = float((frame["lammps"] / frame["native"] - 1).abs().max())
            what = f"{limit.name}: distance / native's - 1"
            rows.append(row(what, "lammps", off, 0.0, limit.agreement, limit.why_agreement))
    for name in THEMSELVES:
        for backend in backends:
            itself = table[(table["limit"] == name) & (table["value"] == 0)]
            off = float(itself[backend].iloc[0])
            rows.append(row(f"{name}: itself", backend, off, 0.0, *_ITSELF[backend]))
    return rows


_ITSELF = {
    "native": (1e-11, "the limit as a pulse table that jumps: what the reference promises"),
    "lammps": (2e-8, "the limit as a pulse table that jumps: 0.01 natural units, extrapolated"),
}


def draw(table: pandas.DataFrame) -> Figure:
    """Draw distance over parameter, a panel for each limit."""
    figure = new_figure(13, 6)
    panels = figure.subplots(2, 4).flat
    for axes, limit in zip(panels, LIMITS, strict=False):
        frame = table[(table["limit"] == limit.name) & (table["value"] > 0)]
        value = frame["value"].to_numpy()
        law = frame["native"].iloc[-1] * (value / value[-1]) ** limit.rate
        axes.loglog(value, law, "-", color="0.7", linewidth=3, label="theory's exponent")
        axes.loglog(value, frame["native"], "o-", color="#000000", label="native", markersize=4)
        look: dict[str, Any] = {"color": "#0072B2", "fillstyle": "none", "markersize": 9}
        axes.loglog(value, frame["lammps"], "s", label="LAMMPS", **look)
        axes.set_title(f"{limit.name}\nexponent {limit.rate:.4g}", fontsize="medium")
        axes.set_xlabel(limit.parameter)
        axes.set_xticks(value, labels=[f"{number:g}" for number in value])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.grid(alpha=0.3)
    for axes in figure.axes[::4]:
        axes.set_ylabel("largest relative distance")
    last = figure.axes[len(LIMITS)]
    last.axis("off")
    last.legend(*figure.axes[0].get_legend_handles_labels(), loc="center", frameon=False)
    return figure


SCRIPTS = {
    "limits": Script(
        TITLE,
        "Do scenes that approach a known limit get there, at the rate that theory says?",
        measure, promises, draw,
    )
}  # fmt: skip
