"""Figure 2: the velocity of the granules in space is one profile, whatever its height.

Three waves of very different height, from different shocks, are sampled far from both ends, at 20
times while they pass one contact. Position is counted in granules from the crest, velocity in the
natural unit of a wave of that contact force, so that nothing is fitted. They are compared with the
paper's profile (section 5.1) and the exact solitary wave. The paper does not state the peak
velocities of its figure; these are chosen.

Two widths are measured: where the velocity is above half, and above 1 % of its peak. The paper's
"about 5 granules" is sqrt(10) pi R, the length of Nesterenko's compact wave, a fourth power of a
cosine; a wave spans as many granules as that compact wave which is as wide at 1 %.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.backend import run_in
from hertzchain.engines.lammps.engine import Child
from hertzchain.scene.chain import natural_units
from hertzchain.theory.paper import SHIFT
from validation.script import BACKENDS, Row, Script, new_figure, row
from validation.shipped import STEEL, history_of

TITLE = "Figure 2: velocity of the granules in space"

GRANULES = 100
CONTACT = 70
"""Place where the wave is sampled: 30 contacts from the free end, and so far from the shock that
the wave is alone.
"""

PHASES = 20
"""Number of sample times on its way from one contact to the next."""

HALF_WIDTH = 6.0
"""Granules on either side of the crest."""

PAPER_SPAN = math.sqrt(10) * math.pi / 2
"""The paper's width, sqrt(10) pi R (section 4.1), in granules: 4.967."""

WAVES = {
    "(a) large": hc.Pulse("cosine", 1000.0, 4.0, momentum_ratio=2.0),
    "(b) intermediate": hc.Pulse("triangular", 100.0, 4.0, momentum_ratio=1.0),
    "(c) small": hc.Pulse("cosine-triangular", 1.0, 4.0, momentum_ratio=0.3),
}
"""Chosen: profile, F0 and LM_ratio all differ."""

_LAMMPS = hc.Lammps(rtol=1e-5)
"""Not extrapolated: the history would be that of the finer run, whose steps are long."""


# The profiles of the formulas


@dataclass(frozen=True)
class Profile:
    """Velocity over position at the crest of a wave whose largest force is 1, natural units."""

    label: str  # source
    velocity: Any  # function of positions [granules from the crest], of any shape

    def width(self, fraction: float) -> float:
        """Granules between the points where the velocity is a fraction of its peak."""
        x = np.linspace(-4, 4, 1601)
        return width(x, self.velocity(x), fraction)


@functools.cache
def exact_profile() -> Profile:
    """The exact solitary wave.

    A granule gains the force behind it less the force before it, so that its velocity is the
    integral of the force over the granule's length, over c: a product with sinc in Fourier space.
    """
    wave = theory.solitary_wave.solitary_wave()
    points, spacing = wave.x.size, float(wave.x[1] - wave.x[0])
    frequency = np.fft.rfftfreq(points, spacing)
    # x = 0 is in the middle of the grid. The wave is even: its transform is real.
    force = np.fft.rfft(np.fft.ifftshift(wave.overlap**1.5)).real
    amplitude = force * np.sinc(frequency) / (wave.speed * points)
    amplitude[1:] *= 2  # each stands for its negative frequency, too

    def velocity(x: FloatArray) -> FloatArray:
        return np.asarray(np.cos(2 * np.pi * np.multiply.outer(x, frequency)) @ amplitude)

    return Profile("exact solitary wave", velocity)


@functools.cache
def paper_profile() -> Profile:
    """The paper's (section 5.1), times T = 1.077, which makes it a velocity in natural units."""
    x = np.linspace(0, HALF_WIDTH + 0.5, 131)
    # Its crest is half a granule ahead of where the paper counts from; it is even about that.
    velocities = SHIFT * theory.granule_velocity(x + 0.5)

    def velocity(at: FloatArray) -> FloatArray:
        return np.asarray(CubicSpline(x, velocities, bc_type=("clamped", "not-a-knot"))(np.abs(at)))

    return Profile("paper, section 5.1", velocity)


def width(x: FloatArray, velocity: FloatArray, fraction: float) -> float:
    """Distance between the points on either side of the peak where a fraction of it is left.

    Between the increasing positions ``x``, close to one another, a cubic spline is taken. NaN where
    the velocity does not fall so far on both sides.
    """
    spline = CubicSpline(x, velocity)
    turns = np.append(spline.derivative().roots(extrapolate=False), x[np.argmax(velocity)])
    heights = spline(turns)
    centre = turns[np.argmax(heights)]
    crossings = spline.solve(fraction * np.max(heights), extrapolate=False)
    before, after = crossings[crossings < centre], crossings[crossings > centre]
    return float(after[0] - before[-1]) if before.size and after.size else float("nan")


def span(width: float, fraction: float) -> float:
    """Length of the compact wave, cosine to the fourth, with a width at a fraction of its peak."""
    return width * math.pi / (2 * math.acos(fraction**0.25))


# What is simulated


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Velocity over position of each wave; in the quick form LAMMPS has the intermediate wave only.

    Columns wave, backend, force_N (peak of the contact that is passed), speed (granules per natural
    time unit of a wave of that force), x (granules from the crest, increasing), velocity (over the
    natural unit of such a wave), velocity_m_s, at_once (which of the times).
    """
    tables = []
    with Child() as child:
        for name, pulse in WAVES.items():
            scene = hc.Scene(hc.Chain(granules=GRANULES, **STEEL), pulse)
            native = hc.Native("reference")
            passing = native.run(scene).peak_time[CONTACT - 2 : CONTACT]
            times = np.linspace(passing[0], passing[1], PHASES, endpoint=False)
            tables.append(_seen(name, native.run(scene, times)))
            if with_lammps and (not quick or name == list(WAVES)[1]):
                tables.append(_seen(name, run_in(child, _LAMMPS, scene, times)))
    return pandas.concat(tables, ignore_index=True)


def _seen(name: str, result: hc.Result) -> pandas.DataFrame:
    """Return a wave of one backend, from its own peaks."""
    history = history_of(result)
    force = float(result.peak_force[CONTACT - 2])
    begin, end = result.peak_time[CONTACT - 2 : CONTACT]
    units = natural_units(result.scene.chain, force)
    granule = np.arange(1, GRANULES + 1)
    # Contact i lies between granules i - 1 and i; the crest of the wave is there when it peaks.
    crest = CONTACT - 0.5 + (history.time - begin) / (end - begin)
    x = granule - crest[:, None]
    at_once = np.broadcast_to(np.arange(PHASES)[:, None], x.shape)
    near = np.abs(x) <= HALF_WIDTH
    order = np.argsort(x[near])
    velocity = history.velocity[near][order]
    columns = {
        "wave": name, "backend": result.backend, "force_N": force,
        "speed": units.time / (end - begin), "x": x[near][order],
        "velocity": velocity / units.velocity, "velocity_m_s": velocity,
        "at_once": at_once[near][order],
    }  # fmt: skip
    return pandas.DataFrame(columns)


# What has to hold

EXACT = {
    "native": (1e-11, "of the peak: right to 1e-11, and at contact 70 only the wave is left"),
    "lammps": (1e-5, "of the peak: steps for peaks to 1e-5"),
}
WIDTH = {
    "native": (5e-6, "granules: a cubic spline, whose points lie a fifth of the velocity apart"),
    "lammps": (2.5e-4, "granules: 1e-5 of the peak, at a slope of 4 % per granule"),
}
SIMILARITY = (
    "granules: similarity makes all waves one, and the spline's error is that of all; what the"
    " profiles of two waves are off by, over a slope of 4 % per granule, is left"
)
COUNT = "a whole number"
SPAN = (
    "granules, found: at 1 % the wave is as wide as the paper's, sqrt(10) pi / 2 = 4.967 long;"
    " at half it is narrower, as the compact wave is only the long-wave limit"
)
FOUND = "found: both are formulas, the last digit is rounding"


def promises(table: pandas.DataFrame) -> list[Row]:
    """Checks of profile, speed and widths of each wave; one width for all; the paper's profile."""
    rows = []
    widths: dict[str, list[list[float]]] = {}
    exact = exact_profile()
    expected = {fraction: exact.width(fraction) for fraction in (0.5, 0.01)}
    for (wave, who), frame in table.groupby(["wave", "backend"], sort=False):
        what, backend = str(wave), str(who)
        x, velocity = frame["x"].to_numpy(), frame["velocity"].to_numpy()
        peak = float(exact.velocity(np.zeros(1))[0])
        off = np.max(np.abs(velocity - exact.velocity(x))) / peak
        rows.append(row(f"{what}: less the exact wave, largest", backend, off, 0, *EXACT[backend]))
        speed = frame["speed"].iloc[0] / theory.solitary_wave.solitary_wave().speed
        rows.append(row(f"{what}: speed over the exact one", backend, speed, 1, *EXACT[backend]))
        spans = [width(x, velocity, fraction) for fraction in expected]
        for measured, (fraction, exact_width) in zip(spans, expected.items(), strict=True):
            name = f"{what}: width above {100 * fraction:g} % of the peak"
            rows.append(row(name, backend, measured, exact_width, *WIDTH[backend]))
        widths.setdefault(backend, []).append(spans)
        moving = frame["velocity"] > 0.01 * np.max(velocity)
        most = moving.groupby(frame["at_once"]).sum().max()
        name = f"{what}: most granules above 1 % at once (paper: about 5)"
        rows.append(row(name, backend, most, 4, 0, COUNT))
    for backend, each_wave in widths.items():
        if len(each_wave) < 2:
            continue
        for k, fraction in enumerate(expected):
            spread = np.ptp([each[k] for each in each_wave])
            name = f"width above {100 * fraction:g} %, widest less narrowest of the waves"
            rows.append(row(name, backend, spread, 0, 50 * EXACT[backend][0], SIMILARITY))
        for k, fraction, claimed in ((1, 0.01, PAPER_SPAN), (0, 0.5, 4.336)):
            spanned = span(float(np.mean([each[k] for each in each_wave])), fraction)
            name = f"granules that it spans by its width at {100 * fraction:g} % (paper: about 5)"
            rows.append(row(name, backend, spanned, claimed, 0.01, SPAN))
    return [*rows, *_of_the_paper(expected)]


def _of_the_paper(expected: dict[float, float]) -> Iterator[Row]:
    """Compare the paper's profile with the exact one."""
    x = np.linspace(-4, 4, 1601)
    paper, exact = paper_profile().velocity(x), exact_profile().velocity(x)
    off = np.max(np.abs(paper - exact)) / np.max(exact)
    name = "largest difference from the exact wave, of its peak"
    yield row(name, "paper", off, 0.02, 5e-4, FOUND)
    for (fraction, exact_width), stated in zip(expected.items(), (1.0223, 1.0447), strict=True):
        name = f"width above {100 * fraction:g} % over the exact one"
        ratio = paper_profile().width(fraction) / exact_width
        yield row(name, "paper", ratio, stated, 1e-4, FOUND)


def draw(table: pandas.DataFrame) -> Figure:
    """The paper's three panels, then all three waves on one scale."""
    figure = new_figure(10, 6.8, f"{TITLE} (heights chosen)")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1, 1.35))
    top, bottom = parts
    waves = list(dict.fromkeys(table["wave"]))
    for axes, wave in zip(top.subplots(1, len(waves)), waves, strict=True):
        frame = table[table["wave"] == wave]
        for backend, style in BACKENDS.items():
            # One sample in five, so that markers do not overlap.
            seen = frame[(frame["backend"] == backend) & (frame["at_once"] % 5 == 0)]
            smaller = style | {"markersize": 0.7 * style["markersize"]}
            axes.plot(seen["x"], 1e3 * seen["velocity_m_s"], **smaller)
        shock = WAVES[wave]
        name = f"{wave}\n{shock.profile}, {shock.peak_force:g} N, LM_ratio {shock.momentum_ratio}"
        axes.set_title(name, fontsize="small")
        axes.set(xlabel="granules from the crest", xlim=(-5, 5))
        axes.grid(alpha=0.3)
    top.axes[0].set_ylabel("velocity [mm/s]")
    top.axes[0].legend(fontsize="small")
    x = np.linspace(-HALF_WIDTH, HALF_WIDTH, 1201)
    formulas = ((exact_profile(), "#000000", "-"), (paper_profile(), "#D55E00", "--"))
    linear, log = bottom.subplots(1, 2)
    for axes in (linear, log):
        for formula, colour, line in formulas:
            axes.plot(x, formula.velocity(x), line, color=colour, label=formula.label)
        colours = ("#0072B2", "#009E73", "#CC79A7")
        for wave, marker, colour in zip(waves, "os^", colours, strict=True):
            seen = table[(table["wave"] == wave) & (table["backend"] == "native")]
            seen = seen[seen["at_once"] % 5 == 0]
            look: dict[str, Any] = {"color": colour, "markersize": 5, "fillstyle": "none"}
            axes.plot(seen["x"], seen["velocity"], marker, label=wave, **look)
        axes.set(xlabel="granules from the crest", xlim=(-5, 5))
        axes.grid(alpha=0.3)
    linear.set_ylabel("velocity, natural units of the wave")
    linear.legend(fontsize="small")
    peak = float(np.max(exact_profile().velocity(x)))
    wide = exact_profile().width(0.01)
    log.plot([-wide / 2, wide / 2], [0.01 * peak] * 2, "|-", color="0.4")
    log.annotate(f"{wide:.2f} granules\nabove 1 %", (0, 0.007 * peak), ha="center", va="top")
    log.set_title("the same, on a logarithmic scale", fontsize="small")
    log.set(yscale="log", ylim=(1e-6, 3))
    return figure


SCRIPTS = {
    "figure2": Script(
        TITLE,
        "Has the wave one width, about 5 granules, whatever its height?",
        measure, promises, draw,
    )
}  # fmt: skip
