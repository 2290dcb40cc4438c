"""Shared parts of the tests: scenes, and the handling of a missing LAMMPS."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import zlib
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from hypothesis import settings

import hertzchain as hc
from hertzchain.engines.lammps.engine import engine
from hertzchain.errors import BackendMissing
from hertzchain.scene.shocks import profile_named
from tests.command_line import Command, run_here
from tests.kernels import compile_share
from tests.places import ROOT

pytest_plugins = ["pytester"]

# Where the machine is busy an example may take any time.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


KEPT = ("CI", "CI_BROWSER", "CI_ENGINES", "HERTZCHAIN_TEST_LMPS", "HOME", "LD_LIBRARY_PATH",
        "NUMBA_CACHE_DIR", "PATH", "TMPDIR")  # fmt: skip
"""Variables of the environment that the tests and their processes have, besides those of pytest."""


# Before Matplotlib and Numba read them; nor do settings in the home folder decide a test.
for _name in [*os.environ]:
    if _name not in KEPT and not _name.startswith("PYTEST_"):
        del os.environ[_name]
os.environ["MPLCONFIGDIR"] = str(ROOT / ".pytest_cache" / "matplotlib")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile what is not on disk."""
    compile_share(session.config)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let CI run the slow tests in turn."""
    parser.addoption(
        "--third", type=int, choices=(0, 1, 2), help="run a third of the tests, chosen by name"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out two thirds of the tests where ``--third`` is given."""
    third = config.getoption("--third")
    if third is None:
        return
    chosen = [item for item in items if zlib.crc32(item.nodeid.encode()) % 3 == third]
    config.hook.pytest_deselected(items=[item for item in items if item not in set(chosen)])
    items[:] = chosen


STEEL = {"radius": 4.75e-3, "young_modulus": 193e9, "poisson_ratio": 0.3, "density": 7958.0}
"""The paper's granules (section 5.2)."""


def paper_scene(
    profile: str, momentum_ratio: float, duration_ratio: float, granules: int = 60
) -> hc.Scene:
    """100 N on the paper's steel."""
    pulse = hc.Pulse(profile_named(profile), 100.0, duration_ratio, momentum_ratio=momentum_ratio)
    return hc.Scene(hc.Chain(granules, **STEEL), pulse)


@pytest.fixture(scope="session")
def demo() -> hc.Scene:
    """The scene of `make demo`: cosine-triangular, LM 2.0, n 2."""
    return paper_scene("cosine-triangular", 2.0, 2.0)


@pytest.fixture(scope="session")
def demo_reference(demo: hc.Scene) -> hc.Result:
    """The demo scene by the reference method."""
    return hc.Native("reference").run(demo)


@pytest.fixture
def hertzchain(capfd: pytest.CaptureFixture[str]) -> Command:
    """The command line in this process; what LAMMPS itself would print is captured too."""
    return partial(run_here, capfd, "hertzchain")


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """A folder on a file system of its own that has room for names, but for no text."""
    there = tmp_path / "disk"
    there.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=4k", "tmpfs", str(there)]
    try:
        done = subprocess.run(mount, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip("needs mount")
    if done.returncode != 0:
        pytest.skip(f"needs the right to mount a file system: {done.stderr.strip()}")
    try:
        (there / "filler").write_bytes(bytes(4096))
        yield there
    finally:
        subprocess.run(["umount", str(there)], check=True)  # noqa: S607


NEEDS = {
    "lammps": "CI",
    "chromium": "CI_BROWSER",
    "liggghts": "CI_ENGINES",
    "yade": "CI_ENGINES",
}
"""Markers of tests, and the variables in which they fail without their program: else they skip.

LIGGGHTS and Yade come from Debian's packages, so that CI alone does not have them.
"""


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Asked before there are fixtures: some of whole modules need LAMMPS or are a browser."""
    for name, where in NEEDS.items():
        if item.get_closest_marker(name) is None:
            continue
        if problem := why_missing(name):
            if os.environ.get(where):
                pytest.fail(problem)
            pytest.skip(problem)


def chromium() -> str | None:
    """Return the path of a Chromium, if there is one."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next(filter(None, map(shutil.which, names)), None)


@functools.cache
def why_missing(name: str) -> str:
    """Empty where a program is there."""
    if name == "lammps":
        try:
            with engine():
                return ""
        except BackendMissing as problem:
            return str(problem)
    there = chromium() if name == "chromium" else shutil.which(name)
    return "" if there else f"needs {name}: apt install {name}"
