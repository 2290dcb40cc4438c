"""hertzchain run --uncertainty: what uncertain values make of the results of a scene."""

from __future__ import annotations

from pathlib import Path

from hertzchain.cli import options
from hertzchain.cli.output import check_files, compiling, progress, show, write_file


def run_uncertain(
    scene: Path, realisations: int, rtol: float | None, limit: float, output: Path | None,
    plot: Path | None, size: str | None, every: bool, as_json: bool,
) -> None:  # fmt: skip
    """Print the spread of a scene's results, and write its table and its picture."""
    from hertzchain.report.tables import write_result
    from hertzchain.uncertainty.shown import plot_spread, print_spread
    from hertzchain.uncertainty.spread import RTOL, spread

    check_files([scene], result=output, plot=plot)
    loaded, inches = options.load_scene(scene), options.to_inches(size)
    with progress() as report_progress, compiling(report_progress):
        found = spread(
            loaded,
            realisations,
            rtol=RTOL if rtol is None else rtol,
            time_limit=limit,
            progress=report_progress,
        )
    show(as_json, found.to_dict, lambda console: print_spread(console, found, every))
    write_file("Spread", output, lambda path: write_result(found, path))
    write_file("Plot", plot, lambda path: plot_spread(found, inches).write(path))
