"""A deck read by the interpreter acts as in LAMMPS."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hertzchain.engines.lammps.engine import engine
from hertzchain.engines.lammps.reading.reading import Interpreter, Source
from hertzchain.engines.lammps.reading.session import Module
from hertzchain.engines.lammps.reading.watching import Playing
from hertzchain.errors import RunFailed

pytestmark = pytest.mark.lammps


class Player(Playing):
    """Passes runs to LAMMPS, too."""

    def run(self, text: str, steps: int, *_: object) -> int:
        """Take steps."""
        self.lammps.give(text)
        return steps


def player(lammps: Any, folder: Path) -> Player:
    """What gives commands to LAMMPS."""
    return Player(Module(lammps, folder))


BEADS = """units si
atom_style sphere
boundary f f f
region box block -1 1 -1 1 -1 1
create_box 1 box
create_atoms 1 single 0 0 0
create_atoms 1 single 0.1 0 0
set group all diameter 0.02
set group all density 1000
velocity all set 0.1 0.2 0.3
pair_style zero 0.05
pair_coeff * *
neighbor 0.01 bin
fix motion all nve
timestep 0.001
"""

_TABLE = tomllib.loads(Path(__file__).with_name("interpreter.toml").read_text(encoding="utf-8"))
DECKS = {name: text.replace("BEADS\n", BEADS) for name, text in _TABLE["decks"].items()}
FILES = _TABLE["files"]


def state(lammps: Any) -> dict[str, Any]:
    """Variables with their values, and where the granules are."""
    names = lammps.available_ids("variable")
    values: dict[str, Any] = {
        name: str(lammps.extract_variable(name)) for name in names if "hertzchain" not in name
    }
    if lammps.extract_setting("box_exist"):
        values["step"] = lammps.extract_global("ntimestep")
        values["place"] = np.array(lammps.numpy.extract_atom("x")).tolist()
    return values


@pytest.mark.parametrize("name", DECKS)
def test_a_deck_does_what_it_does_in_lammps(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same variables, steps and places, read here or by LAMMPS."""
    monkeypatch.chdir(tmp_path)
    deck = tmp_path / "in.mine"
    deck.write_text(DECKS[name])
    for file, text in FILES.items():
        (tmp_path / file).write_text(text)
    with engine() as lammps:
        script = Interpreter(Source("in.mine", deck, deck.parent), player(lammps, tmp_path))
        script.play()
        ours = state(lammps)
    with engine() as lammps:
        # LAMMPS ends the whole process where a deck says quit.
        text = (
            DECKS[name].split("variable b string never")[0].replace("then quit", 'then "echo none"')
        )
        deck.write_text(text)
        lammps.file(str(deck))
        assert ours == state(lammps)
    assert len(ours) >= 1


def test_where_each_command_stands(tmp_path: Path) -> None:
    deck = tmp_path / "in.mine"
    deck.write_text(
        "variable i loop 2\nlabel top\n  variable a string &\n  it$i # why\n"
        'next i\njump SELF top\ninclude part.in\nif "1==1" then "variable z string q"\n'
    )
    (tmp_path / "part.in").write_text("\n\nvariable p string p\n")
    with engine() as lammps:
        script = Interpreter(Source("my/in.mine", deck, deck.parent), player(lammps, tmp_path))
        script.play()
    rows = [(done.file, done.line, done.text) for done in script.commands]
    file, loop = "my/in.mine", (3, "variable a string it{}")
    assert rows[2] == (file, loop[0], loop[1].format(1))
    assert rows[5] == (file, loop[0], loop[1].format(2)) or rows[6][2].endswith("it2")
    assert ("part.in", 3, "variable p string p") in rows
    assert (file, 8, "variable z string q") in rows
    assert script.commands[2].written == "variable a string it$i"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("variable a string ok\njump SELF nowhere\n", 2, "finds no label nowhere"),
        ("\n\ninclude none.in\n", 3, "none.in: cannot be read"),
        ("label top\njump SELF top\n", 2, "seems to have no end"),
        ("label top\njump ./in.mine top\n", 2, "seems to have no end"),
        ("jump other.in top\n", 1, "leads to another file, other.in: include that file instead"),
        (f"{BEADS}run 2\nclear\n", 17, "clear begins another chain: give it as a deck of its own"),
        ("include in.mine\n", 1, "include one another"),
        ("units si\nrun $((2)\n", 2, "a bracket is not closed"),
        ("run many\n", 1, "is not a number of steps"),
        (f"{BEADS}run 1 start '0 every 1 quit'\n", 16, "is not a number of steps"),
        (f"{BEADS}run 1 pre 'yes every 1 quit'\n", 16, "is neither yes nor no"),
        ("run -5\n", 1, "is not a number of steps"),
        (f"{BEADS}run 2147483648\n", 16, "is not a number of steps: at most 2147483647"),
        ("variable a equal ${missing}\n", 1, "Substitution for illegal variable missing"),
        ("if 1 1 1\n", 1, "if needs a condition"),
        ("fix a all nve/nonsense\n", 1, "fix nve/nonsense is not one of the fixes"),
        ("pair_style granlar\n", 1, "LAMMPS stopped"),
        ("pair_style python 1\n", 1, "pair_style python is not one"),
        ("pair_style hybrid granular python 1\n", 1, "pair_style python is not one"),
        ('"""A chain\nof granules."""\n', 1, "is not a LAMMPS command: must be an input script"),
        ("[chain]\n", 1, "is not a LAMMPS command"),
        ("temper 10 10 1\n", 1, "temper is not one of the commands"),
        ("variable w world a b\n", 1, "a variable of style world is not one of the variables"),
        ("include -\n", 1, "cannot be read"),
        ("variable p python f\n", 1, "a variable of style python is not one of the variables"),
        ("variable f file /etc/passwd\n", 1, "copy it there"),
    ],
)
def test_what_cannot_be_carried_out_is_one_sentence(
    text: str, place: int, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hertzchain.engines.lammps.reading.reading._MOST_COMMANDS", 500)
    deck = tmp_path / "in.mine"
    deck.write_text(text)
    with engine() as lammps, pytest.raises(RunFailed) as caught:
        Interpreter(Source("in.mine", deck, deck.parent), player(lammps, tmp_path)).play()
    assert str(caught.value).startswith(f"in.mine:{place}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_variables_of_the_command_line_go_before_those_of_the_deck(tmp_path: Path) -> None:
    deck = tmp_path / "in.mine"
    deck.write_text("variable a index 1\nvariable b index 2\nvariable c equal v_a+v_b\n")
    with engine() as lammps:
        Interpreter(Source("in.mine", deck, tmp_path, {"a": "40"}), player(lammps, tmp_path)).play()
        assert lammps.extract_variable("c") == 42
