"""The notebooks run as they stand, and what they print is what is kept in them."""

from __future__ import annotations

import re
from typing import Any

import pytest

from docs import run_notebooks as notebooks
from tests.docs.test_docs import agrees

PATHS = sorted(notebooks.FOLDER.glob("*.ipynb"))
LONG = {"figures", "first_scene", "measured_pulse"}
"""They take a second or more: slow tests, which CI runs every time."""


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
    [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in LONG)) for path in PATHS],
    ids=lambda path: path.stem,
)
def test_a_notebook_prints_and_draws_what_it_keeps(path: Any) -> None:
    notebook = notebooks.read(path)
    found = notebooks.run(notebook)
    for cell, outputs in zip(notebooks.code_cells(notebook), found, strict=True):
        shown, printed = texts(cell["outputs"]), texts(outputs)
        assert agrees(shown, printed), f"kept:\n{shown}\nprinted:\n{printed}"
        assert kinds(cell["outputs"]) == kinds(outputs)


def test_the_notebooks_are_there() -> None:
    assert [path.stem for path in PATHS] == ["figures", "first_scene", "measured_pulse", "sweep"]
    for path in PATHS:
        notebook = notebooks.read(path)
        assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
        assert any("image/png" in kind for cell in notebooks.code_cells(notebook)
                   for kind in kinds(cell["outputs"]))  # fmt: skip
        assert [cell["execution_count"] for cell in notebooks.code_cells(notebook)] == list(
            range(1, len(notebooks.code_cells(notebook)) + 1)
        )


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_links_of_a_notebook_lead_somewhere(path: Any) -> None:
    cells = notebooks.read(path)["cells"]
    text = "\n".join(map(notebooks.source_of, cells))
    links = re.findall(r"\]\(([^)#\s]+)", text)
    assert links
    assert [link for link in links if not (path.parent / link).exists()] == []
