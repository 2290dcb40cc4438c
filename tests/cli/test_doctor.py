"""``hertzchain doctor``: what is there, and what to do about what is not."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
from numba.core.caching import NullCache

from hertzchain.cli import doctor
from hertzchain.cli.doctor import PACKAGES
from hertzchain.engines.native import elastic
from tests.cli.short_chain import GET_IT
from tests.command_line import Command
from tests.places import ROOT

pytestmark = pytest.mark.usefixtures("folder")


def test_doctor_without_lammps_says_how_to_get_it(
    hertzchain: Command, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The doctor looks for it in a process of its own; there are no binaries to be tried either.
    monkeypatch.syspath_prepend(ROOT / "tests" / "no_lammps")
    monkeypatch.setenv("PATH", str(folder))
    outcome = hertzchain("doctor")
    assert outcome.status == 2
    bad = [line for line in outcome.out.splitlines() if line.startswith("FAIL")]
    assert len(bad) == 1
    assert bad[0].startswith("FAIL  LAMMPS: ")
    assert GET_IT in bad[0]


@pytest.mark.lammps
def test_doctor_finds_everything_here(hertzchain: Command) -> None:
    outcome = hertzchain("doctor")
    assert (outcome.status, outcome.err) == (0, "")
    for words in ("Python", f"hertzchain: {version('hertzchain')}", "numpy", "LAMMPS", "GRANULAR"):
        assert words in outcome.out
    # Other programs, and what else there is of LAMMPS, need not be here or work.
    others = ("--    LAMMPS /", "--    LIGGGHTS", "--    Yade")
    lines = [line for line in outcome.out.splitlines() if not line.startswith(others)]
    assert all(line.startswith("ok ") for line in lines)


def test_the_doctor_says_where_kernels_cannot_be_kept(
    hertzchain: Command, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setattr(doctor, "_every_lammps", list)
    monkeypatch.setattr(elastic.march, "_cache", NullCache())
    why = "no folder to keep them can be written; name one in the environment variable"
    said = f"--    kernels: compiled again in every process, 6 s, as {why} NUMBA_CACHE_DIR"
    assert said in hertzchain("doctor").out.splitlines()


def test_the_doctor_knows_every_package_that_is_needed() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        needed = tomllib.load(file)["project"]["dependencies"]
    listed = {re.split(r"[^\w-]", package)[0] for package in needed} - {"lammps"}
    assert set(PACKAGES) == listed | {"hertzchain"}
