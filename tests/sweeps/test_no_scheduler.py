"""Workers without this hertzchain are refused."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from hertzchain.errors import BackendMissing, HertzchainError, RunFailed
from hertzchain.sweeps import cluster
from tests.sweeps.dask_processes import await_workers, worker
from tests.sweeps.test_sweeps_cluster import sweep

WITHOUT = """
import importlib.metadata as metadata
import sys

sys.modules["hertzchain"] = None
find = metadata.Distribution.from_name.__func__

def from_name(cls, name):
    if name == "hertzchain":
        raise metadata.PackageNotFoundError(name)
    return find(cls, name)

metadata.Distribution.from_name = classmethod(from_name)
"""


def without_hertzchain(folder: Path) -> None:
    """Let a Python that has this folder on its path have none."""
    (folder / "sitecustomize.py").write_text(WITHOUT, encoding="utf-8")


def other_hertzchain(folder: Path) -> None:
    """Let a Python that has this folder on its path have another."""
    described = folder / "hertzchain-99.0.dist-info"
    described.mkdir()
    text = "Metadata-Version: 2.1\nName: hertzchain\nVersion: 99.0\n"
    (described / "METADATA").write_text(text, encoding="utf-8")


NONE = (without_hertzchain, BackendMissing, "pip install 'hertzchain==")
OTHER = (other_hertzchain, RunFailed, "has hertzchain 99.0, this is ")


@pytest.mark.parametrize(("differ", "error", "said", "late"), [(*NONE, True), (*OTHER, False)])
def test_workers_without_this_hertzchain_are_named(
    differ: Callable[[Path], None],
    error: type[HertzchainError],
    said: str,
    late: bool,
    lonely: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with ExitStack() as stack:
        before = tmp_path / "before"
        before.mkdir()
        differ(before)

        def start() -> None:
            path = os.pathsep.join([str(before), os.environ.get("PYTHONPATH", "")])
            with monkeypatch.context() as changed:
                changed.setenv("PYTHONPATH", path)
                stack.enter_context(worker(lonely, tmp_path, "--no-nanny"))

        class Handler(logging.Handler):
            def emit(self, _: logging.LogRecord) -> None:
                start()

        waiting = logging.getLogger(cluster.__name__)
        if late:
            waiting.addHandler(handler := Handler())
            stack.callback(waiting.removeHandler, handler)
        else:
            start()
            await_workers(lonely, 1)
        with pytest.raises(error, match=said) as it:
            sweep(lonely, output=tmp_path / "out")
        assert "\n" not in str(it.value)
        assert not (tmp_path / "out").exists()  # made where workers come late, but for nothing
