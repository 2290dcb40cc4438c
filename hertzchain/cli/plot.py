"""hertzchain plot: pictures of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hertzchain.cli.options import Size, by_name, to_inches
from hertzchain.cli.output import progress, say, write_file


def plot(
    folder: Annotated[
        Path, typer.Argument(metavar="OUT", help="What hertzchain sweep -o wrote, done or not.")
    ],
    x: Annotated[
        str,
        typer.Option(
            "--x",
            metavar="NAME",
            help="A column of numbers, such as shock.momentum_ratio; the section may be left out."
            " contact: along the chain, of a sweep with --peaks.",
        ),
    ],
    y: Annotated[
        str,
        typer.Option(
            "--y",
            metavar="NAME",
            help="Another: a result for lines, or points of what was drawn; a parameter that varies"
            " for a map.",
        ),
    ],
    colour: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="What colours tell; in a map the result. Default: the backend, if there are"
            " several.",
        ),
    ] = None,
    where: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Only rows in which a parameter, or the backend, has this value; repeatable.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Picture (png, pdf, svg). Default: OUT/plot.png."
        ),
    ] = None,
    size: Size = None,
) -> None:
    """Draw a sweep: a result over a parameter, a line for each value of the others, or a map.

    Text below the picture names values that are not shown, without numbers or with further
    variations. An axis is logarithmic where its parameter was swept by logarithms, and where what
    is drawn spans more than two decades.
    """
    from hertzchain.files import check_outputs
    from hertzchain.report.formats import check_format
    from hertzchain.sweeps import Sweep
    from hertzchain.sweeps.drawing import SIZE, draw

    swept = Sweep.load(folder)
    target = folder / "plot.png" if output is None else output
    check_format(target, "plot")
    check_outputs([folder / "sweep.json"], [target])
    fixed = by_name("--where", where or [], "shock.profile=cosine")
    inches = to_inches(size) or SIZE
    with progress() as report_progress:
        report_progress(f"drawing {folder}")
        drawn = draw(swept, x, y, colour, fixed, inches)
    for remark in drawn.remarks:
        say(remark)
    write_file("Plot", target, drawn.figure.savefig)
