"""hertzchain plot: pictures of a sweep."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli.options import Size, by_name, to_inches
from hertzchain.cli.output import check_files, progress, say, write_file


def plot(
    folder: Path = typer.Argument(
        ..., metavar="OUT", help="Folder that hertzchain sweep -o wrote, complete or not."
    ),
    x: str = typer.Option(
        ...,
        "--x",
        metavar="NAME",
        help="A column of numbers, such as shock.momentum_ratio; the section may be left out."
        " contact: along the chain, of a sweep with --peaks.",
    ),
    y: str = typer.Option(
        ...,
        "--y",
        metavar="NAME",
        help="Another column: a result, for lines or points; a parameter that varies, for a map.",
    ),
    colour: str | None = typer.Option(
        None,
        metavar="NAME",
        help="Column that colours show; in a map the result. Default: the backend, if several.",
    ),
    where: list[str] | None = typer.Option(
        None,
        metavar="NAME=VALUE",
        help="Draw only rows in which a parameter, or the backend, has this value; repeatable.",
    ),
    output: Path | None = typer.Option(
        None,
        "-o",
        "--output",
        metavar="FILE",
        help="Picture (png, pdf, svg). Default: OUT/plot.png.",
    ),
    size: Size = None,
) -> None:
    """Draw a sweep: a result over a parameter, or a map.

    Other parameters are a line for each value. Text below the picture names values that are not
    shown, without numbers or with further variations. An axis is logarithmic if its parameter was
    swept with :log, or if the drawn values span more than two decades.
    """
    from hertzchain.sweeps import Sweep
    from hertzchain.sweeps.drawing import SIZE, draw

    swept = Sweep.load(folder)
    target = folder / "plot.png" if output is None else output
    check_files([folder / "sweep.json"], plot=target)
    fixed = by_name("--where", where or [], "shock.profile=cosine")
    inches = to_inches(size) or SIZE
    with progress() as report_progress:
        report_progress(f"drawing {folder}")
        drawn = draw(swept, x, y, colour, fixed, inches)
    for remark in drawn.remarks:
        say(remark)
    write_file("Plot", target, drawn.figure.write)
