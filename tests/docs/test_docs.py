"""All blocks of the pages in docs/ are run, and its notebooks; the pages build, and links work."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import hertzchain as hc
from docs import run_notebooks as notebooks
from hertzchain import errors, lammps, theory
from tests.command_line import python, run_here, run_program
from tests.places import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(
    path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md") if "_build" not in path.parts
)
NOTEBOOKS = sorted(notebooks.FOLDER.glob("*.ipynb"))
LINKED = [*(DOCS / name for name in PAGES), *ROOT.glob("*.md"), ROOT / "lammps_inputs/README.md"]

FENCE = re.compile(r"^(?P<ticks>`{3,})(?P<language>\S*)\s*$")
MARK = re.compile(r"^<!-- not run: (?P<reason>.+) -->$")
PROGRESS = re.compile(r"^hertzchain: [\d,]+ of [\d,]+ rows, .* left\n", re.MULTILINE)
LONG = {
    *("damping.md", "decks.md", "experiments.md", "own_deck.md", "pulses.md", "scenes.md"),
    *("solve_ivp.md", "sweeps.md", "trust.md", "tutorial.md", "validation.md"),
}
"""Pages that take a second or more: slow tests, which CI runs every time."""

PROCESSES = {"tutorial.md": 1}
"""Commands of a page that run as users run them; the others run in this process, as that is
quicker."""

BY_SPHINX = {"{toctree}", "{commands}", "{code-map}", "{eval-rst}", "{glossary}"}
"""What is not code: Sphinx makes something of it, or says that it cannot."""

TOKEN = re.compile(
    r"\.\.\.|[-+]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w])|\w+|\S"
)
NUMBER = re.compile(r"[-+]?[\d,]+(?P<decimals>\.\d+)?(?:[eE](?P<exponent>[-+]?\d+))?")


@dataclass(frozen=True)
class Block:
    """A fenced block, with the comment above it.

    ``<!-- not run: REASON -->``: it is shown only.
    """

    line: int
    language: str
    text: str
    not_run: str | None


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a page in their order."""
    lines = text.split("\n")
    mark: re.Match[str] | None = None
    at = 0
    while at < len(lines):
        if fence := FENCE.match(lines[at]):
            end = lines.index(fence["ticks"], at + 1)
            body = "".join(f"{line}\n" for line in lines[at + 1 : end])
            yield Block(at + 1, fence["language"], body, mark["reason"] if mark else None)
            at, mark = end, None
        elif lines[at].strip():
            mark = MARK.match(lines[at])
        at += 1


def close(expected: str, got: str) -> bool:
    """Return whether a token equals the one shown; the last digit of a number may differ by one.

    Another NumPy or LAMMPS rounds otherwise in the last bits, which can turn the last digit shown,
    and no more; of a number with all its digits, some 50 roundings (1e-14). Whole numbers have to
    be what is shown.
    """
    if expected == got:
        return True
    shown, actual = NUMBER.fullmatch(expected), NUMBER.fullmatch(got)
    if not (shown and actual) or (shown["decimals"], shown["exponent"]) == (None, None):
        return False
    unit = 10.0 ** (int(shown["exponent"] or 0) - len(shown["decimals"] or ".") + 1)
    value = float(expected.replace(",", ""))
    difference = abs(value - float(got.replace(",", "")))
    # 1 in decimals is more than 1 in binary, at times.
    return difference <= max(1.001 * unit, 1e-14 * abs(value))


def agrees(expected: str, got: str) -> bool:
    """Return whether output equals the text shown, except for spaces; three dots match anything."""
    shown, actual = TOKEN.findall(expected), TOKEN.findall(got)
    at = k = 0
    dots, restart = -1, 0
    while k < len(actual):
        if at < len(shown) and shown[at] == "...":
            dots, restart = at, k
            at += 1
        elif at < len(shown) and close(shown[at], actual[k]):
            at, k = at + 1, k + 1
        elif dots >= 0:
            restart += 1
            at, k = dots + 1, restart
        else:
            return False
    return set(shown[at:]) <= {"..."}


@pytest.mark.parametrize(
    ("expected", "got", "same"),
    [
        ("F 105.41 N", "F 105.42 N", True),
        ("F 105.41 N", "F 105.43 N", False),
        ("error 1.2e-11", "error 1.2e-10", False),
        ("1,685 steps", "1,686 steps", False),
        ("a ... z", "a b c z", True),
        ("a ... z", "a b c", False),
        ("", "anything", False),
    ],
)
def test_what_is_shown_is_compared(expected: str, got: str, same: bool) -> None:
    assert agrees(expected, got) == same


class Page:
    """One page, run block by block in a folder; its first commands in processes of their own."""

    def __init__(self, folder: Path, capfd: pytest.CaptureFixture[str], processes: int = 0) -> None:
        self.folder, self.capfd, self.processes = folder, capfd, processes
        self.names: dict[str, object] = {"__name__": "__page__"}
        self.said: str | None = None

    def run(self, block: Block) -> None:
        """Run a block, or compare what the one before it has printed."""
        before, self.said = self.said, None
        if block.language not in ("text", "output"):
            assert not before, f"prints what is not shown: {before}"
        if block.language in ("text", "output"):
            assert before is not None, "shows the output of nothing: no python block before it"
            self.expect(block.text, before)
        elif block.language == "python":
            # Lines of a traceback are those of the page.
            code = compile("\n" * block.line + block.text, "page", "exec", dont_inherit=True)
            exec(code, self.names)  # noqa: S102
            self.said = self.capfd.readouterr().out
        elif block.language in ("toml", "sh"):  # a deck of LAMMPS is shown as sh
            self.write(block.text, "# ")
        elif block.language == "console":
            self.console(block.text)
        else:
            raise AssertionError(f"a block of {block.language or 'no language'}: nobody runs it")

    def write(self, text: str, comment: str) -> None:
        """Write a file whose name is the comment in its first line."""
        first = text.partition("\n")[0]
        assert first.startswith(comment), "needs the name of its file as a comment in line 1"
        name = first.removeprefix(comment)
        assert Path(name).name == name
        (self.folder / name).write_text(text, encoding="utf-8")

    def console(self, text: str) -> None:
        """Run commands and compare their output with the text below them."""
        assert text.startswith("$ ")
        for part in re.split(r"^\$ ", text.replace("\\\n", " "), flags=re.MULTILINE)[1:]:
            command, _, shown = part.partition("\n")
            status = 0
            if actual := re.match(r"# status (\d+)\n", shown):
                status, shown = int(actual[1]), shown[actual.end() :]
            program, *arguments = shlex.split(command)
            assert program in ("hertzchain", "python"), f"{program} is not run here"
            self.processes -= 1
            if self.processes >= 0:
                done = run_program(program, *arguments, folder=self.folder)
            else:
                done = run_here(self.capfd, program, *arguments)
            # A sweep says how far it is every 30 s: on a busy machine it may take so long.
            said = done.out + PROGRESS.sub("", done.err)
            assert done.status == status, f"{command}\n{said}"
            self.expect(shown, said)

    @staticmethod
    def expect(shown: str, said: str) -> None:
        """Fail where something else was printed than is shown."""
        assert agrees(shown, said), f"shown:\n{shown}\nprinted:\n{said}"


@pytest.mark.lammps
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in PAGES]
)
def test_a_page_does_what_it_says(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    for linked in ("validation", "lammps_inputs"):
        (tmp_path / linked).symlink_to(ROOT / linked)
    monkeypatch.chdir(tmp_path)
    page = Page(tmp_path, capfd, PROCESSES.get(name, 0))
    for block in blocks((DOCS / name).read_text(encoding="utf-8")):
        if block.language in BY_SPHINX or block.not_run:
            continue
        try:
            page.run(block)
        except Exception as problem:
            problem.add_note(f"docs/{name}, block in line {block.line}")
            raise
    assert not page.said, f"prints what is not shown: {page.said}"


def read(path: Path) -> str:
    """The text of a page, or of the cells of a notebook."""
    if path.suffix == ".ipynb":
        return "\n".join(map(notebooks.source_of, notebooks.read(path)["cells"]))
    return path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", [*LINKED, *NOTEBOOKS], ids=lambda path: path.name)
def test_links_and_images_are_there(path: Path) -> None:
    text = re.sub(r"^```.*?^```", "", read(path), flags=re.DOTALL | re.M)
    targets = re.findall(r"\]\(([^)\s#]+)(?:#[^)\s]*)?\)", text)
    local = [target for target in targets if not re.match(r"https?:|mailto:", target)]
    assert [target for target in local if not (path.parent / target).exists()] == []


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages as HTML; a warning is an error."""
    folder = tmp_path_factory.mktemp("docs")
    done = python(
        *("-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"),
        *("-d", folder / "doctrees", DOCS, folder / "html"),
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.mark.slow
def test_the_pages_build_and_document_every_public_name(built: Path) -> None:
    from sphinx.util.inventory import InventoryFile

    inventory = InventoryFile.loads((built / "objects.inv").read_bytes(), uri="")
    kinds = ("py:class", "py:function", "py:exception", "py:module")
    documented = {name for kind in kinds for name in inventory.data[kind]}
    wanted = {f"hertzchain.{name}" for name in hc.__all__}
    wanted |= {f"hertzchain.theory.{name}" for name in theory.__all__}
    wanted |= {f"hertzchain.lammps.{name}" for name in lammps.__all__}
    wanted |= {
        f"hertzchain.errors.{name}"
        for name, value in vars(errors).items()
        if isinstance(value, type) and issubclass(value, hc.HertzchainError)
    }
    assert wanted - documented == {"hertzchain.lammps.Lammps"}  # hertzchain.Lammps
    methods = {f"hertzchain.{name}.run" for name in ("Native", "Lammps", "Liggghts", "Yade")}
    assert methods <= set(inventory.data["py:method"])  # those of a base class, too


# Notebooks run as they stand, and print what is kept in them


SLOW = {"figures", "first_scene", "measured_pulse"}


def texts(outputs: list[dict[str, Any]]) -> str:
    """What a cell printed and gave back as text."""
    lines = [output.get("text") or output["data"]["text/plain"] for output in outputs]
    return "".join("".join(part) for part in lines)


def kinds(outputs: list[dict[str, Any]]) -> list[set[str]]:
    """The forms that each output has: text, picture, page."""
    return [set(output.get("data", {"stream": ""})) for output in outputs]


@pytest.mark.lammps
@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in SLOW)) for path in NOTEBOOKS],
    ids=lambda path: path.stem,
)
def test_a_notebook_prints_and_draws_what_it_keeps(path: Any) -> None:
    notebook = notebooks.read(path)
    actual = notebooks.run(notebook)
    for cell, outputs in zip(notebooks.code_cells(notebook), actual, strict=True):
        shown, printed = texts(cell["outputs"]), texts(outputs)
        assert agrees(shown, printed), f"kept:\n{shown}\nprinted:\n{printed}"
        assert kinds(cell["outputs"]) == kinds(outputs)
