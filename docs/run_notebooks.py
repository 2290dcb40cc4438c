"""Run the notebooks of docs/notebooks/ and keep what they print and draw in them.

Cells run one after another in this process, each notebook in a folder of its own, as Jupyter would
run them: what a cell prints, its last expression, and the figures that it shows. Jupyter itself is
not needed. ``make notebooks`` runs this script.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl

FOLDER = Path(__file__).parent / "notebooks"

RESOLUTION = 80
"""Of the kept pictures [dots per inch], chosen: 30 kB each."""

Cell = dict[str, Any]
"""A cell as the format of notebooks has it (nbformat 4.5)."""


def read(path: Path) -> dict[str, Any]:
    """The notebook in a file."""
    notebook: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return notebook


def run(notebook: dict[str, Any]) -> list[list[Cell]]:
    """The outputs of each code cell of a notebook, which runs in a folder of its own."""
    mpl.use("Agg")
    names: dict[str, Any] = {"__name__": "__main__"}
    with tempfile.TemporaryDirectory() as folder, _in_folder(folder):
        return [_outputs(source_of(cell), names) for cell in code_cells(notebook)]


def code_cells(notebook: dict[str, Any]) -> list[Cell]:
    """The cells with code, in their order."""
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def source_of(cell: Cell) -> str:
    """The text of a cell."""
    return "".join(cell["source"])


@contextlib.contextmanager
def _in_folder(folder: str) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _outputs(source: str, names: dict[str, Any]) -> list[Cell]:
    """What one cell prints, shows and gives back; a command where it begins with "!"."""
    if source.startswith("!"):
        return [_stream(_command(source[1:]))]
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        value = _value(source, names)
    text = printed.getvalue()
    outputs = [_stream(text)] if text else []
    outputs += [{"output_type": "display_data", "metadata": {}, "data": data} for data in _shown()]
    if value is not None:
        outputs.append(_result(value))
    return outputs


def _command(line: str) -> str:
    """What a command of hertzchain prints on both streams."""
    program = "{sys.executable} -m hertzchain "  # also where the command is not on PATH
    assert line.startswith(program), f"{line} is not run here"
    done = subprocess.run(  # noqa: S603 - a command of this project
        [sys.executable, "-m", "hertzchain", *shlex.split(line.removeprefix(program))],
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout + done.stderr


def _value(source: str, names: dict[str, Any]) -> object:
    """Run the code of a cell; the value of its last line if that is an expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec", dont_inherit=True), names)  # noqa: S102
    if not isinstance(last, ast.Expr):
        return None
    code = compile(ast.Expression(last.value), "cell", "eval", dont_inherit=True)
    return eval(code, names)  # noqa: S307


def _shown() -> Iterator[dict[str, Any]]:
    """Every open figure as a picture; none is open afterwards."""
    from matplotlib import pyplot

    for number in pyplot.get_fignums():
        yield _picture(pyplot.figure(number))
    pyplot.close("all")


def _picture(figure: Any) -> dict[str, Any]:
    png = io.BytesIO()
    figure.savefig(png, format="png", dpi=RESOLUTION)
    text = base64.b64encode(png.getvalue()).decode() + "\n"
    return {"image/png": text, "text/plain": ["<Figure>"]}


def _stream(text: str) -> Cell:
    return {"output_type": "stream", "name": "stdout", "text": text.splitlines(keepends=True)}


def _result(value: object) -> Cell:
    data = {"text/plain": repr(value).splitlines(keepends=True)}
    as_html = getattr(value, "_repr_html_", None)
    if hasattr(value, "savefig"):
        data = _picture(value)
    elif as_html is not None:
        data["text/html"] = as_html().splitlines(keepends=True)
    return {"output_type": "execute_result", "execution_count": None, "metadata": {}, "data": data}


def main() -> None:
    """Run every notebook and write its outputs into it."""
    for path in sorted(FOLDER.glob("*.ipynb")):
        notebook = read(path)
        for number, (cell, outputs) in enumerate(
            zip(code_cells(notebook), run(notebook), strict=True), start=1
        ):
            for output in outputs:
                if "execution_count" in output:
                    output["execution_count"] = number
            cell.update(execution_count=number, outputs=outputs)
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        print(f"{path.name}: {len(code_cells(notebook))} cells run")


if __name__ == "__main__":
    main()
