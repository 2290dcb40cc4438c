"""Bad input, one line each: a command is refused in one sentence that has these words.

Status 2, nothing on standard output, one line on standard error, and no file is made or changed.
"""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import pytest

import hertzchain as hc
from tests.cli.short_chain import scene_file
from tests.command_line import Command, is_refused
from tests.examiner.corpus import FOLDER
from tests.recordings import write_scope

GRID = "--vary shock.momentum_ratio=0.5,1"

REFUSED = """
run text.csv => text.csv: is not TOML
run scene.toml --backend lammps --dt 0 => dt
run scene.toml --rtol 1e-3 --dt '1 us' => rtol = 0.001: chooses method and step: leave out method and dt, or rtol
run scene.toml --backend lammps --method rk4 => --method rk4; velocity-verlet
run scene.toml --backend liggghts => liggghts is missing or not a program: install it with: apt install liggghts
run scene.toml --backend yade => yade is missing or not a program: install it with: apt install yade
run scene.toml --backend liggghts --method rk4 => has only velocity-verlet
run scene.toml -o peaks.xls => peaks.xls; .csv; .parquet
run scene.toml --record 20 => --record; -o, --plot, --report
spread scene.toml => nothing is uncertain: add [uncertainty] or [scatter]
spread scene.toml -n 5 => realisations = 5: must be an integer from 16
spread scene.toml -o a.xls => a.xls; .csv; .parquet
spread scene.toml --size 3x2 => --size; --plot
run scene.toml --record 20 -o motion.json => motion.json; .parquet
run scene.toml --plot run.gif => run.gif; .png
run scene.toml --plot a.png -o a.png => a.png
run scene.toml --size 3x2 => --size goes with --plot
run scene.toml --plot a.png --size 1x9 => --size 1x9: must be width and height
run scene.toml --lmp lmp => --lmp is for --backend lammps: add that, or leave --lmp out
run scene.toml --ranks 2 => --ranks is for --backend lammps: add that, or leave --ranks
run scene.toml --backend lammps --lmp /no/lmp => /no/lmp is missing or not a program
compare scene.toml --ranks 2 => ranks = 2: the lammps module runs on one process: name also a LAMMPS binary
compare scene.toml --ranks 0 => ranks = 0: must be at least 1
run scene.toml --record 1 -o a.csv => record = 1: must be from 2 to
compare scene.toml --time-limit nan => --time-limit = 'nan': must be a finite number above
compare scene.toml --plot plot.xyz => plot.xyz; png; svg
compare scene.toml --backend native --junit scene.toml => name
compare scene.toml --report a.html --junit a.html => name
tradeoff scene.toml --plot plot.xyz => plot.xyz; png; svg
judge scene.toml peaks.csv --tolerance 0 => tolerance
judge scene.toml peaks.csv --dt '1 s' => unstable
judge scene.toml peaks.csv --column F => --column F: must be NAME=VALUE
judge scene.toml peaks.csv peaks.csv => peaks.csv; is not a LAMMPS dump
judge scene.toml none.csv => none.csv; cannot be read
judge scene.toml peaks.csv --report report.pdf => report.pdf; .html or .htm
judge scene.toml in.steel_plain => in.steel_plain: is no table; must be a CSV file with a header
examine steel.toml in.steel_plain --var a => --var; NAME
examine steel.toml in.steel_plain --var a=1 --var a=2 => --var a
examine steel.toml in.steel_plain --tolerance 2 => tolerance; below 1
examine steel.toml in.steel_plain --report in.steel_plain => in.steel_plain
examine steel.toml in.steel_plain --fix in.steel_plain => in.steel_plain
examine steel.toml in.steel_plain --lmp /no/lmp => /no/lmp
examine steel.toml my.py => my.py; must be a LAMMPS input script
deck scene.toml -o scene.toml => name
deck scene.toml -o in.chain --rtol 1e-6 --dt '1 ns' => --rtol chooses the step
deck scene.toml -o in.chain --rtol 1e-15 => rtol = 1e-15; from 1e-09 to 1
deck scene.toml -o in.chain --dt '1 m' => --dt; 1 m
deck scene.toml -o in.chain --dt '1 ms' => is unstable; choose a smaller dt
deck scene.toml -o in.chain --watch-every 0 => watch_every = 0: must be at least 1
unit-test scene.toml -o scene.toml => name
sweep scene.toml -o out --vary shock.colour=1,2 => cannot vary; what can vary
sweep scene.toml -o out --vary shock.momentum_ratio= => must be NAME=VALUE, such as
sweep scene.toml -o out => --vary or --table: name what varies
sweep scene.toml -o out GRID --table peaks.csv => --vary or --table: name what varies
sweep scene.toml -o out --table peaks.csv => contact: cannot vary; the scene has no [contact]
sweep scene.toml -o out --table own_unit.csv => chain.radius = '5 mm': must be a number without a unit; column is mm (row 2 of the table)
sweep scene.toml -o out --table wrong_unit.csv => chain.radius = '5 kg': has the wrong dimension; (row 2 of the table)
compare scene.toml --rtol 1e-30 => rtol = 1e-30: must be a number from 1e-10 to below 1
sweep scene.toml -o out --table scene.toml => scene.toml: must be a table of scenes; .csv or .parquet
sweep scene.toml -o out --table no.csv => no.csv; No such file
sweep scene.toml -o out GRID --rtol 1e-30 => rtol = 1e-30: must be
sweep scene.toml -o out --vary granules=2000000 => chain.granules; must be at most 1,000,000 in a sweep
sweep scene.toml -o out GRID --time-limit '-1 s' => --time-limit = '-1 s'
sweep scene.toml -o out GRID --backend native --backend native => and none twice
sweep scene.toml -o out GRID --scheduler abc => the scheduler 'abc' cannot be
sweep scene.toml -o out.csv GRID => must be a folder
sweep scene.toml -o scene.toml/out GRID => cannot be made
plot swept --x lm --y p => lm: is not a column; scene, backend, chain.granules
plot swept --x LM_ratio --y profile => shock.profile: is text; --colour
plot swept --x backend --y p => backend: is text
plot swept --x LM_ratio --y p --colour failure => cannot be a colour
plot swept --x LM_ratio --y momentum_ratio => shock.momentum_ratio: given twice
plot swept --x LM_ratio --y p --colour p => transition_granules: given twice
plot swept --x LM_ratio --y p -o plot.gif => plot.gif; png; svg
plot swept --x LM_ratio --y p -o scene.toml/plot.png => scene.toml/plot.png: cannot be written
plot swept --x LM_ratio --y p --where profile => --where profile; NAME=VALUE
plot swept --x LM_ratio --y p --where backend=native --where backend=lammps => --where backend; twice
plot . --x LM_ratio --y p => .: is not a sweep, must be what hertzchain sweep -o wrote
plot no --x LM_ratio --y p => no: is not a sweep, must be what hertzchain sweep -o wrote
plot begun --x LM_ratio --y p => the sweep has no rows yet: run the same sweep
fit scene.toml tiny.csv --free chain.density --own-clocks --no-shift => --own-clocks: cannot go with --no-shift; leave one
fit scene.toml tiny.csv --free chain.density => peak forces: must be from 1e-60 to 1e+60 N
pulse scope.csv => column 2 (CH1) is in V; --scale
pulse scope.csv -o scope.csv --scale 25 => scope.csv: is an input, and must not be overwritten
pulse scope.csv -o a.csv --scale -25 => pulls; a pulse pushes; --scale
pulse scope.csv --scale 25 --start '1 s' => --start = 1.0: must be a time of the file
pulse scope.csv --start '1 N' => --start; wrong dimension
pulse scope.csv --scale 25 --rows 2 => --rows = 2: must be at least 3
pulse scope.csv --plot a.gif => cannot be drawn
pulse no.csv => no.csv: cannot be read
pulse text.csv => line 2: has no finite time and force
init scene.toml/mine.toml => cannot be written
init new.csv --from pulse-table => new.csv: is the name of the pulse table; new.toml
init . => is a directory, must be the name of a file
init scene.toml => scene.toml: exists; name another file, or delete it
run => missing argument 'SCENE'
frob => no such command 'frob'
run scene.toml --frob => no such option: --frob
run scene.toml --rtol abc => --rtol abc: must be a number
run scene.toml --ranks 1.5 => --ranks 1.5: must be an integer
run scene.toml --backend abaqus => --backend abaqus; is not one of 'native', 'lammps'
"""  # noqa: E501 - a line is a case
"""Commands, and what their sentence has. ``scene.toml`` has six granules and a pulse."""

LINES = "'two\nlines{}'"
"""The name of a file, for a shell."""

STEPS = ("0", "-1 ns", "inf", "nan", "1 m", "soon", "", "1e-320", "1 s s")


@pytest.fixture(scope="module")
def templates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of each kind."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        scene = hc.Scene.from_toml(scene_file({"chain.granules": "6"}))
        hc.sweep(scene, {"shock.momentum_ratio": "0.5,1"}, output="swept")
    (folder / "begun").mkdir()
    shutil.copy(folder / "swept" / "sweep.json", folder / "begun")
    write_scope(folder / "scope.csv", 1000)
    for name in ("steel.toml", "in.steel_plain"):
        shutil.copy(FOLDER / name, folder)
    (folder / "peaks.csv").write_text("contact,peak_force_N\n2,100\n", encoding="utf-8")
    tiny = "contact,peak_force_N\n2,1e-298\n3,1e-298\n4,2e-298\n"
    (folder / "tiny.csv").write_text(tiny, encoding="utf-8")
    (folder / "my.py").write_text('"""A chain\nof granules."""\nimport lammps\n', encoding="utf-8")
    (folder / "own_unit.csv").write_text("chain.radius [mm]\n4\n5 mm\n", encoding="utf-8")
    (folder / "wrong_unit.csv").write_text("chain.radius\n4 mm\n5 kg\n", encoding="utf-8")
    rows = "\n".join(f"{k},1" for k in range(3, 20))
    (folder / "text.csv").write_text(f"1,2\n2,x\n{rows}", encoding="utf-8")
    return folder


@pytest.fixture
def files(templates: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """These files in the current folder; LIGGGHTS and Yade are not there."""
    monkeypatch.setenv("PATH", "")
    shutil.copytree(templates, folder, dirs_exist_ok=True)
    return folder


CASES = [line.replace("GRID", GRID) for line in REFUSED.strip().splitlines()]
CASES += [f"run scene.toml --dt {shlex.quote(step)} => dt" for step in STEPS]
CASES += [
    f"run scene.toml -o {LINES.format('.xls')} => two\\nlines.xls: cannot be written",
    f"run scene.toml -o peaks.csv/{LINES.format('/a.csv')} => lines/a.csv: cannot be written",
    f"examine steel.toml {LINES.format('')} => two\\nlines: cannot be read",
    f"run scene.toml --backend lammps --lmp {LINES.format('')} => two\\nlines is missing",
]
CASES += [
    f"{command} no.toml => no.toml; No such file; must be a TOML file"
    for command in ("run", "compare", "tradeoff", "timestep", "deck", "unit-test", "predict")
]


@pytest.mark.parametrize("case", CASES)
def test_it_is_refused_in_one_sentence(case: str, files: Path, hertzchain: Command) -> None:
    command, _, words = case.partition(" => ")
    before = {path: path.is_dir() or path.read_bytes() for path in files.rglob("*")}
    is_refused(hertzchain(*shlex.split(command)), *words.split("; "))
    assert {path: path.is_dir() or path.read_bytes() for path in files.rglob("*")} == before
