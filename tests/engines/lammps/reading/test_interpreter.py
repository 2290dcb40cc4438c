"""A deck, command by command: it acts as in LAMMPS, starts no program, and writes no file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hertzchain.engines.lammps.engine import binary_build, engine
from hertzchain.engines.lammps.reading.reading import Interpreter, Source
from hertzchain.engines.lammps.reading.session import Module, Piped, Session
from hertzchain.engines.lammps.reading.text import lines_of
from hertzchain.engines.lammps.reading.watching import Playing
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from tests.command_line import Command
from tests.engines.lammps.reading.chains import BESIDE_PYTHON, SCENE, Deck

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


# Hostile decks

_HOSTILE = tomllib.loads(Path(__file__).with_name("hostile.toml").read_text(encoding="utf-8"))
WAYS = {way: text for ways in _HOSTILE.values() for way, text in ways.items()}

NAMES = ("x$(touch $M).gz", "y';touch $M;'.bz2", "|touch $M")
"""Names of files that are there; LAMMPS would give some to a shell, in which M is a path."""

CONTEXTS = {
    "deck": "{text}",
    "include": "include part.in",
    "jump": "label back\njump part.in",
    "nested if": "if \"1 == 1\" then \"if '2 > 1' then 'include part.in'\"",
    "run every": "run 2 every 1 'include part.in'",
    "loop": "variable part index part.in\nvariable i loop 2\nlabel top\ninclude ${{part}}\nnext i\n"
    "jump SELF top",
    "variable": "{by_variable}",
}
"""Where the commands of a way stand."""


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder in which decks are read; nothing may be in it, or beside it, that was not before."""
    folder, marker = tmp_path / "there", tmp_path / "pwn"
    for path in (folder, tmp_path / "tmp", tmp_path / "home"):
        path.mkdir()
    for name, value in (("M", marker), ("TMPDIR", tmp_path / "tmp"), ("HOME", tmp_path / "home")):
        monkeypatch.setenv(name, str(value))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.chdir(folder)
    for name in NAMES:
        (folder / name).write_text("1\n")
    (folder / "link").symlink_to(NAMES[0])
    SCENE.to_toml(folder / "scene.toml")
    before = sorted([*tmp_path.rglob("*"), folder / "in.mine", folder / "part.in"])
    yield folder
    (folder / "part.in").touch()
    assert sorted(tmp_path.rglob("*")) == before


def write(folder: Path, way: str, context: str) -> Path:
    """Write a deck, in which the commands of a way stand in a context."""
    marker = str(folder.parent / "pwn")
    text = WAYS[way].replace("CMD", f"shell touch {marker}").replace("PWN", marker)
    lines = enumerate(text.split("\n") if '"""' not in text else [])
    by_variable = "".join(f'variable v{k} string """{line} """\n${{v{k}}}\n' for k, line in lines)
    (folder / "part.in").write_text(text, newline="")
    more = CONTEXTS[context].format(text=text, by_variable=by_variable or "include part.in")
    deck = folder / "in.mine"
    deck.write_text(Deck(more=f"run 1\n{more}", run="run 2", steps=2).text(), newline="")
    return deck


@contextmanager
def session(lmp: str | None, folder: Path) -> Iterator[Session]:
    """The module, or a program."""
    if lmp is None:
        with engine() as lammps:
            yield Module(lammps, folder)
    else:
        with closing(Piped(lmp, binary_build(lmp, Deadline(60)).version, folder)) as piped:
            yield piped


def play(deck: Path, lmp: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have LAMMPS read and run a deck; each command that it is given is one line by itself."""
    with session(lmp, deck.parent.parent / "tmp") as lammps:
        give = lammps.give

        def given(*texts: str) -> None:
            for text in texts:
                assert len(lines_of(f"{text}\nprint next")) == 2, text
            give(*texts)

        monkeypatch.setattr(lammps, "give", given)
        script = Interpreter(Source("in.mine", deck, deck.parent), Player(lammps))
        with suppress(RunFailed):  # a way may be refused, or stop LAMMPS; not what is before it
            script.play()
        assert [done.text for done in script.commands].count("run 1")
    for path in (deck.parent.parent / "tmp").glob("hertzchain.*"):
        path.unlink()


@pytest.mark.parametrize(
    "context", [c if c == "deck" else pytest.param(c, marks=pytest.mark.slow) for c in CONTEXTS]
)
@pytest.mark.parametrize("lmp", [None, pytest.param(BESIDE_PYTHON, marks=pytest.mark.slow)])
def test_no_way_starts_or_writes_anything(
    lmp: str | None, context: str, there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for way in WAYS:
        play(write(there, way, context), lmp, monkeypatch)
        assert not there.with_name("pwn").exists(), way


@pytest.mark.parametrize(
    "command",
    ["include", "jump", "read_data", "molecule m", "variable f file", "variable f atomfile"],
)
@pytest.mark.parametrize("text", ["root:x", "shell root:x", "fix root:x all nve", "1 root:x\n2"])
def test_text_outside_the_folder_of_a_deck_is_not_shown(
    command: str, text: str, there: Path
) -> None:
    (there.parent / "home" / "shadow").write_text(f"# passwords\n{text}\nunits root:x\n")
    (there / "in.mine").write_text(f"{command} ../home/shadow\nprint ${{f}}\n")
    with session(None, there.parent / "tmp") as lammps:
        script = Interpreter(Source("in.mine", there / "in.mine", there), Player(lammps))
        with pytest.raises(RunFailed, match=r"not in the folder of|to another file") as caught:
            script.play()
    (there.parent / "home" / "shadow").unlink()
    assert "root" not in f"{caught.value} {[d for d in script.commands if not d.carried_out]}"


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_no_command_starts_or_writes_anything(way: str, there: Path, hertzchain: Command) -> None:
    write(there, way, "deck")
    for how in (
        ["lint"],
        ["examine", "scene.toml"],
        ["examine", "--lmp", BESIDE_PYTHON, "scene.toml"],
    ):
        done = hertzchain(*how, "in.mine")
        assert done.status in (0, 1, 2)
        assert "Traceback" not in done.err
