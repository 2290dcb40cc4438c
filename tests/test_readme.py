"""What the README shows is run as it stands."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import hertzchain as hc

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


COMMANDS = re.findall(r"^    \.venv/bin/(\S.*)$", README, re.MULTILINE)
COPIES = re.findall(r"^    cp (\S+) (\S+)", README, re.MULTILINE)
TARGETS = re.findall(r"^    make (\S+)", README, re.MULTILINE)


def run(command: str, folder: Path) -> str:
    """Run a command of the README in a folder that has what the README finds in the clone."""
    program, *arguments = shlex.split(command)
    executable = Path(sys.executable).parent / program
    done = subprocess.run(
        [executable, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.lammps
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_works(command: str, tmp_path: Path) -> None:
    for name in ("validation", "lammps_inputs"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / ".venv").symlink_to(Path(sys.executable).parent.parent)
    for source, target in COPIES:
        shutil.copy(ROOT / source, tmp_path / target)
    assert run(command, tmp_path) or list(tmp_path.glob("*.*"))


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
