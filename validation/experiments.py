"""Fits of synthetic experiments: intervals that hold the truth, wrong models that are detected."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas
from scipy.integrate import solve_ivp

import hertzchain as hc
from hertzchain.lab.fit import LEAST_CHANCE, MOST_MEAN_SQUARE
from hertzchain.lab.validation import validate
from validation.script import Row, Script, progress, row
from validation.shipped import STEEL

FAR = 5.0
"""Deviations from the truth beyond which a fit stands in another minimum: noise does it once in a
million."""

COLUMNS = [
    *("kind", "seed", "values", "held", "farthest", "is_noise", "mean_square", "chance", "fails"),
    *("differs", "failure"),
]
WRONG = ("dashpot", "viscoelastic", "material", "gap", "drag")


def traces_of(scene: hc.Scene, noise: float, random: np.random.Generator, drag: float = 0.0) -> Any:
    """Return clean traces on an unknown clock, and those with offsets and white noise."""
    run = hc.Native(rtol=1e-8).run(scene, record=1000)
    clean = run.to_traces()
    if drag:
        clean.iloc[:, 1:] = dragged(run.scene, clean["time_s"].to_numpy(), drag)
    clean["time_s"] += random.uniform(-1e-3, 1e-3)
    noisy = clean.copy()
    for name in clean.columns[1:]:
        off = 0.05 * random.normal() + noise * random.normal(size=len(clean))
        noisy[name] += clean[name].max() * off
    return clean, noisy


def dragged(scene: hc.Scene, time: Any, drag: float) -> Any:
    """Return the forces of gauges if each granule loses its speed at the rate ``drag`` [1/s]."""
    chain, n = scene.chain, scene.chain.granules
    unit = chain.granule_mass / chain.contact_stiffness  # forces over A, so that SciPy sees sizes

    def force(y: Any) -> Any:
        return np.pad(np.maximum(y[: n - 1] - y[1:n], 0.0) ** 1.5, ((1, 1), (0, 0))[: y.ndim])

    def rate(_: float, y: Any) -> Any:
        return np.append(y[n:], -np.diff(force(y)) / unit - drag * y[n:])

    start = np.zeros(2 * n)
    assert isinstance(scene.shock, hc.Striker)
    start[n] = scene.shock.velocity
    at = np.repeat([scene.units.length, scene.units.velocity], n)
    done = solve_ivp(rate, time[[0, -1]], start, "DOP853", time, rtol=1e-9, atol=1e-10 * at)
    both = chain.contact_stiffness * force(done.y)
    places = [gauge.granule for gauge in scene.gauges]
    return np.stack([(both[place - 1] + both[place]) / 2 for place in places if place], axis=1)


def experiment(kind: str, seed: int) -> dict[str, Any]:
    """Return the fit of an experiment on a chain drawn at random, against its truth.

    It has 8 to 30 granules, one to four gauges, and noise of 0.3 to 3 %; the fit starts within
    10 %. Right models have gaps in two of five cases; ``kind`` is the term that a wrong model
    lacks.
    """
    random = np.random.default_rng(seed)
    granules, is_right = int(random.integers(8, 31)), kind == "right"
    truth = {
        "chain.young_modulus": STEEL["young_modulus"] * random.uniform(0.9, 1.1),
        "contact.restitution": random.uniform(0.7, 0.97),
        "striker.velocity": random.uniform(0.1, 2.0),
        "chain.gap": random.uniform(1e-6, 5e-6) * (random.random() < 0.4) * is_right,
    }

    def scene(values: dict[str, float], gauges: tuple[hc.Gauge, ...] = ()) -> hc.Scene:
        material = {**STEEL, "young_modulus": values["chain.young_modulus"]}
        contact = hc.Contact("restitution", restitution=values["contact.restitution"])
        chain = hc.Chain(granules, **material, gap=values["chain.gap"])
        return hc.Scene(
            chain, hc.Striker(values["striker.velocity"]), contact=contact, gauges=gauges
        )

    count = int(random.integers(1, 5))
    places = sorted(random.choice(np.arange(2, granules), size=count, replace=False).tolist())
    names = [name for name, value in truth.items() if value]
    # One gauge determines two of E, e and the speed.
    free = names if count > 1 else [*sorted(random.choice(names[:3], 2, False)), *names[3:]]
    guess = {key: truth[key] * (random.uniform(0.9, 1.1) if key in free else 1.0) for key in truth}
    guess["contact.restitution"] = min(guess["contact.restitution"], 0.99)
    true = scene(truth, tuple(hc.Gauge(granule=place) for place in places))
    noise = 10 ** random.uniform(np.log10(0.003), np.log10(0.03))
    true, drag = (true, 0.0) if is_right else changed(true, kind, random)
    clean, noisy = traces_of(true, noise, random, drag)
    row: dict[str, Any] = {"kind": kind, "seed": seed}
    try:
        fit = hc.fit(scene(guess), noisy, free)
    except hc.HertzchainError as problem:
        return row | {"failure": str(problem)}
    row |= {"is_noise": fit.is_noise, "mean_square": fit.mean_square, "chance": fit.chance}
    if is_right:
        off = np.array([(x.value - truth[x.key]) / x.deviation for x in fit.parameters])
        held, far = int(np.sum(np.abs(off) < 1.96)), float(np.max(np.abs(off)))
        return row | {"values": off.size, "held": held, "farthest": far}
    try:
        judged = validate(fit.scene, noisy, realisations=16)
        of_clean = validate(fit.scene, clean, realisations=16)
    except hc.HertzchainError as problem:
        return row | {"failure": str(problem)}
    # The uncertainty of fitted values is left out: more cases count as different.
    both = judged.compared.merge(of_clean.compared[["name", "error"]], on="name")
    without_input = np.hypot(both["u_numerical"], both["u_measured"])
    ratios: list[float] = (both["error_y"].abs() / without_input).tolist()
    return row | {
        "fails": judged.verdict == "fail",
        "differs": max(ratios, default=np.inf),
    }


def changed(scene: hc.Scene, kind: str, random: np.random.Generator) -> tuple[hc.Scene, float]:
    """Return a scene that has what the model lacks, and its drag [1/s]."""
    chain, size = scene.chain, 10 ** random.uniform(-1.5, 0.0)
    if kind == "dashpot":
        coefficient = 0.2 * size * chain.granule_mass / scene.contact_time
        return replace(scene, contact=hc.Contact("dashpot", coefficient=coefficient)), 0.0
    if kind == "viscoelastic":
        time = 0.2 * size * scene.contact_time
        return replace(scene, contact=hc.Contact("viscoelastic", relaxation_time=time)), 0.0
    if kind == "drag":
        scene = replace(scene, contact=None)
        return scene, size / scene.end_time
    at = int(random.integers(1, chain.granules))
    columns: dict[str, list[float]] = {name: [x] * chain.granules for name, x in STEEL.items()}
    columns["young_modulus"] = [float(np.max(chain.young_modulus))] * chain.granules
    gap = [0.0] * chain.granules
    if kind == "gap":
        gap[at - 1] = 5e-6 * size
    else:
        columns["density"][at] *= 1 - 0.7 * size
        columns["young_modulus"][at] *= 1 - 0.7 * size
    return replace(scene, chain=hc.Chain(chain.granules, **columns, gap=gap)), 0.0


def measure(quick: bool, _: bool) -> pandas.DataFrame:
    """Return a row for each experiment, empty where a column does not apply."""
    right, wrong = (24, 10) if quick else (160, 200)
    cases = [("right", seed) for seed in range(right)]
    cases += [(WRONG[seed % len(WRONG)], seed) for seed in range(wrong)]
    each = [experiment(*case) for case in progress(cases, "experiments")]
    return pandas.DataFrame(each, columns=COLUMNS)


def promises(table: pandas.DataFrame) -> list[Row]:
    """The shares of experiments with the expected result."""
    is_noise = (table["mean_square"] <= MOST_MEAN_SQUARE) & (table["chance"] >= LEAST_CHANCE)
    right, wrong = table[table["kind"] == "right"], table[table["kind"] != "right"]
    fitted = right[is_noise]
    clear = wrong[(wrong["differs"] > 3) | wrong["failure"].notna()]
    detected = ~is_noise[clear.index] | clear["fails"].eq(other=True)
    held, values = fitted["held"].sum(), fitted["values"].sum()
    off = 3 * np.sqrt(0.95 * 0.05 / len(right))
    far = (fitted["farthest"] > FAR).mean()
    return [
        row(f"95 % intervals that hold the truth, of {values:.0f}", "native", held / values, 0.95,
            off, _CORRELATED),
        row(f"another minimum, unnoticed, of {len(right)}", "native", far, 0.0, 0.01, _CHOSEN),
        row(f"wrong models above 3 u_val that fit or judge detects, of {len(clear)}", "native",
            detected.mean(), 1.0, 0.1, _CHOSEN),
    ]  # fmt: skip


_CORRELATED = (
    "three binomial deviations; the values of one experiment are correlated and count once"
)
_CHOSEN = "chosen"

SCRIPTS = {
    "experiments": Script(
        "Synthetic experiments",
        "Do intervals of fits hold the truth, and are wrong models detected?",
        measure,
        promises,
    )
}
