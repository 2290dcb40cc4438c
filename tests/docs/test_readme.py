"""All blocks of the README are run; built packages contain it and all files that it names."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

import hertzchain as hc
from docs import draw_picture
from hatch_build import description
from tests.command_line import run_here
from tests.docs.test_docs import Page, blocks
from tests.places import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.lammps
def test_what_the_readme_shows_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Scene, command and Python as a page of the documentation; the command as users run it."""
    monkeypatch.chdir(tmp_path)
    page = Page(tmp_path, capfd, processes=1)
    shown = list(blocks(README))
    for block in shown:
        page.run(block)
    assert not page.said
    assert [block.language for block in shown] == ["toml", "console", "python", "text"]
    assert [block.not_run for block in shown] == [None] * 4


@pytest.mark.slow  # CI runs it every time
@pytest.mark.lammps
def test_the_commands_of_the_table_run_in_its_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Next to the scene of the README; ``certify`` takes a minute, and tests/known run it."""
    monkeypatch.chdir(tmp_path)
    Page(tmp_path, capfd).run(next(blocks(README)))
    commands = re.findall(r"^\| [^|]+ \| `hertzchain ([^`]+)` \|$", README, re.MULTILINE)
    assert len(commands) == 12
    for words in map(shlex.split, commands):
        done = run_here(capfd, "hertzchain", *words, *["--help"] * (words == ["certify"]))
        assert done.status == 0, f"{words}\n{done.err}"


def test_the_scene_of_the_readme_is_the_demo_scene(tmp_path: Path) -> None:
    (text,) = (block.text for block in blocks(README) if block.language == "toml")
    file = tmp_path / "scene.toml"
    file.write_text(text, encoding="utf-8")
    scene = hc.Scene.from_toml(file)
    demo = hc.Scene.from_toml(ROOT / "validation" / "scenes" / "demo.toml")
    assert (scene.chain, scene.shock) == (demo.chain, demo.shock)


@pytest.mark.slow  # CI runs it every time
@pytest.mark.lammps
def test_the_picture_is_what_its_script_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every word of it; the last digits of differences are round-off of one machine."""
    drawn = tmp_path / "picture.svg"
    monkeypatch.setattr(sys, "argv", ["draw_picture.py", "-o", str(drawn)])
    draw_picture.main()
    (shown,) = re.findall(r"^!\[[^\]]+\]\(([^)]+)\)$", README, re.MULTILINE)
    kept, passages = words_of(ROOT / shown), words_of(drawn)
    assert kept == passages
    assert {"Verdict: pass", "peaks against the reference", "100 N", "time [ms]"} <= set(passages)


def words_of(path: Path) -> list[str]:
    """Every text of a figure, without differences such as 3e-08."""
    passages = re.findall(r"<!-- (.+) -->", path.read_text(encoding="utf-8"))
    return [text for text in passages if not re.fullmatch(r"\d(e-\d+)?", text)]


# Built packages


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
    assert "Installing (`docs/install.md`) has other ways" in shown
    # All else is as it stands, code and all.
    assert "docs/picture.svg" not in shown
    code = r"^```.*?^```|^    .*?$"
    passages = [re.findall(code, text, re.DOTALL | re.MULTILINE) for text in (README, shown)]
    assert passages[0] == passages[1]


@pytest.mark.parametrize(
    ("readme", "shown"),
    [
        ("[CONTRIBUTING.md](CONTRIBUTING.md) says", "`CONTRIBUTING.md` says"),
        ("[a](x.md#c) and [b](y.md)", "a (`x.md#c`) and b (`y.md`)"),
        ("a\n\n![b, c](docs/d.svg)\n\ne [f](g.md)", "a\n\ne f (`g.md`)"),
        ("[below](#limits), [there](https://x.org)", "[below](#limits), [there](https://x.org)"),
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
