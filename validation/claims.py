"""Claims of the paper's text, each with the number that confirms or contradicts it.

Forces are in units of F0 and momenta in units of L_Applied(t0_hat) unless something else is said.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas

import hertzchain as hc
from hertzchain import theory
from hertzchain.arrays import FloatArray
from hertzchain.observables.wave import FREE_END, STEADY
from hertzchain.scene.chain import MOMENTUM_IN_NATURAL_UNITS
from hertzchain.scene.shocks import PROFILES
from hertzchain.theory import paper
from hertzchain.theory import solitary_wave as exact
from validation.limits import impulse_scene
from validation.script import Row, Script, by_ends, largest, row
from validation.shipped import STEEL, Found, load, of_scene, pulse_of, simulate, table_scenes

TITLE = "Claims of the text"

WAVE = exact.solitary_wave()

Entry = dict[str, Any]
"""A row of the table."""

AT_ONCE = "LM_ratio 1: far field / F0"
FIRST = "LM_ratio 1: first contact within 1 % of the far field"
THROWN = "momentum gained by ejection"
BALANCE = "L_SW - L_Applied - momentum gained"
SHARE = "share of L_Applied in the primary wave"
DISTANCE = "impulse: peak / far field - 1"
NO_FLOOR = "p without the floor of 5"
HEIGHT = "far field / F0"
SHIFT = ("Eq. 4b over the time to the next peak - 1 [%], lowest", "the same, highest")
PASSED = ("momentum that a contact passes on over L_SW - 1 [%], lowest", "the same, highest one")
JUST_ABOVE = "LM_ratio 1.05: far field / F0"

# Numbers from peaks, momenta and forces


def thrown_back(velocity: FloatArray) -> float:
    """Return the momentum of the granules that fly backwards, positive: the gain of the others."""
    return float(-np.sum(np.minimum(velocity, 0.0)))


def far_field(peak_force: FloatArray) -> float:
    """The last peak that the free end does not touch."""
    return float(peak_force[-1 - FREE_END])


def first_within(peak_force: FloatArray, threshold: float) -> int:
    """The first contact from which all peaks are within a fraction of the far field."""
    undisturbed = peak_force[:-FREE_END]
    off = np.nonzero(np.abs(undisturbed / undisturbed[-1] - 1) >= threshold)[0]
    return int(off[-1]) + 3 if off.size else 2


def first_steady(peak_force: FloatArray, threshold: float = STEADY, of_first: bool = False) -> int:
    """The first i from which all changes to the next are below a fraction: p without its floor.

    It is a fraction of the second of the two peaks, or of the first.
    """
    before, after = peak_force[:-2], peak_force[1:-1]
    change = np.abs(after - before) / (before if of_first else after)
    unsteady = np.nonzero(change >= threshold)[0]
    return int(unsteady[-1]) + 3 if unsteady.size else 2


def wave_share(far: float, momentum_ratio: float) -> float:
    """L_SW of a wave of height ``far`` (in F0), with the exact constant, over L_Applied."""
    applied = MOMENTUM_IN_NATURAL_UNITS * momentum_ratio
    return float(WAVE.momentum * far ** (5 / 6) / applied)


def in_transition(result: hc.Result) -> dict[str, float]:
    """Ends of the errors of Eqs. 4b and 5 over contacts 2 to p of a pulse.

    Eq. 4b gives the time to the next peak. By Eq. 5, from which Eq. 6 follows, each contact passes
    on the momentum of the wave: all granules ahead of it have their momentum from it.
    """
    scene, p, unit = result.scene, result.transition_granules, result.scene.units
    assert p is not None
    n, force = pulse_of(scene)[0].duration_ratio, result.peak_force / unit.force
    by_eq4b = theory.peak_shift(np.arange(2, p + 1), force[: p - 1], p, n, scene.momentum_ratio)
    shift = by_eq4b / (np.diff(result.peak_time)[: p - 1] / unit.time)
    handed_on = np.cumsum(result.velocity[::-1])[::-1][1:p] / unit.velocity
    passed = handed_on / paper.wave_momentum(force[p - 1])
    return {
        name: float(100 * (end(ratio) - 1))
        for names, ratio in ((SHIFT, shift), (PASSED, passed))
        for name, end in zip(names, (np.min, np.max), strict=True)
    }


# What is measured


def _at_once(quick: bool) -> dict[str, hc.Scene]:
    """Scenes at LM_ratio = 1."""
    cases = [(profile, n) for profile in PROFILES for n in (2, 4, 10, 50)]
    if quick:  # the highest and the lowest wave, and the one that is there first
        cases = [("cosine", 2), ("cosine", 10), ("triangular", 50)]
    return {
        f"{profile}, n {n}": hc.Scene(hc.Chain(40, **STEEL), hc.Pulse(profile, 100.0, n, 1.0))
        for profile, n in cases
    }


def _of_scenes(scenes: dict[str, hc.Scene], results: Found) -> Iterator[Entry]:
    """Yield ejected momentum, share of the primary wave, p and far field."""
    for name, scene in scenes.items():
        (pulse, rise_time), ratio = pulse_of(scene), scene.momentum_ratio
        unit = theory.applied_momentum(pulse, theory.unit_rise_time(scene.chain, pulse))
        case: Entry = {"scene": name, "profile": pulse.profile}
        case |= {"n": pulse.duration_ratio, "momentum_ratio": ratio}
        numbers: dict[str, dict[str, float]] = {}
        for backend, result in of_scene(results, name).items():
            force = result.peak_force / scene.units.force
            far = far_field(force)
            gained = thrown_back(result.velocity) * scene.chain.granule_mass / unit
            share = wave_share(far, ratio)
            numbers[backend] = {
                AT_ONCE: far,
                FIRST: first_within(force, STEADY),
                HEIGHT: far,
                NO_FLOOR: first_steady(force),
                THROWN: gained,
                BALANCE: share * ratio - ratio - gained,
                SHARE: share,
            }
            numbers[backend] |= in_transition(result)
        wanted: tuple[str, ...] = (AT_ONCE, FIRST, NO_FLOOR)
        if ratio != 1:
            wanted = (HEIGHT, NO_FLOOR, *((THROWN, BALANCE) if ratio < 1 else (SHARE,)))
            wanted = (*wanted, *SHIFT, *PASSED)
        for what in wanted:
            entry = case | {"what": what} | {who: each[what] for who, each in numbers.items()}
            if what == THROWN:
                entry["paper"] = paper.ejection_momentum(scene.chain, pulse, rise_time) / unit
            yield entry


QUICK = ("cosine_LM0.5_n6", "cosine_LM0.7_n8", "cosine_LM0.3_n2", "cosine-triangular_LM0.8_n8",
         "cosine_LM1.4_n2", "cosine-triangular_LM1.4_n6", "cosine-triangular_LM2.0_n2",
         "cosine_LM2.5_n8")  # fmt: skip
"""Scenes with the smallest and the largest results."""

LONG = ", N 200"
"""Ends the names of the long chains, which native alone runs."""


def _shares() -> Iterator[Entry]:
    """Yield the share of the momentum in the primary wave over LM_ratio, for long chains."""
    ratios = np.array(list(SHARES))
    for profile in PROFILES:
        for n in (2.0, 10.0):
            case: Entry = {"scene": f"{profile}, n {n:g}{LONG}", "profile": profile, "n": n}
            batch = hc.similar_peak_forces(profile, ratios, n, 200)
            for ratio, force in zip(ratios, batch.peak_force, strict=True):
                far, entry = far_field(force), case | {"momentum_ratio": ratio}
                yield entry | {"what": SHARE, "native": wave_share(far, ratio)}
                if ratio == 1.05:
                    yield entry | {"what": JUST_ABOVE, "native": far}


IMPULSE = "impulse"


def _impulse(scene: hc.Scene, results: Found) -> Iterator[Entry]:
    """Yield peaks over the far field for a pulse so short that only its impulse counts."""
    force = {backend: result.peak_force for backend, result in of_scene(results, IMPULSE).items()}
    off = {backend: peaks / far_field(peaks) - 1 for backend, peaks in force.items()}
    case: Entry = {"scene": IMPULSE, "momentum_ratio": scene.momentum_ratio, "what": DISTANCE}
    for k in range(scene.chain.granules - 1):
        yield case | {"contact": k + 2} | {backend: each[k] for backend, each in off.items()}


COLUMNS = [
    "scene",
    "profile",
    "n",
    "momentum_ratio",
    "contact",
    "what",
    "paper",
    "native",
    "lammps",
]


def measure(quick: bool, with_lammps: bool) -> pandas.DataFrame:
    """Numbers for every claim; the quick form has 8 of 24 scenes, and 3 of 12 at LM_ratio 1.

    Columns scene, profile, n, momentum_ratio, contact, what, paper (as claimed), native, lammps.
    """
    names = QUICK if quick else table_scenes()
    scenes = _at_once(quick) | {name: load(name) for name in names}
    impulse = impulse_scene(0.02, granules=40)
    lammps = hc.Lammps(extrapolated=True)
    results = simulate(scenes | {IMPULSE: impulse}, TITLE, with_lammps, lammps)
    entries = [*_of_scenes(scenes, results), *_shares(), *_impulse(impulse, results)]
    return pandas.DataFrame(entries, columns=COLUMNS)


# What has to hold

_STATED = "the digits that are stated here, as found; the claim would need the number in brackets"
_FOUND = (6e-4, _STATED)
_WHOLE = (0.0, "a number of granules is whole")
_PEAKS = (5e-6, "peaks of LAMMPS are extrapolated to 1e-6, and these have a few of them in them")
_MOTION = (2e-4, "velocities are not extrapolated: velocity Verlet is off by about 1e-4")
_IN_TRANSITION = (2e-2, "percentage points: velocities of velocity Verlet are off by about 1e-4")
_WAVE_ALONE = {
    "native": (1e-12, "below LM_ratio 1 no second wave follows, and native promises 1e-12"),
    "lammps": (1e-4, "the velocities of LAMMPS are those of velocity Verlet, off by about 2e-5"),
}
SHARES = {
    1.0: (0.951, 1.018), 1.05: (0.933, 1.004), 1.25: (0.864, 0.943), 1.5: (0.786, 0.867),
    2.0: (0.661, 0.733), 2.5: (0.568, 0.629), 3.5: (0.441, 0.486), 5.0: (0.330, 0.360),
    7.0: (0.247, 0.266), 10.0: (0.179, 0.191),
}  # fmt: skip
"""Smallest and largest share of the primary wave, over profiles and n of 2 and 10, at LM_ratio."""


def promises(table: pandas.DataFrame) -> list[Row]:
    """Return each claim with the result."""
    backends = [name for name in ("native", "lammps") if table[name].notna().any()]
    rows = [entry for backend in backends for entry in _claims(table, backend)]
    if "lammps" in backends:
        for names in (SHIFT, PASSED):
            frame = table[table["what"].isin(names)]
            off = largest(frame["lammps"] - frame["native"])
            rows.append(row(f"{names[0]}: LAMMPS - native", "lammps", off, 0, *_IN_TRANSITION))
        by_both = table[~table["scene"].str.endswith(LONG)]
        for what in (AT_ONCE, FIRST, NO_FLOOR, HEIGHT, THROWN, BALANCE, SHARE, DISTANCE):
            frame = by_both[by_both["what"] == what]
            off = largest(frame["lammps"] - frame["native"])
            why = _MOTION if what in (THROWN, BALANCE) else _PEAKS
            rows.append(row(f"{what}: LAMMPS - native", "lammps", off, 0, *why))
    return rows


EQUATIONS = (
    ("below", SHIFT, (-40.7, -2.7), 0.06),
    ("above", SHIFT, (-2.4, 47.5), 0.06),
    ("below", PASSED, (-7.0, -1.0), 0.6),
    ("above", PASSED, (12.0, 65.0), 0.6),
)
"""On a side of LM_ratio 1: lowest and highest error of an equation, and the stated digits [%]."""


def _claims(table: pandas.DataFrame, backend: str) -> Iterator[Row]:
    """Yield rows of the claims a to f, and of Eqs. 4b and 5."""
    each = {str(what): frame for what, frame in table.groupby("what")}
    # a: at LM_ratio 1 a wave as high as the shock forms at once.
    at_once = each[AT_ONCE][backend]
    yield from by_ends(f"a. {AT_ONCE} (paper: 1)", backend, at_once, (0.927, 1.022), *_FOUND)
    what = "a. LM_ratio 1: far field to 1 % from contact (paper: at once)"
    yield from by_ends(what, backend, each[FIRST][backend], (2, 5), *_WHOLE)
    # b: below LM_ratio 1 ejection gains Delta L.
    gained = each[THROWN].set_index("scene")
    what, ratios = "b. Delta L / momentum gained (paper: 1)", gained["paper"] / gained[backend]
    yield by_ends(what, backend, ratios, (0.0043, np.nan), 6e-5, _STATED)[0]
    yield by_ends(what, backend, ratios, (np.nan, 11.0), 0.06, _STATED)[1]
    for scene, gain, claimed in (
        ("cosine_LM0.5_n6", 0.057, 0.003),
        ("cosine_LM0.3_n2", 0.040, 0.442),
    ):
        what = f"b. {scene}: momentum gained (paper: {claimed})"
        yield row(what, backend, gained[backend][scene], gain, *_FOUND)
    what = "b. L_SW - L_Applied - momentum gained, largest (paper: 0)"
    yield row(what, backend, largest(each[BALANCE][backend]), 0.0, *_WAVE_ALONE[backend])
    # c: above LM_ratio 1 only a share of the momentum goes into the primary wave.
    shares, what = each[SHARE], "share of L_Applied in the wave"
    is_long = shares["scene"].str.endswith(LONG)
    name = f"c. LM_ratio 1.4 to 2.5: {what}"
    yield from by_ends(name, backend, shares[~is_long][backend], (0.615, 0.897), *_FOUND)
    for ratio, expected in SHARES.items() if backend == "native" else ():
        values = shares[is_long & (shares["momentum_ratio"] == ratio)]["native"]
        name = f"c. LM_ratio {ratio:g}, N 200: {what}"
        yield from by_ends(name, "native", values, expected, *_FOUND)
    # d: under an impulse a wave forms at 7 to 10 granules.
    peaks = 1 + each[DISTANCE][backend].to_numpy(np.float64)
    for what, first, threshold, contact in (
        ("far field to 2 % from contact", first_within, 0.02, 6),
        ("far field to 1 % from contact", first_within, 0.01, 7),
        ("far field to 0.1 % from contact", first_within, 0.001, 11),
        ("first change below 1 %", first_steady, 0.01, 5),
        ("first change below 0.1 %", first_steady, 0.001, 9),
    ):
        # Without numbers there is no first contact.
        measured = first(peaks, threshold) if np.all(np.isfinite(peaks)) else np.nan
        yield row(f"d. impulse: {what} (paper: 7 to 10)", backend, measured, contact, *_WHOLE)
    # e: p is never below 5.
    floors, what = each[NO_FLOOR], "e. p by changes below 1 % alone (paper: at least 5)"
    yield by_ends(what, backend, floors[backend], (2, np.nan), *_WHOLE)[0]
    at_once = floors[floors["momentum_ratio"] == 1][backend]
    yield from by_ends(f"{what}, LM_ratio 1", backend, at_once, (2, 4), *_WHOLE)
    # f: below LM_ratio 1 the wave is lower than F0, above it is higher.
    heights = each[HEIGHT]
    below = heights[heights["momentum_ratio"] < 1][backend]
    what = "f. LM_ratio 0.3 to 0.8: far field / F0 (paper: below 1)"
    yield by_ends(what, backend, below, (np.nan, 0.787), *_FOUND)[1]
    above = heights[heights["momentum_ratio"] > 1][backend]
    what = "f. LM_ratio 1.4 to 2.5: far field / F0 (paper: above 1)"
    yield by_ends(what, backend, above, (1.194, np.nan), *_FOUND)[0]
    if backend == "native":
        what = f"f. {JUST_ABOVE} (paper: above 1)"
        yield from by_ends(what, backend, each[JUST_ABOVE]["native"], (0.975, 1.065), *_FOUND)
    # Eqs. 4b and 5 in the transition.
    for side, names, limits, tolerance in EQUATIONS:
        is_there = table["what"].isin(names) & ((table["momentum_ratio"] < 1) == (side == "below"))
        what = f"LM_ratio {side} 1: {names[0].partition(',')[0]} (paper: 0)"
        yield from by_ends(what, backend, table[is_there][backend], limits, tolerance, _STATED)


SCRIPTS = {
    "claims": Script(
        TITLE,
        "Which claims of the text hold, and by how much do the others miss?",
        measure, promises,
    )
}  # fmt: skip
