"""What the README shows is run as it stands; what is built has it, and all it speaks of."""

from __future__ import annotations

import io
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email import message_from_bytes
from functools import partial
from pathlib import Path

import pandas as pd
import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

import hertzchain as hc
from hatch_build import description
from tests.command_line import run_here, run_program
from tests.places import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


COMMANDS = re.findall(r"^    \.venv/bin/(\S.*)$", README, re.MULTILINE)
COPIES = re.findall(r"^    cp (\S+) (\S+)", README, re.MULTILINE)
TARGETS = re.findall(r"^    make (\S+)", README, re.MULTILINE)


VALIDATION = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")


@pytest.mark.lammps
@pytest.mark.parametrize(
    "command",
    [
        # What a page of the documentation shows, too, is run there.
        pytest.param(command, marks=[pytest.mark.slow] * (f"$ {command}" in VALIDATION))
        for command in COMMANDS
    ],
)
def test_a_command_works(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """The first as users run it, the others in this process; in a folder with what a clone has."""
    for name in ("validation", "lammps_inputs"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / ".venv").symlink_to(Path(sys.executable).parent.parent)
    for source, target in COPIES:
        shutil.copy(ROOT / source, tmp_path / target)
    before = {path.name for path in tmp_path.iterdir()}
    monkeypatch.chdir(tmp_path)
    run = run_program if command == COMMANDS[0] else partial(run_here, capfd)
    done = run(*shlex.split(command))
    assert done.status == 0, done.out + done.err
    assert done.out.strip()
    written = re.findall(r"(?:-o|--report) (\S+)", command)
    assert {path.name for path in tmp_path.iterdir()} - before == set(written)
    for name in written:
        text = (tmp_path / name).read_text(encoding="utf-8")
        if name.endswith(".csv"):
            assert len(pd.read_csv(io.StringIO(text), comment="#")) > 0
        else:
            assert name.endswith(".html")
            assert text.rstrip().endswith("</html>")


def test_nothing_is_left_to_be_filled_in() -> None:
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        assert "@@" not in page.read_text(encoding="utf-8"), page


def test_the_commands_are_found() -> None:
    assert len(COMMANDS) >= 4
    assert len(COPIES) == 1
    assert {"demo", "test", "validate"} <= set(TARGETS)


@pytest.mark.parametrize("target", TARGETS)
def test_a_make_target_exists(target: str) -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.search(rf"^{target}:", makefile, re.MULTILINE)


@pytest.mark.lammps
def test_the_python_example_works(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    (example,) = blocks("python")
    exec(compile(example, "README.md", "exec"), {})  # noqa: S102
    assert capsys.readouterr().out.endswith("(2, 59)\npass\n")


def test_the_scene_of_the_readme_is_the_demo_scene(tmp_path: Path) -> None:
    (text,) = blocks("toml")
    file = tmp_path / "scene.toml"
    file.write_text(text, encoding="utf-8")
    scene = hc.Scene.from_toml(file)
    demo = hc.Scene.from_toml(ROOT / "validation" / "scenes" / "demo.toml")
    assert (scene.chain, scene.shock) == (demo.chain, demo.shock)
    assert scene.end_time == pytest.approx(1.2e-3, rel=1e-15, abs=0)


# What is built


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of the source distribution, by their names in the clone."""
    folder = tmp_path_factory.mktemp("sdist")
    (archive,) = SdistBuilder(str(ROOT)).build(directory=str(folder))
    with tarfile.open(archive) as tar:
        files = {member.name.partition("/")[2]: tar.extractfile(member) for member in tar}
        return {name: file.read() for name, file in files.items() if file is not None}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of the wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    (archive,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    with zipfile.ZipFile(archive) as file:
        return {name: file.read(name) for name in file.namelist()}


def files_of_the_clone() -> set[str]:
    """What is under version control; in an unpacked source distribution, what the README needs."""
    if not (ROOT / ".git").exists():
        return {"CONTRIBUTING.md", "LICENSE", "Makefile", "README.md", "requirements.lock"}
    git = ["git", "ls-files", "-z"]
    done = subprocess.run(git, cwd=ROOT, capture_output=True, text=True, check=True)
    return {name for name in done.stdout.split("\0") if name and (ROOT / name).exists()}


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_the_source_distribution_is_the_clone(sdist: dict[str, bytes]) -> None:
    clone = files_of_the_clone()
    assert clone - sdist.keys() == set()
    assert [name for name in clone if sdist[name] != (ROOT / name).read_bytes()] == []


def test_the_wheel_has_the_package_and_nothing_else(wheel: dict[str, bytes]) -> None:
    package = {
        str(path.relative_to(ROOT))
        for path in (ROOT / "hertzchain").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    about = {name for name in wheel if ".dist-info/" in name}
    assert {Path(name).name for name in about} == {
        *("METADATA", "WHEEL", "RECORD", "entry_points.txt", "LICENSE")
    }
    assert wheel.keys() - about == package


def test_the_description_has_no_link_to_a_file(wheel: dict[str, bytes]) -> None:
    (metadata,) = (text for name, text in wheel.items() if name.endswith("/METADATA"))
    message = message_from_bytes(metadata)
    assert message["Description-Content-Type"] == "text/markdown"
    shown = message.get_payload()
    assert isinstance(shown, str)
    assert re.findall(r"\]\((?!https?:|#)", shown) == []
    assert "| How to trust a number (`docs/trust.md`) |" in shown
    # All else is as it stands, code and all.
    code = r"^```.*?^```|^    .*?$"
    found = [re.findall(code, text, re.DOTALL | re.MULTILINE) for text in (README, shown)]
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("readme", "shown"),
    [
        ("see [how](docs/a.md#b).", "see how (`docs/a.md#b`)."),
        ("[CONTRIBUTING.md](CONTRIBUTING.md) says", "`CONTRIBUTING.md` says"),
        ("[a](x.md) and [b](y.md)", "a (`x.md`) and b (`y.md`)"),
        ("[below](#limits)", "[below](#limits)"),
        ("[there](https://example.org)", "[there](https://example.org)"),
    ],
)
def test_links_of_a_description(readme: str, shown: str) -> None:
    assert description(readme) == shown


def test_the_version_is_the_same_everywhere() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "version"
    ]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^version: (\S+)$", citation, re.MULTILINE) == [version]
    assert re.findall(r"^## ([^\s,]+)", changelog, re.MULTILINE)[0] == version
