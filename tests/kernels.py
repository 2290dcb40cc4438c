"""Kernels compiled before the whole suite: some in each worker, or each would compile them all."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import pytest
from filelock import FileLock

import hertzchain as hc
from tests.oracles import extrapolation
from tests.places import ROOT

PAIR = hc.Scene(hc.Chain(3, 5e-3, 2e11, 0.3, 8e3), hc.Striker(0.1))
DAMPED = replace(PAIR, contact=hc.Contact("restitution", restitution=0.9))
PULSED = replace(PAIR, shock=hc.Pulse("cosine", 100.0, 2.0, momentum_ratio=1.0))

SHARES: tuple[tuple[Callable[[], object], ...], ...] = (
    (partial(hc.Native(wanted="first").run, DAMPED), partial(hc.Native(wanted="all").run, DAMPED)),
    (
        partial(hc.Native().run, PULSED),
        partial(hc.Native(wanted="first").run, PAIR),
        partial(hc.Native(wanted="all").run, PAIR),
        partial(hc.Native("velocity-verlet").run, DAMPED),
        partial(extrapolation.peaks, PULSED),
    ),
)
"""Runs that compile the large kernels: half a minute of processor time in each share."""


def compile_share(config: pytest.Config) -> None:
    """Compile a share of the kernels and wait until other workers have compiled theirs.

    Only before the whole suite: few tests need few kernels. Kernels that are on disk are loaded, in
    less than a second. Where a lock cannot be had, each worker compiles what its tests need.
    """
    worker: dict[str, Any] = getattr(config, "workerinput", {})
    whole = [(config.invocation_params.dir / name).resolve() for name in config.args]
    if whole != [(ROOT / "tests").resolve()] or worker.get("workercount", 1) < len(SHARES):
        return
    locks = [
        FileLock(ROOT / ".pytest_cache" / f"kernels_{k}.lock", timeout=600)
        for k in range(len(SHARES))
    ]
    number = int(worker["workerid"].removeprefix("gw"))
    with suppress(OSError):  # a folder that cannot be written, or a worker that hangs
        if number < len(SHARES):
            with locks[number]:
                for run in SHARES[number]:
                    with suppress(Exception):  # what is broken fails in its test
                        run()
        for lock in locks:
            with lock:
                pass
