"""``hertzchain init`` and ``doctor``, and help for new users."""

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
from hertzchain.scene.starters import STARTERS
from tests.cli.short_chain import GET_IT
from tests.command_line import Command, is_refused
from tests.places import ROOT


def test_a_scene_to_start_from(
    hertzchain: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = hertzchain("init")
    assert (done.status, done.err) == (0, "")
    assert done.out.splitlines() == [
        "scene.toml: A uniform chain of steel spheres under a short pulse.",
        "Change it in an editor, then: hertzchain compare scene.toml",
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
    next_one = hertzchain("compare", "scene.toml", "--backend", "native")
    assert next_one.status == 0


@pytest.mark.parametrize("kind", STARTERS)
def test_every_kind_can_be_asked_for(hertzchain: Command, kind: str, tmp_path: Path) -> None:
    path = tmp_path / 'my "scene".toml'
    done = hertzchain("init", path, "--from", kind)
    assert done.status == 0
    assert f"compare '{path}'" in done.out
    assert path.read_text(encoding="utf-8").startswith(f"# {STARTERS[kind].title}\n")


def test_a_file_is_not_replaced(hertzchain: Command, tmp_path: Path) -> None:
    path, table = tmp_path / "mine.toml", tmp_path / "mine.csv"
    table.write_text("measured\n", encoding="utf-8")
    is_refused(hertzchain("init", path, "--from", "pulse-table"), "mine.csv: exists", "delete it")
    assert not path.exists()
    assert table.read_text(encoding="utf-8") == "measured\n"


def test_commands_can_be_completed_by_a_shell(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_HERTZCHAIN_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "hertzchain pre")
    monkeypatch.setenv("COMP_CWORD", "1")
    assert hertzchain().out.split() == ["predict"]


def test_a_misspelt_key_and_unit(hertzchain: Command, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    hertzchain("init", path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"4.75 mm"', "2.5"), encoding="utf-8")
    done = hertzchain("predict", path)
    question = "chain.radius = 2.5 m (usually 1e-06 to 0.5 m): is the unit what is meant?"
    assert (done.status, done.err) == (0, f"hertzchain: {question}\n")
    path.write_text(text.replace("GPa", "Gpa"), encoding="utf-8")
    is_refused(hertzchain("run", path), "unknown unit 'Gpa'", "did you mean GPa?")


# What is installed, and what to do about what is not


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
