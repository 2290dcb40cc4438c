"""hertzchain compare: all simulations of a scene and the formulas, with a verdict."""

from __future__ import annotations

from typing import Any

import typer

from hertzchain.cli import options, output
from hertzchain.cli.shown import Shown
from hertzchain.engines.registry import ENGINES, compared_by_default


def compare(
    scene: options.SceneFile,
    backend: list[options.Backend] | None = typer.Option(
        None, help="Backend to compare with the reference; repeatable. Default: native, lammps."
    ),
    isolate: options.Isolate = False,
    lmp: options.LammpsBinary = None,
    ranks: options.Ranks = None,
    rtol: float | None = typer.Option(
        None,
        help="Wanted relative accuracy of the codes that are compared. Default: 1e-6, or 1e-4"
        " where dashpots close at a speed.",
    ),
    as_written: bool = typer.Option(
        False,
        "--as-written",
        help="Compare native with Eq. 1 as written, by SciPy, also where this takes"
        " more than a second or two.",
    ),
    time_limit: options.TimeLimit = "1 h",
    every: options.EveryContact = False,
    as_json: options.AsJson = False,
    plot: options.Plot = None,
    size: options.Size = None,
    report: options.Report = None,
    junit: options.Junit = None,
) -> None:
    """Compare native, LAMMPS and the formulas, with a verdict."""
    from hertzchain.engines.external.step_error import usual_accuracy
    from hertzchain.engines.native.duration import with_end
    from hertzchain.report.comparison import of_comparison
    from hertzchain.report.waterfall import plot_times
    from hertzchain.verdict import comparison

    names = dict.fromkeys(["native", *map(str, backend or compared_by_default())])
    shown = Shown(scene, (), as_json, plot, report, junit, every, size)
    with_lammps = "lammps" in names
    options.refuse_without_need(with_lammps, isolate=isolate, lmp=lmp, ranks=ranks)
    loaded = options.load_scene(scene)
    limit = options.to_time_limit(time_limit)
    wanted = usual_accuracy(loaded) if rtol is None else rtol
    own: dict[str, dict[str, Any]] = {name: {"rtol": wanted} for name in names}
    own["native"] = {"method": "reference"}
    if with_lammps:
        own["lammps"] |= options.lammps_options(isolate, lmp, ranks)
    engines = [ENGINES[name].make(time_limit=limit, **own[name]) for name in names]
    with output.progress() as report_progress, output.compiling(report_progress):
        loaded = with_end(loaded, time_limit=limit)
        record = plot_times(loaded) if report or plot else None
        compared = comparison.compare(
            loaded, engines, record=record, as_written=as_written, progress=report_progress
        )
    shown.end(of_comparison(compared))
