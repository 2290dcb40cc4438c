"""hertzchain plot: pictures of a sweep as files, and refusals."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import hertzchain as hc
from tests.command_line import Command, is_refused
from tests.sweeps.made import BASE, F_SW, LAMMPS, RATIO, P

pytestmark = pytest.mark.lammps  # sweeps by native and LAMMPS


def test_the_command_writes_a_picture_beside_the_tables(hertzchain: Command, folder: Path) -> None:
    done = hertzchain("plot", folder, "--x", "momentum_ratio", "--y", F_SW)
    assert (done.status, done.out) == (0, "")
    assert done.err == (
        "hertzchain: shock.profile varies, too: all values are lines of one colour; --colour tells"
        " them apart\n"
        f"Plot written to {folder / 'plot.png'}\n"
    )
    assert (folder / "plot.png").read_bytes().startswith(b"\x89PNG")
    # The folder is as good as before: the same sweep goes on in it.
    vary = {"shock.profile": "cosine,triangular,cosine-triangular", RATIO: "0.1:2:7:log"}
    assert hc.sweep(BASE, vary, backends=("native", LAMMPS), output=folder).count().done == 42


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--x", "lm", "--y", P), ("lm: is no column", "scene, backend, chain.granules")),
        (("--x", RATIO, "--y", "profile"), ("shock.profile: is text", "--colour")),
        (("--x", "backend", "--y", P), ("backend: is text",)),
        (("--x", RATIO, "--y", P, "--colour", "failure"), ("cannot be a colour",)),
        (("--x", RATIO, "--y", RATIO), (f"{RATIO}: given twice",)),
        (("--x", RATIO, "--y", P, "--colour", P), (f"{P}: given twice",)),
        (("--x", RATIO, "--y", P, "-o", "plot.gif"), ("plot.gif", "png", "svg")),
        (("--x", RATIO, "--y", P, "-o", "no/plot.png"), ("no/plot.png", "does not exist")),
        (("--x", RATIO, "--y", P, "--where", "profile"), ("--where profile", "NAME=VALUE")),
        (
            ("--x", RATIO, "--y", P, "--where", "backend=native", "--where", "backend=lammps"),
            ("--where backend", "twice"),
        ),
    ],
    ids=" ".join,
)
def test_what_cannot_be_drawn_is_refused_in_one_sentence(
    hertzchain: Command,
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    is_refused(hertzchain("plot", folder, *arguments), *words)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_a_sweep_or_its_rows_is_refused(
    hertzchain: Command, folder: Path, tmp_path: Path
) -> None:
    said = "is no sweep, must be what hertzchain sweep -o wrote"
    for there in (tmp_path, tmp_path / "no"):
        is_refused(hertzchain("plot", there, "--x", RATIO, "--y", P), f"{there}: {said}")
    shutil.copy(folder / "sweep.json", tmp_path)
    is_refused(hertzchain("plot", tmp_path, "--x", RATIO, "--y", P), "not measured yet")
