"""hertzchain plot: pictures of a sweep as files, and refusals."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import hertzchain as hc
from hertzchain.cli import main
from tests.sweeps.drawn import BASE, F_SW, LAMMPS, RATIO, P

pytestmark = pytest.mark.lammps  # sweeps by native and LAMMPS

# The command


Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def plot(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Command:
    """Run the command; return status, output and messages."""

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["hertzchain", "plot", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            main()
        assert isinstance(caught.value.code, int)
        return caught.value.code, *capfd.readouterr()

    return call


def test_the_command_writes_a_picture_beside_the_tables(plot: Command, folder: Path) -> None:
    status, out, err = plot(folder, "--x", "momentum_ratio", "--y", F_SW)
    assert (status, out) == (0, "")
    assert err == (
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
    plot: Command,
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = plot(folder, *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert all(word in err for word in words), err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_a_sweep_is_refused(plot: Command, tmp_path: Path) -> None:
    for there in (tmp_path, tmp_path / "no"):
        status, out, err = plot(there, "--x", RATIO, "--y", P)
        assert (status, out) == (2, "")
        assert err == f"hertzchain: {there}: is no sweep, must be what hertzchain sweep -o wrote\n"


def test_a_sweep_without_rows_yet_is_refused(plot: Command, folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "sweep.json", tmp_path)
    status, out, err = plot(tmp_path, "--x", RATIO, "--y", P)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "not measured yet" in err
