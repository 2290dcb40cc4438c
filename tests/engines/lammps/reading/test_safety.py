"""No deck writes files, runs other programs, or exceeds its time."""

from __future__ import annotations

import os
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from hertzchain.engines.lammps.reading.allowed import Rules
from hertzchain.engines.lammps.reading.text import quoted, words_of
from hertzchain.engines.lammps.reading.units import units_of
from hertzchain.errors import HertzchainError, RunFailed, TooExpensive
from tests.engines.lammps.reading.chains import SCENE, Deck, read_deck
from tests.processes import children

pytestmark = pytest.mark.lammps

slow = pytest.mark.slow

MISCHIEF = """shell touch {0}/shell
shell rm -rf {0}/kept
dump d all custom 1 {0}/dump.* id x
dump_modify d sort id
log {0}/log
write_data {0}/data
write_restart {0}/restart
write_dump all custom {0}/written id
restart 1 {0}/again
print "text" file {0}/print
print "text" append {0}/print screen no
print "text" "append" {0}/quoted
info all out append {0}/info
fix p all print 1 "text" file {0}/fixprint screen no
fix a all ave/time 1 1 1 c_thermo_temp file {0}/avetime
fix h all ave/histo 1 1 1 0 1 2 vx file {0}/histo mode vector
variable e python f
variable home getenv HOME
if "1 == 1" then "shell touch {0}/nested" "print 'a' file {0}/nested_print"
jump SELF go_on
label never
label go_on
run 4 every 2 "shell touch {0}/every" "write_data {0}/every.data"
unfix p
undump d
"""


def test_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = tmp_path / "there"
    there.mkdir()
    (there / "kept").write_text("kept")
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    deck = Deck(more=MISCHIEF.format(there), steps=20).write(tmp_path)
    relative = Deck(more=MISCHIEF.format("."), steps=20).write(tmp_path, "in.relative")
    for path in (deck, relative):
        found = read_deck(path, SCENE)
        assert [run.steps for run in found.runs] == [4, 20]
    assert [path.name for path in there.iterdir()] == ["kept"]
    assert list(here.iterdir()) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "here", "in.mine", "in.relative", "there",
    ]  # fmt: skip
    left_out = {done.text.split()[0] for done in found.commands if not done.carried_out}
    assert left_out == {
        "shell", "dump", "dump_modify", "undump", "log", "write_data", "write_restart",
        "write_dump", "restart", "info", "fix", "unfix", "variable",
    }  # fmt: skip
    assert all(done.why_not for done in found.commands if not done.carried_out)
    without = [done.text.split()[1] for done in found.commands if done.carried_out and done.why_not]
    assert without == ['"text"', '"text"', '"text"', "a", "h", "'a'"]
    nested = [done for done in found.commands if "nested" in done.text and not done.carried_out]
    assert nested[0].text == "shell touch ./nested"
    assert nested[0].written.startswith("if ")


WRONG: dict[str, tuple[str, str | None, str]] = {
    "endless": ("", "label a\nrun 0\njump SELF a", "not over after 1 s"),
    "python": ("fix x all python/invoke 1 end_of_step f", None, "in.mine:25: fix python/invoke is"),
    "code of a compute": ("compute p all mliap model none", None, "in.mine:25: compute mliap is"),
    "fewer granules": (
        "", "run 10\ngroup last id 4\ndelete_atoms group last\nrun 10", "makes or deletes granules",
    ),
    "no number": (
        "variable skin equal foo\nneighbor ${skin} bin", None, "in.mine:25: LAMMPS stopped: ERROR",
    ),
    "crashes": (
        f"variable a equal {'-' * 200_000}1\nvariable b equal $(v_a)", None,
        "in.mine:26: variable b equal $(v_a)",
    ),
}  # fmt: skip
RARELY_WRONG: dict[str, tuple[str, str | None, str]] = {
    "unknown": ("", "print a\nunknown_thing 1", "in.mine:27: unknown_thing is none"),
    "error": ("units real", None, "LAMMPS stopped"),
    "pre no": (
        "",
        "run 9\nunfix push\nrun 9 pre no",
        "in.mine:28: with pre no LAMMPS takes no note",
    ),
    "no end": ("include /dev/zero", None, "larger than 10 MB"),
    "no step": ("", "run 0", "takes no step"),
    "no granules": ("delete_atoms group all", None, "has made no granules"),
}


@pytest.mark.parametrize(
    "what", [*WRONG, *(pytest.param(what, marks=slow) for what in RARELY_WRONG)]
)
def test_what_goes_wrong_is_one_sentence(what: str, tmp_path: Path) -> None:
    more, run, words = (WRONG | RARELY_WRONG)[what]
    deck = Deck(more=more, run=run, steps=20).write(tmp_path)
    before = children(os.getpid())
    limit = 1.0 if what == "endless" else 60.0
    started = time.monotonic()
    with pytest.raises(RunFailed) as caught:
        read_deck(deck, SCENE, time_limit=limit)
    assert isinstance(caught.value, TooExpensive) == (limit == 1.0)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "Traceback" not in str(caught.value)
    assert time.monotonic() - started < 60
    assert children(os.getpid()) == before
    assert [path.name for path in tmp_path.iterdir()] == ["in.mine"]


def test_a_disk_that_gets_full_is_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """LAMMPS names files of ours, or says something else, where it cannot write."""
    free = iter((1e9, 0.0))
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=next(free)))
    deck = Deck(more="units real").write(tmp_path)
    with pytest.raises(RunFailed, match=r"needs room .*No space left.*TMPDIR"):
        read_deck(deck, SCENE)


def test_a_deck_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(HertzchainError, match=r"in\.none: cannot be read"):
        read_deck(tmp_path / "in.none", SCENE)


GIVEN = """
print 'a' file x screen no => print 'a' screen no
print 'a' append x => print 'a'
print file x => print file x
print 'file' => print 'file'
print 'a' file => print 'a' file
fix 1 all ave/time 1 1 1 c_x file y mode vector => fix 1 all ave/time 1 1 1 c_x mode vector
fix 1 all nve => fix 1 all nve
fix 1 all => fix 1 all
fix 1 all print 1 'x' =>
fix 1 all external pf/callback 1 1 => refused
compute 1 all pressure thermo_temp => compute 1 all pressure thermo_temp
compute 1 all => compute 1 all
compute 1 all mliap => refused
timer timeout 1 =>
timer full => timer full
variable a python f =>
variable a getenv HOME =>
variable a equal 1 => variable a equal 1
variable a => variable a
variable a shell ls => refused
variable a file there => variable a file {there}
variable a file lost => variable a file lost
read_data there => read_data {there}
pair_style granular => pair_style granular
pair_style => pair_style
pair_style hybrid/overlay granular kim => refused
pair_style python 1 => refused
unfix 9 => unfix 9
shell ls =>
tad 1 2 => refused
"""
"""Commands, and what LAMMPS is given in their place."""


@pytest.mark.parametrize("line", GIVEN.strip().splitlines())
def test_what_lammps_is_given(line: str, tmp_path: Path) -> None:
    (tmp_path / "there").write_text("1")
    command, _, given = line.replace("{there}", quoted(str(tmp_path / "there"))).partition(" =>")
    rules = Rules((tmp_path / "nowhere", tmp_path))
    if given == " refused":
        with pytest.raises(RunFailed, match="carried out here"):
            rules.decide(words_of(command), command)
        return
    found, why = rules.decide(words_of(command), command)
    assert (found or "") == given.strip()
    assert found is None or (why is None) == (command == found or "there" in command)


def test_a_fix_that_was_left_out_is_not_changed() -> None:
    rules = Rules(())
    for command, is_given in (
        ("fix p all print 1 x", False),
        ("fix_modify p energy yes", False),
        ("unfix p", False),
        ("fix p all nve", True),
        ("unfix p", True),
    ):
        found, why = rules.decide(words_of(command), command)
        assert (found == command, why is None) == (is_given, is_given)


@pytest.mark.parametrize("units", ["real", "metal", "electron"])
def test_units_of_atoms_are_refused(units: str) -> None:
    with pytest.raises(RunFailed, match=f"units {units} are those of atoms"):
        units_of(units)
