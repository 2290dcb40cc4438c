"""hertzchain compare --deck: status, output, files and refusals."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.command_line import Command, is_refused
from tests.verdict.user_deck.corpus import FOLDER

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
    done = hertzchain("compare", SCENE, "--deck", wrong, *files)
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
    row = text[text.index('<tr class="bad"><th scope="row">21') :]
    assert "set             type 1 density 7598" in row[: row.index("</tr>")]
    assert "the scene has 0.003573 kg" in row[: row.index("</tr>")]
    assert plot.read_bytes().startswith(b"\x89PNG")
    failures = list(ElementTree.parse(xml).iter("failure"))  # noqa: S314 - our own
    said = [failure.attrib["message"] for failure in failures]
    assert said[0].startswith("mass of all granules is 0.003411 kg, the scene has 0.003573 kg (")
    assert len(said) == 2  # and the peaks


@pytest.mark.lammps
def test_variables_in_both_forms(hertzchain: Command) -> None:
    deck = FOLDER / "in.steel_variables"
    given = ["--var", "n", "20", "--var", "F0=100", "--var", "dt", "2e-7"]
    done = hertzchain("compare", SCENE, "--deck", deck, *given, "--json")
    assert done.status == 0
    document = done.json()
    assert document["verdict"] == "pass"
    assert all(check["passed"] for check in document["checks"])
    assert len(document["peak_force_N"]) == 19


@pytest.mark.lammps
def test_a_deck_that_stops(hertzchain: Command, tmp_path: Path) -> None:
    deck = tmp_path / "in.stops"
    deck.write_text("units si\natom_style sphere\npair_style no_such_style\n", encoding="utf-8")
    is_refused(hertzchain("compare", SCENE, "--deck", deck), "in.stops:3")


def test_a_deck_that_is_not_there(hertzchain: Command, tmp_path: Path) -> None:
    is_refused(hertzchain("compare", SCENE, "--deck", tmp_path / "in.none"), "in.none")


def test_a_binary_that_is_not_there(hertzchain: Command, tmp_path: Path) -> None:
    there = tmp_path / "lmp"
    is_refused(hertzchain("compare", SCENE, "--deck", DECK, "--lmp", there), str(there))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--deck", DECK, "--results", DECK], ["--deck", "--results"]),
        (["--deck", DECK, "--backend", "native"], ["--backend", "--deck"]),
        (["--deck", DECK, "--isolate"], ["--isolate", "--deck"]),
        (["--deck", DECK, "--ranks", "2"], ["--ranks", "--deck"]),
        (["--deck", DECK, "--dt", "1e-8"], ["--dt", "--results"]),
        (["--var", "a", "1"], ["--var", "--deck"]),
        (["--fix", "out"], ["--fix", "--deck"]),
        (["--tolerance", "1e-2"], ["--tolerance", "--deck"]),
        (["--deck", DECK, "--var", "a"], ["--var", "NAME"]),
        (["--deck", DECK, "--var", "a=1", "--var", "a=2"], ["--var a"]),
        (["--deck", DECK, "--tolerance", "2"], ["tolerance", "below 1"]),
        (["--deck", DECK, "--plot", "a.txt"], ["a.txt"]),
        (["--deck", DECK, "--report", DECK], ["in.steel_plain"]),
    ],
    ids=str,
)
def test_what_does_not_go_together(
    options: list[object], words: list[str], hertzchain: Command
) -> None:
    is_refused(hertzchain("compare", SCENE, *options), *words)
