"""The cost of accuracy, as ratios measured in one run: `make bench`, on an idle machine.

Each figure compares two ways of getting the same digits, warm, one after the other. Nothing here
fails because a machine is slow; checks that must pass on every machine are in tests/. A whole run
writes its table and plot to validation/results.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path

import numpy as np
import pandas

import hertzchain as hc
from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.engines.native.plan import cheapest as plan
from hertzchain.engines.native.simulation import simulate
from hertzchain.files import write_text
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.tradeoff import contenders, provenance
from validation.script import BACKENDS, dated, facts_of, new_figure, write_figure
from validation.shipped import HERE, load

RESULTS = HERE / "results"

TERMS = ("dimer", "precompressed", "striker_on_a_wall", "damped", "piston")
"""Shipped scenes with terms, whose cost is compared with that of LAMMPS."""


@dataclass(frozen=True)
class Measured:
    """A figure, its value and unit; a ratio has no unit."""

    group: str
    figure: str
    value: float
    unit: str = ""


def machine() -> str:
    """The processor and how many of its cores are here; not whose they are."""
    name = platform.machine()
    facts = Path("/proc/cpuinfo")
    if facts.exists():
        lines = facts.read_text(encoding="utf-8").splitlines()
        models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        name = models[0] if models else name
    return f"{name}, {os.cpu_count()} cores"


def keep(folder: Path, measured: Sequence[Measured]) -> None:
    """Write bench.csv, with the machine in its first line, and bench.svg."""
    names = [field.name for field in fields(Measured)]
    table = pandas.DataFrame([astuple(row) for row in measured], columns=names)
    csv = table.to_csv(index=False, float_format="%.4g", lineterminator="\n")
    write_text(folder / "bench.csv", dated(f"{machine()}; {facts_of(provenance())}", csv))
    figure = new_figure(9.0, 3.6)
    demo, terms = figure.subplots(1, 2)
    times = [row for row in measured if row.group in "AB" and row.unit == "ms"]
    for row in times:
        style = BACKENDS.get(row.figure.split(",")[0].lower(), {"marker": "^", "color": "#D55E00"})
        demo.plot([row.value], [row.figure], **{**style, "label": None})
    demo.set_title("Peaks of the demo scene to 1e-6", fontsize="medium")
    names = [name.replace("_", " ") for name in TERMS]
    for code, wanted in (("native", "1e-6"), ("LAMMPS", "1e-4"), ("LIGGGHTS", "1e-4")):
        spent = [row.value for row in measured if row.group == "K" and f": {code} " in row.figure]
        style = BACKENDS.get(code.lower(), {"marker": "D", "color": "#56B4E9", "linestyle": "none"})
        if spent:  # LIGGGHTS need not be here
            terms.plot(spent, names, **{**style, "label": f"{code} to {wanted}"})
    terms.set_title("Scenes with terms, with error", fontsize="medium")
    handles, labels = terms.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower right", ncols=2, fontsize="small")
    for axes in (demo, terms):
        axes.set_xscale("log")
        axes.set_xlabel("time [ms]")
        axes.invert_yaxis()
        axes.grid(alpha=0.3)
    write_figure(folder / "bench.svg", figure)


def native(scene: hc.Scene) -> hc.Result:
    """Compute peaks to 1e-6, with the second run for their error."""
    return hc.Native(rtol=1e-6, peaks_only=True).run(scene)


def seconds(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Return the time of one run [s]."""
    begin = clock()
    work()
    return clock() - begin


def best(
    work: Callable[[], object], repeats: int, clock: Callable[[], float] = time.perf_counter
) -> float:
    """Return the shortest of several times, after a first run that does not count [s]."""
    work()
    return min(seconds(work, clock) for _ in range(repeats))


def plain_deck(scene: hc.Scene, dt: float) -> None:
    """Run the lean deck from start to end, without watching peaks."""
    with engine() as lammps:
        command(lammps, deck.set_up(scene))
        before = None
        for leg in scene.schedule(dt):
            lines = [*deck.leg_commands(scene, leg, before), f"run {leg.steps} post no"]
            command(lammps, "\n".join(lines))
            before = leg


def lammps_over_native() -> Iterator[Measured]:
    """LAMMPS, once or extrapolated, over native runs of the demo scene to 1e-6."""
    demo = load("demo")
    truth = hc.Native("reference").run(demo).peak_force
    assert largest_difference(native(demo).peak_force, truth) < 1e-6
    ours, chosen = best(lambda: native(demo), 500), plan(1e-6)
    legs = demo.schedule(chosen.step * demo.units.time)
    once = best(lambda: simulate(demo, legs, chosen.walker, leave_behind=True), 500)
    dt = hc.Lammps(rtol=1e-6).run(demo).dt
    lammps = best(lambda: plain_deck(demo, dt), 3)
    finer = hc.Lammps(rtol=1e-6, extrapolated=True).run(demo).dt
    extrapolated = best(lambda: plain_deck(demo, finer), 3)
    extrapolated += best(lambda: plain_deck(demo, 2 * finer), 3)
    yield Measured("A", "native, with error", ours * 1e3, "ms")
    yield Measured("A", "native, one plain run", once * 1e3, "ms")
    yield Measured("A", "LAMMPS, one plain run", lammps * 1e3, "ms")
    yield Measured("A", "LAMMPS, two runs to extrapolate", extrapolated * 1e3, "ms")
    yield Measured("A", "plain LAMMPS over native with error", lammps / ours)
    yield Measured("A", "plain LAMMPS over one native run", lammps / once)
    yield Measured("A", "extrapolated LAMMPS over native with error", extrapolated / ours)
    yield Measured("A", "extrapolated LAMMPS over one native run", extrapolated / once)


def scipy_over_native() -> Iterator[Measured]:
    """SciPy's DOP853, with the first tolerance that suffices, over native to 1e-6."""
    demo = load("demo")
    truth = hc.Native("reference").run(demo).peak_force
    scipy = next(contender for contender in contenders(demo) if contender.engine == "SciPy")
    rtol = next(
        rtol
        for rtol in scipy.rtols
        if largest_difference(scipy.run(demo, rtol).peak_force, truth) < 1e-6
    )
    spent = best(lambda: scipy.run(demo, rtol), 3)
    yield Measured("B", f"SciPy's DOP853 (rtol {rtol:g})", spent * 1e3, "ms")
    yield Measured("B", "DOP853 over native with error", spent / best(lambda: native(demo), 500))


def long_chains() -> Iterator[Measured]:
    """A wave down chains of a thousand to a million granules."""
    pulse = hc.Pulse("cosine", 100.0, 6.0, momentum_ratio=0.5)
    for granules in (1_000, 10_000, 100_000, 1_000_000):
        scene = hc.Scene(replace(load("demo").chain, granules=granules), pulse)
        assert native(scene).error_estimate <= 1e-6
        spent = seconds(functools.partial(native, scene))
        yield Measured("C", f"a wave down {granules:,} granules, with error", spent, "s")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    yield Measured("C", "memory of the process after that", memory, "MB")


def batch_over_single_runs() -> Iterator[Measured]:
    """Processor time of a scene of 60 granules in a batch over that of a run of its own."""
    generator, chain = np.random.default_rng(1), load("demo").chain
    ratio, n = 10 ** generator.uniform(-1, 1, 5_000), generator.uniform(1.5, 6.0, 5_000)
    pulses = [
        hc.Pulse("cosine", 100.0, length, momentum_ratio=strength)
        for strength, length in zip(ratio[:500].tolist(), n[:500].tolist(), strict=True)
    ]
    scenes = [hc.Scene(chain, pulse) for pulse in pulses]

    def one_by_one(rtol: float) -> None:
        backend = hc.Native(rtol=rtol, peaks_only=True)
        for scene in scenes:
            backend.run(scene)

    for rtol in (1e-4, 1e-6):
        similar = functools.partial(hc.similar_peak_forces, "cosine", ratio, n, 60, rtol)
        batch, alone = (
            best(work, 1, time.process_time)
            for work in (similar, functools.partial(one_by_one, rtol))
        )
        what = f"a single run over a scene in a batch, peaks to {rtol:.0e}"
        yield Measured("D", what, alone / len(scenes) / (batch / ratio.size))


def fresh_processes() -> Iterator[Measured]:
    """The first call of a process, beyond importing NumPy."""
    binary = str(Path(sys.executable).parent / "hertzchain")
    scene = str(HERE / "scenes" / "demo.toml")

    def spent(*arguments: str) -> float:
        started = functools.partial(subprocess.run, arguments, check=True, capture_output=True)
        return best(started, 7)

    base = spent(sys.executable, "-c", "import numpy")
    run = spent(binary, "run", scene, "--rtol", "1e-6") - base
    yield Measured("G", "hertzchain run, more than importing NumPy", run, "s")
    what = "hertzchain --help, more than importing NumPy"
    yield Measured("G", what, spent(binary, "--help") - base, "s")


def sweep_over_bare_batch() -> Iterator[Measured]:
    """A sweep that is written to disk over its batch."""
    vary = {
        "shock.momentum_ratio": "0.1:10:log",
        "shock.duration_ratio": "1.5:6",
        "chain.young_modulus": "50 GPa:200 GPa",
    }

    with tempfile.TemporaryDirectory() as folder:
        outputs = (Path(folder) / f"out{k}" for k in itertools.count())

        def sweep() -> hc.Sweep:
            return hc.sweep(load("demo"), vary, samples=100_000, rtol=1e-4, output=next(outputs))

        table = sweep().to_frame(["shock.momentum_ratio", "shock.duration_ratio"])
        ratio, n = table["shock.momentum_ratio"].array, table["shock.duration_ratio"].array

        def bare() -> hc.Batch:
            return hc.similar_peak_forces("cosine-triangular", ratio, n, 60, rtol=1e-4)

        bare()
        ratios = [seconds(sweep) / seconds(bare) for _ in range(5)]
    what = "a sweep of 100,000 scenes over their bare batch"
    yield Measured("J", what, float(np.median(ratios)))


def scenes_with_terms() -> Iterator[Measured]:
    """Native, LAMMPS and, where it is here, LIGGGHTS on scenes with terms."""
    native = hc.Native(rtol=1e-6, peaks_only=True)
    codes: dict[str, tuple[hc.Native | hc.Lammps | hc.Liggghts, int]] = {
        "native to 1e-6": (native, 100),
        "native, largest forces alone to 1e-6": (replace(native, wanted="all"), 100),
        "LAMMPS to 1e-4": (hc.Lammps(rtol=1e-4), 3),
    }
    if shutil.which("liggghts"):
        codes["LIGGGHTS to 1e-4"] = (hc.Liggghts(rtol=1e-4), 1)
    for name in TERMS:
        scene = load(f"terms/{name}")
        for code, (backend, repeats) in codes.items():
            spent = best(functools.partial(backend.run, scene), repeats)
            yield Measured("K", f"{name}: {code}, with error", spent * 1e3, "ms")


def main() -> None:
    """Measure, print and keep all figures."""
    argparse.ArgumentParser(description=__doc__.split("\n")[0]).parse_args()
    measured: list[Measured] = []
    for group in (
        lammps_over_native, scipy_over_native, long_chains, batch_over_single_runs,
        fresh_processes, sweep_over_bare_batch, scenes_with_terms,
    ):  # fmt: skip
        for row in group():
            print(f"{row.group:3}{row.figure:60}{row.value:>12,.4g} {row.unit}", flush=True)
            measured.append(row)
    keep(RESULTS, measured)


if __name__ == "__main__":
    main()
