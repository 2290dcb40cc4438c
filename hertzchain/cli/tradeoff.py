"""hertzchain tradeoff: error against cost."""

from __future__ import annotations

from pathlib import Path

import typer

from hertzchain.cli.options import (
    AsJson,
    SceneFile,
    Size,
    load_scene,
    refuse_without_need,
    to_inches,
)
from hertzchain.cli.output import (
    UNUSABLE,
    check_files,
    compiling,
    progress,
    say,
    show,
    write_file,
)


def tradeoff(
    scene: SceneFile,
    as_json: AsJson = False,
    plot: Path | None = typer.Option(
        None, metavar="FILE", help="Draw error against time (png, pdf, svg)."
    ),
    size: Size = None,
) -> None:
    """Measure error against cost of every method on a scene.

    This takes half a minute for 60 granules.
    """
    from hertzchain.report import figures
    from hertzchain.report.tradeoff import print_tradeoff
    from hertzchain.verdict.tradeoff import tradeoff as measure

    refuse_without_need(plot is not None, size=size is not None)
    inches = to_inches(size)
    loaded = load_scene(scene)
    check_files([scene], plot=plot)
    with progress() as report_progress, compiling(report_progress):
        measured = measure(loaded, progress=report_progress)
    show(as_json, measured.to_dict, lambda console: print_tradeoff(console, [measured]))
    for remark in measured.remarks:
        say(remark)
    write_file("Plot", plot, lambda path: figures.plot_tradeoff([measured], inches).write(path))
    if measured.missing:
        raise typer.Exit(UNUSABLE)
