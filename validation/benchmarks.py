"""The cost of accuracy, as ratios measured in one run: `make bench`, on an idle machine.

Each figure compares two ways of getting the same digits, warm, one after the other. Nothing here
fails because a machine is slow; what has to hold on every machine is in tests/. A whole run writes
its table and plot to validation/results.
"""

from __future__ import annotations

import itertools
import os
import platform
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps import deck
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.engines.native.plan import cheapest as plan
from hertzchain.engines.native.simulation import simulate
from hertzchain.files import write_text
from hertzchain.observables.peaks import largest_difference
from hertzchain.verdict.contenders import contenders
from hertzchain.verdict.tradeoff import provenance
from validation.drawing import BACKENDS, new_figure
from validation.script import dated, facts_of, write_figure
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


FIGURES: list[Measured] = []


def machine() -> str:
    """The processor and how many of its cores are here; not whose they are."""
    name = platform.machine()
    facts = Path("/proc/cpuinfo")
    if facts.exists():
        lines = facts.read_text(encoding="utf-8").splitlines()
        models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        name = models[0] if models else name
    return f"{name}, {os.cpu_count()} cores"


@pytest.fixture(scope="module", autouse=True)
def _summary(request: pytest.FixtureRequest, pytestconfig: pytest.Config) -> Iterator[None]:
    """Print the figures when all are measured; keep those of a whole run."""
    yield
    with pytestconfig.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
        print("\n")
        for one in FIGURES:
            print(f"{one.group:3}{one.figure:60}{one.value:>12,.4g} {one.unit}")
    if not request.session.testsfailed and not pytestconfig.getoption("keyword"):
        keep(RESULTS)


def keep(folder: Path) -> None:
    """Write bench.csv, with the machine in its first line, and bench.svg."""
    names = [field.name for field in fields(Measured)]
    table = pandas.DataFrame([astuple(one) for one in FIGURES], columns=names)
    csv = table.to_csv(index=False, float_format="%.4g", lineterminator="\n")
    write_text(folder / "bench.csv", dated(f"{machine()}; {facts_of(provenance())}", csv))
    figure = new_figure(9.0, 3.6)
    demo, terms = figure.subplots(1, 2)
    times = [one for one in FIGURES if one.group in "AB" and one.unit == "ms"]
    for one in times:
        style = BACKENDS.get(one.figure.split(",")[0].lower(), {"marker": "^", "color": "#D55E00"})
        demo.plot([one.value], [one.figure], **{**style, "label": None})
    demo.set_title("Peaks of the demo scene to 1e-6", fontsize="medium")
    names = [name.replace("_", " ") for name in TERMS]
    for code, wanted in (("native", "1e-6"), ("LAMMPS", "1e-4"), ("LIGGGHTS", "1e-4")):
        spent = [one.value for one in FIGURES if one.group == "K" and f": {code} " in one.figure]
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


@pytest.fixture(scope="module")
def demo() -> hc.Scene:
    """The demo scene."""
    return load("demo")


@pytest.fixture(scope="module")
def truth(demo: hc.Scene) -> FloatArray:
    """The peaks of the demo scene [N]."""
    return hc.Native("reference").run(demo).peak_force


def native(scene: hc.Scene) -> hc.Result:
    """Compute peaks to 1e-6, with the second run for their error."""
    return hc.Native(rtol=1e-6, peaks_only=True).run(scene)


def best(work: Callable[[], object], repeats: int) -> float:
    """Return the shortest of several times, after a first run that does not count [s]."""
    work()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def seconds(benchmark: Any) -> float:
    """The shortest time that pytest-benchmark found."""
    return float(benchmark.stats.stats.min)


def plain_deck(scene: hc.Scene, dt: float) -> None:
    """Run the lean deck from start to end, without watching peaks."""
    with engine() as lammps:
        command(lammps, deck.set_up(scene))
        before = None
        for leg in scene.schedule(dt):
            lines = [*deck.leg_commands(scene, leg, before), f"run {leg.steps} post no"]
            command(lammps, "\n".join(lines))
            before = leg


def test_a_lammps_over_native(benchmark: Any, demo: hc.Scene, truth: FloatArray) -> None:
    result = benchmark(native, demo)
    ours = seconds(benchmark)
    assert largest_difference(result.peak_force, truth) < 1e-6
    chosen = plan(1e-6)
    legs = demo.schedule(chosen.step * demo.units.time)
    once = best(lambda: simulate(demo, legs, chosen.walker, leave_behind=True), 50)
    dt = hc.Lammps(rtol=1e-6).run(demo).dt
    lammps = best(lambda: plain_deck(demo, dt), 3)
    finer = hc.Lammps(rtol=1e-6, extrapolated=True).run(demo).dt
    extrapolated = best(lambda: plain_deck(demo, finer), 3)
    extrapolated += best(lambda: plain_deck(demo, 2 * finer), 3)
    FIGURES.extend([
        Measured("A", "native, with error", ours * 1e3, "ms"),
        Measured("A", "native, one plain run", once * 1e3, "ms"),
        Measured("A", "LAMMPS, one plain run", lammps * 1e3, "ms"),
        Measured("A", "LAMMPS, two runs to extrapolate", extrapolated * 1e3, "ms"),
        Measured("A", "plain LAMMPS over native with error", lammps / ours),
        Measured("A", "plain LAMMPS over one native run", lammps / once),
        Measured("A", "extrapolated LAMMPS over native with error", extrapolated / ours),
        Measured("A", "extrapolated LAMMPS over one native run", extrapolated / once),
    ])  # fmt: skip


def test_b_scipy_over_native(benchmark: Any, demo: hc.Scene) -> None:
    reference = hc.Native("reference").run(demo)
    scipy = next(one for one in contenders(demo) if one.engine == "SciPy")
    benchmark(native, demo)
    for rtol in scipy.rtols:
        if largest_difference(scipy.run(demo, rtol).peak_force, reference.peak_force) < 1e-6:
            break
    spent = best(lambda: scipy.run(demo, rtol), 3)
    FIGURES.append(Measured("B", f"SciPy's DOP853 (rtol {rtol:g})", spent * 1e3, "ms"))
    FIGURES.append(Measured("B", "DOP853 over native with error", spent / seconds(benchmark)))


@pytest.mark.parametrize("granules", [1_000, 10_000, 100_000, 1_000_000])
def test_c_long_chain(benchmark: Any, demo: hc.Scene, granules: int) -> None:
    pulse = hc.Pulse("cosine", 100.0, 6.0, momentum_ratio=0.5)
    scene = hc.Scene(replace(demo.chain, granules=granules), pulse)
    native(scene)
    result = benchmark.pedantic(native, (scene,), rounds=1)
    assert result.error_estimate <= 1e-6
    FIGURES.append(Measured("C", f"{granules:,} granules", seconds(benchmark), "s"))
    if granules == 1_000_000:
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        FIGURES.append(Measured("C", "memory of the process so far", memory, "MB"))


def random_pulses(number: int) -> tuple[FloatArray, FloatArray]:
    """LM_ratio from 0.1 to 10 and n from 1.5 to 20, even over decades."""
    rng = np.random.default_rng(2026)
    ratio = np.exp(rng.uniform(np.log(0.1), np.log(10.0), number))
    return ratio, np.exp(rng.uniform(np.log(1.5), np.log(20.0), number))


def test_d_many_scenes(benchmark: Any) -> None:
    ratio, n = random_pulses(10_000)
    batch = benchmark.pedantic(
        hc.similar_peak_forces, ("cosine", ratio, n, 60, 1e-4), rounds=5, warmup_rounds=1
    )
    true = hc.similar_peak_forces("cosine", ratio[:500], n[:500], 60, 1e-9)
    pairs = zip(batch.peak_force[:500], true.peak_force, strict=True)
    error = max(largest_difference(*pair) for pair in pairs)
    assert error < 1e-4
    rate = ratio.size / seconds(benchmark)
    what = f"scenes of 60 granules in a batch, peaks to {error:.0e}"
    FIGURES.append(Measured("D", what, rate, "1/s"))


def test_g_first_call_of_a_process(benchmark: Any) -> None:
    binary = Path(sys.executable).parent / "hertzchain"
    scene = str(HERE / "scenes" / "demo.toml")

    def process(*arguments: str) -> None:
        subprocess.run(arguments, check=True, capture_output=True)

    run = best(lambda: process(str(binary), "run", scene, "--rtol", "1e-6"), 7)
    helped = best(lambda: process(str(binary), "--help"), 7)
    benchmark.pedantic(process, (sys.executable, "-c", "import numpy"), rounds=7, warmup_rounds=1)
    base = seconds(benchmark)
    FIGURES.append(Measured("G", "hertzchain run, more than importing NumPy", run - base, "s"))
    FIGURES.append(Measured("G", "hertzchain --help, more than that", helped - base, "s"))


def test_j_sweep_over_bare_batch(benchmark: Any, demo: hc.Scene, tmp_path: Path) -> None:
    vary = {
        "shock.momentum_ratio": "0.1:10:log",
        "shock.duration_ratio": "1.5:6",
        "chain.young_modulus": "50 GPa:200 GPa",
    }
    folders = (tmp_path / f"out{k}" for k in itertools.count())

    def sweep() -> hc.Sweep:
        return hc.sweep(demo, vary, samples=100_000, rtol=1e-4, output=next(folders))

    table = sweep().to_frame(["shock.momentum_ratio", "shock.duration_ratio"])
    ratio, n = table["shock.momentum_ratio"].array, table["shock.duration_ratio"].array

    def bare() -> hc.Batch:
        return hc.similar_peak_forces("cosine-triangular", ratio, n, 60, rtol=1e-4)

    bare()
    ratios = []
    for _ in range(5):
        begin = time.perf_counter()
        sweep()
        between = time.perf_counter()
        bare()
        ratios.append((between - begin) / (time.perf_counter() - between))
    benchmark.pedantic(sweep, rounds=1)
    what = "a sweep of 100,000 scenes over their bare batch"
    FIGURES.append(Measured("J", what, float(np.median(ratios))))


@pytest.mark.parametrize("name", TERMS)
def test_k_terms(benchmark: Any, name: str) -> None:
    scene = load(f"terms/{name}")
    benchmark(native, scene)
    FIGURES.append(
        Measured("K", f"{name}: native to 1e-6, with error", seconds(benchmark) * 1e3, "ms")
    )
    backend = hc.Lammps(rtol=1e-4)
    spent = best(lambda: backend.run(scene), 3)
    FIGURES.append(Measured("K", f"{name}: LAMMPS to 1e-4, with error", spent * 1e3, "ms"))
    if shutil.which("liggghts"):
        begin = time.perf_counter()
        hc.Liggghts(rtol=1e-4).run(scene)  # fresh processes: nothing is warm in a second run
        spent = time.perf_counter() - begin
        FIGURES.append(Measured("K", f"{name}: LIGGGHTS to 1e-4, with error", spent * 1e3, "ms"))


if __name__ == "__main__":
    sys.exit(pytest.main([__file__, "-n", "0", "-p", "no:cacheprovider", *sys.argv[1:]]))
