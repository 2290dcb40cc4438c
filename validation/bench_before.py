"""Speed of this source tree compared with that of another commit, at the same time.

`make bench-before` compares with the commit before, `make bench-before REVISION=v0.1.0` with any
other. The other commit is checked out into a temporary folder. Both trees run the same workloads by
turns, in processes of their own. A turn gives a ratio of processor times, which do not count
waiting for a busy core, and the median of all turns counts.
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
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple, NoReturn

from rich.table import Table

from hertzchain.errors import HertzchainError, RunFailed
from validation.script import output, progress, say

ROOT = Path(__file__).resolve().parent.parent

LIMIT = 1.15
"""Largest allowed ratio of new to old time, chosen."""

TURNS = 7
"""Pairs of processes (chosen): with the same code one process is often 5 % faster than another."""

Times = Mapping[str, float | str]
"""Processor time of each workload [s], or why it does not run."""


class Compared(NamedTuple):
    """Processor times of a workload in the other commit and in this tree [s], medians of turns."""

    old: float
    new: float
    ratio: float  # median of new over old


def compared(turns: Sequence[tuple[Times, Times]]) -> tuple[dict[str, Compared], dict[str, str]]:
    """Compare old and new times of turns; return why other workloads are left out, too.

    RunFailed if one does not run in this tree.
    """
    each: dict[str, Compared] = {}
    left_out: dict[str, str] = {}
    for name, new in turns[0][1].items():
        before, after = ([turn[k].get(name, "missing") for turn in turns] for k in (0, 1))
        if isinstance(new, str):
            raise RunFailed(f"{name} does not run: {new}")
        if isinstance(before[0], str):
            left_out[name] = before[0]
            continue
        old_times, new_times = map(float, before), map(float, after)
        pairs = list(zip(old_times, new_times, strict=True))
        old, now = (median(times) for times in zip(*pairs, strict=True))
        each[name] = Compared(old, now, median(last / first for first, last in pairs))
    return each, left_out


def slower(compared: Mapping[str, Compared], limit: float = LIMIT) -> list[str]:
    """Names of the workloads whose ratio is above the limit."""
    return [name for name, each in compared.items() if not each.ratio <= limit]


def times_of(tree: Path) -> Times:
    """Run the workloads of a tree in a process; RunFailed where that is impossible."""
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-P", str(Path(__file__).parent / "bench_worker.py")],
        env={**os.environ, "PYTHONPATH": str(tree)},
        stdout=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        raise RunFailed(f"the workloads of {tree} ended with status {done.returncode}")
    measured = json.loads(done.stdout)
    if not Path(measured["package"]).is_relative_to(tree):
        raise RunFailed(f"{tree} has no package hertzchain that can be imported")
    times: Times = measured["times"]
    return times


def measure(tree: Path) -> list[tuple[Times, Times]]:
    """Return old and new times of turns; which of both goes first alternates."""
    turns = []
    for turn in progress(range(TURNS), "measuring"):
        trees = (tree, ROOT) if turn % 2 else (ROOT, tree)
        times = {each: times_of(each) for each in trees}
        turns.append((times[tree], times[ROOT]))
    return turns


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
            each, left_out = compared(measure(tree))
    except HertzchainError as problem:
        return say(problem)
    output().print(to_table(each, chosen.revision))
    print("new / old: the median of the ratios of paired turns, not the quotient of both medians")
    for workload, why in left_out.items():
        print(f"left out, as {chosen.revision} does not run it: {workload} ({why})")
    slow = slower(each, chosen.limit)
    if slow:
        times = "; ".join(f"{workload}: {each[workload].ratio:.2f} times" for workload in slow)
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
