"""Speed of this source tree compared with that of another commit, at the same time.

`make bench-before` compares with the commit before, `make bench-before REVISION=v0.1.0` with any
other. The other commit is checked out into a temporary folder. Both trees run the same workloads in
processes of their own, which take turns of milliseconds, so that both meet the same load. A turn
gives a ratio of processor times, which do not count waiting for a busy core. The median of all
turns counts, from several pairs of processes: with the same code one process is often 5 % faster
than another. A workload is slower only if it was slower in each of three measurements.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NoReturn

from rich.table import Table

from hertzchain.errors import HertzchainError, RunFailed
from validation.bench_worker import WORKLOADS
from validation.rows import output, progress
from validation.script import say

ROOT = Path(__file__).resolve().parent.parent

WORKER = Path(__file__).parent / "bench_worker.py"

LIMIT = 1.15
"""Largest allowed ratio of new to old time, chosen."""

PAIRS = (4, 5, 6)
"""Pairs of processes in the first measurement, and in two that repeat slower workloads; chosen."""

TURNS = 20
"""Turns of a pair of processes, chosen. Ratios of equal trees on busy cores, measured: 0.94 to 1.05
with 4 pairs, 0.88 to 1.27 with one."""


@dataclass(frozen=True)
class Compared:
    """Processor times of a workload in the other commit and in this tree [s], medians of turns."""

    old: float
    new: float
    ratio: float  # median of new over old

    @classmethod
    def of(cls, turns: Sequence[tuple[float, float]]) -> Compared:
        """Compare the old and new times of turns."""
        old, new = zip(*turns, strict=True)
        ratio = median(after / before for before, after in turns)
        return cls(median(old), median(new), ratio)


Measure = Callable[[Sequence[str], int], Mapping[str, Compared]]
"""Measures workloads, by their names, in attempt 0, 1 or 2."""


def judge(measure: Measure, names: Sequence[str], limit: float = LIMIT) -> dict[str, Compared]:
    """Measure workloads, and those above the limit again; return the lowest ratio of each.

    A workload is slower if that is above the limit: then each of its measurements was.
    """
    lowest: dict[str, Compared] = {}
    suspects = list(names)
    for attempt in range(len(PAIRS)):
        for name, compared in measure(suspects, attempt).items():
            before = lowest.get(name, compared)
            lowest[name] = min(before, compared, key=lambda each: each.ratio)
        suspects = slower(lowest, limit)
        if not suspects:
            break
    return lowest


def slower(compared: Mapping[str, Compared], limit: float = LIMIT) -> list[str]:
    """Names of the workloads whose ratio is above the limit."""
    return [name for name, each in compared.items() if not each.ratio <= limit]


def by_turns(spend: Sequence[Callable[[], float]], turns: int) -> list[tuple[float, float]]:
    """Return old and new times of turns; which of both goes first alternates."""
    times = []
    for turn in range(turns):
        spent = {k: spend[k]() for k in ((1, 0) if turn % 2 else (0, 1))}
        times.append((spent[1], spent[0]))
    return times


# Another commit


def git(*arguments: str) -> str:
    """Return what git prints; RunFailed with its last line if it fails."""
    command = ["git", "-C", str(ROOT), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    except OSError as problem:
        raise RunFailed(f"git: {problem.strerror}; install git to compare commits") from None
    if done.returncode != 0:
        raise RunFailed(f"git {arguments[0]}: {done.stderr.strip().rpartition(chr(10))[2]}")
    return done.stdout.strip()


def find_commit(revision: str) -> None:
    """Look for a commit; RunFailed where git, the clone or the commit is missing."""
    if Path(git("rev-parse", "--show-toplevel")).resolve() != ROOT:
        raise RunFailed(f"{ROOT} is not a git clone: there is no commit to compare with")
    try:
        git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    except RunFailed:
        missing = f"{revision} is not a commit of this clone: name another with --revision"
        raise RunFailed(missing) from None


def is_same(revision: str) -> bool:
    """Return whether the package of a commit is that of the working tree."""
    changed = git("diff", "--name-only", revision, "--", "hertzchain")
    new = git("ls-files", "--others", "--exclude-standard", "--", "hertzchain")
    return not changed and not new


@contextlib.contextmanager
def checked_out(revision: str) -> Iterator[Path]:
    """Check out a commit into a temporary folder, which is removed at the end."""
    with tempfile.TemporaryDirectory(prefix="hertzchain-", ignore_cleanup_errors=True) as folder:
        tree = Path(folder).resolve() / "tree"
        try:
            git("worktree", "add", "--detach", "--quiet", str(tree), revision)
            yield tree
        finally:
            # Twice --force: git locks a worktree until it is complete.
            with contextlib.suppress(RunFailed):  # it does not exist if it could not be added
                git("worktree", "remove", "--force", "--force", str(tree))


# Two trees


class Worker:
    """A process that runs the workloads of one tree when asked."""

    def __init__(self, tree: Path) -> None:
        self.tree = tree
        # In a session of its own: Ctrl-C ends this process, which then ends the worker.
        self._process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-P", str(WORKER)],
            env={**os.environ, "PYTHONPATH": str(tree)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def ask(self, request: str, *names: str) -> None:
        """Send a request about workloads."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # the missing answer shows this
            self._process.stdin.write(json.dumps([request, *names]) + "\n")
            self._process.stdin.flush()

    def answer(self) -> Any:
        """Return the answer to the request; RunFailed if the worker has ended."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RunFailed(f"the worker of {self.tree} ended with status {self._process.wait()}")
        return json.loads(line)

    def turn(self, name: str) -> float:
        """Return the processor time of a workload in one turn [s]."""
        self.ask("turn", name)
        return float(self.answer())

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()


@contextlib.contextmanager
def workers(trees: Sequence[Path]) -> Iterator[list[Worker]]:
    """Start a worker for each tree, and end them."""
    started: list[Worker] = []
    try:
        for tree in trees:
            started.append(Worker(tree))
            started[-1].ask("package")
        for worker in started:
            loaded = Path(worker.answer())
            if not loaded.is_relative_to(worker.tree):
                raise RunFailed(f"{worker.tree} has no package hertzchain that can be imported")
        yield started
    finally:
        for worker in started:
            worker.end()


def prepared(both: Sequence[Worker], names: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Run workloads once in both workers; return those that both run, and why others are left out.

    RunFailed if one does not run in the first worker, that of this tree.
    """
    for worker in both:
        worker.ask("prepare", *names)
    new, old = (worker.answer() for worker in both)
    for name, problem in new.items():
        if problem is not None:
            raise RunFailed(f"{name} does not run: {problem}")
    left_out = {name: str(problem) for name, problem in old.items() if problem is not None}
    return [name for name in new if name not in left_out], left_out


def measured(trees: Sequence[Path], names: Sequence[str], attempt: int) -> dict[str, Compared]:
    """Measure workloads in two trees, this one first, by turns."""
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for _ in progress(range(PAIRS[attempt]), "measuring"):
        with workers(trees) as both:
            prepared(both, names)
            for name in names:
                times[name] += by_turns([partial(worker.turn, name) for worker in both], TURNS)
    return {name: Compared.of(turns) for name, turns in times.items()}


def compare(tree: Path, limit: float) -> tuple[dict[str, Compared], dict[str, str]]:
    """Measure this tree against another one; return times, and why workloads are left out."""
    trees = (ROOT, tree)
    with workers(trees) as both:
        names, left_out = prepared(both, list(WORKLOADS))
    return judge(lambda some, attempt: measured(trees, some, attempt), names, limit), left_out


def to_table(compared: Mapping[str, Compared], revision: str) -> Table:
    """Return times as a table."""
    table = Table("workload", title=f"This tree (new) and {revision} (old), processor times")
    for column in ("old [ms]", "new [ms]", "new / old"):
        table.add_column(column, justify="right")
    for name, each in compared.items():
        table.add_row(name, f"{each.old * 1e3:.3g}", f"{each.new * 1e3:.3g}", f"{each.ratio:.2f}")
    return table


def run(arguments: Sequence[str]) -> int:
    """Compare and print; return the exit status: 1 where a workload is slower, 2 for a failure."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--revision", default="HEAD~1", help="the other commit (default: HEAD~1)")
    parser.add_argument("--limit", type=float, default=LIMIT, help="largest allowed ratio of times")
    chosen = parser.parse_args(arguments)
    try:
        find_commit(chosen.revision)
    except RunFailed as problem:
        status = say(problem)
        return 0 if "CI" in os.environ else status  # clones of CI may have one commit alone
    try:
        if is_same(chosen.revision):
            print(f"hertzchain/ is the same in {chosen.revision}: nothing to measure")
            return 0
        print("measuring, about two minutes", file=sys.stderr, flush=True)
        with checked_out(chosen.revision) as tree:
            compared, left_out = compare(tree, chosen.limit)
    except HertzchainError as problem:
        return say(problem)
    output().print(to_table(compared, chosen.revision))
    print("new / old: the median of the ratios of paired turns, not the quotient of both medians")
    for workload, why in left_out.items():
        print(f"left out, as {chosen.revision} does not run it: {workload} ({why})")
    slow = slower(compared, chosen.limit)
    if slow:
        times = "; ".join(f"{workload}: {compared[workload].ratio:.2f} times" for workload in slow)
        print(f"slower than {chosen.revision}: {times}", file=sys.stderr)
        return 1
    limit = f"{chosen.limit:g} times slower than {chosen.revision}"
    print(f"no workload is more than {limit}")
    return 0


def _end(number: int, _frame: object) -> NoReturn:
    sys.exit(128 + number)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, _end)  # the temporary folder is removed, as at Ctrl-C
    sys.exit(run(sys.argv[1:]))
