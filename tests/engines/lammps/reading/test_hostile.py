"""Decks that came by mail: they start no program and write no file, however they are read."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest

from hertzchain.engines.lammps.engine import binary_build, engine
from hertzchain.engines.lammps.reading.reading import Interpreter, Source
from hertzchain.engines.lammps.reading.session import Module, Piped, Session
from hertzchain.engines.lammps.reading.text import lines_of
from hertzchain.errors import RunFailed
from hertzchain.limits import Deadline
from tests.command_line import Command
from tests.engines.lammps.reading.chains import BESIDE_PYTHON, SCENE, Deck
from tests.engines.lammps.reading.test_interpreter import Player

pytestmark = pytest.mark.lammps

_TABLE = tomllib.loads(Path(__file__).with_name("hostile.toml").read_text(encoding="utf-8"))
WAYS = {way: text for ways in _TABLE.values() for way, text in ways.items()}

FILES = ("x$(touch $M).gz", "y';touch $M;'.bz2", "|touch $M")
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
    for name in FILES:
        (folder / name).write_text("1\n")
    (folder / "link").symlink_to(FILES[0])
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
