"""Speed of this source tree compared with that of another commit, at the same time.

`make bench-before` compares with the commit before, `make bench-before REVISION=v0.1.0` with any
other. The other commit is checked out into a temporary folder. Both trees run the same workloads by
turns, in processes of their own: this file with ``--worker``, which calls only what has long been
public. A turn gives a ratio of processor times, which do not count waiting for a busy core, and the
median of all turns counts.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np

import hertzchain as hc

ROOT = Path(__file__).resolve().parent.parent
SCENES = ROOT / "validation" / "scenes"

LIMIT = 1.15
"""Largest allowed ratio of new to old time, chosen."""

TURNS = 7
"""Pairs of processes (chosen): with the same code one process is often 5 % faster than another."""

Times = dict[str, float | str]
"""Processor time of each workload [s], or why it does not run."""

Work = Callable[[], object]


# One tree


def peaks(name: str, rtol: float, alone: bool = True) -> Work:
    """Return a function that computes a shipped scene, or its peaks ``alone``, with their error."""
    scene, backend = hc.Scene.from_toml(SCENES / name), hc.Native(rtol=rtol, peaks_only=alone)
    return lambda: backend.run(scene)


def whole_run() -> Work:
    """Return a function that runs the demo scene with balances and 600 recorded states."""
    scene, backend = hc.Scene.from_toml(SCENES / "demo.toml"), hc.Native(rtol=1e-6)
    times = np.linspace(0.0, 0.99 * scene.end_time, 600)
    return lambda: backend.run(scene, record=times)


def batch() -> Work:
    """Return a function that computes 300 scenes of 60 granules on one core."""
    rng = np.random.default_rng(2026)
    ratio = np.exp(rng.uniform(np.log(0.1), np.log(10.0), 300))
    n = np.exp(rng.uniform(np.log(1.5), np.log(20.0), 300))
    return lambda: hc.similar_peak_forces("cosine", ratio, n, 60, 1e-4, cores=1)


def long_chain() -> Work:
    """Return a function that computes the peaks of 20,000 granules behind a weak pulse."""
    chain = replace(hc.Scene.from_toml(SCENES / "demo.toml").chain, granules=20_000)
    scene = hc.Scene(chain, hc.Pulse("cosine", 100.0, 6.0, momentum_ratio=0.5))
    backend = hc.Native(rtol=1e-6, peaks_only=True)
    return lambda: backend.run(scene)


WORKLOADS: dict[str, Callable[[], Work]] = {
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


def spent(prepare: Callable[[], Work]) -> float | str:
    """Return the shortest processor time of a workload [s], or why it does not run."""
    try:
        work = prepare()
        work()  # compiles
    except Exception as problem:  # an older commit may fail in any way
        return f"{type(problem).__name__}: {problem}"
    times: list[float] = []
    end = time.perf_counter() + 0.25
    while not times or time.perf_counter() < end:
        before = time.process_time()
        work()
        times.append(time.process_time() - before)
    return min(times)


# Two trees


def times_of(tree: Path) -> Times:
    """Run the workloads of a tree in a process."""
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-P", __file__, "--worker"],
        env={**os.environ, "PYTHONPATH": str(tree)}, stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    package, times = json.loads(done.stdout)
    if not Path(package).is_relative_to(tree):
        raise RuntimeError(f"{tree} has no package hertzchain that can be imported")
    return dict(times)


def git(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run git on this clone."""
    command = ["git", "-C", str(ROOT), *arguments]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    except OSError as problem:  # git is not installed
        return subprocess.CompletedProcess(command, 1, "", str(problem))


@contextlib.contextmanager
def checked_out(revision: str) -> Iterator[Path]:
    """Check out a commit into a temporary folder, which is removed at the end."""
    with tempfile.TemporaryDirectory(prefix="hertzchain-", ignore_cleanup_errors=True) as folder:
        tree = Path(folder).resolve() / "tree"
        try:
            done = git("worktree", "add", "--detach", "--quiet", str(tree), revision)
            if done.returncode != 0:
                raise RuntimeError(done.stderr.strip())
            yield tree
        finally:
            # Twice --force: git locks a worktree until it is complete.
            git("worktree", "remove", "--force", "--force", str(tree))


def judge(turns: Sequence[tuple[Times, Times]], limit: float) -> list[str]:
    """Print old and new times and the median of their ratios; return workloads that are slower.

    A workload that the other commit does not run is left out.
    """
    print(f"{'workload':36}{'old [ms]':>10}{'new [ms]':>10}{'new / old':>11}")
    slower = []
    for name in WORKLOADS:
        old, new = zip(*((before[name], after[name]) for before, after in turns), strict=True)
        if isinstance(new[0], str):
            raise RuntimeError(f"{name} does not run: {new[0]}")  # noqa: TRY004 - it is a message
        if isinstance(old[0], str):
            print(f"{name:36}left out: {old[0]}")
            continue
        ratio = median(after / before for before, after in zip(old, new, strict=True))
        print(f"{name:36}{median(old) * 1e3:10.3g}{median(new) * 1e3:10.3g}{ratio:11.2f}")
        if not ratio <= limit:
            slower.append(f"{name}: {ratio:.2f} times")
    print("new / old: the median of the ratios of paired turns, not the quotient of both medians")
    return slower


def run(arguments: Sequence[str]) -> int:
    """Compare and print; return the exit status: 1 where a workload is slower."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--revision", default="HEAD~1", help="the other commit (default: HEAD~1)")
    parser.add_argument("--limit", type=float, default=LIMIT, help="largest allowed ratio of times")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.worker:
        print(json.dumps([hc.__file__, {name: spent(work) for name, work in WORKLOADS.items()}]))
        return 0
    if git("rev-parse", "--verify", "--quiet", f"{chosen.revision}^{{commit}}").returncode != 0:
        print(f"{chosen.revision} is not a commit of a git clone in {ROOT}", file=sys.stderr)
        return 0 if "CI" in os.environ else 2  # clones of CI may have one commit alone
    print("measuring, about two minutes", file=sys.stderr, flush=True)
    with checked_out(chosen.revision) as tree:
        turns = []
        for turn in range(TURNS):  # which of both goes first alternates
            times = {each: times_of(each) for each in ((tree, ROOT) if turn % 2 else (ROOT, tree))}
            turns.append((times[tree], times[ROOT]))
    slower = judge(turns, chosen.limit)
    if slower:
        print(f"slower than {chosen.revision}: {'; '.join(slower)}", file=sys.stderr)
        return 1
    print(f"no workload is more than {chosen.limit:g} times slower than {chosen.revision}")
    return 0


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
