"""What is no scheduler is refused."""

from __future__ import annotations

import http.server
import logging
import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

import pytest

from hertzchain.errors import BackendMissing, HertzchainError, RunFailed
from hertzchain.sweeps import cluster
from tests.sweeps.dask_processes import await_workers, worker
from tests.sweeps.test_sweeps_cluster import sweep

# Failures


class Silent(http.server.BaseHTTPRequestHandler):
    """Answers a web browser, and logs nothing."""

    def log_message(self, *_: object) -> None:
        """Keep it quiet."""


@contextmanager
def web_server() -> Iterator[str]:
    """A server that is not a scheduler."""
    with http.server.HTTPServer(("127.0.0.1", 0), Silent) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"tcp://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def closed_port() -> Iterator[str]:
    with socket.socket() as bound:  # and it does not listen
        bound.bind(("127.0.0.1", 0))
        yield f"tcp://127.0.0.1:{bound.getsockname()[1]}"


@contextmanager
def text(address: str) -> Iterator[str]:
    yield address


NO_SCHEDULER: dict[str, Callable[[], AbstractContextManager[str]]] = {
    "closed": closed_port,
    "web": web_server,
    "abc": lambda: text("abc"),
    "empty": lambda: text(""),
    "protocol": lambda: text("xyz://127.0.0.1:8786"),
    "port": lambda: text("tcp://127.0.0.1:99999"),
    "no host": lambda: text("tcp://nobody.invalid:8786"),
}


@pytest.mark.parametrize("name", NO_SCHEDULER)
def test_what_is_no_scheduler_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cluster, "_PATIENCE", 0.5)
    with NO_SCHEDULER[name]() as address, pytest.raises(RunFailed, match="cannot be reached") as it:
        sweep(address, output=tmp_path / "out")
    assert "\n" not in str(it.value)
    assert not (tmp_path / "out").exists()
    assert capfd.readouterr() == ("", "")


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


@pytest.mark.parametrize(
    ("differ", "error", "said", "late"),
    [(*NONE, True), (*OTHER, False)],
)
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
