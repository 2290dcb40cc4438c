"""The command line as people and scripts meet it: refusals, files, signals, help."""

from __future__ import annotations

import os
import re
import signal
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.main import get_command

from hertzchain.cli.commands import app
from hertzchain.scene.scene import Scene
from tests.cli.short_chain import SCENE, scene_file
from tests.command_line import MAIN, Command, Outcome, is_refused, process, python
from tests.processes import ended, linux, names, posix, start

# Files


@pytest.mark.parametrize("name", ["scene.toml/there.png", pytest.param("full.png", marks=linux)])
@pytest.mark.parametrize(
    "command",
    [
        *(("run", "-o"), ("deck", "-o"), ("unit-test", "-o")),
        ("compare", "--backend", "native", "--plot"),
        ("compare", "--backend", "native", "--report"),
    ],
    ids=" ".join,
)
def test_an_output_that_cannot_be_written_is_refused(
    hertzchain: Command, command: list[str], name: str
) -> None:
    """Some places refuse only what is written into them, whoever writes."""
    scene_file({"chain.granules": "6"})
    files = ["scene.toml"]
    if name == "full.png":
        Path(name).symlink_to("/dev/full")
        files.insert(0, name)
    *start, option = command
    outcome = hertzchain(*start, "scene.toml", option, name)
    if name == "full.png" and option == "--plot":
        # The work is done before the write fails; its result is shown.
        assert "6 granules" in outcome.out
        outcome = replace(outcome, out="", err=outcome.err.splitlines(True)[-1])
    is_refused(outcome, name)
    assert names() == files


@linux
def test_a_full_standard_output_is_refused() -> None:
    scene_file({"chain.granules": "6"})
    with Path("/dev/full").open("w") as full:
        is_refused(process("predict", "scene.toml", stdout=full), "No space left on device")


@linux
def test_a_full_standard_error_changes_no_status() -> None:
    scene_file({"chain.granules": "6"})
    with Path("/dev/full").open("w") as full:
        done = python("-c", MAIN, "deck", "scene.toml", "-o", "in.chain", stderr=full)
        wrong = python("-c", MAIN, "predict", "no.toml", stderr=full)
    assert (done.returncode, wrong.returncode) == (0, 2)
    assert names() == ["in.chain", "scene.toml"]


@linux
def test_a_deleted_current_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    gone = f"import os; os.chdir({str(tmp_path / 'gone')!r}); os.rmdir('../gone');"
    outcome = process("init", "scene.toml", code=gone + MAIN)
    is_refused(outcome, "the current folder was deleted: change to another one")


# Signals

SAY_WHEN = """
import hertzchain.engines.native.simulation as simulation
whole = simulation.stoppable

def said(run, control, deadline):
    def begun():
        print("simulating", flush=True)
        return run()
    return whole(begun, control, deadline)

simulation.stoppable = said
"""
"""The compiled work says that it begins."""


@posix
def test_an_interrupted_run_ends_with_130_and_writes_nothing() -> None:
    scene_file({"chain.granules": "2000"})
    # 1e9 steps: whole minutes.
    long = ("--method", "velocity-verlet", "--dt", "1e-10 s")
    running = start("run", "scene.toml", *long, "-o", "peaks.csv", code=SAY_WHEN + MAIN)
    assert running.stdout is not None
    assert running.stdout.readline() == "simulating\n"
    running.send_signal(signal.SIGINT)
    assert ended(running) == (130, "", "hertzchain: interrupted\n")
    assert names() == ["scene.toml"]


AT_IMPORT = """
import signal, sys

def ring():
    signal.raise_signal(signal.{signal})

class Lost:
    def __del__(self):  # whatever is raised in here goes no further
        ring()

class Bell:
    def find_spec(self, name, *_):
        if name == "{module}":
            sys.meta_path.remove(self)
            {how}

sys.meta_path.insert(0, Bell())
"""
"""A signal while a module is loaded."""

AT_EXIT = """
import atexit, signal
atexit.register(signal.raise_signal, signal.SIGINT)
"""
"""Ctrl-C while Python ends: what is registered first is done last."""


@posix
@pytest.mark.parametrize(
    ("name", "module", "how", "status", "said"),
    [
        ("SIGINT", "typer", "ring()", 130, "interrupted"),
        ("SIGTERM", "numpy", "ring()", 143, "terminated"),
        ("SIGINT", "numpy", "Lost()", 130, "interrupted"),
    ],
    ids=["commands are loaded", "NumPy is loaded", "in a callback"],
)
def test_a_stop_at_the_start_is_one_line(
    name: str, module: str, how: str, status: int, said: str
) -> None:
    scene_file()
    moment = AT_IMPORT.format(signal=name, module=module, how=how)
    outcome = process("run", "scene.toml", "-o", "peaks.csv", code=moment + MAIN)
    assert outcome == Outcome(status, "", f"hertzchain: {said}\n")
    assert names() == ["scene.toml"]


@posix
def test_an_interrupt_before_anything_is_loaded_has_no_traceback() -> None:
    moment = AT_IMPORT.format(signal="SIGINT", module="hertzchain.cli", how="ring()")
    by_default = "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    outcome = process(code=moment + by_default + "import hertzchain.__main__")
    assert outcome == Outcome(-signal.SIGINT, "", "")  # 130 in shells


@posix
def test_an_interrupt_after_all_is_done_is_too_late() -> None:
    outcome = process("--version", code=AT_EXIT + MAIN)
    assert outcome == Outcome(0, f"hertzchain {version('hertzchain')}\n", "")


@posix
def test_a_reader_that_has_left_ends_a_command_quietly() -> None:
    """With the status of a closed pipe in shells: 1 would be a check that failed."""
    scene_file({"chain.granules": "6"})
    reading, writing = os.pipe()
    os.close(reading)
    outcome = process("predict", "scene.toml", stdout=writing)
    os.close(writing)
    assert outcome == Outcome(141, "", "")


# The rest


def test_the_version_is_that_of_the_package(hertzchain: Command) -> None:
    as_program = "import runpy; runpy.run_module('hertzchain', None, '__main__')"
    expected = Outcome(0, f"hertzchain {version('hertzchain')}\n", "")
    assert hertzchain("--version") == process("--version", code=as_program) == expected


COMMANDS = get_command(app).commands  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_every_command_has_help(hertzchain: Command, command: str | None) -> None:
    short, long = (hertzchain(*filter(None, (command, option))) for option in ("-h", "--help"))
    assert short == long
    assert (short.status, short.err) == (0, "")
    assert "Usage: hertzchain" in short.out
    if command is None:
        said = short.out.partition("Commands:")[2]
        assert [name for name in COMMANDS if name not in said] == []
        assert "..." not in said  # no description is cut
    else:  # each option has its help
        assert not re.search(r"^  (-\w, )?--[\w-]+( \S+)?\n(?! {10})", short.out, re.M)


def test_a_unit_that_was_forgotten_is_remarked_on(hertzchain: Command) -> None:
    assert hertzchain("predict", scene_file()).err == ""
    question = "chain.radius = 2.5 m (usually 1e-06 to 0.5 m): is the unit right?"
    outcome = hertzchain("predict", scene_file({"chain.radius": "2.5"}))
    assert (outcome.status, outcome.err) == (0, f"hertzchain: {question}\n")
    scene_file({"shock.momentum_ratio": None, "shock.rise_time": "15"})
    outcome = hertzchain("predict", "scene.toml")
    assert outcome.status == 0
    assert re.fullmatch(
        r"hertzchain: LM_ratio is \S+, .* lasts 30 s, is that intended\?\n", outcome.err
    )
    heavy = {"striker.velocity": "1.0", "striker.radius": "0.4"}
    path = scene_file({key: None for key in SCENE if key.startswith("shock.")} | heavy)
    assert Scene.from_toml(path).momentum_ratio > 1e4
    outcome = hertzchain("predict", path)
    assert (outcome.status, outcome.err) == (0, "")
