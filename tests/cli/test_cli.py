"""The command line as people and scripts meet it: output, files, exit status, refusals."""

from __future__ import annotations

import functools
import json
import os
import re
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from importlib.metadata import entry_points, version
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from numpy.typing import ArrayLike

from hertzchain.cli import main
from hertzchain.cli.diagnosis import PACKAGES
from hertzchain.engines.native import Native
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene
from hertzchain.verdict import run_checks, tradeoff
from tests.command_line import MAIN, PATIENCE, Command, Outcome, is_refused, process
from tests.places import ROOT
from tests.processes import names, posix

Changes = Mapping[str, str | None]
"""Changes of a scene: keys and TOML values, None for no such key."""

linux = pytest.mark.skipif(sys.platform != "linux", reason="needs files that only Linux has")

SCENE = {
    "chain.granules": "12",
    "chain.radius": '"4.75 mm"',
    "chain.young_modulus": '"193 GPa"',
    "chain.poisson_ratio": "0.3",
    "chain.density": '"7958 kg/m^3"',
    "shock.profile": '"cosine-triangular"',
    "shock.peak_force": '"100 N"',
    "shock.duration_ratio": "2",
    "shock.momentum_ratio": "1.0",
}
"""A chain that is done in a moment and yet has a transition (p = 5) and a wave with a speed."""

CONTACTS = 11

RISE_TIME: Changes = {"shock.momentum_ratio": None, "shock.rise_time": '"70 us"'}
"""What to change for a scene with the other measure of the pulse."""

TABLE: Changes = {
    **{key: None for key in SCENE if key.startswith("shock.")},
    "shock.profile": '"table"',
    "shock.file": '"pulse.csv"',
}
"""What to change for a scene with a pulse table."""


def scene_file(changes: Changes | None = None, name: str = "scene.toml") -> Path:
    """Write a scene to the current folder."""
    sections: dict[str, list[str]] = {}
    for full, value in {**SCENE, **(changes or {})}.items():
        section, _, key = full.partition(".")
        sections.setdefault(section, []).extend([] if value is None else [f"{key} = {value}"])
    path = Path(name)
    path.write_text("".join("\n".join([f"[{s}]", *rows, ""]) for s, rows in sections.items()))
    return path


def table_file(*rows: str, header: str = "time_s,force_N") -> None:
    Path("pulse.csv").write_text("\n".join([header, *rows, ""]))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Every test has an empty current folder and a plain terminal."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    return tmp_path


NO_LAMMPS = f"import sys; sys.path.insert(0, {str(ROOT / 'tests' / 'no_lammps')!r}); {MAIN}"
"""Hide LAMMPS: `import lammps` then raises an ImportError, also in its own process."""


# Bad input

POSITIVE = {
    "chain.radius": "s",
    "chain.young_modulus": "N",
    "chain.density": "kg/m^2",
    "shock.peak_force": "Pa",
    "shock.momentum_ratio": "s",
    "shock.rise_time": "m",
    "run.end_time": "mm",
}
"""What must be above 0, each with a unit of the wrong dimension."""


def with_value(key: str, value: str) -> Changes:
    return {**(RISE_TIME if key == "shock.rise_time" else {}), key: value}


BAD_SCENES: list[tuple[Changes, tuple[str, ...]]] = [
    ({"chain.colour": '"red"'}, ("chain.colour", "'red'", "unknown key, allowed are granules")),
    ({"shock.peak": "3"}, ("shock.peak", "3", "unknown key, allowed are profile")),
    ({"run.steps": "3"}, ("run.steps", "3", "unknown key, allowed are end_time")),
    (
        {"walls.left": "true"},
        (
            "walls",
            "allowed are the sections chain, contact, precompression, run, shock, striker, wall",
        ),
    ),
    *(({key: None}, (key, "missing")) for key in SCENE if key != "shock.momentum_ratio"),
    ({"shock.momentum_ratio": None}, ("momentum_ratio or rise_time", "exactly one")),
    ({"shock.rise_time": "7e-5"}, ("momentum_ratio and rise_time", "both", "exactly one")),
    *(
        (with_value(key, f'"2 {unit}"'), (f"{key} = '2 {unit}'", "wrong dimension", "must be"))
        for key, unit in POSITIVE.items()
    ),
    ({"chain.poisson_ratio": '"0.3 m"'}, ("chain.poisson_ratio = '0.3 m'", "wrong dimension")),
    ({"shock.duration_ratio": '"2 s"'}, ("shock.duration_ratio = '2 s'", "wrong dimension")),
    *(
        (with_value(key, value), (f"{key} = {value}", "must be a finite number above 0"))
        for key in POSITIVE
        for value in ("0", "0.0", "-1", "inf", "-inf", "nan")
    ),
    ({"chain.radius": '"-4 mm"'}, ("chain.radius = '-4 mm'", "above 0")),
    ({"chain.radius": '"inf mm"'}, ("chain.radius = 'inf mm'", "finite")),
    ({"chain.radius": '"1e999 mm"'}, ("chain.radius = '1e999 mm'", "finite")),
    *(
        ({"chain.poisson_ratio": nu}, (f"poisson_ratio = {nu}", "above -1 and at most 0.5"))
        for nu in ("-1", "-1.5", "0.500001", "inf", "nan")
    ),
    *(
        ({"chain.granules": n}, (f"granules = {n}", "must be an integer from 2"))
        for n in ("1", "0", "-12", "12.0", "inf", "nan")
    ),
    *(
        ({"shock.duration_ratio": n}, (f"duration_ratio = {n}", "must be a finite number above 1"))
        for n in ("1", "1.0", "0.5", "0", "-2", "inf", "nan")
    ),
    ({"shock.profile": '"box"'}, ("profile = 'box'", "cosine, triangular, cosine-triangular")),
    ({"shock.profile": '["cosine"]'}, ("shock.profile", "must be one of")),
    ({"chain.radius": "1" * 5000}, ("scene.toml",)),
    ({"chain.radius": f"0x{'f' * 5000}"}, ("chain.radius",)),
    ({**TABLE, "shock.peak_force": "3"}, ("shock.peak_force = 3", "takes only file")),
    ({**TABLE, "shock.file": None}, ("shock.file", "missing")),
    ({**TABLE, "shock.file": '"a\\u0000b"'}, ("shock.file", "CSV")),
    (TABLE, ("shock.file", "pulse.csv", "No such file", "must be a CSV file")),
]


@pytest.mark.parametrize(
    ("changes", "words"), BAD_SCENES, ids=[str(changes)[:60] for changes, _ in BAD_SCENES]
)
def test_a_bad_scene_is_refused_in_one_sentence(
    hertzchain: Command, changes: Changes, words: tuple[str, ...]
) -> None:
    scene_file(changes)
    is_refused(hertzchain("run", "scene.toml", "-o", "peaks.csv"), "scene.toml: ", *words)
    assert names() == ["scene.toml"]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([], ("time_s", "rows = 0", "at least 2 rows")),
        (["0,1"], ("time_s", "rows = 1", "at least 2 rows")),
        (["0,0", "1e-5,1", "1e-5,2"], ("time_s in row 3", "1e-05", "must be above 1e-05")),
        (["0,0", "2e-5,1", "1e-5,2"], ("time_s in row 3", "1e-05", "must be above 2e-05")),
        (["-1e-5,0", "1e-5,1"], ("time_s in row 1", "-1e-05", "must be at least 0")),
        (["0,0", "inf,1"], ("time_s in row 2", "inf", "must be a finite number")),
        (["0,0", "1e-5,nan"], ("force_N in row 2", "nan", "must be a finite number")),
        (["0,0", "1e-5,-1"], ("force_N in row 2", "-1.0", "at least 0")),
        (["0,0", "1e-5,0"], ("force_N", "positive in at least one row")),
        (["0,0", "1e-5,much"], ("row 2", "1e-5,much", "must be two numbers")),
    ],
    ids=str,
)
def test_a_bad_pulse_table_is_refused_in_one_sentence(
    hertzchain: Command, rows: list[str], words: tuple[str, ...]
) -> None:
    scene_file(TABLE)
    table_file(*rows)
    is_refused(hertzchain("run", "scene.toml", "-o", "peaks.csv"), "pulse.csv: ", *words)
    assert names() == ["pulse.csv", "scene.toml"]


def test_a_pulse_table_without_its_header_is_refused(hertzchain: Command) -> None:
    scene_file(TABLE)
    table_file("0,0", "1e-5,1", header="t,F")
    outcome = hertzchain("run", "scene.toml")
    is_refused(outcome, "pulse.csv: first line = 't,F'", "must be time_s,force_N")


EVERY_COMMAND = [
    ("run",),
    ("run", "--backend", "lammps"),
    ("compare",),
    ("tradeoff",),
    ("deck",),
    ("unit-test",),
    ("predict",),
]


@pytest.mark.parametrize("command", EVERY_COMMAND, ids=" ".join)
def test_a_file_that_is_no_scene_is_refused(hertzchain: Command, command: Iterable[str]) -> None:
    Path("scene.toml").write_text("granules: 60\n")
    is_refused(hertzchain(*command, "scene.toml"), "scene.toml", "is not TOML")
    Path("scene.toml").write_bytes(b"\x89PNG\r\n\x1a\n\x00")
    is_refused(hertzchain(*command, "scene.toml"), "scene.toml", "is not TOML")
    is_refused(hertzchain(*command, "."), "is a directory, must be a TOML file")
    is_refused(hertzchain(*command, "no.toml"), "no.toml", "No such file", "must be a TOML file")
    is_refused(hertzchain(*command, "x" * 5000), "File name too long", "must be a TOML file")
    scene_file({"chain.granules": "1"})
    is_refused(hertzchain(*command, "scene.toml"), "scene.toml", "granules = 1", "from 2")
    assert names() == ["scene.toml"]


@linux
@pytest.mark.parametrize("command", EVERY_COMMAND, ids=" ".join)
def test_an_unreadable_file_is_refused(hertzchain: Command, command: Iterable[str]) -> None:
    # Root may read everything; reading this one fails for everybody.
    is_refused(hertzchain(*command, "/proc/self/mem"), "/proc/self/mem", "cannot be read")


@linux
def test_an_unreadable_pulse_table_is_refused(hertzchain: Command) -> None:
    scene_file({**TABLE, "shock.file": '"/proc/self/mem"'})
    is_refused(hertzchain("run", "scene.toml"), "shock.file", "/proc/self/mem", "cannot be read")


def test_a_real_process_refuses_without_a_traceback() -> None:
    scene_file({"chain.radius": "-1"})
    outcome = process("run", "scene.toml", "-o", "peaks.csv")
    is_refused(outcome, "scene.toml: chain.radius = -1: must be")
    assert names() == ["scene.toml"]


UNWRITABLE = ["no/there.png", "folder.png", "scene.toml/there.png", "x" * 300 + ".png"]


@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize(
    "name",
    [
        *UNWRITABLE,
        pytest.param("/proc/nope.png", marks=linux),
    ],
    ids=lambda name: name[:25],
)
@pytest.mark.parametrize(
    "command",
    [
        *(("run", "-o"), ("deck", "-o"), ("tradeoff", "-o"), ("tradeoff", "--plot")),
        ("unit-test", "-o"),
        ("compare", "--backend", "native", "--plot"),
        ("compare", "--backend", "native", "--report"),
    ],
    ids=" ".join,
)
def test_an_output_that_cannot_be_written_is_refused(
    hertzchain: Command, command: list[str], name: str
) -> None:
    Path("folder.png").mkdir()
    scene_file({"chain.granules": "6"})
    *start, option = command
    outcome = hertzchain(*start, "scene.toml", option, name)
    late = ("-o", "--plot") if start[0] in ("compare", "tradeoff") else ()
    if name.startswith("/proc") and option in late:
        # Nobody knows before the work is done; what was found is not lost with the file.
        assert "6 granules" in outcome.out
        outcome = replace(outcome, out="", err=outcome.err.splitlines(True)[-1])
    is_refused(outcome, name)
    assert names() == ["folder.png", "scene.toml"]


@pytest.mark.parametrize(
    "command",
    [
        ("compare", "scene.toml", "--backend", "native", "--junit", "scene.toml"),
        ("compare", "scene.toml", "--results", "peaks.csv", "--junit", "./peaks.csv"),
        ("deck", "scene.toml", "-o", "scene.toml"),
        ("unit-test", "scene.toml", "-o", "scene.toml"),
        ("run", "scene.toml", "-o", "a.csv", "--trajectory", "a.csv"),
        ("compare", "scene.toml", "--report", "a.html", "--junit", "a.html"),
        ("tradeoff", "scene.toml", "--plot", "a.png", "-o", "a.png"),
    ],
    ids=" ".join,
)
def test_no_file_is_written_over_another(hertzchain: Command, command: list[str]) -> None:
    scene_file({"chain.granules": "6"})
    Path("peaks.csv").write_text("contact,peak_force_N\n2,100\n", encoding="utf-8")
    before = {name: Path(name).read_bytes() for name in names()}
    is_refused(hertzchain(*command), "name")
    assert {name: Path(name).read_bytes() for name in names()} == before


def test_a_plot_in_no_known_format_is_refused(hertzchain: Command) -> None:
    scene_file()
    for name in ("plot.xyz", "plot"):
        for command in ("compare", "tradeoff"):
            is_refused(hertzchain(command, "scene.toml", "--plot", name), name, "png", "svg")
    assert names() == ["scene.toml"]


@linux
def test_a_full_standard_output_is_refused() -> None:
    scene_file({"chain.granules": "6"})
    with Path("/dev/full").open("w") as full:
        is_refused(process("run", "scene.toml", stdout=full), "No space left on device")


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
    with subprocess.Popen(
        [sys.executable, "-c", SAY_WHEN + MAIN, "run", "scene.toml", *long, "-o", "peaks.csv"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "simulating\n"
        running.send_signal(signal.SIGINT)
        rest = running.communicate(timeout=PATIENCE)
    assert (running.returncode, rest) == (130, ("", "hertzchain: interrupted\n"))
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
def test_an_interrupt_after_all_is_done_is_too_late() -> None:
    outcome = process("--version", code=AT_EXIT + MAIN)
    assert outcome == Outcome(0, f"hertzchain {version('hertzchain')}\n", "")


@pytest.mark.skipif(os.name != "posix", reason="needs pipes that can be closed")
def test_a_reader_that_has_left_is_no_traceback() -> None:
    scene_file({"chain.granules": "6"})
    reading, writing = os.pipe()
    os.close(reading)
    outcome = process("run", "scene.toml", "--json", stdout=writing)
    os.close(writing)
    assert "Traceback" not in outcome.err


# run


@pytest.fixture(scope="module")
def native(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    """`run --json` with everything by default, and a table of peaks."""
    there = tmp_path_factory.mktemp("native")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(there)
        scene_file()
        outcome = process("run", "scene.toml", "--json", "-o", there / "peaks.csv")
        assert names() == ["peaks.csv", "scene.toml"]
    peaks = pd.read_csv(there / "peaks.csv")
    assert peaks.columns.tolist() == ["contact", "peak_force_N", "peak_time_s"]
    assert peaks["contact"].tolist() == list(range(2, 2 + CONTACTS))
    document = outcome.json()
    assert peaks["peak_force_N"].tolist() == document["peak_force_N"]
    assert peaks["peak_time_s"].tolist() == document["peak_time_s"]
    return outcome


RUN_KEYS: dict[str, type] = {
    "backend": str,
    "method": str,
    "end_time_s": float,
    "rise_time_s": float,
    "momentum_ratio": float,
    "dt_s": float,
    "peak_force_N": list,
    "peak_time_s": list,
    "transition_granules": int,
    "solitary_wave": dict,
    "error_estimate": float,
    "overlap_ratio": float,
    "warnings": list,
    "wall_time_s": float,
    "compile_time_s": float,
    "provenance": dict,
    # What scripts may like to have besides.
    "steps": int,
    "force_evaluations": int,
    "balance": dict,
}


CONTEXT_KEYS = {"scene": dict, "contacts": list, "definitions": int, "hertzchain": str}
"""Of a document on one scene, which stands alone."""


def has_the_keys_of_a_run(document: dict[str, Any]) -> None:
    context = {key: document[key] for key in CONTEXT_KEYS}
    assert {key: type(value) for key, value in context.items()} == CONTEXT_KEYS
    assert document["contacts"] == list(range(2, 2 + CONTACTS))
    numbers = {key: value for key, value in document.items() if key not in CONTEXT_KEYS}
    has_the_numbers_of_a_run(numbers)


def has_the_numbers_of_a_run(document: dict[str, Any]) -> None:
    of_lammps = document["backend"] == "lammps"
    told = {
        "watching_share": float if of_lammps else type(None),
        "lost_digits": dict if of_lammps else type(None),
    }
    assert {key: type(value) for key, value in document.items()} == RUN_KEYS | told
    if of_lammps:
        lost = document["lost_digits"]
        assert set(lost) == {"young_modulus_Pa", "predicted", "bound"}
        assert 0 < lost["bound"] <= document["error_estimate"]
    for key in ("peak_force_N", "peak_time_s"):
        assert [type(value) for value in document[key]] == [float] * CONTACTS
    wave = document["solitary_wave"]
    assert {key: type(value) for key, value in wave.items()} == {
        "peak_force_N": float,
        "far_field_force_N": float,
        "far_field_error": float,
        "far_field_reason": type(None),
        "speed_m_s": float,
        "speed_error": float,
    }
    assert {type(value) for value in document["provenance"].values()} == {str}
    assert {"hertzchain", "python", "platform"} <= document["provenance"].keys()


def test_run_prints_nothing_but_one_json_object(native: Outcome) -> None:
    assert native.status == 0
    assert native.err.startswith("Peaks written to ")
    assert native.err.count("\n") == 1
    document = native.json()
    has_the_keys_of_a_run(document)
    assert (document["backend"], document["method"]) == ("native", "srkn-11b")
    assert document["momentum_ratio"] == 1.0
    assert document["transition_granules"] == 5
    # p + 1 = 6 is the contact after the transition, the fifth of the list.
    assert document["solitary_wave"]["peak_force_N"] == document["peak_force_N"][4]
    assert 0 < document["error_estimate"] <= 1e-6
    assert document["provenance"]["hertzchain"] == version("hertzchain")


@pytest.mark.lammps
def test_a_run_with_lammps_vs_one_with_native(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    outcome = hertzchain("run", "scene.toml", "--backend", "lammps", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document, expected = outcome.json(), native.json()
    has_the_keys_of_a_run(document)
    assert document["backend"] == "lammps"
    assert document["method"].startswith("velocity-verlet")
    assert "lammps" in document["provenance"]
    for key in ("end_time_s", "rise_time_s", "momentum_ratio", "transition_granules"):
        assert document[key] == expected[key]
    error = document["error_estimate"] + expected["error_estimate"]
    assert document["peak_force_N"] == pytest.approx(expected["peak_force_N"], rel=error)


@pytest.mark.lammps
def test_a_run_that_misses_the_wanted_accuracy_says_so(hertzchain: Command) -> None:
    # Repeated collisions amplify rounding errors until they show.
    shock = {"shock.momentum_ratio": "1000", "shock.duration_ratio": "1.7"}
    scene_file({**shock, "shock.profile": '"triangular"', "chain.granules": "9"})
    outcome = hertzchain("run", "scene.toml", "--rtol", "1e-8")
    assert outcome.status == 1
    assert outcome.err.startswith("hertzchain: wanted 1e-08, reached ")
    assert "amplify rounding errors" in outcome.err


@pytest.mark.parametrize(("wanted", "status"), [("0.0001", 0), ("9.9e-05", 1)])
def test_a_run_misses_an_accuracy_that_it_misses_by_little(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch, wanted: str, status: int
) -> None:
    run = Native.run

    def rough(native: Native, scene: Scene, record: ArrayLike | None = None) -> Result:
        return replace(run(native, scene, record), error_estimate=1e-4)

    monkeypatch.setattr(Native, "run", rough)
    scene_file()
    outcome = hertzchain("run", "scene.toml", "--rtol", wanted)
    assert outcome.status == status
    assert outcome.err.startswith(f"hertzchain: wanted {wanted}, reached 0.0001: ") is (status == 1)


def test_a_table_has_no_rise_time(hertzchain: Command) -> None:
    scene_file(TABLE)
    table_file("0,0", "2e-5,100", "4e-5,0")
    document = hertzchain("run", "scene.toml", "--json", "--method", "rk4").json()
    assert document["rise_time_s"] is None
    assert document["method"] == "rk4"
    assert type(document["momentum_ratio"]) is float


def test_two_granules_have_one_contact_and_no_wave(hertzchain: Command) -> None:
    scene_file({"chain.granules": "2"})
    document = hertzchain("run", "scene.toml", "--json").json()
    assert len(document["peak_force_N"]) == len(document["peak_time_s"]) == 1
    assert document["transition_granules"] is None
    assert "no transition ends" in document["solitary_wave"].pop("far_field_reason")
    assert set(document["solitary_wave"].values()) == {None}


def rows_of(text: str) -> list[list[str]]:
    """The lines of a printed table of contacts."""
    return [
        line.split() for line in text.splitlines() if line.split()[:1] and line.split()[0].isdigit()
    ]


def test_run_prints_the_transition_from_contact_2(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    outcome = hertzchain("run", "scene.toml")
    assert (outcome.status, outcome.err) == (0, "")
    rows = rows_of(outcome.out)
    assert [row[0] for row in rows] == ["2", "3", "4", "5", "6"]
    known = native.json()
    for row, force, when in zip(rows, known["peak_force_N"], known["peak_time_s"], strict=False):
        assert float(row[1]) == pytest.approx(force, rel=known["error_estimate"])
        assert float(row[2]) == pytest.approx(when, rel=1e-5)  # 6 digits
    for words in ("transition, p", "5 granules", "F_SW", "m/s", "error of the peaks", "steps"):
        assert words in outcome.out


def test_dt_with_a_unit_vs_seconds(hertzchain: Command) -> None:
    scene_file({"run.end_time": '"60 us"'})
    documents = []
    for dt in ("20 ns", "2e-8", "0.02us"):
        outcome = hertzchain(
            "run", "scene.toml", "--method", "velocity-verlet", "--dt", dt, "--json"
        )
        document = outcome.json()
        assert document.pop("wall_time_s") > 0
        assert document.pop("compile_time_s") >= 0
        documents.append(document)
    assert documents[0] == documents[1] == documents[2]
    assert documents[0]["dt_s"] <= 2e-8


@pytest.mark.parametrize("dt", ["0", "-1 ns", "inf", "nan", "1 m", "soon", "", "1e-320", "1 s s"])
@pytest.mark.parametrize("backend", ["native", "lammps"])
def test_an_impossible_step_is_refused(hertzchain: Command, backend: str, dt: str) -> None:
    scene_file()
    is_refused(hertzchain("run", "scene.toml", "--backend", backend, "--dt", dt), "dt")


def test_lammps_with_rk4_is_refused(hertzchain: Command) -> None:
    scene_file()
    for method in ("rk4", "reference"):
        outcome = hertzchain("run", "scene.toml", "--backend", "lammps", "--method", method)
        is_refused(outcome, f"--method {method}", "velocity-verlet")


def is_json_or_refused(outcome: Outcome) -> None:
    """Assert strict JSON or one sentence; values that JSON cannot hold cause no crash."""
    if outcome.status != 2:
        outcome.json()
        said = outcome.err.splitlines()
        assert len(said) <= (outcome.status == 1)
        assert all(line.startswith("hertzchain: wanted 1e-06, reached ") for line in said)
    else:
        is_refused(outcome)


@pytest.mark.parametrize(
    ("method", "dt"),
    [
        *(("velocity-verlet", dt) for dt in ("10 us", "30 us", "0.1 ms", "1 s")),
        *(("rk4", dt) for dt in ("30 us", "0.1 ms", "1 s")),
        ("reference", "1 s"),
    ],
)
def test_a_step_far_too_large_is_no_crash(hertzchain: Command, method: str, dt: str) -> None:
    scene_file()
    arguments = ["run", "scene.toml", "--method", method, "--dt", dt]
    is_json_or_refused(hertzchain(*arguments, "--json"))
    assert hertzchain(*arguments).status in (0, 2)


SHORT_RUNS = [
    *({"run.end_time": f'"{end_time}"'} for end_time in ("10 us", "0.1 us", "1 ns", "1e-300 s")),
    {**TABLE, "run.end_time": "5e-6"},
]
"""Runs that end before most contacts are pressed, and one that ends before the shock begins."""


@pytest.mark.parametrize(
    "command",
    [
        ["run"],
        ["compare", "--backend", "native"],
        pytest.param(["run", "--backend", "lammps"], marks=pytest.mark.lammps),
        pytest.param(["compare"], marks=pytest.mark.lammps),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("changes", SHORT_RUNS, ids=lambda changes: changes["run.end_time"])
def test_a_short_run_is_no_crash(hertzchain: Command, command: list[str], changes: Changes) -> None:
    scene_file(changes)
    table_file("1e-5,50", "2e-5,100")
    is_json_or_refused(hertzchain(*command, "scene.toml", "--json"))
    assert hertzchain(*command, "scene.toml").status in (0, 1, 2)


def test_the_format_is_that_of_the_name(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    assert hertzchain("run", "scene.toml", "-o", "peaks.json").status == 0
    document, known = json.loads(Path("peaks.json").read_text()), native.json()
    for one in (document, known):
        assert one.pop("wall_time_s") > 0
        assert one.pop("compile_time_s") >= 0
    assert document == known
    is_refused(hertzchain("run", "scene.toml", "-o", "peaks.xls"), "peaks.xls", ".csv", ".parquet")
    assert names() == ["peaks.json", "scene.toml"]


def test_parquet_vs_json(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    assert hertzchain("run", "scene.toml", "-o", "peaks.parquet").status == 0
    peaks = pd.read_parquet("peaks.parquet")
    assert peaks["peak_force_N"].tolist() == native.json()["peak_force_N"]


def test_a_trajectory_has_as_many_frames_as_wanted(hertzchain: Command, native: Outcome) -> None:
    from ase.io import read

    scene_file()
    options = ("--trajectory", "motion.xyz", "--frames", "7", "--json")
    outcome = hertzchain("run", "scene.toml", *options)
    assert outcome.json()["peak_force_N"] == native.json()["peak_force_N"]
    frames = read("motion.xyz", index=":", format="extxyz")
    assert [len(frame) for frame in frames] == [12] * 7
    assert frames[-1].info["time_s"] == outcome.json()["end_time_s"]


def test_a_trajectory_of_another_format_is_refused(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("run", "scene.toml", "--trajectory", "motion.dump")
    is_refused(outcome, "motion.dump", ".xyz", ".extxyz")
    is_refused(hertzchain("run", "scene.toml", "--frames", "7"), "--frames", "--trajectory")
    assert names() == ["scene.toml"]


# compare --results


def peaks_file(native: Outcome, factor: float = 1.0) -> None:
    rows = enumerate(native.json()["peak_force_N"], start=2)
    lines = ["contact,peak_force_N", *(f"{contact},{factor * force!r}" for contact, force in rows)]
    Path("peaks.csv").write_text("\n".join(lines) + "\n")


def test_peaks_from_a_file_are_judged(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native)
    outcome = hertzchain("compare", "scene.toml", "--results", "peaks.csv")
    assert (outcome.status, outcome.err) == (0, "")
    assert [row[0] for row in rows_of(outcome.out)] == ["2", "3", "4", "5", "6"]
    assert "11 judged, 0 failed, 0 not given" in outcome.out
    assert "cause" not in outcome.out
    assert outcome.out.endswith("Verdict: pass\n")


def test_wrong_peaks_are_status_1_with_a_cause(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native, 1e-3)
    command = ("compare", "scene.toml", "--results", "peaks.csv")
    outcome = hertzchain(*command, "--dt", "20 ns")
    assert outcome.status == 1
    assert "Likely cause: every peak 0.001 times the true one: in units of kN" in " ".join(
        outcome.out.split()
    )
    assert "velocity Verlet, steps of 2e-08 s" in outcome.out
    assert outcome.out.endswith("Verdict: fail\n")
    outcome = hertzchain(*command, "--json", "--tolerance", "0.5")
    assert outcome.status == 1
    document = outcome.json()
    assert document["verdict"] == "fail"
    assert document["tolerance"] == 0.5
    assert "in units of kN" in document["cause"]
    assert [row["contact"] for row in document["rows"]] == list(range(2, 2 + CONTACTS))
    keys = ["contact", "given_N", "reference_N", "difference", "passed"]
    assert [list(row) for row in document["rows"]] == [keys] * CONTACTS


def test_peaks_of_a_damped_scene_are_judged(hertzchain: Command, native: Outcome) -> None:
    """Those of the elastic scene lack its damping."""
    scene_file()
    peaks_file(native)
    with Path("scene.toml").open("a") as file:
        file.write('\n[contact]\ndamping = "dashpot"\ncoefficient = 5.0\n')
    command = ("compare", "scene.toml", "--results", "peaks.csv", "--report", "report.html")
    outcome = hertzchain(*command, "--dt", "20 ns")
    assert outcome.status == 1
    said = " ".join(outcome.out.split())
    assert "Likely cause: no damping; leaves" in said
    assert "What velocity Verlet has at that step is not known of damped contacts." in said
    assert "Causes that were tried in a scene with damping: " in said
    assert "no damping" in Path("report.html").read_text("utf-8")


def test_a_judgement_with_a_report(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native, 1.01)
    command = ("compare", "scene.toml", "--results", "peaks.csv", "--report", "report.html")
    outcome = hertzchain(*command, "--json")
    assert (outcome.status, outcome.err) == (1, "Report written to report.html\n")
    page = Path("report.html").read_text("utf-8")
    assert embedded(page) == outcome.json()
    assert "scene.toml</b> and <b>peaks.csv" in page
    assert names() == ["peaks.csv", "report.html", "scene.toml"]


def test_given_peaks_are_drawn(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native)
    outcome = hertzchain("compare", "scene.toml", "--results", "peaks.csv", "--plot", "plot.png")
    assert (outcome.status, outcome.err) == (0, "Plot written to plot.png\n")
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")


def test_options_of_results_stand_with_results(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    peaks_file(native)
    for option in (("--tolerance", "1e-3"), ("--dt", "20 ns")):
        is_refused(hertzchain("compare", "scene.toml", *option), option[0], "--results")
    judged = ("compare", "scene.toml", "--results", "peaks.csv")
    for more in (("--backend", "native"), ("--isolate",)):
        is_refused(hertzchain(*judged, *more), more[0], "--results")
    is_refused(hertzchain(*judged, "--tolerance", "0"), "tolerance")
    is_refused(hertzchain(*judged, "--dt", "1 m"), "--dt")
    is_refused(hertzchain(*judged, "--dt", "1 s"), "unstable")
    is_refused(hertzchain(*judged[:-1], "none.csv"), "none.csv", "cannot be read")
    is_refused(hertzchain("compare", "none.toml", *judged[2:]), "none.toml")
    assert names() == ["peaks.csv", "scene.toml"]


# compare

ROW_KEYS = ["contact", "native_N", "lammps_N", "eq6_N", "eq9_N"]
CHECK_KEYS = ["name", "measured", "expected", "tolerance", "passed", "reason"]


def has_the_keys_of_a_comparison(document: dict[str, Any], backends: set[str]) -> None:
    # The contract's own, then what scripts may like to have besides.
    own = {"verdict", "rows", "checks", "formulas", "results"}
    assert document.keys() == own | CONTEXT_KEYS.keys()
    assert document["verdict"] in ("pass", "fail")
    assert [row["contact"] for row in document["rows"]] == list(range(2, 2 + CONTACTS))
    for row in document["rows"]:
        assert list(row) == ROW_KEYS
        assert type(row["contact"]) is int
        assert type(row["native_N"]) is float
        assert type(row["lammps_N"]) is (float if "lammps" in backends else type(None))
        # Eq. 6 speaks of contacts 2 to p, Eq. 9 of one more; p is 5.
        assert type(row["eq6_N"]) is (float if row["contact"] <= 5 else type(None))
        assert type(row["eq9_N"]) is (float if row["contact"] <= 6 else type(None))
    for check in document["checks"]:
        assert list(check) == CHECK_KEYS
        assert type(check["name"]) is type(check["reason"]) is str
        assert type(check["passed"]) is bool
        for key in ("measured", "expected", "tolerance"):
            assert type(check[key]) is (type(None) if "not run" in check["name"] else float)
    assert document["results"].keys() == backends
    for result in document["results"].values():
        has_the_numbers_of_a_run(result)


def test_compare_with_native_alone(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--backend", "native", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document = outcome.json()
    has_the_keys_of_a_comparison(document, {"native"})
    assert document["verdict"] == "pass"
    # compare takes the reference method, run the cheapest that is right to 1e-6.
    peaks = [row["native_N"] for row in document["rows"]]
    error = native.json()["error_estimate"]
    assert native.json()["peak_force_N"] == pytest.approx(peaks, rel=error, abs=0)


def embedded(page: str) -> Any:
    """All numbers of a report."""
    found = re.search(r'id="numbers">(.*?)</script>', page)
    assert found is not None
    return json.loads(found[1])


def test_compare_with_a_report(hertzchain: Command) -> None:
    scene_file()
    command = ("compare", "scene.toml", "--backend", "native", "--json")
    outcome = hertzchain(*command, "--report", "report.HTML", "--plot", "plot.svg")
    assert outcome.status == 0
    assert outcome.err == "Plot written to plot.svg\nReport written to report.HTML\n"
    assert embedded(Path("report.HTML").read_text("utf-8")) == outcome.json()
    assert names() == ["plot.svg", "report.HTML", "scene.toml"]


@pytest.mark.usefixtures("hasty")
def test_a_report_that_is_no_page_is_refused(hertzchain: Command) -> None:
    scene_file()
    for more in ((), ("--results", "peaks.csv")):
        outcome = hertzchain("compare", "scene.toml", *more, "--report", "report.pdf")
        is_refused(outcome, "report.pdf", ".html or .htm")
    assert names() == ["scene.toml"]


@pytest.mark.lammps
def test_compare_with_everything(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--json", "--plot", "plot.png")
    assert outcome.status == 0
    assert outcome.err == "Plot written to plot.png\n"
    document = outcome.json()
    has_the_keys_of_a_comparison(document, {"native", "lammps"})
    assert document["verdict"] == "pass"
    assert all(check["passed"] for check in document["checks"])
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")
    assert names() == ["plot.png", "scene.toml"]


@pytest.mark.lammps
def test_compare_prints_every_oracle_and_a_verdict(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("compare", "scene.toml")
    assert (outcome.status, outcome.err) == (0, "")
    rows = rows_of(outcome.out)
    assert [row[0] for row in rows] == ["2", "3", "4", "5", "6"]
    assert len(rows[0]) == 8
    for words in ("native", "LAMMPS", "Eq. 6", "Eq. 9", "p, granules", "F_SW [N]", "speed [m/s]"):
        assert words in outcome.out
    assert "FAIL" not in outcome.out
    assert outcome.out.endswith("Verdict: pass\n")


@pytest.mark.lammps
def test_the_order_and_number_of_backends_do_not_matter(hertzchain: Command) -> None:
    scene_file({"chain.granules": "4", "run.end_time": '"60 us"'})
    wanted = ["--backend", "lammps", "--backend", "native", "--backend", "lammps"]
    documents = [
        hertzchain("compare", "scene.toml", "--json", *arguments).json()
        for arguments in ([], ["--backend", "lammps"], wanted)
    ]
    assert documents[0]["rows"] == documents[1]["rows"] == documents[2]["rows"]


def test_out_of_tolerance_is_status_1(hertzchain: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_checks, "MOMENTUM_ERROR", -1.0)  # no difference is that small
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--backend", "native")
    assert outcome.status == 1
    assert "FAIL" in outcome.out
    assert outcome.out.endswith("Verdict: fail\n")
    outcome = hertzchain("compare", "scene.toml", "--backend", "native", "--json")
    assert outcome.status == 1
    assert outcome.json()["verdict"] == "fail"
    assert [check["passed"] for check in outcome.json()["checks"]] == [False, True, True]


@pytest.mark.lammps
def test_lammps_out_of_tolerance_is_status_1(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_checks, "SAME_STEPS_PEAKS", 1e-15)
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--json")
    assert outcome.status == 1
    failed = [check["name"] for check in outcome.json()["checks"] if not check["passed"]]
    assert failed == ["lammps: peaks, same steps"]


# tradeoff

TRADEOFF_KEYS = ["truth_error", "missing", "remarks", "provenance", "rows"]

TRADEOFF_ROW_KEYS: dict[str, tuple[type, ...]] = {
    "contender": (str,),
    "engine": (str,),
    "step_s": (float, type(None)),
    "natural_step": (float, type(None)),
    "rtol": (float, type(None)),
    "error": (float,),
    "force_evaluations": (int,),
    "wall_time_s": (float,),
    "self_contained": (bool,),
    "frontier": (bool,),
}


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """No run is repeated for the sake of its time, and the slow ones are left out."""
    engines = ("formulas", "compiled", "LAMMPS")
    quick = functools.partial(tradeoff.tradeoff, engines=engines, enough=0.0)
    monkeypatch.setattr(tradeoff, "tradeoff", quick)


def has_the_keys_of_a_tradeoff(document: dict[str, Any]) -> None:
    assert list(document) == TRADEOFF_KEYS
    for row in document["rows"]:
        assert list(row) == list(TRADEOFF_ROW_KEYS)
        for key, types in TRADEOFF_ROW_KEYS.items():
            assert type(row[key]) in types, (key, row)


@pytest.mark.lammps
@pytest.mark.usefixtures("hasty")
def test_tradeoff_measures_plots_and_writes(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("tradeoff", "scene.toml", "--json", "--plot", "plot.png", "-o", "rows.csv")
    assert (outcome.status, outcome.err) == (
        0,
        "Plot written to plot.png\nTable written to rows.csv\n",
    )
    document = outcome.json()
    has_the_keys_of_a_tradeoff(document)
    assert {row["engine"] for row in document["rows"]} == {"formulas", "compiled", "LAMMPS"}
    assert (document["missing"], document["remarks"]) == (False, [])
    assert any(row["frontier"] for row in document["rows"])
    table = pd.read_csv("rows.csv")
    assert table.columns.tolist() == list(TRADEOFF_ROW_KEYS)
    assert table["error"].tolist() == [row["error"] for row in document["rows"]]
    assert Path("plot.png").read_bytes().startswith(b"\x89PNG")
    assert names() == ["plot.png", "rows.csv", "scene.toml"]


@pytest.mark.usefixtures("hasty")
def test_tradeoff_without_lammps_prints_the_rest_and_status_2(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    scene_file()
    outcome = hertzchain("tradeoff", "scene.toml")
    assert outcome.status == 2
    assert "srkn-11b, compiled" in outcome.out
    assert "LAMMPS, extrapolated" not in outcome.out
    assert outcome.err.count("\n") == 1
    assert outcome.err.startswith("hertzchain: LAMMPS is not available")
    assert GET_IT in outcome.err
    document = hertzchain("tradeoff", "scene.toml", "--json").json()
    has_the_keys_of_a_tradeoff(document)
    assert document["missing"]
    assert GET_IT in document["remarks"][0]


# predict

PREDICT_KEYS: dict[str, type] = {
    "missing": type(None),
    "outside_range": type(None),
    "rise_time_s": float,
    "momentum_ratio": float,
    "overlap_ratio": float,
    "warnings": list,
    "rows": list,
    "transition_granules": int,
    "transition_candidates": list,
    "solitary_wave": dict,
    "eq3_transition_granules": float,
    "speed_m_s": dict,
    "momentum_N_s": dict,
    "constants": list,
    "map_error": dict,
    "provenance": dict,
}
NOTHING_KEYS = PREDICT_KEYS | {
    "overlap_ratio": type(None),
    "missing": str,
    **dict.fromkeys(
        ("transition_granules", "eq3_transition_granules", "speed_m_s", "momentum_N_s"), type(None)
    ),
}


def has_the_keys_of_a_prediction(document: dict[str, Any], keys: dict[str, type]) -> None:
    assert {key: type(value) for key, value in document.items()} == keys
    assert [list(row) for row in document["rows"]] == [
        ["contact", "map_N", "eq6_N", "eq9_N"] for _ in range(CONTACTS)
    ]
    assert document["solitary_wave"].keys() == {"peak_force_N", "far_field_force_N"}
    for key in ("speed_m_s", "momentum_N_s"):
        if document[key] is not None:
            assert list(document[key]) == ["paper", "exact", "far_field", "closer"]
            assert document[key]["closer"] in ("paper", "exact")
    assert [list(constant) for constant in document["constants"]] == 5 * [
        ["name", "paper", "exact"]
    ]
    assert list(document["map_error"]) == ["peak_force", "last_peak_force", "far_field_force"]
    assert {type(value) for value in document["provenance"].values()} == {str}


def test_predict_vs_a_run(hertzchain: Command, native: Outcome) -> None:
    scene_file()
    outcome = hertzchain("predict", "scene.toml", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document, expected = outcome.json(), native.json()
    has_the_keys_of_a_prediction(document, PREDICT_KEYS)
    for key in ("rise_time_s", "momentum_ratio", "transition_granules"):
        assert document[key] == expected[key]
    assert document["transition_candidates"] == [5]
    peaks = [row["map_N"] for row in document["rows"]]
    # There are no kinks here: 3e-6 of the map and 1e-6 of the run; at the free end 2 %.
    assert peaks[:-1] == pytest.approx(expected["peak_force_N"][:-1], rel=4e-6, abs=0)
    assert peaks[-1] == pytest.approx(expected["peak_force_N"][-1], rel=0.02, abs=0)
    assert [row["contact"] for row in document["rows"] if row["eq6_N"] is not None] == [2, 3, 4, 5]
    assert document["solitary_wave"]["peak_force_N"] == document["rows"][4]["map_N"]


def test_predict_prints_what_it_predicts(hertzchain: Command) -> None:
    scene_file()
    outcome = hertzchain("predict", "scene.toml")
    assert (outcome.status, outcome.err) == (0, "")
    document = hertzchain("predict", "scene.toml", "--json").json()
    rows = rows_of(outcome.out)
    assert [row[0] for row in rows] == ["2", "3", "4", "5", "6"]
    for row, expected in zip(rows, document["rows"], strict=False):
        assert float(row[1]) == pytest.approx(expected["map_N"], rel=1e-4)  # 5 digits are printed
    for words in ("transition, p", "5 granules", "p of Eq. 3", "F_SW", "far-field", "is closer"):
        assert words in outcome.out
    for constant in document["constants"]:
        assert constant["name"] in outcome.out


def test_predict_needs_no_simulation() -> None:
    scene_file()
    code = "import sys; sys.modules['lammps'] = sys.modules['numba'] = None; " + MAIN
    outcome = process("predict", "scene.toml", "--json", code=code)
    assert (outcome.status, outcome.err) == (0, "")
    has_the_keys_of_a_prediction(outcome.json(), PREDICT_KEYS)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (TABLE, "pulse table"),
        ({"shock.momentum_ratio": "20"}, "LM_ratio 0.1 to 10"),
        ({"shock.duration_ratio": "1.5"}, "n 2 to 50"),
        ({"shock.momentum_ratio": "10"}, "at least 41 under this pulse"),
    ],
    ids=["table", "LM_ratio", "n", "N"],
)
def test_what_cannot_be_predicted_is_said_to_be_missing(
    hertzchain: Command, changes: Changes, words: str
) -> None:
    scene_file(changes)
    table_file("0,0", "2e-5,100", "4e-5,0")
    outcome = hertzchain("predict", "scene.toml", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document = outcome.json()
    table = {"rise_time_s": type(None)} if changes is TABLE else {"outside_range": str}
    has_the_keys_of_a_prediction(document, NOTHING_KEYS | table)
    assert words in document["missing"]
    assert {row["map_N"] for row in document["rows"]} == {None}
    outcome = hertzchain("predict", "scene.toml")
    assert (outcome.status, outcome.err) == (0, "")
    assert words in " ".join(outcome.out.split())
    assert rows_of(outcome.out) == []


# Without LAMMPS

GET_IT = 'pip install "lammps[mpi]"'


def test_run_without_lammps_says_how_to_get_it() -> None:
    scene_file()
    outcome = process("run", "scene.toml", "--backend", "lammps", "-o", "peaks.csv", code=NO_LAMMPS)
    is_refused(outcome, "LAMMPS is not available", GET_IT)
    assert names() == ["scene.toml"]


def test_compare_without_lammps_prints_the_rest_and_status_2(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)  # to import it fails
    scene_file()
    outcome = hertzchain("compare", "scene.toml")
    assert outcome.status == 2
    rows = rows_of(outcome.out)
    assert [row[0] for row in rows] == ["2", "3", "4", "5", "6"]
    assert [len(row) for row in rows] == [6, 6, 6, 6, 4]
    assert "native: energy" in outcome.out
    assert "lammps: not run" in outcome.out
    assert GET_IT in " ".join(outcome.out.split())
    assert "Traceback" not in outcome.err


def test_compare_without_lammps_in_json(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)  # to import it fails
    scene_file()
    outcome = hertzchain("compare", "scene.toml", "--json")
    assert outcome.status == 2
    document = outcome.json()
    has_the_keys_of_a_comparison(document, {"native"})
    assert document["verdict"] == "fail"
    checks = {check["name"]: check for check in document["checks"]}
    assert not checks["lammps: not run"]["passed"]
    assert GET_IT in checks["lammps: not run"]["reason"]
    assert [name for name, check in checks.items() if not check["passed"]] == ["lammps: not run"]


def test_compare_with_native_alone_needs_no_lammps(
    hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)  # to import it fails
    scene_file({"chain.granules": "6"})
    outcome = hertzchain("compare", "scene.toml", "--backend", "native", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    assert "lammps" not in {check["name"].partition(":")[0] for check in outcome.json()["checks"]}


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


def test_a_deck_needs_no_lammps(hertzchain: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    scene_file({"chain.granules": "6"})
    outcome = hertzchain("deck", "scene.toml", "-o", "in.lammps")
    assert (outcome.status, outcome.out, outcome.err) == (0, "", "")
    assert "pair_style granular" in Path("in.lammps").read_text()
    assert names() == ["in.lammps", "scene.toml"]


@pytest.fixture
def no_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    """LIGGGHTS and Yade are not there, whether or not they are installed."""
    monkeypatch.setenv("PATH", "")


@pytest.mark.usefixtures("no_programs")
@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_run_without_the_program_is_one_sentence(hertzchain: Command, engine: str) -> None:
    scene_file({"chain.granules": "3"})
    outcome = hertzchain("run", "scene.toml", "--backend", engine)
    assert (outcome.status, outcome.out) == (2, "")
    assert outcome.err == (
        f"hertzchain: {engine} is missing or not a program: install it with: apt install {engine}\n"
    )


@pytest.mark.usefixtures("no_programs")
def test_compare_without_the_programs_shows_the_rest_and_what_to_do(hertzchain: Command) -> None:
    scene_file({"chain.granules": "3"})
    wanted = ["--backend", "liggghts", "--backend", "yade"]
    outcome = hertzchain("compare", "scene.toml", *wanted)
    assert outcome.status == 2
    assert "Verdict: fail" in outcome.out
    for engine in ("liggghts", "yade"):
        assert f"apt install {engine}" in outcome.out


@pytest.mark.usefixtures("no_programs")
@pytest.mark.parametrize(
    ("engine", "words"), [("liggghts", "pair_style gran model hertz"), ("yade", "MindlinPhys")]
)
def test_a_deck_for_another_engine_needs_none(hertzchain: Command, engine: str, words: str) -> None:
    scene_file({"chain.granules": "3"})
    arguments = ["deck", "scene.toml", "--engine", engine, "-o", "chain.py"]
    outcome = hertzchain(*arguments)
    assert (outcome.status, outcome.out, outcome.err) == (0, "", "")
    assert words in Path("chain.py").read_text()


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_what_only_lammps_has_is_refused_for_others(hertzchain: Command, engine: str) -> None:
    scene_file()
    outcome = hertzchain("run", "scene.toml", "--backend", engine, "--isolate")
    assert outcome.status == 2
    assert "--isolate is for --backend lammps" in outcome.err
    outcome = hertzchain("run", "scene.toml", "--backend", engine, "--method", "rk4")
    assert outcome.status == 2
    assert "has only velocity-verlet" in outcome.err


# The rest


def test_a_deck_goes_to_standard_output(hertzchain: Command) -> None:
    scene_file({"chain.granules": "6"})
    printed = hertzchain("deck", "scene.toml")
    assert (printed.status, printed.err) == (0, "")
    assert hertzchain("deck", "scene.toml", "-o", "in.lammps").out == ""
    # But for its own name, which it has only in a file.
    assert Path("in.lammps").read_text() == printed.out.replace("THIS_FILE", "in.lammps")


def test_a_deck_with_a_data_file_is_two_files_or_none(hertzchain: Command) -> None:
    scene_file({"chain.granules": "6"})
    outcome = hertzchain("deck", "scene.toml", "-o", "in.lammps", "--atoms", "data")
    assert (outcome.status, outcome.out, outcome.err) == (0, "", "")
    assert names() == ["in.lammps", "in.lammps.data", "scene.toml"]
    assert "read_data in.lammps.data" in Path("in.lammps").read_text()
    Path("in.other.data").mkdir()
    outcome = hertzchain("deck", "scene.toml", "-o", "in.other", "--atoms", "data")
    is_refused(outcome, "in.other.data: is a directory")
    assert not Path("in.other").exists()
    is_refused(hertzchain("deck", "scene.toml", "--atoms", "data"), "two files", "-o")


def test_the_options_of_a_deck_are_in_it(hertzchain: Command) -> None:
    scene_file({"chain.granules": "6"})
    options = ["--pair-style", "gran/hertz/history", "--watch-every", "7", "--dump-every", "300"]
    text = hertzchain("deck", "scene.toml", "--dt", "100 ns", *options).out
    for words in ("pair_style gran/hertz/history", "watch index 7 ", "dump_every index 300 "):
        assert words in text
    lean = hertzchain("deck", "scene.toml", "--rtol", "1e-3", "--watch-every", "0").out
    assert "watch index" not in lean
    assert "d_true" not in lean


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--rtol", "1e-6", "--dt", "1 ns"), ("--rtol chooses the step",)),
        (("--rtol", "2"), ("rtol = 2", "from 1e-09 to 1")),
        (("--rtol", "1e-15"), ("rtol = 1e-15", "from 1e-09 to 1")),
        (("--dt", "-1 ns"), ("dt = -1e-09", "above 0")),
        (("--dt", "1 m"), ("--dt", "1 m")),
        (("--dt", "1 ms"), ("is unstable", "choose a smaller dt")),
        (("--watch-every", "-1"), ("watch_every = -1",)),
        (("--dump-every", "-1"), ("dump_every = -1",)),
    ],
    ids=" ".join,
)
def test_a_deck_that_cannot_be_is_refused(
    hertzchain: Command, options: tuple[str, ...], words: tuple[str, ...]
) -> None:
    scene_file({"chain.granules": "6"})
    is_refused(hertzchain("deck", "scene.toml", "-o", "in.lammps", *options), *words)
    assert names() == ["scene.toml"]


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


def test_kernels_are_compiled_ahead_for_runs_and_batches() -> None:
    # Types of one process: what is kept on disk is loaded into it.
    code = """
from hertzchain.cli.diagnosis import compile_kernels
from hertzchain.engines.native import kernels, lanes_kernel
compile_kernels()
for kernel in (kernels.march, lanes_kernel.march_lanes):
    single = ["float32" in str(types) for types in kernel.signatures]
    print(*sorted("float32" if one else "float64" for one in single))
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    run, batch = done.stdout.splitlines()
    assert "float64" in run.split()
    assert batch == "float32 float64"


def test_the_doctor_knows_every_package_that_is_needed() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        needed = tomllib.load(file)["project"]["dependencies"]
    listed = {re.split(r"[^\w-]", package)[0] for package in needed} - {"lammps"}
    assert set(PACKAGES) == listed | {"hertzchain"}


def test_the_version_is_that_of_the_package(hertzchain: Command) -> None:
    expected = Outcome(0, f"hertzchain {version('hertzchain')}\n", "")
    assert hertzchain("--version") == process("--version") == expected


def test_the_command_is_installed() -> None:
    (command,) = entry_points(group="console_scripts", name="hertzchain")
    assert command.load() is main


@pytest.mark.parametrize(
    "command",
    [
        *("run", "compare", "tradeoff", "sweep", "plot"),
        *("predict", "deck", "lint", "unit-test", "doctor"),
    ],
)
def test_every_command_has_help(hertzchain: Command, command: str) -> None:
    outcome = hertzchain(command, "--help")
    assert (outcome.status, outcome.err) == (0, "")
    assert "Usage: hertzchain" in outcome.out
    assert command in hertzchain("--help").out


@pytest.mark.parametrize(
    "arguments",
    [
        ["compare", "scene.toml", "--method", "rk4"],
        ["tradeoff", "scene.toml", "--backend", "native"],
        ["predict", "scene.toml", "--rtol", "1e-6"],
        ["predict", "scene.toml", "--report", "report.html"],
        ["compare", "scene.toml", "--junit"],
        *(["run"], ["run", "scene.toml", "--backend", "dem"], ["run", "scene.toml", "extra"]),
        *(["run", "scene.toml", "--method", "euler"], ["run", "scene.toml", "--dt"]),
    ],
    ids=" ".join,
)
def test_what_is_not_there_is_a_usage_error(hertzchain: Command, arguments: list[str]) -> None:
    scene_file()
    outcome = hertzchain(*arguments)
    assert (outcome.status, outcome.out) == (2, "")
    assert "Error: " in outcome.err
    assert "Traceback" not in outcome.err
    assert names() == ["scene.toml"]


def test_a_unit_that_was_forgotten_is_remarked_on(hertzchain: Command) -> None:
    scene_file({"chain.granules": "6"})
    assert hertzchain("predict", "scene.toml").err == ""
    text = Path("scene.toml").read_text(encoding="utf-8")
    changed = re.sub(r"momentum_ratio = .*", "rise_time = 15", text)
    assert changed != text
    Path("scene.toml").write_text(changed, encoding="utf-8")
    outcome = hertzchain("predict", "scene.toml")
    assert outcome.status == 0
    assert re.fullmatch(
        r"hertzchain: LM_ratio is \S+, .* lasts 30 s, is that meant\?\n", outcome.err
    )


@pytest.mark.parametrize(("ratio", "remarked"), [("1e4", False), ("10001", True)])
def test_from_which_momentum_ratio_on_a_scene_is_remarked_on(
    hertzchain: Command, ratio: str, remarked: bool
) -> None:
    scene_file({"chain.granules": "6", "shock.momentum_ratio": ratio})
    outcome = hertzchain("predict", "scene.toml")
    assert outcome.status == 0
    assert ("is that meant?" in outcome.err) == remarked


def test_a_heavy_striker_is_no_pulse_with_a_wrong_unit(hertzchain: Command) -> None:
    path = scene_file({"chain.granules": "6"})
    text = path.read_text(encoding="utf-8").partition("[shock]")[0]
    path.write_text(text + "[striker]\nvelocity = 1.0\nradius = 0.4\n", encoding="utf-8")
    assert Scene.from_toml(path).momentum_ratio > 1e4
    outcome = hertzchain("predict", path)
    assert (outcome.status, outcome.err) == (0, "")
