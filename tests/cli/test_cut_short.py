"""Files that commands write appear whole or not at all."""

from __future__ import annotations

import contextlib
import resource
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.command_line import Command
from tests.conftest import paper_scene
from tests.processes import linux, names

pytestmark = linux


@contextlib.contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """No file that this process writes grows beyond this size [bytes]."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(
    "command",
    [
        ("run", "scene.toml", "--plot", "a.svg"),
        ("run", "scene.toml", "--record", "99", "-o", "a.csv"),
        ("deck", "scene.toml", "-o", "in.a"),
    ],
    ids=lambda command: command[-1],
)
def test_a_file_that_is_cut_short_is_not_left(
    command: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hertzchain: Command
) -> None:
    monkeypatch.chdir(tmp_path)
    paper_scene("cosine", 1.0, 2.0, granules=5).to_toml("scene.toml")
    assert hertzchain(*command).status == 0  # kernels and fonts are on disk from here on
    path = Path(command[-1])
    assert path.stat().st_size > 4000
    path.unlink()
    with files_of_at_most(4000):
        done = hertzchain(*command)
    assert done.status != 0
    assert f"{path}: cannot be written (File too large)" in done.err
    assert names(tmp_path) == ["scene.toml"]
