"""Processor times of the workloads of one source tree, as JSON: ``bench_before.py`` runs it.

It runs with the ``hertzchain`` of another commit: it imports nothing else of the project, and calls
only what has long been public.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

import hertzchain as hc

SCENES = Path(__file__).parent / "scenes"


def peaks(name: str, rtol: float, alone: bool = True) -> Callable[[], object]:
    """Return a function that computes a shipped scene, or its peaks ``alone``, with their error."""
    scene, backend = hc.Scene.from_toml(SCENES / name), hc.Native(rtol=rtol, peaks_only=alone)
    return lambda: backend.run(scene)


def whole_run() -> Callable[[], object]:
    """Return a function that runs the demo scene with balances and 600 recorded states."""
    scene = hc.Scene.from_toml(SCENES / "demo.toml")
    backend, end = hc.Native(rtol=1e-6), scene.end_time
    times = np.linspace(0.0, 0.99 * end, 600)
    return lambda: backend.run(scene, record=times)


def batch() -> Callable[[], object]:
    """Return a function that computes 300 scenes of 60 granules on one core."""
    rng = np.random.default_rng(2026)
    ratio = np.exp(rng.uniform(np.log(0.1), np.log(10.0), 300))
    n = np.exp(rng.uniform(np.log(1.5), np.log(20.0), 300))
    return lambda: hc.similar_peak_forces("cosine", ratio, n, 60, 1e-4, cores=1)


def long_chain() -> Callable[[], object]:
    """Return a function that computes the peaks of 20,000 granules behind a weak pulse."""
    chain = replace(hc.Scene.from_toml(SCENES / "demo.toml").chain, granules=20_000)
    scene = hc.Scene(chain, hc.Pulse("cosine", 100.0, 6.0, momentum_ratio=0.5))
    backend = hc.Native(rtol=1e-6, peaks_only=True)
    return lambda: backend.run(scene)


WORKLOADS: dict[str, Callable[[], Callable[[], object]]] = {
    "demo, peaks to 1e-6": lambda: peaks("demo.toml", 1e-6),
    "demo, peaks to 1e-9": lambda: peaks("demo.toml", 1e-9),
    "demo, whole run with states": whole_run,
    "300 scenes of 60 granules to 1e-4": batch,
    "20,000 granules to 1e-6": long_chain,
    "long_chain, whole run to 1e-6": lambda: peaks("long_chain.toml", 1e-6, alone=False),
    "dimer to 1e-6": lambda: peaks("terms/dimer.toml", 1e-6),
    "precompressed to 1e-6": lambda: peaks("terms/precompressed.toml", 1e-6),
    "striker_on_a_wall to 1e-6": lambda: peaks("terms/striker_on_a_wall.toml", 1e-6),
    "damped to 1e-6": lambda: peaks("terms/damped.toml", 1e-6),
}
"""Functions that prepare a workload, by its name."""


def measured(prepare: Callable[[], Callable[[], object]]) -> float | str:
    """Return the shortest processor time of a workload [s], or why it does not run."""
    try:
        work = prepare()
        work()  # compiles
    except Exception as problem:  # an older commit may fail in any way
        return f"{type(problem).__name__}: {problem}"
    spent: list[float] = []
    end = time.perf_counter() + 0.25
    while not spent or time.perf_counter() < end:
        before = time.process_time()
        work()
        spent.append(time.process_time() - before)
    return min(spent)


if __name__ == "__main__":
    times = {name: measured(prepare) for name, prepare in WORKLOADS.items()}
    print(json.dumps({"package": hc.__file__, "times": times}))
