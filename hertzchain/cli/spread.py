"""hertzchain spread: what uncertain values and scatter do to the results of a scene."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli import options
from hertzchain.cli.output import check_files, compiling, progress, show, write_file


def spread(
    scene: options.SceneFile,
    realisations: int = typer.Option(
        256, "-n", "--realisations", metavar="N", help="How many runs; a power of two is taken."
    ),
    rtol: float = typer.Option(1e-4, help="Wanted relative accuracy of each run."),
    time_limit: options.TimeLimit = "1 h",
    output: Path | None = typer.Option(
        None, "-o", "--output", help="Write the spread of all results (.csv, .parquet, .json)."
    ),
    plot: Path | None = typer.Option(
        None,
        metavar="FILE",
        help="Draw first peaks along the chain with their range, and who causes it (png, pdf,"
        " svg).",
    ),
    size: options.Size = None,
    every: options.EveryContact = False,
    as_json: options.AsJson = False,
) -> None:
    """Show what uncertain values do to the results.

    The scene is run many times, with values drawn from its [uncertainty] and [scatter].
    """
    from hertzchain.report.formats import check_format
    from hertzchain.report.tables import write_result
    from hertzchain.uncertainty import spread as spreads
    from hertzchain.uncertainty.shown import plot_spread, print_spread

    options.refuse_without_need(plot is not None, size=size is not None)
    check_format(output, "result")
    check_files([scene], result=output, plot=plot)
    loaded, inches = options.load_scene(scene), options.to_inches(size)
    limit = options.to_time_limit(time_limit)
    with progress() as report_progress, compiling(report_progress):
        results = spreads.spread(
            loaded, realisations, rtol=rtol, time_limit=limit, progress=report_progress
        )
    show(as_json, results.to_dict, lambda console: print_spread(console, results, every))
    write_file("Spread", output, lambda path: write_result(results, path))
    write_file("Plot", plot, lambda path: plot_spread(results, inches).write(path))
